"""Numbers for expressions of a motion: at one instant, or over time."""

from __future__ import annotations

import difflib
from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
import sympy as sp

from symdyn.errors import ArgumentError, EvaluationError, ModelError, UnsupportedExpression
from symdyn.frames.rates import differentiated, taken
from symdyn.model.symbols import Coordinate, Rate, symbols_of, take_over, time
from symdyn.shown import name_of, shown
from symdyn.tape.floats import evaluate_rows
from symdyn.tape.recorder import Recorder
from symdyn.tape.sympy_bridge import record_expression
from symdyn.tape.tape import Tape

if TYPE_CHECKING:
    from symdyn.given import Motions, Scalar, Times


def numbers(value: Scalar | sp.MatrixBase, values: Motions | None = None, t: Times | None = None) -> float | np.ndarray:
    """The number of an expression, or the numbers of a matrix.

    values   symbol or name -> number, or an expression in sd.t and other symbols that have values, from which rates
             follow (q: 2*sd.t also gives q.dot = 2); with an array t also a function of t. Values that are not used are ignored
    t        a time in s, or an array of times (n_t,); without it sd.t may stand in values
    Returns a float for an expression, (n,) for a column, (m, n) for a matrix; with an array t the times come first. With an
    array t a number is a constant motion, with rate 0; at one instant its rate is a value of its own.
    Raises ArgumentError, listing all faults, for missing values, values that are no finite numbers, and a bad t;
    EvaluationError where the result is not finite.

    >>> q = sd.coordinates("q")
    >>> sd.frames.numbers(sp.Matrix([sp.cos(q), q.dot]), {q: 0.0, q.dot: 2.0})
    array([1., 2.])
    >>> sd.frames.numbers(3 * sd.t, t=[0.0, 0.5, 1.0])
    array([0. , 1.5, 3. ])
    """
    entries, shape = _entries(value)
    times, over_time = _times(t)
    given, functions = _given(values, times, over_time)
    if t is not None:
        functions[time.name] = times
    rows = _evaluated(entries, _with_rates(given, over_time), functions, len(times))
    bad = ~np.isfinite(rows)
    if bad.any():
        at, k = np.argwhere(bad)[0]
        where = f" at t = {times[at]:.6g} s" if t is not None else ""
        raise EvaluationError(f"entry {k + 1} has no finite value{where}; it is {entries[k]}")
    result = rows.reshape((len(times), *shape))
    if over_time:
        return result
    return float(result[0]) if shape == () else result[0]


def _entries(value: Any) -> tuple[list[sp.Expr], tuple[int, ...]]:
    if isinstance(value, sp.MatrixBase):
        shape = (value.rows,) if value.cols == 1 else value.shape
        return [taken(f"entry {k + 1}", e) for k, e in enumerate(value)], shape
    return [taken("the expression", value)], ()


def _times(t: Any) -> tuple[np.ndarray, bool]:
    if t is None:
        return np.zeros(1), False
    try:
        array = np.asarray(t, dtype=float)
    except (TypeError, ValueError):
        raise ArgumentError(f"t is {shown(t)}; pass a time in s or an array of times (n_t,)") from None
    if array.ndim > 1 or array.size == 0:
        raise ArgumentError(f"t has the shape {array.shape}; pass a time in s or an array of times (n_t,)")
    if not np.isfinite(array).all():
        raise ArgumentError(f"t has {int((~np.isfinite(array)).sum())} entries that are not finite; pass finite times in s")
    return array.reshape(-1), array.ndim == 1


def _given(values: Any, times: np.ndarray, over_time: bool) -> tuple[dict[str, sp.Expr], dict[str, np.ndarray]]:
    """Expressions by name, and the values over time of what was given as a function of t."""
    if not isinstance(values, Mapping) and values is not None:
        raise ArgumentError(f"values is {shown(values)}; pass a dict such as {{q: 0.3}}")
    given: dict[str, sp.Expr] = {}
    functions: dict[str, np.ndarray] = {}
    faults: list[str] = []
    for key, value in (values or {}).items():
        symbol = take_over(key) if isinstance(key, sp.Basic) else key
        name = name_of(symbol)
        if callable(value) and not isinstance(value, sp.Basic):
            if over_time:
                _sampled(name, value, times, functions, faults)
            else:
                faults.append(f"{name} is given as a function, but t is no array; pass a number or an expression in sd.t")
            continue
        try:
            given[name] = taken(f"the value of {name}", value)
        except ModelError as error:
            faults.extend(error.faults)
    if faults:
        raise ArgumentError("; ".join(faults))
    return given, functions


