"""Platform, tower, nacelle and rotor of the NREL 5-MW turbine, as bodies and joints; see symdyn.systems.turbines."""

from __future__ import annotations

from typing import Any

import numpy as np
import sympy as sp

from symdyn.flexible.beam import Beam
from symdyn.flexible.shape import Shape
from symdyn.model import shapes
from symdyn.model.bodies import Body
from symdyn.model.joints import Fixed, Free, Joint, Revolute
from symdyn.model.orientation import EulerAngles, EulerParameters
from symdyn.model.points import acceleration, position, velocity
from symdyn.model.symbols import coordinates, parameters, speeds, time
from symdyn.model.system import System
from symdyn.systems import nrel_5mw as nrel
from symdyn.systems import nrel_5mw_blade, nrel_5mw_tower

# Units of parameters by the letter that their names begin with.
_UNITS = {"m": "kg", "I": "kg m^2", **dict.fromkeys(("z", "x", "h", "l", "r", "R", "L", "W", "D"), "m"), "rho": "kg/m^3",
          "tilt": "rad", "cone": "rad", "Omega": "rad/s", "omega": "rad/s", "C": "1", "S": "m^2", "T": "s", "s": "1", "d": "1"}
TOWER_MODES = ("fa1", "fa2", "ss1", "ss2")
BLADE_MODES = ("flap1", "edge1", "flap2")


def given(system: System, **numbers: float) -> list[sp.Symbol]:
    """Parameters with their numbers, and units by their letter."""
    symbols = [parameters(name) for name in numbers]
    system.defaults |= dict(zip(symbols, numbers.values(), strict=True))
    letters = {symbol: symbol.name.partition("_")[0] for symbol in symbols}
    system.units |= {symbol: _UNITS[letter] for symbol, letter in letters.items() if letter in _UNITS}
    return symbols


def add_platform(system: System, orientation: str, ballast: bool, waves: bool) -> Body:
    """The barge, free to move, with its water, whose surface is drawn with the waves where there are some."""
    m, z, *I = given(system, m_P=nrel.PLATFORM_MASS, z_P=nrel.PLATFORM_COM, I_P_x=nrel.PLATFORM_INERTIA[0],
                     I_P_y=nrel.PLATFORM_INERTIA[1], I_P_z=nrel.PLATFORM_INERTIA[2])
    com: list[Any] = [0, 0, z]
    if ballast:
        m_x, m_y, l_x = given(system, m_x=0.0, m_y=0.0, l_b=nrel.BALLAST_WAY)
        com = [m_x * l_x / m, m_y * l_x / m, z]
    platform = system.add_body("platform", mass=m, com=com, inertia=I)
    system.draw(platform, shapes.Box(nrel.HULL, (0, 0, nrel.HULL_CENTER), nrel.MOONPOOL[:2]), color="#c8553d")
    if not waves:
        system.draw(system.ground, shapes.Water(nrel.SEA))
    joint: Joint
    if orientation == "angles":
        q = coordinates("x y z psi theta phi")
        pitch = q[4]
        joint = Free("floating", system.ground, platform, q, EulerAngles("ZYX"))
    else:
        q = coordinates("x y z e0 e1 e2 e3")
        e0, e1, e2, e3 = q[3:]
        level = sp.sqrt(4 * (e2 * e3 + e0 * e1) ** 2 + (e0**2 - e1**2 - e2**2 + e3**2) ** 2)
        pitch = sp.atan2(2 * (e0 * e2 - e1 * e3), level)  # from the last row of the rotation matrix
        joint = Free("floating", system.ground, platform, q, EulerParameters(), velocity="body",
                     speeds=speeds("v_x v_y v_z omega_x omega_y omega_z"))
    system.add_joint(joint)
    system.add_output("platform_pitch_deg", pitch * 180 / sp.pi)
    return platform


def add_tower(system: System, below: Body, flexible: bool) -> tuple[Body, Body, Any]:
    """The tower on the body below; returns the body at its foot, the body at its top, and where on it the top is."""
    if flexible:
        s, d = given(system, s_T=1.0, d_T=1.0)
        names = coordinates(" ".join(f"tower_{mode}" for mode in TOWER_MODES))
        beam = system.add_flexible_body("tower", tower_beam(), names, stiffness=s, damping=d)
        foot, top, at = beam.root, beam.tip, (0, 0, 0)
    else:
        m, z, I, h = given(system, m_T=nrel.TOWER_MASS, z_T=nrel.TOWER_COM, I_T=nrel.TOWER_INERTIA, h_T=nrel.TOWER_HEIGHT)
        foot = top = system.add_body("tower", mass=m, com=[0, 0, z], inertia=[I, I, 0])
        at = (0, 0, h)
    system.draw(foot, shapes.Cylinder((0, 0, 0), (0, 0, nrel.TOWER_HEIGHT), *nrel.TOWER_RADII), color="0.85")
    system.add_joint(Fixed("foot", below, foot))
    system.add_output("tower_top", position(top, at))
    system.add_output("tower_top_acceleration", acceleration(top, at))
    return foot, top, at


