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
# # A quadrotor with a slung load
#
# A body with six freedoms, four rotors, and a mass on a cable: it is found at hover by trim, linearized, kept there by
# a regulator, and then flown to another place.

# %%
import matplotlib.pyplot as plt
import numpy as np

import symdyn as sd

# %% [markdown]
# ## 1. Description
#
# The frame is free in space. Its orientation has ZYX angles for coordinates and the angular velocity in body axes for
# speeds, so that its equations are Euler's. The rotors push along the body's z axis and turn it by their arms; the drag
# of a rotor acts as a moment about z, in the direction opposite to its spin. The cable is a universal joint below the
# centre, the load a point mass at its end.

# %%
position, angles = sd.coordinates("x y z"), sd.coordinates("psi theta phi")
alpha, beta = sd.coordinates("alpha beta")
m, A, C, a, c, m_L, l, g = sd.parameters("m A C a c m_L l g", positive=True)
T = sd.inputs("T1:5")

drone = sd.System("quadrotor_with_load", gravity=[0, 0, -g])
frame = drone.add_body("frame", mass=m, inertia=[A, A, C])
drone.add_joint(sd.Free("flight", drone.ground, frame, coordinates=[*position, *angles],
                        orientation=sd.EulerAngles("ZYX", speeds="body")))
load = drone.add_body("load", mass=m_L, com=[0, 0, -l])
drone.add_joint(sd.Universal("cable", frame, load, coordinates=[alpha, beta]))
arms = [(a, 0, 0), (0, a, 0), (-a, 0, 0), (0, -a, 0)]
for k, (thrust, arm) in enumerate(zip(T, arms, strict=True)):
    drone.add_force(frame, [0, 0, thrust], point=arm, frame=frame)
    drone.add_torque(frame, [0, 0, (-1) ** k * c * thrust], frame=frame)
drone.add_output("load", sd.position(load, [0, 0, -l]))
drone.defaults = {m: 1.2, A: 0.012, C: 0.022, a: 0.2, c: 0.016, m_L: 0.3, l: 1.0, g: 9.81}

equations = drone.equations()
print(f"{equations.formulation}: {len(equations.symbols.coordinates)} coordinates, {len(equations.symbols.speeds)} speeds")
module = equations.compile()

# %% [markdown]
# ## 2. Hover
#
# At rest the four thrusts carry the weight. Trim finds them: four inputs are free, four coordinates are fixed, and the
# others are found with them. By symmetry each rotor must carry a quarter.

# %%
names = [str(thrust) for thrust in T]
hover = module.equilibrium(free=names, fixed=dict.fromkeys(["x", "y", "z", "psi"], 0), start=dict.fromkeys(names, 4.0))
print({name: round(float(hover.solved[name]), 6) for name in names})
assert np.allclose([hover.solved[name] for name in names], 1.5 * 9.81 / 4)

linear = module.linearize(hover, hold=())
print(linear.modes())

# %% [markdown]
# Everything drifts but the load, which swings. Its frequency has a closed form: the frame is a free body that gives
# way, so that $\omega^2 = \frac{g}{l}\,\frac{m + m_L}{m}$.

# %%
swing = max(np.abs(linear.eigenvalues))
print(f"{swing:.9f} rad/s, closed form {np.sqrt(9.81 * 1.5 / 1.2):.9f} rad/s")
assert abs(swing - np.sqrt(9.81 * 1.5 / 1.2)) < 1e-9

# %% [markdown]
# ## 3. A regulator
#
# Weights by name: positions in metres, the turn about the vertical, the load's swing, and small changes of the thrusts.
# Where a speed is an angular velocity, the turn along it is a state of its own.

# %%
print(", ".join(linear.states))
weights = {"x": 2, "y": 2, "z": 4, "along_omega_z_flight": 1, "alpha": 4, "beta": 4}
regulator = linear.lqr(weights, dict.fromkeys(names, 1.0))
print(f"slowest mode of the closed loop {regulator.eigenvalues.real.max():.3f} 1/s")

# %% [markdown]
# ## 4. To another place
#
# The target moves 3 m along x and 2 m up, smoothly in 4 s. The regulator is a function of time and state: it reads the
# turns from the angles itself. Given the state less the target, it leads to the target, in steps of 10 ms, on the
# nonlinear equations.

# %%
goal = np.array([3.0, 0.0, 2.0])


def target(t):
    """The state wanted at t: positions and velocities of the frame, everything else zero."""
    s = np.clip(t / 4, 0, 1)
    wanted = np.zeros(16)
    wanted[:3] = goal * (10 * s**3 - 15 * s**4 + 6 * s**5)
    wanted[8:11] = goal * (30 * s**2 - 60 * s**3 + 30 * s**4) / 4
    return wanted


def rotors(t, state):
    """Four thrusts, which cannot pull."""
    return np.clip(regulator(t, state - target(t)), 0, 12)


flight = module.simulate((0, 9), inputs={T: sd.Sampled(rotors, 0.01)}, rtol=1e-9, work=True)
print(flight)
print(f"energy less work {flight.energy_error():.1e}")
assert np.abs(flight.x[-1, :3] - goal).max() < 0.01

figure, (top, middle, bottom) = plt.subplots(3, 1, figsize=(8, 6.4), sharex=True, layout="constrained")
for k, axis in enumerate("xz"):
    top.plot(flight.t, flight[axis], color=f"C{k}", label=f"frame {axis}")
    top.plot(flight.t, flight.outputs["load"][:, 2 * k], "--", color=f"C{k}", label=f"load {axis}")
middle.plot(flight.t, np.degrees(flight["theta"]), label="pitch")
middle.plot(flight.t, np.degrees(flight["beta"]), label="cable")
for name in names:
    bottom.plot(flight.t, flight[name], label=name)
for axes, label in ((top, "position [m]"), (middle, "angle [deg]"), (bottom, "thrust [N]")):
    axes.set(ylabel=label)
    axes.grid(color="0.9")
    axes.legend(loc="center left", bbox_to_anchor=(1, 0.5), frameon=False)
bottom.set(xlabel="t [s]")
plt.show()

# %% [markdown]
# ## What to read next
#
# - [Control](../docs/control.md) and [linear analysis](../docs/linear_analysis.md).
# - [Optimal motion](../docs/optimal_motion.md) finds a flight of least effort instead of a smooth guess.
