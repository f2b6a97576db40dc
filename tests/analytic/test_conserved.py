"""Quantities reported as conserved are constant along simulated motions, and textbook integrals are found."""

import numpy as np
import pytest
import sympy as sp

import symdyn as sd
from symdyn.errors import ArgumentError, SymdynError
from tests.helpers import swept

m, g, l, A, C, Omega = sd.parameters("m g l A C Omega", positive=True)


def top():
    phi, theta, psi = sd.coordinates("phi theta psi")
    system = sd.System("top", gravity=[0, 0, -g])
    body = system.add_body("top", mass=m, inertia=[A, A, C], com=[0, 0, l])
    system.add_joint(sd.Spherical("tip", system.ground, body, coordinates=[phi, theta, psi], orientation=sd.EulerAngles("ZXZ")))
    system.defaults = {m: 1.1, g: 9.81, l: 0.4, A: 0.2, C: 0.3}
    system.initial = {theta: 0.5, phi.dot: 1.0, theta.dot: 0.3, psi.dot: 12.0}
    return system


def test_heavy_symmetrical_top():
    """Goldstein, Poole, Safko, Classical Mechanics, 3rd ed., (5.52) to (5.54): two momenta and the energy."""
    found = top().recursive().conserved()
    phi, theta, psi = sd.coordinates("phi theta psi")
    I1 = A + m * l**2
    p_psi = C * (psi.dot + phi.dot * sp.cos(theta))
    p_phi = (I1 * sp.sin(theta)**2 + C * sp.cos(theta)**2) * phi.dot + C * psi.dot * sp.cos(theta)
    energy = I1 / 2 * (theta.dot**2 + phi.dot**2 * sp.sin(theta)**2) + p_psi**2 / (2 * C) + m * g * l * sp.cos(theta)
    assert [q.name for q in found] == ["p_phi", "p_psi", "energy"]
    for name, value in (("p_phi", p_phi), ("p_psi", p_psi), ("energy", energy)):
        assert sd.prove(found[name].expression, value) and found[name].proof.proved
    assert found["p_phi"].meaning == "momentum of phi, angular momentum about z"
    assert found.cyclic == (phi, psi)
    assert str(found).startswith("top: conserved along every motion\n  p_phi = C*psi_dot*cos(theta)")
    assert found._repr_latex_().count("&&") == 3 and "momentum of psi" in found._repr_latex_()


def test_spherical_pendulum():
    """Landau, Lifshitz, Mechanics, 3rd ed., paragraph 14, problem 1: M_z = m l^2 phi_dot sin^2 theta and the energy."""
    theta, phi = sd.coordinates("theta phi")
    eq = sd.embedding([theta, phi], [l * sp.sin(theta) * sp.cos(phi), l * sp.sin(theta) * sp.sin(phi), -l * sp.cos(theta)],
                      [m, m, m], [0, 0, -m * g])
    found = eq.conserved()
    assert [q.name for q in found] == ["p_phi"] and sd.prove(found[0].expression, m * l**2 * phi.dot * sp.sin(theta)**2)
    assert "it is not known whether they have a potential" in str(found)


@pytest.mark.parametrize(("name", "kept"), [
    ("double_pendulum", ["energy"]), ("cart_pole", ["p_q1", "energy"]), ("four_bar", ["energy"]), ("skate", ["energy"]),
    ("rolling_disc", ["energy"]), ("vehicle_on_rotating_track", ["energy"]), ("flyball_governor", ["p_phi"]),
    ("pendulum_absolute", ["energy"]), *swept([("puma560", ["p_q1", "energy"])])])
def test_along_simulated_motions(name, kept):
    system = sd.systems.get(name)
    eq = system.augmented() if name in sd.systems.names(constrained=True) else system.recursive()
    found = eq.conserved(undriven=True)
    assert [q.name for q in found] == kept and all(q.proof for q in found)
    inputs = dict.fromkeys(eq.symbols.inputs, 0.0)
    sol = eq.compile(backend="numpy").simulate(t=np.linspace(0, 0.2, 5), inputs=inputs, rtol=1e-10, method="DOP853")
    for quantity in found:
        f = sp.lambdify([*eq.symbols.coordinates, *eq.symbols.speeds], quantity.expression.subs(
            {p: eq.symbols.defaults[p] for p in eq.symbols.parameters}))
        values = np.array([f(*q, *u) for q, u in zip(sol.q, sol.u, strict=True)])
        scale = max(abs(values).max(), abs(sol.energy).max())
        assert np.ptp(values) < 1e-7 * (1 + scale)


