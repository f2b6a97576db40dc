"""Sensitivities of many motions: batches and ensembles on every executor, with the bits of single motions."""

from __future__ import annotations

import pickle
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from functools import cache
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import trapezoid

import symdyn as sd
from symdyn.cli import main
from symdyn.ensembles.measures import Measure, take_measures
from symdyn.errors import ArgumentError, SimulationWarning
from symdyn.runtime.building.compiler import find_compiler
from symdyn.runtime.building.recall import recall

pytestmark = pytest.mark.skipif(find_compiler() is None, reason="no C compiler")
T = (0.0, 1.0)
BY = ["l1", "m2", "q1(0)"]
OUTCOMES = ["end q1", "grad end q1", "grad q2_dot at 0.5", "grad mean q2", "grad rms q1", "grad max q2_dot", "grad min q1",
            "grad start q1", "grad trace q1"]


@cache
def arm() -> Any:
    return recall("double_pendulum", {})


def samples(count: int = 12) -> Any:
    return sd.Samples({"l1": {"from": 0.5, "to": 1.5}, "m2": {"from": 0.5, "to": 2.0}, "q1": {"from": -1, "to": 1}}, count=count,
                      seed=2)


def test_a_batch_has_the_bits_of_single_motions() -> None:
    drawn = samples(5).block(0, 5)
    start, params, t = {"q1": drawn[:, 2]}, {"l1": drawn[:, 0], "m2": drawn[:, 1]}, np.linspace(0, 1, 7)
    whole = arm().simulate_batch(start, params=params, t=t, sensitivities=BY, rtol=1e-9)
    ends = arm().simulate_batch(start, params=params, t=T, sensitivities=BY, rtol=1e-9)
    assert whole.sensitivity.matrix.shape == (5, 7, 4, 3) and ends.sensitivity["m2"].shape == (5, 1, 4)
    for k, (l1, m2, q1) in enumerate(drawn):
        one = arm().simulate(t, {"q1": q1}, params={"l1": l1, "m2": m2}, sensitivities=BY, rtol=1e-9)
        assert np.array_equal(whole.sensitivity.matrix[k], one.sensitivity.matrix) and np.array_equal(whole.x[k], one.x)
        last = arm().simulate(T, {"q1": q1}, params={"l1": l1, "m2": m2}, sensitivities=BY, rtol=1e-9)
        assert np.array_equal(ends.sensitivity.matrix[k, 0], last.sensitivity.matrix[-1])
    assert np.array_equal(whole.sensitivity.of("q2"), whole.sensitivity.matrix[:, :, 1])
    assert list(whole.sensitivity) == BY and len(whole.sensitivity) == 3 and sd.parameters("m2") in whole.sensitivity
    assert repr(whole.sensitivity) == "<Sensitivity of 5 motions, 4 states at 7 times, by l1, m2, q1(0)>"
    assert np.array_equal(pickle.loads(pickle.dumps(whole)).sensitivity["l1"], whole.sensitivity["l1"])
    with pytest.raises(ArgumentError, match=r"double_pendulum: the motions have no sensitivity by 'm1'; there are l1, m2"):
        whole.sensitivity["m1"]
    with pytest.raises(ArgumentError, match="double_pendulum: there is no state 'q7'; there are q1"):
        whole.sensitivity.of("q7")
    with pytest.raises(ArgumentError, match=r"double_pendulum: these motions have no sensitivities; pass simulate_batch\("):
        _ = arm().simulate_batch(start, t=T).sensitivity


def test_motions_that_fail_have_none() -> None:
    with pytest.warns(SimulationWarning, match="2 of 2 motions failed"):
        found = arm().simulate_batch({"q1": [0.1, 0.2]}, t=np.linspace(0, 1, 3), sensitivities=["m2"], max_steps=3, rtol=1e-12)
    assert not found.success.any()
    assert np.isfinite(found.sensitivity.matrix[:, 0]).all() and np.isnan(found.sensitivity.matrix[:, -1]).all()


def test_outcomes_are_derivatives_of_outcomes() -> None:
    drawn = samples()
    found = sd.ensemble(arm(), drawn, T, OUTCOMES, rtol=1e-10)
    assert found.sensitivities == tuple(BY) and found["grad trace q1"].shape == (12, 1001, 3)
    for k, (l1, m2, q1) in enumerate(drawn.block(0, 12)):
        one = arm().simulate(np.unique([*np.linspace(0, 1, 1001), 0.5]), {"q1": q1}, params={"l1": l1, "m2": m2},
                             sensitivities=BY, rtol=1e-10)
        of, t = one.sensitivity.of, one.t
        y, dy = one["q1"], of("q1")
        for label, value in (
                ("end q1", y[-1]), ("grad end q1", dy[-1]), ("grad q2_dot at 0.5", of("q2_dot")[500]),
                ("grad mean q2", trapezoid(of("q2"), t, axis=0)), ("grad start q1", [0, 0, 1]), ("grad trace q1", dy),
                ("grad max q2_dot", of("q2_dot")[np.argmax(one["q2_dot"])]), ("grad min q1", dy[np.argmin(y)])):
            assert np.array_equal(found[label][k], value), label
        np.testing.assert_allclose(found["grad rms q1"][k], trapezoid(y[:, None] * dy, t, axis=0) / np.sqrt(trapezoid(y**2, t)),
                                   rtol=1e-13)


