"""Faulty helical and custom joints and quasi-velocities: each gives one message with what was requested and what to do."""

from __future__ import annotations

import os
from collections.abc import Callable
from typing import Any

import pytest
import sympy as sp
from sympy.physics.mechanics import dynamicsymbols

import symdyn as sd
from symdyn.errors import ModelError

q1, a, b, c, x = sd.coordinates("q1 a b c x")
h, l = sd.parameters("h l")
tau = sd.inputs("tau")
EVIL = "__import__('os').environ.__setitem__('SYMDYN_EVALUATED', 'yes')"
Rz = sp.rot_ccw_axis3


def scene(make: Callable[..., Any], planar: bool = False, **options: Any) -> sd.System:
    """A base that slides, and a box on the joint."""
    s = sd.System("scene", gravity=[0, -9.81] if planar else [0, 0, -9.81], **options)
    base = s.add_body("base", mass=1, inertia=1 if planar else [1, 1, 1])
    box = s.add_body("box", mass=1, inertia=1 if planar else [1, 1, 1])
    s.add_joint(sd.Prismatic("rail", s.ground, base, q1))
    s.add_joint(make("wrist", base, box))
    return s


def faults_of(s: sd.System) -> tuple[str, ...]:
    with pytest.raises(ModelError) as caught:
        s.check()
    return caught.value.faults


def one(faults: tuple[str, ...], parts: str) -> None:
    assert len(faults) == 1, faults
    assert all(part in faults[0] for part in parts.split("|")), faults[0]


