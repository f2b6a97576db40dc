"""The tree in numbers: the same as on the tape, and what is said of values that do not fit."""

from __future__ import annotations

import time
from fractions import Fraction
from typing import Any

import mpmath
import numpy as np
import pytest
import sympy as sp

import symdyn as sd
from symdyn import systems
from symdyn.errors import ArgumentError, EvaluationError
from symdyn.formulation.textbook.doubles import Doubles
from symdyn.formulation.textbook.forward_dynamics import forward_dynamics
from symdyn.formulation.textbook.inverse_dynamics import inverse_dynamics
from symdyn.formulation.textbook.numbers import NumericTree, numeric_tree
from symdyn.tape import Tape
from symdyn.tape.evaluate import evaluate
from tests import helpers
from tests.formulation.recursive.trees import at, check, numeric, state
from tests.mechanisms import kitchen_sink


@pytest.fixture(scope="module")
def arm() -> NumericTree:
    return NumericTree(systems.get("two_link_arm").check())


@pytest.mark.parametrize(("seed", "options"), [(0, {}), (4, {}), (9, {"gears": True}), (6, {"driven": True})])
def test_every_array_is_that_of_the_tape(seed: int, options: dict[str, bool]) -> None:
    tree = numeric(seed, **options)
    where = state(tree, seed)
    floats, digits = tree.at(**where), tree.at(**where, digits=30)
    model = tree.model
    values = {**{s.name: v for s, v in {**model.defaults, **model.initial}.items()}, **where["q"], **where["u"], "t": where["t"]}
    arrays: dict[str, Any] = {"D": tree.tree.D, "w": tree.tree.w, "b": tree.tree.b, "rates": tree.tree.rates,
                              "joint": tree.applied.joint, "f": tree.applied.wrenches[-1][0], "S_ring": tree.rates.S_ring[-1],
                              "inertia": tree.tree.links[-1].inertia.I, "effective": tree.tree.links[0].effective.h,
                              "R": tree.tree.links[-1].R, "pose": tree.tree.poses[-1].p}
    expected = evaluate(Tape.of(tree.algebra.recorder, **arrays), values, 30)
    for here, closeness in ((floats, 1e-14), (digits, mpmath.mpf(10) ** -28)):
        tree_ = here.tree
        found = {"D": tree_.D, "w": tree_.w, "b": tree_.b, "rates": np.array(tree_.rates, dtype=object),
                 "joint": here.applied.joint, "f": here.applied.wrenches[-1][0],
                 "S_ring": tree_.algebra.apparent_rates.S_ring[-1], "inertia": tree_.links[-1].inertia.I,
                 "effective": tree_.links[0].effective.h, "R": tree_.links[-1].R, "pose": tree_.poses[-1].p}
        for name, array in found.items():
            assert helpers.close(array, expected[name], closeness), name
    assert all(isinstance(e, (int, float)) for link in floats.tree.links for e in link.R.ravel())


def test_zeros_stay_exact(arm: NumericTree) -> None:
    link = arm.at([0.1, 0.2], [0.3, 0.4]).tree.links[1]
    assert all(type(e) is int for e in link.S.ravel()) and type(link.R[0, 2]) is int and link.R[2, 2] == 1


def test_values_by_symbol_by_name_and_in_order(arm: NumericTree) -> None:
    q1, q2 = arm.model.coordinates
    first = arm.at([0.1, 0.2], [0.3, 0.4], {"m1": 3.0}).tree
    second = arm.at({q1: 0.1, "q2": Fraction(1, 5)}, {q1.dot: 0.3, "q2_dot": 0.4}, {sp.Symbol("m1"): 3.0},
                    inputs={"tau1": 2}).tree
    for a, b in zip(first.links, second.links, strict=True):
        assert (a.R == b.R).all() and a.inertia.m == b.inertia.m
    assert first.links[0].inertia.m == 3.0
    third = numeric_tree(arm.model, {"q1": 0.1, q2: 0.2, "q1_dot": 0.3, "q2_dot": 0.4, "m1": 3.0})
    assert (third.links[1].R == first.links[1].R).all()


