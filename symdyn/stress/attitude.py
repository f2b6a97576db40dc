"""Rotating bodies under stress: gimbal lock, flips about the intermediate axis, a fast rotor on a slow platform."""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import partial
from typing import Any

import mpmath
import numpy as np

from symdyn.model.joints import Revolute, Spherical
from symdyn.model.orientation import EulerAngles, EulerParameters
from symdyn.model.symbols import coordinates, parameters, speeds
from symdyn.model.system import System
from symdyn.stress.flow import local_error
from symdyn.stress.record import DEGRADE, FAIL, PASS, Row, within
from symdyn.stress.system_under_test import EPS, SystemUnderTest

DISTANCES = (1e-1, 1e-2, 1e-4, 1e-6, 1e-8, 1e-12, 0.0)


def free_body(orientation: str) -> System:
    """A body that turns freely about its centre of mass, moments 1, 2, 3 kg m^2.

    orientation   "parameters", "angles" (ZYX, speeds are their rates), or "body" (ZYX, speeds are the angular velocity)
    """
    I = parameters("I_x I_y I_z")
    system = System(f"free_body_{orientation}", gravity=[0, 0, 0])
    body = system.add_body("body", mass=1, inertia=I)
    if orientation == "parameters":
        p, omega = coordinates("p0:4"), speeds("w_x w_y w_z")
        system.add_joint(Spherical("ball", system.ground, body, p, orientation=EulerParameters(), speeds=omega))
        system.initial = {p[0]: 1.0}
    elif orientation == "body":
        system.add_joint(Spherical("ball", system.ground, body, coordinates("psi theta phi"),
                                   orientation=EulerAngles("ZYX", speeds="body"), speeds=speeds("w_x w_y w_z")))
    else:
        system.add_joint(Spherical("ball", system.ground, body, coordinates("psi theta phi"), orientation=EulerAngles("ZYX")))
    system.defaults = dict(zip(I, (1.0, 2.0, 3.0), strict=True))
    system.duration = 5.0
    return system


def gimbal(short: bool) -> Iterator[Row]:
    """Pitch past 90 degrees at several distances from gimbal lock, in Euler angles and in Euler parameters."""
    reference = SystemUnderTest(free_body("parameters"))
    rtol, times = 1e-9, np.linspace(0.0, 5.0, 21)
    distances = DISTANCES[::3] if short else DISTANCES
    truth, steps = {}, {}
    for d in distances:
        start = np.array([1.0, 0, 0, 0, d, 2.0, 0.0])
        sol, fine = (reference.run(times, start, rtol=r, atol=r) for r in (rtol, 1e-14))
        truth[d], steps[d] = _rotations(fine), sol.n_steps
        bound = sol.n_steps * 2 * math.sqrt(7) * rtol * (1 + 2 * 5.0)
        yield within("gimbal lock", reference.name, f"Euler parameters past 90 degrees at a distance of {d:g} rad, {sol.n_steps} "
                     "steps at rtol 1e-9: largest error of the rotation against rtol 1e-14", float(
                         np.abs(_rotations(sol) - truth[d]).max()), bound,
                     "steps times the error one may have, which a free rotation magnifies by 1 + omega t",
                     "there is nothing special at 90 degrees")
    yield within("gimbal lock", reference.name, "Euler parameters: most steps over fewest, over all distances",
                 max(steps.values()) / min(steps.values()), 2.0, "the motions differ by the small rotation about x only, which "
                 "changes the angle that is turned by less than a tenth", "the effort does not depend on the distance")
    for kind in ("angles", "body"):
        tested = SystemUnderTest(free_body(kind))
        for d in distances:
            start = np.array([0.0, 0, 0, 0, 2.0, d] if kind == "angles" else [0.0, 0, 0, d, 2.0, 0.0])
            sol = tested.run(times, start, rtol=rtol, atol=rtol, max_steps=100_000)
            yield _angles(tested, kind, d, sol, truth[d], steps[d], rtol)


