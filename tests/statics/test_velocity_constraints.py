"""Linear equations under velocity constraints against closed forms: sleigh, rolling disc, wheelset, and the benchmark bicycle."""

from __future__ import annotations

import functools
import math
from typing import Any

import numpy as np
import pytest
import scipy.linalg
import sympy as sp

import symdyn as sd
from symdyn import systems
from tests.helpers import swept

# Weave and capsize speeds of the benchmark bicycle, m/s. Source: Meijaard, Papadopoulos, Ruina and Schwab, Linearized dynamics
# equations for the balance and steer of a bicycle, Proc. R. Soc. A 463, 2007.
WEAVE, CAPSIZE = 4.29238253634111, 6.02426201538837


@functools.cache
def sleigh() -> Any:
    return systems.sleigh().augmented().compile()


def sliding(v: float) -> dict[str, float]:
    """Along the line at v, on it."""
    return {**dict.fromkeys(sleigh().metadata.x, 0.0), "x_dot": v}


def sleigh_polynomial(v: float = 1.0) -> list[float]:
    """With y_dot = v theta and moments about the edge: (I + m a^2) theta_ddot + m a v theta_dot + k a (y + a theta) = 0."""
    m, I, a, k = 1.0, 0.02, 0.1, 50.0
    return [I + m * a**2, m * a * v, k * a**2, k * a * v]


@functools.cache
def disc() -> Any:
    return systems.rolling_disc().augmented().compile()


DISC = {"g": 1.0, "m": 1.0, "R": 1.0, "I_t": 0.25, "I_a": 0.5}


def upright(w: float) -> dict[str, float]:
    """The disc stands upright and rolls straight on along x; nothing is left to the initial values."""
    return {**dict.fromkeys(disc().metadata.x, 0.0), "z": 1.0, "theta": math.pi / 2, "x_dot": w, "phi_dot": -w}


@functools.cache
def wheelset() -> Any:
    """Two cones on one axle that roll on rails 2 b apart without creep: lateral position y, yaw psi, turning phi.

    The cones widen towards the middle of the track: at y to the left the left wheel rolls on the radius r + gamma y and the right
    one on r - gamma y. No wheel slides along the rail, and the axle does not slide along itself.
    """
    x, y, psi, phi = sd.coordinates("x y psi phi")
    m, I_z, I_y, gamma, r, b = sd.parameters("m I_z I_y gamma r b", positive=True)
    s = sd.System("wheelset")
    carrier = s.add_body("carrier", mass=m, inertia=[I_y, I_y, I_z])
    axle = s.add_body("axle", mass=0, inertia=[0, I_y, 0])
    s.add_joint(sd.Planar("track", s.ground, carrier, [x, y, psi]))
    s.add_joint(sd.Revolute("bearing", carrier, axle, phi, axis=[0, 1, 0]))
    forward = x.dot * sp.cos(psi) + y.dot * sp.sin(psi)
    s.add_constraint(-x.dot * sp.sin(psi) + y.dot * sp.cos(psi), name="no creep across")
    s.add_constraint(forward - b * psi.dot - (r + gamma * y) * phi.dot, name="no creep of the left wheel")
    s.add_constraint(forward + b * psi.dot - (r - gamma * y) * phi.dot, name="no creep of the right wheel")
    s.defaults = {m: 1500.0, I_z: 800.0, I_y: 90.0, gamma: 0.05, r: 0.46, b: 0.75}
    return s.augmented().compile()


# -- the benchmark bicycle


@functools.cache
def bicycle() -> Any:
    """With numbers in place of parameters: a verdict counts the last digit of every parameter as unknown."""
    system = systems.bicycle()
    return system.augmented().compile(backend="numpy", specialize=system.defaults)


def riding(v: float) -> dict[str, float]:
    """Upright, straight on along x at v."""
    return {**dict.fromkeys(bicycle().metadata.x, 0.0), "z": -0.3, "x_dot": v, "rear_dot": -v / 0.3, "front_dot": -v / 0.35}


