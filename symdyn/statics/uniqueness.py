"""Whether an equilibrium is the only one near its state: whether there is a stiffness in every direction.

The stiffness along a direction is a sum over all loads. Where it is zero within rounding it either vanishes, since no load acts
along the direction, or it is lost in the digits of larger terms that cancel (1e-6 N/m next to 1e12 N/m). The contribution of
every single load decides between the two: the exact derivative of the stiffness by a parameter, times the parameter, holds none
of the terms of other loads.
"""

from __future__ import annotations

import numpy as np

from symdyn.errors import EquilibriumNotUnique
from symdyn.statics.noise import ENTRIES, EPSILON, SAFETY, SAMPLES, rounded
from symdyn.statics.search import Search, Trial
from symdyn.statics.sensitivity import second
from symdyn.statics.spectrum import ZERO
from symdyn.statics.terms import OperatingPoint, coordinate_names, multiplier, null_space
from symdyn.tape.intrinsics import RANK
from symdyn.turning import stiffness_unit

# Where parameters or inputs are solved for, less than this part of the largest stiffness, scaled, counts as none.
LEAST = 1e-9


def demand_stiffness(search: Search) -> None:
    """Raises EquilibriumNotUnique for a direction along which there is no stiffness, or none that the digits prove."""
    trial, module = search.best, search.module
    point, columns = trial.point, search.columns
    _, n_u, _, n_c = point.sizes
    states = trial.selection.states
    inner = point.by_z[n_u + n_c:][states][:, states]
    drifting = bool(states) and np.linalg.matrix_rank(inner) < len(states)
    lost: list[str] = []
    if trial.selection.conditions or drifting:  # all unknowns take part, as many as equations, seen by the scaled derivative
        J = search.scaled(trial)[1]
        labels = [*_direction_names(trial), *[module.metadata.z[k] for k in states], *trial.selection.unknown]
        _, values, Vt = np.linalg.svd(J)
        loose = Vt[len(values):] if len(values) < J.shape[1] else Vt[values <= LEAST * values.max(initial=0.0)]
        if not trial.selection.conditions:  # extra states that nothing brings back may be anything
            _, sizes, Wt = np.linalg.svd(loose[:, :trial.directions.shape[1]], full_matrices=False)
            loose = Wt[sizes > 1e-6]
        lost = [_lost_in_trim(search, direction) for direction in loose]
    else:
        Z = null_space(np.vstack([point.C_r, trial.selection.rows(point)]) * columns)
        K, error = _stiffness(point, columns, states)
        left, loose = (each @ Z.T for each in _without_stiffness(Z.T @ K @ Z, np.abs(Z.T) @ error @ np.abs(Z)))
        labels = list(coordinate_names(module.metadata))
        lost = [_lost(point, states, columns * u, columns * v, labels.index(_first(v, labels)),
                      float(np.abs(u) @ error @ np.abs(v)), float(np.abs(u) @ np.abs(K) @ np.abs(v)))
                for u, v in zip(left, loose, strict=True)]
    if not len(loose):
        return
    remedy = (f"; fix it, as by fixed={{{', '.join(f'{_first(d, labels)!r}: ...' for d in loose)}}}, or add a load that holds it"
              + (f"; or begin with other values of {', '.join(trial.selection.unknown)}, in params or inputs: where they are "
                 "zero they may have no effect" if trial.selection.unknown else ""))
    if any(lost):
        parts = [f"along {_described(direction, labels)} {result}"
                 for direction, result in zip(loose, lost, strict=True) if result]
        none = [_described(direction, labels) for direction, result in zip(loose, lost, strict=True) if not result]
        parts += [f"there is no stiffness along {each}" for each in none]
        raise EquilibriumNotUnique(f"{module.name}: whether the equilibrium is unique is not decided by the digits: "
                                   f"{'; '.join(parts)}{remedy}, or bring the sizes closer together")
    raise EquilibriumNotUnique(f"{module.name}: the equilibrium is not unique: there is no stiffness along "
                               + " and along ".join(_described(direction, labels) for direction in loose) + remedy)


def _stiffness(point: OperatingPoint, columns: np.ndarray, states: list[int]) -> tuple[np.ndarray, np.ndarray]:
    """K of all speeds, (n_u, n_u), scaled, with what extra states do at rest, and how much of its entries rounding may be."""
    def at(here: OperatingPoint) -> np.ndarray:
        forces, rates = here.parts["forces"], here.parts["z_dot"]
        K = here.by_v[forces]
        if states:
            inner = here.by_z[rates][states][:, states]
            K = K - here.by_z[forces][:, states] @ np.linalg.solve(inner, here.by_v[rates][states])
        return np.asarray(K * np.outer(columns, columns))

    K, stream = at(point), np.random.default_rng(11)
    change = np.max([np.abs(at(rounded(point, stream)) - K) for _ in range(SAMPLES)], axis=0)
    return K, SAFETY * change + ENTRIES * EPSILON * np.abs(K)


