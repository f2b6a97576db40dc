"""Optimal motions by direct methods: collocation and multiple shooting, on meshes that are refined where errors are too large."""

from __future__ import annotations

import contextlib
import time as clock
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.interpolate import PPoly

from symdyn.errors import ArgumentError, EvaluationError, NoOptimum, OptimumWarning, SymdynError
from symdyn.optimal import ipopt, scipy_solvers
from symdyn.optimal.discretized import Discretized, Motion
from symdyn.optimal.functions import WithFunctions
from symdyn.optimal.ipopt import Found
from symdyn.optimal.loops import on_constraints, unit_groups
from symdyn.optimal.problem import Faults, Problem, problem_of
from symdyn.optimal.result import MeshRecord, Optimum
from symdyn.optimal.sizes import Sizes
from symdyn.optimal.transcription import Transcription, hermite_simpson, radau, shooting
from symdyn.real_numbers import NotReal, real
from symdyn.runtime.module import demand_module
from symdyn.runtime.raised import InputRaised
from symdyn.shown import by_name, shown

if TYPE_CHECKING:
    from typing import TypeAlias

    import sympy as sp

    from symdyn.given import ByName, Named, Numbers, Row, Values
    from symdyn.runtime.losses import Loss
    from symdyn.runtime.module import Module
    from symdyn.runtime.solutions.solution import Solution

    # By name or symbol: a number, or (least, most).
    Limits: TypeAlias = Named[float] | Named[tuple[float, float]] | Named[float | tuple[float, float]]
    # The same, None for any value; or a whole state in order.
    Ends: TypeAlias = Row | Limits | Named[float | None] | Named[float | tuple[float, float] | None]

TRANSCRIPTIONS = ("hermite-simpson", "radau", "shooting")
METHODS = ("ipopt", *scipy_solvers.METHODS)
# An interval is cut into so many at most, by one refinement; no mesh has more intervals; steps of shooting in an interval.
PARTS, MOST_INTERVALS, MOST_STEPS = 4, 2000, 512
# Degrees of Radau's method: the inputs between its points are at most cubic, as tables have them.
DEGREES = (1, 2, 3, 4)
# Violation of the elastic problem, in sizes of conditions, from which on the problem is infeasible.
MISSED = 1e-6
# Relative difference of a motion simulated back that gives no warning: without a tolerance; with one, its root.
APART = 0.01
# Changes of cost and conditions up to which nothing depends on a value.
UNCHANGED = 1e-12
# A cost that is as far below that of the guess, in units of it and of its size, has fallen without bound.
FALLEN = 1e8
# A motion that is so many times as large as it was taken for is found once more, with sizes by itself.
GROWN = 100.0
# Normals at the guess are taken again where the smallest singular value of their products with those at the solution is less.
TRANSVERSAL = 0.5


