"""Rows of the constraints that depend on the others, and speeds that depend on the others, found in numbers at consistent states:
the initial one, and those that are reached from there by walking along the motions that the constraints leave."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from symdyn.formulation.constraints.consistent_states import FULFILLED, ConstraintStates
from symdyn.formulation.constraints.sampled import Sampled
from symdyn.formulation.equations import Equations
from symdyn.tape.floats import evaluate_entries
from symdyn.tape.intrinsics import RANK

# Walks of so many steps, each of this part of the mechanism's length (or, of a turning speed, about so many rad).
WALKS, STEPS, STRIDE = 6, 12, 0.25
# Starts that are tried, the initial state and others up to 1 m or 1 rad away.
STARTS = 8
# Sets of random numbers that are tried for parameters without numbers.
TRIES = 4
# A row whose part in the combinations of rows that vanish is above this follows from the others.
REPLACED = 1e-6
# Parts that differ by less of themselves are the same.
ALIKE = 1e-9
# Derivatives smaller than this part of those near a state vanish there.
VANISHING = 1e-5


@dataclass(frozen=True)
class Ranks:
    """rank: the largest found, of the scaled C_r; independent: rows that have it, far from losing it at all states.

    samples   (s, n_c, n_u) scaled C_r at the states; mass (1, n_u, n_u): M_tilde at the first of them
    vanishing   rows whose derivatives vanish at all these states, but not next to them
    values    name -> number, or (s,) at these states
    """

    rank: int
    independent: tuple[int, ...]
    samples: Sampled
    mass: Sampled
    vanishing: tuple[int, ...] = ()
    values: Mapping[str, Any] = field(default_factory=dict)


def search(equations: Equations, tries: int = TRIES) -> Ranks | None:
    """The same as `ranks` where parameters have no numbers, too: these take random ones, a few times.

    Random numbers make no rows dependent that are not with all numbers.
    """
    symbols = equations.symbols
    missing = [p for p in symbols.parameters if p not in symbols.defaults]
    if not missing:
        return ranks(equations)
    stream = np.random.default_rng(3)
    initial = dict(symbols.initial)
    for group in equations.unit_groups:
        if not any(initial.get(q) for q in group):
            initial[group[0]] = 1.0
    for _ in range(tries):
        numbers = {**symbols.defaults, **{p: float(stream.uniform(0.5, 1.5)) for p in missing}}
        result = ranks(replace(equations, symbols=replace(symbols, defaults=numbers, initial=initial)))
        if result is not None:
            return result
    return None


def ranks(equations: Equations, seed: int = 1) -> Ranks | None:
    """The rank of the constraints at consistent states; None where parameters have no numbers, or no consistent one
    is found near the initial one."""
    symbols = equations.symbols
    if any(p not in symbols.defaults for p in symbols.parameters):
        return None
    states = ConstraintStates(equations, symbols.defaults)
    start = np.array([[float(symbols.initial.get(q, 0.0)) for q in symbols.coordinates]])
    stream = np.random.default_rng(seed)
    near = stream.uniform(-1, 1, (STARTS, start.shape[1]))
    near[0] = 0  # the initial state itself; from a singular one no step leads on
    near, residual = states.nearest(start + near)
    if not (residual < FULFILLED).any():
        return None
    consistent = near[residual < FULFILLED]
    q = consistent[:1]
    places = np.concatenate([q, *walked(states, q, stream)])
    samples = scaled(states, places)
    counts = samples.ranks()
    rank = int(counts.max(initial=0))
    samples = samples[counts == rank]
    values = {**states.values, **dict(zip(states.names, places[counts == rank].T, strict=True))}
    mass = _mass(equations, states, np.concatenate([places, consistent]))
    if mass is None:
        return None
    return Ranks(rank, _independent(samples, rank, states.holonomic), samples, mass, _vanishing(states, places, stream),
                 values)


def _mass(equations: Equations, states: ConstraintStates, places: np.ndarray) -> Sampled | None:
    """M_tilde at the first of the places (s, n_q) where it exists: not at gimbal lock where a joint follows angles."""
    values = {**states.values, **dict(zip(states.names, places.T, strict=True))}
    masses = Sampled.of_entries(evaluate_entries(equations.tape("M_tilde"), values, len(places))["M_tilde"])
    there = np.isfinite(masses.values).all(axis=1)
    return masses[[int(np.argmax(there))]] if there.any() else None


def _vanishing(states: ConstraintStates, places: np.ndarray, stream: np.random.Generator) -> tuple[int, ...]:
    """Holonomic rows whose derivatives are as good as none at all places (s, n_q), compared with those next to them."""
    here = states.at(places).C_r.largest_of_rows().max(axis=0, initial=0.0)
    nearby = states.at(places + stream.uniform(-0.5, 0.5, places.shape)).C_r.largest_of_rows()
    nearby = np.where(np.isfinite(nearby), nearby, 0.0).max(axis=0, initial=0.0)
    return tuple(int(k) for k in np.flatnonzero(states.holonomic & (here <= VANISHING * nearby)))


def walked(states: ConstraintStates, q: np.ndarray, stream: np.random.Generator) -> Iterator[np.ndarray]:
    """Consistent states (s, n_q) on walks from one (1, n_q), each going on in its direction as the constraints allow."""
    now = np.repeat(q, WALKS, axis=0)
    n_u = len(states.angular)
    direction = stream.normal(size=(WALKS, n_u))
    direction[1::2] = -direction[::2]
    for _ in range(STEPS):
        result = states.at(now)
        onward = _along(states.scaled(result), direction)
        size = np.linalg.norm(onward, axis=1, keepdims=True)
        if not (size > 1e-6).any():
            return
        direction = onward / np.maximum(size, 1e-6)
        now, residual = states.nearest(now + states.moved(result, STRIDE * direction))
        kept = residual < FULFILLED
        if not kept.any():
            return
        now, direction = now[kept], direction[kept]
        yield now


def scaled(states: ConstraintStates, q: np.ndarray) -> Sampled:
    """C_r (s, n_c, n_u) at coordinates (s, n_q), lengths by lengths."""
    return states.scaled(states.at(q))


def _along(A: Sampled, direction: np.ndarray) -> np.ndarray:
    """Directions (s, n_u) without what the rows of A (s, m, n_u) hold."""
    return direction - A.least_change(A.times(direction), RANK)


def _independent(samples: Sampled, rank: int, holonomic: np.ndarray) -> tuple[int, ...]:
    """Rows of full rank at the samples (s, n_c, n_u): one after the other the row goes that the others replace best where they
    do it worst, by its part in the combinations of rows that vanish. Velocity constraints that follow from others go before
    constraints of positions, which no velocity constraint replaces."""
    kept = list(range(samples.m))
    left = samples.vanishing(rank) if rank < samples.m else np.zeros((len(samples), samples.m, 0))
    while len(kept) > rank:
        part = np.linalg.norm(left, axis=2).min(axis=0)
        of_speeds = np.where(holonomic[kept], 0.0, part)
        part = of_speeds if of_speeds.max() > REPLACED else part
        gone = int(np.argmax(part >= (1 - ALIKE) * part.max()))  # the first, where rounding alone decides
        kept.pop(gone)
        left = np.delete(_without(left, gone), gone, axis=1)
    return tuple(kept)


def _without(left: np.ndarray, k: int) -> np.ndarray:
    """Combinations (s, m, d) of rows without row k, orthonormal again, (s, m, d - 1): by a reflection that leaves
    row k to the first of them."""
    row = left[:, k] / np.maximum(np.linalg.norm(left[:, k], axis=1, keepdims=True), 1e-300)
    axis = row + np.eye(row.shape[1])[0] * np.where(row[:, :1] < 0, -1.0, 1.0)
    square = np.maximum((axis * axis).sum(axis=1), 1e-300)
    turned = left - 2 * (left @ axis[..., None]) * (axis / square[:, None])[:, None]
    return turned[..., 1:]  # type: ignore[no-any-return]
