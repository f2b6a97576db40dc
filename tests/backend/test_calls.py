"""Functions that call numeric algorithms, and functions that are tried in one way and then done in another."""

from __future__ import annotations

import dataclasses
import functools
import re
import shutil
import subprocess
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import symdyn as sd
from symdyn.backend import source
from symdyn.backend.dialect import Dialect, read_dialect
from symdyn.errors import EvaluationError, SymdynError
from symdyn.pipeline import emit
from symdyn.runtime.building.compiler import find_compiler
from symdyn.tape.floats import evaluate_rows
from tests.helpers import swept

STRICT = ["-std=c99", "-O1", "-Wall", "-Wextra", "-Werror", "-pedantic", "-Wconversion", "-Wshadow"]
TEMPLATES = Path(sd.__file__).parents[1] / "templates"
needs_c = pytest.mark.skipif(find_compiler() is None, reason="no C compiler here")
both = pytest.mark.parametrize("backend", ["numpy", pytest.param("c", marks=needs_c)])


def wheels(second: bool = True) -> sd.System:
    """Two wheels and one gear or two alike between them, with ratios that are parameters: everything is constant."""
    q1, q2 = sd.coordinates("q1 q2")
    r1, r2, inertia = sd.parameters("r1 r2 I")
    s = sd.System("wheels", planar=True)
    one, two = s.add_body("one", mass=1, inertia=inertia), s.add_body("two", mass=1, inertia=2)
    s.add_joint(sd.Revolute("a", s.ground, one, q1))
    s.add_joint(sd.Revolute("b", s.ground, two, q2))
    s.add_joint_force("a", 1)
    s.close_loop(sd.Gear("gear", "a", "b", r1))
    if second:
        s.add_constraint(q2 - r2 * q1, name="belt")
    return s


@functools.cache
def equations(name: str) -> Any:
    if name == "hanging":
        return equations("pendulum_absolute")
    system = {"wheels": wheels, "one_gear": lambda: wheels(False)}.get(name, lambda: sd.systems.get(name))()
    return system.augmented()


@functools.cache
def module(name: str, backend: str) -> Any:
    return equations(name).compile(backend=backend)


def values(name: str, given: Mapping[str, float]) -> dict[str, Any]:
    s = equations(name).symbols
    return {"t": 0.0, **{p.name: float(s.defaults[p]) for p in s.parameters},
            **{a.name: 0.0 for a in (*s.coordinates, *s.speeds)}, **given}


def state(name: str, given: Mapping[str, float]) -> np.ndarray:
    s = equations(name).symbols
    return np.array([given.get(a.name, 0.0) for a in (*s.coordinates, *s.speeds)])


# -- two ways

# Where a constraint vanishes (rods that fold together), and where only the speed that is eliminated is held by none.
SINGULAR = {"slider_crank": {"theta": np.pi / 2, "phi": -np.pi, "theta_dot": 1.0, "phi_dot": -2.0},
            "pendulum_absolute": {"x": 1.0, "y": 0.0, "y_dot": 2.0}, "hanging": {"x": 0.0, "y": -1.0, "x_dot": 2.0}}
REGULAR = {"slider_crank": {"theta": 0.5, "phi": -1.0, "theta_dot": 1.0, "phi_dot": -2.0},
           "pendulum_absolute": {"x": 0.6, "y": -0.8, "x_dot": 0.8, "y_dot": 0.6}}
REGULAR["hanging"] = REGULAR["pendulum_absolute"]


@both
@pytest.mark.parametrize("name", SINGULAR)
def test_singular_states_are_done_in_the_other_way(name: str, backend: str) -> None:
    """One state, and rows in which only some are singular: there the numbers are those of the numeric algorithm."""
    for function in ("rhs", "lam"):
        rows = []
        for given in (REGULAR[name], SINGULAR[name]):
            tape = equations(name).singular_fallback.tape(function)
            rows.append(evaluate_rows(tape, values(name, given), 1)[function][0])
        x = np.array([state(name, REGULAR[name]), state(name, SINGULAR[name])])
        size = np.abs(rows).max()
        assert np.abs(module(name, backend).evaluate(function, 0, x[1]) - rows[1]).max() <= 1e-8 * size
        assert np.abs(module(name, backend).evaluate(function, 0, x[0]) - rows[0]).max() <= 1e-8 * size
        assert np.abs(module(name, backend).evaluate(function, [0, 0], x) - rows).max() <= 1e-8 * size


