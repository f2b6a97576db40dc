"""Periodic motions by shooting against published digits and closed forms, and their multipliers."""

from __future__ import annotations

import warnings
from functools import cache
from typing import Any

import mpmath as mp
import numpy as np
import pytest
import sympy as sp

import symdyn as sd
from symdyn.errors import ArgumentError, NoEquilibrium, SimulationWarning
from symdyn.runtime.building.compiler import find_compiler
from symdyn.statics import branches
from tests.helpers import swept

pytestmark = pytest.mark.skipif(find_compiler() is None, reason="no C compiler here")


@cache
def oscillator() -> Any:
    """Van der Pol's equation q'' - mu (1 - q^2) q' + k q = a cos w t."""
    q = sd.coordinates("q")
    m, mu, k = sd.parameters("m mu k", positive=True)
    system = sd.System("van_der_pol")
    body = system.add_body("body", mass=m)
    joint = system.add_joint(sd.Prismatic("slide", system.ground, body, axis=[1, 0], coordinate=q))
    system.add_joint_force(joint, mu * (1 - q**2) * q.dot - k * q, name="force")
    system.defaults = {m: 1, mu: 1, k: 1}
    return system.embedding().compile()


def test_van_der_pol_against_published_digits() -> None:
    """The period for mu = 1 is 6.6632868593231 (Andersen and Geer 1982); for mu = 1 the other multiplier 0.000859695."""
    orbit = oscillator().periodic(6.0, [2.0], [0.0], rtol=1e-13)
    assert orbit.period == pytest.approx(6.6632868593231, abs=2e-12)
    assert orbit.multipliers[0] == pytest.approx(1, abs=1e-9) and orbit.stable
    # The logarithm of the product is the integral of the divergence mu (1 - q^2) over a period.
    run = orbit.simulate(2001)
    divergence = np.trapezoid(1 - run.q[:, 0] ** 2, run.t) if hasattr(np, "trapezoid") else np.trapz(1 - run.q[:, 0] ** 2, run.t)
    assert np.log(np.prod(orbit.multipliers).real) == pytest.approx(divergence, rel=1e-6)
    assert repr(orbit) == "<PeriodicMotion of van_der_pol: period 6.66328686 s, multipliers of size 1, 0.0008597>"
    assert run.x[-1] == pytest.approx(run.x[0], abs=1e-9)


def test_followed_over_a_parameter() -> None:
    """Periods for mu = 2 and 5: 7.62987447939 and 11.6122306677 (Urabe 1960 has 7.6299, 11.612)."""
    found = oscillator().periodic(6.0, [2.0], [0.0]).follow("mu", [1.5, 2, 3, 5])
    assert [round(one.period, 4) for one in (found[1], found[3])] == [7.6299, 11.6122]
    assert all(one.stable for one in found) and found[3].params[list(oscillator().metadata.parameters).index("mu")] == 5
    with pytest.raises(ArgumentError, match="followed over 'nu', which is no parameter; there are"):
        found[0].follow("nu", [1])


@cache
def bent() -> Any:
    """Circles r with mu + r^2 - r^4 = 0, which meet in a fold at mu = -1/4: r' = r (mu + r^2 - r^4), angle' = 2."""
    a, b, x = sd.coordinates("a b x")
    mu, m = sd.parameters("mu m")
    system = sd.System("bent")
    body = system.add_body("body", mass=m)
    joint = system.add_joint(sd.Prismatic("slide", system.ground, body, x, axis=[1, 0]))
    system.add_joint_force(joint, -x - 2 * x.dot)
    growth = mu + (a**2 + b**2) - (a**2 + b**2) ** 2
    system.add_state(a, a * growth - 2 * b)
    system.add_state(b, b * growth + 2 * a)
    system.defaults, system.initial = {mu: -0.1, m: 1}, {a: 0.94}
    return system.embedding().compile()


