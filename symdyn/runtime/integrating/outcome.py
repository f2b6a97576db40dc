"""Requests of simulations, and results of integrators."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple

import numpy as np

from symdyn.runtime.inputs.inputs import Inputs
from symdyn.runtime.inputs.sampled import Record
from symdyn.runtime.integrating.events import Carried, Happened
from symdyn.runtime.integrating.stabilization import Corrections, Stabilization


class Touched(NamedTuple):
    """Contacts in steps, one row for each contact and step: index of the step, indices of the contact, state (0 open, 1
    sticking, 2 sliding), values: gap and velocities (3) at its end, impulses (3), velocities (3) at its begin."""

    step: np.ndarray
    a: np.ndarray
    b: np.ndarray
    state: np.ndarray
    values: np.ndarray


@dataclass(frozen=True)
class Stepped:
    """A motion by time stepping.

    t, h       begin and length of every step, (n,)
    row        number of steps done at every stored row, (n_t,)
    touched    see Touched
    losses     energy that contacts have taken up to every stored row, J, (n_t, n_contacts)
    residual   the largest velocity by which a law was missed, m/s; depth: the largest overlap, m
    missed     the same velocity in every step, (n,), from the velocities at its end
    estimate   largest difference of the coordinates from the run with twice the steps' length; NaN: there was no such run
    """

    t: np.ndarray
    h: np.ndarray
    row: np.ndarray
    touched: Touched
    losses: np.ndarray
    residual: float
    depth: float
    missed: np.ndarray
    estimate: float = math.nan


class Phase(NamedTuple):
    """A part of a motion in one mode of every rigid contact: from when on, the parameters that hold them, the modes."""

    t: float
    p: np.ndarray
    modes: tuple[str, ...]


class Impact(NamedTuple):
    """An impact: when, the impulses along the rows of all contacts (n,), N s, and their velocities before and after it; rest:
    contacts that no longer leave, with the time at which their flights have come to their end."""

    t: float
    impulses: np.ndarray
    before: np.ndarray
    after: np.ndarray
    rest: Mapping[int, float] = {}


@dataclass(frozen=True)
class Request:
    """A simulation to do; times None: store every step. max_step and first_step 0: chosen by the integrator.

    n_state   entries of x0 that are the mechanism's state; one more may be the work of the loads
    look      which of the module's events are looked for, (n_e,) of bool; None: the module has none
    stabilization   what keeps the state on its constraints
    carried   of events, where the run goes on from the end of another one
    event_spacing   of the samples of events at the most, s; 0: as they vary
    input_columns   derivatives of inputs that are held along the columns, (n_held, n_columns)
    step      of time stepping, s; 0: halved until the tolerances are met; of other methods: what switches of contacts may come
              faster than no more than for a while, 0: as fast as they come
    columns, held, followed   of sensitivities behind the state in x0, see symdyn.backend.right_side.RightSide
    """

    span: tuple[float, float]
    times: np.ndarray | None
    x0: np.ndarray
    p: np.ndarray
    inputs: Inputs
    rtol: float
    atol: np.ndarray
    max_step: float
    first_step: float
    max_steps: int | None
    n_state: int
    stabilization: Stabilization = field(default_factory=Stabilization)
    look: np.ndarray | None = None
    carried: Carried | None = None
    event_spacing: float = 0.0
    columns: tuple[str, ...] = ()
    held: tuple[str, ...] = ()
    followed: tuple[str, ...] = ()
    input_columns: np.ndarray = field(default_factory=lambda: np.zeros((0, 0)))
    step: float = 0.0

    @property
    def works(self) -> bool:
        """Whether the last entry of x0 is the work of the loads."""
        return len(self.x0) > self.n_state * (1 + len(self.columns))

    @property
    def field_p(self) -> np.ndarray:
        """Parameters of the right-hand side: Baumgarte's gain is one more, so are derivatives of inputs that are held."""
        if self.held:
            return np.append(self.p, self.input_columns.T.ravel())
        return np.append(self.p, self.stabilization.gain) if self.stabilization.way == "baumgarte" else self.p

    def with_work(self) -> Request:
        """The same with one more state, the work of the loads, under the largest absolute tolerance."""
        return replace(self, x0=np.append(self.x0, 0.0), atol=np.append(self.atol, self.atol.max(initial=self.rtol)))


@dataclass(frozen=True)
class Outcome:
    """Result of an integration: t (n_t,), x (n_t, n_x), whether the end was reached, and if not when, where and why.

    happened   events in order, see runtime.events
    doubts     what to warn of in a run that went on; warned: what was warned of on the way
    cause      what a function of the user raised, if that ended the run
    no_series  why the right-hand side, which can be evaluated, has no Taylor series where the run stopped, if that ended it
    next_step  length of the step that would be tried next, s; 0: not known
    record     inputs as controllers held them; None: without controllers
    phases, impacts   of rigid contacts; row_phases: index of the phase of every row, (n_t,)
    stepped    what contacts did in a run by time stepping
    """

    t: np.ndarray
    x: np.ndarray
    success: bool
    message: str
    interrupted: bool
    n_steps: int
    n_rejected: int
    n_evaluations: int
    seconds: float | None = None
    corrections: Corrections = field(default_factory=Corrections)
    happened: Sequence[Happened] = ()
    n_jacobians: int = 0
    n_factorizations: int = 0
    doubts: Sequence[str] = ()
    warned: Sequence[str] = ()
    cause: BaseException | None = None
    no_series: str = ""
    next_step: float = 0.0
    record: Record | None = None
    phases: Sequence[Phase] = ()
    impacts: Sequence[Impact] = ()
    row_phases: np.ndarray = field(default_factory=lambda: np.zeros(0, dtype=int))
    stepped: Stepped | None = None


def of_pieces(done: Sequence[Outcome], t: np.ndarray, x: np.ndarray, n_steps: int, message: str, cause: BaseException | None,
              interrupted: bool, over: bool, **more: Any) -> Outcome:
    """A motion that was integrated piece by piece, as one: counts are sums, what else there is that of the last piece.

    message   why it ended, if not with the last piece; over: an event that stops ended it; more: further members
    """
    last = done[-1]
    if len(done) > 1:
        corrections = [o.corrections for o in done]
        seconds = [o.seconds for o in done if o.seconds is not None]
        more |= {
            "n_rejected": sum(o.n_rejected for o in done), "n_evaluations": sum(o.n_evaluations for o in done),
            "seconds": sum(seconds) if seconds else None,
            "corrections": Corrections(max(c.position for c in corrections), max(c.speed for c in corrections),
                                       sum(c.n_steps for c in corrections), sum(c.n_evaluations for c in corrections)),
            "n_jacobians": sum(o.n_jacobians for o in done), "n_factorizations": sum(o.n_factorizations for o in done),
            "doubts": (*more.get("doubts", ()), *next((o.doubts for o in done if o.doubts), ()))}
    elif "doubts" in more:
        more["doubts"] = (*more["doubts"], *last.doubts)
    return replace(
        last, t=t, x=x, success=last.success and (over or not message), message=message or last.message,
        interrupted=interrupted or last.interrupted, n_steps=n_steps, cause=cause or last.cause, **more)


def accumulations(outcome: Outcome, names: Sequence[str]) -> list[tuple[str, float, float]]:
    """Where impacts accumulated: the contact, by names of all, the last impact, and when its flights come to their end."""
    return [(names[k], one.t, end) for one in outcome.impacts for k, end in one.rest.items() if end > one.t]
