"""Ranks of constraints by sparse factors: the same verdicts as by singular values."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from scipy.sparse import csr_matrix

import symdyn as sd
from symdyn.formulation.constraints import sampled
from symdyn.formulation.constraints.null_space import elimination_order, least_operations
from symdyn.formulation.constraints.sampled import Sampled, minimum_degree
from symdyn.formulation.probes.contradictions import _combinations
from symdyn.formulation.probes.definite import definite, definite_along
from symdyn.formulation.probes.dependent_rows import search
from tests.helpers import swept


@pytest.fixture
def sparse(monkeypatch: pytest.MonkeyPatch) -> None:
    """Sparse factors of matrices of any size and fill."""
    monkeypatch.setattr(sampled, "LEAST_PLACES", 0)
    monkeypatch.setattr(sampled, "LARGEST_PART", 1)


def matrices(m: int, n: int, dependent: int, seed: int) -> np.ndarray:
    """(3, m + dependent, n): at every state, some rows are combinations of two others; few entries."""
    stream = np.random.default_rng(seed)
    there = stream.uniform(size=(m, n)) < 3 / n
    there[range(m), stream.permutation(n)[:m]] = True
    A = there * stream.normal(size=(3, m, n))
    pairs = stream.integers(0, m, (dependent, 2))
    factors = stream.uniform(0.5, 2, (2, 3, dependent, 1))
    return np.concatenate([A, factors[0] * A[:, pairs[:, 0]] - factors[1] * A[:, pairs[:, 1]]], axis=1)


@pytest.mark.parametrize("m, n, dependent", [(6, 9, 0), (12, 20, 2), (25, 25, 0), (30, 44, 9), (5, 5, 5)])
def test_ranks_and_vanishing_combinations_are_those_of_singular_values(sparse: None, m: int, n: int, dependent: int) -> None:
    A = matrices(m, n, dependent, 7 * m + n)
    found, sizes = Sampled.of(A), np.linalg.svd(A, compute_uv=False)
    wanted = (sizes > 1e-8 * sizes[:, :1]).sum(axis=1)
    assert found.sparse and found.ranks().tolist() == wanted.tolist() and len(set(wanted)) == 1
    vanishing = found.vanishing(int(wanted[0]))
    for N, matrix in zip(vanishing, A, strict=True):
        left = np.linalg.svd(matrix)[0][:, wanted[0]:]
        np.testing.assert_allclose(N @ N.T, left @ left.T, atol=1e-11)
    if not dependent:
        np.testing.assert_allclose(found.smallest(), sizes[:, -1], rtol=0.1)


def test_least_changes_are_those_of_the_pseudoinverse(sparse: None) -> None:
    A = matrices(20, 31, 4, 3)
    wanted = np.random.default_rng(1).normal(size=(3, 31))
    right = (A @ wanted[..., None])[..., 0]
    y = Sampled.of(A).least_change(right, 1e-10)
    np.testing.assert_allclose(y, (np.linalg.pinv(A) @ right[..., None])[..., 0], atol=1e-8)


def test_ranks_that_the_diagonal_of_r_does_not_show(sparse: None) -> None:
    """Kahan's matrix: the smallest entry of its diagonal is 1e-4, its smallest singular value 1e-12 of the largest."""
    n, s, c = 40, 0.8, 0.6
    A = (s ** np.arange(n)[:, None] * (np.eye(n) - c * np.triu(np.ones((n, n)), 1))).T[None]
    sizes = np.linalg.svd(A[0], compute_uv=False)
    assert sizes[-1] < 1e-8 * sizes[0] and np.abs(np.diagonal(A[0])).min() > 1e-4
    found = Sampled.of(A)
    assert found.triangular().kept.all() and found.ranks().tolist() == [(sizes > 1e-8 * sizes[0]).sum()]


def test_zeros_everywhere(sparse: None) -> None:
    found = Sampled.of(np.zeros((2, 3, 4)))
    assert found.ranks().tolist() == [0, 0] and found.least_change(np.ones((2, 3)), 1e-10).tolist() == [[0] * 4] * 2


