"""The written Python module: alone in the world, the same for one state and for many, plain floats for one."""

from __future__ import annotations

import importlib.util
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest
import sympy as sp

import symdyn as sd
from symdyn.functions.table import FUNCTIONS
from symdyn.functions.tapes import has_function
from symdyn.pipeline import emit, write_source
from tests.helpers import swept

ALONE = """
import runpy, sys
for name in ("sympy", "symdyn", "scipy", "mpmath", "jinja2"):
    sys.modules[name] = None
sys.argv = [{path!r}, *{arguments!r}]
runpy.run_path({path!r}, run_name="__main__")
"""


def run_alone(path: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    """Run a module as a program where nothing but NumPy can be imported."""
    program = ALONE.format(path=str(path), arguments=list(arguments))
    command = [sys.executable, "-W", "error", "-c", program]
    return subprocess.run(command, cwd=path.parent.parent, capture_output=True, text=True)


def load(equations: Any, folder: Path, functions: Any = None) -> ModuleType:
    """The written module, imported."""
    source = emit(equations, "numpy", functions)
    (path,) = write_source(source, folder)
    spec = importlib.util.spec_from_file_location(f"alone_{path.stem}", path)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def sink(derived: Callable[..., Any], tmp_path_factory: pytest.TempPathFactory) -> ModuleType:
    equations = derived("kitchen_sink")
    functions = [f for f in FUNCTIONS if has_function(equations, f)]
    return load(equations, tmp_path_factory.mktemp("numpy"), functions)


@pytest.mark.parametrize("name", ["kitchen_sink", "awkward_names",
                                  *swept(["double_pendulum", "prismatic_chain", "three_link_arm"])])
def test_selftest_alone(name: str, derived: Callable[..., Any], write: Callable[..., Path]) -> None:
    equations = derived(name)
    functions = [f for f in FUNCTIONS if has_function(equations, f)]
    done = run_alone(write(equations, "numpy", functions) / f"{equations.name}.py", "--selftest")
    assert done.returncode == 0, done.stderr
    assert done.stdout.endswith("all results agree\n") and done.stdout.count(" ok ") >= 2 * len(functions)
    visited, exercised, statements = map(int, re.search(r"(\d+) states visited, (\d+) of (\d+) statements", done.stdout).groups())
    assert visited >= 2 and 0.8 * statements < exercised <= statements


def test_selftest_notices_a_wrong_number(derived: Callable[..., Any], write: Callable[..., Path]) -> None:
    path = write(derived("pendulum"), "numpy") / "pendulum.py"
    text = path.read_text()
    assert text.count("math.sin,") == 1
    path.write_text(text.replace("math.sin,", "math.tan,"))
    done = run_alone(path, "--selftest")
    assert done.returncode == 1 and "WRONG" in done.stdout and "results are wrong" in done.stdout


def test_run_without_arguments_prints_what_it_is(derived: Callable[..., Any], write: Callable[..., Path]) -> None:
    done = run_alone(write(derived("pendulum"), "numpy") / "pendulum.py")
    assert done.returncode == 0 and "q1  [rad]" in done.stdout and "--selftest" in done.stdout


def states(module: ModuleType, n: int) -> dict[str, Any]:
    rng = np.random.default_rng(5)
    sizes = module.METADATA["sizes"]
    return {"t": rng.uniform(0, 1, n), "x": rng.uniform(-1, 1, (n, sizes["x"])),
            "inputs": rng.uniform(-1, 1, (n, sizes["inputs"])), "ud": rng.uniform(-1, 1, (n, sizes["u"]))}


def test_one_state_and_many_agree(sink: ModuleType) -> None:
    at = states(sink, 6)
    for name, shape in sink.METADATA["shapes"].items():
        many = sink.evaluate(name, at["t"], at["x"], None, at["inputs"], at["ud"])
        assert many.shape == (6, *shape) and many.dtype == float
        for k in range(6):
            one = sink.evaluate(name, at["t"][k], list(at["x"][k]), None, at["inputs"][k], at["ud"][k])
            assert one.shape == tuple(shape)
            np.testing.assert_allclose(many[k], one, rtol=1e-14, atol=1e-14 * max(1, np.abs(one).max()))
        square = sink.evaluate(name, at["t"].reshape(2, 3), at["x"].reshape(2, 3, -1), None, at["inputs"].reshape(2, 3, -1),
                               at["ud"].reshape(2, 3, -1))
        np.testing.assert_array_equal(square.reshape(many.shape), many)
        # One value of what is left over holds for all states; no state is no result.
        held = sink.evaluate(name, 0.3, at["x"], None, at["inputs"][0], at["ud"][0])
        np.testing.assert_array_equal(held[2], sink.evaluate(name, 0.3, at["x"][2:4], None, at["inputs"][0], at["ud"][0])[0])
        assert sink.evaluate(name, 0.3, at["x"][:0], None, at["inputs"][0], at["ud"][0]).shape == (0, *shape)


def test_named_functions(sink: ModuleType) -> None:
    at = states(sink, 2)
    arguments = at["t"], at["x"], None, at["inputs"], at["ud"]
    for name in sink.METADATA["shapes"]:
        np.testing.assert_array_equal(getattr(sink, name)(*arguments), sink.evaluate(name, *arguments))


def test_one_state_runs_on_plain_floats(sink: ModuleType) -> None:
    p = tuple(sink.METADATA["defaults"])
    q, u, z = [0.3, -0.2, 0.5], [0.1, 0.4, -0.6], [0.2, 0.1]
    for name in sink.METADATA["shapes"]:
        result = sink._ONE[name](0.4, q, u, z, [0.1, 0.2, 0.3], [0.5, -0.5], p, sink._constants(p))
        assert all(type(entry) in (float, int) for entry in result), name
    assert all(type(entry) in (float, int) for entry in sink._constants(p))


def test_parameters_in_order(sink: ModuleType) -> None:
    x, defaults = [0.1] * sink.METADATA["sizes"]["x"], sink.METADATA["defaults"]
    inputs = [0.1, 0.2]
    np.testing.assert_array_equal(sink.rhs(0.0, x, defaults, inputs), sink.rhs(0.0, x, None, inputs))
    heavier = [2 * v if name == "m1" else v for name, v in zip(sink.METADATA["parameters"], defaults, strict=True)]
    assert not np.allclose(sink.rhs(0.0, x, np.array(heavier), inputs), sink.rhs(0.0, x, None, inputs))


@pytest.mark.parametrize(("arguments", "message"), [
    ((0.0, [0.0, 1.0]), r"x has 2 entries, 8 needed: \['q1', 'q2', 'q3', 'q1_dot'"),
    ((0.0, [[0.0] * 7] * 3), "x has 7 entries, 8 needed"),
    ((0.0, [0.0] * 8, [1.0]), r"1 parameters given, 9 needed: \["),
    ((0.0, [0.0] * 8, None, [1.0]), r"inputs has 1 entries, 2 needed: \['F', 'tau'\]"),
    ((0.0, [0.0] * 8, None, [1.0, 2.0], [1.0]), r"ud has 1 entries, 3 needed: \['q1_dot_dot'|ud has 1 entries, 3 needed"),
])
def test_wrong_lengths(sink: ModuleType, arguments: tuple, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        sink.rhs(*arguments)


def test_missing_parameters(derived: Callable[..., Any], tmp_path: Path) -> None:
    q = sd.coordinates("q")
    m, l = sd.parameters("m l")
    system = sd.System("no_numbers", gravity=[0, -9.81])
    bob = system.add_body("bob", mass=m, com=[0, -l])
    system.add_joint(sd.Revolute("pivot", system.ground, bob, q))
    system.defaults = {m: 1.0}
    module = load(system.embedding(), tmp_path)
    with pytest.raises(ValueError, match=r"no value for the parameters \['l'\]"):
        module.rhs(0.0, [1.0, 0.0])
    assert module.rhs(0.0, [1.0, 0.0], [1.0, 2.0])[0] == 0.0
    with pytest.raises(ArithmeticError, match="the mass matrix is not positive definite at q_dot") as caught:
        module.rhs(0.0, [1.0, 0.0], [1.0, 0.0])
    assert caught.value.code == 1


def test_a_branch_that_is_not_taken_may_be_undefined(tmp_path: Path) -> None:
    """sqrt of a negative number, 0/0 and overflow on the side of a Piecewise that does not count."""
    q, k = sd.coordinates("q"), sd.parameters("k")
    system = sd.System("branches", planar=True)
    body = system.add_body("body", mass=1)
    system.add_joint(sd.Prismatic("rail", system.ground, body, q, axis=[1, 0]))
    system.add_output("root", sp.Piecewise((sp.sqrt(q), q > 0), (-q, True)))
    system.add_output("sinc", sp.Piecewise((sp.sin(q) / q, sp.Ne(q, 0)), (1, True)))
    system.add_output("limited", sp.Piecewise((sp.exp(q), q < 700), (0, True)))
    system.add_output("constant", sp.Piecewise((1 / k, k > 0), (7, True)) + q)
    system.defaults = {k: 0.0}
    module = load(system.embedding(), tmp_path)
    for x in (4.0, 0.0, -4.0, 1000.0):
        wanted = [x**0.5 if x > 0 else -x, np.sin(x) / x if x else 1.0, np.exp(x) if x < 700 else 0.0, 7.0 + x]
        np.testing.assert_allclose(module.outputs(0.0, [x, 0.0]), wanted, rtol=1e-15)
    with np.errstate(all="ignore"):
        np.testing.assert_allclose(module.outputs(0.0, [[-4.0, 0.0], [0.0, 0.0]])[:, :2], [[4.0, np.sin(4) / 4], [0.0, 1.0]])


def test_reference_states_avoid_what_is_undefined(tmp_path: Path) -> None:
    """A root of a coordinate has references at positive ones; what is never defined is left out; the rest stays checked."""
    q = sd.coordinates("q")
    system = sd.System("sometimes", planar=True)
    body = system.add_body("body", mass=1)
    rail = system.add_joint(sd.Prismatic("rail", system.ground, body, q, axis=[1, 0]))
    system.add_joint_force(rail, sp.sqrt(q))
    system.add_output("never", sp.acosh(sp.sin(q) / 2) + sp.log(-(q**2)))
    (path,) = write_source(emit(system.embedding(), "numpy"), tmp_path)
    text = run_alone(path, "--selftest").stdout
    assert text.endswith("all results agree\n") and text.count("rhs ") == 2 and "\noutputs" not in text
    assert "not exercised: 6 of outputs" in text
