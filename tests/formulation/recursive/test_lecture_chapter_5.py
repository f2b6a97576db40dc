"""The examples of the lecture's chapters 5 and 6.4, typed from the slides, compared with the recursions.

Slides are named by chapter and title. Where a slide is wrong, what it prints stands in a comment and the right result in
the test.
"""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np
import pytest
import sympy as sp

import symdyn as sd
from symdyn import systems
from symdyn.formulation.textbook.forward_dynamics import forward_dynamics
from symdyn.formulation.textbook.inverse_dynamics import inverse_dynamics
from symdyn.formulation.textbook.numbers import NumericTree
from symdyn.formulation.textbook.page import Page
from symdyn.formulation.textbook.velocities import velocities
from symdyn.model.symbols import symbols_of
from symdyn.tape.sympy_bridge import expand
from symdyn.tape.tape import Output
from tests.formulation.recursive.test_page import page_of
from tests.formulation.recursive.trees import check, random_vector


@lru_cache
def page(name: str, **options: Any) -> Page:
    return page_of(systems.get(name, **options).check())


def printed(page: Page, value: Any) -> sp.Matrix:
    """A quantity, by name or as recorded, in the user's symbols."""
    if isinstance(value, str):
        value = page.quantities()[value]()
    symbols = {leaf: symbol for symbol, leaf in page.tree.algebra.leaves.items() if getattr(leaf, "op", "") == "leaf"}
    return expand(Output.of("value", value), symbols)


def same(found: sp.Matrix, slide: Any) -> bool:
    difference = sp.Matrix(found) - sp.Matrix(slide)
    return all(sp.simplify(e) == 0 for e in difference)


def equal_in_numbers(found: sp.Matrix, slide: Any) -> bool:
    """Whether they agree to 35 digits at arbitrary numbers; for what takes long to simplify."""
    difference = sp.Matrix(found) - sp.Matrix(slide)
    values = {s: sp.Rational(k + 2, 7) for k, s in enumerate(sorted(symbols_of(difference), key=str))}
    return all(abs(sp.N(e.xreplace(values), 40)) < 1e-35 for e in difference)


def symbols(page: Page) -> dict[str, sp.Symbol]:
    return {s.name: s for s in page.tree.algebra.leaves}


# -- 5.1 to 5.4: bodies that slide on each other


@pytest.mark.parametrize("n", [2, 3])
def test_prismatic_chain_inverse_dynamics(n: int) -> None:
    """5.3, "Recursive Newton-Euler Formulation - Inverse Dynamics": x_n_ddot = x_(n-1)_ddot + q_n_ddot and
    F_n - F_(n+1) = m_n x_n_ddot; 5.2: the matrices for 2 and 3 joints."""
    p = page("prismatic_chain", n=n)
    s = symbols(p)
    q_ddot = [s[f"q{k + 1}_ddot"] for k in range(n)]
    x_ddot = [sum(q_ddot[:k + 1]) for k in range(n)]
    F, m = [0] * (n + 1), [s[f"m{k + 1}"] for k in range(n)]
    for k in reversed(range(n)):
        F[k] = m[k] * x_ddot[k] + F[k + 1]
        assert same(printed(p, f"a_{k + 1}"), [0, 0, 0, x_ddot[k], 0, 0])
        assert same(printed(p, f"f_{k + 1}")[3:, :], [F[k], 0, 0])
    masses = sp.Matrix(n, n, lambda i, j: sum(m[max(i, j):]))
    tau = sp.Matrix([printed(p, f"f_{k + 1}")[3] for k in range(n)])
    assert same(tau, masses * sp.Matrix(q_ddot))


def test_prismatic_chain_forward_dynamics() -> None:
    """5.4: x_n_ddot = (F_n - F_(n+1)) / m_n, q_n_ddot = x_n_ddot - x_(n-1)_ddot. (The slide starts from x_0 = 0 where it needs
    x_0_ddot = 0.)"""
    p = page("prismatic_chain", n=3)
    s = symbols(p)
    F, m = [s["F1"], s["F2"], s["F3"], 0], [s["m1"], s["m2"], s["m3"]]
    x_ddot = [0, *[(F[k] - F[k + 1]) / m[k] for k in range(3)]]
    assert same(printed(p, p.forward.u_dot), [x_ddot[k + 1] - x_ddot[k] for k in range(3)])


def test_prismatic_chain_articulated_inertia() -> None:
    """Along the line a body feels nothing of those that slide on it; across it carries them: I_A of link 1."""
    p = page("prismatic_chain", n=3)
    s = symbols(p)
    assert same(printed(p, "I_A_1")[3:, 3:], sp.diag(s["m1"], s["m1"] + s["m2"] + s["m3"], s["m1"] + s["m2"] + s["m3"]))


