"""Points, orientations and distances in expressions, against closed forms, rotation matrices of SciPy, and joints."""

from __future__ import annotations

import pickle

import numpy as np
import pytest
import sympy as sp
from scipy.spatial.transform import Rotation

import symdyn as sd
from symdyn.errors import ModelError

q1, q2, x, y, theta = sd.coordinates("q1 q2 x y theta")
m, l, g, k, c, r = sd.parameters("m l g k c r")
BACKENDS = ("numpy", "c")


def double_pendulum(gravity=True):
    """Two massless links of length l with a point mass m at the end of each, in the plane, angles from the x axis."""
    system = sd.System("double_pendulum", gravity=(0, -g) if gravity else (0, 0))
    first, second = system.add_body("first", m, 0, (l, 0)), system.add_body("second", m, 0, (l, 0))
    system.add_joint(sd.Revolute("shoulder", "ground", first, q1))
    system.add_joint(sd.Revolute("elbow", first, second, q2, parent_point=(l, 0)))
    system.defaults = {m: 2, l: 0.7, **({g: 9.81} if gravity else {})}
    return system, first, second


def body_in_space():
    """A free body with Euler angles, and an arm on a skew hinge; returns the place of a point of the arm in numbers."""
    coordinates = sd.coordinates("X Y Z psi tilt phi")
    system = sd.System("in_space", gravity=(0, 0, -9.81))
    hull, arm = system.add_body("hull", 3, (1, 2, 3)), system.add_body("arm", 1, (0.1, 0.2, 0.2), (0.3, 0, 0))
    system.add_joint(sd.Free("free", "ground", hull, coordinates, sd.EulerAngles("ZYX")))
    axis = (0, sp.Rational(3, 5), sp.Rational(4, 5))
    system.add_joint(sd.Revolute("hinge", hull, arm, q1, axis=axis, parent_point=(0.1, 0.2, 0.3)))

    def place(state, point):
        turned = Rotation.from_euler("ZYX", state[3:6])
        own = turned * Rotation.from_rotvec(state[6] * np.array([0, 0.6, 0.8]))
        return state[:3] + turned.apply([0.1, 0.2, 0.3]) + own.apply(point), own.as_matrix()

    return system, arm, place


@pytest.mark.parametrize("backend", BACKENDS)
def test_points_and_orientations_are_those_of_rotation_matrices(backend):
    system, arm, place = body_in_space()
    point = (0.4, -0.1, 0.25)
    p, v, R, w = sd.position(arm, point), sd.velocity(arm, point), sd.rotation_matrix(arm), sd.angular_velocity(arm)
    for name, values in (("p", [p[0], p[1], p[2]]), ("v", [v[0], v[1], v[2]]), ("R", list(R)), ("w", list(w)),
                         ("R_dot", [e.dot for e in R]), ("v_too", [p[i].dot for i in range(3)])):
        system.add_output(name, values)
    system.add_output("d", [sd.distance("ground", arm, (1, 2, 3), point), sd.distance("ground", arm, (1, 2, 3), point).dot])
    module = system.recursive().compile(backend)
    stream = np.random.default_rng(4)
    q, u = stream.uniform(-0.8, 0.8, 7), stream.uniform(-1, 1, 7)
    found = module.outputs(0, [*q, *u])
    h = 1e-5
    at, matrix = place(q, point)
    before, after = place(q - h * u, point), place(q + h * u, point)
    velocity, change = (after[0] - before[0]) / (2 * h), (after[1] - before[1]) / (2 * h)
    spin = change @ matrix.T
    np.testing.assert_allclose(found["p"], at, atol=1e-14)
    np.testing.assert_allclose(found["R"], matrix.ravel(), atol=1e-14)
    np.testing.assert_allclose(found["v"], velocity, atol=1e-9)
    np.testing.assert_allclose(found["v_too"], found["v"], atol=1e-15)
    np.testing.assert_allclose(found["w"], [spin[2, 1], spin[0, 2], spin[1, 0]], atol=1e-9)
    np.testing.assert_allclose(found["R_dot"], change.ravel(), atol=1e-9)
    away = at - [1, 2, 3]
    np.testing.assert_allclose(found["d"], [np.linalg.norm(away), away @ velocity / np.linalg.norm(away)], atol=1e-9)


