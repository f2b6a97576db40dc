"""Where matrices are singular or nearly so: massless links, dead points, folds, stretched arms, redundant constraints; forces
of the user that fail."""

from __future__ import annotations

import math
import warnings
from collections.abc import Iterator
from typing import Any

import numpy as np
import sympy as sp

from symdyn.errors import ModelWarning, SymdynError
from symdyn.model.external import External
from symdyn.model.joints import Prismatic, Revolute
from symdyn.model.symbols import coordinates, parameters, time
from symdyn.model.system import System
from symdyn.stress.record import DEGRADE, FAIL, Row, within
from symdyn.stress.reference import conditions
from symdyn.stress.system_under_test import EPS, SystemUnderTest
from symdyn.systems import get

RTOL = 1e-10
PROJECTED = "steps times the error one may have, doubled by the projection, tenfold for the gradient of the energy in its scale"


def two_points() -> System:
    """Two massless rods with a point mass at each end: with m_1 = 0, stretched out (q2 = 0), the mass matrix is singular."""
    q_1, q_2 = coordinates("q1:3")
    m_1, m_2, l, g = parameters("m_1 m_2 l g")
    system = System("two_points", gravity=[0, -g])
    upper, lower = system.add_body("upper", mass=m_1, com=[l, 0]), system.add_body("lower", mass=m_2, com=[l, 0])
    system.add_joint(Revolute("shoulder", system.ground, upper, q_1))
    system.add_joint(Revolute("elbow", upper, lower, q_2, parent_point=[l, 0]))
    system.defaults = {m_1: 1.0, m_2: 1.0, l: 1.0, g: 9.81}
    system.initial = {q_1: -0.5, q_2: 1.0}
    system.duration = 2.0
    return system


def massless(short: bool) -> Iterator[Row]:
    """Links without mass, and nearly so."""
    tested = SystemUnderTest(two_points())
    for m in (1e-4, 1e-8, 1e-12, 0.0):
        p = tested.module.parameters({"m_1": m})
        sol = tested.run((0.0, 2.0), params=p, rtol=RTOL, max_steps=200_000)
        done = f"mass of the upper link {m:g} kg of 1 kg, through q2 = 0: {sol.n_steps} steps"
        if not sol.success:
            yield _named("massless links", tested.name, done, sol, ("singular", "mass", "pivot", "M_tilde"))
            continue
        # Near q2 = 0 the condition is 1/m; half of it is felt in the energy, which is quadratic.
        yield within("massless links", tested.name, f"{done}: energy error", sol.energy_error(),
                     sol.n_steps * 2 * math.sqrt(4) * RTOL * (1 + 1 / math.sqrt(max(m, EPS))),
                     "steps times the error one may have times speeds that grow by the root of the mass ratio",
                     "energy survives the whip of the light link")
    q_1, q_2 = coordinates("q1:3")
    last = System("massless_tip", gravity=[0, -9.81])
    rod = last.add_body("rod", mass=1.0, inertia=0.1, com=[0.5, 0])
    tip = last.add_body("tip")
    last.add_joint(Revolute("shoulder", last.ground, rod, q_1))
    last.add_joint(Revolute("wrist", rod, tip, q_2, parent_point=[1, 0]))
    yield _rejected("massless links", "a last link without mass and inertia", lambda: SystemUnderTest(last).run((0.0, 1.0)),
                    ("wrist", "q2"))


def _rejected(check: str, what: str, run: Any, words: tuple[str, ...]) -> Row:
    """The row of what must be rejected, by a named error or stop that holds one of the words."""
    try:
        sol = run()
    except SymdynError as error:
        said = str(error)
    else:
        if sol.success:
            return Row(check, sol.module.name, what, None, None, "", FAIL, "it runs as if nothing were wrong")
        said = sol.message
    named = any(word in said for word in words)
    return Row(check, "-", f"{what}: {said[:300]}", None, None, "", DEGRADE if named else FAIL,
               "it is rejected, and the message names the culprit" if named else "the message does not name the culprit")


def _named(check: str, name: str, done: str, sol: Any, words: tuple[str, ...]) -> Row:
    """The row of a run that stopped: graceful if it says time, state, and one of the words."""
    good = "stopped at t =" in sol.message and "state there" in sol.message and any(word in sol.message for word in words)
    return Row(check, name, f"{done}; {sol.message[:300]}", None, None, "", DEGRADE if good else FAIL,
               "it stops with time, state and reason" if good else "the message lacks time, state or reason")


# -- singular configurations


