"""Where the files that symdyn comes with are."""

from __future__ import annotations

from pathlib import Path


def templates_folder() -> Path:
    """The shipped templates: in the package where it is installed, next to it in a checkout."""
    package = Path(__file__).parent
    return package / "templates" if (package / "templates").is_dir() else package.parent / "templates"