def test_derivatives_against_differences() -> None:
    h = 1e-6
    at = {"l1": 1.1, "m2": 0.7}
    texts = ["end q1", "rms q2", "max q2_dot", "mean q1"]
    exact = sd.ensemble(arm(), {name: [value] for name, value in at.items()}, T, [f"grad {text}" for text in texts], rtol=1e-12)
    for place, name in enumerate(at):
        around = {**{n: [v, v] for n, v in at.items()}, name: [at[name] - h, at[name] + h]}
        sides = sd.ensemble(arm(), around, T, texts, rtol=1e-12)
        for text in texts:
            difference = np.diff(sides[text])[0] / (2 * h)
            assert exact[f"grad {text}"][0, place] == pytest.approx(difference, rel=1e-6, abs=1e-7), text


def test_every_executor_gives_the_same_bytes(tmp_path: Path) -> None:
    """Bytes of outputs, too; other processes get the code as text."""
    system = sd.systems.get("double_pendulum")
    system.add_output("tip", sd.position(system.bodies[-1], [1, 0]))
    module = system.embedding().compile()
    outcomes = ["grad end q1", "grad end tip", "grad max tip", "grad trace tip"]
    here = sd.ensemble(module, samples(), np.linspace(0, 1, 5), outcomes, chunk=4, path=tmp_path / "here",
                       sensitivities=["l1", "q2(0)"])
    assert here["grad trace tip"].shape == (12, 5, 2, 2) and here.n_failed == 0 and here.sensitivities == ("l1", "q2(0)")
    with ThreadPoolExecutor(2) as threads, ProcessPoolExecutor(1, get_context("spawn")) as processes:
        for name, executor in (("threads", threads), ("processes", processes)):
            there = sd.ensemble(module, samples(), np.linspace(0, 1, 5), outcomes, chunk=4, path=tmp_path / name,
                                executor=executor, sensitivities=["l1", "q2(0)"])
            assert there.file.read_bytes() == here.file.read_bytes(), name


@pytest.mark.sweep
def test_dask_gives_the_same_bytes() -> None:
    distributed = pytest.importorskip("distributed")
    here = sd.ensemble(arm(), samples(), T, ["grad end q1"], chunk=4)
    with distributed.LocalCluster(n_workers=1, threads_per_worker=1, processes=True, dashboard_address=None,
                                  silence_logs=50) as cluster, cluster.get_client() as client:
        there = sd.ensemble(arm(), samples(), T, ["grad end q1"], chunk=4, executor=client.get_executor())
        assert there.file.read_bytes() == here.file.read_bytes()


def test_a_sweep_file_asks_for_derivatives(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "sweep.toml"
    file.write_text('system = "double_pendulum"\nt = [0, 1]\noutcomes = ["grad end q1"]\nsensitivities = ["l1", "g"]\n'
                    'output = "done"\n[parameters]\nl1 = {from = 0.5, to = 1.5, count = 3}\n')
    assert main(["sweep", str(file)]) == 0
    with np.load(tmp_path / "done" / "ensemble.npz") as archive:
        assert archive["grad end q1"].shape == (3, 2) and np.isfinite(archive["grad end q1"]).all()


def test_faults_are_listed_together() -> None:
    with pytest.raises(ArgumentError) as found:
        take_measures(["grad end q7", "grad max energy", "grad q1"], arm())
    for text in ("outcome 'grad end q7': there is no 'q7'", "outcome 'grad max energy': there are no derivatives of energy;",
                 "outcome 'grad q1': write one of start, end"):
        assert text in str(found.value)
    for call in (lambda by: arm().simulate(T, sensitivities=by), lambda by: arm().simulate_batch(t=T, sensitivities=by),
                 lambda by: sd.ensemble(arm(), samples(), T, ["grad end q1"], sensitivities=by)):
        with pytest.raises(ArgumentError) as found:
            call(["mm2", "q1", "l1", "l1"])
        for text in ("a sensitivity by 'mm2' was asked for, which is neither", "by q1 was asked for, which is a state",
                     "sensitivities name l1 twice"):
            assert text in str(found.value)
    with pytest.raises(ArgumentError, match="sensitivities were given, but no outcome is a derivative; write 'grad end q1'"):
        sd.ensemble(arm(), samples(), T, ["end q1"], sensitivities=["l1"])
    with pytest.raises(ArgumentError, match=r"none of 8 samples that were tried can be simulated; the first: .* only compiled"):
        sd.ensemble(arm(), samples(), T, ["grad end q1"], method="RK45")
    assert Measure("a", "end", "q1", grad=True).record() == "grad end q1"
