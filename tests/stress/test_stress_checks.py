"""Stress: the short form has no failures, and every check finds a thing that is broken on purpose."""

from __future__ import annotations

import math
from collections.abc import Callable
from itertools import islice
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import symdyn as sd
from symdyn.runtime.building.compiler import find_compiler
from symdyn.stress import attitude, chains, extremes, long_runs, motion, reference, rounding, singular, units
from symdyn.stress.finding import Finding, judged
from symdyn.stress.record import FAIL, PASS, NotApplicable, Row
from symdyn.stress.run import CHECKS
from symdyn.stress.system_under_test import SystemUnderTest

needs_c = pytest.mark.skipif(find_compiler() is None, reason="no C compiler")


@pytest.fixture(scope="module")
def double() -> SystemUnderTest:
    return SystemUnderTest("double_pendulum")


@pytest.fixture(scope="module")
def tied() -> SystemUnderTest:
    return SystemUnderTest("pendulum_absolute")


def verdicts(rows: Any) -> list[str]:
    return [row.verdict for row in rows]


def altered(tested: SystemUnderTest, monkeypatch: pytest.MonkeyPatch, change: Callable[[Any, tuple, dict], Any]) -> None:
    """Have the runs changed: change(solution, arguments, options)."""
    run = tested.run

    def changed(*arguments: Any, **options: Any) -> Any:
        sol = run(*arguments, **options)
        change(sol, arguments, options)
        return sol

    monkeypatch.setattr(tested, "run", changed)


# -- of any mechanism


@pytest.mark.slow
@needs_c
def test_short_form_has_no_failures() -> None:
    report = sd.stress(short=True)
    assert [row for row in report.rows if row.verdict == FAIL] == []
    assert len(report.rows) > 80 and report.count()["pass"] > 70
    assert {row.check for row in report.rows} >= {"rounding", "units", "gimbal lock", "flips", "stiffness", "chaos"}
    assert all(row.why and (row.bound is None or row.origin) for row in report.rows)
    assert "constraints, cart_pole: there are no constraints" in report.left_out


@pytest.mark.parametrize("wrong", [lambda v: v * (1 + 1e-13), pytest.param(
    lambda v: v * np.where(np.arange(v.shape[1]) == 0, -1.0, 1.0), marks=pytest.mark.sweep)], ids=["noise", "sign"])
@needs_c
def test_rounding_finds_noise_and_a_wrong_sign(double: SystemUnderTest, monkeypatch: pytest.MonkeyPatch, wrong: Callable) -> None:
    original = rounding.evaluated
    monkeypatch.setattr(rounding, "evaluated", lambda *given: wrong(original(*given)))
    assert FAIL in verdicts(rounding.rounding(double, True))


@needs_c
def test_noise_in_one_entry_of_one_function_is_found(double: SystemUnderTest, monkeypatch: pytest.MonkeyPatch) -> None:
    original, names = rounding.evaluated, []

    def wrong(evaluator: Any, *given: Any) -> np.ndarray:
        values = original(evaluator, *given)
        if evaluator.name == "frames":
            values[:, 3] *= 1 + 1e-12  # of a rotation
            names.append(evaluator.name)
        return values

    monkeypatch.setattr(rounding, "evaluated", wrong)
    rows = list(rounding.rounding(double, True))
    assert names and set(verdicts(rows)) == {FAIL} and all("beyond it frames" in row.done for row in rows)


def test_every_function_is_judged_and_the_worst_verdict_counts() -> None:
    gentle, wrong, fine = Finding("rhs", 3.0, -1.0), Finding("J", 0.5, 0.5), Finding("C", -2.0, -2.0)
    row = judged("rounding", "arm", "C", [gentle, wrong, fine])
    assert row.verdict == FAIL and row.figure == 0.5 and row.done == "C; beyond it J"
    row = judged("rounding", "arm", "C", [gentle, fine])
    assert row.verdict == "degrade" and row.done == "C; beyond it rhs" and "plain numbers" in row.why
    assert judged("rounding", "arm", "C", [fine, Finding("J", -0.5, -0.5)]).done == "C; nearest to it J"


