"""A flexible body in a description: a body at each end of a beam, and the elastic joint between them."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import sympy as sp

from symdyn.errors import ModelError
from symdyn.flexible.modal_body import ModalBody
from symdyn.model.bodies import Body
from symdyn.model.joints.modal import Modal
from symdyn.model.symbols import Coordinate
from symdyn.shown import shown


@dataclass(frozen=True)
class FlexibleBody:
    """root, tip: frames at the clamped and at the free end, to be used as bodies; the beam's mass counts to the root, whose
    centre of mass, as `positions` and J have it, is that of the straight beam.

    coordinates   eta, one a mode; joint: named like the body, which has them
    """

    root: Body
    tip: Body
    joint: Modal

    @property
    def coordinates(self) -> tuple[sp.Expr, ...]:
        return self.joint.coordinates


def flexible_body(name: str, beam: Any, coordinates: Sequence[Any] | None, stiffness: Any, damping: Any,
                  carries: bool) -> FlexibleBody:
    """Make one. Raises ModelError for a beam that is none."""
    body = getattr(beam, "modal", beam)
    if not isinstance(body, ModalBody):
        raise ModelError([f"flexible body {shown(name)}: beam is {shown(beam)}; pass sd.Beam(...)"])
    center = body.h0 / body.m
    inertia = body.I0 - body.m * (center @ center * np.eye(3) - np.outer(center, center))
    root = Body(name, sp.Float(body.m), sp.ImmutableMatrix(3, 3, [_number(e) for e in inertia.ravel()]),
                sp.ImmutableMatrix(3, 1, [_number(e) for e in center]))
    tip = Body(f"{name}_tip", sp.S.Zero, sp.ImmutableMatrix(sp.zeros(3, 3)), sp.ImmutableMatrix(sp.zeros(3, 1)))
    if coordinates is None:
        coordinates = [Coordinate(re.sub(r"[^0-9A-Za-z]+", "_", f"{name}_{mode}")) for mode in body.names]
    return FlexibleBody(root, tip, Modal(f"{name}_bends", root, tip, body, coordinates, None, stiffness, damping, carries))


def _number(value: float) -> sp.Expr:
    return sp.Float(value) if value else sp.S.Zero
