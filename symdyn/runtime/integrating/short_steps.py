"""Steps that are far shorter than a motion needs: where a run spends them, and on which entry of the state.

A motion is smooth where a cubic describes it within some tolerances over as many steps as are looked at: of any method a few
steps would do. If stability does not ask for the short ones (they are far below the inverse of the largest eigenvalue of the
smooth part), and the rate of an entry goes to and fro from step to step, that is what they follow: a jump that the run cannot see
into, as in functions of the user, or noise. Where the rate at the same time jumps from one side of the motion to the other, and
drives it back from both, it slides along the jump (symdyn.runtime.integrating.chatter), and the run ends there.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from symdyn.errors import SymdynError

if TYPE_CHECKING:
    from symdyn.runtime.integrating.outcome import Outcome, Request
    from symdyn.runtime.module import Module

# Steps of a trial that are compared with a cubic, of compiled methods and of SciPy's: as many times shorter than needed they are.
TRIED, TRIED_OF_SCIPY = 1000, 1000
# A look is worth a trial where steps are this part of the longest before, or where a run has taken so many times the steps of a
# trial, and again with every doubling of these; the part of a run with functions of the user, which may jump, is larger.
SHRUNK, OF_FUNCTIONS, MANY = 1e-3, 1e-2, 20
# Largest distance of a cubic, in tolerances, which radau eases for itself, at this part of the states; product of a step and the
# largest eigenvalue below which stability asks for no shorter ones; how much further a rate goes to and fro than it gets.
MISSED, MOST, STABLE, TO_AND_FRO = 1000.0, 0.9, 0.05, 20.0
# Distances to either side of a motion at which a jump stays as it is, in those that its steps go; what is left of it nearby.
ASIDE, LEFT = (2.0, 8.0, 32.0), 0.8

Trial = Callable[[float, np.ndarray, float, int], "Outcome"]


class ShortSteps:
    """Looks for steps that are far too short in a run, time after time.

    trial   goes on from (t, x) by steps of about a length, so many of them
    """

    def __init__(self, module: Module, request: Request, trial: Trial, tried: int = TRIED) -> None:
        self.module, self.request, self.trial, self.tried = module, request, trial, tried
        self.t, self.n_steps, self.longest = request.span[0], 0, 0.0
        self.next = 2 * tried  # steps after which the next trial may be
        self.warned = False

    def __call__(self, t: float, x: np.ndarray, n_steps: int) -> tuple[str, bool]:
        """Message at (t, x) after so many steps, and whether the run ends there, else it is a warning; "" if nothing, or once
        it has been said."""
        done = n_steps - self.n_steps
        if done <= 0 or self.warned:
            return "", False
        step = abs(t - self.t) / done
        self.t, self.n_steps = t, n_steps
        self.longest = max(self.longest, step)
        wanted = self.request.max_step
        shrunk = SHRUNK if self.request.inputs.function is None else OF_FUNCTIONS
        long = step > shrunk * self.longest and n_steps < MANY * self.tried
        if n_steps < self.next or long or 0 < wanted < 3 * step:
            return "", False
        self.next = 2 * n_steps
        tried = self.trial(t, x, step, self.tried)
        if tried.interrupted:
            raise KeyboardInterrupt
        try:
            result = self._entry(tried)
            slides = "" if result is None else self._slides(tried, result[0])
        except (SymdynError, np.linalg.LinAlgError):
            return "", False
        if result is None:
            return "", False
        self.warned = True
        if slides:
            return slides, True
        k, length, jump = result
        names, n = self.module.metadata.x, self.request.n_state
        state = ", ".join(f"{name} = {value:.6g}" for name, value in zip(names, x[:n], strict=True))
        message = (f"{self.module.name}: steps have shrunk to {length:.2g} s at t = {t:.9g} s, over a thousand times shorter "
                   f"than the motion itself needs there: the rate of {names[k]} goes to and fro by {jump:.3g} a second from "
                   "step to step, as behind a jump or noise in a load, an input or a function of the user; the state there: "
                   f"{state}. Make that smooth, or write a jump as an expression (sign, Piecewise), so that a motion along it "
                   "is stopped with its name")
        return message, False

    def _entry(self, result: Outcome) -> tuple[int, float, float] | None:
        """The entry whose rate goes to and fro most, by its tolerance; the mean step; how far it goes."""
        n, request = self.request.n_state, self.request
        if len(result.t) < self.tried // 2:
            return None
        t, x = result.t, result.x[:, :n]
        span, tolerated = t[-1] - t[0], request.atol[:n] + request.rtol * np.abs(x).max(axis=0)
        powers = np.vander((t - t[0]) / span, 4)
        missed = np.quantile(np.abs(x - powers @ np.linalg.lstsq(powers, x, rcond=None)[0]), MOST, axis=0)
        step = abs(span) / (len(t) - 1)
        if not (missed <= MISSED * tolerated).all() or step * self._radius(t[-1], x[-1]) > STABLE:
            return None
        rates = self._rates(t, x)
        ways = np.abs(np.diff(rates, axis=0))
        to_and_fro = ways.sum(axis=0) > TO_AND_FRO * np.ptp(rates[[0, -1]], axis=0)
        weight = np.where(to_and_fro, ways.mean(axis=0) * step / np.maximum(tolerated, 1e-300), 0.0)
        k = int(weight.argmax())
        # The entries that go to and fro must be those that the errors of steps come from.
        return (k, step, float(ways[:, k].max())) if weight[k] > 1e-3 else None

    def _slides(self, result: Outcome, k: int) -> str:
        """Message where the motion slides along a jump that entry k passes; "" where it does not."""
        n, middle = self.request.n_state, len(result.t) // 2
        t, x = result.t, result.x[:, :n]
        span = t[-1] - t[0]
        powers = np.vander((t - t[0]) / span, 4)
        cubic = np.linalg.lstsq(powers, x, rcond=None)[0]
        here, goes = powers[middle] @ cubic, (np.array([3, 2, 1]) * powers[middle, 1:]) @ cubic[:3, k] / span
        off = x - powers @ cubic
        far = float(np.quantile(np.abs(off[:, k]), MOST))
        along = off[:, k] @ off / (off[:, k] @ off[:, k])  # how the others go with it, such as by constraints
        rows = here + np.outer([sign * far * a for a in (*ASIDE, ASIDE[0]) for sign in (-1, 1)], along)
        at = np.full(len(rows), t[middle])
        rates = self._rates(at, rows)[:, k].reshape(-1, 2)
        jumps = rates[:, 0] - rates[:, 1]
        if not (rates[:, 0] > goes).all() or not (rates[:, 1] < goes).all() or (rates[0] != rates[-1]).any():
            return ""
        if jumps.min() < LEFT * jumps.max():
            return ""
        about = self.module.metadata
        inputs = self.request.inputs.rows(at, rows).reshape(-1, len(about.inputs))
        jumping = [name for name, (below, above) in zip(about.inputs, inputs[-2:].T, strict=True)
                   if abs(above - below) > LEFT * 1e-3 * max(abs(above), abs(below))] if len(inputs) == len(rows) else []
        what = f"input {', '.join(jumping)}" if jumping else "a load or a function of the user"
        name = about.x[k]
        return (f"{what} chatters: the motion is driven onto a jump at {name} = {here[k]:.6g} from both sides, at rates of "
                f"{rates[0, 0] - goes:.3g} and {rates[0, 1] - goes:.3g} of its unit a second, and every step crosses it, "
                f"{len(t)} steps took {abs(span):.3g} s; make the jump smooth, for example by tanh({name}/eps) in place of "
                f"sign({name}) with a small eps, or end the motion there by an event with stop=True and go on with equations for "
                "what sticks")

    def _radius(self, t: float, x: np.ndarray) -> float:
        """The largest size of the eigenvalues of x_dot by x, from differences that cross no jump: to one side, the smaller."""
        change = 1e-7 * np.maximum(1.0, np.abs(x))
        n = len(x)
        rows = np.vstack([x, x + np.diag(change), x - np.diag(change)])
        rates = self._rates(np.full(2 * n + 1, t), rows)
        up, down = (rates[1:n + 1] - rates[0]) / change[:, None], (rates[0] - rates[n + 1:]) / change[:, None]
        smaller = np.where((np.linalg.norm(up, axis=1) <= np.linalg.norm(down, axis=1))[:, None], up, down)
        return float(np.abs(np.linalg.eigvals(smaller.T)).max(initial=0.0))

    def _rates(self, t: np.ndarray, x: np.ndarray) -> np.ndarray:
        inputs = self.request.inputs.rows(t, x) if len(self.request.inputs.constant) else ()
        return np.asarray(self.module.evaluate("rhs", t, x, self.request.p, inputs)).reshape(x.shape)
