"""Short cells of tables stay on one line: numbers with units and exponents would be broken where a column is narrow."""

from __future__ import annotations

from docutils import nodes
from sphinx.application import Sphinx

# Characters of a short cell.
SHORT = 16


def mark(app: Sphinx, tree: nodes.document) -> None:
    """Give short cells the class `short`."""
    for cell in tree.findall(nodes.entry):
        if len(cell.astext()) <= SHORT:
            cell["classes"].append("short")


def setup(app: Sphinx) -> dict[str, bool]:
    app.connect("doctree-read", mark)
    return {"parallel_read_safe": True}
