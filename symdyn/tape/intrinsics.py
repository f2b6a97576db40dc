"""Numeric algorithms that a tape calls where statements would not do: so many numbers in, so many out.

Generated code calls them by name. Their text in Python is in a module of its own, such as those of symdyn.tape.algorithms, for
doubles, for many digits, for statements on a tape and for generated Python modules; that in C is in templates/c/runtime/NAME.h.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import partial
from types import SimpleNamespace
from typing import Any

import numpy as np

from symdyn.tape.algorithms.saddle import (
    SYMDYN_CLEANINGS,
    SYMDYN_MASSLESS,
    SYMDYN_ROUNDS,
    symdyn_least_multipliers,
    symdyn_saddle_point,
)
from symdyn.tape.algorithms.states import symdyn_stacked

# Singular values of constraints, scaled to rows of about 1, that are below this part of the largest are zero, wherever a rank is
# looked for.
RANK = 1e-8
# Singular values of the scaled constraints below this count less and less, in accelerations and in multipliers ...
SMOOTHED = 1e-5
# ... and in corrections, which would else be as large as a tiny error divided by a tiny singular value.
DAMPED = 1e-3
# A pivot of the saddle's matrix that is no more than this part of its diagonal entry is none: nothing holds some direction. The
# pivot that is the largest part of its entry goes first, so that rounding leaves less than 1e-15 of an entry. Numbers that are
# folded and the generated code take the same test; for numbers with more digits the bound is as many times their rounding.
LOOSE = 1e-14
EPS = 2.0**-52
MASSLESS, ROUNDS, CLEANINGS = SYMDYN_MASSLESS, SYMDYN_ROUNDS, SYMDYN_CLEANINGS
# Names of NumPy that the algorithms use.
_NAMES = (
    "subtract", "divide", "greater", "less_equal", "not_equal", "maximum", "logical_or", "where")


@dataclass(frozen=True)
class Intrinsic:
    """A numeric algorithm of one size. Subclasses say what is computed.

    name     in generated code; sizes: what it is called with
    module   that holds its text in Python; called_by: what of a model calls it
    reason   what it means if it fails
    letters  what its results are called in print; none where there is no function to read
    """

    sizes: tuple[int, ...]
    reason: str

    name = ""
    module = ""
    called_by = ""

    @property
    def letters(self) -> tuple[str, ...]:
        return ()

    @property
    def n_out(self) -> int:
        raise NotImplementedError

    @property
    def operations(self) -> int:
        """About how many operations it takes."""
        raise NotImplementedError

    def rows(self, values: Sequence[Any]) -> np.ndarray:
        """Results, states first, for numbers or arrays of them; NaN where generated code stops with `reason`."""
        raise NotImplementedError

    def precise(self, context: Any, values: Sequence[Any]) -> list[Any]:
        """Results for numbers of an mpmath context."""
        raise NotImplementedError

    def statements(self, recorder: Any, values: Sequence[Any]) -> list[Any] | None:
        """Results in statements, in the order of generated code, without its test whether there are any; None where branches
        forbid it."""
        return None

    def tangents(self, recorder: Any, values: Sequence[Any], results: Sequence[Any], changes: Sequence[Any]) -> list[Any]:
        """Derivatives of the results for derivatives of the values, recorded."""
        raise NotImplementedError

    def by_others(self, k: int) -> tuple[int, list[tuple[int, int]]] | None:
        """Formula of result k from others: divisor d and pairs (i, j) with results[k] values[d] = -sum(values[i] results[j]);
        None where it does not. Repeated use reaches all results that do not follow."""
        return None


@dataclass(frozen=True)
class Saddle(Intrinsic):
    """x of M x + C^T lam = f, C x = d, for sizes (n, m): M symmetric, perhaps singular, the rows of C perhaps dependent.

    Values: e, M lower triangle row by row, C row by row, scales of the rows (m) and columns (n) of C, f, d.
    Columns are scaled on until all masses M_kk are equal, rows back by the largest of their columns' factors. The augmented
    Lagrangian, iterated: (M + a C^T C) x = f - C^T lam + a C^T d, lam += a (C x - d) with a = M_kk / e^2; each round takes the
    residual again, so that rounding of the large matrix does not stay. A combination of rows with a singular value below e
    holds less and less: x depends smoothly on the values.
    Source: Bayo, Garcia de Jalon and Serna, A modified Lagrangian formulation for the dynamic analysis of constrained
    mechanical systems, Comput. Methods Appl. Mech. Eng. 71 (1988).
    """

    name = "symdyn_saddle"
    module = "symdyn.tape.algorithms.saddle"
    called_by = "constraints"

    @property
    def n_out(self) -> int:
        return self.sizes[0]

    @property
    def operations(self) -> int:
        n, m = self.sizes
        return n * (n + 1) * m + n**3 // 3 + 2 * n**3 // 3 + ROUNDS * (4 * n * n + 4 * m * n) + 2 * n

    def split(self, values: Sequence[Any]) -> tuple[Any, ...]:
        """M (n, n), C (m, n), scales of rows and columns, f, d as arrays of objects."""
        n, m = self.sizes
        triangle = n * (n + 1) // 2
        array = _objects(values[1:])
        M = np.empty((n, n), dtype=object)
        M[np.tril_indices(n)] = array[:triangle]
        M.T[np.tril_indices(n)] = array[:triangle]
        C, s, w, f, d = np.split(array[triangle:], np.cumsum([m * n, m, n, n]))
        return M, C.reshape(m, n), s, w, f, d

    def rows(self, values: Sequence[Any]) -> np.ndarray:
        return _rows(symdyn_saddle_point, self.sizes, values, LOOSE)

    def precise(self, context: Any, values: Sequence[Any]) -> list[Any]:
        e = context.sqrt(_smoothed(context))
        return _precise(symdyn_saddle_point, context, self.sizes, [e, *values[1:]], context.eps * (LOOSE / EPS))

    def statements(self, recorder: Any, values: Sequence[Any]) -> list[Any]:
        e = Fraction(float(values[0]))
        return _statements(symdyn_saddle_point, recorder, self.sizes, [e, *values[1:]], None)

    def tangents(self, recorder: Any, values: Sequence[Any], results: Sequence[Any], changes: Sequence[Any]) -> list[Any]:
        n, m = self.sizes
        M, C, s, w, f, _ = self.split(values)
        dM, dC, _, _, df, dd = self.split(changes)
        x = np.array(results, dtype=object)
        lam = np.array(recorder.call(Multipliers((n, m), self.reason), [*C.ravel(), *s, *w, *(f - M @ x)]), dtype=object)
        f_new, d_new = df - dM @ x - dC.T @ lam, dd - dC @ x
        kept = list(values)[:len(values) - n - m]  # e, the matrices and the scales
        return recorder.call(self, [*kept, *f_new, *d_new])  # type: ignore[no-any-return]


@dataclass(frozen=True)
class Multipliers(Intrinsic):
    """lam of C^T lam = g of least norm after scaling, for sizes (n, m): the rows of C perhaps dependent.

    Values: C row by row, scales of its rows (m) and columns (n), g. Iterated regularized normal equations,
    lam += (C C^T + e^2)^-1 C (g - C^T lam) with e = SMOOTHED, which stay in the range of C but for rounding, divided by e^2;
    that is what applying e^2 (C C^T + e^2)^-1 to lam again and again leaves, and it is taken off.
    """

    name = "symdyn_multipliers"
    module = "symdyn.tape.algorithms.saddle"
    called_by = "constraints"

    @property
    def n_out(self) -> int:
        return self.sizes[1]

    @property
    def operations(self) -> int:
        n, m = self.sizes
        return m * (m + 1) * n + m**3 // 3 + ROUNDS * ((2 + 2 * CLEANINGS) * m * m + 4 * m * n) + 2 * n

    def split(self, values: Sequence[Any]) -> tuple[Any, ...]:
        """C (m, n), scales of rows and columns, g as arrays of objects."""
        n, m = self.sizes
        array = _objects(values)
        C, s, w, g = np.split(array, np.cumsum([m * n, m, n]))
        return C.reshape(m, n), s, w, g

    def rows(self, values: Sequence[Any]) -> np.ndarray:
        return _rows(symdyn_least_multipliers, self.sizes, values, SMOOTHED)

    def precise(self, context: Any, values: Sequence[Any]) -> list[Any]:
        return _precise(symdyn_least_multipliers, context, self.sizes, values, context.sqrt(_smoothed(context)))

    def statements(self, recorder: Any, values: Sequence[Any]) -> list[Any]:
        return _statements(symdyn_least_multipliers, recorder, self.sizes, values, Fraction(SMOOTHED))

    def tangents(self, recorder: Any, values: Sequence[Any], results: Sequence[Any], changes: Sequence[Any]) -> list[Any]:
        C, s, w, _ = self.split(values)
        dC, _, _, dg = self.split(changes)
        lam = np.array(results, dtype=object)
        return recorder.call(self, [*C.ravel(), *s, *w, *(dg - dC.T @ lam)])  # type: ignore[no-any-return]


def _objects(values: Sequence[Any]) -> np.ndarray:
    """An array of anything, (n,)."""
    array = np.empty(len(values), dtype=object)
    for k, value in enumerate(values):
        array[k] = value
    return array


def _rows(algorithm: Callable[..., Any], sizes: tuple[int, ...], values: Sequence[Any], bound: float) -> np.ndarray:
    """Results in doubles, states first; NaN where there are none."""
    with np.errstate(all="ignore"):
        result, failed = algorithm(np, *sizes, symdyn_stacked(values), bound)
    return np.moveaxis(np.where(failed, np.nan, result), 0, -1)


def _precise(algorithm: Callable[..., Any], context: Any, sizes: tuple[int, ...], values: Sequence[Any], bound: Any) -> list[Any]:
    """Results for numbers of an mpmath context. Raises ZeroDivisionError where there are none."""
    root = SimpleNamespace(**{name: getattr(np, name) for name in _NAMES}, sqrt=np.frompyfunc(context.sqrt, 1, 1))
    result, failed = algorithm(root, *sizes, _objects(values), bound)
    if failed:
        raise ZeroDivisionError("the matrix is singular")
    return [context.convert(v) for v in result]


def _statements(algorithm: Callable[..., Any], recorder: Any, sizes: tuple[int, ...], values: Sequence[Any],
                bound: Any) -> list[Any]:
    """Results as nodes of a tape."""
    def recorded(op: str, arguments: int) -> Any:
        return np.frompyfunc(partial(recorder.apply, op), arguments, 1)

    two = {"greater": "gt", "less_equal": "le", "not_equal": "ne", "maximum": "max", "logical_or": "or"}
    functions = SimpleNamespace(
        **{name: recorded(op, 2) for name, op in two.items()}, subtract=np.subtract, divide=np.frompyfunc(recorder.div, 2, 1),
        sqrt=np.frompyfunc(recorder.sqrt, 1, 1), where=recorded("select", 3))
    return list(algorithm(functions, *sizes, _objects(values), bound)[0])


def _smoothed(context: Any) -> Any:
    """The square of the singular value below which constraints count less and less, with so many digits."""
    return context.mpf(10) ** -(context.dps // 2)
