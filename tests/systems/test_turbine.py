"""The floating wind turbine: its numbers against published sums, its variants and formulations against each other, its motion."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import symdyn as sd
from symdyn.errors import NoEquilibrium
from symdyn.lab.turbine import (
    BARE,
    States,
    beam_numbers,
    decay_period,
    formulations,
    leading,
    random_states,
    series,
    tumbling,
    turbine,
    values,
)
from symdyn.systems import nrel_5mw as nrel
from symdyn.systems import nrel_5mw_tower
from symdyn.systems.turbine_parts import BLADE_MODES, TOWER_MODES

RIGID = {"drives": False, "mooring": None, "wind": False}
# Published: total mass of barge and turbine, mass of the rotor and its inertia about the shaft (OpenFAST's summary), hub height.
TOTAL, ROTOR, ROTOR_INERTIA, HUB_HEIGHT = 6_149_460.477, 110_000.245, 38_759_227.492, 90.0


def numbers(system: sd.System) -> dict[str, float]:
    return {p.name: float(v) for p, v in system.check().defaults.items()}


@pytest.fixture(scope="module")
def moored() -> Any:
    """All loads, and ballast that is not moved."""
    return turbine(ballast=True).embedding().compile()


# -- numbers


def test_masses_are_the_published_ones() -> None:
    p = numbers(turbine(**BARE))
    rotor = p["m_H"] + 3 * p["m_B"]
    assert rotor == pytest.approx(ROTOR, abs=2e-3)
    assert p["m_P"] + p["m_T"] + p["m_N"] + rotor == pytest.approx(TOTAL, abs=2e-3)


def test_tower_has_the_moments_of_its_table() -> None:
    data = nrel_5mw_tower.ONSHORE
    x, w = np.polynomial.legendre.leggauss(2)  # exact for the linear density times z^2
    z = np.array(data.stations) * data.length
    half, middle = np.diff(z)[:, None] / 2, (z[1:, None] + z[:-1, None]) / 2
    at = middle + half * x
    density = np.interp(at, z, data.mass_per_length) * half * w
    mass, first, second = (float((density * at**k).sum()) for k in range(3))
    assert pytest.approx(
        [mass, first / mass, second - first**2 / mass], rel=1e-8) == [nrel.TOWER_MASS, nrel.TOWER_COM, nrel.TOWER_INERTIA]


def test_rotor_inertia_and_hub_height_are_the_published_ones() -> None:
    equations = turbine(**BARE).embedding()
    found = values(equations, States(np.array([[0.0] * 7 + [np.pi]]), np.zeros((1, 8))), "M_tilde", "frames")
    assert found["M_tilde"][0, 7, 7] == pytest.approx(ROTOR_INERTIA, rel=1e-8)
    hub = found["frames"][0, 3]
    assert hub[2] == pytest.approx(HUB_HEIGHT, abs=2e-3) and hub[0] < -4.9  # upwind of the tower
    shaft, blade = hub[3:].reshape(3, 3)[:, 0], found["frames"][0, 4, 3:].reshape(3, 3)[:, 2]
    assert shaft == pytest.approx([np.cos(nrel.TILT), 0, np.sin(nrel.TILT)], rel=1e-14)
    assert np.degrees(np.arctan2(-blade[0], -blade[2])) == pytest.approx(7.5)  # the lowest blade is kept off the tower by both


def test_wave_force_is_the_pressure_on_the_hull() -> None:
    """By summing the pressure of the wave over the wet faces of the box, at two instants."""
    (F, phase), omega, side, draft = nrel.wave_excitation(), nrel.WAVE_FREQUENCY, 40.0, 4.0
    k, (x, w) = omega**2 / nrel.GRAVITY, np.polynomial.legendre.leggauss(12)
    along, down = side / 2 * x, draft / 2 * (x - 1)

    def pressure(at: Any, z: Any, turn: float) -> Any:
        return nrel.WATER_DENSITY * nrel.GRAVITY * np.exp(k * z) * np.cos(turn - k * at)

    for turn in (0.0, 0.7):
        bottom = pressure(along, -draft, turn) * side * side / 2 * w
        ends = (pressure(-side / 2, down, turn) - pressure(side / 2, down, turn)) * side * draft / 2 * w
        wanted = [ends.sum(), bottom.sum(), (down * ends).sum() - (along * bottom).sum()]
        assert [F[j] * np.cos(turn + phase[j]) for j in (0, 2, 4)] == pytest.approx(wanted, rel=1e-12, abs=1e-6)


# -- variants


@pytest.mark.parametrize("options", [{"hydrostatics": h, "mooring": m, "orientation": o} for h, m, o in (
    ("box", "catenary", "parameters"), ("box", "linear", "angles"), ("box", None, "parameters"), ("linear", "catenary", "angles"),
    ("linear", "linear", "angles"), ("linear", None, "angles"))], ids=lambda o: "-".join(map(str, o.values())))
def test_every_variant_starts_in_equilibrium(options: dict[str, Any]) -> None:
    equations = turbine(**options, rotor="fixed").embedding()
    s = equations.symbols
    start = States(np.array([[s.initial.get(q, 0.0) for q in s.coordinates]]), np.zeros((1, len(s.speeds))))
    assert np.abs(values(equations, start, "accelerations")["accelerations"]).max() < 1e-9


def test_lumped_blades_move_as_three() -> None:
    states = random_states(20, 1)
    three, lumped = (values(turbine(**BARE | {"blades": blades}).embedding(), states, "accelerations")["accelerations"]
                     for blades in ("three", "lumped"))
    assert np.abs(three - lumped).max() < 1e-12 * np.abs(three).max()


@pytest.mark.parametrize("rotor", ["fixed", "prescribed"])
def test_a_rotor_without_freedom_is_a_free_one_that_is_held(rotor: str) -> None:
    """The first seven of its equations, at the azimuth zero and the same, constant speed."""
    states = random_states(20, 2)
    states.q[:, 7], states.u[:, 7] = 0.0, 0.0 if rotor == "fixed" else nrel.RATED_SPEED
    free = values(turbine(**BARE).embedding(), states, "M_tilde", "k_tilde", "F_tilde")
    wanted = np.linalg.solve(free["M_tilde"][:, :7, :7], (free["F_tilde"] - free["k_tilde"])[:, :7, None])[..., 0]
    held = turbine(**BARE | {"rotor": rotor}).embedding()
    found = values(held, States(states.q[:, :7], states.u[:, :7]), "accelerations")["accelerations"]
    assert np.abs(found - wanted).max() < 1e-12 * np.abs(wanted).max()


def test_flexible_turbine_that_does_not_bend_is_the_rigid_one() -> None:
    """Inertia, gyroscopic forces and loads along the rigid motions, with the mass and inertia of the beams' tables."""
    rigid, flexible = turbine(**RIGID).embedding(), turbine(**RIGID, flexible=True).embedding()
    beams = beam_numbers()
    rigid.symbols.defaults.update({p: beams[p.name] for p in rigid.symbols.parameters if p.name in beams})
    states = random_states(5, 3)
    columns = [q.name for q in flexible.symbols.coordinates]
    places = [columns.index(q.name) for q in rigid.symbols.coordinates]
    q, u = np.zeros((5, len(columns))), np.zeros((5, len(columns)))
    q[:, places], u[:, places] = states.q, states.u
    names = ("M_tilde", "k_tilde", "F_tilde")
    wanted, found = values(rigid, states, *names), values(flexible, States(q, u), *names)
    inertia = found["M_tilde"][:, places][:, :, places] - wanted["M_tilde"]
    assert np.abs(inertia).max() < 1e-13 * wanted["M_tilde"].max()
    for name in ("k_tilde", "F_tilde"):
        assert np.abs(found[name][:, places] - wanted[name]).max() < 1e-12 * np.abs(wanted[name]).max()


