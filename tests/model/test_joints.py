"""Every joint type: where it puts the child, and velocities and accelerations that are the derivatives of that.

Derivatives by time are central differences at 80 digits with steps of 1e-20, so that they are good to more than 30 digits.
"""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any

import mpmath
import numpy as np
import pytest
import sympy as sp

import symdyn as sd
from symdyn.formulation.trees.embedding import EmbeddedEquations
from symdyn.model.orientation import SEQUENCES
from tests import helpers
from tests.helpers import swept

half = sp.Rational(1, 2)
SKEW = sp.Matrix([[2, -1, 2], [2, 2, -1], [-1, 2, 2]]) / 3
QUARTER = sp.Matrix([[0, 0, 1], [1, 0, 0], [0, 1, 0]])
AXES = {"x": [1, 0, 0], "y": [0, 1, 0], "-z": [0, 0, -1], "3-4": [0.6, 0, 0.8],
        "1-2-2": [sp.Rational(1, 3), sp.Rational(2, 3), sp.Rational(2, 3)],
        "diagonal": list(np.ones(3) / np.sqrt(3)), "root": [1 / sp.sqrt(2), 0, -1 / sp.sqrt(2)]}
PLACE: dict[str, Any] = {"parent_point": [0.5, -0.2, 0.3], "child_point": [0.1, 0.4, -0.6], "parent_rotation": SKEW,
                         "child_rotation": QUARTER}
a, b, c = sd.coordinates("a b c")
x, y, z = sd.coordinates("x y z")
e = sd.coordinates("e0:4")


def turn(axis: int, angle: Any) -> sp.Matrix:
    """The elementary rotation, child to parent components."""
    matrix = sp.eye(3)
    i, j = [(1, 2), (2, 0), (0, 1)][axis]
    matrix[i, i] = matrix[j, j] = sp.cos(angle)
    matrix[j, i], matrix[i, j] = sp.sin(angle), -sp.sin(angle)
    return matrix


def about(axis: list, angle: Any) -> sp.Matrix:
    """The rotation about any axis as the exponential of its cross-product matrix."""
    n = sp.Matrix(axis) / sp.Matrix(axis).norm()
    K = sp.Matrix([[0, -n[2], n[1]], [n[2], 0, -n[0]], [-n[1], n[0], 0]])
    return sp.eye(3) + sp.sin(angle) * K + (1 - sp.cos(angle)) * K**2


def quaternion() -> sp.Matrix:
    return sp.Quaternion(*e).to_rotation_matrix().subs(sum(s**2 for s in e), 1)


def sequence(name: str) -> sp.Matrix:
    return turn("XYZ".index(name[0]), a) * turn("XYZ".index(name[1]), b) * turn("XYZ".index(name[2]), c)