def test_branch_past_a_fold() -> None:
    """Radii R = r^2, periods and multipliers exp(pi (2 R - 4 R^2)) in closed form, on both sides of the fold."""
    found = bent().periodic(3.0, z={"a": 0.94}, rtol=1e-11).branch("mu", -1, -0.05, step=-0.2)
    mu = np.array([one.params[1] for one in found])
    R = np.array([one.x[2] ** 2 + one.x[3] ** 2 for one in found])
    assert np.abs(mu + R - R**2).max() < 2e-8 and mu.min() < -0.24 and mu[-1] > -0.07 and R[0] > 0.8 and R[-1] < 0.1
    assert all(abs(one.period - np.pi) < 1e-9 for one in found)
    assert [one.stable for one in found] == [bool(r > 0.5) for r in R]
    for one, r in zip(found, R, strict=True):
        assert np.abs(one.multipliers - np.exp(np.pi * (2 * r - 4 * r**2))).min() < 1e-6
    few = bent().periodic(3.0, z={"a": 0.94}).branch("mu", -1, 1, step=0.05, n=3)
    assert len(few) == 3 and few[0].params[1] > -0.1


def test_branches_that_are_not_followed(monkeypatch: pytest.MonkeyPatch) -> None:
    orbit = bent().periodic(3.0, z={"a": 0.94})
    for arguments, text in ((("nu", 0, 1), "over 'nu', which is no parameter; there are m, mu"),
                            (("mu", 0, 1), r"mu = -0.1 is not between the ends 0 and 1 of the branch"),
                            (("mu", -1, 1, 0), "the step along the branch is 0; pass a positive number, or a negative one"),
                            (("mu", -1, 1, 0.1, 0), "a branch of 0 motions was asked for; pass a whole number from 1 on")):
        with pytest.raises(ArgumentError, match=text):
            orbit.branch(*arguments)
    monkeypatch.setattr(branches, "ITERATIONS", 0)
    with pytest.raises(NoEquilibrium, match=r"the branch of periodic motions over mu is lost after 0 motions, at mu = -0.1"):
        orbit.branch("mu", -1, 1)


def test_forced_branch_of_a_given_period() -> None:
    """Duffing's oscillator: the time appears, so that the period stays; its response has two folds over the force."""
    q = sd.coordinates("q")
    m, force = sd.parameters("m force")
    system = sd.System("duffing")
    body = system.add_body("body", mass=m)
    joint = system.add_joint(sd.Prismatic("slide", system.ground, body, axis=[1, 0], coordinate=q))
    system.add_joint_force(joint, force * sp.cos(2 * sd.t) - 0.1 * q.dot - q - q**3)
    system.defaults = {m: 1, force: 0.1}
    found = system.embedding().compile().periodic(np.pi, [0.0], [0.0]).branch("force", 0, 3, step=0.4, n=80)
    forces = np.array([one.params[1] for one in found])
    turns = np.flatnonzero(np.diff(np.sign(np.diff(forces))))
    assert len(turns) == 2 and all(one.period == np.pi and one.residual < 1e-6 for one in found)
    stable, parts = np.array([one.stable for one in found]), np.split(np.arange(len(found)), turns + 1)
    assert [stable[part[1:-1]].all() for part in parts] == [True, False, True] and not stable[parts[1][1:-1]].any()


def test_forced_oscillator_against_its_closed_form() -> None:
    """The time appears: the period is given, and the multipliers are exp(s T) with the eigenvalues s."""
    q = sd.coordinates("q")
    m, c, k, w = sd.parameters("m c k w", positive=True)
    system = sd.System("forced")
    body = system.add_body("body", mass=m)
    joint = system.add_joint(sd.Prismatic("slide", system.ground, body, axis=[1, 0], coordinate=q))
    system.add_joint_force(joint, sp.cos(w * sd.t) - k * q - c * q.dot, name="force")
    system.defaults = {m: 1, c: 0.3, k: 4, w: 3}
    orbit = system.embedding().compile().periodic(2 * np.pi / 3, [0.0], [0.0], rtol=1e-12)
    response = 1 / (4 - 9 + 0.9j)
    assert orbit.x == pytest.approx([response.real, (3j * response).real], abs=1e-9) and not orbit.free_period
    eigenvalues = np.roots([1, 0.3, 4])
    assert np.sort_complex(orbit.multipliers) == pytest.approx(np.sort_complex(np.exp(eigenvalues * 2 * np.pi / 3)), abs=1e-9)


