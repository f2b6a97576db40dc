"""Flexible bodies in whole systems: against published frequencies, an independent beam model, rigid links and closed forms."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import symdyn as sd
from symdyn.lab import flexible_cases as cases
from symdyn.lab import flexible_crank as crank
from symdyn.systems.nrel_5mw_tower import ONSHORE
from tests.flexible.beam_model import Column
from tests.helpers import swept

GRAVITY = 9.80665


# -- rotating beam


@pytest.mark.parametrize(("form", "free", "speeds"), [("embedded", False, (1, 12)), *swept([("recursive", False, cases.SPEEDS)]),
                                                      ("recursive", True, (3, 12))])
def test_frequencies_of_a_rotating_beam(form, free, speeds) -> None:
    """Flap and lag of modes 1 to 3 to 1e-3; at speed 12 the squares of lag are differences of numbers nearly alike."""
    module = cases.equations(cases.rotor(7, free), form).compile(backend="numpy")
    for speed in speeds:
        np.testing.assert_allclose(cases.rotor_frequencies(module, speed), cases.published(speed), rtol=1e-3)


def test_frequencies_in_absolute_coordinates_are_the_same() -> None:
    absolute, recursive = (cases.equations(cases.rotor(2), form).compile(backend="numpy") for form in ("absolute", "recursive"))
    np.testing.assert_allclose(cases.rotor_frequencies(absolute, 3), cases.rotor_frequencies(recursive, 3), rtol=1e-9)


def test_lag_is_softer_than_flap_by_the_speed() -> None:
    flap, lag = cases.rotor_frequencies(cases.rotor(5).recursive().compile(backend="numpy"), 5.0)
    np.testing.assert_allclose(flap**2 - lag**2, 25.0, rtol=1e-8)


# -- tower


@pytest.fixture(scope="module")
def land():
    """The catalogue's turbine, and what sits on its tower."""
    system = sd.systems.land_wind_turbine(rotor="fixed", flexible="tower", wind=False, drives=False)
    return system, cases.rotor_and_nacelle(system)


@pytest.fixture(scope="module")
def elements(land):
    """Hz, first fore-aft and side-to-side, of 40 beam elements under gravity."""
    mass, center, inertia = land[1]
    column = Column(ONSHORE.length * np.array(ONSHORE.stations), np.array(ONSHORE.mass_per_length), np.array(ONSHORE.stiffness))
    tips = ((mass, center[0], center[2], inertia[1, 1]), (mass, 0.0, center[2], inertia[0, 0]))
    return np.array([column.frequencies(tip, GRAVITY)[0] for tip in tips])


def test_rotor_and_nacelle(land) -> None:
    """Published sums for slightly lighter blades: 349,582 kg, centre of mass at (-0.40774, 0, 1.96643) m from the top."""
    mass, center, inertia = land[1]
    assert mass == pytest.approx(349_582.342, rel=2e-3)
    assert center == pytest.approx([-0.40774, 0, 1.96643], abs=1e-2)
    assert inertia[1, 1] == pytest.approx(23_343_639.6, rel=1e-2)


def test_first_frequencies_of_the_tower(land, elements) -> None:
    """With modes that know of rotor and nacelle, far below 0.2 per cent; -2.4 and 0.6 per cent off the often quoted numbers."""
    head = land[1]
    np.testing.assert_allclose(elements, cases.TOWER_REFERENCE, rtol=1e-5)
    found = cases.tower_frequencies(cases.tower(cases.modes_with_head(2, *head), *head))
    np.testing.assert_allclose(found, elements, rtol=1e-5)
    np.testing.assert_allclose(found / cases.TOWER_QUOTED - 1, [-0.0244, 0.0060], atol=1e-4)


# -- spin-up


def test_spin_up_of_a_beam() -> None:
    """Two theories: rigid links with springs, and assumed modes with foreshortening; about -0.57 m as published."""
    times = np.linspace(0, 20, 201)
    links = cases.deflection(cases.spin_up_chain(20), times, 20, 1e-7)
    modes = cases.deflection(cases.spin_up(cases.spin_up_beam(3)), times)
    assert modes.min() == pytest.approx(links.min(), rel=3e-3)
    assert modes.min() == pytest.approx(-0.574, abs=1e-3)
    assert np.abs(modes - links).max() < 1e-2 * np.abs(links).max()
    assert np.abs(modes[times > 15]).max() < 5e-3


