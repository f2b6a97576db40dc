"""Level 1, by hand from coordinates and constraints: identities, then the lecture's results (chapters 3.3 to 3.5)."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
import sympy as sp

import symdyn as sd
from symdyn.errors import ModelError, ModelWarning, SymdynError
from symdyn.runtime.building.compiler import find_compiler
from tests.helpers import close, largest, quantities, state

t = sd.t
x, y, z, theta, phi = sd.coordinates("x y z theta phi")
x_v, y_v, x_t, y_t = sd.coordinates("x_v y_v x_t y_t")
m, m_v, m_t, I_t, g, l, a, w, R, J, alpha, A, x_0, y_0 = sd.parameters("m m_v m_t I_t g l a w R J alpha A x_0 y_0")
F_x = sd.inputs("F_x")


def pendulum(**more: Any) -> Any:
    return sd.augmented([x, y], [m, m], [0, -m * g], [x**2 + y**2 - l**2], name="pendulum", names=["rod"], **more)


def fixed_track(**more: Any) -> Any:
    return sd.augmented([x, y], [m, m], [0, -m * g], [y + x * sp.tan(alpha) + A], name="fixed_track", **more)


def rotating_track(**more: Any) -> Any:
    rows = [x_t - x_0, y_t - y_0, y_0 - y_v - (x_0 - x_v) * sp.tan(theta)]
    return sd.augmented([x_v, y_v, x_t, y_t, theta], [m_v, m_v, m_t, m_t, I_t], [0, -m_v * g, 0, -m_t * g, 0], rows,
                        name="rotating_track", **more)


def moving_slope(**more: Any) -> Any:
    return sd.augmented([x, y], sp.diag(m, m), sp.Matrix([0, -m * g]), y + x * sp.tan(w * t), name="moving_slope", **more)


def sleigh(**more: Any) -> Any:
    """(x, y) is the centre of mass, a ahead of the edge."""
    row = y.dot * sp.cos(theta) - x.dot * sp.sin(theta) - a * theta.dot
    return sd.augmented([x, y, theta], [m, m, J], None, [row], name="sleigh", **more)


def rolling_disc(**more: Any) -> Any:
    """An upright disc: heading theta, rolled angle phi."""
    rows = [x.dot - R * phi.dot * sp.cos(theta), y.dot - R * phi.dot * sp.sin(theta)]
    return sd.augmented([x, y, theta, phi], [m, m, I_t, J], [F_x, 0, 0, -a * phi.dot], rows, name="rolling_disc", **more)


def massless_slider(**more: Any) -> Any:
    """A pendulum and a coordinate without mass that a constraint with a given motion ties to it."""
    rows = [x**2 + y**2 - l**2, z - x * y - sp.sin(w * t)]
    return sd.augmented([x, y, z], [m, m, 0], [0, -m * g, F_x], rows, name="massless_slider", **more)


EXAMPLES = [pendulum, fixed_track, rotating_track, moving_slope, sleigh, rolling_disc, massless_slider]
each = pytest.mark.parametrize("make", EXAMPLES, ids=lambda make: make.__name__)
compiled = pytest.mark.skipif(find_compiler() is None, reason="no C compiler here")


def along_a_motion(eq: Any, expression: sp.Expr) -> sp.Expr:
    """The expression with functions of time for coordinates and their derivatives, differentiated where dots stand."""
    functions = {q: sp.Function(q.name)(t) for q in eq.symbols.coordinates}
    by = {q.ddot: f.diff(t, 2) for q, f in functions.items()} | {q.dot: f.diff(t) for q, f in functions.items()} | functions
    return expression.xreplace(by)


# -- identities


@each
def test_rows_are_the_derivatives_of_the_constraints(make):
    """C_dot = C_r r_dot + C_t and C_ddot = C_r r_ddot - F_d, against SymPy's derivatives along a motion."""
    eq = make()
    speeds, accelerations = sp.Matrix(eq.symbols.speeds), eq.accelerations
    given = {"pendulum": [x**2 + y**2 - l**2], "moving_slope": [y + x * sp.tan(w * t)],
             "sleigh": [y.dot * sp.cos(theta) - x.dot * sp.sin(theta) - a * theta.dot]}
    for k, holonomic in enumerate(eq.holonomic):
        rate = (eq.C_r[k, :] * speeds)[0] + eq.C_t[k]
        if holonomic:
            expected = along_a_motion(eq, eq.C[k]).diff(t)
            assert sp.simplify(along_a_motion(eq, rate) - expected) == 0
        if eq.name in given:
            row = given[eq.name][k]
            assert sp.simplify((row - eq.C[k]) if holonomic else (row - rate)) == 0
        second = along_a_motion(eq, rate).diff(t)
        assert sp.simplify(along_a_motion(eq, (eq.C_r[k, :] * accelerations)[0] - eq.F_d[k]) - second) == 0


