"""How the orientation of a spherical or free joint is described."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

from symdyn.errors import ModelError

SEQUENCES = tuple("".join(s) for s in product("XYZ", repeat=3) if s[0] != s[1] and s[1] != s[2])


@dataclass(frozen=True)
class EulerAngles:
    """Three successive rotations about body axes, R = R_1(a) R_2(b) R_3(c); "ZYX" is yaw, pitch, roll.

    The angles are the coordinates, in the order of the sequence; the speeds are their derivatives.
    Raises ModelError for anything but one of the twelve sequences.
    """

    sequence: str = "ZYX"

    def __post_init__(self) -> None:
        if self.sequence not in SEQUENCES:
            raise ModelError([f"there is no Euler sequence {self.sequence!r}; the twelve are {', '.join(SEQUENCES)}"])

    @property
    def axes(self) -> tuple[int, int, int]:
        """Axis numbers 0, 1, 2 of the three rotations."""
        a, b, c = ("XYZ".index(letter) for letter in self.sequence)
        return a, b, c


@dataclass(frozen=True)
class EulerParameters:
    """Four Euler parameters (theta0 first) as coordinates; speeds: angular velocity in the axes of the child's joint frame.

    They start at (1, 0, 0, 0) unless given otherwise, and must be a unit vector.
    """
