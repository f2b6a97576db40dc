"""Where the usual motion begins: faults of a description reported once, starts that are moved, motions that stand still."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import symdyn as sd
from symdyn.runtime.building.compiler import find_compiler
from symdyn.stress.extremes import masses
from symdyn.stress.flow import stands_still
from symdyn.stress.record import DEGRADE, FAIL, PASS, NotApplicable, StandsStill
from symdyn.stress.start import start
from symdyn.stress.system_under_test import SystemUnderTest

needs_c = pytest.mark.skipif(find_compiler() is None, reason="no C compiler")


def gust(v: np.ndarray) -> np.ndarray:
    return v


def cart(load: Any) -> sd.System:
    """A mass on a rail in the plane, pushed by a function of its place and speed."""
    system = sd.System("cart", planar=True)
    x, m = sd.coordinates("x"), sd.parameters("m")
    system.add_joint(sd.Prismatic("rail", system.ground, system.add_body("cart", mass=m), x, axis=[1, 0]))
    system.add_joint_force("rail", load(x))
    system.defaults = {m: 1.0}
    return system


def crane(**initial: float) -> sd.System:
    """A load on a rope under a carriage."""
    x, theta = sd.coordinates("x theta")
    m_c, m_l, l, g = sd.parameters("m_c m_l l g")
    system = sd.System("crane", gravity=[0, -g])
    carriage, load = system.add_body("carriage", mass=m_c), system.add_body("load", mass=m_l, com=[0, -l])
    system.add_joint(sd.Prismatic("rail", system.ground, carriage, x, axis=[1, 0]))
    system.add_joint(sd.Revolute("hook", carriage, load, theta))
    system.defaults = {m_c: 3.0, m_l: 1.0, l: 2.0, g: 9.81}
    system.initial = initial
    return system


# -- faults of the description


@needs_c
@pytest.mark.native
def test_code_that_does_not_compile_is_reported_once_with_what_the_compiler_says() -> None:
    text = "static int gust(const double *in, double *out) { out[0] = in[0] +; return 0; }"
    report = sd.stress(cart(lambda x: sd.External("gust", ["v"], c=text, python=gust)(x.dot)), short=True)
    (told,) = report.rows
    assert (told.check, told.verdict, told.done) == ("start", FAIL, "its code cannot be compiled")
    assert "out[0] = in[0] +;" in told.why and "error" in told.why.splitlines()[-3] and not report.passed
    (left_out,) = report.left_out
    assert left_out.startswith("rounding, condition, energy") and left_out.endswith("inputs, cart: it cannot be run")
    assert "\n        Output:\n" in report.table()  # the compiler's lines are lines


@pytest.mark.parametrize(("system", "told"), [
    (lambda: cart(lambda x: 1 / x), "the result is not finite; at t = 0, x = 0, x_dot = 0"),
    (lambda: massless(), "the mass matrix is not positive definite")])
def test_accelerations_that_there_are_not_are_reported_once(system: Any, told: str) -> None:
    report = sd.stress(system(), short=True, checks=["energy", "denormals", "masses"])
    (row,) = report.rows
    assert (row.check, row.verdict) == ("start", FAIL) and told in row.why and "at the start" in row.done
    assert [text.split(", ")[:3] for text in report.left_out] == [["energy", "denormals", "masses"]]


def breaks(v: np.ndarray) -> np.ndarray:
    raise ValueError("no data")


def test_what_a_function_of_the_user_raises_is_reported_as_its_own(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SYMDYN_CC", "none")
    text = "static int breaks(const double *in, double *out) { out[0] = in[0]; return 0; }"
    report = sd.stress(cart(lambda x: sd.External("breaks", ["v"], c=text, python=breaks)(x.dot)), short=True)
    (told,) = report.rows
    assert (told.check, told.verdict) == ("start", FAIL) and "no data" in told.why and ".py" not in told.done


def massless() -> sd.System:
    system = crane()
    system.defaults = {p: 0.0 if str(p).startswith("m_") else v for p, v in system.defaults.items()}
    return system


def test_a_description_with_faults_is_reported_before_anything_is_run() -> None:
    system = sd.System("loose")
    system.add_body("floating", mass=1)
    with pytest.raises(sd.ModelError, match="floating"):
        sd.stress(["pendulum", system])


# -- the start


def test_a_start_off_the_constraints_is_moved_and_reported() -> None:
    system = sd.systems.four_bar()
    kept = SystemUnderTest(system)
    assert list(start(kept)) == []
    q1 = next(s for s in system.initial if s.name == "q1")
    system.initial = {**system.initial, q1: system.initial[q1] + 0.05}
    tested = SystemUnderTest(system)
    (row,) = start(tested)
    assert row.verdict == PASS and "system.initial violates constraints" in row.done and "simulate --consistent" in row.why
    moved = tested.start - tested.given
    assert row.figure == np.abs(moved).max() > 1e-3
    assert all(f"{name} by {moved[k]:.3g} rad" in row.done for k, name in enumerate(("q1", "q2", "q3")))
    assert sd.stress(system, short=True, checks="condition").rows[0] == row


# -- motions that stand still


def test_checks_of_a_motion_that_stands_still_are_left_out_and_reported() -> None:
    report = sd.stress(crane(), short=True, checks=["energy", "reversal", "divergence", "units", "steps"])
    (row,) = report.rows
    assert (row.check, row.verdict) == ("usual motion", DEGRADE) and "stands still" in row.done and "system.initial" in row.why
    assert [text.partition(",")[0] for text in report.left_out] == ["energy", "reversal", "divergence", "units", "steps"]
    assert all("the motion stands still; set system.initial" in text for text in report.left_out)


@pytest.mark.parametrize("name", ["floating_crane", "floating_wind_turbine"])
def test_what_the_catalogue_has_in_equilibrium_is_moved(name: str) -> None:
    tested = SystemUnderTest(name)
    assert not stands_still(tested, tested.run((0.0, tested.duration / 5)).x)
    resting = SystemUnderTest(sd.systems.get(name))
    assert stands_still(resting, resting.run((0.0, resting.duration / 5)).x)


def test_rounding_is_no_motion_and_a_small_motion_is_one() -> None:
    # sin and cos of -pi/2 leave 1e-16 of the weight as a moment.
    for angle, still in ((math.pi, True), (math.pi + 1e-6, False), (0.0, True)):
        tested = SystemUnderTest(crane(theta=angle))
        sol = tested.run((0.0, 1.0), rtol=1e-6)
        assert stands_still(tested, sol.x) is still
    turning = SystemUnderTest(crane(x_dot=1e-6))
    assert not stands_still(turning, turning.run((0.0, 1.0)).x)


def test_lengths_count_against_those_of_the_mechanism() -> None:
    small = crane(x_dot=1e-9)
    small.defaults = {p: v * 1e-6 if str(p) == "l" else v for p, v in small.defaults.items()}
    large = crane(x_dot=1e-9)
    large.defaults = {p: v * 1e6 if str(p) == "l" else v for p, v in large.defaults.items()}
    for system, still in ((small, False), (large, True)):
        tested = SystemUnderTest(system)
        assert stands_still(tested, tested.run((0.0, 1.0)).x) is still


def test_the_report_says_that_nothing_moves() -> None:
    from symdyn.overview import page as full

    notes: list[str] = []
    full._condition(SystemUnderTest(crane()), notes)
    assert notes[:1] == [full.STILL]
    notes.clear()
    full._condition(SystemUnderTest(crane(theta=0.5)), notes)
    assert full.STILL not in notes


# -- masses


@needs_c
def test_extreme_ratios_of_masses_are_run_too(monkeypatch: pytest.MonkeyPatch) -> None:
    tested = SystemUnderTest(crane(theta=0.5))
    rows = [row for row in masses(tested, True) if row.done.startswith("motion with 1 masses and inertias times 1e")]
    assert [row.verdict for row in rows] == [PASS, PASS] and "1e-08" in rows[0].done and "1e+08" in rows[1].done
    run = SystemUnderTest.run

    def leaks(self: SystemUnderTest, *given: Any, **options: Any) -> Any:
        sol = run(self, *given, **options)
        sol.x *= 1 + 1e-3 * np.linspace(0, 1, len(sol.t))[:, None]
        return sol

    monkeypatch.setattr(SystemUnderTest, "run", leaks)
    monkeypatch.setattr("symdyn.stress.flow.local_error", lambda *given: 1e-13)
    rows = [row for row in masses(tested, True) if row.done.startswith("motion with")]
    assert [row.verdict for row in rows] == [FAIL, FAIL]


@needs_c
def test_light_parts_on_dampers_are_run_by_an_implicit_method() -> None:
    """At 1e-8 of the mass an explicit method would take steps of 1e-11 s."""
    rows = [row for row in masses(SystemUnderTest("flyball_governor"), True) if row.done.startswith("motion with")]
    assert [row.verdict for row in rows] == [PASS, PASS] and "1 s in" in rows[0].done


def test_ratios_of_what_stands_still_are_left_out() -> None:
    found = masses(SystemUnderTest(crane()), True)
    with pytest.raises(NotApplicable, match="of motions: the motion stands still"):
        rows = []
        for row in found:
            rows.append(row)
    assert all(not row.done.startswith("motion") for row in rows) and rows


def test_a_motion_that_stands_still_names_what_to_do() -> None:
    reason = StandsStill(10.0)
    assert "within 10 s" in reason.done and "{q: 0.5, q.dot: 1}" in reason.why and "set system.initial" in str(reason)
