"""The documentation as a site: it builds without a warning, has every public name, and works from the disk without a network."""

from __future__ import annotations

import inspect
import json
import os
import re
import subprocess
import sys
from collections.abc import Sequence
from html import escape, unescape
from pathlib import Path
from typing import Any, Literal
from urllib.parse import unquote

import pytest

import symdyn as sd
from tests.checks import public_names, walk
from tests.checks.every_page import CheckedPage
from tests.helpers import CONTRAST, swept
from tests.test_examples import PUBLIC

ROOT = Path(__file__).parents[1]
PAGES = ("index", "tutorials", "tutorials/crane_with_controller", "tutorials/two_link_arm", "tutorials/wheel_on_a_road",
         "describing_mechanisms", "printing", "measured", "gallery", "gallery/four_bar", "gallery/puma560", "gallery/bicycle",
         "reference/system", "reference/module", "contributing", "genindex")
# One of each kind, which the suite opens; the sweep opens all.
KINDS = "index", "tutorials/wheel_on_a_road", "measured", "gallery", "gallery/four_bar", "reference/system"


# The site is built once by each process that needs it; tests that stand at the front of the run stay in one.
pytestmark = pytest.mark.slow


# The gallery has pages of these: a tree, a loop, what floats, what touches. All others are in the sweep.
SOME = ["floating_crane", "four_bar", "pendulum", "rocking_block"]


def build(folder: Path, mechanisms: Sequence[str]) -> Path:
    pytest.importorskip("sphinx")
    command = [sys.executable, "-m", "sphinx", "-W", "--keep-going", "-q", "-b", "html", str(ROOT / "docs"), str(folder)]
    known = {**os.environ, "SYMDYN_GALLERY": " ".join(mechanisms)}
    built = subprocess.run(command, capture_output=True, text=True, check=False, env=known)
    assert built.returncode == 0, built.stderr
    return folder


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return build(tmp_path_factory.mktemp("site"), SOME)


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return build(tmp_path_factory.mktemp("whole"), ())


@pytest.fixture
def there(name: str, request: pytest.FixtureRequest) -> Path:
    """The file of a page; of a mechanism that is not among some of them only the whole site has one."""
    rest = name.startswith("gallery/") and name.removeprefix("gallery/") not in SOME
    site: Path = request.getfixturevalue("whole" if rest else "site")
    return site / f"{name}.html"


def test_every_public_name_has_an_entry(site: Path) -> None:
    listed = (site / "genindex.html").read_text(encoding="utf-8")
    text = "".join(page.read_text(encoding="utf-8") for page in (site / "reference").glob("*.html"))
    for name in sd.__all__:
        thing = getattr(sd, name)
        module = inspect.ismodule(thing)
        ids = [f"symdyn.{name}", f"module-{thing.__name__}" if module else f"{getattr(thing, '__module__', 'symdyn')}.{name}"]
        # Packages that can be called stand under the name of what they call.
        assert any(f'id="{one}"' in text for one in ids) or (module and callable(thing) and f"sd.{name}" in text), name
    for method in ("symdyn.System.add_joint", "symdyn.runtime.module.Module.simulate",
                   "symdyn.runtime.solutions.solution.Solution.plot"):
        assert f'id="{method}"' in text and f"#{method}" in listed, method


def test_every_entry_of_the_reference_is_tested_to_have_an_example(site: Path) -> None:
    """Nothing else has an entry than what tests/test_examples.py has examples of, fields of its classes, errors, and the time."""
    kinds = public_names.objects(public_names.entries(site))
    others = {name for name, kind in kinds.items() if kind in ("exception", "data", "attribute")}
    assert set(kinds) - others == set(PUBLIC) - others
    assert all(public_names.runs(name) for name in others if kinds[name] == "attribute")


def test_docstrings_are_typeset(site: Path) -> None:
    """Arguments are definitions, examples are code, and no markup is left over."""
    page = (site / "reference" / "system.html").read_text(encoding="utf-8")
    event = page[page.index('id="symdyn.System.add_event"'):]
    event = event[:event.index("</dd></dl>")]
    assert re.search(r"<dt>direction</dt><dd><p>1: only upwards through zero, -1: only downwards", event)
    assert 'class="doctest' in event and "``" not in re.sub(r"<[^>]+>", "", page)
    for page in (site / "reference").glob("*.html"):
        assert not re.search("=====|``|:ref:", re.sub(r"<[^>]+>", "", page.read_text(encoding="utf-8"))), page.name
    symbols = (site / "reference" / "symbols.html").read_text(encoding="utf-8")
    assert "in loads and outputs; <code" in symbols and 'id="symdyn.t"' in symbols


