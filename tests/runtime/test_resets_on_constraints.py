"""Resets on constraints: what is reset stays, the others follow by the smallest change in the metric of the mass matrix."""

from __future__ import annotations

import functools
import re
from typing import Any

import numpy as np
import pytest
import sympy as sp

import symdyn as sd
from symdyn.errors import SimulationWarning
from tests.helpers import swept

METHODS = [("c", "dop853", None), ("c", "radau5", None), ("c", "RK45", None), ("c", "LSODA", None), ("c", "dop853", "baumgarte"),
           ("numpy", "DOP853", None)]
a, b, c = sd.coordinates("a b c")


def arm(reset: dict[Any, Any], at: Any = b - 0.6) -> sd.System:
    """Two links, one hinged to the other."""
    system = sd.System("arm", gravity=[0, -9.81])
    first, second = system.add_body("first", 1.0, 0.1, com=[0.3, 0]), system.add_body("second", 2.0, 0.2, com=[0.4, 0.1])
    system.add_joint(sd.Revolute("shoulder", "ground", first, a))
    system.add_joint(sd.Revolute("elbow", first, second, b, parent_point=[0.7, 0]))
    system.add_joint_force("elbow", -0.1 * b.dot)
    system.add_event("stop", at, direction=1, reset=reset)
    system.initial = {a: 0.3, b: 0.4, b.dot: 2}
    for name, value in (("om", b.dot), ("angle", b), ("y", sd.position(second)[1]), ("rate", sd.angular_velocity(first)[2])):
        system.add_output(name, value)
    return system


def coupling() -> Any:
    """M_ab / M_aa of the arm at the event: an impulse in the elbow alone changes a_dot by - that, times the change of b_dot."""
    # About the shoulder: I_1 + m_1 s_1^2 + m_2 l^2 + I_2 + m_2 |s_2|^2 + 2 m_2 l e, with e the way of G_2 along the first link.
    e = 0.4 * sp.cos(b) - 0.1 * sp.sin(b)
    along = 0.2 + 2 * (0.4**2 + 0.1**2) + 2 * 0.7 * e
    return along / (0.1 + 0.3**2 + 2 * 0.7**2 + along + 2 * 0.7 * e)


def module_of(form: str, system: sd.System, backend: str) -> Any:
    equations = {"absolute": lambda: system.augmented(coordinates="absolute"), "embedding": system.embedding}[form]()
    return equations.compile(backend=backend)


@functools.cache
def in_angles() -> Any:
    """The arm in its angles, where the impulse in the elbow is written out."""
    system = arm({b.dot: -b.dot / 2, a.dot: a.dot + 3 * b.dot / 2 * coupling()})
    return module_of("embedding", system, "c").simulate(np.linspace(0, 0.5, 11), rtol=1e-11)


@functools.cache
def stopped(backend: str) -> Any:
    """The arm in absolute coordinates, whose elbow stops at half of its speed."""
    return module_of("absolute", arm({b.dot: -b.dot / 2}), backend)


@pytest.mark.parametrize(("backend", "method", "way"), METHODS)
def test_a_joint_speed_in_absolute_coordinates_becomes_what_its_reset_says(backend: str, method: str, way: str | None) -> None:
    exact = in_angles()
    assert len(exact.events["stop"].t) == 3
    run = stopped(backend).simulate(exact.t, rtol=1e-9, method=method, stabilization=way)
    assert run.success, run.message
    np.testing.assert_allclose(run.events["stop"].t, exact.events["stop"].t, atol=1e-6)
    for name in ("om", "y", "angle", "rate"):
        np.testing.assert_allclose(run.outputs[name], exact.outputs[name], atol=2e-5)


@pytest.mark.parametrize(("backend", "method"), [("c", "dop853"), ("numpy", "RK45")])
def test_with_all_joint_speeds_named_all_forms_agree(backend: str, method: str) -> None:
    """In angles all else stays; in absolute coordinates what is to stay is named."""
    exact = module_of("embedding", arm({b.dot: -b.dot / 2}), "c").simulate(np.linspace(0, 0.5, 11), rtol=1e-11)
    module = module_of("absolute", arm({b.dot: -b.dot / 2, a.dot: a.dot}), backend)
    run = module.simulate(exact.t, rtol=1e-10, method=method)
    for name in ("om", "y", "angle", "rate"):
        np.testing.assert_allclose(run.outputs[name], exact.outputs[name], atol=1e-6)


