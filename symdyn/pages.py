"""Pages that need no network: the environment of their templates, and how they are written."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from symdyn.errors import ArgumentError
from symdyn.folders import templates_folder

if TYPE_CHECKING:
    import jinja2


def page_environment() -> jinja2.Environment:
    """For the shipped templates of HTML pages; text in them is escaped."""
    import jinja2

    return jinja2.Environment(loader=jinja2.FileSystemLoader(templates_folder()), undefined=jinja2.StrictUndefined,
                              trim_blocks=True, lstrip_blocks=True, keep_trailing_newline=True, autoescape=True)


def write_text(path: Path, text: str, what: str) -> Path:
    """Write a page into a folder that is made if absent; what: it is, for messages. Raises ArgumentError where it cannot be."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    except OSError as error:
        raise ArgumentError(f"{what} cannot be written to {path}: {error.strerror}") from None
    return path
