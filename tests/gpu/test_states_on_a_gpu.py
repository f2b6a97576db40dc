"""Right-hand sides on a device: the kernels' text as C on a device of this processor, against `rhs`, and as code of a GPU; arrays
of other libraries in and out."""

from __future__ import annotations

import ctypes
import functools
import gc
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import mpmath
import numpy as np
import pytest
from host_device import HostDevice, There, compiled

import symdyn as sd
from symdyn.backend.right_side import RightSide
from symdyn.backend.single import in_single
from symdyn.errors import ArgumentError, CompileError, EvaluationWarning, UnsupportedExpression
from symdyn.runtime.building import cache
from symdyn.runtime.building.compiler import require_compiler
from symdyn.runtime.gpu import compiling, device, states
from symdyn.runtime.gpu.dlpack import DeviceArray

HERE = Path(__file__).parent
N = 50
# A norm-wise bound of errors in single precision, whose rounding is 6e-8, for states of the size 1.
SINGLE = 2e-5


def some(module: Any, n: int = N) -> np.ndarray:
    return np.random.default_rng(5).normal(size=(n, module.metadata.sizes.x))


# -- against the processor


@pytest.mark.parametrize("name", ["double_pendulum", "four_bar", "cart_pole"])
def test_rates_are_those_of_the_processor(host: HostDevice, name: str) -> None:
    module, rng = compiled(name), np.random.default_rng(2)
    x, p = some(module), module.parameters() * rng.uniform(1, 1.2, (N, 1))
    inputs = rng.normal(size=(N, module.metadata.sizes.inputs))
    t = np.linspace(0, 1, N)
    for arguments in ((0.0, x), (t, x, p), (t, x, None, inputs), (0.5, x[:1], p, inputs),
                      (0.5, x, module.parameters(), inputs[0])):
        there, here = module.rhs_batch(*arguments, device="gpu"), module.rhs_batch(*arguments)
        assert there.shape == here.shape
        np.testing.assert_allclose(there, here, rtol=0, atol=1e-12 * np.abs(here).max())
    assert host.closed and not host.blocks


def test_parts_take_turns_in_a_bounded_memory(host: HostDevice, monkeypatch: pytest.MonkeyPatch) -> None:
    module = compiled("double_pendulum")
    x = some(module, 1000)
    monkeypatch.setattr(states, "PART", 300)
    assert np.array_equal(module.rhs_batch(0.0, x, device="gpu"), module.rhs_batch(0.0, x))
    assert [n for what, n in host.log if what == "begin"] == [1, 300, 300, 300, 100]
    host.memory, host.most = 40_000, 0
    out = np.empty_like(x)
    assert module.rhs_batch(0.0, x, out=out, device="gpu") is out and np.array_equal(out, module.rhs_batch(0.0, x))
    assert 0.5 * host.memory < host.most <= 0.8 * host.memory
    host.stack, host.most = 1000, 0  # of eight threads
    assert np.array_equal(module.rhs_batch(0.0, x, device="gpu"), out)
    assert 0.3 * host.memory < host.most <= 0.8 * host.memory - 8000
    host.memory, host.stack = 2000, 0
    with pytest.raises(ArgumentError, match=r"a processor has 2 kB \(2000 bytes\) of free memory, of which two states take "):
        module.rhs_batch(0.0, x, device="gpu")


@functools.cache
def slider() -> Any:
    """A block on a spring, whose mass the constants divide by."""
    x: Any = sd.coordinates("x")
    m, k = sd.parameters("m k")
    system = sd.System("slider")
    joint = system.add_joint(sd.Prismatic("j", system.ground, system.add_body("b", mass=m), x, axis=[1, 0, 0]))
    system.add_joint_force(joint, -k * x)
    system.defaults = {m: 2, k: 3}
    return system.embedding().compile(backend="c")


def test_rows_that_fail_are_nan_and_named(host: HostDevice) -> None:
    x = some(slider(), 4)
    x[2, 0] = np.nan
    module = slider()
    for arguments, match in (((x,), r"rhs cannot be evaluated in 1 of 4 rows.*row 2: .*not finite \(x given not finite\)"),
                             ((x[:2], {"m": [1.0, 0.0]}), "1 of 2 rows, which are NaN: row 1: "),
                             ((x[:2], {"m": 0.0}), "in 2 of 2 rows, which are NaN: row 0: ")):
        with pytest.warns(EvaluationWarning, match=match) as warned:
            there = module.rhs_batch(0.0, *arguments, device="gpu")
        with pytest.warns(EvaluationWarning) as expected:
            here = module.rhs_batch(0.0, *arguments)
        assert np.array_equal(there, here, equal_nan=True) and str(warned[0].message) == str(expected[0].message)
        assert warned[0].filename == __file__


