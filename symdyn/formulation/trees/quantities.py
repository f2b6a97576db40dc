"""Quantities of a tree of links in every formulation: its equations, J, positions, energy, power, the user's outputs."""

from __future__ import annotations

from collections.abc import Mapping
from copy import copy
from dataclasses import replace
from functools import partial
from typing import Any, Self

import numpy as np
import sympy as sp

from symdyn.errors import ModelError
from symdyn.formulation.accelerations import Motion
from symdyn.formulation.identification.quantities import Identification
from symdyn.formulation.loads.acting import Acting, acting, applied_loads
from symdyn.formulation.loads.contact_groups import spheres
from symdyn.formulation.loads.contacts import ContactRows
from symdyn.formulation.loads.implicit import Settled, solve
from symdyn.formulation.loads.recorded import Loads
from symdyn.formulation.names import output_quantity
from symdyn.formulation.probes.inertia_faults import demand_mass_matrix
from symdyn.formulation.trees import mass_matrix as composite
from symdyn.formulation.trees.inertial_forces import inverse_dynamics
from symdyn.formulation.trees.kinematics import Kinematics
from symdyn.formulation.trees.newton_euler import inward, outward
from symdyn.formulation.trees.reactions import reactions
from symdyn.formulation.trees.tree import GROUND, Tree
from symdyn.model.contacts.compliance import numbers_of
from symdyn.model.contacts.lowering import CompliantContact, RigidContact
from symdyn.model.elements import Element, MooringLine
from symdyn.model.joints import Joint
from symdyn.model.loads import ForceBetween, SpringDamper
from symdyn.model.orientation import EulerAngles
from symdyn.model.points import Point
from symdyn.model.quantity import Measure, Quantity, quantities_in
from symdyn.model.record import Model, joint_speeds
from symdyn.spatial.vectors import congruence, cross, inner, vector, zeros
from symdyn.tape.differentiate import forward, reverse
from symdyn.tape.node import is_zero


