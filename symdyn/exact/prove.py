"""Equality proved, or refuted by a state where the sides differ.

The difference of the sides is brought to normal form (symdyn.exact.ring). Where that is zero, they are equal wherever no
denominator vanishes: a proof. Where it is not, they are evaluated at random states to fifty digits: one where they differ refutes
the claim. Where none does, which roots and functions without relations make possible, the claim is undecided.
"""

from __future__ import annotations

import random
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction
from itertools import combinations
from typing import TYPE_CHECKING, Any

import numpy as np
import sympy as sp
from sympy.core.function import AppliedUndef

from symdyn.errors import ArgumentError, UnsupportedExpression
from symdyn.exact.common import without_common_steps
from symdyn.exact.exponentials import in_letters
from symdyn.exact.ideal import Ideal
from symdyn.exact.manifold import States, eliminated, nonzero_parameters, relations_of
from symdyn.exact.ring import BOUND, TooLarge
from symdyn.exact.shortest import Writer, not_negative
from symdyn.exact.taken import recorded, value_unknown
from symdyn.exact.walk import Exact, never_zero
from symdyn.model.symbols import Timed, described, parts_of, symbols_of, take_over
from symdyn.shown import shown
from symdyn.tape.evaluate import evaluate
from symdyn.tape.node import Node
from symdyn.tape.recorder import Recorder
from symdyn.tape.sympy_bridge import printed_as_decimal
from symdyn.tape.tape import Tape, reachable

if TYPE_CHECKING:
    from symdyn.formulation.equations import Equations
    from symdyn.given import Matrix, Scalar

# States that are tried to refute a claim, digits of the evaluation; relative differences up to SAME are none, and up to ROUNDED
# of the largest entry they may come from decimal numbers, which are rounded to doubles.
STATES, DIGITS, SAME, ROUNDED = 12, 50, 1e-25, 1e-12
# Every fourth state has numbers down to minus this.
WIDE = 20.0
# A difference that is rounding keeps no more than this part with twice the digits.
REMAINDER = 1e-10
DECIMAL = "decimal numbers are the binary fractions next to them, with which the normal forms differ"
# Axes of decimal numbers are divided by their length at sixty digits; that their squares add up to one is true up to this. Their
# denominators are between these, those of products of them are longer.
UNIT, LONG = Fraction(1, 10**50), (10**50, 10**70)
ON = "on the relations"
CONTRADICTING = "the relations contradict each other: nothing fulfils them, and anything would follow"
UNFULFILLED = "no real values were found that fulfil the relations; from what nothing fulfils anything would follow"
DIRECTIONS = "for axes of decimal numbers, divided by their length exactly"
# Terms that a product may have where what both sides share is replaced: where that suffices, normal forms are short.
SHARED = 20_000
# Digits to which relations are fulfilled where that is all that is asked.
FULFILLED = 16
# A difference with more terms than this, or letters, is not written out in a reason.
WRITTEN, LETTERS = 60, 200


@dataclass(frozen=True)
class Proof:
    """The verdict on a claim a = b; true where it is proved.

    proved, refuted   undecided where neither holds
    reason    why it is undecided, or how the sides differ, or of which numbers it is proved; index: of the entry that differs, of
              matrices
    state     symbol -> number, where the sides differ; difference: a - b in its shortest form, unless it is long
    """

    proved: bool
    refuted: bool = False
    reason: str = ""
    index: tuple[int, ...] | None = None
    state: Mapping[sp.Symbol, float] = field(default_factory=dict)
    difference: Any = None

    def __bool__(self) -> bool:
        return self.proved

    @property
    def verdict(self) -> str:
        """proved, refuted or undecided."""
        return "proved" if self.proved else "refuted" if self.refuted else "undecided"

    def __str__(self) -> str:
        place = "" if self.index is None else f"entry {list(self.index)}: "
        return f"{self.verdict}: {place}{self.reason}" if self.reason else self.verdict

    def __repr__(self) -> str:
        return str(self)


