"""Whether a speed turns is one fact of the model: derivation, generated code and runtime agree, also for Custom joints."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import sympy as sp

import symdyn as sd
from symdyn.formulation.constraints.consistent_states import ConstraintStates
from symdyn.pipeline import emit
from symdyn.runtime.constraints import turning
from symdyn.statics.equilibria import LENGTHS, TURNS, _spans


def looped(units: Any) -> Any:
    """A body that slides and turns by a Custom joint, its tip on a line."""
    s, a = sd.coordinates("s a")
    system = sd.System("custom", gravity=[0, -9.81, 0])
    body = system.add_body("body", mass=2, inertia=[1, 1, 1], com=[0.5, 0, 0])
    turn = sp.Matrix([[sp.cos(a), -sp.sin(a), 0], [sp.sin(a), sp.cos(a), 0], [0, 0, 1]])
    system.add_joint(sd.Custom("both", system.ground, body, [s, a], rotation=turn, position=[s, 0, 0], units=units))
    system.add_constraint(s + sp.cos(a) - sp.Rational(3, 2))
    return system.augmented()


@pytest.mark.parametrize("units, wanted", [(["m", "rad"], [False, True]), (None, [True, True]), (["m", "1"], [False, True]),
                                           (["1", "rad"], [True, True])])
def test_every_stage_decides_alike(units, wanted):
    equations = looped(units)
    module = equations.compile(backend="numpy")
    assert turning(module).tolist() == wanted
    assert ConstraintStates(equations, {}).angular.tolist() == wanted

    class First:
        pass

    first = First()
    first.module = module
    spans = _spans(first, None)
    assert [spans[name] == (-TURNS, TURNS) for name in module.metadata.q] == wanted
    assert [spans[name] == (-LENGTHS, LENGTHS) for name in module.metadata.q] == [not turned for turned in wanted]
    text = emit(equations, "c").files["custom.c"]
    written = next(line for line in text.splitlines() if "turning" in line and "{" in line and "=" in line)
    assert [int(v) for v in written.split("{")[1].split("}")[0].replace("true", "1").replace("false", "0").split(",")] == \
        [int(w) for w in wanted]


@pytest.mark.parametrize("units", [["m", "rad"], ["m", "1"]])
def test_a_constraint_of_mixed_units_is_scaled_by_its_gradient_in_velocities(units):
    """The row (1, -sin a) of a length and an angle is divided by |(1, -sin(a)/L)|."""
    module = looped(units).compile(backend="numpy")
    params = np.zeros(0)
    length = float(module.evaluate("length", 0.0, np.zeros(4), params))
    for a in (0.7, 1.4):
        scale = float(module.evaluate("C_scale", 0.0, np.array([0.3, a, 0.0, 0.0]), params)[0])
        assert scale == pytest.approx(1 / np.hypot(1.0, np.sin(a) / length), rel=1e-14)
