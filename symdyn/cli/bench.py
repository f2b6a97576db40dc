"""`symdyn bench`: measures symdyn."""

from __future__ import annotations

import argparse
from pathlib import Path

from symdyn.cli.messages import FAILED, Stop


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
