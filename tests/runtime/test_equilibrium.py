"""Equilibria against closed forms, from many starts, with what is kept and what is solved for; every message."""

from __future__ import annotations

import functools
import re
import warnings
from typing import Any

import numpy as np
import pytest
import sympy as sp

import symdyn as sd
from symdyn import systems
from symdyn.errors import ArgumentError, EquilibriumNotUnique, NoEquilibrium, SimulationWarning
from symdyn.statics.equilibria import _turn, same
from symdyn.statics.equilibrium import begin
from symdyn.statics.gimbal import lock
from symdyn.statics.search import Search
from symdyn.statics.selection import select


@functools.cache
def double() -> Any:
    return systems.double_pendulum().embedding().compile(backend="numpy")


def beam() -> sd.System:
    """A lever on a hinge: a mass m1 at -a, a ballast m2 at b, a torsion spring, a motor."""
    theta = sd.coordinates("theta")
    m1, m2, a, b, g, k = sd.parameters("m1 m2 a b g k", positive=True)
    tau = sd.inputs("tau")
    s = sd.System("lever", gravity=[0, -g, 0])
    lever = s.add_body("lever", mass=m1, inertia=[0.1, 0.1, 0.1], com=[-a, 0, 0])
    ballast = s.add_body("ballast", mass=m2)
    hinge = s.add_joint(sd.Revolute("hinge", s.ground, lever, theta, axis=[0, 0, 1]))
    s.add_joint(sd.Fixed("held", lever, ballast, parent_point=[b, 0, 0]))
    s.add_joint_force(hinge, tau - k * theta)
    s.defaults = {m1: 3.0, m2: 0.5, a: 0.4, b: 1.5, g: 9.81, k: 25.0}
    return s


@functools.cache
def lever() -> Any:
    return beam().embedding().compile(backend="numpy")


@functools.cache
def governor() -> Any:
    """A pendulum hinged on a shaft that turns: theta from the downward vertical."""
    psi, theta = sd.coordinates("psi theta")
    m, l, g = sd.parameters("m l g", positive=True)
    s = sd.System("shaft", gravity=[0, 0, -g])
    shaft, bob = s.add_body("shaft", mass=1, inertia=[1, 1, 1]), s.add_body("bob", mass=m, com=[0, 0, -l])
    s.add_joint(sd.Revolute("turn", s.ground, shaft, psi, axis=[0, 0, 1]))
    s.add_joint(sd.Revolute("hinge", shaft, bob, theta, axis=[0, 1, 0]))
    s.defaults = {m: 2.0, l: 0.7, g: 9.81}
    return s.embedding().compile(backend="numpy")


@functools.cache
def floater() -> Any:
    """A block on a vertical guide whose buoyancy saturates, above water and below."""
    z = sd.coordinates("z")
    m, g, F, h = sd.parameters("m g F h", positive=True)
    s = sd.System("floater", gravity=[0, 0, -g])
    block = s.add_body("block", mass=m)
    guide = s.add_joint(sd.Prismatic("guide", s.ground, block, z, axis=[0, 0, 1]))
    s.add_joint_force(guide, F * (1 - sp.tanh(z / h)) / 2)
    s.defaults = {m: 10.0, g: 10.0, F: 150.0, h: 0.5}
    return s.embedding().compile(backend="numpy")


@functools.cache
def hanging() -> Any:
    """A free body in Euler parameters on a spring from its own point to the ceiling."""
    s = sd.System("hanging", gravity=[0, 0, -9.81])
    k = sd.parameters("k", positive=True)
    body = s.add_body("body", mass=2, inertia=[0.3, 0.2, 0.1], com=[0, 0, -0.5])
    s.add_joint(sd.Free("free", s.ground, body, sd.coordinates("x y z p0 p1 p2 p3"), orientation=sd.EulerParameters()))
    s.add_spring_damper(s.ground, body, point_a=[0, 0, 2], stiffness=k, length=1)
    s.defaults = {k: 400.0}
    return s.embedding().compile(backend="numpy")


