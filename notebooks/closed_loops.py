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
# # Constraints and closed loops
#
# A four-bar linkage has three angles and one degree of freedom. Solving for two of the angles is tedious, and for most
# mechanisms impossible. The augmented formulation keeps all coordinates, adds the constraints between them, and makes the
# constraint forces unknowns, too: the multipliers. This is the lecture's chapters 3.3, 3.4 and 6.3.
#
# The notebook goes from a pendulum by hand to mechanisms with published solutions. It shows how a motion is kept on
# its constraints, which forces the joints carry, and what happens where constraints depend on each other.

# %%
import tempfile
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import sympy as sp
from IPython.display import Image, Math, display
from sympy import latex

import symdyn as sd


def show(name, value):
    display(Math(rf"{name} = {latex(value)}"))


def show_all(equations):
    for equation in equations:
        display(Math(latex(equation)))


# %% [markdown]
# ## 1. A pendulum in $x$ and $y$
#
# A point mass hangs on a massless rod of length $l$, with its pivot at the origin and $y$ upward. Its coordinates are
# $\mathbf r = [x, y]^T$. They are not independent:
#
# $$C(\mathbf r) = x^2 + y^2 - l^2 = 0$$
#
# `sd.augmented` takes what the lecture writes down: coordinates, masses, forces and constraints.

# %%
x, y = sd.coordinates("x y")
m, g, l = sd.parameters("m g l")

pendulum = sd.augmented([x, y], mass=[m, m], force=[0, -m * g], constraints=[x**2 + y**2 - l**2], name="pendulum",
                        names=["rod"], defaults={m: 1.0, g: 9.81, l: 1.0}, initial={x: 1.0, y: 0.0})
display(pendulum)

# %% [markdown]
# In the matrix, $\mathbf C_r$ is the derivative of the constraint by the coordinates. Its second derivative by time must
# vanish, which gives the last row:
#
# $$\mathbf C_r \ddot{\mathbf r} = F_d \qquad F_d = -(\mathbf C_r \dot{\mathbf r})_r \dot{\mathbf r} - 2 \mathbf C_{rt}
# \dot{\mathbf r} - C_{tt}$$

# %%
show(r"\mathbf C_r", pendulum.C_r)
show("F_d", pendulum.F_d)

# %% [markdown]
# One equation for each coordinate, then one for each constraint. The constraint force is $-\mathbf C_r^T \lambda$: it points
# along the rod.

# %%
show_all(pendulum.equations)
show(r"-\mathbf C_r^T \lambda", pendulum.constraint_forces)
show(r"\lambda", pendulum.lam)

# %% [markdown]
# Two terms carry the rod: the weight along it, and the speed around it. Hanging still at $(0, -l)$ it carries $m g$.

# %%
still = {x: 0, y: -l, x.dot: 0, y.dot: 0}
force = (-pendulum.C_r.T * pendulum.lam).subs(still)
show(r"\text{force on the mass}", sp.simplify(force))
assert sp.simplify(force - sp.Matrix([0, m * g])).is_zero_matrix

# %% [markdown]
# ### Without multipliers
#
# The rows of a dependent coordinate determine the multiplier. The other rows then give an equation of motion without
# it. On a fixed track that falls at the angle $\theta$ this is the lecture's example of chapter 3.3.

# %%
theta = sd.parameters("theta")
track = sd.augmented([x, y], mass=[m, m], force=[0, -m * g], constraints=[x * sp.tan(theta) + y], name="track")
display(track)
show(r"\lambda", track.lam)
show_all(track.without_multipliers([y]))

# %% [markdown]
# ## 2. Keeping a motion on its constraints
#
# The equations of motion contain $\ddot C = 0$ only. Rounding and the errors of the steps stay in $\dot C$, and $C$ drifts
# away. There are three ways to treat this:
#
# - nothing at all (`stabilization="none"`);
# - Baumgarte's method: $\ddot C + 2 a \dot C + a^2 C = 0$ in place of $\ddot C = 0$ pulls the motion back (`"baumgarte"`, with
#   a gain of its own choice, or `("baumgarte", a)`);
# - projection: after every step the smallest change that fulfils $C = 0$ and $\dot C = 0$ (`"projection"`, the default).
#
# The pendulum starts level and swings for 100 s, with the same tolerance for all three.

# %%
module = pendulum.compile()


def energy(sol):
    """m v^2 / 2 + m g y: zero at the start."""
    return 0.5 * (sol.u**2).sum(axis=1) + 9.81 * sol[y]


