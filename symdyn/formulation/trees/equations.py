"""From a checked model to the equations of its tree: what the formulations of a tree share."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any, TypeVar

import sympy as sp

from symdyn.errors import ModelError, SymdynError
from symdyn.formulation.equations import Symbols
from symdyn.formulation.loads.implicit import implicit
from symdyn.formulation.loads.measured import Measured
from symdyn.formulation.printed.independent_speeds import MotionEquations
from symdyn.formulation.printed.provenance import OfBodies
from symdyn.formulation.trees.chosen_speeds import algebra_of
from symdyn.formulation.trees.quantities import TreeQuantities
from symdyn.formulation.trees.tree import Tree, build
from symdyn.model.elements import MooringLine
from symdyn.model.joints import Fixed, Joint, Modal
from symdyn.model.loads import ForceBetween, SpringDamper, expressions_of
from symdyn.model.orientation import EulerAngles, EulerParameters
from symdyn.model.points import Point
from symdyn.model.quantity import quantities_in
from symdyn.model.record import Model
from symdyn.shown import name_of, shown

FRAMES = ("body", "parallel")
E = TypeVar("E", bound=MotionEquations)


def derive_tree(model: Model, formulation: str, frames: str, derivation: type[TreeQuantities], result: type[E]) -> E:
    """Equations of a tree, recorded on a tape of their own.

    frames   "body": every link in its own axes; "parallel": in those of the link before where axes stay parallel
    Raises ModelError for constraints and for speeds that move nothing, SymdynError for unknown frames.
    """
    if model.constraints or model.loops:
        count = len(model.constraints) + len(model.loops)
        what = "a constraint or closed loop" if count == 1 else f"{count} constraints or closed loops"
        raise ModelError([f"the model has {what}; the {formulation} form takes trees only: use "
                          "system.augmented(), or let joints take expressions of fewer coordinates"], model.name)
    quantities = derivation(tree_of(model, frames))
    quantities.demand_inertia()
    return tree_result(quantities, formulation, result, partial(derive_tree, model, formulation, frames, derivation, result))


def tree_of(model: Model, frames: str) -> Tree:
    """The tree of a model on a tape of its own. Raises SymdynError for unknown frames."""
    if not isinstance(frames, str) or frames not in FRAMES:
        raise SymdynError(f"frames {shown(frames)} asked for; there are {' and '.join(map(repr, FRAMES))}")
    tree = build(model, algebra_of(model), frames == "parallel")
    tree.algebra.measured = Measured(tree)
    return tree


def _point_units(model: Model) -> dict[str, str]:
    """Outputs that are places, velocities and accelerations of points."""
    units = {"position": "m", "velocity": "m/s", "acceleration": "m/s^2"}
    return {o.name: units[o.value.quantity] for o in model.outputs if isinstance(o.value, Point) and o.value.quantity in units}


def tree_result(quantities: TreeQuantities, formulation: str, result: type[E], again: Callable[[], E], **more: Any) -> E:
    """The equations that hold the quantities of a tree; again: derives them again."""
    model, tree, algebra = quantities.model, quantities.tree, quantities.algebra
    parameters = set(model.parameters)
    symbols = Symbols(model.coordinates, model.speeds, tuple(z.symbol for z in model.states), model.inputs,
                      model.parameters, model.defaults, model.initial, model.units, model.duration, _reach(model),
                      {b.mass: b.name for b in reversed(model.bodies) if b.mass in parameters}, _point_units(model))
    recorded = quantities.quantities()
    lengths = [e for shape in (*model.shapes, *model.surroundings) for e in shape.expressions]
    if lengths:
        recorded["drawn_lengths"] = partial(algebra.constants, lengths)
    return result(model.name, formulation, model.planar, symbols, algebra.recorder, algebra.leaves, recorded,
                  tuple(_notes(model, tree) + quantities.notes), _unit_groups(model), again,
                  frames="parallel" if tree.parallel else "body",
                  of_reactions=_of_reactions(model),
                  implicit_loads=tuple(load.label for load in model.loads if implicit(expressions_of(load))),
                  identification=quantities.identification if tree.rigid else None,
                  provenance=OfBodies(quantities), charts=_charts(model), validity_checks=quantities.loads.validity_checks,
                  events=model.events,
                  contacts=model.contacts, compliant=model.compliant, contact_groups=model.groups,
                  bodies=tuple(b.name for b in model.bodies),
                  joints=_joints(quantities), drawn=tuple(shape.record for shape in model.shapes),
                  surroundings=tuple(shape.record for shape in model.surroundings),
                  connections=_connections(quantities),
                  acting=tuple(one.record for one in quantities.acting), down=_down(model),
                  flexible=tuple(j.record for j in model.joints if isinstance(j, Modal)),
                  **more)


def _joints(quantities: TreeQuantities) -> tuple[tuple[str, str, str, str], ...]:
    """Name, parent, child and kind of the joints that react; for a carrier the body that is fixed to it."""
    def name(body: Any) -> str:
        return name_of(body)

    carried = {name(c.parent): name(c.child) for c in quantities.model.loops if isinstance(c, Joint) and c.inner}
    return tuple((j.name, name(j.parent), carried.get(name(j.child), name(j.child)), j.kind) for j in quantities.reacting)


def _connections(quantities: TreeQuantities) -> tuple[tuple[str, str, str, str], ...]:
    """Name, bodies and kind of the loads along a line."""
    ropes = {f"rope {shown(contact.name)}" for contact in quantities.model.contacts if not contact.at}

    def kind(load: SpringDamper | ForceBetween) -> str:
        if isinstance(load, ForceBetween):
            return "rope" if load.label in ropes else "force"
        return "damper" if load.stiffness == 0 else "spring" if load.damping == 0 else "both"

    return tuple((load.label, name_of(load.body), "ground", "line") if isinstance(load, MooringLine) else
                 (load.label, name_of(load.body_a), name_of(load.body_b), kind(load)) for load in quantities.connections)


def _down(model: Model) -> tuple[float, float, float]:
    """The direction of gravity at the parameters' numbers, 1 where they have none; zero where it has none."""
    numbers = {s: sp.Float(model.defaults.get(s, 1.0)) for s in model.gravity.free_symbols}
    g = [float(e) if e.is_real else 0.0 for e in (sp.N(e.xreplace(numbers)) for e in model.gravity)]
    length = sum(v * v for v in g) ** 0.5
    x, y, z = (v / length if length > 0 else 0.0 for v in g)
    return x, y, z


