"""Integrals of modal bodies: closed forms, energies of sampled beams, identities between them, and what bad tables get."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from scipy.integrate import quad
from scipy.interpolate import CubicSpline

import symdyn as sd
from symdyn.flexible.integrals import integrate
from symdyn.flexible.table import Table

STATIONS = np.array([0.0, 0.7, 1.1, 2.0])
MASS = np.array([3.0, 2.0, 2.5, 0.5])
EI = (np.array([40.0, 30.0, 31.0, 9.0]), np.array([70.0, 50.0, 20.0, 12.0]))
TWIST = np.array([0.6, 0.5, 0.1, -0.2])
POLYNOMIALS = (("x", (1.2, -0.3, 0.1)), ("y", (0.9, 0.2)), ("x", (-2.0, 3.1, 0.0, -0.1)))
MODES = [sd.Shape(*POLYNOMIALS[0]) + sd.Shape("y", (0.3,)), sd.Shape(*POLYNOMIALS[1]), sd.Shape(*POLYNOMIALS[2])]


def twisted(**options) -> sd.Beam:
    return sd.Beam(STATIONS, MASS, EI, MODES, twist=TWIST, **options)


@pytest.fixture(scope="module")
def body():
    return twisted(damping_ratio=0.02).modal


def test_closed_forms_of_the_uniform_beam() -> None:
    rho, stiff, L = 3.0, 7.0, 2.0
    one = sd.Beam([0, 1], rho, stiff, [sd.Shape("x", [1.0])], length=L).modal  # psi = (X/L)^2
    e, x = np.eye(3)[2], np.eye(3)[0]
    across = np.diag([1.0, 1.0, 0.0])
    for found, exact in (
        (one.m, rho * L), (one.h0, rho * L**2 / 2 * e), (one.I0, rho * L**3 / 3 * across), (one.H1, rho * L / 3 * x[:, None]),
        (one.Me, [[rho * L / 5]]), (one.K, [[4 * stiff / L**3]]), (one.Cr0, rho * L**2 / 4 * np.eye(3)[:, [1]]),
        (one.S_tip, [[4 / (3 * L)]]), (one.H2, -rho / 3 * e[:, None, None]), (one.Theta_tip, 2 / L * np.eye(3)[:, [1]]),
        (one.I1, [-rho * L**2 / 4 * (np.outer(x, e) + np.outer(e, x))]), (one.Psi_tip, x[:, None]),
        (one.I2, 2 * rho * L * (1 / 5 * np.diag([0.0, 1, 1]) - 4 / 15 * across)[None, None]),
    ):
        np.testing.assert_allclose(found, exact, rtol=1e-14, atol=1e-15)
    assert not one.Cr1.any() and one.n == 1 and one.names == ("mode 1",)


PIECES = ((0, "x", POLYNOMIALS[0][1]), (0, "y", (0.3,)), (1, "y", POLYNOMIALS[1][1]), (2, "x", POLYNOMIALS[2][1]))
POINTS, WEIGHTS = np.polynomial.legendre.leggauss(16)


def shapes_at(s: np.ndarray, derivative: int) -> np.ndarray:
    """(points, 2, 3): the three modes by NumPy's polynomials."""
    out = np.zeros((*s.shape, 2, 3))
    for k, direction, coefficients in PIECES:
        polynomial = np.polynomial.Polynomial([0, 0, *coefficients]).deriv(derivative)
        out[..., "xy".index(direction), k] += polynomial(s / 2) / 2**derivative
    return out


def sampled() -> tuple[np.ndarray, np.ndarray]:
    """Points of Gauss-Legendre over the table with weights dm."""
    half = np.diff(STATIONS)[:, None] / 2
    s = (STATIONS[:-1, None] + half * (1 + POINTS)).ravel()
    return s, (half * WEIGHTS).ravel() * np.interp(s, STATIONS, MASS)


def sampled_energy(v, omega, eta, etad) -> float:
    """T of an inextensible beam: the axial coordinate of its points is int sqrt(1 - |w'|^2) ds."""
    s, dm = sampled()
    slope, slope_rate = (shapes_at(s[:, None] / 2 * (1 + POINTS), 1) @ x for x in (eta, etad))
    rise = np.sqrt(1 - (slope**2).sum(-1))
    up, up_rate = (s / 2 * (f @ WEIGHTS) for f in (rise, -(slope * slope_rate).sum(-1) / rise))
    r, rate = (np.column_stack([shapes_at(s, 0) @ x, axial]) for x, axial in ((eta, up), (etad, up_rate)))
    speed = v + np.cross(omega, r) + rate
    return float(dm @ (speed**2).sum(1) / 2)


