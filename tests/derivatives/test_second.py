"""Gradients and second derivatives of weighted rates, against other routes and against differences with many digits."""

from __future__ import annotations

from typing import Any

import mpmath
import numpy as np
import pytest

import symdyn as sd
from symdyn.backend import columns
from symdyn.backend.right_side import RightSide
from symdyn.errors import ArgumentError, SymdynError
from symdyn.functions.tapes import all_columns_of, function_tape
from symdyn.runtime.building.compiler import find_compiler
from symdyn.tape.evaluate import evaluate
from tests.helpers import swept
from tests.mechanisms import kitchen_sink

CASES = [("three_link_arm", "embedding"), ("cart_pole", "recursive"), ("four_bar", "augmented"), ("bricard", "augmented"),
         ("spatial_slider_crank", "augmented"), ("kitchen_sink", "embedding")]
BACKENDS = ["numpy", "c"] if find_compiler() else ["numpy"]


def derived(name: str, formulation: str) -> Any:
    return getattr(kitchen_sink() if name == "kitchen_sink" else sd.systems.get(name), formulation)()


def point(module: Any) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """x on the constraints, inputs, weights, a direction of [x; inputs; params]."""
    sizes, rng = module.metadata.sizes, np.random.default_rng(3)
    start = module.consistent() if module.metadata.constraints else (rng.uniform(-1, 1, sizes.q), rng.uniform(-1, 1, sizes.u))
    x = np.concatenate([*start, rng.uniform(-1, 1, sizes.z)])
    return x, rng.normal(size=sizes.inputs), rng.normal(size=sizes.x), rng.normal(size=sizes.x + sizes.inputs + sizes.p)


@pytest.mark.every_value
@pytest.mark.parametrize(("name", "formulation"), swept(CASES, *CASES[:3], CASES[4]))
@pytest.mark.parametrize("backend", BACKENDS)
def test_gradients_are_weighted_rows_of_the_jacobian(name: str, formulation: str, backend: str) -> None:
    module = derived(name, formulation).compile(backend=backend)
    x, inputs, weights, _ = point(module)
    wrt = ["x", "inputs", "params", "t"]
    rows, found = module.jacobian(0.4, x, None, inputs, wrt), module.adjoint(0.4, x, weights, None, inputs, wrt)
    for by in wrt:
        expected = weights @ getattr(rows, by)
        np.testing.assert_allclose(getattr(found, by), expected, rtol=0, atol=2e-13 * np.abs([*expected, 1]).max(), err_msg=by)


@pytest.mark.parametrize(("name", "formulation"), swept([case for case in CASES if case[0] not in ("bricard", "kitchen_sink")],
                                                    ("four_bar", "augmented")))
def test_second_derivatives(name: str, formulation: str) -> None:
    equations = derived(name, formulation)
    modules = [equations.compile(backend=backend) for backend in BACKENDS]
    x, inputs, weights, direction = point(modules[0])
    wrt = ("x", "inputs", "params", "t")
    direction = np.append(direction, 0.7)
    whole = modules[0].hessian(0.4, x, weights, None, inputs, wrt)
    size = np.abs(whole).max()
    np.testing.assert_allclose(whole, whole.T, rtol=0, atol=1e-13 * size)
    for module in modules:
        product = module.hessian(0.4, x, weights, None, inputs, wrt, along=direction)
        np.testing.assert_allclose(product, whole @ direction, rtol=0, atol=1e-12 * size)
        by_state = module.hessian(0.4, x, weights, None, inputs)
        np.testing.assert_allclose(by_state, whole[:len(x), :len(x)], rtol=0, atol=1e-13 * size)
    # The derivative along the direction of the gradient's tape, with many digits.
    s, tape = equations.symbols, function_tape(equations, "adjoint_x")
    moved = [*[a.name for a in (*s.coordinates, *s.speeds, *s.states, *s.inputs, *s.parameters)], "t"]
    held = dict(zip(moved, [*x, *inputs, *modules[0].default_parameters, 0.4], strict=True))
    with mpmath.workdps(60):
        step, sides = mpmath.mpf(10) ** -20, []
        for sign in (1, -1):
            at = {n: mpmath.mpf(v) + sign * step * mpmath.mpf(d) for (n, v), d in zip(held.items(), direction, strict=True)}
            given = {**at, **{f"(weight {k + 1})": w for k, w in enumerate(weights)}}
            sides.append(evaluate(tape, given, 60)["adjoint_x"])
        exact = ((sides[0] - sides[1]) / (2 * step)).astype(float)
    np.testing.assert_allclose((whole @ direction)[:len(x)], exact, rtol=0, atol=1e-12 * size)


