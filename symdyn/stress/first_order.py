"""First-order bounds of rounding errors: every operation of a tape rounds once, and one reverse pass gives what that does to each
result.

A result y of operations v_i = f_i(...), each computed as v_i (1 + d_i) with |d_i| <= k_i eps, is off by sum_i (dy/dv_i) v_i d_i
but for products of d's; at most by eps sum_i k_i |dy/dv_i| |v_i|. The bound grows towards singular positions as rounding errors
do. Source: Linnainmaa, Taylor expansion of the accumulated rounding error, BIT 16 (1976); Higham, Accuracy and Stability of
Numerical Algorithms, 2nd ed., section 3.3 and chapter 26.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np

from symdyn.stress.system_under_test import EPS
from symdyn.tape.floats import Arrays, Slopes
from symdyn.tape.node import Node
from symdyn.tape.ops import OPERATIONS
from symdyn.tape.tape import Tape, reachable
from symdyn.tape.walk import walk

# Half units in the last place that sines and cosines, and other functions, are off by: of C's library and symdyn's own (the GNU C
# library's manual, "Known Maximum Errors in Math Functions"; templates/c/runtime/sincos.h), and of NumPy's vector instructions.
LIBRARY = {"c": (2.0, 4.0), "numpy": (8.0, 8.0)}
# Underflow loses a number of this size.
TINY = 2.0**-1074
# Relative changes of divisors by rounding from which on products of changes count.
HIGHER_ORDER = 0.1
# Numbers that are kept of one operation: results by states.
BLOCK = 200_000
ROUNDED = ("add", "mul", "div", "sqrt", "trig", "function")


@dataclass(frozen=True)
class FirstOrder:
    """Bounds of what rounding errors do to results at states.

    arithmetic, trig, function   shares (n, size) of + - * / and roots, and of sines and cosines and of other functions for each
                                 half unit in the last place that they are off by
    divisors   (n,), the largest relative change of a divisor or of what a root is taken of, that counts in any result
    failed     (n,), whether a check of the tape fails, so that generated code does not use it
    """

    arithmetic: np.ndarray
    trig: np.ndarray
    function: np.ndarray
    divisors: np.ndarray
    failed: np.ndarray

    def of(self, backend: str) -> np.ndarray:
        """The bound (n, size) for code of a backend."""
        trig, function = LIBRARY[backend]
        return self.arithmetic + trig * self.trig + function * self.function  # type: ignore[no-any-return]


def first_order(tape: Tape, values: Mapping[str, Any], n: int) -> FirstOrder:
    """Bounds of all entries of a tape's outputs at n states; infinite for those that need an algorithm that is not written out.

    values   leaf name -> a number, or an array (n,)
    """
    with np.errstate(all="ignore"):
        return _Pass(tape, values, n).found()


class _Pass:
    def __init__(self, tape: Tape, values: Mapping[str, Any], n: int) -> None:
        self.tape, self.n = tape, n
        self.value = walk(tape.steps, Arrays(values))
        self.partials: dict[Node, tuple] = {}
        self.used: dict[Node, np.ndarray] = {}

    def number(self, value: Any) -> Any:
        return self.value.of(value)

    def found(self) -> FirstOrder:
        entries = [e for output in self.tape.outputs.values() for e in output.entries]
        parts = self.bounds(entries)
        divisors = [node for node in self.used if node.op != "leaf"]
        used = dict(self.used)
        relative = np.zeros(self.n)
        for divisor, bound in zip(divisors, np.sum(self.bounds(divisors), axis=0).T, strict=True):
            change = bound / np.abs(self.value[divisor])
            relative = np.fmax(relative, np.where(used[divisor], np.where(np.isnan(change), np.inf, change), 0.0))
        return FirstOrder(parts[0], parts[1], parts[2], relative, self.failed())

    def failed(self) -> np.ndarray:
        failed = np.zeros(self.n, dtype=bool)
        for node in self.tape.steps:
            if node in self.tape.recorder.checks and node.op != "call":
                failed |= ~(self.number(node.args[1] if node.op == "guard" else node) > 0)
        return failed

    def bounds(self, entries: Sequence[Any]) -> list[np.ndarray]:
        """Shares of arithmetic, sines and cosines, and other functions, each (n, number of entries)."""
        shares = [np.zeros((self.n, len(entries))) for _ in range(3)]
        step = max(1, BLOCK // max(self.n, 1))
        for first in range(0, len(entries), step):
            self.block(list(entries[first:first + step]), [share[:, first:first + step].T for share in shares])
        return shares

    def block(self, entries: list[Any], shares: list[np.ndarray]) -> None:
        """Add up shares (number of entries, n), from the last operation to the first."""
        bars: dict[Node, np.ndarray] = {}
        for k, entry in enumerate(entries):
            if isinstance(entry, Node):
                bars.setdefault(entry, np.zeros((len(entries), self.n)))[k] = 1.0
            else:
                shares[0][k] += _of_number(entry)
        for node in reversed(reachable(entries)):
            bar = bars.pop(node, None)
            if bar is None or node.op == "leaf":
                continue
            if node.op == "item":
                shares[0] += np.where(bar != 0, np.inf, 0.0)
                continue
            kind = OPERATIONS[node.op].kind
            if kind in ROUNDED:
                share = shares[1 if kind == "trig" else 2 if kind == "function" else 0]
                share += EPS * _times(np.abs(bar), np.abs(self.value[node]) + (TINY / EPS if kind != "add" else 0.0))
            if OPERATIONS[node.op].partials is None:
                continue
            for a, slope in zip(node.args, self.slopes(node), strict=True):
                if isinstance(slope, int) and slope == 0:
                    continue
                if isinstance(a, Node):
                    if a in bars:
                        bars[a] += _times(bar, slope)
                    else:
                        bars[a] = _times(bar, slope)
                elif not isinstance(a, bool) and _of_number(a):
                    shares[0] += np.abs(_times(bar, slope)) * _of_number(a)
            if node.op in ("div", "sqrt") and isinstance(node.args[-1], Node):
                divisor = node.args[-1]
                self.used[divisor] = self.used.get(divisor, np.zeros(self.n, dtype=bool)) | (bar != 0).any(axis=0)

    def slopes(self, node: Node) -> tuple:
        """Derivatives by each argument."""
        if node not in self.partials:
            rule = OPERATIONS[node.op].partials
            assert rule is not None
            slopes = rule(Slopes, self.value[node], tuple(self.number(a) for a in node.args))
            self.partials[node] = tuple(s if isinstance(s, int) else np.asarray(s, dtype=float) for s in slopes)
        return self.partials[node]


def _times(bar: np.ndarray, slope: Any) -> np.ndarray:
    """The product; nothing of nothing, also where a branch that is not taken has no number."""
    product = bar * slope
    if not np.isfinite(np.sum(product)):
        product = np.where(bar == 0, 0.0, product)
    return product  # type: ignore[no-any-return]


def _of_number(value: Any) -> float:
    """Error of the double that stands for a number."""
    return 0.0 if isinstance(value, bool) or Fraction(float(value)) == value else EPS * abs(float(value))
