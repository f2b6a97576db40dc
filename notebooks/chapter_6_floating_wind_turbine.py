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
# # A floating wind turbine, from description to Campbell diagram
#
# Chapter 6 of the lecture derives one mechanism by all three formulations: a platform that floats, a tower fixed on it, a nacelle
# that yaws, a rotor that turns. This notebook describes it by bodies, joints and loads, lets it float, looks at its stability and
# its natural periods, moves it, bends its tower and blades, and ends with the slides of the chapter.
#
# The n-frame has $z$ upward and $z = 0$ in the still water; $x$ points downwind. Units are m, kg, s, N and rad unless something
# else is written.

# %%
import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import sympy as sp
from IPython.display import Image, Math, display
from scipy.spatial.transform import Rotation
from sympy import latex

import symdyn as sd
from symdyn.systems.turbine_parts import blade_beam

# %% [markdown]
# ## 1. Description
#
# ### A small one first
#
# Three coordinates are enough to see what is special about a turbine: the pitch $\theta$ of the platform, the yaw $\psi_N$ of the
# nacelle and the azimuth $\phi_H$ of the rotor, at the height $h$ on the tower. The rotor is alike about all axes across its
# shaft.

# %%
theta, yaw, azimuth = sd.coordinates("theta psi_N phi_H")
h, g, I_P, m_H, I_x, I_t = sd.parameters("h g I_P m_H I_x I_t", positive=True)

small = sd.System("gyroscope", gravity=[0, 0, -g])
platform = small.add_body("platform", inertia=[0, I_P, 0])
nacelle = small.add_body("nacelle")
rotor = small.add_body("rotor", mass=m_H, inertia=[I_x, I_t, I_t])
small.add_joint(sd.Revolute("sea", small.ground, platform, theta, axis=[0, 1, 0]))
small.add_joint(sd.Revolute("yaw_bearing", platform, nacelle, yaw, axis=[0, 0, 1], parent_point=[0, 0, h]))
small.add_joint(sd.Revolute("shaft", nacelle, rotor, azimuth, axis=[1, 0, 0]))
for equation in small.embedding().equations:
    display(Math(latex(equation)))

# %% [markdown]
# The first line is the pitch. In it stands $I_x \dot\phi_H \dot\psi_N \cos\psi_N$: a rotor that spins and is yawed pulls at the
# pitch of the platform. It stands on the left, so that the moment on the platform is its negative. Section 7 looks at it.
#
# ### All of it
#
# Platform, tower, nacelle and rotor with eight coordinates, in the lecture's letters: $x, y, z$ and the ZYX angles
# $\psi, \theta, \phi$ of the platform, $\psi_N$ and $\phi_H$. In place of the angles the platform can have Euler parameters, with
# velocities in its own axes as speeds. Masses and inertias are round numbers of a machine of about 5 MW on a barge.
#
# Loads are elements that know nothing of the rest: the hull as a box less its moonpool, four mooring lines, damping, thrust.

# %%
x, y, z, psi, phi = sd.coordinates("x y z psi phi")
h_T, b, z_P, rho = sd.parameters("h_T b z_P rho")
v_w = sd.inputs("v_w")


def barge_turbine(orientation):
    turbine = sd.System(f"barge_turbine_{orientation}", gravity=[0, 0, -g])
    turbine.defaults = {g: 9.81, h_T: 87.6, b: 5.0, z_P: -0.3, rho: 1025.0}

    def add_body(name, mass, inertia, com=(0, 0, 0)):
        m, *principal = sp.symbols([f"{letter}_{name}" for letter in ("m", "I_x", "I_y", "I_z")], positive=True)
        turbine.defaults |= dict(zip([m, *principal], [mass, *inertia]))
        return turbine.add_body(name, mass=m, inertia=principal, com=com)

    platform = add_body("P", 5.5e6, (7.3e8, 7.3e8, 1.45e9), com=[0, 0, z_P])
    tower = add_body("T", 3.5e5, (2.1e8, 2.1e8, 2e6))
    nacelle = add_body("N", 2.4e5, (2e6, 3e7, 3e7))
    rotor = add_body("R", 1.1e5, (4e7, 2e7, 2e7))
    if orientation == "angles":
        sea = sd.Free("sea", turbine.ground, platform, [x, y, z, psi, theta, phi], sd.EulerAngles("ZYX"))
    else:
        sea = sd.Free("sea", turbine.ground, platform, [x, y, z, *sd.coordinates("e0:4")], sd.EulerParameters(),
                      velocity="body", speeds=sd.speeds("v_x v_y v_z omega_x omega_y omega_z"))
    turbine.add_joint(sea)
    turbine.add_joint(sd.Fixed("foot", platform, tower, parent_point=[0, 0, 0.44 * h_T]))
    turbine.add_joint(sd.Revolute("yaw_bearing", tower, nacelle, yaw, axis=[0, 0, 1], parent_point=[0, 0, 0.56 * h_T]))
    turbine.add_joint(sd.Revolute("shaft", nacelle, rotor, azimuth, axis=[1, 0, 0], parent_point=[-b, 0, 0]))

    middle = (0, 0, 1)  # the hull reaches from 4 m below the platform's origin to 6 m above it
    turbine.add_load(sd.Buoyancy(platform, [sd.Box((40, 40, 10), middle)], rho, without=[sd.Box((10, 10, 10), middle)]))
    for sx, sy in ((1, 1), (-1, 1), (-1, -1), (1, -1)):
        turbine.add_load(sd.MooringLine(platform, (20 * sx, 20 * sy, -4), (300 * sx, 300 * sy, -150), length=473.0, weight=1200.0,
                                        stiffness=5.9e8))
    turbine.add_load(sd.LinearDamping(platform, [3.4e4, 3.4e4, 3.6e6, 3e8, 3e8, 2e7]))
    turbine.add_load(sd.Thrust(rotor, lambda v: 5700 * sp.Abs(v) * v, wind=[v_w, 0, 0]))
    turbine.add_output("acceleration", sd.acceleration(nacelle))
    return turbine


