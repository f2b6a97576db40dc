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
# # A bicycle and its weave
#
# A bicycle that nobody steers falls over at low speed, weaves at a somewhat higher one, steers itself at 5 m/s, and
# falls slowly at a high one. The equations that predict this were published with benchmark numbers by Meijaard, Papadopoulos,
# Ruina and Schwab (Proceedings of the Royal Society A 463, 2007). This notebook finds them from a model of four rigid
# bodies whose wheels roll.

# %%
import matplotlib.pyplot as plt
import numpy as np
from scipy.optimize import brentq

import symdyn as sd

# %% [markdown]
# ## 1. The model
#
# It is in the catalogue: rear frame with rider, front frame, two wheels. It has nine coordinates; that both wheels
# touch the ground and roll without slipping are six constraints, of which four are of velocities.

# %%
bicycle = sd.systems.bicycle()
equations = bicycle.augmented()
module = equations.compile()
sizes = module.metadata.sizes
print(f"{sizes.q} coordinates, {len(module.metadata.constraints)} constraints:", ", ".join(module.metadata.constraints))

# %% [markdown]
# ## 2. Straight ahead at 5 m/s
#
# Riding straight ahead is a steady motion, not a state of rest: the wheels turn and the bicycle moves. Its linear
# equations on the constraints are constant all the same.

# %%
def riding(v):
    """State straight ahead at the speed v: y is to the right and z down, so that the wheels turn the negative way."""
    return {**dict.fromkeys(module.metadata.x, 0.0), "z": -0.3, "x_dot": v, "rear_dot": -v / 0.3, "front_dot": -v / 0.35}


linear = module.linearize(riding(5.0))
print(linear.modes())

# %% [markdown]
# The published eigenvalues at 5 m/s, to ten digits, are two of the weave, one of the capsize, and one that castors. The
# other modes are where the bicycle is and which way it points, which nothing holds.

# %%
published = np.array([-14.07838969279822, -0.7753418824189, -0.7753418824189, -0.3228664290041])
found = linear.eigenvalues[np.argsort(-np.abs(linear.eigenvalues))][:4]
print(np.sort(found.real))
assert np.allclose(np.sort(found.real), np.sort(published), atol=1e-8)

# %% [markdown]
# ## 3. All speeds
#
# Each eigenvalue over the speed. Where all real parts are negative, the bicycle rides by itself.

# %%
speeds = np.linspace(0.25, 10, 60)
roots = np.array([sorted(module.linearize(riding(v)).eigenvalues, key=abs)[-4:] for v in speeds])
grows = np.array([root.real.max() for root in roots])

figure, axes = plt.subplots(figsize=(8, 4), layout="constrained")
axes.axvspan(*speeds[grows < 0][[0, -1]], color="C2", alpha=0.15, label="rides by itself")
axes.plot(speeds, roots.real, ".", color="C0", markersize=3)
axes.plot(speeds, np.where(roots.imag > 0, roots.imag, np.nan), ".", color="C1", markersize=2)
axes.plot([], [], ".", color="C0", label="real part")
axes.plot([], [], ".", color="C1", label="imaginary part")
axes.axhline(0, color="0.4", linewidth=0.8)
axes.set(xlabel="speed [m/s]", ylabel="eigenvalue [1/s]", ylim=(-10, 10))
axes.grid(color="0.9")
figure.legend(loc="outside lower center", ncols=3)
plt.show()

# %% [markdown]
# The ends of that range, the weave speed and the capsize speed, were published to ten digits. A root of the largest
# real part finds them.

# %%
largest = lambda v: max(sorted(module.linearize(riding(v)).eigenvalues, key=abs)[-4:], key=lambda s: s.real).real
weave, capsize = brentq(largest, 4.0, 4.6, xtol=1e-12), brentq(largest, 5.7, 6.4, xtol=1e-12)
print(f"weave speed {weave:.8f} m/s, capsize speed {capsize:.8f} m/s")
assert abs(weave - 4.29238253634) < 1e-8 and abs(capsize - 6.02426201539) < 1e-8

# %% [markdown]
# ## 4. A push
#
# Just above the weave speed, a bicycle that is pushed sideways weaves and comes back upright by itself. The nonlinear
# motion shows it, with every wheel's contact as a constraint and the ground's forces as its multipliers. Its speed is a
# little higher afterwards: the energy of the push is still there, since nothing takes energy away.

# %%
pushed = {**riding(4.6), "lean_dot": 0.5}
q, u = module.consistent([pushed[name] for name in module.metadata.q], [pushed[name] for name in module.metadata.u])
ride = module.simulate((0, 8), q, u, rtol=1e-9)
print(ride)
print(f"energy changes by {np.ptp(ride.energy) / abs(ride.energy[0]):.0e}, constraints are kept to "
      f"{np.abs(ride.constraint_violation).max():.0e}")
assert np.ptp(ride.energy) < 1e-7 * abs(ride.energy[0]) and np.abs(ride["lean"][-1]) < 0.05

figure, (left, right) = plt.subplots(1, 2, figsize=(9, 3.4), layout="constrained")
left.plot(ride.t, np.degrees(ride["lean"]), label="lean")
left.plot(ride.t, np.degrees(ride["steer"]), label="steer")
left.set(xlabel="t [s]", ylabel="angle [deg]")
left.legend()
right.plot(ride["x"], ride["y"])
right.set(xlabel="x [m]", ylabel="y [m], to the right", title="path of the rear wheel")
right.invert_yaxis()
for axes in (left, right):
    axes.grid(color="0.9")
plt.show()

# %% [markdown]
# ## What to read next
#
# - [Linear analysis](../docs/linear_analysis.md): steady motions, verdicts, modes and their derivatives by parameters.
# - [Constraints and closed loops](../docs/constraints.md): rolling and other velocity constraints.
