"""The runtime's C files as they are, with small models written by hand: known motions, a circle, a cubic, linear algebra."""

from __future__ import annotations

import ctypes
import functools
import itertools
import subprocess
import tempfile
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any, NamedTuple

import numpy as np
import pytest

from symdyn import thresholds
from symdyn.backend.band import Band
from symdyn.backend.context import Corrections, Integrator, Manifold
from symdyn.backend.gathered import Gathered
from symdyn.backend.integrated import Shape, sizes, switches
from symdyn.backend.metadata import EventRecord
from symdyn.backend.methods import METHODS
from symdyn.backend.methods.gauss import OfGauss
from symdyn.backend.methods.radau import FIVE_STAGES, THREE_STAGES
from symdyn.backend.packed import Pattern
from symdyn.backend.source import _shipped, template_folders
from symdyn.runtime.batches.motions import BatchMotions
from symdyn.runtime.batches.states import Table
from symdyn.runtime.building.compiler import find_compiler, require_compiler
from symdyn.runtime.integrating.compiled import Problem
from symdyn.runtime.integrating.run_record import NOTED, STATUS, Noted, RunReport
from tests.backend.c_warnings import RUNTIME, faults_of

STRICT = ("-std=c99", "-O1", "-ffp-contract=off", "-Wall", "-Wextra", "-Wno-unused-function", "-Wno-unused-const-variable",
          "-Werror", "-fPIC", "-shared")
SIGNATURE = "(const symdyn_problem *problem, double t, const double *x, double *out)"
BOUNDED = "(const symdyn_problem *problem, const double *ud, double *out)"
OSCILLATOR = {"field": "out[0] = x[1]; out[1] = -x[0];", "jacobian_x_at": "out[0] = 0; out[1] = 1; out[2] = -1; out[3] = 0;"}

pytestmark = pytest.mark.skipif(find_compiler() is None or require_compiler().kind not in ("gcc", "clang"),
                                reason="no compiler that takes these options")
Build = Callable[..., ctypes.CDLL]


