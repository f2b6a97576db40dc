"""Modules: values by name, symbol or order; every fault said; Jacobians exact; any number of states and threads."""

from __future__ import annotations

import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import mpmath
import numpy as np
import pytest
import sympy as sp

import symdyn as sd
from symdyn.errors import ArgumentError, CompilerNotFound, EvaluationError, SymdynError
from symdyn.runtime.building.compiler import find_compiler
from symdyn.tape.evaluate import evaluate


@pytest.fixture
def sink(compiled: Callable[..., Any], backend: str) -> Any:
    return compiled("kitchen_sink", backend)


X = [0.3, -0.8, 1.5, 0.4]


# -- parameters


def test_no_body_has_a_negative_mass(double: Any) -> None:
    message = "double_pendulum: the parameter m1, the mass of body 'rod1', is -1e\\+06 kg; pass a number that is not below zero"
    given = {"m1": -1e6}
    for run in (lambda: double.simulate((0, 1), params=given), lambda: double.equilibrium(params=given),
                lambda: double.linearize(X, params=given)):
        with pytest.raises(ArgumentError, match=message):
            run()
    assert double.simulate((0, 0.1), params={"g": -9.81}).success


def test_parameters_in_every_form(double: Any) -> None:
    m1, g = sp.symbols("m1 g")
    names = double.metadata.parameters
    array = double.parameters()
    np.testing.assert_array_equal(array, double.metadata.defaults)
    changed = array.copy()
    changed[names.index("m1")], changed[names.index("g")] = 2.5, 1.6
    wanted = double.rhs(0.0, X, changed)
    assert not np.allclose(wanted, double.rhs(0.0, X))
    for params in ({"m1": 2.5, "g": 1.6}, {m1: 2.5, g: 1.6}, {m1: 2.5, "g": sp.Rational(8, 5)}, list(changed), tuple(changed)):
        np.testing.assert_array_equal(double.rhs(0.0, X, params), wanted)
        np.testing.assert_array_equal(double.parameters(params), changed)
    np.testing.assert_array_equal(double.rhs(0.0, X, None), double.rhs(0.0, X, {}))


def test_parameters_without_defaults_are_listed() -> None:
    system = sd.systems.double_pendulum()
    system.defaults = {}
    module = system.embedding().compile(backend="numpy")
    with pytest.raises(ArgumentError) as caught:
        module.rhs(0.0, X, {"m1": 1.0, "l1": 1.0, "lc1": 0.5})
    assert str(caught.value) == "double_pendulum: parameters: no value for g, I1, m2, lc2, I2, which have no default"
    with pytest.raises(ArgumentError, match=r"no value for I2, which has no default"):
        module.bind(dict.fromkeys(["g", "m1", "lc1", "I1", "m2", "lc2", "l1"], 1.0))


@pytest.mark.parametrize(("params", "message"), [
    ({"m3": 1.0}, r"there is no 'm3', did you mean m\d or"),
    ({"gravity": 1.0}, "there is no 'gravity'"),
    ({"xyzzy": 1.0}, "there is no 'xyzzy'; there are g, m1, lc1, I1, m2, lc2, I2, l1"),
    ({"m1": "heavy", "m33": 2.0}, r"the value of m1 is 'heavy', not a number; there is no 'm33'"),
    ({"m1": float("nan")}, "must be finite, found m1 = nan"),
    ([float("inf")] + [1.0] * 7, "must be finite, found g = inf"),
    ([1.0, 2.0], r"has the shape \(2,\), needed are 8 numbers: g, m1"),
    (np.ones((2, 8)), r"has the shape \(2, 8\), needed are 8 numbers"),
    (3.0, r"has the shape \(\), needed are 8 numbers"),
    ("m1", "must be numbers, found 'm1'"),
])
def test_parameters_that_do_not_fit(double: Any, params: Any, message: str) -> None:
    for call in (double.parameters, double.bind, lambda p: double.energy([0, 0], [0, 0], p), lambda p: double.rhs(0.0, X, p)):
        with pytest.raises(ArgumentError, match=message) as caught:
            call(params)
        assert str(caught.value).startswith("double_pendulum: parameters")