def published(v: float) -> np.ndarray:
    """A of [lean, steer, lean rate, steer rate]. Source: Meijaard et al. 2007, as SymPy's test_bicycle has it to 14 digits."""
    return np.array([[0, 0, 1, 0], [0, 0, 0, 1],
                     [9.48977444677355, -0.891197738059089 * v**2 - 0.571523173729245, -0.105522449805691 * v,
                      -0.330515398992311 * v],
                     [11.7194768719633, -1.97171508499972 * v**2 + 30.9087533932407, 3.67680523332152 * v,
                      -3.08486552743311 * v]])


# -- what the tests share


def nonzero(values: np.ndarray, level: float = 1e-3) -> np.ndarray:
    """Eigenvalues that are not zero, sorted; a multiple zero may be split by a root of the rounding."""
    kept = values[np.abs(values) > level]
    return kept[np.lexsort((kept.imag, kept.real))]


def assert_alike(found: Any, expected: Any, relative: float = 1e-9) -> None:
    """Two sets of complex numbers are the same."""
    found, expected = list(np.atleast_1d(found).astype(complex)), np.atleast_1d(expected).astype(complex)
    assert len(found) == len(expected)
    for value in expected:
        nearest = int(np.argmin(np.abs(np.array(found) - value)))
        assert abs(found.pop(nearest) - value) <= relative * max(abs(value), 1e-300)


def assert_vanishes(A: np.ndarray, factors: list[np.ndarray]) -> None:
    """The product of matrices is zero but for rounding, 1e-9 of what its factors could make."""
    product = functools.reduce(np.matmul, factors, np.eye(len(A)))
    assert np.abs(product).max() <= 1e-9 * np.prod([max(1.0, np.abs(f).max()) for f in factors])


# -- sleigh


def test_the_sleigh_is_unstable_as_its_characteristic_polynomial_says() -> None:
    """-5.63, 1.149 +- 5.318i; besides x and the speed, which nothing holds: two zeros."""
    lin = sleigh().linearize(sliding(1.0))
    assert lin.A.shape == (5, 5) and lin.M.shape == (2, 2) and lin.K.shape == (2, 3) and lin.Z.shape == (3, 3)
    assert set(lin.states) == {"x", "y", "theta", "x_dot", "theta_dot"} and lin.coordinates == ("x", "y", "theta")
    roots = np.roots(sleigh_polynomial())
    assert np.allclose(np.sort(roots.real), [-5.630, 1.149, 1.149], atol=1e-3)
    assert_alike(nonzero(lin.eigenvalues), roots)
    assert np.allclose(np.poly(lin.A), np.array([*sleigh_polynomial(), 0, 0]) / sleigh_polynomial()[0], rtol=1e-9, atol=1e-9)
    assert lin.verdict == "unstable"
    (pair,) = [m for m in lin.modes() if m.eigenvalue.imag]
    assert pair.kind == "unstable" and abs(pair.eigenvalue - roots[roots.imag > 0][0]) < 1e-9
    assert sleigh().stability(sliding(1.0)).verdict == "unstable"


def test_the_sleighs_matrix_entry_by_entry() -> None:
    """y' = v theta, v' = 0, (I + m a^2) theta'' = -m a v theta' - k a (y + a theta): written down by hand."""
    lin = sleigh().linearize(sliding(1.0))
    order = [lin.states.index(n) for n in ("x", "y", "theta", "x_dot", "theta_dot")]
    J = 0.02 + 0.01
    expected = np.array([[0, 0, 0, 1, 0], [0, 0, 1, 0, 0], [0, 0, 0, 0, 1], [0, 0, 0, 0, 0],
                         [0, -5 / J, -0.5 / J, 0, -0.1 / J]])
    assert np.allclose(lin.A[np.ix_(order, order)], expected, rtol=1e-9, atol=1e-9)


