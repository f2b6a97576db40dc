"""Equations of every mechanism in notebooks are no wider than a page, and what stands on it is right."""

import re

import numpy as np
import pytest
import sympy as sp

import symdyn as sd
from symdyn.report.latex import letters
from symdyn.report.notebook import LINES, WIDTH, _height, _matrix, velocity_product
from tests.helpers import swept

# One line of matrices, quantity by quantity, in named intermediates, link by link.
PAGES = {"pendulum": "", "cart_pole": "", "slider_crank": r"\mathbf{C}_{\mathbf{r}} =", "three_link_arm": r"\tilde{M}_{11} =",
         "n_link_pendulum": "h_{1} =", "puma560": "p_{40} =", "bricard": "p_{40} =", "spatial_chain": r"{\bf\text{link 7: ",
         "floating_wind_turbine": r"{\bf\text{link 3: hub}} \text{ on } \text{link } 2 \text{ by shaft}"}

EACH_KIND = "pendulum", "slider_crank", "three_link_arm", "puma560", "spatial_chain"


def page(name: str) -> str:
    system = sd.systems.get(name)
    eq = system.augmented() if name in sd.systems.names(constrained=True) else system.embedding()
    return eq._repr_latex_()


@pytest.mark.parametrize(("name", "part"), swept(PAGES.items(), *((name, PAGES[name]) for name in EACH_KIND)))
def test_equations_never_a_size(name, part):
    text = page(name)
    assert text.startswith(r"$\displaystyle ") and text.endswith("$") and "operations" not in text
    assert text.count("{") == text.count("}") and text.count(r"\left[") == text.count(r"\right]")
    assert r"\begin{aligned}" in text if part else r"\ddot" in text
    assert part in text
    # MathJax 2 expands no macros where more than 5 kB follow; arguments in braces are read alone.
    assert "bigl" not in text
    macros = re.finditer(r"\\(mathbf|textbf|mathrm)\b", text)
    assert all(text[m.start() - 1] == "{" or len(text) - m.start() < 5000 for m in macros)


@pytest.mark.parametrize("name", ["three_link_arm", "puma560", "double_wishbone", *swept(["two_link_arm", "four_bar"])])
def test_no_wider_than_a_page_and_no_longer_than_two(name):
    lines = [line.removesuffix(r" \\[2pt]") for line in page(name).split("\n")[1:-1]]
    assert _height(lines) <= LINES
    for line in lines:
        if "matrix" not in line:
            assert letters(line.removeprefix("&")) <= WIDTH + 8, line


def test_equations_by_hand_have_pages():
    q, w = sd.coordinates("q w")
    m, c = sd.parameters("m c")
    J = sp.Matrix([sp.Mul(*[sp.sin(k * q) + sp.cos(w) for k in range(1, 5)]), c * sp.cos(q * w)])
    text = sd.embedding([q, w], [J[0], J[1]], [m, m], [0, -c])._repr_latex_()
    assert r"\tilde{\mathbf{M}}" in text and "operations" not in text


def test_the_recursion_is_that_of_the_equations():
    """Printed formulas of a page, evaluated: S^T f of the recursion is M u_dot + k - F."""
    x = sd.coordinates("x y z psi theta phi")
    q = sd.coordinates("q")
    m, a = sd.parameters("m a")
    system = sd.System("two", gravity=[0.3, -2, -9.81])
    one = system.add_body("one", mass=m, inertia=[0.3, 0.4, 0.5], com=[a, 0.2, 0.1])
    two = system.add_body("two", mass=2, inertia=[0.2, 0.1, 0.25], com=[0.1, a, 0.3])
    system.add_joint(sd.Free("free", system.ground, one, x, sd.EulerAngles("ZYX", "body")))
    system.add_joint(sd.Revolute("pin", one, two, q, axis=[0, 1, 0], parent_point=[0.5, a, 0]))
    eq = system.embedding()
    tree = eq.provenance.of.tree
    rng = np.random.default_rng(3)
    s = eq.symbols
    given = [*s.coordinates, *s.speeds, *eq.accelerations, *s.parameters]
    numbers = rng.uniform(0.2, 0.9, len(given))
    value = dict(zip(given, numbers, strict=True))

    def taken(part):
        matrix = _matrix(eq, part)
        return np.array(matrix.subs(value).evalf().tolist(), dtype=float)

    def skew(r):
        return np.array([[0, -r[2], r[1]], [r[2], 0, -r[0]], [-r[1], r[0], 0]])

    def cross(v):
        return np.block([[skew(v[:3]), np.zeros((3, 3))], [skew(v[3:]), skew(v[:3])]])

    count = len(tree.links)
    v, acc, X, S, force = ([None] * count for _ in range(5))
    w_dot = np.array([float(eq.accelerations[k].subs(value)) for k in range(len(eq.accelerations))])
    for k, link in enumerate(tree.links):
        R, r, h = taken(link.R), taken(link.r)[:, 0], taken(link.inertia.h)[:, 0]
        X[k] = np.block([[R.T, np.zeros((3, 3))], [-R.T @ skew(r), R.T]])
        S[k], w = taken(link.S), taken([tree.w[i] for i in link.speeds])[:, 0]
        I = np.block([[taken(link.inertia.I), skew(h)], [-skew(h), taken([link.inertia.m])[0, 0] * np.eye(3)]])
        before = (np.zeros(6), np.array([0, 0, 0, -0.3, 2, 9.81])) if link.parent < 0 else (v[link.parent], acc[link.parent])
        v[k] = X[k] @ before[0] + S[k] @ w
        c = taken(velocity_product(tree, link))[:, 0]
        acc[k] = X[k] @ before[1] + S[k] @ w_dot[list(link.speeds)] + c + cross(v[k]) @ S[k] @ w
        force[k] = I @ acc[k] - cross(v[k]).T @ I @ v[k]
    tau = np.zeros(len(w_dot))
    for k in reversed(range(count)):
        tau[list(tree.links[k].speeds)] = S[k].T @ force[k]
        if tree.links[k].parent >= 0:
            force[tree.links[k].parent] += X[k].T @ force[k]
    n = [len(s.coordinates), len(s.speeds), len(eq.accelerations)]
    parts = np.split(numbers, np.cumsum(n))
    wanted = eq.lambdify("inverse_dynamics")(parts[0], parts[1], parts[3], ud=parts[2])
    np.testing.assert_allclose(tau, np.ravel(wanted), rtol=1e-9)
