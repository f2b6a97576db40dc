"""A motion as a table of pandas or a data set of xarray, with units."""

from __future__ import annotations

import importlib
import math
from typing import TYPE_CHECKING, Any

from symdyn.errors import MissingExtra

if TYPE_CHECKING:
    from symdyn.runtime.solutions.solution import Solution


def _library(name: str) -> Any:
    try:
        return importlib.import_module(name)
    except ImportError as error:
        raise MissingExtra(f"to_{name} needs {name} ({error}); pip install 'symdyn[data]'") from None


def _units(solution: Solution) -> dict[str, str]:
    """Units of states, inputs and outputs that are points, by name, as far as they are known."""
    metadata = solution.module.metadata
    known = {**{name: metadata.units.get(name, "") for name in (*metadata.x, *metadata.inputs)}, **metadata.output_units}
    return {name: unit for name, unit in known.items() if unit}


def _entries(solution: Solution) -> dict[str, str]:
    """Column of an output with several entries -> the output."""
    return {f"{name}_{k + 1}": name for name, rows in solution.outputs.items() for k in range(math.prod(rows.shape[1:]))
            if math.prod(rows.shape[1:]) > 1}


def to_pandas(solution: Solution) -> Any:
    """See Solution.to_pandas."""
    pandas = _library("pandas")
    titles, columns = solution.columns()
    entries, known = _entries(solution), _units(solution)
    frame = pandas.DataFrame(dict(zip(titles[1:], columns[1:], strict=True)), index=pandas.Index(columns[0], name="t"))
    frame.attrs = {"name": solution.module.name,
                   "units": {"t": "s", **{title: known[entries.get(title, title)] for title in titles
                                          if entries.get(title, title) in known}}}
    return frame


def to_xarray(solution: Solution) -> Any:
    """See Solution.to_xarray."""
    xarray = _library("xarray")
    titles, columns = solution.columns()
    entries, known = _entries(solution), _units(solution)
    values: dict[str, Any] = {title: (("t",), column) for title, column in zip(titles[1:], columns[1:], strict=True)
                              if title not in entries}
    values |= {name: (("t", *[f"{name}_{k}" for k in range(rows.ndim - 1)]), rows) for name, rows in solution.outputs.items()
               if name not in values}
    return xarray.Dataset({name: (axes, array, {"units": known[name]} if name in known else {})
                           for name, (axes, array) in values.items()},
                          coords={"t": ("t", columns[0], {"units": "s"})}, attrs={"name": solution.module.name})
