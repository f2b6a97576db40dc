"""Checks of what is physical: masses, inertias, and that a planar system stays in its plane."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import numpy as np
import sympy as sp

from symdyn.model.bodies import Body
from symdyn.model.closures import Rod
from symdyn.model.joints import Custom, Fixed, Joint, Planar, Prismatic, Revolute
from symdyn.model.joints.base import numeric
from symdyn.model.symbols import flat
from symdyn.shown import shown


def inertia_faults(body: Body, planar: bool) -> tuple[list[str], list[str]]:
    """Faults of a body's mass and inertia, and doubts: what no real body has but can be computed with."""
    faults: list[str] = []
    doubts: list[str] = []
    where = f"body {shown(body.name)}"
    if body.mass.is_number and body.mass < 0:
        faults.append(f"{where} has the mass {body.mass} kg; pass zero or a positive mass")
    I = body.inertia
    difference = sp.zeros(3, 3) if I == I.T else I - I.T
    if any(e != 0 and abs(numeric(e)) > 1e-12 * max(abs(numeric(a)) for a in I) for e in difference.flat()):
        i, j = next((i, j) for i in range(3) for j in range(3) if difference[i, j] != 0)
        faults.append(f"{where}: inertia is not symmetric: I[{i + 1}, {j + 1}] = {I[i, j]}, "
                           f"I[{j + 1}, {i + 1}] = {I[j, i]}; pass a symmetric matrix")
    elif all(e.is_number for e in flat(I)) and any(e != 0 for e in flat(I)):
        values = np.linalg.eigvalsh(np.array(I.tolist(), dtype=float))
        scale = np.abs(values).max()
        if values[0] < -1e-12 * scale:
            faults.append(f"{where}: inertia has the principal moments {_list(values)} kg m^2, one is negative; "
                               "it must be about the centre of mass")
        elif planar:
            return faults, doubts
        elif values[0] + values[1] < values[2] * (1 - 1e-9):
            doubts.append(f"{where}: principal moments {_list(values)} kg m^2 violate the triangle inequality; "
                               "no real body has them")
        elif values[0] <= 1e-12 * scale:
            doubts.append(f"{where}: inertia is semidefinite, principal moments {_list(values)} kg m^2")
    return faults, doubts


def plane_faults(joints: Iterable[Joint], ground_motion: Any) -> list[str]:
    """Parts that turn or move out of the x-y plane in a planar system."""
    faults: list[str] = []
    for joint in joints:
        where = f"joint {shown(joint.name)}"
        for what in ("parent_rotation", "child_rotation"):
            R = getattr(joint, what)
            if any(abs(numeric(flat(R)[k])) > 1e-9 for k in (2, 5)):
                faults.append(f"{where}: {what} turns out of the x-y plane, but the system is planar; "
                                   "turn about z only, or make the system spatial: planar=False")
        if isinstance(joint, Custom):
            if joint.transform is not None and not joint.transform.in_plane:
                faults.append(f"{where} (custom): its transform leaves the x-y plane, but the system is planar; turn about z "
                              "and move in x and y only, or make the system spatial: planar=False")
        elif not isinstance(joint, (Revolute, Prismatic, Planar, Fixed, Rod)):
            faults.append(f"{where} is {joint.kind}, but the system is planar; use Revolute, Prismatic, Planar or "
                               "Fixed, or make the system spatial: planar=False")
        elif isinstance(joint, Revolute) and any(abs(numeric(e)) > 1e-9 for e in flat(joint.axis)[:2]):
            faults.append(f"{where}: axis {list(joint.axis)} is not along z, but the system is planar; "
                               "pass [0, 0, 1] or [0, 0, -1], or make the system spatial: planar=False")
        elif isinstance(joint, Prismatic) and abs(numeric(joint.axis[2])) > 1e-9:
            faults.append(f"{where}: axis {list(joint.axis)} is not in the x-y plane, but the system is planar; "
                               "pass an axis without a z component, or make the system spatial: planar=False")
    if ground_motion is not None and any(angle != 0 and letter != "Z" for angle, letter in zip(
            ground_motion.coordinates[3:], getattr(ground_motion.orientation, "sequence", ""), strict=False)):
        faults.append("move_ground: angles turn the ground out of the x-y plane, but the system is planar; "
                           "give only angles about Z, or make the system spatial: planar=False")
    return faults


def _list(values: np.ndarray) -> str:
    return "[" + ", ".join(f"{v:.4g}" for v in values) + "]"
