"""Errors between the steps of every method: a short run of the command, and what it reports."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import symdyn as sd
from symdyn.errors import ArgumentError, EvaluationError, SimulationWarning
from symdyn.lab.dense_output import METHODS, Result, main, measure, misfit, problems, table
from symdyn.runtime.building.compiler import find_compiler
from tests.runtime.constrained import module as constrained

STIFF, TRANSIENT, SMOOTH = 3, 4, 0


def test_thirty_problems_of_all_kinds() -> None:
    """Closed forms fulfil the start that the problem has; every method runs on some of them."""
    rows = problems()
    assert len(rows) == 30 == len({row.name for row in rows})
    assert 5 <= sum(row.constrained for row in rows) <= 15 and sum(row.rate * row.end > 1e3 for row in rows) > 8
    for row in rows:
        if row.exact is not None:
            begin = row.exact(np.array([0.0]))[0]
            given = [*row.start.get("q", ()), *row.start.get("u", ()), *row.start.get("z", ())]
            assert np.abs(begin[len(begin) - len(given):] - given).max() < 1e-14 or "u" not in row.start
    for method in METHODS:
        assert any(not misfit(row, method, 1e-6) for row in rows)


@pytest.mark.parametrize("method", ["dop853", "radau", "radau5", "Radau", "BDF"])
@pytest.mark.parametrize("number", [STIFF, TRANSIENT])
def test_between_stiff_steps(method: str, number: int) -> None:
    if find_compiler() is None:
        pytest.skip("no C compiler here")
    result = measure(number, method, 1e-5)
    assert result.why == "stiff" * (method == "dop853") or result.passed, str(result)


@pytest.mark.parametrize("rtol", [1e-4, 1e-5])
def test_between_steps_that_stability_limits(rtol: float) -> None:
    """The polynomial of dop853 swings there: errors were up to 280 tolerances."""
    if find_compiler() is None:
        pytest.skip("no C compiler here")
    number = next(k for k, problem in enumerate(problems()) if problem.name == "held 1e+04 200 0.1")
    assert measure(number, "dop853", rtol).between < 50


def test_command(capsys: pytest.CaptureFixture[str]) -> None:
    if find_compiler() is None:
        pytest.skip("no C compiler here")
    assert main(["--methods", "radau5", "--tolerances", "1e-4", "--only", str(STIFF), str(SMOOTH)]) == 0
    text = capsys.readouterr().out
    assert "radau5        2" in text and "ABOVE" not in text


def test_what_is_above_the_bound_is_marked() -> None:
    bad, good = Result("p", "m", 1e-6, 101.0, 1.0, 5, 0.1), Result("q", "m", 1e-6, 99.0, 1.0, 5, 0.1)
    assert "ABOVE" in str(bad) and "ABOVE" not in str(good) and "p, rtol = 1e-06" in table([bad, good])
    assert Result("p", "m", 1e-6, why="stiff").passed


# -- states at any time, after the run


@pytest.mark.parametrize("method", ["dop853", "bs54", "taylor", "gauss", "radau", "radau5", "Radau", "DOP853", "BDF", "LSODA"])
def test_states_after_the_run_are_those_of_output_times(method: str, compiled: Any) -> None:
    """In any order and shape, more than once, at the ends, forward and back; rows of the solution to the last bit."""
    double = compiled("double_pendulum", "c")
    for span in ((0.0, 0.5), (0.5, 0.0)):
        run = double.simulate(np.linspace(*span, 7), rtol=1e-7, method=method)
        times = np.random.default_rng(2).uniform(0, 0.5, 50)
        given = double.simulate(np.array([span[0], *sorted(times, reverse=span[0] > 0), span[1]]), rtol=1e-7, method=method)
        np.testing.assert_array_equal(run(run.t), run.x)
        np.testing.assert_array_equal(run(sorted(times, reverse=span[0] > 0)), given.x[1:-1])
        np.testing.assert_array_equal(run([[times[3], 0.5], [0.0, times[3]]])[[0, 1], [0, 1]], run([times[3], times[3]]))
        assert run(0.3).shape == (4,) and run([]).shape == (0, 4)


def test_states_after_a_run_with_events_work_and_constraints(compiled: Any) -> None:
    """Beyond a reset, with one column more in the run, and on the constraints."""
    q = sd.coordinates("q")
    system = sd.System("ball", gravity=[-9.81, 0])
    system.add_joint(sd.Prismatic("up", system.ground, system.add_body("ball", mass=1), q, axis=[1, 0]))
    system.add_event("bounce", q, direction=-1, reset={q.dot: -q.dot / 2})
    system.initial = {q: 1}
    ball = system.embedding().compile(backend="c").simulate((0, 1.0), rtol=1e-9)
    fall = (2 / 9.81)**0.5
    times = np.array([fall / 2, fall, fall + 0.1])
    heights = [1 - 9.81 * fall**2 / 8, 0.0, 9.81 * fall / 2 * 0.1 - 9.81 * 0.005]
    np.testing.assert_allclose(ball(times)[:, 0], heights, rtol=0, atol=1e-8)
    bar = constrained("four_bar").simulate((0, 1.0), rtol=1e-8, work=True)
    assert bar(0.123).shape == (6,)
    again = constrained("four_bar").simulate(np.array([0, 0.123, 1.0]), rtol=1e-8, work=True)
    np.testing.assert_array_equal(bar(0.123), again.x[1])


def test_states_outside_of_the_motion_are_an_error(compiled: Any) -> None:
    double = compiled("double_pendulum", "c")
    run = double.simulate((0, 1.0))
    for t in (-1e-9, 1.0 + 1e-9, np.nan, [0.5, 2.0]):
        with pytest.raises(ArgumentError, match=r"the motion goes from t = 0 s to t = 1 s, but its state was asked for at t = "):
            run(t)
    with pytest.raises(ArgumentError, match="t must be a time or an array of times, found 'x'"):
        run("x")
    with pytest.warns(SimulationWarning, match="3 steps were done"):
        short = double.simulate((0, 1.0), max_steps=3)
    np.testing.assert_array_equal(short(short.t[-2]), short.x[-2])
    with pytest.raises(ArgumentError, match="its state was asked for at t = 1 s"):
        short(1.0)


def test_motion_that_cannot_be_repeated_is_an_error() -> None:
    """A function of inputs that changes its mind; motions that were not integrated here."""
    q = sd.coordinates("q")
    F = sd.inputs("F")
    system = sd.System("pushed_body", planar=True)
    slider = system.add_joint(sd.Prismatic("slider", system.ground, system.add_body("body", mass=1), q, axis=[1, 0]))
    system.add_joint_force(slider, F)
    broken = []
    run = system.embedding().compile().simulate((0, 1.0), inputs=lambda t, x: [np.nan if broken and t > 0.2 else 0.0])
    broken.append(True)
    with pytest.raises(EvaluationError, match=r"does not come as far as before when it is repeated: .*F is nan"):
        run(0.9)
    run._repeat = None
    with pytest.raises(ArgumentError, match="need a motion that simulate has integrated; this one holds 1001 times"):
        run(0.5)
