"""Speeds that at some positions move nothing that the speeds after them do not move already, although every mass is positive.

The mass matrix loses rank there, and the pivot of such a speed vanishes but for rounding: of Euler angles at gimbal lock that of
the first one, which is about (distance in rad)^2 of its diagonal entry; the same of joints with no mass between them whose axes
may become parallel. No position does that to the other speeds, and generated code need not ask.

A motion without kinetic energy moves no link in a direction in which it has mass. So a speed is sound if at some link its
velocity, and the part of it that the speeds after it do not explain, have the same size at every position; it may lock if these
sizes change, or if at every single link the speeds after it always explain it, so that only several links together do not. Links
with mass that have one freedom each are seen at once.

Links whose joints and inertias are alike but for the names of their symbols are tried once.
"""

from __future__ import annotations

import math
import random
from collections.abc import Callable, Sequence, Set
from typing import TYPE_CHECKING, Any

import numpy as np

from symdyn.model.orientation import EulerParameters
from symdyn.spatial.inertia import ArticulatedInertia, Inertia
from symdyn.spatial.vectors import cross, inner
from symdyn.tape.evaluate import evaluate
from symdyn.tape.node import Node, is_zero
from symdyn.tape.quick import evaluate_quickly
from symdyn.tape.recorder import Recorder
from symdyn.tape.tape import Tape

if TYPE_CHECKING:
    from symdyn.formulation.trees.tree import Tree

# Positions that are compared; squares of velocities that differ by less of them are the same, those below ZERO^2 are none.
POSITIONS, ALIKE, ZERO = 3, 1e-9, 1e-11
# Digits by which inertias are distinguished from none, in squares.
DIGITS, NOTHING = 40, 1e-50


def vanishing_pivots(tree: Tree, solid: bool = False) -> dict[int, frozenset[int]]:
    """Indices of the generalized speeds whose pivot of the mass matrix vanishes at some positions, each with those of the speeds
    after it that may then move what it moves.

    solid   only those that then move no link that has a mass at all, and so no constraint between such links; else links have
            mass in some directions only where they are points or thin rods
    """
    return Search(tree, solid).vanishing_pivots()


def massless(tree: Tree, k: int) -> bool:
    """Whether link k has no mass and no inertia of its own; with parameters of the default 0 at 0, with others at any value."""
    return tree.added_to(k) is None and not any(part.any() for part in _filled(tree, k))


def felt(tree: Tree, k: int, twist: np.ndarray) -> bool:
    """Whether link k has mass in the direction of a twist (6,), by what is zero in both; parameters as for `massless`."""
    omega, v = (np.array([not is_zero(e) for e in half]) for half in (twist[:3], twist[3:]))
    heavy, first, turning = _filled(tree, k)
    across = [(first[i] and omega[j]) or (first[j] and omega[i]) for i, j in ((0, 1), (1, 2), (2, 0))]
    return bool((heavy & v).any() or (turning & omega).any() or any(across))


