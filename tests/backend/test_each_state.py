"""Arrays of states in NumPy: each state gets what it gets alone, in the way that C chooses for it, whatever the others are."""

from __future__ import annotations

import dataclasses
import functools
import sys
import warnings
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pytest

import symdyn as sd
from symdyn.errors import EvaluationError, EvaluationWarning
from symdyn.pipeline import emit
from symdyn.runtime.building.compiler import find_compiler
from symdyn.runtime.building.library import PythonLibrary
from tests.helpers import swept
from tests.user_functions import BOUNDED

needs_c = pytest.mark.skipif(find_compiler() is None, reason="no C compiler here")
FUNCTIONS = ("rhs", "lam", "reactions", "position_correction", "velocity_correction")
# Positions at which constraints depend on others: all of them, or those of one loop of two.
RIGHT = np.pi / 2
LOST = {"four_bar": [[0.0, 0.0, 0.0]], "slider_crank": [[RIGHT, -2 * RIGHT]],
        "n_four_bar": [[RIGHT, RIGHT, RIGHT, -RIGHT, -RIGHT], [0.0, -RIGHT, -RIGHT, RIGHT, RIGHT],
                       [-RIGHT, -RIGHT, RIGHT, RIGHT, 0.0]],
        "pendulum_absolute": [[0.0, 0.0]], "bricard": [[0.0, 0.0, -RIGHT, 0.0, 2 * RIGHT], [0.0, -RIGHT, 0.0, 0.0, -RIGHT]]}
DISTANCES = (0.0, 1e-12, 1e-9, 1e-6, 1e-4, 1e-3, 1e-2, 1e-1)
MARK = 1e77


@functools.cache
def equations(name: str) -> Any:
    return sd.systems.get(name).augmented()


def loaded(equations: Any, functions: Sequence[str]) -> Any:
    """The generated module."""
    made = emit(equations, "numpy", functions, standalone=False)
    return PythonLibrary.from_source(next(iter(made.files.values())), equations.name).module


@functools.cache
def written(name: str) -> Any:
    return loaded(equations(name), FUNCTIONS)


def marked(equations: Any, **sizes: int) -> Any:
    """The same equations, with functions of these sizes that give MARK where they are done in the other way."""
    constant = {name: functools.partial(np.full, size, MARK, dtype=object) for name, size in sizes.items()}
    others = equations.singular_fallback
    others = dataclasses.replace(others, quantities={**others.quantities, **constant}, _recorded={}, _printed={})
    return dataclasses.replace(equations, singular_fallback=others)


def mixed(name: str) -> np.ndarray:
    """Ordinary states, and in between those at lost rank and at distances from it, (40, n_x)."""
    rng = np.random.default_rng(8)
    sizes = written(name).METADATA["sizes"]
    x = rng.uniform(-1, 1, (40, sizes["x"]))
    for k, distance in enumerate(DISTANCES):
        for place, q in enumerate(LOST[name]):
            x[2 + 4 * k + place, :sizes["q"]] = q + distance * rng.uniform(-1, 1, sizes["q"])
    return x


# -- of the catalogue


@pytest.mark.parametrize("function", FUNCTIONS)
@pytest.mark.parametrize("name", LOST)
def test_every_state_gets_what_it_gets_alone(name: str, function: str) -> None:
    """To the last bit, next to one that is no number, too: for the same numbers NumPy gives the same bits in any array."""
    module, x = written(name), mixed(name)
    x[21, 0] = np.nan
    good = np.delete(np.arange(len(x)), 21)
    with np.errstate(all="ignore"):
        many = module.evaluate(function, 0.0, x)
        alone = np.concatenate([module.evaluate(function, 0.0, row[None]) for row in x])
        square = module.evaluate(function, np.zeros((5, 1)), x.reshape(5, 8, -1))
    assert np.isfinite(many[good]).all() and not np.isfinite(many[21]).all()
    np.testing.assert_array_equal(many, alone)
    np.testing.assert_array_equal(square.reshape(many.shape), many)
    np.testing.assert_array_equal(module.evaluate(function, 0.0, x[good]), many[good])
    for k in good:  # on plain floats, with the sines of another library
        assert np.abs(module.evaluate(function, 0.0, x[k]) - many[k]).max() <= 1e-8 * np.abs(many[k]).max()