@pytest.mark.parametrize("name", swept(PAGES, *KINDS))
def test_pages_work_without_a_network(there: Path, chromium: Any) -> None:
    """No request beyond the disk, nothing on the console, nothing wider than its box or the window; tests/checks/every_page.py
    opens all of them."""
    checked = CheckedPage(chromium)
    assert [*checked.open(there), *checked.wider()] == []
    checked.page.close()


def test_faults_of_pages_are_found(chromium: Any, tmp_path: Path) -> None:
    """Each of the checks of pages finds its fault."""
    page = tmp_path / "page.html"
    page.write_text("""<!doctype html><style>a { display: block; outline: none !important; }</style>
        <body style="background: white"><div class="content" style="width: 300px"><img src="http://127.0.0.1:8099/x.png" alt="">
        <p style="color: #909090">grey</p><p style="width: 320px">broad</p>
        <p style="overflow: hidden; width: 50px">incomprehensible</p>
        <div style="overflow: auto; width: 200px"><pre style="width: 900px">scrolls</pre></div>
        <div style="width: 1300px; height: 9px; position: absolute"></div><a href="#">plain</a>
        <button onfocus="this.blur()" id="shy">shy</button></div><script>console.log("talk")</script>""", encoding="utf-8")
    checked = CheckedPage(chromium)
    opened = list(checked.open(page))
    assert opened[0] == "requested: http://127.0.0.1:8099/x.png" and "on the console: talk" in opened
    wider = list(checked.wider())
    assert {one.rpartition(": ")[2] for one in wider if "1400 pixels" in one} == {"broad", "incomprehensible", ""}
    assert "wider than a window of 400 pixels" in wider and "wider than a window of 1400 pixels" not in wider
    assert [one.split()[-2] for one in checked.unreadable()] == ["grey", "grey"]
    assert list(checked.unreached()) == ['not reached by Tab: <button onfocus="this.blur()" id="shy">shy</button>',
                                         'without an outline: <a href="#">plain</a>']
    checked.page.close()


@pytest.mark.every_value
@pytest.mark.parametrize("scheme", ["light", "dark"])
@pytest.mark.parametrize("name", swept([*PAGES, "search", "messages", "theory/embedding", "reference/errors"],
                                       *KINDS, "printing", "search", "theory/embedding"))
def test_text_can_be_read(there: Path, chromium: Any, scheme: Literal["light", "dark"]) -> None:
    """Contrast AA of all text: contents, code, tables, formulas; a reader's choice of dark or light counts as well."""
    page = chromium.new_page(color_scheme=scheme)
    page.goto(there.as_uri())
    assert page.evaluate(CONTRAST) == []
    chosen = {"light": "dark", "dark": "light"}[scheme]
    page.evaluate("theme => { document.body.dataset.theme = theme; }", chosen)
    assert page.evaluate(CONTRAST) == []
    brightness = page.evaluate("getComputedStyle(document.body).backgroundColor.match(/\\d+/g).map(Number)[0]")
    assert (brightness < 128) == (chosen == "dark")
    page.close()


def test_text_that_cannot_be_read_is_found(chromium: Any) -> None:
    """Grey text is a fault and large grey text is none; what lets its background through counts as it is seen."""
    page = chromium.new_page(color_scheme="light")
    page.set_content("<p style='color: #808080'>small</p><p style='color: #808080; font-size: 30px'>large</p>"
                     "<p style='color: rgba(0, 0, 0, 0.4)'>faint</p><p>black</p>")
    assert [fault.split()[1] for fault in page.evaluate(CONTRAST)] == ["small", "faint"]
    page.close()


@pytest.mark.parametrize("name", swept(["index", "gallery", "gallery/pendulum", "gallery/puma560", "reference/module",
                                        "tutorials/robot_arm_from_urdf"], "gallery/pendulum"))
def test_the_keyboard_reaches_everything(there: Path, chromium: Any) -> None:
    """Tab goes to every link, button and field of a page that is seen, in a cycle, and each has an outline then."""
    checked = CheckedPage(chromium)
    checked.page.goto(there.as_uri())
    assert list(checked.unreached()) == [] and checked.page.evaluate("reached.size") > 20
    checked.page.close()


