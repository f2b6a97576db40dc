"""Events of random quantities in all methods, counted against zeros that are known.

A free particle moves at 1 m/s from 0 and a mass on a spring swings as sin t. Every draw has these quantities, of the time t and
of the particle's position s = t:

    sines      a sum of four sines of frequencies between 0.2 and 30 1/s minus a threshold
    doubles    a polynomial with three pairs of zeros, each pair 1e-1 to 1e-9 apart, relative to the span
    touching   sin(w s + p) - (1 - d), which reaches its threshold from below, d between 1e-1 and 1e-13
    pulses     bells exp(-z^2), peaks 1/(1 + z^2), windows (tanh z - tanh(z - 10))/2, roofs max(1 - |z|, 0) and boxes, 1 where
               |z| < 1, each less one half, z = (s - a)/w, w between 2e-2 and 1e-6 of the span

and of the mass on the spring, where the steps have errors,

    swinging   sin t - (1 - d), d between 1e-1 and a thousand times the relative tolerance.

Zeros of `doubles`, `touching`, `pulses` and `swinging` are closed forms. Those of `sines` are found by sampling at 400 points of
the shortest period, each extreme between samples being refined. A zero is missed if no event is within 1e-6 of the span (of
`swinging`: within what two thousand tolerances move it by), superfluous is an event that no zero is near.

    python -m symdyn.lab.events --draws 10
"""

from __future__ import annotations

import argparse
import sys
import warnings
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import sympy as sp
from scipy.optimize import brentq, minimize_scalar

import symdyn as sd
from symdyn.errors import SimulationWarning
from symdyn.runtime.integrating.methods import COMPILED

SPAN = 20.0
N_SINES, N_PAIRS = 4, 3
KINDS = ("sines", "doubles", "touching", "pulses", "swinging")
PULSES: dict[str, Any] = {
    "bell": lambda z: sp.exp(-z**2), "peak": lambda z: 1 / (1 + z**2), "window": lambda z: (sp.tanh(z) - sp.tanh(z - 10)) / 2,
    "roof": lambda z: sp.Max(1 - sp.Abs(z), 0), "box": lambda z: sp.Piecewise((1, (z > -1) & (z < 1)), (0, True))}
# Where they are one half.
HALVES = {"bell": (-np.sqrt(np.log(2)), np.sqrt(np.log(2))), "peak": (-1, 1), "window": (0, 10), "roof": (-0.5, 0.5),
          "box": (-1, 1)}
SCIPY = ("DOP853", "RK45", "RK23", "Radau", "BDF", "LSODA")
TOLERANCES = (1e-4, 1e-8, 1e-11)
# Largest distance of an event from a zero, as a part of the span, with closed forms as exact.
NEAR = 1e-6


@dataclass(frozen=True)
class Draw:
    """Parameters by name, and the zeros of each kind, sorted; of pulses by name."""

    params: dict[str, float]
    zeros: dict[str, np.ndarray]


@dataclass
class Count:
    """Zeros, those missed, and events at no zero."""

    zeros: int = 0
    missed: int = 0
    superfluous: int = 0
    warned: int = 0

    def add(self, other: Count, warned: bool) -> None:
        """Add those of another run."""
        self.zeros, self.missed = self.zeros + other.zeros, self.missed + other.missed
        self.superfluous, self.warned = self.superfluous + other.superfluous, self.warned + warned


def system() -> sd.System:
    """The two masses with their events."""
    y, x = sd.coordinates("y x")
    s = sd.System("searched")
    free, swung = s.add_body("free", mass=1), s.add_body("swung", mass=1)
    s.add_joint(sd.Prismatic("along", s.ground, free, y, axis=[1, 0]))
    spring = s.add_joint(sd.Prismatic("across", s.ground, swung, x, axis=[0, 1]))
    s.add_joint_force(spring, -x, name="spring")
    a, w, p = ([sd.parameters(f"{letter}{k}") for k in range(N_SINES)] for letter in "awp")
    roots = [sd.parameters(f"r{k}") for k in range(2 * N_PAIRS)]
    c, d, e, f, g = sd.parameters("c d e f g")
    places, widths = ([sd.parameters(f"{letter}{k}") for k in range(len(PULSES))] for letter in ("at", "width"))
    for of, label in ((sd.t, "t"), (y, "y")):
        s.add_event(f"sines_{label}", sum(a[k] * sp.sin(w[k] * of + p[k]) for k in range(N_SINES)) - c)
        s.add_event(f"doubles_{label}", sp.prod([(of - r) / SPAN for r in roots]))
        s.add_event(f"touching_{label}", sp.sin(f * of + g) - 1 + d)
        for (name, pulse), at, width in zip(PULSES.items(), places, widths, strict=True):
            s.add_event(f"pulses_{name}_{label}", pulse((of - at) / width) - sp.Rational(1, 2))
    s.add_event("swinging", x - 1 + e)
    s.initial = {y.dot: 1, x.dot: 1}
    return s


