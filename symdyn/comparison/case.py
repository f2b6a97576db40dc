"""A case: what a slide prints, compared with what symdyn derives."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from numbers import Integral
from typing import Any

from symdyn.comparison.check import INDEX, as_tuple, described, guarded, is_count, is_index, mapping, members, text
from symdyn.comparison.conventions import Convention
from symdyn.comparison.proofs import Proof
from symdyn.comparison.values import take
from symdyn.errors import CaseError


@dataclass(frozen=True)
class Slide:
    """Place where something is printed: section such as "3.5", title of the slide, line of the notes (or page).

    >>> str(sd.Slide("3.4", "Pendulum", 12))
    '3.4, Pendulum, line 12'
    """

    section: str
    title: str = ""
    line: int | None = None

    def __str__(self) -> str:
        parts = [self.section, self.title, f"line {self.line}" if self.line is not None else ""]
        return ", ".join(p for p in parts if p)

    def faults(self, what: str) -> list[str]:
        """Faults of the place of a formula."""
        return [*text(self.section, f"the section of {what}", empty=True), *text(self.title, f"the title of {what}", empty=True),
                *_line(self.line, f"the line of {what}")]


@dataclass(frozen=True)
class Erratum:
    """Entries of a formula that are wrong as printed.

    why       one sentence
    proof     something independent of the formula that the right one fulfils and the printed one does not; see symdyn.proofs
    entries   their indices, [(i, j), ...] or [(i,), ...] of a vector; None: all that differ
    slip      one sentence, the same for all errata that repeat one slip: they are listed once, with all places; default: `why`

    >>> m, l, g, q = sp.symbols("m l g q")
    >>> slip = sd.Erratum("The sine is missing.", sd.proofs.other("Lagrange's equation", -m * g * l * sp.sin(q)))
    >>> slip.why
    'The sine is missing.'
    """

    why: str
    proof: Proof
    entries: Sequence[tuple[int, ...]] | None = None
    slip: str = ""

    def __post_init__(self) -> None:
        entries = as_tuple(self.entries)
        _set(self, entries=tuple(map(as_tuple, entries)) if isinstance(entries, tuple) else entries)

    def faults(self, what: str) -> list[str]:
        """Missing entries; what: which erratum it is."""
        faults = text(self.why, f"`why` of {what}") + text(self.slip, f"`slip` of {what}", empty=True)
        if not isinstance(self.proof, Proof):
            faults.append(f"`proof` of {what} is {described(self.proof)}; pass one of symdyn.proofs")
        if self.entries is None:
            return faults
        if not isinstance(self.entries, tuple) or not all(map(is_index, self.entries)):
            faults.append(f"`entries` of {what} is {described(self.entries)}; pass a list of index {INDEX}{_meant(self.entries)}")
        elif not self.entries:
            faults.append(f"`entries` of {what} is empty; name entries, or leave it out for all that differ")
        return faults


@dataclass(frozen=True)
class Remark:
    """A mistake on a slide without a formula to compare: a label, a word, an index that changes no value.

    why          one sentence
    line, also   where it is printed, and where it is printed again

    >>> sd.Remark("The axis is labelled x, it is y.", line=12).why
    'The axis is labelled x, it is y.'
    """

    why: str
    line: int | None = None
    also: Sequence[int] = ()

    def __post_init__(self) -> None:
        _set(self, also=as_tuple(self.also, Integral))

    def faults(self) -> list[str]:
        """Everything of a wrong type."""
        faults = text(self.why, "`why` of a remark") + _line(self.line, "the line of a remark")
        if not isinstance(self.also, tuple) or not all(map(is_count, self.also)):
            faults.append(f"`also` of a remark is {described(self.also)}; pass numbers of lines, [3, 7]")
        return faults


@dataclass(frozen=True)
class Formula:
    """One printed formula and what symdyn derives for it.

    name          short and unique in its case
    printed       expression, nested list, matrix, equation (sp.Eq, or a pair of matrices); None if it cannot be read
    derived       the same for symdyn's; or a function without arguments that returns it
    slide, line   where it is printed, text being a section; default: the case's; `line` changes the line alone
    also          lines where the same is printed again, or one
    latex         how its name is typeset
    renamed       {the slide's symbol: symdyn's symbol or expression}; symbols of one name are the same anyway
    where         {symbol: expression} put into both, where they are equal only on certain states
    conventions   what the slide may write otherwise, one or several; see symdyn.conventions
    errata        what is wrong, one or several
    unreadable    why it, or {index: why an entry}, cannot be read
    decimals      printed numbers are rounded to so many decimals

    >>> q = sp.Symbol("q")
    >>> formula = sd.Formula("double angle", sp.sin(2 * q), 2 * sp.sin(q) * sp.cos(q))
    >>> print(sd.compare(sd.Case("identity", formulas=[formula])))
    identity
      double angle  1 equal, proved
      1 entry: 1 equal, proved
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

    def __post_init__(self) -> None:
        _set(self, slide=_as_slide(self.slide), also=as_tuple(self.also, Integral), errata=as_tuple(self.errata, Erratum),
             conventions=as_tuple(self.conventions, Convention))

    def faults(self, what: str) -> list[str]:
        """Everything of a wrong type; what: how the messages call the formula."""
        faults = _slide(self.slide, f"the slide of {what}") + _line(self.line, f"the line of {what}")
        if not isinstance(self.also, tuple) or not all(map(is_count, self.also)):
            faults.append(f"`also` of {what} is {described(self.also)}; pass numbers of lines, [3, 7]")
        if self.latex is not None:
            faults += text(self.latex, f"`latex` of {what}")
        for name in ("renamed", "where"):
            faults += mapping(getattr(self, name), f"`{name}` of {what}", "{symbol: symbol or expression}")
        faults += members(self.conventions, f"`conventions` of {what}", Convention, "symdyn.conventions.opposite_sign(sentence)")
        faults += members(self.errata, f"`errata` of {what}", Erratum, "symdyn.Erratum(why, proof)")
        faults += [f"{what}: {fault}" for convention in _those(self.conventions, Convention) for fault in convention.faults()]
        faults += [fault for erratum in _those(self.errata, Erratum) for fault in erratum.faults(f"an erratum of {what}")]
        if self.decimals is not None and not is_count(self.decimals):
            faults.append(f"`decimals` of {what} is {described(self.decimals)}; pass a whole number from 0 on")
        return faults + self._unreadable(what)

    def _unreadable(self, what: str) -> list[str]:
        given = self.unreadable
        if isinstance(given, str):
            both = bool(given) and self.printed is not None
            return [f"{what} is unreadable as a whole ({given!r:.60}), and something is printed; pass {{index: reason}} for "
                    "single entries, or printed=None"] if both else []
        if not isinstance(given, Mapping):
            return [f"`unreadable` of {what} is {described(given)}; pass a sentence, or {{index: sentence}}"]
        faults = [f"`unreadable` of {what} has the index {described(key)}; pass {INDEX}" for key in given if not is_index(key)]
        printed = take(self.printed, what, []) if given and not faults and self.printed is not None else None
        if printed is not None:
            places = printed.indices()
            faults += [f"`unreadable` of {what} names entry {key}; the print has {_span(places)}"
                       for key in given if key not in places]
        return faults + [fault for key, why in given.items() for fault in text(why, f"`unreadable` of {what} at {key}")]


