"""One value in several sets of letters: sines and cosines of base angles, of sums of angles, Fourier form.

The polynomial in sines and cosines of base angles is a normal form, but not the shortest: c1 c2 - s1 s2 is cos(q1 + q2), and of
s^2 and c^2 either may be written by the other. The result is a plain polynomial in letters, for symdyn.exact.arrange.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from fractions import Fraction
from typing import Any

from symdyn.exact.angles import combined
from symdyn.exact.arrange import Monomial, Number, Polynomial, integer, multiplied
from symdyn.exact.ring import fraction
from symdyn.exact.walk import Exact

Vector = tuple[int, ...]
Partner = tuple[int, int, tuple[int, int], tuple[int, int]]
# Letters that stand squared: the term without the square, with the other function's square, whether it is a cosine's. Pairs of
# letters: the term without them, the other term of a theorem of sums, and what both are for the same number and the opposite.
Theorems = tuple[list[tuple[tuple[int, int], Monomial, Monomial, bool]],
                 list[tuple[tuple[int, int], Monomial, Monomial, tuple[int, int], tuple[int, int]]]]
# Fourier forms with this many times the terms of the polynomial are not made; products of more sines neither.
GROWTH, DEGREE = 4, 8
# Sums of angles that are tried as base angles.
TRIED = 6


class Letters:
    """Numbers of letters: generators of plain symbols and functions keep theirs, sines and cosines of sums get new ones.

    turns      letter -> ("sin", "cos" or "tan", vector of integers over the base angles; of halves where `halved` made it)
    below      letter -> what it is one over: the number of a factor of the ring, or -1 - letter
    opposite   vector -> whether its opposite is the one to write
    """

    def __init__(self, exact: Exact, opposite: Callable[[Vector], bool]) -> None:
        n = len(exact.bases)
        self.opposite = opposite
        self._next = len(exact.ring.generators)
        self.below: dict[int, int] = {}
        self._inverses: dict[int, int] = {}
        self.turns: dict[int, tuple[str, Vector]] = {}
        self._numbers: dict[tuple[str, Vector], int] = {}
        self._series: dict[Monomial, list[tuple[Monomial, int]]] = {}
        self._partners: dict[tuple[int, int], Partner | None] = {}
        self._theorems: dict[Monomial, Theorems] = {}
        self.sines = exact.sines
        for k, (s, c) in enumerate(exact.sines):
            unit = tuple(int(i == k) for i in range(n))
            for name, g in (("sin", s), ("cos", c)):
                self.turns[g] = name, unit
                self._numbers[name, unit] = g

    def of(self, name: str, vector: Vector) -> tuple[int, int]:
        """Letter and sign of the sine or cosine of a combination of base angles; the vector is not zero."""
        sign = 1
        if (name, vector) not in self._numbers and (
                (name, tuple(-i for i in vector)) in self._numbers or self.opposite(vector)):
            vector = tuple(-i for i in vector)
            sign = 1 if name == "cos" else -1
        letter = self._numbers.get((name, vector))
        if letter is None:
            letter = self._numbers[name, vector] = self._new()
            self.turns[letter] = name, vector
        return letter, sign

    def inverse(self, key: int) -> int:
        """The letter of one over a factor of the ring (its number), or over a letter (-1 - letter)."""
        letter = self._inverses.get(key)
        if letter is None:
            letter = self._inverses[key] = self._new()
            self.below[letter] = key
        return letter

    def series(self, own: Monomial) -> list[tuple[Monomial, int]]:
        """A product of d sines and cosines, times 2^d, as a sum of them: letter (or none) and number."""
        if own not in self._series:
            self._series[own] = _series(own, self)
        return self._series[own]

    def partner(self, x: int, y: int) -> Partner | None:
        """Letters that stand next to x and y in the other term of a theorem of sums, and what both are with letters and sign, for
        the same number and the opposite; None where there is no such theorem."""
        if (x, y) not in self._partners:
            self._partners[x, y] = _partner(x, y, self)
        return self._partners[x, y]

    def theorems(self, m: Monomial) -> Theorems:
        """Theorems that may combine this term with others."""
        if m not in self._theorems:
            self._theorems[m] = _theorems(m, self)
        return self._theorems[m]

    def _new(self) -> int:
        self._next += 1
        return self._next - 1


def plain(num: Any) -> Polynomial:
    """A polynomial of FLINT as a dict."""
    return {tuple([(k, int(n)) for k, n in enumerate(exponents) if n]): int(c.p) if c.q == 1 else fraction(c)
            for exponents, c in num.terms()}


class Basis:
    """Other base angles: generator pair k of the polynomial stands for the angle rows[k], a combination of the first ones."""

    def __init__(self, exact: Exact, rows: tuple[Vector, ...]) -> None:
        self.exact, self.rows = exact, rows
        ring = exact.ring
        taken = list(ring.generators)
        for k, (s, c) in enumerate(exact.sines):
            unit = tuple(int(i == k) for i in range(len(rows)))
            if unit not in rows or rows.index(unit) != k:
                combination = combined(unit, rows)
                sine, cosine = exact.of_sum(combination)
                taken[s], taken[c] = sine.num, cosine.num
        self._taken = taken

    def turned(self, num: Any) -> Any:
        """The polynomial in sines and cosines of these angles."""
        ring = self.exact.ring
        if all(a is b for a, b in zip(self._taken, ring.generators)):
            return num
        return ring.reduced(num.compose(*self._taken, ctx=ring.context))

    def of(self, num: Any) -> Any:
        """The polynomial in sines and cosines of these angles, with c^2 or s^2 replaced, whichever is shorter."""
        ring, num = self.exact.ring, self.turned(num)
        degrees = num.degrees() if len(num) else ()
        for s, c in self.exact.sines:
            if not degrees or degrees[c] < 2:
                continue
            swapped = list(ring.generators)
            swapped[s], swapped[c] = swapped[c], swapped[s]
            other = ring.reduced(num.compose(*swapped, ctx=ring.context)).compose(*swapped, ctx=ring.context)
            if len(other) < len(num):
                num = other
        return num

    def plain(self, num: Any, letters: Letters) -> Polynomial:
        """A polynomial in sines and cosines of these angles as a dict in letters."""
        p = plain(num)
        new: dict[int, tuple[int, int]] = {}
        for k, (s, c) in enumerate(self.exact.sines):
            for name, g in (("sin", s), ("cos", c)):
                letter = letters.of(name, self.rows[k])
                if letter != (g, 1):
                    new[g] = letter
        if not new:
            return p
        result: Polynomial = {}
        for m, number in p.items():
            odd = sum(n for g, n in m if g in new and new[g][1] < 0) % 2
            result[tuple(sorted([(new[g][0] if g in new else g, n) for g, n in m]))] = -number if odd else number
        return result


def better_basis(exact: Exact, letters: Letters, num: Any) -> Basis | None:
    """Base angles in which a long polynomial has fewer terms: sums that its contraction shows."""
    n = len(exact.bases)
    rows = tuple(tuple(int(i == k) for i in range(n)) for k in range(n))
    first = Basis(exact, rows)
    counts: dict[Vector, int] = {}
    for m in contracted(first.plain(num, letters), letters):
        for letter, _ in m:
            if letter in letters.turns:
                vector = letters.turns[letter][1]
                if sum(map(abs, vector)) > 1:
                    counts[vector] = counts.get(vector, 0) + 1
    best, length = None, len(num)
    for vector in sorted(counts, key=lambda v: (-counts[v], v))[:TRIED]:
        for k in range(n):
            if abs(vector[k]) != 1:
                continue
            if _regular(rows, k, vector):
                other = Basis(exact, (*rows[:k], vector, *rows[k + 1:]))
                terms = len(other.turned(num))
                if terms < length:
                    best, length = other, terms
        rows = best.rows if best else rows
    return best


def _regular(rows: tuple[Vector, ...], k: int, vector: Vector) -> bool:
    """Whether the rows with another one in place of row k still reach every combination."""
    combination = combined(vector, rows)
    return combination is not None and abs(combination[k]) == 1


def divided(p: Polynomial, under: Sequence[tuple[int, int]], factors: Sequence[Any], letters: Letters) -> Polynomial:
    """The polynomial over factors of the ring, in letters for one over each of them."""
    for k, n in under:
        single = [(g, int(degree)) for g, degree in enumerate(factors[k].degrees()) if degree] if len(factors[k]) == 1 else []
        if single:
            (g, _), = single
            inverse = letters.inverse(-1 - g)
            p = {_cancelled(m, g, inverse, n): c for m, c in p.items()}
        else:
            inverse = letters.inverse(k)
            p = {multiplied(m, ((inverse, n),)): c for m, c in p.items()}
    return p


def _cancelled(m: Monomial, letter: int, inverse: int, power: int) -> Monomial:
    """m / letter^power."""
    own = next((n for k, n in m if k == letter), 0)
    common = min(own, power)
    m = _less(m, letter, common) if common else m
    return multiplied(m, ((inverse, power - common),)) if power > common else m


def with_tangents(p: Polynomial, letters: Letters) -> Polynomial:
    """sin / cos as tan."""
    over = {letter: -1 - key for letter, key in letters.below.items()
            if key < 0 and letters.turns.get(-1 - key, ("", ()))[0] == "cos"}
    if not over:
        return p
    result: Polynomial = {}
    for m, c in p.items():
        for inverse, n in m:
            if inverse in over:
                vector = letters.turns[over[inverse]][1]
                sine, sign = letters.of("sin", vector)
                both = min(n, next((i for k, i in m if k == sine), 0))
                if both:
                    tangent, other = letters.of("tan", vector)
                    m = multiplied(_less(_less(m, sine, both), inverse, both), ((tangent, both),))
                    c = c * (sign * other) ** both
        result[m] = result.get(m, 0) + c
    return result


def fourier(p: Polynomial, letters: Letters) -> Polynomial | None:
    """Sums of sines and cosines of combinations of the base angles; None where that is much longer."""
    most = GROWTH * len(p) + 20
    groups: dict[Monomial, list[tuple[Monomial, Number]]] = {}
    turns = letters.turns
    for m, c in p.items():
        own = tuple(item for item in m if item[0] in turns)
        rest = tuple(item for item in m if item[0] not in turns)
        groups.setdefault(own, []).append((rest, c))
    result: Polynomial = {}
    for own, row in groups.items():
        degree = sum(n for _, n in own)
        if degree > DEGREE:
            return None
        scale = 2 ** (DEGREE - degree)
        for trig, factor in letters.series(own):
            factor *= scale
            for rest, c in row:
                m = multiplied(rest, trig)
                value = result.get(m, 0) + factor * c
                if value:
                    result[m] = value
                else:
                    result.pop(m, None)
        if len(result) > most:
            return None
    whole = 2**DEGREE
    return {m: c // whole if c % whole == 0 else integer(Fraction(c, whole)) for m, c in result.items()}


def _series(own: Monomial, letters: Letters) -> list[tuple[Monomial, int]]:
    """A product of d sines and cosines, times 2^d, as a sum of them: letter (or none) and number."""
    n = len(letters.sines)
    zero = (0,) * n
    parts: dict[tuple[str, Vector], int] = {("cos", zero): 1}
    for letter, power in own:
        name, unit = letters.turns[letter]
        for _ in range(power):
            after: dict[tuple[str, Vector], int] = {}
            for (kind, vector), c in parts.items():
                up = tuple(a + b for a, b in zip(vector, unit))
                down = tuple(a - b for a, b in zip(vector, unit))
                # kind(vector) * name(unit) is half a sum.
                if kind == name == "cos":
                    made = (("cos", up, 1), ("cos", down, 1))
                elif kind == name:
                    made = (("cos", down, 1), ("cos", up, -1))
                elif kind == "sin":
                    made = (("sin", up, 1), ("sin", down, 1))
                else:
                    made = (("sin", up, 1), ("sin", down, -1))
                for what, v, sign in made:
                    after[what, v] = after.get((what, v), 0) + sign * c
            parts = after
    result: dict[Monomial, int] = {}
    for (kind, vector), c in parts.items():
        if not any(vector):
            m: Monomial = ()
            if kind == "sin":
                continue
        else:
            letter, sign = letters.of(kind, vector)
            m, c = ((letter, 1),), sign * c
        result[m] = result.get(m, 0) + c
    return [(m, c) for m, c in result.items() if c]


def contracted(p: Polynomial, letters: Letters) -> Polynomial:
    """Pairs of terms that are one by a theorem of sums, x - x c^2 = x s^2 or x s^2 + x c^2 = x, the most frequent kind first."""
    p = dict(p)
    while True:
        kinds: dict[tuple[int, int], list[tuple[Monomial, Monomial, Monomial, int]]] = {}
        for kind, one, two, m, factor in _matches(p, letters):
            kinds.setdefault(kind, []).append((one, two, m, factor))
        if not kinds:
            return p
        for kind in sorted(kinds, key=lambda k: (-len(kinds[k]), k)):
            for one, two, m, factor in kinds[kind]:
                a, b = p.get(one), p.get(two)
                if a is None or b is None or abs(a) != abs(b):
                    continue
                del p[one], p[two]
                value = p.get(m, 0) + factor * a
                if value:
                    p[m] = value
                else:
                    p.pop(m, None)


def _matches(p: Polynomial, letters: Letters) -> Iterator[tuple[tuple[int, int], Monomial, Monomial, Monomial, int]]:
    """Pairs of terms: the cosines of the angles that they stand for, both terms, what they become together, and its number as a
    multiple of the first one's."""
    for m, a in list(p.items()):
        squares, sums = letters.theorems(m)
        for kind, rest, squared, is_cosine in squares:
            if p.get(rest) == -a:
                yield kind, m, rest, squared, -1
            elif is_cosine and p.get(squared) == a:
                yield kind, m, squared, rest, 1
        for kind, rest, other, same, opposite in sums:
            b = p.get(other)
            if b is not None and abs(b) == abs(a):
                letter, sign = same if b == a else opposite
                yield kind, m, other, multiplied(rest, ((letter, 1),)), sign


