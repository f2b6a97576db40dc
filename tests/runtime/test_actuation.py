"""Inverse dynamics by the inputs against closed forms: a Scotch yoke, carts, a rotor; what is rejected, and why."""

from __future__ import annotations

import functools
import pickle
from typing import Any

import numpy as np
import pytest
import sympy as sp

import symdyn as sd
from symdyn.runtime.consistent import smallest_acceleration
from symdyn.runtime.labelled import Labelled

R, INERTIA, MASS, DAMPING = 0.3, 0.05, 2.0, 0.7


@functools.cache
def yoke(backend: str = "numpy", rows: int = 1) -> Any:
    """A crank that moves a slider by x = r cos theta; torque T on the crank, force P on the slider, which is damped."""
    theta, x = sd.coordinates("theta x")
    T, P = sd.inputs("T P")
    s = sd.System("yoke", planar=True)
    crank, slider = s.add_body("crank", mass=1, inertia=INERTIA), s.add_body("slider", mass=MASS, inertia=1)
    hinge = s.add_joint(sd.Revolute("hinge", s.ground, crank, theta))
    guide = s.add_joint(sd.Prismatic("guide", s.ground, slider, x, axis=[1, 0, 0]))
    s.add_joint_force(hinge, T)
    s.add_joint_force(guide, P)
    s.add_joint_force(guide, -DAMPING * x.dot)
    for k in range(rows):
        s.add_constraint(x - R * sp.cos(theta), name=f"slot{k + 1}")
    return s.augmented().compile(backend=backend)


def motion(theta: float, w: float, a: float) -> tuple[list[float], list[float], list[float]]:
    """q, u, ud of the yoke."""
    c, s = np.cos(theta), np.sin(theta)
    return [theta, R * c], [w, -R * s * w], [a, -R * (s * a + c * w**2)]


MOTION = motion(0.7, 3.0, -5.0)


def needed() -> tuple[float, float]:
    """Force on the slider; torque on the crank without a force P: I theta_ddot + f x'(theta)."""
    (theta, _), (_, v), (a, v_dot) = MOTION
    force = MASS * v_dot + DAMPING * v
    return force, INERTIA * a - R * np.sin(theta) * force


# -- inverse dynamics


@pytest.mark.parametrize("backend", ["numpy", "c"])
def test_inverse_dynamics_under_constraints_takes_multipliers(backend: str) -> None:
    """Without them the forces of the cut tree came out without a word."""
    q, u, ud = MOTION
    with pytest.raises(sd.ArgumentError, match=r"depend on the multipliers of the constraints slot1; pass lam=\{...\} "
                                               r"\(zeros: those of the tree with its loops cut\).*module.actuation"):
        yoke(backend).inverse_dynamics(q, u, ud)
    force, torque = needed()
    tree = [INERTIA * ud[0], force]
    assert np.allclose(yoke(backend).inverse_dynamics(q, u, ud, lam=[0.0]), tree, rtol=1e-13)
    # The slot bears the force of the slider: C_r^T lam = (r sin theta, 1) lam.
    for lam in ({"slot1": -force}, [-force]):
        assert np.allclose(yoke(backend).inverse_dynamics(q, u, ud, lam=lam), [torque, 0.0], rtol=1e-13, atol=1e-13)
    rows = yoke(backend).inverse_dynamics([q, q], [u, u], [ud, ud], lam=[[-force], [0.0]])
    assert np.allclose(rows, [[torque, 0.0], tree], rtol=1e-13, atol=1e-13)


def test_multipliers_without_constraints_are_rejected() -> None:
    pendulum = sd.systems.pendulum().embedding().compile(backend="numpy")
    with pytest.raises(sd.ArgumentError, match="multipliers lam were given, but there are no constraints; leave them out"):
        pendulum.inverse_dynamics([0.1], [0.0], [0.0], lam=[1.0])


def test_the_header_of_generated_code_says_that_loops_are_cut() -> None:
    from symdyn.pipeline import emit

    for name, says in (("slider_crank", True), ("double_pendulum", False)):
        text = "".join(emit(sd.systems.get(name).augmented(), "numpy", ["inverse_dynamics"]).files.values())
        assert ("of the tree: loops cut, without constraints" in text) is says


# -- actuation


@pytest.mark.parametrize("backend", ["numpy", "c"])
def test_one_input_of_a_loop_is_unique(backend: str) -> None:
    """The torque is that of virtual work, and the slot bears the force of the slider."""
    q, u, ud = MOTION
    force, torque = needed()
    found = yoke(backend).actuation(0.0, q, u, ud, inputs={"P": 0.0})
    assert np.isclose(found["T"], torque, rtol=1e-13) and found.inputs["P"] == 0.0
    assert np.isclose(found.multipliers["slot1"], -force, rtol=1e-13) and found.determined == ("slot1",)
    assert found.residual < 1e-13 * abs(force) and found.rank == found.freedoms == 1 and found.unique
    kept = yoke(backend).actuation(0.0, dict(zip(("theta", "x"), q, strict=True)), u, ud, inputs={"T": 1.5})
    (theta, _) = q
    assert np.isclose(kept["P"], force - (INERTIA * ud[0] - 1.5) / (R * np.sin(theta)), rtol=1e-13) and kept.found == ("P",)


