"""Agreement of files in other languages with the C module: compiled or interpreted here, at random states."""

from __future__ import annotations

import shutil
import subprocess
import tempfile
from collections.abc import Callable
from pathlib import Path

import numpy as np

from symdyn.emission import emit, write_source
from symdyn.formulation.equations import Equations

# Language -> the program that runs it; Julia is not among them, as no interpreter is packaged.
PROGRAMS = {"fortran": "gfortran", "matlab": "octave-cli", "rust": "rustc"}
SECONDS = 600


def program_for(language: str) -> str | None:
    """The path of what runs a language here, or None."""
    name = PROGRAMS[language]
    return shutil.which(name) or shutil.which(name, path=str(Path.home() / ".cargo" / "bin"))


def built(language: str, folder: Path, name: str) -> list[str]:
    """The command that runs the example of the files of a mechanism in a folder, compiled where the language is compiled."""
    program = program_for(language)
    assert program is not None
    compiled = {"fortran": [program, "-O2", "-ffree-line-length-none", f"{name}.f90", f"{name}_main.f90", "-o", "example"],
                "rust": [program, "-O", "--edition", "2021", f"{name}_main.rs", "-o", "example"]}
    if language in compiled:
        subprocess.run(compiled[language], cwd=folder, check=True, capture_output=True, text=True, timeout=SECONDS)
        return [str(folder / "example")]
    return [program, "--quiet", "--no-init-file", "--eval", f"exit({name}_selftest() > 0)"]


def evaluated(equations: Equations, language: str) -> Callable[..., np.ndarray]:
    """The right-hand side in a language, of t (n,), x (n, n_x), parameters and inputs (n, n_in); the parameters are defaults."""
    source = emit(equations, language, ["rhs"])
    folder, name = Path(tempfile.mkdtemp()), source.metadata.name
    write_source(source, folder)
    command = built(language, folder, name)

    def run(t: np.ndarray, x: np.ndarray, p: np.ndarray, inputs: np.ndarray) -> np.ndarray:
        rows = np.column_stack([t, x, inputs])
        np.savetxt(folder / "states.txt", rows, fmt="%.17e")
        if language == "matlab":
            n_x = x.shape[1]
            text = (f"s = dlmread('states.txt'); r = NaN({len(rows)}, {n_x}); "
                    f"for k = 1:rows(s), try, r(k, :) = {name}('rhs', s(k, 1), s(k, 2:{n_x + 1}).', [], s(k, {n_x + 2}:end).'); "
                    "catch, end, end, dlmwrite('found.txt', r, 'delimiter', ' ', 'precision', '%.17e');")
            subprocess.run([*command[:-1], text], cwd=folder, check=True, capture_output=True, timeout=SECONDS)
            return np.loadtxt(folder / "found.txt", ndmin=2)
        with (folder / "states.txt").open() as states:
            result = subprocess.run([*command, "rhs"], cwd=folder, stdin=states, check=True, capture_output=True, text=True,
                                    timeout=SECONDS).stdout
        return np.array([[float(word) for word in line.split()] for line in result.splitlines()])

    return run
