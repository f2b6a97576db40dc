"""Lemke's method, and the modes of contacts by it against the enumeration of all modes."""

from itertools import product

import numpy as np
import pytest

from symdyn.runtime import contact_laws
from symdyn.runtime.complementarity import lemke
from symdyn.runtime.contact_laws import OPEN, SLIDING, STICKING, Site, Solved, impact, solutions
from tests.helpers import swept


def enumerated(M: np.ndarray, q: np.ndarray) -> list[np.ndarray]:
    """All solutions z of a complementarity problem whose principal minors do not vanish."""
    found = []
    for inside in product((False, True), repeat=len(q)):
        k = np.array(inside)
        z = np.zeros(len(q))
        if k.any():
            z[k] = np.linalg.solve(M[np.ix_(k, k)], -q[k])
        w = M @ z + q
        if (z[k] >= 0).all() and (w[~k] >= 0).all():
            found.append(z)
    return found


@pytest.mark.parametrize("n", [1, 2, 3, 5, 7])
def test_problems_with_one_solution_are_solved(n: int) -> None:
    """A matrix whose symmetric part is positive definite leaves exactly one solution."""
    stream = np.random.default_rng(n)
    for _ in range(25):
        A, B = stream.normal(size=(2, n, n))
        M, q = A @ A.T + 0.1 * np.eye(n) + B - B.T, stream.normal(size=n)
        expected = enumerated(M, q)
        assert len(expected) == 1
        found = lemke(M, q)
        assert found is not None
        assert found.z == pytest.approx(expected[0], rel=1e-9, abs=1e-10)
        assert found.w == pytest.approx(M @ found.z + q, abs=1e-9)
        assert not found.degenerate


def test_what_is_found_in_any_problem_is_a_solution_and_rays_have_none_where_matrices_are_copositive() -> None:
    stream = np.random.default_rng(5)
    rays = 0
    for _ in range(150):
        M, q = stream.normal(size=(4, 4)), stream.normal(size=4)
        found, expected = lemke(M, q), enumerated(M, q)
        if found is not None:
            assert min(np.abs(found.z - z).max() for z in expected) < 1e-8
        A = stream.normal(size=(4, 2))  # plus and minus: positive semidefinite, so that a ray means that there is no solution
        lifted = lemke(A @ A.T, q)
        rays += lifted is None
        if lifted is not None:
            w = A @ (A.T @ lifted.z) + q
            assert min(lifted.z.min(), w.min()) > -1e-8
            assert np.abs(lifted.z * w).max() <= 1e-9 * np.abs(lifted.z).max() * (1 + np.abs(w).max())
        else:  # of M = A A^T: no z >= 0 has M z + q >= 0
            from scipy.optimize import linprog

            assert linprog(np.zeros(4), A_ub=-A @ A.T, b_ub=q).status == 2
    assert rays > 20


def test_degenerate_problems_end_and_are_reported() -> None:
    """Ties would let pivots go round; lexicographic order ends them."""
    M = np.array([[1.0, 2.0, 0.0], [0.0, 1.0, 2.0], [2.0, 0.0, 1.0]])
    found = lemke(M, -np.ones(3))
    assert found is not None and found.z == pytest.approx([1 / 3] * 3)
    vanishing = lemke(np.eye(3), np.array([-1.0, 0.0, 2.0]))
    assert vanishing is not None and vanishing.degenerate == (1,)
    many = lemke(np.ones((6, 6)), -np.ones(6))  # redundant: any z with the sum 1
    assert many is not None and many.z.sum() == pytest.approx(1.0)
    assert lemke(np.array([[-1.0]]), np.array([-1.0])) is None


def problem(stream: np.random.Generator, n: int, tangents: int, n_u: int) -> tuple[np.ndarray, np.ndarray, list[Site]]:
    """Contacts of a body or some, those that slip and those that do not."""
    rows = 1 + tangents
    J = stream.normal(size=(n * rows, n_u))
    sites = []
    for k in range(n):
        mu = stream.uniform(0, 0.6)
        slip = stream.normal(size=tangents)
        sites.append(Site(tuple(range(k * rows, k * rows + rows)), mu, mu * stream.choice([1.0, 0.8]),
                          slip / np.linalg.norm(slip) if stream.random() < 0.3 else None))
    return J @ J.T, J @ stream.normal(size=n_u), sites


