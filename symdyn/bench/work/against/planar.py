"""A planar mechanism of hinged bodies, with loops, in numbers: every body by itself, hinges between them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from symdyn.bench.work.against.mechanism import Numbers, numbers_of, of_joint
from symdyn.bench.work.against.peer import Unfit
from symdyn.model.joints import Revolute
from symdyn.model.loads import JointForce, SpringDamper
from symdyn.model.record import joint_speeds

# A body, -1 the ground, and a point of it from its centre of mass (the ground's from its origin), body axes, m.
Place = tuple[int, np.ndarray]


@dataclass(frozen=True)
class Free:
    """A body: place of its centre of mass and its angle at the start, (3,) m, rad; speed (3,); mass kg, inertia kg m^2."""

    place: np.ndarray
    speed: np.ndarray
    mass: float
    inertia: float


@dataclass(frozen=True)
class Planar:
    """The mechanism.

    hinges    pairs of places that stay together
    springs   pairs of places, stiffness N/m, damping N s/m, unstretched length m
    torques   body, N m
    angles    for each coordinate the bodies (parent, child) whose angle it counts, and its sign
    start     (n_q,) coordinates at the start, where the angles that bodies have turned by are zero
    inputs    constant values, in order
    """

    bodies: tuple[Free, ...]
    gravity: np.ndarray
    hinges: tuple[tuple[Place, Place], ...]
    springs: tuple[tuple[tuple[Place, Place], float, float, float], ...]
    torques: tuple[tuple[int, float], ...]
    angles: tuple[tuple[int, int, float], ...]
    start: np.ndarray
    inputs: list[float]

    def state(self, turned: np.ndarray, rates: np.ndarray) -> np.ndarray:
        """Our state from the angle that each body has turned by, rad, and its rate, (n_b,)."""
        (turned, rates) = (np.append(values, 0.0) for values in (turned, rates))  # the ground is number -1
        q = [sign * (turned[child] - turned[parent]) for parent, child, sign in self.angles]
        return np.concatenate([self.start + q, [sign * (rates[child] - rates[parent]) for parent, child, sign in self.angles]])


def planar_of(system: Any, equations: Any, params: np.ndarray, x0: np.ndarray) -> Planar:
    """The numbers of a system whose equations have these parameters, at a start. Raises Unfit for what Planar cannot say."""
    if system is None:
        raise Unfit("it is known by its equations alone; the program takes bodies and joints")
    model = system.check()
    read = numbers_of(model, equations, params)
    _reject(model, equations)
    n = len(model.coordinates)
    module, inputs = equations.compile(), read.inputs
    centres = module.evaluate("positions", 0.0, x0, params, inputs).reshape(len(model.bodies), -1)[:, :2]
    speeds = (module.evaluate("J", 0.0, x0, params, inputs) @ x0[n:]).reshape(len(model.bodies), -1)
    frames = module.evaluate("frames", 0.0, x0, params, inputs).reshape(len(model.bodies), -1)
    angle = np.arctan2(frames[:, 6], frames[:, 3])
    coms = [read.array(body.com).ravel()[:2] for body in model.bodies]
    bodies = tuple(Free(np.append(centres[k], angle[k]), speeds[k], float(read.number(body.mass)),
                        float(read.array(body.inertia)[2, 2])) for k, body in enumerate(model.bodies))
    number = {body: k for k, body in enumerate(model.bodies)}

    def place(body: Any, point: Any) -> Place:
        k = number.get(body, -1)
        return k, read.array(point).ravel()[:2] - (coms[k] if k >= 0 else 0)

    tree = [(p, c, j) for j, p, c in zip(model.joints, model.parents, model.children, strict=True)]
    hinges = [((p, place(None if p < 0 else model.bodies[p], j.parent_point)[1]), (c, place(model.bodies[c], j.child_point)[1]))
              for p, c, j in tree]
    hinges += [(place(j.parent, j.parent_point), place(j.child, j.child_point)) for j in model.loops]
    springs, torques = [], []
    for load in model.loads:
        if isinstance(load, SpringDamper):
            numbers = [read.number(e) for e in (load.stiffness, load.damping, load.length)]
            if not all(e.is_number for e in numbers):
                raise Unfit(f"{load.label} has the stiffness {load.stiffness}, the damping {load.damping} and the length "
                            f"{load.length}; what is built is springs and dampers by numbers")
            stiffness, damping, length = map(float, numbers)
            ends = place(load.body_a, load.point_a), place(load.body_b, load.point_b)
            springs.append((ends, stiffness, damping, length))
            continue
        joint = of_joint(load, model.joints)
        torque = read.number(load.values[0])
        if not torque.is_number:
            raise Unfit(f"{load.label} is {load.values[0]}; what is built is constant torques")
        parent, child, sign = next((p, c, _sign(j, read)) for p, c, j in tree if j is joint)
        torques += [(child, sign * float(torque)), (parent, -sign * float(torque))]
    owner = {j.coordinates[0]: (p, c, _sign(j, read)) for p, c, j in tree}
    return Planar(bodies, read.array(model.gravity).ravel()[:2], tuple(hinges), tuple(springs), tuple(torques),
                  tuple(owner[q] for q in model.coordinates), np.array(x0[:n], dtype=float), inputs)


def _reject(model: Any, equations: Any) -> None:
    """Raise Unfit for what is no planar mechanism of hinged bodies."""
    for what, given in (("motion in space", not model.planar), ("constraints by formula", model.constraints),
                        ("extra states", model.states), ("a moving ground", model.ground_motion)):
        if given:
            raise Unfit(f"it has {what}; what is built is planar mechanisms of hinged bodies")
    for joint in (*model.joints, *model.loops):
        own = joint in model.loops or (joint.coordinates[0] in model.coordinates and joint_speeds(joint) == (
            joint.coordinates[0].dot,))
        if not isinstance(joint, Revolute) or not own:
            raise Unfit(f"joint {getattr(joint, 'name', joint)!r} is {joint.kind}; what is built is hinges with a coordinate of "
                        "their own")
    for load in model.loads:
        if not isinstance(load, (SpringDamper, JointForce)):
            raise Unfit(f"{load.label} is a load; what is built is springs and constant torques in hinges")
    if [s.name for s in equations.symbols.coordinates] != [s.name for s in model.coordinates]:
        raise Unfit("these equations are not in the coordinates of the joints")


def _sign(joint: Any, read: Numbers) -> float:
    """Whether a hinge counts counterclockwise."""
    return float(read.array(joint.parent_rotation)[2] @ read.array(joint.axis).ravel())
