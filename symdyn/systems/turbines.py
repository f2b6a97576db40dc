"""The NREL 5-MW wind turbine on the ITI Energy barge, and on land."""

from __future__ import annotations

import math
from collections.abc import Hashable
from typing import Any

from symdyn.errors import ModelError
from symdyn.model.symbols import parameters
from symdyn.model.system import System
from symdyn.systems import nrel_5mw as nrel
from symdyn.systems import turbine_loads as loads
from symdyn.systems.turbine_parts import add_machine, add_platform, add_tower

_ON_OFF = (True, False)
# The first of each is the usual one.
_CHOICES: dict[str, tuple[Any, ...]] = {
    "rotor": ("free", "fixed", "prescribed"), "blades": ("three", "lumped"), "orientation": ("angles", "parameters"),
    "hydrostatics": ("box", "linear", None), "mooring": ("catenary", "linear", None), "added_mass": _ON_OFF, "damping": _ON_OFF,
    "wind": _ON_OFF, "waves": (False, True), "drives": _ON_OFF, "ballast": (False, True),
    "flexible": (False, True, "tower", "blades"),
}
# Where the rigid turbine floats in equilibrium without wind, in the order x, y, z, psi, theta, phi (m, rad).
_EQUILIBRIUM: dict[tuple[str | None, str | None], tuple[float, ...]] = {
    ("box", "catenary"): (0.011502173126154161, 1.5576336412207125e-06, -0.13596206624570376, 0.0001932572718469445,
                          -0.0008785395737926231, -1.6046255160831032e-13),
    ("box", "linear"): (0.011490132385791987, 2.8004695169524514e-06, -0.1360083949346928, 0.00019256307468639298,
                        -0.0008785061337718347, -1.2987694274347353e-09),
    ("box", None): (0.0, 0.0, 0.00035090847841940954, 0.0, -0.000891563830578336, 0.0),
    ("linear", "catenary"): (0.011503168822156403, 1.5577684469327292e-06, -0.1359621186307816, 0.00019325727189833434,
                             -0.0008786156250619727, -1.6048800714426549e-13),
    ("linear", "linear"): (0.011491127672468082, 2.8007106303076186e-06, -0.13600844733178535, 0.00019256307447004336,
                           -0.0008785822308453929, -1.2989940220021925e-09),
    ("linear", None): (0.0, 0.0, 0.0003509086178860946, 0.0, -0.0008915641568086628, 0.0),
}


def floating_wind_turbine(rotor: str = "free", blades: str = "three", orientation: str = "angles",
                          hydrostatics: str | None = "box", mooring: str | None = "catenary", added_mass: bool = True,
                          damping: bool = True, wind: bool = True, waves: bool = False, drives: bool = True,
                          ballast: bool = False, flexible: bool | str = False) -> System:
    """The NREL 5-MW turbine on the ITI Energy barge: platform, tower, nacelle, hub and three blades.

    The n-frame has z upward and its origin in the still water plane, x downwind. Body frames, with origin O, and G the centre of
    mass in them; at q = 0 those of platform, tower and nacelle are parallel to the n-frame:

        platform   O in the water plane, G at (0, 0, z_P)
        tower      O at its foot, which is at the platform's O; G at (0, 0, z_T)
        nacelle    O on the tower's top; turns about z by yaw (rad); G at (x_N, 0, z_N)
        hub        O and G at the rotor's apex; x along the shaft, downwind; turns about it by azimuth (rad)
        blade1..3  O at the root; z along the blade, 120 degrees apart about the shaft and tilted by the cone; G at (0, 0, z_B)

    q = [x, y, z (m, of the platform's O), psi, theta, phi (rad, its Euler angles ZYX), yaw, azimuth]. Platform and tower, hub and
    blades are joined by fixed joints, tower and nacelle, nacelle and hub by revolute joints.

    rotor         "free": azimuth is a coordinate; "fixed": there is none, blade 1 points up; "prescribed": azimuth = Omega t
    blades        "three": each a body; "lumped": one body "rotor" in place of hub and blades, with their mass and inertia
    orientation   "angles": as above; "parameters": Euler parameters e0, e1, e2, e3, with the speeds v_x, v_y, v_z (m/s) of O and
                  omega_x, omega_y, omega_z (rad/s), all in the platform's axes, which have no singular attitude
    hydrostatics  "box": the hull's box less its moonpool, at any draft and attitude; "linear": by its restoring matrix; None
    mooring       "catenary": eight lines; "linear": their stiffness matrix and pretension; None
    added_mass, damping   of the barge, linear and assumed: no published check is at hand
    wind          thrust rho_a/2 pi R^2 C_T |v_r| v_r along the shaft, v_r the wind along it as the apex sees it, and drag of
                  tower and nacelle; input v_w (m/s), the wind along x. Given functions, for less than the rated wind
    waves         force of a regular wave along x, of 1 m and 10 s, that grows within T_0 (s)
    drives        a yaw drive, spring K_y and damper B_y on the way to the input yaw_c (rad); inputs tau_a (N m), torque of the
                  wind on the hub, and tau_g (N m), torque of the generator between hub and nacelle, which brakes
    ballast       water that is moved in the hull: m_x (kg) by l_b (m) along x and m_y along y move its G to
                  (m_x l_b/m_P, m_y l_b/m_P, z_P); none at first
    flexible      "tower": it bends in its own lowest modes, tower_fa1, tower_fa2 along x, tower_ss1, tower_ss2 along y (m);
                  "blades": each bends in its three lowest modes, blade1_flap1, blade1_edge1, blade1_flap2, ... ; True: both.
                  Stiffness and damping are multiplied by s_T, d_T and s_B, d_B. In q those of the tower stand before yaw, those
                  of the blades are the last. The drag of the tower acts on its foot, as if it were straight, and does not
                  bend it

    It starts at rest in equilibrium without wind, rigid. Outputs: tower_top (m), nacelle_velocity (m/s), tower_top_acceleration
    (m/s^2) (n-frame), platform_pitch_deg (its Euler angle theta, degrees).
    Parameters: g (m/s^2, along -z); of the bodies m_P, m_T, m_N, m_H, m_B mass (kg), of one blade; the places of G above (m);
    inertia about G (kg m^2): I_P_x, I_P_y, I_P_z, I_T across the tower, I_N about z, I_H about the shaft, I_B across a blade;
    h_T height of the tower, h_S of the shaft on it, l_S overhang along the shaft, r_R from apex to root (m), tilt and cone (rad).
    Moments of inertia that are not documented are zero and have no parameter. The generator's inertia is left out.
    Sources of the numbers, and what is assumed: symdyn/systems/nrel_5mw.py. Bodies, joints, coordinates: lecture, chapter 6.
    """
    options = {"rotor": rotor, "blades": blades, "orientation": orientation, "hydrostatics": hydrostatics, "mooring": mooring,
               "added_mass": added_mass, "damping": damping, "wind": wind, "waves": waves, "drives": drives, "ballast": ballast,
               "flexible": flexible}
    system = _system("floating_wind_turbine", options)
    platform = add_platform(system, orientation, ballast, waves)
    tower, top, at = add_tower(system, platform, flexible in (True, "tower"))
    nacelle, hub = add_machine(system, top, at, rotor, blades, flexible in (True, "blades"))
    if drives:
        loads.add_drives(system, rotor, hub)
    if hydrostatics:
        loads.add_hydrostatics(system, platform, hydrostatics)
    if mooring:
        loads.add_mooring(system, platform, mooring)
    if added_mass:
        loads.add_added_mass(system, platform)
    if damping:
        loads.add_damping(system, platform)
    if wind:
        loads.add_wind(system, tower, nacelle, hub)
    if waves:
        loads.add_waves(system, platform)
    system.initial = _initial(_EQUILIBRIUM.get((hydrostatics, mooring), (0.0,) * 6), orientation)
    system.duration = 600.0
    return system


