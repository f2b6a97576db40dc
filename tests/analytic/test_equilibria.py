"""Equilibria in closed form are all that there are, and are those that are found in numbers."""

import math

import numpy as np
import pytest
import sympy as sp

import symdyn as sd
from symdyn.errors import ArgumentError, SymdynError

m, g, l, k, A, Omega, T = sd.parameters("m g l k A Omega T", positive=True)


def told(points):
    return [str(point) for point in points]


def test_double_pendulum():
    eq = sd.systems.get("double_pendulum").embedding()
    found = eq.equilibria()
    assert sorted(told(found)) == ["q1 = -pi/2, q2 = 0", "q1 = -pi/2, q2 = pi", "q1 = pi/2, q2 = 0", "q1 = pi/2, q2 = pi"]
    assert all(point.proved for point in found) and len(found.assumed) == 4
    assert str(found).startswith("double_pendulum: 4 equilibria\n  q1 = ") and "taken not to be zero: g, lc2, m2" in str(found)
    assert found._repr_latex_().count(r"\\") == 3 and found[0].free == ()
    assert all(not eq.linearized(point.values).conditions for point in found)


@pytest.mark.parametrize("name", ["pendulum", "double_pendulum", "vehicle_on_rotating_track"])
def test_as_in_numbers(name):
    eq = sd.systems.get(name).recursive()
    closed = {tuple(np.round(np.array([float(p.values[q]) for q in eq.symbols.coordinates]) % (2 * np.pi), 6))
              for p in eq.equilibria(values=eq.symbols.defaults)}
    found = eq.compile(backend="numpy").equilibria(20)
    numeric = {tuple(np.round(np.asarray(e.q) % (2 * np.pi), 6) % round(2 * np.pi, 6)) for e in found}
    assert numeric == closed


def hoop():
    theta, phi = sd.coordinates("theta phi")
    system = sd.System("hoop", gravity=[0, 0, -g])
    ring, bead = system.add_body("ring", inertia=[0, 0, A]), system.add_body("bead", mass=m, com=[0, 0, -l])
    system.add_joint(sd.Revolute("drive", system.ground, ring, axis=[0, 0, 1], coordinate=phi))
    system.add_joint(sd.Revolute("arm", ring, bead, axis=[0, 1, 0], coordinate=theta))
    return system.embedding()


def test_bead_on_a_turning_hoop():
    """Strogatz, Nonlinear Dynamics and Chaos, 2nd ed., section 3.5: cos theta = g / (l Omega^2) where that is at most 1."""
    eq = hoop()
    found = eq.equilibria({"phi_dot": Omega})
    theta = next(q for q in eq.symbols.coordinates if q.name == "theta")
    angle = sp.acos(g / (l * Omega**2))
    assert [p.values[theta] for p in found] == [0, sp.pi, angle, -angle]
    assert [p.conditions for p in found] == [(), (), (g / (l * Omega**2) <= 1,), (g / (l * Omega**2) <= 1,)]
    linear = eq.linearized({theta: angle, "phi_dot": Omega}, hold=["phi"])
    assert sd.prove(linear.K[0], m * l**2 * Omega**2 - m * g**2 / Omega**2)


def test_an_arm_that_a_torque_holds():
    eq = sd.systems.get("two_link_arm").recursive()
    found = eq.equilibria({"tau1": T})
    assert len(found) == 4 and all(point.proved and point.conditions for point in found)
    for point in found:
        assert all(sd.prove(sp.expand_trig(e.lhs), 0) for e in eq.linearized({**point.values, "tau1": T}).conditions)