turbine, quasi = barge_turbine("angles"), barge_turbine("parameters")

# %% [markdown]
# ## 2. Three formulations
#
# 1. Embedding: $\dot{\mathbf s} = \mathbf J \dot{\mathbf q}$ takes the rates of the coordinates to
#    $[\mathbf v_G;\ \boldsymbol\omega]$ of every body, and $\mathbf J^T$ takes the constraint forces out.
# 2. Augmented: every body has coordinates of its own. A fixed joint takes six of their freedoms away, a revolute joint five.
# 3. Recursive: from link to link by a matrix $\mathbf S$ for each joint. Here also with the 6-DOF joint in quasi-velocities.

# %%
embedded, augmented = turbine.embedding(), turbine.augmented(coordinates="absolute")
recursive, recursive_quasi = turbine.recursive(), quasi.recursive()
print(f"embedding: {len(embedded.symbols.speeds)} speeds; augmented: {len(augmented.symbols.speeds)} speeds, "
      f"{len(augmented.constraints)} constraints")
for joint in ("foot", "yaw_bearing", "shaft"):
    print(f"  {joint:12} {', '.join(name.removeprefix(joint + '_') for name in augmented.constraints if name.startswith(joint))}")
S_2, S_3 = (recursive.link(k).S for k in (2, 3))
display(Math(rf"\mathbf S_2^T = {latex(S_2.T)} \qquad \mathbf S_3^T = {latex(S_3.T)}"))

# %% [markdown]
# For the platform, with $\mathbf r_{G/O} = [0, 0, z_P]$ in its own axes, the rows of $\mathbf J$ are
#
# $$\mathbf J_P = \begin{bmatrix} \mathbf 1 & -[\mathbf R\, \mathbf r_{G/O}\, \times]\, \mathbf G \\
# \mathbf 0 & \mathbf G \end{bmatrix}$$

# %%
angles = [psi, theta, phi]
G = sd.rotation.euler_rates("ZYX", angles, frame="n")
arm = sd.rotation.from_euler("ZYX", angles) * sp.Matrix([0, 0, z_P])
J_P = sp.Matrix(sp.BlockMatrix([[sp.eye(3), -sd.rotation.skew(list(arm)) * G], [sp.zeros(3), G]]))
display(Math(rf"\mathbf G = {latex(G)}"))

# %% [markdown]
# They have to agree. 200 random states: angles up to 60°, speeds up to 1 rad/s and 1 m/s, a wind of 10 m/s. From
# $\mathbf q, \dot{\mathbf q}$ follow the places and velocities of the bodies, and from these the coordinates of the other forms.

# %%
modules = {"embedding": embedded, "augmented": augmented, "recursive": recursive, "recursive, quasi-velocities": recursive_quasi}
modules = {name: equations.compile(backend="numpy") for name, equations in modules.items()}

