"""Tables in a report of one run: facts, parameters, start, extremes, energy, constraints, what loads look at."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from symdyn.runtime.solutions.validity import VALIDITY_CHECKS, checked

if TYPE_CHECKING:
    from symdyn.runtime.solutions.solution import Solution

WHERE = {"c": "compiled C", "numpy": "NumPy"}
# An energy balance worse than this is marked.
DOUBTFUL = 1e-6


@dataclass(frozen=True)
class Energy:
    """The balance of a run, J: work of the loads (input less dissipation), what resets of events added by event, change of
    energy, the largest difference of what was added and the change on the way; this relative to the larger of kinetic energy
    and range of potential energy, of a mechanism at rest to its energy; rows over time: work and resets, change."""

    work: float
    resets: dict[str, float]
    change: float
    difference: float
    relative: float
    rests: bool
    rows: np.ndarray

    @property
    def doubtful(self) -> bool:
        return not self.relative <= DOUBTFUL


@dataclass(frozen=True)
class ParameterRow:
    """A parameter, as text; changed: whether the value differs from the default."""

    name: str
    value: str
    unit: str
    default: str
    changed: bool


@dataclass(frozen=True)
class StartRow:
    """An entry of the state that the run begins with, as text."""

    name: str
    value: str
    unit: str


@dataclass(frozen=True)
class ExtremesRow:
    """Extremes of one number over time, as text: its least and largest value with their times, mean and standard deviation."""

    kind: str
    name: str
    unit: str
    least: str
    t_least: str
    most: str
    t_most: str
    mean: str
    deviation: str


@dataclass(frozen=True)
class ConstraintRow:
    """The largest residual of a constraint, and of its rate, as text."""

    name: str
    position: str
    velocity: str


@dataclass(frozen=True)
class ValidityRow:
    """A value that has a range of validity, as text; outside: whether it left the range, message: the meaning of that."""

    label: str
    least: str
    most: str
    limits: str
    outside: bool
    message: str


def number(value: Any) -> str:
    """Six digits."""
    return f"{float(value):.6g}".replace("-", "\N{MINUS SIGN}") if np.isfinite(value) else "not a number"


def facts(solution: Solution) -> list[tuple[str, str]]:
    """Facts about the run: pairs of title and text."""
    rows = [("Formulation", str(solution.module.metadata.formulation)),
            ("Computed by", f"{solution.method} on {WHERE.get(solution.backend, solution.backend)}")]
    if len(solution.t):
        rows.append(("Span", f"t = {number(solution.t[0])} s to {number(solution.t[-1])} s, {len(solution.t)} times"))
    if solution.tolerances is not None:
        rows.append(("Tolerances", f"relative {solution.tolerances[0]:.3g}, absolute {solution.tolerances[1]:.3g}"))
    rows += [("Steps", f"{solution.n_steps}, and {solution.n_rejected} rejected"), ("Evaluations", str(solution.nfev))]
    if solution.njev:
        rows.append(("Jacobians", f"{solution.njev}, and {solution.nlu} factorizations"))
    if solution.factors:
        rows.append(("Factors", solution.factors))
    inside = solution.integrator_seconds
    rows.append(("Time", _seconds(solution.seconds)
                 + (f", of which {_seconds(inside)} inside the integrator" if inside is not None else "")))
    sizes = solution.module.metadata.sizes
    counts = [(len(solution.module.metadata.bodies), "body", "bodies"), (sizes.q, "coordinate", "coordinates"),
              (sizes.u, "speed", "speeds"), (sizes.z, "extra state", "extra states"), (sizes.inputs, "input", "inputs"),
              (sizes.p, "parameter", "parameters")]
    return [*rows, ("Model", ", ".join(f"{n} {one if n == 1 else many}" for n, one, many in counts if n))]


def _seconds(time: float) -> str:
    return f"{time:.3g} s" if time >= 1 else f"{1e3 * time:.3g} ms"


def unit(text: str) -> str:
    """A unit with raised figures."""
    return text.replace("^2", "\N{SUPERSCRIPT TWO}").replace("^3", "\N{SUPERSCRIPT THREE}")


def parameters(solution: Solution) -> tuple[ParameterRow, ...]:
    """Every parameter with its value, unit, default, and whether the value differs from it."""
    metadata = solution.module.metadata
    rows = []
    for name, value, default in zip(metadata.parameters, solution.params, metadata.defaults, strict=True):
        given = default if default is not None and np.isfinite(default) else None
        rows.append(ParameterRow(name, number(value), unit(metadata.units.get(name, "")),
                                 "none" if given is None else number(given), given is None or float(value) != given))
    return tuple(rows)


def start(solution: Solution) -> tuple[StartRow, ...]:
    """The state that the run begins with."""
    if not len(solution.t):
        return ()
    metadata = solution.module.metadata
    return tuple(StartRow(name, number(value), unit(metadata.units.get(name, "")))
                 for name, value in zip(metadata.x, solution.x[0], strict=True))


def extremes(solution: Solution) -> tuple[ExtremesRow, ...]:
    """Least and largest value with their times, mean and standard deviation over time of all coordinates, speeds, states, inputs
    and outputs."""
    if not len(solution.t):
        return ()
    rows = []
    for kind, name, unit, values in _curves(solution):
        if not np.isfinite(values).all():
            continue
        low, high = int(values.argmin()), int(values.argmax())
        mean = _mean(solution.t, values)
        deviation = np.sqrt(_mean(solution.t, (values - mean)**2))
        rows.append(ExtremesRow(kind, name, unit, number(values[low]), number(solution.t[low]), number(values[high]),
                                number(solution.t[high]), number(mean), number(deviation)))
    return tuple(rows)


def _curves(solution: Solution) -> Iterator[tuple[str, str, str, np.ndarray]]:
    """Kind, name, unit and values (n_t,) of everything that is one number over time."""
    from symdyn.pictures.points import points_of

    metadata = solution.module.metadata
    for kind, group, columns in (("coordinate", "q", solution.q), ("speed", "u", solution.u), ("state", "z", solution.z),
                                 ("input", "inputs", solution.inputs)):
        for name, values in zip(metadata.names(group), columns.T, strict=True):
            yield kind, name, unit(metadata.units.get(name, "")), values
    points = points_of(solution)
    for name, rows in solution.outputs.items():
        if rows.ndim <= 2:
            flat = rows.reshape(len(solution.t), -1)
            point = points.get(name)
            for k, values in enumerate(flat.T):
                known = metadata.output_units.get(name, "") if point is None else point.unit
                place = "" if flat.shape[1] == 1 else f" {'xyz'[k]}" if known else f"[{k}]"
                yield "output", name + place, unit(known), values


def _mean(t: np.ndarray, values: np.ndarray) -> float:
    """Mean over time; between the times the values go straight."""
    if len(t) < 2:
        return float(values.mean())
    return float(((values[1:] + values[:-1]) / 2 * np.diff(t)).sum() / (t[-1] - t[0]))


def energy(solution: Solution) -> Energy | None:
    """The balance, where energy is known and the work of the loads is (a run with work=True, or loads that do none)."""
    known = solution.has_work or solution.module.metadata.conservative
    if not known or "energy" not in solution.module.functions or not len(solution.t):
        return None
    balance = solution.energy_balance
    change, error = balance["change"], balance["error"]
    resets = {name: float(rows[-1]) for name, rows in solution.reset_energy.items()}
    return Energy(float(solution.work[-1]), resets, float(change[-1]), float(np.abs(error).max()), solution.energy_error(),
                  solution.energy_scale[1], np.column_stack([change - error, change]))


def constraints(solution: Solution) -> tuple[ConstraintRow, ...]:
    """Quality of every constraint: its largest residual, relative to the mechanism's length, and of its rate."""
    names = solution.module.metadata.constraints
    if not names or not len(solution.t):
        return ()
    off, rate = (np.abs(rows).max(axis=0) for rows in (solution.constraint_violation, solution.velocity_violation))
    return tuple(ConstraintRow(name, f"{a:.2g}", f"{b:.2g}") for name, a, b in zip(names, off, rate, strict=True))


def validity_checks(solution: Solution) -> tuple[ValidityRow, ...]:
    """Range of each value that has a range of validity, its limits, and the meaning of values outside."""
    module = solution.module
    if not module.metadata.validity_checks or not len(solution.t):
        return ()
    return tuple(ValidityRow(value.label, number(value.low), number(value.high), _limits(value.least, value.most), value.outside,
                             value.message) for value in checked(module, solution.rows(VALIDITY_CHECKS), solution.t))


def _limits(least: float, most: float) -> str:
    ends = [f"from {number(least)}"] if np.isfinite(least) else []
    return " ".join([*ends, *([f"to {number(most)}"] if np.isfinite(most) else [])]) or "none"
