"""Descriptions of the orientation of a spherical or free joint."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

from symdyn.errors import ModelError
from symdyn.shown import shown

SEQUENCES = tuple("".join(s) for s in product("XYZ", repeat=3) if s[0] != s[1] and s[1] != s[2])
SPEEDS = ("rates", "body")


@dataclass(frozen=True)
class EulerAngles:
    """Three successive rotations about body axes, R = R_1(a) R_2(b) R_3(c); "ZYX" is yaw, pitch, roll.

    The angles are the coordinates, in the order of the sequence.
    speeds   "rates": the derivatives of the angles; "body": the angular velocity, rad/s, in the axes of the joint frame on
             the child. With "body" the mass matrix is regular at every attitude; it is the angles' rates that do not exist
             at gimbal lock, and a run that gets there stops with a message.
    Raises ModelError for anything but one of the twelve sequences and these two.

    >>> system = sd.System("top")
    >>> top = system.add_body("top", mass=1, inertia=[1, 1, 2])
    >>> sd.Spherical("tip", system.ground, top, orientation=sd.EulerAngles("ZXZ")).coordinates
    (q_tip_1, q_tip_2, q_tip_3)
    """

    sequence: str = "ZYX"
    speeds: str = "rates"

    def __post_init__(self) -> None:
        faults = []
        if not isinstance(self.sequence, str) or self.sequence not in SEQUENCES:
            faults.append(f"there is no Euler sequence {shown(self.sequence)}; the twelve are {', '.join(SEQUENCES)}")
        if self.speeds not in SPEEDS:
            faults.append(f"Euler angles have no speeds {shown(self.speeds)}; pass 'rates' (derivatives of the angles) or 'body' "
                          "(angular velocity in the axes of the child's joint frame)")
        if faults:
            raise ModelError(faults)

    @property
    def axes(self) -> tuple[int, int, int]:
        """Axis numbers 0, 1, 2 of the three rotations."""
        a, b, c = ("XYZ".index(letter) for letter in self.sequence)
        return a, b, c

    @property
    def angular_velocity(self) -> bool:
        """Whether the speeds are the angular velocity in the axes of the child's joint frame."""
        return self.speeds == "body"


@dataclass(frozen=True)
class EulerParameters:
    """Four Euler parameters (theta0 first) as coordinates; speeds: angular velocity in the axes of the child's joint frame.

    They start at (1, 0, 0, 0) unless given otherwise, and must be a unit vector.

    >>> system = sd.System("top")
    >>> top = system.add_body("top", mass=1, inertia=[1, 1, 2])
    >>> sd.Spherical("tip", system.ground, top, orientation=sd.EulerParameters()).coordinates
    (q_tip_1, q_tip_2, q_tip_3, q_tip_4)
    """

    @property
    def angular_velocity(self) -> bool:
        """Whether the speeds are the angular velocity in the axes of the child's joint frame: always."""
        return True
