"""Faulty loops and constraints: each gives one message with what was requested, what was found and what to do."""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable
from typing import Any

import pytest
import sympy as sp

import symdyn as sd
from symdyn.errors import ModelError, ModelWarning

q1, q2, q3, w = sd.coordinates("q1 q2 q3 w")
m, l, k = sd.parameters("m l k")
tau = sd.inputs("tau")
EVIL = "__import__('os').environ.__setitem__('SYMDYN_EVALUATED', 'yes')"


def arm(planar: bool = False, **options: Any) -> sd.System:
    """Two links that turn about z, sound."""
    s = sd.System("arm", gravity=[0, -9.81] if planar else [0, 0, -9.81], **options)
    middle, end = ([0.5, 0], [1, 0]) if planar else ([0.5, 0, 0], [1, 0, 0])
    inertia: Any = 1 if planar else [1, 1, 1]
    upper = s.add_body("upper", mass=m, inertia=inertia, com=middle)
    lower = s.add_body("lower", mass=1, inertia=inertia, com=middle)
    s.add_joint(sd.Revolute("shoulder", s.ground, upper, q1))
    s.add_joint(sd.Revolute("elbow", upper, lower, q2, parent_point=end))
    s.defaults = {m: 1.0}
    return s


def given_by_time() -> sd.System:
    """Both angles are given functions of time; a slider next to them moves."""
    s = arm(planar=True)
    for joint, angle in zip(s.joints, (sp.sin(sd.t), k * sd.t), strict=True):
        joint.coordinates = (angle,)
    beside = s.add_body("beside", mass=1)
    s.add_joint(sd.Prismatic("rail", s.ground, beside, q3, axis=[1, 0]))
    s.defaults = {m: 1.0, k: 0.5}
    return s


def faults_of(s: sd.System, derive: bool = True) -> tuple[str, ...]:
    with pytest.raises(ModelError) as caught, warnings.catch_warnings():
        warnings.simplefilter("ignore", ModelWarning)
        s.augmented() if derive else s.check()
    assert all(fault in str(caught.value) for fault in caught.value.faults)
    return caught.value.faults


def one(faults: tuple[str, ...], parts: str) -> None:
    assert len(faults) == 1, "\n".join(faults)
    for part in parts.split("|"):
        assert part in faults[0], faults[0]


Case = tuple[Callable[[sd.System], Any], str]


def loop(s: sd.System, kind: Any, *arguments: Any, **options: Any) -> Any:
    return s.close_loop(kind("loop", s.ground, "lower", *arguments, **options))


def gear(s: sd.System, *arguments: Any) -> Any:
    return s.close_loop(sd.Gear("gear", *arguments))


