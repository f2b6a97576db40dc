"""Programs on a published mechanism, one line each: the tolerances that keep its bounds, and what runs with them take."""

from __future__ import annotations

import contextlib
import math
import time as clock
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from symdyn.bench.work import against
from symdyn.bench.work.against.apart import TooLong, prepared
from symdyn.bench.work.against.peer import taken_as
from symdyn.bench.work.system_under_test import Formulation
from symdyn.bench.work.timing import ENOUGH, PASSES, one_pass, seconds_of
from symdyn.errors import SymdynError
from symdyn.lab.published.cases import Case

# Tolerances, from loose to tight; between the last that is off by too much and the first that is not, there are _HALVINGS more.
TOLERANCES = tuple(10.0**-k for k in range(2, 15, 2))
_HALVINGS = 3
# A line whose runs take longer than _SLOW, s, or whose search with all that it compiles takes longer than _PATIENCE, s, is not
# asked for tighter tolerances.
_SLOW, _PATIENCE = 10.0, 300.0
# Methods of ours that are compiled in no time.
QUICK = ("dop853", "bs54")
# Part of what is left of a budget that may pass until all other programs are prepared, and part of that for the next one.
_FOR_PEERS, _FOR_NEXT = 1 / 2, 1 / 2


@dataclass
class Run:
    """A program with one tolerance: its error, and what it took, s."""

    tolerance: float
    error: float
    seconds: list[float] = field(default_factory=list)

    @property
    def time(self) -> float:
        """s"""
        return min(self.seconds)

    @classmethod
    def of(cls, data: Mapping[str, Any]) -> Run:
        """From plain data, not timed yet."""
        return cls(data["tolerance"], math.nan if data["error"] is None else data["error"])


@dataclass
class Line:
    """A program, or a method of ours, on one formulation.

    look       tolerance -> s inside the integrator, states at the case's times
    timed      tolerance, repeats, deadline -> s inside the integrator of the runs of one pass
    searched   all tolerances that are of interest were tried: a later run need not
    taken      what it is asked to run, if that is no formulation of ours
    """

    program: str
    formulation: Formulation
    peer: bool
    look: Callable[[float], tuple[float, np.ndarray]]
    timed: Callable[[float, int, float], list[float]]
    runs: list[Run] = field(default_factory=list)
    why: str = ""
    searched: bool = False
    taken: str = ""

    @property
    def form(self) -> str:
        """Form that it runs."""
        return self.taken or self.formulation.name

    @property
    def key(self) -> tuple[str, str]:
        """Key that distinguishes lines."""
        return self.program, self.formulation.name

    def within(self, bound: float) -> Run | None:
        """The fastest run within a bound."""
        return min((r for r in self.runs if r.error <= bound and r.seconds), key=lambda r: r.time, default=None)

    def nearest(self) -> str:
        """Why it is not within the bounds."""
        if not self.runs:
            return self.why
        errors = [r.error for r in self.runs if math.isfinite(r.error)]
        reason = f"not within the bounds, its least error is {min(errors):.1e}" if errors else "no run reached the end"
        return f"{reason}; {self.why}" if self.why else reason


def lines_of(case: Case, formulations: Sequence[Formulation], peers: Sequence[str], left_out: dict[str, str],
             late: list[str], deadline: float, stack: contextlib.ExitStack) -> Iterator[Line]:
    """Ours, and other programs, each on the first formulation that it takes; the others into left_out.

    Other programs are prepared first, and looked at before what of ours takes long to compile, so that a short budget shows
    both.
    late   takes those that were not ready in time;  stack: closes what was prepared
    """
    others = list(_others(case, formulations, peers, left_out, late, deadline, stack))
    ours = {quick: [_own(case, f, method) for f in formulations for method in case.methods if (method in QUICK) == quick]
            for quick in (True, False)}
    yield from (*ours[True], *others, *ours[False])


