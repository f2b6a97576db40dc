"""Symbolic linear equations agree with those in numbers, with SymPy's and with textbooks."""

import numpy as np
import pytest
import sympy as sp
import sympy.physics.mechanics as me

import symdyn as sd
from symdyn.analytic.stability import _lienard_chipart, _negative_and_real
from symdyn.errors import ArgumentError, SymdynError

m, M, g, l, k, c, A, C, Omega = sd.parameters("m M g l k c A C Omega", positive=True)


def numbers(linear, values):
    names = {s.name for s in linear.symbols.values()}
    return linear.with_values({p: v for p, v in values.items() if str(p) in names})


def array(matrix):
    return np.array(matrix.tolist(), dtype=float).reshape(matrix.shape)


def agree(symbolic, numeric):
    for name in ("M", "C", "K", "F_in", "A", "B"):
        found, wanted = array(getattr(symbolic, name)), np.asarray(getattr(numeric, name))
        assert found.shape == wanted.shape
        assert np.abs(found - wanted).max(initial=0) <= 1e-10 * (1 + np.abs(wanted).max(initial=0)), name


@pytest.mark.parametrize("name", ["pendulum", "double_pendulum", "vehicle_on_rotating_track", "two_link_arm", "four_bar",
                                  "pendulum_absolute", "spatial_slider_crank", "n_four_bar"])
def test_at_rest_as_in_numbers(name):
    system = sd.systems.get(name)
    eq = system.augmented() if name in sd.systems.names(constrained=True) else system.recursive()
    module = eq.compile(backend="numpy")
    rest = module.equilibrium()
    symbolic = eq.linearized(dict(zip(eq.symbols.coordinates, map(float, rest.q), strict=True)))
    found = numbers(symbolic, eq.symbols.defaults)
    agree(found, module.linearize(rest, coordinates=[str(q) for q in symbolic.coordinates] if eq.constraints else None))
    assert all(abs(float(e.lhs)) < 1e-9 for e in found.conditions)


def test_explicit_angles_of_a_loop():
    """Angles as parameters, with the closure among the conditions, are the numbers that are put in."""
    eq = sd.systems.get("four_bar").augmented()
    module = eq.compile(backend="numpy")
    rest = module.equilibrium()
    angles = sp.symbols("alpha beta gamma")
    linear = eq.linearized(dict(zip(eq.symbols.coordinates, angles, strict=True)))
    values = {**eq.symbols.defaults, **dict(zip(angles, map(float, rest.q), strict=True))}
    agree(numbers(linear, values), module.linearize(rest, coordinates=["q1"]))
    assert linear.coordinates == (eq.symbols.coordinates[0],) and len(linear.conditions) == 3
    assert all(abs(float(e.lhs.subs(values))) < 1e-9 for e in linear.conditions)


def hoop(damping=0):
    theta, phi = sd.coordinates("theta phi")
    system = sd.System("hoop", gravity=[0, 0, -g])
    ring, bead = system.add_body("ring", inertia=[0, 0, A]), system.add_body("bead", mass=m, com=[0, 0, -l])
    axis = system.add_joint(sd.Revolute("drive", system.ground, ring, axis=[0, 0, 1], coordinate=phi))
    arm = system.add_joint(sd.Revolute("arm", ring, bead, axis=[0, 1, 0], coordinate=theta))
    system.add_joint_force(arm, -damping * theta.dot)
    system.add_joint_force(axis, sd.inputs("tau"))
    system.defaults = {m: 1.0, g: 9.81, l: 0.5, A: 0.2}
    return system


def test_steady_motion_as_in_numbers():
    eq = hoop().embedding()
    theta = next(q for q in eq.symbols.coordinates if q.name == "theta")
    angle, speed = sp.symbols("theta_0 Omega_0")
    linear = eq.linearized({theta: angle, "phi_dot": speed})
    assert linear.conditions == (sp.Eq(linear.conditions[0].lhs, 0, evaluate=False),)
    assert sd.prove(linear.conditions[0].lhs, m * g * l * sp.sin(angle) - m * l**2 * speed**2 * sp.sin(angle) * sp.cos(angle))
    at = {"theta": float(np.arccos(9.81 / (0.5 * 36))), "phi_dot": 6.0}
    values = {**eq.symbols.defaults, angle: at["theta"], speed: 6.0}
    found = numbers(linear, values)
    agree(found, eq.compile(backend="numpy").linearize(at))
    assert abs(float(linear.conditions[0].lhs.subs(values))) < 1e-12


