"""Faulty descriptions: each fault gives one message with what was requested, what was found and what to do."""

from __future__ import annotations

import math
import os
from collections.abc import Callable
from decimal import Decimal
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
import sympy as sp
from sympy.physics.mechanics import ReferenceFrame, dynamicsymbols

import symdyn as sd
from symdyn.errors import ModelError, ModelWarning
from symdyn.model.system import System

q1, q2, q3, q4, q9 = sd.coordinates("q1 q2 q3 q4 q9")
m, l, g, k = sd.parameters("m l g k")
tau = sd.inputs("tau")
EVIL = "__import__('os').environ.__setitem__('SYMDYN_EVALUATED', 'yes')"
turned = sp.Matrix([[1, 0, 0], [0, 0, -1], [0, 1, 0]])


def arm(planar: bool = False, **options: Any) -> System:
    """Two links, sound."""
    s = sd.System("arm", gravity=[0, -g] if planar else [0, 0, -g], **options)
    inertia: Any = 1 if planar else [1, 1, 1]
    upper = s.add_body("upper", mass=m, inertia=inertia, com=[l, 0, 0])
    lower = s.add_body("lower", mass=m, inertia=inertia, com=[l, 0, 0])
    s.add_joint(sd.Revolute("shoulder", s.ground, upper, q1))
    s.add_joint(sd.Revolute("elbow", upper, lower, q2, parent_point=[l, 0, 0]))
    return s


def extra(s: System, **body: Any) -> Any:
    """One more body, fixed to the lower one."""
    part = s.add_body(**{"name": "extra", "mass": 1, **body})
    s.add_joint(sd.Fixed("hold", "lower", part))
    return part


def joined(s: System, kind: Any, *arguments: Any, **options: Any) -> Any:
    """One more body, on a joint of some kind."""
    part = s.add_body("extra", mass=1, inertia=[1, 1, 1])
    return s.add_joint(kind("wrist", "lower", part, *arguments, **options))


def messages(s: System) -> tuple[str, ...]:
    with pytest.raises(ModelError) as caught:
        s.embedding()
    assert all(fault in str(caught.value) for fault in caught.value.faults)
    return caught.value.faults


Case = tuple[Callable[[System], Any], str]

