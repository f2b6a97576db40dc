"""`symdyn derive`: prints the equations."""

from __future__ import annotations

import argparse
import re
import sys
from typing import Any

from symdyn.cli.find import find_equations

# Quantities with more operations than this, written out, are counted and not printed: nobody reads them.
READABLE = 1000
USUAL = ("M_tilde", "k_tilde", "F_tilde")
OF_CONSTRAINTS = ("C_r", "F_d", "C")


def derive(arguments: argparse.Namespace) -> int:
    """Print the symbols, and every quantity that was requested."""
    from symdyn.overview.equations import written_out

    equations = find_equations(arguments)
    tied = bool(equations.constraints)
    quantities = arguments.quantity or [*USUAL, *OF_CONSTRAINTS * tied]
    for name in quantities:
        equations.quantity(name)
    s = equations.symbols
    if not arguments.latex:
        print(f"{equations.name}: M_tilde u_dot + k_tilde {'+ C_r^T lam = F_tilde, C_r u_dot = F_d' if tied else '= F_tilde'}")
        for what, symbols in (("coordinates q", s.coordinates), ("speeds u", s.speeds), ("inputs", s.inputs),
                              ("parameters", s.parameters)):
            if symbols:
                print(f"  {what}: " + ", ".join(f"{x.name} [{s.units[x]}]" if s.units.get(x) else x.name for x in symbols))
        if tied:
            print(f"  constraints: {', '.join(equations.constraints)}")
    for name in quantities:
        count, shape = written_out(equations, name), equations.quantity(name).shape
        if count > READABLE and not arguments.force:
            size = " x ".join(map(str, shape)) or "a number"
            steps = equations.tape(name).operations
            note = f"{name} ({size}): {count} operations written out, {steps} in generated code; --force prints it"
            print(f"% {note}" if arguments.latex else f"\n{note}")
            continue
        if arguments.latex:
            print(equations.latex(name, arguments.shorthand, arguments.intermediates, simplify=not arguments.no_simplify))
        else:
            print(f"\n{name} =\n{_pretty(equations.explicit(name, simplify=not arguments.no_simplify))}")
    return 0


def _pretty(value: Any) -> str:
    """As a drawing of characters, as wide as the terminal."""
    import shutil

    import sympy as sp

    from symdyn.model.symbols import symbols_of

    wide = (sys.stdout.encoding or "").lower().startswith("utf")
    columns = shutil.get_terminal_size().columns if sys.stdout.isatty() else None
    if wide:
        value = value.xreplace({x: _dotted(x.name) for x in symbols_of(value) if x.name.endswith("_dot")})
    return str(sp.pretty(value, use_unicode=wide, wrap_line=columns is not None, num_columns=columns))


def _dotted(name: str) -> Any:
    """The symbol that SymPy prints with a dot: qdot_1 for q1_dot."""
    import sympy as sp

    letters, index = re.fullmatch(r"(.*?)(_?\d*)", name.removesuffix("_dot")).groups()  # type: ignore[union-attr]
    return sp.Symbol(f"{letters}dot{index}")
