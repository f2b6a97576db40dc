"""The embedding formulation of a system of bodies: M_tilde u_dot + k_tilde = F_tilde.

With J the velocity transformation, [v_G; omega] = J u, the lecture has M_tilde = J^T M J, k_tilde = J^T (M J_dot u + Q J u)
and F_tilde = J^T F (chapters 3.2 and 6.2). The same numbers come cheaper without forming J: M_tilde by composite bodies,
k_tilde and F_tilde by the recursion of velocities, accelerations and forces. J itself is formed where it is asked for.
"""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
import sympy as sp

from symdyn.errors import ModelError
from symdyn.formulation import composite
from symdyn.formulation.algebra import TapeAlgebra, leaves_of
from symdyn.formulation.equations import Equations, Symbols
from symdyn.formulation.newton_euler import inverse_dynamics
from symdyn.formulation.rank import first_dependent
from symdyn.formulation.tree import build
from symdyn.formulation.tree_quantities import TreeQuantities
from symdyn.model.joints import Fixed
from symdyn.model.orientation import EulerParameters
from symdyn.model.record import Model, joint_speeds
from symdyn.spatial.vectors import congruence, zeros
from symdyn.tape.node import is_zero
from symdyn.tape.recorder import Recorder


class EmbeddedEquations(Equations):
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

    @property
    def F_c(self) -> sp.Matrix:
        """Constraint reaction M r_ddot - F in the coordinates of the position map (level 1 only)."""
        return self.explicit("F_c")

    def _repr_latex_(self) -> str:
        from symdyn.report.printing import equation_latex

        return equation_latex(self)


def embed(model: Model) -> EmbeddedEquations:
    """The embedded equations of a checked model.

    Raises ModelError for constraints (they need the augmented formulation) and for joints that move no inertia.
    """
    if model.constraints or model.loops:
        count = len(model.constraints) + len(model.loops)
        raise ModelError([f"the model has {count} constraints or closed loops; the embedded form takes trees only: "
                          "use system.augmented(), or remove them"], model.name)
    recorder = Recorder()
    algebra = TapeAlgebra(recorder, leaves_of(model, recorder))
    tree = build(model, algebra)
    derivation = EmbeddedTree(tree)
    derivation.demand_inertia()
    symbols = Symbols(model.coordinates, model.speeds, tuple(z.symbol for z in model.states), model.inputs,
                      model.parameters, model.defaults, model.initial, model.units, model.duration)
    return EmbeddedEquations(model.name, "embedding", model.planar, symbols, recorder, algebra.leaves,
                             derivation.quantities(), tuple(_notes(model)), _unit_groups(model), partial(embed, model))


class EmbeddedTree(TreeQuantities):
    """Records the quantities of the embedded form of a tree."""

    def quantities(self) -> dict[str, Any]:
        return {**super().quantities(), "k_tilde": self.k_tilde, "F_tilde": self.F_tilde}

    def M_tilde(self) -> np.ndarray:
        M = composite.mass_matrix(self.tree)
        if self.tree.plain:
            return self.algebra.name("M_tilde", M)
        with self.algebra.section("mass matrix in the generalized speeds"):
            return self.algebra.name("M_tilde", congruence(M, self.tree.D))

    def bias(self) -> np.ndarray:
        """k_tilde - F_tilde in one pass: the weight as acceleration of the base."""
        applied = self.loads.applied()
        tau = inverse_dynamics(self.tree, self.tree.b, -self.gravity(), applied.wrenches)
        return self.algebra.name("k_minus_F", self.project(tau - applied.joint))

    def inverse_dynamics(self) -> np.ndarray:
        """M_tilde u_dot + k_tilde - F_tilde by one pass, without the mass matrix."""
        applied = self.loads.applied()
        w_dot = self.tree.D @ self.speed_rates + self.tree.b if len(self.tree.w) else self.tree.b
        tau = inverse_dynamics(self.tree, w_dot, -self.gravity(), applied.wrenches)
        return self.algebra.name("tau", self.project(tau - applied.joint))

    def k_tilde(self) -> np.ndarray:
        return self.algebra.name("k_tilde", self.project(inverse_dynamics(self.tree, self.tree.b, zeros(3))))

    def F_tilde(self) -> np.ndarray:
        return self.algebra.name("F_tilde", self.project(self.joint_forces(gravity=True)))

    def demand_inertia(self) -> None:
        """Raise ModelError for speeds that move nothing: the mass matrix has a zero on its diagonal."""
        faults = []
        M = self.recall("M_tilde")
        for k, u in enumerate(self.speeds):
            if is_zero(M[k, k]):
                joint = next((j for j in self.model.joints if u in joint_speeds(j)), None)
                if joint is None:
                    faults.append(f"no joint with mass or inertia moves with {u}; use its coordinate in the expression of a "
                                  "joint, or leave it out")
                    continue
                faults.append(f"joint {joint.name!r}: what it moves has no mass or inertia along {u}; give body "
                              f"{getattr(joint.child, 'name', joint.child)!r} or one further out a mass or an inertia, "
                              "or fix the joint")
        if faults:
            raise ModelError(faults, self.model.name)
        dependent = first_dependent(self.algebra.recorder, M)
        if dependent is not None:
            raise ModelError([f"the mass matrix is singular at every state: {self.speeds[dependent]} moves nothing that the "
                              "speeds after it do not move already; give the bodies between them mass or inertia, or fix "
                              "one of their joints"], self.model.name)


def _notes(model: Model) -> list[str]:
    fixed = [j.name for j in model.joints if isinstance(j, Fixed)]
    if not fixed:
        return []
    return [f"fixed joints {', '.join(fixed)}: their bodies are merged with their parents before the derivation"]


def _unit_groups(model: Model) -> tuple[tuple[sp.Symbol, ...], ...]:
    joints = [j for j in model.joints if isinstance(getattr(j, "orientation", None), EulerParameters)]
    return tuple(tuple(j.coordinates[-4:]) for j in joints)
