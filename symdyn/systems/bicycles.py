"""Whipple's bicycle with the numbers of the benchmark."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import sympy as sp

from symdyn.model import shapes
from symdyn.model.joints import Free, Revolute
from symdyn.model.orientation import EulerAngles
from symdyn.model.symbols import coordinates, inputs, parameters
from symdyn.model.system import System

# Meijaard et al., table 1: numbers of the names in `bicycle`.
_NUMBERS = {
    "g": 9.81, "w": 1.02, "c": 0.08, "r_R": 0.3, "r_F": 0.35,
    "m_R": 2.0, "IR_xx": 0.0603, "IR_yy": 0.12, "m_F": 3.0, "IF_xx": 0.1405, "IF_yy": 0.28,
    "m_B": 85.0, "x_B": 0.3, "z_B": -0.9, "IB_xx": 9.2, "IB_yy": 11.0, "IB_zz": 2.8, "IB_xz": 2.4,
    "m_H": 4.0, "x_H": 0.9, "z_H": -0.7, "IH_xx": 0.05892, "IH_yy": 0.06, "IH_zz": 0.00708, "IH_xz": -0.00756,
}


def bicycle() -> System:
    """Whipple's bicycle: rear frame with a rigid rider, front frame, and two thin wheels that roll without slipping.

    The n-frame has x forward, y to the right, z down; the ground is z = 0. x, y, z (m) is the hub of the rear wheel; psi, lean,
    pitch (rad) are the angles ZXY of the rear frame; steer turns the front frame about the steering axis, rear and front turn
    the wheels (rad; forward they turn at negative rates). A wheel touches the ground at the lowest point of its rim, one
    constraint of the position; that it does not slip there are two of the velocity. Nine coordinates, six constraints, three
    speeds left: of the lean, of the steering and forward. It starts upright at 4.6 m/s with a lean rate of 0.5 rad/s, as in the
    benchmark.

    Input: T_steer (N m), the moment about the steering axis on the front frame, against the rear frame.
    Parameters: g (m/s^2, along z), w wheelbase, c trail (m), r radius (m), m mass (kg), I inertia (kg m^2) of the rear wheel (R)
    and the front wheel (F), about a diameter (xx) and the axle (yy); of the rear frame (B) and the front frame (H) with the
    rear contact as origin x, z of the centre of mass (m) and I about it. The steering axis leans back by pi/10 rad.
    Source: Meijaard, Papadopoulos, Ruina and Schwab, Linearized dynamics equations for the balance and steer of a bicycle,
    Proc. R. Soc. A 463, 2007: numbers of table 1. Straight ahead it is stable between the weave speed 4.29238253634111 m/s and
    the capsize speed 6.02426201538837 m/s.
    """
    tilt = math.pi / 10
    q = x, y, z, psi, lean, pitch, steer, rear, front = coordinates("x y z psi lean pitch steer rear front")
    p = dict(zip(_NUMBERS, parameters(" ".join(_NUMBERS)), strict=True))
    torque = inputs("T_steer")
    system = System("bicycle", gravity=[0, 0, p["g"]])

    def inertia(of: str) -> sp.Matrix:
        xx, yy, zz, xz = (p[f"I{of}_{k}"] for k in ("xx", "yy", "zz", "xz"))
        return sp.Matrix([[xx, 0, xz], [0, yy, 0], [xz, 0, zz]])

    # Bodies have the axes of the n-frame where the bicycle stands straight; origins: rear hub, the point of the steering axis on
    # the ground, hubs.
    foot, hub = sp.Matrix([p["w"] + p["c"], 0, p["r_R"]]), sp.Matrix([-p["c"], 0, -p["r_F"]])
    frame = system.add_body("frame", mass=p["m_B"], inertia=inertia("B"), com=[p["x_B"], 0, p["z_B"] + p["r_R"]])
    fork = system.add_body("fork", mass=p["m_H"], inertia=inertia("H"), com=[p["x_H"] - p["w"] - p["c"], 0, p["z_H"]])
    back = system.add_body("rear_wheel", mass=p["m_R"], inertia=[p["IR_xx"], p["IR_yy"], p["IR_xx"]])
    ahead = system.add_body("front_wheel", mass=p["m_F"], inertia=[p["IF_xx"], p["IF_yy"], p["IF_xx"]])
    system.add_joint(Free("rider", system.ground, frame, [x, y, z, psi, lean, pitch], EulerAngles("ZXY")))
    head = system.add_joint(Revolute("head", frame, fork, steer, axis=[math.sin(tilt), 0, math.cos(tilt)],
                                     parent_point=list(foot)))
    system.add_joint(Revolute("rear_hub", frame, back, rear, axis=[0, 1, 0]))
    system.add_joint(Revolute("front_hub", fork, ahead, front, axis=[0, 1, 0], parent_point=list(hub)))
    system.add_joint_force(head, torque)

    # The steering head, 0.9 m above the ground on the steering axis.
    above = sp.Matrix([-0.9 * math.tan(tilt), 0, -0.9])
    rider = [p["x_B"], 0, p["z_B"] + p["r_R"]]
    system.draw(frame, shapes.Line([[0, 0, 0], list(foot + above), rider, [0, 0, 0]], 3.0), color="#4a6a8a")
    system.draw(fork, shapes.Line([list(above), list(hub)], 3.0), color="#7a4b8a")
    for wheel, radius in ((back, p["r_R"]), (ahead, p["r_F"])):
        rim = [[radius * math.cos(math.pi * k / 18), 0, radius * math.sin(math.pi * k / 18)] for k in range(37)]
        system.draw(wheel, shapes.Line(rim, 2.0), shapes.Line([rim[0], rim[18]], 1.0), color="0.2")

    R = _turned("z", psi) * _turned("x", lean) * _turned("y", pitch)
    R_fork = R * _turned("y", sp.Float(tilt)) * _turned("z", steer) * _turned("y", -sp.Float(tilt))
    centre = sp.Matrix([x, y, z])
    for name, at, attitude, spin, radius in (("rear", centre, R, rear, p["r_R"]),
                                             ("front", centre + R * foot + R_fork * hub, R_fork, front, p["r_F"])):
        axle = attitude * sp.Matrix([0, 1, 0])
        slope = sp.sqrt(1 - axle[2]**2)
        down = radius * (sp.Matrix([0, 0, 1]) - axle[2] * axle) / slope  # from the hub to the lowest point
        turning = _by_time(attitude, q) * attitude.T * down + spin.dot * axle.cross(down)
        slip = _by_time(at, q) + turning
        system.add_constraint(at[2] + radius * slope, name=f"{name} wheel touches")
        system.add_constraint(slip[0], name=f"{name} wheel along x")
        system.add_constraint(slip[1], name=f"{name} wheel along y")
    system.defaults = {p[name]: value for name, value in _NUMBERS.items()}
    v, rate = 4.6, 0.5
    system.initial = {z: -0.3, x.dot: v, y.dot: 0.3 * rate, lean.dot: rate, rear.dot: -v / 0.3, front.dot: -v / 0.35}
    system.units = {p[name]: "m" for name in ("r_R", "r_F", "w", "c", "x_B", "z_B", "x_H", "z_H")}
    system.duration = 5.0
    return system


def _turned(axis: str, angle: Any) -> sp.Matrix:
    """Rotation about a coordinate axis: components of the turned frame to those of the frame before."""
    c, s = sp.cos(angle), sp.sin(angle)
    return {"x": sp.Matrix([[1, 0, 0], [0, c, -s], [0, s, c]]), "y": sp.Matrix([[c, 0, s], [0, 1, 0], [-s, 0, c]]),
            "z": sp.Matrix([[c, -s, 0], [s, c, 0], [0, 0, 1]])}[axis]


def _by_time(value: sp.Matrix, q: Sequence[Any]) -> sp.Matrix:
    return sum((value.diff(e) * e.dot for e in q), sp.zeros(*value.shape))