# -- arrays of other libraries


@pytest.mark.parametrize("order", ["C", "F"])
def test_arrays_on_the_device_are_read_and_written_there(host: HostDevice, order: Any) -> None:
    module = compiled("double_pendulum")
    x = np.asarray(some(module), order=order)
    p = module.parameters() * np.linspace(1, 1.2, N)[:, None]
    here = module.rhs_batch(0.0, x, p)
    host.log.clear()
    made = module.rhs_batch(0.0, There(x), There(p), device="gpu")
    assert isinstance(made, DeviceArray) and repr(made) == "<DeviceArray 50 x 4 of float64>" and len(made) == N
    assert np.array_equal(made.to_numpy(), here)
    rows = np.from_dlpack(made)
    assert np.array_equal(rows, here) and rows.ctypes.data in host.blocks  # no copy
    # The uploads are t, the inputs, which there are none of, and the tables; codes came back.
    assert sum(n for what, n in host.log if what == "up") < 200 and [n for w, n in host.log if w == "down"] == [4 * N, 8 * 4 * N]
    out = np.zeros((N, 4), order=order)
    there = There(out)
    assert module.rhs_batch(There(np.zeros(N)), There(x), p, out=there, device="gpu") is there and np.array_equal(out, here)
    del made
    gc.collect()
    assert len(host.blocks) == 1  # of the rows
    del rows
    gc.collect()
    assert not host.blocks


def test_out_may_be_x_itself_and_nothing_else(host: HostDevice) -> None:
    module = compiled("double_pendulum")
    x = some(module)
    here, both = module.rhs_batch(0.0, x), np.vstack([x, x])
    whole = There(x)
    assert module.rhs_batch(0.0, whole, out=whole, device="gpu") is whole and np.array_equal(x, here)
    with pytest.raises(ArgumentError, match="out and x share memory on the device, where it would be read after it was written"):
        module.rhs_batch(0.0, There(both[:N]), out=There(both[10:N + 10]), device="gpu")
    with pytest.raises(ArgumentError, match="out and t share memory"):
        module.rhs_batch(There(both[:N, 0]), There(both[:N].copy()), out=There(both[:N]), device="gpu")
    apart = both[N:]
    module.rhs_batch(0.0, There(both[:N]), out=There(apart), device="gpu")
    assert np.array_equal(apart, module.rhs_batch(0.0, both[:N]))


def test_what_nobody_takes_is_given_back(host: HostDevice) -> None:
    made = compiled("double_pendulum").rhs_batch(0.0, There(some(compiled("double_pendulum"))), device="gpu")
    capsule = made.__dlpack__()
    with pytest.raises(BufferError, match="is given as it is, where it is; leave copy and dl_device out"):
        made.__dlpack__(copy=True)
    assert made.__dlpack_device__() == (1, 0)
    del made
    gc.collect()
    assert len(host.blocks) == 1
    del capsule
    gc.collect()
    assert not host.blocks


def test_jax(host: HostDevice) -> None:
    jax = pytest.importorskip("jax")
    module = compiled("double_pendulum")
    x = jax.numpy.asarray(some(module), dtype="float32")
    found = jax.dlpack.from_dlpack(module.rhs_batch(0.0, x, device="gpu", precision="single"))
    wanted = module.rhs_batch(0.0, np.asarray(x, dtype=float))
    with pytest.raises(ArgumentError, match="out is an array of JAX, which counts on its arrays never to change; leave out away"):
        module.rhs_batch(0.0, x, out=x, device="gpu", precision="single")
    assert found.dtype == "float32" and np.abs(np.asarray(found) - wanted).max() < SINGLE * np.abs(wanted).max()


def test_rows_on_the_device_that_fail(host: HostDevice) -> None:
    module = compiled("double_pendulum")
    x = some(module, 3)
    x[1] = np.inf
    with pytest.warns(EvaluationWarning, match=r"in 1 of 3 rows, which are NaN: row 1: [^()]+$"):
        made = module.rhs_batch(0.0, There(x), device="gpu")
    assert np.isnan(made.to_numpy()[1]).all()
    with pytest.warns(EvaluationWarning, match="in 3 of 3 rows"):
        made = slider().rhs_batch(0.0, There(x[:, :2]), {"m": 0.0}, device="gpu")
    assert np.isnan(made.to_numpy()).all()


