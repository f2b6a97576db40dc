"""A motion with its inputs over time as piecewise polynomials."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from scipy.interpolate import PPoly

from symdyn.errors import ArgumentError
from symdyn.optimal.transcription import through
from symdyn.real_numbers import real_of
from symdyn.shown import shown

if TYPE_CHECKING:
    from symdyn.given import Times
    from symdyn.runtime.module import Module
    from symdyn.runtime.solutions.solution import Solution

# Points of a polynomial, as shares of its interval, and where it is compared with the motion, within this part of the largest.
INNER = (1 - np.cos(np.pi * (2 * np.arange(6) + 1) / 12)) / 2
BETWEEN, NEAR = np.array([0.003, 0.5, 0.92]), 1e-8
# Intervals to begin with, and how often they are halved.
FIRST, HALVED = 16, 14


class OverTime:
    """States (n_x,) and inputs (n_in,) of a module over time, by polynomials."""

    module: Module
    t: np.ndarray
    states_over_time: PPoly
    inputs_over_time: PPoly

    def at(self, t: Times) -> np.ndarray:
        """The state at a time, (n_x,), or at times, (n, n_x), by the polynomials. Raises ArgumentError beyond the motion."""
        return np.asarray(self.states_over_time(self.within(t)))

    def inputs_at(self, t: Times) -> np.ndarray:
        """The inputs at a time, (n_in,), or at times, (n, n_in); where they jump, those after it. Raises ArgumentError beyond the
        motion."""
        return np.asarray(self.inputs_over_time(self.within(t)))

    def within(self, t: Times) -> np.ndarray:
        """Times, those beyond the motion by rounding at its ends. Raises ArgumentError for others."""
        times, slack = real_of(t, self.module.name, "t must be numbers"), 1e-9 * (1 + abs(self.t[-1]))
        if not np.isfinite(times).all() or (times < self.t[0] - slack).any() or (times > self.t[-1] + slack).any():
            raise ArgumentError(f"{self.module.name}: the motion goes from t = {self.t[0]:g} to {self.t[-1]:g} s; found "
                                f"{shown(t)}")
        return np.clip(times, self.t[0], self.t[-1])


@dataclass(frozen=True, eq=False)
class Course(OverTime):
    """A motion that was simulated; t (2,): its start and end, params (n_p,), breaks (K + 1,) of the polynomials, s."""

    module: Module
    t: np.ndarray
    params: np.ndarray
    breaks: np.ndarray
    states_over_time: PPoly
    inputs_over_time: PPoly

    @classmethod
    def of(cls, motion: Solution) -> Course:
        """A motion by polynomials through as many of its states as it takes, which runs of the same steps give. Raises
        ArgumentError for motions that jump, and for those that did not reach their end."""
        name, breaks = motion.module.name, motion.breaks
        if not motion.success or not breaks[0] < breaks[-1]:
            raise ArgumentError(f"{name}: a regulator was requested along a motion that did not go forward to its end: "
                                f"{motion.message}")
        if len(motion.jumps):
            raise ArgumentError(f"{name}: a regulator was requested along a motion whose state jumps at t = "
                                f"{motion.jumps[0]:.6g} s; simulate up to there, and from there on, and take a regulator of each")
        relative = 0.0 if motion.tolerances is None else 10 * motion.tolerances[0]
        whole = breaks[-1] - breaks[0]
        ends = np.unique(np.concatenate([np.linspace(a, b, 1 + int(np.ceil(FIRST * (b - a) / whole)))
                                         for a, b in pairwise(breaks)]))
        for _ in range(HALVED):
            x, u, left = _through(motion, ends)
            open_ones = left > max(NEAR, relative)
            if not open_ones.any():
                return cls(motion.module, breaks[[0, -1]], motion.params, ends, x, u)
            ends = np.sort(np.append(ends, (ends[1:] + ends[:-1])[open_ones] / 2))
        near = ends[:-1][int(left.argmax())]
        raise ArgumentError(f"{name}: a regulator was requested along a motion whose states or inputs jump near t = {near:.6g} "
                            "s; give inputs as tables, or by functions without jumps")


def _through(motion: Solution, ends: np.ndarray) -> tuple[PPoly, PPoly, np.ndarray]:
    """States and inputs as polynomials between the ends, and how far these are from the motion, as parts of the largest (K,)."""
    h, shares = np.diff(ends), np.append(INNER, BETWEEN)
    t = ends[:-1, None] + h[:, None] * shares
    left, result = np.zeros(len(h)), []
    for values in motion.states_and_inputs(t):
        made = PPoly(through(INNER, values[:, :len(INNER)], h), ends)
        off = np.abs(made(t[:, len(INNER):]) - values[:, len(INNER):]) / (np.abs(values).max(axis=(0, 1)) + 1e-300)
        left = np.maximum(left, np.nan_to_num(off, nan=np.inf).max(axis=(1, 2), initial=0.0))
        result.append(made)
    return result[0], result[1], left
