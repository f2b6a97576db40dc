"""Sampled controllers against exact discrete closed loops, by every method; what they see, what is recorded, how they fail."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import scipy.linalg
import sympy as sp

import symdyn as sd
from symdyn.runtime.building.compiler import find_compiler
from tests.helpers import swept

MASS, K_P, K_D, PERIOD = 2.0, 8.0, 4.0, 0.05
SCIPY = ["RK23", "RK45", "DOP853", "Radau", "BDF", "LSODA"]
COMPILED = ["dop853", "bs54", "taylor", "gauss", "radau", "radau5"]
EVERY = [("numpy", m) for m in SCIPY] + [("c", m) for m in ("auto", *COMPILED)]

needs_compiler = pytest.mark.skipif(find_compiler() is None, reason="no C compiler here")


@functools.cache
def cart(backend: str = "numpy") -> Any:
    """A mass on a rail with two forces and an output: a double integrator."""
    x, (F, D) = sd.coordinates("x"), sd.inputs("F D")
    s = sd.System("cart")
    rail = s.add_joint(sd.Prismatic("rail", s.ground, s.add_body("body", mass=MASS), x))
    s.add_joint_force(rail, F)
    s.add_joint_force(rail, D)
    s.add_output("thrust", F / MASS)
    s.initial = {x: 1.0}
    return s.compile(backend=backend)


def pd(t: float, x: np.ndarray) -> float:
    return float(-K_P * x[0] - K_D * x[1])


def discrete(n: int, period: float = PERIOD, delay: float = 0.0) -> np.ndarray:
    """States at the instants of the sampled loop, by matrix exponentials; with a delay below the period."""

    def step(h: float) -> tuple[np.ndarray, np.ndarray]:
        A = np.zeros((3, 3))
        A[0, 1], A[1, 2] = 1.0, 1.0 / MASS
        E = scipy.linalg.expm(A * h)
        return E[:2, :2], E[:2, 2]

    (A_1, b_1), (A_2, b_2) = step(delay), step(period - delay)
    found, held = [np.array([1.0, 0.0])], 0.0
    for _ in range(n):
        now = pd(0.0, found[-1])
        found.append(A_2 @ (A_1 @ found[-1] + b_1 * (held if delay else now)) + b_2 * now)
        held = now
    return np.array(found)


# -- the exact loop


@pytest.mark.parametrize(("backend", "method"), [pytest.param(b, m, marks=needs_compiler if b == "c" else ()) for b, m in EVERY])
def test_every_method_is_the_discrete_loop(backend: str, method: str) -> None:
    """A double integrator under a sampled PD law: to the tolerance, and to rounding where a method is exact for parabolas."""
    n = 20 if method in ("BDF", "gauss") or backend == "numpy" else 100
    times = PERIOD * np.arange(n + 1)
    sol = cart(backend).simulate(times, inputs={"F": sd.Sampled(pd, PERIOD)}, method=method, rtol=1e-8, atol=1e-10)
    expected = discrete(n)
    assert sol.success and np.abs(sol.x - expected).max() <= (1e-6 if method in ("BDF", "LSODA") else 1e-12)
    # At an instant the new value counts; at the end of the run the last one is held.
    held = np.array([pd(0.0, x) for x in expected])
    assert np.allclose(sol["F"][:-1], held[:-1], atol=1e-6) and sol["F"][-1] == sol["F"][-2]
    assert np.array_equal(sol.inputs[:, 1], np.zeros(n + 1))


@pytest.mark.parametrize("backend", ["numpy", pytest.param("c", marks=needs_compiler)])
def test_values_are_held_and_recorded_to_the_last_bit(backend: str) -> None:
    said: list[float] = []

    def law(t: float, x: np.ndarray) -> float:
        said.append(pd(t, x))
        return said[-1]

    sol = cart(backend).simulate((0, 1), inputs={"F": sd.Sampled(law, PERIOD)}, rtol=1e-9)
    t, values = sol.samples["F"]
    assert np.allclose(t, PERIOD * np.arange(20), atol=1e-15) and np.array_equal(values, said)
    index = np.searchsorted(t, sol.t, side="right") - 1
    assert np.array_equal(sol["F"], values[index]) and np.array_equal(sol["thrust"], values[index] / MASS)
    assert set(sol.samples) == {"F"}


def test_every_step_is_stored_once_and_steps_end_at_instants() -> None:
    sol = cart().simulate((0, 1), inputs={"F": sd.Sampled(pd, PERIOD)}, steps=True)
    assert (np.diff(sol.t) > 0).all() and set(sol.samples["F"].t) <= set(sol.t) and sol.t[-1] == 1.0
    assert sol.n_steps == len(sol.t) - 1


@pytest.mark.parametrize("delay", [0.0, 0.02, 0.0375])
def test_a_delay_of_the_computer(delay: float) -> None:
    times = PERIOD * np.arange(41)
    sol = cart().simulate(times, inputs={"F": sd.Sampled(pd, PERIOD, delay=delay)}, rtol=1e-9)
    assert np.abs(sol.x - discrete(40, delay=delay)).max() < 1e-12
    assert np.allclose(sol.samples["F"].t, times[:-1] + delay, atol=1e-15)


def test_a_delay_of_several_periods_queues_values() -> None:
    sol = cart().simulate((0, 1), inputs={"F": sd.Sampled(lambda t, x: t, 0.1, delay=0.25)}, rtol=1e-9)
    assert np.allclose(sol.samples["F"].t, 0.25 + 0.1 * np.arange(8)) and np.allclose(sol.samples["F"].values, 0.1 * np.arange(8))


def test_an_offset_leaves_the_initial_value_until_the_first_instant() -> None:
    x, F = sd.coordinates("x"), sd.inputs("F")
    s = sd.System("pushed")
    s.add_joint_force(s.add_joint(sd.Prismatic("rail", s.ground, s.add_body("body", mass=1), x)), F)
    s.initial = {F: 3.0}
    late = sd.Sampled(lambda t, x: 0.0, 1.0, offset=0.3)
    sol = s.compile(backend="numpy").simulate([2.0, 2.3, 3.0], inputs={F: late}, rtol=1e-9)
    assert np.allclose(sol.x, [[0, 0], [0.5 * 3 * 0.09, 0.9], [0.135 + 0.63, 0.9]]) and np.array_equal(sol["F"], [3.0, 0.0, 0.0])


def test_controllers_of_two_rates_and_a_function_of_time_run_together() -> None:
    """The slow one sets D; x_ddot = (F + D) / m with F by t alone in a third run."""
    fast, slow = sd.Sampled(lambda t, x: 1.0 + t, 0.1), sd.Sampled(lambda t, x: -t, 0.25)
    sol = cart().simulate((0, 1), inputs={"F": fast, "D": slow}, rtol=1e-9)
    assert np.array_equal(sol.samples["F"].t, 0.1 * np.arange(10)) and np.array_equal(sol.samples["D"].t, [0, 0.25, 0.5, 0.75])
    impulse = 0.1 * np.sum(1 + 0.1 * np.arange(10)) - 0.25 * np.sum([0, 0.25, 0.5, 0.75])
    assert np.isclose(sol.u[-1, 0], impulse / MASS, rtol=1e-12)
    mixed = cart().simulate((0, 1), inputs={"F": lambda t, x: 3 * t**2, "D": slow}, rtol=1e-10)
    assert np.isclose(mixed.u[-1, 0], (1 - 0.375) / MASS, rtol=1e-9)
    assert np.allclose(mixed["F"], 3 * mixed.t**2) and mixed["D"][-1] == -0.75


def test_one_controller_sets_several_inputs() -> None:
    both = sd.Sampled(lambda t, x: [t, -2 * t], 0.5)
    for inputs in (both, {("F", "D"): both}, {("D", "F"): sd.Sampled(lambda t, x: [-2 * t, t], 0.5)}):
        sol = cart().simulate((0, 1), inputs=inputs)
        assert np.array_equal(sol.inputs[-1], [0.5, -1.0]) and set(sol.samples) == {"F", "D"}


def test_instants_do_not_drift() -> None:
    """After 300 instants time is begin + k period, not a sum; each is asked once, in order."""
    asked: list[float] = []
    cart().simulate((0.3, 3.3), inputs={"F": sd.Sampled(lambda t, x: asked.append(t) or 0.0, 0.01)}, method="RK23", rtol=0.1)
    assert len(asked) == 300 and np.array_equal(asked, 0.3 + 0.01 * np.arange(300))


def test_an_instant_that_rounding_puts_before_the_end_is_the_end() -> None:
    """Three times 0.3 is 0.9 but for a unit in the last place; at the end nothing is asked, and no step is as short as that."""
    asked: list[float] = []
    sol = cart().simulate((0, 0.9), inputs={"F": sd.Sampled(lambda t, x: asked.append(t) or t, 0.3)}, steps=True)
    assert 3 * 0.3 < 0.9 and np.array_equal(asked, [0, 0.3, 0.6]) and len(sol.samples["F"].t) == 3
    assert sol.t[-1] == 0.9 and np.diff(sol.t).min() > 1e-9


# -- events, outputs, work, trials


@functools.cache
def bouncing(backend: str = "numpy") -> Any:
    """A ball with a sampled force; it bounces without loss, and stops at t = 1.7 s at the latest."""
    y, F = sd.coordinates("y"), sd.inputs("F")
    s = sd.System("ball", gravity=[0, -10])
    rail = s.add_joint(sd.Prismatic("rail", s.ground, s.add_body("ball", mass=1), y, axis=[0, 1, 0]))
    s.add_joint_force(rail, F)
    s.add_event("floor", y, direction=-1, reset={y.dot: -y.dot})
    s.add_event("clock", sd.t - 1.5, reset={y.dot: 2.0})
    s.add_event("push", F - 1.25)
    s.add_event("end", sd.t - 1.7, stop=True)
    s.initial = {y: 0.2}
    return s.compile(backend=backend)


@pytest.mark.parametrize("backend", ["numpy", pytest.param("c", marks=needs_compiler)])
@pytest.mark.parametrize("period", [0.1, 0.07])
def test_events_within_and_at_instants(backend: str, period: float) -> None:
    """The ball falls from 0.2 m in 0.2 s, at an instant of the period 0.1 s; the clock strikes at another one."""
    sol = bouncing(backend).simulate((0, 3), inputs={"F": sd.Sampled(lambda t, x: 0.0, period)}, rtol=1e-10, atol=1e-12)
    assert sol.success and "event end ended the motion at t = 1.7" in sol.message
    assert np.allclose(sol.events["floor"].t, [0.2, 0.6, 1.0, 1.4], atol=1e-9)
    assert np.allclose(sol.events["clock"].t, [1.5], atol=1e-12) and np.allclose(sol.events["end"].t, [1.7], atol=1e-12)
    after = sol.t > 1.5
    assert np.allclose(sol["y"][after], 0.15 + 2 * (sol.t[after] - 1.5) - 5 * (sol.t[after] - 1.5)**2, atol=1e-8)
    assert np.isclose(sol.t[-1], 1.7, atol=1e-12)


def test_events_see_the_held_value() -> None:
    """F jumps from 0.9 to 1.8 at an instant: there it passes 1.25, not where a line between them would."""
    sol = bouncing().simulate((0, 0.5), inputs={"F": sd.Sampled(lambda t, x: 9 * t, 0.1)}, events=["push"])
    assert np.array_equal(sol.events["push"].t, [0.2])
    assert np.array_equal(np.unique(sol["F"]), 9 * (0.1 * np.arange(5)))


@pytest.mark.parametrize("backend", ["numpy", pytest.param("c", marks=needs_compiler)])
def test_a_jump_of_a_held_value_stops_or_resets(backend: str) -> None:
    x, F = sd.coordinates("x"), sd.inputs("F")
    s = sd.System("fuse")
    s.add_joint_force(s.add_joint(sd.Prismatic("rail", s.ground, s.add_body("body", mass=1), x)), F)
    s.add_event("brake", F - 0.15, direction=1, reset={x.dot: 0})
    s.add_event("fuse", F - 0.35, stop=True)
    sol = s.compile(backend=backend).simulate([0.0, 0.05, 0.2, 1.0], inputs={F: sd.Sampled(lambda t, x: t, 0.1)}, rtol=1e-9)
    assert sol.success and "event fuse ended the motion at t = 0.4" in sol.message and np.isclose(sol.t[-1], 0.4)
    assert np.allclose(sol.events["brake"].t, [0.2]) and np.isclose(sol.u[-1, 0], 0.1 * (0.2 + 0.3), rtol=1e-12)


def test_the_work_of_a_held_force() -> None:
    sol = cart().simulate((0, 1), u=[0.5], inputs={"F": sd.Sampled(lambda t, x: 2.0, 0.3)}, work=True, rtol=1e-10)
    assert np.isclose(sol.work[-1], 2 * (0.5 + 0.5), rtol=1e-9) and sol.energy_error() < 1e-9


@pytest.mark.parametrize("options", [{"stabilization": "baumgarte"}, {"method": "auto"}, {"method": "ggl"}, {"method": "BDF"},
                                     {}])
def test_constrained_mechanisms_ask_once_for_each_instant(options: dict[str, Any]) -> None:
    """Trial runs, of Baumgarte's gain and of stiffness, hold the initial values; the loop is that of one hanging mass."""
    if options.get("method") == "ggl":
        pytest.importorskip("solve_dae")
    x, y, F = *sd.coordinates("x y"), sd.inputs("F")
    s = sd.System("bead", planar=True)
    carrier, bead = s.add_body("carrier", mass=1, inertia=1), s.add_body("bead", mass=1, inertia=1)
    rail = s.add_joint(sd.Prismatic("rail", s.ground, carrier, x, axis=[1, 0]))
    s.add_joint(sd.Prismatic("guide", s.ground, bead, y, axis=[0, 1]))
    s.add_joint_force(rail, F)
    s.add_constraint(x - y, name="rod")
    asked: list[float] = []

    def law(t: float, state: np.ndarray) -> float:
        asked.append(t)
        return 2.0 - t

    module = s.augmented().compile(backend="numpy")
    sol = module.simulate([0.0, 0.5, 1.0], inputs={F: sd.Sampled(law, 0.25)}, rtol=1e-7, **options)
    assert asked == [0.0, 0.25, 0.5, 0.75]
    assert np.isclose(sol.u[-1, 0], 0.25 * (8 - 1.5) / 2, rtol=1e-4) and np.allclose(sol["x"], sol["y"], atol=1e-5)


