"""`symdyn diagnose`: reports what the constraints of a mechanism do."""

from __future__ import annotations

import argparse

from symdyn.cli.find import find_system
from symdyn.cli.messages import Stop
from symdyn.cli.options import options_of
from symdyn.cli.values import numbers


def diagnose(arguments: argparse.Namespace) -> int:
    """Print the diagnosis."""
    if not arguments.reach >= 0:
        raise Stop(f"--reach takes a distance from 0 on, found {arguments.reach}")
    q, params = numbers(arguments.q, "--q"), numbers(arguments.set, "--set")
    system = find_system(arguments.system, options_of(arguments))
    print(system.diagnose(q, params, coordinates=arguments.coordinates, reach=arguments.reach))
    return 0
