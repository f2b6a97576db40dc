"""Exact values of what a tape computes.

Parameters, coordinates, speeds, accelerations, inputs and t are generators; so are sine and cosine of each base angle, and every
other function: roots with their relation r^2 = a, and functions without one (exp, tables, functions of the user, choices), each
for one value of its arguments. Numbers are exact: integers and fractions as they are, floats as the binary fractions that they
stand for, so that 0.1 is 3602879701896397/2^55 and not 1/10.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import partial
from itertools import combinations_with_replacement
from math import isqrt, prod
from typing import Any

from flint import fmpz

from symdyn.exact.angles import Angles, Linear, arguments
from symdyn.exact.ring import BOUND, FACTORED, Ring, Value, fraction
from symdyn.tape.node import Node, exact
from symdyn.tape.sympy_bridge import printed_as_decimal
from symdyn.tape.tape import reachable
from symdyn.tape.walk import Arithmetic, walk

_ARITHMETIC = ("leaf", "add", "sub", "mul", "div", "neg", "guard", "sin", "cos", "tan")
_PRIMES = (2, 3, 5, 7, 11, 13, 17, 19, 23, 29, 31)
# Numbers of more bits are not split into primes other than these.
_BITS = 80
# Roots that one is taken apart to, at most; that of a number.
ROOTS, NUMBER_ROOTS = 4, 8
# Absolute values that one is taken apart to, above and below the bar.
SIZES = 4
_TRUTH = ("lt", "le", "gt", "ge", "eq", "ne", "and", "or", "not")


@dataclass(frozen=True, eq=False)
class Atom:
    """A function that is no polynomial: its operation and arguments (values, truths, or an intrinsic first); item: one of its
    results."""

    op: str
    args: tuple[Any, ...]
    item: int | None = None


class Exact:
    """Exact values of entries (nodes and numbers) of one recorder.

    values   of the entries, in order
    ring     their arithmetic; leaves: generator -> leaf; atoms: generator -> atom
    bases    base angles, each a sum of terms; sines: generators of sine and cosine of each
    not_negative   generators that never are negative
    """

    def __init__(self, entries: Sequence[Any], bound: int = BOUND, unit_vectors: Sequence[Sequence[Node]] = (),
                 positive: Collection[Node] = (), directions: Sequence[Sequence[Fraction]] = (),
                 of_calls: bool = False) -> None:
        """unit_vectors: groups of leaves whose squares add up to one, such as Euler parameters; positive: leaves that are not
        negative, so that roots of their squares are themselves; directions: groups of positive numbers that are taken as any
        numbers whose squares add up to one, also in products of two of them; of_calls: whether results of algorithms are
        expressed by each other where they can be (Intrinsic.by_others).

        Raises TooLarge where a value exceeds the bound on terms, ZeroDivisionError where an entry divides by zero."""
        steps = reachable(entries)
        angles = Angles(arguments(steps))
        others = [node for node in steps if node.op not in _ARITHMETIC and node.op not in _TRUTH]
        leaves = [node for node in steps if node.op == "leaf"]
        groups = [group for group in unit_vectors if all(leaf in leaves for leaf in group)]
        leading = [group[0] for group in groups]
        leaves = [*leading, *[leaf for leaf in leaves if leaf not in leading]]
        n, m, count = sum(map(partial(_generators, of_calls), others)), len(angles.bases), 0
        # Functions first, the last one highest; two generators a base angle; plain symbols.
        free = iter(range(n - 1, -1, -1))
        self.bases: list[Linear] = angles.bases
        self.sines = tuple((n + k, n + m + k) for k in range(m))
        count = n + 2 * m
        free_numbers = [number for direction in directions for number in direction]
        self.ring = ring = Ring(count + len(leaves) + len(free_numbers), self.sines, bound)
        self.leaves = {count + k: leaf for k, leaf in enumerate(leaves)}
        taken_as: dict[int | Fraction, Value] = {number: ring.generator(count + len(leaves) + k)
                                                 for k, number in enumerate(free_numbers)}
        self.atoms: dict[int, Atom] = {}
        self._angles = angles
        number_of = {leaf: k for k, leaf in self.leaves.items()}
        for first, *others in groups:
            ring.relate(number_of[first], 1 - sum(ring.generators[number_of[leaf]] ** 2 for leaf in others))
        index = count + len(leaves)
        for direction in directions:
            ring.relate(index, 1 - sum(ring.generators[index + k] ** 2 for k in range(1, len(direction))))
            index += len(direction)
            for a, b in combinations_with_replacement(direction, 2):
                taken_as[a * b] = ring.mul(taken_as[a], taken_as[b])
                if a == b:
                    taken_as[1 - a * a] = ring.sub(ring.one, taken_as[a * a])
        taken_as |= {-number: ring.neg(value) for number, value in taken_as.items()}
        self._pairs: dict[tuple[int, ...], tuple[Value, Value]] = {}
        known: dict[str, Value] = {}
        def number(a: Any) -> Any:
            return a if isinstance(a, bool) else taken_as.get(exact(a)) or ring.number(exact(a))

        self.not_negative = free_of_sign = {k for k, leaf in self.leaves.items() if leaf in positive}
        same: dict[str, list[tuple[Value, Value]]] = {}

        def function(node: Node, args: tuple[Any, ...]) -> Value:
            if node.op == "sqrt" and len(args[0].num):
                result, below, size = root_taken_apart(ring, args[0], free_of_sign, _roots(node))
                for inside in below:
                    result = ring.mul(result, of_atom(Atom("sqrt", (inside,))))
                return ring.mul(result, absolute(size))
            if node.op == "abs":
                return absolute(args[0])
            return of_call(args, node.args[1]) if node.op == "item" else of_atom(Atom(node.op, args))

        def absolute(value: Value) -> Value:
            result, above, below = absolute_taken_apart(ring, value, free_of_sign)
            for inside in above:
                result = ring.mul(result, of_atom(Atom("abs", (inside,))))
            for inside in below:
                result = ring.div(result, of_atom(Atom("abs", (inside,))))
            return result

        def of_call(args: tuple[Any, ...], item: int) -> Value:
            intrinsic, *values = args
            found = intrinsic.by_others(item) if of_calls else None
            if found is None or not len(values[found[0]].num):
                return of_atom(Atom("call", args, item))
            total = ring.zero
            for i, j in found[1]:
                total = ring.add(total, ring.mul(values[i], of_call(args, j)))
            return ring.neg(ring.div(total, values[found[0]]))

        def of_atom(atom: Atom) -> Value:
            args, item = atom.args, atom.item
            key = f"{atom.op}{item}({','.join(self._key(a) for a in args)})"
            if key not in known and len(args) == 1 and isinstance(args[0], Value):
                # Equal fractions may differ in numerators and denominators.
                others = same.setdefault(f"{atom.op}{item}", [])
                known.update((key, result) for a, result in others if (a.under or args[0].under)
                             and len(ring.sub(a, args[0]).num) == 0)
            if key not in known:
                k = next(free)
                self.atoms[k] = atom
                known[key] = ring.generator(k)
                if len(args) == 1 and isinstance(args[0], Value):
                    same[f"{atom.op}{item}"].append((args[0], known[key]))
                if atom.op in ("sqrt", "abs", "exp"):
                    free_of_sign.add(k)
                squared = atom.op in ("sqrt", "abs") and not args[0].under
                if squared:
                    ring.relate(k, args[0].num if atom.op == "sqrt" else ring.product(args[0].num, args[0].num))
            return known[key]

        values = walk(steps, _Polynomials(ring, number, self._turned, function),
                      {leaf: ring.generator(k) for k, leaf in self.leaves.items()})
        self.values: list[Value] = [values.of(e) for e in entries]

    def _key(self, a: Any) -> str:
        if isinstance(a, Value):
            return self.ring.key(a)
        if isinstance(a, Atom):
            return f"{a.op}({','.join(map(self._key, a.args))})"
        return str(id(a)) if not isinstance(a, bool) else str(a)

    def _turned(self, argument: Any) -> tuple[Value, Value]:
        """Sine and cosine of an argument, a node or a number."""
        s, c = self.of_sum(self._angles.vectors[argument])
        ring = self.ring
        return ((s, c), (c, ring.neg(s)), (ring.neg(s), ring.neg(c)), (ring.neg(c), s))[self._angles.quarter[argument]]

    def of_sum(self, vector: tuple[int, ...]) -> tuple[Value, Value]:
        """Sine and cosine of an integer combination of the base angles."""
        ring = self.ring
        if vector not in self._pairs:
            k = next((k for k in range(len(vector) - 1, -1, -1) if vector[k]), None)
            if k is None:
                return ring.zero, ring.one
            sign = 1 if vector[k] > 0 else -1
            s, c = self.of_sum((*vector[:k], vector[k] - sign, *vector[k + 1:]))
            si, ci = (ring.generator(g) for g in self.sines[k])
            si = si if sign > 0 else ring.neg(si)
            self._pairs[vector] = (ring.add(ring.mul(s, ci), ring.mul(c, si)), ring.sub(ring.mul(c, ci), ring.mul(s, si)))
        return self._pairs[vector]


class _Polynomials(Arithmetic):
    """Fractions of polynomials.

    numbers    what a number is; turned: sine and cosine of an argument of the tape
    function   what any other operation is, and each result of a call, from the values of its arguments
    """

    def __init__(self, ring: Ring, numbers: Callable[[Any], Any], turned: Callable[[Any], tuple[Value, Value]],
                 function: Callable[[Node, tuple[Any, ...]], Value]) -> None:
        self.ring, self.numbers, self.turned, self.function = ring, numbers, turned, function
        self.functions = {"add": ring.add, "sub": ring.sub, "mul": ring.mul, "div": ring.div, "neg": ring.neg,
                          "guard": lambda a, _: a}

    def number(self, value: Any) -> Any:
        return self.numbers(value)

    def step(self, node: Node, args: list[Any]) -> Any:
        if (arithmetic := self.functions.get(node.op)) is not None:
            return arithmetic(*args)
        if node.op in ("sin", "cos", "tan"):
            sine, cosine = self.turned(node.args[0])
            return sine if node.op == "sin" else cosine if node.op == "cos" else self.ring.div(sine, cosine)
        return Atom(node.op, tuple(args)) if node.op in _TRUTH else self.function(node, tuple(args))

    def call(self, node: Node, args: list[Any]) -> Any:
        return (node.args[0], *args)

    def item(self, node: Node, results: Any) -> Any:
        return self.function(node, results)


def _generators(of_calls: bool, node: Node) -> int:
    """The most generators that a function needs; a call has one for each result that others are expressed by."""
    if node.op in ("sqrt", "abs"):
        return _roots(node) + 2 * SIZES if node.op == "sqrt" else 2 * SIZES
    if node.op != "call":
        return 1
    return node.args[0].n_out if of_calls else 1


def _roots(node: Node) -> int:
    return ROOTS if isinstance(node.args[0], Node) else NUMBER_ROOTS


def absolute_taken_apart(ring: Ring, value: Value, positive: Collection[int]) -> tuple[Value, list[Value], list[Value]]:
    """x and factors a, b with |value| = x |a| |a'| ... / (|b| |b'| ...): what is never negative stands in x."""
    num, outside = value.num, ring.one
    if any(printed_as_decimal(fraction(c)) for c in num.coeffs()) or len(num) > FACTORED or not len(num):
        return outside, [value], []
    unit, parts = ring.with_sines(*num.factor())
    outside = ring.number(abs(fraction(unit)))
    sides: tuple[list[Value], list[Value]] = [], []
    factors = [(factor, int(n), 0) for factor, n in sorted(parts, key=lambda part: str(part[0]))]
    for factor, n, side in (*factors, *[(ring.factors[k], n, 1) for k, n in value.under]):
        whole = n if _never_negative(factor, positive) else n - n % 2
        for _ in range(whole):
            outside = ring.mul(outside, Value(factor)) if not side else ring.div(outside, Value(factor))
        sides[side].extend([Value(factor)] * (n - whole))
    for row in sides:
        while len(row) > SIZES:
            row[-2:] = [ring.mul(*row[-2:])]
    return outside, *sides


def root_taken_apart(ring: Ring, value: Value, positive: Collection[int], most: int = ROOTS) -> tuple[Value, list[Value], Value]:
    """x, what stands under roots, and y, with sqrt(value) = x sqrt(..) sqrt(..) ... |y|: numbers, and factors that are never
    negative, have roots of their own, so that sqrt(a b) is sqrt(a) sqrt(b), sqrt(a / b^2) is sqrt(a) / b, and sqrt(c^2) is |c|.

    positive   generators that are not negative; most: roots on the right
    """
    num, outside = value.num, ring.one
    if any(printed_as_decimal(fraction(c)) for c in num.coeffs()) or len(num) > FACTORED:
        content = num.term_content()
        powers = content.degrees()
        for k in positive:
            for _ in range(int(powers[k]) // 2):
                outside = ring.mul(outside, ring.generator(k))
                num = divmod(num, ring.generators[k] ** 2)[0]
        return outside, [Value(num, value.under)], ring.one
    under = []
    size = ring.one
    for k, n in value.under:
        factor = ring.factors[k]
        if _never_negative(factor, positive):
            # sqrt(a / b) = sqrt(a b) / b
            if n % 2:
                num = ring.product(num, factor)
            outside = ring.mul(outside, Value(ring.one.num, ((k, (n + 1) // 2),)))
        else:
            size = ring.div(size, Value(factor ** (n // 2)))
            under += [(k, 1)] * (n % 2)
    unit, parts = ring.with_sines(*num.factor())
    number = fraction(unit)
    root = _root_of_square_in(abs(number.numerator) * number.denominator)
    outside = ring.mul(outside, ring.number(Fraction(root, number.denominator)))
    # Rest of the number, and its sign, which stays with the factor that may be negative.
    left = abs(number.numerator) * number.denominator // root**2
    rest = ring.context.constant(1 if number > 0 else -1)
    result = []
    for factor, n in sorted(parts, key=lambda part: str(part[0])):
        if _never_negative(factor, positive):
            outside = ring.mul(outside, Value(ring.reduced(factor ** (int(n) // 2))))
            result += [Value(factor)] * (int(n) % 2)
        else:
            size = ring.mul(size, Value(ring.reduced(factor ** (int(n) // 2))))
            rest = ring.reduced(rest * factor ** (int(n) % 2))
    result += [ring.number(prime) for prime, _ in _factors(left)]
    if not rest.is_one() or under:
        result.append(Value(rest, tuple(under)))
    while len(result) > most:
        result[-2:] = [ring.mul(*result[-2:])]
    return outside, result, size


def never_zero(p: Any, positive: Collection[int]) -> bool:
    """Whether a polynomial is a number with terms of its sign, squares times what is not negative."""
    return any(not any(exponents) for exponents, _ in p.terms()) and any(_never_negative(q, positive) for q in (p, -p))


def _never_negative(p: Any, positive: Collection[int]) -> bool:
    """Whether all terms of a polynomial are squares times what is not negative."""
    return all(c > 0 and all(n % 2 == 0 or k in positive for k, n in enumerate(exponents)) for exponents, c in p.terms())


def _root_of_square_in(n: int) -> int:
    """The largest k, but for large primes of long numbers, whose square divides n."""
    return prod(prime ** (power // 2) for prime, power in _factors(n))


def _factors(n: int) -> list[tuple[int, int]]:
    """Primes of a positive number and their powers; of a long one what is left without the small primes is no prime."""
    if n.bit_length() <= _BITS:
        return [(int(prime), int(power)) for prime, power in fmpz(n).factor()]
    result = []
    for prime in _PRIMES:
        power = 0
        while n % prime == 0:
            n, power = n // prime, power + 1
        result += [(prime, power)] * (power > 0)
    root = isqrt(n)
    return [*result, *([(root, 2)] if root**2 == n else [(n, 1)])]
