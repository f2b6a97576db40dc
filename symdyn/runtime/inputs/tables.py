"""Tables of inputs over time: piecewise polynomials of order three at most, straight between their points or a smooth spline."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from symdyn.arguments import OverTime, fixed
from symdyn.errors import ArgumentError
from symdyn.real_numbers import real_of
from symdyn.shown import shown

INTERPOLATIONS, EXTENDS = ("linear", "cubic"), ("error", "hold")
# Coefficients of a piece: of 1, d, d^2 and d^3, d being the time since its start.
ORDER = 4
# A run may go beyond a table by this part of the times' size: rounding of its ends.
ROUNDING = 1e-12


@dataclass(frozen=True, eq=False)
class Pieces:
    """A piecewise polynomial of several inputs: breaks (n + 1,), s; coefficients (n, n_in, 4); ends are held."""

    breaks: np.ndarray
    coefficients: np.ndarray

    def at(self, t: Any) -> np.ndarray:
        """Values at a time, (n_in,), or at times (n,), (n, n_in)."""
        inside = np.clip(t, self.breaks[0], self.breaks[-1])
        k = np.clip(np.searchsorted(self.breaks, inside, side="right") - 1, 0, len(self.coefficients) - 1)
        d, c = np.asarray(inside - self.breaks[k])[..., None], self.coefficients[k]
        return np.asarray(c[..., 0] + d * (c[..., 1] + d * (c[..., 2] + d * c[..., 3])))

    def with_constants(self, indices: Sequence[int], values: np.ndarray) -> Pieces:
        """The same but for inputs at these indices, which have these values (n_in,) at all times."""
        coefficients = self.coefficients.copy()
        coefficients[:, indices] = 0.0
        coefficients[:, indices, 0] = values[indices]
        return Pieces(self.breaks, coefficients)


@dataclass(frozen=True, eq=False)
class Table(OverTime):
    """An input over time by its values at certain times, for `simulate(inputs={"F": Table(times, values)})`.

    times           (n,), s, increasing
    values          (n,) of one input; (n, n_in) of all in order
    interpolation   "linear": straight between the points; "cubic": the spline with continuous second derivatives (its ends by
                    the "not-a-knot" condition), which may overshoot. Steps of the integration end at all times of the table
    extend          what holds before the first time and after the last: "error": a run that goes there is an error;
                    "hold": the first value, and the last one

    Copies what is passed. Raises ArgumentError for what does not fit.

    >>> force = sd.Table([0, 1, 2], [0.0, 3.0, 0.0], interpolation="cubic")
    >>> sd.systems.cart_pole().compile(backend="numpy").simulate((0, 1), inputs={"F": force}).success
    True
    """

    times: np.ndarray
    values: np.ndarray
    interpolation: str = "linear"
    extend: str = "error"

    if TYPE_CHECKING:  # also takes lists

        def __init__(self, times: Sequence[float] | np.ndarray, values: Sequence[float] | Sequence[Sequence[float]] | np.ndarray,
                     interpolation: str = "linear", extend: str = "error") -> None: ...

    def __post_init__(self) -> None:
        for what, value, known in (("interpolation", self.interpolation, INTERPOLATIONS), ("extend", self.extend, EXTENDS)):
            if not isinstance(value, str) or value not in known:
                raise ArgumentError(f"{what} of a table of inputs must be {' or '.join(map(repr, known))}, found {shown(value)}")
        times, values = (np.array(real_of(part, "a table of inputs", f"{what} must be numbers"), order="C")
                         for what, part in (("times", self.times), ("values", self.values)))
        if times.ndim != 1 or len(times) == 0 or values.ndim not in (1, 2) or len(values) != len(times):
            raise ArgumentError(f"a table of inputs has times of shape {times.shape} and values of shape {values.shape}; give "
                                "one row of values for each time")
        wrong = _first_wrong(times, values)
        if wrong:
            raise ArgumentError(f"the times of a table of inputs must increase, and all of it be finite, found {wrong}")
        object.__setattr__(self, "times", fixed(times))
        object.__setattr__(self, "values", fixed(values))

    @cached_property
    def pieces(self) -> Pieces:
        """The piecewise polynomial."""
        t, y = self.times, self.values.reshape(len(self.times), -1)
        if len(t) == 1:
            return Pieces(np.array([t[0], t[0] + 1.0]), np.pad(y[:, :, None], ((0, 0), (0, 0), (0, ORDER - 1))))
        coefficients = np.zeros((len(t) - 1, y.shape[1], ORDER))
        if self.interpolation == "cubic":
            from scipy.interpolate import CubicSpline

            coefficients[:] = CubicSpline(t, y).c[::-1].transpose(1, 2, 0)
        else:
            coefficients[:, :, 0], coefficients[:, :, 1] = y[:-1], np.diff(y, axis=0) / np.diff(t)[:, None]
        return Pieces(t, coefficients)

    def beyond(self, span: tuple[float, float]) -> str:
        """Message about a run that goes beyond the table where that is an error; empty if it does not."""
        first, last = float(self.times[0]), float(self.times[-1])
        begin, end = min(span), max(span)
        slack = ROUNDING * max(abs(first), abs(last), abs(begin), abs(end))
        if self.extend == "hold" or (first - slack <= begin and end <= last + slack):
            return ""
        return f"holds from t = {first:g} s to {last:g} s, and the run goes from {begin:g} s to {end:g} s"


class Piecewise(Table):
    """A table whose pieces are given: polynomials of order three at most, which may jump where steps of the integration end."""

    def __init__(self, pieces: Pieces) -> None:
        super().__init__(pieces.breaks, pieces.at(pieces.breaks), extend="hold")
        self.__dict__["pieces"] = pieces


def _first_wrong(times: np.ndarray, values: np.ndarray) -> str:
    """The first entry that is not finite, or the first time that does not come after the one before; "" if there is none."""
    for what, array in (("time", times), ("value", values)):
        rows = np.flatnonzero(~np.isfinite(array.reshape(len(array), -1)).all(axis=1))
        if len(rows):
            return f"the {what} {array[rows[0]]} in row {rows[0]}"
    late = np.flatnonzero(np.diff(times) <= 0)
    return f"the time {times[late[0] + 1]:g} after {times[late[0]]:g} in row {late[0] + 1}" if len(late) else ""


def joined(parts: Sequence[tuple[Sequence[int], Pieces]], constant: np.ndarray) -> Pieces:
    """One piecewise polynomial of all inputs, with the breaks of all.

    parts      indices of inputs and the pieces of these
    constant   (n_in,) of those that have none
    """
    breaks = np.unique(np.concatenate([pieces.breaks for _, pieces in parts]))
    coefficients = np.zeros((len(breaks) - 1, len(constant), ORDER))
    coefficients[:, :, 0] = constant
    middle = (breaks[1:] + breaks[:-1]) / 2
    for indices, pieces in parts:
        k = np.clip(np.searchsorted(pieces.breaks, middle, side="right") - 1, 0, len(pieces.coefficients) - 1)
        c0, c1, c2, c3 = np.moveaxis(pieces.coefficients[k], -1, 0)
        d = (breaks[:-1] - pieces.breaks[k])[:, None]
        moved = np.stack([c0 + d * (c1 + d * (c2 + d * c3)), c1 + d * (2 * c2 + 3 * d * c3), c2 + 3 * d * c3, c3], axis=-1)
        for outside, end in ((middle < pieces.breaks[0], pieces.breaks[0]), (middle > pieces.breaks[-1], pieces.breaks[-1])):
            moved[outside] = 0.0
            moved[outside, :, 0] = pieces.at(end)
        coefficients[:, list(indices)] = moved
    return Pieces(breaks, coefficients)
