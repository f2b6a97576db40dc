"""The recursive formulation and parallel frames give what the embedding gives, on random trees and on the catalogue."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import pytest
import sympy as sp

import symdyn as sd
from symdyn.errors import ModelError, SymdynError
from symdyn.formulation.printed.independent_speeds import MotionEquations
from tests import helpers
from tests.formulation.test_identities import Draw
from tests.helpers import swept

FORMS = [("embedding", "parallel"), ("recursive", "body"), ("recursive", "parallel")]
SEEDS = range(100, 125)


@lru_cache
def derived(seed: int, formulation: str, frames: str) -> MotionEquations:
    equations: MotionEquations = getattr(Draw(seed).s, formulation)(frames)
    return equations


@lru_cache
def expected(seed: int, state: int, *names: str) -> tuple[dict[str, Any], list[Any]]:
    """A state of a random tree, and what the embedding in body frames gives there; all forms are compared with it."""
    reference = derived(seed, "embedding", "body")
    values = helpers.state(reference, state)
    values |= {f"{u.name}_dot": 0.1 * k for k, u in enumerate(reference.symbols.speeds)}
    return values, helpers.quantities(reference, values, *names)


def same(a: Any, b: Any) -> bool:
    return helpers.close(a, b, 1e-22)


@pytest.mark.every_value
@pytest.mark.parametrize("form", FORMS, ids="-".join)
@pytest.mark.parametrize("seed", swept(SEEDS, *SEEDS[:10]))
def test_random_trees(seed: int, form: tuple[str, str]) -> None:
    names = ("accelerations", "inverse_dynamics", "M_tilde", "k_tilde", "F_tilde", "energy", "positions")
    values, wanted = expected(seed, 3, *names)
    for name, a, b in zip(names, helpers.quantities(derived(seed, *form), values, *names), wanted, strict=True):
        assert same(a, b), name


@pytest.mark.every_value
@pytest.mark.parametrize("form", FORMS, ids="-".join)
@pytest.mark.parametrize("seed", [*SEEDS][:6])
def test_jacobians_and_power(seed: int, form: tuple[str, str]) -> None:
    for name in ("jacobian_x", "jacobian_inputs", "power"):
        values, wanted = expected(seed, 4, name)
        assert same(helpers.quantities(derived(seed, *form), values, name)[0], wanted[0]), name


def test_joints_that_share_a_speed_keep_the_mass_matrix() -> None:
    q, = sd.coordinates("q1,")
    s = sd.System("gear", gravity=[0, -9, 0])
    a, b = (s.add_body(name, mass=1, inertia=[1, 2, 3], com=[0.3, 0, 0]) for name in "ab")
    s.add_joint(sd.Revolute("first", s.ground, a, q, axis=[0, 0, 1]))
    s.add_joint(sd.Revolute("second", a, b, -2 * q, axis=[0, 0, 1], parent_point=[1, 0, 0]))
    equations = s.recursive()
    assert any("a speed moves several joints" in note for note in equations.notes)
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


def test_constraints_are_rejected() -> None:
    s = sd.systems.get("double_pendulum")
    s.add_constraint(sp.sin(sd.coordinates("q1")))
    with pytest.raises(ModelError, match="the recursive form takes trees only"):
        s.recursive()


def test_links_by_body_name_and_number() -> None:
    s = sd.systems.get("double_pendulum")
    equations = s.recursive()
    assert equations.links == ("rod1", "rod2")
    by = [equations.link(which) for which in (s.bodies[1], "rod2", 2)]
    assert len({b.number for b in by}) == 1 and "I_A" in repr(by[0]) and by[0].S[2] == 1
    with pytest.raises(SymdynError, match=r"no link 'rod3'; it has 1 rod1, 2 rod2"):
        equations.link("rod3")
    with pytest.raises(AttributeError, match=r"link 1 has no I_B; it has I, I_A"):
        _ = equations.link(1).I_B


def test_what_a_mechanism_does_not_have_is_reported_with_the_reason() -> None:
    s = sd.systems.get("double_pendulum")
    s.move_ground([sp.sin(sd.t), 0])
    with pytest.raises(SymdynError, match=r"no quantity 'coriolis'.*joints .* follow given functions of time"):
        _ = s.recursive().coriolis


def test_lecture_quantities_of_the_double_pendulum() -> None:
    equations = sd.systems.get("double_pendulum").recursive()
    u = sp.Matrix(equations.symbols.speeds)
    assert sp.simplify(equations.coriolis * u - equations.k_tilde) == sp.zeros(2, 1)
    assert sp.simplify(equations.gravity_load + equations.F_tilde) == sp.zeros(2, 1)
    assert sp.simplify(equations.tau - equations.M_tilde * equations.accelerations - equations.k_tilde + equations.F_tilde
                       ) == sp.zeros(2, 1)


@pytest.mark.parametrize(("wrong", "message"), [
    ({"m1": float("nan")}, "must be finite, found m1 = nan"), ({"m1": "a"}, "the value of m1 is 'a', not a number"),
    ({"m1": None}, "the value of m1 is None, not a number"), ([1, 2], "must be a mapping from symbols or names to numbers"),
    ({"mass": 1}, "there is no 'mass'")])
def test_what_cannot_be_bound_is_reported(wrong: Any, message: str) -> None:
    with pytest.raises(SymdynError, match=rf"double_pendulum: specialize.*{message}"):
        sd.systems.get("double_pendulum").recursive().compile(backend="numpy", specialize=wrong)
    if isinstance(wrong, list) or "m1" in wrong:
        with pytest.raises(SymdynError, match=r"double_pendulum: parameters"):
            sd.systems.get("double_pendulum").recursive().verify(params=wrong)


def test_a_leaf_without_mass_by_its_numbers_is_named() -> None:
    """Known only when numbers are: bound, or given at run time."""
    m, = sd.parameters("m,")
    s = sd.System("leafy", gravity=[0, -9, 0])
    arm = s.add_body("arm", mass=1, inertia=[1, 1, 1])
    tip = s.add_body("tip", mass=m, com=[0, 0.1, 0])
    s.add_joint(sd.Revolute("shoulder", s.ground, arm, axis=[0, 0, 1]))
    s.add_joint(sd.Revolute("leaf", arm, tip, axis=[0, 0, 1], parent_point=[1, 0, 0]))
    message = r"joint 'leaf': what it moves has no mass or inertia along q_leaf_dot; give body 'tip'"
    with pytest.raises(SymdynError, match=message):
        s.recursive().compile(backend="numpy", specialize={m: 0})
    with pytest.raises(SymdynError, match=message):
        s.recursive().compile(backend="numpy").rhs(0, [0.1, 0.2, 0.3, 0.4], {m: 0.0})
