"""Reference vectors: every function at random states with 30 digits, so that generated code can check itself."""

from __future__ import annotations

import random
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from symdyn.tape.evaluate import evaluate
from symdyn.tape.tape import Tape

DIGITS = 30


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
    """
    stream = random.Random(seed)
    parameters = {name: defaults.get(name, round(stream.uniform(0.5, 1.5), 6)) for name in groups["p"]}
    made = []
    for _ in range(samples):
        values: dict[str, Any] = {"t": round(stream.uniform(0, 1), 6), **parameters}
        for group in ("q", "u", "z", "ud", "inputs"):
            values.update({name: round(stream.uniform(-1, 1), 6) for name in groups[group]})
        results = []
        for name, tape in tapes.items():
            exact = next(iter(evaluate(tape, values, DIGITS).values())).ravel()
            double = next(iter(evaluate(tape, values, 16).values())).ravel()
            scale = max((abs(float(e)) for e in exact), default=0.0) or 1.0
            lost = max((abs(float(a - b)) / scale for a, b in zip(exact, double, strict=True)), default=0.0)
            results.append(ReferenceResult(name, len(exact), tuple(repr(float(e)) for e in exact),
                                           f"{max(1e-12, 20 * lost):.3g}", calls[name]))
        arrays = tuple((group, tuple(repr(float(values[name])) for name in groups[group]))
                       for group in ("q", "u", "z", "ud", "inputs"))
        made.append(Sample(repr(values["t"]), arrays, tuple(results)))
    return Reference(tuple(repr(float(parameters[name])) for name in groups["p"]), tuple(made))