def test_outputs_of_the_sleigh_see_the_displacement_across_the_edge() -> None:
    """The edge binds the speed across it, not the displacement: rows of C_out are (0, 1, 0, ...) and (0, 1, a, ...)."""
    lin = sleigh().linearize(sliding(1.0))
    order = [lin.states.index(n) for n in ("x", "y", "theta", "x_dot", "theta_dot")]
    assert lin.outputs == ("track", "centre")
    assert np.allclose(lin.C_out[:, order], [[0, 1, 0, 0, 0], [0, 1, 0.1, 0, 0]], atol=1e-14)


@pytest.mark.parametrize("v", [-3.0, -0.5, 0.3, 2.0, 7.0])
def test_a_sleigh_at_other_speeds(v: float) -> None:
    """Hurwitz: m a v k a^2 is less than (I + m a^2) k a v where v > 0, and where v < 0 coefficients are negative: unstable."""
    lin = sleigh().linearize(sliding(v))
    assert_alike(nonzero(lin.eigenvalues), np.roots(sleigh_polynomial(v)))
    assert lin.verdict == "unstable"


def test_a_sleigh_without_a_force_neither_returns_nor_is_it_stable() -> None:
    """Forward lambda = -m a v / (I + m a^2) and zeros; y' = v theta alone would drift. Backward it turns round: unstable."""
    ahead, back = (sleigh().linearize(sliding(v), params={"k": 0.0}) for v in (1.0, -1.0))
    assert_alike(nonzero(ahead.eigenvalues), [-0.1 / 0.03])
    assert_alike(nonzero(back.eigenvalues), [0.1 / 0.03])
    assert ahead.verdict == "drifts" and back.verdict == "unstable"


def test_the_sleighs_motion_is_that_of_its_linear_equations() -> None:
    """From a disturbance of 1e-6 the simulation follows exp(A t) over 2 s, in which it grows fivefold."""
    lin = sleigh().linearize(sliding(1.0))
    T, start = lin.tangent(), np.zeros(5)
    start[lin.states.index("y")] = 1e-6
    at = lin.x + T @ start
    sol = sleigh().simulate((0, 2.0), at[:3], at[3:], rtol=1e-12, atol=1e-16)
    end = scipy.linalg.expm(2.0 * lin.A) @ start
    found = sol.x[-1] - np.array([2.0, 0, 0, 1, 0, 0])
    assert np.allclose(found[[1, 2, 5]], (T @ end)[[1, 2, 5]], rtol=1e-6, atol=1e-12) and np.abs(found).max() > 5e-6


# -- rolling disc


@pytest.mark.parametrize("w", [0.2, 0.5, 1.0, 3.0, -2.0])
def test_a_disc_that_rolls_straight_on(w: float) -> None:
    """lambda^2 = (4 - 12 w^2) / 5 for r = m = g = 1, all others 0. Source: Neimark and Fufaev; stable where w^2 > 1/3."""
    lin = disc().linearize(upright(w), params=DISC)
    squared = (4 - 12 * w**2) / 5
    root = np.sqrt(complex(squared))
    assert lin.A.shape == (8, 8) and lin.M.shape == (3, 3) and lin.K.shape == (3, 5)
    assert_alike(nonzero(lin.eigenvalues), [root, -root])
    # All others are zero, in chains of three at most (y after the heading after its rate): A^3 (A^2 - lambda^2) = 0.
    A = lin.A
    assert_vanishes(A, [A, A, A, A @ A - squared * np.eye(8)])
    assert np.isclose(np.trace(A @ A), 2 * squared, rtol=1e-9)
    assert lin.verdict == ("unstable" if w**2 < 1 / 3 else "drifts")
    moving = [m for m in lin.modes() if m.kind != "zero"]
    assert sorted(m.kind for m in moving) == (["oscillation"] if w**2 > 1 / 3 else ["real", "unstable"])
    assert np.isclose(moving[-1].omega, abs(root), rtol=1e-9)


