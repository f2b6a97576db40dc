"""Chains of sliding and of turning bodies."""

from __future__ import annotations

import sympy as sp

from symdyn.errors import ModelError
from symdyn.model.joints import Prismatic, Revolute
from symdyn.model.symbols import coordinates, inputs, parameters
from symdyn.model.system import System

_AXES = ([0, 0, 1], [0, 1, 0], [1, 0, 0])
_PAIRS = ("xx", "xy", "xz", "yy", "yz", "zz")


def prismatic_chain(n: int = 2) -> System:
    """n bodies on a horizontal line, each sliding on the one before (n = 2 and 3 in the lecture).

    The n-frame has x along the line. The coordinate qi (m) is the distance of O_i, the origin of body i, from O_(i-1)
    along x; the centre of mass G_i is l_i ahead of O_i. Planar, no gravity.

    Parameters, of each body: mi mass (kg), li distance of G_i from O_i (m; it has no part in the motion).
    Inputs: Fi (N), the force of body i - 1 on body i along x.
    Source: lecture, chapters 5.1 and 5.2; M_tilde[i, j] is the sum of the masses from max(i, j) on, k_tilde = 0.
    """
    _at_least_one(n, "prismatic_chain")
    q = coordinates(f"q1:{n + 1}")
    m, ahead = parameters(f"m1:{n + 1}"), parameters(f"l1:{n + 1}")
    F = inputs(f"F1:{n + 1}")
    system = System(f"prismatic_chain_{n}", planar=True)
    parent = system.ground
    for i in range(n):
        body = system.add_body(f"body{i + 1}", mass=m[i], com=[ahead[i], 0])
        slider = system.add_joint(Prismatic(f"slider{i + 1}", parent, body, q[i], axis=[1, 0]))
        system.add_joint_force(slider, F[i], name=f"drive{i + 1}")
        parent = body
    system.defaults = {symbol: value for i in range(n) for symbol, value in ((m[i], 2.0 / (i + 1)), (ahead[i], 0.1))}
    system.initial = {**dict.fromkeys(q, 0.3), q[0].dot: 0.5, F[0]: 1.0}
    return system


def spatial_chain(n: int = 7) -> System:
    """n bodies in space, joined by revolute joints about z, y, x in turn.

    The n-frame has its origin at the first joint, z upward. Body i has its origin at joint i; at q = 0 all body axes
    are parallel to the n-frame, and joint i + 1 is at (li, 0, 0) of body i. The coordinate qi (rad) turns body i
    relative to the body before.

    Parameters: g (m/s^2, along -z); of each body mi mass (kg), ci_x, ci_y, ci_z centre of mass (m) and Ii_xx ... Ii_zz
    inertia about it (kg m^2; matrix entries, not products with changed sign), both in body axes; of all but the last li
    (m). Numbers: l = 0.5 m, centre of mass (0.25, 0.02, 0.01) m, mass 1 + 0.1 (i - 1) kg.
    """
    _at_least_one(n, "spatial_chain")
    q = coordinates(f"q1:{n + 1}")
    m, length, g = parameters(f"m1:{n + 1}"), parameters(f"l1:{n + 1}"), parameters("g")
    system = System(f"spatial_chain_{n}", gravity=[0, 0, -g])
    system.defaults = {g: 9.81}
    parent = system.ground
    for i in range(n):
        c = parameters(" ".join(f"c{i + 1}_{axis}" for axis in "xyz"))
        xx, xy, xz, yy, yz, zz = moments = parameters(" ".join(f"I{i + 1}_{pair}" for pair in _PAIRS))
        body = system.add_body(f"body{i + 1}", mass=m[i], com=c,
                               inertia=sp.Matrix([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]))
        system.add_joint(Revolute(f"joint{i + 1}", parent, body, q[i], axis=_AXES[i % 3],
                                  parent_point=[length[i - 1] if i else 0, 0, 0]))
        system.defaults |= {m[i]: 1 + 0.1 * i, **dict(zip(c, (0.25, 0.02, 0.01), strict=True)),
                            **dict(zip(moments, (0.05, 0.001, 0.0015, 0.04, 0.002, 0.03), strict=True))}
        if i < n - 1:
            system.defaults[length[i]] = 0.5
        parent = body
    system.initial = {q[i]: 0.1 * (i + 1) for i in range(n)} | {q[0].dot: 1.0}
    return system


def _at_least_one(n: int, what: str) -> None:
    if n < 1:
        raise ModelError([f"{what} was asked for {n} bodies; pass 1 or more"])
