"""Parts of a written mechanism: numbers, poses, joints with one coordinate."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import sympy as sp

from symdyn.model.joints import Fixed, Free, Joint, Spherical
from symdyn.model.orientation import EulerAngles, EulerParameters
from symdyn.model.record import Model, joint_speeds
from symdyn.model.symbols import symbols_of
from symdyn.urdf.poses import Pose


class Numbers:
    """Expressions as numbers, with the parameters' defaults; what has none is a fault."""

    def __init__(self, model: Model, faults: list[str]) -> None:
        self.values = {symbol: sp.Float(value) for symbol, value in model.defaults.items()}
        missing = [p.name for p in model.parameters if p not in model.defaults]
        if missing:
            faults.append(f"there is no number for {', '.join(missing)}; add them to the defaults: an MJCF holds numbers")
            self.values |= {p: sp.S.One for p in model.parameters if p not in model.defaults}

    def value(self, e: Any) -> float:
        return float(sp.sympify(e, strict=True).xreplace(self.values))

    def array(self, matrix: Any) -> np.ndarray:
        return np.array([[self.value(e) for e in row] for row in sp.Matrix(matrix).tolist()])

    def text(self, value: Any) -> str:
        """A number that reads back to the last bit."""
        return repr(self.value(value) + 0.0)

    def texts(self, values: Any) -> str:
        return " ".join(map(self.text, values))

    def multiple(self, coordinate: sp.Expr, owners: Mapping[Any, Scalar]) -> tuple[Scalar, float, float] | None:
        """The scalar joint whose coordinate another is a multiple of, the factor and the offset; None for any other
        expression."""
        q = coordinate.doit().xreplace(self.values)
        sources = sorted(symbols_of(q), key=str)
        slope = q.diff(sources[0]) if len(sources) == 1 else sp.nan
        if slope is sp.nan or not slope.is_number or sources[0] not in owners:
            return None
        return owners[sources[0]], float(slope), float(q.xreplace({sources[0]: sp.S.Zero}))


@dataclass(frozen=True)
class Scalar:
    """A slide or hinge of the file: its axis in the joint's frame, coordinate and speed; joint: its number in the model."""

    name: str
    kind: str
    axis: np.ndarray
    coordinate: Any
    speed: Any
    joint: int


def scalars_of(joint: Joint, numbers: Numbers, number: int = -1) -> Iterator[Scalar]:
    """The slides and hinges that a joint is, in the order in which they follow; none for a quaternion."""
    if isinstance(joint, Fixed) or isinstance(getattr(joint, "orientation", None), EulerParameters):
        return
    x, y, z = np.eye(3)
    kinds: list[tuple[str, np.ndarray]]
    if joint.kind == "planar":
        kinds = [("slide", x), ("slide", y), ("hinge", z)]
    elif isinstance(joint, (Free, Spherical)):
        orientation: EulerAngles = joint.orientation  # type: ignore[assignment]
        kinds = [("hinge", np.eye(3)[axis]) for axis in orientation.axes]
        if isinstance(joint, Free):
            kinds = [("slide", x), ("slide", y), ("slide", z), *kinds]
    elif joint.kind == "universal":
        kinds = [("hinge", numbers.array(axis).ravel()) for axis in joint.axes]  # type: ignore[attr-defined]
    else:
        axis = numbers.array(joint.axis).ravel()  # type: ignore[attr-defined]
        kinds = {"revolute": [("hinge", axis)], "prismatic": [("slide", axis)],
                 "cylindrical": [("hinge", axis), ("slide", axis)]}[joint.kind]
    speeds = joint_speeds(joint)
    for k, (kind, axis) in enumerate(kinds):
        name = joint.name if len(kinds) == 1 else f"{joint.name}_{k + 1}"
        yield Scalar(name, kind, axis, joint.coordinates[k], speeds[k], number)


def pose_of(joint: Joint, numbers: Numbers) -> Pose:
    """Pose of the child in the parent where the joint's coordinates are zero."""
    on_parent, on_child = (Pose(numbers.array(R), numbers.array(p).ravel()) for R, p in (
        (joint.parent_rotation, joint.parent_point), (joint.child_rotation, joint.child_point)))
    return on_parent @ on_child.inverse()
