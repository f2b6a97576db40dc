"""Takes values over at the edge: by name, by symbol or in order; complains about all that does not fit at once."""

from __future__ import annotations

import difflib
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from symdyn.errors import ArgumentError, no_value
from symdyn.real_numbers import NotReal, number, real_of
from symdyn.shown import name_of, shown


def take(values: Any, names: Sequence[str], what: str, defaults: Mapping[str, float | None], owner: str) -> np.ndarray:
    """Values in the order of names, in an array of their own: what the caller changes later in its arrays changes nothing here.

    values    None for the defaults, a mapping from names or symbols, or a sequence in order
    defaults  name -> number or None; a name that is left out takes it
    Raises ArgumentError naming what is missing, unknown, not a number or not finite, and for a wrong length.
    """
    if values is None:
        values = {}
    if isinstance(values, Mapping):
        return _from_mapping(values, names, what, defaults, owner)
    array = np.array(real_of(values, owner, f"{what} must be numbers"))
    if array.ndim == 0 and len(names) == 1:
        array = array.reshape(1)
    if array.shape != (len(names),):
        raise ArgumentError(f"{owner}: {what} has the shape {array.shape}, needed are {len(names)} numbers"
                            f"{': ' + ', '.join(names) if names else ''}")
    _finite(array, names, what, owner)
    return array


def fixed(array: np.ndarray) -> np.ndarray:
    """A view that cannot be written to, of what results are evaluated from later."""
    view = array.view()
    view.flags.writeable = False
    return view


def some(values: Any, names: Sequence[str], what: str, owner: str) -> dict[str, float]:
    """Those values that are given, by name; None for none of them.

    Raises ArgumentError as `take` does, and for what is no mapping.
    """
    if values is None:
        return {}
    if not isinstance(values, Mapping):
        raise ArgumentError(f"{owner}: {what} must be a mapping from symbols or names to numbers, found {shown(values)}")
    array = take(values, names, what, dict.fromkeys(names, 0.0), owner)
    given = {name_of(key) for key in values}
    return {name: float(value) for name, value in zip(names, array, strict=True) if name in given}


def _from_mapping(values: Mapping, names: Sequence[str], what: str, defaults: Mapping[str, float | None],
                  owner: str) -> np.ndarray:
    given: dict[str, Any] = {}
    faults = []
    for key, value in values.items():
        name = name_of(key)
        if name not in names:
            near = difflib.get_close_matches(name, names, 3, cutoff=0.5)
            hint = f", did you mean {' or '.join(near)}?" if near else f"; there are {', '.join(names) or 'none'}"
            faults.append(f"there is no {shown(name)}{hint}")
            continue
        try:
            given[name] = number(value)
        except NotReal as error:
            why = "" if isinstance(value, str) else f": {error}"
            if what == "inputs" and over_time(value):
                raise ArgumentError(f"{owner}: {what}: {_of_one_time(name, value, names)}") from None
            if np.shape(value) != () and len(np.shape(value)) == 2 and np.shape(value)[1] == 2 and what == "inputs":
                why += "; pass a table over time as a pair (times, values)"
            faults.append(f"the value of {name} is {shown(value)}, not a number{why}")
    missing = [n for n in names if n not in given and defaults.get(n) is None]
    missing = [n for n in missing if not any(n in f for f in faults)]
    if missing:
        faults.append(no_value(missing))
    if faults:
        raise ArgumentError(f"{owner}: {what}: " + "; ".join(faults))
    array = np.array([given.get(n, defaults.get(n)) for n in names], dtype=float)
    _finite(array, names, what, owner)
    return array


class OverTime:
    """Base of objects that stand for an input over time."""


def over_time(value: Any) -> bool:
    """Whether a value for one input is a function, a spline or a table over time, or a sampled controller."""
    pair = isinstance(value, tuple) and len(value) == 2 and np.ndim(value[0]) == 1
    return callable(value) or pair or isinstance(value, OverTime)


def _of_one_time(name: str, value: Any, names: Sequence[str]) -> str:
    """Message about an input over time where its number at one time belongs."""
    fault = (f"{name} is {shown(value, 60)}, over time; functions, splines and tables are for simulate, simulate_batch and "
             "consistent. Here pass its number at this time")
    if f"{name}_dot" not in names:
        return f"{fault}, inputs={{{name}: 0.1}}"
    return f"{fault}, and those of its rate and acceleration, inputs={{{name}: 0.1, {name}.dot: 0.2, {name}.ddot: 0}}"


def _finite(array: np.ndarray, names: Sequence[str], what: str, owner: str) -> None:
    if not np.isfinite(array).all():
        bad = [f"{n} = {v}" for n, v in zip(names, array, strict=True) if not np.isfinite(v)]
        raise ArgumentError(f"{owner}: {what} must be finite, found {', '.join(bad)}")