@needs_c
def test_only_states_next_to_lost_rank_or_singular_ones_are_set_aside() -> None:
    crank = SystemUnderTest("slider_crank")
    theta = math.pi / 2 + np.array([1e-9, 1e-5, 1e-2, 0.5, 0.8, 1.1, 1.4])
    x = np.column_stack([theta, -2 * theta, *np.zeros((2, 7))])  # its second branch, which meets the first where theta = pi / 2
    assert reference.smoothed(crank, "lam", np.zeros(7), x).tolist() == [True, True, *[False] * 5]
    assert not reference.smoothed(crank, "J", np.zeros(7), x).any()
    turning = SystemUnderTest(attitude.free_body("angles"))
    x = np.zeros((2, 6))
    x[:, 1] = [math.pi / 2, math.pi / 2 - 1e-3]
    where = rounding.States(np.zeros(2), x, np.zeros((2, 0)), np.zeros((2, 3)))
    assert rounding.Measured(turning, "rhs", where).singular.tolist() == [True, False]


def test_corrections_are_checked_off_the_constraints(tied: SystemUnderTest) -> None:
    where = rounding.states(tied, 40)
    off = rounding.off_constraints(tied, where)
    sizes = [np.abs(tied.evaluate("C", w.t, w.x)[:, 0]) for w in (where, off)]
    assert sizes[0].max() < 1e-12 and np.median(sizes[1][1::2]) > 1e-5 and (sizes[1][::2] == sizes[0][::2]).all()
    measured = rounding.Measured(tied, "position_correction", off)
    values = tied.evaluate("position_correction", off.t, off.x)
    assert measured.compared(values).verdict == PASS and measured.compared(values * (1 + 1e-9)).verdict == FAIL


@needs_c
def test_rejected_states_must_be_singular(double: SystemUnderTest, monkeypatch: pytest.MonkeyPatch) -> None:
    original = rounding.evaluated

    def refuses(*given: Any) -> np.ndarray:
        values = original(*given)
        values[3] = np.nan
        return values

    monkeypatch.setattr(rounding, "evaluated", refuses)
    rows = list(rounding.rounding(double, True))
    assert [r.verdict for r in rows if r.check == "rejected states"] and FAIL in verdicts(rows)


@needs_c
def test_energy_that_leaks_is_found(double: SystemUnderTest, monkeypatch: pytest.MonkeyPatch) -> None:
    def leak(sol: Any, arguments: tuple, options: dict) -> None:
        sol.x *= 1 + 1e-5 * np.linspace(0, 1, len(sol.t))[:, None]

    altered(double, monkeypatch, leak)
    assert verdicts(motion.energy(double, True)) == [FAIL]


@needs_c
def test_violated_constraints_are_found(tied: SystemUnderTest, monkeypatch: pytest.MonkeyPatch) -> None:
    def off(sol: Any, arguments: tuple, options: dict) -> None:
        sol.x[:] = sol.x * (1 + 1e-9)

    altered(tied, monkeypatch, off)
    assert FAIL in verdicts(motion.constraints(tied, True))


@needs_c
def test_constraints_do_not_count_in_metres(tied: SystemUnderTest) -> None:
    """A pendulum in x and y takes the same steps, and keeps its rod to rounding, whatever its size."""
    steps = set()
    for l in (1.0, 1e-3, 1e-6, 1e6):
        sol = tied.module.simulate((0, 3), q=[-l, 0], params={"l": l, "g": 9.81 * l}, rtol=1e-10, atol=1e-10 * l, max_steps=1000)
        assert np.abs(np.hypot(*sol.q.T) / l - 1).max() < 1e-12
        steps.add(sol.n_steps)
    assert len(steps) == 1


@needs_c
def test_another_way_back_is_found(double: SystemUnderTest, monkeypatch: pytest.MonkeyPatch) -> None:
    run = double.run

    def heavier(t: Any, x: Any = None, params: Any = None, **options: Any) -> Any:
        return run(t, x, double.params * (1 + 1e-4) if t[-1] < t[0] else params, **options)

    monkeypatch.setattr(double, "run", heavier)
    # All masses and lengths alike change the motion by the root of the length only.
    assert verdicts(motion.reversal(double, True)) == [FAIL]


