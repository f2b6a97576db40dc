"""Time stepping with contacts: steps of one length, in C, with the laws of contact and friction solved for impulses in each."""

from __future__ import annotations

import ctypes
import time as clock
from dataclasses import replace
from types import SimpleNamespace
from typing import TYPE_CHECKING, Any

import numpy as np

from symdyn.backend.c_records import codes_of
from symdyn.backend.right_side import RightSide
from symdyn.contact_kinds import CLUTCH, FRICTION
from symdyn.errors import ArgumentError
from symdyn.runtime.building.compiler import require_compiler
from symdyn.runtime.building.shared import shared
from symdyn.runtime.inputs.inputs import Inputs
from symdyn.runtime.integrating.contacts import SHARED, SOFTNESS, not_stepped
from symdyn.runtime.integrating.mode_codes import MODES, SLIDING_CODE, STICKING_CODE
from symdyn.runtime.integrating.moreau_groups import SPHERES, add_groups, n_speeds, room_of
from symdyn.runtime.integrating.moreau_memory import MOST_DENSE, Cones, Memory, Moreau, cones
from symdyn.runtime.integrating.outcome import Outcome, Phase, Request, Stepped, Touched
from symdyn.runtime.integrating.stops import describe_stop
from symdyn.runtime.memory import demand
from symdyn.shown import shown

if TYPE_CHECKING:
    from symdyn.runtime.building.library import CLibrary
    from symdyn.runtime.module import Module

MOREAU = "moreau"
GAPS, DIRECTIONS = "contact_gaps", "contact_directions"
STATUS = SimpleNamespace(**codes_of("runtime/moreau.h"))
KINDS = {CLUTCH: STATUS.SPEED, FRICTION: STATUS.BOUNDED}
# Tolerances below this part are out of reach of a method whose impacts are of first order.
FINEST = 1e-7
# Steps of the first of the runs whose steps are halved, and at most.
FIRST, MOST = 64, 2**21
# Halvings without half the difference, after which no more are tried.
PATIENCE = 3
# Steps in one call.
PIECE = 512
# Velocities by which the laws are missed, m/s, per m/s of the start; gaps, m.
TOLERANCE, DEPTH = 1e-12, 1e-12
MOST_SWEEPS, MOST_ROUNDS = 20_000, 60
# Change of the last round of a step, by the size of the state, above which the step is too long.
ACCEPTED = 1e-6
# The same in groups of more bodies than FEW, whose problems are solved by sweeps; where these do not get there, by Newton steps
# if no more than so many rows are closed.
FEW, LATE_DENSE = 12, 240
GROUP_TOLERANCE, GROUP_DEPTH = 3e-7, 1e-7
# Sweeps of a round, of one to which contacts were just added; rounds since then; contacts of all sweeps in a step.
GROUP_SWEEPS, GROUP_ROUGH, GROUP_ROUNDS, GROUP_UPDATES = 1000, 30, 10, 400_000
# Residuals and overlaps above this many tolerances are reported; those of groups.
REPORTED, GROUP_REPORTED = 1e3, 10
# Energy that contacts add in a step counts from this part of their work in it on, and is reported from this part of that in all.
GAINED, GAINED_IN_ALL = 1e-2, 1e-3


def check_moreau(module: Module, request: Request, stabilization: Any) -> None:
    """Raise ArgumentError for what time stepping does not take; stabilization: as it was given."""
    name, metadata = module.name, module.metadata
    if module.backend != "c":
        raise ArgumentError(f"{name}: method='moreau' steps in compiled C; this module runs on {module.backend}. Compile with "
                            "backend='c', or leave out the method, which locates every switch of the contacts")
    if not metadata.contacts and not metadata.contact_groups:
        raise ArgumentError(f"{name}: method='moreau' is for rigid contacts, of which there are none; pass another method, or "
                            "add_contact")
    faults = not_stepped(metadata.contacts)
    if faults:
        raise ArgumentError(f"{name}: {'; '.join(faults)}")
    if request.span[1] < request.span[0]:
        raise ArgumentError(f"{name}: rigid contacts lose energy, so that motions with them do not run backward in time; pass an "
                            "end after the start")
    if not request.step and request.rtol < FINEST:
        raise ArgumentError(f"{name}: method='moreau' has steps of one length; pass step=1e-3 (in s), or a tolerance such as "
                            f"rtol=1e-3, by which steps are halved; found rtol = {request.rtol:g}, and impacts are of first "
                            f"order in the step, so that {FINEST:g} is the finest")
    if request.inputs.are_held:
        raise ArgumentError(f"{name}: controllers whose values are held between instants do not go with method='moreau'; pass "
                            "their law as an expression of the system, or as a function of (t, x)")
    if request.columns:
        raise ArgumentError(f"{name}: sensitivities do not go across the impacts of rigid contacts; leave them out")
    if stabilization not in (None, "projection"):
        raise ArgumentError(f"{name}: method='moreau' projects onto the constraints; leave out stabilization, found "
                            f"{shown(stabilization)}")
    if request.max_step or request.first_step:
        raise ArgumentError(f"{name}: method='moreau' has steps of one length; pass it as step, not as max_step or first_step")
    wanted = [] if request.look is None else [metadata.events[k].name for k in np.flatnonzero(request.look)]
    if wanted:
        raise ArgumentError(f"{name}: method='moreau' does not locate events, such as {wanted[0]}; pass events=False, or another "
                            "method")


