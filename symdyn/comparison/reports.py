"""Reports of many comparisons: a page (HTML), a document (LaTeX), and the errata as a page and as text."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import jinja2

from symdyn.backend.source import template_folders
from symdyn.comparison.case import Remark
from symdyn.comparison.result import COLUMNS, PROVABLE, Comparison, Comparisons, counted, worded
from symdyn.comparison.typeset import (
    SHOWN,
    Lines,
    Places,
    corrections,
    formula_latex,
    marked,
    mathml,
    place,
    where_latex,
    where_lines,
    width,
)
from symdyn.comparison.verdict import FormulaResult, Verdict
from symdyn.errors import ArgumentError
from symdyn.named_records import NamedRecords
from symdyn.report.latex import letters

FILES = ("comparison.html", "comparison.tex", "errata.html", "errata.md")
# Explanation of the first column on the pages.
PRINTED = ("\u201cPrinted\u201d is what the transcription of the slides as text holds, with what it may have lost or changed. "
           "Visibly lost text is unreadable, and no error of a slide.")
# Letters in a line of a column, and of a page.
COLUMN, PAGE = 50, 106
# The same of the list of errata.
ERRATA_COLUMN, ERRATA_PAGE = 30, 90


@dataclass(frozen=True)
class OfVerdict:
    """Number of entries of a verdict, which is a class of the page's style and a text."""

    verdict: str
    text: str
    n: int


@dataclass(frozen=True)
class Summary:
    """All comparisons together.

    counts     of entries by verdict; total: of these; proved of the `decided`
    n_errata   formulas that are wrong as printed; n_slips: how many slips these have
    printed    explanation of the first column
    """

    counts: tuple[OfVerdict, ...]
    total: int
    proved: int
    decided: int
    n_errata: int
    n_slips: int
    printed: str


@dataclass(frozen=True)
class FormulaShown:
    """A formula, texts and lines that are typeset; wide: too wide for columns."""

    name: str
    slide: str
    also: str
    wide: bool
    verdict: str
    summary: str
    printed: tuple[Any, ...]
    derived: tuple[Any, ...]
    where: tuple[Any, ...]
    notes: tuple[str, ...]
    ways: str
    proofs: tuple[str, ...]


@dataclass(frozen=True)
class CaseShown:
    """A case, with the numbers of its entries by verdict and its formulas."""

    name: str
    title: str
    section: str
    counts: tuple[OfVerdict, ...]
    formulas: tuple[FormulaShown, ...]


@dataclass(frozen=True)
class CorrectionShown:
    """A place that is wrong, as printed and right: lines that are typeset (HTML), or LaTeX."""

    place: str
    printed: Any
    right: Any


@dataclass(frozen=True)
class ErratumShown:
    """A formula that is wrong as printed, as text.

    latex     its letters, typeset or as they are; line: of the slides' text, if known; also: further lines
    kind      of the evidence, with its sentence and the residuals of the print and the right formula
    more      how many entries are left out
    """

    case: str
    formula: str
    latex: Any
    slide: str
    why: str
    slip: str
    line: int | None
    also: str
    wide: bool
    kind: str
    sentence: str
    printed_residual: str
    right_residual: str
    more: int
    corrections: tuple[CorrectionShown, ...]


@dataclass(frozen=True)
class Slip:
    """A slip, with the formulas that repeat it."""

    sentence: str
    errata: tuple[ErratumShown, ...]


@dataclass(frozen=True)
class RemarkShown:
    """An error of a slide without a formula to compare."""

    why: str
    line: int | None
    also: str
    case: str


@dataclass(frozen=True)
class ComparisonContext(NamedRecords):
    """The records that the page and the document of comparisons get."""

    summary: Summary
    cases: tuple[CaseShown, ...]


@dataclass(frozen=True)
class ErrataContext(NamedRecords):
    """The records that the lists of errata get."""

    summary: Summary
    slips: tuple[Slip, ...]
    remarks: tuple[RemarkShown, ...]


def write_reports(comparisons: Comparisons, folder: Path) -> list[Path]:
    """Write all reports into a folder; returns their paths. Raises ArgumentError if the folder cannot be made, MissingExtra
    without latex2mathml."""
    prepare(folder)
    texts = {name: report(comparisons, name) for name in FILES}
    for name, text in texts.items():
        (folder / name).write_text(text, encoding="utf-8")
    return [folder / name for name in texts]


def prepare(folder: Path) -> None:
    """Look for what the reports need, and make their folder; raises as write_reports does."""
    mathml("x")
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ArgumentError(f"the folder {folder} for the reports cannot be made: {error.strerror}") from None


def report(comparisons: Comparisons, name: str) -> str:
    """The text of one report: comparison.html, comparison.tex, errata.html or errata.md."""
    ending = name.rpartition(".")[2]
    environment = jinja2.Environment(loader=jinja2.FileSystemLoader(template_folders()), undefined=jinja2.StrictUndefined,
                                     trim_blocks=True, lstrip_blocks=True, keep_trailing_newline=True,
                                     autoescape=ending == "html")
    environment.filters["tex"] = _tex
    environment.filters["count"] = counted
    pages = Pages(*((cache(lambda latex: _safe(mathml(latex))), "#b00020") if ending == "html" else (str, "wrong")))
    summary = Summary(_counts(comparisons.counts), sum(comparisons.counts.values()), comparisons.proved,
                      sum(comparisons.counts[v] for v in PROVABLE), sum(len(c.errata) for c in comparisons),
                      len({e.slip for c in comparisons for _, e in c.errata}), PRINTED)
    context: NamedRecords
    if name.startswith("errata"):
        context = ErrataContext(summary, _slips(comparisons, pages, ending == "html"),
                                tuple(_remark(c, remark) for c in comparisons for remark in c.remarks))
    else:
        context = ComparisonContext(summary, tuple(_case(c, pages) for c in comparisons))
    return environment.get_template(f"report/{name}.jinja").render(context.names())


