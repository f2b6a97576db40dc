"""Equations of the catalogue's trees and of random ones against Pinocchio, a program of others."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import numpy as np
import pytest

import symdyn as sd
from symdyn.lab.peers.models import turbine_tree
from symdyn.model import joints
from symdyn.tape.floats import evaluate_rows
from tests.helpers import swept
from tests.oracles.random_trees import random_state, random_tree

pytest.importorskip("pinocchio", reason="Pinocchio is not installed; run: pip install pin")
from tests.oracles.pinocchio import CannotExpress, PinocchioOracle

# Methods of System that derive its equations.
FORMULATIONS = ("embedding", "recursive")
TOLERANCE = 1e-12
STATES = 3
TREES = 50
FEW = range(21)  # have everything; more of them are in the sweep
KINEMATIC_TREES = 6

CATALOGUE: dict[str, Callable[[], sd.System]] = {
    **{name: getattr(sd.systems, name) for name in sd.systems.names(constrained=False)},
    "vehicle_on_massless_track": lambda: sd.systems.vehicle_on_rotating_track(track_inertia=False),
    "prismatic_chain_3": lambda: sd.systems.prismatic_chain(n=3),
    "spatial_chain_12": lambda: sd.systems.spatial_chain(n=12),
    "puma560_modified": lambda: sd.systems.puma560(convention="modified"),
    "puma560_general": lambda: sd.systems.puma560(general=True, torques=True),
    "puma560_motors": lambda: sd.systems.puma560(motors=True),
    "turbine_tree": turbine_tree,
    "turbine_tree_body_rates": lambda: turbine_tree(body_rates=True),
}


class Evaluated(NamedTuple):
    """Quantities of symdyn's equations at some states, (n, ...) each, with the states and Pinocchio's model."""

    oracle: PinocchioOracle
    q: np.ndarray
    u: np.ndarray
    u_dot: np.ndarray
    quantities: Mapping[str, np.ndarray]


def evaluated(system: sd.System, formulation: str, *names: str, seed: int = 0) -> Evaluated:
    """The named quantities at random states, parameters and inputs at their numbers."""
    model = system.check()
    numbers = {**dict(zip(model.inputs, np.random.default_rng(seed).uniform(-3, 3, len(model.inputs)).tolist())),
               **model.defaults}
    try:
        oracle = PinocchioOracle(model, numbers)
    except CannotExpress as reason:
        pytest.skip(str(reason))
    q, u, u_dot = random_state(system, seed, STATES)
    columns = {**{s.name: column for s, column in zip((*model.coordinates, *model.speeds), [*q.T, *u.T], strict=True)},
               **{f"{s.name}_dot": column for s, column in zip(model.speeds, u_dot.T, strict=True)}}
    values = {**columns, **{s.name: value for s, value in numbers.items()}}
    tape = getattr(system, formulation)().tape(*names)
    return Evaluated(oracle, q, u, u_dot, evaluate_rows(tape, values, STATES))


def assert_close(found: np.ndarray, wanted: np.ndarray, scale: float, tolerance: float = TOLERANCE) -> None:
    """Norm-wise, relative to what is wanted, or to the terms that it is the difference of."""
    assert found.shape == np.shape(wanted)
    assert np.linalg.norm(found - wanted) <= tolerance * max(np.linalg.norm(wanted), scale)


def compare_dynamics(system: sd.System, formulation: str, seed: int = 0) -> None:
    """M_tilde, k_tilde, F_tilde, inverse dynamics and accelerations, at some states."""
    oracle, q, u, u_dot, found = evaluated(system, formulation, "M_tilde", "k_tilde", "F_tilde", "inverse_dynamics", "rhs",
                                           seed=seed)
    for k in range(STATES):
        M, coriolis, gravity = oracle.mass_matrix(q[k]), oracle.coriolis(q[k], u[k]), oracle.gravity(q[k])
        drive, bias = oracle.joint_forces(q[k], u[k]), oracle.bias(q[k], u[k])
        scale = float(np.linalg.norm(M @ u_dot[k]))
        assert_close(found["M_tilde"][k], M, 0)
        assert_close(found["k_tilde"][k], coriolis, scale)
        assert_close(found["F_tilde"][k], drive - gravity, scale)
        assert_close(found["k_tilde"][k] - found["F_tilde"][k], bias - drive, scale)
        assert_close(found["inverse_dynamics"][k], oracle.tau(q[k], u[k], u_dot[k]) - drive, scale)
        n_q, n_u = q.shape[1], u.shape[1]
        assert_close(found["rhs"][k, n_q:n_q + n_u], oracle.accelerations(q[k], u[k], drive), 0, TOLERANCE * np.linalg.cond(M))


@pytest.mark.every_value
@pytest.mark.parametrize("formulation", FORMULATIONS)
@pytest.mark.parametrize("name", CATALOGUE)
def test_dynamics_of_the_catalogue(name: str, formulation: str) -> None:
    compare_dynamics(CATALOGUE[name](), formulation)


# Every tree in one formulation, every second one in both.
@pytest.mark.every_value
@pytest.mark.parametrize(("seed", "formulation"), swept([(seed, f) for seed in range(TREES) for k, f in enumerate(FORMULATIONS)
                                                         if seed % 2 == 0 or seed // 2 % 2 == k],
                                                        *((seed, FORMULATIONS[seed // 2 % 2]) for seed in FEW)))
def test_dynamics_of_random_trees(seed: int, formulation: str) -> None:
    compare_dynamics(random_tree(seed), formulation, seed)


@pytest.mark.parametrize("formulation", FORMULATIONS)
@pytest.mark.parametrize("seed", range(KINEMATIC_TREES))
def test_kinematics_and_energy_of_random_trees(seed: int, formulation: str) -> None:
    """Positions, J, J_dot u, energy, and what follows from them: centre of mass and momentum."""
    system = random_tree(seed)
    bodies = system.bodies
    oracle, q, u, _, found = evaluated(system, formulation, "positions", "frames", "J", "Jd_qd", "energy", seed=seed)
    moving = [b for b in range(len(bodies)) if oracle.places[b].joint]
    masses = np.array([oracle.array([[b.mass]])[0, 0] for b in bodies])
    for k in range(STATES):
        r = found["positions"][k]
        J, Jd_qd = found["J"][k].reshape(-1, 6, u.shape[1]), found["Jd_qd"][k].reshape(-1, 6)
        for b, body in enumerate(bodies):
            assert_close(r[b], oracle.position(q[k], b, body.com), 1)
            assert_close(J[b], oracle.jacobian(q[k], b, body.com), 1)
            assert_close(Jd_qd[b], oracle.jacobian_rate(q[k], u[k], b, body.com), 1)
        kinetic, potential = oracle.energy(q[k], u[k])
        fixed = -sum(masses[b] * (r[b] @ oracle.pin.gravity.linear) for b in set(range(len(bodies))) - set(moving))
        assert_close(found["energy"][k], np.array([kinetic, potential + fixed]), 1)
        center = masses[moving] @ r[moving] / masses[moving].sum()
        assert_close(center, oracle.center_of_mass(q[k]), 1)
        momentum = np.zeros(6)
        for b in moving:
            v, omega = np.split(J[b] @ u[k], 2)
            R = found["frames"][k, b, 3:].reshape(3, 3)
            momentum[:3] += masses[b] * v
            momentum[3:] += R @ oracle.array(bodies[b].inertia) @ R.T @ omega + masses[b] * np.cross(r[b] - center, v)
        assert_close(momentum, oracle.centroidal_momentum(q[k], u[k]), 1)


def test_random_trees_have_everything() -> None:
    """Every joint type of rigid bodies but the one that is a formula, every kind of speeds, branches, bodies on the ground."""
    trees = [random_tree(seed) for seed in FEW]
    found = [joint for tree in trees for joint in tree.joints]
    types = {getattr(joints, name) for name in joints.__all__}
    wanted = {t for t in types if issubclass(t, joints.Joint)} - {joints.Joint, joints.Custom, joints.Modal}
    assert {type(joint) for joint in found} == wanted
    rotations = {(type(j).__name__, type(j.orientation).__name__, getattr(j.orientation, "speeds", "body"),
                  getattr(j, "body_velocity", False)) for j in found if hasattr(j, "orientation")}
    assert len(rotations) == 3 + 5
    assert {len(tree.bodies) for tree in trees} == set(range(2, 9))
    assert any(j.kind == "fixed" and j.parent is tree.ground for tree in trees for j in tree.joints)
    assert any(len({j.parent for j in tree.joints}) < len(tree.joints) for tree in trees)


def test_the_same_seed_is_the_same_tree() -> None:
    one, other = random_tree(7), random_tree(7)
    assert one.defaults == other.defaults and [j.kind for j in one.joints] == [j.kind for j in other.joints]
    assert [j.parent_rotation for j in one.joints] == [j.parent_rotation for j in other.joints]


@pytest.mark.parametrize("make, reason", [
    (lambda: sd.systems.puma560(motors=True), "the motion of joint 'gear1' is prescribed or depends on other coordinates"),
    (lambda: _sprung(), "spring: loads other than joint forces are not part of Pinocchio's model"),
    (lambda: _moved(), "the motion of the ground is prescribed"),
])
def test_what_pinocchio_cannot_express(make: Callable[[], sd.System], reason: str) -> None:
    model: Any = make().check()
    with pytest.raises(CannotExpress, match=f"^{reason}$"):
        PinocchioOracle(model, model.defaults)


def _sprung() -> sd.System:
    system = sd.systems.pendulum()
    system.add_spring_damper(system.ground, system.bodies[0], stiffness=1, name="spring")
    return system


def _moved() -> sd.System:
    system = sd.systems.pendulum()
    system.move_ground(position=[sd.t, 0])
    return system
