"""Sensitivities of motions in SIMD lanes: the bits of single motions, differences, closed forms, and what is warned of."""

from __future__ import annotations

import functools
import re
import warnings
from collections.abc import Callable
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sympy as sp

import symdyn as sd
from symdyn.ensembles import chunk, plan
from symdyn.ensembles.measures import take_measures
from symdyn.errors import ArgumentError, SimulationWarning
from symdyn.runtime.batches import motions
from symdyn.runtime.batches.motions import unit_of
from symdyn.runtime.module import Module
from tests.derivatives.test_sensitivities import common, free_body, three_cranks
from tests.derivatives.test_sensitivities_at_events import jumping
from tests.helpers import swept

pytestmark = pytest.mark.native  # tcc has no vectors
N = 19  # more than two vectors of eight lanes, and some left over


def alone(module: Any, k: int, t: Any, groups: dict[str, dict[str, Any]], **options: Any) -> Any:
    """Motion k of many by itself."""
    own = {group: {name: np.broadcast_to(v, N)[k] for name, v in values.items()} for group, values in groups.items()}
    return module.simulate(np.asarray(t, dtype=float), **own, **options)


def check(module: Any, t: Any, groups: dict[str, dict[str, Any]], **options: Any) -> Any:
    """Many motions in lanes, which have the bits and the steps of single ones."""
    many = module.simulate_batch(**groups, t=t, **options)
    assert many.note == "" and many.width == module.batch_width > 1 and len(many) == N
    for k in range(N):
        one = alone(module, k, t, groups, **options)
        reached = dict(zip(one.t.tolist(), zip(one.x, one.sensitivity.matrix, strict=True), strict=True))
        assert many.success[k] == one.success
        assert (many.n_steps[k], many.n_rejected[k]) == (one.n_steps, one.n_rejected)
        for time, x, matrix in zip(many.t.tolist(), many.x[k], many.sensitivity.matrix[k], strict=True):
            if time in reached:
                assert np.array_equal(x, reached[time][0]) and np.array_equal(matrix, reached[time][1])
            else:
                assert np.isnan(x).all() and np.isnan(matrix).all()
    return many


@pytest.fixture(scope="module")
def arm(compiled: Callable[..., Any]) -> Any:
    return compiled("double_pendulum", "c")


GROUPS: dict[str, dict[str, Any]] = {"q": {"q1": np.linspace(-1, 1, N), "q2": 0.3},
                                     "params": {"l1": np.linspace(0.5, 1.5, N), "m2": np.linspace(2, 1, N)}}


@pytest.mark.parametrize("options", [{}, {"method": "bs54"},
                                     *swept([{"sensitivity_control": False}, {"max_step": 0.05, "atol": 1e-6}])])
def test_the_bits_of_one(arm: Any, options: dict[str, Any]) -> None:
    by = ["m2", "q1(0)", "g"]
    many = check(arm, np.linspace(0, 1, 5), GROUPS, sensitivities=by, **options)
    assert many.sensitivity.names == tuple(by)
    check(arm, [1.0, 0.0], GROUPS, sensitivities=by, **options)


def test_columns_that_share_code(compiled: Callable[..., Any]) -> None:
    """Long derivatives along many columns are one piece of code: it runs on lanes of motions as on lanes of columns."""
    module = compiled("n_link_pendulum", "c", n=5)
    by = [*module.metadata.parameters, *[f"{x}(0)" for x in module.metadata.x]][:15]
    columns = tuple("" if name.endswith("(0)") else name for name in by)
    assert "symdyn_lanes_rhs_along_1" in module.library(unit_of("dop853", False, columns)).source
    assert "symdyn_lanes_rhs_along_1" not in module.library(unit_of("dop853", False, columns[:1])).source
    q = {x: np.linspace(-1, 1, N) * (-1) ** k for k, x in enumerate(module.metadata.q)}
    check(module, (0, 0.5), {"q": q, "params": {"m1": np.linspace(1, 2, N)}}, sensitivities=by)


@pytest.mark.parametrize("options", [{}, *swept([{"method": "bs54"}])])
def test_motions_on_constraints(options: dict[str, Any]) -> None:
    module = sd.systems.four_bar().augmented().compile()
    groups: dict[str, dict[str, Any]] = {"params": {"lc1": np.linspace(0.4, 0.6, N)}}
    for times in (np.linspace(0, 0.5, 3), (0, 0.5)):
        check(module, times, groups, sensitivities=["l1", "lc1", "q1(0)"], **options)