def test_bodies_that_float_freely_keep_the_momenta_of_the_whole():
    x, y, a, b = sd.coordinates("x y a b")
    M, J, h = sd.parameters("M J h", positive=True)

    def equations(gravity):
        system = sd.System("two_bodies", gravity=gravity)
        first = system.add_body("first", mass=m, inertia=A)
        second = system.add_body("second", mass=M, inertia=J, com=[h, 0])
        system.add_joint(sd.Planar("free", system.ground, first, coordinates=[x, y, a]))
        system.add_joint(sd.Revolute("hinge", first, second, coordinate=b, parent_point=[l, 0]))
        return system.embedding()

    assert [q.name for q in equations([0, -g]).conserved()] == ["p_x", "energy"]
    eq = equations([0, 0])
    found = eq.conserved()
    assert [q.name for q in found] == ["p_x", "p_y", "H_z", "energy"]
    # About the origin: of the masses and of the turning bodies.
    places = eq.explicit("positions")
    centers = [places.row(k)[:2] for k in range(2)]
    rates = [[sum(e.diff(q) * q.dot for q in (x, y, a, b)) for e in center] for center in centers]
    about = sum(mass * (c[0] * v[1] - c[1] * v[0]) for mass, c, v in zip((m, M), centers, rates, strict=True))
    assert sd.prove(found["H_z"].expression, about + A * a.dot + J * (a.dot + b.dot))


def test_free_rigid_body_with_euler_parameters():
    system = sd.System("free")
    body = system.add_body("body", mass=m, inertia=[A, A, C])
    system.add_joint(sd.Free("joint", system.ground, body, orientation=sd.EulerParameters()))
    names = [q.name for q in system.recursive().conserved()]
    assert len(names) == 8 and {"p_omega_z_joint", "H_x", "H_y", "H_z", "energy"} < set(names)


@pytest.mark.every_value
@pytest.mark.parametrize("formulation", ["recursive", "embedding"])
@pytest.mark.parametrize("joint", [sd.Spherical, sd.Free])
def test_angular_momentum_with_euler_parameters_divides_by_nothing(joint, formulation):
    """The sum over the bodies, R I omega + r_G x m v_G, with 50 digits, also where rows of R vanish."""
    system = sd.System("top", gravity=[0, 0, -g])
    body = system.add_body("top", mass=m, inertia=[A, A, C], com=[0, 0, l])
    system.add_joint(joint("tip", system.ground, body, orientation=sd.EulerParameters()))
    eq = getattr(system, formulation)()
    found = eq.conserved()["H_z"]
    assert found.proof.proved and sp.denom(sp.together(found.expression)).is_number
    assert not found.expression.has(sp.Pow) or all(e.exp.is_positive for e in found.expression.atoms(sp.Pow))
    q, u = eq.symbols.coordinates, eq.symbols.speeds
    half = sp.sqrt(2) / 2
    for e in ([1, 0, 0, 0], [half, half, 0, 0], [0, 0, half, half], [sp.Rational(1, 2)] * 4):
        e0, axis = e[0], sp.Matrix(e[1:])
        R = (2 * e0**2 - 1) * sp.eye(3) + 2 * axis * axis.T + 2 * e0 * axis.hat()
        x = [sp.Rational(3, 7), sp.Rational(-2, 5), sp.Rational(1, 9)][:len(q) - 4]
        v = [sp.Rational(5, 7), sp.Rational(2, 3), sp.Rational(-4, 9)][:len(q) - 4]
        w = [sp.Rational(1, 3), sp.Rational(-6, 5), sp.Rational(7, 4)]
        omega = R * sp.Matrix(w)
        arm = R * sp.Matrix([0, 0, l])
        center = sp.Matrix(x or [0, 0, 0]) + arm
        velocity = sp.Matrix(v or [0, 0, 0]) + omega.cross(arm)
        about = R * sp.Matrix([A * w[0], A * w[1], C * w[2]]) + m * center.cross(velocity)
        here = {**dict(zip(q, [*x, *e], strict=True)), **dict(zip(u, [*v, *w], strict=True))}
        numbers = {m: sp.Rational(13, 11), l: sp.Rational(2, 7), A: sp.Rational(5, 3), C: sp.Rational(3, 8)}
        difference = (found.expression.subs(here) - about[2]).subs(numbers)
        assert abs(difference.evalf(50, chop=True)) < 1e-45


