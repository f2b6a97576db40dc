"""Curves that are shown together."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from symdyn.errors import ArgumentError
from symdyn.pictures.points import points_of
from symdyn.pictures.style import LINES
from symdyn.shown import shown

if TYPE_CHECKING:
    from symdyn.runtime.solutions.solution import Solution

# Curves that a reader can tell apart in one set of axes.
MOST = len(LINES)
GROUPS = ("coordinates", "speeds", "states", "inputs", "outputs", "energy")
# Change of coordinates that shows which joint they belong to, and the least movement that counts.
_STEP, _MOVED = 1e-4, 1e-9
# The unit of outputs that are accelerations of points.
_ACCELERATION = "m/s^2"


@dataclass(frozen=True)
class Panel:
    """Curves in one set of axes: values (n_t, n).

    names   for the legend; keys: names of what they are in the module; part: which of several panels of one kind, "" of one
    group   one of GROUPS
    """

    title: str
    unit: str
    names: Sequence[str]
    values: np.ndarray
    keys: Sequence[str]
    group: str = ""
    part: str = ""


def panels_of(solution: Solution, show: Sequence[str] | None = None) -> list[Panel]:
    """Coordinates, speeds, states, inputs, outputs and energy, as far as there are any; more than eyes can distinguish are
    divided by joints.

    show   names of curves or of groups, None for all
    Raises ArgumentError for names that there are not.
    """
    every = [*_symbols(solution), *_outputs(solution), *_energy(solution)]
    chosen = every if show is None else _chosen(solution, every, show)
    return [part for panel in chosen for part in _parts(solution, panel)]


def need_something(solution: Solution, show: Sequence[str] | None, result: object) -> None:
    """Raises ArgumentError where nothing is found of what is to be shown."""
    if show is not None and not result:
        raise ArgumentError(f"{solution.module.name}: nothing of show = {list(show)!r} is in this motion")


def _chosen(solution: Solution, panels: Sequence[Panel], show: Sequence[str]) -> list[Panel]:
    name = solution.module.name
    if not isinstance(show, (list, tuple)) or not all(isinstance(_name(entry), str) for entry in show):
        raise ArgumentError(f"{name}: show is {shown(show)}; pass a list of names, such as ['coordinates', 'energy']")
    wanted = list(map(_name, show))
    there = {key for panel in panels for key in panel.keys} | {panel.group for panel in panels}
    wrong = [entry for entry in wanted if entry not in there and entry not in (*GROUPS, "mechanism")]
    if wrong:
        raise ArgumentError(f"{name}: show names {', '.join(map(repr, wrong))}, which are no curves of this motion; there are "
                            f"{', '.join(sorted(there - set(GROUPS)))}, the groups {', '.join(GROUPS)}, and 'mechanism'")
    result = []
    for panel in panels:
        places = [k for k, key in enumerate(panel.keys) if key in wanted or panel.group in wanted]
        if places:
            result.append(take(panel, places))
    return result


def _name(entry: Any) -> Any:
    """Symbols stand for their names."""
    return getattr(entry, "name", entry)


def take(panel: Panel, places: Sequence[int], part: str = "") -> Panel:
    """Some of the curves; part: which of several panels of one kind."""
    return replace(panel, names=[panel.names[k] for k in places], keys=[panel.keys[k] for k in places],
                   values=panel.values[:, list(places)], part=part)


def _parts(solution: Solution, panel: Panel) -> list[Panel]:
    """A panel, or several with as many curves as eyes can distinguish; what belongs to one joint stays together."""
    count = len(panel.names)
    if count <= MOST:
        return [panel]
    joints = _joints(solution, panel)
    runs: list[list[int]] = []
    for k in range(count):
        if runs and joints[k] and joints[k] == joints[runs[-1][-1]]:
            runs[-1].append(k)
        else:
            runs.append([k])
    size = -(-count // -(-count // MOST))
    parts: list[list[int]] = [[]]
    for run in runs:
        for piece in [run[k:k + MOST] for k in range(0, len(run), MOST)]:
            if parts[-1] and len(parts[-1]) + len(piece) > size:
                parts.append([])
            parts[-1] += piece
    return [take(panel, part, _span([joints[k] for k in part])) for part in parts]


def _span(joints: Sequence[str]) -> str:
    """The first and the last of joints."""
    named = [joint for joint in joints if joint]
    return "" if not named else named[0] if named[0] == named[-1] else f"{named[0]} \N{EN DASH} {named[-1]}"


def _joints(solution: Solution, panel: Panel) -> list[str]:
    """The joint that each curve belongs to: of a coordinate the first whose bodies it moves against each other, of a speed that
    of the coordinate whose rate it is; the beginning of the name where there is none, "" for a name of one word."""
    module, about = solution.module, solution.module.metadata
    nothing = [key.partition("_")[0] if "_" in key.removesuffix("_dot") else "" for key in panel.keys]
    if panel.group not in ("coordinates", "speeds") or "frames" not in module.functions or not about.reactions:
        return nothing
    coordinates, n_b = list(about.names("q")), len(about.bodies)
    x = np.tile(solution.x[0], (len(coordinates) + 1, 1))
    x[np.arange(1, len(x)), np.arange(len(coordinates))] += _STEP
    t, inputs = np.full(len(x), solution.t[0]), np.tile(solution.inputs[0], (len(x), 1))
    frames = module.evaluate("frames", t, x, solution.params, inputs).reshape(len(x), n_b, 12)
    if not np.isfinite(frames).all():
        return nothing
    still = np.broadcast_to(np.concatenate([np.zeros(3), np.eye(3).ravel()]), (len(x), 1, 12))
    frames = np.concatenate([frames, still], axis=1)
    places = {body: k for k, body in enumerate(about.bodies)}
    of: dict[str, str] = {}
    for joint, (parent, child) in zip(about.reactions, about.reaction_bodies, strict=True):
        a, b = (frames[:, places.get(body, n_b)] for body in (parent, child))
        R = a[:, 3:].reshape(-1, 3, 3).transpose(0, 2, 1)
        way = (R @ (b[:, :3] - a[:, :3])[:, :, None])[:, :, 0]
        turn = R @ b[:, 3:].reshape(-1, 3, 3)
        moved = np.abs(way[1:] - way[0]).max(axis=1) + np.abs(turn[1:] - turn[0]).max(axis=(1, 2)) > _MOVED
        for k in np.flatnonzero(moved):
            of.setdefault(coordinates[k], joint)
    return [of.get(key.removesuffix("_dot"), beginning) for key, beginning in zip(panel.keys, nothing, strict=True)]


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
                own = [names[k] for k in places]
                yield Panel(title, unit, own, values[:, places], own, title)


def _outputs(solution: Solution) -> Iterator[Panel]:
    """A panel for each output but matrices; components of points are named x, y, z, of other arrays by their place."""
    points = points_of(solution)
    for name, rows in solution.outputs.items():
        if rows.ndim > 2:  # such as J of a point: too many curves to read
            continue
        flat = rows.reshape(len(solution.t), -1)
        keys = [name] * flat.shape[1]
        if name in points:
            labels = [f"{name} {axis}" for axis in "xyz"[:flat.shape[1]]]
            yield Panel(points[name].quantity, points[name].unit, labels, flat, keys, "outputs")
        else:
            unit = solution.module.metadata.output_units.get(name, "")
            labels = [name] if flat.shape[1] == 1 else [f"{name} {'xyz'[k]}" if unit else f"{name}[{k}]"
                                                        for k in range(flat.shape[1])]
            yield Panel("acceleration" if unit == _ACCELERATION else "output", unit, labels, flat, keys, "outputs")


def _energy(solution: Solution) -> Iterator[Panel]:
    """Potential energy counts from the start: its zero means nothing, and far away it would flatten the curves."""
    if "energy" in solution.module.functions:
        kinetic, potential = solution.energies.T
        potential = potential - potential[:1]
        yield Panel("energy", "J", ["kinetic", "potential\n(0 at start)", "total"],
                    np.column_stack([kinetic, potential, kinetic + potential]), ["kinetic", "potential", "total"], "energy")
