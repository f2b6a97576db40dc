"""Every public call with arguments that are right, of which one is replaced by a hostile value.

A call has slots: arguments by name, each with its kind, which says what may not pass in its place without an error:

    number, numbers   real and finite; text is none, nor are complex and masked numbers
    loose             real numbers that may be infinite or not numbers at all, such as states of a batch
    expression        a number or a SymPy expression
    name              text that can be printed
    flag              True or False
    choice            one of some words
    free              anything that does not end in an error of its own
"""

from __future__ import annotations

import contextlib
import io
import tempfile
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import sympy as sp

import symdyn as sd

NOT_NUMBERS = frozenset({"text", "complex", "masked", "beyond", "not finite", "object", "nul", "mapping", "function"})
FORBIDDEN: dict[str, frozenset[str]] = {
    "number": NOT_NUMBERS | {"array", "symbol"}, "numbers": NOT_NUMBERS | {"symbol"}, "loose": NOT_NUMBERS - {"not finite"},
    "expression": NOT_NUMBERS,
    "name": frozenset({"nul", "complex", "masked", "beyond", "not finite", "object", "array", "mapping", "number", "whole",
                       "function"}),
    "flag": frozenset({"text", "array", "object", "complex", "masked", "beyond", "not finite", "mapping", "number", "function"}),
    "choice": frozenset({"text", "array", "object", "complex", "masked", "beyond", "not finite", "mapping", "number", "whole",
                         "function"}),
    "whole": NOT_NUMBERS | {"array", "symbol", "number"},
    "free": frozenset(),
}


class There:
    """Stands for what the system that is being built has: its body, its joint."""


THERE = There()
IN_C = "static int f(const double *in, double *out) { out[0] = in[0]; return 0; }"


@dataclass(frozen=True)
class Call:
    """One public call: run(arguments) with arguments that are right, and the kind of each slot."""

    name: str
    run: Callable[[dict[str, Any]], Any]
    kinds: Mapping[str, str]
    right: Callable[[], dict[str, Any]]
    passes: Mapping[str, frozenset[str]] = field(default_factory=dict)

    def forbidden(self, slot: str) -> frozenset[str]:
        """Tags of values that must not pass in a slot."""
        return FORBIDDEN[self.kinds[slot]] - self.passes.get(slot, frozenset())


def _call(name: str, function: Callable[..., Any], kinds: Mapping[str, str], right: Callable[[], dict[str, Any]],
          **passes: frozenset[str]) -> Call:
    return Call(name, lambda given: function(**given), kinds, right, passes)


# -- what calls are made on


@cache
def _module(name: str, backend: str = "numpy") -> Any:
    return sd.systems.get(name).compile(backend)


@cache
def _solution(name: str) -> Any:
    return _module(name).simulate(t=np.linspace(0, 0.1, 5))


@cache
def _equations(name: str) -> Any:
    system = sd.systems.get(name)
    return system.augmented() if system.loops or system.constraints else system.embedding()


@cache
def _disc() -> Any:
    """A disc that tilts about x and y on torsion springs and spins about its own axis."""
    a, b, phi = sd.coordinates("a b phi")
    system = sd.System("disc")
    first, second = system.add_body("first"), system.add_body("second")
    wheel = system.add_body("wheel", mass=1, inertia=[0.5, 0.5, 0.8])
    for joint, q in ((sd.Revolute("about_x", system.ground, first, a, axis=[1, 0, 0]), a),
                     (sd.Revolute("about_y", first, second, b, axis=[0, 1, 0]), b)):
        system.add_joint_force(system.add_joint(joint), -50 * q)
    system.add_joint(sd.Revolute("spin", second, wheel, phi))
    return system.compile("numpy")


def _built(**given: Any) -> Any:
    """A pendulum with everything that a System takes; checked, and compiled as far as its text."""
    from symdyn.pipeline import emit

    q, z = sd.coordinates("q z")
    system = sd.System(given.pop("name", "s"), gravity=given.pop("gravity", [0, -9.81, 0]), planar=given.pop("planar", None),
                       parameters=given.pop("parameters", None))
    body = system.add_body(given.pop("body_name", "bob"), given.pop("mass", 1.0), given.pop("inertia", [0.1, 0.1, 0.1]),
                           given.pop("com", [0.5, 0, 0]))
    kind = given.pop("joint_class", sd.Revolute)
    joint = {"coordinate": q} if kind in (sd.Revolute, sd.Prismatic, sd.Helical) else {}
    system.add_joint(kind(given.pop("joint_name", "pin"), system.ground, body,
                          **{**joint, **{k.removeprefix("joint_"): given.pop(k) for k in list(given) if k.startswith("joint_")}}))
    for method in ("add_force", "add_torque", "add_spring_damper", "add_output", "add_state", "add_constraint", "add_event",
                   "draw",
                   "add_joint_force", "add_load", "close_loop", "move_ground", "add_coordinate"):
        if method in given:
            asked = dict(given.pop(method))
            if callable(asked.get("load")):
                asked["load"] = asked["load"](body)
            there = {"body": body, "body_a": body, "body_b": system.ground, "symbol": z, "joint": "pin"}
            asked |= {slot: there[slot] for slot, value in asked.items() if value is THERE}
            if method == "draw":
                shapes = asked.pop("shapes")
                system.draw(asked.pop("body"), *(shapes if isinstance(shapes, tuple) else [shapes]), **asked)
                continue
            getattr(system, method)(**asked)
    for table in ("defaults", "initial", "units"):
        if table in given:
            setattr(system, table, given.pop(table))
    if "duration" in given:
        system.duration = given.pop("duration")
    equations = system.augmented() if system.constraints or system.loops else system.embedding()
    emit(equations, "numpy", ("rhs",), standalone=False)
    return equations.compile("numpy").rhs(0.0, np.full(len(equations.symbols.coordinates) + len(equations.symbols.speeds)
                                                       + len(equations.symbols.states), 0.1))


