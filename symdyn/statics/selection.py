"""Quantities that are solved for and those that are kept: coordinates, speeds, extra states, parameters and inputs by name."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from symdyn.arguments import take
from symdyn.errors import ArgumentError
from symdyn.shown import name_of, shown
from symdyn.statics.terms import OperatingPoint, null_space

if TYPE_CHECKING:
    from symdyn.runtime.module import Module
# Unknown names that a message lists.
LISTED = 8


@dataclass(frozen=True, eq=False)
class Selection:
    """Names of coordinates, speeds and extra states that stay, and of parameters and inputs that are solved for.

    values       of what stays at a given number
    conditions   names among `values` whose equations hold nevertheless: one for each parameter or input solved for
    candidates   where there are more than are needed: names among which the conditions are still to be found
    holding      what is held when the state is disturbed, if that is said apart from what stays in the search
    """

    module: Module
    kept: tuple[str, ...]
    values: Mapping[str, float]
    parameters: tuple[str, ...] = ()
    inputs: tuple[str, ...] = ()
    conditions: tuple[str, ...] = ()
    candidates: tuple[str, ...] = ()
    holding: tuple[str, ...] | None = None

    @property
    def held(self) -> tuple[str, ...]:
        """Quantities that forces hold when the state is disturbed: those that stay, unless their own equation is fulfilled
        without (conditions)."""
        if self.holding is not None:
            return self.holding
        return tuple(n for n in self.kept if n not in self.conditions)

    @cached_property
    def free_states(self) -> list[int]:
        """Indices of the extra states that are not held."""
        return [k for k, name in enumerate(self.module.metadata.z) if name not in self.held]

    @cached_property
    def states(self) -> list[int]:
        """Indices of the extra states that are free."""
        return [k for k, name in enumerate(self.module.metadata.z) if name not in self.kept]

    @property
    def unknown(self) -> tuple[str, ...]:
        return (*self.parameters, *self.inputs)

    def amounts(self, point: OperatingPoint) -> np.ndarray:
        """The values of what is solved for, (n,)."""
        metadata = self.module.metadata
        return np.array([*[point.p[metadata.parameters.index(n)] for n in self.parameters],
                         *[point.inputs[metadata.inputs.index(n)] for n in self.inputs]])

    def rows(self, point: OperatingPoint, equations: bool = False) -> np.ndarray:
        """R with R v = 0 for what stays, (n, n_u); equations: only for those whose equations do not hold."""
        metadata = self.module.metadata
        n_u = len(metadata.u)
        named: dict[str, np.ndarray] = {}
        for name in self.kept:
            if name in metadata.q:
                named[name] = point.N[metadata.q.index(name)]
            elif name in metadata.u:
                named[name] = np.eye(n_u)[metadata.u.index(name)]
        held = [named[name] for name in self.conditions if equations and name in named]
        rows = [row for name, row in named.items()
                if not (equations and (name in self.conditions or any(_same(row, h) for h in held)))]
        return np.array(rows).reshape(len(rows), n_u)

    def directions(self, point: OperatingPoint) -> np.ndarray:
        """Columns: velocities that leave what stays as it is, (n_u, n)."""
        return null_space(self.rows(point))

    def tested(self, point: OperatingPoint) -> np.ndarray:
        """Columns: virtual velocities along which forces balance, (n_u, n)."""
        return null_space(self.rows(point, equations=True)) if self.conditions else self.directions(point)

    def apply(self, x: np.ndarray) -> np.ndarray:
        """The state with given values."""
        names = self.module.metadata.x
        x = x.copy()
        for name, value in self.values.items():
            x[names.index(name)] = value
        return x


def select(module: Module, free: Any, fixed: Any, unknown: Any) -> Selection:
    """The selection from what a user names; see Module.equilibrium. Raises ArgumentError with what does not fit."""
    metadata, owner = module.metadata, module.name
    owners = {**dict.fromkeys(metadata.parameters, "parameter"), **dict.fromkeys(metadata.inputs, "input"),
              **dict.fromkeys(metadata.x, "state")}
    named = None if free is None else listed(free, owners, "free", owner)
    if named == []:
        raise ArgumentError(f"{owner}: free names nothing; name what is to be found, or leave it out for all coordinates")
    more = listed(unknown, {n: k for n, k in owners.items() if k != "state"}, "unknown_params", owner)
    values = {} if fixed is None else _numbers(fixed, metadata.x, owner)
    solved = list(dict.fromkeys([*(n for n in named or () if owners[n] != "state"), *more]))
    moving = None if named is None else [n for n in named if owners[n] == "state"]
    kept = set(values)
    if moving:
        wrong = [n for n in moving if n in metadata.u and n not in metadata.q]
        if wrong:
            raise ArgumentError(f"{owner}: free names the speeds {', '.join(wrong)}; name coordinates, and give speeds their "
                                "values in fixed")
        if not (solved and set(moving) <= set(values)):  # conditions alone leave the others free
            kept |= {n for n in metadata.q if n not in moving}
    conditions, candidates = _conditions(module, solved, values, moving or ())
    order = [n for n in metadata.x if n in kept]
    return Selection(module, tuple(order), values, tuple(n for n in solved if owners[n] == "parameter"),
                     tuple(n for n in solved if owners[n] == "input"), tuple(conditions), tuple(candidates))


def holding(selection: Selection, hold: Any) -> Selection:
    """The selection with what is held when the state is disturbed, by name or symbol; None: what stays, but for conditions."""
    if hold is None:
        return selection
    return replace(selection, holding=tuple(dict.fromkeys(listed(hold, selection.module.metadata.x, "hold",
                                                                 selection.module.name))))


def _conditions(module: Module, solved: list[str], values: Mapping[str, float], free: Iterable[str]
                ) -> tuple[list[str], list[str]]:
    """Conditions, and where there are too many, the candidates."""
    if not solved:
        both = [n for n in values if n in free]
        if both:
            raise ArgumentError(f"{module.name}: {', '.join(both)} is both free and fixed; leave it out of one of them, or name "
                                "in free the parameter that makes it take its value")
        return [], []
    coordinates = [n for n in values if n in module.metadata.q]
    for candidates in ([n for n in values if n in free], coordinates, list(values)):
        if len(candidates) == len(solved):
            return candidates, []
    if len(coordinates) > len(solved):
        return [], coordinates
    raise ArgumentError(f"{module.name}: {len(solved)} values are to be found ({', '.join(solved)}), which takes as many "
                        f"conditions, but fixed gives {len(values)} ({', '.join(values) or 'none'}); give one value in fixed "
                        "for each")


def _numbers(fixed: Any, names: Sequence[str], owner: str) -> dict[str, float]:
    if not isinstance(fixed, Mapping):
        raise ArgumentError(f"{owner}: fixed must be a mapping from coordinates and speeds to numbers, found {shown(fixed)}")
    array = take(fixed, names, "fixed", dict.fromkeys(names, 0.0), owner)
    named = {name_of(key) for key in fixed}
    return {n: float(v) for n, v in zip(names, array, strict=True) if n in named}


def listed(values: Any, known: Iterable[str], what: str, owner: str) -> list[str]:
    """Names from names or symbols, one or several. Raises ArgumentError for unknown ones."""
    if values is None:
        return []
    if isinstance(values, str) or hasattr(values, "name"):
        values = [values]
    if not isinstance(values, Iterable) or getattr(values, "ndim", 1) == 0:
        raise ArgumentError(f"{owner}: {what} must be names or symbols, found {shown(values)}")
    result = [name_of(v) for v in values]
    there = list(known)
    faults = []
    for name in (n for n in result if n not in there):
        near = difflib.get_close_matches(name, there, 3, cutoff=0.5)
        faults.append(f"there is no {shown(name)}" + (f", did you mean {' or '.join(near)}?" if near else
                                                 f"; there are {', '.join(there) or 'none'}"))
    if faults:
        more = f"; and {len(faults) - LISTED} more" if len(faults) > LISTED else ""
        raise ArgumentError(f"{owner}: {what}: {'; '.join(faults[:LISTED])}{more}")
    return result


def _same(a: np.ndarray, b: np.ndarray) -> bool:
    """Whether two rows keep the same direction."""
    return bool(abs(a @ b) > (1 - 1e-12) * np.linalg.norm(a) * np.linalg.norm(b) > 0)
