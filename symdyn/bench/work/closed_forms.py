"""Motions in closed form, at 25 digits: states at given times, in the coordinates of Euler angles or of the joint.

Source: Whittaker, A Treatise on the Analytical Dynamics of Particles and Rigid Bodies, sections 44, 69 and 71. The numbers at the
start are the very floats that the integrators begin with.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import mpmath

from symdyn.bench.work import bodies

_DIGITS = 25
# Data of the catalogue's pendulum: gravity (m/s^2), length (m), angle at the start (rad), at rest.
_PENDULUM = (9.81, 1.0, 2.0)


def pendulum(times: Sequence[float]) -> list[list[float]]:
    """q1, its rate: theta = 2 asin(k sn(K + w t)), k = sin(theta0/2), w^2 = g/l; (n_t, 2)."""
    with mpmath.workdps(_DIGITS):
        g, length, start = map(mpmath.mpf, _PENDULUM)
        w, k = mpmath.sqrt(g / length), mpmath.sin(start / 2)
        m = k**2
        K = mpmath.ellipk(m)
        phases = [K + w * mpmath.mpf(t) for t in times]
        return [[float(2 * mpmath.asin(k * mpmath.ellipfun("sn", u, m=m))),
                 float(2 * k * w * mpmath.ellipfun("cn", u, m=m))] for u in phases]


def lagrange_top(times: Sequence[float]) -> list[list[float]]:
    """phi, theta, psi and their rates, (n_t, 6).

    u = cos theta: u_dot^2 = (u0 - u) (beta (1 - u^2) - b^2 (u0 - u)), b = I3 w3/I1, beta = 2 m g l/I1, starting at the root u0
    with no precession; u = u1 + (u0 - u1) sn^2(K + c t), phi_dot = b (u0 - u)/(1 - u^2), psi_dot = w3 - phi_dot u.
    """
    with mpmath.workdps(_DIGITS):
        mpf = mpmath.mpf
        I1, I3 = map(mpf, bodies.TOP_INERTIA)
        w3, u0 = mpf(bodies.TOP_SPIN), mpmath.cos(mpf(bodies.TOP_TILT))
        b, beta = I3 * w3 / I1, 2 * mpf(bodies.TOP_MOMENT) / I1
        root = mpmath.sqrt(b**4 - 4 * beta * (b**2 * u0 - beta))
        u1, u3 = (b**2 - root) / (2 * beta), (b**2 + root) / (2 * beta)
        m, c = (u0 - u1) / (u3 - u1), mpmath.sqrt(beta * (u3 - u1)) / 2
        K = mpmath.ellipk(m)

        def height(t: Any) -> Any:
            return u1 + (u0 - u1) * mpmath.ellipfun("sn", K + c * t, m=m)**2

        def precession(t: Any) -> Any:
            u = height(t)
            return b * (u0 - u) / (1 - u**2)

        phi = _integrals(precession, times, K / c)
        psi = _integrals(lambda t: w3 - precession(t) * height(t), times, K / c)
        rows = []
        for t, turned, spun in zip(times, phi, psi, strict=True):
            u, phase = height(mpf(t)), K + c * mpf(t)
            sn, cn, dn = (mpmath.ellipfun(kind, phase, m=m) for kind in ("sn", "cn", "dn"))
            rate = -2 * (u0 - u1) * sn * cn * dn * c / mpmath.sqrt(1 - u**2)
            rows.append([float(v) for v in (turned, mpmath.acos(u), spun, precession(mpf(t)), rate, w3 - precession(mpf(t)) * u)])
        return rows


def free_body(times: Sequence[float]) -> list[list[float]]:
    """phi, theta, psi (ZXZ, z along the angular momentum L) and their rates, (n_t, 6).

    Where L^2 > 2 T I2 the angular velocity is (A1 cn, A2 sn, A3 dn) of lambda t + u0; cos theta = I3 w3/L,
    tan psi = I1 w1/(I2 w2), phi_dot = L (I1 w1^2 + I2 w2^2)/(L^2 - I3^2 w3^2).
    """
    with mpmath.workdps(_DIGITS):
        mpf, sqrt = mpmath.mpf, mpmath.sqrt
        I1, I2, I3 = map(mpf, bodies.FREE_INERTIA)
        (_, theta, psi), (phi_dot, theta_dot, psi_dot) = [[mpf(v) for v in row] for row in bodies.free_start()]
        sin, cos = mpmath.sin, mpmath.cos
        start = (phi_dot * sin(theta) * sin(psi) + theta_dot * cos(psi), phi_dot * sin(theta) * cos(psi) - theta_dot * sin(psi),
                 psi_dot + phi_dot * cos(theta))
        T2 = sum(i * w**2 for i, w in zip((I1, I2, I3), start, strict=True))
        L2 = sum((i * w)**2 for i, w in zip((I1, I2, I3), start, strict=True))
        L = sqrt(L2)
        A1 = sqrt((T2 * I3 - L2) / (I1 * (I3 - I1)))
        A2 = sqrt((T2 * I3 - L2) / (I2 * (I3 - I2)))
        A3 = sqrt((L2 - T2 * I1) / (I3 * (I3 - I1)))
        rate = sqrt((I3 - I2) * (L2 - T2 * I1) / (I1 * I2 * I3))
        m = (I2 - I1) * (T2 * I3 - L2) / ((I3 - I2) * (L2 - T2 * I1))
        K = mpmath.ellipk(m)
        # The equations w1_dot = (I2 - I3)/I1 w2 w3, ... hold for signs whose product with the rate is positive.
        u0 = mpmath.ellipf(mpmath.atan2(start[1] / A2, start[0] / A1), m)

        def omega(t: Any) -> tuple[Any, Any, Any]:
            u = rate * t + u0
            return (A1 * mpmath.ellipfun("cn", u, m=m), A2 * mpmath.ellipfun("sn", u, m=m), A3 * mpmath.ellipfun("dn", u, m=m))

        def precession(t: Any) -> Any:
            w1, w2, w3 = omega(t)
            return L * (I1 * w1**2 + I2 * w2**2) / (L2 - (I3 * w3)**2)

        rows = []
        for t, turned in zip(times, _integrals(precession, times, K / rate), strict=True):
            w1, w2, w3 = omega(mpf(t))
            u = rate * mpf(t) + u0
            quarters = mpmath.floor((u + K) / (2 * K))
            amplitude = (-1)**int(quarters) * mpmath.asin(w2 / A2) + quarters * mpmath.pi
            near, result = mpmath.pi / 2 - amplitude, mpmath.atan2(I1 * w1, I2 * w2)
            spin = result + 2 * mpmath.pi * mpmath.nint((near - result) / (2 * mpmath.pi))
            tilt, turning = mpmath.acos(I3 * w3 / L), precession(mpf(t))
            rows.append([float(v) for v in (turned, tilt, spin, turning, w1 * cos(spin) - w2 * sin(spin),
                                            w3 - turning * cos(tilt))])
        return rows


def _integrals(rate: Callable[[Any], Any], times: Sequence[float], quarter: Any) -> list[Any]:
    """Integrals of a rate from 0 to every time, in pieces of about a quarter of its period."""
    total, now, result = mpmath.mpf(0), mpmath.mpf(0), []
    for t in times:
        goal = mpmath.mpf(t)
        pieces = max(1, int(mpmath.ceil((goal - now) / quarter)))
        total += mpmath.quad(rate, mpmath.linspace(now, goal, pieces + 1))
        now = goal
        result.append(total)
    return result
