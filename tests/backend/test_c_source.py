"""The written C: compiles without a warning, needs nothing, checks itself, says what it takes."""

from __future__ import annotations

import re
import shutil
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from symdyn import systems
from symdyn.emission import write_source
from symdyn.errors import SymdynError
from symdyn.functions.table import FUNCTIONS
from symdyn.functions.tapes import has_function
from symdyn.lab.stiff_cables import elastic_cable
from symdyn.pipeline import emit
from tests import mechanisms
from tests.helpers import swept

pytestmark = pytest.mark.skipif(shutil.which("gcc") is None, reason="no gcc here")

STRICT = ["-std=c99", "-O1", "-Wall", "-Wextra", "-Werror", "-pedantic", "-Wconversion", "-Wshadow"]
ROOT = Path(__file__).parents[2]
# Functions that compilers call by themselves: copies of structs, sine with cosine, their own guards.
OF_THE_COMPILER = {"memcpy", "memset", "sincos", "_GLOBAL_OFFSET_TABLE_", "__stack_chk_fail"}


def run(*command: Any, folder: Path) -> str:
    done = subprocess.run([str(c) for c in command], cwd=folder, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


def check(folder: Path, name: str) -> str:
    """Build the example next to the source and run it."""
    run("gcc", *STRICT, "-c", f"{name}.c", folder=folder)
    run("gcc", *STRICT, "-O0", "-o", "check", "main.c", f"{name}.o", "-lm", folder=folder)
    return run("./check", folder=folder)


def everything(equations: Any) -> list[str]:
    return [f for f in FUNCTIONS if has_function(equations, f)]


@pytest.mark.parametrize("name", swept(systems.names(constrained=False), "pendulum", "spatial_chain"))
def test_catalogue_compiles_and_agrees(name: str, derived: Callable[..., Any], write: Callable[..., Path]) -> None:
    equations = derived(name)
    assert check(write(equations, "c"), equations.name).endswith("all results agree\n")


@pytest.mark.parametrize("name", ["kitchen_sink", "awkward_names", *swept(["driven_oscillator"])])
def test_every_function_compiles_and_agrees(name: str, derived: Callable[..., Any], write: Callable[..., Path]) -> None:
    """And needs nothing but the math library."""
    equations = derived(name)
    functions = [f for f in everything(equations) if f != "jacobian_inputs" or equations.symbols.inputs]
    folder = write(equations, "c", functions)
    text = check(folder, name)
    assert text.endswith("all results agree\n") and text.count(" ok ") >= 2 * len(functions)
    source = (folder / f"{name}.c").read_text()
    assert "#include" not in source and "malloc" not in source
    if shutil.which("nm") is not None:
        missing = set(re.findall(r"U (\w+)", run("nm", f"{name}.o", folder=folder)))
        declared = set(re.findall(r"(\w+)\(double", source))
        assert missing and missing <= declared | OF_THE_COMPILER


def test_results_without_entries(derived: Callable[..., Any], write: Callable[..., Path]) -> None:
    """A pendulum has no inputs to differentiate by."""
    equations = derived("pendulum")
    folder = write(equations, "c", ["rhs", "jacobian_inputs"])
    assert check(folder, "pendulum").endswith("all results agree\n")


def test_a_method_with_factors_in_a_band_is_in_one_file(tmp_path: Path) -> None:
    """The order of elimination and the entries of the derivative stand in it, and these agree with values of more digits."""
    write_source(emit(elastic_cable(10).embedding(), "c", ["rhs"], method="radau5"), tmp_path)
    text = (tmp_path / "elastic_cable_10.c").read_text()
    assert "static const int symdyn_sequence[36] = {\n" in text and "#define SYMDYN_LOWER 3\n" in text
    printed = check(tmp_path, "elastic_cable_10")
    assert printed.endswith("all results agree\n") and "jacobian_x_packed" in printed


def test_example_notices_a_wrong_number(derived: Callable[..., Any], write: Callable[..., Path]) -> None:
    folder = write(derived("pendulum"), "c", ["energy"])
    main = folder / "main.c"
    text = main.read_text()
    first = re.search(r"wanted\[\] = \{ (\S+),", text)
    assert first is not None
    main.write_text(text[:first.start(1)] + repr(float(first[1]) * 1.001) + text[first.end(1):])
    run("gcc", *STRICT, "-o", "check", "main.c", "pendulum.c", "-lm", folder=folder)
    done = subprocess.run([folder / "check"], capture_output=True, text=True)
    assert done.returncode == 1 and "WRONG" in done.stdout and done.stdout.endswith("1 results are wrong\n")


@pytest.mark.skipif(shutil.which("g++") is None, reason="no g++ here")
def test_header_in_cpp(derived: Callable[..., Any], write: Callable[..., Path]) -> None:
    folder = write(derived("two_link_arm"), "c")
    (folder / "use.cpp").write_text(
        '#include "two_link_arm.h"\n#include "two_link_arm.h"\n#include <cstdio>\n'
        "int main() {\n"
        "    double p[two_link_arm_n_p], c[two_link_arm_n_c], q[two_link_arm_n_q] = {0.1, 0.2}, out[4];\n"
        "    for (int i = 0; i < two_link_arm_n_p; i++) p[i] = two_link_arm_parameters[i].value;\n"
        "    int code = two_link_arm_prologue(p, c);\n"
        "    if (!code) code = two_link_arm_mass_matrix(q, p, c, out);\n"
        '    std::printf("%s, %s, %d\\n", two_link_arm_reason(code), two_link_arm_parameters[0].unit, out[1] == out[2]);\n'
        "}\n")
    run("gcc", "-std=c99", "-c", "two_link_arm.c", folder=folder)
    run("g++", "-Wall", "-Wextra", "-Werror", "-pedantic", "-o", "use", "use.cpp", "two_link_arm.o", "-lm", folder=folder)
    assert run("./use", folder=folder) == "no fault, m/s^2, 1\n"


def signature(text: str, function: str) -> list[str]:
    found = re.search(rf"^SYMDYN_EXPORT int {function}\(([^)]*)\) {{$", text, re.MULTILINE)
    assert found is not None
    return found[1].split(", ")


def test_functions_take_what_they_read(derived: Callable[..., Any]) -> None:
    def of(name: str, function: str) -> list[str]:
        source = emit(derived(name), "c", [function], standalone=False, integrator=False)
        return signature(next(iter(source.files.values())), f"{name}_{function}")

    q, u, z, inputs, p, c = (f"const double *{group}" for group in ("q", "u", "z", "inputs", "p", "c"))
    out = "double *out"
    assert of("pendulum", "rhs") == [q, u, p, c, out]
    assert of("pendulum", "mass_matrix") == [c, out]
    assert of("kitchen_sink", "rhs") == ["double t", q, u, z, inputs, p, c, out]
    assert of("driven_oscillator", "outputs") == [q, p, out]
    for name in systems.names(constrained=False):  # nothing in the catalogue is a function of time
        assert not any("double t" in argument for argument in of_any(derived(name)))


def of_any(equations: Any) -> list[str]:
    source = emit(equations, "c", ["rhs"], standalone=False, integrator=False)
    return signature(next(iter(source.files.values())), f"{equations.name}_rhs")


def test_header_of_the_file_names_order_units_and_defaults(derived: Callable[..., Any], write: Callable[..., Path]) -> None:
    folder = write(derived("driven_oscillator"), "c")
    for file in ("driven_oscillator.c", "driven_oscillator.h"):
        lines = (folder / file).read_text().splitlines()
        head = [line for line in lines[:lines.index("")] if line.startswith("//")] if "" in lines else lines
        for words in (["0", "q", "[m]"], ["0", "q_dot", "[m/s]"], ["0", "F"], ["1", "G"], ["m", "[kg]", "default", "2.0"]):
            assert any(set(words) <= set(line.split()) for line in head), words


def test_same_text_whenever_rendered(derived: Callable[..., Any]) -> None:
    """In one process; tests/tape/test_determinism.py renders it in others, with other hash seeds."""
    first = emit(derived("kitchen_sink"), "c")
    assert emit(derived("kitchen_sink"), "c").files == first.files
    assert emit(mechanisms.kitchen_sink().embedding(), "c").files == first.files


def test_constant_mass_matrix_is_factorized_in_the_prologue(derived: Callable[..., Any]) -> None:
    """The two sliders of the kitchen sink form a block that depends on parameters only."""
    source = emit(derived("kitchen_sink"), "c", ["rhs"], standalone=False, integrator=False)
    prologue, rhs = source.program.prologue, source.program.functions[0]
    assert any("1.0/" in line for section in prologue.sections for line in section.lines) or prologue.operations["div"] > 0
    lines = [*rhs.loads, *[line for section in rhs.sections for line in section.lines]]
    loaded = {name for line in lines for name in re.findall(r"double (\w+) = c\[", line)}
    assert {"iD1", "iD2", "L2_1"} <= loaded


def test_unknown_function(derived: Callable[..., Any]) -> None:
    with pytest.raises(SymdynError, match=r"pendulum has no function velocity; it has rhs, mass_matrix"):
        emit(derived("pendulum"), "c", ["rhs", "velocity"])
    with pytest.raises(SymdynError, match="has no function outputs"):
        emit(derived("pendulum"), "c", ["outputs"])
