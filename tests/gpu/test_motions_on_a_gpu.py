"""Motions on a device: the kernel's text as C on a device of this processor, against those of simulate_batch, and as machine code
of a GPU; the driver's calls on a driver that computes on this processor."""

from __future__ import annotations

import ctypes
import functools
import itertools
import os
import re
import shutil
import signal
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sympy as sp
from host_device import HostDevice, Lockstep, compiled

import symdyn as sd
from symdyn.backend.right_side import RightSide
from symdyn.cli import main
from symdyn.ensembles.sweep_file import read_sweep
from symdyn.errors import (
    ArgumentError,
    CompileError,
    EnsembleStopped,
    EvaluationError,
    MissingExtra,
    SimulationInterrupted,
    SimulationWarning,
)
from symdyn.lab import gpu
from symdyn.runtime.building import cache
from symdyn.runtime.building.compiler import require_compiler
from symdyn.runtime.gpu import compiling, device, motions
from symdyn.runtime.gpu.motions import Motions
from symdyn.runtime.solutions.states_only import NOT_KEPT
from tests.helpers import swept
from tests.runtime.constrained import module as constrained

HERE = Path(__file__).parent


def swings(n: int) -> dict[str, Any]:
    """Motions of different lengths of a double pendulum."""
    rng = np.random.default_rng(3)
    return {"q": {"q1": rng.uniform(-2, 2, n), "q2": 0.2}, "params": {"m2": rng.uniform(0.5, 3, n)}}


def same(a: Any, b: Any) -> None:
    """Two batches of motions agree to the last bit, steps included."""
    assert np.array_equal(a.x, b.x, equal_nan=True)
    assert np.array_equal(a.n_steps, b.n_steps) and np.array_equal(a.n_rejected, b.n_rejected)
    assert np.array_equal(a.success, b.success)


# -- against the processor


@pytest.mark.parametrize("t", [(0, 2), [0, 0.5, 0.7, 2]])
def test_motions_are_those_of_the_processor(host: HostDevice, t: Any) -> None:
    module, asked = compiled("double_pendulum"), swings(100)
    there = module.simulate_batch(**asked, t=t, device="gpu")
    same(there, module.simulate_batch(**asked, t=t))
    assert there.width == 8 and "a processor, 8 at once" in there.note
    assert host.closed and not host.blocks


def test_chunks_are_begun_before_the_ones_before_are_copied_back(host: HostDevice) -> None:
    compiled("double_pendulum").simulate_batch(**swings(200), t=(0, 1), device="gpu")
    works = [what for what in host.log if what[0] in ("begin", "end")]
    assert [n for what, n in works if what == "begin"] == [32] * 6 + [8]
    # Two are under way at any time, but for the first and the last one.
    under_way = np.cumsum([1 if what == "begin" else -1 for what, _ in works])
    assert under_way.max() == 2 and (under_way[1:-1] >= 1).all() and under_way[-1] == 0


def uneven(n: int) -> dict[str, Any]:
    """Double pendulums of lengths from 1 cm to 1 m, whose motions differ by a factor of ten in their steps."""
    lengths = 10 ** np.random.default_rng(1).uniform(-2, 0, n)
    return {"q": {"q1": 1.0, "q2": 0.2}, "params": {"l1": lengths, "lc1": lengths, "lc2": lengths}, "t": [0, 4, 8]}


def in_warps(monkeypatch: pytest.MonkeyPatch, threads: int = 256) -> Lockstep:
    made = Lockstep(threads)
    monkeypatch.setattr(device, "open_device", lambda number, owner: made)
    return made


@pytest.mark.parametrize(("rounds", "kept", "gathered"), [(1, 1.9, 1.35), (2, 1.5, 1.15), (4, 1.2, 1.08)])
def test_motions_that_are_left_are_gathered_in_few_warps(monkeypatch: pytest.MonkeyPatch, rounds: int, kept: float,
                                                         gathered: float) -> None:
    """Steps that warps have room for, 32 a round, compared with those of all motions; for each thread so many motions."""
    module, asked = compiled("double_pendulum"), uneven(rounds * 256)
    here = module.simulate_batch(**asked)
    steps = here.n_steps + here.n_rejected
    assert 8 < steps.max() / steps.min() < 12
    regrouped, room = in_warps(monkeypatch), 32 / steps.sum()
    same(module.simulate_batch(**asked, device="gpu"), here)
    assert regrouped.launches[0] == rounds * 256 and len(regrouped.launches) > 4
    assert all(256 >= a >= b for a, b in itertools.pairwise(regrouped.launches[1:]))
    assert regrouped.rounds[0] * room < gathered and not regrouped.blocks
    # Where there is no memory for motions that are put down, threads keep theirs, and warps wait for the longest one.
    monkeypatch.setattr(motions, "SHARE_PUT", 0.0)
    plain = in_warps(monkeypatch)
    same(module.simulate_batch(**asked, device="gpu"), here)
    assert plain.launches == [rounds * 256] and plain.rounds[0] * room > kept
    assert plain.rounds[1] == regrouped.rounds[1]  # the same attempts of threads


