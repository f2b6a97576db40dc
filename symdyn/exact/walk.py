"""Exact values of what a tape computes.

Parameters, coordinates, speeds, accelerations, inputs and t are generators; so are sine and cosine of each base angle, and every
other function: roots with their relation r^2 = a, and functions without one (exp, tables, functions of the user, choices), each
for one value of its arguments. Numbers are exact: integers and fractions as they are, floats as the binary fractions that they
stand for, so that 0.1 is 3602879701896397/2^55 and not 1/10.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from math import gcd, isqrt, lcm
from typing import Any

from symdyn.exact.angles import Angles, Linear, arguments
from symdyn.exact.ring import BOUND, Ring, Value, fraction, rational
from symdyn.tape.node import Node, exact
from symdyn.tape.sympy_bridge import printed_as_decimal
from symdyn.tape.tape import reachable

_ARITHMETIC = ("leaf", "add", "sub", "mul", "div", "neg", "guard", "sin", "cos", "tan")
_TRUTH = ("lt", "le", "gt", "ge", "eq", "ne", "and", "or", "not")


@dataclass(frozen=True, eq=False)
class Atom:
    """A function that is no polynomial: its operation and arguments (values, truths, or a kernel first); item: one of its
    results."""

    op: str
    args: tuple[Any, ...]
    item: int | None = None


class Exact:
    """Exact values of entries (nodes and numbers) of one recorder.

    values   of the entries, in order
    ring     their arithmetic; leaves: generator -> leaf; atoms: generator -> atom
    bases    base angles, each a sum of terms; sines: generators of sine and cosine of each
    """

    def __init__(self, entries: Sequence[Any], bound: int = BOUND, unit_vectors: Sequence[Sequence[Node]] = (),
                 positive: Collection[Node] = ()) -> None:
        """unit_vectors: groups of leaves whose squares add up to one, such as Euler parameters; positive: leaves that are not
        negative, so that roots of their squares are themselves.

        Raises TooLarge where a value exceeds the bound on terms, ZeroDivisionError where an entry divides by zero."""
        steps = reachable(entries)
        angles = Angles(arguments(steps))
        others = [node for node in steps if node.op not in _ARITHMETIC and node.op not in _TRUTH]
        leaves = [node for node in steps if node.op == "leaf"]
        groups = [group for group in unit_vectors if all(leaf in leaves for leaf in group)]
        leading = [group[0] for group in groups]
        leaves = [*leading, *[leaf for leaf in leaves if leaf not in leading]]
        n, m, count = len(others), len(angles.bases), 0
        # Functions first, the last one highest; two generators a base angle; plain symbols.
        free = iter(range(n - 1, -1, -1))
        self.bases: list[Linear] = angles.bases
        self.sines = tuple((n + k, n + m + k) for k in range(m))
        count = n + 2 * m
        self.ring = ring = Ring(count + len(leaves), self.sines, bound)
        self.leaves = {count + k: leaf for k, leaf in enumerate(leaves)}
        self.atoms: dict[int, Atom] = {}
        self._angles = angles
        number_of = {leaf: k for k, leaf in self.leaves.items()}
        for first, *others in groups:
            ring.relate(number_of[first], 1 - sum(ring.generators[number_of[leaf]] ** 2 for leaf in others))
        self._pairs: dict[tuple[int, ...], tuple[Value, Value]] = {}
        known: dict[str, Value] = {}
        done: dict[Node, Any] = {leaf: ring.generator(k) for k, leaf in self.leaves.items()}

        def take(a: Any) -> Any:
            if isinstance(a, Node):
                return done[a]
            return a if isinstance(a, bool) else ring.number(exact(a))

        free_of_sign = [k for k, leaf in self.leaves.items() if leaf in positive]

        def function(node: Node) -> Value:
            item = node.args[1] if node.op == "item" else None
            args = done[node.args[0]] if node.op == "item" else tuple(map(take, node.args))
            if node.op == "sqrt" and not args[0].under and len(args[0].num):
                outside, inside = square_taken_out(ring, args[0].num, free_of_sign)
                if inside.is_one():
                    return Value(outside)
                return ring.mul(Value(outside), of_atom(Atom("sqrt", (Value(inside),))))
            return of_atom(Atom("call" if node.op == "item" else node.op, args, item))

        def of_atom(atom: Atom) -> Value:
            args, item = atom.args, atom.item
            key = f"{atom.op}{item}({','.join(self._key(a) for a in args)})"
            if key not in known:
                k = next(free)
                self.atoms[k] = atom
                known[key] = ring.generator(k)
                squared = atom.op in ("sqrt", "abs") and not args[0].under
                if squared:
                    ring.relate(k, args[0].num if atom.op == "sqrt" else ring.product(args[0].num, args[0].num))
            return known[key]

        arithmetic: Mapping[str, Callable] = {"add": ring.add, "sub": ring.sub, "mul": ring.mul, "div": ring.div, "neg": ring.neg,
                                              "guard": lambda a, _: a}
        for node in steps:
            if node.op == "leaf":
                continue
            if node.op in ("sin", "cos", "tan"):
                sine, cosine = self._turned(node.args[0])
                done[node] = sine if node.op == "sin" else cosine if node.op == "cos" else ring.div(sine, cosine)
            elif node.op in arithmetic:
                done[node] = arithmetic[node.op](*map(take, node.args))
            elif node.op == "call":
                done[node] = (node.args[0], *map(take, node.args[1:]))
            elif node.op in _TRUTH:
                done[node] = Atom(node.op, tuple(map(take, node.args)))
            else:
                done[node] = function(node)
        self.values: list[Value] = [take(e) for e in entries]

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


def square_taken_out(ring: Ring, p: Any, positive: Sequence[int]) -> tuple[Any, Any]:
    """x and y with p = x^2 y: squares of numbers, and of generators that are not negative, that all terms have in common."""
    content = p.term_content()
    powers = content.degrees()
    outside, square = ring.context.constant(1), ring.context.constant(1)
    for k in positive:
        half = int(powers[k]) // 2
        outside, square = outside * ring.generators[k] ** half, square * ring.generators[k] ** (2 * half)
    numbers = [fraction(c) for c in p.coeffs()]
    if not any(map(printed_as_decimal, numbers)):
        above, below = gcd(*[c.numerator for c in numbers]), lcm(*[c.denominator for c in numbers])
        # sqrt(a / b) = sqrt(a b) / b
        root = _root_of_square_in(above * below)
        factor = rational(Fraction(root, below))
        outside, square = outside * factor, square * factor**2
    return outside, divmod(p, square)[0]


def _root_of_square_in(n: int) -> int:
    """The largest k, but for large primes, whose square divides n."""
    if isqrt(n) ** 2 == n:
        return isqrt(n)
    root = 1
    for prime in (2, 3, 5, 7, 11, 13, 17, 19, 23, 29, 31):
        while n % prime**2 == 0:
            n, root = n // prime**2, root * prime
    return root * isqrt(n) if isqrt(n) ** 2 == n else root