def test_arrays_that_do_not_fit(host: HostDevice) -> None:
    module = compiled("double_pendulum")
    x = some(module)
    for arguments, options, match in (
            ((0.0, There(x.astype(np.float32))), {}, "x is an array of float32 on the device, and precision='double' takes flo"),
            ((0.0, There(x)), {"precision": "single"}, "x is an array of float64 on the device, and precision='single' tak"),
            ((0.0, There(x.astype(int))), {}, "x is an array of int64 on the device"),
            ((0.0, There(x[:, :3])), {}, r"x has the shape \(50, 3\) on the device, needed is \(n, 4\)"),
            ((There(np.zeros(7)), There(x)), {}, "t has 7 rows, x has 50 rows; give what varies the same number"),
            ((There(np.zeros(7)), x), {}, "t lie on the device and x does not; give all as arrays of NumPy, or x there, too"),
            ((0.0, There(x)), {"out": x}, "x lies on the device and out does not; give an array there, or leave out away"),
            ((0.0, There(x)), {"out": There(x[:3])}, r"out has the shape \(3, 4\) on the device, needed is \(50, 4\)"),
            ((0.0, x), {"precision": "half"}, "precision must be 'double' or 'single', found 'half'")):
        with pytest.raises(ArgumentError, match=match):
            module.rhs_batch(*arguments, device="gpu", **options)
    with pytest.raises(ArgumentError, match="precision='single' is that of a device; pass device='gpu', or leave it out"):
        module.rhs_batch(0.0, x, precision="single")
    with pytest.raises(ArgumentError, match="the backend of the module is numpy; kernels are made of its C"):
        sd.systems.pendulum().compile(backend="numpy").rhs_batch(0.0, [[0.1, 0.0]], device="gpu")
    host.memory = 5000
    with pytest.raises(ArgumentError, match=r"free memory, and 50 states take .* there; pass fewer rows at a time, or out=, an"):
        module.rhs_batch(0.0, There(x), device="gpu")
    assert not host.blocks


# -- single precision


@pytest.mark.parametrize("name", ["double_pendulum", "cart_pole", "spatial_chain"])
def test_single_precision_against_doubles(host: HostDevice, name: str) -> None:
    module = compiled(name)
    x = some(module, 200).astype(np.float32).astype(float)
    single, double = module.rhs_batch(0.0, x, device="gpu", precision="single"), module.rhs_batch(0.0, x)
    errors = np.linalg.norm(single - double, axis=1) / np.linalg.norm(double, axis=1)
    assert 1e-9 < np.median(errors) < 1e-6 * module.metadata.sizes.x and errors.max() < SINGLE


def test_single_precision_of_a_pendulum_against_more_digits(host: HostDevice) -> None:
    """Closed form: q_ddot = -g/l sin q; angles in numbers of single precision."""
    module = compiled("pendulum")
    angles = np.linspace(-3, 3, 31, dtype=np.float32).astype(float)
    names = dict(zip(module.metadata.parameters, module.parameters(), strict=True))
    found = module.rhs_batch(0.0, np.column_stack([angles, 0 * angles]), device="gpu", precision="single")[:, 1]
    exact = [float(-mpmath.mpf(names["g"]) / mpmath.mpf(names["l"]) * mpmath.sin(mpmath.mpf(float(a)))) for a in angles]
    assert np.abs(found - exact).max() < 4 * 6e-8 * names["g"] / names["l"]


def test_what_has_no_single_precision(host: HostDevice) -> None:
    module = compiled("four_bar")
    with pytest.raises(UnsupportedExpression, match=r"no single precision of symdyn_saddle \(constraints\), which its right"):
        module.rhs_batch(0.0, some(module, 3), device="gpu", precision="single")


def test_texts_of_single_precision() -> None:
    text = 'double x1 = 1.0 - .5e-3*a.b + 2e5 + 7; // double 1.0\nputs("1.0 double"); 0x1p3; typedef double symdyn_time;'
    assert in_single(text) == (
        'float x1 = 1.0f - .5e-3f*a.b + 2e5f + 7; // double 1.0\nputs("1.0 double"); 0x1p3; typedef double symdyn_time;')


