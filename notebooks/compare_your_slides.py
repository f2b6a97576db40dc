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
# # Slides of your own, compared with what symdyn derives
#
# A case holds formulas as a slide prints them, and what symdyn derives for them. Every entry gets a verdict: equal, equal up
# to a named convention, wrong (with a proof), unreadable, or, until it has been examined, different.

# %%
import matplotlib.pyplot as plt
import numpy as np
import sympy as sp
from IPython.display import display
from scipy.integrate import solve_ivp
from sympy import cos, sin

import symdyn as sd
from symdyn import conventions, proofs

# %% [markdown]
# ## 1. A few lines
#
# The short form takes the names of quantities, and the equations they are attributes of. Here a lecture's pendulum, whose last
# formula has lost a sign:

# %%
q = sd.coordinates("q")
m, l, g = sd.parameters("m l g", positive=True)
r = sp.Matrix([l * sin(q), -l * cos(q)])
eq = sd.embedding([q], r, mass=[m, m], force=[0, -m * g])

sd.compare(sd.Case("pendulum", printed={
    "J": [[l * cos(q)], [l * sin(q)]],
    "M_tilde": [[m * l**2 * (sin(q) ** 2 + cos(q) ** 2)]],
    "F_tilde": [m * g * l * sin(q)],
}, derived=eq))

# %% [markdown]
# An entry is equal if it is the same after renaming, or if exact algebra shows that the difference is zero: that is a proof.
# One state where the values differ refutes it; the text form reports the state. Where there is neither, because numbers are
# decimals or functions have relations that are not known, values are sampled at random points of many sizes with 50 digits: the
# verdict is then "equal, sampled", with the reason.

# %% [markdown]
# ## 2. Places, other letters, states
#
# With `Formula` each print gets its place, its typesetting, and what it needs to be compared:
#
# * `slide` of the case, `line` (or page) of the formula, `also` for repetitions;
# * `renamed`: the slide's letters; symbols with the same name are the same anyway, whatever their assumptions;
# * `where`: what holds on the states the formula is meant for, such as the norm of Euler parameters;
# * `decimals`: numbers on the slide are rounded;
# * `derived` may be a function, so that nothing is derived before it is needed.
#
# Expressions, nested lists, matrices, equations (`sp.Eq`, which stay equal when terms change sides) and pairs of matrices (left
# and right side) can all be printed and derived.

# %%
theta, a, R = sp.symbols("theta a R")
p = sp.symbols("p0:4")
slide = sd.Slide("3.2", "The pendulum", 17)
sd.compare(sd.Case("letters", slide=slide, formulas=[
    sd.Formula("M_tilde", [[a * R**2]], eq.M_tilde, line=18, renamed={a: m, R: l}, latex=r"\tilde{M}"),
    sd.Formula("motion", sp.Eq(l * q.ddot + g * sin(q), 0), sp.Eq(l * q.ddot, -g * sin(q)), line=19),
    sd.Formula("R is orthogonal", sd.rotation.from_parameters(p).T * sd.rotation.from_parameters(p), sp.eye(3), line=20,
               where={p[0]: sp.sqrt(1 - p[1] ** 2 - p[2] ** 2 - p[3] ** 2)}),
    sd.Formula("period of 1 m", 2.01, 2 * sp.pi / sp.sqrt(sp.Rational(981, 100)), line=21, decimals=2),
]))

# %% [markdown]
# ## 3. Conventions
#
# A slide may count the other direction as positive, print the transposed rotation, put coordinates in another order, refer to
# another point, or multiply an equation by a factor. Such a convention is named, and has to make the derived formula *equal* to
# the print; no other difference is accepted.

