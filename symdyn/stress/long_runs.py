"""Long runs and stiff ones: drift of energy and constraints, stiffness over many decades."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import mpmath
import numpy as np

from symdyn.errors import ArgumentError
from symdyn.model.joints import Prismatic
from symdyn.model.symbols import coordinates, parameters
from symdyn.model.system import System
from symdyn.runtime.integrating.methods import COMPILED
from symdyn.stress.flow import local_error
from symdyn.stress.record import DEGRADE, FAIL, Row, within
from symdyn.stress.system_under_test import EPS, SystemUnderTest

DECADES = tuple(10.0**k for k in range(0, 13, 2))
# Factor of steps that a stiff method may take for stiffness that is 1e12 times as large: stiff parts die away within
# a time that is 1e6 times as short, and each decade of time from there on may cost once the steps of the soft problem.
MORE = 7.0


def constraint_drift(short: bool) -> Iterator[Row]:
    """Violations of constraints after a million steps."""
    wanted = 20_000 if short else 1_000_000
    for name in ("pendulum_absolute",) if short else ("pendulum_absolute", "four_bar"):
        tested = SystemUnderTest(name)
        longest = 0.01
        end = wanted * longest
        sol = tested.run(np.linspace(0.0, end, 1001), rtol=1e-6, atol=1e-6, max_step=longest)
        if not sol.success:
            yield Row("constraint drift", name, f"{end:g} s", None, None, "", FAIL, sol.message)
            continue
        far = float(np.abs(sol.q).max())
        violated = np.abs(sol.constraint_violation).max(axis=1)
        yield within("constraint drift", name, f"{sol.n_steps} steps of {longest:g} s at most: residuals of constraints over the "
                     "length, at 1001 times", float(violated.max()), max(1e-12, 16 * EPS * far),
                     "projection after every step; 1e-12, or what coordinates of this size resolve",
                     f"after a million steps as after the first (the last tenth: {violated[-100:].max():.1g})" if not short else
                     "after all steps as after the first")


def energy_drift(short: bool) -> Iterator[Row]:
    """Energy of a pendulum over ten thousand periods, by every compiled method that is meant for it."""
    tested = SystemUnderTest("pendulum")
    periods = 200 if short else 10_000
    one = tested.run((0.0, 10.0), rtol=1e-10)
    crossing = np.flatnonzero((one.q[:-1, 0] - one.q[:, 0].mean()) * (one.q[1:, 0] - one.q[:, 0].mean()) < 0)
    period = 2 * float(np.diff(one.t[crossing]).mean())
    for method in ("dop853", "taylor", "gauss"):
        if method not in COMPILED or tested.module.backend != "c":
            continue
        rtol = 1e-13
        end = periods * period
        options: dict[str, Any] = {"max_step": period / 40} if method == "gauss" else {}
        try:
            sol = tested.run(np.linspace(0.0, end, 1001), rtol=rtol, method=method, **options)
        except ArgumentError as error:
            yield Row("energy drift", tested.name, f"{method}: {periods} periods", None, None, "", FAIL, str(error))
            continue
        done = f"{method}: {periods} periods of {period:.4g} s, {sol.n_steps} steps: energy error"
        if not sol.success:
            yield Row("energy drift", tested.name, done, None, None, "", FAIL, sol.message)
            continue
        if method == "gauss":
            yield within("energy drift", tested.name, done, sol.energy_error(), 1e-13, "symmetric, symplectic steps keep "
                         "energy but for rounding, which compensated summation keeps from adding up: a few hundred roundings",
                         "energy does not drift")
            continue
        scales = np.abs(one.x).max(axis=0)
        local = local_error(tested, 4 * period, rtol, np.ones(len(scales)), None, method)
        gradient = float(np.linalg.norm(scales)) * 2 * 9.81
        size, _ = sol.energy_scale
        bound = sol.n_steps * (2 * local + 8 * EPS) * max(gradient, size) / size
        yield within("energy drift", tested.name, done, sol.energy_error(), bound, "steps times their largest error "
                     f"({local:.1g}, measured) and roundings, all to one side",
                     "energy drifts no faster than errors of steps add up")


# -- stiffness


def spring_chain() -> System:
    """A soft and a stiff oscillator one on the other: mass 1 on a spring k_1 to the ground, mass 2 on a spring k_2 and a damper
    d_2 to mass 1. Linear, so that the matrix exponential is the solution."""
    x_1, x_2 = coordinates("x1:3")
    m_1, m_2, k_1, k_2, d_2 = parameters("m_1 m_2 k_1 k_2 d_2")
    system = System("spring_chain", planar=True)
    first, second = system.add_body("first", mass=m_1), system.add_body("second", mass=m_2)
    system.add_joint(Prismatic("first", system.ground, first, x_1, axis=[1, 0]))
    system.add_joint(Prismatic("second", first, second, x_2, axis=[1, 0]))
    system.add_joint_force("first", -k_1 * x_1)
    system.add_joint_force("second", -k_2 * x_2 - d_2 * x_2.dot)
    system.defaults = {m_1: 1.0, m_2: 1.0, k_1: 1.0, k_2: 1.0, d_2: 1.0}
    system.initial = {x_1: 1.0, x_2: 0.1}
    system.units = {k_1: "N/m", k_2: "N/m", d_2: "N s/m"}
    return system


def stiffness(short: bool) -> Iterator[Row]:
    """A damped spring whose stiffness goes through twelve decades, by implicit methods; explicit ones may take long."""
    tested = SystemUnderTest(spring_chain())
    end, rtol = 10.0, 1e-8
    methods = ["radau"] if "radau" in COMPILED and tested.module.backend == "c" else ["Radau"]
    for method in [*methods, "auto", "dop853"]:
        if method == "dop853" and tested.module.backend != "c":
            continue
        taken = []
        for k in DECADES[::3] if short else DECADES:
            # Damping in proportion to the root of stiffness: half of what is critical.
            p = tested.module.parameters({"k_2": k, "d_2": math.sqrt(k)})
            wanted = _exact(k, math.sqrt(k), tested.start, end)
            try:
                sol = tested.run(np.array([0.0, end]), params=p, rtol=rtol, atol=rtol * 1e-2, method=method, max_steps=200_000)
            except ArgumentError as error:
                yield Row("stiffness", tested.name, f"{method}: k = {k:g} N/m", None, None, "", FAIL, str(error))
                continue
            done = f"{method}: k = {k:g} N/m, {sol.n_steps} steps in {end:g} s"
            if not sol.success:
                slow = sol.method == "dop853" and sol.n_steps >= 200_000 and method != "auto"
                yield Row("stiffness", tested.name, f"{done}: {sol.message[:100]}", None, None, "", DEGRADE if slow else FAIL,
                          "an explicit method takes steps as short as the stiffness asks; use an implicit one, or method='auto'"
                          if slow else f"it stops early; why this method: {getattr(sol, 'why', '')}")
                continue
            taken.append(sol.n_steps)
            # Slow entries only: positions, the speed of mass 1; the spring's own speed follows from them.
            result = float(np.abs(sol.x[-1, :3] - wanted[:3]).max())
            bound = sol.n_steps * 2 * math.sqrt(4) * rtol
            yield within("stiffness", tested.name, f"{done}: error of positions and slow speed", result, bound,
                         "steps times the error one may have; a damped motion magnifies none",
                         "the slow motion is right", "the slow motion is wrong")
        if method in methods and len(taken) > 1:
            yield within("stiffness", tested.name, f"{method}: most steps over those at the least stiffness ({taken})",
                         max(taken) / taken[0], MORE, "what is stiff dies away in a time shorter by the root of the stiffness; "
                         "each decade of time from there on may cost once the steps of the soft problem",
                         "stiffness does not shorten the steps", "stiffness shortens the steps of an implicit method")


def _exact(k: float, d: float, x0: np.ndarray, end: float) -> np.ndarray:
    """The state at the end by the matrix exponential, 40 digits more than the largest entry of the matrix takes away."""
    with mpmath.workdps(60):
        M = mpmath.matrix([[2, 1], [1, 1]])
        K, D = mpmath.matrix([[1, 0], [0, mpmath.mpf(k)]]), mpmath.matrix([[0, 0], [0, mpmath.mpf(d)]])
        inverse = M**-1
        A = mpmath.zeros(4, 4)
        for i in range(2):
            A[i, 2 + i] = 1
            for j in range(2):
                A[2 + i, j], A[2 + i, 2 + j] = -(inverse * K)[i, j], -(inverse * D)[i, j]
        values, right = mpmath.eig(A)
        weights = mpmath.lu_solve(right, mpmath.matrix([mpmath.mpf(float(v)) for v in x0]))
        state = [sum(right[i, j] * weights[j] * mpmath.exp(values[j] * end) for j in range(4)) for i in range(4)]
        return np.array([float(mpmath.re(v)) for v in state])