def test_euler_parameters() -> None:
    module = free_body()
    u = dict(zip(module.metadata.u, [0, 0, 0, np.linspace(0.5, 1.5, N), 2.0, 0.5], strict=True))
    many = check(module, np.linspace(0, 1, 3), {"u": u}, sensitivities=["a", "p1(0)"], rtol=1e-9)
    places = [module.metadata.x.index(f"p{k}") for k in range(4)]
    assert np.abs(np.einsum("kti,ktij->ktj", many.x[..., places], many.sensitivity.matrix[:, :, places])).max() < 1e-14


def test_differences(arm: Any) -> None:
    h, by = 1e-6, ["l1", "m2", "q1(0)"]
    many = arm.simulate_batch(**GROUPS, t=(0, 1), rtol=1e-12, sensitivities=by)
    for name in by:
        sides = []
        for way in (-h, h):
            groups = {group: dict(values) for group, values in GROUPS.items()}
            group = groups["q" if name.endswith("(0)") else "params"]
            group[name.removesuffix("(0)")] = group[name.removesuffix("(0)")] + way
            sides.append(arm.simulate_batch(**groups, t=(0, 1), rtol=1e-12).x)
        difference = (sides[1] - sides[0]) / (2 * h)
        np.testing.assert_allclose(many.sensitivity[name], difference, rtol=1e-5, atol=1e-7 * np.abs(difference).max())


@functools.cache
def falling(stop: bool = False, reset: bool = False, drag: bool = False) -> Any:
    """A body that falls from a height, driven by an input; it may stop a motion, or bounce, at the floor."""
    y, m, g, F = sd.coordinates("y"), *sd.parameters("m g", positive=True), sd.inputs("F")
    system = sd.System("falling", gravity=[0, -g])
    body = system.add_body("body", mass=m)
    system.add_joint(sd.Prismatic("fall", system.ground, body, y, axis=[0, 1]))
    system.add_joint_force("fall", F - (sp.Abs(y) if drag else 0))
    if stop or reset:
        system.add_event("floor", y, direction=-1, stop=stop, reset={y.dot: -y.dot} if reset else {})
    system.defaults, system.initial = {m: 2, g: 9.81}, {y: 1}
    return system.embedding().compile(backend="c")


def test_closed_form_with_inputs_and_stops() -> None:
    """y = h + (F/m - g) t^2/2 until the floor; the sensitivities at the end are those at its time."""
    module, times = falling(stop=True), np.linspace(0, 1, 5)
    m, F, h = np.linspace(1, 3, N), np.linspace(-1, 1.1, N), np.linspace(0.5, 20, N)
    many = check(module, times, {"q": {"y": h}, "params": {"m": m}, "inputs": {"F": F}}, sensitivities=["m", "g", "F", "y(0)"],
                 rtol=1e-10)
    landed = np.sqrt(2 * h / (9.81 - F / m)) < times[:, None]
    for k, t in enumerate(times):
        there = ~landed[k]
        assert np.isnan(many.x[landed[k], k]).all()
        exact = np.array([-F / m**2 * t**2 / 2, np.full(N, -t**2 / 2), t**2 / 2 / m, np.ones(N)]).T
        np.testing.assert_allclose(many.sensitivity.of("y")[there, k], exact[there], rtol=1e-9, atol=1e-12)
    ends = module.simulate_batch({"y": h}, params={"m": m}, inputs={"F": F}, t=(0, 1), sensitivities=["g"], rtol=1e-10)
    t = np.minimum(1.0, np.sqrt(2 * h / (9.81 - F / m)))
    np.testing.assert_allclose(ends.sensitivity["g"][:, 0, 0], -t**2 / 2, rtol=1e-9)


def test_tables_as_inputs() -> None:
    module, table = falling(), {"F": (np.array([0.0, 0.4, 1.0]), np.array([0.0, 2.0, -1.0]))}
    heights = np.linspace(1, 2, N)
    many = module.simulate_batch({"y": heights}, t=np.linspace(0, 1, 4), inputs=table, sensitivities=["m"])
    assert many.note == ""
    for k in (0, N - 1):
        one = module.simulate(np.linspace(0, 1, 4), {"y": heights[k]}, inputs=table, sensitivities=["m"])
        assert np.array_equal(many.sensitivity.matrix[k], one.sensitivity.matrix)
    with pytest.raises(ArgumentError, match="falling: a sensitivity by the input F was asked for, which varies over time here; "
                       "only constant inputs have one"):
        module.simulate_batch({"y": heights}, t=(0, 1), inputs=table, sensitivities=["F"])


