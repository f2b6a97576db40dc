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
# # A vehicle on a rotating track
#
# The embedding technique, step by step, in the order of the lecture, chapter 3.2. Three cases:
#
# 1. the track is straight and fixed,
# 2. the track turns about a hinge and has no mass,
# 3. the track turns and has mass and inertia.
#
# Each case is derived twice. First from a position map $\mathbf r(\mathbf q)$, where every intermediate matrix is printed.
# Then from bodies and joints, where nothing but the mechanism is described. Both must give the same equations.
#
# The $n$-frame has $x$ to the right and $y$ upward. Gravity $g$ points along $-y$.

# %%
import matplotlib.pyplot as plt
import numpy as np
import sympy as sp
from IPython.display import Math, display
from sympy import latex

import symdyn as sd

# %% [markdown]
# ## 1. The fixed straight track
#
# ### Position map
#
# The vehicle is a particle of mass $m$. The track falls at the angle $\theta$ below the horizontal; $\theta$ is constant.
# The generalized coordinate $q_1$ is the distance travelled down the track from the point $O_0 = (x_0, y_0)$. This one
# number says where the vehicle is, so the constraint is met for every $q_1$:
#
# $$\mathbf r(q_1) = \mathbf r_{O_0} + q_1 \begin{bmatrix} \cos\theta \\ -\sin\theta \end{bmatrix}$$

# %%
q1, q2 = sd.coordinates("q1 q2")
m, g, theta, x_0, y_0 = sd.parameters("m g theta x_0 y_0")

r = sp.Matrix([x_0 + q1 * sp.cos(theta), y_0 - q1 * sp.sin(theta)])
M = sp.diag(m, m)
F = sp.Matrix([0, -m * g])
display(Math(rf"\mathbf r = {latex(r)} \qquad \mathbf M = {latex(M)} \qquad \mathbf F = {latex(F)}"))

# %% [markdown]
# Newton's law for the particle is $\mathbf M \ddot{\mathbf r} = \mathbf F + \mathbf F_c$ with the known weight
# $\mathbf F$ and the unknown reaction $\mathbf F_c$ of the track. `sd.embedding` takes the coordinates, the position map,
# the masses and the known forces.

# %%
fixed = sd.embedding([q1], r, M, F, name="vehicle_on_track")

# %% [markdown]
# ### Velocity transformation
#
# $\dot{\mathbf r} = \mathbf J \dot q_1$ with $\mathbf J = \partial \mathbf r / \partial q_1$: the unit vector along the track.

# %%
display(Math(rf"\mathbf J = {latex(fixed.J)}"))
assert r.jacobian([q1]) == fixed.J

# %% [markdown]
# ### Acceleration
#
# $\ddot{\mathbf r} = \mathbf J \ddot q_1 + \dot{\mathbf J} \dot q_1$. The direction of the track does not change, so
# $\dot{\mathbf J} = 0$.

# %%
acceleration = fixed.J * fixed.accelerations + fixed.Jd_qd
display(Math(rf"\dot{{\mathbf J}} = {latex(fixed.Jdot)} \qquad \ddot{{\mathbf r}} = {latex(acceleration)}"))

# %% [markdown]
# ### Equation of motion
#
# A frictionless track pushes at right angles to itself: $\mathbf J^T \mathbf F_c = 0$. Multiplying Newton's law by
# $\mathbf J^T$ therefore removes the reaction:
#
# $$\underbrace{\mathbf J^T \mathbf M \mathbf J}_{\tilde{\mathbf M}} \ddot{\mathbf q} +
# \underbrace{\mathbf J^T \mathbf M \dot{\mathbf J} \dot{\mathbf q}}_{\tilde{\mathbf k}} =
# \underbrace{\mathbf J^T \mathbf F}_{\tilde{\mathbf F}}$$

# %%
display(Math(rf"\tilde{{\mathbf M}} = {latex(fixed.M_tilde)} \qquad "
             rf"\tilde{{\mathbf k}} = {latex(fixed.k_tilde)} \qquad "
             rf"\tilde{{\mathbf F}} = {latex(fixed.F_tilde)}"))

