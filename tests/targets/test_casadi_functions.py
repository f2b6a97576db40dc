"""Functions for CasADi: the same numbers as the C module, exact derivatives, and messages."""

from __future__ import annotations

import sys
import warnings
from typing import Any

import numpy as np
import pytest

import symdyn as sd
from symdyn.formulation.equations import Equations
from tests.helpers import swept

ca = pytest.importorskip("casadi")

# With constraints, singular fallbacks, inputs, extra states, and with what branches.
MECHANISMS = ["cart_pole", "spatial_chain", "four_bar", "vehicle_on_rotating_track_absolute", "andrews_squeezer", "rolling_disc",
              "floating_wind_turbine", "floating_crane"]


def equations_of(name: str) -> Equations:
    system = sd.systems.get(name)
    return system.augmented() if system.loops or system.constraints else system.embedding()


def states(module: Any, n: int, seed: int = 1) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Times, states, parameters and inputs."""
    rng = np.random.default_rng(seed)
    data = module.metadata
    start = np.array([data.initial.get(k, 0.0) for k in data.x])
    return (rng.uniform(0, 2, n), start + 0.3 * rng.normal(size=(n, len(start))), np.array(module.default_parameters),
            rng.normal(size=(n, len(data.inputs))))


def difference(found: np.ndarray, wanted: np.ndarray) -> np.ndarray:
    """Difference of each row, by its largest entry."""
    return np.abs(found - wanted).max(axis=1) / np.maximum(np.abs(wanted).max(axis=1), 1e-300)


@pytest.mark.parametrize("name", swept(MECHANISMS, *[name for name in MECHANISMS if name != "floating_wind_turbine"]))
def test_the_same_as_the_c_module_at_1000_states(name: str) -> None:
    equations = equations_of(name)
    module = equations.compile(backend="c")
    t, x, p, inputs = states(module, 1000)
    f = equations.to_casadi("rhs")
    found = f.map(1000)(t, x.T, np.tile(p[:, None], 1000), inputs.T).full().T
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        wanted = module.rhs(t, x, inputs=inputs) if inputs.size else module.rhs(t, x)
    there = np.isfinite(wanted).all(axis=1)
    assert there.sum() > 900 and np.isnan(found[~there]).any(axis=1).all()
    errors = difference(found[there], wanted[there])
    assert np.median(errors) < 3e-15 and errors.max() < 1e-12


@pytest.mark.parametrize("name", swept(["cart_pole", "four_bar", "floating_wind_turbine", "floating_crane"],
                                       "cart_pole", "four_bar", "floating_crane"))
def test_derivatives_are_exact(name: str) -> None:
    """CasADi's own of the graph, and symdyn's where algorithms are called, compared with those of the C module."""
    equations = equations_of(name)
    module = equations.compile(backend="c")
    t, x, p, inputs = (a[0] if a.ndim > 1 else a for a in states(module, 1))
    f = equations.to_casadi("rhs")
    symbols = [ca.MX.sym(n, len(v)) for n, v in (("x", x), ("p", p), ("u", inputs))]
    jacobian = ca.Function("J", symbols, [ca.jacobian(f(t[0], *symbols), s) for s in symbols])
    wanted = module.jacobian(t[0], x, p, inputs)
    for found, exact in zip(jacobian(x, p, inputs), (wanted.x, wanted.params, wanted.inputs), strict=True):
        assert np.abs(found.full() - exact).max(initial=0) <= 1e-11 * np.abs(exact).max(initial=1e-300)


def test_matrices_and_accelerations() -> None:
    equations = sd.systems.two_link_arm().embedding()
    module = equations.compile(backend="c")
    q, u, ud = [0.3, -0.5], [1.0, 2.0], [0.5, -1.0]
    p = module.default_parameters
    matrix = equations.to_casadi("mass_matrix")(0, q + u, p, [0, 0]).full()
    np.testing.assert_allclose(matrix, module.mass_matrix(q), rtol=1e-14)
    forces = equations.to_casadi("inverse_dynamics")(0, q + u, p, [0, 0], ud).full().ravel()
    np.testing.assert_allclose(forces, module.inverse_dynamics(q, u, ud), rtol=1e-14)


def test_the_derivative_of_a_matrix_is_ordered_column_by_column() -> None:
    """By symdyn's own rule, which mechanisms that branch have."""
    equations = equations_of("floating_crane")
    module = equations.compile(backend="c")
    x = np.array([module.metadata.initial.get(k, 0.1) for k in module.metadata.x])
    f = equations.to_casadi("mass_matrix")
    state, p, inputs = ca.MX.sym("x", len(x)), module.default_parameters, np.zeros(len(module.metadata.inputs))
    found = ca.Function("J", [state], [ca.jacobian(ca.vec(f(0, state, p, inputs)), state)])(x).full()
    wanted = module.jacobian(0.0, x, of="mass_matrix", wrt=["x"]).x
    n = wanted.shape[0]
    np.testing.assert_allclose(found, wanted.transpose(1, 0, 2).reshape(n * n, -1), atol=1e-9 * np.abs(wanted).max())


