"""Vectors and dyadics of SymPy's ReferenceFrames in the place of components, and axes that are no unit vectors."""

from __future__ import annotations

import pickle
from collections.abc import Callable
from typing import Any

import pytest
import sympy as sp
from sympy.physics.mechanics import Point, ReferenceFrame, inertia

import symdyn as sd

m, l, g, I, F, k = sd.parameters("m l g I F k")
q = sd.coordinates("q")
N, A, B = ReferenceFrame("N"), ReferenceFrame("A"), ReferenceFrame("B")


def by_components(**joint: Any) -> sd.System:
    s = sd.System("arm", gravity=[0, -g, 0])
    arm = s.add_body("arm", mass=m, inertia=[[I, 0, k], [0, 2 * I, 0], [k, 0, 3 * I]], com=[l, 0, 0])
    s.add_joint(sd.Revolute("shoulder", s.ground, arm, q, parent_point=[1, 0, 0], child_point=[-l, 0, 0], **joint))
    s.add_force(arm, [0, F, 0], point=[l, 0, 0], frame=arm)
    s.add_force(arm, [F, 0, 0])
    s.add_torque(arm, [0, 0, 3])
    s.add_spring_damper(s.ground, arm, point_a=[0, 1, 0], point_b=[l, 0, 0], stiffness=k)
    s.add_output("tip", sd.position(arm, [l, 0, 0]))
    return s


def by_vectors() -> sd.System:
    s = sd.System("arm", gravity=-g * N.y, frame=N)
    tensor = inertia(A, I, 2 * I, 3 * I, 0, 0, k)
    arm = s.add_body("arm", mass=m, inertia=tensor, com=l * A.x, frame=A)
    s.add_joint(sd.Revolute("shoulder", s.ground, arm, q, axis=2 * N.z, parent_point=N.x, child_point=-l * A.x))
    s.add_force(arm, F * A.y, point=l * arm.frame.x)
    s.add_force("arm", F * s.frame.x)
    s.add_torque(arm, 3 * s.frame.z)
    s.add_spring_damper(s.ground, arm, point_a=N.y, point_b=l * A.x, stiffness=k)
    s.add_output("tip", sd.position(arm, l * A.x))
    return s


def by_points() -> sd.System:
    O, P = Point("O"), Point("P")
    pivot, center = O.locatenew("pivot", N.x), P.locatenew("G", l * A.x)
    s = sd.System("arm", gravity=-g * N.y, frame=N, origin=O)
    arm = s.add_body("arm", mass=m, inertia=inertia(A, I, 2 * I, 3 * I, 0, 0, k), com=center, frame=A, origin=P)
    s.add_joint(sd.Revolute("shoulder", s.ground, arm, q, axis=N.z, parent_point=pivot, child_point=P.locatenew("S", -l * A.x)))
    s.add_force(arm, F * A.y, point=center)
    s.add_force(arm, F * N.x)
    s.add_torque(arm, 3 * N.z)
    s.add_spring_damper(s.ground, arm, point_a=s.ground.origin.locatenew("hook", N.y), point_b=center, stiffness=k)
    s.add_output("tip", sd.position(arm, center))
    return s


def test_points_stand_for_their_components() -> None:
    points, components = by_points().embedding(), by_components().embedding()
    for name in ("M_tilde", "k_tilde", "F_tilde", "energy", "output_tip", "reactions"):
        assert points.explicit(name, simplify=False) == components.explicit(name, simplify=False), name
    assert pickle.loads(pickle.dumps(by_points())).embedding().F_tilde == components.F_tilde
    made = sd.System("arm")
    arm = made.add_body("arm", mass=m, com=[l, 0, 0])
    made.add_joint(sd.Revolute("shoulder", made.ground, arm, q))
    made.add_force(arm, F * arm.frame.y, point=arm.origin.locatenew("P", l * arm.frame.x))
    assert made.embedding().F_tilde == sp.Matrix([F * l])
    assert sd.read_system(by_points().to_toml()).embedding().F_tilde == components.F_tilde


@pytest.mark.parametrize(("describe", "message"), [
    (lambda s, arm, P: s.add_force(arm, [1, 0, 0], point=P), "force_1: point is the SymPy point P, which is not located from arm "
     r"origin, the body's origin; locate it from body\.origin"),
    (lambda s, arm, P: s.add_force("nobody", [1, 0, 0], point=P), "of its body no origin is known here"),
    (lambda s, arm, P: s.add_force(arm, P), "force_1 is P; pass a list"),
    (lambda s, arm, P: s.add_force(arm, [1, 0, 0], point=arm.origin.locatenew("Q", l * B.x)), "in the frame B; here the frame"),
    (lambda s, arm, P: s.add_body("other", mass=1, com=P), "body 'other': com is the SymPy point P, and of its body no origin"),
    (lambda s, arm, P: s.add_body("other", origin=3), "body 'other': origin is 3; pass a Point"),
])
def test_points_that_are_not_known_are_rejected(describe: Callable[..., Any], message: str) -> None:
    s = sd.System("arm")
    arm = s.add_body("arm", mass=m, inertia=[I, I, I])
    s.add_joint(sd.Revolute("shoulder", s.ground, arm, q))
    describe(s, arm, Point("P"))
    with pytest.raises(sd.ModelError, match=message):
        s.embedding()


def test_vectors_and_dyadics_stand_for_their_components() -> None:
    vectors, components = by_vectors().embedding(), by_components().embedding()
    for name in ("M_tilde", "k_tilde", "F_tilde", "energy", "output_tip", "reactions"):
        assert vectors.explicit(name, simplify=False) == components.explicit(name, simplify=False), name
    back = pickle.loads(pickle.dumps(by_vectors()))
    assert back.embedding().F_tilde == components.F_tilde


