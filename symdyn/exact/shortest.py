"""The shortest way to write exact values, as SymPy expressions in the user's symbols.

For each entry the sets of letters of symdyn.exact.represent and the arrangements of symdyn.exact.arrange are tried, and the one
of the least cost is taken (see arrange): polynomial, Fourier, factored, gathered by speeds, by parameters, by functions of the
angles, nested. Nothing depends on time, hash seeds or the machine.
"""

from __future__ import annotations

import math
import weakref
from collections.abc import Callable, Mapping, Sequence
from fractions import Fraction
from functools import partial
from typing import Any

import sympy as sp

from symdyn.errors import SymdynError, UnsupportedExpression
from symdyn.exact.angles import Inverse
from symdyn.exact.arrange import Arranger, Letter, Polynomial, Sum, Tree, total
from symdyn.exact.ideal import Ideal
from symdyn.exact.reduce import relations_in_letters, shortened
from symdyn.exact.represent import Basis, Letters, better_basis, contracted, divided, fourier, halved, plain, with_tangents
from symdyn.exact.ring import BOUND, TooLarge, Value
from symdyn.exact.taken import recorded
from symdyn.exact.walk import Atom, Exact
from symdyn.shown import shown
from symdyn.tape.external import UserFunction
from symdyn.tape.node import ACCELERATION, INPUT, PARAMETER, SEED, SPEED, Node
from symdyn.tape.sympy_bridge import applied, expand, number
from symdyn.tape.tape import Output, reachable

FORMS = ("shortest", "polynomial", "fourier", "factored", "speeds", "parameters", "angles", "nested")
_GROUPS = {"speeds": ("motion",), "parameters": ("parameter",), "angles": ("position",)}
# Kinds of letters that whole entries are gathered by, and those of them that take little time for long entries.
_STATE = ("motion", "position")
_GATHERED_LONG = (("position",), _STATE)
_GATHERED = (("motion",), ("parameter",), *_GATHERED_LONG)
_MOTION = SPEED | ACCELERATION | INPUT | SEED
# Representations with this many times the terms of the shortest one are not arranged; those of more than SHORT terms are only
# nested, in the two shortest representations, and of more than LONG terms in one.
WORSE, SHORT, LONG = 1.5, 25, 150
# Terms that all entries together may have to be arranged, which takes less than ten seconds.
TERMS = 20_000
# Letters that a multiple of an angle counts as: mechanisms are read in the angles they are described by.
MULTIPLE = 10
# Entries are compared with the form in which they were derived if that has no more than LONGER times the operations, before
# SymPy combines terms; up to FACTOR_TERMS operations common factors are taken out of it, if it then has no more than NEAR times
# as many. SymPy's factor_terms leads to longer ones and takes ten times as long. A form with more than CLOSE times as many is not
# the shortest.
LONGER, FACTOR_TERMS, NEAR, CLOSE = 2.4, 250, 1.6, 1.2


