"""Cost of printing: operations of the quantities of the catalogue in every form, and processor time."""

from __future__ import annotations

import time as clock
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import sympy as sp

from symdyn.errors import SymdynError
from symdyn.exact.shortest import FORMS
from symdyn.formulation.equations import Equations
from symdyn.lab import kane_forms
from symdyn.report.limit import TimeUp, within
from symdyn.systems import get, names

QUANTITIES = ("M_tilde", "k_tilde", "F_tilde", "C", "C_r", "F_d")
OTHERS = tuple(form for form in FORMS if form != "shortest")
# Reference figures of a first form, polynomial or Fourier, which the shortest form does not exceed; and what a quantity and its
# named intermediates have together, which is below these.
FIRST_FORM = {("four_bar", "M_tilde"): 162, ("four_bar", "k_tilde"): 76, ("four_bar", "F_tilde"): 46,
              ("n_link_pendulum", "M_tilde"): 1244, ("n_link_pendulum", "k_tilde"): 535, ("n_link_pendulum", "F_tilde"): 161,
              ("three_link_arm", "k_tilde"): 143, ("puma560", "M_tilde"): 1998, ("puma560", "k_tilde"): 6026}
WITH_NAMES = {("puma560", "M_tilde"): 600, ("puma560", "k_tilde"): 1500, ("n_link_pendulum", "M_tilde"): 300}
# Coordinates up to which the three quantities of the equations of motion take LIMIT seconds at most, or LONGER; and what these
# take in named intermediates.
COORDINATES, LIMIT, LONGER, NAMED_LIMIT = 6, 0.5, {"puma560": 2.0, "woodpecker_toy": 2.0}, {"floating_wind_turbine": 5.0}
# Seconds after which another form is left out of the table.
PATIENCE = 30.0
HEADING = (f"{'mechanism':36}{'quantity':10}{'operations':>11}{'bound':>8}{'polynomial':>12}{'Fourier':>10}{'next best':>11} "
           f"{'by':11}{'with names':>11}{'bound':>8}{'s':>8}")


@dataclass(frozen=True)
class Row:
    """One quantity: operations in its shortest form and in the others by name (None: too large), and in named intermediates
    together with these; seconds of the processor for the shortest form and for that in intermediates."""

    mechanism: str
    quantity: str
    operations: int | None
    others: Mapping[str, int | None]
    named: int | None
    seconds: float
    named_seconds: float = 0.0

    @property
    def next_best(self) -> tuple[int, str] | None:
        """The fewest operations of another form, and which that is."""
        return min(((count, form) for form, count in self.others.items() if count is not None), default=None)

    @property
    def longer(self) -> bool:
        """Whether another form has fewer operations, which must not be."""
        return self.next_best is not None and (self.operations is None or self.next_best[0] < self.operations)

    @property
    def bound(self) -> int | None:
        """Largest number of operations of the shortest form."""
        return FIRST_FORM.get((self.mechanism, self.quantity))

    @property
    def named_bound(self) -> int | None:
        """Bound of the form in named intermediates."""
        return WITH_NAMES.get((self.mechanism, self.quantity))

    @property
    def faults(self) -> list[str]:
        """Faults of the row."""
        result = ["another form is shorter"] if self.longer else []
        if self.bound is not None and (self.operations is None or self.operations > self.bound):
            result.append(f"above {self.bound}")
        if self.named_bound is not None and (self.named is None or self.named >= self.named_bound):
            result.append(f"with names not below {self.named_bound}")
        return result

    def __str__(self) -> str:
        best = self.next_best or (None, "")
        counts = (self.operations, 11), (self.bound, 8), (self.others.get("polynomial"), 12), (self.others.get("fourier"), 10)
        return (f"{self.mechanism:36}{self.quantity:10}{''.join(_cell(count, width) for count, width in counts)}"
                f"{_cell(best[0], 11)} {best[1]:11}{_cell(self.named, 11)}{_cell(self.named_bound, 8)}{self.seconds:>8.2f}")


def _cell(count: int | None, width: int) -> str:
    return f"{'-' if count is None else count:>{width}}"


def printed(name: str) -> Iterator[Row]:
    """A row for each quantity of a mechanism of the catalogue, trees as embedding, all others as augmented equations."""
    system = get(name)
    tied = name in names(constrained=True)
    equations = system.augmented() if tied else system.embedding()
    for quantity in QUANTITIES:
        if quantity in equations.quantities:
            begin = clock.process_time()
            operations = _operations(equations, quantity, "shortest")
            seconds = clock.process_time() - begin
            begin = clock.process_time()
            named = _with_names(equations, quantity)
            named_seconds = clock.process_time() - begin
            yield Row(name, quantity, operations, {form: _other(equations, quantity, form) for form in OTHERS}, named, seconds,
                      named_seconds)


def _other(equations: Equations, quantity: str, form: str) -> int | None:
    try:
        return within(PATIENCE, lambda: _operations(equations, quantity, form))
    except TimeUp:
        return None


def _operations(equations: Equations, quantity: str, form: str) -> int | None:
    try:
        return int(sp.count_ops(equations.explicit(quantity, form=form)))
    except SymdynError:
        return None


def _with_names(equations: Equations, quantity: str) -> int | None:
    try:
        value, steps = equations.explicit(quantity, intermediates=True)
    except SymdynError:
        return None
    return int(sp.count_ops(value) + sum(sp.count_ops(step.expression) for step in steps))


def by_sympy(name: str, quantity: str) -> str:
    """The fewest operations that trigsimp, simplify and fu make of what KanesMethod gives, and by which; "-" if none ends."""
    if quantity not in kane_forms.QUANTITIES:
        return ""
    counts = {method: kane_forms.operations(name, quantity, method) for method in kane_forms.METHODS}
    least = min((count for count in counts.values() if count is not None), default=None)
    return "-" if least is None else f"{least} {next(method for method, count in counts.items() if count == least)}"


def run(only: Sequence[str] = (), against: str = "") -> int:
    """Print the table; returns how many bounds are missed.

    only      names of mechanisms; default: the catalogue
    against   "sympy": what SymPy's simplification of KanesMethod's M_tilde and k_tilde has, where it ends within a minute
    """
    missed = 0
    print(f"{HEADING}{'  SymPy' if against else ''}")
    for name in only or names():
        rows = []
        for row in printed(name):
            rows.append(row)
            other = by_sympy(name, row.quantity) if against else ""
            faults = row.faults
            if other[:1].isdigit() and row.operations is not None and int(other.split()[0]) < row.operations:
                faults.append("SymPy's form is shorter")
            print(f"{row}  {other:14}  {', '.join(faults)}".rstrip(), flush=True)
            missed += len(faults)
        missed += _slow(name, [row for row in rows if row.quantity in QUANTITIES[:3]])
    return missed


def _slow(name: str, rows: Sequence[Row]) -> int:
    """Number of missed bounds on the time of M_tilde, k_tilde and F_tilde; prints them."""
    times = []
    if len(get(name).check().coordinates) <= COORDINATES:
        times.append(("", sum(row.seconds for row in rows), LONGER.get(name, LIMIT)))
    if name in NAMED_LIMIT:
        times.append((" in named intermediates", sum(row.named_seconds for row in rows), NAMED_LIMIT[name]))
    above = [(how, seconds, limit) for how, seconds, limit in times if seconds > limit]
    for how, seconds, limit in above:
        print(f"{name:36}{seconds:.2f} s for M_tilde, k_tilde and F_tilde{how}, above {limit} s")
    return len(above)
