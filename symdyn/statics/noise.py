"""Uncertainty of the linear equations: their entries at data that differ by rounding.

State, parameters and inputs are doubles, known to a unit in their last place at best. The matrices are formed again from data
that differ by so much, at random, with the accelerations that belong to them: entries that are zero by structure stay zero,
others move by their share of rounding, whatever their unit and size.
Source: Chatelin and Fraysse, Lectures on Finite Precision Computations, chapter 5 (reliability by random perturbation).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse.csgraph

from symdyn.statics.manifold import Manifold, in_motion, natural_length, natural_scales
from symdyn.statics.spectrum import Unknown
from symdyn.statics.terms import OperatingPoint

# Sets of data; the largest change among them is multiplied by this, for the directions that none of them took.
SAMPLES, SAFETY = 4, 4.0
# Units in the last place by which data differ, and those of the entries themselves.
DATA, ENTRIES = 1.0, 4.0
EPSILON = float(np.finfo(float).eps)
# Units in the last place of the largest entry among states that act on each other, for what is left of it.
FLOOR = 2.0


@dataclass(frozen=True, eq=False)
class Noise:
    """Uncertainty of A; bounds, entry by entry, of C and K."""

    A: Unknown
    C: np.ndarray
    K: np.ndarray


def noise(manifold: Manifold) -> Noise:
    """The bounds about one state."""
    mine = _matrices(manifold)
    result = [np.zeros_like(each) for each in mine]
    stream = np.random.default_rng(7)
    for _ in range(SAMPLES):
        point = in_motion(rounded(manifold.point, stream), manifold.selection)
        other = _matrices(Manifold(point, manifold.selection, partition=manifold.partition))
        result = [np.maximum(most, np.abs(b - a)) for most, a, b in zip(result, mine, other, strict=True)]
    A, M, C, K, K_z = (SAFETY * most + ENTRIES * EPSILON * np.abs(a) for most, a in zip(result, mine, strict=True))
    of_K, of_C, of_z = _of_sums(manifold)
    C, K, K_z = C + of_C, K + of_K, K_z + of_z
    ends = np.cumsum([0, manifold.n_d, manifold.n_s, len(manifold.states)])
    rates = slice(ends[1], ends[2])
    of_v, of_u, of_W, of_W_z = _of_bases(manifold)
    A[:ends[1], :ends[1]] += (of_W + np.abs(manifold.turned) @ of_v)[manifold.displacements]
    A[:ends[1], rates] += of_u[manifold.displacements]
    A[:ends[1], ends[2]:] += of_W_z[manifold.displacements]
    # Through the inverse of the mass matrix: what is not known of M zeta_dot = -K eta - C zeta - K_z z'.
    L = np.zeros((len(A), manifold.n_s))
    L[rates] = np.linalg.inv(manifold.M)
    F, S = np.hstack([K, C, K_z]), np.eye(len(A))[rates]
    direct = A.copy()
    direct[rates] = 0.0
    inverse = np.zeros_like(A)
    inverse[rates] = np.abs(np.diag(1 / np.diag(manifold.M))) @ np.hstack([of_K, of_C, of_z])
    floor = _floor(manifold, A + inverse)
    return Noise(Unknown(direct + floor, L, F, M, S, A + inverse + floor), C, K)


def _floor(manifold: Manifold, rounding: np.ndarray) -> np.ndarray:
    """Rounding of entries that are left of larger ones that cancel: a part of the largest among the states that act on each
    other,
    displacements and times in natural units; exact zeros are left alone."""
    A = np.abs(manifold.matrices[0])
    n_d, n_s = manifold.n_d, manifold.n_s
    if not A.size:
        return A
    lengths = natural_scales(manifold.point) * natural_length(manifold.point)
    sizes = np.concatenate([lengths[manifold.displacements], lengths[manifold.speeds], np.ones(len(manifold.states))])
    scaled = A * sizes / sizes[:, None]
    rates = np.zeros(len(A), dtype=bool)
    rates[n_d:n_d + n_s] = True
    result = np.zeros_like(A)
    _, parts = scipy.sparse.csgraph.connected_components(rounding < A, directed=False)
    for part in np.unique(parts):
        inner = parts == part
        stiff = float(scaled[np.ix_(inner & rates, inner & ~rates)].max(initial=0.0))
        quick = float(scaled[np.ix_(inner & rates, inner & rates)].max(initial=0.0))
        clock = max(float(np.sqrt(stiff)), quick) or 1.0
        units = sizes * np.where(rates, clock, 1.0)
        among = np.ix_(inner, inner)
        largest = float((A * units / units[:, None])[among].max(initial=0.0))
        result[among] = (FLOOR * EPSILON * largest * units[:, None] / units)[among]
    return np.asarray(np.where(A > 0, result, 0.0))


def _of_sums(manifold: Manifold) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Rounding of K, C and K_z as sums of products, Z^T F Z: terms that cancel leave that of the largest of them."""
    point = manifold.point
    forces = point.parts["forces"]
    weights = np.sqrt(np.where(point.M.diagonal() > 0, point.M.diagonal(), 1.0))
    F_v, F_u = (_entries(F, weights, weights) for F in (point.by_v[forces], point.by_u[forces]))
    F_z = _entries(point.by_z[forces][:, manifold.states], weights, np.ones(len(manifold.states)))
    inner, M = np.abs(manifold.Z_u.T), np.abs(point.M)
    Z_v, Z_u, W, W_z = (np.abs(each) for each in (manifold.Z_v, manifold.Z_u, manifold.W, manifold.W_z))
    demanded = [ENTRIES * EPSILON * M @ np.abs(each) for each in manifold.demanded]
    # The uncertainty of the bases enters from both sides.
    of_v, of_u, of_W, of_W_z = _of_bases(manifold)
    full_v, full_u = np.abs(point.by_v[forces]), np.abs(point.by_u[forces])
    full_z = np.abs(point.by_z[forces][:, manifold.states])
    moved = (full_v @ Z_v + full_u @ W, full_u @ Z_u, full_z + full_u @ W_z)
    from_bases = (full_v @ of_v + full_u @ of_W, full_u @ of_u, full_u @ of_W_z)
    from_terms = (F_v @ Z_v + F_u @ W, F_u @ Z_u, F_z + F_u @ W_z)
    parts = zip(from_terms, from_bases, demanded, moved, manifold.demanded, strict=True)
    result = [inner @ (terms + bases + asked) + of_u.T @ (whole + M @ np.abs(each)) for terms, bases, asked, whole, each in parts]
    return result[0], result[1], result[2]


