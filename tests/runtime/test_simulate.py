"""Simulations: against SciPy and closed forms, in every form of time and input; what is said and kept when one stops."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import threading
import time
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sympy as sp
from scipy import integrate

import symdyn as sd
from symdyn.errors import (
    ArgumentError,
    EvaluationError,
    EvaluationWarning,
    MissingExtra,
    SimulationInterrupted,
    SimulationWarning,
)
from symdyn.runtime.building.compiler import find_compiler
from symdyn.runtime.integrating.methods import COMPILED
from tests.helpers import swept

ROOT = Path(__file__).parents[2]


BACKENDS = ["c", "numpy"]
START = {"q": [0.5, -0.4], "u": [1.0, -1.5]}
X0 = [0.5, -0.4, 1.0, -1.5]


@pytest.fixture(scope="session")
def wanted(compiled: Callable[..., Any]) -> Any:
    """The double pendulum by SciPy at the tightest tolerances it takes, as a function of time."""
    module = compiled("double_pendulum", "numpy")
    done = integrate.solve_ivp(module.rhs, (0, 3), X0, method="DOP853", rtol=3e-14, atol=1e-15, dense_output=True)
    return done.sol


# -- numbers


def test_double_pendulum_against_scipy(double: Any, wanted: Any) -> None:
    solution = double.simulate((0, 3), **START, rtol=1e-12)
    assert solution.success and solution.message == "reached the end" and solution.status == 0
    np.testing.assert_array_equal(solution.t, np.linspace(0, 3, 1001))
    np.testing.assert_allclose(solution.x, wanted(solution.t).T, rtol=0, atol=1e-9)


def test_same_method_takes_similar_steps(compiled: Callable[..., Any]) -> None:
    c, numpy = (compiled("double_pendulum", b).simulate((0, 3), **START, rtol=1e-10) for b in BACKENDS)
    assert c.method == "dop853" and numpy.method == "DOP853" and (c.backend, numpy.backend) == ("c", "numpy")
    assert 0.6 < c.n_steps / numpy.n_steps < 1.6 and c.nfev < 1.6 * numpy.nfev
    assert c.integrator_seconds < c.seconds and numpy.integrator_seconds is None


def test_energy_is_kept(double: Any) -> None:
    solution = double.simulate((0, 3), rtol=1e-12)
    assert solution.energy_error() < 1e-10


def test_tolerance_rules_the_error(double: Any, wanted: Any) -> None:
    errors = [np.abs(double.simulate([0, 3.0], **START, rtol=r, steps=True).x[-1] - wanted(3.0)).max() for r in (1e-5, 1e-9)]
    assert 1e-10 < errors[0] < 1e-2 and errors[1] < 1e-3 * errors[0]


# -- times


def test_span_times_and_steps(double: Any, wanted: Any) -> None:
    span = double.simulate((0, 2), **START, rtol=1e-11)
    times = double.simulate(np.array([0.0, 0.1, 1.2345, 2.0]), **START, rtol=1e-11)
    steps = double.simulate((0, 2), **START, rtol=1e-11, steps=True)
    assert (span.t.shape, span.x.shape) == ((1001,), (1001, 4))
    np.testing.assert_array_equal(times.t, [0.0, 0.1, 1.2345, 2.0])
    assert steps.t[0] == 0.0 and steps.t[-1] == 2.0 and len(steps.t) == steps.n_steps + 1 and (np.diff(steps.t) > 0).all()
    for solution in (span, times, steps):
        np.testing.assert_array_equal(solution.x[0], X0)
        np.testing.assert_allclose(solution.x, wanted(solution.t).T, rtol=0, atol=1e-7)
    np.testing.assert_allclose(times.x[-1], span.x[-1], rtol=0, atol=1e-13)


def test_two_times_in_an_array_are_output_times(double: Any) -> None:
    assert double.simulate(np.array([0.0, 2.0]), **START).t.tolist() == [0.0, 2.0]
    assert len(double.simulate([0.0, 2.0], **START).t) == 1001


def test_backward(double: Any) -> None:
    there = double.simulate((0, 1.5), **START, rtol=1e-12)
    back = double.simulate((1.5, 0), q=there.q[-1], u=there.u[-1], rtol=1e-12)
    assert back.t[0] == 1.5 and back.t[-1] == 0.0 and (np.diff(back.t) < 0).all()
    np.testing.assert_allclose(back.x[-1], X0, rtol=0, atol=1e-9)
    np.testing.assert_allclose(back.x[::-1], there.x, rtol=0, atol=1e-9)
    some = double.simulate(np.array([1.5, 1.0, 0.3]), q=there.q[-1], u=there.u[-1], rtol=1e-12)
    np.testing.assert_allclose(some.x[1:], double.simulate(np.array([0, 0.3, 1.0]), **START, rtol=1e-12).x[:0:-1], atol=1e-9)


def test_start_that_is_not_zero_and_no_time_at_all(oscillator: Any) -> None:
    late = oscillator.simulate(np.linspace(100.0, 101.0, 5))
    np.testing.assert_allclose(late.x, oscillator.simulate(np.linspace(0.0, 1.0, 5)).x, rtol=1e-7)
    nothing = oscillator.simulate((2.0, 2.0))
    assert nothing.success and (nothing.t == 2.0).all() and (nothing.x == [1.0, 0.0, 0.5]).all()


def test_defaults_of_the_system(oscillator: Any) -> None:
    solution = oscillator.simulate()
    assert (solution.t[0], solution.t[-1]) == (0.0, 5.0)
    np.testing.assert_array_equal(solution.x[0], [1.0, 0.0, 0.5])
    assert solution.inputs.tolist()[0] == [0.0, 0.25]
    np.testing.assert_array_equal(oscillator.simulate((0, 1), q={"q": 2.0}, u=[3.0], z={sp.Symbol("z"): 4.0}).x[0], [2, 3, 4])


def test_start_by_name(double: Any) -> None:
    q1, q2 = sd.coordinates("q1 q2")
    solution = double.simulate((0, 0.1), q={q1: 0.3, "q2": 0.4}, u={q2.dot: 2.0})
    np.testing.assert_array_equal(solution.x[0], [0.3, 0.4, 0.0, 2.0])


def test_longest_and_first_step(oscillator: Any) -> None:
    assert np.diff(oscillator.simulate((0, 5), max_step=0.1, steps=True).t).max() <= 0.1 * 1.02
    assert np.diff(oscillator.simulate((0, 5), first_step=1e-3, steps=True).t)[0] == pytest.approx(1e-3)
    assert oscillator.simulate((0, 1), max_step=float("inf")).success


@pytest.mark.filterwarnings("ignore:At least one element of .rtol. is too small")
def test_tolerance_for_each_state(oscillator: Any) -> None:
    """The filter state may be coarse where nothing depends on it."""
    fine = oscillator.simulate((0, 5), rtol=1e-11)
    vector = oscillator.simulate((0, 5), rtol=1e-3, atol=[1e-11, 1e-11, 1e-2])
    assert vector.success and np.abs(vector.x[-1] - fine.x[-1]).max() < 0.02
    assert oscillator.simulate((0, 5), rtol=0.0, atol=1e-9).success


# -- inputs


FORMS = {
    "numbers": [0.5, -0.25],
    "by name": {"F": 0.5, "G": -0.25},
    "by symbol": {sp.Symbol("G"): -0.25, "F": 0.5},
    "function": lambda t, x: [0.5, -0.25],
    "table": ([0.0, 10.0], [[0.5, -0.25]] * 2),
    "mixed": {"F": lambda t, x: 0.5, "G": ([0.0, 4.0], [-0.25, -0.25])},
}


@pytest.mark.parametrize("form", FORMS)
def test_constant_inputs_in_every_form(oscillator: Any, form: str) -> None:
    solution = oscillator.simulate((0, 4), inputs=FORMS[form], rtol=1e-11)
    plain = oscillator.simulate((0, 4), inputs=(0.5, -0.25), rtol=1e-11)
    np.testing.assert_allclose(solution.x, plain.x, rtol=0, atol=1e-9)
    assert solution.inputs.shape == (1001, 2) and (solution.inputs == [0.5, -0.25]).all()
    # z_dot = F - z
    np.testing.assert_allclose(solution.z[:, 0], 0.5 + 0 * solution.t, atol=1e-10)


def test_inputs_over_time(oscillator: Any) -> None:
    times = np.linspace(0, 4, 41)
    values = np.column_stack([np.sin(times), np.cos(3 * times)])

    def linear(t: float, x: np.ndarray) -> list[float]:
        return [np.interp(t, times, values[:, 0]), np.interp(t, times, values[:, 1])]

    table = oscillator.simulate((0, 2), inputs=(times, values), rtol=1e-10, max_step=0.02)
    for inputs in (linear, {"F": (times, values[:, 0]), "G": lambda t, x: linear(t, x)[1]}, (list(times), values.tolist())):
        other = oscillator.simulate((0, 2), inputs=inputs, rtol=1e-10, max_step=0.02)
        np.testing.assert_allclose(other.x, table.x, rtol=0, atol=1e-9)
        np.testing.assert_allclose(other.inputs, table.inputs, rtol=0, atol=1e-15)
    np.testing.assert_allclose(table.inputs[::50], values[:21], rtol=0, atol=1e-14)


def test_ends_of_a_table_are_held(oscillator: Any) -> None:
    solution = oscillator.simulate((-1, 3), inputs=([0.0, 1.0], [[0.0, 0.0], [1.0, 0.0]]), extend="hold", rtol=1e-10)
    np.testing.assert_allclose(solution.inputs[:, 0], np.clip(solution.t, 0, 1), atol=1e-12)
    # z_dot = F - z from z(-1) = 0.5: decays to t = 0, follows the ramp to t = 1, then its end
    z0 = 0.5 * np.exp(-1.0)
    z1 = z0 * np.exp(-1.0) + np.exp(-1.0)
    assert solution.z[-1, 0] == pytest.approx(1 + (z1 - 1) * np.exp(-2.0), abs=1e-7)


def test_both_backends_agree_under_feedback(compiled: Callable[..., Any]) -> None:
    inputs = {"F": lambda t, x: -2.0 * x[1] - x[2], "G": ([0.0, 2.0, 4.0], [0.0, 1.0, -1.0])}
    c, numpy = (compiled("driven_oscillator", b).simulate((0, 4), inputs=inputs, rtol=1e-11, max_step=0.1) for b in BACKENDS)
    np.testing.assert_allclose(c.x, numpy.x, rtol=0, atol=1e-9)
    np.testing.assert_allclose(c.inputs, numpy.inputs, rtol=0, atol=1e-9)


def test_input_function_sees_the_state_and_may_keep_it(oscillator: Any) -> None:
    seen: list[tuple[float, np.ndarray]] = []

    def record(t: float, x: np.ndarray) -> list[float]:
        seen.append((t, x))
        return [0.0, 0.0]

    oscillator.simulate((0, 1), inputs=record)
    first = np.array(seen[0][1])
    np.testing.assert_array_equal(first, [1.0, 0.0, 0.5])
    assert seen[0][0] == 0.0 and not np.array_equal(seen[-1][1], first)


@pytest.mark.parametrize(("inputs", "message"), [
    ([1.0], r"inputs has the shape \(1,\), needed are 2 numbers: F, G"),
    ({"H": 1.0}, "inputs: there is no 'H'"),
    ({"F": "big"}, "the value of F is 'big', not a number"),
    ({"F": float("nan")}, "must be finite, found F = nan"),
    (lambda t, x: [1.0], "the input function returned 1 values at t = 0, needed are 2"),
    ({"F": lambda t, x: "much"}, "the function of input F returned 'much' at t = 0; needed is a number"),
    (([0.0, 1.0], [1.0, 2.0]), r"values of shape \(2,\); give one row of 2 values for each time"),
    (([0.0, 1.0], [[1.0, 2.0]] * 3), r"times of shape \(2,\) and values of shape \(3, 2\)"),
    (([0.0, 0.0], [[1.0, 2.0]] * 2), "the times of a table of inputs must increase"),
    (([0.0, 1.0], [[1.0, 2.0], [1.0, float("nan")]]), "all of it be finite"),
    ({"F": ([0.0, 1.0], [1.0, 2.0, 3.0])}, r"values of shape \(3,\); give one row of values for each time"),
])
def test_inputs_that_do_not_fit(oscillator: Any, inputs: Any, message: str) -> None:
    for method in (None, "Radau"):
        with pytest.raises(ArgumentError, match=message):
            oscillator.simulate((0, 1), inputs=inputs, method=method)


def test_inputs_of_a_system_without(double: Any) -> None:
    for nothing in (None, (), [], {}, np.zeros(0)):
        assert double.simulate((0, 0.1), inputs=nothing).success
    with pytest.raises(ArgumentError, match="inputs were given, but the system has none"):
        double.simulate((0, 0.1), inputs=[1.0])




@pytest.mark.every_value
@pytest.mark.parametrize("error", [ValueError, ZeroDivisionError, RuntimeError, EvaluationError, ArgumentError])
@pytest.mark.parametrize("method", [None, "radau", "gauss", "RK45", "Radau", "LSODA"])
def test_what_an_input_function_raises_ends_the_motion(oscillator: Any, error: type[Exception], method: str | None) -> None:
    if oscillator.backend == "numpy" and method in COMPILED:
        return

    def steer(t: float, x: np.ndarray) -> list[float]:
        if t > 0.5:
            raise error("mine")
        return [0.0, 0.0]

    line = steer.__code__.co_firstlineno + 2
    given = sd.Smooth(steer) if method == "gauss" else steer
    solution = stopped(lambda: oscillator.simulate((0, 1), inputs=given, method=method))
    assert re.fullmatch(rf"driven_oscillator: stopped at t = 0\.\d+: the input function \(steer\) raised {error.__name__}: mine, "
                        rf"in line {line} of test_simulate\.py; the state there: q = \S+, q_dot = \S+, z = \S+", solution.message)
    assert float(re.search(r"t = ([\d.]+)", solution.message).group(1)) > 0.5  # type: ignore[union-attr]
    assert type(solution.cause) is error and str(solution.cause) == "mine"
    # The motion before is there, the inputs with it.
    assert len(solution.t) > 1 and 0 < solution.t[-1] <= 0.5 and np.isfinite(solution.x).all()
    assert np.isfinite(solution.inputs).all() and np.isfinite(solution.energy).all()


@pytest.mark.parametrize("method", [None, "DOP853"])
def test_an_input_function_that_raises_at_once(oscillator: Any, method: str | None) -> None:
    def wrong(t: float) -> float:
        return 0.0

    solution = stopped(lambda: oscillator.simulate((0, 1), inputs={"G": wrong}, method=method))
    assert "stopped at t = 0: the function of input G (wrong) raised TypeError: " in solution.message
    assert isinstance(solution.cause, TypeError) and solution.t.tolist() == [0.0] and np.isnan(solution.inputs).all()
    given = stopped(lambda: oscillator.simulate((0, 1), inputs=lambda t, x: [][0], method=method))
    assert "t = 0: the input function raised IndexError: list index out of range, in line" in given.message
    assert oscillator.simulate((0, 0.1), method=method).cause is None


def table(v: np.ndarray) -> np.ndarray:
    if np.any(np.abs(v) > 1.5):
        raise RuntimeError("the table ends at 1.5 m/s")
    return 0.5 * v


def slope(v: np.ndarray) -> np.ndarray:
    return 0.5 + 0 * v


@pytest.fixture(scope="module")
def falling() -> Any:
    """A body that falls into what a function of the user, in Python alone, rejects, and an event of it."""
    x = sd.coordinates("x")
    system = sd.System("falling", gravity=[0, -10])
    body = system.add_body("body", mass=1)
    system.add_joint(sd.Prismatic("way", system.ground, body, x, axis=[0, 1]))
    slopes = sd.External("slope", ["v"], python=slope)
    system.add_joint_force("way", sd.External("table", ["v"], python=table, derivative=slopes)(x.dot))
    return system.embedding().compile(backend="numpy")


@pytest.mark.parametrize("method", ["DOP853", "Radau", "LSODA"])
def test_what_the_text_of_a_function_raises_ends_the_motion(falling: Any, method: str) -> None:
    solution = stopped(lambda: falling.simulate((0, 1), method=method))
    assert ("rhs cannot be evaluated: the function table(v) raised RuntimeError: the table ends at 1.5 m/s, in its line 3: raise "
            'RuntimeError("the table ends at 1.5 m/s"); at t = 0.1') in solution.message
    assert solution.message.startswith("falling: stopped at t = 0.1") and "the state there: x = -0." in solution.message
    assert type(solution.cause) is RuntimeError and 0.1 < solution.t[-1] < 0.2 and solution["x_dot"][-1] >= -1.5


def test_what_the_text_of_a_function_raises_in_evaluations(falling: Any) -> None:
    told = "the function table.v. raised RuntimeError: the table ends at 1.5 m/s"
    with pytest.raises(EvaluationError, match=f"falling: rhs cannot be evaluated: {told}.*; at t = 0, x = 0, x_dot") as caught:
        falling.rhs(0, [0, -2])
    assert type(caught.value.__cause__) is RuntimeError
    with pytest.warns(EvaluationWarning, match=told):
        rows = falling.rhs_batch(0, [[0, -1], [0, -2], [0, 1]])
    assert np.isfinite(rows).all(axis=1).tolist() == [True, False, True]


def test_what_the_text_of_a_function_raises_in_an_event() -> None:
    x = sd.coordinates("x")
    system = sd.System("fall", gravity=[0, -10])
    body = system.add_body("body", mass=1)
    system.add_joint(sd.Prismatic("way", system.ground, body, x, axis=[0, 1]))
    system.add_event("fast", sd.External("table", ["v"], python=table)(x.dot) + 10)
    solution = stopped(lambda: system.embedding().compile(backend="numpy").simulate((0, 1)))
    assert "the function table(v) raised RuntimeError: the table ends at 1.5 m/s" in solution.message
    assert type(solution.cause) is RuntimeError and solution.t[-1] <= 0.15


def test_closed_form(oscillator: Any) -> None:
    """m q_ddot + d q_dot + k q = F + 2 G from rest at the equilibrium of the forces, plus a start velocity."""
    m, k, d, v = 2.0, 3.0, 0.1, 0.7
    solution = oscillator.simulate((0, 5), q=[(0.3 + 2 * 0.6) / k], u=[v], inputs=[0.3, 0.6], rtol=1e-12)
    decay, omega = d / (2 * m), np.sqrt(k / m - (d / (2 * m)) ** 2)
    exact = (0.3 + 2 * 0.6) / k + v / omega * np.exp(-decay * solution.t) * np.sin(omega * solution.t)
    np.testing.assert_allclose(solution.q[:, 0], exact, rtol=0, atol=1e-10)


# -- methods


@pytest.mark.parametrize("method", ["RK23", "RK45", "DOP853", "Radau", "BDF", "LSODA"])
def test_methods_of_scipy(oscillator: Any, method: str) -> None:
    solution = oscillator.simulate((0, 3), method=method, rtol=1e-6)
    assert solution.success and solution.method == method
    np.testing.assert_allclose(solution.x, oscillator.simulate((0, 3), rtol=1e-10).x, rtol=0, atol=2e-3)


@pytest.mark.parametrize("method", ["Radau", "BDF", "LSODA"])
def test_stiff_methods_get_the_exact_jacobian(oscillator: Any, method: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """A damper so strong that an explicit method would need a million steps: q creeps to G 2/k over the time d/k."""
    calls: list[Any] = []
    kind = type(oscillator.bind())
    original = kind.jacobian_x
    monkeypatch.setattr(kind, "jacobian_x", lambda *a: calls.append(a) or original(*a))
    solution = oscillator.simulate((0, 5), inputs=lambda t, x: [0.0, 3.0], params={"d": 3e5}, method=method, rtol=1e-6)
    assert solution.success and calls and solution.n_steps < 1000
    assert solution.q[-1, 0] == pytest.approx(2 - np.exp(-5e-5), abs=1e-7)


def test_solver_class(double: Any, wanted: Any) -> None:
    class Mine(integrate.DOP853):
        pass

    solution = double.simulate((0, 1), **START, method=Mine, rtol=1e-11)
    assert solution.method == "Mine"
    np.testing.assert_allclose(solution.x, wanted(solution.t).T, atol=1e-8)


@pytest.mark.parametrize(("method", "near"), [("dop85", "dop853 or DOP853"), ("rk45", "RK45"), ("radau7", ".*radau5.*"),
                                              ("atuo", "auto")])
def test_a_method_with_a_slip_of_the_pen(double: Any, method: str, near: str) -> None:
    with pytest.raises(ArgumentError, match=rf"there is no method '{method}', did you mean {near}\? There are dop853, .*radau5 "
                                            r"\(compiled\), RK23, .* auto \(chooses one of them\), ggl"):
        double.simulate((0, 1), method=method)


@pytest.mark.parametrize("method", ["euler", 5, str])
def test_unknown_method(double: Any, method: Any) -> None:
    with pytest.raises(ArgumentError, match="method 'euler'; there are dop853.*OdeSolver" if method == "euler" else
                       "must be a name or an OdeSolver class, found"):
        double.simulate((0, 1), method=method)


def test_compiled_method_needs_compiled_code(compiled: Callable[..., Any]) -> None:
    with pytest.raises(ArgumentError, match=r"'dop853' needs the C backend; .* Use method='DOP853'"):
        compiled("double_pendulum", "numpy").simulate((0, 1), method="dop853")


# -- stopping early


def stopped(run: Callable[[], Any]) -> Any:
    """The solution of a run that warns, with the warning's text as its message."""
    with pytest.warns(SimulationWarning) as caught:
        solution = run()
    assert not solution.success and solution.status == -1 and str(caught[0].message) == solution.message
    assert np.isfinite(solution.x).all() and len(solution.t) == len(solution.x)
    assert Path(caught[0].filename).name == Path(__file__).name
    return solution


