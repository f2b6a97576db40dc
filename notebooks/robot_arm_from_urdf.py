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
# # A robot arm from a URDF file
#
# From the text of a file to torques, a motion and a picture. The arm turns about the vertical, has a shoulder and an elbow,
# and carries a load whose mass stays a symbol. Reading needs `pip install 'symdyn[robots]'`.

# %%
import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from IPython.display import display
from scipy.integrate import trapezoid

import symdyn as sd

# %% [markdown]
# ## 1. The file
#
# Four links and three joints. The rod of each moving link lies along its x axis, the load is a point at the end of the
# forearm.

# %%
LINK = """<link name="{name}"><inertial><origin xyz="{x} 0 {z}"/><mass value="{m}"/>
  <inertia ixx="{ixx}" iyy="{iyy}" izz="{izz}" ixy="0" ixz="0" iyz="0"/></inertial></link>"""
JOINT = """<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>
  <origin xyz="{at}"/><axis xyz="{axis}"/><limit effort="200" velocity="3" lower="-3" upper="3"/></joint>"""
text = "\n".join([
    '<robot name="arm"><link name="base"/>',
    LINK.format(name="column", x=0, z=0.2, m=6, ixx=0.08, iyy=0.08, izz=0.03),
    LINK.format(name="upper_arm", x=0.25, z=0, m=4, ixx=0.004, iyy=0.085, izz=0.085),
    LINK.format(name="forearm", x=0.2, z=0, m=2.5, ixx=0.002, iyy=0.035, izz=0.035),
    LINK.format(name="load", x=0, z=0, m=1.5, ixx=0.001, iyy=0.001, izz=0.001),
    JOINT.format(name="turn", kind="revolute", parent="base", child="column", at="0 0 0", axis="0 0 1"),
    JOINT.format(name="shoulder", kind="revolute", parent="column", child="upper_arm", at="0 0 0.4", axis="0 -1 0"),
    JOINT.format(name="elbow", kind="revolute", parent="upper_arm", child="forearm", at="0.5 0 0", axis="0 -1 0"),
    JOINT.format(name="grip", kind="fixed", parent="forearm", child="load", at="0.4 0 0", axis="0 0 1"), "</robot>"])
path = Path(tempfile.mkdtemp()) / "arm.urdf"
path.write_text(text, encoding="utf-8")

# %% [markdown]
# ## 2. The mechanism
#
# `symbolic` lists what stays a parameter; the numbers of the file are their defaults. Torques in the joints are inputs.

# %%
arm = sd.read_urdf(path, symbolic=["m_load", "g"])
tau = sd.inputs("tau1:4")
for joint, torque in zip(("turn", "shoulder", "elbow"), tau):
    arm.add_joint_force(joint, torque)
display(arm)

# %%
arm.show()

# %% [markdown]
# ## 3. Equations and a first check
#
# The arm stretched out at rest: the torque in the shoulder carries the weights at their distances, here with 0.3 kg more
# load.

# %%
equations = arm.embedding()
module = equations.compile()
print(module.report())

loads = {"m_load": 1.8, "g": 9.81}
hold = module.inverse_dynamics(q=np.zeros(3), u=np.zeros(3), ud=np.zeros(3), params=loads)
by_hand = 9.81 * np.array([0, 4 * 0.25 + 2.5 * 0.7 + 1.8 * 0.9, 2.5 * 0.2 + 1.8 * 0.4])
print("torques to hold the arm:", hold, "by hand:", by_hand)
assert np.allclose(hold, by_hand, atol=1e-12)

# %% [markdown]
# ## 4. Torques for a motion
#
# Every joint goes from where it is to its end in two seconds, by the polynomial of fifth order that starts and ends without
# speed and acceleration. Inverse dynamics gives the torques.

# %%
duration, start, end = 2.0, np.array([0.0, -0.6, 1.4]), np.array([1.5, 0.7, -0.4])
t = np.linspace(0, duration, 401)


def planned(t):
    """Positions, speeds and accelerations at the times t."""
    s = np.asarray(t)[..., None] / duration
    way = end - start
    return (start + way * s**3 * (10 - 15 * s + 6 * s**2), way * 30 * s**2 * (1 - s) ** 2 / duration,
            way * 60 * s * (1 - s) * (1 - 2 * s) / duration**2)


q, u, ud = planned(t)
torques = np.array([module.inverse_dynamics(q=a, u=b, ud=c) for a, b, c in zip(q, u, ud)])

figure, axes = plt.subplots(figsize=(8, 3.4), layout="constrained")
for k, name in enumerate(("turn", "shoulder", "elbow")):
    axes.plot(t, torques[:, k], label=name)
axes.set(xlabel="$t$ [s]", ylabel=r"$\tau$ [N m]")
axes.grid(color="0.9")
axes.legend()
plt.show()

# %% [markdown]
# The work of the torques is the change of energy, since nothing else does work.

# %%
work = trapezoid(np.sum(torques * u, axis=1), t)
energies = [float(np.sum(module.energy(q=q[k], u=u[k]))) for k in (0, -1)]
print(f"work {work:.6f} J, change of energy {energies[1] - energies[0]:.6f} J")
assert abs(work - (energies[1] - energies[0])) < 1e-4

# %% [markdown]
# ## 5. The arm driven by them
#
# The torques are applied to the arm, with a weak feedback on top: `inputs` takes functions of time and state.

# %%
stiffness, damping = np.array([60.0, 60.0, 30.0]), np.array([12.0, 12.0, 6.0])


def applied(k):
    def torque(t, state):
        a, b, c = planned(min(t, duration))
        return module.inverse_dynamics(q=a, u=b, ud=c)[k] + stiffness[k] * (a[k] - state[k]) + damping[k] * (b[k] - state[3 + k])
    return torque


motion = module.simulate(t, q=start, inputs={tau[k]: applied(k) for k in range(3)}, rtol=1e-8)
off = np.abs(motion.q - q).max()
print(motion, f"largest distance from the plan {off:.1e} rad", sep="\n")
assert off < 1e-6

# %%
motion.view()

# %% [markdown]
# With 1 kg more load than planned the arm stays behind; the feedback holds it within a fraction of a radian.

# %%
heavier = module.simulate(t, q=start, inputs={tau[k]: applied(k) for k in range(3)}, params={"m_load": 2.5})
print(f"with 1 kg more load: {np.degrees(np.abs(heavier.q - q).max()):.2f} degrees off")
assert 0 < np.abs(heavier.q - q).max() < 0.3

# %% [markdown]
# ## What to read next
#
# - [Robots from files](../docs/robots.md): what is read of a URDF file, and writing one.
# - [Control](../docs/control.md): regulators and sampled controllers.
