"""What `symdyn bench peers` does."""

from __future__ import annotations

import json
import platform
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from symdyn.bench.peers import arm
from symdyn.bench.peers.casadi_peer import CasadiPeer
from symdyn.bench.peers.contest import cases, contest, fastest
from symdyn.bench.peers.pinocchio_peer import PinocchioPeer
from symdyn.bench.peers.table import LEGEND, heading, line, record
from symdyn.bench.peers.toolchain import version
from symdyn.errors import MissingExtra, SymdynError
from symdyn.formulation.equations import Equations
from symdyn.model.system import System
from symdyn.runtime.compiler import require_compiler

Peer = CasadiPeer | PinocchioPeer


def find_peers() -> tuple[list[Peer], list[str]]:
    """The peers that can be measured here, and one sentence for each of the others: what is missing, and what to do."""
    found: list[Peer] = []
    faults: dict[str, SymdynError] = {}
    for name, make in (("CasADi", CasadiPeer), ("Pinocchio", PinocchioPeer)):
        try:
            found.append(make())
        except SymdynError as error:
            faults[name] = error
    if not found and all(isinstance(fault, MissingExtra) for fault in faults.values()):
        return [], ["the peers are not installed, symdyn is measured alone; run: pip install 'symdyn[peers]'"]
    return found, [f"{name} is left out: {_in_one_line(fault)}" for name, fault in faults.items()]


def _in_one_line(fault: SymdynError) -> str:
    """A message; of a failed build, which comes with the compiler's output, what tells most."""
    first, *rest = str(fault).splitlines()
    complaints = [line for line in rest if "error" in line.lower()]
    return " ".join([first, *complaints[:1], *[line for line in rest if line.startswith("Source kept at")]])


def run(names: Sequence[str] | None = None, repeats: int = 40, to_json: Path | None = None,
        make_equations: Callable[[System], Equations] = fastest) -> int:
    """Measure the named mechanisms (default: all) and print a line of each; returns how many miss their bounds.

    repeats          timings of each contestant, of which the best counts
    to_json          file for everything that was measured
    make_equations   symdyn's equations of a System
    """
    chosen = cases(names)
    if repeats < 1:
        raise SymdynError(f"{repeats} repeats were asked for; pass 1 or more")
    compiler = require_compiler()
    peers, notes = find_peers()
    for note in notes:
        print(note)
    print(heading(), flush=True)
    rows = []
    for name, case in chosen.items():
        rows.append(contest(name, case, peers, repeats, make_equations))
        print(line(rows[-1]), flush=True)
    print(LEGEND)
    print(arm.line())
    if to_json is not None:
        result: dict[str, Any] = {
            "machine": platform.machine(), "compiler": compiler.version, "repeats": repeats, "notes": notes,
            "versions": {name: version(name) for name in ("symdyn", "pin", "casadi")}, "models": [record(row) for row in rows]}
        to_json.write_text(json.dumps(result, indent=1) + "\n", encoding="utf-8")
        print(f"wrote {to_json}")
    return sum(bool(row.misses()) for row in rows) + bool(arm.misses())
