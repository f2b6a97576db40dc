"""A stress report as one HTML page that needs no network."""

from __future__ import annotations

from typing import TYPE_CHECKING

import symdyn
from symdyn.pages import page_environment
from symdyn.stress.record import number

if TYPE_CHECKING:
    from symdyn.stress.record import StressReport


def page(report: StressReport) -> str:
    """The text of the page: what failed first, then what degrades, then the rest, in the order of the report."""
    environment = page_environment()
    environment.filters["number"] = number
    ordered = [row for verdict in reversed(report.count()) for row in report.rows if row.verdict == verdict]
    return environment.get_template("report/stress.html.jinja").render(
        version=symdyn.__version__, summary=report.summary(), rows=ordered, left_out=report.left_out)
