"""What equations in independent speeds print: J, M_tilde, k_tilde, F_tilde and the equations of motion."""

from __future__ import annotations

from typing import TYPE_CHECKING

import sympy as sp

from symdyn.formulation.equations import Equations

if TYPE_CHECKING:
    from symdyn.formulation.provenance import Explanation


class MotionEquations(Equations):
    """M_tilde u_dot + k_tilde = F_tilde; every property is explicit SymPy, simplified as far as its time limit allows."""

    @property
    def J(self) -> sp.Matrix:
        """(6 n_b, n_u), planar (3 n_b, n_u): [v_G; omega] of every body = J u (+ given motion), n-frame."""
        return self.explicit("J")

    @property
    def Jdot(self) -> sp.Matrix:
        """Derivative of J by time, same shape."""
        return self.explicit("Jdot")

    @property
    def Jd_qd(self) -> sp.Matrix:
        """(6 n_b, 1), planar (3 n_b, 1): accelerations that remain when u_dot = 0, J_dot u (+ given motion)."""
        return self.explicit("Jd_qd")

    @property
    def M_tilde(self) -> sp.Matrix:
        """(n_u, n_u) J^T M J, symmetric."""
        return self.explicit("M_tilde")

    @property
    def k_tilde(self) -> sp.Matrix:
        """(n_u, 1) J^T (M J_dot u + Q J u)."""
        return self.explicit("k_tilde")

    @property
    def F_tilde(self) -> sp.Matrix:
        """(n_u, 1) J^T F with all loads and gravity."""
        return self.explicit("F_tilde")

    @property
    def equations(self) -> tuple[sp.Eq, ...]:
        """One equation a speed: (M_tilde u_dot + k_tilde)_i = F_tilde_i."""
        left = self.M_tilde * self.accelerations + self.k_tilde
        return tuple(sp.Eq(a, b, evaluate=False) for a, b in zip(left, self.F_tilde, strict=True))

    def explain(self, quantity: str, *index: int, simplify: bool = True) -> Explanation:
        """Where an entry comes from: `explain("M_tilde", i, j)` and `explain("k_tilde", i)`, indices from 0.

        The contributions of each body, translational and rotational, and for k_tilde the centrifugal, Coriolis and gyroscopic
        ones. See symdyn.formulation.provenance.
        """
        from symdyn.formulation.provenance import explain

        return explain(self, quantity, *index, simplify=simplify)

    def _repr_latex_(self) -> str:
        from symdyn.report.printing import equation_latex

        return equation_latex(self)