@pytest.mark.parametrize("name", swept(
    ["bricard", "four_bar", "spatial_slider_crank", "rolling_disc", "double_wishbone"], "four_bar", "double_wishbone"))
def test_verdicts_of_mechanisms_are_the_same(name: str, request: pytest.FixtureRequest) -> None:
    """Rank, rows that imply the others, rows that hold nothing."""
    equations: Any = sd.systems.get(name).augmented().singular_fallback
    usual = search(equations)
    request.getfixturevalue("sparse")
    found = search(equations)
    assert usual is not None and found is not None
    assert (found.rank, found.independent, found.vanishing) == (usual.rank, usual.independent, usual.vanishing)


def test_minimum_degree_of_a_grid_fills_in_less_than_row_by_row() -> None:
    k = 12
    near: list[set[int]] = [set() for _ in range(k * k)]
    for i, j in np.ndindex(k, k):
        for a, b in ((i + 1, j), (i, j + 1)):
            if a < k and b < k:
                near[i * k + j].add(a * k + b)
                near[a * k + b].add(i * k + j)

    def filled(order: list[int]) -> int:
        left, count = [set(row) for row in near], 0
        for p in order:
            count += len(left[p])
            for i in left[p]:
                left[i] = (left[i] | left[p]) - {i, p}
        return count

    order = minimum_degree(near)
    assert sorted(order) == list(range(k * k)) and filled(order) < 0.7 * filled(list(range(k * k)))


def test_pivots_follow_markowitz() -> None:
    """The pivot is an admitted entry of least (r - 1) (c - 1), the largest of these, whatever stands at indices that are used
    up."""
    A = np.array([[2.0, 1.0, 0.0, 0.0], [1.0, 5.0, 1.0, 1.0], [0.0, 1.0, 0.1, 3.0]])
    order = elimination_order(Sampled.of(A[None]))
    assert order is not None and order[0] == (0, 0)
    assert sorted(row for row, _ in order) == [0, 1, 2] and len({column for _, column in order}) == 3


def test_the_least_operations_of_an_elimination() -> None:
    """Counted with full matrices of truths, entry by entry."""
    stream = np.random.default_rng(4)
    for m, n in ((1, 1), (3, 5), (8, 12), (10, 10)):
        A = np.eye(m, n) + (stream.uniform(size=(m, n)) < 0.2)
        mass = np.eye(n) + (stream.uniform(size=(n, n)) < 0.1)
        mass = mass + mass.T
        pivots = [(k, k) for k in stream.permutation(m).tolist()]
        rows = [k for k, _ in pivots]
        free = list(range(m, n))
        left, right = A[np.ix_(rows, rows)] > 0, A[np.ix_(rows, free)] > 0
        for k in range(m):  # elimination as of numbers, where nothing cancels
            for i in range(k + 1, m):
                left[i, k:] |= left[i, k] & left[k, k:]
                right[i] |= left[i, k] & right[k]
        for k in range(m - 1, -1, -1):
            right[:k] |= left[:k, k, None] & right[k]
        Z = np.zeros((n, len(free)), dtype=int)
        Z[rows], Z[free, range(len(free))] = right, 1
        MZ = (mass @ Z > 0).astype(int)
        products = Z[rows].T @ MZ[rows]
        wanted = sum(max(2 * products[a, b] - 1, 0) for a in range(len(free)) for b in range(a + 1))
        near = Z.T @ MZ > 0
        for k in range(len(free) - 1, -1, -1):
            others = [a for a in range(k) if near[k, a]]
            near[np.ix_(others, others)] = True
            wanted += len(others) * (len(others) + 1) // 2
        assert least_operations(Sampled.of(A[None]), Sampled.of(mass[None]), pivots) == wanted


