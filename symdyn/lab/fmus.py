"""How far FMUs of the catalogue, simulated by FMPy, agree with simulate: python -m symdyn.lab.fmus

A line a mechanism: version and kind, what FMPy finds to complain of, the largest difference of the states relative to the largest
state, the seconds to write it. FMPy's integrator for model exchange is CVODE, whose error it is then.
"""

from __future__ import annotations

import argparse
import importlib
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

import symdyn as sd
from symdyn.runtime.module import Module

WAYS = tuple((version, kind) for version in (3, 2) for kind in ("co_simulation", "model_exchange"))
# The finest tolerance that both programs resolve, and how many output times.
TOLERANCE = 1e-12
POINTS = 21


def validated(path: Path) -> list[str]:
    """What FMPy finds in an FMU; nothing where it is good."""
    found: list[str] = importlib.import_module("fmpy.validation").validate_fmu(str(path))
    return found


def compared(module: Module, path: Path, duration: float) -> float:
    """The largest difference of the states of an FMU, simulated by FMPy, from the module's, relative to the largest state."""
    fmpy: Any = importlib.import_module("fmpy")
    times = np.linspace(0, duration, POINTS)
    names = list(module.metadata.x)
    found = fmpy.simulate_fmu(str(path), stop_time=duration, output_interval=duration / (POINTS - 1),
                              relative_tolerance=TOLERANCE, record_events=False, output=names)
    x = np.array([found[name] for name in names]).T
    wanted = module.simulate(times, rtol=TOLERANCE).x
    if x.shape != wanted.shape:
        return float("inf")
    return float(np.abs(x - wanted).max() / np.abs(wanted).max())


def run(arguments: Sequence[str] | None = None) -> None:
    """Print a line for each mechanism of the catalogue and each way."""
    parser = argparse.ArgumentParser(prog="python -m symdyn.lab.fmus")
    parser.add_argument("--ways", nargs="+", default=["3:co_simulation", "2:model_exchange"],
                        choices=[f"{v}:{k}" for v, k in WAYS], help="version and kind (default: one of each)")
    parser.add_argument("--duration", type=float, default=1.0, help="of the motions, s (default: 1)")
    parser.add_argument("names", nargs="*", default=sd.systems.names())
    chosen = parser.parse_args(arguments)
    with tempfile.TemporaryDirectory() as folder:
        for name in chosen.names:
            module = sd.systems.get(name).compile(backend="c")
            for way in chosen.ways:
                version, kind = way.split(":")
                begun = time.perf_counter()
                path = module.to_fmu(Path(folder) / f"{name}.fmu", int(version), kind)
                seconds = time.perf_counter() - begun
                faults = validated(path)
                difference = compared(module, path, min(chosen.duration, module.metadata.duration))
                print(f"{name:36} {way:18} {'; '.join(faults) or 'valid':8} difference {difference:.1e}  "
                      f"written in {seconds:.1f} s", flush=True)


if __name__ == "__main__":
    run()
