"""Pages of the site with a page that turns and moves."""

from __future__ import annotations

from html import escape


def frame(page: str, title: str) -> str:
    """HTML with the page of a view, of the static files of the site, from a page one folder below its root; and a link to it."""
    address = f"../_static/{page}"
    return (f'<iframe class="view" src="{address}#play" loading="lazy" title="{escape(title)}"></iframe>\n'
            f'<p><a href="{address}">The view by itself</a></p>')
