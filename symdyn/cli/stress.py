"""`symdyn stress`: numerical stability under stress."""

from __future__ import annotations

import argparse
import os
from pathlib import Path

from symdyn.cli.messages import FAILED, Stop


def stress(arguments: argparse.Namespace) -> int:
    """Run the checks, print rows as they come, save the report; a row that failed is a failure."""
    from symdyn.cli.find import find_system
    from symdyn.stress.record import HEAD, told
    from symdyn.stress.run import CHECKS
    from symdyn.stress.run import stress as run

    if arguments.list:
        print("\n".join(f"{check.name:18}{'any mechanism' if check.of_system else 'its own':15}{check.title}"
                        for check in CHECKS.values()))
        return 0
    if arguments.jobs is not None and arguments.jobs < 1:
        raise Stop(f"--jobs must be 1 or more, found {arguments.jobs}")
    from symdyn.systems import names

    systems = [name if name in names() else find_system(name, {}) for name in arguments.systems] or None
    print(HEAD)
    report = run(systems, arguments.short, arguments.checks, arguments.progress, arguments.jobs or os.cpu_count() or 1,
                 lambda row: print(told(row), flush=True))
    for text in report.left_out:
        print(f"left out: {text}")
    print(report.summary())
    folder = arguments.output or Path("generated") / "stress"
    for name in ("stress.json", "stress.txt", "stress.html"):
        print(f"wrote {report.save(folder / name)}")
    return 0 if report.passed else FAILED