def test_what_is_held():
    eq = hoop(c).embedding()
    module = eq.compile(backend="numpy")
    linear = eq.linearized({"phi_dot": Omega}, hold=["phi"])
    assert [str(q) for q in linear.coordinates] == ["theta"] and linear.conditions == ()
    assert sd.prove(linear.K[0], m * g * l - m * l**2 * Omega**2)
    stable = linear.characteristic().routh_hurwitz()
    assert [str(e) for e in stable.conditions] == ["-Omega**2*l + g > 0"] and stable.kind == "asymptotic"
    values = {**eq.symbols.defaults, c: 0.3}
    agree(numbers(linear, {**values, Omega: 2.0}), module.linearize({"phi_dot": 2.0}, params=values, hold=["phi"]))


@pytest.mark.parametrize("orientation", [sd.EulerAngles("ZYX", speeds="body"), sd.EulerParameters()])
def test_quasi_velocities_at_rest(orientation):
    system = sd.System("buoy", gravity=[0, 0, -g])
    body = system.add_body("buoy", mass=m, inertia=[A, A, C], com=[0, 0, -l])
    system.add_joint(sd.Spherical("pivot", system.ground, body, orientation=orientation))
    system.defaults = {m: 1.0, g: 9.81, l: 0.5, A: 0.2, C: 0.1}
    eq = system.recursive()
    linear = eq.linearized()
    assert sd.prove(linear.K, sp.diag(m * g * l, m * g * l, 0)) and linear.coordinates == eq.symbols.speeds
    agree(numbers(linear, system.defaults), eq.compile(backend="numpy").linearize())
    with pytest.raises(SymdynError, match=r"but its quasi-velocities take part in it; use module\.linearize"):
        eq.linearized({eq.symbols.speeds[2]: Omega})


def test_extra_states():
    x, z = sd.coordinates("x z")
    system = sd.System("servo")
    block = system.add_body("block", mass=m)
    rail = system.add_joint(sd.Prismatic("rail", system.ground, block, axis=[1, 0, 0], coordinate=x))
    system.add_state(z, (sd.inputs("v") - k * x - z) / c)
    system.add_joint_force(rail, z)
    system.defaults = {m: 2.0, k: 3.0, c: 0.5}
    eq = system.embedding()
    linear = eq.linearized()
    agree(numbers(linear, system.defaults), eq.compile(backend="numpy").linearize())
    s = sp.Symbol("s")
    assert sd.prove(linear.characteristic().expression(s), m * s**3 + m * s**2 / c + k / c)
    assert [str(e) for e in linear.characteristic().routh_hurwitz().conditions] == ["-k*m/c > 0"]


def test_inverted_pendulum_on_a_cart():
    """Ogata, Modern Control Engineering, 5th ed., example 3-6 with the rod's inertia: about the upright position."""
    eq = sd.systems.get("cart_pole").embedding()
    m_c, m_p, l, I_p, g = (next(p for p in eq.symbols.parameters if p.name == n) for n in ("m_c", "m_p", "l", "I_p", "g"))
    s = sp.Symbol("s")
    found = eq.linearized().characteristic()
    inertia = (m_c + m_p) * (I_p + m_p * l**2) - m_p**2 * l**2
    assert sd.prove(found.expression(s), inertia * s**4 - (m_c + m_p) * m_p * g * l * s**2)
    unstable = found.routh_hurwitz()
    assert unstable.zero_roots == 2 and unstable.kind == "neutral" and len(unstable.conditions) == 1
    assert str(unstable).endswith("besides 2 roots s = 0")


