"""Statements of a release about itself in several places agree."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

import symdyn as sd

ROOT = Path(__file__).parents[1]
WORKFLOW = (ROOT / ".github" / "workflows" / "test.yml").read_text(encoding="utf-8")


def test_versions_agree() -> None:
    citation = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    heading = re.search(r"^## (\S+)", (ROOT / "CHANGELOG.md").read_text(encoding="utf-8"), re.MULTILINE)
    assert f"\nversion: {sd.__version__}\n" in citation
    assert heading is not None and heading[1] == sd.__version__


def test_licences_agree() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert f"\nlicense: {project['license']}\n" in (ROOT / "CITATION.cff").read_text(encoding="utf-8")


def test_the_workflow_runs_all_supported_versions_on_three_systems() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    versions = re.findall(r'"(3\.\d+)"', WORKFLOW.split("python: [")[1].split("]")[0])
    assert [f">={versions[0]}", "3.14"] == [project["requires-python"], versions[-1]]
    assert versions == [f"3.{minor}" for minor in range(11, 15)]
    assert all(f"{system}-latest" in WORKFLOW for system in ("ubuntu", "macos", "windows"))


def test_files_and_extras_that_are_named_are_there() -> None:
    text = WORKFLOW + (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    named = re.findall(r"tests/[\w/]+\.py", text)
    assert len(named) > 5 and all((ROOT / name).is_file() for name in named)
    extras = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["optional-dependencies"]
    asked = [name for found in re.findall(r"-e '\.\[([\w,]+)\]'", text) for name in found.split(",")]
    assert asked and set(asked) <= set(extras)
