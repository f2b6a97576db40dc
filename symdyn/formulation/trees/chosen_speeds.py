"""Generalized speeds of the user's choice: u = Y(q, t) v + y(q, t) of the joints' own speeds v, solved for these on the tape.

With fewer speeds than v the velocity constraints A v + a = 0 belong to the equations that are solved, [Y; A] v = [u - y; -a]: all
motions that they allow are described by u, and no multipliers are left.
Source: Kane and Levinson, Dynamics: Theory and Applications, sections 2.12 and 2.13.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import sympy as sp

from symdyn.errors import ModelError
from symdyn.formulation.algebra import TapeAlgebra, leaves_of
from symdyn.formulation.loads.measured import Measured
from symdyn.formulation.square_systems import SquareSystem
from symdyn.formulation.trees.tree import build
from symdyn.model.record import Model
from symdyn.spatial.vectors import vector
from symdyn.tape.differentiate import jacobian
from symdyn.tape.node import SEED, Node
from symdyn.tape.passes import substitute
from symdyn.tape.recorder import Recorder
from symdyn.tape.tape import reachable


def algebra_of(model: Model) -> TapeAlgebra:
    """A tape of its own with a leaf for every symbol of the model; speeds of joints stand for what the chosen ones make of them.

    Raises ModelError for chosen speeds that are not linear in those of the joints, or do not determine them at any state.
    """
    recorder = Recorder()
    leaves = leaves_of(model, recorder)
    if model.chosen:
        leaves |= _own_speeds(model, recorder, leaves)
    return TapeAlgebra(recorder, leaves)


def _own_speeds(model: Model, recorder: Recorder, leaves: dict[sp.Basic, Any]) -> dict[sp.Basic, Any]:
    """The joints' own speeds in terms of the chosen ones."""
    made = [recorder.leaf(f"(own {u.name})", SEED) for u in model.own_speeds]
    own = replace(model, speeds=model.own_speeds, chosen=(), own_speeds=(), eliminated=())
    scratch = TapeAlgebra(recorder, {**leaves, **dict(zip(model.own_speeds, made, strict=True))})
    scratch.measured = Measured(build(own, scratch))
    names = [str(u) for u, _ in model.chosen] + [c.name for c in model.eliminated]
    with recorder.section("speeds of the joints"):
        rows = [scratch.expression(e) for _, e in model.chosen] + [scratch.expression(c.expression) for c in model.eliminated]
        A = jacobian(recorder, rows, made, "forward")
        rest = substitute(tuple(rows), dict.fromkeys(made, 0), recorder)
        wrong = [name for name, row in zip(names, A, strict=True)
                 if set(made) & set(reachable([e for e in row if isinstance(e, Node)]))]
        if wrong:
            raise ModelError([f"{name} is not linear in the derivatives of the coordinates; pass an expression A(q, t) q_dot + "
                              "a(q, t)" for name in wrong], model.name)
        right = vector(*[leaves[u] for u, _ in model.chosen], *[0] * len(model.eliminated)) - vector(*rest)
        reason = f"{', '.join(names)} do not determine the speeds of the joints here"
        try:
            result = SquareSystem(scratch, A, reason).solve(right)
        except ZeroDivisionError:
            raise ModelError([f"{', '.join(names)} do not determine the derivatives of the coordinates at any state; take speeds "
                              "that are independent of each other and of the velocity constraints"], model.name) from None
        return dict(zip(model.own_speeds, recorder.name("v", result), strict=True))
