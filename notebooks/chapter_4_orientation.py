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
# # Chapter 4: orientation
#
# The orientation of a body takes three numbers. Three angles do it, but every choice of them fails somewhere: gimbal lock. Four
# Euler parameters with one condition never fail. This is the lecture's chapter 4, from the arm of three links to
# $\boldsymbol\omega = 2 \mathbf E \dot{\mathbf p}$.
#
# Throughout, $\mathbf R = {}^n\mathbf R_b$ takes components in the body's frame $b$ to components in the fixed frame $n$. The
# functions of `sd.rotation` take symbols and numbers alike.

# %%
import matplotlib.pyplot as plt
import numpy as np
import sympy as sp
from IPython.display import Math, display
from mpl_toolkits.mplot3d.art3d import Poly3DCollection
from scipy.integrate import solve_ivp
from sympy import latex

import symdyn as sd
from symdyn import rotation


def show(name, value):
    display(Math(rf"{name} = {latex(value)}"))


# %% [markdown]
# ## 1. Euler angles
#
# The joints of the lecture's arm turn about $z$, then $y$, then $x$, each about an axis of the link before. These are ZYX Euler
# angles: yaw $\psi$, pitch $\theta$, roll $\phi$. The angular velocity is the sum of three simple ones, $\boldsymbol\omega =
# \mathbf G \dot{\boldsymbol\gamma}$. The columns of $\mathbf G$ are the three axes.

# %%
psi, theta, phi = angles = sd.coordinates("psi theta phi")
G = rotation.euler_rates("ZYX", angles)
show(r"\mathbf R", rotation.from_euler("ZYX", angles))
show(r"\mathbf G", G)
show(r"\det \mathbf G", sp.trigsimp(G.det()))

# %% [markdown]
# ## 2. Gimbal lock
#
# Where $\cos\theta = 0$ the first and the third axis are parallel. Two joints do the same, one direction is lost, and no rates
# of the angles give an angular velocity along it. All twelve sequences have such a place: those with three different axes at
# $\pm 90°$, the others at $0$ and $180°$.

# %%
print(rotation.gimbal_lock("ZYX"))
print(rotation.gimbal_lock("ZXZ"))
try:
    rotation.euler_rates_inverse("ZYX", [0.3, np.pi / 2, 0.0])
except sd.GimbalLock as error:
    print("\nGimbalLock:", error)

# %% [markdown]
# The lock is felt before it is reached. The condition number of $\mathbf G$ is the ratio of the fastest to the slowest angular
# velocity that rates of size 1 give.

# %%
second = np.radians(np.linspace(-179.75, 179.75, 720))
figure, axes = plt.subplots(figsize=(8, 3.6), layout="constrained")
for sequence in ("ZYX", "ZXZ"):
    several = np.stack([np.full_like(second, 0.4), second, np.full_like(second, -0.3)], axis=-1)
    axes.semilogy(np.degrees(second), np.linalg.cond(rotation.euler_rates(sequence, several)), label=sequence)
axes.set(xlabel="second angle, degrees", ylabel="condition of G", xlim=(-180, 180), ylim=(0.9, 1e3),
         xticks=range(-180, 181, 45))
axes.set_title("G has no inverse at two values of the second angle")
axes.legend(frameon=False)
plt.show()

# %% [markdown]
# ## 3. Which angles belong to a rotation?
#
# Away from lock there are two solutions. The arm reaches the same orientation in two ways.

# %%
R = rotation.from_euler("ZYX", [0.5, 1.1, -0.4])
found = rotation.to_euler(R, "ZYX")
print(found)
print(found.fixed)
for solution in (found.angles, found.other):
    print("R comes back to", f"{abs(rotation.from_euler('ZYX', solution) - R).max():.0e}")

# %% [markdown]
# At lock there is a family. The lecture's grip points upward, ${}^n\mathbf i_{b_3} = [0\ 0\ 1]^T$, with ${}^n\mathbf j_{b_3} =
# [0\ 1\ 0]^T$: only the sum $\psi + \phi$ is determined. Every choice of $\psi$ gives the same orientation.

# %%
grip = sp.Matrix([[0, 0, -1], [0, 1, 0], [1, 0, 0]])
family = rotation.to_euler(grip, "ZYX")
print(family)
show(r"\psi,\ \theta,\ \phi", family.at(first=psi).T)
show(r"\mathbf R", sp.simplify(rotation.from_euler("ZYX", family.at(first=psi))))

# %% [markdown]
# ## 4. Finite rotations do not commute
#
# A book is turned by 90° about two of its own axes, in both orders. The ends differ.

