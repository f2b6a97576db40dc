"""Conventions in which a slide may differ from symdyn without being wrong; each is a change of what symdyn derives."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import sympy as sp

from symdyn.comparison.check import as_tuple, described, is_count, text
from symdyn.comparison.equality import decide
from symdyn.errors import CaseError, ModelError
from symdyn.model.symbols import as_expression


@dataclass(frozen=True)
class Convention:
    """A named way of writing: to_slide(derived) is what a slide in that convention prints.

    name       short: "opposite sign"
    sentence   what the slide does otherwise
    to_slide   takes an expression or a matrix (of an equation: left minus right), returns the same

    A case rejects a convention without name, sentence or function; what to_slide raises becomes a CaseError.

    >>> q = sp.Symbol("q")
    >>> degrees = sd.conventions.Convention("degrees", "The slide's angle is in degrees.", lambda derived: derived * 180 / sp.pi)
    >>> degrees.to_slide(sp.pi / 2)
    90
    """

    name: str
    sentence: str
    to_slide: Callable[[Any], Any]

    def faults(self) -> list[str]:
        """Missing entries."""
        name = f"the convention {self.name!r}" if isinstance(self.name, str) and self.name.strip() else "a convention"
        faults = text(self.name, f"the name of {name}")
        if isinstance(self.sentence, str) and not self.sentence.strip():
            faults.append(f"{name} has no sentence; say in `sentence` what the slide does otherwise")
        else:
            faults += text(self.sentence, f"the sentence of {name}")
        if not callable(self.to_slide):
            faults.append(f"`to_slide` of {name} is {described(self.to_slide)}; pass a function of what is derived")
        return faults


def opposite_sign(sentence: str) -> Convention:
    """The slide counts the other direction as positive.

    >>> m, g, q = sp.symbols("m g q")
    >>> turned = sd.conventions.opposite_sign("The slide counts torques clockwise.")
    >>> formula = sd.Formula("torque", m * g * sp.sin(q), -m * g * sp.sin(q), conventions=turned)
    >>> print(sd.compare(sd.Case("torques", formulas=[formula])))
    torques
      torque  1 equal up to a convention, proved
          opposite sign: The slide counts torques clockwise.
      1 entry: 1 equal up to a convention, proved
    """
    return Convention("opposite sign", sentence, lambda derived: -derived)


def transposed(sentence: str) -> Convention:
    """The slide's rotation takes components the other way, or its vector is a row.

    >>> q = sp.Symbol("q")
    >>> sd.conventions.transposed("The slide turns the axes.").to_slide(sd.rotation.about("Z", q))
    Matrix([
    [ cos(q), sin(q), 0],
    [-sin(q), cos(q), 0],
    [      0,      0, 1]])
    """
    return Convention("transposed", sentence, lambda derived: _matrix(derived, "transposed").T)


def reordered(rows: Sequence[int] | None = None, columns: Sequence[int] | None = None, sentence: str = "") -> Convention:
    """The slide's row i is row rows[i] of symdyn's, its column j is columns[j]; each holds every index once.

    Raises CaseError without rows and columns, and when it is applied to a formula of another size.

    >>> a, b = sp.symbols("a b")
    >>> sd.conventions.reordered(rows=[1, 0], sentence="The slide begins with y.").to_slide(sp.Matrix([a, b])).T
    Matrix([[b, a]])
    """
    if rows is None and columns is None:
        raise CaseError(["an order of coordinates has neither rows nor columns; pass rows=[...] or columns=[...]"])

    def change(derived: Any) -> Any:
        matrix = _matrix(derived, "put in another order")
        return matrix.extract(_order(rows, "rows", matrix), _order(columns, "columns", matrix))

    return Convention("order of coordinates", sentence, change)


def other_point(value: Any, sentence: str) -> Convention:
    """The slide refers to another point; value: what symdyn derives for that one.

    >>> m, l, I_O = sp.symbols("m l I_O")
    >>> sd.conventions.other_point(I_O - m * l**2, "The slide's inertia is about G.").to_slide(I_O)
    I_O - l**2*m
    """
    return Convention("reference point", sentence, lambda _: value)


def scaled(factor: Any, sentence: str) -> Convention:
    """The slide's equation is multiplied by a factor that is not zero: a number or a SymPy expression.

    Raises CaseError for text, for what has no finite value, and for a factor that is zero everywhere.

    >>> m, x = sp.symbols("m x")
    >>> sd.conventions.scaled(1 / m, "The slide divides by m.").to_slide(m * x)
    x
    """
    try:
        taken = as_expression(factor, "the common factor")
    except ModelError as error:
        raise CaseError(error.faults) from None
    if decide([taken], [sp.S.Zero])[0].equal:
        raise CaseError([f"the common factor {factor} is zero, and would make all formulas equal; pass one that is not"])
    return Convention("common factor", sentence, lambda derived: derived * taken)


def _matrix(derived: Any, done: str) -> Any:
    if not isinstance(derived, sp.MatrixBase):
        raise CaseError([f"what is derived is a scalar, {derived!s:.80}; only a vector or a matrix can be {done}"])
    return derived


def _order(given: Any, what: str, matrix: Any) -> list[int]:
    size = matrix.rows if what == "rows" else matrix.cols
    if given is None:
        return list(range(size))
    order = as_tuple(given)
    if not isinstance(order, tuple) or not all(map(is_count, order)) or sorted(order) != list(range(size)):
        raise CaseError([f"{what} is {given!r:.80}, what is derived is {matrix.rows} x {matrix.cols}; pass each index from 0 to "
                         f"{size - 1} once"])
    return [int(k) for k in order]