# -- as code of a GPU


@pytest.mark.parametrize(("name", "single"), [("double_pendulum", False), ("double_pendulum", True), ("four_bar", False),
                                              ("spatial_chain", True)])
def test_kernels_compile_for_a_gpu(name: str, single: bool) -> None:
    """Without a warning; in single precision with no sum or product of doubles but for reducing large angles."""
    pytest.importorskip("cuda.bindings")
    unit: Any = compiled(name).library(RightSide(threads=True, looks=False, integrated=False, single=single))
    code, printed = compiling.ptx(unit.source, name, "compute_90")
    assert f".entry {unit.metadata.name}_states(".encode() in code and b"_constants(" in code and not printed
    assert (b"fma.rn.f32" if single else b"fma.rn.f64") in code
    assert not single or (b"fma.rn.f64" not in code and b"add.f64" not in code)


def test_functions_of_the_user_that_are_no_cuda_are_named() -> None:
    pytest.importorskip("cuda.bindings")
    x: Any = sd.coordinates("x")
    text = "static int pull(const double *in, double *out) { const double new = -in[0]; out[0] = new; return 0; }"
    pull = sd.External("pull", ["x"], c=text)  # a name that is a word of C++
    system = sd.System("pulled")
    joint = system.add_joint(sd.Prismatic("j", system.ground, system.add_body("b", mass=1), x, axis=[1, 0, 0]))
    system.add_joint_force(joint, pull(x))
    module = system.embedding().compile(backend="c")
    assert np.array_equal(module.rhs_batch(0.0, [[2.0, 0.0]]), [[0.0, -2.0]])

    class Compiles(HostDevice):
        def kernel(self, text: str, name: str, function: str) -> Any:
            return compiling.ptx(text, name, "compute_90")

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(device, "open_device", lambda number, owner: Compiles())
        with pytest.raises(CompileError, match=r"(?s)kernel of .*calls functions of the user in C, pull\(x\), whose"):
            module.rhs_batch(0.0, [[2.0, 0.0]], device="gpu")
        with pytest.raises(CompileError, match=r"calls functions of the user in C, pull\(x\)"):
            module.simulate_batch({"x": [1.0]}, t=(0, 1), device="gpu")


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="the driver of this test is a library of Linux")
def test_the_drivers_calls(tmp_path: Path) -> None:
    """A driver whose memory and kernels are this processor's stands in for CUDA's, with arrays that are on it."""
    pytest.importorskip("cuda.bindings")
    module = compiled("double_pendulum")
    unit: Any = module.library(RightSide(threads=True, looks=False, integrated=False))
    compiling.cubin(unit.source, module.name, "sm_90")  # kept in the cache: the compiler looks for a driver, too
    driver = tmp_path / "libcuda.so.1"
    subprocess.run([*require_compiler().command, "-shared", "-fPIC", f"-DSIZE={ctypes.sizeof(states.StateRows)}", "-o",
                    str(driver), str(HERE / "fake_driver.c"), "-ldl"], check=True)
    program = """
import ctypes, gc, numpy as np, symdyn as sd
module = sd.systems.get("double_pendulum").compile(backend="c")
x = np.random.default_rng(1).normal(size=(100, 4))
here = module.rhs_batch(0.0, x)
assert np.array_equal(module.rhs_batch(0.0, x, device="gpu"), here)
class There:
    def __dlpack__(self, stream):
        assert stream > 2  # no default stream
        return x.__dlpack__()
    def __dlpack_device__(self):
        return 2, 0
made = module.rhs_batch(0.0, There(), device="gpu")
assert made.__dlpack_device__() == (2, 0) and np.array_equal(made.to_numpy(), here)
counts = (ctypes.c_longlong * 4)()
fake = ctypes.CDLL("libcuda.so.1")
fake.fake_counts(counts)
print(*counts)
del made
gc.collect()
fake.fake_counts(counts)
print(*counts)
"""
    environment = {**os.environ, "LD_LIBRARY_PATH": str(tmp_path),
                   "FAKE_KERNELS": str(cache.build(unit.source, module.name, require_compiler()))}
    done = subprocess.run([sys.executable, "-c", program], env=environment, capture_output=True, text=True, check=False)
    # Blocks, modules and streams that are left, and kernels that ran: constants and states, twice.
    assert done.stdout.splitlines() == ["1 0 0 4", "0 0 0 4"] and not done.stderr, done.stderr