def prove(a: Scalar | Matrix | Equations, b: Scalar | Matrix | Equations = 0,
          on: Scalar | Matrix | Equations | sp.Eq | Sequence[Scalar | sp.Eq] | None = None) -> Proof:
    """Decide whether two expressions or matrices of SymPy are equal, for real values of their symbols, where both are defined.

    a, b   expressions, numbers, or matrices of one shape; b = 0 stands for a matrix of zeros too
    on     relations that hold: expressions that are zero, equations (sp.Eq), lists of these; or the equations of a mechanism,
           whose constraints hold with their rates, no parameter being zero
    Numbers are taken exactly: 0.1 is the double next to 1/10, which is not 1/10. Derivatives are taken; integrals are letters,
    with which nothing is refuted. A function without a value, such as f(x), stands for any function; dynamicsymbols stand for
    coordinates of their name where a side holds such. On relations a claim is proved by multiples of them that add up to the
    difference of the sides, symbols assumed not to be zero being divisors, and refuted at a state that fulfils them. Raises
    ArgumentError for what is neither expression nor matrix, for matrices of different shapes, and for what is no relation.

    >>> import sympy as sp, symdyn as sd
    >>> x, y = sp.symbols("x y")
    >>> sd.prove(sp.sin(x)*sp.cos(y) + sp.cos(x)*sp.sin(y), sp.sin(x + y))
    proved
    >>> sd.prove(x**4 + x**2*y**2, x**2, on=x**2 + y**2 - 1)
    proved: on the relations
    """
    try:
        return _prove(a, b, on)
    except RecursionError:
        raise ArgumentError("prove was given expressions that are nested too deeply; name their parts by symbols, and prove what "
                            "holds for these") from None


def _prove(a: Any, b: Any, on: Any) -> Proof:
    left, right, columns = _entries(a, b)
    relations = [] if on is None else relations_of(on, [*left, *right])
    if any(isinstance(s, Timed) for e in (*left, *right, *relations) for s in symbols_of(e)):
        left, right, relations = (list(map(take_over, side)) for side in (left, right, relations))
    try:
        entries = [*left, *right, *relations]
        nodes, symbols = recorded(map(with_known_angles, entries), _same_functions(entries))
    except (UnsupportedExpression, ZeroDivisionError) as error:
        return Proof(False, reason=str(error))
    n = len(left)
    recorder = _recorder(nodes)
    pairs = [(x if isinstance(x, Node) else recorder.add(x, 0), y) for x, y in zip(nodes[:n], nodes[n:])]
    zeros, nonzero = [e for e in nodes[2 * n:] if isinstance(e, Node)], nonzero_parameters(on)
    proof = decide(recorder, pairs, symbols, columns=columns, relations=zeros, nonzero=nonzero)
    if proof.proved and proof.reason == ON and not nonzero and not _fulfilled(recorder, zeros, symbols):
        return Proof(False, reason=UNFULFILLED)
    if relations and proof.verdict == "undecided" and _proved_by_elimination(left, right, relations):
        return Proof(True, reason=ON)
    if not relations and proof.verdict == "undecided" and _proved_with_exponentials(left, right):
        return Proof(True)
    if not proof.refuted:
        return proof
    letters = [s for s in proof.state if value_unknown(s) and (proof.difference is None or proof.difference.has(s))]
    if letters:
        return Proof(False, reason=f"the sides differ unless {shown(letters[0])} has a certain value; take it with .doit()")
    return replace(proof, reason=_with_difference(proof, left, right))


def _fulfilled(recorder: Recorder, relations: Sequence[Node], symbols: Mapping[Node, sp.Expr]) -> bool:
    """Whether states are found that fulfil relations."""
    states, draw = States(recorder, relations, symbols), random.Random(1)
    leaves = Tape.of(recorder, zero=list(relations)).inputs
    return any(states.near(drawn_state(draw, leaves, -2.0 if attempt % 2 else 0.2, symbols), FULFILLED) is not None
               for attempt in range(STATES))


def _proved_by_elimination(left: Sequence[sp.Expr], right: Sequence[sp.Expr], relations: Sequence[sp.Expr]) -> bool:
    """Whether the sides are equal with symbols that the relations give by others, also within functions."""
    values = eliminated(relations)
    if not values:
        return False
    one, other, rest = ([e.xreplace(values) for e in side] for side in (left, right, relations))
    if any(e.has(sp.nan, sp.zoo, sp.oo) for e in (*one, *other, *rest)):
        return False
    rest = [e for e in map(sp.expand, rest) if e != 0]
    if any(e.is_number for e in rest):
        return False
    return prove(sp.Matrix(one), sp.Matrix(other), rest or None).proved