def test_kinetic_energy_is_complete_to_second_order(body) -> None:
    """The omitted part is of third order: when the amplitude halves, its odd part falls by 8, its even part by 16."""
    rng = np.random.default_rng(5)

    def error(a: float) -> float:
        return sampled_energy(v, omega, a * eta, a * etad) - body.kinetic_energy(v, omega, a * eta, a * etad)

    for _ in range(5):
        v, omega, eta, etad = (rng.uniform(-1, 1, 3) for _ in range(4))
        odd, even = np.transpose([(error(a) - error(-a), error(a) + error(-a)) for a in (0.08, 0.04, 0.02)])
        assert min(*abs(odd), *abs(even)) > 1e-10  # far above rounding
        np.testing.assert_allclose(odd[:-1] / odd[1:], 8, rtol=0.03)
        np.testing.assert_allclose(even[:-1] / even[1:], 16, rtol=0.03)


class Lever:
    """Not a clamped shape: a small rotation of the whole beam about its root, whose integrals follow from the rigid ones."""

    n, degree = 2, 1
    breaks = np.zeros(0)

    def __call__(self, x, derivative=0):
        return np.stack([np.eye(2) * value for value in (x if derivative == 0 else x**0 if derivative == 1 else 0 * x)])


@pytest.mark.parametrize("axis", ["x", "y", "z"])
def test_a_rotation_as_a_mode_rotates_the_rigid_integrals(axis) -> None:
    table = Table(STATIONS, MASS, np.stack(EI, -1), TWIST)
    body = integrate(table, Lever(), axis, np.zeros(2), "exact", STATIONS[[0, -1]], "lever", ("a", "b"))
    Theta = body.Theta_tip
    W = [np.cross(column, np.eye(3)).T for column in Theta.T]  # W v = Theta_i x v
    np.testing.assert_allclose(np.cross(Theta, body.e, axisa=0, axisc=0) * 2.0, body.Psi_tip, atol=1e-14)
    np.testing.assert_allclose(body.Cr0, body.I0 @ Theta, atol=1e-14)
    np.testing.assert_allclose(body.Me, Theta.T @ body.I0 @ Theta, atol=1e-14)
    np.testing.assert_allclose(body.S_tip, 2.0 * np.eye(2), atol=1e-14)
    for i in range(2):
        np.testing.assert_allclose(body.H1[:, i], W[i] @ body.h0, atol=1e-14)
        np.testing.assert_allclose(body.I1[i], W[i] @ body.I0 - body.I0 @ W[i], atol=1e-14)
        for j in range(2):
            both = (W[i] @ W[j] + W[j] @ W[i]) / 2
            np.testing.assert_allclose(body.H2[:, i, j], both @ body.h0, atol=1e-14)
            turned = both @ body.I0 + body.I0 @ both - W[i] @ body.I0 @ W[j] - W[j] @ body.I0 @ W[i]
            np.testing.assert_allclose(body.I2[i, j], turned, atol=1e-13)


def test_identities_between_the_integrals(body) -> None:
    rng = np.random.default_rng(3)
    eta, step = rng.uniform(-1, 1, 3), 0.25
    e = body.e
    for i, d in enumerate(np.eye(3)):
        # Differences of quadratic functions are exact.
        np.testing.assert_allclose(body.Ct(eta)[:, i], (body.h(eta + step * d) - body.h(eta - step * d)) / (2 * step), atol=1e-13)
        # int X Psi dm stands in both.
        arm = np.cross(body.Cr0[:, i], e)
        np.testing.assert_allclose(body.I1[i], -np.outer(arm, e) - np.outer(e, arm))
    np.testing.assert_allclose(e @ body.Cr1.transpose(1, 0, 2).reshape(3, -1), -(e @ body.Cr1.transpose(1, 2, 0).reshape(3, -1)))
    np.testing.assert_allclose(np.einsum("ijaa->ij", body.I2) / 4, body.Me - moment_of_foreshortening())
    np.testing.assert_allclose(np.einsum("a,b,ijab->ij", e, e, body.I2), 2 * body.Me)  # what turns about e has the mass Me
    assert np.abs(body.H2 - body.H2.transpose(0, 2, 1)).max() == 0 and np.abs(body.S_tip - body.S_tip.T).max() == 0
    np.testing.assert_allclose(body.inertia(eta), body.inertia(eta).T)


def moment_of_foreshortening() -> np.ndarray:
    """int X S dm by nested quadrature."""
    s, dm = sampled()
    slope = shapes_at(s[:, None] / 2 * (1 + POINTS), 1)
    S = np.einsum("p,q,pqai,pqaj->pij", s / 2, WEIGHTS, slope, slope)
    return np.tensordot(dm * s, S, 1)


