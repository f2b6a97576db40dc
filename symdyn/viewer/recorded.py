"""A motion that plays: poses over time, curves, forces in joints."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from symdyn.errors import ArgumentError
from symdyn.kinds import flag
from symdyn.pictures.arrows import TITLES, Arrows, arrows_of
from symdyn.pictures.bending import bendings
from symdyn.pictures.marks import events_of, switches_of
from symdyn.pictures.mechanism import Hung, lengths_of, mechanism_of
from symdyn.pictures.panels import need_something, panels_of
from symdyn.pictures.symbols import typeset_unit
from symdyn.shown import shown
from symdyn.viewer.arrays import packed
from symdyn.viewer.page import View, page_of
from symdyn.viewer.scene import scene_of

if TYPE_CHECKING:
    from symdyn.runtime.solutions.solution import Solution

# Changes that the eye does not see: of the mechanism's length, and of a turn in radians.
_SEEN, _TURN = 1.5e-3, 3e-3
# Change of an arrow that the eye does not see, relative to the largest.
_LONGER = 0.02
# Rows of a motion, and of its curves, at most.
_MOST, _CURVES = 40_000, 2_000


def view(solution: Solution, path: Any = None, compare: Any = None, forces: bool = False,
         show: Sequence[str] | None = None) -> View:
    """A page that plays a motion, see Solution.view."""
    flag(forces, f"{solution.module.name}: forces")
    motions = [_motion(solution, forces, show)]
    if compare is not None:
        if not hasattr(compare, "module") or not hasattr(compare, "rows"):
            raise ArgumentError(f"{solution.module.name}: compare is {shown(compare)}; pass another solution")
        motions.append(_motion(compare, forces, show))
    return page_of(solution.module.name, {"kind": "recorded", "name": solution.module.name, "motions": motions}, "", path)


def _motion(solution: Solution, forces: bool, show: Sequence[str] | None) -> dict[str, Any]:
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
    mechanism = mechanism_of(solution, frames, int(order[0]))
    frames, t = frames[order], solution.t[order]
    hung = Hung.of(mechanism)
    scene = scene_of(mechanism, about.drawn, lengths_of(solution), bendings(solution), name)
    arrows = arrows_of(solution, scene["length"], forces)
    acting = [one.vectors[order] / one.largest for one in arrows if one.layer != "contacts"]
    rows = _rows(t, frames, scene["length"], np.nan_to_num(np.concatenate(acting, axis=1)) if acting else None)
    chosen = frames[rows]
    scene |= {"kind": "recorded", "name": name, "t": packed(t[rows]), "origins": packed(chosen[..., :3].reshape(len(rows), -1)),
              "turns": packed(_quaternions(chosen[..., 3:].reshape(len(rows), n_b, 3, 3)).reshape(len(rows), -1)),
              "points": _locals(hung), "axes": _axes(hung), "success": bool(solution.success),
              "message": str(solution.message), "panels": _panels(solution, order, show),
              "marks": {"events": events_of(solution), "modes": switches_of(solution)}}
    eta = list(dict.fromkeys(c for record in about.flexible for c in record["coordinates"]))
    if eta:
        scene["eta"] = {"names": eta, "values": packed(np.column_stack([solution[c] for c in eta])[order][rows])}
    scene["arrows"] = [_arrows(one, order[rows]) for one in arrows]
    return scene


def _arrows(arrows: Arrows, rows: np.ndarray) -> dict[str, Any]:
    """Vectors at some rows, with places where these are no points of the mechanism: zero while nothing acts."""
    vectors = np.nan_to_num(arrows.vectors[rows])
    every = vectors if len(arrows.points) else np.concatenate([np.nan_to_num(arrows.tails[rows]), vectors], axis=2)
    return {"layer": arrows.layer, "title": TITLES[arrows.layer], "color": arrows.color, "names": list(arrows.names),
            "points": list(arrows.points), "unit": arrows.unit, "scale": arrows.scale,
            "longest": arrows.longest if np.isfinite(arrows.longest) else None, "values": packed(every.reshape(len(rows), -1))}


def _locals(hung: Hung) -> list[list[float]]:
    """Every point as its body and its place there."""
    return [[int(owner), *map(_short, index)] for owner, index in zip(hung.owners, hung.places, strict=True)]


def _axes(hung: Hung) -> list[list[float]]:
    """The axis of every joint in the axes of its parent."""
    return [[int(body), *map(_short, axis)] for body, axis in zip(hung.parents, hung.axes, strict=False)]


def _short(value: float) -> float:
    return float(f"{value:.7g}")


def _rows(t: np.ndarray, frames: np.ndarray, length: float, acting: np.ndarray | None = None) -> np.ndarray:
    """Indices of the fewest evenly spaced rows between which interpolation shows the same motion; acting: forces and torques
    (n_t, n, 3), of their largest."""
    n = len(t)
    stride = 1
    while stride * 2 < n and _error(t, frames, np.unique([*range(0, n, stride * 2), n - 1]), length, acting) <= 1.0:
        stride *= 2
    stride = max(stride, -(-n // _MOST))
    return np.unique([*range(0, n, stride), n - 1])


def _error(t: np.ndarray, frames: np.ndarray, rows: np.ndarray, length: float, acting: np.ndarray | None = None) -> float:
    """Largest difference of interpolated frames and arrows, in what the eye sees."""
    right = np.clip(np.searchsorted(rows, np.arange(len(t)), side="left"), 1, len(rows) - 1)
    a, b = rows[right - 1], rows[right]
    span = t[b] - t[a]
    w = np.divide(t - t[a], span, out=np.zeros_like(t), where=span > 0)[:, None, None]
    between = frames[a] * (1 - w) + frames[b] * w
    moved = np.abs(between[..., :3] - frames[..., :3]).max(initial=0.0)
    # Entries of a rotation on the chord: what is left after it is made one again is smaller.
    turned = np.abs(between[..., 3:] - frames[..., 3:]).max(initial=0.0)
    longer = 0.0 if acting is None else np.abs(acting[a] * (1 - w) + acting[b] * w - acting).max(initial=0.0)
    return float(max(moved / (_SEEN * length), turned / (10 * _TURN), longer / _LONGER))


def _quaternions(R: np.ndarray) -> np.ndarray:
    """Unit quaternions (w, x, y, z) of rotations (..., 3, 3), from the largest of their four squares (Shepperd, 1978)."""
    xx, yy, zz = R[..., 0, 0], R[..., 1, 1], R[..., 2, 2]
    squares = np.stack([1 + xx + yy + zz, 1 + xx - yy - zz, 1 - xx + yy - zz, 1 - xx - yy + zz], axis=-1)
    a, b, c = R[..., 2, 1] - R[..., 1, 2], R[..., 0, 2] - R[..., 2, 0], R[..., 1, 0] - R[..., 0, 1]
    d, e, f = R[..., 1, 0] + R[..., 0, 1], R[..., 0, 2] + R[..., 2, 0], R[..., 2, 1] + R[..., 1, 2]
    rows = np.stack([np.stack(row, axis=-1) for row in ((squares[..., 0], a, b, c), (a, squares[..., 1], d, e),
                                                        (b, d, squares[..., 2], f), (c, e, f, squares[..., 3]))], axis=-2)
    best = squares.argmax(axis=-1)
    result = np.take_along_axis(rows, best[..., None, None], axis=-2)[..., 0, :]
    return np.asarray(result / np.linalg.norm(result, axis=-1, keepdims=True))


def _panels(solution: Solution, order: np.ndarray, show: Sequence[str] | None) -> list[dict[str, Any]]:
    """Curves over time, thinned; show: which ones, None for all."""
    stride = max(1, -(-len(order) // _CURVES))
    rows = order[np.unique([*range(0, len(order), stride), len(order) - 1])]
    panels, result = panels_of(solution, show), []
    need_something(solution, show, panels or (show is not None and "mechanism" in show))
    for panel in panels:
        values = panel.values[rows]
        if np.isfinite(values).all():
            title = f"{panel.title}: {panel.part}" if panel.part else panel.title
            result.append({"title": title, "unit": typeset_unit(panel.unit), "names": [n.replace("\n", " ") for n in panel.names],
                           "t": packed(solution.t[rows]), "values": packed(values)})
    return result