@pytest.mark.parametrize("method", [None, "RK45", "Radau", "BDF", "LSODA"])
def test_nan_from_an_input(oscillator: Any, method: str | None) -> None:
    solution = stopped(lambda: oscillator.simulate((0, 1), inputs=lambda t, x: [np.nan if t > 0.5 else 0.0, 1.0],
                                                   method=method))
    assert 0.3 < solution.t[-1] <= 0.5
    for words in ("driven_oscillator: stopped at t = 0.", "not finite", "the state there: q = 0.9", "q_dot = -0.2", "z = 0.3"):
        assert words in solution.message
    name = oscillator.metadata.inputs[0]
    assert re.search(rf"; the input {name} is nan at t = 0\.\d+", solution.message)
    whole = oscillator.simulate(solution.t, inputs=[0.0, 1.0], rtol=1e-10)
    np.testing.assert_allclose(solution.x, whole.x, atol=1e-5)
    assert solution.energies.shape == (len(solution.t), 2)


@pytest.mark.parametrize("method", [None, "RK45", "Radau", "BDF", "LSODA"])
def test_nan_at_the_start(oscillator: Any, method: str | None) -> None:
    """SciPy's solvers look for ever for a first step from there."""
    solution = stopped(lambda: oscillator.simulate((0, 1), inputs=lambda t, x: [np.nan, 0.0], method=method))
    assert solution.t.tolist() == [0.0] and "stopped at t = 0: " in solution.message


