"""Results of a comparison, entry by entry, as plain data that can be printed, saved and sent between processes."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum
from typing import Any

from symdyn.comparison.case import Slide
from symdyn.comparison.proofs import Evidence


class Verdict(Enum):
    """Verdict on an entry, from best to worst."""

    EQUAL = "equal"
    CONVENTION = "equal up to a convention"
    WRONG = "slide is wrong"
    UNREADABLE = "unreadable in the notes"
    DIFFERENT = "different, not proven wrong"
    UNDECIDED = "not decided"


@dataclass(frozen=True)
class EntryResult:
    """Result of one entry: its index, the verdict and how it was decided.

    note      convention, sentence about the error, or what could not be read or decided
    point     where printed and derived differ, and `values` there
    proved    equality is proved by algebra, or refuted at the point; otherwise values were sampled, and `how` says why
    """

    index: tuple[int, ...]
    verdict: Verdict
    how: str = ""
    note: str = ""
    printed: Any = None
    right: Any = None
    point: Mapping[str, float] | None = None
    values: tuple[float, float] | None = None
    proved: bool = False


@dataclass(frozen=True)
class ErratumResult:
    """An error of a slide: entries, one sentence, the evidence; slip: the sentence of all errata that repeat one slip."""

    entries: tuple[tuple[int, ...], ...]
    why: str
    evidence: Evidence
    slip: str


@dataclass(frozen=True)
class FormulaResult:
    """Result of one formula: printed and derived in the slide's convention, as SymPy (of equations a pair of sides), and its
    entries.

    where   (name of a symbol, expression) put into both before they were compared
    """

    name: str
    slide: Slide
    also: tuple[int, ...]
    latex: str | None
    printed: Any
    derived: Any
    entries: tuple[EntryResult, ...]
    errata: tuple[ErratumResult, ...] = ()
    convention: str = ""
    where: tuple[tuple[str, Any], ...] = ()

    @property
    def counts(self) -> Counter[Verdict]:
        """Verdict -> number of entries."""
        return Counter(e.verdict for e in self.entries)

    @property
    def verdict(self) -> Verdict:
        """The worst of the entries."""
        order = list(Verdict)
        return max((e.verdict for e in self.entries), key=order.index)
