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
# # Parameters fitted to measurements
#
# A drum on a torsion spring is turned and let go, and its angle is recorded. Which stiffness, which friction, which
# inertia? And how well does the record determine them? The measurements here are computed, so that the true values are
# known.

# %%
import numpy as np
import scipy.stats
import sympy as sp

import symdyn as sd

# %% [markdown]
# ## 1. The model
#
# Viscous friction, and dry friction that is smoothed over 0.02 rad/s.

# %%
phi = sd.coordinates("phi")
I, k, d, tau_c = sd.parameters("I k d tau_c", positive=True)

drum = sd.System("drum")
body = drum.add_body("body", mass=1, inertia=[I, I, I])
drum.add_joint(sd.Revolute("axle", drum.ground, body, phi))
drum.add_joint_force("axle", -k * phi - d * phi.dot - tau_c * sp.tanh(phi.dot / 0.02))
drum.defaults = {I: 0.02, k: 0.5, d: 0.002, tau_c: 0.005}
module = drum.compile()

# %% [markdown]
# ## 2. Two records
#
# Ten seconds each, 100 times a second, with noise of 2 mrad. In the second one a known weight of 0.01 kg m² was bolted
# on.

# %%
truth = {I: 0.0173, k: 0.62, d: 0.0031, tau_c: 0.0042}
added, noise, t = 0.01, 0.002, np.linspace(0, 10, 1001)
rng = np.random.default_rng(7)


def record(extra):
    """The measured angle with an inertia added."""
    motion = module.simulate(t, q=[1.0], params={**truth, I: truth[I] + extra}, rtol=1e-10)
    return motion["phi"] + noise * rng.normal(size=len(t))


alone, heavier = record(0.0), record(added)

# %% [markdown]
# ## 3. What one record does not determine
#
# A single record fixes the frequency, so $k/I$, but not $k$ and $I$ alone: all torques may be twice as large if the
# inertia is. The fit finds that out by itself and names the combination.

# %%
single = sd.fit(module, sd.Experiment(t, {phi: alone}, q=[1.0]), [I, k, d, tau_c], initial=[phi])
print(single)
assert single.undetermined

# %% [markdown]
# ## 4. Both records
#
# With the known weight bolted on, everything is determined. An experiment has parameters of its own for what was
# exchanged; the inertia is written as what is unknown plus what was added.

# %%
J = sd.parameters("J", positive=True)
both = sd.System("drum_with_weight")
body = both.add_body("body", mass=1, inertia=[I + J] * 3)
both.add_joint(sd.Revolute("axle", both.ground, body, phi))
both.add_joint_force("axle", -k * phi - d * phi.dot - tau_c * sp.tanh(phi.dot / 0.02))
both.defaults = {**drum.defaults, J: 0}
loaded = both.compile()

experiments = [sd.Experiment(t, {phi: alone}, q=[1.0], params={J: 0.0}),
               sd.Experiment(t, {phi: heavier}, q=[1.0], params={J: added})]
found = sd.fit(loaded, experiments, [I, k, d, tau_c], initial=[phi], noise={phi: noise})
print(found)
for symbol, value in truth.items():
    error = abs(found.values[symbol.name] - value)
    print(f"{symbol.name:6} off by {error / value:7.2%}, {error / found.deviations[symbol.name]:.1f} standard deviations")
    assert error < 4 * found.deviations[symbol.name]

# %% [markdown]
# ## 5. Are the residuals noise?
#
# The residuals should look like the noise of the sensor alone.

# %%
found.plot()

# %% [markdown]
# The sum of their squares, by that of the noise, is close to the number of degrees of freedom; and neighbours do not
# resemble each other, as they would if the model lacked something.

# %%
left = [values / noise for values in found.residuals.values()]
chi_square = sum((r**2).sum() for r in left)
neighbours = max(abs(np.corrcoef(r[:-1], r[1:])[0, 1]) for r in left)
low, high = scipy.stats.chi2.interval(0.999, found.degrees)
print(f"chi-square {chi_square:.0f}, 99.9 % of such fits between {low:.0f} and {high:.0f}")
print(f"neighbours correlate by {neighbours:.2f}")
assert low < chi_square < high and neighbours < 4 / np.sqrt(len(t))

# %% [markdown]
# ## What to read next
#
# - [Derivatives](../docs/derivatives.md): sensitivities, priors and bounds, periodic motions.
# - [Inertia from measurements](../docs/identification.md): forces measured instead of motions, no integration.
