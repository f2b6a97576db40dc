"""Linear stiffness and damping: work, the potential, both kinds of angles, gimbal lock, warnings; in a mechanism."""

from __future__ import annotations

import functools
import warnings
from typing import Any

import mpmath
import numpy as np
import pytest
import sympy as sp
from load_site import MOTION, LeafSite, pose, tape_of
from scipy.spatial.transform import Rotation

import symdyn as sd
from symdyn.formulation.algebra import TapeAlgebra
from symdyn.model.elements.linear import SMALL, TILT, about_vector
from symdyn.spatial.vectors import vector
from symdyn.tape import Recorder, Tape
from symdyn.tape.differentiate import forward
from symdyn.tape.evaluate import evaluate
from symdyn.tape.floats import evaluate_rows
from symdyn.tape.node import COORDINATE

rng = np.random.default_rng(2)
HALF = rng.normal(size=(6, 6))
K = HALF + HALF.T + 8 * np.eye(6)
FORCE, REFERENCE = [float(v) for v in rng.normal(size=6)], [float(v) for v in rng.normal(size=6) * 0.1]
POINT = [0.3, -0.4, 0.5]


def stiffness(**given: Any) -> sd.LinearStiffness:
    return sd.LinearStiffness("float", **{"K": K, "force": FORCE, "point": POINT, "reference": REFERENCE, **given})


# -- stiffness

def expected(x: Any, turned: bool) -> np.ndarray:
    """F = force - K (xi - reference), with xi in numbers."""
    names = ("r1", "r2", "r3") if turned else ("phi", "theta", "psi")
    a = np.array([x[name] for name in names])
    R = Rotation.from_rotvec(a) if turned else Rotation.from_euler("ZYX", a[::-1])
    xi = np.concatenate([[x["x"], x["y"], x["z"]] + R.apply(POINT), a])
    return np.array(FORCE) - K @ (xi - REFERENCE)


@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize("seed", range(4))
def test_the_work_along_coordinates_of_a_point(seed: int, turned: bool) -> None:
    """Generalized forces along the coordinates of the body's origin, which the point's coordinates are made of."""
    x = pose(seed, turned, reach=1.2)
    found = evaluate_rows(tape_of(stiffness(), turned), x, 1)
    F = expected(x, turned)
    site = LeafSite(turned)
    place = site.p + site.R @ np.array(POINT, dtype=object)
    J = np.array([forward(site.recorder, place, {leaf: 1}) for leaf in site.coordinates], dtype=object).T
    J = evaluate_rows(Tape.of(site.recorder, J=J), x, 1)["J"][0]
    np.testing.assert_allclose(found["elastic"][0], J.T @ F[:3] + [0, 0, 0, *F[3:]], rtol=1e-12, atol=1e-12)
    np.testing.assert_array_equal(found["other"][0], 0)


@pytest.mark.parametrize("turned", [False, True])
def test_the_force_is_the_gradient_of_the_potential(turned: bool) -> None:
    found = evaluate(tape_of(stiffness(), turned), pose(5, turned, reach=1.4), 40)
    assert max(abs(found["elastic"] - found["gradient"])) < mpmath.mpf(10) ** -36


def test_what_is_not_symmetric_does_work_and_nothing_is_lost() -> None:
    skew = rng.normal(size=(6, 6))
    skew = skew - skew.T
    x = pose(6)
    whole = evaluate_rows(tape_of(stiffness(K=K + skew)), x, 1)
    even, odd = evaluate_rows(tape_of(stiffness()), x, 1), evaluate_rows(tape_of(stiffness(K=skew, force=[0] * 6)), x, 1)
    np.testing.assert_allclose(whole["elastic"], even["elastic"], rtol=1e-12)
    np.testing.assert_allclose(whole["other"], odd["other"], rtol=1e-12)
    np.testing.assert_allclose(odd["elastic"], 0, atol=1e-14)
    assert abs(odd["other"]).max() > 0.1
    np.testing.assert_allclose(whole["elastic"], whole["gradient"], rtol=1e-12)


