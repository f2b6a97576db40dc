"""Sampled controllers: functions of time and state that are asked at instants, and whose values are held in between."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from symdyn.arguments import OverTime
from symdyn.errors import ArgumentError
from symdyn.runtime.raised import InputRaised, called

if TYPE_CHECKING:
    from symdyn.given import Row

# Instants closer than this part of the shortest period are one.
ONE_INSTANT = 1e-9
# A period shorter than this part of the largest time cannot be distinguished from rounding of time.
RESOLVED = 1e-11


@dataclass(frozen=True)
class Sampled(OverTime):
    """A controller that is asked at instants and whose value is held until the next one (zero-order hold).

    function   f(t, x) -> the input's value, or one for each of several inputs; x = [q; u; z], (n_x,). In every simulation it
               is called once for each instant, in the order of time, so that it may keep a memory of its own
    period     between two instants, s
    offset     from the start of the simulation to the first instant, s; until then inputs have their initial values
    delay      from an instant to when its value takes effect, s: the time that computing takes; it may exceed the period
    gradient   f(t, x) -> derivatives of the value by the state, (n_x,), or one row for each of several inputs: what
               sensitivities of the motion need; None: not known

    Pass it to `simulate`: inputs={F: sd.Sampled(f, period=0.01)}, inputs={(F, M): sd.Sampled(f, 0.01)} for an f that returns two
    values, or inputs=sd.Sampled(f, 0.01) for all inputs. Steps of the integrator end at the instants. Raises ArgumentError for
    what is no function, and for times that make no sense.

    >>> controller = sd.Sampled(lambda t, x: -5.0 * x[0], period=0.1)
    >>> sd.systems.cart_pole().compile(backend="numpy").simulate((0, 1), inputs={"F": controller}).success
    True
    """

    function: Callable[[float, np.ndarray], Row]
    period: float
    offset: float = 0.0
    delay: float = 0.0
    gradient: Callable[[float, np.ndarray], Row | Sequence[Row]] | None = None

    def __post_init__(self) -> None:
        if not callable(self.function):
            raise ArgumentError(f"a sampled controller takes a function of (t, x) first, found {self.function!r}")
        if not (self.gradient is None or callable(self.gradient)):
            raise ArgumentError(f"the gradient of a sampled controller must be a function of (t, x), or None, found "
                                f"{self.gradient!r}")
        for what, least in (("period", "more than 0"), ("offset", "0 or more"), ("delay", "0 or more")):
            value = getattr(self, what)
            fits = isinstance(value, (int, float, np.number)) and not isinstance(value, bool) and np.isfinite(value)
            if not fits or value < 0 or (what == "period" and value == 0):
                raise ArgumentError(f"the {what} of a sampled controller must be a number of seconds, {least}, found {value!r}")


class SampleRows(NamedTuple):
    """Values that a controller has set: when its values took effect, t (n,), and the values (n,)."""

    t: np.ndarray
    values: np.ndarray


@dataclass(frozen=True)
class Sampler:
    """A controller with the indices of the inputs that it sets, and how messages call it."""

    sampled: Sampled
    indices: tuple[int, ...]
    what: str

    def values(self, t: float, x: np.ndarray) -> np.ndarray:
        """Values of the function, (n,). Raises InputRaised from what it raises, ArgumentError for what does not fit."""
        given = called(self.sampled.function, t, x, self.what, (t, x.copy()))
        try:
            values = np.asarray(given, dtype=float).reshape(-1)
        except (TypeError, ValueError):
            values = np.zeros(0)
        if len(values) != len(self.indices):
            wanted = "a number" if len(self.indices) == 1 else f"{len(self.indices)} numbers"
            needed = "needed is" if len(self.indices) == 1 else "needed are"
            raise ArgumentError(f"{self.what} returned {given!r} at t = {t:.6g}; {needed} {wanted}")
        return values

    def columns(self, t: float, x: np.ndarray, columns: np.ndarray) -> np.ndarray:
        """Derivatives of the values along columns (k, n_x) of sensitivities, (n, k), by the gradient. Raises as `values`."""
        assert self.sampled.gradient is not None
        given = called(self.sampled.gradient, t, x, f"the gradient of {self.what}", (t, x.copy()))
        try:
            rows = np.asarray(given, dtype=float).reshape(len(self.indices), len(x))
        except (TypeError, ValueError):
            raise ArgumentError(f"the gradient of {self.what} returned {given!r} at t = {t:.6g}; needed are {len(x)} numbers for "
                                "each of its inputs") from None
        if np.isfinite(x).all() and not np.isfinite(rows).all():
            raise InputRaised(f"the gradient of {self.what} is {rows[~np.isfinite(rows)][0]:g} at t = {t:.6g}", t, x)
        return np.asarray(rows @ columns.T)


@dataclass(frozen=True)
class Record:
    """Inputs as they were held: from times (n,) on, values (n, n_in) at the indices of inputs that controllers set; fresh
    (n, n_in): those that were set then; ahead: the instant at which the latest piece was to end, s; columns (n, n_in, k): their
    derivatives along sensitivities, k may be 0."""

    times: np.ndarray
    values: np.ndarray
    fresh: np.ndarray
    indices: tuple[int, ...]
    ahead: float
    columns: np.ndarray

    def rows(self, t: Any) -> np.ndarray:
        """The inputs at times, (..., n_in), right at the indices alone; at an instant those that take effect there."""
        result: np.ndarray = self.values[np.maximum(np.searchsorted(self.times, t, side="right") - 1, 0)]
        return result

    def slopes(self, t: np.ndarray) -> np.ndarray:
        """Derivatives of the inputs along columns of sensitivities at times (n,), (n, n_in, k)."""
        result: np.ndarray = self.columns[np.maximum(np.searchsorted(self.times, t, side="right") - 1, 0)]
        return result

    def put(self, t: Any, values: np.ndarray) -> np.ndarray:
        """Inputs at times with what was held in place of the values (n_in,), or (n, n_in) or (1, n_in) for (n,) times."""
        indices, held = list(self.indices), self.rows(t)
        result = np.array(np.broadcast_to(values, held.shape))
        result[..., indices] = held[..., indices]
        return result

    def of(self, index: int) -> SampleRows:
        """Values that were set of one input."""
        when = self.fresh[:, index]
        return SampleRows(self.times[when], self.values[when, index])


class Replay:
    """Holds inputs as a record has them; close: instants that are nearer are one, s."""

    close = 0.0

    def __init__(self, record: Record) -> None:
        self.record, self.close = record, 0.0

    def at(self, t: float, x: np.ndarray, columns: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The inputs from t on, (n_in,), and their derivatives along columns of sensitivities, (n_in, k)."""
        index = max(int(np.searchsorted(self.record.times, t, side="right")) - 1, 0)
        return self.record.values[index], self.record.columns[index]

    def after(self, t: float) -> float:
        """The next instant, s; infinite if there is none."""
        k = int(np.searchsorted(self.record.times, t, side="right"))
        if k < len(self.record.times):
            return float(self.record.times[k])
        return self.record.ahead if t < self.record.ahead else np.inf


