r"""Short names of sines and cosines, as robotics writes them: s_1 for sin q_1, c_{12} for cos(q_1 + q_2)."""

from __future__ import annotations

import re
from collections.abc import Iterable

import sympy as sp

from symdyn.model.symbols import Moving, symbols_of


class Short(Moving):
    """A short name; in products after parameters, before coordinates."""

    __slots__ = ()
    _rank = -1


class Shorthand:
    """Sines and cosines of the expressions -> symbols; `legend` says what each stands for."""

    def __init__(self, expressions: Iterable[sp.Basic]) -> None:
        result = set().union(*[e.atoms(sp.sin, sp.cos) for e in expressions])
        angles = sorted({f.args[0] for f in result}, key=lambda a: (len(symbols_of(a)), sp.default_sort_key(a)))
        labels = {angle: _label(angle) for angle in angles}
        taken = list(labels.values())
        unique = {a: label if taken.count(label) == 1 else str(sp.latex(a)) for a, label in labels.items()}
        letters = {sp.sin: "s", sp.cos: "c"}
        self.symbols: dict[sp.Basic, sp.Symbol] = {}
        legend = []
        for angle in angles:
            for function, letter in letters.items():
                if function(angle) in result:
                    short = f"{letter}_{{{unique[angle]}}}"
                    self.symbols[function(angle)] = Short(short, real=True)
                    legend.append((short, str(sp.latex(function(angle)))))
        self.legend: tuple[tuple[str, str], ...] = tuple(legend)

    def short(self, expression: sp.Basic) -> sp.Basic:
        """The expression in the short names."""
        return expression.xreplace(self.symbols)


def _label(angle: sp.Expr) -> str:
    """Numbers of the coordinates that add up to the angle; other angles as they are."""
    parts = []
    for term in sp.Add.make_args(angle):
        factor, symbol = term.as_coeff_Mul()
        number = re.fullmatch(r"\\?[a-zA-Z]+_?(\d)", symbol.name) if isinstance(symbol, sp.Symbol) else None
        if factor not in (1, -1) or number is None:
            return str(sp.latex(angle))
        parts.append((factor, number[1]))
    parts.sort(key=lambda p: (-p[0], p[1]))
    return "".join(digit if factor == 1 else f"-{digit}" for factor, digit in parts)