def fulfils(D: np.ndarray, b: np.ndarray, sites: list[Site], one: Solved) -> None:
    assert one.w == pytest.approx(b + D @ one.lam, abs=1e-7 * max(1.0, np.abs(b).max()))
    for site, mode in zip(sites, one.modes, strict=True):
        normal, tangents = site.rows[0], list(site.rows[1:])
        force, speed = one.lam[tangents], one.w[tangents]
        assert one.lam[normal] >= -1e-8 and one.w[normal] >= -1e-8
        assert abs(one.lam[normal] * one.w[normal]) < 1e-7
        assert np.linalg.norm(force) <= site.static * one.lam[normal] + 1e-7
        if mode.kind == SLIDING:
            slip = speed / max(np.linalg.norm(speed), 1e-300) if site.slip is None else site.slip
            if site.slip is not None or np.linalg.norm(speed) > 1e-6:
                assert force == pytest.approx(-site.kinetic * one.lam[normal] * slip, abs=1e-6)
        elif mode.kind == STICKING:
            assert np.abs(speed).max() < 1e-7
        else:
            assert mode.kind == OPEN and np.abs(force).max() == 0


@pytest.mark.parametrize("n", [1, 2, *swept([3])])
def test_lemke_finds_what_the_enumeration_finds_in_a_plane(n: int, monkeypatch: pytest.MonkeyPatch) -> None:
    stream, missed = np.random.default_rng(10 + n), 0
    for _ in range(60):
        D, b, sites = problem(stream, n, 1, 6)
        expected = solutions(D, b, sites)  # all modes
        found = contact_laws._by_lemke(D, b, sites)
        assert expected or not found
        for one in found:
            fulfils(D, b, sites, one)
            assert min(np.abs(one.w - other.w).max() for other in expected) < 1e-7
        missed += bool(expected) and not found
        with monkeypatch.context() as patched:  # as with many contacts
            patched.setattr(contact_laws, "MOST_COMBINATIONS", 0)
            assert bool(solutions(D, b, sites)) == bool(expected)
    assert missed <= 3  # friction of contacts that slip leaves matrices that are not copositive


def test_two_legs_in_space_hold_what_their_cones_can() -> None:
    """A body of mass and inertia 1 on legs at x = 1 and x = -1, pushed by nearly its weight times mu, a height above them: loads
    follow from the moment about y, forces along y are alike since nothing turns about z, and those along x are what is left of
    the cones."""
    mu, height, points = 0.5, 0.1, ((1.0, 0.0, -0.1), (-1.0, 0.0, -0.1))
    J = np.array([np.concatenate([e, np.cross(point, e)]) for point in points for e in np.eye(3)[[2, 0, 1]]])
    sites = [Site((0, 1, 2), mu, mu), Site((3, 4, 5), mu, mu)]
    for angle, part in product(np.linspace(0, 2 * np.pi, 25)[:-1], (0.93, 0.995)):
        push = part * mu * np.array([np.cos(angle), np.sin(angle)])
        loads = 0.5 + height * push[0] / 2 * np.array([1, -1])
        assert np.sqrt((mu * loads)**2 - (push[1] / 2)**2).sum() > abs(push[0])
        found = solutions(J @ J.T, J @ [*push, -1, 0, 0, 0], sites)
        assert found and [mode.kind for mode in found[0].modes] == [STICKING, STICKING], angle
        fulfils(J @ J.T, J @ [*push, -1, 0, 0, 0], sites, found[0])
        assert found[0].lam[[0, 3]] == pytest.approx(loads, rel=1e-9)


def test_what_static_friction_holds_does_not_begin_to_slide() -> None:
    """Between the bounds of kinetic and of static friction a contact sticks, and so does a joint with dry friction."""
    contact, joint = Site((0, 1), 0.5, 0.3), Site((0,), 2.0, 1.0, bounded=True)
    for load, expected in ((0.4, STICKING), (0.6, SLIDING)):
        found = solutions(np.eye(2), np.array([-1.0, load]), [contact])
        assert [one.modes[0].kind for one in found] == [expected]
        assert found[0].lam[1] == pytest.approx(-0.4 if expected == STICKING else -0.3)
    for load, expected, force in ((-1.5, STICKING, 1.5), (-2.5, SLIDING, 1.0)):
        for most in (contact_laws.MOST_COMBINATIONS, 0):
            with pytest.MonkeyPatch.context() as patched:
                patched.setattr(contact_laws, "MOST_COMBINATIONS", most)
                found = solutions(np.eye(1), np.array([load]), [joint])
            assert [one.modes[0].kind for one in found] == [expected]
            assert found[0].lam == pytest.approx([force])


@pytest.mark.parametrize("n", [1, 2, 4])
def test_contacts_in_space_fulfil_the_round_cone(n: int) -> None:
    stream = np.random.default_rng(20 + n)
    for _ in range(15):
        D, b, sites = problem(stream, n, 2, 12)
        found = solutions(D, b, sites)
        assert found
        for one in found:
            fulfils(D, b, sites, one)


