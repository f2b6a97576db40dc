"""Energies, momenta and Hamilton's equations agree with the equations of motion that were derived without them."""

import random

import numpy as np
import pytest
import sympy as sp

import symdyn as sd
from symdyn.analytic.lagrange import Mechanics
from symdyn.analytic.minors import determinant, solve
from symdyn.errors import SymdynError
from symdyn.exact.prove import decide
from symdyn.spatial.vectors import inner, vector
from tests.helpers import swept

PLAIN = ["pendulum", "double_pendulum", "cart_pole", "vehicle_on_track", "vehicle_on_rotating_track", "prismatic_chain",
         "two_link_arm", "three_link_arm", "flyball_governor", "floating_crane"]
DRIVEN = ["vehicle_on_rotating_track", "particle_on_moving_slope", "car_axis"]
FORMULATIONS = "embedding", "recursive", "augmented"
CONSTRAINED = ["four_bar", "slider_crank", "rolling_disc", "skate", "car_axis", "particle_on_moving_slope"]


def derived(name, formulation=None):
    system = sd.systems.get(name)
    constrained = name in sd.systems.names(constrained=True)
    return getattr(system, formulation or ("augmented" if constrained else "embedding"))()


def proved(m, left, right):
    """Whether both vectors are equal."""
    return decide(m.recorder, list(zip(left, right, strict=True)), m.equations.printed_leaves())


@pytest.mark.parametrize("name", [*PLAIN, *CONSTRAINED, "puma560"])
def test_lagrange_of_L_gives_the_equations_with_the_loads_without_potential(name):
    m = Mechanics(derived(name))
    L = m.equations.quantity("lagrangian").item()
    momenta = [m.by([L], u)[0] for u in m.u]
    left = [rate - m.by([L], q)[0] for rate, q in zip(m.rate(momenta), m.q, strict=True)]
    slopes = vector(*[m.by([m.V], q)[0] for q in m.q])
    others = m.equations.quantity("F_tilde") + slopes
    inertial = m.equations.quantity("M_tilde") @ vector(*m.ud) + m.equations.quantity("k_tilde")
    assert proved(m, left, inertial - m.equations.quantity("F_tilde") + others)
    rate = sum(m.rate([m.T + m.V]))
    if name not in DRIVEN:
        assert proved(m, [rate], [inner(vector(*m.u), inertial - m.equations.quantity("F_tilde") + others)])


@pytest.mark.parametrize(("name", "formulation"), [
    *[(name, formulation) for name in ("double_pendulum", "cart_pole") for formulation in FORMULATIONS],
    *swept([("three_link_arm", formulation) for formulation in FORMULATIONS]),
    ("slider_crank", "augmented"), ("rolling_disc", "augmented")])
def test_T_is_half_of_u_M_u_and_H_is_the_energy(name, formulation):
    eq = derived(name, formulation)
    u = sp.Matrix(eq.symbols.speeds)
    assert sd.prove(eq.T, (u.T * eq.M_tilde * u)[0] / 2)
    assert sd.prove(eq.momenta, eq.M_tilde * u)
    assert sd.prove(eq.lagrangian, eq.T - eq.V)
    assert sd.prove(eq.hamiltonian.subs(dict(zip(eq.momentum_symbols, eq.momenta, strict=True))), eq.T + eq.V)
    c, n = eq.christoffel, len(u)
    assert sd.prove(eq.k_tilde, sp.Matrix([sum(c[i, j, k] * u[j] * u[k] for j in range(n) for k in range(n)) for i in range(n)]))


@pytest.mark.parametrize("name", ["double_pendulum", "cart_pole", "vehicle_on_rotating_track"])
def test_hamilton_s_equations_are_the_slopes_of_H(name):
    eq = derived(name)
    H, q, p = eq.hamiltonian, eq.symbols.coordinates, eq.momentum_symbols
    rates = sp.Matrix([e.rhs for e in eq.hamilton_equations])
    n = len(q)
    speeds = dict(zip(eq.symbols.speeds, rates[:n], strict=True))
    others = (eq.F_tilde + sp.Matrix([eq.V.diff(a) for a in q])).subs(speeds)
    assert sd.prove(rates, sp.Matrix([*[H.diff(a) for a in p], *[b - H.diff(a) for a, b in zip(q, others, strict=True)]]))
    assert [e.lhs for e in eq.hamilton_equations[:n]] == [a.dot for a in q]
    assert [str(e.lhs) for e in eq.hamilton_equations[n:]] == [f"p_{a}_dot" for a in q]


def test_constrained_hamilton_equations_hold_the_multipliers_and_the_constraints():
    eq = derived("skate")
    rows = eq.hamilton_equations
    forces = [e.rhs for e in rows if str(e.lhs).startswith("p_")]
    assert sd.prove(sp.Matrix(forces).jacobian(list(eq.multipliers)), -eq.C_r.T)
    assert rows[-1].lhs == eq.explicit("C_dot")[-1]
    assert [e.lhs for e in derived("four_bar").hamilton_equations[-2:]] == list(derived("four_bar").C)