def test_coordinates_that_only_loads_or_constraints_hold_are_not_cyclic():
    x = sd.coordinates("x")
    k = sd.parameters("k", positive=True)
    system = sd.System("mass_on_spring", planar=True)
    body = system.add_body("body", mass=m)
    rail = system.add_joint(sd.Prismatic("rail", system.ground, body, axis=[1, 0], coordinate=x))
    system.add_joint_force(rail, -k * x)
    found = system.embedding().conserved()
    assert found.cyclic == () and len(found) == 0
    assert "x is not cyclic: it stands in loads without potential, though not in T and V" in str(found)
    rubbing = sd.systems.get("pendulum_absolute").augmented().conserved()
    assert rubbing.cyclic == () and "x is not cyclic: it stands in constraints, though not in T and V" in str(rubbing)
    skate = sd.systems.get("skate").augmented().conserved()
    assert [str(q) for q in skate.cyclic] == ["x", "y"] and "p_x is not conserved: forces of constraints change it" in str(skate)
    # T holds no Euler parameters where speeds are components of omega, but they are no cyclic coordinates.
    free = sd.System("free")
    free.add_joint(sd.Spherical("joint", free.ground, free.add_body("body", mass=m, inertia=[A, A, C]),
                                orientation=sd.EulerParameters()))
    assert free.recursive().conserved().cyclic == ()


def test_what_is_conserved_with_inputs_at_zero_is_said_to_be_so():
    cart_pole = sd.systems.get("cart_pole").embedding()
    assert str(cart_pole.conserved(undriven=True)).startswith("cart_pole: conserved along every motion with inputs at zero\n")
    assert str(top().recursive().conserved(undriven=True)).startswith("top: conserved along every motion\n")


def test_bead_on_a_hoop_that_turns_keeps_jacobi_s_integral():
    """Goldstein, Poole, Safko, 3rd ed., section 2.7: the energy function is conserved and is not T + V."""
    theta = sd.coordinates("theta")
    system = sd.System("hoop", gravity=[0, 0, -g])
    hoop, bead = system.add_body("hoop"), system.add_body("bead", mass=m, com=[0, 0, -l])
    system.add_joint(sd.Revolute("drive", system.ground, hoop, axis=[0, 0, 1], coordinate=Omega * sd.t))
    system.add_joint(sd.Revolute("bead", hoop, bead, axis=[0, 1, 0], coordinate=theta))
    found = system.embedding().conserved()
    assert [q.name for q in found] == ["jacobi"]
    wanted = m * l**2 * (theta.dot**2 - Omega**2 * sp.sin(theta)**2) / 2 - m * g * l * sp.cos(theta)
    assert sd.prove(found["jacobi"].expression, wanted)


def test_what_is_not_conserved_is_said():
    eq = sd.systems.get("cart_pole").embedding()
    found = eq.conserved()
    assert len(found) == 0 and str(found) == ("cart_pole: nothing conserved was found\n  cyclic coordinates: q1\n"
                                              "  energy: the rate of T + V is F*q1_dot\n  p_q1 is not conserved: its rate is F")
    assert "nothing conserved was found" in found._repr_latex_()
    with pytest.raises(SymdynError, match=r"cart_pole conserves no 'energy'; it conserves nothing; energy: the rate of T \+ V"):
        found["energy"]
    slope = sd.systems.get("particle_on_moving_slope").augmented().conserved()
    assert "energy: the constraints, which depend on the time, change T + V" in str(slope)
    with pytest.raises(ArgumentError, match="undriven is 'no'; pass True or False"):
        eq.conserved(undriven="no")


def test_loads_that_depend_on_reactions_are_rejected():
    x, mu = sd.coordinates("x"), sd.parameters("mu", positive=True)
    system = sd.System("block", gravity=[0, -g])
    block = system.add_body("block", mass=m)
    rail = system.add_joint(sd.Prismatic("rail", system.ground, block, axis=[1, 0], coordinate=x))
    system.add_joint_force(rail, -mu * sd.reaction("rail")[1])
    with pytest.raises(SymdynError, match=r"conserved quantities were requested, but .* depends on accelerations or reactions"):
        system.embedding().conserved()


def test_rounding_of_decimal_numbers_decides_nothing():
    system = sd.System("arm", gravity=[0, 0, -9.81])
    m, c = sd.parameters("m c")
    last = system.ground
    for k, axis in enumerate(np.array([[0.31, 0.52, 0.71], [0.6, 0.2, -0.7]])):
        body = system.add_body(f"link{k}", mass=m, inertia=[m, 2 * m, 3 * m], com=[c, 0, 0])
        system.add_joint(sd.Revolute(f"joint{k}", last, body, sd.coordinates(f"q{k}"), axis=list(axis / np.linalg.norm(axis)),
                                     parent_point=[c, 0, 0]))
        last = body
    found = system.recursive().conserved()
    assert "energy: not decided, the sides differ by no more than the rounding of decimal numbers" in str(found)


def test_axes_of_decimal_numbers_are_taken_as_of_unit_length():
    bicycle = sd.systems.get("bicycle").augmented()
    found = bicycle.conserved(undriven=True)
    assert "proved: for axes of decimal numbers, divided by their length exactly" in str(found)
    driven = sd.systems.get("floating_crane").recursive()
    assert "energy" in str(driven.conserved())
    mixed = bicycle.conserved()
    assert "energy: loads without potential, or prescribed motions, change T + V" in str(mixed)