# Each entry: what to do to the arm, and the parts that its single fault must contain, separated by "|".
CHECKED: dict[str, Case] = {
    # loops
    "no joint": (lambda s: s.close_loop("elbow"), "close_loop was given 'elbow'|sd.Revolute|an sd.Rod or an sd.Gear"),
    "a class": (lambda s: s.close_loop(sd.Rod), "close_loop was given <class|pass a joint"),
    "onto itself": (lambda s: s.close_loop(sd.Revolute("loop", "lower", "lower")),
                    "joint 'loop' closes a loop from a body onto itself; pass two different bodies"),
    "rod onto itself": (lambda s: s.close_loop(sd.Rod("rod", "lower", s.bodies[1], 1)),
                        "joint 'rod' closes a loop from a body onto"),
    "unknown parent": (lambda s: s.close_loop(sd.Fixed("loop", "wall", "lower")),
                       "joint 'loop': parent is 'wall', which is no body of the system; bodies: ground, upper, lower"),
    "unknown child": (lambda s: s.close_loop(sd.Fixed("loop", s.ground, "lover")), "child is 'lover'|did you mean 'lower'"),
    "body of another system": (lambda s: s.close_loop(sd.Fixed("loop", s.ground, arm().bodies[0])),
                               "joint 'loop': child is 'upper', which is a body of another system"),
    "free": (lambda s: loop(s, sd.Free), "joint 'loop' is free and constrains nothing; leave out close_loop"),
    "a joint of the tree": (lambda s: s.close_loop(s.joints[1]), "2 joints are named 'elbow'; give each a name of its own"),
    "twice": (lambda s: [s.close_loop(rod) for rod in 2 * [sd.Rod("rod", s.ground, "lower", 1)]], "2 joints are named 'rod'"),
    "name of the ground's motion": (lambda s: [s.move_ground([sd.t, 0, 0]), s.close_loop(
        sd.Rod("ground_motion", s.ground, "lower", 1))], "2 joints are named 'ground_motion'"),
    "axis": (lambda s: loop(s, sd.Revolute, axis=[0, 0, 0]), "joint 'loop': axis [0, 0, 0] has length 0, not 1"),
    "point moving": (lambda s: loop(s, sd.Fixed, parent_point=[q1, 0, 0]), "joint 'loop' depends on q1|must be constant"),
    "symbol not declared": (lambda s: [setattr(s, "declared", (m,)), loop(s, sd.Fixed, parent_point=[l, 0, 0])],
                            "joint 'loop' uses the symbol l, not declared in the model; declared: m"),
    "its coordinate used": (lambda s: [loop(s, sd.Revolute, q3), s.add_joint_force("elbow", -q3)],
                            "joint_force_1 uses q3, which no joint and no state drives"),
    "its coordinate used nowhere": (lambda s: loop(s, sd.Revolute, q3),
                                    "joint 'loop' closes a loop and is given the coordinate q3; a closing joint has no "
                                    "coordinate|leave it out"),
    "driven": (lambda s: [loop(s, sd.Revolute), s.add_joint_force("loop", 1)],
               "joint_force_1 acts on the joint 'loop', which the system does not have; joints: shoulder, elbow"),
    "given motion": (lambda s: loop(s, sd.Revolute, sp.sin(sd.t)),
                     "joint 'loop' closes a loop, where its motion follows from the others; it cannot be given as sin(t)|"
                     "put this joint into the tree, and close the loop at another"),
    "screw with a coordinate of the tree": (lambda s: loop(s, sd.Helical, q1, pitch=1),
                                            "joints 'shoulder' and 'loop' both drive the coordinate q1"),
    # rods
    "rod of no length": (lambda s: loop(s, sd.Rod, 0),
                         "rod 'loop': length is 0 m; pass a positive length|Spherical, or Revolute"),
    "rod of negative length": (lambda s: loop(s, sd.Rod, -1), "rod 'loop': length is -1 m; pass a positive length"),
    "length text": (lambda s: loop(s, sd.Rod, EVIL), "rod 'loop': length (m) is the text|never evaluated"),
    "length None": (lambda s: loop(s, sd.Rod, None), "rod 'loop': length (m) is None"),
    "length moving": (lambda s: loop(s, sd.Rod, 1 + q1), "joint 'loop' depends on q1|must be constant"),
    "rod in the tree": (lambda s: s.add_joint(sd.Rod("rod", s.ground, s.add_body("end", mass=1), 1)),
                        "rod 'rod' cannot carry a body in the tree; join the bodies by other joints and pass the rod to"),
    # gears
    "gear in the tree": (lambda s: s.add_joint(sd.Gear("gear", "shoulder", "elbow", 1)), "add_joint was given Gear('gear')"),
    "unknown joint": (lambda s: gear(s, "elbow", "wrist", 2),
                      "gear 'gear': it joins 'wrist', which is no joint of the tree; joints: shoulder, elbow"),
    "joint of another system": (lambda s: gear(s, "elbow", arm().joints[0], 2),
                                "gear 'gear': it joins Revolute('shoulder'), which is"),
    "closing joint": (lambda s: [loop(s, sd.Revolute), gear(s, "elbow", "loop", 2)],
                      "gear 'gear': it joins 'loop', which is no joint"),
    "None": (lambda s: gear(s, None, "elbow", 2), "gear 'gear': it joins None, which is no joint"),
    "list": (lambda s: gear(s, ["elbow"], "shoulder", 2), "gear 'gear': it joins ['elbow'], which is no joint"),
    "gear with itself": (lambda s: gear(s, "elbow", "elbow", 2),
                         "gear 'gear' joins joint 'elbow' to itself; pass two different joints"),
    "gear with itself, both ways": (lambda s: gear(s, "elbow", s.joints[1], 2), "gear 'gear' joins joint 'elbow' to itself"),
    "several coordinates": (lambda s: [s.add_joint(sd.Planar("sled", s.ground, s.add_body("extra", mass=1, inertia=[1, 1, 1]))),
                                       gear(s, "sled", "elbow", 2)],
                            "gear 'gear': joint 'sled' has 3 coordinates; a gear joins joints with one each"),
    "no coordinates": (lambda s: [s.add_joint(sd.Fixed("weld", "lower", s.add_body("extra", mass=1))),
                                  gear(s, "weld", "elbow", 2)],
                       "gear 'gear': joint 'weld' has 0 coordinates"),
    "ratio text": (lambda s: gear(s, "elbow", "shoulder", EVIL), "gear 'gear': ratio is the text|never evaluated"),
    "ratio None": (lambda s: gear(s, "elbow", "shoulder", None), "gear 'gear': ratio is None"),
    "ratio moving": (lambda s: gear(s, "elbow", "shoulder", q1), "gear 'gear' depends on q1, but must be constant"),
    "offset an input": (lambda s: gear(s, "elbow", "shoulder", 1, tau), "gear 'gear' depends on tau, but must be constant"),
    "offset of time": (lambda s: gear(s, "elbow", "shoulder", 1, sd.t), "gear 'gear' depends on t, but must be constant"),
    "name of a joint": (lambda s: s.close_loop(sd.Gear("elbow", "elbow", "shoulder", 1)), "2 joints are named 'elbow'"),
    # constraints by expression
    "constant": (lambda s: s.add_constraint(1),
                 "constraint_1, 1 = 0, has no coordinate or speed in it|use coordinates of the system"),
    "parameters": (lambda s: s.add_constraint(l - 1), "constraint_1, l - 1 = 0, has no coordinate or speed in it"),
    "nothing": (lambda s: s.add_constraint(q1 - q1), "constraint_1, 0 = 0, has no coordinate or speed in it"),
    "of time alone": (lambda s: s.add_constraint(sp.sin(sd.t)), "constraint_1, sin(t) = 0, has no coordinate or speed in it"),
    "coordinate of nobody": (lambda s: s.add_constraint(q1 - w), "constraint_1 uses w, which no joint and no state drives"),
    "rate of nobody": (lambda s: s.add_constraint(w.dot), "constraint_1 uses w_dot, which no joint"),
    "acceleration": (lambda s: s.add_constraint(q1.ddot), "constraint_1 uses the acceleration q1_ddot"),
    "square of a speed": (lambda s: s.add_constraint(q1.dot**2 - 1, name="law"),
                          "law, q1_dot**2 - 1 = 0, is not linear in the speed q1_dot; pass a constraint of the form A(q, t) u"),
    "product of speeds": (lambda s: s.add_constraint(q1.dot * q2.dot), "is not linear in the speed q1_dot"),
    "function of a speed": (lambda s: s.add_constraint(q1 + sp.sin(q2.dot)), "is not linear in the speed q2_dot"),
    "input": (lambda s: s.add_constraint(q1 - tau),
              "constraint_1 uses tau; a constraint may use coordinates, motions, t and parameters"),
    "state": (lambda s: [s.add_state(w, 1), s.add_constraint(q1 - w)], "constraint_1 uses w; a constraint may use coordinates"),
    "text": (lambda s: s.add_constraint(EVIL), "constraint_1 is the text|never evaluated"),
    "equation": (lambda s: s.add_constraint(sp.Eq(q1, q2)), "constraint_1 is Eq(q1, q2)|pass a scalar expression"),
    "two of one name": (lambda s: [s.add_constraint(q, name="law") for q in (q1, q2)], "2 constraints are named 'law'"),
    "name that ends a comment": (lambda s: s.add_constraint(q1, name="*/\n"),
                                 "one of the constraints is named '*/\\n'; pass text"),
    "name number": (lambda s: s.add_constraint(q1, name=5), "one of the constraints is named 5; pass text"),
}