@functools.cache
def compiled(text: str, model: str, options: tuple[str, ...], analyzed: bool) -> ctypes.CDLL:
    """The library of a text and its model.h, for all tests that have the same."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        source, made = folder / "main.c", folder / "main.so"
        source.write_text(text)
        (folder / "model.h").write_text(model)
        done = subprocess.run([*require_compiler().command, *STRICT, *options, f"-I{RUNTIME}", f"-I{folder}", "-o", made, source,
                               "-lm"], capture_output=True, text=True)
        assert done.returncode == 0, done.stderr
        assert faults_of(source, *options, f"-I{RUNTIME}", f"-I{folder}", tidy=analyzed) == ""
        return ctypes.CDLL(str(made))


@pytest.fixture
def build(tmp_path: Path) -> Build:
    """build(text): the library of a text that includes parts, in which no tool that is here finds a fault.

    analyzed: whether clang-tidy looks at it, too; not where it sees the same parts in another text.
    """
    def library(text: str, *options: str, analyzed: bool = True) -> ctypes.CDLL:
        threads = "".join(f"#define {name} 0\n" for name in ("SYMDYN_THREADS", "SYMDYN_SINGLE") if name not in text)
        model = tmp_path / "model.h"
        return compiled(threads + text, model.read_text() if model.exists() else "", options, analyzed)

    return library


def integrator(method: str, shape: Shape, functions: dict[str, str], tmp_path: Path, further: str = "",
               band: Band | None = None, corrections: Corrections | None = None, series: Series | None = None) -> str:
    """A text that includes runtime.c with a model: statements of its functions by their names."""
    record = METHODS[method]
    gathered: Gathered = OfGauss(second_order=True) if method == "gauss" else Gathered()
    if method.startswith("radau"):
        assert record.gather is not None
        gathered = record.gather(SimpleNamespace(band=band))
    if series is not None:
        gathered = Gathered(unrolled=series.unrolled)
    context = {"integrator": Integrator(record, shape, gathered, (), ()),
               "manifold": Manifold(tuple(map(tuple, shape.unit_groups)), corrections)}
    tables_text = series.text if series is not None else _shipped(*template_folders()).get_template(
        "c/interface.c.jinja").render(context)
    bodies = "".join(f"static int symdyn_{name}{BOUNDED if name.endswith('_of') else SIGNATURE} {{\n(void)problem;\n"
                     f"{'' if name.endswith('_of') else '(void)t, (void)x;'}\n{body}\nreturn 0;\n}}\n"
                     for name, body in functions.items())
    (tmp_path / "model.h").write_text(bodies + tables_text)
    macros = dict(sizes(record, shape, gathered))
    macros = {name: int(on) for name, on in switches(record, shape, gathered, False).items()} | macros
    head = "".join(f"#define {name} {value}\n" for name, value in macros.items())
    return (f'{head}#define SYMDYN_NAME(function) symdyn_##function\n#define SYMDYN_LINKED static\n'
            f'#define SYMDYN_MODEL "model.h"\n#include "runtime.c"\n{further}')


class Run:
    """A run of a library made of runtime.c."""

    def __init__(self, library: ctypes.CDLL, x0: list[float], span: tuple[float, float], rtol: float, first: float = 0.0,
                 project: bool = False, look: int = 0) -> None:
        self.library, self.n = library, len(x0)
        library.symdyn_simulation_size.restype = ctypes.c_long
        self.memory = ctypes.create_string_buffer(library.symdyn_simulation_size() + 64)
        self.address = ctypes.c_void_p((ctypes.addressof(self.memory) + 63) // 64 * 64)
        self.problem = Problem(project=int(project), length=1.0)
        given = [np.array(a, dtype=float) for a in ([*span, rtol, first, 0.0], x0, [rtol] * len(x0))]
        assert library.symdyn_simulation_start(self.address, ctypes.byref(self.problem), *map(pointer, given)) == 0
        if look:
            library.symdyn_simulation_look(self.address, pointer(np.ones(look, dtype=np.intc)), ctypes.c_double(0.0))

    def events(self, n_events: int) -> np.ndarray:
        """Rows of which, time, state before, state after."""
        noted = np.zeros(thresholds.most_events(n_events), dtype=np.dtype(Noted))
        states = np.zeros((len(noted), 2 * self.n))
        self.library.symdyn_simulation_events.restype = ctypes.c_long
        n = self.library.symdyn_simulation_events(self.address, pointer(noted), pointer(states))
        assert (noted["kind"][:n] == NOTED.HAPPENED).all()
        return np.column_stack([noted["event"][:n], noted["t"][:n], states[:n]])

    def at(self, times: np.ndarray) -> np.ndarray:
        """States at the times, after which the run is over."""
        status, written, x = self.go(times)
        assert status == 0 and written == len(times)
        return x

    def go(self, times: np.ndarray) -> tuple[int, int, np.ndarray]:
        """Status, how many states at the times were written, and these."""
        x, written = np.full((len(times), self.n), np.nan), ctypes.c_long(0)
        given = ctypes.c_long(100_000), pointer(times), ctypes.c_long(len(times)), pointer(x), ctypes.byref(written)
        return self.library.symdyn_simulation_go(self.address, 0, *given), written.value, x

    def report(self) -> RunReport:
        out, states = RunReport(), np.zeros((2, self.n))
        self.library.symdyn_simulation_report(self.address, ctypes.byref(out), pointer(states))
        return out


def pointer(array: np.ndarray) -> ctypes.c_void_p:
    return ctypes.c_void_p(array.ctypes.data)


# Steps of "taylor" need series, see below.
@pytest.mark.parametrize("method", [m for m in METHODS if m != "taylor"])
def test_an_oscillator(method: str, build: Build, tmp_path: Path) -> None:
    needed = {name: body for name, body in OSCILLATOR.items() if name == "field" or method.startswith("radau")}
    library = build(integrator(method, Shape({"q": 1, "u": 1, "z": 0, "inputs": 0}, 0, (), ()), needed, tmp_path))
    times = np.linspace(0, 10, 41)
    run = Run(library, [1.0, 0.0], (0.0, 10.0), 1e-11)
    np.testing.assert_allclose(run.at(times), np.column_stack([np.cos(times), -np.sin(times)]), rtol=0, atol=2e-8)
    report = run.report()
    assert report.status == STATUS.DONE and report.t == 10.0 and report.n_evaluations > report.n_steps > 5
    back = Run(library, [np.cos(10.0), -np.sin(10.0)], (10.0, 0.0), 1e-11).at(np.array([0.0]))
    np.testing.assert_allclose(back, [[1.0, 0.0]], rtol=0, atol=2e-8)


class Series(NamedTuple):
    """The recurrence of x_dot = -x^2, whose coefficients are x_k' = -(2 x_0 x_k + x_1 x_(k-1) + ... + x_(k-1) x_1)."""

    unrolled: bool
    orders: int

    @property
    def text(self) -> str:
        """With one sum, or that among the four of a vector, whose others are zero."""
        sums, row = (1, 3) if self.unrolled else (4, 24)
        sizes = {"ORDERS": self.orders, "SUMS": sums, "BLOCK": sums, "BLOCK_LANES": sums, "ROW": row, "SERIES_NC": 1,
                 "SERIES_START": 1, "INLINE": "", "EACH_ORDER(ORDER)": " ".join(f"ORDER({k + 1})" for k in range(self.orders))}
        return "".join(f"#define SYMDYN_{name} {value}\n" for name, value in sizes.items()) + RECURRENCE


RECURRENCE = """
static int symdyn_constants(const double *p, double *out) { (void)p, (void)out; return 0; }
static int symdyn_series_at(const symdyn_problem *problem, double t, const double *x, const double *c, double *out) {
    (void)problem, (void)t, (void)c;
    out[0] = -x[0]*x[0];
    out[1] = x[0];
    return 0;
}
static void symdyn_series_after(double k, const double *q, const double *sums, const double *z, const double *ud,
    const double *factors, const double *p, const double *c, double *out) {
    (void)k, (void)ud, (void)factors, (void)p, (void)c;
    for (int i = 0; i < 2*SYMDYN_SUMS; i++) out[i] = i % SYMDYN_SUMS ? 0.0 : q[0];
    out[2*SYMDYN_SUMS] = -(2.0*z[0]*q[0] + sums[0]);
}
"""


