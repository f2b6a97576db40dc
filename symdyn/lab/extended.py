"""Ends of motions with more digits than floats have: references for `symdyn bench loops`, and of a compliant contact.

`symdyn bench extended andrews_squeezer` makes the end of a motion again, at two tolerances, and stores the digits in
extended.json next to this module, or in another file.
"""

from __future__ import annotations

import math
import time as clock
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from symdyn.bench import kept
from symdyn.errors import ArgumentError
from symdyn.lab import contact_cases
from symdyn.lab.loop_cases import CASES
from symdyn.precision.motion import DIGITS, record
from symdyn.systems import get

STORE = Path(__file__).with_name("extended.json")


def stored() -> dict[str, dict[str, Any]]:
    """Every stored motion, by the name of its system."""
    return kept.read(STORE) or {}


def known(name: str) -> Mapping[str, Any] | None:
    """The stored end of a system's motion, numbers as text; None if there is none."""
    return stored().get(name)


def run(names: Sequence[str], end: float | None = None, digits: int = DIGITS, print_only: bool = False,
        file: Path | None = None) -> int:
    """Make the ends of motions again, print them and, unless `print_only`, store them; returns 0.

    names   of the catalogue, variants such as "flyball_governor(rods)", or those of symdyn.lab.contact_cases
    end     s (default: the system's duration, which is the published one)
    digits  of the local errors
    file    to store them in next to what it holds (default: the package's)
    """
    if end is not None and not 0 < end < math.inf:
        raise ArgumentError(f"the end is {end!r}; pass a positive time, s")
    if digits < 1:
        raise ArgumentError(f"{digits} digits were asked for; pass 1 or more")
    if not print_only:
        file = kept.writable(file, STORE)
    for name, system in [(name, _system(name)) for name in names]:
        begun = clock.perf_counter()
        made = record(system.equations(), system.duration if end is None else end, digits)
        print(f"{name} at t = {made['t']:g} s: {made['digits']} digits, runs of tolerance {' and '.join(made['tolerances'])} "
              f"differ by {made['runs_differ_by']:.2g}; {made['steps']} steps, {made['evaluations']} evaluations, "
              f"{clock.perf_counter() - begun:.0f} s")
        for what in ("q", "q_dot", "q_ddot", "lambda"):
            print(f"  {what}: {', '.join(made[what])}")
        if file is not None and not print_only:
            kept.put(file, name, made)
    return 0


def _system(name: str) -> Any:
    if name in contact_cases.CASES:
        return contact_cases.CASES[name]()
    return CASES[name].system() if name in CASES else get(name)