@pytest.mark.parametrize("name", ["slider_crank", "four_bar"])
def test_both_ways_are_in_the_program(name: str) -> None:
    made = emit(equations(name), "c", ("rhs", "mass_matrix", "lam", "C"), standalone=False)
    functions = {f.name: f for f in made.program.functions}
    assert functions["C"].singular_fallback is None and functions["mass_matrix"].singular_fallback is None
    for function in ("rhs", "lam"):
        two = functions[function]
        assert two.regular is not None and two.singular_fallback is not None and not two.results
        assert set(two.arguments) == {*two.regular.arguments, *two.singular_fallback.arguments}
        assert two.count == two.regular.count < two.singular_fallback.count and "intrinsic" in two.singular_fallback.operations
    assert set(made.program.intrinsics) == {"symdyn_saddle", "symdyn_multipliers"}
    n, m = len(equations(name).symbols.speeds), len(equations(name).constraints)
    assert set(made.program.intrinsics.values()) == {(n, m)}
    assert made.metadata.operations["rhs"] == functions["rhs"].count


@both
def test_what_vanishes_by_the_parameters_is_no_fault(backend: str) -> None:
    """With equal ratios both gears are one: then, too, the constants are there, and the numeric algorithm does the rest."""
    eq = module("wheels", backend)
    x = [0.1, 0.2, 0.2, 0.4]
    equal, other = {"r1": 2, "r2": 2, "I": 1}, {"r1": 2, "r2": 3, "I": 1}
    first = 1 / (1 + 4 * 2)
    np.testing.assert_allclose(eq.rhs(0, x, equal), [0.2, 0.4, first, 2 * first], rtol=1e-12)
    np.testing.assert_allclose(eq.evaluate("lam", 0, x, equal), [-2 * first, -2 * first], rtol=1e-9)
    np.testing.assert_allclose(eq.rhs(0, x, other), [0.2, 0.4, 0, 0], atol=1e-12)
    np.testing.assert_allclose(eq.rhs(0, x, equal), [0.2, 0.4, first, 2 * first], rtol=1e-12)
    np.testing.assert_allclose(module("one_gear", backend).rhs(0, x, {"r1": 2, "I": 0}), [0.2, 0.4, 1 / 8, 1 / 4], rtol=1e-12)


@both
def test_the_reason_is_reported_where_both_ways_fail(backend: str) -> None:
    q, p = sd.coordinates("q p")
    I, k = sd.parameters("I k")
    s = sd.System("loose", planar=True)
    wheel, other = s.add_body("wheel", mass=1, inertia=I), s.add_body("other", mass=1, inertia=1)
    s.add_joint(sd.Revolute("a", s.ground, wheel, q))
    s.add_joint(sd.Revolute("b", s.ground, other, p))
    s.add_joint_force("a", 1)
    s.add_constraint(k * p, name="stop")
    loose = s.augmented().compile(backend=backend)
    np.testing.assert_allclose(loose.rhs(0, [0, 0, 1, 1], {"I": 2, "k": 1}), [1, 1, 0.5, 0], atol=1e-15)
    with pytest.raises(EvaluationError, match=r"a speed is held neither by mass nor by a constraint"):
        loose.rhs(0, [0, 0, 1, 1], {"I": 0, "k": 1})


# -- numbers instead of parameters


@both
def test_calls_fold_with_the_parameters(backend: str) -> None:
    """Where all is constant nothing is left to call."""
    eq = equations("wheels")
    numbers = {"r1": 2, "r2": 3, "I": 1}
    made = emit(eq, backend, ("rhs", "lam"), standalone=False, specialize=numbers)
    assert made.program.intrinsics == {} and made.program.n_c == 0
    bound = eq.compile(backend=backend, specialize=numbers)
    np.testing.assert_allclose(bound.rhs(0, [0.1, 0.2, 0.2, 0.4]), [0.2, 0.4, 0, 0], atol=1e-12)


@both
def test_parameters_that_are_bound(backend: str) -> None:
    given = REGULAR["slider_crank"]
    eq = equations("slider_crank")
    bound = eq.compile(backend=backend, specialize=dict(eq.symbols.defaults))
    for x in (state("slider_crank", given), state("slider_crank", SINGULAR["slider_crank"])):
        np.testing.assert_allclose(bound.rhs(0, x), module("slider_crank", backend).rhs(0, x), rtol=1e-8, atol=1e-8)


# -- long functions


@pytest.fixture
def divided(monkeypatch: pytest.MonkeyPatch) -> Callable[[int], None]:
    """Sets how functions are divided."""
    read = source.read_dialect

    def set_parts(longest: int) -> None:
        def changed(folder: Any) -> Dialect:
            dialect = read(folder)
            assert dialect.parts is not None
            return dataclasses.replace(dialect, parts=dataclasses.replace(dialect.parts, whole=longest, longest=longest))
        monkeypatch.setattr(source, "read_dialect", changed)
    return set_parts


