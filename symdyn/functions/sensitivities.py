"""The functions of a right-hand side that integrates sensitivities along with the state, a column for each.

Column j is the derivative of x = [q; u; z] by what it is called after: a parameter, a constant input, or an initial value, "".
Its entries stand behind the extra states z, one column after the other.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from symdyn.backend.columns import Group, MotionColumns
from symdyn.formulation.adjoint import weight_names
from symdyn.formulation.equations import Equations, Symbols
from symdyn.formulation.names import ADJOINT, rate_of, variation_of
from symdyn.formulation.sensitivities import LATER, carried_names, direction_names, indices_of_resets
from symdyn.functions.table import CARRIED, CORRECTED, CORRECTED_WEIGHTS, OF_EVENTS, OF_RESETS, WEIGHTS
from symdyn.spatial.vectors import vector
from symdyn.tape.differentiate import reverse, seed_name
from symdyn.tape.node import ACCELERATION, INPUT, PARAMETER, SEED, STATE
from symdyn.tape.passes import substitute
from symdyn.tape.tape import Output, Tape


def column_names(symbols: Symbols, sensitivities: Sequence[str]) -> list[str]:
    """Names of the entries of all columns, which are extra states; no symbol can have them."""
    states = [s.name for s in (*symbols.coordinates, *symbols.speeds, *symbols.states)]
    return [f"(d {x} by {k + 1} {by})" for k, by in enumerate(sensitivities) for x in states]


def held_names(sensitivities: Sequence[str], held: Sequence[str]) -> list[str]:
    """Names of the derivatives of inputs along all columns, which are extra parameters, or extra inputs of those that follow the
    state."""
    return [f"(d {name} by {k + 1})" for k in range(len(sensitivities)) for name in held]


def functions_of(equations: Equations) -> tuple[str, ...]:
    """The functions that a run with sensitivities needs besides those of any run."""
    names = [CORRECTED] if equations.constraints or equations.unit_groups else []
    further = {OF_EVENTS: "events", OF_RESETS: "event_resets", CARRIED: variation_of("carried")}
    return (*names, *[name for name, quantity in further.items() if quantity in equations.quantities])


def given_to_carry(equations: Equations, sensitivities: Sequence[str]) -> list[str]:
    """Names of what CARRIED takes besides the state after a reset and the columns that are wanted: jumps of the speeds, impulses,
    and by how much the event comes later along every column."""
    held = indices_of_resets(equations.symbols, equations.events)
    return [*carried_names(equations.symbols.speeds, len(held)), *_later_names(sensitivities)]


def _later_names(sensitivities: Sequence[str]) -> list[str]:
    return [f"({k + 1} later)" for k in range(len(sensitivities))]


def adjoints_of(equations: Equations) -> tuple[str, ...]:
    """The functions that a run backwards needs besides those of the run."""
    return (WEIGHTS, *([CORRECTED_WEIGHTS] if equations.constraints or equations.unit_groups else ()))


def tape_of(equations: Equations, name: str, sensitivities: Sequence[str], held: Sequence[str] = (),
            followed: Sequence[str] = ()) -> Tape:
    """The tape of rhs, or of one of the functions above, with these columns, along which inputs that are held, or that follow the
    state, change, too."""
    columns = _columns(equations, sensitivities, held, followed)
    if name == "rhs":
        # As a matrix where many directions share it: measured, the counts meet where there are half as many as states.
        way = "rhs_variation_by_matrix" if 2 * len(columns) > len(columns[0]["x"]) else "rhs_variation"
        parts = [equations.quantity("rhs"), *[_with(equations, way, column) for column in columns]]
        return _tape(equations, name, np.concatenate(parts))
    if name == CORRECTED:
        return _tape(equations, name, np.concatenate([_with(equations, variation_of("corrected"), _normal(equations, column))
                                                      for column in columns]))
    if name == CARRIED:
        later = [equations.recorder.leaf(name, ACCELERATION) for name in _later_names(sensitivities)]
        return _tape(equations, name, np.concatenate([_with(equations, variation_of("carried"), column, then)
                                                      for column, then in zip(columns, later, strict=True)]))
    of = "events" if name == OF_EVENTS else "event_resets"
    parts = [equations.quantity(rate_of(of)), *[_with(equations, variation_of(of), column) for column in columns]]
    return _tape(equations, name, np.array(parts, dtype=object).T)


def motion_columns(equations: Equations, sensitivities: Sequence[str], held: Sequence[str]) -> MotionColumns:
    """The right-hand side with these columns as x_dot and its derivative along a direction, the same code for every column."""
    symbols, recorder = equations.symbols, equations.recorder
    states = [s.name for s in (*symbols.coordinates, *symbols.speeds, *symbols.states)]
    by = dict.fromkeys(name for name in sensitivities if name and name not in held)
    moving = [*states, *held, *by]
    seeds = {name: recorder.leaf(seed_name(name), SEED) for name in moving}
    given = [*states, *[s.name for s in (*symbols.inputs, *symbols.parameters)]]
    leaves = [recorder.leaf(name, ACCELERATION) for name in direction_names(symbols)]
    at = {leaf: seeds.get(name, 0) for leaf, name in zip(leaves, given, strict=True)}
    along = substitute(tuple(equations.quantity("rhs_variation")), at, recorder)
    tape = _tape(equations, "rhs", vector(*equations.quantity("rhs"), *along))
    groups = (Group("columns", tuple(map(seed_name, moving)), 0),)
    return MotionColumns(tape, groups, (len(along),), len(sensitivities), len(held),
                         tuple(moving.index(name) if name in by else None for name in sensitivities))


def adjoint_tape_of(equations: Equations, name: str, by: Sequence[str]) -> Tape:
    """The tape of an adjoint: from weights of x_dot, or of the projected state, to those of x and of what `by` names."""
    symbols, recorder = equations.symbols, equations.recorder
    n_x = len(symbols.coordinates) + len(symbols.speeds) + len(symbols.states)
    given = [s.name for s in (*symbols.inputs, *symbols.parameters)]
    if name == WEIGHTS:
        result = list(equations.quantity(ADJOINT))
    else:
        leaves = [recorder.leaf(name, ACCELERATION) for name in direction_names(symbols)]
        moved = _with(equations, variation_of("corrected"), _normal(equations, {"x": leaves[:n_x], "by": leaves[n_x:]}))
        n_qu = len(moved)
        weights = [recorder.leaf(name, ACCELERATION) for name in weight_names(n_x)]
        total = sum((w * e for w, e in zip(weights, [*moved, *leaves[n_qu:n_x]], strict=True)), 0)
        result = reverse(recorder, total, leaves)
    return _tape(equations, name, vector(*result[:n_x], *[result[n_x + given.index(one)] for one in by]))


def _tape(equations: Equations, name: str, values: np.ndarray) -> Tape:
    return Tape(equations.recorder, {name: Output.of(name, values)})


def _columns(equations: Equations, sensitivities: Sequence[str], held: Sequence[str],
             followed: Sequence[str]) -> list[dict[str, Any]]:
    """Values that stand for the direction in each column x, the leaves of its entries, and in all, by name."""
    symbols, recorder = equations.symbols, equations.recorder
    n_x = len(symbols.coordinates) + len(symbols.speeds) + len(symbols.states)
    leaves = [recorder.leaf(name, STATE) for name in column_names(symbols, sensitivities)]
    given = [s.name for s in (*symbols.inputs, *symbols.parameters)]
    along = {name: recorder.leaf(name, kind) for names, kind in ((held, PARAMETER), (followed, INPUT))
             for name in held_names(sensitivities, names)}
    return [{"x": leaves[k * n_x:(k + 1) * n_x], "by": [along.get(f"(d {name} by {k + 1})", int(name == by)) for name in given]}
            for k, by in enumerate(sensitivities)]


def _with(equations: Equations, quantity: str, column: dict[str, Any], later: Any = 0) -> np.ndarray:
    """A derivative along a direction, along a column; later: the direction of t."""
    recorder = equations.recorder
    leaves = [recorder.leaf(name, ACCELERATION) for name in direction_names(equations.symbols)]
    at = {recorder.leaf(LATER, ACCELERATION): later, **dict(zip(leaves, [*column["x"], *column["by"]], strict=True))}
    return vector(*substitute(tuple(equations.quantity(quantity)), at, recorder))


def _normal(equations: Equations, column: dict[str, Any]) -> dict[str, Any]:
    """The column without changes of the length of what has unit length."""
    symbols, x = equations.symbols, list(column["x"])
    indices = {s: k for k, s in enumerate(symbols.coordinates)}
    for group in equations.unit_groups:
        unit, at = [equations.leaves[q] for q in group], [indices[q] for q in group]
        longer = sum((e * x[k] for e, k in zip(unit, at, strict=True)), 0)
        for e, k in zip(unit, at, strict=True):
            x[k] = x[k] - e * longer
    return {**column, "x": x}
