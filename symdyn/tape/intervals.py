"""Enclosures: from a tape the tape that bounds its values and their first two derivatives along a line, in interval arithmetic.

A quantity that depends on s, -1 <= s <= 1, is a jet: three intervals that hold the value, its derivative and its second
derivative by s at every s. Jets of the leaves are given; those of results follow operation by operation, by the chain rule with
ranges of f, f' and f'' over intervals. Ends of intervals are rounded to nearest: bounds hold but for rounding, unless values are
widened by the rounding of every operation.

Source: Moore, Kearfott and Cloud, Introduction to Interval Analysis (2009), chapters 2, 5 and 9.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from fractions import Fraction
from typing import Any, NamedTuple

from symdyn.tape.node import PARAMETER, Node, is_zero
from symdyn.tape.recorder import Recorder
from symdyn.tape.tape import reachable
from symdyn.tape.walk import Arithmetic, walk

# Stands for unbounded, so that products of several do not overflow; the largest argument of exp below it.
BIG, LARGEST_EXPONENT = 10**60, 138
# Values with more operations than this that move are not enclosed: intervals grow with every one of them.
MOST = 400
# Relative change of a value by an operation with rounding: a unit of the last place of doubles.
ROUNDING = Fraction(1, 2**52)
_COMPARED = {"lt", "le", "gt", "ge", "eq", "ne"}
# Operations without rounding.
_EXACT = {"neg", "abs", "sign", "floor", "ceil", "min", "max", "select", "and", "or", "not", *_COMPARED}
_HALF = Fraction(1, 2)


class Interval(NamedTuple):
    """From lo to hi: nodes or numbers."""

    lo: Any
    hi: Any


class Jet(NamedTuple):
    """Bounds of a value, its derivative and its second derivative."""

    value: Interval
    slope: Interval
    bend: Interval


class _Truth(NamedTuple):
    """A condition: certainly, possibly true."""

    must: Any
    may: Any


ZERO, ANY = Interval(0, 0), Interval(-BIG, BIG)


def encloses(recorder: Recorder, entry: Any) -> bool:
    """Whether a value can be enclosed: it is short, and calls no algorithm, solves no equations and calls no function of the
    user."""
    stack, seen = [entry], set[Node]()
    while stack:
        node = stack.pop()
        if not isinstance(node, Node) or node in seen or not node.mask & ~PARAMETER:
            continue
        if node.op in ("call", "item", "guard") or node in recorder.checks:
            return False
        seen.add(node)
        if len(seen) > MOST:
            return False
        stack += node.args
    return True


def enclosures(recorder: Recorder, entries: Sequence[Any], leaves: Mapping[Node, Jet], rounded: bool = False) -> list[Jet]:
    """A jet for every entry, all of which `encloses` holds of.

    leaves    jets of what moves
    rounded   whether values are to hold what doubles give as well, with the rounding of their operations
    """
    steps = reachable(entries)
    known = {node: leaves[node] if node in leaves else _still(node) for node in steps
             if node in leaves or not node.mask & ~PARAMETER}
    result = walk(steps, _Intervals(recorder, rounded), known)
    return [result.of(entry) for entry in entries]


def _still(value: Any) -> Jet:
    return Jet(Interval(value, value), ZERO, ZERO)


class _Intervals(Arithmetic):
    """Operations on intervals and jets, recorded; rounded: whether values are widened by their rounding."""

    def __init__(self, recorder: Recorder, rounded: bool) -> None:
        self.r, self.rounded = recorder, rounded

    def number(self, value: Any) -> Any:
        return value if isinstance(value, bool) else _still(value)

    def step(self, node: Node, args: list[Any]) -> Any:
        made = self.jet(node.op, args)
        return made._replace(value=self.widened(made.value)) if self.rounded and node.op not in _EXACT else made

    # -- numbers

    def least(self, *values: Any) -> Any:
        return self._extreme("lt", values)

    def most(self, *values: Any) -> Any:
        return self._extreme("gt", values)

    def _extreme(self, comparison: str, values: Sequence[Any]) -> Any:
        """By comparisons, which are one instruction where C's fmin and fmax, with their rules for NaN, are calls."""
        first, *rest = dict.fromkeys(values)
        for value in rest:
            first = self.choose(self.r.apply(comparison, first, value), first, value)
        return first

    def choose(self, condition: Any, yes: Any, no: Any) -> Any:
        return self.r.apply("select", condition, yes, no)

    def where(self, condition: Any, yes: Interval, no: Interval) -> Interval:
        return Interval(self.choose(condition, yes.lo, no.lo), self.choose(condition, yes.hi, no.hi))

    def above(self, a: Any, b: Any) -> Any:
        return self.r.apply("gt", a, b)

    # -- intervals

    def add(self, a: Interval, b: Interval) -> Interval:
        return Interval(self.r.add(a.lo, b.lo), self.r.add(a.hi, b.hi))

    def neg(self, a: Interval) -> Interval:
        return Interval(self.r.neg(a.hi), self.r.neg(a.lo))

    def sub(self, a: Interval, b: Interval) -> Interval:
        return self.add(a, self.neg(b))

    def mul(self, a: Interval, b: Interval) -> Interval:
        r = self.r
        if _is_nothing(a) or _is_nothing(b):
            return ZERO
        if a == b:
            return self.square(a)
        for one, other in ((a, b), (b, a)):
            if not isinstance(one.lo, Node) and one.lo == one.hi:
                low, high = r.mul(one.lo, other.lo), r.mul(one.lo, other.hi)
                return Interval(low, high) if one.lo > 0 else Interval(high, low)
        products = [r.mul(x, y) for x in dict.fromkeys(a) for y in dict.fromkeys(b)]
        return Interval(self.least(*products), self.most(*products))

    def square(self, a: Interval) -> Interval:
        r = self.r
        if a.lo is a.hi or (not isinstance(a.lo, Node) and a.lo == a.hi):
            return Interval(r.mul(a.lo, a.lo), r.mul(a.lo, a.lo))
        inner = self.most(a.lo, r.neg(a.hi), 0)
        return Interval(r.mul(inner, inner), self.most(r.mul(a.lo, a.lo), r.mul(a.hi, a.hi)))

    def inverse(self, a: Interval) -> Interval:
        """1/a, unbounded where a holds zero."""
        r = self.r
        known = self.above(r.mul(a.lo, a.hi), 0)
        safe = Interval(self.choose(known, a.lo, 1), self.choose(known, a.hi, 1))
        return self.where(known, Interval(r.div(1, safe.hi), r.div(1, safe.lo)), ANY)

    def widened(self, a: Interval) -> Interval:
        """With the rounding of an operation."""
        below, above = (self.r.mul(ROUNDING, self.r.apply("abs", end)) for end in a)
        return Interval(self.r.sub(a.lo, below), self.r.add(a.hi, above))

    def hull(self, a: Interval, b: Interval) -> Interval:
        return Interval(self.least(a.lo, b.lo), self.most(a.hi, b.hi))

    def rising(self, op: str, a: Interval) -> Interval:
        return Interval(self.r.apply(op, a.lo), self.r.apply(op, a.hi))

    def cosine(self, a: Interval, shift: Any) -> Interval:
        """Range of cos(z - shift pi): by its extremes within, else by its ends."""
        r = self.r
        function = "sin" if shift else "cos"
        turns = [r.div(r.div(end, 2), r.apply("pi")) for end in a]
        ends = [r.apply(function, end) for end in a]

        def passes(part: Any) -> Any:
            """Whether (z - shift pi)/(2 pi) is a whole number and a part somewhere within."""
            offset = -(Fraction(shift) / 2 + part)
            return r.apply("ge", r.apply("floor", r.add(turns[1], offset)), r.add(turns[0], offset))

        return Interval(self.choose(passes(_HALF), -1, self.least(*ends)), self.choose(passes(Fraction(0)), 1, self.most(*ends)))

    def exponential(self, a: Interval) -> Interval:
        r = self.r
        ends = [r.apply("exp", self.least(end, LARGEST_EXPONENT)) for end in a]
        return Interval(ends[0], self.choose(self.above(a.hi, LARGEST_EXPONENT), BIG, ends[1]))

    def root(self, a: Interval) -> Interval:
        return self.rising("sqrt", Interval(self.most(a.lo, 0), self.most(a.hi, 0)))

    # -- jets

    def jet(self, op: str, args: list[Any]) -> Any:
        """The result of an operation on jets and truths."""
        if op in ("add", "sub"):
            act = self.add if op == "add" else self.sub
            return Jet(*[act(a, b) for a, b in zip(*args, strict=True)])
        if op == "neg":
            return Jet(*map(self.neg, args[0]))
        if op == "mul":
            return self.product(*args)
        if op == "div":
            return self.product(args[0], self.composed(args[1], *self.of_inverse(args[1].value)))
        if op == "pow":
            logarithm = self.composed(args[0], *self.of_log(args[0].value))
            power = self.product(args[1], logarithm)
            return self.composed(power, *[self.exponential(power.value)] * 3)
        if op == "atan2":
            return self.atan2(*args)
        if op in ("min", "max"):
            return self.extreme(op, *args)
        if op in _COMPARED:
            return self.compared(op, args[0].value, args[1].value)
        if op in ("and", "or", "not"):
            return self.logical(op, [_Truth(a, a) if isinstance(a, bool) else a for a in args])
        if op == "select":
            return self.select(*args)
        return self.composed(args[0], *getattr(self, f"of_{op}")(args[0].value))

    def product(self, a: Jet, b: Jet) -> Jet:
        cross = self.mul(a.slope, b.slope)
        if a is b:
            twice = self.mul(a.value, a.slope)
            bend = self.add(cross, self.mul(a.value, a.bend))
            return Jet(self.square(a.value), self.add(twice, twice), self.add(bend, bend))
        slope = self.add(self.mul(a.slope, b.value), self.mul(a.value, b.slope))
        bend = self.add(self.add(self.mul(a.bend, b.value), self.mul(a.value, b.bend)), self.add(cross, cross))
        return Jet(self.mul(a.value, b.value), slope, bend)

    def composed(self, a: Jet, value: Interval, first: Interval, second: Interval) -> Jet:
        """f(a), from the ranges of f, f' and f'' over a."""
        bend = self.add(self.mul(second, self.square(a.slope)), self.mul(first, a.bend))
        return Jet(value, self.mul(first, a.slope), bend)

    def atan2(self, y: Jet, x: Jet) -> Jet:
        """Its extremes over a box away from the cut are at corners."""
        r = self.r
        away = r.apply("or", self.above(x.value.lo, 0), self.above(r.mul(y.value.lo, y.value.hi), 0))
        y = y._replace(value=self.where(away, y.value, Interval(0, 0)))
        x = x._replace(value=self.where(away, x.value, Interval(1, 1)))
        corners = [r.apply("atan2", b, a) for b in y.value for a in x.value]
        value = Interval(self.least(*corners), self.most(*corners))
        square = self.add(self.square(x.value), self.square(y.value))
        inverse = self.inverse(square)
        turned = self.sub(self.mul(x.value, y.slope), self.mul(y.value, x.slope))
        slope = self.mul(turned, inverse)
        outward = self.add(self.mul(x.value, x.slope), self.mul(y.value, y.slope))
        change = self.sub(self.mul(x.value, y.bend), self.mul(y.value, x.bend))
        along = self.mul(slope, outward)
        bend = self.mul(self.sub(change, self.add(along, along)), inverse)
        pi = r.apply("pi")
        return Jet(self.where(away, value, Interval(r.neg(pi), pi)), self.where(away, slope, ANY), self.where(away, bend, ANY))

    def extreme(self, op: str, a: Jet, b: Jet) -> Jet:
        """The one that is taken throughout, where there is one; else there may be a kink."""
        first, second = self.above(b.value.lo, a.value.hi), self.above(a.value.lo, b.value.hi)
        if op == "max":
            first, second = second, first
        value = Interval(*[self.r.apply(op, x, y) for x, y in zip(a.value, b.value, strict=True)])
        mixed = self.hull(a.slope, b.slope), ANY
        slope, bend = (self.where(first, x, self.where(second, y, m)) for x, y, m in zip(a[1:], b[1:], mixed, strict=True))
        return Jet(value, slope, bend)

    def compared(self, op: str, a: Interval, b: Interval) -> _Truth:
        r = self.r
        if op in ("gt", "ge"):
            a, b, op = b, a, {"gt": "lt", "ge": "le"}[op]
        if op in ("lt", "le"):
            return _Truth(r.apply(op, a.hi, b.lo), r.apply(op, a.lo, b.hi))
        apart = r.apply("or", self.above(a.lo, b.hi), self.above(b.lo, a.hi))
        return _Truth(False, r.apply("not", apart)) if op == "eq" else _Truth(apart, True)

    def logical(self, op: str, args: list[_Truth]) -> _Truth:
        r = self.r
        if op == "not":
            return _Truth(r.apply("not", args[0].may), r.apply("not", args[0].must))
        return _Truth(r.apply(op, args[0].must, args[1].must), r.apply(op, args[0].may, args[1].may))

    def select(self, condition: Any, yes: Jet, no: Jet) -> Jet:
        """The branch that is not taken has no effect; where the branch is not known, the value may jump."""
        truth = _Truth(condition, condition) if isinstance(condition, bool) else condition
        mixed = self.hull(yes.value, no.value), ANY, ANY
        return Jet(*[self.where(truth.must, a, self.where(truth.may, m, b)) for a, b, m in zip(yes, no, mixed, strict=True)])

    # -- ranges of f, f' and f'' over an interval

    def of_inverse(self, a: Interval) -> tuple[Interval, Interval, Interval]:
        value = self.inverse(a)
        square = self.square(value)
        cube = self.mul(value, square)
        return value, self.neg(square), self.add(cube, cube)

    def of_sin(self, a: Interval) -> tuple[Interval, Interval, Interval]:
        sine = self.cosine(a, _HALF)
        return sine, self.cosine(a, 0), self.neg(sine)

    def of_cos(self, a: Interval) -> tuple[Interval, Interval, Interval]:
        cosine = self.cosine(a, 0)
        return cosine, self.neg(self.cosine(a, _HALF)), self.neg(cosine)

    def of_tan(self, a: Interval) -> tuple[Interval, Interval, Interval]:
        r = self.r
        branch = [r.apply("floor", r.add(r.div(end, r.apply("pi")), _HALF)) for end in a]
        known = r.apply("eq", *branch)
        value = self.where(known, self.rising("tan", a), ANY)
        first = self.add(Interval(1, 1), self.square(value))
        second = self.mul(value, first)
        return value, first, self.add(second, second)

    def of_exp(self, a: Interval) -> tuple[Interval, Interval, Interval]:
        value = self.exponential(a)
        return value, value, value

    def of_log(self, a: Interval) -> tuple[Interval, Interval, Interval]:
        known = self.above(a.lo, 0)
        value = self.where(known, self.rising("log", self.where(known, a, Interval(1, 1))), ANY)
        first = self.where(known, self.inverse(a), ANY)
        return value, first, self.neg(self.square(first))

    def of_sqrt(self, a: Interval) -> tuple[Interval, Interval, Interval]:
        known = self.above(a.lo, 0)
        value = self.root(a)
        half = self.mul(Interval(_HALF, _HALF), self.inverse(value))
        first = self.where(known, half, ANY)
        bend = self.neg(self.mul(self.mul(Interval(_HALF, _HALF), half), self.inverse(a)))
        return value, first, self.where(known, bend, ANY)

    def _arc(self, op: str, a: Interval) -> tuple[Interval, Interval, Interval]:
        inside = Interval(*[self.least(self.most(end, -1), 1) for end in a])
        rest = self.sub(Interval(1, 1), self.square(a))
        known = self.above(rest.lo, 0)
        first = self.where(known, self.inverse(self.root(rest)), ANY)
        bend = self.where(known, self.mul(self.mul(a, first), self.inverse(rest)), ANY)
        ends = self.rising(op, inside)
        return (ends, first, bend) if op == "asin" else (Interval(ends.hi, ends.lo), self.neg(first), self.neg(bend))

    def of_asin(self, a: Interval) -> tuple[Interval, Interval, Interval]:
        return self._arc("asin", a)

    def of_acos(self, a: Interval) -> tuple[Interval, Interval, Interval]:
        return self._arc("acos", a)

    def of_atan(self, a: Interval) -> tuple[Interval, Interval, Interval]:
        first = self.inverse(self.add(Interval(1, 1), self.square(a)))
        bend = self.mul(a, self.square(first))
        return self.rising("atan", a), first, self.neg(self.add(bend, bend))

    def of_sinh(self, a: Interval) -> tuple[Interval, Interval, Interval]:
        value = self.rising("sinh", a)
        return value, self._cosh(a), value

    def of_cosh(self, a: Interval) -> tuple[Interval, Interval, Interval]:
        value = self._cosh(a)
        return value, self.rising("sinh", a), value

    def _cosh(self, a: Interval) -> Interval:
        inner, outer = self.most(a.lo, self.r.neg(a.hi), 0), self.most(a.hi, self.r.neg(a.lo))
        return self.rising("cosh", Interval(inner, outer))

    def of_tanh(self, a: Interval) -> tuple[Interval, Interval, Interval]:
        value = self.rising("tanh", a)
        first = self.sub(Interval(1, 1), self.square(value))
        bend = self.mul(value, first)
        return value, first, self.neg(self.add(bend, bend))

    def of_asinh(self, a: Interval) -> tuple[Interval, Interval, Interval]:
        inverse = self.inverse(self.add(self.square(a), Interval(1, 1)))
        first = self.root(inverse)
        return self.rising("asinh", a), first, self.neg(self.mul(a, self.mul(first, inverse)))

    def of_acosh(self, a: Interval) -> tuple[Interval, Interval, Interval]:
        rest = self.sub(self.square(a), Interval(1, 1))
        known = self.above(a.lo, 1)
        inverse = self.where(known, self.inverse(rest), ANY)
        first = self.where(known, self.root(inverse), ANY)
        inside = Interval(self.most(a.lo, 1), self.most(a.hi, 1))
        return self.rising("acosh", inside), first, self.where(known, self.neg(self.mul(a, self.mul(first, inverse))), ANY)

    def of_atanh(self, a: Interval) -> tuple[Interval, Interval, Interval]:
        rest = self.sub(Interval(1, 1), self.square(a))
        known = self.above(rest.lo, 0)
        first = self.where(known, self.inverse(rest), ANY)
        bend = self.mul(a, self.square(first))
        safe = self.where(known, a, Interval(0, 0))
        return self.where(known, self.rising("atanh", safe), ANY), first, self.where(known, self.add(bend, bend), ANY)

    def of_erf(self, a: Interval) -> tuple[Interval, Interval, Interval]:
        r = self.r
        factor = r.div(2, r.apply("sqrt", r.apply("pi")))
        first = self.mul(Interval(factor, factor), self.exponential(self.neg(self.square(a))))
        bend = self.mul(a, first)
        return self.rising("erf", a), first, self.neg(self.add(bend, bend))

    def of_abs(self, a: Interval) -> tuple[Interval, Interval, Interval]:
        inner, outer = self.most(a.lo, self.r.neg(a.hi), 0), self.most(a.hi, self.r.neg(a.lo))
        return Interval(inner, outer), self.rising("sign", a), self.where(self._one_side(a), ZERO, ANY)

    def of_sign(self, a: Interval) -> tuple[Interval, Interval, Interval]:
        slope = self.where(self._one_side(a), ZERO, ANY)
        return self.rising("sign", a), slope, slope

    def _one_side(self, a: Interval) -> Any:
        return self.r.apply("or", self.above(a.lo, 0), self.above(0, a.hi))

    def of_floor(self, a: Interval) -> tuple[Interval, Interval, Interval]:
        return self._steps("floor", a)

    def of_ceil(self, a: Interval) -> tuple[Interval, Interval, Interval]:
        return self._steps("ceil", a)

    def _steps(self, op: str, a: Interval) -> tuple[Interval, Interval, Interval]:
        value = self.rising(op, a)
        slope = self.where(self.r.apply("eq", value.lo, value.hi), ZERO, ANY)
        return value, slope, slope


def _is_nothing(a: Interval) -> bool:
    return is_zero(a.lo) and is_zero(a.hi)