@needs_compiler
def test_a_fixed_step_fits_a_whole_number_of_times_between_instants() -> None:
    sol = cart("c").simulate((0, 1), inputs={"F": sd.Sampled(pd, 0.1)}, method="gauss", first_step=0.03, steps=True)
    assert np.allclose(np.diff(sol.t), 0.025) and sol.n_steps == 40


# -- tables and functions of time, states at any time


@pytest.mark.parametrize(("backend", "method"), [pytest.param(b, m, marks=needs_compiler if b == "c" else ())
                                                 for b, m in EVERY if m not in ("auto", "taylor", "gauss")])
def test_a_table_and_a_function_run_with_a_controller(backend: str, method: str) -> None:
    """x_ddot = (F + D) / m: D is a table with a kink between the instants, or the function of time of the same values."""

    def triangle(t: float, x: np.ndarray) -> float:
        return 3 * t if t <= 1 / 3 else 1.5 * (1 - t)

    held = sd.Sampled(lambda t, x: 2.0 - t, 0.25, delay=0.05)
    # Integral of F, which is 2, 1.75, 1.5, 1.25 N, each for a quarter of a second from 0.05 s on, cut at 1 s.
    speed = (0.25 * (2 + 1.75 + 1.5 + 1.25) - 0.05 * 1.25 + 0.5) / MASS
    for D in (([0, 1 / 3, 1], [0, 1, 0]), triangle):
        sol = cart(backend).simulate((0, 1), inputs={"F": held, "D": D}, method=method, rtol=1e-9)
        exact = 1e-6 if callable(D) or method in ("BDF", "LSODA") else 1e-11
        assert sol.success and abs(sol.u[-1, 0] - speed) < exact
        assert np.allclose(sol["D"], [triangle(t, sol.x[0]) for t in sol.t], atol=1e-13)
        assert sol["F"][0] == 0 and sol["F"][-1] == 1.25