def _method(method: str, kinds: Mapping[str, str], right: Mapping[str, Any], **passes: frozenset[str]) -> Call:
    """A method of System: its arguments alone are hostile."""
    return Call(f"System.{method}", lambda given: _built(**{method: given}), kinds, lambda: dict(right), passes)


EXPRESSION, NUMBER, NUMBERS, NAME, FLAG, CHOICE, FREE, WHOLE, LOOSE = (
    "expression", "number", "numbers", "name", "flag", "choice", "free", "whole", "loose")
NONE: frozenset[str] = frozenset()


def _systems() -> list[Call]:
    symbolic = frozenset({"symbol"})
    calls = [
        _call("System", _built, {"name": NAME, "gravity": EXPRESSION, "planar": FLAG, "parameters": FREE, "body_name": NAME,
                                 "mass": EXPRESSION, "inertia": EXPRESSION, "com": EXPRESSION, "defaults": FREE, "initial": FREE,
                                 "duration": NUMBER, "units": FREE},
              lambda: {"name": "s", "gravity": [0, -9.81, 0], "planar": False, "parameters": None, "body_name": "bob",
                       "mass": 1.0,
                       "inertia": [0.1, 0.1, 0.1], "com": [0.5, 0,
                                                           0], "defaults": {}, "initial": {}, "duration": 1.0, "units": {}},
              duration=symbolic),
        _method("add_force", {"body": FREE, "force": EXPRESSION, "point": EXPRESSION, "frame": FREE, "reaction": FREE,
                              "name": NAME},
                {"body": THERE, "force": [1, 0, 0], "point": [0.5, 0, 0], "frame": None, "reaction": None, "name": "pull"}),
        _method("add_torque", {"body": FREE, "torque": EXPRESSION, "frame": FREE, "reaction": FREE, "name": NAME},
                {"body": THERE, "torque": [0, 0, 1], "frame": None, "reaction": None, "name": "twist"}),
        _method("add_joint_force", {"joint": FREE, "value": EXPRESSION, "name": NAME}, {"joint": THERE, "value": 1.0,
                                                                                        "name": "drive"}),
        _method("add_spring_damper", {"body_a": FREE, "body_b": FREE, "point_a": EXPRESSION, "point_b": EXPRESSION,
                                      "stiffness": EXPRESSION, "damping": EXPRESSION, "length": EXPRESSION, "name": NAME},
                {"body_a": THERE, "body_b": THERE, "point_a": [1, 0, 0], "point_b": [0, 1, 0], "stiffness": 1.0, "damping": 0.1,
                 "length": 0.5, "name": "spring"}),
        _method("add_output", {"name": NAME, "value": EXPRESSION}, {"name": "tip", "value": 1.0}),
        _method("add_state", {"symbol": FREE, "rate": EXPRESSION}, {"symbol": THERE, "rate": 1.0}),
        _method("add_constraint", {"expression": FREE, "name": NAME}, {"expression": sd.coordinates("q") - 0.1,
                                                                       "name": "closed"}),
        _method("add_event", {"name": NAME, "value": EXPRESSION, "direction": FREE, "stop": FLAG, "reset": FREE},
                {"name": "low", "value": sd.coordinates("q"), "direction": 0, "stop": False, "reset": None}),
        _method("move_ground", {"position": EXPRESSION, "angles": EXPRESSION, "sequence": CHOICE},
                {"position": [0, 0, 0], "angles": [0, 0, 0], "sequence": "ZYX"}),
        _method("draw", {"body": FREE, "shapes": FREE, "color": FREE},
                {"body": THERE, "shapes": (sd.shapes.Box([1, 1, 1]),), "color": None}),
        _method("close_loop", {"joint": FREE}, {"joint": sd.Rod("rod", "bob", "ground", 2, [1, 0, 0], [0, 2, 0])}),
    ]
    placed = {"joint_name": NAME, "joint_parent_point": EXPRESSION, "joint_child_point": EXPRESSION,
              "joint_parent_rotation": EXPRESSION, "joint_child_rotation": EXPRESSION}
    at: dict[str, Any] = {"joint_name": "pin", "joint_parent_point": [0, 0, 0], "joint_child_point": [0, 0, 0],
                          "joint_parent_rotation": np.eye(3), "joint_child_rotation": np.eye(3)}
    own: dict[Any, tuple[dict[str, str], dict[str, Any]]] = {
        sd.Revolute: ({"joint_axis": EXPRESSION, "joint_coordinate": FREE, "joint_speed": FREE},
                      {"joint_axis": [0, 0, 1], "joint_coordinate": sd.coordinates("q"), "joint_speed": None}),
        sd.Prismatic: ({"joint_axis": EXPRESSION}, {"joint_axis": [0, 0, 1]}),
        sd.Helical: ({"joint_axis": EXPRESSION, "joint_pitch": EXPRESSION}, {"joint_axis": [0, 0, 1], "joint_pitch": 0.1}),
        sd.Cylindrical: ({"joint_axis": EXPRESSION, "joint_coordinates": FREE}, {"joint_axis": [0, 0, 1],
                                                                                 "joint_coordinates": None}),
        sd.Universal: ({"joint_axes": EXPRESSION}, {"joint_axes": ((1, 0, 0), (0, 1, 0))}),
        sd.Spherical: ({"joint_orientation": FREE, "joint_speeds": FREE}, {"joint_orientation": None, "joint_speeds": None}),
        sd.Free: ({"joint_velocity": CHOICE, "joint_coordinates": FREE}, {"joint_velocity": "parent", "joint_coordinates": None}),
    }
    for kind, (kinds, right) in own.items():
        def run(given: dict[str, Any], kind: Any = kind) -> Any:
            return _built(joint_class=kind, **given)

        calls.append(Call(kind.__name__, run, {**placed, **kinds}, lambda right=right: {**at, **right}))  # type: ignore[misc]
    loads: dict[str, tuple[Any, dict[str, Any]]] = {
        "LinearStiffness": (sd.LinearStiffness, {"K": np.eye(6), "force": [0] * 6, "point": [0, 0, 0], "reference": [0] * 6}),
        "LinearDamping": (sd.LinearDamping, {"B": np.eye(6), "point": [0, 0, 0]}),
        "AddedMass": (sd.AddedMass, {"A": np.eye(6), "point": [0, 0, 0]}),
        "MooringLine": (sd.MooringLine, {"fairlead": [0, 0, 0], "anchor": [8, 0, -4], "length": 10.0, "weight": 1.0,
                                         "stiffness": 1e5, "friction": 0}),
        "WaveExcitation": (sd.WaveExcitation, {"amplitude": [1] * 6, "phase": [0] * 6, "frequency": 1.0}),
        "Drag": (sd.Drag, {"area": 1.0, "coefficient": 1.0, "density": 1.0, "wind": [1, 0, 0]}),
        "Buoyancy": (sd.Buoyancy, {"boxes": [sd.Box([1, 1, 1])], "density": 1000.0, "gravity": 9.81}),
    }
    for name, (kind, right) in loads.items():
        def load(given: dict[str, Any], kind: Any = kind) -> Any:
            return _built(add_load={"load": lambda body: kind(body, **given)})

        calls.append(Call(name, load, dict.fromkeys(right, EXPRESSION) | ({"boxes": FREE} if name == "Buoyancy" else {}),
                          lambda right=right: dict(right)))  # type: ignore[misc]
    q = sd.coordinates("q")
    calls += [
        _call("sd.embedding", lambda **given: sd.embedding(**given).compile("numpy").rhs(0.0, [0.1, 0.2]),
              {"coordinates": FREE, "position": EXPRESSION, "mass": EXPRESSION, "force": EXPRESSION, "name": NAME,
               "defaults": FREE},
              lambda: {"coordinates": [q], "position": [sp.cos(q), sp.sin(q)], "mass": [1.0, 1.0], "force": [0, -9.81],
                       "name": "s",
                       "defaults": {}}),
        _call("sd.augmented", lambda **given: sd.augmented(**given).compile("numpy").metadata,
              {"coordinates": FREE, "mass": EXPRESSION, "force": EXPRESSION, "constraints": FREE, "name": NAME, "defaults": FREE,
               "initial": FREE, "names": FREE},
              lambda: {"coordinates": list(sd.coordinates("x y")), "mass": [1.0, 1.0], "force": [0, -9.81],
                       "constraints": [sd.coordinates("x")**2 + sd.coordinates("y")**2 - 1], "name": "s", "defaults": {},
                       "initial": {}, "names": None}),
        _call("symbols", lambda **given: [sd.coordinates(given["names"]), sd.parameters(given["names"])], {"names": NAME},
              lambda: {"names": "a b"}),
        _call("Beam", sd.Beam, {"stations": NUMBERS, "mass_per_length": NUMBERS, "stiffness": NUMBERS, "shapes": FREE,
                                "length": NUMBER, "axis": CHOICE, "twist": NUMBERS, "damping_ratio": NUMBERS,
                                "integration": CHOICE, "draw": WHOLE},
              lambda: {"stations": [0.0, 0.5, 1.0], "mass_per_length": 1.0, "stiffness": 10.0, "shapes": 2, "length": 2.0,
                       "axis": "z",
                       "twist": None, "damping_ratio": 0.0, "integration": "exact", "draw": 5},
              stiffness=NONE),
        _call("Shape", lambda **given: sd.Beam([0.0, 1.0], 1.0, 1.0, [sd.Shape(**given)]),
              {"direction": CHOICE, "coefficients": NUMBERS, "powers": NUMBERS},
              lambda: {"direction": "x", "coefficients": [1.0, 0.5], "powers": [2, 3]}),
        _call("EulerAngles", lambda **given: _built(joint_class=sd.Spherical, joint_orientation=sd.EulerAngles(**given)),
              {"sequence": CHOICE}, lambda: {"sequence": "ZYX"}),
        _call("External", lambda **given: sd.External(**given), {"name": NAME, "arguments": FREE, "results": WHOLE, "c": FREE,
                                                                  "python": FREE, "python_source": FREE, "operations": WHOLE},
              lambda: {"name": "f", "arguments": ["x"], "results": 1, "c": IN_C, "python": None, "python_source": "",
                       "operations": 1}),
    ]
    return calls


