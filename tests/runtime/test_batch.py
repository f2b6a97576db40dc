"""Many states and many motions at once: the bits of one after the other, faults of single ones, arguments that do not fit."""

from __future__ import annotations

import functools
import os
import re
import signal
import threading
import warnings
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import symdyn as sd
from symdyn.errors import ArgumentError, EvaluationWarning, SimulationInterrupted, SimulationWarning, SymdynError
from symdyn.runtime.batches.arguments import take_rows
from tests.helpers import swept
from tests.user_functions import BOUNDED

pytestmark = pytest.mark.native  # tcc has no vectors
N = 11  # more than two vectors of four lanes, and some left over


@pytest.fixture(scope="module")
def fast(compiled: Callable[..., Any]) -> Any:
    return compiled("double_pendulum", "c")


@pytest.fixture(scope="module")
def four_bar() -> Any:
    return sd.systems.get("four_bar").augmented().compile(backend="c")


def starts(n: int = N, seed: int = 1) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    return rng.uniform(-1.5, 1.5, (n, 2)), rng.uniform(-1, 1, (n, 2))


def lengths(module: Any, n: int = N) -> dict[str, np.ndarray]:
    return {"l1": np.linspace(0.8, 1.2, n), "m2": np.linspace(2, 1, n)}


# -- right-hand sides


@pytest.mark.parametrize("layout", [np.ascontiguousarray, np.asfortranarray])
@pytest.mark.parametrize("n", [1, 3, 4, N])
def test_states_have_the_bits_of_one(fast: Any, layout: Callable[..., Any], n: int) -> None:
    x = layout(np.random.default_rng(2).normal(size=(n, 4)))
    xd = fast.rhs_batch(0.0, x)
    assert (xd == [fast.rhs(0.0, row) for row in x]).all()
    assert xd.shape == (n, 4) and (n == 1 or xd.flags.f_contiguous == x.flags.f_contiguous)


def test_parameters_that_vary(double: Any) -> None:
    x, p = np.random.default_rng(2).normal(size=(N, 4)), lengths(double)
    wanted = [double.rhs(0.0, row, {"l1": l1, "m2": m2}) for row, l1, m2 in zip(x, p["l1"], p["m2"])]
    found = double.rhs_batch(0.0, x, p)
    in_order = np.tile(double.parameters(), (N, 1))
    for name, values in p.items():
        in_order[:, double.metadata.parameters.index(name)] = values
    same = {"c": 0.0, "numpy": 1e-13}[double.backend]
    np.testing.assert_allclose(found, wanted, rtol=same, atol=same)
    assert (double.rhs_batch(0.0, x, in_order) == found).all()
    assert (double.rhs_batch(np.zeros(N), x[0], p)[3] == double.rhs_batch(0.0, x[:1], {k: v[3] for k, v in p.items()})[0]).all()


def test_inputs_and_times_that_vary(oscillator: Any) -> None:
    names = oscillator.metadata.inputs
    x = np.random.default_rng(6).normal(size=(N, oscillator.metadata.sizes.x))
    given, t = np.random.default_rng(7).normal(size=(N, len(names))), np.linspace(0, 2, N)
    wanted = oscillator.evaluate("rhs", t, x, None, given)
    np.testing.assert_allclose(oscillator.rhs_batch(t, x, None, given), wanted, rtol=1e-14, atol=1e-14)
    by_name = {name: given[:, k] for k, name in enumerate(names)}
    assert (oscillator.rhs_batch(t, x, None, by_name) == oscillator.rhs_batch(t, x, None, given)).all()


def test_a_bad_state_is_reported_and_the_others_are_computed(double: Any) -> None:
    x = np.random.default_rng(3).normal(size=(N, 4))
    good = double.rhs_batch(0.0, x)
    x[4, 1], x[9, 3] = np.nan, np.inf
    with pytest.warns(EvaluationWarning, match=r"cannot be evaluated in 2 of 11 rows, which are NaN: row 4: .*\(q2 given not "
                                               r"finite\); row 9: .*q2_dot given not finite"):
        found = double.rhs_batch(0.0, x)
    assert np.isnan(found[[4, 9]]).all()
    np.testing.assert_allclose(np.delete(found, [4, 9], 0), np.delete(good, [4, 9], 0), rtol=1e-14)


