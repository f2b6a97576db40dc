"""Groups of contacts whose pairs are found along a motion: their memory in time stepping, and overlaps at the start."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from symdyn.backend.metadata import GroupRecord
from symdyn.errors import ArgumentError

if TYPE_CHECKING:
    from symdyn.runtime.integrating.moreau_memory import Memory, Moreau
    from symdyn.runtime.module import Module

SPHERES = "contact_spheres"
# Room for so many contacts a body: equal spheres touch twelve others, each counted once, and a few planes.
ROOM = 8
# Overlaps at the start that count as touching, m.
TOUCHING = 1e-9


class Spheres(NamedTuple):
    """Spheres of all groups, at a state: unit normals and offsets of the planes (n, 4), radii (n_b,), centres (n_b, 3)."""

    planes: np.ndarray
    radius: np.ndarray
    center: np.ndarray


def n_speeds(groups: Sequence[GroupRecord]) -> int:
    """Speeds of one body."""
    return len(groups[0].speeds) // len(groups[0].bodies)


def spheres_at(module: Module, t: float, x: np.ndarray, p: np.ndarray, inputs: Any) -> Spheres:
    """Where the bodies of all groups are."""
    groups = module.metadata.contact_groups
    n, n_planes = n_speeds(groups), sum(group.planes for group in groups)
    values = module.evaluate(SPHERES, t, x[:module.metadata.sizes.x], p, inputs)
    planes, bodies = np.split(values[3 * len(groups):], [4 * n_planes])
    table = bodies.reshape(-1, 10 + 6 * n + n * n)
    return Spheres(planes.reshape(-1, 4), table[:, 0], table[:, 1:4])


def check_spheres_apart(module: Module, t: float, x: np.ndarray, p: np.ndarray, inputs: Any) -> None:
    """Raise ArgumentError for bodies of groups that overlap at the start, with how deep."""
    from scipy.spatial import cKDTree

    at, first, plane = spheres_at(module, t, x, p, inputs), 0, 0
    for group in module.metadata.contact_groups:
        own = slice(first, first + len(group.bodies))
        radius, center, planes = at.radius[own], at.center[own], at.planes[plane:plane + group.planes]
        first, plane = own.stop, plane + group.planes
        pairs = cKDTree(center).query_pairs(2 * radius.max(), output_type="ndarray")
        gaps = np.linalg.norm(center[pairs[:, 0]] - center[pairs[:, 1]], axis=1) - radius[pairs].sum(axis=1)
        below = center @ planes[:, :3].T - planes[:, 3] - radius[:, None]
        deep = min(float(gaps.min(initial=0.0)), float(below.min(initial=0.0)))
        if deep < -TOUCHING:
            if gaps.min(initial=0.0) == deep:
                pair = " and ".join(group.bodies[k] for k in pairs[int(np.argmin(gaps))])
            else:
                pair = f"{group.bodies[int(np.argmin(below.min(axis=1)))]} and a plane"
            count = np.count_nonzero(gaps < -TOUCHING) + np.count_nonzero(below < -TOUCHING)
            raise ArgumentError(f"{module.name}: contact group {group.name}: {count} of its pairs overlap at the start, the "
                                f"deepest {pair} by {-deep:.3g} m; move them apart")


def add_groups(module: Module, record: Moreau, memory: Memory) -> None:
    """Add groups of contacts to the record."""
    groups, index_type = module.metadata.contact_groups, np.dtype("long")
    bodies, planes = [len(group.bodies) for group in groups], [group.planes for group in groups]
    n, kind = sum(bodies), n_speeds(groups)
    record.n_groups, record.n_bodies, record.n_planes, record.n_speeds = len(groups), n, sum(planes), kind
    record.planar, record.n_table = int(module.metadata.planar), 2 * n + 1
    memory.take(record, "group_of", np.repeat(np.arange(len(groups)), bodies).astype(index_type))
    memory.take(record, "plane_group", np.append(np.repeat(np.arange(len(groups)), planes), 0).astype(index_type))
    memory.take(record, "speed_of", np.array([u for group in groups for u in group.speeds], dtype=index_type))
    memory.put(record, index_type, cell=3 * n, next=n, table=record.n_table)
    memory.put(record, float, response=6 * kind * n, was=3 * n)


def room_of(groups: Sequence[GroupRecord]) -> int:
    """Contacts that groups have room for."""
    return sum(len(group.bodies) * (ROOM + min(group.planes, 3)) for group in groups)
