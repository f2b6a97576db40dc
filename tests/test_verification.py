"""verify() passes for sound equations and fails for unsound ones."""

import dataclasses

import pytest
import sympy as sp

import symdyn as sd

PRINTED = {
    "M_tilde": ["kinetic energy is quadratic"],
    "k_tilde": ["M_tilde u_dot + k_tilde = F_tilde"],
    "F_tilde": ["M_tilde u_dot + k_tilde = F_tilde"],
    "energy": ["rate of energy", "kinetic energy is quadratic"],
    "J": ["J u is the rate"],
    "positions": ["J u is the rate"],
    "inverse_dynamics": ["inverse dynamics"],
    "coriolis": ["Coriolis matrix times u", "twice the Coriolis matrix"],
}


@pytest.fixture(scope="module")
def equations():
    return sd.systems.get("two_link_arm").recursive()


def test_sound_equations_pass(equations):
    result = equations.verify(states=3)
    assert result.passed
    assert all(check.residual is not None for check in result.checks)
    assert "M_tilde is symmetric" in str(result) and "FAIL" not in str(result)


@pytest.mark.parametrize("row", range(18))
def test_every_row_of_the_jacobian_is_proved(row):
    equations = sd.systems.get("three_link_arm").embedding()
    wrong = equations.quantity("J") * 1
    wrong[row] = wrong[row] + 1e-9
    spoilt = dataclasses.replace(equations, _recorded={**equations._recorded, "J": wrong}, _printed={})
    failed = [check.name for check in spoilt.verify(states=1).checks if check.passed is False]
    assert failed == ["J u is the rate of the positions and rotations"]


def test_loads_that_leave_their_domain():
    q = sd.coordinates("q")
    system = sd.System("slider")
    body = system.add_body("body", mass=1)
    joint = system.add_joint(sd.Prismatic("slide", system.ground, body, q))
    system.add_joint_force(joint, sp.log(q))
    assert system.embedding().verify(states=2).passed
    system.add_joint_force(joint, sp.sqrt(-2 - q**2))
    with pytest.raises(sd.SymdynError, match="is defined at 0 of 80 random states only"):
        system.embedding().verify(states=2)


def test_arbitrary_inertias_are_no_failure():
    system = sd.System("chain", gravity=[0, 0, -9.81])
    parent = system.ground
    for k in range(3):
        xx, yy, zz, xy, xz, yz, m = sd.parameters(f"xx{k} yy{k} zz{k} xy{k} xz{k} yz{k} m{k}")
        body = system.add_body(f"b{k}", mass=m, inertia=[[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]], com=[0.3, 0.1, 0])
        system.add_joint(sd.Revolute(f"j{k}", parent, body, sd.coordinates(f"q{k}"), axis=[(0, 0, 1), (0, 1, 0)][k % 2]))
        parent = body
    result = system.embedding().verify(states=4)
    assert result.passed, str(result)


@pytest.mark.parametrize("quantity", PRINTED)
def test_one_wrong_quantity_is_found(equations, quantity):
    right = equations.quantity(quantity)
    wrong = right * 1
    index = next(i for i in range(wrong.size) if not isinstance(wrong.ravel()[i], int))
    wrong.ravel()[index] = wrong.ravel()[index] * (1 + 1e-9) + 1e-9
    spoilt = dataclasses.replace(equations, _recorded={**equations._recorded, quantity: wrong}, _printed={})
    result = spoilt.verify(states=2)
    assert not result.passed
    failed = [check.name for check in result.checks if check.passed is False]
    for part in PRINTED[quantity]:
        assert any(part in name for name in failed), failed


def test_negative_inertia_is_found(equations):
    result = equations.verify(states=1, params={"m1": -50.0})
    failed = {c.name for c in result.checks if c.passed is False}
    assert "M_tilde is positive definite" in failed
    assert any("NumPy module" in name for name in failed)


def test_without_numbers_definiteness_is_not_judged():
    q = sd.coordinates("q")
    mass = sd.parameters("mass")
    system = sd.System("slider")
    body = system.add_body("body", mass=mass)
    system.add_joint(sd.Prismatic("slide", system.ground, body, q))
    result = system.embedding().verify(states=1)
    check = next(c for c in result.checks if "positive definite" in c.name)
    assert check.passed is None and "without numbers" in check.remark


def test_euler_parameters_and_given_motion():
    p = sd.coordinates("p0:4")
    system = sd.System("top", gravity=[0, 0, -9.81])
    system.move_ground([0.1 * sd.t**2, 0, 0], [sd.t, 0, 0])
    body = system.add_body("body", mass=2, inertia=[1, 2, 2.5], com=[0.1, 0.2, 0.3])
    system.add_joint(sd.Spherical("joint", system.ground, body, p, sd.EulerParameters()))
    result = system.embedding().verify(states=2)
    assert result.passed, str(result)
