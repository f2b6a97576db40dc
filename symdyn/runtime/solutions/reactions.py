"""Forces in the joints of a solution, in the axes that are requested."""

from __future__ import annotations

import difflib
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from symdyn.errors import ArgumentError
from symdyn.runtime.constraints import names, undetermined
from symdyn.shown import name_of, shown

if TYPE_CHECKING:
    from symdyn.runtime.solutions.solution import Solution


def reactions(solution: Solution, function: str = "reactions") -> dict[str, np.ndarray]:
    """Joint name -> force (N) and moment (N m) on the child body about the joint's point on it, n-frame, (n_t, 6).

    function   "reactions" or "cut_loads"
    """
    names = list(solution.module.metadata.reactions)
    if not names or function not in solution.module.functions:
        return {}
    rows = solution.rows(function)
    return {name: rows[:, k] for k, name in enumerate(names)}


def in_frame(solution: Solution, of_joints: Mapping[str, np.ndarray], joint: Any, frame: Any) -> np.ndarray:
    """One joint's force and moment, (n_t, 6), in the axes of the n-frame, the ground, its parent, its child, or a body."""
    metadata = solution.module.metadata
    name = name_of(joint)
    known = list(metadata.reactions)
    if name not in known:
        near = difflib.get_close_matches(name, known, 3)
        there = f"did you mean {' or '.join(near)}?" if near else f"there are {', '.join(known) or 'none'}"
        raise ArgumentError(f"{solution.module.name}: no reaction of a joint {shown(name)} is known; {there}")
    values = of_joints[name]
    frame = name_of(frame)
    ends = dict(zip(known, metadata.reaction_bodies, strict=False))
    if frame in ("parent", "child") and name in ends:
        frame = ends[name][0 if frame == "parent" else 1]
    bodies = list(metadata.bodies)
    still = "ground_rotation" not in solution.module.functions
    if frame == "inertial" or (frame == "ground" and still):
        return values
    if frame == "ground":
        R = solution.rows("ground_rotation")
    elif frame in bodies:
        R = solution.frames[:, bodies.index(frame), 3:].reshape(-1, 3, 3)
    else:
        raise ArgumentError(f"{solution.module.name}: there is no frame {shown(frame)}; there are inertial, ground, parent, "
                            f"child, {', '.join(bodies)}")
    turned: np.ndarray = np.einsum("tji,tkj->tki", R, values.reshape(-1, 2, 3)).reshape(-1, 6)
    return turned


def unique_reactions(solution: Solution) -> dict[str, np.ndarray]:
    """Joint name -> whether the motion determines its reaction, (n_t,) of bool: not where redundant constraints share it."""
    module = solution.module
    joints = list(module.metadata.reactions)
    if not joints or not names(module):
        return {joint: np.ones(len(solution.t), dtype=bool) for joint in joints}
    by_lam = solution.rows("reactions_by_lam").reshape(len(solution.t), len(joints), 6, -1)
    free = undetermined(module, solution.t, solution.x, solution.params)
    changes = np.abs(by_lam @ free[:, None]).max(axis=(2, 3))
    sizes = np.abs(by_lam).max(axis=(2, 3)) * np.abs(free).max(axis=(1, 2))[:, None]
    determined = changes <= 1e-6 * sizes
    return {joint: determined[:, k] for k, joint in enumerate(joints)}
