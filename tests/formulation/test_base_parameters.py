"""Base parameters: their number, what they are made of, and that the equations need no others."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import sympy as sp

import symdyn as sd
from symdyn.errors import SymdynError
from symdyn.formulation.equations import Equations
from symdyn.formulation.identification import base_parameters
from symdyn.formulation.identification.regrouping import factors
from symdyn.formulation.probes.independent import independent
from symdyn.formulation.trees.equations import tree_of
from symdyn.model.symbols import symbols_of
from symdyn.spatial.vectors import vector
from symdyn.tape import Recorder, Tape
from symdyn.tape.floats import evaluate_rows
from symdyn.tape.node import ACCELERATION, COORDINATE, PARAMETER
from tests import helpers
from tests.formulation.general import chain, general_body
from tests.formulation.test_identities import SEEDS, Draw
from tests.mechanisms import kitchen_sink


def at_random_states(eq: Equations, n: int, *names: str) -> dict[str, np.ndarray]:
    """Quantities in double precision at n random states, one set of parameters, other than those the derivation takes."""
    rng = np.random.default_rng(7)
    tape = eq.tape(*names)
    values: dict[str, Any] = {leaf.args[1]: rng.uniform(0.5, 1.5) if leaf.mask == PARAMETER else rng.uniform(-2, 2, n)
                              for leaf in tape.inputs}
    for group in eq.unit_groups:
        for q in group:
            values.setdefault(q.name, rng.uniform(-2, 2, n))
        length = np.sqrt(sum(values[q.name] ** 2 for q in group))
        values.update({q.name: values[q.name] / length for q in group})
    return evaluate_rows(tape, values, n)


def sufficient(eq: Equations) -> int:
    """Check that Y_b pi_b = Y pi; returns the rank of Y, the independent count of base parameters."""
    n = 4 + 24 * len(eq.quantity("frames")) // len(eq.symbols.speeds)
    found = at_random_states(eq, n, "regressor", "inertial_parameters", "base_regressor", "base_parameters")
    tau = np.einsum("nij,nj->ni", found["regressor"], found["inertial_parameters"])
    other = np.einsum("nij,nj->ni", found["base_regressor"], found["base_parameters"])
    assert np.abs(tau - other).max() < 1e-11 * np.abs(tau).max()
    Y = found["regressor"].reshape(-1, found["regressor"].shape[2])
    sizes = np.linalg.norm(Y, axis=0)
    singular = np.linalg.svd(Y[:, sizes > 1e-9] / sizes[sizes > 1e-9], compute_uv=False)
    return int((singular > 1e-9 * singular[0]).sum())


# Mayeda, Yoshida and Osuka, Base parameters of manipulator dynamic models (1990): 7 n - 4 b for n revolute joints of which the
# first b are parallel, 7 n - 4 b - 2 if they are parallel to gravity, or if there is none.
@pytest.mark.parametrize(("name", "options", "count"), [
    ("puma560", {"general": True}, 36), ("puma560", {"general": True, "convention": "modified"}, 36),
    *[("spatial_chain", {"n": n}, 7 * n - 6) for n in (1, 2, 3, 7)]])
def test_serial_arms_by_the_closed_formula(name: str, options: dict[str, Any], count: int) -> None:
    eq = sd.systems.get(name, **options).embedding()
    assert len(eq.base_parameters()) == count == sufficient(eq)


@pytest.mark.parametrize(("joints", "gravity", "count"), [
    ("Ry Ry Ry", (0, 0, -1), 7 * 3 - 4 * 3), ("Ry Ry Rx", (0, 0, -1), 7 * 3 - 4 * 2), ("Rz Rz Rz", (0, 0, -1), 7 * 3 - 4 * 3 - 2),
    ("Ry Ry Ry", (0, 0, 0), 7 * 3 - 4 * 3 - 2), ("Px Py Pz", (0, 0, -1), 3),
    ("Fr", (0, 0, -1), 10), ("Fr+", (0, 0, 0), 10), ("Fr+ Rz", (0, 0, -1), 17), ("Fr+ Rw", (0, 0, 0), 17),
    ("Fr Py", (0, 0, -1), 14), ("Fr+ Sp+", (0, 0, -1), 19), ("Fr+ Fr", (0, 0, -1), 20), ("Sp", (0, 0, -1), 9),
    ("Sp+", (0, 0, -1), 9), ("Rz Rz Pz Rz", (0, 0, -1), 8)])
def test_counts(joints: str, gravity: tuple[int, ...], count: int) -> None:
    eq = chain(joints, gravity).embedding()
    assert len(eq.base_parameters()) == count == sufficient(eq)


@pytest.mark.parametrize("joints", ["Rz Px Rz", "Ry Px Pz", "Px Rx Px Ry", "Pz Px Ry", "Rx Px Rx Ry", "Un Un", "Pl Cy",
                                    "He Cy Sp+", "Cy Rw Pw", "Fr+ Pl", "Ry Ry Ry Py"])
def test_count_is_the_rank_of_the_regressor(joints: str) -> None:
    eq = chain(joints).embedding()
    assert len(eq.base_parameters()) == sufficient(eq)


@pytest.mark.parametrize("seed", SEEDS)
def test_trees_with_given_motion_and_coupled_speeds(seed: int) -> None:
    eq = Draw(seed).s.embedding()
    sufficient(eq)
    least, most = eq.base_parameters().margins
    assert least > 0.01 and most < 1e-12


def test_planar_pendulums_have_two_a_link() -> None:
    l1, l2, lc1, lc2, lc3, m1, m2, m3, I1, I2, I3 = sd.parameters("l1 l2 lc1 lc2 lc3 m1 m2 m3 I1 I2 I3")
    found = sd.systems.get("n_link_pendulum", n=3).embedding().base_parameters()
    assert found.names == ("h_x_rod1", "I_zz_rod1", "h_x_rod2", "I_zz_rod2", "h_x_rod3", "I_zz_rod3")
    assert list(found.expressions) == [
        lc1 * m1 + l1 * m2 + l1 * m3, I1 + lc1**2 * m1 + l1**2 * m2 + l1**2 * m3, lc2 * m2 + l2 * m3,
        I2 + lc2**2 * m2 + l2**2 * m3, lc3 * m3, I3 + lc3**2 * m3]
    assert len(sd.systems.get("n_link_pendulum", n=8).embedding("parallel").base_parameters()) == 16


def test_double_pendulum_in_closed_form() -> None:
    eq = sd.systems.get("double_pendulum").embedding()
    found = eq.base_parameters()
    q1, q2 = sd.coordinates("q1 q2")
    g, l1 = sd.parameters("g l1")
    swing = l1 * (q2.ddot + 2 * q1.ddot) * sp.cos(q2) - l1 * (q2.dot + 2 * q1.dot) * q2.dot * sp.sin(q2) + g * sp.cos(q1 + q2)
    wanted = sp.Matrix([[g * sp.cos(q1), q1.ddot, swing, q1.ddot + q2.ddot],
                        [0, 0, l1 * q1.ddot * sp.cos(q2) + l1 * q1.dot**2 * sp.sin(q2) + g * sp.cos(q1 + q2), q1.ddot + q2.ddot]])
    difference = found.regressor - wanted
    at = {a: sp.Rational(k + 3, 7) for k, a in enumerate(sorted(symbols_of(difference), key=str))}
    assert max(abs(sp.N(e.xreplace(at), 30)) for e in difference) < 1e-25
    assert found.symbols == sp.Matrix(sp.symbols("h_x_rod1 I_zz_rod1 h_x_rod2 I_zz_rod2"))
    assert np.allclose(found.values(), [1.5, 4 / 3, 0.5, 1 / 3])
    assert np.allclose(found.values({"m2": 0, sp.Symbol("I1"): 2}), [0.5, 2.25, 0, 1 / 12])
    text = str(found)
    assert "double_pendulum: 4 base parameters" in text and "h_x_rod1 = l1*m2 + lc1*m1" in text


def test_groups_of_a_turning_and_a_sliding_link() -> None:
    m1, I1_xx, c1_x, c1_y, u1, v1 = sd.parameters("m1 I1_xx c1_x c1_y u1 v1")
    found = chain("Rz Pz").embedding().base_parameters()
    assert found.names == ("I_zz_b0", "m_b1")
    assert found.expressions[1] == m1
    assert sp.expand(found.expressions[0].diff(m1) - c1_x**2 - c1_y**2 - 2 * u1 * c1_x - 2 * v1 * c1_y) == 0
    found = chain("Sp Rz").embedding().base_parameters()
    row = dict(zip(found.names, found.expressions, strict=True))
    assert "I_xx_b1" not in row and "m_b1" not in row and "h_z_b1" not in row
    assert row["I_yy_b1"].coeff(I1_xx) == -1 and row["h_x_b0"].coeff(m1) == u1


def test_motors_are_grouped_with_the_links_they_drive() -> None:
    """Gears squared times rotor inertia add to the links of the first two joints, whose axes are perpendicular."""
    found = sd.systems.get("puma560", motors=True).embedding().base_parameters()
    row = dict(zip(found.names, found.expressions, strict=True))
    G1, G2, Jm1, Jm2, Jm3 = sd.parameters("G1 G2 Jm1 Jm2 Jm3")
    assert row["I_zz_link1"].coeff(Jm1) == G1**2 and row["I_zz_link2"].coeff(Jm2) == G2**2 and row["I_zz_rotor3"] == Jm3
    assert len(found) == 26 and len(sd.systems.get("puma560").embedding().base_parameters()) == 22


def test_frames_and_formulations_agree() -> None:
    given = {eq.formulation + eq.frames: eq.base_parameters() for eq in (
        chain("Ry Ry Px Ry").embedding(), chain("Ry Ry Px Ry").embedding("parallel"), chain("Ry Ry Px Ry").recursive())}
    assert len(given) == 3 and len({str(b) for b in given.values()}) == 1


def test_branches_are_counted_to_the_body_that_carries_them() -> None:
    s = sd.System("branches", gravity=[0, 0, -sd.parameters("g")])
    trunk, left, right = (general_body(s, k) for k in range(3))
    s.add_joint(sd.Free("base", s.ground, trunk, orientation=sd.EulerParameters()))
    for side, body in (("left", left), ("right", right)):
        s.add_joint(sd.Revolute(side, trunk, body, axis=[1, 0, 0], parent_point=sd.parameters(f"{side}_x {side}_y {side}_z")))
    eq = s.embedding()
    found = eq.base_parameters()
    assert len(found) == 10 + 7 + 7 == sufficient(eq)
    assert found.expressions[0] == sum(sd.parameters("m0 m1 m2"))


def test_euler_parameters_of_the_random_states_have_unit_length() -> None:
    s = sd.System("unit")
    for k, kind in enumerate((sd.Free, sd.Spherical)):
        s.add_joint(kind(f"joint{k}", s.ground, general_body(s, k), orientation=sd.EulerParameters()))
    free, ball = ([q.name for q in joint.coordinates[-4:]] for joint in s.joints)
    assert base_parameters._unit_groups(tree_of(s.check(), "body")) == [free, ball] and len(ball) == 4


def test_identification() -> None:
    """Base parameters from torques along a motion, by linear least squares, with compiled functions."""
    eq = sd.systems.get("spatial_chain", n=3).embedding()
    module, found = eq.compile(backend="numpy"), eq.base_parameters()
    rng = np.random.default_rng(3)
    x, ud = rng.uniform(-2, 2, (40, 6)), rng.uniform(-5, 5, (40, 3))
    tau = module.evaluate("inverse_dynamics", 0.0, x, None, ud=ud)
    A = module.evaluate("base_regressor", 0.0, x, None, ud=ud).reshape(-1, len(found))
    assert np.linalg.cond(A / np.linalg.norm(A, axis=0)) < 100
    estimate = np.linalg.lstsq(A, tau.ravel(), rcond=None)[0]
    assert np.allclose(estimate, found.values(), rtol=1e-10, atol=1e-12)
    assert np.allclose(module.evaluate("base_parameters", 0.0, x[0]), found.values(), rtol=1e-14)


def test_written_files_do_not_depend_on_what_was_asked_before() -> None:
    from symdyn.pipeline import emit

    first = sd.systems.get("two_link_arm").embedding()
    first.base_parameters()
    other = sd.systems.get("two_link_arm").embedding()
    functions = ("base_regressor", "base_parameters", "regressor")
    assert emit(first, "c", functions).files == emit(other, "c", functions).files


# -- the parts


def test_regrouping_by_elimination() -> None:
    """Factors that no single entry shows, with parameters in all of them."""
    r = Recorder()
    p, q = r.leaf("p", PARAMETER), r.leaf("q", COORDINATE)
    a, b = (r.leaf(f"u{k}_dot", ACCELERATION) for k in "ab")
    columns = np.array([[a + b, p * a - b], [2 * b - a, r.cos(q) * b + 3 * a]], dtype=object)
    x = vector(p * p, 1 / p)
    found = factors(r, columns, columns @ x, {"p": 0.8}, [])
    numbers = evaluate_rows(Tape.of(r, found=vector(*found)), {"p": 1.3}, 1)["found"][0]
    assert np.allclose(numbers, [1.69, 1 / 1.3])
    assert all(leaf.args[1] == "p" for leaf in Tape.of(r, found=vector(*found)).inputs)


def test_independent_columns_are_the_first() -> None:
    rng = np.random.default_rng(2)
    A = rng.normal(size=(30, 5))
    A[:, 3] = 2 * A[:, 0] - 0.5 * A[:, 2]
    A[:, 1] = 0
    found = independent(A, "abcde")
    assert (found.zero, found.kept) == ((1,), (0, 2, 4))
    assert found.coefficients[3] == pytest.approx({0: 2.0, 2: -0.5})
    assert found.margins[0] > 0.1 and found.margins[1] < 1e-14


def test_doubtful_columns_are_rejected() -> None:
    A = np.eye(4)[:, :3].copy()
    A[:, 2] = A[:, 0] + [0, 0, 0, 3e-8]
    with pytest.raises(SymdynError, match="whether c can be distinguished from the parameters before it is unclear in double"):
        independent(A, "abc")


def test_without_bodies() -> None:
    q = sd.coordinates("q")
    with pytest.raises(SymdynError, match="has no bodies, so no inertial parameters"):
        sd.embedding([q], [q, q**2], [1, 1]).base_parameters()


def test_numbers_that_are_missing() -> None:
    found = chain("Rz Rx").embedding().base_parameters()
    with pytest.raises(SymdynError, match=r"no value for .*I0_zz"):
        found.values({"m1": 1})


def test_many_points_at_once() -> None:
    """The evaluation in floats against 30 digits, on every operation of the tape."""
    tape = kitchen_sink().embedding().tape("rhs", "output_smooth", "output_pair")
    points = [helpers.numbers([leaf.args[1] for leaf in tape.inputs], seed) for seed in (1, 2, 3)]
    rows = {name: np.array([float(p[name]) for p in points]) for name in points[0]}
    found = evaluate_rows(tape, rows, 3)
    for k, point in enumerate(points):
        for name, value in helpers.at(tape, point).items():
            assert np.allclose(found[name][k], value.astype(float), rtol=1e-12)
    with pytest.raises(KeyError, match="no value for F"):
        evaluate_rows(tape, {name: value for name, value in rows.items() if name != "F"}, 3)


def test_unknown_parameters_of_values_are_named() -> None:
    base = sd.systems.get("double_pendulum").recursive().base_parameters()
    with pytest.raises(SymdynError, match=r"double_pendulum: parameters: there is no 'mm', did you mean m2 or m1"):
        base.values({"mm": 1.0})
    for wrong, message in (({"m1": float("nan")}, "must be finite, found m1 = nan"), ({"m1": "a"}, "is 'a', not a number"),
                           ([1.0, 2.0], r"has the shape \(2,\), needed are 8 numbers")):
        with pytest.raises(SymdynError, match=message):
            base.values(wrong)
    assert np.allclose(base.values([9.81, 1, 0.5, 0.1, 2, 0.3, 0.2, 1]), base.values(
        {"m1": 1, "lc1": 0.5, "I1": 0.1, "m2": 2, "lc2": 0.3, "I2": 0.2, "l1": 1}))
