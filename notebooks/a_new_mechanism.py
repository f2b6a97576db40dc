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
# # A new mechanism: an overhead crane
#
# This mechanism is not in the catalogue. It is described, printed, verified, turned into C, simulated and improved, all with
# a few lines each. The last section shows what happens when a description is wrong.
#
# A trolley runs on a rail. A belt pulls it; the belt stretches a little. From the trolley a rope hangs, with a hook at its
# end; the rope stretches too. A container hangs below the hook on a sling that can be taken as stiff. Hook and container
# make a double pendulum.

# %%
import shutil
import subprocess
import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
from IPython.display import Math, display
from sympy import latex

import symdyn as sd

# %% [markdown]
# ## 1. Description
#
# | symbol | meaning |
# |---|---|
# | $x$ | position of the trolley on the rail |
# | $\alpha$, $r$ | angle of the rope from the vertical, its length |
# | $\beta$ | angle of the sling, relative to the rope |
# | $s$ | position of the belt, an extra state |
# | $v$ | speed of the belt, the input |
#
# The rope is a body without mass between a revolute and a prismatic joint. The spring-damper between trolley and hook
# is its stretch. The belt pulls with a spring and a damper too; its position $s$ is the integral of its speed, $\dot s = v$.

# %%
x, alpha, beta, s = sd.coordinates("x alpha beta s")
r = sd.coordinates("r", positive=True)
v = sd.inputs("v")
g, m_t, m_h, m_c, I_c, b, l, k_r, d_r, k_b, d_b = sd.parameters("g m_t m_h m_c I_c b l k_r d_r k_b d_b")

crane = sd.System("crane", gravity=[0, -g])
trolley = crane.add_body("trolley", mass=m_t)
rope = crane.add_body("rope")
hook = crane.add_body("hook", mass=m_h)
container = crane.add_body("container", mass=m_c, inertia=I_c, com=[0, -b])

rail = crane.add_joint(sd.Prismatic("rail", crane.ground, trolley, x, axis=[1, 0]))
crane.add_joint(sd.Revolute("sheave", trolley, rope, alpha))
crane.add_joint(sd.Prismatic("hoist", rope, hook, r, axis=[0, -1]))
crane.add_joint(sd.Revolute("sling", hook, container, beta))

crane.add_spring_damper(trolley, hook, stiffness=k_r, damping=d_r, length=l, name="stretch")
crane.add_state(s, v)
crane.add_joint_force(rail, k_b * (s - x) + d_b * (v - x.dot), name="belt")
crane.add_output("container", sd.position(container, [0, -b]))

# %% [markdown]
# Numbers: a trolley of 500 kg, a hook of 100 kg on 6 m of rope, a container of 1 t. Units are known where a symbol's use
# lists them; the others are added.

# %%
crane.defaults = {g: 9.81, m_t: 500.0, m_h: 100.0, m_c: 1000.0, I_c: 400.0, b: 1.5,
                  l: 6.0, k_r: 2e5, d_r: 4e3, k_b: 5e5, d_b: 2e4}
crane.units = {s: "m", v: "m/s", k_b: "N/m", d_b: "N s/m"}

# %% [markdown]
# ## 2. Equations
#
# Rows and columns are in the order $x$, $\alpha$, $r$, $\beta$. First the mass matrix: it is full, everything
# moves everything.

# %%
equations = crane.embedding()
display(Math(rf"\tilde{{\mathbf M}} = {latex(equations.M_tilde)}"))

# %% [markdown]
# Centrifugal and Coriolis terms.

# %%
display(Math(rf"\tilde{{\mathbf k}} = {latex(equations.k_tilde)}"))

# %% [markdown]
# Forces: belt, weight, stretch of the rope.

# %%
display(Math(rf"\tilde{{\mathbf F}} = {latex(equations.F_tilde)}"))

# %% [markdown]
# ## 3. Verification
#
# Nobody has derived this crane before, so there is nothing to compare with. The identities do not need it.

# %%
verification = equations.verify()
print(verification)
assert verification.passed

# %% [markdown]
# ## 4. The C code
#
# The source is one file with a header, plain C99, without any allocation. `main.c` is an example that checks every function
# against reference vectors. Here are the beginnings of source and header.

# %%
folder = tempfile.TemporaryDirectory()
files = equations.write(folder.name, backend="c")
print(", ".join(file.name for file in files), end="\n\n")
print("\n".join(Path(folder.name, "crane.c").read_text().splitlines()[:60]), end="\n\n...\n")

