"""Errors of every method between its steps: 30 problems, 1,000 random times each, tolerances from 1e-3 to 1e-12.

    python -m symdyn.lab.dense_output --methods radau radau5 --tolerances 1e-6 1e-9

The problems are stiff and not, with constraints and without; most have closed forms, the others are compared with dop853
at a tolerance of 1e-14. An error is the largest |x - exact| / (atol + rtol |exact|) over all states and times, with atol = rtol.
The errors at the ends of steps, of a run that stores these alone, stand next to it: what is larger is due to the interpolation.
"""

from __future__ import annotations

import argparse
import functools
import sys
import time as clock
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import sympy as sp

import symdyn as sd
from symdyn.errors import ArgumentError, SimulationWarning
from symdyn.runtime.integrating.methods import COMPILED

# Errors in tolerances that are accepted between steps.
BOUND = 100.0
N_TIMES = 1000
TOLERANCES = (1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9, 1e-10, 1e-11, 1e-12)
EXPLICIT = ("dop853", "bs54", "taylor", "gauss", "RK23", "RK45", "DOP853")
METHODS = (*COMPILED, "RK23", "RK45", "DOP853", "Radau", "BDF", "LSODA", "ggl", "auto")
# Largest product of the fastest rate and the span that methods with a limit of stability are run on: compiled, and in Python.
MOST_COMPILED, MOST_IN_PYTHON = 3e5, 3e2
# Least tolerance of methods of low order, which would take millions of steps below it.
LEAST = {"RK23": 1e-8}
REFERENCE = {"method": "dop853", "rtol": 1e-14}

Exact = Callable[[np.ndarray], np.ndarray]


@dataclass(frozen=True)
class Problem:
    """A motion.

    build   of the equations, the same object for problems that share a module
    end     s, from 0
    exact   states (n_t, n_x) at times (n_t,); None: by the reference
    rate    1/s, the fastest that decays: what limits explicit steps
    start   arguments of simulate: q, u, z, params
    least   tolerance below which rounding errors are larger
    """

    name: str
    build: Callable[[], Any]
    end: float
    exact: Exact | None = None
    rate: float = 1.0
    start: Mapping[str, Any] = field(default_factory=dict)
    constrained: bool = False
    least: float = 0.0


@dataclass(frozen=True)
class Result:
    """Errors in tolerances between steps and at their ends; why there are none, if so."""

    problem: str
    method: str
    rtol: float
    between: float = np.nan
    at_ends: float = np.nan
    n_steps: int = 0
    seconds: float = 0.0
    why: str = ""

    @property
    def passed(self) -> bool:
        return bool(self.why) or self.between <= BOUND

    def __str__(self) -> str:
        head = f"{self.problem:22}{self.method:9}{self.rtol:<9.0e}"
        return head + (self.why or f"{self.between:>10.3g}{self.at_ends:>10.3g}{self.n_steps:>8}{self.seconds:>9.4f} s"
                       + ("" if self.passed else "  ABOVE"))


def _slider(name: str) -> tuple[sd.System, Any, Any]:
    """A body on a straight line, its coordinate and its joint."""
    q = sd.coordinates("q")
    system = sd.System(name, planar=True)
    body = system.add_body("body", mass=1)
    return system, q, system.add_joint(sd.Prismatic("slider", system.ground, body, q, axis=[1, 0]))


def _states(name: str, rates: Callable[..., Sequence[Any]], names: str) -> sd.System:
    """A resting body, with extra states of these rates, functions of the states."""
    system, _, _ = _slider(name)
    made: Any = sd.coordinates(names)
    z = made if isinstance(made, tuple) else (made,)
    for state, rate in zip(z, rates(*z), strict=True):
        system.add_state(state, rate)
    return system


def _decay() -> Any:
    lam, w = sd.parameters("lam w")
    system = _states("decay", lambda z: [-lam * (z - sp.cos(w * sd.t))], "z")
    system.defaults = {lam: 1, w: 1}
    return system.embedding()


def _decay_exact(lam: float, w: float, z0: float) -> Exact:
    """z' = -lam (z - cos w t)."""
    slow = lambda t: lam * (lam * np.cos(w * t) + w * np.sin(w * t)) / (lam**2 + w**2)
    return lambda t: np.stack([0 * t, 0 * t, slow(t) + (z0 - slow(0.0)) * np.exp(-lam * t)], axis=1)


