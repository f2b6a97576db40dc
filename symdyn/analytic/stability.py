"""Characteristic polynomials of linear equations and the conditions of Routh and Hurwitz, explicit in the parameters.

A polynomial without odd powers, of an undamped mechanism, is one in s^2; its roots are neutral where they are real and negative:
coefficients and discriminant are positive. Others are judged in the form of Lienard and Chipart, which needs half of Hurwitz's
determinants. Source: Gantmacher, The Theory of Matrices II, chapter XV, sections 6 and 13.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import sympy as sp

from symdyn.analytic.minors import determinant
from symdyn.errors import SymdynError
from symdyn.tape.node import is_zero

if TYPE_CHECKING:
    from symdyn.analytic.linear import Linearized

# Degree up to which conditions are written: three degrees of freedom.
LARGEST = 6

# Coefficients of a polynomial in s, the constant first; nodes and numbers.
Polynomial = tuple[Any, ...]


@dataclass(frozen=True, repr=False)
class Stability:
    """Conditions on the parameters that decide stability by the linear equations.

    conditions   inequalities that must hold, all of them, where the mass matrix is positive definite
    kind         "asymptotic": disturbances die out; "neutral": they oscillate for ever (no damping); "undecided": all roots are 0
    zero_roots   roots s = 0, of cyclic coordinates, which are left out: along these a disturbance drifts or stays
    equilibrium  what must be zero, besides, for the state to be an equilibrium
    """

    conditions: tuple[sp.Rel, ...]
    kind: str
    zero_roots: int = 0
    equilibrium: tuple[sp.Basic, ...] = ()

    def __str__(self) -> str:
        lines = [f"{self.kind} stability where"] + [f"  {c.lhs} > 0" for c in self.conditions]
        if not self.conditions:
            lines = [f"{self.kind} stability for all values of the parameters"]
        never = [c.lhs for c in self.conditions if c.lhs.is_nonpositive]
        if never:
            lines = [f"no {self.kind} stability for any values of the parameters: {never[0]} would have to be positive"]
        if self.kind == "undecided":
            lines = ["stability is not decided by the linear equations: all roots are s = 0"]
        elif self.zero_roots:
            lines.append(f"  besides {self.zero_roots} root{'s' * (self.zero_roots > 1)} s = 0")
        lines += [f"  if the state is an equilibrium: {c.lhs} = {c.rhs}" for c in self.equilibrium]
        return "\n".join(lines)

    def __repr__(self) -> str:
        return str(self)


@dataclass(frozen=True, eq=False, repr=False)
class Characteristic:
    """det(M s^2 + C s + K), with the rows of extra states and of displacements beyond the speeds, where there are any.

    coefficients   in the shortest form, of the highest power first
    """

    linear: Linearized
    nodes: Polynomial
    coefficients: tuple[sp.Expr, ...]

    def expression(self, s: sp.Symbol | None = None) -> sp.Expr:
        """The polynomial in a symbol, by default s."""
        s = sp.Symbol("s") if s is None else s
        n = len(self.coefficients) - 1
        return sp.Add(*[sp.Mul(c, s ** (n - k), evaluate=False) if c.is_Add and n > k else c * s ** (n - k)
                        for k, c in enumerate(self.coefficients)])

    def __str__(self) -> str:
        return str(self.expression())

    def __repr__(self) -> str:
        return str(self)

    def _repr_latex_(self) -> str:
        return rf"$\displaystyle {sp.latex(self.expression())}$"

    def routh_hurwitz(self) -> Stability:
        """Conditions on the parameters for stability, up to three degrees of freedom. Raises SymdynError beyond, and for what is
        too large."""
        zero = next(k for k, c in enumerate(reversed(self.coefficients)) if c != 0)
        left = [0 if c == 0 else node for c, node in zip(reversed(self.coefficients), self.nodes, strict=True)][zero:]
        degree = len(left) - 1
        if degree > LARGEST:
            raise SymdynError(f"{self.linear.name}: conditions for a polynomial of degree {degree} were requested; they are "
                              f"written for up to {LARGEST}, three degrees of freedom; hold some with linearized(hold=...), "
                              "or put in numbers and use module.linearize(at).verdict")
        if degree == 0:
            return Stability((), "undecided", zero, self.linear.conditions)
        if all(map(is_zero, left[1::2])) and degree % 2 == 0:
            # Without gyroscopic and circulatory terms all s^2 are real.
            linear = self.linear
            real = linear.holonomic and linear.C.is_zero_matrix and linear.K.is_symmetric() and linear.M.is_symmetric()
            kind, result = "neutral", list(left[:-1:2]) if real else _negative_and_real(left[::2])
        else:
            kind, result = "asymptotic", _lienard_chipart(left[::-1])
        return Stability(_inequalities(self.linear.write(result)), kind, zero, self.linear.conditions)


def characteristic(linear: Linearized) -> Characteristic:
    """The characteristic polynomial. Raises SymdynError for what is too large."""
    get, n, n_s, n_z = linear.nodes, len(linear.coordinates), len(linear.speeds), len(linear.states)
    # Displacements whose rates are the independent speeds, first; zeta is s times these.
    first = linear.rated
    last = [i for i in range(n) if i not in first]
    rows: list[list[Polynomial]] = []
    for i in range(n_s):
        rows.append([*[(get["K"][i, k], get["C"][i, j], get["M"][i, j]) for j, k in enumerate(first)],
                     *[(get["K"][i, k],) for k in last], *[(get["R_z"][i, j],) for j in range(n_z)]])
    for i in last:
        rows.append([*[(-get["W"][i, k], -get["E"][i, j]) for j, k in enumerate(first)],
                     *[(-get["W"][i, k], int(i == k)) for k in last], *[(0,)] * n_z])
    for i in range(n_z):
        rows.append([*[(-get["Z_q"][i, k], -get["Z_u"][i, j]) for j, k in enumerate(first)],
                     *[(-get["Z_q"][i, k],) for k in last], *[(-get["Z_z"][i, j], int(i == j)) for j in range(n_z)]])
    nodes = determinant(rows, _plus, _times, lambda p: tuple(-c for c in p), (0,), (1,), lambda p: all(map(is_zero, p)))
    degree = n + n_s + n_z
    nodes = (*nodes, *[0] * (degree + 1 - len(nodes)))[:degree + 1]
    return Characteristic(linear, nodes, tuple(linear.write(nodes[::-1])))


def _plus(p: Polynomial, q: Polynomial) -> Polynomial:
    return tuple((p[k] if k < len(p) else 0) + (q[k] if k < len(q) else 0) for k in range(max(len(p), len(q))))


def _times(p: Polynomial, q: Polynomial) -> Polynomial:
    result = [0] * (len(p) + len(q) - 1)
    for i, a in enumerate(p):
        for j, b in enumerate(q):
            result[i + j] = result[i + j] + a * b
    return tuple(result)


def _negative_and_real(b: Sequence[Any]) -> list[Any]:
    """Quantities that are positive where all roots x of b_0 + b_1 x + ..., with b_m > 0, are real, negative and different."""
    if len(b) == 3:
        return [b[0], b[1], b[1] * b[1] - 4 * b[0] * b[2]]
    if len(b) == 4:
        d, c, q, a = b
        return [d, c, q, 18 * a * q * c * d - 4 * q**3 * d + q**2 * c**2 - 4 * a * c**3 - 27 * a**2 * d**2]
    return list(b[:-1])


def _lienard_chipart(a: Sequence[Any]) -> list[Any]:
    """Quantities that are positive where all roots of a_0 s^n + ... + a_n, with a_0 > 0, have negative real parts."""
    n = len(a) - 1

    def hurwitz(k: int) -> Any:
        return determinant([[a[2 * j - i] if 0 <= 2 * j - i <= n else 0 for j in range(1, k + 1)] for i in range(1, k + 1)])

    return [*[a[k] for k in range(n, 0, -2)], *[hurwitz(k) for k in range(n - 1, 0, -2)]]


def _inequalities(values: Sequence[sp.Expr]) -> tuple[sp.Rel, ...]:
    """Each above zero, without factors that are positive, and without those that always hold."""
    result: dict[Any, None] = {}
    for value in values:
        factors = [f for f in sp.Mul.make_args(value) if not f.is_positive]
        kept = sp.Mul(*[f.base if f.is_Pow and f.exp.is_odd and f.exp.is_positive else f for f in factors])
        if factors:  # what holds never is shown as it is
            result.setdefault(sp.StrictGreaterThan(value if kept.is_negative else kept, 0, evaluate=False))
    return tuple(result)
