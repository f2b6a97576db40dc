"""Loads that depend on what they bring about: friction by a reaction, a creep force by a multiplier.

Let r be the accelerations, multipliers and reactions that stand in the loads, and psi = phi(r) the values of these loads. The
equations of motion are linear in the loads, so r = r_0 + G psi with r_0 and G known at every state, and what is left is

    r = r_0 + G phi(r)

of as many equations as there are entries of r. Where phi is linear, it is solved by Cramer's rule. Where it is linear but for
absolute values (Coulomb friction by |N|; Max and Min are absolute values, too), every combination of signs is linear, and there
is exactly one solution if det(I - G phi') is positive for all of them: a piecewise linear map of that kind is one to one, and
where the determinants differ in sign there are states with two solutions and states with none (a rod that jams: Painleve).
Otherwise Newton's method starts from r_0, and the determinants are those at its end.

Source: Samelson, Thrall and Wesler, A partition theorem for Euclidean n-space, 1958; Painleve, Sur les lois du frottement de
glissement, 1895.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import product
from typing import Any

import numpy as np
import sympy as sp

from symdyn.errors import ModelError
from symdyn.formulation.algebra import TapeAlgebra
from symdyn.model.elements import Validity
from symdyn.model.quantity import Quantity, quantities_in
from symdyn.spatial.vectors import vector
from symdyn.tape.differentiate import jacobian
from symdyn.tape.node import SEED, Node
from symdyn.tape.passes import substitute
from symdyn.tape.tape import reachable

# Absolute values of unknowns, and unknowns: more would be long statements.
MOST_SIGNS, MOST_UNKNOWNS = 4, 6
# Newton's steps: they are statements, and the last must be below CONVERGED of the unknowns.
STEPS = 10
CONVERGED = Fraction(1, 10**9)
# Below this determinant a run reports that it comes close to jamming.
LEAST_MARGIN = 1e-3
# Below this the root of a sum of squares is taken to be smooth: its derivative at zero would not be a number.
LEAST_SQUARE = sp.Rational(1, 10**280)
_JUMPING = (sp.sign, sp.Heaviside, sp.floor, sp.ceiling, sp.Piecewise)


def implicit(expressions: Sequence[sp.Expr]) -> list[sp.Expr]:
    """Those of the expressions that hold accelerations, multipliers or reactions, each once."""
    return [e for e in dict.fromkeys(expressions)
            if any(q.level == 2 and q.measure.kind != "contact" for q in quantities_in([e]))]


@dataclass(frozen=True)
class Settled:
    """Expression of a load -> its value; validity: check of the smallest determinant of I - G phi', 1 without such loads."""

    values: Mapping[sp.Expr, Any]
    validity: Validity


def solve(algebra: TapeAlgebra, name: str, leaves: Mapping[sp.Expr, Node], measured: Callable[[Quantity], Any]) -> Settled:
    """Solve for the loads.

    leaves     what stood for the expressions where `measured` was recorded
    measured   records accelerations, multipliers and reactions under these loads
    name       of the model, for messages
    Raises ModelError for loads that jump with what they depend on, or that depend on too much.
    """
    with algebra.section("loads that depend on accelerations, multipliers or reactions"):
        return _Implicit(algebra, name, leaves, measured).settled()


