"""Units of derived equations, checked by dimensional analysis of their tape."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np
import sympy as sp

from symdyn.analytic.lagrange import momentum_leaves
from symdyn.exact.dimensions import NAMED, Dimension, Dimensions, parsed, product, text, written
from symdyn.formulation.names import outputs_in
from symdyn.tape.node import ACCELERATION, Node

if TYPE_CHECKING:
    from symdyn.formulation.equations import Equations

CHECKED = ("T", "V", "M_tilde", "k_tilde", "F_tilde", "C", "C_r", "F_d")
# Energies are in J; N m is for torques.
ENERGIES = {"N m": "J"}
ENERGY, POWER, SECOND = (parsed(unit) or {} for unit in ("J", "W", "s"))


@dataclass(frozen=True, repr=False)
class UnitReport:
    """Result of dimensional analysis of equations; true where all units agree.

    faults     in words: sums of what has different units, entries that have another unit than the equations give them
    units      name of a quantity -> units of its entries, nested like it
    inferred   symbol without a unit -> the one that the equations give it; "?" where they leave it open
    unread     symbol -> text of its unit, which is no product of known ones and was left out
    """

    name: str
    faults: tuple[str, ...]
    units: Mapping[str, Any]
    inferred: Mapping[sp.Symbol, str]
    unread: Mapping[sp.Symbol, str] = field(default_factory=dict)

    @property
    def agree(self) -> bool:
        """Whether no fault was found."""
        return not self.faults

    def __bool__(self) -> bool:
        return self.agree

    def __str__(self) -> str:
        lines = [f"{self.name}: units {'agree' if self.agree else 'do not agree'}"]
        lines += [f"  {fault}" for fault in self.faults]
        if self.faults:
            lines.append("  numbers count as factors without a unit: give a parameter where one stands for a quantity")
        for symbol, unit in self.inferred.items():
            own = f"the unit {self.unread[symbol]!r}, which is not read" if symbol in self.unread else "no unit"
            lines.append(f"  {symbol} has {own}; the equations give it {unit}")
        if self.unread:
            lines.append(f"  units are products of powers of {', '.join(NAMED)}, such as 'N m/rad'")
        return "\n".join(lines)

    def __repr__(self) -> str:
        return str(self)


def symbol_units(equations: Equations) -> dict[sp.Basic, Dimension | None]:
    """Units of all symbols that equations are printed with; None where there is none."""
    s = equations.symbols
    units: dict[sp.Basic, Dimension | None] = {symbol: parsed(unit) for symbol, unit in s.units.items()}
    for u in s.speeds:
        unit = units.get(u)
        units[u.dot] = None if unit is None else product(unit, SECOND, -1)
    for p, u in zip(momentum_leaves(equations).values(), s.speeds, strict=False):
        unit = units.get(u)
        units[p] = None if unit is None else product(ENERGY, unit, -1)
    return units


def check_units(equations: Equations) -> UnitReport:
    """Analyse the quantities of the equations, their outputs and the rates of extra states."""
    s = equations.symbols
    units = symbol_units(equations)
    printed = equations.printed_leaves()
    speeds = [units.get(u) for u in s.speeds]
    quantities: dict[str, np.ndarray] = {}
    for name in (*CHECKED, *outputs_in(equations.quantities)):
        if name in equations.quantities or (name in ("T", "V") and "energy" in equations.quantities):
            quantities[name] = equations.quantity(name)
    rates = equations.quantity("balance")[len(s.speeds) + len(equations.constraints):][:len(s.states)]
    if len(rates):
        quantities["state_rates"] = rates
    entries = [e for value in quantities.values() for e in value.ravel()]
    leaves: dict[Node, Dimension | None] = {leaf: units.get(symbol) for leaf, symbol in printed.items()}
    for k, u in enumerate(s.speeds):
        leaves[equations.recorder.leaf(f"{u.name}_dot", ACCELERATION)] = units[s.speeds[k].dot]
    dimensions = Dimensions([e for e in entries if isinstance(e, Node)], leaves)
    faults = [written(mismatch, printed) for mismatch in dimensions.mismatches]
    for name, value in quantities.items():
        for index in np.ndindex(value.shape):
            wanted = _wanted(name, index, speeds, [units.get(z) for z in s.states])
            differ = None if wanted is None else dimensions.demand(value[index], wanted)
            if differ:
                wanted_unit = ENERGIES.get(differ[1], differ[1]) if name in ("T", "V") else differ[1]
                faults.append(f"{name}{list(index) if index else ''} is in {differ[0]}, the equations take it in {wanted_unit}")
    units_of: dict[str, Any] = {}
    for name, value in quantities.items():
        words = ENERGIES if name in ("T", "V") else {}
        result = [text(dimensions.of(e)) if isinstance(e, Node) else "" for e in value.ravel()]
        array = np.array([words.get(unit, unit) for unit in result], dtype=object)
        units_of[name] = array.reshape(value.shape).tolist()
    used = {symbol: leaf for leaf, symbol in printed.items() if leaf in dimensions}
    inferred = {symbol: text(dimensions.of(leaf)) for symbol, leaf in used.items() if units.get(symbol) is None}
    unread = {symbol: s.units[symbol] for symbol in inferred if s.units.get(symbol)}
    return UnitReport(f"{equations.name} ({equations.formulation})", tuple(dict.fromkeys(faults)), units_of, inferred, unread)


def _wanted(name: str, index: tuple[int, ...], speeds: list[Dimension | None], states: list[Dimension | None],
            ) -> Dimension | None:
    """The unit that an entry must have; None where that is not known."""
    if name in ("T", "V"):
        return ENERGY
    if name == "state_rates":
        state = states[index[0]]
        return None if state is None else product(state, SECOND, -1)
    if name not in ("M_tilde", "k_tilde", "F_tilde"):
        return None
    wanted: Dimension = ENERGY if name == "M_tilde" else POWER
    for k in index:
        speed = speeds[k]
        if speed is None:
            return None
        wanted = product(wanted, speed, -1)
    return wanted