ways = {"none": "none", "Baumgarte": "baumgarte", "projection": "projection"}
runs = {title: module.simulate((0, 100), stabilization=way, rtol=1e-6) for title, way in ways.items()}

figure, (left, right) = plt.subplots(1, 2, figsize=(10, 3.8), layout="constrained")
for k, (title, sol) in enumerate(runs.items()):
    for axes, error in ((left, np.abs(sol.constraint_violation[:, 0])), (right, np.abs(energy(sol)) / 9.81)):
        axes.semilogy(sol.t[1:], np.maximum(error[1:], 1e-17), color=f"C{k}", linewidth=0.8, label=title)
left.set(title="constraint violation / l", xlabel="t [s]", ylim=(1e-17, 1e-1))
right.set(title="energy error / (m g l)", xlabel="t [s]", ylim=(1e-9, 1e-1))
for axes in (left, right):
    axes.grid(color="0.9")
figure.legend(*left.get_legend_handles_labels(), loc="outside lower center", ncols=3)
plt.show()

for title, sol in runs.items():
    print(f"{title:11}{sol.n_steps:5} steps, violation up to {np.abs(sol.constraint_violation).max():.1e}, "
          f"energy error up to {np.abs(energy(sol)).max() / 9.81:.1e}")
assert np.abs(runs["projection"].constraint_violation).max() < 1e-12

# %% [markdown]
# Projection keeps the constraint to rounding and takes as many steps as no stabilization at all. The errors of the steps along
# the constraint remain. They show in the energy, and a smaller `rtol` makes them smaller. Baumgarte's method is meant
# for multistep methods, such as `BDF` and `LSODA`, which do not allow the state to be changed
# after a step.

# %% [markdown]
# ## 3. A four-bar linkage from bodies and joints
#
# Three bars hang on each other like a chain: the crank on the ground, the coupler on the crank, the rocker on the
# coupler. This is a tree, described as any other. The last hinge, between rocker and ground, closes the loop:
# `close_loop` takes the same joint classes as `add_joint`, and makes constraints of them. A motor drives the crank.

# %%
q1, q2, q3 = sd.coordinates("q1:4")
m1, m2, m3, l1, l2, l3, d = sd.parameters("m1 m2 m3 l1 l2 l3 d")
tau = sd.inputs("tau")

linkage = sd.System("linkage", gravity=[0, -g])
masses, lengths, names = (m1, m2, m3), (l1, l2, l3), ("crank", "coupler", "rocker")
crank, coupler, rocker = (linkage.add_body(name, mass=mass, inertia=mass * length**2 / 12, com=[length / 2, 0])
                          for name, mass, length in zip(names, masses, lengths, strict=True))
linkage.add_joint(sd.Revolute("A", linkage.ground, crank, q1))
linkage.add_joint(sd.Revolute("B", crank, coupler, q2, parent_point=[l1, 0]))
linkage.add_joint(sd.Revolute("C", coupler, rocker, q3, parent_point=[l2, 0]))
linkage.close_loop(sd.Revolute("D", linkage.ground, rocker, parent_point=[d, 0], child_point=[l3, 0]))
linkage.add_joint_force("A", tau, name="motor")
linkage.add_output("B", sd.position(crank, [l1, 0]))
linkage.add_output("C", sd.position(coupler, [l2, 0]))
linkage.add_output("D", sd.position(rocker, [l3, 0]))
linkage.add_output("acceleration", sd.acceleration(rocker, [l3 / 2, 0]))
linkage.defaults = {g: 9.81, m1: 1.0, m2: 2.0, m3: 1.5, l1: 0.8, l2: 1.8, l3: 1.6, d: 2.0}
linkage.initial = {q1: 1.0, q2: -0.5, q3: -2.2}

# %% [markdown]
# The start values are only about right: nobody has solved the loop yet. `diagnose` looks for the nearest state that fulfils
# it and says what the constraints do there and around.

# %%
print(linkage.diagnose())

# %% [markdown]
# ### The constraints
#
# They are the two coordinates of the point where hinge D is, of the rocker less of the ground.

# %%
equations = linkage.augmented()
show(r"\mathbf C", equations.C)
show(r"\mathbf C_r", equations.C_r)
module = equations.compile()
print("rows:", ", ".join(module.metadata.constraints))

# %% [markdown]
# ### Consistent states
#
# A simulation must start on the constraints. A state that does not fulfil them raises an error.
# `consistent` finds the nearest state that does. The guess selects one of the two ways to put the linkage together, and
# `keep` names the coordinates that must not change: here the angle of the crank.

# %%
try:
    module.simulate((0, 1))
except sd.ArgumentError as error:
    print(error)

