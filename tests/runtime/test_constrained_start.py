"""Where constrained motion begins: consistent states, near a guess and with what must stay; what is said of others."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from symdyn.errors import ArgumentError
from tests.runtime.constrained import module

LOOPS = ["pendulum_absolute", "four_bar", "spatial_slider_crank", "bricard", "rolling_disc", "double_wishbone",
         "andrews_squeezer"]


def initial(loop: Any) -> tuple[np.ndarray, np.ndarray]:
    start = loop.metadata.initial
    return np.array([start.get(n, 0.0) for n in loop.metadata.q]), np.array([start.get(n, 0.0) for n in loop.metadata.u])


def residuals(loop: Any, q: np.ndarray, u: np.ndarray, **of: Any) -> float:
    x = np.concatenate([q, u, np.zeros(loop.metadata.sizes.z)])
    return max(float(np.abs(loop.evaluate(name, of.get("t", 0.0), x, of.get("params"))).max()) for name in ("C", "C_dot"))


# -- consistent states


@pytest.mark.parametrize("name", LOOPS)
def test_from_rough_guesses(name: str) -> None:
    loop = module(name)
    random = np.random.default_rng(3)
    q0, u0 = initial(loop)
    for _ in range(5):
        guess = q0 + 0.2 * random.standard_normal(len(q0))
        for group in loop.metadata.unit_groups:
            places = [loop.metadata.q.index(n) for n in group]
            guess[places] /= np.linalg.norm(guess[places])
        q, u = loop.consistent(guess, u0 + random.standard_normal(len(u0)))
        assert residuals(loop, q, u) < 1e-10
        assert loop.simulate((0, 1e-3), q=q, u=u).success


@pytest.mark.parametrize("backend", ["c", "numpy"])
def test_consistent_states_stay_as_they_are(backend: str) -> None:
    pendulum = module("pendulum_absolute", backend)
    q, u = pendulum.consistent([0.6, -0.8], [0.8, 0.6])
    np.testing.assert_allclose(q, [0.6, -0.8], rtol=0, atol=1e-15)
    np.testing.assert_allclose(u, [0.8, 0.6], rtol=0, atol=1e-15)


def test_the_change_is_the_smallest() -> None:
    """In the metric of the mass: here distances in the plane."""
    q, u = module("pendulum_absolute").consistent([1.2, 1.6], [1.0, 1.0])
    np.testing.assert_allclose(q, [0.6, 0.8], rtol=0, atol=1e-9)
    np.testing.assert_allclose(u, [0.16, -0.12], rtol=0, atol=1e-9)


def test_the_guess_decides_the_branch() -> None:
    loop = module("four_bar")
    up, down = (loop.consistent({"q1": 1.0, "q2": q2, "q3": q3}, keep=["q1"])[0] for q2, q3 in ((-0.5, -1.5), (-2.0, 2.0)))
    assert up[0] == down[0] == 1.0 and up[2] < 0 < down[2] and residuals(loop, up, np.zeros(3)) < 1e-12
    np.testing.assert_allclose(up[2], -down[2], rtol=0, atol=1e-12)


def test_what_must_stay_stays() -> None:
    loop = module("four_bar")
    q, u = loop.consistent({"q1": 0.7}, {"q1_dot": 3.0, "q2_dot": 5.0}, keep=["q1", "q1_dot"])
    assert (q[0], u[0]) == (0.7, 3.0) and residuals(loop, q, u) < 1e-12
    disc = module("rolling_disc")
    q, u = disc.consistent({"theta": 1.0, "z": 0.5}, {"phi_dot": 2.0}, keep=["theta", "phi_dot"])
    assert q[disc.metadata.q.index("theta")] == 1.0 and u[disc.metadata.u.index("phi_dot")] == 2.0
    assert residuals(disc, q, u) < 1e-12


def test_parameters_and_time() -> None:
    loop, lifted = module("four_bar"), module("driven")
    params = {"d": 2.2, "l2": 1.9}
    q, u = loop.consistent(params=params)
    assert residuals(loop, q, u, params=params) < 1e-12 < 1e-3 < residuals(loop, q, u)
    q, u = lifted.consistent(t=0.5)
    np.testing.assert_allclose(q, [np.sqrt(0.75), 0.5], rtol=0, atol=1e-12)
    np.testing.assert_allclose(u, [-0.5 / np.sqrt(0.75), 1.0], rtol=0, atol=1e-12)
    assert lifted.simulate((0.5, 0.6), q=q, u=u).success


def test_from_a_stretched_guess() -> None:
    """All bars along x: no first-order change moves the loop's end across."""
    loop = module("four_bar")
    q, u = loop.consistent([0.0, 0.0, 0.0])
    assert residuals(loop, q, u) < 1e-10


