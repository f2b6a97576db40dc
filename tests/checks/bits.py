"""Bits of motions compared with those of another commit: every mechanism of the catalogue by every compiled method.

    python tests/checks/bits.py --against HEAD~1
    python tests/checks/bits.py --against v0.1.0 --names four_bar puma560 --methods radau taylor

Each mechanism runs for a twentieth of its duration in the working tree and in a worktree of the commit, in a process of its own
with an empty cache; states at the steps that the integrator took, their rates at the start and messages are compared bit by bit.
The table shows "=" for the same bits, "-" where both reject the method with the same message, else what differs: the number of
steps, or the largest difference relative to the largest state. The exit code is 1 if anything differs.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).resolve().parent.parent.parent
PART = 20       # of the duration of a mechanism that is simulated
SECONDS = 900   # for one mechanism in one tree


def runs(name: str, methods: Sequence[str], file: Path) -> None:
    """Simulate one mechanism with the package that Python finds and write the bits; public names only, for older commits."""
    import symdyn as sd

    warnings.simplefilter("ignore")
    system = sd.systems.get(name)
    equations = system.augmented() if name in sd.systems.names(constrained=True) else system.embedding()
    module = equations.compile(backend="c")
    bits: dict[str, Any] = {}
    for method in methods:
        try:
            run = module.simulate((0, system.duration / PART), method=method, steps=True, max_steps=3000)
        except sd.SymdynError as error:
            bits[method] = str(error)
            continue
        rates = module.rhs(float(run.t[0]), run.x[0])
        bits[method] = [np.column_stack([run.t, run.x]).tolist(), np.asarray(rates).tolist(), run.message]
    file.write_text(json.dumps(bits), encoding="utf-8")


def measured(root: Path, name: str, methods: Sequence[str]) -> dict[str, Any]:
    """Result of `runs` in a tree; where it fails, the last line of what it prints for each method."""
    with tempfile.TemporaryDirectory() as made:
        known = {**os.environ, "PYTHONPATH": str(root), "SYMDYN_CACHE_DIR": made}
        known.pop("SYMDYN_CC", None)
        file = Path(made, "bits.json")
        command = [sys.executable, str(Path(__file__)), "--measure", str(file), "--names", name, "--methods", *methods]
        try:
            done = subprocess.run(command, cwd=root, env=known, capture_output=True, text=True, check=False, timeout=SECONDS)
        except subprocess.TimeoutExpired:
            return dict.fromkeys(methods, f"not done in {SECONDS} s")
        if done.returncode:
            return dict.fromkeys(methods, done.stderr.strip().splitlines()[-1])
        return json.loads(file.read_text(encoding="utf-8"))


def difference(now: Any, then: Any) -> str:
    """Difference of one method's runs, for the table."""
    if isinstance(now, str) or isinstance(then, str):
        return "-" if now == then else f"now {_short(now)}; then {_short(then)}"
    if json.dumps(now) == json.dumps(then):  # NaN equals NaN, and -0.0 is not 0.0
        return "="
    states, before = np.array(now[0]), np.array(then[0])
    if states.shape != before.shape:
        return f"{len(states) - 1} steps, then {len(before) - 1}"
    if states.tobytes() != before.tobytes():
        first = int(np.argmax((states != before).any(axis=1)))
        return f"{np.abs(states - before).max() / np.abs(before).max():.1e} from step {first}"
    return "rates at the start" if now[1] != then[1] else f"message {now[2]!r}, then {then[2]!r}"


def _short(run: Any) -> str:
    return run[:60] if isinstance(run, str) else f"{len(run[0]) - 1} steps"


def main(arguments: Sequence[str] | None = None) -> int:
    """The command."""
    parser = argparse.ArgumentParser(prog="python tests/checks/bits.py", description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--against", metavar="COMMIT", default="HEAD", help="default HEAD: what is not committed yet")
    parser.add_argument("--names", nargs="*", metavar="NAME", help="of the catalogue (default all that both trees have)")
    parser.add_argument("--methods", nargs="*", metavar="METHOD", help="default: all that are compiled")
    parser.add_argument("--measure", type=Path, metavar="FILE", help=argparse.SUPPRESS)
    options = parser.parse_args(arguments)
    if options.measure:
        runs(options.names[0], options.methods, options.measure)
        return 0
    sys.path.insert(0, str(ROOT))
    from symdyn import systems
    from symdyn.backend.methods import METHODS
    from tests.checks.commits import tree_of

    methods = options.methods or list(METHODS)
    differing = 0
    with tree_of(options.against) as other:
        print(f"{'':36}" + "".join(f"{method:>10}" for method in methods), flush=True)
        for name in options.names or systems.names():
            now, then = (measured(root, name, methods) for root in (ROOT, other))
            found = {method: difference(now[method], then[method]) for method in methods}
            other_bits = {method: text for method, text in found.items() if text not in ("=", "-")}
            differing += len(other_bits)
            print(f"{name:36}" + "".join(f"{text if method not in other_bits else 'differs':>10}"
                                         for method, text in found.items()))
            for method, text in other_bits.items():
                print(f"    {method}: {text}", flush=True)
    print(f"{differing} differ" if differing else "the same bits")
    return int(differing > 0)


if __name__ == "__main__":
    sys.exit(main())
