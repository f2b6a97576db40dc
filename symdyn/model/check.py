"""Checks a description, collects every fault in it, and returns the frozen model."""

from __future__ import annotations

import difflib
import keyword
import math
import warnings
from collections import Counter
from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any

import sympy as sp

from symdyn.errors import ModelError, ModelWarning
from symdyn.model.bodies import Body, Component, Point
from symdyn.model.elements import AddedMass, Element
from symdyn.model.event import check_events
from symdyn.model.faults import NAME, Faults
from symdyn.model.joints import Joint, Modal
from symdyn.model.loads import Force, JointForce
from symdyn.model.loop_check import idle_coordinate_faults, loop_faults, with_carriers
from symdyn.model.orientation import EulerParameters
from symdyn.model.physics import inertia_faults, plane_faults
from symdyn.model.record import Model
from symdyn.model.symbol_check import check_coordinates, check_symbols, spelling, symbols_in
from symdyn.model.symbols import take_over, time
from symdyn.model.uses import units_of, uses

if TYPE_CHECKING:
    from symdyn.model.system import System


def check(system: System) -> Model:
    """The frozen model of a system.

    Raises ModelError that lists every fault; warns (ModelWarning) of inertias that no real body has.
    """
    return _Checker(with_carriers(system)).model()


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
        self.faults += loop_faults(s.loops, {str(j.name): j for j in self.joints}, self._resolve)
        order = self._tree()
        if s.planar:
            self.faults += plane_faults([*self.joints, *(j for j in s.loops if isinstance(j, Joint))], s.ground_motion)
        self.coordinates, self.speeds = check_coordinates(s, self.joints, self.faults)
        self.parameters, self.inputs = check_symbols(s, self.joints, self.loads, self.coordinates, self.speeds, self.faults)
        elsewhere = [symbol for _, expressions, _ in uses(s, self.joints, self.loads) for symbol in symbols_in(expressions)]
        self.faults += idle_coordinate_faults(s.loops, [*self.coordinates, *[z.symbol for z in s.states], *elsewhere])
        state = [*self.coordinates, *self.speeds, *[z.symbol for z in s.states]]
        self.events = check_events(s.events, state, [*state, *[q.dot for q in self.coordinates], *self.inputs, time], self.faults)
        self._loads()
        self._shapes()
        defaults = self._numbers(s.defaults, "defaults", self.parameters, "parameter")
        initial = self._numbers(s.initial, "initial", [*self.coordinates, *self.speeds, *[z.symbol for z in s.states],
                                                       *self.inputs], "coordinate, speed, state or input")
        self.units = self._unit_names()
        duration = self._number(s.duration, "duration")
        if duration is not None and duration <= 0:
            self.faults.append(f"duration is {s.duration} s; pass a positive number")
        if self.faults:
            raise ModelError(list(dict.fromkeys(self.faults)), s.name)
        for doubt in self.doubts:
            warnings.warn(doubt, ModelWarning, stacklevel=4)
        return Model(
            s.name, s.planar, s.gravity, tuple(s.bodies), tuple(j for j, _, _ in order), tuple(p for _, p, _ in order),
            tuple(c for _, _, c in order), s.ground_motion, tuple(self.loads), tuple(s.outputs), tuple(s.states),
            tuple(s.constraints), tuple(s.loops), self.coordinates, self.speeds, self.parameters, self.inputs,
            defaults, {**self._upright(), **initial}, float(s.duration), {**units_of(s, self.joints, self.loads), **self.units},
            tuple(s.shapes), self.events)

    # -- names

    def _names(self) -> None:
        s = self.system
        if not isinstance(s.name, str) or not s.name.isidentifier() or keyword.iskeyword(s.name):
            self.faults.append(f"the system's name is {s.name!r}; pass an identifier such as 'arm', it names files and "
                               "functions")
        moving = [] if s.ground_motion is None else [s.ground_motion.name]
        for kind, names in (("bodies", ["ground", *[b.name for b in s.bodies]]),
                            ("joints", [*moving, *[j.name for j in [*self.joints, *s.loops]]]),
                            ("constraints", [c.name for c in s.constraints]),
                            ("outputs", [o.name for o in s.outputs]), ("events", [e.name for e in s.events]),
                            ("states", [z.symbol.name for z in s.states]),
                            ("loads", [load.label for load in s.loads])):
            for name, count in Counter(map(_hashable, names)).items():
                if count > 1 and kind != "loads":
                    self.faults.append(f"{count} {kind} are named {name!r}; give each a name of its own")
            if kind not in ("outputs", "events"):
                spelling(self.faults, f"the {kind}", names)
        for joint, count in Counter(s.joints).items():
            if count > 1:
                self.faults.append(f"joint {joint.name!r} was added {count} times; add it once")
        for load in {id(load): load for load in s.loads}.values():
            count = sum(other is load for other in s.loads)
            if count > 1:
                self.faults.append(f"{load.label} was added {count} times; add it once, or make another one")
        for output in s.outputs:
            if not isinstance(output.name, str) or not output.name.isidentifier():
                self.faults.append(f"an output is named {output.name!r}; pass an identifier such as 'tip'")

    # -- tree

    def _resolve(self, body: Any, where: str, carried: bool = True) -> int | None:
        found = self.known.get(body) if isinstance(body, str) else body
        if isinstance(found, Body) and id(found) in self.index:
            if carried and id(found) in self.idle_ends:
                self.faults.append(f"{where} is {found.name!r}, the free end of a flexible body, which was added with "
                                   "carries=False and stays at the clamped end; leave carries out")
            return self.index[id(found)]
        name, what = (body.name, "is a body of another system") if isinstance(body, Body) else (body, "is no body of the system")
        self.faults.append(f"{where} is {name!r}, which {what}; bodies: {', '.join(self.known)}"
                           f"{self._nearest(name, self.known)}")
        return None

    @staticmethod
    def _nearest(name: Any, known: Iterable[str]) -> str:
        near = difflib.get_close_matches(str(name), [k for k in known if k != name], n=1)
        return f"; did you mean {near[0]!r}?" if near else ""

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
            parent = self._resolve(joint.parent, f"joint {joint.name!r}: parent")
            child = self._resolve(joint.child, f"joint {joint.name!r}: child", not isinstance(joint, Modal))
            if parent is None or child is None:
                doubtful.update(range(len(s.bodies)) if child is None else {child})
            elif child == -1:
                self.faults.append(f"joint {joint.name!r}: the ground is its child; exchange parent and child")
                doubtful.add(parent)
            elif child == parent:
                self.faults.append(f"joint {joint.name!r} joins body {s.bodies[child].name!r} to itself; "
                                   "pass two different bodies")
                doubtful.add(child)
            elif child in edges:
                self.faults.append(
                    f"body {s.bodies[child].name!r} is the child of joints {edges[child][0].name!r} and {joint.name!r}, "
                    f"a loop in the tree; add one of them with close_loop")
            else:
                edges[child] = (joint, parent)
        order: list[tuple[Joint, int, int]] = []
        placed = {-1}
        waiting = dict(edges)
        while waiting:
            ready = [c for c, (_, p) in waiting.items() if p in placed]
            if not ready:
                looped = sorted(c for c in waiting if _in_loop(c, edges))
                if looped:
                    names = ", ".join(repr(s.bodies[c].name) for c in looped)
                    self.faults.append(f"bodies {names} hang on each other in a loop and not on the ground; "
                                       "join one of them to the ground and close the loop with close_loop")
                break
            for c in ready:
                joint, p = waiting.pop(c)
                order.append((joint, p, c))
                placed.add(c)
        for k, body in enumerate(s.bodies):
            if k not in edges and k not in doubtful:
                self.faults.append(f"body {body.name!r} has no joint; join it to a parent (a body that moves freely: Free)")
        return sorted(order, key=lambda e: self.joints.index(e[0])) if _sorted_is_tree(order, self.joints) else order

    # -- loads, numbers, units

    def _loads(self) -> None:
        joints = {str(j.name): j for j in self.joints}
        for load in self.loads:
            if isinstance(load, (Element, AddedMass)):
                self.faults.extend(load.faults)
                self.doubts += load.doubts if isinstance(load, Element) else []
                if load.body is self.system.ground or load.body == "ground":
                    self.faults.append(f"{load.label} acts on the ground, so that nothing comes of it; pass a body that moves")
            if isinstance(load, JointForce):
                joint = joints.get(load.joint) if isinstance(load.joint, str) else load.joint
                if joint not in self.joints:
                    self.faults.append(f"{load.label} acts on the joint {load.joint!r}, which the system does not have; "
                                       f"joints: {', '.join(joints) or 'none'}{self._nearest(load.joint, joints)}")
                elif joint is not None and len(load.values) != joint.n_speeds:
                    self.faults.append(f"{load.label} has {len(load.values)} values; joint {joint.name!r} has "
                                       f"{joint.n_speeds} degrees of freedom")
                continue
            places = {attribute: self._resolve(getattr(load, attribute), f"{load.label}: {attribute}")
                      for attribute in ("body", "body_a", "body_b", "frame", "reaction")
                      if hasattr(load, attribute) and (attribute.startswith("body") or getattr(load, attribute) is not None)}
            for one, other in (("body", "reaction"), ("body_a", "body_b")):
                if places.get(one) is not None and places.get(one) == places.get(other):
                    self.faults.append(f"{load.label}: {one} and {other} are the same body, so that nothing comes of it; "
                                       "pass two different bodies")
        for output in self.system.outputs:
            if isinstance(output.value, Point):
                self._resolve(output.value.body, f"output {output.name!r}: body")
        for event in self.system.events:
            if isinstance(event.value, Component):
                self._resolve(event.value.point.body, f"event {event.name!r}: body")

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
            self.faults.append(f"{what} is {given!r}; pass a dict such as {{m: 1.5}}")
            return {}
        result = {}
        symbols = {s.name: s for s in allowed}
        for key, value in given.items():
            taken = take_over(key) if isinstance(key, sp.Basic) else key
            name = str(getattr(taken, "name", taken))
            number = self._number(value, f"{what}: the value of {name}")
            if name not in symbols:
                self.faults.append(f"{what} has a number for {name!r}, which is no {kind} of the system; "
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
        units = {}
        for key, unit in dict(self.system.units).items():
            name = str(getattr(key, "name", key))
            if name not in symbols:
                self.faults.append(f"units has one for {name!r}, which is no symbol of the system"
                                   f"{self._nearest(name, symbols)}")
            elif not isinstance(unit, str) or not NAME.fullmatch(unit):
                self.faults.append(f"units: that of {name} is {unit!r}; pass text such as 'N m'")
            else:
                units[symbols[name]] = unit
        return units

    def _number(self, value: Any, what: str) -> float | None:
        """A finite real number."""
        try:
            number = math.nan if isinstance(value, str) else float(value)
        except (TypeError, ValueError):
            number = math.nan
        if not math.isfinite(number):
            self.faults.append(f"{what} is {value!r}; pass a finite number")
            return None
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
    return name if isinstance(name, str) else repr(name)


def _sorted_is_tree(order: list[tuple[Joint, int, int]], joints: list[Joint]) -> bool:
    """Whether the order in which the joints were added already has parents before children."""
    placed = {-1}
    for _, parent, child in sorted(order, key=lambda e: joints.index(e[0])):
        if parent not in placed:
            return False
        placed.add(child)
    return True