def test_a_state_without_a_result_gives_nan() -> None:
    equations = sd.systems.pendulum().embedding()
    f = equations.to_casadi("rhs")
    assert np.isfinite(f(0, [0.1, 0], [1, 1, 9.81], []).full()).all()
    assert np.isnan(f(0, [0.1, 0], [1, 0, 9.81], []).full()).all()


def one_sided(x):  # type: ignore[no-untyped-def]  # its text goes into the file
    return np.where(x < 0, 0.0, x)


def test_functions_of_the_user() -> None:
    q = sd.coordinates("q")
    k = sd.parameters("k", positive=True)
    spring = sd.External("spring", ["x"], 1, python=one_sided)
    system = sd.System("stop")
    body = system.add_body("block", mass=2)
    system.add_joint(sd.Prismatic("rail", parent=system.ground, child=body, axis=[1, 0, 0], coordinate=q))
    system.add_force(body, [-k * spring(q), 0, 0])
    f = system.embedding().to_casadi("rhs")
    assert [float(f(0, [x, 0], [3], [])[1]) for x in (-1.0, 2.0)] == [0.0, -3.0]
    only_c = sd.External("only_c", ["x"], 1, c="static int only_c(const double *in, double *out) { out[0] = in[0]; return 0; }")
    system.add_force(body, [only_c(q), 0, 0])
    with pytest.raises(sd.SymdynError, match=r"only_c\(x\) has no text for the backend numpy, only for c; pass python="):
        system.embedding().to_casadi("rhs")


def test_messages(monkeypatch: pytest.MonkeyPatch) -> None:
    equations = sd.systems.pendulum().embedding()
    with pytest.raises(sd.SymdynError, match="work"):
        equations.to_casadi("work")
    with pytest.raises(sd.SymdynError, match="name of a function"):
        equations.to_casadi(3)  # type: ignore[arg-type]
    monkeypatch.setitem(sys.modules, "casadi", None)
    with pytest.raises(sd.MissingExtra, match=r"to_casadi needs CasADi .*pip install 'symdyn\[opt\]'"):
        equations.to_casadi("rhs")
    monkeypatch.setitem(sys.modules, "torch", None)
    with pytest.raises(sd.MissingExtra, match=r"to_torch needs PyTorch .*pip install 'symdyn\[torch\]'"):
        equations.to_torch("rhs")
    monkeypatch.setitem(sys.modules, "jax", None)
    with pytest.raises(sd.MissingExtra, match=r"to_jax needs JAX .*pip install 'symdyn\[jax\]'"):
        equations.to_jax("rhs")
    with pytest.raises(sd.ArgumentError, match="through is 'gpu'; take 'xla'"):
        equations.to_jax("rhs", through="gpu")
    with pytest.raises(sd.ArgumentError, match="unroll is 'yes'"):
        equations.to_jax("rhs", unroll="yes")  # type: ignore[arg-type]
    with pytest.raises(sd.ArgumentError, match="dtype is 'half'; take one of 'float64', 'float32'"):
        equations.to_torch("rhs", dtype="half")
