"""First-order bounds of rounding errors hold, are no larger than they must be, and find code that is slightly wrong."""

from __future__ import annotations

import math
from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from symdyn.pipeline import emit
from symdyn.runtime.building.compiler import find_compiler, plain
from symdyn.runtime.building.library import CLibrary
from symdyn.stress import attitude, rounding
from symdyn.stress.coded import imbalance
from symdyn.stress.finding import Aside, Finding, first_order_row, set_aside
from symdyn.stress.first_order import first_order
from symdyn.stress.record import DEGRADE, FAIL, PASS
from symdyn.stress.reference import exactly_as_written, halves, leaves
from symdyn.stress.singular import two_points
from symdyn.stress.statements import emitted, written_out
from symdyn.stress.system_under_test import EPS, SystemUnderTest
from symdyn.tape.evaluate import evaluate
from symdyn.tape.floats import evaluate_rows
from symdyn.tape.intrinsics import SMOOTHED, Multipliers, Saddle
from symdyn.tape.node import PARAMETER
from symdyn.tape.recorder import Recorder
from symdyn.tape.tape import Tape

needs_c = pytest.mark.skipif(find_compiler() is None, reason="no C compiler")
NAMES = ["rhs", "lam", "reactions", "J"]


class Named:
    name = "arm"


@pytest.fixture(scope="module")
def crank() -> SystemUnderTest:
    return SystemUnderTest("slider_crank")


@pytest.fixture(scope="module")
def measured(crank: SystemUnderTest) -> dict[str, rounding.Measured]:
    """At ordinary states, and along the branch that loses rank where theta = pi/2."""
    rng = np.random.default_rng(7)
    theta = np.concatenate([rng.uniform(0, 1.2, 30), math.pi / 2 + np.array([1e-3, 1e-4, 1e-5, 1e-6, 1e-8])])
    u = rng.uniform(-2, 2, len(theta))
    x = np.column_stack([theta, -2 * theta, u, -2 * u])
    where = rounding.States(np.zeros(len(x)), x, np.zeros((len(x), 0)), np.zeros((len(x), 2)))
    statements = emitted(crank, NAMES)
    return {name: rounding.Measured(crank, name, where, None, statements[name]) for name in NAMES}


@pytest.fixture(scope="module")
def source(crank: SystemUnderTest) -> Any:
    return emit(crank.equations, "c", NAMES, standalone=False, integrator=False)


def found(measured: dict[str, rounding.Measured], source: Any, old: str = "", new: str = "") -> list[Finding]:
    """Findings on the functions if the code is changed."""
    text = next(iter(source.files.values()))
    assert old in text
    compiler = find_compiler()
    assert compiler is not None
    unit = CLibrary(text.replace(old, new) if old else text, source.metadata, plain(compiler))
    return [one.compared(one.run(unit.evaluator(name))) for name, one in measured.items()]


# -- the bound


def test_bound_of_a_sum_and_a_product() -> None:
    r = Recorder()
    a, b, c = (r.leaf(name, PARAMETER << 2) for name in "abc")
    values = {"a": np.array([1.0, 3.0]), "b": np.array([-1 + 2.0**-20, 5.0]), "c": np.array([4.0, -2.0])}
    bound = first_order(Tape.of(r, y=[(a + b) * c, (a * b + 1) - a * b, r.sin(a), r.div(c, a + b)]), values, 2)
    s, p = values["a"] + values["b"], values["a"] * values["b"]
    arithmetic = [2 * np.abs(s * values["c"]), np.abs(p + 1) + 1, 0 * s, 2 * np.abs(values["c"] / s)]
    np.testing.assert_allclose(bound.arithmetic, EPS * np.array(arithmetic).T, rtol=1e-12)
    np.testing.assert_allclose(bound.of("c")[:, 2], 2 * EPS * np.abs(np.sin(values["a"])), rtol=1e-12)
    np.testing.assert_allclose(bound.divisors, EPS, rtol=1e-12)


def test_constants_that_doubles_do_not_hold_count() -> None:
    r = Recorder()
    a = r.leaf("a", PARAMETER << 2)
    tape = Tape.of(r, y=[Fraction(1, 3) * a, Fraction(1, 4) * a, Fraction(1, 3)])
    np.testing.assert_allclose(first_order(tape, {"a": np.array([3.0])}, 1).arithmetic, EPS * np.array([[2, 0.75, 1 / 3]]))


