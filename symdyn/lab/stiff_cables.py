"""Elastic cables between two supports: stiff motions by compiled methods with factors in a band and by SciPy's with sparse ones,
at equal error; shapes at rest and frequencies compared with closed forms."""

from __future__ import annotations

import ctypes
import json
import math
import time as clock
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.optimize import brentq

from symdyn.backend.right_side import RightSide
from symdyn.errors import ArgumentError, NoEquilibrium
from symdyn.model.joints import Prismatic
from symdyn.model.symbols import coordinates, parameters
from symdyn.model.system import System
from symdyn.runtime.integrating.methods import is_compiled

if TYPE_CHECKING:
    from scipy.sparse import csc_matrix

    from symdyn.runtime.module import Module

SIZES = (10, 100, 250, 500, 1000)
# A cable of 1 m and 1 kg between supports 1 m apart: weight, stretched by its stiffness EA (N) under the tension T (N) of the
# straight cable, with dampers of ETA (s) times the stiffness.
WEIGHT, EA, TENSION, ETA = 9.81, 2.0e4, 200.0, 1e-4
# Of shapes and frequencies: little sag, 0.3 mm, which the closed forms of frequencies suppose, N.
TAUT_EA, TAUT = 1.0e7, 4.0e3
# Their largest relative errors with 1,000 links.
BOUND = 1e-6
# Relative tolerances by method; the one that growth is measured at.
TOLERANCES = {"Radau": (1e-4, 1e-6, 1e-8), "radau5": (1e-4, 1e-6, 1e-8, 1e-10), "radau": (1e-4, 1e-6, 1e-8, 1e-10)}
OF_GROWTH, DURATION = 1e-6, 0.1
# Relative tolerance of explicit steps, whose end the others are compared with.
TIGHT = 1e-11
# Growth is fitted to cables of so many links and more.
LEAST_OF_GROWTH = 100
# Newton's iteration to a shape at rest: it has ended where a step is no longer than this, m, and takes so many steps at most.
SETTLED, NEWTON_STEPS = 1e-14, 30
HEADING = (f"{'links':>6}{'states':>8}{'entries':>9}{'derive s':>10}{'method':>9}{'rtol':>8}{'steps':>8}{'Jacobians':>11}"
           f"{'factors':>9}{'MB':>8}{'s a second':>12}{'error':>10}")


REST_HEADING = f"{'links':>6}{'sag m':>14}{'off':>10}   frequencies rad/s and off"


@dataclass(frozen=True)
class Rest:
    """A cable at rest: its sag, m, and its lowest frequencies, rad/s, with what they differ from closed forms by, relative.

    limit   frequencies in the limit of many links, from these and from those of half as many links
    """

    links: int
    sag: float
    sag_error: float
    limit: tuple[float, ...]
    limit_errors: tuple[float, ...]

    def __str__(self) -> str:
        """A line under REST_HEADING."""
        pairs = "".join(f"{value:>12.6f}{error:>9.1e}" for value, error in zip(self.limit, self.limit_errors, strict=True))
        return f"{self.links:>6}{self.sag:>14.10f}{self.sag_error:>10.1e}{pairs}"


@dataclass(frozen=True)
class Row:
    """One cable by one method: entries of the Jacobian that may differ from zero, processor seconds to derive and for each
    second of motion, steps, Jacobians, factorizations, memory of a run, B (0: unknown), the error of the end, m."""

    links: int
    states: int
    entries: int
    derive: float
    method: str
    rtol: float
    steps: int
    jacobians: int
    factorizations: int
    memory: int
    seconds: float
    error: float

    def __str__(self) -> str:
        """A line under HEADING."""
        memory = f"{self.memory / 1e6:>8.2f}" if self.memory else f"{'':>8}"
        return (f"{self.links:>6}{self.states:>8}{self.entries:>9}{self.derive:>10.1f}{self.method:>9}{self.rtol:>8.0e}"
                f"{self.steps:>8}{self.jacobians:>11}{self.factorizations:>9}{memory}{self.seconds:>12.3f}{self.error:>10.1e}")

    @property
    def of_a_step(self) -> float:
        """Processor seconds of a step."""
        return self.seconds * DURATION / self.steps


