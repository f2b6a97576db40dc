"""The Taylor method: order, closed forms over long times, other integrators, outputs, and what it does not take."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

import mpmath
import numpy as np
import pytest
import sympy as sp

import symdyn as sd
from symdyn.errors import ArgumentError, SimulationWarning, UnsupportedExpression
from symdyn.pipeline import emit
from symdyn.runtime.inputs.inputs import Inputs
from symdyn.runtime.integrating.compiled import run_compiled
from symdyn.runtime.integrating.outcome import Request
from symdyn.runtime.integrating.stabilization import Stabilization
from tests.helpers import GRAVITY, swept, swing
from tests.oracles.random_trees import random_tree
from tests.runtime.constrained import module as constrained

TAYLOR = {"method": "taylor"}
TIGHT = {"rtol": 1e-13, "atol": 1e-13}


@pytest.fixture(scope="module")
def double(compiled: Callable[..., Any]) -> Any:
    return compiled("double_pendulum", "c")


def driven() -> sd.System:
    """A pendulum on a slider that is moved, with a smooth force, an input, an extra state and a fault far away."""
    q1, q2 = sd.coordinates("q1 q2")
    m, length, k, g = sd.parameters("m l k g", positive=True)
    F = sd.inputs("F")
    z, grown = sd.coordinates("z grown")
    s = sd.System("driven", gravity=[0, -g])
    s.move_ground([sp.sin(3 * sd.t) / 10, sd.t**2 / 20])
    cart = s.add_body("cart", mass=m)
    bob = s.add_body("bob", mass=2 * m, inertia=m / 50, com=[0, -length])
    slider = s.add_joint(sd.Prismatic("slider", s.ground, cart, q1, axis=[1, 0]))
    s.add_joint(sd.Revolute("hinge", cart, bob, q2))
    s.add_joint_force(slider, F - k * q1 - sp.tanh(q1.dot) + z + sp.exp(-q2**2) / sp.sqrt(1 + q1**2))
    s.add_state(z, sp.cos(sd.t) * q2 - z**3)
    s.add_state(grown, grown**2)
    s.defaults = {m: 1.0, length: 0.5, k: 20.0, g: GRAVITY}
    s.initial = {q2: 0.4, F: 0.3, z: 0.2}
    return s


@pytest.fixture(scope="module")
def moved(pendulum: Any) -> Any:
    return driven().embedding().compile("c")


# -- accuracy


def test_measured_order(pendulum: Any) -> None:
    """Equal steps of order 6, the lowest, at their ends and between them."""
    start = {"q": {"q1": 2.0}, "u": {"q1_dot": 0.5}}
    exact = pendulum.simulate((0, 2), **start, **TIGHT)
    ends, middle = [], []
    for h in (0.05, 0.025, 0.0125):
        found = pendulum.simulate((0, 2), **start, rtol=0.1, atol=1e3, first_step=h, max_step=h, **TAYLOR)
        assert found.nfev == pytest.approx(6 * found.n_steps, abs=7)
        ends.append(np.abs(found.x[-1] - exact.x[-1]).max())
        middle.append(np.abs(found.x - exact.x).max())
    for errors in (ends, middle):
        assert 5.6 < np.log2(errors[0] / errors[-1]) / 2 < 7.5


def test_order_and_error_follow_the_tolerance(pendulum: Any) -> None:
    errors, orders = [], []
    for rtol in (1e-3, 1e-6, 1e-9, 1e-12, 1e-15):
        found = pendulum.simulate([0.0, 10.0], q=[2.0], rtol=rtol, atol=rtol, **TAYLOR)
        errors.append(abs(found.q[-1, 0] - swing(10.0, 2.0)))
        orders.append(round(found.nfev / found.n_steps))
        assert errors[-1] < 30 * rtol + 1e-14
    assert orders == [8, 12, 16, 20, 23] and found.n_rejected == 0


def test_two_thousand_seconds(fast: Any) -> None:
    found = fast.simulate([0.0, 1000.0, 2000.0], q=[2.0], rtol=1e-15, atol=1e-15, **TAYLOR)
    assert abs(found.q[-1, 0] - swing(2000.0, 2.0)) < 1e-11


@pytest.mark.parametrize("periods", swept([1000, 10_000], 1000))
def test_energy_of_many_periods(fast: Any, periods: int) -> None:
    with mpmath.workdps(20):
        period = float(4 * mpmath.ellipk(mpmath.sin(mpmath.mpf(1) / 2) ** 2) / mpmath.sqrt(GRAVITY))
        found = fast.simulate(np.linspace(0, periods * period, 101), q=[1.0], rtol=1e-15, atol=1e-15, max_steps=None, **TAYLOR)
        energy = [mpmath.mpf(u) ** 2 / 2 - GRAVITY * mpmath.cos(mpmath.mpf(q)) for q, u in found.x]
        assert max(abs(e - energy[0]) for e in energy) / GRAVITY < 1e-13


def test_a_start_with_symmetry(double: Any) -> None:
    """Horizontal at rest q has only the powers t^2, t^6, ... and u only t, t^5, ...: the last two vanish, of order 7 and 8."""
    loose = double.simulate([0.0, 1.0], q=[0, 0], rtol=1e-3, atol=1e-3, **TAYLOR)
    assert loose.nfev / loose.n_steps < 9.5 and loose.n_steps > 4
    np.testing.assert_allclose(loose.x[-1], double.simulate([0.0, 1.0], q=[0, 0], **TIGHT).x[-1], rtol=0, atol=0.02)


@pytest.mark.parametrize("scale", [1e-12, 1e12])
def test_slow_and_fast(scale: float, pendulum: Any) -> None:
    """The same motion in another unit of time: coefficients neither overflow nor vanish."""
    slow = pendulum.simulate(np.linspace(0, 3, 7), q=[2.0], rtol=1e-14, **TAYLOR)
    atol = [1e-12, 1e-12 / scale]
    options = {"params": {"g": GRAVITY / scale**2}, "rtol": 1e-14, "atol": atol}
    other = pendulum.simulate(np.linspace(0, 3, 7) * scale, q=[2.0], **options, **TAYLOR)
    np.testing.assert_allclose(other.q, slow.q, rtol=0, atol=1e-11)


# -- against the explicit method


@pytest.mark.parametrize("seed", [4])
def test_random_trees(seed: int) -> None:
    system = random_tree(seed)
    module = system.embedding().compile("c")
    rng = np.random.default_rng(seed)
    q, u = (rng.uniform(-0.5, 0.5, n) for n in (module.metadata.sizes.q, module.metadata.sizes.u))
    for group in module.metadata.unit_groups:
        places = [module.metadata.q.index(name) for name in group]
        q[places] /= np.linalg.norm(q[places])
    times = np.linspace(0, 0.5, 11)
    wanted, found = (module.simulate(times, q, u, **TIGHT, method=m) for m in ("dop853", "taylor"))
    np.testing.assert_allclose(found.x, wanted.x, rtol=0, atol=1e-10 * np.abs(wanted.x).max())


def test_constraints() -> None:
    bar = constrained("four_bar")
    times = np.linspace(0, 2, 21)
    found, wanted = (bar.simulate(times, **TIGHT, method=m) for m in ("taylor", "dop853"))
    np.testing.assert_allclose(found.x, wanted.x, rtol=0, atol=1e-10)
    assert np.abs(found.constraint_violation).max() < 1e-13 and found.success


def test_moved_ground_states_inputs_and_parameters(moved: Any) -> None:
    times = np.linspace(0, 2, 15)
    options = {"q": [0.1, 0.5], "u": [0.2, -1.0], "params": {"k": 35.0}, "inputs": [0.7], **TIGHT}
    found, wanted = (moved.simulate(times, **options, method=m) for m in ("taylor", "dop853"))
    np.testing.assert_allclose(found.x, wanted.x, rtol=0, atol=1e-11)


# -- outputs


def test_between_steps_and_backward(moved: Any) -> None:
    """Outputs do not change the steps; between them the polynomial is as good as at their ends; and back again."""
    times = np.linspace(0, 2, 201)
    every = moved.simulate((0.0, 2.0), steps=True, **TIGHT, **TAYLOR)
    dense = moved.simulate(times, **TIGHT, **TAYLOR)
    assert dense.n_steps == every.n_steps < 100
    np.testing.assert_array_equal(dense.x[-1], every.x[-1])
    single = moved.simulate([0.0, times[77]], **TIGHT, **TAYLOR)
    np.testing.assert_allclose(dense.x[77], single.x[-1], rtol=0, atol=1e-12)
    back = moved.simulate(times[::-1], q=dense.q[-1], u=dense.u[-1], z=dense.z[-1], **TIGHT, **TAYLOR)
    np.testing.assert_allclose(back.x[::-1], dense.x, rtol=0, atol=1e-9)


def test_step_lengths_asked_for(pendulum: Any) -> None:
    found = pendulum.simulate((0, 1), q=[2.0], steps=True, first_step=1e-3, max_step=0.05, **TAYLOR)
    lengths = np.diff(found.t)
    assert lengths[0] == pytest.approx(1e-3) and 0.04 < lengths.max() < 0.051


def test_a_pole_is_not_stepped_over(moved: Any) -> None:
    """z' = z^2 from 1 ends at t = 1."""
    with pytest.warns(SimulationWarning):
        found = moved.simulate((0.0, 2.0), z=[0.2, 1.0], rtol=1e-9, **TAYLOR)
    assert not found.success and found.t[-1] == pytest.approx(1.0, abs=1e-6)
    assert "the step became too small" in found.message


