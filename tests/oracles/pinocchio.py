"""The dynamics of trees by Pinocchio, from the checked model of a system and numbers.

Every joint of symdyn becomes a row of Pinocchio's joints with massless bodies between, chosen so that its speeds are
symdyn's speeds one by one (pinocchio_joints). All vectors are in symdyn's order of speeds, components in the n-frame.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import pinocchio as pin
import sympy as sp

from symdyn.model.bodies import Body
from symdyn.model.joints import Joint
from symdyn.model.loads import JointForce
from symdyn.model.record import Model, joint_speeds
from symdyn.model.symbols import Coordinate
from tests.oracles.pinocchio_joints import UNIT, CannotExpress, conversion, row

WORLD_AXES = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED


@dataclass(frozen=True)
class Place:
    """Where a body's frame is: its pose in the frame of a joint of Pinocchio."""

    joint: int
    pose: pin.SE3


class PinocchioOracle:
    """A model with a number for every parameter and input.

    Raises CannotExpress for loops, prescribed and dependent coordinates, loads other than joint forces, custom joints.
    """

    def __init__(self, model: Model, numbers: Mapping[sp.Symbol, float]) -> None:
        demand_expressible(model)
        self.source = model
        self.numbers = {symbol: sp.Float(value, 17) for symbol, value in numbers.items()}
        self.pin = pin.Model()
        self.pin.gravity.linear = self.array(model.gravity).ravel()
        self.places = {-1: Place(0, pin.SE3.Identity())}  # body, -1 the ground
        self.converted: list[Callable[[np.ndarray], np.ndarray]] = []
        speeds: list[Any] = []
        for joint, parent, child in depth_first(model):
            self.places[child] = self._join(joint, self.places[parent])
            self.converted.append(conversion(joint, [model.coordinates.index(s) for s in joint.coordinates]))
            self._load(model.bodies[child], self.places[child])
            speeds += joint_speeds(joint)
        self.order = [speeds.index(s) for s in model.speeds]  # Pinocchio's place of each of symdyn's speeds
        self.data = self.pin.createData()

    # -- dynamics; M u_dot + C u + gravity = tau

    def mass_matrix(self, q: np.ndarray) -> np.ndarray:
        """(n_u, n_u) M."""
        upper = np.triu(pin.crba(self.pin, self.data, self.q(q)))
        return (upper + np.triu(upper, 1).T)[np.ix_(self.order, self.order)]

    def coriolis(self, q: np.ndarray, u: np.ndarray) -> np.ndarray:
        """(n_u,) C(q, u) u."""
        return (pin.computeCoriolisMatrix(self.pin, self.data, self.q(q), self.v(u)) @ self.v(u))[self.order]

    def gravity(self, q: np.ndarray) -> np.ndarray:
        """(n_u,) what the drives must bear at rest: the gradient of the potential energy."""
        return pin.computeGeneralizedGravity(self.pin, self.data, self.q(q))[self.order]

    def bias(self, q: np.ndarray, u: np.ndarray) -> np.ndarray:
        """(n_u,) C u + gravity, in one pass."""
        return pin.nonLinearEffects(self.pin, self.data, self.q(q), self.v(u))[self.order]

    def tau(self, q: np.ndarray, u: np.ndarray, u_dot: np.ndarray) -> np.ndarray:
        """(n_u,) forces along the speeds for given accelerations: inverse dynamics."""
        return pin.rnea(self.pin, self.data, self.q(q), self.v(u), self.v(u_dot))[self.order]

    def accelerations(self, q: np.ndarray, u: np.ndarray, tau: np.ndarray) -> np.ndarray:
        """(n_u,) derivatives of the speeds under forces along them: articulated bodies."""
        return pin.aba(self.pin, self.data, self.q(q), self.v(u), self.v(tau))[self.order]

    def joint_forces(self, q: np.ndarray, u: np.ndarray) -> np.ndarray:
        """(n_u,) what the model's own joint forces are at a state."""
        model = self.source
        state = zip((*model.coordinates, *model.speeds), np.concatenate([q, u]).tolist())
        numbers = {**self.numbers, **{symbol: sp.Float(value, 17) for symbol, value in state}}
        result = np.zeros(len(u))
        for load in model.loads:
            for speed, value in zip(joint_speeds(load.joint), load.values, strict=True):
                result[model.speeds.index(speed)] += float(value.xreplace(numbers))
        return result

    # -- energy and momentum

    def energy(self, q: np.ndarray, u: np.ndarray) -> tuple[float, float]:
        """Kinetic and potential energy, J; the potential of what is fixed to the ground is left out."""
        return (pin.computeKineticEnergy(self.pin, self.data, self.q(q), self.v(u)),
                pin.computePotentialEnergy(self.pin, self.data, self.q(q)))

    def center_of_mass(self, q: np.ndarray) -> np.ndarray:
        """(3,) of all that moves, m."""
        return np.array(pin.centerOfMass(self.pin, self.data, self.q(q)))

    def centroidal_momentum(self, q: np.ndarray, u: np.ndarray) -> np.ndarray:
        """(6,) linear momentum, then angular momentum about the centre of mass."""
        return np.array(pin.computeCentroidalMomentum(self.pin, self.data, self.q(q), self.v(u)).vector)

    # -- kinematics of points

    def position(self, q: np.ndarray, body: int, point: Iterable[Any]) -> np.ndarray:
        """(3,) of a point (body axes, m) of a body, by its index."""
        pin.forwardKinematics(self.pin, self.data, self.q(q))
        joint, place = self._at(body, point)
        return np.array(self.data.oMi[joint].act(place).translation)

    def jacobian(self, q: np.ndarray, body: int, point: Iterable[Any]) -> np.ndarray:
        """(6, n_u): [velocity of the point; angular velocity] = J u."""
        pin.computeJointJacobians(self.pin, self.data, self.q(q))
        joint, place = self._at(body, point)
        return np.array(pin.getFrameJacobian(self.pin, self.data, joint, place, WORLD_AXES))[:, self.order]

    def jacobian_rate(self, q: np.ndarray, u: np.ndarray, body: int, point: Iterable[Any]) -> np.ndarray:
        """(6,) J_dot u: [acceleration of the point; angular acceleration] where u_dot = 0."""
        pin.forwardKinematics(self.pin, self.data, self.q(q), self.v(u), np.zeros(self.pin.nv))
        joint, place = self._at(body, point)
        return np.array(pin.getFrameClassicalAcceleration(self.pin, self.data, joint, place, WORLD_AXES).vector)

    # -- coordinates and speeds of Pinocchio

    def q(self, q: np.ndarray) -> np.ndarray:
        return np.concatenate([convert(q) for convert in self.converted]) if self.converted else np.zeros(0)

    def v(self, u: np.ndarray) -> np.ndarray:
        result = np.zeros(len(u))
        result[self.order] = u
        return result

    # -- building

    def array(self, matrix: Any) -> np.ndarray:
        """A matrix of expressions of parameters, in numbers."""
        rows = [[e.xreplace(self.numbers) for e in row] for row in sp.Matrix(matrix).tolist()]
        return np.array(rows, dtype=float)

    def _at(self, body: int, point: Iterable[Any]) -> tuple[int, pin.SE3]:
        place = self.places[body]
        return place.joint, place.pose * pin.SE3(UNIT, self.array(sp.Matrix(list(point))).ravel())

    def _load(self, body: Body, place: Place) -> None:
        if place.joint:  # what is fixed to the ground does not move
            inertia = pin.Inertia(float(self.array([[body.mass]])[0, 0]), self.array(body.com).ravel(), self.array(body.inertia))
            self.pin.appendBodyToJoint(place.joint, inertia, place.pose)

    def _join(self, joint: Joint, parent: Place) -> Place:
        """Add the row of joints that a joint is; returns the place of the child's frame."""
        last, pose = parent.joint, parent.pose * pin.SE3(self.array(joint.parent_rotation),
                                                         self.array(joint.parent_point).ravel())
        for simple in row(joint, self.array):
            last = self.pin.addJoint(last, simple, pose, f"{joint.name}.{self.pin.njoints}")
            pose = pin.SE3.Identity()
        child = pin.SE3(self.array(joint.child_rotation), self.array(joint.child_point).ravel())
        return Place(last, pose * child.inverse())


