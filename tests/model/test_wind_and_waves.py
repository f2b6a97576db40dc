"""Waves, drag and thrust: against the formulas in numbers; all loads together in a mechanism."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import Any

import mpmath
import numpy as np
import pytest
import sympy as sp
from load_site import ANGLES, MOTION, PLACE, LeafSite, pose, tape_of
from scipy.spatial.transform import Rotation

import symdyn as sd
from symdyn.systems.barge_mooring import EA, LENGTH, line_weight
from symdyn.tape import Tape
from symdyn.tape.differentiate import forward
from symdyn.tape.evaluate import evaluate
from symdyn.tape.floats import evaluate_rows

POINT = [0.3, -0.4, 0.5]


def moved(x: Any) -> tuple[np.ndarray, np.ndarray]:
    """R, and the velocity of POINT, n-frame."""
    R = Rotation.from_euler("ZYX", [x[name] for name in ANGLES[::-1]]).as_matrix()
    omega, v = np.split(np.array([x[name] for name in MOTION]), 2)
    return R, R @ (v + np.cross(omega, POINT))


# -- waves

AMPLITUDE, PHASE = [1.0, 2.0, -3.0, 4.0, 5.0, -6.0], [0.1, -0.2, 0.3, 1.4, -2.5, 3.6]


@pytest.mark.parametrize(("ramp", "t", "grown"), [(None, 2.5, 1.0), (None, -1.0, 1.0), (4.0, 1.0, 0.5 - np.sqrt(0.125)),
                                                  (4.0, 2.0, 0.5), (4.0, 4.0, 1.0), (4.0, 9.0, 1.0), (4.0, -1.0, 0.0)])
def test_waves_push_along_the_axes_of_the_n_frame(ramp: float | None, t: float, grown: float) -> None:
    waves = sd.WaveExcitation("float", AMPLITUDE, PHASE, 0.7, point=POINT, ramp=ramp)
    x = pose(1, t=t)
    found = evaluate_rows(tape_of(waves), x, 1)
    R, _ = moved(x)
    F = np.array(AMPLITUDE) * np.cos(0.7 * t + np.array(PHASE)) * grown
    f = R.T @ F[:3]
    np.testing.assert_allclose(found["f"][0], f, rtol=1e-12, atol=1e-15)
    np.testing.assert_allclose(found["n"][0], R.T @ F[3:] + np.cross(POINT, f), rtol=1e-12, atol=1e-15)
    assert not found["elastic"].any() and not found["potential"].any()


def test_waves_grow_smoothly() -> None:
    """The force and its rate are without jumps where the ramp begins and ends."""
    site = LeafSite()
    action = sd.WaveExcitation("float", AMPLITUDE, PHASE, 0.7, ramp=4).act(site)  # type: ignore[arg-type]
    t = site.algebra.expression(sd.t)
    tape = Tape.of(site.recorder, rate=np.array(forward(site.recorder, action.other[0], {t: 1}), dtype=object))
    for edge in (0.0, 4.0):
        before, after = (evaluate_rows(tape, pose(1, t=edge + d), 1)["rate"][0] for d in (-1e-9, 1e-9))
        np.testing.assert_allclose(before, after, atol=1e-7)


# -- drag

def test_drag_is_along_the_air_that_the_point_sees() -> None:
    u = sd.inputs("u")
    wind = [u, 2 + sd.t, -0.5]
    drag = sd.Drag("float", 7, 1.2, 1.225, wind=wind, point=POINT)
    x = pose(2, t=0.3, u=9.0)
    found = evaluate_rows(tape_of(drag, inputs=[u]), x, 1)
    R, v = moved(x)
    v_r = np.array([9.0, 2.3, -0.5]) - v
    f = R.T @ (0.5 * 1.225 * 1.2 * 7 * np.linalg.norm(v_r) * v_r)
    np.testing.assert_allclose(found["f"][0], f, rtol=1e-12)
    np.testing.assert_allclose(found["n"][0], np.cross(POINT, f), rtol=1e-12)


def test_drag_in_still_air_only_takes_energy() -> None:
    for seed in range(3, 8):
        x = pose(seed)
        found = evaluate_rows(tape_of(sd.Drag("float", 7, 1.2, 1.225, point=POINT)), x, 1)
        assert float(found["power"][0]) == pytest.approx(-0.5 * 7 * 1.2 * 1.225 * np.linalg.norm(moved(x)[1]) ** 3, rel=1e-12)


def test_drag_has_derivatives_at_rest() -> None:
    """They are zero, in floats and with many digits; elsewhere they are those of |v| v."""
    site = LeafSite()
    action = sd.Drag("float", 2, 1, 1).act(site)  # type: ignore[arg-type]
    first = [forward(site.recorder, action.other[0], {leaf: 1}) for leaf in site.v]
    second = [forward(site.recorder, row, {site.v[0]: 1}) for row in first]
    tape = Tape.of(site.recorder, f=action.other[0], first=np.array(first, dtype=object), second=np.array(second, dtype=object))
    x = {**pose(1), **dict.fromkeys(MOTION, 0.0)}
    for found in (evaluate_rows(tape, x, 1), evaluate(tape, x, 30)):
        np.testing.assert_array_equal(found["f"].astype(float).ravel(), 0)
        np.testing.assert_allclose(found["first"].astype(float), 0, atol=2e-15)
        assert np.all(np.isfinite(found["second"].astype(float)))
    v = np.array([0.3, -0.4, 1.2])
    moving = evaluate_rows(tape, {**x, **dict(zip(MOTION[3:], v, strict=True))}, 1)
    speed = np.linalg.norm(v)
    np.testing.assert_allclose(moving["first"][0], -(speed * np.eye(3) + np.outer(v, v) / speed), rtol=1e-12)


# -- thrust

def test_thrust_follows_from_the_speed_along_the_axis() -> None:
    u, c = sd.inputs("u"), sd.parameters("c")
    thrust = sd.Thrust("float", lambda v: c * v**2 + sp.sin(sd.t) + u, axis=[3, 0, 4], point=POINT, wind=[10, u, 0])
    assert {str(e) for e in thrust.expressions} == {"10", "u", "0", "c", "t"}
    x = pose(4, t=0.7, u=2.0, c=1.5)
    found = evaluate_rows(tape_of(thrust, inputs=[u], parameters=[c]), x, 1)
    R, v = moved(x)
    axis = np.array([0.6, 0, 0.8])
    speed = axis @ R.T @ (np.array([10, 2.0, 0]) - v)
    f = (1.5 * speed**2 + np.sin(0.7) + 2.0) * axis
    np.testing.assert_allclose(found["f"][0], f, rtol=1e-12)
    np.testing.assert_allclose(found["n"][0], np.cross(POINT, f), rtol=1e-12)


def test_a_symbol_of_the_same_name_is_another() -> None:
    v_r = sd.parameters("v_r")
    found = evaluate_rows(tape_of(sd.Thrust("float", lambda v: v + v_r), parameters=[v_r]), {
        **pose(4, v_r=100.0), **dict.fromkeys([*MOTION, *PLACE], 0.0)}, 1)
    np.testing.assert_allclose(found["f"][0], [100, 0, 0])


@pytest.mark.parametrize("force", [5, sp.Integer(5), lambda v: 5])
def test_thrust_may_be_constant(force: Any) -> None:
    found = evaluate_rows(tape_of(sd.Thrust("float", force, axis=[0, -2, 0])), pose(4), 1)
    np.testing.assert_array_equal(found["f"][0], [0, -5, 0])


# -- all loads in a mechanism

def loaded(orientation: Any) -> sd.System:
    """A barge with one of each load that this package has for the sea and the wind."""
    s = sd.System("loaded", gravity=[0, 0, -9.81])
    b = s.add_body("barge", mass=5.452e6, inertia=[7.269e8, 7.3e8, 1.4e9], com=[0.1, 0, -0.28])
    s.add_joint(sd.Free("joint", s.ground, b, orientation=orientation))
    u = sd.inputs("u")
    line = {"length": LENGTH, "weight": line_weight(), "stiffness": EA}
    s.add_load(sd.MooringLine(b, [20, 20, -4], [386.92, 171.985, -150], **line, name="smooth line"))
    s.add_load(sd.MooringLine(b, [-20, 20, -4], [-386.92, 171.985, -150], **line, friction=1, name="rough line"))
    s.add_load(sd.MooringLine(b, [0, -20, -4], [0, -450, -150], **line, seabed=False, name="free line"))
    skew = np.diag([1e4, 1e4, 1e7, 1e9, 2e9, 3e8])
    skew[0, 4] = 1e5
    s.add_load(sd.LinearStiffness(b, skew, point=[1, 2, -3], angles="rotation vector", name="water plane"))
    s.add_load(sd.LinearDamping(b, [1e4, 1e4, 1e5, 1e7, 1e7, 1e7], point=[1, 2, -3], name="damping"))
    s.add_load(sd.WaveExcitation(b, [1e5] * 6, [0, 1, 2, 3, 4, 5], 0.8, ramp=10, name="waves"))
    s.add_load(sd.Drag(b, 400, 1.2, 1.225, wind=[10, u, 0], point=[0, 0, 40], name="drag"))
    s.add_load(sd.Thrust(b, lambda v: 1e3 * v**2, axis=[1, 0, 0.1], point=[0, 0, 90], wind=[10 + sd.t / 100, u, 0], name="rotor"))
    return s


@functools.cache
def equations(parameters: bool) -> Any:
    return loaded(sd.EulerParameters() if parameters else sd.EulerAngles("ZYX", speeds="body")).recursive()


def test_identities_hold_with_30_digits_and_in_generated_code() -> None:
    """Among them: the rate of energy is the power of the loads; C and NumPy agree with the tape."""
    assert equations(True).verify(states=1).passed


@pytest.mark.parametrize("seed", [0, 1])
def test_euler_angles_and_euler_parameters_move_alike(seed: int) -> None:
    rng = np.random.default_rng(seed)
    place, a, u = rng.normal(size=3), rng.uniform(-1, 1, 3), rng.normal(size=6)
    e = Rotation.from_euler("ZYX", a).as_quat()[[3, 0, 1, 2]]
    names = [f"q_joint_{k + 1}" for k in range(7)]

    def accelerations(parameters: bool, q: np.ndarray) -> np.ndarray:
        eq = equations(parameters)
        values = {**dict(zip(names, q, strict=False)), **dict(zip((str(s) for s in eq.symbols.speeds), u, strict=True)),
                  "u": 3.0, "t": 4.0}
        found = evaluate(eq.tape("M_tilde", "F_tilde", "k_tilde"), values, 30)
        right = mpmath.matrix((found["F_tilde"] - found["k_tilde"]).tolist())
        return np.array([float(v) for v in mpmath.lu_solve(mpmath.matrix(found["M_tilde"].tolist()), right)])

    one, other = accelerations(False, np.array([*place, *a])), accelerations(True, np.array([*place, *e]))
    np.testing.assert_allclose(one, other, rtol=0, atol=1e-12 * abs(one).max())


# -- faults

WAVES = {"amplitude": AMPLITUDE, "phase": PHASE, "frequency": 1.0}
DRAG = {"area": 1, "coefficient": 1, "density": 1}
FAULTS: dict[str, tuple[Callable[..., Any], str]] = {
    "amplitude": (lambda: sd.WaveExcitation("float", **{**WAVES, "amplitude": [1, 2]}), "amplitude has 2 components; pass 6"),
    "phase": (lambda: sd.WaveExcitation("float", **{**WAVES, "phase": 0}), "phase has 1 components; pass 6"),
    "frequency": (lambda: sd.WaveExcitation("float", **{**WAVES, "frequency": 0}), "frequency is 0; pass a number above 0 rad/s"),
    "ramp": (lambda: sd.WaveExcitation("float", **WAVES, ramp=-1), "ramp is -1; pass a number above 0 s, or None"),
    "wave point": (lambda: sd.WaveExcitation("float", **WAVES, point=[1]), "point has 1 components; pass 3"),
    "area": (lambda: sd.Drag("float", **{**DRAG, "area": -1}), "area is -1; pass a number that is not below 0 m^2"),
    "coefficient": (lambda: sd.Drag("float", **{**DRAG, "coefficient": -2}), "coefficient is -2; pass a number that is not"),
    "density": (lambda: sd.Drag("float", **{**DRAG, "density": -0.5}), "density is -0.5; pass a number that is not below 0"),
    "wind": (lambda: sd.Drag("float", **DRAG, wind=[1, 2]), "wind has 2 components; pass 3"),
    "thrust": (lambda: sd.Thrust("float", "1000 N"), "force is the text '1000 N'"),
    "no force": (lambda: sd.Thrust("float", lambda v: None), "force is None"),
    "no argument": (lambda: sd.Thrust("float", lambda: 1.0),
                    "force is a function that failed with a symbol for the speed of the air (TypeError: "),
    "two arguments": (lambda: sd.Thrust("float", lambda a, c: a * c),
                      "missing 1 required positional argument: 'c'); pass a function of this one argument"),
    "of NumPy": (lambda: sd.Thrust("float", lambda v: np.sin(v)), "that returns an expression of SymPy, with sympy.sin"),
    "endless": (lambda: sd.Thrust("float", lambda v: sp.oo * v), "pass a finite number or expression"),
    "axis": (lambda: sd.Thrust("float", 1, axis=[0, 0, 0]), "axis is (0, 0, 0); pass a direction in body axes"),
    "axis components": (lambda: sd.Thrust("float", 1, axis=[1, 0]), "axis has 2 components; pass 3"),
    "complex": (lambda: sd.Drag("float", **{**DRAG, "area": 1j}), "area is 1j of type complex"),
    "moving area": (lambda: sd.Drag("float", **{**DRAG, "area": sd.t}), "depends on t, but must be constant"),
}


@pytest.mark.parametrize("name", FAULTS)
def test_faults(name: str) -> None:
    make, message = FAULTS[name]
    s = sd.System("floating")
    b = s.add_body("float", mass=1, inertia=[1, 1, 1])
    s.add_joint(sd.Free("joint", s.ground, b))
    s.add_load(make())
    with pytest.raises(sd.ModelError) as error:
        s.check()
    (fault,) = error.value.faults
    assert message in fault
    assert fault.startswith(("wave excitation on float: ", "drag on float: ", "thrust on float: ", "drag_1 "))


def test_a_ramp_without_time_stops_the_run() -> None:
    T = sd.parameters("T")
    s = sd.System("floating")
    s.add_joint(sd.Free("joint", s.ground, s.add_body("float", mass=1, inertia=[1, 1, 1])))
    s.add_load(sd.WaveExcitation("float", **WAVES, ramp=T, name="swell"))
    with pytest.raises(sd.EvaluationError, match="swell: the time of the ramp is not above zero"):
        s.recursive().compile(backend="numpy").rhs(0.0, np.zeros(12), {T: 0.0})