def _sampled(name: str, function: Callable, times: np.ndarray, functions: dict[str, np.ndarray], faults: list[str]) -> None:
    """Call a function of t once for each time, so that it need not know arrays."""
    try:
        sampled = np.array([float(function(float(t))) for t in times])
    except (TypeError, ValueError) as error:
        faults.append(f"the function given for {name} does not return a number for a time: {error}")
        return
    if not np.isfinite(sampled).all():
        at = times[~np.isfinite(sampled)][0]
        faults.append(f"the function given for {name} is not finite at t = {at:.6g} s")
    functions[name] = sampled


def _with_rates(given: dict[str, sp.Expr], over_time: bool) -> dict[str, sp.Expr]:
    """Adds the rates that follow from motions; at one instant a mere number says nothing of the rate."""
    table = dict(given)
    for name, motion in given.items():
        if name == time.name:
            continue
        moving = motion.has(time) or any(isinstance(s, (Coordinate, Rate)) for s in symbols_of(motion))
        if moving or over_time:
            speed = motion
            for rate_name in (Coordinate(name).dot.name, Coordinate(name).ddot.name):
                try:
                    speed = differentiated([speed])[0]
                except ModelError:
                    break
                table.setdefault(rate_name, speed)
    return table


class _Values:
    """Values of symbols on a tape: what was given for each, or a leaf with a value for each time."""

    def __init__(self, table: dict[str, sp.Expr], functions: dict[str, np.ndarray]) -> None:
        self.recorder = Recorder()
        self.table = table
        self.functions = functions
        self.nodes: dict[str, Any] = {name: self.recorder.leaf(name, 0) for name in sorted(functions)}
        self.missing: dict[str, None] = {}
        self.pending: list[str] = []
        self.memory: dict[sp.Basic, Any] = {}

    def expression(self, e: sp.Expr) -> Any:
        leaves = {s: self.symbol(s.name) for s in sorted(symbols_of(e), key=str)}
        return record_expression(self.recorder, e, leaves, self.memory)

    def symbol(self, name: str) -> Any:
        if name in self.pending:
            raise ArgumentError(f"values are given in a circle: {' -> '.join([*self.pending, name])}")
        if name not in self.nodes:
            if name in self.table:
                self.pending.append(name)
                self.nodes[name] = self.expression(self.table[name])
                self.pending.pop()
            else:
                self.missing[name] = None
                return 1
        return self.nodes[name]


def _evaluated(entries: list[sp.Expr], table: dict[str, sp.Expr], functions: dict[str, np.ndarray], n: int) -> np.ndarray:
    """The entries at n times, (n, number of entries)."""
    values = _Values(table, functions)
    nodes: list[Any] = []
    fault = ""
    try:
        nodes = [values.expression(e) for e in entries]
    except (UnsupportedExpression, ZeroDivisionError) as error:
        fault = f"no number comes of {entries}: {error}"
    if values.missing:
        raise ArgumentError("; ".join(_missing(name, [*table, *functions], functions) for name in sorted(values.missing)))
    if fault:
        raise EvaluationError(fault)
    return evaluate_rows(Tape.of(values.recorder, rows=nodes), functions, n)["rows"]


def _missing(name: str, given: list[str], functions: dict[str, np.ndarray]) -> str:
    base = name.removesuffix("_ddot").removesuffix("_dot")
    if base != name and base in functions:
        return (f"there is no value for {name}: {base} is given as a function, whose rate is not known; give {name} too, or "
                f"{base} as an expression in sd.t")
    near = difflib.get_close_matches(name, given, 1)
    return f"there is no value for {name}; give one in values" + (f" (there is {shown(near[0])})" if near else "")
