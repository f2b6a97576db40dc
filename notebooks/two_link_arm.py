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
# # A two-link arm reaches for a target
#
# From the description of an arm to its printed equations, to compiled code, to a controlled motion. The arm is that of the
# lecture, chapters 4.1 and 5.5 to 5.7, with gravity added.

# %%
import tempfile
from pathlib import Path

import numpy as np
import sympy as sp
from IPython.display import Image, Math, display
from sympy import latex

import symdyn as sd

# %% [markdown]
# ## 1. Description
#
# The arm moves in the vertical plane: $x$ to the right, $y$ upward. Link 1 turns about the shoulder by $q_1$, link 2 about
# the elbow by $q_2$, relative to link 1. At $\mathbf q = 0$ the arm points along $x$. Each link has a mass $m_i$, a moment of
# inertia $I_i$ about its centre of mass, a length $l_i$, and its centre of mass at the distance $l_{ci}$ from its joint. Two
# motors act in the joints.

# %%
q1, q2 = sd.coordinates("q1 q2")
g, m1, I1, l_c1, l1, m2, I2, l_c2, l2 = sd.parameters("g m1 I1 l_c1 l1 m2 I2 l_c2 l2")
tau1, tau2 = sd.inputs("tau1 tau2")

arm = sd.System("arm", gravity=[0, -g])
link1 = arm.add_body("link1", mass=m1, inertia=I1, com=[l_c1, 0])
link2 = arm.add_body("link2", mass=m2, inertia=I2, com=[l_c2, 0])
shoulder = arm.add_joint(sd.Revolute("shoulder", arm.ground, link1, q1))
elbow = arm.add_joint(sd.Revolute("elbow", link1, link2, q2, parent_point=[l1, 0]))
arm.add_joint_force(shoulder, tau1, name="motor1")
arm.add_joint_force(elbow, tau2, name="motor2")
arm.add_output("tip", sd.position(link2, [l2, 0]))
arm.add_output("tip_velocity", sd.velocity(link2, [l2, 0]))

# %% [markdown]
# Numbers are needed only to compute with. The links are uniform rods of 0.5 m and 0.4 m.

# %%
arm.defaults = {g: 9.81, m1: 2.0, I1: 2.0 * 0.5**2 / 12, l_c1: 0.25, l1: 0.5,
                m2: 1.0, I2: 1.0 * 0.4**2 / 12, l_c2: 0.2, l2: 0.4}

# %% [markdown]
# ## 2. Equations of motion
#
# ### The tip
#
# Position and velocity of the end effector (lecture, chapter 4.1). The second link turns at $\dot q_1 + \dot q_2$.

# %%
equations = arm.embedding()
tip, tip_velocity = equations.explicit("output_tip"), equations.explicit("output_tip_velocity")
display(Math(rf"\mathbf r_{{O_3}} = {latex(tip)} \qquad \dot{{\mathbf r}}_{{O_3}} = {latex(tip_velocity)}"))

# %% [markdown]
# ### Velocity transformation
#
# Three rows for each link: velocity of the centre of mass along $x$ and $y$, and angular velocity.

# %%
display(Math(rf"\mathbf J = {latex(equations.J)}"))

# %% [markdown]
# ### Mass matrix
#
# $\tilde{\mathbf M} = \mathbf J^T \mathbf M \mathbf J$ depends on the elbow only: turning the whole arm about the shoulder
# changes nothing.

# %%
display(Math(rf"\tilde{{\mathbf M}} = {latex(equations.M_tilde)}"))

# %% [markdown]
# ### Coriolis and centrifugal terms
#
# All of them share the factor $m_2\, l_1 l_{c2} \sin q_2$. They vanish when the arm is stretched.

# %%
display(Math(rf"\tilde{{\mathbf k}} = {latex(equations.k_tilde)}"))
coupling = m2 * l1 * l_c2 * sp.sin(q2)
expected = coupling * sp.Matrix([-q2.dot * (2 * q1.dot + q2.dot), q1.dot**2])
assert (equations.k_tilde - expected).applyfunc(sp.simplify).is_zero_matrix

