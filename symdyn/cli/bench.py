"""`symdyn bench` with mechanisms: work against error."""

from __future__ import annotations

import argparse
import contextlib
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from symdyn.cli.measurements import MEASUREMENTS
from symdyn.cli.messages import FAILED, Stop

if TYPE_CHECKING:
    from symdyn.bench.work.subject import Subject


def work(arguments: argparse.Namespace) -> int:
    """Measure what motions cost at every accuracy."""
    from symdyn.bench.work.command import run

    _look_for_words(arguments.systems)
    return FAILED if run(arguments, from_file) else 0


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


def from_file(path: Path, end: float | None) -> Subject:
    """What is measured of a user's file; if its system() has an option `orientation`, in angles and in parameters."""
    from symdyn.bench.work.cases import file_name
    from symdyn.bench.work.subject import Subject
    from symdyn.cli import userfile

    systems = {"": userfile.from_file(path, {})}
    with contextlib.suppress(Stop):  # it has no such option
        systems["parameters"] = userfile.from_file(path, {"orientation": "parameters"})
    return Subject(file_name(path.stem), systems, float(end or systems[""].duration))
