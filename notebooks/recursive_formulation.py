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
# # The recursive formulation of a two-link arm
#
# The embedding technique forms one mass matrix for the whole mechanism. The recursive formulation goes from link to link
# instead: outwards for motions, inwards for forces. This is the lecture's chapter 5, on its own example, a two-link arm.
#
# The steps of the lecture are printed link by link and checked against each other. Then come numbers: the formulations agree,
# the faster one is found, and the arm's inertia is identified from measured torques.

# %%
import matplotlib.pyplot as plt
import numpy as np
import sympy as sp
from IPython.display import Math, display
from sympy import latex

import symdyn as sd


def show(name, value):
    display(Math(rf"{name} = {latex(value)}"))


def vanishes(matrix):
    return matrix.applyfunc(lambda e: sp.simplify(sp.expand(e, trig=True))).is_zero_matrix


# %% [markdown]
# ## 1. Description
#
# The arm moves in the vertical plane, $x$ to the right and $y$ upward. Link 1 turns about the shoulder $O_1$ by $q_1$, link 2
# about the elbow $O_2$ by $q_2$, relative to link 1. At $\mathbf q = 0$ the arm points along $x$. A motor drives each joint.

# %%
q1, q2 = sd.coordinates("q1 q2")
g, m1, I1, l_c1, l1, m2, I2, l_c2 = sd.parameters("g m1 I1 l_c1 l1 m2 I2 l_c2")
tau1, tau2 = sd.inputs("tau1 tau2")

arm = sd.System("arm", gravity=[0, -g])
link1 = arm.add_body("link1", mass=m1, inertia=I1, com=[l_c1, 0])
link2 = arm.add_body("link2", mass=m2, inertia=I2, com=[l_c2, 0])
shoulder = arm.add_joint(sd.Revolute("shoulder", arm.ground, link1, q1))
elbow = arm.add_joint(sd.Revolute("elbow", link1, link2, q2, parent_point=[l1, 0]))
arm.add_joint_force(shoulder, tau1, name="motor1")
arm.add_joint_force(elbow, tau2, name="motor2")
arm.defaults = {g: 9.81, m1: 2.0, I1: 0.042, l_c1: 0.25, l1: 0.5, m2: 1.0, I2: 0.013, l_c2: 0.2}

# %% [markdown]
# `arm.recursive()` instead of `arm.embedding()`, and that is all. The lecture's quantities of a link are requested by the name
# of its body.

# %%
equations = arm.recursive()
one, two = equations.link("link1"), equations.link("link2")
print("of each link:", ", ".join(dir(one)))

# %% [markdown]
# ## 2. From link to link
#
# Vectors have six entries, also in the plane: the angular ones first, then the linear ones. All of a link $i$ is in its own
# axes and about its origin, the joint $O_i$:
#
# $$\mathbf v_i = \begin{bmatrix} \boldsymbol\omega_i \\ \mathbf v_{O_i} \end{bmatrix} \qquad
# \mathbf f_i = \begin{bmatrix} \text{moment about } O_i \\ \text{force} \end{bmatrix}$$
#
# $\mathbf X_i$ takes motions from link $i-1$ to link $i$. Its transpose $\mathbf X_i^*$ takes forces the other way.

# %%
show(r"\mathbf X_1", one.X)
show(r"\mathbf X_2", two.X)
show(r"\mathbf X_2^*", two.X_star)
assert two.X_star == two.X.T

# %% [markdown]
# The motion subspace $\mathbf S_i$ says how the joint moves its link: both turn about $z$. An observer on the link sees it
# stand still, so its apparent rate of change $\mathring{\mathbf S}_i$ is zero.

# %%
show(r"\mathbf S_1 = \mathbf S_2", two.S)
assert one.S == two.S and two.S_ring.is_zero_matrix

# %% [markdown]
# ## 3. Outwards: velocities
#
# $$\mathbf v_i = \mathbf X_i \mathbf v_{i-1} + \mathbf S_i \dot q_i$$

