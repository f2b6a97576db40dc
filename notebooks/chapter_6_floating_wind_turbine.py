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
# # A floating wind turbine, three times
#
# Chapter 6 of the lecture derives one mechanism by all three formulations: a platform that floats, a tower fixed on it, a nacelle
# that yaws, a rotor that turns. Here are its bodies and joints, without wind and waves, and then every derivation of the chapter
# beside its slide.

# %%
import matplotlib.pyplot as plt
import numpy as np
import sympy as sp
from IPython.display import Math, display
from sympy import latex

import symdyn as sd

# %% [markdown]
# ## 1. Bodies and joints
#
# The platform is described by a point $O$ on its deck and ZYX Euler angles. Its centre of mass lies $d$ below. Masses and
# inertias are those of a machine of about 5 MW on a barge.

# %%
x, y, z, psi, theta, phi, yaw, rotor = sd.coordinates("x y z psi theta phi psi_N phi_H")
h, d, b = sd.parameters("h d b", positive=True)
turbine = sd.System("turbine", gravity=[0, 0, 0])


def add_body(name, mass, inertia, com=(0, 0, 0)):
    m, *principal = sp.symbols([f"{letter}_{name}" for letter in ("m", "I_x", "I_y", "I_z")], positive=True)
    turbine.defaults |= dict(zip([m, *principal], [mass, *inertia]))
    return turbine.add_body(name, mass=m, inertia=sp.diag(*principal), com=com)


platform = add_body("platform", 5.5e6, (7e8, 7e8, 1.2e9), com=[0, 0, -d])
tower = add_body("tower", 3.5e5, (1.9e8, 1.9e8, 2e6))
nacelle = add_body("nacelle", 2.4e5, (2e6, 3e7, 3e7))
hub = add_body("rotor", 1.1e5, (4e7, 2e7, 2e7))
turbine.defaults |= {h: 80.0, d: 5.0, b: 5.0}

turbine.add_joint(sd.Free("sea", turbine.ground, platform, [x, y, z, psi, theta, phi], orientation=sd.EulerAngles("ZYX")))
turbine.add_joint(sd.Fixed("foot", platform, tower, parent_point=[0, 0, h / 2]))
turbine.add_joint(sd.Revolute("yaw_bearing", tower, nacelle, yaw, axis=[0, 0, 1], parent_point=[0, 0, h / 2]))
turbine.add_joint(sd.Revolute("shaft", nacelle, hub, rotor, axis=[1, 0, 0], parent_point=[-b, 0, 0]))

# %% [markdown]
# ## 2. From velocities of the joints to those of the bodies
#
# $\dot{\mathbf s} = \mathbf J \dot{\mathbf q}$ takes the rates of the coordinates to $[\mathbf v_G;\ \boldsymbol\omega]$ of every
# body. For the platform, with $\mathbf r_{G/O} = [0, 0, -d]$ in its own axes:
#
# $$\mathbf J_P = \begin{bmatrix} \mathbf 1 & -[\mathbf R\, \mathbf r_{G/O}\, \times]\, \mathbf G \\
# \mathbf 0 & \mathbf G \end{bmatrix}$$
#
# The slide has $\mathbf r_{O/G}$ there, which is the other way round.

# %%
R = sd.rotation.from_euler("ZYX", [psi, theta, phi])
G = sd.rotation.euler_rates("ZYX", [psi, theta, phi], frame="n")
arm = R * sp.Matrix([0, 0, -d])
J_P = sp.Matrix(sp.BlockMatrix([[sp.eye(3), -sd.rotation.skew(list(arm)) * G], [sp.zeros(3), G]]))
embedding = turbine.embedding()
angles = {psi: 0.1, theta: 0.2, phi: 0.3, d: 5.0}
J = embedding.lambdify("J")([0, 0, 0, *list(angles.values())[:3], 0, 0], np.zeros(8), turbine.defaults)
print(f"J of the platform: largest difference {abs(J[:6, :6] - np.array(J_P.subs(angles), dtype=float)).max():.0e}")
display(Math(rf"\mathbf G = {latex(G)}"))