def optimize(module: Module, cost: Loss | Sequence[Loss], duration: float | tuple[float, float], start: Ends | str | None = None,
             end: Ends | None = None, *, bounds: Limits | None = None, rates: Limits | None = None,
             path: Sequence[sp.Basic] = (), boundary: Sequence[sp.Basic] = (), parameters: Limits | None = None,
             params: Values | None = None, inputs: Numbers | None = None, t: float = 0.0,
             guess: Solution | Optimum | ByName | None = None, transcription: str | None = None, intervals: int | Row = 20,
             degree: int | None = None, steps: int = 4, hold: bool = False, tolerance: float | None = 1e-6,
             max_refinements: int = 6, method: str = "ipopt", accuracy: float = 1e-8, max_iterations: int = 1000,
             options: Mapping[str, str | float] | None = None, verbose: bool = False) -> Optimum:
    """The motion of least cost between a start and an end, with its inputs and free parameters.

    cost         sd.Loss of expressions: integral of coordinates, speeds, extra states, inputs, parameters, outputs and sd.t; end
                 of these at the end and of values at the start, called "q1(0)". Entries of outputs are called "tip[0]". Or of
                 functions that give their derivatives; or several of them, which are added up
    duration     s; or (least, most) for one that is found
    start, end   by name or symbol: a number, (least, most), or None for any value; or a whole state in order. A state that start
                 leaves out has the system's initial value, one that end leaves out is free; start="free": all are
    bounds       of states and inputs at all times: name -> (least, most); rates: of the rates of inputs, by the input's name,
                 1/s; inputs that have them are continuous
    path, boundary   conditions at all times, and on both ends: relations sp.Eq(a, b), a <= b, a >= b of expressions as in the
                 cost
    parameters   those that are free: name -> (least, most); params: values of all parameters, where the search begins of these
    inputs       constant inputs that are prescribed, by name
    t            time at the start, s
    guess        a Solution, an Optimum, or a mapping: "t" -> times (n,), states and inputs -> values (n,), free parameters ->
                 numbers; what is left out goes straight from the start to the end
    transcription   "hermite-simpson": cubic states, order 4; "radau": collocation at `degree` points, 1 to 4, of order
                 2 degree - 1; "shooting": `steps` of Runge and Kutta's method in each interval, with inputs that are constant
                 there (hold) or straight. Default: "hermite-simpson", degree 3; where an equality of path holds states alone
                 "radau", degree 4
    intervals    of the first mesh, or its ends as shares of the duration from 0 to 1
    tolerance    error of each interval, relative, up to which the mesh is refined, max_refinements times; None: it is not
    method       "ipopt", by CasADi (pip install 'symdyn[opt]'), or SciPy's "slsqp" or "trust-constr", for small problems
    accuracy, max_iterations, options   of the solver; options: IPOPT's own; verbose: print its iterations

    Constraints of closed loops are kept at the ends of all intervals, for positions and velocities. All derivatives are exact.
    Derivatives that functions of the cost give are compared with differences of their values, at the guess and at the result.
    The result is simulated back. An OptimumWarning reports errors above the tolerance on the last mesh, and a motion simulated
    back that differs by more than the root of the tolerance, 0.01 without one, relative to the size of a state, `sizes` of the
    result; so does a cost integrated along the motion. Another one names costs and conditions that jump. Raises ArgumentError
    with all faults, NoOptimum with what is violated and by how much, whose `optimum` is what was computed; EvaluationError for a
    cost that is not finite; MissingExtra where IPOPT is not installed.

    >>> x = sd.coordinates("x")
    >>> F = sd.inputs("F")
    >>> system = sd.System("slider")
    >>> body = system.add_body("body", mass=1)
    >>> slide = system.add_joint(sd.Prismatic("slide", system.ground, body, axis=[1, 0], coordinate=x))
    >>> system.add_joint_force(slide, F)
    >>> found = sd.optimize(system.compile(), sd.Loss(end=sd.t), (0.1, 10), end={x: 1, x.dot: 0}, bounds={F: (-1, 1)},
    ...                     transcription="shooting", hold=True)
    >>> round(found.duration, 6)  # bang-bang: 2 sqrt(1 m/(1 m/s^2))
    2.0
    """
    demand_module(module, "sd.optimize")
    begun = clock.perf_counter()
    faults = Faults(module.name)
    chosen = _Chosen.of(transcription, intervals, degree, steps, hold, tolerance, max_refinements, method, accuracy,
                        max_iterations, options, verbose, faults)
    try:
        problem = problem_of(module, cost, duration, start, end, bounds, rates, path, boundary, parameters, params, inputs, t)
    except ArgumentError as error:
        faults.add(str(error).removeprefix(f"{module.name}: "))
    else:
        if hold is True and np.isfinite(problem.rates).any():
            faults.add("inputs that are held jump between intervals, and have bounds of rates; leave out hold, or the bounds")
    faults.demand_none()
    assert chosen is not None
    course = _guess(problem, guess, faults)
    faults.demand_none()
    if method == "ipopt":
        ipopt.casadi()
    if problem.jumps:
        warnings.warn(f"{module.name}: {'; '.join(problem.jumps)}. Solvers that go by derivatives do not see jumps, and end at a "
                      "motion next to which others may cost less: make them smooth, or optimize once for each side, with the "
                      "side as a condition of path, and compare the costs", OptimumWarning, stacklevel=2)
    on_states = bool(_on_states(problem))
    chosen = replace(chosen, kind=chosen.kind or ("radau" if on_states else "hermite-simpson"),
                     degree=chosen.degree or (4 if on_states else 3))
    return _Search(problem, chosen, course, begun).run()


def _on_states(problem: Problem, alone: slice = slice(0)) -> list[str]:
    """Equalities at all times that hold states and no inputs, and none of those states `alone`: inputs have to be such that they
    stay fulfilled.

    Those of Hermite and Simpson's method then go to and fro from point to point. With points of Radau their order is the degree
    less 1 for conditions of speeds, less 2 for those of coordinates.
    Source: Hairer and Wanner, Solving Ordinary Differential Equations II, sections VII.4 and VII.5.
    """
    conditions, slopes = problem.path, problem.path.expressions.slopes
    held = (conditions.least == conditions.most) & ~slopes[:, problem.of.inputs].any(axis=1) & ~slopes[:, alone].any(axis=1)
    return [text for text, one in zip(conditions.texts, held, strict=True) if one]


