"""What the README shows is what happens."""

import json
import re
import shlex
import subprocess
import sys
from pathlib import Path

from symdyn.cli import main

ROOT = Path(__file__).parent.parent
README = (ROOT / "README.md").read_text(encoding="utf-8")
COMMAND_LINE = (ROOT / "docs" / "command_line.md").read_text(encoding="utf-8")


def block(mark: str, text: str = README) -> str:
    found = re.search(rf"<!-- {mark} -->\n```\w*\n(.*?)```", text, re.DOTALL)
    assert found, f"there is no block marked {mark}"
    return found.group(1)


def test_example_prints_what_is_shown(tmp_path):
    run = subprocess.run([sys.executable, "-c", block("example")], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stderr
    assert "Warning" not in run.stderr
    assert run.stdout == block("printed")
    assert (tmp_path / "crane.png").stat().st_size > 10_000


def test_mechanism_in_a_file_is_measured(tmp_path, monkeypatch, capsys):
    """The commands as they are shown, but for options that leave most of the work out."""
    (tmp_path / "my_mechanism.py").write_text(block("own file", COMMAND_LINE), encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("SYMDYN_CACHE_DIR", str(tmp_path / "cache"))
    less = {"bench": ["--methods", "dop853", "--rtol", "1e-6", "1e-9", "--repeats", "1"], "stress": ["--short"],
            "report": ["--budget", "5", "--no-verify"]}
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


def test_figures_are_those_of_their_pages():
    """Every number of the table of speed and accuracy stands on a page that has the command for it."""
    table = README.partition("## How fast, how accurate")[2].partition("## License")[0]
    rows = [row for row in re.findall(r"^\| (.+) \|$", table, re.MULTILINE) if re.search(r"\d", row)]
    pages = "\n".join((ROOT / "docs" / f"{name}.md").read_text(encoding="utf-8")
                      for name in ("measured", "work_against_error", "firmware"))
    numbers = {number for row in rows for number in re.findall(r"(?<![\w.])\d[\d,]*(?:\.\d+)?(?:e-?\d+)?", row)}
    assert len(rows) == 8 and len(numbers) > 15
    assert {number for number in numbers if not re.search(rf"(?<![\d.,]){re.escape(number)}(?![\d.])", pages)} == set()
