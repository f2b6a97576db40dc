"""Quantities for time stepping of groups of spheres that touch one another: where each is, how it moves, and what it weighs.

A body of a group hangs on a joint of its own, so that its speeds answer to impulses on it alone: M^-1 is a small block.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from symdyn.formulation.loads.recorded import Loads
from symdyn.formulation.trees.kinematics import Kinematics
from symdyn.model.contacts.group import GroupSphere, LoweredGroup
from symdyn.spatial.vectors import cross, dot, vector
from symdyn.tape.differentiate import jacobian


def spheres(groups: Sequence[LoweredGroup], kinematics: Kinematics, loads: Loads) -> np.ndarray:
    """[coefficients of each group; normal, offset of each plane; of each body radius, centre, velocities, their derivatives by
    its speeds, its mass matrix], as many.h of the runtime takes it."""
    a = kinematics.algebra
    values: list[Any] = []
    with a.section("contact groups"):
        for group in groups:
            values += [a.expression(e) for e in group.coefficients]
        for normal, point in (plane for group in groups for plane in group.planes):
            n, at = (vector(*[a.expression(e) for e in part]) for part in (normal, point))
            unit = n / a.recorder.sqrt(dot(n, n))
            values += [*unit, dot(unit, at)]
        for sphere in (one for group in groups for one in group.spheres):
            values += _of_sphere(sphere, kinematics, loads)
    return vector(*values)


def _of_sphere(sphere: GroupSphere, kinematics: Kinematics, loads: Loads) -> list[Any]:
    a = kinematics.algebra
    pose = loads.pose(sphere.body)
    center = vector(*[a.expression(e) for e in sphere.center])
    omega, v = kinematics.twist(pose, center)
    leaves = [a.leaves[s] for s in sphere.speeds]
    n = len(leaves)
    moves = [*v, *omega]
    B = jacobian(a.recorder, moves, leaves, "forward").reshape(6, n)
    inertia = kinematics.tree.links[pose.link].inertia
    own_omega, own_v = kinematics.twists[pose.link]
    T = jacobian(a.recorder, [*own_omega, *own_v], leaves, "forward").reshape(6, n)
    M = np.zeros((n, n), dtype=object)
    for i in range(n):
        for j in range(n):
            one, two = T[:, i], T[:, j]
            momentum = inertia.m * two[3:] + cross(two[:3], inertia.h)
            turning = inertia.I @ two[:3] + cross(inertia.h, two[3:])
            M[i, j] = dot(one[3:], momentum) + dot(one[:3], turning)
    return [a.expression(sphere.radius), *kinematics.position(pose, center), *moves, *B.ravel(), *M.ravel()]
