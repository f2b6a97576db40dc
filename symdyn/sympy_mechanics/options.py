"""Options of equations of SymPy's besides the equations: name, numbers, units, extra states, outputs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import sympy as sp

from symdyn.formulation.equations import Symbols
from symdyn.shown import shown
from symdyn.sympy_mechanics.taken import Taken


@dataclass(frozen=True)
class Options:
    """See from_sympy."""

    name: str = "system"
    defaults: Mapping[Any, Any] | None = None
    initial: Mapping[Any, Any] | None = None
    units: Mapping[Any, str] | None = None
    duration: float = 10.0
    states: Mapping[Any, Any] = field(default_factory=dict)
    outputs: Mapping[str, Any] = field(default_factory=dict)

    def use(self, taken: Taken) -> None:
        """Take the symbols of rates and outputs over."""
        for z, rate in self.states.items():
            taken.use(f"the rate of {z}", taken.expression(rate, f"the rate of {z}"))
        for name, value in self.outputs.items():
            if not isinstance(name, str) or not name.isidentifier():
                taken.faults.append(f"an output is named {shown(name)}; pass an identifier such as 'tip'")
            taken.use(f"the output {name}", *[taken.expression(e, f"the output {name}") for e in _entries(value)])

    def symbols(self, taken: Taken) -> Symbols:
        """The symbols of the equations, with numbers. Raises ModelError with all faults."""
        return taken.symbols(self.defaults, self.initial, self.units, self.duration)

    def rates(self, taken: Taken) -> tuple[tuple[sp.Symbol, sp.Expr], ...]:
        """The extra states with their rates."""
        return tuple((taken.same[z], sp.sympify(rate, strict=True)) for z, rate in self.states.items())

    def outputs_of(self) -> tuple[tuple[str, Any], ...]:
        """Outputs by name."""
        return tuple((name, _expressions(value)) for name, value in self.outputs.items())


def _expressions(value: Any) -> Any:
    """An expression, or a tuple of them."""
    if isinstance(value, (list, tuple, sp.MatrixBase)):
        return tuple(map(_expressions, value))
    return sp.sympify(value, strict=True)


def _entries(value: Any) -> list[Any]:
    return list(value) if isinstance(value, (list, tuple, sp.MatrixBase)) else [value]