def add_machine(system: System, top: Body, at: Any, rotor: str, blades: str, flexible: bool) -> tuple[Body, Body]:
    """Nacelle and rotor at a point of the tower's top; returns the nacelle and the body that turns on its shaft."""
    m, x, z, I, h_S, l_S, tilt = given(
        system, m_N=nrel.NACELLE_MASS, x_N=nrel.NACELLE_COM[0], z_N=nrel.NACELLE_COM[1], I_N=nrel.NACELLE_YAW_INERTIA,
        h_S=nrel.SHAFT_HEIGHT, l_S=nrel.OVERHANG, tilt=nrel.TILT)
    nacelle = system.add_body("nacelle", mass=m, com=[x, 0, z], inertia=[0, 0, I])
    system.draw(nacelle, shapes.Box(nrel.NACELLE_SIZE, nrel.NACELLE_MIDDLE), color="0.75")
    system.add_joint(Revolute("yaw", top, nacelle, coordinates("yaw"), parent_point=at))
    system.add_output("nacelle_velocity", velocity(nacelle, (x, 0, z)))
    hub = _add_lumped_rotor(system) if blades == "lumped" else _add_hub(system)
    shaft: dict[str, Any] = {"parent_point": [l_S * sp.cos(tilt), 0, h_S + l_S * sp.sin(tilt)],
                             "parent_rotation": sp.rot_ccw_axis2(-tilt)}
    system.draw(hub, shapes.Cylinder((-1.5, 0, 0), (2, 0, 0), 0.8, nrel.HUB_RADIUS), color="0.6")
    if rotor == "fixed":
        system.add_joint(Fixed("shaft", nacelle, hub, **shaft))
    elif rotor == "prescribed":
        Omega, = given(system, Omega=nrel.RATED_SPEED)
        system.add_joint(Revolute("shaft", nacelle, hub, Omega * time, axis=[1, 0, 0], **shaft))
    else:
        system.add_joint(Revolute("shaft", nacelle, hub, coordinates("azimuth"), axis=[1, 0, 0], **shaft))
    if blades == "three":
        _add_blades(system, hub, flexible)
    return nacelle, hub


def _hub(system: System) -> list[sp.Symbol]:
    return given(system, m_H=nrel.HUB_MASS, I_H=nrel.HUB_INERTIA, r_R=nrel.HUB_RADIUS, cone=nrel.CONE)


def _add_hub(system: System) -> Body:
    m_H, I_H, *_ = _hub(system)
    return system.add_body("hub", mass=m_H, inertia=[I_H, 0, 0])


def _add_blades(system: System, hub: Body, flexible: bool) -> None:
    *_, r_R, cone = _hub(system)
    beam = blade_beam() if flexible else None
    for k in range(3):
        if beam is not None:
            s, d = given(system, s_B=1.0, d_B=1.0)
            names = coordinates(" ".join(f"blade{k + 1}_{mode}" for mode in BLADE_MODES))
            blade = system.add_flexible_body(f"blade{k + 1}", beam, names, stiffness=s, damping=d, carries=False).root
        else:
            m_B, z_B, I_B = _blade(system)
            blade = system.add_body(f"blade{k + 1}", mass=m_B, com=[0, 0, z_B], inertia=[I_B, I_B, 0])
        system.draw(blade, shapes.Blade((0, 0, 0), (0, 0, nrel.ROTOR_RADIUS - nrel.HUB_RADIUS), nrel.CHORDS), color="0.95")
        turned = sp.rot_ccw_axis1(2 * sp.pi * k / 3) * sp.rot_ccw_axis2(cone)
        system.add_joint(Fixed(f"root{k + 1}", hub, blade, parent_point=r_R * turned[:, 2], parent_rotation=turned))


def _blade(system: System) -> list[sp.Symbol]:
    return given(system, m_B=nrel.BLADE_MASS, z_B=nrel.BLADE_COM, I_B=nrel.BLADE_INERTIA)


