"""Derivatives of the accelerations by q and u, compared with those of the peers: `symdyn bench peers --derivatives`.

CasADi's C code is its Jacobian of Pinocchio's articulated-body algorithm, parameters given at run time; Pinocchio's C++ is
computeABADerivatives. symdyn computes the derivative of x_dot by x.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any

from symdyn.backend.right_side import RightSide
from symdyn.errors import SymdynError
from symdyn.formulation.equations import Equations
from symdyn.functions.tapes import all_columns_of, columns_of, function_tape
from symdyn.lab.peers.benchmark import fastest, random_state
from symdyn.lab.peers.casadi_peer import CasadiPeer
from symdyn.lab.peers.description import describe
from symdyn.lab.peers.models import Bound, Case, Timed
from symdyn.lab.peers.pinocchio_peer import PinocchioDerivativesPeer
from symdyn.lab.peers.symdyn_peer import derivatives_program
from symdyn.lab.peers.timing import agree, timed
from symdyn.model.system import System
from symdyn.systems import get

Peer = CasadiPeer | PinocchioDerivativesPeer
NAME = "jacobian_x"
LANES = (4, 8)
LEGEND = """\
ops: + - * / sqrt sin cos of all columns that depend on the state; in 4, 8 lanes: those that are executed where one operation on a
vector, a column in each lane, counts once; difference: the largest between programs, relative to the norm. CasADi: C of the
Jacobian of Pinocchio's articulated-body algorithm, parameters at run time; Pinocchio: computeABADerivatives in C++."""
_WIDTHS = (20, 12, 8, 10, 10, 8, 12, 11, 14, 12, 15, 18)
_HEADING = ("model", "formulation", "ops", "4 lanes", "8 lanes", "ns", "CasADi ops", "CasADi ns", "Pinocchio ns", "difference",
            "symdyn/CasADi", "Pinocchio/symdyn")


CASES = {
    "n_link_pendulum(5)": Case(partial(get, "n_link_pendulum", n=5), Bound(800, 0.25, 25.0)),
    "spatial_chain(7)": Case(partial(get, "spatial_chain", n=7), Bound(4_800, 0.25, 7.0)),
    "spatial_chain(12)": Case(partial(get, "spatial_chain", n=12), Bound(17_000, 0.25, 4.0)),
    "puma560": Case(partial(get, "puma560"), Bound(2_200, 0.25)),
}


@dataclass(frozen=True)
class Row(Timed):
    """Measurements of one mechanism.

    operations         of all columns one by one; executed: with 4 and 8 lanes, where lanes are used
    casadi_operations  of CasADi's Jacobian, None where it was not measured
    times              program -> ns of one evaluation
    difference         of the derivatives, relative to their norm, the largest between programs
    """

    model: str
    formulation: str
    operations: int
    executed: tuple[int, ...]
    casadi_operations: int | None
    times: dict[str, float]
    difference: float
    bound: Bound = field(default=Bound())

    def misses(self) -> list[str]:
        """Bounds that are missed, in words; what was not measured misses nothing."""
        return self.bound.missed(self.executed[-1], self.over("symdyn", "casadi"), self.over("pinocchio", "symdyn"), 3)


def cases(names: Sequence[str] | None) -> dict[str, Case]:
    """The named mechanisms, all by default; `spatial_chain` stands for those of every length.

    Raises SymdynError for a name that there is not.
    """
    short = {c: c.partition("(")[0] for c in CASES}
    unknown = [n for n in names or () if n not in short and n not in short.values()]
    if unknown:
        raise SymdynError(f"there is no benchmark model {', '.join(unknown)} for derivatives; there are {', '.join(CASES)}")
    return {c: case for c, case in CASES.items() if not names or c in names or short[c] in names}


