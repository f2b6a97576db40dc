"""System: the description of a mechanism by bodies, joints and loads."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from types import NoneType
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
import sympy as sp

from symdyn.counting import counted
from symdyn.errors import ModelError
from symdyn.facade import SystemFacade
from symdyn.model.bodies import Body
from symdyn.model.check import check
from symdyn.model.closures import Constraint, Gear
from symdyn.model.contacts.contact import Contact
from symdyn.model.contacts.group import ContactGroup, LoweredGroup
from symdyn.model.contacts.joints import JointElement
from symdyn.model.contacts.lowering import CompliantContact, RigidContact
from symdyn.model.elements import AddedMass, Element
from symdyn.model.event import Event, make_event
from symdyn.model.faults import Faults, matrix_of
from symdyn.model.flexible_body import FlexibleBody, flexible_body
from symdyn.model.joints import Free, Joint
from symdyn.model.loads import Force, ForceBetween, JointForce, SpringDamper, Torque
from symdyn.model.orientation import EulerAngles
from symdyn.model.points import Point
from symdyn.model.record import Model, NamedOutput
from symdyn.model.shapes import Drawn, drawn
from symdyn.model.state import State
from symdyn.model.symbols import Coordinate, as_coordinate
from symdyn.model.sympy_vectors import as_frame, as_point, frames_of, is_dyadic, is_point, is_sympy_vector
from symdyn.real_numbers import length_of
from symdyn.shown import shown

if TYPE_CHECKING:
    from symdyn.flexible.beam import Beam
    from symdyn.flexible.modal_body import ModalBody
    from symdyn.given import (
        BodyOrName,
        Frame,
        Inertia,
        JointOrName,
        MechanicsPoint,
        Named,
        Numbers,
        Scalar,
        Vector,
    )
    from symdyn.model.shapes import Shape

ZERO = (0, 0, 0)
Closure = TypeVar("Closure", Joint, Gear)
Load = TypeVar("Load", Element, AddedMass)
ContactLike = TypeVar("ContactLike", bound=Contact | JointElement | ContactGroup)


class System(SystemFacade):
    """A mechanism: bodies joined in a tree that starts at the ground, with loads, inputs and outputs.

    name         used for generated files
    gravity      acceleration of gravity in the n-frame, m/s^2: 3 components, or 2 for a planar system
    planar       True: motion in the x-y plane, described by x, y, theta; default: gravity has 2 components
    parameters   if given, the only symbols that count as parameters, in this order; default: declared by use
    frame, origin   the n-frame and its origin as a ReferenceFrame and a Point of sympy.physics.mechanics, if there are already:
                 `system.frame`, `system.ground.origin`

    `ground` is the inertial n-frame (or, after `move_ground`, the moving base). `defaults` holds a number for each
    parameter, `initial` for coordinates, speeds, states and inputs, `duration` the usual time of simulation, `units`
    the unit of a symbol where it cannot be inferred from its use. Faults are collected while describing; `check()` and
    every formulation raise them all in one ModelError.

    >>> q, = sd.coordinates("q,")
    >>> m, l, g = sd.parameters("m l g")
    >>> system = sd.System("pendulum", gravity=[0, -g])
    >>> bob = system.add_body("bob", mass=m, com=[0, -l])
    >>> pivot = system.add_joint(sd.Revolute("pivot", system.ground, bob, q))
    >>> system.embedding().M_tilde
    Matrix([[l**2*m]])
    """

    def __init__(self, name: str, gravity: Vector | None = None, planar: bool | None = None,
                 parameters: Sequence[sp.Symbol] | None = None, frame: Frame | None = None,
                 origin: MechanicsPoint | None = None) -> None:
        self.name = name
        self._faults = Faults()
        self._warned: set[str] = set()
        if not isinstance(planar, (bool, np.bool_, NoneType)):
            self._faults.append(f"planar is {shown(planar)}; pass True, False or None")
            planar = None
        frame = self._of_sympy(as_frame, frame, "the system's frame")
        origin = self._of_sympy(as_point, origin, "the system's origin")
        if planar is None:
            planar = length_of(gravity) == 2
        self.planar = planar
        self.gravity = self._faults.vector(ZERO if gravity is None else gravity, "gravity", planar, frame)
        self.ground = Body("ground", sp.S.Zero, sp.ImmutableMatrix(sp.zeros(3, 3)), sp.ImmutableMatrix(sp.zeros(3, 1)), frame,
                           origin)
        self.declared = None if parameters is None else self._declared(parameters)
        self.bodies: list[Body] = []
        self.joints: list[Joint] = []
        self.loads: list[Any] = []
        self.outputs: list[NamedOutput] = []
        self.states: list[State] = []
        self.constraints: list[Constraint] = []
        self.events: list[Event] = []
        self.loops: list[Joint | Gear] = []
        self.contacts: list[Contact | JointElement] = []
        self.rigid_contacts: list[RigidContact] = []
        self.compliant_contacts: list[CompliantContact] = []
        self.contact_groups: list[ContactGroup] = []
        self.lowered_groups: list[LoweredGroup] = []
        self.ground_motion: Joint | None = None
        self.shapes: list[Drawn] = []
        self.extra_coordinates: list[sp.Symbol] = []
        self.chosen_speeds: dict[sp.Symbol, sp.Expr] = {}
        self.defaults: dict[Any, float] = {}
        self.initial: dict[Any, float] = {}
        self.duration = 10.0
        self.units: dict[Any, str] = {}

    @property
    def frame(self) -> Frame:
        """The n-frame as a ReferenceFrame of SymPy, for vectors such as `force=-k*x*system.frame.x`.

        >>> system = sd.System("space")
        >>> system.frame
        ground
        """
        return self.ground.frame

    # -- bodies and joints

    def add_body(self, name: str, mass: Scalar = 0, inertia: Inertia | None = None, com: Vector = ZERO,
                 frame: Frame | None = None, origin: MechanicsPoint | None = None) -> Body:
        """Add a rigid body, or a point mass where no inertia is given.

        mass      kg
        inertia   about the centre of mass in body axes, kg m^2: (3, 3), or its diagonal; planar: one number about z
        com       centre of mass from the body's origin, body axes, m
        frame     the body axes as a ReferenceFrame of sympy.physics.mechanics, if there is one already: inertia may be a dyadic,
                  and com a vector, written in it. Later `body.frame` is the frame that vectors of the body are written in
        origin    the body's origin as a Point of sympy.physics.mechanics, if there is one already: com, and later points of the
                  body, may be Points that are located from it; `body.origin`

        >>> system = sd.System("plane", gravity=[0, -9.81])
        >>> system.add_body("cart", mass=2.0, com=[0.1, 0]).name
        'cart'
        """
        where = f"body {shown(name)}"
        faults = self._faults
        frame = self._of_sympy(as_frame, frame, f"{where}: frame")
        origin = self._of_sympy(as_point, origin, f"{where}: origin")
        if inertia is None:
            matrix = sp.ImmutableMatrix(sp.zeros(3, 3))
        elif self.planar and not hasattr(inertia, "__len__") and not is_dyadic(inertia):
            matrix = matrix_of(3, 3, *[sp.S.Zero] * 8, faults.expression(inertia, f"{where}: inertia"))
        else:
            matrix = faults.matrix(inertia, f"{where}: inertia", frame)
        if is_point(com):
            com = faults.located(com, origin, f"{where}: com")
        body = Body(name, faults.expression(mass, f"{where}: mass"), matrix,
                    faults.vector(com, f"{where}: com", self.planar, frame), frame, origin)
        self.bodies.append(body)
        return body

    def add_joint(self, joint: Joint) -> Joint:
        """Add a joint; parent and child may be given as bodies or by name.

        >>> system = sd.System("plane", gravity=[0, -9.81])
        >>> cart = system.add_body("cart", mass=2.0)
        >>> system.add_joint(sd.Prismatic("rail", system.ground, cart, axis=[1, 0])).coordinates
        (q_rail,)
        """
        if not isinstance(joint, Joint):
            self._faults.append(f"add_joint was given {shown(joint)}; pass a joint such as sd.Revolute(...)")
        else:
            self.joints.append(joint)
        return joint

    def add_flexible_body(self, name: str, beam: Beam | ModalBody, coordinates: Sequence[sp.Symbol] | None = None,
                          stiffness: Scalar = 1, damping: Scalar = 1, carries: bool = True) -> FlexibleBody:
        """Add a beam that bends in assumed modes; its clamped end is a body for joints, its free end another.

        beam          sd.Beam(...), or its integrals
        coordinates   elastic coordinates, one a mode; default: named after the body and the modes
        stiffness, damping   factors of the beam's stiffness and damping, numbers or parameters
        carries       whether anything sits on the free end; without, its frame stays at the clamped end and costs nothing

        The kinetic energy is complete to second order in the elastic coordinates and their derivatives, their coupling with large
        motions of the clamped end, centrifugal and gravity stiffening included; see symdyn.flexible.ModalBody. Returns the bodies
        `root` and `tip`, both with the axes of the beam's frame where it is straight, and the coordinates. Raises ModelError if
        beam is none.

        >>> system = sd.System("mast", gravity=[0, 0, -9.81])
        >>> mast = system.add_flexible_body("mast", sd.Beam([0, 1], 0.5, 20.0, 1, length=3.0))
        >>> clamp = system.add_joint(sd.Fixed("clamp", system.ground, mast.root))
        >>> system.embedding().M_tilde.shape
        (1, 1)
        """
        body = flexible_body(name, beam, coordinates, stiffness, damping, carries)
        self.bodies += [body.root, body.tip]
        self.joints.append(body.joint)
        return body

    def close_loop(self, joint: Closure) -> Closure:
        """A joint between two bodies that are already in the tree, an sd.Rod, or an sd.Gear: it becomes constraints.

        Joints of all kinds but Free close loops: Fixed, Revolute, Prismatic, Cylindrical, Universal, Planar, Spherical, Helical,
        Custom. Their coordinates do not become coordinates of the system, except those of Helical and Custom joints: give none to
        the others.

        >>> system = sd.System("bar", gravity=[0, -9.81])
        >>> bar = system.add_body("bar", mass=1.0, inertia=0.1, com=[0.5, 0])
        >>> joint = system.add_joint(sd.Planar("free", system.ground, bar))
        >>> rod = system.close_loop(sd.Rod("rod", system.ground, bar, length=1.0))
        >>> system.augmented().constraints
        ('rod',)
        """
        if not isinstance(joint, (Joint, Gear)):
            self._faults.append(f"close_loop was given {shown(joint)}; pass a joint such as sd.Revolute(...), an sd.Rod or an "
                                "sd.Gear")
        else:
            self.loops.append(joint)
        return joint

    def add_coordinate(self, *coordinates: sp.Expr) -> None:
        """Coordinates that no joint has for its own, to be used in the expressions of joints: with an absolute angle phi,
        the joint after one with angle q takes coordinate=phi - q.

        >>> a, b = sd.coordinates("a b")
        >>> system = sd.System("points", gravity=[0, -9.81])
        >>> system.add_coordinate(a, b)
        """
        for given in coordinates:
            taken = as_coordinate(given)
            if isinstance(taken, Coordinate):
                self.extra_coordinates.append(taken)
            else:
                self._faults.append(f"add_coordinate was given {shown(given)}; make coordinates with sd.coordinates and pass "
                                    "them "
                                    "one by one")

    def set_speeds(self, speeds: Mapping[sp.Symbol, Scalar]) -> System:
        """Choose the generalized speeds: u -> an expression that is linear in the derivatives of the coordinates.

        speeds   symbols made by sd.speeds("u1 u2"), with expressions A(q, t) q_dot + a(q, t) of the coordinates, their
                 derivatives, the speeds that the joints would have, and of sd.angular_velocity(body)[i] and sd.velocity(body,
                 point)[i], such as {u1: q1.dot + l * q2.dot, u2: q2.dot}

        As many as the joints have speeds, so that they can be solved for these; loops and constraints keep their multipliers. Or
        fewer, by as many as there are velocity constraints (add_constraint with speeds): these are then fulfilled by the choice,
        and the equations have no multipliers (Kane's independent speeds). Equations are printed and run in the chosen speeds;
        loads, outputs, events and constraints may use these and the derivatives of the coordinates. Called again, it replaces
        the choice; an empty mapping takes it back. Returns the system; what is wrong is reported by `check()`.

        >>> system = sd.systems.double_pendulum()
        >>> q1, q2 = system.check().coordinates
        >>> u1, u2 = sd.speeds("u1 u2")
        >>> system.set_speeds({u1: q1.dot, u2: q1.dot + q2.dot}).embedding().M_tilde.shape
        (2, 2)
        """
        if not isinstance(speeds, Mapping):
            self._faults.append(f"set_speeds was given {shown(speeds)}; pass a mapping from symbols to expressions, such as "
                                "{u1: q1.dot + q2.dot}")
            return self
        self.chosen_speeds = {}
        for given, expression in speeds.items():
            symbol = as_coordinate(given)
            if isinstance(symbol, Coordinate):
                self.chosen_speeds[symbol] = self._faults.expression(expression, f"the speed {symbol}")
            else:
                self._faults.append(f"set_speeds was given {shown(given)} as a speed; pass a symbol such as sd.speeds('u1')")
        return self

    def move_ground(self, position: Vector = ZERO, angles: Sequence[Scalar] = ZERO, sequence: str = "ZYX") -> None:
        """Give the ground a prescribed motion: position (m) and Euler angles (rad), of t, motions (sd.motions) and parameters.

        >>> system = sd.systems.pendulum()
        >>> system.move_ground([sp.cos(sd.t) / 10, 0])
        >>> system.embedding().F_tilde - system.embedding().k_tilde
        Matrix([[-g*l*m*sin(q1) + l*m*cos(t)*cos(q1)/10]])
        """
        p = self._faults.vector(position, "move_ground: position", self.planar)
        turned = self._faults.vector(angles, "move_ground: angles")
        moving = Free("ground_motion", "inertial", "ground", ZERO * 2, EulerAngles(sequence))
        moving.coordinates = (*p, *turned)
        self.ground_motion = moving

    # -- loads

    def add_force(self, body: BodyOrName, force: Vector, point: Vector | None = None, frame: BodyOrName | None = None,
                  reaction: BodyOrName | None = None, name: str = "") -> None:
        """A force (N) on a body.

        point     where it acts, body axes, m; default: the centre of mass
        frame     the body in whose axes the components are given; default: the n-frame. A vector of SymPy's, such as
                  F*body.frame.x, has its frame with it: that of a body, or `system.frame`
        reaction  the body that feels the opposite force at the same place, if any

        >>> system = sd.systems.pendulum()
        >>> F = sd.inputs("F")
        >>> system.add_force("bob", [F, 0])
        >>> system.embedding().F_tilde
        Matrix([[l*(-g*m*sin(q1) + F*cos(q1))]])
        """
        label = self._label(name, f"force_{len(self.loads) + 1}")
        at = None if point is None else self._faults.point(point, f"{label}: point", True, self._body(body))
        frame, axes = self._written_in(force, frame, label)
        self.loads.append(Force(body, self._faults.vector(force, label, self.planar, axes), at, frame, reaction, label))

    def add_torque(self, body: BodyOrName, torque: Scalar | Vector, frame: BodyOrName | None = None,
                   reaction: BodyOrName | None = None, name: str = "") -> None:
        """A torque (N m) on a body: 3 components, or one number about z in a planar system; see add_force.

        >>> system = sd.systems.pendulum()
        >>> system.add_torque("bob", 2.0)
        >>> system.embedding().F_tilde
        Matrix([[-g*l*m*sin(q1) + 2]])
        """
        label = self._label(name, f"torque_{len(self.loads) + 1}")
        if self.planar and not hasattr(torque, "__len__") and not is_sympy_vector(torque):
            torque = [0, 0, torque]
        frame, axes = self._written_in(torque, frame, label)
        self.loads.append(Torque(body, self._faults.vector(torque, label, frame=axes), frame, reaction, label))

    def add_joint_force(self, joint: JointOrName, value: Scalar | Sequence[Scalar], name: str = "") -> None:
        """Drive a joint: the torque (N m) or force (N) along each of its speeds, acting between its two bodies.

        >>> system = sd.systems.pendulum()
        >>> q, = system.initial
        >>> system.add_joint_force("pivot", -q.dot / 4)
        >>> system.embedding().F_tilde
        Matrix([[-g*l*m*sin(q1) - q1_dot/4]])
        """
        label = self._label(name, f"joint_force_{len(self.loads) + 1}")
        self.loads.append(JointForce(joint, self._faults.expressions(value, label), label))

    def add_spring_damper(self, body_a: BodyOrName, body_b: BodyOrName, point_a: Vector = ZERO, point_b: Vector = ZERO,
                          stiffness: Scalar = 0, damping: Scalar = 0, length: Scalar = 0, name: str = "") -> None:
        """A spring (N/m, unstretched length m) and damper (N s/m) between a point of body_a and one of body_b.

        Both ends are pulled by stiffness (distance - length) + damping times the rate of the distance. Stiffness, damping and
        length are numbers or expressions as for a force. A spring whose stiffness and length depend on parameters only has a
        potential energy; any other is a load that does work, like a force.

        >>> system = sd.System("oscillator")
        >>> block = system.add_body("block", mass=2)
        >>> rail = system.add_joint(sd.Prismatic("rail", system.ground, block, axis=[1, 0, 0]))
        >>> system.add_spring_damper(system.ground, block, point_a=[-1, 0, 0], stiffness=50, length=1)
        >>> system.embedding().F_tilde
        Matrix([[(-50 + 50/Abs(q_rail + 1))*(q_rail + 1)]])
        """
        label = self._label(name, f"spring_{len(self.loads) + 1}")
        f = self._faults
        self.loads.append(SpringDamper(
            body_a, body_b, f.point(point_a, f"{label}: point_a", True, self._body(body_a)),
            f.point(point_b, f"{label}: point_b", True, self._body(body_b)),
            f.expression(stiffness, f"{label}: stiffness"), f.expression(damping, f"{label}: damping"),
            f.expression(length, f"{label}: length"), label))

    def add_force_between(self, body_a: BodyOrName, body_b: BodyOrName, force: Scalar, point_a: Vector | None = None,
                          point_b: Vector | None = None, name: str = "") -> None:
        """A force (N) along the line of a point of body_a and a point of body_b; positive where it draws them together.

        force   any expression, such as a law in d = sd.distance(body_a, body_b, point_a, point_b) and its rate d.dot: a rope
                that only pulls is Max(0, k*(d - length) + c*d.dot)
        point_a, point_b   body axes, m; default: the origins

        >>> system = sd.systems.pendulum()
        >>> r = sd.distance(system.ground, "bob", [1, 0], [0, -1])
        >>> system.add_force_between(system.ground, "bob", 5 / r**2, [1, 0], [0, -1])
        """
        label = self._label(name, f"force_{len(self.loads) + 1}")
        f = self._faults
        points = [f.point(ZERO if point is None else point, f"{label}: {what}", True, self._body(body))
                  for point, what, body in ((point_a, "point_a", body_a), (point_b, "point_b", body_b))]
        self.loads.append(ForceBetween(body_a, body_b, f.expression(force, label), points[0], points[1], label))

    def add_load(self, load: Load) -> Load:
        """Add a load that follows from the pose and motion of a body, such as sd.Buoyancy or sd.MooringLine, or added mass.

        >>> system = sd.systems.pendulum()
        >>> drag = system.add_load(sd.LinearDamping("bob", [0, 0, 0, 0, 0, 0.1]))
        >>> system.embedding().F_tilde
        Matrix([[-g*l*m*sin(q1) - 0.1*q1_dot]])
        """
        if not isinstance(load, (Element, AddedMass)):
            self._faults.append(f"add_load was given {shown(load)}; pass a load such as sd.Buoyancy(...) or "
                                "sd.LinearDamping(...)")
        else:
            load.label = load.label or f"{load.kind}_{len(self.loads) + 1}"
            self.loads.append(load)
        return load

    def add_contact(self, contact: ContactLike) -> ContactLike:
        """Add a contact between two bodies, see Contact, or a Stop, Backlash, OneWayClutch, JointFriction or Rope, whose results
        are `Solution.contacts[name]`; or a group of many bodies that touch one another, see ContactGroup.

        >>> system = sd.System("ball", gravity=[0, -9.81])
        >>> ball = system.add_body("ball", mass=1.0)
        >>> joint = system.add_joint(sd.Prismatic("height", system.ground, ball, axis=[0, 1]))
        >>> system.add_contact(sd.Contact("floor", ball, system.ground, restitution=0.8)).name
        'floor'
        """
        if isinstance(contact, ContactGroup):
            self.contact_groups.append(contact)
        elif not isinstance(contact, (Contact, JointElement)):
            self._faults.append(f"add_contact was given {shown(contact)}; pass sd.Contact(...), sd.ContactGroup(...), "
                                "sd.Stop(...), sd.Backlash(...), sd.OneWayClutch(...), sd.JointFriction(...) or sd.Rope(...)")
        else:
            self.contacts.append(contact)
        return contact

    # -- outputs, states, constraints

    def add_output(self, name: str, value: Scalar | Vector | Point) -> None:
        """A named output: an expression in coordinates, speeds, states, inputs, t and parameters, a list of them, or
        a point of a body: sd.position, sd.velocity, sd.acceleration, sd.jacobian, sd.bias_acceleration(body, point).

        >>> system = sd.systems.pendulum()
        >>> q, = system.initial
        >>> system.add_output("height", -sp.cos(q))
        >>> system.compile(backend="numpy").simulate((0, 1)).outputs["height"].shape
        (1001,)
        """
        if isinstance(value, Point):
            at = self._faults.point(value.at, f"output {shown(name)}: point", True, self._body(value.body))
            taken: Any = Point(value.body, tuple(at), value.quantity)
        elif hasattr(value, "__len__"):
            taken = self._faults.expressions(value, f"output {shown(name)}")
        else:
            taken = self._faults.expression(value, f"output {shown(name)}")
        self.outputs.append(NamedOutput(name, taken))

    def add_state(self, symbol: sp.Expr, rate: Scalar) -> None:
        """An extra state z with z_dot = rate: of an actuator, a filter, a controller.

        symbol   what z is in the expressions of rates, loads and outputs: made by sd.coordinates("z"), or a symbol of SymPy's
                 mechanics (dynamicsymbols("z")). It has no unit and no inertia; its initial value goes into system.initial[z]
        rate     z_dot, an expression as for add_output

        >>> system = sd.systems.pendulum()
        >>> q, = system.initial
        >>> angle = sd.speeds("angle")
        >>> system.add_state(angle, q)
        >>> len(system.compile(backend="numpy").rhs(0.0, [0.1, 0.0, 0.0]))
        3
        """
        taken = as_coordinate(symbol)
        if not isinstance(taken, Coordinate):
            self._faults.append(f"add_state was given {shown(symbol)} as its state; pass a symbol such as sd.coordinates('z')")
            taken = Coordinate(f"state_{len(self.states) + 1}")
        self.states.append(State(taken, self._faults.expression(rate, f"rate of state {symbol}")))

    def add_constraint(self, expression: Scalar, name: str = "") -> None:
        """A constraint expression = 0 in coordinates, motions and t; with speeds, linear in them, a velocity constraint.

        >>> x, y = sd.coordinates("x y")
        >>> system = sd.System("slope", gravity=[0, -9.81])
        >>> block = system.add_body("block", mass=1, inertia=1)
        >>> plane = system.add_joint(sd.Planar("plane", system.ground, block, [x, y, sd.coordinates("phi")]))
        >>> system.add_constraint(y - x / 2, "slope")
        >>> system.augmented().C_r
        Matrix([[-1/2, 1, 0]])
        """
        unnamed = name is None or (isinstance(name, str) and not name)
        label = f"constraint_{len(self.constraints) + 1}" if unnamed else name
        faults = len(self._faults)
        taken = self._faults.expression(expression, label)
        if len(self._faults) == faults:
            self.constraints.append(Constraint(label, taken))

    def add_event(self, name: str, value: Scalar, direction: int = 0, stop: bool = False,
                  reset: Named[Scalar] | None = None) -> None:
        """An event where a value passes zero: its time and state are found and recorded in every simulation.

        Within every step the value is sampled as finely as it varies, so that zeros close together are found as well (see
        symdyn.panels), and interval arithmetic proves that it does not pass zero between samples; where either has no end,
        simulate warns. Three kinds of values are only sampled: those of inputs given by functions and of functions of the user;
        those of multipliers, reactions and accelerations; and those of over 400 operations. simulate warns of the first, and of
        the others where a function such as exp, Piecewise or a quotient could make a pulse narrower than the samples are apart;
        give it event_spacing, the longest time between samples.

        value      an expression as for add_output, such as sd.position(ball)[1] - h
        direction  1: only upwards through zero, -1: only downwards, 0: either way; in the course of the run, so that in a run
                   backward in time (t decreasing) what falls with t passes upwards, as in SciPy. A value that is zero at the
                   start, to rounding, and leaves in the direction 1 or -1 counts as passing then; with 0 it does not count
        stop       end the motion there
        reset      coordinates, speeds and extra states with expressions for what they become, from the state before the
                   event: {v: -e*v} for a ball that bounces. Events at the same time make their resets in the order in which
                   they were added, each from the state before all of them: of two for one speed the later counts. Without
                   constraints all else stays. With them, and so in absolute coordinates, variables that are reset take their
                   values, and the others follow: they change by as little as the constraints allow in the metric of the mass
                   matrix, coordinates first, then speeds. For speeds that is the impact by impulses along these variables
                   alone, such as in a joint; a speed that is to stay is named, {w: w}. A reset that constraints do not
                   allow ends the run

        >>> system = sd.systems.pendulum()
        >>> q, = system.initial
        >>> system.add_event("lowest", q, stop=True)
        >>> system.compile(backend="numpy").simulate((0, 2)).events["lowest"].t.round(6)
        array([0.666468])
        """
        made = make_event(self._faults, name, value, direction, stop, reset)
        if made is not None:
            self.events.append(made)

    def draw(self, body: BodyOrName, *shapes: Shape, color: str | Sequence[float] | None = None) -> None:
        """Give a body shapes for pictures: shapes of sd.shapes in its axes (Box, Cylinder, Blade, Line; Water for the ground).

        color   text such as '#3377aa', '0.8' or 'orange', or three numbers from 0 to 1; default: one for each body

        >>> system = sd.systems.pendulum()
        >>> system.draw("bob", sd.shapes.Line([[0, 0], [0, -1]]), color="tab:blue")
        """
        self.shapes += drawn(self._faults, body, shapes, color, self.planar)

    def _label(self, name: Any, default: str) -> str:
        """The name of a load or constraint, the default where none is given; anything but text is a fault."""
        if name is None or (isinstance(name, str) and not name):
            return default
        if not isinstance(name, str):
            self._faults.append(f"{default}: its name is {shown(name)}; pass text such as 'spring', or leave it out")
            return default
        return name

    # -- what comes of it

    def check(self) -> Model:
        """The checked, frozen model; it prints as a summary, with `details()` for all of it.

        A doubtful but possible value, such as moments of inertia that no real body has, gives one warning for each system
        (ModelWarning) and stays in the model's `doubts`. Raises ModelError with every fault found.

        >>> sd.systems.pendulum().check().bodies[0].name
        'bob'
        """
        return check(self)

    def _of_sympy(self, demanded: Callable[[Any, str], Any], given: Any, what: str) -> Any:
        """The given ReferenceFrame or Point, read by `demanded`, or None."""
        try:
            return demanded(given, what)
        except ModelError as error:
            self._faults.extend(error.faults)
            return None

    def _body(self, body: Any) -> Any:
        """A body that is given by itself or by name; what is none as it is."""
        return next((b for b in (self.ground, *self.bodies) if isinstance(body, str) and body == b.name), body)

    def _written_in(self, value: Any, frame: Any, label: str) -> tuple[Any, Any]:
        """Axes in which a load is given, None for the n-frame, and the body that has them, by the frame that a SymPy vector is
        written in."""
        if not is_sympy_vector(value) or len(frames_of(value)) != 1:
            return frame, self.ground
        written = frames_of(value)[0]
        named = [b for b in (self.ground, *self.bodies) if isinstance(b.name, str)]
        owner = next((b for b in named if b.frame == written), None)
        if owner is not None and frame is not None and self._body(frame) is not owner:
            self._faults.append(f"{label} is the SymPy vector {value}, written in the axes of {owner.name}, and frame is "
                                f"{getattr(frame, 'name', frame)}; leave out frame")
        return (None if owner is None or owner is self.ground else owner), owner or self.ground

    def _declared(self, given: Any) -> tuple[sp.Symbol, ...]:
        listed = list(given) if isinstance(given, (list, tuple, set, frozenset, Mapping, sp.MatrixBase)) else [given]
        wrong = [p for p in listed if not isinstance(p, sp.Symbol)]
        if wrong:
            self._faults.append(f"parameters has {', '.join(map(shown, wrong[:8]))}; pass a list of symbols, "
                                "such as sd.parameters('m l g')")
        return tuple(p for p in listed if isinstance(p, sp.Symbol))

    def __repr__(self) -> str:
        parts = [counted(len(self.bodies), "body", "bodies"), counted(len(self.joints), "joint")]
        parts += [counted(len(things), one) for things, one in ((self.loops, "loop closure"), (self.constraints, "constraint"))
                  if things]
        return f"System({shown(self.name)}, {', '.join(parts)})"

    def set_defaults(self, defaults: Numbers) -> System:
        """Add numbers for parameters; returns the system.

        >>> m, l, g = sd.parameters("m l g")
        >>> system = sd.systems.pendulum().set_defaults({l: 2.0})
        >>> system.defaults[l]
        2.0
        """
        self.defaults.update(defaults)
        return self