# %%
corners = np.array([[x, y, z] for x in (-1.5, 1.5) for y in (-1, 1) for z in (-0.3, 0.3)])
faces = {"#4477aa": (0, 1, 3, 2), "#ee6677": (4, 5, 7, 6), "#228833": (0, 1, 5, 4), "#ccbb44": (2, 3, 7, 6),
         "#66ccee": (0, 2, 6, 4), "#aa3377": (1, 3, 7, 5)}
turn_z, turn_y = rotation.about("Z", np.pi / 2), rotation.about("Y", np.pi / 2)
figure = plt.figure(figsize=(10, 3.4), layout="constrained")
for place, (title, R) in enumerate({"before": np.eye(3), "first z, then y": turn_z @ turn_y,
                                    "first y, then z": turn_y @ turn_z}.items()):
    axes = figure.add_subplot(1, 3, place + 1, projection="3d")
    placed = corners @ R.T
    axes.add_collection3d(Poly3DCollection([placed[list(f)] for f in faces.values()], facecolors=list(faces), edgecolors="black",
                                           linewidths=0.6))
    corner = np.array([0.6, -1.9, -1.0])
    for direction, letter in zip(np.eye(3), "xyz"):
        axes.quiver(*corner, *(0.8 * direction), color="black", linewidth=1)
        axes.text(*(corner + 1.1 * direction), letter, ha="center", va="center")
    axes.set(xlim=(-1.6, 1.6), ylim=(-1.6, 1.6), zlim=(-1.6, 1.6), title=title)
    axes.set_box_aspect((1, 1, 1), zoom=1.1)
    axes.set_axis_off()
    axes.view_init(25, 30)
plt.show()

# %% [markdown]
# Small rotations do commute, to first order: $\mathbf R \approx \mathbf 1 + \tilde{\boldsymbol\delta}$, and the small vectors
# $\boldsymbol\delta$ add. The remainder falls with the square of the angle. Therefore angular velocities can be added and
# angles cannot.

# %%
for angle in (1.0, 0.1, 0.01, 0.001):
    one, other = rotation.about("Z", angle), rotation.about("Y", angle)
    swapped = abs(one @ other - other @ one).max()
    linear = abs(one @ other - rotation.infinitesimal([0, angle, angle])).max()
    print(f"angle {angle:5}:  order matters by {swapped:.1e},  1 + skew(delta) is off by {linear:.1e}")

# %% [markdown]
# ## 5. Euler's theorem
#
# Every rotation is one about a single axis $\mathbf a$ by one angle, whatever led to it. The axis has the same components in
# both frames, $\mathbf R \mathbf a = \mathbf a$. The same matrix has two readings: it turns a vector within one frame,
# $\mathbf r_{P'} = \mathbf R\, \mathbf r_P$, and it takes the components of one vector from $b$ to $n$.

# %%
a = sp.Matrix(sp.symbols("a_x a_y a_z"))
turn = sp.Symbol("phi")
S = rotation.skew(list(a))
rodrigues = sp.eye(3) + sp.sin(turn) * S + (1 - sp.cos(turn)) * S**2
difference = (rodrigues - rotation.about(list(a), turn, unit=True)).subs(a[2]**2, 1 - a[0]**2 - a[1]**2)
print("1 + sin(phi) S + (1 - cos(phi)) S^2 is R:", sp.expand(difference).is_zero_matrix)

axis, angle = rotation.axis_angle(turn_z @ turn_y)
print(f"two quarter turns are one by {np.degrees(angle):.0f} degrees about {np.round(axis, 4)}")

# %%
start = np.array([1.0, 0.0, 0.0])
quarter, whole = np.linspace(0, np.pi / 2, 40), np.linspace(0, angle, 80)
by_angles = np.concatenate([rotation.about("Z", quarter) @ start, turn_z @ rotation.about("Y", quarter) @ start])
by_axis = rotation.about(axis, whole) @ start

figure = plt.figure(figsize=(5.2, 4.4), layout="constrained")
axes = figure.add_subplot(projection="3d", computed_zorder=False)
u, v = np.meshgrid(np.linspace(0, 2 * np.pi, 37), np.linspace(0, np.pi, 19))
axes.plot_wireframe(np.cos(u) * np.sin(v), np.sin(u) * np.sin(v), np.cos(v), color="0.85", linewidth=0.4)
axes.plot(*by_angles.T, linewidth=2, label="two Euler angles")
axes.plot(*by_axis.T, linewidth=2, label="one rotation about a")
axes.plot(*np.stack([-1.3 * axis, 1.3 * axis]).T, "k--", linewidth=1, label="axis a")
axes.plot(*start, "ko")
axes.plot(*by_axis[-1], "ks")
for direction, letter in zip(np.eye(3), "xyz"):
    axes.text(*(1.2 * direction), letter, ha="center", va="center")
