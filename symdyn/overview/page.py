"""The whole report of a mechanism as one page that needs no network: equations, what they cost, how well they are determined
along a motion, work against error, stress.

A part that cannot be made becomes a paragraph that reports it; the page is written all the same.
"""

from __future__ import annotations

import math
import traceback
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import symdyn
from symdyn.choice import formulated
from symdyn.errors import ArgumentError, EvaluationWarning, MissingExtra, ModelWarning, SimulationWarning, SymdynError
from symdyn.formulation.equations import Equations
from symdyn.model.system import System
from symdyn.overview import condition as full_condition
from symdyn.overview import equations as full_equations
from symdyn.overview import pictures as full_pictures
from symdyn.overview import work as full_work
from symdyn.overview.context import (
    FullContext,
    FunctionRow,
    IdentityRow,
    Mechanism,
    OfCode,
    OfCondition,
    OfEquations,
    OfProof,
    OfStress,
    OfWork,
    Part,
    Parts,
    RangeRow,
    Shown,
)
from symdyn.pages import filled, write_text
from symdyn.runtime.paths import as_path
from symdyn.runtime.solutions.tables import facts
from symdyn.shown import shown
from symdyn.stress.flow import stands_still
from symdyn.stress.page import finding
from symdyn.stress.run import stress
from symdyn.stress.system_under_test import SystemUnderTest, named

if TYPE_CHECKING:
    from symdyn.given import PathName
    from symdyn.report.text import Report, Row

BUDGET = 20.0
# Warnings of parts are reported in them, so many of each.
WARNINGS, MOST = (SimulationWarning, EvaluationWarning, ModelWarning), 3
STILL = ("The motion stands still, so that there is one state only to look at; set system.initial to a start from which it "
         "moves, such as {q: 0.5, q.dot: 1}.")
Log = Callable[[str], None]


def full_report(system: System | Equations, path: PathName, budget: float = BUDGET, formulation: str = "auto",
                coordinates: str = "relative", tune: bool = False, verify: bool = True, log: Log = lambda text: None) -> Path:
    """Write everything about a mechanism into one HTML file that works offline; returns its path.

    system        a System, equations such as those of sd.embedding, or a name that sd.bench takes
    budget        s that work against error may take; the rest takes about half a minute more
    formulation   "auto", "embedding", "recursive" or "augmented"; coordinates of the augmented one, and tune, as in
                  System.equations; of equations that are given these do not count
    verify        whether to prove the equations by identities
    log          called with one line at each stage
    Raises ArgumentError for an ending other than .html, a path that cannot be written, a budget that is no positive number and
    anything that is no mechanism; ModelError for one that has faults.

    >>> import tempfile
    >>> system = sd.systems.pendulum()
    >>> sd.full_report(system, f"{tempfile.mkdtemp()}/pendulum.html", verify=False).name  # doctest: +SKIP
    'pendulum.html'
    """
    target = _target(path)
    if isinstance(budget, bool) or not isinstance(budget, (int, float)) or not 0 < budget < math.inf:
        raise ArgumentError(f"the budget {shown(budget)} must be a positive number of seconds")
    log("equations")
    equations = _equations(system, formulation, coordinates, tune)
    given = isinstance(system, Equations)
    name = "" if given else "absolute" if coordinates == "absolute" else equations.formulation
    text = page(equations, system, name, budget, verify, log)
    return write_text(target, text, "the report")


def _target(path: Any) -> Path:
    """Where the page goes; tried before all the work."""
    target = as_path(path, "where to write the report", "report.html")
    if target.suffix.lower() not in (".html", ".htm"):
        raise ArgumentError(f"cannot write the report to {target.name}: the ending must be .html")
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        new = not target.exists()
        target.open("a", encoding="utf-8").close()
        if new:
            target.unlink()
    except OSError as error:
        raise ArgumentError(f"the report cannot be written to {target}: {error.strerror}") from None
    return target


def _equations(system: Any, formulation: str, coordinates: str, tune: bool) -> Equations:
    if isinstance(system, Equations):
        return system
    if isinstance(system, str):
        system = named(system)
    if not isinstance(system, System):
        raise ArgumentError(f"the report takes a System, equations or a name of the catalogue, found {shown(system)}")
    return formulated(system, formulation, tune, coordinates)