def test_what_was_found_makes_the_motion() -> None:
    q, u, ud = MOTION
    found = yoke().actuation(0.0, q, u, ud)
    assert np.allclose(yoke().rhs(0.0, [*q, *u], None, found.inputs)[2:], ud, rtol=1e-12)


def test_more_inputs_than_freedoms_are_of_least_norm() -> None:
    """T - r sin(theta) P = the torque that is needed: both along (1, -r sin theta)."""
    q, u, ud = MOTION
    lever = np.array([1.0, -R * np.sin(q[0])])
    found = yoke().actuation(0.0, q, u, ud)
    assert np.allclose(found.inputs, lever * needed()[1] / (lever @ lever), rtol=1e-12)
    assert not found.unique and found.rank == 1


def test_dependent_constraints_share_the_force() -> None:
    q, u, ud = MOTION
    found = yoke("numpy", 2).actuation(0.0, q, u, ud, inputs={"P": 0.0})
    assert np.allclose(found.lam, -needed()[0] / 2, rtol=1e-12) and found.determined == ()
    assert np.isclose(found["T"], needed()[1], rtol=1e-12)
    assert "least norm: dependent constraints share it" in repr(found)


def test_a_result_prints_names_units_rank_and_condition() -> None:
    q, u, ud = MOTION
    text = repr(yoke().actuation(0.0, q, u, ud, inputs={"P": 0.0}))
    assert text.splitlines()[0] == "yoke: inputs that make the motion at t = 0 s, unique"
    assert " T     =" in text and " N m\n" in text and "0 N  kept" in text and "slot1 =" in text
    assert "rank 1 of 1 freedoms, condition 1" in text
    assert "those of least norm of 2 for 1 freedoms" in repr(yoke().actuation(0.0, q, u, ud))
    with pytest.raises(sd.ArgumentError, match="there is no input or constraint 'Q'; there are T, P, slot1"):
        yoke().actuation(0.0, q, u, ud)["Q"]


def test_a_motion_off_the_constraints_is_rejected_or_projected() -> None:
    q, u, ud = MOTION
    module = yoke()
    for wrong, what in ((([q[0], q[1] + 1e-3], u, ud), "the positions q violate slot1"),
                        ((q, [u[0], u[1] + 1e-2], ud), "the speeds u violate slot1"),
                        ((q, u, [ud[0], ud[1] + 1e-2]), "the accelerations ud violate slot1 by 0.0098")):
        with pytest.raises(sd.ArgumentError, match=f"{what}.*pass project=True"):
            module.actuation(0.0, *wrong, inputs={"P": 0.0})
        moved = module.actuation(0.0, *wrong, inputs={"P": 0.0}, project=True)
        assert np.allclose(module.rhs(0.0, [*moved.q, *moved.u], None, moved.inputs)[2:], moved.ud, rtol=1e-12)
        assert np.allclose(moved.q, q, atol=5e-3) and np.allclose(moved.u, u, atol=5e-2) and np.allclose(moved.ud, ud, atol=0.2)
        slope = R * np.sin(moved.q[0])
        assert abs(moved.ud[1] + slope * moved.ud[0] + R * np.cos(moved.q[0]) * moved.u[0]**2) < 1e-12
    # The change of accelerations is the smallest in the metric of the mass matrix: along M^-1 C_r^T.
    moved = module.actuation(0.0, q, u, [ud[0], ud[1] + 1e-2], inputs={"P": 0.0}, project=True)
    change = np.array([INERTIA, MASS]) * (moved.ud - [ud[0], ud[1] + 1e-2])
    assert np.isclose(change[0] / change[1], R * np.sin(q[0]), rtol=1e-3)


def test_no_accelerations_at_contradicting_constraints() -> None:
    """In the top position of the yoke the slider has no acceleration along the slot but -r w^2; a second row that holds x at the
    same position contradicts it."""
    theta, x = sd.coordinates("theta x")
    s = sd.System("stuck", planar=True)
    crank, slider = s.add_body("crank", mass=1, inertia=INERTIA), s.add_body("slider", mass=MASS, inertia=1)
    s.add_joint(sd.Revolute("hinge", s.ground, crank, theta))
    s.add_joint(sd.Prismatic("guide", s.ground, slider, x, axis=[1, 0, 0]))
    s.add_constraint(x - R * sp.cos(theta), name="slot")
    s.add_constraint(x - R, name="stop")
    with pytest.warns(sd.ModelWarning, match="the constraints leave no motion"):
        module = s.augmented().compile(backend="numpy")
    with pytest.raises(sd.ArgumentError, match=r"no accelerations fulfil the constraints here: the nearest violate"):
        module.actuation(0.0, [0.0, R], [2.0, 0.0], [0.0, 0.0], project=True)


