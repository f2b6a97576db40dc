"""Forms in a data file: for every kind of element the entries that it takes, by the arguments that make it in Python.

One table that is written by, read by, and that the schema comes from.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, fields
from functools import cached_property
from typing import Any

from symdyn.flexible.modal_body import ModalBody
from symdyn.model import closures, elements, joints
from symdyn.model.contacts import contact, group, shapes
from symdyn.model.contacts import joints as contact_joints
from symdyn.model.contacts.compliance import Bristles, Compliance
from symdyn.model.loads import Force, ForceBetween, JointForce, SpringDamper, Torque
from symdyn.model.orientation import EulerAngles, EulerParameters
from symdyn.model.system import System

# Argument -> the kind of its value, see `KINDS`; an entry "Class.argument" takes precedence.
ARGUMENTS = {
    **dict.fromkeys(("name", "law", "impact", "angles", "velocity", "sequence"), "text"),
    **dict.fromkeys(("seabed", "carries", "stop", "located"), "flag"),
    **dict.fromkeys(("parent", "child", "body", "body_a", "body_b", "a", "b", "reaction", "frame"), "body"),
    **dict.fromkeys(("joint", "joint_a", "joint_b", "other"), "joint"),
    **dict.fromkeys(("coordinate", "mass", "stiffness", "damping", "length", "pitch", "ratio", "offset", "density", "area",
                     "coefficient", "weight", "friction", "restitution", "width", "breakaway", "sliding", "lower", "upper",
                     "radius", "height", "frequency", "ramp", "gravity", "exponent", "dissipation", "slip_speed", "stribeck",
                     "viscous", "elastic", "depth", "creep", "tube", "value", "rate", "expression", "ignored"), "expression"),
    **dict.fromkeys(("coordinates", "force", "torque", "amplitude", "phase", "reference"), "expressions"),
    **dict.fromkeys(("axis", "parent_point", "child_point", "point", "point_a", "point_b", "position", "wind", "anchor",
                     "fairlead", "com", "center", "size", "at", "normal"), "vector"),
    **dict.fromkeys(("parent_rotation", "child_rotation", "rotation", "inertia", "A", "K", "B"), "matrix"),
    "axes": "matrix", "speeds": "symbols", "speed": "symbol", "x": "symbol", "y": "symbol", "angle": "symbol",
    "orientation": "orientation",
    "units": "texts", "direction": "whole", "boxes": "boxes", "without": "boxes", "beam": "beam", "compliance": "compliance",
    "bristles": "bristles", "shape": "shape", "bodies": "bodies", "planes": "planes", "lowest": "text",
    "Contact.friction": "friction", "ContactGroup.friction": "friction", "ContactGroup.shape": "spheres",
    "force_between.force": "expression", "joint_force.value": "values", "Thrust.force": "thrust",
}


@dataclass(frozen=True)
class Entry:
    """An entry of a table: its kind, whether it must be there, and what is left out."""

    kind: str
    required: bool
    default: Any


# Arguments that are objects of SymPy's mechanics, which files have no words for.
OBJECTS = ("body.frame", "body.origin")


@dataclass(frozen=True)
class Form:
    """A kind of element.

    word    its `type` in files; made: what the arguments are given to, a class or a method of System (by name)
    kind    the class of the element; given: argument -> how it is read off an element, where it is no attribute of its name
    """

    word: str
    made: Callable[..., Any]
    kind: type
    given: Mapping[str, Callable[[Any], Any]] = field(default_factory=dict)

    @cached_property
    def entries(self) -> dict[str, Entry]:
        """The entries, in the order of the arguments."""
        result = {}
        for name, one in inspect.signature(self.made).parameters.items():
            if name != "self" and f"{self.word}.{name}" not in OBJECTS:
                kind = ARGUMENTS.get(f"{self.word}.{name}") or ARGUMENTS[name]
                empty = one.default is inspect.Parameter.empty
                result[name] = Entry(kind, empty, None if empty or one.default is ... else one.default)
        return result

    def value(self, element: Any, argument: str) -> Any:
        """Value that an element has for an argument."""
        return self.given[argument](element) if argument in self.given else getattr(element, argument)

    @property
    def about(self) -> str:
        """The first sentence of its documentation."""
        return " ".join((inspect.getdoc(self.made) or "").split("\n\n")[0].split())


def _forms(kinds: Sequence[type], given: Mapping[str, Callable[[Any], Any]]) -> list[Form]:
    return [Form(kind.__name__, kind, kind, given) for kind in kinds]


def _only(values: Any) -> Any:
    return None if values is None else values[0]


_COORDINATES = {"coordinates": lambda j: None if j.unnamed else j.coordinates,
                "coordinate": lambda j: None if j.unnamed else j.coordinates[0], "speed": lambda j: _only(j.speeds),
                "velocity": lambda j: "body" if j.body_velocity else "parent", "units": lambda j: j.coordinate_units}
JOINTS = _forms(joints.KINDS, _COORDINATES)
LOOPS = [*(f for f in JOINTS if f.kind not in (joints.Free, joints.Modal)), *_forms([closures.Rod, closures.Gear], {})]
_LABEL = {"name": lambda load: load.label}
LOADS = [Form("force", System.add_force, Force, _LABEL), Form("torque", System.add_torque, Torque, _LABEL),
         Form("joint_force", System.add_joint_force, JointForce, {**_LABEL, "value": lambda load: load.values}),
         Form("spring_damper", System.add_spring_damper, SpringDamper, _LABEL),
         Form("force_between", System.add_force_between, ForceBetween, _LABEL),
         *_forms(elements.KINDS, _LABEL)]
_FRICTION = {"friction": lambda c: (c.static, c.kinetic)}
CONTACTS = [Form("Contact", contact.Contact, contact.Contact, {**_FRICTION, "shape": lambda c: (c.on_a, c.on_b)}),
            Form("Stop", contact_joints.Stop, contact_joints.Stop,
                 {"lower": lambda c: c.ends.get("lower"), "upper": lambda c: c.ends.get("upper")}),
            *_forms([contact_joints.Backlash, contact_joints.OneWayClutch], {}),
            Form("JointFriction", contact_joints.JointFriction, contact_joints.JointFriction,
                 {"breakaway": lambda c: c.static, "sliding": lambda c: c.kinetic}),
            Form("Rope", contact_joints.Rope, contact_joints.Rope,
                 {"point_a": lambda c: c.points[0], "point_b": lambda c: c.points[1]})]
GROUPS = [Form("ContactGroup", group.ContactGroup, group.ContactGroup, {**_FRICTION, "shape": lambda c: c.shapes})]
BODIES = [Form("body", System.add_body, object)]
# Shapes that stand in an entry as a table of their own, by their `type`.
SHAPES = _forms([shapes.Point, shapes.Sphere, shapes.Disc, shapes.Torus, shapes.Cylinder, shapes.Box, shapes.Plane, shapes.Bore,
                 shapes.Curve, shapes.Surface, shapes.Cam], {})
PLAIN = {"boxes": Form("Box", elements.Box, elements.Box), "compliance": Form("Compliance", Compliance, Compliance),
         "bristles": Form("Bristles", Bristles, Bristles)}
ORIENTATIONS = (EulerAngles, EulerParameters)
BEAM = tuple(f.name for f in fields(ModalBody))
# Tables of the file -> forms of their elements; an element's `type` is left out where there is one form.
TABLES = {"bodies": BODIES, "joints": JOINTS, "loops": LOOPS, "loads": LOADS, "contacts": CONTACTS, "contact_groups": GROUPS}
# Entries of symbols, by kind, besides assumptions of SymPy; each kind is a table by name.
SYMBOLS = {"parameters": ("default", "unit"), "coordinates": ("initial", "unit"), "speeds": ("initial", "unit"),
           "inputs": ("initial", "unit"), "motions": ("initial", "unit")}
ASSUMPTIONS = ("positive", "negative", "nonnegative", "nonpositive", "nonzero", "zero", "real", "integer", "finite",
               "extended_real", "complex", "commutative", "hermitian", "rational", "irrational", "algebraic", "transcendental",
               "even", "odd", "prime", "composite", "imaginary", "infinite", "antihermitian", "noninteger", "extended_positive",
               "extended_negative", "extended_nonzero", "extended_nonnegative", "extended_nonpositive")
# Entries of drawn shapes of pictures, by `kind`: lengths (rows of expressions), and entries that are no numbers.
DRAWN = {"box": (("size", "center", "hole"), ()), "sweep": (("points", "widths", "direction"), ()),
         "line": (("points", "end"), ("width", "to")), "water": (("level", "size", "center", "waves"), ())}
OUTPUT_POINTS = ("position", "velocity", "acceleration", "jacobian", "bias_acceleration")
