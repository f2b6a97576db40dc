"""Speeds that move nothing, reported before any code is made: the mass matrix or a pivot is singular at every state."""

from __future__ import annotations

import random
from collections.abc import Sequence
from typing import Any

import numpy as np
import sympy as sp

from symdyn.errors import ModelError
from symdyn.formulation.probes.rank import first_dependent
from symdyn.model.joints import Joint
from symdyn.model.record import Model, joint_speeds
from symdyn.shown import shown
from symdyn.tape.node import Node, is_zero
from symdyn.tape.quick import evaluate_quickly
from symdyn.tape.recorder import Recorder
from symdyn.tape.tape import Tape

DIGITS = 40


def demand_mass_matrix(model: Model, recorder: Recorder, M: np.ndarray) -> None:
    """Raise ModelError if M_tilde (n_u, n_u) has a zero on its diagonal or dependent rows at every state."""
    faults = _massless(model, [u for k, u in enumerate(model.speeds) if is_zero(M[k, k])])
    if faults:
        raise ModelError(faults, model.name)
    dependent = first_dependent(recorder, M)
    if dependent is not None:
        raise ModelError([_dependent(model.speeds[dependent])], model.name)


def demand_pivots(model: Model, recorder: Recorder, pivots: Sequence[tuple[Any, sp.Symbol]]) -> None:
    """Raise ModelError if a pivot S^T I^A S, given with the speed it belongs to, is zero at every state.

    Tried at a random state, with so many digits that rounding cannot hide it.
    """
    faults = _massless(model, [u for pivot, u in pivots if is_zero(pivot)])
    if faults:
        raise ModelError(faults, model.name)
    nodes = [(pivot, u) for pivot, u in pivots if isinstance(pivot, Node)]
    tape = Tape.of(recorder, pivots=[pivot for pivot, _ in nodes])
    stream = random.Random(1)
    values = evaluate_quickly(tape, {leaf.args[1]: stream.uniform(0.5, 1.5) for leaf in tape.inputs}, DIGITS)["pivots"]
    for value, (_, u) in zip(values, nodes, strict=True):
        if abs(value) < 10 ** (-DIGITS // 2):
            raise ModelError([_dependent(u)], model.name)


def _massless(model: Model, speeds: Sequence[sp.Symbol]) -> list[str]:
    joints = joints_by_speed(model) if speeds else {}
    return [massless(u, joints.get(u)) for u in speeds]


def joints_by_speed(model: Model) -> dict[sp.Symbol, Joint]:
    """The first joint that has each speed for its own."""
    return {u: joint for joint in reversed(model.joints) for u in joint_speeds(joint) if u is not None}


def massless(u: sp.Symbol, joint: Joint | None) -> str:
    """Message that nothing with mass moves along a speed, which is that of a joint or of none, with advice."""
    if joint is None:
        return f"no joint with mass or inertia moves with {u}; use its coordinate in the expression of a joint, or leave it out"
    return (f"joint {shown(joint.name)}: what it moves has no mass or inertia along {u}; give body "
            f"{shown(getattr(joint.child, 'name', joint.child))} or one further out a mass or an inertia, or fix the joint")


def _dependent(u: sp.Symbol) -> str:
    return (f"the mass matrix is singular at every state: {u} moves nothing that the speeds after it do not move already; give "
            "the bodies between them mass or inertia, or fix one of their joints")
