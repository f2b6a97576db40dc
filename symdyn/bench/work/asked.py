"""Request to the bench, checked: all faults at once."""

from __future__ import annotations

import difflib
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

from symdyn.bench.work import against, methods
from symdyn.bench.work.system_under_test import SystemUnderTest
from symdyn.errors import ArgumentError, no_value

# Ends of the usual grid of tolerances, and the most to a decade.
LOOSEST, TIGHTEST, DENSEST = 1e-3, 1e-15, 10
# Largest tolerance that a method takes.
LARGEST = 0.1


@dataclass(frozen=True)
class Asked:
    """Request to measure, checked.

    formulations   None: all;  steps: s, None: none;  at: further times of interest, s
    budget         s, None: no bound
    """

    formulations: tuple[str, ...] | None
    methods: tuple[str, ...]
    tolerances: tuple[float, ...]
    steps: tuple[float, ...] | None
    repeats: int
    against: tuple[str, ...]
    budget: float | None
    at: tuple[float, ...]


def faults_of(systems: Sequence[SystemUnderTest], formulations: Any = None, method_names: Any = None, tolerances: Any = None,
              steps: Any = None, repeats: Any = 5, peers: Any = (), budget: Any = None, at: Any = (),
              per_decade: Any = 1) -> list[str]:
    """Everything that is wrong with what is requested, a sentence each."""
    known = list(dict.fromkeys(name for tested in systems for name in tested.names))
    # Where nothing was found that could be measured, nothing is known of its formulations.
    faults = [*(_unknown(formulations, known, "formulation") if known else ()),
              *_unknown(method_names, methods.names(), "method"), *_unknown(peers, [*against.names(), against.ALL], "peer")]
    for value in tolerances or ():
        if not (_is_number(value) and TIGHTEST <= value <= LARGEST):
            faults.append(f"the tolerance {value!r} does not lie between {TIGHTEST:g} and {LARGEST:g}")
    shortest = min((s.end for s in systems), default=math.inf)
    if steps and method_names and set(method_names) <= set(methods.names()) - set(methods.FIXED):
        faults.append(f"steps are named, but none of the methods {', '.join(method_names)} has steps of one length; add "
                      f"{' or '.join(methods.FIXED)}, or leave the steps out")
    for value in steps or ():
        if not (_is_number(value) and 0 < value <= shortest):
            faults.append(f"the step {value!r} must be a time, s, of at most the motion's {shortest:g} s")
    for value in at or ():
        if not (_is_number(value) and 0 < value <= shortest):
            faults.append(f"the time {value!r} at which errors are asked for must lie within the motion, 0 to {shortest:g} s")
    if not (_is_whole(repeats) and repeats >= 1):
        faults.append(f"{repeats!r} repeats were asked for; pass a number from 1 on")
    if not (_is_whole(per_decade) and 1 <= per_decade <= DENSEST):
        faults.append(f"{per_decade!r} tolerances to a decade were asked for; pass a number from 1 to {DENSEST}")
    elif per_decade != 1 and tolerances:
        faults.append(f"tolerances are named and {per_decade} to a decade are asked for; pass one of both")
    if budget is not None and not (_is_number(budget) and budget > 0):
        faults.append(f"the budget {budget!r} must be a positive number of seconds")
    for tested in systems:
        if not (math.isfinite(tested.end) and tested.end > 0):
            faults.append(f"the end {tested.end!r} of {tested.name} must be a positive time, s")
        lacking = tested.lacking
        if lacking:
            faults.append(f"{tested.name}: parameters: {no_value(lacking)}; give every parameter a number in the system's "
                          "`defaults`")
    return faults


def checked(systems: Sequence[SystemUnderTest], formulations: Any = None, method_names: Any = None, tolerances: Any = None,
            steps: Any = None, repeats: Any = 5, peers: Any = (), budget: Any = None, at: Any = (), per_decade: Any = 1) -> Asked:
    """Checked request. Raises ArgumentError that lists everything that is wrong with it."""
    formulations, method_names, peers = _listed(formulations), _listed(method_names), _listed(peers)
    tolerances, steps, at = _listed(tolerances), _listed(steps), _listed(at)
    faults = [f"no {what} are named; name some, or leave them out for the usual ones" for what, values in (
        ("formulations", formulations), ("methods", method_names), ("tolerances", tolerances), ("steps", steps)) if values == []]
    faults += faults_of(systems, formulations, method_names, tolerances, steps, repeats, peers, budget, at, per_decade)
    if faults:
        raise ArgumentError("the bench cannot run: " + (faults[0] if len(faults) == 1 else
                                                        f"{len(faults)} faults:\n  - " + "\n  - ".join(faults)))
    once = lambda values: tuple(dict.fromkeys(values))
    peers = against.named(peers or ())
    return Asked(once(formulations) if formulations else None, once(method_names or methods.usual()),
                 tuple(sorted({float(v) for v in tolerances or grid(per_decade)}, reverse=True)),
                 tuple(sorted({float(v) for v in steps}, reverse=True)) if steps else None, repeats, once(peers),
                 budget, tuple(sorted({float(v) for v in at or ()})))


def grid(per_decade: int) -> list[float]:
    """The usual tolerances, so many to a decade; the denser ones begin looser, where the least time below a large error is."""
    decades = -round(math.log10(LOOSEST)), -round(math.log10(TIGHTEST))
    first = decades[0] if per_decade == 1 else decades[0] - 2
    return [10.0**(-k / per_decade) for k in range(first * per_decade, decades[1] * per_decade + 1)]


def _listed(values: Any) -> Any:
    """A single value as a list of one."""
    return None if values is None else list(values) if isinstance(values, Iterable) and not isinstance(values, str) else [values]


def _is_whole(value: Any) -> bool:
    return isinstance(value, int) and not isinstance(value, bool)


def _is_number(value: Any) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool) and math.isfinite(value)


def _unknown(names: Any, known: Sequence[str], what: str) -> list[str]:
    faults = []
    for name in names or ():
        if name not in known:
            near = difflib.get_close_matches(str(name), known, 3)
            faults.append(f"there is no {what} {name!r}; " + (f"did you mean {' or '.join(near)}?" if near else
                                                              f"there are {', '.join(known)}"))
    return faults
