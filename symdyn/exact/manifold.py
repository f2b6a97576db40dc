"""Relations that hold where a claim is made, "on C = 0": what is taken for them, and states that fulfil them."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import Any

import mpmath
import numpy as np
import sympy as sp

from symdyn.errors import ArgumentError
from symdyn.formulation.equations import Equations
from symdyn.model.symbols import Acceleration, symbols_of
from symdyn.shown import shown
from symdyn.tape.differentiate import jacobian
from symdyn.tape.evaluate import evaluate
from symdyn.tape.node import Node
from symdyn.tape.recorder import Recorder
from symdyn.tape.tape import Tape, reachable

# Steps of Newton's method; singular values below this part of the largest are left out of one.
STEPS, CUT = 60, 1e-9
# Parameters of mechanisms are nonzero: states where one that was moved is below this are not taken.
LEAST = 0.01


def relations_of(on: Any, claimed: Sequence[sp.Expr] = ()) -> list[sp.Expr]:
    """Expressions that are zero, from what is passed as `on`: expressions, matrices and equations of SymPy, lists of these, and
    equations of a mechanism, of which the constraints, their rates, where accelerations are claimed theirs, and the norm of Euler
    parameters are taken.

    Raises ArgumentError for anything else, equations without constraints, and what is never zero."""
    if isinstance(on, Equations):
        return _constraints(on, any(isinstance(s, Acceleration) for e in claimed for s in symbols_of(e)))
    if isinstance(on, (list, tuple)):
        return [e for part in on for e in relations_of(part, claimed)]
    if isinstance(on, sp.MatrixBase):
        return relations_of(list(on), claimed)
    if isinstance(on, sp.Eq):
        return relations_of(on.lhs - on.rhs, claimed)
    if isinstance(on, (int, float)) and not isinstance(on, bool):
        on = sp.sympify(on, strict=True)
    if on is sp.true:
        return []
    if not isinstance(on, sp.Expr) or on.has(sp.nan, sp.zoo, sp.oo):
        raise ArgumentError("on takes expressions that are zero, equations and lists of these, or equations of a mechanism with "
                            f"constraints; found {shown(on)}")
    if on.is_number and on.is_zero is False:
        raise ArgumentError(f"on takes expressions that are zero somewhere; {shown(on)} is not")
    return [on]


def eliminated(relations: Sequence[sp.Expr]) -> dict[sp.Symbol, sp.Expr]:
    """Symbols that relations in turn give by the others, where they stand linearly with a factor that is not zero."""
    result: dict[sp.Symbol, sp.Expr] = {}
    for relation in relations:
        e = sp.expand(relation.xreplace(result))
        for s in sorted(e.free_symbols, key=str):
            factor = e.coeff(s)
            value = sp.expand((factor * s - e) / factor) if factor.is_nonzero else s
            if s not in value.free_symbols:
                result = {**{k: v.xreplace({s: value}) for k, v in result.items()}, s: value}
                break
    return result


def nonzero_parameters(on: Any) -> set[sp.Expr]:
    """Parameters of the equations that are passed as `on`: constraints are those of a mechanism, in which they are not zero."""
    if isinstance(on, (list, tuple)):
        return set().union(*map(nonzero_parameters, on)) if on else set()
    return set(on.symbols.parameters) if isinstance(on, Equations) else set()


def _constraints(equations: Equations, accelerating: bool) -> list[sp.Expr]:
    if not equations.constraints:
        raise ArgumentError(f"{equations.name} ({equations.formulation}) has no constraints that a claim could hold on; pass "
                            "equations with loops or constraints, or expressions that are zero")
    C = [e for e, holonomic in zip(equations.explicit("C", simplify=False), equations.holonomic) if holonomic]
    result = [*C, *equations.explicit("C_dot", simplify=False)]
    result += [sum(p**2 for p in group) - 1 for group in equations.unit_groups]
    if accelerating:
        accelerations = sp.Matrix([u.dot for u in equations.symbols.speeds])
        result += list(equations.explicit("C_r", simplify=False) * accelerations - equations.explicit("F_d", simplify=False))
    return result


class States:
    """States on relations, nodes that are zero there, near given ones.

    nonzero   symbols that stay as they are where that is possible, and are not zero otherwise
    """

    def __init__(self, recorder: Recorder, relations: Sequence[Node], symbols: Mapping[Node, sp.Expr],
                 nonzero: Collection[sp.Expr] = ()) -> None:
        self.symbols, self.nonzero = symbols, [leaf for leaf, symbol in symbols.items() if symbol in nonzero]
        leaves = [leaf for leaf in reachable(relations) if leaf.op == "leaf" and not _whole(symbols.get(leaf))]
        kept = [leaf for leaf in leaves if leaf not in self.nonzero]
        self.tapes = [(moved, Tape.of(recorder, g=list(relations), by=jacobian(recorder, list(relations), moved, "forward")))
                      for moved in ([kept, leaves] if 0 < len(kept) < len(leaves) else [leaves])]

    def near(self, values: Mapping[Node, Any], digits: int) -> dict[Node, Any] | None:
        """Values of the leaves that fulfil the relations to so many digits, by Newton's method with the smallest steps; None
        where it ends elsewhere, or at numbers that are not of the kind of their symbols."""
        for moved, tape in self.tapes:
            result = _moved(tape, moved, values, digits)
            if result is not None and all(_fits(value, self.symbols.get(leaf)) for leaf, value in result.items()) and all(
                    abs(result[leaf]) > LEAST for leaf in self.nonzero if leaf in result):
                return result
        return None


def _moved(tape: Tape, moved: Sequence[Node], values: Mapping[Node, Any], digits: int) -> dict[Node, Any] | None:
    result = dict(values)
    with mpmath.workdps(digits + 10):
        for _ in range(STEPS):
            here = evaluate(tape, {leaf.args[1]: value for leaf, value in result.items()}, digits + 10)
            size = max(map(abs, here["g"]), default=mpmath.mpf(0))
            if not mpmath.isfinite(size) or any(getattr(e, "imag", 0) for e in here["g"]):
                return None
            if size < mpmath.mpf(10) ** -digits:
                return result
            A = here["by"].astype(float)
            if not np.isfinite(A).all():
                return None
            # Doubles suffice for the direction: each step adds a dozen digits to those that are right.
            y = np.linalg.pinv(A, rcond=CUT) @ np.array([float(e / size) for e in here["g"]])
            largest = size * float(np.abs(y).max(initial=0.0))
            step = size / max(largest, mpmath.mpf(1))
            for leaf, change in zip(moved, y, strict=True):
                result[leaf] = mpmath.mpf(result[leaf]) - step * float(change)
    return None


def _whole(symbol: sp.Expr | None) -> bool:
    return symbol is not None and bool(symbol.is_integer)


def _fits(value: Any, symbol: sp.Expr | None) -> bool:
    """Whether a number has the sign that its symbol is assumed to have."""
    if symbol is None:
        return True
    return not ((symbol.is_nonnegative and value < 0) or (symbol.is_nonpositive and value > 0)
                or (symbol.is_nonzero and value == 0))