@needs_c
@pytest.mark.parametrize(("name", "longest"), [("slider_crank", 10), ("pendulum_absolute", 5)])
def test_calls_in_parts(name: str, longest: int, divided: Callable[[int], None]) -> None:
    """Results of a call are read in the same part, and kept for later ones."""
    divided(longest)
    made = emit(equations(name), "c", ("rhs", "lam"), standalone=False)
    for function in made.program.functions:
        assert function.singular_fallback is not None and len(function.singular_fallback.parts) > 1
    parts = equations(name).compile(backend="c")
    for given in (REGULAR[name], SINGULAR[name]):
        x = state(name, given)
        for function in ("rhs", "lam"):
            wanted = module(name, "c").evaluate(function, 0, x)
            assert np.abs(parts.evaluate(function, 0, x) - wanted).max() <= 1e-9 * max(1, np.abs(wanted).max())


# -- files that stand alone


@pytest.mark.skipif(shutil.which("gcc") is None, reason="no gcc here")
@pytest.mark.parametrize("name", ["four_bar", *swept(["bricard", "pendulum_absolute"])])
def test_written_c_compiles_strictly_and_checks_itself(name: str, write: Callable[..., Path]) -> None:
    functions = ["rhs", "mass_matrix", "C", "C_r", "F_d", "lam", "energy"]
    if name != "bricard":  # which is long
        functions += ["reactions", "position_correction", "velocity_correction", "jacobian_x"]
    folder = write(equations(name), "c", functions)
    command = ["gcc", *STRICT, "-o", "check", "main.c", f"{name}.c", "-lm"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    done = subprocess.run([folder / "check"], capture_output=True, text=True)
    assert done.returncode == 0 and done.stdout.endswith("all results agree\n"), done.stdout
    assert len(re.findall(r" ok ", done.stdout)) >= 2 * len(functions)


@pytest.mark.parametrize("name", ["four_bar", *swept(["bricard"])])
def test_written_numpy_checks_itself(name: str, write: Callable[..., Path]) -> None:
    functions = ["rhs", "lam", "C_r"]
    path = write(equations(name), "numpy", functions) / f"{name}.py"
    done = subprocess.run([sys.executable, path.name, "--selftest"], cwd=path.parent, capture_output=True, text=True)
    assert done.returncode == 0 and done.stdout.endswith("all results agree\n"), done.stdout + done.stderr
    assert len(re.findall(r" ok ", done.stdout)) >= 2 * len(functions)


# -- dialects


def dialect_without_calls(tmp_path: Path, change: Callable[[str], str]) -> Path:
    folder = tmp_path / "numpy"
    shutil.copytree(TEMPLATES / "numpy", folder)
    path = folder / "dialect.toml"
    path.write_text(change(path.read_text()))
    return folder


def test_a_backend_without_calls_reports_it(tmp_path: Path) -> None:
    dialect_without_calls(tmp_path, lambda text: re.sub(r"\[call\].*?\n\n", "", text, flags=re.DOTALL))
    with pytest.raises(SymdynError, match=r"calls? the numeric algorithm symdyn_\w+, which the backend numpy does not have; "
                                          r"add \[call\] to its dialect.toml, and the algorithm to its templates"):
        emit(equations("four_bar"), "numpy", ("rhs",), templates=tmp_path)
    assert emit(equations("four_bar"), "numpy", ("mass_matrix", "C"), templates=tmp_path).files


def test_a_backend_without_the_algorithm_reports_it(tmp_path: Path) -> None:
    folder = dialect_without_calls(tmp_path, lambda text: text)
    folder.rename(tmp_path / "other")
    model = tmp_path / "other" / "model.py.jinja"
    model.write_text(model.read_text().replace("numpy/%s", "other/%s"))
    (tmp_path / "other" / "symdyn_saddle.py.jinja").unlink()
    with pytest.raises(SymdynError, match=r"the templates of other have no text of it; .* or add other/symdyn_saddle.py.jinja"):
        emit(equations("four_bar"), "other", ("rhs",), templates=tmp_path)


@pytest.mark.parametrize(("old", "new", "fault"), [
    ('item = "{name}[{k}]"', "", "call.item is missing"),
    ('item = "{name}[{k}]"', 'item = "{name}[{k}]"\nelement = "x"', "call.element is not known"),
    ('item = "{name}[{k}]"', 'item = "{nome}[{k}]"', "call.item = '{nome}[{k}]' cannot be filled in|it may use {name}, {k}"),
    ("{function}(", "{routine}(", "call.take = |cannot be filled in|{name}, {function}, {sizes}, {arguments}"),
])
def test_faulty_calls_of_a_dialect(old: str, new: str, fault: str, tmp_path: Path) -> None:
    folder = dialect_without_calls(tmp_path, lambda text: text.replace(old, new))
    with pytest.raises(SymdynError) as caught:
        read_dialect(folder)
    assert all(part in str(caught.value) for part in fault.split("|"))
