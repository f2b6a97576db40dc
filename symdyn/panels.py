"""Panels: parts of a step on which a quantity is represented by a polynomial, to decide whether it passes zero there.

On a panel [a, b] a quantity g is sampled at N Chebyshev-Lobatto nodes and at one check point between two of them. With the
coefficients c of the polynomial through the nodes in Chebyshev polynomials, |T_i| <= 1,

    |c_0| - (|c_1| + ... + |c_7|) > error                     g has no zero on the panel,
    |s_0| - (|s_1| + ... + |s_6|) > SLOPE_ERROR * error       g is monotone: it has a zero only if its signs at the ends differ,

where s are the coefficients of the polynomial's derivative and

    error = TAIL (|c_6| + |c_7|) + CHECK |g - polynomial at the check point|.

Samples do not see a pulse between them. So a quantity is bounded by interval arithmetic, too (symdyn.tape.intervals): on [-1, 1]
for [a, b] it lies within V, its derivative within D and its second derivative within B, |B| <= beta. Nothing is between the
samples if

    0 is not in V, in D, or in B (it has no zero, is monotone, or has no more zeros than a parabola), or if for every two samples
    g_i, g_j next to each other, h apart,
    min(|g_i|, |g_j|) > beta h^2/8 with one sign              g differs from the chord by no more than that,
    |g_i - g_j| > beta h^2/2                                  g is monotone between them.

The bounds hold for the state and the inputs that the samples show, which are smooth within a step. A panel that is neither, or
not proved, is divided at its middle, so that a quantity is sampled as finely as it varies, and finest near its extremes close to
zero. Source: Trefethen, Approximation Theory and Approximation Practice (2013), chapters 3, 8 and 18; Boyd, SIAM J. Numer. Anal.
40 (2002), 1666, for zeros by division into parts.
"""

from __future__ import annotations

import math

import numpy as np

N = 8
# Coefficients of a resolved function fall off geometrically: what is left out is of the size of the last ones. The check point is
# where the difference of a function and its polynomial is nearly largest; it rejects samples that only seem to be resolved.
TAIL, CHECK = 2.0, 4.0
# The derivative of a polynomial of degree 8 is at most 8^2 times as large as itself (Markov).
SLOPE_ERROR = 64.0
# Quantities below so many times the change that rounding of the state makes in them are not resolved any further.
NOISE = 32.0
# Rounding of a state within a step, by that of its size over the step: coefficients of polynomials of high order cancel.
DENSE = 16.0
# Parts of a step below which a panel is not divided to find where a quantity can still be evaluated.
EVALUATED = 1e-3
# The same for the second derivative, 8^2 (8^2 - 1)/3 times.
BEND_ERROR = 1344.0
# Divisions of one step for the sake of proofs that no zero is between samples.
MOST_PROOFS = 1024
# Divisions of one step since its latest event before its zeros count as too many to be resolved; after the first such step.
MOST_DIVISIONS, FEW_DIVISIONS = 2048, 32

_ANGLES = [math.pi * (1 - j / (N - 1)) for j in range(N)]
_CHECK_AT = 0.43


def _coefficients() -> np.ndarray:
    """Coefficients in Chebyshev polynomials from the values at the nodes, (N, N)."""
    ends = np.array([0.5, *[1.0] * (N - 2), 0.5])
    cosines = np.cos(np.outer(np.arange(N), _ANGLES))
    return np.array(2 / (N - 1) * ends[:, None] * cosines * ends[None, :])


def _derivative() -> np.ndarray:
    """Coefficients of the derivative from those of a function on [-1, 1], (N - 1, N)."""
    matrix = np.zeros((N + 1, N))
    for i in range(N - 1, 0, -1):
        matrix[i - 1] = matrix[i + 1]
        matrix[i - 1, i] += 2 * i
    matrix[0] *= 0.5
    return matrix[:N]