def test_stiffness_of_turned_principal_axes(body) -> None:
    def integrand(s: float, i: int, j: int) -> float:
        turn, k = np.interp(s, STATIONS, TWIST), shapes_at(np.array(s), 2)
        along = np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]]) @ k
        return sum(np.interp(s, STATIONS, EI[p]) * along[p, i] * along[p, j] for p in range(2))

    for i, j in ((0, 0), (0, 1), (1, 2), (2, 2)):
        exact = sum(quad(integrand, a, b, (i, j), epsrel=1e-12)[0] for a, b in pairwise(STATIONS))
        assert body.K[i, j] == pytest.approx(exact, rel=1e-12)


def test_a_twist_of_a_quarter_turn_exchanges_the_stiffnesses() -> None:
    quarter = sd.Beam(STATIONS, MASS, EI, MODES, twist=np.full(4, np.pi / 2)).modal
    np.testing.assert_allclose(quarter.K, sd.Beam(STATIONS, MASS, EI[::-1], MODES).modal.K, rtol=1e-13, atol=1e-13)


@pytest.mark.parametrize("axis", ["x", "y"])
def test_axes_are_permuted_alike(axis, body) -> None:
    order = "xyz".index(axis) + 1
    turn = np.roll(np.eye(3), order, axis=0)  # takes z to the axis, in cyclic order
    first, second = ("yz", "zx")["xy".index(axis)]
    shapes = [sd.Shape(first, POLYNOMIALS[0][1]) + sd.Shape(second, (0.3,)), sd.Shape(second, POLYNOMIALS[1][1]),
              sd.Shape(first, POLYNOMIALS[2][1])]
    other = sd.Beam(STATIONS, MASS, EI, shapes, twist=TWIST, axis=axis).modal
    for name in ("h0", "H1", "H2", "Cr0", "Psi_tip", "Theta_tip", "e"):
        np.testing.assert_allclose(getattr(other, name), np.tensordot(turn, getattr(body, name), 1), atol=1e-14, err_msg=name)
    np.testing.assert_allclose(other.Cr1, np.einsum("ab,jbi->jai", turn, body.Cr1), atol=1e-14)
    np.testing.assert_allclose(other.I2, np.einsum("ac,bd,ijcd->ijab", turn, turn, body.I2), atol=1e-14)
    for name in ("Me", "K", "S_tip", "m"):
        np.testing.assert_allclose(getattr(other, name), getattr(body, name), rtol=1e-14)


def test_samples_give_what_the_polynomial_gives() -> None:
    xi = np.linspace(0, 1, 9)
    cubic, quintic = (1.3, -0.4), (1.3, -0.4, 0.2, 0.5)
    powers = [np.polynomial.Polynomial([0, 0, *c]) for c in (cubic, quintic)]
    exact = sd.Beam(STATIONS, MASS, EI, [sd.Shape("x", cubic), sd.Shape("y", quintic)]).modal
    p, q = powers
    metres = [sd.Shape("x", stations=2 * xi, values=p(xi)),
              sd.Shape("y", stations=2 * xi, values=q(xi), slopes=q.deriv()(xi) / 2, curvatures=q.deriv(2)(xi) / 4)]
    fractions = [sd.Shape("x", stations=xi, values=p(xi), slopes=p.deriv()(xi)),
                 sd.Shape("y", stations=xi, values=q(xi), slopes=q.deriv()(xi), curvatures=q.deriv(2)(xi))]
    for sampled in (sd.Beam(STATIONS, MASS, EI, metres), sd.Beam(STATIONS / 2, MASS, EI, fractions, length=2.0)):
        for name in ("Me", "K", "H1", "H2", "I2", "Cr0", "Theta_tip", "S"):
            np.testing.assert_allclose(getattr(sampled.modal, name), getattr(exact, name), rtol=1e-11, atol=1e-12, err_msg=name)


def test_splines_through_values_come_near_the_shape() -> None:
    """11 values of a mode with a node give its stiffness to a hundredth, 41 to 1e-4."""
    exact = sd.Beam([0, 1], 1.0, 1.0, 4).modal
    x = np.linspace(0, 1, 41)
    mode = CubicSpline(exact.X, exact.Psi[:, 0, 2], bc_type=((1, 0), (2, 0)))(x)
    coarse, fine = (sd.Beam([0, 1], 1.0, 1.0, [sd.Shape("x", stations=x[::k], values=mode[::k])]).modal.K[0, 0] for k in (4, 1))
    assert coarse == pytest.approx(exact.K[2, 2], rel=1e-2) and fine == pytest.approx(exact.K[2, 2], rel=1e-3)


