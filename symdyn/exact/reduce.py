"""Polynomials in letters made shorter by relations that hold: multiples of them are added while terms become fewer."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from fractions import Fraction
from itertools import combinations
from typing import Any

from symdyn.exact.arrange import Monomial, Number, Polynomial, integer, multiplied
from symdyn.exact.represent import Basis, Letters, contracted, fourier, plain

# Relations and polynomials with more terms are left as they are; relations that are tried.
TERMS, TRIED = 150, 60


def relations_in_letters(numerators: Sequence[Any], bases: Sequence[Basis], letters: Letters) -> list[Polynomial]:
    """Relations as polynomials in letters, in each representation, and in axes that are turned by the angles in them."""
    result: list[Polynomial] = []
    series: list[Polynomial] = []
    for num in numerators:
        if not 1 < len(num) <= TERMS:
            continue
        own = [basis.plain(basis.of(num), letters) for basis in bases]
        waves = fourier(plain(num), letters)
        if waves is not None:
            series.append(waves)
            own.append(contracted(waves, letters))
        result += [form for p in own for form in (p, contracted(p, letters))]
    result += [turned for one, other in combinations(series, 2) for turned in _turned(one, other, letters)]
    unique: dict[frozenset, Polynomial] = {}
    for p in sorted(result, key=len):
        unique.setdefault(frozenset(p.items()), p)
    return [p for p in unique.values() if 1 < len(p) <= TERMS][:TRIED]


def _turned(one: Polynomial, other: Polynomial, letters: Letters) -> Iterator[Polynomial]:
    """cos(a) one + sin(a) other and the like, for the angles a of sines and cosines in them, where no more terms come out."""
    angles = sorted({letters.turns[letter][1] for p in (one, other) for m in p for letter, _ in m if letter in letters.turns})
    for vector in angles:
        (c, cs), (s, ss) = letters.of("cos", vector), letters.of("sin", vector)
        for first, second, sign in ((one, other, 1), (one, other, -1), (other, one, 1), (other, one, -1)):
            p: Polynomial = {}
            for source, letter, factor in ((first, c, cs), (second, s, sign * ss)):
                for m, number in source.items():
                    key = multiplied(m, ((letter, 1),))
                    p[key] = p.get(key, 0) + factor * number
            short = contracted({m: number for m, number in p.items() if number}, letters)
            if len(short) <= max(len(one), len(other)):
                yield short


def shortened(p: Polynomial, relations: Sequence[Polynomial]) -> Polynomial:
    """The polynomial with multiples of relations added, the one that leaves the fewest terms first, as long as one does."""
    if len(p) > TERMS:
        return p
    p = dict(p)
    while p:
        best: tuple[int, Polynomial] | None = None
        tried: set[tuple[int, Monomial, Number]] = set()
        for m in sorted(p):
            for k, relation in enumerate(relations):
                for own in relation:
                    factor = _quotient(m, own)
                    if factor is None:
                        continue
                    scale = integer(Fraction(p[m]) / relation[own])
                    if (k, factor, scale) in tried:
                        continue
                    tried.add((k, factor, scale))
                    change = {multiplied(factor, other): scale * number for other, number in relation.items()}
                    fewer = sum((p.get(key, 0) != number) - (key in p) for key, number in change.items())
                    if fewer < 0 and (best is None or fewer < best[0]):
                        best = fewer, change
        if best is None:
            return p
        for key, number in best[1].items():
            left = integer(p.get(key, 0) - number)
            if left:
                p[key] = left
            else:
                p.pop(key, None)
    return p


def _quotient(m: Monomial, divisor: Monomial) -> Monomial | None:
    """m / divisor, None where it is none."""
    left = dict(m)
    for letter, n in divisor:
        have = left.get(letter, 0)
        if have < n:
            return None
        if have == n:
            del left[letter]
        else:
            left[letter] = have - n
    return tuple(left.items())