def test_contradictions_are_found_where_independence_is_looked_at_by_sparse_factors(sparse: None) -> None:
    """Rods of two lengths between the same points; without the second one nothing is wrong."""
    for lengths, wrong in (((1, 2), True), ((1,), False)):
        system = sd.System("rods", planar=True)
        x, y = sd.coordinates("x y")
        slide = system.add_body("slide", mass=0)
        system.add_joint(sd.Prismatic("along", system.ground, slide, x, axis=[1, 0]))
        body = system.add_body("particle", mass=1, inertia=0)
        system.add_joint(sd.Prismatic("across", slide, body, y, axis=[0, 1]))
        for k, length in enumerate(lengths):
            system.close_loop(sd.Rod(f"rod{k}", system.ground, body, length))
        system.initial = {x: 1, y: 0}
        if wrong:
            with pytest.raises(sd.ModelError, match="rod1 contradicts rod0: together they demand"):
                system.augmented()
        else:
            assert len(system.augmented().constraints) == 1


@pytest.mark.parametrize("m, n, dependent", [(6, 9, 0), (12, 20, 2), (30, 44, 9), (5, 5, 5), (1, 3, 0)])
def test_combinations_of_rows_by_sparse_factors_are_those_of_rows_one_by_one(request: pytest.FixtureRequest, m: int, n: int,
                                                                            dependent: int) -> None:
    """The same at all states; of rows that are combinations at each state, with other factors, none is found."""
    A = matrices(m, n, dependent, m + n)
    stream = np.random.default_rng(m)
    pairs, factors = stream.integers(0, m, (dependent, 2)), stream.uniform(0.5, 2, (2, dependent, 1))
    constant = factors[0] * A[:, pairs[:, 0]] - factors[1] * A[:, pairs[:, 1]]
    A = np.concatenate([A, constant], axis=1)[:, stream.permutation(m + 2 * dependent)]
    usual = list(_combinations(Sampled.of(A)))
    request.getfixturevalue("sparse")
    found = list(_combinations(Sampled.of(A)))
    assert len(usual) == dependent and [k for k, _ in found] == [k for k, _ in usual]
    for (k, few), (_, many) in zip(found, usual, strict=True):
        assert [j for j, _ in few] == [j for j, _ in many]
        np.testing.assert_allclose([f for _, f in few], [f for _, f in many], rtol=1e-8)
        np.testing.assert_allclose(sum(f * A[:, j] for j, f in few), A[:, k], atol=1e-9)


@pytest.mark.parametrize("seed", range(40))
def test_definite_matrices_are_those_without_smaller_eigenvalues(seed: int) -> None:
    stream = np.random.default_rng(seed)
    n = int(stream.integers(1, 25))
    A = stream.normal(size=(n, n)) * (stream.uniform(size=(n, n)) < stream.choice([0.1, 0.3, 1.0]))
    for M in (A @ A.T, A + A.T, A + A.T + np.diag(stream.uniform(0, 6, n))):
        least = np.linalg.eigvalsh(M)[0]
        assert definite(csr_matrix(M), least - 1e-6) and not definite(csr_matrix(M), least + 1e-6)


def test_definite_matrices_have_a_diagonal() -> None:
    """Pivots next to the diagonal, and none at all."""
    assert not definite(csr_matrix([[0.0, 1.0], [1.0, 0.0]]), 0.0) and not definite(csr_matrix((3, 3)), 0.0)


def test_mass_is_looked_for_where_constraints_leave_motion() -> None:
    """Two speeds without mass: a constraint holds one of them, or both, or their sum, or none."""
    M = csr_matrix(np.diag([2.0, 0.0, 0.0]))
    for rows, wanted in (([[0, 1, 0]], False), ([[0, 1, 0], [0, 1, 3]], True), ([[0, 1, 1]], False), ([[1, 0, 0]], False)):
        assert definite_along(M, csr_matrix(np.array(rows, dtype=float)), 1e-9) is wanted
    assert definite_along(csr_matrix(np.eye(3)), csr_matrix((0, 3)), 1e-9) and not definite_along(M, csr_matrix((0, 3)), 1e-9)
    assert not definite_along(M, csr_matrix((2, 3)), 1e-9)
