"""`symdyn simulate`: computes a motion."""

from __future__ import annotations

import argparse
import warnings
from pathlib import Path

from symdyn.cli.find import find_module
from symdyn.cli.messages import INTERRUPTED, STOPPED, Stop, complain
from symdyn.cli.save import save
from symdyn.cli.summary import summarize
from symdyn.cli.values import numbers


def simulate(arguments: argparse.Namespace) -> int:
    """Simulate, tell, save; what was computed until an early stop is kept."""
    from symdyn.errors import SimulationInterrupted, SimulationWarning

    if arguments.t is not None and len(arguments.t) > 2:
        raise Stop(f"--t takes END or START END, found {len(arguments.t)} times")
    t = None if arguments.t is None else (0.0, *arguments.t)[-2:]
    values = {what: numbers(items, flag) for what, flag, items in (
        ("params", "--set", arguments.set), ("q", "--q", arguments.q), ("u", "--u", arguments.u), ("z", "--z", arguments.z),
        ("inputs", "--input", arguments.input))}
    module = find_module(arguments)
    folder = arguments.output or Path("generated") / module.name
    folder.mkdir(parents=True, exist_ok=True)
    warnings.simplefilter("ignore", SimulationWarning)
    code = 0
    try:
        solution = module.simulate(t, **values, rtol=arguments.rtol, atol=arguments.atol, method=arguments.method,
                                   progress=arguments.progress, stabilization=arguments.stabilization)
    except SimulationInterrupted as stop:
        solution, code = stop.solution, INTERRUPTED  # type: ignore[assignment]
    if not solution.success:
        code = code or STOPPED
        complain(solution.message, code)
    summarize(solution)
    save(solution, folder, picture=not arguments.no_picture, film=arguments.gif)
    return code