def demand_expressible(model: Model) -> None:
    """Raise CannotExpress for what makes a model more than a tree under gravity and joint forces."""
    if model.constraints or model.loops:
        raise CannotExpress("closed loops and constraints are no part of a tree")
    if model.ground_motion is not None:
        raise CannotExpress("the motion of the ground is prescribed")
    for joint in model.joints:
        if not all(isinstance(q, Coordinate) and q in model.coordinates for q in joint.coordinates) or (
                not set(joint_speeds(joint)) <= set(model.speeds)):
            raise CannotExpress(f"the motion of joint {joint.name!r} is prescribed or depends on other coordinates")
    others = [load.label for load in model.loads if not isinstance(load, JointForce)]
    if others:
        raise CannotExpress(f"{', '.join(others)}: loads other than joint forces are not part of Pinocchio's model")


def depth_first(model: Model) -> Iterator[tuple[Joint, int, int]]:
    """Every joint with the bodies that it connects, a branch after the other: Pinocchio takes what hangs on a joint to be
    numbered right after it."""
    hanging: dict[int, list[tuple[Joint, int, int]]] = {}
    for joint, parent, child in zip(model.joints, model.parents, model.children, strict=True):
        hanging.setdefault(parent, []).append((joint, parent, child))
    stack = hanging.get(-1, [])[::-1]
    while stack:
        yield (found := stack.pop())
        stack += hanging.get(found[2], [])[::-1]