def test_without_foreshortening_the_spin_up_diverges() -> None:
    """Beyond the beam's first frequency of 3.80 rad/s, as published."""
    body = cases.unstiffened(cases.spin_up_beam(2))
    assert np.sqrt(np.linalg.eigvals(np.linalg.solve(body.Me, body.K)).min()) == pytest.approx(3.80, abs=0.02)
    assert np.abs(cases.deflection(cases.spin_up(body), np.array([0.0, 15.0]))[-1]) > 1e3


def test_flexible_rod_in_a_closed_loop() -> None:
    """Simeon's slider-crank; the reference stretches by 8e-6 m, which is missing here, and is linear in its deflection."""
    found = crank.at_the_end(crank.linear_rod(), 1e-8)
    assert found == pytest.approx(crank.REFERENCE, rel=1e-3)


# -- thrown turbine


@pytest.fixture(scope="module")
def thrown():
    """One blade, two modes of it and of the tower; Euler angles embedded, quasi-velocities recursive."""
    pairs = (cases.thrown("angles", 1, (2, 2)).embedding(), cases.thrown("parameters", 1, (2, 2)).recursive())
    return [(found, found.compile()) for found in pairs]


def test_energy_and_motion_in_two_sets_of_coordinates(thrown) -> None:
    one, other = (cases.throw(module) for _, module in thrown)
    assert max(one.energy_error(), other.energy_error()) < 1e-13
    assert cases.apart(one, other) < 1e-9
    assert np.abs(one["tower_mode_1"]).max() > 0.1  # a tenth of the tower's 4 m, with all that bends


def test_energy_balance_with_damping(thrown) -> None:
    solution = cases.throw(thrown[1][1], params={"delta": 2.0})
    assert solution.energy_error() < 1e-12
    assert solution.work[-1] < -0.5 and (np.diff(solution.work) < 0).all()


def test_momentum_and_angular_momentum_are_conserved(thrown) -> None:
    """Damping is inside: without gravity nothing from outside acts."""
    module = thrown[1][1]
    found = cases.momenta(module, cases.throw(module, params={"g": 0.0, "delta": 2.0}))
    for part in (found[:, :3], found[:, 3:]):
        assert np.abs(part - part[0]).max() < 1e-10 * np.linalg.norm(part[0])


def test_identities_in_c_numpy_and_thirty_digits(thrown) -> None:
    verification = thrown[0][0].verify(states=1)
    assert verification.passed
    compared = [c for c in verification.checks if "agrees with the tape" in c.name and c.residual is not None]
    assert len(compared) == 2


def test_formulations_agree() -> None:
    errors = cases.agreement(cases.thrown("angles", 1, (2, 1)), cases.thrown("parameters", 1, (2, 1)), 10)
    assert len(errors) == 5 and max(errors.values()) < 1e-12


# -- closed forms and limits


def in_both(count: int) -> list[sd.Shape]:
    return cases.powers("x", count) + cases.powers("y", count)


@pytest.mark.parametrize(("form", "tilt"), [("embedded", 0.5), ("recursive", 2.5)])
def test_static_deflection_at_a_tilted_clamp(form, tilt) -> None:
    """P L^3 / 3 EI + w L^4 / 8 EI, which cubic and quartic shapes have exactly; the load along the beam adds a part that grows
    with it."""
    system = cases.column(in_both(3), 1.0, ([2.0, 2.0], [3.0, 3.0]), tilt)
    module = cases.equations(system, form).compile(backend="numpy")
    beam, names = cases.beam_of(system), [q.name for q in cases.elastic_joint(system).coordinates]
    off = []
    for g in (1e-4, 1e-5):
        across = g * np.sin(tilt)
        for m in (1e-9, 0.7):
            at = module.equilibrium(params={"g": g, "m": m})
            found = beam.Psi_tip @ [at[name] for name in names]
            off.append(found[0] / (across * m / (3 * 2) + across / (8 * 2)) - 1)
            assert abs(found[1]) < 1e-12 * found[0]
    assert np.abs(off[2:]).max() < 1e-5
    np.testing.assert_allclose(np.divide(off[:2], off[2:]), 10, rtol=1e-3)
    assert np.sign(off[0]) == np.sign(np.cos(tilt))


def test_a_load_across_the_beam_adds_nothing_of_first_order() -> None:
    system = cases.column(in_both(3), 1.0, 2.0, np.pi / 2)
    at = system.recursive().compile(backend="numpy").equilibrium(params={"g": 1e-3, "m": 0.7})
    names = [q.name for q in cases.elastic_joint(system).coordinates]
    assert (cases.beam_of(system).Psi_tip @ [at[n] for n in names])[0] == pytest.approx(1e-3 * (0.7 / 6 + 1 / 16), rel=1e-6)


