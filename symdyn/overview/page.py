"""The whole report of a mechanism as one page that needs no network: equations, what they cost, how well they are determined
along a motion, work against error, stress.

A part that cannot be made becomes a paragraph that reports it; the page is written all the same.
"""

from __future__ import annotations

import math
import time as clock
import traceback
import warnings
from collections.abc import Callable
from dataclasses import dataclass, field
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
from symdyn.pages import page_environment, write_text
from symdyn.runtime.paths import as_path
from symdyn.runtime.solutions.tables import facts
from symdyn.shown import shown
from symdyn.stress.flow import stands_still
from symdyn.stress.record import number
from symdyn.stress.run import stress
from symdyn.stress.system_under_test import SystemUnderTest, named

if TYPE_CHECKING:
    from symdyn.given import PathName
    from symdyn.report.text import Report

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


@dataclass
class Part:
    """A part of the page: what it shows, or why there is nothing; notes: what is missing in it."""

    title: str
    shown: dict[str, Any] = field(default_factory=dict)
    failed: str = ""
    notes: list[str] = field(default_factory=list)
    seconds: float = 0.0


def page(equations: Equations, system: Any, formulation: str, budget: float, verify: bool, log: Log) -> str:
    """The text of the page.

    system        what sd.bench takes; formulation: the equations' as it names them, empty where it takes equations
    """
    tested = SystemUnderTest(equations)
    makers: dict[str, tuple[str, Callable[[Part], None]]] = {
        "equations": ("Equations of motion", lambda part: _show_equations(part, equations)),
        "generated": ("Generated code", lambda part: _show_generated(part, equations)),
        "condition": ("Condition along the motion", lambda part: _show_condition(part, tested)),
        "work": ("Work against error", lambda part: _show_work(part, system, formulation, budget, log)),
        "stress": ("Stability under stress", lambda part: _show_stress(part, tested))}
    if verify:
        makers["proof"] = ("Proof by identities", lambda part: part.shown.update(result=equations.verify()))
    parts = {key: _made(title, make, log) for key, (title, make) in makers.items()}
    environment = page_environment()
    environment.filters["number"] = number
    return environment.get_template("report/full.html.jinja").render(
        name=equations.name, version=symdyn.__version__, formulation=equations.formulation, frames=equations.frames, parts=parts,
        budget=f"{budget:g}")


def _made(title: str, make: Callable[[Part], None], log: Log) -> Part:
    """A part; whatever goes wrong in making it is reported in it."""
    part, begun = Part(title), clock.perf_counter()
    log(title[0].lower() + title[1:])
    try:
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            make(part)
        part.notes += list(dict.fromkeys(f"Warning: {w.message}" for w in caught if issubclass(w.category, WARNINGS)))[:MOST]
    except (SymdynError, ImportError, OSError) as error:
        part.failed = str(error)
    except Exception as error:  # of one part; the others must not be lost with it
        last = traceback.extract_tb(error.__traceback__)[-1]
        part.failed = f"{type(error).__name__} in {Path(last.filename).name}:{last.lineno}: {error}"
    if part.failed:
        log(f"{title[0].lower() + title[1:]}: not made: {part.failed}")
    part.seconds = clock.perf_counter() - begun
    return part


def _noted(part: Part, make: Callable[[], Any], missing: Any) -> Any:
    """Content that may be left out of a part, with a note."""
    try:
        return make()
    except MissingExtra as error:
        if str(error) not in part.notes:
            part.notes.append(str(error))
        return missing


def _show_equations(part: Part, equations: Equations) -> None:
    _noted(part, lambda: full_equations.mathml("x"), "")
    part.shown = {"form": full_equations.typesetter()(full_equations.form(equations)),
                  "symbols": full_equations.symbols(equations), "quantities": full_equations.quantities(equations),
                  "constraints": equations.constraints}


def _show_generated(part: Part, equations: Equations) -> None:
    module = equations.compile()
    report: Report = module.report()
    part.shown = {"report": report, "candidates": report.candidates, "backend": report.backend, "fallback": report.fallback}


def _show_condition(part: Part, tested: SystemUnderTest) -> None:
    result = full_condition.along(tested)
    if len(result.solution.t) and stands_still(tested, result.solution.x):
        part.notes.append(STILL)
    part.shown = {"found": result, "curves": [_range(label, values) for label, values in result.curves.items()],
                  "states": len(result.t), "end": f"{result.solution.t[-1]:g}" if len(result.solution.t) else "0",
                  "facts": facts(result.solution),
                  "picture": _noted(part, lambda: full_condition.picture(result), "") if result.curves else "",
                  "mechanism": _noted(part, lambda: full_pictures.mechanism(result.solution), [])}


def _range(label: str, values: Any) -> dict[str, str]:
    finite = [float(v) for v in values if math.isfinite(v)]
    return {"label": label, "least": f"{min(finite, default=math.nan):.3g}",
            "most": f"{max(finite, default=math.nan):.3g}",
            "lost": str(len(values) - len(finite)) if len(values) > len(finite) else ""}


def _show_work(part: Part, system: Any, formulation: str, budget: float, log: Log) -> None:
    benchmarks = full_work.measure(system, formulation, budget, log)
    part.notes += dict.fromkeys(f"{note[0].upper()}{note[1:]}." for benchmark in benchmarks for note in benchmark.notes)
    part.shown = full_work.shown(benchmarks)
    if part.shown["note"]:
        part.notes.append(part.shown["note"])


def _show_stress(part: Part, tested: SystemUnderTest) -> None:
    tested.module.parameters()  # without numbers no check could begin
    report = stress(tested, short=True)
    order = {"fail": 0, "degrade": 1, "pass": 2}
    part.shown = {"rows": sorted(report.rows, key=lambda row: order[row.verdict]), "left_out": report.left_out,
                  "summary": report.summary(), "passed": report.passed}
