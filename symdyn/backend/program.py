"""A program: functions of straight-line statements in one dialect, ready for a template to lay out."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from symdyn.backend.dialect import Dialect, identifier
from symdyn.backend.printer import Printer
from symdyn.tape.node import ACCELERATION, COORDINATE, INPUT, PARAMETER, SPEED, STATE, TIME, Node
from symdyn.tape.tape import Tape, reachable, unsigned

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
        self.uses: Counter[Node] = Counter()
        self.results: set[Node] = set()
        self.groups: set[str] = set()
        self.n_unnamed = 0

    def function(self, name: str, title: str) -> Function:
        output = next(iter(self.tape.outputs.values()))
        body = [n for n in self.tape.running if n not in self.constants]
        self.checks = _checks(self.tape, body)
        self._count(body, output.entries)
        # Only what the sines and cosines need is read before them: whatever else is has to wait in registers.
        at_once = self._at_once(body)
        needed = set(reachable(at_once)).difference(at_once)
        before = [n for n in body if n in needed]
        loads = self._read([*before, *at_once])
        sections = self._statements(before) + self._sines_and_cosines(at_once)
        rest = [n for n in body if n not in self.text]
        others = self._read(rest, output.entries)
        if not at_once:
            loads = others
        elif others:
            sections.append(Section("the other arguments", tuple(others)))
        sections += self._statements(rest)
        results = tuple(self.dialect.store.format(k=k + self.dialect.first, value=self.printer.text(e))
                        for k, e in enumerate(output.entries))
        order = [g for g in ("t", "q", "u", "z", "ud", "inputs", "p", "c") if g in self.groups]
        return Function(name, title, output.shape, tuple(order), tuple(loads), tuple(sections), results,
                        self.tape.count(), self.tape.longest_chain())

    def prologue(self, constants: Mapping[Node, int]) -> Function:
        """The function that computes the constants c from the parameters p."""
        body = list(self.tape.prologue)
        self.checks = _checks(self.tape, body)
        self._count(body, tuple(constants))
        loads: list[str] = []
        for node in body:
            for core in _cores(node.args):
                if core.op == "leaf" and core not in self.text:
                    self._load(core, loads)
        sections = self._statements(body)
        results = tuple(self.dialect.store.format(k=k + self.dialect.first, value=self.printer.text(node))
                        for node, k in constants.items())
        return Function("prologue", "constants: everything that depends on parameters only", (len(constants),),
                        tuple(g for g in ("p",) if g in self.groups), tuple(loads), tuple(sections), results,
                        self.tape.count_prologue(), 0)

    # -- leaves and constants

    def _read(self, body: Sequence[Node], entries: Sequence[Any] = ()) -> list[str]:
        """Reads the leaves and constants among the arguments of these steps and the entries that are not read yet."""
        used = dict.fromkeys(core for values in [*[n.args for n in body], entries] for core in _cores(values)
                             if core not in self.text)
        lines: list[str] = []
        for leaf in sorted((n for n in used if n.op == "leaf"),
                           key=lambda n: (list(GROUPS).index(n.mask), self.places[n.args[1]][1])):
            self._load(leaf, lines)
        for node in sorted((n for n in used if n in self.constants), key=lambda n: self.constants[n]):
            self.groups.add("c")
            self.text[node] = identifier(self.names.get(node, f"k{self.constants[node] + 1}"), self.taken)
            value = self.dialect.load["c"].format(k=self.constants[node] + self.dialect.first)
            lines.append(self.dialect.assign.format(name=self.text[node], value=value))
        return lines

    def _load(self, leaf: Node, lines: list[str]) -> None:
        group, place = self.places[leaf.args[1]]
        self.groups.add(group)
        if group == "t":
            self.text[leaf] = "t"
            return
        value = self.dialect.load[group].format(k=place + self.dialect.first)
        self._assign(leaf, leaf.args[1], value, lines)

    def _assign(self, node: Node, name: str, value: str, lines: list[str]) -> None:
        """A variable for a node, and what is demanded of it."""
        self.text[node] = identifier(name, self.taken)
        lines.append(self.dialect.assign.format(name=self.text[node], value=value))
        if node in self.checks:
            lines.append(self.dialect.check.format(name=self.text[node], code=self.codes[self.checks[node]]))

    # -- sines and cosines

    def _at_once(self, body: Sequence[Node]) -> list[Node]:
        """The sines and cosines that need no other one, if the dialect takes so many of them all at once."""
        chosen: list[Node] = []
        waiting: set[Node] = set()
        for node in body:
            if not waiting.isdisjoint(_cores(node.args)):
                waiting.add(node)
            elif node.op in ("sin", "cos"):
                chosen.append(node)
                waiting.add(node)
        return chosen if self.dialect.sincos is not None and len(chosen) >= self.dialect.sincos.least else []

    def _sines_and_cosines(self, nodes: Sequence[Node]) -> list[Section]:
        """The section that takes these all at once."""
        way = self.dialect.sincos
        if way is None or not nodes:
            return []
        angles = list(dict.fromkeys(n.args[0] for n in nodes))
        lines = way.take.format(n=len(angles), angles=", ".join(map(self.printer.text, angles))).strip().split("\n")
        for node in nodes:
            place = angles.index(node.args[0]) + self.dialect.first
            self._assign(node, self._name(node), (way.sin if node.op == "sin" else way.cos).format(k=place), lines)
        return [Section("sines and cosines", tuple(lines))]

    # -- statements

    def _count(self, body: Sequence[Node], entries: Sequence[Any]) -> None:
        """Note how often each node is used, and which are results."""
        self.uses = Counter(core for values in [*[n.args for n in body], entries] for core in _cores(values))
        self.results = set(_cores(entries))

    def _statements(self, body: Sequence[Node]) -> list[Section]:
        sections: list[tuple[str, list[str]]] = []
        for node in body:
            named = node in self.names and node not in self.results
            value = self.printer.operation(node)
            if self.uses[node] <= 1 and not named and node not in self.checks and len(value) <= _INLINE_LENGTH:
                self.text[node] = value
                self.printer.inline.add(node)
                continue
            if not sections or sections[-1][0] != node.section:
                sections.append((node.section, []))
            self._assign(node, self._name(node), value, sections[-1][1])
        return [Section(title, tuple(lines)) for title, lines in sections]

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