@each
def test_accelerations_and_multipliers_solve_the_equations(make):
    """M r_ddot + C_r^T lam = F, C_r r_ddot = F_d, and the constraint force is what is missing."""
    eq = make()
    for seed in range(3):
        names = ("M_tilde", "F_tilde", "C_r", "F_d", "accelerations", "lam", "constraint_force", "matrix", "right_side")
        M, F, C_r, F_d, rdd, lam, force, matrix, right = quantities(eq, state(eq, seed), *names)
        tolerance = 1e-18 if make is massless_slider else 1e-24
        assert close(M @ rdd + C_r.T @ lam, F, tolerance)
        assert close(C_r @ rdd, F_d, tolerance)
        assert close(force, M @ rdd - F, tolerance)
        assert close(matrix @ np.concatenate([rdd, lam]), right, tolerance)


@each
def test_constraint_forces_do_no_virtual_work(make):
    """For any displacement that the constraints allow at an instant, C_r dr = 0."""
    eq = make()
    C_r, force = quantities(eq, state(eq, 4), "C_r", "constraint_force")
    allowed = np.linalg.svd(C_r.astype(float))[2][len(C_r):]
    assert len(allowed)
    assert np.abs(allowed @ force.astype(float)).max() <= 1e-14 * float(largest(force))


def test_pendulum_moves_as_by_its_angle():
    """x = l sin q, y = -l cos q with l q_ddot = -g sin q."""
    q, rate = sp.symbols("q rate")
    at = {x: l * sp.sin(q), y: -l * sp.cos(q), x.dot: l * sp.cos(q) * rate, y.dot: l * sp.sin(q) * rate}
    eq = pendulum()
    q_ddot = -g * sp.sin(q) / l
    expected = sp.Matrix([l * sp.cos(q) * q_ddot - l * sp.sin(q) * rate**2, l * sp.sin(q) * q_ddot + l * sp.cos(q) * rate**2])
    assert sp.simplify(eq.explicit("accelerations").subs(at) - expected) == sp.zeros(2, 1)
    rod = sp.simplify((eq.explicit("constraint_force").subs(at).T * sp.Matrix([-sp.sin(q), sp.cos(q)]))[0])
    assert sp.simplify(rod - m * (g * sp.cos(q) + l * rate**2)) == 0


def test_energy_of_the_pendulum():
    """Its rate at a state on the constraint: d(T + m g y)/dt = r_dot . (-C_r^T lam) = 0."""
    values = state(pendulum(), 1, x=0.6, y=-0.8, l=1, x_dot=0.4, y_dot=0.3)
    force, rate = quantities(pendulum(), values, "constraint_force", "C_dot")
    assert largest(rate) <= 1e-16
    assert abs(0.4 * force[0] + 0.3 * force[1]) <= 1e-15 * largest(force)


def test_equals_the_mechanisms_of_the_catalogue():
    for name, eq in (("pendulum_absolute", pendulum()), ("vehicle_on_rotating_track_absolute", rotating_track())):
        system = sd.systems.get(name)
        tree = system.augmented()
        values = state(tree, 2)
        own = {**values, "x_0": values.get("x_const", 0), "y_0": values.get("y_const", 0)}
        for quantity in ("M_tilde", "C", "C_r", "C_t", "F_d", "accelerations", "lam"):
            assert close(*[quantities(e, v, quantity)[0] for e, v in ((tree, values), (eq, own))]), quantity


# -- the lecture


