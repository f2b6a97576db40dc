"""Linear equations of random mechanisms against the derivative of the flow on the manifold of the constraints.

    python -m symdyn.lab.linear --count 1000 --seed 0        A, B, C_out and D of as many mechanisms of all kinds
    python -m symdyn.lab.linear --only 17                    one of them, with the entry that differs most
    python -m symdyn.lab.linear --verdicts                   also verdicts, against simulation from small disturbances

Each mechanism (symdyn.lab.mechanisms) is linearized by symdyn and by differences of x_dot on the manifold (symdyn.lab.flow), in
the same coordinates. Errors are Frobenius norms of the difference relative to that of the matrix, which counts as at least LEAST.
Held coordinates and speeds are constraints of the model for the differences.

Whether the linear equations are constant along a motion is decided by differences a little later. Where they are not, there must
be no verdict; where they are so by construction (Mechanism.constant), there must be one, and it must be that of simulation
(symdyn.lab.disturbance). "not decided" is counted, and is no fault. Exit code 1: an error above BOUND, a wrong or missing
verdict, or an exception.
"""

from __future__ import annotations

import argparse
import sys
import time as clock
from collections import Counter
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np

from symdyn.errors import ArgumentError, NoEquilibrium
from symdyn.lab.disturbance import constant, observe
from symdyn.lab.flow import Coordinates, Flow, Matrices
from symdyn.lab.mechanisms import Mechanism, draw, kinds_of

NAMES = ("A", "B", "C_out", "D")
BOUND, LEAST = 1e-6, 1e-3
NO_VERDICT = "no verdict"


@dataclass(frozen=True)
class Result:
    """Result of one mechanism.

    errors    of A, B, C_out and D; NaN if none could be computed
    uncertainty   of the differences, relative
    worst     the entry that differs most, in words
    verdict, observed   words, of symdyn and of simulation; "" where not requested
    fault     what went wrong, "" if nothing did
    """

    number: int
    kinds: tuple[str, ...]
    states: int = 0
    errors: tuple[float, ...] = (np.nan,) * 4
    uncertainty: float = np.nan
    worst: str = ""
    verdict: str = ""
    observed: str = ""
    fault: str = ""
    redraws: int = 0
    seconds: float = field(default=0.0, compare=False)

    @property
    def largest(self) -> float:
        """The largest error; infinite if there is none."""
        return max(e if e == e else np.inf for e in self.errors)

    @property
    def passed(self) -> bool:
        return not self.fault and self.largest <= BOUND

    def __str__(self) -> str:
        errors = "  ".join(f"{name} {e:7.1e}" for name, e in zip(NAMES, self.errors, strict=True))
        text = f"{self.number:>5}  {self.states:>2} states  {errors}  uncertain {self.uncertainty:7.1e}  {', '.join(self.kinds)}"
        if self.verdict:
            text += f"; {self.verdict} (simulation: {self.observed})"
        if not self.passed:
            text += f"\n       FAIL {self.fault or self.worst}"
        return text


def measure(number: int, seed: int = 0, verdicts: bool = False) -> Result:
    """One mechanism; an exception becomes the fault of the result."""
    start = clock.perf_counter()
    kinds: tuple[str, ...] = kinds_of(number)
    redraws = 0
    try:
        mechanism = draw(number, seed)
        kinds, redraws = mechanism.kinds, mechanism.redraws
        result = compare(mechanism, verdicts)
    except Exception as error:  # whatever it is, this mechanism counts, and the others go on
        result = Result(number, kinds, fault=f"{type(error).__name__}: {error}")
    return replace(result, redraws=redraws, seconds=clock.perf_counter() - start)


def compare(mechanism: Mechanism, verdicts: bool = False) -> Result:
    """The matrices of a mechanism, and its verdict if requested."""
    linear = linearized(mechanism)
    flow = flow_of(mechanism, linear)
    expected, uncertainty = flow.matrices()
    found = Matrices(linear.A, linear.B, linear.C_out, linear.D)
    faults = []
    n_d, n_s = flow.freedoms()
    c = flow.coordinates
    if (len(c.displacements), len(c.speeds)) != (n_d, n_s):
        faults.append(f"{len(c.displacements)} displacements and {len(c.speeds)} speeds are independent; the constraints leave "
                      f"{n_d} and {n_s}")
    for name, matrix, other in zip(NAMES, found, expected, strict=True):
        if matrix.shape != other.shape:
            faults.append(f"{name} is {matrix.shape}, expected {other.shape}")
    if faults:
        return Result(mechanism.number, mechanism.kinds, c.size, fault="; ".join(faults))
    errors = tuple(relative(a, b) for a, b in zip(found, expected, strict=True))
    result = Result(mechanism.number, mechanism.kinds, c.size, errors, uncertainty, _worst(linear, errors, found, expected))
    return with_verdict(result, mechanism, linear, flow) if verdicts else result


def linearized(mechanism: Mechanism) -> Any:
    """Linearization by symdyn."""
    hold = {"hold": list(mechanism.hold)} if mechanism.hold else {}
    return mechanism.module.linearize(mechanism.x, mechanism.params, t=mechanism.t, inputs=mechanism.inputs, **hold)


def flow_of(mechanism: Mechanism, linear: Any) -> Flow:
    """The flow of the mechanism in the coordinates of its linearization."""
    names = list(linear.states)
    n = len(linear.coordinates)
    metadata = mechanism.module.metadata
    coordinates = Coordinates.named(metadata, names[:n], names[n:])
    p = mechanism.reference.parameters(mechanism.params)
    return Flow(mechanism.reference, mechanism.t, mechanism.x, p, mechanism.inputs, coordinates)


