"""The fixed joint: no motion; the two bodies are one for the derivation."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from symdyn.model.joints.base import IDENTITY, Joint, JointMotion
from symdyn.spatial.vectors import zeros

if TYPE_CHECKING:
    from symdyn.given import BodyOrName, Matrix, Vector


class Fixed(Joint):
    """Holds the child on the parent; see Joint for the frames.

    >>> system = sd.System("one")
    >>> joint = sd.Fixed("joint", system.ground, system.add_body("body", mass=1))
    >>> joint.coordinates
    ()
    """

    kind = "fixed"

    def __init__(self, name: str, parent: BodyOrName, child: BodyOrName, parent_point: Vector = (0, 0, 0),
                 child_point: Vector = (0, 0, 0), parent_rotation: Matrix | None = None,
                 child_rotation: Matrix | None = None) -> None:
        super().__init__(name, parent, child, (), None, parent_point, child_point, parent_rotation, child_rotation)

    def motion(self, algebra: Any, s: Sequence[Any], sd: Sequence[Any]) -> JointMotion:
        return JointMotion(np.array(IDENTITY, dtype=object), zeros(3), zeros(6, 0), zeros(6))
