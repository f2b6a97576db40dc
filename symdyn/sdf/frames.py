"""The frames of a model: of itself, of links, joints and nested models, and those by name, as poses in the model's frame.

Source: the documentation "Pose frame semantics" of SDFormat 1.7 and later.
"""

from __future__ import annotations

from dataclasses import dataclass

from symdyn.sdf.values import Values
from symdyn.shown import shown
from symdyn.urdf.poses import Pose
from symdyn.urdf.values import nearest

MODEL, WORLD = "__model__", "world"


@dataclass(frozen=True)
class FrameOf:
    """A frame: its pose in another, and the name of what it is fixed to ("": it is a link, or the model)."""

    what: str
    relative_to: str
    pose: Pose
    attached: str
    line: int


class Frames:
    """The frames of a model by name; those of nested models have names like inner::link."""

    def __init__(self, faults: Values) -> None:
        self.faults = faults
        self.known: dict[str, FrameOf] = {MODEL: FrameOf("the model", "", Pose(), "", 0)}
        self.poses: dict[str, Pose] = {MODEL: Pose()}

    def add(self, name: str, frame: FrameOf) -> bool:
        """Whether the name is its own."""
        if name in self.known:
            self.faults.at(frame.line, f"{frame.what} has the name of {self.known[name].what} (line {self.known[name].line}); "
                                       f"links, "
                                       "joints, frames and nested models need names of their own")
            return False
        self.known[name] = frame
        return True

    def pose(self, name: str, line: int, what: str, waiting: tuple[str, ...] = ()) -> Pose:
        """Pose of a frame in the model's."""
        if name in self.poses:
            return self.poses[name]
        if name not in self.known:
            self.faults.at(line, f"{what} refers to the frame {shown(name)}, which there is not{nearest(name, self.known)}")
            return Pose()
        frame = self.known[name]
        if name in waiting:
            self.faults.at(frame.line, f"the poses of {', '.join(map(shown, waiting))} are relative to each other in a circle; "
                                       f"make one "
                                       "relative to the model")
            self.poses[name] = Pose()
            return Pose()
        result = self.pose(frame.relative_to or MODEL, frame.line, frame.what, (*waiting, name)) @ frame.pose
        self.poses[name] = result
        return result

    def between(self, outer: str, inner: str, line: int, what: str) -> Pose:
        """Pose of one frame in another, without rounding where it is written so."""
        if outer == inner:
            return Pose()
        known = self.known.get(inner)
        if known is not None and (known.relative_to or MODEL) == outer:
            return known.pose
        if outer in self.known and (self.known[outer].relative_to or MODEL) == inner and outer != MODEL:
            return self.known[outer].pose.inverse()
        return (self.pose(outer, line, what).inverse() @ self.pose(inner, line, what)).rounded()

    def body(self, name: str, line: int, what: str) -> str:
        """The link that a frame is fixed to, or "world"; "" and a fault where there is none."""
        passed: list[str] = []
        while name != WORLD:
            if name not in self.known or name in passed:
                said = "in a circle" if name in passed else (f"refers to {shown(name)}, which is no link or frame"
                                                             f"{nearest(name, self.known)}")
                self.faults.at(line, f"{what} {'is attached ' if name in passed else ''}{said}")
                return ""
            frame = self.known[name]
            if not frame.attached:
                return name
            passed.append(name)
            name = frame.attached
        return WORLD