Make = Callable[..., Any]
# name -> (joint from (name, parent, child, place), rotation, displacement)
JOINTS: dict[str, tuple[Make, Any, Any]] = {
    "fixed": (lambda *n, **p: sd.Fixed(*n, **p), sp.eye(3), [0, 0, 0]),
    **{f"revolute {name}": (lambda *n, axis=axis, **p: sd.Revolute(*n, a, axis=axis, **p), about(axis, a), [0, 0, 0])
       for name, axis in AXES.items()},
    "revolute z": (lambda *n, **p: sd.Revolute(*n, a, **p), turn(2, a), [0, 0, 0]),
    **{f"prismatic {name}": (lambda *n, axis=axis, **p: sd.Prismatic(*n, x, axis=axis, **p), sp.eye(3), sp.Matrix(axis) * x)
       for name, axis in AXES.items()},
    "cylindrical": (lambda *n, **p: sd.Cylindrical(*n, [a, x], **p), turn(2, a), [0, 0, x]),
    "cylindrical 3-4": (lambda *n, **p: sd.Cylindrical(*n, [a, x], axis=AXES["3-4"], **p), about(AXES["3-4"], a),
                        sp.Matrix(AXES["3-4"]) * x),
    "helical": (lambda *n, **p: sd.Helical(*n, a, pitch=0.3, **p), turn(2, a), [0, 0, sp.Rational(3, 10) * a]),
    "helical 1-2-2": (lambda *n, **p: sd.Helical(*n, a, axis=AXES["1-2-2"], pitch=-1 / sp.pi, **p), about(AXES["1-2-2"], a),
                      -sp.Matrix(AXES["1-2-2"]) * a / sp.pi),
    "universal": (lambda *n, **p: sd.Universal(*n, [a, b], **p), turn(0, a) * turn(1, b), [0, 0, 0]),
    "universal skew": (lambda *n, **p: sd.Universal(*n, [a, b], axes=[AXES["3-4"], AXES["1-2-2"]], **p),
                       about(AXES["3-4"], a) * about(AXES["1-2-2"], b), [0, 0, 0]),
    "planar": (lambda *n, **p: sd.Planar(*n, [x, y, a], **p), turn(2, a), [x, y, 0]),
    "spherical": (lambda *n, **p: sd.Spherical(*n, [a, b, c], **p), sequence("ZYX"), [0, 0, 0]),
    **{f"spherical {s}": (lambda *n, s=s, **p: sd.Spherical(*n, [a, b, c], sd.EulerAngles(s), **p), sequence(s), [0, 0, 0])
       for s in SEQUENCES},
    **{f"spherical {s} body": (lambda *n, s=s, **p: sd.Spherical(*n, [a, b, c], sd.EulerAngles(s, "body"), **p), sequence(s),
                               [0, 0, 0]) for s in ("ZYX", "XZY", "ZXZ", "YZY")},
    "spherical parameters": (lambda *n, **p: sd.Spherical(*n, e, sd.EulerParameters(), **p), quaternion(), [0, 0, 0]),
    "free": (lambda *n, **p: sd.Free(*n, [x, y, z, a, b, c], **p), sequence("ZYX"), [x, y, z]),
    "free XZX": (lambda *n, **p: sd.Free(*n, [x, y, z, a, b, c], sd.EulerAngles("XZX"), **p), sequence("XZX"), [x, y, z]),
    "free parameters": (lambda *n, **p: sd.Free(*n, [x, y, z, *e], sd.EulerParameters(), **p), quaternion(), [x, y, z]),
    "free body": (lambda *n, **p: sd.Free(*n, [x, y, z, a, b, c], velocity="body", **p), sequence("ZYX"), [x, y, z]),
    "free YXY body": (lambda *n, **p: sd.Free(*n, [x, y, z, a, b, c], sd.EulerAngles("YXY", "body"), velocity="body", **p),
                      sequence("YXY"), [x, y, z]),
    "free parameters body": (lambda *n, **p: sd.Free(*n, [x, y, z, *e], sd.EulerParameters(), velocity="body", **p),
                             quaternion(), [x, y, z]),
    "custom on a parabola": (lambda *n, **p: sd.Custom(*n, [x], turn(2, sp.atan(2 * x)), [x, x**2, 0], **p),
                             turn(2, sp.atan(2 * x)), [x, x**2, 0]),
    "custom turned at zero": (lambda *n, **p: sd.Custom(*n, [a], turn(0, half) * turn(2, a + 1), [half, 2, 1], **p),
                              turn(0, half) * turn(2, a + 1), [half, 2, 1]),
    "custom 3": (lambda *n, **p: sd.Custom(*n, [a, x, b], turn(1, a) * turn(2, x * b), [sp.sin(a) * x, b * a, sp.exp(x)], **p),
                 turn(1, a) * turn(2, x * b), [sp.sin(a) * x, b * a, sp.exp(x)]),
}


def test_joints_stand_in_the_order_in_which_they_were_added_where_parents_come_first() -> None:
    """Two links in a row, then one next to the first; with a joint that is added before its parent's the order is by depth."""
    for added, wanted in (("ABC", "ABC"), ("BAC", "ACB")):
        s = sd.System("order")
        bodies = {name: s.add_body(name, mass=1, inertia=[1, 1, 1]) for name in "abc"}
        for name in added:
            parent = bodies["a"] if name == "B" else s.ground
            s.add_joint(sd.Revolute(name, parent, bodies[name.lower()]))
        assert "".join(s.embedding().compile(backend="numpy").simulate((0, 0.1)).reactions) == wanted


@functools.cache
def mechanism(name: str, moving: bool = True) -> EmbeddedEquations:
    """A body on the joint, on a base that slides and turns about a skew axis; or in its place on the ground."""
    s = sd.System("mechanism", gravity=[0, 0, -9.81])
    base = s.add_body("base", mass=2, inertia=[1, 2, 2.5])
    box = s.add_body("box", mass=3, inertia=[2, 3, 4], com=[0.3, -0.1, 0.2])
    if moving:
        s.add_joint(sd.Cylindrical("drive", s.ground, base, sd.coordinates("p s"), axis=AXES["1-2-2"],
                                   child_point=[0.1, 0, 0.7]))
    else:
        s.add_joint(sd.Fixed("drive", s.ground, base))
        s.add_state(sd.coordinates("w"), 0)  # so that a fixed joint leaves something to compute
    s.add_joint(JOINTS[name][0]("joint", base, box, **(PLACE if moving else {})))
    return s.embedding()


def velocities(equations: EmbeddedEquations, values: dict[str, Any]) -> np.ndarray:
    (J,) = helpers.quantities(equations, values, "J", digits=helpers.HIGH)
    with mpmath.workdps(helpers.HIGH):
        return J @ np.array([helpers.number(values[u.name]) for u in equations.symbols.speeds], dtype=object)


