"""Common part of joints of one degree of freedom along or about an axis."""

from __future__ import annotations

from typing import TYPE_CHECKING

from symdyn.model.joints.base import Joint

if TYPE_CHECKING:
    import sympy as sp

    from symdyn.given import BodyOrName, Matrix, Scalar, Vector


class AxisJoint(Joint):
    """A joint with one coordinate and `axis`, a vector in the joint frame; see Joint for the frames."""

    default_axis: tuple[int, int, int] = (0, 0, 1)

    def __init__(self, name: str, parent: BodyOrName, child: BodyOrName, coordinate: Scalar | None = None, axis: Vector = ...,
                 speed: sp.Symbol | None = None, parent_point: Vector = (0, 0, 0), child_point: Vector = (0, 0, 0),
                 parent_rotation: Matrix | None = None, child_rotation: Matrix | None = None) -> None:
        coordinates, speeds = (None if value is None else (value,) for value in (coordinate, speed))
        super().__init__(name, parent, child, coordinates, speeds, parent_point, child_point, parent_rotation,
                         child_rotation)
        self.axis = self._axis(self.default_axis if axis is ... else axis)
