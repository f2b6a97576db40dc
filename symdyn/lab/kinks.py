"""Errors of methods that step across jumps and kinks of inputs, and whether they are reported: 40 of each, at random.

    python -m symdyn.lab.kinks --methods dop853 gauss --rtol 1e-10

An oscillator, 1 kg and k N/m, is pushed from a random time on: by a force that jumps, or by one that grows from there. The motion
has a closed form. Errors count relative to the tolerance, atol + rtol |exact|, over the whole motion. "gauss as smooth" is the
method "gauss" with the force declared to be smooth, which it is not: what the declaration protects from.
"""

from __future__ import annotations

import argparse
import functools
import sys
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

import symdyn as sd
from symdyn.errors import ArgumentError, SimulationWarning
from symdyn.runtime.integrating.methods import COMPILED

AS_SMOOTH = "gauss as smooth"
METHODS = (*COMPILED, AS_SMOOTH)
# Errors in tolerances that have to be reported.
BOUND = 1000.0
COUNT, END = 40, 20.0


@dataclass(frozen=True)
class Result:
    """Result of one run: its error in tolerances; what was raised or warned of, if anything."""

    kind: str
    number: int
    method: str
    error: float
    reported: str

    @property
    def silent(self) -> bool:
        """Whether a wrong motion came without a word."""
        return not self.error <= BOUND and not self.reported


@functools.cache
def _module() -> Any:
    q, F, k = sd.coordinates("q"), sd.inputs("F"), sd.parameters("k")
    system = sd.System("pushed_oscillator", planar=True)
    slider = system.add_joint(sd.Prismatic("slider", system.ground, system.add_body("block", mass=1), q, axis=[1, 0]))
    system.add_joint_force(slider, F - k * q)
    system.defaults = {k: 1}
    return system.embedding().compile(backend="c")


def measure(kind: str, number: int, method: str, rtol: float, seed: int = 0) -> Result:
    """One run; kind "jump" or "kink"."""
    rng = np.random.default_rng([seed, number, kind == "kink"])
    begin, size, w = rng.uniform(0.5, END - 0.5), 10.0**rng.uniform(-2, 1), rng.uniform(0.5, 3)
    force = (lambda t, x: [size * (t > begin)]) if kind == "jump" else lambda t, x: [size * max(0.0, t - begin)]
    times = np.linspace(0, END, 201)
    since = np.maximum(times - begin, 0)
    pushed = (1 - np.cos(w * since)) / w**2 if kind == "jump" else (since - np.sin(w * since) / w) / w**2
    exact = np.cos(w * times) + size * pushed
    with warnings.catch_warnings(record=True) as seen:
        warnings.simplefilter("always")
        try:
            result = _module().simulate(times, [1.0], params={"k": w**2}, rtol=rtol, method=method.partition(" ")[0],
                                        inputs=sd.Smooth(force) if method == AS_SMOOTH else force)
        except ArgumentError as raised:
            return Result(kind, number, method, np.nan, f"raises: {raised}")
    error = np.abs(result.q[:, 0] - exact[:len(result.t)]) / (rtol + rtol * np.abs(exact[:len(result.t)]))
    return Result(kind, number, method, float(error.max()),
                  "; ".join(str(w.message) for w in seen if issubclass(w.category, SimulationWarning)))


def table(result: Sequence[Result]) -> str:
    """Table of every method and kind: how many errors are above the bound, are reported, are not; the largest error."""
    lines = [f"{'method':17}{'kind':6}{'runs':>5}{'above':>7}{'reported':>10}{'silent':>8}{'largest':>10}"]
    for method, kind in dict.fromkeys((r.method, r.kind) for r in result):
        rows = [r for r in result if (r.method, r.kind) == (method, kind)]
        largest = max((r.error for r in rows if np.isfinite(r.error)), default=np.nan)
        lines.append(f"{method:17}{kind:6}{len(rows):>5}{sum(r.error > BOUND for r in rows):>7}"
                     f"{sum(bool(r.reported) for r in rows):>10}{sum(r.silent for r in rows):>8}{largest:>10.3g}")
    return "\n".join(lines)


def main(arguments: Sequence[str] | None = None) -> int:
    """The command. Returns 1 if a wrong motion came without a word, but for the false declaration."""
    parser = argparse.ArgumentParser(prog="python -m symdyn.lab.kinks", description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("--methods", nargs="+", default=[m for m in METHODS if m != "taylor"], choices=METHODS)
    parser.add_argument("--rtol", type=float, default=1e-10, help="default 1e-10")
    parser.add_argument("--count", type=int, default=COUNT, help=f"of jumps, and of kinks (default {COUNT})")
    parser.add_argument("--seed", type=int, default=0, help="of the random numbers (default 0)")
    options = parser.parse_args(arguments)
    result = [measure(kind, number, method, options.rtol, options.seed)
              for method in options.methods for kind in ("jump", "kink") for number in range(options.count)]
    print(table(result))
    return int(any(r.silent for r in result if r.method != AS_SMOOTH))


if __name__ == "__main__":
    sys.exit(main())