def test_fixed_track_is_the_lectures():
    eq = fixed_track()
    tan = sp.tan(alpha)
    assert list(eq.C) == [y + x * tan + A] and eq.C_r == sp.Matrix([[tan, 1]])
    assert eq.C_t == eq.F_d == sp.Matrix([0]) and eq.k_tilde == sp.zeros(2, 1)
    assert eq.matrix == sp.Matrix([[m, 0, tan], [0, m, 1], [tan, 1, 0]])
    assert eq.rhs == sp.Matrix([0, -m * g, 0])
    assert eq.lam == sp.Matrix([-m * g * sp.cos(alpha) ** 2])
    (lambda_1,) = eq.multipliers
    assert eq.constraint_forces == sp.Matrix([-lambda_1 * tan, -lambda_1])
    assert [e.lhs - e.rhs for e in eq.equations] == [lambda_1 * tan + m * x.ddot, lambda_1 + m * y.ddot + m * g,
                                                     tan * x.ddot + y.ddot]


def test_fixed_track_without_multipliers():
    """tan theta (m y_ddot + m g) - m x_ddot = 0, as it stands there; without y or without x it is the same equation."""
    (equation,) = fixed_track().without_multipliers([y])
    assert equation == sp.Eq(sp.tan(alpha) * (m * y.ddot + m * g) - m * x.ddot, 0, evaluate=False)
    (other,) = fixed_track().without_multipliers(dependent=["x"])
    assert sp.expand(other.lhs + equation.lhs) == 0


def test_pendulum_is_the_lectures():
    """The slides have F_d = 0; C_ddot = 0 demands -2 (x_dot^2 + y_dot^2)."""
    eq = pendulum()
    assert eq.matrix == sp.Matrix([[m, 0, 2 * x], [0, m, 2 * y], [2 * x, 2 * y, 0]])
    assert eq.rhs[:2, :] == sp.Matrix([0, -m * g])
    assert sp.expand(eq.F_d[0]) == -2 * x.dot**2 - 2 * y.dot**2
    (equation,) = eq.without_multipliers([y])
    assert equation.lhs == x * (m * y.ddot + m * g) - m * y * x.ddot


def test_rotating_track_is_the_lectures():
    """The slides have -tan theta as the derivative of the last constraint by x_v; it is tan theta."""
    eq = rotating_track()
    tan, sec2 = sp.tan(theta), sp.cos(theta) ** -2
    assert eq.M_tilde == sp.diag(m_v, m_v, m_t, m_t, I_t)
    wanted = sp.Matrix([[0, 0, 1, 0, 0], [0, 0, 0, 1, 0], [tan, -1, 0, 0, -(x_0 - x_v) * sec2]])
    assert (eq.C_r - wanted).applyfunc(sp.simplify) == sp.zeros(3, 5)
    last = -sec2 * theta.dot * x_v.dot - (sec2 * x_v.dot - (x_0 - x_v) * 2 * sec2 * tan * theta.dot) * theta.dot
    assert eq.F_d[:2, :] == sp.zeros(2, 1)
    assert sp.simplify(eq.F_d[2] - last) == 0
    along_track, turning = eq.without_multipliers([y_v, x_t, y_t])
    assert along_track.lhs == tan * (m_v * y_v.ddot + m_v * g) + m_v * x_v.ddot
    assert turning.lhs.has(theta.ddot)


def test_without_multipliers_holds_for_the_motion():
    """The equations that remain are fulfilled by the accelerations of the full ones."""
    for eq, dependent in ((rotating_track(), [y_v, x_t, y_t]), (sleigh(), [theta.dot]), (rolling_disc(), ["x", "y"])):
        values = state(eq, 5)
        (rdd,) = quantities(eq, values, "accelerations")
        at = {s: float(values[s.name]) for group in (eq.symbols.coordinates, eq.symbols.speeds, eq.symbols.inputs,
                                                     eq.symbols.parameters) for s in group}
        at |= {u.dot: float(v) for u, v in zip(eq.symbols.speeds, rdd, strict=True)}
        remaining = eq.without_multipliers(dependent)
        assert len(remaining) == len(eq.symbols.speeds) - len(eq.constraints)
        assert all(abs(e.lhs.subs(at)) <= 1e-12 for e in remaining)