def test_pendulum_that_turns() -> None:
    """The angle gains a turn; the period is an elliptic integral. Motions of other energies are near: both multipliers are 1."""
    pendulum = sd.systems.pendulum().embedding().compile()
    orbit = pendulum.periodic(1.0, [0.0], [8.0], advance={"q1": 2 * np.pi}, rtol=1e-12)
    speed = orbit.simulate().u[:, 0]
    top = float(np.abs(speed).max())
    period = float(4 / top * mp.ellipk(4 * 9.81 / top**2))
    assert orbit.period == pytest.approx(period, rel=1e-9)
    assert orbit.multipliers == pytest.approx(1, abs=1e-4) and np.prod(orbit.multipliers) == pytest.approx(1, abs=1e-9)


def wheel() -> Any:
    """A rimless wheel down a slope: an inverted pendulum whose foot changes (McGeer 1990)."""
    q = sd.coordinates("q")
    m, g, l, slope, half = sd.parameters("m g l slope half", positive=True)
    system = sd.System("wheel", gravity=[-g, 0])
    hub = system.add_body("hub", mass=m, com=[l, 0])
    system.add_joint(sd.Revolute("foot", system.ground, hub, coordinate=q))
    system.add_event("step", q - slope - half, direction=1, reset={q: slope - half, q.dot: sp.cos(2 * half) * q.dot})
    system.defaults = {m: 1, g: 9.81, l: 1, slope: 0.08, half: 0.4}
    return system.embedding().compile()


def test_rimless_wheel() -> None:
    """Across the impact: the square v of the speed then becomes c (v + d), c = cos^2(2 half): v = c d/(1 - c), multiplier c."""
    orbit = wheel().periodic(0.8, [0.0], [1.2], rtol=1e-12)
    c, d = np.cos(0.8) ** 2, 4 * 9.81 * np.sin(0.4) * np.sin(0.08)
    assert np.sort(orbit.multipliers.real) == pytest.approx([c, 1], abs=1e-8)
    energy = orbit.x[1] ** 2 / 2 + 9.81 * np.cos(orbit.x[0])
    assert 2 * (energy - 9.81 * np.cos(0.08 - 0.4)) == pytest.approx(c * d / (1 - c), rel=1e-9)


@cache
def walker() -> Any:
    """The simplest walker, legs without mass on a hip with it, down a slope (Garcia, Chatterjee, Ruina and Coleman, J. Biomech.
    Eng. 120, 1998): its equations for feet that weigh nothing, on two slides. The feet pass each other in mid-swing without
    touching the ground; heel strike is where the quantity grows."""
    theta, phi = sd.coordinates("theta phi")
    slope = sd.parameters("slope")
    system = sd.System("walker")
    fall = sp.sin(theta - slope)
    for q, rate in ((theta, fall), (phi, fall + (theta.dot**2 - sp.cos(theta - slope)) * sp.sin(phi))):
        body = system.add_body(f"{q.name}_body", mass=1)
        joint = system.add_joint(sd.Prismatic(f"{q.name}_slide", system.ground, body, axis=[1, 0], coordinate=q))
        system.add_joint_force(joint, rate)
    c = sp.cos(2 * theta)
    system.add_event("heel_strike", phi - 2 * theta, direction=1, reset={
        theta: -theta, phi: -2 * theta, theta.dot: c * theta.dot, phi.dot: c * (1 - c) * theta.dot})
    system.defaults = {slope: 0.009}
    return system.embedding().compile()


@pytest.mark.parametrize(("angle", "speed", "period", "sizes"), [
    (0.19393737, -0.20386693, 3.0961058680777, [4.00386436, 1, 0.45958959, 0]),
    (0.20031090, -0.19983247, 3.8824637528, [1, 0.58911319, 0.58911319, 0])])
