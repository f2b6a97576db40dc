"""A stress report as one HTML page that needs no network."""

from __future__ import annotations

from typing import TYPE_CHECKING

import symdyn
from symdyn.folders import templates_folder
from symdyn.stress.record import number

if TYPE_CHECKING:
    from symdyn.stress.record import StressReport


def page(report: StressReport) -> str:
    """The text of the page: what failed first, then what degrades, then the rest, in the order of the report."""
    import jinja2

    environment = jinja2.Environment(loader=jinja2.FileSystemLoader(templates_folder()), undefined=jinja2.StrictUndefined,
                                     trim_blocks=True, lstrip_blocks=True, keep_trailing_newline=True, autoescape=True)
    environment.filters["number"] = number
    rows = [row for verdict in report.count() for row in report.rows if row.verdict == verdict]
    ordered = [row for verdict in reversed(report.count()) for row in rows if row.verdict == verdict]
    return environment.get_template("report/stress.html.jinja").render(
        version=symdyn.__version__, summary=report.summary(), rows=ordered, left_out=report.left_out)
