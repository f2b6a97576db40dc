"""The command `symdyn bench peers`."""

from __future__ import annotations

import json
import platform
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeVar

from symdyn.bench.toolchain import version
from symdyn.errors import MissingExtra, SymdynError
from symdyn.formulation.equations import Equations
from symdyn.lab.peers import arm, derivatives
from symdyn.lab.peers.benchmark import benchmark, fastest
from symdyn.lab.peers.casadi_peer import CasadiPeer
from symdyn.lab.peers.four_bar import four_bar_benchmark
from symdyn.lab.peers.kane_peer import KanePeer
from symdyn.lab.peers.kkt_peer import KktPeer
from symdyn.lab.peers.loop_table import LEGEND as LOOP_LEGEND
from symdyn.lab.peers.loop_table import loop_lines, loop_record
from symdyn.lab.peers.models import Case, cases
from symdyn.lab.peers.pinocchio_peer import PinocchioDerivativesPeer, PinocchioLoopPeer, PinocchioPeer
from symdyn.lab.peers.table import LEGEND, heading, line, record
from symdyn.model.system import System
from symdyn.runtime.building.compiler import require_compiler

Peer = CasadiPeer | PinocchioPeer
LoopPeer = KktPeer | KanePeer | PinocchioLoopPeer
Made = TypeVar("Made")


def find_peers() -> tuple[list[Peer], list[str]]:
    """The peers that can be measured here, and one sentence for each of the others: what is missing, and what to do."""
    return _found((("CasADi", CasadiPeer), ("Pinocchio", PinocchioPeer)))


def find_loop_peers() -> tuple[list[LoopPeer], list[str]]:
    """The same for a mechanism with a closed loop. SymPy is always there."""
    return _found((("CasADi", KktPeer), ("SymPy's Kane's method", KanePeer), ("Pinocchio", PinocchioLoopPeer)))


def find_derivatives_peers() -> tuple[list[derivatives.Peer], list[str]]:
    """The same for derivatives."""
    return _found((("CasADi", CasadiPeer), ("Pinocchio", PinocchioDerivativesPeer)))


def _found(kinds: Sequence[tuple[str, Callable[[], Made]]]) -> tuple[list[Made], list[str]]:
    result: list[Made] = []
    faults: dict[str, SymdynError] = {}
    for name, make in kinds:
        try:
            result.append(make())
        except SymdynError as error:
            faults[name] = error
    if not result and all(isinstance(fault, MissingExtra) for fault in faults.values()):
        return [], ["the peers are not installed, symdyn is measured alone; run: pip install 'symdyn[peers]'"]
    return result, [f"{name} is left out: {_in_one_line(fault)}" for name, fault in faults.items()]


def _in_one_line(fault: SymdynError) -> str:
    """A message; of a failed build, which comes with the compiler's output, what says most."""
    first, *rest = str(fault).splitlines()
    complaints = [line for line in rest if "error" in line.lower()]
    return " ".join([first, *complaints[:1], *[line for line in rest if line.startswith("Source kept at")]])


def run(names: Sequence[str] | None = None, repeats: int = 40, to_json: Path | None = None,
        make_equations: Callable[[System], Equations] | None = None, of_derivatives: bool = False) -> int:
    """Measure the named mechanisms (default: all) and print a line of each; returns how many miss their bounds.

    repeats          timings of each program, of which the best counts
    to_json          file for everything that was measured
    make_equations   symdyn's equations of a System; default: the fastest
    of_derivatives   of the accelerations by q and u, in place of the accelerations
    """
    differentiated = derivatives.cases(names) if of_derivatives else {}
    chosen, loop = ({}, False) if of_derivatives else cases(names)
    if repeats < 1:
        raise SymdynError(f"{repeats} repeats were asked for; pass 1 or more")
    compiler = require_compiler()
    result: dict[str, Any] = {
        "machine": platform.machine(), "compiler": compiler.version, "repeats": repeats, "notes": [],
        "versions": {name: version(name) for name in ("symdyn", "pin", "casadi", "sympy")}, "models": [], "loops": [],
        "derivatives": []}
    if chosen:
        _trees(chosen, repeats, make_equations or fastest, result)
    if loop:
        _loop(repeats, make_equations or fastest, result)
    if differentiated:
        _derivatives(differentiated, repeats, make_equations, result)
    if to_json is not None:
        to_json.write_text(json.dumps(result, indent=1) + "\n", encoding="utf-8")
        print(f"wrote {to_json}")
    rows = (*result["models"], *result["loops"], *result["derivatives"])
    return sum(bool(row["missed"]) for row in rows) + bool(chosen and arm.misses())


def _trees(chosen: Mapping[str, Case], repeats: int, make_equations: Callable[[System], Equations],
           result: dict[str, Any]) -> None:
    """Measure mechanisms without loops, print a line of each, and add their records to the result."""
    peers, notes = find_peers()
    _noted(notes, result)
    print(heading(), flush=True)
    for name, case in chosen.items():
        row = benchmark(name, case, peers, repeats, make_equations)
        print(line(row), flush=True)
        result["models"].append(record(row))
    print(LEGEND)
    print(arm.line())


def _loop(repeats: int, make_equations: Callable[[System], Equations], result: dict[str, Any]) -> None:
    """The same for the mechanism with a closed loop."""
    peers, notes = find_loop_peers()
    _noted(notes, result)
    row = four_bar_benchmark(peers, repeats, make_equations)
    print("\n".join([*loop_lines(row), LOOP_LEGEND]))
    result["loops"].append(loop_record(row))


def _derivatives(chosen: Mapping[str, derivatives.Case], repeats: int, make_equations: Callable[[System], Equations] | None,
                 result: dict[str, Any]) -> None:
    """The same for derivatives of the accelerations."""
    peers, notes = find_derivatives_peers()
    _noted(notes, result)
    print(derivatives.heading(), flush=True)
    for name, case in chosen.items():
        row = derivatives.benchmark(name, case, peers, repeats, make_equations)
        print(derivatives.line(row), flush=True)
        result["derivatives"].append(derivatives.record(row))
    print(derivatives.LEGEND)


def _noted(notes: Sequence[str], result: dict[str, Any]) -> None:
    result["notes"] += notes
    for note in notes:
        print(note)
