"""Chains of bodies whose inertial parameters and offsets are all symbols."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import sympy as sp

import symdyn as sd
from symdyn.model.joints import KINDS

AXES = {"x": [1, 0, 0], "y": [0, 1, 0], "z": [0, 0, 1], "w": [sp.Rational(3, 5), 0, sp.Rational(4, 5)]}


def general_body(s: sd.System, k: int) -> Any:
    """A body bk with the parameters mk, ck_x ... and Ik_xx ... about its centre of mass."""
    m, x, y, z = sd.parameters(f"m{k} c{k}_x c{k}_y c{k}_z")
    xx, xy, xz, yy, yz, zz = sd.parameters(" ".join(f"I{k}_{pair}" for pair in ("xx", "xy", "xz", "yy", "yz", "zz")))
    return s.add_body(f"b{k}", mass=m, com=[x, y, z], inertia=sp.Matrix([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]))


def joint(kind: str, name: str, parent: Any, child: Any, **place: Any) -> Any:
    """A joint by letters: R or P and an axis, as in "Rz"; else the first letters of its name, with Euler parameters if a +
    follows."""
    if kind[0] in "RP" and kind[1:] in AXES:
        return (sd.Revolute if kind[0] == "R" else sd.Prismatic)(name, parent, child, axis=AXES[kind[1:]], **place)
    if kind == "He":
        return sd.Helical(name, parent, child, pitch=sd.parameters("pitch"), **place)
    if kind[-1] == "+":
        place["orientation"] = sd.EulerParameters()
        where = list(sd.coordinates(f"x{name} y{name} z{name}")) if kind[:2] == "Fr" else []
        place["coordinates"] = [*where, *sd.coordinates(" ".join(f"e{i}{name}" for i in range(4)))]
    types = {kind.__name__[:2]: kind for kind in KINDS}
    return types[kind[:2]](name, parent, child, **place)


def chain(joints: str, gravity: Sequence[Any] = (0, 0, -1)) -> sd.System:
    """Bodies in a row, by the letters of their joints: "Rz Px" turns about z, then slides along x, u1 v1 w1 away."""
    g = sd.parameters("g")
    s = sd.System("chain_" + joints.replace(" ", "_").replace("+", "4"), gravity=[k * g for k in gravity])
    parent: Any = s.ground
    for k, kind in enumerate(joints.split()):
        body = general_body(s, k)
        s.add_joint(joint(kind, f"j{k}", parent, body, parent_point=sd.parameters(f"u{k} v{k} w{k}") if k else (0, 0, 0)))
        parent = body
    return s
