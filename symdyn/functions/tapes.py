"""The tapes behind the functions of a module, as they are emitted."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from symdyn.backend.columns import Columns, Group
from symdyn.backend.packed import NAME as PACKED
from symdyn.backend.right_side import RightSide
from symdyn.formulation.adjoint import weight_names
from symdyn.formulation.constraints.motion import residual_names
from symdyn.formulation.derivatives import UNKNOWNS, along, curvature, curved, derivative, gradient, seeds_in, weighted
from symdyn.formulation.equations import Equations
from symdyn.formulation.event_bounds import bound_names, event_bounds, event_leaves
from symdyn.formulation.linearization import multiplier_names, variation_names
from symdyn.formulation.names import (
    ADJOINT,
    BOUNDS,
    BY,
    HESSIAN,
    HESSIAN_PRODUCT,
    RANGES,
    curvature_named,
    derivative_named,
    differentiated,
    outputs_in,
    second_named,
    stabilized,
)
from symdyn.formulation.sensitivities import LATER, carried_names, direction_names, indices_of_resets
from symdyn.functions import sensitivities as columns
from symdyn.functions.packed import packed_tape, pattern
from symdyn.functions.table import ADJOINTS, ALL, CARRIED, COLUMNS, DERIVATIVES, STATICS, VARIATIONS, WEIGHTS, quantity_of
from symdyn.tape.balance import balance
from symdyn.tape.jumps import Jump, jumps
from symdyn.tape.tape import Output, Tape


def has_function(equations: Equations, name: str) -> bool:
    """Whether the equations can give a function."""
    if second_named(name) is not None:
        return ADJOINT in equations.quantities
    twice = curvature_named(name)
    if twice is not None:
        return "C_dot" in equations.quantities if twice.of == "constraints" else has_function(equations, "outputs")
    result = derivative_named(name)
    if result is not None and name not in equations.quantities:
        return result.of in ALL and derivative_named(result.of) is None and has_function(equations, result.of)
    if name == "outputs":
        return bool(outputs_in(equations.quantities))
    if name == "switches":
        return bool(switches(equations))
    if name in (BOUNDS, RANGES):
        return bool(event_leaves(equations))
    if name == PACKED:
        return pattern(equations) is not None
    if name in COLUMNS:
        return name in columns.functions_of(equations)
    if name in ADJOINTS:
        return name in columns.adjoints_of(equations)
    return quantity_of(name) in equations.quantities


def switches(equations: Equations) -> list[Jump]:
    """Where the right-hand side may jump along a motion."""
    return jumps(equations.recorder, equations.quantity("rhs").tolist())


def function_tape(equations: Equations, name: str) -> Tape:
    """The tape behind a function of a module, as it is emitted."""
    return balance(tape_as_derived(equations, name))


def tape_as_derived(equations: Equations, name: str) -> Tape:
    """The quantities that a function of a module returns."""
    if name == "switches":
        surfaces = np.array([jump.surface for jump in switches(equations)], dtype=object)
        return Tape(equations.recorder, {name: Output.of(name, surfaces)})
    if name in (BOUNDS, RANGES):
        return event_bounds(equations, name)
    if name == PACKED:
        return packed_tape(equations)
    second = second_named(name)
    if second is not None:
        return Tape(equations.recorder, {name: Output.of(name, weighted(equations, *second))})
    twice = curvature_named(name)
    if twice is not None:
        return Tape(equations.recorder, {name: Output.of(name, curvature(equations, *twice))})
    result = derivative_named(name)
    if result is not None and name not in equations.quantities:
        values = _only_output(tape_as_derived(equations, result.of)).array()
        return Tape.of(equations.recorder, **{name: derivative(equations, values, result.by)})
    if name != "outputs":
        return equations.tape(quantity_of(name))
    rows = [equations.quantity(q).ravel() for q in outputs_in(equations.quantities)]
    whole = np.concatenate(rows) if rows else np.zeros(0, dtype=object)
    return Tape(equations.recorder, {"outputs": Output.of("outputs", whole)})


def tapes_of(equations: Equations, names: Sequence[str], right_side: RightSide) -> dict[str, Tape]:
    """The tapes of functions; of rhs and its derivative by x with what the right-hand side is made with."""
    work, baumgarte = right_side.work, right_side.baumgarte
    of_columns = right_side.sensitivities
    with_columns = ("rhs", *COLUMNS) if of_columns else ()
    adjoint = right_side.adjoint or ()
    tapes = {name: columns.tape_of(equations, name, of_columns, right_side.held, right_side.followed) if name in with_columns else
             columns.adjoint_tape_of(equations, name, adjoint) if name in ADJOINTS else tape_as_derived(equations, name)
             for name in names}
    if work or baumgarte:
        field = equations.quantity(stabilized("rhs") if baumgarte else "rhs")
        if work:
            field = np.concatenate([field, equations.quantity("power").reshape(1)])
        tapes["rhs"] = Tape.of(equations.recorder, rhs=field)
    if (work or baumgarte) and "jacobian_x" in names:
        by_x = equations.quantity(stabilized("jacobian_x") if baumgarte else "jacobian_x")
        if work:  # nothing depends on the work
            by_x = np.vstack([by_x, equations.quantity("power_x").reshape(1, -1)])
            by_x = np.column_stack([by_x, np.zeros(len(by_x), dtype=object)])
        tapes["jacobian_x"] = Tape.of(equations.recorder, jacobian_x=by_x)
    if work and PACKED in names:
        values = [*_only_output(tapes[PACKED]).entries, *equations.quantity("power_x").ravel()]
        tapes[PACKED] = Tape(equations.recorder, {PACKED: Output.of(PACKED, np.array(values, dtype=object))})
    return tapes


def columns_of(equations: Equations, name: str, right_side: RightSide) -> Columns | None:
    """The derivatives along directions that a matrix of derivatives consists of; None where its columns one by one take less, and
    for other functions."""
    made = all_columns_of(equations, name, right_side)
    return made if made is not None and made.pays() else None


def all_columns_of(equations: Equations, name: str, right_side: RightSide) -> Columns | None:
    """The derivatives along directions that a matrix of derivatives, or a right-hand side with sensitivities, consists of; None
    for other functions."""
    if name == "rhs" and right_side.sensitivities:
        return columns.motion_columns(equations, right_side.sensitivities, right_side.held) if right_side.in_lanes else None
    second = second_named(name)
    if second is not None and second.kind == HESSIAN:
        return _columns_of_hessian(equations, name, second.wrt)
    result = differentiated(name)
    if result is None or second is not None:
        return None
    of, by = result
    by_gain = right_side.baumgarte and name == "jacobian_x"
    values = equations.quantity(stabilized("rhs")) if by_gain else _only_output(tape_as_derived(equations, of)).array()
    entries = values.ravel().tolist()
    work = right_side.work and name == "jacobian_x"
    if work:
        entries += equations.quantity("power").ravel().tolist()
    groups: list[Group] = []
    changes: list[Any] = []
    n = 0
    for group in BY[by]:
        seeds = seeds_in(equations, group)
        if seeds:
            groups.append(Group(group, seeds, n))
            changes += along(equations, entries, group, stabilized(UNKNOWNS) if by_gain else UNKNOWNS)
            n += len(seeds)
    if not groups or not entries:
        return None
    tape = Tape(equations.recorder, {name: Output(name, (len(changes),), tuple(changes))})
    shape = (len(entries),) if work else values.shape
    return Columns(tape, tuple(groups), shape, n + work)  # nothing depends on the work


def _columns_of_hessian(equations: Equations, name: str, wrt: Sequence[str]) -> Columns:
    groups: list[Group] = []
    changes: list[Any] = []
    n = 0
    for group in [group for by in wrt for group in BY[by]]:
        seeds = seeds_in(equations, group)
        if seeds:
            groups.append(Group(group, seeds, n))
            changes += gradient(equations, wrt, group)
            n += len(seeds)
    return Columns(Tape(equations.recorder, {name: Output(name, (len(changes),), tuple(changes))}), tuple(groups), (n,), n)


def _only_output(tape: Tape) -> Output:
    return next(iter(tape.outputs.values()))


def given_rates(equations: Equations, names: Sequence[str], sensitivities: Sequence[str] = ()) -> list[str]:
    """Names of the group ud: accelerations; for the balance also multipliers, for its variations what they are along;
    for the residual the rates of the coordinates, too, and multipliers; with sensitivities what carries them across resets,
    behind bounds of events."""
    symbols, n_c = equations.symbols, len(equations.constraints)
    bounds = bound_names(event_leaves(equations)) if BOUNDS in names else []
    if CARRIED in names:
        return [*bounds, *columns.given_to_carry(equations, sensitivities)]
    if bounds:
        return bounds
    if "residual" in names:
        return residual_names(symbols.coordinates, symbols.speeds, symbols.states, n_c)
    if WEIGHTS in names:
        return weight_names(len(symbols.coordinates) + len(symbols.speeds) + len(symbols.states))
    if "outputs_sensitivity" in names:
        return direction_names(symbols)
    if "carried_variation" in names:
        held = indices_of_resets(symbols, equations.events)
        return [*carried_names(symbols.speeds, len(held)), LATER, *direction_names(symbols)]
    given = [f"{s.name}_dot" for s in symbols.speeds]
    if any(n in STATICS or n in VARIATIONS or n in DERIVATIVES for n in names):
        given += multiplier_names(n_c)
    if any(second_named(n) for n in names):
        given += weight_names(len(symbols.coordinates) + len(symbols.speeds) + len(symbols.states))
        wrt = next((second.wrt for n in names if (second := second_named(n)) and second.kind == HESSIAN_PRODUCT), ())
        given += [seed for by in wrt for group in BY[by] for seed in seeds_in(equations, group)]
    for twice in filter(None, map(curvature_named, names)):
        given += weight_names(len(curved(equations, twice.of)))
    if any(n in VARIATIONS for n in names):
        given += variation_names(symbols, n_c, "second_variation" in names)
    return given
