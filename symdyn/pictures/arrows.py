"""Forces and torques in pictures, films and pages: what acts where, and how long its arrow is."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from symdyn.runtime.solutions.solution import Solution

# Functions of modules that give what acts.
POINTS, LOADS, WEIGHTS, REACTIONS = "contact_points", "applied_loads", "weights", "reactions"
# Length of the arrow of the usual force of a contact, of the mechanism's length; longer ones are cut at so many times that.
LENGTH, LONGEST = 0.22, 2.0
# Length of the arrow of the largest of all other forces, and of all torques, of the mechanism's length.
LARGEST = 0.35
# Length of the head of a short arrow, of the arrow, and half its width; the second head of a torque is this far behind. Heads of
# longer arrows have one size: this length, of the mechanism's.
HEAD, WIDTH, BEHIND, FULL = 0.25, 0.11, 0.16, 0.05
# A torque about what a plane picture is seen along: an arc of so many corners around so much of a circle, whose radius is this
# share of the arrow's length.
_CORNERS, _AROUND, _RADIUS = 25, 1.5 * np.pi, 0.5
# A force or torque that is this much smaller than the largest one is rounding.
_ROUNDING = 1e-9
# Names of the layers, and their colours: readers with any kind of colour vision can tell them apart.
TITLES = {"forces": "forces in joints", "moments": "torques in joints", "loads": "forces of loads", "torques": "torques of loads",
          "weights": "weights", "contacts": "forces of contacts"}
COLORS = {"forces": "#7C2D12", "moments": "#312E81", "loads": "#047857", "torques": "#7C3AED", "weights": "#64748B",
          "contacts": "#D55E00"}


@dataclass(frozen=True)
class Arrows:
    """Forces or torques of one kind over time.

    layer    a key of TITLES
    names    of each of n arrows
    tails    where each acts (n_t, n, 3), and vectors (n_t, n, 3), N or N m, n-frame; NaN while nothing does
    scale    length of an arrow by its newtons or newton metres, m; longest: of any arrow, m; head: length of a head at most, m
    points   indices of the mechanism's points that the tails are, or () for others
    """

    layer: str
    names: Sequence[str]
    tails: np.ndarray
    vectors: np.ndarray
    scale: float
    longest: float = np.inf
    head: float = np.inf
    points: Sequence[int] = ()

    @property
    def unit(self) -> str:
        return "N m" if self.turns else "N"

    @property
    def turns(self) -> bool:
        """Whether these are torques."""
        return self.layer in ("torques", "moments")

    @property
    def color(self) -> str:
        return COLORS[self.layer]

    @property
    def largest(self) -> float:
        return largest(self.vectors)

    @property
    def ways(self) -> np.ndarray:
        """From tails to tips, (n_t, n, 3), m."""
        sizes = np.linalg.norm(self.vectors, axis=2, keepdims=True)
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.asarray(self.vectors * np.minimum(self.scale, self.longest / sizes))

    def only(self, which: Sequence[int]) -> Arrows:
        """Some of the arrows."""
        chosen = list(which)
        return replace(self, names=[self.names[k] for k in chosen], tails=self.tails[:, chosen], vectors=self.vectors[:, chosen],
                       points=[self.points[k] for k in chosen] if len(self.points) else ())


def arrows_of(solution: Solution, length: float, forces: bool = False) -> list[Arrows]:
    """The arrows of a motion: forces of contacts, where there are some.

    length   of the mechanism, m
    forces   with forces in joints and of loads and weights, all forces to one scale, and torques in joints and of loads, all to
             another; what is zero all the time, or rounding, is left out
    """
    result = [*_contacts(solution, length)]
    if forces:
        others = [one for kind in (_joints, _loads, _weights) for one in kind(solution)]
        common = max([*[one.largest for one in others if not one.turns], *[usual(one.vectors) for one in result]], default=0.0)
        result = [replace(one, scale=LARGEST * length / common) for one in result]
        turning = max((one.largest for one in others if one.turns), default=0.0)
        strongest = max([common, *[one.largest for one in result]])
        for one in others:
            least = _ROUNDING * (max(turning, strongest * length) if one.turns else strongest)
            sizes = np.nan_to_num(np.linalg.norm(one.vectors, axis=2)).max(axis=0, initial=0.0)
            acting = one.only(np.flatnonzero(sizes > least).tolist())
            if acting.names:
                result.append(replace(acting, scale=LARGEST * length / (turning if acting.turns else common)))
    return [replace(one, head=FULL * length) for one in result]


def _contacts(solution: Solution, length: float) -> Iterator[Arrows]:
    at, forces = touching(solution)
    middle = usual(forces)
    if middle:
        yield Arrows("contacts", [f"contact {name}" for name in names_of(solution)], at, forces, LENGTH * length / middle,
                     LENGTH * LONGEST * length)


def _joints(solution: Solution) -> Iterator[Arrows]:
    module, names, n_t = solution.module, solution.module.metadata.reactions, len(solution.t)
    known = not module.metadata.contact_groups  # whose forces those in joints depend on
    if names and known and {REACTIONS, "joint_points"} <= set(module.functions):
        at, acting = _rows(solution, "joint_points")[..., 3:], solution.rows(REACTIONS).reshape(n_t, -1, 6)
        for layer, kind, part in (("forces", "force", acting[..., :3]), ("moments", "torque", acting[..., 3:])):
            yield Arrows(layer, [f"{kind} of {name}" for name in names], at, part, 0.0,
                         points=[2 * k + 1 for k in range(len(names))])


def _loads(solution: Solution) -> Iterator[Arrows]:
    module, acting = solution.module, solution.module.metadata.acting
    if LOADS not in module.functions:
        return
    rows = _rows(solution, LOADS)
    for layer, kind in (("loads", "force"), ("torques", "torque")):
        own = [k for k, (*_, of) in enumerate(acting) if of == kind]
        yield Arrows(layer, [f"{acting[k][0]} on {acting[k][1]}" for k in own], rows[:, own, :3], rows[:, own, 3:], 0.0)


def _weights(solution: Solution) -> Iterator[Arrows]:
    module, about = solution.module, solution.module.metadata
    if {WEIGHTS, "positions"} <= set(module.functions):
        shape = (len(solution.t), -1, 3)
        yield Arrows("weights", [f"weight of {name}" for name in about.bodies], solution.rows("positions").reshape(shape),
                     solution.rows(WEIGHTS).reshape(shape), 0.0)


def _rows(solution: Solution, name: str) -> np.ndarray:
    return solution.rows(name).reshape(len(solution.t), -1, 6)


def touching(solution: Solution) -> tuple[np.ndarray, np.ndarray]:
    """Where contacts touch and the forces on their bodies a, (n_t, n_c, 3), n-frame; NaN while nothing is transmitted."""
    if POINTS not in solution.module.functions:
        none = np.full((len(solution.t), 0, 3), np.nan)
        return none, none
    rows = solution.rows(POINTS).reshape(len(solution.t), -1, 2, 3)
    at, forces = rows[:, :, 0].copy(), rows[:, :, 1].copy()
    idle = ~(np.linalg.norm(forces, axis=2) > 0)
    at[idle] = forces[idle] = np.nan
    return at, forces


def names_of(solution: Solution) -> list[str]:
    """Names of the contacts in `touching`."""
    about, count = solution.module.metadata, solution.module.shape(POINTS)[0] // 6
    names = [*(record.name for record in about.contacts), *(record.name for record in about.compliant)]
    return names if len(names) == count else [f"contact {k + 1}" for k in range(count)]


def usual(forces: np.ndarray) -> float:
    """The median size of forces (n_t, n_c, 3), N; zero without any."""
    sizes = np.linalg.norm(forces, axis=2)
    there = sizes[np.isfinite(sizes) & (sizes > 0)]
    return float(np.median(there)) if len(there) else 0.0


def largest(vectors: np.ndarray) -> float:
    """The largest size of vectors (..., 3); zero without any."""
    return float(np.linalg.norm(np.nan_to_num(vectors), axis=-1).max(initial=0.0))


def straight(tails: np.ndarray, ways: np.ndarray, heads: int = 1, longest: float = np.inf) -> np.ndarray:
    """Arrows as one curve (m, 2 or 3), lifted between them; from tails (n, 2 or 3) by ways; a torque has two heads.

    longest   length of a head at most, m
    """
    n, tips = tails.shape[-1], tails + ways
    length = np.linalg.norm(ways, axis=1, keepdims=True)
    if n == 2:
        sides = [ways[:, ::-1] * [-1, 1]]
    else:  # a head in two planes is seen from everywhere
        first = np.cross(ways, np.where(np.abs(ways[:, 2:]) > 0.9 * length, [[1.0, 0.0, 0.0]], [[0.0, 0.0, 1.0]]))
        first *= length / np.maximum(np.linalg.norm(first, axis=1, keepdims=True), 1e-300)
        sides = [first, np.cross(ways, first) / np.maximum(length, 1e-300)]
    part = np.minimum(1.0, longest / np.maximum(HEAD * length, 1e-300))
    drawn = [tails]
    for k in range(heads):
        end = tips - k * BEHIND * part * ways
        drawn += [end, *[p for side in sides for sign in (1, -1)
                         for p in (end + part * (sign * WIDTH * side - HEAD * ways), end)]]
    return np.stack([*drawn, np.full_like(tails, np.nan)], axis=1).reshape(-1, n)


def arcs(centres: np.ndarray, turns: np.ndarray, longest: float = np.inf) -> np.ndarray:
    """Arrows around points (n, 2) of a plane as one curve (m, 2), lifted between them; turns (n,): lengths of arrows, m, positive
    from the first axis to the second; longest: length of a head at most, m."""
    angles = np.linspace(-0.25 * np.pi, _AROUND - 0.25 * np.pi, _CORNERS)
    radius, sense = _RADIUS * np.abs(turns)[:, None], np.sign(turns)[:, None]
    around = sense * angles
    circle = radius[..., None] * np.stack([np.cos(around), np.sin(around)], axis=-1)
    end, along = circle[:, -1], sense * np.stack([-np.sin(around[:, -1]), np.cos(around[:, -1])], axis=-1)
    outward = np.divide(end, radius, out=np.zeros_like(end), where=radius > 0)
    head = np.minimum(HEAD * np.abs(turns)[:, None], longest)
    barbs = [end - head * (along - sign * WIDTH / HEAD * outward) for sign in (1, -1)]
    points = np.stack([*np.moveaxis(circle, 1, 0), barbs[0], end, barbs[1], np.full_like(end, np.nan)], axis=1)
    return np.asarray((centres[:, None] + points).reshape(-1, 2))