@needs_c
def test_wrong_jacobian_is_found(double: SystemUnderTest, monkeypatch: pytest.MonkeyPatch) -> None:
    evaluate = double.evaluate

    def wrong(name: str, *given: Any, **options: Any) -> np.ndarray:
        values = evaluate(name, *given, **options)
        if name == "jacobian_x":
            values[:, 4 * 3] *= 1.05
        return values

    monkeypatch.setattr(double, "evaluate", wrong)
    assert verdicts(motion.divergence(double, True)) == [FAIL]


@needs_c
def test_ill_conditioned_mechanism_degrades() -> None:
    system = singular.two_points()
    system.defaults[next(s for s in system.defaults if s.name == "m_1")] = 1e-9
    system.initial[next(s for s in system.initial if s.name == "q2")] = 1e-4
    system.duration = 1e-6
    (row,) = motion.condition(SystemUnderTest(system), False)
    assert row.verdict == "degrade" and "ill-conditioned" in row.why and row.figure > 1e-8


@pytest.mark.parametrize(("size", "verdict"), [(1e-13, "degrade"), (1e-3, FAIL)])
@needs_c
def test_thresholds_with_units_are_found(double: SystemUnderTest, monkeypatch: pytest.MonkeyPatch, size: float,
                                         verdict: str) -> None:
    def shift(sol: Any, arguments: tuple, options: dict) -> None:
        sol.x[-1] += size  # as many of whatever unit

    altered(double, monkeypatch, shift)
    rows = list(units._bits(double, units.EXACT[2], units.factors(double, double.module.metadata.parameters, units.EXACT[2]),
                            units.factors(double, double.module.metadata.x, units.EXACT[2]), True))
    assert verdicts(rows) == [verdict]


def test_powers_of_units() -> None:
    assert units.powers("N m s/rad") == (1, 2, -1) and units.powers("kg/m^3") == (1, -3, 0) and units.powers("1") == (0, 0, 0)
    with pytest.raises(NotApplicable, match="the unit 'furlong/s' is not known here"):
        units.powers("furlong/s")


@needs_c
def test_numbers_with_units_are_not_scaled() -> None:
    system = sd.System("numbers", gravity=[0, -9.81])
    q, m = sd.coordinates("q"), sd.parameters("m")
    rod = system.add_body("rod", mass=m, com=[0.5, 0])
    system.add_joint(sd.Revolute("hinge", system.ground, rod, q))
    system.defaults = {m: 1.0}
    with pytest.raises(NotApplicable, match="holds numbers that have units"):
        list(units.units(SystemUnderTest(system), True))


@needs_c
def test_end_that_depends_on_the_first_step_is_found(double: SystemUnderTest, monkeypatch: pytest.MonkeyPatch) -> None:
    def late(sol: Any, arguments: tuple, options: dict) -> None:
        if options.get("first_step") == 1e-300:
            sol.x[-1] += 1e-2
            sol.n_steps *= 3

    altered(double, monkeypatch, late)
    rows = [row for row in extremes.steps(double, True) if "1e-300" in row.done]
    assert verdicts(rows)[:2] == [FAIL, FAIL]


@pytest.mark.parametrize("first", [1e-300, 5e-324, 1e9])
def test_first_steps_that_cannot_be_are_corrected_without_c_too(double: SystemUnderTest, first: float) -> None:
    usual, odd = (double.module.simulate((0, 1), method="DOP853", rtol=1e-8, **given) for given in ({}, {"first_step": first}))
    assert odd.success and odd.n_steps < usual.n_steps + 60 and np.allclose(odd.x[-1], usual.x[-1], rtol=0, atol=1e-6)


@needs_c
def test_denormals_that_matter_are_found(double: SystemUnderTest, monkeypatch: pytest.MonkeyPatch) -> None:
    def jump(sol: Any, arguments: tuple, options: dict) -> None:
        if (np.abs(arguments[1]) == 5e-324).any():
            sol.x[-1] += 1e-9

    altered(double, monkeypatch, jump)
    assert verdicts(extremes.denormals(double, True)) == [FAIL]


