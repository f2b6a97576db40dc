"""The report of one run as an HTML file that needs no network: pictures are part of it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

import symdyn
from symdyn.errors import ArgumentError
from symdyn.named_records import NamedRecords
from symdyn.pages import filled, write_text
from symdyn.runtime.paths import as_path
from symdyn.runtime.solutions import tables as run_tables

if TYPE_CHECKING:
    from symdyn.pictures.embedded import Embedded
    from symdyn.runtime.solutions.solution import Solution

# Smaller motion, relative to the mechanism, is not seen in a picture.
_SEEN = 1e-3


@dataclass(frozen=True)
class Run:
    """The run as a whole.

    name       of the mechanism; version: of symdyn
    success    whether it reached its end; message: how it ended
    fallback   why it ran on NumPy, "" if it did not have to
    facts      pairs of title and text
    generated  the report of the module, "" if it was loaded from files
    """

    name: str
    version: str
    success: bool
    message: str
    fallback: str
    facts: tuple[tuple[str, str], ...]
    generated: str


@dataclass(frozen=True)
class Given:
    """Parameters of the run, and its start."""

    parameters: tuple[run_tables.ParameterRow, ...]
    start: tuple[run_tables.StartRow, ...]


@dataclass(frozen=True)
class Motion:
    """The motion: pictures of the mechanism, curves over time, extremes."""

    mechanism: tuple[Embedded, ...]
    curves: tuple[Embedded, ...]
    extremes: tuple[run_tables.ExtremesRow, ...]


@dataclass(frozen=True)
class Balance:
    """The balance of energy, as text.

    resets     what resets of events added; of: what the relative difference is measured by
    doubtful   whether that is too large; curves: pictures of the balance over time
    """

    work: str
    resets: str
    change: str
    difference: str
    relative: str
    of: str
    doubtful: bool
    curves: tuple[Embedded, ...]


@dataclass(frozen=True)
class Quality:
    """Laws and limits: how well they are kept.

    energy   none where the balance is not known, for the reason `no_energy`
    """

    energy: Balance | None
    no_energy: str
    constraints: tuple[run_tables.ConstraintRow, ...]
    validity_checks: tuple[run_tables.ValidityRow, ...]


@dataclass(frozen=True)
class RunContext(NamedRecords):
    """The records that the page of a run gets."""

    run: Run
    given: Given
    motion: Motion
    quality: Quality


def write_report(solution: Solution, path: Any) -> Path:
    """Write the report; returns its path, see Solution.report.

    Raises ArgumentError for another ending than .html and where it cannot be written, MissingExtra without matplotlib.
    """
    target = as_path(path, "where to write the report", "run.html")
    if target.suffix.lower() not in (".html", ".htm"):
        raise ArgumentError(f"cannot write the report to {target.name}: the ending must be .html")
    return write_text(target, page(solution), "the report")


def page(solution: Solution) -> str:
    """The text of the report."""
    from symdyn.pictures import embedded

    module = solution.module
    return filled("report/run.html.jinja", RunContext(
        Run(module.name, symdyn.__version__, solution.success, solution.message, module.fallback,
            tuple(run_tables.facts(solution)), _generated(solution)),
        Given(run_tables.parameters(solution), run_tables.start(solution)),
        Motion(embedded.mechanism(solution, _times(solution)), embedded.curves(solution), run_tables.extremes(solution)),
        Quality(_balance(solution), _why_no_energy(solution), run_tables.constraints(solution),
                run_tables.validity_checks(solution))))


def _balance(solution: Solution) -> Balance | None:
    from symdyn.pictures import embedded

    energy = run_tables.energy(solution)
    if energy is None:
        return None
    resets = "".join(f", resets of {name} {run_tables.number(value)} J" for name, value in energy.resets.items())
    of = "its energy: it rests" if energy.rests else "the larger of kinetic energy and range of potential energy"
    return Balance(run_tables.number(energy.work), resets, run_tables.number(energy.change), f"{energy.difference:.3g}",
                   f"{energy.relative:.2g}", of, energy.doubtful, embedded.balance(solution, energy.rows))


def _why_no_energy(solution: Solution) -> str:
    if "energy" not in solution.module.functions:
        return "The equations were given by hand and do not define the energy."
    return "The work of the loads was not integrated along with the motion; simulate with work=True for the balance."


def _times(solution: Solution) -> list[tuple[str, float]]:
    """When the mechanism is shown: at the start, at the end, and where it is farthest from the start."""
    t = solution.t
    if not len(t):
        return []
    result = [("start", float(t[0]))]
    if len(t) > 1:
        centres = solution.rows("positions").reshape(len(t), -1, 3) if "positions" in solution.module.functions else None
        if centres is not None and centres.shape[1] and np.isfinite(centres).all():
            middle = centres.mean(axis=1)
            moved = np.linalg.norm(middle - middle[0], axis=1)
            far = int(moved.argmax())
            if 0 < far < len(t) - 1 and moved[far] > _SEEN * np.ptp(centres, axis=(0, 1)).max():
                result.append(("farthest from the start", float(t[far])))
        result.append(("end", float(t[-1])))
    return result


def _generated(solution: Solution) -> str:
    """Parts generated, parts skipped and why, and operation counts; nothing for a module that was loaded from files."""
    try:
        return str(solution.module.report())
    except ArgumentError:
        return ""