@pytest.mark.parametrize(("unrolled", "orders"), [(True, 30), (False, 30), (True, 8)])
def test_series_of_a_hyperbola(unrolled: bool, orders: int, build: Build, tmp_path: Path) -> None:
    """x = 1/(1 + t), forwards and backwards, whether orders are written out or not, in few steps of a high order."""
    shape = Shape({"q": 1, "u": 0, "z": 0, "inputs": 0}, 0, (), ())
    library = build(integrator("taylor", shape, {"field": "out[0] = -x[0]*x[0];"}, tmp_path, series=Series(unrolled, orders)))
    times = np.linspace(0, 10, 21)
    run = Run(library, [1.0], (0.0, 10.0), 1e-13)
    np.testing.assert_allclose(run.at(times)[:, 0], 1 / (1 + times), rtol=0, atol=2e-12)
    report = run.report()
    assert report.status == STATUS.DONE and (5 < report.n_steps < 25 if orders == 30 else report.n_steps > 50)
    back = Run(library, [1 / 11], (10.0, 0.0), 1e-13).at(times[::-1].copy())
    np.testing.assert_allclose(back[:, 0], 1 / (1 + times[::-1]), rtol=0, atol=1e-10)


BAND = """
#include "band.h"
int factorize(int n, int lower, int upper, double *A, double *B, double *scale, int *order);
int factorize(int n, int lower, int upper, double *A, double *B, double *scale, int *order) {
    return B ? symdyn_band_eliminate(n, lower, upper, A, B, scale, order)
             : symdyn_band_eliminate(n, lower, upper, A, 0, scale, order);
}
void solve(int n, int lower, int upper, const double *A, const double *B, const int *order, double *x, double *y);
void solve(int n, int lower, int upper, const double *A, const double *B, const int *order, double *x, double *y) {
    if (B)
        symdyn_band_substitute(n, lower, upper, A, B, order, x, y);
    else
        symdyn_band_substitute(n, lower, upper, A, 0, order, x, 0);
}
"""


class Banded:
    """A matrix in a band, real or complex, factorized by a library made of band.h."""

    def __init__(self, library: ctypes.CDLL, matrix: np.ndarray, lower: int, upper: int) -> None:
        n, self.library, self.is_complex = len(matrix), library, np.iscomplexobj(matrix)
        self.sizes = n, lower, upper
        height = 2 * lower + upper + 1
        parts = np.zeros((2, n, height))
        for i, j in np.argwhere(matrix):
            assert -upper <= i - j <= lower
            parts[:, j, lower + upper + i - j] = matrix[i, j].real, matrix[i, j].imag
        self.A, self.B = parts[0].copy(), parts[1].copy() if self.is_complex else None
        largest = np.abs(matrix).max(axis=1)
        scale = np.append(1 / np.where(largest > 0, largest, 1), np.zeros(lower))
        self.order = np.zeros(n, dtype=np.intc)
        self.singular = library.factorize(*self.sizes, pointer(self.A), self._second(self.B), pointer(scale), pointer(self.order))

    def _second(self, part: np.ndarray | None) -> ctypes.c_void_p | None:
        return None if part is None else pointer(part)

    def solve(self, right: np.ndarray) -> np.ndarray:
        n, lower, upper = self.sizes
        before = lower + upper
        padded = np.concatenate([np.full(before, 7.0), right, np.full(lower, 7.0)])
        x, y = padded.real.copy(), padded.imag.copy()
        inner = [ctypes.c_void_p(v.ctypes.data + 8 * before) for v in (x, y)]
        self.library.solve(*self.sizes, pointer(self.A), self._second(self.B), pointer(self.order), *inner)
        assert (np.delete(x, np.arange(before, before + n)) == 7).all()  # what lies next to the numbers stays
        return (x + 1j * y if self.is_complex else x)[before:before + n]


def random_band(rng: np.random.Generator, n: int, lower: int, upper: int, is_complex: bool) -> np.ndarray:
    """With entries on the main diagonal that are mostly zero, so that rows must be exchanged."""
    matrix = rng.normal(size=(n, n)) + (1j * rng.normal(size=(n, n)) if is_complex else 0)
    matrix = np.triu(np.tril(matrix, upper), -lower)
    np.fill_diagonal(matrix, np.where(rng.random(n) < (0.7 if lower and upper else 0), 0, np.diag(matrix) + 2))
    return matrix


@pytest.mark.parametrize("is_complex", [False, True])
def test_bands_are_solved_as_whole_matrices(is_complex: bool, build: Build) -> None:
    """Against LAPACK: bands of all widths, rows of sizes that differ by 24 decades, up to what the condition leaves."""
    library, rng, exchanged, worst = build(BAND), np.random.default_rng(8), 0, 0.0
    for n in (1, 2, 3, 5, 9, 30):
        for lower, upper in {(min(a, n - 1), min(b, n - 1)) for a in (0, 1, 2, 4, 29) for b in (0, 1, 3, 29)}:
            matrix = random_band(rng, n, lower, upper, is_complex)
            if np.linalg.cond(matrix) > 1e6:
                continue
            right = rng.normal(size=n) + (1j * rng.normal(size=n) if is_complex else 0)
            wanted = np.linalg.solve(matrix, right)
            rows = 10.0**rng.integers(-12, 12, n)
            banded = Banded(library, rows[:, None] * matrix, lower, upper)
            assert banded.singular == 0
            exchanged += int((banded.order != np.arange(n)).sum())
            worst = max(worst, float(np.abs(banded.solve(rows * right) - wanted).max() / np.abs(wanted).max()))
    assert worst < 1e-9 and exchanged > 100


