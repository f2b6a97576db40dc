"""Checks of equations given by hand: coordinates, columns of expressions, the mass, numbers, and which symbol stands for what."""

from __future__ import annotations

import keyword
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import sympy as sp

from symdyn.formulation.algebra import TapeAlgebra
from symdyn.formulation.equations import Symbols
from symdyn.model.faults import Faults
from symdyn.model.joints.base import listed
from symdyn.model.quantity import Quantity
from symdyn.model.symbols import (
    Acceleration,
    Coordinate,
    GivenMotion,
    Input,
    Rate,
    as_coordinate,
    described,
    symbols_of,
    time,
    with_rates,
)
from symdyn.shown import shown
from symdyn.tape import node as kinds
from symdyn.tape.recorder import Recorder


@dataclass(frozen=True)
class Part:
    """Expressions and what they may use besides parameters; moving: coordinates and t."""

    what: str
    expressions: Sequence[sp.Expr]
    moving: bool = True
    speeds: bool = False
    inputs: bool = False

    @property
    def allowed(self) -> str:
        """In words."""
        if not self.moving:
            return "parameters only"
        return "coordinates, speeds and t" if self.speeds else "coordinates and t"


class ByHand:
    """Coordinates of equations by hand; fills `faults` while it takes over what is given for them."""

    def __init__(self, coordinates: Any, name: Any) -> None:
        self.faults = Faults()
        if not isinstance(name, str) or not name.isidentifier() or keyword.iskeyword(name):
            self.faults.append(f"name is {shown(name)}; pass an identifier such as 'pendulum', it names files and functions")
        given = list(coordinates) if listed(coordinates) else [coordinates]
        if not given:
            self.faults.append("there are no coordinates; pass symbols made with sd.coordinates")
        q = [as_coordinate(c) for c in given]
        self.faults += [f"coordinate {c} is no symbol; make it with sd.coordinates" for c in q if not isinstance(c, Coordinate)]
        self.faults += [f"coordinate {c} is given {n} times" for c, n in Counter(map(str, q)).items() if n > 1]
        self.q = [c for c in q if isinstance(c, Coordinate)]
        self.n = len(q)
        # A plain symbol that is given as a coordinate is one in the expressions, too.
        self._same = {old: new for old, new in zip(given, q, strict=True) if isinstance(new, Coordinate) and old is not new}

    def expression(self, value: Any, what: str) -> sp.Expr:
        """A scalar expression in the coordinates."""
        return self.faults.expression(value, what).xreplace(self._same)

    def column(self, values: Any, what: str, labels: Sequence[str] = ()) -> list[sp.Expr]:
        """Expressions from a list, an array or a column; labels: of the entries, in messages."""
        if isinstance(values, sp.MatrixBase):
            if len(values) and 1 not in values.shape:
                self.faults.append(f"{what} is a {values.shape[0]} x {values.shape[1]} matrix; pass a column")
            values = list(values)
        if not isinstance(values, (list, tuple, np.ndarray)) or np.ma.isMaskedArray(values) or getattr(values, "ndim", 1) == 0:
            self.faults.append(f"{what} is {shown(values)}; pass a list or column of expressions")
            return []
        known = len(labels) == len(values)
        return [self.expression(v, labels[k] if known else f"{what}[{k + 1}]") for k, v in enumerate(values)]

    def mass(self, mass: Any, n: int, of: str) -> sp.Matrix:
        """The (n, n) mass matrix, from itself or from its diagonal; of: what has n entries."""
        faults = self.faults
        # SymPy evaluates text that it is to make a matrix of: every entry is looked at before.
        rows = mass.tolist() if isinstance(mass, (sp.MatrixBase, np.ndarray)) and not np.ma.isMaskedArray(mass) else mass
        rows = list(rows) if isinstance(rows, (list, tuple)) else None
        flat = rows is not None and not any(isinstance(row, (list, tuple)) for row in rows)
        if not rows or not (flat or all(isinstance(row, (list, tuple)) and len(row) == len(rows[0]) for row in rows)):
            faults.append(f"mass is {shown(mass)}; pass a square matrix, or a list for its diagonal")
            return sp.eye(n)
        M = sp.Matrix([[faults.expression(e, "mass") for e in ([row] if flat else row)] for row in rows])
        if M.shape != (n, n) and 1 in M.shape and len(M) == n:
            M = sp.diag(*M)
        if M.shape != (n, n):
            faults.append(f"mass has the shape {M.shape[0]} x {M.shape[1]}, {of} {n} entries; pass {n} x {n}")
            return sp.eye(n)
        if M != M.T:
            faults.append("mass is not symmetric; pass a symmetric matrix")
        for k in range(n):
            if M[k, k].is_number and M[k, k] < 0:
                faults.append(f"mass[{k + 1}, {k + 1}] is {M[k, k]}; pass zero or a positive number")
        if M == M.T and not M.is_diagonal() and not symbols_of(M):
            least = float(np.linalg.eigvalsh(np.array(M.tolist(), dtype=float))[0])
            if least < -1e-12 * max(abs(float(e)) for e in M):
                faults.append(f"mass has the eigenvalue {least:.6g}; pass a matrix that gives no negative kinetic energy")
        return M

    def symbols(self, parts: Sequence[Part]) -> tuple[list[sp.Symbol], list[sp.Symbol]]:
        """Parameters and inputs in the order of first use."""
        parameters: dict[sp.Symbol, None] = {}
        inputs: dict[sp.Symbol, None] = {}
        for part in parts:
            for e in part.expressions:
                for s in sorted(symbols_of(e), key=lambda a: a.name):
                    self._use(part, s, parameters, inputs)
        names = {c.name for c in self.q} | {c.dot.name for c in self.q}
        given = list(with_rates(inputs))
        for s in [*parameters, *given]:
            if s.name in names:
                self.faults.append(f"{s} is the name of a coordinate or its derivative, and of another symbol with other "
                                   "assumptions; use the same symbol everywhere, or another name")
        return list(parameters), given

    def _use(self, part: Part, s: sp.Symbol, parameters: dict[sp.Symbol, None], inputs: dict[sp.Symbol, None]) -> None:
        what, faults = part.what, self.faults
        speeds = {c.dot for c in self.q}
        named = {c.name: c for c in (*self.q, *speeds)}
        if s.name == "t" and s != time:
            faults.append(f"{what} uses a symbol t with assumptions, which is not the time; use symdyn.t")
        elif isinstance(s, Quantity):
            faults.append(f"{what} uses {s}, but there are no bodies, joints and constraints by name here; write it out, or "
                          "describe a System")
        elif isinstance(s, Acceleration) or (isinstance(s, Rate) and not part.speeds):
            faults.append(f"{what} uses {s}; it may use {part.allowed}")
        elif s == time or s in self.q or s in speeds:
            if not part.moving:
                faults.append(f"{what} depends on {s}, but must be constant")
        elif isinstance(s, (Coordinate, Rate)) and s.name in named:
            faults.append(f"{what} uses {s}, {described(s)}, but {s} among the coordinates is {described(named[s.name])}; use "
                          "the same symbol in both (SymPy's q(t) stands for a coordinate without assumptions)")
        elif isinstance(s, (Coordinate, Rate)):
            faults.append(f"{what} uses {s}, which is not among the coordinates {', '.join(map(str, self.q))}; add it, or "
                          "use a parameter in its place")
        elif isinstance(s, Input):
            if part.inputs or (part.moving and isinstance(s, GivenMotion)):
                inputs[s] = None
            else:
                faults.append(f"{what} uses the input {s}; it may use {part.allowed}")
        else:
            parameters[s] = None


def recording(symbols: Symbols) -> TapeAlgebra:
    """A tape of its own with a leaf for every symbol; speeds are the derivatives of the coordinates."""
    recorder = Recorder()
    leaves: dict[sp.Basic, Any] = {time: recorder.leaf("t", kinds.TIME)}
    for group, kind in ((symbols.coordinates, kinds.COORDINATE), (symbols.speeds, kinds.SPEED),
                        (symbols.states, kinds.STATE), (symbols.inputs, kinds.INPUT),
                        (symbols.parameters, kinds.PARAMETER)):
        leaves.update({s: recorder.leaf(s.name, kind) for s in group})
    return TapeAlgebra(recorder, leaves)
