"""The least sum of squares within bounds: with noise that is estimated if it is not known, nearest to the guess where it is open.

Values that the data press against a bound are put onto it and held, and the others are iterated again. Noise that was not given
is estimated for each measured quantity from its own residuals, divided by their number less what they have determined of the
unknowns, and the fit is repeated with it until it stays: the fixed point of restricted maximum likelihood. The first of these
fits takes the noise for small, so that the estimate is that about what the data say by themselves; priors keep their deviations.
Combinations that data and priors leave open stay at the guess: at the nearest of all minima V (x - guess) = 0, with rows V that
span these combinations there.

Source: Nocedal and Wright, Numerical Optimization, 2nd ed., chapter 10 (Gauss-Newton in a trust region, which is what Levenberg
and Marquardt do); Branch, Coleman and Li (1999) for bounds, as in scipy.optimize.least_squares; MacKay, Neural Computation 4
(1992) 415-447 (noise and the number of well-determined parameters).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from scipy.optimize import least_squares

from symdyn.errors import ArgumentError
from symdyn.estimation.determined import Determined

if TYPE_CHECKING:
    from symdyn.estimation.problem import Problem

# Relative changes of the sum of squares and of the unknowns at which the iteration ends; the gradient's, with residuals that
# begin about 1, is less: where unknowns have little effect it is small anyway.
PRECISION, _FLAT = 1e-10, 1e-13
# Noise has settled where it changes by less than this part; most fits until then; what the first one takes it for, as a part of
# the residuals at the guess, where there are priors.
_SETTLED, _ROUNDS, _TRUSTED = 1e-6, 60, 1e-3
# Values are next to a bound within this part of their scale, and on it within the second.
_NEXT, _ON = 1e-3, 1e-9
# Largest rise of the sum of squares of residuals, in units of noise, on the way to the guess or to a bound, relative to itself or
# to the number of residuals.
_SAME = 1e-6
# Open combinations are at the guess within this part of the way; weights of the rows for it; most steps to there, and how much
# of the gradient a step takes.
_BACK, _WEIGHTS, _TURNS, _PARTS = 1e-6, (1.0, 1e-3), 12, (0.05, 5.0)
# Sizes of unknowns are those of their values, and at least this part of their scale.
_SIZE = 1e-3
# An unknown that went further than so many times the size of its guess, and is less sure than it went, has run off; one whose
# minimum is further than so many times its size away by its own derivatives has stopped short of it.
FAR = 100.0


@dataclass(frozen=True)
class Point:
    """Where an iteration ended.

    x, residuals (m,), derivatives (m, n); held: values on their bounds, (n,) of bool; ended: whether at a minimum; message: why
    """

    x: np.ndarray
    residuals: np.ndarray
    derivatives: np.ndarray
    held: np.ndarray
    ended: bool
    message: str

    @property
    def squares(self) -> float:
        """Sum of squares of the residuals."""
        return float(self.residuals @ self.residuals)


@dataclass(frozen=True)
class Pull:
    """More residuals, rows (k, n) times (x - anchor)/scale."""

    rows: np.ndarray
    anchor: np.ndarray


@dataclass(frozen=True)
class Minimum:
    """The solution of a problem.

    x            values, (n,); at_bounds: which of them are held by their bounds, (n,) of bool
    covariance   (n, n); NaN in rows and columns of what is not determined, or on its bound
    open_ones    combinations relative to the scale that are not determined, (k, n)
    noise        by what was measured, given or estimated; NaN where nothing is left over to estimate it from
    misfit       root of the sum of squares of the data's residuals, in units of the noise, by the degrees of freedom
    degrees      of freedom: values measured less what they have determined, rounded
    success, message   whether it is a minimum, and why the iteration ended
    """

    x: np.ndarray
    at_bounds: np.ndarray
    covariance: np.ndarray
    open_ones: np.ndarray
    noise: dict[str, float]
    misfit: float
    degrees: int
    success: bool
    message: str


def minimum(problem: Problem, max_steps: int) -> Minimum:
    """The minimum next to the guess, from which motions can be computed.

    Raises ArgumentError where noise cannot be estimated that is needed as a weight.
    """
    estimated, names = not problem.known, list(problem.noise)
    floor = _floor(problem)
    if estimated:
        _begin(problem, floor)
    point = _least(problem, problem.guess, max_steps)
    message = ""
    if estimated and (problem.priors or len(names) > 1):
        point, message = _with_noise(problem, point, floor, max_steps)
    elif estimated:
        # One weight for all: the values do not depend on it.
        noise, _ = _left_over(problem, point, floor)
        problem.noise = {name: value if np.isfinite(value) else 1.0 for name, value in noise.items()}
        point = _evaluated(problem, point)
    point = _nearest(problem, point, max_steps)
    return _judged(problem, point, floor, message)


def _judged(problem: Problem, point: Point, floor: dict[str, float], unsettled: str) -> Minimum:
    """The minimum from where the iterations ended, with what says that it is none."""
    known, free = _determined(problem, point), ~point.held
    noise, left = _left_over(problem, point, floor)
    unknown = not problem.known and not all(np.isfinite(value) for value in noise.values())
    n = len(point.x)
    covariance = np.full((n, n), np.nan)
    if not unknown:
        covariance[np.ix_(free, free)] = known.covariance
    open_ones = np.zeros((len(known.open_ones), n))
    open_ones[:, free] = known.open_ones
    degrees = sum(left.values())
    of_data = point.residuals[:len(point.residuals) - len(problem.priors)]
    misfit = float(np.sqrt(of_data @ of_data / degrees)) if degrees > 0.5 else np.nan
    success, message = point.ended and not unsettled, unsettled or point.message
    lost = _lost(problem, point, known, covariance)
    if lost:
        success, message = False, lost
    given = dict(problem.noise) if not unknown else dict.fromkeys(problem.noise, np.nan)
    return Minimum(point.x, point.held, covariance, open_ones, given, misfit, round(degrees), success, message)


def _lost(problem: Problem, point: Point, known: Determined, covariance: np.ndarray) -> str:
    """Why the iteration ended at no minimum, where the derivatives say that; "" if they do not."""
    deviations = np.sqrt(np.diag(covariance))
    way, sizes = np.abs(point.x - problem.guess), np.maximum(np.abs(point.x), problem.scale)
    step = np.zeros(len(point.x))
    step[~point.held] = known.step
    gone = (way > FAR * problem.scale) & (deviations > way)
    # The deviation of what is at its minimum may be large; the way to there is not.
    short = (np.abs(step) > FAR * sizes) & (deviations > FAR * sizes) & ~gone
    about = [(f"{u.label} from {u.guess:g}", d) for u, d, off in zip(problem.unknowns, deviations, gone, strict=True) if off]
    if about:
        return ("ran off to where the data say nothing: " + ", ".join(text for text, _ in about)
                + "; give bounds or priors, or another start")
    about = [(f"{u.label} = {x:g} +- {d:.2g}", d)
             for u, x, d, off in zip(problem.unknowns, point.x, deviations, short, strict=True) if off]
    if about:
        return ("ended where the data say nothing, which is no minimum: " + ", ".join(text for text, _ in about)
                + "; give another start, or priors")
    return ""


def _determined(problem: Problem, point: Point) -> Determined:
    """Determined combinations of the unknowns that are not held on bounds."""
    free, n_priors = ~point.held, len(problem.priors)
    sizes = np.maximum(np.abs(point.x), _SIZE * problem.scale)
    D, P = np.split(point.derivatives[:, free], [len(point.residuals) - n_priors])
    return Determined.of(D, P, point.residuals, sizes[free], problem.scale[free])


def _floor(problem: Problem) -> dict[str, float]:
    """The least noise that can be distinguished from errors of the runs, by what was measured."""
    result = {}
    for name, values in problem.measured.items():
        spread = float(np.std(values)) or float(np.max(np.abs(values))) or 1.0
        result[name] = problem.rtol * spread
    return result


def _begin(problem: Problem, floor: dict[str, float]) -> None:
    """Weights of the first fit, from the residuals at the guess: the same for everything in its unit."""
    residuals, rows = problem.residuals(problem.guess), problem.rows
    trusted = _TRUSTED if problem.priors else 1.0
    problem.noise = {name: max(trusted * float(np.sqrt(np.mean(residuals[rows[name]]**2))) * old, floor[name])
                     for name, old in problem.noise.items()}


def _left_over(problem: Problem, point: Point, floor: dict[str, float]) -> tuple[dict[str, float], dict[str, float]]:
    """Noise that residuals say, NaN where they are as many as what they have determined, and degrees of freedom, by name."""
    leverage, noise, degrees = _determined(problem, point).leverage, {}, {}
    for name, rows in problem.rows.items():
        degrees[name] = float(rows.sum() - leverage[rows].sum())
        squares = float(np.sum((point.residuals[rows] * problem.noise[name])**2))
        noise[name] = float(max(np.sqrt(squares / degrees[name]), floor[name])) if degrees[name] > 0.5 else np.nan
    return noise, degrees


def _with_noise(problem: Problem, point: Point, floor: dict[str, float], max_steps: int) -> tuple[Point, str]:
    """The fit with noise that it leaves over itself, and what to say if there is none; sets the noise of the problem."""
    for _ in range(_ROUNDS):
        noise, _ = _left_over(problem, point, floor)
        lacking = [name for name, value in noise.items() if not np.isfinite(value)]
        if lacking:
            raise ArgumentError(f"{problem.module.name}: the noise of {', '.join(lacking)} cannot be estimated, since its values "
                                "are no more than what they determine; pass noise")
        change = max(abs(np.log(noise[name] / problem.noise[name])) for name in noise)
        if change < _SETTLED:
            return point, ""
        problem.noise = noise
        if not point.ended:
            return _evaluated(problem, point), ""
        point = _least(problem, point.x, max_steps)
    return point, f"the noise did not settle in {_ROUNDS} fits; pass noise"


def _evaluated(problem: Problem, point: Point) -> Point:
    """The same point with the weights that the problem has now."""
    return replace(point, residuals=problem.residuals(point.x), derivatives=problem.jacobian(point.x))


def _nearest(problem: Problem, first: Point, max_steps: int) -> Point:
    """The minimum with the same sum of squares whose open combinations are at the guess; the first one where none is nearer.

    The way to the guess is walked along the minima: the gradient of its square is V^T V (x - guess), steps are those of Barzilai
    and Borwein, IMA J. Numer. Anal. 8 (1988) 141-148, and each is followed by an iteration that keeps V x.
    """
    if not first.ended or not len(_determined(problem, first).open_ones):
        return first
    most = first.squares + _SAME * max(first.squares, len(first.residuals))
    for weight in _WEIGHTS:
        point, best, part = first, first, 1.0
        way = (first.x - problem.guess) / problem.scale
        before: tuple[np.ndarray, np.ndarray] | None = None
        for _ in range(_TURNS):
            known = _determined(problem, point)
            rows = np.zeros((len(known.open_ones), len(way)))
            rows[:, ~point.held] = known.open_ones
            gradient = rows.T @ (rows @ way)
            if np.linalg.norm(gradient) <= _BACK * (1 + np.linalg.norm(way)):
                return point
            if before is not None:
                step, change = way - before[0], gradient - before[1]
                part = float(np.clip(step @ step / (step @ change), *_PARTS)) if step @ change > 0 else 1.0
            before = way, gradient
            anchor = problem.guess + (1 - part) * (point.x - problem.guess)
            point = _least(problem, point.x, max_steps, Pull(weight * (known.strength or 1.0) * rows, anchor))
            if not point.ended or point.squares > most or not np.array_equal(point.held, first.held):
                break
            way = (point.x - problem.guess) / problem.scale
            if np.linalg.norm(way) < np.linalg.norm((best.x - problem.guess) / problem.scale):
                best = point
        if best is not first:
            return best
    return first


def _least(problem: Problem, start: np.ndarray, max_steps: int, pull: Pull | None = None) -> Point:
    """The minimum from a start, with what is pulled to somewhere."""
    point, pressed = _iterated(problem, start, np.zeros(len(start), dtype=bool), max_steps, pull)
    while pressed.any():
        held = point.held | pressed
        towards = np.where(problem.most - point.x < point.x - problem.least, problem.most, problem.least)
        at = np.where(held, towards, point.x)
        most = point.squares + _SAME * max(point.squares, len(point.residuals))
        there = problem.residuals(at)
        if not np.isfinite(there).all():
            return replace(point, held=held)
        if held.all():
            nearer, pressed = replace(point, x=at, residuals=there, derivatives=problem.jacobian(at), held=held), ~held
        else:
            nearer, pressed = _iterated(problem, at, held, max_steps, pull)
        gradient = nearer.derivatives.T @ nearer.residuals
        inwards = np.where(at == problem.least, -gradient, gradient)
        if nearer.squares > most or (inwards[held] > 0).any():
            return replace(point, held=held)
        point = nearer
    return point


def _iterated(problem: Problem, start: np.ndarray, held: np.ndarray, max_steps: int,
              pull: Pull | None) -> tuple[Point, np.ndarray]:
    """One iteration with some values held, and which of the others it ends next to a bound that the sum of squares falls to."""
    free, scale = ~held, problem.scale
    rows, anchor = (np.zeros((0, len(start))), start) if pull is None else (pull.rows, pull.anchor)

    def whole(values: np.ndarray) -> np.ndarray:
        x = start.copy()
        x[free] = values
        return x

    def residuals(values: np.ndarray) -> np.ndarray:
        x = whole(values)
        return np.concatenate([problem.residuals(x), rows @ ((x - anchor) / scale)])

    def derivatives(values: np.ndarray) -> np.ndarray:
        return np.vstack([problem.jacobian(whole(values)), rows / scale])[:, free]

    least, most = problem.least[free], problem.most[free]
    with np.errstate(over="ignore", invalid="ignore"):  # far from the minimum squares may overflow: such a step is not taken
        result = least_squares(residuals, start[free], derivatives, (least, most), "trf", x_scale=scale[free],
                               max_nfev=max_steps, ftol=PRECISION, xtol=PRECISION, gtol=_FLAT)
    gradient, curvature = result.jac.T @ result.fun, np.sum(result.jac**2, axis=0)
    step = np.divide(-gradient, curvature, out=np.zeros(len(gradient)), where=curvature > 0)
    room = np.where(step > 0, most - result.x, result.x - least)
    pressed = np.zeros(len(start), dtype=bool)
    pressed[free] = ((room <= _NEXT * scale[free]) & (np.abs(step) > room)) | (
        np.minimum(most - result.x, result.x - least) <= _ON * scale[free])
    message = str(result.message) if result.status > 0 else (
        f"no minimum within {max_steps} steps; pass a nearer start, or a larger max_steps")
    x, n = whole(result.x), len(result.fun) - len(rows)
    all_derivatives = problem.jacobian(x) if held.any() else result.jac[:n]
    return Point(x, result.fun[:n], all_derivatives, held, result.status > 0, message), pressed
