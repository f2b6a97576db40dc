"""Floquet theory: stability of a periodic motion by the monodromy matrix of its linear equations.

y_dot = A(t) y with A(t + T) = A(t): Y(T) of Y(0) = 1 carries a disturbance over a period; its eigenvalues, the multipliers mu,
decide. A solution is exp(lambda t) p(t) with p of period T and lambda = log(mu) / T, known but for multiples of i 2 pi / T: p
says which of them a motion shows.
Source: Meirovitch, Methods of Analytical Dynamics, section 7.4; Skjoldan and Hansen, On the similarity of the Coleman and
Lyapunov-Floquet transformations for modal analysis of bladed rotor structures, J. Sound Vib. 327 (2009).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from symdyn.statics.course import PRECISE, Course, scales
from symdyn.statics.spectrum import DISCRETE, Spectrum, Unknown, spectrum

# Steps a period of collocation, doubled until the monodromy matrix changes by less than this part of it; at least, at most.
CHANGES, LEAST_STEPS, MOST_STEPS = 1e-12, 64, 8192
# Steps while a closed motion is looked for.
ROUGHLY = 128
# The bound of what is not known is this many times the last change, and at least this part of the matrix.
SAFETY, LEAST = 1.0, 2e-12
# Along a motion that accelerates also its own error, that of its steps times what they add up to.
MOTION = 10 * PRECISE


@dataclass(frozen=True, eq=False)
class Fundamental:
    """Y at the nodes of a course, in its variables, (n, k, k); the monodromy matrix, in those of the manifold (m, m), known to
    E."""

    nodes: np.ndarray
    monodromy: np.ndarray
    E: np.ndarray


def monodromy(course: Course) -> np.ndarray:
    """The monodromy matrix in the variables of the manifold, (m, m), good enough for Newton's method."""
    return course.reduced(_integrated(course, ROUGHLY)[-1])


def fundamental(course: Course) -> Fundamental:
    """The fundamental matrix with a bound of its error."""
    steps = max(LEAST_STEPS, len(course.nodes))
    before = course.reduced(_integrated(course, steps)[-1])
    while True:
        steps *= 2
        values = _integrated(course, steps)
        end = course.reduced(values[-1])
        change = np.abs(end - before)
        size = np.maximum(np.abs(end), 1e-3 * np.abs(end).max(axis=0, initial=0.0)[None, :])
        if (change <= CHANGES * size).all() or steps >= MOST_STEPS:
            break
        before = end
    scale = scales(course)
    speed = float((np.abs(course.A[0]) * (scale / scale[:, None])).max(initial=0.0))
    motion = MOTION if any(node.point.ud.any() for node in course.nodes) else 0.0
    E = SAFETY * change + (LEAST + motion + course.tail * speed * course.period) * size
    return Fundamental(values[:-1:steps // len(course.nodes)], end, E)


def _integrated(course: Course, steps: int) -> np.ndarray:
    """Y at equal steps from the start to the end, (steps + 1, m, m), by Gauss collocation of order 8.

    Source: Hairer, Norsett and Wanner, Solving Ordinary Differential Equations I, section II.7.
    """
    scale = scales(course)
    into = scale / scale[:, None]
    h, m = course.period / steps, course.A.shape[1]
    c, a, b = _gauss(4)
    A = course.sampled((h * (np.arange(steps)[:, None] + c)).ravel()).reshape(steps, 4, m, m) * into
    values = np.empty((steps + 1, m, m))
    values[0] = np.eye(m)
    identity = np.eye(4 * m)
    for k in range(steps):
        # Slopes K_i = A_i (Y + h sum_j a_ij K_j), of all columns of Y at once.
        left = identity - h * (a[:, None, :, None] * A[k][:, :, None, :]).reshape(4 * m, 4 * m)
        slopes = np.linalg.solve(left, A[k].reshape(4 * m, m))
        values[k + 1] = values[k] + h * np.einsum("i,ijk->jk", b, slopes.reshape(4, m, m)) @ values[k]
    return np.asarray(values / into)


def _gauss(s: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Nodes (s,), matrix (s, s) and weights (s,) of Gauss collocation on [0, 1]."""
    roots, weights = np.polynomial.legendre.leggauss(s)
    c = (roots + 1) / 2
    powers = np.arange(s)
    integrals = c[:, None] ** (powers + 1) / (powers + 1)
    a = np.linalg.solve((c[:, None] ** powers).T, integrals.T).T
    return c, a, weights / 2


def multipliers(result: Fundamental) -> Spectrum:
    """The eigenvalues of the monodromy matrix, judged against the unit circle."""
    return spectrum(result.monodromy, Unknown.of(result.E), DISCRETE)


def exponents(result: Spectrum, period: float) -> np.ndarray:
    """log(mu) / T, imaginary parts up to pi / T, (m,); of what is neutral without rounding: no real part; zero for mu = 1."""
    values = np.where(result.values == 0, 1e-300, result.values)
    logs = np.log(values.astype(complex)) / period
    logs[result.zeros] = 0.0
    settled = [k for k in result.imaginary if k not in set(result.undecided.tolist())]
    logs[settled] = 1j * logs[settled].imag
    return np.asarray(logs)
