"""Which curves are shown together."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from symdyn.pictures.points import points_of

if TYPE_CHECKING:
    from symdyn.runtime.solutions.solution import Solution


@dataclass(frozen=True)
class Panel:
    """Curves in one set of axes: values (n_t, n)."""

    title: str
    unit: str
    names: Sequence[str]
    values: np.ndarray


def panels_of(solution: Solution) -> list[Panel]:
    """Coordinates, speeds, states, inputs, outputs and energy, as far as there are any."""
    return [*_symbols(solution), *_outputs(solution), *_energy(solution)]


def _symbols(solution: Solution) -> Iterator[Panel]:
    """A panel for each unit; none for inputs that are zero throughout."""
    metadata = solution.module.metadata
    units = metadata.units
    for title, group, values in (("coordinates", "q", solution.q), ("speeds", "u", solution.u),
                                 ("states", "z", solution.z), ("inputs", "inputs", solution.inputs)):
        names = metadata.names(group)
        for unit in dict.fromkeys(units.get(n, "") for n in names):
            places = [k for k, n in enumerate(names) if units.get(n, "") == unit]
            if group != "inputs" or values[:, places].any():
                yield Panel(title, unit, [names[k] for k in places], values[:, places])


def _outputs(solution: Solution) -> Iterator[Panel]:
    """A panel for each output but matrices; components of points are named x, y, z, of other arrays by their place."""
    points = points_of(solution)
    for name, rows in solution.outputs.items():
        if rows.ndim > 2:  # such as J of a point: too many curves to read
            continue
        flat = rows.reshape(len(solution.t), -1)
        if name in points:
            labels = [f"{name} {axis}" for axis in "xyz"[:flat.shape[1]]]
            yield Panel(points[name].quantity, points[name].unit, labels, flat)
        else:
            unit = solution.module.metadata.output_units.get(name, "")
            labels = [name] if flat.shape[1] == 1 else [f"{name} {'xyz'[k]}" if unit else f"{name}[{k}]"
                                                        for k in range(flat.shape[1])]
            yield Panel("output", unit, labels, flat)


def _energy(solution: Solution) -> Iterator[Panel]:
    """Potential energy counts from the start: its zero means nothing, and far away it would flatten the curves."""
    if "energy" in solution.module.functions:
        kinetic, potential = solution.energies.T
        potential = potential - potential[:1]
        yield Panel("energy", "J", ["kinetic", "potential\n(0 at start)", "total"],
                    np.column_stack([kinetic, potential, kinetic + potential]))