n, rng = 200, np.random.default_rng(0)
q = np.hstack([rng.uniform(-3, 3, (n, 3)), rng.uniform(-np.pi / 3, np.pi / 3, (n, 5))])
u = rng.uniform(-1, 1, (n, 8))
state = np.hstack([q, u])
frames = modules["embedding"].evaluate("frames", 0, state).reshape(n, 4, 12)
p, R = frames[:, :, :3], frames[:, :, 3:].reshape(n, 4, 3, 3)
twists = (modules["embedding"].J(q) @ u[:, :, None]).reshape(n, 4, 6)
e = np.roll(Rotation.from_matrix(R.reshape(-1, 3, 3)).as_quat(), 1, axis=1).reshape(n, 4, 4)
v, omega = twists[:, :, :3], np.einsum("nkji,nkj->nki", R, twists[:, :, 3:])
others = [1, 2, 3]
states = {
    "embedding": state,
    "recursive": state,
    "augmented": np.hstack([q[:, :6], np.dstack([p, e])[:, others].reshape(n, -1),
                            u[:, :6], np.dstack([v, omega])[:, others].reshape(n, -1)]),
    "recursive, quasi-velocities": np.hstack([q[:, :3], e[:, 0], q[:, 6:],
                                              np.einsum("nji,nj->ni", R[:, 0], u[:, :3]), omega[:, 0], u[:, 6:]]),
}
J = modules["embedding"].J(q[0])[:6, :6]
J_0 = np.array(J_P.subs({**dict(zip(angles, q[0, 3:6])), z_P: -0.3}), dtype=float)
print(f"J of the platform: largest difference {abs(J - J_0).max():.0e}")

found = {name: module.outputs(np.zeros(n), states[name], inputs=[10.0])["acceleration"] for name, module in modules.items()}
largest = np.linalg.norm(found["embedding"], axis=1)
for name, acceleration in found.items():
    difference = (np.linalg.norm(acceleration - found["embedding"], axis=1) / largest).max()
    print(f"{name:28} acceleration of the nacelle: largest relative difference {difference:.0e}")
    assert difference < 1e-10

# %% [markdown]
# ## 3. The turbine of the catalogue
#
# `sd.systems.floating_wind_turbine()` is made in the same way: seven bodies, with the NREL 5-MW turbine (Jonkman et al.,
# NREL/TP-500-38060) on the ITI Energy barge (Jonkman, NREL/TP-500-41958), eight catenary lines, drives of yaw and rotor, and
# thrust and drag. The source of every number is in `symdyn/systems/nrel_5mw.py`. Added mass and damping of the barge and the
# thrust coefficient are assumptions and are marked so there; the figures below that rest on them are those of this model, not
# published ones.
#
# It is a system as any other. Here it gets a tank with the mass $m_b$ at $(x_b, 0, z_b)$ on the platform, empty for now.

# %%
system = sd.systems.floating_wind_turbine()
m_b, x_b, z_b = sd.parameters("m_b x_b z_b")
tank = system.add_body("tank", mass=m_b)
system.add_joint(sd.Fixed("tank", "platform", tank, parent_point=[x_b, 0, z_b]))
system.defaults |= {m_b: 0.0, x_b: 0.0, z_b: -2.0}
system.draw(tank, sd.shapes.Box((4, 4, 2)))
floating = system.embedding().compile()
print(", ".join(floating.metadata.q))
print("inputs:", ", ".join(floating.metadata.inputs))
masses = {body.name: float(body.mass.subs(system.defaults)) for body in system.check().bodies}
print(", ".join(f"{name} {mass / 1000:.1f} t" for name, mass in masses.items()))
print(f"together {sum(masses.values()) / 1000:.1f} t")

# %% [markdown]
# ## 4. Hydrostatics
#
# The hull is a box that the water plane cuts. Volume and centre of buoyancy of the wet part are exact at any draft, heel and
# trim, capsized too. First the hull alone, with the mass and the centre of mass of the whole turbine.

# %%
centers = floating.evaluate("positions", 0, np.zeros(16)).reshape(-1, 3)
weights = np.array(list(masses.values()))
mass, z_G = weights.sum(), float(weights @ centers[:, 2] / weights.sum())
hull = sd.System("hull", gravity=[0, 0, -9.80665])
box = hull.add_body("box", mass=mass, inertia=[2e9, 2e9, 1.5e9], com=[0, 0, z_G])
hull.add_joint(sd.Free("sea", hull.ground, box, [x, y, z, psi, theta, phi]))
hull.add_load(sd.Buoyancy(box, [sd.Box((40, 40, 10), (0, 0, 1))], 1025.0, without=[sd.Box((10, 10, 10), (0, 0, 1))]))
afloat = hull.embedding().compile(backend="numpy")


def floating_at(heel):
    """Draft and righting arm at an angle of heel: the hull rises and sinks until it carries its weight."""
    level = afloat.equilibrium(free=["z"], fixed={"x": 0, "y": 0, "psi": 0, "theta": 0, "phi": heel})
    return 4 - level["z"], -afloat.F_tilde(level.q, np.zeros(6))[5] / (mass * 9.80665)


draft, _ = floating_at(0.0)
area, second_moment = 40**2 - 10**2, (40**4 - 10**4) / 12
KB, BM, KG = draft / 2, second_moment / (area * draft), z_G + 4
tiny = 1e-5
GM = floating_at(tiny)[1] / tiny
print(f"draft {draft:.4f} m; KB {KB:.3f} m + BM {BM:.3f} m - KG {KG:.3f} m = GM {KB + BM - KG:.5f} m; "
      f"slope of the righting arm: {GM:.5f} m")
