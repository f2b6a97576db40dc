"""Every joint type and option: S and c against numerical derivatives of R and d."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest
import sympy as sp

import symdyn as sd
from symdyn.model import joints
from symdyn.model.joints import Joint, JointMotion
from symdyn.model.orientation import SEQUENCES
from tests.helpers import swept
from tests.model.joint_motion import check_motion

a, b, c, x, y, z = sd.coordinates("a b c x y z")
e = sd.coordinates("e0:4")
h, l, r = sd.parameters("h l r")
ENDS = ("joint", "parent", "child")
SLANTED = [sp.Rational(1, 3), sp.Rational(2, 3), sp.Rational(2, 3)]
Rx, Ry, Rz = sp.rot_ccw_axis1, sp.rot_ccw_axis2, sp.rot_ccw_axis3

JOINTS: dict[str, Callable[[], Joint]] = {
    "fixed": lambda: sd.Fixed(*ENDS),
    "revolute": lambda: sd.Revolute(*ENDS, a, axis=SLANTED),
    "prismatic": lambda: sd.Prismatic(*ENDS, x, axis=SLANTED),
    "cylindrical": lambda: sd.Cylindrical(*ENDS, [a, x], axis=SLANTED),
    "helical": lambda: sd.Helical(*ENDS, a, axis=SLANTED, pitch=-h / (2 * sp.pi)),
    "helical z": lambda: sd.Helical(*ENDS, a, pitch=0.3),
    "universal": lambda: sd.Universal(*ENDS, [a, b], axes=[SLANTED, [0.6, 0, 0.8]]),
    "planar": lambda: sd.Planar(*ENDS, [x, y, a]),
    **{f"spherical {s} {speeds}": lambda s=s, speeds=speeds: sd.Spherical(*ENDS, [a, b, c], sd.EulerAngles(s, speeds))
       for s in SEQUENCES for speeds in ("rates", "body")},
    "spherical parameters": lambda: sd.Spherical(*ENDS, e, sd.EulerParameters()),
    **{f"free {velocity} {speeds}": lambda velocity=velocity, speeds=speeds: sd.Free(
        *ENDS, [x, y, z, a, b, c], sd.EulerAngles("XZX", speeds), velocity=velocity)
       for velocity in ("parent", "body") for speeds in ("rates", "body")},
    "free body": lambda: sd.Free(*ENDS, [x, y, z, a, b, c], velocity="body"),
    "free parameters": lambda: sd.Free(*ENDS, [x, y, z, *e], sd.EulerParameters()),
    "free parameters body": lambda: sd.Free(*ENDS, [x, y, z, *e], sd.EulerParameters(), velocity="body"),
    "custom wheel on a parabola": lambda: sd.Custom(*ENDS, [x], Rz(sp.atan(2 * l * x)), [x, l * x**2, 0]),
    "custom turned at zero": lambda: sd.Custom(*ENDS, [a], Rx(sp.Rational(3, 10)) * Rz(a + l), [l, 0.2, r]),
    "custom 2": lambda: sd.Custom(*ENDS, [a, x], Rz(a) * Rx(x * a), [sp.sin(a) * x, r * a, sp.exp(x)]),
    "custom on a sphere": lambda: sd.Custom(*ENDS, [a, b, c], Rz(a) * Ry(b) * Rz(c), Rz(a) * Ry(b) * sp.Matrix([0, 0, r])),
    "custom 6": lambda: sd.Custom(*ENDS, [x, y, z, a, b, c], Rz(a) * Ry(b) * Rx(c), Rz(a) * sp.Matrix([x, y, z])),
    "custom not smooth": lambda: sd.Custom(*ENDS, [x, y], None, [sp.Max(x, l * x), sp.Abs(y - 2) + x,
                                                                 sp.Piecewise((x**3, x > 0), (0, True))]),
}


# Every sequence of angles is that of tests of rotations and of joint types.
OTHERS = [f"spherical {sequence} {speeds}" for sequence in SEQUENCES if sequence not in ("XYX", "YZX", "ZXZ", "ZYX")
          for speeds in ("rates", "body")]


@pytest.mark.every_value
@pytest.mark.parametrize("seed", swept([1, 2], 1))
@pytest.mark.parametrize("name", swept(JOINTS, *(name for name in JOINTS if name not in OTHERS)))
def test_motion_is_the_derivative_of_the_transform(name: str, seed: int) -> None:
    check_motion(JOINTS[name](), seed)


def test_every_joint_is_among_them() -> None:
    """But the elastic one, which moves by the modes of a beam."""
    assert {make().__class__.__name__ for make in JOINTS.values()} == set(joints.__all__) - {"Joint", "JointMotion", "Modal"}


def test_a_wrong_motion_is_found() -> None:
    class Wrong(sd.Helical):
        def motion(self, algebra: Any, s: Any, sd: Any) -> JointMotion:
            right = super().motion(algebra, s, sd)
            right.S[3, 0] = right.S[3, 0] + 1e-9
            return right

    with pytest.raises(AssertionError):
        check_motion(Wrong(*ENDS, a, pitch=h), 1)
