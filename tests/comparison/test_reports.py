"""The reports: what they hold, and that the pages read without a network."""

import shutil
import subprocess

import pytest
import sympy as sp

import symdyn as sd
from symdyn.comparison.reports import ERRATA_PAGE, FILES, PAGE, report, write_reports
from symdyn.comparison.result import Comparisons
from symdyn.comparison.typeset import Lines, formula_latex, mathml, width
from symdyn.comparison.verdict import Verdict
from symdyn.model.symbols import symbols_of
from symdyn.report.latex import letters

q = sd.coordinates("q1")
m, l, g = sd.parameters("m l g", positive=True)
SLIDE = sd.Slide("3.5", "Pendulum <upright> & more", 12)


@pytest.fixture(scope="module")
def comparisons():
    v = sp.Matrix([l * q.dot * sp.cos(q), l * q.dot * sp.sin(q)])
    proof = sd.proofs.numeric_derivative("It is the rate of the position.", of=sp.Matrix([l * sp.sin(q), -l * sp.cos(q)]))
    long = sp.Add(*[sp.Symbol(f"x_{k}") ** k for k in range(2, 200)])
    return sd.compare([
        sd.Case("velocity", "Velocity of 50% <b>bob</b>", SLIDE, [
            sd.Formula("v_O", [v[0], -v[1]], v, latex=r"\mathbf{v}_O", also=(40, 52),
                       errata=[sd.Erratum("A sign & more.", proof)]),
            sd.Formula("equal", v, v), sd.Formula("lost", None, v, unreadable="the line breaks off"),
            sd.Formula("motion", sp.Eq(m * l * q.ddot, -m * g * sp.sin(q)), sp.Eq(m * l * q.ddot, -m * g * sp.sin(q))),
            sd.Formula("long", long, long)]),
        sd.Case("differs", formulas=[sd.Formula("weight", -m * g, m * g)])])


def test_files_are_written_and_the_same_every_time(comparisons, tmp_path):
    paths = write_reports(comparisons, tmp_path / "new" / "folder")
    assert [p.name for p in paths] == list(FILES)
    assert all(p.read_text(encoding="utf-8") == report(comparisons, p.name) for p in paths)


