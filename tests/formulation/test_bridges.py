"""Footbridges of pin-jointed bars in absolute coordinates: freedoms, accelerations compared with equations by hand, energy."""

from __future__ import annotations

import dataclasses
import functools
import re
from typing import Any

import numpy as np
import pytest

from symdyn.cli import main
from symdyn.errors import ArgumentError
from symdyn.lab import bridges
from symdyn.lab.bridges import _places, by_hand, design, footbridge, swinging
from symdyn.runtime.building.compiler import find_compiler
from tests.helpers import swept


@functools.cache
def absolute(bars: int) -> Any:
    return footbridge(bars).augmented(coordinates="absolute")


def test_bars_meet_where_they_are_designed() -> None:
    bridge = design(200)
    ends = {bar.name: bar.b for bar in bridge.bars}
    assert len(bridge.bars) == 200 and all(bar.a == ends[bar.on] for bar in bridge.bars if bar.on)
    assert all(ends[first] == pytest.approx(ends[second]) for first, second in bridge.closing if second)
    for wrong in (8, 21):
        with pytest.raises(ArgumentError, match=rf"3 n \+ 2 bars, n being 3 or more; found {wrong}; take (11|20)$"):
            design(wrong)


def test_accelerations_are_those_of_equations_by_hand() -> None:
    """One freedom of 33 speeds: at a swing, by the Schur complement in absolute and by elimination in relative coordinates."""
    module = absolute(11).compile(backend="numpy")
    q, u = swinging(module, 11)
    places = list(_places(module, design(11)).values())
    exact, _ = by_hand(design(11), *(values[places][:, 2].tolist() for values in (q, u)))
    found = module.rhs(0.0, np.concatenate([q, u]))[33:][places]
    assert np.abs(u).max() > 0.3 and np.abs(found - exact).max() <= 1e-11 * np.abs(exact).max()
    # The same by relative angles: those of bars hung on others are differences.
    relative = footbridge(11).augmented().compile(backend="numpy")
    names = [f"q_{bar.name}" for bar in design(11).bars]
    number = {bar.name: k for k, bar in enumerate(design(11).bars)}
    back = np.array([number[bar.on] if bar.on else -1 for bar in design(11).bars])

    def differences(angles: Any) -> np.ndarray:
        return angles - np.where(back >= 0, angles[back], 0.0)

    at = np.concatenate([differences(values[places][:, 2]) for values in (q, u)])
    order = [relative.metadata.q.index(name) for name in names]
    x = np.zeros(22)
    x[order], x[[11 + k for k in order]] = at[:11], at[11:]
    assert np.abs(relative.rhs(0.0, x)[11:][order] - differences(exact[:, 2])).max() <= 1e-9 * np.abs(exact).max()


@pytest.mark.parametrize("bars", [11, *swept([20])])
def test_a_way_that_fails_at_every_state_is_not_taken(bars: int) -> None:
    """Elimination takes fewer operations, but a pivot of it is too small at the swing and next to it: the numeric algorithm took
    over at every evaluation. By the way that is taken no pivot is too small there."""
    equations = absolute(bars)
    how = next(note for note in equations.notes if note.startswith("accelerations by"))
    assert re.match(r"accelerations by Schur complement of the mass matrix: (\d+) operations \(", how)
    assert re.search(r"elimination of the dependent speeds .*, \d+, fails at \d+ % of the states tried;", how)
    module = equations.compile(backend="numpy")
    regular = dataclasses.replace(equations, singular_fallback=None).compile(backend="numpy")
    x = np.concatenate(swinging(module, bars))
    for state in (x, x + 1e-3 * np.random.default_rng(1).normal(size=len(x))):
        found = regular.rhs(0.0, state)  # raises where a pivot is too small
        assert np.abs(found - module.rhs(0.0, state)).max() <= 1e-12 * np.abs(found).max()


@pytest.mark.sweep
@pytest.mark.skipif(find_compiler() is None, reason="no C compiler here")
def test_work_grows_with_the_number_of_bars(capsys: pytest.CaptureFixture[str], tmp_path: Any) -> None:
    assert main(["bench", "bridges", "--sizes", "50", "101", "--json", str(tmp_path / "found.json")]) == 0
    lines = capsys.readouterr().out.splitlines()
    a_bar = [int(line.split()[5]) for line in lines[1:3]]
    assert lines[0] == bridges.HEADING and (tmp_path / "found.json").exists() and a_bar[1] < 1.1 * a_bar[0]
