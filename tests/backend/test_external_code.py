"""Functions of the user in generated code: the same numbers as expressions, files that stand alone, reports of failures."""

from __future__ import annotations

import functools
import os
import re
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sympy as sp

import symdyn as sd
from symdyn.errors import EvaluationError, SimulationWarning, SymdynError, UnsupportedExpression
from symdyn.pipeline import emit, write_source
from symdyn.runtime.building import cache
from symdyn.runtime.building.compiler import find_compiler
from tests.user_functions import BOUNDED, HEIGHT, HEIGHT_1, PAIR, SHARED, SLOPES, c_text, height, pair, pair_numpy

STRICT = ["-std=c99", "-O1", "-Wall", "-Wextra", "-Werror", "-pedantic", "-Wconversion", "-Wshadow"]
needs_gcc = pytest.mark.skipif(shutil.which("gcc") is None, reason="no gcc here")
needs_c = pytest.mark.skipif(find_compiler() is None, reason="no C compiler here")
both = pytest.mark.parametrize("backend", ["numpy", pytest.param("c", marks=needs_c)])


def arm(function: Callable[..., Any], heights: Callable[..., Any]) -> sd.System:
    """A cart with a rod: a spring of two results between them, a load with a coordinate's rate, an input and a parameter."""
    x, phi = sd.coordinates("x phi")
    m, k, pull = *sd.parameters("m k"), sd.inputs("pull")
    s = sd.System("arm", planar=True, gravity=[0, -9.81])
    cart, rod = s.add_body("cart", mass=m, inertia=1), s.add_body("rod", mass=1, inertia=0.1, com=[0.5, 0])
    s.add_joint(sd.Prismatic("way", s.ground, cart, x))
    s.add_joint(sd.Revolute("hinge", cart, rod, phi))
    force, energy = function(x - sp.sin(phi), k)
    s.add_joint_force("way", force + heights(x.dot * phi + pull))
    s.add_joint_force("hinge", -force * sp.cos(phi) + 0.1 * energy)
    s.add_output("spring", [force, energy])
    s.add_output("of_parameters", function(k / 10, m)[0] + heights(k))
    s.defaults, s.initial = {m: 2, k: 3}, {x: 0.2, phi: -1}
    return s


@functools.cache
def equations(kind: str, form: str) -> Any:
    return getattr(arm(*{"function": (PAIR, HEIGHT), "expression": (pair, height)}[kind]), form)()


@functools.cache
def module(kind: str, form: str, backend: str) -> Any:
    return equations(kind, form).compile(backend=backend)


def states(n: int) -> np.ndarray:
    return np.random.default_rng(1).uniform(-1, 1, (n, 4))


# -- the same numbers


@both
@pytest.mark.parametrize("form", ["embedding", "recursive"])
def test_functions_give_what_expressions_give(form: str, backend: str) -> None:
    """One state and rows of states, forces, outputs and accelerations, within rounding."""
    mine, plain = module("function", form, backend), module("expression", "embedding", "numpy")
    x = states(20)
    for name in ("rhs", "F_tilde", "outputs"):
        wanted = plain.evaluate(name, 0, x, None, [0.3])
        size = np.abs(wanted).max()
        np.testing.assert_allclose(mine.evaluate(name, 0, x, None, [0.3]), wanted, rtol=0, atol=1e-13 * size)
        np.testing.assert_allclose(mine.evaluate(name, 0, x[3], None, [0.3]), wanted[3], rtol=0, atol=1e-13 * size)


@both
def test_jacobians_are_exact(backend: str) -> None:
    mine, plain = module("function", "embedding", backend), module("expression", "embedding", "numpy")
    for x in states(3):
        for found, wanted in zip(mine.jacobian(0, x, None, [0.3]), plain.jacobian(0, x, None, [0.3]), strict=True):
            np.testing.assert_allclose(found, wanted, rtol=0, atol=1e-13 * np.abs(wanted).max())