def test_singular_from_the_start(compiled: Callable[..., Any], backend: str) -> None:
    module = compiled("vehicle_on_rotating_track", backend, track_inertia=False)
    solution = stopped(lambda: module.simulate((0, 1), q=[0.0, 0.3]))
    assert "the mass matrix is not positive definite at q2_dot" in solution.message and "q1 = 0, q2 = 0.3" in solution.message


def test_mass_matrix_that_loses_rank_on_the_way(compiled: Callable[..., Any], backend: str) -> None:
    """The tip moves on a straight line until the arm is stretched out."""
    module = compiled("arm_of_points", backend)
    solution = stopped(lambda: module.simulate((0, 5), q=[0.0, 1.0], u=[1.0, 0.5], rtol=1e-6))
    assert "the mass matrix is nearly singular there, along q1_dot, q2_dot" in solution.message
    assert 0.5 < solution.t[-1] < 0.53 and abs(solution.q[-1, 1]) < 0.3
    assert solution.energy_error() < 1e-3


def test_mass_matrix_that_is_not_positive_on_the_way() -> None:
    """A massless rod behind a negative inertia: the pivot of q1 changes its sign where cos(q2)^2 = 0.2."""
    module = sd.systems.cart_pole().embedding().compile()
    wrong = {"m_c": 1.0, "m_p": 1.0, "l": 1.0, "I_p": -0.9}
    solution = stopped(lambda: module.simulate((0, 5), params=wrong, q=[0.0, 1.5], u=[0.0, 1.0], rtol=1e-6))
    assert solution.t[-1] > 0 and "mass matrix" in solution.message and "q1_dot" in solution.message


