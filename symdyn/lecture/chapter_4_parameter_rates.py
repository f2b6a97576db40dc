"""Chapter 4.5: E and E_bar, angular velocity by the rates of Euler parameters, and the rates by the angular velocity."""

from __future__ import annotations

from typing import Any

import sympy as sp
from sympy import cos, sin

import symdyn as sd
from symdyn.comparison import Case, Erratum, Formula, Slide, proofs
from symdyn.lecture.chapter_4_euler_parameters import NORM, R, p, pd, theta_0, theta_1, theta_2, theta_3
from symdyn.lecture.chapter_4_euler_theorem import UNIT, a_x, a_y, a_z

theta_0d, theta_1d, theta_2d, theta_3d = pd
phi = sd.coordinates("phi")
omega_1, omega_2, omega_3 = omega = sp.Matrix(sp.symbols("omega_1:4"))
I_4 = sp.eye(4)

# As printed.
E = sp.Matrix([[-theta_1, theta_0, -theta_3, theta_2], [-theta_2, theta_3, theta_0, -theta_1],
               [-theta_3, -theta_2, theta_1, theta_0]])
E_bar = sp.Matrix([[-theta_1, theta_0, theta_3, -theta_2], [-theta_2, -theta_3, theta_0, theta_1],
                   [-theta_3, theta_2, -theta_1, theta_0]])
Ed = sp.Matrix([[-theta_1d, theta_0d, -theta_3d, theta_2d], [-theta_2d, theta_3d, theta_0d, -theta_1d],
                [-theta_3d, -theta_2d, theta_1d, theta_0d]])
E_T = sp.Matrix([[-theta_1, -theta_2, -theta_3], [theta_0, theta_3, -theta_2], [-theta_3, theta_0, theta_1],
                 [theta_2, -theta_1, theta_0]])
of_omega = sp.Matrix([2 * (theta_3d * theta_2 - theta_2d * theta_3 + theta_1d * theta_0 - theta_0d * theta_1),
                      2 * (theta_1d * theta_3 - theta_0d * theta_2 - theta_3d * theta_1 + theta_2d * theta_0),
                      2 * (theta_2d * theta_1 + theta_3d * theta_0 - theta_0d * theta_3 - theta_1d * theta_2)])
MINUS = "E_bar^T E_bar is 1 - p p^T: it takes away what is along p."


def _turning() -> tuple[sp.Matrix, sp.Matrix]:
    """omega and its skew-symmetric matrix, by differentiating R(p)."""
    turning = sd.rotation.angular_velocity(sd.rotation.from_parameters(p))
    return turning, sd.rotation.skew(turning)


def _projects(what: str) -> proofs.Proof:
    return proofs.Proof("null vector", f"{what} takes p to 0, since E_bar p = 0.", lambda product: sp.Matrix(product) * p)


