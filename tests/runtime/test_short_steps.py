"""Steps that shrink far below what the smooth motion needs are warned of; short steps that a motion does need are not."""

from __future__ import annotations

import re
import warnings
from collections.abc import Callable, Iterator
from typing import Any

import numpy as np
import pytest
import sympy as sp

import symdyn as sd
from symdyn.errors import SimulationWarning
from symdyn.runtime.integrating import compiled, scipy_run, short_steps
from tests.helpers import swept


@pytest.fixture(scope="module")
def pushed() -> Any:
    """A block on a spring k with a damper c, pushed by an input F."""
    x, F = sd.coordinates("x"), sd.inputs("F")
    k, c = sd.parameters("k c")
    s = sd.System("block")
    along = s.add_joint(sd.Prismatic("along", s.ground, s.add_body("block", mass=1), x, axis=[1, 0]))
    s.add_joint_force(along, F - k * x - c * x.dot, name="push")
    s.defaults = {k: 1, c: 0}
    equations = s.embedding()
    return {backend: equations.compile(backend=backend) for backend in ("c", "numpy")}


EXPLICIT_AND_NOT = [("c", "dop853"), ("c", "bs54"), ("c", "radau"), ("c", "radau5"), ("c", "auto"), ("numpy", "DOP853"),
                    ("numpy", "LSODA")]


def stops(module: Any, match: str, **options: Any) -> Any:
    """A run that ends where it chatters, after few steps, with one warning, which says where simulate was called."""
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        run = module.simulate(max_steps=20000, **options)
    assert [str(one.message) for one in told] == [run.message] and told[0].filename == __file__
    assert re.match(match, run.message) and not run.success and run.doubts == ()
    return run


@pytest.mark.parametrize(("backend", "method"), swept(EXPLICIT_AND_NOT, ("c", "dop853"), ("c", "radau"), ("numpy", "LSODA")))
def test_friction_in_a_function_of_the_user_stops_where_it_chatters(pushed: Any, backend: str, method: str) -> None:
    """No expression shows where it jumps; rates to either side do."""
    match = (r"block: stopped at t = 0.58\d*: input F chatters: the motion is driven onto a jump at x_dot = \S+ from both "
             r"sides, at rates of [23]\.?\d* and -[34]\.?\d* of its unit a second, and every step crosses it, \d+ steps took \S+ "
             r"s; make the jump smooth, for example by tanh\(x_dot/eps\) in place of sign\(x_dot\) with a small eps, or end the "
             r"motion there by an event with stop=True and go on with equations for what sticks; the state there: x = 0.605\d*, "
             r"x_dot = ")
    stops(pushed[backend], match, t=(0, 1), u=[2.0], inputs=lambda t, x: -3 * np.sign(x[1]), method=method)


def test_sliding_along_a_jump_that_moves_is_chattering(pushed: Any) -> None:
    """A belt whose speed is sin(2 t), taken up at once and then followed up to the friction that accelerates the block."""
    stops(pushed["c"], r"block: stopped at t = 0.\d+: input F chatters: .* a jump at x_dot = 0.[3-9]", t=(0, 3), u=[2.0],
          params={"k": 0}, inputs={"F": lambda t, x: -3 * np.sign(x[1] - np.sin(2 * t))})


def test_relative_motion_under_constraints_chatters() -> None:
    """Motion of two blocks one upon the other, in absolute coordinates."""
    x, y, F = *sd.coordinates("x y"), sd.inputs("F")
    s = sd.System("pile", gravity=[0, 0])
    low, high = s.add_body("low", mass=2), s.add_body("high", mass=1)
    s.add_joint(sd.Prismatic("along", s.ground, low, x, axis=[1, 0]))
    s.add_joint(sd.Prismatic("upon", low, high, y, axis=[1, 0]))
    s.add_joint_force("upon", F)
    module = s.augmented(coordinates="absolute").compile()
    names = module.metadata.x
    below, above = names.index("x_low_dot"), names.index("x_high_dot")
    q, u = module.consistent(u={"x_low_dot": 0.0, "x_high_dot": 1.0})
    stops(module, r"pile: stopped at t = 0.\d+: input F chatters: ", t=(0, 3), q=q, u=u,
          inputs={"F": lambda t, state: -np.sign(state[above] - state[below])})