def test_a_bad_parameter_is_reported(double: Any) -> None:
    x, masses = np.zeros((20, 4)), np.ones(20)
    masses[1:12] = np.nan
    with pytest.warns(EvaluationWarning, match=r"in 11 of 20 rows.*row 1: .*; and 3 more"):
        found = double.rhs_batch(0.0, x, {"m1": masses})
    assert np.flatnonzero(np.isnan(found).any(axis=1)).tolist() == list(range(1, 12))


def test_constraints_and_their_algorithms(four_bar: Any) -> None:
    """Also where constraints depend on each other, which another way of the function computes, lane by lane."""
    rng = np.random.default_rng(8)
    n_q = four_bar.metadata.sizes.q
    x = rng.uniform(-1, 1, (N, four_bar.metadata.sizes.x))
    x[5, :n_q] = 0.0
    assert (four_bar.rhs_batch(0.0, x) == four_bar.evaluate("rhs", 0.0, x)).all()


@pytest.fixture(scope="module", params=["c", "numpy"])
def sled(request: pytest.FixtureRequest) -> Any:
    """A sled that is pushed by a function of its place; it has no value from 0.5 on, nor has that of its mass from 5 on."""
    x, m = sd.coordinates("x"), sd.parameters("m")
    system = sd.System("sled")
    joint = sd.Prismatic("j", system.ground, system.add_body("b", mass=m), x, axis=[1, 0, 0])
    system.add_joint(joint)
    system.add_joint_force(joint, BOUNDED(x) + BOUNDED(m / 10))
    system.defaults = {m: 1}
    return system.embedding().compile(backend=request.param)


def test_functions_of_the_user_fail_for_single_states(sled: Any) -> None:
    x, masses = np.zeros((N, 2)), np.full(N, 1.0)
    x[:, 0] = np.linspace(-1, 0.4, N)
    x[6, 0], masses[9] = 0.7, 6
    with pytest.warns(EvaluationWarning, match=r"in 2 of 11 rows.*row 6: the table of bounded ends at 0\.5; row 9: the table"):
        found = sled.rhs_batch(0.0, x, {"m": masses})
    good = [k for k in range(N) if k not in (6, 9)]
    assert np.isnan(found[[6, 9]]).all() and (found[good] == sled.evaluate("rhs", 0.0, x[good])).all()


def test_motions_end_where_a_function_of_the_user_does(sled: Any) -> None:
    """A parameter that has no constants, and a motion that leaves the table."""
    places, masses = [-2.0, 0.45, -2.0, -2.0, -2.0], [1.0, 1.0, 1.0, 6.0, 1.0]
    with pytest.warns(SimulationWarning, match="2 of 5 motions failed: 1: ") as told:
        many = sled.simulate_batch({"x": places}, [0.5], {"m": masses}, t=(0, 0.5))
    assert len(told) == 1 and many.success.tolist() == [True, False, True, False, True]
    assert all("the table of bounded ends at 0.5" in message for message in many.messages.values())


# -- motions


def test_motions_take_the_steps_of_one(fast: Any) -> None:
    (q, u), p, times = starts(), lengths(fast), np.linspace(0, 3, 7)
    many = fast.simulate_batch(q, u, p, t=times, rtol=1e-9)
    ends = fast.simulate_batch(q, u, p, t=(0, 3), rtol=1e-9)
    assert many.success.all() and many.x.shape == (N, 7, 4) and ends.x.shape == (N, 1, 4) and not many.note
    for k in range(N):
        one = fast.simulate(times, q[k], u[k], {name: values[k] for name, values in p.items()}, rtol=1e-9)
        assert (one.x == many.x[k]).all() and (one.x[-1] == ends.x[k, -1]).all()
        assert (one.n_steps, one.n_rejected) == (many.n_steps[k], many.n_rejected[k])


def test_backward_and_with_given_steps(fast: Any) -> None:
    q, u = starts(5)
    times = np.array([2.0, 1.3, 1.2999, 0.0])
    options = {"atol": [1e-6, 1e-7, 1e-8, 1e-9], "max_step": 0.05, "first_step": 0.01}
    many = fast.simulate_batch(q, u, t=times, **options)
    assert all((fast.simulate(times, q[k], u[k], **options).x == many.x[k]).all() for k in range(5))