assert abs(GM - (KB + BM - KG)) < 1e-5

# %% [markdown]
# The initial metacentric height from the textbook is the slope of the exact righting arm at zero heel. A restoring matrix knows
# this slope only. The exact curve bends when the deck edge dips in or the bottom edge comes out, and it ends: where the arm
# changes its sign the turbine capsizes. Near 180° it floats upside down. (The tower has no buoyancy in this model, and in the
# real world the turbine would be lost long before.)

# %%
heels = np.radians(np.arange(0, 181, 3))
arms = np.array([floating_at(heel)[1] for heel in heels])
last = int(np.flatnonzero(arms[1:-1] < 0)[0]) + 1
vanishing = np.degrees(np.interp(0, [arms[last], arms[last - 1]], [heels[last], heels[last - 1]]))
out = np.degrees(np.arctan2(draft, 20)), np.degrees(np.arctan2(10 - draft, 20))
print(f"bottom edge comes out of the water at {out[0]:.1f} degrees, deck edge dips in at {out[1]:.1f} degrees; "
      f"the righting arm vanishes at {vanishing:.0f} degrees")

figure, axes = plt.subplots(figsize=(8, 3.6), layout="constrained")
axes.plot(np.degrees(heels), arms, label="cut box")
axes.plot(np.degrees(heels[:12]), GM * heels[:12], "--", label="restoring matrix: $GM \\cdot \\phi$")
axes.axhline(0, color="0.3", linewidth=0.8)
axes.set(xlabel="heel, degrees", ylabel="righting arm GZ, m", xlim=(0, 180), ylim=(None, 12), xticks=range(0, 181, 30))
axes.grid(color="0.9")
axes.legend(frameon=False)
plt.show()

# %% [markdown]
# ## 5. Equilibrium
#
# `equilibrium` looks for the state of rest near a start. Nothing holds the azimuth of the free rotor, and without wind nothing
# asks the nacelle to turn: both are kept at zero.

# %%
kept = {"yaw": 0, "azimuth": 0}
rest = floating.equilibrium(fixed=kept)
print(rest)
print(f"draft: {4 - rest['z']:.3f} m")

# %% [markdown]
# The barge floats 14 cm deeper than by its weight alone: the lines pull it down. It leans by a twentieth of a degree towards the
# rotor, which hangs upwind of the tower.
#
# ### Several equilibria
#
# Newton's method starts from 40 random states, up to 3 m and 20° away. Every start ends in an equilibrium; their
# eigenvalues decide which are stable.

# %%
reach = np.radians(20)
several = floating.equilibria(40, {**dict.fromkeys("xyz", 3.0), **dict.fromkeys(("psi", "theta", "phi"), reach)}, fixed=kept)
print(several)
assert len(several.stable) == 1

# %% [markdown]
# One is stable. The unstable ones are the crests that separate floating from capsizing: a little less, and the turbine comes
# back; a little more, and it goes over. The crest straight ahead, in pitch, lies near the angle at which the righting arm of the
# hull alone vanishes; the lines have a part in it here. The stable equilibrium on the other side has to be looked for there.

# %%
crest = floating.equilibrium(fixed=kept, start={"theta": 1.1})
print(f"crest in pitch at {np.degrees(crest['theta']):.1f} degrees, stable: {crest.stable}; hull alone {vanishing:.1f} degrees")
capsized = floating.equilibrium(fixed=kept, start={"phi": 3.1, "z": 2.0})
print(f"capsized: roll {np.degrees(capsized['phi']):.1f} degrees, deck {6 - capsized['z']:.2f} m under water, "
      f"stable: {capsized.stable}")
assert not crest.stable and capsized.stable

# %% [markdown]
# ### Ballast
#
# 400 t of ballast go into the tank. Where must it be for the turbine to float upright? $x_b$ is found along with the coordinates,
# and $\theta = 0$ is the condition that it takes.

# %%
print(f"{'wind':>8}{'pitch without':>16}{'x_b':>10}{'surge':>10}{'draft':>10}")
for wind in (0.0, 5.0, 10.0):
    leaning = floating.equilibrium(fixed=kept, inputs={"v_w": wind})
    upright = floating.equilibrium(free=["x", "y", "z", "psi", "theta", "phi", x_b], fixed={**kept, "theta": 0.0},
                                   params={m_b: 4e5}, inputs={"v_w": wind})
    print(f"{wind:4.0f} m/s{np.degrees(leaning['theta']):12.3f} deg{upright['x_b']:8.2f} m{round(upright['x'], 2) + 0.0:8.2f} m"
          f"{4 - upright['z']:8.3f} m")

