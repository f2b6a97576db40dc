"""The tutorials as pages: the notebooks' text and code, with the outputs of one run, which are kept in notebooks/results.

python docs/extensions/tutorials.py [NAME ...] runs notebooks and keeps what they show.
"""

from __future__ import annotations

import base64
import hashlib
import io
import json
import re
import sys
from collections.abc import Iterator
from html import unescape
from pathlib import Path
from typing import Any

import jupytext
from sphinx.application import Sphinx
from views import frame

from symdyn.viewer.page import page_of as view_of

ROOT = Path(__file__).parents[2]
NOTEBOOKS, PAGES, VIEWS = ROOT / "notebooks", ROOT / "docs" / "tutorials", ROOT / "generated" / "gallery"
RESULTS = NOTEBOOKS / "results"
# Pages have an ending of their own: what stands in .md files is written by hand.
ENDING = ".myst"
# Beginning of the HTML of a mechanism, module or motion; that of other results is for notebooks, with formulas as TeX.
TABLES = "<div><b>"
# Colours of kept pictures, lines of text that a page shows, seconds that a cell may take.
COLORS, LINES, LIMIT = 64, 60, 300


def digest(code: str) -> str:
    return hashlib.sha256(code.encode()).hexdigest()[:16]


def sources() -> list[Path]:
    return sorted(NOTEBOOKS.glob("*.py"))


def kept(name: str) -> list[dict[str, Any]]:
    """Outputs of the code cells of a notebook, in order: the digest of their code, and their outputs."""
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
    if "view" in output:
        return frame(f"{output['view']}.html", output["text"])
    if "html" in output:
        return f"```{{raw}} html\n<div class=\"shown\">{output['html']}</div>\n```"
    return f"```text\n{output['text']}\n```"


def make(app: Sphinx, config: object = None) -> None:
    """Write all pages that are not there as they should be, and their views with what the package draws them by now."""
    for folder in (PAGES, VIEWS):
        folder.mkdir(parents=True, exist_ok=True)
    wanted = {PAGES / f"{source.stem}{ENDING}": page_of(source) for source in sources()}
    for file in RESULTS.glob("*_view_*.json"):
        view = json.loads(file.read_text(encoding="utf-8"))
        wanted[VIEWS / f"{file.stem}.html"] = view_of(view["name"], view["data"], view["functions"], None).html
    for page, text in wanted.items():
        if not page.exists() or page.read_text(encoding="utf-8") != text:
            page.write_text(text, encoding="utf-8")
    for page in {*PAGES.glob(f"*{ENDING}"), *VIEWS.glob("*_view_*.html")} - set(wanted):
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
    for old in (*RESULTS.glob(f"{name}_*.png"), *RESULTS.glob(f"{name}_*.gif"), *RESULTS.glob(f"{name}_view_*.json")):
        old.unlink()
    cells, pictures, views = [], 0, 0
    for cell in notebook.cells:
        if cell.cell_type != "code":
            continue
        outputs: list[dict[str, str]] = []
        for data in shown_by(cell.outputs):
            if view := data_of_view(data.get("text/html", "")):
                views += 1
                file = f"{name}_view_{views}"
                (RESULTS / f"{file}.json").write_text(json.dumps(view, ensure_ascii=False) + "\n", encoding="utf-8")
                outputs.append({"view": file, "text": f"{view['name']}: a view that turns, zooms and moves"})
            elif image := data.get("image/png", data.get("image/gif")):
                pictures += 1
                kind = "png" if "image/png" in data else "gif"
                file = f"{name}_{pictures}.{kind}"
                (RESULTS / file).write_bytes(small(image) if kind == "png" else base64.b64decode(image))
                outputs.append({"image": file, "text": f"picture {pictures} of {name}"})
            elif "text/latex" in data:
                outputs.append({"latex": data["text/latex"].strip().strip("$").strip()})
            elif data.get("text/html", "").startswith(TABLES):
                outputs.append({"html": data["text/html"]})
            elif data.get("text/plain", "").strip():
                lines = data["text/plain"].rstrip().splitlines()
                outputs.append({"text": "\n".join(lines if len(lines) <= LINES else [*lines[:LINES], "..."])})
        cells.append({"code": digest(cell.source), "outputs": outputs})
    (RESULTS / f"{name}.json").write_text(json.dumps(cells, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")


def shown_by(outputs: list[Any]) -> Iterator[dict[str, str]]:
    """Output of a cell, by kinds; text that it prints piece by piece is one."""
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


def data_of_view(shown: str) -> dict[str, Any] | None:
    """The name, the data and the functions of a view that a notebook shows; None where it shows something else."""
    if not shown.startswith("<iframe srcdoc="):
        return None
    page = unescape(shown)
    scripts = re.findall(r"<script[^>]*>\n?(.*?)\n?</script>", page, re.DOTALL)
    title = re.search("<title>(.*?)</title>", page)
    assert title is not None and len(scripts) == 3, "the page of a view has three scripts: data, functions, what draws them"
    return {"name": unescape(title[1]), "data": json.loads(scripts[0]), "functions": scripts[1]}


def small(encoded: str) -> bytes:
    """A picture with few colours."""
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
