"""Passes over tapes: prune, merge, specialize, substitute, hoist, count."""

from __future__ import annotations

import math
from collections.abc import Sequence
from fractions import Fraction
from typing import Any

import pytest

import symdyn as sd
from symdyn.errors import SymdynError, UnsupportedExpression
from symdyn.tape import Node, Recorder, Tape
from symdyn.tape.evaluate import constant, evaluate
from symdyn.tape.node import COORDINATE, PARAMETER
from symdyn.tape.passes import specialize, substitute
from tests import helpers


@pytest.fixture
def r() -> Recorder:
    return Recorder()


@pytest.fixture
def abxy(r: Recorder) -> list[Node]:
    return [r.leaf(n, PARAMETER) for n in "ab"] + [r.leaf(n, COORDINATE) for n in "xy"]


# -- prune, merge


def test_prune_leaves_no_dead_code(r: Recorder, abxy: Sequence[Node]) -> None:
    a, _, x, y = abxy
    shared = x * y
    tape = Tape.of(r, one=shared + a, other=r.sin(shared), third=y)
    kept = tape.prune(["one"])
    assert list(kept.outputs) == ["one"]
    assert {n.op for n in kept.steps} == {"leaf", "mul", "add"} and [n.args[1] for n in kept.inputs] == ["a", "x", "y"]
    assert len(kept.steps) < len(tape.steps) and tape.prune(["third"]).operations == 0
    assert list(tape.prune(["other", "one"]).merge(tape.prune(["third"])).outputs) == ["other", "one", "third"]


def test_prune_names_what_it_does_not_know(r: Recorder, abxy: Sequence[Node]) -> None:
    with pytest.raises(KeyError, match="the tape has no output nothing, none; it has one, other"):
        Tape.of(r, one=abxy[0], other=1).prune(["one", "nothing", "none"])


def test_steps_stand_before_their_use() -> None:
    tape = sd.systems.get("three_link_arm").embedding().tape("rhs")
    seen: set[Node] = set()
    for node in tape.steps:
        assert all(a in seen for a in node.args if isinstance(a, Node))
        seen.add(node)


# -- specialize, substitute


@pytest.mark.parametrize("name", ["rhs", "M_tilde", "energy"])
def test_specialize_folds_and_keeps_the_values(name: str) -> None:
    equations = sd.systems.get("spatial_chain", n=3).embedding()
    tape = equations.tape(name)
    values = helpers.state(equations, 3)
    bound = {n: v for n, v in values.items() if n in {p.name for p in equations.symbols.parameters}}
    bound |= {"I1_xy": 0, "I1_xz": 0, "c2_y": 0, "c2_z": 0}
    special = specialize(tape, bound)
    assert special.operations < tape.operations and special.prologue == ()
    assert {n.mask for n in special.inputs}.isdisjoint({PARAMETER})
    assert helpers.close(helpers.at(special, values)[name], helpers.at(tape, values | bound)[name])


def test_specialize_some_parameters_only(r: Recorder, abxy: Sequence[Node]) -> None:
    a, b, x, _ = abxy
    tape = Tape.of(r, e=[a * x + b, r.apply("select", r.apply("gt", a, 2), x, x * x)])
    half = specialize(tape, {"a": 3, "unknown": 1, "x": 5})
    assert [n.args[1] for n in half.inputs] == ["b", "x"]
    assert [getattr(e, "op", e) for e in half.outputs["e"].entries] == ["add", "leaf"]
    assert specialize(tape, {"a": 0, "b": 0}).outputs["e"].entries[0] == 0


def test_specialize_keeps_names_sections_and_checks() -> None:
    tape = sd.systems.get("double_pendulum").embedding().tape("accelerations")
    special = specialize(tape, {"m1": 1.5})
    assert {"D1", "iD1"} <= set(special.recorder.names.values())
    assert sorted(special.recorder.checks.values()) == sorted(tape.recorder.checks[n] for n in tape.steps
                                                              if n in tape.recorder.checks)
    assert {n.section for n in special.running} <= {n.section for n in tape.steps}


def test_substitute(r: Recorder, abxy: Sequence[Node]) -> None:
    a, _, x, y = abxy
    square = x * x
    entries = (r.sin(square) + a, square, 3, y)
    assert substitute(entries, {square: y}, r) == (r.sin(y) + a, y, 3, y)
    assert substitute(entries, {square: 0}, r) == (a, 0, 3, y)
    assert substitute(entries, {x: y, y: x}, r)[1:] == (y * y, 3, x)
    assert substitute(entries, {}, r) == entries


# -- hoisting, counting


@pytest.mark.parametrize("name", ["rhs", "M_tilde", "J", "energy", "k_tilde"])
@pytest.mark.parametrize("system", [("spatial_chain", {"n": 4}), ("two_link_arm", {}), ("puma560", {})], ids=lambda s: s[0])
def test_nothing_running_depends_on_parameters_only(system: tuple[str, dict], name: str) -> None:
    tape = sd.systems.get(system[0], **system[1]).embedding().tape(name)
    for node in tape.running:
        assert any(leaf.mask != PARAMETER for leaf in Tape.of(tape.recorder, e=node).inputs)
    for node in tape.prologue:
        assert {leaf.mask for leaf in Tape.of(tape.recorder, e=node).inputs} == {PARAMETER}
    assert set(tape.hoisted) <= set(tape.prologue) and not set(tape.running) & set(tape.prologue)


