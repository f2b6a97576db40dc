"""Code in the README runs as shown."""

import json
import re
import shlex
import warnings
from pathlib import Path

import symdyn as sd
from symdyn.cli import main
from tests.test_examples import PUBLIC

ROOT = Path(__file__).parent.parent
README = (ROOT / "README.md").read_text(encoding="utf-8")
COMMAND_LINE = (ROOT / "docs" / "command_line.md").read_text(encoding="utf-8")


def block(mark: str, text: str = README) -> str:
    found = re.search(rf"<!-- {mark} -->\n```\w*\n(.*?)```", text, re.DOTALL)
    assert found, f"there is no block marked {mark}"
    return found.group(1)


def test_example_prints_what_is_shown(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        exec(compile(block("example"), "README.md", "exec"), {})
    assert capsys.readouterr() == (block("printed"), "")
    assert (tmp_path / "crane.png").stat().st_size > 10_000


def test_mechanism_in_a_file_is_measured(tmp_path, monkeypatch, capsys):
    """The commands as they are shown, but for options that leave most of the work out."""
    (tmp_path / "my_mechanism.py").write_text(block("own file", COMMAND_LINE), encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("SYMDYN_CACHE_DIR", str(tmp_path / "cache"))
    less = {"bench": ["--methods", "dop853", "--rtol", "1e-6", "--repeats", "1"], "stress": ["--short"],
            "report": ["--budget", "1", "--no-verify"]}
    said = {}
    for line in block("own file commands", COMMAND_LINE).splitlines():
        words = shlex.split(line, comments=True)
        assert words[0] == "symdyn"
        assert main([*words[1:], *less[words[1]]]) == 0, line
        said[words[1]] = capsys.readouterr().out
    assert set(said) == set(less)
    page = Path("generated/my_mechanism/report.html").read_text(encoding="utf-8")
    assert "swing" in page and Path("generated/bench/my_mechanism/report.html").is_file()
    # It swings, so that there are errors to compare and energy that goes back and forth.
    rows = json.loads(Path("generated/bench/my_mechanism/results.json").read_text(encoding="utf-8"))["rows"]
    assert rows and all(1e-16 < row["error"] < 1e-3 for row in rows)
    assert re.search(r"\d+ rows: \d+ pass, \d+ degrade, 0 fail", said["stress"])


def test_example_is_short():
    statements = [line for line in block("example").splitlines() if line.strip()]
    assert len(statements) <= 20


def test_readme_is_short():
    assert len(README.splitlines()) <= 150


# Figures of the README that are rounded: the stored result, the begin of the line, which of the words after it, and what makes
# the same unit of it.
ROUNDED = {
    "0.16": ("figures", "spatial_chain(7): one compiled evaluation ", 0, 1.0),
    "0.39": ("figures", "double_pendulum: 10 s inside the integrator ", 0, 1.0),
    "5e-12": ("figures", "puma560: energy error over 10 s of free motion, rtol 1e-11 ", 0, 1.0),
    "0.039": ("batch", "spatial_chain(7): a state among many ", 0, 1e-3),
    "0.45": ("peers", "spatial_chain(7) ", 12, 1.0),
    "13": ("peers", "spatial_chain(7) ", 13, 1.0),
}


def stored(name):
    return json.loads((ROOT / "docs" / "measured" / f"{name}.json").read_text(encoding="utf-8"))


def test_figures_are_those_of_their_pages():
    """Every number of the tables of comparison, speed and accuracy stands on a page or in a stored result that has the command
    for it, or is rounded from one."""
    pages = "\n".join((ROOT / "docs" / f"{name}.md").read_text(encoding="utf-8")
                      for name in ("work_against_error", "firmware", "from_sympy", "contact", "measured"))
    pages += "\n".join(" ".join(row) for row in stored("robots")["rows"])
    pages += "\n".join(f"{float(word):,.0f}" for word in re.findall(r"\b\d{4,}\b", " ".join(stored("comparison")["lines"])))
    table = README.partition("## How it compares")[2].partition("## License")[0]
    rows = [row for row in re.findall(r"^\| (.+) \|$", re.sub(r"\]\([^)]*\)", "]", table), re.MULTILINE) if re.search(r"\d", row)]
    numbers = {number for row in rows for number in re.findall(r"(?<![\w.])\d[\d,]*(?:\.\d+)?(?:e-?\d+)?", row)}
    assert len(rows) == 11 and len(numbers) > 20
    assert {number for number in numbers - set(ROUNDED) if not re.search(
        rf"(?<![\d.,]){re.escape(number)}(?![\d.])", pages)} == set()


def test_rounded_figures_are_the_stored_ones():
    for shown, (name, begin, word, factor) in ROUNDED.items():
        (line,) = [line for line in stored(name)["lines"] if line.startswith(begin)]
        value = factor * float(line.removeprefix(begin).split()[word])
        digits = len(shown.partition("e")[0].replace(".", "").lstrip("0"))
        assert shown in README and float(shown) == float(f"{value:.{digits}g}"), (shown, line)


def test_stored_results_are_of_what_is_there():
    """Each has a command of the page, a day and a machine; the counts of the reference are those of now."""
    page = "".join((ROOT / "docs" / f"{name}.md").read_text(encoding="utf-8") for name in ("measured", "index"))
    used = set(re.findall(r"```\{measured\} (\w+)", page))
    assert used == {file.stem for file in (ROOT / "docs" / "measured").glob("*.json")}
    for name in used:
        result = stored(name)
        assert re.fullmatch(r"\d{4}-\d\d-\d\d", result["date"]) and result["machine"] and result.get("lines", result.get("rows"))
        assert result["command"].startswith(("symdyn ", "python tests/checks/", "python docs/extensions/"))
    (of_names, names), (of_entries, entries) = [
        map(int, re.match(r"(\d+) of (\d+)", line).groups()) for line in stored("reference")["lines"][:2]]
    called = [name for name, thing in PUBLIC.items() if not (isinstance(thing, type) and issubclass(thing, BaseException))]
    records = [PUBLIC[name] for name in called if name.endswith((".AxisAngle", ".Lock", ".ForceSystem"))]
    fields = [field for record in records for field in record._fields]
    assert of_names == names == len(sd.__all__), "run docs/extensions/measured.py reference"
    assert of_entries == entries == len(called) + len(fields), "run docs/extensions/measured.py reference"