@pytest.mark.skipif(find_compiler() is None, reason="no C compiler")
def test_several_columns_at_once(monkeypatch: pytest.MonkeyPatch) -> None:
    equations = derived("three_link_arm", "embedding")
    one_by_one = equations.compile(backend="numpy")
    x, inputs, weights, _ = point(one_by_one)
    monkeypatch.setattr(columns, "LEAST", 0)
    monkeypatch.setattr(columns, "GAIN", 0)
    assert all_columns_of(equations, "hessian_x_inputs", RightSide()) is not None
    found = derived("three_link_arm", "embedding").compile().hessian(0.4, x, weights, None, inputs, ["x", "inputs"])
    expected = one_by_one.hessian(0.4, x, weights, None, inputs, ["x", "inputs"])
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-13 * np.abs(expected).max())


def test_costs_in_operations() -> None:
    equations = derived("puma560", "recursive")
    rhs, adjoint, product = (function_tape(equations, n).operations for n in ("rhs", "adjoint_x", "hessian_product_x"))
    assert adjoint < 3 * rhs and product < 8 * rhs


def test_rows_of_states_and_weights() -> None:
    module = sd.systems.get("cart_pole").embedding().compile()
    X, W = np.random.default_rng(2).normal(size=(2, 5, 4))
    np.testing.assert_array_equal(module.hessian(0, X, W, None, [1.0]),
                                  [module.hessian(0, x, w, None, [1.0]) for x, w in zip(X, W, strict=True)])
    np.testing.assert_array_equal(module.adjoint(0, X, W[0], None, [1.0]).params,
                                  [module.adjoint(0, x, W[0], None, [1.0]).params for x in X])


def test_faults() -> None:
    module = sd.systems.get("pendulum").embedding().compile(backend="numpy")
    with pytest.raises(ArgumentError, match=r"weights has the shape \(3,\); pass 2 finite numbers, or rows of them"):
        module.adjoint(0, [0, 0], [1, 2, 3])
    with pytest.raises(ArgumentError, match=r"weights has nan; pass 2 finite numbers"):
        module.hessian(0, [0, 0], [1, np.nan])
    with pytest.raises(ArgumentError, match=r"along has the shape \(1,\); pass 2 finite numbers"):
        module.hessian(0, [0, 0], [1, 2], along=[1])
    with pytest.raises(ArgumentError, match="adjoint by ud asked for; there are x, inputs, params, t"):
        module.adjoint(0, [0, 0], [1, 2], wrt=["ud"])
    with pytest.raises(ArgumentError, match="wrt is 'x'; pass a list"):
        module.hessian(0, [0, 0], [1, 2], wrt="x")


def test_states_that_depend_on_multipliers_are_rejected() -> None:
    x, y, phi, z = sd.coordinates("x y phi z")
    system = sd.System("bead", gravity=[0, -9.81])
    bead = system.add_body("bead", mass=1, inertia=1)
    system.add_joint(sd.Planar("plane", system.ground, bead, [x, y, phi]))
    system.add_constraint(x**2 + y**2 - 1, name="circle")
    system.add_state(z, sd.multiplier("circle"))
    with pytest.raises(SymdynError, match="the rate of a state depends on multipliers or reactions"):
        system.augmented().quantity("adjoint")
