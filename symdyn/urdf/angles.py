"""Rotation matrices of roll, pitch and yaw about fixed axes, R = R_z(yaw) R_y(pitch) R_x(roll), and back."""

from __future__ import annotations

import math
from collections.abc import Iterator

from symdyn.urdf.values import Triple

Rows = tuple[Triple, Triple, Triple]
# Sines and cosines nearer to zero than this are the rounding of a right angle, 1.5707963267948966; 1.5708 is no right angle.
_ROUNDING = 1e-15


def rotation(rpy: Triple) -> Rows:
    """R (3, 3), child to parent components; exact at multiples of 90 degrees that are given to the last digit."""
    (sr, cr), (sp, cp), (sy, cy) = map(_sine_cosine, rpy)
    return ((cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr),
            (sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr),
            (-sp, cp * sr, cp * cr))


def _sine_cosine(angle: float) -> tuple[float, float]:
    s, c = math.sin(angle), math.cos(angle)
    if abs(s) < _ROUNDING:
        return 0.0, math.copysign(1.0, c)
    if abs(c) < _ROUNDING:
        return math.copysign(1.0, s), 0.0
    return s, c


def angles(R: Rows) -> Triple:
    """Roll, pitch, yaw of a rotation matrix, if possible such that `rotation` gives it back to the last bit.

    Angles with few digits come first: those that a file was written with.
    """
    across = math.hypot(R[2][1], R[2][2])
    pitch = math.atan2(-R[2][0], across)
    if across:
        first = math.atan2(R[2][1], R[2][2]), pitch, math.atan2(R[1][0], R[0][0])
    else:  # roll and yaw turn about the same axis: one of them is enough
        first = math.atan2(-R[1][2], R[1][1]), pitch, 0.0
    roll, pitch, yaw = first
    other = roll - math.copysign(math.pi, roll), math.copysign(math.pi, pitch) - pitch, yaw - math.copysign(math.pi, yaw)
    return next((result for start in (first, other) for result in _exact(R, start)), first)


def _exact(R: Rows, start: Triple) -> Iterator[Triple]:
    """Angles around some whose rotation is R to the last bit."""
    rolls, pitches, yaws = map(_near, start)
    for pitch in pitches:
        sp, cp = _sine_cosine(pitch)
        if -sp != R[2][0]:
            continue
        for roll in rolls:
            sr, cr = _sine_cosine(roll)
            if (cp * sr, cp * cr) == R[2][1:]:
                yield from ((roll, pitch, yaw) for yaw in yaws if rotation((roll, pitch, yaw)) == R)


def _near(angle: float) -> list[float]:
    """The angle, or a whole turn more or less, with one digit, with two, ..., in steps of 15 degrees, and the floats around."""
    result = []
    for whole in (angle, angle + 2 * math.pi, angle - 2 * math.pi):
        result += [float(f"{whole:.{digits}g}") for digits in range(1, 18)]
    result.append(math.radians(15 * round(angle / math.radians(15))))
    for direction in (-math.inf, math.inf):
        neighbour = angle
        for _ in range(4):
            neighbour = math.nextafter(neighbour, direction)
            result.append(neighbour)
    return [c for c in dict.fromkeys(result) if abs(math.remainder(c - angle, 2 * math.pi)) < 1e-11]