# Each entry: what to do to the arm, and the parts that its single fault must contain, separated by "|".
SPATIAL: dict[str, Case] = {
    # bodies
    "mass text": (lambda s: extra(s, mass=EVIL), "body 'extra': mass|is the text|never evaluated|pass a number"),
    "mass None": (lambda s: extra(s, mass=None), "body 'extra': mass is None|NoneType|pass a number"),
    "mass list": (lambda s: extra(s, mass=[1, 2]), "body 'extra': mass is [1, 2]|list|pass a number"),
    "mass array": (lambda s: extra(s, mass=np.ones(2)), "body 'extra': mass is array|pass a number"),
    "mass matrix": (lambda s: extra(s, mass=sp.ImmutableMatrix([1])), "body 'extra': mass|Matrix|pass a scalar expression"),
    "mass nan": (lambda s: extra(s, mass=math.nan), "body 'extra': mass is nan|pass a finite number"),
    "mass infinite": (lambda s: extra(s, mass=sp.oo), "body 'extra': mass is oo|pass a finite number"),
    "mass complex": (lambda s: extra(s, mass=2 + 1j), "body 'extra': mass is (2+1j)|pass a number"),
    "mass imaginary": (lambda s: extra(s, mass=2 * sp.I), "body 'extra': mass is 2*I, a complex number|pass a real number"),
    "mass boolean": (lambda s: extra(s, mass=True), "body 'extra': mass is True|pass a scalar expression"),
    "mass relation": (lambda s: extra(s, mass=m > 1), "body 'extra': mass is m > 1|pass a scalar expression"),
    "mass vector": (lambda s: extra(s, mass=ReferenceFrame("N").x), "body 'extra': mass is N.x|Vector|pass a number"),
    "mass decimal": (lambda s: extra(s, mass=Decimal("1.5")), "body 'extra': mass is Decimal|pass a number"),
    "mass negative": (lambda s: extra(s, mass=-2), "body 'extra' has the mass -2 kg|pass zero or a positive mass"),
    "mass moving": (lambda s: extra(s, mass=1 + q1), "body 'extra' depends on q1|must be constant|use parameters"),
    "mass of time": (lambda s: extra(s, mass=2 - sd.t), "body 'extra' depends on t|must be constant"),
    "mass input": (lambda s: extra(s, mass=tau), "body 'extra' depends on tau|must be constant"),
    "mass dynamicsymbol": (lambda s: extra(s, mass=dynamicsymbols("q1")), "body 'extra' depends on q1|must be constant"),
    "inertia number": (lambda s: extra(s, inertia=3), "body 'extra': inertia is 3|pass a list"),
    "inertia text": (lambda s: extra(s, inertia=EVIL), "body 'extra': inertia is|pass a list"),
    "inertia entry text": (lambda s: extra(s, inertia=[1, 1, "1"]), "inertia[3, 3] is the text '1'|never evaluated"),
    "inertia short": (lambda s: extra(s, inertia=[1, 2]),
                      "inertia is not a 3 x 3 matrix|three rows of three, or the three diagonal"),
    "inertia ragged": (lambda s: extra(s, inertia=[[1, 0, 0], [0, 1], [0, 0, 1]]), "inertia is not a 3 x 3 matrix"),
    "inertia asymmetric": (lambda s: extra(s, inertia=[[1, k, 0], [0, 1, 0], [0, 0, 1]]),
                           "inertia is not symmetric|I[1, 2] = k|I[2, 1] = 0|pass a symmetric matrix"),
    "inertia negative": (lambda s: extra(s, inertia=[[1, 2, 0], [2, 1, 0], [0, 0, 1]]),
                         "principal moments [-1, 1, 3]|one is negative|about the centre of mass"),
    "com short": (lambda s: extra(s, com=[1, 2]), "body 'extra': com has 2 components|pass 3"),
    "com number": (lambda s: extra(s, com=0), "body 'extra': com is 0|pass a list"),
    "com text": (lambda s: extra(s, com=["0", 0, 0]), "body 'extra': com, component 1 is the text '0'"),
    "com moving": (lambda s: extra(s, com=[q1, 0, 0]), "body 'extra' depends on q1"),
    "body without joint": (lambda s: s.add_body("loose"), "body 'loose' has no joint|join it to a parent|Free"),
    "body name number": (lambda s: extra(s, name=5), "one of the bodies is named 5|pass text"),
    "body name empty": (lambda s: extra(s, name=" "), "one of the bodies is named ' '|pass text"),
    "body name lines": (lambda s: extra(s, name='a"""\nimport os'), "one of the bodies is named|pass text on one line"),
    "body named ground": (lambda s: extra(s, name="ground"), "2 bodies are named 'ground'|a name of its own"),
    "two bodies of one name": (lambda s: extra(s, name="upper"), "2 bodies are named 'upper'|a name of its own"),
    # joints
    "joint no joint": (lambda s: s.add_joint("shoulder"), "add_joint was given 'shoulder'|sd.Revolute"),
    "joint class": (lambda s: s.add_joint(sd.Revolute), "add_joint was given <class|sd.Revolute"),
    "joint name": (lambda s: s.add_joint(sd.Fixed(None, "lower", s.add_body("extra"))),
                   "one of the joints is named None|pass text"),
    "joints of one name": (lambda s: s.add_joint(sd.Fixed("elbow", "lower", s.add_body("extra"))),
                           "2 joints are named 'elbow'"),
    "joint twice": (lambda s: s.add_joint(s.joints[0]), "joint 'shoulder' was added 2 times|add it once"),
    "joint to itself": (lambda s: s.add_joint(sd.Free("float", s.add_body("extra"), "extra", sd.coordinates("a:6"))),
                        "joint 'float' joins body 'extra' to itself|two different bodies"),
    "joint to ground": (lambda s: s.add_joint(sd.Fixed("hold", s.add_body("extra"), s.ground)),
                        "joint 'hold': the ground is its child|exchange parent and child"),
    "unknown child": (lambda s: s.add_joint(sd.Fixed("hold", "lower", "uper")),
                      "joint 'hold': child is 'uper', which is no body|bodies: ground, upper, lower|did you mean 'upper'"),
    "unknown parent": (lambda s: s.add_joint(sd.Fixed("hold", None, s.add_body("extra"))),
                       "joint 'hold': parent is None|bodies: ground"),
    "parent list": (lambda s: s.add_joint(sd.Fixed("hold", ["lower"], s.add_body("extra"))),
                    "joint 'hold': parent is ['lower']"),
    "body of another system": (lambda s: s.add_joint(sd.Fixed("hold", "lower", arm().bodies[0])),
                               "joint 'hold': child is 'upper', which is a body of another system"),
    "ground of another system": (lambda s: s.add_joint(sd.Fixed("hold", arm().ground, s.add_body("extra"))),
                                 "joint 'hold': parent is 'ground', which is a body of another system"),
    "two parents": (lambda s: s.add_joint(sd.Revolute("third", s.ground, "lower", q3)),
                    "body 'lower' is the child of joints 'elbow' and 'third'|add one of them with close_loop"),
    "same coordinate twice": (lambda s: joined(s, sd.Revolute, q1),
                              "joints 'shoulder' and 'wrist' both drive the coordinate q1|"
                              "gear: 2*q1|mimic: sympy.UnevaluatedExpr(q1)"),
    "coordinate text": (lambda s: joined(s, sd.Revolute, "q3"), "joint 'wrist': coordinate 1 is the text 'q3'|never evaluated"),
    "coordinates None": (lambda s: joined(s, sd.Cylindrical, [q3, None]), "joint 'wrist': coordinate 2 is None"),
    "coordinate list": (lambda s: joined(s, sd.Revolute, [q3]), "joint 'wrist': coordinate 1 is [q3] of type list"),
    "coordinates text": (lambda s: joined(s, sd.Cylindrical, "q3 q4"),
                         "joint 'wrist': coordinates is 'q3 q4'|pass a list of 2"),
    "coordinates one": (lambda s: joined(s, sd.Cylindrical, q3), "joint 'wrist': coordinates is q3|pass a list of 2"),
    "coordinates few": (lambda s: joined(s, sd.Spherical, [q3, q4]),
                        "joint 'wrist' (spherical) takes 3 coordinates (rad, rad, rad), found 2"),
    "coordinates for parameters": (lambda s: joined(s, sd.Spherical, [q3, q4, q9], sd.EulerParameters()),
                                   "joint 'wrist' (spherical) takes 4 coordinates (1, 1, 1, 1), found 3"),
    "coordinate driven by nobody": (lambda s: joined(s, sd.Revolute, 2 * q9),
                                    "joint 'wrist': coordinates uses q9, which no joint|coordinates: q1, q2"),
    "coordinate of a rate": (lambda s: joined(s, sd.Revolute, 2 * q1.dot), "joint 'wrist': its coordinate 2*q1_dot uses q1_dot|"
                             "may use coordinates, motions, t and parameters"),
    "coordinate an input": (lambda s: joined(s, sd.Revolute, tau), "joint 'wrist': its coordinate tau uses tau"),
    "Euler parameters given": (lambda s: joined(s, sd.Spherical, [1, 0, 0, sp.sin(sd.t)], sd.EulerParameters()),
                               "joint 'wrist': with Euler parameters every coordinate must be a symbol|use Euler angles"),
    "coordinate named t": (lambda s: joined(s, sd.Revolute, sd.coordinates("t")), "named 't', which is the time|another name"),
    "speed twice": (lambda s: joined(s, sd.Revolute, q3, speed=q1.dot), "the speed q1_dot belongs to 2 joints"),
    "speed is its coordinate": (lambda s: joined(s, sd.Revolute, q3, speed=q3), "q3 is a coordinate and a speed at once"),
    "speed text": (lambda s: joined(s, sd.Revolute, q3, speed="u3"),
                   "joint 'wrist' (revolute) takes 1 symbols as speeds, found ['u3']"),
    "speeds number": (lambda s: joined(s, sd.Cylindrical, [q3, q4], speeds=5), "takes 2 symbols as speeds, found 5"),
    "speed clashes with a derivative": (lambda s: joined(s, sd.Revolute, q3, speed=sd.speeds("q1_dot_dot")),
                                        "'q1_dot_dot' stands for the derivative of the speed q1_dot"),
    "axis long": (lambda s: joined(s, sd.Revolute, q3, axis=[sp.Symbol("k"), 1, 0]),
                  "joint 'wrist': axis [k, 1, 0] has length 1.2037 for arbitrary numbers, not 1|divide it"),
    "axis zero": (lambda s: joined(s, sd.Prismatic, q3, axis=[0, 0, 0]),
                  "axis [0, 0, 0] has length 0|a direction that is not zero"),
    "axis None": (lambda s: joined(s, sd.Revolute, q3, axis=None), "joint 'wrist': axis is None|pass a list"),
    "axis text": (lambda s: joined(s, sd.Revolute, q3, axis="z"), "joint 'wrist': axis is 'z'|pass a list"),
    "axis of 4": (lambda s: joined(s, sd.Revolute, q3, axis=[0, 0, 0, 1]), "joint 'wrist': axis has 4 components|pass 2 or 3"),
    "axis moving": (lambda s: joined(s, sd.Revolute, q3, axis=[sp.cos(q1), sp.sin(q1), 0]),
                    "joint 'wrist' depends on q1|must be constant"),
    "one axis": (lambda s: joined(s, sd.Universal, [q3, q4], axes=[[1, 0, 0]]),
                 "joint 'wrist' (universal) takes 2 axes, found [[1, 0, 0]]"),
    "three axes": (lambda s: joined(s, sd.Universal, [q3, q4], axes=np.eye(3)), "joint 'wrist' (universal) takes 2 axes, found "),
    "axes None": (lambda s: joined(s, sd.Universal, [q3, q4], axes=None), "joint 'wrist' (universal) takes 2 axes, found None"),
    "second axis": (lambda s: joined(s, sd.Universal, [q3, q4], axes=[[1, 0, 0], [0, 0, 0]]),
                    "second axis [0, 0, 0] has length 0"),
    "parallel axes": (lambda s: joined(s, sd.Universal, [q3, q4], axes=[[0, 0, 1], [0, 0, -1]]),
                      "its two axes are parallel|Revolute"),
    "point text": (lambda s: joined(s, sd.Revolute, q3, parent_point=["l", 0, 0]),
                   "joint 'wrist': parent_point, component 1 is the text 'l'"),
    "point long": (lambda s: joined(s, sd.Revolute, q3, child_point=[0] * 4), "joint 'wrist': child_point has 4 components"),
    "point moving": (lambda s: joined(s, sd.Revolute, q3, parent_point=[q1, 0, 0]),
                     "joint 'wrist' depends on q1|must be constant|a joint of its own for what moves, such as a Prismatic"),
    "rotation skewed": (lambda s: joined(s, sd.Revolute, q3, parent_rotation=[[1, 0, 0], [0, 1, 0.1], [0, 0, 1]]),
                        "joint 'wrist': parent_rotation is not a rotation|differs from the identity by 0.1"),
    "rotation mirrored": (lambda s: joined(s, sd.Revolute, q3, child_rotation=[1, 1, -1]),
                          "child_rotation is not a rotation|determinant"),
    "rotation shape": (lambda s: joined(s, sd.Revolute, q3, child_rotation=[[1, 0], [0, 1]]),
                       "child_rotation is not a 3 x 3 matrix"),
    "rotation text": (lambda s: joined(s, sd.Revolute, q3, parent_rotation="eye"), "parent_rotation is 'eye'|pass a list"),
    "orientation text": (lambda s: joined(s, sd.Spherical, [q3, q4, q9], "XYZ"),
                         "joint 'wrist': orientation is 'XYZ'|sd.EulerAngles('ZYX')"),
    "orientation class": (lambda s: joined(s, sd.Free, sd.coordinates("a:6"), sd.EulerParameters),
                          "orientation is <class|sd.EulerParameters()"),
    "nothing with inertia": (lambda s: s.add_joint(sd.Revolute("wrist", "lower", s.add_body("extra"), q3)),
                             "joint 'wrist': what it moves has no mass or inertia along q3_dot|give body 'extra'"),
    "added coordinate of a joint": (lambda s: s.add_coordinate(q1), "q1 was given to add_coordinate, but joint 'shoulder'"),
    "added coordinates in a list": (lambda s: s.add_coordinate([q3, q4]), "add_coordinate was given [q3, q4]|one by one"),
    "added coordinate text": (lambda s: s.add_coordinate("q3"), "add_coordinate was given 'q3'|sd.coordinates"),
    # loads
    "force on nobody": (lambda s: s.add_force("uper", [1, 0, 0]),
                        "force_1: body is 'uper', which is no body|did you mean 'upper'"),
    "force on None": (lambda s: s.add_force(None, [1, 0, 0]), "force_1: body is None"),
    "force frame": (lambda s: s.add_force("upper", [1, 0, 0], frame="N"),
                    "force_1: frame is 'N', which is no body|bodies: ground"),
    "force reaction": (lambda s: s.add_force("upper", [1, 0, 0], reaction="foot"), "force_1: reaction is 'foot'"),
    "force on itself": (lambda s: s.add_force("upper", [1, 0, 0], reaction="upper"),
                        "force_1: body and reaction are the same body"),
    "force short": (lambda s: s.add_force("upper", [1, 0]), "force_1 has 2 components|pass 3"),
    "force text": (lambda s: s.add_force("upper", ["-k*q1", 0, 0], name="wind"),
                   "wind, component 1 is the text '-k*q1'|never evaluated"),
    "force of nobody's coordinate": (lambda s: s.add_force("upper", [q9, 0, 0]),
                                     "force_1 uses q9, which no joint and no state drives"),
    "force of an acceleration": (lambda s: s.add_force("upper", [q1.ddot, 0, 0]), "force_1 uses the acceleration q1_ddot"),
    "force of other time": (lambda s: s.add_force("upper", [sp.Symbol("t", real=True), 0, 0]),
                            "force_1 uses a symbol t with assumptions|symdyn.t"),
    "force of unknown function": (lambda s: s.add_force("upper", [sp.Function("f")(q1), 0, 0]),
                                  "force_1, component 1 uses f(q1)|no value"),
    "force of third derivative": (lambda s: s.add_force("upper", [dynamicsymbols("q1", 3), 0, 0]),
                                  "force_1, component 1 uses|no value"),
    "force point moving": (lambda s: s.add_force("upper", [1, 0, 0], point=[q1, 0, 0]),
                           "force_1: point depends on q1|must be constant"),
    "force point text": (lambda s: s.add_force("upper", [1, 0, 0], point="tip"), "force_1: point is 'tip'|pass a list"),
    "plain symbol for a coordinate": (lambda s: s.add_force("upper", [sp.Symbol("q1"), 0, 0]),
                                      "2 different symbols are named 'q1'|once"),
    "same name, other assumptions": (lambda s: s.add_force("upper", [sp.Symbol("m", positive=True), 0, 0]),
                                     "2 different symbols are named 'm'"),
    "input and parameter": (lambda s: s.add_force("upper", [sd.inputs("k"), k, 0]), "2 different symbols are named 'k'"),
    "symbol's name": (lambda s: s.add_force("upper", [sp.Symbol('a"""\nb'), 0, 0]),
                      "one of the symbols is named|pass text on one line"),
    "torque number": (lambda s: s.add_torque("upper", 5), "torque_1 is 5|pass a list"),
    "torque on nobody": (lambda s: s.add_torque("foot", [0, 0, 1]), "torque_1: body is 'foot'"),
    "load's name": (lambda s: s.add_torque("upper", [0, 0, 1], name="a\nb"), "one of the loads is named 'a\\nb'"),
    "joint force on nobody": (lambda s: s.add_joint_force("elbo", tau),
                              "joint_force_1 acts on the joint 'elbo'|joints: shoulder, elbow|"
                              "did you mean 'elbow'"),
    "joint force on None": (lambda s: s.add_joint_force(None, tau), "joint_force_1 acts on the joint None"),
    "joint force of another system": (lambda s: s.add_joint_force(arm().joints[0], tau),
                                      "joint_force_1 acts on the joint Revolute('shoulder')"),
    "joint force count": (lambda s: s.add_joint_force("elbow", [1, 2]),
                          "joint_force_1 has 2 values; joint 'elbow' has 1 degrees of freedom"),
    "joint force text": (lambda s: s.add_joint_force("elbow", EVIL), "joint_force_1 is the text|never evaluated"),
    "spring to nobody": (lambda s: s.add_spring_damper("upper", "wall", stiffness=k), "spring_1: body_b is 'wall'"),
    "spring to itself": (lambda s: s.add_spring_damper("upper", s.bodies[0], [1, 0, 0], stiffness=k),
                         "body_a and body_b are the same body"),
    "spring point": (lambda s: s.add_spring_damper("upper", "lower", point_a=1, stiffness=k), "spring_1: point_a is 1"),
    "spring stiffness text": (lambda s: s.add_spring_damper("upper", "lower", stiffness="k"),
                              "spring_1: stiffness is the text 'k'"),
    "spring stiffness of accelerations": (
        lambda s: s.add_spring_damper("upper", "lower", [0, 1, 0], [0, 2, 0], stiffness=k * q1.ddot),
        "spring_1 uses the acceleration q1_ddot"),
    # outputs, states, constraints
    "output name": (lambda s: s.add_output("tip x", q1), "an output is named 'tip x'|pass an identifier"),
    "output name number": (lambda s: s.add_output(3, q1), "an output is named 3|pass an identifier"),
    "outputs of one name": (lambda s: [s.add_output("tip", q1), s.add_output("tip", q2)], "2 outputs are named 'tip'"),
    "output text": (lambda s: s.add_output("tip", "q1 + q2"), "output 'tip' is the text 'q1 + q2'|never evaluated"),
    "output of nobody's coordinate": (lambda s: s.add_output("tip", [q1, q9]), "output 'tip' uses q9"),
    "position of nobody": (lambda s: s.add_output("tip", sd.position("hand")), "output 'tip': body is 'hand'"),
    "position point": (lambda s: s.add_output("tip", sd.position("upper", 5)), "output 'tip': point is 5|pass a list"),
    "position point moving": (lambda s: s.add_output("tip", sd.velocity("upper", [q1, 0, 0])),
                              "output 'tip': point depends on q1"),
    "state text": (lambda s: s.add_state("z", 1), "add_state was given 'z' as its state|sd.coordinates('z')"),
    "state twice": (lambda s: [s.add_state(q9, 1), s.add_state(q9, 2)], "2 states are named 'q9'"),
    "state is a coordinate": (lambda s: s.add_state(q1, 1), "q1 is a coordinate and a state at once"),
    "state rate text": (lambda s: s.add_state(q9, "1"), "rate of state q9 is the text '1'"),
    "constraint": (lambda s: s.add_constraint(q1 - q2),
                   "the model has a constraint or closed loop|the embedding form takes trees only|use system.augmented()"),
    "constraint text": (lambda s: s.add_constraint("q1 - q2"), "constraint_1 is the text 'q1 - q2'|never evaluated"),
    "loop": (lambda s: s.close_loop(sd.Revolute("close", "lower", s.ground)),
             "a constraint or closed loop|use system.augmented()"),
    "loop no joint": (lambda s: s.close_loop("elbow"), "close_loop was given 'elbow'|sd.Revolute"),
    "loop to nobody": (lambda s: s.close_loop(sd.Fixed("close", "lower", "wall")), "joint 'close': child is 'wall'"),
    # ground
    "ground with a coordinate": (lambda s: s.move_ground([q1, 0, 0]), "move_ground uses q1|given functions of t"),
    "ground with an input": (lambda s: s.move_ground([0, 2 * tau, 0]), "move_ground uses tau|given functions of t"),
    "ground with nobody's coordinate": (lambda s: s.move_ground([0, 2 * q9, 0]), "move_ground uses q9, which no joint"),
    "ground text": (lambda s: s.move_ground(["t", 0, 0]), "move_ground: position, component 1 is the text 't'"),
    "ground angles": (lambda s: s.move_ground([0, 0, 0], sd.t), "move_ground: angles is t|pass a list"),
    "ground angles short": (lambda s: s.move_ground([0, 0, 0], [sd.t]), "move_ground: angles has 1 components|pass 3"),
    "joint named as the ground's": (lambda s: [s.move_ground([sd.t, 0, 0]),
                                               s.add_joint(sd.Fixed("ground_motion", "lower", s.add_body("x")))],
                                    "2 joints are named 'ground_motion'"),
    # numbers
    "default unknown": (lambda s: s.set_defaults({sp.Symbol("mm"): 1}), "defaults has a number for 'mm', which is no parameter|"
                        "there are g, m, l|did you mean 'm'"),
    "default for a coordinate": (lambda s: s.set_defaults({q1: 1}), "defaults has a number for 'q1', which is no parameter"),
    "default text": (lambda s: s.set_defaults({m: "1.5"}), "defaults: the value of m is '1.5'|pass a finite number"),
    "default None": (lambda s: s.set_defaults({m: None}), "defaults: the value of m is None|pass a finite number"),
    "default symbol": (lambda s: s.set_defaults({m: l}), "defaults: the value of m is l|pass a finite number"),
    "default nan": (lambda s: s.set_defaults({m: math.nan}), "defaults: the value of m is nan|pass a finite number"),
    "default complex": (lambda s: s.set_defaults({m: 1j}), "defaults: the value of m is 1j"),
    "defaults list": (lambda s: setattr(s, "defaults", [1, 2]), "defaults is [1, 2]|pass a dict"),
    "initial unknown": (lambda s: s.initial.update({"q1dot": 1}),
                        "initial has a number for 'q1dot'|no coordinate, speed, state or input|"
                        "there are q1, q2, q1_dot, q2_dot|did you mean 'q1_dot'"),
    "initial for a parameter": (lambda s: s.initial.update({m: 1}), "initial has a number for 'm'"),
    "initial text": (lambda s: s.initial.update({q1: "0"}), "initial: the value of q1 is '0'"),
    "unit of nothing": (lambda s: s.units.update({"mm": "kg"}), "units has one for 'mm', which is no symbol|did you mean 'm'"),
    "unit a number": (lambda s: s.units.update({m: 1}), "units: that of m is 1|pass text such as 'N m'"),
    "unit of several lines": (lambda s: s.units.update({m: "k\n\"\"\"g"}), "units: that of m is|pass text such as 'N m'"),
    "duration text": (lambda s: setattr(s, "duration", "long"), "duration is 'long'|pass a finite number"),
    "duration negative": (lambda s: setattr(s, "duration", -1), "duration is -1 s|pass a positive number"),
}