def test_both_kinds_of_angles_agree_for_small_angles() -> None:
    """Up to terms of second order, where force and moment vanish with the angles."""
    spring = stiffness(force=[0] * 6, reference=[0] * 6, point=[0, 0, 0])

    def moment(size: float, turned: bool) -> np.ndarray:
        angles = dict(zip(("r1", "r2", "r3") if turned else ("phi", "theta", "psi"), size * np.array([1, -2, 1.5]), strict=True))
        at = {**pose(7, turned), "x": 0.0, "y": 0.0, "z": 0.0, **angles}
        return evaluate_rows(tape_of(spring, turned), at, 1)["n"][0]

    differences = [abs(moment(size, False) - moment(size, True)).max() for size in (1e-2, 1e-3)]
    assert differences[0] / differences[1] == pytest.approx(100, rel=0.05)
    assert differences[1] < 1e-3 * abs(moment(1e-3, False)).max() * 5


def test_auto_takes_the_angles_of_the_joint_if_there_are_any() -> None:
    site = LeafSite()
    assert not hasattr(site, "rotation_vector")
    stiffness(angles="auto").act(site)  # type: ignore[arg-type]
    with pytest.raises(AttributeError, match="rotation_vector"):
        stiffness(angles="rotation vector").act(site)  # type: ignore[arg-type]
    turned = LeafSite(turned=True)
    stiffness(angles="auto").act(turned)  # type: ignore[arg-type]
    with pytest.raises(AttributeError, match="angles"):
        stiffness(angles="ZYX").act(turned)  # type: ignore[arg-type]


class Vector:
    """A site of nothing but a rotation vector."""

    def __init__(self) -> None:
        self.recorder = Recorder()
        self.leaves = [self.recorder.leaf(name, COORDINATE) for name in ("r1", "r2", "r3")]
        self.rotation_vector = vector(*self.leaves)
        self.algebra = TapeAlgebra(self.recorder, {})


@functools.cache
def moments() -> Tape:
    """The moment of Q = (1, -2, 3) - r with its first and second derivatives by the rotation vector r."""
    site = Vector()
    n = about_vector(site, vector(1, -2, 3) - site.rotation_vector)  # type: ignore[arg-type]
    first = [forward(site.recorder, n, {leaf: 1}) for leaf in site.leaves]
    second = [[forward(site.recorder, row, {leaf: 1}) for row in first] for leaf in site.leaves]
    return Tape.of(site.recorder, n=n, first=np.array(first, dtype=object), second=np.array(second, dtype=object))


def moment_at(r: Any, digits: int = 40) -> dict[str, np.ndarray]:
    return evaluate(moments(), dict(zip(("r1", "r2", "r3"), r, strict=True)), digits)


# At zero, on both sides of where the series ends, and far.
@pytest.mark.parametrize("r", [(0.0, 0.0, 0.0), (0.0, 0.0999, 0.0), (0.0, 0.1001, 0.0), (1.0, -2.0, 1.5)])
def test_moments_of_the_rotation_vector_have_derivatives(r: tuple) -> None:
    found, step = moment_at(r), mpmath.mpf(10) ** -12
    with mpmath.workdps(50):
        for k in range(3):
            sides = [moment_at([mpmath.mpf(v) + sign * step * (i == k) for i, v in enumerate(r)]) for sign in (1, -1)]
            for quantity, derivative in (("n", found["first"][k]), ("first", found["second"][k])):
                wanted = (sides[0][quantity] - sides[1][quantity]) / (2 * step)
                assert max(abs(v) for v in (wanted - derivative).ravel()) < mpmath.mpf(10) ** -20
    in_floats = evaluate_rows(moments(), dict(zip(("r1", "r2", "r3"), r, strict=True)), 1)
    for name in ("n", "first", "second"):
        np.testing.assert_allclose(in_floats[name][0], found[name].astype(float), rtol=0, atol=1e-13)


