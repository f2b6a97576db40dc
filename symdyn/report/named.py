"""Long quantities with named intermediates: constants of the mechanism, short sines and cosines, what stands in several places.

Constants are the polynomials in parameters that multiply the functions of coordinates and speeds; they are named over all entries
together, so that what stands in several entries is visible as the same.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

import sympy as sp

from symdyn.exact.arrange import Arranger, Letter, Monomial, Polynomial, integer, multiplied, stripped, total
from symdyn.exact.dimensions import Dimension, text, units_of_expressions
from symdyn.exact.shortest import Writer, not_negative
from symdyn.exact.walk import Exact
from symdyn.model.symbols import symbols_of
from symdyn.report.shorthand import Shorthand
from symdyn.tape.node import Node
from symdyn.tape.tape import Output

# What has fewer operations is written out where it stands.
WORTH_A_NAME = 2
CONSTANT, TURN, PRODUCT = "constant of the mechanism", "{} of {}", "stands in several places"


class Step(NamedTuple):
    """An intermediate: its symbol, what it is in terms of those before and of the user's symbols, what it means, and its unit;
    "?" where that is not known."""

    symbol: sp.Symbol
    expression: sp.Expr
    meaning: str
    unit: str = "?"


def with_intermediates(output: Output, symbols: Mapping[Node, sp.Expr], units: Mapping[sp.Basic, Dimension | None] | None = None,
                       ) -> tuple[Any, list[Step]]:
    """An output of a tape as SymPy in named intermediates, and these in an order to read.

    units   of the symbols

    Raises TooLarge beyond the bound on terms, UnsupportedExpression for what has no explicit form."""
    exact = Exact(output.entries, positive=not_negative(symbols))
    writer = Writer(exact, symbols)
    polynomials = [min(writer.representations(value), key=len) if len(value.num) else {} for value in exact.values]
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
        steps.append(Step(symbol, writer.tree_expression(writer.arranger.nested(p)), CONSTANT))
        writer.define(first + len(steps) - 1, symbol)
    entries = []
    for p in reduced:
        tree = min((arranger.signed(tree) for tree in _arrangements(arranger, p)), key=total)
        entries.append(writer.tree_expression(tree))
    short = Shorthand(entries)
    turns = [Step(symbol, f, TURN.format("sine" if isinstance(f, sp.sin) else "cosine", f.args[0]))
             for f, symbol in short.symbols.items()]
    products, entries = _repeated([short.short(e) for e in entries], _names("p", free))
    steps += [*turns, *[Step(symbol, e, PRODUCT) for symbol, e in products]]
    steps = _with_units(steps, units or {})
    if output.shape == ():
        return entries[0], steps
    rows, columns = output.shape if len(output.shape) == 2 else (output.shape[0], 1)
    return sp.Matrix(rows, columns, entries), steps


def _with_units(steps: list[Step], units: Mapping[sp.Basic, Dimension | None]) -> list[Step]:
    """The intermediates with their units, which follow from those before."""
    known = dict(units)
    result = []
    for step in steps:
        known[step.symbol], = units_of_expressions([step.expression], known)
        result.append(step._replace(unit=text(known[step.symbol])))
    return result


def _repeated(entries: list[sp.Expr], names: Iterator[sp.Symbol]) -> tuple[list[tuple[sp.Symbol, sp.Expr]], list[sp.Expr]]:
    """What stands in several places under names, where it has two operations at least, and the entries in these."""
    found, entries = sp.cse(entries, symbols=sp.numbered_symbols("p", cls=sp.Dummy), order="canonical")
    written: dict[sp.Symbol, sp.Expr] = {}
    products = []
    for symbol, e in found:
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


