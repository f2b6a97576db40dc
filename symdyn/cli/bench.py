"""`symdyn bench`: measures symdyn."""

from __future__ import annotations

import argparse

from symdyn.cli.messages import FAILED


def bench(arguments: argparse.Namespace) -> int:
    """Measure symdyn beside its peers; a missed bound is a failure."""
    from symdyn.bench.peers.command import run

    return FAILED if run(arguments.models, arguments.repeats, arguments.json) else 0
