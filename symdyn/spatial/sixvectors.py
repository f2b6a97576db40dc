"""Spatial (6-component) vectors, and the 6 x 6 matrices that the lecture writes its recursions with.

A motion is v = [omega; v_O], a force f = [moment about O; force], O the origin and the axes those of one frame, so that
f . v is a power. Any scalars; what is zero by structure stays the number 0.
Source: lecture, chapter 5.6; Featherstone, Rigid Body Dynamics Algorithms, chapter 2.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from symdyn.spatial.inertia import Inertia
from symdyn.spatial.vectors import Vector, identity, vector, zeros


def skew(r: Vector) -> np.ndarray:
    """[r x], (3, 3): [r x] a = r x a."""
    x, y, z = r
    return np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]], dtype=object)


def motion_transform(R: np.ndarray, r: Vector) -> np.ndarray:
    """X (6, 6): a motion in the parent's frame, as the same motion in the link's frame.

    R, r   link to parent components (3, 3); origin of the link's frame in the parent's, parent axes (3,)

    X = [[E, 0], [-E [r x], E]] with E = R^T, the lecture's b2_R_b1. (The lecture's slide of accelerations leaves out the minus.)
    """
    E = R.T
    return np.block([[E, zeros(3, 3)], [-(E @ skew(r)), E]])


def force_transform(R: np.ndarray, r: Vector) -> np.ndarray:
    """X* (6, 6): a force in the link's frame, as the same force in the parent's frame; R, r as for motion_transform.

    X* = [[R, [r x] R], [0, R]] = X^T. The lecture writes -R [r' x] for [r x] R, r' the parent's origin in link axes.
    """
    return motion_transform(R, r).T


def motion_cross(v: Vector) -> np.ndarray:
    """v x (6, 6): the rate of change of a motion that is fixed to a frame moving with v. [[omega x, 0], [v_O x, omega x]]."""
    omega, v_O = skew(v[:3]), skew(v[3:])
    return np.block([[omega, zeros(3, 3)], [v_O, omega]])


def force_cross(v: Vector) -> np.ndarray:
    """v x* (6, 6): the same of a force. [[omega x, v_O x], [0, omega x]] = -(v x)^T."""
    omega, v_O = skew(v[:3]), skew(v[3:])
    return np.block([[omega, v_O], [zeros(3, 3), omega]])


def force_cross_swapped(f: Vector) -> np.ndarray:
    """B (6, 6) with B v = v x* f for every v; skew-symmetric. -[[n x, f x], [f x, 0]] for f = [n; f]."""
    n, force = skew(f[:3]), skew(f[3:])
    return -np.block([[n, force], [force, zeros(3, 3)]])


def spatial_inertia(inertia: Inertia) -> np.ndarray:
    """I (6, 6), the momentum of a body per motion: [[I_O, [h x]], [-[h x], m 1]] with the first moment h = m r_G."""
    h = skew(inertia.h)
    return np.block([[inertia.I, h], [-h, inertia.m * identity()]])


def mass_and_first_moment(I: np.ndarray) -> tuple[Any, np.ndarray]:
    """m and h = m r_G (3,) of the inertia (6, 6) of any number of bodies."""
    return I[3, 3], vector(I[2, 4], I[0, 5], I[1, 3])
