"""The stabilized index-2 form by an implicit method: against the compiled integrator; what it rejects."""

from __future__ import annotations

import sys
from typing import Any

import numpy as np
import pytest

from symdyn.errors import ArgumentError, MissingExtra, SimulationWarning
from tests.runtime.constrained import module


@pytest.fixture(autouse=True)
def solver() -> None:
    pytest.importorskip("solve_dae")


@pytest.mark.parametrize("backend", ["c", "numpy"])
def test_agrees_with_the_compiled_integrator(backend: str) -> None:
    times = np.linspace(0, 2, 21)
    exact = module("pendulum_absolute", backend).simulate(times, rtol=1e-12)
    for rtol, error in ((1e-4, 5e-3), (1e-7, 2e-5)):
        solution = module("pendulum_absolute", backend).simulate(times, rtol=rtol, method="ggl")
        assert solution.success and solution.method == "ggl" and solution.nfev > 0
        np.testing.assert_allclose(solution.x, exact.x, rtol=0, atol=error)
        np.testing.assert_allclose(solution.lam, exact.lam, rtol=0, atol=10 * error)


@pytest.mark.parametrize("name", ["four_bar", "skate"])
def test_mechanisms(name: str) -> None:
    loop = module(name)
    span = (0, 0.3 if loop.metadata.duration > 1 else 0.01)
    solution, exact = loop.simulate(span, rtol=1e-6, method="ggl", steps=True), loop.simulate(span, rtol=1e-10)
    assert np.abs(solution.constraint_violation).max() < 1e-6 and np.abs(solution.velocity_violation).max() < 1e-5
    scale = np.abs(exact.x).max(axis=0) + 1e-3 * np.abs(exact.x).max()
    np.testing.assert_allclose(solution.x[-1] / scale, exact.x[-1] / scale, rtol=0, atol=1e-3)


def test_steps_times_and_nothing_at_all() -> None:
    pendulum = module("pendulum_absolute")
    assert pendulum.simulate((0, 1), method="ggl", rtol=1e-4).t.shape == (1001,)
    steps = pendulum.simulate((0, 1), method="ggl", rtol=1e-4, steps=True)
    assert len(steps.t) == steps.n_steps + 1
    assert pendulum.simulate((1.0, 1.0), method="ggl").success
    back = pendulum.simulate((1, 0), method="ggl", rtol=1e-4)
    assert back.success and back.t[-1] == 0.0
    with pytest.warns(SimulationWarning, match="stopped after 3 steps"):
        assert pendulum.simulate((0, 1), method="ggl", max_steps=3).n_steps == 3


@pytest.mark.parametrize(("name", "options", "message"), [
    ("pendulum", {}, "'ggl' is for equations with constraints"), ("pendulum_absolute", {"work": True}, "leave out work=True"),
    ("pendulum_absolute", {"stabilization": "none"}, "keeps the constraints itself; leave out stabilization='none'"),
    ("bricard", {}, "needs independent constraints; of 5 only 4 are")])
def test_what_it_rejects(name: str, options: dict[str, Any], message: str) -> None:
    with pytest.raises(ArgumentError, match=message):
        module(name).simulate((0, 1), method="ggl", **options)


@pytest.mark.native  # where it ends depends on rounding: without fused operations elsewhere
def test_where_it_cannot_go_on() -> None:
    with pytest.warns(SimulationWarning, match="the constraints nearly lose rank there .1 instead of 2.: circle, lift"):
        solution = module("driven").simulate((0, 2), method="ggl", rtol=1e-4)
    assert not solution.success and len(solution.t) > 490


def test_missing_package(monkeypatch: pytest.MonkeyPatch) -> None:
    for name in [n for n in sys.modules if n.partition(".")[0] == "solve_dae"]:
        monkeypatch.setitem(sys.modules, name, None)
    monkeypatch.setitem(sys.modules, "solve_dae.integrate", None)
    with pytest.raises(MissingExtra, match=r"pip install 'symdyn\[dae\]'"):
        module("pendulum_absolute").simulate((0, 1), method="ggl")
