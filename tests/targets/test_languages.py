"""Files in Fortran, Julia, MATLAB and Rust: compiled or interpreted, they give their reference vectors, and what C gives."""

from __future__ import annotations

import subprocess
from pathlib import Path

import numpy as np
import pytest

import symdyn as sd
from symdyn.backend.dialect import Caseless, identifier
from symdyn.cli import main
from symdyn.errors import UnsupportedExpression
from symdyn.lab.languages import PROGRAMS, built, program_for
from symdyn.lab.targets import compared
from symdyn.pipeline import emit, write_source
from tests.helpers import swept
from tests.mechanisms import strange

needed = {language: pytest.mark.skipif(program_for(language) is None, reason=f"there is no {program}")
          for language, program in PROGRAMS.items()}
LANGUAGES = [pytest.param(language, marks=mark) for language, mark in needed.items()]
WORDS = ("fortran", "julia", "matlab", "rust")


@pytest.mark.parametrize("language", LANGUAGES)
@pytest.mark.parametrize("name", swept(["strange", "two_link_arm", "bricard"], "strange"))
def test_all_functions_give_their_reference_vectors(name: str, language: str, tmp_path: Path) -> None:
    system = strange() if name == "strange" else sd.systems.get(name)
    equations = system.augmented() if system.loops else system.embedding()
    functions = None if name != "strange" else ["rhs", "mass_matrix", "outputs", "jacobian_x"]
    source = emit(equations, language, functions)
    write_source(source, tmp_path)
    command = built(language, tmp_path, source.metadata.name)
    found = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=300)
    assert found.returncode == 0 and "all results agree" in found.stdout, found.stdout + found.stderr


def assert_no_result(language: str, command: list[str], folder: Path, q1: int, reason: str) -> None:
    """A written pendulum has no x_dot at rest at an angle: an error with its reason in MATLAB, NaN printed by other programs."""
    if language == "matlab":
        command = [*command[:-1], f"pendulum('rhs', 0, [{q1}; 0])"]
        found = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=60)
        assert reason in found.stderr
        return
    found = subprocess.run([*command, "rhs"], cwd=folder, input=f"0 {q1} 0\n", capture_output=True, text=True, timeout=60)
    assert found.stdout.lower().split() == ["nan", "nan"]


def ratio(x: float, y: float) -> tuple[float, float]:
    return x / y, x * y


def square(x: float) -> float:
    return x * x


# A function with two results, which is not finite at y = 0, and one with one result and a helper, in each language.
TEXTS = {
    "fortran": ("""pure function ratio(x, y) result(r)
    real(dp), intent(in) :: x, y
    real(dp) :: r(2)
    r = [x/y, x*y]
end function""", """pure function twice(x) result(r)
    real(dp), intent(in) :: x
    real(dp) :: r
    r = 2.0_dp*x
end function

pure function square(x) result(r)
    real(dp), intent(in) :: x
    real(dp) :: r
    r = twice(x)*x/2.0_dp
end function"""),
    "julia": ("ratio(x, y) = (x/y, x*y)", "twice(x) = 2.0*x\n\nsquare(x) = twice(x)*x/2.0"),
    "matlab": ("function r = ratio(x, y)\nr = [x/y, x*y];\nend",
               "function r = twice(x)\nr = 2*x;\nend\n\nfunction r = square(x)\nr = twice(x)*x/2;\nend"),
    "rust": ("fn ratio(x: f64, y: f64) -> [f64; 2] {\n    [x / y, x * y]\n}",
             "fn twice(x: f64) -> f64 {\n    2.0 * x\n}\n\nfn square(x: f64) -> f64 {\n    twice(x) * x / 2.0\n}")}


def driven_by_functions(language: str) -> sd.System:
    """A pendulum with torques from functions of the user, of its angle and its speed."""
    system, q = sd.systems.pendulum(), sd.coordinates("q1")
    first, second = sd.External("ratio", ["x", "y"], 2, python=ratio, texts={language: TEXTS[language][0]})(q, q.dot)
    one = sd.External("square", ["x"], python=square, texts={language: TEXTS[language][1]})(q)
    system.add_torque("bob", first + 2 * second + one)
    return system