def test_changes_in_place_are_noticed(double: Any) -> None:
    array, mapping, numbers = double.parameters(), {"m1": 1.0, "m2": 3.0}, double.parameters().tolist()
    for params in (array, mapping, numbers):
        double.rhs(0.0, X, params), double.energy(X[:2], X[2:], params)
    array[1], mapping["m1"], numbers[1] = 2.0, 2.0, 2.0
    for params in (array, mapping, numbers):
        fresh = params.copy()
        np.testing.assert_array_equal(double.rhs(0.0, X, params), double.rhs(0.0, X, fresh))
        np.testing.assert_array_equal(double.energy(X[:2], X[2:], params), double.energy(X[:2], X[2:], fresh))
    double.rhs(0.0, X, mapping)
    mapping.clear()  # the same numbers under other names
    mapping.update({"m2": 2.0, "g": 3.0})
    found = double.rhs(0.0, X, mapping)
    np.testing.assert_array_equal(found, double.rhs(0.0, X, dict(mapping)))


def test_parameters_that_fail_leave_no_trace(double: Any) -> None:
    wanted = double.rhs(0.0, X)
    massless = {"m1": 0.0, "m2": 0.0, "I1": 0.0, "I2": 0.0}
    for _ in range(2):
        with pytest.raises(EvaluationError, match=r"double_pendulum: .*the mass matrix is not positive definite at q2_dot"):
            double.rhs(0.0, X, massless)
        np.testing.assert_array_equal(double.rhs(0.0, X), wanted)


@pytest.mark.parametrize("mass", [0.0, -1.0])
def test_pivot_that_is_a_parameter(compiled: Callable[..., Any], backend: str, mass: float) -> None:
    module = compiled("prismatic_chain", backend)
    with pytest.raises(EvaluationError, match="the mass matrix is not positive definite at q2_dot"):
        module.rhs(0.0, [0.0] * 4, {"m2": mass}, [1.0, 1.0])


def test_only_what_divides_by_a_pivot_demands_it(compiled: Callable[..., Any], backend: str) -> None:
    """Where the mass matrix is singular it can be looked at, but not solved with."""
    module = compiled("vehicle_on_rotating_track", backend, track_inertia=False)
    lost = (r"rhs .*not positive definite at q2_dot: at this position it moves nothing that has mass; at t = 0, q1 = 0, q2 = 1, "
            r"q1_dot = 3")
    with pytest.raises(EvaluationError, match=lost):
        module.rhs(0.0, [0.0, 1.0, 3.0, 0.0])
    np.testing.assert_array_equal(module.mass_matrix([0.0, 1.0]), [[1.0, 0.0], [0.0, 0.0]])


def test_bind(oscillator: Any) -> None:
    bound = oscillator.bind({"m": 4.0})
    x, inputs = [0.1, 0.2, 0.3], [0.5, -0.5]
    np.testing.assert_array_equal(bound.rhs(0.0, x, inputs), oscillator.rhs(0.0, x, {"m": 4.0}, inputs))
    # Inputs that are left out are zero, whatever was there before.
    np.testing.assert_array_equal(bound.rhs(0.0, x), oscillator.rhs(0.0, x, {"m": 4.0}))
    np.testing.assert_array_equal(bound.jacobian_x(0.0, x, inputs), oscillator.jacobian(0.0, x, {"m": 4.0}, inputs).x)
    np.testing.assert_array_equal(bound.params, oscillator.parameters({"m": 4.0}))
    for arguments in ((0.0, [0.1]), (0.0, x, [0.5]), (0.0, [*x, 0.0], inputs)):
        with pytest.raises(ArgumentError, match="needed are 3 and 2"):
            bound.rhs(*arguments)
        with pytest.raises(ArgumentError, match="needed are 3 and 2"):
            bound.jacobian_x(*arguments)


