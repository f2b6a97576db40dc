"""Chattering: motions that slide along a jump of the right-hand side, which every step of an integrator crosses.

Where x_dot = f jumps at a surface s(t, x) = 0 and points towards it from both sides, s_dot(+) < 0 < s_dot(-), the motion stays on
the surface (a block with dry friction that sticks), but f on neither side describes that. Steps cross the surface to and fro and
shrink until their errors are tolerated; a run then has as many steps as the motion takes times the jump over the tolerance.
Source: Filippov, Differential Equations with Discontinuous Righthand Sides (1988), section 4.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from symdyn.errors import SymdynError

if TYPE_CHECKING:
    from symdyn.runtime.integrating.outcome import Request
    from symdyn.runtime.module import Module

SWITCHES = "switches"
# Looks in a row that find the motion on the same surface before it counts as sliding there; steps between the looks, of compiled
# methods and of SciPy's.
LOOKS, STEPS, STEPS_OF_SCIPY = 3, 1000, 150
# Largest distance from a surface of a motion that slides along it, in steps at the rate of crossing.
NEAR = 100.0
# The same where steps have become too small to go on, s.
WITHIN = 1e-6
# Looks are left out where steps are longer than this part of those before, beyond the first ones.
SHRUNK = 0.1


class Chatter:
    """Looks for sliding motion in a run, time after time."""

    def __init__(self, module: Module, request: Request) -> None:
        self.module, self.request = module, request
        self.about = module.metadata.switches
        self.n_state = request.n_state
        self.t, self.n_steps = request.span[0], 0
        self.longest, self.looks = 0.0, 0
        # The surface that the motion was on at the latest looks, how many these were; time and steps at the first of them.
        self.on: int | None = None
        self.found, self.since, self.steps_then = 0, self.t, 0

    def __call__(self, t: float, x: np.ndarray, n_steps: int) -> str:
        """Message about a run that chatters at (t, x) after so many steps; "" if it does not, or not for certain."""
        done = n_steps - self.n_steps
        if done <= 0:
            return ""
        step = abs(t - self.t) / done
        self.t, self.n_steps, self.looks = t, n_steps, self.looks + 1
        shrunk = step < SHRUNK * self.longest
        self.longest = max(self.longest, step)
        result = self._sliding(t, x[:self.n_state], NEAR * step) if shrunk or self.looks <= LOOKS else None
        if result is None or result[0] != self.on:
            self.on, self.found, self.since, self.steps_then = None if result is None else result[0], 0, t, n_steps
        self.found += result is not None
        if result is None or self.found < LOOKS:
            return ""
        return (f"{self._drive(*result)}, and every step crosses it, the latest {n_steps - self.steps_then} steps took "
                f"{abs(t - self.since):.3g} s; {self._remedy(result[0])}")

    def skip(self, t: float, n_steps: int) -> str:
        """Leave out a look, at t after so many steps, whose lengths have other reasons; ""."""
        self.t, self.n_steps, self.on, self.found = t, n_steps, None, 0
        return ""

    def of_small_steps(self, t: float, x: np.ndarray) -> str:
        """Addition to a message where a step became too small; "" where the motion does not slide."""
        result = self._sliding(t, x[:self.n_state], WITHIN)
        return "" if result is None else f"; {self._drive(*result)}; {self._remedy(result[0])}"

    def _drive(self, k: int, up: float, down: float) -> str:
        about = self.about[k]
        where = f" in {about.where}" if about.where else ""
        return (f"{about.what}{where} chatters: the motion is driven onto {about.surface} = 0 from both sides, at rates of "
                f"{up:.3g} and {down:.3g} of its unit a second")

    def _remedy(self, k: int) -> str:
        return (f"make the jump smooth, for example by {self.about[k].remedy} with a small eps, or end "
                "the motion there by an event with stop=True and go on with equations for what sticks")

    def _sliding(self, t: float, x: np.ndarray, near: float) -> tuple[int, float, float] | None:
        """The surface that the motion slides along, no further away than it moves within `near` s, and its rates below and
        above; None if there is none."""
        try:
            return self._towards(t, x, near)
        except SymdynError:  # cannot be evaluated near the state
            return None

    def _towards(self, t: float, x: np.ndarray, near: float) -> tuple[int, float, float] | None:
        n = len(x)
        change = 1e-6 * np.maximum(1.0, np.abs(x))
        rows = np.vstack([x, x + np.diag(change), x - np.diag(change)])
        s = self._values(SWITCHES, np.full(2 * n + 1, t), rows)
        gradient = ((s[1:n + 1] - s[n + 1:]) / (2 * change[:, None])).T  # (n_s, n)
        dt = 1e-7 * max(abs(t), 1.0)
        by_time = (self._values(SWITCHES, np.array([t + dt]), x[None, :]) - s[0])[0] / dt
        for k, slope in enumerate(gradient):
            size = float(np.linalg.norm(slope))
            if not (np.isfinite(size) and size > 0):
                continue
            # To either side, further than the steps go and than rounding does.
            away = 2 * abs(s[0, k]) + 1e-13 * float(np.abs(slope) @ np.maximum(1.0, np.abs(x)))
            sides = x + np.outer((np.array([-away, away]) - s[0, k]) / size**2, slope)
            rates = self._values("rhs", np.array([t, t]), sides) @ slope + by_time[k]
            if rates[0] > 0 > rates[1] and abs(s[0, k]) <= near * float(np.abs(rates).max()):
                return k, float(rates[0]), float(rates[1])
        return None

    def _values(self, name: str, t: np.ndarray, x: np.ndarray) -> np.ndarray:
        """A function at rows of states, (n, m)."""
        inputs = self.request.inputs.rows(t, x) if len(self.request.inputs.constant) else ()
        return np.asarray(self.module.evaluate(name, t, x, self.request.p, inputs)).reshape(len(t), -1)


def chatter_of(module: Module, request: Request) -> Chatter | None:
    """The search for chattering in a run; None where nothing jumps."""
    return Chatter(module, request) if module.metadata.switches else None