def _of_bases(manifold: Manifold) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Rounding of Z_v, Z_u, W and W_z: dependent changes are solved for, with errors of the size of the largest of them."""
    scales = natural_scales(manifold.point)
    result = []
    for values, independent in ((manifold.Z_v, manifold.displacements), (manifold.Z_u, manifold.speeds),
                                (manifold.W, manifold.speeds), (manifold.W_z, manifold.speeds)):
        error = np.outer(scales, np.abs(values / scales[:, None]).max(axis=0, initial=0.0)) * ENTRIES * EPSILON
        error[independent] = 0.0
        if (np.count_nonzero(values, axis=0) <= 1).all():  # held ones and the like: nothing was solved
            error[:] = 0.0
        result.append(error)
    return result[0], result[1], result[2], result[3]


def _entries(F: np.ndarray, rows: np.ndarray, columns: np.ndarray) -> np.ndarray:
    """Rounding of entries: of their own size, and of the smaller of the largest ones in their row and column, scaled."""
    if not F.size:
        return np.zeros_like(F)
    scaled = np.abs(F) / np.outer(rows, columns)
    smaller = np.minimum(scaled.max(axis=1)[:, None], scaled.max(axis=0)[None, :])
    return np.asarray(EPSILON * (ENTRIES * np.abs(F) + smaller * np.outer(rows, columns)))


def rounded(point: OperatingPoint, stream: np.random.Generator) -> OperatingPoint:
    """The point with data that differ in their last digit; coordinates that are not exactly zero also by rounding of 1 rad, or of
    the natural length: a search ends there, and leaves 1e-18 where zero is meant."""
    def near(values: np.ndarray) -> np.ndarray:
        return np.asarray(values * (1 + DATA * EPSILON * stream.uniform(-1, 1, len(values))))

    x = near(point.x)
    q = point.q
    units = [point.module.metadata.units.get(n) for n in point.module.metadata.q]
    sizes = np.where([unit == "m" for unit in units], natural_length(point), 1.0)
    x[:len(q)] += np.where(q != 0, sizes, 0.0) * EPSILON * stream.uniform(-1, 1, len(q))
    return point.at(x=x, p=near(point.p), inputs=near(point.inputs))


def _matrices(manifold: Manifold) -> Sequence[np.ndarray]:
    return manifold.matrices[0], manifold.M, manifold.C, manifold.K, manifold.K_z
