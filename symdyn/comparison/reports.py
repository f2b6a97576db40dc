"""Reports of many comparisons: a page (HTML), a document (LaTeX), and the errata as a page and as text."""

from __future__ import annotations

import re
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any

import jinja2

from symdyn.backend.source import template_folders
from symdyn.comparison.result import COLUMNS, Comparison, Comparisons
from symdyn.comparison.typeset import SHOWN, corrections, formula_latex, marked, mathml, place, where_latex
from symdyn.comparison.verdict import FormulaResult, Verdict
from symdyn.errors import ArgumentError

FILES = {"comparison.html": "comparison.html", "comparison.tex": "comparison.tex", "errata.html": "errata.html",
         "errata.md": "errata.md"}


def write_reports(comparisons: Comparisons, folder: Path) -> list[Path]:
    """Write all reports into a folder; returns their paths. Raises ArgumentError if the folder cannot be made, MissingExtra
    without latex2mathml."""
    texts = {name: report(comparisons, name) for name in FILES}
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ArgumentError(f"the folder {folder} for the reports cannot be made: {error.strerror}") from None
    for name, text in texts.items():
        (folder / name).write_text(text, encoding="utf-8")
    return [folder / name for name in texts]


def report(comparisons: Comparisons, name: str) -> str:
    """The text of one report: comparison.html, comparison.tex, errata.html or errata.md."""
    ending = name.rpartition(".")[2]
    environment = jinja2.Environment(loader=jinja2.FileSystemLoader(template_folders()), undefined=jinja2.StrictUndefined,
                                     trim_blocks=True, lstrip_blocks=True, keep_trailing_newline=True,
                                     autoescape=ending == "html")
    environment.filters["tex"] = _tex
    color = "#b00020" if ending == "html" else "wrong"
    typeset: Callable[[str], Any] = cache(lambda latex: _safe(mathml(latex))) if ending == "html" else str
    of_errata = name.startswith("errata")
    cases = [] if of_errata else [_case(c, typeset, color) for c in comparisons]
    errata = [e for c in comparisons for e in (_errata(c, typeset) if of_errata else c.errata)]
    return environment.get_template(f"report/{name}.jinja").render(
        cases=cases, errata=errata, columns=[(v.name.lower(), text) for v, text in COLUMNS.items()],
        counts={v.name.lower(): comparisons.counts[v] for v in Verdict}, total=sum(comparisons.counts.values()))


def _safe(text: str) -> Any:
    from markupsafe import Markup

    return Markup(text)  # made by latex2mathml, which escapes what it is given


def _case(case: Comparison, typeset: Callable[[str], Any], color: str) -> dict[str, Any]:
    return {"name": case.name, "title": case.title, "section": case.slide.section if case.slide else "",
            "counts": {v.name.lower(): case.counts[v] for v in Verdict},
            "formulas": [_formula(f, typeset, color) for f in case.formulas]}


def _formula(formula: FormulaResult, typeset: Callable[[str], Any], color: str) -> dict[str, Any]:
    wrong = marked(formula)
    notes = list(dict.fromkeys(f"{place(e.index)}: {e.note}" if e.verdict is Verdict.UNREADABLE and e.index else e.note
                               for e in formula.entries if e.note))
    ways = list(dict.fromkeys(e.how for e in formula.entries if e.how))
    return {"name": formula.name, "latex": typeset(formula.latex) if formula.latex else "", "slide": str(formula.slide),
            "also": ", ".join(map(str, formula.also)), "verdict": formula.verdict.name.lower(),
            "told": ", ".join(f"{n} {v.value}" if len(formula.entries) > 1 else v.value
                              for v in Verdict if (n := formula.counts[v])),
            "printed": typeset(formula_latex(formula.printed, wrong, color)) if formula.printed is not None else "",
            "derived": typeset(formula_latex(formula.derived)) if formula.derived is not None else "",
            "where": typeset(where_latex(formula)) if formula.where else "", "notes": notes, "ways": ", ".join(ways),
            "proofs": list(dict.fromkeys(str(e.evidence) for e in formula.errata if e.evidence.holds))}


def _errata(case: Comparison, typeset: Callable[[str], Any]) -> list[dict[str, Any]]:
    rows = []
    for formula, erratum in case.errata:
        evidence = erratum.evidence
        rows.append({"case": case.name, "formula": formula.name, "slide": formula.slide, "why": erratum.why,
                     "also": ", ".join(map(str, formula.also)), "kind": evidence.kind, "sentence": evidence.sentence,
                     "printed_residual": f"{evidence.printed:.2g}", "right_residual": _rounding(evidence.right),
                     "more": max(len(erratum.entries) - SHOWN, 0) if not isinstance(formula.printed, tuple) else 0,
                     "corrections": [{"place": where, "printed": typeset(a), "right": typeset(b)}
                                     for where, a, b in corrections(formula, erratum.entries)]})
    return rows


def _rounding(residual: float) -> str:
    """Rounding differs from machine to machine in its digits, not in that it is rounding."""
    return "0" if residual < 1e-25 else "rounding" if residual < 1e-12 else f"{residual:.2g}"


def _tex(text: str) -> str:
    """Plain text for LaTeX; titles in Korean are told to be so, since few installations have its letters."""
    text = re.sub(r"[\u1100-\ud7ff]+(?:[ (&]+[\u1100-\ud7ff]+)*", "(Korean)", str(text))
    special = {"\\": r"\textbackslash{}", "{": r"\{", "}": r"\}", "~": r"\textasciitilde{}", "^": r"\textasciicircum{}",
               "<": r"\textless{}", ">": r"\textgreater{}", "|": r"\textbar{}", "ω": r"$\omega$", "λ": r"$\lambda$"}
    return "".join(special.get(c, f"\\{c}" if c in "&%$#_" else c) for c in text)