@pytest.mark.parametrize("is_complex", [False, True])
def test_singular_bands_are_found(is_complex: bool, build: Build) -> None:
    """A column of zeros, a row of zeros, rows that are multiples of each other, at every place; not a number."""
    library, n = build(BAND), 6
    unit = 2j if is_complex else 1.0  # with it elimination is exact
    for k in range(n):
        regular = np.diag(np.full(n, 4 * unit)) + np.diag(np.full(n - 1, unit), 1) + np.diag(np.full(n - 1, unit), -1)
        assert Banded(library, regular, 1, 1).singular == 0
        for axis in range(2):
            matrix = regular.copy()
            matrix[(k, slice(None)) if axis else (slice(None), k)] = 0
            assert Banded(library, matrix, 1, 1).singular == 1
        pair = slice(min(k, n - 2), min(k, n - 2) + 2)
        matrix = np.diag(np.full(n, 4 * unit))
        matrix[pair, pair] = unit * np.array([[1, 2], [2, 4]])
        assert Banded(library, matrix, 1, 1).singular == 1
        matrix[pair, pair] = np.nan
        assert Banded(library, matrix, 1, 1).singular == 1


# Masses in a row on springs and dampers, their speeds one after the other behind their positions; the last state integrates the
# first position, another one is a filter. Stiff: 1e6 N/m on 1 kg.
ROW = {
    "field": """enum { N = SYMDYN_NQ };
for (int i = 0; i < N; i++) {
    const double left = i > 0 ? x[i - 1] : 0.0, right = i < N - 1 ? x[i + 1] : 0.0;
    const double before = i > 0 ? x[N + i - 1] : 0.0, behind = i < N - 1 ? x[N + i + 1] : 0.0;
    out[i] = x[N + i];
    out[N + i] = 1e6*(left + right - 2.0*x[i]) + 1e3*(before + behind - 2.0*x[N + i]) - x[i]*x[i]*x[i] - x[2*N];
}
out[2*N] = 50.0*(x[1] - x[2*N]);
out[2*N + 1] = x[0];""",
    "jacobian_x_at": """enum { N = SYMDYN_NQ, S = 2*N + 2 };
for (int k = 0; k < S*S; k++) out[k] = 0.0;
for (int i = 0; i < N; i++) {
    double *const row = out + (N + i)*S;
    out[i*S + N + i] = 1.0;
    row[i] = -2e6 - 3.0*x[i]*x[i];
    row[N + i] = -2e3;
    row[2*N] = -1.0;
    if (i > 0) row[i - 1] = 1e6;
    if (i > 0) row[N + i - 1] = 1e3;
    if (i < N - 1) row[i + 1] = 1e6;
    if (i < N - 1) row[N + i + 1] = 1e3;
}
out[2*N*S + 1] = 50.0;
out[2*N*S + 2*N] = -50.0;
out[(2*N + 1)*S] = 1.0;"""}


NEWTON = """
int newton(const double *jacobian, double h, int root, double *x, double *y);
int newton(const double *jacobian, double h, int root, double *x, double *y) {
    static symdyn_method method;
    for (int i = 0; i < SYMDYN_ENTRIES; i++) method.jacobian[i] = jacobian[i];
    if (symdyn_newton_matrix(&method, h, root)) return 1;
    symdyn_newton_solve(&method, root, x, y);
    return 0;
}
"""


def row_of_masses(n: int) -> tuple[Shape, np.ndarray, Band]:
    """Shape of ROW, entries of the derivative, and its band: one state depends on another, all depend on one."""
    shape = Shape({"q": n, "u": n, "z": 2, "inputs": 0}, 0, (), ())
    pattern = np.zeros((2 * n + 2, 2 * n + 2), dtype=bool)
    pattern[:n, n:2 * n] = np.eye(n)
    near = np.abs(np.subtract.outer(np.arange(n), np.arange(n))) < 2
    pattern[n:2 * n, :n] = pattern[n:2 * n, n:2 * n] = near
    pattern[n:2 * n, 2 * n] = True
    pattern[2 * n, [1, 2 * n]] = pattern[2 * n + 1, 0] = True
    band = Pattern(2 * n + 2, *np.nonzero(pattern), n).band
    assert (band.reduced, band.size) == (n, n + 1)
    return shape, pattern, band


