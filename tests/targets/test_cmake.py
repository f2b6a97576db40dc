"""CMake packages: configured, built, installed and used, on this machine and on an emulated Cortex-M4."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

import symdyn as sd
from symdyn.cli import main
from symdyn.emission import emit, write_source
from symdyn.lab.firmware import on_target, tools
from symdyn.runtime.building.compiler import find_compiler
from symdyn.targets.cmake import deepest, stack_of
from tests.helpers import swept

# Stacks are counted by gcc.
pytestmark = pytest.mark.native

needs_cmake = pytest.mark.skipif(shutil.which("cmake") is None or shutil.which("c++") is None, reason="no cmake or C++ compiler")
needs_arm = pytest.mark.skipif(bool(tools()), reason=f"not on PATH: {tools()}")

# A program of a user: the header, arrays, a fault, and results to 17 digits.
PROGRAM = """
#include <array>
#include <cstdio>
#include <two_link_arm/two_link_arm.hpp>
namespace arm = two_link_arm;
int main() {
    const std::array<arm::real, arm::n_p> params = {%(params)s};
    const arm::model model(params);
    std::array<arm::real, arm::n_x> x = {%(x)s}, rates{};
    const std::array<arm::real, arm::n_inputs> inputs = {arm::real(0.7), arm::real(-0.2)};
    std::array<arm::real, arm::n_x * arm::n_x> jacobian{};
    if (model.code() || model.rhs(x, inputs, rates) || model.jacobian_x(x, inputs, jacobian)) return 1;
    for (arm::real v : rates) std::printf("%%.17g ", double(v));
    for (arm::real v : jacobian) std::printf("%%.17g ", double(v));
    for (int k = 0; k < 100; k++)
        if (model.step(0, arm::real(0.01), x, inputs)) return 2;
    for (arm::real v : x) std::printf("%%.17g ", double(v));
    return 0;
}
"""
LISTS = """
cmake_minimum_required(VERSION 3.16)
project(program CXX)
find_package(two_link_arm REQUIRED)
add_executable(program main.cpp)
target_link_libraries(program two_link_arm::two_link_arm)
"""
X = [0.3, -0.4, 0.5, 0.2]


@pytest.fixture(scope="module")
def package(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("package")
    sd.systems.two_link_arm().embedding().to_cmake(folder, jacobian=True)
    return folder


@pytest.fixture(scope="module")
def loop(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("loop")
    sd.systems.four_bar().augmented().to_cmake(folder)
    return folder


def _run(*command: str | Path) -> str:
    done = subprocess.run([str(c) for c in command], capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@needs_cmake
@pytest.mark.parametrize(("real", "digits"), swept([("double", 1e-14), ("float", 1e-5)], ("double", 1e-14)))
def test_the_installed_package_is_found_and_used(package, tmp_path, real, digits):
    module = sd.systems.two_link_arm().compile(backend="c")
    _run("cmake", "-S", package, "-B", tmp_path / "build", f"-DTWO_LINK_ARM_REAL={real}", "-DTWO_LINK_ARM_TEST=ON",
         "-DCMAKE_BUILD_TYPE=Release", f"-DCMAKE_INSTALL_PREFIX={tmp_path / 'installed'}",
         "-DCMAKE_C_FLAGS=-Wall -Wextra -Wpedantic -Werror")
    _run("cmake", "--build", tmp_path / "build")
    assert re.search(r"[1-9]\d* results compared, 0 wrong", _run(tmp_path / "build" / "two_link_arm_selftest"))
    _run("cmake", "--install", tmp_path / "build")
    user = tmp_path / "user"
    user.mkdir()
    values = {what: ", ".join(f"arm::real({float(v)!r})" for v in numbers)
              for what, numbers in (("params", module.default_parameters), ("x", X))}
    (user / "main.cpp").write_text(PROGRAM % values)
    (user / "CMakeLists.txt").write_text(LISTS)
    _run("cmake", "-S", user, "-B", user / "build", f"-DCMAKE_PREFIX_PATH={tmp_path / 'installed'}",
         "-DCMAKE_CXX_FLAGS=-Wall -Wextra -Wpedantic -Werror")
    _run("cmake", "--build", user / "build")
    found = np.array(_run(user / "build" / "program").split(), dtype=float)
    inputs = [0.7, -0.2]
    wanted = module.rhs(0.0, np.array(X), inputs=np.array(inputs))
    jacobian = module.jacobian(0.0, X, inputs=inputs).x.ravel()
    assert np.abs(found[:4] - wanted).max() <= digits * np.abs(wanted).max()
    assert np.abs(found[4:20] - jacobian).max() <= digits * np.abs(jacobian).max()
    # The same steps of the same method with the module's right-hand side.
    x = np.array(X)
    for _ in range(100):
        k = [module.rhs(0.0, x, inputs=np.array(inputs))]
        for part in (0.005, 0.005, 0.01):
            k.append(module.rhs(0.0, x + part * k[-1], inputs=np.array(inputs)))
        x = x + 0.01 / 6 * (k[0] + 2 * k[1] + 2 * k[2] + k[3])
    assert np.abs(found[20:] - x).max() <= 100 * digits * np.abs(x).max()


@needs_cmake
def test_another_kind_of_number_is_rejected_by_cmake(package, tmp_path):
    done = subprocess.run(["cmake", "-S", str(package), "-B", str(tmp_path), "-DTWO_LINK_ARM_REAL=half"], capture_output=True,
                          text=True)
    assert done.returncode != 0 and "pass double or float" in done.stderr


@needs_cmake
def test_a_wrong_size_does_not_compile(package, tmp_path):
    text = tmp_path / "wrong.cpp"
    text.write_text("#include <array>\n#include <two_link_arm/two_link_arm.hpp>\nint main() {\n"
                    "    std::array<two_link_arm::real, 3> params{};\n    return two_link_arm::model(params).code();\n}\n")
    done = subprocess.run(["c++", "-std=c++17", "-fsyntax-only", "-I", str(package / "include"), str(text)], capture_output=True,
                          text=True)
    assert done.returncode != 0 and "no matching function" in done.stderr
    right = tmp_path / "right.cpp"
    right.write_text(text.read_text().replace("real, 3>", "real, 9>"))
    _run("c++", "-std=c++17", "-fsyntax-only", "-I", package / "include", right)


@pytest.mark.every_value
@needs_arm
@pytest.mark.parametrize("real", ["float", "double"])
@pytest.mark.parametrize("name", ["two_link_arm", "four_bar"])
def test_the_self_test_passes_on_a_cortex_m(package, loop, name, real):
    result = on_target(package if name == "two_link_arm" else loop, real)
    assert result.wrong == 0 and result.compared >= 8, result.output
    assert 0 < result.rhs < result.step < 400_000
    assert 0 < result.stack_bytes < 16_384 and 0 < result.code_bytes < 100_000


@needs_arm
def test_steps_on_a_cortex_m_keep_the_constraints_and_the_motion(loop):
    """200 steps of 1 ms in double on the processor, compared with simulate."""
    module = sd.systems.four_bar().compile(backend="c")
    output = on_target(loop, "double").output
    x = np.array(re.search(r"steps of 1 ms: (.*)", output)[1].split(), dtype=float)
    wanted = module.simulate((0, 0.2), rtol=1e-12).x[-1]
    assert np.abs(x - wanted).max() < 1e-8


@pytest.mark.skipif(find_compiler() is None or find_compiler().kind != "gcc", reason="no gcc")
def test_the_stack_is_stated_in_the_package(package):
    stacks, _ = stack_of(package, "two_link_arm")
    chain = deepest(package / "src" / "two_link_arm.c", stacks)
    names = ("step", "field", "rhs")
    assert chain >= sum(stacks.get(f"two_link_arm_{n}", 0) for n in names) > 0
    assert f"The deepest chain of calls takes {chain} bytes" in (package / "README.md").read_text()


def test_no_heap_and_no_globals(package):
    text = (package / "src" / "two_link_arm.c").read_text()
    assert not re.search(r"\b(malloc|calloc|realloc|free)\b", text)
    outside = [line for line in text.splitlines() if re.match(r"(static )?(symdyn_real|double|int|long)\b[^(]*;", line)]
    assert outside == []


def test_events_are_rejected(tmp_path):
    y = sd.coordinates("y")
    m, g = sd.parameters("m g", positive=True)
    system = sd.System("ball", gravity=[0, -g])
    ball = system.add_body("ball", mass=m)
    system.add_joint(sd.Prismatic("fall", system.ground, ball, y, axis=[0, 1]))
    system.add_event("bounce", sd.position(ball)[1], direction=-1, reset={y.dot: -y.dot})
    with pytest.raises(sd.ArgumentError, match="do not look for the event bounce"):
        system.embedding().to_cmake(tmp_path)
    with pytest.raises(sd.ArgumentError, match="do not look for the event bounce"):
        emit(system.embedding(), "firmware")
    assert "ball_step" not in emit(system.embedding(), "firmware", ["mass_matrix"]).files["include/ball/ball.h"]


FORCES = """
#include <cstdio>
#include <two_link_arm/two_link_arm.hpp>
namespace arm = two_link_arm;
int main() {
    const arm::model model(std::array<arm::real, arm::n_p>{%(params)s});
    std::array<arm::real, arm::n_u> tau{};
    const int code = model.inverse_dynamics(std::array<arm::real, arm::n_x>{%(x)s}, std::array<arm::real, arm::n_ud>{%(ud)s},
                                            std::array<arm::real, arm::n_inputs>{0.7, -0.2}, tau);
    for (arm::real v : tau) std::printf("%%.17g ", double(v));
    return code;
}
"""


@needs_cmake
def test_the_command_line_writes_all_functions_for_firmware(tmp_path, capsys):
    """Default functions, of which inverse dynamics take accelerations: the self-test in both kinds of numbers, and from C++."""
    main(["generate", "two_link_arm", "--backend", "firmware", "--output", str(tmp_path)])
    assert "inverse_dynamics" in capsys.readouterr().out
    for real in ("double", "float"):
        build = tmp_path / real
        _run("cmake", "-S", tmp_path, "-B", build, f"-DTWO_LINK_ARM_REAL={real}", "-DTWO_LINK_ARM_TEST=ON",
             "-DCMAKE_C_FLAGS=-Wall -Wextra -Wpedantic -Werror")
        _run("cmake", "--build", build)
        assert re.search(r"[1-9]\d* results compared, 0 wrong", _run(build / "two_link_arm_selftest"))
    module, rates = sd.systems.two_link_arm().compile(), [1.5, -2.5]
    values = {"params": module.default_parameters, "x": X, "ud": rates}
    (tmp_path / "forces.cpp").write_text(FORCES % {what: ", ".join(repr(float(v)) for v in row) for what, row in values.items()})
    _run("c++", "-std=c++17", "-I", tmp_path / "include", tmp_path / "forces.cpp", "-L", tmp_path / "double", "-ltwo_link_arm",
         "-o", tmp_path / "forces")
    found = np.array(_run(tmp_path / "forces").split(), dtype=float)
    wanted = module.inverse_dynamics(X[:2], X[2:], rates, inputs=[0.7, -0.2])
    assert np.abs(found - wanted).max() <= 1e-14 * np.abs(wanted).max()


def test_functions_without_rhs_have_a_self_test_for_firmware(tmp_path):
    folder = tmp_path / "pendulum"
    write_source(emit(sd.systems.pendulum().embedding(), "firmware", ["inverse_dynamics"]), folder)
    compiler = find_compiler()
    assert compiler is not None and compiler.command is not None
    _run(*compiler.command, "-std=c99", "-Wall", "-Wextra", "-Werror", "-I", folder / "include", folder / "src" / "pendulum.c",
         folder / "test" / "selftest.c", "-lm", "-o", folder / "selftest")
    assert re.search(r"[1-9]\d* results compared, 0 wrong", _run(folder / "selftest"))


def test_a_path_that_is_none_is_rejected():
    with pytest.raises(sd.ArgumentError, match="the path of the CMake package"):
        sd.systems.pendulum().embedding().to_cmake(3)


def test_the_command_writes_a_package(tmp_path, capsys):
    from symdyn.cli import main

    assert main(["export", "pendulum", "--cmake", "--jacobians", "--output", str(tmp_path)]) == 0
    assert "CMakeLists.txt" in capsys.readouterr().out
    assert "pendulum_jacobian_x" in (tmp_path / "include" / "pendulum" / "pendulum.h").read_text()
