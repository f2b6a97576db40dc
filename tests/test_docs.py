"""Code on the pages under docs runs as shown."""

import ast
import json
import re
import subprocess
import tomllib
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.running import run_program

ROOT = Path(__file__).parent.parent
PAGES = sorted((ROOT / "docs").rglob("*.md"))
NAMES = {page: page.relative_to(ROOT / "docs").with_suffix("").as_posix() for page in PAGES}

# Pages whose code takes seconds, of kinds that others have too: the sweep runs it.
LONG = "choosing_a_method", "contact", "derivatives", "optimal_motion", "pictures", "work_against_error"
# Pages that show numbers of steps, which are those with fused operations, or write libraries that tcc does not compile.
NATIVE = "choosing_a_method", "contact", "fmu", "other_libraries", "start"


def marks(page: Path) -> list[pytest.MarkDecorator]:
    name = NAMES[page]
    return [mark for mark, pages in ((pytest.mark.sweep, LONG), (pytest.mark.native, NATIVE)) if name in pages]


# They are texts of the project's folder on the site.
OF_THE_PROJECT = "contributing", "changes"


@pytest.mark.parametrize("page", [pytest.param(page, marks=marks(page)) for page in PAGES], ids=NAMES.get)
def test_blocks_run_and_print_what_is_shown(page: Path, tmp_path: Path) -> None:
    """All blocks of a page run one after the other; what they print is what the text blocks show, to the last character."""
    text = page.read_text(encoding="utf-8")
    code, shown = (re.findall(rf"```{kind}\n(.*?)```", text, re.DOTALL) for kind in ("python", "text"))
    if not code:
        assert not shown
        pytest.skip("no code on this page")
    script = tmp_path / "page.py"  # functions of the user are read from a file
    script.write_text("\n".join(code), encoding="utf-8")
    run = run_program(script)
    assert run.returncode == 0, run.stderr
    assert "Warning" not in run.stderr
    assert run.stdout == "".join(shown)


@pytest.mark.parametrize("page", [ROOT / "README.md", ROOT / "CONTRIBUTING.md", *PAGES],
                         ids=lambda page: NAMES.get(page, page.stem))
def test_links_lead_somewhere(page: Path) -> None:
    """To a file, and where a heading is named to a heading of that page."""
    for target in re.findall(r"\]\(([^)\s]+)\)", page.read_text(encoding="utf-8")):
        if "://" in target:
            continue
        name, _, anchor = target.partition("#")
        file = (page.parent / name).resolve() if name else page
        assert file.exists(), target
        if anchor:
            headings = re.findall(r"^#+ (.*)$", file.read_text(encoding="utf-8"), re.MULTILINE)
            assert anchor in {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}, target


def test_the_index_lists_every_page() -> None:
    listed = set(re.findall(r"\]\(([\w/]+)\.(?:md|rst)\)", (ROOT / "docs" / "index.md").read_text(encoding="utf-8")))
    reference = {f"reference/{page.stem}" for page in (ROOT / "docs" / "reference").glob("*.rst")}
    assert listed == set(NAMES.values()) - {"index", *OF_THE_PROJECT} | reference


# The last commit with the README of 1,015 lines.
FIRST_README = "0f9412ea7225952c8e68381541717c8e83880848"


def test_every_section_of_the_first_readme_has_a_page() -> None:
    """In the order of the README; that the pages are there is a test of all links."""
    shown = subprocess.run(["git", "show", f"{FIRST_README}:README.md"], cwd=ROOT, capture_output=True, text=True, check=False)
    if shown.returncode:
        pytest.skip("no history with the first README")
    outside_code = re.sub(r"^```.*?^```$", "", shown.stdout, flags=re.DOTALL | re.MULTILINE)
    rows = re.findall(r"^\| (.+?) \| (.+) \|$", (ROOT / "docs" / "old_readme.md").read_text(encoding="utf-8"), re.MULTILINE)[2:]
    assert [section.strip("`") for section, _ in rows] == re.findall(r"^#+ (.+)$", outside_code, re.MULTILINE)
    assert all("](" in pages for _, pages in rows)


def test_the_table_of_derivatives_is_the_stored_result() -> None:
    """Operations, times and ratios of docs/derivatives.md, row by row."""
    page = (ROOT / "docs" / "derivatives.md").read_text(encoding="utf-8")
    stored = json.loads((ROOT / "docs" / "measured" / "peers_of_derivatives.json").read_text(encoding="utf-8"))["lines"]
    expected = []
    for line in stored[1:]:
        if len(cells := line.split()) > 12 and cells[1] == "embedding":
            model, _, *operations, ns, casadi, _, _, _, ratio, times = cells[:12]
            executed = " / ".join(f"{int(count):,}" for count in operations)
            expected.append(f"| {model} | {executed} | {int(casadi):,} | {int(ns):,} ns | {ratio} | {times} |")
    assert len(expected) == 4
    assert [row for row in expected if row not in page] == []