def _notes(model: Model, tree: Tree) -> list[str]:
    notes = []
    fixed = [j.name for j in model.joints if isinstance(j, Fixed)]
    if fixed:
        notes.append(f"fixed joints {', '.join(fixed)}: their bodies are merged with their parents before the derivation")
    if tree.parallel:
        notes.append(f"turning between links: the frames of {tree.parallel} links stay parallel to those before them")
    return notes


def _reach(model: Model) -> dict[sp.Symbol, float]:
    """Elastic coordinates: a deflection of a tenth of the beam's length is far."""
    return {q: joint.reach for joint in model.joints if isinstance(joint, Modal) for q in joint.coordinates}


def _charts(model: Model) -> tuple[tuple[str, str, str, str], ...]:
    """Joints whose orientation is described by Euler angles of their own; the second angle is what brings gimbal lock."""
    oriented = [(j, getattr(j, "orientation", None)) for j in model.joints]
    return tuple((j.name, angles.sequence, angles.speeds, j.coordinates[-2].name) for j, angles in oriented
                 if isinstance(angles, EulerAngles) and j.coordinates[-2] in model.coordinates)


def _of_reactions(model: Model) -> tuple[str, ...]:
    """Outputs and rates of states that depend on multipliers or reactions."""
    result = []
    values: list[tuple[str, Any]] = [(f"the rate of {z.symbol}", z.rate) for z in model.states]
    values += [(f"output {o.name}", o.value) for o in model.outputs if not isinstance(o.value, Point)]
    for what, value in values:
        kinds = {q.measure.kind for q in quantities_in(value if isinstance(value, tuple) else [value])}
        if kinds & {"multiplier", "reaction"}:
            result.append(what)
    return tuple(result)


def _unit_groups(model: Model) -> tuple[tuple[sp.Symbol, ...], ...]:
    joints = [j for j in model.joints if isinstance(getattr(j, "orientation", None), EulerParameters)]
    return tuple(tuple(j.coordinates[-4:]) for j in joints)