def test_free_coordinates_and_none_at_all():
    found = sd.systems.get("cart_pole").embedding().equilibria()
    assert told(found) == ["q2 = 0, q1 free", "q2 = pi, q1 free"]
    assert r"q_{1} \text{ free}" in found._repr_latex_()
    none = sd.systems.get("vehicle_on_track").embedding().equilibria()
    assert str(none) == "vehicle_on_track: 0 equilibria\n  would have to be zero: -g*m*sin(theta)"
    assert "no equilibrium" in none._repr_latex_()
    held = sd.systems.get("double_pendulum").embedding().equilibria({"q1": 0})
    assert told(held) == ["q2 = pi/2", "q2 = -pi/2"]


def left_over(eq, point, rng):
    """Forces at a point with random numbers for what is free and for parameters."""
    s = eq.symbols
    numbers = {x: rng.uniform(0.3, 2.0) for x in (*s.parameters, *point.free)}
    values = {q: float(sp.sympify(e).subs(numbers)) for q, e in point.values.items()}
    at = {**numbers, **values, **dict.fromkeys((*s.speeds, *s.inputs), 0.0)}
    forces = eq.F_tilde - eq.k_tilde
    if eq.constraints:
        forces += eq.C_r.T * sp.Matrix([sp.Symbol(f"lambda{k + 1}") for k in range(eq.C_r.rows)])
    return np.array(forces.subs(at), dtype=float)


def test_coordinates_that_follow_free_ones():
    """A sleigh's spring, which pulls a point on a bar that may have any direction, is slack; a link that is held by its absolute
    angle turns back as much as the one before it turns."""
    rng = np.random.default_rng(3)
    sleigh = sd.systems.get("sleigh").augmented()
    assert told(sleigh.equilibria()) == ["y = -a*sin(theta), lambda1 = 0, x free, theta free"]
    q1, q2 = sd.coordinates("q1 q2")
    alpha = sd.parameters("alpha")
    system = sd.System("held", gravity=[0, 0])
    one, two = system.add_body("one", mass=m, inertia=m), system.add_body("two", mass=m, inertia=m, com=[1, 0])
    system.add_joint(sd.Revolute("first", system.ground, one, q1))
    elbow = system.add_joint(sd.Revolute("second", one, two, q2))
    system.add_joint_force(elbow, -k * sp.sin(q1 + q2 - alpha))
    held = system.embedding()
    assert told(held.equilibria()) == ["q2 = alpha - q1, q1 free", "q2 = alpha - q1 + pi, q1 free"]
    for eq in (sleigh, held):
        for point in eq.equilibria():
            assert np.abs(left_over(eq, point, rng)).max() < 1e-12


def test_puma_at_rest_without_torques():
    """Thirty-two postures, at numbers of so many digits that products of floats do not cancel; accelerations there are zero."""
    eq = sd.systems.get("puma560").embedding()
    found = eq.equilibria(values=eq.symbols.defaults)
    assert len(found) == 32 and all(point.proved and {q.name for q in point.free} == {"q1", "q6"} for point in found)
    module, rng = eq.compile(backend="numpy"), np.random.default_rng(1)
    for point in found:
        q = [float(point.values[q]) if q in point.values else rng.uniform(-3, 3) for q in eq.symbols.coordinates]
        assert np.abs(module.rhs(0, [*q, *np.zeros(6)])).max() < 1e-12


def test_functions_of_the_position_are_named():
    eq = sd.systems.get("floating_crane").embedding()
    with pytest.raises(SymdynError, match=r"but the conditions hold S_x\(.*\), which is no polynomial; use module"):
        eq.equilibria(values=eq.symbols.defaults)


def test_what_is_no_equilibrium_is_an_error(monkeypatch):
    """Each point is put into the equations, at numbers for parameters where exact algebra cannot decide."""
    import symdyn.analytic.equilibria as place

    monkeypatch.setattr(place, "_proved", lambda e: False)
    assert len(hoop().equilibria({"phi_dot": Omega})) == 4
    monkeypatch.setattr(place._Search, "_circle", lambda self, a, b, d: [(sp.S.Zero, sp.S.One, sp.pi / 3, [])])
    with pytest.raises(SymdynError, match=r"but theta = pi/3 leaves .*, which is not zero; use module.equilibria\(\)"):
        hoop().equilibria({"phi_dot": Omega})