def test_what_does_not_fit_is_named(arm: NumericTree) -> None:
    rates = [0, 0]
    for arguments, message in (
            (([0.1], rates), "q has 1 values, needed are 2: q1, q2"),
            (([0.1, float("nan")], rates), "q: values must be finite numbers, found q2 = nan"),
            (([0.1, "a"], rates), "q2 = 'a'"),
            (([0.1, 0.2], {"q1_dot": 1}), "u: no value for q2_dot, which has no default"),
            (([0.1, 0.2], rates, {"m3": 1}), "params: there is no 'm3'; there are"),
            (([0.1, 0.2], rates, None, float("inf")), "t: values must be finite"),
            (([0.1, 0.2], rates, None, 0, [1, 2, 3]), "inputs has 3 values, needed are 2: tau1, tau2")):
        with pytest.raises(ArgumentError, match=message):
            arm.at(*arguments)
    with pytest.raises(ArgumentError, match="there is no 'x'"):
        numeric_tree(arm.model, {"x": 1})
    s = sd.System("bare")
    s.add_joint(sd.Revolute("hinge", s.ground, s.add_body("disc", mass=sd.parameters("m"), com=[1, 0, 0])))
    with pytest.raises(ArgumentError, match="bare: params: no value for m, which has no default"):
        NumericTree(s.check()).at([0], [0])


def test_gimbal_lock_and_singular_joints_are_reported() -> None:
    s = sd.System("top")
    s.add_joint(sd.Spherical("socket", s.ground, s.add_body("top", mass=1, inertia=[1, 1, 1]), sd.coordinates("a b c"),
                             sd.EulerAngles("ZYX", "body")))
    tree = NumericTree(s.check())
    with pytest.raises(EvaluationError, match="top: the ZYX angles of joint socket are at gimbal lock"):
        tree.at([0.1, np.pi / 2, 0.2], [1, 2, 3])
    s = sd.System("rod")
    s.add_joint(sd.Revolute("hinge", s.ground, s.add_body("rod", mass=1, com=[sd.parameters("l"), 0, 0]), sd.coordinates("a")))
    here = NumericTree(s.check()).at([0.1], [0.2], {"l": 0.0})
    with pytest.raises(EvaluationError, match="rod: joint hinge moves no inertia along a_dot"):
        forward_dynamics(here.tree, [1.0])


def test_every_function_of_the_tape_in_doubles() -> None:
    equations = kitchen_sink().embedding()
    tape = equations.tape("rhs", "F_tilde", "power")
    values = {name: float(v) for name, v in helpers.state(equations, 3).items()}
    expected = evaluate(tape, values, 30)
    nodes = [e for output in tape.outputs.values() for e in output.entries if hasattr(e, "op")]
    found = dict(zip(nodes, Doubles(nodes).at(values), strict=True))
    for name, output in tape.outputs.items():
        array = np.array([found.get(e, e) for e in output.entries], dtype=object)
        check(array, expected[name].ravel(), 1e-13)


def test_loads_of_the_kitchen_sink_run_on_numbers() -> None:
    """Given motions, extra states, inputs, moving ground: the recursions and the embedding agree."""
    system = kitchen_sink()
    equations, tree = system.embedding(), NumericTree(system.check())
    values = {name: float(v) for name, v in helpers.state(equations, 4).items()}
    here = tree.at(*[{s.name: values[s.name] for s in group} for group in (
        tree.model.coordinates, tree.model.speeds, tree.model.parameters)], values["t"], *[
        {s.name: values[s.name] for s in group} for group in (tree.model.inputs, [z.symbol for z in tree.model.states])])
    (u_dot,) = helpers.quantities(equations, values, "accelerations")
    check(forward_dynamics(here.tree, here.applied.joint, here.applied.wrenches).u_dot, u_dot, 1e-12)


def test_it_is_fast_enough_for_an_oracle() -> None:
    """Once derived, a state of 30 links costs milliseconds (bound: for a slow, busy machine)."""
    tree = NumericTree(systems.get("spatial_chain", n=30).check())
    start = time.perf_counter()
    here = tree.at([0.1] * 30, [0.2] * 30).tree
    inverse_dynamics(here, [0.3] * 30)
    assert time.perf_counter() - start < 1


def test_floats_and_30_digits(arm: NumericTree) -> None:
    for seed in (1, 5, 11):
        tree = numeric(seed)
        here, precise = at(tree, seed), tree.at(**state(tree, seed), digits=30)
        found, expected = (forward_dynamics(n.tree, n.applied.joint, n.applied.wrenches) for n in (here, precise))
        check(found.u_dot, expected.u_dot, 1e-12)
