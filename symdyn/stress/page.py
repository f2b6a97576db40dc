"""A stress report as one HTML page that needs no network."""

from __future__ import annotations

from typing import TYPE_CHECKING

import symdyn
from symdyn.pages import page_environment
from symdyn.stress.record import LEGEND, PASS, number

if TYPE_CHECKING:
    from symdyn.stress.record import StressReport


def page(report: StressReport) -> str:
    """The text of the page: what failed first, then what degrades, then what passes by check, folded, each in the order of the
    report."""
    environment = page_environment()
    environment.filters["number"] = number
    seen = [v for v in reversed(report.count()) if v != PASS]
    listed = {verdict: [row for row in report.rows if row.verdict == verdict] for verdict in seen}
    passed = {check: [row for row in report.rows if row.verdict == PASS and row.check == check]
              for check in dict.fromkeys(row.check for row in report.rows if row.verdict == PASS)}
    return environment.get_template("report/stress.html.jinja").render(
        version=symdyn.__version__, summary=report.summary(), legend=LEGEND, count=report.count(), listed=listed, passed=passed,
        left_out=report.left_out)
