"""Chapter 1: the errors that were found, what the slides give once they are corrected, and motions by independent routes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import sympy as sp
from compared import compared, formula, verdicts
from scipy.integrate import solve_ivp

import symdyn as sd
from symdyn.comparison import Verdict
from symdyn.lecture import (
    chapter_1_ball,
    chapter_1_circular,
    chapter_1_coriolis,
    chapter_1_decomposition,
    chapter_1_disk,
    chapter_1_newton,
    chapter_1_rotating_frame,
)

MODULES = (chapter_1_newton, chapter_1_circular, chapter_1_coriolis, chapter_1_decomposition, chapter_1_rotating_frame,
           chapter_1_disk, chapter_1_ball)
CASES = {case.name: case for module in MODULES for case in module.CASES}


def test_errors_that_were_found() -> None:
    found = {f.slide.line for case in CASES.values() for f, _ in compared(case.name).errata}
    assert found == {398, 521, 758, 1123, 1557, 1563, 1974, 1978}


def mended() -> dict:
    """The printed formulas with the one wrong thing put right, typed again."""
    f = chapter_1_rotating_frame.turning()
    R, w, alpha, crossed = f.R, f.omega, f.alpha, chapter_1_rotating_frame.crossed
    m, g, a, r, omega, v = sp.symbols("m_P g a r_AB omega v", positive=True)
    angle = omega * sd.t
    return {
        ("bus-strap", "tension and inertial force, in words"): sp.Matrix([0, 0, m * g]),
        ("elevator-scale", "acceleration of O, rising"): sp.Matrix([0, 0, a]),
        ("earth-constant-spin", "centrifugal force, outwards"): sp.Symbol("m") * r * omega**2,
        ("rotating-frame-acceleration", "a, differentiated"):
            sd.rate(R) * f.v_b + R * f.a_b + crossed(alpha, R) * f.r_b + crossed(w, sd.rate(R)) * f.r_b + crossed(w, R) * f.v_b
            + f.a_O,
        ("rotating-frame-acceleration", "a, rate of R put in"):
            crossed(w, R) * f.v_b + R * f.a_b + crossed(alpha, R) * f.r_b + w.cross(crossed(w, R) * f.r_b)
            + crossed(w, R) * f.v_b + f.a_O,
        ("ball-in-slot", "position of A described by B, in words"): sp.Matrix([v * sd.t, 0, 0]),
        ("ball-in-slot", "position of A described by E, in words"):
            sp.Matrix([v * sd.t * sp.cos(angle), v * sd.t * sp.sin(angle), 0]),
    }


@pytest.mark.parametrize("place", mended(), ids=lambda place: ": ".join(place))
def test_corrected_slides_are_equal(place: tuple[str, str]) -> None:
    changed = replace(formula(*place), printed=mended()[place], errata=())
    assert set(verdicts(changed)) == {Verdict.EQUAL}


def test_size_of_the_acceleration_corrected() -> None:
    s = sd.coordinates("s")
    R, beta = sp.symbols("R beta", positive=True)
    changed = replace(formula("tangential-normal", "size of the acceleration"), errata=(),
                      printed=sp.sqrt(s.ddot**2 + (s.dot**2 * sp.cos(beta)**2 / R)**2))
    assert set(verdicts(changed)) == {Verdict.EQUAL}


@pytest.mark.parametrize("case", [
    "rotating-frame-acceleration", "vector-components", "coordinate-transformation", "disk-coriolis"])
def test_conventions_are_needed(case: str) -> None:
    """A convention is declared only where the slide as it stands says something else."""
    declared = [f for f in CASES[case].taken() if f.conventions]
    assert declared
    for f in declared:
        assert Verdict.DIFFERENT in verdicts(replace(f, conventions=()))


def test_coriolis_without_its_factor_is_noticed() -> None:
    f = formula("earth-frame", "Coriolis force")
    assert Verdict.DIFFERENT in verdicts(replace(f, printed=f.printed / 2))


@pytest.mark.parametrize(("case", "name"), [
    ("bus-box", "Newton's law, box"), ("bus-strap", "Newton's law"), ("bus-strap", "Newton's law, seen in the bus"),
    ("elevator-scale", "Newton's law, falling"), ("elevator-scale", "Newton's law on the scale"),
    ("earth-frame", "Newton's law in the n-frame")])
def test_other_sign_of_a_force_is_noticed(case: str, name: str) -> None:
    f = formula(case, name)
    left, right = f.printed
    assert Verdict.DIFFERENT in verdicts(replace(f, printed=(left, -right)))


def test_weight_is_that_of_a_system_with_gravity() -> None:
    assert chapter_1_newton.gravity() == chapter_1_newton.WEIGHT


def test_strap_hangs_along_its_tension() -> None:
    """The angle of the strap: from the tension of the case, and from the equilibrium of a pendulum in the bus."""
    a, g, m, l = sp.symbols("a g m_P l", positive=True)
    phi = sd.coordinates("phi")
    T = formula("bus-strap", "T").printed
    down = sp.Matrix([0, sp.sin(phi), -sp.cos(phi)])
    pendulum = sd.embedding([phi], [0, a * sd.t**2 / 2 + l * down[1], l * down[2]], [m, m, m], force=[0, 0, -m * g])
    along = {phi: sp.atan2(-T[1], T[2]), phi.dot: 0}
    rest = (pendulum.F_tilde - pendulum.k_tilde).subs(along)
    assert sp.simplify(rest[0]) == 0
    assert sp.simplify(T.cross(down.subs(along))) == sp.zeros(3, 1)


def test_thrown_ball_obeys_the_inertial_forces() -> None:
    """Seen from the disk, the ball flies as centrifugal and Coriolis force alone would have it."""
    v, omega, duration = 2.0, 0.7, 3.0
    n = sd.Frame("n")
    b = n.frame("b", rotation=sd.rotation.about("Z", omega * sd.t))
    x, y = sd.coordinates("x y")
    A = b.point("A", [x, y, 0])
    force = A.inertial_forces(1, frame=b).total[:2]
    acceleration = sp.lambdify([x, y, x.dot, y.dot], force)
    run = solve_ivp(lambda _, state: [*state[2:], *acceleration(*state)], (0, duration), [0, 0, v, 0], rtol=1e-11, atol=1e-11)
    seen = n.point("A", [v * sd.t, 0, 0]).position(of=b).subs(sd.t, duration)
    assert np.allclose(run.y[:2, -1], np.array(seen[:2], dtype=float), rtol=0, atol=1e-8)
