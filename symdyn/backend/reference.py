"""Reference vectors: every function at states that exercise its statements, with 30 digits, so that generated code can check
itself.

States are chosen among many random ones, so that as many statements as possible change a result where they are changed; see
symdyn.backend.exercised. The choice is measured by corrupting written files: `python -m symdyn.lab.mutants`.
"""

from __future__ import annotations

import math
import random
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import mpmath
import numpy as np

from symdyn.backend.exercised import Rows, deciding, singular_states, statements
from symdyn.errors import UnsupportedExpression
from symdyn.tape.evaluate import evaluate
from symdyn.tape.floats import evaluate_rows
from symdyn.tape.node import Node
from symdyn.tape.tape import Output, Tape

DIGITS = 30
_ATTEMPTS = 8
# States among which those are chosen that exercise what the first ones leave out, and how many of these are tried.
CANDIDATES, TRIED = 400, 12
# Results with more rounding than this are no use as a reference if others are there.
COARSE = 1e-7
# Parameters of chosen states are defaults times a number between these, since values such as 1 hide a factor; a default that is 0
# becomes a number between the second two.
VARIED, FROM_ZERO = (0.8, 1.25), (0.05, 0.3)
# Further states for functions with a singular fallback, which gives the right result where an error in the regular case fails a
# check.
WITH_FALLBACK = 16
STATE_GROUPS = ("q", "u", "z", "ud", "inputs")


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
    """Parameters and a state, and what functions give there."""

    p: tuple[str, ...]
    t: str
    arrays: tuple[tuple[str, tuple[str, ...]], ...]
    results: tuple[ReferenceResult, ...]

    @property
    def calls(self) -> tuple[ReferenceResult, ...]:
        """The results that are not empty."""
        return tuple(r for r in self.results if r.size)

    @property
    def reads_t(self) -> bool:
        """Whether a call of these reads the time."""
        return "t" in self._read

    @property
    def read(self) -> tuple[tuple[str, tuple[str, ...]], ...]:
        """The arrays that these calls read."""
        return tuple((group, values) for group, values in self.arrays if group in self._read)

    @property
    def _read(self) -> set[str]:
        return {argument for result in self.calls for argument in result.call.split(", ")}


@dataclass(frozen=True)
class Reference:
    """Samples, the number of statements of all functions and how many of them change a result of a sample where they are changed.

    checks   further statements, which serve only conditions of choices and checks that values are positive
    idle     function name -> number of its statements that no sample exercises
    """

    samples: tuple[Sample, ...]
    statements: int = 0
    exercised: int = 0
    checks: int = 0
    idle: Mapping[str, int] = field(default_factory=dict)

    @property
    def digits(self) -> int:
        """Decimal digits that the results are computed with."""
        return DIGITS

    @property
    def coverage(self) -> str:
        """One sentence, for the self-test's output."""
        rest = ", ".join(f"{n} of {name}" for name, n in self.idle.items())
        return (f"{len(self.samples)} states visited, {self.exercised} of {self.statements} statements exercised"
                f"{f'; not exercised: {rest}' if rest else ''}"
                f"{f'; {self.checks} more only decide validity or a branch' if self.checks else ''}")