@pytest.mark.parametrize(("name", "more"), [
    ("double_pendulum", {"method": "radau"}), ("double_pendulum", {"method": "gauss"}), ("double_pendulum", {"method": "taylor"}),
    ("double_pendulum", {"method": "bs54"}), ("cart_pole", {"inputs": True}), ("four_bar", {}), ("ball", {})])
def test_motions_that_are_put_down_go_on_to_the_same_bits(monkeypatch: pytest.MonkeyPatch, name: str,
                                                          more: dict[str, Any]) -> None:
    module = ball(True) if name == "ball" else compiled(name)
    monkeypatch.setattr(motions, "TURN", 2)
    first = {"ball": {"q": {"y": np.linspace(1, 2, 40)}},
             "four_bar": {"params": {module.metadata.parameters[0]: module.default_parameters[0] * np.linspace(1, 1.1, 40)}}}
    asked: dict[str, Any] = {**first.get(name, {"q": {module.metadata.q[-1]: np.linspace(0.1, 1, 40)}}), **more,
                             "t": [0, 0.3, 3 if name == "ball" else 0.5]}
    if "inputs" in more:
        asked["inputs"] = {module.metadata.inputs[0]: ([0.0, 0.2, 0.5], [0.0, 3.0, -2.0])}
    regrouped = in_warps(monkeypatch)
    there = module.simulate_batch(**asked, device="gpu")
    assert len(regrouped.launches) > 2 and there.success.any()
    same(there, module.simulate_batch(**asked))


@pytest.mark.parametrize("begun", [False, True])
def test_an_interrupt_between_turns_keeps_the_motions_of_the_chunk(monkeypatch: pytest.MonkeyPatch, begun: bool) -> None:
    """Also one that comes after a turn has begun and before that is known."""
    module, asked = compiled("double_pendulum"), uneven(256)
    regrouped = in_warps(monkeypatch)
    launch, left = regrouped.launch, iter([False, False, False, True])

    def interrupted(*arguments: Any) -> None:
        stop = next(left, False)
        if begun or not stop:
            launch(*arguments)
        if stop:
            raise KeyboardInterrupt

    monkeypatch.setattr(regrouped, "launch", interrupted)
    with pytest.raises(SimulationInterrupted, match="interrupted after 256 of 256 motions") as caught:
        module.simulate_batch(**asked, device="gpu")
    same(caught.value.solution, module.simulate_batch(**asked))
    assert not regrouped.blocks and next(left, None) is None


def test_memory_of_the_device_is_bounded(host: HostDevice) -> None:
    module, asked = compiled("double_pendulum"), swings(300)
    host.memory = 60_000
    there = module.simulate_batch(**asked, t=np.linspace(0, 1, 11), device="gpu")
    same(there, module.simulate_batch(**asked, t=np.linspace(0, 1, 11)))
    assert 0.5 * host.memory < host.most <= 0.8 * host.memory
    # Stacks of threads are of the same memory.
    host.most, host.stack = 0, 3_000
    less = module.simulate_batch(**asked, t=np.linspace(0, 1, 11), device="gpu")
    same(less, there)
    assert host.most + 8 * host.stack <= 0.8 * host.memory < host.most + 8 * host.stack + 12_000
    assert less.note.endswith(" of its memory, 24 kB (24000 bytes) of these for stacks of threads") and "stacks" not in there.note
    host.stack = 6_000
    with pytest.raises(ArgumentError, match=r"which two motions with 11 output times take .*, 48 kB \(48000 bytes\) of these for "
                                            r"stacks of threads; ask for fewer output times, or free some"):
        module.simulate_batch(**asked, t=np.linspace(0, 1, 11), device="gpu")
    host.memory, host.stack = 3_000, 0
    with pytest.raises(ArgumentError, match=r"a processor has 3 kB \(3000 bytes\) of free memory, of which two motions with 11"):
        module.simulate_batch(**asked, t=np.linspace(0, 1, 11), device="gpu")


