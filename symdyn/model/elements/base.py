"""The base of load elements: loads that follow from the pose and the motion of one body."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import sympy as sp

from symdyn.model.elements.site import Action, Site
from symdyn.model.faults import Faults

if TYPE_CHECKING:
    from symdyn.given import BodyOrName


class Element:
    """A load on one body, given by what it does with the body's pose and motion; see Site and Action.

    body    the body it acts on, or its name; label: names the load in generated code and in messages
    A subclass checks what it is given with `self.faults`, which end in the model's one ModelError, and `self.doubts`, which are
    warnings.
    """

    kind = "load"

    def __init__(self, body: BodyOrName, name: str = "") -> None:
        self.body = body
        self.label = name
        self.faults = Faults()
        self.doubts: list[str] = []

    @property
    def where(self) -> str:
        """Name in messages."""
        body = getattr(self.body, "name", self.body)
        return self.label or f"{self.kind} on {body}"

    @property
    def constants(self) -> Sequence[sp.Expr]:
        """Expressions that may hold parameters only."""
        return ()

    @property
    def expressions(self) -> Sequence[sp.Expr]:
        """Expressions that may hold coordinates, speeds, inputs and t, too."""
        return ()

    @property
    def units(self) -> Mapping[str, Sequence[sp.Expr]]:
        """Unit -> expressions in this unit; a symbol that stands alone gets it."""
        return {}

    def act(self, site: Site) -> Action:
        """Action of the element at a site, on the scalars of its algebra."""
        raise NotImplementedError
