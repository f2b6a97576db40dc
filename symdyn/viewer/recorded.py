"""A motion that plays: poses over time, curves, forces in joints."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from symdyn.errors import ArgumentError
from symdyn.kinds import flag
from symdyn.pictures.bending import bendings
from symdyn.pictures.jointed import carriers
from symdyn.pictures.panels import panels_of
from symdyn.pictures.points import points_of
from symdyn.pictures.solids import lengths_of
from symdyn.shown import shown
from symdyn.viewer.arrays import packed
from symdyn.viewer.looks import GROUND, Mechanism
from symdyn.viewer.page import View, page_of
from symdyn.viewer.scene import scene_of

if TYPE_CHECKING:
    from symdyn.runtime.solutions.solution import Solution

# What the eye does not see: of the mechanism's length, and of a turn in radians.
_SEEN, _TURN = 1.5e-3, 3e-3
# Rows of a motion, and of its curves, at most.
_MOST, _CURVES = 40_000, 2_000
_FIXED = 1e-6


def view(solution: Solution, path: Any = None, compare: Any = None, forces: bool = False) -> View:
    """A page that plays a motion, see Solution.view."""
    flag(forces, f"{solution.module.name}: forces")
    motions = [_motion(solution, forces)]
    if compare is not None:
        if not hasattr(compare, "module") or not hasattr(compare, "rows"):
            raise ArgumentError(f"{solution.module.name}: compare is {shown(compare)}; pass another solution")
        motions.append(_motion(compare, forces))
    return page_of(solution.module.name, {"kind": "recorded", "name": solution.module.name, "motions": motions}, "", path)


def _motion(solution: Solution, forces: bool) -> dict[str, Any]:
    module, name = solution.module, solution.module.name
    about = module.metadata
    if "frames" not in module.functions or not about.bodies:
        raise ArgumentError(f"{name} has no body to draw: its module has no function 'frames'; describe it with bodies and "
                            "joints, or look at curves with solution.plot()")
    if not len(solution.t):
        raise ArgumentError(f"{name}: the motion has no time to show: {solution.message}")
    n_b, n_t = len(about.bodies), len(solution.t)
    frames = solution.rows("frames").reshape(n_t, n_b, 12)
    finite = np.isfinite(frames).all(axis=(1, 2))
    if not finite.all():
        first = int(np.argmin(finite))
        raise ArgumentError(f"{name}: positions of bodies are not finite at t = {solution.t[first]:.6g} s; end the motion "
                            "before it")
    order = np.argsort(solution.t, kind="stable")
    frames, t = frames[order], solution.t[order]
    mechanism = _mechanism(solution, frames, order)
    scene = scene_of(mechanism, about.drawn, lengths_of(solution), bendings(solution), name)
    rows = _rows(t, frames, scene["length"])
    chosen = frames[rows]
    scene |= {"kind": "recorded", "name": name, "t": packed(t[rows]), "origins": packed(chosen[..., :3].reshape(len(rows), -1)),
              "turns": packed(_quaternions(chosen[..., 3:].reshape(len(rows), n_b, 3, 3)).reshape(len(rows), -1)),
              "points": _locals(mechanism), "axes": _axes(mechanism), "success": bool(solution.success),
              "message": str(solution.message), "panels": _panels(solution, order)}
    eta = list(dict.fromkeys(c for record in about.flexible for c in record["coordinates"]))
    if eta:
        scene["eta"] = {"names": eta, "values": packed(np.column_stack([solution[c] for c in eta])[order][rows])}
    if forces and about.reactions and "reactions" in module.functions:
        found = solution.rows("reactions").reshape(n_t, -1, 6)[order][rows][..., :3]
        scene["forces"] = {"joints": list(about.reactions), "values": packed(np.nan_to_num(found).reshape(len(rows), -1)),
                           "largest": float(np.abs(np.nan_to_num(found)).max(initial=0.0))}
    return scene


def _mechanism(solution: Solution, frames: np.ndarray, order: np.ndarray) -> Mechanism:
    """The mechanism at the start of the motion."""
    module, about = solution.module, solution.module.metadata
    first, n_b = int(order[0]), len(about.bodies)

    def at(name: str, columns: int) -> np.ndarray:
        if name not in module.functions:
            return np.zeros((0, columns))
        found = module.evaluate(name, solution.t[first], solution.x[first], solution.params, solution.inputs[first])
        return np.asarray(found, dtype=float).reshape(-1, columns)

    points = at("joint_points", 6)
    names = list(zip(about.reactions, about.reaction_bodies, about.reaction_kinds, strict=True)) if len(points) else []
    inertia = at("inertial_parameters", 10)
    drawn = {about.bodies.index(r["body"]) for r in about.drawn if r.get("body") in about.bodies}
    drawn |= {about.bodies.index(r[end]) for r in about.flexible for end in ("body", "tip") if r[end] in about.bodies}
    drawn |= carriers(about.bodies, about.reactions, about.reaction_bodies)
    tips = []
    for output, point in points_of(solution).items():
        if point.quantity == "position":
            given = np.pad(solution.outputs[output][first], (0, 3 - solution.outputs[output].shape[1]))
            R, o = frames[0, point.body, 3:].reshape(3, 3), frames[0, point.body, :3]
            tips.append((point.body, R.T @ (given - o)))
    return Mechanism(about.bodies, frames[0], at("positions", 3), [(n, *ends, kind) for n, ends, kind in names], points,
                     at("joint_axes", 3), about.connections, at("spring_points", 6), inertia if len(inertia) == n_b else None,
                     about.planar, about.down, frozenset(drawn), tips)


def _locals(m: Mechanism) -> list[list[float]]:
    """Every point as its body and its place there."""
    return [[owner, *(float(f"{v:.7g}") for v in m.local(owner, point))] for point, owner in
            zip(m.points, m.owners(), strict=True)]


def _axes(m: Mechanism) -> list[list[float]]:
    """The axis of every joint in the axes of its parent."""
    found = []
    for (_, parent, _, _), axis in zip(m.joints, m.joint_axes, strict=True):
        body = m.index(parent)
        own = axis if body == GROUND else m.frames[body, 3:].reshape(3, 3).T @ axis
        found.append([body, *(float(f"{v:.7g}") for v in own)])
    return found


def _rows(t: np.ndarray, frames: np.ndarray, length: float) -> np.ndarray:
    """Indices of the fewest evenly spaced rows between which interpolation shows the same motion."""
    n = len(t)
    stride = 1
    while stride * 2 < n and _error(t, frames, np.unique([*range(0, n, stride * 2), n - 1]), length) <= 1.0:
        stride *= 2
    stride = max(stride, -(-n // _MOST))
    return np.unique([*range(0, n, stride), n - 1])


def _error(t: np.ndarray, frames: np.ndarray, rows: np.ndarray, length: float) -> float:
    """Largest difference of interpolated frames, in what the eye sees."""
    right = np.clip(np.searchsorted(rows, np.arange(len(t)), side="left"), 1, len(rows) - 1)
    a, b = rows[right - 1], rows[right]
    span = t[b] - t[a]
    w = np.divide(t - t[a], span, out=np.zeros_like(t), where=span > 0)[:, None, None]
    between = frames[a] * (1 - w) + frames[b] * w
    moved = np.abs(between[..., :3] - frames[..., :3]).max(initial=0.0)
    # Entries of a rotation on the chord: what is left after it is made one again is smaller.
    turned = np.abs(between[..., 3:] - frames[..., 3:]).max(initial=0.0)
    return float(max(moved / (_SEEN * length), turned / (10 * _TURN)))


def _quaternions(R: np.ndarray) -> np.ndarray:
    """Unit quaternions (w, x, y, z) of rotations (..., 3, 3), from the largest of their four squares (Shepperd, 1978)."""
    xx, yy, zz = R[..., 0, 0], R[..., 1, 1], R[..., 2, 2]
    squares = np.stack([1 + xx + yy + zz, 1 + xx - yy - zz, 1 - xx + yy - zz, 1 - xx - yy + zz], axis=-1)
    a, b, c = R[..., 2, 1] - R[..., 1, 2], R[..., 0, 2] - R[..., 2, 0], R[..., 1, 0] - R[..., 0, 1]
    d, e, f = R[..., 1, 0] + R[..., 0, 1], R[..., 0, 2] + R[..., 2, 0], R[..., 2, 1] + R[..., 1, 2]
    rows = np.stack([np.stack(row, axis=-1) for row in ((squares[..., 0], a, b, c), (a, squares[..., 1], d, e),
                                                        (b, d, squares[..., 2], f), (c, e, f, squares[..., 3]))], axis=-2)
    best = squares.argmax(axis=-1)
    found = np.take_along_axis(rows, best[..., None, None], axis=-2)[..., 0, :]
    return np.asarray(found / np.linalg.norm(found, axis=-1, keepdims=True))


def _panels(solution: Solution, order: np.ndarray) -> list[dict[str, Any]]:
    """Curves over time, thinned."""
    stride = max(1, -(-len(order) // _CURVES))
    rows = order[np.unique([*range(0, len(order), stride), len(order) - 1])]
    found = []
    for panel in panels_of(solution):
        values = panel.values[rows]
        if np.isfinite(values).all():
            found.append({"title": panel.title, "unit": panel.unit, "names": [n.replace("\n", " ") for n in panel.names],
                          "t": packed(solution.t[rows]), "values": packed(values)})
    return found