def test_branches_that_are_not_taken_do_not_count() -> None:
    r = Recorder()
    a = r.leaf("a", PARAMETER << 2)
    tape = Tape.of(r, y=[r.apply("select", r.apply("gt", a, 0), r.sqrt(a), r.div(1, a * a - 4))])
    bound = first_order(tape, {"a": np.array([4.0, -1.0, -2 + 1e-15])}, 3)
    # Error of the quotient -1/3, and of 1 and 1 - 4 times its slope 1/9.
    np.testing.assert_allclose(bound.arithmetic[:2, 0], [2 * EPS, EPS * (1 / 3 + 4 / 9)])
    assert bound.divisors[0] == 0 and 0.05 < bound.divisors[2] < 1


def test_errors_of_a_pendulum_are_below_their_bound_and_not_far() -> None:
    tested = SystemUnderTest("double_pendulum")
    where = rounding.states(tested, 60)
    rows = np.column_stack([where.t, where.x, where.inputs, where.ud])
    tape = emitted(tested, ["rhs", "energy"])["rhs"][0].tape
    hi, lo = halves(exactly_as_written(tested, tape, rows), 4)
    values = leaves(tested, rows)
    errors = np.abs(hi - evaluate_rows(tape, values, 60)["rhs"] + lo)
    bound = first_order(tape, values, 60).of("numpy")
    with np.errstate(invalid="ignore"):
        part = np.where(errors > 1e-290, errors / bound, 0)
    assert 0.02 < part.max() <= 1


@pytest.mark.parametrize("rank", [3, 2])
def test_algorithms_are_written_out_as_they_are(rank: int) -> None:
    n, m = 5, 3
    rng = np.random.default_rng(rank)
    B, C = rng.normal(size=(n, n)), rng.normal(size=(m, n))
    if rank < m:
        C[2] = C[0] + 2 * C[1]
    M = B @ B.T
    scales = [*rng.uniform(0.5, 2, m), *rng.uniform(0.5, 2, n)]
    of_saddle = [SMOOTHED, *M[np.tril_indices(n)], *C.ravel(), *scales, *rng.normal(size=n + m)]
    of_multipliers = [*C.ravel(), *scales, *(C.T @ rng.normal(size=m))]
    for intrinsic, given in ((Saddle((n, m), ""), of_saddle), (Multipliers((n, m), ""), of_multipliers)):
        if rank < m and isinstance(intrinsic, Saddle):
            given[-1] = given[-3] + 2 * given[-2]  # of rows that do not contradict each other
        r = Recorder()
        values = {f"v{k}": v for k, v in enumerate(given)}
        first = [Fraction(given[0])] if isinstance(intrinsic, Saddle) else []
        results = r.call(intrinsic, [*first, *[r.leaf(f"v{k}", PARAMETER << 2) for k in range(len(first), len(given))]])
        whole = written_out(Tape.of(r, x=results))
        assert whole.smooths and not any(node.op == "call" for node in whole.tape.steps)
        exact = np.array(evaluate(whole.tape, values, 32)["x"], dtype=float)
        np.testing.assert_allclose(exact, intrinsic.rows(given), rtol=1e-8, atol=1e-9)
        bound = first_order(whole.tape, values, 1).of("c")[0]
        errors = np.abs(evaluate_rows(whole.tape, values, 1)["x"][0] - exact)
        assert (errors < bound).all() and bound.max() < 1e-8


def test_results_of_other_algorithms_have_no_bound() -> None:
    tested = SystemUnderTest("floating_crane")
    where = rounding.states(tested, 2)
    rows = np.column_stack([where.t, where.x, where.inputs, where.ud])
    tape = emitted(tested, ["F_tilde"])["F_tilde"][0].tape
    bound = first_order(tape, leaves(tested, rows), 2).of("c")
    assert np.isinf(bound).any(axis=1).all() and np.isfinite(bound).any(axis=1).all()  # buoyancy, weights


# -- what it finds


@needs_c
def test_generated_code_is_within_its_bound_also_next_to_lost_rank(measured: dict, source: Any) -> None:
    every = found(measured, source)
    assert all(f.verdict == PASS and f.beyond <= 0 and f.near.beyond <= 0 for f in every)
    rhs = every[0]
    assert measured["rhs"].smoothed.sum() >= 4 and rhs.near.states >= 1 and rhs.near.most > 2
    assert rhs.near.beyond > -10 and rhs.near.noise == 0
    rows = list(set_aside(Named, every))  # type: ignore[arg-type]
    assert [(row.check, row.verdict, row.bound) for row in rows] == [("lost rank", DEGRADE, 0.0)]


