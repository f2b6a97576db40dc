"""Tables of comparisons for notebooks."""

from __future__ import annotations

from html import escape

from symdyn.comparison.result import COLUMNS, Comparison, Comparisons, worded
from symdyn.comparison.typeset import formula_latex, marked
from symdyn.comparison.verdict import Verdict

STYLE = {Verdict.EQUAL: "#1b7f3b", Verdict.CONVENTION: "#1f5fbf", Verdict.WRONG: "#b00020", Verdict.UNREADABLE: "#6b6b6b",
         Verdict.DIFFERENT: "#a65a00", Verdict.UNDECIDED: "#a65a00"}


def table_html(comparisons: Comparisons) -> str:
    """One row for each case, with the number of entries of each verdict."""
    head = "".join(f"<th>{text}</th>" for text in ("case", "section", "formulas", *COLUMNS.values()))
    rows = []
    for c in comparisons:
        counts = "".join(_count(c.counts[v], v) for v in COLUMNS)
        section = c.slide.section if c.slide else ""
        rows.append(f'<tr><td style="text-align:left">{escape(c.name)}</td><td>{escape(section)}</td>'
                    f"<td>{len(c.formulas)}</td>{counts}</tr>")
    formulas = sum(len(c.formulas) for c in comparisons)
    counts = "".join(_count(comparisons.counts[v], v) for v in COLUMNS)
    rows.append(f"<tr><th>all</th><th></th><th>{formulas}</th>{counts}</tr>")
    return f"<table><thead><tr>{head}</tr></thead><tbody>{''.join(rows)}</tbody></table>"


def comparison_html(comparison: Comparison) -> str:
    """One row for each formula: print, derived form, verdict."""
    rows = []
    for f in comparison.formulas:
        notes = dict.fromkeys([*(e.note for e in f.entries if e.note), *(str(e.evidence) for e in f.errata)])
        parts = "<br>".join(f'<span style="color:{STYLE[v]}">{words}</span>' for v, words in worded(f.entries))
        printed = f"${formula_latex(f.printed, marked(f), 'red')}$" if f.printed is not None else ""
        derived = f"${formula_latex(f.derived)}$" if f.derived is not None else ""
        line = f"<br>line {f.slide.line}" if f.slide.line is not None else ""
        rows.append(f'<tr><td style="text-align:left">{escape(f.name)}{line}</td><td>{printed}</td><td>{derived}</td>'
                    f'<td style="text-align:left">{parts}{"".join(f"<br><small>{escape(n)}</small>" for n in notes)}</td></tr>')
    title = escape(f"{comparison.name}: {comparison.title}" if comparison.title else comparison.name)
    return (f"<table><caption>{title}</caption><thead><tr><th>formula</th><th>printed</th><th>derived</th><th>verdict</th></tr>"
            f"</thead><tbody>{''.join(rows)}</tbody></table>")


def _count(n: int, verdict: Verdict) -> str:
    return f'<td style="color:{STYLE[verdict]}">{n}</td>' if n else "<td>.</td>"
