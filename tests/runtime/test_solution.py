"""Solutions: shapes, energies, outputs, files."""

from __future__ import annotations

import csv
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import symdyn as sd
from symdyn.errors import ArgumentError, SimulationInterrupted, SimulationWarning

N = 21


@pytest.fixture(scope="module", params=["c", "numpy"])
def solution(request: pytest.FixtureRequest, compiled: Callable[..., Any]) -> Any:
    return compiled("kitchen_sink", request.param).simulate(
        np.linspace(0, 0.2, N), inputs={"F": 0.3, "tau": lambda t, x: np.cos(t)}, rtol=1e-8)


def test_shapes_time_first(solution: Any) -> None:
    assert solution.success
    assert solution.t.shape == (N,) and solution.x.shape == (N, 8) and solution.y.shape == (8, N)
    assert solution.q.shape == (N, 3) and solution.u.shape == (N, 3) and solution.z.shape == (N, 2)
    np.testing.assert_array_equal(np.hstack([solution.q, solution.u, solution.z]), solution.x)
    np.testing.assert_array_equal(solution.y, solution.x.T)
    assert solution.inputs.shape == (N, 2) and solution.energies.shape == (N, 2) and solution.energy.shape == (N,)
    assert solution.frames.shape == (N, 4, 12)
    assert {n: o.shape for n, o in solution.outputs.items()} == {
        "tip": (N, 3), "tip_velocity": (N, 3), "smooth": (N,), "pair": (N, 2)}
    assert solution.lam.shape == solution.constraint_violation.shape == (N, 0)


def test_values_are_those_of_the_module(solution: Any) -> None:
    module = solution.module
    np.testing.assert_array_equal(solution.params, module.parameters())
    np.testing.assert_allclose(solution.inputs, np.column_stack([np.full(N, 0.3), np.cos(solution.t)]), rtol=1e-15)
    for k in (0, 7, N - 1):
        q, u, t = solution.q[k], solution.u[k], solution.t[k]
        np.testing.assert_allclose(solution.energies[k], module.energy(q, u, None, t), rtol=1e-13)
        assert solution.energy[k] == pytest.approx(solution.energies[k].sum())
        for name, value in module.outputs(t, solution.x[k], None, solution.inputs[k]).items():
            np.testing.assert_allclose(solution.outputs[name][k], value, rtol=1e-12, atol=1e-14)
    np.testing.assert_allclose(np.gradient(solution.outputs["tip"], solution.t, axis=0)[5], solution.outputs["tip_velocity"][5],
                               rtol=1e-2, atol=2e-2)


def test_about_the_run(solution: Any) -> None:
    assert solution.n_steps > 3 and solution.nfev > 11 * solution.n_steps and solution.seconds > 0
    assert solution.status == 0 and solution.backend == solution.module.backend
    text = repr(solution)
    assert text.startswith("<Solution of kitchen_sink: 21 times to t = 0.2 s, ") and "reached the end" in text


def test_round_trip_npz(solution: Any, tmp_path: Path) -> None:
    path = solution.save(tmp_path / "run.npz")
    assert path == tmp_path / "run.npz"
    with np.load(path, allow_pickle=False) as kept:
        for name in ("t", "x", "q", "u", "z", "params", "inputs", "energy"):
            np.testing.assert_array_equal(kept[name], getattr(solution, name))
        for name, value in solution.outputs.items():
            np.testing.assert_array_equal(kept[f"output_{name}"], value)
        about = json.loads(str(kept["about"]))
    assert about["name"] == "kitchen_sink" and tuple(about["x"]) == solution.module.metadata.x and about["success"] is True
    assert tuple(about["parameters"]) == solution.module.metadata.parameters and about["units"]["q1"] == "m"