def test_without_multipliers_reads_well():
    """No minus before all terms, no common factors."""
    knife = sd.augmented([x, y], [m, m], [0, -m * g], [y.dot - x * x.dot])
    assert knife.without_multipliers([y])[0].lhs == x * (m * y.ddot + m * g) + m * x.ddot
    free = sd.augmented([x, y], [m, m], [0, -m * g], [])
    assert [e.lhs for e in free.without_multipliers([])] == [m * x.ddot, m * y.ddot + m * g]
    scaled = sd.augmented([x, y], [m, m], [0, -m * g], [3 * l * (x**2 + y**2 - l**2)])
    assert scaled.without_multipliers([y]) == pendulum().without_multipliers([y])


def test_without_multipliers_needs_a_regular_choice():
    with pytest.raises(sd.SymdynError, match="pass 1 different ones"):
        pendulum().without_multipliers([x, y])
    with pytest.raises(sd.SymdynError, match="do not determine"):
        sd.augmented([x, y], [m, m], None, [x]).without_multipliers([y])


def test_given_slope_does_work_but_no_virtual_work():
    """dr . F_c = 0 for a virtual displacement, at an instant; along the actual one it is lam C_t dt."""
    eq = moving_slope()
    force, lam = eq.explicit("constraint_force"), eq.lam
    virtual = sp.Matrix([1, -sp.tan(w * t)])
    assert sp.simplify((virtual.T * force)[0]) == 0
    actual = sp.Matrix([x.dot, y.dot]).subs(y.dot, -x.dot * sp.tan(w * t) - eq.C_t[0])
    power = sp.simplify((actual.T * force)[0] - lam[0] * eq.C_t[0])
    assert power == 0
    assert sp.simplify(lam[0] * eq.C_t[0]) != 0
    assert sp.simplify(lam[0].subs(w, 0)) == -m * g


@compiled
def test_work_of_the_given_slope_is_the_change_of_energy():
    numbers = {m: 2.0, g: 9.81, w: 0.4}
    module = moving_slope(defaults=numbers, initial={x: 1, y: 0, "x_dot": 0.3, y.dot: -0.4}).compile()
    sol = module.simulate(np.linspace(0, 2, 2001), rtol=1e-12, atol=1e-13)
    state_rows = np.hstack([sol.q, sol.u])
    power = (module.evaluate("lam", sol.t, state_rows) * module.evaluate("C_t", sol.t, state_rows))[:, 0]
    energy = module.evaluate("kinetic_energy", sol.t, state_rows) + 2.0 * 9.81 * sol.q[:, 1]
    steps = np.diff(sol.t)[::2]
    work = np.concatenate([[0], np.cumsum(steps / 3 * (power[:-2:2] + 4 * power[1:-1:2] + power[2::2]))])
    assert np.abs(work).max() > 1
    np.testing.assert_allclose(energy[::2] - energy[0], work, atol=1e-10)
    assert np.abs(module.evaluate("C", sol.t, state_rows)).max() <= 1e-12


# -- motions


@compiled
def test_pendulum_swings_as_by_its_angle():
    numbers = {m: 1.5, g: 9.81, l: 0.8}
    q = sd.coordinates("q")
    by_angle = sd.embedding([q], [l * sp.sin(q), -l * sp.cos(q)], [m, m], [0, -m * g], defaults=numbers).compile()
    eq = pendulum(defaults=numbers, initial={x: 0.8 * math.sin(1.2), y: -0.8 * math.cos(1.2)})
    times = np.linspace(0, 20, 201)
    angle = by_angle.simulate(times, q=[1.2], rtol=1e-12, atol=1e-13).q[:, 0]
    for backend in ("c", "numpy"):
        sol = eq.compile(backend=backend).simulate(times[:11] if backend == "numpy" else times, rtol=1e-11, atol=1e-12)
        expected = 0.8 * np.array([np.sin(angle), -np.cos(angle)]).T[:len(sol.t)]
        np.testing.assert_allclose(sol.q, expected, atol=1e-8)