def test_reaction_at_the_clamp() -> None:
    """Force and moment are the rates of momentum and of angular momentum about the clamp, by differences, less the weights'."""
    tilt, mass = 0.3, 0.5
    system = cases.column(cases.powers("x", 3) + cases.powers("y", 2), 1.0, 200.0, tilt)
    module, beam = system.recursive().compile(backend="numpy"), cases.beam_of(system)
    step, q = 1e-4, module.metadata.q
    solution = module.simulate(t=step * np.arange(5), q={q[0]: 0.05, q[3]: 0.03}, u={f"{q[0]}_dot": 1.0, f"{q[4]}_dot": -2.0},
                               params={"g": GRAVITY, "m": mass}, rtol=1e-12, atol=1e-14)
    moments, turning = [], []
    for eta, eta_dot in zip(solution.q, solution.u, strict=True):
        tip = beam.e * (beam.length - eta @ beam.S_tip @ eta / 2) + beam.Psi_tip @ eta
        velocity = beam.Psi_tip @ eta_dot - beam.e * (eta @ beam.S_tip @ eta_dot)
        moments.append(beam.h(eta) + mass * tip)
        turning.append(beam.Cr(eta) @ eta_dot + mass * np.cross(tip, velocity))
    R = Rotation.from_euler("y", tilt)
    force = R.apply(np.array([-1, 16, -30, 16, -1]) @ moments / (12 * step**2)) + [0, 0, GRAVITY * (1 + mass)]
    moment = R.apply(np.array([1, -8, 0, 8, -1]) @ turning / (12 * step)) + np.cross(R.apply(moments[2]), [0, 0, GRAVITY])
    np.testing.assert_allclose(solution.reaction("clamp")[2], [*force, *moment], rtol=1e-4)


def test_buckling_load() -> None:
    """pi^2 EI / 4 L^2, where the first frequency vanishes; the beam itself is light."""
    module = cases.column(cases.powers("x", 4), 1e-5, 1.0).embedding().compile(backend="numpy")
    critical = cases.buckling_load(module, 1, 4)
    assert critical == pytest.approx(np.pi**2 / 4, rel=1e-5)
    first = [module.linearize(params={"m": critical * f}).modes()[0] for f in (0.9, 0.99, 1.01)]
    assert [mode.kind for mode in first] == ["oscillation", "oscillation", "unstable"]
    assert (first[0].omega / first[1].omega) ** 2 == pytest.approx(10, rel=0.2)


def test_stiff_bodies_are_rigid() -> None:
    """Differences go as 1 / stiffness: of where a hanging mast with a load on it swings, and of how often."""
    factors = np.array([1e1, 1e2, 1e4])

    def pendulum(rigid: bool) -> sd.System:
        kappa = sd.parameters("kappa")
        system = sd.System("pendulum", gravity=[0, 0, -GRAVITY])
        beam = sd.Beam([0, 1, 2], [1.0, 0.8, 0.5], [90.0, 70.0, 40.0], in_both(2))
        if rigid:
            body = beam.modal
            across = float(body.I0[0, 0] - body.h0[2] ** 2 / body.m)
            root = system.add_body("beam", mass=body.m, com=(body.h0 / body.m).tolist(), inertia=[across, across, 1e-3])
            tip, at = root, (0, 0, 2)
        else:
            parts = system.add_flexible_body("beam", beam, stiffness=kappa)
            root, tip, at = parts.root, parts.tip, (0, 0, 0)
            system.set_defaults({kappa: 1.0})
        system.add_joint(sd.Revolute("pivot", system.ground, root, sd.coordinates("swing"), axis=[0, 1, 0],
                                     parent_rotation=np.diag([1.0, -1.0, -1.0]).tolist()))
        load = system.add_body("load", mass=1.0, inertia=[0.1, 0.1, 0.1], com=[0.1, 0, 0.1])
        system.add_joint(sd.Fixed("seat", tip, load, parent_point=at))
        return system

    stiff, rigid = (pendulum(kind).embedding().compile(backend="numpy") for kind in (False, True))
    at = rigid.equilibrium()
    wanted = [at["swing"], rigid.linearize(at).modes()[0].frequency]
    off = []
    for kappa in factors:
        at = stiff.equilibrium(params={"kappa": kappa})
        off.append([at["swing"], stiff.linearize(at).modes()[0].frequency])
    off = np.abs(np.array(off) - wanted)
    np.testing.assert_allclose(off[:-1] / off[1:], np.outer(factors[1:] / factors[:-1], [1, 1]), rtol=0.02)
    assert off[-1].max() < 1e-4