def _derived() -> list[Call]:
    def on(method: str, name: str = "cart_pole") -> Callable[..., Any]:
        return lambda **given: getattr(_equations(name), method)(**given)

    return [
        _call("Equations.quantity", on("quantity"), {"name": CHOICE}, lambda: {"name": "M_tilde"}),
        _call("Equations.explicit", on("explicit"), {"name": CHOICE, "simplify": FLAG}, lambda: {"name": "M_tilde",
                                                                                                 "simplify": False}),
        _call("Equations.latex", on("latex"), {"name": CHOICE, "shorthand": FLAG, "intermediates": FLAG, "width": WHOLE},
              lambda: {"name": "M_tilde", "shorthand": False, "intermediates": False, "width": 80}),
        _call("Equations.lambdify", on("lambdify"), {"name": CHOICE}, lambda: {"name": "M_tilde"}),
        _call("Equations.verify", on("verify", "pendulum"), {"states": WHOLE, "digits": WHOLE, "params": FREE},
              lambda: {"states": 1, "digits": 20, "params": None}),
        _call("Equations.explain", lambda **given: _equations("cart_pole").explain(given["quantity"], given["index"],
                                                                                   simplify=given["simplify"]),
              {"quantity": CHOICE, "index": WHOLE, "simplify": FLAG}, lambda: {"quantity": "k_tilde", "index": 0,
                                                                               "simplify": False}),
        _call("Equations.without_multipliers", on("without_multipliers", "four_bar"), {"dependent": FREE},
              lambda: {"dependent": ["q2", "q3"]}),
        _call("Equations.compile", on("compile"), {"backend": CHOICE, "specialize": FREE, "templates": FREE},
              lambda: {"backend": "numpy", "specialize": None, "templates": None}),
        _call("System.embedding", lambda **given: sd.systems.pendulum().embedding(**given), {"frames": CHOICE},
              lambda: {"frames": "body"}),
        _call("System.recursive", lambda **given: sd.systems.pendulum().recursive(**given), {"frames": CHOICE},
              lambda: {"frames": "body"}),
        _call("System.augmented", lambda **given: sd.systems.pendulum().augmented(**given),
              {"coordinates": CHOICE, "orientation": FREE, "frames": CHOICE},
              lambda: {"coordinates": "relative", "orientation": None, "frames": "parallel"}),
        _call("System.compile", lambda **given: sd.systems.pendulum().compile(**given), {"backend": CHOICE, "tune": FLAG},
              lambda: {"backend": "numpy", "tune": False}),
        _call("System.diagnose", lambda **given: sd.systems.four_bar().diagnose(**given),
              {"q": NUMBERS, "params": NUMBERS, "t": NUMBER, "coordinates": CHOICE, "reach": NUMBER},
              lambda: {"q": None, "params": None, "t": 0.0, "coordinates": "relative", "reach": 0.1}),
        _call("System.show", lambda **given: sd.systems.pendulum().show(**given), {"path": FREE, "params": NUMBERS, "q": NUMBERS},
              lambda: {"path": None, "params": None, "q": None}),
        _call("pipeline.emit", lambda **given: _emit(**given), {"backend": CHOICE, "functions": FREE, "specialize": FREE,
                                                               "method": CHOICE, "templates": FREE},
              lambda: {"backend": "c", "functions": ["rhs"], "specialize": None, "method": "dop853", "templates": None}),
        _call("systems.get", lambda **given: sd.systems.get(**given), {"name": CHOICE}, lambda: {"name": "pendulum"}),
        _call("n_link_pendulum", lambda **given: sd.systems.n_link_pendulum(**given), {"n": WHOLE}, lambda: {"n": 2}),
    ]


