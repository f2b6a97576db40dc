"""A stress report as one HTML page that needs no network."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import symdyn
from symdyn.named_records import NamedRecords
from symdyn.pages import filled
from symdyn.stress.record import LEGEND, PASS, Row, number

if TYPE_CHECKING:
    from symdyn.stress.record import StressReport


@dataclass(frozen=True)
class Finding:
    """A row of the report, as text; figure, bound: - where there is no number."""

    verdict: str
    check: str
    system: str
    figure: str
    bound: str
    done: str
    origin: str
    why: str


@dataclass(frozen=True)
class OfVerdict:
    """A verdict, its meaning, and the number of its rows."""

    verdict: str
    meaning: str
    n: int


@dataclass(frozen=True)
class Report:
    """The report as a whole; left_out: what did not apply."""

    version: str
    summary: str
    counts: tuple[OfVerdict, ...]
    left_out: tuple[str, ...]


@dataclass(frozen=True)
class Findings:
    """Its rows: pairs of a verdict and its rows of those that did not pass, then of a check and its rows of those that did."""

    listed: tuple[tuple[str, tuple[Finding, ...]], ...]
    passed: tuple[tuple[str, tuple[Finding, ...]], ...]

    @property
    def n_passed(self) -> int:
        """Number of rows that passed."""
        return sum(len(rows) for _, rows in self.passed)


@dataclass(frozen=True)
class StressContext(NamedRecords):
    """The records that the page gets."""

    report: Report
    findings: Findings


def page(report: StressReport) -> str:
    """The text of the page: what failed first, then what degrades, then what passes by check, folded, each in the order of the
    report."""
    count = report.count()
    rows = [finding(row) for row in report.rows]
    seen = [v for v in reversed(count) if v != PASS]
    listed = tuple((verdict, tuple(row for row in rows if row.verdict == verdict)) for verdict in seen)
    passed = [row for row in rows if row.verdict == PASS]
    checks = dict.fromkeys(row.check for row in passed)
    return filled("report/stress.html.jinja", StressContext(
        Report(symdyn.__version__, report.summary(), tuple(OfVerdict(v, text, count[v]) for v, text in LEGEND.items()),
               tuple(report.left_out)),
        Findings(listed, tuple((check, tuple(row for row in passed if row.check == check)) for check in checks))))


def finding(row: Row) -> Finding:
    """A row as text."""
    return Finding(row.verdict, row.check, row.system, number(row.figure), number(row.bound), row.done, row.origin, row.why)
