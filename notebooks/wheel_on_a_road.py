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
# # A car's wheel on a road
#
# A quarter of a car: a body on spring and damper, a wheel on its tyre, a rough road. How much does the passenger feel, and
# when does the tyre lose the road? The spectrum of the acceleration is compared with its closed form.

# %%
import matplotlib.pyplot as plt
import numpy as np
import sympy as sp
from IPython.display import display

import symdyn as sd

# %% [markdown]
# ## 1. The model
#
# Body and wheel move up and down, each counted from where it rests. The tyre only pushes: its force is the static load and
# what the road adds, but never below zero.

# %%
z_s, z_u = sd.coordinates("z_s z_u")
m_s, m_u, k_s, c_s, k_t, g = sd.parameters("m_s m_u k_s c_s k_t g", positive=True)
h = sd.inputs("h")

car = sd.System("quarter_car")
body, wheel = car.add_body("body", mass=m_s), car.add_body("wheel", mass=m_u)
car.add_joint(sd.Prismatic("up", car.ground, body, axis=[0, 0, 1], parent_point=[0, 0, sp.Rational(7, 10)], coordinate=z_s))
car.add_joint(sd.Prismatic("hop", car.ground, wheel, axis=[0, 0, 1], parent_point=[0, 0, sp.Rational(3, 10)], coordinate=z_u))
suspension = k_s * (z_u - z_s) + c_s * (z_u.dot - z_s.dot)
weight = (m_s + m_u) * g
tyre = sp.Max(0, weight + k_t * (h - z_u))
car.add_force(body, [0, 0, suspension])
car.add_force(wheel, [0, 0, tyre - weight - suspension])
car.draw(body, sd.shapes.Box([0.8, 0.5, 0.1], center=[0, 0, 0.25]), color="steelblue")
car.draw(body, sd.shapes.Line([(0, 0, 0.2)], 5.0, to=(wheel, (0, 0, 0))), color="0.45")  # spring and damper
car.draw(wheel, sd.shapes.Cylinder([0, -0.1, 0], [0, 0.1, 0], 0.3), color="0.25")
car.defaults = {m_s: 400, m_u: 40, k_s: 20e3, c_s: 1500, k_t: 180e3, g: 9.81}
module = car.compile()
values = {str(p): value for p, value in car.defaults.items()}
display(car)

# %% [markdown]
# ## 2. From road to body
#
# The linear equations about rest give the amplitude of the body's acceleration per metre of road at every frequency. Two
# lines of algebra give the same: with $Z = k_s + i\omega c_s$,
#
# $$\begin{bmatrix}Z - m_s\omega^2 & -Z\\ -Z & Z + k_t - m_u\omega^2\end{bmatrix}\begin{bmatrix}z_s\\ z_u\end{bmatrix}
# = \begin{bmatrix}0\\ k_t h\end{bmatrix}$$

# %%
linear = module.linearize()
print(linear.modes())


def closed_form(w, c):
    """Amplitude of the body's acceleration per metre of road, 1/s^2, at w rad/s with the damper c."""
    Z = values["k_s"] + 1j * w * c
    matrix = np.array([[Z - values["m_s"] * w**2, -Z], [-Z, Z + values["k_t"] - values["m_u"] * w**2]])
    return abs(-(w**2) * np.linalg.solve(matrix, [0, values["k_t"]])[0])


def gain(w, linear=linear):
    """The same of linear equations x_dot = A x + B h."""
    return abs(-(w**2) * np.linalg.solve(1j * w * np.eye(4) - np.array(linear.A), np.array(linear.B)[:, 0])[0])


omega = 2 * np.pi * np.geomspace(0.2, 30, 200)
assert np.allclose([gain(w) for w in omega], [closed_form(w, values["c_s"]) for w in omega], rtol=1e-9)

# %% [markdown]
# For any spring and damper, at $\omega^2 = k_t/m_u$ the gain is $k_t/m_s$: the sum of the equations of both
# bodies does not contain them. No suspension improves comfort there (Hedrick and Butsuen, *Invariant properties of
# automotive suspensions*, 1990).

# %%
figure, axes = plt.subplots(figsize=(8, 3.6), layout="constrained")
for damper in (500, 1500, 4500):
    other = module.linearize(params={"c_s": damper})
    axes.loglog(omega / (2 * np.pi), [gain(w, other) for w in omega], label=f"$c_s$ = {damper} N s/m")
