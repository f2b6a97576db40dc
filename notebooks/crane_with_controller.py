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
# # A crane with a controller
#
# An overhead crane: a trolley on a rail, and a load on a rope below it. The operator wants the load at another place,
# without swinging. This notebook goes from the description to a controller that runs in steps of 50 ms, and checks it
# by what the linear equations predict.

# %%
import matplotlib.pyplot as plt
import numpy as np
import scipy.linalg
import sympy as sp
from IPython.display import display

import symdyn as sd

# %% [markdown]
# ## 1. Description
#
# The rope is straight, so the load hangs like a rod without mass: a hinge on the trolley, the load at the distance $l$.

# %%
x, theta = sd.coordinates("x theta")
M, m, l, g, d = sd.parameters("M m l g d", positive=True)
F = sd.inputs("F")

crane = sd.System("crane", gravity=[0, -g])
trolley = crane.add_body("trolley", mass=M)
load = crane.add_body("load", mass=m, com=[0, -l])
crane.add_joint(sd.Prismatic("rail", crane.ground, trolley, x, axis=[1, 0]))
crane.add_joint(sd.Revolute("rope", trolley, load, theta))
crane.add_joint_force("rail", F - d * x.dot)
crane.add_output("load", sd.position(load, [0, -l]))
crane.defaults = {M: 500, m: 2000, l: 8, g: 9.81, d: 100}

equations = crane.embedding()
display(equations)

# %% [markdown]
# ## 2. What swings, and how fast
#
# About the load at rest the equations are linear. Their symbols say what matters: without friction the load swings at
# $\omega^2 = \frac{g}{l}\,\frac{M + m}{M}$, since a light trolley gives way.

# %%
free = equations.linearized(about={x: 0, theta: 0, F: 0}, hold=[])
omega = sp.symbols("omega", positive=True)
characteristic = sp.factor((free.K - omega**2 * free.M).det())
print(characteristic)
assert characteristic.subs(omega, sp.sqrt(g * (M + m) / (l * M))).simplify() == 0

module = crane.compile()
rest = module.equilibrium(fixed={x: 0})
linear = module.linearize(rest, hold=())
print(linear.modes())

# %% [markdown]
# ## 3. A regulator
#
# The gain of least cost weighs metres and radians against newtons. A metre off counts as much as 0.2 rad, or as 1 kN.

# %%
regulator = linear.lqr({"x": 1, "theta": 25}, {"F": 1e-6})
print(regulator)

# %% [markdown]
# ## 4. Ten metres further
#
# The set point is 10 m away. A crane's drive cannot push with more than 6 kN, and the computer that controls it runs
# every 50 ms. `sd.Sampled` holds its value between these instants, and steps end at them.

# %%
target, period, limit = 10.0, 0.05, 6e3
gain = np.asarray(regulator.K)[0]


def controller(t, state):
    """Force on the trolley: the gain times how far the state is from the target, limited by the drive."""
    return float(np.clip(-gain @ (state - [target, 0, 0, 0]), -limit, limit))


moved = module.simulate((0, 20), inputs={F: sd.Sampled(controller, period)}, rtol=1e-9)
by_hand = sd.Sampled(lambda t, state: limit if t < 2 else -limit if t < 4 else 0.0, period)
pushed = module.simulate((0, 20), inputs={F: by_hand}, rtol=1e-9)

figure, (top, middle, bottom) = plt.subplots(3, 1, figsize=(8, 6), sharex=True, layout="constrained")
for title, sol in (("regulator", moved), ("push and brake by hand", pushed)):
    top.plot(sol.t, sol.outputs["load"][:, 0], label=title)
    middle.plot(sol.t, np.degrees(sol[theta]))
    bottom.plot(sol.t, sol[F] / 1e3)
top.axhline(target, color="0.6", linewidth=0.8)
top.set(ylabel="load x [m]")
middle.set(ylabel="rope [deg]")
bottom.set(ylabel="force [kN]", xlabel="t [s]")
top.legend()
for axes in (top, middle, bottom):
    axes.grid(color="0.9")
plt.show()

print(f"after 20 s the load is {abs(moved.outputs['load'][-1, 0] - target) * 1e3:.1f} mm off; "
      f"by hand it swings by {np.degrees(np.ptp(pushed[theta][-300:])):.0f} deg")
assert abs(moved.outputs["load"][-1, 0] - target) < 0.02

# %% [markdown]
# ## 5. A check
#
# Close to the target the motion is linear and the drive is not at its limit. Then a loop with a clock is exact algebra:
# with $\mathbf E = e^{\mathbf A T}$ and the held input's $\mathbf G$, each instant's deviation is $(\mathbf E - \mathbf
# G\mathbf K)$ times the one before. Started 1 mm away, the simulation must give the same numbers.

# %%
A, B = np.asarray(linear.A), np.asarray(linear.B)
both = scipy.linalg.expm(period * np.block([[A, B], [np.zeros((1, 5))]]))
loop = both[:4, :4] - np.outer(both[:4, 4], gain)
start = np.array([1e-3, 0, 0, 0])
times = period * np.arange(101)
near = module.simulate(times, q=start[:2], inputs={F: sd.Sampled(lambda t, state: -gain @ state, period)}, rtol=1e-12)
exact = np.array([np.linalg.matrix_power(loop, k) @ start for k in range(101)])
print(f"largest difference {np.abs(near.x - exact).max():.1e} of 1e-3")
assert np.abs(near.x - exact).max() < 1e-8
print("slowest of the sampled loop: |z| =", np.abs(np.linalg.eigvals(loop)).max().round(4))

# %% [markdown]
# The remaining difference is due to the nonlinearity: it falls with the cube of the distance.
#
# ## What to read next
#
# - [Control](../docs/control.md): trim, regulators by names, sampled controllers.
# - [Optimal motion](../docs/optimal_motion.md): the fastest way of the load, with limits.
