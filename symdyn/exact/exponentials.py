"""Exponential functions as letters: exp(x - y) = exp(x) / exp(y), exp(2 x) = exp(x)^2, hyperbolic functions, powers of what is
positive.

Exponents are sums of terms with rational factors. Each term has a letter for the exponential function of its largest part that
all exponents hold whole multiples of. Expressions that are equal for all positive values of these letters are equal; the other
way round that need not be so, since terms may depend on each other.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import gcd, lcm
from typing import Any

import sympy as sp

# Exponents are taken apart to this many whole multiples at most: exp(1000 x) is not the thousandth power of a letter.
MULTIPLES = 64


def in_letters(entries: Sequence[sp.Expr]) -> list[sp.Expr] | None:
    """The expressions with letters for exponential functions, and logarithms of products as sums; None where there is nothing of
    this."""
    plain = [_as_exponentials(e) for e in entries]
    found = sorted(set().union(*[e.atoms(sp.exp) for e in plain]), key=sp.default_sort_key)
    exponents = {e: _terms(e.exp) for e in found}
    if any(e.has(sp.E) for e in plain):
        exponents[sp.E] = {sp.S.One: sp.S.One}
    factors: dict[sp.Expr, list[sp.Rational]] = {}
    for terms in exponents.values():
        for term, factor in terms.items():
            factors.setdefault(term, []).append(factor)
    letters: dict[sp.Expr, tuple[sp.Symbol, sp.Rational]] = {}
    for k, (term, values) in enumerate(factors.items()):
        below = lcm(*[int(v.q) for v in values])
        common = sp.Rational(gcd(*[int(v * below) for v in values]), below)
        if any(abs(v / common) > MULTIPLES for v in values):
            return None
        letters[term] = sp.Dummy(f"e{k}", positive=True), common
    written = {e: sp.Mul(*[letters[term][0] ** (factor / letters[term][1]) for term, factor in terms.items()])
              for e, terms in exponents.items()}
    result = [e.xreplace(written) for e in plain]
    return None if result == list(entries) else result


def _as_exponentials(e: Any) -> sp.Expr:
    """Hyperbolic functions and powers with exponents that are no numbers by exponential functions."""
    if not e.args:
        return e
    e = e.func(*[_as_exponentials(a) for a in e.args]) if not isinstance(e, sp.exp) else sp.exp(_as_exponentials(e.exp))
    if isinstance(e, sp.log):
        return sp.expand_log(e)
    if isinstance(e, (sp.sinh, sp.cosh, sp.tanh)):
        up, down = sp.exp(e.args[0]), sp.exp(-e.args[0])
        return {sp.sinh: (up - down) / 2, sp.cosh: (up + down) / 2, sp.tanh: (up - down) / (up + down)}[e.func]
    if isinstance(e, sp.Pow) and not e.exp.is_number and e.base.is_positive:
        return sp.exp(sp.expand(e.exp * sp.expand_log(sp.log(e.base))))
    return e


def _terms(exponent: sp.Expr) -> dict[sp.Expr, sp.Rational]:
    """A sum as terms with their rational factors."""
    terms: dict[sp.Expr, sp.Rational] = {}
    for term in sp.Add.make_args(sp.expand(exponent)):
        factor, rest = term.as_coeff_Mul()
        if not factor.is_Rational:
            factor, rest = sp.S.One, term
        terms[rest] = terms.get(rest, sp.S.Zero) + factor
    return {term: factor for term, factor in terms.items() if factor}
