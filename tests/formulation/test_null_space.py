"""Saddle-point systems as statements: by the Schur complement, by dependent speeds, and where they hand over to the intrinsic."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import symdyn as sd
from symdyn.formulation.algebra import TapeAlgebra
from symdyn.formulation.constraints.consistent_states import ConstraintStates
from symdyn.formulation.constraints.null_space import NullSpaceSolver, elimination_order
from symdyn.formulation.constraints.saddle import IntrinsicSolver, RangeSolver, fewest_neighbours, narrow_order
from symdyn.formulation.constraints.sampled import Sampled
from symdyn.formulation.probes.dependent_rows import ranks, scaled
from symdyn.formulation.trees.mass_matrix import factorize
from symdyn.spatial.vectors import vector
from symdyn.tape.evaluate import evaluate
from symdyn.tape.floats import evaluate_rows
from symdyn.tape.node import COORDINATE, is_zero
from symdyn.tape.recorder import Recorder
from symdyn.tape.tape import Tape


def leaves(recorder: Recorder, name: str, values: np.ndarray, numbers: dict[str, float]) -> np.ndarray:
    """A matrix or vector of leaves with these values; zeros stay zeros by structure."""
    made = np.zeros(values.shape, dtype=object)
    for place in np.ndindex(values.shape):
        if values[place] != 0:
            label = name + "_".join(map(str, place))
            numbers[label] = float(values[place])
            made[place] = recorder.leaf(label, COORDINATE)
    return made


def problem(n: int, m: int, seed: int, singular: bool = False, sparse: float = 0.3) -> tuple[np.ndarray, ...]:
    """M, C, f, d with C of full rank and M definite where C leaves motion."""
    stream = np.random.default_rng(seed)
    root = stream.normal(size=(n, n))
    M = root @ root.T + n * np.eye(n)
    if singular:
        M[0, :] = M[:, 0] = 0
    C = stream.normal(size=(m, n)) * (stream.uniform(size=(m, n)) > sparse)
    C[np.arange(m), np.arange(m)] = 2 + stream.uniform(size=m)
    return M, C, stream.normal(size=n), stream.normal(size=m)


@pytest.mark.parametrize("n, m, singular", [(3, 2, False), (4, 1, False), (6, 4, False), (6, 5, True), (5, 5, False),
                                            (7, 3, True)])
def test_statements_solve_the_saddle_point_system(n: int, m: int, singular: bool) -> None:
    M, C, f, d = problem(n, m, n + 10 * m, singular)
    wanted = np.linalg.solve(np.block([[M, C.T], [C, np.zeros((m, m))]]), np.concatenate([f, d]))
    recorder, numbers = Recorder(), {}
    algebra = TapeAlgebra(recorder, {})
    Ms, Cs, fs, ds = (leaves(recorder, name, a, numbers) for name, a in (("M", M), ("C", C), ("f", f), ("d", d)))
    names, speeds = [f"row{k}" for k in range(m)], [f"u{k}" for k in range(n)]
    order = elimination_order(Sampled.of(C[None]))
    assert order is not None
    solvers = [NullSpaceSolver(algebra, Ms, Cs, order, names, speeds)]
    if not singular:
        solvers.append(RangeSolver(algebra, factorize(algebra, Ms, speeds), Cs, names))
    for solver in solvers:
        x, lam = solver.solve(fs, ds)
        found = evaluate(Tape.of(recorder, both=vector(*x, *lam)), numbers)["both"].astype(float)
        np.testing.assert_allclose(found, wanted, rtol=1e-12, atol=1e-13)


def test_right_sides_that_are_zero_cost_nothing() -> None:
    M, C, f, d = problem(4, 2, 3)
    recorder, numbers = Recorder(), {}
    Ms, Cs, fs = (leaves(recorder, name, a, numbers) for name, a in (("M", M), ("C", C), ("f", f)))
    order = elimination_order(Sampled.of(C[None]))
    solver = NullSpaceSolver(TapeAlgebra(recorder, {}), Ms, Cs, order or [], ["a", "b"], list("wxyz"))
    with_d = Tape.of(recorder, x=solver.solve(fs, leaves(recorder, "d", d, numbers))[0]).operations
    without = Tape.of(recorder, x=solver.solve(fs, np.zeros(2, dtype=object))[0]).operations
    assert without < with_d


def test_no_pivots_where_a_row_is_zero_or_depends() -> None:
    C = np.array([[1.0, 2.0, 0.0], [2.0, 4.0, 0.0]])
    assert elimination_order(Sampled.of(C[None])) is None
    assert elimination_order(Sampled(1, 3, np.zeros(3, dtype=int), np.arange(3), np.zeros((1, 3)))) is None


def test_elimination_fills_in_little() -> None:
    """Chained rows: each shares a column with the next; in their own order nothing fills in."""
    m = 8
    C = np.zeros((m, m + 1))
    for k in range(m):
        C[k, k:k + 2] = 1, 0.9
    order = elimination_order(Sampled.of(C[None]))
    assert order is not None
    recorder, numbers = Recorder(), {}
    solver = NullSpaceSolver(TapeAlgebra(recorder, {}), leaves(recorder, "M", np.eye(m + 1), numbers),
                             leaves(recorder, "C", C, numbers), order, [f"r{k}" for k in range(m)],
                             [f"u{k}" for k in range(m + 1)])
    filled = sum(not is_zero(e) for e in solver.LU.ravel())
    assert filled == np.count_nonzero(C[:, solver.d])
    assert sorted(fewest_neighbours((C @ C.T) != 0)) == list(range(m))


def test_generated_code_hands_over_where_the_dependent_speeds_lose_their_rows() -> None:
    """Four-bar with links 1 and 3 such that the eliminated columns are dependent: the intrinsic gives the same as 30 digits."""
    system = sd.systems.four_bar()
    eq = system.augmented()
    module = eq.compile(backend="numpy")
    dependent = [note for note in eq.notes if "elimination of the dependent speeds q1_dot, q3_dot" in note]
    assert dependent, eq.notes
    q1 = 0.3
    x = np.array([q1, 0.7, -0.7, 0.2, -0.1, 0.4])  # the loop point on the line through both hinges: columns 1 and 3 parallel
    C = module.evaluate("C_r", 0.0, x)
    x[2] = x[2] + _angle_that_aligns(module, x)
    C = module.evaluate("C_r", 0.0, x)
    assert abs(np.linalg.det(C[:, [0, 2]])) < 1e-9
    M, bias = module.evaluate("mass_matrix", 0.0, x), module.evaluate("k_tilde", 0.0, x) - module.evaluate("F_tilde", 0.0, x)
    K = np.block([[M, C.T], [C, np.zeros((2, 2))]])
    wanted = np.linalg.solve(K, np.concatenate([-bias, module.evaluate("F_d", 0.0, x)]))
    np.testing.assert_allclose(module.rhs(0.0, x)[3:], wanted[:3], rtol=1e-9)
    np.testing.assert_allclose(module.evaluate("lam", 0.0, x), wanted[3:], rtol=1e-9)


def _angle_that_aligns(module: Any, x: np.ndarray) -> float:
    """Change of q3 at which the determinant of the eliminated columns vanishes."""
    from scipy.optimize import brentq

    def determinant(angle: float) -> float:
        y = x.copy()
        y[2] += angle
        return float(np.linalg.det(module.evaluate("C_r", 0.0, y)[:, [0, 2]]))

    grid = np.linspace(-3, 3, 61)
    values = [determinant(a) for a in grid]
    k = next(k for k in range(60) if values[k] * values[k + 1] < 0)
    return float(brentq(determinant, grid[k], grid[k + 1], xtol=1e-15))


def test_rows_that_are_kept_stay_far_from_losing_rank() -> None:
    """Bricard: of its five rows one is redundant; the four that are kept are regular all along its motion."""
    eq = sd.systems.bricard().augmented()
    assert eq.singular_fallback is not None
    found = ranks(eq.singular_fallback)
    assert found is not None and found.rank == 4 and len(found.independent) == 4
    module = eq.compile(backend="numpy")
    motion = module.simulate(t=np.linspace(0, 10, 21), rtol=1e-8)
    samples = scaled(ConstraintStates(eq.singular_fallback, eq.symbols.defaults), motion.q).dense()
    kept = np.linalg.svd(samples[:, list(found.independent)], compute_uv=False)[:, -1]
    assert (kept / np.linalg.svd(samples, compute_uv=False)[:, 3]).min() > 0.3


def test_units_do_not_decide_what_is_a_pivot() -> None:
    """Speeds in other units have longer columns: with their factors the statements hold as before."""
    M, C, f, d = problem(6, 3, 5)
    stretch = np.array([1, 1, 1, 1e4, 1e4, 1e4])  # dependent speeds are the first three
    order, names, speeds = [(0, 0), (1, 1), (2, 2)], ["a", "b", "c"], list("uvwxyz")
    wanted = np.linalg.solve(np.block([[M, (C * stretch).T], [C * stretch, np.zeros((3, 3))]]), np.concatenate([f, d]))
    found = []
    for columns in ((), list(1 / stretch)):
        recorder, numbers = Recorder(), {}
        Ms, Cs, fs, ds = (leaves(recorder, name, a, numbers) for name, a in (("M", M), ("C", C * stretch), ("f", f), ("d", d)))
        solver = NullSpaceSolver(TapeAlgebra(recorder, {}), Ms, Cs, order, names, speeds, columns=columns)
        x, lam = solver.solve(fs, ds)
        found.append(evaluate(Tape.of(recorder, x=vector(*x, *lam)), numbers)["x"].astype(float))
    assert np.isnan(found[0]).all()
    assert np.abs(found[1] - wanted).max() < 1e-10 * np.abs(wanted).max()


def test_the_numeric_algorithm_takes_long_chains_in_a_narrow_order() -> None:
    """A chain whose links are numbered at random: every row of M + C^T C begins next to its diagonal; and the results are
    those of a direct solution."""
    n = 40
    shuffled = np.random.default_rng(5).permutation(n)
    C, M = np.zeros((n - 10, n)), np.diag(np.linspace(1, 2, n))
    for k in range(n - 10):
        C[k, shuffled[k:k + 3]] = 1.0, -2.0 - k / n, 0.5
    M[shuffled[:-1], shuffled[1:]] = M[shuffled[1:], shuffled[:-1]] = 0.3
    recorder, numbers = Recorder(), {}
    Ms, Cs = (leaves(recorder, name, a, numbers) for name, a in (("M", M), ("C", C)))
    f, d = np.sin(np.arange(n)), np.cos(np.arange(n - 10))
    solver = IntrinsicSolver(TapeAlgebra(recorder, {}), Ms, Cs, vector(*[1] * len(C)), [1] * n, "loose")
    near = ((M != 0) | (C.T @ C != 0))[np.ix_(solver.order, solver.order)]
    assert sorted(solver.order) == list(range(n))
    assert max(k - np.flatnonzero(row)[0] for k, row in enumerate(near)) <= 3 < max(
        k - np.flatnonzero(row)[0] for k, row in enumerate((M != 0) | (C.T @ C != 0)))
    found = evaluate_rows(Tape.of(recorder, x=solver.solve(vector(*f), vector(*d))[0]), numbers, 1)["x"][0]
    wanted = np.linalg.solve(np.block([[M, C.T], [C, np.zeros((len(C),) * 2)]]), np.concatenate([f, d]))[:n]
    np.testing.assert_allclose(found, wanted, atol=1e-9 * np.abs(wanted).max())


def test_few_speeds_stay_in_their_order() -> None:
    assert narrow_order(np.eye(4), np.array([[1.0, 0, 0, 1]])) == [0, 1, 2, 3]