def _proved_with_exponentials(left: Sequence[sp.Expr], right: Sequence[sp.Expr]) -> bool:
    """Whether the sides are equal with any positive numbers for exponential functions of terms."""
    letters = in_letters([*left, *right])
    return letters is not None and not any(unproved(list(zip(letters[:len(left)], letters[len(left):]))))


def _with_difference(proof: Proof, left: Sequence[sp.Expr], right: Sequence[sp.Expr]) -> str:
    """Difference of the sides, with symbols of one side only, and those of one name that are not the same, of which the one in b
    is printed with a stroke."""
    if all(e == 0 for e in right):
        return proof.reason
    sides = [{s for e in side for s in symbols_of(e)} for side in (left, right)]
    only = sorted({str(s) for s in sides[0]} ^ {str(s) for s in sides[1]})
    pairs = sorted(((one, two) for one in sides[0] - sides[1] for two in sides[1] - sides[0] if str(one) == str(two)), key=str)
    reason = proof.reason
    if pairs and proof.difference is not None:
        reason = f"the sides differ by {proof.difference.xreplace({two: sp.Symbol(f'{two}' + chr(39)) for _, two in pairs})}"
    reason += f"; only one side holds {', '.join(only)}" if only else ""
    return reason + "".join(f"; {one} is not the same symbol on both sides: {described(one)} in a, {described(two)} in b"
                            for one, two in pairs)


def _same_functions(entries: Sequence[sp.Expr]) -> dict[Any, Any]:
    """Functions without a value -> the first one with arguments that are proved equal."""
    kept: list[Any] = []
    same: dict[Any, Any] = {}
    for part in sorted({part for part in parts_of(*entries) if isinstance(part, AppliedUndef)}, key=sp.default_sort_key):
        other = next((k for k in kept if k.func == part.func and len(k.args) == len(part.args)
                      and all(p == q or prove(p, q) for p, q in zip(k.args, part.args))), None)
        if other is None:
            kept.append(part)
        else:
            same[part] = other
    return same


def with_known_angles(e: sp.Expr) -> sp.Expr:
    """The expression with sin(x + pi/3) and others by the sum, where SymPy has roots for sine and cosine of the number."""
    if not e.has(sp.pi):
        return e

    def by_the_sum(function: Any) -> sp.Expr:
        known = function.args[0].as_coefficients_dict()[sp.pi] * sp.pi
        s, c, rest = sp.sin(known), sp.cos(known), function.args[0] - known
        if known == 0 or rest == 0 or s.has(sp.sin, sp.cos) or c.has(sp.sin, sp.cos):
            return function
        sine, cosine = sp.sin(rest) * c + sp.cos(rest) * s, sp.cos(rest) * c - sp.sin(rest) * s
        return {sp.sin: sine, sp.cos: cosine, sp.tan: sine / cosine}[function.func]

    return e.replace(lambda part: part.func in (sp.sin, sp.cos, sp.tan), by_the_sum)


def _entries(a: Any, b: Any) -> tuple[list[sp.Expr], list[sp.Expr], int]:
    """Entries of both sides, and the number of columns; 0 for scalars."""
    sides = []
    for name, value in (("a", a), ("b", b)):
        if isinstance(value, (int, float)) and not isinstance(value, bool):
            value = sp.sympify(value, strict=True)
        if not isinstance(value, (sp.MatrixBase, sp.Expr)) or value.has(sp.nan, sp.zoo, sp.oo):
            rows = f"; pass rows as sp.Matrix({name})" if isinstance(value, (list, tuple, np.ndarray)) else ""
            raise ArgumentError("prove takes expressions and matrices of SymPy and finite numbers; "
                                f"{name} is {shown(value)}{rows}")
        sides.append(value)
    a, b = sides
    if isinstance(a, sp.MatrixBase) and b == 0:
        b = sp.zeros(*a.shape)
    if not isinstance(a, sp.MatrixBase) and not isinstance(b, sp.MatrixBase):
        return [a], [b], 0
    shapes = [value.shape if isinstance(value, sp.MatrixBase) else "a scalar" for value in (a, b)]
    if shapes[0] != shapes[1]:
        raise ArgumentError(f"prove takes two expressions, or two matrices of one shape; a is {shapes[0]}, b is {shapes[1]}")
    return list(a), list(b), a.cols