@needs_c
@pytest.mark.parametrize("name", swept(LOST, "n_four_bar", "pendulum_absolute", "bricard"))
def test_the_way_is_the_one_that_c_takes(name: str) -> None:
    """The other way gives MARK instead of its numbers."""
    x = mixed(name)
    x = np.concatenate([x, np.random.default_rng(9).uniform(-3, 3, (100, x.shape[1]))])
    lost = [2 + 4 * k + place for k in range(4) for place in range(len(LOST[name]))]  # no further than 1e-6
    shapes = written(name).METADATA["shapes"]
    other = marked(equations(name), **{f: int(np.prod(shapes[f])) for f in ("rhs", "lam")})
    numpy, c = (other.compile(backend=backend) for backend in ("numpy", "c"))
    for function in ("rhs", "lam"):
        found, wanted = numpy.evaluate(function, 0.0, x), c.evaluate(function, 0.0, x)
        way = np.all(found == MARK, axis=1)
        np.testing.assert_array_equal(way, np.all(wanted == MARK, axis=1))
        np.testing.assert_array_equal(way, [np.all(numpy.evaluate(function, 0.0, row) == MARK) for row in x])
        assert way[lost].all() and not way.all()
        np.testing.assert_array_equal(found[~way], written(name).evaluate(function, 0.0, x)[~way])
        if function == "rhs":  # terms of multipliers may cancel
            assert (np.abs(found - wanted).max(axis=1) <= 1e-11 * np.abs(wanted).max(axis=1)).all()


# -- states that fail


def wheels(pushed: bool = False) -> sd.System:
    """Three wheels: at q = t and r = 0 the first constraint holds nothing, at q = -1 and p = 0 the second, then nothing holds p,
    as long as its wheel has no inertia. pushed: by a function of q that has no value from 0.5 on."""
    q, r, p = sd.coordinates("q r p")
    inertia = sd.parameters("I")
    first, second = sd.inputs("F G")
    s = sd.System("wheels", planar=True)
    for name, x, size in (("a", q, 1), ("b", r, 2), ("c", p, inertia)):
        s.add_joint(sd.Revolute(name, s.ground, s.add_body(f"wheel_{name}", mass=1, inertia=size), x))
    s.add_joint_force("a", first * sd.t + (BOUNDED(q) if pushed else 0))
    s.add_joint_force("b", second)
    s.add_constraint((q - sd.t) * r, name="either")
    s.add_constraint(p * (1 + q), name="stop")
    s.defaults = {inertia: 0.0}
    return s


@functools.cache
def of_wheels(backend: str, pushed: bool = False) -> Any:
    return wheels(pushed).augmented().compile(backend=backend)


@functools.cache
def written_wheels() -> Any:
    return loaded(wheels().augmented(), ("rhs", "lam", "reactions"))


INPUTS = [0.7, -0.4]
FAILS = 2, 7
WHY = "a speed is held neither by mass nor by a constraint"


def turning() -> np.ndarray:
    """States of the wheels at t = 0: the first constraint holds nothing in 3 and 6, nothing holds p in FAILS."""
    x = np.random.default_rng(3).uniform(0.1, 0.4, (9, 6))
    x[[3, 6], :2] = 0.0
    x[list(FAILS), 0], x[list(FAILS), 2] = -1.0, 0.0
    return x


def test_the_error_reports_which_states_fail() -> None:
    module, x = written_wheels(), turning()
    for function in ("rhs", "lam", "reactions"):
        with pytest.raises(module.SingularError, match=WHY) as caught:
            module.evaluate(function, 0.0, x, None, INPUTS)
        assert np.flatnonzero(caught.value.states).tolist() == list(FAILS)
        with pytest.raises(module.SingularError, match=WHY) as caught:
            module.evaluate(function, [[0.0], [1.0], [0.0]], x.reshape(3, 3, 6), None, INPUTS)
        assert caught.value.states.shape == (3, 3) and np.flatnonzero(caught.value.states).tolist() == list(FAILS)
        assert module.METADATA["reasons"][caught.value.code - 1] == WHY
        good = np.delete(x, FAILS, 0)
        alone = [module.evaluate(function, 0.0, row[None], None, INPUTS)[0] for row in good]
        np.testing.assert_array_equal(module.evaluate(function, 0.0, good, None, INPUTS), alone)
        with pytest.raises(module.SingularError, match=WHY) as caught:
            module.evaluate(function, 0.0, x[FAILS[0]], None, INPUTS)
        assert np.ndim(caught.value.states) == 0 and caught.value.states