# -- closed forms


def test_many_starts_lead_to_the_four_equilibria_of_a_double_pendulum() -> None:
    """q from the horizontal: down is -pi/2. Whole turns and signs of pi are one; only hanging is stable."""
    found = double().equilibria(24, seed=4)
    expected = {(-np.pi / 2, 0.0), (-np.pi / 2, np.pi), (np.pi / 2, 0.0), (np.pi / 2, np.pi)}
    there = {tuple(np.round(np.abs(np.remainder(e.q + 1e-9, 2 * np.pi)) % (2 * np.pi), 6)) for e in found}
    assert there == {tuple(np.round(np.remainder(np.array(q) + 1e-9, 2 * np.pi), 6)) for q in expected}
    assert len(found) == 4 and sum(found.counts) == 24 and not found.failures
    assert found[0].stable and found[0].name.startswith("1: neutral at q1 = ") and len(found.stable) == 1
    assert all(not e.stable for e in found.found[1:]) and found.iterations.max() <= 25
    assert all(e.residual_norm < 1e-12 for e in found)
    assert "4 equilibria from 24 starts" in repr(found) and found[0].name in repr(found)


def test_block_on_saturating_buoyancy_floats_where_the_closed_form_says() -> None:
    e = floater().equilibrium(start={"z": -3.0})
    assert np.isclose(e["z"], 0.5 * np.arctanh(1 - 2 * 100 / 150), rtol=1e-13) and e.stable
    assert np.array_equal(floater().equilibrium(start=[-3.0]).q, e.q)
    assert np.array_equal(floater().equilibrium(start=e).q, e.q)
    assert "neutral equilibrium" in e.message and "z" in e.describe() and repr(e) == e.describe()


def test_steady_turning_shaft() -> None:
    """cos theta = g / (l Omega^2) above the critical speed, where hanging is unstable; the azimuth stays."""
    module, omega = governor(), 6.0
    steady = module.equilibrium(fixed={"psi_dot": omega}, start={"theta": 1.3, "psi": 0.3})
    assert np.isclose(np.cos(steady["theta"]), 9.81 / (0.7 * omega**2), rtol=1e-13)
    assert steady.verdict == "neutral" and steady["psi"] == 0.3 and steady["psi_dot"] == omega and steady["theta_dot"] == 0.0
    down = module.equilibrium(fixed={"psi_dot": omega}, start={"theta": 0.01})
    assert abs(down["theta"]) < 1e-12 and down.verdict == "unstable" and down.stable is False
    hanging_still = module.equilibrium(fixed={"psi_dot": 2.0}, start={"theta": 0.5})
    assert abs(hanging_still["theta"]) < 1e-12 and hanging_still.verdict == "neutral"
    assert "psi_dot" in steady.describe() and "held" in steady.describe()


def test_constraints_are_fulfilled_at_the_same_time() -> None:
    """A pendulum in x and y from a start off its circle; and from the horizontal, where gravity meets no stiffness at all."""
    module = systems.pendulum_absolute().augmented().compile(backend="numpy")
    weight = 9.81 * module.metadata.defaults[module.metadata.parameters.index("m")]
    down = module.equilibrium(start={"x": 0.3, "y": -2.0})
    assert np.allclose(down.q, [0, -1], atol=1e-13) and down.stable
    forces = module.evaluate("C_r", 0.0, down.x).T @ down.lam
    assert np.allclose(forces, [0, -weight], rtol=1e-12, atol=1e-12)
    assert abs(module.equilibrium(start={"x": -1.0, "y": 0.0})["x"]) < 1e-12