def test_a_folder_that_cannot_be_made(comparisons, tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(sd.ArgumentError, match="cannot be made"):
        write_reports(comparisons, tmp_path / "file" / "folder")


def test_errata_hold_place_print_right_form_reason_and_proof(comparisons):
    text = report(comparisons, "errata.md")
    for part in ("Pendulum <upright> & more: v_O", "Line 12, also 40, 52", "A sign & more.", "row 2: printed",
                 "numeric differentiation", "It is the rate of the position.", "of the right formula 0."):
        assert part in text
    assert "weight" not in text


def test_latex_escapes_text_and_marks_wrong_entries(comparisons):
    text = report(comparisons, "comparison.tex")
    assert r"50\% \textless{}b\textgreater{}bob" in text and r"\textcolor{wrong}{- l" in text
    assert r"\mathbf{v}_O = \left[" in text and r"v\_O" in text


def test_long_expressions_are_counted_not_written_out():
    assert r"393\ \text{operations}" in formula_latex(sp.Add(*[sp.Symbol(f"x{k}") ** k for k in range(2, 199)]))


def test_pages_need_latex2mathml(monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "latex2mathml.converter", None)
    with pytest.raises(sd.MissingExtra, match=r"symdyn\[report\]"):
        mathml("x")


def test_notebooks_show_tables(comparisons):
    table, case = comparisons._repr_html_(), comparisons.cases[0]._repr_html_()
    assert "<td style=\"text-align:left\">velocity</td>" in table and "slide is wrong" in case
    assert "&lt;b&gt;bob" in case and "<b>bob" not in case


@pytest.fixture(scope="module")
def bare():
    """A case without a slide: an entry of a 1 x 1 matrix, an equation with one wrong row, a formula of another shape."""
    rows = sp.Matrix([q.ddot, 0]), sp.Matrix([-g / l, 0])
    wrong_row = rows[0], sp.Matrix([g / l, 0])
    other = sd.proofs.other
    lost = sd.proofs.Proof("count", "There are three.", lambda v: [3 - len(v)])
    return sd.compare(sd.Case("bare", formulas=[
        sd.Formula("M", [[m * l]], [[m * l**2]], errata=[sd.Erratum("l is squared.", other("So.", [[m * l**2]]))]),
        sd.Formula("rows", wrong_row, rows, errata=[sd.Erratum("The sign.", other("So.", sp.Matrix([q.ddot + g / l, 0])))]),
        sd.Formula("shape", [m, l], [m, l, g], errata=[sd.Erratum("g is lost.", lost)]),
        sd.Formula("states", [g * q], [g], where={q: 1})]))


def test_results_write_themselves(bare, comparisons, tmp_path):
    assert bare.write(tmp_path / "one") == [tmp_path / "one" / name for name in FILES]
    assert comparisons.write(str(tmp_path / "all"))[0].read_text(encoding="utf-8") == report(comparisons, "comparison.html")
    with pytest.raises(sd.ArgumentError, match="cannot be made"):
        bare.write(tmp_path / "one" / "errata.md" / "folder")


def test_a_case_without_slide_and_an_entry_without_neighbours(bare):
    text = report(Comparisons((bare,)), "errata.md")
    assert "\n## l is squared.\n\n### bare: M\n" in text and "Case `bare`.\n" in text and "row 1" not in text
    assert "- printed $l\\,m$, right $l^{2}\\,m$" in text


def test_one_is_no_plural(comparisons, bare):
    assert "\n1 formula that is wrong as printed" in report(comparisons, "errata.md")
    assert "1 formula that is wrong as printed" in report(comparisons, "errata.html")
    assert "2 cases, 8 entries:" in report(comparisons, "comparison.tex")
    assert "1 slip in 1 formula." in report(comparisons, "comparison.html") and "; 1 slip in 1 formula\n" in str(comparisons)
    one = sd.compare(sd.Case("one", formulas=[sd.Formula("m", m, m)]))
    assert str(one).endswith("1 entry: 1 equal, proved") and "1 case, 1 entry:" in report(Comparisons((one,)), "comparison.tex")


def test_formulas_of_other_shape_are_printed_whole(bare):
    assert "printed [[m], [l]], right [[m], [l], [g]]" in str(bare) and "None" not in str(bare)


def test_what_holds_on_some_states_only_is_said(bare):
    assert "1 equal, proved, on the named states" in str(bare)
    assert "on the named states" in report(Comparisons((bare,)), "comparison.html")


def test_only_the_wrong_row_of_an_equation_is_coloured(bare):
    printed = bare.formulas[1].printed
    text = formula_latex(printed, {(0,)}, "wrong")
    assert text.count(r"\textcolor{wrong}") == 2 and r"\textcolor{wrong}{\frac{g}{l}}\\0\end" in text
    assert [e.verdict for e in bare.formulas[1].entries] == [Verdict.WRONG, Verdict.EQUAL]


def broad(n):
    """A sum of n terms, about 7 letters each."""
    return sp.Add(*[sp.Symbol(f"A_{k}") * sp.Symbol(f"B_{k}") for k in range(1, n + 1)])


@pytest.mark.parametrize("value", [
    broad(40), m * broad(40), (broad(30), broad(25)), sp.Matrix([broad(40), m]), sp.Matrix([broad(40), broad(39)]),
    sp.Matrix([[broad(12), m, broad(12)], [l, broad(20), broad(12)]]), sp.Matrix(3, 45, lambda i, j: broad(3) * int(i == j)),
    (sp.Matrix([broad(30), m]), sp.Matrix([broad(20), l]))], ids=str)
@pytest.mark.parametrize("room", [PAGE, ERRATA_PAGE])
def test_lines_have_the_width_of_the_page_and_lose_nothing(value, room):
    assert width(value) > room
    lines = Lines(room).of(value, (), "x")
    assert len(lines) > 1 and max(map(letters, (line for line in lines if "matrix" not in line))) <= room + 3
    text = "".join(lines)
    sides = value if isinstance(value, tuple) else (value,)
    assert all(str(sp.latex(s)) in text for side in sides for s in symbols_of(side))


def test_names_of_wide_entries_are_explained_once():
    lines = Lines(PAGE).of(sp.Matrix([[broad(12), m, broad(12)], [l, broad(20), broad(12)]]), {(1, 1)}, "M")
    assert lines[0].startswith(r"M = \left[") and r"\textcolor{#b00020}{\langle 2{,}2 \rangle}" in lines[0]
    assert lines[1].startswith(r"\langle")
    assert any(r"\langle 2{,}2 \rangle = \textcolor{#b00020}" in line for line in lines[1:])
    listed = Lines(PAGE).of(sp.Matrix(3, 45, lambda i, j: broad(3) * int(i == j)), (), "J")
    high = Lines(PAGE).of((m * sp.ones(40, 1), sp.zeros(40, 1)), {(39,)}, "F")
    assert len(high) == 41 and high[1] == r"\langle 1 \rangle\colon\enspace m = 0" and "textcolor" in high[40]
    assert len(Lines(PAGE).of(m * sp.ones(40, 1))) == 41
    assert listed[0].startswith(r"J = 3 \times 45") and len(listed) == 4


def test_wide_formulas_have_rows_of_their_own(tmp_path):
    value = sp.Matrix([[broad(12), m], [l, m]])
    found = Comparisons((sd.compare(sd.Case("wide", formulas=[sd.Formula("M", value, value), sd.Formula("m", m, m)])),))
    assert report(found, "comparison.html").count('<tr class="formula wide">') == 1
    text = report(found, "comparison.tex")
    assert text.count(r"\side{derived}") == 1 and r"\row{\textbf{m}" in text


@pytest.mark.skipif(shutil.which("pdflatex") is None, reason="no pdflatex on this machine")
def test_the_document_compiles_with_formulas_of_a_readable_size(comparisons, bare, tmp_path):
    value = sp.Matrix([[broad(12), m, broad(12)], [l, broad(20), sp.sin(broad(12))]])
    wide = sd.compare(sd.Case("wide", formulas=[sd.Formula("M", value, value), sd.Formula("E", (m, broad(60)), (m, broad(60)))]))
    text = report(Comparisons((*comparisons, bare, wide)), "comparison.tex")
    test = r"\ifdim\wd\formulabox>\linewidth"
    assert text.count(test) == 1
    (tmp_path / "c.tex").write_text(text.replace(test, test + r"\ifdim.6\wd\formulabox>\linewidth\errmessage{small}\fi"))
    run = subprocess.run(["pdflatex", "-interaction=nonstopmode", "-halt-on-error", "c.tex"], cwd=tmp_path, capture_output=True,
                         text=True, errors="replace", timeout=120)
    assert run.returncode == 0, run.stdout[-1500:]


@pytest.fixture(scope="module")
def page(chromium):
    opened = chromium.new_page(viewport={"width": 1300, "height": 900})
    yield opened
    opened.close()


@pytest.mark.parametrize("name", ["comparison.html", "errata.html"])
def test_pages_open_in_a_browser_without_network_or_errors(page, comparisons, bare, tmp_path, name):
    slides = sd.compare(["pendulum-augmented", "rates-of-unit-vectors"])
    write_reports(Comparisons((*comparisons, *slides, bare)), tmp_path)
    requests, complaints = [], []
    page.on("request", lambda r: requests.append(r.url))
    page.on("console", lambda message: complaints.append(message.text) if message.type in ("error", "warning") else None)
    page.on("pageerror", lambda error: complaints.append(str(error)))
    page.goto((tmp_path / name).as_uri())
    page.wait_for_load_state("networkidle")
    assert [r for r in requests if not r.startswith(("file:", "data:"))] == []
    assert complaints == []
    sizes = page.evaluate("[...document.querySelectorAll('math')].map(e => e.getBoundingClientRect())"
                          ".map(r => [r.width, r.height])")
    assert len(sizes) >= 2 and all(width > 3 and height > 5 for width, height in sizes)
    assert page.evaluate("document.documentElement.scrollWidth <= window.innerWidth")
    assert page.evaluate("document.querySelectorAll('merror').length") == 0
    assert page.evaluate("[...document.querySelectorAll('.math')].every(e => e.scrollWidth <= 1.02 * e.clientWidth)")
    assert "A sign & more." in page.inner_text("body")


@pytest.fixture(scope="module")
def repeated():
    """One slip in two formulas of two cases, another in a third, and a label that is wrong."""
    def wrong(name, slip, **options):
        proof = sd.proofs.other("So.", m * l)
        return sd.Formula(name, -m * l, m * l, errata=[sd.Erratum(f"The sign of {name}.", proof, slip=slip)], **options)

    first = sd.Case("first", slide=SLIDE, formulas=[wrong("a", "A sign is lost."), wrong("b", "", line=13)],
                    remarks=[sd.Remark("Link 3 <is> printed for link 1.", 14, [15])])
    second = sd.Case("second", formulas=[wrong("c", "A sign is lost.")], remarks=sd.Remark("Another word."))
    return sd.compare([first, second])


def test_errata_that_repeat_one_slip_are_listed_once_with_all_places(repeated):
    text = report(repeated, "errata.md")
    assert "3 formulas that are wrong as printed, 2 slips in all" in text
    assert text.index("## A sign is lost.") < text.index(": a\n") < text.index("### second: c") < text.index("## The sign of b.")
    assert text.count("## A sign is lost.") == 1 and "`first`. The sign of a." in text
    page = report(repeated, "errata.html")
    assert page.count('<tbody class="slip">') == 2 and "1. A sign is lost." in page and "2 formulas" in page
    assert "; 2 slips in 3 formulas" in str(repeated)


def test_labels_and_words_stand_on_the_page_without_a_formula(repeated, bare):
    text, page = report(repeated, "errata.md"), report(repeated, "errata.html")
    assert "- Line 14, also 15, case `first`: Link 3 <is> printed for link 1." in text
    assert "- Case `second`: Another word." in text
    assert "Link 3 &lt;is&gt; printed for link 1." in page and "line 14: Link 3 <is> printed" in str(repeated.cases[0])
    assert "Labels and words" not in report(Comparisons((bare,)), "errata.md") + report(Comparisons((bare,)), "errata.html")


@pytest.mark.parametrize("name", FILES)
def test_pages_say_at_their_top_what_printed_means(repeated, name):
    text = report(repeated, name)
    assert "what the transcription of the slides as text holds" in text
    assert text.index("what the transcription") < text.index("The sign of a")
