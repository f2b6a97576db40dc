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
# # A pendulum by hand, as in the lecture
#
# A mass on a massless rod is derived in both ways of the lecture's chapter 3, with every matrix printed: by the embedding
# technique, in its angle, and by the augmented formulation, in its Cartesian coordinates with a multiplier. Both are
# simulated, and the period and the tension of the rod are compared with their closed forms.

# %%
import matplotlib.pyplot as plt
import numpy as np
import scipy.special
import sympy as sp
from IPython.display import Math, display
from sympy import latex

import symdyn as sd

# %% [markdown]
# ## 1. Newton's law
#
# The $n$-frame has $x$ to the right and $y$ upward; the rod of length $l$ is hinged at the origin. Newton's law of the mass is
#
# $$\mathbf M\, \ddot{\mathbf r} = \mathbf F + \mathbf F_c, \qquad \mathbf M = \begin{bmatrix} m & 0 \\ 0 & m \end{bmatrix},
# \quad \mathbf F = \begin{bmatrix} 0 \\ -m g \end{bmatrix}$$
#
# with the unknown force $\mathbf F_c$ of the rod. It points along the rod.

# %%
m, g, l = sd.parameters("m g l", positive=True)
M, F = sp.diag(m, m), sp.Matrix([0, -m * g])

# %% [markdown]
# ## 2. Embedding: one coordinate
#
# The angle $\theta$ from the downward vertical says where the mass is. Every $\theta$ fulfils the constraint.

# %%
theta = sd.coordinates("theta")
r = sp.Matrix([l * sp.sin(theta), -l * sp.cos(theta)])
J = r.jacobian([theta])
Jdot = J.diff(sd.t)
display(Math(rf"\mathbf r = {latex(r)} \qquad \mathbf J = \frac{{\partial \mathbf r}}{{\partial \theta}} = {latex(J)} "
             rf"\qquad \dot{{\mathbf J}} = {latex(Jdot)}"))

# %% [markdown]
# The velocity is $\dot{\mathbf r} = \mathbf J\, \dot\theta$, and the acceleration
# $\ddot{\mathbf r} = \mathbf J\, \ddot\theta + \dot{\mathbf J}\, \dot\theta$. The rod pulls at right angles to $\mathbf J$,
# so that $\mathbf J^T \mathbf F_c = 0$. Newton's law multiplied by $\mathbf J^T$ is therefore an equation without the force
# of the rod:
#
# $$\tilde{\mathbf M}\, \ddot\theta + \tilde{\mathbf k} = \tilde{\mathbf F}, \qquad
# \tilde{\mathbf M} = \mathbf J^T \mathbf M \mathbf J, \quad
# \tilde{\mathbf k} = \mathbf J^T \mathbf M \dot{\mathbf J}\, \dot\theta, \quad
# \tilde{\mathbf F} = \mathbf J^T \mathbf F$$

# %%
M_tilde = sp.simplify(J.T * M * J)
k_tilde = sp.simplify(J.T * M * Jdot * theta.dot)
F_tilde = J.T * F
display(Math(rf"\tilde{{\mathbf M}} = {latex(M_tilde)} \qquad \tilde{{\mathbf k}} = {latex(k_tilde)} \qquad "
             rf"\tilde{{\mathbf F}} = {latex(F_tilde)}"))

# %% [markdown]
# `sd.embedding` does the same steps from the position map.

# %%
embedded = sd.embedding([theta], r, M, F, name="pendulum_in_its_angle")
display(*embedded.equations)
print(sd.prove(embedded.M_tilde, M_tilde), sd.prove(embedded.k_tilde, k_tilde), sd.prove(embedded.F_tilde, F_tilde), sep=", ")
assert embedded.explicit("accelerations")[0] == -g * sp.sin(theta) / l

# %% [markdown]
# The force of the rod follows afterwards, $\mathbf F_c = \mathbf M \ddot{\mathbf r} - \mathbf F$. Its component towards the
# hinge is the tension: the part of the weight along the rod, and the centripetal force.

# %%
tension = sp.simplify(-(embedded.F_c.T * r)[0] / l)
print("tension =", tension)
assert sp.simplify(tension - m * (g * sp.cos(theta) + l * theta.dot**2)) == 0

# %% [markdown]
# ## 3. Augmented: two coordinates and a multiplier
#
# The Cartesian coordinates are kept, and the rod is the constraint $C = x^2 + y^2 - l^2 = 0$. Differentiated twice it is
# $\mathbf C_r \ddot{\mathbf r} = F^d$, and the force of the rod is $-\mathbf C_r^T \lambda$:
#
# $$\begin{bmatrix} \mathbf M & \mathbf C_r^T \\ \mathbf C_r & 0 \end{bmatrix}
# \begin{bmatrix} \ddot{\mathbf r} \\ \lambda \end{bmatrix} = \begin{bmatrix} \mathbf F \\ F^d \end{bmatrix}$$