@pytest.mark.parametrize("every", [False, pytest.param(True, marks=pytest.mark.sweep)])
def test_the_gallery_shows_mechanisms(every: bool, chromium: Any, request: pytest.FixtureRequest) -> None:
    """A picture of each in the grid, and a page with its equations and numbers."""
    site: Path = request.getfixturevalue("whole" if every else "site")
    names = [name for name in sd.systems.names() if every or name in SOME]
    page = chromium.new_page()
    page.goto((site / "gallery.html").as_uri())
    for image in page.query_selector_all(".gallery img"):
        image.scroll_into_view_if_needed()
        page.wait_for_function("image => image.complete && image.naturalWidth > 0", arg=image, timeout=10_000)
    links = page.eval_on_selector_all(".gallery a", "links => links.map(link => link.getAttribute('href'))")
    assert links == [f"gallery/{name}.html" for name in names]
    page.close()
    for name in names:
        text = (site / "gallery" / f"{name}.html").read_text(encoding="utf-8").replace(' class="short"', "")
        assert '<div class="formula"><math' in text and "<td><p>rhs</p></td>" in text and "x_dot" in text, name
        view = (site / "_static" / f"{name}.html").read_text(encoding="utf-8")
        data = json.loads(view.split('type="application/json">')[1].split("</script>")[0].replace("<\\/", "</"))
        moving = [p["values"]["step"] for p in data["motions"][0]["panels"] if p["title"].startswith("coordinates")]
        assert max(map(max, moving)) * 65535 > 1e-3, f"{name} stays at rest"
        assert (site / "_static" / f"{name}.c").stat().st_size > 1000 and f"_static/{name}.html#play" in text, name


@pytest.mark.parametrize("name", swept(["gallery/four_bar", "gallery/puma560"], "gallery/four_bar"))
def test_mechanisms_of_the_gallery_move(there: Path, chromium: Any) -> None:
    """The embedded page plays without a click, unless the reader asked for reduced motion."""
    for motion, moves in (("no-preference", True), ("reduce", False)):
        page = chromium.new_page(reduced_motion=motion, viewport={"width": 500, "height": 400})
        page.goto(there.as_uri())
        page.query_selector("iframe.view").scroll_into_view_if_needed()
        view = page.query_selector("iframe.view").content_frame()
        view.wait_for_selector("#player input", timeout=20_000)
        time = "Number(document.querySelector('#player input').value)"
        if moves:
            view.wait_for_function(f"{time} > 0.1", timeout=20_000)
        else:
            page.wait_for_timeout(500)
            assert view.evaluate(time) == 0
        page.close()


def test_lines_of_formulas_are_aligned(site: Path) -> None:
    """Long equations are tables of lines; no sign of LaTeX is left over in a formula."""
    formulas = {page: re.findall("<math.*?</math>", page.read_text(encoding="utf-8"), re.DOTALL)
                for folder in (site, site / "gallery", site / "theory", site / "tutorials") for page in folder.glob("*.html")}
    assert sum(map(len, formulas.values())) > 500
    left_over = re.compile(r">\s*(&(?!#|lt;|gt;)|\\|2pt)")
    assert [page.name for page, found in formulas.items() for one in found if left_over.search(one)] == []
    four_bar = next(one for one in formulas[site / "gallery" / "four_bar.html"] if "align" in one)
    assert four_bar.count('<mtd columnalign="left">') > 4


def test_functions_are_set_off_from_their_factors(site: Path, chromium: Any) -> None:
    """R cos γt: a thin space at both sides of the name, none before a parenthesis."""
    page = chromium.new_page()
    page.goto((site / "tutorials" / "chapter_1_particles.html").as_uri())
    gaps = page.evaluate("""() => [...document.querySelectorAll("math mo")].filter(e => /^(sin|cos)$/.test(e.textContent)
        && e.previousElementSibling?.tagName === "mi" && e.nextElementSibling).map(e => {
            const size = parseFloat(getComputedStyle(e).fontSize), [a, b, c] = [e.previousElementSibling, e, e.nextElementSibling]
                .map(one => one.getBoundingClientRect());
            return [(b.left - a.right) / size, (c.left - b.right) / size, c && e.nextElementSibling.textContent]; })""")
    assert len(gaps) > 1 and all(before > 0.1 and (after > 0.1) == (text[0] != "(") for before, after, text in gaps), gaps
    assert any(text == "\u03b3" for _, _, text in gaps)
    page.close()