@needs_c
def test_mass_ratios_find_noise(double: SystemUnderTest, monkeypatch: pytest.MonkeyPatch) -> None:
    evaluate = double.evaluate
    noise = np.random.default_rng(4)

    def noisy(name: str, *given: Any, **options: Any) -> np.ndarray:
        values = evaluate(name, *given, **options)
        return values * (1 + 1e-3 * noise.normal(size=values.shape)) if name == "rhs" else values

    def clean(*given: Any, **options: Any) -> Any:
        measured = original(*given, **options)
        monkeypatch.setattr(double, "evaluate", noisy)
        return measured

    original = extremes.Measured
    monkeypatch.setattr(extremes, "Measured", clean)
    assert verdicts(extremes.masses(double, True))[0] == FAIL


class Stopped:
    """Reports of a stopped run."""

    success, message = False, "cart: stopped at t = 0.5: gust is not finite; the state there: x = 1, x_dot = 2"
    t, x = np.array([0.0, 0.5]), np.zeros((2, 2))
    module = SimpleNamespace(metadata=SimpleNamespace(x=["x", "x_dot"]))


@pytest.mark.parametrize(("change", "told"), [
    ({}, ""), ({"success": True}, "does not stop"), ({"message": "x = 1, x_dot = 2, gust"}, "no time"),
    ({"message": "stopped at t = 0.5: gust"}, "no state"), ({"message": Stopped.message.replace("gust", "it")}, "does not name "
                                                            "gust"),
    ({"x": np.full((2, 2), math.nan)}, "not finite"), ({"t": np.array([0.0, 0.6])}, "too far")])
def test_stops_must_report_all(change: dict[str, Any], told: str) -> None:
    sol = type("Sol", (Stopped,), change)
    row = extremes.stopped("bad input", "cart", "gust", sol, 0.5, ("gust",))
    assert row.verdict == (FAIL if told else PASS) and told in row.why


# -- mechanisms of their own


class Leaky(SystemUnderTest):
    """A mechanism whose runs are a little wrong at the end, but for those at the finest tolerances."""

    finest = 0.0

    def run(self, *arguments: Any, **options: Any) -> Any:
        sol = super().run(*arguments, **options)
        if options.get("rtol", 1.0) > self.finest:
            sol.x *= 1 + 1e-2 * np.linspace(0, 1, len(sol.t))[:, None]
        return sol


class LeakyUnlessFine(Leaky):
    finest = 1e-11


@pytest.mark.parametrize(("home", "name"), [(attitude, "gimbal"), (attitude, "flips"), (attitude, "rotor"),
                                            (long_runs, "constraint_drift"), (long_runs, "energy_drift"), (long_runs,
                                                                                                           "stiffness"),
                                            (singular, "massless"), (chains, "chaos")])
