"""Chains of four-bar linkages: accelerations compared with equations by hand with 60 digits and a closed form, growth, energy."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import symdyn as sd
from symdyn.cli import main
from symdyn.errors import ArgumentError
from symdyn.lab import windows
from symdyn.lab.bridges import Bridge, by_hand
from symdyn.lab.windows import design, exact
from symdyn.runtime.building.compiler import find_compiler


@pytest.mark.parametrize("n", [1, 3])
def test_equations_by_hand_have_the_acceleration_of_parallelograms(n: int) -> None:
    """theta_ddot = g ((n + 1)/2 + n)/((n + 1)/3 + n) sin theta, of all alike; phi turns against theta."""
    names = [*(f"theta{j}" for j in range(n + 1)), *(f"phi{i}" for i in range(1, n + 1))]
    q = np.repeat([0.4, -0.4], [n + 1, n])
    wanted = 9.81 * ((n + 1) / 2 + n) / ((n + 1) / 3 + n) * np.sin(0.4)
    found, condition = exact(n, names, q, 2.5 * q)
    np.testing.assert_allclose(found, wanted * np.sign(q), rtol=1e-14)
    assert 1 < condition < 1e3


def test_accelerations_are_those_of_equations_by_hand() -> None:
    """At a state with rounding, and in coordinates in another order."""
    module = sd.systems.get("n_four_bar", n=2).augmented().compile(backend="numpy")
    q, u = module.consistent(q=np.array([0.3, 0.9, 0.6, -0.1, -0.2]), u=np.array([1.0, 0.5, 0.7, -1.0, 0.2]))
    found = module.rhs(0.0, np.concatenate([q, u]))[5:]
    wanted, _ = exact(2, module.metadata.q, q, u)
    assert np.abs(found - wanted).max() <= 1e-12 * np.abs(wanted).max()
    order = [3, 0, 4, 2, 1]
    again, _ = exact(2, [module.metadata.q[k] for k in order], q[order], u[order])
    assert np.array_equal(again, wanted[order])


def test_angles_of_more_digits_than_floats() -> None:
    """A single bar hangs from its pivot: its acceleration at the right angle of 60 digits vanishes."""
    from flint import arb, ctx

    bridge = Bridge(design(1).bars[:1], ())
    with ctx.workprec(200):
        turns, _ = by_hand(bridge, [-arb.pi() / 2], [0.0])
    assert abs(turns[0, 2]) < 1e-50
    assert 1e-17 < abs(by_hand(bridge, [-np.pi / 2], [0.0])[0][0, 2]) < 1e-14


@pytest.mark.skipif(find_compiler() is None, reason="no C compiler here")
def test_work_grows_with_the_number_of_windows(capsys: pytest.CaptureFixture[str], tmp_path: Any) -> None:
    assert main(["bench", "windows", "--sizes", "3", "6", "--json", str(tmp_path / "found.json")]) == 0
    lines = capsys.readouterr().out.splitlines()
    operations = [int(line.split()[3]) for line in lines[1:3]]
    assert lines[0] == windows.HEADING and (tmp_path / "found.json").exists() and operations[1] < 2.2 * operations[0]


def test_numbers_of_windows() -> None:
    with pytest.raises(ArgumentError, match=r"1 window or more; found 0 10$"):
        windows.run((0, 10))
