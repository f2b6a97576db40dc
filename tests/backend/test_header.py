"""The header of written files: it declares what the file exports, and a program needs nothing else."""

from __future__ import annotations

import re
import subprocess
from pathlib import Path

import numpy as np
import pytest

import symdyn as sd
from symdyn.pipeline import emit, write_source
from symdyn.runtime.building.compiler import find_compiler, require_compiler
from symdyn.runtime.integrating.run_record import STATUS
from tests.runtime.test_events import ball

PROGRAM = """#include <stdalign.h>
#include <stdio.h>
#include "double_pendulum.h"

int main(void) {
    static alignas(64) char run[1 << 16];
    double p[double_pendulum_n_p], c[double_pendulum_n_c], t[] = {0.0, 0.5, 1.0}, x[3][4] = {{0}};
    const double span[] = {0.0, 1.0, 1e-9, 0.0, 0.0}, x0[] = {0.1, 0.2, 0.3, 0.4}, atol[] = {1e-9, 1e-9, 1e-9, 1e-9};
    const symdyn_problem problem = {.p = p, .c = c, .length = 1.0};
    long written = 0;
    for (int k = 0; k < double_pendulum_n_p; k++) p[k] = double_pendulum_parameters[k].value;
    if (double_pendulum_prologue(p, c) || double_pendulum_simulation_size() > (long)sizeof run) return 1;
    if (double_pendulum_simulation_start(run, &problem, span, x0, atol)) return 2;
    if (double_pendulum_simulation_go(run, 0, 10000, t, 3, x[0], &written) || written != 3) return 3;
    for (int k = 0; k < 12; k++) printf("%a\\n", x[k / 4][k % 4]);
    return 0;
}
"""
needs_c = pytest.mark.skipif(find_compiler() is None, reason="no C compiler here")


@pytest.mark.every_value
@pytest.mark.parametrize("batch", [False, True])
@pytest.mark.parametrize("system", ["double_pendulum", "four_bar", "ball"])
def test_all_that_is_exported_is_declared(system: str, batch: bool) -> None:
    equations = ball().embedding() if system == "ball" else sd.systems.get(system).equations()
    names = None if system != "ball" else ["rhs", "events", "event_resets"]
    files = emit(equations, "c", names, batch=batch).files
    text = files[f"{system}.c"].replace("SYMDYN_NAME(", f"{system}_(").replace(f"{system}_(", f"{system}_")
    exported = set(re.findall(rf"^SYMDYN_EXPORT [\w *]*?\b{system}_(\w+)\)?\(", text, re.MULTILINE))
    declared = set(re.findall(rf"^[a-z][\w *]*?\b{system}_(\w+)\(", files[f"{system}.h"], re.MULTILINE))
    assert exported == declared and "rhs" in exported and "simulation_go" in exported
    assert ("rhs_batch" in exported) == batch and ("simulation_look" in exported) == (system == "ball")


@needs_c
@pytest.mark.every_value
@pytest.mark.parametrize("batch", [False, True])
@pytest.mark.parametrize("system", ["double_pendulum", "four_bar", "ball"])
def test_declarations_of_the_header_are_those_of_the_file(system: str, batch: bool, tmp_path: Path) -> None:
    """A compiler reads the header before the file, which does not include it, so that it compiles alone, too."""
    names = None if system != "ball" else ["rhs", "events", "event_resets"]
    equations = ball().embedding() if system == "ball" else sd.systems.get(system).equations()
    write_source(emit(equations, "c", names, batch=batch), tmp_path)
    both = tmp_path / "both.c"
    for text, code in ((f'#include "{system}.h"\n', 0), (f'#include "{system}.h"\nvoid {system}_prologue(void);\n', 1)):
        both.write_text(f'{text}#include "{system}.c"\n')
        read = ["-fsyntax-only"] if require_compiler().kind in ("gcc", "clang") else ["-c", "-o", tmp_path / "both.o"]
        done = subprocess.run([*require_compiler().command, "-std=c99", *read, both], capture_output=True, text=True)
        assert (done.returncode != 0) == code, done.stderr


STATUSES = """#include <stdio.h>
#include "double_pendulum.h"

int main(void) {
    const int statuses[] = {STATUSES};
    printf("%d %d\\n", SYMDYN_DONE, SYMDYN_STOPPED);
    for (int k = 0; k < N; k++) printf("%s\\n", symdyn_status_text(statuses[k]));
    return 0;
}
"""


@needs_c
def test_a_program_reads_statuses_by_name_and_as_text(tmp_path: Path) -> None:
    write_source(emit(sd.systems.get("double_pendulum").embedding(), "c"), tmp_path)
    names = [f"SYMDYN_{name}" for name in vars(STATUS)]
    text = STATUSES.replace("{STATUSES}", f"{{{', '.join(names)}, 99}}").replace("N;", f"{len(names) + 1};")
    (tmp_path / "main.c").write_text(text)
    done = subprocess.run([*require_compiler().command, "-std=c99", "-o", tmp_path / "run", tmp_path / "main.c"],
                          capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    codes, *texts = subprocess.run([tmp_path / "run"], capture_output=True, text=True, check=True).stdout.splitlines()
    assert codes == "0 3" and texts[-1] == "unknown status" and len(set(texts)) == len(names) + 1
    assert texts[list(vars(STATUS)).index("STEP_TOO_SMALL")] == "the step became too small for the tolerance"


def test_an_option_leaves_the_integrator_out() -> None:
    files = emit(sd.systems.get("double_pendulum").embedding(), "c", integrator=False).files
    assert not any("simulation_" in text or "symdyn_problem" in text for text in files.values())


@needs_c
def test_a_program_integrates(tmp_path: Path) -> None:
    equations = sd.systems.get("double_pendulum").embedding()
    write_source(emit(equations, "c"), tmp_path)
    (tmp_path / "main.c").write_text(PROGRAM)
    strict = ["-std=c11", "-O1", "-ffp-contract=off", "-Wall", "-Wextra", "-Wmissing-prototypes", "-Wno-unused-const-variable",
              "-Werror"] if require_compiler().kind in ("gcc", "clang") else []
    done = subprocess.run([*require_compiler().command, *strict, "-o", tmp_path / "run", tmp_path / "main.c",
                           tmp_path / "double_pendulum.c", "-lm"], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    printed = subprocess.run([tmp_path / "run"], capture_output=True, text=True, check=True).stdout
    x = np.array([float.fromhex(line) for line in printed.split()]).reshape(3, 4)
    run = equations.compile(backend="c").simulate([0.0, 0.5, 1.0], q=[0.1, 0.2], u=[0.3, 0.4], rtol=1e-9)
    np.testing.assert_allclose(x, run.x, rtol=0, atol=1e-12)
