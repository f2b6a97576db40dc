"""What printing takes: operations of the quantities of the catalogue in every form, and processor time."""

from __future__ import annotations

import time as clock
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import sympy as sp

from symdyn.errors import SymdynError
from symdyn.formulation.equations import Equations
from symdyn.lab import kane_forms
from symdyn.report.limit import TimeUp, within
from symdyn.systems import get, names

QUANTITIES = ("M_tilde", "k_tilde", "F_tilde", "C", "C_r", "F_d")
FORMS = ("polynomial", "fourier")
# Coordinates up to which the three quantities of the equations of motion take LIMIT seconds at most, or LONGER.
COORDINATES, LIMIT, LONGER = 6, 0.5, {"puma560": 2.0}
# Seconds after which another form is left out of the table.
PATIENCE = 30.0
HEADING = f"{'mechanism':36}{'quantity':10}{'operations':>11}{'polynomial':>12}{'Fourier':>10}{'with names':>12}{'s':>8}"


@dataclass(frozen=True)
class Row:
    """One quantity: operations in its shortest form and in others (None: too large), and in named intermediates together with
    these; seconds of the processor for the shortest form."""

    mechanism: str
    quantity: str
    operations: int | None
    others: tuple[int | None, ...]
    named: int | None
    seconds: float

    @property
    def longer(self) -> bool:
        """Whether another form has fewer operations, which must not be."""
        return any(count is not None and (self.operations is None or count < self.operations) for count in self.others)

    def __str__(self) -> str:
        counts = "".join(f"{'-' if count is None else count:>{width}}" for count, width in zip((*self.others, self.named),
                                                                                             (12, 10, 12), strict=True))
        own = "-" if self.operations is None else self.operations
        return f"{self.mechanism:36}{self.quantity:10}{own:>11}{counts}{self.seconds:>8.2f}"


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
            yield Row(name, quantity, operations, tuple(_other(equations, quantity, form) for form in FORMS),
                      _with_names(equations, quantity), seconds)


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
            longer = row.longer or (other[:1].isdigit() and row.operations is not None and int(other.split()[0]) < row.operations)
            print(f"{row}  {other:14}{'  another form is shorter' if longer else ''}".rstrip(), flush=True)
            missed += longer
        seconds = sum(row.seconds for row in rows if row.quantity in QUANTITIES[:3])
        if len(get(name).check().coordinates) <= COORDINATES and seconds > LONGER.get(name, LIMIT):
            print(f"{name:36}{seconds:.2f} s for M_tilde, k_tilde and F_tilde, above {LONGER.get(name, LIMIT)} s")
            missed += 1
    return missed