def _emit(**given: Any) -> Any:
    from symdyn.pipeline import emit

    return emit(_equations("pendulum"), **given)


def _modules() -> list[Call]:
    x = [0.1, 0.2, 0.0, 0.1]
    # A state may hold what is not finite where the result does not depend on it: the result is looked at then.
    infinite = frozenset({"not finite"})

    def on(method: str, name: str = "cart_pole", backend: str = "numpy") -> Callable[..., Any]:
        return lambda **given: getattr(_module(name, backend), method)(**given)

    calls: list[Call] = []
    for backend in _backends():
        def made(method: str, name: str = "cart_pole", backend: str = backend) -> Callable[..., Any]:
            return on(method, name, backend)

        calls += [
            _call(f"Module.rhs ({backend})", made("rhs"), {"t": NUMBERS, "x": NUMBERS, "params": NUMBERS, "inputs": NUMBERS},
                  lambda: {"t": 0.0, "x": np.array(x), "params": None, "inputs": np.array([1.0])}),
            _call(f"Module.bind.rhs ({backend})",
                  lambda t, x, params, inputs, backend=backend: _module("cart_pole", backend).bind(params).rhs(t, x, inputs),
                  {"t": NUMBER, "x": NUMBERS, "params": NUMBERS, "inputs": NUMBERS},
                  lambda: {"t": 0.0, "x": np.array(x), "params": None, "inputs": [1.0]}),
            _call(f"Module.bind.jacobian_x ({backend})",
                  lambda t, x, params, inputs, backend=backend: _module("cart_pole", backend).bind(params).jacobian_x(t, x,
                                                                                                                      inputs),
                  {"t": NUMBER, "x": NUMBERS, "params": NUMBERS, "inputs": NUMBERS},
                  lambda: {"t": 0.0, "x": x, "params": None, "inputs": [1.0]}),
            _call(f"Module.rhs_batch ({backend})", made("rhs_batch"),
                  {"t": LOOSE, "x": LOOSE, "params": LOOSE, "inputs": LOOSE, "out": FREE},
                  lambda: {"t": 0.0, "x": np.array([x, x]), "params": None, "inputs": [[1.0], [2.0]], "out": None}),
            _call(f"Module.evaluate ({backend})", made("evaluate"),
                  {"name": CHOICE, "t": NUMBERS, "x": NUMBERS, "params": NUMBERS, "inputs": NUMBERS, "ud": NUMBERS},
                  lambda: {"name": "inverse_dynamics", "t": 0.0, "x": x, "params": None, "inputs": (), "ud": [0.0, 0.0]}),
            _call(f"Module.simulate ({backend})", made("simulate"),
                  {"t": NUMBERS, "q": NUMBERS, "u": NUMBERS, "params": NUMBERS, "z": NUMBERS, "inputs": NUMBERS, "rtol": NUMBER,
                   "atol": NUMBERS, "method": CHOICE, "steps": FLAG, "max_step": NUMBER, "first_step": NUMBER, "max_steps": WHOLE,
                   "progress": FLAG, "work": FLAG, "stabilization": CHOICE, "events": FREE},
                  lambda: {"t": (0.0, 0.05), "q": x[:2], "u": x[2:], "params": None, "z": None, "inputs": {"F": 1.0},
                           "rtol": 1e-6,
                           "atol": 1e-6, "method": None, "steps": False, "max_step": 0.0, "first_step": 0.0, "max_steps": 1000,
                           "progress": False, "work": False, "stabilization": None, "events": True},
                  max_step=infinite, first_step=infinite, inputs=frozenset({"function"})),
            _call(f"Module.simulate_batch ({backend})", made("simulate_batch"),
                  {"q": LOOSE, "u": LOOSE, "params": LOOSE, "z": LOOSE, "t": NUMBERS, "inputs": LOOSE, "rtol": NUMBER,
                   "atol": NUMBERS, "max_step": NUMBER, "first_step": NUMBER, "method": CHOICE, "max_steps": WHOLE},
                  lambda: {"q": [x[:2], x[:2]], "u": x[2:], "params": None, "z": None, "t": (0.0, 0.05), "inputs": [[1.0], [2.0]],
                           "rtol": 1e-6, "atol": 1e-6, "max_step": 0.0, "first_step": 0.0, "method": None, "max_steps": None},
                  max_step=infinite, first_step=infinite, inputs=frozenset({"function"})),
        ]
    qu = {"q": NUMBERS, "u": NUMBERS, "params": NUMBERS, "t": NUMBERS}
    state: dict[str, Any] = {"q": x[:2], "u": x[2:], "params": None, "t": 0.0}
    at = ("q", "params", "t")
    for method, names in (("mass_matrix", at), ("k_tilde", tuple(qu)), ("F_tilde", tuple(qu)), ("J", at), ("energy", tuple(qu))):
        calls.append(_call(f"Module.{method}", on(method), {k: qu[k] for k in names},
                           lambda names=names: {k: state[k] for k in names}))  # type: ignore[misc]
    calls += [
        _call("Module.inverse_dynamics", on("inverse_dynamics"), {**qu, "ud": NUMBERS, "inputs": NUMBERS},
              lambda: {**state, "ud": [0.0, 0.0], "inputs": [1.0]}),
        _call("Module.jacobian", on("jacobian"), {"t": NUMBERS, "x": NUMBERS, "params": NUMBERS, "inputs": NUMBERS, "wrt": FREE},
              lambda: {"t": 0.0, "x": x, "params": None, "inputs": [1.0], "wrt": ("x",)}),
        _call("Module.outputs", on("outputs", "two_link_arm"), {"t": NUMBERS, "x": NUMBERS, "params": NUMBERS, "inputs": FREE},
              lambda: {"t": 0.0, "x": x, "params": None, "inputs": ()}),
        _call("Module.function", lambda name: _module("cart_pole").function(name), {"name": CHOICE}, lambda: {"name": "energy"}),
        _call("Module.parameters", on("parameters"), {"params": NUMBERS}, lambda: {"params": {}}),
        _call("Module.consistent", on("consistent", "four_bar"),
              {"q": NUMBERS, "u": NUMBERS, "params": NUMBERS, "t": NUMBER, "keep": FREE},
              lambda: {"q": None, "u": None, "params": None, "t": 0.0, "keep": ()}),
        _call("Module.rank", on("rank", "four_bar"), {"q": NUMBERS, "params": NUMBERS, "t": NUMBERS},
              lambda: {"q": [0.5, 0.4, -0.2], "params": None, "t": 0.0}),
        _call("Module.unique", on("unique", "four_bar"), {"q": NUMBERS, "params": NUMBERS, "t": NUMBERS},
              lambda: {"q": [0.5, 0.4, -0.2], "params": None, "t": 0.0}),
        _call("Module.simulate (constraints)", on("simulate", "four_bar"),
              {"t": NUMBERS, "params": NUMBERS, "method": CHOICE, "stabilization": CHOICE, "q": NUMBERS, "rtol": NUMBER},
              lambda: {"t": (0.0, 0.01), "params": None, "method": None, "stabilization": None, "q": None, "rtol": 1e-6}),
        _call("Module.simulate (function of inputs)",
              lambda value: _module("cart_pole").simulate((0.0, 0.05), max_steps=1000, inputs={"F": lambda t, x: value}),
              {"value": NUMBERS},
              lambda: {"value": 1.0}),
        _call("Module.simulate (table of inputs)",
              lambda times, values: _module("cart_pole").simulate((0.0, 0.05), max_steps=1000,
                                                                  inputs={"F": (times, values)}),
              {"times": NUMBERS, "values": NUMBERS}, lambda: {"times": [0.0, 1.0], "values": [1.0, 2.0]}),
        _call("Module.equilibrium", on("equilibrium", "double_pendulum"),
              {"free": FREE, "fixed": NUMBERS, "start": NUMBERS, "params": NUMBERS, "t": NUMBER, "inputs": NUMBERS,
               "unknown_params": FREE, "max_iterations": WHOLE},
              lambda: {"free": None, "fixed": None, "start": [-1.5, 0.1], "params": None, "t": 0.0, "inputs": None,
                       "unknown_params": None, "max_iterations": 50}),
        _call("Module.equilibria", on("equilibria", "pendulum"),
              {"starts": WHOLE, "ranges": NUMBERS, "seed": WHOLE, "params": NUMBERS, "start": NUMBERS},
              lambda: {"starts": 3, "ranges": None, "seed": 0, "params": None, "start": None}, starts=frozenset({"array"})),
        _call("Module.linearize", on("linearize"),
              {"at": NUMBERS, "params": NUMBERS, "t": NUMBER, "inputs": NUMBERS, "free": FREE, "fixed": NUMBERS,
               "coordinates": FREE,
               "hold": FREE},
              lambda: {"at": x, "params": None, "t": 0.0, "inputs": None, "free": None, "fixed": None, "coordinates": None,
                       "hold": None}),
        _call("Module.stability", on("stability"),
              {"at": NUMBERS, "params": NUMBERS, "t": NUMBER, "inputs": NUMBERS, "fixed": NUMBERS, "hold": FREE, "period": NUMBER,
               "start": NUMBERS},
              lambda: {"at": [0.0, np.pi, 0.0, 0.0], "params": None, "t": 0.0, "inputs": None, "fixed": None, "hold": None,
                       "period": None, "start": None}),
        _call("Module.campbell", lambda **given: _disc().campbell(**given), {"speed": FREE, "values": NUMBERS},
              lambda: {"speed": "phi_dot", "values": [1.0, 2.0]}),
        _call("Module.write", on("write", "pendulum"), {"folder": FREE}, lambda: {"folder": tempfile.mkdtemp()}),
    ]
    return calls


