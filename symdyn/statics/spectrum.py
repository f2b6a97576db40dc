"""Eigenvalues judged by backward error, entry by entry: which are proved to decay or to grow, and what the others are.

A matrix A in doubles stands for all matrices that differ from it by at most E, entry by entry, or by L X with |X| <= F: what is
not known of stiffness and damping comes through the inverse of the mass matrix, L. A circle around an eigenvalue
that no such change carries an eigenvalue across, because |(z - A)^-1| E + |(z - A)^-1 L| F has a spectral radius below 1 on it,
proves on which side of the boundary of stability (imaginary axis, or unit circle) what is inside stays. The test does not
depend on units: a
change of scales by a diagonal D leaves the spectral radius as it is, and damping of a gram counts next to stiffness of a bridge.
The remaining eigenvalues lie on the boundary, but for rounding. Jordan blocks of the eigenvalue zero are counted by a staircase
of null spaces, whose ranks are judged by the same E.
Source: Higham, Accuracy and Stability of Numerical Algorithms, chapter 7 (componentwise errors); Hinrichsen and Pritchard,
Mathematical Systems Theory I, section 5.3 (spectral value sets); Golub and Wilkinson, Ill-conditioned eigensystems and the
computation of the Jordan canonical form, SIAM Review 18 (1976).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
import scipy.linalg

EPSILON = float(np.finfo(float).eps)
# Up to this size eigenvalues are computed in BITS bits, so that only the rounding of the entries counts.
LARGEST, BITS = 96, 212
# Radii of circles, as parts of the distance to the boundary; points on each.
RADII, POINTS = (0.9, 0.5, 0.2), 8
# First-order bounds this much smaller than every distance need no circle.
CLEAR = 1e-3
# A singular value below this many times its rounding is zero; the same for members of a group of eigenvalues.
ZERO = 16.0
# Rounding beyond this part of what damps or drives a mode leaves its sign open.
DECIDED = 1e-6


@dataclass(frozen=True)
class Boundary:
    """Where stability ends. `margin`: signed distance, negative inside; `neutral`: the eigenvalue of what stays as it is."""

    margin: Callable[[complex], float]
    neutral: complex


CONTINUOUS = Boundary(lambda value: value.real, 0.0)
DISCRETE = Boundary(lambda value: abs(value) - 1.0, 1.0)


@dataclass(frozen=True, eq=False)
class Unknown:
    """Uncertainty of a matrix A (m, m): changes up to E (m, m) entry by entry; L X with |X| <= F; and L Y S A with |Y| <=
    G, of a mass matrix whose inverse is L and that acts on the rates S A x. L (m, k), F (k, m), G (k, k), S (k, m).

    rounding (m, m): entries that are no larger are zeros but for rounding
    """

    E: np.ndarray
    L: np.ndarray
    F: np.ndarray
    G: np.ndarray
    S: np.ndarray
    rounding: np.ndarray

    @classmethod
    def of(cls, E: np.ndarray) -> Unknown:
        """Changes entry by entry alone."""
        m = len(E)
        return cls(E, np.zeros((m, 0)), np.zeros((0, m)), np.zeros((0, 0)), np.zeros((0, m)), E)

    def scaled(self, scale: np.ndarray) -> Unknown:
        """Uncertainty of D^-1 A D with the diagonal D."""
        into = scale / scale[:, None]
        return Unknown(self.E * into, self.L / scale[:, None], self.F * scale, self.G, self.S * scale, self.rounding * into)

    def plus(self, E: np.ndarray) -> Unknown:
        """With more changes entry by entry."""
        return Unknown(self.E + E, self.L, self.F, self.G, self.S, self.rounding + E)

    def within(self, columns: np.ndarray) -> Unknown:
        """Uncertainty of V^T A V for orthonormal columns V."""
        size = np.abs(columns)
        return Unknown(size.T @ self.E @ size, columns.T @ self.L, self.F @ size, self.G, self.S @ columns,
                       size.T @ self.rounding @ size)

    def along(self, A: np.ndarray, left: np.ndarray, right: np.ndarray) -> np.ndarray:
        """Changes of the numbers w^H A x for columns w and x, (n,)."""
        w = left.conj().T
        changes = np.abs(w) @ self.E + np.abs(w @ self.L) @ self.F
        mass = np.einsum("ki,ij,jk->k", np.abs(w @ self.L), self.G, np.abs(self.S @ A @ right))
        return np.asarray(np.einsum("kj,jk->k", changes, np.abs(right)) + mass)

    def reaches(self, A: np.ndarray, inverse: np.ndarray) -> float:
        """The largest spectral radius of (z - A)^-1 times a change of A, from (z - A)^-1: at 1 some change has the eigenvalue
        z."""
        changes = np.abs(inverse) @ self.E + np.abs(inverse @ self.L) @ self.F
        mass = np.abs(self.S @ A @ inverse @ self.L) @ self.G
        return _radius(changes) + _radius(mass)


def _radius(X: np.ndarray) -> float:
    """Spectral radius of a matrix without negative entries, or an upper bound below 0.1."""
    if not X.size:
        return 0.0
    if not np.isfinite(X).all():
        return np.inf
    bound = float(min(X.sum(axis=0).max(), X.sum(axis=1).max()))
    return bound if bound < 0.1 else float(np.abs(np.linalg.eigvals(X)).max())


@dataclass(frozen=True, eq=False)
class Spectrum:
    """Eigenvalues of A (m, m), but for what is not known of it.

    values       (m,) complex, by their distance from zero; right, left (m, m): eigenvectors as columns, left^H A = value left^H
    signs        (m,): 1 and -1 where growth or decay is proved, else 0; radii (m,): first-order bound of the error
    chains       of the neutral eigenvalue: how many Jordan blocks have at least 1, 2, ... members; () without it
    driven       (m,): what entries that are more than rounding contribute to damping or growth of each mode, 1/s; NaN: unknown
    """

    A: np.ndarray
    unknown: Unknown
    boundary: Boundary
    values: np.ndarray
    right: np.ndarray
    left: np.ndarray
    signs: np.ndarray
    radii: np.ndarray
    chains: tuple[int, ...]
    driven: np.ndarray = field(default_factory=lambda: np.zeros(0))

    @cached_property
    def zeros(self) -> np.ndarray:
        """Indices of the neutral eigenvalues, those of `chains`: the nearest ones among those without a proved sign."""
        open_ = np.flatnonzero(self.signs == 0)
        order = open_[np.argsort(np.abs(self.values[open_] - self.boundary.neutral), kind="stable")]
        return np.asarray(np.sort(order[:sum(self.chains)]))

    @property
    def imaginary(self) -> np.ndarray:
        """Indices of eigenvalues that are neither proved to grow or decay, nor zero: undamped oscillations."""
        open_ = np.flatnonzero(self.signs == 0)
        return np.asarray(open_[~np.isin(open_, self.zeros)])

    @cached_property
    def undecided(self) -> np.ndarray:
        """Indices of oscillations, and of real eigenvalues, whose sign rounding hides: something damps or drives them, but less
        than E lets be known."""
        indices = []
        for k in self.imaginary:
            acts = float(self.driven[k]) if len(self.driven) else 0.0
            radius = float(self.radii[k])
            if (np.abs(self.values - self.values[k]) <= np.sqrt(EPSILON) * abs(self.values[k])).sum() > 1:
                # A group of equal ones: where they have a Jordan block, the root of what is not known.
                radius = min(radius, float(np.sqrt(EPSILON)) * abs(complex(self.values[k])))
            stands = abs(self.values[k].imag) > ZERO * radius or abs(self.boundary.margin(complex(self.values[k]))) == 0
            if not stands or (acts > 0 and radius > DECIDED * acts):
                indices.append(int(k))
        return np.array(indices, dtype=int)

    @cached_property
    def defective(self) -> bool:
        """Whether the zero or an undamped oscillation has a Jordan block: a disturbance grows with time, without bound."""
        return len(self.chains) > 1 or any(self._short(k) for k in self.imaginary)

    def _short(self, k: int) -> bool:
        """Whether the eigenvectors of the group of an eigenvalue are fewer than its members."""
        near = np.abs(self.values - self.values[k]) <= np.sqrt(EPSILON) * max(abs(self.values[k]), 1e-300)
        near &= self.signs == 0
        if near.sum() < 2:
            return False
        shifted = self.A - complex(np.mean(self.values[near])) * np.eye(len(self.A))
        return _nullity(*balanced(shifted, self.unknown)[:2]) < int(near.sum())

    @property
    def verdict(self) -> str:
        """"stable", "neutral", "drifts", "unstable" or "not decided"; "" without eigenvalues."""
        if not len(self.values):
            return ""
        if (self.signs > 0).any():
            return "unstable"
        if (self.signs < 0).all():
            return "stable"
        if len(self.undecided):
            return "not decided"
        return "drifts" if self.defective else "neutral"


def spectrum(A: np.ndarray, unknown: Unknown, boundary: Boundary = CONTINUOUS,
             driven: Callable[[np.ndarray, np.ndarray], np.ndarray] | None = None) -> Spectrum:
    """The eigenvalues of A with their signs, but for what is not known of it.

    driven   from right and left eigenvectors what damps or drives each mode, (m,); see Spectrum
    """
    m = len(A)
    A = np.where(np.abs(A) <= unknown.rounding, 0.0, A)  # so that structure is visible
    B, inner, scale = balanced(A, unknown)
    if m and m <= LARGEST:
        values, right, left = _precise(B)
    else:
        values, left, right = scipy.linalg.eig(B, left=True)
        inner = inner.plus(np.full_like(B, m * EPSILON * np.abs(B).max(initial=0.0)))
    order = np.lexsort((values.imag, np.abs(values)))
    values, right, left = values[order], right[:, order], left[:, order]
    radii = _first_order(B, inner, right, left)
    signs = np.array([_sign(k, B, inner, values, radii, boundary) for k in range(m)], dtype=int)
    chains = _staircase(B - boundary.neutral * np.eye(m), inner) if (signs == 0).any() else ()
    right, left = right * scale[:, None], left / scale[:, None]
    acting = driven(right, left) if driven is not None and (signs == 0).any() else np.zeros(0)
    return Spectrum(A, unknown, boundary, values, right, left, signs, radii, chains, acting)


def balanced(A: np.ndarray, unknown: Unknown) -> tuple[np.ndarray, Unknown, np.ndarray]:
    """D^-1 A D, what is not known of it, and the diagonal of D, powers of two that make rows and columns of A alike."""
    if not len(A):
        return A, unknown, np.ones(0)
    _, (scale, _) = scipy.linalg.matrix_balance(np.abs(A), permute=False, separate=True)
    return A * (scale / scale[:, None]), unknown.scaled(scale), scale


def _precise(B: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Eigenvalues, right and left eigenvectors by FLINT, rounded to doubles at the end."""
    from flint import acb, acb_mat
    from flint import ctx as context

    m, before = len(B), context.prec
    context.prec = BITS
    try:
        matrix = acb_mat(m, m, [acb(float(v)) for v in B.ravel()])
        result, left, right = matrix.eig(left=True, right=True, algorithm="approx")
        values = np.array([_rounded(v) for v in result])
        rights = np.array([_rounded(right[i, j]) for i in range(m) for j in range(m)]).reshape(m, m)
        # FLINT's rows are those of the inverse: y A = value y.
        lefts = np.array([_rounded(left[i, j]) for i in range(m) for j in range(m)]).reshape(m, m).conj().T
    finally:
        context.prec = before
    size = np.abs(B).max(initial=0.0)
    values = np.where(np.abs(values) <= 2.0 ** (60 - BITS) * size, 0.0, values)
    imag = np.where(np.abs(values.imag) <= EPSILON**2 * np.abs(values), 0.0, values.imag)
    values = values.real + 1j * imag
    for k in np.flatnonzero(~np.isfinite(rights).all(axis=0) | ~np.isfinite(lefts).all(axis=0)):  # of exact Jordan blocks
        U, _, Vt = np.linalg.svd(B - values[k] * np.eye(m))
        rights[:, k], lefts[:, k] = Vt[-1].conj(), U[:, -1]
    return values, _unit(rights), _unit(lefts)