def test_order_of_coordinates() -> None:
    def names(system: sd.System) -> list[str]:
        return [q.name for q in system.check().coordinates]

    tower, blades = [f"tower_{mode}" for mode in TOWER_MODES], [f"blade{k}_{mode}" for k in (1, 2, 3) for mode in BLADE_MODES]
    platform = ["x", "y", "z", "psi", "theta", "phi"]
    assert names(turbine(waves=True)) == [*platform, "yaw", "azimuth"]
    assert names(turbine(flexible="tower", rotor="prescribed")) == [*platform, *tower, "yaw"]
    assert names(sd.systems.land_wind_turbine()) == [*tower, "yaw", "azimuth", *blades]


@pytest.mark.parametrize(("make", "options", "message"), [
    (sd.systems.floating_wind_turbine, {"rotor": "loose", "mooring": "chain"},
     r"has no rotor 'loose'; pass 'free' or 'fixed' or 'prescribed'(.|\n)*no mooring 'chain'"),
    (sd.systems.land_wind_turbine, {"blades": "lumped", "flexible": "blades"}, "blades are lumped, but flexible is 'blades'"),
    (sd.systems.floating_wind_turbine, {"flexible": np.array([1.0, 2.0])}, r"has no flexible array\(\[1., 2.\]\); pass False"),
    (sd.systems.floating_wind_turbine, {"flexible": ["tower"]}, r"has no flexible \['tower'\]; pass False or True"),
])
def test_options_that_there_are_not(make: Any, options: dict[str, Any], message: str) -> None:
    with pytest.raises(sd.ModelError, match=message):
        make(**options)