class Sampling:
    """Asks controllers at their instants, and records what is held; for one run.

    constant   the inputs until a controller sets them, (n_in,); begin: the start of the run, s
    close      instants that are nearer are one, s
    k          number of columns of sensitivities
    """

    def __init__(self, samplers: Sequence[Sampler], constant: np.ndarray, begin: float, k: int = 0) -> None:
        self.samplers, self.begin = samplers, begin
        self.held = constant.copy()
        self.counts = [0] * len(samplers)
        self.columns = np.zeros((len(constant), k))
        self.waiting: list[tuple[float, tuple[int, ...], np.ndarray, np.ndarray]] = []  # when, where, what takes effect
        self.close = ONE_INSTANT * min(s.sampled.period for s in samplers)
        self._times: list[float] = []
        self._values: list[np.ndarray] = []
        self._fresh: list[np.ndarray] = []
        self._columns: list[np.ndarray] = []

    def at(self, t: float, x: np.ndarray, columns: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The inputs from t on, (n_in,), with those that are sampled at t in the state x, and their derivatives along columns of
        sensitivities (k, n_x), (n_in, k). Raises as `Sampler.values`."""
        fresh = np.zeros(len(self.held), dtype=bool)
        try:
            for k, sampler in enumerate(self.samplers):
                instant = self._instant(k)
                if instant <= t + self.close:
                    slopes = sampler.columns(t, x, columns) if len(columns) else np.zeros((len(sampler.indices), 0))
                    self.waiting.append((instant + sampler.sampled.delay, sampler.indices, sampler.values(t, x), slopes))
                    self.counts[k] += 1
            for when, indices, values, slopes in self.waiting:
                if when <= t + self.close:
                    self.held[list(indices)] = values
                    self.columns[list(indices)] = slopes
                    fresh[list(indices)] = True
            self.waiting = [w for w in self.waiting if w[0] > t + self.close]
        finally:  # also where a controller ends the run: its steps, which a replay repeats, end here
            self._times.append(t)
            self._values.append(self.held.copy())
            self._fresh.append(fresh)
            self._columns.append(self.columns.copy())
        return self.held.copy(), self.columns.copy()

    def after(self, t: float) -> float:
        """The next instant at which a controller is asked, or a value takes effect, s."""
        return min([*[self._instant(k) for k in range(len(self.samplers))], *[when for when, *_ in self.waiting]])

    def _instant(self, k: int) -> float:
        sampled = self.samplers[k].sampled
        return self.begin + sampled.offset + self.counts[k] * sampled.period

    @property
    def record(self) -> Record:
        """Values held so far."""
        return Record(np.array(self._times), np.array(self._values).reshape(-1, len(self.held)),
                      np.array(self._fresh).reshape(-1, len(self.held)),
                      tuple(sorted({index for sampler in self.samplers for index in sampler.indices})),
                      self.after(self._times[-1] if self._times else self.begin),
                      np.array(self._columns).reshape(len(self._columns), *self.columns.shape))


def check_span(samplers: Sequence[Sampler], span: tuple[float, float], owner: str) -> None:
    """Raises ArgumentError where controllers cannot be sampled over a span."""
    if samplers and span[1] < span[0]:
        raise ArgumentError(f"{owner}: sampled controllers run forward in time, but t goes from {span[0]:g} to {span[1]:g} s; "
                            "integrate forward, or pass the inputs as a function of t and x")
    for sampler in samplers:
        period, far = sampler.sampled.period, max(abs(span[0]), abs(span[1]))
        if period < RESOLVED * far:
            raise ArgumentError(f"{owner}: the period of {sampler.what}, {period:g} s, cannot be distinguished from rounding at "
                                f"t = {far:g} s; pass a longer one")
