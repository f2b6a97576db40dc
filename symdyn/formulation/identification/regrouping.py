"""Factors by which a dependent column of a regressor follows from independent ones, as expressions of the model's parameters.

The dependence is known from numbers; here the factors are found exactly. The equations of motion are linear in u_dot, and
what they depend on follows from their derivatives by u_dot and u and their value at rest. At states where sines, cosines
and coordinates are short fractions these fold to short expressions of parameters, most of them zero, so that a factor is
mostly one entry divided by another.
"""

from __future__ import annotations

import random
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np

from symdyn.errors import SymdynError
from symdyn.spatial.vectors import vector
from symdyn.tape.differentiate import forward
from symdyn.tape.floats import evaluate_rows
from symdyn.tape.node import ACCELERATION, COORDINATE, SPEED, TIME, Node
from symdyn.tape.passes import substitute
from symdyn.tape.recorder import Recorder
from symdyn.tape.tape import Tape, reachable

_HALF = Fraction(1, 2)
_TURNS = [(0, 1), (1, 0), (Fraction(3, 5), Fraction(4, 5)), (-1, 0), (Fraction(4, 5), Fraction(-3, 5)), (0, -1)]
_LENGTHS = [0, 1, -1, 2, _HALF]
_UNITS = [(1, 0, 0, 0), (0, 1, 0, 0), (_HALF, _HALF, _HALF, _HALF), (Fraction(3, 5), 0, Fraction(4, 5), 0),
          (_HALF, -_HALF, _HALF, -_HALF), (Fraction(4, 5), 0, 0, Fraction(3, 5))]
_STATES = 16
_ZERO = 1e-9


def factors(recorder: Recorder, columns: np.ndarray, dependent: np.ndarray, parameters: Mapping[str, float],
            unit_groups: Sequence[Sequence[str]]) -> list[Any]:
    """Factors x, on the tape, with columns @ x = dependent at every state.

    columns      (n_u, n) of the regressor, independent; dependent (n_u,): a column that they give
    parameters   numbers for the parameters, which decide what is zero
    unit_groups  coordinates that form a unit vector, by name
    Raises SymdynError if they cannot be found.
    """
    rows = _rows_of(recorder, np.column_stack([columns, dependent]))
    found: dict[tuple[Any, ...], None] = {}
    for count, state in enumerate(_states(rows, unit_groups), start=1):
        at = vector(*substitute(tuple(rows.ravel()), state, recorder)).reshape(rows.shape)
        found.update(dict.fromkeys(map(tuple, at.tolist())))
        if count in (4, _STATES):
            result = _Elimination.of(recorder, list(found), parameters).solve()
            if result is not None:
                return result
    raise SymdynError(f"a column of the regressor depends on {columns.shape[1]} others, but {_STATES} states did not show how; "
                      "describe the joints by plain coordinates rather than by expressions of them")


def _rows_of(recorder: Recorder, Y: np.ndarray) -> np.ndarray:
    """Rows that determine Y: its derivatives by u_dot and by u, and Y itself, all at u = u_dot = 0."""
    moving = [n for n in reachable(Y.ravel()) if n.op == "leaf" and n.mask & (SPEED | ACCELERATION)]
    entries: list[Any] = Y.ravel().tolist()
    values = entries + [e for leaf in moving for e in forward(recorder, entries, {leaf: 1})]
    return vector(*substitute(tuple(values), dict.fromkeys(moving, 0), recorder)).reshape(-1, Y.shape[1])


def _states(rows: np.ndarray, unit_groups: Sequence[Sequence[str]]) -> Iterator[dict[Node, Any]]:
    """Numbers for coordinates and time; for a coordinate of which only sine and cosine occur, for these."""
    stream = random.Random(1)
    nodes = reachable(rows.ravel())
    leaves = {n.args[1]: n for n in nodes if n.op == "leaf" and n.mask & (COORDINATE | TIME)}
    turning = {leaf: [n for n in nodes if leaf in n.args] for leaf in leaves.values()}
    turning = {leaf: used for leaf, used in turning.items() if {n.op for n in used} <= {"sin", "cos"}}
    grouped = {name for group in unit_groups for name in group}
    for count in range(_STATES):
        def pick(choices: list[Any], first: bool = count == 0) -> Any:
            return choices[0] if first else stream.choice(choices)

        state: dict[Node, Any] = {}
        for group in unit_groups:
            state.update({leaves[name]: value for name, value in zip(group, pick(_UNITS), strict=True) if name in leaves})
        for name, leaf in leaves.items():
            if leaf in turning:
                s, c = pick(_TURNS)
                state.update({n: s if n.op == "sin" else c for n in turning[leaf]})
            elif name not in grouped:
                state[leaf] = pick(_LENGTHS)
        yield state


@dataclass
class _Elimination:
    """Linear equations A x = b on the tape, each with its numbers at some parameters, (m, n + 1)."""

    rows: np.ndarray
    numbers: np.ndarray
    costs: list[tuple[bool, int]]

    @classmethod
    def of(cls, recorder: Recorder, rows: Sequence[tuple[Any, ...]], parameters: Mapping[str, float]) -> _Elimination:
        array = np.array(rows, dtype=object)
        numbers = evaluate_rows(Tape.of(recorder, rows=array), parameters, 1)["rows"][0]
        array[np.abs(numbers) <= _ZERO * np.abs(numbers).max(initial=1.0)] = 0
        kept = [k for k in range(len(array)) if any(isinstance(e, Node) or e != 0 for e in array[k])]
        costs = [(any(isinstance(e, Node) for e in array[k, :-1]), len(reachable(array[k]))) for k in kept]
        return cls(array[kept], numbers[kept], costs)

    def solve(self) -> list[Any] | None:
        """x, (n,); None if the equations leave something open. Pivots where the fewest unknowns are left, and numbers first."""
        n = self.rows.shape[1] - 1
        open_, order = set(range(n)), []
        while open_:
            best = min(((len(columns), *self.costs[row], row) for row in range(len(self.rows))
                        if (columns := self._columns(row, open_))), default=None)
            if best is None:
                return None
            row = best[-1]
            column = min(self._columns(row, open_), key=lambda k: (isinstance(self.rows[row, k], Node), k))
            pivot, at_pivot = self.rows[row].copy(), self.numbers[row].copy()
            order.append((column, pivot))
            open_.remove(column)
            for other in range(len(self.rows)):
                if not self._nonzero(other, column):
                    continue
                factor, number = self.rows[other, column] / pivot[column], self.numbers[other, column] / at_pivot[column]
                for k in (*open_, n):
                    self.rows[other, k] = self.rows[other, k] - factor * pivot[k]
                    self.numbers[other, k] = self.numbers[other, k] - number * at_pivot[k]
                self.rows[other, column], self.numbers[other, column] = 0, 0.0
        x: list[Any] = [0] * n
        for column, pivot in reversed(order):
            total = pivot[n]
            for k in range(n):
                if k != column:
                    total = total - pivot[k] * x[k]
            x[column] = total / pivot[column]
        return x

    def _columns(self, row: int, open_: set[int]) -> list[int]:
        return [k for k in sorted(open_) if self._nonzero(row, k)]

    def _nonzero(self, row: int, column: int) -> bool:
        return bool(abs(self.numbers[row, column]) > _ZERO)