def _filled(tree: Tree, k: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Where the mass (1,), the first moment (3,) and the inertia (3, 3) of a link's own are not zero."""
    inertia = tree.links[k].inertia
    whole = np.array([inertia.m, *inertia.h, *inertia.I.ravel()], dtype=object)
    # The inertia of a link may hold masses of all links behind it: what it depends on is found only where it matters.
    if not tree.idle or tree.idle.isdisjoint(leaf.args[1] for leaf in Tape.of(Recorder(), whole=whole).inputs):
        filled = np.array([not is_zero(e) for e in whole])
    else:
        filled = abs(_Position(tree, 0, False).numbers(whole)[0]) > math.sqrt(NOTHING)
    return filled[:1], filled[1:4], filled[4:].reshape(3, 3)


def behind(tree: Tree, k: int, twist: np.ndarray, blocks: Callable[[int], tuple[np.ndarray, np.ndarray]]) -> Any:
    """Reference for the pivot of a joint whose link k has no mass: size of the terms whose difference the pivot is.

    twist    of link k, (6,); blocks: of a link the (3, 3) of turning and of shifting of its inertia, with what hangs on it
    Twice the kinetic energy of the next links with mass, all joints between held, without the products of turning and shifting,
    which may cancel the rest.
    """
    total: Any = 0
    for child, link in enumerate(tree.links):
        if link.parent == k:
            omega = link.R.T @ twist[:3]
            v = link.R.T @ (twist[3:] + cross(twist[:3], link.r))
            if massless(tree, child):
                total = total + behind(tree, child, np.concatenate([omega, v]), blocks)
            else:
                turning, shifting = blocks(child)
                total = total + inner(omega, turning @ omega) + inner(v, shifting @ v)
    return total


def nonzero_indices(row: np.ndarray) -> frozenset[int]:
    """Where a row is not zero by structure."""
    return frozenset(np.flatnonzero(row != 0).tolist())  # a node is not equal to a number


class Search:
    """Questions of `vanishing_pivots`, link by link.

    alive     speeds that a motion without kinetic energy may have, as far as is known; those of beams bend them
    sound     speeds that always move a link otherwise than the speeds after them do: their pivots are not zero
    """

    def __init__(self, tree: Tree, solid: bool = False) -> None:
        self.tree, self.solid = tree, solid
        self.sound: set[int] = set()
        self._tried: dict[tuple[Any, ...], np.ndarray] = {}
        self.own = [[tree.drivers[k] for k in link.speeds] for link in tree.links]  # of each of the joint's speeds
        # Speeds that move each link and were alive at its turn, of the links so far: with all others they are n^2 in a chain.
        self.moving: list[set[int]] = []
        bending = [tree.drivers[k] for body in tree.flexible for k in body.speeds]
        self.alive = set(range(tree.D.shape[1])).difference(*bending)
        self.positions = [_Position(tree, k, solid, self.own, self.moving, self.alive) for k in range(POSITIONS)]

    def vanishing_pivots(self) -> dict[int, frozenset[int]]:
        changing: dict[int, frozenset[int]] = {}
        explained: dict[int, frozenset[int]] = {}
        decided: set[int] = set()
        for k in range(len(self.tree.links)):
            parent = self.tree.links[k].parent
            before = self.moving[parent] if parent >= 0 else set()
            self.moving.append(self.alive.intersection(before.union(*self.own[k])))
            speeds = sorted(self.moving[k])
            asked = [p for p in speeds if p not in decided]
            if massless(self.tree, k) or not asked:
                continue
            result = {p: self._sound(k, p, [c for c in speeds if c > p]) for p in asked}
            self.sound.update(p for p in asked if result[p])
            after = {p: frozenset(c for c in speeds if c > p) for p in asked}
            changing.update({p: after[p] for p in asked if result[p] is False})
            explained.update({p: after[p] for p in asked if result[p] is None and after[p]})
            if len(asked) == len(speeds) and all(result.values()):
                self.alive.difference_update(speeds)
            decided |= self.sound
            # A link that has mass in all directions, and is not moved, moves nothing that hangs on it, either.
            if not decided.issuperset(asked) and len(self.positions[0].directions(k)) == 6:
                decided.update(asked)
        together = {} if self.solid else explained
        return {p: after for p, after in {**together, **changing}.items() if p not in self.sound}

    def _sound(self, k: int, p: int, after: Sequence[int]) -> bool | None:
        """Whether speed p always moves link k otherwise than the speeds after it do; None where it never does."""
        tree, link = self.tree, self.tree.links[k]
        alone = not after and (link.parent < 0 or p not in self.moving[link.parent])
        along = [any(not is_zero(e) and p in own for e, own in zip(entries, self.own[k], strict=True))
                 for entries in link.S]
        if alone and felt(tree, k, np.array(along, dtype=int)):
            return True
        squares = self._squares(k, p, after)
        if (squares < ZERO**2).all(axis=0).any():
            return None
        return bool((squares > ALIKE).all() and (np.ptp(squares, axis=0) < ALIKE * squares[0]).all())

    def _squares(self, k: int, p: int, after: Sequence[int]) -> np.ndarray:
        """Results of `_Position.squares` at all positions, (POSITIONS, 2)."""
        link, first = self.tree.links[k], self.positions[0]
        key: tuple[Any, ...] = (k, p, *after)
        if not first.carried(k):
            own, D = first.driven(k)
            shape = _shape([*link.S.ravel(), *D.ravel(), *[e for part in first.inertia(k) for e in part.ravel()]], first.given)
            key = (shape, own.index(p), *map(own.index, after))
        if key not in self._tried:
            self._tried[key] = np.array([position.squares(k, p, after) for position in self.positions])
        return self._tried[key]


class _Position:
    """A tree at random values of everything that it depends on, the same ones of parameters at all positions; links are evaluated
    when they are first requested.

    own, moving   of each link the speeds of its joint, one by one, and those that move it, as far as they were alive at its turn
    alive   speeds that are still asked about, which get fewer while the links are gone through
    given   names of what has values of its own
    """

    def __init__(self, tree: Tree, seed: int, solid: bool, own: Sequence[Sequence[frozenset[int]]] = (),
                 moving: Sequence[Set[int]] = (), alive: Set[int] = frozenset()) -> None:
        self.tree, self.solid, self.own, self.moving, self.alive = tree, solid, own, moving, alive
        self.stream = random.Random(seed)
        self.parameters = {parameter.name for parameter in tree.model.parameters}
        self.values = dict.fromkeys(tree.idle, 0.0)
        for joint in tree.model.joints:
            if isinstance(getattr(joint, "orientation", None), EulerParameters):
                p = [self.stream.uniform(0.5, 1.5) for _ in range(4)]
                self.values.update({q.name: e / math.hypot(*p) for q, e in zip(joint.coordinates[-4:], p, strict=True)})
        self.given = frozenset(self.values)
        self._twists: dict[int, dict[int, np.ndarray]] = {}
        self._directions: dict[int, np.ndarray] = {}
        self._of_inertia: dict[tuple[Any, ...], np.ndarray] = {}  # like bodies have the same nodes

    def squares(self, k: int, p: int, after: Sequence[int]) -> tuple[float, float]:
        """Square of the velocity that speed p gives to link k, in directions in which it has mass; and of its part that
        velocities by the speeds `after` do not explain. NaN where it is no real number."""
        twists, directions = self.twists(k), self.directions(k)
        felt = directions @ twists[p]
        others = np.array([directions @ twists[c] for c in after]).reshape(len(after), len(felt)).T
        if not np.isfinite(others).all() or not np.isfinite(felt).all():
            return math.nan, math.nan
        rest = felt - others @ np.linalg.lstsq(others, felt, rcond=ZERO)[0]
        return float(felt @ felt), float(rest @ rest)

    def twists(self, k: int) -> dict[int, np.ndarray]:
        """Velocity of link k, at its origin, link axes, (6,), by each speed of its joint, and each one before that is alive."""
        if k not in self._twists:
            link, (own, D) = self.tree.links[k], self.driven(k)
            S, D = self.floats(link.S, D)
            result = dict(zip(own, (S @ D).T, strict=True))
            carried = self.carried(k)
            if carried:
                R, r = self.floats(link.R, link.r)
                before = self.twists(link.parent)
                for c in carried & before.keys():
                    *omega, x, y, z = before[c]
                    here = np.concatenate([R.T @ omega, R.T @ (np.array([x, y, z]) + np.cross(omega, r))])
                    result[c] = result.get(c, 0) + here
            self._twists[k] = result
        return self._twists[k]

    def carried(self, k: int) -> Set[int]:
        """Those of the speeds before link k that are alive and move it."""
        parent = self.tree.links[k].parent
        return self.alive & self.moving[parent] if parent >= 0 else frozenset()

    def driven(self, k: int) -> tuple[list[int], np.ndarray]:
        """The speeds that joint k is made of, and how its own follow from these."""
        own = sorted(frozenset().union(*self.own[k]))
        return own, self.tree.D[list(self.tree.links[k].speeds)][:, own]

    def inertia(self, k: int) -> list[np.ndarray]:
        """Mass, first moment and inertia of link k, and its added mass, in nodes."""
        inertia, added = self.tree.links[k].inertia, self.tree.added_to(k)
        parts = [np.array(inertia.m, dtype=object), inertia.h, inertia.I]
        return parts if added is None else [*parts, added.A, added.H, added.M]

    def directions(self, k: int) -> np.ndarray:
        """Those in which link k has mass, (n, 6), orthonormal."""
        if self.solid:
            return np.eye(6)
        if k not in self._directions:
            parts = self.inertia(k)
            asked = tuple(entry for part in parts for entry in part.ravel())
            if asked not in self._of_inertia:
                self._of_inertia[asked] = self._in_numbers(parts)
            self._directions[k] = self._of_inertia[asked]
        return self._directions[k]

    def _in_numbers(self, parts: Sequence[np.ndarray]) -> np.ndarray:
        """The same of an inertia, and of an added mass, given by their parts in nodes."""
        m, h, I, *added = self.numbers(*parts)
        whole = ArticulatedInertia.rigid(Inertia(m[()], h, I)).matrix()
        if added:
            whole = whole + ArticulatedInertia(*added).matrix()
        return np.linalg.qr(_floats(_independent(whole)).T)[0].T

    def numbers(self, *arrays: np.ndarray) -> list[np.ndarray]:
        """Arrays of nodes in numbers of 40 digits; parameters of the default 0 are 0."""
        return list(evaluate(self._tape(arrays), self.values, DIGITS).values())

    def floats(self, *arrays: np.ndarray) -> list[np.ndarray]:
        """The same, rounded to doubles; NaN for what is no real number."""
        result = evaluate_quickly(self._tape(arrays), self.values, DIGITS)
        return [array.astype(float) for array in result.values()]

    def _tape(self, arrays: Sequence[np.ndarray]) -> Tape:
        """A tape of arrays; its leaves get values."""
        tape = Tape.of(Recorder(), **{str(k): array for k, array in enumerate(arrays)})
        for leaf in tape.inputs:
            name = leaf.args[1]
            if name not in self.parameters:
                self.values.setdefault(name, self.stream.uniform(0.5, 1.5))
            elif name not in self.values:
                self.values[name] = random.Random(name).uniform(0.5, 1.5)
        return tape


def _shape(entries: Sequence[Any], named: Set[str]) -> tuple[Any, ...]:
    """Key of how entries are computed: the same for those that differ in names of leaves alone, but for those in `named`."""
    found = list(dict.fromkeys(e for e in entries if isinstance(e, Node)))
    numbers = {node: k for k, node in enumerate(found)}
    for node in found:  # which grows meanwhile
        for a in node.args:
            if isinstance(a, Node) and a not in numbers:
                numbers[a] = len(found)
                found.append(a)

    def numbered(values: Sequence[Any]) -> list[Any]:
        return [(numbers[value],) if isinstance(value, Node) else value for value in values]

    return (*numbered(entries), *[(node.mask, node.args[1] in named and node.args[1]) if node.op == "leaf" else
                                  (node.op, *numbered(node.args)) for node in found])


def _floats(values: np.ndarray) -> np.ndarray:
    """NaN for what is no real number."""
    result = [float(e) if isinstance(e, int) or hasattr(e, "_mpf_") else math.nan for e in values.ravel()]
    return np.array(result).reshape(values.shape)


def _independent(rows: np.ndarray) -> np.ndarray:
    """Remainders of the rows of a matrix, by Gram and Schmidt with all digits; without those that depend on others."""
    basis: list[np.ndarray] = []
    for row in rows:
        rest = row
        for b in basis:
            rest = rest - b * (inner(b, rest) / inner(b, b))
        if inner(rest, rest) > NOTHING * inner(row, row):
            basis.append(rest / max(abs(e) for e in rest))
    return np.array(basis, dtype=object).reshape(-1, rows.shape[1])
