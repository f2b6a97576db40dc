"""Jacobians by directional derivatives, several columns at once: a direction in each SIMD lane.

A column of a Jacobian is the derivative along one direction. Columns share all that does not depend on the direction: it is
computed once, as numbers. The rest is linear in the direction and the same for every column, so it is written once, on
vectors: far fewer statements than all columns one by one, and as many columns a statement as the processor has lanes.

Source: Griewank and Walther, Evaluating Derivatives, 2nd ed., section 3.1 (vector forward mode).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import prod

import numpy as np

from symdyn.tape.node import SEED, Node
from symdyn.tape.tape import Tape, count_of, reachable

# Operations that combine vectors of directions; conditions that select between them do not depend on the direction.
LINEAR = frozenset({"leaf", "neg", "add", "sub", "mul", "div", "select"})
# Lanes that the choice counts with: registers of 256 bits.
LANES = 4
# The least number of steps of all columns one by one, and as a multiple of those of all together, that makes it faster: calls
# and the numbers that are kept for the directions take time, too. Measured over the catalogue: 0.87 to 0.93 of the speed for
# what is below, 1.15 to 1.66 times the speed for what is above.
LEAST, GAIN = 800, 1.5
# The least number of steps of all columns of sensitivities that makes them one piece of code in a loop: measured over
# n_link_pendulum(5), puma560 and spatial_chain(7) by 1 to 60 numbers, 0.85 to 0.98 of the speed of a piece for each below, 0.95
# to 1.37 above.
LOOPED = 1800


@dataclass(frozen=True)
class Group:
    """Directions in one group of arguments.

    name    of the group; seeds: leaves that stand for the entries of a direction, by name, in the order of the columns
    first   the first of their columns
    """

    name: str
    seeds: tuple[str, ...]
    first: int


@dataclass(frozen=True)
class Columns:
    """A Jacobian of n columns: for each group, one after the other, the derivatives of all rows along a direction.

    tape    with one output: these derivatives of all groups
    shape   of what is differentiated; each of its entries is a row
    """

    tape: Tape
    groups: tuple[Group, ...]
    shape: tuple[int, ...]
    n: int

    @property
    def result_shape(self) -> tuple[int, ...]:
        """The shape of the function's result."""
        return (*self.shape, self.n)

    @property
    def values(self) -> tuple[object, ...]:
        """Results of the function in addition to derivatives."""
        return ()

    @property
    def n_rows(self) -> int:
        """Number of entries that are differentiated."""
        return prod(self.shape)

    def entries(self, k: int) -> tuple[object, ...]:
        """The derivatives along a direction in group k."""
        whole = next(iter(self.tape.outputs.values())).entries
        return whole[k * self.n_rows:(k + 1) * self.n_rows]

    def pays(self) -> bool:
        """Whether this is faster than column by column, each with the steps that its column needs."""
        one_by_one = self.one_by_one()
        return one_by_one >= max(LEAST, GAIN * self.together()) and all(map(_linear, self._moving()))

    def together(self, lanes: int = LANES) -> int:
        """Steps on vectors that are executed for all columns."""
        return sum(-(-len(group.seeds) // lanes) * sum(_counted(n) for n in reachable(self.entries(k)))
                   for k, group in enumerate(self.groups))

    def operations(self, lanes: int) -> int:
        """Operations that are executed with so many lanes: what all columns share, and the steps on vectors."""
        shared = count_of(n for n in self.tape.running if not n.mask & SEED)
        return sum(shared.values()) + self.together(lanes)

    def one_by_one(self) -> int:
        """Steps that all columns need if each is computed by itself: those that depend on its direction."""
        return sum(needed.bit_count() * _counted(node) for k in range(len(self.groups))
                   for node, needed in self._needs(k).items())

    def structure(self) -> np.ndarray:
        """Whether each entry of the matrix may differ from zero, (n_rows, n) of bool."""
        result = np.zeros((self.n_rows, self.n), dtype=bool)
        for k, group in enumerate(self.groups):
            needs = self._needs(k)
            for i, entry in enumerate(self.entries(k)):
                needed = needs.get(entry, 0) if isinstance(entry, Node) else 0
                for column in range(len(group.seeds)):
                    result[i, group.first + column] = needed >> column & 1
        return result

    def _needs(self, k: int) -> dict[Node, int]:
        """The steps of the derivatives along a direction in group k that depend on it, each with its entries, as bits."""
        bit = {name: 1 << column for column, name in enumerate(self.groups[k].seeds)}
        needs: dict[Node, int] = {}
        for node in reachable(self.entries(k)):
            if node.mask & SEED:
                needs[node] = bit[node.args[1]] if node.op == "leaf" else _together(needs, node)
        return needs

    def _moving(self) -> list[Node]:
        return [node for node in self.tape.steps if node.mask & SEED]


@dataclass(frozen=True)
class MotionColumns(Columns):
    """A right-hand side with sensitivities: x_dot, then its derivatives along n columns.

    tape     with one output: x_dot, and its derivative along a direction
    groups   one group, z: the direction of x, then of inputs that are held and of what columns are by
    held     number of inputs that are held
    by       for each column the index of the seed that is 1, among those of `groups` after the held ones; None: none
    """

    held: int
    by: tuple[int | None, ...]

    @property
    def result_shape(self) -> tuple[int, ...]:
        """See Columns."""
        return (self.n_rows * (1 + self.n),)

    @property
    def values(self) -> tuple[object, ...]:
        """See Columns."""
        return next(iter(self.tape.outputs.values())).entries[:self.n_rows]

    def entries(self, k: int) -> tuple[object, ...]:
        """The derivatives along the direction."""
        return next(iter(self.tape.outputs.values())).entries[self.n_rows:]

    def pays(self) -> bool:
        """Whether this is shorter than a piece of code for every column, and can be."""
        steps = sum(map(_counted, self._moving()))
        return self.n * steps >= LOOPED and all(map(_linear, self._moving()))


def _linear(node: Node) -> bool:
    chosen = node.op == "select" and isinstance(node.args[0], Node) and bool(node.args[0].mask & SEED)
    return node.op in LINEAR and not chosen


def _counted(node: Node) -> bool:
    return bool(node.mask & SEED) and node.op not in ("leaf", "neg")


def _together(needs: Mapping[Node, int], node: Node) -> int:
    result = 0
    for a in node.args:
        if isinstance(a, Node):
            result |= needs.get(a, 0)
    return result


def seeds_of(group: Group) -> dict[str, tuple[str, int]]:
    """The leaves of a direction: name -> (group of arguments, index)."""
    return {name: ("change", k) for k, name in enumerate(group.seeds)}
