"""What curves and bodies have in common."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib import colormaps

# More curves or bodies than this are drawn thinner.
MANY = 12
# Colours that readers with any kind of colour vision can tell apart, dark enough for lines on white: Okabe and Ito, Color
# Universal Design, 2008, two of them darker.
LINES = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#B07D00", "#56B4E9", "#000000", "#7F7F7F")


def colors_of(count: int) -> list[Any]:
    """Of so many curves; of many from a scale that gets lighter."""
    if count > len(LINES):
        return list(colormaps["cividis"](np.linspace(0, 0.92, count)))
    return list(LINES[:count])
