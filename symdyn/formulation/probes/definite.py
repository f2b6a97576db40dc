"""The smallest eigenvalue of symmetric matrices whose entries are mostly zero, such as mass matrices in absolute coordinates."""

from __future__ import annotations

import numpy as np


def smallest_eigenvalue(M: np.ndarray) -> float:
    """Smallest eigenvalue of a symmetric matrix (n, n), n of 1 or more, block by block of rows that depend on each other."""
    from scipy.sparse import csr_matrix
    from scipy.sparse.csgraph import connected_components

    count, labels = connected_components(csr_matrix(M != 0), directed=False)
    if count == 1:
        return float(np.linalg.eigvalsh(M)[0])
    order = np.argsort(labels, kind="stable")
    blocks = np.split(order, np.flatnonzero(np.diff(labels[order])) + 1)
    alone = [block[0] for block in blocks if len(block) == 1]
    return min([*np.diagonal(M)[alone], *(float(np.linalg.eigvalsh(M[np.ix_(b, b)])[0]) for b in blocks if len(b) > 1)])
