"""Motions that slide along a jump of the right-hand side stop with what chatters; others that switch do not."""

from __future__ import annotations

import functools
import time as clock
import warnings
from typing import Any

import numpy as np
import pytest
import sympy as sp

import symdyn as sd
from symdyn.errors import SimulationWarning
from tests.helpers import swept

METHODS = [("c", method) for method in ("dop853", "bs54", "radau", "radau5", "auto", "RK45")] + [
    ("numpy", method) for method in ("DOP853", "RK23", "LSODA", "Radau", "BDF", "auto")]
SHARED = [("c", "dop853"), ("c", "radau"), ("numpy", "DOP853")]


@functools.cache
def block(load: Any, name: str = "friction", **defaults: float) -> Any:
    """A block of 1 kg on a rail with a load of position x, time and parameters, in the order of their defaults; modules by
    backend."""
    x = sd.coordinates("x")
    parameters = [sd.parameters(letter) for letter in defaults]
    s = sd.System("block")
    along = s.add_joint(sd.Prismatic("along", s.ground, s.add_body("block", mass=1), x, axis=[1, 0]))
    s.add_joint_force(along, load(x, *parameters), name=name)
    s.defaults = dict(zip(parameters, defaults.values(), strict=True))
    equations = s.embedding()
    return {backend: equations.compile(backend=backend) for backend in ("c", "numpy")}


SLIDES = (r"block: stopped at t = 0.58\d*: .*sign\(-v \+ x_dot\) in load friction chatters: the motion is driven onto "
          r"-v \+ x_dot = 0 from both sides, at rates of 2.39 and -3.61 of its unit a second.*for example by "
          r"tanh\(\(-v \+ x_dot\)/eps\) in place of sign\(-v \+ x_dot\) with a small eps, .*an event with stop=True")


# A force that vibrates hard enough to move the block ends after 10 s.
VIBRATES = lambda x: -sp.sign(x.dot) + 3 * sp.sin(3 * sd.t) * (1 - sp.tanh(sd.t - 10)) / 2
BRAKES = lambda x: sp.Piecewise((-2, x.dot > x), (2, True))
# Rounding down of the speed drives it to a whole number.
ROUNDS = lambda x: 1 - 4 * sp.floor(x.dot)
# A relay by time, a block that slides to and fro, a spring that changes its stiffness: crossed, never held.
SWITCH = (lambda x: sp.sign(sp.sin(40 * sd.t)), lambda x: -sp.sign(x.dot) + 30 * sp.cos(5 * sd.t),
          lambda x: -x * sp.Piecewise((400, x > 0), (100, True)), lambda x: -400 * sp.sign(x))


@pytest.fixture(scope="module")
def rubbing() -> Any:
    """Dry friction on a belt that moves at v, and a spring."""
    return block(lambda x, v, F: -F * sp.sign(x.dot - v) - x, v=0, F=3)


@pytest.mark.parametrize(("backend", "method"), swept(METHODS, *(case for case in METHODS if case != ("numpy", "auto"))))
def test_a_block_that_comes_to_rest_stops_with_what_chatters(rubbing: Any, backend: str, method: str) -> None:
    """x = (1 + ...) cos t - 3: from x = 0 at 2 m/s it stops where tan t = 2/3, held by friction."""
    begun = clock.perf_counter()
    with pytest.warns(SimulationWarning, match=SLIDES):
        run = rubbing[backend].simulate((0, 21), u=[2.0], method=method)
    assert not run.success and run.t[-1] == pytest.approx(np.arctan(2 / 3), abs=5e-4) and run.n_steps < 5000
    assert abs(run["x_dot"][-1]) < 1e-5
    assert clock.perf_counter() - begun < 20  # a hundredth of a second of an idle machine's with C


