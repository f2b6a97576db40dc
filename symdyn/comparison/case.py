"""A case: what a slide prints, beside what symdyn derives."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from symdyn.comparison.conventions import Convention
from symdyn.comparison.proofs import Proof
from symdyn.errors import CaseError


@dataclass(frozen=True)
class Slide:
    """Where something is printed: section such as "3.5", title of the slide, line of the notes (or page)."""

    section: str
    title: str = ""
    line: int | None = None

    def __str__(self) -> str:
        parts = [self.section, self.title, f"line {self.line}" if self.line is not None else ""]
        return ", ".join(p for p in parts if p)


@dataclass(frozen=True)
class Erratum:
    """Entries of a formula that are wrong as printed.

    why       one sentence
    proof     something independent of the formula that the right one fulfils and the printed one does not; see symdyn.proofs
    entries   their indices, (i, j) or (i,) of a vector; None: all that differ
    """

    why: str
    proof: Proof
    entries: Sequence[tuple[int, ...]] | None = None


@dataclass(frozen=True)
class Formula:
    """One printed formula and what symdyn derives for it.

    name          short and unique in its case
    printed       expression, nested list, matrix, equation (sp.Eq, or a pair of matrices); None if it cannot be read
    derived       the same for symdyn's; or a function without arguments that returns it
    slide, line   where it is printed; default: the case's; `line` changes the line alone
    also          lines where the same is printed again
    latex         how its name is typeset
    renamed       {the slide's symbol: symdyn's symbol or expression}; symbols of one name are the same anyway
    where         {symbol: expression} put into both, where they are equal only on certain states
    conventions   what the slide may write otherwise; see symdyn.conventions
    errata        what is wrong
    unreadable    why it, or {index: why an entry}, cannot be read
    decimals      printed numbers are rounded to so many decimals
    """

    name: str
    printed: Any
    derived: Any
    slide: Slide | None = None
    line: int | None = None
    also: Sequence[int] = ()
    latex: str | None = None
    renamed: Mapping[Any, Any] = field(default_factory=dict)
    where: Mapping[Any, Any] = field(default_factory=dict)
    conventions: Sequence[Convention] = ()
    errata: Sequence[Erratum] = ()
    unreadable: str | Mapping[tuple[int, ...], str] = ""
    decimals: int | None = None


@dataclass(frozen=True)
class Case:
    """Formulas that belong together, usually of one derivation.

    name       short, for `symdyn.compare(name)` and the command line
    formulas   the formulas, or a function without arguments that returns them (nothing is derived before it is compared)
    printed    the short form: {name: what the slide prints}, compared with `derived`
    derived    equations of symdyn, whose attributes have those names, or a dict

    A pendulum of your own slides, derived and compared in a few lines:

        Case("my-pendulum", printed={"M_tilde": [[m*l**2]], "F_tilde": [-m*g*l*sin(q)]}, derived=system.embedding())

    Raises CaseError with every fault: names that `derived` lacks, no formulas, names used twice.
    """

    name: str
    title: str = ""
    slide: Slide | None = None
    formulas: Sequence[Formula] | Callable[[], Sequence[Formula]] = ()
    printed: Mapping[str, Any] = field(default_factory=dict)
    derived: Any = None

    def taken(self) -> list[Formula]:
        """All formulas, with their slides."""
        faults: list[str] = []
        formulas = list(self.formulas() if callable(self.formulas) else self.formulas)
        for name, printed in self.printed.items():
            found = self.derived.get(name) if isinstance(self.derived, Mapping) else getattr(self.derived, name, None)
            if found is None:
                there = sorted(map(str, self.derived)) if isinstance(self.derived, Mapping) else []
                faults.append(f"{name} is printed, but `derived` has no {name}; "
                              + (f"it has {', '.join(there)}" if there else "pass equations or a dict that has it"))
                continue
            formulas.append(Formula(name, printed, found))
        if not formulas and not faults:
            faults.append("it has no formulas; pass formulas=[...], or printed={...} and derived=...")
        names = [f.name for f in formulas]
        faults += [f"{names.count(n)} formulas are named {n!r}; give each a name of its own"
                   for n in dict.fromkeys(names) if names.count(n) > 1]
        if faults:
            raise CaseError(faults, self.name)
        return [self._placed(f) for f in formulas]

    def _placed(self, formula: Formula) -> Formula:
        slide = formula.slide or self.slide or Slide("")
        if formula.line is not None:
            slide = replace(slide, line=formula.line)
        return replace(formula, slide=slide)
