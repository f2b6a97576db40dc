"""Names of quantities and functions that have parts: each kind is put together here, and recognized here, nowhere else."""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import NamedTuple

# Names of what functions are differentiated by -> the groups of arguments with this name.
BY = {"x": ("q", "u", "z"), "inputs": ("inputs",), "params": ("p",), "t": ("t",), "ud": ("ud",)}
# Names of what a weighted sum of the rates is differentiated by, once or twice.
WEIGHTED = ("x", "inputs", "params", "t")
# Other quantities that are weighted and differentiated twice.
CURVED = ("constraints", "outputs")
# Functions of weighted rates: their gradient, its derivative along a direction, their matrix of second derivatives.
ADJOINT, HESSIAN_PRODUCT, HESSIAN = "adjoint", "hessian_product", "hessian"
# Quantities of one link of a recursive formulation, by their letters.
LETTERS = ("X", "X_star", "S", "S_ring", "I", "v", "c", "p", "a", "f", "I_A", "p_A", "v_G", "a_G", "f_G")
# Derivatives of x_dot, which have names of their own.
JACOBIANS = {"x": "jacobian_x", "inputs": "jacobian_inputs", "params": "jacobian_params"}
# Groups of arguments along which quantities have derivatives.
GROUPS = ("q", "u", "z", "inputs", "p", "t")
# Enclosures of what vanishes at events: with the first two derivatives, and of the values alone.
BOUNDS, RANGES = "event_bounds", "event_ranges"
_OUTPUT = "output_"


class Derivative(NamedTuple):
    """A function of the derivatives of another: lam_by_x, energy_by_params, inverse_dynamics_by_ud."""

    of: str
    by: str

    @property
    def name(self) -> str:
        return f"{self.of}_by_{self.by}"


class Weighted(NamedTuple):
    """A function of weighted rates, and the groups by which it differentiates: adjoint_x, hessian_x_inputs, hessian_product_x."""

    kind: str
    wrt: tuple[str, ...]

    @property
    def name(self) -> str:
        return f"{self.kind}_{'_'.join(self.wrt)}"


class Curvature(NamedTuple):
    """Second derivatives of a weighted sum of other quantities: constraints_hessian_x_params, outputs_hessian_x_inputs."""

    of: str
    wrt: tuple[str, ...]

    @property
    def name(self) -> str:
        return f"{self.of}_hessian_{'_'.join(self.wrt)}"


class OfLink(NamedTuple):
    """A quantity of one link, which are numbered from 1: X_star_2."""

    letter: str
    number: int

    @property
    def name(self) -> str:
        return f"{self.letter}_{self.number}"


def derivative_named(name: str) -> Derivative | None:
    """The quantity that a function of this name differentiates, and the variables; None for other functions."""
    of, _, by = name.rpartition("_by_")
    return Derivative(of, by) if of and by in BY else None


def derivative_of(of: str, by: str) -> str:
    """The name of the function of the derivatives of another by a group: those of rhs have names of their own."""
    return JACOBIANS[by] if of == "rhs" and by in JACOBIANS else Derivative(of, by).name


def differentiated(name: str) -> Derivative | None:
    """The same as `derivative_named`, of names that derivatives of rhs have, too."""
    by = next((by for by, own in JACOBIANS.items() if own == name), None)
    return derivative_named(name) if by is None else Derivative("rhs", by)


def second_named(name: str) -> Weighted | None:
    """Kind of a function of weighted rates, and the groups by which it differentiates; None for other functions."""
    for kind in (HESSIAN_PRODUCT, HESSIAN, ADJOINT):
        wrt = _groups(name.removeprefix(f"{kind}_"))
        if name.startswith(f"{kind}_") and wrt:
            return Weighted(kind, wrt)
    return None


def curvature_named(name: str) -> Curvature | None:
    """Weighted quantity that a function of this name differentiates twice, and the groups by which it does; None for other
    functions."""
    of, _, by = name.partition("_hessian_")
    wrt = _groups(by)
    return Curvature(of, wrt) if of in CURVED and wrt else None


def _groups(text: str) -> tuple[str, ...]:
    """The groups that a text lists in their order; none where it lists something else."""
    wrt = tuple(text.split("_"))
    return wrt if wrt == tuple(by for by in WEIGHTED if by in wrt) else ()


def link_named(name: str) -> OfLink | None:
    """Letter and number of a quantity of one link; None for other quantities."""
    parts = re.fullmatch(r"(\w+)_([1-9]\d*)", name)
    return OfLink(parts[1], int(parts[2])) if parts and parts[1] in LETTERS else None


def output_quantity(name: str) -> str:
    """The quantity behind an output of the user."""
    return f"{_OUTPUT}{name}"


def output_named(quantity: str) -> str | None:
    """The name that the user gave the output behind a quantity; None for other quantities."""
    return quantity.removeprefix(_OUTPUT) if quantity.startswith(_OUTPUT) else None


def outputs_in(quantities: Iterable[str]) -> dict[str, str]:
    """Quantity -> the name that the user gave it, of those that are outputs, in their order."""
    named = {quantity: output_named(quantity) for quantity in quantities}
    return {quantity: name for quantity, name in named.items() if name is not None}


def along_group(quantity: str, group: str) -> str:
    """The derivative of a quantity along a direction in a group of arguments."""
    return f"{quantity}_along_{group}"


def stabilized(quantity: str) -> str:
    """The quantity as Baumgarte's method makes it."""
    return f"{quantity}_baumgarte"


def rate_of(quantity: str) -> str:
    """The derivative of a quantity by the time alone."""
    return f"{quantity}_rate"


def variation_of(quantity: str) -> str:
    """The derivative of a quantity along the direction of sensitivities."""
    return f"{quantity}_variation"
