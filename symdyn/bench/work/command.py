"""`symdyn bench`: mechanism after mechanism, with a table of each and one page of all."""

from __future__ import annotations

import argparse
import sys
import time as clock
from collections.abc import Callable, Sequence
from dataclasses import asdict, replace
from pathlib import Path

from symdyn.bench.work import resume
from symdyn.bench.work.asked import Asked, checked
from symdyn.bench.work.benchmark import RESULTS, Benchmark, finished
from symdyn.bench.work.benchmark import run as run_one
from symdyn.bench.work.cases import CASES
from symdyn.bench.work.page import write_page
from symdyn.bench.work.system_under_test import SystemUnderTest
from symdyn.errors import ArgumentError, MissingExtra, SymdynError

FOLDER = Path("generated") / "bench"
FILES = (RESULTS, "work_precision.png", "work_precision.svg", "report.html")


def run(arguments: argparse.Namespace, find: Callable[[str], SystemUnderTest]) -> int:
    """Measure what was requested; returns how many mechanisms could not be measured, and at least 1 if nothing was.

    find   what is measured under a name; raises SymdynError for one that there is not
    Raises ArgumentError that lists everything that is wrong with what was requested.
    """
    begun = clock.perf_counter()
    names = list(dict.fromkeys([*arguments.systems, *(CASES if arguments.all else ())]))
    systems, faults = _systems(names, find)
    if not names:
        faults.append(f"nothing is named; name mechanisms such as {', '.join(list(CASES)[:3])}, a Python file, or pass --all")
    options = {"formulations": arguments.formulations, "method_names": arguments.methods, "tolerances": arguments.rtol,
               "steps": arguments.steps, "repeats": arguments.repeats, "peers": arguments.against or (),
               "budget": arguments.budget, "at": arguments.at or (), "per_decade": arguments.per_decade}
    try:
        asked = checked(systems, **options)
    except ArgumentError as error:
        faults.append(str(error))
    folder = arguments.output or FOLDER
    places = dict.fromkeys((folder, *(_place(folder, one, systems) for one in systems)))
    faults += list(dict.fromkeys(why for place in places if (why := resume.unwritable(place, FILES))))
    if faults:
        raise ArgumentError("\n".join(faults))
    results: list[Benchmark] = []
    pictures: list[Path] = []
    failed = measured = 0
    command = _fingerprint(systems, asked)
    done = [one for one in systems if resume.whole(_place(folder, one, systems) / RESULTS, command)]
    done = done if len(done) < len(systems) else []  # all of it was done: it begins again
    late: list[str] = []
    for k, one in enumerate(systems):
        share, place = None, _place(folder, one, systems)
        earlier = finished(one, asked, place, command) if one in done else None
        if earlier is not None:
            print(f"{earlier.table()}\n  all of it was measured in an earlier run, of {earlier.timed}; to have it measured again "
                  f"delete {place / RESULTS}", end="\n\n", flush=True)
            measured += any(not row.message for row in earlier.rows)
            _save(earlier, place, results, pictures)
            continue
        if asked.budget is not None:
            left = asked.budget - (clock.perf_counter() - begun)
            if left <= 0:
                late.append(one.name)
                continue
            share = left / sum(other is one or other not in done for other in systems[k:]) if len(systems) > 1 else None
        try:
            result = run_one(one, asked, place, arguments.progress, _tell, command, share, begun if len(systems) == 1 else None)
        except (ArgumentError, MissingExtra):
            raise
        except SymdynError as error:
            failed += 1
            print(f"symdyn: {error}", file=sys.stderr)
            continue
        print(result.table(), end="\n\n", flush=True)
        measured += any(not row.message for row in result.rows)
        if all(row.message for row in result.rows):
            failed += not result.unfinished
            _tell(f"{result.name}: {nothing(result)}")
        _save(result, place, results, pictures)
    if late:
        _tell(f"the budget of {asked.budget:g} s is used up: {', '.join(late)} {'was' if len(late) == 1 else 'were'} not begun; "
              "run it again with the same output folder to go on")
    if len(systems) > 1 and results:
        print(f"wrote {write_page(results, pictures, folder / 'report.html')}")
    return failed or int(not measured)


def _save(result: Benchmark, place: Path, results: list[Benchmark], pictures: list[Path]) -> None:
    """Write its files, and take it and its picture to those of the page of all."""
    try:
        written = result.save(place)
    except MissingExtra as error:
        print(f"symdyn: {error}", file=sys.stderr)
        return
    print("\n".join(f"wrote {path}" for path in written), flush=True)
    results.append(result)
    pictures.append(next(path for path in written if path.suffix == ".svg"))


def _fingerprint(systems: Sequence[SystemUnderTest], asked: Asked) -> str:
    """Fingerprint that distinguishes commands that measure several mechanisms; empty for one."""
    plain = asdict(replace(asked, budget=None))
    return resume.fingerprint(sorted(one.name for one in systems), plain, resume.installed(asked.against)) if len(
        systems) > 1 else ""


def nothing(result: Benchmark) -> str:
    """Why no row has figures."""
    if result.unfinished:
        return f"nothing was measured: {result.unfinished}"
    why = [*map(str, result.skipped), *[f"{row.formulation}, {row.method}, {row.setting}: {row.message}" for row in result.rows]]
    return "nothing was measured, everything was left out or stopped:\n  - " + "\n  - ".join(why)


def _systems(names: Sequence[str], find: Callable[[str], SystemUnderTest]) -> tuple[list[SystemUnderTest], list[str]]:
    """Systems to measure, and faults of the names."""
    result, faults = [], []
    for name in names:
        try:
            result.append(find(name))
        except SymdynError as error:
            faults.append(str(error))
    return result, faults


def _place(folder: Path, one: SystemUnderTest, systems: Sequence[SystemUnderTest]) -> Path:
    """Folder of a mechanism: of its own where there are several, and under the usual folder."""
    return folder / one.name if len(systems) > 1 or folder == FOLDER else folder


def _tell(text: str) -> None:
    print(f"symdyn: {text}", file=sys.stderr, flush=True)