# %%
header = Path(folder.name, "crane.h").read_text().splitlines()
first = next(n for n, line in enumerate(header) if line.startswith("enum"))
print("\n".join(header[first:first + 20]), end="\n\n...\n")

# %% [markdown]
# Build it and let it check itself, if there is a compiler.

# %%
compiler = shutil.which("cc") or shutil.which("gcc") or shutil.which("clang")
if compiler:
    build = [compiler, "-std=c99", "-O2", "-Wall", "-Wextra", "-o", "crane_check", "main.c", "crane.c", "-lm"]
    subprocess.run(build, cwd=folder.name, check=True)
    print(subprocess.run([Path(folder.name, "crane_check")], check=True, capture_output=True, text=True).stdout)
else:
    print("there is no C compiler here")

# %% [markdown]
# ## 5. How the load swings
#
# The same code, compiled and loaded, is a module that evaluates and simulates. Without a compiler it is NumPy code.
#
# In equilibrium the rope is longer than $l$ by what hook and container stretch it. There the exact Jacobian of the state
# equations gives the natural periods of the crane: the slow swing of the load, the fast swing of container against hook,
# the bounce of the rope and the stretch of the belt.

# %%
module = equations.compile()
sag = (crane.defaults[m_h] + crane.defaults[m_c]) * crane.defaults[g] / crane.defaults[k_r]
still = {"x": 0, "alpha": 0, "r": crane.defaults[l] + sag, "beta": 0}
state = np.array([*still.values(), *np.zeros(5)])
assert np.allclose(module.rhs(0, state, inputs=[0.0]), 0, atol=1e-9)

modes = np.linalg.eigvals(module.jacobian(0, state, wrt=["x"]).x)
periods = sorted(2 * np.pi / mode.imag for mode in modes if mode.imag > 1e-6)[::-1]
print("periods:", ", ".join(f"{period:.3f} s" for period in periods))

# %% [markdown]
# ## 6. A move that leaves no swing
#
# The belt speeds up evenly, runs, and slows down evenly. If speeding up takes just one period of the slow swing, the load
# ends it as it began it: hanging still below the trolley. The same goes for slowing down. The input is a table of times and
# speeds.

# %%
ramp, cruise, speed = periods[0], 2.0, 1.5
times = np.array([0, ramp, ramp + cruise, 2 * ramp + cruise])
speeds = np.array([0, speed, speed, 0])
stop = times[-1]

move = module.simulate(np.linspace(0, 25, 1001), still, inputs=(times, speeds), extend="hold")
print(move)
move.plot()

# %% [markdown]
# ### Three lengths of rope
#
# The move is tuned to 6 m of rope. What if the rope is shorter or longer? The parameter $l$ changes, the compiled code does
# not. A start in equilibrium needs the length $r$ to change with it.

# %%
swings = {}
figure, axes = plt.subplots(figsize=(8, 4), layout="constrained")
for length in (4.0, 6.0, 8.0):
    run = module.simulate(move.t, {**still, "r": length + sag}, params={l: length}, inputs=(times, speeds), extend="hold")
    swing = run.outputs["container"][:, 0] - run.q[:, 0]
    swings[length] = np.abs(swing[run.t > stop]).max()
    axes.plot(run.t, swing, label=f"l = {length:g} m")
axes.axvline(stop, color="0.5", linestyle=":", label="belt stops")
axes.set(xlabel="t [s]", ylabel="container from trolley [m]", title="swing of the container")
axes.grid(color="0.9")
axes.legend()
plt.show()
for length, swing in swings.items():
    print(f"rope of {length:g} m: swings by {swing * 1e3:.1f} mm after the stop")
assert swings[6.0] < 0.01 * min(swings[4.0], swings[8.0])

# %% [markdown]
# ## 7. When the description is wrong
#
# All faults are reported at once, each with what was found and what to do about it. This description has three: a mass
# that is text, a body that hangs on nothing, and a load that depends on a coordinate which no joint moves.

# %%
wrong = sd.System("wrong", gravity=[0, -g])
cart = wrong.add_body("cart", mass="500")
ball = wrong.add_body("ball", mass=m_h)
slide = wrong.add_joint(sd.Prismatic("slide", wrong.ground, cart, x, axis=[1, 0]))
wrong.add_joint_force(slide, -k_b * alpha, name="pull")
try:
    wrong.embedding()
except sd.ModelError as error:
    print(error)
    assert len(error.faults) == 3

# %% [markdown]
# The same goes for the values of a simulation.

# %%
try:
    module.simulate((0, 1), params={"m_tt": 600})
except sd.SymdynError as error:
    print(error)