def _theorems(m: Monomial, letters: Letters) -> Theorems:
    """Terms with which this one is a shorter one: by the squares of sine and cosine, and by theorems of sums."""
    turns, of = letters.turns, letters.of
    squares, sums = [], []
    trig = [item for item in m if item[0] in turns and turns[item[0]][0] != "tan"]
    for x, n in trig:
        if n >= 2:
            name, v = turns[x]
            rest = _less(m, x, 2)
            other = of("sin" if name == "cos" else "cos", v)[0]
            squares.append(((x, x), rest, multiplied(rest, ((other, 2),)), name == "cos"))
    for x, _ in trig:
        for y, _ in trig:
            # Cosines once a pair; a sine first.
            result = None if x == y or (x > y and turns[x][0] == "cos") else letters.partner(x, y)
            if result is not None:
                one, two, same, opposite = result
                rest = _less(_less(m, x, 1), y, 1)
                other_term = multiplied(rest, ((one, 1), (two, 1)) if one < two else ((two, 1), (one, 1)))
                sums.append(((x, y), rest, other_term, same, opposite))
    return squares, sums


def halved(p: Polynomial, letters: Letters) -> Polynomial | None:
    """Pairs of terms x + x cos a and x - x cos a as 2 x cos^2(a/2) and 2 x sin^2(a/2); None without such pairs."""
    result = dict(p)
    for m, c in p.items():
        for letter, _ in m:
            name, vector = letters.turns.get(letter, ("", ()))
            rest = _less(m, letter, 1)
            other = result.get(rest)
            if name != "cos" or m not in result or other is None or abs(other) != abs(c):
                continue
            half: Any = tuple([i // 2 if i % 2 == 0 else Fraction(i, 2) for i in vector])
            squared = letters.of("cos" if other == c else "sin", half)[0]
            del result[m], result[rest]
            key = multiplied(rest, ((squared, 2),))
            result[key] = result.get(key, 0) + 2 * other
    return None if len(result) == len(p) else {m: integer(c) for m, c in result.items() if c}


def _partner(x: int, y: int, letters: Letters) -> Partner | None:
    name, v = letters.turns[x]
    second, w = letters.turns[y]
    if v == w or (name == "sin" and second == "sin"):
        return None
    up = letters.of(name, tuple([i + j for i, j in zip(v, w)]))
    down = letters.of(name, tuple([i - j for i, j in zip(v, w)]))
    other = "cos" if name == "sin" else "sin"
    a, b = letters.of(other, v)[0], letters.of("sin", w)[0]
    if name == "sin":
        return a, b, up, down
    return (a, b, down, up) if second == "cos" else None


def _less(m: Monomial, letter: int, power: int) -> Monomial:
    """The monomial without so many factors of a letter."""
    for k, (own, n) in enumerate(m):
        if own == letter:
            return (*m[:k], (own, n - power), *m[k + 1:]) if n > power else (*m[:k], *m[k + 1:])
    raise ValueError(f"{letter} does not stand in {m}")
