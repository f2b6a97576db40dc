"""An extra state of a mechanism."""

from __future__ import annotations

from dataclasses import dataclass

import sympy as sp


@dataclass(frozen=True)
class State:
    """An extra state (actuator, controller, bristles of a contact) with its rate."""

    symbol: sp.Symbol
    rate: sp.Expr
