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
# # Contact, impact and dry friction
#
# Bodies touch one-sidedly: a contact pushes and does not pull, and its friction is bounded by the normal force. A *rigid* contact
# is in one of three modes, open, sticking or sliding. In each of them the motion is smooth; the instants between them are located
# as events. This notebook goes from a ball that bounces to a block that sticks and slips, looks at states of rest and at
# derivatives of motions that hit, and ends with a contact that yields. Each number stands next to its closed form.

# %%
import matplotlib.pyplot as plt
import numpy as np
import sympy as sp

import symdyn as sd

G = 9.81

# %% [markdown]
# ## 1. A ball that bounces
#
# A ball falls from $h = 1$ m and keeps $e = 0.8$ of its speed at every impact. It falls for $\sqrt{2h/g}$, and flight $n$ lasts
# $2 v e^n/g$ with $v = \sqrt{2gh}$. The flights are a geometric series: infinitely many impacts end in finite time, at
#
# $$t_\infty = \sqrt{\frac{2h}{g}} + \frac{2v}{g}\,\frac{e}{1 - e}$$

# %%
y, e = sd.coordinates("y"), sd.parameters("e")
falling = sd.System("ball", gravity=[0, -G])
falling.defaults[e] = 0.8
ball = falling.add_body("ball", mass=1.0)
falling.add_joint(sd.Prismatic("height", falling.ground, ball, axis=[0, 1], coordinate=y))
falling.add_contact(sd.Contact("floor", ball, falling.ground, restitution=e))

module = falling.compile()
bouncing = module.simulate((0, 5), q=[1.0], rtol=1e-12)
floor = bouncing.contacts["floor"]

fall, speed = np.sqrt(2 / G), np.sqrt(2 * G)
times = fall + np.cumsum([0, *[2 * speed * 0.8**n / G for n in range(1, 50)]])
end = fall + 2 * speed / G * 0.8 / 0.2
print(f"times of 50 impacts: to {np.abs(floor.impacts.t[:50] - times).max():.1e} s")
print(f"at rest from {floor.rests[0]:.12f} s on, in closed form {end:.12f} s")

# %%
figure, (above, below) = plt.subplots(2, 1, figsize=(8, 5), sharex=True, layout="constrained")
above.plot(bouncing.t, bouncing["y"])
above.axvline(end, color="0.6", linestyle=":")
above.set_ylabel("height [m]")
below.stem(floor.impacts.t, floor.impacts.impulse[:, 0], markerfmt=".", basefmt=" ")
below.set_ylabel("impulse [N s]")
below.set_xlabel("t [s]")
below.set_title("Impulses fall by the factor e; the dotted line is the limit of the series", fontsize=10)
plt.show()

# %% [markdown]
# ## 2. Stick and slip
#
# A block on a belt is held by a spring. It sticks to the belt until the spring pulls with $\mu_s m g$, slips back, swinging about
# $\mu_k m g/k$, and sticks again where its speed is that of the belt.

# %%
static, kinetic, belt, k = 0.5, 0.3, 0.2, 100.0
x = sd.coordinates("x")
system = sd.System("belt", gravity=[0, -G])
band, slide, block = (system.add_body(name, mass=mass) for name, mass in (("band", 1.0), ("slide", 0.0), ("block", 1.0)))
system.add_joint(sd.Prismatic("drive", system.ground, band, axis=[1, 0], coordinate=sd.t * belt))
system.add_joint(sd.Prismatic("along", system.ground, slide, axis=[1, 0], coordinate=x))
system.add_joint(sd.Prismatic("across", slide, block, axis=[0, 1], coordinate=sd.coordinates("z")))
system.add_spring_damper(system.ground, block, point_a=[-1, 0], stiffness=k, length=1)
system.add_contact(sd.Contact("sole", block, band, friction=(static, kinetic)))

stick_slip = system.compile().simulate((0, 5), u=[belt, 0], rtol=1e-12, work=True)
sole = stick_slip.contacts["sole"]

w, begins, centre = np.sqrt(k), static * G / k, kinetic * G / k
period = (np.pi + 2 * np.arctan2(belt / w, begins - centre)) / w + 2 * (begins - centre) / belt
slips = np.array([t for t, mode in sole.switches if mode == "sliding"])
print(f"period {np.diff(slips).mean():.12f} s, in closed form {period:.12f} s")
print(f"energy balance closes to {np.abs(stick_slip.energy_balance['error']).max():.1e} J")

# %%
figure, axes = plt.subplots(1, 2, figsize=(10, 3.6), layout="constrained")
for mode, color in (("sticking", "tab:blue"), ("sliding", "tab:orange")):
    there = sole.mode == mode
    axes[0].plot(np.where(there, stick_slip.t, np.nan), np.where(there, stick_slip["x"], np.nan), color=color, label=mode)
    axes[1].plot(np.where(there, stick_slip["x"], np.nan), np.where(there, stick_slip["x_dot"], np.nan), color=color)
