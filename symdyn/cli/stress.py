"""`symdyn stress`: numerical stability under stress."""

from __future__ import annotations

import argparse
import os
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from symdyn.cli.messages import FAILED, INTERRUPTED, Stop, complain
from symdyn.cli.options import options_of

if TYPE_CHECKING:
    from symdyn.model.system import System
    from symdyn.stress.record import Row, StressReport

FILES = ("stress.json", "stress.txt", "stress.html")


def stress(arguments: argparse.Namespace) -> int:
    """Run the checks, print rows as they come, save the report, also of what was finished before an interrupt; a row that failed
    is a failure."""
    from symdyn.bench.work.resume import check_writable
    from symdyn.stress.record import HEAD, Interrupted, described
    from symdyn.stress.run import CHECKS
    from symdyn.stress.run import stress as run

    if arguments.list:
        print("\n".join(f"{check.name:18}{'any mechanism' if check.of_system else 'its own':15}{check.title}"
                        for check in CHECKS.values()))
        return 0
    if arguments.jobs is not None and arguments.jobs < 1:
        raise Stop(f"--jobs must be 1 or more, found {arguments.jobs}")
    folder = arguments.output or Path("generated") / "stress"
    check_writable(folder, FILES)
    options = options_of(arguments)
    if options and not arguments.systems:
        raise Stop("--option goes with names of systems; there are none")
    systems = [_system(name, options) for name in arguments.systems] or None
    shown: list[Row] = []

    def show(row: Row) -> None:
        if not shown:
            print(HEAD)
        shown.append(row)
        print(described(row), flush=True)

    try:
        report = run(systems, arguments.short, arguments.checks, arguments.progress, arguments.jobs or os.cpu_count() or 1, show)
    except Interrupted as stop:
        _print_and_save(stop.report, folder)
        return complain(str(stop), INTERRUPTED)
    _print_and_save(report, folder)
    return 0 if report.passed else FAILED


def _print_and_save(report: StressReport, folder: Path) -> None:
    """Output after the rows."""
    for text in report.left_out:
        print(f"left out: {text}")
    print(report.summary())
    for name in FILES:
        print(f"wrote {report.save(folder / name)}")


def _system(name: str, options: Mapping[str, Any]) -> str | System:
    """A name, which a process can be given, or the system of a file or of options. Raises Stop for a name that there is not."""
    from symdyn.cli.mechanism import find_mechanism, is_file

    system = find_mechanism(name, options)
    return system if options or is_file(name) else name
