"""Loads on the NREL 5-MW turbine: drives, water, mooring, wind and waves; see symdyn.systems.turbines."""

from __future__ import annotations

import sympy as sp

from symdyn.model.bodies import Body
from symdyn.model.elements import AddedMass, Box, Buoyancy, Drag, LinearDamping, LinearStiffness, Thrust, WaveExcitation
from symdyn.model.shapes import Water
from symdyn.model.symbols import coordinates, inputs, parameters
from symdyn.model.system import System
from symdyn.systems import nrel_5mw as nrel
from symdyn.systems.barge_mooring import barge_mooring
from symdyn.systems.turbine_parts import given


def add_drives(system: System, rotor: str, hub: Body) -> None:
    """The yaw drive; on a free rotor the torques of wind and generator."""
    yaw, command = coordinates("yaw"), inputs("yaw_c")
    K, B = given(system, K_y=nrel.YAW_STIFFNESS, B_y=nrel.YAW_DAMPING)
    system.units |= {K: "N m/rad", B: "N m s/rad", command: "rad"}
    system.add_joint_force("yaw", -K * (yaw - command) - B * yaw.dot, name="yaw drive")
    if rotor == "free":
        wind, brake = inputs("tau_a tau_g")
        system.add_torque(hub, [wind, 0, 0], frame=hub, name="torque of the wind")
        system.add_joint_force("shaft", -brake, name="generator")


def add_hydrostatics(system: System, platform: Body, how: str) -> None:
    """Buoyancy of the hull less its moonpool: exact, or by its restoring matrix."""
    g, (rho,) = parameters("g"), given(system, rho_w=nrel.WATER_DENSITY)
    L, W, D, z, L_m, W_m = given(system, L_h=nrel.HULL[0], W_h=nrel.HULL[1], D_h=nrel.HULL[2], z_h=nrel.HULL_CENTER,
                                 L_m=nrel.MOONPOOL[0], W_m=nrel.MOONPOOL[1])
    if how == "box":
        system.add_load(Buoyancy(platform, [Box((L, W, D), (0, 0, z))], rho, [Box((L_m, W_m, D), (0, 0, z))], name="buoyancy"))
        return
    draft, area = D / 2 - z, L * W - L_m * W_m
    # About O a tilt lets the plane of flotation push back and the centre of buoyancy, half the draft below O, too.
    roll, pitch = (rho * g * (second - area * draft**2 / 2)
                   for second in ((L * W**3 - L_m * W_m**3) / 12, (L**3 * W - L_m**3 * W_m) / 12))
    system.add_load(LinearStiffness(platform, [0, 0, rho * g * area, roll, pitch, 0], [0, 0, rho * g * area * draft, 0, 0, 0],
                                    name="hydrostatics"))


def add_mooring(system: System, platform: Body, how: str) -> None:
    """Eight catenary lines, or their stiffness and pretension."""
    if how == "linear":
        system.add_load(LinearStiffness(platform, nrel.MOORING_STIFFNESS, nrel.MOORING_FORCE, name="mooring"))
        return
    for line in barge_mooring(platform, gravity=parameters("g"), density=given(system, rho_w=nrel.WATER_DENSITY)[0]):
        system.add_load(line)


def add_added_mass(system: System, platform: Body) -> None:
    """Added mass of the barge, assumed."""
    system.add_load(AddedMass(platform, _six(system, "A", nrel.added_mass(), "kg", "kg m^2"), name="added mass"))


def add_damping(system: System, platform: Body) -> None:
    """Linear damping of the barge, assumed."""
    system.add_load(LinearDamping(platform, _six(system, "B", nrel.DAMPING, "N s/m", "N m s"), name="damping"))


def _six(system: System, letter: str, values: nrel.Coefficients, linear: str, angular: str) -> list[sp.Symbol]:
    symbols = given(system, **{f"{letter}_{name}": value for name, value in values._asdict().items()})
    system.units |= dict(zip(symbols, (linear,) * 3 + (angular,) * 3, strict=True))
    return symbols


def add_wind(system: System, tower: Body, nacelle: Body, hub: Body) -> None:
    """Thrust of the rotor, drag of tower and nacelle; the input v_w is the wind along x."""
    rho, R, C_T, C_t, S_t, h_t, C_n, S_n, h_n = given(
        system, rho_a=nrel.AIR_DENSITY, R=nrel.ROTOR_RADIUS, C_T=nrel.THRUST_COEFFICIENT, C_t=nrel.TOWER_DRAG[0],
        S_t=nrel.TOWER_DRAG[1], h_t=nrel.TOWER_DRAG[2], C_n=nrel.NACELLE_DRAG[0], S_n=nrel.NACELLE_DRAG[1],
        h_n=nrel.NACELLE_DRAG[2])
    v_w = inputs("v_w")
    system.units[v_w] = "m/s"
    system.add_load(Thrust(hub, lambda v: rho * sp.pi * R**2 * C_T * sp.Abs(v) * v / 2, wind=[v_w, 0, 0], name="thrust"))
    system.add_load(Drag(tower, S_t, C_t, rho, wind=[v_w, 0, 0], point=[0, 0, h_t], name="drag of the tower"))
    system.add_load(Drag(nacelle, S_n, C_n, rho, wind=[v_w, 0, 0], point=[0, 0, h_n], name="drag of the nacelle"))


def add_waves(system: System, platform: Body) -> None:
    """Force of a regular wave along x on the barge, and what it looks like."""
    amplitude, phase = nrel.wave_excitation()
    omega, ramp = given(system, omega_w=nrel.WAVE_FREQUENCY, T_0=20.0)
    forces = [given(system, **{f"F_w_{name}": value})[0] if value else 0 for name, value in amplitude._asdict().items()]
    phases = [sp.pi / 2 if value else 0 for value in phase]
    system.add_load(WaveExcitation(platform, forces, phases, omega, ramp=ramp, name="waves"))
    system.draw(system.ground, Water(nrel.SEA, waves=(nrel.WAVE_AMPLITUDE, omega, nrel.WAVE_LENGTH, 0, ramp)))
