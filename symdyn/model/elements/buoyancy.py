"""Buoyancy of floaters that are made of boxes, exact at any draft and attitude."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import TYPE_CHECKING, Any

import numpy as np
import sympy as sp

from symdyn.errors import ModelError
from symdyn.model.elements.base import Element
from symdyn.model.elements.cube import Cube
from symdyn.model.elements.site import Action, Site, Validity
from symdyn.shown import shown
from symdyn.spatial.vectors import cross, dot, vector, zeros
from symdyn.tape.node import is_zero

if TYPE_CHECKING:
    from symdyn.given import BodyOrName, Scalar, Vector

# Part of the whole volume below which a volume is rounding.
LEAST = 1e-9


@dataclass(frozen=True)
class Box:
    """A box whose edges are parallel to the axes of its body.

    size    (3,) lengths of its edges along x, y, z, m, positive; center: (3,) its middle, body axes, m

    >>> sd.Box([2, 1, 1], center=[0, 0, -0.5]).size
    [2, 1, 1]
    """

    size: Vector
    center: Vector = (0, 0, 0)


class Buoyancy(Element):
    """The static force of still water, z < 0 in the n-frame, on a body that is made of boxes: the weight of the water that the
    wet part of the boxes displaces, upwards through the wet part's centroid. Exact at any draft, heel and trim.

    boxes     boxes that must not overlap: sd.Box, or (3,) sizes of boxes whose middle is the body's origin
    without   boxes inside them that are open to the water, such as a moonpool
    density   of the water, kg/m^3; gravity: m/s^2, default: the model's, which must point along -z

    All may hold parameters. Its potential is the integral of density*gravity*depth over the wet part. Its validity checks
    are of the wet part of the volume, which is between 0 and 1 while the body floats.

    >>> system = sd.System("float", gravity=[0, 0, -9.81])
    >>> box = system.add_body("box", mass=500, inertia=[100, 100, 100])
    >>> joint = system.add_joint(sd.Prismatic("heave", system.ground, box, axis=[0, 0, 1]))
    >>> buoyancy = system.add_load(sd.Buoyancy(box, [sd.Box([1, 1, 1])], density=1000))
    >>> system.compile(backend="numpy").rhs(0.0, [-0.1, 0.0]).round(4)
    array([0.   , 1.962])
    """

    kind = "buoyancy"

    def __init__(self, body: BodyOrName, boxes: Sequence[Box], density: Scalar, without: Sequence[Box] = (),
                 gravity: Scalar | None = None, name: str = "") -> None:
        super().__init__(body, name)
        self.boxes = self._boxes(boxes, "boxes")
        self.without = self._boxes(without, "without")
        self.density = self._positive(density, "density", "kg/m^3")
        self.gravity = None if gravity is None else self._positive(gravity, "gravity", "m/s^2")
        if not self.boxes and not self.faults:
            self.faults.append(f"{self.where}: there are no boxes; pass boxes=[sd.Box(size, center), ...]")
        if not self.faults:
            self._look_for_overlaps()

    @property
    def constants(self) -> Sequence[sp.Expr]:
        boxes = [*self.boxes, *self.without]
        gravity = [] if self.gravity is None else [self.gravity]
        return [*(e for box in boxes for e in (*box.size, *box.center)), self.density, *gravity]

    @property
    def units(self) -> Mapping[str, Sequence[sp.Expr]]:
        lengths = [e for box in [*self.boxes, *self.without] for e in (*box.size, *box.center)]
        return {"m": lengths, "kg/m^3": [self.density], "m/s^2": [] if self.gravity is None else [self.gravity]}

    def act(self, site: Site) -> Action:
        """Raises ModelError if the gravity to be taken from the model does not point along -z."""
        a = site.algebra
        weight = a.expression(self.density) * self._gravity(site)
        up, height = site.R[2], site.p[2]
        whole: Any = 0
        V: Any = 0
        S = zeros(3)  # first moment of the wet volume about the body's origin
        no_pose = f"{self.where}: the pose of its body is no number"
        no_edge = f"{self.where}: a box has an edge without a positive length"
        for sign, box in [*((1, box) for box in self.boxes), *((-1, box) for box in self.without)]:
            size = vector(*[a.divisor(e, 0, no_edge) for e in a.constants(box.size)])
            center = a.constants(box.center)
            depth = vector(-(height + dot(up, center)), *(-up * size))
            wet = np.array(a.recorder.call(Cube((0,), no_pose), list(depth)), dtype=object)
            volume = sign * size[0] * size[1] * size[2]
            whole = whole + volume
            V = V + volume * wet[0]
            S = S + volume * (wet[0] * center + size * wet[1:])
        V = a.name(f"displaced_{self.label}", V)
        label, part, result = f"immersed part of {self.where}", V / whole, "the immersed part of its volume is {value}"
        validity_checks = (
            Validity(label, part, LEAST, math.inf, f"{self.where}: the box has left the water: {result}"),
            Validity(label, part, -math.inf, 1 - LEAST, f"{self.where}: it is under water altogether: it sinks: {result}"))
        return Action(elastic=(weight * V * up, weight * cross(S, up)), potential=-weight * (dot(up, S) + height * V),
                      validity_checks=validity_checks)

    def _gravity(self, site: Site) -> Any:
        if self.gravity is not None:
            return site.algebra.expression(self.gravity)
        x, y, z = site.gravity
        if not is_zero(x) or not is_zero(y) or is_zero(z) or _upward(z):
            raise ModelError([f"{self.where}: water lies at z < 0, and the model's gravity does not point along -z: its "
                              "components must be [0, 0, -g]; turn the model, or pass gravity="])
        return -z

    # -- checks

    def _positive(self, value: Any, what: str, unit: str) -> sp.Expr:
        n = len(self.faults)
        e = self.faults.expression(value, f"{self.where}: {what}")
        if e.is_positive is False and len(self.faults) == n:
            self.faults.append(f"{self.where}: {what} is {e} {unit}; it must be positive")
        return e

    def _boxes(self, given: Any, what: str) -> tuple[Box, ...]:
        """Boxes with (3, 1) sizes and centers."""
        if isinstance(given, Box):
            given = [given]
        if not isinstance(given, Sequence) or isinstance(given, str):
            self.faults.append(f"{self.where}: {what} is {shown(given)}; pass a list of sd.Box(size, center)")
            return ()
        taken = []
        for k, box in enumerate(given):
            where = f"{self.where}: {what}[{k}]"
            if not isinstance(box, Box):
                if not hasattr(box, "__len__") or isinstance(box, str):
                    self.faults.append(f"{where} is {shown(box)}; pass sd.Box(size, center), or three sizes")
                    continue
                box = Box(box)
            n = len(self.faults)
            size = self.faults.vector(box.size, f"{where}: size")
            center = self.faults.vector(box.center, f"{where}: center")
            if len(self.faults) == n and any(e.is_positive is False for e in size):
                self.faults.append(f"{where}: size is {list(size)} m; each edge must have a positive length")
            taken.append(Box(size, center))
        return tuple(taken)

    def _look_for_overlaps(self) -> None:
        """Faults of boxes that are given by numbers: overlaps, which would count twice, and holes that reach outside."""
        solid, holes = _bounds(self.boxes), _bounds(self.without)
        for what, bounds in (("boxes", solid), ("without", holes)):
            for (i, first), (j, second) in combinations(bounds.items(), 2):
                if (common := first.common(second)) > LEAST * min(first.volume, second.volume):
                    self.faults.append(f"{self.where}: {what}[{i}] and {what}[{j}] overlap by {common:.6g} m^3, which would "
                                       "count twice; cut them so that they only touch")
        if self.faults or len(solid) < len(self.boxes):
            return
        for k, hole in holes.items():
            outside = hole.volume - sum(hole.common(box) for box in solid.values())
            if outside > LEAST * hole.volume:
                self.faults.append(f"{self.where}: {outside:.6g} m^3 of the {hole.volume:.6g} m^3 of without[{k}] are outside "
                                   "the boxes; shorten it")


@dataclass(frozen=True)
class _Bounds:
    """Least and largest coordinates of a box, m."""

    least: np.ndarray
    most: np.ndarray

    @property
    def volume(self) -> float:
        return float(np.prod(self.most - self.least))

    def common(self, other: _Bounds) -> float:
        """The volume that both have."""
        edges = np.minimum(self.most, other.most) - np.maximum(self.least, other.least)
        return float(np.prod(np.maximum(edges, 0.0)))


def _bounds(boxes: Sequence[Box]) -> dict[int, _Bounds]:
    """Bounds of the boxes whose sizes are numbers, by index in the list."""
    bounds = {}
    for k, box in enumerate(boxes):
        if all(e.is_number for e in (*box.size, *box.center)):
            size, center = (np.array(v, dtype=float).ravel() for v in (box.size, box.center))
            bounds[k] = _Bounds(center - size / 2, center + size / 2)
    return bounds


def _upward(z: Any) -> bool:
    """Whether a component of gravity is a number that points up."""
    return not hasattr(z, "op") and z > 0
