"""The reports: what they hold, and that the pages read without a network."""

import shutil

import pytest
import sympy as sp

import symdyn as sd
from symdyn.comparison.reports import FILES, report, write_reports
from symdyn.comparison.typeset import formula_latex, mathml

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
def page():
    playwright = pytest.importorskip("playwright.sync_api")
    chromium = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
    if chromium is None:
        pytest.skip("no Chromium on this machine")
    with playwright.sync_playwright() as p:
        browser = p.chromium.launch(executable_path=chromium, args=["--no-sandbox"])
        yield browser.new_page(viewport={"width": 1300, "height": 900})
        browser.close()


@pytest.mark.parametrize("name", ["comparison.html", "errata.html"])
def test_pages_open_in_a_browser_without_network_or_errors(page, comparisons, tmp_path, name):
    write_reports(comparisons, tmp_path)
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
    assert "A sign & more." in page.inner_text("body")
