"""A program: functions of straight-line statements in one dialect, ready for a template to lay out."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from symdyn.backend.dialect import Dialect, identifier
from symdyn.backend.printer import Printer
from symdyn.tape.node import ACCELERATION, COORDINATE, INPUT, PARAMETER, SPEED, STATE, TIME, Node
from symdyn.tape.tape import Tape, unsigned

GROUPS = {TIME: "t", COORDINATE: "q", SPEED: "u", STATE: "z", ACCELERATION: "ud", INPUT: "inputs", PARAMETER: "p"}
_INLINE_LENGTH = 72


@dataclass(frozen=True)
class Section:
    """Statements under one heading."""

    title: str
    lines: tuple[str, ...]


@dataclass(frozen=True)
class Function:
    """One function of the generated module.

    arguments   groups it reads, of t q u z ud inputs p c, in this order
    shape       of its result; loads, sections, results: statements in the dialect
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

    @property
    def size(self) -> int:
        """Number of entries of the result."""
        total = 1
        for k in self.shape:
            total *= k
        return total

    @property
    def count(self) -> int:
        """Operations of one evaluation."""
        return sum(self.operations.values())


@dataclass(frozen=True)
class Program:
    """All functions with their shared prologue.

    reasons   what the return codes 1, 2, ... mean
    n_c       number of constants that the prologue computes
    """

    functions: tuple[Function, ...]
    prologue: Function
    n_c: int
    reasons: tuple[str, ...]


def build(dialect: Dialect, tapes: Mapping[str, Tape], titles: Mapping[str, str], places: Mapping[str, tuple[str, int]],
          reasons: Sequence[str] = ()) -> Program:
    """Write every tape (function name -> tape with one output) in the dialect.

    places   leaf name -> (group, place in it)
    """
    whole = Tape(next(iter(tapes.values())).recorder,
                 {name: next(iter(tape.outputs.values())) for name, tape in tapes.items()})
    codes = {r: k + 1 for k, r in enumerate(dict.fromkeys(
        [*reasons, *_checks(whole, whole.steps).values()]))}
    used = set(_cores([a for n in whole.running for a in n.args] + [e for o in whole.outputs.values() for e in o.entries]))
    constants = {node: k for k, node in enumerate(n for n in whole.hoisted if n in used)}
    functions = tuple(_Writer(dialect, tape, places, constants, codes).function(name, titles[name])
                      for name, tape in tapes.items())
    prologue = _Writer(dialect, whole, places, {}, codes).prologue(constants)
    return Program(functions, prologue, len(constants), tuple(codes))