def test_accelerations_in_outputs_are_derivatives_of_velocities_along_the_motion():
    system, arm, _ = body_in_space()
    point = (0.4, -0.1, 0.25)
    speeds = [sd.velocity(arm, point)[0], sd.angular_velocity(arm)[1], sd.distance("ground", arm, (1, 2, 3), point).dot,
              sd.rotation_matrix(arm)[0, 2].dot]
    system.add_output("speeds", speeds)
    system.add_output("accelerations", [s.dot for s in speeds])
    system.add_torque(arm, (1, 2, 3))
    module = system.embedding().compile()
    stream = np.random.default_rng(5)
    start = np.concatenate([stream.uniform(-0.8, 0.8, 7), stream.uniform(-1, 1, 7)])
    h = 1e-4
    solution = module.simulate(np.array([0, h, 2 * h]), start[:7], start[7:], rtol=1e-12, atol=1e-14)
    values = solution.outputs["speeds"]
    np.testing.assert_allclose(solution.outputs["accelerations"][1], (values[2] - values[0]) / (2 * h), rtol=1e-6)


@pytest.mark.every_value
@pytest.mark.parametrize("formulation", ("embedding", "recursive", "augmented"))
@pytest.mark.parametrize("backend", BACKENDS)
def test_forces_by_points_are_those_by_coordinates(formulation, backend):
    by_points, _, second = double_pendulum()
    end, velocity = sd.position(second, (l, 0)), sd.velocity(second, (l, 0))
    by_points.add_force(second, [-k * end[0] - c * velocity[0], sp.Piecewise((-k * end[1], end[1] < 0), (0, True))], (l, 0))
    by_points.add_joint_force("shoulder", -c * sd.angular_velocity(second)[2] * sd.rotation_matrix(second)[0, 0])
    by_hand, _, other = double_pendulum()
    X, Y = l * sp.cos(q1) + l * sp.cos(q1 + q2), l * sp.sin(q1) + l * sp.sin(q1 + q2)
    V = -l * sp.sin(q1) * q1.dot - l * sp.sin(q1 + q2) * (q1.dot + q2.dot)
    by_hand.add_force(other, [-k * X - c * V, sp.Piecewise((-k * Y, Y < 0), (0, True))], (l, 0))
    by_hand.add_joint_force("shoulder", -c * (q1.dot + q2.dot) * sp.cos(q1 + q2))
    states = np.random.default_rng(6).uniform(-1.5, 1.5, (6, 4))
    one, two = (getattr(s, formulation)().compile(backend) for s in (by_points, by_hand))
    numbers = {"k": 3, "c": 0.4}
    for state in states:
        np.testing.assert_allclose(one.rhs(0, state, numbers), two.rhs(0, state, numbers), rtol=1e-12, atol=1e-12)
        np.testing.assert_allclose(one.jacobian(0, state, numbers).x, two.jacobian(0, state, numbers).x, rtol=1e-10, atol=1e-10)
    linear = [module.linearize(states[0], numbers).A for module in (one, two)]
    np.testing.assert_allclose(*linear, rtol=1e-10, atol=1e-10)


def test_equations_with_points_pass_their_own_verification():
    system, first, second = double_pendulum()
    d = sd.distance(first, second, (0, l), (l, 0))
    system.add_force_between(first, second, sp.Max(0, k * (d - l) + c * d.dot), (0, l), (l, 0))
    system.add_constraint(sd.position(second, (l, 0))[1] + l * sp.cos(sd.t), "track")
    equations = system.augmented()
    assert equations.constraints == ("track",) and equations.holonomic == (True,)
    assert equations.verify().passed


def test_a_force_between_is_a_spring_damper():
    spring, a, b = double_pendulum()
    spring.add_spring_damper(a, b, (0, l), (l, 0), k, c, r)
    law, a_2, b_2 = double_pendulum()
    d = sd.distance(a_2, b_2, (0, l), (l, 0))
    law.add_force_between(a_2, b_2, k * (d - r) + c * d.dot, (0, l), (l, 0))
    one, two = spring.embedding().compile(), law.embedding().compile()
    state, numbers = [0.3, 0.8, 1.1, -2.0], {"k": 30, "c": 2, "r": 0.3}
    np.testing.assert_allclose(one.rhs(0, state, numbers), two.rhs(0, state, numbers), rtol=1e-13)


