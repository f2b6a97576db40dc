"""Rigid bodies and point masses."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import sympy as sp

from symdyn.model.sympy_vectors import new_frame, new_point
from symdyn.shown import shown


@dataclass(frozen=True, eq=False)
class Body:
    """A rigid body with its reference frame (origin O, body axes).

    mass      kg
    inertia   (3, 3) about the centre of mass, body axes, kg m^2; zero for a point mass
    com       (3, 1) centre of mass from O, body axes, m
    given_frame   the body axes as a ReferenceFrame of SymPy; default: made when `frame` is first used
    given_origin  O as a Point of SymPy; default: made when `origin` is first used
    """

    name: str
    mass: sp.Expr
    inertia: sp.ImmutableMatrix
    com: sp.ImmutableMatrix
    given_frame: Any = None
    given_origin: Any = None

    @cached_property
    def frame(self) -> Any:
        """The body axes as a ReferenceFrame of SymPy, for vectors such as `force=F*body.frame.x`; of the ground the n-frame.

        It is known by itself, and not oriented against other frames: that is what joints are for.
        """
        return self.given_frame if self.given_frame is not None else new_frame(self.name)

    @cached_property
    def origin(self) -> Any:
        """The body's origin O as a Point of SymPy, from which others are located, such as `body.origin.locatenew("P",
        l*body.frame.x)`; of the ground the origin of the n-frame."""
        return self.given_origin if self.given_origin is not None else new_point(f"{self.name} origin")

    def __repr__(self) -> str:
        return f"Body({shown(self.name)})"
