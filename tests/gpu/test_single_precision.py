"""Motions in single precision on a device: the kernel's text as C on a device of this processor, against doubles and closed
forms, and as code of a GPU."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from host_device import HostDevice, compiled
from scipy.special import ellipj, ellipk

import symdyn as sd
from symdyn.backend.right_side import RightSide
from symdyn.ensembles.sweep_file import read_sweep
from symdyn.errors import ArgumentError, SimulationWarning
from symdyn.runtime.gpu import compiling

EPS = 6e-8  # the rounding of single precision


def mover(force: Any = 0) -> Any:
    x: Any = sd.coordinates("x")
    system = sd.System("mover")
    joint = system.add_joint(sd.Prismatic("j", system.ground, system.add_body("b", mass=1), x, axis=[1, 0, 0]))
    system.add_joint_force(joint, force(x) if callable(force) else force)
    return system.embedding().compile(backend="c")


@pytest.mark.parametrize(("method", "roundings"), [("dop853", 12), ("bs54", 3)])
def test_sums_over_many_steps_are_compensated(host: HostDevice, method: str, roundings: int) -> None:
    """10,000 steps at a constant speed: sums of floats alone are off by some hundred roundings; weights of dop853 by some."""
    speeds = np.array([1.0, 0.3, 0.7])
    plain = np.float32(0)
    for _ in range(10_000):
        plain += np.float32(1e-4) * np.float32(0.7)
    there = mover().simulate_batch(u={"x_dot": speeds}, t=(0, 1), max_step=1e-4, rtol=1e-5, method=method, device="gpu",
                                   precision="single")
    assert (there.n_steps >= 10_000).all() and abs(plain - 0.7) > 100 * EPS
    assert np.abs(there["x"][:, 0] - speeds).max() < roundings * EPS


@pytest.mark.parametrize(("method", "bound"), [("dop853", 2e-4), ("bs54", 2e-5)])
def test_a_pendulum_against_elliptic_functions(host: HostDevice, method: str, bound: float) -> None:
    """sin(q/2) = k sn(K - w t, k), k = sin(q0/2), over some swings; times at the output are those of doubles."""
    module, q0 = compiled("pendulum"), np.linspace(0.2, 2, 9)
    values = dict(zip(module.metadata.parameters, module.parameters(), strict=True))
    w, times = np.sqrt(values["g"] / values["l"]), np.linspace(0, 5, 11)
    there = module.simulate_batch({"q1": q0}, t=times, rtol=1e-6, method=method, device="gpu", precision="single")
    m = np.sin(q0 / 2)[:, None] ** 2
    exact = 2 * np.arcsin(np.sqrt(m) * ellipj(ellipk(m) - w * times, m)[0])
    assert there.success.all() and np.array_equal(there.t, times) and there.x.dtype == float
    assert np.abs(there["q1"] - exact).max() < bound
    doubles = module.simulate_batch({"q1": q0}, t=times, rtol=1e-6, method=method, device="gpu")
    assert not np.array_equal(there.x, doubles.x)


def test_times_of_steps_and_of_tables_are_doubles(host: HostDevice) -> None:
    """An oscillator far from t = 0, where times in single precision would be 2e-3 s apart."""
    module = mover(lambda x: -x)
    begin = 30_000.0
    there = module.simulate_batch({"x": [1.0, 2.0]}, t=[begin, begin + 0.0007, begin + 1], rtol=1e-6, method="bs54", device="gpu",
                                  precision="single")
    exact = np.array([1.0, 2.0])[:, None] * np.cos([0, 0.0007, 1])
    assert np.abs(there["x"] - exact).max() < 2e-6


def test_inputs_by_tables_and_parameters(host: HostDevice) -> None:
    module = compiled("cart_pole")
    name = module.metadata.inputs[0]
    mass = module.metadata.parameters[0]
    asked: dict[str, Any] = {"q": {module.metadata.q[1]: np.linspace(0.1, 1, 20)}, "t": np.linspace(0, 1, 5), "rtol": 1e-6,
                             "inputs": {name: ([0.0, 0.4, 1.0], [0.0, 3.0, -2.0])}, "params": {mass: np.linspace(1, 2, 20)},
                             "method": "bs54"}
    host.memory = 22_000
    there, here = module.simulate_batch(**asked, device="gpu", precision="single"), module.simulate_batch(**asked)
    assert there.success.all() and np.abs(there.x - here.x).max() < 1e-5 * np.abs(here.x).max()
    assert host.most <= 0.8 * host.memory and len([n for what, n in host.log if what == "begin"]) > 2


def test_euler_parameters_keep_their_length(host: HostDevice) -> None:
    system = sd.System("top", gravity=[0, 0, -9.81])
    body = system.add_body("b", mass=1, inertia=[0.2, 0.3, 0.4])
    system.add_joint(sd.Spherical("s", system.ground, body, orientation=sd.EulerParameters(), child_point=[0, 0, 1]))
    module = system.embedding().compile(backend="c")
    asked: dict[str, Any] = {"u": {module.metadata.u[2]: np.linspace(1, 20, 6)}, "t": (0, 3), "rtol": 1e-6, "method": "bs54"}
    there, here = module.simulate_batch(**asked, device="gpu", precision="single"), module.simulate_batch(**asked)
    assert np.abs(np.sum(there.q[:, -1] ** 2, axis=1) - 1).max() < 4 * EPS
    assert np.abs(there.x - here.x).max() < 1e-4 * np.abs(here.x).max()


def test_what_fails_is_reported(host: HostDevice) -> None:
    module = compiled("double_pendulum")
    asked: dict[str, Any] = {"q": {"q1": [0.1, np.nan, 0.3]}, "params": {"m2": [1.0, 1.0, -1.0]}, "t": (0, 1), "rtol": 1e-5}
    with pytest.warns(SimulationWarning, match="2 of 3 motions failed: 1: .*start is not finite: q1; 2: .*m2"):
        there = module.simulate_batch(**asked, device="gpu", precision="single")
    assert there.success.tolist() == [True, False, False] and np.isnan(there.x[1:]).all()


def test_what_single_precision_does_not_take(host: HostDevice) -> None:
    with pytest.raises(ArgumentError, match=r"precision='single' does not take method='radau', whose equations are solved to "
                                            r"rounding; pass 'dop853' or 'bs54'; rtol=1e-08; pass 1e-06 or more\. Leave prec"):
        compiled("double_pendulum").simulate_batch(t=(0, 1), method="radau", device="gpu", precision="single")
    with pytest.raises(ArgumentError, match=r"does not take the constraints .*, which are kept to 1e-12; rtol"):
        compiled("four_bar").simulate_batch(t=(0, 1), device="gpu", precision="single")
    with pytest.raises(ArgumentError, match="precision='single' is that of a device; pass device='gpu'"):
        compiled("double_pendulum").simulate_batch(t=(0, 1), precision="single")
    x: Any = sd.coordinates("x")
    system = sd.System("falls", gravity=[-1, 0, 0])
    system.add_joint(sd.Prismatic("j", system.ground, system.add_body("b", mass=1), x, axis=[1, 0, 0]))
    system.add_event("floor", x, stop=True)
    with pytest.raises(ArgumentError, match="does not take events, whose times are found to rounding; pass events=False"):
        system.embedding().compile(backend="c").simulate_batch(t=(0, 1), rtol=1e-5, device="gpu", precision="single")


def test_ensembles_and_sweep_files(host: HostDevice, tmp_path: Path) -> None:
    module, drawn, outcomes = compiled("double_pendulum"), {"q1": np.linspace(-1, 1, 40)}, ["end q1", "max energy"]
    asked: dict[str, Any] = {"t": (0, 0.5), "outcomes": outcomes, "rtol": 1e-6, "method": "bs54"}
    single, double = (sd.ensemble(module, drawn, **asked, device="gpu", precision=one) for one in ("single", None))
    here = sd.ensemble(module, drawn, **asked)
    assert np.array_equal(double["end q1"], here["end q1"])
    off = np.abs(single["end q1"] - here["end q1"])
    assert 0 < off.max() < 1e-5 and len(set(off)) > 20
    sd.ensemble(module, drawn, **asked, device="gpu", path=tmp_path / "a")
    with pytest.raises(ArgumentError, match='precision: "double" there, "single" now'):
        sd.ensemble(module, drawn, **asked, device="gpu", precision="single", path=tmp_path / "a", resume=True)
    with pytest.raises(ArgumentError, match="precision='single' is that of a device; pass device='gpu', or leave it out"):
        sd.ensemble(module, drawn, **asked, precision="single")
    with pytest.raises(ArgumentError, match="precision must be 'double' or 'single', found ''"):
        sd.ensemble(module, drawn, **asked, device="gpu", precision="")
    begun = len(host.log)
    with pytest.raises(ArgumentError, match="precision='single' does not take rtol=1e-08; pass 1e-06 or more"):
        sd.ensemble(module, drawn, (0, 1), device="gpu", precision="single")
    assert len(host.log) == begun
    file, faults = tmp_path / "swings.toml", list[str]()
    file.write_text('system = "double_pendulum"\ndevice = "gpu"\nprecision = "single"\n[initial]\nq1 = [0.1, 0.2]\n')
    assert read_sweep(file, faults).arguments(module)["precision"] == "single" and not faults
    file.write_text('system = "double_pendulum"\nprecision = "half"\n[initial]\nq1 = [0.1, 0.2]\n')
    read_sweep(file, faults)
    assert faults == ["precision: must be one of double, single, found 'half'"]


@pytest.mark.parametrize(("name", "method"), [("double_pendulum", "dop853"), ("cart_pole", "bs54")])
def test_kernels_compile_for_a_gpu(name: str, method: str) -> None:
    """Without a warning, with hardly a sum of doubles."""
    pytest.importorskip("cuda.bindings")
    unit: Any = compiled(name).library(RightSide(method=method, threads=True, looks=False, single=True))
    code, printed = compiling.ptx(unit.source, name, "compute_90")
    assert f".entry {unit.metadata.name}_motions(".encode() in code and not printed
    assert code.count(b"fma.rn.f32") > 100 > 10 * code.count(b"fma.rn.f64")
