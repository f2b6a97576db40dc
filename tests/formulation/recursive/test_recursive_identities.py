"""Independent routes to the same numbers: the lecture's recursions, the lean ones, matrices put together from J."""

from __future__ import annotations

import mpmath
import numpy as np
import pytest

from symdyn import systems
from symdyn.errors import SymdynError
from symdyn.formulation.textbook.bias import bias, gravity_load
from symdyn.formulation.textbook.composite_bodies import composite_bodies
from symdyn.formulation.textbook.energy import energy
from symdyn.formulation.textbook.forward_dynamics import forward_dynamics
from symdyn.formulation.textbook.inverse_dynamics import inverse_dynamics
from symdyn.formulation.textbook.numbers import Numbers, NumericTree
from symdyn.formulation.textbook.velocities import generalized, joint_accelerations, velocities
from symdyn.formulation.trees import inertial_forces, newton_euler
from symdyn.formulation.trees import mass_matrix as composite
from symdyn.formulation.trees.articulated import Articulated
from symdyn.formulation.trees.kinematics import Kinematics
from tests import helpers
from tests.formulation.recursive.trees import (
    FEW,
    KINDS,
    RandomTree,
    at,
    by_time,
    check,
    few_of,
    numeric,
    random_vector,
    state,
)

SEEDS = range(14)
ALL = [(seed, options) for options in ({}, {"gears": True}, {"driven": True}) for seed in SEEDS]
PROPAGATED = [(seed, options) for seed, options in ALL if "gears" not in options]


def drawn(seed: int, options: dict[str, bool], digits: int | None = None) -> tuple[Numbers, np.ndarray]:
    """A tree at a random state, and generalized accelerations."""
    here = at(numeric(seed, **options), seed, digits)
    return here, random_vector(len(here.tree.model.speeds), seed + 100)


def test_every_kind_of_joint_is_drawn() -> None:
    names = {j.name.rsplit("_", 1)[0] for seed in FEW for j in numeric(seed).model.joints}
    assert names == {kind.replace(" ", "_") for kind in KINDS}
    assert {len(numeric(seed).model.bodies) for seed in FEW} == {2, 3, 4, 5, 6}


@pytest.mark.parametrize(("seed", "options"), few_of(PROPAGATED))
def test_forward_of_inverse_and_inverse_of_forward(seed: int, options: dict[str, bool]) -> None:
    here, u_dot = drawn(seed, options)
    tree, applied = here.tree, here.applied
    inverse = inverse_dynamics(tree, joint_accelerations(tree, u_dot), wrenches=applied.wrenches)
    forward = forward_dynamics(tree, inverse.tau, applied.wrenches)
    check(forward.u_dot, u_dot, 1e-12)
    for f, f_A, a, a_A in zip(inverse.f, forward.f, inverse.a, forward.a, strict=True):
        check(f_A, f, 1e-12)
        check(a_A, a, 1e-12)
    forward = forward_dynamics(tree, applied.joint, applied.wrenches)
    tau = inverse_dynamics(tree, forward.w_dot, wrenches=applied.wrenches).tau
    check(generalized(tree, tau), generalized(tree, applied.joint), 1e-11)


@pytest.mark.parametrize(("seed", "options"), few_of(PROPAGATED[::4]))
def test_forward_of_inverse_with_30_digits(seed: int, options: dict[str, bool]) -> None:
    here, u_dot = drawn(seed, options, 30)
    tau = inverse_dynamics(here.tree, joint_accelerations(here.tree, u_dot), wrenches=here.applied.wrenches).tau
    assert helpers.close(forward_dynamics(here.tree, tau, here.applied.wrenches).u_dot, u_dot)


@pytest.mark.parametrize(("seed", "options"), few_of(PROPAGATED))
def test_propagation_is_the_inverse_of_the_mass_matrix(seed: int, options: dict[str, bool]) -> None:
    here, _ = drawn(seed, options)
    tree, applied = here.tree, here.applied
    outside = generalized(tree, applied.joint + newton_euler.inward(tree, applied.wrenches))
    right = outside - bias(tree).k_tilde - gravity_load(tree).load
    M = composite_bodies(tree).M.astype(float)
    check(forward_dynamics(tree, applied.joint, applied.wrenches).u_dot, np.linalg.solve(M, right.astype(float)), 1e-11)


@pytest.mark.parametrize(("seed", "options"), few_of(ALL))
def test_lean_recursions_give_the_same(seed: int, options: dict[str, bool]) -> None:
    here, u_dot = drawn(seed, options)
    tree, applied = here.tree, here.applied
    g, w_dot = tree.algebra.constants(tree.model.gravity), joint_accelerations(tree, u_dot)
    lean = inertial_forces.inverse_dynamics(tree, w_dot, -g, applied.wrenches)
    check(generalized(tree, inverse_dynamics(tree, w_dot, wrenches=applied.wrenches).tau), generalized(tree, lean), 1e-13)
    check(composite_bodies(tree).M_w, composite.mass_matrix(tree), 1e-13)
    kinetic = Kinematics(tree)
    found = energy(tree)
    assert found.kinetic == pytest.approx(kinetic.kinetic_energy(), rel=1e-13)
    assert found.potential == pytest.approx(kinetic.gravity_potential(), rel=1e-12)


