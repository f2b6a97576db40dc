"""Evaluate a tape in double precision at many points at once, without generating code."""

from __future__ import annotations

from collections.abc import Callable, Mapping
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
    missing = [leaf.args[1] for leaf in tape.inputs if leaf.args[1] not in values]
    if missing:
        raise KeyError(f"no value for {', '.join(missing)}")
    with np.errstate(all="ignore"):
        done = walk(tape.steps, Arrays(values))
    result = {}
    for name, output in tape.outputs.items():
        flat = np.tile(output.numbers, (n, 1))
        for k, node in output.nodes:
            flat[:, k] = done[node]
        result[name] = flat.reshape((n, *output.shape))
    return result


class Slopes:
    """What the table of operations asks of a recorder for derivatives, on arrays."""

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
