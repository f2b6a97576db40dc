"""Motions that compiled code integrates together: what it reads and writes, and what has become of each of them."""

from __future__ import annotations

import time as clock
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from symdyn.errors import ArgumentError, SimulationInterrupted, SimulationWarning
from symdyn.runtime.batches.sensitivities import Columns, doubtful, held, without_effect
from symdyn.runtime.batches.solution import BatchSensitivity, BatchSolution
from symdyn.runtime.batches.starts import consistent_starts, projects
from symdyn.runtime.integrating.chatter import STEPS
from symdyn.runtime.integrating.compiled import FAR, PIECE, moved_far
from symdyn.runtime.integrating.events import not_seen
from symdyn.runtime.integrating.run_record import NOTED, STATUS, RunReport
from symdyn.runtime.integrating.sensitivities import zeros
from symdyn.runtime.integrating.stops import describe_stop
from symdyn.runtime.masses import negative_masses
from symdyn.runtime.memory import aligned

if TYPE_CHECKING:
    from symdyn.runtime.batches.arrays_there import ArraysThere
    from symdyn.runtime.gpu.arrays import RowsThere
    from symdyn.runtime.inputs.inputs import Inputs
    from symdyn.runtime.module import Module

LISTED = 3


@dataclass(frozen=True)
class Asked:
    """starts (n, n_x), params (n, n_p), inputs (n, n_in), of each (1, ...) where nothing varies.

    along          inputs over time, the same for all; None: there are none
    look           which events are looked for, (n_e,) of bool; event_spacing: of samples of them, s
    columns        of sensitivities; None: there are none
    there          of starts, params and inputs what lies on a device, too; None: nothing
    """

    n: int
    starts: np.ndarray
    params: np.ndarray
    inputs: np.ndarray
    times: np.ndarray
    span: tuple[float, float]
    rtol: float
    atol: np.ndarray
    max_step: float
    first_step: float
    along: Inputs | None
    look: np.ndarray
    event_spacing: float
    columns: Columns | None = None
    there: ArraysThere | None = None

    @property
    def looks(self) -> bool:
        """Whether any event is looked for."""
        return bool(self.look.any())