def test_dependent_constraints_do_no_harm() -> None:
    """A pendulum held twice; and Bricard's linkage, whose fifth constraint follows from the others on their manifold only."""
    x, y = sd.coordinates("x y")
    held = x**2 + y**2 - 4
    twice = sd.augmented(coordinates=[x, y], mass=[3, 3], force=[0, -30], constraints=[held, (3 + x) * held], name="twice")
    module = twice.compile(backend="numpy")
    e = module.equilibrium(start={"x": 0.7, "y": -1.0})
    assert np.allclose(e.q, [0, -2], atol=1e-13) and np.isclose(e.lam @ [1, 3], 30 / 4, rtol=1e-12)
    bricard = systems.bricard().augmented().compile(backend="numpy")
    e = bricard.equilibrium(start={"q1": 0.1})
    assert e.stable and e.iterations <= 25 and e.residual_norm < 1e-12 and bricard.rank(e.q) == 4
    assert np.abs(bricard.evaluate("C", 0.0, e.x)).max() < 1e-13 and e.eigenvalues.shape == (2,)


def test_euler_parameters_stay_a_unit_vector_and_their_sign_does_not_count() -> None:
    """Hanging stretched by m g / k, or standing on its head; turning about the vertical is free and must be fixed by a spring."""
    module = hanging()
    with pytest.raises(EquilibriumNotUnique, match=r"there is no stiffness along omega_z_free \(1\.00\)"):
        module.equilibrium(start={"z": 0.5, "x": 0.1, "p0": 1.0})
    kept = {"omega_z_free": 0.0}
    down = module.equilibrium(fixed=kept, start={"z": 0.5, "x": 0.2, "p0": np.cos(0.3), "p1": np.sin(0.3)})
    assert np.isclose(np.linalg.norm(down.q[3:]), 1, rtol=1e-15)
    assert np.isclose(down["z"], 2 - 1 - 2 * 9.81 / 400, rtol=1e-13) and np.abs(down.q[[0, 1]]).max() < 1e-12
    assert down.verdict == "neutral"
    flipped = module.equilibrium(fixed=kept, start={"z": 0.5, "p0": -1.0})
    assert same(down, flipped) and not np.allclose(down.q, flipped.q)


def test_extra_states_come_to_rest_and_their_stiffness_counts() -> None:
    """A mass that only a lagging spring holds, force -k z with z_dot = (q - z) / T."""
    q, z = sd.coordinates("q z")
    s = sd.System("lagging", gravity=[0, -9.81])
    body = s.add_body("body", mass=1)
    slide = s.add_joint(sd.Prismatic("slide", s.ground, body, q, axis=[0, 1]))
    s.add_joint_force(slide, -50 * z - 8 * q.dot)
    s.add_state(z, (q - z) / 0.1)
    e = s.embedding().compile(backend="numpy").equilibrium(start={"q": 0.4, "z": -0.3})
    assert np.allclose([e["q"], e["z"]], -9.81 / 50, rtol=1e-13) and e.z.shape == (1,)
    # lambda^3 + (1/T + d) lambda^2 + (d/T) lambda + k/T = 0
    assert np.allclose(np.sort_complex(e.eigenvalues), np.sort_complex(np.roots([1, 18, 80, 500])), rtol=1e-10)


# -- kept, and solved for


def test_ballast_is_solved_for_so_that_a_coordinate_takes_its_value() -> None:
    """m2 b = m1 a keeps the lever level; at another angle the torsion spring takes part."""
    level = lever().equilibrium(free=["theta", "m2"], fixed={"theta": 0.0})
    assert np.isclose(level["m2"], 3 * 0.4 / 1.5, rtol=1e-14) and level.solved == {"m2": level["m2"]}
    assert level.params[lever().metadata.parameters.index("m2")] == level["m2"] and level["theta"] == 0.0
    tilted = lever().equilibrium(unknown_params="m2", fixed={"theta": -0.2})
    assert np.isclose((tilted["m2"] * 1.5 - 3 * 0.4) * 9.81 * np.cos(0.2), 25 * 0.2, rtol=1e-13)
    assert "solved for" in tilted.describe()


def test_input_is_solved_for() -> None:
    e = lever().equilibrium(free=["tau"], fixed={"theta": 0.1})
    assert np.isclose(e["tau"], 25 * 0.1 + (0.5 * 1.5 - 3 * 0.4) * 9.81 * np.cos(0.1), rtol=1e-13) and e.inputs[0] == e["tau"]