def _without_stiffness(K: np.ndarray, error: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Left and right directions (k, n) along which K is zero but for rounding."""
    if not len(K):
        return np.zeros((0, 0)), np.zeros((0, 0))
    rows, sums = np.abs(K).max(axis=1), np.abs(K).max(axis=0)
    rows, sums = (1 / np.sqrt(np.where(v > 0, v, 1.0)) for v in (rows, sums))
    U, values, Vt = np.linalg.svd(K * np.outer(rows, sums))
    noise = np.einsum("ik,ij,kj->k", np.abs(U), error * np.outer(rows, sums), np.abs(Vt)) + EPSILON * values.max(initial=0.0)
    loose = values <= ZERO * noise
    left, right = (each / np.maximum(np.linalg.norm(each, axis=1, keepdims=True), 1e-300)
                   for each in (U.T[loose] * rows, Vt[loose] * sums))
    return left, right


def _lost(point: OperatingPoint, states: list[int], u: np.ndarray, v: np.ndarray, leader: int, error: float, terms: float) -> str:
    """Contributions of loads to a stiffness u^T K v that is zero within `error`, in words; "" where they contribute nothing.

    u, v    (n_u,) left and right direction; leader: the coordinate by whose displacement sizes are given
    terms   size of the terms of the stiffness
    """
    result = [each for each in (_contribution(point, states, u, v, k) for k in range(len(point.p) + len(point.inputs))) if each]
    if not result:
        return ""
    unit = stiffness_unit(point.module.metadata.units.get(point.module.metadata.u[leader])) or "(N, m)"
    by = abs(u[leader] * v[leader]) or float(np.abs(u).max() * np.abs(v).max())
    most, together = max(abs(each) for each in result) / by, abs(sum(result)) / by
    return (f"loads make a stiffness of {together:.3g} {unit} in sums of terms of {max(terms / by, most):.3g} {unit}, known to "
            f"{max(error / by, EPSILON * most):.1g} {unit} only")


def _lost_in_trim(search: Search, direction: np.ndarray) -> str:
    """The same for a direction among scaled unknowns, (n,), by the stiffness along its displacements."""
    trial, point, columns = search.best, search.best.point, search.columns
    n = trial.directions.shape[1]
    v = trial.directions @ (search.widths(trial)[:n] * direction[:n])
    if not v.any():
        return ""
    terms = np.abs(point.by_v[:len(v)] * np.outer(columns, columns)).max(initial=0.0) * float(np.sum((v / columns)**2))
    return _lost(point, [], v, v, int(np.argmax(np.abs(v / columns))), LEAST * terms, terms)


def _contribution(point: OperatingPoint, states: list[int], u: np.ndarray, v: np.ndarray, k: int) -> float:
    """Contribution of the load of parameter (or input) k to u^T K v, with its part in the multipliers; 0 within rounding."""
    metadata = point.module.metadata
    name = (*metadata.parameters, *metadata.inputs)[k]
    value = float(np.concatenate([point.p, point.inputs])[k])
    _, n_u, n_z, n_c = point.sizes
    if not value:
        return 0.0
    changes = {name: 1.0}
    if n_c:
        by = point.by([name])[:n_u, 0]
        lam = np.linalg.lstsq(point.C_r.T, -by, rcond=RANK)[0] * point.scale
        changes |= {multiplier(j): float(each) for j, each in enumerate(lam) if each}
    forces, rates = point.parts["forces"], point.parts["z_dot"]
    z_of_v, u_z = np.zeros((n_z, n_u)), np.zeros(n_z)
    if states:
        inner = point.by_z[rates][states][:, states]
        z_of_v[states] = -np.linalg.solve(inner, point.by_v[rates][states])
        u_z[states] = -np.linalg.solve(inner.T, point.by_z[forces][:, states].T @ u)
    none = np.zeros(n_u)
    columns = [second(point, changes, unit, none, none, z_of_v @ unit, np.zeros(n_c)) for unit in np.eye(n_u)]
    change = np.array(columns).T  # of the statics by v, by the parameter
    weights = np.concatenate([u, np.zeros(n_c), u_z])
    result = float(weights @ change @ v)
    return value * result if abs(result) > ZERO * EPSILON * float(np.abs(weights) @ np.abs(change) @ np.abs(v)) else 0.0


def _direction_names(trial: Trial) -> list[str]:
    labels = coordinate_names(trial.point.module.metadata)
    return [labels[int(np.argmax(np.abs(column)))] for column in trial.directions.T]


def _described(direction: np.ndarray, labels: list[str]) -> str:
    """Coordinates of a direction by their shares of its square, the largest first."""
    shares = direction**2 / np.sum(direction**2)
    order = [k for k in np.argsort(-shares, kind="stable") if shares[k] >= 0.05]
    return ", ".join(f"{labels[k]} ({shares[k]:.2f})" for k in order)


def _first(direction: np.ndarray, labels: list[str]) -> str:
    return labels[int(np.argmax(np.abs(direction)))]