# -- states


def test_results_are_the_callers_own(double: Any) -> None:
    first = double.rhs(0.0, X)
    kept = first.copy()
    double.rhs(0.0, [1.0, 2.0, 3.0, 4.0])
    np.testing.assert_array_equal(first, kept)


def test_rows_of_states(sink: Any) -> None:
    rng = np.random.default_rng(3)
    t, x, inputs = rng.uniform(0, 1, 5), rng.uniform(-1, 1, (5, 8)), rng.uniform(-1, 1, (5, 2))
    for name in ("rhs", "mass_matrix", "energy", "outputs", "J", "jacobian_x"):
        rows = sink.evaluate(name, t, x, None, inputs)
        assert rows.shape == (5, *sink.shape(name))
        for k in range(5):
            one = sink.evaluate(name, t[k], x[k], None, inputs[k])
            np.testing.assert_allclose(rows[k], one, rtol=1e-14, atol=1e-14)
        held = sink.evaluate(name, 0.2, x, None, inputs[0])
        np.testing.assert_allclose(held[3], sink.evaluate(name, 0.2, x[3], None, inputs[0]), rtol=1e-14, atol=1e-14)
        assert sink.evaluate(name, 0.2, x[:0], None, inputs[0]).shape == (0, *sink.shape(name))
    with pytest.raises(ArgumentError, match=r"t, x, inputs and ud have \[1, 5, 3, 1\] rows"):
        sink.evaluate("rhs", 0.0, x, None, inputs[:3])


def test_rhs_of_rows(double: Any) -> None:
    """As many states as a state has entries, times without states, one row: nothing is mistaken for one state."""
    x = np.random.default_rng(4).uniform(-1, 1, (4, 4))
    for rows in (x, x[:1], x[:3]):
        np.testing.assert_allclose(double.rhs(0.0, rows), [double.rhs(0.0, row) for row in rows], rtol=1e-14)
    assert double.rhs(np.zeros(6), x[0]).shape == (6, 4)
    np.testing.assert_array_equal(double.rhs(0.0, {"q1": 0.3, "q2": 0.0, "q1_dot": 1.5, "q2_dot": 0.0}),
                                  double.rhs(0.0, [0.3, 0.0, 1.5, 0.0]))


@pytest.mark.parametrize(("x", "message"), [
    ([0.0] * 3, r"x has the shape \(3,\), needed are 4 numbers a state: q1, q2, q1_dot, q2_dot"),
    ([[0.0] * 3] * 4, r"x has the shape \(4, 3\)"),
    (np.zeros((4, 1)), r"x has the shape \(4, 1\)"),
    (1.0, r"x has the shape \(\)"),
    ("abcd", "x must be numbers, found 'abcd'"),
    ({"q3": 1.0}, "there is no 'q3', did you mean"),
])
def test_states_that_do_not_fit(double: Any, x: Any, message: str) -> None:
    with pytest.raises(ArgumentError, match=message):
        double.rhs(0.0, x)
    with pytest.raises(ArgumentError, match=message):
        double.evaluate("energy", 0.0, x)


def test_coordinates_speeds_and_inputs_that_do_not_fit(oscillator: Any, double: Any) -> None:
    with pytest.raises(ArgumentError, match=r"q has the shape \(3,\), needed are 2 numbers a state: q1, q2"):
        double.mass_matrix([1.0, 2.0, 3.0])
    with pytest.raises(ArgumentError, match="q has 3 rows and u has 2"):
        double.energy(np.zeros((3, 2)), np.zeros((2, 2)))
    with pytest.raises(ArgumentError, match=r"inputs has the shape \(1,\), needed are 2 numbers a state: F, G"):
        oscillator.rhs(0.0, [0.0] * 3, None, [1.0])
    with pytest.raises(ArgumentError, match=r"ud has the shape \(2,\)"):
        oscillator.inverse_dynamics([0.0], [0.0], [0.0, 0.0])


