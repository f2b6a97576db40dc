"""The tutorials as pages: the notebooks' text and code, with the outputs of one run, which are kept in notebooks/results.

python docs/extensions/tutorials.py [NAME ...] runs notebooks and keeps what they show.
"""

from __future__ import annotations

import hashlib
import io
import json
import re
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import jupytext
from sphinx.application import Sphinx

ROOT = Path(__file__).parents[2]
NOTEBOOKS, PAGES = ROOT / "notebooks", ROOT / "docs" / "tutorials"
RESULTS = NOTEBOOKS / "results"
# Pages have an ending of their own: what stands in .md files is written by hand.
ENDING = ".myst"
# Colours of kept pictures, lines of text that a page shows, seconds that a cell may take.
COLORS, LINES, LIMIT = 64, 60, 300


def digest(code: str) -> str:
    return hashlib.sha256(code.encode()).hexdigest()[:16]


def sources() -> list[Path]:
    return sorted(NOTEBOOKS.glob("*.py"))


def kept(name: str) -> list[dict[str, Any]]:
    """What the code cells of a notebook showed, in order: the digest of their code, and their outputs."""
    file = RESULTS / f"{name}.json"
    found: list[dict[str, Any]] = json.loads(file.read_text(encoding="utf-8")) if file.exists() else []
    return found


def page_of(source: Path) -> str:
    """The page of a notebook as Markdown; outputs are left out where the code is another one than that which was run."""
    shown = {cell["code"]: cell["outputs"] for cell in kept(source.stem)}
    parts = []
    for cell in jupytext.read(source).cells:
        if cell.cell_type == "markdown":
            text = cell.source.replace("](../docs/", "](../")
            parts.append(re.sub(r"\]\((\w+)\.ipynb\)", rf"](\1{ENDING})", text))
            continue
        parts.append(f"```python\n{cell.source}\n```")
        parts += [block_of(output) for output in shown.get(digest(cell.source), ())]
    note = (f"The notebook of this page is {{download}}`{source.stem}.ipynb <../../notebooks/{source.stem}.ipynb>`. "
            "The outputs below the code are those of one run.")
    title, _, rest = "\n\n".join(parts).partition("\n")
    return f"{title}\n\n{note}\n{rest}\n"


def block_of(output: dict[str, str]) -> str:
    if "image" in output:
        return f"![{output['text']}](../../notebooks/results/{output['image']})"
    if "latex" in output:
        return f"$$\n{output['latex']}\n$$"
    if re.fullmatch(r"View\(.*\)", output["text"]):
        return "*A notebook shows a page here that turns, zooms and plays; the [gallery](../gallery.md) has such pages.*"
    return f"```text\n{output['text']}\n```"


def make(app: Sphinx, config: object = None) -> None:
    """Write all pages that are not there as they should be."""
    PAGES.mkdir(exist_ok=True)
    wanted = {PAGES / f"{source.stem}{ENDING}": page_of(source) for source in sources()}
    for page, text in wanted.items():
        if not page.exists() or page.read_text(encoding="utf-8") != text:
            page.write_text(text, encoding="utf-8")
    for page in set(PAGES.glob(f"*{ENDING}")) - set(wanted):
        page.unlink()


def link(app: Sphinx, page: str, source: list[str]) -> None:
    """Links to notebooks lead to their pages; the page of all tutorials has them in its table of contents, in its order."""
    if page.startswith("tutorials/"):
        return
    up = "../" * page.count("/")
    listed = list(dict.fromkeys(re.findall(r"notebooks/(\w+)\.ipynb", source[0])))
    source[0] = re.sub(r"\]\((?:\.\./)+notebooks/(\w+)\.ipynb\)", rf"]({up}tutorials/\1{ENDING})", source[0])
    if page == "tutorials":
        names = "\n".join(f"tutorials/{name}" for name in listed)
        source[0] += f"\n```{{toctree}}\n:hidden:\n\n{names}\n```\n"


def run(name: str) -> None:
    """Run a notebook and keep what its cells show."""
    from nbclient import NotebookClient

    notebook = jupytext.read(NOTEBOOKS / f"{name}.py")
    NotebookClient(notebook, timeout=LIMIT, kernel_name="python3", resources={"metadata": {"path": str(NOTEBOOKS)}}).execute()
    RESULTS.mkdir(exist_ok=True)
    for old in RESULTS.glob(f"{name}_*.png"):
        old.unlink()
    cells, pictures = [], 0
    for cell in notebook.cells:
        if cell.cell_type != "code":
            continue
        outputs: list[dict[str, str]] = []
        for data in shown_by(cell.outputs):
            if "image/png" in data:
                pictures += 1
                image = f"{name}_{pictures}.png"
                (RESULTS / image).write_bytes(small(data["image/png"]))
                outputs.append({"image": image, "text": f"picture {pictures} of {name}"})
            elif "text/latex" in data:
                outputs.append({"latex": data["text/latex"].strip().strip("$").strip()})
            elif data.get("text/plain", "").strip():
                lines = data["text/plain"].rstrip().splitlines()
                outputs.append({"text": "\n".join(lines if len(lines) <= LINES else [*lines[:LINES], "..."])})
        cells.append({"code": digest(cell.source), "outputs": outputs})
    (RESULTS / f"{name}.json").write_text(json.dumps(cells, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")


def shown_by(outputs: list[Any]) -> Iterator[dict[str, str]]:
    """What a cell shows, by kinds; what it prints piece by piece is one text."""
    printed = ""
    for output in outputs:
        if output.output_type == "stream":
            printed += output.text if output.name == "stdout" else ""
            continue
        if printed:
            yield {"text/plain": printed}
            printed = ""
        if "data" in output:
            yield dict(output.data)
    if printed:
        yield {"text/plain": printed}


def small(encoded: str) -> bytes:
    """A picture with few colours."""
    import base64

    from PIL import Image

    image = Image.open(io.BytesIO(base64.b64decode(encoded))).convert("RGB").quantize(COLORS, dither=Image.Dither.NONE)
    data = io.BytesIO()
    image.save(data, format="PNG", optimize=True)
    return data.getvalue()


def setup(app: Sphinx) -> dict[str, bool]:
    app.connect("config-inited", make)
    app.connect("source-read", link, priority=400)
    return {"parallel_read_safe": True}


if __name__ == "__main__":
    for chosen in sys.argv[1:] or [one.stem for one in sources()]:
        run(chosen)
        print(chosen, flush=True)
