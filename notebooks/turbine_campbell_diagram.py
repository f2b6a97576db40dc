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
# # A floating turbine from rest to a Campbell diagram
#
# How deep does it float, which period does its pitch have, and at which rotor speeds are blades and tower excited? The
# turbine is that of the catalogue: the NREL 5-MW machine on a barge. Chapter 6 of the course has all of its parts.

# %%
import numpy as np
from IPython.display import display

import symdyn as sd

# %% [markdown]
# ## 1. Rest
#
# Weight, buoyancy and mooring lines hold each other. The nacelle and the rotor are kept where they are.

# %%
turbine = sd.systems.floating_wind_turbine()
module = turbine.compile()
kept = {"yaw": 0, "azimuth": 0}
rest = module.equilibrium(fixed=kept)
print(rest)
assert rest.stable
display(turbine)

# %% [markdown]
# ## 2. Modes of the rigid turbine, and a check by its motion
#
# The linear equations at rest give the period in pitch. A motion from a small angle has to have it: times between its
# zeros.

# %%
modes = module.linearize(rest).modes()
print(modes)
pitch = modes["theta"]

start = dict(zip(module.metadata.q, rest.q))
swing = module.simulate((0, 60), {**start, "theta": start["theta"] + 1e-3}, rtol=1e-10, atol=1e-13)
angle = swing["theta"] - start["theta"]
zeros = np.flatnonzero(np.sign(angle[:-1]) != np.sign(angle[1:]))
times = swing.t[zeros] - angle[zeros] * np.diff(swing.t)[zeros] / np.diff(angle)[zeros]
measured = 2 * np.mean(np.diff(times))
print(f"period in pitch: {pitch.period:.4f} s linear, {measured:.4f} s in the motion")
assert abs(measured / pitch.period - 1) < 1e-3

# %%
swing.view()

# %% [markdown]
# ## 3. Flexible tower and blades, over the speed of the rotor
#
# Blades in a spinning rotor are seen from the tower in three ways: all together, and as waves that run backward and
# forward. Their multi-blade coordinates name the modes. Weight and the cone make the equations periodic; their mean over
# the azimuth is taken.

# %%
flexible = sd.systems.floating_wind_turbine(flexible=True).compile()
shapes = [tuple(f"blade{k}_{shape}" for k in (1, 2, 3)) for shape in ("flap1", "edge1", "flap2")]
speeds = np.linspace(0.4, 1.3, 4)
diagram = flexible.campbell("azimuth_dot", speeds, fixed={"yaw": 0}, blades=shapes, averaged=True)
print(diagram)

# %%
diagram.plot()

# %% [markdown]
# ## 4. A check by kinematics
#
# A vibration with the frequency $f$ in the rotating blades is seen at $f - \Omega/2\pi$ and $f + \Omega/2\pi$ from the
# tower. So the backward and the forward wave of the same shape lie $2\,\Omega/2\pi$ apart, as long as the tower hardly
# takes part: of the edgewise modes within a few percent.

# %%
split = diagram["blade1_edge1 forward"] - diagram["blade1_edge1 backward"]
for speed, apart in zip(speeds, split):
    print(f"{speed:.1f} rad/s: {apart:.4f} Hz apart, by kinematics {speed / np.pi:.4f} Hz")
assert np.allclose(split, speeds / np.pi, rtol=0.03)

# %% [markdown]
# The blades pass the tower three times a turn. Where this line crosses the tower's first mode, it is excited:

# %%
crossing = np.interp(0.0, 3 * speeds / (2 * np.pi) - diagram["tower_fa1"], speeds)
print(f"three passes a turn meet the tower's mode at {crossing:.2f} rad/s = {crossing * 30 / np.pi:.1f} rpm")
assert speeds[0] < crossing < speeds[-1]

# %% [markdown]
# ## What to read next
#
# - [Floating bodies, wind and water](../docs/floating_bodies.md) and [flexible bodies](../docs/flexible_bodies.md).
# - [Linear analysis](../docs/linear_analysis.md): what a Campbell diagram shows, and whose frequencies these are.