@needs_c
def test_a_sine_that_is_slightly_wrong_is_found_in_every_function(measured: dict, source: Any) -> None:
    every = found(measured, source, "0.16666666666666557", "0.16666666666682223")  # by 1e-12 of it
    assert all(f.beyond > 0 for f in every)
    row = next(first_order_row(Named, "C", every))  # type: ignore[arg-type]
    assert row.verdict == FAIL and all(name in row.done for name in NAMES)


@needs_c
@pytest.mark.parametrize(("old", "new"), [
    ("lam[k] -= a * symdyn_less(", "lam[k] -= 1.001 * a * symdyn_less("), ("SYMDYN_ROUNDS 5", "SYMDYN_ROUNDS 4"),
    ("r[i] = symdyn_less(columns[i] * f[i], of_M[i].end - at, M[i] + at, 1, x + at);", "r[i] = columns[i] * f[i] + 0 * at;")],
    ids=["factor", "rounds", "term"])
def test_faults_next_to_lost_rank_are_found_there(measured: dict, source: Any, old: str, new: str) -> None:
    every = found(measured, source, old, new)
    assert all(f.beyond <= 0 for f in every) and every[0].near.beyond > 0
    near = next(row for row in set_aside(Named, every) if row.check == "lost rank")  # type: ignore[arg-type]
    assert near.verdict == FAIL and "not the solution" in near.why and "rhs" in near.done


def test_accelerations_that_miss_their_equations_are_found(crank: SystemUnderTest, measured: dict) -> None:
    one = measured["rhs"]
    x, n = one.where.x, len(one.where.x)
    rows = np.column_stack([np.zeros(n), x, np.zeros((n, 2))])
    u_dot = crank.evaluate("rhs", 0.0, x)[:, 2:]
    across = np.array([2.0, 1.0]) / math.sqrt(5)  # the constraint holds the other direction
    ordinary = np.arange(n) < 30
    assert imbalance(crank, rows[ordinary], u_dot[ordinary], "c").max() <= 0
    wrong = u_dot + 1e-9 * np.abs(u_dot).max(axis=1, keepdims=True) * across
    assert imbalance(crank, rows[ordinary], wrong[ordinary], "c").min() > 0
    assert len(imbalance(crank, rows[:0], u_dot[:0], "c")) == 0


def test_towards_gimbal_lock_the_bound_holds_until_states_are_rejected() -> None:
    turning = SystemUnderTest(attitude.free_body("angles"))
    x = np.zeros((5, 6))
    x[:, 0], x[:, 1], x[:, 2], x[:, 3:] = 0.3, math.pi / 2 - np.array([1e-9, 1e-7, 2e-7, 1e-6, 1.2]), 0.7, [0.3, 0.4, 0.5]
    where = rounding.States(np.zeros(5), x, np.zeros((5, 0)), np.zeros((5, 3)))
    one = rounding.Measured(turning, "rhs", where, None, emitted(turning, ["rhs"])["rhs"])
    assert one.coded is not None and one.coded.known.tolist() == [False, True, True, True, True]
    assert (one.coded.divisors >= 1).tolist() == [True, False, False, False, False]
    values = turning.evaluate("rhs", 0.0, x)
    assert np.isnan(values[0]).all() and np.isnan(one.values[0]).all() and np.isfinite(values[1:]).all()
    right = one.compared(values)
    assert right.rejected == right.singular.noise == right.unknown == 0 and right.beyond <= 0
    assert list(set_aside(Named, [right])) == []  # type: ignore[arg-type]
    values[:, 3:] += 1e-6 * np.abs(values[:, 3:]).max(axis=1, keepdims=True)
    assert one.compared(values).beyond > 0


