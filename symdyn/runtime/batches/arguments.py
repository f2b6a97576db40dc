"""Takes over values that may differ from trajectory to trajectory."""

from __future__ import annotations

import difflib
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from symdyn.arguments import over_time, take
from symdyn.errors import ArgumentError
from symdyn.real_numbers import real_of
from symdyn.shown import name_of, shown


def take_rows(values: Any, names: Sequence[str], what: str, defaults: Mapping[str, float | None], owner: str) -> np.ndarray:
    """Values in the order of names, (n, n_names) where one of them varies, else (1, n_names).

    values    None for the defaults; an array, with the trajectories along the first axis if it has two; or a mapping from
              names or symbols to numbers or to arrays (n,)
    Raises ArgumentError for what does not fit. A value that varies may be NaN, which is a fault of one trajectory alone.
    """
    if not isinstance(values, Mapping):
        array = real_of(values if values is not None else 0.0, owner, f"{what} must be real numbers")
        if values is None or array.ndim < 2:
            return take(values, names, what, defaults, owner)[None, :]
        if array.ndim > 2 or array.shape[1] != len(names):
            raise ArgumentError(f"{owner}: {what} has the shape {array.shape}, needed is (trajectories, {len(names)})"
                                f"{': ' + ', '.join(names) if names else ''}")
        return array
    given = {name_of(key): value for key, value in values.items()}
    columns = {name: _column(value, name, what, owner) for name, value in given.items()
               if _several(value) and not (what == "inputs" and over_time(value))}
    faults = [_unknown(name, names) for name in columns if name not in names]
    lengths = {name: len(column) for name, column in columns.items()}
    if len(set(lengths.values())) > 1:
        faults.append(f"{', '.join(f'{k} has {v} values' for k, v in lengths.items())}; give all that vary the same number")
    if faults:
        raise ArgumentError(f"{owner}: {what}: {'; '.join(faults)}")
    fixed = take({k: v for k, v in given.items() if k not in columns}, names, what,
                 {**defaults, **dict.fromkeys(columns, 0.0)}, owner)
    if not columns:
        return fixed[None, :]
    rows = np.tile(fixed, (next(iter(lengths.values())), 1))
    for name, column in columns.items():
        rows[:, list(names).index(name)] = column
    return rows


def side_by_side(groups: Sequence[np.ndarray], n: int) -> np.ndarray:
    """Tables (n, n_k), or (1, n_k), as one with n rows: the memory that they are in, where they are neighbours in one array."""
    parts = [group for group in groups if group.shape[1]]
    width, first = sum(group.shape[1] for group in parts), parts[0] if parts else np.zeros((n, 0))
    places, after = [], first.ctypes.data
    for group in parts:
        places.append(after)
        after += group.shape[1] * first.strides[1]
    if parts and all(len(group) == n and group.strides == first.strides and group.ctypes.data == place
                     for group, place in zip(parts, places, strict=True)) and n > 1:
        return np.lib.stride_tricks.as_strided(first, (n, width), writeable=False)
    return np.concatenate([np.broadcast_to(group, (n, group.shape[1])) for group in groups], axis=1)


def together(tables: Mapping[str, np.ndarray], owner: str) -> int:
    """Number of trajectories; a table with one row holds for all. Raises ArgumentError where the numbers differ."""
    lengths = {what: len(rows) for what, rows in tables.items() if len(rows) != 1}
    if len(set(lengths.values())) > 1:
        raise ArgumentError(f"{owner}: {', '.join(f'{what} has {n} rows' for what, n in lengths.items())}; give what varies the "
                            "same number of rows, one for each trajectory")
    return next(iter(lengths.values()), 1)


def _several(value: Any) -> bool:
    """Whether a value is a list or an array, of whatever."""
    return isinstance(value, (list, tuple)) or bool(getattr(value, "ndim", 0))


def _column(value: Any, name: str, what: str, owner: str) -> np.ndarray:
    column = real_of(value, owner, f"{what}: the values of {name} must be real numbers")
    if column.ndim != 1:
        raise ArgumentError(f"{owner}: {what}: the values of {name} have the shape {column.shape}; give one number, or one for "
                            "each trajectory")
    return column


def _unknown(name: str, names: Sequence[str]) -> str:
    near = difflib.get_close_matches(name, names, 3, cutoff=0.5)
    hint = f", did you mean {' or '.join(near)}?" if near else f"; there are {', '.join(names) or 'none'}"
    return f"there is no {shown(name)}{hint}"
