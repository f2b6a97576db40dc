"""Runs in Euler angles that pass near gimbal lock say so, and only those."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
import pytest

import symdyn as sd
from symdyn.runtime.charts import distances
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
def test_near_pass_is_told_with_time_and_what_to_do(angles: Any, options: dict[str, Any]) -> None:
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


def test_a_stop_names_the_angles(angles: Any) -> None:
    (text, *_) = said(angles, [0.0, 2.0, 1e-8], rtol=1e-9)
    assert "stopped at t = 0.785" in text and "the ZYX angles of joint ball are within" in text


def test_distance_of_both_kinds_of_sequence(angles: Any) -> None:
    x = np.zeros((2, 6))
    x[1, 1] = 0.3
    assert np.allclose(distances(angles, x), np.cos([[0.0], [0.3]]))
    proper = sd.System("top")
    top = proper.add_body("top", mass=1, inertia=[1, 1, 2])
    proper.add_joint(sd.Spherical("tip", proper.ground, top, sd.coordinates("a b c"), orientation=sd.EulerAngles("ZXZ")))
    module = type("Module", (), {"metadata": {"charts": [list(c) for c in proper.embedding().charts],
                                              "x": ["a", "b", "c", "a_dot", "b_dot", "c_dot"]}})
    assert np.allclose(distances(module, x), np.sin([[0.0], [0.3]]))
    assert free_body("parameters").embedding().charts == ()