def _identities() -> list[Formula]:
    e, e_bar = sd.rotation.E(p), sd.rotation.E_bar(p)
    turned = sd.rotation.from_parameters(p)
    entries = sp.Matrix([
        [theta_1**2 + theta_0**2 - theta_3**2 - theta_2**2,
         theta_1 * theta_2 - theta_0 * theta_3 - theta_3 * theta_0 + theta_2 * theta_1,
         theta_1 * theta_3 + theta_0 * theta_2 + theta_3 * theta_1 + theta_2 * theta_0],
        [theta_2 * theta_1 + theta_3 * theta_0 + theta_0 * theta_3 + theta_1 * theta_2,
         theta_2**2 - theta_3**2 + theta_0**2 - theta_1**2,
         theta_2 * theta_3 + theta_3 * theta_2 - theta_0 * theta_1 - theta_1 * theta_0],
        [theta_3 * theta_1 - theta_2 * theta_0 + theta_1 * theta_3 - theta_0 * theta_2,
         theta_3 * theta_2 + theta_2 * theta_3 + theta_1 * theta_0 + theta_0 * theta_1,
         theta_3**2 - theta_2**2 - theta_1**2 + theta_0**2]])
    whole = theta_0**2 + theta_1**2 + theta_2**2 + theta_3**2
    collected = R + sp.diag(1, 1, 1) - sp.diag(whole, whole, whole)
    E_bar_T = sp.Matrix([[-theta_1, -theta_2, -theta_3], [theta_0, -theta_3, theta_2], [theta_3, theta_0, -theta_1],
                         [-theta_2, theta_1, theta_0]])
    about_x = proofs.limit("For the rotation by phi about x it is cos^2 + sin^2 of half the angle.",
                           at={theta_0: cos(phi / 2), theta_1: sin(phi / 2), theta_2: 0, theta_3: 0, "theta_4": 0}, value=1)
    index = Erratum("theta_1 is left out and a theta_4 added that does not exist: the indices are 0, 1, 2, 3.", about_x)
    c, s = cos(phi / 2), sin(phi / 2)
    norm = [c**2 + a_x**2 * s**2 + a_y**2 * s**2 + a_z**2 * s**2, c**2 + (a_x**2 + a_y**2 + a_z**2) * s**2, c**2 + s**2, sp.S.One]
    of_axis = sd.rotation.parameters_of_axis_angle([a_x, a_y, a_z], phi, unit=True)
    return [
        Formula("E", E, e, line=6977, also=(6995, 7007, 7039, 7114, 7136, 7208, 7228, 7276)),
        Formula("E_bar", E_bar, e_bar, line=7023, also=(7039, 7114, 7136), latex=r"\bar E"),
        Formula("E_bar^T", E_bar_T, e_bar.T, line=7039, latex=r"\bar E^T"),
        Formula("E^T", E_T, e.T, line=7168, also=(7178, 7192, 7210)),
        Formula("R by E", E * E_bar.T, turned, line=7009, also=(7029, 7047, 7061, 7100, 7118, 7140), latex=r"{}^nR_b"),
        Formula("E E_bar^T, factors", E * E_bar_T, turned, line=7039, latex=r"E \bar E^T"),
        Formula("E E_bar^T, entries", entries, turned, line=7041, also=(7059,), latex=r"E \bar E^T"),
        Formula("E E_bar^T, collected", collected, turned, line=7059, latex=r"E \bar E^T"),
        Formula("E E_bar^T, norm 1", R, turned, line=7059, where=NORM, latex=r"E \bar E^T"),
        Formula("norm of p", theta_0**2 + theta_2**2 + theta_3**2 + sp.Symbol("theta_4")**2, p.dot(p), line=7049, errata=[index]),
        Formula("norm of p, steps", norm, [of_axis.dot(of_axis)] * 4, line=7049, where=UNIT),
        Formula("E_bar^T E_bar", I_4 + p * p.T, e_bar.T * e_bar, line=7134, also=(7240,), where=NORM,
                errata=[Erratum(MINUS, _projects("E_bar^T E_bar"))], latex=r"\bar E^T \bar E"),
        Formula("E p", sp.zeros(3, 1), e * p, line=7134),
        Formula("p_dot . p", sp.S.Zero, pd.dot(p), line=7248, where=NORM, latex=r"\dot p^T p"),
        Formula("R^T by E", E_bar * E.T, turned.T, line=7104, latex=r"{}^nR_b^T"),
    ]


def _angular_velocity_matrix() -> list[Formula]:
    omega_tilde = sd.rotation.skew(sd.rotation.omega_from_parameters(p, pd))
    turned = sd.rotation.from_parameters(p)
    E_bar_d = sd.rate(E_bar)
    c, s = cos(phi / 2), sin(phi / 2)
    third = 1 / sp.sqrt(3)
    rates = [-s * phi.dot / 2, *[third * c * phi.dot / 2] * 3]
    about_diagonal = proofs.limit("The rotation about (1, 1, 1) with the rate phi_dot has omega along it, of that size.",
                                  at=dict(zip([*p, *pd], [c, *[third * s] * 3, *rates])),
                                  value=third * phi.dot * sp.Matrix([[0, -1, 1], [1, 0, -1], [-1, 1, 0]]))
    bar = Erratum("The second factor is E^T without the bar, as the slides prove; 2 E_dot E_bar^T is R_dot.", about_diagonal)
    projector = I_4 + p * p.T
    matrix: dict[str, Any] = {"where": NORM, "latex": r"{}^n\tilde\omega_{b/n}"}
    rate: dict[str, Any] = {"where": NORM, "latex": r"{}^n\dot R_b"}
    return [
        Formula("omega tilde, first print", 2 * Ed * E_bar.T, omega_tilde, line=7021, errata=[bar], **matrix),
        Formula("R_dot by omega tilde", omega_tilde * R, sd.rate(turned), line=7071, also=(7078,), **rate),
        Formula("omega tilde by R_dot", sd.rate(R) * R.T, omega_tilde, line=7011, also=(7067, 7080, 7082, 7084, 7120, 7142),
                **matrix),
        Formula("R_dot by E", Ed * E_bar.T + E * E_bar_d.T, sd.rate(turned), line=7102, **rate),
        Formula("E E_bar_dot^T", E * E_bar_d.T, Ed * E_bar.T, line=7108, latex=r"E \dot{\bar E}^T"),
        Formula("E_dot", Ed, sd.rate(sd.rotation.E(p)), line=7168, also=(7178, 7192, 7210), latex=r"\dot E"),
        Formula("omega tilde, products", (Ed * E_bar.T + E * E_bar_d.T) * E_bar * E.T, omega_tilde, line=7106, **matrix),
        Formula("omega tilde, equal products", (Ed * E_bar.T + Ed * E_bar.T) * E_bar * E.T, omega_tilde, line=7110, **matrix),
        Formula("omega tilde, four factors", 2 * Ed * E_bar.T * E_bar * E.T, omega_tilde, line=7112, also=(7134,), **matrix),
        Formula("omega tilde, with p p^T", 2 * Ed * projector * E.T, omega_tilde, line=7134, **matrix),
        Formula("omega tilde, two terms", 2 * Ed * I_4 * E.T + 2 * Ed * p * p.T * E.T, omega_tilde, line=7134, **matrix),
        Formula("omega tilde, (E p)^T", 2 * Ed * E.T + 2 * Ed * p * (E * p).T, omega_tilde, line=7134, **matrix),
        Formula("omega tilde", 2 * Ed * E.T, omega_tilde, line=7090, also=(7128, 7134, 7146, 7156, 7186, 7198, 7226), **matrix),
    ]


