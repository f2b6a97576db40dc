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
from symdyn.stress import attitude, chains, extremes, long_runs, motion, rounding, singular, touching, units
from symdyn.stress.record import DEGRADE, FAIL, Interrupted, NotApplicable, NoUsualMotion, Row, StressReport
from symdyn.stress.start import start
from symdyn.stress.system_under_test import SystemUnderTest, named
from symdyn.systems import names as catalogue

# In the short form, where the whole catalogue would take too long.
SHORT = ("cart_pole", "pendulum_absolute")
# The check of a row that says why a motion was not looked at.
USUAL = "usual motion"


@dataclass(frozen=True)
class Check:
    """One check, or a family: run(tested, short) of any mechanism, or run(short) with mechanisms of its own.

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
    Check("long_chains", chains.long_chains, short=False), Check("contacts", touching.contacts, short=False),
)}


def stress(system: Any = None, short: bool = False, checks: str | Sequence[str] | None = None, progress: bool = False,
           jobs: int = 1, show: Callable[[Row], None] | None = None) -> StressReport:
    """Put a mechanism, or symdyn itself with its catalogue, under stress.

    system     a System, Equations or a name that sd.bench takes, such as "four_bar" or "n_link_pendulum(3)", or a list of these;
               None: the catalogue, and the checks that have mechanisms of their own
    short      fewer states, systems and ratios, shorter runs, rounding of C code at -O0 only, and of checks that are not named
               those that need no long time: less than half a minute
    checks     name or names of CHECKS; default: all that apply
    progress   show a bar (needs tqdm); jobs: processes, for names and checks of their own
    show       called with every row as soon as it is there

    Motions begin in the system's initial state, moved onto its constraints, and last for its duration.
    Returns a StressReport; `passed` is False if a row failed, or there is none. A check that crashes is such a row, and so is a
    mechanism that cannot be compiled or evaluated at its start.
    Raises ArgumentError for an unknown check or name, something that is no mechanism and parameters without numbers, ModelError
    for a description with faults; Interrupted, a KeyboardInterrupt with the report of what is finished.

    >>> report = sd.stress(sd.systems.pendulum(), short=True, checks="units")
    >>> report.passed
    True
    """
    if isinstance(jobs, bool) or not isinstance(jobs, Integral) or jobs < 1:
        raise ArgumentError(f"jobs is {jobs!r}; pass a number of processes, 1 or more")
    chosen = _chosen(checks)
    if checks is None:  # those that are named are run wherever they can be
        chosen = [check for check in chosen if (check.short or not short) and (check.of_system or system is None)]
    tasks = _tasks(system, short, chosen)
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
    """Tasks to run: a system ("" for none) with names of checks."""
    own = tuple(c.name for c in chosen if not c.of_system)
    of_system = tuple(c.name for c in chosen if c.of_system)
    if system is not None:
        listed = list(system) if isinstance(system, (list, tuple)) else [system]
        if not listed:
            raise ArgumentError("stress was given no system; pass some, or leave out the argument for the catalogue")
        if own:
            raise ArgumentError(f"the checks {', '.join(own)} have mechanisms of their own; leave out the system")
        return [(_tested(one), of_system, short) for one in listed]
    listed = list(SHORT if short else catalogue())
    return [*[("", (name,), short) for name in own], *[(name, of_system, short) for name in listed if of_system]]


def _tested(system: Any) -> str | SystemUnderTest:
    """A name, which a process can take, or the system under test; its faults are reported before anything is run."""
    if isinstance(system, str):
        named(system)
        return system
    if not isinstance(system, (System, Equations, SystemUnderTest)):
        raise ArgumentError(f"stress was given {system!r}; pass a System, Equations, or the name of one of the catalogue")
    result = system if isinstance(system, SystemUnderTest) else SystemUnderTest(system)
    result.demand_numbers()
    return result


def _chosen(names: str | Sequence[str] | None) -> list[Check]:
    if names is None:
        return list(CHECKS.values())
    if isinstance(names, str):
        names = [names]
    if not isinstance(names, Iterable) or not (names := list(names)):
        raise ArgumentError(f"checks is {names!r}; pass names of checks, or leave it out for all: {', '.join(CHECKS)}")
    unknown = [name for name in names if name not in CHECKS]
    if unknown:
        near = difflib.get_close_matches(str(unknown[0]), CHECKS, 3)
        hint = f"did you mean {' or '.join(near)}? There are" if near else "there are"
        raise ArgumentError(f"there is no check {', '.join(map(repr, unknown))}; {hint} {', '.join(CHECKS)}")
    return [CHECKS[name] for name in names]


def _in_turn(tasks: Sequence[Task]) -> Generator[Result]:
    """One check after the other, of a mechanism after its start. Faults of its usual motion are reported by the first check that
    looks at it."""
    for system, names, short in tasks:
        tested = None
        if system != "":
            tested = SystemUnderTest(system) if isinstance(system, str) else system
            begun = list(start(tested))
            fit = all(row.verdict != FAIL for row in begun)
            yield begun, [] if fit else [f"{', '.join(names)}, {tested.name}: it cannot be run"], 0 if fit else len(names)
            if not fit:
                continue
        reported = False
        for name in names:
            rows, left_out = _one(tested, name, short)
            yield [row for row in rows if not (reported and row.check == USUAL)], left_out, 1
            reported = reported or any(row.check == USUAL for row in rows)


def _one(tested: SystemUnderTest | None, name: str, short: bool) -> tuple[list[Row], list[str]]:
    """Rows of a check, and what it leaves out. An error that a check raises is a row."""
    check, rows, label = CHECKS[name], [], "-" if tested is None else tested.name
    try:
        for row in check.run(short) if tested is None else check.run(tested, short):
            rows.append(row)
    except NotApplicable as reason:
        if isinstance(reason, NoUsualMotion):
            rows.append(Row(USUAL, label, reason.done, None, None, "", DEGRADE, reason.why))
        return rows, [f"{name}, {label}: {reason}"]
    except Exception as error:
        last = traceback.extract_tb(error.__traceback__)[-1]
        where = f"{Path(last.filename).name}:{last.lineno}"
        rows.append(Row(name, label, f"{type(error).__name__} in {where}", None, None,
                        "", FAIL, f"the check itself ended early: {error}"))
    return rows, []


def _whole(task: Task) -> Result:
    """All checks of one task, in a process of its own."""
    rows: list[Row] = []
    left_out: list[str] = []
    for result, reasons, _ in _in_turn([task]):
        rows += result
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
                died = Row(", ".join(names), str(system) or "-", "its process", None, None, "", FAIL, f"it died: {error}")
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
    """In a process of a pool: an interrupt ends it without a word; the one that started it reports."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    if hasattr(signal, "pthread_sigmask"):
        signal.pthread_sigmask(signal.SIG_UNBLOCK, {signal.SIGINT})


def _bar(total: int) -> Any:
    return progress_bar(total=total, desc="stress", unit="check")
