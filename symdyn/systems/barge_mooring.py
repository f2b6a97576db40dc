"""The eight mooring lines of the ITI Energy barge: two from each corner, 150 m of water, anchors 423 m from the middle.

Source: input and summary of MAP++ in OpenFAST's regression test 5MW_ITIBarge_DLL_WTurb_WavesIrr: places, length, mass, diameter,
EA, C_B, and the weight in water of 1227.15 N/m, from which g follows. The anchors of the two lines of a corner are not quite
mirrored there, 386.92 m and 386.95 m, which gives the whole mooring a moment about the vertical of 4.8 kN m at rest.
"""

from __future__ import annotations

import math
from typing import Any

from symdyn.model.elements import MooringLine

LENGTH = 473.312  # m, unstretched
LINE_MASS = 130.403  # kg/m, in air
DIAMETER = 0.0809  # m
EA = 5.89e8  # N
FRICTION = 1.0  # C_B, of the line with the seabed
FAIRLEAD = (20.0, 20.0, -4.0)  # m, of the first two lines, from the middle of the barge in its water plane
ANCHORS = ((386.92, 171.985, -150.0), (171.985, 386.95, -150.0))  # m, of the first two lines
GRAVITY = 9.80665  # m/s^2
WATER_DENSITY = 1025.0  # kg/m^3


def line_weight(gravity: Any = GRAVITY, density: Any = WATER_DENSITY) -> Any:
    """Weight of a line in water, N/m."""
    return (LINE_MASS - density * (math.pi / 4 * DIAMETER**2)) * gravity


def barge_mooring(body: Any, friction: Any = FRICTION, gravity: Any = GRAVITY, density: Any = WATER_DENSITY) -> list[MooringLine]:
    """The lines, for `system.add_load`; the origin of the body is in the still water plane, z = 0, when it is not displaced.

    friction   with the seabed; 0 makes the lines conservative, and their forces at rest a little smaller
    gravity    m/s^2; density: of the water, kg/m^3
    The other six lines are the first two turned by 90, 180 and 270 degrees about the vertical.
    """
    lines: list[MooringLine] = []
    for quarter in range(4):
        for anchor in ANCHORS:
            lines.append(MooringLine(body, _turned(FAIRLEAD, quarter), _turned(anchor, quarter), LENGTH,
                                     line_weight(gravity, density), EA, friction=friction, name=f"mooring line {len(lines) + 1}"))
    return lines


def _turned(point: tuple[float, float, float], quarters: int) -> tuple[float, float, float]:
    x, y, z = point
    for _ in range(quarters):
        x, y = -y, x
    return x, y, z