def run_moreau(module: Module, request: Request, bar: Any = None) -> Outcome:
    """Integrate by time stepping, with steps of a given length, or halved until the coordinates agree within the tolerances."""
    begin, end = request.span
    if request.step:
        now = _run(module, request, request.step, bar)
        if request.step > end - begin > 0:
            doubt = (f"{module.name}: step = {request.step:g} s is longer than the motion of {end - begin:g} s, which was done "
                     "in one step; pass a step in which no body moves far")
            return replace(now, doubts=(*now.doubts, doubt))
        return now
    before: Outcome | None = None
    n, parts = FIRST, list[float]()
    while True:
        now = _run(module, request, (end - begin) / n, bar)
        if before is not None and now.success and before.success:
            off, part = _difference(module, request, before, now)
            assert now.stepped is not None
            now = replace(now, stepped=replace(now.stepped, estimate=off), n_steps=now.n_steps + before.n_steps)
            if part <= 1:
                return now
            parts.append(part)
            if len(parts) > PATIENCE and min(parts[-PATIENCE:]) > min(parts[:-PATIENCE]) / 2:
                doubt = (f"{module.name}: with steps of {(end - begin) / n:.3g} s the coordinates differ by {off:.3g} from those "
                         f"with twice the step, above rtol = {request.rtol:g}, and {PATIENCE} halvings of the step did not halve "
                         "the difference: the order of impacts changes with the step, as in piles of many bodies; pass step= and "
                         "compare what does not depend on single paths")
                return replace(now, doubts=(*now.doubts, doubt))
            if 2 * n > (request.max_steps or MOST):
                doubt = (f"{module.name}: with steps of {(end - begin) / n:.3g} s the coordinates differ by {off:.3g} from those "
                         f"with twice the step, above rtol = {request.rtol:g}; pass a larger rtol, more max_steps, or a method "
                         "that locates the impacts")
                return replace(now, doubts=(*now.doubts, doubt))
        elif before is not None and not now.success and 2 * n > (request.max_steps or MOST):
            return now
        if now.interrupted:
            return now
        before, n = now, 2 * n


def _difference(module: Module, request: Request, coarse: Outcome, fine: Outcome) -> tuple[float, float]:
    """Largest difference of the coordinates at common times, and that by the tolerances."""
    n_q = module.metadata.sizes.q
    rows = fine.x[:, :n_q] if len(fine.t) == len(coarse.t) else fine.x[::2, :n_q]
    off = np.abs(rows - coarse.x[:, :n_q]).max(axis=0, initial=0.0)
    size = np.abs(rows).max(axis=0, initial=0.0)
    allowed = request.atol[:n_q] + request.rtol * size
    return float(off.max(initial=0.0)), float((off / np.maximum(allowed, 1e-300)).max(initial=0.0))