@pytest.mark.parametrize(("method", "roots"), [("radau", FIVE_STAGES.roots), ("radau5", THREE_STAGES.roots)])
def test_equations_of_newton_are_solved(method: str, roots: Any, build: Build, tmp_path: Path) -> None:
    """mu - J with all entries and in a band, for every root, against LAPACK; entries of 1e6, and a matrix that is singular."""
    shape, pattern, band = row_of_masses(12)
    rng = np.random.default_rng(4)
    n = len(pattern)
    J = np.where(pattern, rng.normal(size=pattern.shape) * 10.0**rng.integers(0, 7, n)[:, None], 0.0)
    for given, entries in ((None, J.ravel()), (band, J[pattern])):
        functions = {"field": "out[0] = x[0];", "jacobian_x_at" if given is None else "jacobian_x_packed_at": "out[0] = 0.0;"}
        # clang-tidy sees these parts in test_a_row_of_masses_by_factors_in_a_band.
        library = build(integrator(method, shape, functions, tmp_path, NEWTON, band=given), analyzed=False)
        for root, h in itertools.product(range(len(roots)), (1e-3, -0.2)):
            right = rng.normal(size=n) + (1j * rng.normal(size=n) if root else 0)
            x, y, mu = right.real.copy(), right.imag.copy(), complex(*roots[root]) / h
            assert library.newton(pointer(entries.copy()), ctypes.c_double(h), root, pointer(x), pointer(y)) == 0
            wanted = np.linalg.solve(mu * np.eye(n) - J, right)
            assert np.abs(x + 1j * y - wanted).max() <= 1e-10 * np.abs(wanted).max()
        singular = np.where(np.eye(n) == 1, roots[0][0] / 1.0, 0.0) * (np.arange(n) == 2 * shape.sizes["q"])
        assert library.newton(pointer(singular.ravel() if given is None else singular[pattern]), ctypes.c_double(1.0), 0,
                              pointer(np.ones(n)), pointer(np.zeros(n))) == 1


@pytest.mark.parametrize("method", ["radau", "radau5"])
def test_a_row_of_masses_by_factors_in_a_band(method: str, build: Build, tmp_path: Path) -> None:
    """The same motion as with whole matrices, forwards and backwards, with fewer factorizations and less memory."""
    n = 12
    shape, pattern, band = row_of_masses(n)
    packed = (f"double whole[{(2 * n + 2)**2}];\nsymdyn_jacobian_x_at(problem, t, x, whole);\n"
              + "\n".join(f"out[{k}] = whole[{place}];" for k, place in enumerate(np.flatnonzero(pattern))))
    times, found = np.linspace(0, 0.5, 11), []
    for given, functions in ((None, ROW), (band, {**ROW, "jacobian_x_packed_at": packed})):
        library = build(integrator(method, shape, functions, tmp_path, band=given), analyzed=given is not None)
        run = Run(library, [1.0] * n + [0.0] * (n + 2), (0.0, 0.5), 1e-9)
        ahead = run.at(times)
        back = Run(library, [*ahead[1]], (1.0, 0.999), 1e-9).at(np.array([0.999]))
        found.append((ahead, back, run.report(), library.symdyn_simulation_size()))
    for one, other in zip(found[0][:2], found[1][:2], strict=True):  # in a run at rtol 1e-9
        assert (np.abs(one - other) <= 1e-8 * np.abs(found[0][0]).max(axis=0)).all()
    assert found[1][2].n_factorizations < 0.9 * found[0][2].n_factorizations and found[0][3] > 1.5 * found[1][3]


ONE_ROW = Corrections(1, 3, (False, False), (False, False))
CIRCLE = {
    "field": "const double v = x[2]*x[2] + x[3]*x[3]; out[0] = x[2]; out[1] = x[3]; out[2] = -v*x[0]; out[3] = -v*x[1];",
    "position_correction_at": "const double s = x[0]*x[0] + x[1]*x[1], c = 0.5*(s - 1.0); out[0] = c; out[1] = -c*x[0]/s; "
                              "out[2] = -c*x[1]/s;",
    "velocity_correction_at": "const double s = x[0]*x[0] + x[1]*x[1], c = x[0]*x[2] + x[1]*x[3]; "
                              "out[0] = c; out[1] = -c*x[0]/s; out[2] = -c*x[1]/s;",
    "violation_at": "out[0] = 0.5*(x[0]*x[0] + x[1]*x[1] - 1.0); out[1] = x[0]*x[2] + x[1]*x[3];"}


@pytest.mark.parametrize(("project", "least", "most"), [(True, 0.0, 1e-12), (False, 1e-9, 1.0)])
def test_projection_onto_a_circle(project: bool, least: float, most: float, build: Build, tmp_path: Path) -> None:
    shape = Shape({"q": 2, "u": 2, "z": 0, "inputs": 0}, 1, (), ())
    library = build(integrator("bs54", shape, CIRCLE, tmp_path, corrections=ONE_ROW))
    run = Run(library, [1.0, 0.0, 0.0, 1.0], (0.0, 50.0), 1e-5, project=project)
    x = run.at(np.linspace(0, 50, 101))
    off = np.abs((x[:, :2]**2).sum(axis=1) - 1).max()
    assert least <= off <= most
    assert (run.report().n_corrected > 0) == project


def test_a_unit_vector_keeps_its_length(build: Build, tmp_path: Path) -> None:
    field = {"field": "out[0] = -x[1] + 1e-3*x[0]; out[1] = x[0] + 1e-3*x[1]; out[2] = 0;"}
    shape = Shape({"q": 3, "u": 0, "z": 0, "inputs": 0}, 0, [[0, 1]], ())
    run = Run(build(integrator("dop853", shape, field, tmp_path)), [1.0, 0.0, 2.0], (0.0, 5.0), 1e-9, project=True)
    x = run.at(np.linspace(0, 5, 11))
    np.testing.assert_allclose((x[:, :2]**2).sum(axis=1), 1, rtol=0, atol=1e-15)
    assert (x[:, 2] == 2).all()


