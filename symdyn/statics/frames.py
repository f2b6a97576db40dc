"""From rotating axes to fixed ones: the change of variables that makes periodic equations constant, and names of frequencies.

Where a rotor is alike at every azimuth (an axisymmetric body, three or more like blades), A(t) = e^(St) A(0) e^(-St) with a
constant
S: y = e^(St) w gives w_dot = (A(0) - S) w with constant coefficients. S follows from dA/dt = S A - A S at many azimuths by least
squares; it must be a generator of rotations, with eigenvalues that are whole multiples of i times the speed, and A(t) computed
from it must be that of the mechanism at all azimuths: this is the proof. For blades e^(St) is the multi-blade transformation; for
a free body it turns body axes into fixed ones. Where several S do, that one is taken which leaves the displacements of the
bodies, in fixed axes, as constant as can be.
Source: Coleman and Feingold, NACA Report 1351 (1958); Lyapunov, The General Problem of the Stability of Motion (reducible
systems); Skjoldan and Hansen, J. Sound Vib. 327 (2009), on the principal frequency.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.linalg

from symdyn.statics.course import Course, scales
from symdyn.statics.manifold import Manifold, natural_length

# Azimuths that S is found from; its error, and that of the proof, relative to the size of A.
AZIMUTHS, PROVED = 8, 1e-9
# Uncertainty of the entries of S, as a part of the speed.
ROUNDED = 1e-12
# Eigenvalues of S are whole multiples of the speed to this.
WHOLE = 1e-6
# Singular values, squared, below this part of the largest leave S open.
OPEN = 1e-13
# The mean of the motion in fixed axes names a frequency if its share is this part of the largest harmonic's.
MEAN = 0.25
# Translations, or tilts, that go round a smaller part of the area than this take no part in a whirl.
PART = 0.01
# Bodies that do not spin name a frequency if they have this part of the motion.
SEEN = 1e-6


@dataclass(frozen=True, eq=False)
class Change:
    """S (m, m) of y = e^(St) w, and the largest difference, entry by entry, between A(t) and what S makes of A(0), (m, m)."""

    S: np.ndarray
    error: np.ndarray


def constant_change(course: Course) -> Change | None:
    """S that makes the equations of a course constant; None if there is none."""
    blocks = _blocks(course)
    scale = scales(course)
    into = scale / scale[:, None]
    A, rate = course.A * into, course.rate() * into
    picked = np.unique(np.linspace(0, len(A), AZIMUTHS, endpoint=False).astype(int))
    size = float(np.abs(A).max(initial=0.0)) or 1.0
    patterns = _patterns(blocks, len(scale))
    systems = [_commutator(A[k], patterns) for k in picked]
    G = sum(K.T @ K for K in systems)
    values, vectors = np.linalg.eigh(G)
    known = values > OPEN * max(values[-1], 1e-300)
    inverse = (vectors[:, known] / values[known]) @ vectors[:, known].T
    s = np.zeros(len(patterns))
    for _ in range(4):  # refined: the normal equations lose half of the digits
        s = s + inverse @ sum(K.T @ (rate[k].ravel() - K @ s) for K, k in zip(systems, picked, strict=True))
    for candidate in _candidates(course, patterns, scale, s, vectors[:, ~known]):
        S = _assembled(candidate, patterns, len(scale))
        S = np.zeros_like(S) if np.abs(S).max(initial=0.0) <= WHOLE / course.period else S
        if not _turns(S, course.period):
            continue
        turned = [scipy.linalg.expm(S * t) for t in course.times]
        error = np.max([np.abs(B - P @ A[0] @ np.linalg.inv(P)) for B, P in zip(A, turned, strict=True)], axis=0)
        if error.max(initial=0.0) <= PROVED * size:
            unknown = np.zeros_like(S)
            for entries in patterns:
                for i, j in entries:
                    unknown[i, j] = ROUNDED * 2 * np.pi / course.period if S.any() else 0.0
            return Change(S / into, (error + unknown) / into)
    return None


def _blocks(course: Course) -> list[tuple[slice, ...]]:
    """Parts of the variables that S turns within themselves; displacements and speeds alike where they are independent alike."""
    n_d, n_s, n_z = course.sizes
    eta, zeta, z = slice(0, n_d), slice(n_d, n_d + n_s), slice(n_d + n_s, n_d + n_s + n_z)
    alike = course.bundled or course.first.Z_u is course.first.Z_v
    result: list[tuple[slice, ...]] = [(eta, zeta)] if alike else [(eta,), (zeta,)]
    return [*result, *([(z,)] if n_z else [])]


def _patterns(blocks: list[tuple[slice, ...]], m: int) -> list[list[tuple[int, int]]]:
    """Entries of S that are one unknown."""
    result = []
    for parts in blocks:
        n = parts[0].stop - parts[0].start
        result += [[(part.start + i, part.start + j) for part in parts] for i in range(n) for j in range(n)]
    return result


def _commutator(A: np.ndarray, patterns: list[list[tuple[int, int]]]) -> np.ndarray:
    """Columns: S A - A S of each unknown, (m m, n)."""
    m = len(A)
    K = np.zeros((len(patterns), m, m))
    for k, entries in enumerate(patterns):
        for i, j in entries:
            K[k, i, :] += A[j, :]
            K[k, :, j] -= A[:, i]
    return K.reshape(len(patterns), m * m).T


def _assembled(s: np.ndarray, patterns: list[list[tuple[int, int]]], m: int) -> np.ndarray:
    S = np.zeros((m, m))
    for value, entries in zip(s, patterns, strict=True):
        for i, j in entries:
            S[i, j] = value
    return S


def _turns(S: np.ndarray, period: float) -> bool:
    """Whether e^(St) turns, with whole multiples of the frequency."""
    whole = np.linalg.eigvals(S) * period / (2 * np.pi)
    if np.abs(whole.real).max(initial=0.0) > WHOLE or np.abs(whole.imag - np.round(whole.imag)).max(initial=0.0) > WHOLE:
        return False
    return bool(np.abs(scipy.linalg.expm(S * period) - np.eye(len(S))).max(initial=0.0) < 1e3 * WHOLE)


def _candidates(course: Course, patterns: list[list[tuple[int, int]]], scale: np.ndarray, s: np.ndarray,
                loose: np.ndarray) -> list[np.ndarray]:
    """S in the order in which they are tried: first those that leave displacements of bodies in fixed axes, J e^(St), as constant
    as can be: of bodies that do not spin before those of the others."""
    if not loose.shape[1] or "J" not in course.first.point.module.functions:
        return [s]
    n_d, n = course.sizes[0], len(course.nodes)
    fields = displacements(course) * scale[:n_d]
    k = np.fft.fftfreq(n, 1 / n)
    k[np.abs(k) == n / 2] = 0.0
    rates = np.real(np.fft.ifft((2j * np.pi / course.period * k)[:, None, None] * np.fft.fft(fields, axis=0), axis=0))
    columns = [[(i, j) for i, j in entries if i < n_d and j < n_d] for entries in patterns]
    still = _rows_that_do_not_spin(course.first)
    result = [s]
    for rows in (still, ~still):
        if not rows.any() or not loose.shape[1]:
            continue
        systems, right = [], []
        for field, rate in zip(fields[::max(1, n // AZIMUTHS)][:, rows], rates[::max(1, n // AZIMUTHS)][:, rows], strict=True):
            K = np.zeros((len(patterns), *field.shape))
            for p, entries in enumerate(columns):
                for i, j in entries:
                    K[p, :, j] += field[:, i]
            K = K.reshape(len(patterns), -1).T
            systems.append(K @ loose)
            right.append(-rate.ravel() - K @ result[-1])
        Q, R = np.linalg.qr(np.vstack(systems))
        U, values, Vt = np.linalg.svd(R)
        kept = values > 1e-7 * values.max(initial=1e-300)
        count = int(kept.sum())
        change = Vt[:count].T @ ((U[:, :count].T @ (Q.T @ np.concatenate(right))) / values[:count])
        result.append(result[-1] + loose @ change)
        loose = loose @ Vt[count:].T
    return result[::-1]


def _rows_that_do_not_spin(manifold: Manifold) -> np.ndarray:
    """Mask of the rows of J of bodies that do not spin."""
    speeds = spinning(manifold)
    per_body = 3 if manifold.point.module.metadata.planar else 6
    return np.asarray(np.repeat(speeds <= 1e-9 * max(float(speeds.max(initial=0.0)), 1e-300), per_body))


def displacements(course: Course) -> np.ndarray:
    """Displacements of all bodies in fixed axes by those among the variables, (nodes, rows of J, n_d), turns times the natural
    length."""
    point = course.first.point
    per_body = 3 if point.module.metadata.planar else 6
    fields = np.array([node.point.evaluate("J") @ course.displaced(node) for node in course.nodes])
    turns = np.tile(np.arange(per_body) >= (2 if per_body == 3 else 3), fields.shape[1] // per_body)
    return np.where(turns, natural_length(point), 1.0)[:, None] * fields


def spinning(manifold: Manifold) -> np.ndarray:
    """Angular speed of every body, rad/s, (n_b,)."""
    point = manifold.point
    if "J" not in point.module.functions:
        return np.zeros(0)
    per_body = 3 if point.module.metadata.planar else 6
    velocities = (point.evaluate("J") @ point.u).reshape(-1, per_body)
    return np.asarray(np.linalg.norm(velocities[:, (2 if per_body == 3 else 3):], axis=1))


def axis(course: Course) -> np.ndarray:
    """Direction of the rotation, that of the body that spins fastest at the start, n-frame, (3,), with the sense of the spin."""
    point = course.first.point
    per_body = 3 if point.module.metadata.planar else 6
    velocities = (point.evaluate("J") @ point.u).reshape(-1, per_body)
    turns = velocities[:, 3:] if per_body == 6 else np.hstack([np.zeros((len(velocities), 2)), velocities[:, 2:]])
    sizes = np.linalg.norm(turns, axis=1)
    return np.asarray(turns[int(np.argmax(sizes))] / max(float(sizes.max(initial=0.0)), 1e-300))


@dataclass(frozen=True, eq=False)
class Seen:
    """A mode as an observer sees it: harmonics (multiple, share), the largest first, counted from its exponent's frequency;
    whirl, from -1 to 1: the sense in which the displacement of the largest one goes round, positive with the rotation, 0 where
    translation and tilt go round in opposite senses; whirls: those of translation and of tilt"""

    harmonics: tuple[tuple[int, float], ...]
    whirl: float = 0.0
    whirls: tuple[float, float] = (0.0, 0.0)


class Observer:
    """Looks at the displacements of the bodies along a course, from the fixed frame or from axes that turn with the rotor."""

    def __init__(self, course: Course, rotating: bool = False) -> None:
        self.course = course
        self.blind = "J" not in course.first.point.module.functions
        self.rotating = False
        if self.blind:
            return
        self.fields = displacements(course)
        self.per_body = 3 if course.first.point.module.metadata.planar else 6
        self.still = _rows_that_do_not_spin(course.first)
        self.turning = bool(not self.still.all())
        self.axis = axis(course) if self.turning else np.array([0.0, 0.0, 1.0])
        self.rotating = rotating and self.turning
        if self.rotating:
            angles = -2 * np.pi * np.arange(len(self.fields)) / len(self.fields)
            self.fields = np.array([self._turned(field, angle) for field, angle in zip(self.fields, angles, strict=True)])

    @property
    def sentence(self) -> str:
        """Who sees the frequencies."""
        who = "an observer who turns with the rotor" if self.rotating else "the fixed frame"
        return f"frequencies are those that {who} sees"

    def _turned(self, field: np.ndarray, angle: float) -> np.ndarray:
        """Displacements (rows of J, n_d) with their vectors turned about the axis."""
        R = scipy.linalg.expm(angle * np.cross(self.axis, np.eye(3)).T)
        result = field.copy()
        for start in range(0, len(field), self.per_body):
            if self.per_body == 3:
                result[start:start + 2] = R[:2, :2] @ field[start:start + 2]
            else:
                result[start:start + 3], result[start + 3:start + 6] = R @ field[start:start + 3], R @ field[start + 3:start + 6]
        return result

    def in_fixed_axes(self, turned: np.ndarray) -> bool:
        """Whether variables w with displacements e^(st) w, s at the nodes (n, n_d, n_d), are those of the fixed frame: what the
        bodies move in all is constant then, for a body that spins as for a set of blades."""
        if self.blind:
            return False
        fields = self.fields @ turned
        whole = fields.reshape(len(fields), -1, self.per_body, fields.shape[2]).sum(axis=1)
        return bool(np.ptp(whole, axis=0).max(initial=0.0) <= SEEN * np.abs(fields).max(initial=1e-300))

    def seen(self, shapes: np.ndarray, fixed: bool) -> Seen:
        """A mode from its motion p(t) at the nodes, (n, m) complex.

        From the fixed frame the bodies that do not spin count, if they move; else, in variables that are constant in fixed axes
        already (`fixed`), the mean; else all bodies.
        """
        if self.blind:
            return Seen(((0, 1.0),))
        n_d, n = self.course.sizes[0], len(self.fields)
        fields = np.einsum("tij,tj->ti", self.fields, shapes[:, :n_d])
        harmonics = np.fft.fft(fields, axis=0) / n
        energies = np.abs(harmonics) ** 2
        total = float(energies.sum())
        if total <= 0:
            return Seen(((0, 1.0),))
        multiples = np.round(np.fft.fftfreq(n, 1 / n)).astype(int)
        alone = 0.0
        if not self.rotating:
            if self.still.any() and energies[:, self.still].sum() > SEEN * total:
                energies = energies * self.still
            elif fixed:
                return Seen(((0, 1.0),), *self._whirl(harmonics[0]))
            else:
                alone = MEAN
        shares = energies.sum(axis=1) / energies.sum()
        order = sorted(range(n), key=lambda k: (-round(float(shares[k]), 9), abs(multiples[k]), -multiples[k]))
        if shares[0] > alone * shares[order[0]] > 0:  # part of the motion is seen with the frequency of the exponent itself
            order.remove(0)
            order.insert(0, 0)
        kept = tuple((int(multiples[k]), float(shares[k])) for k in order if shares[k] > 1e-6)[:8]
        return Seen(kept, *self._whirl(harmonics[order[0]] * (energies[order[0]] > 0)))

    def _whirl(self, amplitudes: np.ndarray) -> tuple[float, tuple[float, float]]:
        """Twice the area that displacements and tilts go round per cycle, over the sum of their squares, about the axis; and the
        same of translations and of tilts apart."""
        parts = amplitudes.reshape(-1, self.per_body)
        kinds = [np.hstack([parts[:, :2], np.zeros((len(parts), 1))])] if self.per_body == 3 else [parts[:, :3], parts[:, 3:]]
        areas, whole = [], 0.0
        for vectors in kinds:  # displacements and tilts each have a sense
            across = vectors - np.outer(vectors @ self.axis, self.axis)
            areas.append((-float(np.imag(np.cross(across.conj(), across) @ self.axis).sum()), float((np.abs(across) ** 2).sum())))
            whole += float((np.abs(vectors) ** 2).sum())
        area, size = sum(a for a, _ in areas), sum(n for _, n in areas)
        if not size > 0.5 * whole:  # mainly along the axis
            return 0.0, (0.0, 0.0)
        least = PART * max(abs(a) for a, _ in areas)
        each = [a / n if abs(a) > least else 0.0 for a, n in areas]
        whirls = each[0], each[1] if len(each) > 1 else 0.0
        return area / size if whirls[0] * whirls[1] >= 0 else 0.0, whirls