# %%
show(r"\mathbf v_1", one.v)
show(r"\mathbf v_2", two.v)
assert vanishes(two.X * one.v + two.S * q2.dot - two.v)

# %% [markdown]
# With the velocities two things are known: the part $\mathbf c_i$ of the acceleration and the part $\mathbf p_i$ of the force
# that they alone bring about.
#
# $$\mathbf c_i = \mathring{\mathbf S}_i \dot q_i + \mathbf v_i \times \mathbf S_i \dot q_i \qquad
# \mathbf p_i = \mathbf v_i \times^* \mathbf I_i \mathbf v_i$$

# %%
show(r"\mathbf c_1^T", one.c.T)
show(r"\mathbf c_2^T", two.c.T)
show(r"\mathbf p_1^T", one.p.T)
show(r"\mathbf p_2", two.p)

# %% [markdown]
# ## 4. Inverse dynamics
#
# The accelerations are given, the torques are wanted. Outwards go the accelerations. They start from
# $\mathbf a_0 = [\mathbf 0;\ -\mathbf g]$: a base that accelerates upward loads every link as its weight does.
#
# $$\mathbf a_i = \mathbf X_i \mathbf a_{i-1} + \mathbf S_i \ddot q_i + \mathbf c_i$$

# %%
show(r"\mathbf a_2", two.a)
assert vanishes(two.X * one.a + two.S * q2.ddot + two.c - two.a)

# %% [markdown]
# Inwards go the forces through the joints. Each link adds what it needs itself. The torque is the part of the force along the
# joint.
#
# $$\mathbf f_i = \mathbf I_i \mathbf a_i + \mathbf p_i + \mathbf X_{i+1}^* \mathbf f_{i+1} \qquad
# \tau_i = \mathbf S_i^T \mathbf f_i$$

# %%
f_2 = two.I * two.a + two.p
f_1 = one.I * one.a + one.p + two.X_star * f_2
torques = sp.Matrix.vstack(one.S.T * f_1, two.S.T * f_2)

# %% [markdown]
# `one.f` and `two.f` give the same forces, and `tau` both torques. Mind that `tau` is what must be added to the loads that the
# description has already. Here these are the motors, so they are subtracted. Set to zero they leave the torques of the
# lecture.

# %%
show(r"\boldsymbol\tau", equations.tau)
without_motors = equations.tau.subs({tau1: 0, tau2: 0})
assert vanishes(without_motors - torques)

# %% [markdown]
# ### Three parts
#
# $$\boldsymbol\tau = \tilde{\mathbf M} \ddot{\mathbf q} + \mathbf C \dot{\mathbf q} + \text{gravity load}$$
#
# The mass matrix is the one that the embedding technique has. The Coriolis matrix $\mathbf C$ writes
# $\tilde{\mathbf k} = \mathbf C \dot{\mathbf q}$, and the gravity load is what holds the arm still.

# %%
M, C, load = equations.M_tilde, equations.coriolis, equations.gravity_load
show(r"\tilde{\mathbf M}", M)
show(r"\mathbf C", C)
show(r"\text{gravity load}", load)

# %%
rates, accelerations = sp.Matrix([q1.dot, q2.dot]), sp.Matrix([q1.ddot, q2.ddot])
assert vanishes(M * accelerations + C * rates + load - torques)
assert vanishes(C * rates - equations.k_tilde)

# %% [markdown]
# Many matrices give $\tilde{\mathbf k}$ when they are multiplied by $\dot{\mathbf q}$. With each of them
# $\dot{\mathbf q}^T (\dot{\tilde{\mathbf M}} - 2\mathbf C) \dot{\mathbf q} = 0$, as the energy demands. This one does more:
# $\dot{\tilde{\mathbf M}} - 2\mathbf C$ itself is skew-symmetric. Proofs of stability in control need that.