@pytest.mark.parametrize("name", swept(["four_bar", "rolling_disc", "floating_crane"], "four_bar", "rolling_disc"))
def test_constrained_and_floating_mechanisms(host: HostDevice, name: str) -> None:
    module = compiled(name)
    rng, names = np.random.default_rng(1), module.metadata.parameters
    masses = [n for n in names if n.startswith("m")][:1]
    params = {n: module.default_parameters[names.index(n)] * rng.uniform(1, 1.2, 5) for n in masses}
    asked: dict[str, Any] = {"params": params} if params else {"u": {module.metadata.u[-1]: rng.uniform(0, 0.01, 5)}}
    asked["t"] = (0, 0.3)
    events = {"events": False} if module.metadata.events else {}
    there, here = module.simulate_batch(**asked, **events, device="gpu"), module.simulate_batch(**asked, **events)
    assert here.success.all() and there.success.all()
    assert np.abs(there.x - here.x).max() <= 1e-12 * np.abs(here.x).max()
    assert np.array_equal(there.n_steps, here.n_steps)


def test_other_pairs_and_inputs_by_tables(host: HostDevice) -> None:
    module = compiled("cart_pole")
    name = module.metadata.inputs[0]
    table = ([0.0, 0.4, 1.0], [0.0, 3.0, -2.0])
    angles = {module.metadata.q[1]: np.linspace(0.1, 1, 7)}
    asked: dict[str, Any] = {"q": angles, "inputs": {name: table}, "t": np.linspace(0, 1, 5)}
    there, here = module.simulate_batch(**asked, device="gpu"), module.simulate_batch(**asked)
    same(there, here)
    by_bs54 = module.simulate_batch(**asked, method="bs54", device="gpu")
    same(by_bs54, module.simulate_batch(**asked, method="bs54"))
    assert not np.array_equal(by_bs54.n_steps, there.n_steps)


@functools.cache
def ball(stops: bool) -> Any:
    """A ball that loses a part of its speed at the floor, and may stop the motion where it comes up to 1.5 m."""
    y: Any = sd.coordinates("y")
    m, e = sd.parameters("m e")
    system = sd.System("ball", gravity=[0, -10, 0])
    system.add_joint(sd.Prismatic("j", system.ground, system.add_body("b", mass=m), y, axis=[0, 1, 0]))
    system.add_event("floor", y, direction=-1, reset={y.dot: -e * y.dot})
    if stops:
        system.add_event("top", y - 1.5, direction=1, stop=True)
    system.defaults = {m: 1, e: 0.8}
    return system.embedding().compile(backend="c")


@pytest.mark.parametrize("t", [(0, 2), [0, 0.5, 0.7, 2]])
def test_events_with_resets_and_stops(host: HostDevice, t: Any) -> None:
    starts: dict[str, Any] = {"q": {"y": np.linspace(0.2, 1.4, 23)}, "u": {"y_dot": np.linspace(-6, 3, 23)}, "t": t}
    there, here = ball(True).simulate_batch(**starts, device="gpu"), ball(True).simulate_batch(**starts)
    same(there, here)
    assert here.success.all() and host.log and "8 at once" in there.note
    high = ball(False).simulate_batch(**starts)
    assert not np.array_equal(high.x, here.x, equal_nan=True)
    same(ball(False).simulate_batch(**starts, device="gpu"), high)


def test_motions_with_doubtful_events_go_on_on_the_processor(host: HostDevice) -> None:
    x: Any = sd.coordinates("x")
    system = sd.System("thrown")
    system.add_joint(sd.Prismatic("j", system.ground, system.add_body("b", mass=1), x, axis=[1, 0, 0]))
    system.add_event("blur", sp.sin(100000 * sd.t * x) + sp.cos(100000 * sd.t * x) + sp.Rational(1414215, 1000000))
    module = system.embedding().compile(backend="c")
    with pytest.warns(SimulationWarning, match="of 3 motions 1: thrown: zeros of events may be missed: blur"):
        there = module.simulate_batch({"x": [0.0, 1.0, 0.0]}, t=(0, 10), device="gpu")
    assert there.success.all() and there.note.startswith("1 of 3 motions one by one: quantities of their events vary too quickly")


@pytest.mark.parametrize("method", ["radau", "radau5", "gauss", "taylor"])
def test_implicit_methods_and_series(host: HostDevice, method: str) -> None:
    module, asked = compiled("double_pendulum"), swings(20)
    there = module.simulate_batch(**asked, t=[0, 0.2, 0.5], method=method, device="gpu")
    same(there, module.simulate_batch(**asked, t=[0, 0.2, 0.5], method=method))
    plain = module.simulate_batch(**asked, t=[0, 0.2, 0.5])
    assert host.log and not np.array_equal(there.x, plain.x) and np.abs(there.x - plain.x).max() < 1e-6