@pytest.mark.parametrize("steps", [False, True])
@pytest.mark.parametrize(("backend", "method"), [pytest.param(b, m, marks=needs_compiler if b == "c" else ())
                                                 for b, m in (("numpy", "DOP853"), ("numpy", "BDF"), ("c", "dop853"))])
def test_states_at_any_time_repeat_what_was_held(backend: str, method: str, steps: bool) -> None:
    """The controllers are not asked again; rows are met to the last bit, and states between instants are those of the loop."""
    asked: list[float] = []

    def law(t: float, x: np.ndarray) -> float:
        asked.append(t)
        return pd(t, x) + 1e-3 * len(asked)

    sol = cart(backend).simulate((0, 1), inputs={"F": sd.Sampled(law, PERIOD)}, method=method, steps=steps)
    assert len(asked) == 20
    assert np.array_equal(sol(sol.t[::-3]), sol.x[::-3])
    t, values = sol.samples["F"]
    k = 7
    d = 0.3 * PERIOD
    x, v = sol(t[k])
    expected = [x + v * d + 0.5 * values[k] / MASS * d**2, v + values[k] / MASS * d]
    assert np.allclose(sol(t[k] + d), expected, atol=1e-6 if method == "BDF" else 1e-13) and len(asked) == 20


@pytest.mark.parametrize("failing", [0.0, 0.3])
def test_states_of_a_motion_that_a_controller_ended(failing: float) -> None:
    def law(t: float, x: np.ndarray) -> float:
        if t >= failing:
            raise RuntimeError("no signal")
        return pd(t, x)

    with pytest.warns(sd.SimulationWarning, match="no signal"):
        sol = cart().simulate((0, 1), inputs={"F": sd.Sampled(law, 0.1)}, steps=True)
    assert np.isclose(sol.t[-1], failing) and np.array_equal(sol(sol.t), sol.x)
    assert len(sol.samples.get("F", [[]])[0]) == round(failing / 0.1)


