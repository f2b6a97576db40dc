"""`symdyn bench published`: published mechanisms within their published bounds, in the least time of all programs."""

from __future__ import annotations

import contextlib
import math
import platform
import sys
import textwrap
import time as clock
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from symdyn.bench import kept as files
from symdyn.bench.work import against, resume
from symdyn.bench.work.timing import PASSES
from symdyn.errors import SimulationWarning, SymdynError
from symdyn.lab.published.cases import CASES, THRESHOLD, Case
from symdyn.lab.published.lines import Line, Run, lines_of, search, time_all, worth
from symdyn.progress import bar as progress_bar
from symdyn.runtime.building.compiler import require_compiler

RESULTS = "published.json"
# Part of what is left of a budget for tolerances that is kept for times.
_FOR_TIMES = 1 / 4
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
        result = [(line, run) for line in self.lines if line.peer == peer and (run := line.within(bound)) is not None]
        return min(result, key=lambda both: both[1].time, default=None)

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
            result = [(line, run) for line in self.lines if (run := line.within(bound)) is not None]
            for line, run in sorted(result, key=lambda both: both[1].time):
                yield (f"{line.program:26}{line.form:14}{bound:>8.0e}{run.tolerance:>9.0e}"
                       f"{run.time * 1e3:>11.4g}{run.error:>10.1e}")
            for line in self.lines:
                known = [run for run in line.runs if run.error <= bound]
                if known and line.within(bound) is None:
                    run = max(known, key=lambda run: run.tolerance)
                    yield f"{line.program:26}{line.form:14}{bound:>8.0e}{run.tolerance:>9.0e}{'not timed':>11}{run.error:>10.1e}"
            yield self._sentence(bound)
        for name, why in self.left_out.items():
            yield f"  left out: {name}: {textwrap.shorten(why, 170)}"

    def _sentence(self, bound: float) -> str:
        if self.unfinished:
            return f"  within {bound:g}: not decided, the budget was used up before all programs were looked at and timed"
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
                "unfinished": self.unfinished, "complete": not self.unfinished, "text": str(self),
                "threshold": None if self.case.relative else THRESHOLD, "left out": self.left_out, "lines": [
                    {"program": line.program, "formulation": line.formulation.name, "taken": line.form, "peer": line.peer,
                     "why": line.why, "searched": line.searched,
                     "runs": [{k: None if isinstance(v, float) and not math.isfinite(v) else v for k, v in asdict(run).items()}
                              for run in line.runs]} for line in self.lines]}


def measure(case: Case, peers: Sequence[str] | None = None, repeats: int = 5, deadline: float = math.inf,
            log: Callable[[str], None] = lambda text: None, before: Mapping[str, Any] | None = None,
            store: Callable[[Result], None] = lambda result: None, progress: bool = False) -> Result:
    """One mechanism.

    peers      default: all;  deadline: of time.perf_counter, after which nothing new is tried
    log       called with one line at each stage
    before     the record of a run that was stopped: the tolerances that it found are timed again, not looked for
    store      called with what is known after every line;  progress: show a bar (needs tqdm)
    Raises SymdynError where there is no reference.
    """
    peers = against.names() if peers is None else peers
    found = {(line["program"], line["formulation"]): line for line in (before or {}).get("lines", ()) if line["searched"]}
    with warnings.catch_warnings(), contextlib.ExitStack() as stack:
        warnings.simplefilter("ignore", SimulationWarning)  # where a run stops it is reported
        step: Callable[[], Any] = lambda: None
        if progress:
            bar = progress_bar(desc=case.name, total=len(case.systems) * len(case.methods) + PASSES + sum(
                len(against.peers(name)) for name in peers), unit="step", leave=False)
            stack.callback(bar.close)
            step, log = bar.update, lambda text: bar.write(f"symdyn: {text}", file=sys.stderr)
        formulations = case.formulations()
        exact, how = case.reference(formulations[0])
        lines, left_out, late = list[Line](), dict[str, str](), list[str]()
        until: float | None = None  # of the search, which begins when other programs are prepared
        for line in lines_of(case, formulations, peers, left_out, late, deadline, stack):
            begun, known = clock.perf_counter(), found.get(line.key)
            until = begun + (1 - _FOR_TIMES) * (deadline - begun) if until is None else until
            if known is not None:
                line.runs, line.why, line.searched = [Run.of(run) for run in known["runs"]], known["why"], True
            else:
                search(line, case, exact, until)
                if line.runs:
                    log(f"{case.name}: {line.program}, {line.formulation.name}: {len(line.runs)} tolerances, "
                        f"{clock.perf_counter() - begun:.1f} s")
            lines.append(line)
            store(Result(case, how, lines, left_out, True))
            step()
        for line in lines:
            if not any(r.error <= case.bounds[0] for r in line.runs):
                left_out[f"{line.program}, {line.formulation.name}"] = line.nearest()
        time_all([(line, run) for line in lines for run in worth(line, case)], repeats, deadline, step)
    unfinished = bool(late) or not all(line.searched for line in lines) or clock.perf_counter() > deadline
    return Result(case, how, lines, left_out, unfinished)


