"""Common steps of long functions are written once, in a function that they call first: the same numbers in less code."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
import pytest

import symdyn as sd
from symdyn.backend import draft, source
from symdyn.backend.common import most_in_common, saved
from symdyn.backend.dialect import Dialect
from symdyn.backend.divide import divide
from symdyn.lab.nets import moving, net
from symdyn.pipeline import emit
from symdyn.runtime.building.compiler import find_compiler
from symdyn.tape import Recorder
from symdyn.tape.node import COORDINATE
from symdyn.tape.tape import Tape, reachable, unsigned

needs_c = pytest.mark.skipif(find_compiler() is None, reason="no C compiler here")
FUNCTIONS = ("rhs", "position_correction", "velocity_correction", "length")


@pytest.fixture
def short(monkeypatch: pytest.MonkeyPatch) -> None:
    """Functions count as long from 100 steps on, and 50 statements in common are enough."""
    read = source.read_dialect

    def changed(folder: Any) -> Dialect:
        dialect = read(folder)
        parts = dialect.parts and dataclasses.replace(dialect.parts, whole=100, longest=60)
        return dataclasses.replace(dialect, parts=parts)

    monkeypatch.setattr(source, "read_dialect", changed)
    monkeypatch.setattr("symdyn.backend.batch.read_dialect", changed)
    monkeypatch.setattr(draft, "LEAST_COMMON", 50)


def steps_of(*results: Any) -> list[Any]:
    return [node for node in reachable(results) if node.op not in ("leaf", "neg")]


def test_those_functions_are_found_that_save_the_most() -> None:
    recorder = Recorder()
    x, y = (recorder.leaf(name, COORDINATE) for name in "xy")
    of_all, of_two = recorder.sin(x), recorder.cos(y)
    for _ in range(9):
        of_two = recorder.sin(of_two)
    bodies = {"first": steps_of(of_all + y), "second": steps_of(of_all * of_two), "third": steps_of(of_two / 3)}
    none: dict[str, dict[Any, str]] = {name: {} for name in bodies}
    found = most_in_common(bodies, none)
    assert found == (("second", "third"), steps_of(of_two)) and saved(found) == 10
    assert most_in_common({"first": bodies["first"]}, none) == (("first",), bodies["first"])
    assert saved(most_in_common({"first": bodies["first"]}, none)) == 0
    assert most_in_common({}, {}) == ((), [])


def test_a_step_is_checked_only_for_functions_that_demand_it() -> None:
    """Steps computed from it do not become common to others either."""
    recorder = Recorder()
    x = recorder.leaf("x", COORDINATE)
    pivot = recorder.sin(x)
    behind = recorder.cos(pivot * 2)
    body = steps_of(behind)
    bodies = {"dividing": [*body, *steps_of(1 / pivot)[1:]], "plain": body, "other": body}
    checks: dict[str, dict[Any, str]] = {"dividing": {pivot: "it vanishes"}, "plain": {}, "other": {}}
    assert most_in_common({name: bodies[name] for name in ("plain", "other")}, checks) == (("plain", "other"), body)
    names, _ = most_in_common({name: bodies[name] for name in ("dividing", "plain")}, checks)
    assert len(names) == 1
    assert most_in_common(bodies, dict.fromkeys(bodies, checks["dividing"]))[0] == ("dividing", "plain", "other")


def test_places_of_what_is_there_before_are_used_again_once_it_has_been_read() -> None:
    """Run the stretches by themselves: every value is there when it is read; what is read later stays."""
    recorder = Recorder()
    x = recorder.leaf("x", COORDINATE)
    first = [recorder.sin(x)]
    for _ in range(29):
        first.append(recorder.sin(first[-1] + x))
    begun = steps_of(*first)
    kept, last = first[::5], first[-1]
    node, later = last, []
    for other in first[:30:5]:
        node = recorder.cos(node * other)
        later.append(node)
    arrays = Tape.of(recorder, y=[node]).arrays
    stretches, slots, count = divide(arrays, begun, (), 10, later={*kept, last})
    held: dict[int, Any] = {}

    def run(stretches: Any, slots: Any) -> None:
        for stretch, handed_on in stretches:
            own: set[Any] = set()
            for step in stretch:
                for core in map(unsigned, step.args):
                    assert core.op == "leaf" or core in own or held[slots[core]] is core
                own.add(step)
            held.update({slots[n]: n for n in handed_on})

    run(stretches, slots)
    assert all(held[slots[n]] is n for n in (*kept, last))
    before = {n: slots[n] for n in (*kept, last)}
    own = [n for n in steps_of(node) if n not in set(begun)]
    more, places, size = divide(arrays, own, [node], 3, before, count)
    run(more, places)
    assert size == count and len({*places.values()}) <= count < len(places) + len(begun)
    assert all(places[n] == slots[n] for n in before if n in places)


@needs_c
def test_a_net_in_common_functions_gives_what_numpy_gives(short: None) -> None:
    """Accelerations and corrections at a state off the constraints; a state in each lane rounds as one state does."""
    equations = net(3, 3).augmented()
    made = emit(equations, "c", FUNCTIONS, standalone=False)
    text = next(iter(made.files.values()))
    assert [f.name for f in made.program.common][:1] == ["common_1"] and made.program.common[0].count > 100
    ways = [f.regular for f in made.program.functions if f.regular is not None]
    assert len(ways) == 3 and all(way.calls[0] == made.program.common[0] for way in ways)
    for k in range(1, 1 + len(made.program.common[0].parts)):
        assert text.count(f"common_1_part_{k}(") == 2 + text.count(f"int net_3_3_common_1_part_{k}(") - 1
    ours, plain = (equations.compile(backend=backend) for backend in ("c", "numpy"))
    q, u = moving(ours)
    rng = np.random.default_rng(4)
    x = np.concatenate([q, u]) + 1e-3 * rng.normal(size=(7, len(q) + len(u)))
    for name in FUNCTIONS[:3]:
        for row in x:
            results = [module.evaluate(name, 0.0, row) for module in (ours, plain)]
            np.testing.assert_allclose(*results, rtol=1e-11, atol=1e-11 * np.abs(results[1]).max())
    assert np.array_equal(ours.rhs_batch(0.0, x), [ours.rhs(0.0, row) for row in x])


@needs_c
def test_where_a_pivot_vanishes_in_what_is_common_the_numeric_algorithm_takes_over(short: None) -> None:
    """The parallelogram folded flat, whose constraints lose rank there."""
    equations = sd.systems.get("n_four_bar", n=3).augmented()
    ours, plain = (equations.compile(backend=backend) for backend in ("c", "numpy"))
    assert emit(equations, "c", FUNCTIONS, standalone=False).program.common
    flat = np.zeros(len(ours.metadata.x))
    regular = ours.consistent()[0]
    for q in (flat[:len(regular)], regular):
        x = np.concatenate([q, flat[len(regular):]])
        np.testing.assert_allclose(ours.rhs(0.0, x), plain.rhs(0.0, x), rtol=1e-9, atol=1e-9)


def test_functions_that_begin_alike_may_go_on_alike(short: None) -> None:
    """Multipliers and accelerations have more in common than corrections have with them."""
    equations = net(3, 3).augmented()
    program = emit(equations, "c", (*FUNCTIONS, "lam"), standalone=False).program
    calls = {way.name: [f.name for f in way.calls] for f in program.functions for way in (f.regular,) if way is not None}
    first, second = calls["rhs_regular"]
    assert calls["lam_regular"] == [first, second]
    assert calls["position_correction_regular"] == calls["velocity_correction_regular"] == [first]
    ways = [way for f in program.functions for way in (f.regular or f,)]
    alone = [emit(equations, "c", [name], standalone=False, integrator=False).program.functions[0] for name in FUNCTIONS[:2]]
    assert [way.count for way in ways[:2]] == [(f.regular or f).count for f in alone]


def test_short_functions_have_nothing_in_common() -> None:
    for name in ("four_bar", "double_wishbone"):
        made = emit(sd.systems.get(name).augmented(), "c", FUNCTIONS, standalone=False)
        assert made.program.common == () and all(f.calls == () for f in made.program.functions)