axes[0].set_xlabel("t [s]")
axes[0].set_ylabel("x [m]")
axes[0].set_ylim(-0.004, 0.07)
axes[0].legend(loc="upper center", ncols=2)
axes[1].set_xlabel("x [m]")
axes[1].set_ylabel("speed [m/s]")
axes[1].set_title("Stick and slip is a limit cycle", fontsize=10)
plt.show()

# %% [markdown]
# ## 3. A box tumbles to rest
#
# A box touches with its four corners, each a contact of its own. Red arrows are the forces of the contacts.

# %%
tilt, mu = sd.parameters("tilt mu")
tumbling = sd.System("box", gravity=[G * sp.sin(tilt), -G * sp.cos(tilt)])
tumbling.defaults.update({tilt: 0.0, mu: 0.4})
box = tumbling.add_body("box", mass=2.0, inertia=2.0 * (0.4**2 + 0.2**2) / 12)
tumbling.add_joint(sd.Planar("free", tumbling.ground, box, sd.coordinates("x y theta")))
tumbling.add_contact(sd.Contact("corner", box, tumbling.ground, shape=sd.contacts.Box([0.4, 0.2]), friction=mu, restitution=0.3))
tumbling.draw(box, sd.shapes.Box([0.4, 0.2, 0.1]))
tumbling.draw(tumbling.ground, sd.shapes.Line([[-0.4, 0, 0], [1.4, 0, 0]]))

resting = tumbling.compile()
rolled = resting.simulate((0, 1.5), q={"y": 0.5, "theta": 0.4}, u={"x_dot": 1.0, "theta_dot": 1.5}, rtol=1e-10)
rolled.picture([0, 0.3, 0.58, 1.5])

# %% [markdown]
# ## 4. Rest on a slope
#
# `rest` looks for a state of rest on contacts. Friction holds up to $\tan\alpha = \mu$; how the two corners share it cannot be
# known, which is reported, but their normal forces can.

# %%
state = resting.rest({"y": 0.1}, {"tilt": 0.2})
print(state)
print(f"sticks from {state.range('tilt')[0]:.9f} to {state.range('tilt')[1]:.9f} rad; atan(mu) = {np.arctan(0.4):.9f} rad")

# %% [markdown]
# ## 5. Derivatives of motions that hit
#
# Sensitivities go through impacts: a change moves the time of an impact, and goes through what happens there. After $n$ impacts
# the height at the time $T$ is
#
# $$y = v e^n \tau - \frac{g \tau^2}{2}, \qquad \tau = T - \frac{v}{g} - \sum_{k=1}^{n-1} \frac{2 v e^k}{g}$$

# %%
T, n = 3.0, 6
run = module.simulate(np.linspace(0, T, 601), q=[1.0], rtol=1e-12, sensitivities=[e])
E = sp.Symbol("E")
tau = T - speed / G - sum(2 * speed * E**j / G for j in range(1, n))
expected = sp.diff(speed * E**n * tau - G * tau**2 / 2, E).subs(E, 0.8)
print(f"dy/de = {run.sensitivity[e][-1, 0]:.12f} m, in closed form {float(expected):.12f} m")

figure, axes = plt.subplots(figsize=(8, 3.2), layout="constrained")
axes.plot(run.t, run.sensitivity[e][:, 0])
axes.set_xlabel("t [s]")
axes.set_ylabel("dy/de [m]")
axes.set_title("Derivative of the height by the restitution: it jumps from the second impact on", fontsize=10)
plt.show()

# %% [markdown]
# ## 6. A contact that yields
#
# A compliant contact is a load by the depth $d$ of penetration, here Hertz's, $N = k d^{3/2}$. Steel spheres that hit at 1 m/s
# go as deep as $d = (5 m v^2/(4 k))^{2/5}$ with the reduced mass $m$.

# %%
steel = sd.contacts.hertz(0.01, 2.1e11, 0.3, 0.02, 2.1e11, 0.3)
spheres = sd.System("spheres")
for name, mass in (("a", 0.03), ("b", 0.2)):
    body = spheres.add_body(name, mass=mass)
    spheres.add_joint(sd.Prismatic(f"along_{name}", spheres.ground, body, axis=[1, 0, 0]))
pair = (sd.contacts.Sphere(0.01), sd.contacts.Sphere(0.02))
spheres.add_contact(sd.Contact("touch", "a", "b", shape=pair, law="compliant", compliance=sd.contacts.Compliance(steel)))

hit = spheres.compile().simulate(np.linspace(0, 1e-4, 2001), q=[-0.03, 0], u=[1, 0], rtol=1e-12)
touch = hit.contacts["touch"]
depth = (5 * 0.03 * 0.2 / 0.23 / (4 * float(steel))) ** 0.4
print(f"deepest {-touch.gap.min() * 1e6:.4f} um, in closed form {depth * 1e6:.4f} um")

figure, axes = plt.subplots(figsize=(8, 3.2), layout="constrained")
axes.plot(hit.t * 1e6, touch.force[:, 0])
axes.set_xlabel("t [us]")
axes.set_ylabel("force [N]")
axes.set_title("Two steel spheres hit at 1 m/s", fontsize=10)
plt.show()

# %% [markdown]
# More: [Contact](../docs/contact.md) has the shapes, the laws, and what happens at a switch.
