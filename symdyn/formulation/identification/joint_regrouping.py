"""Base inertial parameters: the part of a link's inertia that its joint does not set in motion is its parent's as well.

A joint that turns a link about an axis leaves point masses on that axis where the parent carries them; a joint that only
shifts a link does not turn its rotational inertia. Such a piece of inertia gives the same forces and the same kinetic
energy whether it belongs to the link or to its parent, exactly, and fewer operations there, since the link's mass, for
one, is then zero.
Source: Khalil and Dombre, Modeling, Identification and Control of Robots, section 9.4 (grouping relations).
"""

from __future__ import annotations

import numpy as np

from symdyn.spatial.inertia import Inertia
from symdyn.spatial.vectors import zeros
from symdyn.tape.node import Node, is_zero


def unmoved(S: np.ndarray, inertia: Inertia) -> Inertia:
    """The piece P of an inertia with P S = 0 that looks the same at every position of the joint.

    S         (6, k) motion subspace of the joint, angular part first, child axes
    inertia   of the link, about the joint's origin, child axes
    """
    turning = [column for column in range(S.shape[1]) if not all(is_zero(e) for e in S[:3, column])]
    shifting = any(not all(is_zero(e) for e in S[3:, column]) for column in range(S.shape[1]))
    if not turning:
        return Inertia(0, zeros(3), inertia.I)
    axis = coordinate_axis(S[:3, turning[0]]) if len(turning) == 1 else None
    piece = Inertia.none()
    if axis is not None:
        other = (axis + 1) % 3
        I = zeros(3, 3)
        for k in range(3):
            if k != axis:
                I[k, k] = inertia.I[other, other]
        piece = Inertia(0, zeros(3), I)
    if not shifting:
        h = zeros(3)
        if axis is not None:
            h[axis] = inertia.h[axis]
        piece = piece + Inertia(inertia.m, h, zeros(3, 3))
    return piece


def coordinate_axis(e: np.ndarray) -> int | None:
    """Index of the coordinate direction that a vector of any length points along with a number, or None."""
    along = [k for k in range(len(e)) if not is_zero(e[k])]
    return along[0] if len(along) == 1 and not isinstance(e[along[0]], Node) else None
