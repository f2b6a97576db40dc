"""`symdyn bench published`: published mechanisms within their published bounds, in the least time of all programs."""

from __future__ import annotations

import json
import math
import platform
import sys
import textwrap
import time as clock
import warnings
from collections.abc import Callable, Iterator, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from symdyn.bench.work import against
from symdyn.bench.work.published_cases import CASES, THRESHOLD, Case
from symdyn.bench.work.published_lines import Line, Run, lines_of, search, time_all, worth
from symdyn.errors import SimulationWarning, SymdynError
from symdyn.pages import write_text
from symdyn.runtime.compiler import require_compiler

LEGEND = f"""\
ms: inside the integrator, to the end, least time of the runs, which are the same bit by bit; error: of all outputs, root mean
square of differences relative to the exact value, or to {THRESHOLD:g} where that is larger; of A03 q the largest relative one.
The library's text gives bounds (low and high precision), outputs and threshold of A01 and A02(40); they are taken for the
others as they are of A02(40). Runs with outputs take the same steps and are not timed."""


@dataclass(frozen=True)
class Result:
    """One mechanism; reference: how it was made; left_out: programs with the reason; unfinished: the budget ended it."""

    case: Case
    reference: str
    lines: list[Line]
    left_out: dict[str, str]
    unfinished: bool = False

    def least(self, bound: float, peer: bool) -> tuple[Line, Run] | None:
        """The fastest within a bound, of other programs or of ours."""
        found = [(line, run) for line in self.lines if line.peer == peer and (run := line.within(bound)) is not None]
        return min(found, key=lambda both: both[1].time, default=None)

    def missed(self) -> list[float]:
        """The bounds within which ours is not the first; none where that is not decided."""
        if self.unfinished:
            return []
        return [bound for bound in self.case.bounds if (ours := self.least(bound, False)) is None or (
            (theirs := self.least(bound, True)) is not None and theirs[1].time < ours[1].time)]

    def __str__(self) -> str:
        return "\n".join(self._lines())

    def _lines(self) -> Iterator[str]:
        case = self.case
        yield (f"{case.name}: {case.title}; {case.outputs} output{'s' * (case.outputs > 1)}, bounds "
               f"{' and '.join(f'{b:g}' for b in case.bounds)}{' as published' * case.published}; reference: {self.reference}")
        yield f"{'program':26}{'formulation':14}{'bound':>8}{'rtol':>9}{'ms':>11}{'error':>10}"
        for bound in self.case.bounds:
            found = [(line, run) for line in self.lines if (run := line.within(bound)) is not None]
            for line, run in sorted(found, key=lambda both: both[1].time):
                yield (f"{line.program:26}{line.formulation.name:14}{bound:>8.0e}{run.tolerance:>9.0e}"
                       f"{run.time * 1e3:>11.4g}{run.error:>10.1e}")
            yield self._told(bound)
        for name, why in self.left_out.items():
            yield f"  left out: {name}: {textwrap.shorten(why, 170)}"

    def _told(self, bound: float) -> str:
        if self.unfinished:
            return f"  within {bound:g}: not decided, the budget was used up before all programs were timed"
        ours, theirs = self.least(bound, False), self.least(bound, True)
        first = "none of ours" if ours is None else f"{ours[0].program} {ours[1].time * 1e3:.4g} ms"
        if theirs is None:
            return f"  within {bound:g}: {first}; no other program"
        times = "" if ours is None else f", {theirs[1].time / ours[1].time:.2g} times ours"
        return (f"  within {bound:g}: {first}; {theirs[0].program} {theirs[1].time * 1e3:.4g} ms{times}"
                + (" MISSED" if bound in self.missed() else ""))

    def record(self) -> dict[str, Any]:
        """As plain data."""
        return {"name": self.case.name, "title": self.case.title, "bounds": self.case.bounds, "reference": self.reference,
                "outputs": self.case.outputs, "published": self.case.published, "missed": self.missed(),
                "unfinished": self.unfinished,
                "threshold": None if self.case.relative else THRESHOLD, "left out": self.left_out, "lines": [
                    {"program": line.program, "formulation": line.formulation.name, "peer": line.peer, "why": line.why,
                     "runs": [{k: None if isinstance(v, float) and not math.isfinite(v) else v for k, v in asdict(run).items()}
                              for run in line.runs]} for line in self.lines]}