class WrittenAngles:
    """Combinations of the base angles of an Exact, as SymPy expressions in the user's symbols."""

    def __init__(self, exact: Exact, symbols: Mapping[Node, sp.Expr]) -> None:
        self.bases, self.symbols = exact.bases, symbols
        self._known: dict[tuple[int, ...], sp.Expr] = {}
        self._opposites: dict[tuple[int, ...], bool] = {}

    def expression(self, vector: tuple[int, ...]) -> sp.Expr:
        """The angle."""
        if vector not in self._known:
            total = self._terms(vector)
            e = sp.Add(*[number(factor) * sp.Mul(*[self.node(node) for node in term])
                         for term, factor in total.items() if factor])
            if any(isinstance(node, Inverse) for term in total for node in term):
                e = min(e, sp.together(e), key=sp.count_ops)
            self._known[vector] = e
        return self._known[vector]

    def _terms(self, vector: tuple[int, ...]) -> dict[Any, Fraction]:
        """A combination of the base angles as a sum of terms with their factors."""
        total: dict[Any, Fraction] = {}
        for k, n in enumerate(vector):
            for term, factor in self.bases[k].items() if n else ():
                total[term] = total.get(term, Fraction(0)) + n * factor
        return total

    def node(self, node: Node | Inverse) -> sp.Expr:
        """Part of an angle: a symbol, something that the angle cannot be taken apart at, or one over it."""
        if isinstance(node, Inverse):
            return 1 / self.node(node.node)
        if node.op == "leaf":
            return self.symbols.get(node, sp.Symbol(node.args[1]))
        return expand(Output.of("angle", node), self.symbols)

    def opposite(self, vector: tuple[int, ...]) -> bool:
        """Whether the opposite of the angle is the one to write."""
        if vector not in self._opposites:
            self._opposites[vector] = self._is_opposite(vector)
        return self._opposites[vector]

    def _is_opposite(self, vector: tuple[int, ...]) -> bool:
        """SymPy's rule, which it applies to arguments of sines: more minus signs than plus signs; of as many, one before the
        first symbol in SymPy's order."""
        terms = {term: factor for term, factor in self._terms(vector).items() if factor}
        signs = sum(1 if factor > 0 else -1 for factor in terms.values())
        if signs and all(node.op == "leaf" for term in terms for node in term):
            return signs < 0
        if all(len(term) == 1 and term[0].op == "leaf" for term in terms):
            first = min(terms, key=lambda term: self.node(term[0]).sort_key())
            return terms[first] < 0
        return bool(self.expression(vector).could_extract_minus_sign())


