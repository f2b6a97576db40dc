"""Motions that inputs follow: value, rate and acceleration over time, from functions, splines and tables."""

from __future__ import annotations

import inspect
from collections.abc import Callable
from copy import deepcopy
from dataclasses import dataclass
from typing import Any

import numpy as np

from symdyn.backend.metadata import ModuleMetadata
from symdyn.errors import ArgumentError
from symdyn.real_numbers import NotReal, real
from symdyn.runtime.inputs.tables import ORDER, ROUNDING, Pieces, Table
from symdyn.runtime.raised import InputRaised, called
from symdyn.shown import shown

# At so many instants within a run differences of the values are compared with the rates, and so on.
INSTANTS = 60
# Steps of the differences, parts of the run, and by how much they may be off, relative to the motion's own size in the run.
STEPS = (1e-4, 1e-6, 1e-8, 1e-10)
MISMATCH = 1e-3
# Number of intervals between the instants, those that fit worst, that are halved in search of a jump, number of halvings; a jump
# is one if it is more than this part of the motion's size.
SEARCHED, HALVINGS, JUMPED = 8, 40, 1e-6
# A spline whose value or rate jumps by more than this part of its size at a break has no acceleration there.
JUMP = 1e-9
NO_STATE = np.zeros(0)
PARTS = ("value", "rate", "acceleration")
# Endings of the names of a motion's rate and acceleration.
RATES = ("_dot", "_ddot")


def motion_inputs(metadata: ModuleMetadata) -> tuple[str, ...]:
    """Names of the inputs that belong to motions: values, rates and accelerations."""
    return tuple(f"{name}{end}" for name in metadata.motions for end in ("", *RATES))


@dataclass(frozen=True)
class Followed:
    """A motion that an input follows.

    name, index   of its value among the inputs; rate and acceleration come after it
    pieces        as a piecewise polynomial of the three, where it is one of order three at most; else None
    function      of t, which returns the three
    breaks        times at which steps have to end
    smooth        whether a function is declared to be smooth
    """

    name: str
    index: int
    pieces: Pieces | None = None
    function: Callable[[float], Any] | None = None
    breaks: tuple[float, ...] = ()
    smooth: bool = False

    @property
    def indices(self) -> list[int]:
        """Indices of value, rate and acceleration."""
        return [self.index, self.index + 1, self.index + 2]

    def at(self, t: float, x: np.ndarray = NO_STATE) -> np.ndarray:
        """Value, rate and acceleration, (3,); x: the state there, for messages.

        Raises InputRaised from what the function raises and for what is not finite, ArgumentError for what it must not return.
        """
        if self.function is None:
            assert self.pieces is not None
            return self.pieces.at(t)
        function = self.function
        given = called(function, t, x, f"the motion {self.name}", (t,))
        try:
            values, why = real(given).reshape(-1), ""
        except NotReal as error:
            values, why = np.zeros(0), f": {error}"
        if len(values) != 3:
            raise ArgumentError(f"the motion {self.name} returned {shown(given)} at t = {t:.6g}; needed are three numbers: "
                                f"value, rate and acceleration{why}")
        if not np.isfinite(values).all():
            bad = ", ".join(f"{what} {value:g}" for what, value in zip(PARTS, values, strict=True) if not np.isfinite(value))
            raise InputRaised(f"the motion {self.name} has the {bad} at t = {t:.6g}", t, x)
        return values


@dataclass(frozen=True)
class Motions:
    """All inputs over time where those that are no motions are constant, (n_in,)."""

    constant: np.ndarray
    followed: tuple[Followed, ...]

    def at(self, t: Any) -> np.ndarray:
        """Inputs at a time, (n_in,), or at times (n,), (n, n_in)."""
        if np.ndim(t):
            return np.array([self.at(one) for one in np.asarray(t, dtype=float)]).reshape(np.shape(t)[0], len(self.constant))
        values = self.constant.copy()
        for motion in self.followed:
            values[motion.indices] = motion.at(float(t))
        return values


