"""Contact: what a user describes, and its faults."""

from __future__ import annotations

import math
from collections.abc import Mapping
from functools import partial
from typing import TYPE_CHECKING, Any, cast

import sympy as sp

from symdyn.model.contacts.coefficients import above, coefficients, range_faults, value_of
from symdyn.model.contacts.compliance import Compliance, Range, compliance_faults
from symdyn.model.contacts.shapes import Bore, Box, Cam, Curve, Cylinder, Disc, Plane, Point, Sphere, Surface, Torus
from symdyn.model.faults import Faults
from symdyn.real_numbers import length_of
from symdyn.shown import shown

if TYPE_CHECKING:
    from symdyn.given import BodyOrName, Scalar
    from symdyn.model.contacts.shapes import Counterpart, Shape

LAWS, IMPACTS = ("rigid", "compliant"), ("newton", "poisson", "stronge")
ORIGIN_OF_A = Point()
# Angles at which a cam is looked at.
AROUND = 72
ON_A, ON_B = (Point, Sphere, Disc, Torus, Cylinder, Box), (Plane, Sphere, Bore, Curve, Surface, Cam)


class Contact:
    """A contact where two bodies may touch: one-sided, with dry friction and impacts.

    name          of the contact; events, parameters and results are named after it
    a             the body that carries the shape; b: the body that it touches, which may be the ground
    shape         of sd.contacts: that on a (Point, Sphere, Disc, Torus, Cylinder, Box), or a pair of it and that on b (Plane,
                  Sphere, Bore, Curve, Surface, Cam); default on b: the plane y = 0 of a planar system, z = 0 in space
    friction      coefficient of Coulomb friction, or (static, kinetic); numbers or expressions of parameters
    restitution   normal velocity after an impact by that before it, 0 to 1, likewise
    law           "rigid": no penetration; open, sticking and sliding are modes that change at located events; "compliant": forces
                  by the depth of penetration and the slip, smooth in every formulation and method
    impact        law of rigid impacts: "newton" (velocities), "poisson" (impulses of compression and expansion) or "stronge"
                  (their energies; one contact at a time)
    compliance    how a compliant contact yields, sd.contacts.Compliance(...)
    ignored       an expression; while it is positive a rigid contact that is open does not close, however deep it goes: the foot
                  of a straight leg that scuffs in mid-swing. None: it always counts

    A rigid contact is open as long as its gap is positive. Closed, it transmits a normal force N >= 0 and in its tangential
    directions (one in a plane, two in space) a friction force of at most static times N while it sticks, and of kinetic times N
    against the slip while it slides. See docs/contact.md.

    >>> contact = sd.Contact("heel", "foot", "ground", shape=sd.contacts.Point([0, -1]), friction=0.5)
    >>> contact.name, contact.law
    ('heel', 'rigid')
    """

    def __init__(self, name: str, a: BodyOrName, b: BodyOrName, shape: Shape | tuple[Shape, Counterpart] = ORIGIN_OF_A,
                 friction: Scalar | tuple[Scalar, Scalar] = 0, restitution: Scalar = 0, law: str = "rigid",
                 impact: str = "newton", compliance: Compliance | None = None, ignored: Scalar | None = None) -> None:
        self.name, self.a, self.b, self.law, self.impact = name, a, b, law, impact
        self.compliance = compliance
        self.faults = faults = Faults()
        self.where = where = f"contact {shown(name)}"
        if not isinstance(name, str) or not name.isidentifier():
            faults.append(f"a contact is named {shown(name)}; pass an identifier such as 'heel'")
        pair = tuple(shape) if isinstance(shape, (tuple, list)) else (shape, Plane())
        if len(pair) != 2 or not isinstance(pair[0], ON_A) or not isinstance(pair[1], ON_B):
            faults.append(f"{where}: shape is {shown(shape)}; pass one of sd.contacts for body a "
                          f"({', '.join(kind.__name__ for kind in ON_A)}), or a pair of it and one for body b "
                          f"({', '.join(kind.__name__ for kind in ON_B)})")
            pair = (Point(), Plane())
        self.on_a: Any = pair[0]
        self.on_b: Any = pair[1]
        self.static, self.kinetic, self.restitution = coefficients(faults, where, friction, restitution)
        self.ignored = None if ignored is None else faults.expression(ignored, f"{where}: ignored")
        if law not in LAWS:
            faults.append(f"{where}: law is {shown(law)}; there are {', '.join(map(repr, LAWS))}")
        if impact not in IMPACTS:
            faults.append(f"{where}: impact is {shown(impact)}; there are {', '.join(map(repr, IMPACTS))}")
        if law == "compliant" and self.restitution != 0:
            faults.append(f"{where}: restitution belongs to rigid contacts; pass the dissipation of the compliance")
        if law == "compliant" and ignored is not None:
            faults.append(f"{where}: ignored belongs to rigid contacts, which close at an instant; leave it out")
        if law != "compliant" and compliance is not None:
            faults.append(f"{where}: compliance belongs to law='compliant'; pass that law, or leave compliance out")

    @property
    def frictionless(self) -> bool:
        """Whether there is no friction by structure."""
        return self.static == 0 and self.kinetic == 0

    @property
    def lengths(self) -> dict[str, sp.Expr]:
        """Radii and lengths of its shapes, by what they are called in messages."""
        result = {}
        for what, shape in (("on a", self.on_a), ("on b", self.on_b)):
            for kind in ("radius", "length", "tube"):
                if hasattr(shape, kind) and not isinstance(shape, Cam):
                    result[f"{kind} of the shape {what}"] = Faults().expression(getattr(shape, kind), kind)
            if isinstance(shape, Box):
                result |= {f"edge {k + 1} of the box": Faults().expression(e, "size") for k, e in enumerate(
                    shape.size if isinstance(shape.size, (list, tuple)) else ())}
        return result

    @property
    def room(self) -> sp.Expr | None:
        """Difference in size between the bore and the shape on a in it, m; None where there is no bore, or the shape is a
        point."""
        a, number = self.on_a, Faults().expression
        if not isinstance(self.on_b, Bore) or isinstance(a, Point):
            return None
        if isinstance(a, Box):
            sizes = [number(e, "size") for e in (a.size if isinstance(a.size, (list, tuple)) else ())]
            reach = sp.sqrt(sp.Add(*[e**2 for e in sizes])) / 2
        else:
            reach = number(a.radius, "radius")
        if isinstance(a, Torus):
            reach = reach + number(a.tube, "tube")
        elif isinstance(a, Cylinder):
            reach = sp.sqrt(reach**2 + (number(a.length, "length") / 2)**2)
        return number(self.on_b.radius, "radius") - reach

    @property
    def ranges(self) -> list[Range]:
        """Ranges of radii and lengths of its shapes, and of its room in a bore."""
        result = [Range(what, length, reached=self._may_vanish(what)) for what, length in self.lengths.items()]
        return result if self.room is None else [*result, Range("room in the bore", self.room, reached=False)]

    def _may_vanish(self, what: str) -> bool:
        """Whether a radius or length may be 0, as that of a sphere, which is a point then, or of a tube."""
        return isinstance(self.on_b if what.endswith("b") else self.on_a, Sphere) or what.startswith("tube")

    def number_faults(self, defaults: Mapping[sp.Basic | str, float]) -> list[str]:
        """Friction, restitution and radii that cannot be, with the numbers that parameters have."""
        result = []
        values = {"static friction": self.static, "kinetic friction": self.kinetic, "restitution": self.restitution}
        values |= self.lengths
        number = partial(value_of, defaults=defaults)
        if self.law == "compliant":
            result += compliance_faults(self.where, self.compliance, number, self.static, self.kinetic)
        numbers = {what: value for what, e in values.items() if (value := number(e)) is not None}
        result += range_faults(self.where, numbers)
        result += [f"{self.where}: {what} is 0; pass a length above 0" for what in self.lengths
                   if numbers.get(what) == 0 and not self._may_vanish(what)]
        room = None if self.room is None else number(self.room)
        if room is not None and room <= 0 and not result:
            result.append(f"{self.where}: the {type(self.on_a).__name__} on a does not fit into the Bore on b, which is "
                          f"{-room:g} m too small; pass a larger bore")
        result += self._cam_faults(defaults)
        static, kinetic = (numbers.get(f"{kind} friction") for kind in ("static", "kinetic"))
        if static is not None and kinetic is not None and kinetic > static >= 0:
            result.append(above(self.where, kinetic, static))
        return result

    def _cam_faults(self, defaults: Mapping[sp.Basic | str, float]) -> list[str]:
        """A cam whose radius is not positive all around, as far as it has numbers."""
        cam = self.on_b
        if not isinstance(cam, Cam) or not isinstance(cam.angle, sp.Symbol):
            return []
        name, curve = cam.angle.name, cast("Any", cam.radius)
        spline = not isinstance(curve, (sp.Basic, int, float)) and callable(curve)
        for angle in (2 * math.pi * (k + 0.5) / AROUND for k in range(AROUND)):
            radius = float(curve(angle)) if spline else value_of(curve, {**defaults, name: angle})
            if radius is not None and not radius > 0:
                return [f"{self.where}: the radius of the Cam is {radius:g} m at the angle {angle:.4g}; pass one that is above 0 "
                        "all around"]
        return []

    def structure_faults(self, planar: bool) -> list[str]:
        """Shapes that do not fit each other or the plane."""
        a, b, result = self.on_a, self.on_b, list[str]()
        kind_a, kind_b = type(a).__name__, type(b).__name__
        if planar and isinstance(a, (Disc, Torus, Cylinder)):
            result.append(f"{self.where}: a {kind_a} touches in space; pass a Sphere, in a plane a circle")
        if isinstance(b, Surface if planar else (Curve, Cam)):
            result.append(f"{self.where}: a {kind_b} belongs to a {'spatial' if planar else 'planar'} system; pass a "
                          f"{'Curve' if planar else 'Surface'}")
        if isinstance(a, Box) and length_of(a.size) not in ((2,) if planar else (3,)):
            result.append(f"{self.where}: size is {shown(a.size)}; pass {'two' if planar else 'three'} lengths")
        return result