def test_large_mass_matrices_are_not_inverted():
    eq = sd.systems.get("n_link_pendulum", n=4).recursive()
    rows = eq.hamilton_equations
    assert rows[0].lhs == eq.momentum_symbols[0] and sd.prove(rows[0].rhs, eq.momenta[0])
    with pytest.raises(SymdynError, match=r"couples 4 speeds, which is written out for up to 3; take eq.hamilton_equations"):
        _ = eq.hamiltonian
    with pytest.raises(SymdynError, match=r"x_dot in explicit form was requested.*take eq.mass_matrix and eq.forcing"):
        _ = eq.rhs
    with pytest.raises(SymdynError, match=r"there are constraints; evaluate module\.rhs"):
        derived("four_bar").explicit("state_rates")


def test_steps_invert_large_mass_matrices():
    """H in q and p, and x_dot, in named intermediates: T + V at the momenta of a motion, and what the module computes."""
    eq = sd.systems.get("n_link_pendulum", n=4).recursive()
    draw = random.Random(2)
    numbers = {s: draw.uniform(0.3, 1.0) for s in (*eq.symbols.coordinates, *eq.symbols.speeds, *eq.symbols.parameters)}
    momenta = dict(zip(eq.momentum_symbols, eq.momenta.subs(numbers), strict=True))

    def value(name):
        e, steps = eq.explicit(name, intermediates=True)
        known = numbers | momenta
        for step in steps:
            known[step.symbol] = step.expression.subs(known)
        return e.subs(known)

    assert float(value("hamiltonian")) == pytest.approx(float((eq.T + eq.V).subs(numbers)), rel=1e-12)
    state = [numbers[s] for s in (*eq.symbols.coordinates, *eq.symbols.speeds)]
    wanted = eq.compile(backend="numpy").rhs(0.0, state, [numbers[p] for p in eq.symbols.parameters])
    assert [float(v) for v in value("state_rates")] == pytest.approx(list(wanted), rel=1e-11)
    assert [float(v) for v in value("hamilton_speeds")] == pytest.approx(state[4:], rel=1e-11)


def test_names_of_sympy_mechanics():
    eq = derived("cart_pole")
    assert eq.mass_matrix == eq.M_tilde and sd.prove(eq.forcing, eq.F_tilde - eq.k_tilde)
    assert sd.prove(eq.rhs, sp.Matrix([*eq.symbols.speeds, *eq.M_tilde.LUsolve(eq.forcing)]))
    loop = derived("four_bar")
    assert sd.prove(loop.rhs, sp.Matrix([loop.forcing, loop.F_d]))


def test_equations_by_hand_have_no_potential():
    r, phi = sd.coordinates("r phi")
    m, g = sd.parameters("m g", positive=True)
    eq = sd.embedding(coordinates=[r, phi], position=[r * sp.cos(phi), r * sp.sin(phi)], mass=[m, m], force=[0, -m * g])
    assert sd.prove(eq.T, m * (r.dot**2 + r**2 * phi.dot**2) / 2)
    with pytest.raises(SymdynError, match=r"it is not known whether they have a potential\. Describe it as a System"):
        _ = eq.V
    with pytest.raises(SymdynError, match="its potential energy was requested"):
        _ = eq.lagrangian
    rows = [e.rhs for e in eq.hamilton_equations]
    assert sd.prove(rows[2], sp.Symbol("p_phi", real=True)**2 / (m * r**3) - m * g * sp.sin(phi))


def test_quasi_velocities_have_momenta_but_no_hamilton_function():
    system = sd.System("top")
    a, b = sd.parameters("A B", positive=True)
    body = system.add_body("body", mass=1, inertia=[a, a, b])
    system.add_joint(sd.Spherical("joint", system.ground, body, orientation=sd.EulerAngles("ZXZ", speeds="body")))
    eq = system.recursive()
    x, y, z = eq.symbols.speeds
    assert sd.prove(eq.momenta, sp.Matrix([a * x, a * y, b * z]))
    for name in ("hamiltonian", "hamilton_equations", "christoffel"):
        with pytest.raises(SymdynError, match="its speeds are quasi-velocities, not derivatives of coordinates; describe"):
            getattr(eq, name)


def test_momenta_have_names_of_their_own():
    q = sd.coordinates("q")
    taken = sd.parameters("p_q", positive=True)
    system = sd.System("cart")
    cart = system.add_body("cart", mass=taken)
    system.add_joint(sd.Prismatic("rail", system.ground, cart, axis=[1, 0, 0], coordinate=q))
    eq = system.embedding()
    assert str(eq.hamiltonian) == "pp_q**2/(2*p_q)"


def test_determinants_and_solutions():
    stream = np.random.default_rng(2)
    M = stream.integers(-4, 5, (5, 5)).astype(object)
    M[2:, :2] = M[:2, 2:] = 0
    exact = sp.Matrix(M.tolist())
    assert determinant(M) == exact.det() != 0
    right = sp.Matrix([1, 2, 0, -1, 3])
    assert sp.Matrix([sp.Rational(0) + e for e in solve(exact.__array__(dtype=object), np.array(list(right), dtype=object))]) \
        == exact.LUsolve(right)
    with pytest.raises(SymdynError, match="the determinant of 11 rows is requested in symbols; this is done up to 10 rows"):
        determinant(np.eye(11, dtype=object))
    with pytest.raises(ZeroDivisionError, match="singular"):
        solve(np.zeros((1, 1), dtype=object), np.ones(1, dtype=object))


def test_energies_are_among_the_quantities_that_an_error_lists() -> None:
    eq = sd.systems.pendulum().embedding()
    with pytest.raises(SymdynError, match=r"no quantity 'kinetic'; it has M_tilde, .*, T, V, lagrangian, momenta"):
        eq.explicit("kinetic")
