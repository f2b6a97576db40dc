"""Links and joints as a file has them."""

from __future__ import annotations

from dataclasses import dataclass, field

from symdyn.urdf.values import Triple

# A file holds no gravity; what is read has so much along -z, m/s^2.
GRAVITY = 9.81
ZERO: Triple = (0.0, 0.0, 0.0)
# Types of joints and how many coordinates each has.
TYPES = {"fixed": 0, "revolute": 1, "continuous": 1, "prismatic": 1, "planar": 3, "floating": 6}
INERTIA = ("ixx", "ixy", "ixz", "iyy", "iyz", "izz")


@dataclass(frozen=True)
class Origin:
    """Where a frame sits in another: xyz, m, and roll, pitch, yaw, rad, about the other's fixed axes."""

    xyz: Triple = ZERO
    rpy: Triple = ZERO


@dataclass(frozen=True)
class Inertial:
    """Mass, kg; where the centre of mass is and how the axes are turned that the inertia is given in, kg m^2, as INERTIA."""

    origin: Origin
    mass: float
    inertia: tuple[float, ...]
    line: int

    @property
    def nothing(self) -> bool:
        """Whether it has neither mass nor inertia."""
        return self.mass == 0 and not any(self.inertia)


@dataclass(frozen=True)
class Link:
    """A link; `inertial` is None where the file gives none: it has no mass then."""

    name: str
    inertial: Inertial | None
    line: int


@dataclass(frozen=True)
class Mimic:
    """The coordinate is multiplier * that of another joint + offset."""

    joint: str
    multiplier: float
    offset: float
    line: int


@dataclass(frozen=True)
class UrdfJoint:
    """A joint: origin of its frame, and of the child link, in the parent link; axis in the joint's frame, length 1.

    damping   N m s/rad or N s/m
    """

    name: str
    kind: str
    parent: str
    child: str
    origin: Origin
    axis: Triple
    damping: float
    mimic: Mimic | None
    line: int


@dataclass(frozen=True)
class Robot:
    """All of a file that dynamics depends on, in the order of the file.

    dropped   lines of joints that have no name of their own
    """

    name: str
    links: dict[str, Link] = field(default_factory=dict)
    joints: dict[str, UrdfJoint] = field(default_factory=dict)
    dropped: list[int] = field(default_factory=list)