@pytest.mark.parametrize("bad", [{}, {(1, 3): np.inf}, {(5, 3): np.nan}])
def test_modules_report_the_first_row_that_fails(bad: Mapping[tuple[int, int], float]) -> None:
    """And why, as with C, whatever is wrong with the others."""
    x, told = turning(), []
    for place, value in bad.items():
        x[place] = value
    first = 1 if (1, 3) in bad else FAILS[0]
    for backend in ("numpy", *(["c"] if find_compiler() else [])):
        with pytest.raises(EvaluationError, match=rf"rhs cannot be evaluated: .* \(row {first} of 9\)$") as caught:
            of_wheels(backend).evaluate("rhs", 0.0, x, None, INPUTS)
        told.append(str(caught.value))
    assert len(set(told)) == 1 and (WHY in told[0]) == (first != 1)


@pytest.mark.parametrize("pushed", [False, True])
def test_rows_that_fail_leave_the_others(pushed: bool) -> None:
    x = turning()
    x[4, 3] = np.nan
    x[8, 0] = 0.6 if pushed else x[8, 0]
    found, told = [], []
    for backend in ("numpy", *(["c"] if find_compiler() else [])):
        with pytest.warns(EvaluationWarning, match=rf"in {3 + pushed} of 9 rows.* row 2: {WHY}; row 4: ") as warned:
            found.append(of_wheels(backend, pushed).rhs_batch(0.0, x, None, INPUTS))
        told.append(str(warned[0].message))
    assert ("row 8: the table of bounded ends at 0.5" in told[0]) == pushed
    good = np.delete(np.arange(9), [*FAILS, 4, *([8] if pushed else [])])
    assert np.flatnonzero(np.isfinite(found[0]).all(axis=1)).tolist() == good.tolist() and np.isnan(found[0][FAILS, :]).all()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        np.testing.assert_array_equal(found[0][good], of_wheels("numpy", pushed).rhs_batch(0.0, x[good], None, INPUTS))
    np.testing.assert_allclose(found[-1], found[0], rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("backend", ["numpy", pytest.param("c", marks=needs_c)])
def test_parameters_decide_for_single_rows(backend: str) -> None:
    """With inertia the wheel moves where nothing holds it."""
    x, inertia = turning(), np.ones(9)
    inertia[[0, FAILS[0]]] = 0.0
    with pytest.warns(EvaluationWarning, match=f"in 1 of 9 rows.* row 2: {WHY}"):
        found = of_wheels(backend).rhs_batch(0.0, x, {"I": inertia}, INPUTS)
    assert np.isnan(found[FAILS[0]]).all()
    for k in np.delete(np.arange(9), FAILS[0]):
        one = of_wheels(backend).rhs_batch(0.0, x[k:k + 1], {"I": inertia[k:k + 1]}, INPUTS)
        np.testing.assert_array_equal(found[k], one[0])


@pytest.mark.every_value
@pytest.mark.parametrize("backend", ["numpy", pytest.param("c", marks=needs_c)])
@pytest.mark.parametrize("ratios", [(3, 7), (0.3, 0.7), (1.1, 1.3)])
def test_what_only_rounding_holds_is_held_by_nothing(backend: str, ratios: tuple[float, float]) -> None:
    """Two wheels without inertia and one constraint: elimination leaves a pivot of some roundings, which nothing divides by."""
    p, r = sd.coordinates("p r")
    inertia, force = sd.parameters("I"), sd.inputs("F")
    s = sd.System("free", planar=True)
    for name, x in (("a", p), ("b", r)):
        s.add_joint(sd.Revolute(name, s.ground, s.add_body(f"wheel_{name}", mass=1, inertia=inertia), x))
    s.add_joint_force("a", force)
    s.add_constraint(ratios[0] * p + ratios[1] * r, name="gear")
    s.defaults = {inertia: 1.0}
    free = s.augmented().compile(backend=backend)
    with pytest.raises(EvaluationError, match=WHY):
        free.rhs(0.0, np.zeros(4), {"I": 0.0}, [1.0])
    with pytest.warns(EvaluationWarning, match=f"in 2 of 4 rows.* row 1: {WHY}; row 3: {WHY}"):
        found = free.rhs_batch(0.0, np.zeros((4, 4)), {"I": [1.0, 0.0, 2.0, 0.0]}, [1.0])
    share = ratios[1] * np.array([ratios[1], -ratios[0]]) / (ratios[0] ** 2 + ratios[1] ** 2)
    np.testing.assert_allclose(found[[0, 2], 2:], [share, share / 2], rtol=1e-13)
    assert np.isnan(found[[1, 3]]).all()


# -- what has a value for each state, and what has one for all

SHAPES = [(), (3,), (2, 1), (2, 3)]


@pytest.mark.parametrize(("of_t", "of_x", "of_inputs", "of_ud"), [
    *[(t, x, (), ()) for t in SHAPES for x in SHAPES if t or x], *[((), x, inputs, ()) for x in SHAPES for inputs in SHAPES[1:]],
    ((2, 1), (3,), (2, 3), (3,)), ((3,), (2, 1), (), (2, 1)), ((), (), (), (2, 3)), ((1,), (1, 1), (2, 3), ())])
def test_arguments_hold_for_one_state_or_for_all(of_t: tuple[int, ...], of_x: tuple[int, ...], of_inputs: tuple[int, ...],
                                                 of_ud: tuple[int, ...]) -> None:
    """Some of the states, sometimes all, are where the first constraint holds nothing, by their time or by their coordinates."""
    module, rng = written_wheels(), np.random.default_rng(1)
    t, x = np.zeros(of_t), rng.uniform(0.1, 0.4, (*of_x, 6))
    x[..., :2] = 0.0  # q = t, r = 0
    if t.size > 1:
        t.reshape(-1)[-1] = 0.5
    if len(x.reshape(-1, 6)) > 1:
        x.reshape(-1, 6)[0, 1] = 0.3
    inputs, ud = rng.uniform(-1, 1, (*of_inputs, 2)), rng.uniform(-1, 1, (*of_ud, 3))
    shape = np.broadcast_shapes(of_t, of_x, of_inputs, of_ud)
    whole = [np.broadcast_to(a, (*shape, *np.shape(a)[n:])) for a, n in
             zip((t, x, inputs, ud), map(len, (of_t, of_x, of_inputs, of_ud)), strict=True)]
    for function in ("rhs", "lam", "reactions"):
        found = module.evaluate(function, t, x, None, inputs, ud)
        assert found.shape == (*shape, *module.METADATA["shapes"][function])
        for k in np.ndindex(*shape):
            now, here, free, given = (a[k] for a in whole)
            np.testing.assert_array_equal(found[k], module.evaluate(function, [now], here, None, free, given)[0])


# -- algorithms and functions that are no formulas


def afloat(kind: str) -> sd.System:
    """A body that goes up and down, held by a line above a seabed, by the water, or by a function that ends at 0.5."""
    z, push = sd.coordinates("z"), sd.inputs("push")
    s = sd.System(kind, gravity=[0, 0, -9.81])
    body = s.add_body("body", mass=6000.0)
    s.add_joint(sd.Prismatic("heave", s.ground, body, z, axis=[0, 0, 1]))
    s.add_joint_force("heave", push + (BOUNDED(z) if kind == "spring" else 0))
    if kind == "line":
        s.add_load(sd.MooringLine(body, fairlead=[0, 0, 0], anchor=[400, 0, -100], length=450, weight=1000, stiffness=1e9,
                                  friction=0.5, name="line"))
    if kind == "box":
        s.add_load(sd.Buoyancy(body, [(2, 2, 2)], 1000, name="box"))
    return s


@pytest.mark.parametrize(("kind", "bad", "why"), [
    ("line", {1: -150.0, 3: np.nan, 4: -100.0}, "not above the seabed"),
    ("box", {2: np.nan}, "the pose of its body is no number"),
    ("spring", {0: 0.5, 5: np.nan, 2: 7.0}, "the table of bounded ends at 0.5")])
def test_what_is_called_fails_for_single_states(kind: str, bad: Mapping[int, float], why: str) -> None:
    equations = afloat(kind).embedding()
    module, x, inputs = loaded(equations, ("rhs",)), np.zeros((6, 2)), np.arange(6.0)[:, None]
    x[:, 0] = np.linspace(-0.4, 0.4, 6)
    x[list(bad), 0] = list(bad.values())
    for shape in ((6,), (2, 3), (1, 6)):
        with pytest.raises(module.SingularError, match=why) as caught:
            module.evaluate("rhs", 0.0, x.reshape(*shape, 2), None, inputs.reshape(*shape, 1))
        assert np.flatnonzero(np.broadcast_to(caught.value.states, shape)).tolist() == sorted(bad)
    good = np.delete(np.arange(6), list(bad))
    wanted = [module.evaluate("rhs", [0.0], x[k], None, inputs[k])[0] for k in good]
    np.testing.assert_array_equal(module.evaluate("rhs", 0.0, x[good], None, inputs[good]), wanted)
    with pytest.warns(EvaluationWarning, match=f"in {len(bad)} of 6 rows.* row {min(bad)}: .*{why}"):
        found = equations.compile(backend="numpy").rhs_batch(0.0, x, None, inputs)
    np.testing.assert_array_equal(found[good], wanted)
    assert np.isnan(found[list(bad)]).all()


def test_an_algorithm_that_divides_by_zero_fails_there() -> None:
    """Alone, and at one of many states."""
    module = loaded(afloat("box").embedding(), ("rhs",))
    assert module.symdyn_each(lambda v: [1 / v[0], v[1]], 2, [4.0, 3.0]) == ([0.25, 3.0], False)
    assert module.symdyn_each(lambda v: [1 / v[0]], 1, [0.0])[1]
    first, second = np.array([[1.0], [0.0]]), np.array([1.0, 2.0, 3.0])
    found, failed = module.symdyn_each(lambda v: [1 / v[0], v[1]], 2, [first, second])
    assert failed.tolist() == [[False] * 3, [True] * 3]
    np.testing.assert_array_equal(found, [[[1] * 3, [np.nan] * 3], [[1, 2, 3], [np.nan] * 3]])
    found, failed = module.symdyn_each(lambda v: [1 / v[0], v[1]], 2, [np.array([[1.0], [2.0]]), second])
    np.testing.assert_array_equal(found, [[[1, 1, 1], [0.5, 0.5, 0.5]], [[1, 2, 3], [1, 2, 3]]])
    assert not failed.any()


def test_a_function_of_the_user_that_stops_for_all_is_tried_for_each() -> None:
    """Where it raises an error of its own, nothing shows at which states."""
    def moody(v: np.ndarray) -> np.ndarray:
        if (v > 0.5).any():
            raise ValueError("too far")
        return v

    q = sd.coordinates("q")
    s = sd.System("moody", planar=True)
    s.add_joint(sd.Prismatic("rail", s.ground, s.add_body("body", mass=1), q, axis=[1, 0]))
    s.add_joint_force("rail", sd.External("moody", ["v"], python=moody)(q))
    module = s.embedding().compile(backend="numpy")
    with pytest.warns(EvaluationWarning, match="in 1 of 3 rows.* row 1: the function moody.v. raised ValueError: too far"):
        found = module.rhs_batch(0.0, [[0.25, 1.0], [0.75, 1.0], [-0.5, 2.0]])
    np.testing.assert_array_equal(found, [[1.0, 0.25], [np.nan, np.nan], [2.0, -0.5]])
    with pytest.raises(EvaluationError, match=r"moody: rhs cannot be evaluated: the function moody.v. raised ValueError: too far"
                                              ", in its line 3"):
        module.evaluate("rhs", 0.0, [[0.25, 1.0], [0.75, 1.0]])


# -- one state


@pytest.mark.parametrize("name", ["four_bar", "slider_crank", "n_four_bar"])
def test_one_state_needs_no_array(name: str) -> None:
    """In its usual way, no function of NumPy is called, and none that chooses the way."""
    module, called = written(name), set()
    x, p = mixed(name)[0].tolist(), tuple(module.METADATA["defaults"])
    n_q = module.METADATA["sizes"]["q"]
    arguments = 0.0, x[:n_q], x[n_q:], [], [], [], p, module._constants(p)

    def note(frame: Any, event: str, function: Any) -> None:
        called.add(function.__module__ if event == "c_call" else frame.f_code.co_name if event == "call" else None)

    sys.setprofile(note)
    try:
        for function in FUNCTIONS:
            module._ONE[function](*arguments)
    finally:
        sys.setprofile(None)
    ways = {f"{function}_regular" for function in FUNCTIONS}
    assert called - {None, "math", "builtins", "sys"} == {*FUNCTIONS, *ways, "positive"}