def test_not_finite(double: Any) -> None:
    with pytest.raises(EvaluationError, match=r"rhs cannot be evaluated: .*q2 = nan.*\(q2 given not finite\)"):
        double.rhs(0.0, [0.0, np.nan, 0.0, 0.0])
    with pytest.raises(EvaluationError, match="rhs cannot be evaluated"):
        double.rhs(0.0, [[0.0] * 4, [0.0, np.inf, 0.0, 0.0]])


# -- what the functions mean


def test_inverse_dynamics_undoes_rhs(sink: Any) -> None:
    rng = np.random.default_rng(6)
    for _ in range(3):
        q, u, inputs, t = rng.uniform(-1, 1, 3), rng.uniform(-1, 1, 3), rng.uniform(-1, 1, 2), rng.uniform()
        states = [sink.metadata.initial.get(z, 0.0) for z in sink.metadata.z]
        ud = sink.rhs(t, [*q, *u, *states], None, inputs)[3:6]
        tau = sink.inverse_dynamics(q, u, ud, None, t, inputs)
        np.testing.assert_allclose(tau, 0, atol=1e-12 * np.abs(ud).max())
        wanted = (sink.mass_matrix(q, None, t) @ [1.0, 2.0, 3.0] + sink.k_tilde(q, u, None, t)
                  - sink.F_tilde(q, u, None, t, inputs))
        np.testing.assert_allclose(sink.inverse_dynamics(q, u, [1.0, 2.0, 3.0], None, t, inputs), wanted, rtol=1e-12)


def test_energy_is_that_of_the_mass_matrix(double: Any) -> None:
    q, u = np.array(X[:2]), np.array(X[2:])
    kinetic, potential = double.energy(q, u)
    np.testing.assert_allclose(kinetic, u @ double.mass_matrix(q) @ u / 2, rtol=1e-14)
    assert potential == double.energy(q, [0.0, 0.0])[1]


def test_outputs_by_name(sink: Any, oscillator: Any, double: Any) -> None:
    x = np.linspace(-0.4, 0.5, 8)
    outputs = sink.outputs(0.1, x, None, [0.1, 0.2])
    assert {n: v.shape for n, v in outputs.items()} == {"tip": (3,), "tip_velocity": (3,), "smooth": (), "pair": (2,)}
    rows = sink.outputs(0.1, [x, x], None, [0.1, 0.2])
    assert {n: v.shape for n, v in rows.items()} == {"tip": (2, 3), "tip_velocity": (2, 3), "smooth": (2,), "pair": (2, 2)}
    assert oscillator.outputs(0.0, [2.0, 0.0, 0.0]) == {"force": 6.0}
    with pytest.raises(SymdynError, match="has no function outputs"):
        double.outputs(0.0, X)


def test_function_and_lambdify(sink: Any, double: Any, derived: Callable[..., Any]) -> None:
    q, u, inputs = [0.1, 0.2, 0.3], [0.4, 0.5, 0.6], [0.7, 0.8]
    F_tilde = sink.function("F_tilde")
    np.testing.assert_array_equal(F_tilde(q, u, {"m1": 3.0}, 0.4, inputs), sink.F_tilde(q, u, {"m1": 3.0}, 0.4, inputs))
    np.testing.assert_array_equal(F_tilde(q, u, inputs=inputs), sink.F_tilde(q, u, None, 0.0, inputs))
    assert not np.array_equal(sink.F_tilde(q, u, None, 0.0, inputs), sink.F_tilde(q, u, None, 1.0, inputs))
    assert F_tilde([q] * 4, [u] * 4, None, np.zeros(4)).shape == (4, 3)
    k_tilde = derived("double_pendulum").lambdify("k_tilde")
    np.testing.assert_allclose(k_tilde(X[:2], X[2:]), double.k_tilde(X[:2], X[2:]), rtol=1e-14)
    assert derived("double_pendulum").lambdify("mass_matrix")([0.1, 0.2]).shape == (2, 2)
    with pytest.raises(SymdynError, match="has no function velocity; it has rhs, mass_matrix"):
        sink.function("velocity")


