"""C, NumPy and the tape at 30 digits give the same numbers, for every function of every kind of mechanism."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import pytest

from symdyn import systems
from symdyn.functions.table import FUNCTIONS
from symdyn.functions.tapes import has_function
from symdyn.pipeline import emit
from symdyn.runtime.building.compiler import find_compiler, flags
from symdyn.runtime.building.library import CLibrary, PythonLibrary
from symdyn.tape.evaluate import evaluate
from tests.helpers import swept

# Relative to the largest entry of a result; the second column is for functions that solve with the mass matrix, where
# rounding counts in multiples of its condition number.
TOLERANCE = 1e-13
CASES = [("pendulum", {}, 1), ("double_pendulum", {}, 4), ("cart_pole", {}, 4), ("vehicle_on_rotating_track", {}, 1),
         ("prismatic_chain", {"n": 3}, 1), ("spatial_chain", {"n": 3}, 20), ("three_link_arm", {}, 20),
         ("kitchen_sink", {}, 4), ("awkward_names", {}, 20), ("driven_oscillator", {}, 1)]
# Kinds of joints and loads that others have, too.
REPEATED = "pendulum", "cart_pole", "three_link_arm"
STATES = 4


class Routes(NamedTuple):
    """Equations next to units with all of their functions."""

    equations: Any
    functions: list[str]
    units: dict[str, Any]
    factor: float


@pytest.fixture(scope="module", ids=lambda case: case[0], params=[
    pytest.param(case, marks=pytest.mark.sweep) if case[0] in REPEATED else case for case in CASES])
def routes(request: pytest.FixtureRequest, derived: Callable[..., Any]) -> Routes:
    name, options, factor = request.param
    equations = derived(name, **options)
    functions = [f for f in FUNCTIONS if has_function(equations, f)]
    units: dict[str, Any] = {}
    python = emit(equations, "numpy", functions, standalone=False)
    units["numpy"] = PythonLibrary.from_source(next(iter(python.files.values())), equations.name)
    compiler = find_compiler()
    if compiler is not None:
        c = emit(equations, "c", functions, standalone=False, integrator=False)
        units["c"] = CLibrary(next(iter(c.files.values())), c.metadata, compiler)
    return Routes(equations, functions, units, factor)


def test_all_routes_agree(routes: Routes) -> None:
    s = routes.equations.symbols
    rng = np.random.default_rng(21)
    p = np.array([s.defaults.get(a, 0.9) for a in s.parameters]) * rng.uniform(0.9, 1.1, len(s.parameters))
    evaluators = {(backend, f): unit.evaluator(f) for backend, unit in routes.units.items() for f in routes.functions}
    for evaluator in evaluators.values():
        evaluator.set_params(p)
    x = rng.uniform(-1.5, 1.5, (STATES, len(s.coordinates) + len(s.speeds) + len(s.states)))
    t, inputs = rng.uniform(0, 3, STATES), rng.uniform(-1, 1, (STATES, len(s.inputs)))
    ud = rng.uniform(-2, 2, (STATES, len(s.speeds)))
    for f in (f for f in routes.functions if f != "switches"):  # what chatters is looked for in modules only
        many = {backend: evaluators[backend, f].many(t, x, inputs, ud) for backend in routes.units}
        for k in range(STATES):
            wanted = _exact(routes.equations, f, t[k], x[k], inputs[k], ud[k], p)
            least = 1.0 if f == "reactions" else 1e-3  # forces that cancel
            bound = TOLERANCE * routes.factor * max(np.abs(wanted).max(initial=0), least)
            for backend in routes.units:
                one = evaluators[backend, f].one(t[k], x[k], inputs[k], ud[k])
                assert one.shape == wanted.shape
                for found in (one, many[backend][k]):
                    error = np.abs(found - wanted).max(initial=0)
                    assert error <= bound, f"{backend} {f}: {error / bound:.2g} times the bound"


def _exact(equations: Any, function: str, t: float, x: Any, inputs: Any, ud: Any, p: Any) -> np.ndarray:
    """A function of the tape at 30 digits, rounded to doubles."""
    s = equations.symbols
    names = [a.name for a in (*s.coordinates, *s.speeds, *s.states, *s.inputs, *s.parameters)]
    values = dict(zip(names, np.concatenate([x, inputs, p]).tolist(), strict=True))
    values |= {f"{u.name}_dot": float(a) for u, a in zip(s.speeds, ud, strict=True)} | {"t": float(t)}
    if function == "outputs":
        quantities = [q for q in equations.quantities if q.startswith("output_")]
        results = [evaluate(equations.tape(q), values, 30)[q].ravel() for q in quantities]
        return np.concatenate(results).astype(float)
    quantity = FUNCTIONS[function].quantity
    return evaluate(equations.tape(quantity), values, 30)[quantity].astype(float)


def test_modules_agree(compiled: Callable[..., Any]) -> None:
    """The same through the public module, by names and in order."""
    c, numpy = compiled("kitchen_sink", "c"), compiled("kitchen_sink", "numpy")
    x, inputs = np.linspace(-0.7, 0.8, 8), {"F": 0.3, "tau": -0.2}
    np.testing.assert_allclose(c.rhs(0.7, x, {"m1": 2.0}, inputs), numpy.rhs(0.7, x, {"m1": 2.0}, [0.3, -0.2]), rtol=1e-13)
    for name, value in c.outputs(0.7, x, None, inputs).items():
        np.testing.assert_allclose(value, numpy.outputs(0.7, x, None, inputs)[name], rtol=1e-13)


@pytest.mark.parametrize("name", ["kitchen_sink", *swept(["bricard"])])
def test_every_bit_is_that_of_the_tests(name: str, derived: Callable[..., Any], monkeypatch: pytest.MonkeyPatch) -> None:
    """The tests let C be compiled with -O0; with what users get, results and whole motions are the same to the last bit."""
    compiler = find_compiler()
    if compiler is None or compiler.kind not in ("gcc", "clang"):
        pytest.skip("no gcc or clang here")
    equations = derived(name) if name == "kitchen_sink" else systems.get(name).augmented()
    ours = equations.compile(backend="c")
    monkeypatch.delenv("SYMDYN_CC", raising=False)
    users = find_compiler()
    assert users is not None and "-O3" in flags(users)
    theirs = equations.compile(backend="c")
    one, other = (module.simulate((0, 1), rtol=1e-9, method="dop853") for module in (ours, theirs))
    assert one.success and one.n_steps == other.n_steps > 10
    assert np.array_equal(one.x, other.x)
    n_inputs = len(ours.metadata.inputs)
    x, inputs = one.x[1] + np.linspace(-1e-3, 1e-3, one.x.shape[1]), np.linspace(0.2, 0.4, n_inputs)
    for x_k in (one.x[-1], x):
        assert np.array_equal(ours.rhs(0.7, x_k, None, inputs), theirs.rhs(0.7, x_k, None, inputs))
