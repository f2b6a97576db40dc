"""Singular configurations: positions where the constraints, with what is held, lose rank that they have at positions nearby.

There the positions that the constraints allow are no smooth manifold: branches meet, or a mechanism passes a dead point of its
own, and linear equations do not exist. Constraints that depend on each other everywhere (redundant ones) are no such case, so
the rank is compared with that at positions nearby which fulfil the constraints, too.
Source: Müller, Higher-order analysis of kinematic singularities of lower pair linkages, J. Mech. Robotics 11 (2019).
"""

from __future__ import annotations

import numpy as np

from symdyn.errors import ArgumentError, EvaluationError
from symdyn.runtime.consistent import on_constraints
from symdyn.runtime.constraints import length as length_of
from symdyn.runtime.constraints import names, scaled_jacobian, turning
from symdyn.statics.manifold import held_indices, natural_scales
from symdyn.statics.selection import Selection
from symdyn.statics.terms import OperatingPoint
from symdyn.tape.intrinsics import RANK

# Positions nearby are so far away, in rad or lengths of the mechanism; so many are tried.
AWAY, TRIES = 0.03, 4


def singular_configuration(point: OperatingPoint, selection: Selection) -> str:
    """Singularity of a position, as "the constraints have rank 1 here and 2 nearby"; "" if nothing is.

    Held coordinates and speeds count as constraints: a crank that is held at its dead point holds a linkage at all positions
    nearby, but not there.
    """
    module = point.module
    held = held_indices(point, selection)
    if not names(module):
        return ""
    here = _rank(point, point.x, held)
    if here == len(names(module)) + sum(map(len, held)):
        return ""
    stream = np.random.default_rng(5)
    turns, size = turning(module), length_of(module, point.p)
    n_q, n_u, *_ = point.sizes
    most = here
    for _ in range(TRIES):
        change = AWAY * np.where(turns, 1.0, size) * stream.standard_normal(n_u)
        x = point.x.copy()
        x[:n_q] = point.moved(change)
        try:
            most = max(most, _rank(point, on_constraints(point.bound, point.t, x, point.p), held))
        except (ArgumentError, EvaluationError):
            continue
    if most == here:
        return ""
    with_held = f" with what is held ({', '.join(selection.held)})" if any(held) else ""
    return (f"singular configuration: the constraints{with_held} have rank {here} here and rank {most} at positions nearby, so "
            f"that {most - here} more direction{'s' * (most - here > 1)} would count as free than the mechanism has")


def _rank(point: OperatingPoint, x: np.ndarray, held: tuple[list[int], list[int]]) -> int:
    """Rank of the rows of constraints, and of those of held coordinates and speeds, which are given the length 1."""
    coordinates, speeds = held
    rows = np.vstack([point.at(x=x).N[coordinates], np.eye(point.sizes[1])[speeds]]) * natural_scales(point)
    lengths = np.linalg.norm(rows, axis=1, keepdims=True)
    rows = rows / np.where(lengths > 0, lengths, 1.0)
    values = np.linalg.svd(np.vstack([scaled_jacobian(point.module, point.t, x, point.p), rows]), compute_uv=False)
    return int((values > RANK * max(values[0], 1.0)).sum()) if len(values) else 0