def test_inputs_are_constants_of_each_motion(compiled: Callable[..., Any]) -> None:
    module = compiled("driven_oscillator", "c")
    name, span = module.metadata.inputs[0], np.array([0.0, 1.0])
    forces = np.linspace(-1, 1, N)
    many = module.simulate_batch(inputs={name: forces}, t=(0, 1))
    assert all((module.simulate(span, inputs={name: f}).x[-1] == x[-1]).all() for f, x in zip(forces, many.x))
    table = (np.array([0.0, 1.0]), np.array([[0.0], [1.0]]).repeat(len(module.metadata.inputs), 1))
    slow = module.simulate_batch(q=np.zeros((2, module.metadata.sizes.q)), inputs=lambda t, x: forces[:2], t=(0, 1))
    assert slow.note == "one by one: inputs by functions of Python or controllers" and slow.success.all()
    quick = module.simulate_batch(q=np.zeros((2, module.metadata.sizes.q)), inputs=table, t=(0, 1))
    assert quick.note == "" and quick.success.all()
    assert (quick.x[0, -1] == module.simulate(span, q=np.zeros(module.metadata.sizes.q), inputs=table).x[-1]).all()


def test_results_by_name(fast: Any) -> None:
    q, u = starts(3)
    many = fast.simulate_batch({"q1": q[:, 0], "q2": 0.5}, u, t=(0, 0.5))
    assert (many["q1"] == many.x[..., 0]).all() and (many.q == many.x[..., :2]).all() and (many.u == many.x[..., 2:]).all()
    assert len(many) == 3 and "3 trajectories, 3 of them to the end, " in repr(many)
    with pytest.raises(ArgumentError, match="there is no state 'q3'; there are q1, q2"):
        many["q3"]


def test_failed_motions_are_reported_and_the_others_run(double: Any) -> None:
    (q, u), mass = starts(6), np.ones(6)
    good = double.simulate_batch(q, u, t=(0, 0.3))
    q[2, 0], mass[4] = np.nan, np.nan
    with pytest.warns(SimulationWarning, match=r"2 of 6 motions failed: 2: .*finite.*q1.*4: "):
        many = double.simulate_batch(q, u, {"m1": mass}, t=(0, 0.3))
    assert many.success.tolist() == [True, True, False, True, False, True] and sorted(many.messages) == [2, 4]
    assert (many.x[many.success] == good.x[many.success]).all() and np.isnan(many.x[[2, 4]]).all()


def test_what_happens_on_the_way_is_reported() -> None:
    """As `simulate` reports it: a force that grows beyond all bounds at t = 1/k, and a mass that is none."""
    x, k, m = sd.coordinates("x"), *sd.parameters("k m")
    system = sd.System("burst")
    body = system.add_body("b", mass=m)
    joint = system.add_joint(sd.Prismatic("j", system.ground, body, x, axis=[1, 0, 0]))
    system.add_joint_force(joint, 1 / (1 - k * sd.t) ** 2)
    system.defaults = {k: 1, m: 1}
    module = system.embedding().compile(backend="c")
    rates, masses = [0.1, 2.0, 0.2, 0.3, 0.4], [1.0, 1.0, 1.0, 0.0, 1.0]
    with pytest.warns(SimulationWarning, match="2 of 5 motions failed: 1: "):
        many = module.simulate_batch(params={"k": rates, "m": masses}, t=(0, 1))
    assert many.success.tolist() == [True, False, True, False, True]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SimulationWarning)
        alone = module.simulate(np.array([0.0, 1.0]), params={"k": 2.0, "m": 1.0})
    assert many.messages[1] == alone.message and "the step became too small" in alone.message
    assert many.messages[3].startswith("burst: ") and "positive" in many.messages[3]


