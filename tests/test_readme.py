"""What the README shows is what happens."""

import re
import subprocess
import sys
from pathlib import Path

README = (Path(__file__).parent.parent / "README.md").read_text(encoding="utf-8")


def block(mark: str) -> str:
    found = re.search(rf"<!-- {mark} -->\n```\w*\n(.*?)```", README, re.DOTALL)
    assert found, f"the README has no block marked {mark}"
    return found.group(1)


def test_example_prints_what_is_shown(tmp_path):
    run = subprocess.run([sys.executable, "-c", block("example")], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stderr
    assert run.stdout == block("printed")
    assert (tmp_path / "crane.png").stat().st_size > 10_000


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


def test_all_snippets_run_one_after_the_other(tmp_path):
    code = "\n".join(re.findall(r"```python\n(.*?)```", README, re.DOTALL))
    run = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stderr
    assert run.stdout.endswith(block("base parameters"))


def test_example_is_short():
    statements = [line for line in block("example").splitlines() if line.strip()]
    assert len(statements) <= 20


def test_linked_files_exist():
    for target in re.findall(r"\]\(([^)#:]+)\)", README):
        assert (Path(__file__).parent.parent / target).exists(), target
