"""Sensitivities whose columns are one piece of code in a loop: the same as by a piece of code for each."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import symdyn as sd
from symdyn.backend import columns
from symdyn.backend.right_side import RightSide
from symdyn.emission import emit_with
from symdyn.functions.tapes import columns_of
from symdyn.runtime.building.compiler import find_compiler, require_compiler
from symdyn.runtime.building.library import CLibrary
from tests.backend.c_warnings import faults_of
from tests.helpers import swept

pytestmark = pytest.mark.skipif(find_compiler() is None, reason="no C compiler here")


def source(equations: Any, names: tuple[str, ...], looped: bool, held: tuple[str, ...] = ()) -> Any:
    """A right-hand side with sensitivities, in a loop or with a piece of code for every column."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(columns, "LOOPED", 0 if looped else np.inf)
        return emit_with(equations, "c", ("rhs",), RightSide(sensitivities=names, held=held, integrated=False), standalone=False)


def text_of(made: Any) -> str:
    return next(iter(made.files.values()))  # type: ignore[no-any-return]


def rates(made: Any, x: np.ndarray, inputs: np.ndarray, p: np.ndarray, before: str = "") -> np.ndarray:
    """x_dot and its derivatives along the columns."""
    unit = CLibrary(before + text_of(made), made.metadata, require_compiler())
    evaluator = unit.evaluator("rhs")
    evaluator.set_params(p)
    return np.array(evaluator.many(np.array([0.3]), x[None, :], inputs[None, :], np.zeros((1, 0))))[0]


# A tree by parameters, an input and initial values; constraints; Euler parameters; extra states.
CASES = [("puma560", {"torques": True}, "embedding", ("m2", "tau3", "", "I3_yy", "m2", "g", "", "d4", "tau1", "m5")),
         ("spatial_chain", {"n": 3}, "recursive", ("m1", "", "l2")), ("four_bar", {}, "augmented", ("l1", "", "m2", "g")),
         ("floating_wind_turbine", {}, "embedding", ("", "g"))]


@pytest.mark.every_value
@pytest.mark.parametrize("held", [False, True])
@pytest.mark.parametrize(("name", "options", "formulation", "by"), CASES)
def test_both_ways_agree(name: str, options: Any, formulation: str, by: tuple[str, ...], held: bool) -> None:
    equations = getattr(sd.systems.get(name, **options), formulation)()
    s, rng = equations.symbols, np.random.default_rng(3)
    known = [p.name for p in (*s.parameters, *s.inputs)]
    by = tuple(one if one in known or not one else known[0] for one in by)
    kept = tuple(u.name for u in s.inputs) if held else ()
    if held and not kept:
        pytest.skip("there are no inputs")
    made = [source(equations, by, looped, kept) for looped in (True, False)]
    assert "symdyn_give_columns(columns" in text_of(made[0]) and "symdyn_give_columns(columns" not in text_of(made[1])
    defaults = {p.name: float(v) for p, v in s.defaults.items()}
    x = np.array([float(s.initial.get(k, 0.1)) for k in (*s.coordinates, *s.speeds, *s.states)])
    x = np.concatenate([x + 0.01 * rng.normal(size=len(x)), rng.normal(size=len(by) * len(x))])
    p = np.array([*[defaults.get(q.name, 0.7) for q in s.parameters], *rng.normal(size=len(by) * len(kept))])
    inputs = rng.normal(size=len(s.inputs))
    first, second = (rates(one, x, inputs, p) for one in made)
    assert first.shape == second.shape == x.shape and np.abs(second).max() > 0
    assert np.abs(first - second).max() <= 1e-12 * np.abs(second).max()
    plain = rates(made[0], x, inputs, p, "#define __TINYC__ 1\n")
    assert np.abs(first - plain).max() <= 1e-13 * np.abs(second).max()


def test_code_does_not_grow_with_the_columns() -> None:
    equations = sd.systems.get("spatial_chain", n=4).embedding()
    names = tuple(p.name for p in equations.symbols.parameters)
    few, many, unrolled = ([line for line in text_of(source(equations, (*names[:20], *[""] * n), looped)).splitlines()
                            if not line.lstrip().startswith("//")] for n, looped in ((2, True), (60, True), (2, False)))
    assert len(many) == len(few) < 0.7 * len(unrolled)
    assert len("".join(many)) - len("".join(few)) < 1000


def test_where_the_loop_is_chosen() -> None:
    chain = sd.systems.get("spatial_chain", n=7).embedding()
    names = tuple(p.name for p in chain.symbols.parameters)
    assert columns_of(chain, "rhs", RightSide(sensitivities=names[:1])) is None
    made = columns_of(chain, "rhs", RightSide(sensitivities=names[:5]))
    assert made is not None and made.n == 5 and made.result_shape == (14 * 6,)
    # The series of Taylor's method is made of every statement.
    assert columns_of(chain, "rhs", RightSide(sensitivities=names[:5], method="taylor")) is None
    assert columns_of(sd.systems.get("pendulum").embedding(), "rhs", RightSide(sensitivities=("m",) * 5)) is None


@pytest.mark.parametrize("method", ["dop853", *swept(["bs54"]), "gauss", *swept(["radau"]), "radau5"])
def test_motions(method: str, monkeypatch: pytest.MonkeyPatch) -> None:
    by = ["m2", "l1", "q1(0)", "g", "q2_dot(0)"]
    found = []
    for looped in (0, np.inf):
        monkeypatch.setattr(columns, "LOOPED", looped)
        module = sd.systems.get("n_link_pendulum", n=3).embedding().compile(backend="c")
        found.append(module.simulate((0, 1), [-1.0, 0.2, 0.3], rtol=1e-9, method=method, sensitivities=by).sensitivity.matrix)
    assert np.abs(found[0] - found[1]).max() < 1e-10 * np.abs(found[1]).max()


@pytest.mark.parametrize(("name", "formulation"), [("puma560", "embedding"), ("four_bar", "augmented")])
def test_no_warnings(name: str, formulation: str, tmp_path: Path) -> None:
    equations = getattr(sd.systems.get(name), formulation)()
    made = source(equations, ("g", "", equations.symbols.parameters[1].name), True)
    (tmp_path / "made.c").write_text(text_of(made))
    assert faults_of(tmp_path / "made.c", tidy=False) == ""
    assert faults_of(tmp_path / "made.c", "-D__TINYC__", tidy=False) == ""
