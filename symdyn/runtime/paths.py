"""Paths of files that results are written to."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from symdyn.errors import ArgumentError
from symdyn.shown import shown

# Bytes of a name that file systems take.
LONGEST = 255


def as_path(path: Any, what: str, example: str) -> Path:
    """A path given as text or path-like; what, example: of the message. Raises ArgumentError for anything else."""
    try:
        text = os.fspath(path)
        fits = isinstance(text, str) and "\0" not in text and all(len(os.fsencode(p)) <= LONGEST for p in Path(text).parts)
    except (TypeError, UnicodeError):
        fits = False
    if not fits:
        raise ArgumentError(f"the path {what} is {shown(path)}; pass text or a Path, such as {example!r}, with names of "
                            f"{LONGEST} bytes at most")
    return Path(path)


@contextlib.contextmanager
def writing(path: Path) -> Iterator[None]:
    """Errors of the disk while a file or folder is written become an ArgumentError with the reason."""
    try:
        yield
    except OSError as error:
        raise ArgumentError(f"{path} cannot be written: {error.strerror or error}; pass another path, or free some "
                            "space") from error