guesses = {"open": {q1: 1.0, q2: -0.5, q3: -2.0}, "crossed": {q1: 1.0, q2: -2.0, q3: 2.0}}
branches = {name: module.consistent(guess, keep=[q1]) for name, guess in guesses.items()}


figure, panels = plt.subplots(1, 2, figsize=(8, 4.2), sharey=True, layout="constrained")
for axes, (name, (q, u)) in zip(panels, branches.items(), strict=True):
    points = module.outputs(0, [*q, *u], inputs=[0])
    corners = np.array([[0, 0], points["B"], points["C"], points["D"]])
    axes.plot(*corners.T, "o-", color="C0", linewidth=2, markersize=7, markerfacecolor="white")
    for label, corner, shift in zip("ABCD", corners, [(-14, 4), (-4, 9), (8, 0), (9, 4)], strict=True):
        axes.annotate(label, corner, xytext=shift, textcoords="offset points")
    title = ", ".join(f"{angle:.2f}" for angle in q)
    axes.set(title=f"{name}: q = {title} rad", aspect="equal", xlim=(-0.5, 2.6), ylim=(-1.5, 2.0), xlabel="x [m]")
    axes.grid(color="0.9")
panels[0].set(ylabel="y [m]")
plt.show()

# %% [markdown]
# ### Motion
#
# The motor turns the crank up to about one turn a second: its torque falls with the speed. The energy gained is the work of
# the motor. Constraint forces do no work, since the hinge at D stands still.

# %%
q, u = branches["open"]
motion = module.simulate((0, 3), q, u, inputs={tau: lambda t, state: 40 * (2 * np.pi - state[3])}, rtol=1e-9, work=True)
print(motion)
print(f"largest constraint violation: {np.abs(motion.constraint_violation).max():.1e}")
print(f"energy less work: {motion.energy_error():.1e}")
assert motion.energy_error() < 1e-7

figure, (top, bottom) = plt.subplots(2, 1, figsize=(8, 4.6), sharex=True, layout="constrained")
top.plot(motion.t, motion[q1.dot] / (2 * np.pi), label="crank")
top.plot(motion.t, motion.u.sum(axis=1) / (2 * np.pi), label="rocker")
top.set(ylabel="speed [turns/s]")
bottom.plot(motion.t, motion.work, label="work of the motor")
bottom.plot(motion.t[::25], (motion.energy - motion.energy[0])[::25], ".", label="energy gained")
bottom.set(ylabel="energy [J]", xlabel="t [s]")
for axes in (top, bottom):
    axes.grid(color="0.9")
    axes.legend(loc="center left", bbox_to_anchor=(1, 0.5), frameon=False)
plt.show()

# %%
with tempfile.TemporaryDirectory() as folder:
    film = Path(folder) / "linkage.gif"
    motion.animate(film, fps=10)
    display(Image(data=film.read_bytes(), format="gif"))

# %% [markdown]
# ## 4. Forces in the joints
#
# `sol.reactions` has the force and the moment of every joint on its child body, those of the tree and those that close loops,
# in the axes of the n-frame. A bearing is chosen by them. For the hinge that closes the loop they are the
# multipliers themselves, with the sign of $-\mathbf C_r^T \boldsymbol\lambda$.

# %%
print("joints:", ", ".join(motion.reactions))
assert np.allclose(motion.reactions["D"][:, :2], -motion.lam)

# %% [markdown]
# Newton's law of the rocker: two hinges and its weight move its centre of mass.

# %%
held = motion.reactions["C"][:, :2] + motion.reactions["D"][:, :2]
needed = 1.5 * (motion.outputs["acceleration"] + [0, 9.81])
print(f"largest difference: {np.abs(held - needed).max():.1e} N, of forces up to {np.abs(held).max():.0f} N")
assert np.allclose(held, needed, atol=1e-8)

# %% [markdown]
# `sol.reaction(joint, frame)` turns them into the axes of a body. In the axes of the rocker the first component is along the
# bar, the second across.

# %%
along, across = motion.reaction("D", frame="child")[:, :2].T
figure, axes = plt.subplots(figsize=(8, 3.2), layout="constrained")
axes.plot(motion.t, along, label="along the rocker")
axes.plot(motion.t, across, label="across the rocker")
axes.set(xlabel="t [s]", ylabel="force at D [N]")
axes.grid(color="0.9")
figure.legend(loc="outside lower center", ncols=2)
plt.show()

# %% [markdown]
# ## 5. Absolute coordinates
#
# In absolute coordinates each body has $x$, $y$ and $\theta$ of its own, and every joint becomes constraints, by
# one argument. Hinge A keeps its angle as well, because the motor acts along it.
#
# The start values of absolute coordinates come from the system's initial values. So these are put on the constraints first.