def page(equations: Equations, system: Any, formulation: str, budget: float, verify: bool, log: Log) -> str:
    """The text of the page.

    system        what sd.bench takes; formulation: the equations' as it names them, empty where it takes equations
    """
    tested = SystemUnderTest(equations)
    parts = Parts(
        _made("Equations of motion", lambda notes: _equations_shown(equations, notes), log),
        _made("Generated code", lambda notes: _code(equations), log),
        _made("Condition along the motion", lambda notes: _condition(tested, notes), log),
        _made("Work against error", lambda notes: _work(system, formulation, budget, log, notes), log),
        _made("Stability under stress", lambda notes: _stress(tested), log),
        _made("Proof by identities", lambda notes: _proof(equations), log) if verify else None)
    mechanism = Mechanism(equations.name, equations.formulation, symdyn.__version__, f"{budget:g}")
    return filled("report/full.html.jinja", FullContext(mechanism, parts))


def _made(title: str, make: Callable[[list[str]], Shown], log: Log) -> Part[Shown]:
    """A part, in which failures of making it are reported; make: gives what it shows, with a list that takes notes."""
    stage, failed, made = title[0].lower() + title[1:], "", None
    notes: list[str] = []
    log(stage)
    try:
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            made = make(notes)
        notes += list(dict.fromkeys(f"Warning: {w.message}" for w in caught if issubclass(w.category, WARNINGS)))[:MOST]
    except (SymdynError, ImportError, OSError) as error:
        failed = str(error)
    except Exception as error:  # of one part; the others must not be lost with it
        last = traceback.extract_tb(error.__traceback__)[-1]
        failed = f"{type(error).__name__} in {Path(last.filename).name}:{last.lineno}: {error}"
    if failed:
        log(f"{stage}: not made: {failed}")
    return Part(title, made, failed, tuple(notes))


def _noted(notes: list[str], make: Callable[[], Any], missing: Any) -> Any:
    """Content that may be left out of a part, with a note."""
    try:
        return make()
    except MissingExtra as error:
        if str(error) not in notes:
            notes.append(str(error))
        return missing


def _equations_shown(equations: Equations, notes: list[str]) -> OfEquations:
    _noted(notes, lambda: full_equations.mathml("x"), "")
    return OfEquations(full_equations.typesetter()(full_equations.form(equations)), full_equations.symbols(equations),
                       full_equations.quantities(equations), tuple(equations.constraints))


def _code(equations: Equations) -> OfCode:
    report: Report = equations.compile().report()
    return OfCode(report.backend, report.fallback, tuple((what, n) for what, n in report.sizes.items() if n),
                  tuple(_function(row) for row in report.rows), report.candidates, report.skipped, report.many)


def _function(row: Row) -> FunctionRow:
    add, multiply, divide, sin_cos = (row.operations.get(kind, 0) for kind in ("add", "mul", "div", "trig"))
    return FunctionRow(row.function, row.total, add, multiply, divide, sin_cos, row.total - add - multiply - divide - sin_cos,
                       row.prologue, row.chain)


def _condition(tested: SystemUnderTest, notes: list[str]) -> OfCondition:
    result = full_condition.along(tested)
    times = result.solution.t
    if len(times) and stands_still(tested, result.solution.x):
        notes.append(STILL)
    picture = _noted(notes, lambda: full_condition.picture(result), "") if result.curves else ""
    mechanism = _noted(notes, lambda: full_pictures.mechanism(result.solution), ())
    return OfCondition(len(result.t), f"{times[-1]:g}" if len(times) else "0", result.near, result.warnings, result.passages,
                       tuple(_range(label, values) for label, values in result.curves.items()), picture, mechanism,
                       tuple(facts(result.solution)))


def _range(label: str, values: Any) -> RangeRow:
    finite = [float(v) for v in values if math.isfinite(v)]
    return RangeRow(label, f"{min(finite, default=math.nan):.3g}", f"{max(finite, default=math.nan):.3g}",
                    str(len(values) - len(finite)) if len(values) > len(finite) else "")


def _work(system: Any, formulation: str, budget: float, log: Log, notes: list[str]) -> OfWork:
    benchmarks = full_work.measure(system, formulation, budget, log)
    notes += dict.fromkeys(f"{note[0].upper()}{note[1:]}." for benchmark in benchmarks for note in benchmark.notes)
    return full_work.shown(benchmarks, notes)


def _stress(tested: SystemUnderTest) -> OfStress:
    tested.module.parameters()  # without numbers no check could begin
    report = stress(tested, short=True)
    order = {"fail": 0, "degrade": 1, "pass": 2}
    return OfStress(tuple(finding(row) for row in sorted(report.rows, key=lambda row: order[row.verdict])),
                    tuple(report.left_out), report.summary(), report.passed)


def _proof(equations: Equations) -> OfProof:
    result = equations.verify()
    verdicts = {True: "pass", False: "fail", None: "–"}
    return OfProof(result.passed, result.states, result.note, tuple(
        IdentityRow(verdicts[check.passed], check.name, "–" if check.residual is None else f"{check.residual:.1e}",
                    f"{check.tolerance:.0e}", check.remark) for check in result.checks))
