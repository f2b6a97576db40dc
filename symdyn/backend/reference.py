"""Reference vectors: every function at random states with 30 digits, so that generated code can check itself."""

from __future__ import annotations

import random
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import mpmath

from symdyn.errors import UnsupportedExpression
from symdyn.tape.evaluate import evaluate
from symdyn.tape.tape import Output, Tape

DIGITS = 30
_ATTEMPTS = 8


@dataclass(frozen=True)
class ReferenceResult:
    """One function at one state; tolerance is relative to the largest entry."""

    name: str
    size: int
    values: tuple[str, ...]
    tolerance: str
    call: str


@dataclass(frozen=True)
class Sample:
    """A state and what every function gives there."""

    t: str
    arrays: tuple[tuple[str, tuple[str, ...]], ...]
    results: tuple[ReferenceResult, ...]


@dataclass(frozen=True)
class Reference:
    """Parameters p and samples."""

    p: tuple[str, ...]
    samples: tuple[Sample, ...]


def make_reference(tapes: Mapping[str, Tape], groups: Mapping[str, Sequence[str]], defaults: Mapping[str, float],
                   calls: Mapping[str, str], samples: int = 2, seed: int = 1) -> Reference:
    """Evaluate every tape at random states in [-1, 1] (parameters at their defaults, else in [0.5, 1.5]).

    groups   leaf names in the groups q, u, z, ud, inputs, p
    The tolerance of a result is 1e-12, or twenty times what the same tape loses in double precision, if that is more.
    States where something is not defined (the root of a negative number, a singular mass matrix) are drawn anew; a
    function that is defined at none of them is left out.
    """
    stream = random.Random(seed)
    drawn = []
    for _ in range(_ATTEMPTS):
        drawn.append(_draw(stream, tapes, groups, defaults, calls, samples))
        if all(len(sample.results) == len(tapes) for sample in drawn[-1].samples):
            break
    return max(drawn, key=lambda reference: sum(len(sample.results) for sample in reference.samples))


def _draw(stream: random.Random, tapes: Mapping[str, Tape], groups: Mapping[str, Sequence[str]],
          defaults: Mapping[str, float], calls: Mapping[str, str], samples: int) -> Reference:
    parameters = {name: defaults.get(name, round(stream.uniform(0.5, 1.5), 6)) for name in groups["p"]}
    made = []
    for _ in range(samples):
        values: dict[str, Any] = {"t": round(stream.uniform(0, 1), 6), **parameters}
        for group in ("q", "u", "z", "ud", "inputs"):
            values.update({name: round(stream.uniform(-1, 1), 6) for name in groups[group]})
        results = [_result(name, tape, values, calls[name]) for name, tape in tapes.items()]
        arrays = tuple((group, tuple(repr(float(values[name])) for name in groups[group]))
                       for group in ("q", "u", "z", "ud", "inputs"))
        made.append(Sample(repr(values["t"]), arrays, tuple(r for r in results if r is not None)))
    return Reference(tuple(repr(float(parameters[name])) for name in groups["p"]), tuple(made))


def _result(name: str, tape: Tape, values: Mapping[str, Any], call: str) -> ReferenceResult | None:
    """A function at a state; None where it is not defined."""
    pivots = [n.args[1] if n.op == "guard" else n for n in tape.steps if n in tape.recorder.checks and n.op != "call"]
    checked = Tape(tape.recorder, {**tape.outputs, "": Output.of("", pivots)})
    try:
        exact, positive = (r.ravel() for r in evaluate(checked, values, DIGITS).values())
        double = next(iter(evaluate(tape, values, 16).values())).ravel()
    except (ArithmeticError, ValueError, TypeError, UnsupportedExpression):  # also comparisons of complex numbers
        return None
    if not all(hasattr(e, "_mpf_") and mpmath.isfinite(e) for e in [*exact, *positive]) or any(e <= 0 for e in positive):
        return None
    scale = max((abs(float(e)) for e in exact), default=0.0) or 1.0
    lost = max((abs(float(a - b)) / scale for a, b in zip(exact, double, strict=True)), default=0.0)
    return ReferenceResult(name, len(exact), tuple(repr(float(e)) for e in exact), f"{max(1e-12, 20 * lost):.3g}", call)