@cache
def _backends() -> tuple[str, ...]:
    from symdyn.runtime.building.compiler import find_compiler

    return ("numpy", "c") if find_compiler() is not None else ("numpy",)


def _solutions() -> list[Call]:
    def on(method: str, name: str = "double_pendulum") -> Callable[..., Any]:
        return lambda **given: getattr(_solution(name), method)(**given)

    return [
        _call("Solution[]", lambda name: _solution("double_pendulum")[name], {"name": CHOICE}, lambda: {"name": "q1"}),
        _call("Solution.reaction", on("reaction"), {"joint": FREE, "frame": CHOICE}, lambda: {"joint": "hinge1",
                                                                                              "frame": "ground"}),
        _call("Solution.save", on("save"), {"path": FREE}, lambda: {"path": str(Path(tempfile.mkdtemp()) / "run.npz")}),
        _call("Solution.report", on("report"), {"path": FREE}, lambda: {"path": str(Path(tempfile.mkdtemp()) / "run.html")}),
        _call("Solution.view", on("view"), {"path": FREE, "compare": FREE, "forces": FLAG},
              lambda: {"path": None, "compare": None, "forces": False}),
        _call("Solution.plot", on("plot"), {"path": FREE, "view": NUMBERS}, lambda: {"path": None, "view": None}),
        _call("Solution.picture", on("picture"), {"t": NUMBERS, "path": FREE, "view": NUMBERS, "forces": FLAG},
              lambda: {"t": 0.05, "path": None, "view": None, "forces": False}, t=frozenset({"text", "nul"})),
        _call("Solution.animate", on("animate"), {"path": FREE, "fps": WHOLE, "speed": NUMBER, "view": NUMBERS, "forces": FLAG},
              lambda: {"path": None, "fps": 25, "speed": 1.0, "view": None, "forces": False}, fps=frozenset({"number"})),
    ]