PLANAR: dict[str, Case] = {
    "spherical": (lambda s: joined(s, sd.Spherical, sd.coordinates("a:3")),
                  "joint 'wrist' is spherical, but the system is planar|"
                  "use Revolute, Prismatic, Planar or Fixed|planar=False"),
    "free": (lambda s: joined(s, sd.Free, sd.coordinates("a:6")), "joint 'wrist' is free, but the system is planar"),
    "axis x": (lambda s: joined(s, sd.Revolute, q3, axis=[1, 0, 0]), "axis [1, 0, 0] is not along z, but the system is planar"),
    "slide along z": (lambda s: joined(s, sd.Prismatic, q3, axis=[0, 0, 1]), "axis [0, 0, 1] is not in the x-y plane"),
    "parent_rotation": (lambda s: joined(s, sd.Revolute, q3, parent_rotation=turned),
                        "parent_rotation turns out of the x-y plane"),
    "child_rotation": (lambda s: joined(s, sd.Fixed, child_rotation=turned), "child_rotation turns out of the x-y plane"),
    "ground": (lambda s: s.move_ground([0, 0], [0, sd.t, 0]), "move_ground: angles turn the ground out of the x-y plane"),
    "force of 4": (lambda s: s.add_force("upper", [1, 2, 3, 4]), "force_1 has 4 components; pass 2 or 3"),
    "torque of 2": (lambda s: s.add_torque("upper", [1, 2]), "torque_1 has 2 components; pass 3"),
    "torque text": (lambda s: s.add_torque("upper", "tau"), "torque_1"),
    "inertia text": (lambda s: extra(s, inertia="1"), "body 'extra': inertia"),
    "inertia negative": (lambda s: extra(s, inertia=-1), "body 'extra': inertia has the principal moments|negative"),
}