def configurations(short: bool) -> Iterator[Row]:
    """Mechanisms that pass positions where their constraints lose rank."""
    cases: list[tuple[str, System, float]] = [
        ("slider-crank through its fold", get("slider_crank"), 10.0),
        ("two windows through the flat position", get("n_four_bar", n=2), 20.0),
        ("four-bar, a parallelogram, through its dead point", get("n_four_bar", n=1), 10.0)]
    if not short:
        cases.append(("eight windows through the flat position", get("n_four_bar", n=8), 10.0))
    for what, system, end in cases:
        tested = SystemUnderTest(system)
        end = end / 4 if short else end
        sol = tested.run((0.0, end), rtol=RTOL, max_steps=200_000)
        done = f"{what}: {end:g} s, {sol.n_steps} steps"
        if not sol.success:
            yield _named("singular positions", tested.name, done, sol, ("rank", "gradient"))
            continue
        rank = int(sol.rank.min())
        passes = _closed(system.name, sol)
        yield within("singular positions", tested.name, f"{done}, rank down to {rank} at output times: energy error",
                     sol.energy_error(), sol.n_steps * 2 * math.sqrt(sol.x.shape[1]) * 2 * RTOL * 10,
                     PROJECTED, "energy passes the singular position")
        if passes is not None:
            result, where = passes
            yield within("singular positions", tested.name, f"{done}: distance from the branch {where}", result, 1e-6,
                         "half of the digits: branches meet quadratically where they cross", "it stays on its branch",
                         "it leaves its branch at the singular position")
    yield from _four_bar(short)
    yield from _stretched()


def _closed(name: str, sol: Any) -> tuple[float, str] | None:
    if name == "slider_crank":
        return float(np.abs(sol.q[:, 1] + 2 * sol.q[:, 0]).max()), "phi = -2 theta, rad"
    if name.startswith("n_four_bar"):
        n = (sol.q.shape[1] - 1) // 2
        return float(np.abs(sol.q[:, :n + 1] - sol.q[:, :1]).max()), "of equal angles, rad"
    return None


def _four_bar(short: bool) -> Iterator[Row]:
    """A four-bar linkage whose lengths let it fold (l1 + d = l2 + l3), spun through the position where all bars are in line."""
    system = get("four_bar")
    d, l_1, l_2, l_3 = (next(s for s in system.defaults if s.name == n) for n in ("d", "l1", "l2", "l3"))
    system.defaults |= {d: 2.0, l_1: 0.8, l_2: 1.4, l_3: 1.4}
    q_1, q_2, q_3 = (next(s for s in system.initial if s.name == f"q{k}") for k in (1, 2, 3))
    x, y = 2.0 - 0.8 * math.cos(1.0), -0.8 * math.sin(1.0)
    r = math.hypot(x, y)
    second = math.atan2(y, x) + math.acos(r / 2.8)
    third = math.atan2(y, x) - math.acos(r / 2.8)
    system.initial = {q_1: 1.0, q_2: second - 1.0, q_3: third - second, q_1.dot: -6.0}
    tested = SystemUnderTest(system)
    end = 1.0 if short else 5.0
    sol = tested.run((0.0, end), rtol=RTOL, max_steps=200_000)
    done = f"four-bar with l1 + d = l2 + l3, driven through its change point: {end:g} s, {sol.n_steps} steps"
    if not sol.success:
        yield _named("singular positions", tested.name, done, sol, ("rank", "gradient", "depend"))
        return
    turns = float(np.ptp(sol.q[:, 0])) / (2 * math.pi)
    yield within("singular positions", tested.name, f"{done}, {turns:.2g} turns of the crank: energy error",
                 sol.energy_error(), sol.n_steps * 2 * math.sqrt(6) * 2 * RTOL * 10, PROJECTED,
                 "energy passes the change point")


def _stretched() -> Iterator[Row]:
    """An arm whose tip is held at its full reach: the constraint's gradient vanishes along the arm."""
    base = get("two_link_arm").defaults
    l_1, l_2 = (next(s for s in base if s.name == name) for name in ("l1", "l2"))
    reach = base[l_1] + base[l_2]
    q_1, q_2 = coordinates("q1 q2")
    for short_of in (0.0, 1e-8):
        held = get("two_link_arm")
        # The squared distance of the tip from the shoulder is what it is at full reach, less a little.
        far = l_1**2 + l_2**2 + 2 * l_1 * l_2 * sp.cos(q_2) - (reach - short_of) ** 2
        held.add_constraint(far, name="reach")
        bend = math.acos(max(-1.0, min(1.0, ((reach - short_of) ** 2 - base[l_1] ** 2 - base[l_2] ** 2)
                                       / (2 * base[l_1] * base[l_2]))))
        held.initial = {q_1: 0.0, q_2: bend}
        yield from _held(held, f"arm held {short_of:g} m short of its full reach")


