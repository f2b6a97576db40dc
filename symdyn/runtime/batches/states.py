"""Right-hand sides of many states at once: on the processor's vectors with the C backend, by broadcasting with NumPy."""

from __future__ import annotations

import ctypes
import warnings
from collections.abc import Mapping
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from symdyn.backend.c_records import fields_of
from symdyn.errors import ArgumentError, EvaluationWarning
from symdyn.real_numbers import real_of
from symdyn.runtime.batches.arguments import take_rows, together
from symdyn.runtime.batches.precision import checked_precision
from symdyn.runtime.gpu.device import device_number
from symdyn.runtime.memory import demand
from symdyn.shown import shown

if TYPE_CHECKING:
    from symdyn.runtime.module import Module

LIBRARY = "rhs_batch"
# A warning lists the numbers of at most so many rows.
LISTED = 8


class Table(ctypes.Structure):
    """Numbers with a row for each trajectory, or one for all; see c/runtime/table_type.h."""

    _fields_ = fields_of("runtime/table_type.h")


def tables_of(arrays: list[np.ndarray]) -> Any:
    """Tables of arrays (n, n_names) of doubles, which have to stay; one row holds for all."""
    return (Table * len(arrays))(*[
        Table(a.ctypes.data, a.strides[0] // a.itemsize if len(a) > 1 else 0, a.strides[1] // a.itemsize) for a in arrays])


def width(module: Module) -> int:
    """Number of states computed at once on one processor core."""
    library: Any = module.library(LIBRARY) if module.backend == "c" else None
    return 1 if library is None else int(library.function("batch_width")())


def parameter_rows(module: Module, params: Any) -> np.ndarray:
    """Parameters, (n, n_p), or (1, n_p) where none varies."""
    if params is None:  # looking at every one of them takes longer than some hundred states
        return module.default_parameters[None, :]
    defaults = dict(zip(module.metadata.parameters, module.metadata.defaults, strict=True))
    return take_rows(params, module.metadata.parameters, "parameters", defaults, module.name)


def input_rows(module: Module, inputs: Any, defaults: Mapping[str, float]) -> np.ndarray:
    """Constant inputs, (n, n_in), or (1, n_in) where none varies."""
    names = module.metadata.inputs
    left_out = inputs is None or (isinstance(inputs, (list, tuple)) and not inputs) or getattr(inputs, "size", 1) == 0
    given = None if left_out else inputs
    return take_rows(given, names, "inputs", {n: defaults.get(n, 0.0) for n in names}, module.name)


def rhs_batch(module: Module, t: Any, x: Any, params: Any = None, inputs: Any = (), out: Any = None, device: Any = "cpu",
              precision: Any = "double") -> Any:
    """x_dot (n, n_x); see Module.rhs_batch."""
    number = device_number(device, module.name)
    precision = checked_precision(precision, number is not None, module.name)
    values = {"t": t, "x": x, "params": params, "inputs": inputs}
    if number is not None:
        from symdyn.runtime.batches.states_on_device import states_on_device

        xd, reasons, n, states = states_on_device(module, number, values, out, precision, partial(_rows, module),
                                               lambda x, n: _result(module, x, (n, module.metadata.sizes.x), out))
        _warn_of(module, reasons, n, states)
        return xd
    n, arrays = _rows(module, values)
    states, n_x = arrays["x"], module.metadata.sizes.x
    demand(n * n_x * (1 if module.backend == "c" else 3), module.name, f"{n} rows of {n_x} numbers", "pass fewer rows at a time")
    xd = _result(module, states, (n, n_x), out)
    if out is not None:  # what is read must not be written before
        arrays = {what: a.copy() if np.may_share_memory(a, out) else a for what, a in arrays.items()}
    _warn_of(module, (_on_vectors if module.backend == "c" else _broadcast)(module, n, arrays, xd), n, states)
    return xd


def _rows(module: Module, values: Mapping[str, Any]) -> tuple[int, dict[str, np.ndarray]]:
    """Number of states, and the rows of t, x, inputs and params."""
    t, x = values["t"], values["x"]
    states, times = _numbers(module, x, "x"), _numbers(module, t, "t")
    n_x = module.metadata.sizes.x
    if states.ndim == 1:
        states = states[None, :]
    if states.ndim != 2 or states.shape[1] != n_x:
        raise ArgumentError(f"{module.name}: x has the shape {np.shape(x)}, needed is (n, {n_x}): "
                            f"{', '.join(module.metadata.x)}")
    if times.ndim > 1:
        raise ArgumentError(f"{module.name}: t has the shape {times.shape}; give one time, or one for each state")
    arrays = {"t": times.reshape(-1, 1), "x": states, "inputs": input_rows(module, values["inputs"], module.metadata.initial),
              "params": parameter_rows(module, values["params"])}
    return together(arrays, module.name), arrays


def _warn_of(module: Module, reasons: Mapping[int, str], n: int, states: np.ndarray) -> None:
    """Warns of rows that fail; states: none where they are on a device."""
    if reasons:
        rows = [f"row {k}: {why}{_given_not_finite(module, states[min(k, len(states) - 1)]) if len(states) else ''}"
                for k, why in list(reasons.items())[:LISTED]]
        more = f"; and {len(reasons) - LISTED} more" if len(reasons) > LISTED else ""
        warnings.warn(f"{module.name}: rhs cannot be evaluated in {len(reasons)} of {n} rows, which are NaN: "
                      f"{'; '.join(rows)}{more}", EvaluationWarning, stacklevel=4)


def _result(module: Module, states: np.ndarray, shape: tuple[int, int], out: np.ndarray | None) -> np.ndarray:
    if out is None:  # laid out as the states are: entry by entry is quicker to load into vectors
        by_entry = len(states) == shape[0] > 1 and states.strides[0] < states.strides[1]
        return np.empty(shape[::-1]).T if by_entry else np.empty(shape)
    if not isinstance(out, np.ndarray) or out.shape != shape or out.dtype != np.float64 or not out.flags.behaved:
        raise ArgumentError(f"{module.name}: out must be a writable array of doubles of the shape {shape}, found "
                            f"{shown(getattr(out, 'shape', out))} of {getattr(out, 'dtype', type(out).__name__)}")
    return out


def _on_vectors(module: Module, n: int, arrays: Mapping[str, np.ndarray], xd: np.ndarray) -> dict[int, str]:
    """Fill xd; returns why, for rows that fail."""
    library: Any = module.library(LIBRARY)
    codes = np.zeros(n, dtype=np.intc)
    steps = (ctypes.c_long * 2)(*[s // xd.itemsize for s in xd.strides])
    call = library.function("rhs_batch")
    call.restype = ctypes.c_long
    tables = tables_of([arrays[k] for k in ("t", "x", "inputs", "params")])
    failed = call(ctypes.c_long(n), tables, ctypes.c_void_p(xd.ctypes.data), steps, ctypes.c_void_p(codes.ctypes.data))
    return {int(k): library.reason(int(codes[k])) for k in np.flatnonzero(codes)} if failed else {}


def _broadcast(module: Module, n: int, arrays: Mapping[str, np.ndarray], xd: np.ndarray) -> dict[int, str]:
    """The same with NumPy: all at once, without the rows that turn out to fail."""
    library: Any = module.library("rhs")
    t, x, inputs, p = (np.broadcast_to(arrays[k], (n, arrays[k].shape[1])) for k in ("t", "x", "inputs", "params"))
    reasons: dict[int, str] = {}
    xd[:] = np.nan
    left = np.arange(n)
    while len(left):
        rows: Any = left if len(left) < n else slice(None)
        try:
            xd[rows] = library.broadcast("rhs", t[rows, 0], x[rows], p[rows], inputs[rows])
            break
        except library.module.SingularError as error:
            failed = np.broadcast_to(error.states, len(left))
            reasons |= dict.fromkeys(left[failed].tolist(), str(error))
            left = left[~failed]
        except (ArithmeticError, ValueError):  # of a function of the user, say, which does not name the rows
            reasons |= _one_by_one(library, left, (t, x, inputs, p), xd)
            break
    for k in np.flatnonzero(~np.isfinite(xd).all(axis=1)).tolist():
        reasons.setdefault(k, "the result is not finite")
        xd[k] = np.nan
    return dict(sorted(reasons.items()))


def _one_by_one(library: Any, rows: np.ndarray, arguments: tuple[np.ndarray, ...], xd: np.ndarray) -> dict[int, str]:
    """Fill these rows of xd; returns why, for those that fail."""
    reasons = {}
    for k in rows.tolist():
        t, x, inputs, p = (a[k] for a in arguments)
        try:
            xd[k] = library.evaluate("rhs", float(t[0]), x, tuple(p.tolist()), inputs)
        except (ArithmeticError, ValueError) as error:
            reasons[k] = str(error)
    return reasons


def _numbers(module: Module, values: Any, what: str) -> np.ndarray:
    return real_of(values, module.name, f"{what} must be real numbers")


def _given_not_finite(module: Module, x: np.ndarray) -> str:
    bad = [name for name, value in zip(module.metadata.x, x, strict=True) if not np.isfinite(value)]
    return f" ({', '.join(bad)} given not finite)" if bad else ""
