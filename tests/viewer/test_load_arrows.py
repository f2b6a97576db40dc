"""Forces and torques of loads on their bodies: what they are worth together, and as arrows in the page."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import symdyn as sd
from symdyn.runtime.module import Module
from tests.helpers import browser
from tests.viewer.test_views import Opened

pytest.importorskip("matplotlib")


def of_all_kinds(gravity: float = 0.0) -> sd.System:
    """A slider and two links in space, with a load of every kind."""
    system = sd.System("loaded", gravity=[0, 0, -gravity])
    cart = system.add_body("cart", mass=2, com=[0, 0.1, 0])
    arm = system.add_body("arm", mass=1, inertia=[0.1, 0.2, 0.3], com=[0.4, 0.1, 0])
    fore = system.add_body("fore", mass=1, inertia=[0.1, 0.2, 0.3], com=[0.3, 0, 0.2])
    system.add_joint(sd.Prismatic("rail", system.ground, cart, axis=[1, 0, 0], coordinate=sd.coordinates("x")))
    system.add_joint(sd.Revolute("shoulder", cart, arm, axis=[0, 1, 0], coordinate=sd.coordinates("a"), parent_point=[0, 0, 0.3]))
    system.add_joint(sd.Revolute("elbow", arm, fore, axis=[0.6, 0.8, 0], coordinate=sd.coordinates("b"),
                                 parent_point=[0.9, 0, 0], child_point=[0, 0, -0.1]))
    system.add_force(fore, [3, -2, 5], point=[0.7, 0.2, 0.1], frame=fore, reaction=arm)
    system.add_force(cart, [1, 2, 3], name="push")
    system.add_torque(arm, [0.5, 1.5, -2], frame=fore, reaction=cart)
    system.add_joint_force("rail", 7.0)
    system.add_joint_force("elbow", -4.0)
    system.add_spring_damper(fore, cart, [0.5, 0, 0], [0, 1, 1], stiffness=30.0, damping=2.0, length=0.2)
    system.add_force_between(arm, system.ground, 11.0, point_a=[0.2, 0.3, 0], point_b=[3, 1, 2])
    system.add_load(sd.LinearDamping(fore, np.diag([1, 2, 3, 0.4, 0.5, 0.6]).tolist(), name="water"))
    return system


@pytest.fixture(scope="module")
def chromium() -> Iterator[Any]:
    with browser() as opened:
        yield opened


@pytest.fixture(scope="module")
def module() -> Module:
    return of_all_kinds().compile(backend="numpy")


def test_loads_on_bodies_are_worth_the_generalized_forces(module: Module) -> None:
    """By virtual power: J^T of all forces and torques on the bodies, from their points, is F_tilde without a weight."""
    rng = np.random.default_rng(3)
    bodies = module.metadata.bodies
    assert {kind for _, _, kind in module.metadata.acting} == {"force", "torque"}
    for _ in range(3):
        x = rng.uniform(-1, 1, 6)
        rows = module.evaluate("applied_loads", 0.0, x).reshape(-1, 2, 3)
        assert len(rows) == len(module.metadata.acting)
        centres = module.evaluate("positions", 0.0, x).reshape(-1, 3)
        wrenches = np.zeros((len(bodies), 6))
        for (at, acts), (_, body, kind) in zip(rows, module.metadata.acting, strict=True):
            k = bodies.index(body)
            wrenches[k] += np.concatenate([acts, np.cross(at - centres[k], acts)] if kind == "force" else [np.zeros(3), acts])
        J = module.evaluate("J", 0.0, x).reshape(-1, 3)
        np.testing.assert_allclose(J.T @ wrenches.ravel(), module.evaluate("F_tilde", 0.0, x).ravel(), rtol=1e-12, atol=1e-12)


def test_loads_can_be_seen_and_hidden(module: Module, chromium: Any, tmp_path: Path) -> None:
    """Each arrow begins where its load acts, and reaches as far as its force by the largest says."""
    solution = module.simulate((0, 0.2))
    solution.view(tmp_path / "view.html", forces=True)
    with Opened(chromium, tmp_path / "view.html") as opened:
        data = opened.page.evaluate("symdyn.scenes[0].data.loads")
        assert data["kinds"].count("torque") == 5 and "push on cart" in data["names"]
        rows = module.evaluate("applied_loads", 0.0, solution.x[0]).reshape(-1, 6)
        there = np.abs(solution.rows("applied_loads").reshape(len(solution.t), -1, 6)[..., 3:]).max(axis=(0, 2)) > 0
        load = np.array(opened.page.evaluate("symdyn.scenes[0].source.load")).reshape(-1, 6)
        np.testing.assert_allclose(load, rows[there], atol=2e-3 * np.abs(rows).max())
        k = data["names"].index("push on cart")
        picks = opened.page.evaluate("symdyn.scenes[0].picks.filter(p => p.name.startsWith('push on cart'))")
        assert picks[0]["name"] == "push on cart: 3.742 N"
        np.testing.assert_allclose(picks[0]["a"], load[k, :3], atol=1e-6)
        seen = opened.pixels()
        opened.page.get_by_label("loads").uncheck()
        assert (seen != opened.pixels()).any(axis=1).sum() > 300
        assert not opened.page.evaluate("symdyn.scenes[0].picks.some(p => p.name.startsWith('push'))")


def test_arrows_of_contacts_are_not_shown_twice() -> None:
    """Contacts with points have arrows of their own; what remains is the load."""
    system = sd.System("ball", gravity=[0, 0, -9.81])
    ball = system.add_body("ball", mass=1, inertia=[0.1, 0.1, 0.1])
    system.add_joint(sd.Free("free", system.ground, ball))
    system.add_contact(sd.Contact("floor", ball, system.ground, shape=sd.contacts.Sphere(0.2), friction=0.3))
    system.add_force(ball, [1, 0, 0], name="push")
    assert system.embedding().acting == (("push", "ball", "force"),)
