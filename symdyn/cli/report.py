"""`symdyn report`: reports what is generated and whether it is right; with --full everything about a mechanism, as a page."""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from symdyn.cli.find import find_equations
from symdyn.cli.mechanism import find_mechanism, is_file, title_of
from symdyn.cli.messages import Stop
from symdyn.cli.options import options_of

PAGE = "report.html"


def report(arguments: argparse.Namespace) -> int:
    """Print the report of the module, then the proof; or write the page."""
    if arguments.full:
        return _full(arguments)
    for flag, value in (("--budget", arguments.budget), ("--output", arguments.output)):
        if value is not None:
            raise Stop(f"{flag} goes with --full; without it the report is printed")
    equations = find_equations(arguments, find_mechanism)
    print(equations.compile().report())
    if not arguments.no_verify:
        print()
        print(equations.verify())
    return 0


def _full(arguments: argparse.Namespace) -> int:
    """Write the page, saying on the way what is going on."""
    from symdyn.overview.page import BUDGET, full_report

    options = options_of(arguments)
    system = find_mechanism(arguments.system, options)
    by_name = not options and not is_file(arguments.system)  # what is known of it, such as closed forms, is found by name
    folder = arguments.output or Path("generated") / title_of(arguments.system, options)
    written = full_report(arguments.system if by_name else system, folder / PAGE,
                          BUDGET if arguments.budget is None else arguments.budget, arguments.formulation,
                          arguments.coordinates, arguments.tune, not arguments.no_verify, _tell)
    print(f"wrote {written}")
    return 0


def _tell(text: str) -> None:
    print(f"symdyn: {text}", file=sys.stderr, flush=True)
