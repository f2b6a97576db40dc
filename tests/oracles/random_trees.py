"""Random trees of bodies with every type of joint, the same for the same seed."""

from __future__ import annotations

import random
from collections.abc import Callable
from fractions import Fraction
from typing import Any

import numpy as np
import sympy as sp

import symdyn as sd
from symdyn.model.joints import Joint
from symdyn.model.orientation import SEQUENCES
from symdyn.model.symbols import parameters

_PAIRS = ("xx", "xy", "xz", "yy", "yz", "zz")


def random_tree(seed: int) -> sd.System:
    """2 to 8 bodies, each hung on the ground or on a body before it, so that branches form by chance.

    Joints sit anywhere on both bodies, in frames turned by any rotation, with any axes; every body has mass, centre of mass
    and a full inertia of a cloud of points, gravity has three components. Rotations and axes are exact fractions, all
    lengths, masses, inertias and gravity parameters with numbers.
    """
    rng = random.Random(seed)
    system = sd.System(f"random_tree_{seed}", gravity=parameters("g_x g_y g_z"))
    system.defaults = dict(zip(system.gravity, _vector(rng, 6.0), strict=True))
    known = [system.ground]
    for k in range(1, rng.randint(2, 8) + 1):
        body = _body(system, rng, k)
        make = rng.choice(_JOINTS) if k > 1 else rng.choice(_MOVING)  # the first joint moves, so that something does
        joint = make(rng, f"j{k}", rng.choice(known), body, {
            "parent_point": _point(system, rng, f"a{k}"), "child_point": _point(system, rng, f"b{k}"),
            "parent_rotation": _rotation(rng), "child_rotation": _rotation(rng)})
        system.add_joint(joint)
        known.append(body)
    return system


def random_state(system: sd.System, seed: int, n: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """q (n, n_q), u and its derivative (n, n_u) of a checked system at n random states.

    Coordinates are between 0.3 and 1.2 of either sign, where no Euler angles lock; Euler parameters have unit norm.
    """
    rng = np.random.default_rng(seed)
    model = system.check()
    q = rng.uniform(0.3, 1.2, (n, len(model.coordinates))) * rng.choice([-1, 1], (n, len(model.coordinates)))
    for joint in model.joints:
        if isinstance(getattr(joint, "orientation", None), sd.EulerParameters):
            places = [model.coordinates.index(s) for s in joint.coordinates[-4:]]
            q[:, places] /= np.linalg.norm(q[:, places], axis=1, keepdims=True)
    u, u_dot = rng.uniform(-2, 2, (2, n, len(model.speeds)))
    return q, u, u_dot


def _body(system: sd.System, rng: random.Random, k: int) -> Any:
    mass, com = parameters(f"m{k}"), _point(system, rng, f"c{k}", 0.3)
    xx, xy, xz, yy, yz, zz = moments = parameters(" ".join(f"I{k}_{pair}" for pair in _PAIRS))
    points = np.array([_vector(rng, 0.3) for _ in range(5)])
    points -= points.mean(axis=0)
    weights = [rng.uniform(0.1, 1.0) for _ in points]
    cloud = sum(w * (p @ p * np.eye(3) - np.outer(p, p)) for w, p in zip(weights, points, strict=True))
    system.defaults |= {mass: rng.uniform(0.5, 3.0), **dict(zip(moments, cloud[np.triu_indices(3)].tolist(), strict=True))}
    return system.add_body(f"body{k}", mass=mass, com=com, inertia=[[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def _vector(rng: random.Random, reach: float) -> list[float]:
    return [rng.uniform(-reach, reach) for _ in range(3)]


def _point(system: sd.System, rng: random.Random, name: str, reach: float = 0.5) -> list[sp.Symbol]:
    symbols = parameters(" ".join(f"{name}_{axis}" for axis in "xyz"))
    system.defaults |= dict(zip(symbols, _vector(rng, reach), strict=True))
    return list(symbols)


def _rotation(rng: random.Random) -> sp.Matrix:
    """A rotation matrix of fractions, from Euler parameters that are small integers before they are normalized."""
    e = [rng.randint(-3, 3) for _ in range(4)]
    w, x, y, z = e if any(e) else (1, 0, 0, 0)
    R = [[w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y)],
         [2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x)],
         [2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z]]
    n = w * w + x * x + y * y + z * z
    return sp.Matrix(3, 3, [sp.Rational(Fraction(e, n)) for row in R for e in row])


def _axis(rng: random.Random) -> list[sp.Expr]:
    return list(_rotation(rng)[:, 0])


def _two_axes(rng: random.Random) -> list[list[sp.Expr]]:
    """Two unit vectors at an angle, which need not be a right one."""
    R = _rotation(rng)
    first, normal = R[:, 0], R[:, 1]
    return [list(first), list(normal if rng.random() < 0.5 else sp.Rational(3, 5) * first + sp.Rational(4, 5) * normal)]


def _orientation(rng: random.Random) -> Any:
    sequence = rng.choice(SEQUENCES)
    return rng.choice([sd.EulerParameters(), sd.EulerAngles(sequence, "body"), sd.EulerAngles(sequence, "rates")])


def _free(rng: random.Random) -> dict[str, Any]:
    """Orientation and velocity of a free joint; a velocity in body axes with derivatives of angles is left out, as no other
    program has these speeds."""
    orientation = _orientation(rng)
    body = orientation.angular_velocity and rng.random() < 0.5
    return {"orientation": orientation, "velocity": "body" if body else "parent"}


_MOVING: tuple[Callable[[random.Random, str, Any, Any, dict[str, Any]], Joint], ...] = (
    lambda rng, *ends: sd.Revolute(*ends[:3], axis=_axis(rng), **ends[3]),
    lambda rng, *ends: sd.Prismatic(*ends[:3], axis=_axis(rng), **ends[3]),
    lambda rng, *ends: sd.Helical(*ends[:3], axis=_axis(rng), pitch=sp.Rational(rng.randint(-30, 30), 100), **ends[3]),
    lambda rng, *ends: sd.Cylindrical(*ends[:3], axis=_axis(rng), **ends[3]),
    lambda rng, *ends: sd.Universal(*ends[:3], axes=_two_axes(rng), **ends[3]),
    lambda rng, *ends: sd.Planar(*ends[:3], **ends[3]),
    lambda rng, *ends: sd.Spherical(*ends[:3], orientation=_orientation(rng), **ends[3]),
    lambda rng, *ends: sd.Free(*ends[:3], **_free(rng), **ends[3]),
)
_JOINTS = (*_MOVING, lambda rng, *ends: sd.Fixed(*ends[:3], **ends[3]))
