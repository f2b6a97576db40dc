"""The verdict on every entry of a formula."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import sympy as sp

from symdyn.comparison.case import Case, Erratum, Formula
from symdyn.comparison.equality import Decision, decide, unformed
from symdyn.comparison.values import Value, by_name, rebuilt, renaming, take
from symdyn.comparison.values import taken as value_of
from symdyn.comparison.verdict import EntryResult, ErratumResult, FormulaResult, Verdict
from symdyn.errors import CaseError
from symdyn.model.symbols import symbols_of


@dataclass(frozen=True)
class _Taken:
    """A formula whose values are checked; `printed` is renamed, `shown` is as typed."""

    formula: Formula
    shown: Value | None
    printed: Value | None
    derived: Value | None
    where: Mapping[str, sp.Expr]


def judge(case: Case, sent: bool = False) -> tuple[FormulaResult, ...]:
    """Compare all formulas of a case; sent: the results go to another process, where their expressions are made again from their
    parts. Raises CaseError with every fault of its values."""
    faults: list[str] = []
    taken = [t for t in (_take(f, faults) for f in case.taken()) if t is not None]
    if faults:
        raise CaseError(faults, case.name)
    results = tuple(r for r in (_results(t, faults, sent) for t in taken) if r is not None)
    if faults:
        raise CaseError(faults, case.name)
    return results


def _results(taken: _Taken, faults: list[str], sent: bool) -> FormulaResult | None:
    try:
        return _judged(taken, faults, sent)
    except CaseError as error:
        faults += [f"{taken.formula.name}: {fault}" for fault in error.faults]
        return None


def _take(formula: Formula, faults: list[str]) -> _Taken | None:
    known = len(faults)
    if formula.printed is None and not (isinstance(formula.unreadable, str) and formula.unreadable):
        faults.append(f"{formula.name} has nothing printed; pass `printed`, or say in `unreadable` why it cannot be read")
    try:
        value = formula.derived() if callable(formula.derived) else formula.derived
    except CaseError as error:
        faults += error.faults
        return None
    derived = take(value, f"what is derived for {formula.name}", faults) if value is not None else None
    if derived is None and formula.printed is not None and len(faults) == known:
        faults.append(f"nothing is derived for {formula.name}; pass `derived`")
    shown = take(formula.printed, f"the print of {formula.name}", faults) if formula.printed is not None else None
    renamed = renaming(formula.renamed, f"`renamed` of {formula.name}", faults)
    where = renaming(formula.where, f"`where` of {formula.name}", faults)
    printed = shown.replaced(by_name(shown, renamed)) if shown is not None else None
    return _Taken(formula, shown, printed, derived, where) if len(faults) == known else None


def _shape(value: Value) -> str:
    return " x ".join(map(str, value.shape)) or "a scalar"


def _judged(taken: _Taken, faults: list[str], sent: bool) -> FormulaResult:
    formula = taken.formula
    assert formula.slide is not None
    if taken.printed is None:
        entry = EntryResult((), Verdict.UNREADABLE, note=str(formula.unreadable))
        derived_alone = _shown(taken.derived.rebuilt()) if taken.derived is not None else None
        return FormulaResult(formula.name, formula.slide, tuple(formula.also), formula.latex, None, derived_alone,
                             (entry,))
    derived, decisions, convention = _best(taken)
    if decisions[0].how == SHAPE and not formula.errata:
        faults.append(f"{formula.name} is printed as {_shape(taken.printed)}, derived as {_shape(derived)}"
                      f"{' in every convention it names' if formula.conventions else ''}; the shapes must be the same")
    errata = [_Errata(e, taken, derived, decisions, faults) for e in formula.errata]
    unreadable = formula.unreadable if isinstance(formula.unreadable, Mapping) else {}
    entries = []
    assert taken.shown is not None
    shown, right = (taken.shown, derived) if sent else (taken.shown.rebuilt(), derived.rebuilt())
    for k, (place, decision) in enumerate(zip(_places(taken.printed, decisions), decisions)):
        a, b = (shown.entries[k], right.entries[k]) if decision.how != SHAPE else (None, None)
        entry = EntryResult(place, Verdict.EQUAL, decision.how, "", a, b, decision.point, decision.values, decision.proved)
        judged = _verdict(entry, decision, convention, errata, unreadable.get(place, ""))
        if judged.verdict is Verdict.DIFFERENT and not judged.note and decision.how != SHAPE:
            known = {str(s) for e in derived.entries for s in symbols_of(e)}
            alone = sorted({str(s) for s in symbols_of(taken.printed.entries[k])} - known)
            judged = replace(judged, note=f"only the print holds {', '.join(alone)}" if alone else "")
        entries.append(judged)
    return FormulaResult(formula.name, formula.slide, tuple(formula.also), formula.latex, _shown(shown), _shown(right),
                         tuple(entries), tuple(e.result for e in errata), convention.name if convention else "",
                         tuple((name, rebuilt(e)) for name, e in taken.where.items()))


SHAPE = "shapes differ"


def _verdict(entry: EntryResult, decision: Decision, convention: Any, errata: Sequence[_Errata], unreadable: str) -> EntryResult:
    if unreadable:
        return replace(entry, verdict=Verdict.UNREADABLE, note=unreadable)
    if decision.equal:
        if convention is not None:
            return replace(entry, verdict=Verdict.CONVENTION, note=f"{convention.name}: {convention.sentence}")
        return entry
    covering = [e for e in errata if entry.index in e.places]
    if covering:
        bad = next((e for e in covering if not e.result.evidence.holds), None)
        if bad is None:
            return replace(entry, verdict=Verdict.WRONG, note=covering[0].erratum.why)
        return replace(entry, verdict=Verdict.DIFFERENT, note=f"the proof does not hold: {bad.result.evidence}")
    if decision.equal is None:
        return replace(entry, verdict=Verdict.UNDECIDED, note=decision.how)
    return replace(entry, verdict=Verdict.DIFFERENT)


class _Errata:
    """An erratum applied to the entries that differ."""

    def __init__(self, erratum: Erratum, taken: _Taken, derived: Value, decisions: Sequence[Decision], faults: list[str]) -> None:
        assert taken.printed is not None
        self.erratum = erratum
        places = _places(taken.printed, decisions)
        differing = [p for p, d in zip(places, decisions) if not d.equal]
        claimed = [tuple(e) for e in erratum.entries] if erratum.entries is not None else differing
        name = taken.formula.name
        stale = [p for p in claimed if p not in differing]
        faults += [f"an erratum of {name} says that entry {p} is wrong, but it "
                   + ("equals what is derived" if p in places else f"has the entries {places}") for p in stale]
        if not claimed:
            faults.append(f"an erratum of {name} says that it is wrong, but all of it equals what is derived")
        self.places = set(claimed)
        named = [p for p in claimed if p] if decisions[0].how != SHAPE else None
        evidence = erratum.proof.check(taken.printed.as_sympy(), derived.as_sympy(), taken.where, named or None)
        self.result = ErratumResult(tuple(claimed), erratum.why, evidence, erratum.slip or erratum.why)


def _places(printed: Value, decisions: Sequence[Decision]) -> list[tuple[int, ...]]:
    return [()] if decisions[0].how == SHAPE else printed.indices()


def _best(taken: _Taken) -> tuple[Value, list[Decision], Any]:
    """As derived or in that convention in which fewest entries differ."""
    assert taken.derived is not None
    best: tuple[int, Value, list[Decision], Any] | None = None
    for convention in (None, *taken.formula.conventions):
        derived = taken.derived
        if convention is not None:
            derived = value_of(convention.to_slide(derived.as_sympy()), f"what the convention {convention.name!r} makes")
        decisions = _decide(taken, derived)
        differing = sum(1 for d in decisions if not d.equal)
        if best is None or differing < best[0]:
            best = differing, derived, decisions, convention
        if not differing:
            break
    assert best is not None
    return best[1], best[2], best[3]


def _decide(taken: _Taken, derived: Value) -> list[Decision]:
    printed = taken.printed
    assert printed is not None
    if printed.shape != derived.shape:
        return [Decision(False, SHAPE, proved=True)]
    try:
        a, b = (v.replaced(by_name(v, taken.where)).entries for v in (printed, derived))
    except (ValueError, TypeError) as error:
        return [unformed(error) for _ in printed.entries]
    decisions = decide(a, b, taken.formula.decimals)
    if printed.sides is None or all(d.equal for d in decisions):
        return decisions
    # An equation stays the same when its terms change sides.
    exchanged = decide(a, tuple(-e for e in b), taken.formula.decimals)
    return [d if d.equal or not e.equal else e for d, e in zip(decisions, exchanged)]


def _shown(value: Value) -> Any:
    if value.sides is not None:
        return value.sides[0].as_sympy(), value.sides[1].as_sympy()
    return value.as_sympy()
