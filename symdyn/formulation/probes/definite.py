"""Whether symmetric matrices whose entries are mostly zero, such as mass matrices of many bodies, are positive definite."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix


def definite(M: csr_matrix, least: float) -> bool:
    """Whether all eigenvalues of a symmetric matrix (n, n) are more than this, by the signs of the pivots of M - least 1, which
    are eliminated along the diagonal (Sylvester's law of inertia)."""
    from scipy.sparse import identity
    from scipy.sparse.linalg import splu

    n = M.shape[0]
    shifted = (M - least * identity(n)).tocsc()
    try:
        factors = splu(shifted, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
    except RuntimeError:  # a column has no pivot
        return False
    # A pivot next to the diagonal is taken where the diagonal has none.
    return bool((factors.U.diagonal() > 0).all() and (factors.perm_r == factors.perm_c).all())


def definite_along(M: csr_matrix, A: csr_matrix, least: float) -> bool:
    """Whether v^T M v, M (n, n) symmetric, is certainly more than `least` for all unit vectors v with A v = 0, A (m, n): as M is
    everywhere, or M + s A^T A with an s that makes both about as large (Finsler's lemma)."""
    if definite(M, least):
        return True
    size = float(A.multiply(A).sum(axis=1).max()) if A.nnz else 0.0
    return size > 0 and definite(M + abs(M).max() / size * (A.T @ A), least)
