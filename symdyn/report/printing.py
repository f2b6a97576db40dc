"""Equations typeset for notebooks and pages."""

from __future__ import annotations

from typing import TYPE_CHECKING

import sympy as sp

if TYPE_CHECKING:
    from symdyn.formulation.motion_equations import MotionEquations

# Above this many operations a right-hand side is not written out in a notebook unless it is asked for by name.
TOO_LONG = 400


def equation_latex(equations: MotionEquations) -> str:
    """M_tilde u_dot + k_tilde = F_tilde with the matrices written out, or a summary where they would fill pages."""
    operations = equations.tape("bias", "M_tilde").operations
    if operations > TOO_LONG:
        n = len(equations.symbols.speeds)
        return (rf"$\displaystyle \tilde{{M}}\,\dot{{u}} + \tilde{{k}} = \tilde{{F}}\quad ({n}\times{n},\ "
                rf"{operations}\ \text{{operations}})$")
    parts = [sp.latex(equations.M_tilde), sp.latex(equations.accelerations), "+", sp.latex(equations.k_tilde), "=",
             sp.latex(equations.F_tilde)]
    return rf"$\displaystyle {' '.join(parts)}$"