# %%
linkage.initial = dict(zip((q1, q2, q3), branches["open"][0], strict=True))
wide = linkage.augmented(coordinates="absolute").compile()
print("coordinates:", ", ".join(wide.metadata.q))
print("constraints:", ", ".join(wide.metadata.constraints))

# %% [markdown]
# Released with the motor off, the mechanism has the same motion and the same forces in its joints.

# %%
free = module.simulate((0, 2), q, inputs={tau: 0.0}, rtol=1e-10)
same = wide.simulate((0, 2), inputs={tau: 0.0}, rtol=1e-10)
for what, a, b in (("acceleration of the rocker", free.outputs["acceleration"], same.outputs["acceleration"]),
                   ("reaction at B", free.reactions["B"], same.reactions["B"])):
    print(f"{what}: up to {np.abs(a).max():.3g}, largest difference {np.abs(a - b).max():.1e}")
    assert np.allclose(a, b, atol=1e-6)

# %% [markdown]
# The numbers of operations differ. Absolute coordinates have a mass matrix that is nearly diagonal and constant, but many
# more unknowns. The report of a module counts the operations of its right-hand side.

# %%
print(f"{'':18}{'coordinates':>12}{'multipliers':>12}{'operations':>12}")
for system in (linkage, sd.systems.andrews_squeezer()):
    for coordinates in ("relative", "absolute"):
        compiled = system.augmented(coordinates=coordinates).compile(backend="numpy")
        count = compiled.report().rows[0].total
        sizes = compiled.metadata.sizes.q, len(compiled.metadata.constraints)
        print(f"{system.name:18}{sizes[0]:12}{sizes[1]:12}{count:12}  {coordinates}")

# %% [markdown]
# ## 6. Andrews' squeezing mechanism
#
# Seven bodies, three loops, six constraints, and a motion of milliseconds: the classic test of programs for closed loops. The
# crank turns two and a half times in 0.03 s. Here are its seven angles then, compared with the published ones.

# %%
squeezer = sd.systems.andrews_squeezer().augmented().compile()
published = np.array([15.81077119629904, -15.75637105984298, 0.04082224013073101, -0.5347301163226948, 0.5244099658805303,
                      0.5347301163226948, 1.048080741042263])
end = squeezer.simulate(t=[0, 0.03], rtol=1e-11)
print(f"{'':8}{'symdyn':>17}{'published':>17}")
for name, ours, theirs in zip(squeezer.metadata.q, end.q[-1], published, strict=True):
    print(f"{name:8}{ours:17.10f}{theirs:17.10f}")


def error(sol):
    return np.linalg.norm(sol.q[-1] - published) / np.linalg.norm(published)


assert error(end) < 1e-9

# %% [markdown]
# The picture shows the time over the accuracy; every point is one tolerance. The error stops falling near $10^{-10}$ because
# the published row itself is good to about ten digits. With loose tolerances little is saved: steps are longer, but after a
# long step the projection has more to correct.

# %%
tolerances = 10.0 ** -np.arange(3, 13)
table = []
for rtol in tolerances:
    repeats = [squeezer.simulate(t=[0, 0.03], rtol=rtol) for _ in range(5 if squeezer.backend == "c" else 1)]
    seconds = min(sol.integrator_seconds or sol.seconds for sol in repeats)
    table.append((seconds * 1e3, error(repeats[0]), repeats[0].n_steps))

print(f"{'rtol':>8}{'steps':>8}{'run time [ms]':>16}{'relative error':>17}")
for rtol, (time, gap, steps) in zip(tolerances, table, strict=True):
    print(f"{rtol:8.0e}{steps:8}{time:16.2f}{gap:17.1e}")

times, gaps, _ = np.array(table).T
figure, axes = plt.subplots(figsize=(6, 3.6), layout="constrained")
axes.semilogy(times, gaps, "o-")
axes.set(xlabel="run time [ms]", ylabel="relative error of the angles", xlim=(0, None))
axes.grid(color="0.9")
plt.show()

# %% [markdown]
# ## 7. A loop with one constraint too many
#
# The Bricard mechanism is a loop of five rods and six hinges in space. By count it should not move at all: five coordinates,
# five constraints. It moves, because its hinges stand at right angles and one constraint follows from the others.

# %%
bricard = sd.systems.bricard()
print(bricard.diagnose(reach=0.5))

# %% [markdown]
# Nothing has to be left out. The accelerations are unique; they come without the dependent row. The multipliers are not
# unique, since a moment that one constraint carries may as well be carried by others. Those of least norm are given, and
# `sol.unique` reports at every time which ones the motion determines.