def test_hoisted_is_what_is_used(r: Recorder, abxy: Sequence[Node]) -> None:
    a, b, x, _ = abxy
    inner = a * b
    outer = r.sin(inner)
    tape = Tape.of(r, e=outer * x, p=-(a + b))
    assert tape.prologue == (inner, outer, a + b) and tape.hoisted == (outer, a + b)
    assert tape.count() == {"mul": 1} and tape.count_prologue() == {"add": 1, "mul": 1, "trig": 1}
    r.positive(inner, "a b must be positive")
    assert Tape.of(r, **{n: o.array() for n, o in tape.outputs.items()}).hoisted == (inner, outer, a + b)


def _counts() -> dict[str, tuple[Any, dict[str, int], int]]:
    """name -> expression of (recorder, a, b, x, y), operations by kind, longest chain."""
    return {
        "leaf": (lambda r, a, b, x, y: x, {}, 0), "number": (lambda r, a, b, x, y: 5, {}, 0),
        "parameter": (lambda r, a, b, x, y: a * b + 1, {}, 0), "sign": (lambda r, a, b, x, y: -x, {}, 0),
        "sum": (lambda r, a, b, x, y: x + y + a, {"add": 2}, 2),
        "square": (lambda r, a, b, x, y: x * x + y * y, {"add": 1, "mul": 2}, 2),
        "difference": (lambda r, a, b, x, y: (x - y) * (y - x), {"add": 1, "mul": 1}, 2),
        "quotient": (lambda r, a, b, x, y: x / y, {"div": 1}, 1),
        "reciprocal": (lambda r, a, b, x, y: x**-2, {"div": 1, "mul": 1}, 2),
        "trig": (lambda r, a, b, x, y: r.sin(x) * r.cos(x) + r.sin(-x), {"add": 1, "mul": 1, "trig": 2}, 3),
        "root": (lambda r, a, b, x, y: r.sqrt(x * x + 1), {"add": 1, "mul": 1, "sqrt": 1}, 3),
        "choice": (lambda r, a, b, x, y: r.apply("select", r.apply("lt", x, y), x, y), {"compare": 2}, 2),
        "function": (lambda r, a, b, x, y: r.apply("exp", -x) + r.pi() * x, {"add": 1, "function": 1, "mul": 1}, 2),
        "balanced": (lambda r, a, b, x, y: (x + a) * (y + b), {"add": 2, "mul": 1}, 2),
        "chain": (lambda r, a, b, x, y: r.sin(r.sin(r.sin(x))), {"trig": 3}, 3),
    }


@pytest.mark.parametrize("name", _counts())
def test_known_counts(name: str, r: Recorder, abxy: Sequence[Node]) -> None:
    make, count, chain = _counts()[name]
    tape = Tape.of(r, e=make(r, *abxy))
    assert (tape.count(), tape.operations, tape.longest_chain()) == (count, sum(count.values()), chain)


def test_known_counts_of_mechanisms() -> None:
    pendulum = sd.systems.get("pendulum").embedding().tape("accelerations")
    assert pendulum.count() == {"mul": 3, "trig": 1} and pendulum.longest_chain() == 4
    assert sd.systems.get("prismatic_chain", n=2).embedding().tape("M_tilde").operations == 0


# -- evaluation


def test_evaluate_names_missing_values(r: Recorder, abxy: Sequence[Node]) -> None:
    with pytest.raises(KeyError, match="no value for a, y"):
        evaluate(Tape.of(r, e=abxy[0] * abxy[3]), {"x": 1})


def test_evaluate_takes_floats_as_they_are_and_any_precision(r: Recorder, abxy: Sequence[Node]) -> None:
    x = abxy[2]
    tape = Tape.of(r, e=[[x * x, Fraction(1, 3)]])
    few, many = (evaluate(tape, {"x": 0.1}, digits)["e"] for digits in (20, 60))
    assert many.shape == (1, 2) and abs(many[0, 1] * 3 - 1) < 1e-58
    assert abs(many[0, 0] - Fraction(0.1).numerator ** 2 / many[0, 0].context.mpf(Fraction(0.1).denominator) ** 2) < 1e-58
    assert 0 < abs(few[0, 1] - many[0, 1]) < 1e-19


def test_constant(r: Recorder) -> None:
    assert constant(r.pi()) == 3.141592653589793 and constant(Fraction(1, 3)) == 1 / 3
    value = constant(r.sqrt(2) * r.sin(Fraction(1, 2)) - r.pi() / 6)
    assert value == pytest.approx(math.sqrt(2) * math.sin(0.5) - math.pi / 6, rel=1e-15)


def test_constants_that_are_not_real(r: Recorder) -> None:
    with pytest.raises(UnsupportedExpression, match=r"complex number \(0.0 \+ 1.76275j\)"):
        constant(r.apply("acos", 3))


def test_outputs_keep_their_shape(r: Recorder, abxy: Sequence[Node]) -> None:
    tape = Tape.of(r, s=abxy[0], v=[abxy[0], 2], m=[[1, abxy[2]]], none=[])
    assert [tape.outputs[n].array().shape for n in ("s", "v", "m", "none")] == [(), (2,), (1, 2), (0,)]
    assert tape.outputs["m"].array()[0, 1] is abxy[2]


def test_equations_name_unknown_quantities() -> None:
    with pytest.raises(SymdynError, match="has no quantity 'mass'; it has"):
        sd.systems.get("pendulum").embedding().tape("mass")
