"""Functions for PyTorch: the same numbers as the module, exact derivatives, batches, float32, messages."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

import symdyn as sd

torch = pytest.importorskip("torch")
PAGE = Path(__file__).parent.parent.parent / "docs" / "other_libraries.md"


@pytest.mark.parametrize("name", ["cart_pole", "four_bar", "rolling_disc", "floating_crane"])
def test_values_and_derivatives(name: str) -> None:
    system = sd.systems.get(name)
    equations = system.augmented() if system.loops or system.constraints else system.embedding()
    module = equations.compile()
    rng = np.random.default_rng(1)
    start = np.array([module.metadata.initial.get(k, 0.0) for k in module.metadata.x])
    x, p = start + 0.3 * rng.normal(size=(1000, len(start))), np.array(module.default_parameters)
    inputs, t = rng.normal(size=(1000, len(module.metadata.inputs))), rng.uniform(0, 2, 1000)
    f = equations.to_torch("rhs")
    found = f(*map(torch.tensor, (t, x, p, inputs))).numpy()
    wanted = module.rhs(t, x, p, inputs)
    errors = np.abs(found - wanted).max(axis=1) / np.abs(wanted).max(axis=1)
    assert np.median(errors) < 3e-15 and errors.max() < 1e-12
    exact = module.jacobian(t[0], x[0], p, inputs[0])
    given = tuple(map(torch.tensor, (x[0], p, inputs[0])))
    slopes = torch.autograd.functional.jacobian(lambda *a: f(t[0], *a), given)
    for found, by in zip(slopes, (exact.x, exact.params, exact.inputs), strict=True):
        assert np.abs(found.numpy() - by).max(initial=0) <= 1e-11 * np.abs(by).max(initial=1e-300)


def test_broadcast_parameters_collect_gradients() -> None:
    """Gradients of a sum over states, which are sums of those of each."""
    equations = sd.systems.double_pendulum().embedding()
    module = equations.compile()
    x = 0.3 * np.random.default_rng(2).normal(size=(7, 4))
    p = torch.tensor(module.default_parameters, requires_grad=True)
    equations.to_torch("rhs")(0.0, torch.tensor(x), p).sum().backward()
    wanted = sum(module.jacobian(0.0, state).params.sum(axis=0) for state in x)
    np.testing.assert_allclose(p.grad.numpy(), wanted, rtol=1e-11)


def test_second_derivatives_and_transforms() -> None:
    equations = sd.systems.double_pendulum().embedding()
    module, f = equations.compile(), equations.to_torch("rhs")
    x = torch.tensor([0.3, -0.2, 0.5, 0.7], dtype=torch.float64)
    hessian = torch.autograd.functional.hessian(lambda x: f(0.0, x)[-1], x)
    np.testing.assert_allclose(hessian.numpy(), module.hessian(0.0, x.numpy(), [0, 0, 0, 1.0], wrt=["x"]), rtol=1e-10, atol=1e-10)
    forward = torch.func.jacfwd(lambda x: f(0.0, x))(x)
    np.testing.assert_allclose(forward.numpy(), module.jacobian(0.0, x.numpy()).x, rtol=1e-11, atol=1e-11)


def test_float32() -> None:
    equations = sd.systems.four_bar().augmented()
    module = equations.compile()
    x = (0.3 * np.random.default_rng(2).normal(size=(1000, 6))).astype(np.float32)
    found = equations.to_torch("rhs", dtype="float32")(0.0, torch.tensor(x))
    assert found.dtype == torch.float32
    wanted = module.rhs(0.0, x.astype(float))
    errors = np.abs(found.numpy() - wanted).max(axis=1) / np.abs(wanted).max(axis=1)
    there = np.isfinite(errors)
    # Where the constraints nearly depend on each other there is no result.
    assert there.sum() > 980 and np.median(errors[there]) < 1e-5 and errors[there].max() < 1e-3


def test_what_branches_raises_where_it_has_no_derivative() -> None:
    equations = sd.systems.floating_crane().embedding()
    data = equations.compile().metadata
    f = equations.to_torch("rhs")
    x, inputs = torch.full((len(data.x),), 0.1, dtype=torch.float64), torch.zeros(len(data.inputs))
    with pytest.raises(RuntimeError, match="a second derivative of floating_crane is needed through symdyn_cube"):
        torch.autograd.functional.hessian(lambda x: f(0.0, x, None, inputs)[-1], x)
    with pytest.raises(RuntimeError, match=r"torch.func cannot transform it; take backward"):
        torch.func.jacfwd(lambda x: f(0.0, x, None, inputs))(x)


def test_nan_and_messages() -> None:
    f = sd.systems.pendulum().embedding().to_torch("rhs")
    assert torch.isnan(f(0.0, [0.1, 0.0], {"l": 0.0})).all() and torch.isfinite(f(0.0, [0.1, 0.0])).all()
    with pytest.raises(ValueError, match=r"x has the shape \(3,\), needed are 2 numbers along the last axis"):
        f(0.0, [0.1, 0.0, 0.0])
    with pytest.raises(ValueError, match="there is no parameter length"):
        f(0.0, [0.1, 0.0], {"length": 1.0})


def test_inputs_by_name() -> None:
    equations = sd.systems.two_link_arm().embedding()
    module, f, x = equations.compile("c"), equations.to_torch("rhs"), [0.1, 0.2, 0.3, 0.4]
    for given in ([1.0, 2.0], {"tau2": 2.0, "tau1": 1.0}, {"tau1": 1.0}, {}, (), None):
        np.testing.assert_allclose(f(0.0, x, {"m1": 3.0}, given), module.rhs(0.0, x, {"m1": 3.0}, given), rtol=1e-13)
    assert f(0.0, x, None, {"tau1": torch.linspace(0, 1, 5)}).shape == (5, 4)
    with pytest.raises(ValueError, match="there is no input tau3, there are tau1, tau2"):
        f(0.0, x, None, {"tau3": 1.0})


def test_the_page() -> None:
    """The example of the documentation runs."""
    block = next(b for b in re.findall(r"```py\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL) if "import torch" in b)
    exec(block, {})
