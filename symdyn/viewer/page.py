"""One HTML file from the data of a scene; what shows it in a notebook."""

from __future__ import annotations

import html
import json
import os
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from symdyn.errors import ArgumentError
from symdyn.folders import templates_folder
from symdyn.named_records import NamedRecords
from symdyn.pages import filled, write_text
from symdyn.runtime.paths import as_path

# Scripts of the page, in the order in which its parts need each other.
_SCRIPTS = ("vectors.js", "renderer.js", "shapes.js", "source.js", "stage.js", "plots.js", "controls.js", "main.js")
_HEIGHT = 640


@dataclass(frozen=True)
class View:
    """A view that turns, as one HTML page that needs no network; a notebook shows it.

    name   of the mechanism; html: the page; path: where it is written, or None

    >>> sd.systems.pendulum().show()
    View('pendulum')
    """

    name: str
    html: str = field(repr=False)
    path: Path | None = None

    def save(self, path: str | os.PathLike[str]) -> Path:
        """Write the page to a file with the ending .html; returns its path.

        Raises ArgumentError for another ending, and where the file cannot be written.

        >>> import tempfile
        >>> sd.systems.pendulum().show().save(f"{tempfile.mkdtemp()}/pendulum.html").name
        'pendulum.html'
        """
        return write_text(_target(path), self.html, "the view")

    def _repr_html_(self) -> str:
        return (f'<iframe srcdoc="{html.escape(self.html)}" title="{html.escape(self.name)}" allowfullscreen '
                f'style="width: 100%; height: {_HEIGHT}px; border: 0"></iframe>')

    def __repr__(self) -> str:
        return f"View({self.name!r})" if self.path is None else f"View({self.name!r}, path={str(self.path)!r})"


@dataclass(frozen=True)
class Shown:
    """The scene that the page shows.

    name        of the mechanism
    functions   kinematics in JavaScript
    data        the scene, as JSON that a script may hold
    """

    name: str
    functions: str
    data: str


@dataclass(frozen=True)
class Renderer:
    """The means of showing it: the style of the page, the script that draws."""

    style: str
    script: str


@dataclass(frozen=True)
class ViewContext(NamedRecords):
    """The records that the page of a view gets."""

    shown: Shown
    renderer: Renderer


def page_of(name: str, data: dict[str, Any], functions: str, path: Any) -> View:
    """The page of a scene; functions: kinematics in JavaScript; written to a path if one is given."""
    target = None if path is None else _target(path)
    folder = templates_folder() / "viewer"
    script = "\n".join((folder / part).read_text(encoding="utf-8") for part in _SCRIPTS)
    try:
        plain = json.dumps(data, allow_nan=False, separators=(",", ":")).replace("</", "<\\/")
    except ValueError:
        raise ArgumentError(f"{name}: lengths of the picture are beyond the range of double precision; pass smaller numbers for "
                            "coordinates and parameters") from None
    renderer = Renderer((folder / "style.css").read_text(encoding="utf-8"), script)
    text = filled("viewer/page.html.jinja", ViewContext(Shown(name, functions, plain), renderer))
    made = View(name, text, target)
    if target is not None:
        made.save(target)
    return made


def _target(path: Any) -> Path:
    target = as_path(path, "of the view", "view.html")
    if target.suffix.lower() not in (".html", ".htm"):
        raise ArgumentError(f"cannot write the view to {target.name}: the ending must be .html")
    return target
