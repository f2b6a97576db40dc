"""A mechanism whose coordinates and parameters are sliders: its kinematics run in the page."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import numpy as np

from symdyn.arguments import take
from symdyn.emission import emit
from symdyn.errors import ArgumentError, SymdynError
from symdyn.formulation.constraints.augmented import augment
from symdyn.formulation.equations import Equations
from symdyn.formulation.trees.recursive import recursive
from symdyn.pictures.arrows import POINTS
from symdyn.pictures.bending import bent_bodies
from symdyn.pictures.looks import Mechanism, not_drawn_by_rules, ropes_of, with_surroundings
from symdyn.pictures.mechanism import filled, touched
from symdyn.pictures.symbols import typeset_unit
from symdyn.tape.floats import evaluate_rows
from symdyn.turning import in_radians
from symdyn.viewer.page import View, page_of
from symdyn.viewer.scene import scene_of

if TYPE_CHECKING:
    from symdyn.given import Numbers, Values
    from symdyn.model.record import Model
    from symdyn.model.system import System

# Configurations at which is looked where contacts are.
_SAMPLES = 6
# Distance beyond its start that a mechanism may reach by its sliders, as a part of its length.
_FURTHER = 1.0
# Functions that the page evaluates to place shapes and to close loops.
_POSES = ("frames", "positions", "joint_points", "joint_axes", "spring_points")
_CLOSURE = ("C", "C_r", "N")


def show(system: System, path: Any = None, params: Numbers | None = None, q: Values | None = None) -> View:
    """A page with the mechanism of a system, see System.show."""
    model = system.check()
    equations = _equations(model)
    names = [n for n in _POSES if n in equations.quantities]
    closes = any(equations.holonomic)
    values, missing = _values(equations, params, q)
    numbers = _evaluate(equations, names, values)
    mechanism = _mechanism(equations, numbers, values, False)
    lengths = numbers.get("drawn_lengths", np.zeros(0)).ravel()
    bent = bent_bodies(equations.flexible, equations.bodies, lambda name: np.array([values[name]]))
    data = scene_of(mechanism, equations.drawn, lengths, bent, model.name)
    data |= {"kind": "live", "name": model.name, "missing": missing, "functions": names, "closes": closes,
             "holonomic": list(equations.holonomic), "unit_groups": _groups(equations),
             "sliders": _sliders(equations, values, [*names, *(_CLOSURE if closes else ())], data["length"])}
    return page_of(model.name, data, _functions(equations, [*names, *(_CLOSURE if closes else ())]), path)


def mechanism_of(model: Model) -> tuple[Mechanism, np.ndarray]:
    """The mechanism of a model at its initial coordinates, its loops as they are there, and the lengths of its shapes."""
    equations = _equations(model)
    values, _ = _values(equations, None, None)
    numbers = _evaluate(equations, [n for n in _POSES if n in equations.quantities], values)
    return _mechanism(equations, numbers, values, True), numbers.get("drawn_lengths", np.zeros(0)).ravel()


def _equations(model: Model) -> Equations:
    """Equations to place bodies by: the recursions, which need no mass matrix, or the augmented ones that close loops."""
    return augment(model) if model.loops or model.constraints else recursive(model)


def _values(equations: Equations, params: Any, q: Any) -> tuple[dict[str, float], list[str]]:
    """A number for every symbol, and the parameters that have none of their own: 1 is taken."""
    s = equations.symbols
    defaults = {p.name: s.defaults.get(p) for p in s.parameters}
    missing = [name for name, value in defaults.items() if value is None]
    known = {name: 1.0 if value is None else float(value) for name, value in defaults.items()}
    names = [p.name for p in s.parameters]
    given = take(params, names, "params", known, equations.name)
    if params is not None:
        named = {getattr(key, "name", key) for key in params} if hasattr(params, "keys") else set(names)
        missing = [name for name in missing if name not in named]
    coordinates = [c.name for c in s.coordinates]
    start = {c.name: float(s.initial.get(c, 0.0)) for c in s.coordinates}
    for group in _groups(equations):
        if not any(start[coordinates[k]] for k in group):
            start[coordinates[group[0]]] = 1.0
    at = take(q, coordinates, "q", start, equations.name)
    values = {"t": 0.0, **dict.fromkeys((u.name for u in (*s.speeds, *s.states)), 0.0),
              **{i.name: float(s.initial.get(i, 0.0)) for i in s.inputs},
              **dict(zip(names, map(float, given), strict=True)), **dict(zip(coordinates, map(float, at), strict=True))}
    return values, missing


def _groups(equations: Equations) -> list[list[int]]:
    places = {c: k for k, c in enumerate(equations.symbols.coordinates)}
    return [[places[c] for c in group] for group in equations.unit_groups if all(c in places for c in group)]


def _evaluate(equations: Equations, names: Sequence[str], values: dict[str, float]) -> dict[str, np.ndarray]:
    """Quantities at one configuration. Raises ArgumentError where a point is not finite."""
    more = [n for n in ("drawn_lengths", "inertial_parameters", "contact_gaps") if n in equations.quantities]
    result = {n: rows[0] for n, rows in evaluate_rows(equations.tape(*names, *more), values, 1).items()}
    wrong = [n for n in (*names, "drawn_lengths") if n in result and not np.isfinite(result[n]).all()]
    if wrong:
        raise ArgumentError(f"{equations.name}: {', '.join(wrong)} are not finite at the coordinates and parameters to be shown; "
                            "pass others with q={...} and params={...}")
    return result


def _mechanism(equations: Equations, numbers: dict[str, np.ndarray], values: dict[str, float], coarse: bool) -> Mechanism:
    n_b = len(equations.bodies)
    nothing = np.zeros((0, 6))
    drawn = not_drawn_by_rules(equations, [j[0] for j in equations.joints], [(j[1], j[2]) for j in equations.joints])
    inertia = numbers.get("inertial_parameters")
    springs = numbers.get("spring_points", nothing).reshape(-1, 6)
    gaps = numbers.get("contact_gaps", nothing).ravel()[:4 * len(equations.contacts):4].tolist()
    ropes = ropes_of([c.name for c in equations.contacts], equations.connections, gaps, springs) if len(gaps) else {}
    result = Mechanism(equations.bodies, numbers["frames"].reshape(n_b, 12), numbers["positions"].reshape(n_b, 3),
                     equations.joints, numbers.get("joint_points", nothing).reshape(-1, 6),
                     numbers.get("joint_axes", nothing).reshape(-1, 3), equations.connections,
                     springs, None if inertia is None else inertia.reshape(n_b, 10), equations.planar, equations.down,
                     drawn, ropes=ropes)
    corners, wheels = _touching(equations, result, values)
    lengths = numbers.get("drawn_lengths", nothing).ravel()
    around = list(filled([*equations.drawn, *equations.surroundings], lengths))[len(equations.drawn):]
    result = replace(result, corners=corners, wheels=wheels)
    return with_surroundings(result, around, equations.drawn, result.frames[None], _FURTHER, coarse)


def _touching(equations: Equations, m: Mechanism, values: dict[str, float],
              ) -> tuple[list[tuple[int, np.ndarray]], dict[int, float]]:
    """Corners and rims, see `touched`: from some configurations, whether contacts are closed or not."""
    if POINTS not in equations.quantities:
        return [], {}
    rng = np.random.default_rng(0)
    rows: dict[str, Any] = dict(values)
    names = [c.name for c in equations.symbols.coordinates]
    for name in names:
        rows[name] = values[name] + rng.uniform(-1, 1, _SAMPLES)
    for group in _groups(equations):
        norm = np.sqrt(sum(rows[names[k]] ** 2 for k in group))
        for k in group:
            rows[names[k]] = rows[names[k]] / norm
    with np.errstate(all="ignore"):
        result = evaluate_rows(equations.tape("frames", POINTS), rows, _SAMPLES)
    at = result[POINTS].reshape(_SAMPLES, -1, 2, 3)[:, :, 0]
    frames = result["frames"].reshape(_SAMPLES, len(m.bodies), 12)
    there = np.isfinite(frames).all(axis=(1, 2)) & np.isfinite(at).all(axis=(1, 2))
    return touched(m, frames[there], at[there]) if there.sum() > 1 else ([], {})


def _functions(equations: Equations, names: Sequence[str]) -> str:
    """The kinematics in JavaScript, as the object `kinematics`."""
    try:
        source = emit(equations, "javascript", names, standalone=False, integrator=False)
    except SymdynError as error:
        raise ArgumentError(f"{equations.name}: the kinematics cannot run in a page: {error}; simulate it and use "
                            "solution.view()") from error
    (text,) = source.files.values()
    return f"const kinematics = (() => {{\n{text}\nreturn {{ prologue, {', '.join(names)} }};\n}})();"


def _sliders(equations: Equations, values: dict[str, float], names: Sequence[str], length: float) -> list[dict[str, Any]]:
    """Sliders that move the mechanism: coordinates, and the parameters, inputs and time that its kinematics depend on."""
    s = equations.symbols
    used = {leaf.args[1] for leaf in equations.tape(*names).inputs}
    shaped = "drawn_lengths" in equations.quantities
    fixed = {leaf.args[1] for leaf in equations.tape("drawn_lengths").inputs} if shaped else set()
    unit = {c: k for k, group in enumerate(_groups(equations)) for c in group}
    result = []
    for k, c in enumerate(s.coordinates):
        value = 0.0 if k in unit else values[c.name]
        reach = 1.0 if k in unit else s.reach.get(c) or (math.pi if in_radians(s.units.get(c)) else 0.6 * length)
        result.append(_slider("q", k, c.name, s.units.get(c, ""), values[c.name], value - reach, value + reach))
    for group, symbols in (("p", s.parameters), ("inputs", s.inputs)):
        for k, p in enumerate(symbols):
            value = values[p.name]
            ends = ((0.1 * value, 2.5 * value) if group == "p" and value else
                    (value - math.pi, value + math.pi) if in_radians(s.units.get(p)) else (value - length, value + length))
            result.append(_slider(group, k, p.name, s.units.get(p, ""), value, min(ends), max(ends),
                                  p.name in used and p.name not in fixed))
    waves = any("waves" in record["values"] for record in equations.drawn)
    result.append(_slider("t", 0, "t", "s", 0.0, 0.0, s.duration, waves or "t" in used))
    return result


def _slider(group: str, k: int, name: str, unit: str, value: float, least: float, most: float,
            moves: bool = True) -> dict[str, Any]:
    return {"group": group, "k": k, "name": name, "unit": typeset_unit(unit), "value": value, "least": least, "most": most,
            "moves": moves}
