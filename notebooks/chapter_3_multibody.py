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
# # Multibody dynamics: reactions, embedding, multipliers
#
# The lecture's chapter 3 derives the motion of constrained bodies in two ways. The embedding technique writes the position as
# a function of independent coordinates, so that the reaction never appears. The augmented formulation keeps the Cartesian
# coordinates, adds the constraint as an equation, and finds the reaction as $-\mathbf C_r^T \lambda$. Here both are compared with
# each other, and with the slides. (The embedding technique step by step: see `vehicle_on_rotating_track`.)

# %%
import matplotlib.pyplot as plt
import numpy as np
import sympy as sp
from IPython.display import Math, display
from scipy.integrate import solve_ivp
from sympy import latex

import symdyn as sd

# %% [markdown]
# ## 1. One reaction, found three times
#
# A vehicle on a straight track, $\theta$ below the horizontal. By Newton's law the track carries the part of the weight that
# is normal to it, $m g \cos\theta$. The embedding technique gives the reaction afterwards, as $\mathbf M \ddot{\mathbf r} -
# \mathbf F^e$. The augmented formulation gives it with the motion, from the constraint $y + x \tan\theta + A = 0$.

# %%
x, y = sd.coordinates("x y")
(q1,) = sd.coordinates("q1:2")
m, g, theta, A = sd.parameters("m g theta A")
weight = [0, -m * g]

embedded = sd.embedding([q1], [q1 * sp.cos(theta), -q1 * sp.sin(theta)], [m, m], weight, name="vehicle_on_track")
augmented = sd.augmented([x, y], [m, m], weight, [y + x * sp.tan(theta) + A], name="vehicle_on_track")
reaction = (-augmented.C_r.T * augmented.lam).applyfunc(sp.simplify)
unknowns = r"\begin{bmatrix} \ddot x \\ \ddot y \\ \lambda \end{bmatrix}"
display(Math(rf"{latex(augmented.matrix)} {unknowns} = {latex(augmented.rhs)} \qquad "
             rf"\lambda = {latex(augmented.lam[0])} \qquad -\mathbf C_r^T \lambda = {latex(reaction)}"))

newton = m * g * sp.cos(theta) * sp.Matrix([sp.sin(theta), sp.cos(theta)])
assert reaction.equals(newton)
assert embedded.F_c.equals(newton)

# %% [markdown]
# ## 2. The pendulum with a multiplier
#
# $C = x^2 + y^2 - l^2$. Differentiated twice, it shows that $\mathbf C_r \ddot{\mathbf r} = F^d$ with
# $F^d = -(\mathbf C_r \dot{\mathbf r})_{\mathbf r}\, \dot{\mathbf r}$.

# %%
length = sp.Symbol("l")
pendulum = sd.augmented([x, y], [m, m], weight, [x**2 + y**2 - length**2], name="pendulum", defaults={m: 1, g: 9.81, length: 1})
display(Math(rf"\mathbf C_r = {latex(pendulum.C_r)} \qquad F^d = {latex(pendulum.F_d[0])}"))

# %% [markdown]
# The slides have $F^d = 0$ here: they note that $\mathbf C_r \dot{\mathbf r} = 2 x \dot x + 2 y \dot y$ vanishes in every motion
# along the circle, and then differentiate the zero. But the derivative by $\mathbf r$ compares points off the circle, where
# the product does not vanish. The comparison finds it, entry by entry, with a proof that does not use the formula itself.

# %%
comparison = sd.compare("pendulum-augmented")
display(comparison)

# %% [markdown]
# The effect of the missing term: both right-hand sides are integrated from rest, with the rod horizontal. It is the centripetal
# acceleration that keeps the mass on its circle.

# %%
printed, derived = next((f.printed, f.derived) for f in comparison.formulas if f.name == "right side")
state = sp.symbols("x_P y_P x_P_dot y_P_dot")


def path(right_side):
    plain = {s: sp.Symbol(s.name) for s in right_side.free_symbols}
    right_side = right_side.xreplace(plain).subs({sp.Symbol("m"): 1, sp.Symbol("g"): 9.81})
    matrix = sp.Matrix([[1, 0, 2 * state[0]], [0, 1, 2 * state[1]], [2 * state[0], 2 * state[1], 0]])
    acceleration = sp.lambdify([state], list(matrix.LUsolve(right_side)[:2]))
    return solve_ivp(lambda _, s: [*s[2:], *acceleration(s)], (0, 1.2), [1, 0, 0, 0], rtol=1e-9, atol=1e-12, max_step=0.02)


