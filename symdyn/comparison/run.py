"""Comparing cases: by name those of the lecture, or one's own."""

from __future__ import annotations

import difflib
import gc
import re
import time as clock
from collections.abc import Iterable, Sequence
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from typing import TYPE_CHECKING, Any, overload

from symdyn.collector import collector_paused
from symdyn.comparison.case import Case
from symdyn.comparison.judge import judge
from symdyn.comparison.result import Comparison, Comparisons
from symdyn.errors import ArgumentError, CaseError, UnknownCase
from symdyn.exact.mechanism import Proofs
from symdyn.formulation.equations import Equations

if TYPE_CHECKING:
    from symdyn.sympy_mechanics.border import Derived

_SECTION = re.compile(r"\d+(\.\d+)*")


@overload
def compare(case: Case) -> Comparison: ...


@overload
def compare(case: str) -> Any: ...  # a Comparison, of a section Comparisons


@overload
def compare(case: Iterable[Case | str]) -> Comparisons: ...


@overload
def compare(case: Equations, other: Equations | Derived) -> Proofs: ...


def compare(case: Case | str | Equations | Iterable[Case | str], other: Equations | Derived | None = None) -> Any:
    """Compare printed formulas of slides with derived ones, entry by entry, with a verdict each.

    case   a Case of your own; the name of a case of the lecture ("pendulum-augmented"; names: symdyn.lecture.names()); a section
           or a chapter of it ("3.5", "3"), for all of its cases; or several of these. Equations, together with
    other  equations of the same mechanism: of symdyn's, or a KanesMethod, a LagrangesMethod or (q, u, M, f) of SymPy's. Whether
    both
           are the same is proved or refuted by exact algebra; those of SymPy's may be in other speeds, independent ones included
    Returns a Comparison of one case, Comparisons of a section or of several; Proofs of equations.

    Raises UnknownCase (the nearest names are offered) and CaseError with every fault of a case; ArgumentError for equations of
    other coordinates, and what sd.from_sympy raises.

    >>> sd.compare("pendulum-embedding").name
    'pendulum-embedding'
    """
    if isinstance(case, Equations) or other is not None:
        return _proved(case, other)
    if isinstance(case, Case):
        return _compared(case)
    if not isinstance(case, Iterable):
        raise CaseError([_neither(case)])
    start = clock.monotonic()
    cases = find([case] if isinstance(case, str) else case)
    if isinstance(case, str) and not _SECTION.fullmatch(case):
        return _compared(cases[0])
    return Comparisons(tuple(map(_compared, cases)), clock.monotonic() - start)


def _proved(equations: Any, other: Any) -> Proofs:
    """Whether equations are the same."""
    from symdyn.sympy_mechanics.proof import prove_same

    if not isinstance(equations, Equations) or other is None:
        what, result = ("the first", equations) if not isinstance(equations, Equations) else ("the second", other)
        raise ArgumentError(f"compare takes equations with others of the same mechanism, {what} is {result!r:.80}; pass what "
                            "system.embedding(), .augmented() or .recursive() returns, then a KanesMethod, a LagrangesMethod, "
                            "(q, u, M, f), or other equations")
    return equations.prove(other) if isinstance(other, Equations) else prove_same(equations, other)


def compare_lecture(names: Sequence[str] | None = None, jobs: int = 1) -> Comparisons:
    """Cases of the lecture, all of them or those of the names, sections and chapters given, on `jobs` processes."""
    from symdyn.lecture import cases

    start = clock.monotonic()
    chosen = list(dict.fromkeys(c.name for c in (find(names) if names is not None else cases())))
    with collector_paused():
        results = [_named(name) for name in chosen] if jobs == 1 else _shared(chosen, jobs)
    return Comparisons(tuple(results), clock.monotonic() - start)


def _shared(names: Sequence[str], jobs: int) -> list[Comparison]:
    """The comparisons of cases on several processes, of which this one is the first: it takes cases from the end while the others
    start."""
    own: dict[int, Comparison] = {}
    with ProcessPoolExecutor(jobs - 1, mp_context=get_context("spawn"), initializer=gc.disable) as pool:
        futures = [pool.submit(_named, name, sent=True) for name in names]
        try:
            for k in reversed(range(len(names))):
                if futures[k].cancel():
                    own[k] = _named(names[k])
            return [own[k] if k in own else future.result() for k, future in enumerate(futures)]
        finally:
            pool.shutdown(cancel_futures=True)


def find(cases: Iterable[Case | str]) -> list[Case]:
    """The cases themselves; for names those of the lecture, for a section or a chapter all of it.

    Raises UnknownCase, and CaseError for anything else.
    """
    return [result for case in cases for result in ([case] if isinstance(case, Case) else _of_lecture(case))]


def _of_lecture(name: Any) -> list[Case]:
    if not isinstance(name, str):
        raise CaseError([_neither(name)])
    from symdyn.lecture import cases

    there = {c.name: c for c in cases()}
    if name in there:
        return [there[name]]
    if _SECTION.fullmatch(name):
        result = [c for c in cases() if c.slide is not None and f"{c.slide.section}.".startswith(f"{name}.")]
        if result:
            return result
        sections = dict.fromkeys(c.slide.section for c in cases() if c.slide is not None)
        raise UnknownCase(f"there is no case of section {name}; sections with cases are {', '.join(sections)}")
    near = difflib.get_close_matches(name, there, n=4, cutoff=0.4) or sorted(n for n in there if name.lower() in n)[:4]
    offer = f"the nearest are {', '.join(near)}" if near else f"there are {len(there)}; `symdyn compare` lists them"
    raise UnknownCase(f"there is no case {name!r}; {offer}")


def _neither(result: Any) -> str:
    return f"compare takes a name, a Case or several of them, found {result!r:.80} of type {type(result).__name__}"


def _named(name: str, sent: bool = False) -> Comparison:
    return _compared(find([name])[0], sent)


def _compared(case: Case, sent: bool = False) -> Comparison:
    start = clock.monotonic()
    try:
        formulas = judge(case, sent)
    except CaseError as error:
        if error.name:
            raise
        raise CaseError(error.faults, case.name) from error.__cause__
    return Comparison(case.name, case.title, case.slide or formulas[0].slide, formulas, clock.monotonic() - start,
                      tuple(case.remarks))
