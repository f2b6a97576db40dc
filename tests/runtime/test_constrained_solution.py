"""Facts of a solution under constraints: multipliers, violations, rank, which multipliers are unique, reactions, files."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import numpy as np
import pytest

from symdyn.errors import ArgumentError
from tests.runtime.constrained import module


@pytest.mark.parametrize("backend", ["c", "numpy"])
def test_multiplier_is_the_force_in_the_rod(backend: str) -> None:
    """C = x^2 + y^2 - l^2: the rod pulls with 2 l lam = m (v^2 / l - g y / l)."""
    solution = module("pendulum_absolute", backend).simulate((0, 3), rtol=1e-11)
    _, y, vx, vy = solution.x.T
    np.testing.assert_allclose(2 * solution.lam[:, 0], vx**2 + vy**2 - 9.81 * y, rtol=0, atol=1e-9)
    assert solution.lam.shape == solution.constraint_violation.shape == solution.velocity_violation.shape == (1001, 1)
    assert (solution.rank == 1).all() and solution.rank.shape == (1001,) and solution.unique.all()


def test_multipliers_balance_the_motion() -> None:
    crank = module("spatial_slider_crank")
    solution = crank.simulate((0, 1), rtol=1e-9)
    for k in (0, 300, 1000):
        at = solution.t[k], solution.x[k]
        M, k_tilde, F, C_r = (crank.evaluate(n, *at) for n in ("mass_matrix", "k_tilde", "F_tilde", "C_r"))
        n_q, n_u = crank.metadata.sizes.q, crank.metadata.sizes.u
        ud = crank.rhs(*at)[n_q:n_q + n_u]
        scale = np.abs(F).max() + np.abs(C_r.T @ solution.lam[k]).max()
        np.testing.assert_allclose(M @ ud + k_tilde + C_r.T @ solution.lam[k], F, rtol=0, atol=1e-9 * scale)


def test_rank_and_unique_multipliers() -> None:
    bricard, four_bar = module("bricard"), module("four_bar")
    solution = bricard.simulate((0, 2), rtol=1e-8)
    n_c = len(bricard.metadata.constraints)
    assert n_c == 5 and (solution.rank == 4).all() and not solution.unique.all()
    q = solution.q[::100]
    np.testing.assert_array_equal(bricard.rank(q), solution.rank[::100])
    np.testing.assert_array_equal(bricard.unique(q), solution.unique[::100])
    assert bricard.rank(q[0]) == 4 and bricard.unique(q[0]).shape == (5,)
    assert four_bar.rank([0.0, 0.0, 0.0]) == 1  # stretched
    assert four_bar.unique(four_bar.consistent()[0]).all()
    # Multipliers that are not unique are the least ones: they have no part in the kernel of C_r^T.
    k = 500
    C_r, scale = (bricard.evaluate(name, solution.t[k], solution.x[k]) for name in ("C_r", "C_scale"))
    kernel = np.linalg.svd((C_r * scale[:, None]).T)[2][4:]
    lam = solution.lam[k] / scale
    assert np.abs(kernel @ lam).max() < 1e-6 * np.abs(lam).max()


def test_without_constraints() -> None:
    solution = module("pendulum").simulate((0, 1))
    assert solution.lam.shape == solution.constraint_violation.shape == solution.velocity_violation.shape == (1001, 0)
    assert solution.unique.shape == (1001, 0) and (solution.rank == 0).all() and solution.rank.shape == (1001,)
    assert solution.corrections.position == solution.corrections.speed == 0.0
    assert module("pendulum").rank([0.3]) == 0 and module("pendulum").unique([0.3]).shape == (0,)


def test_saved(tmp_path: Path) -> None:
    solution = module("four_bar").simulate((0, 1))
    kept = np.load(solution.save(tmp_path / "four_bar.npz"))
    for name in ("lam", "constraint_violation", "velocity_violation"):
        np.testing.assert_array_equal(kept[name], getattr(solution, name))
    assert json.loads(str(kept["about"]))["constraints"] == ["hinge4_x", "hinge4_y"]
    with solution.save(tmp_path / "four_bar.csv").open(encoding="utf-8") as file:
        titles, *rows = csv.reader(file)
    assert titles[:5] == ["t", "q1", "q2", "q3", "q1_dot"] and titles[-2:] == ["lam_hinge4_x", "lam_hinge4_y"]
    np.testing.assert_array_equal(np.array([row[-2:] for row in rows], dtype=float), solution.lam)


def test_multipliers_by_name() -> None:
    solution = module("four_bar").simulate((0, 1))
    np.testing.assert_array_equal(solution["lam"], solution.lam)
    for name in ("hinge4_y", "lam_hinge4_y"):
        np.testing.assert_array_equal(solution[name], solution.lam[:, 1])
    with pytest.raises(ArgumentError, match="the solution has no 'hinge4'; did you mean hinge4_"):
        solution["hinge4"]
    with pytest.raises(ArgumentError, match="the solution has no 'lam'"):
        module("pendulum").simulate((0, 0.1))["lam"]


def test_reactions() -> None:
    loop = module("four_bar")
    if "reactions" not in loop.functions:
        pytest.skip("these equations have no reactions")
    solution = loop.simulate((0, 1), rtol=1e-10)
    assert list(solution.reactions) == ["hinge1", "hinge2", "hinge3", "hinge4"]
    wanted = solution.reactions["hinge2"]
    assert wanted.shape == (1001, 6)
    np.testing.assert_array_equal(solution.reaction("hinge2"), wanted)
    for frame in ("parent", "child", "bar3"):
        turned = solution.reaction("hinge2", frame=frame)
        np.testing.assert_allclose(np.linalg.norm(turned[:, :3], axis=1), np.linalg.norm(wanted[:, :3], axis=1), rtol=1e-12)
    angle = solution["q1"]  # of bar1, the parent, in the n-frame
    along = wanted[:, 0] * np.cos(angle) + wanted[:, 1] * np.sin(angle)
    np.testing.assert_allclose(solution.reaction("hinge2", "parent")[:, 0], along, rtol=0, atol=1e-9 * np.abs(wanted).max())
    np.testing.assert_array_equal(solution.reaction("hinge2", "bar1"), solution.reaction("hinge2", "parent"))
    with pytest.raises(ArgumentError, match=r"no reaction of a joint .hinge. is known; did you mean hinge[1-4] or"):
        solution.reaction("hinge")
    with pytest.raises(ArgumentError, match="no frame 'bar7'; there are inertial, ground, parent, child, bar1"):
        solution.reaction("hinge1", "bar7")


def test_reactions_of_another_joint() -> None:
    solution = module("pendulum").simulate((0, 0.1))
    with pytest.raises(ArgumentError, match="no reaction of a joint 'nothing' is known"):
        solution.reaction("nothing")