# %% [markdown]
# The thrust pushes at 90 m above the water, and so the ballast goes upwind, to negative $x$. It pays only as long as the wind
# stays: its moment does not follow the thrust.

# %% [markdown]
# ## 6. Natural periods
#
# `linearize` gives mass, damping and stiffness about the equilibrium, by exact derivatives. Its modes are named by the
# coordinates that carry their kinetic energy.

# %%
linear = floating.linearize(rest)
modes = linear.modes()
print(modes)

# %% [markdown]
# Waves that carry energy have periods of about 5 to 20 s. Surge, sway and yaw, which only the lines hold, are far above; roll,
# pitch and heave of the barge lie within. This is the price of its simple shape.
#
# ### The same from a free decay
#
# The nonlinear model starts 1 cm or 0.01 rad off its rest, along one mode after the other. The time between passages through rest
# is the period. Nothing holds its rotor, so that it is compared with the modes in which the rotor is free: in roll it stays
# behind, and the period is a little shorter than above.

# %%
names = floating.metadata.q
print(f"{'mode':8}{'linear':>12}{'free decay':>14}{'difference':>13}")
for mode in floating.linearize(rest.x).modes():
    column = int(np.argmax(mode.shares))
    if mode.kind == "zero" or names[column] == "yaw":  # the azimuth and the drive of the nacelle, no modes of the platform
        continue
    shape = 0.01 * mode.shape / mode.shape[column]
    decay = floating.simulate(np.linspace(0, 4 * mode.period, 2001), rest.q + shape.real, (mode.eigenvalue * shape).real,
                              rtol=1e-10)
    swing = decay.q[:, column] - rest.q[column]
    up = np.flatnonzero((swing[:-1] < 0) & (swing[1:] >= 0))
    passages = decay.t[up] - swing[up] * (decay.t[up + 1] - decay.t[up]) / (swing[up + 1] - swing[up])
    period = np.diff(passages).mean()
    print(f"{names[column]:8}{mode.period:10.4f} s{period:12.4f} s{period / mode.period - 1:13.1e}")
    assert abs(period / mode.period - 1) < 0.005

# %% [markdown]
# ### What changes a period
#
# The derivative of a frequency by any parameter is exact, and counts that the equilibrium moves with it. Next to it stands the
# difference quotient of two equilibria and their modes.

# %%
pitch = modes["theta"]


def pitch_period(**params):
    return floating.linearize(floating.equilibrium(fixed=kept, params=params, start=rest)).modes()["theta"].period


print(f"{'pitch period by':20}{'derivative':>14}{'quotient':>14}{'of 1 % more':>15}")
for name in ("m_N", "h_T", "A_pitch", "L_h", "m_P"):
    slope = -linear.derivative("theta", name).damped_frequency * pitch.period**2
    value, change = rest[name], 1e-4 * rest[name]
    quotient = (pitch_period(**{name: value + change}) - pitch_period(**{name: value - change})) / (2 * change)
    print(f"{name:20}{slope:14.6g}{quotient:14.6g}{slope * 0.01 * value:13.4f} s")
    assert abs(quotient / slope - 1) < 1e-4

# %% [markdown]
# The length of the hull $L_h$ does most: with it grow the second moment of the water plane, and the pitch stiffness. (Its added
# mass is a parameter of its own here.)

# %% [markdown]
# ## 7. Motion
#
# The rotor starts by the torque of the wind, which falls as it gets faster, against the torque of the generator, which grows.
#
# Every run integrates the work of its loads along with the motion: of wind, drives and damping. The error of the run is input −
# dissipation − change of energy, relative to the kinetic energy or the range of the potential energy, whichever is larger.

# %%
RATED = 12.1 * np.pi / 30  # rad/s, of the rotor


def run(title, seconds=120.0, **start):
    motion = floating.simulate((0, seconds), work=True, rtol=1e-10, **start)
    print(f"{title:44}{motion.n_steps:6} steps, energy balance {motion.energy_error():.0e}")
    assert motion.success and motion.energy_error() < 1e-8
    return motion


def ramp(begin, end, value):
    """A table over time: zero, then a rise, then the value."""
    return np.array([0.0, begin, end, 1e4]), np.array([0.0, 0.0, value, value])


speed = floating.metadata.x.index("azimuth_dot")
startup = {"v_w": ramp(1, 30, 8.0), "tau_a": lambda t, x: 2e6 * min(t / 30, 1.0) * (2 - x[speed] / RATED),
           "tau_g": lambda t, x: 2e6 * x[speed] * abs(x[speed]) / RATED**2}
runs = {
    "start-up of the rotor": run("start-up of the rotor", 180, inputs=startup),
    "pitch": run("free decay in pitch, from 5 degrees", q={"theta": rest["theta"] + np.radians(5)}),
    "heave": run("free decay in heave, from 1 m", q={"z": rest["z"] + 1}),
    "thrust step": run("thrust step", 200, inputs={"v_w": ramp(20, 20.5, 10.0)}),
}