# Every sequence of angles is that of tests of rotations and of joint types; axes of each kind of numbers are enough.
OTHERS = [*(f"spherical {sequence}" for sequence in SEQUENCES if sequence not in ("XYX", "YZX", "ZXZ", "ZYX")),
          *(name for name in JOINTS if name.split()[-1] in ("y", "-z", "3-4"))]


@pytest.fixture(params=swept(JOINTS, *(name for name in JOINTS if name not in OTHERS)))
def name(request: pytest.FixtureRequest) -> str:
    return request.param


@pytest.mark.every_value
@pytest.mark.parametrize("seed", swept([1, 2], 1))
def test_velocities_are_derivatives_of_positions(name: str, seed: int) -> None:
    equations = mechanism(name)
    values = helpers.state(equations, seed)
    v = velocities(equations, values).reshape(2, 6)
    with mpmath.workdps(helpers.HIGH):
        assert helpers.close(v[:, :3], helpers.by_time(equations, values, "positions"))
        (frames,) = helpers.quantities(equations, values, "frames", digits=helpers.HIGH)
        R, R_dot = frames[:, 3:].reshape(2, 3, 3), helpers.by_time(equations, values, "frames")[:, 3:].reshape(2, 3, 3)
        for body in range(2):
            assert helpers.close(R[body] @ R[body].T, np.eye(3, dtype=int))
            assert helpers.close(np.cross(R[body][0], R[body][1]), R[body][2])
            W = R_dot[body] @ R[body].T
            assert helpers.close(W, -W.T)
            assert helpers.close(v[body, 3:], np.array([W[2, 1], W[0, 2], W[1, 0]]))


@pytest.mark.parametrize("seed", [3])
def test_accelerations_are_derivatives_of_velocities(name: str, seed: int) -> None:
    equations = mechanism(name)
    values = helpers.state(equations, seed)
    with mpmath.workdps(helpers.HIGH):
        later, earlier = (velocities(equations, helpers.shifted(equations, values, h)) for h in (helpers.STEP, -helpers.STEP))
        wanted = (later - earlier) / (2 * helpers.STEP)
        assert helpers.close(helpers.quantities(equations, values, "Jd_qd", digits=helpers.HIGH)[0], wanted)
        (Jdot,) = helpers.quantities(equations, values, "Jdot", digits=helpers.HIGH)
        assert helpers.close(Jdot, helpers.by_time(equations, values, "J"))


def test_place_of_the_child(name: str) -> None:
    """R = R_p P R_joint C^T and p = p_p + R_p (parent_point + P d) - R child_point, with the rotation from SymPy."""
    _, rotation, displacement = JOINTS[name]
    equations = mechanism(name)
    values = helpers.state(equations, 4)
    (frames,) = helpers.quantities(equations, values, "frames")
    with mpmath.workdps(40):
        exact = {s: sp.Float(str(helpers.number(values[s.name])), 40) for s in (a, b, c, x, y, z, *e) if s.name in values}

        def plain(matrix: Any) -> np.ndarray:
            m = sp.Matrix(matrix).xreplace(exact).evalf(40)
            return np.array([[mpmath.mpf(str(m[i, j])) for j in range(m.shape[1])] for i in range(m.shape[0])], dtype=object)

        R_p, p_p = frames[0, 3:].reshape(3, 3), frames[0, :3]
        P, C = plain(SKEW), plain(QUARTER)
        R = R_p @ P @ plain(rotation) @ C.T
        at = [plain([sp.Rational(str(v)) for v in PLACE[k]])[:, 0] for k in ("parent_point", "child_point")]
        p = p_p + R_p @ (at[0] + P @ plain(displacement)[:, 0]) - R @ at[1]
    tolerance = 1e-14 if name.split()[-1] == "diagonal" else 1e-15  # axes and points given as floats
    assert helpers.close(frames[1, 3:].reshape(3, 3), R, tolerance)
    assert helpers.close(frames[1, :3], p, tolerance)


def test_unit_speeds(name: str) -> None:
    """The speeds are the derivatives of the coordinates, or components of velocity and angular velocity in child axes."""
    equations = mechanism(name, moving=False)
    values = helpers.state(equations, 5)
    rates, J, frames = helpers.quantities(equations, values, "rates", "J", "frames")
    coordinates, symbols = equations.symbols.coordinates, equations.symbols.speeds
    speeds = np.array([helpers.number(values[u.name]) for u in symbols], dtype=object)
    R = frames[1, 3:].reshape(3, 3)
    n = len(speeds)
    if "parameters" in name or "body" in name:
        n -= 3
        assert [u.name for u in symbols[n:]] == [f"omega_{axis}_joint" for axis in "xyz"]
        assert helpers.close(R.T @ (J[9:] @ speeds), speeds[n:])
    if "parameters" in name:
        with mpmath.workdps(40):
            along = sum(values[s.name] * rate for s, rate in zip(coordinates, rates, strict=True) if s in e)
        assert helpers.close(along, 0)
    if "free" in name and "body" in name:
        n -= 3
        assert [u.name for u in symbols[:3]] == [f"v_{axis}_joint" for axis in "xyz"]
        assert helpers.close(R.T @ rates[:3], speeds[:3])
    assert [u.name for u in symbols[:n]] == [f"{q.name}_dot" for q in coordinates[:n]]
    assert helpers.close(rates[:n], speeds[:n]) if n else True