def _angles(tested: SystemUnderTest, kind: str, d: float, sol: Any, truth: np.ndarray, usual: int, rtol: float) -> Row:
    called = "ZYX angles and their rates" if kind == "angles" else "ZYX angles, speeds in body axes"
    done = f"{called} past 90 degrees at a distance of {d:g} rad: {sol.n_steps} steps and {sol.n_rejected} rejected"
    named = any("gimbal lock" in text for text in (sol.message, *sol.warned))
    origin = "steps times the error one may have times 1 + omega t, over the cosine at the closest, at most by half of the digits"
    if not sol.success:
        warned = named and "t =" in sol.message
        return Row("gimbal lock", tested.name, f"{done}: {sol.message}", None, None, "", DEGRADE if warned
                   else FAIL, "angles have no rates there; the run stops and names it" if named else
                   "the run stops without naming gimbal lock")
    result = float(np.abs(_rotations(sol) - truth).max())
    # Rates of angles grow as one over the distance, and so do errors of the step control on the way past.
    bound = min((sol.n_steps + usual) * 2 * math.sqrt(6) * rtol * (1 + 2 * 5.0) / max(d, 1e-300), 1e-6)
    if result <= bound:
        return Row("gimbal lock", tested.name, f"{done}: largest error of the rotation", result, bound, origin,
                   PASS if sol.n_steps < 100 * usual or named else FAIL,
                   "the motion is right" if sol.n_steps < 100 * usual else "the motion is right, at many times the usual steps, "
                   f"which is {'warned' if named else 'not warned'}")
    return Row("gimbal lock", tested.name, f"{done}: largest error of the rotation", result, bound, origin,
               DEGRADE if named else FAIL, "digits are lost near gimbal lock, with a warning" if named else
               "digits are lost near gimbal lock without a word")


def _rotations(sol: Any) -> np.ndarray:
    return np.asarray(sol.frames[:, 0, 3:])


# -- the intermediate axis


def flips(short: bool) -> Iterator[Row]:
    """A body that flips about its intermediate axis over many periods, against elliptic functions."""
    from symdyn.runtime.integrating.methods import COMPILED

    periods = 30 if short else 1000
    I, a, c = (1.0, 2.0, 3.0), 1.0, 1.05 * math.sqrt(1 / 3)
    tested = SystemUnderTest(free_body("parameters"))
    start = np.array([1.0, 0, 0, 0, a, 0.0, c])
    with mpmath.workdps(40):
        T = _period(I, a, c)
        end = float(periods * T * mpmath.mpf("1.1"))  # a tenth of a period beyond, where the body is in the middle of a flip
        wanted = _omega(I, a, c, end)
        h = mpmath.mpf(10) ** -12
        by = [(_omega(I, a + da, c + dc, end) - wanted) / h for da, dc in ((h, 0), (0, h))]
        growth = float(max(max(abs(e) for e in row) for row in by))
        wanted = np.array([float(e) for e in wanted])
    methods: list[str] = [m for m in ("dop853", "taylor") if m in COMPILED and tested.module.backend == "c"]
    for method in methods or ["DOP853"]:
        rtol = 1e-13
        sol = tested.run(np.array([0.0, end]), start, rtol=rtol, atol=rtol, method=method)
        result = float(np.abs(sol.u[-1] - wanted).max())
        local = local_error(tested, min(end, 20 * float(T)), rtol, np.ones(7), start, method)
        bound = sol.n_steps * (2 * local + 16 * EPS) * growth * 10
        if not sol.success:
            yield Row("flips", tested.name, f"{method}: {periods} periods", None, None, "", FAIL, sol.message)
            continue
        yield within("flips", tested.name, f"{method}: {1.1 * periods:g} periods about the intermediate axis, {sol.n_steps} "
                     f"steps at rtol {rtol:g}: angular velocity against elliptic functions (relative to 1 rad/s)", result, bound,
                     f"steps times their largest error ({local:.1g}, measured) times the derivative of the closed form by its "
                     f"start ({growth:.2g}), ten times for the place in a period where they are made",
                     "the flips stay in time", "the flips are early or late")


def _period(I: tuple[float, ...], a: Any, c: Any) -> Any:
    """Period of one angular velocity's oscillation, s."""
    rate, m = _rate(I, a, c)
    return 4 * mpmath.ellipk(m) / rate


def _rate(I: tuple[float, ...], a: Any, c: Any) -> tuple[Any, Any]:
    """Rate of the elliptic argument, 1/s, and the parameter m = k^2; see Landau and Lifshitz, Mechanics, section 37."""
    I1, I2, I3 = map(mpmath.mpf, I)
    a, c = mpmath.mpf(a), mpmath.mpf(c)
    twice_E, M2 = I1 * a**2 + I3 * c**2, (I1 * a) ** 2 + (I3 * c) ** 2
    rate = mpmath.sqrt((I3 - I2) * (M2 - twice_E * I1) / (I1 * I2 * I3))
    return rate, (I2 - I1) * (twice_E * I3 - M2) / ((I3 - I2) * (M2 - twice_E * I1))


