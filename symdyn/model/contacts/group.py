"""ContactGroup: many free bodies that touch one another and planes, whose pairs are found along a motion."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import sympy as sp

from symdyn.model.contacts.coefficients import above, coefficients, range_faults, value_of
from symdyn.model.contacts.shapes import Plane, Sphere
from symdyn.model.faults import Faults
from symdyn.shown import shown

if TYPE_CHECKING:
    from symdyn.given import BodyOrName, Scalar
    from symdyn.model.system import System

# Joints from the ground that bodies of a group hang on, by whether the system is planar.
FREE_JOINT = {False: "free", True: "planar"}


class ContactGroup:
    """Many bodies, each free, that touch one another and planes of the ground as spheres (in a plane as circles).

    name          of the group
    bodies        each on a Free joint from the ground, in a planar system on a Planar one, and held by nothing else
    shape         sd.contacts.Sphere, one for all or one for each body
    planes        of sd.contacts, fixed to the ground, with the bodies on the side that their normals point to
    friction      coefficient of Coulomb friction, or (static, kinetic); numbers or expressions of parameters
    restitution   normal velocity after an impact by that before it, 0 to 1, likewise

    No pair has a name: those that are near are found in every step by a grid of cells. Such contacts go with
    simulate(..., method="moreau") alone; their results are `Solution.contact_groups[name]`. See docs/contact.md.

    >>> group = sd.ContactGroup("grains", ["one", "two"], sd.contacts.Sphere(0.1), planes=[sd.contacts.Plane()], friction=0.3)
    >>> group.name, len(group.bodies)
    ('grains', 2)
    """

    def __init__(self, name: str, bodies: Sequence[BodyOrName], shape: Sphere | Sequence[Sphere],
                 planes: Sequence[Plane] = (), friction: Scalar | tuple[Scalar, Scalar] = 0, restitution: Scalar = 0) -> None:
        self.name = name
        self.faults = faults = Faults()
        self.where = where = f"contact group {shown(name)}"
        if not isinstance(name, str) or not name.isidentifier():
            faults.append(f"a contact group is named {shown(name)}; pass an identifier such as 'grains'")
        self.bodies = tuple(bodies) if isinstance(bodies, Sequence) and not isinstance(bodies, str) else ()
        if not self.bodies:
            faults.append(f"{where}: bodies are {shown(bodies)}; pass a list of bodies, or of their names")
        shapes = list(shape) if isinstance(shape, Sequence) else [shape] * len(self.bodies)
        if len(shapes) != len(self.bodies) or not all(isinstance(one, Sphere) for one in shapes):
            faults.append(f"{where}: shape is {shown(shape)}; pass one sd.contacts.Sphere, or one for each of {len(self.bodies)} "
                          "bodies")
            shapes = [Sphere(1)] * len(self.bodies)
        self.shapes = tuple(shapes)
        self.planes = tuple(planes) if isinstance(planes, Sequence) and all(isinstance(p, Plane) for p in planes) else ()
        if len(self.planes) != (len(planes) if isinstance(planes, Sequence) else -1):
            faults.append(f"{where}: planes are {shown(planes)}; pass a list of sd.contacts.Plane")
        self.static, self.kinetic, self.restitution = coefficients(faults, where, friction, restitution)


@dataclass(frozen=True)
class GroupSphere:
    """A body of a group: its name, radius, centre in body axes, the symbols of its speeds."""

    body: str
    radius: sp.Expr
    center: tuple[sp.Expr, ...]
    speeds: tuple[sp.Symbol, ...]


@dataclass(frozen=True)
class LoweredGroup:
    """A checked group: coefficients (static, kinetic, restitution), planes (normal of any length, point)."""

    name: str
    coefficients: tuple[sp.Expr, ...]
    planes: tuple[tuple[tuple[sp.Expr, ...], tuple[sp.Expr, ...]], ...]
    spheres: tuple[GroupSphere, ...]

    @property
    def constants(self) -> list[sp.Expr]:
        """Expressions that depend on parameters alone."""
        return [*self.coefficients, *[e for plane in self.planes for part in plane for e in part],
                *[e for sphere in self.spheres for e in (sphere.radius, *sphere.center)]]


def lowered(system: System, group: ContactGroup, faults: Faults) -> LoweredGroup | None:
    """A group with its expressions; None, with faults, where it cannot be."""
    before = len(faults)
    faults.extend([*group.faults, *_coefficient_faults(system, group)])
    joints = {getattr(j.child, "name", j.child): j for j in system.joints}
    parents = {getattr(j.parent, "name", j.parent) for j in system.joints}
    ends = [body for j in system.loops for body in (getattr(j, "parent", None), getattr(j, "child", None))]
    closed = {getattr(body, "name", body) for body in ends}
    wanted, spheres = FREE_JOINT[system.planar], []
    names = [name if isinstance(name, str) else shown(name) for name in (getattr(body, "name", body) for body in group.bodies)]
    twice = [str(name) for name, count in Counter(names).items() if count > 1]
    if twice:
        faults.append(f"{group.where}: {', '.join(sorted(twice))} is in it twice; name each body once")
    for name, shape in zip(names, group.shapes, strict=True):
        joint = joints.get(name)
        if joint is None or joint.kind != wanted or getattr(joint.parent, "name", joint.parent) != "ground" or (
                name in parents or name in closed):
            faults.append(f"{group.where}: body {shown(name)} is not free; each of its bodies hangs on a {wanted.capitalize()} "
                          "joint from the ground, and carries nothing. Name contacts of other bodies one by one, with sd.Contact")
            break
        symbols = joint.speeds if joint.speeds is not None else joint.default_speeds()
        speeds = tuple(getattr(q, "dot", q) if s is None else s for s, q in zip(symbols, joint.coordinates, strict=False))
        spheres.append(GroupSphere(str(name), faults.expression(shape.radius, f"{group.where}: radius"),
                                   tuple(faults.vector(shape.center, f"{group.where}: center", system.planar)), speeds))
    if system.constraints or system.ground_motion is not None:
        faults.append(f"{group.where}: the system has constraints by expression, or a ground that moves, which groups do not go "
                      "with; name contacts one by one, with sd.Contact")
    up = (0, 1, 0) if system.planar else (0, 0, 1)
    planes = []
    for plane in group.planes:
        normal = tuple(faults.vector(up if plane.normal is None else plane.normal, f"{group.where}: normal", system.planar))
        if all(e == 0 for e in normal):
            faults.append(f"{group.where}: the normal of a plane is zero; pass a direction")
        planes.append((normal, tuple(faults.vector(plane.point, f"{group.where}: point of a plane", system.planar))))
    if len(faults) > before:
        return None
    return LoweredGroup(group.name, (group.static, group.kinetic, group.restitution), tuple(planes), tuple(spheres))


def _coefficient_faults(system: System, group: ContactGroup) -> list[str]:
    """Coefficients and radii that cannot be, with the numbers that parameters have."""
    values = {"static friction": group.static, "kinetic friction": group.kinetic, "restitution": group.restitution}
    numbers = {what: value for what, e in values.items() if (value := value_of(e, system.defaults)) is not None}
    result = range_faults(group.where, numbers)
    static, kinetic = (numbers.get(f"{kind} friction") for kind in ("static", "kinetic"))
    if static is not None and kinetic is not None and kinetic > static:
        result.append(above(group.where, kinetic, static))
    radii = {value_of(radius, system.defaults) for radius in {shape.radius for shape in group.shapes}}
    if any(radius is not None and radius <= 0 for radius in radii):
        result.append(f"{group.where}: a radius is not positive; pass lengths in m")
    return result
