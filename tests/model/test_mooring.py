"""Mooring lines on a body: published forces, the potential, what stops a run, faults."""

from __future__ import annotations

import functools
from typing import Any

import mpmath
import numpy as np
import pytest
from load_site import LeafSite, pose, tape_of

import symdyn as sd
from symdyn.systems.barge_mooring import EA, LENGTH, barge_mooring, line_weight
from symdyn.tape import Tape
from symdyn.tape.differentiate import forward
from symdyn.tape.evaluate import evaluate
from symdyn.tape.floats import evaluate_rows

PLACES = ((20, 20, -4), (386.92, 171.985, -150))
AT_REST = pose(0, x=0.0, y=0.0, z=0.0, phi=0.0, theta=0.0, psi=0.0)


def line(**given: Any) -> sd.MooringLine:
    """The first line of the barge."""
    return sd.MooringLine("barge", **{"fairlead": PLACES[0], "anchor": PLACES[1], "length": LENGTH, "weight": line_weight(),
                                      "stiffness": EA, **given})


# -- published values

# Results of MAP++ 1.20.10 for lines 1 and 2 of the barge (MAP.sum of OpenFAST's regression test 5MW_ITIBarge_DLL_WTurb_WavesIrr),
# with w = 1227.15 N/m, which is g = 9.80665 m/s^2, and C_B = 1: the force that holds the fairlead, N, and H and V.
HELD = ((-88008.141, -36454.587, 257299.002), (-36491.731, -88105.016, 257371.155))
PULLED = ((95259.486, 257299.002), (95363.202, 257371.155))


@pytest.mark.parametrize("k", [0, 1])
def test_forces_at_rest_are_those_of_map(k: int) -> None:
    assert line_weight() == pytest.approx(1227.15, abs=0.005)
    found = evaluate_rows(tape_of(barge_mooring("barge")[k]), AT_REST, 1)
    f = found["f"][0]
    np.testing.assert_allclose(f, -np.array(HELD[k]), rtol=0, atol=6e-4)
    np.testing.assert_allclose([np.hypot(f[0], f[1]), -f[2]], PULLED[k], rtol=0, atol=6e-4)
    np.testing.assert_allclose(found["n"][0], np.cross(PLACES[0], f), rtol=1e-14)


def test_what_friction_is_worth() -> None:
    rough, smooth = (evaluate_rows(tape_of(line(friction=c)), AT_REST, 1)["f"][0] for c in (1, 0))
    assert np.hypot(*smooth[:2]) / np.hypot(*rough[:2]) - 1 == pytest.approx(-1.43e-3, abs=1e-5)
    assert smooth[2] / rough[2] - 1 == pytest.approx(-3.7e-4, abs=1e-5)


# Wrench and stiffness of all lines with g = 9.81 m/s^2, C_B = 1, about the origin of the barge at rest, from central differences.
FORCE_AT_REST = [0, 0, -2059383.204726665, 0, 0, 4780.130335028749]
STIFFNESS = [[15933.40160981199, 0, 0, 51.09977639949648, 208395.6916295574, 0],
             [0, 15933.401609812026, 0, -208395.69162953921, 51.09977639222052, 0],
             [0, 0, 24957.275937175145, 0, 0, -102.26596205029637],
             [51.1331345513463, -208463.3855445031, 0, 26263843.690739945, -2390.1977678760886, 0],
             [208463.3855444938, 51.1331345513463, 0, 2390.197766944766, 26263843.690739945, 0],
             [0, 0, -102.19957455527037, 0, 0, 24751525.959514488]]


def test_all_lines_against_another_program() -> None:
    site = LeafSite()
    actions = [each.act(site) for each in barge_mooring("barge", gravity=9.81)]  # type: ignore[arg-type]
    total = sum((site.upright(a.elastic) + site.upright(a.other) for a in actions), np.zeros(6, dtype=object))
    K = np.array([forward(site.recorder, total, {leaf: -1}) for leaf in site.coordinates], dtype=object).T
    found = evaluate_rows(Tape.of(site.recorder, F=total, K=K), AT_REST, 1)
    np.testing.assert_allclose(found["F"][0], FORCE_AT_REST, rtol=1e-12, atol=1e-8)
    scale = np.sqrt(np.outer(np.diag(STIFFNESS), np.diag(STIFFNESS)))
    assert abs(found["K"][0] - STIFFNESS).max() > 0
    assert (abs(found["K"][0] - STIFFNESS) / scale).max() < 3e-6  # the error of the differences


