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
# # Contact: a walker that walks downhill
#
# The simplest walker (Garcia, Chatterjee, Ruina and Coleman, 1998) has a mass at its hip and two straight legs with tiny
# masses at their feet. It walks down a gentle slope without any drive. The notebook describes it, finds its gait, judges
# whether the gait is stable, and compares all with published digits.

# %%
import numpy as np
import sympy as sp

import symdyn as sd

# %% [markdown]
# ## 1. Description
#
# The axes lie along the slope and across it, so that gravity leans. The hip moves freely in the plane; a leg hangs on it by
# a hinge. Each foot is a contact with the ground: rigid, with so much friction that it does not slip, and without
# restitution. The feet of straight legs scuff in mid-swing. By convention that does not count: while the expression
# `ignored` is positive, an open contact does not close.

# %%
x, y, left, right = sd.coordinates("x y left right")
slope, m = sd.parameters("slope m")
system = sd.System("walker", gravity=[sp.sin(slope), -sp.cos(slope)])
system.defaults = {slope: 0.009, m: 1e-4}

carrier, hip = system.add_body("carrier"), system.add_body("hip", mass=1.0)
system.add_joint(sd.Prismatic("along", system.ground, carrier, axis=[1, 0], coordinate=x))
system.add_joint(sd.Prismatic("across", carrier, hip, axis=[0, 1], coordinate=y))
for q, other in ((left, right), (right, left)):
    leg = system.add_body(q.name, mass=m, inertia=0, com=[0, -1])
    system.add_joint(sd.Revolute(f"{q.name}_joint", hip, leg, coordinate=q))
    system.add_contact(sd.Contact(f"{q.name}_foot", leg, system.ground, shape=sd.contacts.Point([0, -1]), friction=5,
                                  ignored=0.15 - sp.sin(q) + sp.sin(other)))
walker = system.compile()

# %% [markdown]
# ## 2. A step
#
# Right after a heel strike the stance leg leans back by an angle $a$ and turns at a rate $w$; the other leg leans forward.
# Both feet are on the ground, the rear one leaves it at once.

# %%
a, w = 0.1939, -0.2039
strike = [-np.sin(a), np.cos(a), a, -a], [-np.cos(a) * w, -np.sin(a) * w, w, np.cos(2 * a) * w]
first = walker.simulate((0, 1), *strike, rtol=1e-10)
print(first)
for name, foot in first.contacts.items():
    print(name, [(f"{t:.4f} s", mode) for t, mode in foot.switches])

# %% [markdown]
# ## 3. The gait
#
# A step is a period after which the legs have changed their roles, and the way along the slope does not come back. The
# motion is made periodic across all switches of the contacts, by exact sensitivities.

# %%
middle = first.x[-1]
gait = walker.periodic(3.1, middle[:4], middle[4:], cyclic=[x], exchange=[(left, right)], rtol=1e-12)
factors = np.sort(np.abs(gait.multipliers))[::-1]
print(f"period {gait.period:.7f}, stable: {gait.stable}, multipliers {factors[:3].round(5)}")

# %% [markdown]
# As the feet get lighter, the period goes to the published 3.0961058680777, and the multipliers of this, the shorter of the
# two gaits on this slope, to 4.00386 and 0.45959: the gait is not stable.

# %%
lighter = walker.periodic(3.1, middle[:4], middle[4:], params={m: 1e-6}, cyclic=[x], exchange=[(left, right)], rtol=1e-12)
finer = np.sort(np.abs(lighter.multipliers))[::-1]
print(f"period {lighter.period:.7f}, multipliers {finer[:3].round(5)}")
assert abs(lighter.period - 3.0961058680777) < 2e-5
assert abs(finer[0] - 4.00386) < 1e-3 and abs(finer[2] - 0.45959) < 1e-3

# %% [markdown]
# ## 4. Three steps to look at
#
# The stored start of the gait lies in the middle of a step. Forces of the contacts are arrows. In a notebook, `walk.view()`
# alone shows a page in which the walker can be turned and scrubbed.

# %%
walk = walker.simulate(np.linspace(0, 3 * gait.period, 400), gait.x[:4], gait.x[4:], rtol=1e-11)
impacts = sum(len(foot.impacts.t) for foot in walk.contacts.values())
print(f"{walk['x'][-1] - walk['x'][0]:.4f} leg lengths in three steps, with {impacts} impacts")
walk.picture([0.0, 1.0, 2.0])

# %%
walk.plot(show=["left", "right", "energy"])

# %%
walk.view()
