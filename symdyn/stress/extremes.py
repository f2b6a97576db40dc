"""Extremes: of step sizes, tolerances, times, states, mass ratios; inputs that are not numbers."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from symdyn.errors import SymdynError
from symdyn.stress.finding import Finding, first_order_row, judged
from symdyn.stress.flow import Path, demand_motion, flow, growth_to, path
from symdyn.stress.motion import MAGNIFIED, energy_row, reversible
from symdyn.stress.record import DEGRADE, FAIL, PASS, MotionStops, NotApplicable, Row, within
from symdyn.stress.rounding import FEW, Measured, states
from symdyn.stress.statements import emitted
from symdyn.stress.system_under_test import EPS, RTOL, SystemUnderTest

RATIOS = tuple(10.0**k for k in range(-8, 9, 2))
# A run that is stopped after so many steps takes too many; a short one has so many.
STEPS, SHORT = 20_000, 300


def steps(tested: SystemUnderTest, short: bool) -> Iterator[Row]:
    """First steps that are tiny or huge, longest steps that are huge, loose and finest tolerances: the same end."""
    motion, _, k = reversible(tested, short, both=False)
    phi = flow(tested, motion)
    k = int(np.flatnonzero(np.maximum.accumulate(np.linalg.norm(phi, 2, axis=(1, 2))) <= MAGNIFIED)[-1])
    if k < 2:
        raise NotApplicable("errors grow beyond all measure at once")
    end, grown = float(motion.sol.t[2 * k]), growth_to(phi, k)
    usual = _to(tested, motion, end)
    asked: tuple[tuple[str, dict[str, Any], float], ...] = (
        ("first step 1e-300 s", {"first_step": 1e-300}, RTOL), ("first step 5e-324 s", {"first_step": 5e-324}, RTOL),
        ("first step 1e9 times the duration", {"first_step": 1e9 * end}, RTOL),
        ("longest step 1e300 s", {"max_step": 1e300}, RTOL), ("rtol 0.1", {}, 0.1), ("rtol 1e-15", {}, 1e-15))
    for what, options, rtol in asked:
        sol = _to(tested, motion, end, rtol, **options)
        done = f"{what}: motion of {end:.3g} s in {sol.n_steps} steps, usually {usual.n_steps}"
        if not sol.success:
            named = "t =" in sol.message and "state there" in sol.message
            yield Row("step extremes", tested.name, done, None, None, "", DEGRADE if named else FAIL, sol.message)
            continue
        result = float(np.linalg.norm((sol.x[-1] - usual.x[-1]) / motion.scales))
        if rtol > 1e-3:
            yield within("step extremes", tested.name, f"{done}: steps", sol.n_steps, usual.n_steps if np.isfinite(sol.x).all()
                         else 0, "no more steps than at the usual tolerance, and finite states", "it gets there in few steps")
            continue
        allowed = 2 * math.sqrt(len(motion.scales)) * rtol if rtol > RTOL else motion.step_error
        chain = tested.equations.tape("rhs").longest_chain()
        bound = (sol.n_steps + usual.n_steps) * (allowed * (2 if tested.constrained else 1) + 8 * chain * EPS) * grown
        yield within("step extremes", tested.name, f"{done}: difference at the end", result, bound,
                     f"steps times the error one may have times the largest magnification ({grown:.2g})",
                     "the end does not depend on what was asked of the steps", "the end is another")
        if options and "first_step" in options:
            # Lengths of steps change by factors from 0.2 to 6; from the shortest that time resolves to the usual one.
            most = usual.n_steps + usual.n_rejected + _phases(usual) * (math.log(1e16) / math.log(5) * 2 + 20)
            yield within("step extremes", tested.name, f"{what}: attempted steps", sol.n_steps + sol.n_rejected, 1.2 * most,
                         "those of the usual run, and what it takes at factors of 0.2 to 6 from the shortest step that time "
                         "resolves or the longest to the usual ones, in every mode of contacts; a fifth more for another grid",
                         "few steps are wasted", "steps are wasted")


def _phases(sol: Any) -> int:
    """Number of times that a motion begins: once, and after every switch of rigid contacts."""
    times = [t for one in sol.contacts.values() for t in (*(when for when, _ in one.switches), *one.impacts.t.tolist())]
    return max(1, len({float(t) for t in times} | {float(sol.t[0])})) if sol.module.metadata.contacts else 1


def _to(tested: SystemUnderTest, motion: Path, end: float, rtol: float = RTOL, **options: Any) -> Any:
    return tested.run((0.0, end), rtol=rtol, atol=rtol * motion.scales, steps=True, max_steps=50 * STEPS, **options)


def denormals(tested: SystemUnderTest, short: bool) -> Iterator[Row]:
    """Start states of denormal numbers: the same motion as from zero."""
    start = tested.start
    changed = start.copy()
    changed[changed == 0] = 5e-324
    if (changed == start).all():
        changed = start + 5e-324
    end = tested.duration / 20
    one, two = (tested.run((0.0, end), x, max_steps=STEPS) for x in (start, changed))
    if not one.success:
        raise MotionStops(float(one.t[-1]), end, one.message)
    size = max(float(np.abs(one.x).max()), 1e-300)
    result = float(np.abs(one.x[-1] - two.x[-1]).max()) / size if two.success else float("inf")
    # Denormals differ from zero by 1e-323, whatever the motion magnifies by.
    yield within("denormals", tested.name, f"zeros of the start are 5e-324 instead, {end:g} s: largest difference at the end",
                 result, 1e-12, "a change of 5e-324 may change roundings of the last place only, and where these select steps "
                 "no more than the digits above 1e-12", "denormal numbers are as zeros", two.message if not two.success else
                 "denormal numbers lead elsewhere")


def masses(tested: SystemUnderTest, short: bool) -> Iterator[Row]:
    """Ratios of masses from 1e-8 to 1e8: accelerations against 30 digits, and a short motion with its energy at both ends."""
    units, names = tested.module.metadata.units, tested.module.metadata.parameters
    heavy = [k for unit in ("kg", "kg m^2") for k in [i for i, n in enumerate(names) if units.get(n) == unit][1::2]]
    if len(heavy) == 0 or sum(units.get(n) == "kg" for n in names) < 2:
        raise NotApplicable("there are no two masses that are parameters")
    where = states(tested, FEW)
    statements = emitted(tested, tested.everything)["rhs"]
    every: list[Finding] = []
    for ratio in RATIOS[::4] if short else RATIOS:
        p = tested.params.copy()
        p[heavy] *= ratio
        done = f"masses and inertias {', '.join(names[k] for k in heavy[:4])}{' ...' if len(heavy) > 4 else ''} times {ratio:g}"
        try:
            measured = Measured(tested, "rhs", where, p, statements)
            values = tested.evaluate("rhs", where.t, where.x, p, where.inputs, where.ud)
        except SymdynError as error:
            yield Row("mass ratios", tested.name, done, None, None, "", DEGRADE, str(error))
            continue
        result = measured.compared(values, tested.backend)
        every.append(replace(result, name=f"{ratio:g}"))
        finite = measured.condition[np.isfinite(measured.condition)]
        yield judged("mass ratios", tested.name, f"{done}: accelerations at {FEW} states, condition up to {finite.max():.2g}, "
                     f"{result.rejected} rejected", [result])
        if result.rejected and result.least_rejected < 1e8:
            yield Row("mass ratios", tested.name, f"{done}: {result.rejected} states rejected, condition from "
                      f"{result.least_rejected:.2g}", None, None, "", FAIL, "well-conditioned states are rejected")
    if every:
        yield from first_order_row(tested, f"accelerations at {FEW} states for each ratio of masses", every, "ratios",
                                   FEW * len(every))
    nothing: list[str] = []
    for ratio in (RATIOS[0], RATIOS[-1]):
        try:
            yield _short_motion(tested, heavy, ratio)
        except NotApplicable as reason:
            nothing.append(str(reason))
    if nothing:
        raise NotApplicable(f"of motions: {'; '.join(dict.fromkeys(nothing))}")


def _short_motion(tested: SystemUnderTest, heavy: list[int], ratio: float) -> Row:
    """The energy of a motion of at most SHORT steps, a tenth of the duration, with masses so many times as large, which may make
    it stiff."""
    p = tested.params.copy()
    p[heavy] *= ratio
    other, end = tested.changed(p, "auto"), tested.duration / 10
    done = f"motion with {len(heavy)} masses and inertias times {ratio:g}: "
    first = other.run((0.0, end), rtol=RTOL, steps=True, max_steps=SHORT)
    try:
        if not first.success and first.n_steps < SHORT:
            raise MotionStops(float(first.t[-1]), end, first.message)
        demand_motion(other, first)
        return energy_row(other, path(other, float(first.t[-1])), "mass ratios", done)
    except MotionStops as stop:
        named = "stopped at t =" in stop.message and "state there" in stop.message
        return Row("mass ratios", tested.name, f"{done}{stop.message}", None, None, "", DEGRADE if named else FAIL,
                   "such masses lead where the description does not reach; it stops with time, state and reason" if named else
                   "the message lacks time, state or reason")


def inputs(tested: SystemUnderTest, short: bool) -> Iterator[Row]:
    """Inputs that become NaN or infinite in the middle of a run."""
    names = tested.module.metadata.inputs
    if not names:
        raise NotApplicable("there are no inputs")
    when = tested.duration / 100
    for bad in (math.nan, math.inf):
        def given(t: float, x: np.ndarray, bad: float = bad) -> np.ndarray:
            values = tested.inputs.copy()
            if t > when:
                values[-1] = bad
            return values

        sol = tested.run((0.0, 2 * when), inputs=given)
        yield stopped("bad input", tested.name, f"input {names[-1]} is {bad} from t = {when:g} s on", sol, when, (names[-1],))


def stopped(check: str, system: str, done: str, sol: Any, when: float, culprits: tuple[str, ...]) -> Row:
    """The row of a run that must stop at a time, and name it, the state and the culprit."""
    lacks = []
    if sol.success:
        lacks.append("it does not stop")
    if "stopped at t =" not in sol.message:
        lacks.append("the message has no time")
    if not all(f"{name} =" in sol.message for name in sol.module.metadata.x):
        lacks.append("the message has no state")
    lacks += [f"the message does not name {c}" for c in culprits if c not in sol.message]
    if not np.isfinite(sol.x).all():
        lacks.append("what was kept is not finite")
    late = float(sol.t[-1]) - when if len(sol.t) else 0.0
    bound = 1e-6 * abs(when)
    if late > bound:
        lacks.append(f"it goes on {late:.2g} s too far")
    return Row(check, system, f"{done}: {sol.message}", late, bound, "the last accepted step may not lie behind the fault",
               PASS if not lacks else FAIL, "; ".join(lacks) or "it stops with time, state and culprit, and keeps what was "
               "computed")
