"""`symdyn bench`: measures symdyn."""

from __future__ import annotations

import argparse
import contextlib
from pathlib import Path
from typing import TYPE_CHECKING

from symdyn.cli.messages import FAILED, Stop

if TYPE_CHECKING:
    from symdyn.bench.work.subject import Subject


def work(arguments: argparse.Namespace) -> int:
    """Measure what motions cost at every accuracy."""
    from symdyn.bench.work.command import run

    return FAILED if run(arguments, from_file) else 0


def from_file(path: Path, end: float | None) -> Subject:
    """What is measured of a user's file; if its system() has an option `orientation`, in angles and in parameters."""
    from symdyn.bench.work.cases import file_name
    from symdyn.bench.work.subject import Subject
    from symdyn.cli import userfile

    systems = {"": userfile.from_file(path, {})}
    with contextlib.suppress(Stop):  # it has no such option
        systems["parameters"] = userfile.from_file(path, {"orientation": "parameters"})
    return Subject(file_name(path.stem), systems, float(end or systems[""].duration))


def peers(arguments: argparse.Namespace) -> int:
    """Measure symdyn beside its peers; a missed bound is a failure."""
    from symdyn.bench.peers.command import run

    return FAILED if run(arguments.models, arguments.repeats, arguments.json) else 0


def growth(arguments: argparse.Namespace) -> int:
    """Measure how everything grows with the number of bodies."""
    from symdyn.bench import growth as measured

    if any(n < 1 for n in arguments.sizes or ()):
        raise Stop(f"--sizes takes numbers of bodies, 1 or more; found {' '.join(map(str, arguments.sizes))}")
    return measured.run(arguments.sizes or measured.SIZES, arguments.output or Path("generated") / "growth")


def loops(arguments: argparse.Namespace) -> int:
    """Measure mechanisms with loops beside what is known of them; a missed bound is a failure."""
    from symdyn.bench.loops import run

    return FAILED if run(arguments.systems, arguments.repeats, arguments.json) else 0
