"""Symbolic linear equations under velocity constraints and along steady motions: numbers of a module, textbooks, the bicycle."""

import numpy as np
import pytest
import sympy as sp

import symdyn as sd
from symdyn.errors import ArgumentError, SymdynError

v, m, A, C, g, l, k, c = sd.parameters("v m A C g l k c", positive=True)


def in_numbers(linear, values):
    names = {s.name for s in linear.symbols.values()}
    return linear.with_values({name: value for name, value in values.items() if name in names})


def array(matrix):
    return np.array(matrix.tolist(), dtype=float).reshape(matrix.shape)


def assert_as_in_numbers(eq, values, about, **more):
    """A, B and the matrices by forces are those of module.linearize, with the same independent displacements and speeds."""
    symbolic = eq.linearized(about, **more)
    found = in_numbers(symbolic, values)
    assert found.conditions == ()
    module = eq.compile(backend="numpy")
    put = {s: sp.Float(values[s.name]) for s in symbolic.symbols.values()}
    state = dict.fromkeys(module.metadata.x, 0.0)
    state |= {getattr(key, "name", key): float(sp.sympify(value).subs(put)) for key, value in about.items()}
    numeric = module.linearize(state, {name: x for name, x in values.items() if name in module.metadata.parameters},
                               coordinates=[*map(str, symbolic.coordinates), *map(str, symbolic.speeds)])
    for name in ("A", "B", "M", "C", "K", "F_in"):
        wanted = np.asarray(getattr(numeric, name))
        assert np.abs(array(getattr(found, name)) - wanted).max(initial=0) <= 1e-12 * (1 + np.abs(wanted).max(initial=0)), name
    return symbolic


def defaults(system):
    return {p.name: value for p, value in system.defaults.items()}


@pytest.mark.every_value
@pytest.mark.parametrize("name", ["skate", "sleigh"])
@pytest.mark.parametrize("speed", [0, 2.5])
def test_sleighs_as_in_numbers(name, speed):
    system = sd.systems.get(name)
    linear = assert_as_in_numbers(system.augmented(), {**defaults(system), "v": speed}, {"x_dot": v})
    assert len(linear.speeds) == 2 and len(linear.coordinates) == 3 and not linear.holonomic


def test_chaplygins_sleigh_is_stable_forwards():
    """Turning dies out where the centre of mass leads: (I + m a^2) theta_ddot = -m a v theta_dot (Neimark and Fufaev)."""
    eq = sd.systems.get("skate").augmented()
    p = {str(s): s for s in eq.symbols.parameters}
    linear = eq.linearized({"x_dot": v}, coordinates=["x", "theta"])
    polynomial = linear.characteristic()
    s = sp.Symbol("s")
    inertia = p["I"] + p["m"] * p["a"]**2
    assert sp.expand(polynomial.expression(s) - p["m"] * s**4 * (inertia * s + p["m"] * p["a"] * v)) == 0
    assert polynomial.routh_hurwitz().kind == "asymptotic" and polynomial.routh_hurwitz().zero_roots == 4


def rolling():
    eq = sd.systems.get("rolling_disc").augmented()
    R = next(p for p in eq.symbols.parameters if p.name == "R")
    return eq, {"theta": sp.pi / 2, "z": R, "x_dot": v, "phi_dot": -v / R}


@pytest.mark.parametrize("speed", [0, 1.0, 3.0])
def test_rolling_disc_as_in_numbers(speed):
    eq, about = rolling()
    assert_as_in_numbers(eq, {**defaults(sd.systems.get("rolling_disc")), "v": speed}, about)


