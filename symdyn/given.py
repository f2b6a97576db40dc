"""Types of what public functions take, for signatures: numbers, expressions, vectors, and things by themselves or by name."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Literal, TypeAlias, TypeVar

import numpy as np
import sympy as sp

if TYPE_CHECKING:
    from os import PathLike

    from sympy.physics.vector import Dyadic, Point, ReferenceFrame
    from sympy.physics.vector import Vector as SympyVector

    from symdyn.model.bodies import Body
    from symdyn.model.joints import Joint

    T = TypeVar("T")
    # A symbol, or its name.
    Key: TypeAlias = str | sp.Symbol
    # Things by symbol or by name. Mappings are invariant in their keys: one of names alone is of another type.
    Named: TypeAlias = Mapping[str, T] | Mapping[sp.Symbol, T] | Mapping[str | sp.Symbol, T]
    # A number or an expression of SymPy's.
    Scalar: TypeAlias = float | sp.Expr
    # A point of SymPy's mechanics.
    MechanicsPoint: TypeAlias = Point
    # Components, or a vector in axes of its own; of what is a point, also one that is located from the body's origin.
    Vector: TypeAlias = Sequence[Scalar] | sp.MatrixBase | np.ndarray | SympyVector | MechanicsPoint
    # Entries by rows, or the diagonal, or a dyadic; in a plane a moment of inertia about z.
    Inertia: TypeAlias = Scalar | Sequence[Scalar] | Sequence[Sequence[Scalar]] | sp.MatrixBase | np.ndarray | Dyadic
    # Rows of entries.
    Matrix: TypeAlias = Sequence[Sequence[Scalar]] | sp.MatrixBase | np.ndarray
    # A matrix or column that follows from such: of NumPy for numbers, else of SymPy.
    Array: TypeAlias = np.ndarray | sp.MatrixBase
    # One angle, or in numbers an array of them, rad.
    Angle: TypeAlias = Scalar | np.ndarray
    # A coordinate axis by letter or number, or a vector.
    Axis: TypeAlias = int | Vector
    # Axes of SymPy's mechanics.
    Frame: TypeAlias = ReferenceFrame
    BodyOrName: TypeAlias = Body | str
    JointOrName: TypeAlias = Joint | str
    # A row of numbers.
    Row: TypeAlias = Sequence[float] | np.ndarray
    # Numbers for symbols, by symbol or by name.
    Numbers: TypeAlias = Named[float]
    # One number each, or a row of them.
    ByName: TypeAlias = Named[float] | Named[Row] | Named[float | Row]
    # In order, or by symbol or name.
    Values: TypeAlias = Row | ByName
    # Numbers, or rows of them, in order; or by symbol or name.
    States: TypeAlias = float | Row | Sequence[Sequence[float]] | ByName
    # Numbers, expressions of t, or functions of t, by symbol or name.
    Motions: TypeAlias = Named[Scalar] | Named[Callable[[float], float]] | Named[Scalar | Callable[[float], float]]
    Times: TypeAlias = float | Row
    # Symbols or names.
    Names: TypeAlias = Sequence[str] | Sequence[sp.Symbol] | Sequence[Key] | Key
    PathName: TypeAlias = str | PathLike[str]
    # Whether statements that are repeated become loops.
    Rolling: TypeAlias = bool | Literal["auto"]
    # The mode of a rigid contact, with a direction of slip where it has none.
    ContactMode: TypeAlias = str | tuple[str, float | Row]
