"""Chapter 3: what its wrong slides do to a motion, and what the right ones do."""

from __future__ import annotations

import importlib

import numpy as np
import pytest
import sympy as sp
from compared import compared
from scipy.integrate import solve_ivp

import symdyn as sd
from symdyn.comparison import Verdict
from symdyn.lecture import chapter_3_virtual_displacement as slope
from symdyn.model.symbols import symbols_of

LENGTH, G = 1.3, 9.81


def largest_stretch(right: bool) -> float:
    """Distance by which the mass of the pendulum leaves the circle in 1 s, by the last row as printed or as derived."""
    formula = next(f for f in compared("pendulum-augmented").formulas if f.name == "right side")
    last = (formula.derived if right else formula.printed)[2]
    names = ("x_P_dot", "y_P_dot")

    def rhs(_t: float, state: np.ndarray) -> np.ndarray:
        x, y, vx, vy = state
        value = float(last.subs({s: dict(zip(names, (vx, vy)))[s.name] for s in symbols_of(last)}))
        matrix = np.array([[1, 0, 2 * x], [0, 1, 2 * y], [2 * x, 2 * y, 0]])
        acceleration = np.linalg.solve(matrix, [0, -G, value])[:2]
        return np.array([vx, vy, *acceleration])

    sol = solve_ivp(rhs, (0, 1), [LENGTH, 0, 0, 0], rtol=1e-10, atol=1e-12)
    assert sol.success
    return float(np.abs(np.hypot(*sol.y[:2]) - LENGTH).max())


def test_the_printed_last_row_lets_the_mass_leave_the_circle() -> None:
    assert largest_stretch(right=True) < 1e-7
    assert largest_stretch(right=False) > 0.5


# Every line with something wrong, repetitions too.
WRONG = {
    "introduction": [], "straight_track": [], "rotating_track": [], "vehicle_and_track": [4167, 4190, 4192, 4197],
    "straight_track_augmented": [4672],
    "rotating_track_augmented": [4766, 4767, 4783, 4842, 4941, 4956, 4958, 4979, 4985, 5000, 5008, 5010],
    "pendulum_relative": [5115], "pendulum_augmented": [5292, 5352, 5396, 5410, 5444, 5446, 5476, 5566, 5570],
    "virtual_displacement": [],
}


@pytest.mark.parametrize("module", WRONG)
def test_errors_stand_where_they_are_known(module: str) -> None:
    cases = importlib.import_module(f"symdyn.lecture.chapter_3_{module}").CASES
    formulas = [f for case in cases for f in compared(case.name).formulas]
    wrong = [f for f in formulas if f.counts[Verdict.WRONG]]
    assert sorted({line for f in wrong for line in (f.slide.line, *f.also)}) == WRONG[module]
    assert not any(f.counts[Verdict.DIFFERENT] or f.counts[Verdict.UNDECIDED] for f in formulas)


def test_the_reaction_of_the_wire_is_right_at_rest_only() -> None:
    verdicts = {f.name: f.verdict for f in compared("pendulum-reaction").formulas}
    assert verdicts["F_c at rest"] is Verdict.EQUAL
    assert verdicts["F_c"] is Verdict.WRONG


def test_the_reaction_of_a_slope_in_motion_works_in_the_actual_displacement_only() -> None:
    """The slides ask and leave open: is dr . F_c zero? At t = 0 the slope turns at 0.7 rad/s."""
    angle = sp.Rational(2, 5) + sp.Rational(7, 10) * sd.t
    _, _, F_c, J, r_t = slope._particle(angle)
    values = {"q1": 2.0, "q1_dot": 0.3, "t": 0.0, "m": 1.5, "g": 9.81}

    def number(expression: sp.Expr) -> float:
        return float(expression.subs({s: values[s.name] for s in symbols_of(expression)}))

    # In the frame of the slope the Coriolis force lightens the push; against it the place under the mass sinks at q1 times 0.7.
    push = 1.5 * (9.81 * np.cos(0.4) - 2 * 0.3 * 0.7)
    np.testing.assert_allclose(number((r_t.T * F_c)[0]), -2.0 * 0.7 * push, rtol=1e-12)
    assert abs(number((J.T * F_c)[0])) < 1e-12