def test_double_pendulum_of_equal_masses_and_rods():
    """Landau, Lifshitz, Mechanics, 3rd ed., paragraph 23, problem 2: frequencies for m1 = m2, l1 = l2 are (2 -+ sqrt 2) g / l."""
    eq = sd.systems.get("double_pendulum").embedding()
    linear = eq.linearized({"q1": -sp.pi / 2})
    linear = linear.with_values({"m1": m, "m2": m, "l1": l, "lc1": l, "lc2": l, "I1": 0, "I2": 0})
    own = next(s for s in linear.symbols.values() if s.name == "g")
    s = sp.Symbol("s")
    wanted = m**2 * l**4 * s**4 + 4 * m**2 * own * l**3 * s**2 + 2 * m**2 * own**2 * l**2
    assert sd.prove(linear.characteristic().expression(s), wanted)
    assert linear.conditions == ()


def test_sympy_s_linearization():
    """KanesMethod.linearize of a cart with a pendulum."""
    q1, q2, u1, u2, f = me.dynamicsymbols("q1 q2 u1 u2 F")
    m_c, m_p, length, I, grav = sp.symbols("m_c m_p l I_p g")
    N = me.ReferenceFrame("N")
    B = N.orientnew("B", "Axis", [q2, N.z])
    B.set_ang_vel(N, u2 * N.z)
    O, P = me.Point("O"), me.Point("P")
    O.set_vel(N, 0)
    P.set_pos(O, q1 * N.x)
    P.set_vel(N, u1 * N.x)
    G = P.locatenew("G", length * B.y)
    G.v2pt_theory(P, N, B)
    cart = me.Particle("cart", P, m_c)
    rod = me.RigidBody("rod", G, B, m_p, (me.inertia(B, 0, 0, I), G))
    kane = me.KanesMethod(N, [q1, q2], [u1, u2], [q1.diff() - u1, q2.diff() - u2])
    kane.kanes_equations([cart, rod], [(P, f * N.x - m_c * grav * N.y), (G, -m_p * grav * N.y)])
    A, B, inputs = kane.linearize(A_and_B=True, op_point={q1: 0, q2: 0, u1: 0, u2: 0, q1.diff(): 0, q2.diff(): 0,
                                                          u1.diff(): 0, u2.diff(): 0}, simplify=True)
    linear = sd.systems.get("cart_pole").embedding().linearized()
    names = {s: sp.Symbol(s.name) for s in linear.symbols.values()}
    assert list(inputs) == [f]
    assert sd.prove(linear.A.subs(names), A) and sd.prove(linear.B.subs(names), B)


@pytest.mark.parametrize("n", [1, 2, 3, 4, 5, 6])
def test_routh_and_hurwitz_by_roots(n):
    stream = np.random.default_rng(n)
    verdicts = set()
    for _ in range(60):
        a = [1, *stream.uniform(-0.3, 3, n)]
        a = list(np.poly(np.roots(a) - stream.uniform(0, 1.5))) if n > 2 else a
        stable = bool(max(np.roots(a).real) < 0)
        assert (min(_lienard_chipart(a)) > 0) == stable
        verdicts.add(stable)
    assert len(verdicts) == 2


@pytest.mark.parametrize("n", [1, 2, 3])
def test_real_and_negative_roots(n):
    stream = np.random.default_rng(n)
    verdicts = set()
    for _ in range(60):
        b = stream.uniform(-0.2, 4, n + 1)
        b[-1] = 0.2
        roots = np.roots(b[::-1])
        wanted = bool(np.abs(roots.imag).max() < 1e-9 and roots.real.max() < 0)
        assert (min(_negative_and_real(list(b))) > 0) == wanted
        verdicts.add(wanted)
    assert len(verdicts) == 2