def take_motion(given: Any, name: str, index: int, owner: str, span: tuple[float, float] | None, smooth: bool) -> Followed:
    """A motion as the user gave it: a function of t that returns value, rate and acceleration, a spline of SciPy, or a table,
    which becomes a cubic spline.

    span     of the run, which splines and tables must cover; None: not asked
    smooth   whether a function was declared to be so
    Raises ArgumentError for what fits none of these, for splines whose rate jumps, and for functions whose rate or acceleration
    is not the derivative of their value.
    """
    where = f"{owner}: inputs: the motion {name}"
    spline = _spline(given, where)
    if spline is not None:
        return _of_spline(spline, name, index, where, span)
    if hasattr(given, "derivative"):  # a spline of another kind, such as scipy.interpolate.UnivariateSpline
        knots = given.get_knots() if hasattr(given, "get_knots") else ()
        return Followed(name, index, None, _with_derivatives(deepcopy(given)), tuple(map(float, knots)))
    if not callable(given):
        raise ArgumentError(f"{where} is {shown(given)}; pass a function of t that returns value, rate and acceleration, a "
                            "spline of SciPy, a table (times, values), or a number to hold it")
    if not _takes_time_alone(given):
        raise ArgumentError(f"{where} is a function of more than t; a motion depends on the time alone: pass a function of t "
                            "that returns value, rate and acceleration")
    motion = Followed(name, index, None, given, (), smooth)
    if span is not None:
        _demand_motion(motion, where, span)
    return motion


def _spline(given: Any, where: str) -> Any:
    """The piecewise polynomial of SciPy of a spline or a table; None of anything else."""
    if isinstance(given, (tuple, Table)):
        table = given if isinstance(given, Table) else Table(given[0], given[1])
        times, values = table.times, table.values
        if values.ndim != 1 or len(times) < 2:
            raise ArgumentError(f"{where} has a table with times of shape {times.shape} and values of shape {values.shape}; give "
                                "one value for each of two or more times")
        from scipy.interpolate import CubicSpline

        return CubicSpline(times, values, extrapolate=False)
    if not type(given).__module__.startswith("scipy.interpolate"):
        return None
    from scipy.interpolate import BSpline, PPoly

    return PPoly.from_spline(given) if isinstance(given, BSpline) else given if isinstance(given, PPoly) else None


def spline_pieces(given: Any, where: str, span: tuple[float, float] | None) -> Pieces | None:
    """The pieces of one input that is a spline of SciPy, jumps included; None of what is none.

    span   of the run, which it must cover; None: not requested
    Raises ArgumentError for splines that are periodic or of an order above three, and for what is no piecewise polynomial.
    """
    if isinstance(given, (tuple, Table)) or not type(given).__module__.startswith("scipy.interpolate"):
        return None
    spline = _spline(given, where)
    remedy = "pass the function lambda t, x: float(spline(t))"
    if spline is None:
        raise ArgumentError(f"{where} is {shown(given)}, which is no piecewise polynomial; {remedy}")
    breaks, c = _sound(spline, where, span)
    if len(c) > ORDER or spline.extrapolate == "periodic":
        kind = "periodic spline" if spline.extrapolate == "periodic" else f"spline of order {len(c) - 1}"
        raise ArgumentError(f"{where} is a {kind}; pass one of order three at most that covers the run, or {remedy}")
    return Pieces(breaks, _powers(c).T[:, None, :])


