"""Equilibria against closed forms, from many starts, with what is kept and what is solved for; every message."""

from __future__ import annotations

import functools
import re
from typing import Any

import numpy as np
import pytest
import sympy as sp

import symdyn as sd
from symdyn import systems
from symdyn.errors import ArgumentError, EquilibriumNotUnique, NoEquilibrium, SimulationWarning
from symdyn.runtime.statics.equilibria import same


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
    assert found[0].stable and found[0].name.startswith("1: stable at q1 = ") and len(found.stable) == 1
    assert all(not e.stable for e in found.found[1:]) and found.iterations.max() <= 25
    assert all(e.residual_norm < 1e-12 for e in found)
    assert "4 equilibria from 24 starts" in repr(found) and found[0].name in repr(found)


def test_block_on_saturating_buoyancy_floats_where_the_closed_form_says() -> None:
    e = floater().equilibrium(start={"z": -3.0})
    assert np.isclose(e["z"], 0.5 * np.arctanh(1 - 2 * 100 / 150), rtol=1e-13) and e.stable
    assert np.array_equal(floater().equilibrium(start=[-3.0]).q, e.q)
    assert np.array_equal(floater().equilibrium(start=e).q, e.q)
    assert "stable equilibrium" in e.message and "z" in e.describe() and repr(e) == e.describe()


def test_steady_turning_shaft() -> None:
    """cos theta = g / (l Omega^2) above the critical speed, where hanging is unstable; the azimuth stays."""
    module, omega = governor(), 6.0
    steady = module.equilibrium(fixed={"psi_dot": omega}, start={"theta": 1.3, "psi": 0.3})
    assert np.isclose(np.cos(steady["theta"]), 9.81 / (0.7 * omega**2), rtol=1e-13)
    assert steady.stable and steady["psi"] == 0.3 and steady["psi_dot"] == omega and steady["theta_dot"] == 0.0
    down = module.equilibrium(fixed={"psi_dot": omega}, start={"theta": 0.01})
    assert abs(down["theta"]) < 1e-12 and not down.stable
    hanging_still = module.equilibrium(fixed={"psi_dot": 2.0}, start={"theta": 0.5})
    assert abs(hanging_still["theta"]) < 1e-12 and hanging_still.stable
    assert "psi_dot" in steady.describe() and "kept" in steady.describe()


def test_constraints_are_fulfilled_at_the_same_time() -> None:
    """A pendulum in x and y from a start off its circle; and from the horizontal, where gravity meets no stiffness at all."""
    module = systems.pendulum_absolute().augmented().compile(backend="numpy")
    weight = 9.81 * module.metadata["defaults"][module.metadata["parameters"].index("m")]
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
    assert np.isclose(down["z"], 2 - 1 - 2 * 9.81 / 400, rtol=1e-13) and np.abs(down.q[[0, 1]]).max() < 1e-12 and down.stable
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
    assert level.params[lever().metadata["parameters"].index("m2")] == level["m2"] and level["theta"] == 0.0
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
                                            r"it has no stiffness there, so it sinks.*the last state is z = -"):
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


def test_elements_that_watch_warn_in_numbers() -> None:
    """A box held above the water by a stiff spring."""
    z = sd.coordinates("z")
    s = sd.System("raft", gravity=[0, 0, -9.81])
    raft = s.add_body("raft", mass=1000)
    guide = s.add_joint(sd.Prismatic("guide", s.ground, raft, z, axis=[0, 0, 1]))
    s.add_joint_force(guide, 1e6 * (3 - z))
    s.add_load(sd.Buoyancy(raft, boxes=[sd.Box((4, 2, 1))], density=1025))
    with pytest.warns(SimulationWarning, match=r"raft: in equilibrium: .*has left the water: .* of its volume is 0$") as told:
        s.embedding().compile(backend="numpy").equilibrium(start={"z": 0.0})
    assert told[0].filename == __file__


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
])
def test_bad_arguments(arguments: dict[str, Any], message: str) -> None:
    with pytest.raises(ArgumentError, match=re.escape(message)):
        double().equilibrium(**arguments)


@pytest.mark.parametrize(("arguments", "message"), [
    ({"starts": 0}, "0 starts asked for; at least 1 is needed"),
    ({"starts": 3, "ranges": {"q1": (2, 1)}}, "the range of q1 is (2, 1); pass (least, most)"),
    ({"starts": 3, "ranges": {"q1": "wide"}}, "the range of q1 is 'wide'"),
    ({"starts": 3, "ranges": [1]}, "ranges must be a mapping"),
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
