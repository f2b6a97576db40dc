"""Fingerprint of a function of the user, as far as it can be found out: a short text that changes with its code."""

from __future__ import annotations

import functools
import hashlib
import sys
from collections.abc import Callable, Iterator
from types import CodeType
from typing import Any

import numpy as np

# Functions called by functions are followed so far.
DEPTH = 8


def fingerprint(function: Callable[..., Any]) -> str:
    """Fingerprint of the statements, constants, defaults and enclosed values of a function, and of the functions and plain values
    of its module that it names. Comments and line numbers do not count; installed packages, and what objects hold, are not looked
    at.
    """
    digest = hashlib.sha256(f"{sys.version_info[0]}.{sys.version_info[1]}".encode())  # other versions have other byte code
    for part in _parts(function, DEPTH, set()):
        digest.update(part.encode())
    return digest.hexdigest()[:16]


def _parts(value: Any, depth: int, seen: set[int]) -> Iterator[str]:
    if isinstance(value, functools.partial):
        yield from _parts([value.func, *value.args, *sorted(value.keywords.items())], depth, seen)
    elif isinstance(value, CodeType):
        yield f"{value.co_code.hex()} {value.co_names} {value.co_varnames}"
        for constant in value.co_consts:
            yield from _parts(constant, depth, seen)
    elif isinstance(value, (bool, int, float, complex, str, bytes, type(None))):
        yield repr(value)
    elif depth and isinstance(value, (tuple, list)):
        yield f"{type(value).__name__} of {len(value)}"
        for entry in value:
            yield from _parts(entry, depth - 1, seen)
    elif isinstance(value, (set, frozenset)):
        yield f"set {sorted(map(repr, value))}"
    elif isinstance(value, np.ndarray) and value.dtype != object:
        yield f"{value.shape} {value.dtype} {hashlib.sha256(value.tobytes()).hexdigest()}"
    elif depth and hasattr(value, "__func__"):  # a method
        yield from _parts(value.__func__, depth, seen)
    elif depth and hasattr(value, "__code__"):
        if id(value) in seen:  # functions that call each other
            return
        seen.add(id(value))
        yield from _parts(value.__code__, depth, seen)
        yield from _parts([value.__defaults__, *sorted((value.__kwdefaults__ or {}).items())], depth, seen)
        yield from _parts([_content(cell) for cell in value.__closure__ or ()], depth - 1, seen)
        for name in value.__code__.co_names:
            named = value.__globals__.get(name)
            if getattr(named, "__module__", value.__module__) == value.__module__ or isinstance(named, np.ndarray):
                yield name
                yield from _parts(named, depth - 1, seen)
    elif depth and callable(value) and hasattr(type(value).__call__, "__code__"):
        yield from _parts(type(value).__call__, depth, seen)
    else:
        yield getattr(value, "__qualname__", type(value).__qualname__)


def _content(cell: Any) -> Any:
    """None where the enclosed name has no value yet."""
    try:
        return cell.cell_contents
    except ValueError:
        return None