def measure(case: Case, peers: Sequence[str] | None = None, repeats: int = 5, deadline: float = math.inf,
            told: Callable[[str], None] = lambda text: None) -> Result:
    """One mechanism.

    peers      default: all;  deadline: of time.perf_counter, after which nothing new is tried
    told       called with what is going on
    Raises SymdynError where there is no reference.
    """
    formulations = case.formulations()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SimulationWarning)  # where a run stops it is told
        exact, how = case.reference(formulations[0])
        lines, left_out = list[Line](), dict[str, str]()
        for line in lines_of(case, formulations, against.names() if peers is None else peers, left_out, deadline):
            begun = clock.perf_counter()
            search(line, case, exact, deadline)
            told(f"{case.name}: {line.program}, {line.formulation.name}: {len(line.runs)} tolerances, "
                 f"{clock.perf_counter() - begun:.1f} s")
            lines.append(line)
        for line in lines:
            if not any(r.error <= case.bounds[0] for r in line.runs):
                left_out[f"{line.program}, {line.formulation.name}"] = line.nearest()
        time_all([(line, run) for line in lines for run in worth(line, case)], repeats, deadline)
    return Result(case, how, lines, left_out, clock.perf_counter() > deadline)


def _tell(text: str) -> None:
    print(f"symdyn: {text}", file=sys.stderr, flush=True)


def run(names: Sequence[str] | None = None, peers: Sequence[str] | None = None, repeats: int = 5, budget: float | None = None,
        folder: Path | None = None) -> int:
    """Measure the named mechanisms (default: all) and print a table of each; returns of how many bounds ours is not
    the first, and how many mechanisms are not decided.

    names   such as A03;  peers: other programs, default: all;  budget: s, after which nothing new is tried
    folder  of published.json, written after every mechanism (default: generated/published)
    Raises SymdynError that lists everything that is wrong with what is asked for.
    """
    faults = [f"there is no published mechanism {name!r}; there are {', '.join(CASES)}" for name in names or ()
              if name not in CASES]
    faults += [f"there is no peer {name!r}; there are {', '.join(against.names())}" for name in peers or ()
               if name not in against.names()]
    if repeats < 1:
        faults.append(f"{repeats} repeats were asked for; pass 1 or more")
    if budget is not None and not budget > 0:
        faults.append(f"the budget is {budget!r}; pass a positive number of seconds")
    if faults:
        raise SymdynError("\n".join(faults))
    folder, compiler = folder or Path("generated") / "published", require_compiler()
    chosen = [CASES[name] for name in dict.fromkeys(names or CASES)]
    deadline = math.inf if budget is None else clock.perf_counter() + budget
    results: list[Result] = []
    for case in chosen:
        if clock.perf_counter() > deadline:
            break
        results.append(measure(case, peers, repeats, deadline, _tell))
        print(results[-1], end="\n\n", flush=True)
        data = {"machine": platform.machine(), "compiler": compiler.version, "repeats": repeats,
                "mechanisms": [r.record() for r in results]}
        write_text(folder / "published.json", json.dumps(data, indent=1) + "\n", "what was measured")
    left = [case.name for case in chosen[len(results):]]
    if left:
        print(f"the budget of {budget:g} s is used up: {', '.join(left)} were not begun\n")
    print(LEGEND)
    print(f"wrote {folder / 'published.json'}")
    return sum(len(r.missed()) for r in results) + sum(r.unfinished for r in results) + len(left)