@dataclass(frozen=True)
class _Chosen:
    """Choices of the optimization, checked."""

    kind: str | None
    breaks: np.ndarray
    degree: int | None
    steps: int
    hold: bool
    tolerance: float | None
    max_refinements: int
    method: str
    accuracy: float
    max_iterations: int
    options: Mapping[str, Any]
    verbose: bool

    @classmethod
    def of(cls, kind: Any, intervals: Any, degree: Any, steps: Any, hold: Any, tolerance: Any, refinements: Any, method: Any,
           accuracy: Any, iterations: Any, options: Any, verbose: Any, faults: Faults) -> _Chosen | None:
        """Adds what does not fit to the faults."""
        n = len(faults.found)
        for what, value, there in (("transcription", kind, TRANSCRIPTIONS), ("method", method, METHODS)):
            if not (value is None and what == "transcription") and (not isinstance(value, str) or value not in there):
                faults.add(f"{what} is {shown(value)}; there are {', '.join(map(repr, there))}")
        for what, value, least, most in (("degree", degree, 1, DEGREES[-1]), ("steps", steps, 1, MOST_STEPS),
                                         ("max_refinements", refinements, 0, 100), ("max_iterations", iterations, 1, 10**9)):
            if value is None and what == "degree":
                continue
            if isinstance(value, bool) or not isinstance(value, (int, np.integer)) or not least <= value <= most:
                faults.add(f"{what} is {shown(value)}; pass a whole number from {least} to {most}")
        for what, value in (("tolerance", tolerance), ("accuracy", accuracy)):
            fits = isinstance(value, (int, float, np.number)) and not isinstance(value, bool) and 0 < value < 1
            if not fits and not (what == "tolerance" and value is None):
                or_none = ", or None" if what == "tolerance" else ""
                faults.add(f"{what} is {shown(value)}; pass a number between 0 and 1{or_none}")
        if not isinstance(hold, bool) or (hold and kind in (None, *TRANSCRIPTIONS) and kind != "shooting"):
            faults.add(f"hold is {shown(hold)}, and transcription is {shown(kind)}; inputs are held with \"shooting\" alone")
        breaks = _breaks(intervals, faults)
        if options is not None and not isinstance(options, Mapping):
            faults.add(f"options is {shown(options)}; pass a mapping from names of IPOPT's options to values")
        if len(faults.found) > n:
            return None
        return cls(kind, breaks, None if degree is None else int(degree), int(steps), bool(hold), tolerance, int(refinements),
                   method, float(accuracy), int(iterations), dict(options or {}), bool(verbose))

    def mesh(self, breaks: np.ndarray) -> Transcription:
        """The transcription on a mesh."""
        if self.kind == "radau":
            assert self.degree is not None
            return radau(breaks, self.degree)
        return hermite_simpson(breaks) if self.kind == "hermite-simpson" else shooting(breaks, self.hold)


def _breaks(intervals: Any, faults: Faults) -> np.ndarray:
    if isinstance(intervals, (int, np.integer)) and not isinstance(intervals, bool):
        if 1 <= intervals <= MOST_INTERVALS:
            return np.linspace(0.0, 1.0, int(intervals) + 1)
    else:
        try:
            result = real(intervals)
            if result.ndim == 1 and len(result) > 1 and result[0] == 0 and result[-1] == 1 and (np.diff(result) > 0).all():
                return result
        except NotReal:
            pass
    faults.add(f"intervals is {shown(intervals)}; pass a whole number from 1 to {MOST_INTERVALS}, or increasing numbers from 0 "
               "to 1")
    return np.array([0.0, 1.0])


@dataclass(frozen=True)
class _Course:
    """A guess: state and inputs over shares of the duration; parameters and duration; leading: coordinates that a guess has which
    constraints are still to be fulfilled by, None for one that fulfils them."""

    x: Any
    inputs: Any
    p: np.ndarray
    T: float
    leading: tuple[str, ...] | None = None

    def on(self, mesh: Transcription) -> Motion:
        """At the nodes and samples of a mesh."""
        middle = mesh.samples if mesh.kind != "shooting" or len(mesh.samples) == len(mesh.breaks) else (
            mesh.breaks[1:] + mesh.breaks[:-1]) / 2
        return Motion(np.asarray(self.x(mesh.nodes)), np.asarray(self.inputs(middle)), self.p, self.T)