@compiled
def test_sleigh_comes_to_run_straight():
    """v tends to V tanh(gamma (t - t_0)), and the kinetic energy stays (Neimark and Fufaev, Dynamics of Nonholonomic Systems)."""
    mass, inertia, arm, v, rate = 1.3, 0.4, 0.5, 0.2, 1.1
    module = sleigh(defaults={m: mass, J: inertia, a: arm}, initial={x.dot: v, y.dot: arm * rate, theta.dot: rate}).compile()
    sol = module.simulate((0, 8), rtol=1e-12, atol=1e-13)
    whole = inertia + mass * arm**2
    final = math.sqrt(v**2 + whole * rate**2 / mass)
    gamma = mass * arm * final / whole
    t_0 = -math.atanh(v / final) / gamma
    heading = sol.q[:, 2]
    speed = sol.u[:, 0] * np.cos(heading) + sol.u[:, 1] * np.sin(heading)
    np.testing.assert_allclose(speed, final * np.tanh(gamma * (sol.t - t_0)), atol=1e-9)
    energy = module.evaluate("kinetic_energy", sol.t, np.hstack([sol.q, sol.u]))
    np.testing.assert_allclose(energy, energy[0], rtol=1e-10)


@compiled
def test_disc_rolls_in_a_circle():
    module = rolling_disc(defaults={m: 1.0, I_t: 0.2, J: 0.3, R: 0.25, a: 0.0}).compile()
    turn, roll = 0.8, 2.0
    sol = module.simulate((0, 10), u={x.dot: 0.25 * roll, theta.dot: turn, phi.dot: roll}, rtol=1e-12, atol=1e-13)
    radius = 0.25 * roll / turn
    expected = np.array([radius * np.sin(turn * sol.t), radius * (1 - np.cos(turn * sol.t)), turn * sol.t, roll * sol.t]).T
    np.testing.assert_allclose(sol.q, expected, atol=1e-9)


@compiled
def test_coordinate_without_mass_follows_its_constraint():
    eq = massless_slider(defaults={m: 1.0, g: 9.81, l: 1.0, w: 2.0}, initial={x: 0.6, y: -0.8, z: -0.48, z.dot: 2.0})
    assert any("elimination of the dependent speeds z_dot" in note for note in eq.notes)
    module = eq.compile()
    sol = module.simulate((0, 3), rtol=1e-10, atol=1e-11)
    np.testing.assert_allclose(sol.q[:, 2], sol.q[:, 0] * sol.q[:, 1] + np.sin(2 * sol.t), atol=1e-9)
    lam = module.evaluate("lam", sol.t, np.hstack([sol.q, sol.u]))
    assert np.abs(lam[:, 1]).max() <= 1e-9  # nothing pulls at z


def test_prescribed_motion_is_allowed_and_reported():
    eq = sd.augmented([x, y], [m, m], [0, -m * g], [x - sp.sin(t), y - x**2])
    assert any(note.startswith("motion: ") for note in eq.notes)
    assert sp.simplify(eq.explicit("accelerations")[0] + sp.sin(t)) == 0


def test_dependent_constraints_are_reported_and_left_out():
    eq = sd.augmented([x, y], [m, m], [0, -m * g], [x**2 + y**2 - l**2, 3 * x**2 + 3 * y**2 - 3 * l**2], names=["one", "again"],
                      initial={x: 0.6, y: -0.8}, defaults={m: 2, g: 9.81, l: 1})
    assert any("they depend on the others" in note for note in eq.notes)
    module = eq.compile(backend="numpy")
    alone = pendulum(defaults={m: 2, g: 9.81, l: 1}).compile(backend="numpy")
    at = [0.6, -0.8, 0.4, 0.3]
    np.testing.assert_allclose(module.rhs(0, at), alone.rhs(0, at), rtol=1e-13)
    np.testing.assert_allclose(module.evaluate("constraint_force", 0, at), alone.evaluate("constraint_force", 0, at), rtol=1e-8)


def test_no_constraints_at_all():
    eq = sd.augmented([x, y], [m, m], [F_x, -m * g], [])
    assert eq.matrix == sp.diag(m, m) and eq.rhs == sp.Matrix([F_x, -m * g]) and eq.constraint_forces == sp.zeros(2, 1)
    np.testing.assert_allclose(eq.compile(backend="numpy").rhs(0, [1, 2, 3, 4], {m: 2, g: 10}, [6]), [3, 4, 3, -10])


def test_consistent_state_from_a_guess():
    module = rotating_track(defaults={m_v: 1, m_t: 2, I_t: 0.5, g: 9.81, x_0: 0.1, y_0: 0.2}).compile(backend="numpy")
    q, u = module.consistent([1.0, 0.5, 0, 0, 0.4], [0.3, 0, 0, 0.2, 0.1])
    assert np.abs(module.evaluate("C", 0, [*q, *u])).max() <= 1e-12
    assert np.abs(module.evaluate("C_dot", 0, [*q, *u])).max() <= 1e-12