def test_what_is_kept_bears_anything() -> None:
    """With the first link fixed level the second hangs; and free names what is found, the others staying at the start."""
    e = double().equilibrium(fixed={"q1": 0.0}, start={"q2": -1.0})
    assert np.allclose(e.q, [0, -np.pi / 2], atol=1e-13) and e.eigenvalues.shape == (2,)
    assert np.allclose(double().equilibrium(free="q2", start={"q1": 0.0, "q2": -1.0}).q, e.q, atol=1e-14)
    assert np.isclose(np.abs(e.eigenvalues[0])**2, 9.81 * 0.5 / (1 / 3), rtol=1e-12)


def test_level_with_parameters_needs_as_many_conditions() -> None:
    with pytest.raises(ArgumentError, match=r"lever: 1 values are to be found \(m2\), which takes as many conditions, but fixed "
                                            r"gives 0 \(none\)"):
        lever().equilibrium(free=["theta", "m2"])
    with pytest.raises(ArgumentError, match="2 values are to be found"):
        lever().equilibrium(unknown_params=["m2", "a"], fixed={"theta": 0})


# -- what has none


def test_no_stiffness_names_the_direction() -> None:
    with pytest.raises(EquilibriumNotUnique, match=r"shaft: the equilibrium is not unique: there is no stiffness along psi "
                                                   r"\(1\.00\); fix it, as by fixed=\{'psi': \.\.\.\}"):
        governor().equilibrium(start={"theta": 0.2})


def test_what_is_too_heavy_sinks() -> None:
    with pytest.raises(NoEquilibrium, match=r"floater: no equilibrium found: .* forces left are 50 N along z; nothing holds z: "
                                            r"it has no stiffness there, so it sinks.*the last state is z = -.*"
                                            r"check the weight and the loads: another start hardly helps$"):
        floater().equilibrium(params={"m": 20.0}, start={"z": -0.5})


def test_too_few_iterations() -> None:
    with pytest.raises(NoEquilibrium, match=r"2 iterations were not enough, after 2 iterations; forces left are .* N m along q"):
        double().equilibrium(start={"q1": 1.0, "q2": 2.0}, max_iterations=2)


def test_runaway() -> None:
    """A force that falls off with the distance but never ends."""
    q = sd.coordinates("q")
    s = sd.System("pushed")
    body = s.add_body("body", mass=1)
    slide = s.add_joint(sd.Prismatic("slide", s.ground, body, q, axis=[1, 0]))
    s.add_joint_force(slide, 1 / (1 + q**2))
    with pytest.raises(NoEquilibrium, match=r"pushed: no equilibrium found: a coordinate runs away.*the last state is q = \d"):
        s.embedding().compile(backend="numpy").equilibrium(start={"q": 1.0})


def test_start_that_cannot_be_evaluated() -> None:
    q = sd.coordinates("q")
    s = sd.System("rooted")
    body = s.add_body("body", mass=1)
    slide = s.add_joint(sd.Prismatic("slide", s.ground, body, q, axis=[1, 0]))
    s.add_joint_force(slide, 2 - sp.log(q))
    module = s.embedding().compile(backend="numpy")
    assert np.isclose(module.equilibrium(start={"q": 1.0})["q"], np.exp(2), rtol=1e-13)
    with pytest.raises(NoEquilibrium, match=r"rooted: the search cannot begin: .*; begin elsewhere"):
        module.equilibrium(start={"q": -1.0})
    with pytest.raises(NoEquilibrium, match="none of 2 starts leads to an equilibrium; the first: rooted: the search"):
        module.equilibria([{"q": -1.0}, {"q": -2.0}])
    found = module.equilibria([{"q": -1.0}, {"q": 2.0}])
    assert len(found) == 1 and len(found.failures) == 1 and list(found.iterations > 0) == [False, True]