def row_of_masses(n: int) -> sd.System:
    """Masses on a rail between two walls, with a damper and a spring that stiffens between each of them and the next."""
    k, d, m = sd.parameters("k d m")
    x: Any = [sd.coordinates(f"x{i}") for i in range(n)]
    system = sd.System("row")

    def pull(other: Any, own: Any) -> Any:
        stretch = other - own
        return k * stretch * (1 + stretch**2) + d * ((other.dot if other else 0) - own.dot)

    for i, own in enumerate(x):
        rail = system.add_joint(sd.Prismatic(f"rail{i}", system.ground, system.add_body(f"b{i}", mass=m), own, axis=[1, 0, 0]))
        system.add_joint_force(rail, sum(pull(other, own) for other in (x[i - 1] if i else 0, x[i + 1] if i + 1 < n else 0)))
    system.defaults, system.initial = {k: 1e4, d: 10, m: 1}, {x[0]: 0.1}
    return system


def test_factors_in_a_band(host: HostDevice) -> None:
    """Factors of masses with dampers of different sizes; their tables are code of a GPU, too."""
    module = row_of_masses(8).embedding().compile(backend="c")
    asked = {"params": {"d": np.linspace(5.0, 30.0, 3)}, "t": [0, 0.005, 0.01], "method": "radau5"}
    there = module.simulate_batch(**asked, device="gpu")
    same(there, module.simulate_batch(**asked))
    unit: Any = module.library(RightSide(method="radau5", threads=True))
    assert host.log and there.success.all() and "static const int symdyn_sequence[16]" in unit.source
    pytest.importorskip("cuda.bindings")
    code, printed = compiling.ptx(unit.source, "row", "compute_90")
    assert b".entry row_motions(" in code and not printed


def test_what_has_no_series_goes_on_on_the_processor(host: HostDevice) -> None:
    """Turning points of a loop, where dependent speeds do not follow."""
    module = constrained("bricard")
    asked: dict[str, Any] = {"t": np.linspace(0, 10, 5), "method": "taylor", "rtol": 1e-12}
    there = module.simulate_batch(**asked, device="gpu")
    same(there, module.simulate_batch(**asked))
    assert there.note.startswith("1 of 1 motions one by one: there is no Taylor series of some of their states")


def test_what_fails_is_reported_and_the_others_run_on(host: HostDevice) -> None:
    module = compiled("double_pendulum")
    asked: dict[str, Any] = {"q": {"q1": [0.1, np.nan, 0.3, 0.2]}, "params": {"m2": [1.0, 1.0, -1.0, 2.0]}, "t": [0, 1, 2]}
    with pytest.warns(SimulationWarning, match="2 of 4 motions failed: 1: .*start is not finite: q1; 2: .*m2"):
        there = module.simulate_batch(**asked, device="gpu")
    with pytest.warns(SimulationWarning, match="2 of 4 motions failed"):
        here = module.simulate_batch(**asked)
    same(there, here)
    assert there.messages == here.messages and np.isnan(there.x[1:3]).all()


@pytest.fixture(scope="module")
def burst() -> Any:
    """A force that grows beyond all bounds at t = 1/k."""
    x: Any = sd.coordinates("x")
    k, m = sd.parameters("k m")
    system = sd.System("burst")
    joint = system.add_joint(sd.Prismatic("j", system.ground, system.add_body("b", mass=m), x, axis=[1, 0, 0]))
    system.add_joint_force(joint, 1 / (1 - k * sd.t) ** 2)
    system.defaults = {k: 1, m: 1}
    return system.embedding().compile(backend="c")


def test_motions_that_stop_early_keep_what_they_reached(host: HostDevice, burst: Any) -> None:
    asked: dict[str, Any] = {"params": {"k": [0.1, 2.0, 0.2], "m": [1.0, 1.0, 0.0]}, "t": [0, 0.25, 0.4, 1]}
    with pytest.warns(SimulationWarning, match="2 of 3 motions failed: 1: .*the step became too small"):
        there = burst.simulate_batch(**asked, device="gpu")
    with pytest.warns(SimulationWarning, match="2 of 3 motions failed"):
        here = burst.simulate_batch(**asked)
    same(there, here)
    assert there.messages == here.messages and np.isfinite(there.x[1, :3]).all() and np.isnan(there.x[1, 3]).all()


def test_euler_parameters_keep_their_length(host: HostDevice) -> None:
    system = sd.System("top", gravity=[0, 0, -9.81])
    body = system.add_body("b", mass=1, inertia=[0.2, 0.3, 0.4])
    system.add_joint(sd.Spherical("s", system.ground, body, orientation=sd.EulerParameters(), child_point=[0, 0, 1]))
    module = system.embedding().compile(backend="c")
    asked: dict[str, Any] = {"u": {module.metadata.u[2]: np.linspace(1, 20, 6)}, "t": (0, 3)}
    there = module.simulate_batch(**asked, device="gpu")
    same(there, module.simulate_batch(**asked))
    assert np.abs(np.sum(there.q[:, -1] ** 2, axis=1) - 1).max() < 1e-15


