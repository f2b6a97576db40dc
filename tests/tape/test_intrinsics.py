"""The numeric algorithms for M x + C^T lam = f, C x = d: on the tape, at high precision and in generated code."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import mpmath
import numpy as np
import pytest

from symdyn.backend.right_side import RightSide
from symdyn.backend.source import Content, render
from symdyn.errors import EvaluationError
from symdyn.runtime.building.compiler import find_compiler
from symdyn.runtime.building.library import CLibrary, PythonLibrary
from symdyn.tape import Recorder, Tape
from symdyn.tape.differentiate import forward
from symdyn.tape.evaluate import evaluate
from symdyn.tape.floats import evaluate_rows
from symdyn.tape.intrinsics import SMOOTHED, Intrinsic, Multipliers, Saddle
from symdyn.tape.node import INPUT, PARAMETER
from symdyn.tape.passes import specialize


@dataclass
class Problem:
    """M (n, n), C (m, n) and the scales of its rows and columns; f, d, with d in the range of C."""

    M: np.ndarray
    C: np.ndarray
    rows: np.ndarray
    columns: np.ndarray
    f: np.ndarray
    d: np.ndarray

    @property
    def sizes(self) -> tuple[int, int]:
        return self.C.shape[1], len(self.C)

    @property
    def for_saddle(self) -> np.ndarray:
        triangle = self.M[np.tril_indices(len(self.M))]
        return np.concatenate([[SMOOTHED], triangle, self.C.ravel(), self.rows, self.columns, self.f, self.d])

    def for_multipliers(self, x: np.ndarray) -> np.ndarray:
        return np.concatenate([self.C.ravel(), self.rows, self.columns, self.f - self.M @ x])

    def solution(self) -> tuple[np.ndarray, np.ndarray]:
        """x, and lam of least norm after scaling, with 40 digits."""
        with mpmath.workdps(40):
            n = len(self.M)
            rank = np.linalg.matrix_rank(self.rows[:, None] * self.C * self.columns, tol=1e-9)
            kept = _independent(self.C, rank)
            A = mpmath.zeros(n + rank)
            for i in range(n):
                for j in range(n):
                    A[i, j] = self.M[i, j]
                for place, k in enumerate(kept):
                    A[i, n + place] = A[n + place, i] = self.C[k, i]
            right = mpmath.matrix([*self.f, *self.d[kept]])
            found = np.array([float(v) for v in mpmath.lu_solve(A, right)])
        x, force = found[:n], self.C[kept].T @ found[n:]
        scaled = self.rows[:, None] * self.C * self.columns
        return x, self.rows * (np.linalg.pinv(scaled.T, rcond=1e-9) @ (self.columns * force))


def _independent(C: np.ndarray, rank: int) -> list[int]:
    kept: list[int] = []
    for k in range(len(C)):
        if np.linalg.matrix_rank(C[[*kept, k]] / np.linalg.norm(C[[*kept, k]], axis=1)[:, None], tol=1e-9) == len(kept) + 1:
            kept.append(k)
    assert len(kept) == rank
    return kept


def problem(n: int, m: int, seed: int = 0, massless: int = 0, extra: int = 0, spread: float = 1.0,
            turned: float = 1.0) -> Problem:
    """Random; massless: speeds without mass, which the constraints hold; extra: rows that are sums of others; spread: of the
    masses; turned: unit of the last speeds."""
    rng = np.random.default_rng(seed)
    L = rng.normal(size=(n, n)) * (np.arange(n)[:, None] >= massless)
    L = L * np.sqrt(np.geomspace(1, spread, n))[:, None]
    C = np.round(rng.normal(size=(m, n)) * 2**10) / 2**10  # so that sums of rows are exact
    columns = np.where(np.arange(n) >= n - n // 3, turned, 1.0)
    C = C / columns
    M = (L @ L.T) / columns[:, None] / columns
    C = np.vstack([C, rng.choice([-2.0, -1.0, 0.5, 1.0], (extra, m)) @ C])
    rows = rng.uniform(0.5, 2, m + extra)
    x = np.round(rng.normal(size=n) * 2**10) / 2**10 * columns
    return Problem(M, C, rows, columns, rng.normal(size=n) * np.abs(M).max(axis=1) + C[0] * 3, C @ x)


PROBLEMS: dict[str, tuple[Problem, float]] = {
    "plain": (problem(5, 2), 1e-12),
    "one": (problem(1, 1), 1e-12),
    "one row": (problem(4, 1, seed=9), 1e-12),
    "as many rows as speeds": (problem(4, 4, seed=1), 1e-12),
    "singular mass": (problem(6, 3, seed=2, massless=2), 1e-11),
    "no mass held": (problem(4, 4, seed=3, massless=4), 1e-11),
    "dependent rows": (problem(6, 3, seed=4, extra=2), 1e-11),
    "dependent rows, singular mass": (problem(7, 3, seed=5, massless=2, extra=3), 1e-11),
    "angles in other units": (problem(6, 2, seed=6, turned=1e3), 1e-11),
    "light and heavy": (problem(5, 2, seed=7, spread=1e8), 1e-10),
    "heavy and light": (problem(5, 2, seed=8, spread=1e-8), 1e-10),
    "many": (problem(20, 12, seed=10, extra=4), 1e-10),
}


def taped(intrinsic: Intrinsic, n_values: int, kind: int = INPUT) -> tuple[Tape, list[str]]:
    """A tape that calls an intrinsic with leaves."""
    recorder = Recorder()
    names = [f"v{k}" for k in range(n_values)]
    leaves = [recorder.leaf(name, kind) for name in names]
    return Tape.of(recorder, solve=np.array(recorder.call(intrinsic, leaves), dtype=object)), names


def unit_of(tape: Tape, names: list[str], backend: str, kind: int = INPUT) -> Any:
    groups: dict[str, list[str]] = {group: [] for group in ("q", "u", "z", "ud", "inputs", "p")}
    groups["inputs" if kind == INPUT else "p"] = names
    content = Content("intrinsics", "test", {"solve": tape}, {"solve": "solve"}, groups, {}, {}, {})
    source = render(content, backend, standalone=False, right_side=RightSide(integrated=False))
    text = next(iter(source.files.values()))
    if backend == "numpy":
        return PythonLibrary.from_source(text, "intrinsics")
    compiler = find_compiler()
    if compiler is None:
        pytest.skip("no C compiler here")
    return CLibrary(text, source.metadata, compiler)


def on_tape(intrinsic: Intrinsic, values: np.ndarray) -> np.ndarray:
    tape, names = taped(intrinsic, len(values))
    return evaluate_rows(tape, dict(zip(names, values.tolist(), strict=True)), 1)["solve"][0]


def precisely(intrinsic: Intrinsic, values: np.ndarray) -> np.ndarray:
    tape, names = taped(intrinsic, len(values))
    found = evaluate(tape, dict(zip(names, map(mpmath.mpf, values.tolist()), strict=True)), 50)["solve"]
    return np.array([float(v) for v in found])


def generated(backend: str) -> Callable[[Intrinsic, np.ndarray], np.ndarray]:
    def solve(intrinsic: Intrinsic, values: np.ndarray) -> np.ndarray:
        evaluator = unit_of(*taped(intrinsic, len(values)), backend).evaluator("solve")
        evaluator.set_params(np.zeros(0))
        many = evaluator.many(np.zeros(1), np.zeros((1, 0)), np.array([values, values]), np.zeros((1, 0)))
        one = np.array(evaluator.one(0.0, np.zeros(0), values))
        np.testing.assert_allclose(many, [one, one], rtol=1e-6, atol=1e-12 * np.abs(one).max())
        return one
    return solve


ROUTES: dict[str, Callable[[Intrinsic, np.ndarray], np.ndarray]] = {
    "rows": on_tape, "precise": precisely, "numpy": generated("numpy"), "c": generated("c")}


def close(found: np.ndarray, wanted: np.ndarray, tolerance: float) -> bool:
    return bool(np.abs(found - wanted).max(initial=0) <= tolerance * np.abs(wanted).max(initial=0))


IN_C = ("plain", "no mass held", "dependent rows, singular mass", "heavy and light")  # each takes a compilation


@pytest.mark.parametrize(("name", "route"), [(n, r) for n in PROBLEMS for r in ROUTES if r != "c" or n in IN_C])
def test_solutions(name: str, route: str) -> None:
    given, tolerance = PROBLEMS[name]
    x, lam = given.solution()
    found = ROUTES[route](Saddle(given.sizes, "held by nothing"), given.for_saddle)
    assert close(found / given.columns, x / given.columns, tolerance)
    multipliers = ROUTES[route](Multipliers(given.sizes, "held by nothing"), given.for_multipliers(x))
    force = given.columns * (given.C.T @ lam)
    assert close(given.columns * (given.C.T @ multipliers), force, tolerance)
    assert close(multipliers / given.rows, lam / given.rows, max(tolerance, 1e-9))


@pytest.mark.parametrize("route", ["rows", "numpy", "c"])
def test_masses_far_apart_in_every_unit(route: str) -> None:
    """The solution scales with the masses; so does the algorithm."""
    given, _ = PROBLEMS["dependent rows"]
    x, _ = given.solution()
    for factor in (1e-12, 1e-6, 1e6, 1e12):
        scaled = Problem(given.M * factor, given.C, given.rows, given.columns, given.f * factor, given.d)
        assert close(ROUTES[route](Saddle(given.sizes, ""), scaled.for_saddle), x, 1e-10)


@pytest.mark.parametrize("route", ["rows", "numpy", "c"])
def test_a_row_that_all_but_depends_on_another(route: str) -> None:
    """Down to a singular value of 1e-3 the solution is that of the equations."""
    given = problem(5, 3, seed=12)
    for gap in (1e-1, 1e-2, 1e-3):
        C = given.C.copy()
        C[2] = C[0] + gap * C[2]
        near = Problem(given.M, C, given.rows, given.columns, given.f, C @ np.linalg.lstsq(given.C, given.d, rcond=None)[0])
        x, _ = near.solution()
        assert close(ROUTES[route](Saddle(near.sizes, ""), near.for_saddle), x, 1e-8)


# -- what nothing holds


def unheld() -> Problem:
    given = problem(4, 1, seed=13, massless=2)
    given.C[0, :2] = 0
    return given


@pytest.mark.parametrize("backend", ["numpy", "c"])
def test_a_speed_that_nothing_holds_is_reported(backend: str) -> None:
    given = unheld()
    evaluator = unit_of(*taped(Saddle(given.sizes, "nothing holds a speed"), len(given.for_saddle)), backend).evaluator("solve")
    evaluator.set_params(np.zeros(0))
    with pytest.raises(EvaluationError, match="nothing holds a speed"):
        evaluator.one(0.0, np.zeros(0), given.for_saddle)
    with pytest.raises(EvaluationError, match="nothing holds a speed"):
        evaluator.many(np.zeros(1), np.zeros((1, 0)), np.array([given.for_saddle] * 2), np.zeros((1, 0)))


def test_rows_of_numbers_are_nan_where_nothing_holds() -> None:
    given, good = unheld(), problem(4, 1, seed=9)
    tape, names = taped(Saddle(given.sizes, ""), len(given.for_saddle))
    both = dict(zip(names, np.array([given.for_saddle, good.for_saddle]).T, strict=True))
    found = evaluate_rows(tape, both, 2)["solve"]
    assert np.isnan(found[0]).all() and close(found[1], good.solution()[0], 1e-11)


def test_what_nothing_holds_is_singular_with_many_digits() -> None:
    given = unheld()
    with pytest.raises(ZeroDivisionError, match="singular"):
        precisely(Saddle(given.sizes, ""), given.for_saddle)


def test_bound_numbers_that_hold_nothing_are_reported() -> None:
    given = unheld()
    tape, names = taped(Saddle(given.sizes, "nothing holds a speed"), len(given.for_saddle), PARAMETER)
    with pytest.raises(EvaluationError, match="with the numbers that are bound: nothing holds a speed"):
        specialize(tape, dict(zip(names, given.for_saddle.tolist(), strict=True)))


def singular(seed: int) -> Problem:
    """Four speeds, a direction of which, aligned with none of them, moves no mass and no constraint."""
    rng = np.random.default_rng(seed)
    free = rng.normal(size=4)
    others = np.linalg.svd(free[None, :])[2][1:]
    L = others.T @ rng.normal(size=(3, 3)) * 10.0 ** rng.uniform(-2, 2)
    C = rng.normal(size=(2, 3)) @ others
    return Problem(L @ L.T, C, rng.uniform(0.5, 2, 2), np.ones(4), rng.normal(size=4), rng.normal(size=2))


def test_singular_numbers_are_rejected_alike_when_folded_and_in_generated_code() -> None:
    """60 random ones, and 60 regular ones, which all routes solve."""
    groups = ([singular(seed) for seed in range(60)], True), ([problem(4, 2, seed=seed) for seed in range(60)], False)
    for cases, rejected in groups:
        values = np.array([case.for_saddle for case in cases])
        intrinsic = Saddle(cases[0].sizes, "nothing holds a speed")
        found = []
        for row in values:
            try:
                found.append([float(v) for v in Recorder().call(intrinsic, row.tolist())])
            except ZeroDivisionError as error:
                assert str(error) == "nothing holds a speed"
                found.append([np.nan] * 4)
        assert (np.isnan(found).all(axis=1) == rejected).all()
        for backend in ["numpy", *(["c"] if find_compiler() else [])]:
            evaluator = unit_of(*taped(intrinsic, values.shape[1]), backend).evaluator("solve")
            evaluator.set_params(np.zeros(0))
            for row, one in zip(values, found, strict=True):
                if rejected:
                    with pytest.raises(EvaluationError, match="nothing holds a speed"):
                        evaluator.one(0.0, np.zeros(0), row)
                else:
                    assert close(np.array(evaluator.one(0.0, np.zeros(0), row)), np.array(one), 1e-9)


# -- folding and parameters


def test_calls_with_numbers_are_folded() -> None:
    given, _ = PROBLEMS["plain"]
    tape, names = taped(Saddle(given.sizes, ""), len(given.for_saddle), PARAMETER)
    folded = specialize(tape, dict(zip(names, given.for_saddle.tolist(), strict=True)))
    assert not folded.steps
    assert close(np.array([float(e) for e in folded.outputs["solve"].entries]), given.solution()[0], 1e-12)
    some = specialize(tape, dict(zip(names[:-1], given.for_saddle.tolist(), strict=False)))
    assert [leaf.args[1] for leaf in some.inputs] == names[-1:]


def test_calls_with_roots_of_numbers_are_folded() -> None:
    """sqrt(2) is no number on the tape, but a step without inputs."""
    recorder = Recorder()
    given, _ = PROBLEMS["plain"]
    root = recorder.sqrt(2)
    values = [*given.for_saddle[:-1].tolist(), root]
    found = recorder.call(Saddle(given.sizes, ""), values)
    assert not any(hasattr(v, "op") for v in found)
    wanted = on_tape(Saddle(given.sizes, ""), np.array([*given.for_saddle[:-1], np.sqrt(2)]))
    assert close(np.array([float(v) for v in found]), wanted, 1e-13)


@pytest.mark.parametrize("backend", ["numpy", "c"])
def test_calls_with_parameters_run_in_the_prologue(backend: str) -> None:
    given, _ = PROBLEMS["singular mass"]
    tape, names = taped(Saddle(given.sizes, "nothing holds a speed"), len(given.for_saddle), PARAMETER)
    unit = unit_of(tape, names, backend, PARAMETER)
    evaluator = unit.evaluator("solve")
    evaluator.set_params(given.for_saddle)
    assert close(np.array(evaluator.one(0.0, np.zeros(0))), given.solution()[0], 1e-10)
    assert unit.metadata.operations["solve"] == 0


# -- derivatives


@pytest.mark.parametrize("name", ["plain", "singular mass", "as many rows as speeds", "light and heavy"])
def test_derivatives(name: str) -> None:
    """Derivatives of x and lam by all values at once, along a random direction, against central differences with 40 digits."""
    given, _ = PROBLEMS[name]
    rng = np.random.default_rng(3)
    x, _ = given.solution()
    for intrinsic, values in ((Saddle(given.sizes, ""), given.for_saddle),
                              (Multipliers(given.sizes, ""), given.for_multipliers(x))):
        tape, names = taped(intrinsic, len(values))
        along = rng.normal(size=len(values)) * np.abs(values)
        n, m = given.sizes
        scales = 1 + n * (n + 1) // 2 + m * n if isinstance(intrinsic, Saddle) else m * n
        along[scales:scales + m + n] = 0  # no part of the result
        if isinstance(intrinsic, Saddle):
            along[0] = 0
        else:  # stays in the range of C^T
            C_dot = along[:m * n].reshape(m, n)
            lam = on_tape(intrinsic, values)
            along[-n:] = C_dot.T @ lam + given.C.T @ rng.normal(size=m)
        leaves = {tape.recorder.leaf(name, INPUT): float(v) for name, v in zip(names, along, strict=True) if v}
        derivative = forward(tape.recorder, tape.outputs["solve"].entries, leaves)
        rates = Tape.of(tape.recorder, solve=np.array(derivative, dtype=object))
        found = evaluate_rows(rates, dict(zip(names, values.tolist(), strict=True)), 1)["solve"][0]
        h = 1e-15
        with mpmath.workdps(60):
            ahead, back = (evaluate(tape, {name: mpmath.mpf(v) + sign * h * mpmath.mpf(a) for name, v, a in zip(
                names, values.tolist(), along.tolist(), strict=True)}, 60)["solve"] for sign in (1, -1))
            wanted = np.array([float((a - b) / (2 * h)) for a, b in zip(ahead, back, strict=True)])
        assert close(found, wanted, 1e-7), intrinsic.name


@pytest.mark.parametrize("name", ["plain", "dependent rows, singular mass"])
def test_sizes_and_operations(name: str) -> None:
    given, _ = PROBLEMS[name]
    n, m = given.sizes
    saddle, multipliers = Saddle((n, m), ""), Multipliers((n, m), "")
    assert (saddle.n_out, multipliers.n_out) == (n, m)
    tape, _ = taped(saddle, len(given.for_saddle))
    assert tape.count() == {"intrinsic": saddle.operations} and tape.operations > n**3 // 3
