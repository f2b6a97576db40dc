"""The solver of contact problems in C, called alone: closed forms, the exact cone, dependent contacts, and random problems."""

from __future__ import annotations

import ctypes

import numpy as np
import pytest

from symdyn.runtime.building.compiler import find_compiler, require_compiler
from symdyn.runtime.building.shared import shared
from symdyn.runtime.integrating.moreau_memory import Memory, cones

pytestmark = pytest.mark.skipif(find_compiler() is None, reason="no C compiler")
TOLERANCE = 1e-13


class Problem:
    """Contacts with rows J (n_rows, n_u), M = 1, velocities without impulses free (n_rows,)."""

    def __init__(self, J: np.ndarray, free: np.ndarray, friction: list[float], rows: int = 3, dense: int = 200,
                 bounded: bool = False) -> None:
        n_rows, n_u = J.shape
        n = n_rows // rows
        self.J, self.free, self.friction, self.rows = J, free, np.array(friction), rows
        self.memory = Memory()
        self.record = record = cones(self.memory, n_u, n, n * n_u, dense)
        record.n = n
        for name, values in {"first": np.arange(n + 1) * rows, "entry": np.arange(n + 1) * n_u}.items():
            self.memory.take(record, name, values.astype(np.dtype("long")))
        self.memory.take(record, "speed", np.tile(np.arange(n_u), n).astype(np.intc))
        entries = np.zeros((n, n_u, 3))
        entries[:, :, :rows] = J.reshape(n, rows, n_u).transpose(0, 2, 1)
        for name, values in {"along": entries, "answer": entries, "friction": self.friction, "free": free}.items():
            self.memory.take(record, name, values)
        self.memory.take(record, "bounded", np.full(n, bounded, dtype=np.intc))
        self.P = self.memory.take(record, "P", np.zeros(n_rows))

    def solve(self, sweeps: int = 2000) -> float:
        """The residual; impulses are in P."""
        call = shared("moreau", require_compiler()).symdyn_moreau_impulses
        call.restype = ctypes.c_double
        return float(call(ctypes.byref(self.record), ctypes.c_double(TOLERANCE), ctypes.c_long(sweeps)))

    @property
    def w(self) -> np.ndarray:
        return self.free + self.J @ (self.J.T @ self.P)

    def missed(self) -> float:
        """By how much the laws are missed, from their inequalities, without a projection."""
        worst = 0.0
        for P, w, mu in zip(self.P.reshape(-1, self.rows), self.w.reshape(-1, self.rows), self.friction, strict=True):
            slip, pull = np.linalg.norm(w[1:]), np.linalg.norm(P[1:])
            worst = max(worst, -P[0], -w[0], abs(P[0] * w[0]), pull - mu * P[0])
            worst = max(worst, float(np.abs(pull * slip + P[1:] @ w[1:]).max()))  # against the slip
            worst = max(worst, slip * (mu * P[0] - pull))  # of full size where it slips
        return float(worst)


def test_a_contact_opens_sticks_or_slides_along_its_slip() -> None:
    J = np.eye(3)
    opening = Problem(J, np.array([0.5, 3.0, -2.0]), [0.7])
    assert opening.solve() == 0
    assert not opening.P.any()
    sticking = Problem(J, np.array([-1.0, 0.3, -0.4]), [0.7])
    assert sticking.solve() <= TOLERANCE
    np.testing.assert_allclose(sticking.P, [1.0, -0.3, 0.4], atol=1e-15)
    sliding = Problem(J, np.array([-1.0, 3.0, -4.0]), [0.7])
    assert sliding.solve() <= TOLERANCE
    np.testing.assert_allclose(sliding.P, [1.0, -0.7 * 0.6, 0.7 * 0.8], atol=1e-14)  # a cone: no edge of a pyramid turns it


@pytest.mark.parametrize("angle", np.linspace(0, 2 * np.pi, 17))
def test_friction_is_opposite_to_the_slip_in_every_direction(angle: float) -> None:
    coupled = np.array([[1.0, 0.2, -0.1], [0.0, 1.3, 0.4], [0.0, 0.0, 0.8]])
    problem = Problem(coupled, np.array([-1.0, 5 * np.cos(angle), 5 * np.sin(angle)]), [0.3])
    assert problem.solve() <= TOLERANCE
    w, P = problem.w[1:], problem.P
    np.testing.assert_allclose(P[1:], -0.3 * P[0] * w / np.linalg.norm(w), atol=1e-13)


@pytest.mark.parametrize(("n", "n_u"), [(2, 6), (6, 6), (6, 30), (20, 24), (30, 60)])
def test_random_problems_fulfil_the_laws(n: int, n_u: int) -> None:
    generator = np.random.default_rng(n)
    for _ in range(10):
        J = generator.uniform(-1, 1, (3 * n, n_u))
        problem = Problem(J, J @ generator.uniform(-1, 1, n_u), generator.uniform(0, 1, n).tolist())
        assert problem.solve() <= TOLERANCE
        assert problem.missed() < 1e-11


def test_contacts_that_depend_on_each_other_share_their_impulses() -> None:
    legs = np.array([[1, x, y] for x in (1, -1) for y in (1, -1)], dtype=float)  # one more than determine a plate's motion
    problem = Problem(legs, np.full(4, -1.0), [0.0] * 4, rows=1)
    assert problem.solve() <= TOLERANCE
    np.testing.assert_allclose(problem.w, 0, atol=1e-12)
    assert problem.P.sum() == pytest.approx(1, abs=1e-12)
    assert (problem.P >= 0).all()


def test_newton_ends_what_sweeps_approach_slowly() -> None:
    n = 20  # a pile: the impulses at each level carry all that is above
    J = np.zeros((n, n))
    for k in range(n):
        J[k, k] = 1.0
        if k:
            J[k, k - 1] = -1.0
    pile = Problem(J, np.array([-1.0, *[0.0] * (n - 1)]), [0.0] * n, rows=1)
    falling = Problem(J, -J @ np.ones(n), [0.0] * n, rows=1)
    for problem in (pile, falling):
        assert problem.solve() <= TOLERANCE
    np.testing.assert_allclose(falling.P, n - np.arange(n), rtol=1e-11)
    assert falling.record.n_sweeps < 100
    slow = Problem(J, -J @ np.ones(n), [0.0] * n, rows=1, dense=0)
    assert slow.solve(12) > 1e-6  # without it so many sweeps are far off


def test_sweeps_alone_reach_the_laws_where_a_matrix_has_no_room() -> None:
    generator, n = np.random.default_rng(3), 40
    J = generator.uniform(-1, 1, (3 * n, 150))
    problem = Problem(J, J @ generator.uniform(-1, 1, 150), generator.uniform(0, 1, n).tolist(), dense=0)
    assert problem.solve(3000) <= TOLERANCE
    assert problem.missed() < 1e-11 and not problem.record.n_newton


def test_more_contacts_stick_than_the_speeds_allow() -> None:
    """A body of two speeds that creeps in a wedge of two walls, where it would stick to both: one lets it slip at last."""
    walls = [np.array([np.cos(a), np.sin(a)]) for a in (np.radians(89), np.radians(91))]
    J = np.array([row for n in walls for row in (n, [n[1], -n[0]])])
    problem = Problem(J, J @ [1e-4, -1.0], [0.3, 0.3], rows=2, dense=0)
    assert problem.solve(400) <= TOLERANCE
    assert problem.missed() < 1e-11