@pytest.mark.parametrize("name", SPATIAL)
def test_fault(name: str) -> None:
    change, parts = SPATIAL[name]
    s = arm()
    change(s)
    _one(messages(s), parts)


@pytest.mark.parametrize("name", PLANAR)
def test_fault_in_the_plane(name: str) -> None:
    change, parts = PLANAR[name]
    s = arm(planar=True)
    change(s)
    _one(messages(s), parts)


def _one(faults: tuple[str, ...], parts: str) -> None:
    assert len(faults) == 1, "\n".join(faults)
    for part in parts.split("|"):
        assert part in faults[0], faults[0]


@pytest.mark.parametrize(("options", "part"), [
    ({"gravity": 9.81}, "gravity is 9.81; pass a list"), ({"gravity": "down"}, "gravity is 'down'; pass a list"),
    ({"gravity": [1]}, "gravity has 1 components; pass 3"), ({"gravity": [0, 0, 0, 0]}, "gravity has 4 components"),
    ({"gravity": [0, 0, "-g"]}, "gravity, component 3 is the text '-g'"),
    ({"gravity": [0, -9.81], "planar": False}, "gravity has 2 components"),
    ({"gravity": [0, 0, math.inf]}, "gravity, component 3 is oo"),
    ({"gravity": [0, 0, q1]}, "gravity depends on q1, but must be constant"),
    ({"parameters": "m l"}, "parameters has 'm l'; pass a list of symbols"), ({"parameters": [m, "l"]}, "parameters has 'l'"),
    ({"name": "my arm"}, "the system's name is 'my arm'; pass an identifier"),
    ({"name": "class"}, "the system's name is 'class'"),
    ({"name": 5}, "the system's name is 5"), ({"name": ""}, "the system's name is ''"),
], ids=str)
def test_fault_of_the_system_itself(options: dict[str, Any], part: str) -> None:
    s = sd.System(**{"name": "arm", **options})
    s.add_joint(sd.Free("float", s.ground, s.add_body("box", mass=1, inertia=[1, 1, 1]), sd.coordinates("q1:7")))
    if s.planar:
        s.joints[:] = [sd.Planar("float", s.ground, "box", sd.coordinates("q1:4"))]
    assert any(part in fault for fault in messages(s))