# Each entry: the joint from (name, parent, child), and the parts that its single fault must contain, separated by "|".
CASES: dict[str, tuple[Callable[..., Any], str]] = {
    "no pitch": (lambda *n: sd.Helical(*n, a), "joint 'wrist': pitch (m/rad) is None|pass a number or an expression"),
    "pitch text": (lambda *n: sd.Helical(*n, a, pitch=EVIL), "joint 'wrist': pitch (m/rad) is the text|never evaluated"),
    "pitch list": (lambda *n: sd.Helical(*n, a, pitch=[1, 0, 0]), "joint 'wrist': pitch (m/rad) is [1, 0, 0]|pass a number"),
    "pitch infinite": (lambda *n: sd.Helical(*n, a, pitch=sp.oo), "pitch (m/rad) is oo; pass a finite number"),
    "pitch moving": (lambda *n: sd.Helical(*n, a, pitch=q1), "joint 'wrist' depends on q1|must be constant|use parameters"),
    "pitch an input": (lambda *n: sd.Helical(*n, a, pitch=tau), "joint 'wrist' depends on tau|must be constant"),
    "screw axis": (lambda *n: sd.Helical(*n, a, axis=[h, 1, 0], pitch=h), "axis [h, 1, 0] has length"),
    "velocity": (lambda *n: sd.Free(*n, velocity="child"), "joint 'wrist': velocity is 'child'; pass 'parent'|or 'body'"),
    "prescribed angular velocity": (
        lambda *n: sd.Spherical(*n, [a, b, sp.sin(sd.t)], sd.EulerAngles("XYZ", "body")),
        "joint 'wrist': with its angular velocity as speeds every coordinate must be a symbol|"
        "EulerAngles('XYZ', speeds='rates') for a prescribed motion"),
    "prescribed velocity": (
        lambda *n: sd.Free(*n, [a, b, 2 * q1, *sd.coordinates("d:3")], velocity="body"),
        "joint 'wrist': with velocity='body' every coordinate must be a symbol|velocity='parent'|speeds='rates'"),
    "prescribed parameters": (
        lambda *n: sd.Free(*n, [sd.t, a, b, *sd.coordinates("d:4")], sd.EulerParameters()),
        "joint 'wrist': with Euler parameters every coordinate must be a symbol; use Euler angles"),
    "prescribed angular velocity of a free body": (
        lambda *n: sd.Free(*n, [sd.t, a, b, *sd.coordinates("d:3")], sd.EulerAngles("ZYX", "body")),
        "with its angular velocity as speeds every coordinate must be a symbol"),
    "speeds": (lambda *n: sd.Free(*n, velocity="body", speeds=sd.speeds("v1:4")),
               "joint 'wrist' (free) takes 6 symbols as speeds, found [v1, v2, v3]"),
    # custom
    "no coordinates": (lambda *n: sd.Custom(*n, []), "joint 'wrist' (custom): coordinates is ()|1 to 6 different symbols"),
    "coordinates None": (lambda *n: sd.Custom(*n, None), "coordinates is None; pass a list of 1 to 6 different symbols"),
    "one coordinate": (lambda *n: sd.Custom(*n, a, Rz(a)), "coordinates is a; pass a list|sd.coordinates"),
    "coordinate text": (lambda *n: sd.Custom(*n, "a"), "coordinates is 'a'; pass a list"),
    "coordinate number": (lambda *n: sd.Custom(*n, [a, 1], Rz(a)), "coordinates is (a, 1); pass a list"),
    "coordinate twice": (lambda *n: sd.Custom(*n, [a, a], Rz(a)), "coordinates is (a, a)|different"),
    "seven coordinates": (lambda *n: sd.Custom(*n, sd.coordinates("d:7")), "coordinates is (d0, d1,|1 to 6"),
    "expression for a coordinate": (lambda *n: sd.Custom(*n, [2 * q1], Rz(q1)),
                                    "coordinates is (2*q1,)|follows other coordinates|pass expressions to Free"),
    "units count": (lambda *n: sd.Custom(*n, [a, x], Rz(a), [x, 0, 0], units=["rad"]),
                    "joint 'wrist' (custom): units is ['rad']; pass a text such as 'rad' for each of its 2 coordinates"),
    "units text": (lambda *n: sd.Custom(*n, [a], Rz(a), units="rad"), "units is 'rad'; pass a text|its 1 coordinates"),
    "units number": (lambda *n: sd.Custom(*n, [a], Rz(a), units=[1]), "units is [1]; pass a text"),
    "units that end a comment": (lambda *n: sd.Custom(*n, [a], Rz(a), units=["*/\n"]), "units is ['*/\\n']; pass a text"),
    "rotation shape": (lambda *n: sd.Custom(*n, [a], [[1, 0], [0, 1]], [a, 0, 0]),
                       "joint 'wrist' (custom): rotation is not a 3 x 3 matrix"),
    "rotation text": (lambda *n: sd.Custom(*n, [a], [[EVIL, 0, 0], [0, 1, 0], [0, 0, 1]], [a, 0, 0]),
                      "joint 'wrist' (custom): rotation[1, 1] is the text|never evaluated"),
    "position text": (lambda *n: sd.Custom(*n, [a], Rz(a), ["a", 0, 0]), "position, component 1 is the text 'a'|never evaluated"),
    "position shape": (lambda *n: sd.Custom(*n, [a], Rz(a), [a, 0, 0, 0]), "position has 4 components"),
    "rotation of time": (lambda *n: sd.Custom(*n, [a], Rz(a + sd.t)),
                         "joint 'wrist' (custom): its rotation uses t; it may use the joint's own coordinates (a) and"),
    "rotation of another time": (lambda *n: sd.Custom(*n, [a], Rz(a + sp.Symbol("t", real=True))), "its rotation uses t"),
    "position of another joint": (lambda *n: sd.Custom(*n, [a, b], Rz(a), [b, q1, 0]),
                                  "its position uses q1; it may use the joint's own coordinates (a, b) and parameters"),
    "position of a rate": (lambda *n: sd.Custom(*n, [a], Rz(a), [a.dot, 0, 0]), "its position uses a_dot"),
    "position of dynamicsymbols": (lambda *n: sd.Custom(*n, [a], Rz(a), [dynamicsymbols("a", 1), 0, dynamicsymbols("z")]),
                                   "its position uses a_dot, z"),
    "position of an input and a speed": (lambda *n: sd.Custom(*n, [a], Rz(a), [tau, sd.speeds("v"), q1.ddot]),
                                         "its position uses q1_ddot, tau, v"),
    "no rotation": (lambda *n: sd.Custom(*n, [a], 1.001 * Rz(a)),
                    "joint 'wrist' (custom): its rotation is none at a = |R R^T differs from the identity|by 0.003|"
                    "a rotation at every value of its symbols"),
    "no rotation but at zero": (lambda *n: sd.Custom(*n, [a], [[1, -a, 0], [a, 1, 0], [0, 0, 1]]), "its rotation is none at a ="),
    "mirror": (lambda *n: sd.Custom(*n, [a], Rz(a) * sp.diag(1, 1, -1)), "its rotation is none at a = |determinant from 1, by 2"),
    "rotation about a free axis": (lambda *n: sd.Custom(*n, [a], sp.eye(3) + l * sp.Matrix([[0, -a, 0], [a, 0, 0], [0, 0, 0]])),
                                   "its rotation is none at a = |l = "),
    "idle coordinate": (lambda *n: sd.Custom(*n, [a, b, c], Rz(a), [sp.sin(b)**2 + sp.cos(b)**2, 0, 0]),
                        "joint 'wrist' (custom): b, c moves nothing|leave it out"),
    "dependent coordinates": (lambda *n: sd.Custom(*n, [a, b, x], Rz(a + l * b), [x, 0, 0]),
                              "joint 'wrist' (custom): a, b do not move the child independently|leave one of them out"),
    "too many ways": (lambda *n: sd.Custom(*n, [a, b, x, c], None, [a, b + c, x]), "b, c do not move the child independently"),
    "domain": (lambda *n: sd.Custom(*n, [a], None, [sp.sqrt(-1 - a**2), 0, 0]),
               "its transform has no real value at 60 random places|roots, logarithms and divisions|shift the coordinates"),
    "no derivative": (lambda *n: sd.Custom(*n, [a], None, [a, sp.floor(a), 0]),
                      "its transform, or a derivative of it, cannot be computed: |floor(a)"),
    "no counterpart": (lambda *n: sd.Custom(*n, [a], None, [sp.gamma(a), 0, 0]),
                       "its transform, or a derivative of it, cannot be computed: gamma(a)|use elementary functions"),
    "no value": (lambda *n: sd.Custom(*n, [a], None, [sp.Function("f")(a), 0, 0]), "position, component 1 uses f(a)|no value"),
    "division by zero": (lambda *n: sd.Custom(*n, [a], None, [a / sp.UnevaluatedExpr(sp.S.Zero), 0, 0]),
                         "cannot be computed: |divides by zero"),
    "another joint's coordinate": (lambda *n: sd.Custom(*n, [q1], Rz(q1)),
                                   "joints 'rail' and 'wrist' both drive the coordinate q1"),
}


