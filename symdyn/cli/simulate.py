"""`symdyn simulate`: computes a motion."""

from __future__ import annotations

import argparse
import warnings
from pathlib import Path
from typing import TYPE_CHECKING, Any

from symdyn.cli.find import find_module
from symdyn.cli.messages import FAILED, INTERRUPTED, STOPPED, Stop, complain
from symdyn.cli.save import save
from symdyn.cli.summary import summarize
from symdyn.cli.users_line import users_line
from symdyn.cli.values import numbers

if TYPE_CHECKING:
    from symdyn.runtime.module import Module


def simulate(arguments: argparse.Namespace) -> int:
    """Simulate, report, save; what was computed until an early stop is kept."""
    from symdyn.errors import EvaluationError, SimulationInterrupted, SimulationWarning
    from symdyn.runtime.consistent import NotConsistent

    if arguments.t is not None and len(arguments.t) > 2:
        raise Stop(f"--t takes END or START END, found {len(arguments.t)} times")
    t = None if arguments.t is None else (0.0, *arguments.t)[-2:]
    values: dict[str, Any] = {what: numbers(items, flag) for what, flag, items in (
        ("params", "--set", arguments.set), ("q", "--q", arguments.q), ("u", "--u", arguments.u), ("z", "--z", arguments.z),
        ("inputs", "--input", arguments.input))}
    if arguments.keep and not arguments.consistent:
        raise Stop("--keep goes with --consistent")
    if arguments.report is not None and arguments.report.suffix.lower() not in (".html", ".htm"):
        raise Stop(f"--report takes a file that ends in .html, found {arguments.report}")
    module = find_module(arguments)
    if arguments.consistent:
        _make_consistent(module, values, t[0] if t else 0.0, arguments.keep)
    folder = arguments.output or Path("generated") / module.name
    folder.mkdir(parents=True, exist_ok=True)
    warnings.simplefilter("ignore", SimulationWarning)
    code = 0
    try:
        solution = module.simulate(t, **values, rtol=arguments.rtol, atol=arguments.atol, method=arguments.method,
                                   progress=arguments.progress, stabilization=arguments.stabilization)
    except SimulationInterrupted as stop:
        solution, code = stop.solution, INTERRUPTED  # type: ignore[assignment]
    except NotConsistent as error:
        raise Stop(f"{error.found}; begin with the nearest consistent state by --consistent, which says what it changes (--keep "
                   "NAME leaves some as they are)") from None
    except EvaluationError as error:
        raise Stop(f"{error}{users_line(Path(arguments.system), error.__cause__)}", FAILED) from None
    if not solution.success:
        code = code or STOPPED
        complain(f"{solution.message}{users_line(Path(arguments.system), solution.cause)}", code)
    summarize(solution)
    save(solution, folder, picture=not arguments.no_picture, film=arguments.gif)
    if arguments.report is not None:
        print(f"wrote {solution.report(arguments.report)}")
    return code


def _make_consistent(module: Module, values: dict[str, Any], t: float, keep: list[str]) -> None:
    """Put the nearest consistent q and u in place of those given, and print what changed."""
    q, u = module.consistent(values["q"], values["u"], values["params"], t=t, keep=keep)
    changed = []
    for what, result in (("q", q), ("u", u)):
        given = {**module.metadata.initial, **(values[what] or {})}
        for name, after in zip(module.metadata.names(what), map(float, result), strict=True):
            before = float(given.get(name, 0.0))
            if abs(after - before) > 1e-12 * max(1.0, abs(before)):
                changed.append(f"{name} from {before:.6g} to {after:.6g}")
    print(f"{module.name}: the start is " + (f"made consistent: {', '.join(changed)}" if changed else "consistent as it is"))
    values["q"], values["u"] = q, u
