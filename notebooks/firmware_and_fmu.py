# ---
# jupyter:
#   jupytext:
#     formats: ipynb,py:percent
#   kernelspec:
#     display_name: Python 3
#     language: python
#     name: python3
# ---

# %% [markdown]
# # Firmware and FMU: one mechanism in other programs
#
# A two-link arm leaves Python twice: as C for a microcontroller, and as an FMU for programs that import the Functional
# Mock-up Interface. Both are made from the equations that Python runs, and both are compared with it here.

# %%
import ctypes
import shutil
import subprocess
import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import symdyn as sd

arm = sd.systems.two_link_arm()
equations = arm.equations()
module = equations.compile()
folder = Path(tempfile.mkdtemp())

# %% [markdown]
# ## 1. C for a microcontroller
#
# The package has C99 without heap and globals, a C++17 header, CMake files, and a self-test with reference vectors of 30
# digits. Numbers are `double` or, by a macro, `float`.

# %%
paths = equations.to_cmake(folder / "firmware")
print(*sorted(path.name for path in paths))
source, header, selftest = (next(path for path in paths if path.name == name) for name in (
    "two_link_arm.c", "two_link_arm.h", "selftest.c"))
print("// A step" + header.read_text(encoding="utf-8").split("// A step")[1].split(";")[0])

# %% [markdown]
# A compiler builds the self-test for both kinds of numbers; here it runs on this machine, on a board it runs the same.

# %%
compiler = shutil.which("cc") or shutil.which("gcc")


def build(name, *options):
    """Compile the mechanism, with what the options add."""
    target = folder / name
    common = [compiler, "-std=c99", "-O2", "-ffp-contract=off", f"-I{header.parents[1]}", str(source)]
    subprocess.run([*common, *options, "-o", str(target), "-lm"], check=True)
    return target


if compiler is None:
    print("no C compiler on this machine")
else:
    for kind, options in (("double", ()), ("float", ("-DTWO_LINK_ARM_FLOAT",))):
        done = subprocess.run([str(build(f"test_{kind}", str(selftest), *options))], capture_output=True, text=True, check=False)
        print(kind, done.stdout.strip())
        assert done.returncode == 0

# %% [markdown]
# The step of a control loop, 1 ms by Runge-Kutta's method of order 4 with the torques held, against the motion that Python
# integrates to 1e-12:

# %%
torques = np.array([1.0, 0.3])
exact = module.simulate((0, 1), inputs=dict(zip(module.metadata.inputs, torques, strict=True)), rtol=1e-12)
if compiler is not None:
    library = ctypes.CDLL(str(build("arm.so", "-shared", "-fPIC")))
    numbers = ctypes.POINTER(ctypes.c_double)
    library.two_link_arm_step.argtypes = [ctypes.c_double, ctypes.c_double, *[numbers] * 4]
    p, c, x = np.array(exact.params), np.zeros(7), exact.x[0].copy()
    pointer = [a.ctypes.data_as(numbers) for a in (x, torques, p, c)]
    assert library.two_link_arm_prologue(pointer[2], pointer[3]) == 0
    steps = [x.copy()]
    for k in range(1000):
        assert library.two_link_arm_step(0.001 * k, 0.001, *pointer) == 0
        steps.append(x.copy())
    print("after 1 s", x, f"error {np.abs(x - exact.x[-1]).max():.1e}")
    assert np.abs(x - exact.x[-1]).max() < 1e-7

# %% [markdown]
# The error over time: that of the steps, which nothing adapts, grows with the motion.

# %%
if compiler is not None:
    times = 0.001 * np.arange(1, 1001)
    figure, axes = plt.subplots(figsize=(8, 3.4), layout="constrained")
    axes.semilogy(times, np.abs(np.array(steps)[1:, :2] - exact(times)[:, :2]), label=["q1", "q2"])
    axes.set(xlabel="t in s", ylabel="error in rad", title="1,000 steps in C, compared with Python's motion")
    axes.legend()
    plt.show()

# %% [markdown]
# ## 2. An FMU
#
# For co-simulation symdyn's integrator is inside, so that the importer's steps only say when numbers are exchanged.

# %%
path = module.to_fmu(folder / "arm.fmu", version=3, kind="co_simulation")
print(path.name, path.stat().st_size // 1000, "kB")

# %% [markdown]
# FMPy, a program that is independent of symdyn, imports it (`pip install 'symdyn[fmu]'`):

# %%
try:
    import fmpy
except ImportError:
    print("FMPy is not installed")
else:
    starts = dict(zip(module.metadata.inputs, torques, strict=True))
    rows = fmpy.simulate_fmu(str(path), stop_time=1.0, output_interval=0.01, start_values=starts, output=["q1", "q2"])
    end = np.array([rows["q1"][-1], rows["q2"][-1]])
    print("FMPy", end, "symdyn", exact.q[-1])
    assert np.abs(end - exact.q[-1]).max() < 1e-5

# %% [markdown]
# More: [firmware](../docs/firmware.md) with measurements on a Cortex-M4, [FMUs](../docs/fmu.md) with events and constraints.
