"""A random mechanism while it is described: bodies, joints and closed loops about a drawn configuration.

Coordinates get their values when their joint is drawn, and the pose of every body is computed at once, so that loops can be
closed where the bodies are: the configuration fulfils its constraints by construction, to rounding.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from types import ModuleType
from typing import Any, TypeAlias

import numpy as np
import sympy as sp

import symdyn as sd
from symdyn.errors import EvaluationError
from symdyn.model.bodies import Body
from symdyn.model.joints import Joint
from symdyn.model.orientation import SEQUENCES
from symdyn.model.symbols import Coordinate, Speed
from symdyn.turning import in_radians

# Number that joints and loads take.
Expression: TypeAlias = float | sp.Expr
# Joints that carry bodies, with how often they are drawn.
SPATIAL = {"Revolute": 8, "Prismatic": 4, "Helical": 2, "Cylindrical": 2, "Universal": 2, "Planar": 2, "Spherical": 3, "Free": 1,
           "Fixed": 1, "Custom": 1}
PLANAR = {"Revolute": 8, "Prismatic": 4, "Planar": 2, "Fixed": 1}
# Joints that close loops, with the number of freedoms that they take away, in space and in a plane.
CLOSES_SPATIAL = {"Rod": 1, "Gear": 1, "Spherical": 3, "Planar": 3, "Universal": 4, "Cylindrical": 4, "Revolute": 5,
                  "Prismatic": 5, "Helical": 5, "Custom": 5, "Fixed": 6}
CLOSES_PLANAR = {"Rod": 1, "Gear": 1, "Revolute": 2, "Prismatic": 2}


def as_float(e: Expression, values: Mapping[sp.Basic, float]) -> float:
    """An expression as a float."""
    return float(sp.sympify(e, strict=True).xreplace({s: sp.Float(v, 17) for s, v in values.items()}))


class Numbers:
    """The algebra that joints are written for, on numbers; `values` of the symbols of expressions.

    number      what makes a number of an expression and the values
    functions   where sin, cos and sqrt of such numbers are: numpy for floats, mpmath for more digits
    """

    def __init__(self, values: Mapping[sp.Basic, Any], number: Callable[[Any, Mapping[sp.Basic, Any]], Any] = as_float,
                 functions: ModuleType = np) -> None:
        self.values = dict(values)
        self.number, self.functions = number, functions
        self.sin, self.cos, self.sqrt = functions.sin, functions.cos, functions.sqrt

    def within(self, values: Mapping[sp.Basic, Any]) -> Numbers:
        """The same with more symbols."""
        return Numbers({**self.values, **values}, self.number, self.functions)

    def divisor(self, value: float, least: Expression, reason: str) -> float:
        """The value. Raises EvaluationError with the reason where it is not more than the least."""
        if not value > float(least):
            raise EvaluationError(reason)
        return value

    def expression(self, e: Expression) -> Any:
        """An expression as a number."""
        return self.number(e, self.values)

    def constants(self, values: Sequence[Expression]) -> np.ndarray:
        """Expressions as numbers, (n,)."""
        numbers = [self.expression(e) for e in values]
        return np.array(numbers, dtype=float if all(isinstance(v, float) for v in numbers) else object)

    def matrix(self, values: sp.MatrixBase) -> np.ndarray:
        """A matrix of expressions as numbers."""
        return self.constants(list(values)).reshape(values.shape)


@dataclass(frozen=True, eq=False)
class Link:
    """A body in the tree: what it hangs on, by which joint, with how many freedoms of its own, and its pose.

    R, p   components in body axes to components in the ground's; the origin, m
    """

    body: Body
    parent: Link | None
    joint: Joint | None
    freedoms: int
    R: np.ndarray
    p: np.ndarray


class Draft:
    """A system, with the values of its coordinates.

    values     own coordinates, with the numbers they are drawn about
    speeds     symbols of the generalized speeds of joints, in the order in which they were added
    links      the ground first
    cyclic     coordinates and speeds along which a steady motion goes on
    removed    freedoms that constraints take away so far
    """

    def __init__(self, rng: random.Random, name: str, planar: bool, gravity: Sequence[Expression], t: float) -> None:
        self.rng, self.planar, self.t = rng, planar, t
        self.system = sd.System(name, gravity=list(gravity), planar=planar)
        self.values: dict[sp.Symbol, float] = {}
        self.speeds: list[sp.Symbol] = []
        self.cyclic: set[sp.Symbol] = set()
        self.links = [Link(self.system.ground, None, None, 0, np.eye(3), np.zeros(3))]
        self.removed = 0
        self._count = 0

    # -- what there is

    @property
    def freedoms(self) -> int:
        """Freedoms that are left."""
        return len(self.speeds) - self.removed

    @property
    def moving(self) -> list[Link]:
        """All links but the ground."""
        return self.links[1:]

    @property
    def relative(self) -> list[sp.Symbol]:
        """Coordinates that a steady motion leaves as they are."""
        return [q for q in self.values if q not in self.cyclic]

    @property
    def plain(self) -> list[sp.Symbol]:
        """Those among them whose rates are speeds."""
        return [q for q in self.relative if q.dot in self.speeds]

    def single(self) -> list[Joint]:
        """Joints of the tree with one coordinate of their own that a steady motion leaves as it is."""
        return [link.joint for link in self.moving
                if link.joint is not None and len(link.joint.coordinates) == 1 and link.joint.coordinates[0] in self.relative]

    # -- random numbers

    def number(self, low: float, high: float) -> float:
        """A number in a range, with three digits."""
        return round(self.rng.uniform(low, high), 3)

    def signed(self, low: float, high: float) -> float:
        """A number in a range, of either sign."""
        return self.number(low, high) * self.rng.choice([-1, 1])

    def point(self, reach: float = 0.4) -> list[float]:
        """A point of a body, m."""
        return [self.signed(0.05, reach) for _ in range(2 if self.planar else 3)]

    def rotation(self) -> sp.Matrix:
        """A rotation matrix of fractions."""
        e = [self.rng.randint(-2, 2) for _ in range(4)]
        w, x, y, z = e if any(e) else (1, 0, 0, 0)
        R = [[w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y)],
             [2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x)],
             [2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z]]
        return sp.Matrix(3, 3, [sp.Rational(e, w * w + x * x + y * y + z * z) for row in R for e in row])

    def axis(self) -> list[Expression]:
        """A unit vector of short fractions."""
        a, b = sp.Rational(3, 5), sp.Rational(4, 5)
        if self.planar:
            return self.rng.choice([[1, 0], [0, 1], [a, b], [-b, a]])
        return self.rng.choice([[1, 0, 0], [0, 1, 0], [0, 0, 1], [a, 0, b], [b, -a, 0], [0, -b, a]])

    # -- bodies and joints

    def body(self) -> Body:
        """A body with mass and inertia that hangs on nothing yet."""
        name = f"b{len(self.system.bodies) + 1}"
        mass = self.number(0.5, 2)
        if self.planar:
            return self.system.add_body(name, mass=mass, inertia=self.number(0.05, 0.3), com=self.point(0.3))
        a, b, c = (self.number(0.05, 0.2) for _ in range(3))
        d, e, f = (self.signed(0.002, 0.015) for _ in range(3))
        return self.system.add_body(name, mass=mass, inertia=[[b + c, d, e], [d, a + c, f], [e, f, a + b]], com=self.point(0.3))

    def add(self, kind: str, parent: Link, body: Body | None = None, placed: bool = True, **options: Any) -> Link:
        """Hang a body (a new one unless given) on a link by a joint of this kind, at random points unless `placed` is False.

        options   of the joint; coordinates that are expressions are passed here
        """
        self._count += 1
        name = f"j{self._count}"
        body = self.body() if body is None else body
        place: dict[str, Any] = {}
        if placed:
            place = {"parent_point": self.point(), "child_point": self.point()}
            if not self.planar and self.rng.random() < 0.4:
                place["parent_rotation"] = self.rotation()
            if not self.planar and self.rng.random() < 0.2:
                place["child_rotation"] = self.rotation()
        joint = make(self, kind, name, parent.body, body, **place, **options)
        self.system.add_joint(joint)
        return self.take(joint, body, parent)

    def take(self, joint: Joint, body: Body, parent: Link) -> Link:
        """Note a joint of the tree, draw its coordinates, and place its child."""
        own = [q for q in joint.coordinates if isinstance(q, Coordinate) and q not in self.values]
        self._draw(joint, own)
        speeds = joint.speeds or joint.default_speeds()
        own_speeds = [u for k, u in enumerate(speeds) if u is not None
                      and (len(speeds) < len(joint.coordinates) or joint.coordinates[k] in own)]
        self.speeds += own_speeds
        R, d = self.motion(joint)
        A = parent.R @ np.array(joint.parent_rotation, dtype=float)
        B = A @ R @ np.array(joint.child_rotation, dtype=float).T
        origin = parent.p + parent.R @ _floats(joint.parent_point) + A @ d
        link = Link(body, parent, joint, len(own_speeds), B, origin - B @ _floats(joint.child_point))
        self.links.append(link)
        return link

    def motion(self, joint: Joint) -> tuple[np.ndarray, np.ndarray]:
        """R and d of a joint, where its coordinates have values."""
        algebra = Numbers({**self.values, sd.t: self.t})
        s = [algebra.expression(q) for q in joint.coordinates]
        result = joint.motion(algebra, s, [0.0] * joint.n_speeds)
        return np.array(result.R, dtype=float), np.array(result.d, dtype=float)

    def _draw(self, joint: Joint, own: Sequence[sp.Symbol]) -> None:
        units = dict(zip(joint.coordinates, joint.coordinate_units, strict=True))
        turned = isinstance(getattr(joint, "orientation", None), sd.EulerParameters)
        parameters = [q for q in own if units[q] == "1" and turned]
        e = np.array([self.signed(0.2, 1.0) for _ in parameters])
        self.values |= dict(zip(parameters, (e / np.linalg.norm(e)).tolist() if len(e) else [], strict=True))
        for q in own:
            if q not in parameters:
                self.values[q] = self.signed(0.3, 1.1) if in_radians(units[q]) else self.signed(0.1, 0.5)

    # -- closed loops

    def path(self, a: Link, b: Link) -> int:
        """Freedoms of the joints between two links."""
        up, other = _ancestors(a), _ancestors(b)
        return sum(link.freedoms for link in {*up} ^ {*other})

    def closures(self, inside: bool) -> list[tuple[str, Link, Link]]:
        """Joints that may close a loop so that the loop, and the mechanism, keep a freedom; inside: not with the ground."""
        kinds = CLOSES_PLANAR if self.planar else CLOSES_SPATIAL
        links = self.moving if inside else self.links
        result = []
        for a, b in combinations(links, 2):
            for kind, taken in kinds.items():
                if kind != "Gear" and taken < self.path(a, b) and self.freedoms - taken >= 2:
                    result += [(kind, a, b)] * taken  # those that take more are rarer
        if len(self.single()) > 1 and self.freedoms > 2:
            result.append(("Gear", self.links[0], self.links[1]))
        return result

    def close(self, kind: str, a: Link, b: Link) -> None:
        """Close a loop where the bodies are."""
        self._count += 1
        name = f"loop{self._count}"
        self.removed += (CLOSES_PLANAR if self.planar else CLOSES_SPATIAL)[kind]
        if kind == "Gear":
            one, other = self.rng.sample(self.single(), 2)
            ratio = self.signed(0.5, 2)
            offset = self.values[other.coordinates[0]] - ratio * self.values[one.coordinates[0]]
            self.system.close_loop(sd.Gear(name, one, other, ratio, offset))
            return
        at = self.point()
        if kind == "Rod":
            end = self.point()
            length = float(np.linalg.norm(b.p + b.R @ _floats(end) - a.p - a.R @ _floats(at)))
            self.system.close_loop(sd.Rod(name, a.body, b.body, length, parent_point=at, child_point=end))
            return
        place: dict[str, Any] = {"parent_point": at}
        if not self.planar and self.rng.random() < 0.5:
            place["parent_rotation"] = self.rotation()
        state = self.rng.getstate()
        template = make(self, kind, name, a.body, b.body, **place)
        self._draw(template, [q for q in template.coordinates if isinstance(q, Coordinate)])
        A = a.R @ np.array(template.parent_rotation, dtype=float)
        R, d = self.motion(template)
        origin = a.p + a.R @ _floats(template.parent_point) + A @ d
        self.rng.setstate(state)  # the same joint again
        point = (b.R.T @ (origin - b.p)).tolist()
        turned = sp.Matrix((b.R.T @ A @ R).tolist())
        joint = make(self, kind, name, a.body, b.body, **place, child_point=point[:2] if self.planar else point,
                     child_rotation=turned)
        self.system.close_loop(joint)
        if kind in ("Helical", "Custom"):  # their coordinates become those of the system
            self.speeds += [q.dot for q in joint.coordinates]
            self.removed += 1
        else:
            for q in template.coordinates:
                del self.values[q]


def make(draft: Draft, kind: str, name: str, parent: Body, child: Body, **options: Any) -> Joint:
    """A joint of a kind with random axes. Coordinates get names unless passed; of a loop only where it needs them."""
    number, in_tree = name.lstrip("jlop"), name.startswith("j")
    letter = "q" if in_tree else "l"
    if kind in ("Revolute", "Prismatic", "Helical"):
        if in_tree or kind == "Helical":
            options.setdefault("coordinate", sd.coordinates(f"{letter}{number}"))
        if kind == "Prismatic" or not draft.planar:
            options.setdefault("axis", draft.axis())
        if kind == "Helical":
            options["pitch"] = draft.signed(0.05, 0.3)
    elif kind == "Custom":
        c = sd.coordinates(f"{letter}{number}")
        turn = sp.Matrix([[sp.cos(c), -sp.sin(c), 0], [sp.sin(c), sp.cos(c), 0], [0, 0, 1]])
        options |= {"coordinates": [c], "rotation": turn, "units": ["rad"],
                    "position": [c * draft.number(0.2, 0.5), c**2 / 4, draft.number(0.1, 0.4) * sp.sin(c)]}
    elif kind in ("Cylindrical", "Universal", "Planar"):
        if in_tree:
            options.setdefault("coordinates", list(sd.coordinates(f"{letter}{number}_1:{3 + (kind == 'Planar')}")))
        if kind == "Cylindrical":
            options.setdefault("axis", draft.axis())
        if kind == "Universal":
            first = draft.axis()
            options.setdefault("axes", [first, draft.rng.choice([[1, 0, 0], [0, 0, -1]] if first[1] else [[0, 1, 0]])])
    elif kind in ("Spherical", "Free") and in_tree:
        options.setdefault("orientation", sd.EulerAngles(draft.rng.choice(SEQUENCES)))
        turned = 4 if isinstance(options["orientation"], sd.EulerParameters) else 3
        where = [*sd.coordinates(f"q{number}_x q{number}_y q{number}_z")] if kind == "Free" else []
        options.setdefault("coordinates", [*where, *sd.coordinates(f"{'p' if turned == 4 else 'q'}{number}_1:{turned + 1}")])
    joint: Joint = getattr(sd, kind)(name, parent, child, **options)
    return joint


def renamed(number: int) -> Speed:
    """A generalized speed with a name of its own."""
    return Speed(f"w{number}")


def _ancestors(link: Link) -> list[Link]:
    result = [link]
    while result[-1].parent is not None:
        result.append(result[-1].parent)
    return result


def _floats(point: Iterable[Expression]) -> np.ndarray:
    """A point in three components."""
    values = [float(e) for e in point]
    return np.array([*values, 0.0] if len(values) == 2 else values)