def elastic_cable(n: int, stiffness: float = EA, tension: float = TENSION, damping: float = ETA) -> System:
    """n springs with dampers and n - 1 knots in a plane between supports at (0, 0) and (1, 0), straight at first.

    stiffness   EA, N; tension, N, of the straight cable; damping: of the material, s
    """
    m, length, g, k, d = parameters("m l g k d")
    system = System(f"elastic_cable_{n}", gravity=[0, -g])
    before, at = system.ground, [0, 0]
    for i, (x, y) in enumerate(zip(coordinates(f"x1:{n}"), coordinates(f"y1:{n}"), strict=True)):
        rail, knot = system.add_body(f"rail{i + 1}", mass=0), system.add_body(f"knot{i + 1}", mass=m)
        system.add_joint(Prismatic(f"along{i + 1}", system.ground, rail, x, axis=[1, 0, 0]))
        system.add_joint(Prismatic(f"up{i + 1}", rail, knot, y, axis=[0, 1, 0]))
        system.add_spring_damper(before, knot, stiffness=k, damping=d, length=length, point_a=at)
        system.initial[x] = (i + 1) / n
        before = knot
    system.add_spring_damper(before, system.ground, stiffness=k, damping=d, length=length, point_b=[1, 0])
    rest = 1 / (1 + tension / stiffness)
    system.defaults = {m: 1 / n, length: rest / n, g: WEIGHT, k: stiffness * n / rest, d: damping * stiffness * n / rest}
    return system


def measure(n: int) -> list[Row]:
    """A cable that is straight at first and falls into its sag, by every method at every tolerance."""
    begun = clock.process_time()
    module = elastic_cable(n).embedding().compile(backend="c")
    derive = clock.process_time() - begun
    places = module.jacobian_indices()
    assert places is not None
    exact = module.simulate([0, DURATION], rtol=TIGHT, atol=TIGHT / 100).q[-1]
    rows = []
    for method, tolerances in TOLERANCES.items():
        module.simulate([0, DURATION / 100], method=method)  # compiles
        memory = _memory(module, method)
        for rtol in tolerances:
            begun = clock.thread_time()  # threads of a BLAS wait for each other, and would count
            sol = module.simulate([0, DURATION], method=method, rtol=rtol, atol=rtol / 100)
            seconds = (clock.thread_time() - begun) / DURATION
            rows.append(Row(n, places.n, len(places.rows), derive, method, rtol, sol.n_steps, sol.njev, sol.nlu, memory, seconds,
                            float(np.abs(sol.q[-1] - exact).max())))
    return rows


def _memory(module: Module, method: str) -> int:
    """What a run of a compiled method takes, B; 0 for other methods."""
    if not is_compiled(method):
        return 0
    library: Any = module.library(RightSide(method=method))
    size = library.function("simulation_size")
    size.restype = ctypes.c_long
    return int(size())


def speedups(rows: Sequence[Row], method: str) -> list[float]:
    """Of one cable: seconds of the runs of SciPy's Radau over those of a compiled method at the same error, which are
    interpolated between its runs, and those of its loosest run where this is more exact. Runs of SciPy's that are more exact than
    all of the other do not count."""
    own = sorted((row.error, row.seconds) for row in rows if row.method == method)
    errors, seconds = np.log(own).T
    return [float(row.seconds / np.exp(np.interp(np.log(row.error), errors, seconds)))
            for row in rows if row.method == "Radau" and row.error >= own[0][0]]


def exponent(rows: Sequence[Row], method: str, of: Callable[[Row], float]) -> float:
    """The power of the number of links that a quantity of a compiled method grows with, at one tolerance."""
    own = [(row.links, of(row)) for row in rows
           if row.method == method and row.links >= LEAST_OF_GROWTH and row.rtol == OF_GROWTH]
    logarithms = np.log(own)
    return float(np.polyfit(logarithms[:, 0], logarithms[:, 1], 1)[0])


# -- at rest


def at_rest(module: Module) -> tuple[np.ndarray, csc_matrix]:
    """The coordinates of a cable at rest, by Newton's iteration from where it starts, and the derivative of its accelerations by
    them there, a sparse matrix.

    Raises NoEquilibrium where the iteration does not end, or where nothing holds the cable on its way.
    """
    from scipy.sparse import csc_matrix
    from scipy.sparse.linalg import splu

    places, n = module.jacobian_indices(), module.metadata.sizes.q
    assert places is not None
    own = (places.rows >= n) & (places.columns < n)
    q = np.array([module.metadata.initial.get(name, 0.0) for name in module.metadata.q])
    for k in range(NEWTON_STEPS):
        state = np.concatenate([q, np.zeros(n)])
        values = module.evaluate("jacobian_x_packed", 0.0, state)
        slope = csc_matrix((values[own], (places.rows[own] - n, places.columns[own])), shape=(n, n))
        try:
            step = splu(slope).solve(-module.rhs(0.0, state)[n:])
        except RuntimeError:  # an exactly singular matrix
            raise NoEquilibrium(f"{module.metadata.name}: the shape at rest is looked for by Newton's iteration; at its step "
                                f"{k + 1} the stiffness of the {n} coordinates is singular; take a tension above 0") from None
        q = q + step
        if np.abs(step).max() <= SETTLED:
            return q, slope
    raise NoEquilibrium(f"{module.metadata.name}: the shape at rest is looked for by Newton's iteration; after {NEWTON_STEPS} "
                        f"steps the last one is {np.abs(step).max():.1e} m long, more than {SETTLED:g} m; take more tension, so "
                        "that the cable sags less")