def _steps(request: Request, step: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Begins and ends (n_parts,) of parts between which output times lie, and the number of steps in each."""
    begin, end = request.span
    marks = np.array([begin, end]) if request.times is None else np.unique(np.append(begin, request.times))
    lengths = np.diff(marks)
    counts = np.maximum(1, np.ceil(lengths / step * (1 - 1e-12))).astype(int)
    return marks[:-1], lengths / counts, counts


def _run(module: Module, request: Request, step: float, bar: Any) -> Outcome:
    """One run with steps of one length, a little shorter where output times want it."""
    starts, lengths, counts = _steps(request, step)
    total = int(counts.sum())
    demand(total * (len(request.x0) + 3), module.name, f"{total} steps of {step:g} s with {len(request.x0)} numbers at each",
           "pass a longer step")
    stepper = Stepper(module, request)
    every = request.times is None
    rows, times, done_at = [request.x0.copy()], [request.span[0]], [0]
    message, interrupted, status, ended = "reached the end", False, 0, ""
    limit = request.max_steps if request.step and request.max_steps is not None else total + 1
    begun = clock.perf_counter()
    try:
        for start, h, count in zip(starts, lengths, counts, strict=True):
            done = 0
            while done < count and not status:
                many = min(PIECE, int(count) - done, limit - len(stepper.h))
                if not many:
                    status, ended = 1, f"{limit} steps were done, as asked"
                    break
                status, part = stepper.go(start + done * h, h, many)
                if every:
                    rows += list(part)
                    times += [start + (done + k + 1) * h for k in range(len(part))]
                    done_at += [len(stepper.h) - len(part) + k + 1 for k in range(len(part))]
                done += len(part)
                if bar is not None:
                    bar.update(len(part) * h)
            if not every and not status:
                rows.append(stepper.x.copy())
                times.append(start + count * h)
                done_at.append(len(stepper.h))
            if status:
                break
    except KeyboardInterrupt:
        interrupted, status, ended = True, 1, "interrupted"
    if status:
        why = stepper.why(status) if status < 0 else ended
        message = describe_stop(module.metadata, stepper.now, stepper.x[:request.n_state], why)
    if request.times is not None:
        times = [request.span[0], *request.times[request.times > request.span[0]][:len(rows) - 1]]
        if request.times[0] > request.span[0]:
            rows, times, done_at = rows[1:], times[1:], done_at[1:]
    record = stepper.record
    touched, reached = stepper.touched(), np.array(done_at, dtype=int)
    stepped = Stepped(np.array(stepper.t), np.array(stepper.h), reached, touched,
                      _losses(module, touched, len(stepper.h))[reached],
                      max(stepper.missed, default=0.0), record.worst_depth, np.array(stepper.missed))
    doubts = [stepper.doubt(), stepper.gained(touched), stepper.passed()] if status >= 0 else []
    phases, row_phases = _phases(module, request, stepped)
    return Outcome(np.array(times), np.array(rows), not status, message, interrupted, len(stepper.h), 0, record.n_evaluations,
                   clock.perf_counter() - begun, doubts=tuple(filter(None, doubts)), cause=stepper.cause, stepped=stepped,
                   phases=phases, row_phases=row_phases)


def _losses(module: Module, touched: Touched, n_steps: int) -> np.ndarray:
    """Energy that contacts with a name, then groups, have taken until each step began, and in all, J, (n_steps + 1, n)."""
    n, groups = len(module.metadata.contacts), module.metadata.contact_groups
    of_body = np.repeat(np.arange(len(groups)), [len(group.bodies) for group in groups])
    index = touched.a.astype(int)
    index[touched.b >= 0] = n + of_body[touched.a[touched.b >= 0]]
    end, impulse, begin = (touched.values[:, k:k + 3] for k in (1, 4, 7))
    lost = np.zeros((n_steps + 1, n + len(groups)))
    np.add.at(lost, (touched.step + 1, index), -((begin + end) * impulse).sum(axis=1) / 2)
    return np.cumsum(lost, axis=0)


def modes_of(stepped: Stepped, n: int) -> np.ndarray:
    """Whether contacts with a name are open, sticking or sliding in every step, (n_steps, n)."""
    result = np.zeros((len(stepped.h), n), dtype=int)
    touched = stepped.touched
    named = touched.b < 0
    result[touched.step[named], touched.a[named]] = touched.state[named]
    return result


def _phases(module: Module, request: Request, stepped: Stepped) -> tuple[list[Phase], np.ndarray]:
    """The modes of all contacts, and their parameters, of the step before every row; of the first row that after it."""
    records, names = module.metadata.contacts, module.metadata.parameters
    n = len(records)
    steps = np.maximum(stepped.row - 1, 0)
    modes, slips = modes_of(stepped, n), np.zeros((len(stepped.h), n, 2))
    touched = stepped.touched
    named = touched.b < 0
    rows = touched.values[named]
    bounded = np.array([not record.normal for record in records], dtype=bool)[touched.a[named]]
    slips[touched.step[named], touched.a[named]] = np.where(bounded[:, None], rows[:, 1:3], rows[:, 2:4])
    sizes = np.linalg.norm(slips, axis=2, keepdims=True)
    along = np.where((modes == SLIDING_CODE)[:, :, None] & (sizes > 0), slips / np.where(sizes > 0, sizes, 1.0), 0.0)
    phases: list[Phase] = []
    indices, latest = [], None
    for k in steps.tolist() if len(stepped.h) else []:
        here = (modes[k].tobytes(), along[k].tobytes())
        if here != latest:
            p = request.p.copy()
            for record, mode, direction in zip(records, modes[k].tolist(), along[k], strict=True):
                closed, sticking = [mode != 0] * bool(record.closed), [mode == STICKING_CODE] * bool(record.sticking)
                values = [*closed, *sticking, *direction[:record.tangents]]
                for name, value in zip(record.parameters, values, strict=True):
                    p[names.index(name)] = value
            if n:
                p[names.index(SHARED)] = SOFTNESS * (np.count_nonzero(modes[k]) > 1)
            phases.append(Phase(float(stepped.t[k]), p, tuple(MODES[mode] for mode in modes[k].tolist())))
            latest = here
        indices.append(len(phases) - 1)
    return phases, np.array(indices, dtype=int)


class Stepper:
    """The records in C of one run, and what it has done so far."""

    def __init__(self, module: Module, request: Request) -> None:
        self.module, self.request = module, request
        metadata = module.metadata
        sizes = metadata.sizes
        self.x = request.x0.copy()
        self.now, self.step = request.span[0], 0.0
        self.t: list[float] = []
        self.h: list[float] = []
        self.parts: list[Touched] = []
        self.missed: list[float] = []
        self.raised: list[BaseException] = []
        self.memory = memory = Memory()
        n_x, n_in = len(request.x0), sizes.inputs
        first = np.cumsum([0, *[c.rows for c in metadata.contacts]])
        n_given, n_rows = len(metadata.contacts), int(first[-1])
        groups = metadata.contact_groups
        self.record = record = Moreau(n_q=sizes.q, n_u=sizes.u, n_x=n_x, n_in=n_in, n_given=n_given, n_rows=n_rows)
        self._frames(n_x, n_in)
        most, entries = n_given, n_given * sizes.u
        if groups:
            add_groups(module, record, memory)
            most += room_of(groups)
            entries += 2 * n_speeds(groups) * room_of(groups)
        many = record.n_bodies > FEW
        self.cones: Cones = cones(memory, sizes.u, most, entries, min(LATE_DENSE if many else MOST_DENSE, 3 * most))
        self.cones.late = int(many)
        self.library = shared("moreau", require_compiler())
        index_type = np.dtype("long")
        memory.take(record, "given_first", first.astype(index_type))
        memory.take(record, "given_kind", np.array([*(KINDS.get(c.kind, STATUS.PLACED) for c in metadata.contacts), 0],
                                                   dtype=np.intc))
        coordinates = metadata.names("q")
        index = {q: k for k, q in enumerate(coordinates)}
        record.n_units = len(metadata.unit_groups)
        memory.take(record, "unit_first", np.cumsum([0, *map(len, metadata.unit_groups)]).astype(index_type))
        memory.take(record, "unit_index",
                    np.array([*(index[q] for group in metadata.unit_groups for q in group), 0], dtype=index_type))
        listed = ("a", "b", "was_a", "was_b", "was_at", "sum_a", "sum_b", "old_a", "old_b")
        memory.put(record, index_type, **dict.fromkeys(listed, most), old_from=record.n_bodies + 1)
        memory.put(record, np.intc, old_state=most, broken=most)
        memory.put(record, float, given_was=2 * n_given, work=8 * n_x, at_end=4 * most, basis=9 * most,
                   **dict.fromkeys(("P_old", "P_guess", "incoming"), 3 * most))
        record.tolerance = TOLERANCE * max(1.0, float(np.abs(self.x[sizes.q:sizes.q + sizes.u]).max(initial=0.0)))
        record.depth = DEPTH * max(1.0, float(np.abs(self.x[:sizes.q]).max(initial=0.0)))
        record.length = request.stabilization.length or 1.0
        record.most_sweeps, record.most_rounds, record.accepted = MOST_SWEEPS, MOST_ROUNDS, ACCEPTED
        record.step_updates, self.reported = np.iinfo(np.dtype("long")).max, REPORTED
        if many:
            record.tolerance, record.depth, self.reported = GROUP_TOLERANCE, GROUP_DEPTH, GROUP_REPORTED
            record.most_sweeps, record.rough_sweeps = GROUP_SWEEPS, GROUP_ROUGH
            record.most_rounds, record.step_updates = GROUP_ROUNDS, GROUP_UPDATES

    def _frames(self, n_x: int, n_in: int) -> None:
        """Functions that the record calls."""
        record, memory, request, module = self.record, self.memory, self.request, self.module
        t, x, inputs = np.zeros(1), np.zeros(max(1, n_x)), np.zeros(max(1, n_in))
        for name, values in (("t", t), ("x", x), ("inputs", inputs)):
            memory.take(record, name, values)
        inputs[:n_in] = request.inputs.constant
        named = bool(module.metadata.contacts)
        field: Any = module.library(RightSide(work=request.works, open_contacts=named))
        contacts: Any = module.library(GAPS if named else SPHERES)
        seen = (t, x, inputs)

        def add(member: str, library: CLibrary, function: str, result: str) -> np.ndarray:
            return memory.function(record, member, library, function, result, seen, request.p)

        add("field", field, "rhs", "xd")
        if named:
            add("gaps", contacts, GAPS, "gap")
            add("directions", contacts, DIRECTIONS, "direction")
        if module.metadata.contact_groups:
            add("spheres", contacts, SPHERES, "sphere")
        if module.metadata.constraints:
            record.n_c = len(module.metadata.constraints)
            add("position", field, "position_correction", "position_change")
            add("velocity", field, "velocity_correction", "velocity_change")
        if _varies(request.inputs):
            record.function = self._input_function(n_x, n_in)

    def _input_function(self, n_x: int, n_in: int) -> Any:
        free = self.request.inputs

        def call(t: float, x: Any, out: Any) -> int:
            try:
                state = np.ctypeslib.as_array(x, (n_x,))[:self.request.n_state].copy()
                np.ctypeslib.as_array(out, (n_in,))[:] = free.at(t, state)
                return 0
            except BaseException as error:
                self.raised.append(error)
                return 1

        made = dict(Moreau._fields_)["function"](call)
        self.memory.kept.append(made)
        return made

    def go(self, t: float, h: float, n: int) -> tuple[int, np.ndarray]:
        """At most n steps from t: the status and the states after them."""
        most, self.step = max(1, int(self.cones.most)), h
        room = most * max(2, min(n, 200_000 // most + 2))
        out, ends = np.zeros((n, len(self.x))), np.zeros(n, dtype=np.dtype("long"))
        indices, values, missed = np.zeros((room, 3), dtype=np.dtype("long")), np.zeros((room, 10)), np.zeros(n)
        done, span = ctypes.c_long(0), np.array([t, h])
        status = self.library.symdyn_moreau_go(
            ctypes.byref(self.record), ctypes.byref(self.cones), *[ctypes.c_void_p(a.ctypes.data) for a in (span, self.x)],
            ctypes.c_long(n), *[ctypes.c_void_p(a.ctypes.data) for a in (out, ends, indices, values, missed)],
            ctypes.c_long(room), ctypes.byref(done))
        k = done.value
        number = int(ends[k - 1]) if k else 0
        self.now = t + k * h
        per_step = np.diff(np.append(0, ends[:k]))
        a, b, state = indices[:number].T.copy()
        self.parts.append(Touched(len(self.h) + np.repeat(np.arange(k), per_step), a, b, state, values[:number].copy()))
        self.missed += missed[:k].tolist()
        self.t += [t + i * h for i in range(k)]
        self.h += [h] * k
        if self.raised and isinstance(self.raised[0], KeyboardInterrupt):
            raise self.raised[0]
        return int(status), out[:k]

    def touched(self) -> Touched:
        """Contacts in all steps."""
        none = np.zeros(0, dtype=int)
        parts = [Touched(none, none, none, none, np.zeros((0, 10))), *self.parts]
        step, a, b, state, values = (np.concatenate(rows) for rows in zip(*parts, strict=True))
        return Touched(step, a, b, state, values)

    @property
    def cause(self) -> BaseException | None:
        """Error that a function of inputs raised."""
        return (self.raised[0].__cause__ or self.raised[0]) if self.raised else None

    def doubt(self) -> str:
        """Warning of remaining residuals and overlaps, if they are larger than intended."""
        record = self.record
        most, missed = self.reported * record.tolerance, np.array(self.missed)
        if missed.max(initial=0.0) > most:
            at = f"in {np.count_nonzero(missed > most)} of {len(missed)} steps by more than {most:.0e} m/s"
            advice = ("compare the motion with one of half the step, and use what agrees" if record.rough_sweeps else
                      "its contact problem has no solution, or none that the iteration reaches; shorter steps or less friction")
            return (f"{self.module.name}: the laws of contact and friction are missed by up to {missed.max():.3g} m/s in a step, "
                    f"{at}: {advice}")
        if record.worst_depth > self.reported * record.depth:
            return (f"{self.module.name}: bodies overlap by up to {record.worst_depth:.3g} m at the end of a step, which "
                    "no motion of theirs undoes: contacts that exclude each other, or a step that is too long")
        return ""

    def gained(self, touched: Touched) -> str:
        """Energy that impacts added, if it is more than residuals and errors of the step."""
        end, impulse, begin = (touched.values[:, k:k + 3] for k in (1, 4, 7))
        works = np.array([((begin + end) * impulse).sum(axis=1) / 2,
                          (abs((begin * impulse).sum(axis=1)) + abs((end * impulse).sum(axis=1))) / 2,
                          self.reported * self.record.tolerance * np.linalg.norm(impulse, axis=1)])
        added, size, noise = (np.bincount(touched.step, rows, len(self.h)) for rows in works)
        counts = added > np.maximum(GAINED * size, noise)
        if not added[counts].sum() > GAINED_IN_ALL * size.sum():
            return ""
        first = self.t[int(np.argmax(counts))]
        return (f"{self.module.name}: impacts add {added[counts].sum():.3g} J in {np.count_nonzero(counts)} of {len(counts)} "
                f"steps, up to {added.max():.3g} J in a step, the first at t = {first:.6g} s, as Newton's law may with friction "
                "or several contacts in a step; pass a shorter step or less restitution, or locate impacts, where all contacts "
                "have a name, with impact='poisson'")

    def passed(self) -> str:
        """Bodies that a step took through each other, if there are any."""
        record = self.record
        if not record.passed:
            return ""
        if record.passed_b < 0:
            contact = self.module.metadata.contacts[record.passed_a].name
            return (f"{self.module.name}: the bodies of contact {contact} passed through each other, since they move too far in "
                    f"a step, the first time in the step from t = {record.passed_at:.6g} s on; pass a shorter step")
        bodies = [body for group in self.module.metadata.contact_groups for body in group.bodies]
        return (f"{self.module.name}: bodies passed through each other, since they move too far in a step; the first are "
                f"{bodies[record.passed_a]} and {bodies[record.passed_b]} in the step from t = {record.passed_at:.6g} s on; pass "
                "a step in which bodies move by less than their radius")

    def why(self, status: int) -> str:
        """The reason of a failure."""
        field = "the right-hand side cannot be evaluated"
        return {
            STATUS.MOREAU_FIELD: field, STATUS.MOREAU_NOT_FINITE: "the state is not finite; pass a shorter step",
            STATUS.MOREAU_CONTACT: "gaps or directions of contacts cannot be evaluated",
            STATUS.MOREAU_LONG_STEP: f"the equations of a step of {self.step:g} s are not solved by iteration: it is too long "
                                     "for the stiffness of the mechanism; pass a shorter step",
            STATUS.MOREAU_CONSTRAINTS: "there is no way back onto the constraints; pass a shorter step",
            STATUS.MOREAU_ROOM: f"more than {int(self.cones.most)} contacts at once: spheres of very different size",
            STATUS.MOREAU_INPUTS: f"a function of inputs raised {self.raised[0]!r}" if self.raised else "there are no inputs",
        }[status]


def _varies(inputs: Inputs) -> bool:
    return inputs.function is not None or inputs.pieces is not None or inputs.motions is not None