def test_multipliers_of_a_pendulum_by_hand():
    x, y = sd.coordinates("x y")
    eq = sd.augmented([x, y], mass=[m, m], force=[0, -m * g], constraints=[x**2 + y**2 - l**2])
    assert told(eq.equilibria()) == ["x = 0, y = l, lambda1 = -g*m/(2*l)", "x = 0, y = -l, lambda1 = g*m/(2*l)"]


def sliders(law_x, law_y):
    x, y = sd.coordinates("x y")
    system = sd.System("sliders")
    one, two = system.add_body("one", mass=m), system.add_body("two", mass=m)
    first = system.add_joint(sd.Prismatic("x", system.ground, one, axis=[1, 0, 0], coordinate=x))
    second = system.add_joint(sd.Prismatic("y", one, two, axis=[0, 1, 0], coordinate=y))
    system.add_joint_force(first, law_x(x, y))
    system.add_joint_force(second, law_y(x, y))
    return system.embedding()


def test_roots_of_polynomials():
    buckled = sliders(lambda x, y: k * x - x**3, lambda x, y: -y)
    assert told(buckled.equilibria()) == ["x = 0, y = 0", "x = sqrt(k), y = 0", "x = -sqrt(k), y = 0"]
    parted = sliders(lambda x, y: T - A * x - x**2, lambda x, y: -y)
    assert len(parted.equilibria()) == 2
    coupled = sliders(lambda x, y: x**2 + y**2 - 5, lambda x, y: x * y - 2)
    assert sorted((float(p.values[sp_x]), float(p.values[sp_y])) for p in coupled.equilibria()
                  for sp_x, sp_y in [coupled.symbols.coordinates]) == [(-2, -1), (-1, -2), (1, 2), (2, 1)]
    fifth = sliders(lambda x, y: x**5 - x - 1, lambda x, y: x - y)
    point, = fifth.equilibria()
    assert abs(float(point.values[fifth.symbols.coordinates[1]]) - 1.1673039782614187) < 1e-14 and not point.free


def test_coupled_angles_with_numbers():
    """A pendulum with a torque of twice the angle: a polynomial of degree 4 in the cosine."""
    q = sd.coordinates("q")
    system = sd.System("rod", gravity=[0, -g])
    rod = system.add_body("rod", mass=m, com=[l, 0])
    joint = system.add_joint(sd.Revolute("pivot", system.ground, rod, coordinate=q))
    system.add_joint_force(joint, 5 * sp.sin(2 * q) + 1)
    eq = system.embedding()
    found = [float(p.values[q]) for p in eq.equilibria(values={m: 1, g: 10, l: 1})]
    wanted = []
    grid = np.linspace(-np.pi, np.pi, 20001)
    f = 5 * np.sin(2 * grid) + 1 - 10 * np.cos(grid)
    for i in np.flatnonzero(f[1:] * f[:-1] < 0):
        wanted.append(grid[i] - f[i] * (grid[i + 1] - grid[i]) / (f[i + 1] - f[i]))
    assert len(wanted) >= 2 and np.allclose(sorted(found), sorted(wanted), atol=1e-6)
    with pytest.raises(SymdynError, match="stay coupled in q and are not solved in closed form; pass numbers for all parameters"):
        eq.equilibria()


