"""Masses that no body has."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from symdyn.errors import ArgumentError

if TYPE_CHECKING:
    from symdyn.runtime.module import Module


def real_parameters(module: Module, params: Any) -> np.ndarray:
    """Module.parameters, (n_p,), of a mechanism that there may be.

    Raises ArgumentError as it does, and where a parameter that stands alone as the mass of a body is negative.
    """
    p = module.parameters(params)
    masses = module.metadata.get("masses", {})
    for name, value in zip(module.metadata["parameters"], p, strict=True):
        if value < 0 and name in masses:
            raise ArgumentError(f"{module.name}: the parameter {name}, the mass of body {masses[name]!r}, is {value:g} kg; pass "
                                "a number that is not below zero")
    return p
