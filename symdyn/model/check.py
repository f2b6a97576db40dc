"""Checks a description, collects every fault in it, and returns the frozen model."""

from __future__ import annotations

import difflib
import keyword
import warnings
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import sympy as sp

from symdyn.errors import ModelError, ModelWarning
from symdyn.model.bodies import Body
from symdyn.model.closures import Constraint
from symdyn.model.contacts.lowering import with_contacts
from symdyn.model.elements import AddedMass, Element
from symdyn.model.event import check_events
from symdyn.model.faults import NAME, Faults, plain_unit
from symdyn.model.joints import Joint, Modal
from symdyn.model.loads import Force, JointForce, expressions_of
from symdyn.model.loop_check import idle_coordinate_faults, loop_faults, with_carriers
from symdyn.model.orientation import EulerParameters
from symdyn.model.physics import inertia_faults, plane_faults
from symdyn.model.points import Point
from symdyn.model.quantity import Quantity, quantities_in
from symdyn.model.record import Model
from symdyn.model.surroundings import surroundings_of
from symdyn.model.symbol_check import check_coordinates, check_symbols, chosen_speeds, spelling, symbols_in
from symdyn.model.symbols import GivenAcceleration, GivenRate, finite, take_over, time
from symdyn.model.uses import unit_of, units_of, uses
from symdyn.shown import name_of, shown

if TYPE_CHECKING:
    from symdyn.model.system import System


def check(system: System) -> Model:
    """The frozen model of a system.

    Raises ModelError that lists every fault; warns (ModelWarning) of inertias that no real body has.
    """
    return _Checker(with_contacts(with_carriers(system))).model()


