"""Numbers, names and poses that stand in the elements of an SDF."""

from __future__ import annotations

import math

import numpy as np

from symdyn.shown import shown
from symdyn.urdf.angles import rotation
from symdyn.urdf.document import Element
from symdyn.urdf.poses import Pose
from symdyn.urdf.values import FileFaults

KIND = "an SDF"


class Values(FileFaults):
    """Faults of a file, and the values of its elements, whose numbers are checked as those of a URDF's attributes."""

    def numbers(self, element: Element, what: str, n: int) -> list[float]:
        """The numbers that an element holds."""
        stands = Element(element.tag, {"text": element.text}, element.line)
        return self._numbers(stands, "text", what, n, None)

    def number_in(self, parent: Element | None, tag: str, what: str, default: float) -> float:
        """The number that a child holds; default: where there is none."""
        result = None if parent is None else parent.find(tag)
        return default if result is None else self.numbers(result, what, 1)[0]

    def word(self, parent: Element, tag: str, what: str) -> str:
        """The text that a child holds, "" and a fault where there is none."""
        result = parent.find(tag)
        text = "" if result is None else result.text
        if not text:
            self.at(parent.line, f"{what} has no <{tag}>; write <{tag}>...</{tag}>")
        return text

    def true(self, parent: Element, tag: str) -> bool:
        """Whether a child holds true or 1."""
        result = parent.find(tag)
        return result is not None and result.text in ("true", "1")

    def pose(self, parent: Element, what: str) -> tuple[str, Pose, int]:
        """The frame that the <pose> of an element is relative to ("": the default), the pose, and its line."""
        result = parent.find("pose")
        if result is None:
            return "", Pose(), parent.line
        if result.attributes.get("frame"):
            self.at(result.line, f"{what}: <pose> has the attribute frame={shown(result.attributes['frame'])}, which versions "
                                "before 1.7 "
                                "left without a meaning; write relative_to of version 1.7")
        form = result.attributes.get("rotation_format", "euler_rpy")
        if not result.text:
            numbers = [0.0] * 6 if form == "euler_rpy" else [0.0] * 6 + [1.0]
        elif form not in ("euler_rpy", "quat_xyzw"):
            self.at(result.line, f"{what}: <pose> has the rotation_format {shown(form)}; there are euler_rpy and quat_xyzw")
            return "", Pose(), result.line
        else:
            numbers = self.numbers(result, what, 6 if form == "euler_rpy" else 7)
        if form == "quat_xyzw":
            R = self._turned(numbers[3:], what, result.line)
        else:
            degrees = result.attributes.get("degrees") in ("true", "1")
            roll, pitch, yaw = (math.radians(a) for a in numbers[3:]) if degrees else numbers[3:]
            R = np.array(rotation((roll, pitch, yaw)))
        return result.attributes.get("relative_to", ""), Pose(R, np.array(numbers[:3])), result.line

    def _turned(self, quaternion: list[float], what: str, line: int) -> np.ndarray:
        x, y, z, w = quaternion
        size = math.hypot(x, y, z, w)
        if abs(size - 1) > 1e-3:
            self.at(line, f"{what}: the quaternion of <pose> has the length {size:.6g}; give a unit quaternion, x y z w")
            return np.eye(3)
        x, y, z, w = x / size, y / size, z / size, w / size
        return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
                         [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
                         [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)]])
