"""Agreement of FMUs of the catalogue, simulated by FMPy, with simulate: python -m symdyn.lab.fmus

A line a mechanism: version and kind, what FMPy finds to complain of, the largest difference of the states relative to the largest
state, the seconds to write it. FMPy's integrator for model exchange is CVODE, whose error it is then: with --integrator dop853
SciPy integrates the derivatives that the same FMU gives.
"""

from __future__ import annotations

import argparse
import ctypes
import importlib
import tempfile
import time
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

import symdyn as sd
from symdyn.runtime.module import Module

WAYS = tuple((version, kind) for version in (3, 2) for kind in ("co_simulation", "model_exchange"))
# The finest tolerance that both programs resolve, and how many output times.
TOLERANCE = 1e-12
POINTS = 21


def validated(path: Path) -> list[str]:
    """Faults that FMPy finds in an FMU; nothing where it is good."""
    result: list[str] = importlib.import_module("fmpy.validation").validate_fmu(str(path))
    return result


def by_importer(path: Path, names: Sequence[str], times: np.ndarray) -> np.ndarray:
    """The states of an FMU at times, simulated by FMPy with its own integrator."""
    fmpy: Any = importlib.import_module("fmpy")
    result = fmpy.simulate_fmu(str(path), stop_time=times[-1], output_interval=times[1], relative_tolerance=TOLERANCE,
                               record_events=False, output=list(names))
    return np.array([result[name] for name in names]).T


def by_scipy(path: Path, names: Sequence[str], times: np.ndarray) -> np.ndarray:
    """The states of an FMU of model exchange at times: SciPy's DOP853 integrates the derivatives that it gives, with a step that
    ends at each of them, since what it interpolates within its steps is less exact. No event is looked for."""
    fmpy: Any = importlib.import_module("fmpy")
    about = fmpy.read_model_description(str(path))
    version = about.fmiVersion[0]
    kind: Any = getattr(importlib.import_module(f"fmpy.fmi{version}"), f"FMU{version}Model")
    with tempfile.TemporaryDirectory() as folder:
        fmu = kind(guid=about.guid, unzipDirectory=fmpy.extract(str(path), folder), instanceName="one",
                   modelIdentifier=about.modelExchange.modelIdentifier)
        fmu.instantiate()
        if version == "2":
            fmu.setupExperiment(startTime=0.0)
        fmu.enterInitializationMode()
        fmu.exitInitializationMode()
        fmu.enterContinuousTimeMode()
        x, rates = np.zeros(len(names)), np.zeros(len(names))
        at_x, at_rates = (a.ctypes.data_as(ctypes.POINTER(ctypes.c_double)) for a in (x, rates))
        derivatives = fmu.getDerivatives if version == "2" else fmu.getContinuousStateDerivatives

        def field(t: float, state: np.ndarray) -> np.ndarray:
            x[:] = state
            fmu.setTime(t)
            fmu.setContinuousStates(at_x, len(x))
            derivatives(at_rates, len(x))
            return rates.copy()

        fmu.getContinuousStates(at_x, len(x))
        result = [x.copy()]
        for span in pairwise(times):
            solved = solve_ivp(field, span, result[-1], method="DOP853", rtol=TOLERANCE, atol=TOLERANCE / 10)
            result.append(solved.y[:, -1])
        fmu.terminate()
        fmu.freeInstance()
        return np.array(result)


def compared(module: Module, path: Path, duration: float, integrator: str = "importer") -> float:
    """The largest difference of the states of an FMU from the module's, relative to the largest state.

    integrator   "importer": FMPy's; "dop853": SciPy's, for model exchange
    """
    times = np.linspace(0, duration, POINTS)
    x = (by_scipy if integrator == "dop853" else by_importer)(path, module.metadata.x, times)
    wanted = module.simulate(times, rtol=TOLERANCE).x
    if x.shape != wanted.shape:
        return float("inf")
    return float(np.abs(x - wanted).max() / np.abs(wanted).max())


def run(arguments: Sequence[str] | None = None) -> None:
    """Print a line for each mechanism of the catalogue and each way."""
    parser = argparse.ArgumentParser(prog="python -m symdyn.lab.fmus")
    parser.add_argument("--ways", nargs="+", default=["3:co_simulation", "2:model_exchange"],
                        choices=[f"{v}:{k}" for v, k in WAYS], help="version and kind (default: one of each)")
    parser.add_argument("--integrator", choices=("importer", "dop853"), default="importer",
                        help="FMPy's, or SciPy's for model exchange (default: importer)")
    parser.add_argument("--duration", type=float, default=1.0, help="of the motions, s (default: 1)")
    parser.add_argument("names", nargs="*", default=[name for name in sd.systems.names() if not sd.systems.get(name).contacts],
                        help="default: all of the catalogue without rigid contacts, whose impacts are found in Python")
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
                difference = compared(module, path, min(chosen.duration, module.metadata.duration), chosen.integrator)
                print(f"{name:36} {way:18} {'; '.join(faults) or 'valid':8} difference {difference:.1e}  "
                      f"written in {seconds:.1f} s", flush=True)


if __name__ == "__main__":
    run()
