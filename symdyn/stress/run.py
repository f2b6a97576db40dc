"""Runs checks: those that any mechanism can be put to, and those that need one of their own."""

from __future__ import annotations

import contextlib
import difflib
import multiprocessing
import signal
import time as clock
import traceback
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from dataclasses import dataclass
from numbers import Integral
from pathlib import Path
from typing import Any

from symdyn.errors import ArgumentError
from symdyn.formulation.equations import Equations
from symdyn.model.system import System
from symdyn.progress import bar as progress_bar
from symdyn.stress import attitude, chains, extremes, long_runs, motion, rounding, singular, units
from symdyn.stress.record import DEGRADE, FAIL, Interrupted, MotionStops, NotApplicable, Row, StressReport
from symdyn.stress.subject import Subject
from symdyn.systems import get
from symdyn.systems import names as catalogue

# In the short form, where the whole catalogue would take too long.
SHORT = ("cart_pole", "pendulum_absolute")
# The check of a row that tells why a motion was not looked at.
USUAL = "usual motion"


@dataclass(frozen=True)
class Check:
    """One check, or a family: run(subject, short) of any mechanism, or run(short) with mechanisms of its own.

    short   whether the short form has it
    """

    name: str
    run: Callable[..., Iterator[Row]]
    of_system: bool = False
    short: bool = True

    @property
    def title(self) -> str:
        """The first line of what it says of itself."""
        return (self.run.__doc__ or "").strip().splitlines()[0]


CHECKS = {check.name: check for check in (
    Check("rounding", rounding.rounding, True), Check("condition", motion.condition, True),
    Check("energy", motion.energy, True), Check("constraints", motion.constraints, True),
    Check("reversal", motion.reversal, True), Check("divergence", motion.divergence, True),
    Check("units", units.units, True), Check("steps", extremes.steps, True), Check("denormals", extremes.denormals, True),
    Check("masses", extremes.masses, True), Check("inputs", extremes.inputs, True),
    Check("gimbal", attitude.gimbal), Check("flips", attitude.flips), Check("rotor", attitude.rotor),
    Check("constraint_drift", long_runs.constraint_drift), Check("energy_drift", long_runs.energy_drift),
    Check("stiffness", long_runs.stiffness), Check("massless", singular.massless),
    Check("singular", singular.configurations, short=False), Check("redundant", singular.redundant, short=False),
    Check("user_forces", singular.user_forces), Check("chaos", chains.chaos),
    Check("long_chains", chains.long_chains, short=False),
)}


def stress(system: Any = None, short: bool = False, checks: Sequence[str] | None = None, progress: bool = False,
           jobs: int = 1, show: Callable[[Row], None] | None = None) -> StressReport:
    """Put a mechanism, or symdyn itself with its catalogue, under stress.

    system     a System, Equations or the name of one of the catalogue, or a list of these; None: the catalogue, and the checks
               that have mechanisms of their own
    short      fewer states, systems and shorter runs: less than half a minute
    checks     names of CHECKS; default: all that apply
    progress   show a bar (needs tqdm); jobs: processes, for names of the catalogue and checks of their own
    show       called with every row as soon as it is there

    Returns a StressReport; `passed` is False if a row failed. A check that crashes is such a row.
    Raises ArgumentError for an unknown check or something that is no mechanism, SymdynError for an unknown name; Interrupted, a
    KeyboardInterrupt with the report of what is finished.
    """
    if isinstance(jobs, bool) or not isinstance(jobs, Integral) or jobs < 1:
        raise ArgumentError(f"jobs is {jobs!r}; pass a number of processes, 1 or more")
    tasks = _tasks(system, short, _chosen(checks))
    report, begun = StressReport(), clock.perf_counter()
    total, done = sum(len(names) for _, names, _ in tasks), 0
    bar = _bar(total) if progress else None
    many = jobs > 1 and all(isinstance(task[0], str) for task in tasks)
    try:
        with contextlib.closing(_spread(tasks, int(jobs)) if many else _in_turn(tasks)) as results:
            for rows, left_out, n in results:
                report.rows += rows
                report.left_out += left_out
                done += n
                if bar is not None:
                    bar.update(n)
                if show is not None:
                    for row in rows:
                        show(row)
    except KeyboardInterrupt:
        report.unfinished = f"{done} of {total} checks were done"
        raise Interrupted(report) from None
    finally:
        report.seconds = clock.perf_counter() - begun
        if bar is not None:
            bar.close()
    return report


Task = tuple[Any, tuple[str, ...], bool]
Result = tuple[list[Row], list[str], int]


