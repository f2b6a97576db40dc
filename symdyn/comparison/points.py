"""Values of expressions at random points, at high precision."""

from __future__ import annotations

import random
from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import cached_property, partial
from typing import Any

import mpmath
import sympy as sp

from symdyn.model.symbols import symbols_of
from symdyn.tape.evaluate import evaluate
from symdyn.tape.recorder import Recorder
from symdyn.tape.sympy_bridge import record_expression
from symdyn.tape.tape import Tape

DIGITS = 50
# Draws until enough points lie where the expressions have real values.
TRIES = 120
SEED = 20101
# Distances from zero: near points lie inside the ranges of roots and arc functions, far ones see where an angle leaves its own.
NEAR, FAR = (0.2, 1.3), (1.5, 7.0)
# Far outside of NEAR and FAR: constants that are small or large next to a symbol show here.
TINY, HUGE = (-9, -1), (1, 6)
# Values near which formulas change their form or lose digits, and the powers of ten of the distances from them.
SPECIAL = ("1/2", "1", "2", "pi/6", "pi/4", "pi/3", "pi/2", "pi", "2*pi")
DISPLACED = (-9, -3)
# A difference that is rounding vanishes with twice the digits.
REMAINDER = 1e-20


def context(digits: int = DIGITS) -> Any:
    """An mpmath context of its own."""
    own = mpmath.mp.clone()
    own.dps = digits
    return own


class Expressions:
    """Expressions on a tape of their own, evaluated at points {name: number}."""

    def __init__(self, expressions: Sequence[sp.Expr]) -> None:
        recorder = Recorder()
        self.names = sorted({s.name for e in expressions for s in symbols_of(e)})
        leaves = {name: recorder.leaf(name, 0) for name in self.names}
        memory: dict[sp.Basic, Any] = {}
        nodes = [record_expression(recorder, e, {s: leaves[s.name] for s in symbols_of(e)}, memory) for e in expressions]
        self.tape = Tape.of(recorder, values=nodes)
        self._alone = [partial(Tape.of, recorder, values=[node]) for node in nodes]

    @cached_property
    def alone(self) -> list[Tape]:
        """A tape for each expression."""
        return [made() for made in self._alone]

    def at(self, point: Mapping[str, Any], digits: int = DIGITS) -> list[Any]:
        """Real values, None where an expression has none."""
        together = _values(self.tape, point, digits)
        if together is None:
            together = [(_values(tape, point, digits) or [None])[0] for tape in self.alone]
        return [None if v is None or isinstance(v, bool) or hasattr(v, "_mpc_") or not abs(v) < mpmath.inf else v
                for v in together]


def _values(tape: Tape, point: Mapping[str, Any], digits: int) -> list[Any] | None:
    """None where one of the expressions orders complex numbers or leaves the range of a function."""
    try:
        return evaluate(tape, point, digits)["values"].tolist()  # type: ignore[no-any-return]
    except (TypeError, ValueError, OverflowError, AttributeError):
        return None


def points(symbols: Iterable[sp.Symbol], seed: int = SEED) -> Iterator[dict[str, Any]]:
    """Random points, always the same, each followed by its mirror image, where all symbols but positive ones change their signs.

    Points with all symbols near zero and with all symbols far from it take turns.
    """
    own = context()
    stream = random.Random(seed)
    ordered = sorted({s.name: s for s in symbols}.items())
    for k in range(TRIES):
        least, most = map(own.mpf, (NEAR, FAR)[k % 2])
        point, mirror = {}, {}
        for name, symbol in ordered:
            x = own.mpf(stream.getrandbits(160)) / 2**160
            size = least + (most - least) * x
            sign = 1 if symbol.is_positive else stream.choice((1, -1))
            point[name] = sign * size
            mirror[name] = size if symbol.is_positive else -sign * size
        yield point
        if any(not symbol.is_positive for _, symbol in ordered):
            yield mirror


def wide_points(symbols: Iterable[sp.Symbol], seed: int = SEED + 1) -> Iterator[dict[str, Any]]:
    """Random points at other scales, always the same, each followed by its mirror image as in `points`.

    Four kinds take turns: every symbol from 1e-9 to 0.1 in size; from 10 to 1e6; each with a power of ten of its own between 1e-9
    and 1e6; each at a distance of 1e-9 to 1e-3 from a value such as 1, pi/2 or pi.
    """
    own = context()
    stream = random.Random(seed)
    ordered = sorted({s.name: s for s in symbols}.items())
    special = [own.mpf(value.p) / value.q if value.is_Rational else own.pi * own.mpf((value / sp.pi).p) / (value / sp.pi).q
               for value in map(sp.sympify, SPECIAL)]

    def power(least: int, most: int) -> Any:
        return own.mpf(10) ** (least + (most - least) * own.mpf(stream.getrandbits(160)) / 2**160)

    for k in range(TRIES):
        kind = k % 4
        point, mirror = {}, {}
        for name, symbol in ordered:
            size = (power(*TINY) if kind == 0 else power(*HUGE) if kind == 1 else power(TINY[0], HUGE[1]) if kind == 2
                    else stream.choice(special) + stream.choice((1, -1)) * power(*DISPLACED))
            sign = 1 if symbol.is_positive else stream.choice((1, -1))
            point[name], mirror[name] = sign * size, size if symbol.is_positive else -sign * size
        yield point
        if any(not symbol.is_positive for _, symbol in ordered):
            yield mirror