axes.set_title("Two ways of a point from ● to ■, seen from below")
axes.set_box_aspect((1, 1, 1), zoom=1.4)
axes.set_axis_off()
axes.view_init(-20, 40)
figure.legend(frameon=False, loc="outside lower center", ncols=3)
plt.show()

# %% [markdown]
# ## 6. Euler parameters
#
# $\mathbf p = [\cos\frac\phi2,\ \mathbf a \sin\frac\phi2]$ has four numbers and one condition, $\mathbf p^T \mathbf p = 1$. With
# the two matrices $\mathbf E$ and $\bar{\mathbf E}$:
#
# $$\mathbf R = \mathbf E \bar{\mathbf E}^T \qquad \boldsymbol\omega = 2 \mathbf E \dot{\mathbf p} \qquad
# \dot{\mathbf p} = \tfrac12 \mathbf E^T \boldsymbol\omega$$

# %%
p = sp.Matrix(sd.coordinates("theta_0:4"))
E, E_bar = rotation.E(p), rotation.E_bar(p)
show(r"\mathbf E", E)
show(r"\mathbf E \bar{\mathbf E}^T", (E * E_bar.T).applyfunc(sp.expand))
norm = p.dot(p)
assert (E_bar.T * E_bar - (norm * sp.eye(4) - p * p.T)).applyfunc(sp.expand).is_zero_matrix
assert (E * p).applyfunc(sp.expand).is_zero_matrix

# %% [markdown]
# The lecture's proof writes $\bar{\mathbf E}^T \bar{\mathbf E} = \mathbf 1 + \mathbf p \mathbf p^T$. It is $\mathbf 1 - \mathbf p
# \mathbf p^T$, which the lines above check for norm 1: the matrix takes away what is along $\mathbf p$. The result of the proof
# stays, because that term vanishes with $\mathbf E \mathbf p = \mathbf 0$.
#
# Now through the lock: a body turns with constant $\boldsymbol\omega$ about a horizontal axis that lies near its own $y$ axis.
# The pitch comes near 90°. The nearer, the faster the yaw and roll angles must run; the Euler parameters do not notice.

# %%
t = np.linspace(0, np.pi, 1500)
figure, (left, right) = plt.subplots(1, 2, figsize=(10, 3.6), layout="constrained")
for tilt in (0.2, 0.05):
    omega = np.array([tilt, 1.0, 0.0])
    motion = rotation.about(omega, np.linalg.norm(omega) * t)
    gamma = rotation.to_euler(motion, "ZYX").angles
    gamma_dot = rotation.euler_rates_inverse("ZYX", gamma) @ omega
    p_dot = rotation.parameters_rate(rotation.to_parameters(motion), omega)
    left.plot(t, np.unwrap(gamma[:, 0]), label=rf"yaw $\psi$, tilt {tilt}")
    right.semilogy(t, np.linalg.norm(gamma_dot, axis=-1), label=f"Euler angles, tilt {tilt}")
right.semilogy(t, np.linalg.norm(p_dot, axis=-1), "k--", label="Euler parameters")
left.set(xlabel="t, s", ylabel="rad", title="Near the lock the yaw runs half a turn")
right.set(xlabel="t, s", ylabel="size of the rates, 1/s", title="Rates that the same motion asks for")
for axes in (left, right):
    axes.legend(frameon=False)
plt.show()

# %% [markdown]
# Integrated from $\dot{\mathbf p} = \frac12 \mathbf E^T \boldsymbol\omega$, the body passes the lock itself, with the pitch
# going straight through 90°.

# %%
omega = np.array([0.0, 1.0, 0.0])
solution = solve_ivp(lambda t, p: rotation.E(p).T @ omega / 2, (0, 10), [1.0, 0.0, 0.0, 0.0], rtol=1e-10, atol=1e-12)
end = solution.y[:, -1]
print(f"norm after 10 s: 1 {np.linalg.norm(end) - 1:+.0e}")
print(f"error of R: {abs(rotation.from_parameters(rotation.normalized(end)) - rotation.about('Y', 10.0)).max():.0e}")

# %% [markdown]
# ## 7. The slides, formula by formula
#
# All derivations of the chapter, typed from the slides, next to what follows from rotations, frames and the equations of the two
# arms. Where a slide is wrong, a proof that does not use the formula shows it.

# %%
chapter = sd.compare("4")
display(chapter)

# %%
for case in chapter:
    for formula, error in case.errata:
        print(f"line {formula.slide.line:4}  {formula.name}: {error.why}")