class Together:
    """Motions that are integrated together by compiled code, with its results.

    x (n, n_t, n_x), reports (n,), states (n, 2, n_x), doubts (n,)    what the code writes; columns of sensitivities stand behind
                              every state
    starts, params, lengths, atol   what it reads; not a number where a motion cannot begin, for which `wrong` has the reason
    alone                     which motions are integrated alone in any case, (n,) of bool
    """

    x: np.ndarray | RowsThere

    def __init__(self, module: Module, asked: Asked, x: RowsThere | None = None) -> None:
        """x: on a device; None: a new array here."""
        n, n_x = asked.n, module.metadata.sizes.x * (1 if asked.columns is None else 1 + asked.columns.n)
        self.module, self.asked = module, asked
        self.x = aligned((n, len(asked.times), n_x), np.nan) if x is None else x
        self.reports = np.zeros(n, dtype=np.dtype(RunReport))
        self.reports["status"] = STATUS.STEP_LIMIT
        self.states = np.full((n, 2, n_x), np.nan)
        self.doubts = np.zeros(n, dtype=np.intc)
        along = asked.along
        self.pieces = None if along is None else along.pieces
        self.stops = np.zeros(0) if along is None else np.sort(along.stops(asked.span))
        self.look = np.ascontiguousarray(asked.look if asked.looks else np.zeros(0), dtype=np.intc)
        rtol, self.atol = (asked.rtol, asked.atol[None, :]) if asked.columns is None else asked.columns.tolerances(
            asked.rtol, asked.atol)
        self.span = np.array([*asked.span, rtol, asked.first_step, asked.max_step])
        self.params, self.wrong = _real(module, asked)
        first = asked.inputs if self.pieces is None else self.pieces.at(np.array(asked.span[:1]))
        self.starts, self.lengths, astray = consistent_starts(module, asked.span[0], asked.starts, self.params, first, n)
        self.wrong |= astray
        self.alone = np.zeros(n, dtype=bool)
        if asked.columns is not None:
            self.alone |= held(module, asked.span[0], self.starts, self.params, asked.columns)
            self.starts = asked.columns.behind(self.starts)
        self.begun = clock.perf_counter()

    @property
    def taken_after(self) -> int:
        """Attempted steps after which a run of its own takes its events."""
        return STEPS if self.module.metadata.switches else PIECE

    def solution(self, library: Any, width: int, note: str, interrupted: bool, limit: int,
                 alone: Callable[[np.ndarray], BatchSolution]) -> BatchSolution:
        """Solution of the motions; those that took more than `limit` steps, or left their constraints, are integrated alone.

        Raises SimulationInterrupted where that was interrupted.
        """
        module, reports, n, columns = self.module, self.reports, self.asked.n, self.asked.columns
        x, matrix = self.x, None
        if columns is not None and isinstance(self.x, np.ndarray):
            x, matrix = columns.apart(self.x)
        success, counts = np.isin(reports["status"], (STATUS.DONE, STATUS.STOPPED)), _counts(reports)
        late = reports["status"] == STATUS.STEP_LIMIT
        doubts: dict[int, list[str]] = {}
        messages = {k: self.wrong.get(k) or _message(library, reports[k], self.states[k])
                    for k in np.flatnonzero(~success).tolist()}
        if late.any() and not interrupted:
            why = ("the right-hand side jumps, so that they may chatter" if module.metadata.switches else
                   "their steps may have become too short")
            note = f"{late.sum()} of {n} motions one by one: they took more than {limit} steps, and {why}"
        without_series = reports["status"] == STATUS.NO_SERIES
        if without_series.any() and not interrupted:
            note = f"{without_series.sum()} of {n} motions one by one: there is no Taylor series of some of their states"
        late |= without_series
        doubtful = self.doubts & (NOTED.UNRESOLVED if self.asked.event_spacing else NOTED.UNRESOLVED | NOTED.UNPROVED) != 0
        if doubtful.any() and not interrupted:
            note = f"{doubtful.sum()} of {n} motions one by one: quantities of their events vary too quickly to be resolved"
        late |= doubtful
        # A run of its own finds out what keeps a state from the constraints, or fails at an event.
        if projects(module) or self.asked.looks or columns is not None:
            late |= ~success
        if columns is not None:
            rows = self._rows()
            nothing, closer = without_effect(columns, rows), self.alone | self._doubtful(columns, rows)
            if self.x.shape[1] == 1 and projects(module):  # projection may have made something of a start
                closer |= nothing.any(axis=1)
            closer[list(self.wrong)] = False
            if closer.any() and not interrupted:
                note = (f"{closer.sum()} of {n} motions one by one: in them a parameter may cancel, a state may stay at a kink, "
                        "or constraints may not let a parameter change")
            late |= closer
            for k in np.flatnonzero(nothing.any(axis=1) & success & ~late).tolist():
                doubts.setdefault(k, []).append(zeros(module, [
                    name for name, zero in zip(columns.asked.names, nothing[k], strict=True) if zero]))
        late[list(self.wrong)] = False
        unseen = not_seen(module, self.asked.look, (), self.asked.event_spacing)
        for k in np.flatnonzero(~late).tolist() if unseen else ():
            doubts.setdefault(k, []).append(unseen)
        moved = np.flatnonzero((reports["largest_moved"] > FAR) & success)
        for k in moved[~late[moved]].tolist():
            far = moved_far(module.name, reports["largest_moved"][k], reports["t_moved"][k], columns is not None)
            doubts.setdefault(k, []).append(far)
        if late.any() and not interrupted:
            again = np.flatnonzero(late)
            single = alone(again)
            x[again], success[again] = single.x, single.success
            if matrix is not None:
                matrix[again] = single.sensitivity.matrix
            counts[again] = np.column_stack([single.n_steps, single.n_rejected])
            messages = {k: message for k, message in messages.items() if not late[k]}
            messages |= {int(again[k]): message for k, message in single.messages.items()}
            doubts |= {int(again[k]): list(texts) for k, texts in single.doubts.items()}
        warn(doubts, n)
        states = x if isinstance(x, np.ndarray) else x.array
        solution = BatchSolution(module.metadata, self.asked.times, states, success, dict(sorted(messages.items())), counts[:, 0],
                                 counts[:, 1], width, note, clock.perf_counter() - self.begun,
                                 None if columns is None or matrix is None else BatchSensitivity(
                                     module.metadata, columns.asked.names, matrix), doubts)
        if interrupted:
            raise SimulationInterrupted(solution, f"{module.name}: interrupted after {int(success.sum())} of {n} motions")
        return solution


    def _rows(self) -> np.ndarray:
        """Known states of every motion, (n, n_t, n_x): where only its end is kept, the start, too."""
        if isinstance(self.x, np.ndarray) and self.x.shape[1] > 1:
            return self.x
        starts = np.broadcast_to(self.starts, (self.asked.n, self.starts.shape[1]))
        return np.stack([starts, self.states[:, 0]], axis=1)

    def _doubtful(self, columns: Columns, rows: np.ndarray) -> np.ndarray:
        """Mask of the motions that a run of its own may warn of, (n,) of bool."""
        n, n_x, begin = self.asked.n, self.module.metadata.sizes.x, self.asked.span[0]
        starts = np.broadcast_to(self.starts[:, :n_x], (n, n_x))
        t = np.column_stack([np.full(n, begin), self.reports["t"]])
        x = np.stack([starts, self.states[:, 0, :n_x]], axis=1)
        inputs = self.asked.inputs[:, None, :] if self.pieces is None else self.pieces.at(t.ravel()).reshape(n, 2, -1)
        return doubtful(self.module, columns, rows, (t, x, np.broadcast_to(inputs, (n, 2, inputs.shape[2]))), self.params)