def test_starts_that_change_with_a_parameter(arm: Any) -> None:
    """A mapping gives the derivatives of the start; they count in motions in lanes and in those one by one."""
    along = {"m2": np.array([0.5, 0.0, -1.0, 2.0]), "q1(0)": np.array([1.0, 1.0, 0.0, 0.0])}
    many = check(arm, np.linspace(0, 1, 3), GROUPS, sensitivities=along)
    assert (many.sensitivity["m2"][:, 0] == along["m2"]).all()
    ones = arm.simulate_batch(**GROUPS, t=np.linspace(0, 1, 3), sensitivities=along, max_steps=10_000)
    assert "max_steps" in ones.note and np.array_equal(ones.sensitivity.matrix, many.sensitivity.matrix)
    with pytest.raises(ArgumentError, match=r"double_pendulum: sensitivities give .* as the derivative of the start by m2; pass"):
        arm.simulate_batch(**GROUPS, t=(0, 1), sensitivities={"m2": [1.0]})


def test_what_has_no_effect_is_warned_of_as_in_one() -> None:
    """The mass does not matter without a force, though it is in the equations; nor does a force's size where it is zero."""
    module = falling()
    start = {"y": np.linspace(1, 2, N)}
    with pytest.warns(SimulationWarning) as found:
        many = module.simulate_batch(start, t=(0, 1), sensitivities=["g", "m"])
    text = "0: falling: nothing in this motion depends on m: the sensitivities are zero"
    assert any(f"of {N} motions {text}" in str(w.message) and "and 16 more" in str(w.message) for w in found)
    assert many.note == "" and not many.sensitivity["m"].any()
    with pytest.warns(SimulationWarning, match=re.escape(text[3:])):
        module.simulate((0, 1), {"y": 1.0}, sensitivities=["g", "m"])


def test_parameters_that_cancel_are_warned_of_as_in_one() -> None:
    """A factor of all masses leaves rounding in its column; a force that acts for a while only has an effect."""
    module, q = common(), {"a": np.linspace(2.5, 2.9, 3), "b": 0.4}
    with pytest.warns(SimulationWarning, match="of 3 motions 0: common: nothing in this motion depends on factor, which "
                      "cancels") as found:
        many = module.simulate_batch(q, t=(0, 3), sensitivities=["factor", "push", "a(0)"])
    assert len(found) == 1 and many.note.startswith("3 of 3 motions one by one: in them a parameter may cancel")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert module.simulate_batch(q, t=(0, 1.25), sensitivities=["push", "a(0)"]).note == ""


def test_motions_that_stay_at_a_kink_are_warned_of_as_in_one() -> None:
    module = falling(drag=True)
    starts = {"y": np.array([1.0, 0.0, 0.5])}
    options: dict[str, Any] = {"t": np.linspace(0, 0.1, 3), "params": {"g": 0.0}, "sensitivities": ["y(0)"]}
    with pytest.warns(SimulationWarning, match="of 3 motions 1: falling: y stays at 0, where the equations have a kink"):
        many = module.simulate_batch(starts, **options)
    assert many.note.startswith("1 of 3 motions one by one")


def test_motions_that_fail_are_reported_as_one(arm: Any) -> None:
    starts = {"q1": [0.1, np.nan, 0.2], "q2": 0.0}
    with pytest.warns(SimulationWarning, match="1 of 3 motions failed: 1: "):
        many = arm.simulate_batch(starts, t=(0, 1), sensitivities=["m2"])
    assert many.success.tolist() == [True, False, True] and np.isnan(many.sensitivity.matrix[1]).all()
    assert np.isfinite(many.sensitivity.matrix[[0, 2]]).all()


def test_parameters_that_constraints_hold_are_reported() -> None:
    """One crank of three cannot become longer alone; motions by another parameter go on in lanes."""
    module = three_cranks()
    with pytest.warns(SimulationWarning, match="2 of 2 motions failed: 0: .*no position fulfils them when l2 changes alone"):
        many = module.simulate_batch(params={"d": [1.0, 1.1]}, t=(0, 0.1), sensitivities=["l2", "d"])
    assert not many.success.any()


def test_what_runs_one_by_one(arm: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SimulationWarning)
        bounces = falling(reset=True).simulate_batch({"y": [1.0, 2.0]}, t=(0, 1), sensitivities=["g"])
        assert bounces.note == "one by one: with sensitivities, across events that reset states"
        without = falling(reset=True).simulate_batch({"y": [1.0, 2.0]}, t=(0, 1), sensitivities=["g"], events=False)
        jumps = jumping("edge").simulate_batch(params={"k": [1.0, 1.1]}, t=(0, 0.1), sensitivities=["k"])
    assert without.note == "" and jumps.note == "one by one: with sensitivities, of a right-hand side that may jump"
    monkeypatch.setattr(motions, "MOST_ENTRIES", 11)
    assert arm.simulate_batch(**GROUPS, t=(0, 0.1), sensitivities=["g"]).note == ""
    note = arm.simulate_batch(**GROUPS, t=(0, 0.1), sensitivities=["g", "m2"]).note
    assert note == "one by one: with 12 sensitivities and states each, whose columns fill lanes"