def test_each_clamped_mode_has_its_damping_ratio(body) -> None:
    def ratios(modal):
        n = modal.n
        A = np.block([[np.zeros((n, n)), np.eye(n)], [-np.linalg.solve(modal.Me, modal.K), -np.linalg.solve(modal.Me, modal.D)]])
        roots = np.linalg.eigvals(A)
        roots = roots[roots.imag > 0]
        return (-roots.real / np.abs(roots))[np.argsort(np.abs(roots))]

    np.testing.assert_allclose(ratios(body), 0.02, rtol=1e-9)
    np.testing.assert_allclose(ratios(twisted(damping_ratio=[0.01, 0.05, 0.2]).modal), [0.01, 0.05, 0.2], rtol=1e-9)
    assert not twisted().modal.D.any()


def test_stations_to_draw_end_at_the_tip(body) -> None:
    eta = np.array([0.1, -0.2, 0.05])
    points = body.points(eta)
    assert points.shape == (21, 3) and not points[0].any()
    np.testing.assert_allclose(points[-1], 2.0 * body.e + body.Psi_tip @ eta - eta @ body.S_tip @ eta / 2 * body.e, atol=1e-15)
    fine = twisted(draw=2001).modal
    longer = [np.linalg.norm(np.diff(fine.points(a * eta), axis=0), axis=1).sum() - 2.0 for a in (0.2, 0.1)]
    assert abs(longer[0]) < 1e-4 and longer[0] / longer[1] == pytest.approx(16, rel=0.1)  # length is kept but for fourth order


def test_a_modal_body_is_frozen(body) -> None:
    with pytest.raises(ValueError, match="read-only"):
        body.Me[0, 0] = 1.0


def test_integration_on_the_stations_converges_to_the_exact_one(body) -> None:
    errors = []
    for count in (101, 201):
        x = np.unique(np.concatenate([np.linspace(0, 2, count), STATIONS]))
        fine = sd.Beam(x, np.interp(x, STATIONS, MASS), tuple(np.interp(x, STATIONS, row) for row in EI), MODES,
                       twist=np.interp(x, STATIONS, TWIST), integration="stations").modal
        errors.append([np.abs(getattr(fine, k) - getattr(body, k)).max() for k in ("Me", "K", "Cr0", "I0", "I2", "H1")])
    np.testing.assert_allclose(np.divide(*errors), 4, rtol=0.05)


X4 = [0, 0.5, 1, 2]
GOOD = {"stations": STATIONS, "mass_per_length": MASS, "stiffness": EI, "shapes": [sd.Shape("x", [1])]}


