"""Derivatives of any quantity: along a direction in one group of arguments, and by all entries of a group.

Accelerations and multipliers in a quantity are differentiated through what they are solved from (`Motion.along`), not through
the factorization. A function's name says what is differentiated and by what, see symdyn.formulation.names.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from symdyn.formulation.adjoint import weight_names
from symdyn.formulation.equations import Equations
from symdyn.formulation.names import ADJOINT, BY, HESSIAN, WEIGHTED, along_group, outputs_in
from symdyn.model.symbols import time
from symdyn.spatial.vectors import vector
from symdyn.tape.differentiate import direction, forward, reverse, seed_name
from symdyn.tape.node import ACCELERATION, Node
from symdyn.tape.passes import substitute
from symdyn.tape.tape import reachable, unsigned

# The quantity whose entries the equations are solved for.
UNKNOWNS = "unknowns"


def names_of(equations: Equations, group: str) -> list[str]:
    """Names of the leaves in a group of arguments."""
    return [leaf.args[1] for leaf in leaves_of(equations, group)]


def leaves_of(equations: Equations, group: str) -> list[Node]:
    """The leaves by which a group of arguments differentiates."""
    symbols = equations.symbols
    if group == "ud":
        return [equations.recorder.leaf(f"{u.name}_dot", ACCELERATION) for u in symbols.speeds]
    held = {"q": symbols.coordinates, "u": symbols.speeds, "z": symbols.states, "inputs": symbols.inputs,
            "p": symbols.parameters, "t": (time,)}
    return [equations.leaves[s] for s in held[group]]


def along(equations: Equations, entries: Sequence[Any], group: str, unknowns: str = UNKNOWNS) -> list[Any]:
    """The derivatives of entries along a direction in a group of arguments, whose entries are leaves (see seed_name).

    unknowns   the quantity whose entries are differentiated through what they are solved from; Baumgarte's right-hand side has
               another one
    """
    seeds = direction(equations.recorder, leaves_of(equations, group))
    if group != "ud" and unknowns in equations.quantities:
        values = equations.quantity(unknowns).tolist()
        used = _used(entries, values)
        if used:
            changes = equations.quantity(along_group(unknowns, group)).tolist()
            seeds |= {unsigned(v): -d if v.op == "neg" else d for v, d in zip(values, changes, strict=True)
                      if isinstance(v, Node)}
    return forward(equations.recorder, entries, seeds)


def derivative(equations: Equations, values: np.ndarray, by: str) -> np.ndarray:
    """The derivatives of an array of values, with one more axis for what they are differentiated by."""
    entries = values.ravel().tolist()
    leaves = [leaf for group in BY[by] for leaf in leaves_of(equations, group)]
    result = np.zeros((len(entries), len(leaves)), dtype=object)
    solved = equations.quantity(UNKNOWNS).tolist() if UNKNOWNS in equations.quantities and by != "ud" else []
    if len(entries) < len(leaves) and not _used(entries, solved):
        for i, entry in enumerate(entries):
            result[i] = reverse(equations.recorder, entry, leaves)
    else:
        made = {group: tuple(along(equations, entries, group)) for group in BY[by]}
        places = [(group, leaf) for group in BY[by] for leaf in leaves_of(equations, group)]
        for k, (group, chosen) in enumerate(places):
            seeds = direction(equations.recorder, leaves_of(equations, group))
            result[:, k] = substitute(made[group], {seed: int(leaf is chosen) for leaf, seed in seeds.items()},
                                      equations.recorder)
    return result.reshape(*values.shape, len(leaves))


def gradient(equations: Equations, wrt: Sequence[str], along: str | None = None) -> list[Any]:
    """The gradient of w^T x_dot by these of x, inputs, params and t, one after the other; along: its derivative along a direction
    in a group of arguments."""
    whole = iter(equations.quantity(ADJOINT if along is None else along_group(ADJOINT, along)).tolist())
    pieces = {by: [next(whole) for group in BY[by] for _ in leaves_of(equations, group)] for by in WEIGHTED}
    return [entry for by in wrt for entry in pieces[by]]


def weighted(equations: Equations, kind: str, wrt: Sequence[str]) -> np.ndarray:
    """The gradient of w^T x_dot, its matrix of second derivatives, or the product of this and a direction."""
    if kind == ADJOINT:
        return vector(*gradient(equations, wrt))
    return hessian(equations, wrt) if kind == HESSIAN else hessian_product(equations, wrt)


def hessian_product(equations: Equations, wrt: Sequence[str]) -> np.ndarray:
    """The derivative of the gradient along a direction whose entries are arguments, (change of ...) one after the other."""
    total: list[Any] = []
    for by in wrt:
        for group in BY[by]:
            leaves = leaves_of(equations, group)
            if leaves:
                seeds = direction(equations.recorder, leaves)
                given = {seed: equations.recorder.leaf(seed.args[1], ACCELERATION) for seed in seeds.values()}
                change = substitute(tuple(gradient(equations, wrt, group)), given, equations.recorder)
                total = [a + b for a, b in zip(total, change, strict=True)] if total else list(change)
    return vector(*total)


def hessian(equations: Equations, wrt: Sequence[str]) -> np.ndarray:
    """The matrix of second derivatives of w^T x_dot, column by column."""
    columns = []
    for by in wrt:
        for group in BY[by]:
            leaves = leaves_of(equations, group)
            seeds = direction(equations.recorder, leaves)
            for chosen in leaves:
                unit = {seed: int(leaf is chosen) for leaf, seed in seeds.items()}
                columns.append(substitute(tuple(gradient(equations, wrt, group)), unit, equations.recorder))
    return np.array(columns, dtype=object).T.reshape(len(columns), len(columns))


def curved(equations: Equations, of: str) -> list[Any]:
    """The entries of what is differentiated twice: of the constraints [C; C_dot], of all outputs one after the other."""
    if of == "constraints":
        return [*equations.quantity("C").tolist(), *equations.quantity("C_dot").tolist()]
    return [e for name in outputs_in(equations.quantities) for e in equations.quantity(name).ravel().tolist()]


def curvature(equations: Equations, of: str, wrt: Sequence[str]) -> np.ndarray:
    """The matrix of second derivatives of w^T of these entries, with the weights w among the arguments."""
    recorder, values = equations.recorder, curved(equations, of)
    weights = [recorder.leaf(name, ACCELERATION) for name in weight_names(len(values))]
    leaves = [leaf for by in wrt for group in BY[by] for leaf in leaves_of(equations, group)]
    total = sum((w * value for w, value in zip(weights, values, strict=True)), 0)
    slopes = reverse(recorder, total, leaves)
    columns = [forward(recorder, slopes, {leaf: 1}) for leaf in leaves]
    return np.array(columns, dtype=object).T.reshape(len(leaves), len(leaves))


def seeds_in(equations: Equations, group: str) -> tuple[str, ...]:
    """The names of the entries of a direction in a group of arguments."""
    return tuple(map(seed_name, names_of(equations, group)))


def _used(entries: Sequence[Any], values: Sequence[Any]) -> bool:
    """Whether what is computed of entries passes one of the values."""
    wanted = {unsigned(v) for v in values if isinstance(v, Node) and unsigned(v).op != "leaf"}
    return bool(wanted) and not wanted.isdisjoint(reachable(entries))