def unproved(pairs: Sequence[tuple[sp.Expr, sp.Expr]], bound: int = BOUND, same: Mapping[Any, Any] | None = None) -> list[str]:
    """Why exact algebra does not prove the sides of each pair equal; "" where it does, for real values of their symbols.

    bound   terms that a product may have; same: symbol -> the one that it is taken for
    An obstacle to all pairs together, such as a pair that is too large, is looked for pair by pair.
    """
    try:
        nodes, symbols = recorded([with_known_angles(side) for pair in pairs for side in pair], same)
        recorder = _recorder(nodes)
        exact = Exact([recorder.sub(x, y) for x, y in zip(nodes[::2], nodes[1::2])], bound, positive=not_negative(symbols))
    except (UnsupportedExpression, ZeroDivisionError, TooLarge) as error:
        return [str(error)] if len(pairs) == 1 else [unproved([pair], bound, same)[0] for pair in pairs]
    without = _without_relations(exact)
    return ["" if not len(value.num) else DECIMAL if any(e.has(sp.Float) for e in pair) else f"the normal forms differ{without}"
            for value, pair in zip(exact.values, pairs)]


def zero(recorder: Recorder, pairs: Sequence[tuple[Any, Any]], bound: int, unit_vectors: Sequence[Sequence[Node]] = (),
         positive: Collection[Node] = ()) -> bool:
    """Whether exact algebra proves both nodes of every pair equal; no is no refutation. Parameters as in `decide` and Exact."""
    try:
        values = Exact([recorder.sub(x, y) for x, y in pairs], bound, unit_vectors, positive, of_calls=True).values
    except (TooLarge, ZeroDivisionError):
        return False
    return not any(len(value.num) for value in values)


def _recorder(nodes: Sequence[Any]) -> Recorder:
    """The recorder of the nodes; of numbers alone a new one."""
    return next((node.recorder for node in nodes if isinstance(node, Node)), None) or Recorder()


def _without_relations(exact: Exact) -> str:
    """Functions that different normal forms may come from."""
    names = sorted({atom.op for atom in exact.atoms.values()} - {"pi"})
    return f"; functions whose relations are not all known: {', '.join(names)}" if names else ""


def decide(recorder: Recorder, pairs: Sequence[tuple[Any, Any]], symbols: Mapping[Node, sp.Expr], columns: int = 0,
           unit_vectors: Sequence[Sequence[Node]] = (), bound: int = BOUND, relations: Sequence[Node] = (),
           nonzero: Collection[sp.Expr] = ()) -> Proof:
    """Whether both nodes of every pair have equal values.

    columns        of the matrix that the pairs are the entries of, row by row; 0: scalars
    unit_vectors   groups of leaves whose squares add up to one
    bound          terms that a product may have
    relations      nodes that are zero where the claim is made; nonzero: symbols in them that are not zero, besides those that are
                   assumed to be so
    """
    def index(k: int) -> tuple[int, ...] | None:
        return None if not columns else (k,) if columns == 1 else divmod(k, columns)

    doubtful: list[int] = []
    differences: list[Any] = []
    reason = ""
    try:
        differences = [recorder.sub(x, y) for x, y in pairs]
        exact = Exact([*differences, *relations], bound, unit_vectors, not_negative(symbols), of_calls=True)
        doubtful = [k for k, value in enumerate(exact.values[:len(pairs)]) if len(value.num)]
        if not doubtful:
            return Proof(True)
        never = next((value for value in exact.values[len(pairs):] if never_zero(value.num, exact.not_negative)), None)
        if never is not None:
            text = shown(Writer(exact, symbols).write(never))
            return Proof(False, reason=f"nothing real fulfils the relations: {text} is never zero")
        if relations:
            ideal = _ideal(exact, exact.values[len(pairs):], symbols, nonzero)
            if ideal.contains(exact.ring.one.num):
                return Proof(False, reason=CONTRADICTING)
            doubtful = [k for k in doubtful if not ideal.contains(exact.values[k].num)]
            if not doubtful:
                return Proof(True, reason=ON)
        if _proved_for_directions([differences[k] for k in doubtful], bound, unit_vectors, symbols):
            return Proof(True, reason=DIRECTIONS)
        if exact.atoms:
            doubtful = [k for k in doubtful if not _written_as_zero(exact, symbols, k)]
            if not doubtful:
                return Proof(True)
        reason = f"the normal forms differ{_by(exact, symbols, doubtful[0])}, at no state that was tried do the values"
        reason += _without_relations(exact)
    except TooLarge as error:
        if _proved_apart(pairs, differences, bound, unit_vectors, not_negative(symbols)):
            return Proof(True)
        doubtful, exact = list(range(len(pairs))), None
        reason = f"{error}; ask for a part of it, or put numbers in place of parameters"
    except ZeroDivisionError as error:
        return Proof(False, reason=str(error))
    decimal = any(isinstance(a, Fraction) and printed_as_decimal(a) for node in reachable(differences) for a in node.args)
    k, state = _different(recorder, pairs, doubtful, unit_vectors, ROUNDED if decimal else SAME, symbols, relations,
                          nonzero)
    if k is None and relations and not state:
        return Proof(False, reason="no state was found that fulfils the relations, and no multiples of them add up to the "
                                   f"difference of the sides{_by(exact, symbols, doubtful[0], ', ')}")
    if k is None and decimal and exact is not None:
        return Proof(False, reason=f"the sides differ by no more than the rounding of decimal numbers, {ROUNDED:g} of their "
                                   "size; pass fractions, such as sp.Rational('0.1') for 0.1", index=index(doubtful[0]))
    if k is None:
        return Proof(False, reason=reason, index=index(doubtful[0]) if exact is not None else None)
    where = {symbols.get(leaf, sp.Symbol(leaf.args[1])): float(value) for leaf, value in state.items()}
    if exact is None or len(exact.values[k].num) > WRITTEN:
        return Proof(False, True, "the values differ", index(k), where)
    difference = Writer(exact, symbols).write(exact.values[k])
    return Proof(False, True, f"the sides differ by {difference}", index(k), where, difference)