def _held() -> Any:
    """A mass that a spring and a damper hold to the point sin t, with the force that makes it follow."""
    k, c = sd.parameters("k c")
    system, q, slider = _slider("held")
    system.add_joint_force(slider, -k * (q - sp.sin(sd.t)) - c * (q.dot - sp.cos(sd.t)) - sp.sin(sd.t))
    system.defaults = {k: 0, c: 0}
    return system.embedding()


def _held_exact(k: float, c: float, q0: float) -> Exact:
    """sin t and a free vibration from q0 at rest."""
    roots = np.roots([1, c, k]).astype(complex)
    if abs(roots[0] - roots[1]) < 1e-6 * abs(roots[0]):
        w = c / 2
        free = lambda t: q0 * np.exp(-w * t) * np.stack([1 + w * t, -w**2 * t])
    else:
        a, b = q0 * roots[1] / (roots[1] - roots[0]), q0 * roots[0] / (roots[0] - roots[1])
        free = lambda t: np.stack([a * np.exp(roots[0] * t) + b * np.exp(roots[1] * t),
                                   a * roots[0] * np.exp(roots[0] * t) + b * roots[1] * np.exp(roots[1] * t)]).real
    return lambda t: (np.stack([np.sin(t), np.cos(t)]) + free(t)).T


def _kaps() -> Any:
    """Kaps' problem: exp(-2 t), exp(-t) whatever lam is."""
    lam = sd.parameters("lam")
    system = _states("kaps", lambda a, b: [-(lam + 2) * a + lam * b**2, a - b * (1 + b)], "a b")
    system.defaults = {lam: 1}
    return system.embedding()


def _chain() -> Any:
    """A decays to B with the rate 1, B to C with the rate k."""
    k = sd.parameters("k")
    system = _states("chain_of_decays", lambda a, b, c: [-a, a - k * b, k * b], "a b c")
    system.defaults = {k: 2}
    return system.embedding()


def _chain_exact(k: float) -> Exact:
    def exact(t: np.ndarray) -> np.ndarray:
        a, b = np.exp(-t), (np.exp(-t) - np.exp(-k * t)) / (k - 1)
        return np.stack([0 * t, 0 * t, a, b, 1 - a - b], axis=1)
    return exact


def _logistic() -> Any:
    return _states("logistic", lambda z: [z * (1 - z)], "z").embedding()


def _swing(start: float) -> Exact:
    """Angle and rate of a pendulum from rest (Jacobi's functions; g = 9.81 m/s^2, l = 1 m)."""
    from scipy.special import ellipj, ellipk

    k, w = np.sin(start / 2), np.sqrt(9.81)

    def exact(t: np.ndarray) -> np.ndarray:
        sn, cn, _, _ = ellipj(w * t + ellipk(k**2), k**2)
        return np.stack([2 * np.arcsin(k * sn), 2 * k * w * cn], axis=1)
    return exact


def _plane(name: str, force: Callable[..., Sequence[Any]], on_circle: bool = False) -> sd.System:
    """A particle of mass 1 at (x, y) under a force, in the plane or on the unit circle."""
    x, y = sd.coordinates("x y")
    system = sd.System(name, planar=True)
    rail, particle = system.add_body("rail", mass=0), system.add_body("particle", mass=1)
    system.add_joint(sd.Prismatic("along", system.ground, rail, axis=[1, 0], coordinate=x))
    system.add_joint(sd.Prismatic("up", rail, particle, axis=[0, 1], coordinate=y))
    system.add_force(particle, force(x, y))
    if on_circle:
        system.add_constraint(x**2 + y**2 - 1, "circle")
    return system


def _kepler() -> Any:
    return _plane("kepler", lambda x, y: [-x / sp.sqrt(x**2 + y**2)**3, -y / sp.sqrt(x**2 + y**2)**3]).embedding()


def _kepler_start(e: float) -> Mapping[str, Any]:
    return {"q": [1 - e, 0], "u": [0, np.sqrt((1 + e) / (1 - e))]}


def _orbit(e: float) -> Exact:
    def exact(t: np.ndarray) -> np.ndarray:
        E = t.copy()
        for _ in range(50):
            E = E - (E - e * np.sin(E) - t) / (1 - e * np.cos(E))
        rate, b = 1 / (1 - e * np.cos(E)), np.sqrt(1 - e**2)
        return np.stack([np.cos(E) - e, b * np.sin(E), -np.sin(E) * rate, b * np.cos(E) * rate], axis=1)
    return exact


