"""Cost of rigid contacts: switches of the simplest walker, and contacts that stay open.

    walker   the simplest walker (Garcia, Chatterjee, Ruina and Coleman 1998) on its long gait, 341 s down a slope of 0.009 rad at
             rtol 1e-9: processor time by 1,000 steps of the integrator
    open     chains of links above a floor that their ends never reach, over 1 s and 100 s: the processor time of a run by that of
             the same chain without contacts
"""

from __future__ import annotations

import time as clock
from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np
import sympy as sp

import symdyn as sd

WALKER, OPEN = "walker", "open"
# Processor time of 1,000 steps, ms; of a run with contacts that stay open by that without.
BOUNDS = {WALKER: 5.0, OPEN: 1.02}
LINKS, SPANS = (1, 2, 5), (1.0, 100.0)
# Runs that last as long as this many of the shortest.
REPEATS = {1.0: 15, 100.0: 5}


@dataclass(frozen=True)
class Cost:
    """One figure with its bound."""

    name: str
    of: str
    value: float
    unit: str

    @property
    def bound(self) -> float:
        """Bound of the cost."""
        return BOUNDS[self.name]

    def __str__(self) -> str:
        return f"{self.name:12}{self.of:40}{self.value:12.3f} {self.unit}, bound {self.bound:g}"


def walker_system() -> sd.System:
    """The walker with feet of a thousandth of the hip's mass, which do not count in mid-swing."""
    x, y, left, right = sd.coordinates("x y left right")
    system = sd.System("walker", gravity=[sp.sin(0.009), -sp.cos(0.009)])
    carrier, hip = system.add_body("carrier"), system.add_body("hip", mass=1.0)
    system.add_joint(sd.Prismatic("along", system.ground, carrier, axis=[1, 0], coordinate=x))
    system.add_joint(sd.Prismatic("across", carrier, hip, axis=[0, 1], coordinate=y))
    for leg, other in ((left, right), (right, left)):
        body = system.add_body(leg.name, mass=1e-3, inertia=0, com=[0, -1])
        system.add_joint(sd.Revolute(f"{leg.name}_joint", hip, body, coordinate=leg))
        system.add_contact(sd.Contact(f"{leg.name}_foot", body, system.ground, shape=sd.contacts.Point([0, -1]), friction=5,
                                      ignored=0.15 - sp.sin(leg) + sp.sin(other)))
    return system


def chain(n: int, contacts: bool) -> sd.System:
    """A chain of n links, with a contact of every end if so wanted."""
    system = sd.System(f"chain_{n}{'_above_a_floor' * contacts}", gravity=[0, -9.81])
    parent, at = system.ground, [0.0, 0.0]
    for k in range(n):
        link = system.add_body(f"link_{k + 1}", mass=1.0, inertia=0.1, com=[0.5, 0])
        system.add_joint(sd.Revolute(f"joint_{k + 1}", parent, link, parent_point=at))
        if contacts:
            floor = sd.contacts.Plane([0, 1], [0, -10.0 * n])
            system.add_contact(sd.Contact(f"end_{k + 1}", link, system.ground, (sd.contacts.Point([1, 0]), floor), friction=0.5))
        parent, at = link, [1.0, 0.0]
    return system


def _seconds(run: Callable[[], object]) -> float:
    begun = clock.process_time()
    run()
    return clock.process_time() - begun


def of_the_walker(repeats: int) -> Iterator[Cost]:
    """The figure of the walker, from the least of so many times."""
    module = walker_system().compile()
    angle, rate = 0.20031090, -0.19983247  # after a heel strike
    q = [-np.sin(angle), np.cos(angle), angle, -angle]
    u = [-np.cos(angle) * rate, -np.sin(angle) * rate, rate, np.cos(2 * angle) * rate]
    times = np.array([0.0, 341.0])
    solution = module.simulate(times, q, u, rtol=1e-9)
    seconds = min(_seconds(lambda: module.simulate(times, q, u, rtol=1e-9)) for _ in range(5 * repeats))
    strikes = sum(len(contact.impacts.t) for contact in solution.contacts.values())
    yield Cost(WALKER, f"{solution.n_steps} steps, {strikes} heel strikes", 1e6 * seconds / solution.n_steps, "ms by 1,000 steps")


def of_open_contacts(repeats: int) -> Iterator[Cost]:
    """The figures of contacts that stay open, from the least of so many times, by turns."""
    for n in LINKS:
        modules = [chain(n, contacts).compile() for contacts in (False, True)]
        for span in SPANS:
            runs = [lambda m=m, span=span: m.simulate((0, span)) for m in modules]
            for run in runs:
                run()
            times = np.array([[_seconds(run) for run in runs] for _ in range(repeats * REPEATS[span])]).min(axis=0)
            yield Cost(OPEN, f"{n} link{'s' * (n > 1)}, {span:g} s", float(times[1] / times[0]), f"of {1e3 * times[0]:.3f} ms")


COSTS: dict[str, Callable[[int], Iterator[Cost]]] = {WALKER: of_the_walker, OPEN: of_open_contacts}
