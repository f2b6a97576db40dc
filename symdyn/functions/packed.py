"""The derivative of x_dot by x where most of its entries are zero: the others one after the other, and where they stand."""

from __future__ import annotations

from typing import Any
from weakref import WeakKeyDictionary

import numpy as np

from symdyn.backend.band import Band
from symdyn.backend.methods import method_of
from symdyn.backend.packed import NAME, Pattern
from symdyn.formulation.equations import Equations
from symdyn.tape.differentiate import reverse
from symdyn.tape.node import Node
from symdyn.tape.tape import Output, Tape, reachable

# Results for equations that are still in use: the search for the function, its text and its reader each need them.
_found: WeakKeyDictionary[Equations, Pattern | None] = WeakKeyDictionary()


def pattern(equations: Equations) -> Pattern | None:
    """Where x_dot depends on x, by the statements; None where a numeric algorithm solves for some of it, at some states."""
    if equations not in _found:
        _found[equations] = None if equations.singular_fallback is not None else _looked_for(equations)
    return _found[equations]


def band(equations: Equations, method: str, baumgarte: bool = False, work: bool = False) -> Band | None:
    """The order of elimination of an implicit method, where factors in it take less work than those of the whole matrix; None
    where they do not, or for other methods.

    baumgarte, work   as in symdyn.backend.right_side.RightSide; Baumgarte's method changes the pattern
    """
    if baumgarte or "jacobian_x" not in method_of(method).needs:
        return None
    there = pattern(equations)
    if there is None:
        return None
    return (there.with_work() if work else there).band if there.band.pays else None


def _looked_for(equations: Equations) -> Pattern | None:
    entries = equations.quantity("rhs").tolist()
    bits = {node: 1 << k for k, node in enumerate(_leaves(equations)) if node is not None}
    for node in reachable(entries):
        if node.op == "call":
            return None
        bits.setdefault(node, 0)
        for a in node.args:
            if isinstance(a, Node):
                bits[node] |= bits[a]
    needs = [bits[e] if isinstance(e, Node) else 0 for e in entries]
    result = [[k for k, bit in enumerate(reversed(bin(need)[2:])) if bit == "1"] for need in needs]
    rows = np.repeat(np.arange(len(entries)), [len(row) for row in result])
    columns = np.array([k for row in result for k in row], dtype=int)
    return Pattern(len(entries), rows, columns, len(equations.symbols.coordinates))


def packed_tape(equations: Equations) -> Tape:
    """The entries of the pattern, row by row; each row is differentiated by itself, since it needs few of the statements."""
    there = pattern(equations)
    assert there is not None
    leaves, recorder, entries = _leaves(equations), equations.recorder, equations.quantity("rhs").tolist()
    values: list[Any] = []
    for k, entry in enumerate(entries):
        values += reverse(recorder, entry, [leaves[c] for c in there.columns[there.rows == k]])
    return Tape(recorder, {NAME: Output.of(NAME, np.array(values, dtype=object))})


def _leaves(equations: Equations) -> list[Any]:
    """Leaf that stands for every state; None where nothing depends on it."""
    symbols = equations.symbols
    known = {node.args[1]: node for node in reachable(equations.quantity("rhs").tolist()) if node.op == "leaf"}
    return [known.get(s.name) for s in (*symbols.coordinates, *symbols.speeds, *symbols.states)]
