"""Checks a description, collects every fault in it, and returns the frozen model."""

from __future__ import annotations

import keyword
import warnings
from collections import Counter
from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import numpy as np
import sympy as sp

from symdyn.errors import ModelError, ModelWarning
from symdyn.model.bodies import Body, Point
from symdyn.model.faults import Faults
from symdyn.model.joints import Joint, Revolute
from symdyn.model.joints.base import numeric
from symdyn.model.loads import Force, JointForce, SpringDamper, Torque
from symdyn.model.record import Model, joint_speeds
from symdyn.model.symbols import Acceleration, Coordinate, Input, Rate, time

if TYPE_CHECKING:
    from symdyn.model.system import System


def check(system: System) -> Model:
    """The frozen model of a system.

    Raises ModelError that lists every fault; warns (ModelWarning) of inertias that no real body has.
    """
    return _Checker(system).model()


class _Checker:
    def __init__(self, system: System) -> None:
        self.system = system
        self.faults = Faults(system._faults)
        self.known = {"ground": system.ground, **{b.name: b for b in system.bodies}}
        self.index = {id(system.ground): -1, **{id(b): k for k, b in enumerate(system.bodies)}}

    def model(self) -> Model:
        s = self.system
        self._names()
        for body in s.bodies:
            self._inertia(body)
        joints = [*s.joints, *s.loops]
        for joint in joints:
            self.faults.extend(joint.faults)
        order = self._tree()
        self._coordinates()
        self._symbols()
        self._loads()
        if self.faults:
            raise ModelError(list(dict.fromkeys(self.faults)), s.name)
        return Model(
            s.name, s.planar, s.gravity, tuple(s.bodies), tuple(j for j, _, _ in order), tuple(p for _, p, _ in order),
            tuple(c for _, _, c in order), s.ground_motion, tuple(s.loads), tuple(s.outputs), tuple(s.states),
            tuple(s.constraints), tuple(s.loops), self.coordinates, self.speeds, self.parameters, self.inputs,
            self._numbers(s.defaults, "defaults"), self._numbers(s.initial, "initial"), float(s.duration),
            self._units())

    # -- names

    def _names(self) -> None:
        s = self.system
        if not isinstance(s.name, str) or not s.name.isidentifier() or keyword.iskeyword(s.name):
            self.faults.append(f"the system's name is {s.name!r}; pass an identifier such as 'arm', it names files and "
                               "functions")
        for kind, names in (("bodies", ["ground", *[b.name for b in s.bodies]]),
                            ("joints", [j.name for j in [*s.joints, *s.loops]]),
                            ("outputs", [o.name for o in s.outputs]), ("states", [z.symbol.name for z in s.states])):
            for name, count in Counter(names).items():
                if count > 1:
                    self.faults.append(f"{count} {kind} are named {name!r}; give each a name of its own")
        for output in s.outputs:
            if not str(output.name).isidentifier():
                self.faults.append(f"an output is named {output.name!r}; pass an identifier such as 'tip'")

    # -- bodies

    def _inertia(self, body: Body) -> None:
        where = f"body {body.name!r}"
        if body.mass.is_number and body.mass < 0:
            self.faults.append(f"{where} has the mass {body.mass} kg; pass zero or a positive mass")
        I = body.inertia
        difference = I - I.T
        if any(e != 0 and abs(numeric(e)) > 1e-12 * max(abs(numeric(a)) for a in I) for e in difference):
            i, j = next((i, j) for i in range(3) for j in range(3) if difference[i, j] != 0)
            self.faults.append(f"{where}: inertia is not symmetric: I[{i + 1}, {j + 1}] = {I[i, j]}, "
                               f"I[{j + 1}, {i + 1}] = {I[j, i]}; pass a symmetric matrix")
        elif all(e.is_number for e in I) and any(e != 0 for e in I):
            values = np.linalg.eigvalsh(np.array(I.tolist(), dtype=float))
            scale = np.abs(values).max()
            if values[0] < -1e-12 * scale:
                self.faults.append(f"{where}: inertia has the principal moments {_list(values)} kg m^2, one is negative; "
                                   "it must be about the centre of mass")
            elif self.system.planar:
                return
            elif values[0] + values[1] < values[2] * (1 - 1e-9):
                warnings.warn(f"{where}: principal moments {_list(values)} kg m^2 violate the triangle inequality; "
                              "no real body has them", ModelWarning, stacklevel=5)
            elif values[0] <= 1e-12 * scale:
                warnings.warn(f"{where}: inertia is semidefinite, principal moments {_list(values)} kg m^2",
                              ModelWarning, stacklevel=5)

    # -- tree

    def _resolve(self, body: Any, where: str) -> int | None:
        if isinstance(body, Body):
            if id(body) in self.index:
                return self.index[id(body)]
            name = body.name
        else:
            if body in self.known:
                return self.index[id(self.known[body])]
            name = body
        self.faults.append(f"{where} is {name!r}, which is no body of the system; bodies: {', '.join(self.known)}")
        return None

    def _tree(self) -> list[tuple[Joint, int, int]]:
        s = self.system
        edges: dict[int, tuple[Joint, int]] = {}
        for joint in s.joints:
            parent = self._resolve(joint.parent, f"joint {joint.name!r}: parent")
            child = self._resolve(joint.child, f"joint {joint.name!r}: child")
            if parent is None or child is None:
                continue
            if child == -1:
                self.faults.append(f"joint {joint.name!r}: the ground is its child; exchange parent and child")
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
                names = ", ".join(repr(s.bodies[c].name) for c in waiting)
                self.faults.append(f"bodies {names} hang on each other in a loop and not on the ground; "
                                   "join one of them to the ground and close the loop with close_loop")
                break
            for c in ready:
                joint, p = waiting.pop(c)
                order.append((joint, p, c))
                placed.add(c)
        for k, body in enumerate(s.bodies):
            if k not in edges:
                self.faults.append(f"body {body.name!r} has no joint; join it to a parent (a body that moves freely: Free)")
        return sorted(order, key=lambda e: s.joints.index(e[0])) if _sorted_is_tree(order, s.joints) else order

    # -- coordinates and speeds

    def _coordinates(self) -> None:
        s = self.system
        driver: dict[sp.Symbol, Joint] = {}
        coordinates: list[sp.Symbol] = []
        speeds: list[sp.Symbol] = []
        for joint in s.joints:
            independent = [isinstance(q, Coordinate) for q in joint.coordinates]
            if joint.n_speeds != len(joint.coordinates) and not all(independent):
                self.faults.append(f"joint {joint.name!r}: with Euler parameters every coordinate must be a symbol; "
                                   "use Euler angles for a prescribed motion")
            for q in joint.coordinates:
                if not isinstance(q, Coordinate):
                    continue
                if q in driver:
                    self.faults.append(
                        f"joints {driver[q].name!r} and {joint.name!r} both drive the coordinate {q}; give each its own, "
                        f"or write one as an expression (gear: 2*{q}; mimic: sympy.UnevaluatedExpr({q}))")
                    continue
                driver[q] = joint
                coordinates.append(q)
            if joint.n_speeds == len(joint.coordinates):
                speeds += [u for u, free in zip(joint_speeds(joint), independent, strict=True) if free]
            else:
                speeds += joint_speeds(joint)
        for u, count in Counter(speeds).items():
            if count > 1:
                self.faults.append(f"the speed {u} belongs to {count} joints; give each a name of its own")
        self.coordinates, self.speeds = tuple(dict.fromkeys(coordinates)), tuple(dict.fromkeys(speeds))

    # -- symbols and where they are used

    def _uses(self) -> Iterable[tuple[str, Iterable[sp.Expr], bool]]:
        """(where, expressions, whether only parameters may occur), in the order of description."""
        s = self.system
        yield "gravity", s.gravity, True
        for body in s.bodies:
            yield f"body {body.name!r}", [body.mass, *body.com, *body.inertia], True
        for joint in [*s.joints, *s.loops]:
            constants = [*joint.parent_point, *joint.child_point, *joint.parent_rotation, *joint.child_rotation,
                         *getattr(joint, "axis", []), *[e for axis in getattr(joint, "axes", []) for e in axis]]
            yield f"joint {joint.name!r}", constants, True
            yield (f"joint {joint.name!r}: coordinates",
                   [q for q in joint.coordinates if not isinstance(q, Coordinate)], False)
        if s.ground_motion is not None:
            yield "move_ground", s.ground_motion.coordinates, False
        for load in s.loads:
            if isinstance(load, Force):
                yield load.label, load.force, False
                yield f"{load.label}: point", load.point, True
            elif isinstance(load, Torque):
                yield load.label, load.torque, False
            elif isinstance(load, JointForce):
                yield load.label, load.values, False
            elif isinstance(load, SpringDamper):
                yield load.label, [*load.point_a, *load.point_b, load.stiffness, load.damping, load.length], True
        for output in s.outputs:
            if isinstance(output.value, Point):
                yield f"output {output.name!r}: point", output.value.at, True
            else:
                value = output.value
                yield f"output {output.name!r}", value if isinstance(value, tuple) else [value], False
        for state in s.states:
            yield f"rate of state {state.symbol}", [state.rate], False
        for k, constraint in enumerate(s.constraints):
            yield f"constraint {k + 1}", [constraint], False

    def _symbols(self) -> None:
        s = self.system
        moving = {time, *self.coordinates, *[q.dot for q in self.coordinates], *self.speeds,
                  *[z.symbol for z in s.states]}
        parameters: dict[sp.Symbol, None] = dict.fromkeys(s.declared or ())
        inputs: dict[sp.Symbol, None] = {}
        for where, expressions, constant in self._uses():
            for symbol in _symbols_in(expressions):
                if isinstance(symbol, Acceleration):
                    self.faults.append(f"{where} uses the acceleration {symbol}; loads and rates may use coordinates, "
                                       "speeds, states, inputs and t")
                elif symbol.name == "t" and symbol != time:
                    self.faults.append(f"{where} uses a symbol t with assumptions, which is not the time; use symdyn.t")
                elif constant and (symbol in moving or isinstance(symbol, (Coordinate, Rate, Input))):
                    self.faults.append(f"{where} depends on {symbol}, but must be constant; use parameters and numbers")
                elif symbol in moving:
                    continue
                elif isinstance(symbol, (Coordinate, Rate)):
                    found = ", ".join(map(str, self.coordinates)) or "none"
                    self.faults.append(f"{where} uses {symbol}, which no joint and no state drives; coordinates: {found}; "
                                       f"give {symbol} a joint, or use a parameter or input in its place")
                elif isinstance(symbol, Input):
                    inputs[symbol] = None
                elif s.declared is not None and symbol not in s.declared:
                    declared = ", ".join(map(str, s.declared)) or "none"
                    self.faults.append(f"{where} uses the symbol {symbol}, not declared in the model; declared: {declared}; "
                                       f"add {symbol} to the parameters or remove it")
                else:
                    parameters[symbol] = None
        for joint in s.joints:
            for q in joint.coordinates:
                rates = [] if isinstance(q, Coordinate) else [a for a in _symbols_in([q])
                                                              if a in self.speeds or isinstance(a, (Rate, Input))
                                                              or a in [z.symbol for z in s.states]]
                if rates:
                    self.faults.append(f"joint {joint.name!r}: its coordinate {q} uses {', '.join(map(str, rates))}; "
                                       "a dependent coordinate may use coordinates, t and parameters")
        self.parameters, self.inputs = tuple(parameters), tuple(inputs)
        everything = [*self.coordinates, *self.speeds, *[z.symbol for z in s.states], *self.parameters, *self.inputs]
        for name, count in Counter(a.name for a in dict.fromkeys(everything)).items():
            if count > 1:
                self.faults.append(f"{count} different symbols are named {name!r} (by kind or assumptions); "
                                   "make each symbol once, or give them different names")

    # -- loads, numbers, units

    def _loads(self) -> None:
        joints = {j.name: j for j in self.system.joints}
        for load in self.system.loads:
            if isinstance(load, JointForce):
                joint = joints.get(load.joint) if isinstance(load.joint, str) else load.joint
                if joint not in joints.values():
                    self.faults.append(f"{load.label} acts on the joint {load.joint!r}, which the system does not have; "
                                       f"joints: {', '.join(joints)}")
                elif joint is not None and len(load.values) != joint.n_speeds:
                    self.faults.append(f"{load.label} has {len(load.values)} values; joint {joint.name!r} has "
                                       f"{joint.n_speeds} degrees of freedom")
                continue
            for attribute in ("body", "body_a", "body_b", "frame", "reaction"):
                body = getattr(load, attribute, None)
                if body is not None:
                    self._resolve(body, f"{load.label}: {attribute}")
        for output in self.system.outputs:
            if isinstance(output.value, Point):
                self._resolve(output.value.body, f"output {output.name!r}: body")

    def _numbers(self, given: dict[Any, float], what: str) -> dict[sp.Symbol, float]:
        faults, result = [], {}
        for key, value in given.items():
            try:
                result[key] = float(value)
            except (TypeError, ValueError):
                faults.append(f"{what}: the value of {key} is {value!r}; pass a number")
        if faults:
            raise ModelError(faults, self.system.name)
        return result

    def _units(self) -> dict[sp.Symbol, str]:
        units: dict[sp.Symbol, str] = {time: "s"}

        def note(expressions: Iterable[sp.Expr], unit: str) -> None:
            for e in expressions:
                core = -e if e.could_extract_minus_sign() else e
                if isinstance(core, sp.Symbol):
                    units.setdefault(core, unit)

        s = self.system
        for joint in s.joints:
            for q, unit in zip(joint.coordinates, joint.coordinate_units, strict=True):
                if isinstance(q, Coordinate):
                    units[q] = unit
            same = joint.n_speeds == len(joint.coordinates)
            speed_units = [f"{u}/s" for u in joint.coordinate_units] if same else [
                *["m/s"] * (joint.n_speeds - 3), *["rad/s"] * 3]
            for speed, unit in zip(joint_speeds(joint), speed_units, strict=True):
                if speed is not None:
                    units[speed] = unit
        note(s.gravity, "m/s^2")
        for body in s.bodies:
            note([body.mass], "kg")
            note(body.com, "m")
            note(body.inertia, "kg m^2")
        for joint in s.joints:
            note([*joint.parent_point, *joint.child_point], "m")
        for load in s.loads:
            if isinstance(load, Force):
                note(load.force, "N")
                note(load.point, "m")
            elif isinstance(load, Torque):
                note(load.torque, "N m")
            elif isinstance(load, JointForce):
                joint = next((j for j in s.joints if load.joint in (j, j.name)), None)
                note(load.values, "N m" if isinstance(joint, Revolute) else "N")
            elif isinstance(load, SpringDamper):
                note([load.stiffness], "N/m")
                note([load.damping], "N s/m")
                note([load.length, *load.point_a, *load.point_b], "m")
        for output in s.outputs:
            if isinstance(output.value, Point):
                note(output.value.at, "m")
        return {**units, **s.units}


def _symbols_in(expressions: Iterable[sp.Expr]) -> list[sp.Symbol]:
    """Free symbols in order of the expressions, by name within one expression."""
    found: dict[sp.Symbol, None] = {}
    for e in expressions:
        for symbol in sorted(e.free_symbols, key=lambda a: a.name):
            found[symbol] = None
    return list(found)


def _sorted_is_tree(order: list[tuple[Joint, int, int]], joints: list[Joint]) -> bool:
    """Whether the order in which the joints were added already has parents before children."""
    placed = {-1}
    for _, parent, child in sorted(order, key=lambda e: joints.index(e[0])):
        if parent not in placed:
            return False
        placed.add(child)
    return True


def _list(values: np.ndarray) -> str:
    return "[" + ", ".join(f"{v:.4g}" for v in values) + "]"