# %%
x, y = sd.coordinates("x y")
augmented = sd.augmented([x, y], mass=[m, m], force=list(F), constraints=[x**2 + y**2 - l**2], name="pendulum_in_x_and_y")
display(Math(rf"{latex(augmented.matrix)} {latex(sp.Matrix([x.ddot, y.ddot, sp.Symbol('lambda')]))} = {latex(augmented.rhs)}"))

# %% [markdown]
# The multiplier is the solution of these three equations. The force of the rod has the size $2 l \lambda$, which must be the
# tension.

# %%
lam = augmented.lam[0].subs({x.dot: l * sp.cos(theta) * theta.dot, y.dot: l * sp.sin(theta) * theta.dot}).subs({x: r[0], y: r[1]})
print("2 l lambda =", sp.simplify(2 * l * lam))
assert sp.simplify(2 * l * lam - tension) == 0

# %% [markdown]
# ## 4. Both move alike
#
# The pendulum is released at rest, 2 rad from the vertical.

# %%
numbers, start = {m: 2.0, g: 9.81, l: 1.2}, 2.0
times = np.linspace(0, 6, 601)
by_angle = embedded.compile().simulate(times, q=[start], params=numbers, rtol=1e-11)
by_x_and_y = augmented.compile().simulate(times, q=[1.2 * np.sin(start), -1.2 * np.cos(start)], params=numbers, rtol=1e-11)
angle = by_angle["theta"]
distance = np.hypot(by_x_and_y["x"] - 1.2 * np.sin(angle), by_x_and_y["y"] + 1.2 * np.cos(angle)).max()
print(f"largest distance {distance:.0e} m; the rod keeps its length to {np.abs(by_x_and_y.constraint_violation).max():.0e}")
assert distance < 1e-8

# %% [markdown]
# ## 5. Two closed forms
#
# The period of a swing of any size is $T = 4 \sqrt{l/g}\; K(\sin^2(\theta_0/2))$ with the complete elliptic integral $K$. In
# the motion it is twice the time between two passages through the vertical. The energy gives the tension:
# $m g\,(3 \cos\theta - 2 \cos\theta_0)$.

# %%
swing = sd.System("swing", gravity=[0, -g])
bob = swing.add_body("bob", mass=m, com=[0, -l])
swing.add_joint(sd.Revolute("hinge", swing.ground, bob, theta))
swing.add_event("vertical", theta)
passes = swing.compile().simulate((0, 6), q=[start], params=numbers, rtol=1e-12).events["vertical"].t
period = 4 * np.sqrt(1.2 / 9.81) * scipy.special.ellipk(np.sin(start / 2) ** 2)
print(f"period {2 * (passes[1] - passes[0]):.10f} s, closed form {period:.10f} s")
assert abs(2 * (passes[1] - passes[0]) - period) < 1e-9

pull = 2 * 1.2 * by_x_and_y.lam[:, 0]
closed = 2.0 * 9.81 * (3 * np.cos(angle) - 2 * np.cos(start))
print(f"tension differs by at most {np.abs(pull - closed).max():.0e} N of {pull.max():.1f} N; least {pull.min():.2f} N")
assert np.abs(pull - closed).max() < 1e-6

# %% [markdown]
# Above the horizontal the tension becomes negative: the rod pushes. A mass on a thread would leave its circle there.

# %%
figure, (left, right) = plt.subplots(1, 2, figsize=(9, 3.6), layout="constrained", width_ratios=[1, 1.6])
left.plot(by_x_and_y["x"], by_x_and_y["y"], color="C0")
for k in range(0, 101, 10):
    left.plot([0, by_x_and_y["x"][k]], [0, by_x_and_y["y"][k]], color="0.7", linewidth=1)
left.plot(0, 0, "^", color="0.3")
left.set(xlabel="x [m]", ylabel="y [m]", aspect="equal", title="every 0.1 s of the first swing")
right.plot(times, pull, label=r"$2 l \lambda$")
right.plot(times[::20], closed[::20], "o", fillstyle="none", label="closed form")
right.axhline(0, color="0.5", linewidth=0.8)
right.set(xlabel="t [s]", ylabel="tension [N]", ylim=(-15, 95))
right.legend(loc="upper center", ncols=2)
for axes in (left, right):
    axes.grid(color="0.9")
plt.show()

# %% [markdown]
# ## What to read next
#
# - [A vehicle on a rotating track](vehicle_on_rotating_track.ipynb): the embedding technique with two coordinates.
# - [Chapter 3 of the lecture](chapter_3_multibody.ipynb), compared with its slides.
# - [The embedding technique](../docs/theory/embedding.md) and [the augmented formulation](../docs/theory/augmented.md).