def land_wind_turbine(rotor: str = "free", blades: str = "three", wind: bool = True, drives: bool = True,
                      flexible: bool | str = True) -> System:
    """The NREL 5-MW turbine on land: tower, nacelle, hub and three blades of `floating_wind_turbine`, the foot on the ground.

    The n-frame has z upward and its origin at the foot of the tower, x downwind. q = [the elastic coordinates of the tower, yaw,
    azimuth, the elastic coordinates of the blades], as far as it has them. Options, inputs, outputs, parameters and sources
    as there. It starts at rest, straight.
    """
    options = {"rotor": rotor, "blades": blades, "wind": wind, "drives": drives, "flexible": flexible}
    system = _system("land_wind_turbine", options)
    tower, top, at = add_tower(system, system.ground, flexible in (True, "tower"))
    nacelle, hub = add_machine(system, top, at, rotor, blades, flexible in (True, "blades"))
    if drives:
        loads.add_drives(system, rotor, hub)
    if wind:
        loads.add_wind(system, tower, nacelle, hub)
    system.duration = 60.0
    return system


def _system(name: str, options: dict[str, Any]) -> System:
    """An empty system with gravity, named after its variant. Raises ModelError for options that there are not."""
    faults = [f"{name} has no {option} {value!r}; pass {' or '.join(map(repr, _CHOICES[option]))}"
              for option, value in options.items() if not isinstance(value, Hashable) or value not in _CHOICES[option]]
    if not faults and options["flexible"] in (True, "blades") and options["blades"] == "lumped":
        faults.append(f"{name}: blades are lumped, but flexible is {options['flexible']!r}; pass blades='three' or "
                      "flexible='tower'")
    if faults:
        raise ModelError(faults)
    unusual = {option: value for option, value in options.items() if value != _CHOICES[option][0]}
    parts = [f"{option}_{value}" if value else f"no_{option}" for option, value in unusual.items()]
    g = parameters("g")
    system = System("_".join([name, *parts]).replace("_True", ""), gravity=[0, 0, -g])
    system.defaults = {g: nrel.GRAVITY}
    return system


def _initial(place: tuple[float, ...], orientation: str) -> dict[Any, float]:
    """Start values by name for a place of the platform."""
    if orientation == "angles":
        return dict(zip(("x", "y", "z", "psi", "theta", "phi"), place, strict=True))
    half = [angle / 2 for angle in place[3:]]
    (c3, c2, c1), (s3, s2, s1) = [math.cos(a) for a in half], [math.sin(a) for a in half]
    e = (c1 * c2 * c3 + s1 * s2 * s3, s1 * c2 * c3 - c1 * s2 * s3, c1 * s2 * c3 + s1 * c2 * s3, c1 * c2 * s3 - s1 * s2 * c3)
    return dict(zip(("x", "y", "z", "e0", "e1", "e2", "e3"), (*place[:3], *e), strict=True))