def _ensembles() -> list[Call]:
    def many(**given: Any) -> Any:
        return sd.ensemble(_module("pendulum"), **given)

    return [
        _call("Samples", lambda values, **given: sd.Samples({"q1": values}, **given).block(0, 2),
              {"values": LOOSE, "sampling": CHOICE, "count": WHOLE, "seed": WHOLE},
              lambda: {"values": {"from": 0.0, "to": 1.0}, "sampling": "random", "count": 3,
                       "seed": 0}, values=frozenset({"mapping"})),
        _call("Samples (spaced)", lambda **given: sd.Samples({"q1": {"from": given["low"], "to": given["high"],
                                                                     "count": given["count"]}}).block(0, 2),
              {"low": NUMBER, "high": NUMBER, "count": NUMBER}, lambda: {"low": 0.0, "high": 1.0, "count": 3}),
        _call("ensemble", many,
              {"samples": FREE, "t": NUMBERS, "outcomes": FREE, "q": NUMBERS, "u": NUMBERS, "params": NUMBERS, "inputs": FREE,
               "executor": FREE, "chunk": WHOLE, "path": FREE, "resume": FLAG, "progress": FLAG, "consistent": FLAG,
               "outstanding": WHOLE, "rtol": NUMBER, "method": CHOICE},
              lambda: {"samples": {"q1": [0.1, 0.2]}, "t": (0.0, 0.05), "outcomes": ["end q1"], "q": None, "u": None,
                       "params": None,
                       "inputs": None, "executor": None, "chunk": None, "path": None, "resume": False, "progress": False,
                       "consistent": False, "outstanding": None, "rtol": 1e-6, "method": None}),
    ]


