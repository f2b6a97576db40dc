"""The numeric algorithms for constraints in Fortran and Rust, against those in Python over ten thousand inputs, and in MATLAB, as
Octave runs it, over every thirteenth of these and of those that are rejected.

There is no interpreter of Julia here, and the functions of a Modelica model are run by no program without the model.
"""

from __future__ import annotations

import functools
import subprocess
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from symdyn.backend.context import Algorithms
from symdyn.backend.source import _shipped, template_folders
from symdyn.lab.languages import PROGRAMS, program_for
from symdyn.tape.intrinsics import Intrinsic, Multipliers, Saddle
from tests.tape.test_algorithms import SIZES, forces, saddle_points

ENDINGS = {"fortran": "f90", "matlab": "m", "rust": "rs"}
# One of so many inputs is taken: an interpreter is slow.
EVERY = {"fortran": 1, "matlab": 13, "rust": 1}
FORTRAN = """module solvers
    implicit none
    integer, parameter :: dp = kind(1.0d0)
contains
%s
end module

program driver
    use solvers
    use, intrinsic :: ieee_arithmetic
    character(20) :: word(5)
    integer :: n, m, n_in, rows, k, code
    real(dp), allocatable :: values(:), x(:)
    do k = 1, 5
        call get_command_argument(k, word(k))
    end do
    read (word(2:), *) n, m, n_in, rows
    allocate (values(n_in), x(merge(n, m, word(1) == "saddle")))
    open (10, file="values" // trim(word(2)), access="stream", form="unformatted")
    open (11, file="results" // trim(word(2)), access="stream", form="unformatted", status="replace")
    do k = 1, rows
        read (10) values
        if (word(1) == "saddle") then
            call symdyn_saddle(n, m, values, x, code)
        else
            call symdyn_multipliers(n, m, values, x, code)
        end if
        if (code /= 0) x = ieee_value(1.0_dp, ieee_quiet_nan)
        write (11) x
    end do
end program
"""
RUST = """#![allow(non_snake_case)]
%s
fn main() {
    let words: Vec<String> = std::env::args().collect();
    let (saddle, n, m): (bool, usize, usize) = (words[1] == "saddle", words[2].parse().unwrap(), words[3].parse().unwrap());
    let bytes = std::fs::read(format!("values{n}")).unwrap();
    let values: Vec<f64> = bytes.chunks(8).map(|b| f64::from_le_bytes(b.try_into().unwrap())).collect();
    let mut results = Vec::new();
    for row in values.chunks(words[4].parse().unwrap()) {
        let x = if saddle { symdyn_saddle(n, m, row) } else { symdyn_multipliers(n, m, row) };
        for v in x.unwrap_or(vec![f64::NAN; if saddle { n } else { m }]) {
            results.extend_from_slice(&v.to_le_bytes());
        }
    }
    std::fs::write(format!("results{n}"), results).unwrap();
}
"""
MATLAB = """function driver(called, n, m, n_in, rows)
file = fopen(sprintf('values%d', n));
values = fread(file, [n_in, rows], 'double');
fclose(file);
size_of_x = n;
if strcmp(called, 'multipliers'), size_of_x = m; end
results = NaN(size_of_x, rows);
for k = 1:rows
    if strcmp(called, 'saddle'), x = symdyn_saddle(n, m, values(:, k)); else, x = symdyn_multipliers(n, m, values(:, k)); end
    if ~isempty(x), results(:, k) = x; end
end
file = fopen(sprintf('results%d', n), 'w');
fwrite(file, results, 'double');
fclose(file);
end

%s
"""


@functools.cache
def algorithms_in(language: str) -> str:
    """The text of both solvers in a language."""
    environment = _shipped(*template_folders())
    return "\n".join(environment.get_template(f"{language}/symdyn_{name}.{ENDINGS[language]}.jinja").render(
        algorithms=Algorithms((), (), ())) for name in ("factors", "saddle", "multipliers"))


@pytest.fixture(scope="module")
def command(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], tuple[list[str], Path]]:
    """command(language): what runs its driver, and in which folder."""
    @functools.cache
    def made(language: str) -> tuple[list[str], Path]:
        folder, program = tmp_path_factory.mktemp(language), program_for(language)
        assert program is not None
        text = {"fortran": FORTRAN, "matlab": MATLAB, "rust": RUST}[language].replace("%s", algorithms_in(language))
        source = folder / f"driver.{ENDINGS[language]}"
        source.write_text(text)
        if language == "matlab":
            return [program, "--quiet", "--no-init-file", "--eval"], folder
        options = {"fortran": ["-O2", "-ffp-contract=off", "-ffree-line-length-none"], "rust": ["-O", "--edition", "2021"]}
        subprocess.run([program, *options[language], source, "-o", folder / "driver"], check=True, capture_output=True)
        return [str(folder / "driver")], folder

    return made


@functools.cache
def problem(kind: str, n: int, m: int) -> tuple[np.ndarray, np.ndarray]:
    """Inputs of one size, and the results in Python, NaN where there are none."""
    intrinsic: Intrinsic = Saddle((n, m), "") if kind == "saddle" else Multipliers((n, m), "")
    values = np.ascontiguousarray((saddle_points if kind == "saddle" else forces)(n, m))
    expected = intrinsic.rows(values.T)
    expected[~np.isfinite(expected).all(axis=1)] = np.nan
    return values, expected


@pytest.mark.native
@pytest.mark.parametrize("kind", ["saddle", "multipliers"])
@pytest.mark.parametrize("language", [pytest.param(language, marks=pytest.mark.skipif(
    program_for(language) is None, reason=f"there is no {program}")) for language, program in PROGRAMS.items()])
def test_solvers_give_what_python_gives(language: str, kind: str, command: Callable[[str], tuple[list[str], Path]]) -> None:
    """The same bits, and the same inputs rejected."""
    ran, folder = command(language)
    calls, taken = [], {}
    for n, m in SIZES:
        whole = problem(kind, n, m)
        rejected = np.flatnonzero(np.isnan(whole[1]).any(axis=1))
        some = np.union1d(np.arange(0, len(whole[0]), EVERY[language]), rejected[::EVERY[language]])
        values, expected = (rows[some] for rows in whole)
        values.tofile(folder / f"values{n}")
        calls.append([kind, *map(str, (n, m, values.shape[1], len(values)))])
        taken[n] = expected
    if language == "matlab":  # its start takes longest
        calls = [["; ".join(f"driver('{words[0]}', {', '.join(words[1:])})" for words in calls)]]
    for words in calls:
        subprocess.run([*ran, *words], cwd=folder, check=True, capture_output=True)
    for n, expected in taken.items():
        found = np.fromfile(folder / f"results{n}").reshape(expected.shape)
        found[~np.isfinite(found).all(axis=1)] = np.nan
        np.testing.assert_array_equal(found, expected)
        assert 0.2 < np.isfinite(found).all(axis=1).mean() < 1
