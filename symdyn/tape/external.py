"""Functions of the user on the tape, and what stands for their calls in SymPy."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import mpmath
import numpy as np
import sympy as sp
from sympy.core.function import FunctionClass

from symdyn.errors import UnsupportedExpression
from symdyn.tape.intrinsics import Intrinsic
from symdyn.tape.node import is_zero


@dataclass(frozen=True, kw_only=True)
class UserFunction(Intrinsic):
    """Function that symdyn.External makes; two with the same text are the same.

    label, arguments, results   its name, names of its arguments, number of its results
    texts        pairs of a backend and the text of the function in its language
    parts        of the runtime in C that its text calls
    derivative   gives the derivatives of the results by the arguments, row by row; None: there are none
    cost         about how many operations it takes
    numbers      computes it for arrays of one shape, one argument each; digits: for an mpmath context and its numbers
    """

    sizes: tuple[int, ...] = ()
    name: str
    label: str
    arguments: tuple[str, ...]
    results: int
    texts: tuple[tuple[str, str], ...]
    derivative: UserFunction | None
    cost: int
    numbers: Callable[..., Any] | None = field(compare=False)
    digits: Callable[..., Any] | None = field(compare=False)
    parts: tuple[str, ...] = ()

    given = True  # by the user, and not made of what a contact touches

    @property
    def n_out(self) -> int:
        return self.results

    @property
    def operations(self) -> int:
        return self.cost

    @property
    def signature(self) -> str:
        """thrust(v, omega)"""
        return f"{self.label}({', '.join(self.arguments)})"

    def text(self, backend: str) -> str | None:
        """Its text for a backend, if it has one."""
        return dict(self.texts).get(backend)

    def rows(self, values: Sequence[Any]) -> np.ndarray:
        if self.numbers is None:
            raise UnsupportedExpression(f"{self.signature} must be evaluated in Python, and has no Python function; pass python= "
                                        "to sd.External")
        shape = np.broadcast_shapes(*[np.shape(v) for v in values])
        arrays = [np.broadcast_to(np.asarray(v, dtype=float), shape).ravel() for v in values]
        with np.errstate(all="ignore"):
            result = self.numbers(*arrays)
        several = isinstance(result, (tuple, list)) or np.ndim(result) > 1
        results = list(result) if self.results > 1 and several else [result]
        if len(results) != self.results:
            raise UnsupportedExpression(f"{self.signature} must return {_arrays(self.results)}; its Python function returned "
                                        f"{len(results)}")
        try:
            rows = [np.broadcast_to(np.asarray(r, dtype=float), arrays[0].shape).reshape(shape) for r in results]
        except (TypeError, ValueError) as error:
            raise UnsupportedExpression(f"{self.signature} must return real arrays of the shape of its arguments, here "
                                        f"{arrays[0].shape}; its Python function did not: {error}") from None
        return np.stack(rows, axis=-1)

    def precise(self, context: Any, values: Sequence[Any]) -> list[Any]:
        """With `digits`; else in floating point, as `numbers` does. NaN where it is not defined."""
        if self.digits is None:
            if not all(hasattr(v, "_mpf_") for v in values):  # the root of a negative number, in a branch that is not taken
                return [context.nan] * self.results
            return [context.mpf(float(v)) for v in self.rows([float(v) for v in values])]
        try:
            result = self.digits(context, *values)
        except (ArithmeticError, ValueError):
            return [context.nan] * self.results
        results = list(result) if isinstance(result, (tuple, list)) else [result]
        if len(results) != self.results:
            raise UnsupportedExpression(f"{self.signature} must return {_numbers(self.results)}; its function `precise` returned "
                                        f"{len(results)}")
        return [context.convert(v) for v in results]

    def tangents(self, recorder: Any, values: Sequence[Any], results: Sequence[Any], changes: Sequence[Any]) -> list[Any]:
        slopes = recorder.call(self._derivative(), values)
        tangents = []
        for k in range(self.results):
            total: Any = 0
            for slope, change in zip(slopes[k * len(values):(k + 1) * len(values)], changes, strict=True):
                total = total if is_zero(change) else total + slope * change
            tangents.append(total)
        return tangents

    def _derivative(self) -> UserFunction:
        if self.derivative is None:
            raise UnsupportedExpression(f"a derivative of {self.signature} is needed and not given; pass derivative= to "
                                        "sd.External, another sd.External of the same arguments that gives "
                                        f"{_numbers(self.results * len(self.arguments))}")
        return self.derivative

    def __getstate__(self) -> dict[str, Any]:
        return {name: value for name, value in self.__dict__.items() if name != "functions"}  # classes that no module has

    @cached_property
    def functions(self) -> tuple[type[Result], ...]:
        """SymPy functions that stand for the results."""
        many = self.results > 1
        return tuple(FunctionClass(f"{self.label}_{k + 1}" if many else self.label, (Result,),
                                   {"nargs": len(self.arguments), "intrinsic": self, "index": k})
                     for k in range(self.results))

    def applied(self, arguments: Sequence[Any]) -> list[sp.Expr]:
        """Its results at these arguments, as SymPy expressions."""
        return [function(*arguments) for function in self.functions]

    def slope(self, index: int, k: int, arguments: Sequence[sp.Expr]) -> sp.Expr:
        """The derivative of one result by its argument number k, from 0."""
        return self._derivative().functions[index * len(arguments) + k](*arguments)


class Result(sp.Function):
    """One result of a function of the user; `intrinsic` is the function, `index` counts its results from 0."""

    intrinsic: UserFunction
    index: int
    is_real = True

    @classmethod
    def _should_evalf(cls, arg: Any) -> int:
        return -1  # a number among the arguments does not make a number of it

    def __reduce_ex__(self, protocol: Any) -> tuple[Any, ...]:
        return _result_at, (self.intrinsic, self.index, self.args)

    def fdiff(self, argindex: int = 1) -> sp.Expr:
        """The derivative by an argument, counted from 1."""
        return self.intrinsic.slope(self.index, argindex - 1, self.args)

    def _eval_evalf(self, prec: int) -> Any:
        """Its number where all arguments are numbers."""
        if (self.intrinsic.digits or self.intrinsic.numbers) is None or not all(a.is_number and a.is_real for a in self.args):
            return None
        with mpmath.workprec(prec + 5):
            value = self.intrinsic.precise(mpmath.mp, [a._to_mpmath(prec + 5, allow_ints=False) for a in self.args])[self.index]
            return sp.Expr._from_mpmath(value, prec) if mpmath.isfinite(value) else None

    def _sympystr(self, printer: Any) -> str:
        return f"{self.func.__name__}({printer.stringify(self.args, ', ')})"

    def _latex(self, printer: Any, exp: str | None = None) -> str:
        power = "" if exp is None else f"^{{{exp}}}"
        arguments = ", ".join(printer._print(a) for a in self.args)
        return rf"{printer._hprint_Function(self.func.__name__)}{power}{{\left({arguments} \right)}}"

    def _pretty(self, printer: Any) -> Any:
        return printer._print_Function(self)


def _result_at(intrinsic: UserFunction, index: int, arguments: Sequence[sp.Expr]) -> sp.Expr:
    return intrinsic.functions[index](*arguments)


def _arrays(n: int) -> str:
    return "one array" if n == 1 else f"{n} arrays, as a tuple"


def _numbers(n: int) -> str:
    return "one result" if n == 1 else f"{n} results"