@pytest.mark.parametrize("backend", ["numpy", pytest.param("c", marks=needs_compiler)])
@pytest.mark.parametrize("steps", [False, True])
def test_states_of_a_motion_with_events(backend: str, steps: bool) -> None:
    """Just after a reset the states at its time are those before, as in other motions."""
    sol = bouncing(backend).simulate((0, 3), inputs={"F": sd.Sampled(lambda t, x: 0.1 * t, 0.1)}, rtol=1e-10, steps=steps)
    rows = np.append(True, np.diff(sol.t) > 0)
    assert sol.success and np.array_equal(sol(sol.t[rows]), sol.x[rows])


# -- what instants must not change: events at them, chattering


@functools.cache
def falling(backend: str, left: float | None, direction: int) -> Any:
    """A ball that falls from 0.2 m to the floor, which leaves it that part of its speed, or which it passes (None)."""
    y, F = sd.coordinates("y"), sd.inputs("F")
    s = sd.System("ball", gravity=[0, -10])
    rail = s.add_joint(sd.Prismatic("rail", s.ground, s.add_body("ball", mass=1), y, axis=[0, 1, 0]))
    s.add_joint_force(rail, F)
    s.add_event("floor", y, direction=direction, **({} if left is None else {"reset": {y.dot: left * y.dot}}))
    s.initial = {y: 0.2}
    return s.compile(backend=backend)