@dataclass(frozen=True)
class Case:
    """Formulas that belong together, usually of one derivation.

    name       short, for `symdyn.compare(name)` and the command line
    slide      where they are printed; text is a section
    formulas   the formulas, one formula, or a function without arguments that returns them (nothing is derived before it is
               compared)
    printed    the short form: {name: what the slide prints}, compared with `derived`
    derived    equations of symdyn, whose attributes have those names, or a dict
    remarks    labels and words of the slides that are wrong

    A pendulum of your own slides, derived and compared in a few lines:

        Case("my-pendulum", printed={"M_tilde": [[m*l**2]], "F_tilde": [-m*g*l*sin(q)]}, derived=system.embedding())

    >>> m, l, g, q1 = sp.symbols("m l g q1")
    >>> equations = sd.systems.pendulum().embedding()
    >>> case = sd.Case("my-pendulum", printed={"M_tilde": [[m * l**2]], "F_tilde": [-m * g * l * sp.sin(q1)]}, derived=equations)
    >>> print(sd.compare(case))
    my-pendulum
      M_tilde  1 equal, proved
      F_tilde  1 equal, proved
      2 entries: 2 equal, proved
    """

    name: str
    title: str = ""
    slide: Slide | None = None
    formulas: Sequence[Formula] | Callable[[], Sequence[Formula]] = ()
    printed: Mapping[str, Any] = field(default_factory=dict)
    derived: Any = None
    remarks: Sequence[Remark] = ()

    def __post_init__(self) -> None:
        _set(self, slide=_as_slide(self.slide), formulas=as_tuple(self.formulas, Formula), remarks=as_tuple(self.remarks, Remark))

    def taken(self) -> list[Formula]:
        """All formulas, with their slides.

        Raises CaseError with every fault: what has a wrong type, names that `derived` lacks, no formulas, names used twice.
        Errors that the functions of a formula raise later become CaseErrors, too.

        >>> q = sp.Symbol("q")
        >>> formula = sd.Formula("double angle", sp.sin(2 * q), 2 * sp.sin(q) * sp.cos(q))
        >>> case = sd.Case("identity", slide="1.2", formulas=[formula])
        >>> [(formula.name, str(formula.slide)) for formula in case.taken()]
        [('double angle', '1.2')]
        """
        faults = text(self.name, "the name of a case") + text(self.title, "`title`", empty=True) + _slide(self.slide, "`slide`")
        faults += members(self.remarks, "`remarks`", Remark, "symdyn.Remark(why, line)")
        faults += [fault for remark in _those(self.remarks, Remark) for fault in remark.faults()]
        formulas = self._listed(faults) + self._short(faults)
        if not formulas and not faults:
            faults.append("it has no formulas; pass formulas=[...], or printed={...} and derived=...")
        names = [f.name for f in formulas if isinstance(f.name, str)]
        faults += [f"{names.count(n)} formulas are named {n!r}; give each a name of its own"
                   for n in dict.fromkeys(names) if names.count(n) > 1]
        if faults:
            raise CaseError(faults, self.name)
        return [self._placed(f) for f in formulas]

    def _listed(self, faults: list[str]) -> list[Formula]:
        formulas, what = self.formulas, "formulas"
        if callable(formulas):
            function, what = formulas, "formulas()"
            try:
                formulas = guarded(lambda: as_tuple(function(), Formula), what)()
            except CaseError as error:
                faults += error.faults
                return []
        faults += members(formulas, what, Formula, "symdyn.Formula(name, printed, derived)")
        result = _those(formulas, Formula)
        for formula in result:
            unnamed = text(formula.name, "the name of a formula")
            faults += unnamed + formula.faults("that formula" if unnamed else formula.name)
        return result

    def _short(self, faults: list[str]) -> list[Formula]:
        """The formulas of the short form."""
        wrong = mapping(self.printed, "`printed`", '{"M_tilde": [[m*l**2]]}')
        faults += wrong
        if wrong or not self.printed:
            return []
        if self.derived is None:
            faults.append("something is printed, but nothing derived; pass derived=..., equations or a dict")
            return []
        formulas = []
        for name, printed in self.printed.items():
            unnamed = text(name, "a name in `printed`")
            result = self._derived(name, faults) if not unnamed else None
            faults += unnamed
            if result is not None:
                formulas.append(Formula(name, printed, result))
        return formulas

    def _derived(self, name: str, faults: list[str]) -> Any:
        if isinstance(self.derived, Mapping):
            if self.derived.get(name) is None:
                there = ", ".join(map(str, self.derived))
                faults.append(f"{name} is printed, but `derived` has no {name}; it has {there or 'nothing'}")
            return self.derived.get(name)
        try:
            result = guarded(lambda: getattr(self.derived, name, None), f"{name} of `derived`")()
        except CaseError as error:
            faults += error.faults
            return None
        if result is None:
            faults.append(f"{name} is printed, but `derived` has no {name}; pass equations or a dict that has it")
        elif callable(result):
            faults.append(f"{name} of `derived` is a method; call it and pass what it returns: derived={{{name!r}: ...}}")
            return None
        return result

    def _placed(self, formula: Formula) -> Formula:
        """With its slide, and with functions whose errors name the formula."""
        slide = formula.slide or self.slide or Slide("")
        if formula.line is not None:
            slide = replace(slide, line=formula.line)
        derived = formula.derived
        if callable(derived):
            derived = guarded(derived, f"what is derived for {formula.name}")
        conventions = tuple(replace(c, to_slide=guarded(c.to_slide, f"the convention {c.name!r}"))
                            for c in formula.conventions)
        return replace(formula, slide=slide, derived=derived, conventions=conventions)