# %% [markdown]
# Here it is one equation, and the mass drops out of it: $\ddot q_1 = g \sin\theta$.

# %%
display(*fixed.equations)
assert fixed.explicit("accelerations") == sp.Matrix([g * sp.sin(theta)])

# %% [markdown]
# ### Reaction
#
# Once the acceleration is known, the reaction follows from $\mathbf F_c = \mathbf M \ddot{\mathbf r} - \mathbf F$. It has
# the magnitude $m g \cos\theta$ and stands at right angles to the track.

# %%
display(Math(rf"\mathbf F_c = {latex(fixed.F_c)}"))
assert fixed.F_c.equals(m * g * sp.cos(theta) * sp.Matrix([sp.sin(theta), sp.cos(theta)]))
assert (fixed.J.T * fixed.F_c).applyfunc(sp.simplify).is_zero_matrix

# %% [markdown]
# ### The same from a body and a joint
#
# The catalogue describes this mechanism as a body on a prismatic joint. The symbols bear the same names, so the results can
# be subtracted.

# %%
bodies = sd.systems.vehicle_on_track().embedding()
display(bodies)
assert (bodies.M_tilde - fixed.M_tilde).applyfunc(sp.simplify).is_zero_matrix
assert (bodies.k_tilde - fixed.k_tilde).applyfunc(sp.simplify).is_zero_matrix
assert (bodies.F_tilde - fixed.F_tilde).applyfunc(sp.simplify).is_zero_matrix

# %% [markdown]
# ## 2. The track turns about a hinge
#
# ### Position map
#
# Now the inclination is a coordinate too. It is named $q_2$ and counts clockwise from the $x$ axis, as $\theta$ did. The
# hinge is at $O_0$, and $q_1$ is the distance of the vehicle from it. The track has no mass yet.

# %%
r = sp.Matrix([x_0 + q1 * sp.cos(q2), y_0 - q1 * sp.sin(q2)])
turning = sd.embedding([q1, q2], r, M, F, name="vehicle_on_massless_track")
display(Math(rf"\mathbf r = {latex(r)}"))

# %% [markdown]
# ### Velocity transformation and its derivative
#
# $\mathbf J$ has one column for each coordinate. It depends on $\mathbf q$, so $\dot{\mathbf J}$ does not vanish.

# %%
display(Math(rf"\mathbf J = {latex(turning.J)}"))
display(Math(rf"\dot{{\mathbf J}} = {latex(turning.Jdot)}"))

# %% [markdown]
# ### Acceleration
#
# $\ddot{\mathbf r} = \mathbf J \ddot{\mathbf q} + \dot{\mathbf J} \dot{\mathbf q}$. The second part is what remains when
# $\ddot{\mathbf q} = 0$: the centripetal and the Coriolis acceleration.

# %%
display(Math(rf"\dot{{\mathbf J}} \dot{{\mathbf q}} = {latex(turning.Jd_qd)}"))
rates = sp.Matrix([q1.dot, q2.dot])
assert (turning.Jdot * rates - turning.Jd_qd).applyfunc(sp.simplify).is_zero_matrix

# %% [markdown]
# ### Mass matrix
#
# $\tilde{\mathbf M} = \mathbf J^T \mathbf M \mathbf J$, first multiplied out, then with $\sin^2 + \cos^2 = 1$. The
# columns of $\mathbf J$ are at right angles to each other, so the matrix is diagonal. Its second entry is the moment of
# inertia of the particle about the hinge. It vanishes at $q_1 = 0$, where $q_2$ does not move the vehicle at all.

# %%
product = turning.J.T * M * turning.J
display(Math(rf"\tilde{{\mathbf M}} = {latex(product)} = {latex(turning.M_tilde)}"))
assert turning.M_tilde == sp.diag(m, m * q1**2)