@pytest.mark.parametrize(("tangents", "n"), swept([(1, 30), (1, 15), (2, 12)], (1, 15), (2, 12)))
def test_many_redundant_contacts_are_solved(tangents: int, n: int) -> None:
    """A pile: contacts of bodies with twelve degrees of freedom at rest under a force that presses them down."""
    stream = np.random.default_rng(3)
    rows, n_u = 1 + tangents, 12
    J = stream.normal(size=(n * rows, n_u))
    b = -J @ (J[::rows].sum(axis=0))
    sites = [Site(tuple(range(k * rows, k * rows + rows)), 0.4, 0.4) for k in range(n)]
    found = solutions(J @ J.T, b, sites)
    assert found
    fulfils(J @ J.T, b, sites, found[0])


def test_contacts_on_the_border_of_two_modes_are_named() -> None:
    """A block on a slope as steep as its friction holds, and a contact that is not pressed."""
    D = np.diag([1.0, 1.0])
    for load, mu, expected in (([-1.0, -0.5], 0.5, [0]), ([-1.0, -0.4], 0.5, []), ([0.0, 0.0], 0.5, [0]), ([-1.0, 0.0], 0.0, [])):
        sites = [Site((0, 1), mu, mu)]
        found = solutions(D, np.array(load), sites)
        assert contact_laws.degenerate(D, np.array(load), sites, found[0]) == expected
    changes = [Site((0, 1), 0.5, 0.5, excluded=(STICKING,))]
    slides = solutions(D, np.array([-1.0, -0.5]), changes)[0]
    assert contact_laws.degenerate(D, np.array([-1.0, -0.5]), changes, slides) == []


def test_painleves_rod_has_none_or_two_for_lemke_too() -> None:
    """A ray of a matrix that is not copositive is reached where there is no solution, and both of two are found."""
    D = np.array([[1.0, -1.5], [-1.5, 3.0]])
    slides = [Site((0, 1), 1.0, 1.0, slip=np.array([-1.0]))]
    assert not contact_laws._by_lemke(D, np.array([-1.0, 0.0]), slides)
    kinds = {one.modes[0].kind for one in contact_laws._by_lemke(D, np.array([1.0, 0.0]), slides)}
    assert kinds <= {one.modes[0].kind for one in solutions(D, np.array([1.0, 0.0]), slides)} == {OPEN, SLIDING}


@pytest.mark.parametrize("law", ["newton", "poisson"])
def test_impacts_of_many_contacts_at_once_lose_energy_in_a_plane_without_friction(law: str) -> None:
    stream = np.random.default_rng(8)
    J = stream.normal(size=(12, 9))
    D, v = J @ J.T, J @ stream.normal(size=9)
    found = impact(D, v, [0.5] * 12, [Site((k,), 0.0, 0.0) for k in range(12)], law)
    assert found
    one = found[0]
    assert one.lam.min() >= -1e-9 and (v + one.w) @ one.lam <= 1e-9
    assert one.w == pytest.approx(v + D @ one.lam, abs=1e-8)


def test_single_contacts_are_solved_as_the_tables_of_combinations_solve_them(monkeypatch: pytest.MonkeyPatch) -> None:
    stream = np.random.default_rng(3)
    problems = []
    for _ in range(300):
        n, bounded = int(stream.integers(1, 3)), bool(stream.integers(2))
        n = 1 if bounded else n
        A = stream.normal(size=(n, n))
        slip = stream.choice([-1.0, 1.0], 1) if (n > 1 or bounded) and stream.integers(2) else None
        kinetic = float(stream.uniform(0, 3))
        least = 0.0 if bounded or (n == 2 and slip is None) else float(stream.choice([0.0, 0.5]))
        site = Site(tuple(range(n)), kinetic + float(stream.choice([0, 0.3])), kinetic, slip, least, bounded=bounded)
        problems.append((A @ A.T + 0.1 * np.eye(n), stream.normal(size=n), [site]))
    quick = [solutions(*problem) for problem in problems]
    monkeypatch.setattr(contact_laws, "_is_simple", lambda sites: False)
    for own, problem in zip(quick, problems, strict=True):
        expected = solutions(*problem)
        assert [[m.kind for m in one.modes] for one in own] == [[m.kind for m in one.modes] for one in expected]
        for one, other in zip(own, expected, strict=True):
            np.testing.assert_allclose(one.lam, other.lam, rtol=0, atol=1e-12 * (1 + np.abs(other.lam).max()))
            np.testing.assert_allclose(one.w, other.w, rtol=0, atol=1e-12 * (1 + np.abs(other.w).max()))
    assert {len(own) for own in quick} >= {0, 1, 2}
