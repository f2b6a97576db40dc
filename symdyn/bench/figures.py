"""Figures beside what they should be: what every command of the bench prints."""

from __future__ import annotations

import operator
from collections.abc import Callable, Iterator, Sequence

# What it is, the number, its unit, and its bound such as "< 2", "<= 1e-10" or ">= 5"; "" where there is none.
Figure = tuple[str, float, str, str]
_HOLDS = {"<": operator.lt, "<=": operator.le, ">=": operator.ge}


def missed(value: float, wanted: str) -> bool:
    """Whether a figure is not what it should be; an empty bound is never missed, any other by what is not a number."""
    if not wanted:
        return False
    relation, bound = wanted.split()[:2]
    return not _HOLDS[relation](value, float(bound))


def print_figures(groups: Sequence[Callable[[], Iterator[Figure]]], width: int = 62) -> int:
    """Print every figure; returns the number of those that miss their bound."""
    count = 0
    for group in groups:
        for name, value, unit, wanted in group():
            bad = missed(value, wanted)
            count += bad
            print(f"{name:{width}} {value:10.4g} {unit:3} {wanted:10}{'MISSED' if bad else ''}".rstrip(), flush=True)
    return count
