"""The woodpecker toy, a sleeve with play on a pole and a bird on a spring: its periodic motion with impacts, stick and slip.

Source: Leine, van Campen and Glocker, Nonlinear dynamics and modeling of various wooden toys with impact and friction, J. Vib.
Control 9, 2003, after Pfeiffer (1984) and Glocker (1995): the model linear in the angles, and its numbers.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
import pytest
from scipy.linalg import expm
from scipy.optimize import brentq

import symdyn as sd
from symdyn.runtime.building.compiler import find_compiler

pytestmark = pytest.mark.skipif(find_compiler() is None, reason="no C compiler here")

SLEEVE, SLEEVE_J, BIRD, BIRD_J, SPRING, G, MU = 3e-4, 5e-9, 4.5e-3, 7e-7, 0.0056, 9.81, 0.3
POLE_R, SLEEVE_R, HALF, ARM, REACH, BEAK_H, BEAK = 0.0025, 0.0031, 0.0058, 0.010, 0.015, 0.02, 0.0201
# Data of the beak, the lower and the upper edge of the sleeve: gap at zero angles, its derivative by [y, sleeve, bird], that of
# the way along the pole, restitution.
EDGES = {"beak": (ARM + REACH - BEAK - POLE_R, [0, 0, -BEAK_H], [1, ARM, REACH - BEAK], 0.5),
         "low": (SLEEVE_R - POLE_R, [0, HALF, 0], [1, SLEEVE_R, 0], 0.0),
         "up": (SLEEVE_R - POLE_R, [0, -HALF, 0], [1, SLEEVE_R, 0], 0.0)}


@cache
def woodpecker() -> Any:
    """The woodpecker of the catalogue, in which points without mass on slides follow the edges; motion without contact is
    linear."""
    return sd.systems.woodpecker_toy().compile()


@cache
def orbit() -> Any:
    """From the motion that a start settles to, in the flight after the upper edge."""
    start = [0, -(SLEEVE_R - POLE_R) / HALF, -0.2788], [-0.3411, 0, -7.4583]
    run = woodpecker().simulate((0, 3), *start, rtol=1e-10)
    flight = [t for t, mode in run.contacts["up"].switches if mode == "open"][-1] + 0.01
    settled = woodpecker().simulate((0, flight), *start, rtol=1e-10).x[-1]
    return woodpecker().periodic(0.146, settled[:3], settled[3:], cyclic=["y"], rtol=1e-13)


class Pieces:
    """The same motion by matrix exponentials: x = [q; v; 1], linear between switches whose order is given."""

    def __init__(self, x: np.ndarray) -> None:
        self.x, self.t = np.append(x, 1.0), 0.0
        row = np.array([1.0, ARM, REACH])
        self.M = np.diag([SLEEVE, SLEEVE_J, BIRD_J]) + BIRD * np.outer(row, row)
        self.K = SPRING * np.array([[0, 0, 0], [0, 1, -1], [0, -1, 1.0]])
        self.weight = -G * (BIRD * row + np.array([SLEEVE, 0, 0]))

    def phase(self, edge: str, mode: str, sign: float, event: Callable[[np.ndarray, np.ndarray], float], least: float) -> None:
        """To where event(x, forces) passes zero, after `least`; edge "" flies. sign: of the slip."""
        W, directions = np.zeros((0, 3)), np.zeros((3, 0))
        if edge:
            normal, along = (np.array(EDGES[edge][k], dtype=float) for k in (1, 2))
            W = np.array([normal, along] if mode == "sticking" else [normal])
            directions = W.T if mode == "sticking" else (normal - MU * sign * along)[:, None]
        free = np.hstack([-np.linalg.solve(self.M, self.K), np.zeros((3, 3)), np.linalg.solve(self.M, self.weight)[:, None]])
        D = W @ np.linalg.solve(self.M, directions)
        forces = -np.linalg.solve(D, W @ free) if edge else np.zeros((0, 7))
        A = np.zeros((7, 7))
        A[:3, 3:6], A[3:6] = np.eye(3), free + np.linalg.solve(self.M, directions) @ forces

        def value(s: float) -> float:
            x = expm(A * s) @ self.x
            return event(x, forces @ x)

        right = least
        while value(right) * value(least) > 0:
            right += 1e-3
        s = brentq(value, max(least, right - 1e-3), right, xtol=1e-16, rtol=1e-15)
        self.x, self.t = expm(A * s) @ self.x, self.t + s

    def strike(self, edge: str) -> None:
        """Newton's law with Coulomb's: friction stops the slip, or is at its bound to the side that would stop it."""
        _, normal, along, e = EDGES[edge]
        W, v = np.array([normal, along], dtype=float), self.x[3:6]
        before = W @ v
        D = W @ np.linalg.solve(self.M, W.T)
        impulse = np.linalg.solve(D, [-(1 + e) * before[0], -before[1]])
        if abs(impulse[1]) > MU * impulse[0]:
            cone = np.array([1.0, MU * np.sign(impulse[1])])
            impulse = cone * (-(1 + e) * before[0] / (D[0] @ cone))
        self.x[3:6] += np.linalg.solve(self.M, W.T @ impulse)


def test_period_one_motion_against_matrix_exponentials() -> None:
    motion = orbit()
    run = motion.simulate(2)
    order = sorted((t, name, mode) for name, contact in run.contacts.items() for t, mode in contact.switches if t > 0)
    assert [(name, mode) for _, name, mode in order] == [
        ("low", "sliding"), ("low", "sticking"), ("low", "sliding"), ("low", "open"), ("up", "sliding"), ("up", "open")]
    pieces = Pieces(motion.x)

    def gap(edge: str) -> Callable[[np.ndarray, np.ndarray], float]:
        return lambda x, _: float(EDGES[edge][0] + np.array(EDGES[edge][1]) @ x[:3])

    def slip(edge: str) -> Callable[[np.ndarray, np.ndarray], float]:
        return lambda x, _: float(np.array(EDGES[edge][2]) @ x[3:6])

    found = []
    for edge, mode, sign, event, least, strikes in (
            ("", "", 0, gap("low"), 1e-3, "low"), ("", "", 0, gap("low"), 1e-3, "low"),
            ("low", "sliding", -1, slip("low"), 1e-3, ""),
            ("low", "sticking", 0, lambda x, force: MU * force[0] - abs(force[1]), 1e-3, ""),
            ("low", "sliding", -1, lambda x, force: force[0], 1e-3, ""), ("", "", 0, gap("up"), 1e-4, "up"),
            ("", "", 0, gap("beak"), 1e-4, "beak"), ("", "", 0, gap("up"), 1e-4, "up"),
            ("up", "sliding", 1, lambda x, force: force[0], 1e-4, "")):
        pieces.phase(edge, mode, sign, event, least)
        if strikes:
            pieces.strike(strikes)
        found.append((strikes, pieces.t))
    hits = sorted((t, name) for name, contact in run.contacts.items() for t in contact.impacts.t)
    assert [name for name, _ in found if name] == [name for _, name in hits] == ["low", "low", "up", "beak", "up"]
    assert np.abs(np.array([t for t, _ in hits]) - [t for name, t in found if name]).max() < 1e-10
    assert np.abs(np.array([t for t, _, _ in order]) - [found[k][1] for k in (1, 2, 3, 4, 7, 8)]).max() < 1e-10
    pieces.phase("", "", 0, lambda x, _: float(x[1] - motion.x[1]), 0.009)  # back at the angle of the start
    assert motion.period == pytest.approx(pieces.t, abs=1e-9)
    assert pieces.x[1:6] == pytest.approx(motion.x[1:], abs=1e-7)
    assert motion.period == pytest.approx(0.14597606514, abs=1e-10) and motion.stable
    rest = np.abs(motion.multipliers)
    assert rest[:2] == pytest.approx([1, 0.839155653], abs=1e-7) and rest[2:].max() < 1e-9


@pytest.mark.sweep
def test_time_stepping_comes_to_the_same_motion() -> None:
    """Across the impact and the slip, of first order in the step."""
    motion = orbit()
    located = woodpecker().simulate([0, 0.06], motion.x[:3], motion.x[3:], rtol=1e-12).q[-1]
    stepped = [woodpecker().simulate([0, 0.06], motion.x[:3], motion.x[3:], method="moreau", step=step) for step in (4e-6, 4e-7)]
    errors = [np.abs(one.q[-1] - located).max() for one in stepped]
    assert errors[1] < 1e-6 and errors[1] < errors[0] / 4
