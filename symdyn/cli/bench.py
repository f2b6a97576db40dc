"""`symdyn bench` with mechanisms: work against error."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from typing import TYPE_CHECKING

from symdyn.cli.measurements import MEASUREMENTS
from symdyn.cli.mechanism import find_system_under_test
from symdyn.cli.messages import FAILED, INTERRUPTED, Stop, complain
from symdyn.cli.options import options_of
from symdyn.errors import ArgumentError

if TYPE_CHECKING:
    from symdyn.bench.work.system_under_test import SystemUnderTest


def work(arguments: argparse.Namespace) -> int:
    """Measure what motions cost at every accuracy."""
    from symdyn.bench.work.command import run

    _look_for_words(arguments.systems)
    options = options_of(arguments)

    def find(name: str) -> SystemUnderTest:
        """Raises ArgumentError, so that what is wrong with several names, and besides, is reported at once."""
        try:
            return find_system_under_test(name, options, arguments.end)
        except Stop as stop:
            raise ArgumentError(str(stop)) from None

    try:
        return FAILED if run(arguments, find) else 0
    except KeyboardInterrupt:
        return complain("interrupted; what was measured is kept, the same command goes on", INTERRUPTED)


def _look_for_words(names: Sequence[str]) -> None:
    """Raises Stop for a name that was meant for a measurement of its own."""
    import difflib

    from symdyn.bench.work.cases import known

    for name in names:
        if name in MEASUREMENTS:
            raise Stop(f"{name} is a measurement of its own, which comes first and alone: symdyn bench {name}")
        near = [] if name in known() else difflib.get_close_matches(name, [*known(), *MEASUREMENTS], 3)
        if any(word in MEASUREMENTS for word in near):
            raise Stop(f"there is no mechanism and no measurement {name!r}; did you mean symdyn bench {' or '.join(near)}? "
                       "symdyn bench --help lists measurements, symdyn list mechanisms")