def test_symbols_that_are_not_declared() -> None:
    s = arm(parameters=[g, m])
    assert messages(s) == tuple(
        f"{where} uses the symbol l, not declared in the model; declared: g, m; add l to the parameters or remove it"
        for where in ("body 'upper'", "body 'lower'", "joint 'elbow'"))
    assert arm(parameters=[l, k, g, m]).check().parameters == (l, k, g, m)


def test_no_bodies() -> None:
    assert messages(sd.System("empty")) == ("the system has no bodies; add one with add_body and join it with add_joint",)


def test_no_coordinates() -> None:
    s = sd.System("stiff")
    s.add_joint(sd.Fixed("hold", s.ground, s.add_body("block", mass=1)))
    _one(messages(s), "no joint has a coordinate of its own|nothing can move|sd.coordinates('q')")


def test_ring_without_ground() -> None:
    s = arm()
    a, b, c = (s.add_body(n, mass=1, inertia=[1, 1, 1]) for n in "abc")
    for k_, (parent, child) in enumerate([(a, b), (b, a), (b, c)]):
        s.add_joint(sd.Revolute(f"j{k_}", parent, child, sd.coordinates(f"r{k_}")))
    _one(messages(s), "bodies 'a', 'b' hang on each other in a loop and not on the ground|close_loop")