@compiled
@pytest.mark.parametrize("make", EXAMPLES[::3], ids=lambda make: make.__name__)
def test_backends_agree(make):
    eq = make()
    c, numpy = eq.compile(backend="c"), eq.compile(backend="numpy")
    values = state(eq, 6)
    at, p, u = ([float(values[s.name]) for s in group] for group in (
        (*eq.symbols.coordinates, *eq.symbols.speeds), eq.symbols.parameters, eq.symbols.inputs))
    for name in ("rhs", "C_dot", "F_d", "constraint_force", "jacobian_x"):
        found = [module.evaluate(name, 0.3, at, p, u) for module in (c, numpy)]
        size = max(1.0, float(np.abs(found[0]).max(initial=0.0)))
        np.testing.assert_allclose(*found, rtol=0, atol=(1e-8 if make is massless_slider else 1e-13) * size, err_msg=name)


def test_plain_symbols_and_dynamicsymbols_stand_for_coordinates():
    from sympy.physics.mechanics import dynamicsymbols

    u, v = sp.symbols("u v")
    assert sd.augmented([u, v], [m, m], None, [u**2 - v], initial={u: 1, "v": 1}).C_r.shape == (1, 2)
    f = dynamicsymbols("f")
    eq = sd.augmented([f, x], [m, m], None, [f.diff(t) - x], initial={f.diff(t): 2})
    assert eq.holonomic == (False,) and eq.C_t == sp.Matrix([-x])
    assert {s.name: v for s, v in eq.symbols.initial.items()} == {"f_dot": 2.0}


def test_typeset_as_one_matrix():
    text = pendulum()._repr_latex_()
    for part in (r"m & 0 & 2 x", r"\ddot{x}", r"\lambda_{1}", r"\dot{y}^{2}", "- g m"):
        assert part in text


# -- faults


@pytest.mark.parametrize(("arguments", "parts"), [
    (([x, y], [m], None, [x]), ["mass has the shape 1 x 1, there are 2 entries"]),
    (([x, y], [m, m], [0], [x]), ["force has 1 entries, there are 2 coordinates"]),
    (([x, x], [m, m], None, [x]), ["coordinate x is given 2 times"]),
    (([], [], None, []), ["there are no coordinates"]),
    (([x, 3], [m, m], None, [x]), ["coordinate 3 is no symbol"]),
    (([x], [m], None, [x + y]), ["constraint_1 uses y, which is not among the coordinates x"]),
    (([x], [m], [y], [x]), ["force uses y"]),
    (([x], [m], None, [x + y.dot]), ["constraint_1 uses y_dot"]),
    (([x, y], [m, m], None, [x.ddot - y]), ["constraint_1 uses x_ddot; it may use coordinates, speeds and t"]),
    (([x, y], [m, m], [x.ddot, 0], [x]), ["force uses x_ddot"]),
    (([x, y], [m, m], None, [x.dot * y.dot]), ["constraint_1, x_dot*y_dot = 0, is not linear in the speed x_dot"]),
    (([x, y], [m, m], None, [x, x.dot**2 - 1]), ["constraint_2", "not linear in the speed x_dot"]),
    (([x, y], [m, m], None, [x, l - a]), ["constraint_2, -a + l = 0, has no coordinate or speed in it"]),
    (([x, y], [m, m], None, [x - F_x]), ["constraint_1 uses F_x; a constraint may use coordinates, motions, t and parameters"]),
    (([x, y], [m * x, m], None, [x]), ["mass depends on x, but must be constant"]),
    (([x, y], [m, F_x], None, [x]), ["mass uses the input F_x; it may use parameters only"]),
    (([x, y], [-1, m], None, [x]), ["mass[1, 1] is -1"]),
    (([x, y], sp.Matrix([[1, 2], [2, 1]]), None, [x]), ["mass has the eigenvalue -1"]),
    (([x, y], [m, m], None, ["x"]), ["text is never evaluated"]),
    (([x, y], [m, m], None, {"a": x}), ["constraints is {'a': x}; pass a list or column"]),
    (([x, y], [m, m], None, [x - sp.Symbol("t", real=True)]), ["not the time"]),
    (([x, y], [m, m], None, [x - sp.Symbol("y", positive=True)]), ["y is the name of a coordinate"]),
])
def test_faults(arguments, parts):
    with pytest.raises(sd.ModelError) as caught:
        sd.augmented(*arguments)
    for part in parts:
        assert part in str(caught.value)


