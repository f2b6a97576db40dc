"""Simplification for printing only; nothing on the way to numbers goes through here.

Exact algebra writes an expression in its shortest form (symdyn.exact), within bounds on terms and not on time, so that the form
is the same on every machine. Expressions that are too large for it, or have functions that it does not know, are searched by
SymPy's methods within a time limit.
"""

from __future__ import annotations

import functools
import time as clock
from collections.abc import Callable
from functools import partial
from typing import Any

import sympy as sp
from sympy.functions.elementary.trigonometric import TrigonometricFunction
from sympy.simplify.fu import TR10i

from symdyn.errors import UnsupportedExpression
from symdyn.exact.ring import TooLarge
from symdyn.exact.shortest import shortest
from symdyn.model.symbols import Rate, Speed
from symdyn.report.limit import TimeUp, within

# SymPy's general methods are tried on expressions up to this many operations: their time cannot be bounded.
_SHORT = 60
_LONGEST = 4000


def simplified(value: Any, seconds: float) -> Any:
    """An expression or a matrix, entry by entry, in its shortest form; short entries first.

    Every entry is equal to the one given. Those that exact algebra does not write are as simple as SymPy's methods make them
    before the time is up.
    """
    deadline = clock.monotonic() + seconds
    if not isinstance(value, sp.MatrixBase):
        return _entry(value, deadline)
    known: dict[sp.Expr, sp.Expr] = {}
    result = value.copy().as_mutable()
    for k in sorted(range(len(value)), key=lambda k: sp.count_ops(value[k])):
        e = value[k]
        if e not in known:
            opposite = known.get(-e)
            known[e] = -opposite if opposite is not None else _entry(e, deadline)
        result[k] = known[e]
    return result


def shown_zero(e: sp.Expr) -> bool:
    """Whether multiplying out, with the sums of squares and of angles, shows that an expression is zero; no is no proof."""
    over = sp.fraction(sp.together(e))[0]
    return any(attempt(over) == 0 for attempt in (_polynomial, _angle_sums))


def _entry(e: sp.Expr, deadline: float) -> sp.Expr:
    """The shortest form, or the shortest of what each method makes of the best so far."""
    try:
        return shortest(e)
    except (TooLarge, UnsupportedExpression, ZeroDivisionError):
        return _searched(e, deadline)


def _searched(e: sp.Expr, deadline: float) -> sp.Expr:
    best = e
    for attempt in (_polynomial, _angle_sums, _by_speeds, sp.factor_terms, _general):
        try:
            best = within(deadline - clock.monotonic(), partial(_shorter, attempt, best))
        except TimeUp:
            return best
    try:
        return within(deadline - clock.monotonic(), lambda: best.replace(
            _is_minus_sum, lambda e: sp.Add(*[-term for term in e.args[1].args])))
    except TimeUp:
        return best


def _shorter(attempt: Callable[[sp.Expr], sp.Expr], e: sp.Expr) -> sp.Expr:
    candidate = attempt(e)
    return candidate if _length(candidate) < _length(e) else e


def _is_minus_sum(e: sp.Expr) -> bool:
    """-(a + b), which reads better as -a - b."""
    return e.is_Mul and len(e.args) == 2 and e.args[0] == -1 and e.args[1].is_Add


def _polynomial(e: sp.Expr) -> sp.Expr:
    """Multiply out, with sin^2 + cos^2 = 1 used for each angle the way that leaves fewer terms."""
    if sp.count_ops(e) > _LONGEST:
        return e
    result = sp.expand(e)
    for angle in sorted({f.args[0] for f in result.atoms(sp.sin, sp.cos)}, key=str):
        s, c = sp.sin(angle), sp.cos(angle)
        choices = [result]
        for square, other in ((s, c), (c, s)):
            replaced = result.replace(lambda p, f=square: p.is_Pow and p.base == f and p.exp.is_Integer and p.exp >= 2,
                                      lambda p, f=square, o=other: (1 - o**2) ** (p.exp // 2) * f ** (p.exp % 2))
            choices.append(sp.expand(replaced))
        result = min(choices, key=_length)
    return result


def _angle_sums(e: sp.Expr) -> sp.Expr:
    """cos a cos b - sin a sin b = cos(a + b) and its like, one product of speeds at a time."""
    terms = _collected(e)
    return sp.Add(*[factor * TR10i(rest) for factor, rest in terms.items()]) if sp.count_ops(e) < _LONGEST else e


def _by_speeds(e: sp.Expr) -> sp.Expr:
    """Gather what multiplies each product of speeds."""
    return sp.Add(*[factor * sp.factor_terms(rest) for factor, rest in _collected(e).items()])


def _collected(e: sp.Expr) -> dict[sp.Expr, sp.Expr]:
    """Products of speeds -> their coefficients."""
    terms: dict[sp.Expr, list[sp.Expr]] = {}
    for term in sp.Add.make_args(e):
        speeds: list[sp.Expr] = []
        rest: list[sp.Expr] = []
        for factor in sp.Mul.make_args(term):
            moving = isinstance(factor.as_base_exp()[0], (Rate, Speed))
            (speeds if moving else rest).append(factor)
        terms.setdefault(sp.Mul(*speeds), []).append(sp.Mul(*rest))
    return {factor: sp.Add(*parts) for factor, parts in terms.items()}


@functools.lru_cache(maxsize=1000)
def _general(e: sp.Expr) -> sp.Expr:
    """SymPy's own search, in which sums of angles take nearly all of the time; without products of sines there are none.

    Equations of one mechanism repeat each other's parts: forms, links, quantities. Results are cached, as SymPy does."""
    if sp.count_ops(e) > _SHORT:
        return e
    if _degree(e) > 1:
        return sp.simplify(e)
    names = {f: sp.Dummy(real=f.is_real) for f in sorted(e.atoms(sp.sin, sp.cos), key=sp.default_sort_key)}
    return sp.simplify(e.xreplace(names)).xreplace({name: f for f, name in names.items()})


def _degree(e: sp.Expr) -> float:
    """At most so many sines and cosines of angles, or of their sums and differences, are multiplied; inf: something else."""
    if not e.has(TrigonometricFunction):
        return 0
    if isinstance(e, (sp.sin, sp.cos)):
        return 1 if all(a.is_Atom or (-a).is_Atom for a in sp.Add.make_args(e.args[0])) else float("inf")
    if e.is_Add:
        return max(map(_degree, e.args))
    if e.is_Mul:
        return sum(map(_degree, e.args))
    if e.is_Pow and e.exp.is_Integer and e.exp > 0:
        return int(e.exp) * _degree(e.base)
    return float("inf")


def _length(e: sp.Expr) -> tuple[int, int]:
    """Operations; double and half angles count extra, since mechanisms are read in the angles they are described by."""
    multiples = sum(1 for f in e.atoms(sp.sin, sp.cos) for a in sp.Add.make_args(f.args[0])
                    if a.as_coeff_Mul()[0] not in (1, -1))
    return int(sp.count_ops(e)) + 6 * multiples, len(str(e))