def test_what_hangs_on_a_loose_body_is_not_called_a_loop() -> None:
    s = arm()
    s.add_joint(sd.Fixed("hold", s.add_body("loose"), s.add_body("other")))
    _one(messages(s), "body 'loose' has no joint")


def test_all_faults_come_at_once() -> None:
    s = sd.System("arm", gravity=[0, 0, "g"])
    body = s.add_body("body", mass=-1, inertia=[1, 2], com=None)
    s.add_joint(sd.Revolute("j", s.ground, body, "q", axis=[0, 0, 0], parent_rotation=[2, 1, 1]))
    s.add_body("body")
    s.add_force("nobody", [1, 2])
    s.add_joint_force("k", "tau")
    s.add_output("a b", q9)
    s.add_state("z", None)
    s.defaults = {"mass": 1, q1: "x"}
    s.initial = {"speed": math.nan}
    s.duration = None
    with pytest.raises(ModelError) as caught:
        s.check()
    error = caught.value
    assert len(error.faults) == len(set(error.faults)) >= 20
    assert str(error).startswith(f"the model 'arm' has {len(error.faults)} faults:\n  - gravity, component 3")
    for word in ("mass", "inertia", "com", "axis", "parent_rotation", "coordinate 1", "2 bodies", "nobody", "joint 'k'",
                 "'a b'", "q9", "'z'", "rate of state", "defaults", "initial", "duration"):
        assert any(word in fault for fault in error.faults), word