@pytest.mark.every_value
@pytest.mark.parametrize("backend", ["numpy", pytest.param("c", marks=needs_compiler)])
@pytest.mark.parametrize("direction", [-1, 0])
@pytest.mark.parametrize("left", [None, 0.5, -1.0])
def test_what_vanishes_at_an_instant_counts_once(backend: str, left: float | None, direction: int) -> None:
    """The fall takes 0.2 s: before, at and after an instant, with all that rounding does to it."""
    module = falling(backend, left, direction)
    for period in (0.2, 0.1, 0.1 / 3, 0.2 - 5e-16, 0.2 + 3e-16, 0.07):
        sol = module.simulate((0, 0.55), inputs={"F": sd.Sampled(lambda t, x: 0.0, period)}, rtol=1e-10)
        assert sol.success and np.allclose(sol.events["floor"].t, [0.2], atol=1e-9), period
        after = 1.0 if left is None else left
        assert np.isclose(sol.u[-1, 0], -2 * after - 10 * 0.35, atol=1e-8)
        assert left is None or np.isclose(sol.reset_energy["floor"][-1], 2 * (left**2 - 1), atol=1e-8)


@pytest.mark.parametrize("backend", ["numpy", pytest.param("c", marks=needs_compiler)])
@pytest.mark.parametrize("period", [0.2, 0.1, 0.1 / 3, 0.2 - 5e-16, 0.2 + 3e-16, 0.07])
def test_what_comes_to_rest_at_an_instant_does_not_fall_through(backend: str, period: float) -> None:
    with pytest.warns(sd.SimulationWarning, match="events, floor the last, with hardly any time between"):
        sol = falling(backend, 0.0, -1).simulate((0, 0.55), inputs={"F": sd.Sampled(lambda t, x: 0.0, period)}, rtol=1e-10)
    assert not sol.success and np.isclose(sol.t[-1], 0.2, atol=1e-6)