# -- what coefficients do not tell


def quadratic_drag(velocity: list[Any], c: Any) -> list[Any]:
    """A force -c |v| v whose |v| is a square root: no function that switches, but a kink at v = 0."""
    speed = sp.sqrt(sum(v**2 for v in velocity))
    return [-c * speed * v for v in velocity]


@pytest.fixture(scope="module")
def thrown(pendulum: Any) -> Any:
    x, y = sd.coordinates("x y")
    s = sd.System("thrown", gravity=[0, -GRAVITY])
    carriage, ball = s.add_body("carriage"), s.add_body("ball", mass=1)
    s.add_joint(sd.Prismatic("along", s.ground, carriage, x, axis=[1, 0]))
    s.add_joint(sd.Prismatic("up", carriage, ball, y, axis=[0, 1]))
    s.add_force(ball, quadratic_drag([x.dot, y.dot], sp.Rational(1, 10)))
    return s.embedding().compile("c")


@pytest.mark.parametrize("aside", [0.0, 1e-6, 1e-3])
def test_a_kink_and_what_is_nearly_one(aside: float, thrown: Any) -> None:
    """Straight up the speed is v = w tan, then -w tanh; with a bit of motion aside the kink is a sharp bend."""
    w, rise = np.sqrt(GRAVITY / 0.1), 10.0
    top = np.arctan(rise / w) * w / GRAVITY
    assert thrown.metadata.not_smooth == ""
    found = thrown.simulate([0.0, 2.0], u=[aside, rise], rtol=1e-9, atol=1e-9, **TAYLOR)
    assert found.u[-1, 1] == pytest.approx(-w * np.tanh((2.0 - top) * GRAVITY / w), abs=max(1e-7, aside**2))
    tight = thrown.simulate([0.0, 2.0], u=[aside, rise], **TIGHT)
    np.testing.assert_allclose(found.x[-1], tight.x[-1], rtol=0, atol=1e-7)
    assert found.n_rejected > 0 and found.n_steps < 40


