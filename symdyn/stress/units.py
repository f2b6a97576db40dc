"""The same mechanism in other units: numbers change, the motion must not."""

from __future__ import annotations

import contextlib
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from symdyn.stress.flow import demand_motion, flow, growth_to, path, scales_of
from symdyn.stress.record import DEGRADE, FAIL, PASS, NotApplicable, Row, within
from symdyn.stress.reference import exact
from symdyn.stress.rounding import FEW, states
from symdyn.stress.system_under_test import EPS, RTOL, SystemUnderTest

# Powers of mass, length, time.
_BASE: dict[str, tuple[int, int, int]] = {
    "1": (0, 0, 0), "rad": (0, 0, 0), "deg": (0, 0, 0), "kg": (1, 0, 0), "m": (0, 1, 0), "s": (0, 0, 1), "N": (1, 1, -2),
    "J": (1, 2, -2), "W": (1, 2, -3), "Pa": (1, -1, -2), "Hz": (0, 0, -1)}
# Largest error of scaling of the exact equations: they are known to 32 digits.
SCALES = 1e-20


@dataclass(frozen=True)
class Units:
    """So many of the new units make one of SI: of mass, length and time."""

    title: str
    mass: float
    length: float
    time: float

    def factor(self, unit: str) -> float:
        """Factor by which a number in an SI unit is multiplied. Raises NotApplicable for a unit that is not known."""
        m, l, t = powers(unit)
        return float(self.mass**m * self.length**l * self.time**t)


# Powers of two change no bit: 2^10 and 2^-10 for mm and t, small ones and huge ones; the last two are decimal.
EXACT = (Units("2^-10 m, 2^10 kg, s", 2.0**-10, 2.0**10, 1.0), Units("2^40 m, 2^-60 kg, 2^20 s", 2.0**60, 2.0**-40, 2.0**-20),
         Units("2^-30 m, 2^-40 kg, 2^-12 s", 2.0**40, 2.0**30, 2.0**12))
DECIMAL = Units("mm, t, s", 1e-3, 1e3, 1.0)


def powers(unit: str) -> tuple[int, int, int]:
    """Powers of mass, length, time, from text such as "N m s/rad". Raises NotApplicable for what is not known."""
    total = np.zeros(3, dtype=int)
    for k, part in enumerate(unit.split("/")):
        for word in part.split():
            match = re.fullmatch(r"([A-Za-z]+|1)(?:\^(-?\d+))?", word)
            if match is None or match[1] not in _BASE:
                raise NotApplicable(f"the unit {unit!r} is not known here")
            total += (1 if k == 0 else -1) * int(match[2] or 1) * np.array(_BASE[match[1]])
    return int(total[0]), int(total[1]), int(total[2])


def factors(tested: SystemUnderTest, names: Sequence[str], units: Units) -> np.ndarray:
    """Factors by which numbers are multiplied. Raises NotApplicable for a symbol without a unit."""
    known = tested.module.metadata.units
    missing = [name for name in names if name not in known]
    if missing:
        raise NotApplicable(f"the unit of {', '.join(missing[:5])} is not known; give it in system.units")
    return np.array([units.factor(known[name]) for name in names])


def units(tested: SystemUnderTest, short: bool) -> Iterator[Row]:
    """Right-hand side and motion in other units."""
    metadata = tested.module.metadata
    _demand_scaling(tested)
    for system in EXACT[:1] if short else EXACT:
        p, x = (factors(tested, metadata.names(group), system) for group in ("parameters", "x"))
        yield from _bits(tested, system, p, x, short)
    yield from _decimal(tested, short)


def _demand_scaling(tested: SystemUnderTest) -> None:
    """Raises NotApplicable where the exact equations do not scale: numbers of the description stand for quantities."""
    metadata = tested.module.metadata
    every = states(tested, FEW)
    t, y, given, ud = every.t[-3:], every.x[-3:], every.inputs[-3:], every.ud[-3:]
    plain = exact(tested, "rhs", t, y, given, ud)
    for system in EXACT:
        p, x, free = (factors(tested, metadata.names(group), system) for group in ("parameters", "x", "inputs"))
        other = exact(tested, "rhs", t * system.time, y * x, given * free, ud, tested.params * p)
        for one, two in zip(plain, other, strict=True):
            if one is None or two is None:
                continue
            for a, b, factor in zip(one, two, x, strict=True):
                if abs(b * system.time / factor - a) > SCALES * max([abs(v) for v in one] or [0]):
                    raise NotApplicable("its description holds numbers that have units, so that it cannot be scaled")


