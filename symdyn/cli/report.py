"""`symdyn report`: tells what is generated and whether it is right."""

from __future__ import annotations

import argparse

from symdyn.cli.find import find_equations


def report(arguments: argparse.Namespace) -> int:
    """Print the report of the module, then the proof."""
    equations = find_equations(arguments)
    print(equations.compile().report())
    if not arguments.no_verify:
        print()
        print(equations.verify())
    return 0
