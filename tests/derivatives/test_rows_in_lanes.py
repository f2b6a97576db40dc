"""Adjoint gradients and Hessian products of many states, a state in each SIMD lane: the bits of those of each state."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import sympy as sp

import symdyn as sd
from symdyn.errors import EvaluationError
from symdyn.runtime.building.compiler import find_compiler

pytestmark = pytest.mark.skipif(find_compiler() is None, reason="no C compiler here")


def states(module: Any, n: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """States near the start, weights and directions, (n, n_x) each."""
    rng = np.random.default_rng(n)
    start = np.array([module.metadata.initial.get(name, 0.0) for name in module.metadata.x])
    return start + 0.05 * rng.normal(size=(n, len(start))), *rng.normal(size=(2, n, len(start)))


@pytest.mark.every_value
@pytest.mark.parametrize(("name", "form"), [("puma560", "embedding"), ("four_bar", "augmented")])
@pytest.mark.parametrize("n", [3, 8, 203])  # fewer than lanes, as many, and some left over
def test_bits_of_each_state(name: str, form: str, n: int) -> None:
    module = getattr(sd.systems.get(name), form)().compile(backend="c")
    x, w, v = states(module, n)
    t = np.linspace(0, 1, n)
    found = module.adjoint(t, x, w, wrt=["x", "params"]), module.hessian(t, x, w, along=v)
    for k in range(n):
        one = module.adjoint(t[k], x[k], w[k], wrt=["x", "params"])
        assert np.array_equal(found[0].x[k], one.x) and np.array_equal(found[0].params[k], one.params)
        assert np.array_equal(found[1][k], module.hessian(t[k], x[k], w[k], along=v[k]))
    # One row of weights, or one state, for all.
    np.testing.assert_array_equal(module.hessian(0.0, x, w[0], along=v), module.hessian(0.0, x, np.tile(w[0], (n, 1)), along=v))
    np.testing.assert_array_equal(module.adjoint(0.0, x[0], w).x, module.adjoint(0.0, np.tile(x[0], (n, 1)), w).x)


def test_row_that_cannot_be_evaluated() -> None:
    q = sd.coordinates("q")
    system = sd.System("root", gravity=[0, 0, 0])
    body = system.add_body("body", mass=1)
    system.add_joint(sd.Prismatic("slide", system.ground, body, q, axis=[1, 0, 0]))
    system.add_force(body, [sp.sqrt(q), 0, 0])
    module = system.embedding().compile(backend="c")
    x = np.column_stack([np.linspace(1, 2, 20), np.zeros(20)])
    x[13, 0] = -1.0
    with pytest.raises(EvaluationError, match="row 13"):
        module.adjoint(0.0, x, [0.0, 1.0])