def _bits(tested: SystemUnderTest, system: Units, p: np.ndarray, x: np.ndarray, short: bool) -> Iterator[Row]:
    """A motion where scaling rounds nothing: every bit is the same. The first step is given, since the usual choice of it
    (Hairer, Norsett, Wanner, II.4) counts in seconds."""
    end = tested.duration / (10 if short else 2)
    pilot = tested.run((0.0, end), rtol=1e-6, max_steps=5000)
    scales = scales_of(tested, pilot.x)
    ends: list[Any] = []
    for time, of_p, of_x in ((1.0, 1.0, 1.0), (system.time, p, x)):
        free = tested.inputs * factors(tested, tested.module.metadata.inputs, system) if time != 1.0 else tested.inputs
        ends.append(tested.run((0.0, end * time), tested.start * of_x, tested.params * of_p, rtol=RTOL,
                               atol=RTOL * scales * of_x, max_steps=5000, steps=True, first_step=end / 1024 * time,
                               **({"inputs": free} if len(free) else {})))
    one, two = ends
    demand_motion(tested, one)
    if one.n_steps != two.n_steps or one.n_rejected != two.n_rejected or len(one.t) != len(two.t):
        figure, steps = float(np.linalg.norm((two.x[-1] / x - one.x[-1]) / scales)), f"{one.n_steps} and {two.n_steps} steps"
    else:
        figure, steps = float(np.abs((two.x / x - one.x) / scales).max()), f"{one.n_steps} steps"
    done = f"units {system.title}: motion of {end:g} s, {steps}: largest difference of all states"
    origin = "factors that are powers of two round nothing, and nothing in the code has a unit of its own: the same bits"
    if figure == 0:
        yield Row("units", tested.name, done, figure, 0.0, origin, PASS, "the same bits in other units")
        return
    grown = 1.0
    with contextlib.suppress(NotApplicable):
        phi = flow(tested, path(tested, end, resolved=True))
        grown = growth_to(phi, len(phi) - 1)
    bound = (one.n_steps + two.n_steps) * 2 * np.sqrt(len(x)) * RTOL * grown
    gentle = figure <= bound
    cause = "a power of a quantity, or a threshold with a unit"
    if tested.constrained:
        lengths = [float(tested.evaluate("length", 0.0, tested.start * of_x, tested.params * of_p)[0, 0])
                   for of_x, of_p in ((1.0, 1.0), (x, p))]
        if lengths[0] == lengths[1]:
            cause = (f"no parameter is a length, so that residuals of the constraints are compared with {lengths[0]:g} m "
                     "whatever the size of the mechanism; give a length as a parameter")
    why = (f"not the same bits, but the same motion within the tolerances: {cause}" if gentle else
           "another motion in other units")
    yield Row("units", tested.name, done, figure, float(bound) if gentle else 0.0,
              origin + "; else the tolerances, magnified", DEGRADE if gentle else FAIL, why)


def _decimal(tested: SystemUnderTest, short: bool) -> Iterator[Row]:
    """mm, t, s: numbers round, and rounding grows with the motion."""
    from symdyn.stress.motion import MAGNIFIED, reversible

    motion, _, k = reversible(tested, short, both=False)
    phi = flow(tested, motion)
    norms = np.linalg.norm(phi, 2, axis=(1, 2))
    k = int(np.flatnonzero(np.maximum.accumulate(norms) <= MAGNIFIED)[-1])
    if k < 2:
        raise NotApplicable("errors grow beyond all measure at once")
    metadata, end = tested.module.metadata, float(motion.sol.t[2 * k])
    p, x, free = (factors(tested, metadata.names(group), DECIMAL) for group in ("parameters", "x", "inputs"))
    one = tested.run((0.0, end), rtol=RTOL, atol=RTOL * motion.scales, steps=True)
    two = tested.run((0.0, end), tested.start * x, tested.params * p, rtol=RTOL, atol=RTOL * motion.scales * x, steps=True,
                     **({"inputs": tested.inputs * free} if len(free) else {}))
    if not (one.success and two.success):
        yield Row("units", tested.name, f"mm, t, s: motion of {end:g} s", None, None, "", FAIL,
                  one.message if not one.success else two.message)
        return
    figure = float(np.linalg.norm((two.x[-1] / x - one.x[-1]) / motion.scales))
    grown = growth_to(phi, k)
    chain = tested.equations.tape("rhs").longest_chain()
    steps = one.n_steps + two.n_steps
    bound = steps * (motion.step_error * (2 if tested.constrained else 1) + 8 * chain * EPS) * grown
    yield within("units", tested.name, f"units mm, t, s: motion of {end:.3g} s, {one.n_steps} and {two.n_steps} steps: "
                 "difference at the end", figure, bound, "steps times the error one may have times the largest magnification "
                 f"({grown:.2g})", "the same motion in other units", "another motion in other units")
