"""The right-hand side of equations in CasADi's symbols, statement by statement as on the tape."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from symdyn.formulation.equations import Equations
from symdyn.tape.node import Node


def casadi_field(ca: Any, equations: Equations, leaves: Mapping[str, Any]) -> Any:
    """x_dot (n_x,) of CasADi; leaves: name -> CasADi's symbol or number, for coordinates, speeds, inputs and parameters."""
    value: dict[Node, Any] = {}
    operations = {"add": lambda a, b: a + b, "sub": lambda a, b: a - b, "mul": lambda a, b: a * b, "div": lambda a, b: a / b,
                  "neg": lambda a: -a, "sin": ca.sin, "cos": ca.cos, "guard": lambda a, *_: a}
    tape = equations.tape("rhs")
    get = lambda a: value[a] if isinstance(a, Node) else float(a)
    for node in (*tape.inputs, *tape.steps):
        value[node] = leaves[node.args[1]] if node.op == "leaf" else operations[node.op](*map(get, node.args))
    return ca.vertcat(*map(get, tape.outputs["rhs"].entries))