def test_gaps_that_are_rounding_need_no_other_accelerations() -> None:
    """The rounding of two equal rows contradicts itself, which no accelerations fulfil; it is nothing by the size of terms."""
    q, u, ud = MOTION
    x = np.array([*q, *u])
    found = smallest_acceleration(yoke(rows=2), 0.0, x, np.zeros(0), np.array(ud), np.array([1e-16, -2e-16]))
    assert np.allclose(found, ud, rtol=0, atol=1e-14)
    with pytest.raises(sd.ArgumentError, match="no accelerations fulfil the constraints here"):
        smallest_acceleration(yoke(rows=2), 0.0, x, np.zeros(0), np.array(ud), np.array([1e-6, -2e-6]))


def test_rounding_of_absolute_coordinates_is_no_contradiction(backend: str) -> None:
    """The inputs of least norm are those of the same arm in its angles."""
    q1, q2 = sd.coordinates("q1 q2")
    F1, F2, F3 = sd.inputs("F1 F2 F3")
    s = sd.System("arm", gravity=[0, -9.81])
    a, b = s.add_body("a", 1.0, 0.1, com=[0.3, 0]), s.add_body("b", 2.0, 0.2, com=[0.2, 0])
    s.add_joint(sd.Revolute("shoulder", "ground", a, q1))
    s.add_joint(sd.Revolute("elbow", a, b, q2, parent_point=[0.6, 0]))
    s.add_joint_force("shoulder", F1 + 0.5 * F3)
    s.add_joint_force("elbow", F2)
    module = s.augmented(coordinates="absolute").compile(backend=backend)
    q, u = module.consistent()
    ud = module.rhs(0.0, [*q, *u], inputs={F1: 1, F2: 3, F3: 2})[len(q):]
    found = module.actuation(0.0, q, u, ud, project=True).inputs.to_dict()
    # The least forces of all with F1 + F3 / 2 = 2.
    assert found == pytest.approx({"F1": 1.6, "F2": 3.0, "F3": 0.8}, rel=1e-9)


# -- fewer inputs than freedoms


@functools.cache
def cart() -> Any:
    return sd.systems.cart_pole().embedding().compile(backend="numpy")


def test_fewer_inputs_than_freedoms_name_the_direction() -> None:
    with pytest.raises(sd.ArgumentError, match=r"no inputs make this motion: F cannot work along q2 \(1.00\), where .* N m "
                                               r"is missing; rank 1 of 2 freedoms. Add an input there"):
        cart().actuation(0.0, [0.0, 0.3], [0.0, 0.0], [1.0, 2.0])
    with pytest.raises(sd.ArgumentError, match=r"no input works along q2"):
        cart().actuation(0.0, [0.0, 0.3], [0.0, 0.0], [0.0, 2.0], inputs={"F": 0.0})
    pendulum = sd.systems.pendulum().embedding().compile(backend="numpy")
    with pytest.raises(sd.ArgumentError, match=r"the system has no inputs, so nothing works along q1 \(1.00\)"):
        pendulum.actuation(0.0, [1.0], [0.0], [0.0])


def test_a_direction_of_several_coordinates_is_reported_with_its_shares() -> None:
    """Two carts on one rod: x1 and x2 move together, and no input moves them."""
    x1, x2 = sd.coordinates("x1 x2")
    s = sd.System("train")
    for name, x in (("a", x1), ("b", x2)):
        s.add_joint(sd.Prismatic(f"rail_{name}", s.ground, s.add_body(name, mass=3), x))
    s.add_constraint(x1 - x2, name="rod")
    with pytest.raises(sd.ArgumentError, match=r"nothing works along x1 \(0.50\), x2 \(0.50\), where 4.24264 N"):
        s.augmented().compile(backend="numpy").actuation(0.0, [0, 0], [0, 0], [1, 1])


def test_a_motion_that_fewer_inputs_do_make_is_found() -> None:
    x = np.array([0.1, 0.4, -0.3, 0.8])
    ud = cart().rhs(0.3, x, None, [2.5])[2:]
    found = cart().actuation(0.3, x[:2], x[2:], ud)
    assert np.isclose(found["F"], 2.5, rtol=1e-13) and found.rank == 1 and found.freedoms == 2


# -- inputs that enter nonlinearly