@needs_c
def test_wrong_motions_are_found(home: Any, name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(home, "SystemUnderTest", LeakyUnlessFine if name == "chaos" else Leaky)
    if hasattr(home, "local_error"):  # that errors of steps are measured rightly leaves the end wrong
        monkeypatch.setattr(home, "local_error", lambda *given: 1e-15)
    assert FAIL in verdicts(getattr(home, name)(True))


class Branching(SystemUnderTest):
    """A mechanism whose second coordinate goes another way at the end."""

    def run(self, *arguments: Any, **options: Any) -> Any:
        sol = super().run(*arguments, **options)
        sol.x[-1, 1] += 1e-3
        return sol


@pytest.mark.parametrize("wrong", [Leaky, Branching])
@needs_c
def test_wrong_motions_past_singular_positions_are_found(wrong: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(singular, "SystemUnderTest", wrong)
    energy, branch = islice(singular.configurations(True), 2)
    assert energy.verdict == FAIL and "energy" in energy.done
    # All of a motion larger by the same factor stays on the branch phi = -2 theta.
    assert branch.verdict == (FAIL if wrong is Branching else PASS) and "branch" in branch.done
    others = islice(singular._stretched(), 1) if wrong is Branching else singular._four_bar(True)
    assert verdicts(others) == [FAIL]


def test_stops_and_errors_at_singular_positions_must_name_the_culprit() -> None:
    class Lost(Stopped):
        message = "arm: stopped at t = 0.5: the rank falls to 1; the state there: q1 = 0"

    assert singular._named("singular positions", "arm", "", Lost, ("rank",)).verdict == "degrade"
    for message in ("the rank falls to 1; the state there: q1 = 0", "stopped at t = 0.5: the rank falls to 1",
                    "stopped at t = 0.5: it went wrong; the state there: q1 = 0"):
        Lost.message = message
        assert singular._named("singular positions", "arm", "", Lost, ("rank",)).verdict == FAIL

    def refuses(message: str) -> Any:
        raise sd.SymdynError(message)

    assert singular._rejected("massless", "tip", lambda: refuses("joint wrist has no mass"), ("wrist",)).verdict == "degrade"
    assert singular._rejected("massless", "tip", lambda: refuses("it went wrong"), ("wrist",)).verdict == FAIL
    moves = type("Sol", (Stopped,), {"success": True, "module": type("Module", (), {"name": "arm"})})
    assert "as if nothing were wrong" in singular._rejected("massless", "tip", lambda: moves, ("wrist",)).why


@needs_c
def test_redundant_constraints_that_change_something_are_found(monkeypatch: pytest.MonkeyPatch) -> None:
    class Off(Leaky):
        def evaluate(self, name: str, *given: Any, **options: Any) -> np.ndarray:
            values = super().evaluate(name, *given, **options)
            return values * (1 + 1e-11) if name == "rhs" else values

    monkeypatch.setattr(singular, "SystemUnderTest", Off)
    accelerations, energy = islice(singular.redundant(True), 2)
    assert (accelerations.verdict, energy.verdict) == (FAIL, FAIL) and accelerations.figure < 1e-10


@pytest.mark.parametrize(("change", "told"), [({"success": True}, "it does not stop"), ({"message": "stopped at t = 0.5: a value "
                                              "is not finite; the state there: x = 1, x_dot = 0"}, "does not name gust")])
@needs_c
def test_unreported_failures_of_forces_are_found(change: dict[str, Any], told: str, monkeypatch: pytest.MonkeyPatch) -> None:
    class Silent(SystemUnderTest):
        def run(self, *arguments: Any, **options: Any) -> Any:
            sol = super().run(*arguments, **options)
            for name, value in change.items():
                setattr(sol, name, value)
            return sol

    monkeypatch.setattr(singular, "SystemUnderTest", Silent)
    rows = list(islice(singular.user_forces(True), 2))
    assert [row.verdict for row in rows] == [FAIL, FAIL] and all(told in row.why for row in rows)


@needs_c
def test_long_chains_find_noise_and_leaks(monkeypatch: pytest.MonkeyPatch) -> None:
    class Noisy(Leaky):
        calls = 0

        def evaluate(self, name: str, *given: Any, **options: Any) -> np.ndarray:
            values = super().evaluate(name, *given, **options)
            Noisy.calls += name == "rhs"
            # After what the bound is made of: the last values are those that are judged.
            return values * (1 + 1e-6) if name == "rhs" and Noisy.calls > 1 + rounding.TRIALS else values

    monkeypatch.setattr(chains, "SystemUnderTest", Noisy)
    assert [(row.check, row.verdict) for row in chains.long_chains(True)] == [
        ("long chains", FAIL), ("first order", FAIL), ("long chains", FAIL)]


def test_lost_digits_at_gimbal_lock_must_be_reported() -> None:
    truth = np.tile(np.eye(3).ravel(), (2, 1))

    class Near(Stopped):
        success, n_steps, n_rejected, warned = True, 500, 10, ()
        frames = np.concatenate([np.zeros((2, 3)), truth + 1e-3], axis=1)[:, None]

    tested = type("Named", (), {"name": "body"})
    silent = attitude._angles(tested, "angles", 1e-6, Near, truth, 20, 1e-9)
    assert silent.verdict == FAIL and "without a word" in silent.why
    Near.warned = ("near gimbal lock of the ZYX angles",)
    assert attitude._angles(tested, "angles", 1e-6, Near, truth, 20, 1e-9).verdict == "degrade"
    Near.success = False
    Near.warned = ()
    assert "without naming gimbal lock" in attitude._angles(tested, "angles", 1e-6, Near, truth, 20, 1e-9).why


def test_every_check_says_what_it_does() -> None:
    assert all(check.title.endswith(".") and check.title[0].isupper() for check in CHECKS.values())
    assert isinstance(next(iter(singular.user_forces(True))), Row)
