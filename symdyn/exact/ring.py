"""Polynomials with the relations of sines, cosines and roots, and fractions of them.

A value is a polynomial over the rational numbers in generators, over a product of factors. Generators are ordered so that what
a relation rewrites is above what it is rewritten to: roots (r^2 = a), sines (s^2 = 1 - c^2), cosines, plain symbols. A polynomial
without r^2 and s^2 is then a normal form: two polynomials are equal exactly if their normal forms are the same.
Source: Cox, Little, O'Shea, Ideals, Varieties, and Algorithms, chapter 2 (normal forms by a Groebner basis: the leading
monomials of the relations have no common factors, so that the relations are one).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

from flint import fmpq, fmpq_mpoly_ctx

from symdyn.errors import SymdynError

# Terms that a product may have; so many take about a gigabyte with forty generators.
BOUND = 2_000_000
# All products of one set of values may have so many times as many.
ALL = 20
# Terms of all values together, which are kept: about a gigabyte.
KEPT = 4_000_000
# Denominators with more terms than this are not split into factors.
FACTORED = 400
# Trial divisions of longer numerators are left out.
CANCELLED = 20_000


class TooLarge(SymdynError):
    """A value has more terms than the bound."""


@dataclass(frozen=True, eq=False)
class Value:
    """num / (product of factors of the ring to their powers); under: pairs of a factor's number and its power, sorted."""

    num: Any
    under: tuple[tuple[int, int], ...] = ()


