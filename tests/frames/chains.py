"""Rotations, random trees of frames and random motions for the tests of frames."""

from __future__ import annotations

import numpy as np
import sympy as sp

import symdyn as sd


def turn(axis, angle):
    """R about the axis "X", "Y" or "Z", typed out."""
    c, s = sp.cos(angle), sp.sin(angle)
    return {"X": sp.Matrix([[1, 0, 0], [0, c, -s], [0, s, c]]), "Y": sp.Matrix([[c, 0, s], [0, 1, 0], [-s, 0, c]]),
            "Z": sp.Matrix([[c, -s, 0], [s, c, 0], [0, 0, 1]])}[axis]


def random_tree(seed, size=3):
    """A tree of frames below n, its coordinates, and a smooth motion q(t) for each of them."""
    rng = np.random.default_rng(seed)
    q = sd.coordinates(f"q1:{3 * size + 1}")
    length = sp.Symbol("l")
    frames = [sd.Frame("n")]
    for k in range(size):
        parent = frames[rng.integers(len(frames))]
        first, second = rng.permutation(list("XYZ"))[:2]
        a, b, x = q[3 * k:3 * k + 3]
        rotation = turn(first, a) * turn(second, b + sp.Rational(1, 3) * sd.t)
        frames.append(parent.frame(f"b{k}", rotation=rotation, origin=[x * length, sp.sin(a), sd.t**2 * x]))
    motion = {s: sum(sp.Rational(int(rng.integers(-9, 10)), 8) * sd.t**k for k in range(3)) for s in q}
    return frames, {**motion, length: 0.7}


def jet(matrix, motion, instant):
    """The values of a matrix and of its first two derivatives by t at an instant, (3, rows, columns), by SymPy."""
    values = {s: sp.sympify(e) for s, e in motion.items()}
    orders = [sp.Matrix(matrix).applyfunc(lambda e: e.xreplace(values))]
    for _ in range(2):
        orders.append(orders[-1].applyfunc(lambda e: e.diff(sd.t)))
    return np.array([at_time(order, instant) for order in orders])


def times(a, b):
    """The product of two jets: Leibniz's rule."""
    return np.array([a[0] @ b[0], a[1] @ b[0] + a[0] @ b[1], a[2] @ b[0] + 2 * a[1] @ b[1] + a[0] @ b[2]])


def transposed(a):
    """The jet of the transposed matrix."""
    return a.transpose(0, 2, 1)


def at_time(matrix, instant):
    """A matrix of t alone in numbers, by SymPy's own evaluation."""
    here = {sd.t: sp.Float(instant, 20)}
    return np.array([[float(e.xreplace(here)) for e in row] for row in sp.Matrix(matrix).tolist()])