def test_describing_never_raises_and_check_can_be_repeated() -> None:
    s = arm()
    s.add_body("extra", mass="1")
    first = messages(s)
    assert messages(s) == first and len(first) == 2


def test_text_is_never_evaluated() -> None:
    s = sd.System("arm", gravity=[EVIL, 0, 0])
    body = s.add_body("b", mass=EVIL, inertia=[[EVIL] * 3] * 3, com=[EVIL] * 3)
    s.add_joint(sd.Revolute("j", s.ground, body, EVIL, axis=[EVIL] * 3, parent_point=[EVIL] * 3,
                            parent_rotation=[[EVIL] * 3] * 3))
    s.add_force(body, [EVIL] * 3, point=[EVIL] * 3)
    s.add_torque(body, [EVIL] * 3)
    s.add_joint_force("j", [EVIL])
    s.add_spring_damper(body, s.ground, [EVIL] * 3, [EVIL] * 3, EVIL, EVIL, EVIL)
    s.add_output("o", [EVIL])
    s.add_output("p", sd.position(body, [EVIL] * 3))
    s.add_state(q1, EVIL)
    s.add_constraint(EVIL)
    s.move_ground([EVIL] * 3, [EVIL] * 3)
    s.defaults, s.initial = {EVIL: EVIL}, {q1: EVIL}
    assert sum("never evaluated" in fault for fault in messages(s)) > 40
    assert "SYMDYN_EVALUATED" not in os.environ


@pytest.mark.parametrize("sequence", ["XXY", "ZY", "zyx", "", None, 5, "ZYXZ"])
def test_euler_sequences(sequence: Any) -> None:
    with pytest.raises(ModelError, match=r"there is no Euler sequence .*; the twelve are XYX, XYZ"):
        sd.EulerAngles(sequence)


@pytest.mark.parametrize("names", ["", " ", 5, None, ["q1"]])
@pytest.mark.parametrize("make", [sd.coordinates, sd.speeds, sd.parameters, sd.inputs])
def test_names_of_symbols(make: Any, names: Any) -> None:
    with pytest.raises(ModelError, match=r"names of symbols are .*; pass text such as 'q1 q2'"):
        make(names)


