"""Random mechanisms of every kind: A, B, C_out, D against differences of x_dot on the manifold, verdicts against simulation."""

from __future__ import annotations

import numpy as np
import pytest
import sympy as sp

import symdyn as sd
from symdyn.lab.disturbance import observe
from symdyn.lab.flow import Coordinates, Flow
from symdyn.lab.linear import main, measure
from symdyn.lab.manifold import consistent_state
from symdyn.lab.mechanisms import FEATURES, MOTIONS, TOPOLOGIES, draw, kinds_of
from tests.helpers import swept

# With these every topology, motion, feature and formulation occurs; 39 is compiled to C. More of them are in the sweep.
NUMBERS = [1, 5, 6, 7, 10, 12, 14, 16, 20, 21, 23, 39]
# Verdicts on these are compared besides.
JUDGED = (0, 6, 12)


@pytest.mark.parametrize("number", swept([*range(24), 39], *NUMBERS))
def test_matrices_are_the_derivative_of_the_flow(number: int) -> None:
    result = measure(number, verdicts=number in JUDGED)
    assert result.passed, str(result)
    assert result.uncertainty < 1e-9, str(result)


def test_all_kinds_are_dealt_out() -> None:
    dealt = {kind for number in NUMBERS for kind in kinds_of(number)}
    assert dealt == {*TOPOLOGIES, *MOTIONS, *FEATURES}
    combinations = {kinds_of(number) for number in range(1000)}
    assert len(combinations) == len(TOPOLOGIES) * len(MOTIONS) * len(FEATURES)


# -- the differences themselves, against closed forms


def eigenvalues(system: sd.System, x: dict[str, float], speeds: tuple[int, ...], t: float = 0.0) -> np.ndarray:
    """Eigenvalues of the derivative of the flow at a state, in all displacements and these speeds, sorted."""
    equations = system.augmented() if system.constraints else system.embedding()
    module = equations.compile(backend="numpy")
    state = np.array([x.get(name, 0.0) for name in module.metadata.x])
    assert np.array_equal(consistent_state(module, t, state, module.default_parameters), state)
    positions, _ = Flow(module, t, state, module.default_parameters, np.zeros(0), Coordinates((), (), ())).freedoms()
    flow = Flow(module, t, state, module.default_parameters, np.zeros(0), Coordinates(tuple(range(positions)), speeds, ()))
    matrices, uncertainty = flow.matrices()
    assert uncertainty < 1e-11
    return np.sort_complex(np.linalg.eigvals(matrices.A))


def test_sleigh() -> None:
    """A knife edge binds speeds alone: three displacements, two speeds; the place along the track and its speed are zeros."""
    x, y, theta = sd.coordinates("x y theta")
    s = sd.System("sleigh")
    body = s.add_body("body", mass=1, inertia=[1, 1, 0.02], com=[0.1, 0, 0])
    s.add_joint(sd.Planar("plane", s.ground, body, [x, y, theta]))
    s.add_constraint(y.dot * sp.cos(theta) - x.dot * sp.sin(theta))
    s.add_force(body, [0, -50 * (y + sp.sin(theta) / 10), 0])
    found = eigenvalues(s, {"x_dot": 1.0}, (0, 2))
    # I = 0.02 + 0.1^2 about the knife edge, and y_dot = theta: 0.03 theta_ddot + 0.1 theta_dot + 5 (y + 0.1 theta) = 0
    roots = np.roots([0.03, 0.1, 0.5, 5])
    assert np.abs(roots[:, None] - found).min(axis=1).max() < 1e-10 and np.sum(np.abs(found) < 1e-6) == 2
    assert np.allclose(np.sort_complex(roots), [-5.631, 1.149 - 5.318j, 1.149 + 5.318j], atol=1e-3)


def test_slot_that_turns_about_a_bead_at_rest() -> None:
    """r_ddot = w^2 r, although neither the bead nor the constraint moves at the state."""
    x, y = sd.coordinates("x y")
    s = sd.System("slot", planar=True)
    rail, bead = s.add_body("rail"), s.add_body("bead", mass=2)
    s.add_joint(sd.Prismatic("along", s.ground, rail, x, axis=[1, 0]))
    s.add_joint(sd.Prismatic("across", rail, bead, y, axis=[0, 1]))
    s.add_constraint(y * sp.cos(3 * sd.t) - x * sp.sin(3 * sd.t))
    # Derivative by x alone, at 0.2 s: x = r cos(3 t), so that x_dot changes with x at fixed r_dot.
    found = eigenvalues(s, {}, (0,), t=0.2)
    slope = np.tan(0.6)
    assert np.isclose(found.sum(), -6 * slope, rtol=1e-10)


@pytest.mark.parametrize(("axis", "squared"), [(0, -1 / 3), (1, 1 / 3), (2, -1.0)])
def test_body_that_turns_about_a_principal_axis(axis: int, squared: float) -> None:
    """Euler's equations, and +-i Omega and 0 of the attitude as seen from the body: speeds are no rates of Euler parameters."""
    s = sd.System("top")
    body = s.add_body("body", mass=1, inertia=[1, 2, 3])
    s.add_joint(sd.Spherical("free", s.ground, body, orientation=sd.EulerParameters()))
    omega = 1.7
    found = eigenvalues(s, {"q_free_1": 0.8, "q_free_2": 0.6, f"omega_{'xyz'[axis]}_free": omega}, (0, 1, 2))
    nutation = np.sqrt(complex(squared)) * omega
    for expected in (nutation, -nutation, 1j * omega, -1j * omega):
        assert np.abs(found - expected).min() < 1e-6


# -- what simulation shows


@pytest.mark.parametrize(("stiffness", "damping", "word"), [
    (9.0, 0.4, "stable"), (9.0, 0.0, "neutral"), (0.0, 0.0, "drifts"), (0.0, 0.4, "neutral"), (-1e-4, 0.1, "unstable"),
    (1e-4, 0.1, "stable")])
def test_words_of_simulation(stiffness: float, damping: float, word: str) -> None:
    """m q_ddot + d q_dot + k q = 0."""
    q = sd.coordinates("q")
    s = sd.System("oscillator", planar=True)
    mass = s.add_body("mass", mass=1)
    rail = s.add_joint(sd.Prismatic("rail", s.ground, mass, q, axis=[1, 0]))
    s.add_joint_force(rail, -stiffness * q - damping * q.dot)
    module = s.embedding().compile(backend="numpy")
    flow = Flow(module, 0.0, np.zeros(2), np.zeros(0), np.zeros(0), Coordinates((0,), (0,), ()))
    assert observe(flow).word == word


def test_command_says_what_fails(capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("symdyn.lab.linear.BOUND", 0.0)
    assert main(["--only", "9"]) == 1
    printed = capsys.readouterr().out
    assert "FAIL" in printed and "differences give" in printed and "1 mechanisms, 1 fail" in printed


def test_same_number_draws_the_same_mechanism() -> None:
    one, other = draw(9), draw(9)
    assert np.array_equal(one.x, other.x) and one.params == other.params and one.kinds == other.kinds
    assert not np.array_equal(one.x, draw(9, seed=1).x)