def make_reference(tapes: Mapping[str, Tape], groups: Mapping[str, Sequence[str]], defaults: Mapping[str, float],
                   calls: Mapping[str, str], singular_fallback: Mapping[str, Tape] | None = None, samples: int = 2,
                   seed: int = 1) -> Reference:
    """Evaluate every tape at random states in [-1, 1], and those tapes of which some statement has no effect there at further
    states that exercise it.

    Parameters are at their defaults (those without in [0.5, 1.5]) at the first state, varied at the others.

    groups      leaf names in the groups q, u, z, ud, inputs, p
    singular_fallback   function name -> the tape for states where a check of the first one fails
    samples     random states at which all functions are evaluated
    The tolerance of a result is 1e-12, or the power of ten above twenty times what the same tape loses in double precision, if
    that is more; a result that loses all digits is left out.
    States where something is not defined (the root of a negative number, a singular mass matrix) are drawn again; a
    function that is defined at none of them is left out.
    """
    stream = random.Random(seed)
    whole = {name: (tape, (singular_fallback or {}).get(name)) for name, tape in tapes.items()}
    drawn = []
    for attempt in range(_ATTEMPTS):
        usual = {name: defaults.get(name, round(stream.uniform(0.5, 1.5), 6)) for name in groups["p"]}
        # Defaults such as 1, or two of the same value, hide wrong factors; other values may be impossible together.
        parameters = [usual, *[_varied(stream, usual) if attempt < _ATTEMPTS // 2 else usual for _ in range(1, samples)]]
        drawn.append([_Point(groups, given, _state(stream, groups)).sample(whole, calls) for given in parameters])
        if all(len(sample.results) == len(tapes) for sample in drawn[-1]):
            break
    first = max(drawn, key=lambda made: sum(len(sample.results) for sample in made))
    return _Search(whole, groups, defaults, calls, stream).completed(first)


def _varied(stream: random.Random, parameters: Mapping[str, float]) -> dict[str, float]:
    """Parameters near the given ones, all different."""
    return {n: round(value * stream.uniform(*VARIED) if value else stream.uniform(*FROM_ZERO), 6) or value
            for n, value in parameters.items()}


def _state(stream: random.Random, groups: Mapping[str, Sequence[str]], reach: float = 1.0) -> dict[str, float]:
    values = {"t": round(stream.uniform(0, 1), 6)}
    return values | {name: round(stream.uniform(-reach, reach), 6) for group in STATE_GROUPS for name in groups[group]}


@dataclass(frozen=True)
class _Point:
    """Parameters and a state, by name."""

    groups: Mapping[str, Sequence[str]]
    parameters: Mapping[str, float]
    state: Mapping[str, float]

    def sample(self, whole: Mapping[str, tuple[Tape, Tape | None]], calls: Mapping[str, str],
               names: Sequence[str] | None = None) -> Sample:
        """The results of the named functions (default: all) that are defined here."""
        values = {**self.parameters, **self.state}
        results = []
        for name in whole if names is None else names:
            tape, singular = whole[name]
            result = result_at(name, tape, values, calls[name])
            if result is None and singular is not None:
                result = result_at(name, singular, values, calls[name])
            results.append(result)
        arrays = tuple((group, tuple(repr(float(values[name])) for name in self.groups[group])) for group in STATE_GROUPS)
        p = tuple(repr(float(self.parameters[name])) for name in self.groups["p"])
        return Sample(p, repr(float(self.state["t"])), arrays, tuple(r for r in results if r is not None))


class _Search:
    """Chooses states that exercise the statements that samples leave out."""

    def __init__(self, whole: Mapping[str, tuple[Tape, Tape | None]], groups: Mapping[str, Sequence[str]],
                 defaults: Mapping[str, float], calls: Mapping[str, str], stream: random.Random) -> None:
        self.whole, self.groups, self.defaults, self.calls, self.stream = whole, groups, defaults, calls, stream
        self.names = ["t", *(n for group in STATE_GROUPS for n in groups[group])]
        self.wanted = {name: statements([tape for tape in pair if tape is not None]) for name, pair in whole.items()}

    def completed(self, first: Sequence[Sample]) -> Reference:
        """The first samples and those that were chosen."""
        left = {name: set(wanted) for name, wanted in self.wanted.items()}
        for sample in first:
            point = self._point_of(sample)
            for result in sample.results:
                left[result.name] -= self._effects(result.name, point, 1)[0]
        chosen = [*first, *self._with_fallback()]
        points = self._candidates()
        effects = {name: self._effects(name, points, len(points["t"])) for name in self.whole if left[name]}
        tried: set[int] = set()
        for _ in range(TRIED):
            gains = {k: sum(len(left[name] & effects[name][k]) for name in effects) for k in range(len(points["t"]))
                     if k not in tried}
            best = max(gains, key=gains.__getitem__, default=None)
            if best is None or not gains[best]:
                break
            tried.add(best)
            names = [name for name in effects if left[name] & effects[name][best]]
            there = {name: float(values[best]) for name, values in points.items()}
            made = _Point(self.groups, {n: there[n] for n in self.groups["p"]}, {n: there[n] for n in self.names}).sample(
                self.whole, self.calls, names)
            good = tuple(r for r in made.results if float(r.tolerance) <= COARSE)
            if good:
                chosen.append(Sample(made.p, made.t, made.arrays, good))
                for result in good:
                    left[result.name] -= effects[result.name][best]
        total = sum(map(len, self.wanted.values()))
        idle = {name: len(rest) for name, rest in left.items() if rest}
        checks = sum(len(deciding([tape for tape in pair if tape is not None])) for pair in self.whole.values())
        return Reference(tuple(chosen), total, total - sum(idle.values()), checks, idle)

    def _with_fallback(self) -> list[Sample]:
        """States for the functions that have a singular fallback, in their regular case."""
        names = [name for name, (_, singular) in self.whole.items() if singular is not None]
        made = []
        for _ in range(WITH_FALLBACK if names else 0):
            usual = {n: self.defaults.get(n, 1.0) for n in self.groups["p"]}
            point = _Point(self.groups, _varied(self.stream, usual), _state(self.stream, self.groups))
            sample = point.sample({name: (self.whole[name][0], None) for name in names}, self.calls)
            if sample.results:
                made.append(sample)
        return made

    def _point_of(self, sample: Sample) -> dict[str, np.ndarray]:
        values = {"t": sample.t, **dict(zip(self.groups["p"], sample.p))}
        for group, numbers in sample.arrays:
            values |= dict(zip(self.groups[group], numbers))
        return {name: np.array([float(value)]) for name, value in values.items()}

    def _effects(self, name: str, points: Mapping[str, np.ndarray], n: int) -> list[set[Any]]:
        """The statements of a function that each point exercises, in the tape that is used there; none where the function
        calls another one that has no text in Python."""
        regular, singular = self.whole[name]
        try:
            rows = Rows(regular, points, n)
        except UnsupportedExpression:
            return [set() for _ in range(n)]
        holds = np.ones(n, dtype=bool)
        for node in rows.checked:
            holds &= rows.margin(node) > 0
        result = {key: value & holds for key, value in rows.exercised().items()}
        if singular is not None:
            there = {key: value & ~holds for key, value in Rows(singular, points, n).exercised().items()}
            result |= {key: value | result.get(key, np.zeros(n, dtype=bool)) for key, value in there.items()}
        return [{key for key, value in result.items() if value[k]} for k in range(n)]

    def _candidates(self) -> dict[str, np.ndarray]:
        """Random points of several sizes with varied parameters, and points where a divisor with a singular fallback vanishes."""
        rows = []
        for k in range(CANDIDATES):
            point = _state(self.stream, self.groups, (1.0, math.pi, 10.0)[k % 3])
            if k % 4 == 3:  # each number with a size of its own: parts of functions far from, or next to, zero
                point |= {n: math.copysign(10 ** self.stream.uniform(-4, 3), v) for n, v in point.items() if n != "t"}
                point["t"] = 10 ** self.stream.uniform(-2, 2)
            usual = {n: self.defaults.get(n, 1.0) for n in self.groups["p"]}
            rows.append(point | (usual if k % 3 == 2 else _varied(self.stream, usual)))
        points = {name: np.array([row[name] for row in rows]) for name in rows[0]}
        known: set[Node] = set()
        extra = []
        for regular, singular in self.whole.values():
            if singular is not None:
                extra.append(singular_states(regular, points, CANDIDATES, known))
                known.update(regular.steps)
        return {name: np.concatenate([values, *[more[name] for more in extra]]) for name, values in points.items()}


def result_at(name: str, tape: Tape, values: Mapping[str, Any], call: str) -> ReferenceResult | None:
    """A function at a state; None where it is not defined."""
    pivots = [n.args[1] if n.op == "guard" else n for n in tape.steps if n in tape.recorder.checks and n.op != "call"]
    checked = Tape(tape.recorder, {**tape.outputs, "": Output.of("", pivots)})
    try:
        exact, positive = (r.ravel() for r in evaluate(checked, values, DIGITS).values())
        double = next(iter(evaluate(tape, values, 16).values())).ravel()
        # Numeric algorithms regularize in floats what they solve at more digits.
        floats = next(iter(evaluate_rows(tape, values, 1).values())).ravel()
    except (ArithmeticError, ValueError, TypeError, UnsupportedExpression):  # also comparisons of complex numbers
        return None
    if not all(hasattr(e, "_mpf_") and mpmath.isfinite(e) for e in [*exact, *positive]) or any(e <= 0 for e in positive):
        return None
    scale = max((abs(float(e)) for e in exact), default=0.0) or 1.0
    lost = max((abs(float(a - b)) / scale for result in (double, floats) for a, b in zip(exact, result, strict=True)),
               default=0.0)
    if not lost < 1.0:
        return None
    # A power of ten, since the digits of what is lost depend on the processor, and written modules must not.
    tolerance = f"{10.0 ** max(-12, math.ceil(math.log10(20 * lost)) if lost else -12):.0e}"
    return ReferenceResult(name, len(exact), tuple(repr(float(e)) for e in exact), tolerance, call)
