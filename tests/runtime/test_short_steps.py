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
from symdyn.runtime import compiled, scipy_run, short_steps


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


@pytest.mark.parametrize(("backend", "method"), [("c", "dop853"), ("c", "bs54"), ("c", "radau"), ("numpy", "LSODA")])
def test_friction_in_a_function_of_the_user_is_warned_of(pushed: Any, backend: str, method: str) -> None:
    """No expression tells where it jumps; the rate of the speed does, by 2 x 3 m/s^2, while the block sticks."""
    match = (r"block: steps have shrunk to \S+ s at t = 0.588\d* s, over a thousand times shorter than the motion itself needs "
             r"there: the rate of x_dot goes to and fro by 6 a second from step to step, as behind a jump or noise in a load, an "
             r"input or a function of the user; the state there: x = 0.605\d*, x_dot = ")
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        run = pushed[backend].simulate((0, 1), u=[2.0], inputs=lambda t, x: -3 * np.sign(x[1]), method=method, max_steps=3500)
    assert [str(one.message) for one in told] == [*run.doubts, run.message] and re.match(match, run.doubts[0])
    assert told[0].filename == told[1].filename == __file__  # where simulate was called


@pytest.fixture
def always(monkeypatch: pytest.MonkeyPatch) -> Iterator[list[int]]:
    """Looks at every motion of some hundred steps, however long they are; counts its looks."""
    looks: list[int] = []
    entry: Callable[..., Any] = short_steps.ShortSteps._entry
    monkeypatch.setattr(short_steps.ShortSteps, "_entry", lambda self, found: looks.append(1) or entry(self, found))
    monkeypatch.setattr(short_steps, "SHRUNK", 2.0)
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
    ("c", "dop853", 400, {"inputs": lambda t, x: np.sin(7 * t)}),
    ("numpy", "DOP853", 200, {"rtol": 1e-12}),
    ("numpy", "Radau", 15, {"rtol": 1e-10}),
])
def test_steps_that_a_motion_needs_are_not_warned_of(pushed: Any, always: list[int], backend: str, method: str, span: float,
                                                     options: dict[str, Any]) -> None:
    given = {"inputs": [0.0], **options}
    with warnings.catch_warnings():
        warnings.simplefilter("error", SimulationWarning)
        run = pushed[backend].simulate((0, span), q=[1.0], method=method, **given)
    assert run.success
    if "max_step" in options:
        always.append(0)  # steps of a given length are not looked at


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