# -- Jacobians


def differences(module: Any, t: float, x: Any, p: Any, inputs: Any) -> list[np.ndarray]:
    """Central differences of rhs by state, inputs and parameters."""

    def by(values: np.ndarray, f: Callable[[np.ndarray], np.ndarray]) -> np.ndarray:
        columns = []
        for k in range(len(values)):
            h = np.zeros(len(values))
            h[k] = 6e-6 * (abs(values[k]) or 1.0)
            columns.append((f(values + h) - f(values - h)) / (2 * h[k]))
        return np.array(columns).T.reshape(len(x), len(values))

    return [by(x, lambda v: module.rhs(t, v, p, inputs)), by(inputs, lambda v: module.rhs(t, x, p, v)),
            by(p, lambda v: module.rhs(t, x, v, inputs))]


@pytest.mark.parametrize("name", ["double_pendulum", "three_link_arm", "kitchen_sink", "driven_oscillator"])
def test_jacobian_against_differences(name: str, compiled: Callable[..., Any], backend: str) -> None:
    module = compiled(name, backend)
    sizes = module.metadata.sizes
    rng = np.random.default_rng(7)
    x, inputs, p = rng.uniform(-1, 1, sizes.x), rng.uniform(-1, 1, sizes.inputs), module.parameters()
    exact = module.jacobian(0.3, x, p, inputs)
    for found, wanted in zip(exact, differences(module, 0.3, x, p, inputs), strict=True):
        assert found.shape == wanted.shape
        assert np.abs(found - wanted).max(initial=0) <= 1e-7 * max(1.0, np.abs(wanted).max(initial=0))


def test_jacobian_against_30_digits(sink: Any, derived: Callable[..., Any]) -> None:
    """Central differences of the tape at 80 digits, whose error is below 1e-30."""
    s = derived("kitchen_sink").symbols
    tape = derived("kitchen_sink").tape("rhs")
    rng = np.random.default_rng(8)
    values = {a.name: float(rng.uniform(-1, 1)) for a in (*s.coordinates, *s.speeds, *s.states, *s.inputs)}
    values |= {a.name: s.defaults[a] for a in s.parameters} | {"t": 0.7}
    x = [values[a.name] for a in (*s.coordinates, *s.speeds, *s.states)]
    exact = sink.jacobian(0.7, x, None, [values[a.name] for a in s.inputs])
    groups = ((*s.coordinates, *s.speeds, *s.states), s.inputs, s.parameters)
    with mpmath.workdps(80):
        h = mpmath.mpf(10) ** -25
        for found, symbols in zip(exact, groups, strict=True):
            columns = []
            for symbol in symbols:
                sides = [evaluate(tape, {**values, symbol.name: mpmath.mpf(values[symbol.name]) + sign * h}, 80)["rhs"]
                         for sign in (1, -1)]
                columns.append(((sides[0] - sides[1]) / (2 * h)).astype(float))
            wanted = np.array(columns).T
            np.testing.assert_allclose(found, wanted, rtol=0, atol=1e-13 * np.abs(wanted).max())


def test_jacobian_by_some(double: Any) -> None:
    assert double.jacobian(0.0, X, wrt=("x",)).x.shape == (4, 4)
    only = double.jacobian(0.0, X, wrt=("params",))
    assert only.x is None and only.inputs is None and only.params.shape == (4, 8)
    assert double.jacobian(0.0, X).inputs.shape == (4, 0)
    with pytest.raises(ArgumentError, match="jacobian by u asked for; there are x, inputs, params, t and ud"):
        double.jacobian(0.0, X, wrt=("x", "u"))


# -- threads