fixed, level = np.sqrt(values["k_t"] / values["m_u"]), values["k_t"] / values["m_s"]
axes.plot(fixed / (2 * np.pi), level, "ko", fillstyle="none", label="invariant point")
axes.set(xlabel="frequency [Hz]", ylabel="acceleration per road height [1/s²]")
axes.grid(color="0.9", which="both")
axes.legend()
plt.show()
assert abs(gain(fixed) / level - 1) < 1e-9

# %% [markdown]
# ## 3. A rough road
#
# ISO 8608 describes roads by the spectral density of their height, $G_d(n) = G_0 (n/n_0)^{-2}$ with $n_0$ = 0.1 cycles per
# metre; a road of class A has $G_0$ = 16e-6 m³. At the speed $v$ it is a sum of waves, one for each frequency, with random
# phases. They all repeat after 20 s.

# %%
speed, roughness, period = 20.0, 16e-6, 20.0
f = np.arange(10, 301) / period
density = roughness * 0.1**2 * speed / f**2          # m^2/Hz
amplitudes = np.sqrt(2 * density / period)
phases = np.random.default_rng(1).uniform(0, 2 * np.pi, len(f))


def road(t):
    """Height of the road under the wheel, m."""
    return float(np.sum(amplitudes * np.sin(2 * np.pi * f * t + phases)))


t = np.linspace(0, 2 * period, 8001)
ride = module.simulate(t, inputs={h: lambda t, state: road(t)}, rtol=1e-7)
print(ride)

# %% [markdown]
# In the second twenty seconds the start is forgotten. The acceleration has the mean square that the closed form gives, wave
# by wave, as long as the tyre stays on the road.

# %%
z_body, z_wheel, v_body, v_wheel = (ride[name] for name in ("z_s", "z_u", "z_s_dot", "z_u_dot"))
acceleration = (values["k_s"] * (z_wheel - z_body) + values["c_s"] * (v_wheel - v_body)) / values["m_s"]
second = slice(4000, 8000)
simulated = np.sqrt(np.mean(acceleration[second] ** 2))
expected = np.sqrt(sum((closed_form(2 * np.pi * k, values["c_s"]) * a) ** 2 / 2 for k, a in zip(f, amplitudes)))
static = (values["m_s"] + values["m_u"]) * values["g"]
force = static + values["k_t"] * (np.array([road(s) for s in t]) - z_wheel)
print(f"rms acceleration {simulated:.5f} m/s², closed form {expected:.5f}; least tyre force {force.min():.0f} N")
assert abs(simulated / expected - 1) < 1e-4 and force.min() > 0

# %%
spectrum = 2 * np.abs(np.fft.rfft(acceleration[second]) / 4000) ** 2 * period
figure, (left, right) = plt.subplots(1, 2, figsize=(9, 3.4), layout="constrained")
left.loglog(f, spectrum[10:301], ".", markersize=3, label="simulated")
left.loglog(f, [closed_form(2 * np.pi * k, values["c_s"]) ** 2 * d for k, d in zip(f, density)], label="closed form")
left.set(xlabel="frequency [Hz]", ylabel="acceleration [(m/s²)²/Hz]")
left.legend()
right.plot(t[second] - period, force[second] / 1000)
right.set(xlabel="$t$ [s]", ylabel="tyre force [kN]", xlim=(0, 5))
for axes in (left, right):
    axes.grid(color="0.9")
plt.show()

# %% [markdown]
# ## 4. Where the wheel lifts off
#
# A road twice as high doubles everything: that is linear. On one of class E, sixteen times as high, the wheel leaves the
# ground, and the closed form no longer holds.

# %%
for factor in (2, 16):
    rough = module.simulate(t[:4001], inputs={h: lambda t, state, factor=factor: factor * road(t)}, rtol=1e-6)
    load = static + values["k_t"] * (factor * np.array([road(s) for s in rough.t]) - rough["z_u"])
    print(f"{factor} times as high: in the air {np.mean(load <= 0):.1%} of the time, largest load {load.max() / 1000:.1f} kN")
assert np.mean(load <= 0) > 0

# %%
rough.view()

# %% [markdown]
# ## What to read next
#
# - [Contact](../docs/contact.md): bodies that touch, stick and lift off.
# - [Linear analysis](../docs/linear_analysis.md): modes, and how they depend on parameters.