def test_what_has_no_closed_form():
    transcendental = sd.systems.get("pendulum")
    q = transcendental.embedding().symbols.coordinates[0]
    joint = transcendental.joints[0]
    transcendental.add_joint_force(joint, -q)
    with pytest.raises(SymdynError, match="q1 stands within angles and outside of them, so that the conditions"):
        transcendental.embedding().equilibria()
    with pytest.raises(SymdynError, match=r"the conditions hold sqrt\(.*, which is no polynomial; use module\.equilibria\(\)"):
        sd.systems.get("flyball_governor").embedding().equilibria()
    with pytest.raises(SymdynError, match=r"sin\(k\*x\) is no sine of a sum of coordinates"):
        sliders(lambda x, y: sp.sin(k * x), lambda x, y: -y).equilibria()
    with pytest.raises(ArgumentError, match="values has x; its parameters are"):
        sd.systems.get("pendulum").embedding().equilibria(values={"x": 1})
    with pytest.raises(SymdynError, match="they do not hold at single states; fix some coordinates"):
        sliders(lambda x, y: x**2 + y**2 - 5, lambda x, y: 0).equilibria()
    ball = sd.System("ball")
    body = ball.add_body("body", mass=m, inertia=[A, A, A])
    ball.add_joint(sd.Spherical("joint", ball.ground, body, orientation=sd.EulerParameters()))
    with pytest.raises(SymdynError, match="requested of Euler parameters; describe the orientation by Euler angles"):
        ball.recursive().equilibria()


def test_time_is_bounded():
    eq = sd.systems.get("four_bar").augmented()
    with pytest.raises(SymdynError, match=r"were not found within 0.1 s; fix coordinates, give more time with seconds="):
        eq.equilibria(values=eq.symbols.defaults, seconds=0.1)
    with pytest.raises(SymdynError, match=r"were not found within 0.5 s; pass numbers for parameters with values=\.\.\., fix"):
        eq.equilibria({"q1": sp.Symbol("alpha", real=True)}, seconds=0.5)


@pytest.mark.parametrize("seconds", [0, -1.0, float("nan"), float("inf"), 1e300, "3", True, [1.0], 1j])
def test_seconds_that_are_no_positive_number(seconds):
    with pytest.raises(ArgumentError, match="pendulum: seconds must be a positive number"):
        sd.systems.pendulum().embedding().equilibria(seconds=seconds)


def test_bounds_on_cases_and_angles(monkeypatch):
    q = sd.coordinates("q")
    system = sd.System("rod", gravity=[0, -g])
    rod = system.add_body("rod", mass=m, com=[l, 0])
    joint = system.add_joint(sd.Revolute("pivot", system.ground, rod, coordinate=q))
    system.add_joint_force(joint, k * sp.sin(q + Omega))
    with pytest.raises(SymdynError, match="2 angles that are no sums of each other depend on 1 coordinates; put numbers"):
        system.embedding().equilibria()
    monkeypatch.setattr("symdyn.analytic.equilibria.CASES", 2)
    with pytest.raises(SymdynError, match="equilibria in closed form have more than 2 cases; fix coordinates"):
        sd.systems.get("double_pendulum").embedding().equilibria()


def test_decimal_numbers_stand_for_themselves():
    found = sliders(lambda x, y: k * x - x**3, lambda x, y: -y).equilibria(values={k: 0.25})
    assert sorted(told(found)) == ["x = -1/2, y = 0", "x = 0, y = 0", "x = 1/2, y = 0"]


def test_quasi_velocities():
    """The positions at rest of a body that hangs, without the singular ones of its angles."""
    system = sd.System("buoy", gravity=[0, 0, -g])
    body = system.add_body("buoy", mass=m, inertia=[A, A, A], com=[0, 0, -l])
    system.add_joint(sd.Spherical("pivot", system.ground, body, orientation=sd.EulerAngles("ZYX", speeds="body")))
    eq = system.recursive()
    found = eq.equilibria()
    z, y, x = eq.symbols.coordinates
    assert {(p.values[y], p.values[x]) for p in found} == {(0, 0), (sp.pi, sp.pi), (0, sp.pi), (sp.pi, 0)}
    assert all(p.free == (z,) for p in found)
    with pytest.raises(SymdynError, match="that are held, but its speeds are quasi-velocities; leave speeds='body' out"):
        eq.equilibria({y: 0})


