"""Times at which curves are marked: events, changes of the modes of contacts, and impacts."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from symdyn.runtime.integrating.simulate import of_contacts

if TYPE_CHECKING:
    from symdyn.runtime.solutions.solution import Solution

# Instants of one kind that are marked at most.
MOST_MARKS = 80


class Mark(NamedTuple):
    """A time, s, and the name of what happens then."""

    t: float
    name: str


def events_of(solution: Solution) -> list[Mark]:
    """The system's events in the order of time, without those of rigid contacts, which `switches_of` has; none where there are
    too many to be seen."""
    about = solution.module.metadata
    touching = {event.name for event, own in zip(about.events, of_contacts(about), strict=True) if own}
    result = sorted(Mark(float(t), name) for name, rows in solution.events.items() if name not in touching for t in rows.t)
    return result if len(result) <= MOST_MARKS else []


def switches_of(solution: Solution) -> list[Mark]:
    """Modes that contacts change to, and their impacts, in the order of time; none at too many instants to be seen."""
    if not len(solution.t):
        return []
    begin = float(solution.t[0])
    result = sorted(Mark(float(t), f"{name}: {mode}") for name, one in solution.contacts.items()
                    for t, mode in (*one.switches, *((t, "impact") for t in one.impacts.t)) if t != begin)
    return result if len({mark.t for mark in result}) <= MOST_MARKS else []