def test_the_series_of_the_rotation_vector_meets_the_closed_form() -> None:
    with mpmath.workdps(50):
        edge = mpmath.sqrt(mpmath.mpf(SMALL.numerator) / SMALL.denominator)
        jump = moment_at([0, edge * (1 - mpmath.mpf(10) ** -45), 0])["n"] - moment_at([0, edge, 0])["n"]
        assert max(abs(jump)) < mpmath.mpf(10) ** -25


def test_tilt_has_a_range_of_validity() -> None:
    site = LeafSite()
    action = stiffness(name="water plane").act(site)  # type: ignore[arg-type]
    check = action.validity_checks[0]
    assert (check.label, check.most) == ("tilt of water plane", TILT) and check.least < 0
    assert "water plane" in check.message and "{value}" in check.message and "20 degrees" in check.message
    x = pose(8)
    found = evaluate_rows(site.tape(action), x, 1)["validity_checks"][0, 0]
    assert found == pytest.approx(np.degrees(np.arccos(np.cos(x["theta"]) * np.cos(x["phi"]))), rel=1e-12)
    level = pose(8, phi=0.0, theta=0.0)
    assert evaluate_rows(site.tape(action), level, 1)["validity_checks"][0, 0] == 0


# -- damping

def test_damping_acts_against_the_motion_of_the_point() -> None:
    B = HALF @ HALF.T
    damping = sd.LinearDamping("float", B, point=POINT)
    assert not damping.faults
    x = pose(9)
    found = evaluate_rows(tape_of(damping), x, 1)
    omega, v = np.split(np.array([x[name] for name in MOTION]), 2)
    moved = np.concatenate([v + np.cross(omega, POINT), omega])
    F = -B @ moved
    np.testing.assert_allclose(found["f"][0], F[:3], rtol=1e-12)
    np.testing.assert_allclose(found["n"][0], F[3:] + np.cross(POINT, F[:3]), rtol=1e-12)
    assert float(found["power"][0]) == pytest.approx(-moved @ B @ moved, rel=1e-12)
    np.testing.assert_array_equal(found["elastic"], 0)


# -- in a mechanism

def floating(orientation: Any, **given: Any) -> sd.System:
    s = sd.System("floating", gravity=[0, 0, -9.81])
    b = s.add_body("float", mass=2, inertia=[3, 4, 5], com=[0.1, 0, -0.2])
    s.add_joint(sd.Free("joint", s.ground, b, orientation=orientation))
    k, c, f = sd.parameters("k c f")
    s.add_load(stiffness(**{"K": [k, k, 30, 20, 25, 10], "force": [f, 0, 0, 0, 0, 0], "name": "spring", **given}))
    s.add_load(sd.LinearDamping("float", [1, 2, c, 4, 5, 6], point=POINT, name="damper"))
    s.defaults = {k: 8.0, c: 3.0, f: 1.0}
    return s


@functools.cache
def module(angles: str, parameters: bool) -> Any:
    orientation = sd.EulerParameters() if parameters else sd.EulerAngles("ZYX", speeds="body")
    return floating(orientation, angles=angles).recursive().compile(backend="numpy")


def test_parameters_have_units() -> None:
    units = {str(symbol): unit for symbol, unit in floating(sd.EulerParameters()).check().units.items()}
    assert (units["k"], units["c"], units["f"]) == ("N/m", "N s/m", "N")


def test_euler_angles_and_euler_parameters_move_alike() -> None:
    """The stiffness by the rotation vector, on which both depend in their own way."""
    for _ in range(5):
        place, a, u = rng.normal(size=3), rng.uniform(-1.2, 1.2, 3), rng.normal(size=6)
        e = Rotation.from_euler("ZYX", a).as_quat()[[3, 0, 1, 2]]
        one = module("rotation vector", False).rhs(0.0, np.array([*place, *a, *u]))
        other = module("auto", True).rhs(0.0, np.array([*place, *e, *u]))
        np.testing.assert_allclose(one[6:], other[7:], rtol=1e-11, atol=1e-11)