class TreeQuantities(Motion):
    """Records the quantities of a tree; accelerations from the factorized mass matrix."""

    def __init__(self, tree: Tree) -> None:
        model = tree.model
        super().__init__(tree.algebra, model.coordinates, model.speeds, tree.rates,
                         [(z.symbol, z.rate) for z in model.states], model.inputs, model.parameters,
                         {**_remarks_on_pivots(tree), **_gimbal_remarks(model)})
        self.tree = tree
        self.model = model
        self.vanishing_pivots = tree.vanishing_pivots
        self.kinematics = Kinematics(tree)
        self.loads = Loads(tree, self.kinematics, self._settled, self._touching if model.contacts else None)
        self.identification = Identification(tree, self.speed_rates)
        self.notes: list[str] = [] if tree.rigid else [
            "no regressor, base parameters or momenta: added mass and elastic bodies are no inertias of rigid bodies"]

    def _settled(self, given: bool = False) -> Settled:
        """The loads that depend on accelerations, multipliers and reactions: of the motion that they make, or at given
        accelerations."""
        trial = self._apart({"accelerations": self.speed_rates} if given else {})
        trial.loads = Loads(self.tree, self.kinematics)
        return solve(self.algebra, self.model.name, trial.loads.implicit, trial.measured)

    def _touching(self) -> Mapping[Quantity, Any]:
        """The forces of rigid contacts."""
        return self.recall("contact_rows").solved()  # type: ignore[no-any-return]

    def contact_rows(self) -> ContactRows:
        """Relative accelerations in rigid contacts as they follow from the forces there."""
        trial = self._apart({})
        trial.loads = Loads(self.tree, self.kinematics)
        accelerations = trial.recall("accelerations")
        along = {**self.by_time(), **dict(zip(self._leaves(self.speeds), accelerations, strict=True))}
        return ContactRows(self.algebra, self.model.contacts, trial.loads.contact_forces, accelerations,
                           lambda values: forward(self.algebra.recorder, list(values), along))

    def contacts(self) -> np.ndarray:
        """Numbers of a run with rigid contacts at a state, see ContactRows.numbers."""
        leaves = self._leaves(self.speeds)
        return self.recall("contact_rows").numbers(self.loads.contact_forces, lambda change: forward(  # type: ignore[no-any-return]
            self.algebra.recorder, self.rates, dict(zip(leaves, change, strict=True))))

    def contact_gaps(self) -> np.ndarray:
        """Gaps, coefficients and relative velocities of rigid contacts, see ContactRows.gaps."""
        return self.recall("contact_rows").gaps()  # type: ignore[no-any-return]

    def contact_directions(self) -> np.ndarray:
        """Relative velocities by speeds, and speeds by impulses, see ContactRows.steps."""
        return self.recall("contact_rows").steps(self._leaves(self.speeds))  # type: ignore[no-any-return]

    def contact_spheres(self) -> np.ndarray:
        """Positions, velocities and masses of the bodies of groups of contacts, see contact_groups.spheres."""
        return spheres(self.model.groups, self.kinematics, self.loads)

    def compliant_contacts(self) -> np.ndarray:
        """Gap, slip speed, forces and slips of compliant contacts, one after the other."""
        return vector(*[self.algebra.expression(e) for contact in self.model.compliant for e in contact.expressions])

    def contact_coefficients(self) -> np.ndarray:
        """Coefficients and lengths of contacts that are expressions of parameters, one after the other, rigid contacts first."""
        return vector(*[self.algebra.expression(e) for contact in self._contacts for e in numbers_of(contact.ranges)])

    def contact_points(self) -> np.ndarray:
        """Where every contact of bodies touches and the force on its body a, n-frame, rigid contacts first."""
        places = [(c.at, c.acting) for c in self.model.contacts if c.at] + [(c.at, c.acting) for c in self.model.compliant]
        return vector(*[self.expression(e) for at, acting in places for e in (*at, *acting)])

    @property
    def _contacts(self) -> tuple[RigidContact | CompliantContact, ...]:
        return (*self.model.contacts, *self.model.compliant)

    def _apart(self, memory: dict[str, Any]) -> Self:
        """The same quantities, to be recorded apart from these."""
        other = copy(self)
        other._memory = memory
        return other

    @property
    def reacting(self) -> tuple[Joint, ...]:
        """The joints in the rows of `reactions` and `joint_points`."""
        return self.model.joints

    @property
    def given_motion(self) -> bool:
        """Whether joints or the ground follow given functions of time."""
        return any(not is_zero(v) for v in self.tree.w_t)

    def demand_inertia(self) -> None:
        """Raise ModelError for speeds that move nothing at any state."""
        demand_mass_matrix(self.model, self.algebra.recorder, self.recall("M_tilde"))

    def quantities(self) -> dict[str, Any]:
        """name -> function that records it."""
        own = {"k_tilde": self.k_tilde, "F_tilde": self.F_tilde, "J": self.J, "Jdot": self.Jdot,
               "Jd_qd": self.Jd_qd, "positions": self.positions, "frames": self.frames,
               "joint_points": self.joint_points, "joint_axes": self.joint_axes,
               "reactions": self.reactions, "cut_loads": self.cut_loads, "energy": self.energy,
               "power": self.power, "power_x": self.power_x,
               **{output_quantity(o.name): partial(self.output, o.name, o.value) for o in self.model.outputs}}
        if self.connections:
            own["spring_points"] = self.spring_points
        if self.acting:
            own["applied_loads"] = self.applied_loads
        if any(not is_zero(e) for e in self.gravity()):
            own["weights"] = self.weights
        if self.model.compliant:
            own["compliant_contacts"] = self.compliant_contacts
        if any(numbers_of(contact.ranges) for contact in self._contacts):
            own["contact_coefficients"] = self.contact_coefficients
        limited = any(contact.depth is not None or contact.creep is not None for contact in self.model.compliant)
        if limited or self.tree.flexible or self.loads.implicit or any(isinstance(load, Element) for load in self.model.loads):
            own["validity_checks"] = lambda: vector(*[validity.value for validity in self.loads.validity_checks()])
        if self.model.ground_motion is not None:
            own["ground_rotation"] = self.ground_rotation
        if self.model.contacts:
            own |= {"contacts": self.contacts, "contact_gaps": self.contact_gaps, "contact_directions": self.contact_directions}
        if self.model.compliant or any(c.at for c in self.model.contacts):
            own["contact_points"] = self.contact_points
        if self.model.groups:
            own["contact_spheres"] = self.contact_spheres
        if self.model.events:
            own["events"] = self.events
        if any(event.reset for event in self.model.events):
            own["event_resets"] = self.event_resets
        if self.loads.implicit and not self.rows:  # with constraints, given accelerations leave open what these give
            own["inverse_dynamics"] = self.inverse_dynamics_at_accelerations
        if self.model.chosen and (self.model.eliminated or self.model.constraints):
            self.notes.append("no reactions, cut_loads: forces of constraints by expression are not known along chosen speeds")
            own = {name: record for name, record in own.items() if name not in ("reactions", "cut_loads")}
        return {**super().quantities(), **own, **(self.identification.quantities() if self.tree.rigid else {})}

    # -- the equations, joint by joint

    def M_tilde(self) -> np.ndarray:
        M = composite.mass_matrix(self.tree)
        if self.tree.plain:
            return self.algebra.name("M_tilde", M)
        with self.algebra.section("mass matrix in the generalized speeds"):
            return self.algebra.name("M_tilde", congruence(M, self.tree.D))

    def sizes_of_pivots(self) -> dict[int, Any]:
        return composite.sizes_of_pivots(self.tree)

    def bias(self) -> np.ndarray:
        """k_tilde - F_tilde in one pass: the weight as acceleration of the base."""
        applied = self.loads.applied()
        tau = inverse_dynamics(self.tree, self.tree.b, -self.gravity(), applied.wrenches)
        return self.algebra.name("k_minus_F", self.project(tau - applied.joint))

    def inverse_dynamics(self) -> np.ndarray:
        """M_tilde u_dot + k_tilde - F_tilde by one pass, without the mass matrix."""
        applied = self.loads.applied()
        w_dot = self.tree.joint_accelerations(self.speed_rates)
        tau = inverse_dynamics(self.tree, w_dot, -self.gravity(), applied.wrenches)
        return self.algebra.name("tau", self.project(tau - applied.joint))

    def inverse_dynamics_at_accelerations(self) -> np.ndarray:
        """The same where loads depend on accelerations and reactions: on the given accelerations, then, and their reactions."""
        given = self._apart({"accelerations": self.speed_rates})
        given.loads = Loads(self.tree, self.kinematics, partial(self._settled, True))
        return given.inverse_dynamics()

    def k_tilde(self) -> np.ndarray:
        return self.algebra.name("k_tilde", self.project(inverse_dynamics(self.tree, self.tree.b, zeros(3))))

    def F_tilde(self) -> np.ndarray:
        return self.algebra.name("F_tilde", self.project(self.joint_forces(gravity=True)))

    # -- kinematics

    def J(self) -> np.ndarray:
        rows = []
        for pose, body in zip(self.tree.poses, self.model.bodies, strict=True):
            with self.algebra.section(f"body {body.name}: velocity transformation J"):
                J = self.kinematics.jacobian(pose, self.algebra.constants(body.com))
                J = self.tree.by_speeds(J)
                rows.append(J[[0, 1, 5]] if self.model.planar else J)
        return np.vstack(rows) if rows else zeros(0, len(self.speeds))

    def Jdot(self) -> np.ndarray:
        return self.rate(self.J())

    def Jd_qd(self) -> np.ndarray:
        rows = [r[[0, 1, 5]] if self.model.planar else r for r in self.kinematics.bias()]
        return np.concatenate(rows) if rows else zeros(0)

    def positions(self) -> np.ndarray:
        """Centres of mass of the bodies, n-frame, (n_b, 3)."""
        return np.array([self.kinematics.position(pose, self.algebra.constants(body.com))
                         for pose, body in zip(self.tree.poses, self.model.bodies, strict=True)],
                        dtype=object).reshape(-1, 3)

    def frames(self) -> np.ndarray:
        """Origin and rotation (row by row) of every body's frame, n-frame, (n_b, 12)."""
        rows = []
        for pose in self.tree.poses:
            rows.append([*self.kinematics.position(pose, zeros(3)), *self.kinematics.rotation(pose).ravel()])
        return np.array(rows, dtype=object).reshape(-1, 12)

    def joint_points(self) -> np.ndarray:
        """Where each joint sits on its parent, then on its child, n-frame, m, (n_joints, 6)."""
        ends = [end for j in self.reacting for end in ((j.parent, j.parent_point), (j.child, j.child_point))]
        return np.array([self.kinematics.position(self.loads.pose(body), self.algebra.constants(point)) for body, point in ends],
                        dtype=object).reshape(-1, 6)

    def joint_axes(self) -> np.ndarray:
        """Unit axis of each joint, n-frame, (n_joints, 3); zero for one that has none or two."""
        rows = [self.kinematics.rotation(self.loads.pose(j.parent)) @ self.algebra.matrix(j.parent_rotation)
                @ self.algebra.constants(j.axis) if hasattr(j, "axis") else zeros(3) for j in self.reacting]
        return np.array(rows, dtype=object).reshape(-1, 3)

    @property
    def connections(self) -> tuple[SpringDamper | ForceBetween | MooringLine, ...]:
        """The loads along the line between two points, and mooring lines."""
        return tuple(load for load in self.model.loads if isinstance(load, (SpringDamper, ForceBetween, MooringLine)))

    def spring_points(self) -> np.ndarray:
        """Both ends of every load along a line, n-frame, m, (n, 6)."""
        rows: list[Any] = []
        for load in self.connections:
            if isinstance(load, MooringLine):
                rows += [self._on(load.body, load.fairlead), self.algebra.constants(load.anchor)]
            else:
                rows += [self._on(load.body_a, load.point_a), self._on(load.body_b, load.point_b)]
        return np.array(rows, dtype=object).reshape(-1, 6)

    @property
    def acting(self) -> tuple[Acting, ...]:
        """The forces and torques in the rows of `applied_loads`."""
        return acting(self.model)

    def applied_loads(self) -> np.ndarray:
        """Where every force and torque of a load acts, m, and its vector, N or N m, n-frame, (n, 6)."""
        return applied_loads(self.loads, self.acting)

    def weights(self) -> np.ndarray:
        """Weight of every body, N, n-frame, (n_b, 3)."""
        g = self.gravity()
        return np.array([self.algebra.expression(body.mass) * g for body in self.model.bodies], dtype=object).reshape(-1, 3)

    def _on(self, body: Any, point: Any) -> Any:
        """A point of a body in the n-frame."""
        return self.kinematics.position(self.loads.pose(body), self.algebra.constants(point))

    def reactions(self) -> np.ndarray:
        """Force and moment of each joint on its child, at its point on the child, n-frame, (n_joints, 6)."""
        return self._of_joints(self.recall("all_reactions"))

    def cut_loads(self) -> np.ndarray:
        """All that passes through each joint to its child: reaction, and what acts along the joint's speeds, (n_joints, 6)."""
        return self._of_joints(self.all_reactions(whole=True))

    def _of_joints(self, result: dict[str, np.ndarray]) -> np.ndarray:
        return np.array([result[j.name] for j in self.reacting], dtype=object).reshape(-1, 6)

    def all_reactions(self, whole: bool = False) -> dict[str, np.ndarray]:
        """Joint name -> reaction, or whole: cut load."""
        return reactions(self.tree, self.loads, self.kinematics, self.joint_accelerations(), whole=whole)

    def ground_rotation(self) -> np.ndarray:
        """R of the frame of the ground, which moves, (3, 3)."""
        return self.kinematics.rotation(self.tree.ground)

    def joint_accelerations(self) -> np.ndarray:
        """w_dot, (n_w,)."""
        return self.tree.joint_accelerations(self.recall("accelerations"))

    def energy(self) -> np.ndarray:
        """Kinetic energy; potential energy of gravity and springs, J."""
        with self.algebra.section("energy"):
            potential = self.kinematics.gravity_potential() + self.loads.potential()
            return np.array([self.kinematics.kinetic_energy(), potential], dtype=object)

    def power(self) -> Any:
        """Power of all loads but gravity and springs, and of the drives that force prescribed motions, W."""
        with self.algebra.section("power"):
            total: Any = 0
            forces = self.joint_forces(False, conservative=False)
            if any(not is_zero(v) for v in forces):
                total = inner(forces, self.tree.w)
            if any(not is_zero(v) for v in self.tree.w_t):
                applied = self.loads.applied()
                w_dot = self.joint_accelerations()
                tau = inverse_dynamics(self.tree, w_dot, -self.gravity(), applied.wrenches) - applied.joint
                total = total + inner(tau, self.tree.w_t)
            return total

    def power_x(self) -> np.ndarray:
        """Derivative of the power by the state, (n_x,)."""
        return vector(*reverse(self.algebra.recorder, self.power(), self.x()))

    def expression(self, e: sp.Expr) -> Any:
        later = [q for q in quantities_in([e]) if q.level == 2]
        return (self.algebra.within({q: self.measured(q) for q in later}) if later else self.algebra).expression(e)

    def measured(self, quantity: Quantity) -> Any:
        """A quantity that takes accelerations or forces. Raises ModelError for multipliers of what is no constraint."""
        measure = quantity.measure
        if measure.kind == "contact":
            return self.loads.contact_forces[quantity]
        if measure.kind == "multiplier":
            raise ModelError([f"{quantity} is requested of equations without multipliers; use system.augmented()"],
                             self.model.name)
        if measure.kind == "reaction":
            return self._reaction(measure)
        if measure.kind == "position":
            return self._point(Point(measure.of[0], measure.points[0], "acceleration"))[measure.index[0]]
        recorder = self.algebra.recorder
        rate = self.algebra.expression(Quantity(replace(measure, order=measure.order - 1)))
        along = {**self.by_time(), **dict(zip(self._leaves(self.speeds), self.recall("accelerations"), strict=True))}
        return forward(recorder, [rate], along)[0]

    def _reaction(self, measure: Measure) -> Any:
        """A component of a joint's reaction in the n-frame or in the axes of a body."""
        rows = self.recall("all_reactions")[measure.of[0]]
        if measure.frame is not None:
            R = self.kinematics.rotation(self.loads.pose(measure.frame))
            rows = np.concatenate([R.T @ rows[:3], R.T @ rows[3:]])
        return rows[measure.index[0]]

    def output(self, name: str, value: Any) -> Any:
        """A named output of the user."""
        with self.algebra.section(f"output {name}"):
            return self._output(value)

    def _output(self, value: Any) -> Any:
        if isinstance(value, Point):
            return self._point(value)
        if isinstance(value, tuple):
            return vector(*[self.expression(e) for e in value])
        return self.expression(value)

    def events(self) -> np.ndarray:
        """Expressions that vanish at the events, (n_e,)."""
        with self.algebra.section("events"):
            return vector(*[self.expression(e.value) for e in self.model.events])

    def event_resets(self) -> np.ndarray:
        """New values of the reset entries of the state, event after event."""
        with self.algebra.section("resets of events"):
            return vector(*[self.expression(becomes) for e in self.model.events for _, becomes in e.reset])

    def _point(self, point: Point) -> np.ndarray:
        """The requested quantity of a point of a body, n-frame; see Point."""
        kinematics = self.kinematics
        pose, at = self.loads.pose(point.body), self.algebra.constants(point.at)
        if point.quantity == "position":
            rows = kinematics.position(pose, at)
        elif point.quantity == "velocity":
            rows = kinematics.velocity(pose, at)
        elif point.quantity == "jacobian":
            rows = self.tree.by_speeds(kinematics.jacobian(pose, at))
        elif point.quantity == "bias_acceleration":
            rows = kinematics.acceleration(pose, at, kinematics.reference)
        else:
            w_dot = self.joint_accelerations()
            rows = kinematics.acceleration(pose, at, outward(self.tree, w_dot, zeros(3)))[:3]
        if self.model.planar:
            return rows[:2] if rows.shape == (3,) else rows[[0, 1, 5]]
        return rows

    # -- forces along the speeds

    def gravity(self) -> np.ndarray:
        """Acceleration of gravity, n-frame, (3,)."""
        return self.algebra.constants(self.model.gravity)

    def joint_forces(self, gravity: bool, conservative: bool = True, other: bool = True) -> np.ndarray:
        """Forces of the loads along each joint speed, (n_w,)."""
        applied = self.loads.applied(conservative, other)
        if gravity:
            g = self.gravity()
            turned: list[np.ndarray] = []
            for k, link in enumerate(self.tree.links):
                with self.algebra.section(f"link {link.name}: weight"):
                    turned.append(link.R.T @ (g if link.parent == GROUND else turned[link.parent]))
                    f = link.effective.m * turned[k]
                    force, moment = applied.wrenches[k]
                    applied.wrenches[k] = (force + f, moment + cross(link.effective.h, turned[k]))
            for body in self.tree.flexible:
                with self.algebra.section(f"link {self.tree.links[body.link].name}: weight of the deflected body"):
                    (f, n), along = body.weight(g if body.root == GROUND else turned[body.root])
                    if body.root != GROUND:
                        force, moment = applied.wrenches[body.root]
                        applied.wrenches[body.root] = (force + f, moment + n)
                    applied.joint[body.speeds.start:body.speeds.stop] += along
        return inward(self.tree, applied.wrenches) + applied.joint

    def project(self, tau: np.ndarray) -> np.ndarray:
        """D^T tau: from the joints' speeds to the generalized ones."""
        return tau if self.tree.plain else self.tree.D.T @ tau if len(tau) else zeros(len(self.speeds))


def _remarks_on_pivots(tree: Tree) -> dict[Any, str]:
    """For speeds that may lose what they move to others: to which."""
    speeds = tree.model.speeds
    others = {p: ", ".join(str(speeds[k]) for k in sorted(after)) for p, after in tree.vanishing_pivots.items()}
    return {speeds[p]: ": at this position it moves nothing that " + (
        f"{others[p]} {'does' if len(after) == 1 else 'do'} not move already" if after else "has mass")
        for p, after in tree.vanishing_pivots.items()}


def _gimbal_remarks(model: Model) -> dict[Any, str]:
    """For the speeds of Euler angles: that the sequence may be at gimbal lock, and what to do."""
    remarks: dict[Any, str] = {}
    for joint in model.joints:
        orientation = getattr(joint, "orientation", None)
        if isinstance(orientation, EulerAngles) and not orientation.angular_velocity:
            remark = (f": the {orientation.sequence} angles of joint {joint.name} are at gimbal lock or very near it "
                      "(take another sequence, or EulerParameters)")
            remarks.update(dict.fromkeys(joint_speeds(joint)[-3:], remark))
    return remarks
