"""The gallery: a page for each mechanism of the catalogue, and a grid of their pictures.

Pages are made before the site is read, and kept until the package or the text that makes them changes. SYMDYN_GALLERY, names of
mechanisms, makes a site with these alone.
"""

from __future__ import annotations

import hashlib
import os
import subprocess
import sys
from html import escape
from pathlib import Path

from docutils import nodes
from mechanisms import summary
from sphinx.application import Sphinx
from sphinx.errors import ExtensionError
from sphinx.util.docutils import SphinxDirective

import symdyn as sd

ROOT = Path(__file__).parents[2]
PAGES, VIEWS = ROOT / "docs" / "gallery", ROOT / "generated" / "gallery"
# Processes that make pages.
AT_ONCE = min(os.cpu_count() or 1, 4)


def shown() -> list[str]:
    """Names of the mechanisms that have pages."""
    wanted = os.environ.get("SYMDYN_GALLERY", "").split()
    return [name for name in sd.systems.names() if not wanted or name in wanted]


def fingerprint() -> str:
    """Fingerprint of all that the pages are made from."""
    files = [Path(__file__).with_name("mechanisms.py"), *sorted((ROOT / "symdyn").rglob("*.py")),
             *sorted(file for file in (ROOT / "templates").rglob("*") if file.is_file())]
    return hashlib.sha256(b"\0".join([*map(str.encode, shown()), *(file.read_bytes() for file in files)])).hexdigest()


def make(app: Sphinx, config: object = None) -> None:
    """Make the pages of all mechanisms, several at once; none where all are kept."""
    kept, now, names = PAGES / "made_from", fingerprint(), shown()
    if kept.exists() and kept.read_text(encoding="utf-8") == now:
        return
    for folder in (PAGES, VIEWS):
        folder.mkdir(parents=True, exist_ok=True)
    command = [sys.executable, str(Path(__file__).with_name("mechanisms.py")), str(PAGES), str(VIEWS)]
    workers = [subprocess.Popen([*command, *names[k::AT_ONCE]], cwd=ROOT) for k in range(AT_ONCE)]
    ended = [worker.wait() for worker in workers]
    if any(ended):
        raise ExtensionError("pages of the gallery could not be made; the lines above say why")
    for page in PAGES.glob("*.rst"):
        if page.stem not in names:
            page.unlink()
    kept.write_text(now, encoding="utf-8")


class Gallery(SphinxDirective):
    """Pictures of mechanisms that lead to their pages: `trees`, `constrained`, `floating` or `touching`."""

    required_arguments = 1

    def run(self) -> list[nodes.Node]:
        trees, constrained = sd.systems.names(False), sd.systems.names(True)
        others = [name for name in shown() if name not in (*trees, *constrained)]
        touching = [name for name in others if sd.systems.get(name).contacts]
        groups = {"trees": [name for name in trees if name in shown()],
                  "constrained": [name for name in constrained if name in shown()],
                  "touching": touching, "floating": [name for name in others if name not in touching]}
        cards = "".join(
            f'<a href="gallery/{name}.html"><img src="_static/{name}.svg" alt="{name}" width="260" height="200" loading="lazy">'
            f"<b>{name.replace('_', '_<wbr>')}</b><span>{escape(summary(name))}</span></a>" for name in groups[self.arguments[0]])
        contents = nodes.raw("", f'<div class="gallery">{cards}</div>', format="html")
        return [contents, *self.parse_text_to_nodes(
            "\n".join(["```{toctree}", ":hidden:", "", *[f"gallery/{name}" for name in groups[self.arguments[0]]], "```"]))]


def setup(app: Sphinx) -> dict[str, bool]:
    app.connect("config-inited", make)
    app.add_directive("gallery", Gallery)
    return {"parallel_read_safe": True}