# %%
start = runs["start-up of the rotor"]
figure, axes = plt.subplots(2, 2, figsize=(10, 6), layout="constrained")
axes[0, 0].plot(start.t, start["azimuth_dot"] * 30 / np.pi, label="rotor, rpm")
axes[0, 0].plot(start.t, start["v_w"], label="wind, m/s")
axes[0, 0].plot(start.t, start["x"], label="surge, m")
axes[0, 0].set(title="start-up of the rotor")
axes[0, 1].plot(start.t, np.degrees(start["theta"]), label="pitch")
axes[0, 1].plot(start.t, np.degrees(start["phi"]), label="roll")
axes[0, 1].set(title="start-up of the rotor", ylabel="angle, degrees")
axes[1, 0].plot(runs["pitch"].t, np.degrees(runs["pitch"]["theta"]), label="pitch, degrees")
axes[1, 0].plot(runs["heave"].t, runs["heave"]["z"], label="heave, m")
axes[1, 0].set(title="free decays", xlabel="time, s", xlim=(0, 80))
step = runs["thrust step"]
axes[1, 1].plot(step.t, np.degrees(step["theta"]), label="pitch, degrees")
axes[1, 1].plot(step.t, step["x"] / 10, label="surge, 10 m")
axes[1, 1].set(title="thrust step: wind from 0 to 10 m/s", xlabel="time, s")
for a in axes.flat:
    a.grid(color="0.9")
    a.legend(frameon=False)
plt.show()

# %% [markdown]
# The start-up shows two things besides the rotor. The wind takes the platform along and lets it pitch. The generator's torque
# goes from the rotor through the tower to the platform, which rolls a little. In the thrust step the pitch overshoots within
# seconds, the surge within a minute.

# %%
heights = [float(e) for e in np.degrees([step["theta"].max(), step["theta"][-1]])]
print(f"thrust step: largest pitch {heights[0]:.2f} degrees, {heights[1]:.2f} at the end; "
      f"equilibrium in this wind {np.degrees(floating.equilibrium(fixed=kept, inputs={'v_w': 10.0})['theta']):.2f}")
print(f"start-up: roll at the end {np.degrees(start['phi'][-1]):.3f} degrees, at {start['azimuth_dot'][-1] * 30 / np.pi:.2f} rpm")

# %% [markdown]
# ### Yaw of the nacelle under a spinning rotor
#
# The rotor has the angular momentum $\mathbf L = I_x \Omega\, \mathbf e$ along its shaft $\mathbf e$. Turning the nacelle at
# $\dot\psi_N$ turns it, $\dot{\mathbf L} = \dot\psi_N \mathbf k \times \mathbf L$, which takes this moment on the rotor. The
# platform gets the reaction, $-\dot\psi_N \mathbf k \times \mathbf L$. With the shaft along $x$, $\mathbf k \times \mathbf i =
# \mathbf j$: the moment is along $-y$, the pitch is negative, and the turbine leans against the wind. This is the sign of the
# term of section 1. When the nacelle has turned, $\mathbf e = [\cos\psi_N, \sin\psi_N, 0]$ gives a moment $+\sin\psi_N$ in roll.
#
# The nacelle turns by 37.5° at 0.5° per second, begun and ended gently, with the rotor spinning and with the rotor at rest. The
# difference is the gyroscopic effect. Divided by the stiffness of section 6 the moment gives the angles at which it is in
# balance.

# %%
rate = np.radians(0.5)


def gently(t, begin, end):
    """Integral over time of a rise from 0 to 1 between two times."""
    return np.clip(t - begin, 0, end - begin)**2 / (2 * (end - begin)) + np.maximum(t - end, 0)


turn = {"yaw_c": lambda t, x: rate * (gently(t, 10, 25) - gently(t, 85, 100))}
t = np.linspace(0, 120, 241)
spinning, resting = (floating.simulate(t, rest.q, {"azimuth_dot": omega}, inputs=turn, work=True, rtol=1e-9)
                     for omega in (RATED, 0.0))
for motion in (spinning, resting):
    assert motion.energy_error() < 1e-8
I_shaft = floating.linearize(rest.x).M[-1, -1]
moment = I_shaft * RATED * rate * np.interp(t, [10, 25, 85, 100], [0, 1, 1, 0])
places = {name: linear.coordinates.index(name) for name in ("theta", "phi")}
expected = {"theta": -moment * np.cos(spinning["yaw"]), "phi": moment * np.sin(spinning["yaw"])}
turning = (t > 25) & (t < 85)
print(f"I_x = {I_shaft:.4g} kg m^2, moment {moment[turning].mean() / 1000:.0f} kN m; "
      f"energy balances {spinning.energy_error():.0e} and {resting.energy_error():.0e}")