def _bead() -> Any:
    """A bead on a circle that weight moves: a pendulum in Cartesian coordinates."""
    return _plane("bead", lambda x, y: [0, -sp.Rational(981, 100)], on_circle=True).augmented()


def _on_circle(angles: Exact) -> Exact:
    """x, y and their rates from the angle, counted from the x axis, and its rate."""
    def exact(t: np.ndarray) -> np.ndarray:
        phi, w = angles(t).T
        return np.stack([np.cos(phi), np.sin(phi), -w * np.sin(phi), w * np.cos(phi)], axis=1)
    return exact


def _driven() -> Any:
    """A bead on a circle, a damper c makes its angular velocity cos t."""
    c = sd.parameters("c")

    def force(x: Any, y: Any) -> list[Any]:
        push = -c * (x * y.dot - y * x.dot - sp.cos(sd.t)) - sp.sin(sd.t)
        return [-y * push, x * push]
    system = _plane("driven_bead", force, on_circle=True)
    system.defaults = {c: 1}
    return system.augmented()


def _driven_exact(c: float, w0: float) -> Exact:
    return _on_circle(lambda t: np.stack([np.sin(t) - (w0 - 1) * np.expm1(-c * t) / c,
                                          np.cos(t) + (w0 - 1) * np.exp(-c * t)], axis=1))


def _catalogue(name: str) -> Callable[[], Any]:
    @functools.cache
    def build() -> Any:
        system = sd.systems.get(name)
        return system.augmented() if system.loops or system.constraints else system.embedding()
    return build


def problems() -> list[Problem]:
    """All thirty."""
    rows = [Problem(f"decay {lam:.0e} {w} {z0}", _decay, 10.0 / max(1, w), _decay_exact(lam, w, z0), lam,
                    {"z": [z0], "params": {"lam": lam, "w": w}})
            for lam, w, z0 in ((1e0, 1, 1), (1e2, 10, 1), (1e3, 1, 1), (1e5, 1, 1), (1e5, 1, 2), (1e7, 3, 1))]
    rows += [Problem(f"held {k:.0e} {c:g} {q0}", _held, end, _held_exact(k, c, q0), max(c, np.sqrt(k)),
                     {"q": [q0], "u": [1], "params": {"k": k, "c": c}}, least=np.sqrt(k) * np.finfo(float).eps)
             for k, c, q0, end in ((4e0, 0, 0.2, 5), (1e2, 2, 0.1, 3), (1e4, 2e2, 0.1, 5), (1e8, 2e4, 0, 10),
                                   (1e12, 2e6, 0, 10))]
    rows += [Problem(f"kaps {lam:.0e}", _kaps, 3.0, lambda t: np.stack([0 * t, 0 * t, np.exp(-2 * t), np.exp(-t)], axis=1), lam,
                     {"z": [1, 1], "params": {"lam": lam}}) for lam in (1e0, 1e3, 1e6)]
    rows += [Problem(f"decays {k:.0e}", _chain, 3.0, _chain_exact(k), k, {"z": [1, 0, 0], "params": {"k": k}})
             for k in (2e0, 1e4)]
    rows.append(Problem("logistic", _logistic, 5.0, lambda t: np.stack([0 * t, 0 * t, 1 / (1 + 9 * np.exp(-t))], axis=1),
                        start={"z": [0.1]}))
    rows += [Problem(f"pendulum {a}", _catalogue("pendulum"), 2.0, _swing(a), start={"q": [a]}) for a in (0.5, 2.0)]
    rows += [Problem(f"kepler {e}", _kepler, 5.0, _orbit(e), start=_kepler_start(e)) for e in (0.1, 0.5)]
    rows.append(Problem("double_pendulum", _catalogue("double_pendulum"), 1.0, start={"q": [1.0, 0.5]}))
    rows += [Problem(f"driven_bead {c:.0e} {w0}", _driven, 3.0, _driven_exact(c, w0), c,
                     {"q": [1, 0], "u": [0, w0], "params": {"c": c}}, True)
             for c, w0 in ((1e0, 1), (1e3, 1), (1e4, 1.5), (1e6, 1))]
    hanging = lambda t: _swing(1.0)(t) - [np.pi / 2, 0]
    rows.append(Problem("bead", _bead, 2.0, _on_circle(hanging), constrained=True, start={"q": [np.sin(1.0), -np.cos(1.0)]}))
    rows += [Problem(name, _catalogue(name), end, constrained=True) for name, end in (("four_bar", 1.0), ("slider_crank", 0.5),
                                                                                     ("skate", 1.0))]
    return rows


