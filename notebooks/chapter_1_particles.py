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
# # A particle seen from frames that move
#
# The examples of the lecture's chapter 1 with frames: a bus, an elevator, a turning disk, the earth. Every derivation of the
# chapter is then compared with what its slides print.

# %%
import matplotlib.pyplot as plt
import numpy as np
import sympy as sp
from IPython.display import Math, display
from sympy import latex

import symdyn as sd

n = sd.Frame("n")
k = sp.Matrix([0, 0, 1])
m, g = sp.symbols("m g", positive=True)

# %% [markdown]
# ## 1. An elevator: what the scale shows
#
# The frame of the elevator is at the height $z$. The person stands still in it, so that all forces balance there, the inertial
# force $-m \ddot z\, \mathbf k$ among them. The scale shows the force $N$ it pushes with.

# %%
z = sd.coordinates("z")
elevator = n.frame("elevator", origin=[0, 0, z])
person = elevator.point("person", [0, 0, 1])
N = -(person.inertial_forces(m, frame=elevator).total - m * g * k)[2]
display(Math(rf"N = {latex(sp.factor(N))}"))

# %% [markdown]
# At rest it shows $m g$, on the way up more, and in free fall nothing. For a person of 70 kg:

# %%
for motion, acceleration in {"at rest": 0, "up, 2 m/s^2": 2, "down, 2 m/s^2": -2, "free fall": -9.81}.items():
    print(f"{motion:16}{float(N.subs({m: 70, g: 9.81, z.ddot: acceleration})):8.1f} N")

# %% [markdown]
# ## 2. A strap in an accelerating bus
#
# In the bus the strap hangs still. Its tension balances the weight and the inertial force together, so that it hangs along the
# sum of both, at the angle $\arctan(\ddot s / g)$.

# %%
s = sd.coordinates("s")
bus = n.frame("bus", origin=[0, s, 0])
handle = bus.point("handle", [0, 2, 1])
inertial = handle.inertial_forces(m, frame=bus).total
T = m * g * k - inertial
display(Math(rf"\mathbf T = {latex(T)} \qquad \tan\varphi = {latex(T[1] / T[2])}"))

# %% [markdown]
# The same angle is the equilibrium of a pendulum that is hung in the bus, from its equation of motion:

# %%
phi = sd.coordinates("phi")
a, l = sp.symbols("a l", positive=True)
y_handle, z_handle = a * sd.t**2 / 2 - l * sp.sin(phi), -l * sp.cos(phi)
strap = sd.embedding([phi], [y_handle, z_handle], [m, m], force=[0, -m * g])
at_rest = {phi: sp.atan(a / g), phi.dot: 0}
display(Math(rf"\ddot\varphi = {latex(sp.simplify((strap.F_tilde - strap.k_tilde)[0].subs(at_rest)))}"))

# %% [markdown]
# ## 3. A ball in a slot of a turning disk
#
# Person B stands at the centre of a disk that turns with constant $\omega$ and lets a ball run along a slot with constant
# $v$. Person E stands on the ground.

# %%
v, omega = sp.symbols("v omega", positive=True)
disk = n.frame("b", rotation=sd.rotation.about("Z", omega * sd.t))
ball = disk.point("A", [v * sd.t, 0, 0])
display(ball.acceleration_parts(through=disk, seen_from=n, components=disk))

# %% [markdown]
# The acceleration seen from B is zero. From the ground there are two parts: the centripetal one, to the centre, and the
# Coriolis one, across the slot. The lecture derives the latter in two halves: the speed along the slot turns with the disk, and
# the speed across grows with the distance. Each gives $\omega v$.
#
# The same in forces: the slot must push with $2 m \omega v$, and seen from the disk this push balances the Coriolis force.

# %%
display(ball.inertial_forces(m, frame=disk))

# %% [markdown]
# Now a ball that is thrown with constant $v$ over the disk, without a slot. This one moves on a straight line for E, and B
# sees it deflected to the right.

# %%
thrown = n.point("A", [v * sd.t, 0, 0])
values = {v: 1.0, omega: 0.8}
t = np.linspace(0, 3, 61)