def test_constraints_that_move_by_themselves_leave_no_rest() -> None:
    q = sd.coordinates("q")
    s = sd.System("driven", gravity=[0, -9.81])
    body = s.add_body("body", mass=1, com=[1, 0])
    s.add_joint(sd.Revolute("hinge", s.ground, body, q))
    s.add_constraint(q - 2 * sd.t, "drive")
    with pytest.raises(NoEquilibrium, match=r"driven: at t = 0 s the constraints move with -2 m/s \(drive\)"):
        s.augmented().compile(backend="numpy").equilibrium()


def heavy_top(attitude: Any, names: str) -> Any:
    """A free body with its own moments about axes fixed in it, held in place by springs."""
    s = sd.System("hung", gravity=[0, 0, -9.81])
    k = sd.parameters("k", positive=True)
    body = s.add_body("body", mass=2, inertia=[0.3, 0.2, 0.1], com=[0, 0, -0.5])
    q = sd.coordinates(names)
    s.add_joint(sd.Free("free", s.ground, body, q, orientation=attitude))
    for place in ([3, 0, 0], [-3, 0, 0], [0, 3, 0], [0, -3, 0]):
        s.add_spring_damper(s.ground, body, point_a=place, point_b=[c / 10 for c in place], stiffness=k, length=1)
    s.defaults = {k: 400.0}
    return s


@functools.cache
def hung_by_angles() -> Any:
    return heavy_top(sd.EulerAngles("ZYX"), "x y z psi theta phi").embedding().compile(backend="numpy")


def test_forces_along_the_angles_do_not_balance_at_gimbal_lock() -> None:
    """Turned by 90 degrees about y two of its three angles are one: a balance there need be none."""
    module = hung_by_angles()
    locked = {"theta": np.pi / 2, "psi": 0.3, "phi": -0.2}
    with pytest.raises(NoEquilibrium, match=r"gimbal lock: theta = 90 deg; .* use Euler parameters \(orientation='parameters'"):
        module.equilibrium(free=["x"], start=locked)
    assert module.equilibrium(start={"theta": 0.2, "phi": 0.1}).stable
    found = module.equilibria([locked, {"theta": 0.1}], free=["x"])
    assert len(found) == 1 and len(found.failures) == 1 and "gimbal lock" in found.failures[0][1]
    straight = begin(module, select(module, None, None, None), {"theta": 0.2}, None, 0.0, None)
    assert lock(straight) == "" and lock(straight.at(x=np.r_[straight.x[:4], -np.pi / 2, straight.x[5:]])) == "theta = -90 deg"


def test_attitudes_distinguish_equilibria_and_coordinates_have_ranges() -> None:
    """A body on a spring, hanging or standing on its head."""
    module = hanging()
    found = module.equilibria([{"z": 0.5, "p0": 1.0}, {"z": 1.5, "p0": 0.0, "p1": 1.0}], fixed={"omega_z_free": 0.0})
    names = sorted(e.name.partition(" ")[2] for e in found)
    assert names[0] == "neutral at not turned" and re.fullmatch(r"unstable at turned by 180 deg about x", names[1])
    ranged = module.equilibria(3, ranges={"z": 0.2, "omega_x_free": 0.1}, start={"z": 0.5}, fixed={"omega_z_free": 0.0})
    assert len(ranged) == 1 and ranged.counts == (3,) and np.isclose(ranged[0]["z"], 2 - 1 - 2 * 9.81 / 400, rtol=1e-12)
    with pytest.raises(ArgumentError, match="ranges: there is no 'p1'; there are ") as caught:
        module.equilibria(3, ranges={"p1": 1})
    listed = str(caught.value).rpartition("there are ")[2].split(", ")
    assert len(set(listed)) == len(listed) and {"z", "omega_x_free"} <= set(listed)
    assert _turn(np.zeros(3)) == "not turned" and _turn(np.array([0, 0, -np.pi / 2])) == "turned by -90 deg about z"
    assert _turn(np.array([1.0, 1.0, 0])) == "turned by 81.03 deg about (0.707, 0.707, 0)"


