"""A tape as equations of Modelica: what holds at any time, on variables with the names of the mechanism.

Nothing is done in an order there: where C tries regular equations first and takes others where a check fails, both are written,
and conditions choose between them.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from fractions import Fraction
from typing import Any, NamedTuple

from symdyn.backend.dialect import Dialect
from symdyn.backend.function import Section
from symdyn.backend.source import Content
from symdyn.backend.writer import Writer, checks_of, cores_of
from symdyn.tape.external import UserFunction
from symdyn.tape.node import TIME, Node
from symdyn.tape.passes import Again, rebuild
from symdyn.tape.tape import Output, Tape, reachable, unsigned
from symdyn.tape.walk import walk

# Operations whose results are true or false: they have no variables, which would be discrete.
_CONDITIONS = ("lt", "le", "gt", "ge", "eq", "ne", "and", "or", "not")
# Variable that is 1 where the regular equations hold, else 0.
REGULAR = "regular"
_HALF = Fraction(1, 2)


class Equations(NamedTuple):
    """Equations of the statements of a tape.

    constants    lines that declare what depends on parameters only
    declared     variables, vectors with their size
    sections     equations under headings; asserts: what must hold
    results      the text of every entry, by the name of its output
    """

    constants: tuple[str, ...]
    declared: tuple[str, ...]
    sections: tuple[Section, ...]
    asserts: tuple[str, ...]
    results: Mapping[str, tuple[str, ...]]


class _Guarded(Again):
    """Steps that divide by 1 in place of what must be positive and is not: `margins` are what must be."""

    def __init__(self, tape: Tape) -> None:
        super().__init__(tape.recorder)
        self.margins: list[Any] = []
        self.safe: dict[Node, Any] = {}

    def again(self, node: Node, args: tuple[Any, ...]) -> Any:
        recorder = self.recorder
        with recorder.section(node.section):
            if node.op == "guard":
                return self.guarded(*args)
            divisor = unsigned(node.args[1]) if node.op == "div" else None
            if divisor in self.safe:
                safe = self.safe[divisor]
                args = (args[0], recorder.neg(safe) if node.args[1] is not divisor else safe)
            value = rebuild(recorder, node.op, args)
            if node in recorder.checks and node.op != "call":
                self.safe[node] = self.guarded(value, value)
        if node in recorder.names:
            recorder.name(recorder.names[node], value)
        return value

    def guarded(self, value: Any, margin: Any) -> Any:
        """The value, or 1 where the margin is not positive."""
        self.margins.append(margin)
        return self.recorder.apply("select", self.recorder.apply("gt", margin, 0), value, 1)


class Combined(NamedTuple):
    """Functions as one tape.

    holds      what is 1 where the regular equations hold, else 0; a number where they always do
    fallback   calls of numeric algorithms that are needed where it is 0
    """

    tape: Tape
    holds: Any
    fallback: frozenset[Node]


def combined(content: Content, names: Sequence[str]) -> Combined:
    """The named functions as one tape."""
    recorder = content.tapes["rhs"].recorder
    regular = {n: _entries(content.tapes[n]) for n in names if n in content.singular_fallback}
    guarded = _Guarded(content.tapes["rhs"])
    made = walk(reachable(e for entries in regular.values() for e in entries), guarded)
    holds: Any = 1
    if guarded.margins:
        every: Any = True
        for margin in dict.fromkeys(guarded.margins):
            every = recorder.apply("and", every, recorder.apply("gt", margin, 0))
        holds = recorder.name(REGULAR, recorder.apply("select", every, 1, 0))
    chosen = recorder.apply("gt", holds, _HALF) if isinstance(holds, Node) else True
    outputs = {}
    for n in names:
        tape = content.tapes[n]
        entries = _entries(tape)
        if n in regular:
            entries = tuple(recorder.apply("select", chosen, made.of(a), b)
                            for a, b in zip(entries, _entries(content.singular_fallback[n]), strict=True))
        outputs[n] = Output(n, next(iter(tape.outputs.values())).shape, entries)
    always = {n for n in reachable([e for n in names if n not in regular for e in _entries(content.tapes[n])]
                                   + [made.of(e) for entries in regular.values() for e in entries]) if n.op == "call"}
    whole = Tape(recorder, outputs)
    fallback = frozenset(n for n in whole.steps if n.op == "call" and n not in always)
    return Combined(whole, holds, fallback if isinstance(holds, Node) else frozenset())


def _entries(tape: Tape) -> tuple[Any, ...]:
    return next(iter(tape.outputs.values())).entries


class Flat(Writer):
    """Writes a tape as equations.

    identifiers   leaf name -> its variable; taken: names of further variables
    """

    def __init__(self, dialect: Dialect, whole: Combined, identifiers: Mapping[str, str], taken: Collection[str],
                 codes: Mapping[str, int]) -> None:
        super().__init__(dialect, whole.tape, {}, {}, codes, set())
        self.whole = whole
        self.identifiers = identifiers
        self.taken |= set(taken)
        self.declared: list[str] = []
        self.asserts: list[str] = []
        self.constant = False

    def equations(self) -> Equations:
        """All of them."""
        steps = [n for n in self.tape.steps if n.op not in ("leaf", "neg") and n.mask]
        entries = [e for output in self.tape.outputs.values() for e in output.entries]
        self.checks = checks_of(self.tape, steps)
        self._count(steps, entries)
        self.constant = True
        constants = self._statements(self.tape.prologue)
        self.constant = False
        sections = self._statements(self.tape.running)
        self._read((), entries)
        results = {name: tuple(map(self.printer.text, output.entries)) for name, output in self.tape.outputs.items()}
        return Equations(tuple(line for s in constants for line in s.lines if line), tuple(self.declared),
                         tuple(Section(s.title, tuple(filter(None, s.lines))) for s in sections), tuple(self.asserts), results)

    def _read(self, body: Sequence[Node], entries: Sequence[Any] = ()) -> list[str]:
        """Leaves are variables: nothing reads them."""
        for core in (c for values in [*[n.args for n in body], entries] for c in cores_of(values)):
            if core.op == "leaf" and core not in self.text:
                self.text[core] = "time" if core.mask == TIME else self.identifiers[core.args[1]]
        return []

    def _assign(self, node: Node, name: str, value: str, lines: list[str]) -> None:
        checks: list[str] = []
        if node is self.whole.holds:
            self.taken.discard(REGULAR)
        super()._assign(node, name, value, checks)
        lines.append(self._declared(checks.pop(0), self.text[node], ""))
        self.asserts += checks

    def _guard(self, node: Node) -> str:
        self.asserts.append(super()._guard(node))
        return ""

    def _call(self, node: Node) -> list[str]:
        first, *rest = super()._call(node)
        name = self.text[node]
        if node in self.whole.fallback and not isinstance(node.args[0], UserFunction):
            left, right = first.split(" = ", 1)
            first = f"{left} = if noEvent({REGULAR} > 0.5) then zeros({node.args[0].n_out}) else"
            rest = [f"    {right}", *rest]
        return [self._declared(first, name, f"[{node.args[0].n_out}]"), *rest]

    def _declared(self, line: str, name: str, size: str) -> str:
        """A line that declares a constant, or an equation, whose variable is declared apart."""
        if self.constant:
            return f"final parameter Real {name}{size}{line.removeprefix(name)}"
        self.declared.append(f"{name}{size}")
        return line

    def _written_where_used(self, node: Node, value: str) -> bool:
        return node.op in _CONDITIONS or super()._written_where_used(node, value)