@pytest.mark.parametrize(("options", "part"), [
    ({"names": ["one"]}, "names has 1 entries, there are 2 constraints"),
    ({"names": ["one", "one"]}, "2 constraints are named 'one'"),
    ({"names": ["one", "two\n"]}, "pass text on one line"),
    ({"defaults": {"k": 1}}, "defaults has a number for 'k', which is no parameter"),
    ({"defaults": {m: "1"}}, "defaults: the value of m is '1'"),
    ({"initial": {z: 1}}, "initial has a number for 'z', which is no coordinate or speed"),
    ({"initial": {x: math.nan}}, "initial: the value of x is nan"),
    ({"name": "my pendulum"}, "pass an identifier"),
])
def test_faults_of_names_and_numbers(options, part):
    with pytest.raises(sd.ModelError) as caught:
        sd.augmented([x, y], [m, m], None, [x, y - 1], **options)
    assert part in str(caught.value)


@pytest.mark.parametrize(("rows", "parts"), [
    ([x, x - 1], ["constraint_2 contradicts constraint_1", "-1 = 0 of the positions"]),
    ([x - l, 2 * x - 2 * l + 3], ["constraint_2 contradicts constraint_1"]),
    ([x + y - 1, x - y, 3 * x - y], ["constraint_3 contradicts constraint_1, constraint_2"]),
    ([x**2 + y**2 - 1, 2 * x**2 + 2 * y**2 - 3], ["constraint_2 contradicts constraint_1"]),
    ([x - sp.sin(t), x - sp.cos(t)], ["constraint_2 contradicts constraint_1"]),
    ([x.dot, x.dot - 1], ["constraint_2 contradicts constraint_1", "of the speeds"]),
    ([x.dot - 1, x], ["constraint_1 contradicts constraint_2", "of the speeds"]),
    ([sp.sin(x) ** 2 + sp.cos(x) ** 2 - 1], ["constraint_1 holds nothing"]),
    ([x, y - y + (x + 1) ** 2 - x**2 - 2 * x], ["constraint_2 holds nothing"]),
])
def test_contradictions(rows, parts):
    with pytest.raises(sd.ModelError) as caught:
        sd.augmented([x, y], [m, m], None, rows)
    for part in parts:
        assert part in str(caught.value)


def test_contradiction_by_the_numbers_in_defaults():
    with pytest.warns(ModelWarning, match="unless parameters make"):  # l = a may come
        assert sd.augmented([x, y], [m, m], None, [x - l, x - a]).constraints
    with pytest.raises(sd.ModelError, match="with the numbers in defaults"):
        sd.augmented([x, y], [m, m], None, [x - l, x - a], defaults={m: 1, l: 1, a: 2})
    eq = sd.augmented([x, y], [m, m], None, [x - l, x - a], defaults={m: 1, l: 1, a: 1})
    assert any("they depend on the others" in note for note in eq.notes)


def test_constraints_that_agree_contradict_nothing():
    """A velocity constraint that is the rate of a holonomic one; two that together imply a third which is there, too."""
    sd.augmented([x, y, z], [m, m, m], None, [x - y**2, x.dot - 2 * y * y.dot])
    sd.augmented([x, y, z], [m, m, m], None, [x.dot - y, x.dot - z, y - z])


def test_no_consistent_state_near_is_warned_of():
    with pytest.warns(sd.ModelWarning, match="no state was found that fulfils the constraints"):
        sd.augmented([x, y], [m, m], None, [x**2 + y**2 - l**2, x - a], defaults={m: 1, l: 1, a: 2})
    with pytest.warns(sd.ModelWarning, match="the constraints leave no motion: their rank is 2"):
        sd.augmented([x, y], [m, m], None, [x**2 + y**2 - l**2, x - a], defaults={m: 1, l: 2, a: 1})