# -- the potential

SHAPES: dict[str, dict[str, Any]] = {
    "part lies": {}, "none lies": {"length": 420.0}, "slack": {"length": 560.0}, "hangs freely": {"seabed": False},
    "anchor above": {"anchor": (200, 100, 60), "seabed": False, "length": 400.0}}


@pytest.mark.parametrize("shape", SHAPES)
@pytest.mark.parametrize("turned", [False, True])
def test_the_force_is_the_gradient_of_the_potential(shape: str, turned: bool) -> None:
    found = evaluate(tape_of(line(**SHAPES[shape]), turned), pose(3, turned), 40)
    assert max(abs(found["elastic"])) > 1e4
    assert max(abs(found["elastic"] - found["gradient"])) < mpmath.mpf(10) ** -28 * max(abs(found["elastic"]))
    assert not found["other"].any()


def test_the_potential_is_the_energy_of_lifting_and_stretching() -> None:
    """A slack line that hangs 146 m deep: half its length times its weight, less what its own weight lets it down."""
    found = evaluate_rows(tape_of(line(length=560.0)), AT_REST, 1)
    w = line_weight()
    V = -found["f"][0, 2]
    np.testing.assert_allclose(found["f"][0, :2], 0)
    assert V / w + V**2 / (2 * EA * w) == pytest.approx(146, rel=1e-12)
    assert found["potential"][0, 0] == pytest.approx(V**2 / (2 * w) + V**3 / (3 * EA * w), rel=1e-12)


def test_with_friction_it_does_work() -> None:
    c_b = sd.parameters("C_B")
    for friction, symbols in ((1, ()), (c_b, (c_b,))):
        site = LeafSite(parameters=symbols)
        action = line(friction=friction).act(site)  # type: ignore[arg-type]
        assert action.potential == 0 and not any(action.elastic[0]) and not any(action.elastic[1])
        assert all(action.other[0])


# -- in a mechanism

L, w, EA_, c_B = sd.parameters("L w EA C_B")


def buoy(friction: Any, *lines: Any) -> sd.System:
    s = sd.System("buoy", gravity=[0, 0, -9.81])
    b = s.add_body("barge", mass=6e6, inertia=[8e8, 8e8, 1.4e9])
    s.add_joint(sd.Free("joint", s.ground, b, orientation=sd.EulerAngles("ZYX")))
    for each in lines or [line(length=L, weight=w, stiffness=EA_, friction=friction, name="bow line")]:
        s.add_load(each)
    s.defaults = {p: value for p, value in ((L, LENGTH), (w, line_weight()), (EA_, EA)) if not lines}
    if friction is c_B:
        s.defaults[c_B] = 1.0
    return s


@functools.cache
def module(backend: str) -> Any:
    return buoy(c_B).recursive().compile(backend=backend)


def state(**given: float) -> np.ndarray:
    values = {**dict.fromkeys(("x", "y", "z", "psi", "theta", "phi"), 0.0), **given}
    return np.array([*values.values(), *[0.0] * 6])


def test_parameters_have_units() -> None:
    units = buoy(c_B).check().units
    assert [units[p] for p in (L, w, EA_, c_B)] == ["m", "N/m", "N", "1"]


STOPS = {
    "below the seabed": (state(z=-150.0), {}, "not above the seabed"),
    "no length": (state(), {"L": -1.0}, "the length of the line is not above zero"),
    "no weight": (state(), {"w": 0.0}, "the weight of the line is not above zero"),
    "no stiffness": (state(), {"EA": 0.0}, "the stiffness of the line is not above zero"),
    "friction that pushes": (state(), {"C_B": -1.0}, "no shape at rest was found"),
}


@pytest.mark.parametrize("name", STOPS)
def test_what_stops_a_run(name: str) -> None:
    x, given, message = STOPS[name]
    for backend in ("numpy", "c"):
        with pytest.raises(sd.EvaluationError, match=f"bow line: .*{message}"):
            module(backend).rhs(0.0, x, given)


