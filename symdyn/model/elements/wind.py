"""Forces of the wind: drag of a body, thrust of a rotor."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from fractions import Fraction
from typing import TYPE_CHECKING, Any

import numpy as np
import sympy as sp

from symdyn.model.elements.base import Element
from symdyn.model.elements.checks import not_negative
from symdyn.model.elements.site import Action, Site
from symdyn.model.symbols import symbols_of
from symdyn.spatial.vectors import cross, dot

if TYPE_CHECKING:
    from symdyn.given import BodyOrName, Scalar, Vector

# m^2/s^2: below this the air is at rest; a root of zero would have no derivative.
CALM = Fraction(1, 10**30)


class Drag(Element):
    """F = 1/2 density coefficient area |v_r| v_r with v_r = wind - velocity of the point, at the point.

    area          m^2; coefficient: 1; density: of the air or water, kg/m^3
    wind          (3,) n-frame, m/s: expressions of t, inputs and parameters
    point         (3,) body axes, m

    >>> system = sd.System("float", gravity=[0, 0, -9.81])
    >>> box = system.add_body("box", mass=500, inertia=[100, 100, 100])
    >>> joint = system.add_joint(sd.Prismatic("heave", system.ground, box, axis=[0, 0, 1]))
    >>> drag = system.add_load(sd.Drag(box, area=1, coefficient=1.2, density=1.2, wind=[0, 0, 5]))
    >>> system.compile(backend="numpy").rhs(0.0, [-0.1, 0.0]).round(4)
    array([ 0.   , -9.774])
    """

    kind = "drag"

    def __init__(self, body: BodyOrName, area: Scalar, coefficient: Scalar, density: Scalar, wind: Vector = (0, 0, 0),
                 point: Vector = (0, 0, 0), name: str = "") -> None:
        super().__init__(body, name)
        where, faults = self.where, self.faults
        self.area = not_negative(faults, area, f"{where}: area", "m^2")
        self.coefficient = not_negative(faults, coefficient, f"{where}: coefficient")
        self.density = not_negative(faults, density, f"{where}: density", "kg/m^3")
        self.wind = faults.vector(wind, f"{where}: wind")
        self.point = faults.vector(point, f"{where}: point")

    @property
    def constants(self) -> Sequence[sp.Expr]:
        return [self.area, self.coefficient, self.density, *self.point]

    @property
    def expressions(self) -> Sequence[sp.Expr]:
        return list(self.wind)

    @property
    def units(self) -> Mapping[str, Sequence[sp.Expr]]:
        return {"m^2": [self.area], "1": [self.coefficient], "kg/m^3": [self.density], "m/s": list(self.wind),
                "m": list(self.point)}

    def act(self, site: Site) -> Action:
        a = site.algebra
        point = a.constants(self.point)
        v = relative_wind(site, a.constants(self.wind), point)
        speed = a.sqrt(a.recorder.apply("max", dot(v, v), CALM))
        factor = a.expression(self.density) * a.expression(self.coefficient) * a.expression(self.area) / 2
        f = factor * speed * v
        return Action(other=(f, cross(point, f)))


class Thrust(Element):
    """A force along an axis of the body that follows from the relative wind speed along it, as of a rotor.

    force   function of v_r, the speed (m/s) of the air along the axis as the point sees it, that returns N: it is called once,
            with a symbol, and gives an expression of it, of t, inputs and parameters; or such an expression without v_r
    axis    (3,) body axes, of any length but zero; the force acts along it where it is positive
    wind    (3,) n-frame, m/s: expressions of t, inputs and parameters
    point   (3,) body axes, m

    >>> system = sd.System("float", gravity=[0, 0, -9.81])
    >>> box = system.add_body("box", mass=500, inertia=[100, 100, 100])
    >>> joint = system.add_joint(sd.Prismatic("heave", system.ground, box, axis=[0, 0, 1]))
    >>> thrust = system.add_load(sd.Thrust(box, lambda v: 10 * v, axis=[0, 0, 1], wind=[0, 0, 5]))
    >>> system.compile(backend="numpy").rhs(0.0, [-0.1, 0.0]).round(4)
    array([ 0.  , -9.71])
    """

    kind = "thrust"

    def __init__(self, body: BodyOrName, force: Callable[[sp.Symbol], Scalar] | Scalar, axis: Vector = (1, 0, 0),
                 point: Vector = (0, 0, 0), wind: Vector = (0, 0, 0), name: str = "") -> None:
        super().__init__(body, name)
        where, faults = self.where, self.faults
        self.speed = sp.Dummy("v_r", real=True)
        self.force = self._force(force)
        self.axis = faults.vector(axis, f"{where}: axis")
        self.point = faults.vector(point, f"{where}: point")
        self.wind = faults.vector(wind, f"{where}: wind")
        if all(e == 0 for e in self.axis):
            if not faults:
                faults.append(f"{where}: axis is (0, 0, 0); pass a direction in body axes")
        else:
            self.axis = self.axis / sp.sqrt(sum(e**2 for e in self.axis))

    def _force(self, force: Any) -> sp.Expr:
        what = f"{self.where}: force"
        if callable(force) and not isinstance(force, sp.Basic):
            try:
                force = force(self.speed)
            except Exception as error:
                self.faults.append(f"{what} is a function that failed with a symbol for the speed of the air "
                                   f"({type(error).__name__}: {error}); pass a function of this one argument that returns an "
                                   "expression of SymPy, with sympy.sin and the like, not those of NumPy")
                return sp.S.Zero
        return self.faults.expression(force, what)

    @property
    def constants(self) -> Sequence[sp.Expr]:
        return [*self.axis, *self.point]

    @property
    def expressions(self) -> Sequence[sp.Expr]:
        used = sorted(symbols_of(self.force) - {self.speed}, key=str)
        return [*self.wind, *used]

    @property
    def units(self) -> Mapping[str, Sequence[sp.Expr]]:
        return {"m/s": list(self.wind), "m": list(self.point)}

    def act(self, site: Site) -> Action:
        a = site.algebra
        point, axis = a.constants(self.point), a.constants(self.axis)
        speed = dot(axis, relative_wind(site, a.constants(self.wind), point))
        f = axis * a.within({self.speed: speed}).expression(self.force)
        return Action(other=(f, cross(point, f)))


def relative_wind(site: Site, wind: np.ndarray, point: np.ndarray) -> np.ndarray:
    """Velocity of the air (n-frame components given) as a point of the body sees it, body axes."""
    return site.R.T @ wind - site.v - cross(site.omega, point)
