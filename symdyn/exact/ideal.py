"""Polynomials where others are zero: constraints as relations, in addition to those of sines, cosines and roots.

A polynomial that multiples of the relations add up to vanishes wherever they do: division leaves no rest. By the relations
themselves that depends on their order; by a Groebner basis none is left exactly where there are such multiples. The basis is
formed up to a count of polynomials, terms and bits, on every machine the same, since some have millions; what it has got to then
proves, too, but decides nothing else.
Source: Cox, Little, O'Shea, Ideals, Varieties, and Algorithms, chapters 2 (division, Buchberger's algorithm) and 4 (what is not
zero has an inverse w, with x w = 1; a polynomial is zero where its square is).
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from math import lcm
from typing import Any

from flint import Ordering, fmpq_mpoly_ctx, fmpz_mpoly_ctx, fmpz_mpoly_vec

from symdyn.exact.ring import Ring

# Polynomials of the basis, terms and bits of numbers that it is formed up to, one after the other.
LIMITS = ((60, 1000, 300), (200, 3000, 500))
# Longer relations and rests are not divided.
TERMS = 5_000
# Rests with up to so many terms are tried squared, too.
SQUARED = 40


class Ideal:
    """The multiples of relations in a ring, and their sums.

    relations   polynomials of the ring that are zero; nonzero: generators that are not
    """

    def __init__(self, ring: Ring, relations: Sequence[Any], nonzero: Collection[int] = ()) -> None:
        own = [p for p in relations if len(p) and len(p) <= TERMS]
        used = {k for p in own for k, degree in enumerate(p.degrees()) if degree}
        units = sorted(k for k in nonzero if k in used)
        self._n, self._wide = len(ring.generators), len(ring.generators) + len(units)
        names = ("x", max(self._wide, 1))
        self._context = fmpq_mpoly_ctx.get(names, Ordering.degrevlex)
        self._integers = fmpz_mpoly_ctx.get(names, Ordering.degrevlex)
        self._own = [self._taken(p) for p in own]
        self._rules = [self._taken(p) for p in ring.relations]
        x = self._context.gens()
        self._inverses = [x[k] * x[self._n + index] - 1 for index, k in enumerate(units)]
        self._bases: dict[tuple[int, bool], list[Any]] = {}

    def contains(self, p: Any) -> bool:
        """Whether multiples of the relations add up to a polynomial of the ring, or to its square; no may be for its size."""
        if len(p) > TERMS:
            return False
        left = self._taken(p)
        if any(not len(divmod(left, relation)[1]) for relation in self._own):
            return True
        ways = [self._basis(0)[::-1]]
        ways += [self._basis(step, inverses) for inverses in (False, True)[:1 + bool(self._inverses)]
                 for step in range(len(LIMITS) + 1)]
        tried = [left, left * left] if len(p) <= SQUARED else [left]
        return any(not len(_rest(candidate, basis)) for candidate in tried for basis in ways)

    def _basis(self, step: int, inverses: bool = False) -> list[Any]:
        """The relations, or with them the basis within LIMITS[step - 1]; short ones first."""
        if (step, inverses) not in self._bases:
            rows = [*self._own, *self._rules, *(self._inverses if inverses else ())]
            if step and rows:
                integers = fmpz_mpoly_vec([_integer(p, self._integers) for p in rows], self._integers)
                result: Any = integers.buchberger_naive(limits=LIMITS[step - 1])
                rows += [self._context.from_dict(p.to_dict()) for p in result[0]]
            self._bases[step, inverses] = sorted([p for p in rows if len(p)], key=lambda p: (len(p), str(p)))
        return self._bases[step, inverses]

    def _taken(self, p: Any) -> Any:
        """A polynomial of the ring in the generators of the ideal."""
        more = (0,) * (self._wide - self._n)
        return self._context.from_dict({(*exponents, *more): c for exponents, c in p.to_dict().items()})


def _rest(p: Any, divisors: Sequence[Any]) -> Any:
    """Rest of repeated division in this order."""
    while True:
        before = p
        for divisor in divisors:
            p = divmod(p, divisor)[1]
            if len(p) > TERMS:
                return p
        if p == before:
            return p


def _integer(p: Any, context: Any) -> Any:
    """A multiple of the polynomial with integers."""
    common = lcm(*[int(c.q) for c in p.coeffs()])
    return context.from_dict({exponents: int((c * common).p) for exponents, c in p.to_dict().items()})
