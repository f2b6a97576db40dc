"""The precision that a device computes with."""

from __future__ import annotations

from typing import Any

from symdyn.errors import ArgumentError
from symdyn.shown import shown

PRECISIONS = {"double": "float64", "single": "float32"}
# Tolerances that steps in single precision can meet: eight roundings.
LEAST_RTOL = 1e-6


def checked_precision(precision: Any, on_device: bool, owner: str) -> str:
    """A name of PRECISIONS. Raises ArgumentError for another, and for single precision on the processor."""
    if not (isinstance(precision, str) and precision in PRECISIONS):
        raise ArgumentError(f"{owner}: precision must be 'double' or 'single', found {shown(precision)}")
    if precision == "single" and not on_device:
        raise ArgumentError(f"{owner}: precision='single' is that of a device; pass device='gpu', or leave it out")
    return precision
