"""Tapes as generated code runs them, statement by statement: numeric algorithms written out, other equations besides."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from symdyn.backend.program import SINGULAR_FALLBACK
from symdyn.functions.tapes import tape_as_derived
from symdyn.stress.system_under_test import SystemUnderTest
from symdyn.tape.balance import balance
from symdyn.tape.node import Node
from symdyn.tape.passes import Again
from symdyn.tape.recorder import Recorder
from symdyn.tape.tape import Output, Tape, unsigned
from symdyn.tape.walk import walk


@dataclass(frozen=True)
class Statements:
    """A tape; smooths: whether an algorithm is written out in it, which next to lost rank gives a smooth solution in place of the
    exact one."""

    tape: Tape
    smooths: bool


def emitted(tested: SystemUnderTest, names: Sequence[str]) -> dict[str, list[Statements]]:
    """By name the tapes that functions of one unit run: the usual one, and where there is another for states at which a check
    of it fails, that one. Sums are in the order of generated code; algorithms are written out where `written_out` can."""
    tapes = {name: tape_as_derived(tested.equations, name) for name in names}
    if tested.equations.singular_fallback is not None:
        others = tested.equations.singular_fallback
        for name in names:
            there = tape_as_derived(others, name)
            if _entries(there) != _entries(tapes[name]):
                tapes[f"{name}_{SINGULAR_FALLBACK}"] = there
    recorder = next(iter(tapes.values())).recorder
    whole = balance(Tape(recorder, {name: next(iter(tape.outputs.values())) for name, tape in tapes.items()}))
    return {name: [written_out(whole.prune((key,))) for key in (name, f"{name}_{SINGULAR_FALLBACK}") if key in tapes]
            for name in names}


def _entries(tape: Tape) -> list[tuple[Any, ...]]:
    return [output.entries for output in tape.outputs.values()]


def written_out(tape: Tape) -> Statements:
    """The tape with algorithms as statements, in the order of generated code, where they have any; others stay calls."""
    if not any(node.op == "call" for node in tape.steps):
        return Statements(tape, False)
    recorder = Recorder()
    arithmetic = _WrittenOut(recorder)
    new = walk(tape.steps, arithmetic)
    outputs = {name: Output(name, o.shape, tuple(new.of(e) for e in o.entries)) for name, o in tape.outputs.items()}
    return Statements(Tape(recorder, outputs), arithmetic.smooths)


class _WrittenOut(Again):
    """With the checks of the tape, and statements in place of algorithms."""

    smooths = False

    def again(self, node: Node, args: tuple[Any, ...]) -> Any:
        value, checks = super().again(node, args), node.recorder.checks
        if node in checks:
            self.recorder.positive(unsigned(value), checks[node])
        return value

    def call(self, node: Node, args: list[Any]) -> Any:
        written = node.args[0].statements(self.recorder, args)
        self.smooths |= written is not None
        return super().call(node, args) if written is None else written
