"""Runs with rigid contacts: one smooth phase after the other, each in one mode of every contact, put together.

A phase is integrated by the same compiled code as every other motion: parameters say which contact rows hold. It ends where an
event of a contact is located: the gap closes, the normal force or the slip passes zero, the friction cone is left. There contacts
that hold are put back onto their surfaces, impacts are made, and the mode of every contact that is closed is chosen from the
accelerations.
"""

from __future__ import annotations

import copy
from collections import Counter, deque
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import pairwise
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from symdyn.backend.metadata import ContactRecord, ModuleMetadata
from symdyn.contact_kinds import BODIES, CLUTCH
from symdyn.errors import ArgumentError, EvaluationError
from symdyn.runtime.contact_laws import (
    OPEN,
    SLIDING,
    STICKING,
    Mode,
    Site,
    Solved,
    degenerate,
    held,
    impact,
    moves_with,
    solutions,
)
from symdyn.runtime.integrating.contact_columns import FIRST, Switch
from symdyn.runtime.integrating.events import Happened
from symdyn.runtime.integrating.hybrid import CODES, CONTACTS, SHARED, Done, Laws, Motion
from symdyn.runtime.integrating.mode_codes import MODES
from symdyn.runtime.integrating.outcome import Impact, Outcome, Phase, Request, of_pieces
from symdyn.runtime.integrating.slip_begins import LARGER, LONGEST, TOLERATED, SlipBegins
from symdyn.runtime.integrating.slip_begins import ROUNDED as ROUNDED_SPEEDS
from symdyn.runtime.integrating.slip_ends import NOISE, NOISY, ROUNDED, SlipEnds
from symdyn.runtime.integrating.stops import describe_stop
from symdyn.runtime.shared_forces import least_solution
from symdyn.runtime.stronge import stronge
from symdyn.thresholds import APPROACH, FLIGHT

if TYPE_CHECKING:
    from symdyn.runtime.module import Module

Part = Callable[[Request, bool, bool], Outcome]
HOLDING = "contacts_holding"
# Gaps, m, and velocities, m/s, that count as none at the start.
TOUCHING = 1e-9
# Gaps, by the size of the state, that close together with another contact.
TOGETHER = 1e-11
# A flight shorter than this part of the run is one of infinitely many that end in finite time (Zeno): the contact stays closed.
SHORTEST_FLIGHT = 1e-10
# So is one shorter than so many times t, in which times are not resolved.
RESOLVED_FLIGHT = FLIGHT * float(np.finfo(float).eps)
# So is one that rises less than this part of the size of the coordinates: rounding hides when it ends.
LOWEST_FLIGHT = 1e-12
# An approach slower than this part of the speed that accelerations make in the run hits nothing: that much of it is rounding.
RESOLVED_APPROACH = APPROACH * float(np.finfo(float).eps)
# Gaps of open contacts below minus this part of that size have been missed.
MISSED = 1e-6
# Velocities below this part of those before an impact, or of the largest rate, are none.
NO_SPEED = 1e-11
# Number of switches within SAME_TIME of the run at which the modes do not settle; of those that follow each other, in the mean,
# after less than SHORTEST_FLIGHT of the run and do not come to an end.
MOST_SWITCHES, SAME_TIME, MOST_SHORT = 50, 1e-13, 1000
# Number of those faster than one in a step of time stepping that are left to it, where method="auto" may.
MOST_FAST = 200
# Number added to the diagonal of rows that depend on each other, relative to its size.
SOFTNESS = 1e-8
STRONGE, IGNORED, COUNTS = "stronge", "ignored", "counts"
# Energy that an impact adds counts from this part of its work on.
GAINED = 1e-9
CODE_OF = {mode: k for k, mode in enumerate(MODES)}
LAWS = Laws(TOUCHING, TOGETHER, MISSED, NO_SPEED, GAINED, SHORTEST_FLIGHT, RESOLVED_FLIGHT, LOWEST_FLIGHT,
            RESOLVED_APPROACH)
# Part of the run in which an event that has just been dealt with is not looked for again.
GRACE = 1e-9
# Part of the run for which a contact that has opened without a speed is near enough to count as leaving.
LEAVES = 1e-5
# Forces this near to their bounds, by the largest, are looked at: whether they go on beyond.
AT_BOUND = 1e-6
# A speed, m/s, that no slip comes near: added to the slip it holds the direction of friction.
HOLDS = 1e30


class Numbers(NamedTuple):
    """Results of the function "contacts": per contact gap, coefficients of friction, restitution; per row the slip, the
    acceleration without contact forces, the force; D (n, n), M^-1 J^T (n_u, n) and N M^-1 J^T (n_q, n)."""

    gap: np.ndarray
    static: np.ndarray
    kinetic: np.ndarray
    restitution: np.ndarray
    slip: np.ndarray
    free: np.ndarray
    force: np.ndarray
    D: np.ndarray
    speeds: np.ndarray
    coordinates: np.ndarray


def rows_of(records: Sequence[ContactRecord]) -> list[tuple[int, ...]]:
    """Indices of the rows of each contact."""
    ends = np.cumsum([0, *[record.rows for record in records]])
    return [tuple(range(a, b)) for a, b in pairwise(ends.tolist())]


class _Evaluated:
    """The function "contacts" of a module, for one thread, with the parameters that it had last."""

    def __init__(self, module: Module) -> None:
        self.evaluator, self.p = module.library(CONTACTS).evaluator(CONTACTS), b""

    def __call__(self, t: float, x: np.ndarray, p: np.ndarray, inputs: Any) -> np.ndarray:
        mark = p.tobytes()
        if mark != self.p:
            self.evaluator.set_params(p)
            self.p = mark
        result: np.ndarray = self.evaluator.one(t, x, inputs)
        return result


def numbers(module: Module, t: float, x: np.ndarray, p: np.ndarray, inputs: Any) -> Numbers:
    """Arguments of the laws of contact at a state."""
    known: _Evaluated = module._remembered("contact_numbers", lambda: _Evaluated(module))
    return _numbers_of(module.metadata, known(t, x[:module.metadata.sizes.x], p, inputs))


def _numbers_of(metadata: ModuleMetadata, values: np.ndarray) -> Numbers:
    """The parts of what the function "contacts" gives."""
    sizes, k = metadata.sizes, len(metadata.contacts)
    n = sum(record.rows for record in metadata.contacts)
    gap, static, kinetic, restitution = values[:4 * k].reshape(k, 4).T
    rest = values[4 * k:]
    speeds, coordinates = 3 * n + n * n, 3 * n + n * n + sizes.u * n
    return Numbers(gap, static, kinetic, restitution, rest[:n], rest[n:2 * n], rest[2 * n:3 * n],
                   rest[3 * n:speeds].reshape(n, n), rest[speeds:coordinates].reshape(-1, n), rest[coordinates:].reshape(-1, n))


def turning(at: Numbers, tangents: Sequence[int]) -> float:
    """The rate, 1/s, at which friction in space turns a slip, and at which changes across it decay; tangents: its rows."""
    gain = float(np.linalg.norm(at.D[np.ix_(tangents, tangents)], 2)) * float(np.linalg.norm(at.force[tangents]))
    return gain / max(float(np.linalg.norm(at.slip[tangents])), 1e-300)


def _check_coefficients(module: Module, at: Numbers) -> None:
    """Raise ArgumentError for friction and restitution that cannot be, as `params` may give them."""
    of_contacts = zip(at.static.tolist(), at.kinetic.tolist(), at.restitution.tolist(), strict=True)
    if all(0 <= kinetic <= static and 0 <= e <= 1 for static, kinetic, e in of_contacts):
        return
    faults: list[str] = []
    for record, static, kinetic, e in zip(module.metadata.contacts, at.static, at.kinetic, at.restitution, strict=True):
        faults += [f"{what} of contact {record.name} is {value:g}; pass a number that is not negative" for what, value in
                   (("static friction", static), ("kinetic friction", kinetic), ("restitution", e)) if value < 0]
        if e > 1:
            faults.append(f"restitution of contact {record.name} is {e:g}, which would gain energy in every impact; pass a "
                          "number from 0 to 1")
        if kinetic > static >= 0:
            faults.append(f"kinetic friction of contact {record.name} is {kinetic:g}, above static friction {static:g}; pass "
                          "static friction that is not below it")
    if faults:
        raise ArgumentError(f"{module.name}: {'; '.join(faults)}")


def onto_rows(of: Callable[[np.ndarray], Numbers], x: np.ndarray, gaps: Mapping[int, int], held: Sequence[int]) -> np.ndarray:
    """A state whose gaps are zero and whose velocities along rows are none, to first order, by the smallest change in the metric
    of the mass matrix.

    of     the numbers at a state
    gaps   indices of contacts with that of their normal row; held: indices of rows
    """
    at, normal, x = of(x), list(gaps.values()), x.copy()
    n_q, n_u = len(at.coordinates), len(at.speeds)
    if gaps:
        push = least_solution(at.D[np.ix_(normal, normal)], -at.gap[list(gaps)])
        if np.abs(push).max(initial=0.0) > 0:
            x[:n_q] += at.coordinates[:, normal] @ push
            at = of(x)
    if held:
        stop = least_solution(at.D[np.ix_(held, held)], -at.slip[held])
        x[n_q:n_q + n_u] += at.speeds[:, held] @ stop
    return x


