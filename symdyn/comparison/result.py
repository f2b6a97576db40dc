"""The comparison of a case, and of many: counts of verdicts and tables as text."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import sympy as sp

from symdyn.comparison.case import Remark, Slide
from symdyn.comparison.verdict import EntryResult, ErratumResult, FormulaResult, Verdict
from symdyn.counting import counted

COLUMNS = {Verdict.EQUAL: "equal", Verdict.CONVENTION: "convention", Verdict.WRONG: "wrong", Verdict.UNREADABLE: "unreadable",
           Verdict.DIFFERENT: "different", Verdict.UNDECIDED: "not decided"}
# Verdicts that a proof or a refutation may stand behind.
PROVABLE = (Verdict.EQUAL, Verdict.CONVENTION, Verdict.WRONG, Verdict.DIFFERENT)


@dataclass(frozen=True, repr=False)
class Comparison:
    """A case compared with what symdyn derives: `formulas` with entries, `counts` of verdicts, `remarks`; prints as a table."""

    name: str
    title: str
    slide: Slide | None
    formulas: tuple[FormulaResult, ...]
    seconds: float = 0.0
    remarks: tuple[Remark, ...] = ()

    @property
    def counts(self) -> Counter[Verdict]:
        """Verdict -> number of entries."""
        return sum((f.counts for f in self.formulas), Counter())

    @property
    def errata(self) -> list[tuple[FormulaResult, ErratumResult]]:
        """The errors that are proven, with the formulas they are in."""
        return [(f, e) for f in self.formulas for e in f.errata if e.evidence.holds]

    @property
    def proved(self) -> int:
        """Number of entries whose equality is proved by algebra, or refuted at a state."""
        return sum(e.proved for f in self.formulas for e in f.entries if e.verdict in PROVABLE)

    @property
    def sampled(self) -> list[tuple[FormulaResult, EntryResult]]:
        """Entries that are decided by random points alone, with the formulas they are in; `how` of each says why."""
        return [(f, e) for f in self.formulas for e in f.entries if e.verdict in PROVABLE and not e.proved]

    @property
    def decided(self) -> bool:
        """Whether every entry has a verdict that stands: none different without proof, none undecided."""
        return not self.counts[Verdict.DIFFERENT] and not self.counts[Verdict.UNDECIDED]

    def __str__(self) -> str:
        head = " ".join(part for part in (self.name, f"({self.title})" if self.title else "") if part)
        width = max(len(f.name) for f in self.formulas)
        lines = [head]
        for f in self.formulas:
            line = f"{f.slide.line:>6}  " if f.slide.line is not None else ""
            lines.append(f"  {f.name:{width}}  {line}{_counted(f.entries)}{', on the named states' if f.where else ''}")
            lines += [f"    {text}" for text in _remarks(f)]
        lines += [f"  {'' if r.line is None else f'line {r.line}: '}{r.why}" for r in self.remarks]
        lines.append(f"  {_entries(self.counts)}: {_counted(e for f in self.formulas for e in f.entries)}")
        return "\n".join(lines)

    def __repr__(self) -> str:
        return str(self)

    def write(self, folder: str | Path) -> list[Path]:
        """Write the reports on this case alone into a folder; see Comparisons.write."""
        return Comparisons((self,), self.seconds).write(folder)

    def _repr_html_(self) -> str:
        from symdyn.comparison.html import comparison_html

        return comparison_html(self)


@dataclass(frozen=True, repr=False)
class Comparisons:
    """Many cases; prints as one table, a line for each case."""

    cases: tuple[Comparison, ...]
    seconds: float = 0.0

    @property
    def counts(self) -> Counter[Verdict]:
        """Verdict -> number of entries."""
        return sum((c.counts for c in self.cases), Counter())

    @property
    def proved(self) -> int:
        """Number of entries whose equality is proved by algebra, or refuted at a state."""
        return sum(c.proved for c in self.cases)

    @property
    def decided(self) -> bool:
        """Whether every entry has a verdict that stands."""
        return all(c.decided for c in self.cases)

    def write(self, folder: str | Path) -> list[Path]:
        """Write the reports into a folder: a page, a LaTeX document, the errata as a page and as text; returns their paths.

        Raises ArgumentError if the folder cannot be made, MissingExtra without latex2mathml.
        """
        from symdyn.comparison.reports import write_reports

        return write_reports(self, Path(folder))

    def rows(self) -> list[tuple[str, ...]]:
        """The table: a head, then case, section, formulas, number of entries of each verdict and of those proved."""
        head = ("case", "section", "formulas", *COLUMNS.values(), "proved")
        return [head, *((c.name, c.slide.section if c.slide else "", str(len(c.formulas)), *(str(c.counts[v]) for v in COLUMNS),
                         str(c.proved)) for c in self.cases)]

    def __iter__(self) -> Iterator[Comparison]:
        return iter(self.cases)

    def __len__(self) -> int:
        return len(self.cases)

    def __str__(self) -> str:
        head, *rows = self.rows()
        formulas = sum(len(c.formulas) for c in self.cases)
        rows = [tuple("." if text == "0" else text for text in row) for row in rows]
        rows.append(("all", "", str(formulas), *(str(self.counts[v]) for v in COLUMNS), str(self.proved)))
        width = max(len(row[0]) for row in rows)
        lines = [f"{row[0]:{width}}{row[1]:>8}{row[2]:>9}" + "".join(f"{text:>12}" for text in row[3:]) for row in (head, *rows)]
        slips = {e.slip for c in self.cases for _, e in c.errata}
        errors = sum(len(c.errata) for c in self.cases)
        lines.append(f"{counted(len(self.cases), 'case', 'cases')}, {_entries(self.counts)} in {self.seconds:.0f} s; "
                     f"{counted(len(slips), 'slip', 'slips')} in {counted(errors, 'formula', 'formulas')}")
        decided = sum(self.counts[v] for v in PROVABLE)
        all_decided = counted(decided, "decided entry is", "decided entries are")
        lines.append(f"{self.proved} of {all_decided} proved equal, or refuted at a state"
                     + ("; sampled:" if self.proved < decided else ""))
        lines += [f"  {c.name}, {f.name}: {_place(e.index)}{e.how}" for c in self.cases for f, e in c.sampled]
        return "\n".join(lines)

    def __repr__(self) -> str:
        return str(self)

    def _repr_html_(self) -> str:
        from symdyn.comparison.html import table_html

        return table_html(self)


def _remarks(formula: FormulaResult) -> list[str]:
    lines = [f"wrong: {e.why} Shown by: {e.evidence}" for e in formula.errata if e.evidence.holds]
    said: dict[str, None] = {}
    for entry in formula.entries:
        if entry.verdict is Verdict.WRONG:
            whole = entry.printed is None  # of another shape than the right form
            printed, right = (formula.printed, formula.derived) if whole else (entry.printed, entry.right)
            lines.append(f"  {_place(entry.index)}printed {_text(printed)}, right {_text(right)}")
        elif entry.verdict is Verdict.DIFFERENT:
            where = ", ".join(f"{name} = {value:.3g}" for name, value in (entry.point or {}).items())
            there = "" if entry.values is None else \
                f"; refuted at this state: printed {entry.values[0]:.6g}, derived {entry.values[1]:.6g} at {where}"
            lines.append(f"  {_place(entry.index)}{entry.verdict.value}{there}{'; ' + entry.note if entry.note else ''}")
        elif entry.note:
            said[entry.note] = None
    return lines + [f"  {note}" for note in said]


def _place(index: tuple[int, ...]) -> str:
    return f"[{', '.join(map(str, index))}] " if index else ""


def _text(value: Any) -> str:
    if isinstance(value, tuple):
        return " = ".join(map(_text, value))
    return str(value.tolist()) if isinstance(value, sp.MatrixBase) else str(value)


def _entries(counts: Counter[Verdict]) -> str:
    return counted(sum(counts.values()), "entry", "entries")


def worded(entries: Iterable[EntryResult]) -> list[tuple[Verdict, str]]:
    """Each verdict with its number in words, and whether it is proved or sampled: (Verdict.EQUAL, "12 equal, proved")."""
    counts = Counter((e.verdict, _certainty(e)) for e in entries)
    return [(verdict, f"{counts[verdict, certainty]} {verdict.value}{certainty}")
            for verdict in Verdict for certainty in CERTAINTIES if counts[verdict, certainty]]


CERTAINTIES = ("", ", proved", ", sampled")


def _certainty(entry: EntryResult) -> str:
    return CERTAINTIES[1 if entry.proved else 2] if entry.verdict in (Verdict.EQUAL, Verdict.CONVENTION) else ""


def _counted(entries: Iterable[EntryResult]) -> str:
    return "; ".join(words for _, words in worded(entries))