@functools.cache
def block(backend: str) -> Any:
    """A block with dry friction of 2 N on a rail."""
    x, F = sd.coordinates("x"), sd.inputs("F")
    s = sd.System("block")
    rail = s.add_joint(sd.Prismatic("rail", s.ground, s.add_body("block", mass=1), x))
    s.add_joint_force(rail, F - 2 * sp.sign(x.dot))
    s.initial = {x.dot: 0.5}
    return s.compile(backend=backend)


@pytest.mark.every_value
@pytest.mark.parametrize("backend", ["numpy", pytest.param("c", marks=needs_compiler)])
@pytest.mark.parametrize("period", [0.1, 0.001])
def test_chattering_is_found_through_short_periods(backend: str, period: float) -> None:
    """It sticks after a quarter of a second; a thousandth takes fewer steps than chattering is looked for by."""
    with pytest.warns(sd.SimulationWarning, match=r"sign\(x_dot\) in load joint_force_1 chatters"):
        sol = block(backend).simulate((0, 1), inputs={"F": sd.Sampled(lambda t, x: 0.0, period)}, rtol=1e-6)
    assert not sol.success and 0.25 < sol.t[-1] < 0.27 and sol.n_steps < 10_000


@pytest.mark.parametrize("backend", [*swept(["numpy"]), pytest.param("c", marks=needs_compiler)])
def test_a_relay_that_switches_at_every_instant_does_not_chatter(backend: str) -> None:
    """The force of 3 N switches with the sign of the speed at each of 500 instants: the steps are short, and no sliding."""
    sol = block(backend).simulate((0, 0.5), inputs={"F": sd.Sampled(lambda t, x: -3 * np.sign(x[1]), 0.001)}, rtol=1e-4)
    assert sol.success and abs(sol.u[-1, 0]) < 6e-3 and sol.n_steps >= 500


def test_many_motions_one_by_one() -> None:
    batch = cart().simulate_batch(q=[[1.0], [2.0]], t=[0.0, 0.5, 1.0], inputs={"F": sd.Sampled(pd, PERIOD)}, rtol=1e-9)
    assert "one by one" in batch.note and np.allclose(batch.x[1], 2 * batch.x[0], atol=1e-12)
    assert np.allclose(batch.x[0], discrete(20)[::10], atol=1e-12)


def test_many_motions_take_no_controller_backward() -> None:
    with pytest.raises(sd.ArgumentError, match="sampled controllers run forward in time"):
        cart().simulate_batch(q=[[1.0], [2.0]], t=[1.0, 0.0], inputs={"F": sd.Sampled(pd, PERIOD)})


