"""Operations on scalars that the formulas of rotation need: NumPy arrays with leading axes, or SymPy expressions.

A formula is written once, on the entries of its vectors and matrices; an `Algebra` reads them from what was given and puts
the result together. Numbers give NumPy arrays, anything of SymPy gives a SymPy matrix.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Any

import numpy as np
import sympy as sp

from symdyn.errors import ArgumentError
from symdyn.shown import shown


class Algebra(ABC):
    """Scalars, vectors and matrices of one kind."""

    @abstractmethod
    def read(self, value: Any, shape: tuple[int, ...], what: str, error: type[Exception] = ArgumentError) -> Any:
        """The value, finite and of the shape (after leading axes), or `error`; `what` names it in the message."""

    @abstractmethod
    def entries(self, matrix: Any) -> list[list[Any]]:
        """The entries of a matrix, by rows."""

    @abstractmethod
    def components(self, vector: Any) -> list[Any]:
        """The components of a vector."""

    @abstractmethod
    def matrix(self, rows: Sequence[Sequence[Any]]) -> Any:
        """A matrix of entries."""

    @abstractmethod
    def vector(self, components: Sequence[Any]) -> Any:
        """A vector of components."""

    @abstractmethod
    def transposed(self, matrix: Any) -> Any:
        """The transposed matrix."""

    @abstractmethod
    def times(self, matrix: Any, vector: Any) -> Any:
        """Matrix times vector."""

    @abstractmethod
    def sin(self, angle: Any) -> Any:
        """Sine."""

    @abstractmethod
    def cos(self, angle: Any) -> Any:
        """Cosine."""

    @abstractmethod
    def sqrt(self, value: Any) -> Any:
        """Square root."""


class Numbers(Algebra):
    """NumPy arrays of floats; any number of leading axes, which are broadcast."""

    def read(self, value: Any, shape: tuple[int, ...], what: str, error: type[Exception] = ArgumentError) -> np.ndarray:
        try:
            array = np.asarray(value)
        except ValueError:
            raise error(f"{what}: rows of different lengths; {_wanted(shape)}") from None
        if array.dtype.kind not in "iuf":
            array = _floats(np.asarray(value, dtype=object), what)
        array = array.astype(float)
        if array.shape == (*shape, 1) and shape in ((3,), (4,)):
            array = array.reshape(shape)
        if shape and array.shape[-len(shape):] != shape:
            raise error(f"{what}: shape {array.shape}; {_wanted(shape)}")
        if not np.isfinite(array).all():
            index = tuple(int(i) for i in np.argwhere(~np.isfinite(array))[0])
            where = f" at {list(index)}" if index else ""
            raise ArgumentError(f"{what}: the value {array[index]}{where}; pass finite numbers")
        return array

    def entries(self, matrix: np.ndarray) -> list[list[Any]]:
        return [[matrix[..., i, j] for j in range(matrix.shape[-1])] for i in range(matrix.shape[-2])]

    def components(self, vector: np.ndarray) -> list[Any]:
        return [vector[..., i] for i in range(vector.shape[-1])]

    def matrix(self, rows: Sequence[Sequence[Any]]) -> np.ndarray:
        flat = self.vector([entry for row in rows for entry in row])
        return flat.reshape(*flat.shape[:-1], len(rows), len(rows[0]))

    def vector(self, components: Sequence[Any]) -> np.ndarray:
        return np.stack([np.asarray(part, dtype=float) for part in np.broadcast_arrays(*components)], axis=-1)

    def transposed(self, matrix: np.ndarray) -> np.ndarray:
        return np.swapaxes(matrix, -1, -2)

    def times(self, matrix: np.ndarray, vector: np.ndarray) -> np.ndarray:
        return (matrix @ vector[..., None])[..., 0]

    def sin(self, angle: Any) -> Any:
        return np.sin(angle)

    def cos(self, angle: Any) -> Any:
        return np.cos(angle)

    def sqrt(self, value: Any) -> Any:
        return np.sqrt(value)


class Expressions(Algebra):
    """SymPy expressions in SymPy matrices; vectors are columns."""

    def read(self, value: Any, shape: tuple[int, ...], what: str, error: type[Exception] = ArgumentError) -> Any:
        given, flat = _flattened(value)
        fits = given == shape or (len(shape) == 1 and given in ((*shape, 1), (1, *shape)))
        if not fits:
            raise error(f"{what}: shape {given}; {_wanted(shape)} (expressions: one at a time)")
        taken = [_expression(entry, what) for entry in flat]
        if not shape:
            return taken[0]
        return sp.Matrix(*(shape if len(shape) == 2 else (*shape, 1)), taken)

    def entries(self, matrix: Any) -> list[list[Any]]:
        return matrix.tolist()

    def components(self, vector: Any) -> list[Any]:
        return list(vector)

    def matrix(self, rows: Sequence[Sequence[Any]]) -> Any:
        return sp.Matrix([list(row) for row in rows])

    def vector(self, components: Sequence[Any]) -> Any:
        return sp.Matrix(list(components))

    def transposed(self, matrix: Any) -> Any:
        return matrix.T

    def times(self, matrix: Any, vector: Any) -> Any:
        return matrix * vector

    def sin(self, angle: Any) -> Any:
        return sp.sin(angle)

    def cos(self, angle: Any) -> Any:
        return sp.cos(angle)

    def sqrt(self, value: Any) -> Any:
        return sp.sqrt(value)


def algebra_of(*values: Any) -> Algebra:
    """Expressions if anything of SymPy is among the values, Numbers if not."""
    return Expressions() if any(_of_sympy(value) for value in values) else Numbers()


def _of_sympy(value: Any) -> bool:
    if isinstance(value, np.ndarray):
        return value.dtype == object and any(isinstance(entry, sp.Basic) for entry in value.flat)
    if isinstance(value, (list, tuple)):
        return any(_of_sympy(entry) for entry in value)
    return isinstance(value, (sp.Basic, sp.MatrixBase, sp.NDimArray))


def _flattened(value: Any) -> tuple[tuple[int, ...], list[Any]]:
    """Shape and entries; the shape of lists of different lengths is that of the outermost."""
    if isinstance(value, sp.MatrixExpr):
        value = value.as_explicit()
    if isinstance(value, sp.MatrixBase):
        return tuple(value.shape), list(value)
    if isinstance(value, (sp.NDimArray, np.ndarray)):
        value = value.tolist()
    if not isinstance(value, (list, tuple)):
        return (), [value]
    parts = [_flattened(entry) for entry in value]
    shapes = {shape for shape, _ in parts}
    inner = shapes.pop() if len(shapes) == 1 else ()
    return (len(parts), *inner), [entry for _, flat in parts for entry in flat]


def _expression(value: Any, what: str) -> Any:
    if isinstance(value, str):
        raise ArgumentError(f"{what}: the text {shown(value)}; text is never evaluated: pass numbers or SymPy expressions")
    try:
        taken = sp.sympify(value, strict=True)
    except sp.SympifyError:
        raise ArgumentError(f"{what}: {shown(value)} of type {type(value).__name__}; pass numbers or SymPy expressions") from None
    if not isinstance(taken, sp.Expr):
        raise ArgumentError(f"{what}: {shown(value)} of type {type(value).__name__}; pass numbers or SymPy expressions")
    if taken.has(sp.nan, sp.oo, -sp.oo, sp.zoo):
        raise ArgumentError(f"{what}: the value {taken}; pass finite numbers or expressions")
    if taken.has(sp.I):
        raise ArgumentError(f"{what}: the complex value {taken}; pass real numbers or expressions")
    return taken


def _floats(array: np.ndarray, what: str) -> np.ndarray:
    """Fractions and the like as floats; texts, truth values, complex numbers and all else rejected."""
    for entry in array.flat:
        if isinstance(entry, str):
            raise ArgumentError(f"{what}: the text {shown(str(entry))}; text is never evaluated: pass numbers or SymPy "
                                "expressions")
        if isinstance(entry, (bool, np.bool_, complex, np.complexfloating, bytes)) or not hasattr(entry, "__float__"):
            raise ArgumentError(f"{what}: {shown(entry)} of type {type(entry).__name__}; pass real numbers or SymPy expressions")
    try:
        return np.array([float(entry) for entry in array.flat]).reshape(array.shape)
    except (OverflowError, TypeError, ValueError) as error:
        raise ArgumentError(f"{what}: a number that no float can hold ({error}); pass real numbers") from None


def _wanted(shape: tuple[int, ...]) -> str:
    if not shape:
        return "pass one number"
    if len(shape) == 1:
        return f"pass {shape[0]} components"
    return f"pass {shape[0]} rows of {shape[1]}"
