"""Output of a checked model, and number of warnings of a doubt."""

from __future__ import annotations

import warnings

import pytest

import symdyn as sd
from symdyn.errors import ModelWarning


def doubtful() -> sd.System:
    system = sd.System("plate")
    body = system.add_body("plate", mass=1, inertia=[1, 1, 3])
    system.add_joint(sd.Revolute("hinge", system.ground, body, sd.coordinates("q"), axis=[0, 0, 1]))
    return system


def test_a_doubt_is_warned_of_once_for_each_system():
    system = doubtful()
    with pytest.warns(ModelWarning, match="triangle inequality") as caught:
        system.check()
        system.check()
        system.embedding()
    assert len(caught) == 1
    with pytest.warns(ModelWarning, match="triangle inequality"):
        doubtful().check()


def test_a_changed_system_is_warned_of_what_is_new():
    system = doubtful()
    with pytest.warns(ModelWarning):
        model = system.check()
    assert len(model.doubts) == 1 and f"doubtful: {model.doubts[0]}" in str(model)
    other = system.add_body("other", mass=1, inertia=[1, 5, 1])
    system.add_joint(sd.Revolute("second", system.ground, other, sd.coordinates("q2"), axis=[0, 0, 1]))
    with pytest.warns(ModelWarning, match="other") as caught:
        assert len(system.check().doubts) == 2
    assert len(caught) == 1


@pytest.mark.parametrize("name", sd.systems.names())
def test_a_checked_model_prints_as_a_summary(name):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", ModelWarning)
        model = sd.systems.get(name).check()
    text = str(model)
    assert len(text.splitlines()) <= 12 and text.startswith(f"{model.name}: ") and repr(model) == text
    count = len(model.coordinates)
    assert f"  {count} coordinate{'' if count == 1 else 's'}: {model.coordinates[0]}" in text
    details = model.details()
    assert all(f"    {p}: {value}" in details for p, value in model.defaults.items())


def test_the_summary_names_parameters_without_a_default():
    system = sd.System("point", gravity=[0, -9.81])
    m, k = sd.parameters("m k", positive=True)
    q = sd.coordinates("q")
    body = system.add_body("body", mass=m)
    joint = system.add_joint(sd.Prismatic("rail", system.ground, body, q, axis=[1, 0]))
    system.add_joint_force(joint, -k * q)
    system.set_defaults({m: 2})
    assert "2 parameters: m, k; no default for k" in str(system.check())
