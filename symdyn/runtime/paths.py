"""Paths of files that results are written to."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from symdyn.errors import ArgumentError


def as_path(path: Any, what: str, example: str) -> Path:
    """A path given as text or path-like; what, example: of the message. Raises ArgumentError for anything else."""
    if not isinstance(path, (str, os.PathLike)) or isinstance(os.fspath(path), bytes) or "\0" in os.fspath(path):
        raise ArgumentError(f"the path {what} is {path!r}; pass text or a Path, such as {example!r}")
    return Path(path)