def ignored(module: Module, t: float, x: np.ndarray, p: np.ndarray, inputs: Any) -> list[bool]:
    """Whether each contact is ignored at a state, should it be open."""
    indices = {event.name: k for k, event in enumerate(module.metadata.events)}
    own = [indices[f"{record.name}_{IGNORED}"] if IGNORED in record.events else -1 for record in module.metadata.contacts]
    if max(own) < 0:
        return [False] * len(own)
    values = module.evaluate("events", t, x[:module.metadata.sizes.x], p, inputs)
    return [k >= 0 and bool(values[k] > 0) for k in own]


def not_stepped(records: Sequence[ContactRecord]) -> list[str]:
    """Properties of contacts that method="moreau" does not take, whose steps of one length go across switches: parts of a
    message."""
    result = []
    others = {record.contact: record.impact for record in records if record.impact != "newton"}
    if others:
        result.append("method='moreau' has Newton's law of impacts; "
                      + ", ".join(f"{contact} has impact={impact!r}" for contact, impact in others.items())
                      + ": pass impact='newton', or leave out the method")
    names = [record.name for record in records if IGNORED in record.events]
    if names:
        result.append(f"contacts {', '.join(names)} are ignored at times, which method='moreau' does not know; leave out the "
                      "method, and switches are located")
    return result


def check_overlap(module: Module, t: float, x: np.ndarray, p: np.ndarray, inputs: Any) -> None:
    """Raise ArgumentError for contacts that overlap at the start, with how deep and a state that does not, and for coefficients
    that parameters make impossible."""
    at, records = numbers(module, t, x, p, inputs), module.metadata.contacts
    _check_coefficients(module, at)
    if min(at.gap.tolist()) >= -TOUCHING:
        return
    passed = ignored(module, t, x, p, inputs)
    counts = [record.kind != CLUTCH and not other for record, other in zip(records, passed, strict=True)]
    deep = [k for k, gap in enumerate(at.gap) if gap < -TOUCHING and counts[k]]
    if not deep:
        return
    first = [rows[0] for rows in rows_of(records)]
    moved, n_q = x.copy(), module.metadata.sizes.q
    for _ in range(20):
        now = numbers(module, t, moved, p, inputs)
        below = [k for k, gap in enumerate(now.gap) if gap < 0 and counts[k]]
        if not below:
            break
        indices = [first[k] for k in below]
        push = least_solution(now.D[np.ix_(indices, indices)], -now.gap[below])
        moved[:n_q] += now.coordinates[:, indices] @ push
    depths = ", ".join(f"{records[k].name} by {-at.gap[k]:.6g} {'m' if records[k].kind == BODIES else 'm or rad'}" for k in deep)
    names = module.metadata.q
    lifted = all(gap >= -TOUCHING for k, gap in enumerate(numbers(module, t, moved, p, inputs).gap) if counts[k])
    remedy = "start from q = {" + ", ".join(f"{name}: {value:.9g}" for name, value, old in zip(
        names, moved[:n_q], x[:n_q], strict=True) if value != old) + "}, where they touch" if lifted else "start further apart"
    raise ArgumentError(f"{module.name}: contacts overlap at the start: {depths}; {remedy}")


def run_contacts(module: Module, request: Request, part: Part, method: object = None,
                 crossed: list[Switch] | None = None, quick: Motion | None = None) -> Outcome:
    """Integrate with rigid contacts.

    part     integrates a request in one mode; by an implicit method, and with all contacts open, if so wanted
    method   the one that it integrates by else
    crossed  takes the switches, for a way back
    quick    goes through phases and switches in C, as far as it can

    Raises ArgumentError for what contacts do not take, TooFast where switches come faster than one in request.step.
    """
    begin, end = request.span
    if end < begin:
        raise ArgumentError(f"{module.name}: rigid contacts lose energy, so that motions with them do not run backward in time; "
                            "pass an end after the start")
    if method == "ggl":
        raise ArgumentError(f"{module.name}: method='ggl' does not locate the switches of rigid contacts; pass 'dop853' or "
                            "another")
    if request.inputs.are_held:
        raise ArgumentError(f"{module.name}: controllers whose values are held between instants do not go with rigid contacts; "
                            "pass their law as an expression of the system, or as a function of (t, x)")
    phases = _Phases(module, request, part, keeps=crossed is not None, crossed=[] if crossed is None else crossed, quick=quick)
    return phases.through()


def _without_columns(part: Request) -> Request:
    """The request of the motion alone."""
    n = part.n_state
    return replace(part, x0=part.x0[:n], atol=part.atol[:n], columns=(), held=(), followed=())


class Made(NamedTuple):
    """Change of the state at a switch: put onto the surfaces of contacts by modes and whether they slip, or, where
    contacts are hit, an impact."""

    modes: tuple[str, ...]
    still: tuple[bool, ...]
    touching: tuple[int, ...] = ()
    hit: tuple[int, ...] = ()


class TooFast(Exception):
    """Switches that follow each other faster than one in a step of time stepping: what Solution.why adds."""


class _Stop(Exception):
    """Ends a run with its reason."""


@dataclass
class _Doubt:
    """Warning, given once for all instants of its kind: the text of the most important one, and how often it was so again."""

    text: str
    weight: float
    more: int = 0
    until: float = 0.0
    names: dict[str, None] = field(default_factory=dict)

    def __str__(self) -> str:
        if not self.more:
            return self.text
        return (f"{self.text}. The like happened at {self.more} more instant{'s' * (self.more > 1)}, the latest t = "
                f"{self.until:.9g} s, at contacts {', '.join(self.names)}")


class _Table:
    """Contacts of a module: indices of their rows, parameters and events.

    Raises ArgumentError where parameters that say in which mode contacts are have become numbers.
    """

    def __init__(self, module: Module) -> None:
        metadata = module.metadata
        self.records = metadata.contacts
        self.rows = rows_of(self.records)
        self.normal = [rows[0] for rows in self.rows]  # of dry friction its only row
        self.tangents = [list(rows[record.normal:]) for rows, record in zip(self.rows, self.records, strict=True)]
        self.clutches = [k for k, record in enumerate(self.records) if record.kind == CLUTCH]
        self.placed = [k for k, record in enumerate(self.records) if record.normal and record.kind != CLUTCH]  # by positions
        self.frictions = [k for k, record in enumerate(self.records) if not record.normal]
        self.parameter_index = {name: k for k, name in enumerate(metadata.parameters)}
        missing = [name for record in self.records for name in record.parameters if name not in self.parameter_index]
        if missing:
            raise ArgumentError(f"{module.name}: the parameters {', '.join(missing)} say in which mode contacts are, and a "
                                "run sets them; leave them out of specialize")
        events = {event.name: k for k, event in enumerate(metadata.events)}
        self.events = [{what: events[f"{record.name}_{what}"] for what in record.events} for record in self.records]
        self.of_event = {k: (j, what) for j, own in enumerate(self.events) for what, k in own.items()}


