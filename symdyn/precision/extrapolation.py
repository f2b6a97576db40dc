"""Ordinary differential equations at any precision: Gragg-Bulirsch-Stoer extrapolation of variable order and step size.

Source: Hairer, Norsett and Wanner, Solving Ordinary Differential Equations I, II.9 (the midpoint rule with 2, 4, 6, ...
steps has an error in even powers of the step; order and step size are those of least work per unit of time).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

Field = Callable[[Any, Sequence[Any]], list[Any]]
# t, x, x_dot there, h, number of steps -> x at t + h
Rule = Callable[[Any, Sequence[Any], Sequence[Any], Any, int], list[Any]]
MOST_ROWS = 30
_FIRST_ROWS = 8


@dataclass(frozen=True)
class Run:
    """The state at the end, and what it took."""

    x: list[Any]
    n_steps: int
    n_rejected: int
    n_evaluations: int


@dataclass(frozen=True)
class _Step:
    """A trial step: its end, the errors of its rows, relative to the tolerance, and whether the last of them is small enough."""

    x: list[Any]
    errors: list[Any]
    good: bool


def integrate(field: Field, span: tuple[Any, Any], x: Sequence[Any], tolerance: Any, groups: Sequence[slice], context: Any,
              corrected: Callable[[Any, list[Any]], list[Any]] = lambda t, x: x, rule: Rule | None = None) -> Run:
    """x at the end of the span for x_dot = field(t, x).

    tolerance   of the local error of a step, relative to the largest entry of each of the groups of x
    context     of mpmath; it should have ten digits more than the tolerance
    corrected   what is done to the state after every step
    rule        the midpoint rule of this field, where there is a faster one than `midpoint`
    Raises ArithmeticError where x_dot is not finite, or no step is small enough.
    """
    rule = rule or partial(midpoint, field)
    t, end = span
    x, h = list(x), (end - t) / 100
    rows, made, rejected, evaluations = _FIRST_ROWS, 0, 0, 0
    while t < end:
        h = min(h, end - t)
        begin = field(t, x)
        if not _finite(begin):
            raise ArithmeticError(f"x_dot is not finite at t = {context.nstr(t, 10)}")
        step = _extrapolate(rule, t, x, begin, h, rows + 2, tolerance, groups, context)
        evaluations += 1 + sum(2 * k + 1 for k in range(len(step.errors) + 1))
        if step.good:
            t = end if h == end - t else t + h
            x = corrected(t, step.x)
            made += 1
        else:
            rejected += 1
        grown, rows = _next(step.errors, h, rows, step.good)
        h = grown if step.good else min(grown, h / 2)
        if not h > (end - span[0]) * tolerance:
            raise ArithmeticError(f"the step size vanishes at t = {context.nstr(t, 10)}")
    return Run(x, made, rejected, evaluations)


def _extrapolate(rule: Rule, t: Any, x: Sequence[Any], begin: Sequence[Any], h: Any, most: int, tolerance: Any,
                 groups: Sequence[slice], context: Any) -> _Step:
    """Rows of the tableau until the last two entries of one agree."""
    above: list[list[Any]] = [rule(t, x, begin, h, 2)]
    errors: list[Any] = []
    for j in range(1, min(most, MOST_ROWS)):
        row = [rule(t, x, begin, h, 2 * (j + 1))]
        for k in range(j):
            divisor = 1 / (context.mpf(j + 1)**2 / context.mpf(j - k)**2 - 1)
            row.append([a + (a - b) * divisor for a, b in zip(row[k], above[k], strict=True)])
        errors.append(_error(row[j], row[j - 1], x, begin, h, groups) / tolerance)
        if errors[-1] <= 1 and j > 1:
            return _Step(row[j], errors, True)
        if j > 3 and errors[-1] > 1e3 * errors[-2] and errors[-2] > errors[-3]:  # it does not converge
            break
        above = row
    return _Step(list(x), errors, False)


def midpoint(field: Field, t: Any, x: Sequence[Any], begin: Sequence[Any], h: Any, n: int) -> list[Any]:
    """x at t + h by the explicit midpoint rule with n steps; begin: x_dot at t."""
    small = h / n
    double = 2 * small
    before, now = list(x), [a + small * f for a, f in zip(x, begin, strict=True)]
    for i in range(1, n):
        rate = field(t + i * small, now)
        before, now = now, [a + double * f for a, f in zip(before, rate, strict=True)]
    return now


def _error(best: Sequence[Any], second: Sequence[Any], x: Sequence[Any], begin: Sequence[Any], h: Any,
           groups: Sequence[slice]) -> Any:
    """The largest difference relative to the size of its group."""
    worst: Any = 0 if _finite(best) and _finite(second) else math.inf
    for group in groups if not worst else ():
        size = max([*[abs(e) for e in x[group]], *[abs(e) for e in best[group]], *[abs(h * e) for e in begin[group]]], default=0)
        difference = max((abs(a - b) for a, b in zip(best[group], second[group], strict=True)), default=0)
        if difference:
            worst = max(worst, difference / size)
    return worst


def _finite(values: Sequence[Any]) -> bool:
    return all(v - v == 0 for v in values)


def _next(errors: Sequence[Any], h: Any, rows: int, good: bool) -> tuple[Any, int]:
    """Step size and number of rows with which a unit of time takes least work.

    errors[i] is that of row i + 2, of order 2 i + 3 in h; n rows take n (n + 1) evaluations.
    """
    reach = {}
    for i, error in enumerate(errors):
        factor = (4 * error) ** (-1 / (2.0 * i + 3)) if error else 4.0
        reach[i + 2] = h * max(min(factor, 4.0), 0.02)
    work = {n: n * (n + 1) / step for n, step in reach.items() if n > 3}
    best = min(work, key=work.__getitem__, default=max(reach))
    step = reach[best]
    if good and best == max(reach) and best < MOST_ROWS - 2:  # one more row might do better yet
        step, best = step * (best + 2) / best, best + 1
    return step, best
