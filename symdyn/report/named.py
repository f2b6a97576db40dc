"""Long quantities with named intermediates: constants of the mechanism, short sines and cosines, what stands in several places.

Constants are the polynomials in parameters that multiply the functions of coordinates and speeds; they are named over all entries
together, so that what stands in several entries is visible as the same. Where that fills more than a page, the steps of the
derivation are the intermediates, if they are shorter: the recursion from link to link.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from fractions import Fraction
from typing import Any, NamedTuple

import sympy as sp

from symdyn.exact.arrange import Arranger, Letter, Monomial, Polynomial, integer, multiplied, stripped, total
from symdyn.exact.dimensions import Dimension, text, units_of_expressions
from symdyn.exact.represent import plain
from symdyn.exact.ring import TooLarge, Value
from symdyn.exact.shortest import Writer, not_negative
from symdyn.exact.walk import Exact
from symdyn.model.symbols import symbols_of
from symdyn.report.shorthand import Shorthand
from symdyn.tape.node import PARAMETER, Node
from symdyn.tape.sympy_bridge import expand
from symdyn.tape.tape import Output, reachable

# Expressions with fewer operations are written out where they stand.
WORTH_A_NAME = 2
# Operations of a page, above which the steps of the derivation are an alternative; terms above which they are the only one.
PAGE, CLOSED = 600, 1200
# Terms of a product on the way to it, and how many times as many terms a fraction counts as.
LARGEST, FRACTION = 20_000, 10
# Base parameters of which a constant may be the sum.
MANY = 3
_PLAIN = ("leaf", "neg", "sin", "cos", "guard", "call", "lt", "le", "gt", "ge", "eq", "ne", "and", "or", "not", "pi")
_LETTERS = {"w": "angular velocity", "v": "velocity", "al": "angular acceleration", "a": "acceleration", "f": "force",
            "n": "moment", "h": "first moment", "I": "inertia"}
CONSTANT, TURN, PRODUCT = "constant of the mechanism", "{} of {}", "stands in several places"


class Step(NamedTuple):
    """An intermediate: its symbol, what it is in terms of those before and of the user's symbols, what it means, and its unit;
    "?" where that is not known."""

    symbol: sp.Symbol
    expression: sp.Expr
    meaning: str
    unit: str = "?"


def with_intermediates(output: Output, symbols: Mapping[Node, sp.Expr], labels: Mapping[Node, str] | None = None,
                       base: Mapping[str, Any] | None = None,
                       units: Mapping[sp.Basic, Dimension | None] | None = None) -> tuple[Any, list[Step]]:
    """An output of a tape as SymPy in named intermediates, and these in an order to read.

    labels   what the derivation calls its steps; base: base parameters by name, nodes or numbers; units: of the symbols
    Raises UnsupportedExpression for what has no explicit form, ZeroDivisionError where an entry divides by zero."""
    result = None
    try:
        values = dict(base or {})
        exact = Exact([*output.entries, *values.values()], LARGEST, positive=not_negative(symbols))
        own = exact.values[:len(output.entries)]
        if sum(len(value.num) * (FRACTION if value.under else 1) for value in own) <= CLOSED:
            named = dict(zip(values, exact.values[len(own):], strict=True))
            result = _in_closed_form(exact, own, named, symbols)
    except TooLarge:
        pass
    if result is None or _operations(result) > PAGE:
        steps = _of_derivation(output, symbols, labels or {})
        result = steps if result is None else min((result, steps), key=_operations)
    entries, found = result[0], _with_units(result[1], units or {})
    if output.shape == ():
        return entries[0], found
    rows, columns = output.shape if len(output.shape) == 2 else (output.shape[0], 1)
    return sp.Matrix(rows, columns, entries), found


def _operations(result: tuple[list[sp.Expr], list[Step]]) -> int:
    entries, steps = result
    return int(sum(map(sp.count_ops, entries)) + sum(sp.count_ops(step.expression) for step in steps))


def _in_closed_form(exact: Exact, values: Sequence[Value], base: Mapping[str, Value], symbols: Mapping[Node, sp.Expr],
                    ) -> tuple[list[sp.Expr], list[Step]]:
    """Entries as polynomials with constants, sines and cosines, and what stands in several places under names."""
    writer = Writer(exact, symbols)
    polynomials = [min(writer.representations(value), key=len) if len(value.num) else {} for value in values]
    combined = _BaseParameters(base, writer)
    constants: dict[tuple[Monomial, frozenset], int] = {}
    first = 1 + max((letter for p in polynomials for m in p for letter, _ in m), default=0)
    reduced = [_in_constants(p, writer, constants, first) for p in polynomials]
    arranger = Arranger(_Letters(writer, first))
    free = set().union(*[symbols_of(writer.expression(letter)) for p in polynomials for m in p for letter, _ in m])
    names = _names("h", free)
    steps: list[Step] = []
    for common, q in constants:
        p = {multiplied(m, common): c for m, c in q}
        symbol = next(names)
        steps.append(Step(symbol, writer.tree_expression(writer.arranger.nested(p)), combined.meaning(p)))
        writer.define(first + len(steps) - 1, symbol)
    entries = []
    for p in reduced:
        tree = min((arranger.signed(tree) for tree in _arrangements(arranger, p)), key=total)
        entries.append(writer.tree_expression(tree))
    short = Shorthand(entries)
    turns = [Step(symbol, f, TURN.format("sine" if isinstance(f, sp.sin) else "cosine", f.args[0]))
             for f, symbol in short.symbols.items()]
    products, entries = _repeated([short.short(e) for e in entries], _names("p", free))
    return entries, [*steps, *turns, *[Step(symbol, e, PRODUCT) for symbol, e in products]]


def _of_derivation(output: Output, symbols: Mapping[Node, sp.Expr], labels: Mapping[Node, str],
                   ) -> tuple[list[sp.Expr], list[Step]]:
    """Entries in the steps of the derivation that stand in several places: constants, sines and cosines, all others in order."""
    nodes = reachable(output.entries)
    uses: dict[Node, int] = {}
    constant: dict[Node, bool] = {}
    angles = set(reachable([node.args[0] for node in nodes if node.op in ("sin", "cos", "tan")]))
    for node in nodes:
        inside = [a for a in node.args if isinstance(a, Node)]
        for a in inside:
            uses[a] = uses.get(a, 0) + 1
        constant[node] = node.args[0] == PARAMETER if node.op == "leaf" else all(constant[a] for a in inside)
    free = {symbols.get(node, sp.Symbol(node.args[1])) for node in nodes if node.op == "leaf"}
    names = {True: _names("h", free), False: _names("p", free)}
    named: dict[Node, sp.Symbol] = {}
    written: list[tuple[bool, sp.Symbol, sp.Expr, str]] = []
    for node in nodes:
        if uses.get(node, 0) < 2 or node in angles or node.op in _PLAIN:
            continue
        e = expand(Output.of("step", node), symbols, named)
        if sp.count_ops(e) >= WORTH_A_NAME:
            symbol = named[node] = next(names[constant[node]])
            written.append((constant[node], symbol, e, _called(labels.get(node, ""))))
    entries = list(expand(Output("entries", (len(output.entries),), output.entries), symbols, named))
    short = Shorthand([*entries, *[e for _, _, e, _ in written]])
    turns = [Step(symbol, f, TURN.format("sine" if isinstance(f, sp.sin) else "cosine", f.args[0]))
             for f, symbol in short.symbols.items()]
    steps = {kind: [Step(symbol, short.short(e), meaning or (CONSTANT if kind else PRODUCT))
                    for own, symbol, e, meaning in written if own == kind] for kind in (True, False)}
    return [short.short(e) for e in entries], [*steps[True], *turns, *steps[False]]


def _called(label: str) -> str:
    """Meaning of a label of the derivation: "w3_x" is the angular velocity of link 3, x; "" if it says nothing."""
    result = re.fullmatch(r"([A-Za-z]+?)(\d+)_([xyz]+)", label)
    return f"{_LETTERS[result[1]]} of link {result[2]}, {result[3]}" if result and result[1] in _LETTERS else ""


class _BaseParameters:
    """Polynomials in parameters as sums of base parameters.

    Each base parameter has a term that stands in no other; what holds it holds the base parameter.
    """

    def __init__(self, base: Mapping[str, Value], writer: Writer) -> None:
        polynomials = {name: plain(value.num) for name, value in base.items() if len(value.num) and not value.under}
        counts: dict[Monomial, int] = {}
        for p in polynomials.values():
            for m in p:
                counts[m] = counts.get(m, 0) + 1
        self.rows: list[tuple[str, Polynomial, Monomial]] = []
        for name, p in polynomials.items():
            # The shortest of them: an inertia or a product of a mass and a length, which other products hold as a factor.
            leading = min((m for m in p if counts[m] == 1), key=lambda m: (sum(n for _, n in m), m), default=None)
            if leading is not None:
                self.rows.append((name, p, leading))
        # Long ones first: their terms may hold the short ones.
        self.rows.sort(key=lambda row: (-len(row[1]), -sum(n for _, n in row[2]), row[0]))
        self.writer = writer

    def meaning(self, p: Polynomial) -> str:
        """Constant in base parameters, where it is a sum of few."""
        left = dict(p)
        result: list[sp.Expr] = []
        for name, own, leading in self.rows:
            for m in [m for m in left if _divides(leading, m)]:
                if m not in left or len(result) > MANY:
                    continue
                factor = _quotient(m, leading)
                scale = Fraction(left[m]) / own[leading]
                after = dict(left)
                for other, c in own.items():
                    k = multiplied(other, factor)
                    after[k] = integer(after.get(k, 0) - scale * c)
                    if not after[k]:
                        del after[k]
                if len(after) < len(left):
                    left = after
                    outside = self.writer.tree_expression(self.writer.arranger.product(integer(scale), factor))
                    result.append(sp.Mul(outside, sp.Symbol(name), evaluate=bool(outside.is_Number)))
        if left or not result or len(result) > MANY:
            return CONSTANT
        return f"{CONSTANT}: {sp.Add(*result)}, of the base parameters"


def _divides(a: Monomial, b: Monomial) -> bool:
    powers = dict(b)
    return all(powers.get(letter, 0) >= n for letter, n in a)


def _quotient(a: Monomial, b: Monomial) -> Monomial:
    powers = dict(b)
    return tuple((letter, n - powers.get(letter, 0)) for letter, n in a if n > powers.get(letter, 0))


def _with_units(steps: list[Step], units: Mapping[sp.Basic, Dimension | None]) -> list[Step]:
    """The intermediates with their units, which follow from those before."""
    known = dict(units)
    result = []
    for step in steps:
        known[step.symbol], = units_of_expressions([step.expression], known)
        result.append(step._replace(unit=text(known[step.symbol])))
    return result


def _repeated(entries: list[sp.Expr], names: Iterator[sp.Symbol]) -> tuple[list[tuple[sp.Symbol, sp.Expr]], list[sp.Expr]]:
    """Names for expressions that stand in several places and have two operations at least, and the entries in these names."""
    result, entries = sp.cse(entries, symbols=sp.numbered_symbols("p", cls=sp.Dummy), order="canonical")
    written: dict[sp.Symbol, sp.Expr] = {}
    products = []
    for symbol, e in result:
        e = e.xreplace(written)
        if sp.count_ops(e) >= WORTH_A_NAME:
            written[symbol] = next(names)
            products.append((written[symbol], e))
        else:
            written[symbol] = e
    return products, [e.xreplace(written) for e in entries]


def _in_constants(p: Polynomial, writer: Writer, constants: dict[tuple[Monomial, frozenset], int], first: int) -> Polynomial:
    """The polynomial with letters, from `first` on, for the polynomials in parameters that stand in it."""
    rows: dict[Monomial, Polynomial] = {}
    for m, c in p.items():
        own = tuple([item for item in m if writer.kind(item[0]) != "parameter"])
        rows.setdefault(own, {})[tuple([item for item in m if writer.kind(item[0]) == "parameter"])] = c
    result: Polynomial = {}
    for own, row in sorted(rows.items()):
        number, common, q = stripped(row)
        if len(q) == 1 and sum(n for _, n in common) <= 1:
            result[multiplied(own, common)] = integer(number)
            continue
        letter = first + constants.setdefault((common, frozenset(q.items())), len(constants))
        result[multiplied(own, ((letter, 1),))] = integer(number)
    return result


def _arrangements(arranger: Arranger, p: Polynomial) -> Iterator[Any]:
    yield arranger.nested(p)
    for kinds in (("motion",), ("position",), ("parameter",)):
        tree = arranger.grouped(p, kinds)
        if tree is not None:
            yield tree


class _Letters(dict[int, Letter]):
    """Letters of a writer, where sines, cosines and constants have names."""

    def __init__(self, writer: Writer, first: int) -> None:
        super().__init__()
        self.writer, self.first = writer, first

    def __missing__(self, k: int) -> Letter:
        if k >= self.first:
            self[k] = Letter(0, 2, "parameter")
        elif k in self.writer.letters.turns:
            self[k] = Letter(0, 2, "position")
        else:
            self[k] = self.writer.arranger.letters[k]
        return self[k]


def _names(letter: str, taken: set[sp.Symbol]) -> Iterator[sp.Symbol]:
    """letter_1, letter_2, ... without names that are taken."""
    while any(s.name.startswith(f"{letter}_") for s in taken):
        letter += letter[0]
    return (sp.Symbol(f"{letter}_{k}", real=True) for k in range(1, 10**6))


