"""The recursive formulation and parallel frames give what the embedding gives, on random trees and on the catalogue."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import pytest
import sympy as sp

import symdyn as sd
from symdyn.errors import ModelError, SymdynError
from symdyn.formulation.motion_equations import MotionEquations
from tests import helpers
from tests.formulation.test_identities import Draw

FORMS = [("embedding", "parallel"), ("recursive", "body"), ("recursive", "parallel")]
SEEDS = range(100, 125)


@lru_cache
def derived(seed: int, formulation: str, frames: str) -> MotionEquations:
    equations: MotionEquations = getattr(Draw(seed).s, formulation)(frames)
    return equations


def same(a: Any, b: Any) -> bool:
    return helpers.close(a, b, 1e-22)


@pytest.mark.parametrize("form", FORMS, ids="-".join)
@pytest.mark.parametrize("seed", SEEDS)
def test_random_trees(seed: int, form: tuple[str, str]) -> None:
    reference, equations = derived(seed, "embedding", "body"), derived(seed, *form)
    values = helpers.state(reference, 3)
    values |= {f"{u.name}_dot": 0.1 * k for k, u in enumerate(reference.symbols.speeds)}
    names = ("accelerations", "inverse_dynamics", "M_tilde", "k_tilde", "F_tilde", "energy", "positions")
    for name, a, b in zip(names, helpers.quantities(equations, values, *names), helpers.quantities(reference, values, *names),
                          strict=True):
        assert same(a, b), name


@pytest.mark.parametrize("form", FORMS, ids="-".join)
@pytest.mark.parametrize("seed", [*SEEDS][:6])
def test_jacobians_and_power(seed: int, form: tuple[str, str]) -> None:
    reference, equations = derived(seed, "embedding", "body"), derived(seed, *form)
    values = helpers.state(reference, 4)
    for name in ("jacobian_x", "jacobian_inputs", "power"):
        a, b = (helpers.quantities(e, values, name)[0] for e in (equations, reference))
        assert same(a, b), name


def test_joints_that_share_a_speed_keep_the_mass_matrix() -> None:
    q, = sd.coordinates("q1,")
    s = sd.System("gear", gravity=[0, -9, 0])
    a, b = (s.add_body(name, mass=1, inertia=[1, 2, 3], com=[0.3, 0, 0]) for name in "ab")
    s.add_joint(sd.Revolute("first", s.ground, a, q, axis=[0, 0, 1]))
    s.add_joint(sd.Revolute("second", a, b, -2 * q, axis=[0, 0, 1], parent_point=[1, 0, 0]))
    equations = s.recursive()
    assert any("share a speed" in note for note in equations.notes)
    values = {"q1": 0.3, "q1_dot": 0.7}
    ours, embedded = (helpers.quantities(e, values, "accelerations")[0] for e in (equations, s.embedding()))
    assert same(ours, embedded)


def test_massless_leaf_is_named() -> None:
    s = sd.System("massless", gravity=[0, -9, 0])
    a = s.add_body("a", mass=1, inertia=[1, 1, 1])
    b = s.add_body("b")
    s.add_joint(sd.Revolute("shoulder", s.ground, a, axis=[0, 0, 1]))
    s.add_joint(sd.Revolute("wrist", a, b, axis=[0, 1, 0], parent_point=[1, 0, 0]))
    with pytest.raises(ModelError, match=r"'wrist'.*no mass or inertia along q_wrist_dot.*give body 'b'"):
        s.recursive()


def test_singular_at_every_state_is_named() -> None:
    """A point mass on its joint's axis: the spherical joint turns nothing about the line to it."""
    s = sd.System("thin", gravity=[0, -9, 0])
    rod = s.add_body("rod", mass=1, com=[1, 1, 0])
    s.add_joint(sd.Spherical("ball", s.ground, rod))
    with pytest.raises(ModelError, match="singular at every state"):
        s.recursive()


def test_unknown_frames() -> None:
    with pytest.raises(SymdynError, match=r"frames 'world' asked for; there are 'body' and 'parallel'"):
        sd.systems.get("pendulum").recursive(frames="world")


def test_constraints_are_refused() -> None:
    s = sd.systems.get("double_pendulum")
    s.add_constraint(sp.sin(sd.coordinates("q1")))
    with pytest.raises(ModelError, match="the recursive form takes trees only"):
        s.recursive()