# %%
folding = bricard.augmented().compile().simulate((0, 10), rtol=1e-10)
print(folding)
print(f"rank {folding.rank.min()} to {folding.rank.max()} of {folding.lam.shape[1]} constraints")
print("multipliers that are unique throughout:", folding.unique.all(axis=0))
print(f"energy error {folding.energy_error():.1e}, violation {np.abs(folding.constraint_violation).max():.1e}")
assert (folding.rank == 4).all() and not folding.unique.all(axis=0).any()
assert folding.energy_error() < 1e-8

figure = plt.figure(figsize=(10, 3.6), layout="constrained")
for k, moment in enumerate((0, 60, 125, 180), start=1):
    axes = figure.add_subplot(1, 4, k, projection="3d")
    hinges = np.vstack([folding.frames[moment, :, :3], [0, 0, 1]])
    # The n-frame has y upward; the picture has z upward.
    axes.plot(hinges[:, 0], -hinges[:, 2], hinges[:, 1], "o-", color="C0", markersize=4)
    axes.plot([0, 0], [0, -1], [0, 0], color="0.6", linewidth=3)
    axes.set(title=f"t = {folding.t[moment]:.1f} s", xlim=(-1, 1), ylim=(-1.5, 0.5), zlim=(-1.5, 0.5), aspect="equal")
    axes.tick_params(labelbottom=False, labelleft=False, labelright=False)
plt.show()

# %% [markdown]
# ## 8. Through singular positions
#
# Three uprights on the ground with two bars across them: two windows. Where the uprights lie flat, all bars are in one line,
# constraints depend on each other, and the windows could fold into another shape. The right-hand side must give accelerations
# there, too.

# %%
windows = sd.systems.n_four_bar(n=2)
module = windows.augmented().compile()
flat = [np.pi / 2] * 3 + [-np.pi / 2] * 2
print(f"independent constraints: {module.rank(np.zeros(5))} upright, {module.rank(flat)} flat")
print("multipliers that are unique when flat:", module.unique(flat))

# %% [markdown]
# While the windows stay parallelograms, the motion is that of one angle, $\ddot\theta = \frac{7 g}{6 l} \sin\theta$. A
# tree with one coordinate has this motion without any constraint; it is the reference. All uprights turn right round, again and
# again through the flat positions.

# %%
falling = module.simulate((0, 20), rtol=1e-11)
angle = sd.coordinates("angle")
single = sd.embedding([angle], [angle], mass=[1], force=[sp.Rational(7, 6) * g * sp.sin(angle)], name="single",
                      defaults={g: 9.81}).compile().simulate(falling.t, u=[1.0], rtol=1e-12)

J = module.evaluate("C_r", falling.t, falling.x)
smallest = np.linalg.svd(J, compute_uv=False)[:, -1]
figure, (top, bottom) = plt.subplots(2, 1, figsize=(8, 4.6), sharex=True, layout="constrained")
top.plot(falling.t, falling["theta0"] / (2 * np.pi), color="C0", label="two windows")
top.plot(single.t[::40], single[angle][::40] / (2 * np.pi), ".", color="C1", label="one angle")
top.set(ylabel="turns of the uprights")
top.legend()
bottom.semilogy(falling.t, smallest, color="C2")
bottom.set(ylabel="smallest singular value", xlabel="t [s]")
for axes in (top, bottom):
    axes.grid(color="0.9")
plt.show()

difference = np.abs(falling["theta0"] - single[angle]).max()
print(f"angle less that of the reference: {difference:.1e} rad after {falling['theta0'][-1] / (2 * np.pi):.1f} turns")
print(f"uprights apart: {np.ptp(falling.q[:, :3], axis=1).max():.1e} rad, energy error {falling.energy_error():.1e}")
assert difference < 1e-5

# %% [markdown]
# The motion continues straight through these positions, by its inertia. A mechanism that comes to rest exactly there could
# continue either way, and multipliers are not unique. `diagnose` reports such positions beforehand.

# %% [markdown]
# ## 9. What to read next
#
# - `vehicle_on_rotating_track`: the embedding technique step by step, with constraints solved by hand.
# - `a_new_mechanism`: from a description of your own to C.
# - [Describing mechanisms](../docs/describing_mechanisms.md): joints and loads; [constraints](../docs/constraints.md):
#   stabilization, conventions of signs and tolerances.
#
# On the command line, `symdyn list` shows the catalogue, with loops and constraints of all kinds: rods, ball joints, rolling
# without slip.