figure, axes = plt.subplots(figsize=(5, 4.2), layout="constrained")
turn = np.linspace(-np.pi, 0, 100)
axes.plot(np.cos(turn), np.sin(turn), color="0.8", lw=6, label="circle")
for right_side, label in ((derived, "$F^d = -2(\\dot x^2 + \\dot y^2)$"), (printed, "$F^d = 0$, as printed")):
    run = path(right_side)
    axes.plot(*run.y[:2], label=label)
    print(f"largest distance from the circle: {np.abs(np.hypot(*run.y[:2]) - 1).max():.1e} m with {label}")
axes.set(xlabel="x [m]", ylabel="y [m]", aspect="equal", xlim=(-1.6, 1.6), ylim=(-2, 0.4), title="path of the mass")
axes.legend(loc="lower left")
plt.show()

# %% [markdown]
# ### The tension
#
# The slides of chapter 3.4 take $m g \cos q_1$ for the tension, the part of the weight along the wire. This holds at rest. In
# motion the wire pulls the mass around the curve as well. Released with the rod horizontal, it carries $3 m g$ at the bottom,
# three times what the slide says.

# %%
motion = pendulum.compile().simulate(t=np.linspace(0, 2.4, 200), q={x: 1.0, y: 0.0}, u={x.dot: 0.0, y.dot: 0.0}, rtol=1e-10)
tension = 2 * motion.lam[:, 0] * np.hypot(*motion.q.T)
of_weight = -9.81 * motion.q[:, 1]
figure, axes = plt.subplots(figsize=(6, 2.8), layout="constrained")
axes.plot(motion.t, tension / 9.81, label="from the multiplier")
axes.plot(motion.t, of_weight / 9.81, "--", label="$m g\\,\\cos q_1$, as printed")
axes.set(xlabel="t [s]", ylabel="tension / (m g)", title="tension of the wire", ylim=(-0.2, 4))
axes.grid(color="0.9")
axes.legend(loc="upper left", ncols=2)
plt.show()
assert np.allclose(tension, 3 * of_weight, atol=1e-4)
print(f"largest tension: {tension.max() / 9.81:.3f} m g")

# %% [markdown]
# ## 3. Vehicle and rotating track in absolute coordinates
#
# Five coordinates $[x_v, y_v, x_t, y_t, \theta]$, three constraints: the track is hinged at $(x_c, y_c)$, and the vehicle is
# on it.

# %%
xv, yv, xt, yt, angle = r = sd.coordinates("x_v y_v x_t y_t theta")
m_v, m_t, I_t = sd.parameters("m_v m_t I_t")
mass = [m_v, m_v, m_t, m_t, I_t]
constraints = [xt, yt, -yv + xv * sp.tan(angle)]  # the hinge is the origin
track = sd.augmented(r, mass, [0, -m_v * g, 0, -m_t * g, 0], constraints, name="vehicle_and_track",
                     defaults={m_v: 1, m_t: 2, I_t: 0.5, g: 9.81})
display(Math(rf"\mathbf C_r = {latex(track.C_r)} \qquad \mathbf F^d = {latex(track.F_d)}"))

# %% [markdown]
# No motion that the track allows may violate the constraints: $\mathbf C_r \mathbf J = 0$, with the velocity transformation
# $\mathbf J$ of the embedding technique. With $-\tan\theta$ in the corner, as the slides have it, the product does not vanish.

# %%
q1, q2 = sd.coordinates("q1:3")
r_of_q = sp.Matrix([-q1 * sp.cos(q2), -q1 * sp.sin(q2), 0, 0, q2])
both = sd.embedding([q1, q2], r_of_q, mass, [0, -m_v * g, 0, -m_t * g, 0], name="vehicle_and_track")
on_track = dict(zip(r, r_of_q))
slide = track.C_r.copy()
slide[2, 0] = -sp.tan(angle)
products = [(C_r.subs(on_track) * both.J).applyfunc(sp.simplify) for C_r in (track.C_r, slide)]
display(Math(rf"\mathbf C_r \mathbf J = {latex(products[0])} \qquad \text{{with the sign of the slides: }} {latex(products[1])}"))
assert products[0].is_zero_matrix