def test_zeros_of_a_cubic_and_a_reset(build: Build, tmp_path: Path) -> None:
    events = [EventRecord("a", 0, False, (), False, (), ()), EventRecord("b", 1, False, (1,), False, (), ())]
    functions = {"field": "out[0] = 1.0; out[1] = 1.0;",
                 "events_at": "out[0] = (x[0] - 0.3)*(x[0] - 0.50001)*(x[0] - 0.5); out[1] = x[1] - 0.75;",
                 "event_resets_at": "out[0] = -1.0;"}
    shape = Shape({"q": 1, "u": 1, "z": 0, "inputs": 0}, 0, (), events)
    library = build(integrator("dop853", shape, functions, tmp_path))
    run = Run(library, [0.0, 0.0], (0.0, 1.0), 1e-9, look=2)
    x = run.at(np.array([0.2, 1.0]))
    rows = run.events(2)
    assert rows[:, 0].tolist() == [0, 0, 0, 1]
    np.testing.assert_allclose(rows[:, 1], [0.3, 0.5, 0.50001, 0.75], rtol=0, atol=1e-12)
    np.testing.assert_allclose(rows[3, 2:], [0.75, 0.75, 0.75, -1.0], rtol=0, atol=1e-12)
    np.testing.assert_allclose(x, [[0.2, 0.2], [1.0, -0.75]], rtol=0, atol=1e-12)


