"""Plain polynomials arranged to be read: factored, grouped by what multiplies what, nested; the shortest by one cost.

A polynomial is a dict from monomials to fractions; a monomial is a sorted tuple of (letter, power). The result is a sum or a
product: Product(number, ((letter or Sum, power), ...)) and Sum((Product, ...)). No relations between letters are used here. The
cost counts what is written: an operation for each sign between terms, product, fraction bar, power and function, as
sympy.count_ops does; of equal ones the fewer letters and digits.
Source of the nesting: Ceberio and Kreinovich, Greedy algorithms for optimizing multivariate Horner schemes, SIGSAM Bulletin 38
(2004).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from math import gcd, lcm
from typing import Any

from flint import fmpz_mpoly_ctx

from symdyn.tape.sympy_bridge import printed_as_decimal

Monomial = tuple[tuple[int, int], ...]
# Integers where they can be: fractions take ten times as long.
Number = int | Fraction
Polynomial = dict[Monomial, Number]
Cost = tuple[int, int]

# Longer polynomials are not given to the factorization. Up to ALL terms every grouping is tried at each level, above it the one
# that leaves the fewest terms; Horner's scheme too up to BOTH terms, and up to HORNER, or FEWER_HORNER where one grouping is
# clearly best, where the grouping leaves more than CLEAR of them. Squares of sums are looked for up to BOTH terms.
FACTORED, ALL, BOTH, CLEAR, HORNER, FEWER_HORNER = 120, 16, 40, 0.6, 600, 150
# A grouping is clearly best if it leaves less than FEWER of the terms, and than BETTER of those that the next best one leaves,
# which are less than ALONE of all, and no letter has more than LONG operations: such letters are worth to be written seldom.
FEWER, BETTER, ALONE, LONG = 0.7, 0.92, 0.8, 4
_INTEGERS = {int}
_UNIT: frozenset = frozenset({((), 1)})
_KINDS = (("motion",), ("parameter",), ("position",))


@dataclass(frozen=True)
class Letter:
    """Written form of a letter: operations and length of its name, and the kind by which terms are grouped.

    kind     "parameter", "position" (coordinates, functions of them, t) or "motion" (speeds, accelerations, inputs)
    below    whether it stands for what a fraction is divided by
    """

    operations: int
    length: int
    kind: str
    below: bool = False


@dataclass(eq=False, slots=True)
class Sum:
    """Two or more terms."""

    terms: tuple[Product, ...]
    cost: Cost


@dataclass(eq=False, slots=True)
class Product:
    """number * factors."""

    number: Number
    factors: tuple[tuple[int | Sum, int], ...]
    cost: Cost  # without its sign


Tree = Sum | Product


def total(tree: Tree) -> Cost:
    """The cost with the sign."""
    if isinstance(tree, Product) and tree.number < 0:
        return tree.cost[0] + 1, tree.cost[1] + 1
    return tree.cost


class _Parts(dict[Monomial, tuple[Monomial, Monomial]]):
    """Part of a monomial in letters of these kinds, and the rest."""

    def __init__(self, letters: Mapping[int, Letter], kinds: tuple[str, ...]) -> None:
        super().__init__()
        self.letters, self.kinds = letters, kinds
        self._of_kinds: dict[int, bool] = {}

    def __missing__(self, m: Monomial) -> tuple[Monomial, Monomial]:
        own: list[tuple[int, int]] = []
        rest: list[tuple[int, int]] = []
        of_kinds = self._of_kinds
        for item in m:
            letter = item[0]
            if letter not in of_kinds:
                of_kinds[letter] = self.letters[letter].kind in self.kinds
            (own if of_kinds[letter] else rest).append(item)
        parts = self[m] = (tuple(own), tuple(rest)) if own and rest else (m, ()) if own else ((), m)
        return parts


class Arranger:
    """Arranges polynomials in these letters."""

    def __init__(self, letters: Mapping[int, Letter]) -> None:
        self.letters = letters
        self._known: dict[frozenset, Tree] = {}
        self._split: dict[frozenset, Any] = {}
        self._most = HORNER
        self._parts: dict[tuple[str, ...], _Parts] = {
            kinds: _Parts(letters, kinds) for kinds in (*_KINDS, ("motion", "position"), ("position", "motion"))}

    # -- making trees

    def product(self, number: Number, factors: Iterable[tuple[int | Sum, int]]) -> Product:
        """number * factors, without factors to the power zero."""
        kept = tuple([item for item in factors if item[1]])
        operations, length = len(kept) - 1 if kept else 0, 0
        letters = self.letters
        for base, power in kept:
            if type(base) is int:
                letter = letters[base]
                operations += letter.operations
                length += letter.length
            else:
                own = base.cost  # type: ignore[union-attr]
                operations += own[0]
                length += own[1] + 2
            if power > 1:
                operations += 1
                length += 1
        if number == 1 or number == -1:
            if not kept:
                return Product(number, kept, (0, 1))
            for base, _ in kept:
                if type(base) is not int or not letters[base].below:
                    return Product(number, kept, (operations, length))
            return Product(number, kept, (operations + 1, length))
        above, below = abs(number.numerator), number.denominator
        if below != 1 and isinstance(number, Fraction) and printed_as_decimal(number):
            above, below = 2, 1
            length += 4
        if above != 1 and kept:
            operations += 1
        operations += below != 1 or (above == 1 and bool(kept) and all(
            isinstance(base, int) and self.letters[base].below for base, _ in kept))
        length += (len(str(above)) if above != 1 or not kept else 0) + (len(str(below)) if below != 1 else 0)
        return Product(number, kept, (operations, length))

    def sum(self, terms: Sequence[Tree]) -> Tree:
        """The sum of trees; sums among them are taken apart."""
        flat: list[Product] = []
        for term in terms:
            if isinstance(term, Sum):
                flat += term.terms
            elif term.number:
                flat.append(term)
        if not flat:
            return self.product(0, ())
        if len(flat) == 1:
            return flat[0]
        signs = len(flat) - 1 + all(term.number < 0 for term in flat)
        return Sum(tuple(flat), (signs + sum(t.cost[0] for t in flat), signs + sum(t.cost[1] for t in flat)))

    def times(self, number: Number, factors: Sequence[tuple[int, int]], trees: Sequence[tuple[Tree, int]]) -> Product:
        """number * letters * trees to their powers."""
        parts: dict[Any, int] = dict(factors)
        for tree, power in trees:
            if isinstance(tree, Sum):
                parts[tree] = parts.get(tree, 0) + power
            else:
                number = integer(number * tree.number ** power)
                for base, n in tree.factors:
                    parts[base] = parts.get(base, 0) + n * power
        first = sorted(item for item in parts.items() if isinstance(item[0], int))
        sums = [item for item in parts.items() if not isinstance(item[0], int)]
        best = self.product(number, [*first, *sums])
        if not sums or number == 1 or number == -1:
            return best
        size: Number = number if number > 0 else -number
        if not printed_as_decimal(Fraction(size)):
            # l (2 a + b) / 2 is l (a + b / 2).
            for k, (base, power) in enumerate(sums):
                if power == 1:
                    inside = self.scaled(base, size)
                    other = self.product(1 if number > 0 else -1, [*first, *sums[:k], (inside, 1), *sums[k + 1:]])
                    best = min(best, other, key=lambda tree: tree.cost)
        return best

    def scaled(self, tree: Sum, number: Number) -> Sum:
        """The sum with a number multiplied into its terms."""
        scaled = self.sum([self.product(integer(t.number * number), t.factors) for t in tree.terms])
        assert isinstance(scaled, Sum)
        return scaled

    def signed(self, tree: Tree) -> Tree:
        """-x (a - b) as x (b - a), where nothing stands before it that takes the sign."""
        if isinstance(tree, Sum) and all(t.number < 0 for t in tree.terms):
            for k, term in enumerate(tree.terms):
                turned = self.signed(term)
                if turned is not term:
                    return self.sum([*tree.terms[:k], turned, *tree.terms[k + 1:]])
        if isinstance(tree, Product) and tree.number < 0:
            for k, (base, power) in enumerate(tree.factors):
                inside = self._turned(base) if isinstance(base, Sum) and power % 2 else None
                if inside is not None:
                    return self.product(-tree.number, [*tree.factors[:k], (inside, power), *tree.factors[k + 1:]])
        return tree

    def _turned(self, tree: Sum) -> Sum | None:
        """The opposite of a sum with as many signs; None where it has one more."""
        if len({t.number < 0 for t in tree.terms}) == 2:
            return self.scaled(tree, -1)
        if tree.terms[0].number < 0:
            return None
        for k, term in enumerate(tree.terms):
            opposite = self.product(-term.number, term.factors)
            turned = self.signed(opposite)
            if turned is not opposite:
                rest = [self.product(-t.number, t.factors) for t in (*tree.terms[:k], *tree.terms[k + 1:])]
                inside = self.sum([turned, *rest])
                assert isinstance(inside, Sum)
                return inside
        return None

    # -- forms

    def expanded(self, p: Polynomial) -> Tree:
        """Term by term."""
        return self.sum([self.product(c, m) for m, c in sorted(p.items())])

    def factored(self, p: Polynomial) -> Tree:
        """Factors over the rational numbers, each multiplied out."""
        number, common, q = stripped(p)
        parts = self._factors(q) or [(q, 1)]
        return self.times(number, common, [(self.expanded(part), power) for part, power in parts])

    def grouped(self, p: Polynomial, kinds: tuple[str, ...], inner: Callable[[Polynomial], Tree] | None = None) -> Tree | None:
        """Gathered by the monomials in letters of these kinds; those with the same factor stand together.

        None where there is nothing to gather."""
        groups = self._groups(p, kinds)
        return None if groups is None else self._gathered(groups, inner or self.nested)

    def clearly_gathered(self, p: Polynomial, kinds: tuple[str, ...]) -> Tree | None:
        """Gathered by letters of these kinds together, where that leaves clearly fewer terms than by those of one kind."""
        groups = self._groups(p, kinds)
        left = _left(groups)
        if groups is None or left >= FEWER * len(p):
            return None
        alone = min([_left(self._groups(p, (kind,))) for kind in kinds])
        if alone >= ALONE * len(p) or left >= BETTER * alone:
            return None
        if any(self.letters[letter].operations > LONG for letter in {letter for m in p for letter, _ in m}):
            return None
        self._most = FEWER_HORNER
        tree = self._gathered(groups, self.nested)
        self._most = HORNER
        return tree

    def _groups(self, p: Polynomial, kinds: tuple[str, ...]) -> list[tuple[Polynomial, Polynomial]] | None:
        """Pairs of polynomials whose products add up: letters of these kinds with what is common, and all others."""
        rows: dict[Monomial, list[Monomial]] = {}
        parts = self._parts[kinds]
        for m in p:
            rows.setdefault(parts[m][0], []).append(m)
        if len(rows) == 1 or len(rows) == len(p):
            return None
        merged: dict[frozenset, tuple[Polynomial, Polynomial]] = {}
        for own in sorted(rows):
            row = rows[own]
            if len(row) == 1:
                merged.setdefault(_UNIT, ({}, {(): 1}))[0][row[0]] = p[row[0]]
                continue
            number, common, q = stripped({parts[m][1]: p[m] for m in row})
            # The common factor goes with the group; the rest shows which groups belong together.
            left, _ = merged.setdefault(frozenset(q.items()), ({}, q))
            left[multiplied(own, common)] = number
        return None if len(merged) == 1 or len(merged) == len(p) else list(merged.values())

    def _gathered(self, groups: Sequence[tuple[Polynomial, Polynomial]], arrange: Callable[[Polynomial], Tree]) -> Tree:
        return self.sum([self._both(arrange(left), arrange(right)) for left, right in groups])

    def _both(self, a: Tree, b: Tree) -> Tree:
        """a b."""
        if isinstance(a, Product) and not a.factors and a.number == 1:
            return b
        if isinstance(b, Product) and not b.factors and b.number == 1:
            return a
        return self.times(1, (), [(a, 1), (b, 1)])

    def nested(self, p: Polynomial) -> Tree:
        """The shortest that factoring, grouping and Horner's scheme lead to, each applied to what the other leaves."""
        if len(p) == 1:
            (m, c), = p.items()
            return self.product(c, m)
        if not p:
            return self.product(0, ())
        number, common, q = stripped(p)
        tree = self._nested(q)
        if number == 1 and not common:
            return tree
        if number == -1 and not common and isinstance(tree, Sum):
            return Sum(tuple(Product(-t.number, t.factors, t.cost) for t in tree.terms),
                       _resigned(tree))
        return self.times(number, common, [(tree, 1)])

    def _nested(self, q: Polynomial) -> Tree:
        key = frozenset(q.items())
        tree = self._known.get(key)
        if tree is None:
            tree = self._known[key] = self._arranged(q)
        return tree

    def _arranged(self, q: Polynomial) -> Tree:
        if len(q) <= 1:
            return self.expanded(q)
        if len(q) == 2:
            parts = self._factors(q)
            return self.expanded(q) if parts is None else self.times(1, (), [(self.nested(f), n) for f, n in parts])
        parts = self._factors(q)
        if parts is not None:
            return self.times(1, (), [(self.nested(f), n) for f, n in parts])
        groups = [g for g in (self._groups(q, kinds) for kinds in _KINDS) if g is not None]
        # Terms that are left to arrange show which of them are worth it.
        left = [_left(g) for g in groups]
        if len(q) > ALL and groups:
            groups = [groups[left.index(min(left))]] if min(left) < len(q) else []
        result: list[Tree] = []
        used = {letter for m in q for letter, _ in m}
        once = len(used) - 1 + sum([self.letters[letter].operations for letter in used])
        for group in groups:
            result.append(self._gathered(group, self.nested))
            if total(result[-1])[0] == once:  # each letter stands in it once
                return result[-1]
        if not groups or len(q) <= BOTH or (len(q) <= self._most and min(left) > CLEAR * len(q)):
            result.append(self.horner(q))
        squares = self._squares(q) if len(q) <= BOTH else None
        if squares is not None:
            result.append(squares)
        return min(result, key=total)

    def horner(self, p: Polynomial) -> Tree:
        """The letter in most terms is taken out of them, again and again."""
        counts: dict[int, int] = {}
        for m in p:
            for letter, _ in m:
                counts[letter] = counts.get(letter, 0) + 1
        letter, most = max(counts.items(), key=lambda item: (item[1], self.letters[item[0]].operations, -item[0]))
        if most < 2:
            return self.expanded(p)
        inside: Polynomial = {}
        outside: Polynomial = {}
        for m, c in p.items():
            for k, (own, power) in enumerate(m):
                if own == letter:
                    inside[(*m[:k], (own, power - 1), *m[k + 1:]) if power > 1 else (*m[:k], *m[k + 1:])] = c
                    break
            else:
                outside[m] = c
        first = self.times(1, ((letter, 1),), [(self.nested(inside), 1)])
        if not outside:
            return first
        return self.sum([first, self.nested(outside)])

    def _squares(self, q: Polynomial) -> Tree | None:
        """(a - b + ...)^2 for a^2 - 2 a b + b^2 + ..., and the rest; None without such terms."""
        roots: list[tuple[Monomial, Number]] = []
        for m, c in sorted(q.items()):
            if m and all(n % 2 == 0 for _, n in m):
                roots.append((tuple([(letter, n // 2) for letter, n in m]), c))
        if len(roots) < 2:
            return None
        left = dict(q)
        terms: list[Tree] = []
        for k, (first, scale) in enumerate(roots):
            if multiplied(first, first) not in left:
                continue
            chosen: list[tuple[Monomial, Number]] = [(first, 1)]
            for other, c in roots[k + 1:]:
                if c != scale or multiplied(other, other) not in left:
                    continue
                signs = {sign * (1 if left.get(multiplied(m, other)) == 2 * scale else
                                 -1 if left.get(multiplied(m, other)) == -2 * scale else 0) for m, sign in chosen}
                if signs in ({1}, {-1}):
                    chosen.append((other, signs.pop()))
            if len(chosen) > 1:
                for i, (a, _) in enumerate(chosen):
                    for b, _ in chosen[i:]:
                        del left[multiplied(a, b)]
                inside = self.nested(dict(chosen))
                terms.append(self.times(scale, (), [(inside, 2)]))
        if not terms:
            return None
        return self.sum([*terms, self.nested(left)])

    def _factors(self, q: Polynomial) -> list[tuple[Polynomial, int]] | None:
        """Factors of a polynomial without common number and letters; None if there is but one, or if it is too long."""
        if len(q) > FACTORED or len(q) < 2 or _irreducible(q) or any(type(c) is not int for c in q.values()):
            return None
        key = frozenset(q.items())
        if key in self._split:
            return self._split[key]
        used = sorted({letter for m in q for letter, _ in m})
        index = {letter: k for k, letter in enumerate(used)}
        context = fmpz_mpoly_ctx.get(("x", len(used)), "lex")
        rows: dict[tuple[int, ...], Any] = {}
        for m, c in q.items():
            exponents = [0] * len(used)
            for letter, power in m:
                exponents[index[letter]] = power
            rows[tuple(exponents)] = c
        if _coprime(rows, context):
            self._split[key] = None
            return None
        unit, parts = context.from_dict(rows).factor()
        if len(parts) == 1 and parts[0][1] == 1:
            self._split[key] = None
            return None
        result: list[tuple[Polynomial, int]] = []
        number = Fraction(int(unit))
        for part, power in parts:
            poly: Polynomial = {tuple((used[k], int(n)) for k, n in enumerate(exponents) if n): int(c)
                                for exponents, c in part.terms()}
            scale, _, poly = stripped(poly)
            number *= scale ** int(power)
            result.append((poly, int(power)))
        if number != 1:  # the sign, at most: contents are taken out before
            mixed = next((f for f, n in result if n % 2 and len({c < 0 for c in f.values()}) == 2), None)
            result = [({m: integer(number * c) for m, c in f.items()}, n) if f is mixed else (f, n) for f, n in result]
            if mixed is None:
                result.append(({(): integer(number)}, 1))
        self._split[key] = result
        return result


def _left(groups: Sequence[tuple[Polynomial, Polynomial]] | None) -> float:
    """Terms that are left to arrange."""
    return math.inf if groups is None else sum(len(a) + len(b) for a, b in groups)


def _resigned(tree: Sum) -> Cost:
    """The cost of a sum with all signs changed."""
    negative = sum(t.number < 0 for t in tree.terms)
    change = (negative == 0) - (negative == len(tree.terms))
    return tree.cost[0] + change, tree.cost[1] + change


def stripped(p: Polynomial) -> tuple[Number, Monomial, Polynomial]:
    """Number and letters common to all terms, and what is left, in which most terms are positive."""
    numbers: list[Any] = list(p.values())
    number: Any = 1
    whole = set(map(type, numbers)) == _INTEGERS
    if whole:
        number = gcd(*numbers)
    elif any(printed_as_decimal(Fraction(c)) for c in numbers):
        size = abs(numbers[0])
        number = size if all(abs(c) == size for c in numbers) else 1
    else:
        number = Fraction(gcd(*[c.numerator for c in numbers]), lcm(*[c.denominator for c in numbers]))
    negative = sum([c < 0 for c in numbers])
    if 2 * negative > len(numbers) or (2 * negative == len(numbers) and p[min(p)] < 0):
        number = -number
    monomials = iter(p)
    common = dict(next(monomials))
    for m in monomials:
        if not common:
            break
        kept = {}
        for letter, n in m:
            if letter in common:
                least = common[letter]
                kept[letter] = least if least < n else n
        common = kept
    if number == 1 and not common:
        return 1, (), p
    if common:
        p = {tuple([(letter, n - common.get(letter, 0)) for letter, n in m if n != common.get(letter, 0)]): c
             for m, c in p.items()}
    if number != 1:
        p = {m: c // number for m, c in p.items()} if whole else {m: _divided(c, number) for m, c in p.items()}
    return integer(number), tuple(sorted(common.items())), p


def integer(value: Number) -> Number:
    """An integer as one."""
    return value.numerator if value.denominator == 1 else value


def _divided(c: Any, number: Any) -> int | Fraction:
    """c / number, an integer where it is one."""
    if type(c) is int and type(number) is int:
        return c // number
    return integer(Fraction(c) / number)


def multiplied(a: Monomial, b: Monomial) -> Monomial:
    """The product of two monomials."""
    if not a or not b:
        return a or b
    if a[-1][0] < b[0][0]:
        return a + b
    if b[-1][0] < a[0][0]:
        return b + a
    if len(b) == 1:
        (letter, n), = b
        for k, (own, power) in enumerate(a):
            if own == letter:
                return (*a[:k], (own, power + n), *a[k + 1:])
            if own > letter:
                return (*a[:k], b[0], *a[k:])
    powers = dict(a)
    for letter, n in b:
        powers[letter] = powers.get(letter, 0) + n
    return tuple(sorted(powers.items()))


def _coprime(rows: Mapping[tuple[int, ...], int], context: Any) -> bool:
    """Whether the polynomial is a x + b without factors that a and b have in common, for a letter x: then it has no others."""
    degrees = list(map(max, zip(*rows)))
    terms = [sum(1 for exponents in rows if exponents[k]) for k in range(len(degrees))]
    linear = [k for k, degree in enumerate(degrees) if degree == 1]
    if not linear:
        return False
    x = min(linear, key=lambda k: (terms[k], k))
    above = {(*e[:x], 0, *e[x + 1:]): c for e, c in rows.items() if e[x]}
    below = {e: c for e, c in rows.items() if not e[x]}
    return bool(context.from_dict(above).gcd(context.from_dict(below)).is_constant())


def _irreducible(q: Polynomial) -> bool:
    """Whether a letter stands in one term only, to the first power: then nothing but letters could be a factor."""
    powers: dict[int, int] = {}
    for m in q:
        for letter, n in m:
            powers[letter] = 0 if letter in powers else n
    return 1 in powers.values()
