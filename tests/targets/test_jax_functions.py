"""Functions for JAX: the same numbers as the C module, exact derivatives, batches, float32, the C library, messages.

Functions that are computed once are under `jax.jit` in most tests: otherwise XLA compiles every operation by itself, which takes
seconds.
"""

from __future__ import annotations

import functools
import re
import sys
import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import symdyn as sd
from symdyn.runtime.building.compiler import find_compiler
from tests.helpers import swept

jax = pytest.importorskip("jax")
jnp = pytest.importorskip("jax.numpy")
PAGE = Path(__file__).parent.parent.parent / "docs" / "other_libraries.md"
THROUGH = ["xla", *["c"] * (find_compiler() is not None)]
pytestmark = pytest.mark.native  # the library for XLA has headers


@pytest.fixture(autouse=True)
def _in_doubles() -> Iterator[None]:
    before = jax.config.jax_enable_x64
    jax.config.update("jax_enable_x64", True)
    yield
    jax.config.update("jax_enable_x64", before)


@functools.cache
def made(name: str) -> tuple[Any, Any]:
    system = sd.systems.get(name)
    equations = system.augmented() if system.loops or system.constraints else system.embedding()
    return equations, equations.compile()


def states(module: Any, n: int) -> tuple[np.ndarray, ...]:
    rng = np.random.default_rng(1)
    data = module.metadata
    start = np.array([data.initial.get(k, 0.0) for k in data.x])
    return (rng.uniform(0, 2, n), start + 0.3 * rng.normal(size=(n, len(start))), np.array(module.default_parameters),
            rng.normal(size=(n, len(data.inputs))))


@pytest.mark.every_value
@pytest.mark.parametrize("through", THROUGH)
@pytest.mark.parametrize("name", swept(["cart_pole", "spatial_chain", "four_bar", "vehicle_on_rotating_track_absolute",
                                        "rolling_disc", "floating_crane"], "cart_pole", "four_bar", "rolling_disc",
                                       "floating_crane"))
def test_the_same_as_the_module_at_1000_states(name: str, through: str) -> None:
    equations, module = made(name)
    t, x, p, inputs = states(module, 1000)
    f = equations.to_jax("rhs", through=through)
    found = np.asarray(jax.jit(jax.vmap(f, (0, 0, None, 0)))(t, x, p, inputs))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        wanted = module.rhs(t, x, p, inputs)
    there = np.isfinite(wanted).all(axis=1)
    assert there.sum() > 900 and np.isnan(found[~there]).any(axis=1).all()
    errors = np.abs(found - wanted)[there].max(axis=1) / np.abs(wanted[there]).max(axis=1)
    assert np.median(errors) < 3e-15 and errors.max() < (1e-12 if through == "xla" else 1e-15)


@pytest.mark.parametrize(("name", "through"), swept(
    [(name, through) for name in ("four_bar", "pendulum_absolute", "floating_crane", "two_link_arm", "cart_pole")
     for through in THROUGH],
    ("pendulum_absolute", "xla"), *[(name, through) for name in ("floating_crane", "two_link_arm") for through in THROUGH[1:]]))
def test_derivatives_are_exact(name: str, through: str) -> None:
    """Forward and backward, by state, parameters and inputs, compared with those of the module."""
    equations, module = made(name)
    t, x, p, inputs = (a[0] if a.ndim > 1 else a for a in states(module, 1))
    f = equations.to_jax("rhs", through=through)
    wanted = module.jacobian(t[0], x, p, inputs)
    for way in (jax.jacfwd, jax.jacrev):
        by_all = jax.jit(way(f, (1, 2, 3)))(t[0], x, p, inputs)
        for found, exact in zip(by_all, (wanted.x, wanted.params, wanted.inputs), strict=True):
            assert np.abs(found - exact).max(initial=0) <= 1e-11 * np.abs(exact).max(initial=1e-300)


@pytest.mark.parametrize("unroll", [False, True])
def test_second_derivatives_and_both_ways_to_run(unroll: bool) -> None:
    equations, module = made("double_pendulum")
    f = equations.to_jax("rhs", unroll=unroll)
    x = np.array([0.3, -0.2, 0.5, 0.7])
    np.testing.assert_allclose(np.asarray(f(0.0, x)), module.rhs(0.0, x), rtol=1e-13)
    hessian = np.asarray(jax.jit(jax.jacfwd(jax.grad(lambda x: f(0.0, x)[-1])))(x))
    wanted = module.hessian(0.0, x, [0, 0, 0, 1.0], wrt=["x"])
    np.testing.assert_allclose(hessian, wanted, rtol=1e-10, atol=1e-10)


@pytest.mark.parametrize("through", THROUGH)
def test_batches_of_batches(through: str) -> None:
    """Over states, times and parameters, in either order of axes."""
    equations, module = made("four_bar")
    t, x, p, _ = states(module, 3)
    f = equations.to_jax("rhs", through=through)
    several = p * np.array([[1.0], [1.1]])
    inner = jax.vmap(f, (0, 0, None))
    found = np.asarray(jax.jit(jax.vmap(inner, (None, None, 0)))(t, x, several))
    wanted = [[module.rhs(time, state, q) for time, state in zip(t, x, strict=True)] for q in several]
    np.testing.assert_allclose(found, wanted, rtol=1e-11, atol=1e-11)
    turned = jax.jit(jax.vmap(lambda state: f(0.0, state), in_axes=1, out_axes=1))(x.T)
    np.testing.assert_allclose(np.asarray(turned), np.array([module.rhs(0.0, state) for state in x]).T, rtol=1e-11, atol=1e-11)