def test_a_disc_at_rest_falls_whatever_its_heading() -> None:
    """lambda = +- sqrt(4 g / (5 r)): the force of the contact is in the stiffness, and x, y are no axes of the disc."""
    for heading in (0.0, 0.7, 2.0):
        lin = disc().linearize({**upright(0.0), "psi": heading}, params=DISC)
        assert_alike(nonzero(lin.eigenvalues), [np.sqrt(0.8), -np.sqrt(0.8)])
        assert lin.verdict == "unstable"


@pytest.mark.parametrize("turn", [0.4, *swept([1.5])])
def test_a_disc_that_rolls_in_a_circle(turn: float) -> None:
    """The contact goes round a circle while the equations are constant along the disc: the lean swings with the closed form.

    For lean theta, Omega = psi_dot and omega_3 along the disc's axis, steady where (I_a + m R^2) Omega omega_3 = I_t Omega^2 cos
    theta - m g R cos theta / sin theta. Multipliers over one turn are compared, which no choice of axes changes.
    """
    theta = 1.2
    omega_3 = (0.25 * turn**2 * math.cos(theta) - math.cos(theta) / math.sin(theta)) / (1.5 * turn)
    squared = circling(theta, turn, omega_3)
    period = 2 * math.pi / turn
    found = disc().stability(circular_state(theta, turn, omega_3), params=DISC, period=period)
    if found.motion is not None:  # the motion in question, not one near it that closes in phi, too
        assert np.isclose(found.motion[1][0][disc().metadata.x.index("theta")], theta, rtol=1e-9)
    expected = np.exp(np.sqrt(complex(squared)) * period)
    assert squared < 0 and np.abs(np.exp(np.asarray(found.exponents) * period) - expected).min() < 1e-9
    assert found.verdict == "drifts" and found.kind in ("steady motion", "periodic motion")


def circular_state(theta: float, turn: float, omega_3: float) -> dict[str, float]:
    """Coordinates and speeds of a disc of radius 1 at psi = 0 whose lean is constant."""
    return {**dict.fromkeys(disc().metadata.x, 0.0), "z": math.sin(theta), "theta": theta, "psi_dot": turn,
            "phi_dot": omega_3 - turn * math.cos(theta), "x_dot": -omega_3}


def circling(theta: float, turn: float, omega_3: float) -> float:
    """lambda^2 of the lean of a thin disc with r = m = g = 1 that rolls in a circle, from its equations about the contact.

    In the axes of the lean (1: the tangent about which it leans, 2: in the disc's plane, 3: its axis), with omega = (theta',
    Omega sin theta, omega_3), the balance of moments about the contact point gives
        (I_t + 1) theta'' = I_t Omega^2 s c - (I_a + 1) Omega omega_3 s - c
        I_t (Omega s)' = (I_a omega_3 - I_t Omega c) theta'
        (I_a + 1) omega_3' = Omega s theta'
    """
    th, rate, W, n = sp.symbols("th rate W n")
    I_t, I_a = sp.Rational(1, 4), sp.Rational(1, 2)
    s, c = sp.sin(th), sp.cos(th)
    lean = (I_t * W**2 * s * c - (I_a + 1) * W * n * s - c) / (I_t + 1)
    spin = W * s * rate / (I_a + 1)
    heading = ((I_a * n - I_t * W * c) * rate / I_t - W * c * rate) / s
    at = {th: theta, rate: 0, W: turn, n: omega_3}
    J = sp.Matrix([rate, lean, heading, spin]).jacobian([th, rate, W, n]).subs(at)
    return float(J[1, 0] + J[1, 2] * J[2, 1] + J[1, 3] * J[3, 1])


# -- wheelset


