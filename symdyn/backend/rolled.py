"""Writes a function of many like steps as loops: what bodies that are alike repeat stands once, over arrays of what differs.

The steps are taken in the order in which they are recorded, and results are stored right after they are computed; so every
value is computed as in straight-line code, by the same operations from the same values. The values that a step of a loop reads
are found by comparing all trips: the same value in all, a value of the same trip, one of the trip before, or an entry of an
array, at an index that grows by the same number from trip to trip or, where it does not, stands in a table.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from textwrap import fill
from typing import Any

import numpy as np

from symdyn.backend.dialect import Dialect, identifier
from symdyn.backend.divide import products_next_to_their_sums
from symdyn.backend.function import ARGUMENTS, Function, Part, Section
from symdyn.backend.like_parts import Loop, find_loops
from symdyn.backend.writer import Writer, cores_of, taken_at_once
from symdyn.tape.evaluate import constant
from symdyn.tape.node import Node
from symdyn.tape.recorder import Recorder
from symdyn.tape.tape import Tape, count_of, reachable, unsigned

# Steps of the tape that are not repeated: numeric algorithms and their results.
_ALONE = ("call", "item")
# Values that a step reads besides leaves and constants, which are named by their groups.
_NUMBER, _STEP = "number", "step"
# The arrays that these stand in; leaves and constants stand in those of their groups.
_ARRAYS = {_STEP: "w", "sin": "w", "cos": "w"}
_OTHERS = (_NUMBER, *_ARRAYS)
# Records before the first and behind the last trip of a loop, for values of the bodies at the ends, which are computed apart.
_SPARE = 2
# Entries of a table that take as much time to compile as a statement.
_ENTRIES = 4
# Statements that are computed apart, in one function at most.
_LONGEST = 800


@dataclass(frozen=True, eq=False)
class _Store:
    """A step that keeps a value: entry k of the result ("store"), or of what sines and cosines are taken of ("angle")."""

    op: str
    k: int
    value: Any
    section: str = ""

    @property
    def args(self) -> tuple[Any, ...]:
        return (self.value,)


@dataclass(frozen=True, eq=False)
class _Sines:
    """A step that takes all sines and cosines."""

    op: str = "sines"
    section: str = "sines and cosines"
    args: tuple[Any, ...] = ()


_Step = Node | _Store | _Sines


@dataclass(frozen=True)
class _Kept(Mapping[Node, tuple[str, int]]):
    """Values that steps computed apart read from arrays: constants, sines, and steps before the first of these."""

    of: Rolled
    first: int

    def __getitem__(self, node: Node) -> tuple[str, int]:
        rolled = self.of
        if node in rolled.stored:
            return rolled.stored[node]
        k = rolled.number(node)
        if k < 0 or rolled.groups[k] not in _ARRAYS or rolled.index[k] < 0 or self.first <= k < len(rolled.steps):
            raise KeyError(node)
        return "w", int(rolled.index[k])

    def __iter__(self) -> Iterator[Node]:
        raise NotImplementedError

    def __len__(self) -> int:
        raise NotImplementedError


@dataclass(frozen=True)
class _Argument:
    """An argument of a step of a loop.

    kind     "same": one value in all trips; "own": step `step` of the same trip; "before": that of the trip before, in the first
             trip `numbers[0]`; "array": at indices of `group`; "table": numbers that differ
    numbers  of what is read in each trip, see Rolled.read
    """

    kind: str
    group: str
    numbers: np.ndarray
    step: int = -1


class Rolled:
    """The steps of a function, and which of them are loops.

    stored   nodes that are read from an array: what the prologue computed -> (group, index)
    checks   of the whole function
    inlined  what is written where it is used; None: what is used once and short
    at       of each step its index among those of the tape; -1: it stores or takes sines
    read     what steps read: the steps, then all else
    groups   of each of these; index: in the array of its group, -1: in none
    """

    def __init__(self, dialect: Dialect, tape: Tape, leaves: Mapping[str, tuple[str, int]],
                 stored: Mapping[Node, tuple[str, int]], codes: Mapping[str, int | str], checks: Mapping[Node, str],
                 body: Sequence[Node], entries: Sequence[Any], inlined: frozenset[Node] | None = None) -> None:
        assert dialect.loops is not None and dialect.parts is not None
        self.dialect, self.tape, self.leaves, self.stored = dialect, tape, leaves, stored
        self.codes, self.checks = codes, checks
        self.body, self.entries, self.inlined = body, entries, inlined
        self.arrays = tape.arrays
        self.at_once = taken_at_once(body, dialect)
        self.angles = list(dict.fromkeys(n.args[0] for n in self.at_once))
        self.steps: list[Any]
        self.steps, self.at = self._in_order()
        # Indices of the steps of the tape among what is read; the last one is that of numbers.
        self._numbers = np.full(len(self.arrays.steps) + 1, -1)
        self._numbers[self.at] = np.arange(len(self.steps))
        self._numbers[-1] = -1
        self.read: list[Any] = list(self.steps)
        self.groups: list[str] = [_STEP] * len(self.steps)
        self.index = np.full(len(self.steps), -1)
        kinds = self._look()
        sections = [step.section for step in self.steps]
        begins = [k + 1 for k, (one, other) in enumerate(pairwise(sections)) if one != other]
        self.loops = find_loops(kinds, begins)
        self.size = self._find_indices()

    @property
    def written(self) -> int:
        """Steps that are written: those of one trip of each loop, and all others."""
        return len(self.steps) - sum(loop.saved for loop in self.loops)

    @property
    def saved(self) -> int:
        """Statements that loops save, less what their tables take."""
        tables = {a.numbers.tobytes(): len(a.numbers) for a in self.arguments.values() if a.kind == "table" or
                  (a.kind == "array" and len(set(np.diff(self.index[a.numbers]).tolist())) > 1)}
        return sum(loop.saved for loop in self.loops) - sum(tables.values()) // _ENTRIES

    def number(self, node: Node) -> int:
        """The index of a node in what steps read; -1: none reads it."""
        return int(self._numbers[self.arrays.index(node)])

    def _in_order(self) -> tuple[list[_Step], np.ndarray]:
        """The steps: what sines and cosines need, these, then the rest; each result is stored as soon as it is there. And their
        indices among those of the tape."""
        arrays = self.arrays
        body = arrays.indices(self.body)
        computed = np.zeros(len(arrays.steps), dtype=bool)
        computed[body] = True
        computed &= ~arrays.marked(self.at_once)
        # Steps that are not the tape's stand in an order as -1, -2, ...
        others: list[_Step] = []
        behind: dict[int, list[int]] = {}
        first: list[int] = []
        for k, entry in enumerate(self.entries):
            core = unsigned(entry)
            index = arrays.index(core) if isinstance(core, Node) else -1
            others.append(_Store("store", k, entry))
            (behind.setdefault(index, []) if index >= 0 and computed[index] else first).append(-len(others))

        def stored(indices: np.ndarray) -> np.ndarray:
            steps = np.flatnonzero(np.isin(indices, list(behind)))
            stores = [behind[index] for index in indices[steps].tolist()]
            return np.insert(indices, np.repeat(steps + 1, [len(s) for s in stores]), [k for s in stores for k in s])

        order = products_next_to_their_sums(arrays, body, self.entries)
        order = order[computed[order]]
        needed = arrays.marked(reachable(self.angles))[order]
        sines: list[_Step] = [_Store("angle", k, angle) for k, angle in enumerate(self.angles)]
        others += [*sines, *[_Sines()] * bool(sines)]
        taken = -1 - np.arange(len(self.entries), len(others))
        order = np.concatenate([stored(order[needed]), taken, np.array(first, dtype=np.int64), stored(order[~needed])])
        return [arrays.steps[k] if k >= 0 else others[-1 - k] for k in order.tolist()], np.maximum(order, -1)

    # -- what steps do, and what they read

    def _look(self) -> np.ndarray:
        """Number what the steps read; returns the kinds of steps."""
        steps, arrays, at = self.steps, self.arrays, self.at
        recorded, alone = at >= 0, np.zeros(len(steps), dtype=bool)
        others = np.flatnonzero(~recorded).tolist()
        alone[recorded] = arrays.does(*_ALONE)[at[recorded]]
        alone[others] = [isinstance(steps[k], _Sines) for k in others]
        # All arguments, one step's after the other's; those of the tape's steps stand in its arrays.
        sizes = np.zeros(len(steps), dtype=np.int64)
        sizes[recorded] = np.diff(arrays.begins)[at[recorded]]
        sizes[others] = [len(steps[k].args) for k in others]
        reader = np.repeat(np.arange(len(steps)), sizes)
        column = np.arange(len(reader)) - np.repeat(np.cumsum(sizes) - sizes, sizes)
        there = recorded[reader]
        source = np.full(len(reader), -1)
        source[there] = arrays.begins[at[reader[there]]] + column[there]
        kept = [value for k in others for value in steps[k].args]
        cores, minus = np.full(len(reader), -1), np.zeros(len(reader), dtype=bool)
        cores[there], minus[there] = arrays.cores[source[there]], arrays.minus[source[there]]
        cores[~there] = arrays.indices(map(unsigned, kept))
        minus[~there] = [unsigned(value) is not value for value in kept]

        read = self._among_read(cores)
        constants: dict[Any, int] = {}
        values = dict(zip(np.flatnonzero(~there).tolist(), kept, strict=True))
        for k in np.flatnonzero((cores < 0) & ~alone[reader]).tolist():
            value = values[k] if k in values else arrays.values[source[k]]
            key = type(value), value
            if key not in constants:
                constants[key] = len(self.read)
                self.read.append(value)
                self.groups.append(_NUMBER)
            read[k] = constants[key]
        self.index = np.concatenate([self.index, np.full(len(constants), -1)])

        together = ~alone[reader]
        where = reader[together], column[together]
        self.references = np.full((len(steps), 3), -1, dtype=np.int64)
        self.references[where] = read[together]
        kinds = np.zeros(len(steps), dtype=np.int64)
        marks = 2 * arrays.marked(self.checks) + arrays.marked(self.tape.recorder.names)
        kinds[recorded] = (4 * arrays.ops.astype(np.int64) + marks)[at[recorded]]
        kinds[others] = 4 * (1 + int(arrays.ops.max(initial=0)) + _numbered([steps[k].op for k in others]))
        taken = np.zeros((len(steps), 3), dtype=np.int64)
        taken[where] = 1 + (2 * _numbered(self.groups)[read] + minus)[together]
        for values_of in taken.T:
            kinds = kinds * (1 + 2 * (len(ARGUMENTS) + len(_OTHERS))) + values_of
        kinds[alone] = -1 - np.flatnonzero(alone)
        return kinds

    def _among_read(self, cores: np.ndarray) -> np.ndarray:
        """The numbers of steps of the tape among what is read; those that are no steps of this function get one."""
        order = {angle: k for k, angle in enumerate(self.angles)}
        n = len(self.angles)
        sines = {node: (1 + (node.op == "cos")) * n + order[node.args[0]] for node in self.at_once}
        outside = [k for k in np.unique(cores[self._numbers[cores] < 0]).tolist() if k >= 0]
        self._numbers[outside] = len(self.read) + np.arange(len(outside))
        self.read += [self.arrays.steps[k] for k in outside]
        groups = [self._group(self.arrays.steps[k], sines) for k in outside]
        self.groups += [group for group, _ in groups]
        self.index = np.concatenate([self.index, np.array([index for _, index in groups], dtype=np.int64)])
        return self._numbers[cores]

    def _group(self, core: Any, sines: Mapping[Node, int]) -> tuple[str, int]:
        """The array that a value is read from, if it is not a step, and its index there."""
        if isinstance(core, Node):
            if core.op == "leaf":
                return self.leaves[core.args[1]]
            if core in self.stored:
                return self.stored[core]
            if core in sines:
                return core.op, sines[core]
        return _NUMBER, -1

    def _argument(self, loop: Loop, r: int, j: int) -> _Argument:
        """Argument j of step r of a loop."""
        numbers = self.references[loop.begin + r:loop.end:loop.length, j]
        group = self.groups[numbers[0]]
        if (numbers == numbers[0]).all() and not loop.begin <= numbers[0] < loop.end:
            return _Argument("same", group, numbers)
        if group == _NUMBER:
            return _Argument("table", group, numbers)
        if group == _STEP:
            own = numbers - loop.begin - loop.length * np.arange(loop.trips)
            if (own == own[0]).all() and own[0] >= 0:
                return _Argument("own", group, numbers, int(own[0]))
            earlier = not loop.begin <= numbers[0] < loop.end
            if earlier and (own[1:] == own[1]).all() and -loop.length <= own[1] < 0:
                return _Argument("before", group, numbers, int(own[1]) + loop.length)
        return _Argument("array", group, numbers)

    # -- indices of what is kept

    def _arguments(self) -> dict[tuple[int, int, int], _Argument]:
        """(loop, step, argument) -> what it is."""
        return {(k, r, j): self._argument(loop, r, j) for k, loop in enumerate(self.loops) for r in range(loop.length)
                for j in range(len(self.steps[loop.begin + r].args))}

    def _find_indices(self) -> int:
        """Indices in w for what is read in another stretch or by an array; returns the size of w."""
        self.arguments = self._arguments()
        self.apart = list(self._apart())
        needed = np.zeros(len(self.read), dtype=bool)
        for a in self.arguments.values():
            needed[a.numbers[:1] if a.kind in ("same", "before") else a.numbers[:0] if a.kind in ("own", "table") else
                   a.numbers] = True
        for first, end in self.apart:
            for step in self.steps[first:end]:
                for core in cores_of(step.args):
                    k = self.number(core)
                    if 0 <= k < first:
                        needed[k] = True
        needed = needed[:len(self.steps)]
        size = 3 * len(self.angles)
        spare: set[int] = set()
        for loop in self.loops:
            read = needed[loop.begin:loop.end].reshape(loop.trips, loop.length)
            fields = np.flatnonzero(read[:-1].any(axis=0))
            last = np.flatnonzero(read[-1] & ~read[:-1].any(axis=0))
            records = size + len(fields) * np.arange(loop.trips + 2 * _SPARE)
            for f, r in enumerate(fields):
                self.index[loop.begin + r:loop.end:loop.length] = records[_SPARE:-_SPARE] + f
                spare.update(int(k) + f for k in (*records[:_SPARE], *records[-_SPARE:]))
            size += len(fields) * (loop.trips + 2 * _SPARE)
            # Each trip overwrites what is read after the last one only.
            for r in last:
                self.index[loop.begin + r:loop.end:loop.length] = size
                size += 1
        self._continue_arrays(needed, spare)
        rest = np.flatnonzero(needed & (self.index[:len(self.steps)] < 0))
        self.index[rest] = size + np.arange(len(rest))
        return size + len(rest)

    def _continue_arrays(self, needed: np.ndarray, spare: set[int]) -> None:
        """Give steps that are computed apart the indices next to a loop's where another loop reads them in a row with these."""
        for a in self.arguments.values():
            if a.kind != "array" or a.group != _STEP:
                continue
            indices = self.index[a.numbers]
            known = np.flatnonzero(indices >= 0)
            if len(known) < 2 or len(known) == len(indices):
                continue
            stride, rest = divmod(int(indices[known[-1]] - indices[known[0]]), int(known[-1] - known[0]))
            row = indices[known[0]] + stride * (np.arange(len(indices)) - known[0])
            missing = np.flatnonzero(indices < 0)
            if rest == 0 and (row[known] == indices[known]).all() and all(int(row[k]) in spare for k in missing):
                self.index[a.numbers[missing]] = row[missing]
                spare.difference_update(int(row[k]) for k in missing)


    def _apart(self) -> Iterator[tuple[int, int]]:
        """Stretches that are no loops, from a step to another; sines and cosines are one of their own."""
        for before, loop in zip([Loop(0, 0, 0), *self.loops], [*self.loops, Loop(len(self.steps), 0, 0)], strict=True):
            begin = before.end
            for k in range(before.end, loop.begin):
                sines = isinstance(self.steps[k], _Sines) or isinstance(self.steps[max(k - 1, 0)], _Sines)
                if k > begin and (sines or (k - begin >= _LONGEST and self.steps[k].op != "item")):
                    yield begin, k
                    begin = k
            if loop.begin > begin:
                yield begin, loop.begin

    # -- text

    def function(self, name: str, title: str, shape: tuple[int, ...], longest_chain: int) -> Function:
        """The function in parts, each a loop or a stretch of steps that are computed apart."""
        inlined: set[Node] = set()
        at = {loop.begin: k for k, loop in enumerate(self.loops)}
        stretches = sorted([*self.apart, *((loop.begin, loop.end) for loop in self.loops)])
        parts = [_LoopWriter(self, at[first]).part(inlined) if first in at else self._stretch(first, end, inlined)
                 for first, end in stretches]
        groups = {g for part in parts for g in part.arguments}
        return Function(name, title, shape, tuple(g for g in ARGUMENTS if g in groups), (), (), (), count_of(self.body),
                        longest_chain, tuple(parts), self.size, inlined=frozenset(inlined), written=self.written,
                        steps=len(self.steps))

    def _stretch(self, first: int, end: int, inlined: set[Node]) -> Part:
        """Steps that are computed apart."""
        assert self.dialect.parts is not None and self.dialect.loops is not None
        steps = self.steps[first:end]
        if isinstance(steps[0], _Sines):
            n = len(self.angles)
            take = self.dialect.loops.sines.format(n=n, sines=n, cosines=2 * n)
            return Part((), (), (Section(steps[0].section, (take,)),), (), False)
        writer = Writer(replace(self.dialect, sincos=None), self.tape, self.leaves, _Kept(self, first), self.codes, set(),
                        self.inlined)
        nodes = [step for step in steps if isinstance(step, Node)]
        stores = [step for step in steps if isinstance(step, _Store)]
        kept = [node for node in nodes if self.index[self.number(node)] >= 0]

        def results() -> tuple[str, ...]:
            lines = [self.stored_at("w", str(self.index[self.number(node)]), writer.printer.text(node)) for node in kept]
            return (*lines, *(self.stored_at(s.op, str(s.k), writer.printer.text(s.value)) for s in stores))

        part = writer.part(nodes, [*kept, *(s.value for s in stores)], results, self.checks)
        within = set(nodes)
        uses = {core for node in nodes for core in cores_of(node.args)} & within
        inlined |= writer.printer.inline & uses
        return replace(part, stores=any(s.op == "store" for s in stores))

    def stored_at(self, what: str, index: str, text: str) -> str:
        """The statement that keeps a value at an index."""
        assert self.dialect.parts is not None
        return (self.dialect.store if what == "store" else self.dialect.parts.store).format(k=index, value=text)


