"""Identities of symbolic rotations, exact: as polynomials in sines and cosines with sin^2 + cos^2 = 1."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest
import sympy as sp
from sympy.physics import mechanics, vector

import symdyn as sd

rotation = sd.rotation
ANGLES = sp.Matrix(sd.coordinates("alpha beta gamma", real=True))
RATES = ANGLES.applyfunc(lambda angle: angle.dot)
P = sp.Matrix(sd.coordinates("theta0:4", real=True))
PD = P.applyfunc(lambda parameter: parameter.dot)
A = sp.Matrix(sp.symbols("a_x a_y a_z", real=True))


def is_zero(expression: sp.Expr) -> bool:
    """Whether a polynomial in sines and cosines of symbols vanishes identically; an expression in other terms fails."""
    angles = sorted({f.args[0] for f in expression.atoms(sp.sin, sp.cos)}, key=str)
    relations, generators = [], []
    for k, angle in enumerate(angles):
        s, c = sp.symbols(f"s_{k} c_{k}")
        expression = expression.xreplace({sp.sin(angle): s, sp.cos(angle): c})
        relations.append(s**2 + c**2 - 1)
        generators += [s, c]
    expression = sp.expand(expression)
    return bool(expression == 0 or sp.reduced(expression, relations, *generators)[1] == 0) if relations else expression == 0


def vanish(matrix: sp.Matrix) -> bool:
    return all(is_zero(entry) for entry in matrix)


def unit(expression: sp.Expr, symbols: sp.Matrix) -> sp.Expr:
    """The expression where the symbols are a unit vector."""
    last = symbols[-1]
    return sp.reduced(sp.expand(expression), [sum(s**2 for s in symbols) - 1], last, *symbols[:-1])[1]


def test_a_wrong_identity_is_not_zero() -> None:
    assert not is_zero(sp.sin(ANGLES[0])**2 + sp.cos(ANGLES[0])**2 - 2)
    assert not is_zero(sp.sin(ANGLES[0]) * sp.cos(ANGLES[1]))


@pytest.mark.parametrize("sequence", rotation.SEQUENCES)
def test_euler_angles(sequence: str) -> None:
    R = rotation.from_euler(sequence, ANGLES)
    assert isinstance(R, sp.Matrix)
    # det R, 1 or -1 everywhere, is 1 where the angles are zero.
    assert vanish(R.T * R - sp.eye(3)) and R.subs(dict.fromkeys(ANGLES, 0)) == sp.eye(3)
    parts = [rotation.about(letter, angle) for letter, angle in zip(sequence, ANGLES)]
    assert vanish(R - parts[0] * parts[1] * parts[2])
    for frame in ("n", "b"):
        G = rotation.euler_rates(sequence, ANGLES, frame)
        R_dot = R.applyfunc(lambda entry: sum(sp.diff(entry, q) * q.dot for q in ANGLES))
        assert vanish(rotation.vee(R_dot * R.T if frame == "n" else R.T * R_dot) - G * RATES)
        assert vanish(rotation.angular_velocity(R, frame) - G * RATES)
    # Numerators of G^-1 G - 1: divided by the sine or cosine of the second angle alone.
    scale = sp.sin(ANGLES[1]) if sequence[0] == sequence[2] else sp.cos(ANGLES[1])
    inverse = (rotation.euler_rates_inverse(sequence, ANGLES) * scale).applyfunc(sp.expand)
    assert vanish(inverse * rotation.euler_rates(sequence, ANGLES) - scale * sp.eye(3))


@pytest.mark.parametrize("sequence", rotation.SEQUENCES)
def test_euler_angles_as_sympy_mechanics_has_them(sequence: str) -> None:
    angles = vector.dynamicsymbols("alpha beta gamma")
    n = vector.ReferenceFrame("n")
    b = n.orientnew("b", "Body", angles, sequence)
    assert vanish((rotation.from_euler(sequence, angles) - n.dcm(b)).subs(dict(zip(angles, ANGLES))))
    rates = [angle.diff(sd.t) for angle in angles]
    back = dict(zip(rates, RATES)) | dict(zip(angles, ANGLES))
    omega = b.ang_vel_in(n)
    for frame, axes in (("n", n), ("b", b)):
        theirs = omega.to_matrix(axes).subs(back)
        assert vanish(rotation.euler_rates(sequence, ANGLES, frame) * RATES - theirs)


def test_euler_parameters() -> None:
    E, E_bar = rotation.E(P), rotation.E_bar(P)
    norm = sum(theta**2 for theta in P)
    assert E.shape == E_bar.shape == (3, 4)
    assert vanish(E * P) and vanish(E_bar * P)
    assert vanish(E * E.T - norm * sp.eye(3)) and vanish(E_bar * E_bar.T - norm * sp.eye(3))
    assert vanish(E.T * E - norm * sp.eye(4) + P * P.T) and vanish(E_bar.T * E_bar - norm * sp.eye(4) + P * P.T)
    R = rotation.from_parameters(P)
    assert vanish(R - E * E_bar.T)
    assert vanish(R.T * R - norm**2 * sp.eye(3)) and is_zero(R.det() - norm**3)
    assert vanish(rotation.from_parameters(-P) - R)
    # E_dot E_bar^T = E E_bar_dot^T, so that R_dot = 2 E_dot E_bar^T
    assert vanish(rotation.E(PD) * E_bar.T - E * rotation.E_bar(PD).T)


def test_rates_of_euler_parameters() -> None:
    omega = sp.Matrix(sp.symbols("omega_x omega_y omega_z"))
    R = rotation.from_parameters(P)
    R_dot = R.applyfunc(lambda entry: sum(sp.diff(entry, q) * q.dot for q in P))
    keep = {PD[3]: -sum(P[k] * PD[k] for k in range(3)) / P[3]}   # p . p_dot = 0
    for frame, S in (("n", R_dot * R.T), ("b", R.T * R_dot)):
        theirs = sp.Matrix([S[2, 1], S[0, 2], S[1, 0]]) - rotation.omega_from_parameters(P, PD, frame)
        numerators = theirs.subs(keep).applyfunc(lambda entry: sp.numer(sp.together(entry)))
        assert all(unit(entry, P) == 0 for entry in numerators)
        pd = rotation.parameters_rate(P, omega, frame)
        assert is_zero((P.T * pd)[0])
        again = rotation.omega_from_parameters(P, pd, frame) - sum(theta**2 for theta in P) * omega
        assert vanish(again)
    assert vanish(R * rotation.omega_from_parameters(P, PD, "b") - rotation.omega_from_parameters(P, PD, "n")
                  * sum(theta**2 for theta in P))


def test_composition_and_inverse_of_euler_parameters() -> None:
    r = sp.Matrix(sp.symbols("r0:4", real=True))
    product_of = rotation.compose(P, r)
    assert vanish(rotation.from_parameters(product_of) - rotation.from_parameters(P) * rotation.from_parameters(r))
    assert vanish(rotation.from_parameters(rotation.inverse(P)) - rotation.from_parameters(P).T)
    norm = sum(theta**2 for theta in P)
    assert vanish(rotation.compose(P, rotation.inverse(P)) - sp.Matrix([norm, 0, 0, 0]))


def test_rodrigues() -> None:
    phi = ANGLES[0]
    R, S = rotation.about(A, phi, unit=True), rotation.skew(A)
    for i, j in product(range(3), repeat=2):
        entry = R[i, j] - (sp.eye(3) + sp.sin(phi) * S + (1 - sp.cos(phi)) * S * S)[i, j]
        assert unit(entry, A) == 0
    p = rotation.parameters_of_axis_angle(A, 2 * phi, unit=True)
    twice = (rotation.about(A, 2 * phi, unit=True) - rotation.from_parameters(p)).applyfunc(sp.expand_trig)
    for entry in twice:
        s, c = sp.symbols("s c")
        entry = sp.expand(entry.xreplace({sp.sin(phi): s, sp.cos(phi): c}))
        assert sp.reduced(entry, [A[2]**2 + A[0]**2 + A[1]**2 - 1, s**2 + c**2 - 1], A[2], s, A[0], A[1], c)[1] == 0


def test_an_axis_is_divided_by_its_length() -> None:
    phi = ANGLES[0]
    for letter, number, along in (("X", 0, [2, 0, 0]), ("Y", 1, [0, 5, 0]), ("Z", 2, [0, 0, 3])):
        R = rotation.about(letter, phi)
        assert R == rotation.about(number, phi) == rotation.about(letter.lower(), phi) == rotation.about(sp.Integer(number), phi)
        assert vanish(R - rotation.about(along, phi))
    thirds = {A[0]: sp.Rational(1, 3), A[1]: sp.Rational(2, 3), A[2]: sp.Rational(-2, 3)}
    assert vanish(rotation.about([1, 2, -2], phi) - rotation.about(A, phi, unit=True).subs(thirds))
    assert vanish(rotation.about(A, phi).subs(thirds) - rotation.about(A, phi, unit=True).subs(thirds))
    assert rotation.about("Z", phi) == sp.Matrix([[sp.cos(phi), -sp.sin(phi), 0], [sp.sin(phi), sp.cos(phi), 0], [0, 0, 1]])


def test_skew_and_vee() -> None:
    v, w = A, sp.Matrix(sp.symbols("w_x w_y w_z"))
    assert vanish(rotation.skew(v) * w - v.cross(w))
    assert rotation.vee(rotation.skew(v)) == v
    assert rotation.infinitesimal(v) == sp.eye(3) + rotation.skew(v)


def test_infinitesimal_rotations_commute_and_are_the_first_order_of_all_others() -> None:
    small = sp.Symbol("epsilon")
    delta = sp.Matrix([small * angle for angle in ANGLES])
    for sequence in ("ZYX", "XYZ", "YXZ"):
        order = ["XYZ".index(letter) for letter in sequence]
        R = rotation.from_euler(sequence, [delta[k] for k in order])
        first = R.subs(small, 0) + small * R.diff(small).subs(small, 0)
        assert vanish(first - rotation.infinitesimal(delta))
    both = rotation.infinitesimal(delta) * rotation.infinitesimal(2 * delta[::-1, :])
    swapped = rotation.infinitesimal(2 * delta[::-1, :]) * rotation.infinitesimal(delta)
    assert vanish((both - swapped).diff(small).subs(small, 0)) and not vanish(both - swapped)


def test_angular_velocity_of_what_depends_on_time_in_every_way() -> None:
    q, k = sd.coordinates("q"), sp.Symbol("k")
    assert rotation.angular_velocity(rotation.about("Z", k * q + 3 * sd.t)) == sp.Matrix([0, 0, k * q.dot + 3])
    assert rotation.angular_velocity(rotation.about("X", q.dot), "b") == sp.Matrix([q.ddot, 0, 0])
    free = mechanics.dynamicsymbols("q")
    assert rotation.angular_velocity(rotation.about("Y", free)) == sp.Matrix([0, free.diff(sd.t), 0])
    theirs = rotation.euler_rates("ZYX", [q, free, sd.t]) * sp.Matrix([q.dot, free.diff(sd.t), 1])
    assert vanish(rotation.angular_velocity(rotation.from_euler("ZYX", [q, free, sd.t])) - theirs)
    assert rotation.angular_velocity(rotation.about("Y", k)) == sp.zeros(3, 1)
    R = rotation.from_euler("ZYX", ANGLES)
    R_dot = R.applyfunc(lambda entry: sum(sp.diff(entry, angle) * angle.dot for angle in ANGLES))
    assert rotation.angular_velocity(R, R_dot=R_dot) == rotation.angular_velocity(R)


def test_angular_velocity_of_numbers() -> None:
    R = rotation.from_euler("ZXZ", [0.3, 0.4, 0.5])
    omega = np.array([1.0, -2, 3])
    assert rotation.angular_velocity(R, R_dot=rotation.skew(omega) @ R) == pytest.approx(omega, abs=1e-15)
    assert rotation.angular_velocity(R, "b", R_dot=rotation.skew(omega) @ R) == pytest.approx(R.T @ omega, abs=1e-15)