def test_free_systems_and_unit_vectors() -> None:
    q, u = module("pendulum").consistent([0.3], [1.0])
    assert (q.tolist(), u.tolist()) == ([0.3], [1.0])
    q, _ = module("top").consistent({"p0": 0.6, "p1": 0.8 + 1e-8})
    assert abs(np.linalg.norm(q[3:]) - 1) < 1e-15


@pytest.mark.parametrize(("asked", "message"), [
    ({"q": {"q1": 1.0, "q2": 0.0}, "keep": ["q1", "q2"]},
     "no consistent positions .* with q1, q2 kept: .* hinge4_[xy] by .*let go"),
    ({"u": {"q1_dot": 1.0}, "keep": ["q1_dot", "q2_dot"]}, "no consistent speeds .* with q1_dot, q2_dot kept: .* hinge4_y by"),
    ({"params": {"d": 10.0}}, "no consistent positions found near the guess: .*hinge4_x by .*begin with another guess"),
    ({"keep": ["q9"]}, "keep names q9; there are q1, q2, q3, q1_dot"), ({"keep": "q"}, "keep names q;"),
    ({"q": [1.0]}, "needed are 3 numbers"), ({"keep": 3}, "pass coordinates and speeds as keep, by name or symbol, .*found 3"),
    ({"t": "a"}, "pass a finite number of seconds as t, found 'a'"), ({"t": None}, "seconds as t, found None"),
    ({"t": np.nan}, "seconds as t, found nan")])
def test_no_such_state(asked: dict[str, Any], message: str) -> None:
    with pytest.raises(ArgumentError, match=message):
        module("four_bar").consistent(**asked)


def test_nothing_kept() -> None:
    loop = module("four_bar")
    for with_none, plain in zip(loop.consistent(keep=None), loop.consistent(), strict=True):
        np.testing.assert_array_equal(with_none, plain)


# -- states that are not


@pytest.mark.parametrize("method", ["dop853", "LSODA", "ggl"])
def test_inconsistent_starts_are_rejected(method: str) -> None:
    loop = module("four_bar")
    q, u = loop.consistent(u={"q1_dot": 1.0}, keep=["q1_dot"])
    with pytest.raises(ArgumentError, match=r"initial positions violate hinge4_[xy] by .*module.consistent\(q, u, params\)"):
        loop.simulate(q=q + [0.01, 0, 0], u=u, method=method)
    with pytest.raises(ArgumentError, match=r"initial speeds violate hinge4_[xy] by .* \(of its speed\)"):
        loop.simulate(q=q, u=u + [0.01, 0, 0], method=method)
    with pytest.raises(ArgumentError, match=r"initial speeds violate lift by -1 .*params, t=0.5\)"):
        module("driven").simulate((0.5, 1.0), q=[np.sqrt(0.75), 0.5], u=[0.0, 0.0], method=method)


@pytest.mark.parametrize(("backend", "method"), [("c", "dop853"), ("numpy", "DOP853")])
def test_nearly_consistent_ones_are_projected(backend: str, method: str) -> None:
    loop = module("four_bar", backend)
    q, u = loop.consistent(u={"q1_dot": 1.0}, keep=["q1_dot"])
    for t in (np.array([0.0, 0.1]), (0, 0.1), (0.0, 0.0)):
        solution = loop.simulate(t, q=q + 1e-7, u=u + 1e-7, method=method)
        assert np.abs(solution.constraint_violation).max() < 1e-12 and np.abs(solution.velocity_violation).max() < 1e-12
        assert 1e-9 < np.abs(solution.x[0] - np.concatenate([q, u])).max() < 1e-6
    kept = loop.simulate((0, 0.1), q=q + 1e-7, u=u + 1e-7, method=method, stabilization="none")
    np.testing.assert_array_equal(kept.x[0], np.concatenate([q, u]) + 1e-7)


def test_rest_is_consistent() -> None:
    loop = module("four_bar")
    q, u = loop.consistent(u=[1.0, 0.0, 0.0])
    assert loop.simulate((0, 0.01), q=q, u=1e-14 * u).success and loop.simulate((0, 0.01), q=q).success
