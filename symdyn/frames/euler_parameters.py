"""Euler parameters found again in a rotation matrix, whose angular velocity is then 2 E p_dot and not a page of products."""

from __future__ import annotations

import random

import numpy as np
import sympy as sp

from symdyn.frames.rates import differentiated
from symdyn.model.symbols import Coordinate, symbols_of

CLOSE = 1e-9


def spin_by_parameters(R: sp.ImmutableMatrix) -> tuple[sp.ImmutableMatrix, sp.ImmutableMatrix] | None:
    """omega = 2 E p_dot in the parent's and 2 E_bar p_dot in the frame's own components, or None for any other rotation.

    R   (3, 3), checked to be a rotation where the four coordinates in it have norm 1
    Source: lecture, chapter 4.5.
    """
    p = _parameters(R)
    if p is None:
        return None
    p_dot = sp.Matrix(differentiated(p))
    E, E_bar = _E(p, 1), _E(p, -1)
    return sp.ImmutableMatrix(2 * E * p_dot), sp.ImmutableMatrix(2 * E_bar * p_dot)


def _E(p: list[sp.Expr], sign: int) -> sp.Matrix:
    """E = [-e, e0 1 + [e x]] for sign 1, E_bar = [-e, e0 1 - [e x]] for sign -1."""
    a, x, y, z = p
    return sp.Matrix([[-x, a, -sign * z, sign * y], [-y, sign * z, a, -sign * x], [-z, -sign * y, sign * x, a]])


def _parameters(R: sp.ImmutableMatrix) -> list[sp.Expr] | None:
    """+-1 times the four coordinates in the order of Euler parameters, if R is E E_bar^T wherever their norm is 1."""
    symbols = sorted(symbols_of(R), key=str)
    if len(symbols) != 4 or not all(isinstance(s, Coordinate) for s in symbols):
        return None
    stream = random.Random(2)
    result: list[tuple[int, int]] = []
    for _ in range(3):
        values = np.array([stream.uniform(0.2, 0.9) for _ in symbols])
        values /= np.linalg.norm(values)
        numbers = np.array(R.xreplace(dict(zip(symbols, map(sp.Float, values), strict=True))).tolist(), dtype=float)
        # 1 + trace R = 4 e0^2, R - R^T = 4 e0 [e x].
        e0 = np.sqrt(max(1 + np.trace(numbers), 0)) / 2
        if e0 < CLOSE:
            return None
        e = np.array([numbers[2, 1] - numbers[1, 2], numbers[0, 2] - numbers[2, 0], numbers[1, 0] - numbers[0, 1]]) / (4 * e0)
        order = [match for component in (e0, *e) for match in _matches(component, values)]
        if len(order) != 4 or len({k for k, _ in order}) != 4 or result not in ([], order):
            return None
        result = order
    return [sign * symbols[k] for k, sign in result]


def _matches(component: float, values: np.ndarray) -> list[tuple[int, int]]:
    """Indices of the values that a component equals, with its sign."""
    return [(k, 1 if component > 0 else -1) for k, value in enumerate(values) if abs(value - abs(component)) < CLOSE]