def test_frames_are_made_where_none_are_given() -> None:
    s = sd.System("arm")
    arm = s.add_body("arm", mass=m, com=[l, 0, 0])
    assert str(arm.frame) == "arm" and arm.frame is arm.frame and s.frame is s.ground.frame and str(s.frame) == "ground"
    s.add_joint(sd.Revolute("shoulder", s.ground, arm, q, axis=arm.frame.z))
    s.add_torque(arm, 0 * arm.frame.x)
    s.add_torque(arm, F * arm.frame.z, frame=arm)
    assert s.embedding().F_tilde == sp.Matrix([F])


def test_axes_in_the_frame_of_the_child_are_turned_into_the_joint_frame() -> None:
    """The joint frame is turned against that of the child by 90 degrees about x, against that of the parent by -90."""
    s = sd.System("arm", frame=N)
    arm = s.add_body("arm", mass=m, inertia=[1, 1, 1], frame=A)
    turned = sp.Matrix([[1, 0, 0], [0, 0, -1], [0, 1, 0]])
    child = sd.Revolute("a", s.ground, arm, q, axis=A.z, child_rotation=turned)
    parent = sd.Revolute("b", s.ground, arm, q, axis=N.z, parent_rotation=turned.T)
    assert list(child.axis) == [0, 1, 0] and list(parent.axis) == [0, -1, 0]


FAULTS: dict[str, tuple[Callable[[sd.System, Any], Any], str]] = {
    "dyadic without a frame": (lambda s, b: s.add_body("c", mass=1, inertia=inertia(A, 1, 2, 3)),
                               "body 'c': inertia is the SymPy dyadic .* in the frame A, and no frame is known here; pass its "
                               r"components, dyadic.to_matrix\(A\); bodies, and the system, take their frames as frame=A"),
    "vector without a frame": (lambda s, b: s.add_body("c", mass=1, com=2 * A.x),
                               r"com is the SymPy vector 2\*A.x in the frame A, and no frame is known here; pass its components, "
                               r"list\(vector.to_matrix\(A\)\)"),
    "force in a strange frame": (lambda s, b: s.add_force(b, F * B.x),
                                 r"force_1 is the SymPy vector F\*B.x in the frame B; here the frame N is known: write it in "
                                 "that one, as body.frame and system.frame have it"),
    "force in two frames": (lambda s, b: s.add_force(b, F * B.x + F * N.x), "in the frame N and B|in the frame B and N"),
    "frame given twice": (lambda s, b: s.add_force(b, F * b.frame.x, frame=s.ground),
                          r"force_1 is the SymPy vector F\*arm.x, written in the axes of arm, and frame is ground; leave out"),
    "axis in a strange frame": (lambda s, b: s.close_loop(sd.Revolute("l", s.ground, b, axis=B.z)),
                                "joint 'l': axis is the SymPy vector B.z in the frame B; here the frame N is known"),
    "point of a named body": (lambda s, b: s.close_loop(sd.Fixed("l", s.ground, "arm", child_point=b.frame.x)),
                              "joint 'l': child_point is the SymPy vector arm.x in the frame arm, and of 'arm' only the name is "
                              "known here, not its frame; pass the body itself, what add_body returned"),
    "axis of the ground by name": (lambda s, b: s.close_loop(sd.Revolute("l", "ground", b, axis=s.frame.x)),
                                   "of 'ground' only the name is known here, not its frame; pass the body itself, system.ground"),
    "no frame": (lambda s, b: s.add_body("c", mass=1, frame="A"), "body 'c': frame is 'A'; pass a ReferenceFrame of sympy.phy"),
}


@pytest.mark.parametrize("case", FAULTS)
def test_what_cannot_be_taken_over_is_rejected(case: str) -> None:
    s = sd.System("arm", frame=N)
    arm = s.add_body("arm", mass=1, inertia=[1, 1, 1])
    s.add_joint(sd.Revolute("shoulder", s.ground, arm, q))
    change, message = FAULTS[case]
    change(s, arm)
    with pytest.raises(sd.ModelError, match=message):
        s.check()


@pytest.mark.parametrize(("axis", "wanted"), [
    ([1, 1, 0], [sp.sqrt(2) / 2, sp.sqrt(2) / 2, 0]), ([3, 0, 4], [sp.Rational(3, 5), 0, sp.Rational(4, 5)]),
    ([0, -2, 0], [0, -1, 0]), ([0.3, 0, 0.4], [sp.Rational(3, 5), 0, sp.Rational(4, 5)]), ([1.0, 1.0, 1.0], [sp.sqrt(3) / 3] * 3),
    ((0, 0, 0.5), [0, 0, 1]), ([1, sp.sqrt(3), 0], [sp.S.Half, sp.sqrt(3) / 2, 0])])
def test_axes_of_numbers_are_divided_by_their_length(axis: Any, wanted: list[Any]) -> None:
    assert list(sd.Revolute("j", "a", "b", q, axis=axis).axis) == wanted
    assert list(sd.Universal("j", "a", "b", axes=[axis, [0, 1, 5]]).axes[0]) == wanted


def test_axes_of_long_floats_are_unit_vectors_to_many_digits() -> None:
    x, y, z = sd.Prismatic("j", "a", "b", q, axis=[0.1, 2**0.5, -0.7]).axis
    assert abs(x**2 + y**2 + z**2 - 1) < sp.Rational(1, 10**58) and abs(y / x - 10 * 2**0.5) < 1e-14


def test_the_length_of_an_axis_has_no_influence() -> None:
    assert by_components(axis=[0, 0, 7]).embedding().F_tilde == by_components().embedding().F_tilde
    assert by_components(axis=[0.3, 0, 0.4]).embedding().M_tilde == by_components(axis=[3, 0, 4]).embedding().M_tilde
