"""Points, orientations, multipliers and reactions as scalars that may stand in every expression of a System."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import sympy as sp

from symdyn.errors import ModelError
from symdyn.model.faults import Faults
from symdyn.model.symbols import Timed, parts_of, time

if TYPE_CHECKING:
    from symdyn.given import BodyOrName, JointOrName, Vector

Place = tuple[sp.Expr, ...]

# Kind -> units of the value and its derivatives by time.
_UNITS = {"position": ("m", "m/s", "m/s^2"), "distance": ("m", "m/s", "m/s^2"), "rotation_matrix": ("", "1/s", "1/s^2"),
          "angular_velocity": ("rad/s", "rad/s^2")}
# Notation of components of a position and its derivatives.
_OF_POINTS = ("position", "velocity", "acceleration")
_LETTERS = ("r", "v", "a")
OMEGA = r"\omega"


@dataclass(frozen=True)
class Measure:
    """Definition of a quantity: kind, the names of its bodies (or of its joint, or constraint), points on them, body axes, the
    component, how often it is differentiated by time, the body in whose axes components of a reaction are taken, and the
    unit of the force of a contact."""

    kind: str
    of: tuple[str, ...]
    points: tuple[Place, ...] = ()
    index: tuple[int, ...] = ()
    order: int = 0
    frame: str | None = None
    force: str = "N"


class Quantity(Timed):
    """A scalar of the motion that follows from coordinates, speeds and loads; a SymPy symbol. `.dot` is its derivative by time.

    It is recorded from the recursion of the tree where it is used, never expanded.
    """

    __slots__ = ("measure",)
    _rank = 5

    measure: Measure

    def __new__(cls, measure: Measure) -> Quantity:
        """The symbol of a measure; two of the same measure are equal."""
        made: Quantity = sp.Symbol.__xnew__(cls, _text(measure), real=True)
        made.measure = measure
        return made

    def __getnewargs_ex__(self) -> tuple[tuple[Measure], dict[str, Any]]:
        return (self.measure,), {}

    def _hashable_content(self) -> tuple[Any, ...]:
        m = self.measure  # SymPy puts symbols in order by this: strings, and expressions among themselves
        return (m.kind, m.of, m.index, m.order, m.frame or "", sp.Tuple(*[sp.Tuple(*point) for point in m.points]))

    @property
    def level(self) -> int:
        """Highest level of its arguments: 0 coordinates, 1 speeds, too, 2 accelerations or forces, too."""
        kind, order = self.measure.kind, self.measure.order
        return 2 if kind in ("multiplier", "reaction", "contact") else order + (kind == "angular_velocity")

    @property
    def unit(self) -> str:
        """Its unit; that of a multiplier is that of a force by the unit of its row, which "" leaves open."""
        m = self.measure
        if m.kind == "reaction":
            return "N" if m.index[0] < 3 else "N m"
        if m.kind == "contact":
            return m.force
        return "" if m.kind == "multiplier" else _UNITS[m.kind][m.order]

    @property
    def dot(self) -> Quantity:
        """Its derivative by time. Raises ModelError where that takes derivatives of accelerations."""
        if self.level == 2:
            raise ModelError([f"the derivative of {self} by time is requested; accelerations, multipliers and reactions have "
                              "none"])
        return Quantity(replace(self.measure, order=self.measure.order + 1))

    def diff(self, *symbols: Any, **assumptions: Any) -> Any:
        """The derivative by time, or by itself. Raises ModelError for that by a coordinate, which is not known before the
        equations are derived; SymPy takes it for zero within compound expressions, without asking."""
        for s in symbols:
            if isinstance(s, sp.Symbol) and s not in (time, self) and not isinstance(s, (Quantity, sp.Dummy)):
                raise ModelError([f"the derivative of {self} by {s} is requested, which is not known before the equations are "
                                  "derived; write the component as an expression of coordinates, take sd.jacobian(body, point) "
                                  "as an output, or add a spring (add_spring_damper, add_force_between) in place of the gradient "
                                  "of an energy"])
        return super().diff(*symbols, **assumptions)

    @property
    def ddot(self) -> Quantity:
        """Its second derivative by time."""
        return self.dot.dot

    def _latex(self, printer: Any) -> str:
        m = self.measure
        of = ",".join(rf"\mathrm{{{_escaped(name)}}}" for name in m.of)
        if m.kind == "distance":
            return rf"{_accent(m.order, 'd')}_{{{of}}}"
        if m.kind == "multiplier":
            return rf"\lambda_{{{of}}}"
        if m.kind == "contact":
            return rf"F_{{{of},{m.index[0] + 1}}}"
        if m.kind == "reaction":
            return rf"{'F' if m.index[0] < 3 else 'M'}_{{{of},{'xyz'[m.index[0] % 3]}}}"
        if m.kind == "rotation_matrix":
            return rf"{_accent(m.order, 'R')}_{{{of},{m.index[0] + 1}{m.index[1] + 1}}}"
        axis = "xyz"[m.index[0]]
        if m.kind == "angular_velocity":
            return rf"{_accent(m.order, OMEGA)}_{{{of},{axis}}}"
        at = "" if _at_origin(m.points[0]) else rf"\left({', '.join(printer.doprint(e) for e in m.points[0])}\right)"
        return rf"{_LETTERS[m.order]}_{{{of},{axis}}}{at}"


def _accent(order: int, letter: str) -> str:
    return letter if order == 0 else rf"\{'d' * order}ot{{{letter}}}"


def _escaped(name: str) -> str:
    return name.replace("_", r"\_")


def _at_origin(point: Place) -> bool:
    return all(e == 0 for e in point)


def _text(m: Measure) -> str:
    """A measure as a user writes it, without sd."""
    if m.kind == "distance":
        places = [f"point_{letter}=({', '.join(map(str, point))})" for letter, point in zip("ab", m.points, strict=True)
                  if not _at_origin(point)]
        return f"distance({', '.join([*m.of, *places])}){'.' + 'd' * m.order + 'ot' if m.order else ''}"
    component = f"[{', '.join(map(str, m.index))}]" if m.index else ""
    if m.kind == "position":
        at = "" if _at_origin(m.points[0]) else f", ({', '.join(map(str, m.points[0]))})"
        return f"{_OF_POINTS[m.order]}({m.of[0]}{at}){component}"
    frame = "" if m.frame is None else f", frame={m.frame}"
    return f"{m.kind}({m.of[0]}{frame}){component}{'.' + 'd' * m.order + 'ot' if m.order else ''}"


def component(body: BodyOrName, at: Any, quantity: str, index: int) -> Quantity:
    """A component of the position, velocity or acceleration of a point of a body, n-frame. Raises ModelError, IndexError."""
    if index not in range(3):
        raise IndexError(f"component {index!r} of a point's {quantity}; there are 0, 1 and 2 for x, y and z")
    if quantity not in _OF_POINTS:
        raise ModelError([f"component {index!r} of a point's {quantity} is requested; expressions take components of its "
                          "position, velocity or acceleration"])
    name = _name(body, f"sd.{quantity}")
    return Quantity(Measure("position", (name,), (_point(at, f"sd.{quantity}: point of {name}", body),), (int(index),),
                            _OF_POINTS.index(quantity)))


def rotation_matrix(body: BodyOrName) -> sp.ImmutableMatrix:
    """The rotation matrix R of a body, (3, 3): n components are R times components in body axes.

    Its entries are scalars that may stand in every expression, with `.dot`. Raises ModelError.

    >>> sd.rotation_matrix("bob")[0, 0]
    rotation_matrix(bob)[0, 0]
    """
    name = _name(body, "sd.rotation_matrix")
    return sp.ImmutableMatrix(3, 3, lambda i, j: Quantity(Measure("rotation_matrix", (name,), index=(int(i), int(j)))))


def angular_velocity(body: BodyOrName) -> sp.ImmutableMatrix:
    """The angular velocity of a body, (3, 1), n-frame, rad/s; in planar systems only its third component is not zero.

    Its entries are scalars that may stand in every expression, with `.dot`, the angular acceleration, in outputs and events.
    Components in body axes are `sd.rotation_matrix(body).T * sd.angular_velocity(body)`. Raises ModelError.

    >>> sd.angular_velocity("bob")[2]
    angular_velocity(bob)[2]
    """
    name = _name(body, "sd.angular_velocity")
    return sp.ImmutableMatrix(3, 1, lambda i, _: Quantity(Measure("angular_velocity", (name,), index=(int(i),))))


def distance(a: BodyOrName, b: BodyOrName, point_a: Vector | None = None, point_b: Vector | None = None) -> Quantity:
    """The distance of a point of body a from a point of body b, m, at least 0; `.dot` is its rate.

    point_a, point_b   where they are on their bodies, body axes, m; default: the origins
    The rate is not defined where the points coincide. Raises ModelError.

    >>> sd.distance("a", "b").dot
    distance(a, b).dot
    """
    names = (_name(a, "sd.distance"), _name(b, "sd.distance"))
    points = tuple(_point((0, 0, 0) if point is None else point, f"sd.distance: point of {name}", body)
                   for point, name, body in zip((point_a, point_b), names, (a, b), strict=True))
    return Quantity(Measure("distance", names, points))


def multiplier(name: str) -> Quantity:
    """The multiplier of a constraint by its name, as in `equations.constraints`: of C_r^T lam in M u_dot + k + C_r^T lam = F.

    It may stand in loads, rates of states, events, resets and outputs of augmented equations. Raises ModelError.

    >>> sd.multiplier("rail") * 0.3
    0.3*multiplier(rail)
    """
    return Quantity(Measure("multiplier", (_name(name, "sd.multiplier"),)))


def reaction(joint: JointOrName, frame: BodyOrName | None = None) -> sp.ImmutableMatrix:
    """Load that a joint transmits to its child, (6, 1): force (N), then moment about the joint's point on the child (N m).

    frame   a body in whose axes the components are taken; default: the n-frame
    As in the quantity `reactions`, what the joint's own drive gives along its speeds is left out. Its entries may stand in loads,
    rates of states, events, resets and outputs: `mu * Abs(sd.reaction("slider", rod)[1])` is Coulomb friction. Raises ModelError.

    >>> abs(sd.reaction("pivot")[0])
    Abs(reaction(pivot)[0])
    """
    name = _name(joint, "sd.reaction")
    axes = None if frame is None else _name(frame, "sd.reaction: frame")
    return sp.ImmutableMatrix(6, 1, lambda k, _: Quantity(Measure("reaction", (name,), index=(int(k),), frame=axes)))


def quantities_in(expressions: Iterable[Any]) -> list[Quantity]:
    """The quantities in some expressions, each once, in the order of their names."""
    made_of = [e for e in expressions if isinstance(e, sp.Basic) and (e.args or isinstance(e, Quantity))]
    result = {part for part in parts_of(*made_of) if isinstance(part, Quantity)}
    return sorted(result, key=lambda q: (q.name, str(q.measure)))


def of_speeds(symbol: sp.Basic) -> bool:
    """Whether a symbol is a quantity that is linear in the speeds, such as a velocity."""
    return isinstance(symbol, Quantity) and symbol.level == 1


def _name(owner: Any, what: str) -> str:
    name = owner if isinstance(owner, str) else getattr(owner, "name", None)
    if not isinstance(name, str) or isinstance(owner, sp.Basic):
        raise ModelError([f"{what} was given {owner!r}; pass a body, joint or constraint of the system, or its name"])
    return name


def _point(at: Any, what: str, body: Any) -> Place:
    faults = Faults()
    taken = tuple(faults.point(at, what, True, body))
    if faults:
        raise ModelError(list(faults))
    return taken
