"""Comparisons of the lecture's cases that tests share, from process to process."""

from __future__ import annotations

import os
import pickle
from pathlib import Path

import symdyn as sd
from symdyn.comparison import Case, Comparison, Formula, Verdict
from symdyn.lecture import cases


def formula(case: str, name: str) -> Formula:
    """A formula of a case of the lecture."""
    return next(f for c in cases() if c.name == case for f in c.taken() if f.name == name)


def verdicts(changed: Formula) -> list[Verdict]:
    """The verdicts on the entries of one formula alone."""
    return [entry.verdict for entry in sd.compare(Case("changed", formulas=[changed])).formulas[0].entries]


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
