"""Combinations of unknowns that data and priors determine, with their covariance.

With D = U S V^T of the scaled derivatives of the data, singular values below a part of the largest are taken for zero: the
sensitivities are no more exact. Priors are exact, so that they determine what they act on, however little it is. The null space
of both is then left open. Source: Golub and Van Loan, Matrix Computations, 4th ed., 5.5 (rank-deficient least squares).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

# Singular values of the scaled derivatives below this part of the largest say that a combination is not determined: the
# sensitivities are accurate to about this.
UNDETERMINED = 1e-7
# The same of the rows of data and priors together, of which zeros are exact.
_ZERO = 1e-12
# Squares of shares of an unknown in open combinations from which on it is not determined itself.
TOUCHED = 1e-6


@dataclass(frozen=True)
class Determined:
    """Information of rows of data and priors on unknowns.

    covariance   (n, n), of the combinations that are determined; NaN in rows and columns of unknowns that open ones touch
    open_ones    orthonormal combinations of unknowns, relative to their scale, that are not determined, (k, n)
    leverage     what each row has determined of the unknowns, (m,), in sum n - k
    step         of the unknowns to the minimum of the linear problem, (n,): without open combinations
    strength     largest singular value by unknowns relative to their scale
    """

    covariance: np.ndarray
    open_ones: np.ndarray
    leverage: np.ndarray
    step: np.ndarray
    strength: float

    @classmethod
    def of(cls, data: np.ndarray, priors: np.ndarray, residuals: np.ndarray, sizes: np.ndarray, scale: np.ndarray) -> Determined:
        """From derivatives of the residuals of data (m_d, n) and of priors (m_p, n), their values (m_d + m_p,), the sizes of the
        unknowns (n,) and the scale that open combinations are relative to (n,); all for standard deviations of 1."""
        n = len(sizes)
        U, values, V = np.linalg.svd(data * sizes, full_matrices=False)
        kept = values > UNDETERMINED * values.max(initial=0.0)
        rows = np.vstack([(U[:, kept] * values[kept]) @ V[kept], priors * sizes, np.zeros((max(0, n - len(residuals)), n))])
        U, values, V = np.linalg.svd(rows, full_matrices=False)
        U = U[:len(residuals)]
        is_open = values <= _ZERO * values[0] if n and values[0] > 0 else np.ones(n, dtype=bool)
        open_ones = np.linalg.qr((V[is_open] * (sizes / scale)).T)[0].T
        half = (V[~is_open].T / values[~is_open]) * sizes[:, None]
        covariance = half @ half.T
        touched = np.sum(open_ones**2, axis=0) > TOUCHED
        covariance[touched, :] = covariance[:, touched] = np.nan
        return cls(covariance, open_ones, np.sum(U[:, ~is_open]**2, axis=1), -half @ (U[:, ~is_open].T @ residuals),
                   float(values.max(initial=0.0)))