# -- formulations and motion


def test_three_formulations_agree() -> None:
    """With drives, wind and waves."""
    found = formulations(10, waves=True)
    assert len(found) == 5 and max(found.values()) < 1e-12


def test_gyroscopic_moment_of_a_yawing_nacelle() -> None:
    """The angular momentum I Omega along the shaft turns with the yaw rate about z, towards y. The turn takes a moment I Omega
    yaw_dot cos(tilt) about y on the rotor; the opposite one acts on the platform: its pitch becomes negative, upwind."""
    q, u = np.zeros((2, 8)), np.zeros((2, 8))
    u[:, 6], u[:, 7] = 0.01, (nrel.RATED_SPEED, -nrel.RATED_SPEED)
    k = values(turbine(**BARE).embedding(), States(q, u), "k_tilde")["k_tilde"][:, 4]
    assert (k[0] - k[1]) / 2 == pytest.approx(ROTOR_INERTIA * nrel.RATED_SPEED * 0.01 * np.cos(nrel.TILT), rel=1e-8)


def test_quasi_velocities_pass_through_a_pitch_of_90_degrees() -> None:
    error, short = tumbling(turbine(**BARE | {"orientation": "parameters"}).embedding().compile())
    assert error < 1e-10 and abs(short) < 1e-6


def test_time_series_keep_the_balance_of_energy(moored: Any) -> None:
    found = series(moored)
    assert len(found) == 5
    for name, solution in found.items():
        assert solution.success and solution.energy_error() < 1e-8, name
    yawing, start_up, step = (found[name] for name in ("yaw of the nacelle under a spinning rotor", "start-up of the rotor",
                                                       "thrust step"))
    assert yawing["theta"].mean() < yawing["theta"][0] < step["theta"][-1] and start_up["azimuth_dot"][-1] > 1


def test_the_moored_barge_floats_where_weight_and_mooring_are_carried(moored: Any) -> None:
    rest = moored.equilibrium(fixed={"azimuth": 0.0}, start={"z": 1.0, "theta": 0.2, "phi": -0.2, "x": 1.0})
    found = {name: moored.metadata.initial.get(name, 0.0) for name in moored.metadata.q}
    assert rest.q == pytest.approx(list(found.values()), abs=1e-12) and rest.stable and rest.iterations <= 25
    pull = -nrel.MOORING_FORCE[2] + nrel.MOORING_STIFFNESS[2][2] * rest["z"]
    wanted = (TOTAL * nrel.GRAVITY + pull) / (nrel.WATER_DENSITY * nrel.GRAVITY * 1500.0)
    assert 4.0 - rest["z"] == pytest.approx(wanted, abs=1e-4) and wanted == pytest.approx(4.136, abs=1e-3)
    pitch = next(mode for mode in moored.linearize(rest).modes() if leading(mode) == "theta")
    assert pitch.period == pytest.approx(12.12, abs=0.01)
    assert decay_period(moored, rest.x, pitch) == pytest.approx(pitch.period, rel=1e-3)


