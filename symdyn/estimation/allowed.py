"""The speeds that constraints allow along measured motions: orthonormal columns, which turn as little as can be over time."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from symdyn.errors import ArgumentError
from symdyn.runtime.constraints import position_residual
from symdyn.tape.intrinsics import RANK

if TYPE_CHECKING:
    from symdyn.estimation.measured_motion import Rows
    from symdyn.runtime.module import Module

# Largest violation of constraints of positions, as a part of the mechanism's length: more is no error of a measurement.
FAR = 0.05


def allowed(module: Module, motions: Sequence[Rows]) -> list[np.ndarray]:
    """Columns Z (n_t, n_u, r) with C_r Z = 0 for every motion; r is the same at all times. Raises ArgumentError for positions far
    off the constraints, and where these leave nothing that moves."""
    result = []
    for number, one in enumerate(motions, 1):
        off = np.abs(position_residual(module, one.t, one.x, one.params))
        if off.size and off.max() > FAR:
            row, column = np.unravel_index(int(off.argmax()), off.shape)
            name = module.metadata.constraints[column]
            raise ArgumentError(f"{module.name}: q of motion {number} misses the constraint {name} at t = {one.t[row]:.6g} s by "
                                f"{off[row, column]:.2g} of the mechanism's length; give coordinates that close the loops, "
                                "module.consistent finds them")
        result.append(np.linalg.svd(module.evaluate("C_r", one.t, one.x, one.params)))
    n_u = module.metadata.sizes.u
    r = n_u - max(int((sizes > RANK * sizes[:, :1]).sum(axis=1).max()) for _, sizes, _ in result)
    if r < 1:
        raise ArgumentError(f"{module.name}: the constraints leave nothing that moves, so the forces say nothing of inertia")
    return [_aligned(np.swapaxes(V[:, n_u - r:], 1, 2)) for _, _, V in result]


def _aligned(Z: np.ndarray) -> np.ndarray:
    """Columns that span the same at every time, each row as near the one before as a rotation brings it."""
    result = [Z[0]]
    for one in Z[1:]:
        U, _, V = np.linalg.svd(one.T @ result[-1])
        result.append(one @ (U @ V))
    return np.array(result)
