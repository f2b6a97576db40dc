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
# # Forces and accelerations from link to link
#
# The lecture's chapter 5 next to its slides: bodies that slide on each other, an arm of two links by Newton and Euler, and the
# same in spatial vectors. The notebook `recursive_formulation` shows how the recursion is used; this one shows what the slides'
# errors do, and ends with every formula of the chapter.

# %%
import matplotlib.pyplot as plt
import numpy as np
import sympy as sp
from IPython.display import Math, display
from sympy import latex

import symdyn as sd
from symdyn.lecture import cases


def show(name, value):
    display(Math(rf"{name} = {latex(value)}"))


# %% [markdown]
# ## 1. Bodies that slide on each other
#
# Three bodies on a line, each sliding on the one before. Outwards go the accelerations, $\ddot x_n = \ddot x_{n-1} + \ddot q_n$;
# inwards go the forces, $F_n = m_n \ddot x_n + F_{n+1}$.

# %%
chain = sd.systems.prismatic_chain(3).recursive()
show(r"\begin{bmatrix} \ddot x_1 \\ \ddot x_2 \\ \ddot x_3 \end{bmatrix}", sp.Matrix([chain.link(k).a[3] for k in (1, 2, 3)]))
show(r"\begin{bmatrix} F_1 \\ F_2 \\ F_3 \end{bmatrix}", sp.Matrix([chain.link(k).f[3] for k in (1, 2, 3)]))

# %% [markdown]
# The other way, from forces to accelerations, no matrix is needed either:

# %%
show(r"\ddot{\mathbf q}", chain.explicit("accelerations"))

# %% [markdown]
# So the number of operations grows like $n$. With the mass matrix twice as many bodies take four times as many, even though
# this matrix has many equal entries; factorizing one without such structure takes a number that grows like $n^3$.

# %%
print(f"{'n':>3}{'recursion':>12}{'mass matrix':>13}")
for n_bodies in (2, 4, 8, 16, 32):
    bodies = sd.systems.prismatic_chain(n_bodies)
    counts = [equations.tape("accelerations").operations for equations in (bodies.recursive(), bodies.embedding())]
    print(f"{n_bodies:3}{counts[0]:12}{counts[1]:13}")

# %% [markdown]
# ## 2. The arm of two links, as the summary of chapter 5.5 has it
#
# Two of the errors of that summary change the torques. It turns link 2 with $\boldsymbol\omega_{b_2/b_1}$ where
# $\boldsymbol\omega_{b_2/n}$ belongs, and its $\tau_2 = M_{G_2}$ lacks the moment $\mathbf r_{G_2/O_2} \times \mathbf F_{G_2}$.
# Here is the whole calculation with frames, once as it should be and once as printed.

# %%
q1, q2 = sd.coordinates("q1 q2")
m1, m2, I1, I2, lc1, l1, lc2 = sd.parameters("m1 m2 I1 I2 lc1 l1 lc2")
n = sd.Frame("n")
b1 = n.frame("b1", rotation=sd.rotation.about("Z", q1))
b2 = b1.frame("b2", rotation=sd.rotation.about("Z", q2), origin=[l1, 0, 0])
G1, G2, O2 = b1.point("G1", [lc1, 0, 0]), b2.point("G2", [lc2, 0, 0]), b2.point("O2")
r_G1, r_O2 = G1.position(n), O2.position(n)
r_G2 = G2.position(n) - r_O2


def torques(omega_2, lever):
    """tau_1 and tau_2 with this angular velocity of link 2, and with or without r_G2/O2 x F_G2."""
    a_G2 = O2.acceleration(n) + sd.rate(omega_2).cross(r_G2) + omega_2.cross(omega_2.cross(r_G2))
    F_G1, F_G2 = m1 * G1.acceleration(n), m2 * a_G2
    M_G1, M_G2 = I1 * b1.angular_acceleration(n), I2 * b2.angular_acceleration(n)
    tau_2 = M_G2 + r_G2.cross(F_G2) if lever else M_G2
    tau_1 = M_G1 + r_G1.cross(F_G1) + tau_2 + r_O2.cross(F_G2)
    return sp.Matrix([tau_1[2], tau_2[2]])


right = torques(b2.angular_velocity(n), lever=True)
printed = torques(b2.angular_velocity(b1, components=n), lever=False)

# %% [markdown]
# The recursion, without weight and motors, gives the first and not the second:

# %%
arm = sd.systems.two_link_arm()
recursion = arm.recursive()
loads = [sd.parameters("g"), *sd.inputs("tau1 tau2")]
derived = {"tau": recursion.explicit("inverse_dynamics", simplify=False).subs(dict.fromkeys(loads, 0))}
print(sd.compare(sd.Case("right", printed={"tau": right}, derived=derived)))
print(sd.compare(sd.Case("summary", printed={"tau": printed}, derived=derived)))

# %% [markdown]
# Both along a swing of shoulder and elbow, in numbers. At the elbow the printed torque is far too small, and at the shoulder it
# is wrong by up to 4 N m.