def test_round_trip_csv(solution: Any, tmp_path: Path) -> None:
    solution.save(str(tmp_path / "run.csv"))
    with (tmp_path / "run.csv").open(newline="", encoding="utf-8") as file:
        rows = list(csv.reader(file))
    inputs = solution.module.metadata.inputs
    assert rows[0] == ["t", *solution.module.metadata.x, *inputs, "tip_1", "tip_2", "tip_3", "tip_velocity_1",
                       "tip_velocity_2", "tip_velocity_3", "smooth", "pair_1", "pair_2"]
    numbers = np.array(rows[1:], dtype=float)  # the digits read back as the same doubles
    np.testing.assert_array_equal(numbers[:, 0], solution.t)
    np.testing.assert_array_equal(numbers[:, 1:9], solution.x)
    np.testing.assert_array_equal(numbers[:, 9:9 + len(inputs)], solution.inputs)
    np.testing.assert_array_equal(numbers[:, 9 + len(inputs):12 + len(inputs)], solution.outputs["tip"])
    np.testing.assert_array_equal(numbers[:, -2:], solution.outputs["pair"])


def test_other_endings(solution: Any, tmp_path: Path) -> None:
    for name in ("run.txt", "run", "run.npy"):
        with pytest.raises(ArgumentError, match=f"cannot save to {name}: the ending must be .npz or .csv"):
            solution.save(tmp_path / name)
    assert not list(tmp_path.iterdir())


def test_by_name(solution: Any) -> None:
    q2, F = sd.coordinates("q2"), sd.inputs("F")
    np.testing.assert_array_equal(solution["q2"], solution.q[:, 1])
    np.testing.assert_array_equal(solution[q2.dot], solution.u[:, 1])
    np.testing.assert_array_equal(solution[F], solution.inputs[:, 0])
    np.testing.assert_array_equal(solution["pair"], solution.outputs["pair"])
    with pytest.raises(ArgumentError, match="the solution has no 'q22'; did you mean q2"):
        solution["q22"]


def test_without_outputs_or_inputs(compiled: Callable[..., Any], tmp_path: Path) -> None:
    solution = compiled("pendulum", "numpy").simulate((0, 0.1))
    assert solution.outputs == {} and solution.inputs.shape == (1001, 0) and solution.z.shape == (1001, 0)
    solution.save(tmp_path / "run.csv")
    assert (tmp_path / "run.csv").read_bytes().split()[:2] == [b"t,q1,q1_dot", b"0.0,2.0,0.0"]


def test_energy_error_is_relative_to_the_motion(compiled: Callable[..., Any]) -> None:
    module = compiled("pendulum", "numpy")
    solution = module.simulate((0, 2), rtol=1e-5)
    kinetic, potential = solution.energies.T
    scale = max(kinetic.max(), np.ptp(potential))
    assert solution.energy_error() == pytest.approx(np.abs(solution.energy - solution.energy[0]).max() / scale)
    assert module.simulate((0, 1), q=[0.0]).energy_error() == 0.0  # at rest: no motion to compare with


def test_nothing_computed_yet(compiled: Callable[..., Any], tmp_path: Path) -> None:
    """Interrupted before the first step: everything is there, with no times."""
    pressed: list[float] = []

    def press(t: float, x: np.ndarray) -> list[float]:
        if not pressed:
            pressed.append(t)
            raise KeyboardInterrupt
        return [0.0, 0.0]

    with pytest.raises(SimulationInterrupted) as caught:
        compiled("driven_oscillator", "c").simulate((0, 1), inputs=press)
    solution = caught.value.solution
    assert len(solution.t) == len(solution.x) <= 1 and solution.energies.shape == (len(solution.t), 2)
    assert "interrupted" in repr(solution)


def test_files_of_a_run_that_stopped_early(compiled: Callable[..., Any], tmp_path: Path) -> None:
    with pytest.warns(SimulationWarning):
        solution = compiled("driven_oscillator", "numpy").simulate((0, 50), max_steps=5)
    with np.load(solution.save(tmp_path / "part.npz")) as kept:
        about = json.loads(str(kept["about"]))
        assert about["success"] is False and about["message"] == solution.message
        np.testing.assert_array_equal(kept["t"], solution.t)