# %% [markdown]
# ### Generalized forces
#
# The torques of the motors and the moments of the weight.

# %%
display(Math(rf"\tilde{{\mathbf F}} = {latex(equations.F_tilde)}"))

# %% [markdown]
# ## 3. Verification
#
# No reference solution is needed: the equations are checked by identities that hold for every sound mechanism. Those that exact
# algebra proves hold at every state; the others are evaluated at random states with 30 digits. The compiled code is checked
# against the same numbers.

# %%
verification = equations.verify()
print(verification)
assert verification.passed

# %% [markdown]
# ## 4. Compiled module
#
# C if there is a compiler, otherwise NumPy; both have the same interface. The report says how many operations each function
# takes, and what was left out because this mechanism does not need it.

# %%
module = equations.compile()
print(module.report())

# %% [markdown]
# ## 5. Without torque
#
# The arm is let go at $\mathbf q = 0$, stretched out. It swings as a double pendulum. With `work=True` the work of the motors
# is integrated along with the motion. It stays zero here, and so the energy must not change.

# %%
swing = module.simulate((0, 3), work=True)
print(swing)
print(f"relative change of the energy: {swing.energy_error():.1e}")
assert swing.energy_error() < 1e-6
swing.plot()

# %% [markdown]
# ## 6. A controller
#
# ### Target
#
# The tip has to go to a point above the shoulder, to the right, and stop there. The cosine law in the triangle of shoulder,
# elbow and tip gives the angles. There are two solutions; the one with the elbow to the right is taken, $q_2 > 0$.

# %%
target = np.array([0.3, 0.6])
length1, length2 = arm.defaults[l1], arm.defaults[l2]
bend = np.arccos((target @ target - length1**2 - length2**2) / (2 * length1 * length2))
lift = np.arctan2(*target[::-1]) - np.arctan2(length2 * np.sin(bend), length1 + length2 * np.cos(bend))
goal = np.array([lift, bend])
print(f"target angles: q1 = {goal[0]:.4f} rad, q2 = {goal[1]:.4f} rad")

# %% [markdown]
# ### PD control
#
# An input may be a function of time and state $\mathbf x = [\mathbf q;\ \dot{\mathbf q}]$. A spring towards the goal and a
# damper make a PD controller. The arm hangs down at the start. With PD control alone it sags: at rest, the torque that carries
# the weight needs an error of the angle.

# %%
stiffness, damping = 40.0, 6.0
hanging = {"t": (0, 2.5), "q": {q1: -np.pi / 2, q2: 0.0}}

sagging = module.simulate(**hanging, inputs=lambda t, x: stiffness * (goal - x[:2]) - damping * x[2:])
print(f"distance of the tip from the target: {np.linalg.norm(sagging.outputs['tip'][-1] - target) * 1e3:.1f} mm")

# %% [markdown]
# ### PD control with compensation of the weight
#
# The module gives the torque that holds the arm still where it is: inverse dynamics with zero speed and zero
# acceleration. With it added, the goal is the only place of rest.

# %%
rest = np.zeros(2)
reaching = module.simulate(**hanging, work=True, inputs=lambda t, x: (
    stiffness * (goal - x[:2]) - damping * x[2:] + module.inverse_dynamics(x[:2], rest, rest)))
miss = np.linalg.norm(reaching.outputs["tip"][-1] - target)
print(f"distance of the tip from the target: {miss * 1e3:.3f} mm")
assert miss < 1e-3
reaching.plot()

# %% [markdown]
# ### Work of the motors
#
# The work of the motors is the increase of the arm's energy. They supply more at first, and absorb the rest as brakes.

# %%
print(f"work of the motors: {reaching.work[-1]:.4f} J, at most {reaching.work.max():.4f} J")
print(f"energy gained:      {reaching.energy[-1] - reaching.energy[0]:.4f} J")
assert reaching.energy_error() < 1e-6

# %% [markdown]
# ### The moving arm

# %%
with tempfile.TemporaryDirectory() as folder:
    film = Path(folder) / "arm.gif"
    reaching.animate(film, fps=20)
    display(Image(data=film.read_bytes(), format="gif"))