class Writer:
    """Writes values of one Exact.

    symbols   leaf -> the user's symbol; leaves without one keep their names
    zeros     numerators that vanish, by which the shortest form is made shorter
    """

    def __init__(self, exact: Exact, symbols: Mapping[Node, sp.Expr], form: str = "shortest", zeros: Sequence[Any] = ()) -> None:
        self.exact, self.symbols, self.form = exact, symbols, form
        self._expressions: dict[int, sp.Expr] = {}
        self._kinds: dict[int, str] = {}
        self.angles = WrittenAngles(exact, symbols)
        self.letters = Letters(exact, self.angles.opposite)
        self._rows: list[Letter] = []
        self.arranger = Arranger(_Lookup(self))
        self._written: dict[Any, sp.Expr] = {}
        self._factors_below: dict[int, tuple[int, Tree]] = {}
        self._nested: Writer | None = None
        n = len(exact.bases)
        self.bases = [Basis(exact, tuple(tuple(int(i == k) for i in range(n)) for k in range(n)))]
        longest = max((value.num for value in exact.values), key=len, default=None)
        if n > 1 and longest is not None and form == "shortest":
            other = better_basis(exact, self.letters, longest)
            self.bases += [other] if other else []
        self._zeros = relations_in_letters(zeros, self.bases, self.letters) if zeros else []

    # -- letters

    def expression(self, letter: int) -> sp.Expr:
        """Expression of a letter in SymPy."""
        if letter not in self._expressions:
            self._expressions[letter] = self._made(letter)
        return self._expressions[letter]

    def define(self, letter: int, expression: sp.Expr) -> None:
        """Write a letter of the caller's as this."""
        self._expressions[letter] = expression

    def _made(self, letter: int) -> sp.Expr:
        if letter in self.letters.turns:
            name, vector = self.letters.turns[letter]
            return getattr(sp, name)(self.angles.expression(vector))
        if letter in self.letters.below:
            key = self.letters.below[letter]
            if key < 0:
                return self.expression(-1 - key)
            return self.tree_expression(self._below(key)[1])
        if letter in self.exact.leaves:
            return self.angles.node(self.exact.leaves[letter])
        return self._function(self.exact.atoms[letter])

    def _function(self, atom: Atom) -> Any:
        if atom.op == "call":
            intrinsic, *arguments = atom.args
            given = [self._argument(a) for a in arguments]
            if isinstance(intrinsic, UserFunction):
                return intrinsic.applied(given)[atom.item or 0]
            if intrinsic.letters:
                return sp.Function(intrinsic.letters[atom.item or 0])(*given)
            raise UnsupportedExpression("it is computed by a numeric algorithm, without an explicit form; print the matrix and "
                                        "the right side instead")
        return applied(atom.op, [self._argument(a) for a in atom.args])

    def _argument(self, a: Any) -> Any:
        if isinstance(a, Value):
            return self.write(a)
        return self._function(a) if isinstance(a, Atom) else number(a)

    def kind(self, letter: int) -> str:
        """Parameter, position or motion."""
        if letter not in self._kinds:
            self._kinds[letter] = self._kind(letter)
        return self._kinds[letter]

    def _kind(self, letter: int) -> str:
        leaf = self.exact.leaves.get(letter)
        if leaf is not None:
            mask = leaf.args[0]
            return "parameter" if mask == PARAMETER else "motion" if mask & _MOTION else "position"
        if letter in self.letters.below:
            key = self.letters.below[letter]
            return self.kind(-1 - key) if key < 0 else self._kind_of(self.exact.ring.factors[key])
        if letter in self.exact.atoms and self.exact.atoms[letter].op != "call":
            parts = [self._kind_of(a.num) for a in self.exact.atoms[letter].args if isinstance(a, Value)]
            return "parameter" if all(kind == "parameter" for kind in parts) else "position"
        return "position"

    def _kind_of(self, num: Any) -> str:
        kinds = {self.kind(k) for k, degree in enumerate(num.degrees()) if degree} if len(num) else set()
        return "parameter" if kinds <= {"parameter"} else "position"

    # -- values

    def write(self, value: Value, operations: float = math.inf, derived: Callable[[float], tuple[sp.Expr, int]] | None = None
              ) -> sp.Expr:
        """The value in the requested form.

        operations   of the form in which it was derived, before SymPy combines equal terms; derived: makes that form and
                     counts its operations, taking factors out up to so many; it is taken if it is the shortest
        """
        if derived is not None and operations <= len(value.num):
            return derived(math.inf)[0]
        tree = self.tree(value)
        result = _turned_below(self.tree_expression(tree))
        divided_by_sum = any(len(self.exact.ring.factors[k]) > 1 for k, _ in value.under)
        if self.form == "shortest" and divided_by_sum and len(value.num) <= LONG:
            # The shorter way of writing the divisor turns out once signs are taken into it.
            if self._nested is None:
                self._nested = Writer(self.exact, self.symbols, "nested")
            result = min(result, self._nested.write(value), key=sp.count_ops)
        if derived is not None and operations <= LONGER * total(tree)[0]:
            other, count = derived(total(tree)[0])
            # The cost of a tree is nearly the count of SymPy, which takes long.
            if count <= CLOSE * total(tree)[0] and count < sp.count_ops(result):
                return min((other, _taken_out(other)), key=sp.count_ops) if operations > FACTOR_TERMS >= count else other
        return result

    def tree(self, value: Value) -> Tree:
        """The arrangement of a value."""
        form, a = self.form, self.arranger
        if len(value.num) == 0:
            return a.product(0, ())
        if form == "polynomial":
            base = self._over(plain(value.num), value)
            return a.grouped(base, ("position", "motion"), a.expanded) or a.expanded(base)
        if form == "fourier":
            base = plain(value.num)
            series = self._over(fourier(base, self.letters) or base, value)
            return a.grouped(series, ("position",), a.factored) or a.factored(series)
        result = self.representations(value)
        least = min(map(len, result))
        result = sorted([p for p in result if len(p) <= WORSE * least + 4], key=len)
        if least > SHORT:
            result = result[:2]
        else:
            result += [p for p in (halved(p, self.letters) for p in result) if p is not None]
        trees = [tree for p in result for tree in self._arranged(p)]
        if value.under:
            # The denominator below all of it, which leaves factors of the numerator whole.
            (below, sign), = self._over({(): 1}, value).items()
            trees.append(a.times(sign, below, [(self.tree(Value(value.num)), 1)]))
        return min(map(a.signed, trees), key=total)

    def _over(self, p: Polynomial, value: Value) -> Polynomial:
        if not value.under:
            return p
        sign = math.prod(self._below(k)[0] ** n for k, n in value.under)
        return {m: sign * c for m, c in divided(p, value.under, self.exact.ring.factors, self.letters).items()}

    def _below(self, k: int) -> tuple[int, Tree]:
        """1 and how a factor of the ring is written in a denominator, or -1 and how its opposite is, where that is shorter or
        has fewer minus signs."""
        if k not in self._factors_below:
            factor = self.exact.ring.factors[k]
            own = self.tree(Value(factor))
            opposite = self.tree(Value(-factor)) if len(factor) > 1 else own
            least = [(total(tree), str(self.tree_expression(tree)).count("-")) for tree in (own, opposite)]
            self._factors_below[k] = (-1, opposite) if least[1] < least[0] else (1, own)
        return self._factors_below[k]

    def representations(self, value: Value) -> list[Polynomial]:
        """Different polynomials in letters for the same value."""
        num, letters = value.num, self.letters
        base = plain(num)
        result = [base]
        if any(letter in letters.turns for m in base for letter, _ in m):
            others = [basis.plain(basis.of(num), letters) for basis in self.bases]
            if len(num) > LONG:
                result = [contracted(min(others, key=len), letters)]
            else:
                for p in others:
                    result += [p, contracted(p, letters)]
                series = fourier(base, letters)
                if series is not None:
                    result += [series, contracted(series, letters)]
                if len(base) <= SHORT:
                    result.append(contracted(base, letters))
        result += [shortened(p, self._zeros) for p in result if self._zeros]
        if value.under:
            result = [self._over(p, value) for p in result]
            result += self._parts(value)
            result += [with_tangents(p, letters) for p in result]
        unique: dict[frozenset, Polynomial] = {}
        for p in result:
            unique.setdefault(frozenset(p.items()), p)
        return list(unique.values())

    def _parts(self, value: Value) -> list[Polynomial]:
        """num / (f g) as q / g + r / (f g), for each factor that the numerator holds a part of."""
        ring = self.exact.ring
        result = []
        for k, n in value.under:
            factor = ring.factors[k]
            if len(factor) == 1 or n > 1:
                continue
            quotient, rest = divmod(value.num, factor)
            if len(quotient) and len(rest):
                others = tuple(item for item in value.under if item[0] != k)
                p = self._over(contracted(plain(rest), self.letters), value)
                for m, c in self._over(contracted(plain(quotient), self.letters), Value(quotient, others)).items():
                    p[m] = p.get(m, 0) + c
                result.append({m: c for m, c in p.items() if c})
        return result

    def _arranged(self, p: Polynomial) -> list[Tree]:
        a = self.arranger
        if self.form == "factored":
            return [a.factored(p)]
        if self.form == "nested":
            return [a.nested(p)]
        if self.form in _GROUPS:
            return [a.grouped(p, _GROUPS[self.form]) or a.factored(p)]
        best = a.clearly_gathered(p, _STATE) if len(p) > LONG else None
        if best is not None:
            return [best]
        trees = [a.nested(p), *[a.grouped(p, kinds) for kinds in (_GATHERED if len(p) <= LONG else _GATHERED_LONG)]]
        if len(p) <= SHORT:
            trees.append(a.expanded(p))
        return [tree for tree in trees if tree is not None]

    # -- SymPy

    def tree_expression(self, tree: Tree) -> sp.Expr:
        """A tree in SymPy."""
        if isinstance(tree, Sum):
            return sp.Add(*[self.tree_expression(term) for term in tree.terms])
        return _times(number(tree.number), [self._power(base, n) for base, n in tree.factors])

    def _power(self, base: int | Sum, n: int) -> sp.Expr:
        if isinstance(base, int):
            e = self.expression(base)
        else:
            e = self._written.get(base)
            if e is None:
                e = self._written[base] = self.tree_expression(base)
        n = -n if isinstance(base, int) and base in self.letters.below else n
        return e if n == 1 else sp.Pow(e, n)