@both
def test_motions_are_the_same(backend: str) -> None:
    ends = [module(kind, "embedding", backend).simulate((0, 1), inputs=[0.3], rtol=1e-9, atol=1e-11).q[-1]
            for kind in ("function", "expression")]
    np.testing.assert_allclose(*ends, rtol=0, atol=1e-11)


def bead(curve: Callable[..., Any]) -> Any:
    """A bead on a curve y(x), as a constraint: accelerations need second derivatives of the function."""
    x, y = sd.coordinates("x y")
    s = sd.System("bead", planar=True, gravity=[0, -9.81])
    one, two = s.add_body("carrier", mass=1, inertia=1), s.add_body("bead", mass=2, inertia=1)
    s.add_joint(sd.Prismatic("along", s.ground, one, x))
    s.add_joint(sd.Prismatic("up", one, two, y, axis=[0, 1, 0]))
    s.add_constraint(y - curve(x), name="curve")
    s.initial = {x: 0.3, y: float(height(0.3))}
    return s.augmented()


def test_a_constraint_is_differentiated_twice() -> None:
    mine, plain = bead(HEIGHT).compile(backend="numpy"), bead(height).compile(backend="numpy")
    x = [0.3, float(height(0.3)), 1.0, np.cos(0.3) + 0.3]
    for name in ("rhs", "C_r", "F_d", "lam"):
        np.testing.assert_allclose(mine.evaluate(name, 0, x), plain.evaluate(name, 0, x), rtol=1e-13, atol=1e-14)
    with pytest.raises(UnsupportedExpression, match=r"a derivative of height_2\(s\) is needed and not given"):
        bead(HEIGHT_1).compile(backend="numpy").jacobian(0, x)


def test_proofs_look_at_functions() -> None:
    """At 30 digits where a function has them, in floating point where not, which is reported; and a wrong derivative is found."""
    verification = equations("function", "embedding").verify(states=1)
    rows = {check.name: check for check in verification.checks}
    assert verification.passed
    assert rows["derivatives of functions of the user"].residual < 1e-15
    assert 1e-15 < rows["derivatives of functions of the user, in floating point"].residual < 1e-8
    assert rows["exact Jacobian of the NumPy module agrees with the tape"].residual < 1e-14
    assert str(verification).endswith("curves, pair, slopes: in floating point, as they have no function `precise`")
    wrong = sd.External("wrong", ["x", "k"], 2, python=pair_numpy, derivative=sd.External(
        "wrong_slopes", ["x", "k"], 4, python=wrong_numpy, c=c_text("wrong_slopes", "0", "0", "0", "0")), c=c_text(
        "wrong", "-k*x*(1 + x*x)", "k*x*x*(1 + x*x/2)/2"))
    failed = [c.name for c in sled(lambda v: wrong(v, 2)[1]).embedding().verify(states=1).checks if c.passed is False]
    assert "derivatives of functions of the user, in floating point" in failed


def wrong_numpy(x, k):
    return -k * (1 + 3 * x**2), x * (1 + x**2), k * x * (1 + x**2), x**2 * (1 + x**2 / 2) / 2


def test_c_that_differs_from_numpy_is_found() -> None:
    if find_compiler() is None:
        pytest.skip("no C compiler here")
    other = sd.External("other", ["x", "k"], 2, python=pair_numpy, c=c_text("other", "-k*x*(1 + x*x)", "k*x*x*(1 + x*x)/2"))
    failed = [c.name for c in sled(lambda v: other(v, 2)[1]).embedding().verify(states=1).checks if c.passed is False]
    assert failed == ["C module agrees with the tape, over the condition"]


# -- what equations print


def test_explicit_forces_print_the_function() -> None:
    eq = equations("function", "embedding")
    F = eq.explicit("F_tilde", simplify=False)
    x, phi = eq.symbols.coordinates
    force = PAIR(x - sp.sin(phi), eq.symbols.parameters[-1])[0]
    assert F.has(force) and str(force) == "pair_1(x - sin(phi), k)"
    assert r"\operatorname{pair}_{1}" in eq.latex("F_tilde", simplify=False).latex


# -- failures