def tops() -> sd.System:
    """Two bodies in ball joints, with Euler parameters."""
    system = sd.System("tops", gravity=[0, 0, -9.81])
    last: Any = system.ground
    for k in (1, 2):
        body = system.add_body(f"b{k}", mass=1, inertia=[1, 0.8, 0.5])
        system.add_joint(sd.Spherical(f"s{k}", last, body, orientation=sd.EulerParameters(), parent_point=[0, 0, -(k - 1.0)],
                                      child_point=[0.1, 0, 1]))
        last = body
    return system


@functools.cache
def projected(name: str) -> Any:
    if name == "tops":
        return tops().embedding().compile(backend="c")
    return sd.systems.get(name).augmented().compile(backend="c")


@pytest.mark.parametrize("name", ["four_bar", "slider_crank", *swept(["rolling_disc", "stewart_platform"]), "tops"])
def test_motions_that_are_projected_take_the_steps_of_one(name: str) -> None:
    """The slider-crank has rejected steps, too, and states of its own parameters."""
    module = projected(name)
    metadata, rng = module.metadata, np.random.default_rng(1)
    q, u = module.consistent()
    q, u = np.tile(q, (N, 1)), np.tile(u, (N, 1)) + 0.1 * rng.normal(size=(N, len(u)))
    for k in range(N):
        q[k], u[k] = module.consistent(q[k], u[k])
    mass = next(p for p in metadata.parameters if p.startswith("m")) if metadata.parameters else None
    params = {mass: np.linspace(0.9, 1.1, N)} if mass else None
    times = np.linspace(0, min(2.0, metadata.duration), 7)
    many = module.simulate_batch(q, u, params, t=times)
    assert many.success.all() and not many.note and many.width == module.batch_width
    for k in range(N):
        one = module.simulate(times, q[k], u[k], {mass: params[mass][k]} if params else None)
        assert (one.x == many.x[k]).all()
        assert (one.n_steps, one.n_rejected) == (many.n_steps[k], many.n_rejected[k])
    assert name != "slider_crank" or many.n_rejected.all()


@pytest.mark.parametrize("together", [True, False])
def test_starts_off_the_constraints_are_reported_with_their_numbers(four_bar: Any, together: bool) -> None:
    q, u = four_bar.consistent()
    starts, params = np.tile(q, (N, 1)), None if together else {"m1": np.linspace(1, 2, N)}
    starts[3, 0] += 1e-3
    speeds = np.tile(u, (N, 1))
    speeds[7, 1] += 1e-2
    with pytest.warns(SimulationWarning, match="2 of 11 motions failed: 3: four_bar: the initial positions violate"):
        many = four_bar.simulate_batch(starts, speeds, params, t=(0, 0.2))
    assert np.flatnonzero(~many.success).tolist() == [3, 7] and np.isnan(many.x[[3, 7]]).all()
    with pytest.raises(SymdynError, match="the initial speeds violate") as alone:
        four_bar.simulate((0, 0.2), starts[7], speeds[7])
    assert many.messages[7] == str(alone.value)
    good = four_bar.simulate(np.array([0, 0.2]), starts[5], speeds[5], params and {"m1": params["m1"][5]})
    assert (many.x[5, -1] == good.x[-1]).all()
    with pytest.warns(SimulationWarning, match="2 of 2 motions failed: 0: four_bar: the initial positions"):
        four_bar.simulate_batch(starts[3], u, t=(0, 0.2), inputs=None, params={"m1": [1.0, 2.0]})


def test_euler_parameters_that_are_no_unit_vector_are_reported() -> None:
    module = projected("tops")
    q = np.tile(module.consistent()[0], (N, 1))
    q[2, 0] = 0.9
    with pytest.warns(SimulationWarning, match=r"1 of 11 motions failed: 2: tops: initial q: .* have the norm 0\.9, not 1"):
        many = module.simulate_batch(q, t=(0, 0.1))
    assert many.success.sum() == N - 1