def test_signs_after_formulas_stay_on_their_line(site: Path) -> None:
    formula = re.compile(r'(<span class="short"><math(?:(?!</math>).)*)?</math>([,.;:!?)\u2019]+)', re.DOTALL)
    kept = 0
    for page in site.rglob("*.html"):
        signs = formula.findall(page.read_text(encoding="utf-8")) if "_static" not in page.parts else []
        assert all(held for held, _ in signs), page.name
        kept += len(signs)
    assert kept > 100


def test_tutorials_are_pages_with_what_their_code_shows(site: Path) -> None:
    listed = (site / "tutorials.html").read_text(encoding="utf-8")
    for source in sorted((ROOT / "notebooks").glob("*.py")):
        page = (site / "tutorials" / f"{source.stem}.html").read_text(encoding="utf-8")
        assert f'href="tutorials/{source.stem}.html"' in listed, source.stem
        assert page.count('class="highlight-python') > 2 and f"{source.stem}.ipynb" in page, source.stem
        assert 'class="highlight-text' in page or '<div class="formula">' in page, source.stem
        views = re.findall(r"^(?!plt)\w+\.(?:view|show)\(\)$", source.read_text(encoding="utf-8"), re.MULTILINE)
        assert page.count('<iframe class="view"') == len(views) and "View(&#39;" not in page, source.stem
        systems = re.findall(r"^display\((?:arm|car|turbine)\)$", source.read_text(encoding="utf-8"), re.MULTILINE)
        assert page.count('<div class="shown"><div><b>System(') == len(systems), source.stem
        films = source.read_text(encoding="utf-8").count('format="gif"')
        assert len(re.findall(r'src="[^"]*\.gif"', page)) == films, source.stem


@pytest.mark.parametrize(("name", "views"), swept([("a_walker", 1), ("robot_arm_from_urdf", 2), ("turbine_campbell_diagram", 1),
                                                   ("wheel_on_a_road", 1)], ("wheel_on_a_road", 1)))
def test_views_of_tutorials_are_drawn(site: Path, chromium: Any, name: str, views: int) -> None:
    """A page that turns in a notebook is drawn on the tutorial's page, without a message on the console."""
    page = chromium.new_page()
    said: list[str] = []
    page.on("console", lambda message: said.append(message.text))
    page.on("pageerror", lambda error: said.append(str(error)))
    page.goto((site / "tutorials" / f"{name}.html").as_uri())
    frames = page.query_selector_all("iframe.view")
    assert len(frames) == views
    for frame in frames:
        frame.scroll_into_view_if_needed()
        view = frame.content_frame()
        view.wait_for_function("window.symdyn && symdyn.stage.frames > 0", timeout=20_000)
        colors, seen = view.evaluate("""() => { const { stage } = symdyn, { canvas, renderer } = stage, gl = renderer.gl;
            stage.draw(false);
            const p = new Uint8Array(4 * canvas.width * canvas.height);
            gl.readPixels(0, 0, canvas.width, canvas.height, gl.RGBA, gl.UNSIGNED_BYTE, p);
            const pixels = new Uint32Array(p.buffer);
            return [new Set(pixels).size, pixels.filter(one => one !== pixels[0]).length / pixels.length]; }""")
        assert colors > 10 and seen > 0.01  # boxes on a rail have few colours
    assert not said, said
    page.close()


def test_measured_figures_are_rows_of_tables(site: Path) -> None:
    """Every stored line is on the page with its command and day: of figures a row each, of other output as it was printed."""
    page = (site / "measured.html").read_text(encoding="utf-8").replace("’", "'").replace(' class="short"', "")
    text = unescape(re.sub("<[^>]+>", "", page))
    for file in (ROOT / "docs" / "measured").glob("*.json"):
        stored = json.loads(file.read_text(encoding="utf-8"))
        if file.stem == "reference":
            continue
        assert f"{stored['command']}, {stored['date']}: {stored['machine']}." in text
        for line in stored.get("lines", ()):
            cells = [escape(cell, quote=False) for cell in re.split(r"\s{2,}", line.strip())]
            row = "".join(rf"\s*<t[dh][^>]*><p>{re.escape(cell)}</p></t[dh]>" for cell in cells)
            assert line in text or f"<td><p>{cells[0]}</p></td>" in page or re.search(row, page), line
        for cell in {cell for row in stored.get("rows", ()) for cell in row if cell}:
            assert f"<p>{cell}</p></td>" in page, cell
    assert "<td><p>double_pendulum</p></td>\n<td><p>10 s</p></td>" in page and "<td><p>spatial_chain(12)</p></td>" in page
    assert "<td><p>spatial_chain(7): operations of the right-hand side</p></td>\n<td><p>1191</p></td>" in page
    counted = unescape(re.sub("<[^>]+>", "", (site / "index.html").read_text(encoding="utf-8")))
    assert "public names of the package have an entry in the reference" in counted and "have an example that runs" in counted