def with_verdict(result: Result, mechanism: Mechanism, linear: Any, flow: Flow) -> Result:
    """The result with the verdict of the linearization and that of simulation."""
    try:
        verdict, reason = str(linear.verdict), ""
    except ArgumentError as error:
        verdict, reason = NO_VERDICT, str(error)
    # Linear equations about any motion change with time; only a verdict on one needs a closer look.
    observed = NO_VERDICT
    if not (mechanism.motion == "any" and verdict == NO_VERDICT) and constant(flow):
        observed = observe(flow).word
        if verdict == NO_VERDICT:
            verdict, reason = verdict_of_motion(mechanism)
    fault = ""
    missing = verdict == NO_VERDICT and not mechanism.constant
    if verdict != observed and not missing and "not decided" not in (verdict, observed):
        fault = f"verdict {verdict!r}, simulation {observed!r}" + (f"; {reason}" if reason else "")
    return replace(result, verdict=verdict, observed=observed, fault=fault)


def verdict_of_motion(mechanism: Mechanism) -> tuple[str, str]:
    """The verdict of `stability`, which also judges motions whose coordinates accelerate; or no verdict, and the reason."""
    hold = {"hold": list(mechanism.hold)} if mechanism.hold else {}
    try:
        result = mechanism.module.stability(mechanism.x, mechanism.params, t=mechanism.t, inputs=mechanism.inputs, **hold)
    except (ArgumentError, NoEquilibrium) as error:
        return NO_VERDICT, str(error)
    return str(result.verdict), ""


def relative(result: np.ndarray, expected: np.ndarray) -> float:
    """Norm of the difference relative to that of what is expected, at least LEAST."""
    size = max(float(np.linalg.norm(expected)), LEAST)
    return float(np.linalg.norm(result - expected)) / size if expected.size else 0.0


def _worst(linear: Any, errors: Sequence[float], result: Matrices, expected: Matrices) -> str:
    """Names and numbers of the entry that differs most, of the matrix with the largest error."""
    k = int(np.argmax(np.nan_to_num(errors, nan=np.inf)))
    difference = np.abs(result[k] - expected[k])
    if not difference.size:
        return ""
    row, column = np.unravel_index(int(np.argmax(difference)), difference.shape)
    rows = linear.states if k < 2 else linear.outputs
    columns = linear.states if k in (0, 2) else linear.module.metadata.inputs
    return (f"{NAMES[k]}[{rows[row]}, {columns[column]}] is {result[k][row, column]:.9g}, differences give "
            f"{expected[k][row, column]:.9g}")


def results(numbers: Sequence[int], seed: int, verdicts: bool, jobs: int) -> Iterator[Result]:
    """Results of all numbers, in their order."""
    one = partial(measure, seed=seed, verdicts=verdicts)
    if jobs == 1:
        yield from map(one, numbers)
        return
    with ProcessPoolExecutor(jobs) as pool:
        yield from pool.map(one, numbers)


def table(result: Sequence[Result]) -> str:
    """Table of every kind: number of results, their largest errors, and the share above the bound."""
    kinds = list(dict.fromkeys(kind for r in sorted(result, key=lambda r: r.number) for kind in r.kinds))
    lines = [f"{'kind':24}{'count':>7}" + "".join(f"{name:>10}" for name in NAMES) + f"{'above':>8}"]
    for kind in ["all", *kinds]:
        rows = [r for r in result if kind == "all" or kind in r.kinds]
        errors = np.array([r.errors for r in rows])
        worst = np.where(np.isnan(errors), np.inf, errors).max(axis=0)
        share = sum(not r.passed for r in rows) / len(rows)
        lines.append(f"{kind:24}{len(rows):>7}" + "".join(f"{e:>10.1e}" for e in worst) + f"{share:>8.1%}")
    judged = [r for r in result if r.verdict]
    if judged:
        lines.append(f"verdicts: {sum(r.verdict == r.observed for r in judged)} of {len(judged)} as in simulation")
        counts = Counter((r.verdict, r.observed) for r in judged)
        lines += [f"  {verdict:12} simulation {observed:12}{n:>6}" for (verdict, observed), n in sorted(counts.items())]
    return "\n".join(lines)


def main(arguments: Sequence[str] | None = None) -> int:
    """The command."""
    parser = argparse.ArgumentParser(prog="python -m symdyn.lab.linear", description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("--count", type=int, default=1000, help="how many mechanisms (default 1000)")
    parser.add_argument("--seed", type=int, default=0, help="of the random numbers (default 0)")
    parser.add_argument("--only", type=int, nargs="+", metavar="K", help="these mechanisms alone, by number")
    parser.add_argument("--verdicts", action="store_true", help="compare verdicts with simulation")
    parser.add_argument("--jobs", type=int, default=1, help="processes (default 1)")
    parser.add_argument("--quiet", action="store_true", help="print failures and the table alone")
    options = parser.parse_args(arguments)
    found = []
    for result in results(options.only or range(options.count), options.seed, options.verdicts, options.jobs):
        found.append(result)
        if not (options.quiet and result.passed):
            print(result, flush=True)
    print(table(found))
    print(f"{len(found)} mechanisms, {sum(not r.passed for r in found)} fail, {sum(r.redraws for r in found)} draws were "
          f"ill-conditioned and drawn again, differences are uncertain by {max(r.uncertainty for r in found):.1e} at most, "
          f"{sum(r.seconds for r in found) / len(found):.2f} s each")
    return int(not all(r.passed for r in found))


if __name__ == "__main__":
    sys.exit(main())