@functools.cache
def rotor() -> Any:
    """A mass lifted by the square of a speed, by a force and by an exponential."""
    y, (w, F, v) = sd.coordinates("y"), sd.inputs("w F v")
    s = sd.System("rotor", gravity=[0, -10.0])
    rail = s.add_joint(sd.Prismatic("rail", s.ground, s.add_body("body", mass=2), y, axis=[0, 1, 0]))
    s.add_joint_force(rail, 3 * w**2 + F + sp.exp(v) - 1)
    return s.compile(backend="numpy")


def test_nonlinear_inputs_are_found_by_newtons_method() -> None:
    """3 w^2 = m (g + a); exp(v) = 1 + m (g + a)."""
    held = {"F": 0.0, "v": 0.0}
    assert np.isclose(rotor().actuation(0.0, [0.0], [0.0], [1.0], inputs=held)["w"], np.sqrt(22 / 3), rtol=1e-13)
    below = rotor().actuation(0.0, [0.0], [0.0], [1.0], inputs=held, start={"w": -1.0})
    assert np.isclose(below["w"], -np.sqrt(22 / 3), rtol=1e-13)
    assert np.isclose(rotor().actuation(0.0, [0.0], [0.0], [1.0], inputs={"w": 0.0, "F": 0.0})["v"], np.log(23), rtol=1e-13)


def test_nonlinear_inputs_that_cannot_be_found_are_named() -> None:
    with pytest.raises(sd.ArgumentError, match=r"3 inputs are sought for 1 freedoms, but v, w enter the forces nonlinearly"
                                               r".*pass values of some of them in inputs=\{...\}"):
        rotor().actuation(0.0, [0.0], [0.0], [1.0])
    with pytest.raises(sd.ArgumentError, match=r"no values of w were found"):
        rotor().actuation(0.0, [0.0], [0.0], [-11.0], inputs={"F": 0.0, "v": 0.0})  # 3 w^2 = -2
    with pytest.raises(sd.ArgumentError, match=r"no values of v were found that make this motion: Newton's method leaves "
                                               r".* N at v = .*pass a guess in start=\{...\}"):
        rotor().actuation(0.0, [0.0], [0.0], [-11.0], inputs={"F": 0.0, "w": 0.0})  # exp(v) = -1


# -- the matrix


@pytest.mark.parametrize("backend", ["numpy", "c"])
def test_the_input_matrix_has_names(backend: str) -> None:
    B = yoke(backend).input_matrix(0.0, [0.7, R * np.cos(0.7), 0.0, 0.0])
    assert np.array_equal(B, np.eye(2)) and B["theta_dot", "T"] == 1.0 and B["x_dot", "T"] == 0.0
    assert B.names == (("theta_dot", "x_dot"), ("T", "P")) and np.array_equal(B @ [2.0, 3.0], [2.0, 3.0])
    assert repr(B).splitlines()[0].split("  ")[-1] == "P [N]" and "theta_dot [N m]" in repr(B)
    assert type(B[0]) is np.ndarray and type(B @ [1.0, 1.0]) is np.ndarray and type(2 * B) is np.ndarray
    again = pickle.loads(pickle.dumps(B))
    assert again.names == B.names and np.array_equal(again, B)
    with pytest.raises(sd.ArgumentError, match="there is no 'Q'; there are T, P"):
        B["theta_dot", "Q"]


def test_the_input_matrix_depends_on_the_state_and_on_nonlinear_inputs() -> None:
    assert rotor().input_matrix(0.0, {"y": 0.0}, None, {"w": 2.0})["y_dot", "w"] == 12.0
    y, F = sd.coordinates("phi"), sd.inputs("F")
    s = sd.System("lever", planar=True)
    rod = s.add_body("rod", mass=1, inertia=1)
    s.add_joint(sd.Revolute("hinge", s.ground, rod, y))
    s.add_force(rod, [F, 0], point=[0.0, 2.0])  # along x at the tip, which is at (-2 sin, 2 cos)
    module = s.compile(backend="numpy")
    for phi in (0.0, 0.4, 2.0):
        assert np.isclose(module.input_matrix(0.0, [phi, 0.0])[0, 0], -2 * np.cos(phi), rtol=1e-14)


def test_the_input_matrix_without_inputs_has_no_columns() -> None:
    pendulum = sd.systems.pendulum().embedding().compile(backend="numpy")
    B = pendulum.input_matrix(0.0, [0.1, 0.0])
    assert B.shape == (1, 0) and B.names == (("q1_dot",), ())
    assert "input_matrix" not in pendulum.functions and "input_matrix" in cart().functions


def test_labels_must_fit() -> None:
    with pytest.raises(sd.ArgumentError, match=r"an array of the shape \(2,\) cannot have names of \(1,\) entries"):
        Labelled([1.0, 2.0], ["a"])
    assert Labelled([1.0, 2.0], ["a", "b"]).to_dict() == {"a": 1.0, "b": 2.0}