class _Implicit:
    def __init__(self, algebra: TapeAlgebra, name: str, leaves: Mapping[sp.Expr, Node],
                 measured: Callable[[Quantity], Any]) -> None:
        self.algebra, self.recorder = algebra, algebra.recorder
        self.loads = list(leaves)
        self.unknowns = [q for q in quantities_in(self.loads) if q.level == 2]
        self.listed = listed = ", ".join(map(str, self.unknowns))
        self.margin: Any = 1
        self.reason = (f"the loads that depend on {listed} have no solution or more than one: the mechanism jams there; less "
                       "friction, or elasticity where it jams, leaves one")
        if len(self.unknowns) > MOST_UNKNOWNS:
            raise ModelError([f"the loads depend on {len(self.unknowns)} accelerations, multipliers and reactions, {listed}; "
                              f"{MOST_UNKNOWNS} are taken at most"], name)
        smooth = [_continuous(e, set(self.unknowns), name) for e in self.loads]
        self.signs = _absolute_values(smooth, set(self.unknowns))
        if len(self.signs) > MOST_SIGNS:
            raise ModelError([f"the loads hold {len(self.signs)} absolute values of accelerations, multipliers and reactions "
                              f"(Max and Min are such, too); {MOST_SIGNS} are taken at most"], name)
        psi = list(leaves.values())
        values = [measured(q) for q in self.unknowns]
        self.G = jacobian(self.recorder, values, psi, "forward")
        self.r_0 = vector(*substitute(tuple(values), dict.fromkeys(psi, 0), self.recorder))
        self.r = [self.recorder.leaf(f"implicit_{k + 1}", SEED) for k in range(len(self.unknowns))]
        self.branches = [self._branch(smooth, signs) for signs in product((1, -1), repeat=len(self.signs))]

    def settled(self) -> Settled:
        r = self._piecewise_linear() if all(self._linear(phi) for phi, _ in self.branches) else self._newton()
        at = self.algebra.within(dict(zip(self.unknowns, self.algebra.name("implicit", r), strict=True)))
        return Settled({e: at.expression(e) for e in self.loads}, Validity(
            "loads that depend on reactions", self.margin, LEAST_MARGIN, math.inf,
            f"the loads that depend on {self.listed} come close to having no solution or more than one, where the mechanism "
            "jams: the determinant of their equations, 1 without them, is {value}"))

    def _branch(self, loads: Sequence[sp.Expr], signs: Sequence[int]) -> tuple[np.ndarray, list[Any]]:
        """phi with absolute values replaced by plus or minus their arguments, and these, which then are to be positive."""
        known: dict[sp.Basic, Any] = dict(zip(self.unknowns, self.r, strict=True))
        stand_ins = {value: sp.Dummy() for value in self.signs}
        arguments = []
        for value, sign in zip(self.signs, signs, strict=True):  # inner ones first
            argument = self.algebra.within(known).expression(value.args[0].xreplace(stand_ins))
            known[stand_ins[value]] = sign * argument
            arguments.append(sign * argument)
        at = self.algebra.within(known)
        return vector(*[at.expression(e.xreplace(stand_ins)) for e in loads]), arguments

    def _linear(self, phi: np.ndarray) -> bool:
        slopes = jacobian(self.recorder, phi.tolist(), self.r, "forward")
        return not any(leaf in self.r for leaf in reachable(slopes.ravel().tolist()))

    def _piecewise_linear(self) -> np.ndarray:
        """r of the combination of signs that its own arguments have."""
        apply = self.recorder.apply
        best: tuple[np.ndarray, Any] | None = None
        determinants = []
        for phi, arguments in self.branches:
            A, at_zero = self._slopes(phi), substitute(tuple(phi), dict.fromkeys(self.r, 0), self.recorder)
            r, determinant = _solved(A, self.r_0 + self.G @ vector(*at_zero))
            determinants.append(determinant)
            margins = substitute(tuple(arguments), dict(zip(self.r, r, strict=True)), self.recorder)
            margin = self._least(margins) if margins else 0
            if best is None:
                best = r, margin
            else:
                better = apply("gt", margin, best[1])
                best = (vector(*[apply("select", better, new, old) for new, old in zip(r, best[0], strict=True)]),
                        apply("select", better, margin, best[1]))
        assert best is not None
        self.margin = self._least(determinants)
        if self.signs:
            return self._guarded(best[0], self.margin - self.algebra.rounding)
        square = self.margin * self.margin  # one to one whatever the sign
        self.margin = apply("abs", self.margin)
        return self._guarded(best[0], square - self.algebra.rounding**2)

    def _newton(self) -> np.ndarray:
        algebra = self.algebra
        as_written = vector(*[algebra.within(dict(zip(self.unknowns, self.r, strict=True))).expression(
            _smooth_roots(e, set(self.unknowns))) for e in self.loads])
        residual = vector(*self.r) - self.r_0 - self.G @ as_written
        slopes = self._slopes(as_written)
        r, step = self.r_0, self.r_0
        for _ in range(STEPS):
            at = dict(zip(self.r, r, strict=True))
            entries = substitute((*residual, *slopes.ravel()), at, self.recorder)
            n = len(self.r)
            step, _ = _solved(vector(*entries[n:]).reshape(n, n), vector(*entries[:n]))
            r = r - step
        last = self._largest(step)
        size = self._largest([*r, *self.r_0])
        converged = CONVERGED * size - last + Fraction(1, 10**290)
        at = dict(zip(self.r, r, strict=True))
        determinants = []
        for phi, _ in self.branches:
            entries = substitute(tuple(self._slopes(phi).ravel()), at, self.recorder)
            determinants.append(_determinant(vector(*entries).reshape(slopes.shape)))
        self.margin = self._least(determinants)
        steep = self._guarded(r, self.margin - algebra.rounding)
        return vector(*[self.recorder.guard(e, converged, f"Newton's method does not converge: {self.reason}") for e in steep])

    def _slopes(self, phi: np.ndarray) -> np.ndarray:
        """I - G phi'."""
        inner = jacobian(self.recorder, phi.tolist(), self.r, "forward")
        result: np.ndarray = np.eye(len(self.r), dtype=int).astype(object) - self.G @ inner
        return result

    def _guarded(self, r: np.ndarray, margin: Any) -> np.ndarray:
        return vector(*[self.recorder.guard(e, margin, self.reason) for e in r])

    def _least(self, values: Sequence[Any]) -> Any:
        return self._fold("min", values)

    def _largest(self, values: Iterable[Any]) -> Any:
        return self._fold("max", [self.recorder.apply("abs", v) for v in values])

    def _fold(self, op: str, values: Sequence[Any]) -> Any:
        result = values[0]
        for v in values[1:]:
            result = self.recorder.apply(op, result, v)
        return result