# -- 5.5 and 5.6: two links


def test_two_links_transforms() -> None:
    """5.6, "Velocity of b2-frame": b2_X_b1 = [[b2_R_b1, 0], [-b2_R_b1 (r_O2/O1 x), b2_R_b1]].

    The slide "Acceleration of b2-frame" prints the lower left block without its minus, twice; one line above it stands right.
    """
    p = page("two_link_arm")
    s = symbols(p)
    c, d, l1 = sp.cos(s["q2"]), sp.sin(s["q2"]), s["l1"]
    b2_R_b1 = sp.Matrix([[c, d, 0], [-d, c, 0], [0, 0, 1]])
    r = sp.Matrix([[0, 0, 0], [0, 0, -l1], [0, l1, 0]])
    X = sp.Matrix(sp.BlockMatrix([[b2_R_b1, sp.zeros(3)], [-b2_R_b1 * r, b2_R_b1]]))
    assert same(printed(p, "X_2"), X) and same(printed(p, "X_star_2"), X.T)
    assert same(printed(p, "S_2"), [0, 0, 1, 0, 0, 0]) and same(printed(p, "S_ring_2"), sp.zeros(6, 1))


def test_two_links_velocities_and_velocity_products() -> None:
    """5.6: v_2 = X v_1 + S q2_dot; "Acceleration of b2-frame": the last terms, (omega x k) q2_dot = 0 and (v_O2 x k) q2_dot."""
    p = page("two_link_arm")
    s = symbols(p)
    q2, l1, a, b = s["q2"], s["l1"], s["q1_dot"], s["q2_dot"]
    assert same(printed(p, "v_1"), [0, 0, a, 0, 0, 0])
    v_2 = [0, 0, a + b, l1 * a * sp.sin(q2), l1 * a * sp.cos(q2), 0]
    assert same(printed(p, "v_2"), v_2)
    assert same(printed(p, "c_2"), [0, 0, 0, *sp.Matrix(v_2[3:]).cross(sp.Matrix([0, 0, b]))])
    # 5.6, "Velocity of b_G2-frame": v_G2 = omega x r_G2/O2 + v_O2
    assert same(printed(p, "v_G_2"), [*v_2[:3], *(sp.Matrix(v_2[3:]) + sp.Matrix(v_2[:3]).cross(sp.Matrix([s["lc2"], 0, 0])))])


def test_two_links_torques() -> None:
    """5.5, the last slide: accelerations of O_2, G_1, G_2, resultants, and the torques; gravity 0 there.

    It prints omega and omega_dot of b2 relative to b1 in the acceleration of G_2, where those relative to n belong; theta for
    theta_dot in omega; and tau_2 = M_G2, where "Force and moment exerted on a rigid body, Link 2" has r_G2/O2 x F_G2 as well.
    """
    p = page("two_link_arm")
    s = symbols(p)
    (q1, q2), (a, b), (a_dot, b_dot) = [[s[f"q{k}{end}"] for k in (1, 2)] for end in ("", "_dot", "_ddot")]
    z = sp.Matrix([0, 0, 1])

    def along(angle: sp.Expr, length: sp.Expr) -> sp.Matrix:
        return sp.Matrix([length * sp.cos(angle), length * sp.sin(angle), 0])

    def acceleration(r: sp.Matrix, omega: sp.Expr, omega_dot: sp.Expr) -> sp.Matrix:
        return (omega_dot * z).cross(r) + (omega * z).cross((omega * z).cross(r))

    r_G1, r_O2, r_G2 = along(q1, s["lc1"]), along(q1, s["l1"]), along(q1 + q2, s["lc2"])
    F_G1 = s["m1"] * acceleration(r_G1, a, a_dot)
    F_G2 = s["m2"] * (acceleration(r_O2, a, a_dot) + acceleration(r_G2, a + b, a_dot + b_dot))
    M_G1, M_G2 = s["I1"] * a_dot * z, s["I2"] * (a_dot + b_dot) * z
    tau_2 = M_G2 + r_G2.cross(F_G2)
    tau_1 = M_G1 + r_G1.cross(F_G1) + tau_2 + r_O2.cross(F_G2)
    assert equal_in_numbers(printed(p, p.inverse.tau).subs(s["g"], 0), [tau_1[2], tau_2[2]])


# -- 5.7, 5.8 and 6.4: propagation, with the slides' inverses as they stand


def slide_values(name: str, seed: int) -> tuple[Any, Any, np.ndarray, np.ndarray]:
    model = systems.get(name).check()
    n = len(model.coordinates)
    tree = NumericTree(model).at(random_vector(n, seed), random_vector(n, seed + 1)).tree
    tau, a_0 = random_vector(n, seed + 2), np.array([0, 0, 0, 0.3, -0.2, 9.0], dtype=object)
    return tree, velocities(tree), tau, a_0