def test_rolling_disc_is_stable_above_its_speed():
    """I_a (I_a + m R^2) v^2 / R^2 > I_t m g R; v^2 > g R / 3 for a thin homogeneous disc (Neimark and Fufaev)."""
    eq, about = rolling()
    p = {str(s): s for s in eq.symbols.parameters}
    linear = eq.linearized(about, coordinates=["psi", "theta", "phi"])
    assert [str(u) for u in linear.speeds] == ["psi_dot", "theta_dot", "phi_dot"]
    assert linear.conditions == ()
    stable = linear.characteristic().routh_hurwitz()
    assert stable.kind == "neutral" and stable.zero_roots == 6
    (condition,) = stable.conditions
    wanted = p["I_a"] * (p["I_a"] + p["m"] * p["R"]**2) * v**2 / p["R"]**2 - p["I_t"] * p["m"] * p["g"] * p["R"]
    # Written with its factors, above the denominator R^2.
    assert sp.factor(condition.lhs / wanted - p["I_a"] - p["m"] * p["R"]**2) == 0
    assert p["I_a"] + p["m"] * p["R"]**2 in condition.lhs.args
    thin = condition.lhs.subs({p["I_a"]: p["m"] * p["R"]**2 / 2, p["I_t"]: p["m"] * p["R"]**2 / 4})
    assert sp.simplify(thin.subs(v, sp.sqrt(p["g"] * p["R"] / 3))) == 0


def test_a_disc_that_slips_is_no_steady_motion():
    eq, about = rolling()
    linear = eq.linearized({**about, "phi_dot": 0})
    assert sp.Eq(v, 0, evaluate=False) in linear.conditions
    with pytest.raises(SymdynError, match="the state is no equilibrium: 1 would have to be zero"):
        _ = eq.linearized({**about, "x_dot": 1, "phi_dot": 0}).conditions


def test_the_benchmark_bicycle():
    """M, C = v C_1, K = g K_0 + v^2 K_2 of lean and steer, weave and capsize speeds. Source: Meijaard, Papadopoulos, Ruina and
    Schwab, Linearized dynamics equations for the balance and steer of a bicycle, Proc. R. Soc. A 463, 2007."""
    system = sd.systems.get("bicycle")
    eq = system.augmented()
    p = {str(s): s for s in eq.symbols.parameters}
    linear = eq.linearized({"z": -p["r_R"], "x_dot": v, "rear_dot": -v / p["r_R"], "front_dot": -v / p["r_F"]},
                           coordinates=["lean", "steer"])
    linear = linear.with_values({s: sp.Rational(repr(value)) for s, value in system.defaults.items()})
    assert linear.conditions == () and [str(u) for u in linear.speeds] == ["x_dot", "lean_dot", "steer_dot"]
    rows, columns = [1, 2], [[str(q) for q in linear.coordinates].index(name) for name in ("lean", "steer")]
    M, C_1 = linear.M.extract(rows, rows), linear.C.extract(rows, rows).diff(v)
    K = linear.K.extract(rows, columns)
    published = {
        "M": (M, [[80.81722, 2.31941332208709], [2.31941332208709, 0.29784188199686]]),
        "C_1": (C_1, [[0, 33.86641391492494], [-0.85035641456978, 1.68540397397560]]),
        "K_0": (K.subs(v, 0) / 9.81, [[-80.95, -2.59951685249872], [-2.59951685249872, -0.80329488458618]]),
        "K_2": (K.diff(v, 2) / 2, [[0, 76.59734589573222], [0, 2.65431523794604]])}
    for name, (found, wanted) in published.items():
        assert np.abs(array(found) - np.array(wanted)).max() <= 2e-14 * np.abs(wanted).max(), name
    stable = linear.characteristic().routh_hurwitz()
    assert stable.kind == "asymptotic" and stable.zero_roots == 6
    limits = sorted(float(root) for c in stable.conditions for root in sp.Poly(c.lhs, v).nroots(n=20, maxsteps=200)
                    if root.is_real and root > 1e-6)
    assert limits[-1] == pytest.approx(6.02426201538837, abs=1e-11)
    assert limits[-2] == pytest.approx(4.29238253634111, abs=1e-11)


def geared():
    """A conical pendulum whose shaft drives a flywheel by gears: a constraint of positions along a steady motion."""
    phi, psi, theta = sd.coordinates("phi psi theta")
    system = sd.System("geared", gravity=[0, 0, -g])
    shaft, wheel = (system.add_body(name, inertia=[A, A, C]) for name in ("shaft", "wheel"))
    bob = system.add_body("bob", mass=m, com=[0, 0, -l])
    system.add_joint(sd.Revolute("phi", system.ground, shaft, phi, axis=[0, 0, 1]))
    system.add_joint(sd.Revolute("psi", system.ground, wheel, psi, axis=[0, 0, 1]))
    system.add_joint(sd.Revolute("theta", shaft, bob, theta, axis=[0, 1, 0]))
    system.add_constraint(psi - 3 * phi, name="gears")
    return system


