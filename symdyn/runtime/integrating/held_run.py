"""Runs with inputs that are held: one run from instant to instant, each with constant inputs, put together.

Held inputs jump at the instants; a step across a jump would lose its order, and its error estimate. So every method ends its
steps there and goes on from the same state, without the earlier steps that it may build on, but with the length of the latest
one. An event whose quantity jumps past zero with the inputs happens at the instant.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from symdyn.errors import EvaluationError
from symdyn.runtime.inputs.inputs import Inputs
from symdyn.runtime.inputs.sampled import Replay, Sampling
from symdyn.runtime.integrating.chatter import SHRUNK, STEPS, STEPS_OF_SCIPY, chatter_of
from symdyn.runtime.integrating.events import Carried, Happened, Locator, ended
from symdyn.runtime.integrating.methods import is_compiled
from symdyn.runtime.integrating.outcome import Outcome, Request, of_pieces
from symdyn.runtime.integrating.stops import describe_stop
from symdyn.runtime.raised import InputRaised

if TYPE_CHECKING:
    from symdyn.runtime.module import Module

Part = Callable[[Request], Outcome]


def run_held(module: Module, request: Request, part: Part, method: Any) -> Outcome:
    """Integrate with held inputs.

    part     integrates a request whose inputs are not held
    method   the one that it integrates by
    An error that a controller raises ends the run; ArgumentError where it returns what does not fit.
    """
    # With "gauss" first_step is the length of all steps.
    return _Pieces(module, request, part, method == "gauss", STEPS if is_compiled(method) else STEPS_OF_SCIPY).through()


@dataclass
class _Pieces:
    module: Module
    request: Request
    part: Part
    one_length: bool
    between_looks: int  # steps, at least
    ts: list[np.ndarray] = field(default_factory=list)
    xs: list[np.ndarray] = field(default_factory=list)
    done: list[Outcome] = field(default_factory=list)
    jumped: list[Happened] = field(default_factory=list)  # events at jumps of inputs

    def __post_init__(self) -> None:
        self.inputs = self.request.inputs.held()  # those of the latest piece
        self.input_columns = np.zeros((len(self.inputs.constant), 0))
        self.carried: Carried | None = None  # of events, into the next piece
        self.chatter = chatter_of(self.module, self.request)
        self.n_steps = 0
        self.looked = 0  # at so many pieces, for chattering
        self.locator: Locator | None = None
        if self.request.look is not None and self.request.look.any():
            begin, end = self.request.span
            self.locator = Locator(self.module, self.request.p, self.request.look, lambda t, x: self.inputs.at(t, x),
                                   self.request.n_state, end - begin, self.request.event_spacing)

    def through(self) -> Outcome:
        """To the end, or as far as it gets."""
        request, inputs = self.request, self.request.inputs
        t, end = request.span
        last = end if request.times is None else float(request.times[-1])  # what is beyond is not requested
        x = request.x0
        holding: Replay | Sampling = Replay(inputs.record) if inputs.record is not None else \
            Sampling(inputs.samplers, inputs.constant, t, len(request.columns))
        message, cause, interrupted, over = "", None, False, False
        try:
            while True:
                n = request.n_state
                columns = x[n:n * (1 + len(request.columns))].reshape(-1, n)
                held, self.input_columns = holding.at(t, x[:n], columns)
                fired = self._switch(t, x, request.inputs.held(held))
                over = any(self.module.metadata.events[k].stop for k in fired)
                if over:
                    message = ended(self.module, fired[0], t)
                    break
                x = self._reset(fired, t, x)
                until = min(holding.after(t), end)
                until = end if end - until <= holding.close else until
                outcome = self._piece(t, until, x)
                if not outcome.success or self._over(outcome) or until >= last:
                    break
                self._carry(t, until, outcome)
                # Events at the very instant have not yet changed the state.
                x = next((one.after for one in reversed(outcome.happened) if one.t == until), outcome.x[-1])
                t = until
                chatters = self._chatters(t, x)
                if chatters:
                    message = describe_stop(self.module.metadata, t, x[:request.n_state], chatters)
                    break
                if request.max_steps is not None and self.n_steps >= request.max_steps:
                    why = f"{self.n_steps} steps were done, as asked"
                    message = describe_stop(self.module.metadata, t, x[:request.n_state], why)
                    break
        except KeyboardInterrupt:
            interrupted, message = True, describe_stop(self.module.metadata, t, x[:request.n_state], "interrupted")
        except InputRaised as error:
            message, cause = describe_stop(self.module.metadata, t, x[:request.n_state], str(error)), error.__cause__
        except EvaluationError as error:
            why = str(error).removeprefix(f"{self.module.name}: ")
            message, cause = describe_stop(self.module.metadata, t, x[:request.n_state], why), error.__cause__
        record = inputs.record if isinstance(holding, Replay) else holding.record
        return replace(self._whole(message, cause, interrupted, over), record=record)

    def _piece(self, t: float, until: float, x: np.ndarray) -> Outcome:
        """From one instant to the next; its rows that are wanted are kept."""
        request = self.request
        wanted, times = None, None
        if request.times is not None:
            first = not self.done
            wanted = request.times[(request.times > t if not first else request.times >= t) & (request.times <= until)]
            times = np.unique(np.concatenate([[t], wanted, [until]]))
        step = request.first_step if self.one_length or not self.done else self.done[-1].next_step
        left = None if request.max_steps is None else request.max_steps - self.n_steps
        outcome = self.part(replace(request, span=(t, until), times=times, x0=x, first_step=step, max_steps=left,
                                    inputs=self.inputs, carried=self.carried,
                                    input_columns=self.input_columns[request.inputs.indices]))
        rows = np.ones(len(outcome.t), dtype=bool)
        if wanted is not None:
            rows = np.isin(outcome.t, wanted)
            if len(rows) and (not outcome.success or self._over(outcome)):
                rows[-1] = True
        elif self.done and (self.carried is None or not self.carried.reset or np.array_equal(outcome.x[0], self.xs[-1][-1])):
            rows[:1] = False  # it is the end of the piece before
        self.ts.append(outcome.t[rows])
        self.xs.append(outcome.x[rows])
        self.done.append(outcome)
        self.n_steps += outcome.n_steps
        return outcome

    def _chatters(self, t: float, x: np.ndarray) -> str:
        """Message about a run that chatters; "" if it does not. Steps that instants cut short are no sign of it: looks are made
        where they are far shorter than the pieces, which may be too short to find it within one."""
        if self.chatter is None or self.n_steps - self.chatter.n_steps < self.between_looks:
            return ""
        short = self.n_steps - self.chatter.n_steps > (len(self.done) - self.looked) / SHRUNK
        self.looked = len(self.done)
        self.chatter.request = replace(self.request, inputs=self.inputs)
        return self.chatter(t, x, self.n_steps) if short else self.chatter.skip(t, self.n_steps)

    def _over(self, outcome: Outcome) -> bool:
        """Whether an event ended the motion."""
        return any(self.module.metadata.events[one.event].stop for one in outcome.happened)

    def _carry(self, begun: float, t: float, outcome: Outcome) -> None:
        """Note the sides of events at the end of a piece, for the next one, so that what vanishes at an instant counts once."""
        if self.locator is None:
            return
        near = max(self.locator.resolution, 16 * np.finfo(float).eps * abs(t))
        rates, left = np.full(len(self.locator.look), np.nan), np.zeros(len(self.locator.look))
        step, n, p = 1e-9 * (t - begun), self.request.n_state, self.request.p
        latest = [one for one in outcome.happened if t - one.t <= near]
        for one in latest:
            x = one.before[:n]
            xd = self.module.evaluate("rhs", one.t, x, p, self.inputs.at(one.t, x))
            there = self.locator.values(one.t, x)
            left[one.event] = there[one.event]
            rates[one.event] = (self.locator.values(one.t + step, x + step * xd) - there)[one.event] / step
        x = latest[-1].after if latest else outcome.x[-1]
        changed = any(self.module.metadata.events[one.event].reset for one in latest)
        self.carried = Carried(np.sign(self.locator.values(t, x)), rates, left, changed)

    def _switch(self, t: float, x: np.ndarray, inputs: Inputs) -> list[int]:
        """Go over to the inputs of the next piece. The events that happen because they jump, which are noted."""
        before, self.inputs = self.inputs, inputs
        if self.locator is None or self.carried is None:
            return []
        n = self.request.n_state
        right = np.sign(self.locator.values(t, x))
        if np.array_equal(before.at(t, x[:n]), inputs.at(t, x[:n])):
            return []
        left, known = self.carried.sides, np.isnan(self.carried.rates)
        fired = [int(k) for k in np.flatnonzero(self.locator.look & known & (left != 0) & (right != left))
                 if self.locator.direction[k] in (0, -left[k])]
        self.jumped += [Happened(k, t, x.copy(), x.copy()) for k in fired]
        sides = np.where(known & (right != 0), right, left)
        sides[fired] = -left[fired]
        self.carried = self.carried._replace(sides=sides)
        return fired

    def _reset(self, fired: list[int], t: float, x: np.ndarray) -> np.ndarray:
        """The state that the next piece begins with: after the resets of events at jumps of inputs."""
        records = self.module.metadata.events
        if fired and self.request.columns:
            raise EvaluationError(f"{self.module.name}: the event {records[fired[0]].name} happens because inputs jump, at an "
                                  "instant of a controller; sensitivities do not go across that")
        if self.locator is None or self.carried is None or not any(records[k].reset for k in fired):
            return x
        self.locator.fired = fired
        after = self.locator.after(t, x)
        assert after is not None  # one of them has a reset
        self.jumped[-len(fired):] = [one._replace(after=after) for one in self.jumped[-len(fired):]]
        self.carried = self.carried._replace(reset=True)
        return after

    def _whole(self, message: str, cause: BaseException | None, interrupted: bool, over: bool) -> Outcome:
        """All pieces as one; over: an event at a jump ended the motion."""
        t = np.concatenate(self.ts) if self.ts else np.array(self.request.span[:1])
        x = np.concatenate(self.xs) if self.xs else self.request.x0[None, :].copy()
        if not self.done:
            return Outcome(t, x, False, message, interrupted, 0, 0, 0, cause=cause)
        last = self.done[-1]
        if message and len(last.t) and (not len(t) or last.t[-1] > t[-1]):  # stopped at an instant that is no output time
            t, x = np.append(t, last.t[-1]), np.vstack([x, last.x[-1:]])
        happened = sorted([*self.jumped, *(e for o in self.done for e in o.happened)], key=lambda one: one.t)
        return replace(of_pieces(self.done, t, x, self.n_steps, message, cause, interrupted, over), happened=happened)
