"""Rows of a stress report: what was done, what came of it, what it should be at most and why."""

from __future__ import annotations

import json
import textwrap
from collections import Counter
from dataclasses import asdict, dataclass, field
from pathlib import Path

import numpy as np

from symdyn.errors import ArgumentError
from symdyn.runtime.paths import as_path

PASS, DEGRADE, FAIL = "pass", "degrade", "fail"
LEGEND = {
    PASS: "the figure is within its bound, or what must happen happens",
    DEGRADE: "the run stops early and names why, or digits are lost where the problem itself or a known limit takes them; the "
             "row says which, and what to do",
    FAIL: "anything else",
}
_WIDTH = 118
# Remark on a mechanism that begins in equilibrium, or has no forces and no speeds.
STILL = "the motion stands still"


class NotApplicable(Exception):
    """A check has nothing to look at here; the message says why."""


class NoUsualMotion(NotApplicable):
    """The usual motion of a mechanism cannot be looked at; done, why: of the row that says it once."""

    def __init__(self, reason: str, done: str, why: str) -> None:
        super().__init__(reason)
        self.done, self.why = done, why


class MotionStops(NoUsualMotion):
    """It stops early; t: when, of its end, s; message: why."""

    def __init__(self, t: float, end: float, message: str) -> None:
        super().__init__(f"the usual motion stops early: {message}",
                         f"the usual motion stops at t = {t:.9g} s, before {end:g} s: "
                         f"{message}", "checks that need the whole of it are left out")
        self.message = message


class StandsStill(NoUsualMotion):
    """Nothing moves until `end`, s, so that energy would be kept, and every end be the same, whatever the code did."""

    def __init__(self, end: float) -> None:
        super().__init__(f"{STILL}; set system.initial to a start from which it moves", f"{STILL}: no coordinate changes within "
                         f"{end:g} s", "checks of a motion are left out, since they would pass whatever the code did; set "
                         "system.initial to a start from which it moves, such as {q: 0.5, q.dot: 1}")


@dataclass(frozen=True)
class Row:
    """One finding.

    check, system   what was looked at; done: what was done, with numbers
    figure, bound   what was measured, and what it may be at most; None where there is no number
    origin          where the bound comes from
    verdict         pass: within the bound; degrade: not, but said so (a named stop, a warning), or less accurate as far as the
                    problem itself is worse; fail: anything else
    why             one sentence
    """

    check: str
    system: str
    done: str
    figure: float | None
    bound: float | None
    origin: str
    verdict: str
    why: str


def within(check: str, system: str, done: str, figure: float, bound: float, origin: str, why: str, beyond: str = "") -> Row:
    """The row of a figure that must be at most a bound; beyond: what it means if it is not."""
    good = bool(figure <= bound)
    return Row(check, system, done, float(figure), float(bound), origin, PASS if good else FAIL,
               why if good else beyond or f"not so: {why}")


@dataclass
class StressReport:
    """All rows; prints as a table. left_out: what did not apply, as "check, system: why"; unfinished: what an interrupted one
    has not done, "" if it is whole."""

    rows: list[Row] = field(default_factory=list)
    left_out: list[str] = field(default_factory=list)
    seconds: float = 0.0
    unfinished: str = ""

    @property
    def passed(self) -> bool:
        """Whether something was looked at, and nothing failed."""
        return bool(self.rows) and all(row.verdict != FAIL for row in self.rows)

    def count(self) -> dict[str, int]:
        """Number of rows of each verdict."""
        result = Counter(row.verdict for row in self.rows)
        return {verdict: result[verdict] for verdict in (PASS, DEGRADE, FAIL)}

    def table(self) -> str:
        """The rows as text, the numbers at the left; below each what was done, where the bound comes from, and why."""
        lines = [HEAD, *[described(row) for row in self.rows]]
        lines += [f"left out: {text}" for text in self.left_out]
        wrapped = textwrap.TextWrapper(_WIDTH, subsequent_indent=" " * 10)
        return "\n".join([*lines, *[wrapped.fill(f"{verdict}: {text}") for verdict, text in LEGEND.items()], self.summary()])

    def summary(self) -> str:
        """One line."""
        counted = ", ".join(f"{n} {verdict}" for verdict, n in self.count().items())
        begun = f"unfinished: {self.unfinished}; " if self.unfinished else ""
        none = "" if self.rows or self.unfinished else "nothing was looked at, which does not count as passed: "
        return f"{none}{begun}{len(self.rows)} rows: {counted}; {len(self.left_out)} left out; {self.seconds:.0f} s"

    def save(self, path: object) -> Path:
        """Write .json (all of it), .txt (the table) or .html (one page); returns the path.

        Raises ArgumentError for another ending.
        """
        file = as_path(path, "where to save the stress report", "stress.json")
        if file.suffix not in (".json", ".txt", ".html"):
            raise ArgumentError(f"cannot save to {file.name}: the ending must be .json, .txt or .html")
        file.parent.mkdir(parents=True, exist_ok=True)
        if file.suffix == ".json":
            text = json.dumps({"seconds": self.seconds, "unfinished": self.unfinished, "count": self.count(),
                               "rows": [_plain(asdict(r)) for r in self.rows], "left_out": self.left_out}, indent=1) + "\n"
        elif file.suffix == ".html":
            from symdyn.stress.page import page

            text = page(self)
        else:
            text = self.table() + "\n"
        file.write_text(text, encoding="utf-8")
        return file

    def __str__(self) -> str:
        return self.table()

    def __repr__(self) -> str:
        return f"<StressReport: {self.summary()}>"


class Interrupted(KeyboardInterrupt):
    """The user stopped it; report: what was finished before."""

    def __init__(self, report: StressReport) -> None:
        super().__init__(f"interrupted; {report.unfinished}")
        self.report = report


HEAD = f"{'verdict':8}{'check':19}{'system':35}{'figure':>10}{'bound':>10}"


def described(row: Row) -> str:
    """A row as text of several lines."""
    head = f"{row.verdict:8}{row.check:19}{row.system:35}{number(row.figure):>10}{number(row.bound):>10}"
    wrapped = textwrap.TextWrapper(_WIDTH, initial_indent=" " * 8, subsequent_indent=" " * 10)
    rest = [row.done, f"bound: {row.origin}" if row.origin else "", *row.why.splitlines()]  # what a compiler says has lines
    return "\n".join([head, *[wrapped.fill(text) for text in rest if text.strip()]])


def number(value: float | None) -> str:
    """Such as 3.2e-15."""
    return "-" if value is None else f"{value:.2g}"


def _plain(row: dict[str, object]) -> dict[str, object]:
    """Numbers that JSON knows."""
    return {key: str(value) if isinstance(value, float) and not np.isfinite(value) else value for key, value in row.items()}
