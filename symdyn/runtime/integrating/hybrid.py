"""Motions with rigid contacts that go from phase to phase in C, as far as they need nothing that has to be thought about.

The switches of symdyn.runtime.integrating.contacts in a plane, with Newton's law of impacts, of contacts whose rows do not depend
on each other, are made in C between phases of the compiled integrator. All else, such as several solutions, bouncing that ends
and failures, is left to Python, after which C goes on.
"""

from __future__ import annotations

import ctypes
import time as clock
from collections.abc import Sequence
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from symdyn.backend.c_records import codes_of, fields_of
from symdyn.backend.methods import METHODS as RECORDS
from symdyn.backend.right_side import RightSide
from symdyn.contact_kinds import CLUTCH
from symdyn.runtime import contact_laws as laws
from symdyn.runtime.building.compiler import find_compiler, require_compiler
from symdyn.runtime.building.shared import shared
from symdyn.runtime.integrating import slip_begins
from symdyn.runtime.integrating.compiled import FAR, Problem
from symdyn.runtime.integrating.mode_codes import KINDS
from symdyn.runtime.integrating.moreau_memory import Memory
from symdyn.runtime.integrating.outcome import Outcome, Request
from symdyn.runtime.integrating.run_record import Noted
from symdyn.runtime.integrating.stabilization import Corrections
from symdyn.thresholds import DEPENDENT, most_events

if TYPE_CHECKING:
    from symdyn.backend.metadata import ContactRecord
    from symdyn.runtime.building.library import CLibrary
    from symdyn.runtime.module import Module

CODES = SimpleNamespace(**codes_of("runtime/hybrid.h"))
# Methods whose steps need no look in between; the law of impacts that C knows.
METHODS, NEWTON = tuple(m.name for m in RECORDS.values() if m.template in ("explicit", "radau")), "newton"
# Phases, and attempted steps, of one call.
MOST_PHASES, MOST_STEPS = 256, 20_000
CONTACTS, EVENTS, RHS, SHARED = "contacts", "events", "rhs", "contacts_shared"


class PhaseCode(ctypes.Structure):
    """Code that integrates phases; see c/runtime/phase_code_type.h."""

    _fields_ = fields_of("runtime/phase_code_type.h")


class Record(ctypes.Structure):
    """A motion; see c/runtime/hybrid_type.h."""

    _fields_ = fields_of("runtime/hybrid_type.h")
    t: float
    size: float
    begins: int
    n_fired: int
    n_written: int
    n_phases: int
    n_happened: int
    n_impacts: int


class Laws(NamedTuple):
    """Constants of the laws of contact, see symdyn.runtime.integrating.contacts, as the record calls them."""

    touching: float
    together: float
    missed: float
    no_speed: float
    energy: float
    shortest_flight: float
    resolved_flight: float
    lowest_flight: float
    resolved_approach: float


class Done(NamedTuple):
    """Results of one call of C: why it ended; of each phase its begin, end, parameters (n, n_p), modes (n, n_contacts), and by
    its end the numbers of output times, events and impacts; output times with states, events with their times and the states
    before and after them (n, 2, n_x), impacts with their times, impulses and velocities before and after them (n, 3, n_rows)."""

    code: int
    begin: list[float]
    end: list[float]
    p: np.ndarray
    modes: list[list[int]]
    written: list[int]
    happened_by: list[int]
    impacts_by: list[int]
    t: np.ndarray
    x: np.ndarray
    events: list[int]
    event_times: list[float]
    event_states: np.ndarray
    impact_times: list[float]
    impacts: np.ndarray
    outcome: Outcome


def of(module: Module, request: Request, method: object) -> Motion | None:
    """Motion of this kind in C; None where nothing of it could be made there."""
    inputs = request.inputs
    varies = inputs.function is not None or inputs.pieces is not None or inputs.motions is not None or inputs.are_held
    if (method not in METHODS or varies or len(inputs.kinks) or request.columns or request.times is None or request.step
            or request.max_steps is not None or request.stabilization.way == "baumgarte"
            or (request.look is not None and request.look.any())):
        return None
    method = str(method)
    motion: Motion | None = module._remembered(f"hybrid_{method}_{request.works}", lambda: _motion(module, method, request.works))
    return motion


def _motion(module: Module, method: str, works: bool) -> Motion | None:
    metadata = module.metadata
    plain = not metadata.switches and all(_is_plain(record, metadata.parameters) for record in metadata.contacts)
    return Motion(module, method, works) if plain and find_compiler() is not None else None


def _is_plain(record: ContactRecord, parameters: Sequence[str]) -> bool:
    """Whether C knows the switches of a contact."""
    return (record.tangents < 2 and record.kind != CLUTCH and (record.impact == NEWTON or not record.normal)
            and all(name in parameters for name in record.parameters))


