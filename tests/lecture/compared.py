"""Comparisons of the lecture's cases that tests share, from process to process."""

from __future__ import annotations

import os
import pickle
from pathlib import Path

import symdyn as sd
from symdyn.comparison import Comparison


def compared(name: str) -> Comparison:
    """What sd.compare(name) gives; computed once in a run."""
    path = Path(os.environ["SYMDYN_CACHE_DIR"]) / "lecture" / f"{name}.pickle"
    if path.is_file():
        return pickle.loads(path.read_bytes())
    found = sd.compare(name)
    path.parent.mkdir(exist_ok=True)
    part = path.with_suffix(f".{os.getpid()}")
    part.write_bytes(pickle.dumps(found))
    part.replace(path)
    return found