def sled(force: Callable[..., Any], scale: Any = 1) -> sd.System:
    x, m = sd.coordinates("x"), sd.parameters("m")
    s = sd.System("sled", planar=True)
    body = s.add_body("body", mass=m, inertia=1)
    s.add_joint(sd.Prismatic("way", s.ground, body, x))
    s.add_joint_force("way", force(x.dot * scale))
    s.defaults = {m: 1}
    return s


@both
def test_where_it_fails_a_simulation_stops_and_reports_it(backend: str) -> None:
    """v_dot = 1 + v reaches 1/2 at t = log 1.5."""
    fails = sled(BOUNDED).embedding().compile(backend=backend)
    with pytest.warns(SimulationWarning, match=r"sled: stopped at t = 0\.40\d+: .*the table of bounded ends at 0.5.*; the state "
                                               r"there: x = 0\.09\d*, x_dot = 0\.[45]\d*"):
        sol = fails.simulate((0, 1))
    assert not sol.success and abs(sol.t[-1] - np.log(1.5)) < 1e-3
    with pytest.raises(EvaluationError, match=r"the table of bounded ends at 0.5; at t = 0, x = 0, x_dot = 0.7$"):
        fails.rhs(0, [0, 0.7])
    with pytest.raises(EvaluationError, match=r"the table of bounded ends at 0\.5"):
        fails.evaluate("rhs", 0, [[0, 0.1], [0, 0.7]])
    with pytest.raises(UnsupportedExpression, match=r"a derivative of bounded\(v\) is needed and not given"):
        fails.jacobian(0, [0, 0.1])


@both
def test_results_that_are_not_finite_fail_too(backend: str) -> None:
    f = sd.External("inverse", ["v"], python=inverse_numpy, c="""
static int inverse(const double *in, double *out)
{
    out[0] = 1/in[0];
    return 0;
}""")
    made = sled(f).embedding().compile(backend=backend)
    assert made.rhs(0, [0, 4.0])[1] == 0.25
    with pytest.raises(EvaluationError, match="the function inverse failed or gave what is not finite; at t = 0"):
        made.rhs(0, [0, 0])
    with pytest.raises(UnsupportedExpression, match="load joint_force_1: the function inverse failed or gave what is not finite"):
        sled(f, scale=0).embedding().compile(backend=backend)


def inverse_numpy(v):
    return 1 / v


@both
def test_where_parameters_make_it_fail(backend: str) -> None:
    m = sd.parameters("m")
    made = sled(lambda v: BOUNDED(m / 10) - v).embedding().compile(backend=backend)
    assert made.rhs(0, [0, 1.0])[1] == pytest.approx(0.1, rel=1e-14)
    with pytest.raises(EvaluationError, match=r"the table of bounded ends at 0\.5"):
        made.rhs(0, [0, 1.0], {m: 6})
    with pytest.raises(SymdynError, match=r"with the numbers that are bound: the table of bounded ends at 0\.5"):
        emit(sled(lambda v: BOUNDED(m / 10) - v).embedding(), backend, ("rhs",), specialize={m: 6})
    with pytest.raises(UnsupportedExpression, match=r"load joint_force_1: the table of bounded ends at 0\.5"):
        _ = sled(lambda v: BOUNDED(2) - v).embedding().F_tilde


@pytest.mark.parametrize(("results", "message"), [
    (1, r"f\(v\) must return real arrays of the shape of its arguments, \(1,\)"), (3, "must return 3 results, not 2")])
def test_generated_python_looks_at_what_is_returned(results: int, message: str) -> None:
    f = sd.External("f", ["v"], results, python=two_numpy)
    made = sled(f if results == 1 else lambda v: f(v)[0]).embedding().compile(backend="numpy")
    with pytest.raises(EvaluationError, match=message):
        made.rhs(0, [0, 1])


def two_numpy(v):
    return v, v


# -- backends


