"""Values of expressions at random points, at high precision."""

from __future__ import annotations

import random
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

import mpmath
import sympy as sp

from symdyn.tape.evaluate import evaluate
from symdyn.tape.recorder import Recorder
from symdyn.tape.sympy_bridge import record_expression
from symdyn.tape.tape import Tape

DIGITS = 50
# Points that are drawn until enough of them lie where the expressions have real values.
TRIES = 60
SEED = 20101


def context(digits: int = DIGITS) -> Any:
    """An mpmath context of its own."""
    own = mpmath.mp.clone()
    own.dps = digits
    return own


class Expressions:
    """Expressions on a tape of their own, evaluated at points {name: number}."""

    def __init__(self, expressions: Sequence[sp.Expr]) -> None:
        recorder = Recorder()
        symbols = sorted({s.name for e in expressions for s in e.free_symbols})
        leaves = {name: recorder.leaf(name, 0) for name in symbols}
        memory: dict[sp.Basic, Any] = {}
        nodes = [record_expression(recorder, e, {s: leaves[s.name] for s in e.free_symbols}, memory) for e in expressions]
        self.names = symbols
        self.tape = Tape.of(recorder, values=nodes)

    def at(self, point: Mapping[str, Any], digits: int = DIGITS) -> list[Any]:
        """Real values, None where an expression has none."""
        try:
            values = evaluate(self.tape, point, digits)["values"].tolist()
        except (TypeError, ValueError, OverflowError):  # an order between complex numbers, a function outside its range
            return [None] * len(self.tape.outputs["values"].entries)
        return [None if isinstance(v, bool) or hasattr(v, "_mpc_") or not abs(v) < mpmath.inf else v for v in values]


def points(symbols: Iterable[sp.Symbol], seed: int = SEED) -> Iterator[dict[str, Any]]:
    """Random points, always the same: positive symbols from 0.3 to 1.7, others 0.2 to 1.3 away from zero."""
    own = context()
    stream = random.Random(seed)
    ordered = sorted({s.name: s for s in symbols}.items())
    for _ in range(TRIES):
        point = {}
        for name, symbol in ordered:
            x = own.mpf(stream.getrandbits(160)) / 2**160
            if symbol.is_positive:
                point[name] = own.mpf("0.3") + own.mpf("1.4") * x
            else:
                point[name] = (own.mpf("0.2") + own.mpf("1.1") * x) * stream.choice((1, -1))
        yield point