def test_gyroscopic_conditions_hold_the_discriminant():
    """A bead at the centre of a disc that turns, on two springs (Bolotin, Nonconservative Problems, 1.7)."""
    x, y = sd.coordinates("x y")
    system = sd.System("shaft")
    disc, bead, mass = (system.add_body(name, **more) for name, more in (("disc", {}), ("slide", {}), ("bead", {"mass": m})))
    system.add_joint(sd.Revolute("shaft", system.ground, disc, axis=[0, 0, 1], coordinate=Omega * sd.t))
    first = system.add_joint(sd.Prismatic("x", disc, bead, axis=[1, 0, 0], coordinate=x))
    second = system.add_joint(sd.Prismatic("y", bead, mass, axis=[0, 1, 0], coordinate=y))
    system.add_joint_force(first, -k * x)
    system.add_joint_force(second, -M * y)
    linear = system.embedding().linearized()
    stable = linear.characteristic().routh_hurwitz()
    assert stable.kind == "neutral" and stable.conditions  # the discriminant is positive for all parameters
    for numbers in ({m: 1, k: 4, M: 9, Omega: 1}, {m: 1, k: 4, M: 9, Omega: 2.5}, {m: 1, k: 4, M: 9, Omega: 4}):
        roots = np.roots([float(e.subs(numbers)) for e in linear.characteristic().coefficients])
        assert all(e.subs(numbers) == True for e in stable.conditions) == bool(roots.real.max() < 1e-9)  # noqa: E712


def test_printing():
    x = sd.coordinates("x")
    system = sd.System("block")
    block = system.add_body("block", mass=m)
    rail = system.add_joint(sd.Prismatic("rail", system.ground, block, axis=[1, 0, 0], coordinate=x))
    system.add_joint_force(rail, sd.inputs("F") - k * x - c * x.dot)
    linear = system.embedding().linearized({"F": M})
    assert str(linear) == ("block: linear equations in x\n  M = [[m]]\n  C = [[c]]\n  K = [[k]]\n  F_in = [[1]]\n"
                           "  where -M = 0")
    assert r"\text{condition}" in linear._repr_latex_() and "ddot" in repr(linear._repr_latex_())
    found = linear.characteristic()
    assert str(found) == "c*s + k + m*s**2" and found._repr_latex_() == r"$\displaystyle c s + k + m s^{2}$"
    assert str(found.routh_hurwitz()) == ("asymptotic stability for all values of the parameters\n"
                                           "  if the state is an equilibrium: -M = 0")


@pytest.mark.parametrize(("arguments", "message"), [
    ({"about": {"q1": sp.Float("1e400")}}, r"the number 1.00000E\+400 is beyond the range of floats"),
    ({"about": {"p": 1}}, "about has p; it takes q1, q2, q1_dot, q2_dot, F"),
    ({"about": [1]}, r"about is \[1\]; pass a dict such as"),
    ({"about": {"q1": "x"}}, "about: q1 is 'x'; pass a finite number or an expression in parameters"),
    ({"about": {"q1": sd.t}}, "about: q1 is t, which holds t; pass a number or an expression in parameters"),
    ({"hold": "p"}, "hold is p; it takes q1_dot, q2_dot, q1, q2"),
])
def test_faults(arguments, message):
    with pytest.raises(ArgumentError, match=message):
        sd.systems.get("cart_pole").embedding().linearized(**arguments)


def test_faults_of_values():
    linear = sd.systems.get("cart_pole").embedding().linearized()
    with pytest.raises(ArgumentError, match="x is no parameter of the linearization; it has"):
        linear.with_values({"x": 1})
    with pytest.raises(ArgumentError, match="values is 3; pass a dict"):
        linear.with_values(3)


