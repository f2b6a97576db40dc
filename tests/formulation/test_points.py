"""Points of bodies as outputs: J, J_dot u and accelerations against derivatives of their positions and of rotations."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import mpmath
import numpy as np
import pytest
import sympy as sp

import symdyn as sd
from symdyn.formulation.trees.embedding import EmbeddedEquations
from symdyn.spatial.vectors import vector
from symdyn.tape import Tape
from symdyn.tape.differentiate import forward, jacobian
from tests import helpers
from tests.formulation.test_identities import SEEDS, Draw
from tests.mechanisms import planar_or_spatial

POINT = [sp.Rational(3, 10), sp.Rational(-1, 5), sp.Rational(7, 10)]


def with_points(s: sd.System, body: Any, at: Any) -> EmbeddedEquations:
    s.add_output("r", sd.position(body, at))
    s.add_output("v", sd.velocity(body, at))
    s.add_output("a", sd.acceleration(body, at))
    s.add_output("J", sd.jacobian(body, at))
    s.add_output("bias", sd.bias_acceleration(body, at))
    return s.embedding()


@lru_cache
def tree(seed: int) -> EmbeddedEquations:
    s = Draw(seed).s
    return with_points(s, s.bodies[-1], POINT)


def twist(eq: EmbeddedEquations, body: int) -> np.ndarray:
    """[velocity of the point; omega] as derivatives of the position and of the rotation by time, n-frame, (6,)."""
    seeds = dict(zip([eq.leaves[q] for q in eq.symbols.coordinates], eq.quantity("rates"), strict=True)) | {eq.leaves[sd.t]: 1}
    R = eq.quantity("frames")[body, 3:]
    rates = forward(eq.recorder, [*eq.quantity("output_r"), *R], seeds)
    W = vector(*rates[3:]).reshape(3, 3) @ R.reshape(3, 3).T
    return vector(*rates[:3], W[2, 1], W[0, 2], W[1, 0])


@pytest.mark.parametrize("seed", SEEDS)
def test_against_derivatives(seed: int) -> None:
    eq = tree(seed)
    body = len(eq.quantity("frames")) - 1
    V = twist(eq, body)
    u = [eq.leaves[s] for s in eq.symbols.speeds]
    seeds = dict(zip([eq.leaves[q] for q in eq.symbols.coordinates], eq.quantity("rates"), strict=True)) | {eq.leaves[sd.t]: 1}
    tape = Tape.of(eq.recorder, V=V, by_u=jacobian(eq.recorder, V.tolist(), u, "forward"),
                   by_t=vector(*forward(eq.recorder, V.tolist(), seeds)), ud=eq.quantity("accelerations"),
                   **{n: eq.quantity(f"output_{n}") for n in ("v", "a", "J", "bias")})
    values = helpers.state(eq, seed)
    found = helpers.at(tape, values, digits=40)
    assert found["J"].shape == (6, len(u)) and found["bias"].shape == (6,) and found["a"].shape == (3,)
    assert helpers.close(found["v"], found["V"][:3])
    assert helpers.close(found["J"], found["by_u"])
    assert helpers.close(found["bias"], found["by_t"])
    with mpmath.workdps(40):
        a = found["J"] @ found["ud"] + found["bias"]
        scale = max(1, helpers.largest(found["ud"]))
        assert helpers.close(a[:3] / scale, found["a"] / scale)


@pytest.mark.parametrize("seed", [0, 3])
def test_J_u_is_the_velocity_without_given_motion(seed: int) -> None:
    s = Draw(seed, driven=False).s
    eq = with_points(s, s.bodies[-1], POINT)
    values = helpers.state(eq, seed)
    J, v = helpers.quantities(eq, values, "output_J", "output_v")
    with mpmath.workdps(40):
        u = vector(*[helpers.number(values[s.name]) for s in eq.symbols.speeds])
        assert helpers.close((J @ u)[:3], v)


def test_centre_of_mass_has_the_rows_of_the_velocity_transformation() -> None:
    s = Draw(2).s
    for k, body in enumerate(s.bodies):
        s.add_output(f"J{k}", sd.jacobian(body, body.com))
        s.add_output(f"bias{k}", sd.bias_acceleration(body.name, body.com))
    eq = s.embedding()
    for k in range(len(s.bodies)):
        rows = slice(6 * k, 6 * k + 6)
        assert (eq.quantity(f"output_J{k}") == eq.quantity("J")[rows]).all()
        assert (eq.quantity(f"output_bias{k}") == eq.quantity("Jd_qd")[rows]).all()


def test_plane_and_space_agree() -> None:
    found = []
    for planar in (True, False):
        eq = with_points(planar_or_spatial(planar), "lower", [sd.parameters("l"), sp.Rational(1, 5)] + [0] * (not planar))
        values = helpers.state(eq, 3, tau=0)
        found.append(helpers.quantities(eq, values, *[f"output_{n}" for n in ("r", "v", "a", "J", "bias")]))
    for flat, full in zip(*found, strict=True):
        rows = [0, 1] if len(flat) == 2 else [0, 1, 5]
        assert helpers.close(flat, full[rows]) and not full[[k for k in range(len(full)) if k not in rows]].any()
    assert found[0][3].shape == (3, 3) and found[0][4].shape == (3,) and found[0][2].shape == (2,)


def test_slider_on_the_ground_that_moves() -> None:
    """J leaves out given motion; the accelerations have it."""
    q = sd.coordinates("q")
    s = sd.System("shaken")
    s.move_ground([0, sd.t**2, 0], [3 * sd.t, 0, 0], "ZYX")
    cart = s.add_body("cart", mass=2)
    s.add_joint(sd.Prismatic("rail", s.ground, cart, q, axis=[1, 0, 0]))
    eq = with_points(s, cart, [0, 0, 0])
    values = helpers.state(eq, 0, q=2, q_dot=5, t=0)
    J, bias, a, v = helpers.quantities(eq, values, *[f"output_{n}" for n in ("J", "bias", "a", "v")])
    assert [float(e) for e in J.ravel()] == [1, 0, 0, 0, 0, 0]
    assert [float(e) for e in v] == [5, 6, 0]
    assert [float(e) for e in bias] == [-18, 2 + 30, 0, 0, 0, 0]
    assert [float(e) for e in a] == [0, 32, 0]  # frictionless: no force along the rail


def test_ground_stands_still() -> None:
    s = Draw(0).s
    for name in ("acceleration", "jacobian", "bias_acceleration"):
        s.add_output(name, getattr(sd, name)(s.ground, [1, 2, 3]))
    eq = s.embedding()
    assert not any(eq.quantity(f"output_{n}").any() for n in ("acceleration", "jacobian", "bias_acceleration"))


@pytest.mark.parametrize("make", [sd.acceleration, sd.jacobian, sd.bias_acceleration])
@pytest.mark.parametrize(("arguments", "message"), [
    (("hand",), "output 'tip': body is 'hand', which is no body of the system"),
    (("lower", 5), "output 'tip': point is 5"),
    (("lower", [sd.coordinates("q1"), 0]), "output 'tip': point depends on q1, but must be constant"),
    (("lower", ["0", 0]), "output 'tip': point, component 1 is the text '0'"),
])
def test_faults(make: Any, arguments: tuple, message: str) -> None:
    s = planar_or_spatial(True)
    s.add_output("tip", make(*arguments))
    with pytest.raises(sd.ModelError, match=message):
        s.embedding()


def test_body_of_another_system() -> None:
    s = planar_or_spatial(True)
    s.add_output("tip", sd.jacobian(planar_or_spatial(True).bodies[0]))
    with pytest.raises(sd.ModelError, match="output 'tip': body is 'cart', which is a body of another system"):
        s.embedding()


@pytest.mark.parametrize("backend", ["numpy", "c"])
def test_compiled_and_over_time(backend: str, tmp_path: Any) -> None:
    from symdyn.runtime.building.compiler import find_compiler

    if backend == "c" and find_compiler() is None:
        pytest.skip("no C compiler here")
    s = sd.systems.get("three_link_arm")
    tip = (s.bodies[-1], [sd.parameters("l3"), 0, 0])
    s.add_output("tip_v", sd.velocity(*tip))
    s.add_output("tip_a", sd.acceleration(*tip))
    s.add_output("tip_J", sd.jacobian(*tip))
    s.add_output("tip_bias", sd.bias_acceleration(*tip))
    module = s.embedding().compile(backend=backend)
    sol = module.simulate(t=np.linspace(0, 1, 201), rtol=1e-10)
    n = len(sol.t)
    assert sol["tip_J"].shape == (n, 6, 3) and sol["tip_bias"].shape == (n, 6) and sol["tip_a"].shape == (n, 3)
    assert np.allclose(np.einsum("tij,tj->ti", sol["tip_J"], sol.u)[:, :3], sol["tip_v"], atol=1e-13)
    ud = module.evaluate("rhs", sol.t, sol.x, None, sol.inputs)[:, 3:]
    assert np.allclose(np.einsum("tij,tj->ti", sol["tip_J"], ud)[:, :3] + sol["tip_bias"][:, :3], sol["tip_a"], atol=1e-11)
    h = sol.t[1] - sol.t[0]
    later = (sol["tip_v"][2:] - sol["tip_v"][:-2]) / (2 * h)
    assert np.abs(later - sol["tip_a"][1:-1]).max() < 1e-2 * np.abs(sol["tip_a"]).max()
    text = sol.save(tmp_path / "motion.csv").read_text().splitlines()
    assert "tip_J_18" in text[0] and len(text[1].split(",")) == len(text[0].split(","))
    assert np.load(sol.save(tmp_path / "motion.npz"))["output_tip_J"].shape == (n, 6, 3)


def test_pictures_leave_matrices_out() -> None:
    from symdyn.pictures.panels import panels_of
    from symdyn.pictures.points import points_of

    s = sd.systems.get("two_link_arm")
    at = (s.bodies[-1], [sd.parameters("l2"), 0])
    s.add_output("tip_a", sd.acceleration(*at))
    s.add_output("tip_J", sd.jacobian(*at))
    s.add_output("tip_bias", sd.bias_acceleration(*at))
    sol = s.embedding().compile(backend="numpy").simulate(t=(0, 1))
    assert sol["tip_J"].shape[1:] == (3, 2)
    assert {name: p.quantity for name, p in points_of(sol).items()} == {"tip": "position"}
    outputs = [panel.names[0] for panel in panels_of(sol) if panel.title in ("output", "acceleration")]
    assert outputs == ["tip_a x", "tip_bias[0]"]