def test_kinks_at_turning_points(pendulum: Any) -> None:
    q = sd.coordinates("q")
    s = sd.System("braked", gravity=[0, -GRAVITY])
    bob = s.add_body("bob", mass=1)
    s.add_joint(sd.Revolute("hinge", s.ground, bob, q, child_point=[0, 1]))
    s.add_force(bob, quadratic_drag([sp.cos(q) * q.dot, sp.sin(q) * q.dot], sp.Rational(1, 2)))
    module = s.embedding().compile("c")
    found, wanted = (module.simulate([0.0, 10.0], [1.2], [0.1], rtol=rtol, atol=rtol, method=m)
                     for m, rtol in (("taylor", 1e-9), ("dop853", 1e-12)))
    np.testing.assert_allclose(found.x[-1], wanted.x[-1], rtol=0, atol=1e-7)


def test_a_branch_cut_is_not_stepped_over(pendulum: Any) -> None:
    """A force that jumps where q changes sign; on each side energy is kept, of a potential with a kink at q = 0."""
    q = sd.coordinates("q")
    s = sd.System("cut")
    slider = s.add_joint(sd.Prismatic("slider", s.ground, s.add_body("block", mass=1), q, axis=[1, 0]))
    s.add_joint_force(slider, -4 * q + sp.atan2(q, -1) / 4)
    found = s.embedding().compile("c").simulate(np.linspace(0, 5, 21), [0.7], [0.2], rtol=1e-9, atol=1e-9, **TAYLOR)
    x, u = np.abs(found.q[:, 0]), found.u[:, 0]
    energy = u**2 / 2 + 2 * x**2 - (np.pi * x - x * np.arctan(x) + np.log1p(x**2) / 2) / 4
    assert np.abs(energy - energy[0]).max() < 1e-7 and (np.diff(np.sign(found.q[:, 0])) != 0).sum() > 2


def test_smooth_motion_is_not_slowed_down(double: Any) -> None:
    for tolerance in (1e-6, 1e-9, 1e-12, 1e-15):
        found = double.simulate([0.0, 10.0], [0.3, 0.5], rtol=tolerance, atol=tolerance, **TAYLOR)
        assert found.n_rejected == 0 and found.n_steps < 600


