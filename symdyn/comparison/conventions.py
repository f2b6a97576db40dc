"""Conventions in which a slide may differ from symdyn without being wrong; each is a change of what symdyn derives."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import sympy as sp


@dataclass(frozen=True)
class Convention:
    """A named way of writing: to_slide(derived) is what a slide in that convention prints.

    name       short: "opposite sign"
    sentence   what the slide does otherwise
    """

    name: str
    sentence: str
    to_slide: Callable[[Any], Any]


def opposite_sign(sentence: str) -> Convention:
    """The slide counts the other direction as positive."""
    return Convention("opposite sign", sentence, lambda derived: -derived)


def transposed(sentence: str) -> Convention:
    """The slide's rotation takes components the other way, or its vector is a row."""
    return Convention("transposed", sentence, lambda derived: derived.T)


def reordered(rows: Sequence[int] | None = None, columns: Sequence[int] | None = None, sentence: str = "") -> Convention:
    """The slide's row i is row rows[i] of symdyn's, its column j is columns[j]."""
    def change(derived: Any) -> Any:
        matrix = sp.Matrix(derived)
        return matrix.extract(list(rows if rows is not None else range(matrix.rows)),
                              list(columns if columns is not None else range(matrix.cols)))

    return Convention("order of coordinates", sentence, change)


def other_point(value: Any, sentence: str) -> Convention:
    """The slide refers to another point; value: what symdyn derives for that one."""
    return Convention("reference point", sentence, lambda _: value)


def scaled(factor: Any, sentence: str) -> Convention:
    """The slide's equation is multiplied by a factor that is not zero."""
    return Convention("common factor", sentence, lambda derived: derived * factor)