# %% [markdown]
# The recursion has a matrix $\mathbf S$ for each joint instead. The fixed tower is part of the platform there: three links.

# %%
recursive = turbine.recursive()
S_2, S_3 = (recursive.link(k).S for k in (2, 3))
display(Math(rf"\mathbf S_2^T = {latex(S_2.T)} \qquad \mathbf S_3^T = {latex(S_3.T)}"))
display(Math(rf"\mathbf X_3 = {latex(recursive.link(3).X)}"))

# %% [markdown]
# ## 3. Eight coordinates, or many with constraints
#
# In the augmented formulation every body has its own coordinates. A fixed joint takes six of their freedoms away, a revolute
# joint five. The slide prints only three equations for the fixed joint; with those the tower could tilt and turn on the platform.

# %%
augmented = turbine.augmented(coordinates="absolute")
print(f"embedding:  {len(embedding.symbols.speeds)} speeds")
print(f"augmented: {len(augmented.symbols.speeds)} speeds, {len(augmented.constraints)} constraints")
for joint in ("foot", "yaw_bearing", "shaft"):
    print(f"  {joint:12} {', '.join(name.removeprefix(joint + '_') for name in augmented.constraints if name.startswith(joint))}")

# %% [markdown]
# ## 4. A gyroscope on a barge
#
# The rotor turns at 1.27 rad/s when the platform is given a pitch of 0.02 rad/s. Tilting the rotor's axis takes a moment about
# the vertical. The yaw bearing cannot give it, so that the nacelle turns away: it precesses.

# %%
times = np.linspace(0, 20, 101)
module = embedding.compile()
motion = module.simulate(t=times, q={}, u={theta.dot: 0.02, rotor.dot: 1.27}, rtol=1e-10)

# %% [markdown]
# The same by the other formulation. The velocities of the bodies at the start are $\mathbf J \dot{\mathbf q}$; all axes are
# parallel then.

# %%
state = {"q": np.zeros(8), "u": motion.u[0], "params": turbine.defaults}
bodies = np.reshape(embedding.lambdify("J")(**state) @ motion.u[0], (4, 6))
places = embedding.lambdify("positions")(**state)
speeds = [*motion.u[0][:6], *bodies[1:].ravel()]
coordinates = [*np.zeros(6), *[value for place in places[1:] for value in (*place, 1, 0, 0, 0)]]
absolute = augmented.compile().simulate(t=times, q=coordinates, u=speeds, rtol=1e-10)

# %%
figure, axes = plt.subplots(1, 2, figsize=(9, 3.4), layout="constrained")
place = {c: i for i, c in enumerate(embedding.symbols.coordinates)}
for coordinate, label in ((psi, "yaw"), (theta, "pitch"), (phi, "roll")):
    line, = axes[0].plot(times, np.degrees(motion.q[:, place[coordinate]]), label=label)
    axes[0].plot(times[::5], np.degrees(absolute.q[::5, place[coordinate]]), ".", color=line.get_color())
axes[0].set(xlabel="time, s", ylabel="angle, degrees", title="Platform")
axes[0].legend(frameon=False)
axes[1].plot(times, np.degrees(motion.q[:, place[yaw]]))
axes[1].set(xlabel="time, s", ylabel="angle, degrees", title="Nacelle on the tower")
plt.show()

# %%
difference = abs(motion.q[:, :6] - absolute.q[:, :6]).max()
print(f"lines: embedding, dots: augmented; largest difference of the platform's coordinates: {difference:.0e} m or rad")
print(f"change of energy: {abs(motion.energy / motion.energy[0] - 1).max():.0e} and "
      f"{abs(absolute.energy / absolute.energy[0] - 1).max():.0e}")
assert difference < 1e-6

# %% [markdown]
# ## 5. The slides, formula by formula
#
# All derivations of the chapter, typed from the slides, beside what follows from bodies and joints. An entry is called wrong only
# where an independent proof shows it.

# %%
chapter = sd.compare("6")
display(chapter)

# %%
for case in chapter:
    for formula, error in case.errata:
        print(f"line {formula.slide.line}  {formula.name}: {error.why}")
