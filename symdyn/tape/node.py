"""A node is one scalar operation of the tape; Python's operators on nodes record new ones."""

from __future__ import annotations

from fractions import Fraction
from numbers import Number
from typing import TYPE_CHECKING, Any

from symdyn.shown import shown

if TYPE_CHECKING:
    from symdyn.tape.recorder import Recorder

# Dependencies of a value, as bits; a node's mask is the union over its arguments.
PARAMETER, TIME, COORDINATE, SPEED, STATE, INPUT, ACCELERATION, SEED = (1 << k for k in range(8))


class Node:
    """One recorded scalar: an operation with its arguments, or a leaf (an input of the tape).

    Nodes are made by a Recorder only, one per distinct operation, so that `is` means equal.
    """

    __slots__ = ("args", "index", "mask", "op", "recorder", "section")

    def __init__(self, recorder: Recorder, op: str, args: tuple, index: int, mask: int, section: str) -> None:
        self.recorder = recorder
        self.op = op
        self.args = args
        self.index = index
        self.mask = mask
        self.section = section

    def __add__(self, other: Any) -> Any:
        return self.recorder.add(self, other) if isinstance(other, _OPERANDS) else NotImplemented

    def __radd__(self, other: Any) -> Any:
        return self.recorder.add(other, self) if isinstance(other, _NUMBERS) else NotImplemented

    def __sub__(self, other: Any) -> Any:
        return self.recorder.sub(self, other) if isinstance(other, _OPERANDS) else NotImplemented

    def __rsub__(self, other: Any) -> Any:
        return self.recorder.sub(other, self) if isinstance(other, _NUMBERS) else NotImplemented

    def __mul__(self, other: Any) -> Any:
        return self.recorder.mul(self, other) if isinstance(other, _OPERANDS) else NotImplemented

    def __rmul__(self, other: Any) -> Any:
        return self.recorder.mul(other, self) if isinstance(other, _NUMBERS) else NotImplemented

    def __truediv__(self, other: Any) -> Any:
        return self.recorder.div(self, other) if isinstance(other, _OPERANDS) else NotImplemented

    def __rtruediv__(self, other: Any) -> Any:
        return self.recorder.div(other, self) if isinstance(other, _NUMBERS) else NotImplemented

    def __neg__(self) -> Any:
        return self.recorder.neg(self)

    def __pos__(self) -> Node:
        return self

    def __pow__(self, exponent: Any) -> Any:
        return self.recorder.pow(self, exponent) if isinstance(exponent, (Node, Number)) else NotImplemented

    def __repr__(self) -> str:
        """The operation with its arguments by name or number: a tape is too long to be reported whole."""
        if self.op == "leaf":
            return f"<{self.args[1]}>"
        listed = ", ".join(a.label if isinstance(a, Node) else repr(a) for a in self.args)
        return f"<{self.label}: {self.op}({listed})>"

    @property
    def label(self) -> str:
        """Its name, or its number on the recorder."""
        return str(self.args[1]) if self.op == "leaf" else self.recorder.names.get(self, f"#{self.index}")


# Usual types first: only what is none of them is looked up among the abstract ones, which takes long.
_NUMBERS = (int, float, Fraction, Number)
_OPERANDS = (Node, *_NUMBERS)


def exact(value: Any) -> int | Fraction:
    """The number as an exact rational, so that folding constants never rounds.

    Raises ValueError for NaN and infinity.
    """
    if isinstance(value, int):
        return int(value)
    if isinstance(value, Fraction):
        return value.numerator if value.denominator == 1 else value
    try:
        fraction = Fraction(value.item() if hasattr(value, "item") else value)
    except (OverflowError, ValueError) as error:
        raise ValueError(f"a constant of the equations must be a finite real number, found {shown(value)}") from error
    return fraction.numerator if fraction.denominator == 1 else fraction


def is_zero(value: Any) -> bool:
    """True for a structural zero."""
    return not isinstance(value, Node) and value == 0
