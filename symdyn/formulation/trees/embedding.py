"""The embedding formulation of a system of bodies: M_tilde u_dot + k_tilde = F_tilde.

With J the velocity transformation, [v_G; omega] = J u, the lecture has M_tilde = J^T M J, k_tilde = J^T (M J_dot u + Q J u)
and F_tilde = J^T F (chapters 3.2 and 6.2). The same numbers come cheaper without forming J: M_tilde by composite bodies,
k_tilde and F_tilde by the recursion of velocities, accelerations and forces. J itself is formed where it is requested.
"""

from __future__ import annotations

import sympy as sp

from symdyn.formulation.printed.independent_speeds import MotionEquations
from symdyn.formulation.trees.equations import derive_tree
from symdyn.formulation.trees.quantities import TreeQuantities
from symdyn.model.record import Model


class EmbeddedEquations(MotionEquations):
    """M_tilde u_dot + k_tilde = F_tilde with u_dot from the factorized mass matrix.

    >>> sd.systems.pendulum().embedding().M_tilde
    Matrix([[l**2*m]])
    """

    @property
    def F_c(self) -> sp.Matrix:
        """Constraint reaction M r_ddot - F in the coordinates of the position map of `sd.embedding`.

        >>> x, m, g, h = sd.coordinates("x"), *sd.parameters("m g h")
        >>> sd.embedding([x], [x, h], [m, m], [0, -m * g]).F_c
        Matrix([
        [  0],
        [g*m]])
        """
        return self.explicit("F_c")


def embed(model: Model, frames: str = "body") -> EmbeddedEquations:
    """The embedded equations of a checked model.

    frames   "body": every link in its own axes; "parallel": in those of the link before where axes stay parallel
    Raises ModelError for constraints and for joints that move no inertia.
    """
    return derive_tree(model, "embedding", frames, TreeQuantities, EmbeddedEquations)