figure, panels = plt.subplots(1, 2, figsize=(9, 4.4), sharex=True, sharey=True, layout="constrained")
for panel, observer, title in zip(panels, (disk, n), ("seen by B, on the disk", "seen by E, on the ground")):
    for point, colour, label in ((ball, "C0", "ball in the slot"), (thrown, "C3", "thrown ball")):
        path = point.path(seen_from=observer, t=t, values=values)
        panel.plot(path[:, 0], path[:, 1], colour, label=label)
        panel.plot(path[::10, 0], path[::10, 1], "o", color=colour, markersize=4)
    panel.add_patch(plt.Circle((0, 0), 3, fill=False, color="0.6"))
    panel.plot(0, 0, "k+")
    panel.set(title=title, xlabel="x, m", aspect="equal")
panels[0].set_ylabel("y, m")
figure.legend(*panels[0].get_legend_handles_labels(), loc="outside upper center", ncols=2, frameon=False)
plt.show()

# %% [markdown]
# The dots are half a second apart. Each ball is straight for one observer and bent for the other, and at every instant both are
# at the same distance from the centre. The path of the thrown ball for B follows from the inertial forces alone, since no
# other force acts on it: the acceleration that B sees is the sum of the centrifugal and the Coriolis one.

# %%
x, y = sd.coordinates("x y")
free = disk.point("A", [x, y, 0])
felt = free.inertial_forces(1, frame=disk)
seen = thrown.position(of=disk)
motion = {x: seen[0], y: seen[1], x.dot: sd.rate(seen[0]), y.dot: sd.rate(seen[1])}
display(Math(rf"\ddot x = {latex(felt.total[0])} \qquad \ddot y = {latex(felt.total[1])}"))
display(sp.simplify(felt.total.subs(motion) - thrown.acceleration(seen_from=disk)).T)

# %% [markdown]
# ## 4. A projectile along a meridian
#
# It moves along a meridian of the turning earth with the constant angular velocity $\gamma$. With the unit vector
# $\mathbf b$ to the meridian, turning with $\omega$, the lecture finds $\mathbf a = R \cos\gamma t\, \mathbf b'' - 2 \gamma R
# \sin\gamma t\, \mathbf b' - \gamma^2 \mathbf r$: two centripetal parts and the Coriolis part. In axes that turn with the
# meridian (away from the axis of the earth, to the east, along the axis to the north):

# %%
R, gamma = sp.symbols("R gamma", positive=True)
earth = n.frame("earth", rotation=sd.rotation.about("Z", omega * sd.t))
projectile = earth.point("P", [R * sp.cos(gamma * sd.t), 0, R * sp.sin(gamma * sd.t)])
terms = projectile.acceleration_parts(through=earth, seen_from=n, components=earth)
display(terms)

# %% [markdown]
# Only the Coriolis part has a component to the east. On the way north it is negative, to the west: so much acceleration a body
# needs to stay on the meridian. Without it the body drifts to the east, to its right, and has to be aimed to the north-west.

# %%
earth_values = {R: 6371e3, omega: 7.292e-5, gamma: 250 / 6371e3}
latitude = np.linspace(0, 90, 91)
t = np.radians(latitude) / (250 / 6371e3)

figure, axes = plt.subplots(figsize=(8, 3.6), layout="constrained")
for name, part in {"earth's rotation": terms.centripetal, "flight": terms.relative, "Coriolis": terms.coriolis}.items():
    size = sp.lambdify(sd.t, part.subs(earth_values).T.tolist()[0])
    axes.plot(latitude, [1e3 * np.linalg.norm(size(instant)) for instant in t], label=name)
axes.set(xlabel="latitude, degrees", ylabel="size of the acceleration, mm/s²", xlim=(0, 90), ylim=(0, None))
axes.set_title("Three terms for an airliner that flies north with 250 m/s")
axes.legend(frameon=False)
plt.show()

# %% [markdown]
# ## 5. Any moving frame
#
# A frame that turns and whose origin moves has all five parts (lecture, chapter 1.7). The parts are derived from the frame, and
# add up to the second derivative of the position:

# %%
X, Y, theta, x, y = sd.coordinates("X Y theta x y")
b = n.frame("b", rotation=sd.rotation.about("Z", theta), origin=[X, Y, 0])
P = b.point("P", [x, y, 0])
parts = P.acceleration_parts(through=b, seen_from=n, components=n)
display(sp.simplify(parts.total - sd.rate(sd.rate(P.position(of=n)))).T)

# %% [markdown]
# ## 6. The slides, formula by formula
#
# All derivations of the chapter, typed from the slides, next to what follows from frames. Where a slide is wrong, a proof that
# does not use the formula shows it.

# %%
chapter = sd.compare("1")
display(chapter)

# %%
for case in chapter:
    for formula, error in case.errata:
        print(f"line {formula.slide.line:4}  {formula.name}: {error.why}")
