"""Expressions that jump, which solvers that go by derivatives do not see: found from both sides of what they may jump at."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from fractions import Fraction
from typing import Any

import numpy as np

from symdyn.tape import node as kinds
from symdyn.tape.differentiate import reverse
from symdyn.tape.floats import evaluate_rows
from symdyn.tape.jumps import Jump, description, jumps
from symdyn.tape.node import Node
from symdyn.tape.recorder import Recorder
from symdyn.tape.sympy_bridge import record_expression
from symdyn.tape.tape import Output, Tape

# Points from which a surface is sought, and Newton's steps to it.
POINTS, STEPS = 64, 30
# Distances to either side, relative to 1 and the point: what a continuous expression differs by falls with them to less than this
# part; less than this part of the values is rounding.
FAR, CLOSE, FALLS, ROUNDING = 1e-4, 1e-7, 0.1, 1e-9


def jumping(expression: Any, names: Sequence[str], constants: Mapping[str, float], fixed: Sequence[str] = ()) -> list[
        dict[str, str]]:
    """Where an expression jumps, each with `what` jumps, the `surface` that passes zero there, and a `remedy`.

    names       of its arguments; fixed: of those that do not depend on what is optimized, whose jumps do not count
    constants   values of all other symbols, by name
    An expression with a sign or a Piecewise that is continuous, such as x*sign(x), does not jump.
    """
    recorder = Recorder()
    leaves = {name: recorder.leaf(name, kinds.PARAMETER if name in fixed else kinds.STATE) for name in names}
    at: dict[str, Any] = {**{name: Fraction(value) for name, value in constants.items()}, **leaves}
    value = record_expression(recorder, expression, {s: at[str(s)] for s in expression.free_symbols})
    if not isinstance(value, Node):
        return []
    moving = [name for name in names if name not in fixed]
    symbols = {leaf: next((s for s in expression.free_symbols if str(s) == name), None) for name, leaf in leaves.items()}
    symbols = {leaf: symbol for leaf, symbol in symbols.items() if symbol is not None}
    return [description(jump, symbols) for jump in jumps(recorder, [value]) if _jumps(recorder, value, jump, leaves, moving)]


def _jumps(recorder: Recorder, value: Node, jump: Jump, leaves: Mapping[str, Node], moving: Sequence[str]) -> bool:
    """Whether the values to both sides of points of a surface stay apart, the nearer they are."""
    slopes = reverse(recorder, jump.surface, [leaves[name] for name in moving])
    on = Tape(recorder, {"s": Output.of("s", np.array([jump.surface], dtype=object)),
                         "slopes": Output.of("slopes", np.array(slopes, dtype=object))})
    of = Tape(recorder, {"f": Output.of("f", np.array([value], dtype=object))})
    names = list(leaves)
    columns = [names.index(name) for name in moving]
    points = np.random.default_rng(0).normal(size=(POINTS, len(names))) * np.repeat([1.0, 30.0], POINTS // 2)[:, None]

    def surface(y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        result = evaluate_rows(on, dict(zip(names, y.T, strict=True)), len(y))
        return result["s"].reshape(len(y)), result["slopes"].reshape(len(y), -1)

    with np.errstate(all="ignore"):
        for _ in range(STEPS):
            s, by = surface(points)
            step = -s[:, None] * by / (by**2).sum(axis=1)[:, None]
            points[:, columns] += np.nan_to_num(step, nan=0.0, posinf=0.0, neginf=0.0)
        s, by = surface(points)
        normal = by / np.linalg.norm(by, axis=1)[:, None]
        size = 1 + np.abs(points).max(axis=1)
        there = np.isfinite(normal).all(axis=1) & (np.abs(s) <= CLOSE / 10 * size * np.linalg.norm(by, axis=1))
        apart, largest = [], np.zeros(len(points))
        for distance in (FAR, CLOSE):
            sides = []
            for way in (-1.0, 1.0):
                moved = points.copy()
                moved[:, columns] += way * distance * size[:, None] * normal
                sides.append(evaluate_rows(of, dict(zip(names, moved.T, strict=True)), len(moved))["f"].reshape(-1))
            apart.append(np.abs(sides[1] - sides[0]))
            largest = np.maximum(largest, np.abs(sides[0]) + np.abs(sides[1]))
        return bool((there & np.isfinite(largest) & (apart[1] > FALLS * apart[0]) & (apart[1] > ROUNDING * largest)).any())
