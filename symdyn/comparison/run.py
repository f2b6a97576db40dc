"""Comparing cases: by name those of the lecture, or one's own."""

from __future__ import annotations

import difflib
import time as clock
from collections.abc import Iterable, Sequence
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from typing import overload

from symdyn.comparison.case import Case
from symdyn.comparison.judge import judge
from symdyn.comparison.result import Comparison, Comparisons
from symdyn.errors import CaseError, UnknownCase


@overload
def compare(case: Case | str) -> Comparison: ...  # type: ignore[overload-overlap]  # text is iterable too


@overload
def compare(case: Iterable[Case | str]) -> Comparisons: ...


def compare(case: Case | str | Iterable[Case | str]) -> Comparison | Comparisons:
    """What slides print beside what symdyn derives, entry by entry, with a verdict each.

    case   the name of a case of the lecture ("pendulum-augmented"; names: symdyn.lecture.names()), a Case of your own, or
           several of them

    Raises UnknownCase (the nearest names are offered) and CaseError with every fault of a case.
    """
    if isinstance(case, (str, Case)):
        return _compared(_find(case))
    if not isinstance(case, Iterable):
        raise CaseError([f"compare takes a name, a Case or several of them, found {case!r} of type {type(case).__name__}"])
    start = clock.monotonic()
    return Comparisons(tuple(_compared(_find(c)) for c in case), clock.monotonic() - start)


def compare_lecture(names: Sequence[str] | None = None, jobs: int = 1) -> Comparisons:
    """Cases of the lecture, all of them or those named, on `jobs` processes."""
    from symdyn.lecture import cases

    start = clock.monotonic()
    chosen = list(names) if names is not None else [c.name for c in cases()]
    for name in chosen:
        _find(name)
    if jobs == 1:
        results = [_named(name) for name in chosen]
    else:
        with ProcessPoolExecutor(jobs, mp_context=get_context("spawn")) as pool:
            results = list(pool.map(_named, chosen, chunksize=1))
    return Comparisons(tuple(results), clock.monotonic() - start)


def _named(name: str) -> Comparison:
    return _compared(_find(name))


def _find(case: Case | str) -> Case:
    if isinstance(case, Case):
        return case
    if not isinstance(case, str):
        raise CaseError([f"compare takes a name, a Case or several of them, found {case!r} of type {type(case).__name__}"])
    from symdyn.lecture import cases

    there = {c.name: c for c in cases()}
    if case in there:
        return there[case]
    near = difflib.get_close_matches(case, there, n=4, cutoff=0.4) or sorted(n for n in there if case.lower() in n)[:4]
    offer = f"the nearest are {', '.join(near)}" if near else f"there are {len(there)}, listed by `symdyn compare --list`"
    raise UnknownCase(f"there is no case {case!r}; {offer}")


def _compared(case: Case) -> Comparison:
    start = clock.monotonic()
    formulas = judge(case)
    return Comparison(case.name, case.title, case.slide or formulas[0].slide, formulas, clock.monotonic() - start)
