"""Evaluate a tape in double precision at many points at once, without generating code."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from symdyn.tape.node import Node
from symdyn.tape.ops import OPERATIONS
from symdyn.tape.tape import Tape
from symdyn.tape.walk import Arithmetic, walk


def evaluate_rows(tape: Tape, values: Mapping[str, Any], n: int) -> dict[str, np.ndarray]:
    """All outputs of the tape at n points, as arrays (n, ...).

    values   leaf name -> a number, or an array (n,); what is not defined at a point (log of a negative number) is NaN there
    Raises KeyError naming the inputs that have no value.
    """
    return {name: entries.dense() for name, entries in evaluate_entries(tape, values, n).items()}


@dataclass(frozen=True)
class Entries:
    """Entries of an output of a tape that are not zero by structure: indices (e,) in it, ascending, row by row, and values
    (n, e) at n points."""

    shape: tuple[int, ...]
    indices: np.ndarray
    values: np.ndarray

    def dense(self) -> np.ndarray:
        """(n, ...)"""
        flat = np.zeros((len(self.values), math.prod(self.shape)))
        flat[:, self.indices] = self.values
        return flat.reshape((len(flat), *self.shape))


def evaluate_entries(tape: Tape, values: Mapping[str, Any], n: int) -> dict[str, Entries]:
    """The same as `evaluate_rows`, without the entries that are zero by structure."""
    missing = [leaf.args[1] for leaf in tape.inputs if leaf.args[1] not in values]
    if missing:
        raise KeyError(f"no value for {', '.join(missing)}")
    with np.errstate(all="ignore"):
        done = walk(tape.steps, Arrays(values))
    result = {}
    for name, output in tape.outputs.items():
        numbers = output.numbers
        there = numbers != 0
        there[[k for k, _ in output.nodes]] = True
        indices = np.flatnonzero(there)
        entries = np.tile(numbers[indices], (n, 1))
        for column, (_, node) in zip(np.searchsorted(indices, [k for k, _ in output.nodes]), output.nodes, strict=True):
            entries[:, column] = done[node]
        result[name] = Entries(output.shape, indices, entries)
    return result


class Slopes:
    """Operations on arrays that the table of operations needs for derivatives."""

    @staticmethod
    def apply(op: str, *args: Any) -> Any:
        return FUNCTIONS[op](*args)

    @staticmethod
    def pow(base: Any, exponent: Any) -> Any:
        return np.power(base, exponent)

    @staticmethod
    def pi() -> float:
        return np.pi


def _erf(x: Any) -> Any:
    from scipy.special import erf

    return erf(x)


# Operation -> what computes it with NumPy's arrays.
FUNCTIONS: dict[str, Callable[..., Any]] = {
    **{op: getattr(np, row.numpy) for op, row in OPERATIONS.items() if row.numpy and op not in ("pi", "erf")},
    "guard": lambda value, margin: np.where(margin > 0, value, np.nan), "pi": lambda: np.pi, "erf": _erf}


class Arrays(Arithmetic):
    """Numbers and arrays (n,) of them, for values of the leaves by name."""

    functions = FUNCTIONS

    def __init__(self, values: Mapping[str, Any]) -> None:
        self.values = values

    def leaf(self, node: Node) -> Any:
        return np.asarray(self.values[node.args[1]], dtype=float)

    def number(self, value: Any) -> Any:
        return value if isinstance(value, bool) else float(value)

    def call(self, node: Node, args: list[Any]) -> Any:
        return np.moveaxis(node.args[0].rows(args), -1, 0)