def _real(module: Module, asked: Asked) -> tuple[np.ndarray, dict[int, str]]:
    """The parameters, NaN in rows with masses that no body has, and what to say of these."""
    wrong = negative_masses(module, asked.params)
    if not wrong:
        return asked.params, wrong
    if len(asked.params) == 1:
        raise ArgumentError(wrong[0])
    params = asked.params.copy()
    params[list(wrong)] = np.nan
    return params, wrong


def _counts(reports: np.ndarray) -> np.ndarray:
    """Accepted steps and attempts given up, (n, 2)."""
    return np.column_stack([reports["n_steps"], reports["n_rejected"]])


def _message(library: Any, row: np.ndarray, states: np.ndarray) -> str:
    of, metadata = RunReport.from_buffer_copy(row.tobytes()), library.metadata
    if of.status == STATUS.STEP_LIMIT:
        return f"{metadata.name}: not finished"
    reason, bad = library.reason(of.reason), of.bad_index
    if of.status == STATUS.NO_CONSTANTS:
        return f"{metadata.name}: {reason}; check the parameters"
    failed = of.status in (STATUS.FIELD_FAILED, STATUS.STATE_NOT_FINITE)
    x = states[int(failed)]
    if of.status == STATUS.BAD_ARGUMENT:
        wrong = [name for name, value in zip(metadata.x, x, strict=True) if not np.isfinite(value)]
        return f"{metadata.name}: the start is not finite: {', '.join(wrong)}"
    why = {STATUS.FIELD_FAILED: reason, STATUS.STEP_TOO_SMALL: f"the step became too small ({of.h:.3g} s) for the tolerances",
           STATUS.STATE_NOT_FINITE: f"the derivative of {metadata.x[bad] if 0 <= bad < len(x) else 'the state'} is not finite"}
    return describe_stop(metadata, of.t_fail if failed else of.t, x,
                         why.get(of.status, f"the integrator does not go on (status {of.status})"))


def warn(doubts: Mapping[int, Sequence[str]], n: int) -> None:
    """Warns of some of n motions, if there are any; doubts: by their numbers."""
    lines = [f"{k}: {text}" for k, texts in sorted(doubts.items()) for text in texts]
    if lines:
        more = f"; and {len(lines) - LISTED} more" if len(lines) > LISTED else ""
        warnings.warn(f"of {n} motions {'; '.join(lines[:LISTED])}{more}", SimulationWarning, stacklevel=5)