def test_a_rope_only_pulls():
    """A mass that is thrown up from the end of a slack elastic rope: free flight, then half an oscillation, then free flight."""
    length, k_rope, v = 0.5, 400.0, 4.0
    system = sd.System("rope", gravity=(0, 0))
    ball = system.add_body("ball", 1)
    system.add_joint(sd.Prismatic("up", "ground", ball, x, axis=(0, 1, 0)))
    d = sd.distance("ground", ball)
    system.add_force_between("ground", ball, sp.Max(0, k_rope * (d - length)))
    system.add_event("taut", sd.distance("ground", ball) - length, direction=1)
    module = system.embedding().compile()
    solution = module.simulate(np.linspace(0, 0.32, 33), [0.1], [v], rtol=1e-11, atol=1e-13)
    taut = (length - 0.1) / v
    back = taut + np.pi / np.sqrt(k_rope)
    np.testing.assert_allclose(solution.events["taut"].t, [taut], rtol=1e-9)
    late = solution.t > back
    np.testing.assert_allclose(solution.x[late, 0], length - v * (solution.t[late] - back), atol=1e-8)
    assert solution.x[:, 0].max() == pytest.approx(length + v / np.sqrt(k_rope), rel=1e-2)


def test_a_point_on_a_circle_is_a_rod():
    plain = sd.System("circle", gravity=(0, -g))
    ball = plain.add_body("ball", m, m)
    plain.add_joint(sd.Planar("plane", "ground", ball, (x, y, theta)))
    plain.add_constraint(sd.distance("ground", ball, (0.2, 0.1), (0.3, 0)) - l, "circle")
    rod = sd.System("rod", gravity=(0, -g))
    ball = rod.add_body("ball", m, m)
    rod.add_joint(sd.Planar("plane", "ground", ball, (x, y, theta)))
    rod.close_loop(sd.Rod("rod", "ground", ball, l, (0.2, 0.1), (0.3, 0)))
    angle, turn = 0.4, 0.7
    end = np.array([0.2, 0.1]) + 1.3 * np.array([np.cos(angle), np.sin(angle)])
    at = end - 0.3 * np.array([np.cos(turn), np.sin(turn)])
    u = [0.0, 0.0, 0.0]
    one, two = plain.augmented().compile(), rod.augmented().compile()
    numbers = {"m": 2, "g": 9.81, "l": 1.3}
    np.testing.assert_allclose(one.rhs(0, [*at, turn, *u], numbers), two.rhs(0, [*at, turn, *u], numbers), rtol=1e-12, atol=1e-12)


def rolling(by_points):
    """A disc of radius r that rolls on the plane z = 0: its contact is a constraint of positions, rolling of velocities."""
    X, Y, Z, alpha, beta, gamma = coordinates = sd.coordinates("X Y Z alpha beta gamma")
    omega = sd.speeds("omega_x omega_y omega_z")
    system = sd.System("disc", gravity=(0, 0, -g))
    disc = system.add_body("disc", m, (m * r**2 / 4, m * r**2 / 4, m * r**2 / 2))
    system.add_joint(sd.Free("free", "ground", disc, coordinates, sd.EulerAngles("ZXZ", speeds="body"),
                             [X.dot, Y.dot, Z.dot, *omega]))
    if by_points:
        R, w, v = sd.rotation_matrix(disc), sd.angular_velocity(disc), sd.velocity(disc)
        normal = R[:, 2]
        # The lowest point: from the centre along the part of the vertical in the disc's plane.
        down = sp.Matrix([0, 0, -1]) + normal * normal[2]
        contact = down * (r / sp.sqrt(1 - normal[2]**2))
        slip = sp.Matrix([v[0], v[1], v[2]]) + sp.Matrix(w).cross(contact)
        system.add_constraint(sd.position(disc)[2] - r * sp.sqrt(1 - normal[2]**2), "contact")
        system.add_constraint(slip[0], "along")
        system.add_constraint(slip[1], "across")
    else:
        s, co = sp.sin, sp.cos
        R = sp.rot_ccw_axis3(alpha) * sp.rot_ccw_axis1(beta) * sp.rot_ccw_axis3(gamma)
        w = R * sp.Matrix(omega)
        contact = r * sp.Matrix([s(alpha) * co(beta), -co(alpha) * co(beta), -s(beta)])
        slip = sp.Matrix([X.dot, Y.dot, Z.dot]) + w.cross(contact)
        system.add_constraint(Z - r * s(beta), "contact")
        system.add_constraint(slip[0], "along")
        system.add_constraint(slip[1], "across")
    system.defaults = {m: 2, g: 9.81, r: 0.4}
    return system.augmented().compile()