def _counts(of: Mapping[Verdict, int]) -> tuple[OfVerdict, ...]:
    return tuple(OfVerdict(v.name.lower(), text, of[v]) for v, text in COLUMNS.items())


@dataclass(frozen=True)
class Pages:
    """Conversion of LaTeX to what the report holds, and the colour of errors."""

    typeset: Callable[[str], Any]
    color: str

    def lines(self, room: float, value: Any, wrong: Places = (), left: str = "") -> tuple[Any, ...]:
        return tuple(self.typeset(line) for line in Lines(room, self.color).of(value, wrong, left))


def _safe(text: str) -> Any:
    from markupsafe import Markup

    return Markup(text)  # made by latex2mathml, which escapes what it is given


def _case(case: Comparison, pages: Pages) -> CaseShown:
    return CaseShown(case.name, case.title, case.slide.section if case.slide else "", _counts(case.counts),
                     tuple(_formula(f, pages) for f in case.formulas))


def _formula(formula: FormulaResult, pages: Pages) -> FormulaShown:
    name = formula.latex or ""
    printed = width(formula.printed) + letters(f"{name} = ") if formula.printed is not None else 0
    derived = width(formula.derived) if formula.derived is not None else 0
    where = max(map(letters, where_latex(formula)), default=0)
    wide = max(printed, derived, where) > COLUMN
    room = PAGE if wide else COLUMN
    notes = tuple(dict.fromkeys(": ".join(filter(None, (place(formula, e.index), e.note))) if e.verdict is Verdict.UNREADABLE
                               else e.note for e in formula.entries if e.note))
    ways = list(dict.fromkeys(e.how for e in formula.entries if e.how))
    summary = "; ".join(words if len(formula.entries) > 1 else words.removeprefix("1 ") for _, words in worded(formula.entries))
    letters_alone = (pages.typeset(name),) if name else ()
    return FormulaShown(
        formula.name, str(formula.slide), ", ".join(map(str, formula.also)), wide, formula.verdict.name.lower(), summary,
        pages.lines(room, formula.printed, marked(formula), name) if formula.printed is not None else letters_alone,
        pages.lines(room, formula.derived) if formula.derived is not None else (),
        tuple(pages.typeset(line) for line in where_lines(formula, room)), notes,
        ", ".join([*ways, "on the named states"] if formula.where and ways else ways),
        tuple(dict.fromkeys(str(e.evidence) for e in formula.errata if e.evidence.holds)))


def _slips(comparisons: Comparisons, pages: Pages, broken: bool) -> tuple[Slip, ...]:
    """The errata of all cases, those that repeat one slip together, at the place of the first."""
    result: dict[str, list[ErratumShown]] = {}
    for case in comparisons:
        for erratum in _errata(case, pages, broken):
            result.setdefault(erratum.slip, []).append(erratum)
    return tuple(Slip(slip, tuple(errata)) for slip, errata in result.items())


def _remark(case: Comparison, remark: Remark) -> RemarkShown:
    return RemarkShown(remark.why, remark.line, ", ".join(map(str, remark.also)), case.name)


def _errata(case: Comparison, pages: Pages, broken: bool) -> list[ErratumShown]:
    """broken: formulas are lists of lines that fit the page, otherwise one line each."""
    rows = []
    for formula, erratum in case.errata:
        evidence, result = erratum.evidence, corrections(formula, erratum.entries)
        wide = any(max(width(c.printed), width(c.right)) > ERRATA_COLUMN for c in result)
        room = ERRATA_PAGE if wide else ERRATA_COLUMN
        slide = f"{formula.slide.section} {formula.slide.title}".strip()
        letters = formula.latex or ""
        more = max(len(erratum.entries) - SHOWN, 0) if not isinstance(formula.printed, tuple) else 0
        rows.append(ErratumShown(
            case.name, formula.name, (pages.typeset(letters),) if broken and letters else letters,
            slide or case.title or case.name, erratum.why, erratum.slip, formula.slide.line, ", ".join(map(str, formula.also)),
            wide, evidence.kind, evidence.sentence.rstrip(".") + ".", f"{evidence.printed:.2g}", _rounding(evidence.right), more,
            tuple(CorrectionShown(c.place, pages.lines(room, c.printed, c.wrong) if broken else formula_latex(c.printed),
                                  pages.lines(room, c.right) if broken else formula_latex(c.right)) for c in result)))
    return rows


def _rounding(residual: float) -> str:
    """Rounding differs from machine to machine in its digits, not in that it is rounding."""
    return "0" if residual < 1e-25 else "rounding" if residual < 1e-12 else f"{residual:.2g}"


def _tex(text: str) -> str:
    """Plain text for LaTeX; titles in Korean are described as such, since few installations have its letters."""
    text = re.sub(r"[\u1100-\ud7ff]+(?:[ (&]+[\u1100-\ud7ff]+)*", "(Korean)", str(text))
    special = {"\\": r"\textbackslash{}", "{": r"\{", "}": r"\}", "~": r"\textasciitilde{}", "^": r"\textasciicircum{}",
               "<": r"\textless{}", ">": r"\textgreater{}", "|": r"\textbar{}", "ω": r"$\omega$", "λ": r"$\lambda$"}
    return "".join(special.get(c, f"\\{c}" if c in "&%$#_" else c) for c in text)