def test_towards_a_stretched_arm_first_the_bound_ends_and_then_all_digits() -> None:
    """The upper rod is given the mass 0 only when the code runs, so that its pivot is compared with 0 and rounding passes."""
    arm = SystemUnderTest(two_points())
    arm.params = arm.module.parameters({"m_1": 0.0, "l": 0.7})
    x = np.zeros((4, 4))
    x[:, 0], x[:, 1], x[:, 2:] = 0.3, [5e-8, 1e-7, 1e-6, 1.2], [0.3, 0.4]
    where = rounding.States(np.zeros(4), x, np.zeros((4, 0)), np.zeros((4, 2)))
    one = rounding.Measured(arm, "rhs", where, None, emitted(arm, ["rhs"])["rhs"])
    assert one.coded is not None and one.coded.known.tolist() == [False, False, True, True]
    assert (one.coded.divisors >= 1).tolist() == [True, False, False, False]
    assert one.singular.tolist() == [True, True, False, False]
    values = arm.evaluate("rhs", 0.0, x)
    right = one.compared(values)
    assert right.singular.noise == 1 and -5 < right.singular.imbalance <= 0 and right.beyond <= 0
    values[:, 2:] += 1e-3 * np.abs(values[:, 2:]).max(axis=1, keepdims=True)
    wrong = one.compared(values)
    assert wrong.singular.imbalance > 0 and wrong.beyond > 0
    assert [row.verdict for row in set_aside(Named, [wrong])] == [FAIL]  # type: ignore[arg-type]


@needs_c
def test_states_close_to_lost_rank_are_sought(crank: SystemUnderTest) -> None:
    where = rounding.states(crank, 300)
    closer = rounding.towards_lost_rank(crank, where)
    assert closer.closer == len(closer.x) - 300 >= 6 and np.array_equal(closer.x[:300], where.x)
    assert np.abs(crank.evaluate("C", closer.t, closer.x)).max() < 1e-6
    tied = SystemUnderTest("pendulum_absolute")
    assert rounding.towards_lost_rank(tied, rounding.states(tied, 20)).closer == 0


# -- the rows


def test_rows_report_what_is_beyond_the_bound() -> None:
    fine, wrong = Finding("rhs", -1.0, -1.0, beyond=-0.3, unknown=4), Finding("lam", -1.0, -1.0, beyond=0.2)
    row = next(first_order_row(Named, "C", [fine, Finding("energy", -1.0, -1.0)]))  # type: ignore[arg-type]
    assert (row.verdict, row.figure, row.bound) == (PASS, -0.3, 0.0)
    assert "no bound is known of energy" in row.done and "up to 4 states" in row.done
    row = next(first_order_row(Named, "C", [fine, wrong]))  # type: ignore[arg-type]
    assert (row.verdict, row.figure) == (FAIL, 0.2) and "beyond it lam" in row.done
    assert list(first_order_row(Named, "C", [Finding("rhs", -1.0, -1.0)])) == []  # type: ignore[arg-type]


def test_states_without_a_bound_are_counted_over_all() -> None:
    gentle = [Finding(f"{r}", -1.0, -1.0, beyond=b, unknown=n) for r, b, n in ((1, -0.1, 0), (10, -0.9, 5), (100, -0.5, 2))]
    lost = Finding("1000", -1.0, -1.0, unknown=8)
    row, = first_order_row(Named, "C", [*gentle, lost], "ratios", 32)  # type: ignore[arg-type]
    assert row.done.startswith("C: 3 of 4 ratios; nearest to it 1; none holds at 15 of 32 states") and "branches" not in row.done
    row, = first_order_row(Named, "C", [lost], "ratios", 8)  # type: ignore[arg-type]
    assert (row.verdict, row.figure) == (DEGRADE, None) and "0 of 1 ratios; none holds at 8 of 8 states" in row.done


@pytest.mark.parametrize("place", ["near", "singular"])
def test_states_that_are_set_aside_are_reported_and_judged(place: str) -> None:
    def rows(**told: Any) -> list:
        return list(set_aside(Named, [Finding("lam", -1.0, -1.0, **{place: Aside(**told)})]))  # type: ignore[arg-type]

    row, = rows(states=3, most=4.5, least=1e17, beyond=-0.4, noise=2)
    assert (row.verdict, row.figure, row.bound) == (DEGRADE, -0.4, 0.0) and "lam at 3 of the states" in row.done
    assert "4.5 digits" in row.done and "at 2 of them a divisor is nothing but rounding error" in row.done
    for beyond in ({"beyond": 0.1}, {"imbalance": 0.1}):
        row, = rows(states=3, most=4.5, **beyond)
        assert row.verdict == FAIL and "not the solution" in row.why
    assert rows(states=0) == []
    row, = rows(states=1, most=0.5)
    assert (row.verdict, row.figure) == (DEGRADE, None)