@pytest.mark.parametrize("name", CHECKED)
def test_fault(name: str) -> None:
    change, parts = CHECKED[name]
    s = arm()
    change(s)
    one(faults_of(s, derive=False), parts)
    assert "SYMDYN_EVALUATED" not in os.environ


PLANAR: dict[str, Case] = {
    "spherical": (lambda s: loop(s, sd.Spherical),
                  "joint 'loop' is spherical, but the system is planar; use Revolute, Prismatic"),
    "universal": (lambda s: loop(s, sd.Universal), "joint 'loop' is universal, but the system is planar"),
    "cylindrical": (lambda s: loop(s, sd.Cylindrical), "joint 'loop' is cylindrical, but the system is planar"),
    "helical": (lambda s: loop(s, sd.Helical, pitch=1), "joint 'loop' is helical, but the system is planar"),
    "axis": (lambda s: loop(s, sd.Revolute, axis=[1, 0, 0]),
             "joint 'loop': axis [1, 0, 0] is not along z, but the system is planar"),
    "slide": (lambda s: loop(s, sd.Prismatic, axis=[0, 0, 1]), "joint 'loop': axis [0, 0, 1] is not in the x-y plane"),
    "turned": (lambda s: loop(s, sd.Fixed, parent_rotation=sp.rot_ccw_axis1(1)),
               "joint 'loop': parent_rotation turns out of the x-y"),
    "custom": (lambda s: loop(s, sd.Custom, [w], sp.rot_ccw_axis1(w)),
               "joint 'loop' (custom): its transform leaves the x-y plane"),
}