def _tell(text: str) -> None:
    print(f"symdyn: {text}", file=sys.stderr, flush=True)


def run(names: Sequence[str] | None = None, peers: Sequence[str] | None = None, repeats: int = 5, budget: float | None = None,
        folder: Path | None = None, progress: bool = False) -> int:
    """Measure the named mechanisms (default: all) and print a table of each; returns of how many bounds ours is not
    the first, and how many mechanisms are not decided.

    names     such as A03;  peers: other programs, default: all;  budget: s, after which nothing new is tried
    folder    of published.json, written as soon as anything is known (default: generated/published); what an unfinished run
              left there is gone on with: mechanisms that were done stay, of others the tolerances that were found; those that
              are not named stay in the file as they are
    progress  show a bar (needs tqdm)
    Raises SymdynError that lists everything that is wrong with what is requested.
    """
    faults = [f"there is no published mechanism {name!r}; there are {', '.join(CASES)}" for name in names or ()
              if name not in CASES]
    faults += [f"there is no peer {name!r}; there are {', '.join(against.names())}" for name in peers or ()
               if name not in [*against.names(), against.ALL]]
    if repeats < 1:
        faults.append(f"{repeats} repeats were asked for; pass 1 or more")
    if budget is not None and not budget > 0:
        faults.append(f"the budget is {budget!r}; pass a positive number of seconds")
    folder = folder or Path("generated") / "published"
    faults += filter(None, [resume.unwritable(folder, [RESULTS])])
    if faults:
        raise SymdynError("\n".join(faults))
    deadline = math.inf if budget is None else clock.perf_counter() + budget
    compiler = require_compiler()
    chosen = [CASES[name] for name in dict.fromkeys(names or CASES)]
    programs = against.names() if peers is None else against.named(peers)
    marks = {case.name: _fingerprint(case, programs, repeats) for case in chosen}
    stored = _stored(folder / RESULTS)
    known = {name: r for name, r in stored.items() if name in marks and _sound(r) and r["fingerprint"] == marks[name]}
    if all(name in known and not known[name]["unfinished"] for name in marks):
        known = {}  # all of it was done: it is measured again
    about = {"machine": platform.machine(), "compiler": compiler.version, "repeats": repeats}

    def store(result: Result | None = None) -> None:
        if result is not None:
            name = result.case.name
            known[name] = {**result.record(), **about, "fingerprint": marks[name], "timed": timed}
        # Mechanisms that were not requested stay as they are.
        kept = {**{name: r for name, r in stored.items() if name not in marks}, **known}
        files.write(folder / RESULTS, {"mechanisms": [kept[name] for name in dict.fromkeys((*CASES, *kept)) if name in kept]})

    left, timed = [], resume.now()
    for case in chosen:
        before = known.get(case.name)
        if before is not None and not before["unfinished"]:
            print(f"{before['text']}\n  all of it was measured in an earlier run, of {before['timed']}", end="\n\n", flush=True)
        elif clock.perf_counter() > deadline:
            left.append(case.name)
        else:
            try:
                result = measure(case, programs, repeats, deadline, _tell, before, store, progress)
            except KeyboardInterrupt:
                _tell("what was found is kept, the same command goes on")
                raise
            store(result)
            print(result, end="\n\n", flush=True)
    store()
    if left:
        print(f"the budget of {budget:g} s is used up: {', '.join(left)} {'was' if len(left) == 1 else 'were'} not begun\n")
    print(LEGEND)
    print(f"wrote {folder / RESULTS}")
    records = [known[case.name] for case in chosen if case.name not in left]
    undecided = len(left) + sum(r["unfinished"] for r in records)
    if undecided:
        print("run it again with the same output folder to go on")
    return sum(len(r["missed"]) for r in records) + undecided


def _fingerprint(case: Case, peers: Sequence[str], repeats: int) -> str:
    """Fingerprint of the data that the results of a mechanism depend on: the request, the programs that are there, the machine,
    our code."""
    return resume.fingerprint(case.name, case.end, case.outputs, case.bounds, case.methods, list(case.systems), list(peers),
                              resume.installed(peers), repeats, resume.about(), resume.code())


def _stored(path: Path) -> dict[str, dict[str, Any]]:
    """The records of a file by name; none where it is damaged or another's."""
    data = files.read(path)
    records = data.get("mechanisms") if isinstance(data, dict) else None
    return {r["name"]: r for r in (records if isinstance(records, list) else ())
            if isinstance(r, dict) and isinstance(r.get("name"), str)}


def _sound(record: Mapping[str, Any]) -> bool:
    """Whether a record is as it was written."""
    with contextlib.suppress(KeyError, TypeError, ValueError, AttributeError):
        for line in record["lines"]:
            for run in line["runs"]:
                math.isfinite(Run.of(run).tolerance + Run.of(run).error)
        texts = [record["text"], record["timed"], record["fingerprint"]]
        texts += [line[k] for line in record["lines"] for k in ("program", "formulation", "why")]
        return (all(isinstance(text, str) for text in texts) and isinstance(record["missed"], list)
                and isinstance(record["unfinished"], bool) and all("searched" in line for line in record["lines"]))
    return False
