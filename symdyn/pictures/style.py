"""What curves and bodies have in common."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib import colormaps

# More curves or bodies than this are drawn thinner.
MANY = 12
_PALETTE = "tab10"


def colors_of(count: int) -> list[Any]:
    if count > 10:
        return list(colormaps["viridis"](np.linspace(0, 1, count)))
    return [colormaps[_PALETTE](k) for k in range(count)]
