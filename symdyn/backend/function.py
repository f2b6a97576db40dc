"""The functions of a program: straight-line statements in one dialect."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from symdyn.tape.node import Node

ARGUMENTS = ("t", "q", "u", "z", "ud", "inputs", "p", "c", "v", "change")


@dataclass(frozen=True)
class Section:
    """Statements under one heading."""

    title: str
    lines: tuple[str, ...]


@dataclass(frozen=True)
class Part:
    """A stretch of a long function, a function of its own: compilers take more than linear time for one function.

    arguments   groups it reads, of t q u z ud inputs p c, in this order; it also gets w, which holds what parts hand on
    results     statements that keep values in w, or those that store the function's result
    stores      whether they store the result: the last part does, and of a long result as many parts as it takes
    trips       of the loop that it is; 0: it is none
    """

    arguments: tuple[str, ...]
    loads: tuple[str, ...]
    sections: tuple[Section, ...]
    results: tuple[str, ...]
    stores: bool = True
    trips: int = field(default=0, repr=False)


@dataclass(frozen=True)
class Function:
    """One function of the generated module.

    arguments   groups it reads, of t q u z ud inputs p c, in this order
    shape       of its result; loads, sections, results: statements in the dialect
    parts       what a long function consists of, instead of statements; n_w: size of what the parts hand on
    calls       functions that it calls before its own parts, which leave in w what it has in common with others
    regular, singular_fallback   for a function that is tried in one way and, where that fails, done in another: both, in place of
                statements of its own
    written     statements that stand in the code where loops repeat some; steps: those that run
    inlined     steps that are written where they are used: which products and sums become one depends on it
    values      of a Jacobian by several columns at once: the function that computes what all columns share, n_v numbers v
    along       and for each group of arguments the derivatives along a direction in it
    motion      of a right-hand side with sensitivities: what their directions are
    """

    name: str
    title: str
    shape: tuple[int, ...]
    arguments: tuple[str, ...]
    loads: tuple[str, ...]
    sections: tuple[Section, ...]
    results: tuple[str, ...]
    operations: Mapping[str, int]
    longest_chain: int
    parts: tuple[Part, ...] = ()
    n_w: int = 0
    calls: tuple[Function, ...] = ()
    regular: Function | None = None
    singular_fallback: Function | None = None
    inlined: frozenset[Node] = frozenset()
    values: Function | None = None
    along: tuple[Along, ...] = ()
    motion: Motion | None = None
    written: int = 0
    steps: int = 0

    @property
    def loops(self) -> tuple[int, ...]:
        """The trips of its loops."""
        return tuple(part.trips for part in self.parts if part.trips)

    @property
    def stores(self) -> bool:
        """Whether it stores the result, as its last part does."""
        return True

    @property
    def with_called(self) -> list[Function]:
        """This function and those that it calls."""
        called = [way for way in (self.regular, self.singular_fallback, self.values) if way is not None]
        return [self, *[inner for way in (*called, *[a.function for a in self.along]) for inner in way.with_called]]

    @property
    def size(self) -> int:
        """Number of entries of the result."""
        total = 1
        for k in self.shape:
            total *= k
        return total

    @property
    def room(self) -> int:
        """Length of an array for the result: C has none of length 0."""
        return max(self.size, 1)

    @property
    def room_w(self) -> int:
        """The same for what parts hand on."""
        return max(self.n_w, 1)

    @property
    def shape_text(self) -> str:
        """The shape of the result in words."""
        return {0: "one number", 1: f"{self.size} numbers"}.get(
            len(self.shape), " x ".join(map(str, self.shape)) + ", row by row")

    @property
    def n_columns(self) -> int:
        """Columns of a matrix, whose last axis these are."""
        return self.shape[-1]

    @property
    def n_rows(self) -> int:
        """Rows of such columns."""
        return self.size // self.n_columns

    @property
    def leaves_columns(self) -> bool:
        """Whether columns of it are along no direction: they are zero."""
        return sum(a.n for a in self.along) < self.n_columns

    @property
    def is_empty(self) -> bool:
        """Whether it writes nothing to its result."""
        return not (self.results or self.parts or self.singular_fallback or self.along)

    @property
    def reads_state(self) -> bool:
        """Whether it reads part of x."""
        return not {"q", "u", "z"}.isdisjoint(self.arguments)

    @property
    def ways(self) -> tuple[Function, ...]:
        """The functions that hold its statements: itself, or both ways where it is tried in one way first."""
        return tuple(f for f in (self.regular, self.singular_fallback) if f is not None) or (self,)

    @property
    def stretches(self) -> tuple[Part | Function, ...]:
        """Its parts, or itself where it is not divided."""
        return self.parts or (self,)

    @property
    def count(self) -> int:
        """Operations of one evaluation."""
        return sum(self.operations.values())


@dataclass(frozen=True)
class Along:
    """The derivatives along a direction in one group of arguments, on vectors with a direction in each lane.

    first, n    the columns of the Jacobian; n is the number of entries of a direction, too
    function    takes numbers, and the direction in the group `change`
    inline      whether it is so short that its call would take a share of it to speak of
    """

    first: int
    n: int
    function: Function
    inline: bool


@dataclass(frozen=True)
class Motion:
    """The directions of sensitivities: entries of the state's columns, then inputs that are held, then what columns are by.

    n_x      entries of a column; n: columns
    values   where x_dot begins in what the directions share
    first    where the columns begin in z
    held     number of inputs that are held, whose derivatives along the columns begin at parameter held_first
    by       for each column the entry of the direction that is 1; -1: none
    """

    n_x: int
    n: int
    values: int
    first: int
    held: int
    held_first: int
    by: tuple[int, ...]

    @property
    def by_first(self) -> int:
        """Index in the direction at which the numbers begin that columns are by."""
        return self.n_x + self.held