def test_gaits_of_the_simplest_walker(angle: float, speed: float, period: float, sizes: list[float]) -> None:
    """Short and long steps at a slope of 0.009 against published digits; the state after heel strike has two dimensions."""
    after = [angle, 2 * angle + 1e-7], [speed, (1 - np.cos(2 * angle)) * speed]
    middle = walker().simulate((0, 1.5), *after, rtol=1e-12).x[-1]
    orbit = walker().periodic(3.5, middle[:2], middle[2:], rtol=1e-13) if period < 3.1 else \
        walker().periodic(3.88, middle[:2], middle[2:], rtol=1e-13)
    assert orbit.period == pytest.approx(period, abs=2e-9 if period > 3.1 else 1e-12)
    assert np.abs(orbit.multipliers) == pytest.approx(sizes, abs=1e-7) and orbit.stable == (period > 3.1)
    strike = orbit.simulate().events["heel_strike"].x[0]
    assert [-strike[0], np.cos(2 * strike[0]) * strike[2]] == pytest.approx([angle, speed], abs=1e-8)


def test_on_constraints() -> None:
    """A four-bar linkage that turns without loads: two multipliers are left, whose product is 1."""
    linkage = sd.systems.four_bar().augmented().compile()
    q, u = linkage.consistent(u={"q1_dot": 5.0}, params={"g": 0})
    run = linkage.simulate((0, 10), q, u, {"g": 0}, rtol=1e-10)
    turned = run.q[:, 0] - run.q[0, 0]
    back = np.flatnonzero(np.abs(turned) > 2 * np.pi)
    sign = np.sign(turned[back[0]])
    moves = {name: float(2 * np.pi * sign * round((run.q[back[0], k] - run.q[0, k]) / (2 * np.pi * sign)))
             for k, name in enumerate(linkage.metadata.q)}
    orbit = linkage.periodic(float(run.t[back[0]]), run.q[0], run.u[0], {"g": 0}, advance=moves)
    assert len(orbit.multipliers) == 2 and np.prod(orbit.multipliers) == pytest.approx(1, abs=1e-6)


def hanging(damping: float = 0.0) -> Any:
    """A pendulum without inertia about its mass, 2 m long."""
    q = sd.coordinates("q")
    system = sd.System("hanging", gravity=[0, -9.81])
    bob = system.add_body("bob", mass=1, inertia=0, com=[0, -2])
    hinge = system.add_joint(sd.Revolute("hinge", system.ground, bob, q))
    system.add_joint_force(hinge, -damping * q.dot, name="friction")
    return system.embedding().compile()


@pytest.mark.parametrize("amplitude", [1e-3, *swept([0.5, 2.0]), 3.0])
def test_swings_of_a_pendulum_against_elliptic_integrals(amplitude: float) -> None:
    """Swings of every amplitude are periodic; one of them is found, and not the state of rest, which always comes back."""
    period = float(4 * mp.sqrt(2 / mp.mpf("9.81")) * mp.ellipk(mp.sin(amplitude / 2) ** 2))
    for guess in (0.7 * period, 0.93 * period, 1.05 * period, 1.3 * period):
        swing = hanging().periodic(guess, [amplitude], [0.0], rtol=1e-12)
        assert np.abs(swing.simulate().q).max() > 0.5 * amplitude
        found = float(np.abs(swing.simulate(4001).q).max())
        assert swing.period == pytest.approx(float(4 * mp.sqrt(2 / mp.mpf("9.81")) * mp.ellipk(mp.sin(found / 2) ** 2)), rel=1e-6)


@pytest.mark.parametrize(("mu", "stable"), [(1e-4, True), (-1e-4, False), (0.0, False)])
def test_verdicts_next_to_a_double_multiplier(mu: float, stable: bool) -> None:
    """Van der Pol's cycle of amplitude 2 has the multiplier exp(-2 pi mu) for small mu. Without damping both are 1, and the error
    of a double eigenvalue is the square root of that of the motion."""
    found = oscillator().periodic(6.0, [2.0], [0.0], {"mu": mu})
    assert found.stable is stable
    assert np.prod(found.multipliers).real == pytest.approx(np.exp(-2 * np.pi * mu), abs=1e-6)