# %%
M_dot = M.diff(q1) * q1.dot + M.diff(q2) * q2.dot
skew = (M_dot - 2 * C).applyfunc(sp.simplify)
show(r"\dot{\tilde{\mathbf M}} - 2 \mathbf C", skew)
assert vanishes(skew + skew.T)

# %% [markdown]
# ## 5. Forward dynamics
#
# Now the torques are given, the accelerations are wanted. A link together with all that hangs on it behaves like one body
# with the articulated inertia $\mathbf I_i^A$ and the bias force $\mathbf p_i^A$:
#
# $$\mathbf f_i = \mathbf I_i^A \mathbf a_i + \mathbf p_i^A$$
#
# Nothing hangs on link 2, so its articulated inertia is its own.

# %%
show(r"\mathbf I_2^A = \mathbf I_2", two.I_A)
assert two.I_A == two.I and two.p_A == two.p

# %% [markdown]
# Link 1 carries link 2, but not in all directions: about the elbow link 2 gives way.
#
# $$\mathbf I_1^A = \mathbf I_1 + \mathbf X_2^* \left( \mathbf I_2^A - \mathbf I_2^A \mathbf S_2
# (\mathbf S_2^T \mathbf I_2^A \mathbf S_2)^{-1} \mathbf S_2^T \mathbf I_2^A \right) \mathbf X_2$$

# %%
show(r"\mathbf I_1^A", one.I_A)
moved = two.I_A * two.S
inertia = (two.S.T * moved)[0]
assert vanishes(one.I + two.X_star * (two.I_A - moved * moved.T / inertia) * two.X - one.I_A)

# %% [markdown]
# The bias force passes on what the velocities of link 2 and the motor in the elbow do.
#
# $$\mathbf p_1^A = \mathbf p_1 + \mathbf X_2^* \left( \mathbf p_2^A + \mathbf I_2^A \mathbf c_2 + \mathbf I_2^A \mathbf S_2
# (\mathbf S_2^T \mathbf I_2^A \mathbf S_2)^{-1} u_2 \right) \qquad
# u_2 = \tau_2 - \mathbf S_2^T (\mathbf I_2^A \mathbf c_2 + \mathbf p_2^A)$$

# %%
show(r"\mathbf p_1^A", one.p_A)
u2 = tau2 - (two.S.T * (two.I_A * two.c + two.p_A))[0]
assert vanishes(one.p + two.X_star * (two.p_A + two.I_A * two.c + moved * u2 / inertia) - one.p_A)

# %% [markdown]
# Outwards once more, and each acceleration follows from one division. No mass matrix was formed, and nothing was inverted.
#
# $$\ddot q_i = \frac{\tau_i - \mathbf S_i^T \left( \mathbf I_i^A (\mathbf X_i \mathbf a_{i-1} + \mathbf c_i) +
# \mathbf p_i^A \right)}{\mathbf S_i^T \mathbf I_i^A \mathbf S_i}$$
#
# Here are these formulas in numbers, at one state, compared with the embedding technique.

# %%
place, speed, torque = [0.3, 0.6], [1.0, -2.0], [1.5, -0.5]
numbers = {**arm.defaults, q1: place[0], q2: place[1], q1.dot: speed[0], q2.dot: speed[1], tau1: torque[0], tau2: torque[1]}
a, by_hand = sp.Matrix([0, 0, 0, 0, arm.defaults[g], 0]), []
for link, motor in ((one, tau1), (two, tau2)):
    X, S, c, I_A, p_A = (quantity.subs(numbers) for quantity in (link.X, link.S, link.c, link.I_A, link.p_A))
    by_hand.append((motor.subs(numbers) - (S.T * (I_A * (X * a + c) + p_A))[0]) / (S.T * I_A * S)[0])
    a = X * a + S * by_hand[-1] + c