@pytest.mark.parametrize(("seed", "options"), few_of([case for case in PROPAGATED if not case[1]]))
def test_lean_articulated_bodies_give_the_same(seed: int, options: dict[str, bool]) -> None:
    here, _ = drawn(seed, options)
    tree, applied = here.tree, here.applied
    g = tree.algebra.constants(tree.model.gravity)
    wrenches, _ = inertial_forces.inertial_forces(tree, tree.b, -g, applied.wrenches)
    lean = Articulated(tree, dict.fromkeys(range(len(tree.w)), "")).solve(applied.joint, wrenches)
    check(forward_dynamics(tree, applied.joint, applied.wrenches).w_dot, lean, 1e-11)


@pytest.mark.parametrize(("seed", "options"), few_of(ALL))
def test_joints_give_the_same_velocity_product(seed: int, options: dict[str, bool]) -> None:
    """S_ring w by differentiating S, compared with the joint's own c: that is seen from the parent, and has omega x v more."""
    here, _ = drawn(seed, options)
    for link, S_ring in zip(here.tree.links, velocities(here.tree).S_ring, strict=True):
        w = here.tree.w[link.speeds.start:link.speeds.stop]
        twist = link.S @ w
        expected = S_ring @ w + np.concatenate([np.zeros(3), np.cross(twist[:3].astype(float), twist[3:].astype(float))])
        assert np.abs((link.c - expected).astype(float)).max() < 1e-13 * max(1, np.abs(link.c.astype(float)).max())


@pytest.mark.parametrize(("seed", "options"), few_of(ALL[::3]))
def test_spatial_acceleration_is_the_rate_of_change_of_velocity(seed: int, options: dict[str, bool]) -> None:
    """d/dt of the components of v, with 60 digits: what the lecture's a is."""
    tree = numeric(seed, **options)
    where = state(tree, seed, 60)
    u_dot = random_vector(len(tree.model.speeds), seed)
    here = tree.at(**where, digits=60).tree
    a = inverse_dynamics(here, joint_accelerations(here, u_dot), a_0=np.zeros(6, dtype=object)).a
    assert helpers.close(by_time(tree, where, u_dot, lambda later: velocities(later).v), np.array(a))


@pytest.mark.parametrize(("seed", "options"), few_of(ALL[::4]))
def test_composite_bodies_are_J_T_M_J(seed: int, options: dict[str, bool]) -> None:
    here, _ = drawn(seed, options)
    tree, kinematics = here.tree, Kinematics(here.tree)
    total = np.zeros((len(tree.model.speeds),) * 2)
    for pose, body in zip(tree.poses, tree.model.bodies, strict=True):
        J = (kinematics.jacobian(pose, tree.algebra.constants(body.com)) @ tree.D).astype(float)
        R = kinematics.rotation(pose)
        I = (R @ tree.algebra.matrix(body.inertia) @ R.T).astype(float)
        total += tree.algebra.expression(body.mass) * J[:3].T @ J[:3] + J[3:].T @ I @ J[3:]
    check(composite_bodies(tree).M, total, 1e-13)


@pytest.mark.parametrize(("seed", "options"), [(8, {}), (3, {}), (5, {"gears": True}), (6, {"driven": True})])
def test_embedding_gives_the_same_with_30_digits(seed: int, options: dict[str, bool]) -> None:
    equations = RandomTree(seed, **options).system.embedding()
    tree = numeric(seed, **options)
    here = tree.at(**(where := state(tree, seed, 30)), digits=30)
    u_dot = random_vector(len(tree.model.speeds), seed)
    model = tree.model
    values = {**where["q"], **where["u"], "t": where["t"], **{s.name: v for s, v in {**model.defaults, **model.initial}.items()
                                                             if s.name not in where["q"] and s.name not in where["u"]},
              **{f"{u.name}_dot": a for u, a in zip(model.speeds, u_dot, strict=True)}}
    M, k, F, tau = helpers.quantities(equations, values, "M_tilde", "k_tilde", "F_tilde", "inverse_dynamics")
    tau_w = inverse_dynamics(here.tree, joint_accelerations(here.tree, u_dot), wrenches=here.applied.wrenches).tau
    with mpmath.workdps(40):
        assert helpers.close(composite_bodies(here.tree).M, M) and helpers.close(bias(here.tree).k_tilde, k)
        assert helpers.close(generalized(here.tree, tau_w - here.applied.joint), tau)
        outside = here.applied.joint + newton_euler.inward(here.tree, here.applied.wrenches)
        assert helpers.close(generalized(here.tree, outside) - gravity_load(here.tree).load, F)


def test_gears_cannot_be_propagated() -> None:
    here, _ = drawn(0, {"gears": True})
    with pytest.raises(SymdynError, match=r"the speed q1_dot moves the joints revolute_0, gear_1, gear_2 together.*composite"):
        forward_dynamics(here.tree, here.applied.joint)


@pytest.mark.parametrize("name", ["n_link_pendulum", "puma560"])
def test_frames_that_stay_parallel(name: str) -> None:
    """The recursions hold in any axes, also in those that turn against the link."""
    model = systems.get(name).check()
    n, rows = len(model.speeds), []
    for aligned in (False, True):
        tree = NumericTree(model, aligned).at(random_vector(n, 1), random_vector(n, 2)).tree
        rows.append((forward_dynamics(tree, random_vector(n, 3)).u_dot, bias(tree).k_tilde))
    check(rows[1][0], rows[0][0], 1e-11)
    check(rows[1][1], rows[0][1], 1e-12)