class _Checker:
    def __init__(self, system: System) -> None:
        self.system = system
        self.faults = Faults(system._faults)
        self.doubts: list[str] = []
        self.known = {"ground": system.ground, **{b.name: b for b in system.bodies if isinstance(b.name, str)}}
        self.index = {id(system.ground): -1, **{id(b): k for k, b in enumerate(system.bodies)}}
        self.joints = list(dict.fromkeys(system.joints))
        self.idle_ends = {id(j.child) for j in self.joints if isinstance(j, Modal) and not j.carries}
        self.loads = [self._at_com(load) for load in system.loads]

    def model(self) -> Model:
        s = self.system
        self._names()
        slender = {id(j.parent) for j in self.joints if isinstance(j, Modal)}
        for body in s.bodies:
            faults, doubts = inertia_faults(body, s.planar)
            self.faults += faults
            self.doubts += [] if id(body) in slender else doubts
        for joint in [*self.joints, *s.loops]:
            self.faults.extend(joint.faults)
        self.faults += loop_faults(s.loops, {name_of(j): j for j in self.joints}, self._resolve)
        order = self._tree()
        if s.planar:
            self.faults += plane_faults([*self.joints, *(j for j in s.loops if isinstance(j, Joint))], s.ground_motion)
        self.coordinates, self.speeds = check_coordinates(s, self.joints, self.faults)
        self.own_speeds = self.speeds
        self.eliminated: tuple[Constraint, ...] = ()
        constraints = tuple(s.constraints)
        if s.chosen_speeds:
            self.speeds, self.eliminated = chosen_speeds(s, self.coordinates, self.own_speeds, self.faults)
            constraints = tuple(c for c in constraints if c not in self.eliminated)
        self.uses = list(uses(s, self.joints, self.loads))
        self.parameters, self.inputs = check_symbols(s, self.joints, self.uses, self.coordinates, self.own_speeds, self.faults)
        elsewhere = [symbol for _, expressions, _ in self.uses for symbol in symbols_in(expressions)]
        self.faults += idle_coordinate_faults(s.loops, [*self.coordinates, *[z.symbol for z in s.states], *elsewhere])
        state = [*self.coordinates, *self.speeds, *[z.symbol for z in s.states]]
        rates = [*self.own_speeds, *[q.dot for q in self.coordinates]]
        self.events = check_events(s.events, state, [*state, *rates, *self.inputs, time], self.faults)
        self._loads()
        self._shapes()
        defaults = self._numbers(s.defaults, "defaults", self.parameters, "parameter")
        started = [i for i in self.inputs if not isinstance(i, (GivenRate, GivenAcceleration))]
        initial = self._numbers(s.initial, "initial", [*self.coordinates, *self.speeds, *[z.symbol for z in s.states], *started],
                                "coordinate, speed, state or input")
        self.units = self._unit_names()
        duration = self._number(s.duration, "duration")
        if duration is not None and duration <= 0:
            self.faults.append(f"duration is {s.duration} s; pass a positive number")
        if self.faults:
            raise ModelError(list(dict.fromkeys(self.faults)), s.name)
        distinct = tuple(dict.fromkeys(self.doubts))
        for doubt in distinct:
            if doubt not in s._warned:  # every formulation checks the system again
                s._warned.add(doubt)
                warnings.warn(doubt, ModelWarning, stacklevel=4)
        units = {**units_of(s, self.joints, self.loads, self.uses), **self.units}
        of_lengths = {"rad": "rad/s", "m": "m/s"}
        units = {**{u: of_lengths.get(unit_of(e, units), "") for u, e in s.chosen_speeds.items()}, **units}
        return Model(
            s.name, s.planar, s.gravity, tuple(s.bodies), tuple(j for j, _, _ in order), tuple(p for _, p, _ in order),
            tuple(c for _, _, c in order), s.ground_motion, tuple(self.loads), tuple(s.outputs), tuple(s.states),
            constraints, tuple(s.loops), self.coordinates, self.speeds, self.parameters, self.inputs,
            defaults, {**self._upright(), **initial}, float(s.duration), units,
            tuple(s.shapes), surroundings_of(s, self.loads, self.parameters), self.events, distinct, tuple(s.rigid_contacts),
            tuple(s.compliant_contacts), tuple(s.lowered_groups),
            tuple(s.chosen_speeds.items()), self.own_speeds if s.chosen_speeds else (), self.eliminated)

    # -- names

    def _names(self) -> None:
        s = self.system
        if not isinstance(s.name, str) or not s.name.isidentifier() or keyword.iskeyword(s.name):
            self.faults.append(f"the system's name is {shown(s.name)}; pass an identifier such as 'arm', it names files and "
                               "functions")
        moving = [] if s.ground_motion is None else [s.ground_motion.name]
        for kind, names in (("bodies", ["ground", *[b.name for b in s.bodies]]),
                            ("joints", [*moving, *[j.name for j in [*self.joints, *s.loops]]]),
                            ("constraints", [c.name for c in s.constraints]),
                            ("outputs", [o.name for o in s.outputs]), ("events", [e.name for e in s.events]),
                            ("states", [z.symbol.name for z in s.states]),
                            ("contacts", [c.name for c in [*s.contacts, *s.contact_groups]]),
                            ("loads", [load.label for load in s.loads])):
            for name, count in Counter(map(_hashable, names)).items():
                if count > 1 and kind != "loads":
                    self.faults.append(f"{count} {kind} are named {shown(name)}; give each a name of its own")
            if kind not in ("outputs", "events"):
                spelling(self.faults, f"the {kind}", names)
        for joint, count in Counter(s.joints).items():
            if count > 1:
                self.faults.append(f"joint {shown(joint.name)} was added {count} times; add it once")
        added = Counter(map(id, s.loads))
        for load in {id(load): load for load in s.loads}.values():
            if (count := added[id(load)]) > 1:
                self.faults.append(f"{load.label} was added {count} times; add it once, or make another one")
        for output in s.outputs:
            if not isinstance(output.name, str) or not output.name.isidentifier():
                self.faults.append(f"an output is named {shown(output.name)}; pass an identifier such as 'tip'")

    # -- tree

    def _resolve(self, body: Any, where: str, carried: bool = True) -> int | None:
        result = self.known.get(body) if isinstance(body, str) else body
        if isinstance(result, Body) and id(result) in self.index:
            if carried and id(result) in self.idle_ends:
                self.faults.append(f"{where} is {shown(result.name)}, the free end of a flexible body, which was added with "
                                   "carries=False and stays at the clamped end; leave carries out")
            return self.index[id(result)]
        name, what = (body.name, "is a body of another system") if isinstance(body, Body) else (body, "is no body of the system")
        self.faults.append(f"{where} is {shown(name)}, which {what}; bodies: {', '.join(self.known)}"
                           f"{self._nearest(name, self.known)}")
        return None

    @staticmethod
    def _nearest(name: Any, known: Iterable[str]) -> str:
        near = difflib.get_close_matches(name, [k for k in known if k != name], n=1) if isinstance(name, str) else []
        return f"; did you mean {shown(near[0])}?" if near else ""

    def _at_com(self, load: Any) -> Any:
        """A force without a point acts at the centre of mass."""
        if not isinstance(load, Force) or load.point is not None:
            return load
        body = load.body if isinstance(load.body, Body) else self.known.get(load.body) if isinstance(load.body, str) else None
        return replace(load, point=sp.ImmutableMatrix(sp.zeros(3, 1)) if body is None else body.com)

    def _tree(self) -> list[tuple[Joint, int, int]]:
        s = self.system
        edges: dict[int, tuple[Joint, int]] = {}
        doubtful: set[int] = set()
        if not s.bodies:
            self.faults.append("the system has no bodies; add one with add_body and join it with add_joint")
        for joint in self.joints:
            parent = self._resolve(joint.parent, f"joint {shown(joint.name)}: parent")
            child = self._resolve(joint.child, f"joint {shown(joint.name)}: child", not isinstance(joint, Modal))
            if parent is None or child is None:
                doubtful.update(range(len(s.bodies)) if child is None else {child})
            elif child == -1:
                self.faults.append(f"joint {shown(joint.name)}: the ground is its child; exchange parent and child")
                doubtful.add(parent)
            elif child == parent:
                self.faults.append(f"joint {shown(joint.name)} joins body {shown(s.bodies[child].name)} to itself; "
                                   "pass two different bodies")
                doubtful.add(child)
            elif child in edges:
                self.faults.append(
                    f"body {shown(s.bodies[child].name)} is the child of joints {shown(edges[child][0].name)} and "
                    f"{shown(joint.name)}, "
                    f"a loop in the tree; add one of them with close_loop")
            else:
                edges[child] = (joint, parent)
        order: list[tuple[Joint, int, int]] = []
        given = {c: k for k, c in enumerate(edges)}
        children: dict[int, list[int]] = {}
        for c, (_, p) in edges.items():
            children.setdefault(p, []).append(c)
        ready = children.get(-1, [])
        while ready:
            order += [(*edges[c], c) for c in ready]
            ready = sorted([c for p in ready for c in children.get(p, ())], key=given.__getitem__)
        looped = sorted(c for c in edges.keys() - {c for _, _, c in order} if _in_loop(c, edges))
        if looped:
            names = ", ".join(repr(s.bodies[c].name) for c in looped)
            self.faults.append(f"bodies {names} hang on each other in a loop and not on the ground; "
                               "join one of them to the ground and close the loop with close_loop")
        for k, body in enumerate(s.bodies):
            if k not in edges and k not in doubtful:
                self.faults.append(f"body {shown(body.name)} has no joint; join it to a parent (a body that moves freely: Free)")
        places = {joint: k for k, joint in enumerate(self.joints)}
        as_added = sorted(order, key=lambda e: places[e[0]])
        return as_added if _is_tree(as_added) else order

    # -- loads, numbers, units

    def _loads(self) -> None:
        joints = {name_of(j): j for j in self.joints}
        for load in self.loads:
            if isinstance(load, (Element, AddedMass)):
                self.faults.extend(load.faults)
                self.doubts += load.doubts if isinstance(load, Element) else []
                if load.body is self.system.ground or load.body == "ground":
                    self.faults.append(f"{load.label} acts on the ground, so that nothing comes of it; pass a body that moves")
            if isinstance(load, JointForce):
                joint = joints.get(load.joint) if isinstance(load.joint, str) else load.joint
                if not any(joint is j for j in self.joints):
                    self.faults.append(f"{load.label} acts on the joint {shown(load.joint)}, which the system does not have; "
                                       f"joints: {', '.join(joints) or 'none'}{self._nearest(load.joint, joints)}")
                elif joint is not None and len(load.values) != joint.n_speeds:
                    self.faults.append(f"{load.label} has {len(load.values)} values; joint {shown(joint.name)} has "
                                       f"{joint.n_speeds} degrees of freedom")
                continue
            places = {attribute: self._resolve(getattr(load, attribute), f"{load.label}: {attribute}")
                      for attribute in ("body", "body_a", "body_b", "frame", "reaction")
                      if hasattr(load, attribute) and (attribute.startswith("body") or getattr(load, attribute) is not None)}
            for one, other in (("body", "reaction"), ("body_a", "body_b")):
                if places.get(one) is not None and places.get(one) == places.get(other):
                    self.faults.append(f"{load.label}: {one} and {other} are the same body, so that nothing comes of it; "
                                       "pass two different bodies")
        reacting = [load.label for load in self.loads
                    if any(q.level == 2 and q.measure.kind != "contact" for q in quantities_in(expressions_of(load)))]
        if self.system.rigid_contacts and reacting:
            self.faults.append(f"{', '.join(reacting)} depend{'s' if len(reacting) == 1 else ''} on accelerations, multipliers "
                               "or reactions, which rigid contacts do not go with; give the load another law, or the contact "
                               "law='compliant'")
        for output in self.system.outputs:
            if isinstance(output.value, Point):
                self._resolve(output.value.body, f"output {shown(output.name)}: body")
        for where, expressions, _ in self.uses:
            for quantity in quantities_in(expressions):
                self._quantity(quantity, where)

    def _quantity(self, quantity: Quantity, where: str) -> None:
        """The bodies and the joint that a quantity is of belong to the system; constraints get their names when derived."""
        measure = quantity.measure
        if measure.kind == "reaction":
            joints = [str(j.name) for j in [*self.joints, *self.system.loops] if isinstance(j, Joint)]
            if measure.of[0] not in joints:
                self.faults.append(f"{where} uses {quantity}, but the system has no joint {measure.of[0]!r}; joints: "
                                   f"{', '.join(joints) or 'none'}{self._nearest(measure.of[0], joints)}")
        elif measure.kind not in ("multiplier", "contact"):
            for name in measure.of:
                self._resolve(name, f"{where}: body of {quantity}")
        if measure.frame is not None:
            self._resolve(measure.frame, f"{where}: frame of {quantity}")

    def _shapes(self) -> None:
        """Shapes have the bodies and parameters that the mechanism has without them."""
        for shape in self.system.shapes:
            if self.system.ground_motion is not None and shape.about["kind"] != "water" and (
                    getattr(shape.body, "name", shape.body) == "ground"):
                self.faults.append(f"{shape.what}: shapes are not drawn on a ground that moves; draw them on a body")
            ends = [shape.about["to"]] if shape.about.get("to") is not None else []
            for body in (shape.body, *ends):
                self._resolve(body, shape.what)
            strange = [a for a in symbols_in(shape.expressions) if a not in self.parameters]
            if strange:
                self.faults.append(f"{shape.what} uses {', '.join(map(str, strange))}, which the mechanism does not have for a "
                                   f"parameter; there are {', '.join(map(str, self.parameters)) or 'none'}; pass numbers")

    def _numbers(self, given: Any, what: str, allowed: Iterable[sp.Symbol], kind: str) -> dict[sp.Symbol, float]:
        """A table of numbers by symbol; symbols are known by their names."""
        if not isinstance(given, Mapping):
            self.faults.append(f"{what} is {shown(given)}; pass a dict such as {{m: 1.5}}")
            return {}
        result = {}
        symbols = {s.name: s for s in allowed}
        for key, value in given.items():
            taken = take_over(key) if isinstance(key, sp.Basic) else key
            name = name_of(taken)
            number = self._number(value, f"{what}: the value of {name}")
            if name not in symbols:
                self.faults.append(f"{what} has a number for {shown(name)}, which is no {kind} of the system; "
                                   f"there are {', '.join(symbols) or 'none'}{self._nearest(name, symbols)}")
            elif number is not None:
                result[symbols[name]] = number
        return result

    def _upright(self) -> dict[sp.Symbol, float]:
        """Euler parameters start at no rotation, unless they are given."""
        return {j.coordinates[-4]: 1.0 for j in self.joints if isinstance(getattr(j, "orientation", None), EulerParameters)}

    def _unit_names(self) -> dict[sp.Symbol, str]:
        """The units that were given, by symbol."""
        symbols = {a.name: a for a in [*self.coordinates, *self.speeds, *[z.symbol for z in self.system.states],
                                       *self.parameters, *self.inputs]}
        units: dict[sp.Symbol, str] = {}
        if not isinstance(self.system.units, Mapping):
            self.faults.append(f"units is {shown(self.system.units)}; pass a dict such as {{m: 'kg'}}")
            return units
        for key, unit in self.system.units.items():
            name = name_of(key)
            if name not in symbols:
                self.faults.append(f"units has one for {shown(name)}, which is no symbol of the system"
                                   f"{self._nearest(name, symbols)}")
            elif not isinstance(unit, str) or not NAME.fullmatch(plain_unit(unit)):
                self.faults.append(f"units: that of {name} is {shown(unit)}; pass text such as 'N m'")
            else:
                units[symbols[name]] = plain_unit(unit)
        return units

    def _number(self, value: Any, what: str) -> float | None:
        """A finite real number."""
        number = finite(value)
        if number is None:
            self.faults.append(f"{what} is {shown(value)}; pass a finite number, real and within double precision")
        return number


def _in_loop(body: int, edges: dict[int, tuple[Joint, int]]) -> bool:
    """Whether a body is its own ancestor."""
    ancestor = body
    for _ in edges:
        if ancestor not in edges:
            return False
        ancestor = edges[ancestor][1]
        if ancestor == body:
            return True
    return False


def _hashable(name: Any) -> Any:
    return name if isinstance(name, str) else shown(name)


def _is_tree(order: list[tuple[Joint, int, int]]) -> bool:
    """Whether an order of joints has parents before children."""
    placed = {-1}
    for _, parent, child in order:
        if parent not in placed:
            return False
        placed.add(child)
    return True