class _Lookup(dict[int, Letter]):
    """Letters by number, as they come."""

    def __init__(self, writer: Writer) -> None:
        super().__init__()
        # There is no cycle, so that all that a quantity took goes once it is written: the collector takes longer to find it.
        self.writer: Writer = weakref.proxy(writer)

    def __missing__(self, k: int) -> Letter:
        e = self.writer.expression(k)
        multiples = 0
        if k in self.writer.letters.turns and e.args:  # the sine of a decimal number is one
            multiples = sum(MULTIPLE for a in sp.Add.make_args(e.args[0]) if a.as_coeff_Mul()[0] not in (1, -1))
        length = 1 if e.is_Symbol else len(str(e))
        self[k] = Letter(int(sp.count_ops(e)), length + multiples, self.writer.kind(k), k in self.writer.letters.below)
        return self[k]


def _turned_below(e: sp.Expr) -> sp.Expr:
    """-a / (b - c) as a / (c - b)."""
    coefficient, factors = e.as_coeff_mul()
    if not e.is_Mul or not coefficient.is_negative:
        return e
    for factor in sorted(factors, key=sp.default_sort_key):
        base, exponent = factor.as_base_exp()
        if base.is_Add and exponent.is_Integer and exponent < 0 and exponent % 2:
            turned = sp.Pow(sp.Add(*[-term for term in base.args]), exponent)
            other = _times(-coefficient, [turned if f is factor else f for f in factors])
            if sp.count_ops(other) < sp.count_ops(e):
                return other
    return e


