"""Tapes as generated code runs them, statement by statement: numeric algorithms written out, other equations beside."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np

from symdyn.functions.tapes import tape_as_derived
from symdyn.stress.subject import Subject
from symdyn.tape.balance import balance
from symdyn.tape.kernels import CLEANINGS, MASSLESS, ROUNDS, SMOOTHED, Kernel, Multipliers, Saddle
from symdyn.tape.node import Node, is_zero
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


def emitted(subject: Subject, names: Sequence[str]) -> dict[str, list[Statements]]:
    """By name the tapes that functions of one unit run: the usual one, and where there is another for states at which a check
    of it fails, that one. Sums are in the order of generated code; algorithms are written out where `written_out` can."""
    tapes = {name: tape_as_derived(subject.equations, name) for name in names}
    if subject.equations.otherwise is not None:
        others = subject.equations.otherwise
        for name in names:
            there = tape_as_derived(others, name)
            if _entries(there) != _entries(tapes[name]):
                tapes[f"{name} otherwise"] = there
    recorder = next(iter(tapes.values())).recorder
    whole = balance(Tape(recorder, {name: next(iter(tape.outputs.values())) for name, tape in tapes.items()}))
    return {name: [written_out(whole.prune((key,))) for key in (name, f"{name} otherwise") if key in tapes] for name in names}


def _entries(tape: Tape) -> list[tuple[Any, ...]]:
    return [output.entries for output in tape.outputs.values()]


def written_out(tape: Tape) -> Statements:
    """The tape with the algorithms Saddle and Multipliers as statements, in the order of the C backend; others stay calls."""
    if not any(node.op == "call" and type(node.args[0]) in _WRITERS for node in tape.steps):
        return Statements(tape, False)
    recorder = Recorder()
    new = walk(tape.steps, _WrittenOut(recorder))
    outputs = {name: Output(name, o.shape, tuple(new.of(e) for e in o.entries)) for name, o in tape.outputs.items()}
    return Statements(Tape(recorder, outputs), True)


class _WrittenOut(Again):
    """With the checks of the tape, and statements in place of algorithms."""

    def again(self, node: Node, args: tuple[Any, ...]) -> Any:
        value, checks = super().again(node, args), node.recorder.checks
        if node in checks:
            self.recorder.positive(unsigned(value), checks[node])
        return value

    def call(self, node: Node, args: list[Any]) -> Any:
        writer = _WRITERS.get(type(node.args[0]))
        return super().call(node, args) if writer is None else writer(self.recorder, node.args[0], args)


def _saddle(r: Recorder, kernel: Kernel, values: Sequence[Any]) -> list[Any]:
    """Saddle as templates/c/runtime/symdyn_saddle.h has it."""
    assert isinstance(kernel, Saddle)
    n, m = kernel.sizes
    M_in, C_in, s, w, f, d = kernel.split(values)
    masses = [w[i] * w[i] * M_in[i, i] for i in range(n)]
    largest: Any = 0
    for mass in masses:
        largest = r.apply("max", mass, largest)
    largest = _where(r, "gt", largest, 0, largest, 1)
    lighter = [1 if is_zero(mass) else _where(r, "gt", mass, Fraction(MASSLESS) * largest, r.sqrt(r.div(largest, mass)), 1)
               for mass in masses]
    columns = [w[i] * lighter[i] for i in range(n)]
    e = Fraction(float(values[0]))
    a = r.div(largest, e * e)
    rows, C = [], np.zeros((m, n), dtype=object)
    for k in range(m):
        most: Any = 1
        for j in range(n):
            most = r.apply("max", _where(r, "ne", C_in[k, j], 0, lighter[j], 1), most)
        rows.append(r.div(s[k], most))
        for j in range(n):
            C[k, j] = rows[k] * columns[j] * C_in[k, j]
    M, A = np.zeros((n, n), dtype=object), np.zeros((n, n), dtype=object)
    for i in range(n):
        for j in range(i + 1):
            M[i, j] = M[j, i] = columns[i] * columns[j] * M_in[i, j]
            A[i, j] = M[i, j] + a * _less(0, -C[:, i], C[:, j])
    _factorize(r, A)
    x, lam = np.zeros(n, dtype=object), np.zeros(m, dtype=object)
    for _ in range(ROUNDS):
        right = [_less(columns[i] * f[i], M[i], x) for i in range(n)]
        for k in range(m):
            gap = a * _less(rows[k] * d[k], C[k], x) - lam[k]
            for j in range(n):
                right[j] = right[j] + C[k, j] * gap
        x = x + _substitute(r, A, right)
        for k in range(m):
            lam[k] = lam[k] - a * _less(rows[k] * d[k], C[k], x)
    return [x[i] * columns[i] for i in range(n)]


def _multipliers(r: Recorder, kernel: Kernel, values: Sequence[Any]) -> list[Any]:
    """Multipliers as templates/c/runtime/symdyn_multipliers.h has it."""
    assert isinstance(kernel, Multipliers)
    n, m = kernel.sizes
    C_in, s, w, g = kernel.split(values)
    smoothed = Fraction(SMOOTHED) ** 2
    C, A = np.zeros((m, n), dtype=object), np.zeros((m, m), dtype=object)
    for k in range(m):
        for j in range(n):
            C[k, j] = s[k] * w[j] * C_in[k, j]
    for i in range(m):
        for j in range(i + 1):
            A[i, j] = _less(smoothed if i == j else 0, -C[i], C[j])
    _factorize(r, A)
    lam = np.zeros(m, dtype=object)
    for _ in range(ROUNDS):
        rest = [_less(w[j] * g[j], C[:, j], lam) for j in range(n)]
        lam = lam + _substitute(r, A, [_less(0, -C[k], rest) for k in range(m)])
    for _ in range(CLEANINGS):
        right = lam
        for _ in range(ROUNDS):
            right = _substitute(r, A, smoothed * right)
        lam = lam - right
    return [lam[k] * s[k] for k in range(m)]


_WRITERS = {Saddle: _saddle, Multipliers: _multipliers}


def _where(r: Recorder, comparison: str, a: Any, b: Any, then: Any, other: Any) -> Any:
    return r.apply("select", r.apply(comparison, a, b), then, other)


def _less(start: Any, a: Iterable[Any], x: Iterable[Any]) -> Any:
    """start - a_0 x_0 - a_1 x_1 - ..."""
    for one, other in zip(a, x, strict=True):
        start = start - one * other
    return start


def _factorize(r: Recorder, A: np.ndarray) -> None:
    """A = L D L^T in place, of the lower triangle."""
    n = len(A)
    for j in range(n):
        for k in range(j):
            v = A[j, k] * A[k, k]
            for i in range(j, n):
                A[i, j] = A[i, j] - A[i, k] * v
        for i in range(j + 1, n):
            A[i, j] = r.div(A[i, j], A[j, j])


def _substitute(r: Recorder, A: np.ndarray, right: Sequence[Any]) -> np.ndarray:
    """A^-1 right by these factors, (n,)."""
    n, x = len(A), np.array(right, dtype=object)
    for i in range(n):
        x[i] = _less(x[i], A[i, :i], x[:i])
    for i in reversed(range(n)):
        x[i] = _less(r.div(x[i], A[i, i]), A[i + 1:, i], x[i + 1:])
    return x
