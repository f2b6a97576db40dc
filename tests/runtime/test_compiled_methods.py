"""Compiled methods of integration: measured orders, the choice by "auto", and what does not fit."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import sympy as sp

import symdyn as sd
from symdyn.backend.methods import METHODS
from symdyn.errors import ArgumentError, SimulationWarning
from symdyn.pipeline import emit
from symdyn.runtime.building.compiler import find_compiler
from symdyn.runtime.inputs.inputs import Inputs
from symdyn.runtime.integrating import methods, simulate
from symdyn.runtime.integrating.automatic import Modes, automatic
from symdyn.runtime.integrating.methods import COMPILED
from symdyn.runtime.integrating.outcome import Outcome, Request
from tests.runtime.constrained import module as constrained

START = {"q": {"q1": 2.0}, "u": {"q1_dot": 0.5}}


@pytest.fixture(scope="module")
def pendulum(compiled: Callable[..., Any]) -> Any:
    return compiled("pendulum", "c")


def heavy_oil() -> sd.System:
    """A pendulum in oil that follows slowly: the damper makes one eigenvalue -d/(m l^2)."""
    (q1,) = sd.coordinates("q1:2")
    m, length, g, d = sd.parameters("m l g d")
    system = sd.System("heavy_oil", gravity=[0, -g])
    bob = system.add_body("bob", mass=m, com=[0, -length])
    system.add_joint(sd.Revolute("pivot", system.ground, bob, q1))
    system.add_joint_force("pivot", -d * q1.dot)
    system.defaults = {m: 1, length: 1, g: 9.81, d: 1e4}
    system.initial = {q1: 2.0}
    return system


@pytest.fixture(scope="module")
def oil() -> dict[str, Any]:
    equations = heavy_oil().embedding()
    return {b: equations.compile(backend=b) for b in ("c", "numpy") if b == "numpy" or find_compiler() is not None}


# -- orders


@pytest.mark.parametrize(("method", "order", "between", "steps"), [("bs54", 5, 5, (0.05, 0.025, 0.0125)),
                                                                   ("dop853", 8, 8, (0.2, 0.1, 0.05))])
def test_measured_order(method: str, order: int, between: int, steps: tuple[float, ...], pendulum: Any) -> None:
    """Equal steps, at their ends and between them: tolerances that every step meets."""
    exact = pendulum.simulate((0, 2), **START, rtol=1e-14)
    ends, middle = [], []
    for h in steps:
        found = pendulum.simulate((0, 2), **START, rtol=0.1, atol=1e3, first_step=h, max_step=h, method=method)
        ends.append(np.abs(found.x[-1] - exact.x[-1]).max())
        middle.append(np.abs(found.x - exact.x).max())
    for errors, wanted in ((ends, order), (middle, between)):
        assert wanted - 0.4 < np.log2(errors[0] / errors[-1]) / (len(steps) - 1) < wanted + 1.5


def test_the_loose_pair_is_as_good_for_fewer_evaluations(compiled: Callable[..., Any]) -> None:
    """Medians over tolerances, of a motion that is over before it becomes chaotic."""
    double = compiled("double_pendulum", "c")
    ends = np.array([0.0, 2.0])
    exact = double.simulate(ends, rtol=1e-13).x[-1]
    pairs = [[double.simulate(ends, rtol=r, method=m) for m in ("bs54", "dop853")] for r in 10.0**-np.arange(2, 5, 0.25)]
    errors = np.array([[np.linalg.norm(s.x[-1] - exact) for s in pair] for pair in pairs])
    assert np.median([loose.nfev / tight.nfev for loose, tight in pairs]) < 0.85
    assert np.median(errors[:, 0] / errors[:, 1]) < 2


def test_the_loose_pair_on_constraints() -> None:
    """Projected, and backward: as the tight pair, within the tolerance."""
    bar = constrained("four_bar")
    times = np.linspace(0, 2, 50)
    loose, tight = (bar.simulate(times, rtol=1e-7, method=m) for m in ("bs54", "dop853"))
    np.testing.assert_allclose(loose.x, tight.x, rtol=0, atol=2e-5)
    assert np.abs(loose.constraint_violation).max() < 1e-12 and loose.corrections.n_steps > 0
    back = bar.simulate(times[::-1], q=loose.q[-1], u=loose.u[-1], rtol=1e-7, method="bs54")
    np.testing.assert_allclose(back.x[-1], loose.x[0], rtol=0, atol=2e-5)


# -- the choice


@pytest.mark.parametrize(("rtol", "method", "why"), [
    (1e-3, "bs54", "for rtol = 0.001 (0.0003 or more, with 4 operations in the right-hand side) the explicit pair of order 5 "
                   "needs the fewest evaluations"),
    (1e-6, "dop853", "for rtol = 1e-06 (between 1e-07 and 0.0003, with 4 operations in the right-hand side) the explicit method "
                     "of order 8 is quickest"),
    (1e-9, "taylor", "for rtol = 1e-09 (1e-07 or less, with 4 operations in the right-hand side) Taylor series are most exact")])
def test_auto_by_tolerance(rtol: float, method: str, why: str, pendulum: Any) -> None:
    found = pendulum.simulate((0, 10), **START, rtol=rtol, method="auto")
    assert found.method == method and found.why.endswith(f"; {why}")
    if rtol > 1e-9:
        assert re.match(r"no implicit method is needed: an explicit trial run reaches the end in \d+ steps, of 100 that it may "
                        "take; ", found.why)
    named = pendulum.simulate((0, 10), **START, rtol=rtol, method=method)
    np.testing.assert_array_equal(found.x, named.x)
    assert named.why == ""


def test_auto_with_constraints() -> None:
    found = constrained("four_bar").simulate((0, 2), rtol=1e-8, method="auto")
    assert found.method == "dop853"
    assert re.search(r"for rtol = 1e-08 \(between 1e-14 and 3e-05, with \d+ operations in the right-hand side\) the explicit "
                     r"method of order 8 is quickest$", found.why)


@pytest.mark.parametrize(("backend", "explicit", "implicit"), [("c", "dop853", "radau"), ("numpy", "DOP853", "Radau")])
def test_auto_by_stiffness(backend: str, explicit: str, implicit: str, oil: dict[str, Any]) -> None:
    """Eigenvalue -1e4 1/s: steps of the explicit method are 6.4e-4 s, however slow the motion."""
    if backend not in oil:
        pytest.skip("no C compiler here")
    implicit = implicit if implicit in COMPILED or backend == "numpy" else "Radau"
    found = oil[backend].simulate((0, 1), rtol=1e-6, method="auto")
    assert found.method == implicit and found.n_steps < 100
    assert re.fullmatch(r"the motion is stiff: after t = 0\.0\d+ s implicit steps are \d+ times as long as explicit ones, and "
                        r"pay from 10 times on \(steps of 0\.000\d+ s times the largest eigenvalue, 1e\+04 1/s, are [56]\.?\d?; "
                        r"stability limits explicit ones from 5 on\)", found.why)
    thin = oil[backend].simulate((0, 1), rtol=1e-6, method="auto", params={"d": 1.0})
    assert thin.method == explicit


def follower() -> sd.System:
    """A mass that a stiff spring with a damper pulls after a slow motion."""
    q = sd.coordinates("q")
    m, c, d = sd.parameters("m c d")
    system = sd.System("follower")
    body = system.add_body("body", mass=m)
    system.add_joint(sd.Prismatic("slide", system.ground, body, q, axis=[1, 0]))
    system.add_joint_force("slide", -c * (q - sp.cos(sd.t)) - d * q.dot)
    system.defaults = {m: 1, c: 1e6, d: 1e4}
    system.initial = {q: 1.0}
    return system


@pytest.fixture(scope="module")
def following() -> dict[str, Any]:
    equations = follower().embedding()
    return {b: equations.compile(backend=b) for b in ("c", "numpy") if b == "numpy" or find_compiler() is not None}


@pytest.mark.parametrize(("backend", "rtol", "c", "d"), [
    ("c", 1e-3, 1e6, 1e4), ("c", 1e-8, 1e6, 1e4), ("c", 1e-10, 1e8, 1e4), ("c", 1e-12, 1e8, 1e4), ("c", 1e-10, 1e4, 1e3),
    ("numpy", 1e-8, 1e6, 1e4)])
def test_auto_by_stiffness_at_small_tolerances(backend: str, rtol: float, c: float, d: float, following: dict[str, Any]) -> None:
    """Accuracy, too, limits the explicit steps to a part of 1/|eigenvalue|: 0.26 to 6.4 of it here. The motion is slow: at
    c -> oo it is q = cos t, within (1 + d)/c."""
    if backend not in following or (backend == "c" and "radau" not in COMPILED):
        pytest.skip("no C compiler here")
    found = following[backend].simulate((0, 2), params={"c": c, "d": d}, rtol=rtol, method="auto")
    assert found.method == ("radau" if backend == "c" else "Radau") and "the motion is stiff: after t = " in found.why
    assert found.n_steps < 0.05 * 2 * d  # explicit steps: 0.15 to 1.8 times 2 d
    assert abs(found.q[-1, 0] - np.cos(found.t[-1])) < 1.1 * (1 + d) / c


def test_auto_compiles_no_jacobian_without_need(following: dict[str, Any], compiled: Callable[..., Any],
                                                monkeypatch: pytest.MonkeyPatch) -> None:
    """An implicit method is tried neither where the explicit steps are as short as the motion is quick, however many are to come,
    nor where few are to come, nor where no stability can limit them; and then nothing else is said of stiffness."""
    tried = []
    run = simulate._trial
    monkeypatch.setattr(simulate, "_trial", lambda module, asked, name: tried.append(name) or run(module, asked, name))
    pendulum, double = compiled("pendulum", "numpy"), compiled("double_pendulum", "numpy")
    with pytest.warns(SimulationWarning, match="after 20 steps"):
        quick = pendulum.simulate((0, 10_000), {"q1": 0.5}, rtol=1e-3, method="auto", max_steps=20)
    assert re.match(r"the motion itself, not stability, asks for short steps: over 50 explicit ones, to t = [\d.]+ s, q1(_dot)? "
                    r"departs from a cubic by [\d.]+ % of its range, where 1 % would be smooth \(steps of ", quick.why)
    with pytest.warns(SimulationWarning, match="after 20 steps"):
        exact = double.simulate((0, 1000), rtol=1e-12, method="auto", max_steps=20)
    assert re.match(r"accuracy, not stability, limits explicit steps \(steps of [\d.]+ s times the largest eigenvalue, [\d.]+ "
                    r"1/s, are 0\.0\d+, below 0\.1; stability limits explicit ones from 5 on\); of the explicit methods that "
                    "need no compiled code the one of order 8 is quickest", exact.why)
    short = following["numpy"].simulate((0, 0.1), rtol=1e-8, method="auto")
    assert re.match(r"stiffness does not matter: some \d+ explicit steps are to come, fewer than the 1000 from which on an "
                    r"implicit method pays \(steps of ", short.why)
    assert all("not stiff" not in found.why for found in (quick, exact, short))
    assert tried == ["DOP853"] * 3


UNKNOWN = "whether the motion is stiff is not known"


@pytest.mark.parametrize(("steps", "length", "longer", "rtol", "method", "why"), [
    (12, 1e-3, 0, 1e-6, "DOP853",
     f"{UNKNOWN}: a trial run stopped at t = 0.012 s, after 12 of 100 explicit steps; of the explicit methods that need no "
     "compiled code the one of order 8 is quickest"),
    (100, np.nan, 0, 1e-6, "DOP853",
     f"{UNKNOWN}: at t = 0 s, after 100 explicit steps, the right-hand side cannot be evaluated on all sides of the state, which "
     "its eigenvalues need; of the"),
    (100, 1e-3, None, 1e-6, "DOP853", f"{UNKNOWN}: no implicit step can be tried (no room here); of the"),
    (100, 1e-3, 3e-3, 1e-6, "DOP853",
     "the motion is not stiff: after t = 0.1 s implicit steps are only 3 times as long as explicit ones, and pay from 10 times "
     "on (steps of 0.001 s times the largest eigenvalue, 1e+04 1/s, are 10; stability limits explicit ones from 5 on); of the"),
    (100, 1e-3, 3e-3, 1e-3, "dop853",
     " operations in the right-hand side) the explicit method of order 8 is quickest, as stability limits the pair of order 5 "
     "to shorter steps"),
    (100, 1e-3, 1.5e-2, 1e-3, "radau",
     "the motion is stiff: after t = 0.1 s implicit steps are 15 times as long as explicit ones, and pay from 10 times on")])
def test_auto_reports_what_trial_runs_show(steps: int, length: float, longer: float | None, rtol: float, method: str, why: str,
                                           oil: dict[str, Any]) -> None:
    """Trial runs that take steps of these lengths."""
    backend = "numpy" if method.isupper() else "c"
    if backend not in oil:
        pytest.skip("no C compiler here")
    start = np.array([np.pi / 2, 0.0])

    def trial(request: Request, name: str) -> Outcome:
        implicit = name.lower().startswith("radau")
        if implicit and longer is None:
            raise ArgumentError("no room here")
        t = np.arange(steps + 1.0) * np.nan_to_num(longer if implicit else length)  # type: ignore[arg-type]
        return Outcome(t, np.outer(np.ones(len(t)), start if length > 0 else [np.nan, 0.0]), False, "", False, steps, 0, 0)

    module = oil[backend]
    request = Request((0, 1), None, start, module.parameters(), Inputs(np.zeros(0)), rtol, np.full(2, rtol), 0.0, 0.0, None, 2)
    found = automatic(module, request, trial)
    assert found[0] == method and why in found[1]


def test_auto_reports_that_series_do_not_fit() -> None:
    """A force that switches has no Taylor series."""
    if find_compiler() is None:
        pytest.skip("no C compiler here")
    q = sd.coordinates("q")
    system = sd.System("switched", planar=True)
    system.add_joint(sd.Prismatic("slide", system.ground, system.add_body("body", mass=1), q, axis=[1, 0]))
    system.add_joint_force("slide", -sp.Abs(q))
    found = system.embedding().compile(backend="c").simulate((0, 1), {"q": 1.0}, rtol=1e-9, method="auto")
    assert found.method == "dop853" and found.why.endswith(
        "operations in the right-hand side) Taylor series would be most exact, but do not fit (method='taylor' says why); the "
        "explicit method of order 8 is quickest")


def test_spectral_radius(oil: dict[str, Any]) -> None:
    """The spectral radius is that of x_dot at q = pi/2, where gravity adds nothing to the eigenvalues 0 and -d."""
    x = np.array([np.pi / 2, 0.0])
    module = oil["numpy"]
    request = Request((0, 1), None, x, module.parameters(), Inputs(np.zeros(0)), 1e-6, x, 0.0, 0.0, None, 2)
    modes = Modes.at(module, request, 0.0, x)
    assert modes is not None and modes.radius == pytest.approx(1e4, rel=1e-6)
    assert Modes.at(module, request, 0.0, np.array([np.nan, 0.0])) is None


# -- names and faults


def test_records_are_those_that_can_be_compiled() -> None:
    assert set(METHODS) == set(COMPILED)
    for name, record in METHODS.items():
        assert record.name == name and set(COMPILED[name].needs) <= set(record.needs) | {"jacobian_x"}


def test_a_unit_holds_one_method(derived: Callable[..., Any]) -> None:
    text = next(iter(emit(derived("pendulum"), "c", ("rhs",), standalone=False, method="bs54").files.values()))
    assert "symdyn_restart(" in text and "dop853" not in text and "Bogacki" in text


@pytest.mark.parametrize("method", sorted(COMPILED))
def test_compiled_methods_need_compiled_code(method: str, compiled: Callable[..., Any]) -> None:
    instead = "Radau" if method in ("radau", "radau5") else "DOP853"
    with pytest.raises(ArgumentError, match=f"'{method}' needs the C backend; this module runs on numpy. "
                                            f"Use method='{instead}' of SciPy, or compile"):
        compiled("pendulum", "numpy").simulate((0, 1), method=method)


def test_a_method_that_does_not_fit_says_why(pendulum: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(METHODS, "needy", replace(METHODS["bs54"], name="needy", needs=("telepathy",)))
    monkeypatch.setitem(METHODS, "picky", replace(METHODS["bs54"], name="picky"))
    monkeypatch.setitem(COMPILED, "needy", methods.CompiledMethod("needy"))
    monkeypatch.setitem(COMPILED, "picky", methods.CompiledMethod("picky", unfit=lambda m, _: f"{m.name} is small"))
    with pytest.raises(ArgumentError, match="method 'needy' does not fit: its equations have no telepathy; use method='dop853'"):
        pendulum.simulate((0, 1), method="needy")
    with pytest.raises(ArgumentError, match="method 'picky' does not fit: pendulum is small"):
        pendulum.simulate((0, 1), method="picky")
