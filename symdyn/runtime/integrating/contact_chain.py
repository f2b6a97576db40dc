"""The way back over a motion with rigid contacts: phase by phase, and across the switches between them.

A phase ends at a switch whose equations go on smoothly beyond it, so that steps may end there as they do at the end of a run.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from symdyn.backend.methods import method_of
from symdyn.errors import EvaluationError
from symdyn.runtime.integrating.at_breaks import Breaks
from symdyn.runtime.integrating.contact_columns import Switch
from symdyn.runtime.integrating.contacts import HOLDING, HOLDS, numbers, rows_of, turning
from symdyn.runtime.integrating.outcome import Outcome, Request, accumulations
from symdyn.runtime.integrating.quadrature import Integral
from symdyn.runtime.integrating.way_back import Feedback, Way

if TYPE_CHECKING:
    from symdyn.runtime.module import Module


# Near the begin or end of a slip in space: a part of a phase by the time from there, the longest step by that time, and the
# longest one by the rate at which changes across the slip decay.
PART, LONGEST, CALM = 0.5, 0.25, 2.0
# Impacts before the end of infinitely many by less than this part of the time since the start of the motion are some of these.
NEAR = 1e-2
# A part that is shorter than this one of its time is not divided any more.
SHORTEST = 16 * np.finfo(float).eps


class ContactChain:
    """A motion with rigid contacts, back over it; switches: what was crossed, room: bytes up to which steps of a phase are kept.

    Raises EvaluationError for events besides those of contacts.
    """

    def __init__(self, module: Module, request: Request, method: str, carried: Sequence[str], outcome: Outcome,
                 switches: Sequence[Switch], room: float, breaks: Breaks | None = None) -> None:
        self.breaks = breaks
        self.module, self.request, self.method, self.carried = module, replace(request, look=None), method, tuple(carried)
        self.switches, self.room = switches, room
        self.indices = {name: k for k, name in enumerate(module.metadata.parameters)}
        self.step = min(LONGEST, request.rtol ** (1 / (method_of(method).order + 1)))
        self.end, self.rows = (float(outcome.t[-1]), outcome.x[-1]), (outcome.t, outcome.x)
        self.n_steps, self.memory = outcome.n_steps, outcome.t.nbytes + outcome.x.nbytes
        self.accumulated = accumulations(outcome, [record.name for record in module.metadata.contacts])
        self._check(outcome)

    def forth(self, integral: Integral | None = None) -> tuple[float, np.ndarray]:
        """The time and the state at the end; integral: what is measured along the motion."""
        if integral is not None:
            integral.over_rows(*self.rows, self.request.inputs.rows(*self.rows))
        return self.end

    def back(self, integral: Integral | None, weights: np.ndarray, by_time: Callable[[], float] | None = None) -> float:
        """Carry weights of the end to the start, in place; the integral."""
        value, until = 0.0, self.end[0]
        for index in reversed(range(len(self.switches))):
            switch = self.switches[index]
            if until > switch.t:
                ways = self._forth(switch, until, *self._zeros(index))
                for way in reversed(ways):
                    value += way.back(integral, weights)
                self.memory = max(self.memory, sum(way.memory for way in ways))
            until = switch.t
            self._across(switch, integral, weights)
        return value

    def _zeros(self, index: int) -> tuple[float | None, float | None]:
        """When slips in space began before the span after a switch, and when they come to their end after it; switches at which
        directions only turn lie between."""
        if self._is_held(self.switches[index]):
            return None, None
        began, ends = None, None
        for switch in reversed(self.switches[:index + 1]):
            if switch.zero is not None and switch.zero <= switch.t:
                began = switch.zero
            if switch.zero is not None or switch.events:
                break
        for switch in self.switches[index + 1:]:
            if switch.zero is not None and switch.zero > switch.t:
                ends = switch.zero
            if switch.zero is not None or switch.events:
                break
        return began, ends

    def _is_held(self, switch: Switch) -> bool:
        """Whether directions of friction are held after a switch."""
        return HOLDING in self.indices and bool(switch.p_after[self.indices[HOLDING]] >= HOLDS)

    def _forth(self, switch: Switch, until: float, began: float | None, ends: float | None) -> list[Way]:
        """From a switch to the next one; near the begin or end of a slip in space in parts whose steps follow how fast changes
        across it decay."""
        x, t, ways = switch.after, switch.t, list[Way]()
        while t < until:
            end, first, longest = until, self.request.first_step, self.request.max_step
            away = [abs(t - zero) for zero in (began, ends) if zero is not None]
            if away and PART * min(away) > SHORTEST * abs(t):
                end, first = min(until, t + PART * min(away)), 0.0
                rate = self._turning(t, x, switch.p_after)
                calm = CALM / rate if rate > 0 else np.inf
                longest = min(longest or np.inf, self.step * (1 - PART) * min(away), calm)
            part = replace(self.request, span=(t, end), x0=x, p=switch.p_after, times=None, max_step=longest, first_step=first)
            way = Way(self.module, part, self.method, self.carried, self.room, self.breaks)
            t, x = way.forth()
            ways.append(way)
        return ways

    def _turning(self, t: float, x: np.ndarray, p: np.ndarray) -> float:
        """The rate at which changes of slips in space across themselves decay, 1/s, the largest one."""
        at, records = numbers(self.module, t, x, p, self.request.inputs.at(t, x)), self.module.metadata.contacts
        result = [turning(at, list(rows[1:])) for rows, record in zip(rows_of(records), records, strict=True)
                  if record.tangents == 2 and p[self.indices[record.closed]] and not p[self.indices[record.sticking]]]
        return max(result, default=0.0)

    def _across(self, switch: Switch, integral: Integral | None, weights: np.ndarray) -> None:
        """Carry weights of the state after a switch to that before it, in place."""
        n_x = len(switch.before)
        followed = set(Feedback(self.module, self.request.inputs, ()).names)
        names = ["" if name in followed else name for name in self.carried]
        x = np.vstack([np.eye(n_x), np.zeros((len(names), n_x))])
        try:
            later, after = switch.along(switch.moves(x, [*[""] * n_x, *names]))
        except EvaluationError as error:
            raise EvaluationError(f"{self.module.name}: {error}{self._gathered(switch.t)}") from None
        row = after @ weights[:n_x]
        if integral is not None and later.any():
            t, states = np.full(2, switch.t), np.vstack([switch.before, switch.after])
            before, beyond = integral(t, states, self.request.inputs.rows(t, states)).values
            row += later * (before - beyond)
        weights[:n_x] = row[:n_x]
        weights[n_x:] += row[n_x:]

    def _gathered(self, t: float) -> str:
        """Addition to a message about impacts that accumulate near a time."""
        near = [end for _, _, end in self.accumulated if 0 <= end - t <= NEAR * (end - self.request.span[0])]
        return (f"; impacts accumulate near t = {near[0]:.6g} s: end the motion before them, or take simulate(..., "
                "sensitivities=[...]), which goes on with fewer digits") if near else ""

    def _check(self, outcome: Outcome) -> None:
        metadata = self.module.metadata
        records = metadata.contacts
        own = {f"{record.name}_{what}" for record in records for what in record.events}
        others = [metadata.events[k] for k in dict.fromkeys(one.event for one in outcome.happened)]
        strange = [one.name for one in others if one.name not in own and (one.reset or one.stop or metadata.switches)]
        if strange:
            raise EvaluationError(f"{self.module.name}: a gradient goes across the switches of contacts or across other events, "
                                  f"not both; {', '.join(strange)} happened as well: leave them out, events=False, or take "
                                  "simulate(..., sensitivities=[...])")
