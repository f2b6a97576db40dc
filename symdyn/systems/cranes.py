"""A floating crane."""

from __future__ import annotations

import sympy as sp

from symdyn.errors import ModelError
from symdyn.model import shapes
from symdyn.model.bodies import Body
from symdyn.model.elements import Box, Buoyancy
from symdyn.model.joints import Fixed, Free, Universal
from symdyn.model.points import position
from symdyn.model.symbols import coordinates, parameters
from symdyn.model.system import System

# The lecture's: length, breadth and draft of the hull (m), light weight and cargo (kg).
_LENGTH, _BREADTH, _DRAFT = 110.0, 45.0, 7.5
_LIGHT, _CARGO = 9.5e6, 2.608e6
_WATER = 1025.0
# The rest of what floats at this draft with the cargo.
_BALLAST = _WATER * _LENGTH * _BREADTH * _DRAFT - _LIGHT - _CARGO
_HULL = {"L": _LENGTH, "B": _BREADTH, "D": 11.0}
_LIGHTSHIP = {"m_L": _LIGHT, "z_L": 12.0, "I_L_x": _LIGHT * (0.35 * _BREADTH) ** 2, "I_L_y": _LIGHT * (0.25 * _LENGTH) ** 2,
              "I_L_z": _LIGHT * (0.25 * _LENGTH) ** 2}
_TANKS = {"m_b": _BALLAST, "m_x": 0.0, "y_b": 18.0, "z_b": 3.0}
_TIP = {"x_t": 0.0, "y_t": -32.5, "z_t": 60.0}
_LOADS: dict[str, dict[str, float]] = {
    "hook": {"m_c": _CARGO, "l_r": 40.0}, "deck": {"m_c": _CARGO, "x_d": 0.0, "y_d": 0.0, "z_d": 14.0}, "ashore": {}}

_CARGO_SIZE = (14.0, 10.0, 6.0)  # m, in pictures only
# Where it floats in equilibrium: z (m), with the cargo on the hook phi and alpha (rad).
_EQUILIBRIUM = {"hook": (-7.438481972227937, 0.12816896295396327, -0.12816896295396327), "deck": (-_DRAFT,),
                "ashore": (-_DRAFT + _CARGO / (_WATER * _LENGTH * _BREADTH),)}


