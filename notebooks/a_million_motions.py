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
# # A million motions on a cluster
#
# When does a double pendulum, released at rest, turn over? A map of all initial angles answers that, motion by motion. Here
# is a map of 1,600, made as one of a million would be: from a description of samples, into a folder, by workers that may
# stop and go on.

# %%
import os
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

import symdyn as sd

folder = Path(tempfile.mkdtemp())

# %% [markdown]
# ## 1. One motion
#
# Both rods hang down at $q_1 = -\pi/2$, $q_2 = 0$. Only a few numbers of each motion are kept, here the extremes of the
# second angle.

# %%
pendulum = sd.systems.double_pendulum().compile()
one = pendulum.simulate((0, 10), q={"q1": 1.0, "q2": 0.5}, rtol=1e-8)
print(one, f"energy changes by {np.ptp(one.energy) / np.abs(one.energy).max():.0e}", sep="\n")

# %% [markdown]
# ## 2. Many
#
# Samples are arrays of one length, or `sd.Samples` with ranges and distributions. With `path` every chunk of results is a
# file that is whole or not there.

# %%
side = 40
angles = np.linspace(-np.pi, np.pi, side)
q1, q2 = (grid.ravel() for grid in np.meshgrid(angles - np.pi / 2, angles))
samples = {"q1": q1, "q2": q2}
outcomes = ["max q2", "min q2", "end energy", "start energy"]
begun = time.perf_counter()
many = sd.ensemble(pendulum, samples, t=(0, 10), outcomes=outcomes, rtol=1e-8, chunk=200, path=folder / "map")
seconds = time.perf_counter() - begun
print(f"{len(q1)} motions, {many.n_failed} failed")

# %% [markdown]
# A rod that turns over leaves $|q_2| > \pi$. The initial angles that cannot do so for lack of energy are known in closed form:
# the upper rod down and the lower one up is the least energy with $q_2 = \pi$ (Heyl, *The double pendulum fractal*, 2008,
# for point masses).

# %%
turned = np.maximum(np.abs(many["max q2"]), np.abs(many["min q2"])) > np.pi
p = {str(symbol): value for symbol, value in sd.systems.double_pendulum().defaults.items()}


def potential(upper, lower):
    """Potential energy, J, with the angle of the upper rod from the downward vertical."""
    height = p["m1"] * p["lc1"] * np.cos(upper) + p["m2"] * (p["l1"] * np.cos(upper) + p["lc2"] * np.cos(upper + lower))
    return -p["g"] * height


able = potential(q1 + np.pi / 2, q2) > potential(0.0, np.pi)

figure, axes = plt.subplots(figsize=(5, 4.4), layout="constrained")
axes.pcolormesh(angles, angles, turned.reshape(side, side), cmap="cividis")
axes.contour(angles, angles, able.reshape(side, side), levels=[0.5], colors="white")
axes.set(xlabel=r"$q_1 + \pi/2$ [rad]", ylabel="$q_2$ [rad]", title="the lower rod turns over within 10 s")
plt.show()
drift = np.abs(many["end energy"] - many["start energy"]).max()
print(f"{turned.mean():.0%} turn over; largest change of energy {drift:.0e} J")
released = np.abs(q2) < np.pi                       # those on the edge begin there
assert not (turned & released & ~able).any() and drift < 1e-4

# %% [markdown]
# ## 3. Stop and go on
#
# A run that was stopped, by whatever, goes on with `resume=True`: what is there is not computed again, and the numbers are
# the same to the last bit. Other workers give the same numbers as well: processes here, on a cluster those of
# `mpi4py.futures` or of Dask.

# %%
(folder / "map" / "ensemble.npz").unlink()
again = sd.ensemble(pendulum, samples, t=(0, 10), outcomes=outcomes, rtol=1e-8, chunk=200, path=folder / "map", resume=True)
with ProcessPoolExecutor(2) as workers:
    spread = sd.ensemble(pendulum, samples, t=(0, 10), outcomes=outcomes, rtol=1e-8, chunk=200, executor=workers)
for name in outcomes:
    assert np.array_equal(again[name], many[name]) and np.array_equal(spread[name], many[name])
print("resumed, and by two processes: the same to the last bit")

# %% [markdown]
# ## 4. How long a million takes
#
# Motions do not wait for each other: time is their number, by the time of one, over the cores. Results are the outcomes
# alone.

# %%
count, cores = 1_000_000, 64
per_motion = seconds / len(q1)
print(f"{1e3 * per_motion:.2f} ms a motion on this machine: {count:,} take {count * per_motion / 60:.0f} minutes here")
print(f"{cores} cores in place of the {os.cpu_count()} here take {count * per_motion / 60 * os.cpu_count() / cores:.1f} minutes, "
      f"and {count * len(outcomes) * 8 / 1e6:.0f} MB for the results")

# %% [markdown]
# ## 5. On a cluster
#
# The same as a file, for `symdyn sweep`. The line `cluster = "slurm"` submits it to Slurm, `dask = "tcp://host:8786"` gives it
# to Dask. With `cluster = "folder"`, as here, every process that runs the command computes chunks that no other has: two of
# them, of which one is killed, do what one would. There are 32,768 samples in place of 1,048,576. First a dry run of the
# million for 64 workers, from ten samples:

# %%
sweep = folder / "map.toml"
sweep.write_text("""system = "double_pendulum"
t = {from = 0, to = 10, count = 101}
sampling = "sobol"
count = 32768
outcomes = ["max q2", "min q2"]
[cluster]
kind = "folder"
lease = 2                # s, of a worker without a sign of life
[initial]
q1 = {from = -4.7, to = 1.6}
q2 = {from = -3.1, to = 3.1}
""", encoding="utf-8")
command = [sys.executable, "-m", "symdyn", "sweep", str(sweep), "--output", str(folder / "sweep"), "--no-picture"]
asked = [*command, "--dry-run", "--count", "1048576", "--workers", "64"]
print(subprocess.run(asked, check=True, capture_output=True, text=True).stdout)

# %%
workers = [subprocess.Popen([*command, "--jobs", "1"], stdout=subprocess.DEVNULL) for _ in range(2)]
while all(worker.poll() is None for worker in workers) and len(list((folder / "sweep" / "chunks").glob("0*.npz"))) < 4:
    time.sleep(0.01)
workers[1].kill()
print(subprocess.run([*command, "--status"], check=True, capture_output=True, text=True).stdout.replace(str(folder), "."))
assert workers[0].wait() == 0
with np.load(folder / "sweep" / "ensemble.npz") as found:
    assert found["max q2"].shape == (32768,) and np.isfinite(found["max q2"]).all()

# %% [markdown]
# ## What to read next
#
# - [Many at once](../docs/many_at_once.md): batches, ensembles, sweeps, executors.
# - [Sweeps on clusters](../docs/clusters.md): Slurm, Dask, what a sweep will take.
