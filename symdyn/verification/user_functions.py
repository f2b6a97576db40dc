"""Functions of the user: whether what is given as their derivatives is that."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import mpmath
import numpy as np

from symdyn.errors import EvaluationError
from symdyn.formulation.equations import Equations
from symdyn.tape.external import UserFunction
from symdyn.tape.node import Node
from symdyn.tape.tape import Tape
from symdyn.verification.sample import Sample, relative

Row = tuple[str, Callable[[Sample], float | None], float]


def user_functions(equations: Equations) -> list[UserFunction]:
    """Those that the motion depends on, by name, with their derivatives."""
    result = [node.args[0] for node in _calls(equations)]
    for f in result:
        result += [f.derivative] if f.derivative is not None else []
    return sorted(dict.fromkeys(result), key=lambda f: f.label)


def checks_of_user_functions(equations: Equations, backends: Mapping[str, str]) -> list[Row]:
    """A row for functions at all digits and one for those in floating point, if there are such with derivatives; and where all
    have some, one for the Jacobian in each backend (its name -> what it is called)."""
    known = [f for f in user_functions(equations) if f.derivative is not None]
    rows: list[Row] = []
    for precise, where, tolerance in ((True, "", 1e-15), (False, ", in floating point", 1e-6)):
        if any(_is_precise(f) == precise for f in known):
            rows.append((f"derivatives of functions of the user{where}", _derivatives_agree(precise), tolerance))
    if known and all(node.args[0].derivative is not None for node in _calls(equations)):
        rows += [(f"exact Jacobian of the {called} module agrees with the tape", _jacobian_agrees(backend), 1e-9)
                 for backend, called in backends.items()]
    return rows


def without_digits(equations: Equations) -> str:
    """Message about functions that are known in floating point only."""
    names = [f.label for f in user_functions(equations) if f.digits is None]
    several = len(names) > 1
    return "" if not names else (f"{', '.join(names)}: in floating point, as {'they have' if several else 'it has'} no function "
                                 "`precise`")


def _is_precise(f: UserFunction) -> bool:
    return f.digits is not None and f.derivative is not None and f.derivative.digits is not None


def _calls(equations: Equations) -> list[Node]:
    return [n for n in equations.tape("rhs").steps if n.op == "call" and isinstance(n.args[0], UserFunction)]


def _derivatives_agree(precise: bool) -> Callable[[Sample], float | None]:
    """Derivatives that are given against central differences, where the functions are called."""
    def check(s: Sample) -> float | None:
        residuals: list[float] = []
        for node in _calls(s.equations):
            f, *arguments = node.args
            tape = Tape.of(s.equations.recorder, at=np.array([*arguments], dtype=object))
            at = list(s.evaluate(tape)["at"])
            while f is not None and f.derivative is not None:
                if _is_precise(f) == precise:
                    residuals.append(_residual(f, at, mpmath.mpf(10) ** (-s.digits // 3) if precise else mpmath.mpf(2) ** -17))
                f = f.derivative
        return max(residuals, default=None)
    return check


def _jacobian_agrees(backend: str) -> Callable[[Sample], float | None]:
    """The Jacobian, where the derivatives are called."""
    def check(s: Sample) -> float | None:
        symbols = s.equations.symbols
        x, p, inputs = ([float(s.values[n.name]) for group in groups for n in group] for groups in (
            (symbols.coordinates, symbols.speeds, symbols.states), (symbols.parameters,), (symbols.inputs,)))
        try:
            result = s.equations.compile(backend=backend).evaluate("jacobian_x", float(s.values["t"]), x, p, inputs)
        except EvaluationError:
            return float("inf") if s.numbers else None
        return relative(result - s["jacobian_x"], s["jacobian_x"])
    return check


def _residual(f: UserFunction, at: list[Any], step: Any) -> float:
    """Largest difference of the derivatives at a point from central differences, relative to the largest of each result."""
    assert f.derivative is not None
    given = np.array(f.derivative.precise(mpmath.mp, at), dtype=object).reshape(f.results, len(at))
    residual = 0.0
    result = np.empty_like(given)
    for j, value in enumerate(at):
        h = step * max(1, abs(value))
        ends = [f.precise(mpmath.mp, [*at[:j], value + sign * h, *at[j + 1:]]) for sign in (1, -1)]
        result[:, j] = [(a - b) / (2 * h) for a, b in zip(*ends, strict=True)]
    for k, here in enumerate(f.precise(mpmath.mp, at)):
        residual = max(residual, relative(result[k] - given[k], np.array([*given[k], *result[k], here])))
    return residual