def test_threads_with_their_own_parameters(compiled: Callable[..., Any], backend: str) -> None:
    module = compiled("double_pendulum", backend)
    rng = np.random.default_rng(9)
    params = [module.parameters() * rng.uniform(0.5, 1.5, 8) for _ in range(8)]
    x = rng.uniform(-1, 1, (40, 4))
    wanted = [[module.bind(p).rhs(0.0, row) for row in x] for p in params]
    rows = [module.evaluate("energy", 0.0, x, p) for p in params]
    ends = [module.simulate((0, 1), params=p).x[-1] for p in params]
    faults: list[Any] = []
    barrier = threading.Barrier(8)

    def work(k: int) -> None:
        barrier.wait()
        for n in range(20):
            here, other = params[k], params[(k + 1) % 8]
            for row, result in zip(x[n % 4::4], wanted[k][n % 4::4], strict=True):
                if not np.array_equal(module.rhs(0.0, row, here), result):
                    faults.append(("rhs", k, n))
            if not np.array_equal(module.evaluate("energy", 0.0, x, other), rows[(k + 1) % 8]):
                faults.append(("energy", k, n))
            if n % 10 == 0 and not np.array_equal(module.simulate((0, 1), params=here).x[-1], ends[k]):
                faults.append(("simulate", k, n))

    run_in_threads(work)
    assert not faults


def test_threads_that_all_call_first(derived: Callable[..., Any], backend: str) -> None:
    """Nothing is compiled yet; the derivation behind it is recorded by one thread at a time."""
    if backend == "c" and find_compiler() is None:
        pytest.skip("no C compiler here")
    module = sd.systems.two_link_arm().embedding().compile(backend=backend)
    functions = ["rhs", "mass_matrix", "k_tilde", "F_tilde", "energy", "J", "outputs", "inverse_dynamics"]
    results: dict[int, Any] = {}
    barrier = threading.Barrier(8)

    def work(k: int) -> None:
        barrier.wait()
        results[k] = [module.evaluate(f, 0.0, X) for f in functions[k:] + functions[:k]]

    run_in_threads(work)
    wanted = [module.evaluate(f, 0.0, X) for f in functions]
    for k in range(8):
        for found, f in zip(results[k], functions[k:] + functions[:k], strict=True):
            np.testing.assert_array_equal(found, wanted[functions.index(f)])


def run_in_threads(work: Callable[[int], None]) -> None:
    threads = [threading.Thread(target=work, args=(k,)) for k in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()


# -- about modules


def test_written_files(double: Any, backend: str, tmp_path: Path) -> None:
    paths = double.write(tmp_path / "new" / "folder")
    wanted = {"c": ["double_pendulum.c", "double_pendulum.h", "main.c"], "numpy": ["double_pendulum.py"]}[backend]
    assert [p.name for p in paths] == wanted and all(p.stat().st_size > 500 for p in paths)


def test_repr_and_functions(double: Any, backend: str) -> None:
    assert repr(double) == f"<Module double_pendulum: {backend}, 2 coordinates, 2 speeds, 8 parameters>"
    assert {"rhs", "mass_matrix", "jacobian_x"} <= set(double.functions) and "outputs" not in double.functions


def test_without_a_compiler(derived: Callable[..., Any], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SYMDYN_CC", "none")
    module = derived("pendulum").compile()
    assert module.backend == "numpy" and "SYMDYN_CC" in module.fallback
    assert module.rhs(0.0, [0.0, 1.0]).tolist() == [1.0, 0.0]
    with pytest.raises(CompilerNotFound, match="SYMDYN_CC"):
        derived("pendulum").compile(backend="c")
    with pytest.raises(SymdynError, match="backend 'fortran' asked for; modules can be loaded from 'c' and 'numpy'"):
        derived("pendulum").compile(backend="fortran")


def test_with_a_compiler_c_is_chosen(derived: Callable[..., Any]) -> None:
    if find_compiler() is None:
        pytest.skip("no C compiler here")
    module = derived("pendulum").compile()
    assert module.backend == "c" and module.fallback == ""
