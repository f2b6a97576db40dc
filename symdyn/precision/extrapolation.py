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

from symdyn.errors import EvaluationError

Field = Callable[[Any, Sequence[Any]], list[Any]]
# t, x -> on which side of each kink of the field that is
Sides = Callable[[Any, Sequence[Any]], Sequence[bool]]
# t, x, x_dot there, h, number of steps -> x at t + h
Rule = Callable[[Any, Sequence[Any], Sequence[Any], Any, int], list[Any]]
MOST_ROWS = 30
_FIRST_ROWS = 8
# Kinks that are crossed one after the other without a step between them.
_MOST_AT_ONCE = 50


class NotFinite(EvaluationError):
    """A field gives what is no finite number."""


class _Beyond(Exception):
    """A step goes across a kink."""


@dataclass(frozen=True)
class Run:
    """The state at the end, and what it took."""

    x: list[Any]
    n_steps: int
    n_rejected: int
    n_evaluations: int
    kinks: tuple[Any, ...] = ()  # times at which they were crossed


@dataclass(frozen=True)
class _Step:
    """A trial step: its end, the errors of its rows, relative to the tolerance, whether the last of them is small enough, and
    whether it goes across a kink."""

    x: list[Any]
    errors: list[Any]
    good: bool
    beyond: bool = False


def integrate(field: Field, span: tuple[Any, Any], x: Sequence[Any], tolerance: Any, groups: Sequence[slice], context: Any,
              corrected: Callable[[Any, list[Any]], list[Any]] = lambda t, x: x, rule: Rule | None = None,
              sides: Sides | None = None) -> Run:
    """x at the end of the span for x_dot = field(t, x).

    tolerance   of the local error of a step, relative to the largest entry of each of the groups of x
    context     of mpmath; it should have ten digits more than the tolerance
    corrected   what is done to the state after every step
    rule        the midpoint rule of this field, where there is a faster one than `midpoint`
    sides       where the field has kinks: no step goes from one side to another but one that is shorter than the tolerance, so
                that kinks are located to its digits; the rule is then `midpoint`
    Raises ArithmeticError where x_dot is not finite, or no step is small enough.
    """
    t, end = span
    x, h = list(x), (end - t) / 100
    here = None if sides is None else sides(t, x)

    def one_sided(t: Any, x: Sequence[Any]) -> list[Any]:
        if sides is not None and sides(t, x) != here:
            raise _Beyond
        return field(t, x)

    rule = partial(midpoint, one_sided) if sides is not None else rule or partial(midpoint, field)
    rows, made, rejected, evaluations, at_once = _FIRST_ROWS, 0, 0, 0, 0
    kinks: list[Any] = []
    while t < end:
        h = min(h, end - t)
        begin = field(t, x)
        if not _finite(begin):
            raise ArithmeticError(f"x_dot is not finite at t = {context.nstr(t, 10)}")
        step = _extrapolate(rule, t, x, begin, h, rows + 2, tolerance, groups, context)
        evaluations += 1 + sum(2 * k + 1 for k in range(len(step.errors) + 1))
        beyond = step.beyond or (step.good and sides is not None and sides(t + h, step.x) != here)
        least = (end - span[0]) * tolerance
        if beyond:
            rejected += 1
            h /= 2
            if sides is not None and h <= least and at_once < _MOST_AT_ONCE:
                t, x = t + h, corrected(t + h, [a + h * f for a, f in zip(x, begin, strict=True)])
                if sides(t, x) != here:
                    here = sides(t, x)
                    kinks.append(t)
                at_once += 1
                h = 2 * least
        else:
            grown, rows = _next(step.errors, h, rows, step.good)
            if step.good:
                t, x = end if h == end - t else t + h, corrected(t + h, step.x)
                made, at_once, h = made + 1, 0, grown
            else:
                rejected, h = rejected + 1, min(grown, h / 2)
        if t < end and not h > least:
            raise ArithmeticError(f"the step size vanishes at t = {context.nstr(t, 10)}")
    return Run(x, made, rejected, evaluations, tuple(kinks))


def _extrapolate(rule: Rule, t: Any, x: Sequence[Any], begin: Sequence[Any], h: Any, most: int, tolerance: Any,
                 groups: Sequence[slice], context: Any) -> _Step:
    """Rows of the tableau until the last two entries of one agree."""
    above: list[list[Any]] = []
    errors: list[Any] = []
    for j in range(min(most, MOST_ROWS)):
        try:
            row = [rule(t, x, begin, h, 2 * (j + 1))]
        except NotFinite:  # the step is too large
            errors.append(math.inf)
            break
        except _Beyond:
            return _Step(list(x), errors, False, True)
        for k in range(j):
            divisor = 1 / (context.mpf(j + 1)**2 / context.mpf(j - k)**2 - 1)
            row.append([a + (a - b) * divisor for a, b in zip(row[k], above[k], strict=True)])
        if j == 0:
            above = row
            continue
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