def _times(coefficient: Any, parts: list[sp.Expr]) -> sp.Expr:
    """A product that a number is not multiplied into."""
    if coefficient == 1:
        return sp.Mul(*parts)
    if len(parts) == 1 and parts[0].is_Add:
        if coefficient == -1:
            return sp.Add(*[-term for term in parts[0].args])
        return sp.Mul(coefficient, parts[0], evaluate=False)
    return sp.Mul(coefficient, *parts)


def written(entries: Sequence[Any], symbols: Mapping[Node, sp.Expr], form: str = "shortest", bound: int | None = None,
            unit_vectors: Sequence[Sequence[Node]] = (), zeros: Sequence[Any] = ()) -> list[sp.Expr]:
    """Entries (nodes and numbers) in SymPy, each in the requested form; unit_vectors: leaves whose squares add up to one;
    zeros: entries that vanish where the forms are to hold.

    Raises SymdynError for an unknown form, TooLarge beyond the bound on terms, UnsupportedExpression for what has no explicit
    form."""
    if form not in FORMS:
        raise SymdynError(f"the form {shown(form)} was asked for; there are {', '.join(FORMS)}")
    exact = Exact([*entries, *zeros], BOUND if bound is None else bound, unit_vectors, positive=not_negative(symbols))
    vanishing = [value.num for value in exact.values[len(entries):]]
    ideal = Ideal(exact.ring, vanishing) if zeros else None
    del exact.values[len(entries):]
    terms = sum(len(value.num) for value in exact.values)
    if terms > TERMS:
        raise TooLarge(f"it has {terms:,} terms, above the bound of {TERMS:,} for printing")
    writer = Writer(exact, symbols, form, vanishing)
    sizes = written_out(entries) if form == "shortest" else {}
    known: dict[str, sp.Expr] = {}
    result = []
    for entry, value in zip(entries, exact.values):
        if ideal is not None and ideal.contains(value.num):
            value = exact.ring.zero
        key = exact.ring.key(value)
        if key not in known:
            opposite = known.get(exact.ring.key(exact.ring.neg(value)))
            if opposite is not None and not opposite.is_Add:
                known[key] = -opposite
            else:
                size = sizes.get(entry, math.inf) if isinstance(entry, Node) else math.inf
                derived = partial(_as_derived, entry, symbols, size) if size < math.inf else None
                known[key] = writer.write(value, size, derived)
        result.append(known[key])
    return result