# %% [markdown]
# ### Centrifugal and Coriolis terms
#
# $\tilde{\mathbf k} = \mathbf J^T \mathbf M \dot{\mathbf J} \dot{\mathbf q}$.

# %%
display(Math(rf"\tilde{{\mathbf k}} = {latex(turning.k_tilde)}"))
assert turning.k_tilde.equals(sp.Matrix([-m * q1 * q2.dot**2, 2 * m * q1 * q1.dot * q2.dot]))

# %% [markdown]
# ### Generalized force
#
# $\tilde{\mathbf F} = \mathbf J^T \mathbf F$: the weight along the track, and the moment of the weight about the hinge.

# %%
display(Math(rf"\tilde{{\mathbf F}} = {latex(turning.F_tilde)}"))
assert turning.F_tilde.equals(sp.Matrix([m * g * sp.sin(q2), m * g * q1 * sp.cos(q2)]))

# %% [markdown]
# ### Equations of motion

# %%
display(*turning.equations)

# %% [markdown]
# ### Reaction
#
# It is zero. Two coordinates can place the vehicle anywhere in the plane, so nothing is constrained any more: a track
# without mass, free to turn, cannot push sideways. $q_1$ and $q_2$ are polar coordinates of a particle that flies freely.
# Section 4 comes back to this.

# %%
display(Math(rf"\mathbf F_c = {latex(turning.F_c)}"))
assert turning.F_c.is_zero_matrix

# %% [markdown]
# ### The same from bodies and joints
#
# A revolute joint carries the track, a prismatic joint on the track carries the vehicle. A planar body has three rows in
# $\mathbf J$: $v_x$, $v_y$ and $\omega$. The first two rows are those of the vehicle's centre of mass.

# %%
bodies = sd.systems.vehicle_on_rotating_track(track_inertia=False).embedding()
display(bodies)
assert bodies.J[:2, :] == turning.J
assert (bodies.M_tilde - turning.M_tilde).applyfunc(sp.simplify).is_zero_matrix
assert (bodies.k_tilde - turning.k_tilde).applyfunc(sp.simplify).is_zero_matrix
assert (bodies.F_tilde - turning.F_tilde).applyfunc(sp.simplify).is_zero_matrix

# %% [markdown]
# ## 3. Vehicle and track with inertia
#
# ### Position map
#
# The track has the mass $m_t$, centred at the hinge, and the moment of inertia $I_t$. Its motion belongs to the position map
# now: the centre, which rests, and the orientation. In this case the lecture lets $q_2$ count counterclockwise and puts the
# vehicle on the other side of the hinge:
#
# $$\mathbf r = \begin{bmatrix} x \\ y \\ x_0 \\ y_0 \\ \theta \end{bmatrix}, \qquad
# \mathbf M = \operatorname{diag}(m_v, m_v, m_t, m_t, I_t)$$

# %%
m_v, m_t, I_t = sd.parameters("m_v m_t I_t")
r = sp.Matrix([x_0 - q1 * sp.cos(q2), y_0 - q1 * sp.sin(q2), x_0, y_0, q2])
M = sp.diag(m_v, m_v, m_t, m_t, I_t)
F = sp.Matrix([0, -m_v * g, 0, -m_t * g, 0])
both = sd.embedding([q1, q2], r, M, F, name="vehicle_and_track")
display(Math(rf"\mathbf r = {latex(r)} \qquad \mathbf F = {latex(F)}"))

# %% [markdown]
# ### Velocity transformation and its derivative
#
# Five velocities follow from two rates. The rows of the hinge are zero, the row of the orientation is $\dot q_2$.

# %%
display(Math(rf"\mathbf J = {latex(both.J)}"))
display(Math(rf"\dot{{\mathbf J}} = {latex(both.Jdot)}"))

# %% [markdown]
# ### Embedded equations
#
# The inertia of the track adds to the second diagonal entry. $\tilde{\mathbf M}$ stays regular where the vehicle passes
# the hinge. The mass $m_t$ does not appear: the centre of the track never moves, and its weight does no work.

