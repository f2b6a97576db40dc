"""Functions on their way from the steps of a tape to statements: whole, in parts where they are long, or with loops."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

from symdyn.backend.common import Beginning, most_in_common, read_later, saved
from symdyn.backend.dialect import Dialect
from symdyn.backend.divide import divide
from symdyn.backend.function import ARGUMENTS, Function, Part
from symdyn.backend.order import few_waiting
from symdyn.backend.rolled import Rolled
from symdyn.backend.writer import Writer, checks_of
from symdyn.tape.arrays import Arrays
from symdyn.tape.node import Node
from symdyn.tape.tape import Output, Tape, count_of

# Statements that are saved, at least, where several functions have them in common: they take 5 s to compile. Measured over nets
# of rods and bridges: what is handed on costs up to 8 % of the run time where 10,000 are saved, 2.5 % at most from 20,000 on.
LEAST_COMMON = 20_000


@dataclass(frozen=True)
class Draft:
    """A function before it is written.

    body     its steps; checks: what must be positive
    arrays   of a tape that has these steps
    """

    name: str
    title: str
    tape: Tape
    body: Sequence[Node]
    checks: Mapping[Node, str]
    arrays: Arrays

    @property
    def output(self) -> Output:
        """Its result."""
        return next(iter(self.tape.outputs.values()))


@dataclass(frozen=True)
class Drafts:
    """The writing of the functions of one program.

    leaves    name -> (group, index in it)
    hoisted   what the prologue computes, in the same way; codes: what is returned for each reason
    late      see symdyn.backend.program
    inlined   function name -> what is written where it is used; of others: what is used once and short
    """

    dialect: Dialect
    leaves: Mapping[str, tuple[str, int]]
    hoisted: Mapping[Node, tuple[str, int]]
    codes: Mapping[str, int]
    late: set[Node]
    inlined: Mapping[str, frozenset[Node]]

    def function(self, tape: Tape, name: str, title: str, body: Sequence[Node] | None = None,
                 dividing: Sequence[Node] = ()) -> Function:
        """One function without loops; see `draft`."""
        return self.straight(self.draft(tape, name, title, body, dividing))

    def draft(self, tape: Tape, name: str, title: str, body: Sequence[Node] | None = None,
              dividing: Sequence[Node] = ()) -> Draft:
        """The draft of a function.

        body       its steps; None: all that run
        dividing   steps of other functions whose divisors are checked here
        """
        if body is None and not self.late:
            body = tape.running
        else:
            running = {*tape.running, *self.late}
            taken = tape.steps if body is None else body
            body = [n for n in taken if n in running and n not in self.hoisted and n.op != "leaf"]
        checks = checks_of(tape, [*tape.running, *(n for n in tape.prologue if n in self.late), *dividing])
        return Draft(name, title, tape, body, checks, tape.arrays)

    def looped(self, draft: Draft, least: int) -> Function | None:
        """The function with loops for what it repeats; None where they save fewer than so many statements."""
        made = Rolled(self.dialect, draft.tape, self.leaves, self.hoisted, self.codes, draft.checks, draft.body,
                      draft.output.entries, self.inlined.get(draft.name))
        if made.saved < least:
            return None
        return made.function(draft.name, draft.title, draft.output.shape, draft.tape.longest_chain())

    def long(self, draft: Draft) -> bool:
        """Whether it is divided into parts."""
        return self.dialect.parts is not None and len(draft.body) > self.dialect.parts.whole

    def straight(self, draft: Draft, beginning: Beginning | None = None) -> Function:
        """The function without loops, in parts if it is long and the dialect divides long ones.

        beginning   what it has in common with others; None: nothing
        """
        entries, made = draft.output.entries, partial(
            Function, draft.name, draft.title, draft.output.shape, operations=count_of(draft.body),
            longest_chain=draft.tape.longest_chain())
        if not self.long(draft):
            writer = Writer(self.dialect, draft.tape, self.leaves, self.hoisted, self.codes, self.late,
                            self.inlined.get(draft.name))
            part = writer.part(self._ordered(draft, draft.body, entries), entries, writer.results_of(entries), draft.checks)
            return made(part.arguments, part.loads, part.sections, part.results, inlined=frozenset(writer.printer.inline))
        beginning = beginning or Beginning()
        parts, _, n_w, inlined = self._parts(draft, beginning, set())
        inlined = inlined.union(*[f.inlined for f in beginning.calls])
        groups = {g for called in beginning.calls for g in called.arguments} | {g for part in parts for g in part.arguments}
        return made(tuple(g for g in ARGUMENTS if g in groups), (), (), (), parts=tuple(parts), n_w=n_w, calls=beginning.calls,
                    inlined=inlined)

    def _parts(self, draft: Draft, beginning: Beginning, later: set[Node]) -> tuple[
            list[Part], Mapping[Node, int], int, frozenset[Node]]:
        """The parts of what is left of a function, indices in w, the size of w, and what is written where it is used.

        later   nodes that are kept for what runs after them
        """
        assert self.dialect.parts is not None
        longest, entries = self.dialect.parts.longest, draft.output.entries
        done, wanted = beginning.done, self.inlined.get(draft.name)
        body = [node for node in draft.body if node not in done] if done else draft.body
        stretches, slots, n_w = divide(draft.arrays, body, entries, longest, beginning.slots, beginning.n_w, later)
        storing = -(-len(entries) // longest)
        parts: list[Part] = []
        result: set[Node] = set()
        stored = {**self.hoisted, **{node: ("w", slot) for node, slot in slots.items() if node in beginning.slots}}
        for k, (stretch, kept) in enumerate(stretches, storing - len(stretches)):
            writer = Writer(self.dialect, draft.tape, self.leaves, stored, self.codes, self.late, wanted)
            if k < 0:
                part = writer.part(self._ordered(draft, stretch, kept), kept, partial(writer.keep, kept, slots), draft.checks)
                parts.append(replace(part, stores=False))
            else:
                ends = range(k * longest, min((k + 1) * longest, len(entries))) if storing > 1 else range(len(entries))
                here = [entries[i] for i in ends]
                ordered = self._ordered(draft, stretch, here)
                parts.append(writer.part(ordered, here, writer.results_of(entries, ends), draft.checks))
            stored |= {node: ("w", slots[node]) for node in kept}
            result |= writer.printer.inline
        return parts, slots, n_w, frozenset(result)

    def _ordered(self, draft: Draft, steps: Sequence[Node], entries: Sequence[Any]) -> Sequence[Node]:
        """Steps in the order in which the dialect writes them."""
        return few_waiting(steps, entries, self.inlined.get(draft.name) or ()) if self.dialect.reordered else steps

    def beginnings(self, drafts: Sequence[Draft]) -> dict[str, Beginning]:
        """The beginnings of long functions without loops: what they have in common with others, if that saves LEAST_COMMON."""
        found = {draft.name: Beginning() for draft in drafts if self.long(draft)}
        left = {draft.name: draft for draft in drafts if draft.name in found}
        while True:
            alike: dict[tuple[str, ...], dict[str, Draft]] = {}
            for name, draft in left.items():
                alike.setdefault(tuple(f.name for f in found[name].calls), {})[name] = draft
            names, steps = max((most_in_common({name: d.body for name, d in group.items()}, {
                name: d.checks for name, d in group.items()}) for group in alike.values()), key=saved, default=((), []))
            if saved((names, steps)) < LEAST_COMMON:
                return found
            before, done = found[names[0]], set(steps)
            left |= {name: replace(left[name], body=[n for n in left[name].body if n not in done]) for name in names}
            later = read_later([left[name].body for name in names], [left[name].output.entries for name in names],
                               [*before.slots, *steps])
            number = 1 + len({f.name for beginning in found.values() for f in beginning.calls})
            function, slots = self._common(f"common_{number}", [left[name] for name in names], steps, before, later)
            found |= dict.fromkeys(names, Beginning((*before.calls, function), slots, function.n_w, before.done | done))

    def _common(self, name: str, drafts: Sequence[Draft], steps: Sequence[Node], before: Beginning,
                later: set[Node]) -> tuple[Function, Mapping[Node, int]]:
        """The function of what others have in common, and where it keeps what is read later."""
        first, *others = drafts
        checks = {node: reason for node, reason in first.checks.items() if all(node in d.checks for d in others)}
        title = f"{', '.join(d.name for d in drafts[:-1])} and {drafts[-1].name} have in common"
        tape = Tape(first.tape.recorder, {name: Output(name, (0,), ())})
        parts, slots, n_w, inlined = self._parts(Draft(name, title, tape, steps, checks, first.arrays), before, later)
        groups = {g for part in parts for g in part.arguments}
        return (Function(name, title, (0,), tuple(g for g in ARGUMENTS if g in groups), (), (), (), count_of(steps), 0,
                         tuple(parts), n_w, inlined=inlined), {node: slots[node] for node in later})
