"""Comparisons of the lecture's cases that tests and notebooks share, from process to process."""

from __future__ import annotations

import functools
import os
import pickle
from collections.abc import Callable
from pathlib import Path

import symdyn as sd
from symdyn.comparison import Case, Comparison, Formula, Verdict, run
from symdyn.lecture import cases


@functools.cache
def taken(case: str) -> list[Formula]:
    """The formulas of a case of the lecture, derived once."""
    return [f for c in cases() if c.name == case for f in c.taken()]


def formula(case: str, name: str) -> Formula:
    """A formula of a case of the lecture."""
    return next(f for f in taken(case) if f.name == name)


def verdicts(changed: Formula) -> list[Verdict]:
    """The verdicts on the entries of one formula alone."""
    return [entry.verdict for entry in sd.compare(Case("changed", formulas=[changed])).formulas[0].entries]


def compared(name: str) -> Comparison:
    """Result of sd.compare(name); computed once in a run."""
    return once(name, lambda: sd.compare(name))


def once(name: str, compare: Callable[[], Comparison]) -> Comparison:
    """The comparison of a case of the lecture, computed unless this or another process of the run did."""
    path = Path(os.environ["SYMDYN_CACHE_DIR"]) / "lecture" / f"{name}.pickle"
    if path.is_file():
        return pickle.loads(path.read_bytes())
    found = compare()
    path.parent.mkdir(exist_ok=True)
    part = path.with_suffix(f".{os.getpid()}")
    part.write_bytes(pickle.dumps(found))
    part.replace(path)
    return found


def share_with_notebooks() -> None:
    """In a notebook's process: sd.compare takes cases of the lecture from those compared before, and keeps the others."""
    compute = run._compared

    def compare(case: Case) -> Comparison:
        of_lecture = any(case is known for known in cases())
        return once(case.name, lambda: compute(case)) if of_lecture else compute(case)

    run._compared = compare