def test_held_coordinates():
    eq = sd.systems.two_link_arm().embedding()
    assert str(eq.equilibria(fixed={"q1": 0, "q2": 0})).splitlines() == [
        "two_link_arm: 1 equilibrium", "  the coordinates that are held are at rest"]
    with pytest.raises(ArgumentError, match=r"fixed is \['q1'\]; pass a dict such as"):
        eq.equilibria(fixed=["q1"])
    with pytest.raises(ArgumentError, match="fixed has q9; it takes q1, q2, q1_dot, q2_dot, tau1, tau2"):
        eq.equilibria(fixed={"q9": 0})


def test_loops_with_a_held_crank_are_closed():
    """Four bars with numbers: the two positions of the loop, and multipliers that balance the weights, to 50 digits."""
    eq = sd.systems.get("four_bar").augmented()
    q1, q2, q3 = eq.symbols.coordinates
    numbers = {p: sp.Rational(str(value)) for p, value in eq.symbols.defaults.items()}
    found = eq.equilibria(fixed={"q1": sp.pi / 3}, values=eq.symbols.defaults)
    assert len(found) == 2
    lengths = {p.name: value for p, value in numbers.items()}
    positions = set()
    for point in found:
        here = {**numbers, q1: sp.pi / 3, **{q: e for q, e in point.values.items() if q in (q2, q3)},
                **dict.fromkeys(eq.symbols.speeds, 0)}
        lam = sp.Matrix([e for s, e in point.values.items() if s.name.startswith("lambda")])
        C, C_r, F = (e.subs(here).evalf(50) for e in (eq.C, eq.C_r, eq.F_tilde))
        assert max(abs(e) for e in C) < 1e-45
        assert max(abs(e) for e in (F - C_r.T * lam.evalf(50))[1:]) < 1e-42
        angle = sp.N(here[q1] + here[q2], 50)
        positions.add(round(float(sp.atan2(sp.sin(angle), sp.cos(angle))), 9))
        # Freudenstein, Approximate synthesis of four-bar linkages, Trans. ASME 77 (1955).
        coupler = (lengths["l1"] * sp.cos(here[q1]) + lengths["l2"] * sp.cos(angle) - lengths["d"]) ** 2 \
            + (lengths["l1"] * sp.sin(here[q1]) + lengths["l2"] * sp.sin(angle)) ** 2
        assert abs(sp.N(coupler - lengths["l3"] ** 2, 50)) < 1e-45
    assert len(positions) == 2


def test_four_bars_have_all_equilibria_of_the_numeric_search():
    """With numbers the cosine of an angle is a root of a polynomial of degree six, by resultants."""
    eq = sd.systems.get("four_bar").augmented()
    found = eq.equilibria(values=eq.symbols.defaults, seconds=120)
    numeric = eq.compile().equilibria(starts=12)
    coordinates = eq.symbols.coordinates

    def turns(angles):
        return tuple(round(value, 7) for angle in angles for value in (math.sin(angle), math.cos(angle)))

    assert len(found) == 4 and not any(point.proved or point.free for point in found)
    # With digits for the roots first, which SymPy does in a fraction of the time.
    values = [{x: e.xreplace({root: root.evalf(90) for root in e.atoms(sp.CRootOf)}).evalf(60, chop=True)
               for x, e in point.values.items()} for point in found]
    closed = {turns(float(at[q]) for q in coordinates) for at in values}
    assert closed == {turns(float(point.q[k]) for k in range(3)) for point in numeric}
    here = {**{p: sp.Rational(str(value)) for p, value in eq.symbols.defaults.items()}, **dict.fromkeys(eq.symbols.speeds, 0)}
    for at in values:
        lam = sp.Matrix([e for x, e in at.items() if x not in coordinates])
        C, left = (e.subs({**here, **at}).evalf(40) for e in (eq.C, eq.F_tilde - eq.C_r.T * lam))
        assert max(map(abs, [*C, *left])) < 1e-35