@pytest.mark.every_value
@pytest.mark.parametrize("through", THROUGH)
@pytest.mark.parametrize("name", ["two_link_arm", "four_bar", "floating_crane"])
def test_float32(name: str, through: str) -> None:
    equations, module = made(name)
    t, x, p, inputs = (a.astype(np.float32) for a in states(module, 1000))
    f = equations.to_jax("rhs", dtype="float32", through=through)
    found = jax.jit(jax.vmap(f, (0, 0, None, 0)))(t, x, p, inputs)
    assert found.dtype == np.float32
    wanted = module.rhs(t.astype(float), x.astype(float), p.astype(float), inputs.astype(float))
    errors = np.abs(np.asarray(found, float) - wanted).max(axis=1) / np.abs(wanted).max(axis=1)
    assert np.median(errors) < 1e-6
    # In the four-bar linkage the constraints amplify rounding.
    assert errors.max() < (1e-7 if through == "c" else 1e-4 if name == "four_bar" else 1e-5)


def test_float32_gives_nan_where_constraints_nearly_depend_on_each_other() -> None:
    equations, module = made("bricard")
    t, x, p, _ = (a.astype(np.float32) for a in states(module, 1000))
    found = np.asarray(jax.jit(jax.vmap(equations.to_jax("rhs", dtype="float32"), (0, 0, None)))(t, x, p), float)
    wanted = module.rhs(t.astype(float), x.astype(float), p.astype(float))
    there = np.isfinite(found).all(axis=1)
    errors = np.abs(found - wanted)[there].max(axis=1) / np.abs(wanted[there]).max(axis=1)
    assert 980 < there.sum() < 1000 and errors.max() < 5e-4


def test_a_state_without_a_result_gives_nan() -> None:
    equations, _ = made("pendulum")
    for through in THROUGH:
        f = equations.to_jax("rhs", through=through)
        assert np.isnan(f(0.0, [0.1, 0.0], {"l": 0.0})).all() and np.isfinite(f(0.0, [0.1, 0.0])).all()


@pytest.mark.parametrize("through", THROUGH)
def test_inputs_by_name(through: str) -> None:
    """As module.rhs has it: what is left out has its initial value."""
    system = sd.systems.two_link_arm()
    system.initial["tau2"] = 0.4
    equations = system.embedding()
    module, f, x = equations.compile("c"), equations.to_jax("rhs", through=through), [0.1, 0.2, 0.3, 0.4]
    for given in ([1.0, 2.0], {"tau2": 2.0, "tau1": 1.0}, {"tau1": 1.0}, {}, (), None):
        np.testing.assert_allclose(f(0.0, x, {"m1": 3.0}, given), module.rhs(0.0, x, {"m1": 3.0}, given), rtol=1e-13)
    slope = jax.grad(lambda tau: f(0.0, x, None, {"tau1": tau})[2])(1.0)
    np.testing.assert_allclose(slope, module.jacobian(0.0, x, inputs={"tau1": 1.0}).inputs[2, 0], rtol=1e-13)
    with pytest.raises(ValueError, match="there is no input tau3, there are tau1, tau2"):
        f(0.0, x, None, {"tau3": 1.0})


def test_messages(monkeypatch: pytest.MonkeyPatch) -> None:
    equations, _ = made("pendulum")
    f = equations.to_jax("rhs")
    with pytest.raises(ValueError, match=r"x has the shape \(3,\), needed are 2 numbers"):
        f(0.0, [0.1, 0.0, 0.0])
    with pytest.raises(ValueError, match="there is no parameter length, there are"):
        f(0.0, [0.1, 0.0], {"length": 1.0})
    jax.config.update("jax_enable_x64", False)
    with pytest.raises(sd.ArgumentError, match="computes in float32 unless 64 bits are enabled"):
        equations.to_jax("rhs")
    jax.config.update("jax_enable_x64", True)
    monkeypatch.setenv("SYMDYN_CC", "none")
    with pytest.raises(sd.SymdynError, match="compiler"):
        equations.to_jax("rhs", through="c")


def test_the_page(monkeypatch: pytest.MonkeyPatch) -> None:
    """The example of the documentation runs."""
    block = next(b for b in re.findall(r"```py\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL) if "import jax" in b)
    exec(block, {})


def test_a_written_file_needs_symdyn_no_more(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from symdyn.cli import main

    assert main(["export", "two_link_arm", "--jax", "--functions", "rhs", "--output", str(tmp_path)]) == 0
    text = (tmp_path / "two_link_arm_jax.py").read_text(encoding="utf-8")
    assert "symdyn." not in "".join(line for line in text.splitlines() if line.startswith(("import", "from")))
    monkeypatch.syspath_prepend(str(tmp_path))
    import two_link_arm_jax  # type: ignore[import-not-found]

    _, module = made("two_link_arm")
    x = [0.1, 0.2, 0.3, 0.4]
    np.testing.assert_allclose(np.asarray(two_link_arm_jax.function("rhs")(0.0, x, inputs=[1.0, 2.0])),
                               module.rhs(0.0, x, inputs=[1.0, 2.0]), rtol=1e-13)
    sys.modules.pop("two_link_arm_jax")