# %% [markdown]
# ### Where the entries come from
#
# `explain` takes an entry of $\tilde{\mathbf M}$ or $\tilde{\mathbf k}$ apart: which coordinate of $\mathbf r$, hence which body,
# contributes what. The coordinates 1 and 2 belong to the vehicle, 5 is the inclination of the track. The centrifugal terms of the
# vehicle cancel in the second equation, since they point along the track; the Coriolis terms add up to
# $2 m_v q_1 \dot q_1 \dot q_2$.

# %%
velocity_terms = both.explain("k_tilde", 1)  # rows and columns count from 0
display(velocity_terms)
assert sp.simplify(velocity_terms.of(kind="centrifugal")) == 0
assert sp.simplify(velocity_terms.of(kind="Coriolis") - 2 * m_v * q1 * q1.dot * q2.dot) == 0

# %%
inertia = both.explain("M_tilde", 1, 1)
display(inertia)
assert sp.simplify(inertia.total - m_v * q1**2 - I_t) == 0
print(inertia)

# %% [markdown]
# With bodies that are modelled as such, the contributions carry their names. Larger matrices are easier to read with the short
# sines and cosines of robotics, here those of an arm of two links:

# %%
arm = sd.systems.two_link_arm().embedding()
display(arm.explain("k_tilde", 0), arm.latex("M_tilde", shorthand=True))

# %% [markdown]
# Both formulations give the same motion.

# %%
times = np.linspace(0, 1, 60)
start = {q1: 1.0, q2: -0.4, q1.dot: 0.0, q2.dot: -1.0}
by_embedding = both.compile().simulate(t=times, q={q1: 1.0, q2: -0.4}, u={q1.dot: 0.0, q2.dot: -1.0}, rtol=1e-10,
                                       params={m_v: 1, m_t: 2, I_t: 0.5, g: 9.81})
at_start = dict(zip(r, r_of_q.subs(start)))
rates = dict(zip([c.dot for c in r], (both.J * sp.Matrix([q1.dot, q2.dot])).subs(start)))
by_multipliers = track.compile().simulate(t=times, q={c: float(v) for c, v in at_start.items()},
                                          u={c: float(v) for c, v in rates.items()}, rtol=1e-10)
from_q = np.array([-by_embedding.q[:, 0] * np.cos(by_embedding.q[:, 1]), -by_embedding.q[:, 0] * np.sin(by_embedding.q[:, 1])]).T
difference = np.abs(by_multipliers.q[:, :2] - from_q).max()
print(f"largest difference between the two: {difference:.1e} m")
assert difference < 1e-7

# %% [markdown]
# ## 4. Actual and virtual work
#
# A particle on a slope whose inclination changes with time. In a virtual displacement, $\delta\mathbf r = \mathbf J\,\delta q$
# at a fixed time, the reaction does no work. In the actual displacement $d\mathbf r = \mathbf J\,dq + \mathbf r_t\,dt$ it does:
# the slope pushes while it turns. The slides ask for $d\mathbf r \cdot \mathbf F^c$ and leave the answer open; here it is.

# %%
omega = sp.Symbol("omega")
inclination = omega * sd.t
slope = sd.embedding([q1], [q1 * sp.cos(inclination), -q1 * sp.sin(inclination)], [m, m], weight, name="slope_in_motion")
r_t = sd.partial_rate(sp.Matrix(slope.explicit("r")))
virtual = sp.simplify((slope.J.T * slope.F_c)[0])
power = sp.simplify((r_t.T * slope.F_c)[0])
display(Math(rf"\mathbf J^T \mathbf F^c = {latex(virtual)} \qquad \mathbf r_t^T \mathbf F^c = {latex(power)}"))
assert virtual == 0
assert power != 0

# %% [markdown]
# ## 5. The chapter compared with its slides
#
# Every derivation of chapters 3.1 to 3.5, entry by entry. An entry is called wrong only where an independent proof shows it: a
# limit, an energy balance, numeric differentiation or another formulation.

# %%
sd.compare("3")
