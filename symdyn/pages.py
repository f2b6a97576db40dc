"""Pages that need no network: how they are filled in from frozen records, and how they are written."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape
from pathlib import Path
from typing import Any

from symdyn.errors import ArgumentError
from symdyn.folders import templates_folder
from symdyn.named_records import NamedRecords

# A table with more rows or columns than this stands in a box in which it scrolls.
ROWS = 12


def table(head: Sequence[str], rows: Sequence[Sequence[Any]]) -> str:
    """A table of a notebook's page, HTML."""
    cells = "".join(f"<tr>{''.join(f'<td>{escape(str(cell))}</td>' for cell in row)}</tr>" for row in rows)
    text = (f"<table><thead><tr>{''.join(f'<th>{escape(name)}</th>' for name in head)}</tr></thead>"
            f"<tbody>{cells}</tbody></table>")
    if max(len(rows), len(head)) <= ROWS:
        return text
    return (f'<div tabindex="0" role="region" aria-label="{len(rows)} rows: {escape(head[0])}" '
            f'style="max-height: 26em; max-width: 100%; overflow: auto">{text}</div>')


def titled(thing: object, *tables: str) -> str:
    """HTML of an object in a notebook: its printed form, then tables."""
    return f"<div><b>{escape(repr(thing))}</b>{''.join(tables)}</div>"


def filled(template: str, context: NamedRecords) -> str:
    """An HTML page from a shipped template, in which text is escaped; context: the records that it reads."""
    import jinja2

    environment = jinja2.Environment(loader=jinja2.FileSystemLoader(templates_folder()), undefined=jinja2.StrictUndefined,
                                     trim_blocks=True, lstrip_blocks=True, keep_trailing_newline=True, autoescape=True)
    return environment.get_template(template).render(context.names())


def write_text(path: Path, text: str, what: str) -> Path:
    """Write a page into a folder that is made if absent; what: it is, for messages. Raises ArgumentError where it cannot be."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    except OSError as error:
        raise ArgumentError(f"{what} cannot be written to {path}: {error.strerror}") from None
    return path