def test_noise_and_steep_functions_do_not_end_a_run(pushed: Any) -> None:
    """They do not drive the motion back: noise is warned of, and a steep function is a stiff one."""
    def noise(t: float, x: np.ndarray) -> float:
        return 3 * float(np.sign(np.sin(1e9 * t * (1 + t)))) * (t > 0.3)

    match = (r"block: steps have shrunk to \S+ s at t = \S+ s, over a thousand times shorter than the motion itself needs there: "
             r"the rate of x_dot goes to and fro by 6 a second from step to step, as behind a jump or noise in a load, an input "
             r"or a function of the user; the state there: x = ")
    with pytest.warns(SimulationWarning, match=match):
        run = pushed["c"].simulate((0, 1), u=[2.0], inputs=noise, max_steps=3000)
    assert "3000 steps were done" in run.message and len(run.doubts) == 1
    with warnings.catch_warnings():
        warnings.simplefilter("error", SimulationWarning)
        assert pushed["c"].simulate((0, 1), u=[2.0], inputs=lambda t, x: -3 * np.tanh(x[1] / 1e-4)).success


@pytest.fixture
def always(monkeypatch: pytest.MonkeyPatch) -> Iterator[list[int]]:
    """Looks at every motion of some hundred steps, however long they are; counts its looks."""
    looks: list[int] = []
    entry: Callable[..., Any] = short_steps.ShortSteps._entry
    monkeypatch.setattr(short_steps.ShortSteps, "_entry", lambda self, found: looks.append(1) or entry(self, found))
    monkeypatch.setattr(short_steps, "SHRUNK", 2.0)
    monkeypatch.setattr(short_steps, "OF_FUNCTIONS", 2.0)
    monkeypatch.setattr(compiled, "PIECE", 300)
    monkeypatch.setattr(scipy_run, "TRIED_OF_SCIPY", 100)
    monkeypatch.setattr(short_steps.ShortSteps.__init__, "__defaults__", (150,))
    yield looks
    assert looks


@pytest.mark.parametrize(("backend", "method", "span", "options"), [
    ("c", "dop853", 5, {"params": {"k": 1e8, "c": 2e4}}),  # stiff, limited by stability
    ("c", "bs54", 5, {"params": {"k": 1e8, "c": 2e4}, "rtol": 1e-3}),
    ("c", "dop853", 1, {"params": {"k": 1e8}}),  # a fast vibration
    ("c", "dop853", 400, {"rtol": 1e-14}),
    ("c", "radau", 400, {"rtol": 1e-12}),
    ("c", "taylor", 8000, {}),
    ("c", "dop853", 40, {"rtol": 1e-3, "max_step": 0.01}),
    ("c", "dop853", 150, {"inputs": lambda t, x: np.sin(7 * t)}),
    ("numpy", "DOP853", 60, {"rtol": 1e-12}),
    *swept([("numpy", "Radau", 15, {"rtol": 1e-10})]),
])
def test_steps_that_a_motion_needs_are_not_warned_of(pushed: Any, always: list[int], backend: str, method: str, span: float,
                                                     options: dict[str, Any]) -> None:
    given = {"inputs": [0.0], **options}
    with warnings.catch_warnings():
        warnings.simplefilter("error", SimulationWarning)
        run = pushed[backend].simulate((0, span), q=[1.0], method=method, **given)
    assert run.success
    if "max_step" in options:
        assert not always  # steps of a given length are not looked at
        always.append(0)


def test_contacts_by_stiff_springs_are_not_warned_of(always: list[int]) -> None:
    """A ball on a floor of 1e7 N/m: flights with long steps, contacts of 1 ms with short ones."""
    y = sd.coordinates("y")
    s = sd.System("ball", gravity=[0, -10])
    joint = s.add_joint(sd.Prismatic("fall", s.ground, s.add_body("ball", mass=1), y, axis=[0, 1]))
    s.add_joint_force(joint, sp.Piecewise((-10000000 * y - 100 * y.dot, y < 0), (0, True)), name="floor")
    s.initial = {y: 1}
    module = s.embedding().compile(backend="c")
    for method in ("dop853", "radau"):
        with warnings.catch_warnings():
            warnings.simplefilter("error", SimulationWarning)
            assert module.simulate((0, 10), method=method).success