def test_parameters_that_cannot_be(compiled: Callable[..., Any], backend: str) -> None:
    module = compiled("pendulum", backend)
    if backend == "c":
        with pytest.raises(EvaluationError, match=r"the mass matrix is not positive definite at q1_dot; check the parameters, of "
                                                  r"which l is 0$"):
            module.simulate((0, 1), params={"l": 0.0})
    else:
        told = stopped(lambda: module.simulate((0, 1), params={"l": 0.0})).message
        assert "not positive definite at q1_dot; check the parameters, of which l is 0; at t = 0" in told


def test_number_of_steps(double: Any) -> None:
    for options in ({}, {"steps": True}):
        solution = stopped(lambda options=options: double.simulate((0, 50), **START, max_steps=7, **options))
        assert solution.n_steps == 7 and 0 < solution.t[-1] < 50 and "as asked" in solution.message
    whole = double.simulate((0, 1), **START, max_steps=10_000)
    assert whole.success and whole.n_steps < 10_000


def test_step_that_becomes_too_small(oscillator: Any) -> None:
    """m q_ddot = q_dot^3, nearly, reaches infinity at t = m / (2 q_dot^2) from the start."""
    solution = stopped(lambda: oscillator.simulate((0, 2), u=[10.0], inputs=lambda t, x: [x[1] ** 3, 0.0]))
    assert solution.t[-1] == pytest.approx(0.01, abs=0.002) and "stopped at t = 0.0" in solution.message
    assert "too small" in solution.message or "less than spacing" in solution.message