def frequencies(slope: csc_matrix, count: int = 5) -> np.ndarray:
    """The lowest ones, rad/s."""
    from scipy.sparse.linalg import eigs

    values = eigs(-slope, count, sigma=0.0, return_eigenvectors=False, v0=np.ones(slope.shape[0]))
    return np.sort(np.sqrt(values.real))


def elastic_catenary(stiffness: float = EA, tension: float = TENSION) -> tuple[float, float]:
    """Horizontal tension, N, and sag, m, of the continuous cable: Irvine, Cable Structures, 1981, section 2.3."""
    rest = 1 / (1 + tension / stiffness)

    def span(H: float) -> float:
        return H * rest / stiffness + 2 * H / WEIGHT * rest * math.asinh(WEIGHT / (2 * H)) - 1

    H = float(brentq(span, 0.5 * tension, 2 * tension + WEIGHT, xtol=1e-15, rtol=1e-15))
    half = WEIGHT / 2
    sag = WEIGHT * rest / (8 * stiffness) + H * rest / WEIGHT * (math.sqrt(1 + (half / H)**2) - 1)
    return H, sag


def irvine(H: float, stiffness: float = EA, count: int = 5) -> np.ndarray:
    """The lowest frequencies in the plane, rad/s, of a cable with little sag under the horizontal tension H: Irvine, Cable
    Structures, 1981, section 3.2."""
    slope = WEIGHT / H
    stretched = 1 + slope**2 / 8
    square = slope**2 * stiffness / (H * stretched)
    result = [2 * math.pi * k for k in range(1, count + 1)]

    def symmetric(w: float) -> float:
        return math.sin(w / 2) - math.cos(w / 2) * (w / 2 - 4 / square * (w / 2)**3)

    grid = np.linspace(0.1, 2 * math.pi * count, 400 * count)
    values = [symmetric(w) for w in grid]
    result += [brentq(symmetric, a, b, xtol=1e-14) for a, b, f, h in zip(grid, grid[1:], values, values[1:]) if f * h < 0]
    return np.sort(result)[:count] * math.sqrt(H)


def compare(n: int) -> Rest:
    """A taut cable at rest compared with the elastic catenary, and with Irvine's frequencies: those of n links are off by the
    square of 1/n, which half as many links show and which is taken off."""
    H, sag = elastic_catenary(TAUT_EA, TAUT)
    result, exact = [], irvine(H, TAUT_EA)
    for links in (n // 2, n):
        q, slope = at_rest(elastic_cable(links, TAUT_EA, TAUT).embedding().compile(backend="c"))
        result.append(frequencies(slope))
    limit = result[1] + (result[1] - result[0]) / ((n / (n // 2))**2 - 1)
    own = -float(q[n - 1:].min())
    return Rest(n, own, abs(own / sag - 1), tuple(limit.tolist()), tuple(np.abs(limit / exact - 1).tolist()))


def run(sizes: Sequence[int] = SIZES, to_json: Path | None = None) -> int:
    """Measure and print; returns how many bounds on shapes and frequencies of 1,000 links and more are missed.

    Raises ArgumentError for numbers of links that are too small.
    """
    if not sizes or min(sizes) < 10:
        raise ArgumentError(f"stiff cables take numbers of links, 10 or more; found {' '.join(map(str, sizes)) or 'none'}")
    print(HEADING)
    rows = []
    for n in sizes:
        for row in measure(n):
            rows.append(row)
            print(row, flush=True)
    for method in filter(is_compiled, TOLERANCES):
        for n in sizes:
            found = speedups([row for row in rows if row.links == n], method)
            if found:
                print(f"{n:>6} links: at equal error Radau of SciPy takes {min(found):.0f} to {max(found):.0f} times as long as "
                      f"{method}")
        if sum(n >= LEAST_OF_GROWTH for n in sizes) > 1:
            print(f"        {method}: seconds of a step grow with links^{exponent(rows, method, lambda row: row.of_a_step):.2f}, "
                  f"memory with links^{exponent(rows, method, lambda row: row.memory):.2f}")
    print(REST_HEADING)
    rests = []
    for n in sizes:
        rests.append(compare(n))
        print(rests[-1], flush=True)
    if to_json is not None:
        result = {"motions": [asdict(row) for row in rows], "at rest": [asdict(rest) for rest in rests]}
        to_json.write_text(json.dumps(result, indent=1) + "\n", encoding="utf-8")
    return sum(error > BOUND for rest in rests if rest.links >= 1000 for error in (rest.sag_error, *rest.limit_errors))
