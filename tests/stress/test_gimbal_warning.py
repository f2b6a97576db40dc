"""Runs in Euler angles that pass near gimbal lock warn, and only those."""

from __future__ import annotations

import warnings
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import symdyn as sd
from symdyn.runtime.integrating.charts import distances
from symdyn.stress.attitude import free_body


@pytest.fixture(scope="module")
def angles() -> Any:
    return free_body("angles").compile()


@pytest.fixture(scope="module")
def body() -> Any:
    return free_body("body").compile()


def said(module: Any, u: list[float], **options: Any) -> list[str]:
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        module.simulate(t=(0, 2), u=u, max_steps=100_000, **options)
    return [str(w.message) for w in caught]


@pytest.mark.parametrize("options", [{}, {"steps": True}, {"method": "DOP853"}], ids=["outputs", "steps", "scipy"])
def test_near_pass_is_reported_with_time_and_what_to_do(angles: Any, options: dict[str, Any]) -> None:
    (text,) = said(angles, [0.0, 2.0, 1e-4], rtol=1e-9, **options)
    assert "near t = 0.785" in text and "the ZYX angles of joint ball came within" in text
    assert "exceed rtol = 1e-09" in text and "take EulerParameters, or another sequence" in text


def test_few_outputs_do_not_hide_it(angles: Any) -> None:
    assert len(said(angles, [0.0, 2.0, 1e-4], rtol=1e-9)) == 1
    with pytest.warns(sd.SimulationWarning, match="came within"):
        angles.simulate(t=np.array([0.0, 2.0]), u=[0.0, 2.0, 1e-4], rtol=1e-9)


def test_the_tolerance_decides(angles: Any, body: Any) -> None:
    """An error of rounding over the squared distance for rates as speeds, over the distance for speeds in body axes."""
    assert said(angles, [0.0, 2.0, 1e-2], rtol=1e-9) == []
    assert said(angles, [0.0, 2.0, 1e-4], rtol=1e-4) == []
    assert said(body, [1e-4, 2.0, 0.0], rtol=1e-9) == []
    assert len(said(body, [1e-6, 2.0, 0.0], rtol=1e-12)) == 1
    assert said(angles, [0.3, 0.2, 0.1], rtol=1e-9) == []


def test_the_stabilized_index_2_form_reports_it() -> None:
    """Next to the body a cart that is held at its place, so that there is a constraint."""
    pytest.importorskip("solve_dae")
    system = free_body("angles")
    x = sd.coordinates("x")
    system.add_joint(sd.Prismatic("rail", system.ground, system.add_body("cart", mass=1), x, axis=[1, 0, 0]))
    system.add_constraint(x - sd.t**2 / 10, "held")
    module = system.augmented().compile()
    for u, n in (({"x_dot": 0.0}, 0), (dict(zip(module.metadata.u, [0.0, 2.0, 1e-5, 0.0], strict=True)), 1)):
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            run = module.simulate(t=np.array([0.0, 0.9]), u=u, rtol=1e-6, method="ggl")
        assert run.success and sum("ZYX angles of joint ball came within" in str(w.message) for w in caught) == n


def test_many_motions_report_it_at_the_states_that_are_kept(angles: Any) -> None:
    """A quarter turn at 2 rad/s ends 1e-4/2 rad from gimbal lock: the second motion of three is kept there."""
    options = {"u": [[0.3, 0.2, 0.1], [0.0, 2.0, 1e-4], [0.0, 1.0, 0.1]], "rtol": 1e-9}
    with pytest.warns(sd.SimulationWarning, match=r"in 1 of 3 motions, the first of them 1, the ZYX angles of joint ball came "
                                                  r"too near to gimbal lock, in motion 1 at t = 0\.785\d* within .* take EulerP"):
        angles.simulate_batch(t=np.array([0.0, 0.5, np.pi / 4]), **options)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        angles.simulate_batch(t=np.array([0.0, 0.5, 1.0]), **options)


def test_a_stop_names_the_angles(angles: Any) -> None:
    (text, *_) = said(angles, [0.0, 2.0, 1e-8], rtol=1e-9)
    assert "stopped at t = 0.785" in text and "the ZYX angles of joint ball are at gimbal lock or very near it" in text


def test_distance_of_both_kinds_of_sequence(angles: Any) -> None:
    x = np.zeros((2, 6))
    x[1, 1] = 0.3
    assert np.allclose(distances(angles, x), np.cos([[0.0], [0.3]]))
    proper = sd.System("top")
    top = proper.add_body("top", mass=1, inertia=[1, 1, 2])
    proper.add_joint(sd.Spherical("tip", proper.ground, top, sd.coordinates("a b c"), orientation=sd.EulerAngles("ZXZ")))
    names = ["a", "b", "c", "a_dot", "b_dot", "c_dot"]
    module: Any = SimpleNamespace(metadata=SimpleNamespace(charts=proper.embedding().charts, x=names))
    assert np.allclose(distances(module, x), np.sin([[0.0], [0.3]]))
    assert free_body("parameters").embedding().charts == ()
