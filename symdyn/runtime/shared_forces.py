"""Shares of sticking contacts in forces that the motion does not determine: a box on four corners, a table on legs.

Accelerations determine the forces lam of contacts up to a null space. Contacts hold as long as some forces of that space are
within all cones of friction. Those with the largest margin s are a second-order cone program,

    maximize s  with  |lam_T| + s f <= mu lam_N  in every contact that sticks, lam_N >= s f in the others,

which is solved by a barrier, with sizes f that are mu lam_N of a first solution: s is a part of the friction. Generated code
softens rows that depend on each other, so that its forces are those of the least sum of squares, each by the softness of its row.
The barrier gives the softness for which these are the forces of the largest margin: at its minimum the sum of
(mu a dN - lam_T dT)/(a^2 - |lam_T|^2), a = mu lam_N - s f, vanishes for all changes in the null space. That holds where changes
of normal and of tangential forces are independent, as with all contacts in one plane.

Source: Boyd and Vandenberghe, Convex Optimization, 2004, sections 11.2 and 11.6 (barriers of second-order cones).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from symdyn.thresholds import DEPENDENT

# The margin by the bounds, above which contacts hold; steps of Newton's method that are rounding.
MARGIN, EXACT = 1e-11, 1e-12
# A margin above this part that softness does not come to: how contacts share forces is not decided.
MISSED = 1e-5
# The least softness by the largest one.
LEAST = 1e-4
# By how much the barrier is lowered at once, and how far; the steps of Newton's method for it, and the square of its decrement
# from which on full steps converge.
LOWERED, LAST, STEPS, NEAR = 20.0, 1e6, 50, 0.05
# The part of the margin from which on it is of a cone; solutions, each with the sizes of the one before; the least size.
WORTH, ROUNDS, SMALLEST = 1e-3, 3, 1e-9
# The largest sum of normal forces by the sum of those of least norm, where a prestress leaves it open.
PRESTRESS = 10.0


# Signs of u_0^2 - |u_T|^2.
SIGNS = np.array([1.0, -1.0, -1.0])


class Cone(NamedTuple):
    """Bounds of one contact: rows of its normal force, None where it has none, and of its tangential ones, empty where these are
    no unknowns; friction: coefficient of the normal force, without one the bound itself."""

    normal: int | None
    tangents: tuple[int, ...]
    friction: float


class Shared(NamedTuple):
    """Forces lam (n,) with their margin, the least part that is left of a bound; softness (n,) of rows for which generated code
    gives these, from 0 to 1. None: it gives others, which are not within all cones."""

    lam: np.ndarray
    margin: float
    softness: np.ndarray | None


class _Parts(NamedTuple):
    """Cones |u_T| <= u_0 of u = start + W v: start (n, 3), W (n, 3, n_v); rows that a cone does not have are zero."""

    start: np.ndarray
    W: np.ndarray

    def at(self, v: np.ndarray) -> np.ndarray:
        """u, (n, 3)."""
        u: np.ndarray = self.start + self.W @ v
        return u


class _Null(NamedTuple):
    """Forces lam = lam_0 + N y that fulfil what the accelerations determine."""

    lam_0: np.ndarray
    N: np.ndarray


def least_solution(A: np.ndarray, right: np.ndarray) -> np.ndarray:
    """The least x with A x = right, as well as it can be: rows of A may depend on each other."""
    result: np.ndarray = np.linalg.lstsq(A, right, rcond=DEPENDENT)[0]
    return result


def shared_forces(A: np.ndarray, right: np.ndarray, H: np.ndarray, fixed: np.ndarray, sizes: np.ndarray,
                  cones: Sequence[Cone]) -> Shared:
    """The forces lam = H x + fixed with A x = right that leave the largest margin to all cones.

    A         (m, m), dependent rows; right (m,), H (n, m), fixed (n,)
    sizes     of the rows of A, (m,), by which softness is measured
    """
    U, s, V = np.linalg.svd(A)
    kept = s > DEPENDENT * s[:1]
    x_0 = V[kept].T @ ((U[:, kept].T @ right) / s[kept])
    null, left = V[~kept].T, U[:, ~kept]
    lam_0 = H @ x_0 + fixed
    inside = H @ null
    force = max(float(np.abs(lam_0).max(initial=0.0)), 1e-300)
    sizes_of = np.ones(len(cones))
    for _ in range(ROUNDS):
        y, margin, rows = _largest_margin(_Null(lam_0 / force, inside), cones, sizes_of)
        sizes_of = np.maximum([_bound(lam_0 / force + inside @ y, cone) for cone in cones], SMALLEST)
    lam = lam_0 + force * (inside @ y)
    indices = np.argmax(np.abs(H) == 1, axis=0)  # of the unknowns among the rows
    rows[indices] = rows[indices] / np.maximum(sizes, 1e-300)
    softness = _by_parts(rows, H @ null)
    E = sizes * softness[indices]
    along = np.linalg.lstsq(left.T @ (E[:, None] * null), -left.T @ (E * x_0), rcond=None)[0]
    given = H @ (x_0 + null @ along) + fixed
    reached = _margin(given / force, cones)
    if reached > MARGIN:
        return Shared(given, reached, softness)
    return Shared(lam, margin, None) if margin > MISSED else Shared(lam, min(margin, reached), softness)


def _margin(lam: np.ndarray, cones: Sequence[Cone]) -> float:
    """The least part of a bound that forces leave."""
    bounds = [_bound(lam, cone) for cone in cones]
    left = [bound - float(np.linalg.norm(lam[list(cone.tangents)])) for bound, cone in zip(bounds, cones, strict=True)]
    return min((one / max(abs(bound), SMALLEST) for one, bound in zip(left, bounds, strict=True)), default=np.inf)


def _bound(lam: np.ndarray, cone: Cone) -> float:
    return cone.friction if cone.normal is None else cone.friction * float(lam[cone.normal])


def _by_parts(softness: np.ndarray, N: np.ndarray) -> np.ndarray:
    """Softness from LEAST to 1 in every part of the rows whose forces change together."""
    result, together = np.ones(len(softness)), np.abs(N @ N.T) > DEPENDENT
    left = set(range(len(softness)))
    while left:
        part, new = set[int](), {min(left)}
        while new:
            part |= new
            new = {int(j) for k in new for j in np.flatnonzero(together[k])} - part
        left -= part
        rows = sorted(part)
        result[rows] = np.clip(softness[rows] / max(float(softness[rows].max()), 1e-300), LEAST, 1.0)
    return result


def _largest_margin(null: _Null, cones: Sequence[Cone], sizes: np.ndarray) -> tuple[np.ndarray, float, np.ndarray]:
    """y and s of the largest margin by sizes f, and the softness of all rows."""
    n, normals = null.N.shape[1], [cone.normal for cone in cones if cone.normal is not None]
    # Each cone has u = [mu lam_N - s f; lam_T] = u_0 + W v.
    parts = _Parts(np.zeros((len(cones) + 1, 3)), np.zeros((len(cones) + 1, 3, n + 1)))
    for k, cone in enumerate(cones):
        rows = list(cone.tangents)
        if cone.normal is not None:
            parts.W[k, 0, :n] = cone.friction * null.N[cone.normal]
        parts.W[k, 0, n], parts.W[k, 1:1 + len(rows), :n] = -sizes[k], null.N[rows]
        parts.start[k, 0], parts.start[k, 1:1 + len(rows)] = _bound(null.lam_0, cone), null.lam_0[rows]
    # A prestress may raise normal forces, up to a bound.
    most = PRESTRESS * float(np.abs(null.lam_0).sum())
    parts.start[-1, 0], parts.W[-1, 0, :n] = most - null.lam_0[normals].sum(), -null.N[normals].sum(axis=0)
    v = np.append(np.zeros(n), (_distances(parts.start[:-1]) / sizes).min() - 1.0)
    weight = 1.0
    while weight < LAST:
        weight = min(LAST, weight * LOWERED)
        v = _centred(parts, v, weight)
    # Part of the margin that each cone is worth, and its derivative by the tangential force: softness, up to a factor.
    u = parts.at(v)
    worth = 2 * u[:, 0] / (weight * (u**2 @ SIGNS))
    by_force = worth / u[:, 0]
    share = worth[:len(cones)] * sizes
    active = np.flatnonzero(share > WORTH * share.max())
    polished = _polished(parts, v, worth, active)
    if polished is not None:
        v, worth[active] = polished
        sizes = np.linalg.norm(parts.at(v)[:, 1:], axis=1)
        by_force[active] = worth[active] / np.maximum(sizes[active], SMALLEST)
    softness, lam = np.ones(len(null.lam_0)), null.lam_0 + null.N @ v[:n]
    for k, cone in enumerate(cones):
        softness[list(cone.tangents)] = by_force[k]
        if cone.normal is not None:
            softness[cone.normal] = cone.friction * worth[k] / max(float(lam[cone.normal]), SMALLEST)
    return v[:n], float(v[n]), softness


def _distances(u: np.ndarray) -> np.ndarray:
    """u_0 - |u_T|, (n,)."""
    result: np.ndarray = u[:, 0] - np.linalg.norm(u[:, 1:], axis=1)
    return result


def _polished(parts: _Parts, v: np.ndarray, worth: np.ndarray,
              active: np.ndarray) -> tuple[np.ndarray, np.ndarray] | None:
    """The largest margin to rounding, by Newton's method for the conditions of optimality of the cones that it is of, with what
    each is worth; None where it comes to another set of cones."""
    n, m = len(v), len(active)
    result, w = v.copy(), worth[active]
    for _ in range(STEPS):
        F, J = np.zeros(n + m), np.zeros((n + m, n + m))
        F[n - 1] = 1.0
        for j, k in enumerate(active.tolist()):
            W = parts.W[k]
            u = parts.start[k] + W @ result
            size = float(np.linalg.norm(u[1:]))
            slope = W[0].copy()
            if size > 0:
                unit = u[1:] / size
                slope -= unit @ W[1:]
                J[:n, :n] -= w[j] / size * (W[1:].T @ (np.eye(len(unit)) - np.outer(unit, unit)) @ W[1:])
            F[:n] += w[j] * slope
            F[n + j] = u[0] - size
            J[:n, n + j], J[n + j, :n] = slope, slope
        step = least_solution(J, -F)
        result, w = result + step[:n], w + step[n:]
        if float(np.abs(step).max()) <= EXACT:
            return (result, w) if (w >= 0).all() and _distances(parts.at(result)).min() >= -EXACT else None
    return None


def _centred(parts: _Parts, v: np.ndarray, weight: float) -> np.ndarray:
    """The minimum of -weight s - sum of log(u_0^2 - |u_T|^2), by Newton's method from a point inside."""
    def value(v: np.ndarray) -> float:
        u = parts.at(v)
        squares = u**2 @ SIGNS
        inside = (u[:, 0] > 0).all() and (squares > 0).all()
        return float(-weight * v[-1] - np.log(squares).sum()) if inside else np.inf

    last = np.inf
    for _ in range(STEPS):
        turned = parts.at(v) * SIGNS
        squares = turned**2 @ SIGNS
        scaled = np.einsum("kij,ki->kj", parts.W, turned) / squares[:, None]
        gradient = -2 * scaled.sum(axis=0)
        gradient[-1] -= weight
        curved = parts.W * (SIGNS / squares[:, None])[:, :, None]
        H = 4 * scaled.T @ scaled - 2 * np.einsum("kij,kil->jl", parts.W, curved)
        step = np.linalg.lstsq(H, -gradient, rcond=None)[0]
        falls = float(-gradient @ step)
        if falls < NEAR:  # where full steps are known to converge; values are rounding there
            if not 0 < falls < last / 2 or value(v + step) == np.inf:
                break
            v, last = v + step, falls
            continue
        part, now = 1.0, value(v)
        while value(v + part * step) > now - 0.1 * part * falls and part > 1e-10:
            part /= 2
        v = v + part * step
    return v