def test_steady_motion_under_a_constraint_of_positions():
    Omega = sd.parameters("Omega", positive=True)
    about = {"theta": sp.acos(g / (l * Omega**2)), "phi_dot": Omega, "psi_dot": 3 * Omega}
    values = {"A": 0.3, "C": 0.2, "m": 1.3, "l": 0.7, "g": 9.81, "Omega": 5.0}
    linear = assert_as_in_numbers(geared().augmented(), values, about)
    assert linear.holonomic and [str(q) for q in linear.coordinates] == ["phi", "theta"]


def test_extra_states_and_inputs_under_a_velocity_constraint():
    """A sleigh that a motor with a lag drives, and a spring across the line: A and B, and det(s - A)."""
    x, y, theta, z = sd.coordinates("x y theta z")
    F = sd.inputs("F")
    system = sd.System("driven", planar=True)
    body = system.add_body("body", mass=m, inertia=A, com=[l, 0])
    joint = system.add_joint(sd.Planar("plane", system.ground, body, [x, y, theta]))
    system.add_constraint(-x.dot * sp.sin(theta) + y.dot * sp.cos(theta), name="edge")
    system.add_joint_force(joint, [-c * x.dot, -k * y, z])
    system.add_state(z, F - z - theta.dot)
    values = {"m": 2.0, "A": 0.4, "l": 0.3, "k": 7.0, "c": 0.6, "v": 1.5}
    eq = system.augmented()
    linear = eq.linearized({}, coordinates=["x", "theta"])
    module = eq.compile(backend="numpy")
    numeric = module.linearize(dict.fromkeys(module.metadata.x, 0.0), {n: w for n, w in values.items() if n != "v"},
                               coordinates=[*map(str, linear.coordinates), *map(str, linear.speeds)])
    found = in_numbers(linear, values)
    assert np.abs(array(found.A) - numeric.A).max() <= 1e-13 * np.abs(numeric.A).max()
    assert np.abs(array(found.B) - numeric.B).max() <= 1e-13 * np.abs(numeric.B).max()
    s = sp.Symbol("s")
    whole = (s * sp.eye(found.A.rows) - found.A).det() * found.M.det()
    assert max(abs(e) for e in sp.Poly(whole - found.characteristic().expression(s), s).all_coeffs()) < 1e-12
    text = str(linear)
    assert "x'_dot = A x' + B in of x' = [eta; zeta; z], with changes zeta of x_dot, theta_dot" in text


def test_printing():
    linear = sd.systems.get("skate").augmented().linearized({"x_dot": v}, coordinates=["x", "theta"])
    assert str(linear).splitlines()[1] == ("  M zeta_dot + C zeta + K eta = 0, eta_dot = E zeta + W eta, with changes zeta of "
                                           "x_dot, theta_dot")
    assert r"\dot{\eta} &=" in linear._repr_latex_() and r"\dot{\zeta}" in linear._repr_latex_()
    assert linear.E.tolist() == [[1, 0], [0, 0], [0, 1]] and linear.W.tolist() == [[0, 0, 0], [0, 0, v], [0, 0, 0]]


def test_faults():
    eq, about = rolling()
    with pytest.raises(ArgumentError, match="coordinates is w; it takes"):
        eq.linearized(about, coordinates=["w"])
    with pytest.raises(ArgumentError, match="coordinates are to be independent, but z_dot cannot be at this state; independent "
                                            "are 3 speeds, such as"):
        eq.linearized(about, coordinates=["z"])
    with pytest.raises(SymdynError, match="its 1 constraints have rank 0 in the speeds that are not held at the state"):
        sd.systems.get("skate").augmented().linearized(hold=["y", "theta"])
    system = sd.System("ball")
    body = system.add_body("body", mass=m, inertia=[A, A, A])
    system.add_joint(sd.Spherical("body", system.ground, body, orientation=sd.EulerAngles("ZYX", speeds="body")))
    ball = system.recursive()
    with pytest.raises(SymdynError, match="a steady motion was requested in symbols, but its quasi-velocities take part in it"):
        ball.linearized({ball.symbols.speeds[0]: 1})
