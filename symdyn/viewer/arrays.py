"""Arrays as text of a page: sixteen bits a number, each column between its own smallest and largest."""

from __future__ import annotations

import base64
from typing import Any

import numpy as np

_LEVELS = 65535


def packed(values: np.ndarray) -> dict[str, Any]:
    """Rows and columns of finite numbers, (n, m): with `low` and `step` of each column, so that value = low + step * integer.

    The error is at most a 131,070th of the column's range.
    """
    flat = np.asarray(values, dtype=float).reshape(len(values), -1)
    low = flat.min(axis=0, initial=np.inf) if len(flat) else np.zeros(flat.shape[1])
    step = (flat.max(axis=0, initial=-np.inf) - low) / _LEVELS if len(flat) else np.zeros(flat.shape[1])
    whole = np.round((flat - low) / np.where(step > 0, step, 1.0)).astype("<u2")
    return {"rows": len(flat), "columns": flat.shape[1], "low": [_short(v) for v in low], "step": [_short(v) for v in step],
            "data": text_of(whole.T)}


def plain(values: np.ndarray) -> dict[str, Any]:
    """Rows and columns in single precision, for what is not a motion: vertices and shapes."""
    flat = np.asarray(values, dtype="<f4").reshape(len(values), -1)
    return {"rows": len(flat), "columns": flat.shape[1], "single": text_of(flat.T)}


def text_of(values: np.ndarray) -> str:
    return base64.b64encode(np.ascontiguousarray(values).tobytes()).decode()


def _short(value: float) -> float:
    return float(f"{value:.9g}")