figure, axes = plt.subplots(figsize=(9, 3.6), layout="constrained")
for name, label in (("theta", "pitch"), ("phi", "roll")):
    difference = np.degrees(spinning[name] - resting[name])
    balance = np.degrees(expected[name] / linear.K[places[name], places[name]])
    line, = axes.plot(t, 1000 * difference, label=label)
    axes.plot(t, 1000 * balance, "--", color=line.get_color(), linewidth=1, label=f"{label}, in balance")
    print(f"{label}: {1000 * difference[turning].mean():.1f} mdeg on the average from 25 s to 85 s, expected "
          f"{1000 * balance[turning].mean():.1f} mdeg")
axes.set(xlabel="time, s", ylabel="spinning less resting, mdeg")
axes.grid(color="0.9")
axes.legend(frameon=False, ncols=2)
plt.show()

# %% [markdown]
# The sign is as derived, and the size is small: a barge of 6000 t does not mind. The yaw bearing does, it carries the moment.
#
# ### Pictures
#
# Shapes belong to the description, `system.draw(body, ...)`; the catalogue's turbine has them.

# %%
runs["pitch"].picture([0, 0.5 * pitch.period], view=(12, -65))

# %%
with tempfile.TemporaryDirectory() as folder:
    film = Path(folder) / "turbine.gif"
    swaying = floating.simulate((0, 12), rest.q + [0, 0, 1, 0, np.radians(5), 0, 0, 0], {"azimuth_dot": RATED})
    swaying.animate(film, fps=4, speed=2)
    display(Image(data=film.read_bytes(), format="gif"))

# %% [markdown]
# The report of a run is one HTML file that needs no network: parameters, start, curves, extremes, energy, pictures.

# %%
with tempfile.TemporaryDirectory() as folder:
    page = step.report(Path(folder) / "thrust_step.html").read_text(encoding="utf-8")
print(f"{len(page) / 1000:.0f} kB")

# %% [markdown]
# ## 8. Flexible tower and blades
#
# The same turbine with a tower that bends in two modes fore and aft and two from side to side, and blades that bend in three
# modes each. Bodies are given by tables of mass and stiffness over their length; the large motion of the platform, the rotation
# of the rotor and the small deflections act on each other. Hydrostatics and elasticity find their equilibrium together.

# %%
flexible = sd.systems.floating_wind_turbine(flexible=True).embedding().compile()
bent = flexible.equilibrium(fixed=kept)
elastic = flexible.linearize(bent)
print(f"pitch {np.degrees(bent['theta']):.4f} degrees")
print(f"tower top in its first mode {1000 * bent['tower_fa1']:.1f} mm along x, towards the rotor")
print(f"tips of the two lower blades in their first edgewise mode {bent['blade2_edge1']:.2f} m and {bent['blade3_edge1']:.2f} m")
print(elastic.modes())

# %% [markdown]
# Surge, sway, yaw and heave stay. Pitch and roll take longer than the rigid ones of section 6: the tower gives way. With tower
# and blades made stiffer by a factor the flexible turbine goes over into the rigid one. The blades of the table are 0.7 % lighter
# than the sums which the reference code makes of it and the rigid turbine has, and so the rigid one gets their mass, centre and
# inertia here.

# %%
blade = blade_beam().modal
z_B = blade.h0[2] / blade.m
same_blade = {"m_B": blade.m, "z_B": z_B, "I_B": blade.I0[0, 0] - blade.m * z_B**2}
print(f"a blade of the table: {blade.m:.0f} kg, of the rigid turbine: {rest['m_B']:.0f} kg")
rigid = floating.linearize(floating.equilibrium(fixed=kept, params=same_blade)).modes()["theta"].period
print(f"{'stiffness':>10}{'pitch period':>16}{'less the rigid one':>22}")
for factor in (1.0, 10.0, 100.0, 1e4, 1e6):
    stiff = flexible.equilibrium(fixed=kept, params={"s_T": factor, "s_B": factor}, start=bent)
    period = flexible.linearize(stiff).modes()["theta"].period
    print(f"{factor:10g}{period:14.5f} s{period - rigid:20.6f} s")
assert abs(period - rigid) < 1e-5

# %% [markdown]
# ### The tower on land and afloat
#
# With the platform held the turbine stands on land. Its first frequency fore and aft is often quoted as 0.324 Hz. Afloat the foot
# turns with the barge, and the tower bends against it.

# %%
platform_held = dict.fromkeys(("x", "y", "z", "psi", "theta", "phi"), 0.0)
on_land = flexible.linearize(flexible.equilibrium(fixed={**kept, **platform_held})).modes()
for name in ("tower_fa1", "tower_ss1"):
    print(f"{name}: on land {on_land[name].frequency:.4f} Hz, afloat {elastic.modes()[name].frequency:.4f} Hz")