def _sound(spline: Any, where: str, span: tuple[float, float] | None) -> tuple[np.ndarray, np.ndarray]:
    """Breaks (n + 1,) and coefficients (order, n) of a spline, the highest power first.

    Raises ArgumentError for one of several values, or complex, and for one that does not cover the run.
    """
    breaks = np.asarray(spline.x, dtype=float)
    kept = np.append(np.flatnonzero(np.diff(breaks) > 0), len(breaks) - 1)  # a spline in B-form repeats its end knots
    breaks, c = breaks[kept], np.asarray(spline.c)[:, kept[:-1]]
    if c.ndim != 2 or not np.isrealobj(c) or not np.isfinite(c).all():
        raise ArgumentError(f"{where} is a spline with coefficients of shape {c.shape}; pass one of a single real, finite value")
    if span is not None and spline.extrapolate != "periodic":
        slack = ROUNDING * max(abs(breaks[0]), abs(breaks[-1]), *map(abs, span))
        if not breaks[0] - slack <= min(span) or not max(span) <= breaks[-1] + slack:
            raise ArgumentError(f"{where} holds from t = {breaks[0]:.9g} s to {breaks[-1]:.9g} s, and the run goes from "
                                f"{min(span):.9g} s to {max(span):.9g} s; pass one of the whole run (its ends are not held)")
    return breaks, c


def _powers(c: np.ndarray) -> np.ndarray:
    """Coefficients (4, n) of 1, d, d^2 and d^3, from those (order, n) with the highest power first."""
    powers = np.zeros((ORDER, c.shape[1]))
    powers[:len(c)] = c[::-1]
    return powers


def _of_spline(spline: Any, name: str, index: int, where: str, span: tuple[float, float] | None) -> Followed:
    breaks, c = _sound(spline, where, span)
    _demand_continuous(breaks, c, where)
    if len(c) > ORDER or spline.extrapolate == "periodic":
        return Followed(name, index, None, _with_derivatives(deepcopy(spline)),
                        _repeated(breaks, span) if spline.extrapolate == "periodic" else tuple(breaks.tolist()))
    c0, c1, c2, c3 = _powers(c)
    none = np.zeros_like(c0)
    rows = [np.stack(r, axis=-1) for r in ((c0, c1, c2, c3), (c1, 2 * c2, 3 * c3, none), (2 * c2, 6 * c3, none, none))]
    pieces = Pieces(breaks, np.stack(rows, axis=1))
    return Followed(name, index, pieces, None, tuple(breaks.tolist()))


def _with_derivatives(spline: Any) -> Callable[[float], Any]:
    """The function of t that returns value, rate and acceleration of a spline."""
    rate, acceleration = spline.derivative(1), spline.derivative(2)
    return lambda t: (spline(t), rate(t), acceleration(t))


def _repeated(breaks: np.ndarray, span: tuple[float, float] | None) -> tuple[float, ...]:
    """The breaks of a periodic spline within a run."""
    begin, end = (min(span), max(span)) if span is not None else (breaks[0], breaks[-1])
    period = breaks[-1] - breaks[0]
    turns = np.arange(np.floor((begin - breaks[0]) / period), np.ceil((end - breaks[0]) / period))
    return tuple(np.unique((breaks[None, :-1] + turns[:, None] * period).ravel()).tolist())


def _demand_continuous(breaks: np.ndarray, c: np.ndarray, where: str) -> None:
    """Raises ArgumentError where the value or the rate of a spline with coefficients c (order, pieces) jumps."""
    h = np.diff(breaks)
    for what, derived in (("value", c), ("rate", c[:-1] * np.arange(len(c) - 1, 0, -1)[:, None])):
        if not len(derived):
            continue
        ends = np.zeros_like(h)
        for row in derived:
            ends = ends * h + row
        begins = derived[-1]
        size = max(np.abs(ends).max(), np.abs(begins).max())
        jumps = np.flatnonzero(np.abs(ends[:-1] - begins[1:]) > JUMP * size)
        if len(jumps):
            k = int(jumps[0])
            jump = begins[k + 1] - ends[k]
            raise ArgumentError(f"{where} has a {what} that jumps by {jump:.6g} at t = {breaks[k + 1]:g} s, which takes an "
                                "infinite force; pass a spline with a continuous rate, or a table, which becomes one")


def _takes_time_alone(function: Callable[..., Any]) -> bool:
    """Whether a function can be called with one argument; where its signature is not known it is called and seen."""
    try:
        inspect.signature(function).bind(0.0)
    except TypeError:
        return False
    except ValueError:
        return True
    return True


