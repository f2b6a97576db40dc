"""Loads that depend on reactions, multipliers and accelerations, against closed forms and the equations solved by hand."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
import scipy.optimize
import sympy as sp

import symdyn as sd
from symdyn.errors import EvaluationError, ModelError, SimulationWarning
from tests.helpers import swept

x, y, s, theta = sd.coordinates("x y s theta")
m, l, g, mu, omega, r = sd.parameters("m l g mu omega r")
FORMULATIONS = ("embedding", "recursive", "augmented")


def bead(gravity=(0, 0, 0)):
    """A bead on a rod that turns about a vertical axis, with friction mu |N| (or by the size of N, which has two components)."""
    system = sd.System("bead", gravity=gravity)
    rod, ball = system.add_body("rod"), system.add_body("ball", m)
    system.add_joint(sd.Revolute("axis", "ground", rod, omega * sd.t, axis=(0, 0, 1)))
    system.add_joint(sd.Prismatic("slide", rod, ball, s, axis=(1, 0, 0)))
    N = sd.reaction("slide", rod)
    size = sp.Abs(N[1]) if not any(gravity) else sp.sqrt(N[1]**2 + N[2]**2)
    system.add_joint_force("slide", -mu * size * sp.sign(s.dot))
    system.add_output("N", [N[1], N[2]])
    system.defaults = {m: 2, omega: 3, mu: 0.3}
    return system


@pytest.mark.every_value
@pytest.mark.parametrize("backend", ("numpy", "c"))
@pytest.mark.parametrize("formulation", FORMULATIONS)
def test_a_bead_with_friction_moves_as_the_sum_of_two_exponentials(formulation, backend):
    """r_ddot = omega^2 r - 2 mu omega r_dot: exponents omega (-mu +- sqrt(mu^2 + 1))."""
    module = getattr(bead(), formulation)().compile(backend)
    solution = module.simulate(np.linspace(0, 1, 11), [0.1], [0.2], rtol=1e-12, atol=1e-14)
    exponents = 3 * (-0.3 + np.array([1, -1]) * np.sqrt(0.3**2 + 1))
    factors = np.linalg.solve([[1, 1], exponents], [0.1, 0.2])
    exact = np.exp(np.outer(solution.t, exponents)) @ factors
    assert np.abs(solution.x[:, 0] / exact - 1).max() < 1e-11
    np.testing.assert_allclose(solution.outputs["N"][:, 0], 2 * 2 * 3 * solution.x[:, 1], rtol=1e-11)


def test_exact_derivatives_of_what_is_solved():
    module = bead().embedding().compile()
    np.testing.assert_allclose(module.jacobian(0, [0.5, 0.3]).x, [[0, 1], [9, -2 * 0.3 * 3]], rtol=1e-13)
    heavy = bead((0, 0, -9.81)).embedding().compile()
    state = np.array([0.5, 0.3])
    N_y, N_z, u = 2 * 2 * 3 * 0.3, 2 * 9.81, 0.3
    slope = -0.3 / 2 * N_y / np.hypot(N_y, N_z) * 2 * 2 * 3
    np.testing.assert_allclose(heavy.rhs(0, state), [u, 9 * 0.5 - 0.3 * np.hypot(N_y, N_z) / 2], rtol=1e-14)
    np.testing.assert_allclose(heavy.jacobian(0, state).x, [[0, 1], [9, slope]], rtol=1e-12)


def test_a_taylor_series_goes_through_what_is_solved():
    system = sd.System("bead", gravity=(0, 0, 0))
    rod_, ball = system.add_body("rod"), system.add_body("ball", m)
    system.add_joint(sd.Revolute("axis", "ground", rod_, omega * sd.t, axis=(0, 0, 1)))
    system.add_joint(sd.Prismatic("slide", rod_, ball, s, axis=(1, 0, 0)))
    system.add_joint_force("slide", -mu * sd.reaction("slide", rod_)[1])
    system.defaults = {m: 2, omega: 3, mu: 0.3}
    module = system.embedding().compile()
    one = module.simulate(np.linspace(0, 1, 5), [0.1], [0.2], method="taylor", rtol=1e-12)
    two = module.simulate(np.linspace(0, 1, 5), [0.1], [0.2], method="dop853", rtol=1e-12)
    np.testing.assert_allclose(one.x, two.x, rtol=1e-10)


def rod(sliding=1.0, backend="c"):
    """A uniform rod of half length l whose end slides along a line with friction."""
    system = sd.System("rod", gravity=(0, -g))
    guide, bar = system.add_body("guide"), system.add_body("bar", m, m * l**2 / 3, (l, 0))
    system.add_joint(sd.Prismatic("guide", "ground", guide, x, axis=(1, 0, 0)))
    system.add_joint(sd.Revolute("pin", guide, bar, theta))
    N = sd.reaction("guide")[1]
    system.add_joint_force("guide", -mu * sp.Abs(N) * sp.sign(x.dot))
    system.add_output("N", N)
    system.defaults = {m: 1.5, l: 0.8, mu: 0.5, g: 9.81}
    return system.embedding().compile(backend)


def balance_of_rod(N, angle, spin, friction):
    """Zero where N is the normal force of the rod: vertical acceleration of the end, mass 1.5, half length 0.8.

    friction   mu times the sign of the sliding
    """
    mass, half, weight = 1.5, 0.8, 9.81
    F = -friction * np.abs(N)
    # Moment about the centre of mass; the end is at -half (cos, sin) from it.
    alpha = (F * half * np.sin(angle) - N * half * np.cos(angle)) / (mass * half**2 / 3)
    return N / mass - weight - half * (alpha * np.cos(angle) - spin**2 * np.sin(angle))


@pytest.mark.every_value
@pytest.mark.parametrize("angle", (0.2, 0.5, 1.3))
@pytest.mark.parametrize("spin", (0.0, 6.0))
@pytest.mark.parametrize("friction", (0.5, -0.5, 1.3))
def test_the_normal_force_of_a_sliding_rod(angle, spin, friction):
    module = rod()
    found = float(module.outputs(0, [0, angle, np.sign(friction), spin], {"mu": abs(friction)})["N"])
    expected = scipy.optimize.brentq(balance_of_rod, -1e4, 1e4, (angle, spin, friction), xtol=1e-13)
    assert found == pytest.approx(expected, rel=1e-11)


def solutions_of_rod(angle, spin, friction):
    """Number of normal forces, by the sign changes of the balance, which is linear on either side of zero."""
    at_zero = balance_of_rod(0.0, angle, spin, friction)
    slopes = [balance_of_rod(1.0, angle, spin, friction) - at_zero, at_zero - balance_of_rod(-1.0, angle, spin, friction)]
    return int(-at_zero / slopes[0] > 0) + int(-at_zero / slopes[1] < 0)


def test_a_rod_jams_from_four_thirds_on():
    """No or two solutions exactly where 1 + 3 cos^2 theta < 3 mu |sin theta cos theta|, which takes mu > 4/3."""
    module, stream = rod(), np.random.default_rng(8)
    seen = set()
    for friction, angle, spin in product((1.2, 1.33, 1.34, 1.6, 3.0), np.linspace(0.05, 1.5, 30), (0.0, 8.0)):
        jams = 1 + 3 * np.cos(angle)**2 < 3 * friction * np.sin(angle) * np.cos(angle)
        state = [stream.uniform(-1, 1), angle, 1.0, spin]
        assert (solutions_of_rod(angle, spin, friction) != 1) == jams
        seen.add((solutions_of_rod(angle, spin, friction), friction > 4 / 3))
        if jams:
            with pytest.raises(EvaluationError, match=r"depend on reaction\(guide\)\[1\] have no solution or more than one"):
                module.outputs(0, state, {"mu": friction})
        else:
            module.outputs(0, state, {"mu": friction})
    assert seen == {(1, False), (1, True), (0, True), (2, True)}


@pytest.mark.parametrize("angle", (0.3, 0.8, np.arctan(2), 1.4))
def test_a_rod_at_the_very_border_jams(angle):
    """Where a determinant is zero but for rounding, numbers would be rounding alone."""
    friction = (1 + 3 * np.cos(angle)**2) / (3 * np.sin(angle) * np.cos(angle))
    with pytest.raises(EvaluationError, match=r"depend on reaction\(guide\)\[1\] have no solution or more than one"):
        rod(backend="numpy").outputs(0, [0, angle, 1.0, 0.0], {"mu": friction})


@pytest.mark.every_value
@pytest.mark.parametrize("backend", ("numpy", "c"))
@pytest.mark.parametrize("friction", (1.34, 1.5, 2.0))
def test_a_run_stops_where_the_rod_jams(friction, backend):
    def margin(angle):
        return 1 + 3 * np.cos(angle)**2 - 3 * friction * np.sin(angle) * np.cos(angle)

    critical = scipy.optimize.brentq(margin, 0.3, 0.5 * np.arctan2(friction, -1))  # up to where the margin is smallest
    with pytest.warns(SimulationWarning, match=r"no solution or more than one.* the mechanism jams"):
        solution = rod(backend=backend).simulate(np.linspace(0, 0.5, 6), [0, critical - 0.3], [20.0, 8.0], {"mu": friction},
                                                 rtol=1e-10, method="dop853" if backend == "c" else "DOP853")
    assert not solution.success
    assert solution.x[-1, 1] == pytest.approx(critical, abs=1e-6)


def two_guides():
    """A bar whose ends slide along two lines, each with friction by its own normal force, and a force along one of them."""
    system = sd.System("ladder", gravity=(0, -g))
    bar = system.add_body("bar", m, m * l**2 / 3)
    system.add_joint(sd.Planar("plane", "ground", bar, (x, y, theta)))
    foot, top = sd.position(bar, (l, 0)), sd.position(bar, (-l, 0))
    system.add_constraint(foot[1], "floor")
    system.add_constraint(top[0], "wall")
    N_floor, N_wall = -sd.multiplier("floor"), -sd.multiplier("wall")
    system.add_force(bar, [-mu * sp.Abs(N_floor) * sp.sign(foot[0].dot), 0], (l, 0))
    system.add_force(bar, [0, -mu * sp.Max(N_wall, 0) * sp.sign(top[1].dot)], (-l, 0))
    system.add_output("N", [N_floor, N_wall])
    system.add_event("leaves_the_wall", sd.multiplier("wall"))
    system.defaults = {m: 3, l: 2, mu: 0.2, g: 9.81}
    return system


def ladder_by_hand(angle, spin, friction):
    """Normal forces on the floor and the wall: M a = F with all four combinations of signs."""
    mass, half, weight = 3.0, 2.0, 9.81
    foot, top = half * np.array([np.cos(angle), np.sin(angle)]), -half * np.array([np.cos(angle), np.sin(angle)])
    slip_foot, slip_top = -2 * half * np.sin(angle) * spin, -2 * half * np.cos(angle) * spin
    found = []
    for sign, pushes in product((1, -1), (1, 0)):
        # unknowns: a_x, a_y, alpha, N_floor, N_wall
        F_foot, F_top = -friction * np.sign(slip_foot) * sign, -friction * np.sign(slip_top) * pushes
        A = np.zeros((5, 5))
        b = np.zeros(5)
        A[0, [0, 3, 4]], A[1, [1, 3, 4]], b[1] = [mass, -F_foot, -1], [mass, -1, -F_top], -mass * weight
        A[2, [2, 3, 4]] = [mass * half**2 / 3, -(foot[0] - foot[1] * F_foot), -(top[0] * F_top - top[1])]
        A[3, [1, 2]], b[3] = [1, foot[0]], foot[1] * spin**2
        A[4, [0, 2]], b[4] = [1, -top[1]], top[0] * spin**2
        solved = np.linalg.solve(A, b)
        if sign * solved[3] > 0 and (solved[4] > 0) == bool(pushes):
            found.append(solved[3:])
    return found


@pytest.mark.every_value
@pytest.mark.parametrize("backend", ("numpy", "c"))
@pytest.mark.parametrize("seed", swept(range(8), 0, 1, 2))
def test_two_frictions_at_once(seed, backend):
    stream = np.random.default_rng(seed)
    angle, spin, friction = stream.uniform(-1.4, -0.2), stream.uniform(-3, 3), stream.uniform(0.05, 0.4)
    half = 2.0
    state = [half * np.cos(angle), -half * np.sin(angle), angle, -half * np.sin(angle) * spin, -half * np.cos(angle) * spin, spin]
    [expected] = ladder_by_hand(angle, spin, friction)
    module = ladder(backend)
    np.testing.assert_allclose(module.outputs(0, state, {"mu": friction})["N"], expected, rtol=1e-10)


def ladder(backend):
    return two_guides().augmented().compile(backend)


def test_a_multiplier_in_an_event():
    """A ladder without friction leaves the wall at two thirds of the height that it starts from."""
    start = -1.2
    half = 2.0
    q = [half * np.cos(start), -half * np.sin(start), start]
    solution = ladder("c").simulate(np.linspace(0, 1.5, 16), q, [0, 0, 0], {"mu": 0}, rtol=1e-11)
    angle = solution.events["leaves_the_wall"].x[0, 2]
    assert np.sin(angle) == pytest.approx(2 / 3 * np.sin(start), rel=1e-8)


def test_acceleration_feedback_is_mass():
    """A force -k a on a body is k more mass."""
    system = sd.System("feedback", gravity=(0, 0, -10))
    ball = system.add_body("ball", m)
    system.add_joint(sd.Prismatic("up", "ground", ball, x, axis=(0, 0, 1)))
    system.add_force(ball, [0, 0, -r * sd.acceleration(ball)[2]])
    module = system.recursive().compile()
    assert module.rhs(0, [0, 0], {"m": 2, "r": 3})[1] == pytest.approx(-10 * 2 / 5, rel=1e-14)
    with pytest.raises(EvaluationError, match=r"depend on acceleration\(ball\)\[2\] have no solution"):
        module.rhs(0, [0, 0], {"m": 2, "r": -2})


def test_inverse_dynamics_takes_the_reactions_of_the_given_accelerations():
    module = bead((0, 0, -9.81)).embedding().compile()
    given = module.inverse_dynamics([0.5], [0.3], [4.0])
    N = np.hypot(2 * 2 * 3 * 0.3, 2 * 9.81)
    np.testing.assert_allclose(given, [2 * (4.0 - 9 * 0.5) + 0.3 * N], rtol=1e-13)
    accelerated = sd.System("feedback", gravity=(0, 0, 0))
    ball = accelerated.add_body("ball", 2)
    accelerated.add_joint(sd.Prismatic("up", "ground", ball, x, axis=(0, 0, 1)))
    accelerated.add_force(ball, [0, 0, -3 * sd.acceleration(ball)[2]])
    np.testing.assert_allclose(accelerated.embedding().compile().inverse_dynamics([0], [0], [1.0]), [5.0], rtol=1e-14)


def test_loads_are_those_of_the_motion_whatever_is_recorded_first():
    """Linear equations take accelerations as arguments; the loads in them are solved for the motion all the same."""
    first, second = bead((0, 0, -9.81)).embedding(), bead((0, 0, -9.81)).embedding()
    first.quantity("outputs_variation")
    assert first.tape("rhs").inputs and {leaf.args[1] for leaf in first.tape("rhs").inputs} == {
        leaf.args[1] for leaf in second.tape("rhs").inputs}
    state = [0.5, 0.3]
    np.testing.assert_array_equal(first.compile("numpy").rhs(0, state), second.compile("numpy").rhs(0, state))
    C = first.compile("numpy").linearize(state).C_out
    np.testing.assert_allclose(C[0], [0, 2 * 2 * 3], atol=1e-10)
    np.testing.assert_allclose(C[1], [0, 0], atol=1e-10)


def test_equations_pass_their_own_verification():
    assert bead().embedding().verify().passed
    assert two_guides().augmented().verify().passed


def test_a_state_follows_a_reaction():
    system = bead()
    z = sd.coordinates("z")
    system.add_state(z, sd.reaction("slide", "rod")[1])
    assert system.embedding().compile().rhs(0, [0.5, 0.3, 0])[2] == pytest.approx(2 * 2 * 3 * 0.3, rel=1e-14)


def test_holding_changes_reactions():
    system = bead()
    system.add_joint_force("slide", -r * (s - 1))
    module = system.embedding().compile()
    state = module.equilibrium(start={"s": 1.0}, params={"r": 100, "omega": 0})
    with pytest.raises(Exception, match=r"held, where joint_force_1, output N depend on reactions"):
        module.linearize(state, hold=["s"])


@pytest.mark.parametrize(("load", "words"), [
    (sp.sign(sd.reaction("slide")[1]), "which jumps where reaction(slide)[1] passes a value"),
    (sp.Piecewise((1, sd.reaction("slide")[1] > 0), (0, True)), "write it by Abs, Max and Min"),
    (sd.multiplier("floor"), "multiplier(floor) is requested of equations without multipliers; use system.augmented()"),
    (sum(sp.Abs(sd.reaction("slide")[1] + k) for k in range(5)), "the loads hold 5 absolute values"),
    (sum(sd.reaction("slide")) + sd.reaction("axis")[0], "the loads depend on 7 accelerations, multipliers and reactions"),
])
def test_faults(load, words):
    system = sd.System("bead", gravity=(0, 0, 0))
    rod_, ball = system.add_body("rod", 1, (1, 1, 1)), system.add_body("ball", m)
    system.add_joint(sd.Revolute("axis", "ground", rod_, theta, axis=(0, 0, 1)))
    system.add_joint(sd.Prismatic("slide", rod_, ball, s, axis=(1, 0, 0)))
    system.add_joint_force("slide", load)
    with pytest.raises(ModelError) as error:
        system.embedding()
        system.embedding().quantity("rhs")
    assert words in str(error.value)


def test_an_unknown_constraint_is_named():
    system = two_guides()
    system.add_output("push", sd.multiplier("ceiling"))
    with pytest.raises(ModelError, match=r"multiplier\(ceiling\) is requested; constraints are floor, wall"):
        system.augmented().quantity("push")
