"""Initial values of inputs count wherever inputs are left out."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

import symdyn as sd


def test_inputs_that_are_left_out_have_their_initial_values_everywhere(compiled: Callable[..., Any], backend: str) -> None:
    """The first mass of the chain is pushed by 1 N, and starts at 0.5 m/s; the second is held to the first by nothing."""
    module = compiled("prismatic_chain", backend)
    x, given = np.array([0.0, 0.0, 0.5, 0.0]), [1.0, 0.0]
    wanted, end = module.rhs(0.0, x, None, given), module.simulate((0, 1), inputs=given).x[-1]
    assert not np.allclose(wanted, module.rhs(0.0, x, None, [0.0, 0.0]))
    for found in (module.rhs(0.0, x), module.rhs(0.0, x, None, {}), module.rhs(0.0, x, None, {"F2": 0.0}),
                  module.bind().rhs(0.0, x), module.rhs_batch(0.0, x[None])[0], module.evaluate("rhs", 0.0, x)):
        np.testing.assert_array_equal(found, wanted)
    np.testing.assert_array_equal(module.jacobian(0.0, x).x, module.jacobian(0.0, x, None, given).x)
    np.testing.assert_array_equal(module.bind().jacobian_x(0.0, x), module.jacobian(0.0, x, None, given).x)
    np.testing.assert_array_equal(module.F_tilde(x[:2], x[2:]), module.F_tilde(x[:2], x[2:], None, 0.0, given))
    run = module.simulate((0, 1))
    np.testing.assert_array_equal(run.x[-1], end)
    np.testing.assert_array_equal(run.inputs[0], given)
    np.testing.assert_allclose(module.simulate_batch(t=(0, 1)).x[0, -1], end, rtol=1e-15)
    np.testing.assert_allclose(module.simulate_batch(t=(0, 1), inputs={"F2": [0.0, 0.0]}).x[1, -1], end, rtol=1e-15)
    done = sd.ensemble(module, {"q1": [run.x[0, 0]] * 2}, (0.0, 1.0), [f"end {name}" for name in module.metadata.x])
    for name, value in zip(module.metadata.x, end, strict=True):
        np.testing.assert_allclose(done[f"end {name}"], value, rtol=1e-12)