@pytest.mark.parametrize("n", [1, 4096, 4097, 9000])
def test_many_steps_are_all_stored(compiled: Callable[..., Any], n: int) -> None:
    """More than the compiled integrator's store holds at once."""
    module = compiled("driven_oscillator", "c")
    solution = module.simulate((0, n * 1e-3), max_step=1e-3, first_step=1e-3, steps=True)
    assert len(solution.t) == solution.n_steps + 1 >= n and solution.t[-1] == n * 1e-3
    assert (np.diff(solution.t) > 0).all() and np.isfinite(solution.x).all()


# -- interrupts


def test_keyboard_interrupt_in_an_input_function(oscillator: Any) -> None:
    calls: list[float] = []

    def press(t: float, x: np.ndarray) -> list[float]:
        calls.append(t)
        if t > 0.6:
            raise KeyboardInterrupt
        return [0.0, 0.0]

    for method in (None, "BDF"):
        with pytest.raises(SimulationInterrupted) as caught:
            oscillator.simulate((0, 1), inputs=press, method=method, max_step=0.05)
        solution = caught.value.solution
        assert isinstance(caught.value, KeyboardInterrupt)
        assert 0.4 < solution.t[-1] <= 0.6 and not solution.success and "interrupted" in str(caught.value)
        assert sum(t > 0.6 for t in calls) == 1
        calls.clear()