def _guess(problem: Problem, given: Any, faults: Faults) -> _Course:
    """The course that the search begins with. Adds what does not fit to the faults."""
    metadata, p = problem.module.metadata, problem.p.copy()
    T = float(problem.duration.mean())
    begin = _middle(problem.start, np.array([metadata.initial.get(n, 0.0) for n in metadata.x]))
    ends = [begin, _middle(problem.end, begin)]
    idle = np.array([metadata.initial.get(n, 0.0) for n in metadata.inputs])
    columns = {n: ([0.0, 1.0], [ends[0][k], ends[1][k]]) for k, n in enumerate(metadata.x)}
    columns |= {n: ([0.0, 1.0], [v, v]) for n, v in zip(metadata.inputs, np.clip(idle, *problem.inputs), strict=True)}
    as_motion = given is not None and not isinstance(given, Mapping)
    if as_motion:
        given = _of_motion(given, problem.free, faults)
    named = by_name(given)
    if named:
        times = None
        if "t" in named:
            times = _row(named.pop("t"), "t", faults)
            if times is not None and (len(times) < 2 or (np.diff(times) <= 0).any()):
                faults.add("t of the guess must be two or more increasing times")
                times = None
            elif times is not None:
                T = float(np.clip(times[-1] - times[0], *problem.duration))
        for key, value in named.items():
            name = faults.name(key, (*columns, *problem.free, "t"), "guess")
            row = _row(value, key, faults) if name is not None else None
            if name is None or row is None:
                continue
            if name in problem.free:
                p[metadata.parameters.index(name)] = row.ravel()[0]
                continue
            n = 1 if row.ndim == 0 else len(row)
            shares = np.linspace(0, 1, max(n, 2)) if times is None else (times - times[0]) / (times[-1] - times[0])
            if row.ndim == 0:
                columns[name] = ([0.0, 1.0], [float(row)] * 2)
            elif len(shares) != n:
                faults.add(f"{name} of the guess has {n} values, and t has {len(shares)}")
            else:
                columns[name] = (shares.tolist(), row.tolist())
    course = lambda names: lambda share: np.column_stack([np.interp(share, *columns[n]) for n in names]) if len(names) else (
        np.zeros((len(share), 0)))
    fixed = (problem.start[0] == problem.start[1]) & (problem.end[0] == problem.end[1])
    leading = None if as_motion else tuple(n for n, both in zip(metadata.x, fixed, strict=True) if both or n in named)
    return _Course(course(metadata.x), course(metadata.inputs), p, T, leading)


def _middle(bounds: np.ndarray, left_out: np.ndarray) -> np.ndarray:
    """Middle of bounds (2, n), the finite one, or the value that stands for none."""
    low, high = bounds
    both = np.isfinite(low) & np.isfinite(high)
    result = np.where(both, (np.where(both, low, 0) + np.where(both, high, 0)) / 2, left_out)
    return np.asarray(np.clip(result, low, high))


def _of_motion(given: Any, free: Sequence[str], faults: Faults) -> dict[str, Any]:
    """A Solution or an Optimum as a mapping."""
    try:
        metadata = given.module.metadata
        values = {n: v for n, v in given.values.items() if n in free} if isinstance(given, Optimum) else {}
        inputs = np.broadcast_to(given.inputs, (len(given.t), len(metadata.inputs)))
        return {"t": given.t, **dict(zip((*metadata.x, *metadata.inputs), np.hstack([given.x, inputs]).T, strict=True)), **values}
    except (AttributeError, ValueError):
        faults.add(f"guess is {shown(given)}; pass a Solution, an Optimum, or a mapping from names to values")
        return {}


def _row(value: Any, name: str, faults: Faults) -> np.ndarray | None:
    try:
        result = real(value)
    except NotReal as error:
        faults.add(f"{name} of the guess must be numbers, found {shown(value)}: {error}")
        return None
    if result.ndim > 1:
        faults.add(f"{name} of the guess must be numbers in a row, found the shape {result.shape}")
        return None
    wrong = np.flatnonzero(~np.isfinite(result))
    if len(wrong):
        of = f", of {result.size} values {len(wrong)} are not" if len(wrong) > 1 else ""
        at = f" at its index {wrong[0]}" if result.ndim else ""
        faults.add(f"{name} of the guess must be finite, and is {result.ravel()[wrong[0]]}{at}{of}")
        return None
    return result


@dataclass(frozen=True)
class _Solved:
    """Solution on a mesh, with the errors of its intervals, (K,): of states and of the cost; along: the cost integrated
    along the motion; records: of this mesh and those before."""

    made: Discretized
    found: Found
    of_states: np.ndarray
    of_cost: np.ndarray
    along: float
    records: tuple[MeshRecord, ...]

    @property
    def errors(self) -> np.ndarray:
        return np.maximum(self.of_states, self.of_cost)