@pytest.mark.parametrize("seed", range(3))
def test_one_link(seed: int) -> None:
    """5.7, "Examples of 1 link arm", eq. (1)."""
    model = systems.get("pendulum").check()
    tree = NumericTree(model).at([0.3 + seed], [1.5]).tree
    m, tau_1, a_0 = velocities(tree), 0.7, np.array([0, 0, 0, 0, 9.81, 0], dtype=object)
    S, I, X, c, p = m.S[0], m.I[0], m.X[0], m.c[0], m.p[0]
    slide = (tau_1 - S.T @ (I @ (X @ a_0 + c) + p)) / (S.T @ I @ S)[0, 0]
    check(forward_dynamics(tree, [tau_1], a_0=a_0).u_dot, slide, 1e-14)
    # 3.4: m l^2 q_ddot = -m g l sin q
    check(slide, [tau_1 - 9.81 * np.sin(0.3 + seed)], 1e-14)


@pytest.mark.parametrize("seed", range(3))
def test_two_links_propagation(seed: int) -> None:
    """5.8, "Forward Dynamics of 2-Link Arm": I_1^A, p_1^A, then q1_ddot and q2_ddot.

    Three of its slides print I_1^A with a product where the others, and 5.7, have the minus before X* I_2 S_2 (...)^-1. On the
    last ones (1) and (2) of "we can solve" are swapped.
    """
    tree, m, (tau_1, tau_2), a_0 = slide_values("two_link_arm", seed)
    (S_1, S_2), (I_1, I_2), (c_1, c_2), (p_1, p_2) = m.S, m.I, m.c, m.p
    X_1, X_2, Xs_2 = m.X[0], m.X[1], m.X_star[1]
    inverse_2 = 1 / (S_2.T @ I_2 @ S_2)[0, 0]
    I_1A = I_1 + Xs_2 @ I_2 @ X_2 - Xs_2 @ I_2 @ S_2 * inverse_2 @ S_2.T @ I_2 @ X_2
    p_1A = p_1 + Xs_2 @ p_2 + Xs_2 @ I_2 @ c_2 + (Xs_2 @ I_2 @ S_2 * inverse_2) @ (tau_2 - S_2.T @ (I_2 @ c_2 + p_2))
    q1_ddot = (tau_1 - S_1.T @ (I_1A @ (X_1 @ a_0 + c_1) + p_1A)) / (S_1.T @ I_1A @ S_1)[0, 0]
    a_1 = X_1 @ a_0 + S_1 @ q1_ddot + c_1
    q2_ddot = inverse_2 * (tau_2 - S_2.T @ (I_2 @ (X_2 @ a_1 + c_2) + p_2))
    found = forward_dynamics(tree, [tau_1, tau_2], a_0=a_0)
    check(found.I_A[0], I_1A, 1e-14)
    check(found.p_A[0], p_1A, 1e-13)
    check(found.u_dot, [*q1_ddot, *q2_ddot], 1e-12)
    check(found.a[0], a_1, 1e-12)


@pytest.mark.parametrize("seed", range(3))
def test_three_links_propagation(seed: int) -> None:
    """5.8 and 6.4, "Forward Dynamics of 3-Link Arm", its nine formulas."""
    tree, m, tau, a_0 = slide_values("three_link_arm", seed)
    I_A, p_A = list(m.I), list(m.p)
    for i in (2, 1):
        S, X, Xs, c = m.S[i], m.X[i], m.X_star[i], m.c[i]
        inverse = 1 / (S.T @ I_A[i] @ S)[0, 0]
        I_A[i - 1] = m.I[i - 1] + Xs @ I_A[i] @ X - Xs @ I_A[i] @ S * inverse @ S.T @ I_A[i] @ X
        p_A[i - 1] = m.p[i - 1] + Xs @ p_A[i] + Xs @ I_A[i] @ c + (Xs @ I_A[i] @ S * inverse) @ (
            tau[i] - S.T @ (I_A[i] @ c + p_A[i]))
    a, q_ddot = a_0, []
    for i in range(3):
        S, X, c = m.S[i], m.X[i], m.c[i]
        q_ddot += list((tau[i] - S.T @ (I_A[i] @ (X @ a + c) + p_A[i])) / (S.T @ I_A[i] @ S)[0, 0])
        a = X @ a + S @ np.array(q_ddot[-1:], dtype=object) + c
    found = forward_dynamics(tree, tau, a_0=a_0)
    check(found.u_dot, q_ddot, 1e-11)
    check(np.array(found.I_A), np.array(I_A), 1e-13)
    check(np.array(found.p_A), np.array(p_A), 1e-12)