def _demand_motion(motion: Followed, where: str, span: tuple[float, float]) -> None:
    """Raises ArgumentError where the second of the three is not the rate of the first, or the third not that of the second, and
    where the value or the rate jumps, as far as instants within a run show it. Errors that the function raises are left to the
    run."""
    begin, length = min(span), abs(span[1] - span[0])
    # Evenly spread, though off the round times at which motions are composed of pieces.
    instants = begin + length * (np.arange(INSTANTS) + 0.5 * np.sqrt(np.arange(INSTANTS) % 7 / 7 + 0.1)) / INSTANTS
    try:
        rows = np.array([motion.at(float(t)) for t in instants])
        _demand_derivatives(motion, where, instants, rows, length)
        _demand_no_jump(motion, where, instants, rows)
    except InputRaised:
        return


def _demand_derivatives(motion: Followed, where: str, instants: np.ndarray, rows: np.ndarray, length: float) -> None:
    """Differences to either side, one of which may go over a kink, compared with what the function (n, 3) returns."""
    size = np.abs(rows[:, 1:]).max(axis=0)
    misses = np.full((len(instants), 2), np.inf)
    rates = np.zeros((len(instants), 2))
    for h in (sign * step * length for step in STEPS for sign in (1, -1)):
        away = np.array([motion.at(float(t + h)) for t in instants])
        # A step of Euler, half of it with the next derivative, which the rates know of themselves.
        result = (away - rows)[:, :2] / h - np.column_stack([(away - rows)[:, 1] / 2, np.zeros(len(rows))])
        rounding = 4 * np.finfo(float).eps * np.abs(rows[:, :2]) / abs(h)
        miss = np.maximum(np.abs(result - rows[:, 1:]) - rounding, 0.0)
        rates = np.where(miss < misses, result, rates)
        misses = np.minimum(misses, miss)
    wrong = misses > MISMATCH * np.maximum(size, np.abs(rates).max(axis=0))
    for k, (what, of) in enumerate((("rate", "value"), ("acceleration", "rate"))):
        if wrong[:, k].any():
            j = int(np.flatnonzero(wrong[:, k])[0])
            raise ArgumentError(f"{where} returns the {what} {rows[j, k + 1]:.6g} at t = {instants[j]:.6g} s, but its {of} "
                                f"changes by {rates[j, k]:.6g} in a second there; return value, rate and acceleration of one "
                                "motion, or pass a spline of SciPy, which has its derivatives")


def _demand_no_jump(motion: Followed, where: str, instants: np.ndarray, rows: np.ndarray) -> None:
    """Looks for jumps of value and rate between instants: there the change is not that by the derivative at both ends, however
    short the interval."""
    sizes = np.ptp(rows[:, :2], axis=0) + np.abs(np.diff(instants)).max() * np.abs(rows[:, 1:]).max(axis=0)

    def gaps(t: np.ndarray, at: np.ndarray) -> np.ndarray:
        missing: np.ndarray = np.abs(np.diff(at[:, :2], axis=0) - np.diff(t)[:, None] * (at[1:, 1:] + at[:-1, 1:]) / 2)
        return missing

    worst = gaps(instants, rows)
    for part, what in enumerate(PARTS[:2]):
        for j in np.argsort(-worst[:, part])[:SEARCHED]:
            if not worst[j, part] > JUMPED * sizes[part]:
                break
            t, at = instants[j:j + 2], rows[j:j + 2]
            for _ in range(HALVINGS):
                middle = t.mean()
                t, at = np.insert(t, 1, middle), np.insert(at, 1, motion.at(float(middle)), axis=0)
                left = gaps(t, at)[:, part]
                half = int(left.argmax())
                if not left[half] > JUMPED * sizes[part]:  # the motion only varies quickly here
                    break
                t, at = t[half:half + 2], at[half:half + 2]
            else:
                jump = float(at[1, part] - at[0, part])
                raise ArgumentError(f"{where} has a {what} that jumps by {jump:.6g} at t = {t[1]:.6g} s, which takes an infinite "
                                    "force; return a motion with a continuous rate, such as a spline through its points")