# %%
display(Math(rf"\tilde{{\mathbf M}} = {latex(both.M_tilde)} \qquad "
             rf"\tilde{{\mathbf k}} = {latex(both.k_tilde)} \qquad "
             rf"\tilde{{\mathbf F}} = {latex(both.F_tilde)}"))
assert both.M_tilde == sp.diag(m_v, m_v * q1**2 + I_t)

# %%
display(*both.equations)

# %% [markdown]
# ### Reactions
#
# Rows 1 and 2 are the force of the track on the vehicle. It is at right angles to the track and vanishes with $I_t$. Rows 3
# and 4 are the sum of all reactions on the track: they carry its weight. The last row is the moment of the vehicle's
# push about the hinge.

# %%
display(Math(rf"\mathbf F_c = {latex(both.F_c)}"))
assert (both.J.T * both.F_c).applyfunc(sp.simplify).is_zero_matrix

# %% [markdown]
# ### The same from bodies and joints
#
# The vehicle turns with the track, which gives it an orientation but, being a particle, no inertia. Leaving its $\omega$ out
# of $\mathbf J$, rows 1, 2 and 4 to 6 are the five rows above.

# %%
system = sd.systems.vehicle_on_rotating_track()
bodies = system.embedding()
display(bodies)
assert bodies.J.extract([0, 1, 3, 4, 5], [0, 1]) == both.J
assert (bodies.M_tilde - both.M_tilde).applyfunc(sp.simplify).is_zero_matrix
assert (bodies.k_tilde - both.k_tilde).applyfunc(sp.simplify).is_zero_matrix
assert (bodies.F_tilde - both.F_tilde).applyfunc(sp.simplify).is_zero_matrix

# %% [markdown]
# ## 4. The motion
#
# The equations become a compiled module. An output gives the place of the vehicle. At the start the vehicle is 1 m from the
# hinge, up to the left, and the track turns clockwise at 4 rad/s.

# %%
system.add_output("vehicle", sd.position("vehicle"))
module = system.embedding().compile()
start = {"t": (0, 1.2), "q": {q1: 1.0, q2: -0.4}, "u": {q1.dot: 0.0, q2.dot: -4.0}}
motion = module.simulate(**start)
motion.plot()

# %% [markdown]
# No load but gravity acts, and the constraints do no work. The sum of kinetic and potential energy must stay as it is; what
# it changes by, relative to the energy that is exchanged, is the error of the integrator.

# %%
print(f"relative change of the energy: {motion.energy_error():.1e}")
assert motion.energy_error() < 1e-7

# %% [markdown]
# ### What the inertia of the track does
#
# The same start for three tracks. The greater the inertia of the track, the less the vehicle slows it down, and the
# further the vehicle is thrown.

# %%
figure, axes = plt.subplots(figsize=(6, 5), layout="constrained")
for inertia in (0.0, 0.5, 5.0):
    path = module.simulate(**start, params={I_t: inertia}).outputs["vehicle"]
    axes.plot(*path.T, label=f"$I_t$ = {inertia:g} kg m$^2$")
axes.plot(0, 0, "^", color="0.3", label="hinge")
axes.set(xlabel="x [m]", ylabel="y [m]", aspect="equal", title="path of the vehicle")
axes.grid(color="0.9")
axes.legend()
plt.show()

# %% [markdown]
# Without inertia the path is the parabola of a thrown stone, as the vanishing reaction of section 2 showed. It agrees
# to the tolerance of the integrator.

# %%
free = module.simulate(**start, params={I_t: 0.0})
place, velocity = -np.array([np.cos(-0.4), np.sin(-0.4)]), -4.0 * np.array([np.sin(-0.4), -np.cos(-0.4)])
t = free.t[:, None]
parabola = place + velocity * t + np.array([0, -9.81]) * t**2 / 2
print(f"largest distance from the parabola: {np.abs(free.outputs['vehicle'] - parabola).max():.1e} m")
assert np.allclose(free.outputs["vehicle"], parabola, atol=1e-6)
