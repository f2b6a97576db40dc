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
from symdyn.lab.bridges import measured
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
# Stiffness and tension for shapes and frequencies: little sag, 0.3 mm, which the closed forms of frequencies suppose, N.
TAUT_EA, TAUT = 1.0e7, 4.0e3
# Deep sag, m, of a shape that the elastic catenary describes by its rest length.
DEEP = 0.2
# The largest relative errors of sags, shapes and limits of frequencies with 1,000 links.
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


REST_HEADING = (f"{'links':>6}{'sag m':>14}{'off':>10}{'shape off':>11}{'deep sag m':>14}{'off':>10}{'shape off':>11}"
                "   frequencies rad/s: of the links, off, off those of knots; their limit, off")


@dataclass(frozen=True)
class Rest:
    """A cable at rest with little and with deep sag: sags, m, and lowest frequencies, rad/s, of that with little sag, with what
    they differ from closed forms by, relative.

    shape_error, deep_shape_error   the largest distance of a knot from its place on the elastic catenary, over the cable's length
    own     frequencies of these links; knots_errors: compared with those that masses at knots have by Irvine's, see `of_knots`
    limit   frequencies of many links, from these and from those of half as many
    """

    links: int
    sag: float
    sag_error: float
    shape_error: float
    deep_sag: float
    deep_sag_error: float
    deep_shape_error: float
    own: tuple[float, ...]
    own_errors: tuple[float, ...]
    knots_errors: tuple[float, ...]
    limit: tuple[float, ...]
    limit_errors: tuple[float, ...]

    @property
    def bounded(self) -> tuple[float, ...]:
        """Errors that are to be within BOUND; frequencies of links differ from Irvine's by terms of second order in 1/n."""
        return (self.sag_error, self.shape_error, self.deep_sag_error, self.deep_shape_error, *self.knots_errors,
                *self.limit_errors)

    def __str__(self) -> str:
        """A line under REST_HEADING."""
        each = zip(self.own, self.own_errors, self.knots_errors, self.limit, self.limit_errors, strict=True)
        frequencies = "".join(f"{own:>12.6f}{off:>9.1e}{knots:>9.1e}{limit:>12.6f}{error:>9.1e}"
                              for own, off, knots, limit, error in each)
        return (f"{self.links:>6}{self.sag:>14.10f}{self.sag_error:>10.1e}{self.shape_error:>11.1e}{self.deep_sag:>14.10f}"
                f"{self.deep_sag_error:>10.1e}{self.deep_shape_error:>11.1e}{frequencies}")


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


def elastic_cable(n: int, stiffness: float = EA, tension: float = TENSION, damping: float = ETA,
                  knots: np.ndarray | None = None) -> System:
    """n springs with dampers and n - 1 knots in a plane between supports at (0, 0) and (1, 0), straight at first.

    stiffness   EA, N; tension, N, of the straight cable, negative where it is too long; damping: of the material, s
    knots       where they are at first, (n - 1, 2), m
    """
    m, length, g, k, d = parameters("m l g k d")
    system = System(f"elastic_cable_{n}", gravity=[0, -g])
    before, at = system.ground, [0, 0]
    for i, (x, y) in enumerate(zip(coordinates(f"x1:{n}"), coordinates(f"y1:{n}"), strict=True)):
        rail, knot = system.add_body(f"rail{i + 1}", mass=0), system.add_body(f"knot{i + 1}", mass=m)
        system.add_joint(Prismatic(f"along{i + 1}", system.ground, rail, x, axis=[1, 0, 0]))
        system.add_joint(Prismatic(f"up{i + 1}", rail, knot, y, axis=[0, 1, 0]))
        system.add_spring_damper(before, knot, stiffness=k, damping=d, length=length, point_a=at)
        system.initial |= {x: (i + 1) / n} if knots is None else {x: knots[i, 0], y: knots[i, 1]}
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
    pattern = module.jacobian_indices()
    assert pattern is not None
    exact = module.simulate([0, DURATION], rtol=TIGHT, atol=TIGHT / 100).q[-1]
    rows = []
    for method, tolerances in TOLERANCES.items():
        module.simulate([0, DURATION / 100], method=method)  # compiles
        memory = _memory(module, method)
        for rtol in tolerances:
            begun = clock.thread_time()  # threads of a BLAS wait for each other, and would count
            sol = module.simulate([0, DURATION], method=method, rtol=rtol, atol=rtol / 100)
            seconds = (clock.thread_time() - begun) / DURATION
            rows.append(Row(n, pattern.n, len(pattern.rows), derive, method, rtol, sol.n_steps, sol.njev, sol.nlu, memory,
                            seconds, float(np.abs(sol.q[-1] - exact).max())))
    return rows


def _memory(module: Module, method: str) -> int:
    """Memory of a run of a compiled method, B; 0 for other methods."""
    if not is_compiled(method):
        return 0
    library: Any = module.library(RightSide(method=method))
    size = library.function("simulation_size")
    size.restype = ctypes.c_long
    return int(size())