def _rounded(value: object) -> complex:
    return complex(float(value.real.mid()), float(value.imag.mid()))  # type: ignore[attr-defined]


def _unit(columns: np.ndarray) -> np.ndarray:
    sizes = np.abs(columns).max(axis=0, initial=0.0)
    columns = columns / np.where(sizes > 0, sizes, 1.0)
    norms = np.linalg.norm(columns, axis=0)
    return np.asarray(columns / np.where(norms > 0, norms, 1.0))


def _first_order(B: np.ndarray, unknown: Unknown, right: np.ndarray, left: np.ndarray) -> np.ndarray:
    """Change of w^H A x over |w^H x| of every eigenvalue; infinite at a defective one."""
    above = unknown.along(B, left, right)
    below = np.abs(np.einsum("ik,ik->k", left.conj(), right))
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(np.where(above > 0, above / below, 0.0))


def _sign(k: int, B: np.ndarray, unknown: Unknown, values: np.ndarray, radii: np.ndarray, boundary: Boundary) -> int:
    """1 or -1 if no change within E takes the eigenvalue to the boundary, else 0."""
    value = complex(values[k])
    margin = boundary.margin(value)
    if margin == 0:
        return 0
    side = 1 if margin > 0 else -1
    others = np.delete(values, k)
    apart = min(abs(margin), float(np.abs(others - value).min(initial=np.inf)))
    if radii[k] <= CLEAR * apart:
        return side
    for part in RADII:
        points = value + part * abs(margin) * np.exp(2j * np.pi * (np.arange(POINTS) + 0.5) / POINTS)
        if all(_kept_apart(complex(z), B, unknown) for z in points):
            return side
    return 0


def _kept_apart(z: complex, B: np.ndarray, unknown: Unknown) -> bool:
    """Whether no matrix that B stands for has the eigenvalue z."""
    try:
        return unknown.reaches(B, np.linalg.inv(z * np.eye(len(B)) - B)) < 1
    except np.linalg.LinAlgError:
        return False


def _nullity(B: np.ndarray, unknown: Unknown) -> int:
    """Singular values that are zero as far as is known."""
    U, values, Vt = np.linalg.svd(B)
    noise = unknown.along(B, U, Vt.conj().T) + EPSILON * values.max(initial=0.0)
    return int((values <= ZERO * noise).sum())


def _staircase(B: np.ndarray, unknown: Unknown) -> tuple[int, ...]:
    """Number of Jordan blocks of the eigenvalue zero with at least 1, 2, ... members."""
    result: list[int] = []
    while len(B):
        count = _nullity(B, unknown)
        if not count:
            break
        result.append(count)
        inner = np.linalg.svd(B)[2][:len(B) - count].T  # complement of the null space
        B, unknown = inner.T @ B @ inner, unknown.within(inner)
    return tuple(result)