def benchmark(name: str, case: Case, peers: Sequence[Peer], repeats: int,
              make_equations: Callable[[System], Equations] | None = None) -> Row:
    """Count and time symdyn's derivatives and those of the peers on a mechanism.

    make_equations   symdyn's equations of a System; default: those with the fewest operations of derivatives in 8 lanes, of the
                     mass matrix and what symdyn would choose
    Raises SymdynError if they do not compute the same at the state of the measurement.
    """
    system = case.make()
    equations, description = (make_equations or leanest)(system), describe(system.check())
    state = random_state(equations)
    programs, casadi_operations = [derivatives_program(equations, state)], None
    for peer in peers:
        if isinstance(peer, CasadiPeer):
            form = peer.derivatives_form(description)
            casadi_operations = form.operations
            programs.append(peer.derivatives_program(form, description, state))
        else:
            programs.append(peer.derivatives_program(description, state))
    difference = agree(programs, name, "derivatives")
    times = {who: seconds * 1e9 for who, seconds in timed(programs, repeats).items()}
    operations = function_tape(equations, NAME).operations
    return Row(name, equations.formulation, operations, executed(equations, operations), casadi_operations, times, difference,
               case.bound)


def leanest(system: System) -> Equations:
    """The equations with the fewest operations of derivatives in 8 lanes, of the mass matrix and what symdyn would choose."""
    return min(system.embedding(), fastest(system), key=lambda e: executed(e, function_tape(e, NAME).operations)[-1])


def executed(equations: Equations, operations: int) -> tuple[int, ...]:
    """Operations of the derivatives that are executed with 4 and 8 lanes."""
    if columns_of(equations, NAME, RightSide()) is None:
        return tuple(operations for _ in LANES)
    columns = all_columns_of(equations, NAME, RightSide())
    assert columns is not None
    return tuple(columns.operations(lanes) for lanes in LANES)


def heading() -> str:
    """The line above the rows."""
    return f"{_aligned(_HEADING)}  bound"


def line(row: Row) -> str:
    """The row, its bound and the verdict."""
    times, ratios = row.times, (row.over("symdyn", "casadi"), row.over("pinocchio", "symdyn"))
    cells = [row.model, row.formulation, row.operations, *row.executed, _whole(times.get("symdyn")), row.casadi_operations,
             _whole(times.get("casadi")), _whole(times.get("pinocchio")), f"{row.difference:.0e}",
             *[None if r is None else f"{r:.{digits}f}" for r, digits in zip(ratios, (3, 1), strict=True)]]
    return f"{_aligned(['-' if cell is None else str(cell) for cell in cells])}  {verdict(row)}".rstrip()


def verdict(row: Row) -> str:
    """The bound, then MET or MISSED with what is missed; a peer that is missing misses no bound."""
    b = row.bound
    parts = [(b.operations, "8 lanes <= {}"), (b.ratio, "symdyn/CasADi <= {:.2f}"), (b.pinocchio, "Pinocchio/symdyn >= {:.1f}")]
    words = ", ".join(text.format(value) for value, text in parts if value is not None)
    if not words:
        return ""
    missed = row.misses()
    unknown = [b.ratio is not None and row.over("symdyn", "casadi") is None,
               b.pinocchio is not None and row.over("pinocchio", "symdyn") is None]
    met = "MET" + (", as far as it could be measured" if any(unknown) else "")
    return f"{words}  MISSED: {'; '.join(missed)}" if missed else f"{words}  {met}"


def record(row: Row) -> dict[str, Any]:
    """The row for JSON."""
    ratios = {"symdyn_over_casadi": row.over("symdyn", "casadi"), "pinocchio_over_symdyn": row.over("pinocchio", "symdyn")}
    return {**dataclasses.asdict(row), "ratios": ratios, "missed": row.misses()}


def _aligned(cells: Sequence[str]) -> str:
    """Cells in columns, the first two to the left."""
    return "".join(f"{cell:<{width}}" if k < 2 else f"{cell:>{width}}" for k, (cell, width) in enumerate(
        zip(cells, _WIDTHS, strict=True)))


def _whole(value: float | None) -> str | None:
    return None if value is None else f"{value:.0f}"
