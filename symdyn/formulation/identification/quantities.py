"""Quantities for identification: regressors, inertial parameters and base parameters of the equations of a tree."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
import sympy as sp

from symdyn.arguments import take
from symdyn.errors import SymdynError
from symdyn.formulation.identification.base_parameters import Base, base
from symdyn.formulation.identification.regressor import inertial_parameters, project, regressor
from symdyn.formulation.trees.tree import Tree
from symdyn.shown import name_of
from symdyn.tape.floats import evaluate_rows
from symdyn.tape.sympy_bridge import expand

if TYPE_CHECKING:
    from symdyn.formulation.equations import Equations
    from symdyn.given import Numbers


class Identification:
    """Records the quantities that are linear in the inertial parameters: tau = Y pi = Y_b pi_b.

    tau, (n_u,), is M_tilde u_dot + k_tilde less what gravity gives along the speeds: what all other loads and drives together
    give in a motion. Loads are not linear in inertial parameters and are no part of it.
    """

    def __init__(self, tree: Tree, speed_rates: np.ndarray) -> None:
        self.tree = tree
        self.speed_rates = speed_rates

    def quantities(self) -> dict[str, Callable[[], Any]]:
        """name -> function that records it."""
        return {"regressor": self.regressor, "inertial_parameters": lambda: inertial_parameters(self.tree),
                "base_regressor": lambda: self.base.Y, "base_parameters": lambda: self.base.values}

    def regressor(self) -> np.ndarray:
        """Y, (n_u, 10 n_b): ten parameters of every body in the order of the model, see inertial_parameters."""
        tree = self.tree
        return tree.algebra.name("Y", project(tree, regressor(tree, tree.joint_accelerations(self.speed_rates), self._upwards())))

    @cached_property
    def base(self) -> Base:
        """The base parameters and their regressor."""
        result = base(self.tree, self.speed_rates, self._upwards())
        self.tree.algebra.name("Yb", result.Y)
        return result

    def _upwards(self) -> np.ndarray:
        """Acceleration of the base that stands for gravity, n-frame."""
        return -self.tree.algebra.constants(self.tree.model.gravity)


@dataclass(frozen=True, eq=False)
class BaseParameters:
    """The base parameters of equations of motion, tau = Y_b pi_b; explicit SymPy is made when it is requested.

    tau = M_tilde u_dot + k_tilde less what gravity gives: what all other loads together must give along the speeds.
    A parameter is named after what it is and the link that it is counted to, in the axes of the link's joint frame (child
    side; a joint axis that is no coordinate axis is its z). It is a sum over the parameters of that link and of others, as
    `expressions` documents. Zeros of the model stay zero: give every body symbols for all ten parameters to get the
    general set. Symbols for lengths and gravity stand for general values: give numbers where special ones matter.

    names        (n,) text; margins: least that an independent column of Y_b had left, most of a dependent one, of 1
    quantities   names of the quantities of the equations that are Y_b (n_u, n) and pi_b (n,), to compile them
    """

    equations: Equations
    names: tuple[str, ...]
    margins: tuple[float, float]
    quantities: tuple[str, str] = ("base_regressor", "base_parameters")

    def __len__(self) -> int:
        return len(self.names)

    @property
    def symbols(self) -> sp.Matrix:
        """pi_b as symbols, (n, 1)."""
        return sp.Matrix(len(self), 1, [sp.Symbol(name) for name in self.names])

    @property
    def expressions(self) -> sp.Matrix:
        """pi_b in the parameters of the model, multiplied out, (n, 1)."""
        return self._explicit("base_parameters").applyfunc(sp.expand)

    @property
    def regressor(self) -> sp.Matrix:
        """Y_b in coordinates, speeds, their derivatives and lengths, (n_u, n), simplified as far as the time limit allows."""
        from symdyn.report.simplify import simplified

        return simplified(self._explicit("base_regressor"), self.equations.simplify_seconds)

    def values(self, params: Numbers | None = None) -> np.ndarray:
        """pi_b in numbers, (n,), from parameters in order or by symbol or name; what is left out takes its default.

        Raises ArgumentError naming what is missing, unknown or not a finite number.
        """
        symbols = self.equations.symbols
        names = [p.name for p in symbols.parameters]
        defaults = {name_of(k): float(v) for k, v in symbols.defaults.items()}
        numbers = take(params, names, "parameters", defaults, self.equations.name)
        return evaluate_rows(self.equations.tape("base_parameters"), dict(zip(names, numbers.tolist(), strict=True)),
                             1)["base_parameters"][0]

    def _explicit(self, name: str) -> sp.Matrix:
        eq = self.equations
        return expand(eq.tape(name).outputs[name], eq.printed_leaves())

    def __str__(self) -> str:
        head = f"{self.equations.name}: {len(self)} base parameters"
        return "\n".join([head, *[f"  {name} = {e}" for name, e in zip(self.names, self.expressions, strict=True)]])

    def __repr__(self) -> str:
        return f"<{len(self)} base parameters of {self.equations.name}>"


def base_parameters(equations: Equations) -> BaseParameters:
    """The base parameters of the equations of a tree.

    Raises SymdynError for equations without bodies, and where double precision does not determine what is independent.
    """
    if equations.identification is None and equations.bodies:
        raise SymdynError(f"{equations.name} has added mass or elastic bodies, which are no inertias of rigid bodies; leave them "
                          "out for base parameters")
    if equations.identification is None:
        raise SymdynError(f"{equations.name} ({equations.formulation}) has no bodies, so no inertial parameters; describe it by "
                          "bodies and joints (sd.System)")
    result = equations.identification.base
    return BaseParameters(equations, result.names, result.margins)