class Motion:
    """The record in C of motions of a module, one after the other, for one thread."""

    def __init__(self, module: Module, method: str, works: bool) -> None:
        self.module = module
        metadata = module.metadata
        records, sizes = metadata.contacts, metadata.sizes
        self.fields = [RightSide(work=works, method=method, open_contacts=opened) for opened in (True, False)]
        self.n, self.n_x, self.n_state = len(records), sizes.x + works, sizes.x
        n, n_x, self.n_p = self.n, self.n_x, len(metadata.parameters)
        n_rows, n_events = sum(record.rows for record in records), len(metadata.events)
        self.library: Any = shared("hybrid", require_compiler())
        self.memory = memory = Memory()
        self.record = record = Record(
            n_q=sizes.q, n_u=sizes.u, n_state=sizes.x, n_x=n_x, n_p=self.n_p, n_contacts=n, n_rows=n_rows, n_events=n_events,
            most_steps=MOST_STEPS, most_phases=MOST_PHASES, most_happened=4 * MOST_PHASES + 2 * n_events,
            most_impacts=MOST_PHASES, noise=laws.NOISE, dependent=DEPENDENT, different=laws.DIFFERENT, kept=laws.KEPT, far=FAR,
            tolerated=slip_begins.TOLERATED, rounded=slip_begins.ROUNDED, shortest=slip_begins.SHORTEST,
            resolved=slip_begins.RESOLVED, guess=slip_begins.GUESS,
            longest=slip_begins.LONGEST, grows=slip_begins.GROWS, larger=slip_begins.LARGER, guesses=slip_begins.GUESSES)
        index = {name: k for k, name in enumerate(metadata.parameters)}
        record.shared_at = index[SHARED]
        events = {event.name: k for k, event in enumerate(metadata.events)}
        tables = {
            "first": np.cumsum([0, *[one.rows for one in records]])[:-1], "rows": [one.rows for one in records],
            "normal": [one.normal for one in records],
            "closed_at": [index.get(one.closed, -1) for one in records],
            "sticking_at": [index.get(one.sticking, -1) for one in records],
            "sliding_at": [index[one.sliding[0]] if one.sliding else -1 for one in records],
            "event": [events[f"{one.name}_{what}"] if what in one.events else -1 for one in records for what in KINDS]}
        for name, values in tables.items():
            memory.take(record, name, np.array(values, dtype=np.intc))
        take, put = memory.take, memory.put
        self.x, self.p, self.atol = take(record, "x", np.zeros(n_x)), take(record, "p", np.zeros(max(1, self.n_p))), take(
            record, "atol", np.zeros(n_x))
        self.mode, self.still, self.passed, self.fired, self.happened = (
            take(record, name, np.zeros(size, dtype=np.intc)) for name, size in (
                ("mode", n), ("still", n), ("passed", n), ("fired", n_events), ("happened", record.most_happened)))
        self.sign, self.left = take(record, "sign", np.zeros(n)), take(record, "left", np.full(n, -np.inf))
        self.slipping = take(record, "slipping", np.zeros(n, dtype=np.intc))
        put(record, np.intc, old_mode=n, old_still=n, old_passed=n, ruled_out=n, look=n_events, leaves=n)
        put(record, np.dtype(Noted), noted=most_events(n_events))
        put(record, float, old_sign=n, old_x=n_x, noted_states=most_events(n_events) * 2 * n_x,
            states=max(2 * n_x, n_rows), ahead=sizes.x + 2 * n)
        self.begin, self.end = (take(record, name, np.zeros(MOST_PHASES)) for name in ("phase_begin", "phase_end"))
        self.phase_p = take(record, "phase_p", np.zeros((MOST_PHASES + 1, self.n_p)))
        self.phase_mode = take(record, "phase_mode", np.zeros((MOST_PHASES, n), dtype=np.intc))
        self.written, self.happened_by, self.impacts_by = (
            take(record, name, np.zeros(MOST_PHASES, dtype=np.dtype("long")))
            for name in ("phase_written", "phase_happened", "phase_impacts"))
        self.happened_t = take(record, "happened_t", np.zeros(record.most_happened))
        self.happened_states = take(record, "happened_states", np.zeros((record.most_happened, 2, n_x)))
        self.impact_t = take(record, "impact_t", np.zeros(MOST_PHASES))
        self.impact = take(record, "impact", np.zeros((MOST_PHASES, 3, n_rows)))
        self.inputs = np.zeros(max(1, sizes.inputs))
        self.problems: list[Problem] = []
        self.constants: Laws | None = None
        self._functions()

    def _functions(self) -> None:
        """Functions that frames evaluate."""
        self.seen = np.zeros(1), np.zeros(max(1, self.n_state)), self.inputs
        self.memory.take(self.record, "t_now", self.seen[0])
        self.memory.take(self.record, "x_now", self.seen[1])
        ignored = any("ignored" in one.events for one in self.module.metadata.contacts)
        for name in (CONTACTS, *([EVENTS] if ignored else [])):
            self._frame(name, name, self.p)

    def _frame(self, member: str, function: str, p: np.ndarray) -> None:
        """A function of the module as a member of the record, with its constants."""
        library: Any = self.module.library(function)
        constants = self.memory.take(self.record, f"{member}_c", np.zeros(max(1, library.metadata.n_c)))
        setattr(self.record, f"n_{member}_c", library.metadata.n_c)
        prologue = f"{member}_prologue"
        setattr(self.record, prologue, ctypes.cast(library.function("prologue"), dict(Record._fields_)[prologue]))
        self.memory.frame(self.record, member, library, function, f"of_{member}", (*self.seen, p, constants))

    def _phase_code(self, library: CLibrary) -> ctypes.c_void_p:
        """The code of phases, of a library with an integrator."""
        code, keep = PhaseCode(n_constants=library.metadata.n_c), self.memory.kept
        members = {"prologue": "prologue", "start": "simulation_start", "go": "simulation_go", "look": "simulation_look",
                   "take": "simulation_events", "report": "simulation_report"}
        for member, function in members.items():
            setattr(code, member, ctypes.cast(library.function(function), dict(PhaseCode._fields_)[member]))
        size = library.function("simulation_size")
        size.restype = ctypes.c_long
        memory = np.zeros(size() // 8 + 16)
        code.memory = (memory.ctypes.data + 63) // 64 * 64
        p, c = (self.memory.take(code, name, np.zeros(max(1, count))) for name, count in (("p", self.n_p),
                                                                                          ("c", library.metadata.n_c)))
        problem = Problem(p.ctypes.data, c.ctypes.data, self.inputs.ctypes.data)
        code.problem = ctypes.addressof(problem)
        self.problems.append(problem)
        keep += [code, memory, problem, library]
        return ctypes.c_void_p(ctypes.addressof(code))

    def start(self, request: Request, constants: Laws, same: float) -> None:
        """Begin a run."""
        record = self.record
        self._attach()
        for problem in self.problems:
            problem.project, problem.length = int(request.stabilization.way == "projection"), request.stabilization.length
        self.p[:self.n_p], self.atol[:] = request.p, request.atol
        self.inputs[:len(request.inputs.constant)] = request.inputs.constant
        record.begin, record.end = request.span
        record.rtol, record.first_step, record.max_step = request.rtol, request.first_step, request.max_step
        record.spacing, record.same = request.event_spacing, same
        if constants != self.constants:
            self.constants = constants
            for name, value in constants._asdict().items():
                setattr(record, name, value)

    def _attach(self) -> None:
        """Take the code of phases that was compiled by now: nothing is compiled for what may never come."""
        for name, field in zip(("open", "closed"), self.fields, strict=True):
            if not getattr(self.record, name) and self.module._has(field):
                library: Any = self.module.library(field)
                setattr(self.record, name, self._phase_code(library))
        if not self.record.rate and self.module._has(RHS):
            self._frame("rate", RHS, self.memory.take(self.record, "rate_p", np.zeros(max(1, self.n_p))))

    def go(self, times: np.ndarray) -> Done:
        """Go on from the state in the record, writing states at times; the record has the state that it ends with."""
        record = self.record
        out = np.empty((len(times), self.n_x))
        record.times, record.out, record.n_times = times.ctypes.data, out.ctypes.data, len(times)
        record.n_written = record.n_phases = record.n_impacts = 0
        for name in ("n_steps", "n_rejected", "n_evaluations", "n_corrected", "n_corrections", "n_jacobians", "n_factorizations"):
            setattr(record, name, 0)
        record.largest_dq = record.largest_du = 0.0
        begun = clock.perf_counter()
        code = self.library.symdyn_hybrid_go(ctypes.byref(record))
        seconds = clock.perf_counter() - begun
        n, n_written, n_happened, n_impacts = record.n_phases, record.n_written, record.n_happened, record.n_impacts
        t, x = times[:n_written], out[:n_written] if 2 * n_written > len(out) else out[:n_written].copy()  # keeps no room
        outcome = Outcome(
            t, x, True, "reached the end", False, record.n_steps, record.n_rejected, record.n_evaluations, seconds,
            Corrections(record.largest_dq, record.largest_du, record.n_corrected, record.n_corrections),
            n_jacobians=record.n_jacobians, n_factorizations=record.n_factorizations, next_step=record.next_step)
        return Done(
            int(code), self.begin[:n].tolist(), self.end[:n].tolist(), self.phase_p[:n].copy(), self.phase_mode[:n].tolist(),
            self.written[:n].tolist(), self.happened_by[:n].tolist(), self.impacts_by[:n].tolist(), t, x,
            self.happened[:n_happened].tolist(), self.happened_t[:n_happened].tolist(), self.happened_states[:n_happened].copy(),
            self.impact_t[:n_impacts].tolist(), self.impact[:n_impacts].copy(), outcome)
