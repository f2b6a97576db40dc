"""Single bodies whose motion is known: two tops and a body that nothing acts on, in Euler angles or Euler parameters."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from symdyn import rotation
from symdyn.model.bodies import Body
from symdyn.model.joints import Spherical
from symdyn.model.orientation import EulerAngles, EulerParameters
from symdyn.model.symbols import coordinates, parameters, speeds
from symdyn.model.system import System

# Data of the free body: principal inertia (kg m^2) and angular velocity at the start, body axes (rad/s): nearly about the axis of
# the middle moment, so that it flips.
FREE_INERTIA = (1.0, 2.0, 3.0)
FREE_OMEGA = (1e-3, 1.0, 1e-3)
# Data of Lagrange's top about its fixed point: inertia across and about its axis (kg m^2), weight times lever (N m), inclination
# at the start (rad), spin (rad/s).
TOP_INERTIA, TOP_MOMENT, TOP_TILT, TOP_SPIN = (1.0, 0.5), 3.0, math.pi / 3, 12.0


def free_start() -> tuple[tuple[float, float, float], tuple[float, float, float]]:
    """Euler angles ZXZ of the free body at the start, z of the n-frame along the angular momentum, and their rates."""
    L = [i * w for i, w in zip(FREE_INERTIA, FREE_OMEGA, strict=True)]
    theta, psi = math.acos(L[2] / math.hypot(*L)), math.atan2(L[0], L[1])
    w1, w2, w3 = FREE_OMEGA
    phi_dot = (w1 * math.sin(psi) + w2 * math.cos(psi)) / math.sin(theta)
    return (0.0, theta, psi), (phi_dot, w1 * math.cos(psi) - w2 * math.sin(psi), w3 - phi_dot * math.cos(theta))


def free_body(orientation: str = "angles") -> System:
    """A rigid body that nothing acts on, held at its centre of mass; it turns nearly about the axis of its middle moment of
    inertia, and flips again and again.

    The n-frame has z along the angular momentum. Coordinates phi, theta, psi: Euler angles ZXZ, rad; or Euler parameters.
    Parameters: I1, I2, I3 (kg m^2). Starts with FREE_OMEGA.
    """
    system = System("torque_free_body", gravity=[0, 0, 0])
    I = parameters("I1 I2 I3")
    body = system.add_body("body", mass=1, inertia=I)
    angles, rates = free_start()
    _hold(system, body, orientation, "ZXZ", angles, rates, FREE_OMEGA)
    system.defaults = dict(zip(I, FREE_INERTIA, strict=True))
    system.duration = 60.0
    return system


def lagrange_top(orientation: str = "angles") -> System:
    """Lagrange's top: symmetric, heavy, with a fixed point on its axis; it starts at its greatest height without precession.

    The n-frame has z upward. Coordinates phi (precession), theta (inclination), psi (spin): Euler angles ZXZ, rad; or Euler
    parameters. Parameters: I1 across the axis and I3 about it, at the centre of mass (kg m^2), m (kg), l from the fixed point
    (m), g (m/s^2, along -z).
    """
    I1, I3, m, length, g = parameters("I1 I3 m l g")
    system = System("lagrange_top", gravity=[0, 0, -g])
    body = system.add_body("top", mass=m, inertia=[I1, I1, I3], com=[0, 0, length])
    _hold(system, body, orientation, "ZXZ", (0.0, TOP_TILT, 0.0), (0.0, 0.0, TOP_SPIN), (0.0, 0.0, TOP_SPIN))
    # About the fixed point I1 + m l^2 = 1 kg m^2.
    system.defaults = {I1: TOP_INERTIA[0] - 0.5, I3: TOP_INERTIA[1], m: 2.0, length: 0.5, g: TOP_MOMENT}
    system.duration = 10.0
    return system


def heavy_top(orientation: str = "angles") -> System:
    """The fast heavy top: 15 kg, 1 m from its fixed point, spinning at 150 rad/s about its axis, which starts level.

    The n-frame has z upward; the axis is y of the body. Coordinates a, b, c: Euler angles ZXY, rad, whose last is the spin; or
    Euler parameters. Parameters: I1 across the axis and I2 about it, at the centre of mass (kg m^2), m (kg), l (m), g (m/s^2).
    Source: Bruls and Cardona, J. Comput. Nonlinear Dyn. 5 (2010) 031002.
    """
    I1, I2, m, length, g = parameters("I1 I2 m l g")
    system = System("heavy_top", gravity=[0, 0, -g])
    body = system.add_body("top", mass=m, inertia=[I1, I2, I1], com=[0, length, 0])
    turning = (0.0, 150.0, -4.61538)
    _hold(system, body, orientation, "ZXY", (0.0, 0.0, 0.0), (turning[2], turning[0], turning[1]), turning)
    system.defaults = {I1: 0.234375, I2: 0.46875, m: 15.0, length: 1.0, g: 9.81}
    system.duration = 2.0
    return system


def _hold(system: System, body: Body, orientation: str, sequence: str, angles: Sequence[float], rates: Sequence[float],
          omega: Sequence[float]) -> None:
    """Hold a body at its origin, and start it: Euler angles with their rates, or Euler parameters with the angular velocity in
    body axes."""
    if orientation == "angles":
        q = coordinates("phi theta psi" if sequence == "ZXZ" else "a b c")
        system.add_joint(Spherical("pivot", system.ground, body, q, EulerAngles(sequence)))
        system.initial = {**dict(zip(q, angles, strict=True)), **{s.dot: v for s, v in zip(q, rates, strict=True)}}
        return
    q, w = coordinates("e0:4"), speeds("omega_x omega_y omega_z")
    system.add_joint(Spherical("pivot", system.ground, body, q, EulerParameters(), speeds=w))
    e = rotation.to_parameters(rotation.from_euler(sequence, np.array(angles)))
    system.initial = {**dict(zip(q, (float(v) for v in e), strict=True)), **dict(zip(w, omega, strict=True))}