@pytest.mark.parametrize(("change", "message"), [
    ({"mass_per_length": [1, 2, 3]}, "mass_per_length has 3 values for 4 stations"),
    ({"stiffness": [1, 2]}, "stiffness has 2 values for 4 stations"),
    ({"stiffness": (EI[0], EI[1][:3])}, "stiffness of direction 2 has 3 values for 4 stations"),
    ({"twist": [0.1]}, "twist has 1 values for 4 stations"),
    ({"stations": [0, 1, 1, 2]}, "stations does not increase: 1 at place 2 is followed by 1"),
    ({"stations": [0.5, 1, 1.5, 2]}, "stations begins at 0.5; it must begin at 0"),
    ({"stations": STATIONS, "length": 3.0}, "stations ends at 2; it must end at 1"),
    ({"stations": [0], "mass_per_length": [1], "stiffness": [1]}, "stations has 1 value; pass two"),
    ({"length": -2.0}, "length is -2.0; pass a positive number"),
    ({"stiffness": [1, -2, 3, 4]}, "stiffness is -2 N m.2 at place 2 of 4; it must not be negative"),
    ({"mass_per_length": [1, 2, -3, 4]}, "mass_per_length is -3 kg/m at place 3 of 4"),
    ({"mass_per_length": [1, 0, 0, 1]}, "mass_per_length is zero from the station 0.7 to the station 1.1"),
    ({"stiffness": 0}, "stiffness is zero from the station 0 to the station 0.7"),
    ({"stiffness": 1e300}, "stiffness has 1e.300 at place 1 of 4; all values must be finite, below"),
    ({"stiffness": 1e-300}, "stiffness is 1e-300 N m.2; use units in which it is above 1e-30, or zero"),
    ({"mass_per_length": None}, "mass_per_length is None; pass a list of numbers"),
    ({"mass_per_length": [1, np.nan, 3, 4]}, "mass_per_length has nan at place 2 of 4"),
    ({"mass_per_length": "heavy"}, "mass_per_length is 'heavy'; pass a list of numbers"),
    ({"mass_per_length": [[1, 2, 3, 4]]}, r"mass_per_length has the shape \(1, 4\)"),
    ({"axis": "w"}, "axis is 'w'; pass 'x', 'y' or 'z'"),
    ({"integration": "coarse"}, "integration is 'coarse'; pass 'exact' or 'stations'"),
    ({"draw": 1}, "draw is 1; pass a whole number"),
    ({"damping_ratio": [0.1, 0.2]}, "damping_ratio has 2 values for 1 modes"),
    ({"damping_ratio": -0.1}, "damping_ratio is -0.1; it must not be negative"),
    ({"damping_ratio": 5}, "damping_ratio is a fraction of critical damping below 1, 5 given; 5 % is 0.05"),
    ({"damping_ratio": "none"}, "damping_ratio is .*; pass a list of numbers"),
    ({"shapes": []}, "shapes is .*; pass a list of sd.Shape"),
    ({"shapes": 0}, "shapes is 0; pass a list of sd.Shape"),
    ({"shapes": 41}, "shapes asks for 41 modes; at most 40"),
    ({"shapes": [sd.Shape("z", [1])]}, "shape 1 deflects along 'z'; pass 'x' or 'y', across the axis 'z'"),
    ({"shapes": [sd.Shape("x")]}, "either coefficients or values"),
    ({"shapes": [sd.Shape("x", [1], powers=[1], name="pin")]}, r"shape 1 \(pin\): the slope at the clamp is 1 .*must vanish"),
    ({"shapes": [sd.Shape("x", [2, 1], powers=[0, 2])]}, "the value at the clamp is 2"),
    ({"shapes": [sd.Shape("x", [1, 1], powers=[2])]}, "there are 2 coefficients and 1 powers"),
    ({"shapes": [sd.Shape("x", [1], powers=[2.5])]}, "a power is 2.5"),
    ({"shapes": [sd.Shape("x", [np.inf])]}, "shape 1: coefficients has inf at place 1"),
    ({"shapes": [sd.Shape("x", stations=X4, values=[0.1, 0.2, 0.5, 1])]}, "the value at the clamp is 0.1"),
    ({"shapes": [sd.Shape("x", stations=X4, values=[0, 0.25, 0.5, 1])]}, "slope of 0.5 at the clamp, the largest being 0.5"),
    ({"shapes": [sd.Shape("x", stations=X4, values=[0, 0, 0.5, 1], slopes=[0.2, 1, 1, 1])]}, "the slope at the clamp is 0.2"),
    ({"shapes": [sd.Shape("x", stations=X4, values=[0, 0.1, 1])]}, "values has 3 values for 4 stations"),
    ({"shapes": [sd.Shape("x", stations=X4[:3], values=[0, 0.1, 1])]}, "there are 3 values; a spline"),
    ({"shapes": [sd.Shape("x", stations=X4, values=[0, 0, 0.5, 1], curvatures=[1, 1, 1, 1])]}, "curvatures are given without"),
    ({"shapes": [sd.Shape("x", stations=[0, 0.5, 0.8, 1], values=[0, 0.2, 0.6, 1])]}, "must end at 2, the tip"),
    ({"shapes": [sd.Shape("x", stations=[0, 1, 0.5, 2], values=[0, 0.25, 0.6, 1])]}, "stations of the shape does not increase"),
    ({"shapes": [sd.Shape("x", [1, 2]), sd.Shape("y", [1]), sd.Shape("x", [2, 4])]}, "the shapes 1, 3 depend on each other"),
    ({"shapes": [sd.Shape("x", [1]), sd.Shape("x", [0])]}, "shape 2 is zero"),
])
def test_bad_input_is_reported_in_numbers(change, message) -> None:
    with pytest.raises(sd.ModelError, match=message):
        sd.Beam(**(GOOD | change))


def test_all_faults_are_reported_at_once() -> None:
    with pytest.raises(sd.ModelError) as raised:
        sd.Beam([0, 1, 2], [1, 2], [1, -1, 1], [sd.Shape("z", [1]), sd.Shape("x", [1], powers=[1])], name="mast")
    assert len(raised.value.faults) == 4 and all("beam 'mast'" in fault for fault in raised.value.faults)


def test_a_shape_adds_to_a_shape_alone() -> None:
    with pytest.raises(TypeError):
        sd.Shape("x", [1]) + 1
    assert (sd.Shape("x", [1]) + sd.Shape("y", [1], name="both")).name == "both"
