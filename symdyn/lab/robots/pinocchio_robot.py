"""A robot in Pinocchio, read from the same file, and what it computes in symdyn's order."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from symdyn.errors import MissingExtra, SymdynError
from symdyn.model.joints import Fixed, Free, Planar
from symdyn.model.record import Model, joint_speeds
from symdyn.model.symbols import Coordinate
from symdyn.urdf.checks import outwards
from symdyn.urdf.document import read_document
from symdyn.urdf.parse import parse
from symdyn.urdf.values import FileFaults


class PinocchioRobot:
    """The model of a file, and where symdyn's coordinates and speeds are in it.

    model      the checked model that symdyn made of the same file, no joint held
    floating   whether its root moves freely

    A joint that mimics another is no coordinate of Pinocchio's, either (mimic=True). Its floating joint has the quaternion
    x y z w and the same speeds as symdyn's. The speeds of its planar joint are in the axes of the child, those of symdyn's in
    the axes of the parent.
    """

    def __init__(self, path: Path, model: Model, floating: bool = False) -> None:
        try:
            import pinocchio
        except ImportError:
            raise MissingExtra("the Python package pinocchio is not installed; run: pip install 'symdyn[peers]'") from None
        self.pin: Any = pinocchio
        root = [pinocchio.JointModelFreeFlyer()] if floating else []
        self.model = pinocchio.buildModelFromUrdf(str(path), *root, mimic=True)
        self.data = self.model.createData()
        self.source = model
        faults = FileFaults(path)
        base, order = outwards(parse(read_document(path), faults), faults)
        names = dict(zip([j.name for j in model.joints], ["root_joint", *[j.name for j in order]], strict=True))
        self.joints = [(j, self.model.joints[self.model.getJointId(names[j.name])]) for j in model.joints
                       if not isinstance(j, Fixed) and all(isinstance(q, Coordinate) for q in j.coordinates)]
        if sum(j.n_speeds for j, _ in self.joints) != self.model.nv:
            raise SymdynError(f"{path}: symdyn has {len(model.speeds)} speeds, Pinocchio {self.model.nv}")
        places: list[int] = [0] * len(model.speeds)
        for joint, there in self.joints:
            for k, u in enumerate(joint_speeds(joint)):
                places[model.speeds.index(u)] = there.idx_v + k
        self.order = np.array(places, dtype=int)
        self.mimics = any(there.shortname().startswith("JointModelMimic") for there in self.model.joints)
        links = [base, *[j.child for j in order]]
        self.frames = [self.model.getFrameId(name, pinocchio.FrameType.BODY) for name in links]
        self.coms = [np.array(b.com, dtype=float).ravel() for b in model.bodies]
        self.mass = pinocchio.computeTotalMass(self.model) + self.model.inertias[0].mass

    def q(self, q: np.ndarray) -> np.ndarray:
        """(n_q,) in Pinocchio's order and quantities, from symdyn's."""
        result = np.zeros(self.model.nq)
        for joint, there in self.joints:
            own = q[[self.source.coordinates.index(s) for s in joint.coordinates]]
            if isinstance(joint, Free):
                own = own[[0, 1, 2, 4, 5, 6, 3]]
            elif there.nq == joint.n_speeds + 1:  # an angle without limits is held as cosine and sine
                own = np.array([*own[:-1], np.cos(own[-1]), np.sin(own[-1])])
            result[there.idx_q:there.idx_q + there.nq] = own
        return result

    def matrix(self, q: np.ndarray) -> np.ndarray:
        """(n_u, n_u): Pinocchio's speeds from symdyn's."""
        result = np.zeros((self.model.nv, self.model.nv))
        result[self.order, np.arange(len(self.order))] = 1
        for joint, there in self.joints:
            if isinstance(joint, Planar):
                angle = q[self.source.coordinates.index(joint.coordinates[2])]
                c, s = np.cos(angle), np.sin(angle)
                own = [self.source.speeds.index(u) for u in joint_speeds(joint)[:2]]
                result[np.ix_([there.idx_v, there.idx_v + 1], own)] = [[c, s], [-s, c]]
        return result

    def bias(self, q: np.ndarray, u: np.ndarray) -> np.ndarray:
        """(n_u,) what Pinocchio's accelerations have besides those of symdyn's speeds: those of turning axes."""
        result = np.zeros(self.model.nv)
        for joint, there in self.joints:
            if isinstance(joint, Planar):
                v = (self.matrix(q) @ u)[there.idx_v:there.idx_v + 3]
                result[there.idx_v:there.idx_v + 2] = v[2] * np.array([v[1], -v[0]])
        return result

    def quantities(self, q: np.ndarray, u: np.ndarray, ud: np.ndarray) -> dict[str, np.ndarray]:
        """tau, M, ud (accelerations without drives), J (6 n_b, n_u), com (3,), energy (2,), at a state.

        The centre of mass is that of all links, for which Pinocchio leaves out those on the ground: they are added from what
        it keeps of them. It has neither articulated bodies nor energy for mimic joints: accelerations are solved for with its
        mass matrix then, and the kinetic energy is u^T M u / 2.
        """
        pin, model, data = self.pin, self.model, self.data
        at, N, bias = self.q(q), self.matrix(q), self.bias(q, u)
        v, a = N @ u, N @ ud + bias
        tau = N.T @ pin.rnea(model, data, at, v, a)
        upper = np.triu(pin.crba(model, data, at))
        M = upper + np.triu(upper, 1).T
        if self.mimics:
            free = np.linalg.solve(M, -pin.rnea(model, data, at, v, np.zeros(model.nv)))
        else:
            free = pin.aba(model, data, at, v, np.zeros(model.nv))
        com = self._center(at)
        kinetic = v @ M @ v / 2 if self.mimics else pin.computeKineticEnergy(model, data, at, v)
        energy = np.array([kinetic, -self.mass * (model.gravity.linear @ com)])
        pin.computeJointJacobians(model, data, at)
        pin.updateFramePlacements(model, data)
        J = np.vstack([self._jacobian(frame, com) for frame, com in zip(self.frames, self.coms, strict=True)]) @ N
        return {"tau": tau, "M": N.T @ M @ N, "ud": np.linalg.solve(N, free - bias), "J": J, "com": com, "energy": energy}

    def _center(self, at: np.ndarray) -> np.ndarray:
        """(3,) of all links, m."""
        grounded = self.model.inertias[0]
        moving = np.array(self.pin.centerOfMass(self.model, self.data, at)) * (self.mass - grounded.mass)
        return (moving + grounded.mass * np.array(grounded.lever)) / self.mass  # type: ignore[no-any-return]

    def _jacobian(self, number: int, com: np.ndarray) -> np.ndarray:
        """(6, n_v) of the centre of mass of a link, by its frame."""
        pin, frame = self.pin, self.model.frames[number]
        place = frame.placement * pin.SE3(np.eye(3), com)
        if frame.parentJoint == 0:
            return np.zeros((6, self.model.nv))
        return np.array(pin.getFrameJacobian(self.model, self.data, frame.parentJoint, place, pin.LOCAL_WORLD_ALIGNED))