PROGRAM = """
import signal, sys, time
sys.path.insert(0, {root!r})
from symdyn.errors import SimulationInterrupted
from tests.mechanisms import driven_oscillator
equations, usual = driven_oscillator().embedding(), signal.getsignal(signal.SIGINT)
for backend, options in [{cases}]:
    module = equations.compile(backend=backend)
    module.simulate((0, 1), **options)
    print("ready", flush=True)
    try:
        module.simulate((0, 1e9), max_step=1e-3, **options)
    except SimulationInterrupted as stop:
        s = stop.solution
        print("interrupted", len(s.t) > 0, s.x.shape == (len(s.t), 3), "interrupted" in s.message, s.n_steps > 0,
              signal.getsignal(signal.SIGINT) is usual, flush=True)
"""
OPTIONS = {"alone": "{}", "steps": '{"steps": True}', "function": '{"inputs": lambda t, x: (0.1, 0.2)}',
           "mixed": '{"inputs": {"F": lambda t, x: x[0]}}'}


@pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
@pytest.mark.parametrize("options", swept(OPTIONS, "alone"))
def test_ctrl_c_ends_a_long_run(options: str) -> None:
    """By compiled code, and by SciPy where no input is given."""
    backends = [*["c"][:find_compiler() is not None], *["numpy"][:options == "alone"]]
    cases = ", ".join(f"({backend!r}, {OPTIONS[options]})" for backend in backends)
    process = subprocess.Popen([sys.executable, "-c", PROGRAM.format(root=str(ROOT), cases=cases)], stdout=subprocess.PIPE,
                               stderr=subprocess.PIPE, text=True, cwd=ROOT)
    assert process.stdout is not None
    at_last = threading.Timer(60, process.kill)
    at_last.start()
    try:
        for _ in backends:
            assert process.stdout.readline() == "ready\n", process.communicate()[1]
            time.sleep(0.1)
            sent = time.monotonic()
            os.kill(process.pid, signal.SIGINT)
            assert process.stdout.readline() == "interrupted True True True True True\n", process.communicate()[1]
            assert time.monotonic() - sent < 2
        out, err = process.communicate(timeout=20)
    finally:
        at_last.cancel()
        process.kill()
    assert out == err == ""