def draw(seed: int, rtol: float) -> Draw:
    """Random parameters with the zeros between 0 and SPAN."""
    rng = np.random.default_rng(seed)
    a, w, p = rng.uniform(0.2, 1, N_SINES), np.exp(rng.uniform(np.log(0.2), np.log(30), N_SINES)), rng.uniform(0, 6.28, N_SINES)
    c = float(rng.uniform(-0.7, 0.7) * a.sum())
    middles = np.sort(rng.uniform(0.05, 0.95, N_PAIRS)) * SPAN
    apart = SPAN * 10 ** rng.uniform(-9, -1, N_PAIRS)
    roots = np.sort(np.concatenate([middles - apart / 2, middles + apart / 2]))
    f, g, d = np.exp(rng.uniform(np.log(0.3), np.log(20))), rng.uniform(0, 6.28), 10 ** rng.uniform(-13, -1)
    e = 10 ** rng.uniform(np.log10(1e3 * rtol), -1)
    params = {"c": c, "d": d, "e": e, "f": f, "g": g}
    for letter, values in (("a", a), ("w", w), ("p", p), ("r", roots)):
        params |= {f"{letter}{k}": float(v) for k, v in enumerate(values)}
    at, width = rng.uniform(0.3, 0.6, len(PULSES)) * SPAN, 10 ** rng.uniform(-6, -1.7, len(PULSES)) * SPAN
    params |= {f"at{k}": v for k, v in enumerate(at)} | {f"width{k}": v for k, v in enumerate(width)}
    zeros = {"sines": _sampled(lambda t: np.sin(np.multiply.outer(t, w) + p) @ a - c, float(w.max())),
             "doubles": roots[(roots > 0) & (roots < SPAN)], "touching": _of_sine(f, g, d), "swinging": _of_sine(1.0, 0.0, e)}
    zeros |= {f"pulses_{name}": a + w * np.array(HALVES[name]) for name, a, w in zip(PULSES, at, width, strict=True)}
    return Draw({name: float(value) for name, value in params.items()}, zeros)


def _of_sine(w: float, p: float, d: float) -> np.ndarray:
    """Zeros of sin(w t + p) - (1 - d): pi/2 -+ 2 arcsin(sqrt(d/2)), which loses no digits where d is small."""
    half = 2 * np.arcsin(np.sqrt(d / 2))
    turns = 2 * np.pi * np.arange(-2, int(w * SPAN / 6) + 3) + np.pi / 2
    result = np.sort(np.concatenate([(turns - half - p) / w, (turns + half - p) / w]))
    return np.array(result[(result > 0) & (result < SPAN)])


def _sampled(value: Any, w: float) -> np.ndarray:
    """Zeros by samples, with the extremes between these."""
    t = np.linspace(0, SPAN, int(400 * w * SPAN / 6.28) + 400)
    v = value(t)
    points = list(t)
    inner = np.flatnonzero((np.abs(v[1:-1]) <= np.abs(v[:-2])) & (np.abs(v[1:-1]) <= np.abs(v[2:]))) + 1
    for k in inner:
        sign = np.sign(v[k])
        result = minimize_scalar(lambda s, sign=sign: sign * float(value(s)), bounds=(t[k - 1], t[k + 1]), method="bounded",
                                 options={"xatol": 1e-12})
        points.append(float(result.x))
    points.sort()
    v = value(np.array(points))
    return np.array([brentq(lambda s: float(value(s)), points[k], points[k + 1], xtol=1e-14)
                     for k in np.flatnonzero(v[1:] * v[:-1] < 0)])


def count(result: np.ndarray, zeros: np.ndarray, near: float) -> Count:
    """Zeros without an event and events without a zero, each paired once, in order."""
    left, missed = list(result), 0
    for zero in zeros:
        k = int(np.argmin(np.abs(np.array(left) - zero))) if left else -1
        if k >= 0 and abs(left[k] - zero) <= near:
            left.pop(k)
        else:
            missed += 1
    return Count(len(zeros), missed, len(left))


def measure(modules: dict[str, Any], methods: Sequence[str], seeds: Sequence[int],
            tolerances: Sequence[float] = TOLERANCES) -> Iterator[tuple[str, float, str, Count]]:
    """Method, tolerance, kind of quantity and what was counted over all draws."""
    for method in methods:
        module = modules["c" if method in COMPILED else "numpy"]
        for rtol in tolerances:
            total = {kind: Count() for kind in KINDS}
            for seed in seeds:
                drawn = draw(seed, rtol)
                with warnings.catch_warnings(record=True) as caught:
                    warnings.simplefilter("always", SimulationWarning)
                    run = module.simulate((0, SPAN), params=drawn.params, method=method, rtol=rtol)
                for name, rows in run.events.items():
                    kind = name.partition("_")[0]
                    of = name.rpartition("_")[0] if kind == "pulses" else kind
                    # The error of a swing within the span is at most some hundred tolerances; the slope at a zero is sqrt(2 d).
                    near = 200 * rtol / np.sqrt(2 * drawn.params["e"]) * 10 if kind == "swinging" else NEAR * SPAN
                    one = count(rows.t, drawn.zeros[of], near)
                    total[kind].add(one, bool(caught))
            for kind, of in total.items():
                yield method, rtol, kind, of


def main(arguments: Sequence[str] | None = None) -> int:
    """Print what was missed; returns 1 if any zero was, without a warning."""
    parser = argparse.ArgumentParser(prog="python -m symdyn.lab.events", description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("--draws", type=int, default=10, help="random draws of each method and tolerance")
    parser.add_argument("--first", type=int, default=0, help="number of the first draw")
    parser.add_argument("--methods", nargs="+", default=[*COMPILED, *SCIPY], choices=[*COMPILED, *SCIPY], help="default: all")
    options = parser.parse_args(arguments)
    equations = system().embedding()
    modules = {backend: equations.compile(backend=backend) for backend in ("c", "numpy")}
    silent = 0
    print(f"{'method':8}{'rtol':>8}  {'quantity':10}{'zeros':>8}{'missed':>8}{'superfluous':>13}{'runs warned':>13}")
    for method, rtol, kind, of in measure(modules, options.methods, range(options.first, options.first + options.draws)):
        print(f"{method:8}{rtol:8.0e}  {kind:10}{of.zeros:8}{of.missed:8}{of.superfluous:13}{of.warned:13}", flush=True)
        silent += of.missed if not of.warned else 0
    return int(silent > 0)


if __name__ == "__main__":
    sys.exit(main())