def _held(system: System, what: str) -> Iterator[Row]:
    try:
        with warnings.catch_warnings():  # that the constraint holds nothing at full reach is what is looked at
            warnings.simplefilter("ignore", ModelWarning)
            tested = SystemUnderTest(system)
        sol = tested.run((0.0, 0.5), rtol=RTOL, max_steps=50_000)
    except SymdynError as error:
        named = any(word in str(error) for word in ("reach", "rank", "gradient"))
        yield Row("singular positions", system.name, f"{what}: {str(error)[:200]}", None, None, "", DEGRADE if named else FAIL,
                  "it is rejected, and the message names the constraint" if named else "the message does not name the constraint")
        return
    if not sol.success:
        yield _named("singular positions", tested.name, what, sol, ("reach", "rank", "gradient"))
        return
    yield within("singular positions", tested.name, f"{what}: 0.5 s, {sol.n_steps} steps: change of the elbow's angle, rad",
                 float(np.ptp(sol.q[:, 1])), 1e-4, "the distance from full reach is quadratic in the angle: the root of 1e-8",
                 "the arm turns as one, stretched")


# -- redundant constraints


def redundant(short: bool) -> Iterator[Row]:
    """The same constraints twice and three times, also multiplied: the accelerations are those of one."""
    plain = get("four_bar")
    first = SystemUnderTest(plain)
    rng = np.random.default_rng(5)
    x = np.array([np.concatenate(first.module.consistent(first.start[:3] + rng.uniform(-0.3, 0.3, 3), rng.uniform(-2, 2, 3)))
                  for _ in range(10)])
    wanted = first.evaluate("rhs", 0.0, x)
    for times in (2, 3):
        system = get("four_bar")
        last, l_3, d = system.bodies[-1], *(next(s for s in system.defaults if s.name == n) for n in ("l3", "d"))
        for k in range(1, times):
            system.close_loop(Revolute(f"again{k}", system.ground, last, parent_point=[d, 0], child_point=[l_3, 0]))
        tested = SystemUnderTest(system)
        result = np.array([tested.module.rhs(0.0, row) for row in x])
        size = np.abs(wanted).max()
        chain = tested.equations.tape("rhs").longest_chain()
        condition = float(conditions(first, np.zeros(len(x)), x).max())
        yield within("redundant", tested.name, f"last hinge closed {times} times, 10 states: accelerations against those with "
                     "one, relative", float(np.abs(result - wanted).max() / size), 4 * EPS * chain * condition,
                     f"rounding of {chain} operations in a chain times the condition ({condition:.2g}), of both sides",
                     "redundant constraints change nothing")
        sol = tested.run((0.0, 1.0 if short else 5.0), rtol=RTOL)
        if not sol.success:
            yield _named("redundant", tested.name, f"last hinge closed {times} times", sol, ("rank", "depend"))
            continue
        yield within("redundant", tested.name, f"last hinge closed {times} times, {sol.t[-1]:g} s, {sol.n_steps} steps: energy "
                     "error", sol.energy_error(), sol.n_steps * 2 * math.sqrt(6) * 2 * RTOL * 10, PROJECTED,
                     "energy is kept with redundant constraints")


# -- forces of the user that fail


def user_forces(short: bool) -> Iterator[Row]:
    """A force of the user that becomes NaN or infinite, in C and in Python: the run stops, and names it."""
    from symdyn.stress.extremes import stopped

    for bad in ("nan", "inf"):
        value = "0.0/zero" if bad == "nan" else "1.0/zero"
        text = ("static int gust(const double *in, double *out) { const double zero = in[0] - in[0]; "
                f"out[0] = in[0] > 0.5 ? {value} : 1.0; return 0; }}")

        # The generated module holds this function's text, so that it may use its argument and np only.
        if bad == "nan":
            def python(v):  # type: ignore[no-untyped-def]
                return np.where(v > 0.5, np.nan, 1.0)
        else:
            def python(v):  # type: ignore[no-untyped-def]
                return np.where(v > 0.5, np.inf, 1.0)
        gust = External("gust", ["v"], c=text, python=python)
        system = System("blown_cart", planar=True)
        x, m = coordinates("x"), parameters("m")
        cart = system.add_body("cart", mass=m)
        system.add_joint(Prismatic("rail", system.ground, cart, x, axis=[1, 0]))
        system.add_joint_force("rail", gust(time))
        system.defaults = {m: 1.0}
        system.duration = 1.0
        for backend in ("c", "numpy"):
            tested = SystemUnderTest(system)
            try:
                tested.module = tested.equations.compile(backend=backend)
            except SymdynError as error:
                yield Row("user forces", system.name, backend, None, None, "", FAIL, str(error))
                continue
            sol = tested.run((0.0, 1.0), rtol=RTOL)
            yield stopped("user forces", system.name, f"{backend}: a force of the user is {bad} from t = 0.5 s on", sol, 0.5,
                          ("gust",))