@pytest.mark.parametrize("language", LANGUAGES)
def test_functions_of_the_user_in_a_language(language: str, tmp_path: Path) -> None:
    source = emit(driven_by_functions(language).embedding(), language, ["rhs"])
    write_source(source, tmp_path)
    command = built(language, tmp_path, "pendulum")
    found = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=300)
    assert found.returncode == 0 and "all results agree" in found.stdout, found.stdout + found.stderr
    assert_no_result(language, command, tmp_path, 1, "the function ratio failed or gave what is not finite")  # at q1_dot = 0


@pytest.mark.parametrize("language", LANGUAGES)
def test_a_wrong_result_is_found(language: str, tmp_path: Path) -> None:
    source = emit(sd.systems.pendulum().embedding(), language, ["rhs"])
    write_source(source, tmp_path)
    path = tmp_path / next(iter(source.files))
    text = path.read_text()
    assert "sin" in text
    path.write_text(text.replace("sin(", "cos("))
    found = subprocess.run(built(language, tmp_path, "pendulum"), cwd=tmp_path, capture_output=True, text=True, timeout=300)
    assert found.returncode != 0 and "rhs: wrong" in found.stdout


@pytest.mark.every_value
@pytest.mark.parametrize("language", LANGUAGES)
@pytest.mark.parametrize("name", ["cart_pole", "slider_crank"])
def test_random_states_agree_with_c(name: str, language: str) -> None:
    errors, apart = compared(name, language, "float64")
    assert len(errors) == 1000 and apart == 0
    assert np.median(errors) < 1e-15 and errors.max() < 1e-13  # 1e-16 times what the state's condition makes of it


@pytest.mark.parametrize("language", LANGUAGES)
def test_a_value_that_must_be_positive_and_is_not(language: str, tmp_path: Path) -> None:
    system = sd.systems.pendulum()
    system.defaults = {k: 0.0 if str(k) == "m" else v for k, v in system.defaults.items()}
    source = emit(system.embedding(), language, ["rhs"])
    write_source(source, tmp_path)
    assert_no_result(language, built(language, tmp_path, "pendulum"), tmp_path, 0, "mass matrix")


def test_julia_has_no_fault_of_syntax() -> None:
    tree_sitter, grammar = pytest.importorskip("tree_sitter"), pytest.importorskip("tree_sitter_julia")
    parser = tree_sitter.Parser(tree_sitter.Language(grammar.language()))
    for equations in (strange().embedding(), sd.systems.four_bar().augmented(), driven_by_functions("julia").embedding()):
        for name, text in emit(equations, "julia").files.items():
            assert not parser.parse(text.encode()).root_node.has_error, name
    assert parser.parse(b"function f(x)\n x +* 2\nend\n").root_node.has_error


@pytest.mark.parametrize("language", WORDS)
def test_what_a_language_has_no_text_of_is_named(language: str) -> None:
    with pytest.raises(UnsupportedExpression, match=rf"floating_crane calls the numeric algorithm symdyn_c\w+, by sd\.\w+, and "
                       rf"the templates of {language} have no text of it; take C or NumPy"):
        emit(sd.systems.floating_crane().embedding(), language, ["rhs"])
    system = sd.systems.pendulum()
    text = "static int square(const double *in, double *out) { out[0] = in[0]*in[0]; return 0; }"
    system.add_torque("bob", sd.External("square", ["x"], c=text)(sd.t))
    with pytest.raises(sd.SymdynError, match=rf"square.*{language}"):
        emit(system.embedding(), language, ["rhs"])


def test_names_that_differ_in_capitals_alone() -> None:
    taken = Caseless(["Block"])
    assert [identifier(name, taken) for name in ("m", "M", "block")] == ["m", "M_", "block_"]


def test_the_command_writes_every_language(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["export", "pendulum", *(f"--{word}" for word in WORDS), "--functions", "rhs", "--output", str(tmp_path)]) == 0
    assert sorted(p.name for p in tmp_path.iterdir()) == [
        "pendulum.f90", "pendulum.jl", "pendulum.m", "pendulum.rs", "pendulum_main.f90", "pendulum_main.jl", "pendulum_main.rs",
        "pendulum_selftest.m"]
    assert main(["export", "pendulum"]) == 2 and "--rust" in capsys.readouterr().err
    assert main(["export", "floating_crane", "--rust", "--functions", "rhs"]) != 0
    assert "no text of it; take C or NumPy" in capsys.readouterr().err