@functools.cache
def flap(form: str) -> Any:
    system = sd.System("flap", gravity=[0, 0, -9.81])
    body = system.add_body("body", 1.5, sp.diag(0.1, 0.2, 0.15), com=[0, 0.4, 0.1])
    system.add_joint(sd.Revolute("hinge", "ground", body, a, axis=[0.8, 0, 0.6]))
    system.add_event("stop", a + 0.3, direction=-1, reset={a.dot: -a.dot / 2})
    system.initial = {a: 0.4, a.dot: -0.5}
    system.add_output("angle", a)
    system.add_output("om", a.dot)
    system.add_output("z", sd.position(body, [0.1, 0.2, 0.3])[2])
    return module_of(form, system, "c")


@pytest.mark.parametrize("method", swept(["dop853", "radau5", "taylor", "RK45", "ggl"], "dop853", "radau5", "ggl"))
def test_a_turn_in_space_with_euler_parameters_takes_all_speeds_along(method: str) -> None:
    """One freedom, so that the motion after the reset is that in the angle."""
    if method == "ggl":
        pytest.importorskip("solve_dae")
    exact = flap("embedding").simulate(np.linspace(0, 0.7, 8), rtol=1e-11)
    assert len(exact.events["stop"].t) == 2
    run = flap("absolute").simulate(exact.t, method=method, rtol=1e-6 if method == "ggl" else 1e-10)
    assert run.success, run.message
    for name in ("angle", "om", "z"):
        np.testing.assert_allclose(run.outputs[name], exact.outputs[name], atol=5e-4 if method == "ggl" else 1e-6)


@pytest.mark.parametrize(("backend", "method"), [("c", "dop853"), ("numpy", "RK45")])
def test_a_joint_coordinate_in_absolute_coordinates_becomes_what_its_reset_says(backend: str, method: str) -> None:
    """The arm jumps by the displacement that its masses resist the least: along that of an impulse in the elbow."""
    module = module_of("absolute", arm({b: b - 1e-4, b.dot: 1.5}, sd.t - 0.1), backend)
    run = module.simulate([0, 0.1 - 1e-10, 0.1 + 1e-10], method=method, rtol=1e-10)
    assert run.success, run.message
    change = run.x[2] - run.x[1]
    names = list(module.metadata.x)
    assert change[names.index("b")] == pytest.approx(-1e-4, rel=1e-5)
    assert run.outputs["om"][2] == pytest.approx(1.5, rel=1e-8)
    ratio = float(coupling().subs(b, run.outputs["angle"][1]))
    assert change[names.index("theta_first")] == pytest.approx(1e-4 * ratio, rel=1e-3)
    assert change[names.index("theta_first_dot")] == pytest.approx(-ratio * change[names.index("b_dot")], rel=1e-3)
    assert np.abs(run.constraint_violation).max() < 1e-9 and np.abs(run.velocity_violation).max() < 1e-8


def four_bar(reset: dict[Any, Any], at: Any = a - 1.4) -> sd.System:
    """A closed chain of three links in relative coordinates, of one freedom."""
    system = sd.System("four_bar", gravity=[0, -9.81])
    crank, coupler = system.add_body("crank", 1.0, 0.1, com=[0.15, 0]), system.add_body("coupler", 1.0, 0.2, com=[0.5, 0])
    rocker = system.add_body("rocker", 1.5, 0.2, com=[0.4, 0])
    system.add_joint(sd.Revolute("motor", "ground", crank, a))
    system.add_joint(sd.Revolute("elbow", crank, coupler, b, parent_point=[0.3, 0]))
    system.add_joint(sd.Revolute("pivot", "ground", rocker, c, parent_point=[1.0, 0]))
    system.close_loop(sd.Revolute("knee", coupler, rocker, parent_point=[1.0, 0], child_point=[0.8, 0]))
    system.initial = {a: 0.9, b: -0.2, c: 1.2, a.dot: 3}
    system.add_event("stop", at, direction=1, reset=reset)
    return system


def around(module: Any, name: str, **options: Any) -> tuple[np.ndarray, np.ndarray]:
    """States just before and just after the first event."""
    q, u = module.consistent(keep=["a", "a_dot"])
    at = module.simulate((0, 0.4), q, u, rtol=1e-10, **options).events[name].t[0]
    run = module.simulate([0, at - 1e-10, at + 1e-10], q, u, rtol=1e-10, **options)
    assert run.success, run.message
    return run.x[1], run.x[2]


@pytest.mark.parametrize(("backend", "method", "way"), swept(METHODS, METHODS[0], METHODS[1], METHODS[4]))
def test_one_speed_of_a_loop_takes_the_others_along(backend: str, method: str, way: str | None) -> None:
    """One freedom: all speeds change in proportion. With the mass metric alone the reset would be undone in part."""
    module = four_bar({a.dot: -a.dot / 4}).augmented().compile(backend=backend)
    before, after = around(module, "stop", method=method, stabilization=way)
    np.testing.assert_allclose(after[:3], before[:3], atol=1e-8)
    np.testing.assert_allclose(after[3:], -before[3:] / 4, rtol=1e-6)