def test_rolling_is_a_constraint_of_velocities_of_points():
    one, two = rolling(True), rolling(False)
    q = np.array([0.1, 0.2, 0.4 * np.sin(1.1), 0.3, 1.1, 0.7])
    for u in np.random.default_rng(7).uniform(-2, 2, (3, 6)):
        start = np.concatenate(two.consistent(q, u))
        np.testing.assert_allclose(one.rhs(0, start), two.rhs(0, start), rtol=1e-10, atol=1e-10)


def test_quantities_stand_in_states_resets_and_absolute_coordinates():
    system, _, second = double_pendulum()
    z = sd.coordinates("z")
    system.add_state(z, sd.position(second, (l, 0))[0])
    system.add_event("low", sd.position(second, (l, 0))[1] + l, reset={z: sd.distance("ground", second)})
    system.add_output("tip", sd.position(second, (l, 0))[0])
    module = system.embedding().compile()
    state = [0.3, 0.4, 0, 0, 0]
    assert module.rhs(0, state)[4] == pytest.approx(0.7 * (np.cos(0.3) + np.cos(0.7)), rel=1e-14)
    absolute = system.augmented(coordinates="absolute").compile()
    names = absolute.metadata.x
    at = dict.fromkeys(names, 0.0)
    at.update(x_first=0, theta_first=0.3, x_second=0.7 * np.cos(0.3), y_second=0.7 * np.sin(0.3), theta_second=0.7)
    found = absolute.outputs(0, [at[name] for name in names])["tip"]
    assert found == pytest.approx(0.7 * (np.cos(0.3) + np.cos(0.7)), rel=1e-14)


def test_a_mass_released_at_the_height_of_an_event():
    system = sd.System("ball", gravity=(0, -10))
    ball = system.add_body("ball", 1, 1)
    system.add_joint(sd.Planar("plane", "ground", ball, (x, y, theta)))
    system.add_event("floor", sd.position(ball, (0, sp.Rational(-1, 2)))[1], -1, stop=True)
    solution = system.embedding().compile().simulate(np.linspace(0, 5, 3), [0, 5.5, 0], [0, 0, 0])
    assert solution.events["floor"].t == pytest.approx([1.0], rel=1e-9)


def test_symbols_of_quantities():
    _, first, second = double_pendulum()
    p = sd.position(second, (l, 0))
    assert p[0] == sd.position("second", (l, 0))[0] and p[0] != p[1] and p[0] != sd.position(second)[0]
    assert p[0].dot == sd.velocity(second, (l, 0))[0] and p[0].ddot == sd.acceleration(second, (l, 0))[0]
    assert str(p[0]) == "position(second, (l, 0, 0))[0]" and str(sd.velocity(first)[1]) == "velocity(first)[1]"
    assert str(sd.distance(first, second, point_b=(l, 0)).dot) == "distance(first, second, point_b=(l, 0, 0)).dot"
    assert str(sd.rotation_matrix(first)[0, 1]) == "rotation_matrix(first)[0, 1]"
    assert str(sd.reaction("elbow", first)[5]) == "reaction(elbow, frame=first)[5]"
    assert (p[0].unit, p[0].dot.unit, sd.angular_velocity(first)[2].unit, sd.reaction("elbow")[4].unit) == (
        "m", "m/s", "rad/s", "N m")
    assert pickle.loads(pickle.dumps(p[0] + k)) == p[0] + k
    assert sp.latex(p[1]) == r"r_{\mathrm{second},y}\left(l, 0, 0\right)"
    assert sp.latex(sd.angular_velocity("a_b")[2]) == r"\omega_{\mathrm{a\_b},z}"
    assert sp.latex(sd.angular_velocity("a")[2].dot) == r"\dot{\omega}_{\mathrm{a},z}"
    assert sp.latex(sd.distance("a", "b").dot) == r"\dot{d}_{\mathrm{a},\mathrm{b}}"
    assert sp.latex(sd.rotation_matrix("a")[0, 2]) == r"R_{\mathrm{a},13}"
    assert sp.latex(sd.multiplier("n")) == r"\lambda_{\mathrm{n}}" and sp.latex(sd.reaction("j")[4]) == r"M_{\mathrm{j},y}"
    assert sp.latex(sd.velocity("a")[0]) == r"v_{\mathrm{a},x}"