def test_a_backend_without_a_text_is_reported() -> None:
    only_c = sd.External("f", ["v"], c="static int f(const double *in, double *out)\n{\n    out[0] = in[0];\n    return 0;\n}")
    only_python = sd.External("f", ["v"], python=inverse_numpy)
    with pytest.raises(SymdynError, match=r"f\(v\) has no text for the backend numpy, only for c; pass python= to sd.External"):
        emit(sled(only_c).embedding(), "numpy")
    with pytest.raises(SymdynError, match=r"f\(v\) has no text for the backend c, only for numpy; pass c= to sd.External"):
        emit(sled(only_python).embedding(), "c")
    with pytest.raises(UnsupportedExpression, match=r"f\(v\) must be evaluated in Python"):
        sled(only_c).embedding().verify(states=1)


@needs_gcc
def test_c_alone_is_enough_for_c(tmp_path: Path) -> None:
    """Without reference vectors of what needs the function."""
    only_c = sd.External("f", ["v"], c="static int f(const double *in, double *out)\n{\n    out[0] = in[0];\n    return 0;\n}")
    eq = sled(only_c).embedding()
    write_source(emit(eq, "c"), tmp_path)
    run("gcc", *STRICT, "-o", "check", "main.c", "sled.c", "-lm", folder=tmp_path)
    checked = run("./check", folder=tmp_path)
    assert "energy" in checked and "\nrhs" not in checked and "not exercised: 2 of rhs" in checked
    assert eq.compile(backend="c").rhs(0, [0, 3.0]).tolist() == [3, 3]


def test_a_backend_of_ones_own(tmp_path: Path) -> None:
    shutil.copytree(Path(__file__).parents[2] / "templates" / "c", tmp_path / "other")
    f = sd.External("f", ["v"], python=inverse_numpy, texts={"other": "its text  \n\nin another language"})
    eq = sled(f).embedding()
    for path in (tmp_path / "other").glob("*.jinja"):
        path.write_text(path.read_text().replace('"c/', '"other/'))
    text = emit(eq, "other", templates=tmp_path).files["sled.c"]
    assert "\nits text\n\nin another language\n" in text
    with pytest.raises(SymdynError, match=r"has no text for the backend third, only for numpy, other; pass texts={'third': ...}"):
        (tmp_path / "other").rename(tmp_path / "third")
        emit(eq, "third", templates=tmp_path)


def test_a_dialect_without_calls_is_reported(tmp_path: Path) -> None:
    shutil.copytree(Path(__file__).parents[2] / "templates" / "numpy", tmp_path / "numpy")
    dialect = tmp_path / "numpy" / "dialect.toml"
    dialect.write_text(re.sub(r"\[call\].*?\n\n", "", dialect.read_text(), flags=re.DOTALL))
    with pytest.raises(SymdynError, match=r"call the function bounded\(v\), which the backend numpy does not have; add \[call\]"):
        emit(sled(BOUNDED).embedding(), "numpy", ("rhs",), templates=tmp_path)


def test_names_that_clash_are_reported() -> None:
    twice = sd.External("bounded", ["v"], python=inverse_numpy)
    with pytest.raises(SymdynError, match=r"two functions that differ are called bounded: bounded\(v\) and bounded\(v\); give "):
        emit(sled(lambda v: BOUNDED(v) + twice(v)).embedding(), "numpy")
    with pytest.raises(SymdynError, match="the function sled_rhs may have a name of the generated files of sled; take one"):
        emit(sled(sd.External("sled_rhs", ["v"], python=inverse_numpy)).embedding(), "numpy")


def test_the_same_function_defined_twice_is_one() -> None:
    again = sd.External("inverse", ["v"], python=inverse_numpy)
    once = sd.External("inverse", ["v"], python=inverse_numpy)
    text = emit(sled(lambda v: again(v) + once(v)).embedding(), "numpy", ("rhs",), standalone=False).files["sled.py"]
    assert text.count("symdyn_call_inverse(") == 1


@both
def test_names_of_the_user_clash_with_none_of_the_model(backend: str) -> None:
    """A parameter, a quantity and a function of the generated module under the names of functions and of their Python."""
    energy = sd.External("energy", ["v"], python=rhs_numpy, c=c_text("energy", "3*x").replace("k = in[1]", "k = 0"))
    m, rhs = sd.parameters("m rhs_numpy")
    s = sled(lambda v: energy(v) + rhs * sd.coordinates("energy"))
    s.add_state(sd.coordinates("energy"), m)
    s.set_defaults({rhs: 2})
    assert s.embedding().compile(backend=backend).rhs(0, [0, 1.0, 10.0]).tolist() == [1, 23, 1]


