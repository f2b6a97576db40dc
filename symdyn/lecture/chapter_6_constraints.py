"""Chapter 6.3: constraints of the turbine's fixed and revolute joints, in absolute coordinates."""

from __future__ import annotations

from typing import Any

import sympy as sp

import symdyn as sd
from symdyn.comparison import Case, Erratum, Formula, Slide, proofs
from symdyn.lecture.letters import constant

TITLE = "2.1 Equations of Motion - Derivation of Equations of Motion with respect to the Arbitrary Point O for Rigid Body"
x_axis, y_axis, z_axis = (sp.eye(3).col(axis) for axis in range(3))


class Pair:
    """Two free bodies, ZYX Euler angles, held together by a joint."""

    def __init__(self, first: str, second: str, joint: Any) -> None:
        system = sd.System("pair", gravity=[0, 0, 0])
        self.r, self.R, bodies = [], [], []
        for name in (first, second):
            place, angles = sd.coordinates(f"x_{name} y_{name} z_{name}"), sd.coordinates(f"psi_{name} theta_{name} phi_{name}")
            inertia = sp.diag(*sp.symbols(f"I_x{name} I_y{name} I_z{name}"))
            body = system.add_body(name, mass=sp.Symbol(f"m_{name}"), inertia=inertia)
            system.add_joint(sd.Free(f"of_{name}", system.ground, body, [*place, *angles], orientation=sd.EulerAngles("ZYX")))
            self.r.append(sp.Matrix(place))
            self.R.append(sd.rotation.from_euler("ZYX", angles))
            bodies.append(body)
        system.close_loop(joint(*bodies))
        self.C = sp.Matrix(system.augmented().explicit("C", simplify=False))


def fixed() -> list[Formula]:
    """Fixed joint of tower and platform."""
    arm = constant("r_OT_OP")
    pair = Pair("P", "T", lambda P, T: sd.Fixed("foot", P, T, parent_point=list(arm)))
    (rP, rT), RP = pair.r, pair.R[0]
    # Six coordinates a body, five equations for each of two revolute joints; four joints are fixed.
    counted = proofs.other("Seven bodies on four fixed and two revolute joints keep the eight coordinates of chapter 6.2.",
                           sp.Rational(7 * 6 - 2 * 5 - 8, 4))
    missing = Erratum("Only the point is held, as by a ball joint; a fixed joint needs three more equations for the orientation.",
                      counted)
    return [
        Formula("fixed joint", (rP + RP * arm, rT), (pair.C[:3, :], sp.zeros(3, 1)), line=12237),
        Formula("number of equations", sp.Integer((rP + RP * arm - rT).rows), sp.Integer(pair.C.rows), line=12237,
                errata=[missing]),
    ]


def revolute() -> list[Formula]:
    """Revolute joint of hub and nacelle, about the x axis of the hub; C is a point of the axis."""
    in_nacelle, in_hub = constant("r_C_ON"), constant("r_C_OH")
    pair = Pair("N", "H", lambda N, H: sd.Revolute("shaft", N, H, axis=[1, 0, 0], parent_point=list(in_nacelle),
                                                   child_point=list(in_hub)))
    (rN, rH), (RN, RH) = pair.r, pair.R
    return [
        Formula("point on the axis", (rN + RN * in_nacelle, rH + RH * in_hub), (pair.C[:3, :], sp.zeros(3, 1)), line=12241),
        Formula("y of N and x of H", (RN * y_axis).dot(RH * x_axis), pair.C[3], line=12243),
        Formula("z of N and x of H", (RN * z_axis).dot(RH * x_axis), pair.C[4], line=12245),
    ]


CASES = (
    Case("fixed-joint-constraint", "Fixed joint of platform and tower", Slide("6.3", TITLE, 12225), fixed),
    Case("revolute-joint-constraint", "Revolute joint of nacelle and hub", Slide("6.3", TITLE, 12239), revolute),
)