embedded = arm.embedding().compile().rhs(0.0, [*place, *speed], inputs=torque)[2:]
print("link by link:", *[f"{float(value):.12f}" for value in by_hand])
print("embedding:   ", *[f"{value:.12f}" for value in embedded])
assert np.allclose(np.array(by_hand, dtype=float), embedded, rtol=1e-12)

# %% [markdown]
# ## 6. Both formulations agree
#
# The same comparison for a chain of three bodies in space, with compiled code, at a thousand random states. They differ in the
# last digits only. `equations.verify()` checks each formulation by itself; for recursive equations it also checks the Coriolis
# matrix.

# %%
chain = sd.systems.spatial_chain(n=3)
states = np.random.default_rng(1).uniform(-1, 1, (1000, 6))
recursive = chain.recursive().compile().evaluate("rhs", 0.0, states)
embedded = chain.embedding().compile().evaluate("rhs", 0.0, states)
difference = np.abs(recursive - embedded).max() / np.abs(embedded).max()
print(f"largest difference, relative to the largest acceleration: {difference:.1e}")
assert difference < 1e-10

# %% [markdown]
# ## 7. Which one is faster?
#
# Factorizing a mass matrix takes a number of operations that grows like $n^3$, articulated bodies take one that grows like $n$.
# But in a recursion each step waits for the one before, the longest chain of them through all links and back, while a
# processor can do many operations of a matrix side by side. So short chains are faster with the mass matrix, long ones with
# articulated bodies. Where links turn about parallel axes there is one more choice: frames that stay parallel to that of the
# link before.
#
# `system.compile()` derives the candidates and takes the one with the least predicted time. The report shows what it was
# chosen from. Here are four links in the plane.

# %%
print(sd.systems.n_link_pendulum(4).compile().report())

# %% [markdown]
# `system.equations()` chooses in the same way and gives the equations, which hold the table too. Twelve links in the plane are
# enough for articulated bodies. The mass matrix is not even derived: factorizing it alone would take more operations than they
# need in all. Bodies in space have more work to do in each link, so the mass matrix keeps up for longer.

# %%
def table(equations):
    print(equations.name)
    for c in equations.candidates:
        measured = "" if c.measured is None else f", measured {c.measured:.0f} ns"
        print(f"  {c.formulation:9} in {c.frames:8} frames: {c.operations:4} operations, longest chain {c.chain:3}, "
              f"predicted {c.predicted:3.0f} ns{measured}{'  <- chosen' if c.chosen else ''}")


table(sd.systems.n_link_pendulum(12).equations())
table(sd.systems.spatial_chain(12).equations())

# %% [markdown]
# A prediction is not a measurement, and where two candidates are close it may take the second best. `tune=True` compiles all
# of them, times them on this machine, and takes the fastest.

# %%
try:
    table(sd.systems.n_link_pendulum(12).equations(tune=True))
except sd.CompilerNotFound as error:
    print(error)

# %% [markdown]
# ## 8. What can be identified
#
# Suppose that the masses, centres of mass and moments of inertia of the arm are unknown. Its lengths and $g$ are known, and
# torques are measured while it moves. The torques are linear in the inertial parameters, but not every parameter has an
# effect of its own. The base parameters are those combinations that can be found from the motion, and no more is needed to
# compute it.

# %%
base = equations.base_parameters()
print(base)
show(r"\mathbf Y_b", base.regressor)
assert vanishes(base.regressor * base.expressions - without_motors)

# %% [markdown]
# So $\boldsymbol\tau = \mathbf Y_b \boldsymbol\pi_b$. Six unknown parameters were described, four numbers are enough.
#
# ### Measured motions
#
# The real arm differs from its description. It is moved along sums of sines, and its torques are read with noise of
# 0.1 N m. The computer plays the real arm; the identification sees the motion and the noisy torques only.

# %%
real = {m1: 2.3, I1: 0.055, l_c1: 0.22, m2: 1.2, I2: 0.011, l_c2: 0.24}
module = equations.compile()
noise = 0.1