def test_motions_that_leave_their_constraints_have_the_message_of_one() -> None:
    """A rod whose end is led along a track that ends where the rod can reach no further."""
    angle, v = sd.coordinates("a"), sd.parameters("v")
    system = sd.System("led")
    rod = system.add_body("rod", mass=1, inertia=[0.1, 0.1, 0.1])
    system.add_joint(sd.Revolute("j", system.ground, rod, angle))
    system.add_constraint(sd.position(rod, [1, 0, 0])[0] - v * sd.t, name="led")
    system.defaults = {v: 0.2}
    module = system.augmented().compile(backend="c")
    q, u = module.consistent([1.5])
    speeds = [0.2, 1.5, 0.2]
    starts = np.array([module.consistent(q, u, {"v": s}) for s in speeds])
    with pytest.warns(SimulationWarning, match="1 of 3 motions failed: 1: led: "):
        many = module.simulate_batch(starts[:, 0], starts[:, 1], {"v": speeds}, t=(0, 1))
    with pytest.warns(SimulationWarning):
        alone = module.simulate(np.array([0.0, 1.0]), *starts[1], {"v": 1.5})
    assert many.messages == {1: alone.message} and np.isnan(many.x[1]).all() and many.success.sum() == 2


def test_numpy_runs_one_by_one(compiled: Callable[..., Any], fast: Any) -> None:
    module = compiled("double_pendulum", "numpy")
    q, u = starts(2)
    many = module.simulate_batch(q, u, t=(0, 0.3), rtol=1e-11)
    assert many.note == "one by one: the backend is numpy" and module.batch_width == 1
    np.testing.assert_allclose(many.x, fast.simulate_batch(q, u, t=(0, 0.3), rtol=1e-11).x, atol=1e-9)


def test_interrupt_keeps_what_is_finished(fast: Any) -> None:
    q, u = starts(60_000)
    fast.simulate_batch(*starts(4), t=(0, 1))  # its code is compiled before the clock runs
    threading.Timer(0.4, os.kill, (os.getpid(), signal.SIGINT)).start()
    with pytest.raises(SimulationInterrupted, match=r"interrupted after [0-9]+ of 60000 motions") as caught:
        fast.simulate_batch(q, u, t=(0, 1000))
    solution = caught.value.solution
    assert not solution.success.all() and solution.messages[59_999] == "double_pendulum: not finished"
    assert np.isnan(solution.x[~solution.success]).all()


def test_masses_that_no_body_has_are_reported_as_by_one_motion(fast: Any) -> None:
    masses = [1.0, -0.1, 2.0, -3.0]  # with the first of these the mass matrix is still positive definite
    told = r"1: double_pendulum: the parameter m2, the mass of body '\w+', is -0.1 kg; pass .*; 3: .* is -3 kg"
    with pytest.warns(SimulationWarning, match=f"2 of 4 motions failed: {told}"):
        many = fast.simulate_batch(*starts(4), {"m2": masses}, t=(0, 0.2))
    assert many.success.tolist() == [True, False, True, False] and np.isnan(many.x[[1, 3]]).all()
    with pytest.raises(ArgumentError) as alone:
        fast.simulate((0, 0.2), params={"m2": -0.1})
    assert many.messages[1] == str(alone.value)
    with pytest.raises(ArgumentError, match=r"is -0\.1 kg"):
        fast.simulate_batch(*starts(4), {"m2": -0.1}, t=(0, 0.2))


@pytest.mark.parametrize("backend", ["c", "numpy"])
def test_validity_checks_warn_once(backend: str) -> None:
    """A box that floats, that leaves the water, and that sinks."""
    z, m, pull = sd.coordinates("z"), sd.parameters("m"), sd.inputs("pull")
    system = sd.System("float", gravity=[0, 0, -10])
    hull = system.add_body("hull", mass=m)
    system.add_joint(sd.Prismatic("heave", system.ground, hull, z, axis=[0, 0, 1]))
    system.add_load(sd.Buoyancy(hull, [(2, 2, 2)], 1000, name="box"))
    system.add_force(hull, [0, 0, pull])
    system.defaults = {m: 4000}
    module = system.embedding().compile(backend=backend)
    start, rising, sinking = {"z": [0, 1.5, 0, -1.1]}, r"in 1 of 4 motions, the first of them 1, at worst: .*left the water", (
        r"float_: in 3 of 4 motions, the first of them 1, at worst: .*it sinks: the immersed part of its volume is 1$")
    with pytest.warns(SimulationWarning) as warned:
        many = module.simulate_batch(start, params={"m": [4000, 4000, 9000, 7000]}, t=np.linspace(0, 2, 9))
    assert many.success.all() and len(warned) == 2
    assert re.search(rising, str(warned[0].message)) and re.search(sinking, str(warned[1].message))
    for inputs in ({"pull": [0, 0, -1e5, 0]}, lambda t, x: [0]):
        with pytest.warns(SimulationWarning) as warned:
            module.simulate_batch(start, inputs=inputs, t=np.linspace(0, 2, 9))
        assert [int(str(w.message).split()[2]) for w in warned] == ([2, 3] if isinstance(inputs, dict) else [2, 2])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert len(module.simulate_batch({"z": [0, 0.1]}, t=(0, 1))) == 2