def test_events_wait_until_they_are_taken(build: Build, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """With room for few of them the integrator stops again and again, and no zero of a sine is lost."""
    monkeypatch.setattr(thresholds, "WAITING", 2)
    shape = Shape({"q": 1, "u": 0, "z": 0, "inputs": 0}, 0, (), [EventRecord("a", 0, False, (), False, (), ())])
    text = integrator("dop853", shape, {"field": "out[0] = 1.0;", "events_at": "out[0] = sin(10.0*x[0]);"}, tmp_path)
    run = Run(build(text), [0.1], (0.1, 10.0), 1e-9, look=1)
    taken, status = [run.events(1)], STATUS.STORE_FULL
    while status == STATUS.STORE_FULL:
        status = run.go(np.array([10.0]))[0]
        taken.append(run.events(1))
    assert status == STATUS.DONE and max(map(len, taken)) <= thresholds.most_events(1) == 5 and len(taken) > 10
    np.testing.assert_allclose(np.concatenate(taken)[:, 1], np.arange(1, 32) * np.pi / 10, rtol=0, atol=1e-12)
    with pytest.raises(AssertionError, match="noted has no room"):
        build(text.replace("#define SYMDYN_NOTES 5", "#define SYMDYN_NOTES 4"))


ROOF = "double d[2] = {ud[0] - 0.5003, ud[1] - 0.5003}; const double far = fmax(fabs(d[0]), fabs(d[1])); " \
       "const double near = d[0] < 0.0 && d[1] > 0.0 ? 0.0 : fmin(fabs(d[0]), fabs(d[1])); " \
       "out[0] = fmax(1e-3 - far, -0.01); out[1] = fmax(1e-3 - near, -0.01);"
# On a side of the roof, between its kinks, rates and bends are those of the leaf, behind its top with the sign changed.
BENDS = ROOF + " const double s = d[0] > 0.0 ? -1.0 : 1.0; const int kinks = near == 0.0 || far > 0.011; " \
               "out[2] = kinks ? -1e9 : s > 0.0 ? ud[2] : -ud[3]; out[3] = kinks ? 1e9 : s > 0.0 ? ud[3] : -ud[2]; " \
               "out[4] = kinks ? -1e9 : s > 0.0 ? ud[4] : -ud[5]; out[5] = kinks ? 1e9 : s > 0.0 ? ud[5] : -ud[4];"


@pytest.mark.parametrize("bounded", [True, False])
def test_a_pulse_between_samples_is_found_by_bounds(bounded: bool, build: Build, tmp_path: Path) -> None:
    events = [EventRecord("a", 0, False, (), bounded, (), ())]
    functions = {"field": "out[0] = 1.0;", "events_at": "out[0] = fmax(1e-3 - fabs(x[0] - 0.5003), -0.01);"}
    functions |= {"event_ranges_of": ROOF, "event_bounds_of": BENDS} if bounded else {}
    shape = Shape({"q": 1, "u": 0, "z": 0, "inputs": 0}, 0, (), events, (1,) if bounded else ())
    run = Run(build(integrator("dop853", shape, functions, tmp_path)), [0.0], (0.0, 10.0), 1e-9, look=1)
    run.at(np.array([10.0]))
    rows = run.events(1)
    assert rows[:, 0].tolist() == ([0, 0] if bounded else [])
    np.testing.assert_allclose(rows[:, 1], [0.4993, 0.5013][:len(rows)], rtol=0, atol=1e-12)


def test_a_reset_on_a_circle_takes_the_other_speed_along(build: Build, tmp_path: Path) -> None:
    functions = CIRCLE | {"events_at": "out[0] = x[0] - 0.5;", "event_resets_at": "out[0] = -x[2];",
                          "reset_directions_at": "out[0] = out[1] = 0.0; out[2] = x[1]*x[1]; out[3] = -x[1]*x[0];"}
    shape = Shape({"q": 2, "u": 2, "z": 0, "inputs": 0}, 1, (), [EventRecord("a", -1, False, (2,), False, (), ())], (), True)
    library = build(integrator("dop853", shape, functions, tmp_path, corrections=ONE_ROW))
    run = Run(library, [1.0, 0.0, 0.0, 1.0], (0.0, 2 * np.pi / 3), 1e-11, project=True, look=1)
    x = run.at(np.array([2 * np.pi / 3]))
    rows, v = run.events(1), [-np.sqrt(0.75), 0.5]
    place = [0.5, np.sqrt(0.75)]
    np.testing.assert_allclose(rows, [[0, np.pi / 3, *place, *v, *place, -v[0], -v[1]]], rtol=0, atol=1e-8)
    np.testing.assert_allclose(x, [[1.0, 0.0, 0.0, -1.0]], rtol=0, atol=1e-8)


def test_an_input_by_pieces(build: Build, tmp_path: Path) -> None:
    text = ('#define SYMDYN_HAS_INPUTS 1\n#define SYMDYN_NIN 1\n#include "problem.h"\n'
            "int at(const symdyn_problem *p, double t, double *out);\n"
            "int at(const symdyn_problem *p, double t, double *out) { return symdyn_inputs_at(p, t, out, out); }\n")
    library = build(text)
    breaks, pieces = np.array([0.0, 1.0, 3.0]), np.array([[1.0, 2.0, 0.5, 0.25], [3.75, 0.0, 1.0, 0.0]])
    problem = Problem(n_pieces=2, breaks=breaks.ctypes.data, pieces=pieces.ctypes.data)

    def at(t: float) -> float:
        out = np.zeros(1)
        assert library.at(ctypes.byref(problem), ctypes.c_double(t), pointer(out)) == 0
        return float(out[0])

    assert [at(t) for t in (-1.0, 0.0, 0.5, 1.0, 2.0, 3.0, 9.0)] == [1.0, 1.0, 2.15625, 3.75, 4.75, 7.75, 7.75]


def test_sines_and_cosines(build: Build) -> None:
    library = build('#include "sincos.h"\nvoid at(int n, const double *a, double *s, double *c);\n'
                    'void at(int n, const double *a, double *s, double *c) { symdyn_sincos(n, a, s, c); }\n')
    angles = np.concatenate([np.linspace(-20, 20, 997), [0.0, 1e5, 1e9, np.pi, 1e-300]])
    sines, cosines = np.zeros(len(angles)), np.zeros(len(angles))
    library.at(len(angles), pointer(angles), pointer(sines), pointer(cosines))
    np.testing.assert_allclose(sines, np.sin(angles), rtol=0, atol=2.3e-16)
    np.testing.assert_allclose(cosines, np.cos(angles), rtol=0, atol=2.3e-16)


SOLVERS = """#define SYMDYN_LINKED
int symdyn_saddle(int n, int m, const double *in, double *x);
int symdyn_multipliers(int n, int m, const double *in, double *lam);
int symdyn_cube(int order, const double *in, double *out);
int symdyn_catenary(int seabed, const double *in, double *out);
#define SYMDYN_LOOSE 1e-14
#define SYMDYN_MASSLESS 1e-14
#define SYMDYN_SMOOTHED 1e-4
#define SYMDYN_ROUNDS 5
#define SYMDYN_CLEANINGS 1
#define SYMDYN_SADDLE_N 4
#define SYMDYN_SADDLE_M 3
#define SYMDYN_SADDLE_ONE_SIZE {one_size}
#define SYMDYN_MULTIPLIERS_N 4
#define SYMDYN_MULTIPLIERS_M 3
#define SYMDYN_MULTIPLIERS_ONE_SIZE {one_size}
#include "symdyn_saddle.h"
#include "symdyn_multipliers.h"
#include "symdyn_cube.h"
#include "symdyn_catenary.h"
"""


@pytest.mark.parametrize("one_size", [0, 1])
@pytest.mark.parametrize("dependent", [False, True])
def test_solvers(one_size: int, dependent: bool, build: Build) -> None:
    library = build(SOLVERS.format(one_size=one_size))
    rng = np.random.default_rng(1)
    root, C = rng.uniform(-1, 1, (4, 4)), rng.uniform(-1, 1, (3, 4))
    if dependent:
        C[2] = C[0] - 2 * C[1]
    M, f = root @ root.T + np.eye(4), rng.uniform(-1, 1, 4)
    d = C @ rng.uniform(-1, 1, 4)
    given = np.concatenate([[1e-4], M[np.tril_indices(4)], C.ravel(), np.ones(3), 1 / np.sqrt(np.diag(M)), f, d])
    x, lam = np.zeros(4), np.zeros(3)
    assert library.symdyn_saddle(4, 3, pointer(given), pointer(x)) == 0
    rank = 2 if dependent else 3
    whole = np.block([[M, C[:rank].T], [C[:rank], np.zeros((rank, rank))]])
    np.testing.assert_allclose(x, np.linalg.solve(whole, [*f, *d[:rank]])[:4], rtol=0, atol=1e-11)
    g = C.T @ rng.uniform(-1, 1, 3)
    given = np.concatenate([C.ravel(), np.ones(3), np.ones(4), g])
    assert library.symdyn_multipliers(4, 3, pointer(given), pointer(lam)) == 0
    np.testing.assert_allclose(lam, np.linalg.pinv(C.T) @ g, rtol=0, atol=1e-9)


def test_a_cube_and_a_line(build: Build) -> None:
    library = build(SOLVERS.format(one_size=0))
    out = np.zeros(4)
    for depth, volume in ((2.0, 1.0), (0.25, 0.75), (-2.0, 0.0)):
        assert library.symdyn_cube(0, pointer(np.array([depth, 0.0, 0.0, -1.0])), pointer(out)) == 0
        assert out[0] == volume
    stiff = np.array([0.8, 0.5, 1e-12, 0.0])
    assert library.symdyn_catenary(0, pointer(stiff), pointer(out)) == 0
    h, v = out[:2]  # Irvine: without stretch x = h (asinh(v/h) - asinh((v - 1)/h)), z = sqrt(h^2 + v^2) - sqrt(h^2 + (v - 1)^2)
    np.testing.assert_allclose([h * (np.arcsinh(v / h) - np.arcsinh((v - 1) / h)), np.hypot(h, v) - np.hypot(h, v - 1)],
                               stiff[:2], rtol=0, atol=1e-9)


LANES = """
#define SYMDYN_NP 1
#define SYMDYN_NC 0
static int symdyn_prologue(const double *p, double *c) { (void)c; return !(p[0] > 0.0); }
#include "vectors.h"
static symdyn_lanes symdyn_lanes_rhs(const symdyn_states *lanes, symdyn_vector t, const symdyn_vector *x, symdyn_vector *out) {
    symdyn_lanes fault = {0};
    (void)t;
    out[0] = x[1];
    out[1] = -lanes->p[0]*x[0];
    return fault;
}
static int symdyn_one(double t, const double *x, const double *inputs, const double *p, const double *c, double *out) {
    (void)t, (void)inputs, (void)c;
    out[0] = x[1];
    out[1] = -p[0]*x[0];
    return 0;
}
#include "batch_explicit.h"
"""


def test_oscillators_in_lanes(build: Build, tmp_path: Path) -> None:
    """Right-hand sides and motions of more oscillators than a vector has lanes, one of them with a negative stiffness."""
    shape = Shape({"q": 1, "u": 1, "z": 0, "inputs": 0}, 0, (), ())
    field = {"field": "out[0] = x[1]; out[1] = -problem->p[0]*x[0];"}
    library = build(integrator("dop853", shape, field, tmp_path, LANES))
    n = 11
    stiffness, x = np.linspace(1.0, 4.0, n), np.column_stack([np.ones(n), np.zeros(n)])
    stiffness[4] = -1.0
    zero = np.zeros(1)
    tables = (Table * 4)(Table(zero.ctypes.data, 0, 0), Table(x.ctypes.data, 2, 1), Table(zero.ctypes.data, 0, 0),
                         Table(stiffness.ctypes.data, 1, 0))
    out, codes = np.zeros((n, 2)), np.zeros(n, dtype=np.intc)
    library.symdyn_rhs_batch.restype = ctypes.c_long
    failed = library.symdyn_rhs_batch(ctypes.c_long(n), tables, pointer(out), pointer(np.array([2, 1])), pointer(codes))
    good = stiffness > 0
    assert failed == 1 and codes.tolist() == [int(not g) for g in good] and np.isnan(out[4]).all()
    assert (out[good] == np.column_stack([np.zeros(n), -stiffness])[good]).all()
    times, states = np.linspace(0, 3, 7), np.zeros((n, 7, 2))
    reports, both = np.zeros(n, dtype=np.dtype(RunReport)), np.zeros((n, 2, 2))
    span, atol = np.array([0.0, 3.0, 1e-11, 0.0, 0.0]), np.full(2, 1e-11)
    library.symdyn_batch_size.restype = library.symdyn_batch_go.restype = ctypes.c_long
    memory = ctypes.create_string_buffer(library.symdyn_batch_size() + 64)
    address = ctypes.c_void_p((ctypes.addressof(memory) + 63) // 64 * 64)
    arrays = {"span": span, "atol": atol, "t_out": times, "x_out": states, "states": both, "reports": reports}
    motions = BatchMotions(n=n, n_out=7, **dict(zip(("x", "inputs", "p"), map(ctypes.addressof, tables[1:]), strict=True)),
                           **{name: values.ctypes.data for name, values in arrays.items()})
    library.symdyn_batch_start(address, ctypes.byref(motions))
    assert library.symdyn_batch_go(address, ctypes.c_long(10_000)) == n
    w = np.sqrt(np.abs(stiffness))[:, None]
    np.testing.assert_allclose(states[good, :, 0], np.cos(w * times)[good], rtol=0, atol=1e-9)
    assert (reports["status"][good] == STATUS.DONE).all() and reports["status"][4] == STATUS.NO_CONSTANTS