@pytest.mark.parametrize("seabed", [True, False])
def test_a_tension_leg_is_pulled_back_by_its_tension_over_its_length(seabed: bool) -> None:
    """Straight, but for its weight: H = T_mean x / z to first order in x, none and no NaN at x = 0."""
    depth, weight = 146.0, 40.0
    leg = line(fairlead=(0, 0, -4), anchor=(0, 0, -150), length=145.8, weight=weight, seabed=seabed)
    tape = tape_of(leg)
    at = [evaluate_rows(tape, pose(0, **{**dict.fromkeys(("y", "z", "phi", "theta", "psi"), 0.0), "x": x}), 1)
          for x in (0.0, 1e-8, 1e-5, 0.1)]
    forces = np.array([found["f"][0] for found in at])
    assert not forces[0, :2].any()
    strain = (depth - 145.8) / 145.8
    np.testing.assert_allclose(-forces[0, 2], EA * strain + weight * 145.8 / 2, rtol=1e-9)
    # the cable of tension T(s) pulls back with x over the integral of ds (1 / T + 1 / EA)
    tensions = EA * strain + weight * 145.8 * (np.linspace(0, 1, 20001) - 0.5)
    compliance = 145.8 * (np.mean(1 / tensions) + 1 / EA)
    np.testing.assert_allclose(-forces[1:3, 0], np.array([1e-8, 1e-5]) / compliance, rtol=1e-4)
    np.testing.assert_allclose(-forces[3, 0], 0.1 / compliance, rtol=1e-2)
    for found in at:
        np.testing.assert_allclose(found["elastic"], found["gradient"], rtol=1e-6, atol=1e-3)


def test_a_strain_that_no_line_bears_is_reported() -> None:
    short = line(length=430.0, name="bow line")
    run = buoy(0, short).recursive().compile(backend="numpy")
    with pytest.warns(sd.SimulationWarning, match="bow line: it is stretched by") as told:
        run.simulate(t=(0, 1e-3), q=[-60, -30, 0, 0, 0, 0])
    strain = float(str(told[0].message).split("stretched by ")[1].split(" ")[0])
    f = evaluate_rows(tape_of(short), AT_REST | {"x": np.array([-60.0]), "y": np.array([-30.0])}, 1)["f"][0]
    assert strain == pytest.approx(np.linalg.norm(f) / EA, rel=1e-3)
    assert strain > 0.1 and "that part of EA of 5.89e+08 N" in str(told[0].message)


def test_energy_is_kept_without_friction() -> None:
    """A buoy on springs drifts towards the anchor until its line is slack."""
    s = buoy(0)
    s.add_load(sd.LinearStiffness("barge", [0, 0, 1.5e7, 2e9, 2e9, 1e7], force=[0, 0, 6e6 * 9.81, 0, 0, 0]))
    sol = s.recursive().compile().simulate(t=(0, 60), q=[30, 5, 1, 0.1, 0.05, 0.02], u=[3, 0, 0, 0, 0, 0], rtol=1e-10)
    assert sol.success
    distance = np.hypot(sol.q[:, 0] - 366.92, sol.q[:, 1] - 151.985)
    assert distance[0] > LENGTH - 146 + 1.5 > distance[-1] + 50
    assert abs(sol.energy - sol.energy[0]).max() < 1e-8 * sol.energy[0]


# -- faults

FAULTS: dict[str, tuple[dict[str, Any], str]] = {
    "length": ({"length": -2}, "length is -2; pass a number above 0 m"),
    "weight": ({"weight": 0}, r"weight is 0; pass a number above 0 N/m \(in water, per length\)"),
    "stiffness": ({"stiffness": -1.5}, r"stiffness is -1.5; pass a number above 0 N \(EA\)"),
    "friction": ({"friction": -1}, "friction is -1; pass a number that is not below 0"),
    "no seabed": ({"friction": 1, "seabed": False}, "friction is 1, but seabed is False"),
    "fairlead": ({"fairlead": [1, 2]}, "fairlead has 2 components; pass 3"),
    "anchor": ({"anchor": "far"}, "anchor is 'far'; pass a list"),
    "text": ({"length": "long"}, "length is the text 'long'"),
    "moving": ({"anchor": [sd.t, 0, -100]}, "bow line depends on t, but must be constant"),
}


@pytest.mark.parametrize("name", FAULTS)
def test_faults(name: str) -> None:
    given, message = FAULTS[name]
    with pytest.raises(sd.ModelError, match=f"^(bow line: )?{message}"):
        buoy(0, line(**given, name="bow line")).check()


def test_all_faults_of_a_line_are_reported_at_once() -> None:
    with pytest.raises(sd.ModelError) as error:
        buoy(0, line(length=-1, weight=-2, stiffness=-3, friction=-4, name="bow line")).check()
    assert len(error.value.faults) == 4
