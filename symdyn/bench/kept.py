"""Files that keep references: JSON, an entry for each name; written as a whole or not at all."""

from __future__ import annotations

import json
import re
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from symdyn.errors import ArgumentError
from symdyn.runtime.building.stored import write_whole


def read(path: Path) -> Any:
    """Content of a file; None where there is none or it is damaged."""
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None


def write(path: Path, data: Any) -> None:
    """Write a file, innermost lists on one line each; whoever reads it meanwhile finds it as it was or as it will be."""
    path.parent.mkdir(parents=True, exist_ok=True)
    text = re.sub(r"\[\s+([^\[\]{}]+?)\s+\]", lambda m: "[" + re.sub(r",\s+", ", ", m[1]) + "]", json.dumps(data, indent=1))
    write_whole(path, lambda file: file.write((text + "\n").encode()))


def put(path: Path, name: str, data: Mapping[str, Any]) -> None:
    """Put one entry into a file next to the others."""
    write(path, dict(sorted({**(read(path) or {}), name: dict(data)}.items())))


def closed(folder: Path) -> str:
    """Why no file can be put into a folder, which need not be there yet; empty if one can: a file is made and goes at
    once."""
    there = folder
    try:
        there = next(place for place in (folder, *folder.absolute().parents) if place.exists() or place.is_symlink())
        if not there.is_dir():
            return f"{there} is a file, not a folder"
        with tempfile.TemporaryFile(dir=there):
            return ""
    except OSError as error:
        return f"{there} is closed to writing ({error.strerror})"


def writable(asked: Path | None, own: Path) -> Path:
    """The file that is to be written: the requested one, else the package's own; looked at before anything takes time.

    Raises ArgumentError where it cannot be written, or holds anything but entries.
    """
    path, which = (own, "the package's file of references") if asked is None else (asked, "the file of references")
    why = "it is a folder" if path.is_dir() else closed(path.parent)
    if why:
        raise ArgumentError(f"{which} {path} cannot be written: {why}; pass another with --store FILE")
    if path.exists() and path.stat().st_size:
        held = read(path)
        if not isinstance(held, dict) or not all(isinstance(entry, dict) for entry in held.values()):
            raise ArgumentError(f"{which} {path} holds something else, which would be lost; pass another with --store FILE, or "
                                "delete it")
    return path