@functools.cache
def table() -> Any:
    """A plate on a springy leg, tilting about x and y, with a small mass to be shifted across along each and an idle moment."""
    z, a, b = sd.coordinates("z a b")
    m, X, Y, k, c, idle, M, N = sd.parameters("m X Y k c idle M N", real=True)
    s = sd.System("table", gravity=[0, 0, -10])
    leg, cross, plate = s.add_body("leg", mass=1), s.add_body("cross", mass=1), s.add_body("plate", mass=m, inertia=[5, 5, idle])
    lift = s.add_joint(sd.Prismatic("lift", s.ground, leg, z, axis=[0, 0, 1]))
    roll = s.add_joint(sd.Revolute("roll", leg, cross, a, axis=[1, 0, 0]))
    tilt = s.add_joint(sd.Revolute("tilt", cross, plate, b, axis=[0, 1, 0]))
    s.add_joint_force(lift, -k * z)
    s.add_joint_force(roll, M - c * a)
    s.add_joint_force(tilt, N - c * b)
    for at in ([X, 0, 0], [0, Y, 0]):
        shifted = s.add_body(f"at_{len(s.bodies)}", mass=1)
        s.add_joint(sd.Fixed(f"held_{len(s.bodies)}", plate, shifted, parent_point=at))
    s.defaults = {m: 1e6, X: 0.0, Y: 0.0, k: 1e9, c: 1e9, idle: 4.0, M: 0.0, N: 20.0}
    return s.embedding().compile(backend="numpy")


@pytest.mark.parametrize("free", [["z", "a", "b", "X", "Y"], ["a", "b", "X", "Y"], None])
def test_small_masses_balance_what_is_stiff(free: Any) -> None:
    """m g X = N, though the stiffness is a hundred million times what a metre of them does; the effect decides the conditions."""
    e = table().equilibrium(free=free, unknown_params=None if free else ["X", "Y"], fixed={"a": 0.0, "b": 0.0})
    assert np.isclose(e["X"], -2.0, rtol=1e-12) and abs(e["Y"]) < 1e-12 and np.isclose(e["z"], -(1e6 + 4) * 10 / 1e9, rtol=1e-12)
    assert e.residual_norm < 1e-7


def test_conditions_among_more_that_stay_are_those_that_are_affected() -> None:
    e = table().equilibrium(unknown_params="X", fixed={"a": 0.0, "b": 0.0})
    assert np.isclose(e["X"], -2.0, rtol=1e-12) and e.selection.conditions == ("b",)
    with pytest.raises(ArgumentError, match=r"1 values are to be found \(idle\), which takes as many conditions, but fixed gives "
                                            r"2 \(a, b\); name in free .* such as free=\['z', 'a', 'idle'\]"):
        table().equilibrium(unknown_params="idle", fixed={"a": 0.0, "b": 0.0})


def test_a_parameter_without_effect_is_named() -> None:
    with pytest.raises(ArgumentError, match="table: idle has no effect on b there: no value of it balances the forces"):
        table().equilibrium(unknown_params="idle", fixed={"b": 0.0})


def test_large_forces_are_never_left() -> None:
    """A moment of 20 N m is nothing next to the stiffness of 1e9 N m, but no equilibrium where nothing takes it."""
    module = table()
    selection = select(module, None, {"z": 0.0}, None)
    search = Search(begin(module, selection, {"a": 0.0, "b": 2e-8}, None, 0.0, None), selection)
    assert search.balanced(search.best)
    assert not search.balanced(Search(begin(module, selection, {"a": 0.0, "b": 3e-8}, None, 0.0, None), selection).best)


