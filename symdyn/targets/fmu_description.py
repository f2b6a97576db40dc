"""Description of variables in an FMU: references, units in powers of the base units, dependencies.

Source: Modelica Association, Functional Mock-up Interface Specification 3.0, section 2.4, and version 2.0.4, section 2.2.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from symdyn.backend.metadata import ModuleMetadata
from symdyn.errors import ArgumentError
from symdyn.exact.dimensions import BASE, parsed
from symdyn.formulation.names import derivative_of

# Angles count as 1 in units; the standard has a base unit for them.
_ANGLES = {"rad": 1.0, "deg": math.pi / 180, "rev": 2 * math.pi}
ENERGIES = ("energy.kinetic", "energy.potential")


@dataclass(frozen=True)
class Variable:
    """A variable; derivative_of: the reference of the state whose derivative it is."""

    name: str
    reference: int
    causality: str
    variability: str
    initial: str = ""
    unit: str = ""
    description: str = ""
    start: str | None = None
    derivative_of: int | None = None


@dataclass(frozen=True)
class FmuUnit:
    """A unit as powers of base units; factor: of its numbers, for those in base units."""

    name: str
    powers: tuple[tuple[str, int], ...]
    factor: str


@dataclass(frozen=True)
class Unknown:
    """Computed variable, and the references that it depends on; None: on all."""

    reference: int
    depends: tuple[int, ...] | None


@dataclass(frozen=True)
class References:
    """References of the first variable of each kind; the time is 0."""

    n_x: int
    n_inputs: int
    n_p: int
    n_outputs: int
    x: int = 1

    @property
    def rates(self) -> int:
        return self.x + self.n_x

    @property
    def inputs(self) -> int:
        return self.rates + self.n_x

    @property
    def p(self) -> int:
        return self.inputs + self.n_inputs

    @property
    def outputs(self) -> int:
        return self.p + self.n_p

    @property
    def events(self) -> int:
        return self.outputs + self.n_outputs


def output_names(metadata: ModuleMetadata) -> list[tuple[str, str]]:
    """Names and units of the entries of the outputs, entries counted from 1, then of the energies where there are some."""
    result = []
    for name, shape in metadata.outputs:
        unit = metadata.output_units.get(name, "")
        if not shape:
            result.append((name, unit))
        for place in product(*(range(1, n + 1) for n in shape)) if shape else ():
            result.append((f"{name}[{','.join(map(str, place))}]", unit))
    return result + ([(name, "J") for name in ENERGIES] if "energy" in metadata.functions else [])


def variables_of(metadata: ModuleMetadata, start: Mapping[str, np.ndarray]) -> tuple[list[Variable], References]:
    """All variables in the order of their references. Raises ArgumentError where two have the same name."""
    outputs = output_names(metadata)
    at = References(len(metadata.x), len(metadata.inputs), len(metadata.parameters), len(outputs))
    units = metadata.units
    kinds = {**dict.fromkeys(metadata.q, "coordinate"), **dict.fromkeys(metadata.u, "speed"),
             **dict.fromkeys(metadata.z, "extra state")}
    rows = [Variable("time", 0, "independent", "continuous", unit="s", description="time")]
    rows += [Variable(n, at.x + k, "output", "continuous", "exact", units.get(n, ""), kinds[n], repr(float(v)))
             for k, (n, v) in enumerate(zip(metadata.x, start["x"], strict=True))]
    rows += [Variable(f"der({n})", at.rates + k, "local", "continuous", "calculated", rate_unit(units.get(n, "")),
                      f"derivative of {n} by time", derivative_of=at.x + k) for k, n in enumerate(metadata.x)]
    rows += [Variable(n, at.inputs + k, "input", "continuous", "exact", units.get(n, ""), _about_input(metadata, n),
                      repr(float(v))) for k, (n, v) in enumerate(zip(metadata.inputs, start["inputs"], strict=True))]
    rows += [Variable(n, at.p + k, "parameter", "tunable", "exact", units.get(n, ""),
                      f"mass of {metadata.masses[n]}" if n in metadata.masses else "parameter", repr(float(v)))
             for k, (n, v) in enumerate(zip(metadata.parameters, start["p"], strict=True))]
    rows += [Variable(n, at.outputs + k, "output", "continuous", "calculated", unit, "energy" if n in ENERGIES else "output")
             for k, (n, unit) in enumerate(outputs)]
    rows += [Variable(f"event.{e.name}", at.events + k, "local", "continuous", "calculated", "",
                      "what passes zero at the event") for k, e in enumerate(metadata.events)]
    names = [v.name for v in rows]
    twice = sorted({n for n in names if names.count(n) > 1})
    if twice:
        raise ArgumentError(f"{metadata.name}: an FMU has variables time, der(...), {', '.join(ENERGIES)} and event.... "
                            f"of its own, and {', '.join(twice)} would be there twice; rename it")
    return rows, at


def _about_input(metadata: ModuleMetadata, name: str) -> str:
    for motion in metadata.motions:
        if name.startswith(f"{motion}_d"):
            return f"{'rate' if name == f'{motion}_dot' else 'acceleration'} of the motion {motion}"
    return "motion" if name in metadata.motions else "input"


def rate_unit(unit: str) -> str:
    """The unit of a derivative by time."""
    power = re.search(r"/s(?:\^(\d+))?$", unit)
    return "" if not unit else f"{unit[:power.start()]}/s^{int(power[1] or 1) + 1}" if power else f"{unit}/s"


def units_of(variables: Sequence[Variable]) -> tuple[list[FmuUnit], list[Variable]]:
    """The units that occur, and the variables without those that are not known, which stay in the descriptions."""
    result: dict[str, FmuUnit | None] = {name: _unit(name) for name in dict.fromkeys(v.unit for v in variables if v.unit)}
    kept = [v if not v.unit or result[v.unit] else _without_unit(v) for v in variables]
    return [unit for unit in result.values() if unit is not None], kept


def _without_unit(variable: Variable) -> Variable:
    return replace(variable, unit="", description=f"{variable.description} [{variable.unit}]")


def _unit(name: str) -> FmuUnit | None:
    dimension = parsed(name)
    if dimension is None or any(n.denominator != 1 for n in dimension.values()):
        return None
    powers = [(base, int(dimension[base])) for base in BASE if base in dimension]
    # Angles in a numerator or a denominator, as in rad/s and N m/rad.
    turned = [(word, -1 if "/" in name[:m.start()] else 1) for word in _ANGLES for m in re.finditer(rf"\b{word}\b", name)]
    angle = sum(sign for _, sign in turned)
    factor = math.prod(_ANGLES[word] ** sign for word, sign in turned)
    return FmuUnit(name, (*powers, *([("rad", angle)] if angle else [])), repr(float(factor)))


def unknowns_of(metadata: ModuleMetadata, at: References, structure: Callable[[str], np.ndarray | None],
                arguments: Mapping[str, Sequence[str]],
                shapes: Mapping[str, Sequence[int]]) -> tuple[list[Unknown], list[Unknown]]:
    """Outputs, the states among them, and derivatives of states, each with what it depends on as far as that is known.

    structure   where a matrix of derivatives may differ from zero, by name; arguments, shapes: of the generated functions
    """
    def rows(function: str, by: Mapping[str, str], first: int) -> list[Unknown]:
        n = int(np.prod(shapes[function]))
        columns: list[list[int]] = [[] for _ in range(n)]
        for group, base in (("x", at.x), ("inputs", at.inputs)):
            if group == "inputs" and not at.n_inputs:
                continue
            matrix = structure(by[group])
            if matrix is None:
                return [Unknown(first + i, None) for i in range(n)]
            for i, row in enumerate(matrix.reshape(n, -1)):
                columns[i] += (base + np.flatnonzero(row)).tolist()
        timed = [0] if "t" in arguments[function] else []
        return [Unknown(first + i, (*timed, *c)) for i, c in enumerate(columns)]

    outputs = [Unknown(at.x + k, (at.x + k,)) for k in range(at.n_x)]
    first = at.outputs
    for name in ("outputs", "energy"):
        if name in arguments:
            result = rows(name, {group: derivative_of(name, group) for group in ("x", "inputs")}, first)
            outputs += result
            first += len(result)
    return outputs, rows("rhs", {"x": "jacobian_x", "inputs": "jacobian_inputs"}, at.rates)