def test_what_has_no_constant_linear_equations():
    with pytest.raises(SymdynError, match=r"q1 goes on at the speed 1, and .* holds it"):
        sd.systems.get("four_bar").augmented().linearized({"q1_dot": 1, "q2": 0.5, "q3": 0.8})
    with pytest.raises(SymdynError, match=r"theta goes on at the speed 1, and .* holds it"):
        sd.systems.get("skate").augmented().linearized({"theta_dot": 1})
    with pytest.raises(SymdynError, match="5 constraints have rank 4"):
        sd.systems.get("bricard").augmented().linearized()
    with pytest.raises(SymdynError, match="q1 goes on at the speed 1, and K holds it"):
        sd.systems.get("double_pendulum").embedding().linearized({"q1_dot": 1})
    x = sd.coordinates("x")
    system = sd.System("block")
    block = system.add_body("block", mass=m)
    rail = system.add_joint(sd.Prismatic("rail", system.ground, block, axis=[1, 0, 0], coordinate=x))
    system.add_joint_force(rail, -k * x * sp.cos(Omega * sd.t))
    with pytest.raises(SymdynError, match=r"K holds t; use module\.linearize\(at, t=\.\.\.\)"):
        system.embedding().linearized()
    chain = sd.systems.get("n_link_pendulum", n=4).embedding().linearized({"q1": -sp.pi / 2})
    with pytest.raises(SymdynError, match="conditions for a polynomial of degree 8 were requested; they are written for up to 6"):
        chain.with_values(chain_values(chain)).characteristic().routh_hurwitz()


def chain_values(linear):
    return dict.fromkeys(linear.symbols.values(), 1)


def test_bounds_on_what_is_written(monkeypatch):
    eq = sd.systems.get("double_pendulum").embedding()
    monkeypatch.setattr("symdyn.analytic.linear.BOUND", 1)
    with pytest.raises(SymdynError, match=r"above the bound of 1; put numbers in place of parameters with linear\.with_values"):
        _ = eq.linearized({"q1": Omega, "q2": Omega}).K
    monkeypatch.setattr("symdyn.analytic.linear.SECONDS", 0.0)
    with pytest.raises(SymdynError, match="it is not written out within 0 s; put numbers in place of parameters"):
        _ = eq.linearized().K


def test_motions_in_constraints_and_in_quasi_velocities():
    x, z = sd.coordinates("x"), sd.motions("z")
    system = sd.System("follower")
    block = system.add_body("block", mass=m)
    system.add_joint(sd.Prismatic("rail", system.ground, block, axis=[1, 0, 0], coordinate=x))
    system.add_constraint(x - z)
    with pytest.raises(SymdynError, match="but inputs stand in its constraints; use module"):
        system.augmented().linearized()
    system = sd.System("ball")
    body = system.add_body("body", mass=m, inertia=[A, A, A])
    system.add_joint(sd.Spherical("joint", system.ground, body, orientation=sd.EulerAngles("ZYX", speeds="body")))
    eq = system.recursive()
    eq._recorded["rates"] = eq.quantity("rates") + 1
    with pytest.raises(SymdynError, match="requested at a state where coordinates move by a given motion"):
        eq.linearized()


def test_loads_that_depend_on_multipliers():
    x, y = sd.coordinates("x y")
    system = sd.System("bead", gravity=[0, -g])
    slide, bead = system.add_body("slide"), system.add_body("bead", mass=m)
    rail = system.add_joint(sd.Prismatic("x", system.ground, slide, axis=[1, 0], coordinate=x))
    system.add_joint(sd.Prismatic("y", slide, bead, axis=[0, 1], coordinate=y))
    system.add_constraint(y - k * x, name="wire")
    system.add_joint_force(rail, -c * sd.multiplier("wire"))
    with pytest.raises(SymdynError, match="depends on accelerations, multipliers or reactions under constraints; use module"):
        system.augmented().linearized()


def test_stability_names_what_the_state_needs_to_be_an_equilibrium():
    eq = sd.systems.get("n_link_pendulum", n=2).embedding()
    level = eq.linearized().characteristic().routh_hurwitz()
    assert level.kind == "undecided" and level.zero_roots == 4
    assert str(level).splitlines() == [
        "stability is not decided by the linear equations: all roots are s = 0",
        "  if the state is an equilibrium: g*(lc1*m1 + m2*(l1 + lc2)) = 0", "  if the state is an equilibrium: g*lc2*m2 = 0"]
    hanging = eq.linearized({"q1": -sp.pi / 2}).characteristic().routh_hurwitz()
    assert hanging.kind == "neutral" and hanging.equilibrium == ()
    cart = sd.systems.get("cart_pole").embedding().linearized().characteristic().routh_hurwitz()
    assert "besides 2 roots s = 0" in str(cart)
