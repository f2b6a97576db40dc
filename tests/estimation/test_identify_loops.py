"""Inertial parameters of mechanisms with closed loops, from the forces along the speeds that are driven."""

from __future__ import annotations

import re
from functools import cache
from typing import Any

import numpy as np
import pytest
from scipy.linalg import null_space

import symdyn as sd
from symdyn.errors import ArgumentError

T = np.linspace(0, 6, 601)
REAL = {"m1": 1.2, "m2": 2.6, "lc2": 0.9, "I2": 0.8, "m3": 1.1, "I3": 0.4}


@cache
def driven() -> Any:
    system = sd.systems.four_bar()
    system.add_joint_force("hinge1", sd.inputs("tau"))
    return system.augmented().compile()


@cache
def linkage() -> Any:
    return sd.systems.four_bar().augmented().compile()


@cache
def motion(seed: int = 0) -> tuple[np.ndarray, ...]:
    """Coordinates, speeds, accelerations of the linkage and the torque at its crank, the others are not driven."""
    a = np.random.default_rng(seed).normal(size=5)
    torque = 25 + 15 * np.sin(np.outer(T, 2 * np.pi * np.array([0.3, 0.7, 1.1, 1.7, 2.3]))) @ a
    q = driven().consistent({"q1": 0.5}, keep=["q1"])[0]
    sol = driven().simulate(T, q, params=REAL, inputs={"tau": (T, torque)}, rtol=1e-11)
    assert sol.success
    ud = driven().evaluate("rhs", T, sol.x, REAL, torque[:, None])[:, 3:]
    return sol.q, sol.u, ud, torque[:, None] * [1.0, 0.0, 0.0]


def crank(values: Any, seed: int) -> np.ndarray:
    """The torque at the crank by base parameters, by the power of all forces of the tree: tau q1_dot = u^T Y pi."""
    q, u, ud, _ = motion(seed)
    Y = linkage().evaluate("base_regressor", T, np.hstack([q, u]), ud=ud)
    return np.einsum("tu,tub,b->t", u, Y, list(values)) / u[:, 0]


def test_identified_parameters_predict_another_motion() -> None:
    q, u, ud, tau = motion()
    found = sd.identify(linkage(), sd.MeasuredMotion(T, q, tau, u, ud), noise=1e-3)
    # The crank's torque determines fewer than the six base parameters of the tree; these predict it in another motion.
    assert found.undetermined and len(found.values) == 6 and found.degrees == len(T) - 6 + len(found.undetermined)
    turning = np.abs(motion(1)[1][:, 0]) > 0.5
    exact = motion(1)[3][:, 0]
    assert np.abs(crank(found.values.values(), 1) - exact)[turning].max() < 1e-5 * np.abs(exact).max()
    start = linkage().evaluate("base_parameters", 0.0, np.zeros(6))
    assert np.abs(crank(start, 1) - exact)[turning].max() > 0.05 * np.abs(exact).max()
    assert found.residuals[0].shape == (len(T), 1) and np.abs(found.residuals[0]).max() < 1e-6


def test_open_combinations_are_named_with_all_their_parts() -> None:
    """The parts are those of the null space of the forces along the motion that the loop allows, columns counted alike."""
    q, u, ud, tau = motion()
    found = sd.identify(linkage(), sd.MeasuredMotion(T, q, tau, u, ud), noise=1e-3)
    Y = linkage().evaluate("base_regressor", T, np.hstack([q, u]), ud=ud)
    rows = linkage().evaluate("C_r", T, np.hstack([q, u]))
    A = np.array([null_space(C)[:, 0] @ Y[k] for k, C in enumerate(rows)])
    V = null_space(A / np.linalg.norm(A, axis=0), rcond=1e-9)[:, 0]
    expected = {name: share for name, share in zip(found.values, V / V[np.abs(V).argmax()], strict=True) if abs(share) > 1e-3}
    text, = found.undetermined
    parts = {name: float(sign + share) for sign, share, name in re.findall(r"(-?) ?([\d.e-]+) (\w+)", text)}
    assert len(parts) == 6 and parts == pytest.approx(expected, rel=5e-3)


def test_covariance_of_noisy_torques() -> None:
    """The errors of the predicted torque in many draws are as large as the covariance states, behind a filter as well."""
    q, u, ud, tau = motion()
    names, chosen = list(sd.identify(linkage(), sd.MeasuredMotion(T, q, tau, u, ud), noise=0.2).values), slice(0, None, 40)
    open_ones = sd.identify(linkage(), sd.MeasuredMotion(T, q, tau, u, ud), noise=0.2)
    assert np.isnan([open_ones.deviations[n] for n in names]).any()
    errors = []
    for seed in range(40):
        noise = 0.2 * np.random.default_rng(seed).normal(size=tau.shape)
        found = sd.identify(linkage(), sd.MeasuredMotion(T, q, tau + noise, u, ud), noise=0.2)
        errors.append(found.residuals[0][:, 0].std())
    # Behind Z the noise of all three forces is one of deviation 0.2, since the columns of Z have length 1.
    assert np.mean(errors) == pytest.approx(0.2, rel=0.02)
    predicted = crank(found.values.values(), 0)[chosen]
    assert np.abs(predicted - tau[chosen, 0])[np.abs(u[chosen, 0]) > 0.5].max() < 0.5
    filtered = sd.identify(linkage(), sd.MeasuredMotion(T, q, tau, u, ud, cutoff=8.0), noise=0.2)
    turning = np.abs(u[:, 0]) > 0.5
    assert np.abs(crank(filtered.values.values(), 0) - tau[:, 0])[turning].max() < 1e-3 * np.abs(tau).max()


def test_bodies_that_can_exist() -> None:
    q, u, ud, tau = motion()
    inertia = linkage().evaluate("inertial_parameters", 0.0, np.zeros(6)).reshape(3, 10)
    for row in inertia:  # bars of some width and thickness, in place of bodies that turn about z alone
        away = row[1] ** 2 / row[0]
        row[4:] = [0.3 * (row[9] - away), 0, 0, 0.8 * (row[9] - away) + away, 0, row[9]]
    nominal = dict(zip(linkage().metadata.bodies, inertia, strict=True))
    found = sd.identify(linkage(), sd.MeasuredMotion(T, q, tau, u, ud), noise=1e-2, consistent=True, nominal=nominal)
    assert all(np.linalg.eigvalsh(found.pseudo_inertia(body)).min() > 0 for body in nominal)
    assert np.abs(found.residuals[0]).max() < 0.01 * np.abs(tau).max()


def test_faults() -> None:
    q, u, ud, tau = motion()
    data = sd.MeasuredMotion(T, q, tau, u, ud)
    with pytest.raises(ArgumentError, match=r"noise is not given, and the mechanism has constraints, whose forces hide a part"):
        sd.identify(linkage(), data)
    with pytest.raises(ArgumentError, match=r"motion_noise was given, and the mechanism has constraints, whose forces hide how"):
        sd.identify(linkage(), data, noise=1.0, motion_noise=(1, 1, 1))
    with pytest.raises(ArgumentError, match=r"q of motion 1 misses the constraint hinge4_x at t = .* s by 0\.14 of the"):
        sd.identify(linkage(), sd.MeasuredMotion(T, q + [0, 0, 0.3], tau, u, ud), noise=1.0)
