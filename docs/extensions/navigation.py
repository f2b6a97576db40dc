"""The navigation beside every page is made of titles alone.

It shows no headings within pages and no entries of the reference, but Sphinx copies them for it again for each page, which took
a seventh of the time of the site.
"""

from __future__ import annotations

import functools
from typing import Any

from docutils import nodes
from sphinx import addnodes
from sphinx.application import Sphinx
from sphinx.environment import BuildEnvironment

BEFORE_THE_THEME = 400


@functools.cache
def titles(env: BuildEnvironment) -> dict[str, nodes.bullet_list]:
    """Contents of every page as Sphinx leaves them where titles are asked for: the title, and tables of contents below it."""
    kept = {page: contents.deepcopy() for page, contents in env.tocs.items()}
    for contents in kept.values():
        for item in contents:
            if len(item) > 1:
                tables = list(item.findall(addnodes.toctree))
                if tables:
                    item[1][:] = tables
                else:
                    item.pop(1)
    return kept


def shorten(app: Sphinx, page: str, template: str, context: dict[str, Any], doctree: object) -> None:
    """Let the theme's table of contents be made of titles, where it asks for titles."""
    made = context.get("toctree")
    if made is None:
        return

    def toctree(**options: Any) -> str:
        if not options.get("titles_only"):
            return str(made(**options))
        whole, app.env.tocs = app.env.tocs, titles(app.env)
        try:
            return str(made(**options))
        finally:
            app.env.tocs = whole

    context["toctree"] = toctree


def setup(app: Sphinx) -> dict[str, bool]:
    app.connect("html-page-context", shorten, BEFORE_THE_THEME)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
