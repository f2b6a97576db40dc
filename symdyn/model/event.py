"""Events: where a quantity of the motion passes zero, and what happens there."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import sympy as sp

from symdyn.model.bodies import Component, Point
from symdyn.model.faults import Faults
from symdyn.model.symbols import take_over

_DIRECTIONS = (-1, 0, 1)
# Of a point, what an event can be a component of.
_VECTORS = ("position", "velocity", "acceleration")


@dataclass(frozen=True)
class Event:
    """An event by name.

    value      an expression of coordinates, speeds, states, inputs, t and parameters, or a component of a point plus one
    direction  1: value goes up through zero, -1: down, 0: either way
    stop       whether the motion ends there
    reset      symbols of coordinates, speeds and states with what they become, from the state before the event
    """

    name: str
    value: Any
    direction: int
    stop: bool
    reset: tuple[tuple[sp.Symbol, sp.Expr], ...]

    @property
    def expressions(self) -> list[sp.Expr]:
        """Its expressions; where a point is on its body is not among them."""
        own = [self.value.offset if isinstance(self.value, Component) else self.value]
        return [*own, *[e for _, e in self.reset]]


def make_event(faults: Faults, name: Any, value: Any, direction: Any, stop: Any, reset: Any, planar: bool) -> Event:
    """An event as it was asked for; what is wrong with it alone is added to the faults."""
    where = f"event {name!r}"
    if isinstance(value, Component):
        n = 2 if planar else 3
        if value.point.quantity not in _VECTORS or value.index not in range(n):
            faults.append(f"{where} is component {value.index!r} of a point's {value.point.quantity}; pass component "
                          f"{' or '.join(map(str, range(n)))} of its {', '.join(_VECTORS[:-1])} or {_VECTORS[-1]}")
        at = faults.vector(value.point.at, f"{where}: point", True)
        taken: Any = Component(Point(value.point.body, tuple(at), value.point.quantity), value.index,
                               faults.expression(value.offset, where))
    else:
        taken = faults.expression(value, where)
    if isinstance(direction, bool) or direction not in _DIRECTIONS:
        faults.append(f"{where}: direction is {direction!r}; pass 1 (upwards through zero), -1 (downwards) or 0 (either way)")
        direction = 0
    if not isinstance(stop, bool):
        faults.append(f"{where}: stop is {stop!r}; pass True or False")
    if reset is not None and not isinstance(reset, Mapping):
        faults.append(f"{where}: reset is {reset!r}; pass a dict such as {{v: -e*v}}")
        reset = None
    if stop is True and reset:
        faults.append(f"{where} has stop=True and a reset, which nothing would follow; leave one of them out")
    changed = []
    for key, becomes in (reset or {}).items():
        symbol = take_over(key) if isinstance(key, sp.Basic) else sp.Symbol(str(key))
        changed.append((symbol, faults.expression(becomes, f"{where}: reset of {key}")))
    return Event(name, taken, int(direction), bool(stop), tuple(changed))


def check_events(events: Sequence[Event], state: Iterable[sp.Symbol], moving: Iterable[sp.Symbol],
                 faults: Faults) -> tuple[Event, ...]:
    """The events with their resets by the symbols of the state [q; u; z]; what does not fit is added to the faults."""
    known, free = {s.name: s for s in state}, set(moving)
    checked = []
    for event in events:
        if not isinstance(event.name, str) or not event.name.isidentifier():
            faults.append(f"an event is named {event.name!r}; pass an identifier such as 'lands'")
        if not isinstance(event.value, Component) and free.isdisjoint(event.value.free_symbols):
            faults.append(f"event {event.name!r} is {event.value}, which stays the same all the time; pass an expression of "
                          "coordinates, speeds, states, inputs or t")
        strange = [s.name for s, _ in event.reset if s.name not in known]
        if strange:
            faults.append(f"event {event.name!r} resets {', '.join(strange)}; only coordinates, speeds and states can be reset: "
                          f"{', '.join(known) or 'there are none'}")
        checked.append(Event(event.name, event.value, event.direction, event.stop,
                             tuple((known[s.name], e) for s, e in event.reset if s.name in known)))
    return tuple(checked)