@pytest.mark.parametrize("name", ["revolute z", "helical", "cylindrical", "planar", "free parameters", "free body", "custom 3"])
def test_speeds_of_ones_own_names(name: str) -> None:
    s = sd.System("named", gravity=[0, 0, -9.81])
    box = s.add_body("box", mass=3, inertia=[2, 3, 4], com=[0.3, -0.1, 0.2])
    n = JOINTS[name][0]("joint", s.ground, box).n_speeds
    own = sd.speeds(f"v1:{n + 1}")
    s.add_joint(JOINTS[name][0]("joint", s.ground, box, **({"speed": own[0]} if n == 1 else {"speeds": own})))
    plain = mechanism_without_names(name)
    values = helpers.state(plain, 6)
    named = {**values, **{v.name: values[u.name] for v, u in zip(own, plain.symbols.speeds, strict=True)}}
    assert s.check().speeds == tuple(own)
    assert helpers.close(*(helpers.quantities(eq, at, "rhs")[0] for eq, at in ((s.embedding(), named), (plain, values))))


def mechanism_without_names(name: str) -> EmbeddedEquations:
    s = sd.System("plain", gravity=[0, 0, -9.81])
    box = s.add_body("box", mass=3, inertia=[2, 3, 4], com=[0.3, -0.1, 0.2])
    s.add_joint(JOINTS[name][0]("joint", s.ground, box))
    return s.embedding()


def test_axes_in_floats_are_unit_vectors_to_any_precision() -> None:
    axis = sd.Revolute("j", "a", "b", a, axis=AXES["diagonal"]).axis
    assert abs(sp.N(axis.norm() - 1, 70)) < 1e-55
    assert list(sd.Revolute("j", "a", "b", a, axis=[0.6, 0, 0.8]).axis) == [sp.Rational(3, 5), 0, sp.Rational(4, 5)]


def test_units() -> None:
    s = sd.System("units", gravity=[0, 0, -9.81])
    part = s.ground
    for k, (kind, names) in enumerate([(sd.Cylindrical, "a x"), (sd.Planar, "b y c"), (sd.Prismatic, "z")]):
        child = s.add_body(f"b{k}", mass=1, inertia=[1, 1, 1])
        coordinates = sd.coordinates(names)
        s.add_joint(kind(f"j{k}", part, child, coordinates))
        part = child
    s.add_joint(sd.Spherical("ball", part, s.add_body("end", mass=1, inertia=[1, 1, 1]), e, sd.EulerParameters()))
    units = {symbol.name: unit for symbol, unit in s.check().units.items()}
    assert [units[n] for n in ("a", "x", "b", "y", "c", "z", "e0", "t")] == ["rad", "m", "m", "m", "rad", "m", "1", "s"]
    assert [units[n] for n in ("a_dot", "x_dot", "c_dot", "omega_x_ball")] == ["rad/s", "m/s", "rad/s", "rad/s"]


def test_coordinates_are_named_after_the_joint_unless_given() -> None:
    system = sd.System("plain", gravity=[0, 0, -9.81])
    arm = system.add_body("arm", mass=1, inertia=[1, 1, 1], com=[0.5, 0, 0])
    ball = system.add_body("ball", mass=1, inertia=[1, 2, 2.5], com=[0.1, 0.2, 0])
    system.add_joint(sd.Revolute("pin", system.ground, arm))
    system.add_joint(sd.Spherical("socket", arm, ball, parent_point=[1, 0, 0]))
    names = [q.name for q in system.embedding().symbols.coordinates]
    assert names == ["q_pin", "q_socket_1", "q_socket_2", "q_socket_3"]


def test_a_custom_joint_that_is_shifted_at_zero_is_no_identity_there() -> None:
    s = sd.coordinates("s")
    system = sd.System("wire")
    for position, identity in (([s, 0, s**2], True), ([s + 1, 0, s**2], False)):
        bead = system.add_body(f"bead_{identity}", mass=1)
        assert sd.Custom("wire", system.ground, bead, [s], position=position, units=["m"]).identity_at_zero is identity