@pytest.mark.parametrize("q", [(0.3, 0.5), (0.0, 0.5), (0.0, 0.0), (-np.pi / 2, 0.0)])
def test_from_rest_without_absolute_tolerance(q: tuple[float, float], double: Any) -> None:
    """Speeds of 0, coordinates of 0 and the position of equilibrium have no size to go by."""
    found = double.simulate([0.0, 2.0], q, rtol=1e-9, atol=0.0, **TAYLOR)
    assert found.success and found.n_steps < 80 and found.n_rejected < 10
    np.testing.assert_allclose(found.x[-1], double.simulate([0.0, 2.0], q, **TIGHT).x[-1], rtol=0, atol=1e-7)


# -- what it does not take


def test_inputs_that_vary(moved: Any) -> None:
    for given in (lambda t, x: [t], (np.array([0.0, 1.0]), np.array([[0.0], [1.0]]))):
        with pytest.raises(ArgumentError, match="method 'taylor' does not fit: inputs that vary have no Taylor series; use "
                                                "method='dop853', or write them as expressions of the time t"):
            moved.simulate((0, 1), inputs=given, **TAYLOR)


def test_right_hand_sides_that_switch(derived: Callable[..., Any]) -> None:
    (q1,) = sd.coordinates("q1:2")
    system = sd.System("rubbing", planar=True)
    slider = system.add_joint(sd.Prismatic("slider", system.ground, system.add_body("block", mass=1), q1, axis=[1, 0]))
    system.add_joint_force(slider, -sp.Abs(q1.dot) * q1.dot)
    equations = system.embedding()
    with pytest.raises(UnsupportedExpression, match=r"rubbing: there is no Taylor series: the right-hand side switches \(abs\); "
                                                    "use method='dop853'"):
        emit(equations, "c", ("rhs",), standalone=False, method="taylor")
    module = equations.compile()
    if module.backend == "c":
        with pytest.raises(ArgumentError, match=r"does not fit: the right-hand side switches \(abs\)"):
            module.simulate((0, 1), **TAYLOR)


# -- where there are no series


@pytest.mark.native  # which steps come upon the points depends on rounding
@pytest.mark.parametrize("rtol", [*swept([1e-11]), 1e-12, *swept([1e-13]), 1e-15])
def test_turning_points_without_series_are_passed_by_the_default_method(rtol: float) -> None:
    """Bricard's loop, where the pivots of the dependent speeds change four times in 10 s: against dop853, forward and back."""
    loop = constrained("bricard")
    times = np.linspace(0, 10, 101)
    exact = loop.simulate(times, rtol=1e-13).x
    found = loop.simulate(times, rtol=rtol, **TAYLOR)
    assert found.success and np.abs(found.x - exact).max() < 1e-10
    np.testing.assert_array_equal(found.t, times)
    assert "no Taylor series (the dependent speeds do not follow from P6_z and P6_y here), " in found.message
    assert re.search(r" \d+ steps in [1-9] stretch(es)? are of dop853$", found.message)
    back = loop.simulate(times[::-1], q=found.q[-1], u=found.u[-1], rtol=rtol, **TAYLOR)
    assert back.success and np.abs(back.x[::-1] - exact).max() < 1e-9
    np.testing.assert_array_equal(found([3.3, 6.3, 9.0])[2], found(9.0))


def test_steps_and_limits_where_stretches_meet() -> None:
    """Every step once, as many as counted; a limit of steps is kept by both methods together."""
    loop = constrained("bricard")
    every = loop.simulate((0, 10), rtol=1e-13, steps=True, **TAYLOR)
    assert (np.diff(every.t) > 0).all() and len(every.t) == every.n_steps + 1 and every.t[-1] == 10
    for most in (every.n_steps // 2, 40, 37):
        with pytest.warns(SimulationWarning):
            short = loop.simulate((0, 10), rtol=1e-13, steps=True, max_steps=most, **TAYLOR)
        assert short.n_steps == most == len(short.t) - 1
        np.testing.assert_array_equal(short.t[:30], every.t[:30])


def test_a_run_without_another_method_names_it() -> None:
    loop = constrained("bricard")
    request = Request((0.0, 10.0), None, np.zeros(10), loop.parameters(None), Inputs(np.zeros(0)), 1e-13, np.full(10, 1e-13), 0.0,
                      0.0, None, 10, Stabilization("projection"))
    alone = run_compiled(loop, request, "taylor")
    assert not alone.success and alone.no_series == "the dependent speeds do not follow from P6_z and P6_y here"
    assert f"the right-hand side has no Taylor series: {alone.no_series}; use method='dop853'" in alone.message
