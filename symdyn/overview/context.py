"""Frozen records by subject that the page of a mechanism reads."""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Generic, TypeVar

from symdyn.bench.work.page import Measured
from symdyn.choice import Candidate
from symdyn.named_records import NamedRecords
from symdyn.overview.condition import Passage
from symdyn.overview.equations import Quantity, SymbolTable
from symdyn.stress.page import Finding

if TYPE_CHECKING:
    from symdyn.pictures.embedded import Embedded

Shown = TypeVar("Shown")


@dataclass(frozen=True)
class Part(Generic[Shown]):
    """A part of the page.

    shown    what it shows; none where that could not be made, for the reason `failed`
    notes    what is missing in it, warnings
    """

    title: str
    shown: Shown | None
    failed: str
    notes: tuple[str, ...]


@dataclass(frozen=True)
class OfEquations:
    """The equations; form: their form in letters, HTML."""

    form: str
    symbols: tuple[SymbolTable, ...]
    quantities: tuple[Quantity, ...]
    constraints: tuple[str, ...]


@dataclass(frozen=True)
class FunctionRow:
    """Operations of a function by kind, together, in the prologue, and how many wait for each other."""

    name: str
    total: int
    add: int
    multiply: int
    divide: int
    sin_cos: int
    other: int
    prologue: int
    chain: int


@dataclass(frozen=True)
class OfCode:
    """The generated code.

    sizes      pairs of what is counted and its number
    fallback   why it is NumPy, "" if it did not have to be; many: how many states and motions are computed at once
    """

    backend: str
    fallback: str
    sizes: tuple[tuple[str, int], ...]
    functions: tuple[FunctionRow, ...]
    candidates: tuple[Candidate, ...]
    skipped: tuple[str, ...]
    many: str

    @property
    def right_side(self) -> tuple[FunctionRow, ...]:
        """The row of the right-hand side, where it has one."""
        return tuple(row for row in self.functions if row.name == "rhs")


@dataclass(frozen=True)
class RangeRow:
    """A condition number along the motion, as text; lost: at how many states it is not determined, "" at none."""

    label: str
    least: str
    most: str
    lost: str


@dataclass(frozen=True)
class OfCondition:
    """Conditions of the accelerations along a motion.

    states, end   how many states were looked at, of how many s
    near          whether a place is near a singularity
    picture       address of an <img>, "" for none
    mechanism     pictures of it; facts: about the run, pairs of title and text
    """

    states: int
    end: str
    near: bool
    warnings: tuple[str, ...]
    passages: tuple[Passage, ...]
    curves: tuple[RangeRow, ...]
    picture: str
    mechanism: tuple[Embedded, ...]
    facts: tuple[tuple[str, str], ...]


@dataclass(frozen=True)
class OfWork:
    """Work against error; text: tables, where pictures cannot be drawn."""

    parts: tuple[Measured, ...]
    text: str


@dataclass(frozen=True)
class OfStress:
    """Findings of the stress tests, the worst first."""

    rows: tuple[Finding, ...]
    left_out: tuple[str, ...]
    summary: str
    passed: bool


@dataclass(frozen=True)
class IdentityRow:
    """An identity, as text; residual: the largest, tolerance: what is allowed."""

    verdict: str
    name: str
    residual: str
    tolerance: str
    remark: str


@dataclass(frozen=True)
class OfProof:
    """Identities at so many random states."""

    passed: bool
    states: int
    note: str
    rows: tuple[IdentityRow, ...]


@dataclass(frozen=True)
class Parts:
    """The parts, in their order; proof: none where it was not requested."""

    equations: Part[OfEquations]
    generated: Part[OfCode]
    condition: Part[OfCondition]
    work: Part[OfWork]
    stress: Part[OfStress]
    proof: Part[OfProof] | None

    @property
    def linked(self) -> tuple[tuple[str, Part[object]], ...]:
        """Pairs of the name of a section and its part."""
        return tuple((f.name, part) for f in fields(self) if (part := getattr(self, f.name)) is not None)


@dataclass(frozen=True)
class Mechanism:
    """The mechanism, how its equations were derived, the version of symdyn; budget: of work against error, s."""

    name: str
    formulation: str
    version: str
    budget: str


@dataclass(frozen=True)
class FullContext(NamedRecords):
    """The records that the page gets."""

    mechanism: Mechanism
    parts: Parts
