"""The way back over a motion with rigid contacts: phase by phase, and across the switches between them.

A phase ends at a switch whose equations go on smoothly beyond it, so that steps may end there as they do at the end of a run.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from symdyn.errors import EvaluationError
from symdyn.runtime.contact_laws import SLIDING, STICKING
from symdyn.runtime.integrating.at_breaks import Breaks
from symdyn.runtime.integrating.contact_columns import Switch
from symdyn.runtime.integrating.contacts import HOLDING, HOLDS
from symdyn.runtime.integrating.outcome import Outcome, Request, accumulations
from symdyn.runtime.integrating.quadrature import Integral
from symdyn.runtime.integrating.way_back import Feedback, Way

if TYPE_CHECKING:
    from symdyn.runtime.module import Module


class ContactChain:
    """A motion with rigid contacts, back over it; switches: what was crossed, room: bytes up to which steps of a phase are kept.

    Raises EvaluationError for events besides those of contacts, and for slips in space that begin or end.
    """

    def __init__(self, module: Module, request: Request, method: str, carried: Sequence[str], outcome: Outcome,
                 switches: Sequence[Switch], room: float, breaks: Breaks | None = None) -> None:
        self.breaks = breaks
        self.module, self.request, self.method, self.carried = module, replace(request, look=None), method, tuple(carried)
        self.switches, self.room = switches, room
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
        for switch in reversed(self.switches):
            if until > switch.t:
                part = replace(self.request, span=(switch.t, until), x0=switch.after, p=switch.p_after, times=None)
                way = Way(self.module, part, self.method, self.carried, self.room, self.breaks)
                way.forth()
                value += way.back(integral, weights)
                self.memory = max(self.memory, way.memory)
            until = switch.t
            self._across(switch, integral, weights)
        return value

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
        """What to add of impacts that accumulate near a time."""
        near = [begin for _, begin, end in self.accumulated if begin <= t <= end]
        return f"; impacts accumulate near t = {near[0]:.6g} s: end the motion before them" if near else ""

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
        holds = metadata.parameters.index(HOLDING) if HOLDING in metadata.parameters else 0
        held = [phase.modes for phase in outcome.phases if HOLDING in metadata.parameters and phase.p[holds] >= HOLDS]
        turned = [record.name for k, record in enumerate(records) if record.tangents == 2 and (any(
            {a.modes[k], b.modes[k]} == {SLIDING, STICKING} for a, b in pairwise(outcome.phases)) or any(
            modes[k] == SLIDING for modes in held))]
        if turned:
            raise EvaluationError(f"{self.module.name}: contact {', '.join(turned)} begins or ceases to slip in space, where "
                                  "steps back over the direction of friction are not accurate; take "
                                  "simulate(..., sensitivities=[...])")
