"""Loads and given motions on small mechanisms, against Kane's and Lagrange's equations by sympy.physics.mechanics."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import Any

import mpmath
import numpy as np
import pytest
import sympy as sp
from sympy.physics import mechanics as me

import symdyn as sd
from symdyn.model.symbols import symbols_of
from tests import helpers
from tests.helpers import swept
from tests.oracles.kane import Scene

t = sd.t
g = sp.Rational(981, 100)
half, fifth, third = sp.Rational(1, 2), sp.Rational(1, 5), sp.Rational(1, 3)
INERTIA = [sp.Matrix([[3, fifth, -half], [fifth, 4, third], [-half, third, 5]]), sp.diag(2, 3, 4) + third * sp.ones(3, 3)]
COM = [[half, -fifth, third], [fifth, third, -half]]
MASS = [2, 3]
HINGE = [half, 0, fifth]
q1, q2, q3 = sd.coordinates("q1:4")
F, tau = sd.inputs("F tau")
z = sd.coordinates("z")


# -- two bodies: A turns about z of the ground (q1), B turns and slides along y of A (q2, q3)


def arm() -> sd.System:
    s = sd.System("arm", gravity=[0, 0, -g])
    for k, name in enumerate("AB"):
        s.add_body(name, mass=MASS[k], inertia=INERTIA[k], com=COM[k])
    s.add_joint(sd.Revolute("shoulder", s.ground, "A", q1))
    s.add_joint(sd.Cylindrical("elbow", "A", "B", [q2, q3], axis=[0, 1, 0], parent_point=HINGE))
    return s


class Arm(Scene):
    """The same by reference frames; `A`, `B` frames, `O`, `OB` origins, `GA`, `GB` centres of mass."""

    def __init__(self) -> None:
        super().__init__(3)
        N = self.N
        self.A = self.turned(N, "A", 0, N.z)
        self.B = self.turned(self.A, "B", 1, self.A.y)
        hinge = self.fixed_on(self.O, self.A, "H", vector(self.A, HINGE))
        self.OB = hinge.locatenew("OB", self.q[2] * self.A.y)
        self.OB.set_vel(N, hinge.vel(N) + self.u[2] * self.A.y + me.cross(self.A.ang_vel_in(N), self.q[2] * self.A.y))
        self.GA, self.GB = (self.fixed_on(o, f, f"G{f}", vector(f, com)) for o, f, com in
                            ((self.O, self.A, COM[0]), (self.OB, self.B, COM[1])))
        for G, frame, m, I in zip((self.GA, self.GB), (self.A, self.B), MASS, INERTIA, strict=True):
            self.weigh(me.RigidBody(str(frame), G, frame, m, (dyadic(frame, I), G)), G, -m * g * N.z)
        self.names = dict(zip((q1, q2, q3, q1.dot, q2.dot, q3.dot), [*self.q, *self.u], strict=True))

    def on(self, frame: Any, at: Sequence[Any]) -> Any:
        """A point of A or B."""
        origin = self.O if frame is self.A else self.OB
        return self.fixed_on(origin, frame, f"P{len(self.loads)}", vector(frame, at))

    def under(self, point: Any) -> Any:
        """The point of A at the place of another point."""
        r = point.pos_from(self.O)
        below = self.O.locatenew("below", r)
        below.set_vel(self.N, me.cross(self.A.ang_vel_in(self.N), r))
        return below

    def spring(self, a: Any, b: Any, k: Any, d: Any, length: Any) -> list:
        """Forces on two points that a spring and damper pull together."""
        line = b.pos_from(a)
        now = sp.sqrt(line.dot(line))
        rate = line.dot(b.vel(self.N) - a.vel(self.N)) / now
        pull = (k * (now - length) + d * rate) / now * line
        return [(a, pull), (b, -pull)]


def vector(frame: Any, components: Sequence[Any]) -> Any:
    return components[0] * frame.x + components[1] * frame.y + components[2] * frame.z


def dyadic(frame: Any, I: sp.Matrix) -> Any:
    return me.inertia(frame, I[0, 0], I[1, 1], I[2, 2], I[0, 1], I[1, 2], I[0, 2])


@lru_cache
def kane() -> tuple[Arm, sp.Matrix, sp.Matrix]:
    """The scene, the mass matrix and the forces without loads; the loads only add to the forces."""
    scene = Arm()
    equations = me.KanesMethod(scene.N, q_ind=scene.q, u_ind=scene.u,
                               kd_eqs=[u - q.diff() for q, u in zip(scene.q, scene.u, strict=True)])
    equations.kanes_equations(scene.bodies, scene.loads)
    return scene, equations.mass_matrix, equations.forcing


def by_kane(loads: Callable[[Arm], list], values: dict[str, Any]) -> np.ndarray:
    scene, mass, forcing = kane()
    forces = sp.zeros(3, 1)
    for place, load in loads(scene):
        motion = place.ang_vel_in(scene.N) if isinstance(place, me.ReferenceFrame) else place.vel(scene.N)
        for j, u in enumerate(scene.u):
            forces[j] += motion.diff(u, scene.N, var_in_dcm=False).dot(load)
    return solve(mass, forcing + forces, {**{s: symbol.name for symbol, s in scene.names.items()}}, values)


def solve(mass: sp.Matrix, right: sp.Matrix, names: dict[Any, str], values: dict[str, Any]) -> np.ndarray:
    """mass^-1 right at 40 digits; names: what stands in the matrices -> name among the values."""
    rest = sorted((symbols_of(mass) | symbols_of(right)) - set(names), key=str)
    names = {**names, **{s: s.name for s in rest}}
    evaluate = sp.lambdify(list(names), [mass, right], modules="mpmath", cse=True)
    with mpmath.workdps(40):
        M, f = evaluate(*[helpers.number(values[n]) for n in names.values()])
        return np.array(list(mpmath.lu_solve(M, f)), dtype=object)


def sign_friction(u: Any) -> Any:
    return sp.Piecewise((-3 * u, sp.Abs(u) < half), (-sp.sign(u) * (1 + u**2), True))


P, S = [half, third, -fifth], [-third, fifth, half]
X = [F, 2 * t, sp.cos(q2) - q1.dot]  # components of a load that depends on everything


def x(scene: Arm) -> list:
    return [sp.sympify(e).xreplace(scene.names) for e in X]


# name -> what is described to symdyn, and what is applied in the scene
LOADS: dict[str, tuple[Callable[[sd.System], Any], Callable[[Arm], list]]] = {
    "none": (lambda s: None, lambda c: []),
    "force at the centre of mass": (lambda s: s.add_force("B", X), lambda c: [(c.GB, vector(c.N, x(c)))]),
    "force at a point": (lambda s: s.add_force("B", X, point=P), lambda c: [(c.on(c.B, P), vector(c.N, x(c)))]),
    "force in body axes": (lambda s: s.add_force("B", X, point=P, frame="B"), lambda c: [(c.on(c.B, P), vector(c.B, x(c)))]),
    "force in another body's axes": (lambda s: s.add_force("A", X, point=P, frame="B"),
                                     lambda c: [(c.on(c.A, P), vector(c.B, x(c)))]),
    "force in the ground's axes": (lambda s: s.add_force("A", X, point=P, frame="ground"),
                                   lambda c: [(c.on(c.A, P), vector(c.N, x(c)))]),
    "force with reaction": (lambda s: s.add_force("B", X, point=P, frame="A", reaction="A"),
                            lambda c: [(c.on(c.B, P), vector(c.A, x(c))), (c.under(c.on(c.B, P)), -vector(c.A, x(c)))]),
    "force on the ground": (lambda s: s.add_force(s.ground, X, reaction="B"),
                            lambda c: [(_at_origin(c), -vector(c.N, x(c)))]),
    "force, reaction to the ground": (lambda s: s.add_force("A", X, point=P, reaction=s.ground),
                                      lambda c: [(c.on(c.A, P), vector(c.N, x(c)))]),
    "torque": (lambda s: s.add_torque("B", X), lambda c: [(c.B, vector(c.N, x(c)))]),
    "torque in body axes": (lambda s: s.add_torque("B", X, frame="B"), lambda c: [(c.B, vector(c.B, x(c)))]),
    "torque with reaction": (lambda s: s.add_torque("B", X, reaction="A"),
                             lambda c: [(c.B, vector(c.N, x(c))), (c.A, -vector(c.N, x(c)))]),
    "joint force": (lambda s: s.add_joint_force("shoulder", F - q1.dot), lambda c: [(c.A, (F - c.u[0]) * c.N.z)]),
    "joint forces": (lambda s: s.add_joint_force(s.joints[1], [tau, F * q3]), lambda c: [
        (c.B, tau * c.A.y), (c.A, -tau * c.A.y), (c.OB, F * c.q[2] * c.A.y), (c.under(c.OB), -F * c.q[2] * c.A.y)]),
    "spring between bodies": (lambda s: s.add_spring_damper("A", "B", P, S, stiffness=7, length=third),
                              lambda c: c.spring(c.on(c.A, P), c.on(c.B, S), 7, 0, third)),
    "damper between bodies": (lambda s: s.add_spring_damper("B", "A", P, S, damping=5),
                              lambda c: c.spring(c.on(c.B, P), c.on(c.A, S), 0, 5, 0)),
    "spring and damper to the ground": (lambda s: s.add_spring_damper(s.ground, "B", P, S, 7, 5, half),
                                        lambda c: c.spring(_fixed(c, P), c.on(c.B, S), 7, 5, half)),
    "spring without length": (lambda s: s.add_spring_damper("B", "ground", P, S, stiffness=7),
                              lambda c: c.spring(c.on(c.B, P), _fixed(c, S), 7, 0, 0)),
    "friction by pieces": (lambda s: [s.add_joint_force("shoulder", sign_friction(q1.dot)),
                                      s.add_joint_force("elbow", [sign_friction(q2.dot), sign_friction(3 * q3.dot)])],
                           lambda c: [(c.A, sign_friction(c.u[0]) * c.N.z), (c.B, sign_friction(c.u[1]) * c.A.y),
                                      (c.A, -sign_friction(c.u[1]) * c.A.y), (c.OB, sign_friction(3 * c.u[2]) * c.A.y),
                                      (c.under(c.OB), -sign_friction(3 * c.u[2]) * c.A.y)]),
    "several at once": (lambda s: [s.add_force("B", X), s.add_torque("A", X), s.add_force("B", X, frame="A")],
                        lambda c: [(c.GB, vector(c.N, x(c))), (c.A, vector(c.N, x(c))), (c.GB, vector(c.A, x(c)))]),
}


def _fixed(c: Arm, at: Sequence[Any]) -> Any:
    point = c.O.locatenew("wall", vector(c.N, at))
    point.set_vel(c.N, 0)
    return point


def _at_origin(c: Arm) -> Any:
    """The point of B at the origin of the ground."""
    point = c.O.locatenew("here", 0 * c.N.x)
    point.set_vel(c.N, c.OB.vel(c.N) + me.cross(c.B.ang_vel_in(c.N), c.O.pos_from(c.OB)))
    return point


@pytest.mark.parametrize("name", swept(LOADS, *(name for name in LOADS if name not in (
    "force in another body's axes", "force in the ground's axes", "force, reaction to the ground", "torque in body axes",
    "damper between bodies", "several at once"))))
def test_against_kane(name: str) -> None:
    describe, apply = LOADS[name]
    s = arm()
    describe(s)
    equations = s.embedding()
    values = {"F": mpmath.mpf(3) / 2, "tau": mpmath.mpf(-2), **helpers.state(equations, 1)}
    (found,) = helpers.quantities(equations, values, "accelerations")
    assert helpers.close(found, by_kane(apply, values))


def test_extra_states_and_outputs() -> None:
    s = arm()
    s.add_joint_force("shoulder", 2 * z)
    s.add_state(z, -z / third + q1.dot * F)
    s.add_output("length", sp.sqrt(q3**2 + z**2))
    equations = s.embedding()
    values = helpers.state(equations, 4)
    rhs, length = helpers.quantities(equations, values, "rhs", "output_length")
    with mpmath.workdps(40):
        n = {k: helpers.number(v) for k, v in values.items()}
        assert helpers.close(rhs[6], -3 * n["z"] + n["q1_dot"] * n["F"])
        assert helpers.close(length[()], mpmath.sqrt(n["q3"] ** 2 + n["z"] ** 2))
    assert helpers.close(rhs[3:6], by_kane(lambda c: [(c.A, 2 * sp.Symbol("z") * c.N.z)], values))


def test_positions_and_velocities_as_outputs() -> None:
    s = arm()
    s.add_output("tip", sd.position("B", P))
    s.add_output("tip_velocity", sd.velocity("B", P))
    s.add_output("still", sd.velocity(s.ground, P))
    equations = s.embedding()
    values = helpers.state(equations, 5)
    found = helpers.quantities(equations, values, "output_tip", "output_tip_velocity", "output_still")
    scene = Arm()
    point = scene.on(scene.B, P)
    names = {s: symbol.name for symbol, s in scene.names.items()}
    for value, wanted in zip(found, (point.pos_from(scene.O), point.vel(scene.N)), strict=False):
        assert helpers.close(value, solve(sp.eye(3), wanted.to_matrix(scene.N), names, values))
    assert not found[2].any()


# -- given motions and dependent coordinates, by Lagrange's equations


# Simpler bodies than those of the arm: Lagrange's equations grow fast.
SHORT, MOMENTS = [[half, 0, 0], [0, third, 0]], [[3, 4, 5], [2, 3, 4]]


class Stage:
    """Frames and bodies whose motion is written out in coordinates and time."""

    def __init__(self, names: str) -> None:
        self.q = list(me.dynamicsymbols(names, seq=True)) if " " in names else [me.dynamicsymbols(names)]
        self.N, self.O = me.ReferenceFrame("N"), me.Point("O")
        self.O.set_vel(self.N, 0)
        self.bodies: list[Any] = []
        self.forces: list[Any] = []

    def put(self, name: str, position: Any) -> Any:
        point = self.O.locatenew(name, position)
        point.set_vel(self.N, position.dt(self.N))
        return point

    def body(self, k: int, frame: Any, position: Any) -> None:
        G = self.put(f"G{k}", position + vector(frame, SHORT[k]))
        self.bodies.append(me.RigidBody(f"b{k}", G, frame, MASS[k], (dyadic(frame, sp.diag(*MOMENTS[k])), G)))
        self.forces.append((G, -MASS[k] * g * self.N.z))

    def accelerations(self, values: dict[str, Any]) -> np.ndarray:
        method = me.LagrangesMethod(me.Lagrangian(self.N, *self.bodies), self.q, forcelist=self.forces, frame=self.N)
        method.form_lagranges_equations()
        plain = {**{q.diff(): sp.Symbol(f"{q.name}_dot") for q in self.q}, **{q: sp.Symbol(q.name) for q in self.q}}
        mass, forcing = (m.xreplace({k: v for k, v in plain.items() if k.is_Derivative}).xreplace(plain)
                         for m in (method.mass_matrix, method.forcing))
        return solve(mass, forcing, {}, values)


def two(*joints: Any, **options: Any) -> sd.System:
    s = sd.System("two", gravity=[0, 0, -g], **options)
    for k, name in enumerate("AB"):
        s.add_body(name, mass=MASS[k], inertia=MOMENTS[k], com=SHORT[k])
    for joint in joints:
        s.add_joint(joint)
    return s


def agrees(s: sd.System, stage: Stage, seeds: Sequence[int] = (1, 2), **given: Any) -> None:
    equations = s.embedding()
    for seed in seeds:
        values = helpers.state(equations, seed, **given)
        assert helpers.close(helpers.quantities(equations, values, "accelerations")[0], stage.accelerations(values))


def test_prescribed_rotation() -> None:
    angle = sp.sin(2 * t) + t**2
    s = two(sd.Revolute("drive", "ground", "A", angle, axis=[1, 0, 0]),
            sd.Revolute("hinge", "A", "B", q1, axis=[0, 1, 0], parent_point=HINGE))
    stage = Stage("q1")
    A = stage.N.orientnew("A", "Axis", [angle, stage.N.x])
    B = A.orientnew("B", "Axis", [stage.q[0], A.y])
    stage.body(0, A, 0 * A.x)
    stage.body(1, B, vector(A, HINGE))
    agrees(s, stage)


def test_prescribed_slide_and_half_a_joint_prescribed() -> None:
    way = sp.exp(-t) * sp.sin(3 * t)
    s = two(sd.Prismatic("drive", "ground", "A", way, axis=[0, 0, 1]),
            sd.Cylindrical("screw", "A", "B", [q1, sp.cos(t)], axis=[1, 0, 0], parent_point=HINGE))
    stage = Stage("q1")
    B = stage.N.orientnew("B", "Axis", [stage.q[0], stage.N.x])
    stage.body(0, stage.N, way * stage.N.z)
    stage.body(1, B, way * stage.N.z + vector(stage.N, HINGE) + sp.cos(t) * stage.N.x)
    agrees(s, stage)


@pytest.mark.parametrize("ratio", [2, -third])
def test_gear(ratio: Any) -> None:
    s = two(sd.Revolute("shaft", "ground", "A", q1, axis=[0, 1, 0]),
            sd.Revolute("wheel", "A", "B", ratio * q1, axis=[1, 0, 0], parent_point=HINGE))
    s.add_joint_force("wheel", F)
    stage = Stage("q1")
    A = stage.N.orientnew("A", "Axis", [stage.q[0], stage.N.y])
    B = A.orientnew("B", "Axis", [ratio * stage.q[0], A.x])
    stage.body(0, A, 0 * A.x)
    stage.body(1, B, vector(A, HINGE))
    stage.forces += [(B, F * A.x), (A, -F * A.x)]
    agrees(s, stage)


def test_mimic_and_a_coordinate_of_two_coordinates_and_time() -> None:
    other = sp.UnevaluatedExpr(q1) + q2**2 * t
    s = two(sd.Prismatic("slide", "ground", "A", q2, axis=[1, 0, 0]), sd.Revolute("turn", "A", "B", other, axis=[0, 0, 1]))
    s.add_body("C", mass=1, inertia=[1, 1, 1])
    s.add_joint(sd.Revolute("own", "ground", "C", q1, axis=[0, 1, 0]))
    stage = Stage("q2 q1")
    C = stage.N.orientnew("C", "Axis", [stage.q[1], stage.N.y])
    B = stage.N.orientnew("B", "Axis", [stage.q[1] + stage.q[0] ** 2 * t, stage.N.z])
    stage.body(0, stage.N, stage.q[0] * stage.N.x)
    stage.body(1, B, stage.q[0] * stage.N.x)
    centre = stage.put("GC", 0 * C.x)
    stage.bodies.append(me.RigidBody("C", centre, C, 1, (me.inertia(C, 1, 1, 1), centre)))
    agrees(s, stage)


def test_absolute_angles() -> None:
    """The second joint turns by the difference of two angles that count from the ground."""
    s = two(sd.Revolute("one", "ground", "A", q1, axis=[0, 1, 0]),
            sd.Revolute("other", "A", "B", q2 - q1, axis=[0, 1, 0], parent_point=HINGE))
    s.add_coordinate(q2)
    stage = Stage("q1 q2")
    A, B = (stage.N.orientnew(n, "Axis", [q, stage.N.y]) for n, q in zip("AB", stage.q, strict=True))
    stage.body(0, A, 0 * A.x)
    stage.body(1, B, vector(A, HINGE))
    agrees(s, stage)


def test_mimic_alone() -> None:
    s = two(sd.Revolute("one", "ground", "A", q1, axis=[1, 0, 0]),
            sd.Revolute("other", "ground", "B", sp.UnevaluatedExpr(q1), axis=[0, 1, 0], parent_point=HINGE))
    stage = Stage("q1")
    A, B = (stage.N.orientnew(n, "Axis", [stage.q[0], axis]) for n, axis in (("A", stage.N.x), ("B", stage.N.y)))
    stage.body(0, A, 0 * A.x)
    stage.body(1, B, vector(stage.N, HINGE))
    agrees(s, stage)


def test_moving_ground() -> None:
    path, angles = [sp.sin(t), 0, t**2], [t, sp.sin(t) / 10, -(t**2) / 5]
    s = two(sd.Revolute("hinge", "ground", "A", q1, axis=[0, 1, 0], parent_point=HINGE),
            sd.Prismatic("slide", "A", "B", q2, axis=[1, 0, 0]))
    s.move_ground(path, angles)
    s.add_spring_damper("ground", "B", P, S, stiffness=7, damping=5, length=third)
    s.add_force("A", [F, 1, 2], point=P, frame="ground")
    stage = Stage("q1 q2")
    base = vector(stage.N, path)
    E = stage.N.orientnew("E", "Body", angles, "ZYX")
    A = E.orientnew("A", "Axis", [stage.q[0], E.y])
    foot = base + vector(E, HINGE)
    stage.body(0, A, foot)
    stage.body(1, A, foot + stage.q[1] * A.x)
    wall, hook = stage.put("W", base + vector(E, P)), stage.put("K", foot + stage.q[1] * A.x + vector(A, S))
    stage.forces += [*Arm.spring(stage, wall, hook, 7, 5, third), (stage.put("T", foot + vector(A, P)), vector(E, [F, 1, 2]))]
    agrees(s, stage, seeds=(1,))


def test_moving_ground_in_the_plane() -> None:
    s = sd.System("swing", gravity=[0, -g])
    s.add_body("rod", mass=2, inertia=3, com=[half, 0])
    s.add_joint(sd.Revolute("hinge", s.ground, "rod", q1, parent_point=[fifth, third]))
    s.move_ground([sp.cos(3 * t), t**2], [sp.sin(t), 0, 0])
    s.add_torque("rod", tau)
    s.add_force("rod", [F, t], point=[1, 0], frame="rod")
    stage = Stage("q1")
    E = stage.N.orientnew("E", "Axis", [sp.sin(t), stage.N.z])
    A = E.orientnew("A", "Axis", [stage.q[0], E.z])
    foot = sp.cos(3 * t) * stage.N.x + t**2 * stage.N.y + fifth * E.x + third * E.y
    G = stage.put("G", foot + half * A.x)
    stage.bodies.append(me.RigidBody("rod", G, A, 2, (me.inertia(A, 0, 0, 3), G)))
    stage.forces += [(G, -2 * g * stage.N.y), (A, tau * A.z), (stage.put("P", foot + A.x), F * A.x + t * A.y)]
    agrees(s, stage)


def test_fixed_bodies_are_one() -> None:
    turned = sp.Matrix([[0, 0, 1], [1, 0, 0], [0, 1, 0]])
    s = two(sd.Revolute("hinge", "ground", "A", q1, axis=[0, 1, 0], child_point=P),
            sd.Fixed("weld", "A", "B", parent_point=HINGE, parent_rotation=turned, child_point=S))
    stage = Stage("q1")
    A = stage.N.orientnew("A", "Axis", [stage.q[0], stage.N.y])
    B = A.orientnew("B", "DCM", turned)
    origin = -vector(A, P)
    stage.body(0, A, origin)
    stage.body(1, B, origin + vector(A, HINGE) - vector(B, S))
    agrees(s, stage)


# -- a body about a fixed point, by Euler's equations in its axes


def top(orientation: Any, coordinates: Any, **options: Any) -> sd.System:
    s = sd.System("top", gravity=[0, 0, -g])
    s.add_body("A", mass=MASS[0], inertia=INERTIA[0], com=COM[0])
    s.add_joint(sd.Spherical("ball", s.ground, "A", coordinates, orientation, **options))
    s.add_torque("A", [F, 1, sp.sin(t)], frame="A")
    return s


def euler(down: sp.Matrix, omega: sp.Matrix) -> sp.Matrix:
    """omega_dot of the top for the direction of gravity and omega in its axes."""
    c = sp.Matrix(COM[0])
    I = INERTIA[0] + MASS[0] * (c.dot(c) * sp.eye(3) - c * c.T)
    return I.inv() * (c.cross(MASS[0] * g * down) + sp.Matrix([F, 1, sp.sin(t)]) - omega.cross(I * omega))


@pytest.mark.parametrize("sequence", ["ZYX", "XYX", *swept(["YZX"])])
def test_euler_angles(sequence: str) -> None:
    values = helpers.state(equations := top(sd.EulerAngles(sequence), sd.coordinates("a b c")).embedding(), 1)
    N, angles = me.ReferenceFrame("N"), me.dynamicsymbols("a b c")
    A = N.orientnew("A", "Body", angles, sequence)
    omega = A.ang_vel_in(N).to_matrix(A)
    rates = [a.diff() for a in angles]
    S = omega.jacobian(rates)
    right = euler((-N.z).to_matrix(A), omega) - S.diff(t) * sp.Matrix(rates)
    plain = {a.diff(): sp.Symbol(f"{a.name}_dot") for a in angles} | {a: sp.Symbol(a.name) for a in angles}
    (found,) = helpers.quantities(equations, values, "accelerations")
    assert helpers.close(found, solve(S.subs(plain), right.subs(plain), {}, values))


def test_euler_parameters() -> None:
    e = sd.coordinates("e0:4")
    equations = top(sd.EulerParameters(), e, speeds=sd.speeds("w1:4")).embedding()
    values = helpers.state(equations, 3)
    N, p, w = me.ReferenceFrame("N"), sp.symbols("e0:4"), sp.symbols("w1:4")
    A = N.orientnew("A", "Quaternion", p)
    found, rates = helpers.quantities(equations, values, "accelerations", "rates")
    assert helpers.close(found, solve(sp.eye(3), euler((-N.z).to_matrix(A), sp.Matrix(w)), {}, values))
    product = sp.Quaternion(*p) * sp.Quaternion(0, *[s / 2 for s in w])
    assert helpers.close(rates, solve(sp.eye(4), sp.Matrix([product.a, product.b, product.c, product.d]), {}, values))


def test_plane_and_space_agree() -> None:
    planar, spatial = _double(True), _double(False)
    values = helpers.state(planar, 6)
    names = ("accelerations", "M_tilde", "k_tilde", "F_tilde", "energy", "power", "positions")
    for one, other in zip(helpers.quantities(planar, values, *names), helpers.quantities(spatial, values, *names), strict=True):
        assert helpers.close(one, other)
    J, J3 = (helpers.quantities(e, values, "J")[0] for e in (planar, spatial))
    assert helpers.close(J, J3[[0, 1, 5, 6, 7, 11]]) and not J3[[2, 3, 4, 8, 9, 10]].any()


def _double(planar: bool) -> Any:
    s = sd.System("double", gravity=[0, -g] if planar else [0, -g, 0])
    assert s.planar is planar

    def v(*components: Any) -> list:
        return list(components) if planar else [*components, 0]

    for k, name in enumerate("AB"):
        s.add_body(name, mass=MASS[k], inertia=k + 1 if planar else [1, 1, k + 1] if k == 0 else [2, 2, 2], com=v(half, fifth))
    s.add_joint(sd.Revolute("one", s.ground, "A", q1))
    s.add_joint(sd.Planar("two", "A", "B", [q2, q3, sd.coordinates("q4")], parent_point=v(1, third)))
    s.add_force("B", v(F, q1), point=v(third, half), frame="A", reaction="A")
    s.add_torque("A", tau if planar else [0, 0, tau], reaction="B")
    s.add_spring_damper(s.ground, "B", v(1, 2), v(0, third), 7, 5, half)
    return s.embedding()