def _files() -> list[Call]:
    return [
        Call("sweep file", lambda given: _sweep(given["text"]), {"text": FREE}, lambda: {"text": SWEEP}),
        Call("URDF", lambda given: _urdf(given["text"]), {"text": FREE}, lambda: {"text": URDF}),
        Call("read_urdf", lambda given: sd.read_urdf(**given),
             {"path": FREE, "symbolic": FREE, "root": CHOICE, "name": FREE, "fixed": FREE, "damping": FLAG},
             lambda: {"path": _urdf_file(), "symbolic": (), "root": "fixed", "name": None, "fixed": (), "damping": False}),
        Call("command line", lambda given: _command(given["words"]), {"words": FREE}, lambda: {"words": ["list"]}),
    ]


SWEEP = """system = "pendulum"
options = {}
t = [0, 0.05]
rtol = 1e-6
sampling = "random"
count = 2
seed = 1
method = "DOP853"
chunk = 1
formulation = "auto"
outcomes = ["end q1"]
[parameters]
m1 = 1.5
[initial]
q1 = {from = 0.1, to = 0.2}
"""
URDF = """<robot name="r">
<link name="a"><inertial><origin xyz="0 0 0.1" rpy="0 0 0"/><mass value="1"/>
<inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
<link name="b"><inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
<link name="c"><inertial><mass value="1"/><inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
<joint name="j" type="revolute"><parent link="a"/><child link="b"/><origin xyz="0 0 1" rpy="0 0 0"/><axis xyz="0 0 1"/>
<dynamics damping="0.1"/></joint>
<joint name="k" type="prismatic"><parent link="b"/><child link="c"/><mimic joint="j" multiplier="2" offset="0.1"/></joint>
</robot>
"""
# Replacements of a word or number of a file.
FILE_WORDS = ("nan", "inf", "-inf", "1e400", "9" * 400, "-1", "0", "1e308", "1e100", "1e-320", "\"\"", "\"a\\u0000b\"",
              "\"../../x\"",
              "\"" + "q" * 300 + "\"", "[]", "{}", "[1, \"a\"]", "[[1], [2]]", "true", "2020-01-01",
              "\"__import__('os').abort()\"",
              "\"evil.py\"", "1000000000000", "\x00", "\ud800", "&#0;", "${x}", "1 2 3 4", "", "0x10", "1_000", "\"1\n2\"")