def _tasks(system: Any, short: bool, chosen: list[Check]) -> list[Task]:
    """What to run: a system ("" for none) with names of checks."""
    own = tuple(c.name for c in chosen if not c.of_system and (c.short or not short))
    of_system = tuple(c.name for c in chosen if c.of_system and (c.short or not short))
    if system is not None:
        listed = list(system) if isinstance(system, (list, tuple)) else [system]
        for one in listed:
            if isinstance(one, str):
                get(one)  # an unknown name is told before anything is run
            elif not isinstance(one, (System, Equations, Subject)):
                raise ArgumentError(f"stress was given {one!r}; pass a System, Equations, or the name of one of the catalogue")
        if not of_system:
            raise ArgumentError(f"the checks {', '.join(own)} have mechanisms of their own; leave out the system")
        return [(one, of_system, short) for one in listed]
    listed = list(SHORT if short else catalogue())
    return [*[("", (name,), short) for name in own], *[(name, of_system, short) for name in listed if of_system]]


def _chosen(names: Sequence[str] | None) -> list[Check]:
    if names is None:
        return list(CHECKS.values())
    if isinstance(names, str) or not isinstance(names, Iterable):
        raise ArgumentError(f"checks is {names!r}; pass a list of names: {', '.join(CHECKS)}")
    unknown = [name for name in names if name not in CHECKS]
    if unknown:
        near = difflib.get_close_matches(str(unknown[0]), CHECKS, 3)
        hint = f"did you mean {' or '.join(near)}? There are" if near else "there are"
        raise ArgumentError(f"there is no check {', '.join(map(repr, unknown))}; {hint} {', '.join(CHECKS)}")
    return [CHECKS[name] for name in names]


def _in_turn(tasks: Sequence[Task]) -> Generator[Result]:
    """One check after the other. That the motion stops is told by the first one that looks at it."""
    for system, names, short in tasks:
        subject: Any = system
        told = False
        for name in names:
            rows, left_out, subject = _one(subject, name, short)
            yield [row for row in rows if not (told and row.check == USUAL)], left_out, 1
            told = told or any(row.check == USUAL for row in rows)
        if isinstance(subject, Subject) and subject.lacking:
            yield [Row("numbers", subject.name, f"nothing was run: {', '.join(subject.lacking)} without a number", None, None, "",
                       DEGRADE, "give every parameter a number in the system's `defaults`")], [], 0


def _one(system: Any, name: str, short: bool) -> tuple[list[Row], list[str], Any]:
    """Rows of a check, what it leaves out, and the subject for the next one. Whatever a check raises is a row."""
    check, rows = CHECKS[name], []
    label = system if isinstance(system, str) else getattr(system, "name", repr(system))
    try:
        if check.of_system and not isinstance(system, Subject):
            system = Subject(system)
        label = system.name if isinstance(system, Subject) else "-"
        if check.of_system and system.lacking:
            raise NotApplicable(f"{', '.join(system.lacking)} without a number")
        for row in check.run(system, short) if check.of_system else check.run(short):
            rows.append(row)
    except NotApplicable as reason:
        if isinstance(reason, MotionStops):
            rows.append(Row(USUAL, str(label), f"the usual motion stops at t = {reason.t:.9g} s, before {reason.end:g} s: "
                            f"{reason.told}", None, None, "", DEGRADE, "checks that need the whole of it are left out"))
        return rows, [f"{name}, {label}: {reason}"], system
    except Exception as error:
        last = traceback.extract_tb(error.__traceback__)[-1]
        where = f"{Path(last.filename).name}:{last.lineno}"
        rows.append(Row(name, str(label), f"{type(error).__name__} in {where}", None, None,
                        "", FAIL, f"the check itself ended early: {error}"[:400]))
    return rows, [], system


def _whole(task: Task) -> Result:
    """All checks of one task, in a process of its own."""
    rows: list[Row] = []
    left_out: list[str] = []
    for found, reasons, _ in _in_turn([task]):
        rows += found
        left_out += reasons
    return rows, left_out, len(task[1])


def _spread(tasks: Sequence[Task], jobs: int) -> Generator[Result]:
    """Several tasks at a time. Interrupted, the processes end at once, and silently."""
    before = set(multiprocessing.active_children())
    pool = ProcessPoolExecutor(min(jobs, len(tasks)), multiprocessing.get_context("spawn"), _silent)
    try:
        with _held():
            waiting = {pool.submit(_whole, task): task for task in tasks}
        for done in as_completed(waiting):
            system, names, _ = waiting[done]
            try:
                yield done.result()
            except Exception as error:  # the process itself died
                died = Row(", ".join(names), str(system) or "-", "its process", None, None, "", FAIL, f"it died: {error}"[:400])
                yield [died], [], len(names)
    except BaseException:
        for process in set(multiprocessing.active_children()) - before:
            process.terminate()
        raise
    finally:
        pool.shutdown(cancel_futures=True)


@contextlib.contextmanager
def _held() -> Iterator[None]:
    """An interrupt comes after this; processes that are started here have it held, too, until `_silent`."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    mask = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, mask)


def _silent() -> None:
    """In a process of a pool: an interrupt ends it without a word; the one that started it tells what is to be told."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    if hasattr(signal, "pthread_sigmask"):
        signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})


def _bar(total: int) -> Any:
    return progress_bar(total=total, desc="stress", unit="check")
