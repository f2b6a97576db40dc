"""Factors of a mass matrix: the entries that are zero by structure take no steps, and the others solve the equations."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np
import pytest

from symdyn.formulation.trees.mass_matrix import factorize


class Plain:
    """Numbers in place of a tape: what is recorded is the value itself, and how many values get a name is counted."""

    def __init__(self) -> None:
        self.named = 0

    def name(self, name: str, value: Any) -> Any:
        self.named += 1
        return value

    def positive(self, pivot: Any, reason: str) -> Any:
        return pivot


def blocks(n: int) -> np.ndarray:
    """The mass matrix of n bodies that do not act on each other, three speeds each."""
    M = np.full((3 * n, 3 * n), Fraction(0), dtype=object)
    for k in range(n):
        M[3 * k:3 * k + 3, 3 * k:3 * k + 3] = [[Fraction(4), Fraction(1), 0], [Fraction(1), Fraction(3), 1], [0, 1, Fraction(2)]]
    return M


@pytest.mark.parametrize("n", [1, 5, 20])
def test_bodies_that_do_not_act_on_each_other_take_steps_in_proportion_to_their_number(n: int) -> None:
    plain, M = Plain(), blocks(n)
    factors = factorize(plain, M, [""] * len(M))
    assert plain.named == 8 * n  # per body three pivots, their inverses, two entries of L
    assert sum(map(len, factors.filled)) == 2 * n
    right = np.array([Fraction(k % 5 - 2) for k in range(len(M))], dtype=object)
    assert (M @ factors.solve(right) == right).all()


def test_what_fills_in_is_found() -> None:
    """A body that all others hang on couples them only with itself, from the last row to the first."""
    n = 5
    M = np.diag([Fraction(9)] * n).astype(object)
    M[-1, :] = M[:, -1] = Fraction(1)
    M[-1, -1] = Fraction(9)
    factors = factorize(Plain(), M, [""] * n)
    assert factors.filled == [list(range(k)) for k in range(n)]
    right = np.array([Fraction(k) for k in range(n)], dtype=object)
    assert (M @ factors.solve(right) == right).all()
