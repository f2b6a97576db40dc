"""Functions in C of rows of numbers, as tests compare them with the same in Python."""

from __future__ import annotations

import ctypes
import subprocess
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from symdyn.runtime.building.compiler import find_compiler, require_compiler
from tests.backend.c_warnings import RUNTIME

# values (n, n_in) -> results (n, n_out), and where there are none
Rows = Callable[[np.ndarray], tuple[np.ndarray, np.ndarray]]

needs_c = pytest.mark.skipif(find_compiler() is None or require_compiler().kind not in ("gcc", "clang"),
                             reason="no compiler that takes these options")


def rows_in_c(folder: Path, text: str, function: str, n_in: int, n_out: int) -> Rows:
    """A function of the text; `function`: what its call begins with, up to the arguments in and out, such as "f(" or "f(2, "."""
    (folder / "main.c").write_text(
        f"#define SYMDYN_SINGLE 0\n#define SYMDYN_THREADS 0\n{text}\n"
        f"void run(int n, const double *in, double *out, int *codes);\n"
        f"void run(int n, const double *in, double *out, int *codes) {{\n    for (int k = 0; k < n; k++)\n"
        f"        codes[k] = {function}in + k * {n_in}, out + k * {n_out});\n}}\n")
    made = folder / "main.so"
    subprocess.run([*require_compiler().command, "-std=c99", "-O2", "-ffp-contract=off", "-fPIC", "-shared", f"-I{RUNTIME}",
                    "-o", made, folder / "main.c", "-lm"], check=True, capture_output=True)
    library = ctypes.CDLL(str(made))

    def run(values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        given = np.ascontiguousarray(values)
        out, codes = np.full((len(values), n_out), np.nan), np.zeros(len(values), dtype=np.intc)
        library.run(len(values), *[a.ctypes.data_as(ctypes.c_void_p) for a in (given, out, codes)])
        return out, codes != 0

    return run
