"""A pile of blocks by time stepping: weights carried at each level, momentum, friction that holds and that slips, no overlap."""

from __future__ import annotations

import numpy as np
import pytest

import symdyn as sd
from symdyn.runtime.building.compiler import find_compiler

pytestmark = pytest.mark.skipif(find_compiler() is None, reason="no C compiler")
G, N = 9.81, 6
WIDTH, HEIGHT = 0.4, 0.2


@pytest.fixture(scope="module")
def pile() -> sd.Module:
    """Blocks of 2 kg upon each other, each with two corners on the one below; tilt: gravity along the floor by that across it."""
    tilt, mu = sd.parameters("tilt mu")
    system = sd.System("pile", gravity=[tilt * G, -G])
    system.defaults.update({tilt: 0.0, mu: 0.5})
    below = system.ground
    for k in range(N):
        body = system.add_body(f"block_{k}", mass=2.0, inertia=2.0 * (WIDTH**2 + HEIGHT**2) / 12)
        system.add_joint(sd.Planar(f"joint_{k}", system.ground, body))
        top = sd.contacts.Plane([0, 1], [0, HEIGHT / 2 if k else 0])
        for side, x in (("left", -WIDTH / 2), ("right", WIDTH / 2)):
            corner = sd.contacts.Point([x, -HEIGHT / 2])
            system.add_contact(sd.Contact(f"{side}_{k}", body, below, shape=(corner, top), friction=mu))
        below = body
    return system.embedding().compile()


AT = np.array([[0, HEIGHT * (k + 0.5), 0] for k in range(N)]).ravel()


def level(solution: sd.Solution, k: int, what: str) -> np.ndarray:
    """Values at both corners of a block: forces or impulses (normal, tangential) at the last time."""
    return sum(getattr(solution.contacts[f"{side}_{k}"], what)[-1] for side in ("left", "right"))


def kept(solution: sd.Solution) -> None:
    """Laws are met, and nothing overlaps, at all times."""
    assert solution.success and solution.stepped is not None
    assert solution.stepped.residual < 1e-6 and solution.stepped.depth < 1e-9
    assert min(contact.gap.min() for contact in solution.contacts.values()) > -1e-9


@pytest.mark.parametrize("tilt", [0.0, 0.03])
def test_each_level_carries_what_is_above(pile: sd.Module, tilt: float) -> None:
    solution = pile.simulate((0, 0.3), q=AT, params={"tilt": tilt}, method="moreau", step=1e-2)
    kept(solution)
    np.testing.assert_allclose(solution.q[-1], AT, atol=1e-9)
    for k in range(N):
        np.testing.assert_allclose(np.abs(level(solution, k, "force")), 2.0 * G * (N - k) * np.array([1, tilt]), atol=1e-5)


def test_a_pile_that_moves_is_braked_by_the_floor_as_one_body(pile: sd.Module) -> None:
    """Every level may slip as easily as the lowest one: each block is slowed by mu g, and none turns."""
    solution = pile.simulate((0, 0.1), q=AT, u=np.tile([1.0, 0, 0], N), params={"mu": 0.02}, method="moreau", step=1e-2)
    kept(solution)
    np.testing.assert_allclose(solution.u[-1].reshape(N, 3)[:, 1:], 0, atol=1e-7)
    np.testing.assert_allclose(solution.u[-1].reshape(N, 3)[:, 0], 1 - 0.02 * G * 0.1, atol=1e-7)


def test_momentum_of_a_pile_that_is_struck(pile: sd.Module) -> None:
    u = np.zeros((N, 3))
    u[4, 0], u[-1, 1] = 1.5, -2.0  # one is knocked out, the highest one falls on the pile
    solution = pile.simulate((0, 0.2), q=AT, u=u.ravel(), method="moreau", step=5e-3)
    kept(solution)
    gained = 2.0 * (solution.u[-1].reshape(N, 3) - u).sum(axis=0)[:2] + [0, 2.0 * N * G * 0.2]
    pushed = level(solution, 0, "impulse")
    np.testing.assert_allclose([pushed[0], abs(pushed[1])], [gained[1], abs(gained[0])], atol=1e-9)