def shortest(value: Any, form: str = "shortest") -> Any:
    """An expression or matrix of SymPy in the requested form; its symbols are taken as real.

    Raises as `written`, and UnsupportedExpression for functions that have no counterpart on a tape."""
    entries, symbols = recorded(value if isinstance(value, sp.MatrixBase) else [value])
    result = written(entries, symbols, form)
    return sp.Matrix(*value.shape, result) if isinstance(value, sp.MatrixBase) else result[0]


def explicit(output: Output, symbols: Mapping[Node, sp.Expr], form: str = "shortest", zeros: Sequence[Any] = (),
             unit_vectors: Sequence[Sequence[Node]] = ()) -> Any:
    """An output of a tape as explicit SymPy: a scalar expression, or a matrix (column for a vector); zeros: entries that vanish
    where it is to hold; unit_vectors as for `written`. Raises as `written`."""
    entries = written(output.entries, symbols, form, unit_vectors=unit_vectors, zeros=zeros)
    if output.shape == ():
        return entries[0]
    rows, columns = output.shape if len(output.shape) == 2 else (output.shape[0], 1)
    return sp.Matrix(rows, columns, entries)


def apart(output: Output, symbols: Mapping[Node, sp.Expr], zeros: Sequence[Any] = ()) -> Any:
    """An output as `explicit` gives it, entry by entry, those of few operations first, until the bounds on terms are reached;
    from there on as derived."""
    sizes = written_out(output.entries)
    result: list[Any] = [None] * len(output.entries)
    left = TERMS
    for k in sorted(range(len(result)), key=lambda k: sizes.get(output.entries[k], 0)):
        entry = output.entries[k]
        try:
            terms = sum(len(value.num) for value in Exact([entry], positive=not_negative(symbols)).values)
            if terms > left:
                raise TooLarge(f"it has {terms:,} terms")
            result[k], = written([entry], symbols, zeros=zeros)
            left -= terms
        except (TooLarge, ZeroDivisionError):
            result[k] = expand(Output.of("entry", entry), symbols)
    if output.shape == ():
        return result[0]
    rows, columns = output.shape if len(output.shape) == 2 else (output.shape[0], 1)
    return sp.Matrix(rows, columns, result)


def not_negative(symbols: Mapping[Node, sp.Expr]) -> set[Node]:
    """Leaves whose symbols are assumed not to be negative."""
    return {leaf for leaf, symbol in symbols.items() if symbol.is_nonnegative}


def written_out(entries: Sequence[Any]) -> dict[Node, int]:
    """Operations of each step written out."""
    sizes: dict[Node, int] = {}
    for node in reachable(entries):
        own = node.op not in ("leaf", "neg", "guard", "item")
        sizes[node] = sum([sizes[a] for a in node.args if isinstance(a, Node)]) + own
    return sizes


def _taken_out(e: Any, numbers: bool = False) -> Any:
    """Factors of several terms of a sum taken out of these: a b + a**2 c + d as a (b + a c) + d; numbers: common ones too."""
    if not e.args or not e.has(sp.Add):
        return e
    e = e.func(*[_taken_out(a, numbers) for a in e.args])
    if not e.is_Add:
        return e
    return sp.Add(*[sp.Mul(*[number, *[sp.Pow(b, n) for b, n in powers.items()]])
                    for number, powers in _gathered([_powers(term) for term in e.args], numbers)])


