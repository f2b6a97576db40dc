"""Arguments that are True or False, one of some words, or a name: whatever else is passed is an error.

Python takes any value for true or false, so that a text "no" would switch on what it was meant to switch off; and lists and
arrays can be neither compared with words nor looked up.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, SupportsIndex

from symdyn.errors import ArgumentError
from symdyn.shown import shown


def flag(value: Any, what: str) -> bool:
    """True or False, also NumPy's. Raises ArgumentError for anything else; what: names the argument, with its owner."""
    if not isinstance(value, bool) and type(value).__name__ not in ("bool", "bool_"):
        raise ArgumentError(f"{what} is {shown(value)}; pass True or False")
    return bool(value)


def word(value: Any, known: Iterable[str], what: str) -> str:
    """One of the known words. Raises ArgumentError for anything else; what: names the argument, with its owner."""
    words = list(known)
    if not isinstance(value, str) or value not in words:
        raise ArgumentError(f"{what} is {shown(value)}; pass {' or '.join(map(repr, words))}")
    return str(value)


def text(value: Any, what: str, example: str) -> str:
    """Text. Raises ArgumentError for anything else; what: names the argument, with its owner."""
    if not isinstance(value, str):
        raise ArgumentError(f"{what} is {shown(value)}; pass text such as {example!r}")
    return str(value)


def whole(value: Any, what: str, least: int = 1, most: int = 2**31 - 1) -> int:
    """A whole number in a range, also NumPy's. Raises ArgumentError for anything else; what: names the argument."""
    if isinstance(value, bool) or not isinstance(value, SupportsIndex) or hasattr(value, "__len__") \
            or not least <= value.__index__() <= most:
        raise ArgumentError(f"{what} is {shown(value)}; pass a whole number from {least} to {most}")
    return int(value)
