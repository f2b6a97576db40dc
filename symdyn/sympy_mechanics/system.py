"""sympy.physics.mechanics.System as a System of symdyn's: bodies, joints, loads, actuators, constraints."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import sympy as sp

from symdyn.errors import ArgumentError, ModelError
from symdyn.model.bodies import Body
from symdyn.model.system import System
from symdyn.shown import shown
from symdyn.sympy_mechanics.joints import Placed, converted
from symdyn.sympy_mechanics.taken import Taken, functions_of_time

if TYPE_CHECKING:
    from sympy.physics.mechanics import System as SympySystem

    from symdyn.given import Numbers


def from_system(system: SympySystem, name: str = "system", defaults: Numbers | None = None,
                initial: Numbers | None = None) -> System:
    """A System of sympy.physics.mechanics as a System: recursions, reactions and pictures come with it.

    name       of files and functions; defaults: numbers for parameters; initial: for coordinates, speeds, states and inputs

    Bodies have their origin at their centre of mass. The ground is the body with the frame of the system, or the frame with its
    fixed point. PinJoint, PrismaticJoint, CylindricalJoint, SphericalJoint and WeldJoint become Revolute, Prismatic, Cylindrical,
    Spherical and Fixed, other joints and bodies that are placed without a joint Custom. Points, intermediate frames and axes of
    joints are taken over; speeds keep their names, and kinematic equations besides u = q' become chosen speeds (set_speeds).
    Gravity that acts on all bodies becomes that of the system; springs, dampers and force actuators along straight lines become
    forces between points, other actuators the loads that they say; muscles bring their states. Constraints keep their
    expressions; functions of time that are no coordinates or speeds become inputs.

    Raises ArgumentError for other objects, ModelError with all faults: bodies that nothing places, joints that lead towards the
    ground, loads at points and frames that no body carries, auxiliary speeds, expressions that symdyn does not take.

    >>> from sympy.physics.mechanics import PinJoint, RigidBody, System
    >>> wall, arm, g = RigidBody("wall"), RigidBody("arm"), sp.Symbol("g")
    >>> described = System.from_newtonian(wall)
    >>> described.add_joints(PinJoint("hinge", wall, arm, child_point=-arm.x, joint_axis=wall.z))
    >>> described.apply_uniform_gravity(-g * wall.y)
    >>> sd.from_system(described, "arm").embedding().F_tilde
    Matrix([[-arm_mass*g*cos(q_hinge)]])
    """
    from sympy.physics.mechanics import System as Described

    if not isinstance(system, Described):
        raise ArgumentError(f"from_system was given {shown(system)} of type {type(system).__name__}; pass a "
                            "sympy.physics.mechanics.System (sd.from_sympy takes a KanesMethod or a LagrangesMethod)")
    return _Conversion(system, name).converted(defaults, initial)


class _Conversion:
    """Takes one system over; `faults` collects what is wrong."""

    def __init__(self, source: Any, name: str) -> None:
        self.source = source
        states = [z for actuator in source.actuators for z in getattr(actuator, "x", ())]
        self.taken = Taken(name, source.q, source.u, states)
        self.faults = self.taken.faults
        self.name = name
        self.placed: dict[int, Placed] = {}

    def converted(self, defaults: Any, initial: Any) -> System:
        """The system. Raises ModelError with all faults."""
        source = self.source
        if len(source.u_aux):
            self.faults.append(f"the system has the auxiliary speeds {', '.join(map(str, source.u_aux))}, which bring reactions "
                               f"into evidence; leave them out: reactions come from the equations, eq.explicit('reactions')")
        gravity, loads = self._gravity()
        N = source.frame
        weight = list(self._take("gravity", gravity.to_matrix(N)))
        result = System(self.name if isinstance(self.name, str) else "system", gravity=weight)
        self.system = result
        self.ground = Placed(result.ground, None, source.fixed_point, N)
        self._bodies()
        for load in loads:
            self._load(load)
        for actuator in source.actuators:
            self._actuator(actuator)
        for k, e in enumerate(source.holonomic_constraints):
            result.add_constraint(self._take(f"holonomic constraint {k + 1}", e), f"holonomic_{k + 1}")
        own = source.nonholonomic_constraints if source._vel_constrs is None else source.velocity_constraints
        for k, e in enumerate(own):
            result.add_constraint(self._take(f"velocity constraint {k + 1}", e), f"velocity_{k + 1}")
        self._speeds()
        symbols = self.taken.symbols(defaults, initial, None, result.duration)
        result.defaults.update(symbols.defaults)
        result.initial.update(symbols.initial)
        return result

    def _take(self, what: str, e: Any) -> Any:
        """An expression or matrix in symdyn's symbols; dynamic functions that are no coordinates become inputs."""
        self.taken.use(what, e, accelerations=True)
        return sp.sympify(e, strict=True).xreplace(self.taken.same)

    # -- bodies and joints

    def _bodies(self) -> None:
        source = self.source
        joints = {id(joint.child): joint for joint in source.joints}
        for joint in source.joints:
            if joints[id(joint.child)] is not joint:
                self.faults.append(f"joints {joint.name} and {joints[id(joint.child)].name} both carry the body "
                                   f"{joint.child.name}; let one of them be holonomic constraints")
        waiting = list(source.bodies)
        for body in list(waiting):
            if getattr(body, "frame", None) == source.frame:
                self.placed[id(body)] = self.ground.at(body)
                waiting.remove(body)
                if id(body) in joints:
                    self.faults.append(f"joint {joints[id(body)].name} leads from {joints[id(body)].parent.name} to the ground "
                                       f"{body.name}; exchange its parent and its child")
        while waiting:
            ready = [b for b in waiting if id(b) not in joints or id(joints[id(b)].parent) in self.placed]
            if not ready:
                names = ", ".join(b.name for b in waiting)
                self.faults.append(f"no joint leads from the ground to the bodies {names}; give one of them a joint whose parent "
                                   f"is on the ground, or place it in the frame of the system")
                return
            for body in ready:
                waiting.remove(body)
                joint = joints.get(id(body))
                frame = getattr(body, "frame", None) or (joint.child_interframe if joint is not None else self.source.frame)
                placed = Placed(self._body(body, frame), body, body.masscenter, frame)
                if joint is None:
                    self._free(placed)
                else:
                    self._joined(joint, self.placed[id(joint.parent)], placed)
                self.placed[id(body)] = placed

    def _body(self, body: Any, frame: Any) -> Body:
        what = f"body {body.name}"
        inertia = self._take(what, body.central_inertia.to_matrix(frame)) if hasattr(body, "central_inertia") else None
        return self.system.add_body(body.name, mass=self._take(what, body.mass), inertia=inertia)

    def _joined(self, joint: Any, parent: Placed, child: Placed) -> None:
        try:
            made = converted(joint, parent, child, self._take)
        except ModelError as error:
            self.faults += error.faults
            return
        self.system.add_joint(made)

    def _free(self, placed: Placed) -> None:
        """A body that no joint carries, placed in the frame of the system: fixed, or by coordinates of its own."""
        from symdyn.model.joints import Custom, Fixed

        name, source = placed.source.name, self.source
        try:
            R = source.frame.dcm(placed.frame)
            p = placed.origin.pos_from(source.fixed_point).to_matrix(source.frame)
        except ValueError:
            self.faults.append(f"the body {name} has no joint, and its place in the frame {source.frame} is not known; give it a "
                               f"joint, or orient its frame and set the position of its centre of mass from the fixed point of "
                               "the system")
            return
        R, p = self._take(f"the place of body {name}", R), self._take(f"the place of body {name}", p)
        used = [q for q in self.taken.coordinates if q in R.free_symbols | p.free_symbols]
        if used:
            speeds = [self._speed_of(q) for q in used]
            self.system.add_joint(Custom(f"{name}_placed", self.system.ground, placed.body, used, R, p, speeds=speeds))
        else:
            self.system.add_joint(Fixed(f"{name}_placed", self.system.ground, placed.body, parent_point=p, parent_rotation=R))

    def _speed_of(self, q: sp.Symbol) -> sp.Symbol:
        """The speed that is the derivative of a coordinate by the kinematic equations, else its derivative."""
        rate = next(f for f, symbol in self.taken.same.items() if symbol == q.dot)
        for kde in self.source.kdes:
            rest = sp.expand(kde - kde.coeff(rate) * rate)
            own = [u for u in self.source.u if rest in (u, -u) and kde.coeff(rate) in (1, -1) and rest == -kde.coeff(rate) * u]
            if own:
                return self.taken.same[own[0]]  # type: ignore[no-any-return]
        return q.dot

    def _speeds(self) -> None:
        """Speeds that kinematic equations choose, besides u = q'."""
        source = self.source
        plain = {u for joint in self.system.joints for u in (joint.speeds or ())}
        chosen = [u for u in source.u if self.taken.same[u] not in plain and self.taken.same[u] not in
                  {q.dot for q in self.taken.coordinates}]
        if not chosen:
            return
        rows = [sp.sympify(e, strict=True) for e in source.kdes]
        A = sp.Matrix(rows).jacobian(list(source.u))
        if A.rows != A.cols or any(e.has(*source.u) for e in A):
            self.faults.append(f"the kinematic equations do not give each of the speeds {', '.join(map(str, source.u))} by the "
                               "derivatives of the coordinates; pass as many, linear in the speeds")
            return
        try:
            solved = A.LUsolve(-sp.Matrix(rows).xreplace(dict.fromkeys(source.u, 0)))
        except (ValueError, sp.matrices.exceptions.NonInvertibleMatrixError):
            self.faults.append("the kinematic equations do not determine the speeds from the derivatives of the coordinates; "
                               "their coefficients of the speeds are singular")
            return
        for joint in self.system.joints:
            joint.speeds = None
        self.system.set_speeds({self.taken.same[u]: self._take(f"the speed {u}", e)
                                for u, e in zip(source.u, solved, strict=True)})

    # -- loads

    def _gravity(self) -> tuple[Any, list[Any]]:
        """The acceleration of gravity that acts on all bodies with mass, and the other loads."""
        from sympy.physics.mechanics import Force, Vector

        source, N = self.source, self.source.frame
        result: dict[Any, list[Any]] = {}
        for load in source.loads:
            body = next((b for b in source.bodies if isinstance(load, Force) and load.point == b.masscenter), None)
            if body is not None and body.mass != 0:
                a = (load.force / body.mass).to_matrix(N).applyfunc(sp.cancel) if self._in(load.force, N) else None
                mass = sp.sympify(body.mass, strict=True)
                if a is not None and not functions_of_time(a) and not a.free_symbols & mass.free_symbols:
                    result.setdefault(sp.ImmutableMatrix(a), []).append((body, load))
        moving = [b for b in source.bodies if getattr(b, "frame", None) != N and b.mass != 0]
        for a, pairs in result.items():
            pulled = {id(body) for body, _ in pairs}
            if moving and {id(b) for b in moving} <= pulled and len(pulled) == len(pairs):
                taken = [load for _, load in pairs]
                vector = sum((e * axis for e, axis in zip(a, (N.x, N.y, N.z), strict=True)), Vector(0))
                return vector, [load for load in source.loads if not any(load is other for other in taken)]
        return Vector(0), list(source.loads)

    @staticmethod
    def _in(vector: Any, frame: Any) -> bool:
        """Whether a vector is written in one frame."""
        return all(written == frame for _, written in vector.args)

    def _load(self, load: Any, label: str = "") -> None:
        from sympy.physics.mechanics import Force, Torque

        if isinstance(load, Force):
            place = self._carrier(load.point)
            if place is None:
                self.faults.append(f"{label or 'a force'} acts at the point {load.point}, which no body carries at a constant "
                                   f"place; let it act at a point of a body")
            elif place[0] is not self.ground:
                body, at = place
                for components, frame in self._pieces(load.force, f"the force at {load.point}"):
                    self.system.add_force(body.body, components, point=at, frame=frame)
        elif isinstance(load, Torque):
            owner = self._owner(load.frame)
            if owner is None:
                self.faults.append(f"{label or 'a torque'} acts on the frame {load.frame}, which no body carries; let it act on "
                                   f"the frame of a body")
            elif owner is not self.ground:
                for components, frame in self._pieces(load.torque, f"the torque on {load.frame}"):
                    self.system.add_torque(owner.body, components, frame=frame)
        else:
            self.faults.append(f"the load {shown(load)} is of type {type(load).__name__}; pass Force and Torque of "
                               "sympy.physics.mechanics")

    def _pieces(self, vector: Any, what: str) -> list[tuple[list[Any], Body | None]]:
        """A vector by frames of bodies, None: the n-frame."""
        pieces = []
        for components, frame in vector.args:
            owner = self._owner(frame)
            if owner is None:
                owner, components = self.ground, self.source.frame.dcm(frame) * components
            elif owner.frame != frame:
                components = owner.frame.dcm(frame) * components
            pieces.append((list(self._take(what, components)), None if owner is self.ground else owner.body))
        return pieces

    def _actuator(self, actuator: Any) -> None:
        from sympy.physics.mechanics import ForceActuator, LinearDamper, LinearPathway, LinearSpring

        what = f"actuator {type(actuator).__name__}"
        pathway: Any = getattr(actuator, "pathway", None)
        ends = [self._carrier(point) for point in pathway.attachments] if type(pathway) is LinearPathway else []
        result = [end for end in ends if end is not None]
        if not isinstance(actuator, ForceActuator) or len(result) != 2 or result[0][0] is result[1][0]:
            try:
                loads = actuator.to_loads()
            except (NotImplementedError, ValueError) as error:
                self.faults.append(f"SymPy does not form the loads of the {what}: {error}; describe it by loads at points of "
                                   "bodies")
                loads = []
            for load in loads:
                self._load(load, what)
        else:
            (a, at_a), (b, at_b) = result
            bodies, points = (a.body, b.body), (list(at_a), list(at_b))
            if type(actuator) is LinearSpring:
                self.system.add_spring_damper(*bodies, *points, stiffness=self._take(what, actuator.stiffness),
                                              length=self._take(what, actuator.equilibrium_length))
            elif type(actuator) is LinearDamper:
                self.system.add_spring_damper(*bodies, *points, damping=self._take(what, actuator.damping))
            else:
                self.system.add_force_between(*bodies, -self._take(what, actuator.force.doit()), *points)
        states = list(getattr(actuator, "x", ()))
        if states:
            for z, rate in zip(states, actuator.rhs(), strict=True):
                self.system.add_state(self.taken.same[z], self._take(f"the rate of {z}", rate))

    def _carrier(self, point: Any) -> tuple[Placed, Any] | None:
        """The body that a point is fixed to, and where on it."""
        every: Sequence[Placed] = [*self.placed.values(), self.ground]
        for placed in sorted(every, key=lambda p: p.origin != point):
            try:
                at = point.pos_from(placed.origin).to_matrix(placed.frame)
            except ValueError:
                continue
            if functions_of_time(at):
                at = at.applyfunc(sp.trigsimp)
            if not functions_of_time(at):
                body = self.ground if placed.body is self.system.ground else placed
                return (body, self._take(f"the point {point}", at + placed.offset)) if body is self.ground else (
                    placed, self._take(f"the point {point}", at))
        return None

    def _owner(self, frame: Any) -> Placed | None:
        """The body that a frame is fixed to."""
        every = [*self.placed.values(), self.ground]
        for placed in sorted(every, key=lambda p: p.frame != frame):
            try:
                R = placed.frame.dcm(frame)
            except ValueError:
                continue
            if not functions_of_time(R):
                return self.ground if placed.body is self.system.ground else placed
        return None
