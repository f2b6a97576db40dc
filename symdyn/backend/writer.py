"""Writes the statements of one function in the words of a dialect."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from itertools import groupby
from textwrap import fill
from typing import Any

from symdyn.backend.dialect import Dialect, identifier
from symdyn.backend.function import ARGUMENTS, Function, Part, Section
from symdyn.backend.printer import Printer
from symdyn.errors import SymdynError
from symdyn.tape.external import UserFunction
from symdyn.tape.node import ACCELERATION, COORDINATE, INPUT, PARAMETER, SEED, SPEED, STATE, TIME, Node, is_zero
from symdyn.tape.tape import Tape, count_of, reachable, unsigned

GROUPS = {TIME: "t", COORDINATE: "q", SPEED: "u", STATE: "z", ACCELERATION: "ud", INPUT: "inputs", PARAMETER: "p",
          SEED: "change"}
PROLOGUE = "constants: everything that depends on parameters only"
# Operations that may stop a function.
STOPPING = ("call", "guard")
_INLINE_LENGTH = 72
# Results that are zero, from how many on they are made so at once: compilers take more than linear time for stores.
_MANY_ZEROS = 100


class Writer:
    """Writes one function or part of one: decides which nodes get a variable, and in which words.

    stored   nodes that are read from an array: what the prologue or an earlier part computed -> (group, index)
    late     see _late
    inlined  what is written where it is used; None: what is used once and short
    """

    def __init__(self, dialect: Dialect, tape: Tape, leaves: Mapping[str, tuple[str, int]],
                 stored: Mapping[Node, tuple[str, int]], codes: Mapping[str, int | str], late: set[Node],
                 inlined: frozenset[Node] | None = None) -> None:
        self.dialect = dialect
        self.inlined = inlined
        self.late = late
        self.demanded = {unsigned(n.args[1]) for n in late if n.op == "div"}
        self.tape = tape
        self.leaves = leaves
        self.stored = stored
        self.codes = codes
        self.names = tape.recorder.names
        self.checks: Mapping[Node, str] = {}
        self.taken: set[str] = dialect.names()
        self.text: dict[Node, str] = {}
        self.printer = Printer(dialect, self.text)
        self.uses: Counter[Node] = Counter()
        self.results: set[Node] = set()
        self.guarded: set[Any] = set()
        self.groups: set[str] = set()
        self.n_unnamed = 0
        self.n_calls = 0

    def part(self, body: Sequence[Node], entries: Sequence[Any], results: Callable[[], tuple[str, ...]],
             checks: Mapping[Node, str]) -> Part:
        """Statements for the steps of `body`, of which `entries` are used afterwards; checks: of the whole function."""
        self.checks = checks
        self._count(body, entries)
        # Only what the sines and cosines need is read before them; anything else would wait in registers, or be spilled.
        at_once = taken_at_once(body, self.dialect)
        needed = set(reachable(at_once)).difference(at_once)
        before = [n for n in body if n in needed]
        loads = self._read([*before, *at_once])
        sections = self._statements(before) + self._sines_and_cosines(at_once)
        written = self._reordered if self.dialect.reordered else self._statements
        sections += written([n for n in body if n not in self.text])
        others = self._read((), entries)
        if others:
            sections.append(Section("the other arguments", tuple(others)))
        stored = results()
        return Part(tuple(g for g in ARGUMENTS if g in self.groups), tuple(loads), tuple(sections), stored)

    def results_of(self, entries: Sequence[Any], stored: Sequence[int] | None = None) -> Callable[[], tuple[str, ...]]:
        """The function that stores the entries as result, once their text is known; stored: the indices of those that this part
        stores."""
        zeros = self.dialect.zeros if sum(map(is_zero, entries)) >= _MANY_ZEROS else None
        indices = range(len(entries)) if stored is None else stored
        begin = (zeros.format(n=len(entries)),) if zeros is not None and not (indices and indices[0]) else ()
        return lambda: (*begin, *(self.dialect.store.format(k=k + self.dialect.first, value=self.printer.text(entries[k]))
                                  for k in indices if zeros is None or not is_zero(entries[k])))

    def keep(self, nodes: Sequence[Node], slots: Mapping[Node, int]) -> tuple[str, ...]:
        """Statements that keep values for later parts."""
        assert self.dialect.parts is not None
        return tuple(self.dialect.parts.store.format(k=slots[n] + self.dialect.first, value=self.printer.text(n))
                     for n in nodes)

    def prologue(self, constants: Mapping[Node, int]) -> Function:
        """The function that computes the constants c from the parameters p."""
        body = [n for n in self.tape.prologue if n not in self.late]
        self.checks = checks_of(self.tape, body)
        self._count(body, tuple(constants))
        loads: list[str] = []
        for node in body:
            for core in cores_of(node.args):
                if core.op == "leaf" and core not in self.text:
                    self._load(core, loads)
        sections = self._statements(body)
        results = self.results_of(tuple(constants))()
        return Function("prologue", PROLOGUE, (len(constants),),
                        tuple(g for g in ("p",) if g in self.groups), tuple(loads), tuple(sections), results,
                        count_of(body), 0)

    # -- leaves and constants

    def _read(self, body: Sequence[Node], entries: Sequence[Any] = ()) -> list[str]:
        """Reads the leaves and constants among the arguments of these steps and the entries that are not read yet."""
        used = dict.fromkeys(core for values in [*[n.args for n in body], entries] for core in cores_of(values)
                             if core not in self.text and (core.op == "leaf" or core in self.stored))
        lines: list[str] = []
        for leaf in sorted((n for n in used if n.op == "leaf"),
                           key=lambda n: (list(GROUPS).index(n.mask), self.leaves[n.args[1]][1])):
            self._load(leaf, lines)
        for node in sorted((n for n in used if n in self.stored), key=lambda n: self.stored[n]):
            group, index = self.stored[node]
            self.groups.add(group)
            unnamed = f"k{index + 1}" if group == "c" else f"{group}{index + 1}"
            self.text[node] = identifier(self.names.get(node, unnamed), self.taken)
            handed_on = "" if self.dialect.parts is None else self.dialect.parts.load
            load = self.dialect.load.get(group, handed_on)
            lines.append(self._assignment(node, load.format(k=index + self.dialect.first)))
            if node in self.demanded and node in self.checks:
                lines.append(self.dialect.check.format(name=self.text[node], code=self.codes[self.checks[node]]))
        return lines

    def _load(self, leaf: Node, lines: list[str]) -> None:
        group, index = self.leaves[leaf.args[1]]
        self.groups.add(group)
        if group == "t":
            self.text[leaf] = "t"
            return
        value = self.dialect.load[group].format(k=index + self.dialect.first)
        self._assign(leaf, leaf.args[1], value, lines)

    def _assign(self, node: Node, name: str, value: str, lines: list[str]) -> None:
        """A variable for a node, and what is demanded of it."""
        self.text[node] = identifier(name, self.taken)
        lines.append(self._assignment(node, value))
        if node in self.checks:
            lines.append(self.dialect.check.format(name=self.text[node], code=self.codes[self.checks[node]]))

    def _assignment(self, node: Node, value: str) -> str:
        """The line that assigns to the variable of a node."""
        form = self.dialect.assign if self.dialect.read is None or node.mask & SEED else self.dialect.read
        return form.format(name=self.text[node], value=value)

    # -- sines and cosines

    def _sines_and_cosines(self, nodes: Sequence[Node]) -> list[Section]:
        """The section that takes these all at once."""
        way = self.dialect.sincos
        if way is None or not nodes:
            return []
        angles = list(dict.fromkeys(n.args[0] for n in nodes))
        lines = way.take.format(n=len(angles), angles=", ".join(map(self.printer.text, angles))).strip().split("\n")
        for node in nodes:
            index = angles.index(node.args[0]) + self.dialect.first
            self._assign(node, self._name(node), (way.sin if node.op == "sin" else way.cos).format(k=index), lines)
        return [Section("sines and cosines", tuple(lines))]

    # -- statements

    def _count(self, body: Sequence[Node], entries: Sequence[Any]) -> None:
        """Note how often each node is used, and which are results."""
        self.uses = Counter(core for values in [*[n.args for n in body], entries] for core in cores_of(values))
        self.results = set(cores_of(entries))
        self.guarded = {n.args[0] for n in body if n.op == "guard"}

    def _statements(self, body: Sequence[Node]) -> list[Section]:
        """Sections of statements; each begins with the arguments that are first needed there."""
        sections: list[Section] = []
        for title, group in groupby(body, key=lambda node: node.section):
            nodes = list(group)
            lines = self._read(nodes)
            for node in nodes:
                lines += self.step(node)
            if lines:
                sections.append(Section(title, tuple(lines)))
        return sections

    def _reordered(self, body: Sequence[Node]) -> list[Section]:
        """Statements as they stand in `body`; each has the arguments that are first needed there before it."""
        lines = [line for node in body for line in (*self._read([node]), *self.step(node))]
        return [Section("in an order in which few values wait for their uses", tuple(lines))] if lines else []

    def step(self, node: Node) -> list[str]:
        """The statements of a step, if it is not written where it is used."""
        if node.op == "call":
            return self._call(node)
        if node.op == "guard":
            return [self._guard(node)]
        value = self.printer.operation(node)
        if self._written_where_used(node, value):
            self.text[node] = value
            self.printer.inline.add(node)
            return []
        lines: list[str] = []
        self._assign(node, self._name(node), value, lines)
        return lines

    def _written_where_used(self, node: Node, value: str) -> bool:
        """Whether a step gets no variable."""
        named = node in self.names and node not in self.results
        inline = self.uses[node] <= 1 and not named and node not in self.checks and node not in self.guarded
        return inline and (len(value) <= _INLINE_LENGTH if self.inlined is None else node in self.inlined)

    def _guard(self, node: Node) -> str:
        """The statement that stops where the margin is not positive; the node is written as the value that it guards."""
        value, margin = node.args
        self.text[node] = self.printer.text(value)
        return self.dialect.check.format(name=f"({self.printer.text(margin)})", code=self.codes[self.checks[node]])

    # -- numeric algorithms

    def _call(self, node: Node) -> list[str]:
        """The statements that call one; its node stands for the array of results."""
        intrinsic, *values = node.args
        way = self.dialect.call
        mine = isinstance(intrinsic, UserFunction)
        if way is None:
            called = f"function {intrinsic.signature}" if mine else f"numeric algorithm {intrinsic.name}"
            raise SymdynError(f"the equations call the {called}, which the backend {self.dialect.name} does not have; "
                              "add [call] to its dialect.toml, and the algorithm to its templates")
        self.n_calls += 1
        self.text[node] = identifier(f"{intrinsic.label}_call{self.n_calls}" if mine else f"solved{self.n_calls}", self.taken)
        written = [way.argument.format(value=self.printer.text(v)) for v in values]
        arguments = fill(", ".join(written), 116, subsequent_indent="    ", break_long_words=False)
        arguments = arguments.replace("\n", f"{way.continued}\n")
        sizes = "".join(f"{size}, " for size in intrinsic.sizes)
        return way.take.format(name=self.text[node], function=intrinsic.name, sizes=sizes,
                               arguments=arguments, n_in=len(values), n_out=intrinsic.n_out,
                               code=self.codes[self.checks[node]]).strip().split("\n")

    def _name(self, node: Node) -> str:
        known = self.names.get(node)
        if known:
            return known
        first = unsigned(node.args[0]) if node.args else None
        if node.op in ("sin", "cos", "tan", "sqrt") and isinstance(first, Node) and first.op == "leaf":
            return f"{node.op}_{first.args[1]}"
        self.n_unnamed += 1
        return f"x{self.n_unnamed}"


def taken_at_once(body: Sequence[Node], dialect: Dialect) -> list[Node]:
    """The sines and cosines that need no other one, if the dialect takes so many of them all at once."""
    least = None if dialect.sincos is None else dialect.sincos.least
    asked = [node for node in body if node.op in ("sin", "cos")]
    if least is None or len(asked) < least:
        return []
    needed = set(reachable(asked))
    chosen: list[Node] = []
    waiting: set[Node] = set()
    for node in body:
        if node not in needed:
            continue
        if not waiting.isdisjoint(cores_of(node.args)):
            waiting.add(node)
        elif node.op in ("sin", "cos"):
            chosen.append(node)
            waiting.add(node)
    return chosen if len(chosen) >= least else []


def checks_of(tape: Tape, steps: Sequence[Node]) -> dict[Node, str]:
    """Values that must be positive for these steps: pivots that they divide by, not those that another function divides by."""
    asked = [n for n in steps if n.op == "div" or n.op in STOPPING]
    divisors = {unsigned(n.args[1]) if n.op == "div" else n for n in asked}
    return {n: reason for n, reason in tape.recorder.checks.items() if n in divisors}


def cores_of(values: Sequence[Any]) -> list[Node]:
    """The nodes among values, without their signs; a sign of a difference is written by exchanging its sides."""
    return [value.args[0] if value.op == "neg" else value for value in values if isinstance(value, Node)]