AGAIN = """
import os, signal, sys, threading, time
sys.path.insert(0, {root!r})
from symdyn.errors import SimulationInterrupted
from tests.mechanisms import driven_oscillator
module = driven_oscillator().embedding().compile(backend="c")
module.simulate((0, 1))
started = [False]  # no lock, which Ctrl-C in its owner would leave locked
def inputs(t, x):
    started[0] = True
    return 0.1, 0.2
def press(k):
    while not started[0]:  # before the run Ctrl-C ends the program, as everywhere
        time.sleep(0.0005)
    time.sleep(0.005 + 0.0018 * k)
    os.kill(os.getpid(), signal.SIGINT)
for k in range(12):
    started[0] = False
    thread = threading.Thread(target=press, args=(k,))
    thread.start()
    try:
        module.simulate((0, 1e9), inputs=inputs, max_step=1e-3)
    except SimulationInterrupted:
        thread.join()
        print(k)
"""


@pytest.mark.skipif(sys.platform == "win32" or find_compiler() is None, reason="signals of POSIX, compiled code")
def test_ctrl_c_is_never_lost() -> None:
    """It may come between the compiled integrator and the first line of an input function, again and again."""
    done = subprocess.run([sys.executable, "-c", AGAIN.format(root=str(ROOT))], capture_output=True, text=True, timeout=30)
    assert done.stdout.split() == [str(k) for k in range(12)] and done.stderr == "", done.stderr


# -- progress


