"""Default look of a mechanism: solids from joints, points and inertia.

Sizes follow from distances between points and from moments of inertia. Positions do not: every solid is given by points and axes
that move, so that the same list holds at every configuration and for other values of the parameters.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np

from symdyn.pictures.grounds import COLOR, Reach, Surroundings, surroundings_of
from symdyn.shown import shown

GROUND = -1
# Colours that readers with any kind of colour vision can tell apart: Okabe and Ito, Color Universal Design, 2008.
PALETTE = ("#0072B2", "#E69F00", "#009E73", "#CC79A7", "#56B4E9", "#D55E00")
METAL, DARK, STEEL = "#6b7280", "#374151", "#7c8797"
_FLOATING = ("free", "planar", "custom", "modal")
_SLIDING = ("prismatic", "cylindrical", "helical")
# Closer than this, relative to the mechanism, are points that are the same; what counts as extended.
_SAME, _EXTENT = 1e-6, 0.02
# Length of a mooring line in stills, as a part of the mechanism's length.
_LINE = 0.4
# Radius of a link, of the mechanism's length.
_RADIUS = 0.02
# Length of a mechanism whose bodies have no extent, of how far they get.
_WAY = 0.15
# Factor by which a block is larger that is alone.
_ALONE = 1.8
# Half the length of a rail on which nothing has moved, of the mechanism's length.
_RAIL = 0.5

# A point by its index, a point of a body (body, x, y, z), ("off", point, axis, distance), or ("foot", a, b, axis): the point
# of the axis through a that is nearest to b.
Ref = Any


def point_of(ref: Ref, points: np.ndarray, axes: np.ndarray, of_body: Callable[[int, Sequence[float]], np.ndarray]) -> np.ndarray:
    """The point that is referred to, by points (n_p, 3), axes of joints (n_j, 3), and where a body has a place of its own."""
    def at(one: Ref) -> np.ndarray:
        if isinstance(one, int):
            return np.asarray(points[one])
        if one[0] == "off":
            return np.asarray(at(one[1]) + one[3] * axes[one[2]])
        if one[0] == "foot":
            a, n = at(one[1]), axes[one[3]]
            return np.asarray(a + n * (n @ (at(one[2]) - a)))
        body, *place = one
        return np.asarray(of_body(body, place))

    return at(ref)


@dataclass(frozen=True)
class Mechanism:
    """A mechanism at one configuration, n-frame.

    bodies        names; frames (n_b, 12), centres (n_b, 3); drawn: bodies that have shapes of the user's
    joints        name, parent, child, kind; joint_points (n_j, 6) on parent and child, joint_axes (n_j, 3)
    connections   loads along lines: name, bodies, kind; spring_points (n_s, 6)
    inertia       (n_b, 10): m, m c, moments about the origin (xx xy xz yy yz zz), body axes; None where not known
    down          direction of gravity, zero where there is none
    tips          further points that bodies reach to: body, (3,) in its axes
    travels       how far joints slide along their axes in a motion: least and most, m; () where it is not known
    corners       points that contacts have on bodies: body, (3,) in its axes; wheels: radii of bodies that touch with a rim, m
    ropes         lengths of ropes, m, by the names of their connections
    way           how far the mechanism gets in a motion, m; 0 where it is not known
    around        what contacts touch, and how mooring lines hang
    """

    bodies: Sequence[str]
    frames: np.ndarray
    centres: np.ndarray
    joints: Sequence[tuple[str, str, str, str]]
    joint_points: np.ndarray
    joint_axes: np.ndarray
    connections: Sequence[tuple[str, str, str, str]]
    spring_points: np.ndarray
    inertia: np.ndarray | None
    planar: bool
    down: tuple[float, float, float]
    drawn: frozenset[int] = frozenset()
    tips: Sequence[tuple[int, np.ndarray]] = ()
    travels: Sequence[tuple[float, float]] = ()
    corners: Sequence[tuple[int, np.ndarray]] = ()
    wheels: Mapping[int, float] = field(default_factory=dict)
    ropes: Mapping[str, float] = field(default_factory=dict)
    way: float = 0.0
    around: Surroundings = field(default_factory=Surroundings)

    @property
    def points(self) -> np.ndarray:
        """All points, (n, 3), in the order of their indices: joints on parent and child, centres, origins, ends of springs."""
        return np.concatenate([part.reshape(-1, 3) for part in (self.joint_points, self.centres, self.frames[:, :3],
                                                                self.spring_points)])

    @property
    def anchors(self) -> list[int]:
        """Indices of the anchors of mooring lines, which are far away."""
        first = len(self.points) - 2 * len(self.connections)
        return [first + 2 * k + 1 for k, (*_, kind) in enumerate(self.connections) if kind == "line"]

    @property
    def near_points(self) -> np.ndarray:
        """The points without anchors."""
        return np.delete(self.points, self.anchors, axis=0)

    @property
    def carriers(self) -> frozenset[int]:
        """Bodies without mass that only slide and carry what slides: a way to write down how something moves freely."""
        result = set()
        for body, inertia in enumerate(self.inertia if self.inertia is not None else ()):
            kinds = [kind for _, *ends, kind in self.joints if body in map(self.index, ends)]
            if len(kinds) > 1 and all(kind in _SLIDING for kind in kinds) and not inertia.any():
                result.add(body)
        return frozenset(result)

    @property
    def up(self) -> tuple[float, float, float]:
        return up_of(self.down, self.planar)

    def owners(self) -> list[int]:
        """The body that each of the points is fixed to."""
        n_b, of = len(self.bodies), self.index
        return [*[of(name) for _, *ends, _ in self.joints for name in ends], *range(n_b), *range(n_b),
                *[of(name) for _, *ends, _ in self.connections for name in ends]]

    @cached_property
    def _places(self) -> Mapping[str, int]:
        return {name: k for k, name in enumerate(self.bodies)}

    def index(self, name: str) -> int:
        """The place of the body of that name, or of the ground for another name."""
        return self._places.get(name, GROUND)

    def local(self, body: int, point: np.ndarray) -> np.ndarray:
        """A point of the n-frame in the axes of a body."""
        if body == GROUND:
            return point
        return np.asarray(self.frames[body, 3:].reshape(3, 3).T @ (point - self.frames[body, :3]))

    def at(self, ref: Ref) -> np.ndarray:
        """The point of the n-frame that is referred to."""
        return point_of(ref, self.points, self.joint_axes, self._of_body)

    def _of_body(self, body: int, place: Sequence[float]) -> np.ndarray:
        if body == GROUND:
            return np.array(place, dtype=float)
        return np.asarray(self.frames[body, :3] + self.frames[body, 3:].reshape(3, 3) @ place)

    def centre(self, body: int) -> np.ndarray:
        return self.local(body, self.centres[body])

    def moments(self, body: int) -> tuple[float, np.ndarray]:
        """Mass, and the moments of inertia about the centre of mass over the mass, (3, 3), m²; zero for a point mass."""
        if self.inertia is None or not self.inertia[body, 0] > 0:
            return 0.0, np.zeros((3, 3))
        m, c = float(self.inertia[body, 0]), self.inertia[body, 1:4] / self.inertia[body, 0]
        xx, xy, xz, yy, yz, zz = self.inertia[body, 4:]
        about = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) / m - (c @ c * np.eye(3) - np.outer(c, c))
        return m, np.where(np.abs(about) > 1e-12 * max(c @ c, 1e-300), about, 0.0)


def not_drawn_by_rules(about: Any, joints: Sequence[str], joined: Sequence[tuple[str, str]]) -> frozenset[int]:
    """Indices of bodies that rules draw nothing for: those with shapes of the user's, those that bend, massless carriers. A line
    that goes on to another body is no shape of its first.

    about   has bodies, drawn and flexible; joints with the two bodies of each
    """
    names = [record["body"] for record in about.drawn if record.get("to") is None]
    names += [record[end] for record in about.flexible for end in ("body", "tip")]
    return frozenset({k for k, name in enumerate(about.bodies) if name in names} | carriers(about.bodies, joints, joined))


def with_surroundings(m: Mechanism, records: Sequence[Mapping[str, Any]], drawn: Sequence[Mapping[str, Any]], frames: np.ndarray,
                      further: float = 0.0, coarse: bool = False) -> Mechanism:
    """A mechanism with what is around it.

    records   of the surroundings, with numbers in place of None; drawn: those of the user's shapes
    frames    of the bodies at some configurations, (n, n_b, 12); further: how far beyond these places they may get, of its length
    coarse    whether few facets are wanted
    """
    if not records:
        return m
    own = any(record["body"] == "ground" and record["kind"] not in ("line", "water") for record in drawn)
    centres = np.array([m.centre(body) for body in range(len(m.bodies))]).reshape(-1, 3)
    reach = Reach(m.bodies, frames, centres, m.planar, length_of(m), color_of_body, further, coarse)
    return replace(m, around=surroundings_of(records, reach, own))


def carriers(bodies: Sequence[str], joints: Sequence[str], joined: Sequence[tuple[str, str]]) -> set[int]:
    """Indices of the massless bodies that joints in loops have been given; joined: the two bodies of each joint."""
    made = {f"{name}_carrier" for name in joints} - {name for pair in joined for name in pair}
    return {k for k, name in enumerate(bodies) if name in made}


def up_of(down: Sequence[float], planar: bool) -> tuple[float, float, float]:
    """Direction that points up in the picture: the coordinate axis against gravity, else y in a plane and z in space."""
    k = int(np.abs(down).argmax())
    if abs(down[k]) < 0.99 or (planar and k == 2):
        return (0.0, 1.0, 0.0) if planar else (0.0, 0.0, 1.0)
    x, y, z = (-float(np.sign(v)) if i == k else 0.0 for i, v in enumerate(down))
    return x, y, z


@dataclass(frozen=True)
class Item:
    """A solid: its kind, what it hangs on, its sizes in m, its colour, what it is called.

    kind    rod, pin, ball, block, box, ellipsoid, stand, spring, damper, both, thread, disc; line: straight to where it is
            anchored, whose second size is how much of it a still shows; mooring: likewise, which hangs: its length, weight over
            EA, friction and whether there is a seabed follow; rope: whose second size is its length, over which it sags
    axis    index of the joint's axis; turn: (9,), own axes in body axes, of boxes and ellipsoids, row by row
    layer   "" for what is always shown, else what shows it: "inertia", "centres"
    """

    kind: str
    ends: tuple[Ref, ...]
    size: tuple[float, ...]
    color: str
    name: str
    body: int = GROUND
    axis: int = -1
    turn: tuple[float, ...] = ()
    layer: str = ""


def looks_of(m: Mechanism) -> tuple[list[Item], float]:
    """The solids of a mechanism, and its length, m."""
    length = length_of(m)
    r = _RADIUS * length * (1.0 if len(m.bodies) <= 8 else 0.7)
    carriers, cams = m.carriers, {part.body for part in m.around.parts if not part.ground}
    items = [*_joints(m, r, length, carriers), *_springs(m, r, length)]
    for body in range(len(m.bodies)):
        if body not in m.drawn and body not in carriers and not (body in cams and len(_attached(m, body, length)) < 2):
            items += [replace(item, body=body) for item in _body(m, body, r, length)]
        items += [replace(item, body=body) for item in _on_request(m, body, r, length)]
    for body, center, radius in m.around.balls:
        if body not in m.wheels and body not in m.drawn:
            color, name = (COLOR, "ground") if body == GROUND else (color_of_body(body), m.bodies[body])
            items.append(Item("ball", ((body, *center),), (radius,), color, name, body))
    return items, length


def length_of(m: Mechanism) -> float:
    """Largest distance of points of the mechanism; for a single body its size, from its inertia. Bodies without any extent
    are seen on their way."""
    apart = float(np.linalg.norm(np.ptp(m.near_points, axis=0)))
    extents = [0.0]
    for body in range(len(m.bodies)):
        own = [m.local(body, point) for point, owner in zip(m.points, m.owners(), strict=True) if owner == body]
        extents.append(float(np.linalg.norm(np.ptp(own, axis=0))) * (1.0 if len(m.bodies) == 1 else 1.5))
        extents.append(2.5 * float(np.sqrt(max(np.trace(m.moments(body)[1]), 0.0))))
    extent = max(extents)
    result = max(apart, extent, _WAY * m.way if extent <= _SAME * m.way else 0.0)
    return result if np.isfinite(result) and result > 0 else 1.0


def ropes_of(names: Sequence[str], connections: Sequence[tuple[str, str, str, str]], gaps: Sequence[float],
             springs: np.ndarray) -> dict[str, float]:
    """Lengths of ropes, m, by the names of their connections: what is between the ends, and what is left.

    names   of the contacts; gaps: one of each, m; springs: ends of the connections, (n_s, 6)
    """
    left = {f"rope {shown(name)}": float(gap) for name, gap in zip(names, gaps, strict=True)}
    return {name: left[name] + float(np.linalg.norm(ends[3:] - ends[:3]))
            for (name, *_, kind), ends in zip(connections, springs, strict=True) if kind == "rope"}


def color_of_body(body: int) -> str:
    """Colour of a body by its index, or of the ground."""
    return METAL if body == GROUND else PALETTE[body % len(PALETTE)]


def _joints(m: Mechanism, r: float, length: float, carriers: frozenset[int]) -> Iterator[Item]:
    """Joints as their kind, and stands where the ground holds them."""
    for j, (name, parent, child, kind) in enumerate(m.joints):
        ends = (m.index(parent), m.index(child))
        title = f"{name} ({kind})"
        if kind in _FLOATING or kind == "fixed" or all(end == GROUND or end in m.drawn for end in ends):
            continue
        if carriers.intersection(ends):
            continue
        own = replace(Item(kind, (2 * j + 1,), (r, r), DARK, title), axis=j, body=ends[1])
        if kind == "rod":
            yield Item("rod", (2 * j, 2 * j + 1), (0.6 * r, 0.6 * r), METAL, title)
            yield from _held(m, (2 * j, 2 * j + 1), r, title)
            continue
        if kind in _SLIDING:
            # The block is on what moves along the rail: on the child, or on the parent where the child is the ground.
            flipped = ends[1] == GROUND
            moving, held = (2 * j, 2 * j + 1) if flipped else (2 * j + 1, 2 * j)
            b = r if len(m.bodies) > 1 else _ALONE * r
            yield replace(own, kind="block", ends=(moving,), size=(2.2 * b, 2.2 * b, 3.2 * b), body=ends[not flipped],
                          color=color_of_body(ends[not flipped]))
            least, most = m.travels[j] if m.travels else (-_RAIL * length, _RAIL * length)
            least, most = (-most, -least) if flipped else (least, most)
            rail = (("off", held, j, least - 6 * r), ("off", held, j, most + 6 * r)) if GROUND in ends else (held, moving)
            yield Item("rod", rail, (0.5 * r, 0.5 * r), STEEL, title)
            continue
        yield replace(own, kind="pin", size=(1.5 * r, 1.9 * r)) if np.any(m.joint_axes[j]) else replace(
            own, kind="ball", size=(1.9 * r,))
        if GROUND in ends:
            yield Item("stand", (2 * j + int(ends[1] == GROUND),), (3.2 * r, 4.5 * r), METAL, f"{title}, on the ground")


def _held(m: Mechanism, ends: tuple[int, int], r: float, name: str) -> Iterator[Item]:
    """Stands, or hangers, where the ground holds an end and no joint is."""
    owners, points = m.owners(), m.points
    joined = [points[k] for k in range(2 * len(m.joints)) if m.joints[k // 2][3] not in (*_FLOATING, "rod")]
    for end, other in (ends, ends[::-1]):
        if owners[end] == GROUND and not any(np.linalg.norm(points[end] - one) < r for one in joined):
            above = float((points[other] - points[end]) @ np.array(m.up)) >= 0
            yield Item("stand", (end,), (2.2 * r, 3.2 * r if above else -3.2 * r), METAL, f"{name}, on the ground")


def _springs(m: Mechanism, r: float, length: float) -> Iterator[Item]:
    first = 2 * len(m.joints) + 2 * len(m.bodies)
    for k, (name, _, _, kind) in enumerate(m.connections):
        ends = (first + 2 * k, first + 2 * k + 1)
        if kind not in ("line", "force"):
            yield from _held(m, ends, r, name)
        if kind == "rope":
            yield Item("rope", ends, (0.3 * r, m.ropes.get(name, 0.0)), STEEL, name)
            continue
        if kind == "line" and name in m.around.lines:
            hangs = m.around.lines[name]
            about = (hangs.length, hangs.give, hangs.friction, float(hangs.seabed))
            yield Item("mooring", ends, (0.2 * r, _LINE * length, *about), STEEL, f"{name} (mooring line)")
            continue
        size = (0.3 * r,) if kind == "force" else (0.2 * r, _LINE * length) if kind == "line" else (1.3 * r,)
        yield Item("thread" if kind == "force" else kind, ends, size, STEEL,
                   f"{name} ({'spring and damper' if kind == 'both' else 'mooring line' if kind == 'line' else kind})")


def _body(m: Mechanism, body: int, r: float, length: float) -> list[Item]:
    """A body as rods between its points, or as a solid of its inertia where it has no extent."""
    color, name = color_of_body(body), m.bodies[body]
    mass, moments = m.moments(body)
    held = _attached(m, body, length)
    centre = m.centre(body)
    at_centre = (body, *centre)
    extended = float(np.sqrt(max(np.trace(moments), 0.0))) > _EXTENT * length
    if body in m.wheels:
        return [_wheel(m, body, held, r)]
    if sum(owner == body for owner, _ in m.corners) > 1 and all(isinstance(ref, tuple) for ref, _, _ in held):
        return [_cornered(m, body, r)]
    sphere = Item("ball", (at_centre,), (2.4 * r,), color, name)
    if len(held) > 1:
        items = list(_rods(m, held, r, color, name))
        points = np.array([point for _, point, _ in held])
        off = min(_distance_to_line(centre, points[0], p) for p in points[1:])
        return items + ([sphere] if mass and not extended and off > 3 * r else [])
    if not held:
        return [_free(body, centre, moments, length, color, name) if extended else replace(sphere, size=(3 * r,))]
    ref, start, joint = held[0]
    way = centre - start
    distance = float(np.linalg.norm(way))
    if distance > _EXTENT * length:
        if not extended:
            return [Item("rod", (ref, at_centre), (0.8 * r, 0.6 * r), color, name), sphere]
        along = way / distance
        # A slender rod has m l² / 12 about every axis across it; in a plane one of them is known.
        half = min(float(np.sqrt(3 * np.linalg.eigvalsh(moments)[-1])), 1.1 * distance)
        return [Item("rod", (ref, (body, *(centre + half * along))), (r, 0.65 * r), color, name)]
    if not extended:
        slides = joint >= 0 and m.joints[joint][3] in _SLIDING and not m.carriers.intersection(map(m.index, m.joints[joint][1:3]))
        return [] if slides else [replace(sphere, size=(2.0 * r,))]
    axis = m.local(body, m.frames[body, :3] + m.joint_axes[joint]) if joint >= 0 else np.zeros(3)
    if joint >= 0 and m.joints[joint][3] == "revolute" and axis @ moments @ axis > 0.4 * np.trace(moments):
        radius = float(np.sqrt(2 * axis @ moments @ axis))
        return [Item("disc", (ref,), (min(radius, 0.5 * length), 0.7 * r), color, name, axis=joint)]
    return [_solid(body, centre, moments, 0.09 * length, color, name)]


def _attached(m: Mechanism, body: int, length: float) -> list[tuple[Ref, np.ndarray, int]]:
    """Points of a body that hold something: what refers to them, where they are in its axes, their joint or -1. The joint that
    carries the body comes first."""
    result: list[tuple[Ref, np.ndarray, int]] = []
    springs = 2 * len(m.joints) + 2 * len(m.bodies)
    ends = [(j, side) for side in (1, 0) for j, (_, *names, kind) in enumerate(m.joints)
            if m.index(names[side]) == body and kind not in _FLOATING]
    candidates = [(2 * j + side, j) for j, side in ends] + [
        (springs + k, -1) for k, owner in enumerate(m.owners()[springs:]) if owner == body
        and m.connections[k // 2][3] != "line"]
    every = [(ref, m.local(body, m.points[ref]), j) for ref, j in candidates] + [
        ((body, *tip), tip, -1) for owner, tip in (*m.tips, *m.corners) if owner == body]
    for ref, point, j in every:
        if all(np.linalg.norm(point - other) > _SAME * length for _, other, _ in result):
            result.append((ref, point, j))
    return result


def _rods(m: Mechanism, held: Sequence[tuple[Ref, np.ndarray, int]], r: float, color: str, name: str) -> Iterator[Item]:
    """Tapered rods from the first point; along the axis of its hinge first where the next point is off it and along it."""
    first, start, joint = held[0]
    for ref, point, _ in held[1:]:
        way = point - start
        if joint >= 0 and np.any(m.joint_axes[joint]) and len(held) == 2:
            body = m.index(m.joints[joint][2]) if first % 2 else m.index(m.joints[joint][1])
            axis = m.local(body, (0.0 if body == GROUND else m.frames[body, :3]) + m.joint_axes[joint])
            along = float(way @ axis)
            across = float(np.linalg.norm(way - along * axis))
            if min(abs(along), across) > 2 * r:
                foot = ("foot", first, ref, joint)
                yield Item("rod", (first, foot), (1.3 * r, 1.3 * r), color, name)
                yield Item("ball", (foot,), (1.3 * r,), color, name)
                yield Item("rod", (foot, ref), (1.15 * r, 0.75 * r), color, name)
                continue
        yield Item("rod", (first, ref), (r, 0.7 * r), color, name)
    if len(held) == 3:
        yield Item("rod", (held[1][0], held[2][0]), (0.7 * r, 0.7 * r), color, name)


def _wheel(m: Mechanism, body: int, held: Sequence[tuple[Ref, np.ndarray, int]], r: float) -> Item:
    """Body that touches with a round rim: a disc about its hinge, or about the axis of its inertia; a ball where that has
    none."""
    color, name, radius, centre = color_of_body(body), m.bodies[body], m.wheels[body], m.centre(body)
    half = max(0.12 * radius, 0.5 * r)
    for ref, point, joint in held:
        if joint >= 0 and m.joints[joint][3] == "revolute" and np.linalg.norm(point - centre) < 0.1 * radius:
            return Item("disc", (ref,), (radius, half), color, name, axis=joint)
    _, moments = m.moments(body)
    axis = np.array([0.0, 0.0, 1.0])
    if not m.planar:
        sides, axes = _principal(moments, 1.0)
        alike = [abs(sides[i] - sides[j]) < 0.01 * sides.max() for i, j in ((1, 2), (2, 0), (0, 1))]
        if all(alike) or not any(alike):
            return Item("ball", ((body, *centre),), (radius,), color, name)
        axis = axes[:, alike.index(True)]
    return Item("rod", ((body, *(centre - half * axis)), (body, *(centre + half * axis))), (radius, radius), color, name)


def _cornered(m: Mechanism, body: int, r: float) -> Item:
    """A body that touches with several corners and has no joint: the box around its centre of mass that reaches to them."""
    centre = m.centre(body)
    half = np.abs([corner - centre for owner, corner in m.corners if owner == body]).max(axis=0)
    size = np.maximum(half, min(r, 0.3 * float(half.max())))
    return Item("box", ((body, *centre),), tuple(float(s) for s in size), color_of_body(body), m.bodies[body],
                turn=tuple(np.eye(3).ravel()))


def _distance_to_line(point: np.ndarray, a: np.ndarray, b: np.ndarray) -> float:
    way = (b - a) / np.linalg.norm(b - a)
    return float(np.linalg.norm((point - a) - (point - a) @ way * way))


def _free(body: int, centre: np.ndarray, moments: np.ndarray, most: float, color: str, name: str) -> Item:
    """The ball, cylinder or box with the same moments of inertia, whichever fits their symmetry."""
    sides, axes = _principal(moments, 1.0)
    alike = [abs(sides[i] - sides[j]) < 0.01 * sides.max() for i, j in ((1, 2), (2, 0), (0, 1))]
    if all(alike):
        return Item("ball", ((body, *centre),), (float(np.sqrt(5.0) * sides[0]),), color, name)
    if any(alike):
        k = alike.index(True)
        half = max(float(np.sqrt(3.0) * sides[k]), 0.02 * most) * axes[:, k]
        radius = float(2.0 * sides[k - 1])
        return Item("rod", ((body, *(centre - half)), (body, *(centre + half))), (radius, radius), color, name)
    return _solid(body, centre, moments, most, color, name)


def _solid(body: int, centre: np.ndarray, moments: np.ndarray, most: float, color: str, name: str) -> Item:
    """The box with the same moments of inertia, its edges along the principal axes."""
    sides, axes = _principal(moments, 12.0)
    size = np.clip(sides / 2, 0.12 * sides.max() / 2, 0.5 * most)
    return Item("box", ((body, *centre),), tuple(float(s) for s in size), color, name, turn=tuple(axes.ravel()))


def _principal(moments: np.ndarray, factor: float) -> tuple[np.ndarray, np.ndarray]:
    """Lengths along the principal axes from second moments, sqrt(factor * them), and these axes as columns."""
    second = np.trace(moments) / 2 * np.eye(3) - moments
    values, axes = np.linalg.eigh(second)
    if np.linalg.det(axes) < 0:
        axes[:, 0] = -axes[:, 0]
    return np.sqrt(factor * np.maximum(values, 0.0)), axes


def _on_request(m: Mechanism, body: int, r: float, length: float) -> Iterator[Item]:
    """The centre of mass, and the homogeneous ellipsoid of the same inertia."""
    centre = (body, *m.centre(body))
    mass, moments = m.moments(body)
    yield Item("ball", (centre,), (1.4 * r,), "#111827", f"centre of mass of {m.bodies[body]}", layer="centres")
    if mass and np.trace(moments) > (_EXTENT * length) ** 2:
        semi, axes = _principal(moments, 5.0)
        size = tuple(float(max(s, 0.2 * r)) for s in semi)
        yield Item("ellipsoid", (centre,), size, color_of_body(body), f"inertia of {m.bodies[body]}", turn=tuple(axes.ravel()),
                   layer="inertia")
