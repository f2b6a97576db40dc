"""The scalars a derivation runs on: nodes of a tape, one leaf for each symbol of the model."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from fractions import Fraction
from typing import Any

import numpy as np
import sympy as sp

from symdyn.errors import UnsupportedExpression
from symdyn.model.quantity import Quantity, quantities_in
from symdyn.model.record import Model, joint_speeds
from symdyn.model.symbols import Coordinate, GivenMotion, GivenRate, flat, time
from symdyn.spatial.vectors import vector
from symdyn.tape import node as kinds
from symdyn.tape.recorder import Recorder
from symdyn.tape.sympy_bridge import record_expression


class TapeAlgebra:
    """Records on a tape; knows which leaf each symbol of the model is.

    leaves    symbol -> node, for coordinates, speeds, states, inputs, parameters, t and the derivatives of speeds
    measured  records points, orientations and distances that stand in expressions; None where there are no bodies
    """

    # A difference of terms of size 1 that is below this is rounding error alone: 64 units of the last place of doubles.
    rounding: Any = Fraction(1, 2**46)

    def __init__(self, recorder: Recorder, leaves: dict[sp.Basic, Any]) -> None:
        self.recorder = recorder
        self.leaves = leaves
        self.measured: Callable[[Quantity], Any] | None = None
        self._memory: dict[sp.Basic, Any] = {}
        self.sin, self.cos, self.sqrt = recorder.sin, recorder.cos, recorder.sqrt
        self.section = recorder.section
        self.positive = recorder.positive

    def within(self, values: Mapping[sp.Basic, Any]) -> TapeAlgebra:
        """The same algebra with scalars that stand for some symbols, in place of their leaves."""
        other = TapeAlgebra(self.recorder, {**self.leaves, **values})
        other.measured = self.measured
        return other

    def divisor(self, value: Any, least: Any, reason: str) -> Any:
        """A value to divide by; where it is not above `least` when the code runs, that stops and says the reason."""
        return self.recorder.guard(value, value - least, reason)

    def expression(self, e: Any) -> Any:
        """A SymPy expression on the tape. Raises UnsupportedExpression, which names the part of the model where it stands."""
        known = self._memory.get(e)
        if known is not None:
            return known
        quantities = [q for q in quantities_in([e]) if q not in self.leaves and q not in self._memory]
        if quantities and self.measured is not None:
            # They stay out of the leaves, which are printed under the names of their symbols.
            self._memory.update({q: self.measured(q) for q in quantities})
        try:
            return record_expression(self.recorder, e, self.leaves, self._memory)
        except (UnsupportedExpression, ZeroDivisionError) as error:
            where = f"{self.recorder.heading}: " if self.recorder.heading else ""
            raise UnsupportedExpression(f"{where}{error}") from None

    def constants(self, values: Iterable[Any]) -> np.ndarray:
        """A vector of expressions on the tape."""
        entries = flat(values) if isinstance(values, sp.MatrixBase) else values
        return vector(*[self.expression(e) for e in entries])

    def matrix(self, values: sp.MatrixBase) -> np.ndarray:
        """A matrix of expressions on the tape."""
        return self.constants(values).reshape(values.shape)

    def by_time(self, coordinates: Iterable[sp.Symbol], rates: Iterable[Any]) -> dict[Any, Any]:
        """Seeds of the derivative by time at constant speeds: q -> q_dot, t -> 1, and given motions z -> z_dot -> z_ddot."""
        return {**dict(zip([self.leaves[q] for q in coordinates], rates, strict=True)), **given_by_time(self.leaves)}

    def name(self, name: str, value: Any) -> Any:
        """Name the entries of a quantity by number."""
        return self.recorder.name(name, value)

    def vector(self, name: str, value: Any) -> Any:
        """Name the components of a vector or matrix in space x, y, z."""
        return self.recorder.name(name, value, axes=True)


def given_by_time(leaves: Mapping[sp.Basic, Any]) -> dict[Any, Any]:
    """Seeds of the derivative by time of what is given over time alone: t -> 1, z -> z_dot -> z_ddot."""
    given = [s for s in leaves if isinstance(s, (GivenMotion, GivenRate))]
    return {leaves[time]: 1, **{leaves[s]: leaves[s.dot] for s in given}}


def leaves_of(model: Model, recorder: Recorder) -> dict[sp.Basic, Any]:
    """A leaf for every symbol of the model; derivatives of coordinates stand for what the joints make of the speeds."""
    leaves: dict[sp.Basic, Any] = {time: recorder.leaf("t", kinds.TIME)}
    for symbols, kind in ((model.coordinates, kinds.COORDINATE), (model.speeds, kinds.SPEED),
                          ([z.symbol for z in model.states], kinds.STATE), (model.inputs, kinds.INPUT),
                          (model.parameters, kinds.PARAMETER)):
        for symbol in symbols:
            leaves[symbol] = recorder.leaf(symbol.name, kind)
    return leaves


def accelerations_of(speeds: Iterable[sp.Symbol], recorder: Recorder, leaves: dict[sp.Basic, Any]) -> list[Any]:
    """Leaves for given accelerations u_dot, which become known under the symbols that they are printed with."""
    made = {u: recorder.leaf(f"{u.name}_dot", kinds.ACCELERATION) for u in speeds}
    for u, leaf in made.items():
        leaves.setdefault(u.dot, leaf)
    return list(made.values())


def add_rates(model: Model, algebra: Any) -> list[Any]:
    """q_dot = N(q) u, entry by entry; also makes each coordinate's `.dot` known to the algebra."""
    rates: dict[sp.Basic, Any] = {}
    for joint in model.joints:
        if all(isinstance(q, Coordinate) for q in joint.coordinates):
            s = [algebra.leaves[q] for q in joint.coordinates]
            u = [algebra.leaves[v] for v in joint_speeds(joint)]
            with algebra.section(f"joint {joint.name}"):
                rates.update(zip(joint.coordinates, joint.rates(algebra, s, u), strict=True))
        else:
            rates.update({q: algebra.leaves[v] for q, v in zip(joint.coordinates, joint_speeds(joint), strict=True)
                          if isinstance(q, Coordinate)})
    rates.update({q: algebra.leaves[q.dot] for q in model.coordinates if q not in rates})
    for q, rate in rates.items():
        algebra.leaves[q.dot] = rate
    return [rates[q] for q in model.coordinates]
