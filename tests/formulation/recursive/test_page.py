"""The page's quantities on the tape: the same numbers as the recursions on floats, and what a mechanism does not have."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from symdyn.formulation.algebra import TapeAlgebra, leaves_of
from symdyn.formulation.loads.recorded import Loads
from symdyn.formulation.textbook.bias import gravity_load
from symdyn.formulation.textbook.center_frame import at_center
from symdyn.formulation.textbook.coriolis import coriolis
from symdyn.formulation.textbook.forward_dynamics import forward_dynamics
from symdyn.formulation.textbook.inverse_dynamics import inverse_dynamics
from symdyn.formulation.textbook.momentum import momentum
from symdyn.formulation.textbook.page import Page
from symdyn.formulation.textbook.velocities import generalized, joint_accelerations
from symdyn.formulation.trees.tree import build
from symdyn.spatial.sixvectors import force_cross
from symdyn.tape import Recorder, Tape
from symdyn.tape.evaluate import evaluate
from tests import helpers
from tests.formulation.recursive.trees import check, numeric, random_vector, state


def page_of(model: Any) -> Page:
    recorder = Recorder()
    tree = build(model, TapeAlgebra(recorder, leaves_of(model, recorder)))
    return Page(tree, Loads(tree))


def numbers_of(page: Page, seed: int, options: dict[str, bool]) -> tuple[dict[str, np.ndarray], np.ndarray]:
    """All quantities at 30 digits, at a random state and accelerations."""
    tree = numeric(seed, **options)
    where, model = state(tree, seed), tree.model
    u_dot = random_vector(len(model.speeds), seed)
    values = {**{s.name: v for s, v in {**model.defaults, **model.initial}.items()}, **where["q"], **where["u"], "t": where["t"],
              **{f"{u.name}_dot": a for u, a in zip(model.speeds, u_dot, strict=True)}}
    tape = Tape.of(page.tree.algebra.recorder, **{name: record() for name, record in page.quantities().items()})
    return evaluate(tape, values, 30), u_dot


@pytest.mark.parametrize(("seed", "options"), [(0, {}), (3, {}), (6, {}), (11, {}), (1, {"gears": True}), (5, {"driven": True})])
def test_floats_give_what_the_tape_gives_with_30_digits(seed: int, options: dict[str, bool]) -> None:
    tree = numeric(seed, **options)
    found, u_dot = numbers_of(page_of(tree.model), seed, options)
    here = tree.at(**state(tree, seed))
    inverse = inverse_dynamics(here.tree, joint_accelerations(here.tree, u_dot), wrenches=here.applied.wrenches)
    expected: dict[str, Any] = {"gravity_load": gravity_load(here.tree).load, "momentum": momentum(here.tree).h_0,
                                "momentum_G": momentum(here.tree).h_G, "center_of_mass": momentum(here.tree).center}
    expected["page_inverse_dynamics"] = generalized(here.tree, inverse.tau - here.applied.joint)
    for k, link in enumerate(here.tree.links):
        center = at_center(link.inertia, inverse.velocities.v[k], inverse.a[k], inverse.f_B[k])
        expected |= {f"{letter}_{k + 1}": getattr(inverse.velocities, letter)[k]
                     for letter in ("X", "X_star", "S", "S_ring", "I", "v", "c", "p")}
        expected |= {f"a_{k + 1}": inverse.a[k], f"f_{k + 1}": inverse.f[k],
                     **{f"{letter}_{k + 1}": getattr(center, letter) for letter in ("v_G", "a_G", "f_G")}}
    if "gears" not in options:
        forward = forward_dynamics(here.tree, here.applied.joint, here.applied.wrenches)
        expected |= {f"{letter}_{k + 1}": getattr(forward, letter)[k] for letter in ("I_A", "p_A") for k in range(len(forward.a))}
        expected["page_accelerations"] = forward.u_dot
    if "driven" not in options:
        expected["coriolis"] = coriolis(here.tree).C
    assert set(expected) == set(found)
    for name, value in expected.items():
        assert np.asarray(value).shape == found[name].shape, name
        if helpers.largest(found[name]):
            check(value, found[name], 1e-11)


@pytest.mark.parametrize("seed", [2, 7, 8])
def test_frame_at_the_centre_of_mass(seed: int) -> None:
    """Lecture, chapter 5.7: X*(v_G x* I_G v_G) = v x* I_O v; 5.6: f_G = I_G a_G + v_G x* I_G v_G. On floats and 30 digits."""
    tree = numeric(seed)
    for digits, closeness in ((None, 1e-13), (30, helpers.TOLERANCE)):
        here = tree.at(**state(tree, seed), digits=digits).tree
        inverse = inverse_dynamics(here, random_vector(len(here.w), seed))
        for k, link in enumerate(here.links):
            m = inverse.velocities
            G = at_center(link.inertia, m.v[k], inverse.a[k], inverse.f_B[k])
            p_G = force_cross(G.v_G) @ (G.I_G @ G.v_G)
            assert helpers.close(G.X_G.T @ p_G, m.p[k], closeness)
            assert helpers.close(G.f_G, G.I_G @ G.a_G + p_G, closeness)
            assert helpers.close(G.X_G.T @ G.I_G @ G.X_G, m.I[k], closeness)
            assert helpers.largest(G.I_G[:3, 3:]) < 1e-12


def test_what_a_mechanism_does_not_have_is_noted() -> None:
    gears, driven = page_of(numeric(0, gears=True).model), page_of(numeric(0, driven=True).model)
    assert "I_A_1" not in gears.quantities() and "coriolis" in gears.quantities()
    assert "I_A_1" in driven.quantities() and "coriolis" not in driven.quantities()
    assert any("moves the joints revolute_0, gear_1, gear_2 together" in note for note in gears.notes)
    assert driven.notes == ["no Coriolis matrix: joints ground_motion, given_1, given_2 follow given functions of time"]


def test_steps_are_named_and_stand_under_headings() -> None:
    page = page_of(numeric(1).model)
    tape = Tape.of(page.tree.algebra.recorder, f=page.quantities()["f_1"](), I_A=page.quantities()["I_A_1"]())
    names = {tape.recorder.names.get(node, "").split("_")[0] for node in tape.steps}
    assert {"v2", "c2", "p2", "a2", "IA2", "D2", "fB2"} <= names
    assert any(node.section.endswith("articulated inertia and bias force") for node in tape.steps)