def _angular_velocity() -> list[Formula]:
    turning, omega_tilde = _turning()
    skew = sp.Matrix([[0, -omega_3, omega_2], [omega_3, 0, -omega_1], [-omega_2, omega_1, 0]])
    along = theta_1d * theta_1 + theta_0d * theta_0 + theta_3d * theta_3 + theta_2d * theta_2
    entries = sp.Matrix([
        [along, theta_1d * theta_2 + theta_0d * theta_3 - theta_3d * theta_0 - theta_2d * theta_1,
         theta_1d * theta_3 - theta_0d * theta_2 - theta_3d * theta_1 + theta_2d * theta_0],
        [theta_2d * theta_1 + theta_3d * theta_0 - theta_0d * theta_3 - theta_1d * theta_2,
         theta_2d * theta_2 + theta_3d * theta_3 + theta_0d * theta_0 + theta_1d * theta_1,
         theta_2d * theta_3 - theta_3d * theta_2 + theta_0d * theta_1 - theta_1d * theta_0],
        [theta_3d * theta_1 - theta_2d * theta_0 - theta_1d * theta_3 + theta_0d * theta_2,
         theta_3d * theta_2 - theta_2d * theta_3 + theta_1d * theta_0 - theta_0d * theta_1,
         theta_3d * theta_3 + theta_2d * theta_2 + theta_1d * theta_1 + theta_0d * theta_0]])
    vector: dict[str, Any] = {"where": NORM, "latex": r"{}^n\omega_{b/n}"}
    return [
        Formula("skew-symmetric matrix", skew, sd.rotation.skew(list(omega)), line=7160, also=(7073, 7075, 7174, 7184, 7200),
                latex=r"\tilde\omega"),
        Formula("2 E_dot E^T, factors", 2 * Ed * E_T, omega_tilde, line=7178, where=NORM, latex=r"2 \dot E E^T"),
        Formula("2 E_dot E^T, entries", 2 * entries, omega_tilde, line=7180, also=(7184, 7200), where=NORM,
                latex=r"2 \dot E E^T"),
        Formula("omega, components", of_omega, turning, line=7202, also=(7218, 7220, 7222, 7228), **vector),
        Formula("omega, matrix times p_dot", 2 * E * pd, turning, line=7228, **vector),
        Formula("omega", 2 * E * pd, sd.rotation.omega_from_parameters(p, pd), line=6977, latex=r"{}^n\omega_{b/n}",
                also=(6993, 7005, 7025, 7152, 7166, 7190, 7212, 7232, 7236, 7272)),
    ]


def _rates() -> list[Formula]:
    turning, _ = _turning()
    left = sd.rotation.E(p).T * sd.rotation.omega_from_parameters(p, pd)
    projector = I_4 + p * p.T
    left_side: dict[str, Any] = {"where": NORM, "latex": r"E^T \,{}^n\omega_{b/n}"}
    rate = sd.rotation.parameters_rate(p, omega)
    return [
        Formula("E^T omega, product", 2 * E.T * E * pd, left, line=7238, **left_side),
        Formula("E^T omega, with p p^T", 2 * projector * pd, left, line=7242, **left_side),
        Formula("E^T omega, two terms", 2 * I_4 * pd + 2 * p * p.T * pd, left, line=7244, **left_side),
        Formula("E^T omega, p_dot^T p", 2 * I_4 * pd + 2 * p * (pd.T * p).T, left, line=7246, **left_side),
        Formula("E^T omega", 2 * pd, left, line=7252, also=(7250,), **left_side),
        Formula("p_dot", E.T * omega / 2, rate, line=7254, also=(6997, 7274), latex=r"\dot p"),
        Formula("p_dot of the motion", pd, sd.rotation.parameters_rate(p, turning), line=7254, where=NORM, latex=r"\dot p"),
    ]


CASES = (
    Case("euler-parameters-E", "E, E_bar and their identities", Slide("4.5", "Euler parameter - angular velocity", 7003),
         _identities),
    Case("euler-parameters-omega-tilde", "Angular velocity matrix of Euler parameters", Slide("4.5", "(Derivation)", 7065),
         _angular_velocity_matrix),
    Case("euler-parameters-omega", "Angular velocity of Euler parameters", Slide("4.5", "(Derivation)", 7150), _angular_velocity),
    Case("euler-parameters-rates", "Rates of Euler parameters", Slide("4.5", "(Derivation)", 7234), _rates),
)
