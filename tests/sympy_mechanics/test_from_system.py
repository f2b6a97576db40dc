"""Systems of sympy.physics.mechanics as systems of symdyn's, against the equations that SymPy's KanesMethod forms of them."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import sympy as sp
from sympy.physics.biomechanics import FirstOrderActivationDeGroote2016, MusculotendonDeGroote2016
from sympy.physics.mechanics import (
    CylindricalJoint,
    DuffingSpring,
    Force,
    ForceActuator,
    LinearDamper,
    LinearPathway,
    LinearSpring,
    ObstacleSetPathway,
    Particle,
    PinJoint,
    PlanarJoint,
    Point,
    PrismaticJoint,
    ReferenceFrame,
    RigidBody,
    SphericalJoint,
    System,
    Torque,
    TorqueActuator,
    WeldJoint,
    WrappingCylinder,
    WrappingPathway,
    dynamicsymbols,
    inertia,
)

import symdyn as sd

g = sp.Symbol("g")


def begun() -> tuple[RigidBody, System]:
    """A wall and a system on it."""
    wall = RigidBody("wall")
    return wall, System.from_newtonian(wall)


def numbers(*every: Any) -> dict[str, float]:
    """For every symbol of the equations by name: between 0.2 and 1.2, moments of inertia about 1, products of inertia small."""
    names = sorted({e.name for equations in every for group in ("parameters", "coordinates", "speeds", "states", "inputs")
                    for e in getattr(equations.symbols, group)})
    drawn = dict(zip(names, np.random.default_rng(3).uniform(0.2, 1.2, len(names)), strict=True))
    moments = {name: 0.8 + value / 3 for name, value in drawn.items() if name[-4:] in ("_ixx", "_iyy", "_izz")}
    return drawn | moments | {name: value / 20 for name, value in drawn.items() if name[-4:] in ("_ixy", "_iyz", "_izx")}


def rates(equations: Any, given: dict[str, float]) -> dict[str, float]:
    """x_dot by name."""
    s = equations.symbols
    state = [e.name for e in (*s.coordinates, *s.speeds, *s.states)]
    found = equations.compile(backend="numpy").rhs(0.0, [given[n] for n in state], [given[e.name] for e in s.parameters],
                                                   [given[e.name] for e in s.inputs])
    return dict(zip(state, found, strict=True))


def agree(system: System, states: dict[Any, Any] | None = None) -> sd.System:
    """Compare x_dot of both ways at a random state."""
    taken = sd.from_system(system, "taken")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        system.form_eoms()
    kane = sd.from_sympy(system.eom_method, "kane", states=states)
    own = taken.equations()
    given = numbers(kane, own)
    ours, theirs = rates(own, given), rates(kane, given)
    assert ours.keys() == theirs.keys()
    largest = max(map(abs, theirs.values()))
    assert max(abs(ours[name] - theirs[name]) for name in theirs) <= 1e-12 * largest
    return taken


def test_pins_slides_springs_and_drives() -> None:
    wall, system = begun()
    a, b = RigidBody("a"), RigidBody("b")
    l = sp.Symbol("l")
    system.add_joints(PinJoint("p", wall, a, child_point=-l * a.x, joint_axis=wall.z),
                      PrismaticJoint("s", a, b, parent_point=l * a.x + a.y / 3, joint_axis=a.x + a.y))
    system.apply_uniform_gravity(-g * wall.y)
    line = LinearPathway(wall.masscenter, b.masscenter)
    system.add_actuators(TorqueActuator.at_pin_joint(dynamicsymbols("T"), system.joints[0]),
                         LinearSpring(sp.Symbol("k"), line, sp.Symbol("l0")), LinearDamper(sp.Symbol("c"), line),
                         ForceActuator(dynamicsymbols("F"), LinearPathway(a.masscenter.locatenew("Q", a.y / 2), b.masscenter)),
                         DuffingSpring(sp.Symbol("k1"), sp.Symbol("k3"), line, sp.Symbol("l1")))
    taken = agree(system)
    assert [type(joint).__name__ for joint in taken.joints] == ["Revolute", "Prismatic"]
    assert list(taken.check().gravity) == [0, -g, 0]
    assert taken.embedding().verify(states=2).passed


def test_a_ball_joint_with_loads_in_axes_of_bodies() -> None:
    wall, system = begun()
    a = RigidBody("a")
    system.add_joints(SphericalJoint("ball", wall, a, child_point=a.x / 4, rot_order="ZXY"))
    system.apply_uniform_gravity(-g * wall.y)
    system.add_loads(Force(a.masscenter.locatenew("tip", a.x / 7), sp.Symbol("f") * a.y + dynamicsymbols("h") * wall.z),
                     Torque(a, sp.sin(system.q[0]) * a.x - system.u[1] * wall.x))
    assert [type(joint).__name__ for joint in agree(system).joints] == ["Spherical"]


def test_tubes_and_planes() -> None:
    wall, system = begun()
    a, b = RigidBody("a"), RigidBody("b")
    system.add_joints(CylindricalJoint("tube", wall, a, parent_point=-wall.x / 2, child_point=a.z / 5, joint_axis=wall.y),
                      PlanarJoint("plane", a, b, parent_point=a.x / 3, child_point=b.y / 3))
    system.apply_uniform_gravity(-g * wall.y)
    assert [type(joint).__name__ for joint in agree(system).joints] == ["Cylindrical", "Custom"]


def test_welds_intermediate_frames_and_space_fixed_angles() -> None:
    wall, system = begun()
    a, b, c = (RigidBody(name) for name in "abc")
    turned = ReferenceFrame("turned")
    turned.orient_axis(a.frame, a.y, sp.pi / 3)
    system.add_joints(PinJoint("p", wall, a, child_point=-a.x, joint_axis=wall.y + wall.z),
                      WeldJoint("w", a, b, parent_point=a.x, child_point=-b.y / 2, parent_interframe=turned),
                      SphericalJoint("ball", b, c, parent_point=b.x, child_point=c.y / 4, rot_type="SPACE", rot_order=123))
    system.add_loads(Force(c, -c.mass * g * wall.y), Torque(a, sp.Symbol("tau") * turned.x))
    taken = agree(system)
    assert [type(joint).__name__ for joint in taken.joints] == ["Revolute", "Fixed", "Custom"]
    assert not any(taken.check().gravity)
    assert taken.embedding().explicit("reactions", simplify=False).shape == (3, 6)


def placed(with_speeds: bool) -> System:
    """A particle that slides on the ground and a rod on it, without joints."""
    x, theta, v, w = dynamicsymbols("x theta v w")
    m, l, I = sp.symbols("m l I")
    N, origin = ReferenceFrame("N"), Point("O")
    origin.set_vel(N, 0)
    cart = Particle("cart", origin.locatenew("C", x * N.x), sp.Symbol("M"))
    cart.point.set_vel(N, v * N.x)
    rod_frame = N.orientnew("R", "Axis", [theta, N.z])
    rod_frame.set_ang_vel(N, (w - v if with_speeds else w) * N.z)
    center = origin.locatenew("G", l * rod_frame.x)
    rod = RigidBody("rod", center, rod_frame, m, (inertia(rod_frame, 0, 0, I), center))
    rod.masscenter.v2pt_theory(origin, N, rod_frame)
    system = System(N, origin)
    system.add_bodies(cart, rod)
    system.add_coordinates(x, theta)
    system.add_speeds(v, w)
    system.add_kdes(x.diff() - v, theta.diff() - (w - v if with_speeds else w))
    system.add_loads(Force(cart.point, -g * x * N.x), Force(rod.masscenter, -m * g * N.y))
    return system


@pytest.mark.parametrize("with_speeds", [False, True])
def test_bodies_without_joints_and_chosen_speeds(with_speeds: bool) -> None:
    taken = agree(placed(with_speeds))
    assert [type(joint).__name__ for joint in taken.joints] == ["Custom", "Custom"]
    assert bool(taken.chosen_speeds) == with_speeds


def test_constraints_close_loops_and_hold_wheels() -> None:
    wall, system = begun()
    a, b = RigidBody("a"), RigidBody("b")
    system.add_joints(PinJoint("p", wall, a, child_point=-a.x, joint_axis=wall.z),
                      PinJoint("r", a, b, parent_point=a.x, child_point=-b.x, joint_axis=a.z))
    system.apply_uniform_gravity(-g * wall.y)
    tip = b.masscenter.locatenew("tip", b.x)
    system.add_holonomic_constraints(tip.pos_from(wall.masscenter).dot(wall.y) - sp.Symbol("h"))
    system.q_ind, system.q_dep = system.q[:1], system.q[1:]
    system.u_ind, system.u_dep = system.u[:1], system.u[1:]
    initial = {"q_p": 0.3, "q_r": -0.5}
    system.form_eoms()
    kane = sd.from_sympy(system.eom_method, "kane", initial=initial)
    given = {p.name: 0.5 for p in kane.symbols.parameters}
    equations = sd.from_system(system, "held", initial=initial).augmented()
    assert equations.constraints == ("holonomic_1",) and equations.holonomic == (True,)
    first, second = equations.compile(backend="numpy"), kane.compile(backend="numpy")
    q, u = second.consistent(u={"u_p": 1.0}, keep=["u_p"], params=given)
    own = {p.name: given.get(p.name, 0.0) for p in equations.symbols.parameters}  # others do not enter
    assert first.rhs(0.0, [*q, *u], own) == pytest.approx(second.rhs(0.0, [*q, *u], given), rel=1e-12)
    force = first.evaluate("lam", 0.0, [*q, *u], own).sum()
    assert force == pytest.approx(second.evaluate("lam", 0.0, [*q, *u], given).sum(), rel=1e-9)


def test_nonholonomic_constraints_become_velocity_constraints() -> None:
    N, origin = ReferenceFrame("N"), Point("O")
    origin.set_vel(N, 0)
    x, y, v_x, v_y = dynamicsymbols("x y v_x v_y")
    bob = Particle("bob", origin.locatenew("P", x * N.x + y * N.y), sp.Symbol("m"))
    bob.point.set_vel(N, v_x * N.x + v_y * N.y)
    system = System(N, origin)
    system.add_bodies(bob)
    system.add_coordinates(x, y)
    system.add_speeds(v_x)
    system.add_speeds(v_y, independent=False)
    system.add_kdes(x.diff() - v_x, y.diff() - v_y)
    system.add_nonholonomic_constraints(v_y - x * v_x)
    system.add_loads(Force(bob.point, -y * N.y))
    taken = agree(system)
    assert taken.augmented().holonomic == (False,)


def test_muscles_bring_their_states() -> None:
    wall, system = begun()
    arm = RigidBody("arm")
    system.add_joints(PinJoint("elbow", wall, arm, child_point=arm.y / 4, joint_axis=wall.z))
    top, insertion = wall.masscenter.locatenew("top", wall.y / 3), arm.masscenter.locatenew("in", arm.y / 5)
    muscle = MusculotendonDeGroote2016.with_defaults("m", LinearPathway(top, insertion),
                                                     FirstOrderActivationDeGroote2016.with_defaults("m"))
    system.add_actuators(muscle)
    taken = agree(system, dict(zip(muscle.x, muscle.rhs(), strict=True)))
    assert [z.symbol.name for z in taken.states] == ["a_m"] and taken.check().inputs == (sd.inputs("e_m"),)


def test_other_pathways_by_the_loads_that_they_say() -> None:
    wall, system = begun()
    arm = RigidBody("arm")
    system.add_joints(PinJoint("p", wall, arm, child_point=-arm.x, joint_axis=wall.z))
    points = [wall.masscenter.locatenew("A", wall.y), wall.masscenter.locatenew("B", wall.x / 2),
              arm.masscenter.locatenew("C", arm.x)]
    system.add_actuators(ForceActuator(sp.Symbol("F"), ObstacleSetPathway(*points)))
    agree(system)


def refused(system: Any, **more: Any) -> str:
    with pytest.raises(sd.SymdynError) as caught:
        sd.from_system(system, **more).check()
    return str(caught.value)


def test_faults_by_name() -> None:
    assert "of type int; pass a sympy.physics.mechanics.System" in refused(3)
    wall, system = begun()
    a, b, c, d = (RigidBody(name) for name in "abcd")
    system.add_joints(PinJoint("p", a, wall), PinJoint("island", b, c))
    system.add_bodies(d)
    system.add_auxiliary_speeds(dynamicsymbols("u_x"))
    system.add_loads(Force(Point("nowhere"), wall.x), Torque(ReferenceFrame("loose"), wall.x))
    told = refused(system)
    for part in ("auxiliary speeds u_x(t)", "joint p leads from a to the ground wall; exchange its parent and its child",
                 "the body d has no joint, and its place in the frame wall_frame is not known",
                 "the point nowhere, which no body carries", "on the frame loose, which no body carries"):
        assert part in told
    assert "name is 'not one'" in refused(begun()[1], name="not one")


def test_joints_on_frames_that_turn_on_their_bodies() -> None:
    wall, system = begun()
    a = RigidBody("a")
    turning = wall.frame.orientnew("turning", "Axis", [dynamicsymbols("z"), wall.x])
    turning.set_ang_vel(wall.frame, 0 * wall.x)  # what SymPy looks at
    system.add_joints(PinJoint("p", wall, a, parent_interframe=turning))
    assert "joint p: its points or intermediate frames depend on z(t)" in refused(system)


def test_pathways_that_sympy_cannot_form() -> None:
    wall, system = begun()
    arm = RigidBody("arm")
    system.add_joints(PinJoint("p", wall, arm, joint_axis=wall.z))
    r = sp.Symbol("r", positive=True)
    ends = wall.masscenter.locatenew("A", r * wall.x), wall.masscenter.locatenew("B", r * arm.y)
    system.add_actuators(ForceActuator(sp.Symbol("F"), WrappingPathway(*ends, WrappingCylinder(r, wall.masscenter, wall.z))))
    assert "SymPy does not form the loads of the actuator ForceActuator: Cannot compute" in refused(system)


def test_two_joints_that_carry_one_body() -> None:
    wall, system = begun()
    a, b = RigidBody("a"), RigidBody("b")
    system.add_joints(PinJoint("p", wall, a), PinJoint("r", a, b))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        system.add_joints(PinJoint("s", wall, b))
    assert "joints r and s both carry the body b" in refused(system)


def built(change: Callable[[System], None]) -> System:
    system = placed(True)
    change(system)
    return system


def test_kinematic_equations_that_leave_speeds_open() -> None:
    x, v, w = dynamicsymbols("x v w")
    few = built(lambda s: setattr(s, "kdes", [x.diff() - v]))
    assert "do not give each of the speeds v(t), w(t)" in refused(few)
    same = built(lambda s: setattr(s, "kdes", [x.diff() - v - w, x.diff() * 2 - v - w]))
    assert "do not determine the speeds" in refused(same)
