"""The right-hand side of equations in CasADi's symbols, statement by statement as on the tape."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from symdyn.bench.work.against.walk import ARITHMETIC, walk
from symdyn.formulation.equations import Equations
from symdyn.functions.tapes import function_tape


def casadi_field(ca: Any, equations: Equations, leaves: Mapping[str, Any]) -> Any:
    """x_dot (n_x,) of CasADi; leaves: name -> CasADi's symbol or number, for coordinates, speeds, inputs and parameters."""
    entries = function_tape(equations, "rhs").outputs["rhs"].entries
    return ca.vertcat(*walk(entries, leaves, {**ARITHMETIC, "sin": ca.sin, "cos": ca.cos}, "CasADi"))
