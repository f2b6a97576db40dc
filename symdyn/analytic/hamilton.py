"""Hamilton's equations as SymPy equations."""

from __future__ import annotations

from typing import TYPE_CHECKING

import sympy as sp

from symdyn.analytic.lagrange import CLOSED, PUT_IN, Mechanics, momentum_leaves
from symdyn.formulation.printed.augmented import AugmentedEquations

if TYPE_CHECKING:
    from symdyn.formulation.printed.independent_speeds import MotionEquations


def equations_of(equations: MotionEquations) -> tuple[sp.Eq, ...]:
    """Equations for q_dot, then p_dot; of augmented equations with multipliers, then the constraints on positions and, in speeds,
    those on velocities. Raises SymdynError for quasi-velocities.

    Where the mass matrix couples more than two speeds, p_dot is in q and q_dot; where it couples more than three, p = dT/dq_dot
    stands in place of q_dot = dH/dp.
    """
    mechanics = Mechanics(equations)
    mechanics.demand_plain("Hamilton's equations were")
    p = momentum_leaves(equations).values()
    if mechanics.coupled > CLOSED:
        rows = list(zip(p, equations.momenta, strict=True))
    else:
        rows = list(zip([q.dot for q in equations.symbols.coordinates], equations.explicit("hamilton_speeds"), strict=True))
    forces = equations.explicit("hamilton_forces_by_momenta" if mechanics.coupled <= PUT_IN else "hamilton_forces")
    more: list[sp.Eq] = []
    if isinstance(equations, AugmentedEquations):
        forces = forces + equations.constraint_forces
        velocities = equations.explicit("C_dot")
        more = [sp.Eq(C if holonomic else v, 0, evaluate=False)
                for C, v, holonomic in zip(equations.C, velocities, equations.holonomic, strict=True)]
    rows += zip([sp.Symbol(f"{symbol.name}_dot", real=True) for symbol in p], forces, strict=True)
    return (*[sp.Eq(a, b, evaluate=False) for a, b in rows], *more)