def test_forces_that_depend_on_time_are_reported() -> None:
    q = sd.coordinates("q")
    A, w = sd.parameters("A w", real=True)
    s = sd.System("shaken")
    body = s.add_body("body", mass=1)
    slide = s.add_joint(sd.Prismatic("slide", s.ground, body, q, axis=[1, 0]))
    s.add_joint_force(slide, -5 * q + A * sp.sin(w * sd.t))
    s.defaults = {A: 2.0, w: 1.0}
    module = s.embedding().compile(backend="numpy")
    with pytest.warns(SimulationWarning, match=r"shaken: in equilibrium: forces depend on time, which stands still at t = 0\.5 "
                                               r"s: that along q changes by .* N within 7\.3 s") as caught:
        assert np.isclose(module.equilibrium(t=0.5)["q"], 2 * np.sin(0.5) / 5, rtol=1e-13)
    assert caught[0].filename == __file__
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert module.equilibrium(t=0.5, params={"A": 0.0})["q"] == 0.0


def test_validity_checks_warn_with_numbers() -> None:
    """A box held above the water by a stiff spring."""
    z = sd.coordinates("z")
    s = sd.System("raft", gravity=[0, 0, -9.81])
    raft = s.add_body("raft", mass=1000)
    guide = s.add_joint(sd.Prismatic("guide", s.ground, raft, z, axis=[0, 0, 1]))
    s.add_joint_force(guide, 1e6 * (3 - z))
    s.add_load(sd.Buoyancy(raft, boxes=[sd.Box((4, 2, 1))], density=1025))
    with pytest.warns(SimulationWarning, match=r"raft: in equilibrium: .*has left the water: .* of its volume is 0$") as caught:
        s.embedding().compile(backend="numpy").equilibrium(start={"z": 0.0})
    assert caught[0].filename == __file__


@pytest.mark.parametrize(("arguments", "message"), [
    ({"free": ["q9"]}, "free: there is no 'q9', did you mean"),
    ({"free": []}, "free names nothing"),
    ({"free": 3}, "free must be names or symbols, found 3"),
    ({"free": ["q1_dot"]}, "free names the speeds q1_dot; name coordinates"),
    ({"free": ["q1"], "fixed": {"q1": 0}}, "q1 is both free and fixed"),
    ({"fixed": ["q1"]}, "fixed must be a mapping"),
    ({"fixed": {"q1": np.nan}}, "fixed must be finite, found q1 = nan"),
    ({"start": {"q1": "x"}}, "the value of q1 is 'x', not a number"),
    ({"t": np.inf}, "pass a finite number of seconds as t"),
    ({"unknown_params": "q1"}, "unknown_params: there is no 'q1'"),
    ({"max_iterations": "x"}, "max_iterations must be a whole number of at least 1, found 'x'"),
    ({"max_iterations": -3}, "max_iterations must be a whole number of at least 1, found -3"),
])
def test_bad_arguments(arguments: dict[str, Any], message: str) -> None:
    with pytest.raises(ArgumentError, match=re.escape(message)):
        double().equilibrium(**arguments)


@pytest.mark.parametrize(("arguments", "message"), [
    ({"starts": 0}, "0 starts requested; at least 1 is needed"),
    ({"starts": 3, "ranges": {"q1": (2, 1)}}, "the range of q1 is (2, 1); pass (least, most)"),
    ({"starts": 3, "ranges": {"q1": "wide"}}, "the range of q1 is 'wide'"),
    ({"starts": 3, "ranges": [1]}, "ranges must be a mapping"),
    ({"starts": 3, "ranges": {"q1": "12"}}, "the range of q1 is '12'; pass (least, most)"),
    ({"starts": "3"}, "starts must be a number of them, or a list of starts, found '3'"),
    ({"seed": "a"}, "the seed must be a whole number of at least 0, found 'a'"),
    ({"starts": [{"q1": 0}], "ranges": {"q1": 1}}, "leave one of them out"),
])
def test_bad_arguments_of_many_starts(arguments: dict[str, Any], message: str) -> None:
    with pytest.raises(ArgumentError, match=re.escape(message)):
        double().equilibria(**arguments)


def test_equilibrium_by_name() -> None:
    e = floater().equilibrium(start={"z": -1})
    assert e["m"] == 10.0 and e["z_dot"] == 0.0
    with pytest.raises(ArgumentError, match="the equilibrium has no 'k'"):
        e["k"]