# %%
motion = {q1: 0.8 * sp.sin(4 * sd.t), q2: 0.6 + 0.9 * sp.sin(6 * sd.t)}
along = {s: e for q, e in motion.items() for s, e in ((q, e), (q.dot, e.diff(sd.t)), (q.ddot, e.diff(sd.t, 2)))}
numbers = {symbol: value for symbol, value in arm.defaults.items() if symbol.name != "g"}
t = np.linspace(0, 2, 401)

figure, axes = plt.subplots(2, 1, figsize=(8, 5), sharex=True, layout="constrained")
for k, (axis, joint) in enumerate(zip(axes, ("shoulder", "elbow"), strict=True)):
    curves = [sp.lambdify(sd.t, formula[k].subs(numbers).subs(along))(t) for formula in (right, printed)]
    axis.plot(t, curves[0], "C0", label="right")
    axis.plot(t, curves[1], "C3--", label="as printed in the summary")
    difference, largest = np.abs(curves[1] - curves[0]).max(), np.abs(curves[0]).max()
    print(f"{joint}: largest torque {largest:.1f} N m, off by up to {difference:.1f} N m")
    axis.set(ylabel="torque [N m]", title=joint)
    axis.grid(color="0.9")
figure.legend(*axes[0].get_legend_handles_labels(), loc="outside lower center", ncols=2)
axes[1].set(xlabel="t [s]")
plt.show()

# %% [markdown]
# ## 3. A rate of components is no acceleration
#
# Chapter 5.6 differentiates components. Its $\dot{\mathbf v}_{O_2/E}$, in axes that turn with link 2, is not the acceleration of
# $O_2$; the slides add $\boldsymbol\omega \times \mathbf v$ only where they come to the force.

# %%
link2 = recursion.link(2)
rate = link2.a[3:, :].subs(dict.fromkeys(loads, 0))
acceleration = b2.acceleration(n, components=b2)
show(r"{}^{b_2}\dot{\mathbf v}_{O_2/E}", rate)
show(r"{}^{b_2}\mathbf a_{O_2/E}", sp.simplify(acceleration))
omega_x_v = link2.v[:3, :].cross(link2.v[3:, :])
assert sp.simplify(acceleration - rate - omega_x_v).is_zero_matrix

# %% [markdown]
# ## 4. What the plane hides
#
# The slides draw an arm in the plane and write vectors of space. In the plane all angular velocities are parallel and many
# products vanish, so that a lost sign does no harm there. The formulas of 5.6 are therefore compared on an arm whose base turns
# and rises. In one of the prints of $\dot{\boldsymbol\omega}_{b_2/n}$ a minus is lost. This is the print less the right form; it
# vanishes when the base stands still, $\dot q_a = 0$, and then the arm moves in a plane, as in the drawing.

# %%
angular = sd.compare("spatial-angular-acceleration")
wrong, error = angular.errata[0]
typed = next(f for case in cases() if case.name == angular.name for f in case.taken() if f.name == wrong.name)
letters = {str(letter): meaning for letter, meaning in typed.renamed.items()}
in_letters = sp.Matrix([e.printed for e in wrong.entries])
as_meant = in_letters.xreplace({s: letters[s.name] for s in in_letters.free_symbols if s.name in letters})
too_much = (as_meant - sp.Matrix([e.right for e in wrong.entries])).applyfunc(sp.simplify)
show(r"\Delta {}^{b_2}\dot{\boldsymbol\omega}_{b_2/n}", too_much)
print(f"line {wrong.slide.line}: {error.why}")
print(error.evidence)

# %% [markdown]
# ## 5. A lost minus in X
#
# One slide prints $\mathbf X$ with $+\mathbf R\, [\mathbf r \times]$ in its lower left block, where the line above has a minus.
# The right $\mathbf X$ leaves the power of a force as it is, whatever axes it is taken in, so that $\mathbf X^* = \mathbf X^T$
# moves forces: a force at $O_2$ that has no moment there has one about $O_1$. With the wrong sign it turns the other way.

# %%
X = link2.X
misprinted = X.copy()
misprinted[3:, :3] = -X[3:, :3]
push = sp.Matrix([0, 0, 0, *sp.symbols("F_x F_y"), 0])
show(r"M_{O_1}\text{, right}", sp.factor((X.T * push)[2]))
show(r"M_{O_1}\text{, as printed}", sp.factor((misprinted.T * push)[2]))

# %% [markdown]
# ## 6. The chapter compared with its slides
#
# Every derivation of chapters 5.1 to 5.8, entry by entry. An entry is called wrong only where an independent proof shows it:
# numeric differentiation, Lagrange's equation, a limit, units.

# %%
chapter = sd.compare("5")
display(chapter)
assert chapter.decided

# %% [markdown]
# The errors and their places:

# %%
for case in chapter:
    for formula, error in case.errata:
        lines = ", ".join(map(str, (formula.slide.line, *formula.also)))
        print(f"{formula.slide.section}, line {lines}: {formula.name}. {error.why}")