@pytest.mark.parametrize(("backend", "method"), [("c", "dop853"), ("numpy", "RK45")])
def test_all_speeds_of_a_loop_may_be_reset_together_where_they_fit(backend: str, method: str) -> None:
    module = four_bar({u.dot: -u.dot / 4 for u in (a, b, c)}).augmented().compile(backend=backend)
    before, after = around(module, "stop", method=method)
    np.testing.assert_allclose(after[3:], -before[3:] / 4, rtol=1e-6)


@pytest.mark.parametrize("method", ["dop853", "RK45"])
def test_a_reset_at_a_jump_of_a_held_input_stays(method: str) -> None:
    F = sd.inputs("F")
    system = four_bar({a.dot: -a.dot / 4}, F - 0.15)
    system.add_joint_force("motor", F)
    module = system.augmented().compile(backend="c")
    q, u = module.consistent(keep=["a", "a_dot"])
    held = sd.Sampled(lambda t, x: float(t > 0.15) / 2, period=0.1)
    run = module.simulate([0, 0.2 - 1e-10, 0.2 + 1e-10], q, u, inputs={F: held}, method=method, rtol=1e-10)
    assert run.success and run.events["stop"].t == pytest.approx([0.2])
    np.testing.assert_allclose(run.x[2][3:], -run.x[1][3:] / 4, rtol=1e-6)


@pytest.mark.every_value
@pytest.mark.parametrize(("backend", "method"), [("c", "dop853"), ("c", "RK45"), ("numpy", "RK45")])
@pytest.mark.parametrize(("reset", "entry"), [({a.dot: -a.dot / 4, c.dot: c.dot}, "[ac]_dot"), ({a: 1.3, c: 0.9}, "[ac]")])
def test_a_reset_that_the_constraints_do_not_allow_is_an_error(backend: str, method: str, reset: dict[Any, Any],
                                                               entry: str) -> None:
    module = four_bar(reset).augmented().compile(backend=backend)
    q, u = module.consistent(keep=["a", "a_dot"])
    with pytest.warns(SimulationWarning):
        run = module.simulate((0, 0.4), q, u, method=method)
    assert not run.success and len(run.events["stop"].t) == 1
    assert re.search(rf"the constraints do not let {entry} be what the reset of an event makes it: the nearest is (?!0 )\S+ off; "
                     "reset fewer coordinates and speeds", run.message)


@pytest.mark.parametrize(("backend", "method"), [("c", "dop853"), ("numpy", "RK45")])
def test_a_speed_that_a_constraint_holds_cannot_be_reset(backend: str, method: str) -> None:
    """At the bottom of a circle nothing goes up, also where rounding leaves it a little off."""
    x, y = sd.coordinates("x y")
    system = sd.System("circling", gravity=[0, -9.81])
    rail, particle = system.add_body("rail", 1.0), system.add_body("particle", 1.0)
    system.add_joint(sd.Prismatic("along", "ground", rail, x, axis=[1, 0]))
    system.add_joint(sd.Prismatic("up", rail, particle, y, axis=[0, 1]))
    system.add_constraint(x**2 + y**2 - 1, "circle")
    system.initial = {x: 1}
    system.add_event("bottom", x, reset={y.dot: 3})
    module = system.augmented().compile(backend=backend)
    with pytest.warns(SimulationWarning, match=r"do not let y_dot be .* the nearest is 3 off"):
        run = module.simulate((0, 1.2), method=method)
    assert run.t[-1] == pytest.approx(run.events["bottom"].t[0])


def test_free_wheels_that_engage_keep_what_is_reset_and_share_the_rest() -> None:
    """Three wheels geared as one sum: with the first reset, the impulse of the gear is shared by the inertias of the others."""
    system = sd.System("wheels", planar=True)
    inertias = (0.3, 0.5, 2.0)
    for k, angle in enumerate((a, b, c)):
        wheel = system.add_body(f"wheel{k}", 1.0, inertias[k])
        system.add_joint(sd.Revolute(f"axle{k}", "ground", wheel, angle, parent_point=[k, 0]))
    system.add_constraint(a + b + c, "gear")
    system.initial = {a.dot: 2, b.dot: -3, c.dot: 1}
    system.add_event("brake", sd.t - 0.5, reset={a.dot: 5})
    module = system.augmented().compile(backend="c")
    for method in ("dop853", "RK45"):
        run = module.simulate([0, 0.6], method=method)
        # b_dot and c_dot take -3 together, by the inverse inertias.
        shares = np.array([1 / 0.5, 1 / 2.0]) / (1 / 0.5 + 1 / 2.0)
        np.testing.assert_allclose(run.x[-1][3:], [5, *(np.array([-3, 1]) - 3 * shares)], rtol=1e-12)
