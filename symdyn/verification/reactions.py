"""Identities of the reactions of joints: Newton's and Euler's laws for every body as it is, from numeric derivatives alone."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import mpmath
import numpy as np

from symdyn.formulation.equations import Equations
from symdyn.formulation.probes.vanishing_pivots import nonzero_indices
from symdyn.formulation.trees.reactions import own_rows
from symdyn.model.closures import Gear
from symdyn.model.elements import AddedMass
from symdyn.model.joints import Modal
from symdyn.model.loads import JointForce
from symdyn.model.symbols import Coordinate
from symdyn.spatial.vectors import cross
from symdyn.tape.node import is_zero
from symdyn.tape.tape import Tape
from symdyn.verification.identities import angular_velocities
from symdyn.verification.sample import Sample, difference, moved, relative


def move_every_body(s: Sample) -> float | None:
    """m a_G and the rate of the angular momentum about G of every body against weight, loads, and reactions of its joints.

    Does not apply with joint forces, gears and constraints by expression: what these do between two bodies is no reaction; nor to
    bodies that are not rigid or move water along.
    """
    owner = _owner(s.equations)
    if owner is None or owner.model.constraints or not owner.model.bodies:
        return None
    if any(isinstance(e, (JointForce, Gear)) for e in (*owner.model.loads, *owner.model.loops)):
        return None
    bodies = _bodies(s.equations, s)
    total, terms = _momentum_rates(s, bodies), []
    total[:, :3] -= bodies["mass"][:, None] * bodies["gravity"]
    terms.append(total.copy())
    total -= bodies["loads"]
    terms.append(bodies["loads"])
    G = s["positions"]
    for _, parent, child, point, wrench in _joints(s, owner, bodies):
        for body, sign in ((child, 1), (parent, -1)):
            if body != -1:
                felt = sign * np.concatenate([wrench[:3], wrench[3:] + cross(point - G[body], wrench[:3])])
                total[body] -= felt
                terms.append(felt)
    kept = [0, 1, 5] if s.equations.planar else list(range(6))
    return relative(total[_rigid(owner.model)][:, kept], np.concatenate([np.ravel(t) for t in terms]))


def do_no_work(s: Sample) -> float | None:
    """The power of every joint's reaction between its two bodies, at speeds that the constraints allow.

    Joints that move together, because the coordinates of some are expressions of those of others, have no power in sum: what
    holds a dependent coordinate is a reaction, and works against the joint that drives it. Joints that follow the time are left
    out, and those of a speed that no joint has for its own, where constraints by expression have a force along it.
    """
    owner = _owner(s.equations)
    if owner is None or owner.model.ground_motion is not None:
        return None
    together = _moving_together(owner)
    bodies = _bodies(s.equations, s)
    v, omega = _twists(s, {})
    G = s["positions"]
    powers: dict[int, Any] = {}
    terms = [force * s.u for force in (s["F_tilde"], s["k_tilde"], s.constraint_force())]
    for k, (joint, parent, child, point, wrench) in enumerate(_joints(s, owner, bodies)):
        group = together.get(joint.name, -1 - k)
        loose = joint.name not in together and not all(isinstance(q, Coordinate) for q in joint.coordinates)
        if group is None or loose:
            continue
        relative_twist = np.zeros(6, dtype=object)
        for body, sign in ((child, 1), (parent, -1)):
            if body != -1:
                relative_twist += sign * np.concatenate([v[body] + cross(omega[body], point - G[body]), omega[body]])
        products = wrench * relative_twist
        powers[group] = powers.get(group, 0) + sum(products[[0, 1, 5]] if s.equations.planar else products)
        terms.append(products)
    return relative(np.array([*powers.values()]), np.concatenate(terms)) if powers else None


def _moving_together(owner: Any) -> dict[str, int | None]:
    """Joint of the tree -> number of the group that shares speeds with it; None for those that nothing is known of."""
    tree = owner.tree
    owned = own_rows(tree)
    forced = bool(owner.model.constraints) or any(isinstance(loop, Gear) for loop in owner.model.loops)
    groups: list[tuple[set[str], set[int], bool]] = []
    for link in tree.links:
        speeds: set[int] = set().union(*[nonzero_indices(row) for row in tree.D[link.speeds]])
        unknown = isinstance(link.joint, Modal) or any(not is_zero(e) for e in tree.w_t[link.speeds])
        unknown |= forced and not speeds <= set(owned)
        names = {link.joint.name}
        for other in [group for group in groups if group[1] & speeds]:
            groups.remove(other)
            names, speeds, unknown = names | other[0], speeds | other[1], unknown or other[2]
        groups.append((names, speeds, unknown))
    return {name: None if unknown else k for k, (names, _, unknown) in enumerate(groups) for name in names}


def _rigid(model: Any) -> list[int]:
    """Places of the bodies that are rigid and move no water along."""
    others = [load.body for load in model.loads if isinstance(load, AddedMass)]
    others += [joint.parent for joint in model.joints if isinstance(joint, Modal)]
    names = {getattr(body, "name", body) for body in others}
    return [k for k, body in enumerate(model.bodies) if body.name not in names]


def _owner(equations: Equations) -> Any:
    """Object that records the reactions; None of equations without bodies."""
    return getattr(equations.quantities.get("reactions"), "__self__", None)


def _joints(s: Sample, owner: Any, bodies: Mapping[str, np.ndarray]) -> list[tuple[Any, int, int, np.ndarray, np.ndarray]]:
    """Data of every joint: itself, indices of parent and child (-1: ground), its point on the child, n-frame, and its
    reaction."""
    known = {joint[0]: wrench for joint, wrench in zip(s.equations.joints, s["reactions"], strict=True)}
    return [(joint, parent, child, bodies["points"][k], known.get(joint.name, bodies["wrenches"][k]))
            for k, (joint, parent, child) in enumerate(_all_joints(owner))]


def _all_joints(owner: Any) -> list[tuple[Any, int, int]]:
    model = owner.model
    indices = {body.name: k for k, body in enumerate(model.bodies)}

    def place(body: Any) -> int:
        return indices.get(getattr(body, "name", body), -1)

    tree = list(zip(model.joints, model.parents, model.children, strict=True))
    loops = [c.joint for c in owner.gathered.closures] if hasattr(owner, "gathered") else []
    return [*tree, *[(joint, place(joint.parent), place(joint.child)) for joint in loops]]


def _bodies(equations: Equations, s: Sample) -> dict[str, np.ndarray]:
    """In numbers: mass (n,), inertia (n, 9) about G in body axes, loads (n, 6) about G, n-frame, gravity (3,); of the joints
    points (j, 3) and reactions (j, 6)."""
    owner = _owner(equations)
    algebra, kinematics, model = owner.algebra, owner.kinematics, owner.model
    loads = []
    for pose, body, (f, n) in zip(owner.tree.poses, model.bodies, owner.loads.applied().bodies, strict=True):
        R, origin = kinematics.frame(pose.link)
        arm = origin - kinematics.position(pose, algebra.constants(body.com))
        loads.append([*(R @ f), *(R @ n + cross(arm, R @ f))])
    result = owner.all_reactions()
    joints = _all_joints(owner)
    points = [kinematics.position(owner.tree.ground if child == -1 else owner.tree.poses[child],
                                  algebra.constants(joint.child_point)) for joint, _, child in joints]
    tape = Tape.of(equations.recorder, mass=np.array([algebra.expression(b.mass) for b in model.bodies], dtype=object),
                   inertia=np.array([algebra.matrix(b.inertia).ravel() for b in model.bodies], dtype=object),
                   loads=np.array(loads, dtype=object), gravity=algebra.constants(model.gravity),
                   points=np.array(points, dtype=object).reshape(-1, 3),
                   wrenches=np.array([result[joint.name] for joint, _, _ in joints], dtype=object).reshape(-1, 6))
    return s.evaluate(tape)


def _momentum_rates(s: Sample, bodies: Mapping[str, np.ndarray]) -> np.ndarray:
    """m a_G and the rate of the angular momentum about G, n-frame, (n, 6), by differences of differences along the motion."""
    step = mpmath.mpf(10) ** (-s.digits // 3)
    ends = []
    for sign in (1, -1):
        there = moved(s, {}, sign * step, accelerating=True)
        v, omega = _twists(s, there)
        R = s.at(there)["frames"][:, 3:].reshape(-1, 3, 3)
        inertia = bodies["inertia"].reshape(-1, 3, 3)
        L = [r @ i @ r.T @ w for r, i, w in zip(R, inertia, omega, strict=True)]
        ends.append(np.concatenate([bodies["mass"][:, None] * v, np.array(L, dtype=object).reshape(-1, 3)], axis=1))
    return (ends[0] - ends[1]) / (2 * step)  # type: ignore[no-any-return]


def _twists(s: Sample, values: Mapping[str, Any]) -> tuple[np.ndarray, np.ndarray]:
    """Velocities of the centres of mass, and angular velocities, n-frame, (n, 3) each, by differences of the positions."""
    return difference(s, "positions", values), angular_velocities(s, values)