def _written_as_zero(exact: Exact, symbols: Mapping[Node, sp.Expr], k: int) -> bool:
    """Whether SymPy's own rules for functions of functions, such as cos(acos(x)) = x, leave nothing of a short difference."""
    return len(exact.values[k].num) <= WRITTEN and bool(Writer(exact, symbols).write(exact.values[k]) == 0)


def _by(exact: Exact | None, symbols: Mapping[Node, sp.Expr], k: int, before: str = " by ") -> str:
    """Rest of the difference of a pair; "" where that is long."""
    if exact is None or len(exact.values[k].num) > WRITTEN:
        return ""
    text = shown(Writer(exact, symbols).write(exact.values[k]))
    return f"{before}{text}" if len(text) <= LETTERS else ""


def _ideal(exact: Exact, relations: Sequence[Any], symbols: Mapping[Node, sp.Expr], nonzero: Collection[sp.Expr]) -> Ideal:
    """The multiples of values that are zero."""
    divisors = [k for k, leaf in exact.leaves.items()
                if leaf in symbols and (symbols[leaf].is_nonzero or symbols[leaf] in nonzero)]
    return Ideal(exact.ring, [value.num for value in relations], divisors)


def _proved_apart(pairs: Sequence[tuple[Any, Any]], differences: Sequence[Any], bound: int,
                  unit_vectors: Sequence[Sequence[Node]], positive: Collection[Node]) -> bool:
    """Whether exact algebra proves each difference zero, for any values of what the sides have in common, or alone; no is no
    refutation."""
    left = list(differences)
    try:
        short, leaves = without_common_steps(pairs, differences)
        groups = [[leaves[leaf] for leaf in group] for group in unit_vectors if all(leaf in leaves for leaf in group)]
        known = {leaves[leaf] for leaf in positive if leaf in leaves}
        values = Exact(short, min(bound, SHARED), groups, known, of_calls=True).values
        left = [difference for difference, value in zip(differences, values) if len(value.num)]
    except (TooLarge, ZeroDivisionError):
        pass
    try:
        return not any(len(Exact([e], bound, unit_vectors, positive, of_calls=True).values[0].num) for e in left)
    except (TooLarge, ZeroDivisionError):
        return False


def _proved_for_directions(differences: Sequence[Any], bound: int, unit_vectors: Sequence[Sequence[Node]],
                           symbols: Mapping[Node, sp.Expr]) -> bool:
    """Whether the differences vanish for all axes of unit length in place of those that were divided by their length and
    rounded, for which they vanish up to the rounding only."""
    directions = rounded_directions(differences)
    if not directions:
        return False
    exact = Exact(differences, bound, unit_vectors, not_negative(symbols), directions, of_calls=True)
    return not any(len(value.num) for value in exact.values)