def _set(frozen: Any, **values: Any) -> None:
    for name, value in values.items():
        object.__setattr__(frozen, name, value)


def _those(value: Any, kind: type) -> list[Any]:
    return [one for one in value if isinstance(one, kind)] if isinstance(value, tuple) else []


def _span(places: Sequence[tuple[int, ...]]) -> str:
    return f"the entries {places[0]} to {places[-1]}" if places != [()] else "one entry, ()"


def _as_slide(value: Any) -> Any:
    return Slide(value) if isinstance(value, str) else value


def _slide(value: Any, what: str) -> list[str]:
    if value is None or isinstance(value, Slide):
        return value.faults(what) if value is not None else []
    return [f"{what} is {described(value)}; pass symdyn.Slide(section, title, line), or the section as text"]


def _line(value: Any, what: str) -> list[str]:
    return [] if value is None or is_count(value) else [f"{what} is {described(value)}; pass a whole number from 0 on"]


def _meant(entries: Any) -> str:
    """Hint at the probable meaning of entries that are no index tuples."""
    numbers = as_tuple(entries, Integral)
    if not isinstance(numbers, tuple) or not numbers or not all(map(is_count, numbers)):
        return ""
    return f"; you may mean {[(int(n),) for n in numbers]}" + (f" or [{tuple(map(int, numbers))}]" if len(numbers) == 2 else "")