def test_options_of_one_by_one(fast: Any) -> None:
    q, u = starts(2)
    many = fast.simulate_batch(q, u, t=(0, 0.3), method="RK45", max_steps=10_000)
    assert many.note == "one by one: asked for with method, max_steps" and many.width == 1
    assert (many.x[1, -1] == fast.simulate(np.array([0, 0.3]), q[1], u[1], method="RK45").x[-1]).all()
    assert fast.simulate_batch(q, u, t=(0, 0.3), method="dop853", stabilization=None).note == ""
    with pytest.raises(TypeError, match="unexpected keyword argument 'metod'"):
        fast.simulate_batch(q, u, metod="RK45")


def test_events_end_motions() -> None:
    """A ball that falls 1 m in sqrt(0.2) s, and one that falls on."""
    z = sd.coordinates("z")
    system = sd.System("ball", gravity=[0, 0, -10])
    ball = system.add_body("ball", mass=1)
    system.add_joint(sd.Prismatic("fall", system.ground, ball, z, axis=[0, 0, 1]))
    system.add_event("floor", z, direction=-1, stop=True)
    module = system.embedding().compile(backend="c")
    ends = module.simulate_batch({"z": [1.0, 50.0]}, t=(0, 2))
    assert ends.note == "" and ends.success.all()
    np.testing.assert_allclose(ends.x[:, 0], [[0, -np.sqrt(20)], [30, -20]], atol=1e-12)
    many = module.simulate_batch({"z": [1.0, 50.0]}, t=[0, 0.4, 2])
    np.testing.assert_allclose(many["z"], [[1, 0.2, np.nan], [50, 49.2, 30]], atol=1e-12)
    through = module.simulate_batch({"z": [1.0, 50.0]}, t=(0, 2), events=False)
    assert through.note == "" and through["z"][0, 0] == pytest.approx(-19)
    with pytest.raises(ArgumentError, match="events roof asked for; there are floor"):
        module.simulate_batch({"z": [1.0]}, t=(0, 2), events=["roof"])
    drawn = sd.ensemble(module, {"z": [1.0, 50.0]}, t=(0, 2), outcomes=["end z"])
    np.testing.assert_allclose(drawn["end z"], [0, 30], atol=1e-12)
    assert sd.ensemble(module, {"z": [1.0, 50.0]}, t=(0, 2), outcomes=["end z"], events=False)["end z"][0] == pytest.approx(-19)


def test_the_report_reports_how_many(compiled: Callable[..., Any], fast: Any, four_bar: Any) -> None:
    fast.rhs_batch(0.0, np.zeros((1, 4)))
    assert four_bar.batch_width > 1  # compiles it
    for module, told in ((fast, f"rhs_batch {fast.batch_width} on the processor's vectors, simulate_batch likewise"),
                         (four_bar, "on the processor's vectors, simulate_batch likewise"),
                         (compiled("double_pendulum", "numpy"), "rhs_batch by broadcasting, simulate_batch one by one: the ba")):
        assert told in next(line for line in str(module.report()).splitlines() if line.startswith("  Many at once: rhs_batch "))
    fresh = sd.systems.get("double_pendulum").embedding().compile(backend="c")
    assert "rhs_batch as many as the processor's vectors have lanes (module.batch_width)" in str(fresh.report())


# -- arguments


def test_none_at_all(fast: Any) -> None:
    for given in ({"q": np.zeros((0, 2))}, {"params": {"m1": []}}, {"q": np.zeros((0, 2)), "params": {"m1": []}}):
        many = fast.simulate_batch(**given, t=(0, 1))
        assert many.x.shape == (0, 1, 4) and many.success.shape == (0,)
    assert fast.rhs_batch(0.0, np.zeros((0, 4))).shape == (0, 4)