def test_progress(oscillator: Any, capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("tqdm")
    for options in ({}, {"steps": True}, {"method": "RK45"}):
        solution = oscillator.simulate((0, 5), progress=True, **options)
        shown = capsys.readouterr().err
        assert solution.success and "driven_oscillator: 100%" in shown and "5/5 s" in shown
    oscillator.simulate((5, 0), progress=True)
    assert "100%" in capsys.readouterr().err


@pytest.mark.parametrize("backend", ["c", "numpy"])
def test_progress_reports_what_is_made_at_the_first_use_of_a_method(backend: str, capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("tqdm")
    module = sd.systems.four_bar().augmented().compile(backend=backend)
    method = "radau" if backend == "c" else "Radau"
    module.simulate((0, 0.05), method=method, progress=True)
    shown = capsys.readouterr().err
    made = ["rhs", "rhs with the method radau" if backend == "c" else "jacobian_x"]
    assert all(f"four_bar: first use of {name}, which is derived and compiled" in shown for name in made)
    assert shown.rstrip().rpartition("\r")[2].startswith("four_bar: 100%")
    module.simulate((0, 0.05), method=method, progress=True)
    assert "first use" not in capsys.readouterr().err


def test_progress_without_tqdm(oscillator: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    for name in [n for n in sys.modules if n.split(".")[0] == "tqdm"] + ["tqdm", "tqdm.auto"]:
        monkeypatch.setitem(sys.modules, name, None)
    assert oscillator.simulate((0, 1)).success
    with pytest.raises(MissingExtra, match=r"pip install 'symdyn\[progress\]'"):
        oscillator.simulate((0, 1), progress=True)


# -- arguments


@pytest.mark.parametrize(("options", "message"), [
    ({"t": 5.0}, r"t must be \(start, end\) or an array of at least two finite times, found 5.0"),
    ({"t": [1.0]}, "at least two finite times"),
    ({"t": [[0.0, 1.0]]}, "at least two finite times"),
    ({"t": (0.0, float("inf"))}, "at least two finite times"),
    ({"t": ("a", "b")}, r"t must be \(start, end\) or an array of times, found \('a', 'b'\)"),
    ({"t": np.array([0.0, 1.0, 1.0])}, "must increase, or decrease, throughout"),
    ({"t": [0.0, 2.0, 1.0, 3.0]}, "must increase, or decrease, throughout"),
    ({"rtol": -1e-6}, "tolerances must be positive"),
    ({"rtol": 0.0}, "tolerances must be positive"),
    ({"rtol": 0.2}, r"rtol = 0\.2 lets the error of a step be nearly as large as the motion itself.*largest is 0\.1"),
    ({"rtol": 1.0}, "rtol = 1.0 lets the error of a step"),
    ({"rtol": float("nan")}, "tolerances must be positive"),
    ({"atol": -1.0}, "tolerances must be positive"),
    ({"atol": [1e-6] * 2}, "atol a number or 3 numbers"),
    ({"atol": "small"}, "atol a number or 3 numbers"),
    ({"rtol": "small"}, "rtol must be a number"),
    ({"max_step": -1.0}, "max_step must be a positive number of seconds"),
    ({"max_step": "short"}, "max_step must be a positive number of seconds"),
    ({"first_step": float("nan")}, "first_step must be a positive number of seconds"),
    ({"max_steps": 0}, "max_steps must be a number of steps from 1 on"),
    ({"max_steps": 1.5}, "max_steps must be a number of steps from 1 on"),
    ({"q": [1.0, 2.0]}, r"initial q has the shape \(2,\), needed are 1 numbers: q"),
    ({"u": {"q": 1.0}}, r"initial u: there is no 'q'; there are q_dot|did you mean q_dot"),
    ({"z": [float("nan")]}, "initial z must be finite, found z = nan"),
    ({"params": {"mass": 1.0}}, "parameters: there is no 'mass'"),
])
def test_arguments_that_do_not_fit(oscillator: Any, options: dict[str, Any], message: str) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        with pytest.raises(ArgumentError, match=message) as caught:
            oscillator.simulate(**{"t": (0.0, 1.0), **options})
    assert str(caught.value).startswith("driven_oscillator: ")


# -- what was found once and must not come back


@pytest.fixture(scope="module")
def rubbed() -> Any:
    """A pendulum with dry friction, whose work the implicit methods once got wrong."""
    q = sd.coordinates("q")
    system = sd.System("rubbed", gravity=[0, -9.81])
    bob = system.add_body("bob", mass=1, com=[0, -1])
    system.add_joint(sd.Revolute("pin", system.ground, bob, q))
    system.add_joint_force("pin", -0.5 * sp.sign(q.dot))
    return system.embedding().compile(backend="numpy")


@pytest.mark.parametrize("method", ["Radau", "BDF", "LSODA"])
def test_work_with_implicit_methods(rubbed: Any, method: str) -> None:
    plain = rubbed.simulate((0, 5), q=[1.0], method=method)
    worked = rubbed.simulate((0, 5), q=[1.0], method=method, work=True)
    np.testing.assert_allclose(worked.x, plain.x, atol=2e-5)
    assert worked.energy_error() < 1e-5 and worked.work[-1] < -1


def test_tolerance_below_double_precision(compiled: Any) -> None:
    with pytest.raises(ArgumentError, match="rtol = 1e-30 is finer than double precision can resolve; the smallest is 1e-15"):
        compiled("double_pendulum", "numpy").simulate((0, 1), rtol=1e-30)


def test_last_state_of_a_stopped_run_is_kept(oscillator: Any) -> None:
    solution = stopped(lambda: oscillator.simulate(np.array([0.0, 5.0, 10.0]), max_steps=3))
    assert len(solution.t) == 2 and 0 < solution.t[1] < 5


def test_euler_parameters_start_upright(compiled: Any) -> None:
    p = sd.coordinates("p0:4")
    system = sd.System("top", gravity=[0, 0, -9.81])
    body = system.add_body("body", mass=2, inertia=[1, 2, 2.5], com=[0.1, 0.2, 0.3])
    system.add_joint(sd.Spherical("joint", system.ground, body, p, sd.EulerParameters()))
    module = system.embedding().compile()
    solution = module.simulate((0, 2), rtol=1e-10)
    assert solution.q[0].tolist() == [1, 0, 0, 0]
    assert solution.energy_error() < 1e-8
    np.testing.assert_allclose((solution.q**2).sum(axis=1), 1, atol=1e-8)
    with pytest.raises(ArgumentError, match=r"initial q: p0, p1, p2, p3 have the norm 1.41421, not 1"):
        module.simulate((0, 2), q=[1, 1, 0, 0])
