"""Faults of what a case is given, found before anything is derived."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from numbers import Integral
from typing import Any

from symdyn.errors import CaseError

INDEX = "tuples such as (0,) of a vector, (0, 1) of a matrix, counted from 0"


def described(value: Any) -> str:
    """A value and its type, for messages."""
    return f"{value!r:.80} of type {type(value).__name__}"


def as_tuple(value: Any, one: type | tuple[type, ...] = ()) -> Any:
    """A sequence or generator as a tuple, a single object of the type `one` as a tuple of it; all else stays as it is."""
    if isinstance(value, one):
        return (value,)
    if isinstance(value, Iterable) and not isinstance(value, (str, bytes, Mapping)):
        return tuple(value)
    return value


def is_count(value: Any) -> bool:
    """Whether it is a whole number from 0 on."""
    return isinstance(value, Integral) and not isinstance(value, bool) and int(value) >= 0


def is_index(value: Any) -> bool:
    """Whether it can be the place of an entry: () of a scalar, (i,) or (i, j)."""
    return isinstance(value, tuple) and len(value) <= 2 and all(map(is_count, value))


def text(value: Any, what: str, empty: bool = False) -> list[str]:
    """The fault of what should be text."""
    if isinstance(value, str) and (empty or value.strip()):
        return []
    if isinstance(value, str):
        return [f"{what} is empty; write it out"]
    return [f"{what} is {described(value)}; pass text"]


def mapping(value: Any, what: str, example: str) -> list[str]:
    """The fault of what should be a dict."""
    return [] if isinstance(value, Mapping) else [f"{what} is {described(value)}; pass a dict: {example}"]


def members(value: Any, what: str, kind: type, example: str) -> list[str]:
    """The faults of what should be objects of one type; value as it comes from as_tuple()."""
    if not isinstance(value, tuple):
        return [f"{what} is {described(value)}; pass a list: [{example}, ...]"]
    return [f"{what}[{k}] is {described(one)}; pass {example}" for k, one in enumerate(value) if not isinstance(one, kind)]


def guarded(function: Callable[..., Any], what: str) -> Callable[..., Any]:
    """The same function; whatever it raises becomes a CaseError that says where."""
    def call(*arguments: Any) -> Any:
        try:
            return function(*arguments)
        except CaseError as error:
            raise CaseError([f"{what}: {fault}" for fault in error.faults]) from None
        except Exception as error:  # the function is the user's, and may raise anything
            raise CaseError([f"{what} ended with {type(error).__name__}: {error}"]) from error

    return call