# -- what can be computed with, but no real mechanism has


@pytest.mark.parametrize(("inertia", "match"), [
    ([1, 1, 3], r"principal moments \[1, 1, 3\] kg m\^2 violate the triangle inequality"),
    ([[2, 0, 1.9], [0, 1, 0], [1.9, 0, 2]], "triangle inequality"), ([1, 1, 0], "inertia is semidefinite, principal moments")])
def test_doubtful_inertias_are_warned_of(inertia: Any, match: str) -> None:
    s = arm()
    extra(s, inertia=inertia)
    with pytest.warns(ModelWarning, match=f"body 'extra': .*{match}"):
        s.check()


@pytest.mark.parametrize("inertia", [None, [1, 1, 2], [0, 0, 0], [k, 1, 5], [[2, 0.1, 0], [0.1, 2, 0], [0, 0, 3]]])
def test_sound_inertias_are_not(inertia: Any, recwarn: pytest.WarningsRecorder) -> None:
    s = arm()
    extra(s, inertia=inertia)
    s.check()
    assert not recwarn.list


# -- what is accepted


@pytest.mark.parametrize("value", [1, 1.5, Fraction(3, 2), np.float64(1.5), np.float32(1.5), np.int64(2), np.array(1.5),
                                   np.array([1.5]), m, sp.Rational(3, 2), sp.sqrt(2), sp.pi * m], ids=repr)
def test_scalars(value: Any) -> None:
    s = arm()
    part = extra(s, mass=value)
    s.add_joint_force("elbow", value)
    assert part.mass - (value if isinstance(value, sp.Expr) else sp.Rational(str(np.ravel(value)[0]))) == 0
    assert len(s.check().bodies) == 3


@pytest.mark.parametrize("value", [[1, 2, 3], (1.0, 2, 3), np.array([1, 2, 3]), np.array([[1.0], [2], [3]]),
                                   sp.Matrix([1, 2, 3]), sp.Matrix([[1, 2, 3]]), sp.ImmutableMatrix([1, 2, 3])], ids=repr)
def test_vectors(value: Any) -> None:
    s = arm()
    part = extra(s, com=value)
    joint = joined(s, sd.Revolute, q3, parent_point=value)
    s.bodies.pop()
    s.joints.pop()
    s.add_force("upper", value)
    s.add_output("o", value)
    model = s.check()
    for taken in (part.com, joint.parent_point, model.loads[0].force, model.outputs[0].value):
        assert [float(e) for e in taken] == [1, 2, 3]


@pytest.mark.parametrize("value", [[1, 1, 1], np.eye(3), np.ones(3), sp.eye(3), sp.ImmutableMatrix(sp.eye(3)),
                                   [[1, 0, 0], [0, 1, 0], [0, 0, 1]], [[1, 0, 0], (0, 1, 0), [0, 0, 1]]], ids=repr)
def test_matrices(value: Any) -> None:
    s = arm()
    part = extra(s, inertia=value)
    assert [float(e) for e in part.inertia] == list(np.eye(3).ravel()) and s.check()


def test_numbers_by_name_or_symbol() -> None:
    s = arm()
    q = dynamicsymbols("q1")
    s.defaults = {"m": 1, l: np.float64(0.5), sp.Symbol("g"): sp.Rational(981, 100)}
    s.initial = {q: 0.1, q.diff(): 2, "q2": sp.pi / 2}
    model = s.check()
    assert model.defaults == {m: 1.0, l: 0.5, g: 9.81}
    assert model.initial == {q1: 0.1, q1.dot: 2.0, q2: pytest.approx(math.pi / 2)}
    assert all(type(v) is float for v in [*model.defaults.values(), *model.initial.values()])
    s.units = {"l": "cm", m: "kg m"}
    assert {a.name: unit for a, unit in s.check().units.items() if a.name in "lmg"} == {"l": "cm", "m": "kg m", "g": "m/s^2"}


def test_force_at_the_centre_of_mass_of_a_body_that_comes_later() -> None:
    s = arm()
    s.add_force("extra", [1, 0, 0])
    extra(s, com=[1, l, 0])
    assert list(s.check().loads[0].point) == [1, l, 0]


@pytest.mark.parametrize("name", ["double", "lambda", r"m_{1}", "my mass", "größe", "%s", "{{x}}", "sin", "q", "x*/y"])
def test_unusual_names_are_no_fault(name: str) -> None:
    s = sd.System("double", gravity=[0, -9.81])
    mass, q = sp.Symbol(name + "1"), sp.Symbol(name)
    bob = s.add_body(name, mass=mass, com=[0, -1])
    s.add_joint(sd.Revolute(name, s.ground, bob, q))
    s.add_joint_force(name, 0, name=name)
    s.defaults, s.initial = {mass: 2.0}, {name: 0.5}
    equations = s.embedding()
    found = equations.compile(backend="numpy").rhs(0.0, [0.5, 0.1])
    assert found == pytest.approx([0.1, -9.81 * math.sin(0.5)])
