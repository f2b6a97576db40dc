"""Shapes of bodies over time."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.colors import to_rgb

from symdyn.errors import ArgumentError
from symdyn.pictures.bending import Bending, bendings
from symdyn.pictures.forms import Forms
from symdyn.pictures.grounds import Ground
from symdyn.pictures.looks import color_of_body
from symdyn.pictures.mechanism import filled, lengths_of, mechanism_of
from symdyn.pictures.meshes import Part, beam, parts_of
from symdyn.shown import shown

if TYPE_CHECKING:
    from symdyn.runtime.solutions.solution import Solution

_GROUND_COLOR = (0.6, 0.6, 0.6)
_WATER_COLOR = "#4a90c4"
# Times at which is looked how far shapes reach.
_SAMPLES = 60


@dataclass(frozen=True)
class Water:
    """A water surface: level, and its rectangle (2, 2) from lower to upper along x and y, or None for the whole picture.

    waves   amplitude (m), frequency (rad/s), length (m), heading (rad) and ramp (s) of regular ones, or None: it is at rest
    """

    level: float
    reach: np.ndarray | None
    color: tuple[float, float, float]
    waves: tuple[float, ...] | None = None

    @property
    def heading(self) -> np.ndarray:
        """Unit vector (2,) along which waves go; x without waves."""
        angle = self.waves[3] if self.waves is not None else 0.0
        return np.array([np.cos(angle), np.sin(angle)])

    def elevation(self, time: float, along: np.ndarray) -> np.ndarray:
        """Height of the surface above its level at places `along` the heading, m."""
        if self.waves is None:
            return np.zeros_like(along)
        amplitude, frequency, length, _, ramp = self.waves
        grown = amplitude * ((1 - np.cos(np.pi * np.clip(time / ramp, 0.0, 1.0))) / 2 if ramp > 0 else 1.0)
        return np.asarray(grown * np.cos(frequency * time - 2 * np.pi / length * along))

    def heights(self, points: np.ndarray, time: float) -> np.ndarray:
        """Heights of points (n, 3) above the surface, m."""
        return np.asarray(points[:, 2] - self.level - self.elevation(time, points[:, :2] @ self.heading))


@dataclass(frozen=True)
class Solids:
    """Shapes of bodies over time.

    own         of shapes of the user's and of what bends, in body axes; bending: of each of these, if it bends
    times       (n_t,), s
    forms       what bodies, joints and springs look like by themselves; None where joints are not listed
    origins     (n_t, n_b + 1, 3) and rotations (n_t, n_b + 1, 3, 3), the last the ground's; bodies: those that have shapes
    planes      of the ground that contacts have
    """

    own: Sequence[Part]
    bending: Sequence[Bending | None]
    forms: Forms | None
    water: Water | None
    origins: np.ndarray
    rotations: np.ndarray
    bodies: frozenset[int]
    times: np.ndarray
    planar: bool
    planes: Sequence[Ground]

    @property
    def parts(self) -> Sequence[Part]:
        return [*self.own, *(form.part for form in (self.forms.forms if self.forms is not None else ()))]

    @classmethod
    def of(cls, solution: Solution, span: tuple[float, float] | None = None, inertia: bool = False) -> Solids | None:
        """The shapes of a motion; None if its module has none. Raises ArgumentError for a colour that does not exist.

        span      the part of it that is shown, s; None: all
        inertia   with the ellipsoids of inertia of its bodies
        """
        module = solution.module
        records = module.metadata.drawn
        bent = bendings(solution)
        jointed = {"joint_points", "joint_axes"} <= set(module.functions)
        if not (records or bent or jointed) or "frames" not in module.functions or not len(solution.t):
            return None
        frames = solution.rows("frames").reshape(len(solution.t), -1, 12)
        if not np.isfinite(frames).all():
            return None
        mechanism = mechanism_of(solution, frames, int(solution.t.argmin()), span)
        forms = Forms.of(mechanism, inertia) if jointed else None
        length = forms.length if forms is not None else float(np.ptp(frames[..., :3], axis=(0, 1)).max(initial=0.0))
        still = np.concatenate([np.zeros(3), np.eye(3).ravel()])
        frames = np.concatenate([frames, np.broadcast_to(still, (len(frames), 1, 12))], axis=1)
        names = [*module.metadata.bodies, "ground"]
        colors = [*(to_rgb(color_of_body(k)) for k in range(len(names) - 1)), _GROUND_COLOR]
        parts, bending, water = [], [], None
        for record in filled(records, lengths_of(solution)):
            body = names.index(record["body"])
            if record["kind"] == "water":
                water = water_of(record, module.name)
                continue
            to = names.index(record["to"]) if record.get("to") is not None else None
            color = colors[body] if record["color"] is None else color_of(record["color"], module.name)
            made = list(parts_of(record, body, color, to, body in bent))
            parts += made
            bending += [bent[body].of(part) if body in bent and part.to is None else None for part in made]
        for body in bent:
            if not any(part.body == body for part in parts):
                parts.append(beam(body, colors[body], bent[body].points, length))
                bending.append(bent[body].of(parts[-1]))
        bodies = {part.body for part in parts}
        around = [*mechanism.around.parts, *mechanism.around.floors]
        parts += around
        bending += [None] * len(around)
        rotations = frames[..., 3:].reshape(*frames.shape[:2], 3, 3)
        return cls(parts, bending, forms, water, frames[..., :3], rotations, frozenset(bodies), solution.t,
                   module.metadata.planar, mechanism.around.planes)

    def at(self, t: np.ndarray, times: np.ndarray) -> Solids:
        """The shapes at other times: origins between those of the two nearest times, rotations on the shortest way."""
        order = np.argsort(t)
        right = np.clip(np.searchsorted(t[order], times), 1, len(t) - 1)
        a, b = order[right - 1], order[right]
        w = ((times - t[a]) / (t[b] - t[a]))[:, None, None]
        turned = part_way(self.rotations[a], self.rotations[b], w)
        return replace(self, origins=self.origins[a] * (1 - w) + self.origins[b] * w, rotations=turned, times=times,
                       bending=[None if one is None else one.between(a, b, w[:, :, 0]) for one in self.bending])

    def vertices(self, index: int) -> list[np.ndarray]:
        """The vertices of every part at one of the times, (n, 3) each, n-frame."""
        result = []
        for part, bending in zip(self.own, self.bending, strict=True):
            own = part.vertices if bending is None else part.vertices + bending.displacements(index)
            placed = self.origins[index, part.body] + own @ self.rotations[index, part.body].T
            if part.to is not None:
                placed[-1] = self.origins[index, part.to] + self.rotations[index, part.to] @ part.vertices[-1]
            result.append(placed)
        return result if self.forms is None else result + self.forms.vertices(self.origins[index], self.rotations[index])

    def points(self) -> np.ndarray:
        """Points of joints, bodies and springs at every time, (n_t, n, 3); none without forms."""
        return np.zeros((len(self.times), 0, 3)) if self.forms is None else self.forms.near(self.origins, self.rotations)

    def reach(self) -> np.ndarray:
        """Points that the picture must show, (n, 3)."""
        some = np.unique(np.linspace(0, len(self.origins) - 1, _SAMPLES).astype(int))
        wide = [k for k, part in enumerate(self.parts) if not (part.ground and self.planar)]
        points = [np.concatenate([there[i] for i in wide]) for k in some for there in [self.vertices(int(k))]] if wide else []
        if self.water is not None and self.water.reach is not None:
            high = self.water.waves[0] if self.water.waves is not None else 0.0
            points += [np.column_stack([self.water.reach, np.full(2, self.water.level + sign * high)]) for sign in (-1, 1)]
        return np.concatenate(points) if points else np.zeros((0, 3))


def part_way(A: np.ndarray, B: np.ndarray, w: Any) -> np.ndarray:
    """Rotations (..., 3, 3) a share w (..., 1) of the way from A to B, about the one axis of the turn between them."""
    Q = np.swapaxes(A, -1, -2) @ B
    twice = np.stack([Q[..., 2, 1] - Q[..., 1, 2], Q[..., 0, 2] - Q[..., 2, 0], Q[..., 1, 0] - Q[..., 0, 1]], axis=-1)
    cosine = (np.trace(Q, axis1=-2, axis2=-1) - 1) / 2
    angle = np.arctan2(np.linalg.norm(twice, axis=-1) / 2, cosine)[..., None]
    # Near a half turn the differences vanish; the axis then is in the columns of the symmetric part.
    halves = Q + np.swapaxes(Q, -1, -2) - 2 * cosine[..., None, None] * np.eye(3)
    largest = np.linalg.norm(halves, axis=-2).argmax(axis=-1)
    column = np.take_along_axis(halves, largest[..., None, None], axis=-1)[..., 0]
    column = column * np.where((column * twice).sum(axis=-1, keepdims=True) < 0, -1.0, 1.0)
    axis = np.where(cosine[..., None] < -0.9, column, twice)
    length = np.linalg.norm(axis, axis=-1, keepdims=True)
    x, y, z = np.moveaxis(np.divide(axis, length, out=np.zeros_like(axis), where=length > 0), -1, 0)
    zero = np.zeros_like(x)
    K = np.stack([zero, -z, y, z, zero, -x, -y, x, zero], axis=-1).reshape(*x.shape, 3, 3)
    turned = (w * angle)[..., None]
    return np.asarray(A @ (np.eye(3) + np.sin(turned) * K + (1 - np.cos(turned)) * K @ K))


def water_of(record: Mapping[str, Any], name: str) -> Water:
    """The water surface of a record; name: of the mechanism, for messages."""
    values, color = record["values"], color_of(record["color"] or _WATER_COLOR, name)
    waves = tuple(values["waves"][0]) if "waves" in values else None
    if "size" not in values:
        return Water(values["level"][0][0], None, color, waves)
    center, half = np.array(values["center"][0]), np.array(values["size"][0]) / 2
    return Water(values["level"][0][0], np.array([center - half, center + half]), color, waves)


def color_of(given: Any, name: str) -> tuple[float, float, float]:
    """A colour as numbers. Raises ArgumentError for one that does not exist; name: of the mechanism."""
    try:
        return to_rgb(given)
    except ValueError:
        raise ArgumentError(f"{name}: a shape has the colour {shown(given)}, which is none; pass '#rrggbb', a grey level such as "
                            "'0.8', or a name such as 'orange' or 'steelblue'") from None