def _continuous(load: sp.Expr, unknowns: set[Quantity], name: str) -> sp.Expr:
    """A load with Max and Min as absolute values. Raises ModelError where it jumps with an unknown."""
    jumps = [e for e in load.atoms(*_JUMPING) if _jumps(e, unknowns)]
    if jumps:
        raise ModelError([f"a load holds {jumps[0]}, which jumps where {', '.join(map(str, unknowns & jumps[0].free_symbols))} "
                          "passes a value, so that there may be no solution; write it by Abs, Max and Min, which do not jump"],
                         name)

    def largest(*values: sp.Expr) -> sp.Expr:
        first, *others = values
        for other in others:
            first = (first + other + sp.Abs(first - other, evaluate=False)) / 2
        return first

    result: sp.Expr = load.replace(lambda e: isinstance(e, sp.Max) and bool(unknowns & e.free_symbols),
                                   lambda e: largest(*e.args))
    return result.replace(lambda e: isinstance(e, sp.Min) and bool(unknowns & e.free_symbols),
                          lambda e: -largest(*[-a for a in e.args]))


def _jumps(e: sp.Basic, unknowns: set[Quantity]) -> bool:
    decides = [condition for _, condition in e.args] if isinstance(e, sp.Piecewise) else [e]
    return any(unknowns & condition.free_symbols for condition in decides)


def _absolute_values(loads: Sequence[sp.Expr], unknowns: set[Quantity]) -> list[sp.Abs]:
    """Absolute values of what depends on unknowns, inner ones first."""
    result = {e for load in loads for e in load.atoms(sp.Abs) if unknowns & e.free_symbols}
    return sorted(result, key=lambda e: (len(e.atoms(sp.Abs)), sp.default_sort_key(e)))


def _smooth_roots(load: sp.Expr, unknowns: set[Quantity]) -> sp.Expr:
    """Roots of what depends on unknowns, with a derivative of zero where that is zero: of a sum of squares at rest."""
    result: sp.Expr = load.replace(lambda e: isinstance(e, sp.Pow) and e.exp == sp.S.Half and bool(unknowns & e.free_symbols),
                                   lambda e: sp.sqrt(sp.Max(e.base, LEAST_SQUARE)))
    return result


def _determinant(A: np.ndarray) -> Any:
    """By expansion along the first row; equal minors are recorded once."""
    if A.shape == (1, 1):
        return A[0, 0]
    total: Any = 0
    for k in range(len(A)):
        minor = _determinant(np.delete(A[1:], k, axis=1))
        total = total + (-1) ** k * A[0, k] * minor
    return total


def _solved(A: np.ndarray, b: np.ndarray) -> tuple[np.ndarray, Any]:
    """x with A x = b, and det A, by Cramer's rule."""
    determinant = _determinant(A)
    x = []
    for k in range(len(b)):
        column = A.copy()
        column[:, k] = b
        x.append(_determinant(column) / determinant)
    return vector(*x), determinant
