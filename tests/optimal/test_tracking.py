"""Regulators along motions that were simulated: against closed forms, along optimal motions, on tables and held inputs."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.linalg
import sympy as sp

import symdyn as sd
from symdyn.optimal.course import Course
from symdyn.runtime.module import Module


def cart() -> Module:
    return sd.systems.cart_pole().compile(backend="c")


def slider(vertical: bool = False) -> sd.System:
    """A body of 1 kg that a force F moves along x, or up and down along y under its weight."""
    name = "y" if vertical else "x"
    q = sd.coordinates(name)
    system = sd.System("slider", gravity=[0, -9.81])
    body = system.add_body("body", mass=1)
    slide = system.add_joint(sd.Prismatic("slide", system.ground, body, q, axis=[0, 1] if vertical else [1, 0]))
    system.add_joint_force(slide, sd.inputs("F"))
    return system


def test_a_double_integrator_against_its_closed_form() -> None:
    """S follows from the Hamiltonian's matrix exponential, whatever the motion is."""
    A, B, Q, T = np.array([[0, 1.0], [0, 0]]), np.array([[0], [1.0]]), np.eye(2), 2.0
    motion = slider().compile(backend="c").simulate((0, T), inputs={"F": ([0, 0.3, 2], [0, 1, -1])})
    regulator = motion.lqr(Q=[1, 1], R=[1], Qf=[0, 0])
    for t in (0.0, 0.3, 0.7, 1.9):
        flow = scipy.linalg.expm(np.block([[A, -B @ B.T], [-Q, -A.T]]) * (t - T))
        S = flow[2:, :2] @ np.linalg.inv(flow[:2, :2])
        assert np.abs(regulator.S(t) - S).max() < 1e-6 and np.abs(regulator.K(t) - B.T @ S).max() < 1e-6


def test_the_course_is_the_motion() -> None:
    table = sd.Table([0, 0.2, 0.9, 1.5], [0, 3, -2, 1])
    motion = cart().simulate((0, 1.5), q=[0, 0.3], inputs={"F": table}, rtol=1e-11)
    course, t = Course.of(motion), np.linspace(0, 1.5, 301)
    x, u = motion.states_and_inputs(t)
    assert {0.2, 0.9} <= set(course.breaks) and (np.abs(course.at(t) - x) < 1e-8 * np.abs(x).max(axis=0)).all()
    assert np.abs(course.inputs_at(t) - u).max() < 1e-12
    held = cart().simulate((0, 1), q=[0, 0.1], inputs=sd.Sampled(lambda t, x: [-5 * x[1]], 0.25), rtol=1e-11)
    found = Course.of(held)
    assert (np.abs(found.at(held.t) - held.x) < 1e-8 * np.abs(held.x).max(axis=0)).all()
    assert np.abs(found.inputs_at(held.t[:-1]) - held.inputs[:-1]).max() < 1e-12


def test_a_disturbed_motion_is_kept() -> None:
    """Along the motion itself, and as along the optimal motion with the same inputs."""
    F = sp.Symbol("F")
    optimum = sd.optimize(cart(), sd.Loss(integral=F**2), 1.0, start={"q2": 0.5}, end=[0.2, 0, 0, 0], tolerance=1e-8)
    weights = {"Q": [10, 10, 1, 1], "R": [0.01], "Qf": [100, 100, 10, 10]}
    of_motion, of_optimum = (one.lqr(**weights) for one in (optimum.simulate(), optimum))
    for t in (0.0, 0.37, 0.9):
        assert np.abs(of_motion.K(t) - of_optimum.K(t)).max() < 1e-3 * np.abs(of_optimum.K(t)).max()
    start = optimum.x[0] + [0.05, 0.1, 0, 0]
    kept, left = (cart().simulate((0, 1), start[:2], start[2:], inputs=inputs).x[-1] - optimum.x[-1]
                  for inputs in (sd.Sampled(of_motion, 0.01), optimum.table))
    assert np.abs(kept).max() < 0.1 and np.abs(left).max() > 1
    assert repr(of_motion) == "<Tracking of cart_pole from 0 to 1 s by F>"
    with pytest.raises(sd.ArgumentError, match=r"x of a regulator has the shape \(3,\); needed is \(4,\)"):
        of_motion(0.5, np.zeros(3))
    with pytest.raises(sd.ArgumentError, match=r"cart_pole: t.* must be .*number"):
        of_motion("late", np.zeros(4))
    with pytest.raises(sd.ArgumentError, match=r"cart_pole: x of a regulator must be numbers"):
        of_motion(0.5, "upright")


def test_motions_without_a_regulator() -> None:
    module = cart()
    jumps = module.simulate((0, 1), q=[0, 0.1], inputs=lambda t, x: [1.0 if t > 0.4 else -1.0])
    with pytest.raises(sd.ArgumentError, match=r"states or inputs jump near t = 0\.399\d* s; give inputs as tables"):
        jumps.lqr(Q=[1, 1, 1, 1], R=[1])
    with pytest.raises(sd.ArgumentError, match=r"a motion that did not go forward to its end"):
        module.simulate((1, 0), q=[0, 0.1]).lqr(Q=[1, 1, 1, 1], R=[1])
    y = sd.coordinates("y")
    ball = slider(vertical=True)
    ball.add_event("bounce", y, direction=-1, reset={y.dot: -y.dot})
    with pytest.raises(sd.ArgumentError, match=r"whose state jumps at t = 0\.451524 s; simulate up to there"):
        ball.compile(backend="c").simulate((0, 1), q=[1]).lqr(Q=[1, 1], R=[1])
    floor = slider(vertical=True)
    floor.add_contact(sd.Contact("foot", "body", floor.ground, shape=sd.contacts.Point([0, 0]), law="rigid"))
    with pytest.raises(sd.ArgumentError, match=r"along a motion with rigid contacts, which open and close"):
        floor.compile(backend="c").simulate((0, 0.2), q=[0]).lqr(Q=[1, 1], R=[1])
