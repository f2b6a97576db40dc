"""Compiled methods stepped by SciPy's solve_ivp: against closed forms and simulate, within steps too; what it rejects."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from scipy.integrate import OdeSolver, solve_ivp
from scipy.special import ellipj, ellipk

import symdyn as sd
from symdyn.errors import ArgumentError, EvaluationError, SimulationWarning
from symdyn.runtime.integrating.methods import COMPILED
from symdyn.stress.attitude import free_body

TIMES = np.linspace(0, 10, 777)
K, W = np.sin(0.5), np.sqrt(9.81)


def angle(t: Any) -> Any:
    """Angle of a pendulum of 1 m that is released at 1 rad (Jacobi's elliptic functions)."""
    return 2 * np.arcsin(K * ellipj(ellipk(K**2) - W * t, K**2)[0])


@pytest.fixture(scope="module")
def pendulum(compiled: Callable[..., Any]) -> sd.Module:
    return compiled("pendulum", "c")


@pytest.fixture(scope="module")
def four_bar(pendulum: sd.Module) -> sd.Module:
    return sd.systems.four_bar().augmented().compile(backend="c")


@pytest.fixture(scope="module")
def pushed(pendulum: sd.Module) -> sd.Module:
    """A mass of 2 kg under a force; there is a C compiler."""
    x, F = sd.coordinates("x"), sd.inputs("F")
    system = sd.System("pushed", gravity=[0, 0])
    cart = system.add_body("cart", mass=2)
    system.add_joint(sd.Prismatic("rail", system.ground, cart, x, axis=[1, 0, 0]))
    system.add_force(cart, [F, 0, 0])
    return system.compile(backend="c")


# -- numbers


@pytest.mark.parametrize(("method", "error"), [("dop853", 4e-10), ("bs54", 2e-10), ("radau", 1e-10), ("radau5", 3e-10),
                                               ("taylor", 1e-12), ("gauss", 4e-12)])
def test_a_pendulum_within_steps_and_at_events(pendulum: sd.Module, method: str, error: float) -> None:
    solver = pendulum.ode_solver(method)
    assert issubclass(solver, OdeSolver)
    found = solve_ivp(solver.rhs, (0, 10), [1.0, 0.0], method=solver, rtol=1e-10, atol=1e-10, dense_output=True,
                      events=lambda t, y: y[0])
    assert found.status == 0 and found.success
    np.testing.assert_allclose(found.sol(TIMES)[0], angle(TIMES), rtol=0, atol=error)
    quarters = (2 * np.arange(len(found.t_events[0])) + 1) * ellipk(K**2) / W
    assert len(quarters) == 9
    np.testing.assert_allclose(found.t_events[0], quarters, rtol=0, atol=error)


@pytest.mark.parametrize("method", sorted(COMPILED))
def test_the_bits_are_those_of_simulate(pendulum: sd.Module, method: str) -> None:
    solver = pendulum.ode_solver(method)
    wanted = pendulum.simulate(TIMES, [1.0], [0.0], method=method, rtol=1e-9)
    found = solve_ivp(solver.rhs, (0, 10), [1.0, 0.0], method=solver, rtol=1e-9, atol=1e-9, t_eval=TIMES)
    np.testing.assert_array_equal(found.y.T, wanted.x)
    whole = solve_ivp(None, (0, 10), [1.0, 0.0], method=solver, rtol=1e-9, atol=1e-9, dense_output=True)
    np.testing.assert_array_equal(whole.sol(TIMES[::-1]).T, wanted.x[::-1])  # in any order, after the run


def test_steps_one_by_one_and_back(pendulum: sd.Module) -> None:
    solver = pendulum.ode_solver()(None, 10.0, np.array([angle(10.0), 0.0]), 0.0, rtol=1e-10, atol=1e-10)
    assert solver.direction == -1 and solver.nfev > 0
    lengths = []
    while solver.status == "running":
        assert solver.step() is None
        lengths.append(solver.step_size)
        inside = solver.dense_output()
        np.testing.assert_array_equal(inside(solver.t), solver.y)
        assert inside(np.linspace(solver.t_old, solver.t, 5)).shape == (2, 5)
    assert solver.t == 0.0 and sum(lengths) == pytest.approx(10.0)
    with pytest.raises(ArgumentError, match=re.escape("t = 11 lies outside of the step from ")):
        inside(11.0)


def test_an_event_ends_the_run(pendulum: sd.Module) -> None:
    def down(t: float, y: np.ndarray) -> float:
        return float(y[0])

    down.terminal = True  # type: ignore[attr-defined]
    solver = pendulum.ode_solver(params={"l": 1.0})
    found = solve_ivp(solver.rhs, (0, 10), [1.0, 0.0], method=solver, rtol=1e-10, atol=1e-10, events=down)
    assert found.status == 1
    np.testing.assert_allclose(found.t[-1], ellipk(K**2) / W, rtol=1e-9)


def test_constraints_are_kept_within_steps_too(four_bar: sd.Module) -> None:
    start = four_bar.consistent()
    solver = four_bar.ode_solver("dop853")
    found = solve_ivp(solver.rhs, (0, 3), np.concatenate(start), method=solver, rtol=1e-8, atol=1e-8, dense_output=True)
    times = np.linspace(0, 3, 311)
    wanted = four_bar.simulate(times, *start)
    np.testing.assert_array_equal(found.sol(times).T, wanted.x)
    residuals = four_bar.evaluate("C", times, found.sol(times).T)
    assert np.abs(residuals).max() < 1e-12
    drifting = four_bar.ode_solver("dop853", stabilization="none")
    loose = solve_ivp(drifting.rhs, (0, 3), np.concatenate(start), method=drifting, rtol=1e-4, atol=1e-4)
    assert np.abs(four_bar.evaluate("C", loose.t, loose.y.T)).max() > 1e-9
    damped = four_bar.ode_solver("dop853", stabilization=("baumgarte", 20.0))
    near = solve_ivp(damped.rhs, (0, 3), np.concatenate(start), method=damped)
    np.testing.assert_allclose(near.y[:, -1], wanted.x[-1], atol=1e-5)


def test_inputs_over_time(pushed: sd.Module) -> None:
    solver = pushed.ode_solver(inputs=lambda t, x: 4 * np.cos(t))  # x = 2 (1 - cos t)
    found = solve_ivp(solver.rhs, (0, 5), [0.0, 0.0], method=solver, dense_output=True)
    times = np.linspace(0, 5, 50)
    np.testing.assert_allclose(found.sol(times)[0], 2 * (1 - np.cos(times)), atol=1e-7)
    table = pushed.ode_solver(inputs={"F": ([0, 1, 2], [0, 4, 4])})  # x = t^3/3, then 1/3 + (t-1) + (t-1)^2
    found = solve_ivp(table.rhs, (0, 2), [0.0, 0.0], method=table)
    assert 1.0 in found.t
    np.testing.assert_allclose(found.y[:, -1], [7 / 3, 3.0], rtol=1e-12)
    with pytest.raises(ArgumentError, match=r"holds from t = 0 s to 2 s, and the run goes from 0 s to 3 s"):
        solve_ivp(table.rhs, (0, 3), [0.0, 0.0], method=table)


def test_the_right_hand_side_and_its_jacobian_for_scipys_methods(pendulum: sd.Module) -> None:
    solver = pendulum.ode_solver(params={"l": 2.0})
    states = np.array([[0.1, 0.2, 0.3], [1.0, 2.0, 3.0]])
    np.testing.assert_allclose(solver.rhs(0, states), [[1, 2, 3], -9.81 / 2 * np.sin([0.1, 0.2, 0.3])])
    np.testing.assert_allclose(solver.jac(0, states[:, 0]), [[0, 1], [-9.81 / 2 * np.cos(0.1), 0]])
    found = solve_ivp(solver.rhs, (0, 1), [0.1, 0.0], method="Radau", jac=solver.jac, vectorized=True, rtol=1e-8, atol=1e-10)
    wanted = solve_ivp(solver.rhs, (0, 1), [0.1, 0.0], method=solver, vectorized=True)
    np.testing.assert_allclose(found.y[:, -1], wanted.y[:, -1], atol=1e-6)


def test_nothing_to_do_and_a_step_of_its_own_length(pendulum: sd.Module) -> None:
    solver = pendulum.ode_solver()
    np.testing.assert_array_equal(solve_ivp(solver.rhs, (1, 1), [0.3, 0.0], method=solver).y[:, -1], [0.3, 0.0])
    found = solve_ivp(solver.rhs, (0, 1), [0.3, 0.0], method=solver, max_step=0.01, first_step=0.001)
    assert found.t[1] == 0.001 and np.diff(found.t).max() <= 0.0101


# -- what it rejects


def test_fun_of_other_parameters_is_rejected(pendulum: sd.Module) -> None:
    solver = pendulum.ode_solver(params={"l": 2.0})
    for fun in (pendulum.rhs, lambda t, y: [0.0]):
        with pytest.raises(ArgumentError, match=r"fun is not the right-hand side that .*: at t = .*pass solver\.rhs"):
            solve_ivp(fun, (0, 1), [0.0, 0.0], method=solver)


def test_messages(pendulum: sd.Module, four_bar: sd.Module, pushed: sd.Module) -> None:
    with pytest.raises(ArgumentError, match=r"a solver by the method 'RK45' asked for; there are dop853, .*SciPy's own methods"):
        pendulum.ode_solver("RK45")
    solver = pendulum.ode_solver()
    with pytest.raises(ArgumentError, match=r"the span \(0.0, inf\) is not finite"):
        solve_ivp(solver.rhs, (0, np.inf), [0.1, 0.0], method=solver)
    with pytest.raises(ArgumentError, match="y0 has 3 numbers, needed are 2: q1, q1_dot"):
        solve_ivp(solver.rhs, (0, 1), [0.1, 0.0, 0.0], method=solver)
    with pytest.raises(ArgumentError, match=r"rtol = 0\.5 lets"):
        solve_ivp(solver.rhs, (0, 1), [0.1, 0.0], method=solver, rtol=0.5)
    with pytest.warns(SimulationWarning, match="the compiled method 'dop853' has no use for jac, lband"):
        solve_ivp(solver.rhs, (0, 1), [0.1, 0.0], method=solver, jac=solver.jac, lband=1)
    with pytest.raises(ArgumentError, match="begin with the nearest consistent state"):
        closing = four_bar.ode_solver()
        solve_ivp(closing.rhs, (0, 1), np.ones(6), method=closing)
    with pytest.raises(ArgumentError, match="needs the C backend"):
        plain = sd.systems.pendulum().compile(backend="numpy").ode_solver()
        solve_ivp(plain.rhs, (0, 1), [0.1, 0.0], method=plain)
    with pytest.raises(ArgumentError, match=r"a sampled controller acts at instants.*module.simulate"):
        pushed.ode_solver(inputs={"F": sd.Sampled(lambda t, x: 1.0, 0.1)})


def test_a_run_that_stops_reports_why(pushed: sd.Module) -> None:
    def force(t: float, x: np.ndarray) -> float:
        if t > 0.9:
            raise OSError("no signal")
        return 1.0

    solver = pushed.ode_solver(inputs=force)
    with pytest.raises(EvaluationError, match=r"the input function .force. raised OSError: no signal") as caught:
        solve_ivp(None, (0, 2), [0.0, 0.0], method=solver)
    assert isinstance(caught.value.__cause__, OSError)
    silent = pushed.ode_solver(inputs=lambda t, x: np.nan)
    with pytest.raises(EvaluationError, match=r"stopped at t = 0: .*the input F is nan"):
        solve_ivp(None, (0, 2), [0.0, 0.0], method=silent)
    broken = pushed.ode_solver(inputs=lambda t, x: np.sqrt(1.0 - t) if t < 1 else np.nan)
    found = solve_ivp(None, (0, 2), [0.0, 0.0], method=broken)
    assert found.status == -1 and not found.success and found.t[-1] < 1.0
    assert "the input F is nan at t = 1" in found.message


def test_events_that_change_the_motion_are_left_out_only_on_request(pendulum: sd.Module) -> None:
    h = sd.coordinates("h")
    system = sd.System("ball", gravity=[0, -9.81])
    ball = system.add_body("ball", mass=1)
    system.add_joint(sd.Prismatic("fall", system.ground, ball, h, axis=[0, 1, 0]))
    system.add_event("floor", h, direction=-1, reset={h.dot: -0.5 * h.dot})
    module = system.compile(backend="c")
    with pytest.raises(ArgumentError, match=r"the events floor reset states or end the motion.*events=False"):
        module.ode_solver()
    solver = module.ode_solver(events=False)
    found = solve_ivp(solver.rhs, (0, 2), [1.0, 0.0], method=solver)
    np.testing.assert_allclose(found.y[:, -1], [1 - 9.81 * 2, -9.81 * 2], rtol=1e-9)


def test_rigid_contacts_are_left_to_simulate(pendulum: sd.Module) -> None:
    y = sd.coordinates("y")
    system = sd.System("ball", gravity=[0, -9.81])
    ball = system.add_body("ball", mass=1)
    system.add_joint(sd.Prismatic("height", system.ground, ball, axis=[0, 1], coordinate=y))
    system.add_contact(sd.Contact("floor", ball, system.ground))
    with pytest.raises(ArgumentError, match=r"rigid contacts switch between modes, .* use module\.simulate"):
        system.compile(backend="c").ode_solver()


def test_a_motion_near_gimbal_lock_warns(pendulum: sd.Module) -> None:
    solver = free_body("angles").compile(backend="c").ode_solver()
    start = np.array([0.0, 0.0, 0.0, 0.0, 2.0, 1e-4])
    with pytest.warns(SimulationWarning, match="ZYX angles of joint ball came within"):
        solve_ivp(solver.rhs, (0, 2), start, method=solver, rtol=1e-9)