@dataclass
class _Phases:
    module: Module
    request: Request
    part: Part
    ts: list[np.ndarray] = field(default_factory=list)
    xs: list[np.ndarray] = field(default_factory=list)
    done: list[Outcome] = field(default_factory=list)
    phases: list[Phase] = field(default_factory=list)
    impacts: list[Impact] = field(default_factory=list)
    happened: list[Happened] = field(default_factory=list)
    doubts: dict[str, _Doubt] = field(default_factory=dict)  # by kind
    keeps: bool = False  # whether switches are kept for a way back
    crossed: list[Switch] = field(default_factory=list)
    made: list[Made] = field(default_factory=list)  # at the latest switch; none where it changes no more than shares of forces
    quick: Motion | None = None

    def __post_init__(self) -> None:
        table: _Table = self.module._remembered("contact_table", lambda: _Table(self.module))
        self.records, self.rows, self.normal, self.tangents = table.records, table.rows, table.normal, table.tangents
        self.clutches, self.placed, self.frictions = table.clutches, table.placed, table.frictions
        self.parameter_index, self.events, self.of_event = table.parameter_index, table.events, table.of_event
        self.n_steps = 0
        n = len(self.records)
        self.modes = [OPEN] * n
        self.directions = [np.zeros(record.tangents) for record in self.records]
        self.still = [False] * n  # whether the slip of a closed contact is zero
        self.passed = [False] * n  # whether an open contact is ignored
        self.size = 0.0  # of coordinates and gaps
        self.latest_numbers: tuple[tuple[float, bytes, bytes], Numbers] | None = None  # and what they are of
        self.begins = SlipBegins(self.request.span[1] - self.request.span[0])
        self.most_kinetic: float | None = None  # energy, once it was looked at
        self.evaluators: dict[str, tuple[tuple[str, bytes], Any]] = {}
        self.shared = False
        self.softness = [(0.0, 0.0)] * n  # of rows that share forces, as parameters: along the tangents, and the normal
        begin, end = self.request.span
        self.same = max(SAME_TIME * (end - begin), 8 * np.finfo(float).eps * max(abs(begin), abs(end)))
        self.at_once, self.latest = 0, ""  # switches without time between, and the contacts of the latest
        self.recent: deque[tuple[float, tuple[int, ...]]] = deque(maxlen=MOST_SHORT)  # switches with their contacts
        self.ruled_out: dict[int, set[str]] = {}  # modes at this time
        self.unlooked: set[int] = set()
        self.pressed = 0.0  # the largest force at the latest switch, N
        self.until = np.inf  # and until when these events are not looked for
        self.closing: set[int] = set()  # at the latest switch
        self.left: dict[int, float] = {}  # when contacts opened since nothing pressed them, or not any more
        self.ends = SlipEnds()  # of the phase
        self.latest_time = begin  # of a switch that changes the motion

    # -- the run

    def through(self) -> Outcome:
        """To the end, or as far as it gets."""
        request = self.request
        self.t, end = request.span
        last = end if request.times is None else float(request.times[-1])
        self.x, message, cause, interrupted, over = request.x0.copy(), "", None, False, False
        self.fired: list[tuple[int, str]] = []
        self.begun = True
        located = False
        if self.quick is not None:
            self.quick.start(request, LAWS, self.same)
        try:
            while True:
                if self.quick is not None and self._is_plain():
                    located = located or bool(self.fired)
                    if self._quickly(self.quick):
                        break
                    located = bool(self.fired)
                if self.begun or self.fired:
                    self.x = self._switched(self.t, self.x, self.fired, self.begun, located)
                self.begun = False
                outcome = self._phase(self.t, self.x)
                if not outcome.success:
                    break
                start, self.t, self.x = self.t, float(outcome.t[-1]), outcome.x[-1]
                self._demand_seen(self.t, self.x, self.t - start)
                latest = [one for one in outcome.happened if one.t == outcome.happened[-1].t] if outcome.happened else []
                self.fired = [self.of_event[one.event] for one in latest if one.event in self.of_event]
                if any(self.module.metadata.events[one.event].stop and one.event not in self.of_event for one in latest):
                    over = True
                    message = outcome.message
                    break
                until = float(latest[-1].t) if self.fired else min(self.until, end)
                located = bool(self.fired)
                if self.fired:
                    self.x = latest[-1].before.copy()
                elif until >= last:
                    self._demand_pressed(until, self.x)
                    break
                else:
                    self.x, self.fired = self._slipped(until, self.x)
                    self.fired = self.fired or self._passed_over(until, self.x)
                    if until == self.ends.begins and not self.fired:
                        self.x = self._into_last_stretch(until, self.x)
                self._count(until - start, until, self.fired)
                self.t = until
                if request.max_steps is not None and self.n_steps >= request.max_steps:
                    raise _Stop(f"{self.n_steps} steps were done, as asked")
        except KeyboardInterrupt:
            interrupted = True
            message = describe_stop(self.module.metadata, self.t, self.x[:request.n_state], "interrupted")
        except (_Stop, EvaluationError) as error:
            why = str(error).removeprefix(f"{self.module.name}: ")
            message, cause = describe_stop(self.module.metadata, self.t, self.x[:request.n_state], why), error.__cause__
        return self._whole(self.t, self.x, message, cause, interrupted, over)

    def _is_plain(self) -> bool:
        """Whether nothing is under way at a switch, or before a phase, that C does not know of."""
        return not (self._kept() or self.begins.directions or self.begins.since or self.unlooked or self.ruled_out or self.at_once
                    or self.shared or self.until < np.inf)

    def _kept(self) -> list[int]:
        """Contacts with friction at its bound that others keep from slipping, see symdyn.runtime.contact_laws.Mode."""
        return [k for k, (still, mode) in enumerate(zip(self.still, self.modes, strict=True))
                if still and mode == SLIDING and self.tangents[k]]

    def _quickly(self, quick: Motion) -> bool:
        """Go on in C as far as that goes; whether it is the end."""
        while True:
            latest = self._hand_over(quick)
            assert self.request.times is not None
            first = np.searchsorted(self.request.times, self.t, "right" if self.done else "left")
            try:
                done = quick.go(self.request.times[first:])
            except KeyboardInterrupt:
                self.happened += latest
                raise
            code = self._take_over(quick, done)
            if code == CODES.HYBRID_CONSTANTS:
                self.quick = None
            if code != CODES.HYBRID_FULL:
                return code == CODES.HYBRID_DONE

    def _hand_over(self, quick: Motion) -> list[Happened]:
        """Put what C goes on from into its record, with the events of the latest time, which impacts may change: these."""
        record = quick.record
        record.t, record.size, record.begins, record.n_fired = self.t, self.size, self.begun, len(self.fired)
        quick.x[:] = self.x
        quick.fired[:len(self.fired)] = [self.events[k][what] for k, what in self.fired]
        quick.slipping[:] = 0
        quick.mode[:], quick.still[:], quick.passed[:] = [CODE_OF[mode] for mode in self.modes], self.still, self.passed
        quick.sign[:] = [direction[0] if len(direction) else 0.0 for direction in self.directions]
        quick.left[:] = [self.left.get(k, -np.inf) for k in range(len(self.records))]
        latest: list[Happened] = []
        while self.fired and self.happened and self.happened[-1].t == self.t:
            latest.insert(0, self.happened.pop())
        record.n_happened = len(latest)
        for k, one in enumerate(latest):
            quick.happened[k], quick.happened_t[k] = one.event, one.t
            quick.happened_states[k] = one.before, one.after
        return latest

    def _take_over(self, quick: Motion, done: Done) -> int:
        """Note what C has done, and go on from there; the code by which it ended."""
        record = quick.record
        times, states = done.t, done.x
        if done.begin:
            self.done.append(done.outcome)
            self.n_steps += done.outcome.n_steps
        impacts = [Impact(t, *rows) for t, rows in zip(done.impact_times, done.impacts, strict=True)]
        happened = [Happened(k, t, *both) for k, t, both in zip(done.events, done.event_times, done.event_states, strict=True)]
        at, seen, hit = 0, 0, 0
        fired: list[tuple[int, str]] = []
        for begin, end, p, modes, written, happened_by, impacts_by in zip(
                done.begin, done.end, done.p, done.modes, done.written, done.happened_by, done.impacts_by, strict=True):
            self.phases.append(Phase(begin, p, tuple([MODES[mode] for mode in modes])))
            self.ts.append(times[at:written])
            self.xs.append(states[at:written])
            ended = happened[seen:happened_by]
            self.impacts += impacts[hit:impacts_by]
            self.happened += ended
            at, seen, hit = written, happened_by, impacts_by
            fired = [self.of_event[one.event] for one in ended if one.t == end]
            if fired:
                self.t, self.x = end, ended[-1].before
                self._recall(end, fired)
        if fired and done.end[-1] - done.begin[-1] <= self.same:
            self._at_once(self.t, fired)
        self.impacts += impacts[hit:]
        self.happened += happened[seen:]
        self.t, self.x, self.size, self.begun = record.t, quick.x.copy(), record.size, bool(record.begins)
        self.fired = [self.of_event[k] for k in quick.fired[:record.n_fired].tolist()]
        self.modes = [MODES[mode] for mode in quick.mode.tolist()]
        self.still, self.passed = list(map(bool, quick.still.tolist())), list(map(bool, quick.passed.tolist()))
        self.left = {k: t for k, t in enumerate(quick.left.tolist()) if t > -np.inf}
        for k, sign in enumerate(quick.sign.tolist()):
            if len(self.directions[k]) and self.directions[k][0] != sign:
                self.directions[k] = np.full(self.records[k].tangents, sign)
        self.begins.directions = {k: self.directions[k] for k in np.flatnonzero(quick.slipping).tolist()}
        return done.code

    def _demand_seen(self, t: float, x: np.ndarray, passed: float) -> None:
        """Raise _Stop where an open contact overlaps, at the end of a phase."""
        at = self._numbers(t, x)
        for k, (record, mode) in enumerate(zip(self.records, self.modes, strict=True)):
            size = max(1.0, float(np.abs(at.slip).max())) if k in self.clutches else max(
                self.size, passed * abs(float(at.slip[self.normal[k]])))
            if mode == OPEN and not self.passed[k] and at.gap[k] < -MISSED * size:
                what = "turns back" if k in self.clutches else "overlaps"
                raise _Stop(f"contact {record.name} {what} by {-at.gap[k]:.3g}{' m' * (record.kind == BODIES)}, since the "
                            "instant at which it closed was missed; give event_spacing, or a finer rtol")

    def _passed_over(self, t: float, x: np.ndarray) -> list[tuple[int, str]]:
        """Contacts that have begun to pull while that was not looked for: they open now."""
        passed = [k for k, own in enumerate(self.events) if self.modes[k] != OPEN and own.get("opens") in self.unlooked]
        if not passed:
            return []
        forces = self._by_modes(t, x).force
        size = float(np.abs(forces).max(initial=0.0))
        return [(k, "opens") for k in passed if forces[self.normal[k]] < -ROUNDED_SPEEDS * size]

    def _demand_pressed(self, t: float, x: np.ndarray) -> None:
        """Raise _Stop where a closed contact pulls, at the end of a phase."""
        closed = [k for k, mode in enumerate(self.modes) if mode != OPEN and self.records[k].normal]
        if not closed or self.shared or not self.pressed:
            return
        forces = self._by_modes(t, x).force
        size = max(float(np.abs(forces).max(initial=0.0)), self.pressed)
        for k in closed:
            if forces[self.normal[k]] < -MISSED * size:
                raise _Stop(f"contact {self.records[k].name} pulls by {-forces[self.normal[k]]:.3g} N, since the instant at "
                            "which it opened was missed; give event_spacing, or a finer rtol")

    def _by_modes(self, t: float, x: np.ndarray, p: np.ndarray | None = None) -> Numbers:
        """The numbers by parameters with modes, whose forces act then; without, by those with the present ones."""
        values = self._values(CONTACTS, t, x[:self.request.n_state], self._parameters() if p is None else p)
        return _numbers_of(self.module.metadata, values)

    def _count(self, passed: float, t: float, fired: Sequence[tuple[int, str]]) -> None:
        """Note how often the modes change without time passing, and with less and less; raise _Stop where that does not end."""
        if fired:
            self._recall(t, fired)
        if passed > self.same:
            self.at_once, self.ruled_out, self.unlooked, self.until = 0, {}, set(), np.inf
        else:
            self._at_once(t, fired)

    def _recall(self, t: float, fired: Sequence[tuple[int, str]]) -> None:
        """Note a switch; raise _Stop where those of late have been too many."""
        self.recent.append((t, tuple([k for k, _ in fired])))
        begin, end = self.request.span
        if self.request.step and len(self.recent) >= MOST_FAST:
            passed_by = t - self.recent[-MOST_FAST][0]
            if passed_by < (MOST_FAST - 1) * self.request.step:
                raise TooFast(f"{MOST_FAST} switches of contacts until t = {t:.6g} s came within {passed_by:.3g} s, faster "
                              f"than one in a step of {self.request.step:g} s, so that steps go across them")
        first = self.recent[0][0]
        if len(self.recent) == MOST_SHORT and t - first < MOST_SHORT * SHORTEST_FLIGHT * (end - begin):
            often = Counter(self.records[k].name for _, of in self.recent for k in of)
            raise _Stop(f"the modes of contacts change {MOST_SHORT} times within {t - first:.3g} s, and nothing says when "
                        f"that ends: {', '.join(f'{name} {n} times' for name, n in often.most_common())}; restitution below "
                        "1, or a compliant contact where they touch, leaves fewer switches"
                        + "; method='moreau' with a step goes across them" * (not not_stepped(self.records)))

    def _at_once(self, t: float, fired: Sequence[tuple[int, str]]) -> None:
        """Note a switch without time since the one before; raise _Stop where these do not end."""
        self.at_once += 1
        self.latest = ", ".join(dict.fromkeys(self.records[k].name for k, _ in fired)) or self.latest
        self.unlooked |= {self.events[k][what] for k, what in fired if what != "closes"}
        self._wait(t)
        if self.at_once >= MOST_SWITCHES:
            raise _Stop(f"the modes of contacts do not settle: {self.at_once} switches within {self.same:.3g} s, the latest of "
                        f"{self.latest}; a compliant contact where they touch, or other coefficients, leave one mode"
                        + "; method='moreau' with a step goes across them without locating switches"
                        * (not not_stepped(self.records)))

    def _phase(self, t: float, x: np.ndarray) -> Outcome:
        """From one switch to the next."""
        request = self.request
        held, stiff, first = bool(self.begins.directions), False, 0.0
        if held:
            self.until = min(self.until, self._held_until(t, x))
        elif self.begins.since:
            stiff = True
            piece, first = self.begins.piece(t)
            self.until = min(self.until, piece)
        end = min(request.span[1], self.until)
        times, inner = None, slice(None)
        if request.times is not None:
            wanted = request.times[(request.times >= t if not self.done else request.times > t) & (request.times <= end)]
            begin = [] if len(wanted) and wanted[0] == t else [t]
            times = np.concatenate([begin, wanted, [] if end == t or (len(wanted) and wanted[-1] == end) else [end]])
            inner = slice(len(begin), len(begin) + len(wanted))
        left = None if request.max_steps is None else request.max_steps - self.n_steps
        p = self._parameters()
        self.phases.append(Phase(float(t), p, tuple(self.modes)))
        part = replace(request, span=(t, end), times=times, x0=x, p=p, max_steps=left, look=self._looked_for())
        part = replace(part, first_step=first) if stiff else part
        if (request.columns or self.keeps) and self._in_space() and not held and t < self.ends.begins:
            part = self._towards_sticking(t, part, stiff)
        outcome = self._last_stretch(part) if request.columns and t >= self.ends.begins else self.part(
            part, stiff, all(mode == OPEN for mode in self.modes))
        rows = np.ones(len(outcome.t), dtype=bool)
        if times is not None:  # they come in order, after them the state where the run ends
            n, asked = min(len(times), len(rows)), np.zeros(len(times), dtype=bool)
            asked[inner] = True
            rows[n:], rows[:n] = False, asked[:n] & (times[:n] == outcome.t[:n])
            ended = outcome.happened and outcome.happened[-1].event not in self.of_event and self.module.metadata.events[
                outcome.happened[-1].event].stop
            if len(rows) and (not outcome.success or ended):
                rows[-1] = True
        self.ts.append(outcome.t[rows])
        self.xs.append(outcome.x[rows])
        self.done.append(outcome)
        self.happened += outcome.happened
        self.n_steps += outcome.n_steps
        return outcome

    def _in_space(self) -> bool:
        """Whether the direction of a slip changes with the state."""
        return any(mode == SLIDING and record.tangents == 2 for mode, record in zip(self.modes, self.records, strict=True))

    def _towards_sticking(self, t: float, part: Request, stiff: bool) -> Request:
        """A phase in which contacts slip in space, until the last stretch of those that come to stick."""
        ahead = self.part(replace(_without_columns(part), times=None), stiff, False)
        if not ahead.success or not ahead.happened:
            return part
        end, x = float(ahead.happened[-1].t), ahead.happened[-1].before
        at, begin, tolerated, slips = self._numbers(end, x), self._numbers(t, part.x0), {}, {}
        sizes = self.module.metadata.sizes
        rounded = ROUNDED * float(np.abs(part.x0[sizes.q:sizes.q + sizes.u]).max(initial=0.0))
        for k, (mode, record) in enumerate(zip(self.modes, self.records, strict=True)):
            if mode == SLIDING and record.tangents == 2:
                tolerated[k] = max(self._tolerated(end, x, k), NOISY * rounded)
                if np.linalg.norm(at.slip[self.tangents[k]]) <= NOISE * tolerated[k]:
                    slips[k] = float(np.linalg.norm(begin.slip[self.tangents[k]]))
        if not slips:
            return part
        self.ends.found(t, end, slips, tolerated)
        if self.ends.begins <= t:
            return replace(part, x0=self._into_last_stretch(t, part.x0))
        self.until = min(self.until, self.ends.begins)
        wanted = None if part.times is None else part.times[part.times < self.until]
        n = part.n_state
        noise = rounded / max(min(slips.values()), 1e-300) * float(np.abs(part.x0[n:]).max(initial=0.0))
        return replace(part, span=(t, self.until), times=None if wanted is None else np.append(wanted, self.until),
                       atol=np.append(part.atol[:n], np.maximum(part.atol[n:], noise)))

    def _into_last_stretch(self, t: float, x: np.ndarray) -> np.ndarray:
        """The state where the last stretch begins, its columns without slips across those that come to their end."""
        before, slip, other = self._parameters(), self._numbers(t, x).slip, copy.copy(self)
        other.directions = list(self.directions)
        for k, (mode, record) in enumerate(zip(self.modes, self.records, strict=True)):
            v = slip[self.tangents[k]]
            if mode == SLIDING and record.tangents == 2 and v.any():
                other.directions[k] = v / np.linalg.norm(v)
        self.ends.held = self._held(other._parameters())
        held = {k: other.directions[k] for k in self.ends.contacts}
        return other._realigned(t, x, held, before, self.ends.held, self.ends.ends)

    def _last_stretch(self, part: Request) -> Outcome:
        """The last stretch: the motion, and its columns with directions of friction that are held."""
        n, metadata = part.n_state, self.module.metadata
        outcome = self.part(_without_columns(part), False, False)
        if not len(outcome.t) or any(metadata.events[one.event].reset for one in outcome.happened):
            return self.part(part, False, False)
        t = np.unique([part.span[0], *outcome.t, *[one.t for one in outcome.happened]])
        columns = part.x0[None, n:]
        if len(t) > 1:
            held = replace(part, span=(t[0], t[-1]), times=t, p=self.ends.held, first_step=0.0,
                           look=None if part.look is None else np.zeros_like(part.look))
            along = self.part(held, False, False)
            if not along.success:
                return along
            columns = along.x[:, n:]
        of = lambda times: columns[np.searchsorted(t, times)]
        happened = [one._replace(before=np.append(one.before[:n], of(one.t)), after=np.append(one.after[:n], of(one.t)))
                    for one in outcome.happened]
        return replace(outcome, x=np.hstack([outcome.x, of(outcome.t)]), happened=happened)

    def _held(self, p: np.ndarray) -> np.ndarray:
        """Parameters with which directions of friction in space are held."""
        p = p.copy()
        p[self.parameter_index[HOLDING]] = HOLDS
        return p

    def _held_until(self, t: float, x: np.ndarray) -> float:
        """Until when the directions of contacts that begin to slip are held."""
        p, n = self._parameters(), self.request.n_state

        def rate(t: float, x: np.ndarray) -> np.ndarray:
            return self._values("rhs", t, x, p)

        def slips(t: float, x: np.ndarray) -> dict[int, np.ndarray]:
            result = self._numbers(t, x).slip
            return {k: result[self.tangents[k]] for k in self.begins.directions}

        tolerated = max(self._tolerated(t, x, k) for k in self.begins.directions)
        return self.begins.held_until(t, x[:n], rate, slips, tolerated)

    def _tolerated(self, t: float, x: np.ndarray, k: int) -> float:
        """The error of the slip of a contact that the tolerances of the speeds let pass."""
        sizes, request = self.module.metadata.sizes, self.request
        at, result, inputs = self._numbers(t, x).slip[self.tangents[k]], 0.0, request.inputs.at(t, x[:request.n_state])
        for j in range(sizes.q, sizes.q + sizes.u):  # slips are linear in the speeds
            moved = x[:request.n_state].copy()
            moved[j] += 1.0
            values = self._values(CONTACTS, t, moved, request.p, inputs)
            by = _numbers_of(self.module.metadata, values).slip[self.tangents[k]] - at
            result += float(np.linalg.norm(by)) * (float(request.atol[j]) + request.rtol * abs(float(x[j])))
        return result

    def _parameters(self) -> np.ndarray:
        """The parameters with the modes of all contacts."""
        p = self.request.p.copy()
        for record, mode, direction, soft in zip(self.records, self.modes, self.directions, self.softness, strict=True):
            if record.closed:
                p[self.parameter_index[record.closed]] = mode != OPEN
            if record.sticking:
                p[self.parameter_index[record.sticking]] = mode == STICKING
                given = direction if mode == SLIDING else soft if self.shared and mode == STICKING else (0.0, 0.0)
                for name, value in zip(record.sliding, given, strict=False):
                    p[self.parameter_index[name]] = value
        p[self.parameter_index[SHARED]] = SOFTNESS if self.shared else 0.0
        return self._held(p) if self.begins.directions and HOLDING in self.parameter_index else p

    def _looked_for(self) -> np.ndarray:
        """Events of the user, and those of contacts that their modes can end with."""
        request = self.request
        n = len(self.module.metadata.events)
        look = np.zeros(n, dtype=bool) if request.look is None else request.look.copy()
        held = self.begins.directions
        for j, (own, mode, passed) in enumerate(zip(self.events, self.modes, self.passed, strict=True)):
            wanted = {OPEN: (COUNTS,) if passed else ("closes", IGNORED), STICKING: ("opens", "slips"),
                      SLIDING: ("opens", "sticks", "turns")}[mode]
            for what, k in own.items():
                look[k] = what in wanted and k not in self.unlooked
            directed = mode == SLIDING and self.directions[j].any() and not self.still[j]
            if "sticks" in own and (held or not directed):
                look[own["sticks"]] = False
            if "turns" in own and (held or not directed or j in self.begins.since):
                look[own["turns"]] = False
        return look

    # -- switches

    def _switched(self, t: float, x: np.ndarray, fired: Sequence[tuple[int, str]], start: bool, located: bool) -> np.ndarray:
        """The state after a switch with its sensitivities; located: whether it is where an event happens."""
        if not self.request.columns and not self.keeps:
            return self._switch(t, x, fired, start)
        p, n, self.ends = self._parameters(), self.request.n_state, SlipEnds()
        after = self._switch(t, x, fired, start)
        if not self.made:  # forces are shared in another way, and the motion goes on
            return after
        if start:  # changes of the start keep contacts that are closed there on their surfaces
            self.made.append(Made(tuple(self.modes), tuple(self.still)))
        since = t - self.latest_time if self.phases else self.request.span[1] - t
        timed = self._timed(fired) if located else {}
        events = [(self.events[k][what], f"{self.records[k].name}_{what}") for k, what in timed.items()]
        stuck = set(timed.values()) == {"sticks"} and not any(
            mode == SLIDING and record.tangents for mode, record in zip(self.modes, self.records, strict=True))
        turned = located and not events and all(what == "turns" for _, what in fired)
        switch = Switch(self.module, t, x[:n].copy(), after[:n].copy(), p, self._parameters(), tuple(events),
                        None if turned else partial(self._made_again, tuple(self.made)), since, self.request.inputs, stuck=stuck)
        if events or start:
            self.latest_time = t
        if self.keeps:
            self.crossed.append(switch)
        if self.request.columns:
            try:
                after[n:] = switch.along(switch.moves(x[n:].reshape(-1, n), self.request.columns))[1].ravel()
            except EvaluationError as error:
                raise _Stop(str(error)) from None
        return after

    def _timed(self, fired: Sequence[tuple[int, str]]) -> dict[int, str]:
        """The contacts whose events set the time of the latest switch, with the event. A slip that only turns changes nothing."""
        result = {}
        timed = [one for one in fired if one[1] in FIRST]  # the others change nothing in the motion
        for k, what in sorted(timed, key=lambda one: FIRST.index(one[1]), reverse=True):
            if what != "turns":
                result[k] = what
            elif self.modes[k] == STICKING:
                result[k] = "sticks"
        return {**result, **dict.fromkeys(sorted(self.closing), "closes")}

    def _made_again(self, made: Sequence[Made], t: float, x: np.ndarray, p: np.ndarray, inputs: Any) -> tuple[np.ndarray, Any]:
        """The state that a switch makes of another one, and what the contacts that are hit do there."""
        other = copy.copy(self)
        other.request = replace(self.request, p=p, inputs=inputs)
        other.impacts, other.happened, other.doubts, other.latest_numbers, other.evaluators = [], [], {}, None, {}
        x, decided = x.copy(), []
        for one in made:
            other.modes, other.still = list(one.modes), list(one.still)
            if one.hit:
                x, rebound = other._impact(t, x, other._numbers(t, x), one.touching, one.hit)
                decided.append((tuple(rebound), tuple(other.still)))
            else:
                x = other._onto_surfaces(t, x)
        return x, decided

    def _numbers(self, t: float, x: np.ndarray) -> Numbers:
        request = self.request
        inputs = request.inputs.at(t, x[:request.n_state])
        key = t, x[:request.n_state].tobytes(), np.asarray(inputs).tobytes()
        if self.latest_numbers is None or self.latest_numbers[0] != key:  # in the open mode: what is taken is that of all modes
            values = self._values(CONTACTS, t, x[:request.n_state], request.p, inputs)
            self.latest_numbers = key, _numbers_of(self.module.metadata, values)
        return self.latest_numbers[1]

    def _values(self, name: str, t: float, x: np.ndarray, p: np.ndarray, inputs: Any = None) -> np.ndarray:
        """A function at a state (n_state,), whose numbers were checked when the run began."""
        key = name, p.tobytes()
        evaluator = self.evaluators.get(name)
        if evaluator is None or evaluator[0] != key:
            made = self.module.library(name).evaluator(name) if evaluator is None else evaluator[1]
            made.set_params(p)
            self.evaluators[name] = evaluator = key, made
        result: np.ndarray = evaluator[1].one(t, x, self.request.inputs.at(t, x) if inputs is None else inputs)
        return result

    def _switch(self, t: float, x: np.ndarray, fired: Sequence[tuple[int, str]], start: bool) -> np.ndarray:
        """The state after impacts, and the modes of the next phase."""
        x = x.copy()
        if fired and all(what in ("opens", "slips") for _, what in fired) and self._share_in_space([k for k, _ in fired]):
            if self._shares_again(t, x):
                self.made = []
                return x
            if self.request.columns or self.keeps:
                raise _Stop(f"contacts {', '.join(self.records[k].name for k, _ in fired)} share forces and leave their cones of "
                            "friction; how the time at which that happens changes is not known, so that derivatives are not "
                            "computed across it; end the motion before, or take them by differences of two motions")
        turned = {k for k, what in fired if what in (IGNORED, COUNTS)}  # where what they are ignored by is at its zero
        self._pass_by(t, x, self._ignored(t, x) if start else [one != (k in turned) for k, one in enumerate(self.passed)])
        kept = self._kept()
        for k, what in fired:
            if what == "sticks" and len(self.tangents[k]) == 1:
                self.still[k] = True
            elif what in ("sticks", "turns"):  # a slip within the tolerances has no direction
                size, tolerated = self._slip(t, x, k), self._tolerated(t, x, k)
                self.still[k] = size <= tolerated
                if not self.still[k] and size <= TOLERATED * tolerated and self.done:  # nor has one that turns near them
                    begin = self.done[-1]
                    self.still[k] = self._slip(float(begin.t[0]), begin.x[0], k) <= TOLERATED * tolerated
        if any(self.still[k] for k, what in fired if what in ("sticks", "turns")):
            self._stop_together(t, x)
        self.made = [Made(tuple(self.modes), tuple(self.still))]
        x = self._onto_surfaces(t, x)
        at = self._numbers(t, x)
        self._rule_out(at, fired, kept)
        self.size = max(self.size, np.abs(x[:self.module.metadata.sizes.q]).max(initial=0.0),
                        np.abs(at.gap[self.placed]).max(initial=0.0))
        closing = {k for k, what in fired if what == "closes"}
        for k in [k for k in closing if self._is_leaving(k, t, x, at)]:
            closing.discard(k)
            del self.happened[max(i for i, one in enumerate(self.happened) if one.event == self.events[k]["closes"])]
            self.unlooked.add(self.events[k]["closes"])
            self.until = t + max(GRACE * (self.request.span[1] - self.request.span[0]), t - self.left[k])
        if start:
            for k in self.frictions:
                self.still[k] = self._slow(at, k)
        near = TOUCHING if start else TOGETHER * max(1.0, float(np.abs(x[:self.request.n_state]).max(initial=0.0)))
        for k, mode in enumerate(self.modes):
            v = at.slip[self.normal[k]]
            if mode != OPEN or k in closing or self.passed[k] or not self.records[k].normal or self._is_leaving(k, t, x, at):
                continue
            if (abs(at.gap[k]) <= near and v <= (TOUCHING if start else 0.0)) or (k in self.clutches and v < -TOUCHING):
                closing.add(k)
        hit = [k for k in closing
               if at.slip[self.normal[k]] < -(TOUCHING if start or k in self.clutches else self._rounding(at))]
        touching = [k for k, mode in enumerate(self.modes) if self.records[k].normal and (
            mode != OPEN or k in closing or (hit and k in self.clutches))]
        rebound: list[int] = []
        self.closing = closing
        if hit:
            self.made.append(Made(tuple(self.modes), tuple(self.still), tuple(touching), tuple(hit)))
            x, rebound = self._impact(t, x, at, touching, hit)
            at = self._numbers(t, x)
        else:
            for k in closing:
                self.still[k] = self._slow(at, k)
            for k in self.frictions:
                self.still[k] = self._slow(at, k)
        closed = sorted([*[k for k in touching if k not in rebound], *self.frictions])
        self._choose_lasting(t, x, at, closed)
        resting = self._zeno(t, at, rebound, hit)
        if resting:
            closed = sorted({*closed, *resting})
            for k in resting:
                self.modes[k], self.still[k] = SLIDING, self._slow(at, k)
            self.made.append(Made(tuple(self.modes), tuple(self.still)))
            x = self._onto_surfaces(t, x)
            self._choose_lasting(t, x, self._numbers(t, x), closed)
        self.left |= {k: t for k in closed if self.modes[k] == OPEN}
        self._pass_by(t, x, [self.passed[k] if k in turned else now for k, now in enumerate(self._ignored(t, x))])
        return x

    def _stop_together(self, t: float, x: np.ndarray) -> None:
        """Where a slip has come to its end, others in space that are near the tolerances have come to theirs: legs of one body,
        of which rounding lets one be the first."""
        for k, (mode, record) in enumerate(zip(self.modes, self.records, strict=True)):
            if mode == SLIDING and record.tangents == 2 and not self.still[k]:
                self.still[k] = self._slip(t, x, k) <= TOLERATED * self._tolerated(t, x, k)

    def _is_leaving(self, k: int, t: float, x: np.ndarray, at: Numbers) -> bool:
        """Whether a contact has just opened: its gap is rounding, which may pass zero, and no speed closes it."""
        begin, end = self.request.span
        since = self.left.get(k)
        if since is None or t - since > LEAVES * (end - begin):
            return False
        speeds = x[self.module.metadata.sizes.q:self.request.n_state]
        fastest = max(float(np.abs(at.slip).max()), float(np.abs(speeds).max(initial=0.0)))
        none = max(NO_SPEED * fastest, self._rounding(at))
        return bool(at.slip[self.normal[k]] >= -none and abs(at.gap[k]) <= LOWEST_FLIGHT * self.size)

    def _a_moment_later(self, t: float, x: np.ndarray) -> tuple[float, np.ndarray]:
        """The time and the state after a part GRACE of the run, by the present modes."""
        p, after = self._parameters(), min(GRACE * self.begins.length, self.request.span[1] - t)
        return t + after, self._stepped(t, x, self._values("rhs", t, x[:self.request.n_state], p), p, after)

    def _stepped(self, t: float, x: np.ndarray, rate: np.ndarray, p: np.ndarray, h: float) -> np.ndarray:
        """The state after a step h of Heun's method, (n_state,); rate: x_dot at t."""
        n = self.request.n_state
        f = rate[:n]
        result: np.ndarray = x[:n] + h / 2 * (f + self._values("rhs", t + h, x[:n] + h * f, p)[:n])
        return result

    def _rounding(self, at: Numbers) -> float:
        """The speed that rounding of accelerations makes in the run, m/s, which hits nothing."""
        return float(RESOLVED_APPROACH * np.abs(at.free).max(initial=0.0)) * self.begins.length

    def _ignored(self, t: float, x: np.ndarray) -> list[bool]:
        return ignored(self.module, t, x, self.request.p, self.request.inputs.at(t, x[:self.request.n_state]))

    def _pass_by(self, t: float, x: np.ndarray, passed: list[bool]) -> None:
        """Note which contacts are ignored; raise _Stop for those that overlap where that ends."""
        ended = [k for k, (old, now) in enumerate(zip(self.passed, passed, strict=True)) if old and not now]
        self.passed = passed
        if not ended:
            return
        gaps = self._numbers(t, x).gap
        for k in ended:
            if self.modes[k] == OPEN and gaps[k] < -MISSED * self.size:
                raise _Stop(f"contact {self.records[k].name} overlaps by {-gaps[k]:.3g} m where it is no longer ignored; let "
                            "`ignored` stay positive until its gap is open")

    def _slip(self, t: float, x: np.ndarray, k: int) -> float:
        """Speed of slip of a contact, m/s."""
        return float(np.linalg.norm(self._numbers(t, x).slip[self.tangents[k]]))

    def _slow(self, at: Numbers, k: int) -> bool:
        """Whether a contact does not slip."""
        fastest = float(np.abs(at.slip).max(initial=0.0))
        return bool(np.abs(at.slip[self.tangents[k]]).max(initial=0.0) <= max(TOUCHING, NO_SPEED * fastest))

    def _onto_surfaces(self, t: float, x: np.ndarray) -> np.ndarray:
        """Closed contacts back to gap zero without normal velocity, sticking ones without slip, by the smallest change in the
        metric of the mass matrix."""
        closed = [k for k, mode in enumerate(self.modes) if mode != OPEN]
        if not closed:
            return x
        gaps = {k: self.normal[k] for k in closed if k in self.placed}
        held = [self.normal[k] for k in closed if self.records[k].normal]
        held += [row for k in closed if self.still[k] for row in self.tangents[k]]
        return onto_rows(partial(self._numbers, t), x, gaps, held)

    def _impact(self, t: float, x: np.ndarray, at: Numbers, touching: Sequence[int],
                hit: Sequence[int]) -> tuple[np.ndarray, list[int]]:
        """The state after an impact, and the contacts that leave."""
        indices = [row for k in touching for row in self.rows[k]]
        sites = self._sites(at, touching, impact=True)
        v = at.slip[indices]
        law = self.records[hit[0]].impact
        names = ", ".join(self.records[k].name for k in hit)
        D = at.D[np.ix_(indices, indices)]
        if law == STRONGE:
            if len(touching) > 1:
                raise _Stop(f"the impact of {names} is one of {len(touching)} contacts at once, "
                            f"{', '.join(self.records[k].name for k in touching)}; impact='stronge' takes one at a time, as "
                            "energies of several that press at once depend on an order that no law gives; pass 'poisson'")
            one_alone = stronge(D, v, float(at.restitution[touching[0]]), sites[0])
            result = [] if one_alone is None else [one_alone]
        else:
            result = impact(D, v, at.restitution[list(touching)].tolist(), sites, law)
        if not result:
            raise _Stop(f"the impact of {names} has no solution under Coulomb's law and impact='{law}'; take the other law of "
                        "impacts, or less friction")
        if len(result) > 1:
            self._doubt("impact", t, touching, f"the impact of {names} at t = {t:.9g} s has {len(result)} solutions; the one in "
                        f"which contacts are {self._named(touching, result[0])} was taken")
        one = result[0]
        n_q, n_u = self.module.metadata.sizes.q, self.module.metadata.sizes.u
        after = x.copy()
        after[n_q:n_q + n_u] += at.speeds[:, indices] @ one.lam
        gained = float((v + one.w) @ one.lam) / 2
        size = float(np.abs(v) @ np.abs(one.lam))
        if gained > GAINED * size and gained > 1e-12 * self._kinetic_energy(t, x):
            self._doubt("energy", t, touching, f"the impact of {names} at t = {t:.9g} s adds {gained:.3g} J, as Newton's law may "
                        "with friction or several contacts; pass impact='poisson'", gained)
        impulses = np.zeros(len(at.slip))
        impulses[indices] = one.lam
        self.impacts.append(Impact(t, impulses, at.slip, self._numbers(t, after).slip))
        stays = NO_SPEED * np.abs(v).max()
        rebound, k_row = [], 0
        for k, mode in zip(touching, one.modes, strict=True):
            w = one.w[k_row:k_row + self.records[k].rows]
            k_row += self.records[k].rows
            self.still[k] = mode.kind == STICKING or bool(np.abs(w[1:]).max(initial=0.0) <= stays)
            if w[0] > stays:
                rebound.append(k)
        event = self.events[hit[0]]["closes"]
        known = [i for i, one in enumerate(self.happened) if one.t == t and one.event in (self.events[k]["closes"] for k in hit)]
        if known:
            for i in known:
                self.happened[i] = self.happened[i]._replace(before=x, after=after)
        else:
            self.happened.append(Happened(event, t, x.copy(), after))
        for k in rebound:
            self.modes[k] = OPEN
        for k in touching:
            if k not in rebound and self.modes[k] == OPEN:
                self.modes[k] = SLIDING
        struck = self._numbers(t, after)
        for k in self.frictions:  # their forces are finite: an impact may tear the joints that they hold
            self.still[k] = self._slow(struck, k)
        return self._onto_surfaces(t, after), rebound

    def _kinetic_energy(self, t: float, x: np.ndarray) -> float:
        """The largest of the motion so far, J, which the speeds of impacts at rest are rounding of."""
        request, n = self.request, self.request.n_state
        earlier = self.most_kinetic is None
        times = np.concatenate([*(self.ts if earlier else []), [t]])
        states = np.vstack([*(self.xs if earlier else []), x])[:, :n]
        energies = self.module.evaluate("energy", times, states, request.p, request.inputs.rows(times, states))
        most = float(energies[:, 0].max())
        self.most_kinetic = most if self.most_kinetic is None else max(self.most_kinetic, most)
        return self.most_kinetic

    def _sites(self, at: Numbers, chosen: Sequence[int], impact: bool = False) -> list[Site]:
        """The contacts of a problem, with their rows among themselves."""
        sites, first = [], 0
        for k in chosen:
            rows = tuple(range(first, first + self.records[k].rows))
            first += len(rows)
            slip = None
            v = at.slip[self.tangents[k]]
            if not impact and not self.still[k] and len(v):
                size = np.linalg.norm(v)
                slip = v / size if size > 0 else self.directions[k] if self.directions[k].any() else None
            sites.append(Site(rows, float(at.static[k]), float(at.kinetic[k]), slip,
                              excluded=() if impact else tuple(self.ruled_out.get(k, ())),
                              bounded=not self.records[k].normal))
        return sites

    def _share_in_space(self, of: Sequence[int]) -> bool:
        """Whether contacts are some that stick in space and share forces, and no other slides under a load: where one does, loads
        of those that stick are no longer put where they hold."""
        if any(mode == SLIDING and self.tangents[k] and not self._is_light(k) for k, mode in enumerate(self.modes)):
            return False
        shared = self.shared or any(map(self._is_light, range(len(self.records))))
        return shared and all(self.modes[k] == STICKING and self.records[k].tangents == 2 for k in of)

    def _is_light(self, k: int) -> bool:
        """Whether nothing pressed a contact in space when it was last looked at, so that it has no friction."""
        return (self.modes[k] == SLIDING and self.still[k] and self.records[k].tangents == 2 and not self.directions[k].any())

    def _shares_again(self, t: float, x: np.ndarray) -> bool:
        """Whether contacts in space that stick and share forces hold by other shares than those with which some have left their
        cones; these are taken then. Those that nothing pressed before take their share."""
        at, closed = self._numbers(t, x), [k for k, mode in enumerate(self.modes) if mode != OPEN]
        indices = [row for k in closed for row in self.rows[k]]
        modes = [Mode(STICKING, np.zeros(2), True) if self._is_light(k) else
                 Mode(self.modes[k], self.directions[k], True, self.still[k] and self.modes[k] == SLIDING) for k in closed]
        sites = self._sites(at, closed)
        one = held(at.D[np.ix_(indices, indices)], at.free[indices], sites, modes, least=False)
        if one is None:
            return False
        for k, mode in zip(closed, one.modes, strict=True):
            self.modes[k] = mode.kind
        self.shared = one.shared
        self._share(t, closed, one)
        return True

    def _share(self, t: float, closed: Sequence[int], one: Solved) -> None:
        """Take the shares of forces of a solution; raise _Stop where generated code does not give them."""
        self.softness = [(0.0, 0.0)] * len(self.records)
        if one.loose:
            names = ", ".join(self.records[k].name for k in closed)
            raise _Stop(f"contacts {names} stick and share forces; some of these leave their cones of friction, though others "
                        "hold, and at which load the contacts begin to slip is not decided where they are in different planes; "
                        "fewer contacts, compliant ones, or method='moreau' decide it")
        first = 0
        for k in closed:
            if one.softness is not None and self.modes[k] == STICKING and self.records[k].tangents == 2:
                normal, along = one.softness[first:first + 2].tolist()
                self.softness[k] = (1 / along - 1) ** 0.5, (1 / normal - 1) ** 0.5
            first += self.records[k].rows

    def _rule_out(self, at: Numbers, fired: Sequence[tuple[int, str]], kept: Sequence[int]) -> None:
        """Rule out the modes that contacts leave. One that slips has held what others at their bounds, which it kept from
        slipping, did not: they slip with it, and what rounding has left of their bounds does not hold it instead."""
        held = [row for k, row in enumerate(self.normal) if self.records[k].normal and self.modes[k] != OPEN] if kept else []
        for k, what in fired:
            if what in ("opens", "slips"):
                self.ruled_out.setdefault(k, set()).update((STICKING, SLIDING) if what == "opens" else (STICKING,))
            for j in kept if what == "slips" else ():
                if moves_with(at.D, self.tangents[j][0], [*held, *self.tangents[k]]):
                    self.ruled_out.setdefault(j, set()).add(STICKING)

    def _choose_lasting(self, t: float, x: np.ndarray, at: Numbers, closed: Sequence[int]) -> None:
        """The modes of the contacts that are closed, but those whose forces are at their bounds and go on beyond."""
        still, directions, doubts = list(self.still), list(self.directions), copy.deepcopy(self.doubts)
        for _ in closed:
            beyond = self._beyond(t, x, at, self._choose(t, x, at, closed))
            if not beyond:
                return
            self._rule_out(at, beyond, self._kept())
            self.still, self.directions, self.doubts = list(still), list(directions), copy.deepcopy(doubts)
        self._choose(t, x, at, closed)

    def _beyond(self, t: float, x: np.ndarray, at: Numbers, forces: np.ndarray) -> list[tuple[int, str]]:
        """Contacts whose forces are beyond their bounds, by what the laws of contact take for rounding, and go on from there:
        they open or slip at once, since no zero of their events follows. forces: of all rows."""
        size = float(np.abs(forces).max(initial=0.0))
        candidates = {}  # events with the sizes of what stands in them
        for k, (mode, own) in enumerate(zip(self.modes, self.events, strict=True)):
            pressed = float(forces[self.normal[k]]) if self.records[k].normal else 1.0
            if mode != OPEN and "opens" in own and pressed <= AT_BOUND * size:
                candidates[k, "opens"] = size
            bound = float(at.static[k]) * pressed
            if mode == STICKING and bound - np.linalg.norm(forces[self.tangents[k]]) <= AT_BOUND * size:
                candidates[k, "slips"] = size * max(bound, ROUNDED_SPEEDS * size)
        if not candidates:
            return []
        p, n, end = self._parameters(), self.request.n_state, self.request.span[1]
        indices, sizes = [self.events[k][what] for k, what in candidates], np.array(list(candidates.values()))
        now = self._values("events", t, x[:n], p)[indices]
        rate = self._values("rhs", t, x[:n], p).copy()
        unknown, result = now < 0, np.zeros(len(indices), dtype=bool)
        after = self.begins.shortest(t)
        while unknown.any() and after <= min(LONGEST * self.begins.length, end - t):
            change = self._values("events", t + after, self._stepped(t, x, rate, p, after), p)[indices] - now
            known = unknown & (np.abs(change) > ROUNDED_SPEEDS * sizes)
            result |= known & (change < 0)
            unknown &= ~known
            after *= LARGER
        return [one for one, goes in zip(candidates, result.tolist(), strict=True) if goes]

    def _choose(self, t: float, x: np.ndarray, at: Numbers, closed: Sequence[int]) -> np.ndarray:
        """The modes of the contacts that are closed, from the accelerations; the others are open. The forces of all rows."""
        indices = [row for k in closed for row in self.rows[k]]
        D, b = at.D[np.ix_(indices, indices)], at.free[indices]
        result = solutions(D, b, self._sites(at, closed)) if indices else []
        if indices and not result and self.ruled_out:  # an acceleration that begins at zero has the sign of rounding
            later = self._numbers(*self._a_moment_later(t, x))
            result = solutions(later.D[np.ix_(indices, indices)], later.free[indices], self._sites(at, closed))
        if indices and not result and self.ruled_out:
            self.ruled_out = {}
            result = solutions(D, b, self._sites(at, closed))
        if indices and not result:
            names = ", ".join(self.records[k].name for k in closed)
            raise _Stop(f"contacts {names}: no accelerations fulfil the laws of contact and friction (Painleve's paradox: "
                        "friction pushes the bodies into each other faster than any force separates them); less friction, or "
                        "elasticity where they touch, leaves a solution")
        if len(result) > 1:
            self._doubt("motions", t, closed, f"at t = {t:.9g} s the laws of contact and friction allow {len(result)} motions "
                        f"(Painleve); the one in which contacts are {self._named(closed, result[0])} was taken")
        border = [closed[k] for k in degenerate(D, b, self._sites(at, closed), result[0])] if result else []
        if border:
            named = ", ".join(self.records[k].name for k in border)
            self._doubt("border", t, border, f"at t = {t:.9g} s contacts {named} are on the border of two modes with the same "
                        f"accelerations; {self._named(closed, result[0])} was taken, and a small change of the state may lead "
                        "to another motion")
        self.modes = [OPEN] * len(self.records)
        begins = {}
        self.shared = bool(result) and result[0].shared
        for k, mode in zip(closed, result[0].modes if result else (), strict=True):
            self.modes[k] = mode.kind
            self.directions[k] = mode.direction if mode.kind == SLIDING else np.zeros(self.records[k].tangents)
            if self.still[k] and mode.kind == SLIDING and self.records[k].tangents > 0 and not mode.kept:
                begins[k] = self.directions[k]
            self.still[k] = mode.kept or mode.kind == STICKING
        if result:
            self._share(t, closed, result[0])
        self.begins.switched(t, begins, {k: record.tangents == 2 for k, record in enumerate(self.records)
                                         if self.modes[k] == SLIDING})
        forces = np.zeros(len(at.free))
        if result:
            forces[indices] = result[0].lam
        self.pressed = float(np.abs(forces).max(initial=0.0))
        return forces

    def _doubt(self, kind: str, t: float, of: Sequence[int], text: str, weight: float = 0.0) -> None:
        """Note what to warn of, with its contacts."""
        text = f"{self.module.name}: {text}"
        doubt = self.doubts.get(kind)
        if doubt is None:
            self.doubts[kind] = doubt = _Doubt(text, weight)
        else:
            doubt.more, doubt.until = doubt.more + 1, t
            if weight > doubt.weight:
                doubt.text, doubt.weight = text, weight
        doubt.names |= dict.fromkeys(self.records[k].name for k in of)

    def _wait(self, t: float) -> None:
        """Look for events that are not looked for again after a part of the run."""
        begin, end = self.request.span
        self.until = t + GRACE * (end - begin)

    def _slipped(self, t: float, x: np.ndarray) -> tuple[np.ndarray, list[tuple[int, str]]]:
        """The end of a part of a phase that ends where slips have begun: the state, where directions of friction were held with
        slips along these; contacts that stick again before their slip was looked at."""
        held, p = self.begins.directions, self._parameters()
        left = self._outside(t, x, p) if self.shared and not held else []
        if left:
            return x, left
        self.begins.directions = {}
        if held:
            slip = self._numbers(t, x).slip
            fired = [(k, "sticks") for k, mode in enumerate(self.modes)  # of others, too: nothing looked at their slips
                     if mode == SLIDING and self.directions[k].any() and slip[self.tangents[k]] @ self.directions[k] < 0]
            if fired:
                return x, fired
            began = max((since for k, since in self.begins.since.items() if k in held), default=None)
            return self._realigned(t, x, held, p, self._parameters(), began), []
        if self.begins.since:
            at = self._by_modes(t, x)
            rates: dict[int, float] = {}
            for k in self.begins.since:
                rates[k] = turning(at, self.tangents[k])
            self.begins.settled(t, rates)
        return x, []

    def _outside(self, t: float, x: np.ndarray, p: np.ndarray) -> list[tuple[int, str]]:
        """Contacts in space that share forces and have left their cones where nothing looked at these."""
        force, result = self._by_modes(t, x, p).force, []
        static = self._numbers(t, x).static
        for k, mode in enumerate(self.modes):
            if mode == STICKING and self.records[k].tangents == 2:
                bound = float(static[k]) * float(force[self.normal[k]])
                if bound < float(np.linalg.norm(force[self.tangents[k]])):
                    result.append((k, "slips"))
        return result

    def _realigned(self, t: float, x: np.ndarray, held: Mapping[int, np.ndarray], before: np.ndarray, after: np.ndarray,
                   zero: float | None) -> np.ndarray:
        """The state with slips along directions, and its columns; before, after: parameters, zero: when slips in space end or
        began."""
        n, request = self.request.n_state, self.request
        result = self._aligned(t, x, held)
        if not request.columns and not self.keeps:
            return result
        again = partial(self._aligned_again, tuple(self.modes), tuple(self.directions), held)
        switch = Switch(self.module, t, x[:n].copy(), result[:n].copy(), before, after, (), again,
                        request.span[1] - request.span[0], request.inputs, zero)
        if self.keeps:
            self.crossed.append(switch)
        if request.columns:
            try:
                result[n:] = switch.along(switch.moves(x[n:].reshape(-1, n), request.columns))[1].ravel()
            except EvaluationError as error:
                raise _Stop(str(error)) from None
        return result

    def _aligned_again(self, modes: Sequence[str], directions: Sequence[np.ndarray], held: Mapping[int, np.ndarray], t: float,
                       x: np.ndarray, p: np.ndarray, inputs: Any) -> tuple[np.ndarray, Any]:
        """The state with slips along directions that is made of another one."""
        other = copy.copy(self)
        other.request = replace(self.request, p=p, inputs=inputs)
        other.latest_numbers, other.evaluators, other.modes, other.directions = None, {}, list(modes), list(directions)
        return other._aligned(t, x, held), None

    def _aligned(self, t: float, x: np.ndarray, held: Mapping[int, np.ndarray]) -> np.ndarray:
        """The state after the impulses by which friction that follows the slip differs from friction along held directions:
        across these, with the normal impulses that keep contacts closed and their friction."""
        across = {k: np.array([-d[1], d[0]]) for k, d in held.items() if len(d) == 2}
        closed = [k for k, mode in enumerate(self.modes) if mode != OPEN]
        indices = [row for k in closed for row in self.rows[k]]
        at = self._numbers(t, x)
        columns, kept = [], []
        for k in closed if across else ():
            normal = np.zeros(len(at.slip))
            if self.records[k].normal:
                normal[self.normal[k]] = 1.0
                kept.append(normal)
                along = normal.copy()
                if self.modes[k] == SLIDING:
                    along[self.tangents[k]] = -at.kinetic[k] * self.directions[k]
                columns.append(along)
            for direction in [across[k]] if k in across else np.eye(len(self.tangents[k])) if self.modes[k] == STICKING else ():
                row = np.zeros(len(at.slip))
                row[self.tangents[k]] = direction
                columns.append(row)
                kept.append(row)
        if not columns:
            return x
        H, G = np.array(columns).T[indices], np.array(kept)[:, indices]
        impulse = H @ least_solution(G @ at.D[np.ix_(indices, indices)] @ H, -G @ at.slip[indices])
        n_q, n_u, x = len(at.coordinates), len(at.speeds), x.copy()
        x[n_q:n_q + n_u] += at.speeds[:, indices] @ impulse
        return x

    def _named(self, chosen: Sequence[int], one: Solved) -> str:
        return ", ".join(f"{self.records[k].name} {mode.kind}" for k, mode in zip(chosen, one.modes, strict=True))

    def _zeno(self, t: float, at: Numbers, rebound: Sequence[int], hit: Sequence[int]) -> list[int]:
        """Contacts whose next flights are too short to be followed: they stay closed. The time at which the flights have come to
        their end is noted: for a ball it is the sum of a geometric series."""
        if not rebound:
            return []
        closed = [k for k, mode in enumerate(self.modes) if mode != OPEN]
        indices = [row for k in closed for row in self.rows[k]]
        lam = np.zeros(len(at.free))
        if indices:
            result = solutions(at.D[np.ix_(indices, indices)], at.free[indices], self._sites(at, closed))
            lam[indices] = result[0].lam if result else 0.0
        w = at.free + at.D @ lam
        begin, end = self.request.span
        shortest = max(SHORTEST_FLIGHT * (end - begin), RESOLVED_FLIGHT * abs(t))
        resting = []
        for k in rebound:
            row, e = self.normal[k], float(at.restitution[k])
            if w[row] >= 0 or e >= 1 or k in self.clutches:
                continue
            flight = -2 * float(at.slip[row]) / float(w[row])
            if flight < shortest or flight * float(at.slip[row]) / 4 < LOWEST_FLIGHT * self.size:
                resting.append(k)
                self.impacts[-1] = self.impacts[-1]._replace(rest={**self.impacts[-1].rest, k: t + flight / (1 - e)})
        return resting

    # -- the result

    def _whole(self, t: float, x: np.ndarray, message: str, cause: BaseException | None, interrupted: bool,
               over: bool) -> Outcome:
        width = len(self.request.x0)
        times, states = np.array(self.request.span[:1]), self.request.x0[None, :].copy()
        if self.ts:
            times, states = (parts[0] if len(parts) == 1 else np.concatenate(parts) for parts in (self.ts, self.xs))
        phase_of = np.repeat(np.arange(len(self.ts)), [len(one) for one in self.ts]) if len(self.ts) > 1 else np.zeros(
            len(times) if self.ts else 0, dtype=int)
        notes: dict[str, Any] = {"phases": tuple(self.phases), "impacts": tuple(self.impacts)}
        happened = sorted(self.happened, key=lambda one: one.t)
        if not self.done:
            return Outcome(times, states.reshape(-1, width), False, message, interrupted, 0, 0, 0, cause=cause,
                           happened=happened, doubts=tuple(map(str, self.doubts.values())), **notes)
        if message and not over and (not len(times) or t > times[-1]):
            times, states = np.append(times, t), np.vstack([states, x])
            phase_of = np.append(phase_of, len(self.ts) - 1)
        return of_pieces(self.done, times, states, self.n_steps, message, cause, interrupted, over, happened=happened,
                         doubts=tuple(map(str, self.doubts.values())), row_phases=phase_of, **notes)
