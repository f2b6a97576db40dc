"""Velocities, accelerations and inertial forces in their named parts, made to be read."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING, Any, ClassVar, Self

import numpy as np
import sympy as sp

from symdyn.frames.numbers import numbers
from symdyn.report.simplify import simplified

if TYPE_CHECKING:
    from symdyn.given import Array, Motions, Times

# Seconds that tidying up for print may take, for all parts together.
PATIENCE = 2.0
# Parts with more operations than this are not written out: nobody reads them, and tidying them takes too long.
TOO_LONG = 300


@dataclass(frozen=True, repr=False)
class _Parts:
    """Parts that add up to `total`; each (3, 1).

    point, through, seen_from, components   names of the point and of the frames
    """

    point: str
    through: str
    seen_from: str
    components: str
    _labels: ClassVar[dict[str, str]] = {}
    _heading: ClassVar[str] = ""
    _symbol: ClassVar[str] = ""

    def _named(self) -> dict[str, Any]:
        return {f.name: getattr(self, f.name) for f in fields(self) if f.name in self._labels}

    @property
    def total(self) -> Array:
        """The sum of the parts.

        >>> q = sd.coordinates("q")
        >>> n = sd.Frame("n")
        >>> b = n.frame("b", sd.rotation.about("Z", q))
        >>> b.point("P", [1, 0, 0]).velocity_parts(components=b).total.T
        Matrix([[0, q_dot, 0]])
        """
        first, *others = self._named().values()
        for other in others:
            first = first + other
        return first

    def subs(self, *args: Any, **options: Any) -> Self:
        """The same with symbols replaced, as SymPy's subs.

        >>> q, l = sd.coordinates("q"), sd.parameters("l")
        >>> b = sd.Frame("n").frame("b", sd.rotation.about("Z", q))
        >>> b.point("P", [l, 0, 0]).velocity_parts(components=b).subs(l, 2).transport.T
        Matrix([[0, 2*q_dot, 0]])
        """
        return replace(self, **{name: part.subs(*args, **options) for name, part in self._named().items()})

    def at(self, values: Motions | None = None, t: Times | None = None) -> Self:
        """The same in numbers: arrays (3,), or (n_t, 3) at an array of times; values, t and errors as for `numbers`.

        >>> q = sd.coordinates("q")
        >>> b = sd.Frame("n").frame("b", sd.rotation.about("Z", q))
        >>> b.point("P", [1, 0, 0]).velocity_parts(components=b).at({q: 0.0, q.dot: 3.0}).transport
        array([0., 3., 0.])
        """
        result: dict[str, Any] = {name: numbers(sp.Matrix(part), values, t) for name, part in self._named().items()}
        return replace(self, **result)

    def _readable(self) -> dict[str, Any]:
        parts = {**self._named(), "total": self.total}
        if isinstance(parts["total"], np.ndarray):
            return parts
        return {name: part if _operations(part) > TOO_LONG else simplified(part, PATIENCE / len(parts))
                for name, part in parts.items()}

    def __repr__(self) -> str:
        names = {"P": self.point, "b": self.through, "n": self.seen_from, "c": self.components}
        lines = [f"  {name:12}{_text(part)}" for name, part in self._readable().items()]
        return "\n".join([self._heading.format(**names), *lines])

    def _repr_latex_(self) -> str:
        parts = self._readable()
        total = parts.pop("total")
        terms = " + ".join(rf"\underbrace{{{_latex(part)}}}_{{\text{{{self._labels[name]}}}}}" for name, part in parts.items())
        return rf"$\displaystyle {self._symbol.format(c=self.components, P=self.point)} = {terms} = {_latex(total)}$"


@dataclass(frozen=True, repr=False)
class VelocityParts(_Parts):
    """v = origin + relative + transport, (3, 1) each, m/s.

    origin      velocity of the moving frame's origin
    relative    velocity seen from the moving frame
    transport   omega x r

    >>> s, phi = sd.coordinates("s phi")
    >>> b = sd.Frame("n").frame("b", sd.rotation.about("Z", phi))
    >>> b.point("P", [s, 0, 0]).velocity_parts(components=b)
    velocity of P seen from n, by way of b, components in b
      origin      [0, 0, 0]
      relative    [s_dot, 0, 0]
      transport   [0, s*phi_dot, 0]
      total       [s_dot, s*phi_dot, 0]
    """

    origin: Array
    relative: Array
    transport: Array
    _labels = {"origin": "origin", "relative": "relative", "transport": "transport"}
    _heading = "velocity of {P} seen from {n}, by way of {b}, components in {c}"
    _symbol = r"{{}}^{{{c}}}\mathbf{{v}}_{{{P}}}"


@dataclass(frozen=True, repr=False)
class AccelerationParts(_Parts):
    """a = origin + relative + euler + centripetal + coriolis, (3, 1) each, m/s^2.

    origin        acceleration of the moving frame's origin
    relative      acceleration seen from the moving frame
    euler         alpha x r
    centripetal   omega x (omega x r)
    coriolis      2 omega x v_rel

    >>> s, phi = sd.coordinates("s phi")
    >>> b = sd.Frame("n").frame("b", sd.rotation.about("Z", phi))
    >>> b.point("P", [s, 0, 0]).acceleration_parts(components=b)
    acceleration of P seen from n, by way of b, components in b
      origin      [0, 0, 0]
      relative    [s_ddot, 0, 0]
      euler       [0, s*phi_ddot, 0]
      centripetal [-s*phi_dot**2, 0, 0]
      coriolis    [0, 2*phi_dot*s_dot, 0]
      total       [-s*phi_dot**2 + s_ddot, s*phi_ddot + 2*phi_dot*s_dot, 0]
    """

    origin: Array
    relative: Array
    euler: Array
    centripetal: Array
    coriolis: Array
    _labels = {"origin": "origin", "relative": "relative", "euler": "Euler", "centripetal": "centripetal",
               "coriolis": "Coriolis"}
    _heading = "acceleration of {P} seen from {n}, by way of {b}, components in {c}"
    _symbol = r"{{}}^{{{c}}}\mathbf{{a}}_{{{P}}}"


@dataclass(frozen=True, repr=False)
class InertialForces(_Parts):
    """The forces that a moving frame adds to the others: m a_rel = F + total; (3, 1) each, N.

    origin        -m a_O
    euler         -m alpha x r
    centrifugal   -m omega x (omega x r)
    coriolis      -2 m omega x v_rel

    >>> s, phi = sd.coordinates("s phi")
    >>> m = sd.parameters("m")
    >>> b = sd.Frame("n").frame("b", sd.rotation.about("Z", phi))
    >>> b.point("P", [s, 0, 0]).inertial_forces(m)
    inertial forces on P felt in b, inertial is n, components in b
      origin      [0, 0, 0]
      euler       [0, -m*s*phi_ddot, 0]
      centrifugal [m*s*phi_dot**2, 0, 0]
      coriolis    [0, -2*m*phi_dot*s_dot, 0]
      total       [m*s*phi_dot**2, -m*(s*phi_ddot + 2*phi_dot*s_dot), 0]
    """

    origin: Array
    euler: Array
    centrifugal: Array
    coriolis: Array
    _labels = {"origin": "origin", "euler": "Euler", "centrifugal": "centrifugal", "coriolis": "Coriolis"}
    _heading = "inertial forces on {P} felt in {b}, inertial is {n}, components in {c}"
    _symbol = r"{{}}^{{{c}}}\mathbf{{F}}_{{{P},\text{{inertial}}}}"


def _operations(part: Any) -> int:
    return 0 if isinstance(part, np.ndarray) else int(sp.count_ops(part))


def _text(part: Any) -> str:
    if isinstance(part, np.ndarray):
        return np.array2string(part, precision=6, suppress_small=True, prefix=" " * 14)
    operations = _operations(part)
    return str(list(part)) if operations <= TOO_LONG else f"(3 components, {operations} operations)"


def _latex(part: Any) -> str:
    operations = _operations(part)
    if operations > TOO_LONG:
        return rf"(3\times 1,\ {operations}\ \text{{operations}})"
    return str(sp.latex(sp.Matrix(np.round(part, 6)) if isinstance(part, np.ndarray) else part))
