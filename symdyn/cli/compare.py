"""`symdyn compare`: what slides print compared with what symdyn derives."""

from __future__ import annotations

import argparse
import os
import time as clock
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from symdyn.cli.messages import FAILED, WRONG, Stop, complain
from symdyn.errors import SymdynError

if TYPE_CHECKING:
    from symdyn.comparison import Case, Comparison, Comparisons

OUTPUT = Path("generated/compare")
# Results that SymPy keeps of each function, of which the lecture's formulas need more than the thousand it keeps otherwise.
CACHE_SIZE = "20000"


def compare(arguments: argparse.Namespace) -> int:
    """Compare cases and print the verdicts; of all, or where a folder is named, write the reports."""
    if arguments.all and arguments.cases:
        raise Stop("name cases, or pass --all, not both")
    if arguments.no_pages and (arguments.output is not None or not arguments.all):
        raise Stop("--no-pages goes with --all, without --output: there are no reports otherwise")
    if arguments.jobs is not None and arguments.jobs < 1:
        raise Stop(f"--jobs takes a number of processes from 1 on, found {arguments.jobs}")
    if not arguments.all and not arguments.cases:
        return _list()
    os.environ.setdefault("SYMPY_CACHE_SIZE", CACHE_SIZE)
    from symdyn.comparison import compare_lecture
    from symdyn.comparison.reports import prepare

    files = [name for name in arguments.cases if name.endswith(".py")]
    if files and (arguments.jobs or 1) > 1:
        raise Stop(f"--jobs shares cases of the lecture, and {files[0]} is a file of your own, whose cases are compared in one "
                   "process; leave --jobs out")
    cases = _chosen(arguments.cases)
    folder = arguments.output or (OUTPUT if arguments.all and not arguments.no_pages else None)
    if folder is not None:
        # Packages that the reports need are checked before the time for comparing is spent.
        prepare(folder)
    errors: list[SymdynError] = []
    if files:
        result = _one_by_one(cases, errors)
    else:
        processes = os.cpu_count() or 1
        result = compare_lecture(arguments.cases or None, arguments.jobs or (processes if arguments.all else 1))
    if arguments.all:
        print(result)
    elif len(result):
        print("\n\n".join(map(str, result)))
    if folder is not None and len(result):
        _write(result, folder)
    for error in errors:
        complain(str(error), WRONG)
    return WRONG if errors else 0 if result.decided else FAILED


def _chosen(names: Sequence[str]) -> list[Case]:
    """The cases of files, names and sections; what there is not is reported before anything is compared."""
    from symdyn.cli.userfile import cases_from_file
    from symdyn.comparison.run import find

    return [case for name in names for case in (cases_from_file(Path(name)) if name.endswith(".py") else find([name]))]


def _one_by_one(cases: Sequence[Case], errors: list[SymdynError]) -> Comparisons:
    """The comparisons that succeed; the errors of the others are added to `errors`."""
    from symdyn.comparison import Comparisons, compare

    start = clock.monotonic()
    done: list[Comparison] = []
    for case in cases:
        try:
            done.append(compare(case))
        except SymdynError as error:
            errors.append(error)
    return Comparisons(tuple(done), clock.monotonic() - start)


def _write(result: Comparisons, folder: Path) -> None:
    from symdyn.comparison.reports import write_reports

    for path in write_reports(result, folder):
        print(path)


def _list() -> int:
    from symdyn.lecture import cases

    rows = [(c.name, c.slide.section if c.slide else "", c.title) for c in cases()]
    width = max(len(name) for name, _, _ in rows) + 2
    for name, section, title in rows:
        print(f"{name:{width}}{section:6}{title}")
    return 0