@pytest.mark.parametrize("seed", range(3))
def test_three_links_inverse_dynamics(seed: int) -> None:
    """6.4, "Inverse Dynamics of 3-Link Arm": a_i, f_i^B, f_i, tau_i, and no link 4."""
    tree, m, q_ddot, a_0 = slide_values("three_link_arm", seed)
    a = [a_0]
    for i in range(3):
        a.append(m.X[i] @ a[i] + m.S[i] @ q_ddot[i:i + 1] + m.c[i])
    f_3 = m.I[2] @ a[3] + m.p[2]
    f_2 = m.I[1] @ a[2] + m.p[1] + m.X_star[2] @ f_3
    f_1 = m.I[0] @ a[1] + m.p[0] + m.X_star[1] @ f_2
    found = inverse_dynamics(tree, q_ddot, a_0)
    check(np.array(found.f), [f_1, f_2, f_3], 1e-14)
    check(found.tau, [*(m.S[0].T @ f_1), *(m.S[1].T @ f_2), *(m.S[2].T @ f_3)], 1e-14)


def test_motion_subspaces() -> None:
    """6.4, "Define S matrix according to the joint": revolute, prismatic, spherical, 6-DOF.

    The slides of the spherical and 6-DOF joint write q_dot for speeds that are no derivatives of coordinates ("Caution!" on the
    last one marks this): the angular velocity, and the velocity in the axes of b2. The 6-DOF slides print "+" before the
    written-out S q_dot, where "=" is meant, and X v - S q_dot for X v + S q_dot. Here the linear speeds of the 6-DOF joint
    come first.
    """
    s = sd.System("joints")
    bodies = [s.add_body(f"b{k}", mass=1, inertia=[1, 1, 1]) for k in range(4)]
    s.add_joint(sd.Revolute("revolute", s.ground, bodies[0]))
    s.add_joint(sd.Prismatic("prismatic", s.ground, bodies[1]))
    s.add_joint(sd.Spherical("spherical", s.ground, bodies[2], orientation=sd.EulerAngles("ZYX", "body")))
    s.add_joint(sd.Free("free", s.ground, bodies[3], velocity="body"))
    p = page_of(s.check())
    one = sp.eye(3)
    assert printed(p, "S_1") == sp.Matrix([0, 0, 1, 0, 0, 0]) and printed(p, "S_2") == sp.Matrix([0, 0, 0, 1, 0, 0])
    assert printed(p, "S_3") == sp.Matrix.vstack(one, sp.zeros(3))
    assert printed(p, "S_4") == sp.Matrix(sp.BlockMatrix([[sp.zeros(3), one], [one, sp.zeros(3)]]))
    assert all(printed(p, f"S_ring_{k}").is_zero_matrix for k in (1, 2, 3, 4))


def test_n_link_pendulum() -> None:
    """Three rods, by hand in the way of chapter 5.5, compared with the recursions' printed torques."""
    p = page("n_link_pendulum", n=3)
    s = symbols(p)
    q, u, ud = [[s[f"q{k}{end}"] for k in (1, 2, 3)] for end in ("", "_dot", "_ddot")]
    angle, omega, omega_dot = [[sum(e[:k + 1]) for k in range(3)] for e in (q, u, ud)]

    def at(k: int, length: sp.Expr) -> sp.Matrix:
        """Acceleration of a point of rod k against its hinge."""
        t = sp.Matrix([-sp.sin(angle[k]), sp.cos(angle[k])])
        return length * (omega_dot[k] * t - omega[k] ** 2 * sp.Matrix([sp.cos(angle[k]), sp.sin(angle[k])]))

    def lever(k: int, length: sp.Expr, F: sp.Matrix) -> sp.Expr:
        return length * (sp.cos(angle[k]) * F[1] - sp.sin(angle[k]) * F[0])

    a_O, F_G = sp.Matrix([0, s["g"]]), []
    for k in range(3):
        F_G.append(s[f"m{k + 1}"] * (a_O + at(k, s[f"lc{k + 1}"])))
        a_O = a_O + (at(k, s[f"l{k + 1}"]) if k < 2 else sp.zeros(2, 1))
    tau, F_O = [0, 0, 0, 0], sp.zeros(2, 1)
    for k in reversed(range(3)):
        tau[k] = s[f"I{k + 1}"] * omega_dot[k] + lever(k, s[f"lc{k + 1}"], F_G[k]) + tau[k + 1] + (
            lever(k, s[f"l{k + 1}"], F_O) if k < 2 else 0)
        F_O = F_O + F_G[k]
    assert equal_in_numbers(printed(p, p.inverse.tau), tau[:3])