def _others(case: Case, formulations: Sequence[Formulation], peers: Sequence[str], left_out: dict[str, str], late: list[str],
            deadline: float, stack: contextlib.ExitStack) -> Iterator[Line]:
    begun = clock.perf_counter()
    until = begun + _FOR_PEERS * (deadline - begun)
    for name in peers:
        for peer in against.peers(name):
            there, taken, why = peer.available(), False, dict[str, str]()
            for f in formulations if there is True else ():
                if f.name == "absolute":
                    continue
                now = clock.perf_counter()
                try:
                    ready = prepared(peer, (f.equations, f.module.default_parameters, f.x0, f.system), [case.end],
                                     now + _FOR_NEXT * (until - now), deadline)
                except TooLong as error:
                    why[f.name] = str(error)
                    late.append(peer.name)
                    continue
                except Exception as error:  # Unfit, or whatever another program raises
                    why[f.name] = str(error) or type(error).__name__
                    continue
                taken = True
                stack.callback(ready.close)
                yield Line(peer.name, f, True, lambda tolerance, ready=ready: ready.states(  # type: ignore[misc]
                    tolerance, case.times), lambda tolerance, repeats, deadline, ready=ready: ready.timed(  # type: ignore[misc]
                        0, tolerance, repeats, deadline)[0], taken=taken_as(peer, f.name))
                break
            if not taken:
                left_out[peer.name] = str(there) if there is not True else "; ".join(dict.fromkeys(why.values()))


def _own(case: Case, f: Formulation, method: str) -> Line:
    def look(tolerance: float) -> tuple[float, np.ndarray]:
        sol = f.module.simulate(np.r_[0.0, case.times], method=method, rtol=tolerance)
        if not sol.success:
            raise SymdynError(sol.message)
        return seconds_of(sol), np.asarray(sol.x[1:])

    def timed(tolerance: float, repeats: int, deadline: float) -> list[float]:
        return one_pass(lambda: seconds_of(f.module.simulate(np.array([0.0, case.end]), method=method, rtol=tolerance)), repeats,
                        deadline)

    return Line(f"symdyn {method}", f, False, look, timed)


def search(line: Line, case: Case, exact: np.ndarray, deadline: float) -> None:
    """Look at looser and tighter tolerances until both bounds are kept.

    deadline   of time.perf_counter, after which nothing more is looked at
    """
    whole = [True]

    def look(tolerance: float) -> float:
        took, error = 0.0, math.nan
        try:
            took, states = line.look(tolerance)
            error = case.error(case.history(line.formulation, case.times, states), exact)
        except Exception as failed:  # whatever another program raises is reported as its own
            line.why = str(failed) or type(failed).__name__
            whole[0] &= not isinstance(failed, TooLong)
        line.runs.append(Run(tolerance, error))
        return took

    last = min(deadline, clock.perf_counter() + _PATIENCE)
    if clock.perf_counter() > deadline:
        line.why = "not tried within the budget"
        return
    for tolerance in TOLERANCES:
        took = look(tolerance)
        if line.runs[-1].error <= case.bounds[-1]:
            break
        if took > _SLOW or clock.perf_counter() > last:
            line.why = line.why or (f"a run at {tolerance:g} with outputs took {took:.0f} s" if took > _SLOW else "time was up "
                                    "before") + "; tighter tolerances were not tried"
            break
    for bound in [bound for bound in case.bounds for _ in range(_HALVINGS)]:
        good = max((r.tolerance for r in line.runs if r.error <= bound), default=math.nan)
        bad = min((r.tolerance for r in line.runs if r.tolerance > good), default=1.0)
        if math.isfinite(good) and clock.perf_counter() < last:
            look(math.sqrt(good * bad))
    line.searched = whole[0] and clock.perf_counter() <= deadline


def worth(line: Line, case: Case) -> list[Run]:
    """The runs that may be the fastest within a bound: of each bound the three loosest that keep it."""
    loose = sorted(line.runs, key=lambda r: -r.tolerance)
    return [r for r in loose if any(r in [s for s in loose if s.error <= bound][:3] for bound in case.bounds)]


def time_all(runs: Sequence[tuple[Line, Run]], repeats: int, deadline: float = math.inf,
             step: Callable[[], Any] = lambda: None) -> None:
    """Time all runs, one after the other, several times over, so that they see the machine alike.

    deadline   of time.perf_counter, after which none is begun;  step: called after every pass
    """
    for _ in range(PASSES):
        for line, run in runs:
            if sum(run.seconds) >= ENOUGH or clock.perf_counter() > deadline:
                continue
            try:
                run.seconds += line.timed(run.tolerance, repeats, deadline)
            except Exception as failed:  # whatever another program raises is reported as its own
                line.why = str(failed) or type(failed).__name__
        step()