def _add_lumped_rotor(system: System) -> Body:
    """Hub and three blades as one body, with its origin at the apex; alike about all axes across the shaft."""
    (m_H, I_H, r_R, cone), (m_B, z_B, I_B) = _hub(system), _blade(system)
    away, c, s = r_R + z_B, sp.cos(cone), sp.sin(cone)
    mass = m_H + 3 * m_B
    spans = [[float(e) for e in sp.rot_ccw_axis1(2 * sp.pi * k / 3) * sp.rot_ccw_axis2(nrel.CONE)[:, 2]] for k in range(3)]
    x = 3 * m_B * away * s / mass
    about_apex = 3 * (I_B + m_B * away**2)  # of the blades, if all were across one axis
    across = about_apex * (1 - c**2 / 2) - mass * x**2
    rotor = system.add_body("rotor", mass=mass, com=[x, 0, 0], inertia=[I_H + about_apex * c**2, across, across])
    for span in spans:
        root, tip = ([r * e for e in span] for r in (nrel.HUB_RADIUS, nrel.ROTOR_RADIUS))
        chord = (0, -span[2], span[1])  # about along the rotor's plane
        system.draw(rotor, shapes.Blade(root, tip, nrel.CHORDS, chord), color="0.95")
    return rotor


def published_tower_beam() -> Beam:
    """The land-based tower with its published modes, two fore and aft along x and two from side to side along y. They were fitted
    to another model: the first frequencies on land are 3.4 % and 0.9 % above those of the tower's own modes, as
    `symdyn bench flexible --only land_based` shows."""
    data = nrel_5mw_tower.ONSHORE
    directions = [("x", c) for c in data.fore_aft] + [("y", c) for c in data.side_to_side]
    shapes = [Shape(direction, c, name=mode) for (direction, c), mode in zip(directions, TOWER_MODES, strict=True)]
    return Beam(data.stations, data.mass_per_length, data.stiffness, shapes, length=data.length,
                damping_ratio=data.damping_ratio, name="tower")


def tower_beam() -> Beam:
    """The land-based tower with its own two lowest modes fore and aft, along x, and from side to side, along y, computed on land
    under the weight of nacelle and rotor."""
    data = nrel_5mw_tower.ONSHORE
    mass, com, inertia = head()
    own = published_tower_beam().modes(len(TOWER_MODES), tip_mass=mass, tip_com=com, tip_inertia=inertia,
                                       gravity=(0, 0, -nrel.GRAVITY))
    along = [[shape for shape in own if shape.along(direction)] for direction in ("x", "y")]
    shapes = [shape.named(mode) for shape, mode in zip([*along[0], *along[1]], TOWER_MODES, strict=True)]
    return Beam(data.stations, data.mass_per_length, data.stiffness, shapes, length=data.length,
                damping_ratio=data.damping_ratio, name="tower")


def head() -> tuple[float, np.ndarray, np.ndarray]:
    """Mass (kg), centre of mass from the tower's top (3,) (m), and inertia about it (3, 3) (kg m^2) of nacelle, hub and blades in
    tower axes, the same at every azimuth."""
    shaft = np.array(sp.rot_ccw_axis2(-nrel.TILT), dtype=float)
    apex = np.array([0, 0, nrel.SHAFT_HEIGHT]) + nrel.OVERHANG * shaft[:, 0]
    parts = [(nrel.NACELLE_MASS, np.array([nrel.NACELLE_COM[0], 0, nrel.NACELLE_COM[1]]),
              np.diag([0, 0, nrel.NACELLE_YAW_INERTIA])),
             (nrel.HUB_MASS, apex, shaft @ np.diag([nrel.HUB_INERTIA, 0, 0]) @ shaft.T)]
    for k in range(3):
        R = shaft @ np.array(sp.rot_ccw_axis1(2 * sp.pi * k / 3) * sp.rot_ccw_axis2(nrel.CONE), dtype=float)
        at = apex + (nrel.HUB_RADIUS + nrel.BLADE_COM) * R[:, 2]
        parts.append((nrel.BLADE_MASS, at, R @ np.diag([nrel.BLADE_INERTIA, nrel.BLADE_INERTIA, 0]) @ R.T))
    mass = sum(m for m, _, _ in parts)
    center = sum(m * at for m, at, _ in parts) / mass
    inertia = sum(I + m * ((at - center) @ (at - center) * np.eye(3) - np.outer(at - center, at - center)) for m, at, I in parts)
    return mass, np.asarray(center), np.asarray(inertia)


def blade_beam() -> Beam:
    """A blade, z from root to tip, x downwind where there is no cone, y against the way it moves as the rotor turns: its own
    three lowest modes, computed with its twist, which turns it about -z."""
    data = nrel_5mw_blade
    stations, twist, mass, flap, edge = np.array(data.TABLE).T
    return Beam(stations, mass * data.MASS_FACTOR, (flap, edge), len(BLADE_MODES), length=data.LENGTH,
                twist=-np.radians(twist), damping_ratio=data.DAMPING_RATIO, name="blade")