def rounded_directions(entries: Sequence[Any]) -> list[tuple[Fraction, ...]]:
    """Two or three numbers each, without signs, whose squares add up to one but for rounding at sixty digits."""
    left = sorted({abs(a) for node in reachable(entries) for a in node.args
                   if isinstance(a, Fraction) and LONG[0] < a.denominator < LONG[1] and abs(a) < 1}, reverse=True)
    result: list[tuple[Fraction, ...]] = []
    for size in (2, 3):
        for group in combinations(left, size):
            off = abs(sum((a * a for a in group), Fraction(-1)))
            if 0 < off < UNIT and all(a in left for a in group):
                result.append(group)
                left = [a for a in left if a not in group]
    return result


def _different(recorder: Recorder, pairs: Sequence[tuple[Any, Any]], doubtful: Sequence[int],
               unit_vectors: Sequence[Sequence[Node]], same: float, symbols: Mapping[Node, sp.Expr],
               relations: Sequence[Node] = (), nonzero: Collection[sp.Expr] = ()) -> tuple[int | None, dict[Node, Any]]:
    """A pair whose values differ, and the values of the leaves there; without such a pair the values that were tried last."""
    taken = range(len(pairs)) if same != SAME else doubtful
    tape = Tape.of(recorder, left=[pairs[k][0] for k in taken], right=[pairs[k][1] for k in taken], zero=list(relations))
    on = States(recorder, relations, symbols, nonzero) if relations else None
    draw = random.Random(1)
    tried: dict[Node, Any] = {}
    for attempt in range(STATES):
        # Positive numbers first: roots and logarithms of them are real; wide ones leave the first turn of an angle.
        least = 0.2 if attempt % 2 == 0 else -2.0 if attempt % 4 == 1 else -WIDE
        values = drawn_state(draw, tape.inputs, least, symbols, unit_vectors)
        if on is not None:
            reached = on.near(values, 2 * DIGITS)
            if reached is None:
                continue
            values = reached
        tried = values
        try:
            result = evaluate(tape, {leaf.args[1]: value for leaf, value in values.items()}, DIGITS)
        except TypeError:  # complex numbers have no order: a comparison is not defined at this state
            continue
        rows = [(place, x, y) for place, (x, y) in enumerate(zip(result["left"], result["right"]))
                if all(getattr(v, "imag", 0) == 0 and v == v for v in (x, y))]
        largest = max((abs(x) + abs(y) for _, x, y in rows), default=0)
        apart = [(place, abs(x - y)) for place, x, y in rows
                 if abs(x - y) > same * (abs(x) + abs(y) if same == SAME else largest)]
        if apart:
            # Sides that vanish by cancellation differ by rounding, of which nothing remains with twice the digits.
            again = evaluate(tape, {leaf.args[1]: value for leaf, value in values.items()}, 2 * DIGITS)
            for place, difference in apart:
                if abs(again["left"][place] - again["right"][place]) > REMAINDER * difference:
                    return taken[place], values
    return None, tried


def drawn_state(draw: random.Random, leaves: Sequence[Node], least: float, symbols: Mapping[Node, sp.Expr],
                unit_vectors: Sequence[Sequence[Node]] = ()) -> dict[Node, Any]:
    """Random numbers between `least` and 2 for leaves, as their symbols and unit vectors demand."""
    values: dict[Node, Any] = {leaf: _drawn(draw, least, symbols.get(leaf)) for leaf in leaves}
    _normalize(values, unit_vectors)
    return values


def _drawn(draw: random.Random, least: float, symbol: sp.Expr | None) -> float:
    """A random number that fulfils what is assumed of the symbol's sign and kind."""
    value = draw.uniform(least, 2.0)
    if symbol is not None and symbol.is_integer:
        value = float(round(3 * value)) or 1.0
    if symbol is not None and (symbol.is_nonnegative or symbol.is_nonpositive):
        return abs(value) if symbol.is_nonnegative else -abs(value)
    return value


def _normalize(values: dict[Node, Any], unit_vectors: Sequence[Sequence[Node]]) -> None:
    """Unit vectors, to all digits, among the values."""
    import mpmath

    for group in unit_vectors:
        if all(leaf in values for leaf in group):
            with mpmath.workdps(2 * DIGITS + 10):
                numbers = [mpmath.mpf(values[leaf]) for leaf in group]
                size = mpmath.sqrt(sum(x * x for x in numbers))
                values.update({leaf: x / size for leaf, x in zip(group, numbers)})

