"""Masses that no body has."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from symdyn.errors import ArgumentError
from symdyn.shown import shown

if TYPE_CHECKING:
    from symdyn.runtime.module import Module


def real_parameters(module: Module, params: Any) -> np.ndarray:
    """Module.parameters, (n_p,), of a mechanism that there may be.

    Raises ArgumentError as it does, and where a parameter that stands alone as the mass of a body is negative.
    """
    p = module.parameters(params)
    wrong = negative_masses(module, p[None, :])
    if wrong:
        raise ArgumentError(wrong[0])
    return p


def negative_masses(module: Module, params: np.ndarray) -> dict[int, str]:
    """Messages about rows of parameters (n, n_p) in which one that stands alone as the mass of a body is negative, by row."""
    result: dict[int, str] = {}
    masses = module.metadata.masses
    for name, column in zip(module.metadata.parameters, params.T, strict=True):
        if name in masses:
            for k in np.flatnonzero(column < 0).tolist():
                result.setdefault(k, f"{module.name}: the parameter {name}, the mass of body {shown(masses[name])}, is "
                                    f"{column[k]:g} kg; pass a number that is not below zero")
    return result
