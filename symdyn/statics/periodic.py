"""Periodic motions by shooting: a start that the motion comes back to, its period, its multipliers; followed over a parameter.

Newton's method on x(T; x0) - x0 with the sensitivities of the motion by its start, on constraints and across events. Where the
time does not appear in the equations the period is free, and a start moves along the motion no further than the guess.
Source: Seydel, Practical Bifurcation and Stability Analysis, 3rd ed., chapter 7.
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from symdyn.arguments import some, take
from symdyn.contact_kinds import CLUTCH
from symdyn.errors import ArgumentError, EvaluationError, NoEquilibrium, SimulationWarning
from symdyn.real_numbers import number_of, real_of
from symdyn.runtime.contact_laws import OPEN, STICKING
from symdyn.runtime.integrating.contacts import numbers, onto_rows, rows_of
from symdyn.runtime.integrating.simulate import start_of
from symdyn.runtime.integrating.stabilization import ProjectionFailed, Projector
from symdyn.runtime.masses import real_parameters
from symdyn.shown import name_of, shown

if TYPE_CHECKING:
    from symdyn.given import Key
    from symdyn.runtime.module import Module
    from symdyn.runtime.solutions.solution import Solution

# Newton's steps; the largest part by which one changes the period, how often one is halved.
ITERATIONS, LARGEST, HALVINGS = 50, 0.2, 8
# Difference after a period, relative to the size of the motion, in tolerances of its steps.
CLOSED = 1e3
# Singular values of Newton's matrix that do not count: where periodic motions of other energies are near, more of them.
LEFT_OUT = (1e-9, 1e-4)
# Until when, by the guess of the period, and at how many times the return of a motion is looked for.
LATEST, RETURNS = 1.5, 601
# A start that moves less in a period than this part of what the first one did, or than so many times what counts as closed, is
# at rest.
STILL, AT_REST = 1e-6, 1e2
# Directions that a start may change in: singular values of the projection beyond this part of the largest.
TANGENT = 1e-6
# The equations are compared with those a period later at so many times, of which none is a simple part of a period; how much, of
# the largest rate, they may differ.
SAMPLES, PERIODIC = 38, 1e-6
# Number of times at which a motion is kept whose right-hand side may jump.
TIMES_WITH_JUMPS = 201
# Beginning of warnings about initial values that nothing depends on, such as those of a prescribed coordinate: nothing is wrong.
IDLE = "nothing in this motion depends on"
# Largest change of the rest by a change of a cyclic coordinate, relative to its size.
CYCLIC = 1e-6


@dataclass(frozen=True, eq=False)
class PeriodicMotion:
    """A motion that comes back after its period.

    period       s; x: its start (n_x,); params: its parameters (n_p,)
    multipliers  of Floquet, complex, the largest first: factors of small disturbances over a period, along the constraints; where
                 the period is free one of them, that of a shift along the motion, is 1
    residual     what is left after a period, the largest entry; iterations: of Newton's method

    >>> module = sd.systems.pendulum().compile()
    >>> motion = module.periodic(2.0, [0.5], [0.0])
    >>> round(motion.period, 6), motion.x.tolist()
    (2.037868, [0.5, 0.0])
    """

    module: Module
    period: float
    x: np.ndarray
    params: np.ndarray
    multipliers: np.ndarray
    residual: float
    iterations: int
    free_period: bool
    _problem: _Problem = field(repr=False)

    @property
    def stable(self) -> bool:
        """Stability: whether all disturbances but a shift along the motion die out, beyond the error of the multipliers.

        Multipliers that fall together with that of the shift, as where motions of all amplitudes are periodic, are known to the
        square root of the error only; their product is known as well as a single one.

        >>> q = sd.coordinates("q")
        >>> system = sd.System("van_der_pol")
        >>> body = system.add_body("body", mass=1)
        >>> slide = system.add_joint(sd.Prismatic("slide", system.ground, body, axis=[1, 0], coordinate=q))
        >>> system.add_joint_force(slide, (1 - q**2) * q.dot - q)
        >>> system.embedding().compile().periodic(6.0, [2.0], [0.0]).stable
        True
        """
        sizes, error = np.abs(self.multipliers), CLOSED * self._problem.rtol
        if self.free_period:
            away = np.abs(self.multipliers - 1)
            together = away < np.sqrt(error)
            if together.sum() > 1 and sizes[together].prod() > 1 - error:
                return False
            sizes = np.delete(sizes, np.argmin(away))
        return bool((sizes < 1 - error).all())

    def simulate(self, n: int = 201) -> Solution:
        """The motion over a period, at n times. Raises ArgumentError for another number than a whole one from 2 on.

        >>> motion = sd.systems.pendulum().compile().periodic(2.0, [0.5], [0.0]).simulate(5)
        >>> np.round(motion["q1"], 6) + 0.0
        array([ 0.5,  0. , -0.5,  0. ,  0.5])
        """
        if isinstance(n, bool) or not isinstance(n, (int, np.integer)) or n < 2:
            raise ArgumentError(f"{self.module.name}: a period was asked for at {shown(n)} times; pass a whole number from 2 on")
        return self._problem.solution(self.x, self.period, n)

    def follow(self, name: Key, values: Sequence[float]) -> list[PeriodicMotion]:
        """The periodic motions at other values of a parameter, one after the other, each sought from the one before along its
        derivative by the parameter.

        Raises ArgumentError for an unknown parameter, NoEquilibrium where the way ends, with the value; the motions until then
        are its `found`.

        >>> q, c = sd.coordinates("q"), sd.parameters("c")
        >>> system = sd.System("van_der_pol")
        >>> body = system.add_body("body", mass=1)
        >>> slide = system.add_joint(sd.Prismatic("slide", system.ground, body, q, axis=[1, 0]))
        >>> system.add_joint_force(slide, c * (1 - q**2) * q.dot - q)
        >>> motion = system.compile().periodic(6.0, [2.0], [0.0], params={c: 1.0})
        >>> [round(found.period, 4) for found in motion.follow(c, [0.5, 0.1])]
        [6.3807, 6.2871]
        """
        parameters = list(self.module.metadata.parameters)
        asked = name_of(name)
        if asked not in parameters:
            raise ArgumentError(f"{self.module.name}: a periodic motion was to be followed over {shown(asked)}, which is no "
                                f"parameter; there are {', '.join(parameters)}")
        point = parameters.index(asked)
        result: list[PeriodicMotion] = []
        motion = self
        for value in real_of(values, self.module.name, "the values of the parameter must be numbers").ravel():
            problem = motion._problem
            p = motion.params.copy()
            p[point] = value
            try:
                change = problem.derivative(motion.x, motion.period, asked) * (value - motion.params[point])
                motion = replace(problem, p=p).solve(motion.x + change[:-1], motion.period + change[-1])
            except (NoEquilibrium, EvaluationError, ProjectionFailed, ArgumentError) as error:
                so_far = f"; the {len(result)} motions before it are the error's found" if result else ""
                raise NoEquilibrium(f"{error}; at {asked} = {value:g}, followed from {asked} = {motion.params[point]:g}{so_far}",
                                    result) from None
            result.append(motion)
        return result

    def branch(self, name: Key, least: float, most: float, step: float = 0.1, n: int = 200) -> list[PeriodicMotion]:
        """The periodic motions on the branch of this one over a parameter, past folds, where the parameter turns back.

        least, most   of the parameter: where it leaves them the branch ends
        step          along the branch, relative to the sizes of the state, the period and the parameter; the longest one, halved
                      where the branch is bent; negative: it begins with smaller values of the parameter
        n             motions at most
        Raises ArgumentError for what does not fit, NoEquilibrium where the branch is lost, with the value.

        >>> q, c = sd.coordinates("q"), sd.parameters("c")
        >>> system = sd.System("van_der_pol")
        >>> body = system.add_body("body", mass=1)
        >>> slide = system.add_joint(sd.Prismatic("slide", system.ground, body, q, axis=[1, 0]))
        >>> system.add_joint_force(slide, c * (1 - q**2) * q.dot - q)
        >>> motion = system.compile().periodic(6.0, [2.0], [0.0], params={c: 1.0})
        >>> found = motion.branch(c, 0.5, 5.0, n=3)
        >>> [bool(a.period < b.period) for a, b in zip(found, found[1:])]
        [True, True]
        """
        from symdyn.statics.branches import branch

        return branch(self, name, least, most, step, n)

    def __repr__(self) -> str:
        sizes = ", ".join(f"{abs(m):.4g}" for m in self.multipliers[:4])
        return (f"<PeriodicMotion of {self.module.name}: period {self.period:.9g} s, multipliers of size {sizes}"
                f"{', ...' if len(self.multipliers) > 4 else ''}>")


# The loosest tolerance of the motions.
LOOSEST = 1e-4


def periodic(module: Module, period: Any, q: Any = None, u: Any = None, params: Any = None, *, z: Any = None, t: float = 0.0,
             inputs: Any = None, advance: Any = None, cyclic: Any = None, exchange: Any = None, rtol: float = 1e-10,
             method: str = "dop853") -> PeriodicMotion:
    """See Module.periodic."""
    metadata = module.metadata
    guess = number_of(period, module.name, "the period must be a number of seconds")
    if not (np.isfinite(guess) and guess > 0):
        raise ArgumentError(f"{module.name}: the period must be a positive number of seconds, found {shown(period)}; where the "
                            "time does not appear in the equations it is a guess")
    p = real_parameters(module, params)
    if not number_of(rtol, module.name, "rtol must be a number") <= LOOSEST:
        raise ArgumentError(f"{module.name}: rtol = {shown(rtol)} is too loose for a periodic motion: whether it comes back, and "
                            f"its multipliers, are as exact as the motion; pass {LOOSEST:g} or less")
    turns = some(advance, list(metadata.x), "advance", module.name)
    begin = number_of(t, module.name, "t must be a finite time")
    arguments = module.library("rhs").metadata.arguments
    free = not any("t" in arguments.get(name, ()) for name in ("rhs", "events", "event_resets", "contacts"))
    moves = np.array([turns.get(name, 0.0) for name in metadata.x])
    left_out = _names(module, cyclic, "cyclic")
    keeps = np.array([float(name not in left_out) for name in metadata.x])
    back = keeps[:, None] * np.eye(len(keeps))[_exchanged(module, exchange)]
    problem, start = _Problem(module, p, begin, inputs, moves, rtol, method, free, keeps, back), start_of(module, q, u, z)
    if metadata.contacts:
        problem = replace(problem, modes=problem.solution(start, guess, 2)._phases[0].modes)
    return problem.solve(start, guess)


def _names(module: Module, given: Any, what: str) -> list[str]:
    """Entries of the state by symbols or names. Raises ArgumentError for others."""
    if given is None:
        return []
    if isinstance(given, (str, bytes)) or not hasattr(given, "__iter__"):
        raise ArgumentError(f"{module.name}: {what} is {shown(given)}; pass a list of names, such as ['{module.metadata.x[0]}']")
    result = [name_of(one) for one in given]
    strange = [shown(name) for name in result if name not in module.metadata.x]
    if strange:
        raise ArgumentError(f"{module.name}: {what} names {', '.join(strange)}; there are {', '.join(module.metadata.x)}")
    return result


def _exchanged(module: Module, given: Any) -> list[int]:
    """The order of the state with pairs of coordinates exchanged, and with them their speeds."""
    names = list(module.metadata.x)
    order = list(range(len(names)))
    if given is not None and not isinstance(given, (list, tuple)):
        raise ArgumentError(f"{module.name}: exchange is {shown(given)}; pass a list of pairs, such as [('left', 'right')]")
    for pair in given or ():
        two = _names(module, pair, "a pair to exchange")
        if len(two) != 2 or two[0] == two[1]:
            raise ArgumentError(f"{module.name}: a pair to exchange is {shown(pair)}; pass two coordinates, such as ('left', "
                                "'right')")
        for a, b in ((two[0], two[1]), (f"{two[0]}_dot", f"{two[1]}_dot")):
            if a in names and b in names:
                i, j = names.index(a), names.index(b)
                order[i], order[j] = order[j], order[i]
    return order


@dataclass(frozen=True)
class _Problem:
    module: Module
    p: np.ndarray
    t: float
    inputs: Any
    moves: np.ndarray
    rtol: float
    method: str
    free: bool
    keeps: np.ndarray  # of the entries of the state 1 where they come back, 0 where they gain what they gain, (n_x,)
    back: np.ndarray  # (n_x, n_x): from the end of a period to the start of the next one
    modes: tuple[str, ...] = ()  # of rigid contacts at the start

    def solve(self, x: np.ndarray, period: float) -> PeriodicMotion:
        """The periodic motion near a start and a period.

        A state of rest comes back after any time, and where motions of all amplitudes are periodic Newton's method may end in one
        or go from one to the next; then the period of the motion from this start is sought.
        """
        try:
            return self.near(x, period)
        except NoEquilibrium:
            with suppress(EvaluationError, ProjectionFailed):
                self.check_drive(self.start(x), period)
            raise

    def near(self, x: np.ndarray, period: float) -> PeriodicMotion:
        """The same where the equations are periodic."""
        why = at_rest = None
        for fixed in (False, True) if self.free else (False,):
            try:
                result = self.nearest(x, self.returns(self.start(x), period) if fixed else period, fixed)
            except (NoEquilibrium, EvaluationError) as error:
                why = why or error
            else:
                if not self.rests(result, self.way(self.start(x), period)):
                    return result
                at_rest = at_rest or result
        if at_rest is None:
            assert why is not None
            raise why
        where = ", ".join(f"{name} = {value:.6g}" for name, value in zip(self.module.metadata.x, at_rest.x, strict=True))
        raise NoEquilibrium(f"{self.module.name}: near the start is a state of rest, which comes back after any time ({where}), "
                            f"and no motion with a period of about {period:.6g} s was found; begin further from it, with a state "
                            "that a simulation has settled to")

    def returns(self, x: np.ndarray, period: float) -> float:
        """When, within half to one and a half of a guess, the motion from a start comes nearest to it, each entry of the state by
        its range."""
        run = self.solution(x, LATEST * period, RETURNS)
        gaps = (run.x @ self.back.T - self.keeps * x - self.moves)[:, self.keeps > 0]
        sizes = np.ptp(run.x[:, self.keeps > 0], axis=0)
        far = np.linalg.norm(gaps[:, sizes > 0] / sizes[sizes > 0], axis=1)
        return float(run.t[int(np.where(run.t - self.t < period / 2, np.inf, far).argmin())] - self.t)

    def rests(self, motion: PeriodicMotion, first: float) -> bool:
        """Whether the period is free and nothing moves; first: the way of the first start in a period."""
        return self.free and self.way(motion.x, motion.period) <= max(STILL * first, AT_REST * self.enough(motion.x, motion.x))

    def way(self, x: np.ndarray, period: float) -> float:
        """Change of a start in a period at its rate, the largest entry."""
        modes = self.solution(x, period, 2)._phases
        return float(np.abs(self.keeps * self.rate(self.t, x, modes[0].p if modes else self.p)).max() * period)

    def nearest(self, x: np.ndarray, period: float, fixed: bool) -> PeriodicMotion:
        """Periodic motion near a start and a period, by Newton's method; fixed: the start stays, its period is sought."""
        x = self.start(x)
        here = self.shot(x, period)
        scale, enough = _size(x, here.end), self.enough(x, here.end)
        for iteration in range(ITERATIONS):
            if np.abs(here.gap).max() <= enough:
                return self.found(here, iteration)
            better = (self.nearer(here, self.solved(here, -here.gap, left_out, fixed), scale) for left_out in LEFT_OUT)
            there = next((one for one in better if one is not None), None)
            if there is None:
                break
            here = there
        worst = int(np.abs(here.gap).argmax())
        raise NoEquilibrium(f"{self.module.name}: no periodic motion found near the start with the period {period:.6g} s: after "
                            f"{here.period:.6g} s {self.module.metadata.x[worst]} is off by {here.gap[worst]:.3g}; begin nearer "
                            "to it, with a state that a simulation has settled to")

    def start(self, x: np.ndarray) -> np.ndarray:
        """The start nearby on the constraints and on the surfaces of contacts that are closed."""
        x, records = Projector(self.module, self.p)(self.t, x), self.module.metadata.contacts
        closed = [(k, rows) for k, (rows, mode) in enumerate(zip(rows_of(records), self.modes, strict=False)) if mode != OPEN]
        if not closed:
            return x
        gaps = {k: rows[0] for k, rows in closed if records[k].normal and records[k].kind != CLUTCH}
        held = [row for k, rows in closed
                for row in (rows if self.modes[k] == STICKING else rows[:records[k].normal])]
        given = () if self.inputs is None else self.inputs
        inputs = take(given, self.module.metadata.inputs, "inputs", self.module.metadata.initial, self.module.name)
        for _ in range(3):
            x = onto_rows(lambda state: numbers(self.module, self.t, state, self.p, inputs), x, gaps, held)
        return Projector(self.module, self.p)(self.t, x)

    def enough(self, x: np.ndarray, end: np.ndarray) -> float:
        """The gap of a motion that counts as closed."""
        return CLOSED * self.rtol * _size(x, end)

    def atol(self, x: np.ndarray) -> float | None:
        """Tolerated error of small motions, by their size; None: that of others."""
        size = _size(x, x)
        return self.rtol * size if 0 < size < 1 else None

    def nearer(self, here: _Shot, step: np.ndarray, scale: float) -> _Shot | None:
        """A motion with a smaller gap on the way of a step, None if there is none."""
        part = min(1.0, LARGEST * here.period / max(abs(step[-1]), 1e-300))
        part = min(part, 0.5 * max(scale, 1.0) / max(np.abs(step[:-1]).max(), 1e-300))
        for _ in range(HALVINGS):
            try:
                x = self.start(here.x + part * step[:-1])
                there = self.shot(x, here.period + part * step[-1])
            except (EvaluationError, ProjectionFailed):
                there = None
            if there is not None and np.linalg.norm(there.gap) < (1 - 0.1 * part) * np.linalg.norm(here.gap):
                return there
            part *= 0.5
        return None

    def shot(self, x: np.ndarray, period: float) -> _Shot:
        """Where a start is after a period, with what it depends on. Raises EvaluationError where the motion stops early."""
        rows = TIMES_WITH_JUMPS if self.module.metadata.switches else 2  # jumps are seen from row to row
        run, doubts = self.with_warnings(x, period, rows, [f"{name}(0)" for name in self.module.metadata.x])
        S = run.sensitivity.matrix
        self.check_cyclic(S[-1])
        left, sizes, _ = np.linalg.svd(self.keeps[:, None] * S[0])
        basis = left[:, sizes > TANGENT * sizes[0]]
        before, after = (run._phases[0].p, run._phases[-1].p) if run._phases else (self.p, self.p)
        return _Shot(x, period, run.x[-1], self.back @ S[-1] @ basis, basis, self.back @ run.x[-1] - self.keeps * x - self.moves,
                     self.keeps * self.rate(self.t, x, before), self.back @ self.rate(self.t + period, run.x[-1], after), doubts)

    def check_drive(self, x: np.ndarray, period: float) -> None:
        """Raise ArgumentError where the equations at the states of the motion from a start are others after the period."""
        if self.free:
            return
        run = self.solution(x, period, SAMPLES)
        times, states = run.t[1:-1], run.x[1:-1]
        inputs = () if self.inputs is None else self.inputs
        events = self.module.metadata.events
        for what, there in (("rhs", True), ("events", bool(events)), ("event_resets", any(event.reset for event in events))):
            if not there:
                continue
            now, then = (np.asarray(self.module.evaluate(what, t, states, self.p, inputs)).reshape(len(times), -1)
                         for t in (times, times + period))
            away, sizes = np.abs(then - now), np.maximum(np.abs(now), np.abs(then)).max(axis=0)
            row, entry = np.unravel_index(int((away / np.maximum(sizes, 1e-300)).argmax()), away.shape)
            if away[row, entry] > PERIODIC * sizes[entry]:
                name = f"the rate of {self.module.metadata.x[entry]}" if what == "rhs" else f"an event ({what}, {entry + 1})"
                raise ArgumentError(f"{self.module.name}: the equations are not periodic with {period:.9g} s: in the same state "
                                    f"{name} is {now[row, entry]:.6g} at t = {times[row]:.6g} s and {then[row, entry]:.6g} "
                                    "after that time; the period must be that of what drives the motion, or a multiple of it")

    def check_cyclic(self, S: np.ndarray) -> None:
        """Raise ArgumentError for coordinates that were said to be cyclic and are not; S: derivatives of the end."""
        for k in np.flatnonzero(self.keeps == 0):
            moved = np.abs(S[:, k] - np.eye(len(S))[k]).max()
            if moved > CYCLIC:
                name = self.module.metadata.x[k]
                raise ArgumentError(f"{self.module.name}: {name} was given as cyclic, but the motion depends on it: a change of "
                                    f"its start changes the end by {moved:.3g} times as much more; leave it out of cyclic")

    def rate(self, t: float, x: np.ndarray, p: np.ndarray) -> np.ndarray:
        inputs = () if self.inputs is None else self.inputs
        return self.module.evaluate("rhs", t, x, p, inputs)

    def solved(self, at: _Shot, right: np.ndarray, left_out: float = 1e-9, fixed: bool = False) -> np.ndarray:
        """Changes of the start and of the period by which what is left after a period changes as given, the smallest ones;
        singular values below this part of the largest are left out; fixed: the start stays."""
        n = 0 if fixed else at.basis.shape[1]
        basis, moved = at.basis[:, :n], at.moved[:, :n]
        columns = [moved - basis]
        small = min(1.0, _size(at.x, at.end) or 1.0)  # the size of a small motion, in which its changes are measured
        right = right / small
        if self.free:  # and the start does not slide along the motion
            along = basis.T @ at.rate
            columns.append(at.late[:, None] / small)
            size = max(float(np.linalg.norm(along)), 1e-300)
            matrix = np.vstack([np.hstack(columns), np.append(along / size, 0.0)])
            right = np.append(right, 0.0)
        else:
            matrix = columns[0]
        result = np.linalg.lstsq(matrix, right, rcond=left_out)[0]
        return np.append(small * (basis @ result[:n]), result[n] if self.free else 0.0)

    def derivative(self, x: np.ndarray, period: float, name: str) -> np.ndarray:
        """Derivatives of the start and of the period by a parameter, (n_x + 1,)."""
        by = self.solution(x, period, 2, [name]).sensitivity[name]
        result = self.solved(self.shot(x, period), self.keeps * by[0] - self.back @ by[-1])
        return result + np.append(by[0], 0.0)

    def found(self, at: _Shot, iterations: int) -> PeriodicMotion:
        self.check_drive(at.x, at.period)
        for doubt in at.doubts:
            warnings.warn(doubt, SimulationWarning, stacklevel=2)
        multipliers = np.linalg.eigvals(at.basis.T @ at.moved)
        multipliers = multipliers[np.argsort(-np.abs(multipliers))]
        left = float(np.abs(at.gap).max())
        return PeriodicMotion(self.module, float(at.period), at.x, self.p, multipliers, left, iterations, self.free, self)

    def solution(self, x: np.ndarray, period: float, n: int, by: Sequence[str] | None = None) -> Solution:
        """A motion over a period. Raises EvaluationError where it stops early."""
        return self.with_warnings(x, period, n, by)[0]

    def with_warnings(self, x: np.ndarray, period: float, n: int,
                      by: Sequence[str] | None = None) -> tuple[Solution, tuple[str, ...]]:
        """The same with its warnings."""
        sizes = self.module.metadata.sizes
        times = np.linspace(self.t, self.t + period, n)
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always", SimulationWarning)
            run = self.module.simulate(times, x[:sizes.q], x[sizes.q:sizes.q + sizes.u], self.p, z=x[sizes.q + sizes.u:],
                                       inputs=self.inputs, rtol=self.rtol, atol=self.atol(x), method=self.method,
                                       sensitivities=by)
        if not run.success or run.t[-1] != times[-1]:
            raise EvaluationError(f"{self.module.name}: the motion does not last for a period: {run.message}")
        for other in caught:
            if not issubclass(other.category, SimulationWarning):
                warnings.warn(other.message, stacklevel=3)
        doubts = [str(one.message) for one in caught if issubclass(one.category, SimulationWarning)]
        return run, tuple(text for text in doubts if IDLE not in text)


def _size(x: np.ndarray, end: np.ndarray) -> float:
    return max(float(np.abs(x).max()), float(np.abs(end).max()))


@dataclass(frozen=True)
class _Shot:
    """A motion from x over a time: its end, what that is moved by the directions of `basis`, the gap, the rates at both ends,
    what was warned of."""

    x: np.ndarray
    period: float
    end: np.ndarray
    moved: np.ndarray
    basis: np.ndarray
    gap: np.ndarray
    rate: np.ndarray
    late: np.ndarray
    doubts: tuple[str, ...]