def test_linear_oscillator_keeps_its_amplitude() -> None:
    """Newton's method alone goes to rest in one step, whatever the period."""
    swing = oscillator().periodic(6.0, [0.1], [0.0], {"mu": 0, "k": 2.0})
    assert swing.period == pytest.approx(2 * np.pi / np.sqrt(2), rel=1e-9) and swing.x[0] == pytest.approx(0.1)


@pytest.mark.parametrize(("damping", "start"), [(0.5, 0.3), (0.0, 0.0)])
def test_states_of_rest_are_no_periodic_motions(damping: float, start: float) -> None:
    with pytest.raises(NoEquilibrium, match=r"near the start is a state of rest, which comes back after any time \(q = .*, "
                                            r"q_dot = .*\), and no motion with a period of about 3 s was found; begin further"):
        hanging(damping).periodic(3.0, [start], [0.0])


def test_what_is_not_found() -> None:
    with pytest.raises(NoEquilibrium, match=r"no periodic motion found near the start with the period 2 s: after .* is off by"):
        q = sd.coordinates("q")
        m = sd.parameters("m", positive=True)
        system = sd.System("pushed")
        body = system.add_body("body", mass=m)
        joint = system.add_joint(sd.Prismatic("slide", system.ground, body, axis=[1, 0], coordinate=q))
        system.add_joint_force(joint, 1, name="push")
        system.defaults = {m: 1}
        system.embedding().compile().periodic(2.0, [1.0], [0.0])
    with pytest.raises(ArgumentError, match="the period must be a positive number of seconds, found -1"):
        oscillator().periodic(-1)
    with pytest.raises(ArgumentError, match="advance"):
        oscillator().periodic(6, advance={"nothing": 1})


@cache
def driven() -> Any:
    """A pendulum with damping that is driven by a cos w t."""
    angle = sd.coordinates("angle")
    a, w = sd.parameters("a w")
    system = sd.System("driven", gravity=[0, -9.81])
    body = system.add_body("body", mass=1, com=[0, -1])
    hinge = system.add_joint(sd.Revolute("hinge", system.ground, body, angle))
    system.add_joint_force(hinge, a * sp.cos(w * sd.t) - 0.5 * angle.dot)
    system.defaults = {a: 4, w: 2}
    return system.compile()


def test_a_period_that_the_drive_does_not_have() -> None:
    """cos 2t has the period pi, and multiples of it; a start that comes back after 3 s is no periodic motion."""
    message = "the equations are not periodic with 3 s: in the same state the rate of angle_dot is .*; the period must be that of"
    with pytest.raises(ArgumentError, match=message):
        driven().periodic(3.0, [0], [0])
    once, twice = driven().periodic(np.pi, [0], [0]), driven().periodic(2 * np.pi, [0], [0])
    np.testing.assert_allclose(twice.x, once.x, atol=1e-7)
    np.testing.assert_allclose(np.sort(np.abs(twice.multipliers)), np.sort(np.abs(once.multipliers)) ** 2, rtol=1e-5)
    # The product of the multipliers is exp of the integral of the divergence -0.5 (Liouville).
    assert np.prod(once.multipliers).real == pytest.approx(np.exp(-0.5 * np.pi), rel=1e-7)
    with pytest.raises(NoEquilibrium, match=r"not periodic with 3.14159265 s.*at w = 2.1, followed from w = 2"):
        once.follow("w", [2.1])