def test_a_pitch_of_90_degrees_is_none_for_the_rotation_vector() -> None:
    e = Rotation.from_euler("ZYX", [0, np.pi / 2, 0]).as_quat()[[3, 0, 1, 2]]
    assert np.all(np.isfinite(module("auto", True).rhs(0.0, np.array([0, 0, 0, *e, *[0.1] * 6]))))


def test_zyx_angles_stop_at_a_pitch_of_90_degrees() -> None:
    e = Rotation.from_euler("ZYX", [0.3, np.pi / 2, 0]).as_quat()[[3, 0, 1, 2]]
    with pytest.raises(sd.EvaluationError, match=r"spring: gimbal lock, the pitch angle is 90 degrees.*angles='rotation vector'"):
        module("ZYX", True).rhs(0.0, np.array([0, 0, 0, *e, *[0.1] * 6]))


def test_the_energy_that_is_lost_is_the_work_of_the_damper() -> None:
    with pytest.warns(sd.SimulationWarning, match=r"spring: the body tilts by 40\.5\d* degrees; .* up to 20 degrees"):
        sol = module("rotation vector", False).simulate(t=(0, 20), q=[0.5, 0, 0, 0.5, 0.6, -0.4], rtol=1e-10, work=True)
    assert sol.success
    assert sol.energy_error() < 1e-8
    assert sol.work[-1] < -0.5 * sol.energies[:, 0].max() < 0


# -- faults

FAULTS: dict[str, tuple[Any, str]] = {
    "K": (lambda: stiffness(K=np.eye(3)), "K is not a 6 x 6 matrix; pass 6 rows of 6, or the 6 diagonal entries"),
    "K of NaN": (lambda: stiffness(K=np.diag([1, 1, 1, 1, 1, np.nan])), r"K\[6, 6\] is nan; pass a finite number"),
    "force": (lambda: stiffness(force=[1, 2, 3]), "force has 3 components; pass 6: three along x, y, z, three about them"),
    "point": (lambda: stiffness(point=[1, 2]), "point has 2 components; pass 3"),
    "reference": (lambda: stiffness(reference=1), "reference has 1 components; pass 6"),
    "angles": (lambda: stiffness(angles="XYZ"), "angles is 'XYZ'; pass one of 'auto', 'ZYX', 'rotation vector'"),
    "B": (lambda: sd.LinearDamping("float", [[1, 2], [3, 4]]), "B is not a 6 x 6 matrix"),
    "damped point": (lambda: sd.LinearDamping("float", [1] * 6, point="here"), "point is 'here'; pass a list"),
    "text": (lambda: sd.LinearDamping("float", ["1"] * 6), r"B\[1, 1\] is the text '1'"),
    "moving": (lambda: stiffness(force=[sp.sin(sd.t), 0, 0, 0, 0, 0]), "depends on t, but must be constant"),
}


@pytest.mark.parametrize("name", FAULTS)
def test_faults(name: str) -> None:
    make, message = FAULTS[name]
    s = floating(sd.EulerParameters())
    s.add_load(make())
    with pytest.raises(sd.ModelError, match=f"(linear (stiffness|damping) on float: |linear stiffness_3 ){message}"):
        s.check()


def test_damping_that_feeds_energy_is_reported() -> None:
    """Skew parts do no work; a symmetric part [[1, 2], [2, 1]] has the eigenvalue -1."""
    def checked(b: float, sign: int) -> None:
        B = np.eye(6)
        B[0, 1], B[1, 0] = b, sign * b
        s = floating(sd.EulerParameters())
        s.add_load(sd.LinearDamping("float", B, name="radiation"))
        s.check()

    with pytest.warns(sd.ModelWarning, match="radiation: the symmetric part of B has the eigenvalue -1, so that it feeds energy"):
        checked(2.0, 1)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        checked(2.0, -1)
        checked(1.0, 1)
