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
# # A pole that swings up
#
# A cart carries a pole that hangs down. The cart has two seconds and little force to bring the pole upright, one metre
# further. No regulator finds such a motion: the cart must first go the wrong way. An optimization finds it, and a
# regulator along the motion keeps it when something pushes.

# %%
import matplotlib.pyplot as plt
import numpy as np
import sympy as sp

import symdyn as sd

# %% [markdown]
# ## 1. The mechanism and the task
#
# The numbers are those of Kelly's introduction to trajectory optimization (SIAM Review 59, 2017): a cart of 1 kg, a
# pole with 0.3 kg at its end, 0.5 m long, a force of at most 20 N, a rail of 2 m to each side. The cost is the integral
# of the force squared.

# %%
cart = sd.systems.cart_pole().compile()
params = {"m_c": 1, "m_p": 0.3, "I_p": 0, "l": 0.5}
F = sp.Symbol("F")
hanging, upright = {"q1": 0, "q2": -np.pi}, {"q1": 1, "q2": 0, "q1_dot": 0, "q2_dot": 0}
swing = sd.optimize(cart, sd.Loss(integral=F**2), 2.0, start=hanging, end=upright, bounds={"F": (-20, 20), "q1": (-2, 2)},
                    params=params)
print(f"cost {swing.cost:.4f} N^2 s after {swing.iterations} iterations; mesh error {swing.error:.1e}")
assert abs(swing.cost - 58.807667) < 1e-3

figure, (left, right) = plt.subplots(1, 2, figsize=(9, 3.4), layout="constrained")
t = np.linspace(0, 2, 201)
x = swing.at(t)
left.plot(t, swing.inputs_at(t)[:, 0])
left.set(xlabel="t [s]", ylabel="force [N]")
for k in range(0, 201, 12):
    tip = x[k, 0] - 0.5 * np.sin(x[k, 1]), 0.5 * np.cos(x[k, 1])
    right.plot([x[k, 0], tip[0]], [0, tip[1]], "-", color=plt.cm.viridis(k / 200), linewidth=1.5)
    right.plot(*tip, "o", color=plt.cm.viridis(k / 200), markersize=4)
right.set(xlabel="x [m]", ylabel="y [m]", aspect="equal", title="from dark to light")
for axes in (left, right):
    axes.grid(color="0.9")
plt.show()

# %% [markdown]
# ## 2. Is it a motion?
#
# The polynomials of the optimization fulfil the equations at points only. The forces are therefore simulated, with
# error control, and the difference is part of the result. An unstable motion amplifies what little is left.

# %%
print({name: f"{value:.1e}" for name, value in swing.difference.items()})
assert max(swing.difference.values()) < 1e-3

# %% [markdown]
# ## 3. A push on the way
#
# With a start that is off by 10 cm and 0.2 rad, the forces alone lead somewhere else. The linear-quadratic regulator
# along the motion has a gain for every instant, from Riccati's equation backwards.

# %%
keep = swing.lqr(Q=[1, 1, 0.1, 0.1], R=[0.01], Qf=[100, 100, 100, 100])
q, u = swing.x[0, :2] + [0.1, 0.2], [0.1, -0.2]
blind = cart.simulate((0, 2), q, u, params, inputs=swing.table, rtol=1e-8)
kept = cart.simulate((0, 2), q, u, params, inputs=sd.Sampled(keep, period=0.01), rtol=1e-8)

figure, axes = plt.subplots(figsize=(8, 3.2), layout="constrained")
axes.plot(t, x[:, 1], color="0.5", linewidth=3, alpha=0.5, label="wanted")
axes.plot(blind.t, blind["q2"], label="forces alone")
axes.plot(kept.t, kept["q2"], label="with regulator")
axes.set(xlabel="t [s]", ylabel="pole [rad]")
axes.grid(color="0.9")
axes.legend()
plt.show()

for title, sol in (("forces alone", blind), ("with regulator", kept)):
    print(f"{title:15} at the end off by {np.abs(sol.x[-1] - swing.x[-1]).max():.4f}")
assert np.abs(kept.x[-1] - swing.x[-1]).max() < 0.01

# %% [markdown]
# ## 4. And then it stays
#
# At the top the regulator of the state of rest takes over.

# %%
rest = cart.linearize([1, 0, 0, 0], params=params, hold=()).lqr({"q1": 1, "q2": 1}, {"F": 0.01})
after = cart.simulate((0, 4), kept.q[-1], kept.u[-1], params, inputs=sd.Sampled(rest, period=0.01), rtol=1e-8)
print(f"4 s later off by {np.abs(after.x[-1] - [1, 0, 0, 0]).max():.1e}")
assert np.abs(after.x[-1] - [1, 0, 0, 0]).max() < 1e-2

# %% [markdown]
# ## What to read next
#
# - [Optimal motion](../docs/optimal_motion.md): free duration, conditions on the way, parameters of the design, closed loops.
# - [Control](../docs/control.md): regulators and sampled controllers.
