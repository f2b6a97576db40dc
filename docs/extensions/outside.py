"""Files of the pages outside of their folder, and the table of contents, which is read off the index page.

Links to other files become files to download. The pages `contributing` and `changes` get the text of the files that they name.
Every heading of the index page becomes a part of the site's table of contents, with the pages that are linked below it.
"""

from __future__ import annotations

import re
from pathlib import Path

from sphinx.application import Sphinx

ROOT = Path(__file__).parents[2]
TEXTS = {"contributing": "CONTRIBUTING.md", "changes": "CHANGELOG.md"}
OUTSIDE = re.compile(r"(?<!!)\[([^\]]+)\]\((\.\./[^)\s]+)\)")
PAGE = re.compile(r"\]\(((?:\.\./)?[\w/]+)\.(?:md|rst)\)")


def linked(text: str, folder: Path) -> str:
    """The text of a page in a folder with links that lead to pages of the site, or to files to download."""
    def target(link: re.Match[str]) -> str:
        label, path = link[1], link[2]
        file = (folder / path.partition("#")[0]).resolve()
        if file.is_relative_to(ROOT / "docs"):
            return link[0]
        page = next((page for page, name in TEXTS.items() if file == ROOT / name), None)
        return f"[{label}]({page}.md)" if page else f"{{download}}`{label} <{path}>`"

    return OUTSIDE.sub(target, text)


def contents(text: str) -> str:
    """A hidden table of contents for each heading of the index page."""
    result = []
    for part in re.split(r"^## ", text, flags=re.MULTILINE)[1:]:
        caption = part.splitlines()[0]
        names = {f"../{Path(file).stem}": page for page, file in TEXTS.items()}
        pages = [names.get(path, path) for path in PAGE.findall(part)]
        result.append("\n".join(["```{toctree}", ":hidden:", f":caption: {caption}", "", *pages, "```", ""]))
    return "\n".join(result)


def replace(app: Sphinx, page: str, source: list[str]) -> None:
    """Replaces the text of a page."""
    if page in TEXTS:
        source[0] = (ROOT / TEXTS[page]).read_text(encoding="utf-8").replace("](docs/", "](")
    if page == "index":
        source[0] += "\n" + contents(source[0])
    source[0] = linked(source[0], (ROOT / "docs" / page).parent)


def setup(app: Sphinx) -> dict[str, bool]:
    app.connect("source-read", replace)
    return {"parallel_read_safe": True}