def test_floating_turbine_rests_with_its_tower_bent() -> None:
    """Equilibrium of water and structure at once; the top is where the rigid top is but for what bends, as 1 / stiffness."""
    options = {"flexible": "tower", "rotor": "fixed", "blades": "lumped", "wind": False, "mooring": "linear"}
    system = sd.systems.floating_wind_turbine(**options)
    module = system.recursive().compile(backend="numpy")
    soft, stiff, stiffer = (module.equilibrium(params={"s_T": k}) for k in (1.0, 1e3, 1e5))
    assert -0.03 < soft["tower_fa1"] < -0.01 and abs(soft["tower_ss1"]) < 1e-6
    assert soft["tower_fa1"] / stiff["tower_fa1"] == pytest.approx(1e3, rel=0.05)
    assert stiff["tower_fa1"] / stiffer["tower_fa1"] == pytest.approx(100, rel=1e-3)
    assert soft["theta"] < stiff["theta"]  # it leans further upwind
    names = [mode.name for mode in module.linearize(soft).modes()]
    assert any(name.startswith("tower_fa1") for name in names) and any(name.startswith("tower_ss1") for name in names)


def test_absolute_coordinates_of_a_lamp_on_a_ship() -> None:
    """A body that is light compared with another has mass, and nothing is rejected."""
    system = sd.System("ship", gravity=[0, 0, -GRAVITY])
    ship = system.add_body("ship", mass=1e7, inertia=[1e9, 1e9, 1e9])
    system.add_joint(sd.Free("sea", system.ground, ship))
    lamp = system.add_body("lamp", mass=0.5, inertia=[0.01, 0.01, 0.01], com=[0.1, 0, -1])
    system.add_joint(sd.Revolute("hinge", ship, lamp, axis=[0, 1, 0], parent_point=[1, 2, 20]))
    assert len(system.augmented("absolute").symbols.speeds) == 12


def test_a_free_end_that_carries_nothing() -> None:
    """The mass matrix is the same whether or not something could sit there."""
    matrices = []
    for carries in (True, False):
        system = sd.System("clamped", gravity=[0, 0, 0])
        beam = system.add_flexible_body("beam", sd.Beam([0, 1], 1.0, 1.0, in_both(2)), carries=carries)
        system.add_joint(sd.Fixed("clamp", system.ground, beam.root))
        matrices.append(system.embedding().compile(backend="numpy").mass_matrix([0.1, -0.05, 0.02, 0.03]))
    np.testing.assert_allclose(matrices[0], matrices[1], rtol=1e-14)


FACTORS = {"no stiffness": ({"stiffness": 0}, "stiffness is 0; pass a number above 0"),
           "negative stiffness": ({"stiffness": -1}, "stiffness is -1; pass a number above 0"),
           "negative damping": ({"damping": -0.5}, "damping is -0.5; pass a number that is not below 0"),
           "carries": ({"carries": "no"}, "carries is 'no'; pass True or False")}


@pytest.mark.parametrize("name", FACTORS)
def test_what_a_flexible_body_cannot_have(name: str) -> None:
    options, message = FACTORS[name]
    system = sd.System("clamped", gravity=[0, 0, 0])
    beam = system.add_flexible_body("beam", sd.Beam([0, 1], 1.0, 1.0, in_both(1)), **options)
    system.add_joint(sd.Fixed("clamp", system.ground, beam.root))
    with pytest.raises(sd.ModelError, match=f"joint 'beam_bends': {message}"):
        system.check()


def test_a_free_end_that_does_not_follow_carries_nothing() -> None:
    system = sd.System("clamped", gravity=[0, 0, 0])
    beam = system.add_flexible_body("beam", sd.Beam([0, 1], 1.0, 1.0, in_both(1)), carries=False)
    system.add_joint(sd.Fixed("clamp", system.ground, beam.root))
    load = system.add_body("load", mass=1, inertia=[1, 1, 1])
    system.add_joint(sd.Fixed("seat", beam.tip, load))
    system.add_force("beam_tip", [1, 0, 0])
    system.add_output("end", sd.position(beam.tip))
    expected = (r"(?s)joint 'seat': parent is 'beam_tip', the free end .* carries=False.*force_1: body is 'beam_tip'.*"
                r"output 'end': body is 'beam_tip'")
    with pytest.raises(sd.ModelError, match=expected):
        system.check()
