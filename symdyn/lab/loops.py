"""`symdyn bench loops`: mechanisms with loops and constraints, each compared with what is known of its motion, in one run."""

from __future__ import annotations

import json
import math
import platform
import statistics
import warnings
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from symdyn.errors import SimulationWarning, SymdynError
from symdyn.lab.extended import known
from symdyn.lab.loop_cases import REFERENCE, Case, chosen, largest
from symdyn.runtime.building.compiler import require_compiler

# Bounds for every mechanism: error of the energy balance, violations of the constraints.
ENERGY, VIOLATION = 1e-9, 1e-11
# Tolerance of the runs in which violations are looked at.
LONG_RTOL = 1e-9
# Andrews' mechanism: this error, relative, in less than this time inside the integrator, s.
FAST = (1e-6, 1e-3)
TOLERANCES = tuple(10.0**-k for k in range(4, 13))
HEADING = (f"{'mechanism':39}{'s':>6}{'rtol':>7}{'steps':>7}{'ms':>10}  {'reference':12}{'error q':>9}{'error u':>9}"
           f"{'precise':>9}{'energy':>9}{'C':>9}{'C_dot':>9}{'over s':>8}{'rank':>7}")
LEGEND = f"""\
ms: inside the compiled integrator, median; error q, u: largest of positions (m, rad) and speeds (m/s, rad/s) against the
reference, of andrews_squeezer relative, entry by entry; precise: at the end, against the motion at more digits
(symdyn.lab.extended), relative to the largest of the motion; energy: error of the balance with the work of drives and dampers
(<= {ENERGY:g}); C, C_dot: violations of the constraints over the time after them at rtol {LONG_RTOL:g}, with projection,
relative to the mechanism's length and largest speed (<= {VIOLATION:g}); rank of the constraints over the outputs."""


@dataclass(frozen=True)
class Row:
    """One mechanism, SI units: of the compared run duration, tolerance, steps, seconds inside the integrator (median), errors.

    reference   kind of it, empty if there is none; error_q, error_u: largest error
    precise     largest error against the motion at more digits, relative to the largest of q and of u over the motion
    energy      error of the energy balance; violation_q, violation_u: over `long` s; rank: least, largest
    misses      what is larger than its bound
    """

    name: str
    duration: float
    rtol: float
    steps: int
    seconds: float
    reference: str
    error_q: float
    error_u: float
    precise: float
    energy: float
    violation_q: float
    violation_u: float
    long: float
    rank: tuple[int, int]
    misses: tuple[str, ...] = ()

    def __str__(self) -> str:
        rank = "-" if self.rank == (0, 0) else "..".join(str(r) for r in sorted(set(self.rank)))
        values = self.error_q, self.error_u, self.precise, self.energy, self.violation_q, self.violation_u
        figures = "".join(f"{'' if math.isnan(v) else f'{v:.1e}':>9}" for v in values)
        return (f"{self.name:39}{self.duration:>6g}{self.rtol:>7.0e}{self.steps:>7}{self.seconds * 1e3:>10.3f}  "
                f"{self.reference:12}{figures}{self.long:>8g}{rank:>7}  {'; '.join(self.misses)}").rstrip()


@dataclass(frozen=True)
class Point:
    """Andrews' mechanism at one tolerance: steps, seconds inside the integrator (median), relative error of its positions."""

    rtol: float
    steps: int
    seconds: float
    error: float

    def __str__(self) -> str:
        return f"{self.rtol:>9.0e}{self.steps:>7}{self.seconds * 1e3:>9.3f}{self.error:>10.1e}"


def measure(case: Case, repeats: int = 5, long: float | None = None) -> Row:
    """One mechanism.

    repeats   of the timed run;  long: s over which violations are looked at (default: the case's)
    """
    module = case.system().equations().compile(backend="c")
    end, given = case.duration(), {"rtol": case.rtol, "atol": case.atol}
    timed = [module.simulate(np.array([0.0, end]), **given) for _ in range(repeats)]
    reference = case.reference() if case.reference else None
    error = (math.nan, math.nan)
    if reference is not None:
        error = reference.errors(module.simulate(np.r_[0.0, reference.times], **given))
    balance = module.simulate((0.0, end), **given, work=True)
    long = case.long if long is None else min(long, case.long)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SimulationWarning)  # it is in the row
        after = module.simulate((0.0, long), rtol=LONG_RTOL)
    ranks = after.rank
    row = Row(case.label, end, case.rtol, timed[0].n_steps, statistics.median(s.integrator_seconds for s in timed),
              reference.kind if reference else "", *error, _to_precise(case.label, balance), balance.energy_error(),
              largest(after.constraint_violation), largest(after.velocity_violation), long,
              (int(ranks.min()), int(ranks.max())))
    bounds = {"energy": ENERGY, "violation_q": VIOLATION, "violation_u": VIOLATION, **case.bounds}
    stopped = () if after.success else (f"MISSED {after.message.partition('; the state there')[0]}",)
    return Row(**{**asdict(row), "misses": (*_missed(row, bounds), *stopped)})


