"""Files that keep references: JSON, an entry for each name; written as a whole or not at all."""

from __future__ import annotations

import json
import os
import re
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from symdyn.errors import ArgumentError


def read(path: Path) -> Any:
    """What a file holds; None where there is none or it is damaged."""
    try:
        return json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None


def write(path: Path, data: Any) -> None:
    """Write a file, innermost lists on one line each; whoever reads it meanwhile finds it as it was or as it will be."""
    path.parent.mkdir(parents=True, exist_ok=True)
    text = re.sub(r"\[\s+([^\[\]{}]+?)\s+\]", lambda m: "[" + re.sub(r",\s+", ", ", m[1]) + "]", json.dumps(data, indent=1))
    partial = path.with_name(f".{path.name}-{os.getpid()}.tmp")
    try:
        partial.write_text(text + "\n", encoding="utf-8")
        os.replace(partial, path)
    finally:
        partial.unlink(missing_ok=True)


def put(path: Path, name: str, data: Mapping[str, Any]) -> None:
    """Put one entry into a file beside the others."""
    write(path, dict(sorted({**(read(path) or {}), name: dict(data)}.items())))


def writable(asked: Path | None, own: Path) -> Path:
    """The file that is to be written: the one asked for, else the package's own; looked at before anything takes time.

    Raises ArgumentError where it cannot be written, or holds anything but entries.
    """
    path, which = (own, "the package's file of references") if asked is None else (asked, "the file of references")
    try:
        if path.is_dir():
            raise IsADirectoryError(0, "it is a folder")
        path.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=path.parent):
            pass
    except OSError as error:
        raise ArgumentError(f"{which} {path} cannot be written: {error.strerror}; pass another with --store FILE") from None
    if path.exists() and path.stat().st_size:
        held = read(path)
        if not isinstance(held, dict) or not all(isinstance(entry, dict) for entry in held.values()):
            raise ArgumentError(f"{which} {path} holds something else, which would be lost; pass another with --store FILE, or "
                                "delete it")
    return path