print(f"3P meets the tower fore and aft at {elastic.modes()['tower_fa1'].frequency / 3 * 60:.1f} rpm afloat, at "
      f"{on_land['tower_fa1'].frequency / 3 * 60:.1f} rpm on land")

# %% [markdown]
# Three times in a revolution (3P) a blade passes the tower. The rotor works from 6.9 to 12.1 rpm (NREL/TP-500-38060). On land the
# tower lies below 3P in all of that range; afloat 3P goes through its frequency in the middle of the range. A tower made for land
# cannot simply be put on a barge.
#
# ### In the wind
#
# In equilibrium with a steady wind of 10 m/s the turbine leans as a whole, and its tower bends on top of that.

# %%
windy = flexible.equilibrium(fixed=kept, inputs={"v_w": 10.0}, start=bent)
stiffer = floating.equilibrium(fixed=kept, inputs={"v_w": 10.0})
print(f"pitch {np.degrees(windy['theta']):.3f} degrees (rigid {np.degrees(stiffer['theta']):.3f}); the tower's top is "
      f"{windy['tower_fa1']:.3f} m off the straight tower, and {87.6 * np.sin(windy['theta']):.2f} m off the vertical")

# %% [markdown]
# ## 9. Campbell diagram
#
# A rotor with three equal blades is constant in time when it is seen from the nacelle: by multi-blade coordinates, which are the
# mean of the blades and how they lean to one side or the other. `blades` says which coordinates belong together.
# The weight of the blades leaves small periodic terms. `averaged=True` takes the mean over the azimuth, and prints how much the
# equations vary; without it Floquet theory follows the periodic motion at every speed, which changes these frequencies by less
# than 0.03 per cent.

# %%
groups = [[f"blade{k}_{mode}" for k in (1, 2, 3)] for mode in ("flap1", "edge1", "flap2")]
diagram = flexible.campbell("azimuth_dot", np.linspace(0.1, 1.4, 14), blades=groups, fixed={"yaw": 0}, averaged=True)
diagram.plot(highest=1.5)

# %% [markdown]
# The modes of the platform lie at the bottom, far from the rotor's. The first flapwise mode splits in two that whirl, one with
# the rotor and one against it; seen from the nacelle they are apart by about twice the speed of the rotor. Where a line of 1P, 3P
# or 6P meets a mode the rotor shakes it.

# %%
last = diagram.modes[-1]
flapping = sorted(m.damped_frequency for m in last if "flap1" in m.name and "collective" not in m.name)
print(f"whirling flap modes at {diagram.values[-1]:.2f} rad/s: {flapping[0]:.3f} Hz and {flapping[-1]:.3f} Hz, apart by "
      f"{flapping[-1] - flapping[0]:.3f} Hz; twice the speed: {diagram.values[-1] / np.pi:.3f} Hz")

# %% [markdown]
# ## 10. A floating crane
#
# The lecture's other example: a hull of 110 m x 45 m with a light weight of 9500 t lifts 2608 t over its side, at a draft of
# 7.5 m. Heights, outreach and tanks are assumed. Ballast $m_x$ goes from the starboard to the port tank, until it floats upright.

# %%
crane = sd.systems.floating_crane().embedding().compile(backend="numpy")
ashore = sd.systems.floating_crane("ashore").embedding().compile(backend="numpy")
held = {"x": 0, "y": 0, "psi": 0}
before = ashore.equilibrium(fixed=held)
lifted = crane.equilibrium(fixed=held)
upright = crane.equilibrium(free=["z", "theta", "phi", "alpha", "beta", "m_x"], fixed={**held, "phi": 0.0})
for title, module, state in (("before lifting", ashore, before), ("lifted", crane, lifted),
                             ("lifted, with ballast", crane, upright)):
    values = module.outputs(0, state.x, params=state.params)
    print(f"{title:22} draft {values['draft']:.3f} m, heel {values['heel_deg']:6.3f} degrees")
print(f"ballast moved: {upright['m_x'] / 1000:.1f} t; by moments 2 m_x y_b = m_c |y_t|: "
      f"{-upright['m_c'] * upright['y_t'] / (2 * upright['y_b']) / 1000:.1f} t")

# %% [markdown]
# ## 11. The slides, formula by formula
#
# `sd.compare("6")` compares all derivations of the chapter with what follows from bodies and joints. Here are two that have
# errors; an entry is called wrong only where an independent proof shows it.

# %%
slides = sd.compare(["platform-transformation", "fixed-joint-constraint"])
display(slides)

# %%
for case in slides:
    for formula, error in case.errata:
        print(f"line {formula.slide.line}  {formula.name}: {error.why}")