def _powers(term: Any) -> tuple[Any, dict[Any, Any]]:
    """The number of a product and its factors with their rational exponents."""
    number, rest = term.as_coeff_Mul()
    powers: dict[Any, Any] = {}
    for factor in sp.Mul.make_args(rest):
        base, exponent = factor.as_base_exp()
        if not exponent.is_Rational:
            base, exponent = factor, sp.S.One
        powers[base] = powers.get(base, 0) + exponent
    powers.pop(sp.S.One, None)
    return number, powers


def _gathered(terms: list[tuple[Any, dict[Any, Any]]], numbers: bool) -> list[tuple[Any, dict[Any, Any]]]:
    """Terms with what stands in most of them taken out, again and again."""
    counts: dict[tuple[Any, bool], int] = {}
    for _, powers in terms:
        for base, exponent in powers.items():
            key = base, bool(exponent > 0)
            counts[key] = counts.get(key, 0) + 1
    most = max(counts.values(), default=0)
    if most < 2:
        return terms
    common, above = min([key for key, n in counts.items() if n == most],
                        key=lambda key: (not key[1], sp.default_sort_key(key[0])))
    having: list[tuple[Any, dict[Any, Any]]] = []
    others: list[tuple[Any, dict[Any, Any]]] = []
    for term in terms:
        (having if common in term[1] and bool(term[1][common] > 0) == above else others).append(term)
    least = min([powers[common] for _, powers in having], key=abs)
    inside = [(number, {base: n - least if base == common else n for base, n in powers.items() if base != common or n != least})
              for number, powers in having]
    total = sp.Add(*[sp.Mul(number, *[sp.Pow(b, n) for b, n in powers.items()]) for number, powers in _gathered(inside, numbers)])
    number, powers = _powers(_number_out(total) if numbers else total)
    powers[common] = powers.get(common, 0) + least
    return [(number, powers), *_gathered(others, numbers)]


def _number_out(e: Any) -> Any:
    """The number common to the terms of a sum before it, and the sign where all have a minus."""
    if not e.is_Add or e.has(sp.Float):
        return e
    number, rest = e.primitive()
    if all(term.as_coeff_Mul()[0].is_negative for term in rest.args):
        number, rest = -number, sp.Add(*[-term for term in rest.args])
    return e if number == 1 else sp.Mul(number, rest, evaluate=False)


def _is_square(value: Any) -> bool:
    return isinstance(value, Node) and value.op == "mul" and value.args[0] is value.args[1]


def _is_root_of_square(e: Any) -> bool:
    return bool(e.is_Pow and abs(e.exp) == sp.Rational(1, 2) and e.base.is_Pow and e.base.exp == 2)


def _as_derived(entry: Node, symbols: Mapping[Node, sp.Expr], size: float, least: float) -> tuple[sp.Expr, int]:
    """As it stands on the tape, and its operations; where these are few and come near to `least`, those of another form, common
    factors are taken out of sums if that is shorter."""
    result = expand(Output.of("entry", entry), symbols)
    if any(node.op == "sqrt" and _is_square(node.args[0]) for node in reachable([entry])):
        result = result.replace(_is_root_of_square, lambda root: sp.Abs(root.base.base) ** (2 * root.exp))
    count = int(sp.count_ops(result))
    if size > FACTOR_TERMS or count > NEAR * least:
        return result, count
    taken, other = _taken_out(result), _taken_out(result, numbers=True)
    forms = [(result, count), *map(_counted, [e for e in dict.fromkeys((other, _number_out(other), taken)) if e != result])]
    return min(forms, key=lambda form: form[1])


def _counted(e: sp.Expr) -> tuple[sp.Expr, int]:
    return e, int(sp.count_ops(e))