def test_coordinate_that_nothing_holds():
    with pytest.raises(sd.ModelError, match="z_dot: neither mass nor a constraint holds this speed"):
        sd.augmented([x, y, z], [m, m, 0], None, [x - y])
    with pytest.raises(sd.ModelError, match="y_dot, z_dot: neither mass nor a constraint holds a motion of these speeds"):
        sd.augmented([x, y, z], [m, 0, 0], None, [y - z])


def test_all_faults_at_once():
    with pytest.raises(sd.ModelError) as caught:
        sd.augmented([x, 3], [m], [0, 0, 0], [x.dot**2, "y", F_x, l], names=["one"], defaults={"k": 1}, initial={z: 1})
    assert len(caught.value.faults) >= 9


@pytest.mark.parametrize("dependent", [y, "y", ["y"], (y,), sp.Matrix([y])])
def test_one_dependent_speed_stands_for_itself(dependent: Any) -> None:
    assert fixed_track().without_multipliers(dependent) == fixed_track().without_multipliers([y])


@pytest.mark.parametrize("dependent", [None, (), "q2", 3, [x, y], [y, y], [None]])
def test_dependent_speeds_that_do_not_fit(dependent: Any) -> None:
    with pytest.raises(SymdynError, match=r"fixed_track: dependent is .*; pass 1 different ones of x_dot, y_dot, x, y"):
        fixed_track().without_multipliers(dependent)


@pytest.mark.parametrize("wrong", ["x - 1", sp.nan, sp.Eq(x, y), None, [x], sp.oo])
def test_a_constraint_that_is_none_has_one_fault(wrong: Any) -> None:
    for rows in ([wrong], [x - y, wrong], np.array([wrong, x - y], dtype=object) if not isinstance(wrong, list) else [wrong]):
        with pytest.raises(ModelError) as caught:
            sd.augmented([x, y], [m, m], None, rows)
        assert len(caught.value.faults) == 1, caught.value.faults


l_p, a_p, b_p = sd.parameters("l_p a_p b_p", positive=True)


@pytest.mark.parametrize("rows", [[x - l_p, x - 2 * l_p], [x - l_p, y - 2 * l_p, x + y - 4 * l_p]])
def test_contradictions_for_all_positive_numbers(rows: list[Any]) -> None:
    with pytest.raises(ModelError, match=r"contradicts constraint_1.*differs for all positive numbers of l_p; remove") as caught:
        sd.augmented([x, y], [m, m], None, rows)
    assert len(caught.value.faults) == 1


@pytest.mark.parametrize(("rows", "given"), [
    ([x - l, x - 2 * l], "l"), ([x - l, y - 2 * l, x + y - 4 * l], "l"), ([x - a, x - w], "a, w|w, a"),
    ([x - a_p, x - b_p], "a_p, b_p"), ([x - a_p**2 - b_p**2, x - 2 * a_p * b_p], "a_p, b_p")])
def test_contradictions_unless_parameters_forbid(rows: list[Any], given: str) -> None:
    with pytest.warns(ModelWarning, match=rf"contradict each other unless parameters make .* = 0; it depends on ({given}):"):
        sd.augmented([x, y], [m, m], None, rows)


def test_no_state_without_numbers_that_do_not_matter() -> None:
    with pytest.warns(ModelWarning, match="no state was found that fulfils the constraints constraint_1"):
        sd.augmented([x, y], [m, m], [0, -m * g], [x**2 + y**2 + 1])


def test_a_constraint_that_holds_only_where_its_derivatives_vanish_is_derived_with_a_warning():
    q, a, w, b = sd.coordinates("q"), *sd.parameters("a w b")
    moving = a * sp.sin(w * sd.t) * q**2 + b * sd.t**2 * sp.cos(q)
    with pytest.warns(ModelWarning, match="all derivatives of constraint_1 vanish"):
        eq = sd.augmented([q], [1], [0], [moving], initial={q: 1})
    assert eq.C_r == sp.Matrix([[sp.diff(moving, q)]])


def test_a_row_whose_derivatives_vanish_wherever_it_is_fulfilled() -> None:
    with pytest.warns(ModelWarning, match="all derivatives of square vanish at every consistent state found"):
        sd.augmented([x, y, z], [m, m, m], None, [(x - 1)**2, y - x], names=["square", "line"])
    for rows in ([x**3 - 1], [x**2 + y**2 - l**2], [x**2 - 1e-4], [sp.sin(x)]):
        sd.augmented([x, y], [m, m], None, rows)
