"""Bounds of what vanishes at events, over parts of a motion, from bounds of the state, the time and the inputs there."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import sympy as sp
from sympy.core.function import AppliedUndef

from symdyn.formulation.equations import Equations
from symdyn.formulation.names import BOUNDS, RANGES
from symdyn.model.symbols import parts_of
from symdyn.tape.external import Result, UserFunction
from symdyn.tape.intervals import Interval, Jet, encloses, enclosures
from symdyn.tape.node import ACCELERATION, INPUT, PARAMETER, Node
from symdyn.tape.tape import Tape, reachable

# Functions that can make no pulse far narrower than their argument's own changes.
_EVEN = (sp.sin, sp.cos, sp.sinh, sp.cosh, sp.asinh, sp.log)
# Bounds of a leaf in their order: value, derivative and second derivative by the place within the part, from and to.
_ENDS = ("least", "most", "least rate", "most rate", "least bend", "most bend")


def enclosed(equations: Equations) -> list[bool]:
    """Mask of the events that can be enclosed."""
    if not equations.events:
        return []
    ways = [equations] if equations.singular_fallback is None else [equations, equations.singular_fallback]
    return [all(encloses(way.recorder, way.quantity("events")[k]) for way in ways) for k in range(len(equations.events))]


def unproved(equations: Equations) -> list[str]:
    """Functions that can make narrow pulses in the expression of every event that is not enclosed; else ""."""
    parameters = set(equations.symbols.parameters)
    return ["" if can else _steep(event.value, parameters)
            for can, event in zip(enclosed(equations), equations.events, strict=True)]


def _steep(expression: sp.Expr, parameters: set[sp.Symbol]) -> str:
    result, known = set(), dict[sp.Basic, bool]()

    def is_fixed(part: sp.Basic) -> bool:
        """Whether parameters alone stand in it; parts that stand in many others are looked at once."""
        if part not in known:
            known[part] = all(is_fixed(a) for a in part.args) if part.args else part.free_symbols <= parameters
        return known[part]

    for part in parts_of(expression):
        if is_fixed(part):
            continue
        if isinstance(part, sp.Pow) and not (part.exp.is_number and part.exp.is_positive):
            result.add("a quotient" if part.exp.is_number else "a power")
        elif isinstance(part, sp.Function) and not isinstance(part, (*_EVEN, AppliedUndef, Result)):
            result.add(str(part.func))
    return f"{', '.join(sorted(result))} of what is only sampled" if result else ""


def event_leaves(equations: Equations) -> list[int]:
    """Arguments of the events that can be enclosed: 0 for t, then the entries of x = [q; u; z], then the inputs."""
    indices = {name: k for k, name in enumerate(_leaf_names(equations))}
    ways = [equations] if equations.singular_fallback is None else [equations, equations.singular_fallback]
    values = [entry for way in ways for entry in _values(way, enclosed(equations))]
    return sorted({indices[leaf.args[1]] for leaf in _moving(values)})


def bound_names(leaves: Sequence[int]) -> list[str]:
    """Entries of the group ud of the function."""
    return [f"({end} {k})" for k in leaves for end in _ENDS]


def event_bounds(equations: Equations, name: str) -> Tape:
    """BOUNDS of the values at events, (n_e, 6): from and to of each value, its derivative and its second derivative, or RANGES,
    (n_e, 2), of the values alone, with the rounding of their operations; of those that cannot be enclosed zeros."""
    recorder, can = equations.recorder, enclosed(equations)
    values = _values(equations, can)
    indices = {name: k for k, name in enumerate(_leaf_names(equations))}

    def jet(leaf: Node) -> Jet:
        ends = [recorder.leaf(name, ACCELERATION) for name in bound_names([indices[leaf.args[1]]])]
        return Jet(*[Interval(*ends[k:k + 2]) for k in (0, 2, 4)])

    with recorder.section("bounds of the events"):
        result = iter(enclosures(recorder, values, {leaf: jet(leaf) for leaf in _moving(values)}, rounded=name == RANGES))
        rows = np.zeros((len(can), 6), dtype=object)
        for k in np.flatnonzero(can):
            rows[k] = [end for interval in next(result) for end in interval]
    return Tape.of(recorder, **{name: rows if name == BOUNDS else rows[:, :2]})


def unknowns(equations: Equations) -> list[tuple[list[str], list[str]]]:
    """Inputs and functions of the user that the value of every event depends on, but for those in equations that are solved for
    it."""
    if not equations.events:
        return []
    recorder, values = equations.recorder, equations.quantity("events")
    known: dict[Node, frozenset[str | UserFunction]] = {}
    for node in reachable(values):
        if node.op == "leaf":
            known[node] = frozenset([node.args[1]] if node.mask & INPUT else [])
            continue
        own = [a for a in node.args[:1] if isinstance(a, UserFunction)]
        solved = not own and (node.op in ("call", "guard") or node in recorder.checks)
        known[node] = frozenset() if solved else frozenset(own).union(*{known[a] for a in node.args if isinstance(a, Node)})
    result = [known.get(entry, frozenset()) for entry in values]
    return [(sorted(one for one in names if isinstance(one, str)),
             sorted({one.signature for one in names if not isinstance(one, str)})) for names in result]


def _leaf_names(equations: Equations) -> list[str]:
    s = equations.symbols
    return ["t", *[one.name for one in (*s.coordinates, *s.speeds, *s.states, *s.inputs)]]


def _values(equations: Equations, can: Sequence[bool]) -> list[Any]:
    return [entry for entry, one in zip(equations.quantity("events"), can, strict=True) if one] if can else []


def _moving(values: Sequence[Any]) -> list[Node]:
    return [node for node in reachable(values) if node.op == "leaf" and node.mask & ~PARAMETER]