def test_what_was_found_is_kept_where_one_is_lost(monkeypatch: pytest.MonkeyPatch) -> None:
    once = driven().periodic(np.pi, [0], [0])
    solve = type(once._problem).solve
    place = list(driven().metadata.parameters).index("a")

    def fails(self: Any, x: np.ndarray, period: float) -> Any:
        if self.p[place] > 4.2:
            raise NoEquilibrium("lost")
        return solve(self, x, period)

    monkeypatch.setattr(type(once._problem), "solve", fails)
    with pytest.raises(NoEquilibrium, match=r"lost; at a = 4.3, followed from a = 4.2; the 2 motions before it are the error's fo"
                       ) as caught:
        once.follow("a", [4.1, 4.2, 4.3])
    found: Any = caught.value.found
    assert [float(one.params[place]) for one in found] == [4.1, 4.2]
    assert np.abs(found[1].simulate(2).x[-1] - found[1].x).max() < 1e-6


@cache
def rubbing(event: bool) -> Any:
    """A mass with dry friction that is driven: it turns twice in a period."""
    q = sd.coordinates("q")
    a = sd.parameters("a")
    system = sd.System("rubbing")
    body = system.add_body("body", mass=1)
    slide = system.add_joint(sd.Prismatic("slide", system.ground, body, axis=[1, 0], coordinate=q))
    system.add_joint_force(slide, a * sp.cos(2.5 * sd.t) - 9 * q - 0.3 * sp.sign(q.dot))
    system.defaults = {a: 4}
    if event:
        system.add_event("turns", q.dot)
    return system.compile()


def test_multipliers_that_lack_a_jump_are_warned_of() -> None:
    period = 2 * np.pi / 2.5
    with pytest.warns(SimulationWarning, match="may jump where q_dot passes zero .*the sensitivities lack their jump"):
        wrong = rubbing(False).periodic(period, [0], [0])
    with warnings.catch_warnings():
        warnings.simplefilter("error", SimulationWarning)
        right = rubbing(True).periodic(period, wrong.x[:1], wrong.x[1:])
    h = 1e-5
    ends = [[rubbing(True).simulate([0, period], [x[0]], [x[1]], rtol=1e-12).x[-1]
             for x in (right.x - h * unit, right.x + h * unit)] for unit in np.eye(2)]
    expected = np.linalg.eigvals(np.column_stack([(late - early) / (2 * h) for early, late in ends]))
    np.testing.assert_allclose(np.sort_complex(right.multipliers), np.sort_complex(expected), atol=1e-5)
    assert np.abs(np.sort_complex(wrong.multipliers) - np.sort_complex(expected)).max() > 1e-3


@pytest.mark.parametrize("amplitude", [*swept([1e-6, 1e-9]), 1e-12])
def test_small_motions(amplitude: float) -> None:
    """Van der Pol's cycle of another size has the published period and the same multipliers."""
    q = sd.coordinates("q")
    system = sd.System("small")
    body = system.add_body("body", mass=1)
    slide = system.add_joint(sd.Prismatic("slide", system.ground, body, axis=[1, 0], coordinate=q))
    system.add_joint_force(slide, (1 - (q / amplitude) ** 2) * q.dot - q)
    found = system.compile().periodic(6.0, q=[1.5 * amplitude], u=[0])
    assert found.period == pytest.approx(6.6632868593231, abs=1e-10)
    assert found.x[0] / amplitude == pytest.approx(2.00861986087, rel=1e-8)
    assert np.abs(found.multipliers) == pytest.approx([1, 8.5969506e-4], rel=1e-6)


def test_arguments_of_periodic_motions() -> None:
    module = sd.systems.pendulum().compile()
    with pytest.raises(ArgumentError, match=r"exchange is 3; pass a list of pairs"):
        module.periodic(2.0, q=[0.5], exchange=3)
    with pytest.raises(ArgumentError, match=r"rtol = 0\.01 is too loose for a periodic motion"):
        module.periodic(2.0, q=[0.5], rtol=1e-2)
    found = module.periodic(2.0, q=[0.5])
    for n in (1, -3, "a", True, 2.5):
        with pytest.raises(ArgumentError, match=r"a period was asked for at .* times; pass a whole number from 2 on"):
            found.simulate(n)  # type: ignore[arg-type]