@pytest.mark.parametrize("name", CASES)
def test_fault(name: str) -> None:
    make, parts = CASES[name]
    one(faults_of(scene(make)), parts)


@pytest.mark.parametrize(("make", "parts"), [
    (lambda *n: sd.Helical(*n, a, pitch=h), "joint 'wrist' is helical, but the system is planar; use Revolute"),
    (lambda *n: sd.Custom(*n, [a], sp.rot_ccw_axis1(a)),
     "joint 'wrist' (custom): its transform leaves the x-y plane|turn about z and move in x and y only|planar=False"),
    (lambda *n: sd.Custom(*n, [a], Rz(a), [0, 0, a]), "its transform leaves the x-y plane")])
def test_fault_in_the_plane(make: Callable[..., Any], parts: str) -> None:
    one(faults_of(scene(make, planar=True)), parts)


def test_custom_joint_that_stays_in_the_plane_is_none() -> None:
    assert scene(lambda *n: sd.Custom(*n, [a, x], Rz(a), [x, l * x**2]), planar=True).check().parameters == (l,)


def test_faults_of_a_custom_joint_come_at_once() -> None:
    s = scene(lambda *n: sd.Custom(*n, [a], Rz(a + sd.t), [q1, "x", 0], units=[1, 2], speeds=5, parent_point="here"))
    assert len(faults_of(s)) == 6
    assert "SYMDYN_EVALUATED" not in os.environ


