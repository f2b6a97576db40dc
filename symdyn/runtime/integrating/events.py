"""Events: times at which a quantity passes zero within steps of an integrator, and what happens there."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from symdyn import panels
from symdyn.contact_kinds import RELEASES, TOUCHES
from symdyn.errors import ArgumentError, EvaluationError
from symdyn.runtime.integrating.stabilization import Projector
from symdyn.shown import LENGTH, name_of
from symdyn.thresholds import AT_ONCE, CLOSE, MOST_HALVINGS, MOST_RESETS, MOST_SECANTS, NEAR

if TYPE_CHECKING:
    from symdyn.runtime.module import Module

EVENTS, RESETS, BOUNDS, RANGES = "events", "event_resets", "event_bounds", "event_ranges"

Between = Callable[[float], np.ndarray]


class EventRows(NamedTuple):
    """An event of a motion: when it happened, t (n,), and the states just before, x (n, n_x)."""

    t: np.ndarray
    x: np.ndarray


class Happened(NamedTuple):
    """One event: which, when, the states (n_x,) just before and just after, which differ by its reset."""

    event: int
    t: float
    before: np.ndarray
    after: np.ndarray


class Carried(NamedTuple):
    """Values that a run takes over from the one before it, at whose end it begins: sides of the quantities of events, (n_e,), 0
    where unknown; of those that have just vanished rates (n_e,), a second, NaN of all others, and their remainders, (n_e,);
    reset: whether the state was changed since.
    """

    sides: np.ndarray
    rates: np.ndarray
    left: np.ndarray
    reset: bool


def wanted(module: Module, asked: Any) -> np.ndarray:
    """Mask of the module's events that are looked for, (n_e,) of bool; asked: True, False or names.

    Raises ArgumentError for names that the mechanism has no event of.
    """
    if isinstance(asked, (bool, np.bool_)) or asked is None:
        return np.full(len(module.metadata.events), asked is None or bool(asked))
    names = [e.name for e in module.metadata.events]
    chosen = [name_of(a) for a in ([asked] if isinstance(asked, str) or not isinstance(asked, Iterable) else asked)]
    strange = [a for a in chosen if a not in names]
    if strange:
        raise ArgumentError(f"{module.name}: events {', '.join(name[:LENGTH] for name in strange[:8])} asked for; there are "
                            f"{', '.join(names) or 'none'}; "
                            "add one to the system with add_event")
    return np.array([n in chosen for n in names], dtype=bool)


def rows_of(module: Module, happened: Sequence[Happened], n_x: int) -> dict[str, EventRows]:
    """Times and states by event."""
    own: list[list[Happened]] = [[] for _ in module.metadata.events]
    for one in happened:
        own[one.event].append(one)
    none = EventRows(np.zeros(0), np.zeros((0, n_x)))
    return {event.name: EventRows(np.array([one.t for one in rows]), np.array([one.before[:n_x] for one in rows])) if rows
            else none for event, rows in zip(module.metadata.events, own, strict=True)}


def ended(module: Module, k: int, t: float) -> str:
    """Message about a motion that an event has ended."""
    return f"event {module.metadata.events[k].name} ended the motion at t = {t:.9g} s"


def at_once(module: Module, happened: Sequence[Happened], near: float) -> str:
    """Message where resets are followed by the same event at once, again and again; near: such a time, s."""
    last = happened[-1]
    times = np.array([one.t for one in happened if module.metadata.events[one.event].reset])
    gaps = np.abs(np.diff(times)) <= near
    n = 1 + int(np.argmin(gaps[::-1]) if not gaps.all() else len(gaps))
    name = module.metadata.events[last.event].name
    return (f"{n} events, {name} the last, with hardly any time between: its reset leads back to it, or the motion "
            "comes to rest there; give it stop=True, or a reset that lets the quantity leave zero")


def not_known(module: Module, k: int) -> str:
    """Message where the quantity of an event is not a number."""
    return f"event {module.metadata.events[k].name} cannot be evaluated: the result is not finite"


def too_quick(module: Module, result: Sequence[tuple[int, float]]) -> str:
    """Warning where quantities, with the time from when on, vary too quickly within steps; "" where none does."""
    if not result:
        return ""
    names = [f"{module.metadata.events[k].name} (from t = {t:.9g} s on)" for k, t in result]
    return (f"{module.name}: zeros of events may be missed: {', '.join(names)} var{'y' if len(names) > 1 else 'ies'} so quickly "
            f"within a step that {panels.MOST_DIVISIONS} divisions do not resolve it; give a max_step as short as its "
            "shortest wave")


def not_proved(module: Module, result: Sequence[tuple[int, float]], spacing: float) -> str:
    """Warning where quantities may pass zero between their samples, with the time from when on; "" where none does, and
    where the user has chosen the spacing of samples."""
    if not result or spacing:
        return ""
    names = [f"{module.metadata.events[k].name} (from t = {t:.9g} s on)" for k, t in result]
    return (f"{module.name}: zeros of events may be missed: {', '.join(names)} may pass zero and back between two samples, which "
            f"{panels.MOST_PROOFS} divisions of a step do not rule out; give event_spacing, the time between samples, as short "
            "as the shortest pulse that matters")


def entangled(module: Module, happened: Sequence[Happened], times: Sequence[float]) -> str:
    """Warning where derivatives across events at one time, the first of these times, depend on their order; "" where none
    do."""
    if not times:
        return ""
    there = [module.metadata.events[one.event] for one in happened if one.t == times[0]]
    resetting = [event for event in there if event.reset]
    names = [event.name for event in (resetting if len(resetting) > 1 else there)]
    return (f"{module.name}: the events {', '.join(names)} happen at one time, t = {times[0]:.9g} s, and what they do together "
            "depends on their order, which changes with what derivatives are by: there are none, and the numbers take them for "
            "one event, at the time of the first one that resets; take another start, or one event with all resets")


def not_seen(module: Module, look: np.ndarray | None, functions: Sequence[str], spacing: float) -> str:
    """Warning where events depend on functions, about which nothing is known between samples: those of the user, the
    inputs that are given by functions, and those that are not enclosed; "" where none does, and where the user has chosen the
    spacing of samples. Kinks of compliant contacts, at which steps end, change nothing but the error of a step."""
    if look is None or spacing or not look.any():
        return ""
    parts = []
    kinks = {f"{contact.name}_{what}" for contact in module.metadata.compliant for what in (TOUCHES, RELEASES)}
    for record, wanted in zip(module.metadata.events, look, strict=True):
        of = [f"the function {f}" for f in record.functions] + [f"the input {i}" for i in record.inputs if i in functions]
        of += [record.unproved] if record.unproved else []
        parts += [f"{record.name} depends on {', '.join(of)}"] if wanted and of and record.name not in kinks else []
    if not parts:
        return ""
    return (f"{module.name}: zeros of events may be missed: {'; '.join(parts)}, and a pulse of a function between two samples is "
            "not seen; give event_spacing, the time between samples, as short as the shortest pulse that matters")


def zero_between(value: Callable[[float], float], a: float, b: float, at_a: float, at_b: float, least: float) -> float:
    """Where a quantity that is positive at a, or zero where the step begins at its zero, leaves its side before b, by regula
    falsi with halved ends (Illinois). Step by step what symdyn_event_root of c/runtime/events.h does.

    at_a, at_b   its values there; least: times that are closer count as one
    """
    last = 0
    for k in range(MOST_SECANTS + MOST_HALVINGS):
        close = CLOSE * np.finfo(float).eps * max(abs(a), abs(b))
        inside = close if b > a else -close
        if abs(b - a) <= close or at_b == 0.0 or (at_a <= 0.0 and abs(b - a) <= least):
            break
        s = b - at_b * (b - a) / (at_b - at_a) if at_a > 0.0 and k < MOST_SECANTS else 0.5 * (a + b)
        if not (abs(s - a) > 0.25 * close and abs(s - b) > 0.25 * close):
            s = a + inside if abs(s - a) < abs(s - b) else b - inside
        here = value(s)
        if here > 0.0:
            a, at_a, at_b, last = s, here, at_b * (0.5 if last == 1 else 1.0), 1
        else:
            b, at_b, at_a, last = s, here, at_a * (0.5 if last == -1 else 1.0), -1
    return a if at_a <= 0.0 and abs(b - a) <= least else b


class Locator:
    """Looks for events in the steps of a run, step by step as c/runtime/events.h does.

    p        parameters; look: which events, (n_e,) of bool; given: inputs at (t, x)
    n_state  entries of x that are the mechanism's state; span: of the run, s; spacing: of samples at the most, s, 0: any
    """

    def __init__(self, module: Module, p: np.ndarray, look: np.ndarray, given: Callable[[float, np.ndarray], Any], n_state: int,
                 span: float, spacing: float = 0.0) -> None:
        self.module, self.p, self.look, self.given, self.n_state = module, p, look, given, n_state
        self.records = module.metadata.events
        self.direction = np.array([record.direction for record in self.records])
        self.resets = np.array([len(record.reset) > 0 for record in self.records])
        self.resolution = AT_ONCE * abs(span)
        n_e = len(look)
        self.side, self.left, self.now, self.leaving = np.zeros(n_e), np.zeros(n_e), np.zeros(n_e), np.zeros(n_e)
        self.change = np.zeros(n_e)  # of the quantities in a small step before the latest event
        self.kept = np.zeros(n_e, dtype=bool)  # whose side is known where the run goes on from another one
        self.unresolved = np.zeros(n_e, dtype=bool)
        self.starts = np.cumsum([0, *[len(record.reset) for record in self.records]])
        self.latest, self.repeated = np.inf, 0  # of resets
        self.fired: list[int] = []  # the events of the latest time, `at`
        self.at = np.nan
        self.happened: list[Happened] = []
        self.too_quick: list[tuple[int, float]] = []  # quantities that vary too quickly, and from when on
        self.hidden: list[tuple[int, float]] = []  # those not proved to have no zeros between samples, and from when on
        self.spacing = spacing
        self.bounded = look & np.array([record.enclosed for record in self.records])
        self.size: Any = 0.0  # of the entries of the state over the latest step
        self.known = 0.0  # up to when the quantities are known
        self.apart = module.library(EVENTS).evaluator(EVENTS)
        self.apart.set_params(p)
        self.over = ""  # why the run ends at an event
        self.failed = ""  # or fails at it

    def values(self, t: float, x: np.ndarray) -> np.ndarray:
        """Expressions that vanish at the events, (n_e,); NaN where that is not known of one that is not looked for.

        Raises EvaluationError where it is not known of one that is.
        """
        state, inputs = x[:self.n_state], self.given(t, x[:self.n_state])
        try:
            return self.module.evaluate(EVENTS, t, state, self.p, inputs)
        except EvaluationError as error:
            if error.__cause__ is not None:  # which the user's function raised: there is nothing of the others, either
                raise
            values = self.apart.each(t, state, inputs)
        lost = self.look & ~np.isfinite(values)
        if lost.any():
            raise EvaluationError(not_known(self.module, int(lost.argmax())))
        return values

    def carry(self, carried: Carried, step: float) -> None:
        """Go on from another run; step: that of `begin`."""
        vanished = np.isfinite(carried.rates)
        self.fired = np.flatnonzero(vanished).tolist()
        self.change = step * np.where(vanished, carried.rates, 0.0)
        self.side, self.left = np.where(vanished, np.sign(self.change), carried.sides), carried.left
        self.kept = ~vanished & (self.side != 0) & (not carried.reset)

    def begin(self, t: float, x: np.ndarray, xd: np.ndarray, step: float, after_reset: bool = False) -> None:
        """At the start of the run and after a reset: note on which side of zero every quantity is, or, at zero, which it goes to
        within a small step, with sign (0: that is not known yet).

        Zero counts where a quantity goes on in the direction of its event, of what has just vanished only where its reset has
        stopped it.
        """
        self.now = value = self.values(t, x)
        change = self.values(t + step, x + step * xd) - value
        fired = self._has_fired()
        # A quantity that has just vanished counts as zero, whatever rounding has left of it, unless a reset has moved it.
        left = 2 * np.abs(self.left) + np.abs(change)
        self.size = np.abs(x)
        at_zero = (np.abs(value) <= self._noise(t, x)) | (fired & (np.abs(value) <= left))
        stopped = after_reset & self.resets & (np.abs(change) <= 1e-6 * np.abs(self.change))
        leaving = np.where(fired, self.side * stopped, np.where(self.side != self.direction, self.direction, 0))
        self.leaving = np.where(at_zero & ~self.kept, leaving, 0.0)
        self.side = np.where(self.kept, self.side, np.sign(np.where(at_zero, change, value)))
        self.kept[:] = False
        self.known = t

    def first(self, t_old: float, t_new: float, between: Between) -> float | None:
        """The time of the first events in a step, after `known`, which are noted; between(s): the state within it. None: there
        is none."""
        left, ends, divisions, proofs = self.known, [t_new], 0, 0
        self.size = np.maximum(np.abs(between(t_old)), np.abs(between(t_new)))
        most = panels.FEW_DIVISIONS if self.unresolved.any() else panels.MOST_DIVISIONS
        while ends:
            right = ends[-1]
            middle, width = 0.5 * (left + right), abs(right - left)
            divisible = width > max(2 * self.resolution, 16 * np.finfo(float).eps * abs(right))
            if divisible and 0 < self.spacing < panels.WIDEST * width:
                ends.append(middle)
                continue
            try:
                samples, states = self._samples(left, right, between)
            except EvaluationError:
                if not divisible or width < panels.EVALUATED * abs(t_new - t_old):
                    raise
                ends.append(middle)
                continue
            end = states[panels.N - 2]
            if left == self.at:
                self._keep_sides(samples)
            wavy = self._undecided(samples, right, end) if divisible else None
            if wavy is not None and divisions < most:
                divisions += 1
                ends.append(middle)
                continue
            if wavy is not None and not self.unresolved[wavy]:
                self.unresolved[wavy] = True
                self.too_quick.append((wavy, left))
            hidden = self._unproved(left, right, samples, [between(left), *states]) if divisible and wavy is None else None
            if hidden is not None:
                known = hidden in [k for k, _ in self.hidden]
                if proofs < (panels.FEW_DIVISIONS if known else panels.MOST_PROOFS):
                    proofs += 1
                    ends.append(middle)
                    continue
                if not known:
                    self.hidden.append((hidden, left))
            roots = self._roots(left, right, samples, between)
            if roots:
                return self._note(roots, t_old, t_new, between)
            now = samples[panels.N - 1]
            self.side = np.where(now != 0, np.sign(now), self.side)
            self.now, self.known, left = now, right, right
            ends.pop()
        return None

    def after(self, t: float, x: np.ndarray) -> np.ndarray | None:
        """The state that the motion goes on from, on the constraints, whatever keeps steps there; None if no event changed it.

        Raises ProjectionFailed where the constraints do not allow what the resets ask for.
        """
        changed = [k for k in self.fired if self.records[k].reset]
        if not changed:
            return None
        projector = Projector(self.module, self.p)
        state = projector(t, x)
        becomes = self.module.evaluate(RESETS, t, state[:self.n_state], self.p, self.given(t, state[:self.n_state]))
        for k in changed:
            state[list(self.records[k].reset)] = becomes[self.starts[k]:self.starts[k + 1]]
        return projector.keeping(t, state, [index for k in changed for index in self.records[k].reset])

    def goes_on(self, after: np.ndarray) -> None:
        """Note the state after the resets of the latest events."""
        n = len(self.fired)
        self.happened[-n:] = [happened._replace(after=after) for happened in self.happened[-n:]]

    def _samples(self, left: float, right: float, between: Between) -> tuple[np.ndarray, list[np.ndarray]]:
        """The quantities on a panel, (N + 1, n_e), see symdyn.panels, and the states there but at its start."""
        times = left + panels.NODES * (right - left)
        times[panels.N - 1] = right
        states = [between(float(s)) for s in times[1:]]
        inputs = [self.given(float(s), x[:self.n_state]) for s, x in zip(times[1:], states, strict=True)]
        try:
            values = self.module.evaluate(EVENTS, times[1:], np.array(states)[:, :self.n_state], self.p, np.array(inputs))
        except EvaluationError:  # of one that is not looked for, perhaps
            values = np.array([self.values(float(s), x) for s, x in zip(times[1:], states, strict=True)])
        return np.vstack([self.now, values]), states

    def _noise(self, t: float, x: np.ndarray) -> np.ndarray:
        """Changes of the quantities by the rounding of t and of a state within the latest step."""
        eps = np.finfo(float).eps
        nearby = x + eps * panels.roundings(len(x)) * self.size
        return np.abs(self.values(t + 2 * eps * t, nearby) - self.values(t, x))

    def _rounding(self, t: float, x: np.ndarray) -> np.ndarray:
        """The same where quantities are resolved: of those that are bounded no less than they vary by within the rounding, and
        with that of their own operations."""
        noise = self._noise(t, x)
        if not self.bounded.any():
            return noise
        eps, state = np.finfo(float).eps, x[:self.n_state]
        given = np.asarray(self.given(t, state), dtype=float)
        at = np.concatenate([[t], state, given])
        radius = eps * np.concatenate([[2 * abs(t)], panels.DENSE * self.size[:self.n_state], panels.DENSE * np.abs(given)])
        jets = np.zeros((len(at), 6))
        jets[:, 0], jets[:, 1] = at - radius, at + radius
        ranges = self._bounds(RANGES, t, state, given, jets)
        return np.where(self.bounded, np.maximum(noise, ranges[:, 1] - ranges[:, 0]), noise)

    def _bounds(self, name: str, t: float, state: np.ndarray, given: np.ndarray, jets: np.ndarray) -> np.ndarray:
        """BOUNDS or RANGES of the quantities from bounds of t, the state and the inputs, (1 + n_x + n_in, 6)."""
        leaves = self.module.metadata.event_leaves
        return self.module.evaluate(name, t, state, self.p, given, jets[list(leaves)].ravel())

    def _has_fired(self) -> np.ndarray:
        """Mask of the events of the latest time, (n_e,)."""
        return np.isin(np.arange(len(self.look)), self.fired)

    def _keep_sides(self, samples: np.ndarray) -> None:
        """Put quantities that have just vanished, and are at the end of a panel no more than rounding has left of them at their
        zero, on the side that they go to: a panel may be as short as rounding, where a controller has an instant."""
        value = samples[panels.N - 1]
        fired = self._has_fired()
        samples[panels.N - 1] = np.where(fired & (value * self.side < 0) & (np.abs(value) <= np.abs(self.left)), -value, value)

    def _undecided(self, samples: np.ndarray, right: float, end: np.ndarray) -> int | None:
        """The first quantity that may have zeros on a panel which the signs at its ends do not show."""
        wavy = self.look & panels.undecided(samples)
        if not wavy.any():
            return None
        try:
            noise = self._rounding(right, end)
        except EvaluationError:
            return int(wavy.argmax())
        wavy &= panels.size(samples) > panels.NOISE * noise
        return int(wavy.argmax()) if wavy.any() else None

    def _unproved(self, left: float, right: float, samples: np.ndarray, states: Sequence[np.ndarray]) -> int | None:
        """The first quantity that may have zeros between the samples of a panel."""
        if not self.bounded.any():
            return None
        times = left + panels.NODES * (right - left)
        times[panels.N - 1] = right
        rows = np.array([np.concatenate([x[:self.n_state], self.given(float(s), x[:self.n_state])])
                         for s, x in zip(times, states, strict=True)])
        try:
            bounds = self._bounds(BOUNDS, right, rows[0, :self.n_state], rows[0, self.n_state:], panels.jets(left, right, rows))
            doubtful = self.bounded & panels.unproved(samples, bounds)
            most = np.abs(samples[:panels.N]).max(axis=0)
            if doubtful.any():
                doubtful &= most > panels.NOISE * self._rounding(right, states[panels.N - 1])
        except EvaluationError:
            doubtful = self.bounded
        return int(doubtful.argmax()) if doubtful.any() else None

    def _roots(self, left: float, right: float, samples: np.ndarray, between: Between) -> dict[int, float]:
        """Events on a panel on which every quantity is monotone or has no zero, with their times."""
        now = np.sign(samples[panels.N - 1])
        self.side = np.where(self.side == 0, now, self.side)
        leaves = self.look & (self.side != 0) & (self.side == self.leaving)
        self.leaving = np.where((self.side != 0) & ~leaves, 0.0, self.leaving)
        passed = self.look & ~leaves & (self.side != 0) & (now != self.side) & np.isin(self.direction * self.side, (0, -1))
        roots = {k: self._root(k, left, right, samples, between) for k in np.flatnonzero(passed).tolist()}
        return roots | {int(k): left for k in np.flatnonzero(leaves)}

    def _root(self, k: int, left: float, right: float, samples: np.ndarray, between: Between) -> float:
        """The zero of one quantity, which leaves its side between left and right."""
        side = float(self.side[k])
        return zero_between(lambda s: float(self.values(s, between(s))[k]) * side, left, right, side * float(samples[0, k]),
                            side * float(samples[panels.N - 1, k]), self.resolution)

    def _note(self, roots: dict[int, float], t_old: float, t_new: float, between: Between) -> float:
        t = min(roots.values(), key=lambda s: abs(s - t_old))
        before = between(t)
        self.left = self.values(t, before)
        self.known = self.at = t
        events = [k for k, s in roots.items() if abs(s - t) <= self.resolution]
        # Again at once, although its reset sends it away from zero: it goes less far than is resolved.
        no_time = abs(t - self.latest) <= self.resolution
        fresh = [k for k in events if self.leaving[k] == 0 or self.leaving[k] != self.side[k]]
        again = no_time and any(self.resets[k] for k in fresh if k in self.fired)
        self.fired, self.now = events, self.left
        self.side[fresh], self.leaving[events] = -self.side[fresh], 0.0
        self.happened += [Happened(k, t, before, before) for k in events]
        if any(self.records[k].reset for k in events):
            near = abs(t - self.latest) <= NEAR * self.resolution
            self.repeated, self.latest = MOST_RESETS if again else self.repeated + 1 if near else 1, t
            earlier = t - min(1e-6 * abs(t_new - t_old), abs(t - t_old)) * np.sign(t_new - t_old)
            self.change = self.left - self.values(earlier, between(earlier))
        stopping = [k for k in events if self.records[k].stop]
        if stopping:
            self.over = ended(self.module, stopping[0], t)
        elif self.repeated >= MOST_RESETS:
            self.failed = at_once(self.module, self.happened, NEAR * self.resolution)
        return t
