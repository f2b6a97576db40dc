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
# # A Stewart platform and the forces in its legs
#
# Six legs carry a platform and move it in all six freedoms. Which forces do the drives need for a given motion, and how
# near is a pose where they would have to be infinite? Legs, platform and joints form five independent loops.

# %%
import matplotlib.pyplot as plt
import numpy as np
import scipy.integrate
import scipy.interpolate

import symdyn as sd

# %% [markdown]
# ## 1. The model
#
# Each leg is a universal joint on the ground, a slider with its drive, and a ball joint at the platform. The platform
# has coordinates of its own, and the six ball joints close the loops.

# %%
system = sd.systems.stewart_platform()
module = system.augmented().compile()
print(f"{module.metadata.sizes.q} coordinates, {len(module.metadata.constraints)} constraints, drives", *module.metadata.inputs)
print(system.diagnose())

# %% [markdown]
# ## 2. A motion
#
# The platform goes up and down by 10 cm and rolls by 6 degrees, twice as fast. Its six coordinates, with their first
# and second derivatives, are given; the legs follow from the constraints.

# %%
platform = ["x", "y", "z", "a", "b", "c"]
kept = [*platform, *[f"{name}_dot" for name in platform]]
height, w = 1.2, 2 * np.pi / 2


def motion(t):
    """Position, speed and acceleration of the platform: z a cosine, the first angle a sine of twice the frequency."""
    lift, roll = 0.1, np.radians(6)
    return ({"z": height + lift * (1 - np.cos(w * t)), "a": roll * np.sin(2 * w * t)},
            {"z_dot": lift * w * np.sin(w * t), "a_dot": 2 * w * roll * np.cos(2 * w * t)},
            {"z_dot": lift * w**2 * np.cos(w * t), "a_dot": -4 * w**2 * roll * np.sin(2 * w * t)})


times = np.linspace(0, 2, 81)
points, guess = [], dict(zip(module.metadata.q, module.consistent({"z": height}, keep=platform)[0], strict=True))
for t in times:
    q, u, ud = motion(t)
    point = module.actuation(t, {**guess, **q}, {**dict.fromkeys(module.metadata.u, 0), **u}, ud, project=True, keep=kept)
    points.append(point)
    guess = dict(zip(module.metadata.q, point.q, strict=True))
forces = np.array([point.inputs for point in points])

figure, axes = plt.subplots(figsize=(8, 3.6), layout="constrained")
axes.plot(times, forces, label=list(module.metadata.inputs))
axes.set(xlabel="t [s]", ylabel="force of a leg [N]")
axes.grid(color="0.9")
axes.legend(loc="center left", bbox_to_anchor=(1, 0.5), frameon=False)
plt.show()

# %% [markdown]
# ## 3. Two checks
#
# The energy that the drives give is the energy that the mechanism has: forces times the rates of the legs, added up,
# are its change.

# %%
rates = np.array([[point.u[module.metadata.u.index(f"s{k}_dot")] for k in range(1, 7)] for point in points])
work = scipy.integrate.cumulative_simpson((forces * rates).sum(axis=1), x=times, initial=0)
energy = np.array([sum(module.energy(point.q, point.u)) for point in points])
print(f"energy changes by up to {np.ptp(energy):.1f} J, differs from the work by {np.abs(energy - energy[0] - work).max():.1e} J")
assert np.abs(energy - energy[0] - work).max() < 1e-3

# %% [markdown]
# Forces over time fed into the simulation must make the motion. A platform on legs is unstable like a pencil on its
# tip, so errors of the spline between the 81 instants grow; over half a second they stay small.

# %%
inputs = {name: scipy.interpolate.CubicSpline(times, forces[:, k]) for k, name in enumerate(module.metadata.inputs)}
driven = module.simulate(times[:21], points[0].q, points[0].u, inputs=inputs, rtol=1e-10)
off = np.abs(driven["z"] - [motion(t)[0]["z"] for t in times[:21]]).max()
print(f"height off by {off:.1e} m after 0.5 s")
assert off < 1e-5

# %% [markdown]
# ## 4. How near is a singular pose?
#
# When the platform turns about the vertical, the directions of the legs become dependent: at a right angle the legs can no longer
# hold it, and the forces grow without bound. The condition number of the actuation shows it beforehand.

# %%
turns = np.radians(np.arange(0, 86, 5))
still, rows, guess = dict.fromkeys(module.metadata.u, 0), [], dict(zip(module.metadata.q, points[0].q, strict=True))
for turn in turns:
    here = module.actuation(0, {**guess, "z": height, "c": turn}, still, {}, project=True, keep=kept)
    guess = dict(zip(module.metadata.q, here.q, strict=True))
    rows.append((here.condition, np.abs(here.inputs).max()))
conditions, largest = np.array(rows).T

figure, (left, right) = plt.subplots(1, 2, figsize=(9, 3.2), layout="constrained")
left.semilogy(np.degrees(turns), conditions, "o-")
left.set(xlabel="turn about the vertical [deg]", ylabel="condition number")
right.semilogy(np.degrees(turns), largest, "o-")
right.set(xlabel="turn about the vertical [deg]", ylabel="largest force [N]")
for axes in (left, right):
    axes.grid(color="0.9")
plt.show()

# %% [markdown]
# ## What to read next
#
# - [Control](../docs/control.md): inputs that make a motion, trim, regulators.
# - [Constraints and closed loops](../docs/constraints.md).
