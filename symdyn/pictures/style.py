"""Style that curves and bodies have in common."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib import colormaps

# More curves or bodies than this are drawn thinner.
MANY = 12
# Colours that readers with any kind of colour vision can tell apart, dark enough for lines on white: Okabe and Ito, Color
# Universal Design, 2008, two of them darker.
LINES = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#B07D00", "#56B4E9", "#000000", "#7F7F7F")


def colors_of(count: int) -> list[Any]:
    """Colours of so many curves; of many from a scale that gets lighter."""
    if count > len(LINES):
        return list(colormaps["cividis"](np.linspace(0, 0.92, count)))
    return list(LINES[:count])


@dataclass(frozen=True)
class Style:
    """Purpose of a picture.

    width    of curves and grid, points; dashes: of curves one after the other; legend: size of its letters
    aside    whether legends stand on the right of their axes, else above; wide, high: of one set of axes, inches
    settings of matplotlib while the picture is made
    """

    width: float
    grid: float
    dashes: Sequence[Any]
    legend: float
    aside: bool
    wide: float
    high: float
    settings: dict[Any, Any]


SCREEN = Style(1.4, 0.7, ("-",), 8, True, 5.2, 2.1, {})
# A column of a journal is 86 mm wide; curves differ by their dashes, too, where it is printed without colours.
PAPER = Style(0.9, 0.4, ("-", "--", "-.", ":", (0, (5, 1, 1, 1, 1, 1)), (0, (1, 1)), (0, (7, 2)), (0, (3, 1, 1, 1))), 7, False,
              3.39, 1.25, {"font.family": "STIXGeneral", "mathtext.fontset": "stix", "font.size": 8, "axes.linewidth": 0.5,
                           "axes.labelsize": 8, "xtick.labelsize": 7, "ytick.labelsize": 7, "xtick.major.width": 0.5,
                           "ytick.major.width": 0.5, "xtick.major.size": 2.5, "ytick.major.size": 2.5})
STYLES = {"screen": SCREEN, "paper": PAPER}
