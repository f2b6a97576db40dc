"""The car axis: a rod on springs over a moving road."""

from __future__ import annotations

import sympy as sp

from symdyn.model import shapes
from symdyn.model.joints import Custom, Planar
from symdyn.model.symbols import coordinates, parameters, time
from symdyn.model.system import System


def car_axis() -> System:
    """A car's axis on a bumpy road: two point masses joined by a rod, each on a spring; the right wheel follows the road.

    The left wheel is at the origin, the right one at (xb, yb) with yb = r sin(w t), xb = sqrt(L^2 - yb^2). The coordinates
    xl, yl, xr, yr (m) are the positions of the left and the right end of the axis, y upward. Planar. Springs of
    stiffness 1 N/m and length L0 join the left end to the origin and the right end to the right wheel. Constraints:
    xl xb + yl yb = 0 (the left strut stands across the line of the wheels; depends on time) and
    (xl - xr)^2 + (yl - yr)^2 - L^2 = 0.

    The published equations, k v_dot = ... with k = M eps^2/2, are obtained as they are, k being the mass of each end; the
    published multipliers count the other way round: they are -lam.

    Parameters: M mass (kg) and eps (1), which together give k; L length of the axis (m), L0 (m), r amplitude (m) and w
    frequency (rad/s) of the road, g (m/s^2, along -y).
    Source: Mazzia and Magherini, Test Set for Initial Value Problem Solvers, release 2.4.
    """
    xl, yl, xr, yr = coordinates("xl yl xr yr")
    M, eps, L, L0, r, w, g = parameters("M eps L L0 r w g")
    k = M * eps**2 / 2
    system = System("car_axis", gravity=[0, -g])
    wheel, left, right = system.add_body("wheel"), system.add_body("left", mass=k), system.add_body("right", mass=k)
    yb = r * sp.sin(w * time)
    xb = sp.sqrt(L**2 - yb**2)
    system.add_joint(Planar("road", system.ground, wheel, [xb, yb, 0]))
    system.add_joint(Custom("left", system.ground, left, [xl, yl], position=[xl, yl, 0], units=("m", "m")))
    system.add_joint(Custom("right", system.ground, right, [xr, yr], position=[xr, yr, 0], units=("m", "m")))
    system.add_spring_damper(system.ground, left, stiffness=1, length=L0, name="left spring")
    system.add_spring_damper(wheel, right, stiffness=1, length=L0, name="right spring")
    system.add_constraint(xl * xb + yl * yb, name="strut")
    system.add_constraint((xl - xr)**2 + (yl - yr)**2 - L**2, name="axis")
    system.draw(left, shapes.Line([(0, 0)], 4.0, to=(right, (0, 0))), color="0.45")
    system.defaults = {M: 10.0, eps: 1e-2, L: 1.0, L0: 0.5, r: 0.1, w: 10.0, g: 1.0}
    system.initial = {yl: 0.5, xr: 1.0, yr: 0.5, xl.dot: -0.5, xr.dot: -0.5}
    system.duration = 3.0
    system.units = {M: "kg", eps: "1", L: "m", r: "m", w: "rad/s"}
    return system