@pytest.mark.parametrize(("backend", "method"), swept(METHODS, *SHARED))
def test_a_block_on_a_moving_belt_stops_where_it_begins_to_stick(rubbing: Any, backend: str, method: str) -> None:
    """x_ddot + x = 3 from rest: v = 3 sin t reaches the belt's 0.5 m/s at arcsin(1/6)."""
    with pytest.warns(SimulationWarning, match=r"sign\(-v \+ x_dot\) in load friction chatters"):
        run = rubbing[backend].simulate((0, 5), params={"v": 0.5}, method=method)
    assert run.t[-1] == pytest.approx(np.arcsin(1 / 6), abs=1e-3) and run.n_steps < 5000


@pytest.mark.parametrize(("backend", "method"), SHARED)
def test_it_is_found_wherever_it_begins_in_a_long_run(backend: str, method: str) -> None:
    with pytest.warns(SimulationWarning, match=r"sign\(x_dot\) in load friction chatters"):
        run = block(VIBRATES)[backend].simulate((0, 1000), u=[0.1], method=method, rtol=1e-6)
    assert 9 < run.t[-1] < 15


@pytest.mark.parametrize(("backend", "method"), SHARED)
def test_a_condition_is_named(backend: str, method: str) -> None:
    module = block(BRAKES, "brake")[backend]
    with pytest.warns(SimulationWarning, match=r"the condition .*x.* [<>]=? 0 in load brake chatters: the motion is driven onto "
                                               r".* = 0 from both sides.*weight of the two sides"):
        run = module.simulate((0, 5), u=[0.5], method=method)
    assert not run.success and run["x_dot"][-1] == pytest.approx(run["x"][-1], abs=1e-6)


@pytest.mark.parametrize(("backend", "method"), SHARED)
def test_a_floor_is_named(backend: str, method: str) -> None:
    with pytest.warns(SimulationWarning, match=r"floor\(x_dot\) in load friction chatters"):
        run = block(ROUNDS)[backend].simulate((0, 5), u=[0.5], method=method)
    assert run["x_dot"][-1] == pytest.approx(1.0, abs=1e-5)


def test_the_same_motion_with_the_remedy_reaches_its_end() -> None:
    module = block(lambda x: -3 * sp.tanh(1000 * x.dot) - x)["c"]
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        run = module.simulate((0, 3), u=[2.0], method="radau")
    assert run.success


@pytest.mark.parametrize(("backend", "method"), [*SHARED, ("c", "bs54"), ("numpy", "LSODA")])
def test_what_only_switches_is_no_chattering(backend: str, method: str) -> None:
    for load in SWITCH:
        module = block(load)[backend]
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            run = module.simulate((0, 6 if backend == "c" else 1), q=[0.1], method=method, rtol=1e-6)
        assert run.success


def test_many_motions_stop_one_by_one_where_they_chatter(rubbing: Any) -> None:
    """On the processor's vectors those that end do; the others are stopped."""
    with pytest.warns(SimulationWarning, match=r"1 of 3 motions failed: 1: block: stopped at t = 0.58"):
        runs = rubbing["c"].simulate_batch(u=[[2.0], [2.0], [0.5]], params={"F": [0.0, 3.0, 0.0]}, t=(0, 21))
    assert runs.success.tolist() == [True, False, True] and "may chatter" in runs.note
    assert runs.x[0, -1, 0] == pytest.approx(2 * np.sin(21), abs=1e-6)
    assert runs.x[2, -1, 0] == pytest.approx(0.5 * np.sin(21), abs=1e-6)


def test_bounces_without_end_keep_their_own_message() -> None:
    y = sd.coordinates("y")
    s = sd.System("ball", gravity=[0, -10])
    ball = s.add_body("ball", mass=1)
    joint = s.add_joint(sd.Prismatic("fall", s.ground, ball, y, axis=[0, 1]))
    s.add_joint_force(joint, -sp.sign(y.dot), name="drag")
    s.add_event("bounce", y, direction=-1, reset={y.dot: -y.dot / 2})
    s.initial = {y: 1}
    module = s.embedding().compile(backend="c")
    for method in ("dop853", "RK45"):
        with pytest.warns(SimulationWarning, match="events, bounce the last, with hardly any time between"):
            run = module.simulate((0, 5), method=method)
        assert "chatters" not in run.message