@pytest.mark.parametrize("name", PLANAR)
def test_fault_in_the_plane(name: str) -> None:
    change, parts = PLANAR[name]
    s = arm(planar=True)
    change(s)
    one(faults_of(s, derive=False), parts)


# -- what shows when the constraints are derived

DERIVED: dict[str, Case] = {
    "points that never meet": (lambda s: loop(s, sd.Spherical, child_point=[1, 0, 0.5]),
                               "loop_z demands 0.5 = 0, which no motion of the system changes: it contradicts the other joints|"
                               "correct the points and axes"),
    "points that may never meet": (lambda s: loop(s, sd.Spherical, child_point=[1, 0, l]),
                                   "loop_z is an equation between parameters alone, which no motion of the system changes"),
    "a distance that never changes": (lambda s: s.close_loop(sd.Rod("rod", s.ground, "lower", 2)),
                                      "rod demands -0.75 = 0, which no motion of the system changes"),
    "steps": (lambda s: s.add_constraint(sp.floor(q1), name="step"),
              "step holds nothing: its derivatives by all coordinates and speeds vanish at every state; remove it"),
    "identity": (lambda s: s.add_constraint(sp.cos(2 * q1) + 2 * sp.sin(q1)**2, name="one"),
                 "one holds nothing: its derivatives by all coordinates and speeds vanish at every state"),
    "two numbers for one angle": (lambda s: [s.add_constraint(q1 - 1, name="a"), s.add_constraint(2 * q1 - 4, name="b")],
                                  "b contradicts a: together they demand -2 = 0 of the positions with the numbers in defaults; "
                                  "remove or correct one of them"),
    "two gears": (lambda s: [gear(s, "shoulder", "elbow", 2), s.close_loop(sd.Gear("other", "shoulder", "elbow", 2, 1))],
                  "other contradicts gear: together they demand -1 = 0 of the positions"),
    "three that do not go together": (lambda s: [s.add_constraint(e, name=n) for e, n in (
        (q1 + q2 - 1, "a"), (q1 - q2, "b"), (q1 - 2, "c"))],
        "c contradicts a, b: together they demand -1.5 = 0 of the positions"),
    "speed of what is held": (lambda s: [s.add_constraint(q1, name="stop"), s.add_constraint(q1.dot - 1, name="drive")],
                              "drive contradicts stop: together they demand -1 = 0 of the speeds"),
    "two drives": (lambda s: [s.add_constraint(q1 - sd.t, name="a"), s.add_constraint(q1 - 2 * sd.t, name="b")],
                   "b contradicts a: together they demand|of the positions"),
    "neither mass nor constraint": (lambda s: [s.add_coordinate(q3), s.add_constraint(q1 - q2)],
                                    "q3_dot: neither mass nor a constraint holds this speed; give it mass, a constraint"),
    "neither mass nor constraint for two": (
        lambda s: [s.add_coordinate(q3, w), s.add_constraint(q3 - w)],
        "q3_dot, w_dot: neither mass nor a constraint holds a motion of these speeds"),
}


@pytest.mark.parametrize("name", DERIVED)
def test_contradictions(name: str) -> None:
    change, parts = DERIVED[name]
    s = arm()
    change(s)
    one(faults_of(s), parts)


def test_constraints_on_what_is_prescribed() -> None:
    s = given_by_time()
    s.close_loop(sd.Revolute("loop", s.ground, "lower", parent_point=[1, 1], child_point=[1, 0]))
    found = faults_of(s)
    assert len(found) == 2
    for fault, row in zip(found, ("loop_x", "loop_y"), strict=True):
        assert fault == (f"{row} holds what is prescribed as a function of time: no coordinate of the system is in it; remove "
                         "it, or replace the prescribed motion by a coordinate")


def test_a_gear_between_prescribed_joints() -> None:
    s = given_by_time()
    gear(s, "shoulder", "elbow", 2)
    one(faults_of(s), "gear holds what is prescribed as a function of time")


def test_a_loop_onto_a_prescribed_link_is_none() -> None:
    s = given_by_time()
    s.close_loop(sd.Rod("rod", "lower", "beside", 3, child_point=[1, 1]))
    s.initial = {q3: 1.0}
    assert s.augmented().constraints == ("rod",)


def test_two_screws_with_one_name_of_a_carrier() -> None:
    s = arm()
    s.add_body("loop_carrier", mass=1)
    s.add_joint(sd.Fixed("hold", "lower", "loop_carrier"))
    loop(s, sd.Helical, pitch=1)
    assert "2 bodies are named 'loop_carrier'; give each a name of its own" in faults_of(s, derive=False)