# Where the nodes, then the check point, are within a panel, parts of its length.
NODES = np.array([*[0.5 * (1 + math.cos(angle)) for angle in _ANGLES], 0.5 * (1 + _CHECK_AT)])
NODES[0], NODES[N - 1] = 0.0, 1.0
COEFFICIENTS = _coefficients()
SLOPES = (_derivative() @ COEFFICIENTS)[:N - 1]
BENDS = (_derivative() @ _derivative() @ COEFFICIENTS)[:N - 2]
# Between nodes next to each other on [-1, 1]; the largest in parts of a panel.
GAPS = 2 * np.diff(NODES[:N])
WIDEST = float(GAPS.max()) / 2
# The polynomial at the check point from the values at the nodes, (N,).
AT_CHECK = np.cos(np.arange(N) * math.acos(_CHECK_AT)) @ COEFFICIENTS


def undecided(values: np.ndarray) -> np.ndarray:
    """Mask of the quantities that may have zeros on a panel that the signs at its ends do not show, (n,) of bool.

    values   at the nodes and at the check point, (N + 1, n)
    """
    nodes, check = values[:N], values[N]
    c, s = np.abs(COEFFICIENTS @ nodes), np.abs(SLOPES @ nodes)
    error = TAIL * (c[-2] + c[-1]) + CHECK * np.abs(check - AT_CHECK @ nodes)
    without = c[0] - c[1:].sum(axis=0) > error
    monotone = s[0] - s[1:].sum(axis=0) > SLOPE_ERROR * error
    return np.array(~(without | monotone) & (c.sum(axis=0) > 0))


def jets(left: float, right: float, values: np.ndarray) -> np.ndarray:
    """Bounds of t, from left to right on a panel, and of quantities that the samples show, and of their first and second
    derivatives on [-1, 1], (1 + n, 6): from, to of each.

    values   at the nodes and at the check point, (N + 1, n)
    """
    nodes = values[:N]
    error = CHECK * np.abs(values[N] - AT_CHECK @ nodes)
    bounds = np.empty((1 + values.shape[1], 6))
    bounds[0] = min(left, right), max(left, right), 0.5 * (right - left), 0.5 * (right - left), 0.0, 0.0
    for k, (matrix, factor) in enumerate(((COEFFICIENTS, 1.0), (SLOPES, SLOPE_ERROR), (BENDS, BEND_ERROR))):
        c = matrix @ nodes
        radius = np.abs(c[1:]).sum(axis=0) + factor * error
        bounds[1:, 2 * k], bounds[1:, 2 * k + 1] = c[0] - radius, c[0] + radius
    return bounds


def unproved(values: np.ndarray, bounds: np.ndarray) -> np.ndarray:
    """Mask of the quantities that may have zeros between samples, of those that `undecided` decides, (n,) of bool.

    values   at the nodes and at the check point, (N + 1, n); bounds: of value, derivative and second derivative, (n, 6)
    """
    low, high = bounds[:, 0::2], bounds[:, 1::2]
    proved = ((low > 0) | (high < 0)).any(axis=1)
    beta = np.maximum(np.abs(low[:, 2]), np.abs(high[:, 2]))
    a, b = values[:N - 1], values[1:N]
    allowance = np.outer(GAPS**2, beta)
    clear = (a * b > 0) & (np.minimum(np.abs(a), np.abs(b)) > allowance / 8)
    return np.array(~(proved | (clear | (np.abs(a - b) > allowance / 2)).all(axis=0)))


def size(values: np.ndarray) -> np.ndarray:
    """Sum of the sizes of the coefficients, a bound for the polynomial, (n,); values as for `undecided`."""
    return np.array(np.abs(COEFFICIENTS @ values[:N]).sum(axis=0))


def roundings(n: int) -> np.ndarray:
    """Irregular changes of the entries of a state, in units of their rounding, (n,): no cancellation is likely."""
    return np.array([DENSE * (2 * ((0.6180339887498949 * (i + 1)) % 1.0) - 1) for i in range(n)])