# %%
psi = sd.coordinates("psi")
Rz = sd.rotation.about("Z", psi)
printed = sp.Matrix([[cos(psi), sin(psi), 0], [-sin(psi), cos(psi), 0], [0, 0, 1]])
sd.compare(sd.Case("conventions", formulas=[
    sd.Formula("R", printed, Rz, conventions=[conventions.transposed("the slide takes components from n to b")]),
    sd.Formula("motion", sp.Eq(m * l**2 * q.ddot, -m * g * l * sin(q)), sp.Eq(q.ddot, -g / l * sin(q)),
               conventions=[conventions.scaled(m * l**2, "the moment equation, times m l^2")]),
]))

# %% [markdown]
# ## 4. Errors, with a proof
#
# A difference between a print and a derived formula does not show which of them is right. An erratum therefore comes with a
# proof by something that does not use the formula. It is measured for both, the print and the right formula, and holds if
# the right one fulfils it and the print visibly does not. Here the sign of the weight's moment: with it the pendulum would
# gain energy.

# %%
energy = m * l**2 * q.dot**2 / 2 - m * g * l * cos(q)
velocity = sd.Formula(
    "v", [l * q.dot * cos(q), -l * q.dot * sin(q)], eq.J * sp.Matrix([q.dot]),
    errata=[sd.Erratum("The mass rises as it swings out.", proofs.numeric_derivative("It is the rate of the position.", of=r))])
motion = sd.Formula(
    "motion", sp.Eq(m * l**2 * q.ddot, m * g * l * sin(q)), sp.Eq((eq.M_tilde * q.ddot)[0], (eq.F_tilde - eq.k_tilde)[0]),
    errata=[sd.Erratum("The weight turns the pendulum back.", proofs.energy_balance("Energy is kept.", [q], energy))])
found = sd.compare(sd.Case("errors", slide=slide, formulas=[velocity, motion]))
display(found)

# %%
print(found)

# %% [markdown]
# The energy of a pendulum of 1 kg and 1 m that is released at 1 rad, by the slide's equation and by the right one:

# %%
numbers = {m: 1, l: 1, g: 9.81}
figure, axes = plt.subplots(figsize=(8, 3), layout="constrained")
for label, equation in (("the slide", motion.printed), ("right", motion.derived)):
    rate = sp.lambdify([q, q.dot], [q.dot, sp.solve(equation, q.ddot)[0].subs(numbers)])
    run = solve_ivp(lambda t, state, rate=rate: rate(*state), (0, 1.5), [1.0, 0.0], rtol=1e-10, atol=1e-10, dense_output=True)
    times = np.linspace(0, 1.5, 301)
    energies = sp.lambdify([q, q.dot], energy.subs(numbers))(*run.sol(times))
    axes.plot(times, energies, label=label)
    print(f"{label}: the energy changes by {np.ptp(energies):.1e} J")
axes.set(xlabel="t in s", ylabel="energy in J")
axes.legend()
plt.show()

# %% [markdown]
# The proofs there are:
#
# | `proofs.` | what the right formula fulfils |
# | --- | --- |
# | `numeric_derivative(sentence, of, order)` | it is the derivative of `of`, differentiated numerically along a random motion |
# | `energy_balance(sentence, coordinates, energy, equations, power)` | its accelerations keep the energy (or give `power`) |
# | `limit(sentence, at, value)` | with these values it becomes `value` |
# | `dimensions(sentence, units, unit)` | it has the right unit |
# | `other(sentence, value)` | another formulation gives the same |
# | `Proof(kind, sentence, residual)` | anything else that vanishes |
#
# An erratum whose proof does not hold leaves the entry *different*, and one about an entry that is right is rejected.

# %% [markdown]
# ## 5. Reports
#
# A file `my_slides.py` that ends in `CASES = [...]` can be compared on the command line; with `--output` it also writes a page
# with formulas that needs no network, a LaTeX document, and the errata:
#
#     symdyn compare my_slides.py --output report
#
# In Python the same files come from `sd.compare([...]).write("report")`, of one case from `sd.compare(case).write("report")`.
#
# The cases of the lecture are in `symdyn.lecture`; any of them may serve as a model.

# %%
sd.compare("pendulum-augmented")
