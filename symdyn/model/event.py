"""Events: where a quantity of the motion passes zero, and what happens there."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import sympy as sp

from symdyn.model.faults import Faults
from symdyn.model.quantity import Quantity
from symdyn.model.symbols import symbols_of, take_over
from symdyn.shown import name_of, shown

_DIRECTIONS = (-1, 0, 1)


@dataclass(frozen=True)
class Event:
    """An event by name.

    value      an expression of coordinates, speeds, states, inputs, t, parameters, and of points, orientations and reactions
    direction  1: value goes up through zero, -1: down, 0: either way
    stop       whether the motion ends there
    reset      symbols of coordinates, speeds and states with what they become, from the state before the event
    """

    name: str
    value: sp.Expr
    direction: int
    stop: bool
    reset: tuple[tuple[sp.Symbol, sp.Expr], ...]

    @property
    def expressions(self) -> list[sp.Expr]:
        """Its value, then what its resets become."""
        return [self.value, *[e for _, e in self.reset]]


def make_event(faults: Faults, name: Any, value: Any, direction: Any, stop: Any, reset: Any) -> Event | None:
    """An event as it was requested; what is wrong with it alone is added to the faults. None where its value is no expression."""
    where = f"event {shown(name)}"
    before = len(faults)
    taken = faults.expression(value, where)
    usable = len(faults) == before
    if isinstance(direction, bool) or not isinstance(direction, (int, float, sp.Integer, np.integer)) \
            or direction not in _DIRECTIONS:
        faults.append(f"{where}: direction is {shown(direction)}; pass 1 (upwards through zero), -1 (downwards) or 0 (either "
                      "way)")
        direction = 0
    if not isinstance(stop, bool):
        faults.append(f"{where}: stop is {shown(stop)}; pass True or False")
        stop = False
    if reset is not None and not isinstance(reset, Mapping):
        faults.append(f"{where}: reset is {shown(reset)}; pass a dict such as {{v: -e*v}}")
        reset = None
    if stop is True and reset:
        faults.append(f"{where} has stop=True and a reset, which nothing would follow; leave one of them out")
    changed = []
    for key, becomes in (reset or {}).items():
        symbol = take_over(key) if isinstance(key, sp.Basic) else sp.Symbol(name_of(key))
        changed.append((symbol, faults.expression(becomes, f"{where}: reset of {key}")))
    return Event(name, taken, int(direction), bool(stop), tuple(changed)) if usable else None


def check_events(events: Sequence[Event], state: Iterable[sp.Symbol], moving: Iterable[sp.Symbol],
                 faults: Faults) -> tuple[Event, ...]:
    """The events with their resets by the symbols of the state [q; u; z]; what does not fit is added to the faults."""
    known, free = {s.name: s for s in state}, set(moving)
    checked = []
    for event in events:
        if not isinstance(event.name, str) or not event.name.isidentifier():
            faults.append(f"an event is named {shown(event.name)}; pass an identifier such as 'lands'")
        if free.isdisjoint(symbols_of(event.value)) and not event.value.has(Quantity):
            faults.append(f"event {shown(event.name)} is {event.value}, which stays the same all the time; pass an expression of "
                          "coordinates, speeds, states, inputs or t")
        strange = [s.name for s, _ in event.reset if s.name not in known]
        if strange:
            faults.append(f"event {shown(event.name)} resets {', '.join(strange)}; only coordinates, speeds and states can be "
                          "reset: "
                          f"{', '.join(known) or 'there are none'}")
        checked.append(Event(event.name, event.value, event.direction, event.stop,
                             tuple((known[s.name], e) for s, e in event.reset if s.name in known)))
    return tuple(checked)