class _Writer:
    """Writes one function: decides which nodes get a variable, and in which words."""

    def __init__(self, dialect: Dialect, tape: Tape, places: Mapping[str, tuple[str, int]],
                 constants: Mapping[Node, int], codes: Mapping[str, int]) -> None:
        self.dialect = dialect
        self.tape = tape
        self.places = places
        self.constants = constants
        self.codes = codes
        self.names = tape.recorder.names
        self.checks: Mapping[Node, str] = {}
        self.taken: set[str] = set()
        self.text: dict[Node, str] = {}
        self.printer = Printer(dialect, self.text)
        self.loads: list[str] = []
        self.groups: set[str] = set()
        self.n_unnamed = 0

    def function(self, name: str, title: str) -> Function:
        output = next(iter(self.tape.outputs.values()))
        body = [n for n in self.tape.running if n not in self.constants]
        self.checks = _checks(self.tape, body)
        self._load_leaves(body, output.entries)
        self._load_constants(body, output.entries)
        sections = self._statements(body, output.entries)
        results = tuple(self.dialect.store.format(k=k + self.dialect.first, value=self.printer.text(e))
                        for k, e in enumerate(output.entries))
        order = [g for g in ("t", "q", "u", "z", "ud", "inputs", "p", "c") if g in self.groups]
        return Function(name, title, output.shape, tuple(order), tuple(self.loads), sections, results,
                        self.tape.count(), self.tape.longest_chain())

    def prologue(self, constants: Mapping[Node, int]) -> Function:
        """The function that computes the constants c from the parameters p."""
        body = list(self.tape.prologue)
        self.checks = _checks(self.tape, body)
        for node in body:
            self._use_leaves(node.args)
        sections = self._statements(body, tuple(constants))
        results = tuple(self.dialect.store.format(k=k + self.dialect.first, value=self.printer.text(node))
                        for node, k in constants.items())
        return Function("prologue", "constants: everything that depends on parameters only", (len(constants),),
                        tuple(g for g in ("p",) if g in self.groups), tuple(self.loads), sections, results,
                        self.tape.count_prologue(), 0)

    # -- leaves and constants

    def _load_leaves(self, body: Sequence[Node], entries: Sequence[Any]) -> None:
        used: dict[Node, None] = {}
        for values in [n.args for n in body] + [tuple(entries)]:
            for a in values:
                core = unsigned(a)
                if isinstance(core, Node) and core.op == "leaf":
                    used[core] = None
        for leaf in sorted(used, key=lambda n: (list(GROUPS).index(n.mask), self.places[n.args[1]][1])):
            self._load(leaf)

    def _use_leaves(self, args: Sequence[Any]) -> None:
        for a in args:
            core = unsigned(a)
            if isinstance(core, Node) and core.op == "leaf" and core not in self.text:
                self._load(core)

    def _load(self, leaf: Node) -> None:
        group, place = self.places[leaf.args[1]]
        self.groups.add(group)
        if group == "t":
            self.text[leaf] = "t"
            return
        self.text[leaf] = identifier(leaf.args[1], self.taken)
        value = self.dialect.load[group].format(k=place + self.dialect.first)
        self.loads.append(self.dialect.assign.format(name=self.text[leaf], value=value))
        self._check(leaf, self.loads)

    def _check(self, node: Node, lines: list[str]) -> None:
        if node in self.checks:
            lines.append(self.dialect.check.format(name=self.text[node], code=self.codes[self.checks[node]]))

    def _load_constants(self, body: Sequence[Node], entries: Sequence[Any]) -> None:
        used: dict[Node, None] = {}
        for values in [n.args for n in body] + [tuple(entries)]:
            for a in values:
                core = unsigned(a)
                if isinstance(core, Node) and core in self.constants:
                    used[core] = None
        for node in sorted(used, key=lambda n: self.constants[n]):
            self.groups.add("c")
            self.text[node] = identifier(self.names.get(node, f"k{self.constants[node] + 1}"), self.taken)
            value = self.dialect.load["c"].format(k=self.constants[node] + self.dialect.first)
            self.loads.append(self.dialect.assign.format(name=self.text[node], value=value))

    # -- statements

    def _statements(self, body: Sequence[Node], entries: Sequence[Any]) -> tuple[Section, ...]:
        uses: Counter = Counter()
        for node in body:
            uses.update(_cores(node.args))
        uses.update(_cores(entries))
        results = {unsigned(e) for e in entries if isinstance(e, Node)}
        sections: list[tuple[str, list[str]]] = []
        for node in body:
            named = node in self.names and node not in results
            value = self.printer.operation(node)
            if uses[node] <= 1 and not named and node not in self.checks and len(value) <= _INLINE_LENGTH:
                self.text[node] = value
                self.printer.inline.add(node)
                continue
            variable = identifier(self._name(node), self.taken)
            if not sections or sections[-1][0] != node.section:
                sections.append((node.section, []))
            lines = sections[-1][1]
            lines.append(self.dialect.assign.format(name=variable, value=value))
            self.text[node] = variable
            self._check(node, lines)
        return tuple(Section(title, tuple(lines)) for title, lines in sections)

    def _name(self, node: Node) -> str:
        known = self.names.get(node)
        if known:
            return known
        first = unsigned(node.args[0]) if node.args else None
        if node.op in ("sin", "cos", "tan", "sqrt") and isinstance(first, Node) and first.op == "leaf":
            return f"{node.op}_{first.args[1]}"
        self.n_unnamed += 1
        return f"x{self.n_unnamed}"


def _checks(tape: Tape, steps: Sequence[Node]) -> dict[Node, str]:
    """What must be positive for these steps: pivots that they divide by, not those that another function divides by."""
    divisors = {unsigned(n.args[1]) for n in steps if n.op == "div"}
    return {n: reason for n, reason in tape.recorder.checks.items() if n in divisors}


def _cores(values: Sequence[Any]) -> list[Node]:
    """The nodes among values, without their signs; a sign of a difference is written by exchanging its sides."""
    return [core for core in map(unsigned, values) if isinstance(core, Node)]


