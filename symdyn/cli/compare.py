"""`symdyn compare`: what slides print beside what symdyn derives."""

from __future__ import annotations

import argparse
import os
from pathlib import Path
from typing import TYPE_CHECKING

from symdyn.cli.messages import FAILED, Stop

if TYPE_CHECKING:
    from symdyn.comparison import Comparisons

OUTPUT = Path("generated/compare")


def compare(arguments: argparse.Namespace) -> int:
    """Compare cases and print the verdicts; where several are compared, or a folder is named, write the reports."""
    if arguments.all and arguments.cases:
        raise Stop("name cases, or pass --all, not both")
    if arguments.jobs is not None and arguments.jobs < 1:
        raise Stop(f"--jobs takes a number of processes from 1 on, found {arguments.jobs}")
    if not arguments.all and not arguments.cases:
        return _list()
    from symdyn.comparison import compare, compare_lecture

    files = [name for name in arguments.cases if name.endswith(".py")]
    if files:
        from symdyn.cli.userfile import cases_from_file

        own = [case for name in files for case in cases_from_file(Path(name))]
        found = compare([*own, *(name for name in arguments.cases if name not in files)])
    else:
        processes = os.cpu_count() or 1
        found = compare_lecture(arguments.cases or None, arguments.jobs or (processes if arguments.all else 1))
    if len(found) == 1 and not arguments.all:
        print(found.cases[0])
    else:
        print(found if arguments.all else "\n\n".join(map(str, found)))
    if arguments.all or arguments.output:
        _write(found, arguments.output or OUTPUT)
    return 0 if found.decided else FAILED


def _write(found: Comparisons, folder: Path) -> None:
    from symdyn.comparison.reports import write_reports

    for path in write_reports(found, folder):
        print(path)


def _list() -> int:
    from symdyn.lecture import cases

    rows = [(c.name, c.slide.section if c.slide else "", c.title) for c in cases()]
    width = max(len(name) for name, _, _ in rows) + 2
    for name, section, title in rows:
        print(f"{name:{width}}{section:6}{title}")
    return 0
