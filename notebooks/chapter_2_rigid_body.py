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
# # One rigid body
#
# Chapter 2 of the lecture goes from two particles to the equations of motion of a rigid body. Its steps with particles and
# frames: moment equation, inertia, Euler angles; a body that tumbles; then every derivation of the chapter next to its slide.

# %%
import matplotlib.pyplot as plt
import numpy as np
import sympy as sp
from IPython.display import Math, display
from sympy import latex

import symdyn as sd
from symdyn.frames.rigid_body import center_of_mass, inertia_about_com, moment_equation, point_inertia, rotated_inertia

rotation = sd.rotation

# %% [markdown]
# ## 1. The moment equation, particle by particle
#
# A body with two particles moves and turns in any way. The sum of the moments that the particles need about the point $O$,
# $\sum \mathbf r_{i/O} \times m_i \ddot{\mathbf r}_{i/E}$, is the lecture's moment equation:
#
# $$\mathbf M_O = m\, \mathbf r_{G/O} \times \ddot{\mathbf r}_{O/E} + \boldsymbol\omega \times \mathbf I_O \boldsymbol\omega
# + \mathbf I_O \dot{\boldsymbol\omega}$$

# %%
phi, theta, psi, x, y, z = sd.coordinates("phi theta psi x y z")
m1, m2 = masses = sp.symbols("m_1 m_2", positive=True)
places = [sp.Matrix(sp.symbols(f"r_{k}x r_{k}y r_{k}z")) for k in (1, 2)]

n = sd.Frame("n")
b = n.frame("b", rotation=rotation.from_euler("XYZ", [phi, theta, psi]), origin=[x, y, z])
points = [b.point(f"P{k + 1}", list(place)) for k, place in enumerate(places)]
by_particles = sum((m * p.position(of=b, components=n).cross(p.acceleration(seen_from=n, components=n))
                    for m, p in zip(masses, points)), sp.zeros(3, 1))

positions = [p.position(of=b, components=n) for p in points]
by_inertia = moment_equation(point_inertia(masses, positions), b.angular_velocity(), b.angular_acceleration(), m1 + m2,
                             center_of_mass(masses, positions), b.acceleration())
difference = by_particles - by_inertia
symbols = sorted(difference.free_symbols, key=str)
values = np.random.default_rng(2).uniform(-1, 1, (len(symbols), 1000))
print(f"1000 random motions: the two differ by at most {abs(sp.lambdify(symbols, difference)(*values)).max():.0e} N m")

# %% [markdown]
# ## 2. Inertia
#
# $\mathbf I_O$ gathers the particles. Moved to the centre of mass it becomes the smallest possible; in turned axes,
# ${}^n\mathbf I = {}^n\mathbf R_b\, {}^b\mathbf I\, {}^b\mathbf R_n$, its principal moments stay.

# %%
display(Math(rf"\mathbf I_{{O,1}} = {latex(point_inertia([m1], [places[0]]).applyfunc(sp.factor))}"))

# %%
corners = np.array([[i, j, k] for i in (0, 0.3) for j in (0, 0.2) for k in (0, 0.1)])
eighth = np.full(8, 0.25)
about_corner, G = point_inertia(eighth, corners), center_of_mass(eighth, corners)
about_G = inertia_about_com(about_corner, 2.0, G)
turned = rotated_inertia(rotation.from_euler("XYZ", [0.3, 0.5, 0.7]), about_G)
with np.printoptions(precision=4, suppress=True):
    print("about a corner:", *about_corner, "about G:", *about_G, "about G, turned axes:", *turned, sep="\n")
    print("principal moments:", np.linalg.eigvalsh(about_G), np.linalg.eigvalsh(turned))

# %% [markdown]
# ## 3. Euler angles
#
# With x, y, z Euler angles, ${}^n\boldsymbol\omega = {}^n\mathbf G\, \dot{\boldsymbol\gamma}$. The columns of ${}^n\mathbf G$ are
# the axes of the three rotations. At $\theta = \pm 90°$ the first and the third are parallel.

# %%
n_G = rotation.euler_rates("XYZ", [phi, theta, psi], frame="n")
display(Math(rf"{{}}^n\mathbf G = {latex(n_G)} \qquad \det {{}}^n\mathbf G = {latex(sp.simplify(n_G.det()))}"))
assert sp.simplify(n_G * sp.Matrix([phi.dot, theta.dot, psi.dot]) - b.angular_velocity()).is_zero_matrix

# %% [markdown]
# ## 4. A body that tumbles
#
# No moment acts on the box. Nearly about its middle axis, it does not keep turning as it began: it turns over again and again.
# In the n-frame its angular momentum stays what it was, and the energy too.

# %%
box = sd.System("box", gravity=[0, 0, 0])
m, *principal = sp.symbols("m I_x I_y I_z", positive=True)
body = box.add_body("box", mass=m, inertia=sp.diag(*principal))
box.defaults = {m: 2.0, **dict(zip(principal, np.diag(about_G)))}
speeds = sd.speeds("omega_x omega_y omega_z")
box.add_joint(sd.Spherical("ball", box.ground, body, sd.coordinates("p0:4"), orientation=sd.EulerParameters(), speeds=speeds))
equations = box.embedding()
for equation in equations.equations:
    display(equation)

# %%
start = {speeds[0]: 0.01, speeds[1]: 5.0, speeds[2]: 0.01}
motion = equations.compile().simulate(t=np.linspace(0, 20, 801), q=[1, 0, 0, 0], u=start, rtol=1e-11, atol=1e-13)
n_momentum = np.array([rotation.from_parameters(p) @ about_G @ w for p, w in zip(motion.q, motion.u)])

figure, axes = plt.subplots(1, 2, figsize=(9, 3.4), layout="constrained", sharex=True)
for k, axis in enumerate("xyz"):
    axes[0].plot(motion.t, motion.u[:, k], label=rf"$\omega_{axis}$")
    axes[1].plot(motion.t, n_momentum[:, k], label=f"$H_{axis}$")
axes[0].set(xlabel="time, s", ylabel="rad/s", title="Angular velocity, b-frame")
axes[1].set(xlabel="time, s", ylabel="kg m²/s", title="Angular momentum, n-frame")
for panel in axes:
    panel.legend(frameon=False, loc="upper center", bbox_to_anchor=(0.5, -0.18), ncols=3)
plt.show()

# %%
print(f"change of energy {abs(motion.energy / motion.energy[0] - 1).max():.0e}, "
      f"of angular momentum {abs(n_momentum - n_momentum[0]).max() / np.linalg.norm(n_momentum[0]):.0e}")
assert abs(n_momentum - n_momentum[0]).max() < 1e-8

# %% [markdown]
# ## 5. The slides, formula by formula
#
# All derivations of the chapter, typed from the slides, next to what follows from frames and bodies. Two slides are wrong: an
# index, which changes the result, and the sense of an angular velocity, which does not.

# %%
chapter = sd.compare("2")
display(chapter)

# %%
for case in chapter:
    for formula, error in case.errata:
        print(f"line {formula.slide.line}  {formula.name}: {error.why}")
        print(f"           {error.evidence}")