def test_long_motions_go_on_on_the_processor(host: HostDevice, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(motions, "MOST_STEPS", 20)
    module, asked = compiled("double_pendulum"), swings(12)
    there, here = module.simulate_batch(**asked, t=(0, 2), device="gpu"), module.simulate_batch(**asked, t=(0, 2))
    same(there, here)
    assert "motions one by one: they took more than" in there.note


def test_an_interrupt_keeps_what_is_done(host: HostDevice, monkeypatch: pytest.MonkeyPatch) -> None:
    begun = host.launch
    count = iter(range(10))

    def launch(*arguments: Any) -> None:
        if next(count) == 3:
            raise KeyboardInterrupt
        begun(*arguments)

    monkeypatch.setattr(host, "launch", launch)
    with pytest.raises(SimulationInterrupted, match="interrupted after 96 of 200 motions") as caught:
        compiled("double_pendulum").simulate_batch(**swings(200), t=(0, 1), device="gpu")
    solution: Any = caught.value.solution
    assert solution.success.sum() == 96 and host.closed and not host.blocks


def test_ensembles_and_sweep_files(host: HostDevice, tmp_path: Path) -> None:
    module = compiled("double_pendulum")
    drawn = sd.Samples({"q1": {"from": -1, "to": 1}}, count=64, seed=2)
    on_gpu = sd.ensemble(module, drawn, (0, 1), ["end q1", "max q2", "mean energy"], device="gpu")
    here = sd.ensemble(module, drawn, (0, 1), ["end q1", "max q2", "mean energy"])
    for label in ("end q1", "max q2", "mean energy"):
        assert np.array_equal(on_gpu[label], here[label])
    assert host.log
    file = tmp_path / "swings.toml"
    file.write_text('system = "double_pendulum"\ndevice = "gpu:1"\n[initial]\nq1 = [0.1, 0.2]\n')
    faults: list[str] = []
    assert read_sweep(file, faults).arguments(module)["device"] == "gpu:1" and not faults


def test_functions_get_what_is_known_on_a_device(host: HostDevice) -> None:
    """The rest raises, before any motion is computed."""
    module, drawn = compiled("double_pendulum"), {"q1": np.linspace(-1, 1, 6)}
    known = {"far": lambda sol: np.abs(sol.q).max(axis=0), "energy": lambda sol: sol.energy[-1], "steps": lambda sol: sol.n_steps,
             "bs54": lambda sol: float(sol.method == "bs54"), "rtol": lambda sol: sol.tolerances[0],
             "mass": lambda sol: sol.params[0], "momentum": lambda sol: sol.rows("mass_matrix")[-1] @ sol.u[-1]}
    there = sd.ensemble(module, drawn, (0, 1), known, method="bs54", rtol=1e-6, device="gpu")
    here = sd.ensemble(module, drawn, (0, 1), known, method="bs54", rtol=1e-6)
    assert there.n_failed == here.n_failed == 0 and (here["bs54"] == 1).all() and (here["rtol"] == 1e-6).all()
    for label in known:
        assert np.array_equal(there[label], here[label]), label
    host.log.clear()
    for name in NOT_KEPT:
        with pytest.raises(ArgumentError, match=f"{name} is not known of a motion that was integrated together with others; "
                                                "there are t, x, params, .*; leave device out, so that functions get motions"):
            sd.ensemble(module, drawn, (0, 1), {"it": lambda sol, name=name: getattr(sol, name)}, device="gpu")
    with pytest.raises(ArgumentError, match="states at any time need a motion that simulate has integrated"):
        sd.ensemble(module, drawn, (0, 1), {"it": lambda sol: sol(np.linspace(0, 1, 5))}, device="gpu")
    assert not host.log
    wrong = sd.ensemble(module, drawn, (0, 1), {"it": lambda sol: sol.nothing}, device="gpu")
    assert "'StatesOnly' has no attribute 'nothing'" in wrong.failures()[0]["message"]


def test_gpus_of_a_machine_share_a_folder(host: HostDevice, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    opened: list[int] = []
    monkeypatch.setattr(device, "open_device", lambda number, owner: opened.append(number) or host)
    module, drawn = compiled("double_pendulum"), {"q1": np.linspace(-1, 1, 24)}

    def computes(which: str, **more: Any) -> Any:
        return sd.ensemble(module, drawn, (0, 1), ["end q1"], chunk=3, path=tmp_path / "a", device=which, **more)

    def both() -> Any:
        with ThreadPoolExecutor(2) as pool:
            return [one.result() for one in [pool.submit(computes, which, shared=True) for which in ("gpu", "gpu:1")]]

    first, second = both()
    assert set(opened) == {0, 1} and first.count == second.count == 24
    again = computes("gpu:2", resume=True)
    assert again.n_resumed == 24 and 2 not in opened
    assert np.array_equal(again["end q1"], sd.ensemble(module, drawn, (0, 1), ["end q1"])["end q1"])


def test_what_a_device_lacks_is_not_computed_on_the_processor(host: HostDevice, tmp_path: Path) -> None:
    """Without a word it would take a hundred times as long."""
    module, drawn = compiled("double_pendulum"), {"q1": np.linspace(-1, 1, 24)}
    host.memory = 3_000
    with pytest.raises(EnsembleStopped, match=r"tried 3 times: NoDevice: double_pendulum: a processor has 3 kB .* ask for fewer"):
        sd.ensemble(module, drawn, np.linspace(0, 1, 11), device="gpu")
    host.memory = 2**30
    kept: Any = host.launch
    host.launch = lambda *given: (_ for _ in ()).throw(device.DeviceFailed("the CUDA driver's cuLaunchKernel failed"))  # type: ignore
    with pytest.raises(EnsembleStopped, match="tried 3 times: DeviceFailed: the CUDA driver's cuLaunchKernel failed"):
        sd.ensemble(module, drawn, (0, 1), device="gpu", path=tmp_path / "a")
    host.launch = kept  # type: ignore[method-assign]
    assert sd.ensemble(module, drawn, (0, 1), device="gpu", path=tmp_path / "a", resume=True).n_failed == 0


def test_an_inconsistent_start_is_a_failure_with_what_to_do(host: HostDevice) -> None:
    module = compiled("four_bar")
    first, angle = module.metadata.x[0], module.consistent()[0][0]
    done = sd.ensemble(module, {first: [angle, angle + 0.3]}, (0, 0.05), device="gpu")
    assert done.failed.tolist() == [False, True]
    assert done.failures()[0]["message"].endswith("consistent=True, in a sweep file consistent = true, and leave device out")


KILLED = """
import os, signal, sys
sys.path.insert(0, {here!r})
from host_device import HostDevice, Lockstep, compiled
import symdyn as sd
from symdyn.runtime.gpu import device

class Mortal(HostDevice):
    launches = 0

    def launch(self, *arguments):
        Mortal.launches += 1
        if Mortal.launches == {last}:  # two parts of a chunk are under way
            os.kill(os.getpid(), signal.SIGKILL)
        super().launch(*arguments)

device.open_device = lambda number, owner: Mortal(threads=2)
drawn = sd.Samples({{"q1": {{"from": -1, "to": 1}}}}, count=400, seed=2)
sd.ensemble(compiled("double_pendulum"), drawn, (0, 0.3), ["end q1", "max q2"], chunk=50, path={path!r}, device="gpu")
"""


@pytest.mark.skipif(os.name != "posix", reason="kill -9 is of POSIX")
@pytest.mark.parametrize("last", swept([1, 20, 37], 20))
def test_a_run_that_is_killed_goes_on_to_the_same_file(host: HostDevice, tmp_path: Path, last: int) -> None:
    module, drawn = compiled("double_pendulum"), sd.Samples({"q1": {"from": -1, "to": 1}}, count=400, seed=2)
    whole = sd.ensemble(module, drawn, (0, 0.3), ["end q1", "max q2"], chunk=50, path=tmp_path / "whole", device="gpu")
    path = tmp_path / "part"
    done = subprocess.run([sys.executable, "-c", KILLED.format(here=str(HERE), last=last, path=str(path))], check=False,
                          capture_output=True, text=True)
    assert done.returncode == -signal.SIGKILL, done.stderr
    there = len(list((path / "chunks").glob("0*.npz")))
    # A chunk takes seven launches; those that were computed may not have been written yet.
    assert 0 <= (last - 1) // 7 - there <= 3 and not (path / "ensemble.npz").exists()
    again = sd.ensemble(module, drawn, (0, 0.3), ["end q1", "max q2"], path=path, device="gpu:1", resume=True)
    assert again.n_resumed == 50 * there and again.n_failed == 0
    assert again.file.read_bytes() == whole.file.read_bytes()
    here = sd.ensemble(module, drawn, (0, 0.3), ["end q1", "max q2"])
    assert np.array_equal(again["max q2"], here["max q2"])


# -- what a device does not take


def test_bad_devices() -> None:
    module = compiled("double_pendulum")
    wrong: Any
    for wrong in ("cuda", "gpu:", "gpu:-1", 0, "gpu:x"):
        with pytest.raises(ArgumentError, match="device must be 'cpu', 'gpu', or 'gpu:1' for the second one, found"):
            module.simulate_batch(t=(0, 1), device=wrong)
        with pytest.raises(ArgumentError, match="device must be"):
            sd.ensemble(module, {"q1": [0.1]}, (0, 1), device=wrong)


@pytest.mark.skipif(shutil.which("nvidia-smi") is not None, reason="there may be a GPU")
def test_no_gpu() -> None:
    for ask in (lambda: compiled("double_pendulum").simulate_batch(t=(0, 1), device="gpu"),
                lambda: sd.ensemble(compiled("double_pendulum"), {"q1": [0.1]}, (0, 1), device="gpu")):
        with pytest.raises(ArgumentError, match=r"device='gpu' was asked for, but this machine has no CUDA device that answers "
                                                r"\(.*\); leave device out to compute on the processor"):
            ask()


def test_all_that_a_kernel_does_not_do_is_reported_at_once(host: HostDevice) -> None:
    module = compiled("double_pendulum")
    with pytest.raises(ArgumentError, match=r"does not take these motions: method='RK45'; kernels integrate by 'dop853' or "
                                            r"'bs54' or .*; max_steps, sensitivities: kernels have none of these\. Leave device"):
        module.simulate_batch(t=(0, 1), device="gpu", method="RK45", max_steps=10, sensitivities=["m2"])
    with pytest.raises(ArgumentError, match="inputs by functions of Python or controllers; give tables, splines or numbers"):
        driven = compiled("cart_pole")
        driven.simulate_batch(t=(0, 1), inputs={driven.metadata.inputs[0]: lambda t, x: 0.0}, device="gpu")
    with pytest.raises(ArgumentError, match="the backend of the module is numpy; kernels are made of its C"):
        sd.systems.pendulum().compile(backend="numpy").simulate_batch(t=(0, 1), device="gpu")
    with pytest.raises(ArgumentError, match="takes starts as they are; leave consistent out"):
        sd.ensemble(module, {"q1": [0.1]}, (0, 1), device="gpu", consistent=True)
    with pytest.raises(ArgumentError, match=r"method='gauss': .*corrections back onto constraints"):
        compiled("four_bar").simulate_batch(t=(0, 1), device="gpu", method="gauss")
    with pytest.raises(ArgumentError, match="keeps states at output times and no times of events; take outcomes of states"):
        sd.ensemble(ball(True), {"y": [1.0]}, (0, 1), ["end y"], device="gpu")
    with pytest.raises(ArgumentError, match="keeps states at output times and no times of events"):
        sd.ensemble(ball(False), {"y": [1.0]}, (0, 1), {"bounces": lambda sol: len(sol.events["floor"].t)}, device="gpu")


def test_a_sweep_from_the_command_line(host: HostDevice, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "swings.toml"
    file.write_text('system = "double_pendulum"\ndevice = "gpu"\nt = [0, 0.5]\noutcomes = ["end q1"]\n'
                    '[initial]\nq1 = [0.1, 0.2]\n')
    assert main(["sweep", str(file), "--no-picture", "--output", str(tmp_path / "out"), "--backend", "c"]) == 0
    assert "double_pendulum: 2 samples of q1" in capsys.readouterr().out and host.log


def test_missing_packages(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "cuda.bindings", None)
    with pytest.raises(MissingExtra, match=r"device='gpu' needs the package cuda-bindings: pip install 'symdyn\[gpu\]'"):
        compiled("double_pendulum").simulate_batch(t=(0, 1), device="gpu")
    with pytest.raises(MissingExtra, match="needs the packages cuda-bindings and nvidia-cuda-nvrtc"):
        compiling.nvrtc()


# -- as code of a GPU


@pytest.mark.parametrize(("name", "method"), swept([
    ("double_pendulum", "dop853"), ("double_pendulum", "bs54"), ("double_pendulum", "radau"), ("double_pendulum", "gauss"),
    ("double_pendulum", "taylor"), ("four_bar", "radau5"), ("ball", "dop853"), ("four_bar", "dop853"),
    ("floating_crane", "dop853"), ("ball", "radau")],
    ("double_pendulum", "radau"), ("double_pendulum", "gauss"), ("double_pendulum", "taylor"), ("ball", "dop853"),
    ("four_bar", "dop853")))
def test_kernels_compile_for_a_gpu(name: str, method: str) -> None:
    """Without a warning."""
    pytest.importorskip("cuda.bindings")
    module = ball(True) if name == "ball" else compiled(name)
    unit: Any = module.library(RightSide(method=method, threads=True))
    code, printed = compiling.ptx(unit.source, name, "compute_90")
    assert f".entry {unit.metadata.name}_motions(".encode() in code and b"fma.rn.f64" in code and not printed
    assert ("symdyn_search_step" in unit.source) == (name == "ball")


def test_the_stack_of_a_kernel_is_bounded(monkeypatch: pytest.MonkeyPatch) -> None:
    """A device sets the stack aside before a kernel begins: without recursion and without calls of addresses it is known."""
    pytest.importorskip("cuda.bindings")
    monkeypatch.setattr(compiling, "report", functools.cache(compiling.report))
    unit: Any = compiled("cart_pole").library(RightSide(threads=True))
    assert "->function(" not in unit.source
    printed = compiling.report(unit.source, "cart_pole", "sm_90")
    found = re.search(r"Used \d+ registers, .* (\d+) bytes cumulative stack size", printed)
    assert found is not None and 1000 < int(found[1]) < 10_000
    # The printed memory of a thread is what PTX declares, but for what two blocks may share.
    declared = sum(map(int, re.findall(rb"\.local \.align \d+ \.b8\s+\S+\[(\d+)\]",
                                       compiling.ptx(unit.source, "cart_pole", "compute_90")[0])))
    bytes_of_stack = gpu._resources(unit.source, "cart_pole")["bytes of stack"]
    assert 0.9 * declared < bytes_of_stack == int(found[1]) <= declared
    assert gpu._stacks({"bytes of stack": bytes_of_stack}) == bytes_of_stack * 132 * 2048


def test_a_text_for_devices_evaluates_nothing() -> None:
    unit: Any = compiled("cart_pole").library(RightSide(threads=True))
    with pytest.raises(EvaluationError, match="rhs cannot be evaluated by a kernel, which integrates motions only; evaluate"):
        unit.evaluator("rhs")


def test_what_is_no_cuda_is_reported_with_the_compilers_words() -> None:
    pytest.importorskip("cuda.bindings")
    with pytest.raises(CompileError, match=r"(?s)kernel of 'odd' does not compile for compute_90 .*\"there\" is undefined"):
        compiling.ptx("int f() { return there; }", "odd", "compute_90")


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="the driver of this test is a library of Linux")
def test_the_drivers_calls(tmp_path: Path) -> None:
    """A driver whose memory and kernels are this processor's stands in for CUDA's; machine code of a GPU is loaded, C is run."""
    pytest.importorskip("cuda.bindings")
    module = compiled("double_pendulum")
    unit: Any = module.library(RightSide(threads=True))
    compiling.cubin(unit.source, module.name, "sm_90")  # kept in the cache: the compiler looks for a driver, too
    driver = tmp_path / "libcuda.so.1"
    subprocess.run([*require_compiler().command, "-shared", "-fPIC", f"-DSIZE={ctypes.sizeof(Motions)}", "-o", str(driver),
                    str(HERE / "fake_driver.c"), "-ldl"], check=True)
    program = """
import ctypes, numpy as np, symdyn as sd
module = sd.systems.get("double_pendulum").compile(backend="c")
asked = {"q": {"q1": np.linspace(-1, 1, 9000), "q2": 0.2}, "t": (0, 1)}
there, here = module.simulate_batch(**asked, device="gpu"), module.simulate_batch(**asked)
assert np.array_equal(there.x, here.x) and there.success.all()
print(there.note)
x = np.random.default_rng(1).uniform(-1, 1, (9000, 4))
class There:
    def __dlpack__(self, stream):
        assert stream > 2  # no default stream
        return x[:, 1:3].__dlpack__()
    def __dlpack_device__(self):
        return 2, 0
class Interface:
    __cuda_array_interface__ = {"shape": (9000,), "typestr": "<f8", "strides": (32,), "version": 3, "stream": 1,
                                "data": (x.ctypes.data + 24, True)}
kept = module.simulate_batch(There(), {"q2_dot": Interface()}, t=(0, 0.1), device="gpu")
assert kept.x_on_device.__dlpack_device__() == (2, 0)
assert np.array_equal(kept.x, module.simulate_batch(x[:, 1:3], {"q2_dot": x[:, 3]}, t=(0, 0.1)).x)
del kept
counts = (ctypes.c_longlong * 4)()
ctypes.CDLL("libcuda.so.1").fake_counts(counts)
print(*counts)
try:
    module.simulate_batch(**asked, device="gpu:1")
except sd.ArgumentError as error:
    print(error)
"""
    environment = {**os.environ, "LD_LIBRARY_PATH": str(tmp_path),
                   "FAKE_KERNELS": str(cache.build(unit.source, module.name, require_compiler()))}
    done = subprocess.run([sys.executable, "-c", program], env=environment, capture_output=True, text=True, check=False)
    note, counts, error = done.stdout.splitlines()
    assert note.startswith("on Fake 0, 4096 at once, ") and not done.stderr
    assert note.endswith(", 12.6 MB (12648448 bytes) of these for stacks of threads")  # 3088 bytes of 4096 threads
    # Blocks, modules and streams are given back. Kernels: the size of a motion, all motions, the last one, which was
    # put down; the first two again.
    assert counts == "0 0 0 5"
    assert error == "double_pendulum: device='gpu:1' was asked for; there are 1, numbered from 0"
