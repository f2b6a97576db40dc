"""Types of what public functions take, for signatures: numbers, expressions, vectors, and things by themselves or by name."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
import sympy as sp

if TYPE_CHECKING:
    from os import PathLike

    from sympy.physics.vector import Dyadic, ReferenceFrame
    from sympy.physics.vector import Vector as SympyVector

    from symdyn.model.bodies import Body
    from symdyn.model.joints import Joint

    # A number or an expression of SymPy's.
    Scalar: TypeAlias = float | sp.Expr
    # Components, or a vector in axes of its own.
    Vector: TypeAlias = Sequence[Scalar] | sp.MatrixBase | np.ndarray | SympyVector
    # Entries by rows, or the diagonal, or a dyadic; in a plane a moment of inertia about z.
    Inertia: TypeAlias = Scalar | Sequence[Scalar] | Sequence[Sequence[Scalar]] | sp.MatrixBase | np.ndarray | Dyadic
    # Rows of entries.
    Matrix: TypeAlias = Sequence[Sequence[Scalar]] | sp.MatrixBase | np.ndarray
    # Axes of SymPy's mechanics.
    Frame: TypeAlias = ReferenceFrame
    BodyOrName: TypeAlias = Body | str
    JointOrName: TypeAlias = Joint | str
    # Numbers for symbols, by symbol or by name.
    Numbers: TypeAlias = Mapping[Any, float]
    # In order, or by symbol or name.
    Values: TypeAlias = Sequence[float] | np.ndarray | Mapping[Any, Any]
    # Numbers, or rows of them, in order; or by symbol or name.
    States: TypeAlias = float | Sequence[float] | Sequence[Sequence[float]] | np.ndarray | Mapping[Any, Any]
    Times: TypeAlias = float | Sequence[float] | np.ndarray
    # Symbols or names.
    Names: TypeAlias = Sequence[Any] | str | sp.Symbol
    PathName: TypeAlias = str | PathLike[str]