def test_errors_against_tolerances_are_the_stored_ones() -> None:
    """The table of docs/choosing_a_method.md, and the factors between error and tolerance that its text has."""
    page = (ROOT / "docs" / "choosing_a_method.md").read_text(encoding="utf-8")
    head, *rows = [re.split(r"\s{2,}", line) for line in json.loads(
        (ROOT / "docs" / "measured" / "tolerance.json").read_text(encoding="utf-8"))["lines"]]
    errors = {f"{name}, {after}": dict(zip(map(float, head[2:]), row, strict=True)) for name, after, *row in rows}
    shown = re.findall(r"^\| (\w+, \d+ s) \| (.+) \|$", page, re.MULTILINE)
    assert len(shown) == 4
    for name, cells in shown:
        assert cells.split(" | ") == [errors[name][tolerance] for tolerance in (1e-3, 1e-6, 1e-9, 1e-12)], name
    factors = {name: [float(error) / tolerance for tolerance, error in row.items()] for name, row in errors.items()}
    for name in ("pendulum, 10 s", "car_axis, 3 s"):
        assert min(factors[name]) > 3 and max(factors[name]) < 50
    assert max(factors["double_pendulum, 2 s"]) < 1.45
    assert min(factors["double_pendulum, 10 s"][5:10]) > 1e4 and max(factors["double_pendulum, 10 s"][5:10]) < 4e4
    assert min(float(error) for tolerance, error in errors["n_link_pendulum(5), 10 s"].items() if tolerance >= 1e-8) > 0.5
    assert errors["n_link_pendulum(5), 10 s"][1e-12] == "2.0e-04"


def stored(name: str) -> list[str]:
    """The lines of a stored result."""
    found: list[str] = json.loads((ROOT / "docs" / "measured" / f"{name}.json").read_text(encoding="utf-8"))["lines"]
    return found


def test_how_much_longer_numpy_takes_is_stored() -> None:
    """The least and the largest ratio of docs/choosing_a_method.md."""
    ratios = sorted(int(line.split()[-1]) for line in stored("backends")[1:])
    page = (ROOT / "docs" / "choosing_a_method.md").read_text(encoding="utf-8")
    assert f"takes {ratios[0]} to {ratios[-1]} times as long with NumPy" in page


def test_predictions_of_sweeps_are_the_stored_ones() -> None:
    """The table of docs/clusters.md, and what its text says of memory."""
    page = (ROOT / "docs" / "clusters.md").read_text(encoding="utf-8")
    _, *sweeps, _, merged = stored("predictions")
    names = "double pendulums", "four-bar linkages", "pendulums of four links, with Parquet"
    for line, name in zip(sweeps, names, strict=True):
        cells = re.findall(r"[\d.]+", line)
        core, wall, result, memory = (f"{a} and {b}" for a, b in zip(cells[1::2], cells[2::2], strict=True))
        assert f"| {int(cells[0]):,} {name} | {core} s | {wall} s | {result} MB | {memory} MB |" in page
    taken = dict(re.findall(r"(\w+) ([\d.]+ s and \d+ MB)", merged))
    assert all(taken[kind] in page.replace("\n", " ") for kind in ("npz", "parquet", "zarr"))


def test_work_of_contacts_is_stored() -> None:
    """Errors and times of docs/contact.md, to the digits that it shows."""
    page = (ROOT / "docs" / "contact.md").read_text(encoding="utf-8")
    programs = ("symdyn, switches located", "symdyn, time stepping", "MuJoCo", "Exudyn")
    points: dict[tuple[str, str], set[str]] = {}
    for line in stored("contacts"):
        if len(cells := re.split(r"\s{2,}", line.strip())) == 5 and cells[1] in programs:
            error, ms = float(cells[3]), float(f"{float(cells[4]):.2g}")
            points.setdefault((cells[0], cells[1]), set()).add(f"{error:.0e} in {ms:g} ms".replace("e-0", "e-"))
    rows = {name: re.search(rf"^\| {name}.* \|$", page, re.MULTILINE) for name in ("ball that", "oscillator with", "billiard")}
    shown = 0
    for name, row in rows.items():
        assert row is not None
        for program, cell in zip(programs, row[0].split("|")[2:6], strict=True):
            for point in re.findall(r"\S+ in \S+ ms", cell):
                assert point in points[name.split()[0], program], (name, program, point)
                shown += 1
    assert shown == 17


def texts_of(module: Path) -> Iterator[str]:
    """The texts in a module's code, values within them as "..."."""
    for node in ast.walk(ast.parse(module.read_text(encoding="utf-8"))):
        if isinstance(node, ast.JoinedStr):
            yield "".join(str(part.value) if isinstance(part, ast.Constant) else "..." for part in node.values)
        elif isinstance(node, ast.Constant) and isinstance(node.value, str):
            yield node.value


def unknown_messages(page: str, texts: list[str]) -> list[str]:
    """Those in the first column of a page's tables that no text has with all of their parts between "..."."""
    quoted = [message for row in re.findall(r"^\| (`.+?`) \|", page, re.MULTILINE) for message in re.findall("`([^`]+)`", row)]
    assert quoted
    parts = {message: [part for piece in message.split("...") if (part := piece.strip(" ;:,."))] for message in quoted}
    return [message for message, needed in parts.items() if not any(all(part in text for part in needed) for text in texts)]


def test_messages_are_those_of_the_code() -> None:
    texts = [text for module in sorted((ROOT / "symdyn").rglob("*.py")) for text in texts_of(module)]
    page = (ROOT / "docs" / "messages.md").read_text(encoding="utf-8")
    assert unknown_messages(page, texts) == []
    assert unknown_messages("| `the sky ... green` | x |\n| `a joint ... is` | y |", ["a joint x is"]) == ["the sky ... green"]


def test_every_extra_is_on_the_page_of_installation() -> None:
    extras = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["optional-dependencies"]
    page = (ROOT / "docs" / "installation.md").read_text(encoding="utf-8")
    rows = "".join(re.findall(r"^\| (`.+?) \|", page, re.MULTILINE))
    assert {name for name in extras if f"`{name}`" not in rows} == set()