class _LoopWriter:
    """Writes a loop: the steps of a trip, on nodes of their own, whose leaves are what they read from outside of it."""

    def __init__(self, rolled: Rolled, k: int) -> None:
        assert rolled.dialect.loops is not None
        self.rolled, self.k, self.loop, self.words = rolled, k, rolled.loops[k], rolled.dialect.loops
        self.names = rolled.tape.recorder.names
        self.writer = Writer(replace(rolled.dialect, sincos=None), rolled.tape, rolled.leaves, {}, {}, set())
        self.writer.taken.add(self.words.index)
        self.writer.names = {}
        self.recorder = Recorder()
        self.nodes: dict[int, Node] = {}
        self.before: list[str] = []
        self.after: list[str] = []
        self.n_tables = 0
        # Steps that the loop reads from an array: those of its own trips must stand there by then.
        self.read_by_index = {int(number) for (of, *_), a in rolled.arguments.items() if of == k and a.kind == "array"
                              for number in a.numbers}
        self.outside: dict[tuple[Any, ...], Any] = {}
        self.loads: dict[Node, str] = {}

    def part(self, inlined: set[Node]) -> Part:
        """The loop as a function; adds what is written where it is used."""
        rolled, loop, writer = self.rolled, self.loop, self.writer
        steps = rolled.steps[loop.begin:loop.begin + loop.length]
        values = [self._repeated(r, step) for r, step in enumerate(steps)]
        kept = [r for r, step in enumerate(steps) if isinstance(step, Node) and rolled.index[loop.begin + r] >= 0]
        used = Counter(core for args in values for core in cores_of(args))
        within = {core for args, step in zip(values, steps, strict=True) if isinstance(step, Node) for core in cores_of(args)}
        carried = {key[1]: leaf for key, leaf in self.outside.items() if key[0] == "before"}
        used.update(self.nodes[r] for r in kept)
        # A value that the next trip reads needs a variable: the one that it replaces may be read until the end of the trip.
        for r in carried:
            used[self.nodes[r]] += 2
        if rolled.inlined is not None:
            writer.inlined = frozenset(node for r, node in self.nodes.items() if rolled.steps[loop.begin + r] in rolled.inlined)
        writer.uses = used
        writer.guarded = {node.args[0] for node in self.nodes.values() if node.op == "guard"}
        writer.results = {self.nodes[r] for r in kept} | {
            core for args, step in zip(values, steps, strict=True) if isinstance(step, _Store) for core in cores_of(args)}
        lines: list[str] = []
        heading = ""
        for r, (step, args) in enumerate(zip(steps, values, strict=True)):
            here = [line for core in cores_of(args) for line in self._load(core)]
            if isinstance(step, _Store):
                numbers = np.array([s.k for s in rolled.steps[loop.begin + r:loop.end:loop.length]])
                here.append(rolled.stored_at(step.op, self._index(numbers), writer.printer.text(args[0])))
            else:
                here += self._step(r, r in carried)
                if self.nodes[r] in within and self.nodes[r] in writer.printer.inline:
                    inlined.update(rolled.steps[loop.begin + r:loop.end:loop.length])
            if here and step.section and step.section != heading:
                heading = step.section
                title = _in_words(heading, rolled.steps[loop.begin + loop.length + r].section, self.words.index)
                lines.append(f"{rolled.dialect.comment} {title}")
            lines += here
        lines += [self.words.assign.format(name=writer.text[leaf], value=writer.printer.text(self.nodes[r]))
                  for (kind, r, *_), leaf in self.outside.items() if kind == "before"]
        body = [f"    {line}" for line in lines]
        section = Section("", (self.words.begin.format(n=loop.trips), *body, self.words.end, *self.after))
        return Part(tuple(g for g in ARGUMENTS if g in writer.groups), tuple(self.before), (section,), (),
                    any(s.op == "store" for s in steps), loop.trips)

    def _step(self, r: int, carried: bool) -> list[str]:
        """The statements of a step that computes something; what is read after the loop only is kept after it."""
        rolled, loop, node = self.rolled, self.loop, self.nodes[r]
        lines = self.writer.step(node)
        indices = rolled.index[loop.begin + r:loop.end:loop.length]
        if indices[0] < 0:
            return lines
        line = rolled.stored_at("w", self._index(indices), self.writer.printer.text(node))
        if carried and indices[0] == indices[1] and loop.end - loop.length + r not in self.read_by_index:
            before = next(leaf for key, leaf in self.outside.items() if key[:2] == ("before", r))
            self.after.append(rolled.stored_at("w", str(indices[0]), self.writer.text[before]))
            return lines
        return [*lines, line]

    def _repeated(self, r: int, step: Any) -> tuple[Any, ...]:
        """The arguments of a step in terms of the trip; makes its node."""
        args = []
        for j, a in enumerate(step.args):
            value = self._value(self.rolled.arguments[self.k, r, j], a)
            args.append(Node(self.recorder, "neg", (value,), 0, value.mask, "") if unsigned(a) is not a else value)
        if isinstance(step, Node):
            node = self.nodes[r] = Node(self.recorder, step.op, tuple(args), r, step.mask, "")
            others = self.rolled.steps[self.loop.begin + r:self.loop.end:self.loop.length]
            if step in self.names:
                self.writer.names[node] = _in_words(self.names[others[1]], self.names[others[2]], self.words.index)
            if step in self.rolled.checks:
                codes = np.array([self.rolled.codes[self.rolled.checks[other]] for other in others])
                key = self._index(codes)
                self.writer.checks = {**self.writer.checks, node: key}
                self.writer.codes = {**self.writer.codes, key: key}
        return tuple(args)

    def _value(self, argument: _Argument, value: Any) -> Any:
        """An argument: a number, a node of the trip, or a leaf that stands for what is read."""
        if argument.kind == "own":
            return self.nodes[argument.step]
        if argument.kind == "same" and argument.group == _NUMBER:
            return unsigned(value)
        if argument.kind == "before":
            key: tuple[Any, ...] = ("before", argument.step, int(argument.numbers[0]))
        elif argument.kind == "same":
            key = ("same", int(argument.numbers[0]))
        else:
            key = (argument.kind, argument.numbers.tobytes())
        leaf = self.outside.get(key)
        if leaf is None:
            leaf = self.outside[key] = self._leaf(argument, argument.kind == "before")
        return leaf

    def _leaf(self, argument: _Argument, carried: bool) -> Node:
        """A leaf for what is read from outside of the trip, and how it is read."""
        rolled, writer = self.rolled, self.writer
        cores = [rolled.read[k] for k in argument.numbers[[0, 0] if argument.kind == "same" else [1, 2]]]
        array = "table" if argument.kind == "table" else _ARRAYS.get(argument.group, argument.group)
        unnamed = "x" if carried else f"{array}{len(self.outside) + 1}"
        name = _in_words(self._name(cores[0]), self._name(cores[1]), self.words.index) or unnamed
        leaf = Node(self.recorder, "leaf", (0, name), 0, max(1, *(getattr(core, "mask", 1) for core in cores)), "")
        if array == "t":
            writer.groups.add("t")
            writer.text[leaf] = "t"
            return leaf
        if argument.kind == "table":
            value = self._table(self.words.numbers, [repr(constant(core)) for core in (rolled.read[k] for k in argument.numbers)])
        else:
            numbers = argument.numbers[:1] if argument.kind in ("same", "before") else argument.numbers
            load = rolled.dialect.load.get(array, rolled.dialect.parts.load if rolled.dialect.parts is not None else "")
            value = load.format(k=self._index(rolled.index[numbers]))
            if array != "w":
                writer.groups.add(array)
        if carried:
            writer.text[leaf] = identifier(f"{name}_before", writer.taken)
            self.before.append(self.words.carried.format(name=writer.text[leaf], value=value))
        elif argument.kind == "same":
            writer.text[leaf] = identifier(name, writer.taken)
            self.before.append(rolled.dialect.assign.format(name=writer.text[leaf], value=value))
        else:
            self.loads[leaf] = value
        return leaf

    def _load(self, core: Node) -> list[str]:
        """The statement that reads what a step needs for the first time."""
        value = self.loads.pop(core, None)
        if value is None:
            return []
        self.writer.text[core] = identifier(core.args[1], self.writer.taken)
        return [self.rolled.dialect.assign.format(name=self.writer.text[core], value=value)]

    def _name(self, core: Any) -> str:
        """The name of what is read, if it has one."""
        if not isinstance(core, Node):
            return ""
        if core.op == "leaf":
            return str(core.args[1])
        inner = core.args[0] if core.op in ("sin", "cos") else None
        of = f"{core.op}_{inner.args[1]}" if isinstance(inner, Node) and inner.op == "leaf" else ""
        return self.names.get(core, of)

    def _index(self, numbers: np.ndarray) -> str:
        """The index in an array, trip after trip: as it grows, or from a table."""
        begin, i = int(numbers[0]) + self.rolled.dialect.first, self.words.index
        stride = int(numbers[1] - numbers[0]) if len(numbers) > 1 else 0
        if not (np.diff(numbers) == stride).all():
            return self._table(self.words.integers, [str(k + self.rolled.dialect.first) for k in numbers.tolist()])
        if stride == 0:
            return str(begin)
        grown = i if abs(stride) == 1 else f"{abs(stride)}*{i}"
        return f"{begin} - {grown}" if stride < 0 else f"{begin} + {grown}" if begin else grown

    def _table(self, form: str, values: Sequence[str]) -> str:
        """A table with an entry for each trip; what reads it."""
        self.n_tables += 1
        name = identifier(f"table{self.n_tables}", self.writer.taken)
        written = fill(", ".join(values), 116, subsequent_indent="    ", break_long_words=False)
        self.before.insert(0, form.format(name=name, values=written))
        return self.words.item.format(name=name)


def _numbered(values: Sequence[str]) -> np.ndarray:
    """Numbers in place of texts."""
    numbers: dict[str, int] = {}
    return np.array([numbers.setdefault(value, len(numbers)) for value in values], dtype=np.int64)


def _in_words(first: str, second: str, index: str) -> str:
    """A name for two that differ in numbers: with the index in place of these."""
    one, other = re.split(r"(\d+)", first), re.split(r"(\d+)", second)
    if len(one) != len(other) or one[::2] != other[::2]:
        return re.sub(r"\d+", index, first)
    return "".join(a if a == b else index for a, b in zip(one, other, strict=True))