@functools.cache
def _module(build: Callable[[], Any]) -> Any:
    return build().compile(backend="c")


@functools.cache
def _states_at(number: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Times (n,) and exact states (n, n_x) of a problem."""
    problem = problems()[number]
    times = np.sort(np.random.default_rng([seed, number]).uniform(0, problem.end, N_TIMES))
    times = np.concatenate([[0.0], times, [problem.end]])
    exact = problem.exact(times) if problem.exact else _module(problem.build).simulate(times, **problem.start, **REFERENCE).x
    return times, exact


def misfit(problem: Problem, method: str, rtol: float) -> str:
    """Why a method is not run; empty if it is."""
    fastest = problem.rate * problem.end
    if method in EXPLICIT and fastest > (MOST_COMPILED if method in COMPILED else MOST_IN_PYTHON):
        return "stiff"
    if method == "ggl" and not problem.constrained:
        return "no constraints"
    if rtol < problem.least:
        return "rounding"
    return "too many steps" if rtol < LEAST.get(method, 0.0) else ""


def measure(number: int, method: str, rtol: float, seed: int = 0) -> Result:
    """One problem, by its number, with one method at one tolerance."""
    problem = problems()[number]
    name = (problem.name, method, rtol)
    if why := misfit(problem, method, rtol):
        return Result(*name, why=why)
    times, exact = _states_at(number, seed)
    module = _module(problem.build)
    begun = clock.perf_counter()
    with warnings.catch_warnings():
        warnings.simplefilter("error", SimulationWarning)
        try:
            result = module.simulate(times, **problem.start, method=method, rtol=rtol)
        except ArgumentError:
            return Result(*name, why="does not fit")
        except SimulationWarning as warning:
            return Result(*name, why=f"warns: {str(warning).partition(';')[0]}")
        seconds = clock.perf_counter() - begun
        ends = module.simulate((0.0, problem.end), **problem.start, method=method, rtol=rtol, steps=True)
    at_ends = problem.exact(ends.t) if problem.exact else module.simulate(ends.t, **problem.start, **REFERENCE).x

    def error(x: np.ndarray, right: np.ndarray) -> float:
        return float((np.abs(x - right) / (rtol + rtol * np.abs(right))).max())

    return Result(*name, error(result.x, exact), error(ends.x, at_ends), result.n_steps, seconds)


def results(numbers: Sequence[int], methods: Sequence[str], tolerances: Sequence[float], seed: int) -> Iterator[Result]:
    """Results of all problems, methods and tolerances, method by method."""
    for method in methods:
        for number in numbers:
            for rtol in tolerances:
                yield measure(number, method, rtol, seed)


def table(result: Sequence[Result]) -> str:
    """The largest errors of every method, and where they are."""
    lines = [f"{'method':9}{'runs':>6}{'between':>10}{'at ends':>10}{'above':>7}  worst"]
    for method in dict.fromkeys(r.method for r in result):
        rows = [r for r in result if r.method == method and not r.why]
        if rows:
            worst = max(rows, key=lambda r: r.between)
            above = sum(not r.passed for r in rows)
            lines.append(f"{method:9}{len(rows):>6}{worst.between:>10.3g}{max(r.at_ends for r in rows):>10.3g}{above:>7}  "
                         f"{worst.problem}, rtol = {worst.rtol:g}")
    return "\n".join(lines)


def main(arguments: Sequence[str] | None = None) -> int:
    """The command. Returns 1 if an error between steps is above the bound."""
    parser = argparse.ArgumentParser(prog="python -m symdyn.lab.dense_output",
                                     description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("--methods", nargs="+", default=METHODS, choices=METHODS, help="default: all")
    parser.add_argument("--tolerances", nargs="+", type=float, default=TOLERANCES, help="default: 1e-3, 1e-4 ... 1e-12")
    parser.add_argument("--only", type=int, nargs="+", metavar="K", help="these problems alone, by number from 0")
    parser.add_argument("--seed", type=int, default=0, help="of the random times (default 0)")
    parser.add_argument("--quiet", action="store_true", help="print what is above the bound and the table alone")
    options = parser.parse_args(arguments)
    numbers = options.only if options.only is not None else range(len(problems()))
    found = []
    for result in results(numbers, options.methods, options.tolerances, options.seed):
        found.append(result)
        if not (options.quiet and result.passed):
            print(result, flush=True)
    print(table(found))
    return int(not all(r.passed for r in found))


if __name__ == "__main__":
    sys.exit(main())
