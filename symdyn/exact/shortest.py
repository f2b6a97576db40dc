"""The shortest way to write exact values, as SymPy expressions in the user's symbols.

For each entry the sets of letters of symdyn.exact.represent and the arrangements of symdyn.exact.arrange are tried, and the one
of the least cost is taken (see arrange): polynomial, Fourier, factored, gathered by speeds, by parameters, by functions of the
angles, nested. Nothing depends on time, hash seeds or the machine.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from fractions import Fraction
from typing import Any

import sympy as sp

from symdyn.errors import SymdynError, UnsupportedExpression
from symdyn.exact.arrange import Arranger, Letter, Polynomial, Product, Sum, Tree, total
from symdyn.exact.represent import Basis, Letters, better_basis, contracted, fourier, plain
from symdyn.exact.ring import Value
from symdyn.exact.walk import Atom, Exact
from symdyn.shown import shown
from symdyn.tape.external import UserFunction
from symdyn.tape.node import ACCELERATION, INPUT, PARAMETER, SEED, SPEED, Node
from symdyn.tape.sympy_bridge import applied, number

FORMS = ("shortest", "polynomial", "fourier", "factored", "speeds", "parameters", "angles", "nested")
_GROUPS = {"speeds": ("motion",), "parameters": ("parameter",), "angles": ("position",)}
_MOTION = SPEED | ACCELERATION | INPUT | SEED
# Representations with this many times the terms of the shortest one are not arranged; longer polynomials are only nested, in the
# two shortest representations.
WORSE, SHORT = 1.5, 25


class Writer:
    """Writes values of one Exact.

    symbols   leaf -> the user's symbol; leaves without one keep their names
    """

    def __init__(self, exact: Exact, symbols: Mapping[Node, sp.Expr], form: str = "shortest") -> None:
        self.exact, self.symbols, self.form = exact, symbols, form
        self._expressions: dict[int, sp.Expr] = {}
        self._angles: dict[tuple[int, ...], sp.Expr] = {}
        self._kinds: dict[int, str] = {}
        self.letters = Letters(exact, self._opposite)
        self._rows: list[Letter] = []
        self.arranger = Arranger(_Lookup(self))
        self._written: dict[Any, sp.Expr] = {}
        n = len(exact.bases)
        self.bases = [Basis(exact, tuple(tuple(int(i == k) for i in range(n)) for k in range(n)))]
        longest = max((value.num for value in exact.values if value is not None), key=len, default=None)
        if n > 1 and longest is not None and form == "shortest":
            other = better_basis(exact, self.letters, longest)
            self.bases += [other] if other else []

    # -- letters

    def _angle(self, vector: tuple[int, ...]) -> sp.Expr:
        if vector not in self._angles:
            total: dict[Any, Fraction] = {}
            for k, n in enumerate(vector):
                for term, factor in self.exact.bases[k].items() if n else ():
                    total[term] = total.get(term, Fraction(0)) + n * factor
            self._angles[vector] = sp.Add(*[number(factor) * sp.Mul(*[self._node(node) for node in term])
                                            for term, factor in total.items() if factor])
        return self._angles[vector]

    def _node(self, node: Node) -> sp.Expr:
        """What stands in an angle: a symbol, or something that the angle cannot be taken apart at."""
        if node.op == "leaf":
            return self.symbols.get(node, sp.Symbol(node.args[1]))
        from symdyn.tape.sympy_bridge import expand
        from symdyn.tape.tape import Output

        return expand(Output.of("angle", node), self.symbols)

    def _opposite(self, vector: tuple[int, ...]) -> bool:
        return bool(self._angle(vector).could_extract_minus_sign())

    def expression(self, letter: int) -> sp.Expr:
        """What a letter is in SymPy."""
        if letter not in self._expressions:
            self._expressions[letter] = self._made(letter)
        return self._expressions[letter]

    def _made(self, letter: int) -> sp.Expr:
        if letter in self.letters.turns:
            name, vector = self.letters.turns[letter]
            return getattr(sp, name)(self._angle(vector))
        if letter in self.exact.leaves:
            return self._node(self.exact.leaves[letter])
        return self._function(self.exact.atoms[letter])

    def _function(self, atom: Atom) -> Any:
        if atom.op == "call":
            kernel, *arguments = atom.args
            given = [self._argument(a) for a in arguments]
            if isinstance(kernel, UserFunction):
                return kernel.applied(given)[atom.item]
            if kernel.letters:
                return sp.Function(kernel.letters[atom.item])(*given)
            raise UnsupportedExpression("it is computed by a numeric algorithm, without an explicit form; print the matrix and "
                                        "the right side instead")
        return applied(atom.op, [self._argument(a) for a in atom.args])

    def _argument(self, a: Any) -> Any:
        if isinstance(a, Value):
            return self.write(a)
        return self._function(a) if isinstance(a, Atom) else number(a)

    def kind(self, letter: int) -> str:
        """Parameter, position or motion."""
        leaf = self.exact.leaves.get(letter)
        if leaf is None:
            return "position"
        mask = leaf.args[0]
        return "parameter" if mask == PARAMETER else "motion" if mask & _MOTION else "position"

    # -- values

    def write(self, value: Value) -> sp.Expr:
        """The value in the form asked for."""
        if not value.under:
            return self.tree_expression(self.tree(value.num))
        above = self.tree(value.num)
        below = [(self.tree(self.exact.ring.factors[k]), n) for k, n in value.under]
        return self._quotient(above, below)

    def _quotient(self, above: Tree, below: Sequence[tuple[Tree, int]]) -> sp.Expr:
        coefficient = Fraction(1)
        parts: list[sp.Expr] = []
        if isinstance(above, Product):
            coefficient *= above.number
            parts += [self._power(base, n) for base, n in above.factors]
        else:
            parts.append(self.tree_expression(above))
        for tree, n in below:
            if isinstance(tree, Product):
                coefficient /= tree.number ** n
                parts += [self._power(base, -n * m) for base, m in tree.factors]
            else:
                parts.append(sp.Pow(self.tree_expression(tree), -n))
        return _times(number(coefficient), parts)

    def tree(self, num: Any) -> Tree:
        """The arrangement of a numerator or factor."""
        form, letters = self.form, self.letters
        if len(num) == 0:
            return self.arranger.product(Fraction(0), ())
        base = plain(num)
        if form == "polynomial":
            return self.arranger.grouped(base, ("position", "motion"), self.arranger.expanded) or self.arranger.expanded(base)
        if form == "fourier":
            series = fourier(base, letters)
            if series is None:
                series = base
            return self.arranger.grouped(series, ("position",), self.arranger.factored) or self.arranger.factored(series)
        found = self._representations(num, base)
        least = min(map(len, found))
        found = sorted([p for p in found if len(p) <= WORSE * least + 4], key=len)
        if least > SHORT:
            found = found[:2]
        return min((tree for p in found for tree in self._arranged(p)), key=total)

    def _representations(self, num: Any, base: Polynomial) -> list[Polynomial]:
        """Different polynomials in letters for the same value."""
        found = [base]
        if any(letter in self.letters.turns for m in base for letter, _ in m):
            for basis in self.bases:
                other = basis.of(num)
                p = basis.plain(other, self.letters)
                found += [p, contracted(p, self.letters)]
            if len(base) <= SHORT:
                found.append(contracted(base, self.letters))
            series = fourier(base, self.letters)
            if series is not None:
                found += [series, contracted(series, self.letters)]
        unique: dict[frozenset, Polynomial] = {}
        for p in found:
            unique.setdefault(frozenset(p.items()), p)
        return list(unique.values())

    def _arranged(self, p: Polynomial) -> list[Tree]:
        a = self.arranger
        if self.form == "factored":
            return [a.factored(p)]
        if self.form == "nested":
            return [a.nested(p)]
        if self.form in _GROUPS:
            return [a.grouped(p, _GROUPS[self.form]) or a.factored(p)]
        if len(p) > SHORT:
            return [a.nested(p)]
        trees: list[Tree | None] = [a.nested(p), a.expanded(p)]
        for kinds in (("motion",), ("parameter",), ("position",), ("motion", "position")):
            trees.append(a.grouped(p, kinds))
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
        return e if n == 1 else sp.Pow(e, n)


class _Lookup(Sequence[Letter]):
    """Letters by number, as they come."""

    def __init__(self, writer: Writer) -> None:
        self.writer = writer
        self.known: dict[int, Letter] = {}

    def __getitem__(self, k: Any) -> Any:
        letter = self.known.get(k)
        if letter is None:
            e = self.writer.expression(k)
            multiples = 0
            if k in self.writer.letters.turns:
                multiples = sum(3 for a in sp.Add.make_args(e.args[0]) if a.as_coeff_Mul()[0] not in (1, -1))
            length = 1 if e.is_Symbol else len(str(e))
            letter = self.known[k] = Letter(int(sp.count_ops(e)), length + multiples, self.writer.kind(k))
        return letter

    def __len__(self) -> int:
        return len(self.writer.letters.turns) + len(self.writer.exact.leaves)


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
            ) -> list[sp.Expr]:
    """Entries (nodes and numbers) in SymPy, each in the form asked for.

    Raises SymdynError for an unknown form, TooLarge beyond the bound on terms, UnsupportedExpression for what has no explicit
    form."""
    if form not in FORMS:
        raise SymdynError(f"the form {shown(form)} was asked for; there are {', '.join(FORMS)}")
    exact = Exact(entries) if bound is None else Exact(entries, bound)
    writer = Writer(exact, symbols, form)
    known: dict[str, sp.Expr] = {}
    result = []
    for value in exact.values:
        key = exact.ring.key(value)
        if key not in known:
            opposite = known.get(exact.ring.key(exact.ring.neg(value)))
            if opposite is not None and not opposite.is_Add:
                known[key] = -opposite
            else:
                known[key] = writer.write(value)
        result.append(known[key])
    return result