def test_klingels_wheelset_hunts() -> None:
    """omega = v sqrt(gamma / (r b)). Source: Klingel 1883; Knothe and Stichel, Rail Vehicle Dynamics, section 5.1."""
    v = 20.0
    lin = wheelset().linearize({"x_dot": v, "phi_dot": v / 0.46})
    omega = v * math.sqrt(0.05 / (0.46 * 0.75))
    hunting, = [m for m in lin.modes() if m.kind != "zero"]
    assert hunting.kind == "oscillation" and np.isclose(hunting.omega, omega, rtol=1e-9) and abs(hunting.damping) < 1e-9
    assert np.isclose(hunting.frequency, omega / (2 * math.pi), rtol=1e-9)
    assert lin.A.shape == (5, 5) and lin.M.shape == (1, 1)
    assert_alike(nonzero(lin.eigenvalues), [1j * omega, -1j * omega])
    # y leads: psi = y_dot / v.
    T = lin.tangent() @ hunting.right
    assert abs(T[2] / T[1] - 1j * omega / v) < 1e-9
    assert lin.verdict == "drifts"  # a faster one runs ahead


@pytest.mark.parametrize("gamma", [-0.05, 0.0])
def test_a_wheelset_with_the_cones_turned_round_leaves_the_track(gamma: float) -> None:
    """lambda = +- v sqrt(-gamma / (r b)); cylinders keep their yaw and leave straight on, y' = v psi."""
    lin = wheelset().linearize({"x_dot": 20.0, "phi_dot": 20.0 / 0.46}, params={"gamma": gamma})
    rate = 20.0 * math.sqrt(-gamma / (0.46 * 0.75))
    assert_alike(nonzero(lin.eigenvalues), [rate, -rate] if gamma else [])
    assert lin.verdict == ("unstable" if gamma else "drifts")


# -- bicycle


@pytest.mark.parametrize("v", [*swept([0.0, 1.0, 2.0, 3.0, 4.0]), 5.0, *swept([6.0, 7.0, 8.5, 10.0])])
def test_the_benchmark_bicycle_in_all_states(v: float) -> None:
    """The published A(v) holds for lean and steer, whatever the six other states are; these only add up what lean and steer do.

    With S the rows of lean and steer and their rates: S T A = A(v) S T, and A is nilpotent where all of them are zero.
    """
    lin = bicycle().linearize(riding(v))
    assert lin.A.shape == (10, 10) and lin.M.shape == (3, 3) and lin.K.shape == (3, 7)
    names = list(bicycle().metadata.x)
    S = lin.tangent()[[names.index(n) for n in ("lean", "steer", "lean_dot", "steer_dot")]]
    size = max(1.0, np.abs(lin.A).max())
    assert np.abs(S @ lin.A - published(v) @ S).max() <= 1e-9 * size
    rest = scipy.linalg.null_space(S)
    inner = rest.T @ lin.A @ rest
    assert inner.shape == (6, 6) and np.abs(inner @ inner).max() <= 1e-9 * size**2
    assert np.abs(lin.A @ rest - rest @ inner).max() <= 1e-9 * size
    assert_alike(nonzero(lin.eigenvalues), np.linalg.eigvals(published(v)))
    assert all(m.kind == "zero" or abs(m.eigenvalue) > 1e-3 for m in lin.modes())
    assert lin.verdict == ("drifts" if WEAVE < v < CAPSIZE else "unstable")


@pytest.mark.parametrize(("v", "grows"), [(WEAVE - 1e-6, True), (WEAVE + 1e-6, False), (CAPSIZE - 1e-5, False),
                                          (CAPSIZE + 1e-5, True)])
def test_weave_and_capsize_speeds_of_the_bicycle(v: float, grows: bool) -> None:
    """4.29238253634111 and 6.02426201538837 m/s. Source: Meijaard et al. 2007."""
    lin = bicycle().linearize(riding(v))
    assert lin.verdict == ("unstable" if grows else "drifts")


def test_the_bicycles_modes_are_weave_capsize_and_castering() -> None:
    """At 5 m/s the two oscillating and the two real ones of the published table, each to its eigenvalue."""
    modes = [m for m in bicycle().linearize(riding(5.0)).modes() if m.kind != "zero"]
    values = np.linalg.eigvals(published(5.0))
    assert_alike([m.eigenvalue for m in modes], values[values.imag >= 0])
    assert sorted(m.kind for m in modes) == ["oscillation", "real", "real"]
