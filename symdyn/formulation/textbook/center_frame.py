"""The same spatial vectors in the frame b_G at a link's centre of mass, its axes parallel to the link's."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from symdyn.spatial.inertia import Inertia
from symdyn.spatial.sixvectors import force_transform, motion_transform, spatial_inertia
from symdyn.spatial.vectors import identity, zeros
from symdyn.tape.node import is_zero


@dataclass(frozen=True)
class AtCenter:
    """r_G (3,) centre of mass in the link's frame; X_G (6, 6) motions from the link's frame to b_G; I_G (6, 6);
    v_G, a_G, f_G (6,) in b_G."""

    r_G: np.ndarray
    X_G: np.ndarray
    I_G: np.ndarray
    v_G: np.ndarray
    a_G: np.ndarray
    f_G: np.ndarray


def at_center(inertia: Inertia, v: np.ndarray, a: np.ndarray, f: np.ndarray) -> AtCenter:
    """Shift velocity, acceleration and force (6,) from a link's frame, about whose origin `inertia` is, to b_G.

        v_G = X_G v,  a_G = X_G a,  f = X_G* f_G

    A link without mass has no centre of mass: its b_G is its own frame. Source: lecture, chapter 5.6, summary; there f_G is
    the resultant force on the body, I_G a_G + v_G x* I_G v_G, so pass f_B.
    """
    r_G = zeros(3) if is_zero(inertia.m) else inertia.h / inertia.m
    X_G = motion_transform(identity(), r_G)
    back = force_transform(identity(), -r_G)  # the inverse of X_G*
    return AtCenter(r_G, X_G, spatial_inertia(inertia.moved(identity(), -r_G)), X_G @ v, X_G @ a, back @ f)