def test_the_walk_tries_what_the_pages_print(site: Path) -> None:
    """Every tutorial and every command; what is left out is printed somewhere, and the stored walk had the same steps."""
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    readme = walk.commands("\n".join(re.findall(r"```bash\n(.*?)```", text, re.DOTALL)))
    (both,) = walk.blocks((site / "tutorials.html").read_text(encoding="utf-8"), "bash")
    commands = {*readme, *both.strip().split(" && "), *walk.printed(site)}
    assert {"symdyn list", "symdyn view four_bar", "symdyn report my_mechanism.py --full"} <= commands
    assert set(walk.LEFT_OUT) < commands
    pages = walk.tutorials(site)
    assert {page.removeprefix("tutorials/") for page in pages} == {source.stem for source in (ROOT / "notebooks").glob("*.py")}
    lines = json.loads((ROOT / "docs" / "measured" / "walk.json").read_text(encoding="utf-8"))["lines"]
    steps = {re.split(r"\s{2,}", line)[0].removeprefix("README: ").removeprefix("tutorials: "): line for line in lines[1:-1]}
    assert commands <= set(steps) and {name.partition(":")[0] for name in steps} >= set(pages)
    assert all(line.endswith("done") or "left out: " in line for line in steps.values())


def test_a_step_of_the_walk_that_fails_is_reported(tmp_path: Path) -> None:
    (tmp_path / "page.py").write_text("raise SystemExit('no such mechanism')\n", encoding="utf-8")
    assert walk.tried("page", f"{sys.executable} page.py", tmp_path).end == "FAILED: no such mechanism"
    assert walk.tried("page", f"{sys.executable} -c 'print(1)'", tmp_path).end == "done"


def test_parts_that_are_walked_again_take_the_place_of_their_rows() -> None:
    """Rows of other parts stay with their day; those of pages that are gone, and commands that are no longer printed, go."""
    old = [walk.Step(name, 1.0, "done", "2026-01-01") for name in (
        "README: python3 -m venv .venv", "a: 2 blocks", "b: 1 block", "gone: 3 blocks", "symdyn list", "symdyn demo")]
    new = [walk.Step("README: python3 -m venv .venv", 2.0, "done", "2026-02-01"),
           walk.Step("b: 2 blocks", 2.0, "done", "2026-02-01"),
           walk.Step("symdyn list", None, "left out: it is long", "2026-02-01")]
    assert [walk.step_of(step.line) for step in old + new] == old + new
    both = walk.put_in(old, new, ["a", "b", walk.SHELL])
    assert both == [new[0], old[1], new[1], new[2]]
    assert walk.summary(both) == "3 done, 0 failed, 1 left out; 5 minutes in all"


def test_links_within_the_site_lead_somewhere(site: Path) -> None:
    """Every address of a page and every part that it names are there."""
    pages = {page: page.read_text(encoding="utf-8") for page in site.rglob("*.html") if "_static" not in page.parts}
    ids = {page: set(map(unescape, re.findall(r'\bid="([^"]+)"', text))) for page, text in pages.items()}
    links = [(page, unescape(link)) for page, text in pages.items() for link in re.findall(r'(?:href|src)="([^"]+)"', text)]
    assert len(links) > 1000
    for page, link in links:
        if re.match("[a-z]+:", link):
            continue
        name, _, anchor = link.partition("#")
        file = page.parent / unquote(name.partition("?")[0]) if name else page
        file = Path(os.path.normpath(file))
        assert file.exists(), (page.name, link)
        assert not anchor or file not in ids or unquote(anchor) in ids[file], (page.name, link)


def test_the_search_finds_a_name(site: Path, chromium: Any) -> None:
    page = chromium.new_page()
    page.goto((site / "search.html").as_uri() + "?q=close_loop")
    page.wait_for_selector("#search-results li", timeout=20_000)
    assert "Constraints" in page.inner_text("#search-results") or "close_loop" in page.inner_text("#search-results")
    page.close()
