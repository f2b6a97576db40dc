"""Evaluate a tape in double precision at many points at once, without generating code."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from symdyn.tape.node import Node
from symdyn.tape.ops import OPERATIONS
from symdyn.tape.tape import Tape


def evaluate_rows(tape: Tape, values: Mapping[str, Any], n: int) -> dict[str, np.ndarray]:
    """All outputs of the tape at n points, as arrays (n, ...).

    values   leaf name -> a number, or an array (n,); what is not defined at a point (log of a negative number) is NaN there
    Raises KeyError naming the inputs that have no value.
    """
    missing = [leaf.args[1] for leaf in tape.inputs if leaf.args[1] not in values]
    if missing:
        raise KeyError(f"no value for {', '.join(missing)}")
    done: dict[Node, Any] = {}

    def number(value: Any) -> Any:
        return done[value] if isinstance(value, Node) else value if isinstance(value, bool) else float(value)

    with np.errstate(all="ignore"):
        for node in tape.steps:
            if node.op == "leaf":
                done[node] = np.asarray(values[node.args[1]], dtype=float)
            elif node.op == "call":
                done[node] = np.moveaxis(node.args[0].rows([number(a) for a in node.args[1:]]), -1, 0)
            elif node.op == "item":
                done[node] = done[node.args[0]][node.args[1]]
            else:
                done[node] = function_of(node.op)(*[number(a) for a in node.args])
    result = {}
    for name, output in tape.outputs.items():
        flat = np.empty((n, len(output.entries)))
        for k, e in enumerate(output.entries):
            flat[:, k] = number(e)
        result[name] = flat.reshape((n, *output.shape))
    return result


def function_of(op: str) -> Callable[..., Any]:
    """What computes an operation with NumPy's arrays."""
    if op == "guard":
        return lambda value, margin: np.where(margin > 0, value, np.nan)
    if op == "pi":
        return lambda: np.pi
    if op == "erf":
        from scipy.special import erf

        return erf  # type: ignore[no-any-return]
    return getattr(np, OPERATIONS[op].numpy)  # type: ignore[no-any-return]
