"""Letters of the slides: vectors and matrices whose components are symbols, and the motion that they stand for."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

import sympy as sp

import symdyn as sd


def moving(name: str, axes: str = "xyz") -> sp.Matrix:
    """(3, 1) a vector that moves: coordinates name_x, name_y, name_z."""
    return sp.Matrix([sd.coordinates(f"{name}_{axis}") for axis in axes])


def moving_matrix(name: str) -> sp.Matrix:
    """(3, 3) a matrix that moves: coordinates name_11, name_12, ..."""
    return sp.Matrix(3, 3, lambda i, j: sd.coordinates(f"{name}_{i + 1}{j + 1}"))


def constant(name: str, axes: str = "xyz") -> sp.Matrix:
    """(3, 1) a vector whose components do not change, or whose rates do not matter."""
    return sp.Matrix([sp.Symbol(f"{name}_{axis}") for axis in axes])


def symmetric(name: str, axes: str = "xyz") -> sp.Matrix:
    """(3, 3) a constant symmetric matrix with the entries name_xx, name_xy, ..."""
    return sp.Matrix(3, 3, lambda i, j: sp.Symbol(f"{name}_{axes[min(i, j)]}{axes[max(i, j)]}"))


def skew(vector: Any) -> sp.Matrix:
    """(3, 3) [v x], typed as the slides print it."""
    x, y, z = vector
    return sp.Matrix([[0, -z, y], [z, 0, -x], [-y, x, 0]])


def dot(letters: sp.Matrix) -> sp.Matrix:
    """The letters with one dot."""
    return letters.applyfunc(lambda letter: letter.dot)


def ddot(letters: sp.Matrix) -> sp.Matrix:
    """The letters with two dots."""
    return letters.applyfunc(lambda letter: letter.ddot)


def stands_for(letters: Iterable[Any], value: Iterable[Any], dots: int = 0) -> dict[Any, Any]:
    """Replacements of letters, and of their derivatives up to so many dots: for `Formula.renamed`."""
    names, found = list(letters), sp.Matrix(list(value))
    result: dict[Any, Any] = dict(zip(names, found, strict=True))
    for _ in range(dots):
        names, found = [name.dot for name in names], sd.rate(found)
        result |= dict(zip(names, found, strict=True))
    return result
