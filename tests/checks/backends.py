"""Motions by the C backend compared with the same motions by NumPy: processor time of each, the least of some runs.

python tests/checks/backends.py
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2]))

import symdyn as sd

MECHANISMS = ("pendulum", "double_pendulum", "two_link_arm", "puma560", "spatial_chain", "four_bar", "bicycle")
END = 10.0
# Runs of which the least time counts: of NumPy, whose runs take long, and of C.
RUNS = {"numpy": 2, "c": 10}


def least(runs: int, motion: Callable[[], object]) -> float:
    """Seconds of the processor; a run before warms caches."""
    motion()
    times = []
    for _ in range(runs):
        begun = time.process_time()
        motion()
        times.append(time.process_time() - begun)
    return min(times)


def main() -> None:
    print("  ".join(["mechanism", "motion", "NumPy", "steps", "C", "steps", "NumPy / C"]))
    for name in MECHANISMS:
        equations = sd.systems.get(name).equations()
        found, steps = {}, {}
        for backend in RUNS:
            module = equations.compile(backend=backend)
            found[backend] = least(RUNS[backend], lambda module=module: module.simulate((0, END)))
            steps[backend] = module.simulate((0, END)).n_steps
        print("  ".join([name, f"{END:g} s", f"{1e3 * found['numpy']:.3g} ms", str(steps["numpy"]), f"{1e3 * found['c']:.3g} ms",
                         str(steps["c"]), f"{found['numpy'] / found['c']:.0f}"]), flush=True)


if __name__ == "__main__":
    main()
