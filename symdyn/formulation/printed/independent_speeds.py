"""Printed quantities of equations in independent speeds: J, M_tilde, k_tilde, F_tilde and the equations of motion."""

from __future__ import annotations

from typing import TYPE_CHECKING

import sympy as sp

from symdyn.facade import MotionFacade
from symdyn.formulation.equations import Equations

if TYPE_CHECKING:

    pass


class MotionEquations(MotionFacade, Equations):
    """M_tilde u_dot + k_tilde = F_tilde; every property is explicit SymPy, simplified as far as its time limit allows.

    >>> equations = sd.systems.pendulum().embedding()
    >>> equations.M_tilde, equations.k_tilde, equations.F_tilde
    (Matrix([[l**2*m]]), Matrix([[0]]), Matrix([[-g*l*m*sin(q1)]]))
    """

    @property
    def J(self) -> sp.Matrix:
        """(6 n_b, n_u), planar (3 n_b, n_u): [v_G; omega] of every body = J u (+ given motion), n-frame.

        >>> sd.systems.pendulum().embedding().J
        Matrix([
        [l*cos(q1)],
        [l*sin(q1)],
        [        1]])
        """
        return self.explicit("J")

    @property
    def Jdot(self) -> sp.Matrix:
        """Derivative of J by time, same shape.

        >>> sd.systems.pendulum().embedding().Jdot
        Matrix([
        [-l*q1_dot*sin(q1)],
        [ l*q1_dot*cos(q1)],
        [                0]])
        """
        return self.explicit("Jdot")

    @property
    def Jd_qd(self) -> sp.Matrix:
        """(6 n_b, 1), planar (3 n_b, 1): accelerations that remain when u_dot = 0, J_dot u (+ given motion).

        >>> sd.systems.pendulum().embedding().Jd_qd
        Matrix([
        [-l*q1_dot**2*sin(q1)],
        [ l*q1_dot**2*cos(q1)],
        [                   0]])
        """
        return self.explicit("Jd_qd")

    @property
    def M_tilde(self) -> sp.Matrix:
        """(n_u, n_u) J^T M J, symmetric.

        >>> sd.systems.pendulum().embedding().M_tilde
        Matrix([[l**2*m]])
        """
        return self.explicit("M_tilde")

    @property
    def k_tilde(self) -> sp.Matrix:
        """(n_u, 1) J^T (M J_dot u + Q J u).

        >>> sd.systems.double_pendulum().embedding().k_tilde[0]
        -l1*lc2*m2*q2_dot*(2*q1_dot + q2_dot)*sin(q2)
        """
        return self.explicit("k_tilde")

    @property
    def F_tilde(self) -> sp.Matrix:
        """(n_u, 1) J^T F with all loads and gravity.

        >>> sd.systems.pendulum().embedding().F_tilde
        Matrix([[-g*l*m*sin(q1)]])
        """
        return self.explicit("F_tilde")

    @property
    def equations(self) -> tuple[sp.Eq, ...]:
        """One equation a speed: (M_tilde u_dot + k_tilde)_i = F_tilde_i.

        >>> sd.systems.pendulum().embedding().equations
        (Eq(l**2*m*q1_ddot, -g*l*m*sin(q1)),)
        """
        left = self.M_tilde * self.accelerations + self.k_tilde
        return tuple(sp.Eq(a, b, evaluate=False) for a, b in zip(left, self.F_tilde, strict=True))

    # -- the names of analytical mechanics, and of SymPy's; see symdyn.analytic

    @property
    def mass_matrix(self) -> sp.Matrix:
        """(n_u, n_u) M_tilde under the name that SymPy's mechanics uses: mass_matrix u_dot = forcing.

        >>> equations = sd.systems.pendulum().embedding()
        >>> equations.mass_matrix == equations.M_tilde
        True
        """
        return self.M_tilde

    @property
    def forcing(self) -> sp.Matrix:
        """(n_u, 1) F_tilde - k_tilde under the name that SymPy's mechanics uses; under constraints without their forces.

        >>> sd.systems.pendulum().embedding().forcing
        Matrix([[-g*l*m*sin(q1)]])
        """
        return self.explicit("forcing")

    @property
    def rhs(self) -> sp.Matrix:
        """(n_q + n_u + n_z, 1) x_dot of x = [q; u; z], explicit: accelerations by Cramer's rule, as rhs() of SymPy's
        KanesMethod gives it. Augmented equations have the right side of their matrix under this name, and x_dot in a
        module only.

        >>> sd.systems.pendulum().embedding().rhs
        Matrix([
        [      q1_dot],
        [-g*sin(q1)/l]])
        """
        return self.explicit("state_rates")

    @property
    def T(self) -> sp.Expr:
        """Kinetic energy, J.

        >>> sd.systems.pendulum().embedding().T
        l**2*m*q1_dot**2/2
        """
        return self.explicit("T")

    @property
    def V(self) -> sp.Expr:
        """Potential energy of gravity, springs and load elements, J; other loads are in `power`, whether or not they have a
        potential. Raises SymdynError for equations by hand.

        >>> sd.systems.pendulum().embedding().V
        -g*l*m*cos(q1)
        """
        return self.explicit("V")

    @property
    def lagrangian(self) -> sp.Expr:
        """T - V, J, in q, u and t.

        >>> sd.systems.pendulum().embedding().lagrangian
        l*m*(g*cos(q1) + l*q1_dot**2/2)
        """
        return self.explicit("lagrangian")

    @property
    def momenta(self) -> sp.Matrix:
        """(n_u, 1) dT/du; conjugate to the coordinates where u = q_dot.

        >>> sd.systems.pendulum().embedding().momenta
        Matrix([[l**2*m*q1_dot]])
        """
        return self.explicit("momenta")

    @property
    def hamiltonian(self) -> sp.Expr:
        """Hamilton's function p . q_dot - L in coordinates, momenta and t, J. Raises SymdynError for quasi-velocities, and
        where the mass matrix couples more than three speeds.

        >>> sd.systems.pendulum().embedding().hamiltonian
        -g*l*m*cos(q1) + p_q1**2/(2*l**2*m)
        """
        return self.explicit("hamiltonian")

    @property
    def christoffel(self) -> sp.ImmutableDenseNDimArray:
        """(n, n, n) Christoffel symbols of the first kind: k_tilde_i = sum of c[i, j, k] u_j u_k where nothing is prescribed.

        Raises SymdynError for quasi-velocities.

        >>> c = sd.systems.double_pendulum().embedding().christoffel
        >>> c.shape, c[0, 1, 1]
        ((2, 2, 2), -l1*lc2*m2*sin(q2))
        """
        n = len(self.symbols.speeds)
        return sp.ImmutableDenseNDimArray(list(self.explicit("christoffel")), (n, n, n))