def motion(t, seed):
    """q, q_dot, q_ddot, each (times, 2): three sines a joint."""
    rng = np.random.default_rng(seed)
    amplitude, phase = rng.uniform(0.2, 0.6, (3, 2)), rng.uniform(0, 2 * np.pi, (3, 2))
    omega = 2 * np.pi * np.array([[0.3, 0.4], [0.7, 0.9], [1.3, 1.1]])
    angle = omega * t[:, None, None] + phase
    return [np.sum(amplitude * part, axis=1) for part in (np.sin(angle), omega * np.cos(angle), -omega**2 * np.sin(angle))]


def measured_torques(q, u, ud, seed):
    return module.inverse_dynamics(q, u, ud, params=real) + np.random.default_rng(seed).normal(0, noise, q.shape)


t = np.linspace(0, 10, 501)
q, u, ud = motion(t, seed=1)
torques = measured_torques(q, u, ud, seed=2)

# %% [markdown]
# ### Least squares
#
# The compiled module evaluates $\mathbf Y_b$ along the motion, two rows an instant. All rows together are one linear
# system. Its solution comes with standard deviations. $\mathbf Y_b$ holds lengths and $g$, but no inertial parameter.

# %%
Y = module.evaluate("base_regressor", 0.0, np.hstack([q, u]), ud=ud).reshape(-1, len(base))
estimate = np.linalg.lstsq(Y, torques.ravel(), rcond=None)[0]
deviation = noise * np.sqrt(np.diag(np.linalg.inv(Y.T @ Y)))

described, true = base.values(), base.values(real)
print(f"{'':12}{'described':>10}{'real':>10}{'identified':>12}{'deviation':>11}")
for name, *row in zip(base.names, described, true, estimate, deviation, strict=True):
    print(f"{name:12}{row[0]:10.4f}{row[1]:10.4f}{row[2]:12.4f}{row[3]:11.4f}")
assert (np.abs(estimate - true) < 4 * deviation).all()

# %% [markdown]
# ### Another motion
#
# The proof is a motion that was not used for the fit. The identified parameters foretell its torques as well as the noise
# lets one see; the description is far off.

# %%
t = np.linspace(0, 4, 201)
q, u, ud = motion(t, seed=5)
Y = module.evaluate("base_regressor", 0.0, np.hstack([q, u]), ud=ud)
torques = measured_torques(q, u, ud, seed=6)

figure, axes = plt.subplots(2, 1, figsize=(8, 5), sharex=True, layout="constrained")
for k, (axis, joint) in enumerate(zip(axes, ("shoulder", "elbow"), strict=True)):
    axis.plot(t, torques[:, k], ".", color="0.6", markersize=4, label="measured")
    axis.plot(t, (Y @ described)[:, k], "--", color="C1", label="as described")
    axis.plot(t, (Y @ estimate)[:, k], color="C0", label="identified")
    axis.set(ylabel="torque [N m]", title=joint)
    axis.grid(color="0.9")
figure.legend(*axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=3)
axes[1].set(xlabel="t [s]")
plt.show()

missing = np.sqrt(np.mean((torques - Y @ estimate) ** 2))
print(f"measured less foretold torques, root mean square: {missing:.3f} N m; the noise has {noise:.3f} N m")
assert missing < 1.2 * noise

# %% [markdown]
# ## 9. What to read next
#
# - `two_link_arm`: the same arm by the embedding technique, then with motors that are controlled.
# - `vehicle_on_rotating_track`: the embedding technique step by step.
# - `a_new_mechanism`: from a description of your own to C.
# - [Describing mechanisms](../docs/describing_mechanisms.md): joints, loads, outputs (also Jacobians and accelerations of
#   points); [evaluating and simulating](../docs/numbers.md): files that stand alone; [command line](../docs/command_line.md).
#
# On the command line, `symdyn derive two_link_arm --formulation recursive --quantity I_A_1 coriolis` prints without any
# Python, and `symdyn report spatial_chain --tune` shows the table of candidates.