@pytest.mark.parametrize("speeds", ["Body", "omega", None, 5, sd.speeds("u")])
def test_speeds_of_euler_angles(speeds: Any) -> None:
    with pytest.raises(ModelError, match=r"Euler angles have no speeds .*; pass 'rates' .* or 'body'"):
        sd.EulerAngles("ZYX", speeds)


def test_both_faults_of_euler_angles_come_at_once() -> None:
    with pytest.raises(ModelError) as caught:
        sd.EulerAngles("XX", "none")
    assert len(caught.value.faults) == 2


def test_symbols_of_a_transform_that_are_not_declared() -> None:
    s = scene(lambda *n: sd.Custom(*n, [a], Rz(a), [l, h, 0]), parameters=[h])
    one(faults_of(s), "joint 'wrist' uses the symbol l, not declared in the model; declared: h")


def test_parameters_of_a_transform_and_of_a_pitch_are_known_with_their_units() -> None:
    model = scene(lambda *n: sd.Custom(*n, [a, x], Rz(a + h), [x, l, 0], units=("rad", "m"))).check()
    assert model.parameters == (h, l)
    assert [model.units[s] for s in (a, x, a.dot, x.dot)] == ["rad", "m", "rad/s", "m/s"]
    model = scene(lambda *n: sd.Helical(*n, a, pitch=-h)).check()
    assert model.parameters == (h,) and model.units[h] == "m/rad" and model.units[a] == "rad"
    model = scene(lambda *n: sd.Custom(*n, [a], Rz(a))).check()
    assert (model.units[a], model.units[a.dot]) == ("1", "1/s")


def test_units_of_quasi_velocities_and_of_the_forces_along_them() -> None:
    s = scene(lambda *n: sd.Free(*n, velocity="body"))
    forces = sd.inputs("f1:7")
    s.add_joint_force("wrist", list(forces))
    units = {symbol.name: unit for symbol, unit in s.check().units.items()}
    assert [units[f"v_{k}_wrist"] for k in "xyz"] == ["m/s"] * 3 and units["omega_y_wrist"] == "rad/s"
    assert [units[f"f{k}"] for k in range(1, 7)] == ["N"] * 3 + ["N m"] * 3


def test_plain_symbols_and_dynamicsymbols_as_coordinates_of_a_transform() -> None:
    plain, moving = sp.Symbol("u"), dynamicsymbols("v")
    joint = sd.Custom("j", "one", "other", [plain, moving], Rz(plain), [moving, 0, 0])
    assert not joint.faults and joint.rotation[0, 0] == sp.cos(sd.coordinates("u")) and joint.position[0] == sd.coordinates("v")


def test_transforms_in_floats_are_exact() -> None:
    joint = sd.Custom("j", "one", "other", [x], [[0.6, -0.8, 0], [0.8, 0.6, 0], [0, 0, 1]], [0.5 * x, 0, 0])
    assert not joint.faults and joint.rotation * joint.rotation.T == sp.eye(3)
    assert list(joint.transform.S[3:, 0]) == [sp.Rational(3, 10), sp.Rational(-2, 5), 0]


def test_what_is_constant_is_found_without_simplifying() -> None:
    joint = sd.Custom("j", "one", "other", [a, b], Rz(a) * sp.rot_ccw_axis1(b), [l * sp.cos(a), l * sp.sin(a), 0])
    assert list(joint.transform.S[:3, 1]) == [1, 0, 0] and joint.transform.S[0, 0] == 0
    dwell = sp.Piecewise((x**2, x > 20), (0, True))  # constant wherever it is tried, but not everywhere
    assert sd.Custom("j", "one", "other", [x], None, [x, dwell, 0]).transform.S[4, 0] != 0


def test_transforms_that_are_not_smooth_or_not_defined_everywhere_are_taken() -> None:
    for position in ([sp.sqrt(a - 5), 0, 0], [sp.log(a), 0, 0], [sp.Abs(a) + sp.Max(a, l), 0, 0], [1 / a, 0, 0]):
        assert not sd.Custom("j", "one", "other", [a], None, position).faults