def test_all_faults_come_at_once() -> None:
    s = arm()
    s.close_loop(sd.Revolute("one", "lower", "lower"))
    s.close_loop(sd.Gear("two", "elbow", "elbow", 1))
    s.close_loop(sd.Rod("three", s.ground, "lower", -1))
    s.add_constraint(q1.dot**2)
    s.add_constraint(l)
    assert len(faults_of(s, derive=False)) == 5


# -- what is no fault

SOUND: dict[str, tuple[Callable[[sd.System], Any], tuple[str, ...]]] = {
    "coordinate of a closing joint": (lambda s: loop(s, sd.Revolute, q1, child_point=[1, 0, 0]), ("loop_x", "loop_y")),
    "bodies by name and the ground last": (lambda s: s.close_loop(
        sd.Spherical("loop", "lower", s.ground, parent_point=[1, 0, 0])),
                                           ("loop_x", "loop_y")),
    "one row twice": (lambda s: [s.add_constraint(q1 - 1, name="a"), s.add_constraint(2 * q1 - 2, name="b")], ("a", "b")),
    "identity that shows": (lambda s: s.add_constraint(sp.sin(q1)**2 + sp.cos(q1)**2 - 1, name="one"), ()),
    "linear in the speeds": (lambda s: s.add_constraint(q1.dot * sp.sin(q2) + sd.t * q2.dot - l, name="law"), ("law",)),
    "rate of a constraint": (lambda s: [s.add_constraint(q1 - q2, name="a"), s.add_constraint(q1.dot - q2.dot, name="b")],
                             ("a", "b")),
}


@pytest.mark.parametrize("name", SOUND)
def test_no_fault(name: str) -> None:
    change, rows = SOUND[name]
    s = arm()
    change(s)
    s.initial = {q1: 0.3, q2: 2.5}
    s.defaults |= {l: 1.0} if name == "linear in the speeds" else {}
    assert s.augmented().constraints == rows


def test_out_of_reach_gives_a_warning() -> None:
    """Whether numbers let a loop close is found by looking for a state."""
    s = arm(planar=True)
    loop(s, sd.Revolute, parent_point=[5, 0], child_point=[1, 0])
    with pytest.warns(ModelWarning, match="no state was found that fulfils the constraints loop_x, loop_y"):
        s.augmented()


def test_contradictions_come_without_warnings_of_the_same_cause() -> None:
    s = arm()
    for name, expression in (("a", q1 - 1), ("b", q1 - 2)):
        s.add_constraint(expression, name=name)
    with warnings.catch_warnings(), pytest.raises(ModelError, match="b contradicts a"):
        warnings.simplefilter("error")
        s.augmented()


@pytest.mark.parametrize("positive", [True, False])
def test_contradictions_between_parameters_without_numbers(positive: bool) -> None:
    a = sd.parameters("a", **({"positive": True} if positive else {}))
    s = arm()
    for k in (1, 2):
        s.add_constraint(q1 - k * a)
    if positive:
        one(faults_of(s), "constraint_2 contradicts constraint_1|for all positive numbers of a; remove or correct one")
    else:
        with pytest.warns(ModelWarning, match="constraint_2 and constraint_1 contradict each other unless"):
            s.augmented()


def test_contradictions_for_most_numbers_of_a_parameter_are_not_for_all() -> None:
    """The defect (a - 3) (a - 20) has one sign at 1 and at 100, another between 3 and 20."""
    a = sd.parameters("a", positive=True)
    s = arm()
    s.add_constraint(q1 - a)
    s.add_constraint(q1 - a - (a - 3) * (a - 20))
    with pytest.warns(ModelWarning, match="constraint_2 and constraint_1 contradict each other unless"):
        s.augmented()


def test_out_of_reach_names_the_prescribed_joints_of_the_loop() -> None:
    s = arm(planar=True)
    beside = s.add_body("beside", mass=1, inertia=1)
    s.add_joint(sd.Revolute("spin", s.ground, beside, sp.sin(sd.t)))
    s.joints[0].coordinates = (sd.t,)
    loop(s, sd.Revolute, parent_point=[5, 0], child_point=[1, 0])
    with pytest.warns(ModelWarning, match="no state was found.*; the motion of shoulder in the loops is prescribed"):
        s.augmented()


def test_a_square_of_an_angle_is_warned_of() -> None:
    s = arm()
    s.add_constraint((q1 - 1)**2, name="square")
    with pytest.warns(ModelWarning, match="all derivatives of square vanish at every consistent state found"):
        s.augmented()
