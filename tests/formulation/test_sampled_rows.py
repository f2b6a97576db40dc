"""Ranks of constraints by sparse factors: the same verdicts as by singular values."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import symdyn as sd
from symdyn.formulation.constraints import sampled
from symdyn.formulation.constraints.null_space import elimination_order
from symdyn.formulation.constraints.sampled import Sampled, minimum_degree
from symdyn.formulation.probes.definite import smallest_eigenvalue
from symdyn.formulation.probes.dependent_rows import search


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


@pytest.mark.parametrize("name", ["bricard", "four_bar", "spatial_slider_crank", "rolling_disc", "double_wishbone"])
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
    order = elimination_order(A, A != 0)
    assert order is not None and order[0] == (0, 0)
    assert sorted(row for row, _ in order) == [0, 1, 2] and len({column for _, column in order}) == 3


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


def test_the_smallest_eigenvalue_is_found_block_by_block() -> None:
    stream = np.random.default_rng(8)
    for sizes in ((1, 1, 1), (4,), (1, 3, 2, 1), (2, 2)):
        whole = np.zeros((sum(sizes), sum(sizes)))
        first = 0
        for n in sizes:
            A = stream.normal(size=(n, n))
            whole[first:first + n, first:first + n] = A + A.T
            first += n
        order = stream.permutation(len(whole))
        M = whole[np.ix_(order, order)]
        np.testing.assert_allclose(smallest_eigenvalue(M), np.linalg.eigvalsh(M)[0], rtol=1e-12)
