"""Arguments given for frames and points, read with all faults reported at once."""

from __future__ import annotations

import random
from collections.abc import Sequence
from typing import Any

import numpy as np
import sympy as sp

from symdyn.errors import ModelError, NotARotation, UnsupportedExpression
from symdyn.model.faults import NAME, Faults
from symdyn.model.symbols import Coordinate, symbols_of, time
from symdyn.shown import shown
from symdyn.tape.floats import evaluate_rows
from symdyn.tape.recorder import Recorder
from symdyn.tape.sympy_bridge import record_expression
from symdyn.tape.tape import Tape

# Largest entry of R R^T - 1 that passes for rounding: a rotation typed with 9 digits.
TOLERANCE = 1e-9
POINTS = 8


class FrameFaults(Faults):
    """Faults of a frame or point; `tilts` are those of matrices that are no rotations."""

    def __init__(self, where: str) -> None:
        super().__init__()
        self.where = where
        self.tilts: list[str] = []

    def name(self, name: Any, kind: str) -> None:
        if not isinstance(name, str) or not NAME.fullmatch(name):
            self.append(f"the name of a {kind} is {shown(name)}; pass text on one line such as 'b'")

    def column(self, value: Any, what: str) -> sp.ImmutableMatrix:
        """Three components in one frame."""
        result = self.vector(value, f"{self.where}: {what}")
        self._time(result)
        return result

    def rotation(self, value: Any) -> sp.ImmutableMatrix:
        """A 3 x 3 rotation matrix, checked at random values of its symbols."""
        what = f"{self.where}: rotation"
        if not _square(value):
            self.append(f"{what} {_found(value)}; pass a 3 x 3 matrix that takes components of the new frame to its parent's, "
                        "such as sd.rotation.about('Z', phi)")
            return sp.ImmutableMatrix(sp.eye(3))
        before = len(self)
        R = self.matrix(value, what)
        self._time(R)
        if len(self) == before:
            fault = rotation_fault(R)
            if fault:
                self.tilts.append(f"{what} is not a rotation: {fault}")
        return R

    def demand_none(self) -> None:
        """Raise NotARotation if a matrix that is no rotation is all that is wrong, ModelError for anything else."""
        if self:
            raise ModelError([*self, *self.tilts], self.where)
        if self.tilts:
            raise NotARotation(self.tilts[0])

    def _time(self, matrix: sp.ImmutableMatrix) -> None:
        if any(s.name == "t" and s != time for s in symbols_of(matrix)):
            self.append(f"{self.where} uses a symbol t with assumptions, which is not the time; use sd.t")


def rotation_fault(R: sp.ImmutableMatrix) -> str:
    """Why a matrix is no rotation, with numbers, or an empty text.

    Four Euler parameters are tried with their norm 1, which they keep while they move.
    """
    if sp.eye(3) == R:
        return ""
    symbols = sorted({s.name for s in symbols_of(R)})
    stream = random.Random(1)
    points = {name: np.array([stream.uniform(-0.9, 0.9) for _ in range(POINTS)]) for name in symbols}
    try:
        fault = _worst(R, points)
        four = sorted({s.name for s in symbols_of(R) if isinstance(s, Coordinate)} or symbols)
        if fault and len(four) == 4:
            norm = np.sqrt(sum(points[name] ** 2 for name in four))
            if not _worst(R, {name: x / norm if name in four else x for name, x in points.items()}):
                return ""
    except (UnsupportedExpression, ZeroDivisionError) as error:
        return f"it cannot be evaluated: {error}"
    return fault


def _worst(R: sp.ImmutableMatrix, points: dict[str, np.ndarray]) -> str:
    """The largest fault at some points, with the values of the symbols there."""
    recorder = Recorder()
    leaves = {name: recorder.leaf(name, 0) for name in points}
    memory: dict[sp.Basic, Any] = {}
    nodes = [record_expression(recorder, e, {s: leaves[s.name] for s in symbols_of(R)}, memory) for e in R]
    values = evaluate_rows(Tape.of(recorder, R=nodes), points, POINTS)["R"].reshape(POINTS, 3, 3)
    real = np.isfinite(values).all(axis=(1, 2))
    if not real.any():
        return "it has no finite value at random values of its symbols"
    values[~real] = np.eye(3)
    errors = np.abs(values @ values.transpose(0, 2, 1) - np.eye(3)).max(axis=(1, 2))
    dets = np.linalg.det(values)
    k = int(np.argmax(np.maximum(errors, np.abs(dets - 1))))
    if errors[k] <= TOLERANCE and abs(dets[k] - 1) <= 10 * TOLERANCE:
        return ""
    at = ", ".join(f"{name} = {x[k]:.4g}" for name, x in points.items())
    result = f"R R^T differs from the identity by {errors[k]:.3g} and det R = {dets[k]:.6g}" + (f" at {at}" if at else "")
    if errors[k] <= TOLERANCE:
        return f"{result}, so that it mirrors; exchange two columns or change the sign of one"
    return f"{result}; pass a matrix with orthonormal columns, such as sd.rotation.about('Z', phi)"


def _square(value: Any) -> bool:
    if hasattr(value, "shape"):
        return tuple(value.shape) == (3, 3)
    return isinstance(value, Sequence) and not isinstance(value, str) and len(value) == 3 and all(
        isinstance(row, Sequence) and not isinstance(row, str) and len(row) == 3 for row in value)


def _found(value: Any) -> str:
    if hasattr(value, "shape"):
        return f"has the shape {tuple(value.shape)}"
    return f"is {shown(value)}"