def faults(make):
    with pytest.raises(ModelError) as error:
        make()
    return str(error.value)


def described(change):
    def make():
        system, first, second = double_pendulum()
        change(system, first, second)
        return system.check()
    return make


@pytest.mark.parametrize(("change", "words"), [
    (lambda s, a, b: s.add_force(a, [sd.position("arm")[0], 0]), "body of position(arm)[0] is 'arm', which is no "
     "body of the system"),
    (lambda s, a, b: s.add_force(a, [sd.position(b)[2], 0]), "uses position(second)[2], which is zero in a planar system; "
     "components there are [0], [1]"),
    (lambda s, a, b: s.add_force(a, [sd.angular_velocity(b)[0], 0]), "components there are [2]"),
    (lambda s, a, b: s.add_force(a, [1, 0], (sd.position(b)[0], 0)), "depends on position(second)[0], but must be constant"),
    (lambda s, a, b: s.add_force(a, [sd.position(b, (q1, 0))[0], 0]), "point of position(second, (q1, 0, 0))[0] depends on q1"),
    (lambda s, a, b: s.add_constraint(sd.acceleration(b)[0]), "uses acceleration(second)[0], which follows from the forces"),
    (lambda s, a, b: s.add_constraint(sd.velocity(b)[0] * sd.velocity(a)[1]), "is not linear in the speed velocity(first)[1]"),
    (lambda s, a, b: s.add_constraint(sd.velocity(b)[0] * q1.dot), "is not linear in the speed"),
    (lambda s, a, b: s.add_output("w", sd.reaction("knee")[0]), "uses reaction(knee)[0], but the system has no joint 'knee'; "
     "joints: shoulder, elbow"),
    (lambda s, a, b: s.add_output("w", sd.reaction("elbow", "arm")[0]), "frame of reaction(elbow, frame=arm)[0] is 'arm'"),
    (lambda s, a, b: s.add_output("w", sd.reaction("elbow")[2]), "components there are [0], [1], [5]"),
    (lambda s, a, b: s.add_joint(sd.Prismatic("slide", b, s.add_body("c", 1), sd.position(a)[0])),
     "it may use coordinates, t and parameters"),
    (lambda s, a, b: s.move_ground((sd.position(a)[0], 0)), "uses position(first)[0]"),
])
def test_faults_of_quantities(change, words):
    assert words in faults(described(change))


def test_faults_when_a_quantity_is_made():
    assert "sd.position was given 3" in faults(lambda: sd.position(3)[0])
    assert "sd.distance was given q1" in faults(lambda: sd.distance(q1, "a"))
    assert "component 0 of a point's jacobian is requested" in faults(lambda: sd.jacobian("a")[0])
    assert "sd.position: point of a has 1 components" in faults(lambda: sd.position("a", (1,))[0])
    assert "the derivative of acceleration(a)[0] by time is requested" in faults(lambda: sd.acceleration("a")[0].dot)
    assert "the derivative of multiplier(c) by time" in faults(lambda: sd.multiplier("c").dot)
    with pytest.raises(IndexError, match="component 3 of a point's position; there are 0, 1 and 2"):
        sd.position("a")[3]


def test_points_that_coincide_have_no_distance():
    system, first, second = double_pendulum()
    system.add_output("d", sd.distance(first, second, (l, 0)))
    with pytest.raises(ModelError, match="its two ends are the same point at every position"):
        system.embedding().quantity("d")


def test_explicit_descriptions_take_no_quantities():
    with pytest.raises(ModelError, match="there are no bodies"):
        sd.embedding([q1], [l * q1], [m], [sd.position("a")[0]])


def test_a_derivative_by_a_coordinate_is_rejected():
    height = sd.position("bob", [0.1, 0])[1]
    with pytest.raises(ModelError, match=r"the derivative of position\(bob.*\)\[1\] by q1 is requested, which is not known"):
        height.diff(q1)
    assert (height**2).diff(sd.t) == 2 * height * height.dot and height.diff(height) == 1
