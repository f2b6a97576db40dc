"""Inputs of a simulation: numbers, tables over time, functions of time and state, or values that controllers hold."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from symdyn.arguments import take
from symdyn.errors import ArgumentError
from symdyn.real_numbers import NotReal, number, real
from symdyn.runtime.contradicted import contradiction, message
from symdyn.runtime.inputs.following import RATES, Followed, Motions, spline_pieces, take_motion
from symdyn.runtime.inputs.of_time import input_of, is_expression, is_smooth, motion_of
from symdyn.runtime.inputs.sampled import Record, Sampled, Sampler
from symdyn.runtime.inputs.tables import Pieces, Piecewise, Table, joined
from symdyn.runtime.raised import InputRaised, called
from symdyn.shown import name_of, shown

if TYPE_CHECKING:
    from symdyn.given import Row


@dataclass(frozen=True)
class Smooth:
    """Declaration that a function of inputs, f(t, x), has continuous derivatives of every order along the motion: no jumps, no
    kinks, nothing that switches by t or by x. "radau" and "radau5" then take the tolerances as they are, no hundredth of them.

    Methods that cannot find such places, as "gauss", take declared functions alone:
    `inputs={"F": sd.Smooth(lambda t, x: ...)}`.
    gradient   f(t, x) -> derivatives of the value by the state, (n_x,), of a function for all inputs one row for each: what
               sensitivities of the motion need where the value depends on the state; None: not known
    Raises ArgumentError for what cannot be called.

    >>> force = sd.Smooth(lambda t, x: 2.0 - x[0])
    >>> sd.systems.cart_pole().compile(backend="numpy").simulate((0, 1), inputs={"F": force}).success
    True
    """

    function: Callable[[float, np.ndarray], Row]
    gradient: Callable[[float, np.ndarray], Row | Sequence[Row]] | None = None

    def __post_init__(self) -> None:
        if not (self.gradient is None or callable(self.gradient)):
            raise ArgumentError(f"the gradient of sd.Smooth must be a function of (t, x), or None, found {self.gradient!r}")
        if not callable(self.function):
            raise ArgumentError(f"sd.Smooth declares that a function of (t, x) is smooth, found {self.function!r}; constants "
                                "need no declaration, and tables have kinks")

    def __call__(self, t: float, x: np.ndarray) -> Row:
        return self.function(t, x)


def _undeclared(given: Any) -> Any:
    """The function itself, by whose name messages call it."""
    return given.function if isinstance(given, Smooth) else given


@dataclass(frozen=True)
class Mixed:
    """The function of inputs that are given one by one: constant (n_in,), or by tables, but for what has a function of its own.

    functions   index of the input, its name, its function of (t, x)
    followed    motions by functions of t
    """

    constant: np.ndarray
    pieces: Pieces | None
    functions: tuple[tuple[int, str, Callable[[float, np.ndarray], Any]], ...]
    followed: tuple[Followed, ...] = ()

    def __call__(self, t: float, x: np.ndarray) -> np.ndarray:
        values = self.constant.copy() if self.pieces is None else self.pieces.at(t)
        for index, name, function in self.functions:
            value = function(t, x)
            try:
                values[index] = number(value)
            except NotReal as error:
                raise ArgumentError(f"the function of input {name} returned {shown(value)} at t = {t:.6g}; needed is a "
                                    f"number: {error}") from None
        for motion in self.followed:
            values[motion.indices] = motion.at(t, x)
        return values


@dataclass(frozen=True)
class Inputs:
    """One of: constant (n_in,), tables over time as one piecewise polynomial, function f(t, x) -> (n_in,).

    The function of inputs that are given one by one looks into their tables, too.
    kinks   (k,) times at which steps have to end, those of tables: a derivative jumps there, which a step across does not see
    smooth  whether all that is given as functions is declared to be smooth
    samplers   controllers that set some of the constants at instants; until then these have their initial values
    record     the values of these as the controllers held them in a run, in place of samplers
    motions    those that inputs follow; None: there are none, or they stand still
    gradients  of functions that have one: indices of the inputs, derivatives of their values by the state, what messages call it
    """

    constant: np.ndarray
    pieces: Pieces | None = None
    function: Callable[[float, np.ndarray], Any] | None = None
    kinks: np.ndarray = field(default_factory=lambda: np.zeros(0))
    smooth: bool = False
    samplers: tuple[Sampler, ...] = ()
    record: Record | None = None
    motions: Motions | None = None
    gradients: tuple[tuple[tuple[int, ...], Callable[[float, np.ndarray], Any], str], ...] = ()

    def slopes(self, t: float, x: np.ndarray, columns: np.ndarray) -> np.ndarray:
        """Derivatives of the inputs along columns (k, n_x) of sensitivities, (n_in, k), by the gradients of functions. Raises
        InputRaised from what these raise, ArgumentError for what does not fit."""
        result = np.zeros((len(self.constant), len(columns)))
        for indices, gradient, what in self.gradients:
            given = called(gradient, t, x, what, (t, x.copy()))
            try:
                rows = np.asarray(given, dtype=float).reshape(len(indices), len(x))
            except (TypeError, ValueError):
                raise ArgumentError(f"{what} returned {shown(given)} at t = {t:.6g}; needed are {len(x)} numbers for each of its "
                                    "inputs") from None
            if np.isfinite(x).all() and not np.isfinite(rows).all():
                raise InputRaised(f"{what} is {rows[~np.isfinite(rows)][0]:g} at t = {t:.6g}", t, x)
            result[list(indices)] = rows @ columns.T
        return result

    def demand_true_slopes(self, t: float, x: np.ndarray) -> None:
        """Raises ArgumentError where the gradient of a function contradicts it, or is not finite, at a time and state (n_x,)."""
        for indices, _, what in self.gradients:
            try:
                rows = self.slopes(t, x, np.eye(len(x)))[list(indices)]
            except InputRaised as error:
                if error.__cause__ is not None:  # what a function raises ends the run
                    return
                raise ArgumentError(str(error)) from None
            slopes = contradiction(lambda state, indices=indices: self.at(t, state)[list(indices)], x, rows)  # type: ignore[misc]
            if slopes is not None:
                raise ArgumentError(message(what.removeprefix("the gradient of "), slopes, t, "the state"))

    @property
    def by_tables(self) -> bool:
        """Whether tables and numbers give all of them."""
        return self.pieces is not None and self.function is None and not self.samplers

    @property
    def has_kinks(self) -> bool:
        """Whether a derivative of any of them jumps at times that are known."""
        return len(self.kinks) > 0

    @property
    def may_have_kinks(self) -> bool:
        """Whether any is a function that is not declared to be smooth: kinks at times that are not known."""
        return self.function is not None and not self.smooth

    def by_function(self, names: Sequence[str]) -> list[str]:
        """Those of the inputs, in order, that functions give over time, rates of such motions among them; splines and tables do
        not count."""
        if self.function is None:
            return []
        if not isinstance(self.function, Mixed):
            return list(names)
        moving = [names[k] for m in self.function.followed if not m.breaks for k in m.indices]
        return [name for _, name, _ in self.function.functions] + moving

    def varying(self, names: Sequence[str]) -> list[str]:
        """Those of the inputs, in order, that are not constant: given by functions, tables or controllers."""
        given = set(self.by_function(names)) | {names[k] for k in (self.indices if self.are_held else ())}
        if isinstance(self.function, Mixed):
            given |= {names[k] for m in self.function.followed for k in m.indices}
        pieces = self.function.pieces if isinstance(self.function, Mixed) else self.pieces
        if pieces is not None:
            rows = pieces.coefficients
            given |= {names[k] for k in range(len(names)) if rows[:, k, 1:].any() or np.ptp(rows[:, k, 0])}
        return [name for name in names if name in given]

    @property
    def are_held(self) -> bool:
        """Whether controllers set some of them at instants, or did so."""
        return bool(self.samplers) or self.record is not None

    @property
    def indices(self) -> list[int]:
        """Indices of the inputs that controllers set."""
        return sorted({index for sampler in self.samplers for index in sampler.indices} if self.record is None
                      else self.record.indices)

    def held(self, values: np.ndarray | None = None) -> Inputs:
        """The same with these constants (n_in,) (default: the initial values) in place of what controllers set."""
        constant = self.constant.copy()
        if values is not None:
            constant[self.indices] = values[self.indices]
        function, pieces = self.function, self.pieces
        if isinstance(function, Mixed):
            within = None if function.pieces is None else function.pieces.with_constants(self.indices, constant)
            function = replace(function, constant=constant, pieces=within)
        if pieces is not None:
            pieces = pieces.with_constants(self.indices, constant)
        return replace(self, constant=constant, pieces=pieces, function=function, samplers=(), record=None)

    def recorded(self, record: Record | None) -> Inputs:
        """The same with what controllers set in a run; None: there are no controllers."""
        return self if record is None else replace(self, samplers=(), record=record)

    def at(self, t: float, x: np.ndarray) -> np.ndarray:
        """The inputs at a time and state. Raises InputRaised from whatever a function raises."""
        values = self._without_record(t, x)
        return values if self.record is None else self.record.put(t, values)

    def left_out(self, t: Any) -> np.ndarray:
        """Values in a run of inputs that are left out, (n_in,), or (n, n_in) for times (n,): motions alone depend on the time."""
        return self.constant if self.motions is None else self.motions.at(t)

    def _without_record(self, t: float, x: np.ndarray) -> np.ndarray:
        if self.function is not None:
            given = self.function(t, x)
            try:
                values = real(given).reshape(-1)
            except NotReal as error:
                raise ArgumentError(f"the input function returned {shown(given)} at t = {t:.6g}; needed are "
                                    f"{len(self.constant)} numbers: {error}") from None
            if len(values) != len(self.constant):
                raise ArgumentError(f"the input function returned {len(values)} values at t = {t:.6g}, needed are "
                                    f"{len(self.constant)}")
            return values
        return self.constant if self.pieces is None else self.pieces.at(t)

    def rows(self, t: np.ndarray, x: np.ndarray) -> np.ndarray:
        """The inputs at every time, (n_t, n_in), or (1, n_in) where they are constant; not a number where a function raises."""
        if self.function is None:
            values = self.constant[None, :] if self.pieces is None else self.pieces.at(t)
            return values if self.record is None else self.record.put(t, values)
        result = np.full((len(t), len(self.constant)), np.nan)
        for k, (tk, xk) in enumerate(zip(t, x, strict=True)):
            with suppress(InputRaised):
                result[k] = self.at(tk, xk)
        return result

    def stops(self, span: tuple[float, float]) -> np.ndarray:
        """Times within a span at which steps have to end, in the direction of time, (k,); those within rounding of its ends are
        left out."""
        begin, end = min(span), max(span)
        slack = 8 * float(np.finfo(float).eps) * max(abs(begin), abs(end))
        inside = self.kinks[(self.kinks > begin + slack) & (self.kinks < end - slack)]
        return inside if span[1] >= span[0] else inside[::-1]


def not_finite(names: Sequence[str], values: Any, t: float) -> str:
    """Addition to a message where a function failed: inputs that are not finite there."""
    rows = () if values is None else values
    wrong = [f"{name} is {value:g}" for name, value in zip(names, rows, strict=False) if not np.isfinite(value)]
    return f"; the input {', '.join(wrong)} at t = {t:.6g}" if wrong else ""


def take_inputs(given: Any, names: Sequence[str], initial: Mapping[str, float], owner: str,
                span: tuple[float, float] | None = None, interpolation: str = "linear", extend: str = "error",
                motions: Sequence[str] = ()) -> Inputs:
    """Inputs as the user gave them.

    given   None (defaults, else zero); numbers in order; a function of (t, x) or a Sampled controller for all; a pair (times,
            values) or a Table; or a mapping from names or symbols to a number, a function of (t, x), an expression of the time,
            a pair (times, values), a Table, a spline of SciPy, or a Sampled controller, which may also have several names as its
            key; a spline or an expression alone is that of the only input
    span    of the run, which tables must cover unless their ends are held; None: not asked
    interpolation, extend   of pairs, as of a Table
    motions   names of those that are motions: also functions of t that return value, rate and acceleration, splines of SciPy and
              tables, which become splines; a number holds one in its place
    Raises ArgumentError for what fits none of these.
    """
    zeros = {n: initial.get(n, 0.0) for n in names}
    start = np.array([zeros[n] for n in names], dtype=float)
    try:
        for_pairs = Table(np.zeros(1), np.zeros(1), interpolation, extend)
    except ArgumentError as error:
        raise ArgumentError(f"{owner}: {error}") from None
    empty = given.size == 0 if isinstance(given, np.ndarray) else isinstance(given, (Sequence, Mapping)) and not given
    if given is None or empty:
        return Inputs(start)
    if not names:
        raise ArgumentError(f"{owner}: inputs were given, but the system has none")
    if len(names) == 1 and not motions and (type(given).__module__.startswith("scipy.interpolate") or is_expression(given)):
        given = {names[0]: given}
    if motions and (isinstance(given, Sampled) or callable(given) or is_table(given)):
        raise ArgumentError(f"{owner}: the inputs {', '.join(motions)} are motions, which need rates and accelerations; give "
                            "inputs by name: inputs={...}")
    if isinstance(given, Sampled):
        return Inputs(start, samplers=(Sampler(given, tuple(range(len(names))), "the sampled controller"),))
    if callable(given):
        asked = partial(_asked, _undeclared(given), "the input function")
        return Inputs(start, function=asked, smooth=isinstance(given, Smooth),
                      gradients=_gradients({"the input function": (given, range(len(names)))}))
    if is_table(given):
        table = _table(given, for_pairs, names, owner, span)
        return Inputs(start, pieces=table.pieces, kinks=table.pieces.breaks)
    if not isinstance(given, Mapping):
        constant = take(given, names, "inputs", zeros, owner)
        demand_rest(constant, names, motions, owner)
        return Inputs(constant)
    samplers, given = _samplers(given, names, owner)
    sampled = {names[index]: start[index] for sampler in samplers for index in sampler.indices}
    parts = {name_of(key): value for key, value in given.items()}
    parts |= {n: _by_time(v, f"{owner}: inputs: {n}", n in motions) for n, v in parts.items() if is_expression(v)}
    for n, value in parts.items():
        pieces = None if n in motions else spline_pieces(value, f"{owner}: inputs: {n}", span)
        parts[n] = value if pieces is None else Piecewise(pieces)
    indices = {n: k for k, n in enumerate(names)}
    varying = {n: v for n, v in parts.items() if callable(v) or is_table(v) or isinstance(v, tuple)}
    moving = {n: varying.pop(n) for n in motions if n in varying}
    followed = [take_motion(_undeclared(v), n, indices[n], owner, span, isinstance(v, Smooth)) for n, v in moving.items()]
    _demand_known_rates(parts, sampled, motions, owner)
    parts = {n: v for n, v in parts.items() if n not in moving}
    constant = take({n: v for n, v in parts.items() if n not in varying} | dict.fromkeys(varying, 0.0) | sampled, names, "inputs",
                    zeros, owner)
    demand_rest(constant, names, motions, owner)
    if not varying and not followed:
        return Inputs(constant, samplers=samplers)
    functions = {n: partial(_asked, _undeclared(v), f"the function of input {n}") for n, v in varying.items() if callable(v)}
    tables = [([indices[n]], _table(v, for_pairs, [n], owner, span).pieces) for n, v in varying.items() if n not in functions]
    tables += [(m.indices, m.pieces) for m in followed if m.pieces is not None]
    pieces = joined(tables, constant) if tables else None
    along = Motions(constant, tuple(followed)) if followed else None
    kinks = np.unique(np.concatenate([np.zeros(0) if pieces is None else pieces.breaks, *[np.array(m.breaks) for m in followed]]))
    by_function = tuple(m for m in followed if m.pieces is None)
    if not functions and not by_function:
        return Inputs(constant, pieces=pieces, kinks=kinks, samplers=samplers, motions=along)
    mixed = Mixed(constant, pieces, tuple((indices[n], n, f) for n, f in functions.items()), by_function)
    smooth = all(isinstance(varying[n], Smooth) for n in functions) and all(m.smooth or m.breaks for m in by_function)
    of = {f"the function of input {n}": (varying[n], [indices[n]]) for n in functions}
    return Inputs(constant, function=mixed, kinks=kinks, smooth=smooth, samplers=samplers, motions=along,
                  gradients=_gradients(of))


def _gradients(given: Mapping[str, tuple[Any, Sequence[int]]]) -> tuple[tuple[tuple[int, ...], Any, str], ...]:
    """Those of functions that have one; given: how messages call a function -> the function and the indices of its inputs."""
    return tuple((tuple(indices), value.gradient, f"the gradient of {what}") for what, (value, indices) in given.items()
                 if isinstance(value, Smooth) and value.gradient is not None)


def inputs_at(given: Any, t: float, names: Sequence[str], initial: Mapping[str, float], owner: str,
              motions: Sequence[str]) -> np.ndarray:
    """Inputs at a time, (n_in,): numbers, rates of motions among them; or motions as for a run. Raises ArgumentError as
    `take_inputs`."""
    if given is None or not varies_over_time(given):
        return take(given, names, "inputs", {n: initial.get(n, 0.0) for n in names}, owner)
    return take_inputs(given, names, initial, owner, motions=motions).left_out(t)


def _demand_known_rates(parts: Mapping[str, Any], sampled: Mapping[str, float], motions: Sequence[str], owner: str) -> None:
    """Raises ArgumentError for rates of motions that are given apart from these, and for motions that controllers hold."""
    apart = [f"{n}{end}" for n in motions for end in RATES if f"{n}{end}" in parts or f"{n}{end}" in sampled]
    if apart:
        raise ArgumentError(f"{owner}: inputs: {', '.join(apart)} given apart from the motion; over time a motion is given as a "
                            "whole: a function of t that returns value, rate and acceleration, a spline of SciPy, or a table")
    held = [n for n in motions if n in sampled]
    if held:
        raise ArgumentError(f"{owner}: inputs: the motion {', '.join(held)} is given by a sampled controller, whose values jump, "
                            "which takes an infinite force; pass a function of t, a spline of SciPy or a table")


def demand_rest(constant: np.ndarray, names: Sequence[str], motions: Sequence[str], owner: str) -> None:
    """Raises ArgumentError for motions that are held in their place, but whose rate or acceleration is not zero; constant: inputs
    (n_in,), or rows of them."""
    moving = [f"{n}{end}" for n in motions for end in RATES if constant[..., list(names).index(f"{n}{end}")].any()]
    if moving:
        raise ArgumentError(f"{owner}: inputs: {', '.join(moving)} is not zero, but the motion itself does not change; over time "
                            "give a motion as a function of t that returns value, rate and acceleration, as a spline of SciPy, "
                            "or as a table")


def _samplers(given: Mapping[Any, Any], names: Sequence[str], owner: str) -> tuple[tuple[Sampler, ...], dict[Any, Any]]:
    """The controllers among inputs that are given by name, and the rest. Raises ArgumentError for names that there are not, or
    that come twice."""
    result, rest, taken = [], {}, [name_of(k) for k in given if not isinstance(k, tuple)]
    for key, value in given.items():
        keys = [name_of(k) for k in (key if isinstance(key, tuple) else (key,))]
        if not isinstance(value, Sampled):
            if isinstance(key, tuple):
                raise ArgumentError(f"{owner}: inputs: several inputs ({', '.join(keys)}) take one Sampled controller together, "
                                    f"found {shown(value)}; give each a value of its own")
            rest[key] = value
            continue
        unknown = [k for k in keys if k not in names]
        if unknown:
            raise ArgumentError(f"{owner}: inputs: there is no {', '.join(map(repr, unknown))}; there are {', '.join(names)}")
        taken += keys if isinstance(key, tuple) else []
        result.append(Sampler(value, tuple(names.index(k) for k in keys), f"the sampled controller of {', '.join(keys)}"))
    twice = sorted({k for k in taken if taken.count(k) > 1})
    if twice:
        raise ArgumentError(f"{owner}: inputs: {', '.join(twice)} given more than once")
    return tuple(result), rest


def is_table(value: Any) -> bool:
    """Whether a value is a table over time: a Table, or a pair of times and values."""
    return isinstance(value, Table) or (isinstance(value, tuple) and len(value) == 2 and np.ndim(value[0]) == 1)


def varies_over_time(given: Any) -> bool:
    """Whether inputs as the user gave them, or any of them, are functions, expressions, tables or sampled controllers."""
    each = given.values() if isinstance(given, Mapping) else (given,)
    return any(callable(value) or isinstance(value, Sampled) or is_table(value) or is_expression(value) for value in each)


def _by_time(expression: Any, where: str, motion: bool) -> Any:
    """The function of an expression of the time, declared smooth where it is."""
    function: Any = motion_of(expression, where) if motion else input_of(expression, where)
    return Smooth(function) if is_smooth(expression) else function


def _asked(function: Callable[[float, np.ndarray], Any], what: str, t: float, x: np.ndarray) -> Any:
    return called(function, t, x, what, (t, x))


def _table(given: Any, for_pairs: Table, names: Sequence[str], owner: str, span: tuple[float, float] | None) -> Table:
    """The table of inputs with these names; a pair is interpolated and extended as for_pairs."""
    try:
        table = given if isinstance(given, Table) else replace(for_pairs, times=given[0], values=given[1])
    except ArgumentError as error:
        raise ArgumentError(f"{owner}: {error}") from None
    if int(np.prod(table.values.shape[1:])) != len(names) or (table.values.ndim == 2 and not len(names)):
        raise ArgumentError(f"{owner}: a table of inputs has times of shape {table.times.shape} and values of shape "
                            f"{table.values.shape}; give one row of {len(names)} values for each time")
    beyond = table.beyond(span) if span is not None else ""
    if beyond:
        raise ArgumentError(f"{owner}: the table of the input {', '.join(names)} {beyond}; pass a table of the whole run, or "
                            "extend='hold' to hold its first and last values")
    return table
