"""What the README shows is what happens."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

README = (Path(__file__).parent.parent / "README.md").read_text(encoding="utf-8")


def block(mark: str) -> str:
    found = re.search(rf"<!-- {mark} -->\n```\w*\n(.*?)```", README, re.DOTALL)
    assert found, f"the README has no block marked {mark}"
    return found.group(1)


@pytest.fixture(scope="module")
def printed(tmp_path_factory):
    """All snippets run one after the other, in one process: the folder, and what each has printed."""
    snippets = re.findall(r"```python\n(.*?)```", README, re.DOTALL)
    end = "-- end of a snippet --"
    folder = tmp_path_factory.mktemp("readme")
    code = f"print({end!r})\n".join(snippets)
    run = subprocess.run([sys.executable, "-c", code], cwd=folder, capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stderr
    outputs = run.stdout.split(f"{end}\n")
    assert len(outputs) == len(snippets)
    return folder, list(zip(snippets, outputs))


def test_example_prints_what_is_shown(printed):
    folder, ((snippet, output), *_) = printed
    assert snippet == block("example")
    assert output == block("printed")
    assert (folder / "crane.png").stat().st_size > 10_000


def test_closed_loop_prints_what_is_shown(tmp_path):
    run = subprocess.run([sys.executable, "-c", block("loop")], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stderr
    assert "Warning" not in run.stderr
    assert run.stdout == block("loop printed")


def test_pontoon_prints_what_is_shown(tmp_path):
    run = subprocess.run([sys.executable, "-c", block("floating")], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stderr
    assert "Warning" not in run.stderr
    assert run.stdout == block("floating printed")


def test_all_snippets_run_one_after_the_other(printed):
    _, outputs = printed
    assert outputs[-1][1].endswith(block("base parameters"))
    assert dict(outputs)[block("loop")] == block("loop printed")


def test_example_is_short():
    statements = [line for line in block("example").splitlines() if line.strip()]
    assert len(statements) <= 20


def test_linked_files_exist():
    for target in re.findall(r"\]\(([^)#:]+)\)", README):
        assert (Path(__file__).parent.parent / target).exists(), target