def test_what_does_not_fit(arm: Any) -> None:
    with pytest.raises(ArgumentError, match="double_pendulum: sensitivity_control is 'yes'; pass True or False"):
        arm.simulate_batch(**GROUPS, t=(0, 1), sensitivities=["g"], sensitivity_control="yes")
    with pytest.raises(ArgumentError) as found:
        arm.simulate_batch(**GROUPS, t=(0, 1), sensitivities=["gg", "q1", "m2", "m2"])
    for text in ("by 'gg' was asked for", "by q1 was asked for, which is a state", "sensitivities name m2 twice"):
        assert text in str(found.value)
    assert arm.simulate_batch(**GROUPS, t=(0, 0.1), sensitivities=[]).columns is None


OUTCOMES = ["end q1", "grad end q1", "grad q2_dot at 0.5", "grad mean q2", "grad rms q1", "grad max q2_dot", "grad start q1",
            "grad trace q1"]


def test_ensembles_in_lanes_have_the_bits_of_single_motions(arm: Any, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    samples = {"q1": np.linspace(-1, 1, N), "l1": np.linspace(0.5, 1.5, N)}
    samples["q1"][7] = np.nan
    times = np.linspace(0, 1, 5)
    one = sd.ensemble(arm, samples, times, OUTCOMES, chunk=9, sensitivities=["l1", "q1(0)", "m2"])
    monkeypatch.setattr(plan, "VECTORS_FROM", 1)
    monkeypatch.setattr(chunk, "NUMBERS", 800)  # five motions at a time
    called: list[int] = []
    simulate = Module.simulate
    monkeypatch.setattr(Module, "simulate", lambda self, *a, **k: called.append(1) or simulate(self, *a, **k))
    several = sd.ensemble(arm, samples, times, OUTCOMES, chunk=9, sensitivities=["l1", "q1(0)", "m2"], path=tmp_path / "here")
    assert len(called) == 1  # the sample that is tried first
    assert [f["index"] for f in several.failures()] == [f["index"] for f in one.failures()] == [7]
    for label in OUTCOMES:
        assert np.array_equal(one[label], several[label], equal_nan=True), label
    with ProcessPoolExecutor(1, get_context("spawn")) as processes:
        there = sd.ensemble(arm, samples, times, OUTCOMES, chunk=9, sensitivities=["l1", "q1(0)", "m2"], path=tmp_path / "there",
                            executor=processes)
    assert there.file.read_bytes() == several.file.read_bytes()


def test_ensembles_in_lanes_warn_as_those_of_single_motions(monkeypatch: pytest.MonkeyPatch) -> None:
    module, samples = falling(), {"y": np.linspace(1, 2, 6)}
    found = []
    for first in (2000, 1):
        monkeypatch.setattr(plan, "VECTORS_FROM", first)
        with pytest.warns(SimulationWarning, match="nothing in this motion depends on m: the sensitivities are zero"):
            found.append(sd.ensemble(module, samples, (0, 1), ["grad end y"], chunk=4, sensitivities=["g", "m"]))
    assert found[0].doubts == found[1].doubts and "6 of 6 members" in found[0].doubts
    assert np.array_equal(found[0]["grad end y"], found[1]["grad end y"])


def test_which_ensembles_are_in_lanes(arm: Any) -> None:
    measures = take_measures(["end q1", "grad end q1"], arm)
    assert chunk.vectors_serve(arm, False, {"sensitivities": ("m2",)}, measures)
    assert not chunk.vectors_serve(arm, False, {"sensitivities": ("m2",)}, take_measures(["grad end q1", "max energy"], arm))
    bouncing, of_y = falling(reset=True), take_measures(["grad end y"], falling(reset=True))
    assert not chunk.vectors_serve(bouncing, False, {"sensitivities": ("m",)}, of_y)
    assert chunk.vectors_serve(bouncing, False, {"sensitivities": ("m",), "events": False}, of_y)


def test_batches_keep_what_they_warned_of(arm: Any) -> None:
    module = falling()
    with pytest.warns(SimulationWarning):
        many = module.simulate_batch({"y": [1.0, 2.0]}, params={"m": [1.0, 2.0]}, inputs={"F": [0.0, 1.0]}, t=(0, 1),
                                     sensitivities=["m"])
    assert many.doubts == {0: ["falling: nothing in this motion depends on m: the sensitivities are zero"]}