def test_an_ensemble_takes_numbers_only() -> None:
    with pytest.raises(sd.ArgumentError, match=r"an ensemble takes numbers as inputs, found .*F.*: Sampled"):
        sd.ensemble(cart(), {"x": [1.0, 2.0]}, inputs={"F": sd.Sampled(pd, PERIOD)}, t=(0, 1))


# -- what goes wrong


def test_what_a_controller_raises_ends_the_motion() -> None:
    def law(t: float, x: np.ndarray) -> float:
        if t > 0.32:
            raise RuntimeError("no signal")
        return 1.0

    with pytest.warns(sd.SimulationWarning, match=r"stopped at t = 0.4: the sampled controller of F \(law\) raised "
                                                  r"RuntimeError: no signal, in line"):
        sol = cart().simulate((0, 1), inputs={"F": sd.Sampled(law, 0.1)})
    assert not sol.success and isinstance(sol.cause, RuntimeError) and sol.t[-1] == 0.4 and sol["F"][-1] == 1.0


def test_a_run_stops_after_so_many_steps() -> None:
    with pytest.warns(sd.SimulationWarning, match="steps were done|stopped after"):
        sol = cart().simulate((0, 10), inputs={"F": sd.Sampled(pd, 0.1)}, max_steps=25)
    assert sol.n_steps == 25 and not sol.success


def test_a_value_that_is_no_number_ends_the_motion() -> None:
    with pytest.warns(sd.SimulationWarning, match="the input F is nan"):
        sol = cart().simulate((0, 1), inputs={"F": sd.Sampled(lambda t, x: np.nan if t > 0.15 else 1.0, 0.1)})
    assert not sol.success


CASES: list[tuple[Callable[[], Any], str]] = [
    (lambda: sd.Sampled(3.0, 0.1), r"a sampled controller takes a function of \(t, x\) first, found 3.0"),
    (lambda: sd.Sampled(pd, 0.0), "the period of a sampled controller must be a number of seconds, more than 0, found 0.0"),
    (lambda: sd.Sampled(pd, "1"), "the period of a sampled controller must be a number of seconds, more than 0, found '1'"),
    (lambda: sd.Sampled(pd, 0.1, offset=-1), "the offset of a sampled controller must be .*, 0 or more, found -1"),
    (lambda: sd.Sampled(pd, 0.1, delay=np.inf), "the delay of a sampled controller must be .*, 0 or more, found inf"),
    (lambda: cart().simulate((1, 0), inputs={"F": sd.Sampled(pd, 0.1)}), "sampled controllers run forward in time, but t goes"),
    (lambda: cart().simulate((0, 1), inputs={"F": sd.Sampled(pd, 1e-12)}), "the period of the sampled controller of F, 1e-12 s"),
    (lambda: cart().simulate((0, 1), inputs={"G": sd.Sampled(pd, 0.1)}), "inputs: there is no 'G'; there are F, D"),
    (lambda: cart().simulate((0, 1), inputs={("F", "D"): sd.Sampled(pd, 0.1), "D": 1.0}), "inputs: D given more than once"),
    (lambda: cart().simulate((0, 1), inputs={("F", "D"): 1.0}), r"several inputs \(F, D\) take one Sampled controller together"),
    (lambda: cart().simulate((0, 1), inputs={"F": sd.Sampled(lambda t, x: [1, 2], 0.1)}), r"the sampled controller of F returned "
     r"\[1, 2\] at t = 0; needed is a number"),
    (lambda: cart().simulate((0, 1), inputs=sd.Sampled(lambda t, x: "up", 0.1)), "the sampled controller returned 'up' at t = 0; "
     "needed are 2 numbers"),
]


@pytest.mark.parametrize(("call", "message"), CASES, ids=[m[:40] for _, m in CASES])
def test_what_does_not_fit_is_rejected(call: Callable[[], Any], message: str) -> None:
    with pytest.raises(sd.ArgumentError, match=message):
        call()
