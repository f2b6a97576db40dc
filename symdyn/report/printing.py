"""Equations typeset for notebooks and pages."""

from __future__ import annotations

from typing import TYPE_CHECKING

import sympy as sp

if TYPE_CHECKING:
    from symdyn.formulation.printed.augmented import AugmentedEquations
    from symdyn.formulation.printed.independent_speeds import MotionEquations

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


def augmented_latex(equations: AugmentedEquations) -> str:
    """[[M, C_r^T], [C_r, 0]] [u_dot; lam] = [F - k; F_d] written out, or a summary where that would fill pages."""
    operations = equations.tape("bias", "M_tilde", "C_r", "F_d").operations
    if operations > TOO_LONG:
        n, n_c = len(equations.symbols.speeds), len(equations.constraints)
        return (r"$\displaystyle \left[\begin{matrix}\tilde{M} & C_r^T\\C_r & 0\end{matrix}\right]"
                r"\left[\begin{matrix}\dot{u}\\\lambda\end{matrix}\right] = "
                r"\left[\begin{matrix}\tilde{F} - \tilde{k}\\F_d\end{matrix}\right]\quad "
                rf"({n}+{n_c},\ {operations}\ \text{{operations}})$")
    unknowns = sp.Matrix([*equations.accelerations, *equations.multipliers])
    return rf"$\displaystyle {sp.latex(equations.matrix)} {sp.latex(unknowns)} = {sp.latex(equations.rhs)}$"
