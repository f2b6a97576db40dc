"""Events: times at which a quantity passes zero within steps of an integrator, and what happens there."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from symdyn.errors import ArgumentError, EvaluationError

if TYPE_CHECKING:
    from symdyn.runtime.module import Module

EVENTS, RESETS = "events", "event_resets"
# Parts of a step at whose ends the quantities are looked at: two zeros within one part go unseen.
PARTS = 8
# Events closer than this part of the span of the run happen at one time.
AT_ONCE = 1e-14
# So many resets, each within this part of the span after the one before: the motion comes to rest there, or chatters.
CHATTER, MOST_RESETS = 1e-10, 5

Between = Callable[[float], np.ndarray]


class EventRows(NamedTuple):
    """An event of a motion: when it happened, t (n,), and the states just before, x (n, n_x)."""

    t: np.ndarray
    x: np.ndarray


def wanted(module: Module, asked: Any) -> np.ndarray:
    """Which of the module's events are looked for, (n_e,) of bool; asked: True, False or names.

    Raises ArgumentError for names that the mechanism has no event of.
    """
    names = [e["name"] for e in module.metadata.get(EVENTS, ())]
    if isinstance(asked, (bool, np.bool_)) or asked is None:
        return np.full(len(names), asked is None or bool(asked))
    chosen = [str(a) for a in ([asked] if isinstance(asked, str) or not isinstance(asked, Iterable) else asked)]
    strange = [a for a in chosen if a not in names]
    if strange:
        raise ArgumentError(f"{module.name}: events {', '.join(strange)} asked for; there are {', '.join(names) or 'none'}; "
                            "add one to the system with add_event")
    return np.array([n in chosen for n in names], dtype=bool)


def rows_of(module: Module, happened: Sequence[tuple[int, float, np.ndarray]], n_x: int) -> dict[str, EventRows]:
    """Times and states by event."""
    rows = {}
    for k, event in enumerate(module.metadata.get(EVENTS, ())):
        own = [(t, x) for index, t, x in happened if index == k]
        states = np.array([x[:n_x] for _, x in own]).reshape(len(own), n_x)
        rows[event["name"]] = EventRows(np.array([t for t, _ in own]), states)
    return rows


def ended(module: Module, k: int, t: float) -> str:
    """What to say of a motion that an event has ended."""
    return f"event {module.metadata[EVENTS][k]['name']} ended the motion at t = {t:.9g} s"


def at_once(module: Module, k: int) -> str:
    """What to say where a reset is followed by the same event at once, again and again."""
    name = module.metadata[EVENTS][k]["name"]
    return (f"{MOST_RESETS} events, {name} the last, with hardly any time between: its reset leads back to it, or the motion "
            "comes to rest there; give it stop=True, or a reset that lets the quantity leave zero")


def not_known(module: Module, k: int) -> str:
    """What to say where the quantity of an event is not a number."""
    return f"event {module.metadata[EVENTS][k]['name']} cannot be evaluated: the result is not finite"


class Locator:
    """Looks for events in the steps of a run.

    p        parameters; look: which events, (n_e,) of bool; given: inputs at (t, x)
    n_state  entries of x that are the mechanism's state; span: of the run, s
    """

    def __init__(self, module: Module, p: np.ndarray, look: np.ndarray, given: Callable[[float, np.ndarray], Any], n_state: int,
                 span: float) -> None:
        self.module, self.p, self.look, self.given, self.n_state = module, p, look, given, n_state
        self.records = module.metadata[EVENTS]
        self.resolution = AT_ONCE * abs(span)
        self.side, self.left = np.zeros(len(look)), np.zeros(len(look))
        self.starts = np.cumsum([0, *[len(record["reset"]) for record in self.records]])
        self.latest, self.repeated = np.inf, 0  # of resets
        self.fired: list[int] = []  # the events of the latest time
        self.happened: list[tuple[int, float, np.ndarray]] = []
        self.known = 0.0  # up to when the quantities are known
        self.apart = module.unit(EVENTS).evaluator(EVENTS)
        self.apart.set_params(p)
        self.over = ""  # why the run ends at an event
        self.failed = ""  # or fails at it

    def values(self, t: float, x: np.ndarray) -> np.ndarray:
        """What vanishes at the events, (n_e,); NaN where that is not known of one that is not looked for.

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

    def begin(self, t: float, x: np.ndarray, xd: np.ndarray, step: float) -> None:
        """Note on which side of zero every quantity is, or, at zero, which it goes to; step: a small one, with sign."""
        value = self.values(t, x)
        change = self.values(t + step, x + step * xd) - value
        # What has just vanished counts as zero, whatever rounding has left of it, unless a reset has moved it from there.
        left = 2 * np.abs(self.left) + np.abs(change)
        at_zero = (value == 0) | (np.isin(np.arange(len(value)), self.fired) & (np.abs(value) <= left))
        self.side = np.sign(np.where(at_zero, change, value))
        self.known = t

    def first(self, t_old: float, t_new: float, between: Between) -> float | None:
        """The time of the first events in a step, which are noted; between(s): the state within it. None: there is none."""
        left = t_old
        for s in np.linspace(t_old, t_new, PARTS + 1)[1:]:
            now = np.sign(self.values(s, between(s)))
            passed = [int(k) for k in np.flatnonzero(self.look & (now != self.side) & (self.side != 0))
                      if self.records[k]["direction"] in (0, -self.side[k])]
            if passed:
                return self._note({k: self._root(k, left, float(s), between) for k in passed}, t_old, between)
            self.side = np.where(now != 0, now, self.side)
            left = self.known = float(s)
        return None

    def after(self, t: float, x: np.ndarray) -> np.ndarray | None:
        """The state that the motion goes on from; None if no event changed it."""
        changed = [k for k in self.fired if self.records[k]["reset"]]
        if not changed:
            return None
        becomes = self.module.evaluate(RESETS, t, x[:self.n_state], self.p, self.given(t, x[:self.n_state]))
        state = x.copy()
        for k in changed:
            state[self.records[k]["reset"]] = becomes[self.starts[k]:self.starts[k + 1]]
        return state

    def _root(self, k: int, left: float, right: float, between: Between) -> float:
        """The zero of one quantity, which leaves its side between left and right."""
        from scipy.optimize import brentq

        def value(s: float) -> float:
            return float(self.values(s, between(s))[k]) * self.side[k]

        a, b = left, right
        while value(a) <= 0:  # it begins at its zero: the quantity comes back to it after a while, or at once
            if abs(b - a) <= self.resolution:
                return left
            middle = 0.5 * (a + b)
            a, b = (middle, b) if value(middle) > 0 else (a, middle)
        return float(brentq(value, a, b, xtol=max(4e-16 * abs(b), 1e-300), rtol=1e-15)) if value(b) < 0 else b

    def _note(self, roots: dict[int, float], t_old: float, between: Between) -> float:
        t = min(roots.values(), key=lambda s: abs(s - t_old))
        before = between(t)
        self.left = self.values(t, before)
        self.known = t
        self.fired = events = [k for k, s in roots.items() if abs(s - t) <= self.resolution]
        self.happened += [(k, t, before) for k in events]
        if any(self.records[k]["reset"] for k in events):
            near = abs(t - self.latest) <= CHATTER / AT_ONCE * self.resolution
            self.repeated, self.latest = self.repeated + 1 if near else 1, t
        stopping = [k for k in events if self.records[k]["stop"]]
        if stopping:
            self.over = ended(self.module, stopping[0], t)
        elif self.repeated >= MOST_RESETS:
            self.failed = at_once(self.module, events[0])
        return t