def speedups(rows: Sequence[Row], method: str) -> list[float]:
    """Speedups for one cable: seconds of the runs of SciPy's Radau over those of a compiled method at the same error, which are
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

    pattern, n = module.jacobian_indices(), module.metadata.sizes.q
    assert pattern is not None
    own = (pattern.rows >= n) & (pattern.columns < n)
    q = np.array([module.metadata.initial.get(name, 0.0) for name in module.metadata.q])
    for k in range(NEWTON_STEPS):
        state = np.concatenate([q, np.zeros(n)])
        values = module.evaluate("jacobian_x_packed", 0.0, state)
        slope = csc_matrix((values[own], (pattern.rows[own] - n, pattern.columns[own])), shape=(n, n))
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


def hanging(H: float, rest: float, stiffness: float, part: np.ndarray | float) -> tuple[np.ndarray, np.ndarray]:
    """Places x, y of an elastic catenary with the horizontal tension H, N, and the rest length, m, at parts of it from 0 to 1:
    Irvine, Cable Structures, 1981, section 2.3."""
    end, here = WEIGHT / (2 * H), WEIGHT / H * (0.5 - np.asarray(part))
    x = H * rest / stiffness * part + H * rest / WEIGHT * (math.asinh(end) - np.arcsinh(here))
    y = WEIGHT * rest / (2 * stiffness) * part * (1 - part) + H * rest / WEIGHT * (math.sqrt(1 + end**2) - np.sqrt(1 + here**2))
    return x, -y


def elastic_catenary(stiffness: float = EA, tension: float = TENSION) -> tuple[float, float]:
    """Horizontal tension, N, and sag, m, of the continuous cable."""
    rest = 1 / (1 + tension / stiffness)
    H = float(brentq(lambda H: float(hanging(H, rest, stiffness, 1.0)[0]) - 1, 0.5 * tension, 2 * tension + WEIGHT, xtol=1e-15,
                     rtol=1e-15))
    return H, -float(hanging(H, rest, stiffness, 0.5)[1])


def deep_catenary(sag: float, stiffness: float) -> tuple[float, float]:
    """Horizontal tension, N, and rest length, m, of the continuous cable between supports 1 m apart that sags so far, m."""

    def rest(H: float) -> float:
        return 1 / float(hanging(H, 1.0, stiffness, 1.0)[0])  # places are proportional to the rest length

    H = float(brentq(lambda H: -float(hanging(H, rest(H), stiffness, 0.5)[1]) - sag, 1e-2 * WEIGHT, 1e3 * WEIGHT, xtol=1e-15,
                     rtol=1e-15))
    return H, rest(H)


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


def of_knots(frequency: np.ndarray, H: float, links: int) -> np.ndarray:
    """Frequencies of a taut string whose mass stands at the knots of so many links, from those of the uniform string, rad/s:
    waves run along it with the frequency 2 n c sin(kappa / (2 n)), kappa = frequency / c the wave number and c the speed of waves
    (Lagrange; Rayleigh, The Theory of Sound, section 120)."""
    c = math.sqrt(H)
    return 2 * links * c * np.sin(frequency / (2 * links * c))


def compare(n: int) -> Rest:
    """Cables at rest compared with the elastic catenary, and a taut one with Irvine's frequencies: those of n links are off by
    the square of 1/n, as masses at knots are, and as half as many links show. Irvine's suppose little sag: those of a cable with
    deep sag are not compared."""
    H, sag = elastic_catenary(TAUT_EA, TAUT)
    count = min(5, n // 2 - 1)  # half as many links have one less across the cable than there are links
    result, exact = [], irvine(H, TAUT_EA, count)
    for links in (n // 2, n):
        q, slope = at_rest(elastic_cable(links, TAUT_EA, TAUT).embedding().compile(backend="c"))
        result.append(frequencies(slope, count))
    limit = result[1] + (result[1] - result[0]) / ((n / (n // 2))**2 - 1)
    rest = 1 / (1 + TAUT / TAUT_EA)
    deep, deep_shape_error = _deep(n)
    return Rest(n, _sag(q), abs(_sag(q) / sag - 1), _astray(q, H, rest, TAUT_EA), deep, abs(deep / DEEP - 1), deep_shape_error,
                tuple(result[1].tolist()), tuple(np.abs(result[1] / exact - 1).tolist()),
                tuple(np.abs(result[1] / of_knots(exact, H, n) - 1).tolist()), tuple(limit.tolist()),
                tuple(np.abs(limit / exact - 1).tolist()))


def _deep(n: int) -> tuple[float, float]:
    """The sag of n links with the rest length of a deep catenary, m, and how far knots are from it. Newton's iteration begins
    at a polygon on a parabola."""
    H, rest = deep_catenary(DEEP, EA)
    along = np.linspace(0, 1, 10 * n + 1)
    bow = -4 * DEEP * along * (1 - along)
    length = np.concatenate([[0], np.cumsum(np.hypot(np.diff(along), np.diff(bow)))])
    parts = np.linspace(0, length[-1], n + 1)[1:-1]
    knots = np.column_stack([np.interp(parts, length, along), np.interp(parts, length, bow)])
    q, _ = at_rest(elastic_cable(n, EA, EA * (1 / rest - 1), knots=knots).embedding().compile(backend="c"))
    return _sag(q), _astray(q, H, rest, EA)


def _sag(q: np.ndarray) -> float:
    return -float(q[1::2].min())


def _astray(q: np.ndarray, H: float, rest: float, stiffness: float) -> float:
    """The largest distance of a knot from its place on the elastic catenary, over the length at rest."""
    x, y = q[::2], q[1::2]
    exact = hanging(H, rest, stiffness, np.arange(1, len(x) + 1) / (len(x) + 1))
    return float(np.hypot(x - exact[0], y - exact[1]).max() / rest)


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
    rests = measured(sizes, compare, REST_HEADING, None)
    if to_json is not None:
        result = {"motions": [asdict(row) for row in rows], "at rest": [asdict(rest) for rest in rests]}
        to_json.write_text(json.dumps(result, indent=1) + "\n", encoding="utf-8")
    return sum(error > BOUND for rest in rests if rest.links >= 1000 for error in rest.bounded)
