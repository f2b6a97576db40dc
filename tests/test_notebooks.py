"""The notebooks: each .ipynb is made from the .py of the same name, and holds no outputs.

After changing a .py, write the .ipynb again: python tests/test_notebooks.py
"""

from __future__ import annotations

import hashlib
import json
from pathlib import Path
from typing import Any

import jupytext
import nbformat
import pytest

FOLDER = Path(__file__).resolve().parent.parent / "notebooks"
SOURCES = sorted(FOLDER.glob("*.py"))


def notebook(source: Path) -> Any:
    """The notebook of a .py file. The id of a cell is made of its content, so that it stays when other cells change."""
    made = jupytext.read(source)
    made.metadata.jupytext.pop("text_representation", None)
    seen: dict[str, int] = {}
    for cell in made.cells:
        content = f"{cell.cell_type}\n{cell.source}"
        seen[content] = seen.get(content, 0) + 1
        cell.id = hashlib.sha256(f"{seen[content]}\n{content}".encode()).hexdigest()[:12]
    return made


def write(source: Path) -> Path:
    """Write the .ipynb next to the .py."""
    path = source.with_suffix(".ipynb")
    path.write_text(nbformat.writes(notebook(source)) + "\n", encoding="utf-8")
    return path


def test_every_notebook_has_a_source() -> None:
    assert SOURCES
    assert [p.stem for p in sorted(FOLDER.glob("*.ipynb"))] == [p.stem for p in SOURCES]


@pytest.mark.parametrize("source", SOURCES, ids=lambda path: path.stem)
def test_notebook_agrees_with_its_source(source: Path) -> None:
    made = notebook(source)
    kept = nbformat.read(source.with_suffix(".ipynb"), as_version=4)
    nbformat.validate(kept)
    hint = "run python tests/test_notebooks.py"
    assert [(c.cell_type, c.source, c.id) for c in kept.cells] == [(c.cell_type, c.source, c.id) for c in made.cells], hint
    assert kept.metadata.jupytext.formats == made.metadata.jupytext.formats == "ipynb,py:percent", hint
    assert kept.metadata.kernelspec == made.metadata.kernelspec, hint
    assert kept.metadata.kernelspec.name == "python3"


@pytest.mark.parametrize("source", SOURCES, ids=lambda path: path.stem)
def test_notebook_holds_no_outputs(source: Path) -> None:
    kept = nbformat.read(source.with_suffix(".ipynb"), as_version=4)
    for cell in kept.cells:
        if cell.cell_type == "code":
            assert cell.outputs == []
            assert cell.execution_count is None


@pytest.mark.parametrize("source", SOURCES, ids=lambda path: path.stem)
def test_kept_results_belong_to_the_code(source: Path) -> None:
    """Results below the code on the pages were shown by that code, and every picture and view that they name is there."""
    kept = json.loads((FOLDER / "results" / f"{source.stem}.json").read_text(encoding="utf-8"))
    cells = [cell.source for cell in jupytext.read(source).cells if cell.cell_type == "code"]
    codes = [hashlib.sha256(code.encode()).hexdigest()[:16] for code in cells]
    assert [cell["code"] for cell in kept] == codes, f"run python docs/extensions/tutorials.py {source.stem}"
    pictures = {output["image"] for cell in kept for output in cell["outputs"] if "image" in output}
    assert pictures == {path.name for path in (FOLDER / "results").glob(f"{source.stem}_*.*")
                        if path.suffix in (".png", ".gif") and path.stem.removeprefix(f"{source.stem}_").isdigit()}
    texts = [output["text"] for cell in kept for output in cell["outputs"] if "text" in output]
    assert not [text for text in texts if text.startswith(("<IPython", "System("))]
    views = {output["view"] for cell in kept for output in cell["outputs"] if "view" in output}
    assert views == {path.stem for path in (FOLDER / "results").glob(f"{source.stem}_view_*.json")}


if __name__ == "__main__":
    for source in SOURCES:
        print(write(source).name)
