"""The report of one run as an HTML file that needs no network: pictures are part of it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

import symdyn
from symdyn.errors import ArgumentError
from symdyn.pages import page_environment, write_text
from symdyn.runtime.paths import as_path
from symdyn.runtime.solutions import tables as run_tables

if TYPE_CHECKING:
    from symdyn.runtime.solutions.solution import Solution

# Smaller motion, relative to the mechanism, is not seen in a picture.
_SEEN = 1e-3


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
    energy = run_tables.energy(solution)
    return page_environment().get_template("report/run.html.jinja").render(
        name=module.name, version=symdyn.__version__, success=solution.success, message=solution.message,
        fallback=module.fallback, facts=run_tables.facts(solution), parameters=run_tables.parameters(solution),
        start=run_tables.start(solution), extremes=run_tables.extremes(solution), constraints=run_tables.constraints(solution),
        validity_checks=run_tables.validity_checks(solution), energy=_energy_table(energy), no_energy=_why_no_energy(solution),
        mechanism=embedded.mechanism(solution, _times(solution)), curves=embedded.curves(solution),
        balance=None if energy is None else embedded.balance(solution, energy.rows), generated=_generated(solution))


def _energy_table(energy: run_tables.Energy | None) -> dict[str, Any] | None:
    if energy is None:
        return None
    resets = "".join(f", resets of {name} {run_tables.number(value)} J" for name, value in energy.resets.items())
    return {"work": run_tables.number(energy.work), "resets": resets, "change": run_tables.number(energy.change),
            "difference": f"{energy.difference:.3g}", "relative": f"{energy.relative:.2g}", "doubtful": energy.doubtful,
            "of": "its energy: it rests" if energy.rests else "the larger of kinetic energy and range of potential energy"}


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