def _omega(I: tuple[float, ...], a: Any, c: Any, t: Any) -> np.ndarray:
    """Angular velocity in body axes at t of a body that starts with (a, 0, c), (3,) of mpmath numbers."""
    I1, I2, I3 = map(mpmath.mpf, I)
    rate, m = _rate(I, a, c)
    sn, cn, dn = (partial(mpmath.ellipfun, name)(mpmath.mpf(t) * rate, m=m) for name in ("sn", "cn", "dn"))
    return np.array([mpmath.mpf(a) * cn, mpmath.mpf(a) * mpmath.sqrt(I1 * (I3 - I1) / (I2 * (I3 - I2))) * sn,
                     mpmath.mpf(c) * dn], dtype=object)


# -- a fast rotor


def platform() -> System:
    """A rotor in a frame that turns about a horizontal axis in a ring about the vertical: a heavy top in a Cardan suspension.

    phi turns the massless ring about z, theta the frame about x, psi the rotor about the frame's z.
    """
    phi, theta, psi = coordinates("phi theta psi")
    g, m, l, I, I_3, b, b_3 = parameters("g m l I I_3 b b_3")
    system = System("rotor_on_platform", gravity=[0, 0, -g])
    ring, frame = system.add_body("ring"), system.add_body("frame", mass=0, inertia=[b, b, b_3])
    rotor = system.add_body("rotor", mass=m, inertia=[I, I, I_3], com=[0, 0, l])
    system.add_joint(Revolute("ring", system.ground, ring, phi))
    system.add_joint(Revolute("frame", ring, frame, theta, axis=[1, 0, 0]))
    system.add_joint(Revolute("rotor", frame, rotor, psi))
    system.defaults = {g: 9.81, m: 2.0, l: 0.1, I: 0.01, I_3: 0.02, b: 0.5, b_3: 0.4}
    system.duration = 10.0
    return system


def rotor(short: bool) -> Iterator[Row]:
    """A rotor at 1e4 rad/s on a slow platform: steady precession."""
    tested = SystemUnderTest(platform())
    g, m, l, I, I_3, b, b_3 = 9.81, 2.0, 0.1, 0.01, 0.02, 0.5, 0.4
    omega, tilt, end = 1e4, 1.0, 0.5 if short else 10.0
    # (I + m l^2 + b - b_3) phi_dot^2 cos theta - I_3 omega phi_dot + m g l = 0, the slow root, without cancellation.
    A = (I + m * l**2 + b - b_3) * math.cos(tilt)
    rate = 2 * m * g * l / (I_3 * omega + math.sqrt((I_3 * omega) ** 2 - 4 * A * m * g * l))
    start = np.array([0.0, tilt, 0.0, rate, 0.0, omega - rate * math.cos(tilt)])
    scales = np.array([1.0, 1.0, omega * end, 1.0, 1.0, omega])
    rtol = 1e-12
    sol = tested.run((0.0, end), start, rtol=rtol, atol=rtol * scales)
    if not sol.success:
        yield Row("fast rotor", tested.name, f"{end:g} s at 1e4 rad/s", None, None, "", FAIL, sol.message)
        return
    result = max(float(np.abs(sol.q[:, 1] - tilt).max()), float(np.abs(sol.q[:, 0] - rate * sol.t).max()))
    local = local_error(tested, end, rtol, scales, start)
    bound = sol.n_steps * (2 * local + 16 * EPS) * (1 + end)
    yield within("fast rotor", tested.name, f"rotor at 1e4 rad/s on a platform that precesses at {rate:.3g} rad/s, {end:g} s, "
                 f"{sol.n_steps} steps: largest error of tilt and precession, rad", result, bound, "steps times their largest "
                 f"error ({local:.1g}, measured), which nutation keeps and precession lets grow by 1 + t", "the platform "
                 "precesses steadily, as it must", "the platform leaves its steady precession")
    energy = sol.energy_error()
    yield within("fast rotor", tested.name, "energy over the same motion, most of it the rotor's", energy,
                 sol.n_steps * (2 * local + 16 * EPS) * 2, "twice the error of the rotor's speed, in its scale",
                 "energy is kept as the tolerances promise")