def floating_crane(cargo: str = "hook") -> System:
    """A floating crane with its cargo, before and after lifting.

    The n-frame has z upward and its origin in the still water plane. The hull is a box; its frame has x forward, y to port, z
    upward, and its origin O in the middle of its bottom. q = [x, y, z (m, of O), psi, theta (trim), phi (heel, positive to
    starboard) (rad, Euler angles ZYX)]; nothing holds x, y and psi: fix them in an equilibrium. Ballast is solid, in two tanks at
    (0, +-y_b, z_b): m_x more than half of m_b in the port one, m_x less than half in the starboard one.

    cargo   "hook": it hangs on a rope from the boom's tip (x_t, y_t, z_t), as a point mass; alpha and beta (rad) turn the rope
            about the hull's x and then its own y, from the hull's -z; "deck": it stands on deck, with G at (x_d, y_d, z_d);
            "ashore": it is not aboard

    It starts at rest in equilibrium. Outputs: draft (m, from O to the water along the hull's z), heel_deg, trim_deg, tip (m,
    n-frame).
    Parameters: g (m/s^2), rho (kg/m^3) of water; L, B, D length, breadth, depth of the hull (m); of hull and crane m_L
    light weight (kg), z_L height of its centre of mass (m), I_L_x, I_L_y, I_L_z inertia about it (kg m^2); m_b, m_x (kg) and
    y_b, z_b (m) of the ballast; m_c mass of the cargo (kg), places as above, l_r length of the rope (m).
    The lecture gives L = 110 m, B = 45 m, the draft of 7.5 m, the light weight of 9500 Mg and the cargo of 2608 Mg. Taken here:
    it is the draft with the cargo, and the rest of the displacement is ballast. Assumed: sea water of 1025 kg/m^3; D = 11 m; the
    light weight's centre 12 m above the bottom, its radii of gyration 0.35 B and 0.25 L; the boom over the starboard side, its
    tip 32.5 m from the middle and 60 m above the bottom; the rope of 40 m; the tanks 18 m from the middle and 3 m above the
    bottom; the cargo on deck in the middle, 14 m above the bottom.
    Source: lecture, chapter 6.1.
    """
    if not isinstance(cargo, str) or cargo not in _LOADS:
        raise ModelError([f"floating_crane has no cargo {cargo!r}; pass {' or '.join(map(repr, _LOADS))}"])
    g, rho = parameters("g rho")
    system = System("floating_crane" if cargo == "hook" else f"floating_crane_{cargo}", gravity=[0, 0, -g])
    system.defaults = {g: 9.80665, rho: _WATER}
    m_L, z_L, *I = _given(system, _LIGHTSHIP)
    hull = system.add_body("hull", mass=m_L, com=[0, 0, z_L], inertia=I)
    q = coordinates("x y z psi theta phi")
    system.add_joint(Free("floating", system.ground, hull, q))
    m_b, m_x, y_b, z_b = _given(system, _TANKS)
    for name, side in (("port", 1), ("starboard", -1)):
        tank = system.add_body(f"{name} tank", mass=m_b / 2 + side * m_x)
        system.add_joint(Fixed(name, hull, tank, parent_point=[0, side * y_b, z_b]))
    _add_cargo(system, hull, cargo)
    L, B, D = _given(system, _HULL)
    system.add_load(Buoyancy(hull, boxes=[Box((L, B, D), (0, 0, D / 2))], density=rho, name="buoyancy"))
    system.draw(hull, shapes.Box((L, B, D), (0, 0, D / 2)), color="#4a6a8a")
    system.draw(system.ground, shapes.Water((180, 140)))
    z, theta, phi = q[2], q[4], q[5]
    system.add_output("draft", -z / (sp.cos(theta) * sp.cos(phi)))
    system.add_output("heel_deg", phi * 180 / sp.pi)
    system.add_output("trim_deg", theta * 180 / sp.pi)
    system.initial = dict(zip(("z", "phi", "alpha"), _EQUILIBRIUM[cargo]))
    system.units = dict.fromkeys((m_b, m_x), "kg")
    system.duration = 120.0
    return system


def _given(system: System, numbers: dict[str, float]) -> list[sp.Symbol]:
    symbols = [parameters(name) for name in numbers]
    system.defaults |= dict(zip(symbols, numbers.values(), strict=True))
    return symbols


def _add_cargo(system: System, hull: Body, cargo: str) -> None:
    tip = _given(system, _TIP)
    system.draw(hull, shapes.Cylinder((0, 0, _HULL["D"]), (0, 0, 25), 6, 4), shapes.Cylinder((0, 0, 18), tip, 1.5, 0.8),
                color="#d8a03a")
    system.add_output("tip", position(hull, tuple(tip)))
    numbers = _given(system, _LOADS[cargo])
    if cargo == "hook":
        mass, rope = numbers
        load = system.add_body("cargo", mass=mass, com=[0, 0, -rope])
        system.draw(load, shapes.Line([(0, 0, 0), (0, 0, -rope)], 1.0), color="0.2")
        system.draw(load, shapes.Box(_CARGO_SIZE, (0, 0, -rope)), color="#7a4b8a")
        system.add_joint(Universal("rope", hull, load, coordinates("alpha beta"), axes=([1, 0, 0], [0, 1, 0]), parent_point=tip))
    elif cargo == "deck":
        mass, *place = numbers
        load = system.add_body("cargo", mass=mass)
        system.draw(load, shapes.Box(_CARGO_SIZE), color="#7a4b8a")
        system.add_joint(Fixed("lashing", hull, load, parent_point=place))
