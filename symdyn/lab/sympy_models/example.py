"""Parts of an example."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any


@dataclass(frozen=True)
class Derived:
    """Equations of SymPy's, with extra states and their rates."""

    equations: Any
    states: Mapping[Any, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Example:
    """make: derives the equations; numbers: of parameters, by name; start: of coordinates and speeds, by name; speeds: of
    coordinates and speeds at the state about which linear equations are compared, by name, None: nothing is compared; source:
    where the mechanism is described; slow: whether SymPy takes many seconds to derive or lambdify it."""

    name: str
    make: Callable[[], Derived]
    numbers: Mapping[str, float]
    source: str
    start: Mapping[str, float] = field(default_factory=dict)
    linear: Mapping[str, float] | None = None
    slow: bool = False
