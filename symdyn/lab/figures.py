"""Figures compared with what they should be: what `symdyn bench figures` and other words print."""

from __future__ import annotations

import difflib
import operator
from collections.abc import Callable, Iterator, Sequence

from symdyn.errors import ArgumentError

# Title, number, unit, and bound such as "< 2", "<= 1e-10" or ">= 5"; "" where there is none.
Figure = tuple[str, float, str, str]
Group = Callable[[], Iterator[Figure]]
_HOLDS = {"<": operator.lt, "<=": operator.le, ">=": operator.ge}


def missed(value: float, wanted: str) -> bool:
    """Whether a figure is not what it should be; an empty bound is never missed, any other by what is not a number."""
    if not wanted:
        return False
    relation, bound = wanted.split()[:2]
    return not _HOLDS[relation](value, float(bound))


def print_figures(groups: Sequence[Group], only: Sequence[str] | None = None, width: int = 63) -> int:
    """Print every figure; returns the number of those that miss their bound.

    only   names of some of the groups (default: all)
    Raises ArgumentError for a group that there is not.
    """
    count = 0
    for group in _chosen(groups, only):
        for name, value, unit, wanted in group():
            bad = missed(value, wanted)
            count += bad
            digits = ".0f" if float(value).is_integer() and abs(value) < 1e9 else ".4g"  # counts are reported in full
            print(f"{name:{width}} {value:10{digits}} {unit:3} {wanted:10}{'MISSED' if bad else ''}".rstrip(), flush=True)
    return count


def _chosen(groups: Sequence[Group], only: Sequence[str] | None) -> list[Group]:
    known = {group.__name__: group for group in groups}
    strange = [name for name in only or () if name not in known]
    if strange:
        near = difflib.get_close_matches(strange[0], known, 1)
        hint = f"did you mean {near[0]}? There are" if near else "there are"
        raise ArgumentError(f"there is no group {', '.join(strange)} of figures; {hint} {', '.join(known)}")
    return [group for name, group in known.items() if not only or name in only]
