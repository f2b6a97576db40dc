"""Inputs of a simulation: numbers, tables over time, or functions of time and state."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from symdyn.errors import ArgumentError
from symdyn.runtime.arguments import take
from symdyn.runtime.raised import InputRaised, called


@dataclass(frozen=True)
class Inputs:
    """One of: constant (n_in,), table over times (linear between rows, ends held), function f(t, x) -> (n_in,).

    The function of inputs that are given one by one looks into their tables: of_tables.
    """

    constant: np.ndarray
    times: np.ndarray | None = None
    table: np.ndarray | None = None
    function: Callable[[float, np.ndarray], Any] | None = None
    of_tables: bool = False

    @property
    def has_kinks(self) -> bool:
        """Whether any is linear between rows."""
        return self.table is not None or self.of_tables

    def at(self, t: float, x: np.ndarray) -> np.ndarray:
        """The inputs at a time and state. Raises InputRaised from whatever a function raises."""
        if self.function is not None:
            given = self.function(t, x)
            try:
                values = np.asarray(given, dtype=float).reshape(-1)
            except (TypeError, ValueError):
                raise ArgumentError(f"the input function returned {given!r} at t = {t:.6g}; needed are {len(self.constant)} "
                                    "numbers") from None
            if len(values) != len(self.constant):
                raise ArgumentError(f"the input function returned {len(values)} values at t = {t:.6g}, needed are "
                                    f"{len(self.constant)}")
            return values
        if self.times is not None and self.table is not None:
            return np.array([np.interp(t, self.times, column) for column in self.table.T])
        return self.constant

    def rows(self, t: np.ndarray, x: np.ndarray) -> np.ndarray:
        """The inputs at every time, (n_t, n_in); not a number where a function raises."""
        if self.function is None and self.table is None:
            return self.constant[None, :]
        found = np.full((len(t), len(self.constant)), np.nan)
        for k, (tk, xk) in enumerate(zip(t, x, strict=True)):
            with suppress(InputRaised):
                found[k] = self.at(tk, xk)
        return found


def not_finite(names: Sequence[str], values: Any, t: float) -> str:
    """What to add to a message where a function failed: inputs that are not finite there."""
    rows = () if values is None else values
    wrong = [f"{name} is {value:g}" for name, value in zip(names, rows, strict=False) if not np.isfinite(value)]
    return f"; the input {', '.join(wrong)} at t = {t:.6g}" if wrong else ""


def take_inputs(given: Any, names: Sequence[str], initial: Mapping[str, float], owner: str) -> Inputs:
    """Inputs as the user gave them.

    given   None (defaults, else zero); numbers in order; a function of (t, x) for all; a pair (times, values); or a
            mapping from names or symbols to a number, a function of (t, x), or a pair (times, values)
    Raises ArgumentError for what fits none of these.
    """
    zeros = {n: initial.get(n, 0.0) for n in names}
    start = np.array([zeros[n] for n in names], dtype=float)
    empty = given.size == 0 if isinstance(given, np.ndarray) else isinstance(given, (Sequence, Mapping)) and not given
    if given is None or empty:
        return Inputs(start)
    if not names:
        raise ArgumentError(f"{owner}: inputs were given, but the system has none")
    if callable(given):
        return Inputs(start, function=partial(_asked, given, "the input function"))
    if isinstance(given, tuple) and len(given) == 2 and np.ndim(given[0]) == 1:
        return Inputs(start, *_table(given, len(names), owner))
    if not isinstance(given, Mapping):
        return Inputs(take(given, names, "inputs", zeros, owner))
    parts = {str(getattr(key, "name", key)): value for key, value in given.items()}
    varying = {n: v for n, v in parts.items() if callable(v) or isinstance(v, tuple)}
    constant = take({n: v for n, v in parts.items() if n not in varying} | dict.fromkeys(varying, 0.0), names, "inputs",
                    zeros, owner)
    if not varying:
        return Inputs(constant)
    places = {n: k for k, n in enumerate(names)}
    sources: list[tuple[int, Callable[[float, np.ndarray], Any]]] = []
    for name, value in varying.items():
        if callable(value):
            sources.append((places[name], partial(_asked, value, f"the function of input {name}")))
        else:
            times, table = _table(value, 1, owner)
            column = table[:, 0]
            sources.append((places[name], partial(_interpolate, times, column)))

    def mixed(t: float, x: np.ndarray) -> np.ndarray:
        values = constant.copy()
        for place, source in sources:
            value = source(t, x)
            try:
                values[place] = value
            except (TypeError, ValueError):
                raise ArgumentError(f"the function of input {names[place]} returned {value!r} at t = {t:.6g}; needed is a "
                                    "number") from None
        return values

    return Inputs(constant, function=mixed, of_tables=not all(map(callable, varying.values())))


def _asked(function: Callable[[float, np.ndarray], Any], what: str, t: float, x: np.ndarray) -> Any:
    return called(function, t, x, what)


def _interpolate(times: np.ndarray, column: np.ndarray, t: float, x: np.ndarray) -> float:
    return float(np.interp(t, times, column))


def _table(pair: tuple, n: int, owner: str) -> tuple[np.ndarray, np.ndarray]:
    try:
        times, values = (np.ascontiguousarray(part, dtype=float) for part in pair)
    except (TypeError, ValueError):
        raise ArgumentError(f"{owner}: a table of inputs is a pair of times and values, found {pair!r}") from None
    values = values[:, None] if values.ndim == n == 1 else values
    if times.ndim != 1 or len(times) == 0 or values.shape != (len(times), n):
        raise ArgumentError(f"{owner}: a table of inputs has times of shape {times.shape} and values of shape "
                            f"{np.shape(pair[1])}; give one row of {n} values for each time")
    if not (np.isfinite(times).all() and np.isfinite(values).all() and (np.diff(times) > 0).all()):
        raise ArgumentError(f"{owner}: the times of a table of inputs must increase, and all of it be finite")
    return times, values