def rhs_numpy(v):
    """A text
    of several lines."""
    def evaluate(w):
        return 3 * w
    return evaluate(v)


# -- files


def run(*command: Any, folder: Path, **variables: str) -> str:
    done = subprocess.run([str(c) for c in command], cwd=folder, capture_output=True, text=True, env={**os.environ, **variables})
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@needs_gcc
@pytest.mark.parametrize("functions", [None, ("rhs", "jacobian_x", "outputs"), ("mass_matrix",)])
def test_written_c_needs_gcc_alone(functions: Any, tmp_path: Path) -> None:
    """No warning, also where a text holds functions that nothing calls."""
    write_source(emit(equations("function", "embedding"), "c", functions), tmp_path)
    run("gcc", *STRICT, "-o", "check", "main.c", "arm.c", "-lm", folder=tmp_path)
    assert "WRONG" not in run("./check", folder=tmp_path)


def test_written_python_needs_numpy_alone(tmp_path: Path) -> None:
    write_source(emit(equations("function", "recursive"), "numpy", ("rhs", "jacobian_x", "outputs")), tmp_path)
    (tmp_path / "symdyn.py").write_text("raise ImportError('generated code needs no symdyn')")
    assert run(sys.executable, "arm.py", "--selftest", folder=tmp_path).endswith("all results agree\n")


def test_only_what_is_called_is_there_and_once() -> None:
    eq = equations("function", "embedding")
    rhs, jacobian, mass = (emit(eq, "c", (f,), standalone=False).files["arm.c"] for f in ("rhs", "jacobian_x", "mass_matrix"))
    for text in (rhs, jacobian):
        assert text.count(SHARED.strip()) == text.count("static int height(") == 1
    assert rhs.count("symdyn_call_pair(") == 2 and "height_call1[0]" in rhs
    assert "symdyn_call_slopes" not in rhs and "height_1" not in rhs
    assert "static int slopes(const double *in, double *out) __attribute__((unused));" in rhs
    assert jacobian.count("symdyn_call_slopes(") == 2 and "curves" not in jacobian
    assert "symdyn_call" not in mass and "of the user" not in mass
    both_ways = emit(eq, "numpy", ("rhs", "outputs"), standalone=False).files["arm.py"]
    assert both_ways.count("def pair_numpy(") == 1


@pytest.mark.parametrize("backend", ["c", "numpy"])
def test_the_head_lists_and_the_hash_covers(backend: str) -> None:
    def made(function: sd.External) -> str:
        return next(iter(emit(sled(lambda v: function(v, 2)[0]).embedding(), backend).files.values()))

    changed = sd.External("pair", ["x", "k"], 2, python=pair_numpy, c=SHARED.replace("{", "{ // changed", 1),
                          python_source="TWO = 2\n\ndef pair_numpy(x, k):\n    return x, TWO * k\n", derivative=SLOPES)
    one, two = made(PAIR), made(changed)
    assert "Functions of the user, with the number of their results:" in one
    assert re.search(r"^(// )?  pair\(x, k\) -> 2$", one, re.MULTILINE)
    hashes = [re.search(r"Model hash (\w{16})\.", text)[1] for text in (one, two)]  # type: ignore[index]
    assert hashes[0] != hashes[1]
    if backend == "c" and (compiler := find_compiler()) is not None:
        assert cache._target(one, "sled", compiler) != cache._target(two, "sled", compiler)


def test_a_text_with_helpers_and_tables() -> None:
    source = "TWO = np.array([1.0, 2.0])\n\ndef twice(v):\n    return TWO[1] * v\n\ndef inverse_numpy(v):\n    return twice(v)\n"
    f = sd.External("inverse", ["v"], python=inverse_numpy, python_source=source)
    assert sled(f).embedding().compile(backend="numpy").rhs(0, [0, 4.0])[1] == 8