def _missed(row: Row, bounds: Mapping[str, float | None]) -> Iterator[str]:
    for name, bound in bounds.items():
        if bound is not None and not getattr(row, name) <= bound:
            yield f"MISSED {name} <= {bound:g}"


def _to_precise(label: str, sol: Any) -> float:
    """The error at the end against the stored motion; not a number if there is none, or of another time."""
    precise = known(label)
    if precise is None or precise["t"] != sol.t[-1]:
        return math.nan
    worst = 0.0
    for values, name in ((sol.q, "q"), (sol.u, "q_dot")):
        worst = max(worst, largest(values[-1] - np.array(precise[name], dtype=float)) / (largest(values) or 1.0))
    return worst


def sweep(repeats: int = 5, tolerances: Sequence[float] = TOLERANCES) -> list[Point]:
    """Andrews' mechanism over tolerances, atol = rtol; errors against its motion at more digits, or the published one."""
    case = chosen(["andrews_squeezer"])[0]
    module = case.system().equations().compile(backend="c")
    exact = np.array((known(case.name) or REFERENCE[case.name])["q"], dtype=float)
    points = []
    for rtol in tolerances:
        runs = [module.simulate([0.0, case.duration()], rtol=rtol, atol=rtol) for _ in range(repeats)]
        points.append(Point(rtol, runs[0].n_steps, statistics.median(s.integrator_seconds for s in runs),
                            largest((runs[0].q[-1] - exact) / exact)))
    return points


def fastest(points: Sequence[Point]) -> float:
    """The least time with an error as small as FAST asks for, s; infinite if there is none."""
    return min((p.seconds for p in points if p.error <= FAST[0]), default=math.inf)


def distances() -> list[str]:
    """Distances of the published ends from those at more digits, one line each."""
    lines = []
    for name, row in REFERENCE.items():
        precise = known(name)
        if precise is None or "q" not in row or row["t"] != precise["t"]:
            continue
        parts = []
        for what in ("q", "q_dot", "q_ddot", "lambda"):
            if what in row:
                exact = np.array(precise[what], dtype=float)
                published = np.array(row[what]) * (-1 if (name, what) == ("car_axis", "lambda") else 1)  # they count otherwise
                parts.append(f"{what} {largest(published - exact):.1e} ({largest((published - exact) / exact):.1e} relative)")
        lines.append(f"{name}: the published end is off by {', '.join(parts)}; {precise['digits']} digits are known")
    return lines


def run(names: Sequence[str] | None = None, repeats: int = 5, to_json: Path | None = None) -> int:
    """Measure the named mechanisms (default: all) and print a line of each; returns how many bounds are missed.

    Raises SymdynError for unknown names or impossible repeats.
    """
    cases = chosen(names)
    if repeats < 1:
        raise SymdynError(f"{repeats} repeats were asked for; pass 1 or more")
    compiler = require_compiler()
    print(HEADING, flush=True)
    rows, points, missed = [], [], 0
    for case in cases:
        rows.append(measure(case, repeats))
        missed += len(rows[-1].misses)
        print(rows[-1], flush=True)
    print(LEGEND)
    for case in cases:
        if case.bounds:
            print(f"{case.label}: " + ", ".join(f"{name} " + ("without bound" if bound is None else f"<= {bound:g}")
                                                    for name, bound in case.bounds.items()))
    if any(case.name == "andrews_squeezer" for case in cases):
        points = sweep(repeats)
        late = not fastest(points) < FAST[1]
        missed += late
        print(f"andrews_squeezer, relative error of q against run time:\n{'rtol':>9}{'steps':>7}{'ms':>9}{'error q':>10}")
        print("\n".join(map(str, points)))
        print(f"error <= {FAST[0]:g} in {fastest(points) * 1e3:.3f} ms (< {FAST[1] * 1e3:g}){' MISSED' if late else ''}")
    for line in distances():
        if line.partition(":")[0] in {case.name for case in cases}:
            print(line)
    if to_json is not None:
        result = {"machine": platform.machine(), "compiler": compiler.version, "repeats": repeats,
                  "rows": [_record(r) for r in rows],
                  "andrews_squeezer over tolerances": [asdict(p) for p in points],
                  "sources": {case.label: case.reference().source for case in cases if case.reference}}
        to_json.write_text(json.dumps(result, indent=1) + "\n", encoding="utf-8")
        print(f"wrote {to_json}")
    return missed


def _record(row: Row) -> dict[str, Any]:
    """A row without the figures that it does not have."""
    return {k: v for k, v in asdict(row).items() if not (isinstance(v, float) and math.isnan(v))}