@dataclass(eq=False)
class _Search:
    """Solves on one mesh after the other."""

    problem: Problem
    chosen: _Chosen
    course: _Course
    begun: float

    def run(self) -> Optimum:
        """See optimize."""
        chosen, problem = self.chosen, self.problem
        breaks, steps, course = chosen.breaks, chosen.steps, self.course
        tolerance = chosen.tolerance
        solved: _Solved | None = None
        sizes: Sizes | None = None
        while True:
            before, solved = solved, self._measured(*self._solved(breaks, steps, course, sizes), solved)
            self._demand_derivatives(solved.made, solved.found.z)
            if not solved.found.solved:
                raise self._failed(solved, before)
            too_large = tolerance is not None and not bool((solved.errors <= tolerance).all())
            if not too_large or len(solved.records) > chosen.max_refinements:
                break
            assert tolerance is not None
            finer = self._refined(solved.made, solved.errors, tolerance, breaks, steps)
            if finer is None:
                break
            breaks, steps = finer
            motion = solved.made.motion(solved.found.z)
            x, u = solved.made.polynomials(motion)
            course, sizes = _Course(x, u, motion.p, motion.T), solved.made.found_sizes(solved.found.z)
        if too_large:
            of = "" if solved.of_states.max() >= solved.of_cost.max() else ", of the integral of the cost,"
            warnings.warn(f"{problem.module.name}: the error of an interval{of} is {solved.errors.max():.2g} after "
                          f"{len(solved.records)} meshes, above the tolerance {tolerance:g}; allow more refinements, or pass a "
                          f"larger tolerance{self._radau_instead()}", OptimumWarning, stacklevel=3)
        optimum = self._optimum(solved)
        rough = _on_states(problem, slice(problem.module.metadata.sizes.q, problem.of.n_x)) if chosen.degree in (1, 2, 3) and (
            chosen.kind == "radau") else []
        if rough:
            order = "do not converge" if chosen.degree != 3 else "converge by the first order alone"
            warnings.warn(f"{problem.module.name}: inputs {order} with degree {chosen.degree} under the condition {rough[0]}, "
                          "which holds coordinates, and the cost is that far from the least one; leave degree out, for 4",
                          OptimumWarning, stacklevel=3)
        if self.undetermined:
            few = len(self.undetermined) == 1
            warnings.warn(f"{problem.module.name}: nothing depends on {', '.join(self.undetermined)} along the motion, so that "
                          f"{'it keeps its' if few else 'they keep their'} guess and {'is' if few else 'are'} undetermined; "
                          f"{'prescribe it' if few else 'prescribe them'}, or let the cost depend on "
                          f"{'it' if few else 'them'}", OptimumWarning, stacklevel=3)
        apart = self._apart(optimum, solved)
        if apart:
            warnings.warn(f"{problem.module.name}: {apart}; {self._finer(optimum)}", OptimumWarning, stacklevel=3)
        return optimum

    def _apart(self, optimum: Optimum, solved: _Solved) -> str:
        """Quantities in which the motion simulated back, and the cost along it, differ by too much; nothing if they do not."""
        tolerance = self.chosen.tolerance
        most = APART if tolerance is None else np.sqrt(tolerance)
        if optimum.simulated is None or not optimum.simulated.success:
            why = "" if optimum.simulated is None else f": {optimum.simulated.message}"
            return f"the motion could not be simulated back by its inputs{why}"
        gaps, result = np.array(list(optimum.difference.values())), []
        parts = gaps / np.array(list(optimum.sizes.values()))
        if len(parts) and not parts.max() <= most:
            k = int(parts.argmax())
            result.append(f"simulated back by its inputs, {optimum.module.metadata.x[k]} differs by {gaps[k]:.3g} from the "
                          "motion found")
        away, least = abs(optimum.cost_difference), 2 * self.chosen.accuracy * solved.made.scaled.cost_size
        if not away <= max(most * max(abs(optimum.cost), abs(optimum.integrated_cost)), least):
            result.append(f"the cost is {optimum.cost:.6g} by the quadrature of the mesh, and {optimum.integrated_cost:.6g} "
                          "integrated along the motion")
        return "; ".join(result) + (f" (allowed is {most:.2g} of the size of a state, or of the cost)" if result else "")

    def _finer(self, optimum: Optimum) -> str:
        """Advice about a motion that is not exact enough."""
        if self.chosen.tolerance is None:
            return f"pass a tolerance, with which the mesh is refined, or more intervals{self._radau_instead()}"
        return f"pass a smaller tolerance, or keep an unstable motion by a regulator, optimum.lqr{self._radau_instead()}"

    def _radau_instead(self) -> str:
        """Advice to replace Hermite and Simpson's method where equalities hold states alone."""
        held = _on_states(self.problem) if self.chosen.kind == "hermite-simpson" else []
        return f"; or leave transcription out: inputs of Hermite and Simpson go to and fro under {held[0]}" if held else ""

    def _measured(self, made: Discretized, result: Found, before: _Solved | None) -> _Solved:
        """With the errors of the intervals."""
        of_states = of_cost = np.full(made.mesh.n_intervals, np.nan)
        along = np.nan
        if np.isfinite(result.z).all():
            of_states = made.errors(result.z)
            along, of_cost = made.cost_along(result.z, self.chosen.accuracy)
        record = MeshRecord(made.mesh.n_intervals, made.steps, result.iterations, result.cost,
                            float(np.maximum(of_states, of_cost).max()), self._lap())
        return _Solved(made, result, of_states, of_cost, along, (*(before.records if before is not None else ()), record))

    def _lap(self) -> float:
        now = clock.perf_counter()
        lap, self._last = now - getattr(self, "_last", self.begun), now
        return lap

    def _solved(self, breaks: np.ndarray, steps: int, course: _Course, sizes: Sizes | None) -> tuple[Discretized, Found]:
        """The solution on a mesh; once more where the normals of constraints have turned too far from those of the guess, or
        something is much larger than it was taken for. sizes: of the mesh before; None: by what is given."""
        mesh = self.chosen.mesh(breaks)
        guess = course.on(mesh)
        if course.leading is not None and self.problem.module.metadata.constraints:
            t = self.problem.t0 + mesh.nodes * course.T
            guess = replace(guess, X=on_constraints(self.problem.module, t, guess.X, guess.p, course.leading))
        for group in unit_groups(self.problem.module):
            lengths = np.linalg.norm(guess.X[:, group], axis=1)
            if not (lengths > 0).all():
                names = [self.problem.module.metadata.q[k] for k in group]
                raise ArgumentError(f"{self.problem.module.name}: {', '.join(names)} have unit length together, and are zero in "
                                    "the guess; pass a guess of them, or the other sign at the end, the same orientation")
            guess.X[:, group] /= lengths[:, None]
        for _ in range(4):
            made = Discretized(self.problem, mesh, steps, guess, sizes=sizes)
            self._demand_finite(made)
            self._demand_derivatives(made, made.z)
            result = self._kept(made, self._solve(made))
            if not np.isfinite(result.z).all():
                break
            assert made.sizes is not None
            now = made.found_sizes(result.z)
            turned = result.solved and bool(made.normals.size) and (
                made.transversal(made.motion(result.z)) <= TRANSVERSAL)
            if not turned and not (result.solved and now.grown(made.sizes, GROWN)):
                break
            guess, sizes = made.motion(result.z), now
        return made, result

    def _kept(self, made: Discretized, result: Found) -> Found:
        """With the guesses of what nothing depends on, which solvers move away from bounds."""
        self.undetermined: tuple[str, ...] = ()
        if not result.solved or not np.isfinite(result.z).all():
            return result
        names, z, least = made.undetermined(result.z), result.z.copy(), made.violations(result.z)
        for where in names.values():
            z[where] = made.z[where]
        same = abs(made.program.f(z) - result.cost) <= UNCHANGED * (made.scaled.cost_size + abs(result.cost))
        if not names or not same or not (made.violations(z) <= least + UNCHANGED).all():
            return result
        self.undetermined = tuple(names)
        return replace(result, z=z)

    def _demand_derivatives(self, made: Discretized, z: np.ndarray) -> None:
        """Raises ArgumentError where derivatives that functions of the cost give are not those of their values: at the start, in
        the middle and at the end."""
        if not np.isfinite(z).all():
            return
        motion, of = made.motion(z), self.problem.of
        middle = made.mesh.nodes[[0, len(motion.X) // 2, -1]]
        X, inputs = motion.X[[0, len(motion.X) // 2, -1]], np.zeros((3, of.n_in))
        free = np.broadcast_to(motion.p[list(of.free)], (3, len(of.free)))
        rows = np.hstack([X, inputs, free, (self.problem.t0 + middle * motion.T)[:, None]])
        both = np.concatenate([X[0], rows[-1]])[None, :]
        for cost, at in ((self.problem.integrand, rows), (self.problem.end_cost, both)):
            if isinstance(cost, WithFunctions):
                cost.demand_derivatives(at)

    def _solve(self, made: Discretized) -> Found:
        chosen = self.chosen
        scaled, begin = made.scaled, made.z / made.scaled.z_sizes
        if chosen.method == "ipopt":
            result = ipopt.solve(scaled, begin, chosen.accuracy, chosen.max_iterations, chosen.options, chosen.verbose)
        else:
            result = scipy_solvers.solve(scaled, begin, chosen.accuracy, chosen.max_iterations, chosen.method)
        return replace(result, z=result.z * scaled.z_sizes, cost=result.cost * scaled.cost_size,
                       multipliers=result.multipliers * scaled.cost_size / scaled.g_sizes,
                       of_bounds=result.of_bounds * scaled.cost_size / scaled.z_sizes)

    def _demand_finite(self, made: Discretized) -> None:
        """Raises EvaluationError where cost or constraints are not finite at the guess."""
        owner, program = self.problem.module.name, made.program
        if not np.isfinite(program.f(made.z)) or not np.isfinite(program.gradient(made.z)).all():
            raised = [cost.raised for cost in (self.problem.integrand, self.problem.end_cost)
                      if isinstance(cost, WithFunctions) and cost.raised is not None]
            if raised and isinstance(raised[0], InputRaised):
                raise raised[0]
            what = str(raised[0]).removeprefix(f"{owner}: ") if raised else f"{program.f(made.z):g}"
            raise EvaluationError(f"{owner}: the cost, or its derivative, is not finite at the guess: {what}; pass another "
                                  "guess, or bounds where it is finite")
        wrong = np.flatnonzero(~np.isfinite(program.g(made.z)))
        if len(wrong):
            raise EvaluationError(f"{owner}: {made.text(program, int(wrong[0]))} cannot be evaluated at the guess; pass another "
                                  "guess")

    def _refined(self, made: Discretized, errors: np.ndarray, tolerance: float, breaks: np.ndarray,
                 steps: int) -> tuple[np.ndarray, int] | None:
        """The next mesh: intervals cut, steps of shooting halved, by the order of their errors; None: it would be too fine."""
        order = made.mesh.order
        if made.mesh.kind == "shooting":
            wanted = np.nan_to_num((errors.max() / tolerance) ** (1 / order), nan=PARTS, posinf=PARTS)
            more = int(np.ceil(steps * np.clip(wanted, 1.2, PARTS)))
            return (breaks, more) if more <= MOST_STEPS else None
        wanted = np.nan_to_num(np.ceil((errors / tolerance) ** (1 / order)), nan=PARTS, posinf=PARTS)
        parts = np.where(errors <= tolerance, 1, np.clip(wanted, 2, PARTS)).astype(int)
        if parts.sum() > MOST_INTERVALS:
            return None
        finer = [breaks[k] + (breaks[k + 1] - breaks[k]) * np.arange(n) / n for k, n in enumerate(parts)]
        return np.append(np.concatenate(finer), 1.0), steps

    def _optimum(self, solved: _Solved) -> Optimum:
        """The result, with the motion by its inputs; where that cannot be computed, what differs stays not a number."""
        problem, made, result = self.problem, solved.made, solved.found
        mesh, motion = made.mesh, made.motion(result.z)
        x, u = made.polynomials(motion)
        in_time = lambda poly: PPoly(poly.c / motion.T ** np.arange(len(poly.c) - 1, -1, -1.0)[:, None, None],
                                     problem.t0 + poly.x * motion.T)
        x, u = in_time(x), in_time(u)
        t = problem.t0 + mesh.nodes * motion.T
        metadata = problem.module.metadata
        sizes = dict(zip(metadata.x, made.found_sizes(result.z).x.tolist(), strict=True))
        optimum = Optimum(problem.module, t, motion.X, np.asarray(u(t)), motion.p,
                          {n: float(motion.p[k]) for n, k in zip(problem.free, problem.of.free, strict=True)},
                          self.undetermined, result.cost, solved.along, np.nan, motion.T,
                          sum(r.iterations for r in solved.records), solved.records, float(solved.errors.max()), solved.errors,
                          dict.fromkeys(metadata.x, np.nan), None,
                          made.multipliers(result.multipliers), *made.costates(result.multipliers, motion.T), self._kind(mesh),
                          result.solved, result.message, 0.0, problem.t0 + mesh.breaks * motion.T, sizes, x, u)
        simulated, difference, cost = None, optimum.difference, np.nan
        if np.isfinite(optimum.x).all():
            with contextlib.suppress(SymdynError), warnings.catch_warnings():
                warnings.simplefilter("ignore")
                simulated = optimum.simulate()
                if simulated.success:
                    gaps = np.abs(simulated.x - optimum.x).max(axis=0).tolist()
                    difference = dict(zip(difference, gaps, strict=True))
                    cost = made.cost_of(result.z, simulated)
        return replace(optimum, simulated=simulated, difference=difference, simulated_cost=cost,
                       seconds=clock.perf_counter() - self.begun)

    def _kind(self, mesh: Transcription) -> str:
        if mesh.kind == "radau":
            return f"Gauss-Radau of degree {mesh.degree}"
        return "Hermite-Simpson" if mesh.kind == "hermite-simpson" else "multiple shooting"

    def _failed(self, solved: _Solved, before: _Solved | None) -> NoOptimum:
        """Error to raise: what is violated, and by how much; with the optimum of the mesh before, if there is one."""
        owner, made, result = self.problem.module.name, solved.made, solved.found
        optimum = self._optimum(before or solved)
        n = sum(record.iterations for record in solved.records)
        head = f"{owner}: no optimal motion was found in {n} iterations ({result.message})"
        if before is not None:
            head += f" on a finer mesh of {made.mesh.n_intervals} intervals, that of {before.made.mesh.n_intervals} is kept"
        fallen = self._fallen(made, result)
        if fallen:
            return NoOptimum(f"{head}; {fallen}", optimum)
        if result.iterations >= self.chosen.max_iterations:
            return NoOptimum(f"{head}; {self._worst(made, result.z)}; allow more iterations, or begin with a better guess"
                             f"{self._radau_instead()}{self._kinked()}", optimum)
        head += self._kinked()
        try:
            begin = made.motion(result.z) if np.isfinite(result.z).all() else made.guess
            elastic = Discretized(self.problem, made.mesh, made.steps, begin, elastic=True, sizes=made.sizes)
            nearest = self._solve(elastic)
        except (SymdynError, RuntimeError):
            return NoOptimum(f"{head}; {self._worst(made, result.z)}", optimum)
        s = nearest.z[elastic.layout.n:].reshape(2, -1)
        missed = np.abs(s[0] - s[1])
        if not nearest.solved:
            return NoOptimum(f"{head}; {self._worst(made, result.z)}; begin with another guess{self._radau_instead()}", optimum)
        parts = missed / elastic.g_sizes[elastic.slacks]
        if parts.max(initial=0.0) <= MISSED:
            return NoOptimum(f"{head}; a motion that fulfils all conditions exists, so begin with another guess: "
                             f"{self._worst(made, result.z)}{self._radau_instead()}", optimum)
        texts = [f"{elastic.text(elastic.program, int(elastic.slacks[k]))} is missed by {missed[k]:.4g}"
                for k in np.argsort(-parts)[:4] if parts[k] > MISSED]
        return NoOptimum(f"{head}: the conditions cannot all be met within the bounds. The nearest motion violates some: "
                         f"{'; '.join(texts)}", optimum)

    def _fallen(self, made: Discretized, result: Found) -> str:
        """Message about a cost that goes to minus infinity; nothing where it does not."""
        begin = made.program.f(made.z)
        if result.cost > begin - FALLEN * (made.scaled.cost_size + abs(begin)) or np.isnan(result.cost):
            return ""
        problem, motion = self.problem, made.motion(result.z)
        inputs, states = problem.module.metadata.inputs, problem.module.metadata.x
        rows = [(n, motion.U[:, k], problem.inputs[:, k]) for k, n in enumerate(inputs)]
        rows += [(n, motion.p[[k]], bounds) for n, k, bounds in zip(problem.free, problem.of.free, problem.params.T, strict=True)]
        open_ones = [(n, values) for n, values, bounds in rows if not np.isfinite(bounds).all()]
        if not open_ones:
            open_ones = [(n, motion.X[:, k]) for k, n in enumerate(states) if not np.isfinite(problem.states[:, k]).all()]
        reached = ", ".join(f"{n} (up to {np.abs(values).max():.3g})" for n, values in open_ones)
        return (f"the cost goes to minus infinity: it is {result.cost:.3g} at the last point"
                + (f", and these have no bounds: {reached}; give them bounds, or a cost that grows with them" if reached else ""))

    def _kinked(self) -> str:
        """Message about a cost with kinks, at which solvers that go by derivatives hardly end."""
        kinks, inputs = self.problem.kinks, self.problem.module.metadata.inputs
        if not kinks:
            return ""
        split = next((n for n in inputs if f"Abs({n})" in kinks), None)
        instead = f"write {split} as the difference of two inputs with bounds (0, ...), whose sum is what it costs, or take " if (
            split) else "take "
        return (f"; the cost has kinks, by {', '.join(kinks)}, where solvers that go by derivatives hardly come to an end: "
                f"{instead}a smooth law, such as sqrt(x**2 + eps**2) in place of Abs(x)")

    def _worst(self, made: Discretized, z: np.ndarray) -> str:
        """The largest violation where the solver ended."""
        missing = made.violations(z)
        if np.isnan(missing).any():
            return "the last point cannot be evaluated"
        row = int(missing.argmax()) if len(missing) else 0
        if not len(missing) or missing[row] <= self.chosen.accuracy:
            return "all conditions are fulfilled there, and the cost is not at its minimum"
        return f"the largest violation left is {missing[row] * made.scaled.g_sizes[row]:.3g}, of {made.text(made.program, row)}"