COMMANDS = (
    ["derive", "pendulum", "--quantity", "M_tilde"], ["generate", "pendulum", "--backend", "numpy", "--output", "{folder}"],
    ["simulate", "pendulum", "--t", "0.05", "--rtol", "1e-6", "--set", "m1=1.0", "--q", "q1=0.1", "--backend", "numpy",
     "--no-picture", "--output", "{folder}"],
    ["simulate", "four_bar", "--t", "0.01", "--stabilization", "baumgarte=10", "--backend", "numpy", "--no-picture", "--output",
     "{folder}"],
    ["report", "pendulum", "--no-verify"], ["diagnose", "four_bar", "--q", "phi2=0.1", "--reach", "0.1"],
    ["simulate", "n_link_pendulum", "--option", "n=2", "--t", "0.01", "--backend", "numpy", "--no-picture", "--output",
     "{folder}"],
    ["sweep", "{sweep}", "--jobs", "1", "--backend", "numpy", "--no-picture", "--output", "{folder}"], ["list"],
    ["compare", "pendulum-augmented"],
)
COMMAND_WORDS = ("nan", "inf", "-1", "0", "1e400", "9" * 400, "", " ", "=", "m1=", "=1", "m1=nan", "m1=1e400", "q1=inf", "q1=1=2",
                 "a\0b", "--", "-", "q" * 5000, "../../x", "/dev/null/x", "n=1000000000000", "n=-1", "n=1e300", "n=nan", "n=True",
                 "baumgarte=nan", "baumgarte=-1", "\udc80", "system()", "evil.py", "/", ".", "1 2", "1j")


@cache
def _urdf_file() -> str:
    path = Path(tempfile.mkdtemp()) / "robot.urdf"
    path.write_text(URDF, encoding="utf-8")
    return str(path)


def _urdf(text: str) -> Any:
    """Result of a URDF that is read, compiled to text, and evaluated."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "robot.urdf")
        path.write_bytes(text.encode("utf-8", "surrogatepass"))
        module = sd.read_urdf(path, damping=True).embedding().compile("numpy")
        return module.rhs(0.0, np.full(module.metadata.sizes.x, 0.1))


def _sweep(text: str) -> Any:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder, "sweep.toml")
        path.write_bytes(text.encode("utf-8", "surrogatepass"))
        return _command(["sweep", str(path), "--jobs", "1", "--backend", "numpy", "--no-picture",
                         *([] if "output" in text else ["--output", str(Path(folder, "out"))])])


def _command(words: list[str]) -> Any:
    """The exit code of the command line; what it prints must not be a traceback."""
    from symdyn.cli import main

    with tempfile.TemporaryDirectory() as folder:
        sweep = Path(folder, "sweep.toml")
        sweep.write_text(SWEEP, encoding="utf-8")
        out, err = io.StringIO(), io.StringIO()
        with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
            try:
                code = main([w.replace("{folder}", str(Path(folder, "out"))).replace("{sweep}", str(sweep)) for w in words])
            except SystemExit as stop:  # argparse ends the program itself
                code = stop.code if isinstance(stop.code, int) else 1
    if code not in (0, 1, 2, 3, 130) or "Traceback (most recent call last)" in err.getvalue():
        raise AssertionError(f"exit code {code}: {err.getvalue()[-300:]}")
    return code


def calls() -> list[Call]:
    """All calls, in an order that stays."""
    return [*_systems(), *_derived(), *_modules(), *_solutions(), *_ensembles(), *_files()]
