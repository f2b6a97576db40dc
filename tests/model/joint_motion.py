"""Expected motion of a joint, from its R and d alone, by numerical differentiation with many digits."""

from __future__ import annotations

import random
from collections.abc import Mapping, Sequence
from functools import lru_cache, partial
from typing import Any

import mpmath
import numpy as np
import sympy as sp

from symdyn.lab.draft import Numbers
from symdyn.model.joints import Joint
from symdyn.model.symbols import symbols_of

DIGITS = 50
TOLERANCE = mpmath.mpf(10) ** -18


def with_many_digits(e: sp.Expr, values: Mapping[sp.Basic, Any]) -> Any:
    """An expression as one of mpmath's numbers."""
    symbols, function = _function(e)
    return function(*[values[s] for s in symbols])


@lru_cache(maxsize=4096)
def _function(e: sp.Expr) -> tuple[list[sp.Symbol], Any]:
    symbols = list(symbols_of(e))
    return symbols, sp.lambdify(symbols, e, "mpmath") if symbols else partial(mpmath.mpmathify, sp.N(e, 4 * DIGITS))


def drawn(joint: Joint, seed: int) -> tuple[Numbers, list[Any], list[Any]]:
    """An algebra with numbers for the parameters, coordinates (a unit vector of Euler parameters) and speeds."""
    rng = random.Random(seed)
    parameters = sorted({s for e in joint.constants for s in symbols_of(e)}, key=str)
    algebra = Numbers({s: mpmath.mpf(rng.uniform(0.5, 1.5)) for s in parameters}, with_many_digits, mpmath)
    s = [mpmath.mpf(rng.uniform(0.2, 1.2)) for _ in joint.coordinates]
    if len(joint.coordinates) != joint.n_speeds:
        norm = mpmath.norm(s[-4:])
        s[-4:] = [e / norm for e in s[-4:]]
    return algebra, s, [mpmath.mpf(rng.uniform(-1, 1)) for _ in range(joint.n_speeds)]


def by_time(function: Any, joint: Joint, algebra: Numbers, s: Sequence[Any], u: Sequence[Any]) -> np.ndarray:
    """Derivative of function(s), an array, by time at speeds u: the coordinates move with the joint's rates."""
    rates = joint.rates(algebra, s, u)

    return mpmath.diff(lambda h: np.asarray(function([a + h * rate for a, rate in zip(s, rates, strict=True)])), 0)


def velocity(joint: Joint, algebra: Numbers, s: Sequence[Any], u: Sequence[Any]) -> tuple[np.ndarray, np.ndarray]:
    """omega, child axes, from R^T R_dot = [omega x]; d_dot, parent axes."""
    R = joint.motion(algebra, s, u).R
    W = R.T @ by_time(lambda at: joint.motion(algebra, at, u).R, joint, algebra, s, u)
    assert all(abs(e) < TOLERANCE for e in (W + W.T).ravel())
    return np.array([W[2, 1], W[0, 2], W[1, 0]]), by_time(lambda at: joint.motion(algebra, at, u).d, joint, algebra, s, u)


def check_motion(joint: Joint, seed: int) -> None:
    """R is a rotation; S s_dot = [omega; R^T d_dot]; c = [d omega/dt; R^T d^2 d/dt^2] at constant speeds."""
    assert not joint.faults, joint.faults
    with mpmath.workdps(DIGITS):
        algebra, s, u = drawn(joint, seed)
        motion = joint.motion(algebra, s, u)
        R = motion.R
        _close(R @ R.T, np.eye(3, dtype=int))
        _close(np.cross(R[:, 0], R[:, 1]), R[:, 2])
        omega, d_dot = velocity(joint, algebra, s, u)
        assert motion.S.shape == (6, joint.n_speeds)
        _close(motion.S @ np.array([*u, 0], dtype=object)[:len(u)] if u else np.zeros(6), [*omega, *(R.T @ d_dot)])
        alpha = by_time(lambda at: velocity(joint, algebra, at, u)[0], joint, algebra, s, u)
        d_ddot = by_time(lambda at: velocity(joint, algebra, at, u)[1], joint, algebra, s, u)
        _close(motion.c, [*alpha, *(R.T @ d_ddot)])


def _close(found: Any, wanted: Any) -> None:
    difference = np.asarray(found, dtype=object) - np.asarray(wanted, dtype=object)
    assert max((abs(e) for e in difference.ravel()), default=0) < TOLERANCE