def test_ballast_that_keeps_it_upright_in_the_wind(moored: Any) -> None:
    """The moment of the ballast is what keeps the pitch at zero, together with the moments of wind and mooring about y."""
    found = moored.equilibrium(free=["x", "y", "z", "psi", "theta", "phi", "yaw", "m_x"], fixed={"theta": 0.0, "azimuth": 0.0},
                               inputs={"v_w": 8.0})
    assert found.stable and list(found.solved) == ["m_x"] and found.solved["m_x"] < -5e4  # upwind
    leaning = moored.equilibrium(fixed={"azimuth": 0.0}, inputs={"v_w": 8.0})
    assert leaning["theta"] > 0.01
    moved = {"m_x": found.solved["m_x"]}
    upright = moored.F_tilde(found.q, np.zeros(8), moved, inputs=[0.0, 0.0, 0.0, 8.0])
    assert np.abs(upright[[0, 2, 4]]).max() < 1e-3
    without = moored.F_tilde(found.q, np.zeros(8), inputs=[0.0, 0.0, 0.0, 8.0])
    assert without[4] - upright[4] == pytest.approx(-found.solved["m_x"] * nrel.BALLAST_WAY * nrel.GRAVITY, rel=1e-6)


@pytest.mark.parametrize("wind", [0.0, 1.0, 4.0, 6.0, 8.0, 10.0, 11.0])
def test_two_ballasts_keep_pitch_and_roll_at_zero(moored: Any, wind: float) -> None:
    """Without wind nothing is to be balanced in roll; the conditions may be named, or follow from what the ballasts act on."""
    fixed = {"theta": 0.0, "phi": 0.0, "azimuth": 0.0}
    free = ["x", "y", "z", "psi", "theta", "phi", "yaw", "m_x", "m_y"]
    found = moored.equilibrium(free=free, fixed=fixed, inputs={"v_w": wind})
    assert found.residual_norm < 1e-6 and found["theta"] == found["phi"] == 0.0
    left = moored.F_tilde(found.q, np.zeros(8), found.params, inputs=[0.0, 0.0, 0.0, wind])
    assert np.abs(left[:7]).max() < 1e-6 and (abs(found["m_y"]) < 1e-9) == (wind == 0.0)
    told = moored.equilibrium(unknown_params=["m_x", "m_y"], fixed=fixed, inputs={"v_w": wind}, start={"x": 5.0})
    assert told.selection.conditions == ("theta", "phi") and told.params == pytest.approx(found.params, rel=1e-9, abs=1e-9)


def test_no_equilibrium_at_gimbal_lock(moored: Any) -> None:
    with pytest.raises(NoEquilibrium, match="at gimbal lock: theta = 90 deg"):
        moored.equilibrium(fixed={"azimuth": 0.0}, start={"z": -30.0, "theta": 2.5, "phi": 1.0})


def test_shapes_of_the_freely_turning_rotor_and_the_others_solve_the_equations(moored: Any) -> None:
    """(lambda^2 M + lambda C + K) v = 0 at a state, no rotor held; each mode is named by what moves."""
    lin = moored.linearize(moored.equilibrium(fixed={"azimuth": 0.0}).x)
    names = [mode.name for mode in lin.modes()]
    assert sorted(names) == ["azimuth", "phi", "psi", "theta", "x", "y", "yaw", "z"]
    for mode in lin.modes():
        value, v = mode.eigenvalue, mode.right[:8]
        terms = np.array([value**2 * lin.M, value * lin.C, lin.K])
        size = (np.abs(terms).sum(axis=0) @ np.abs(v)).max() if mode.kind != "zero" else 1e-3
        assert np.abs(terms.sum(axis=0) @ v).max() < 1e-7 * size, mode.name