class Ring:
    """Arithmetic with values.

    n          number of generators; roots: how many of the first ones are roots or other functions; sines: pairs of the
               generators of a sine and its cosine
    bound      terms that a product may have
    squares    generator of a root -> what its square is, filled in while values are formed
    """

    def __init__(self, n: int, sines: tuple[tuple[int, int], ...], bound: int = BOUND) -> None:
        self.context = fmpq_mpoly_ctx.get(("x", max(n, 1)), "lex")
        self.generators = self.context.gens()
        self.bound = bound
        self.sines = sines
        self.squares: dict[int, Any] = {}
        self._relations = [(s, self.generators[s] ** 2 + self.generators[c] ** 2 - 1) for s, c in sines]
        self._work = self._kept = 0
        self._roots: list[tuple[int, Any]] = []
        self.factors: list[Any] = []
        self._known: dict[str, int] = {}
        self.zero = Value(self.context.constant(0))
        self.one = Value(self.context.constant(1))

    def number(self, value: int | Fraction) -> Value:
        """A rational number."""
        return Value(self.context.constant(rational(value)))

    def generator(self, k: int) -> Value:
        """Generator number k."""
        return Value(self.generators[k])

    def relate(self, k: int, square: Any) -> None:
        """Generator k is a root of the polynomial `square`, which holds generators below it only."""
        self.squares[k] = square
        self._roots.append((k, self.generators[k] ** 2 - square))
        self._roots.sort(key=lambda row: row[0])

    # -- polynomials

    @property
    def relations(self) -> list[Any]:
        """Polynomials that are zero: r^2 - a of roots, s^2 + c^2 - 1 of sines and cosines."""
        return [relation for _, relation in (*self._roots, *self._relations)]

    def reduced(self, p: Any) -> Any:
        """The normal form."""
        if len(p) == 0:
            return p
        degrees = p.degrees()
        for k, relation in self._roots:
            if degrees[k] >= 2:
                p = divmod(p, relation)[1]
                degrees = p.degrees()
                self._check(len(p))
        for k, relation in self._relations:
            if degrees[k] >= 2:
                p = divmod(p, relation)[1]
        return p

    def product(self, a: Any, b: Any) -> Any:
        """The normal form of a product. Raises TooLarge before a product of too many terms is formed."""
        self._check(len(a) * len(b))
        self._work += len(a) * len(b)
        if self._work > ALL * self.bound:
            raise TooLarge(f"products have more than {ALL * self.bound:,} terms together")
        return self._formed(self.reduced(a * b))

    def _formed(self, p: Any) -> Any:
        """A polynomial that is kept."""
        self._kept += len(p)
        if self._kept > KEPT:
            raise TooLarge(f"values have more than {KEPT:,} terms together")
        return p

    def _check(self, terms: int) -> None:
        if terms > self.bound:
            raise TooLarge(f"a product has up to {terms:,} terms, above the bound of {self.bound:,}")

    # -- values

    def add(self, a: Value, b: Value) -> Value:
        """a + b."""
        if a.under == b.under:
            return self._short(self._formed(a.num + b.num), a.under)
        powers = dict(a.under)
        for k, n in b.under:
            powers[k] = max(n, powers.get(k, 0))
        num = self._over(a, powers) + self._over(b, powers)
        return self._short(num, tuple(sorted(powers.items())))

    def sub(self, a: Value, b: Value) -> Value:
        """a - b."""
        return self.add(a, Value(-b.num, b.under))

    def mul(self, a: Value, b: Value) -> Value:
        """a b."""
        num = self.product(a.num, b.num)
        if not a.under and not b.under:
            return Value(num)
        powers = dict(a.under)
        for k, n in b.under:
            powers[k] = powers.get(k, 0) + n
        return self._short(num, tuple(sorted(powers.items())))

    def neg(self, a: Value) -> Value:
        """-a."""
        return Value(-a.num, a.under)

    def inverse(self, a: Value) -> Value:
        """1 / a. Raises ZeroDivisionError if a is zero."""
        if len(a.num) == 0:
            raise ZeroDivisionError("an expression divides by zero")
        if a.num.is_constant():
            num: Any = self.context.constant(1 / a.num.leading_coefficient())
            powers: dict[int, int] = {}
        else:
            unit, parts = a.num.factor() if len(a.num) <= FACTORED else (fmpq(1), [(a.num, 1)])
            unit, parts = self.with_sines(unit, [(factor, int(n)) for factor, n in parts])
            num = self.context.constant(1 / unit)
            powers = {}
            for factor, n in parts:
                k, scale = self._factor(factor)
                num = num * (1 / scale) ** int(n)
                powers[k] = powers.get(k, 0) + int(n)
        for k, n in a.under:
            for _ in range(n):
                num = self.product(num, self.factors[k])
        return self._short(num, tuple(sorted(powers.items())))

    def div(self, a: Value, b: Value) -> Value:
        """a / b."""
        return self.mul(a, self.inverse(b))

    def under(self, a: Value) -> Any:
        """The denominator, multiplied out."""
        result = self.context.constant(1)
        for k, n in a.under:
            for _ in range(n):
                result = self.product(result, self.factors[k])
        return result

    def key(self, a: Value) -> str:
        """The same for the same numerator and denominator."""
        return f"{a.num}/{a.under}"

    def _over(self, a: Value, powers: Mapping[int, int]) -> Any:
        """The numerator over a denominator that holds the value's."""
        num, own = a.num, dict(a.under)
        for k, n in powers.items():
            for _ in range(n - own.get(k, 0)):
                num = self.product(num, self.factors[k])
        return num

    def with_sines(self, unit: fmpq, parts: list[tuple[Any, int]]) -> tuple[fmpq, list[tuple[Any, int]]]:
        """Factors (c - 1) (c + 1) as -s^2."""
        for s, c in self.sines:
            less, more = self.generators[c] - 1, self.generators[c] + 1
            powers = [next((n for factor, n in parts if factor == end), 0) for end in (less, more)]
            both = min(powers)
            if both:
                unit = unit * fmpq(-1) ** both
                ends = [(less, powers[0] - both), (more, powers[1] - both)]
                parts = [(f, n) for f, n in parts if f not in (less, more)] + [(f, n) for f, n in ends if n]
                parts.append((self.generators[s], 2 * both))
        return unit, parts

    def _factor(self, factor: Any) -> tuple[int, fmpq]:
        """Number of a factor, whose leading coefficient is made one, and that coefficient."""
        scale = factor.leading_coefficient()
        factor = factor * (1 / scale)
        k = self._known.setdefault(str(factor), len(self.factors))
        if k == len(self.factors):
            self.factors.append(factor)
        return k, scale

    def _short(self, num: Any, under: tuple[tuple[int, int], ...]) -> Value:
        """The fraction with common factors cancelled."""
        if not under or len(num) == 0:
            return Value(num, under if len(num) else ())
        if len(num) > CANCELLED:
            return Value(num, under)
        left = []
        for k, n in under:
            while n:
                quotient = self._quotient(num, self.factors[k])
                if quotient is None:
                    break
                num, n = quotient, n - 1
            if n:
                left.append((k, n))
        return Value(num, tuple(left))

    def _quotient(self, num: Any, factor: Any) -> Any:
        """num / factor where it is a polynomial, else None. Roots and sines divide their squares, too."""
        if len(factor) == 1:
            k = next(i for i, degree in enumerate(factor.degrees()) if degree)
            square = self.squares.get(k)
            if square is None:
                pair = next((pair for pair in self.sines if pair[0] == k), None)
                square = None if pair is None else 1 - self.generators[pair[1]] ** 2
            quotient, rest = divmod(num, factor)
            if len(rest) == 0:
                return quotient
            if square is None:
                return None
            second, remainder = divmod(rest, square)
            return None if len(remainder) else self.reduced(quotient + self.product(second, factor))
        if len(factor) > len(num) * 4 + 4:
            return None
        quotient, rest = divmod(num, factor)
        return quotient if len(rest) == 0 else None


def rational(value: int | Fraction) -> fmpq:
    """A number of FLINT."""
    return fmpq(value.numerator, value.denominator)


def fraction(value: Any) -> Fraction:
    """A number of FLINT as Python's."""
    return Fraction(int(value.p), int(value.q))