@pytest.mark.parametrize(("arguments", "message"), [
    ({"q": np.zeros((3, 2)), "u": np.zeros((4, 2))}, "q has 3 rows, u has 4 rows; give what varies the same number"),
    ({"q": np.zeros((3, 3))}, r"initial q has the shape \(3, 3\), needed is \(trajectories, 2\): q1, q2"),
    ({"q": np.zeros((3, 3, 2))}, r"initial q has the shape \(3, 3, 2\)"),
    ({"q": {"q1": [1, 2], "q2": [1, 2, 3]}}, "q1 has 2 values, q2 has 3 values; give all that vary the same number"),
    ({"params": {"l3": [1, 2]}}, "parameters: there is no 'l3', did you mean l1"),
    ({"params": {"zzz": [1, 2]}}, "parameters: there is no 'zzz'; there are g, m1"),
    ({"params": {"l3": 1.0}}, "parameters: there is no 'l3', did you mean l1"),
    ({"params": {"l1": np.ones((2, 2))}}, r"the values of l1 have the shape \(2, 2\)"),
    ({"params": {"l1": ["a", "b"]}}, "the values of l1 must be real numbers"),
    ({"q": np.ones((3, 2)) * 1j}, "initial q must be real numbers"),
    ({"params": {"l1": [1, 1j]}}, "the values of l1 must be real numbers"),
    ({"params": [["a"]]}, "parameters must be real numbers"),
    ({"params": {"l1": np.nan}}, "parameters must be finite, found l1 = nan"),
    ({"t": (0, np.nan)}, "t must be"), ({"rtol": -1}, "tolerances must be positive"), ({"max_step": -1}, "max_step must be"),
])
def test_motions_that_do_not_fit(fast: Any, arguments: dict[str, Any], message: str) -> None:
    with pytest.raises(ArgumentError, match=message):
        fast.simulate_batch(**{"t": (0, 1), **arguments})


@pytest.mark.parametrize(("t", "x", "message"), [
    (0.0, np.zeros((3, 5)), r"x has the shape \(3, 5\), needed is \(n, 4\)"), (0.0, "a", "x must be real numbers"),
    (0.0, np.ones((3, 4)) + 1j, "x must be real numbers"),
    (np.zeros(2), np.zeros((3, 4)), "t has 2 rows, x has 3 rows"), (np.zeros((2, 2)), np.zeros((3, 4)), "t has the shape"),
])
def test_states_that_do_not_fit(double: Any, t: Any, x: Any, message: str) -> None:
    with pytest.raises(ArgumentError, match=message):
        double.rhs_batch(t, x)


def test_result_in_an_array_of_the_caller(double: Any) -> None:
    x = np.random.default_rng(2).normal(size=(N, 4))
    wanted = double.rhs_batch(0.0, x)
    for out in (np.zeros((N, 4)), np.zeros((4, N)).T, np.zeros((N, 8))[:, ::2]):
        assert double.rhs_batch(0.0, x, out=out) is out and (out == wanted).all()
    shared = np.vstack([x, x[:1]])
    assert (double.rhs_batch(0.0, shared[:N], out=shared[1:]) == wanted).all()  # each row is read before it is written
    frozen = np.zeros((N, 4))
    frozen.flags.writeable = False
    for bad in (np.zeros((N, 3)), np.zeros((N, 4), dtype=int), frozen, [1.0]):
        with pytest.raises(ArgumentError, match=r"out must be a writable array of doubles of the shape \(11, 4\)"):
            double.rhs_batch(0.0, x, out=bad)


def test_rows_of_what_varies() -> None:
    rows = take_rows({"b": [1, 2, 3]}, ["a", "b"], "values", {"a": 7.0, "b": None}, "it")
    assert rows.tolist() == [[7, 1], [7, 2], [7, 3]]
    assert take_rows(None, ["a"], "values", {"a": 7.0}, "it").tolist() == [[7]]
    assert take_rows([[1], [np.nan]], ["a"], "values", {}, "it").shape == (2, 1)
