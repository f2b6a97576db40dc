"""Printed quantities of augmented equations: C, C_r, C_t, F_d, the full matrix, the right side and the multipliers."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import sympy as sp

from symdyn.errors import SymdynError
from symdyn.formulation.printed.independent_speeds import MotionEquations
from symdyn.shown import name_of

if TYPE_CHECKING:
    from symdyn.given import Key


class AugmentedEquations(MotionEquations):
    """M u_dot + C_r^T lam = F - k with C_r u_dot = F_d; properties are explicit SymPy, simplified within the time limit.

    The constraint force is -C_r^T lam. C_r is the Jacobian in the speeds: by q where u = q_dot, else C_q N.

    >>> equations = sd.systems.pendulum_absolute().augmented()
    >>> equations.C, equations.C_r
    (Matrix([[-l**2 + x**2 + y**2]]), Matrix([[2*x, 2*y]]))
    """

    @property
    def C(self) -> sp.Matrix:
        """(n_c, 1) the constraints C(q, t) = 0; 0 where a row constrains speeds only.

        >>> sd.systems.pendulum_absolute().augmented().C
        Matrix([[-l**2 + x**2 + y**2]])
        """
        return self.explicit("C")

    @property
    def C_r(self) -> sp.Matrix:
        """(n_c, n_u) Jacobian of the constraints.

        >>> sd.systems.pendulum_absolute().augmented().C_r
        Matrix([[2*x, 2*y]])
        """
        return self.explicit("C_r")

    @property
    def C_t(self) -> sp.Matrix:
        """(n_c, 1) partial derivative by time; of a velocity constraint A u + b = 0: b.

        >>> sd.systems.pendulum_absolute().augmented().C_t
        Matrix([[0]])
        """
        return self.explicit("C_t")

    @property
    def F_d(self) -> sp.Matrix:
        """(n_c, 1) right side of C_r u_dot = F_d: -(C_r u)_r u - 2 C_rt u - C_tt.

        >>> sd.systems.pendulum_absolute().augmented().F_d
        Matrix([[-2*(x_dot**2 + y_dot**2)]])
        """
        return self.explicit("F_d")

    @property
    def matrix(self) -> sp.Matrix:
        """(n_u + n_c, n_u + n_c) [[M, C_r^T], [C_r, 0]].

        >>> sd.systems.pendulum_absolute().augmented().matrix
        Matrix([
        [  m,   0, 2*x],
        [  0,   m, 2*y],
        [2*x, 2*y,   0]])
        """
        return self.explicit("matrix")

    @property
    def rhs(self) -> sp.Matrix:
        """(n_u + n_c, 1) [F - k; F_d].

        >>> sd.systems.pendulum_absolute().augmented().rhs
        Matrix([
        [                       0],
        [                    -g*m],
        [-2*(x_dot**2 + y_dot**2)]])
        """
        return self.explicit("right_side")

    @property
    def lam(self) -> sp.Matrix:
        """(n_c, 1) the multipliers at the state, explicit; long for all but the smallest systems.

        >>> sd.systems.pendulum_absolute().augmented().lam
        Matrix([[m*(-g*y + x_dot**2 + y_dot**2)/(2*(x**2 + y**2))]])
        """
        return self.explicit("lam")

    @property
    def multipliers(self) -> sp.Matrix:
        """(n_c, 1) symbols of the multipliers.

        >>> sd.systems.pendulum_absolute().augmented().multipliers
        Matrix([[lambda1]])
        """
        return sp.Matrix(len(self.constraints), 1, sp.symbols(f"lambda1:{len(self.constraints) + 1}"))

    @property
    def constraint_forces(self) -> sp.Matrix:
        """(n_u, 1) -C_r^T lam, with symbols for the multipliers.

        >>> sd.systems.pendulum_absolute().augmented().constraint_forces
        Matrix([
        [-2*lambda1*x],
        [-2*lambda1*y]])
        """
        return -self.C_r.T * self.multipliers

    @property
    def equations(self) -> tuple[sp.Eq, ...]:
        """One equation a speed, M u_dot + k + C_r^T lam = F, then one a constraint, C_r u_dot = F_d.

        >>> sd.systems.pendulum_absolute().augmented().equations
        (Eq(2*lambda1*x + m*x_ddot, 0), Eq(2*lambda1*y + m*y_ddot, -g*m), Eq(2*x*x_ddot + 2*y*y_ddot, -2*(x_dot**2 + y_dot**2)))
        """
        left = self.M_tilde * self.accelerations + self.k_tilde + self.C_r.T * self.multipliers
        motion = [sp.Eq(a, b, evaluate=False) for a, b in zip(left, self.F_tilde, strict=True)]
        rows = self.C_r * self.accelerations
        return (*motion, *[sp.Eq(a, b, evaluate=False) for a, b in zip(rows, self.F_d, strict=True)])

    def without_multipliers(self, dependent: Sequence[Key] | Key) -> tuple[sp.Eq, ...]:
        """The equations of motion with the multipliers eliminated by the rows of dependent speeds.

        dependent   n_c coordinates or speeds, as symbols or names, such that their columns of C_r make a regular matrix; a
                    single one stands for itself
        With r = M u_dot + k - F = -C_r^T lam: (C_r)_i^T (C_r)_d^-T r_d - r_i = 0, times the determinant of (C_r)_d, and without
        factors that all terms share. Together with C_r u_dot = F_d these are n_u equations. Raises SymdynError for a wrong
        number of speeds or a singular choice.

        >>> sd.systems.pendulum_absolute().augmented().without_multipliers(["y"])
        (Eq(-m*y*x_ddot + x*(g*m + m*y_ddot), 0),)
        """
        given = list(dependent) if isinstance(dependent, (sp.MatrixBase, list, tuple)) else [dependent]
        names = [name_of(d) for d in given]
        speeds = self.symbols.speeds
        known = {s.name: k for k, s in enumerate(speeds)}
        known |= {q.name: known[f"{q.name}_dot"] for q in self.symbols.coordinates if f"{q.name}_dot" in known}
        wrong = [n for n in names if n not in known]
        n_c = len(self.constraints)
        if wrong or len(names) != n_c or len(set(names)) != n_c:
            those = f"{n_c} different ones of {', '.join(known)}" if n_c else "an empty list, there are no constraints"
            raise SymdynError(f"{self.name}: dependent is {', '.join(names) or 'empty'}; pass {those}")
        d = [known[n] for n in names]
        i = [k for k in range(len(speeds)) if k not in d]
        C = self.C_r
        C_d = C.extract(list(range(n_c)), d)
        determinant = sp.factor(sp.simplify(C_d.det()))
        if determinant == 0:
            raise SymdynError(f"{self.name}: the constraints do not determine {', '.join(names)} from the other speeds; choose "
                              "others")
        r = self.M_tilde * self.accelerations + self.k_tilde - self.F_tilde
        adjugate = C_d.T.adjugate()
        rows = []
        for k in i:
            factors = [sp.simplify(e) for e in (C[:, k].T * adjugate)]
            *factors, own = _without_common_factor([*factors, determinant])
            rows.append(sp.Add(*[f * r[j] for f, j in zip(factors, d, strict=True)], -own * r[k]))
        return tuple(sp.Eq(row, 0, evaluate=False) for row in rows)

    def _repr_latex_(self) -> str:
        from symdyn.report.notebook import augmented_page

        return augmented_page(self)


def _without_common_factor(terms: list[sp.Expr]) -> list[sp.Expr]:
    """The terms without what divides all of them; the last one without a minus before it, unless all others have one then."""
    try:
        common = sp.gcd_list([sp.together(t) for t in terms])
    except (sp.PolynomialError, NotImplementedError):
        common = sp.S.One
    reduced = [sp.factor(sp.cancel(t / common)) if common != 1 else t for t in terms]
    if reduced[-1].could_extract_minus_sign():
        reduced = [-t for t in reduced]
    return [-t for t in reduced] if all(t == 0 or t.could_extract_minus_sign() for t in reduced[:-1]) else reduced
