"""Motions with rigid contacts against closed forms."""

import itertools
import os
import pickle
import re
import warnings
from typing import Any

import numpy as np
import pytest
import sympy as sp
from scipy.integrate import quad
from scipy.optimize import brentq
from scipy.spatial.transform import Rotation

import symdyn as sd
from symdyn.errors import ArgumentError, EvaluationError, ModelError, SimulationWarning
from symdyn.runtime.contact_laws import OPEN, SLIDING, STICKING, Mode, Site, Solved, impact, solutions
from symdyn.runtime.integrating import contacts, hybrid
from symdyn.runtime.module import Module
from symdyn.runtime.solutions.solution import Solution
from tests.helpers import swept

X = sp.Symbol("x")
G = 9.81


def ball(**law: Any) -> sd.System:
    y = sd.coordinates("y")
    system = sd.System("ball", gravity=[0, -G])
    body = system.add_body("ball", mass=1.0)
    system.add_joint(sd.Prismatic("height", system.ground, body, axis=[0, 1], coordinate=y))
    system.add_contact(sd.Contact("floor", body, system.ground, **law))
    return system


def planar(name: str, contacts: list[sd.Contact], mass: float, inertia: float, tilt: float = 0.0) -> sd.System:
    """A body that moves freely in a plane."""
    system = sd.System(name, gravity=[G * np.sin(tilt), -G * np.cos(tilt)])
    body = system.add_body("body", mass=mass, inertia=inertia)
    system.add_joint(sd.Planar("free", system.ground, body, sd.coordinates("x y theta")))
    for contact in contacts:
        system.add_contact(contact)
    return system


def box(friction: Any, tilt: float, restitution: float = 0.0, impact: str = "newton") -> sd.System:
    contact = sd.Contact("corner", "body", "ground", shape=sd.contacts.Box([0.4, 0.2]), friction=friction,
                         restitution=restitution, impact=impact)
    return planar("box", [contact], 2.0, 2.0 * (0.4**2 + 0.2**2) / 12, tilt)


def test_ball_meets_the_times_of_its_impacts_and_their_limit() -> None:
    """Flights are 2 v/g with v = 0.8^n sqrt(2 g h): 50 impacts and the limit of the geometric series."""
    solution = ball(restitution=0.8).compile().simulate((0, 6), q=[1.0], rtol=1e-12)
    floor = solution.contacts["floor"]
    fall, speed = np.sqrt(2 / G), np.sqrt(2 * G)
    times = fall + np.cumsum([0, *[2 * speed * 0.8**n / G for n in range(1, 50)]])
    assert np.abs(floor.impacts.t[:50] - times).max() < 1e-12
    assert np.allclose(floor.impacts.impulse[:50, 0], 1.8 * speed * 0.8 ** np.arange(50), rtol=1e-9)
    assert abs(floor.rests[0] - (fall + 2 * speed * 0.8 / G / 0.2)) < 1e-12
    assert solution.success and floor.mode[-1] == SLIDING and floor.force[-1, 0] == pytest.approx(G)
    assert np.abs(solution.x[-1]).max() < 1e-12
    assert np.array_equal(solution.events["floor_closes"].t, floor.impacts.t)


@pytest.mark.every_value
@pytest.mark.parametrize("friction", [(0.5, 0.5), (0.5, 0.4)])
@pytest.mark.parametrize("speed", [0.0, 0.5])
def test_box_on_two_corners_is_pushed_off_where_all_of_its_static_friction_is_used(friction: Any, speed: float) -> None:
    """A force c t in the middle loads the corners unequally: one of them is at its bound before, where c t/2, of forces of least
    norm, is mu (m g/2 - c t/4), is called sliding from there on, and does not slip. From where both are at their bounds
    on, m v_dot = c t - mu m g; a slip at the start ends before."""
    (static, kinetic), c, mass, end = friction, 3.0, 2.0, 5.0
    system = box(friction, 0.0)
    system.add_force("body", [c * sd.t, 0])
    solution = system.compile().simulate((0, end), q={"y": 0.1}, u={"x_dot": speed}, rtol=1e-11)
    begins = static * mass * G / c
    assert solution.contacts["corner_1"].switches[-1] == pytest.approx((0.8 * begins, SLIDING), abs=1e-7)  # shared softly
    assert solution.contacts["corner_3"].switches[-1] == pytest.approx((begins, SLIDING), abs=1e-9)
    rested = solution.t < begins
    assert np.abs(solution["x_dot"][rested & (solution.t > 0.2)]).max() < 1e-9
    assert solution["x_dot"][-1] == pytest.approx(c * (end**2 - begins**2) / 2 / mass - kinetic * G * (end - begins), rel=1e-9)


ULPS = [-1000, -3, -1, 0, 1, 2, 20]
COMPILERS = ["SYMDYN_TESTS_QUICK_CC", "SYMDYN_TESTS_NATIVE_CC"]
EITHER_COMPILER = pytest.mark.parametrize("compiler", COMPILERS)
BY_TCC = pytest.mark.parametrize("compiler", swept(COMPILERS, COMPILERS[0]))


def ulps_from(value: float, ulps: int) -> float:
    """A number so many units in the last place away."""
    return value + ulps * float(np.spacing(value))


def block_on_its_sole(friction: Any, mass: float) -> sd.System:
    """A block that does not turn, on one contact."""
    x, y = sd.coordinates("x y")
    system = sd.System("block", gravity=[0, -G])
    cart, body = system.add_body("cart"), system.add_body("body", mass=mass)
    system.add_joint(sd.Prismatic("along", system.ground, cart, axis=[1, 0], coordinate=x))
    system.add_joint(sd.Prismatic("across", cart, body, axis=[0, 1], coordinate=y))
    system.add_contact(sd.Contact("sole", body, system.ground, friction=friction))
    return system


def compile_by(monkeypatch: pytest.MonkeyPatch, compiler: str) -> None:
    """Have C compiled without fused operations, or with them."""
    if compiler in os.environ:
        monkeypatch.setenv("SYMDYN_CC", os.environ[compiler])


def in_c_and_in_python(module: Module, *arguments: Any, **options: Any) -> list[Solution]:
    """The same run twice, without warnings of borders."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SimulationWarning)
        return [module.simulate(*arguments, max_steps=most, **options) for most in (None, 100_000)]


@pytest.mark.every_value
@EITHER_COMPILER
@pytest.mark.parametrize("corners", [False, True])
def test_block_slips_whatever_rounding_makes_of_a_force_that_begins_at_the_bound(
        corners: bool, compiler: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """The force f + c t, f the largest static friction to a few units in the last place, on one contact or two that share it."""
    compile_by(monkeypatch, compiler)
    c, mass, end, f = 3.0, 2.0, 2.0, sd.parameters("f")
    system = box((0.5, 0.4), 0.0) if corners else block_on_its_sole((0.5, 0.4), mass)
    system.add_force("body", [f + c * sd.t, 0])
    system.defaults[f] = 0.5 * mass * G
    module = system.compile()
    for ulps in ULPS:
        force = ulps_from(0.5 * mass * G, ulps)
        for solution in in_c_and_in_python(module, (0, end), q={"y": 0.1 * corners}, params={"f": force}, rtol=1e-11):
            assert solution["x_dot"][-1] == pytest.approx(c * end**2 / 2 / mass + (0.5 - 0.4) * G * end, rel=1e-9), ulps


@BY_TCC
def test_block_is_lifted_whatever_rounding_makes_of_a_force_that_begins_at_its_weight(
        compiler: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """The force f + c (t - t_0) upward on a block that slips, f its weight to a few units in the last place; the motion begins
    at t_0, and y = c (t - t_0)^3/6m."""
    compile_by(monkeypatch, compiler)
    c, mass, end, (f, t_0) = 3.0, 2.0, 2.0, sd.parameters("f t_0")
    system = block_on_its_sole(0.3, mass)
    system.add_force("body", [4, f + c * (sd.t - t_0)])
    system.defaults |= {f: mass * G, t_0: 0.0}
    module = system.compile()
    for ulps, begin in itertools.product(ULPS, (0.0, 3.0)):
        params = {"f": ulps_from(mass * G, ulps), "t_0": begin}
        for solution in in_c_and_in_python(module, (begin, begin + end), u=[1.0, 0.0], params=params, rtol=1e-11):
            assert solution.x[-1] == pytest.approx([end + end**2, c * end**3 / 6 / mass, 1 + 2 * end, c * end**2 / 2 / mass],
                                                   rel=1e-9), (ulps, begin)


@BY_TCC
def test_tumbling_block_leaves_its_first_corner_whatever_rounding_makes_of_a_gap_without_speed(
        compiler: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its corner is hit without restitution, slips, and is lifted from a gap and a speed that are zero to rounding; the next
    one is hit where its free flight ends."""
    compile_by(monkeypatch, compiler)
    mass, inertia, mu, half, height, start = 2.0, 0.03, 0.3, 0.2, 0.1, 0.3
    contact = sd.Contact("corner", "body", "ground", shape=sd.contacts.Box([2 * half, 2 * height]), friction=mu)
    module = planar("block", [contact], mass, inertia).compile()
    c, s = np.cos(start), np.sin(start)
    for ulps in ULPS:
        top = ulps_from(0.5, ulps)
        arm = np.array([-half * c + height * s, -half * s - height * c])
        falls = np.sqrt(2 * (top + arm[1]) / G)
        # Along N (mu, 1), friction against the slip to the left, until the corner has no normal speed.
        turn = (arm[0] - mu * arm[1]) / inertia
        impulse = G * falls / (1 / mass + arm[0] * turn)
        v, w = impulse / mass - G * falls, impulse * turn

        def gap(t: float, y: float = -float(arm[1]), v: float = float(v), w: float = float(w)) -> float:
            theta = start + w * t
            return y + v * t - G * t**2 / 2 + half * np.sin(theta) - height * np.cos(theta)

        lands = falls + brentq(gap, 1e-3, 0.05, xtol=1e-15)
        for solution in in_c_and_in_python(module, (0, 1), q={"y": top, "theta": start}, rtol=1e-11):
            assert solution.success, solution.message
            first, other = (solution.events[f"corner_{k}_closes"].t for k in (1, 3))
            assert first[0] == pytest.approx(falls, abs=1e-12) and other[0] == pytest.approx(lands, abs=1e-10)
            assert len(first) == 1 or first[1] > lands
            assert solution.contacts["corner_1"].impacts.t[0] == first[0]
            assert solution.contacts["corner_1"].mode[-1] == solution.contacts["corner_3"].mode[-1] == STICKING
            assert np.abs(solution.u[-1]).max() < 1e-9


@pytest.fixture(scope="module", params=["c", *swept(["numpy"])])
def lifted(request: pytest.FixtureRequest) -> Module:
    """A block on its floor that a force A sin(w t) lifts against drag."""
    amplitude, rate = sd.parameters("A w")
    system = ball()
    system.add_joint_force("height", amplitude * sp.sin(rate * sd.t) - 0.2 * sd.coordinates("y").dot)
    system.defaults.update({amplitude: 15, rate: 2})
    return system.compile(backend=request.param)


def test_block_is_lifted_where_nothing_but_its_own_force_accelerates_it(lifted: Module) -> None:
    """At sin w t = m g/A, where its acceleration is zero but for rounding."""
    stream = np.random.default_rng(0)
    for amplitude, rate in zip(stream.uniform(11, 40, 20), stream.uniform(0.3, 8, 20), strict=True):
        begin = np.arcsin(G / amplitude) / rate
        solution = lifted.simulate((0, 1.2 * begin), params={"A": amplitude, "w": rate}, rtol=1e-9)
        switches = solution.contacts["floor"].switches
        assert [mode for _, mode in switches] == [SLIDING, OPEN] and switches[1][0] == pytest.approx(begin, abs=1e-9)


@pytest.mark.parametrize("backend", ["c", *swept(["numpy"])])
def test_mass_leaves_a_sphere_at_the_height_that_its_speed_gives(backend: str) -> None:
    """At y = 2/3 + v^2/(3 g r), from energy and m v^2/r = m g y."""
    x, y = sd.coordinates("x y")
    system = sd.System("hill", gravity=[0, -G])
    carrier, body = system.add_body("carrier"), system.add_body("body", mass=0.7)
    system.add_joint(sd.Prismatic("along", system.ground, carrier, axis=[1, 0], coordinate=x))
    system.add_joint(sd.Prismatic("across", carrier, body, axis=[0, 1], coordinate=y))
    system.add_contact(sd.Contact("hill", body, system.ground, shape=(sd.contacts.Point(), sd.contacts.Sphere(1.0))))
    module, stream = system.compile(backend=backend), np.random.default_rng(1)
    for speed, digits in zip(stream.uniform(0.5, 2.5, 15), stream.uniform(8, 12, 15), strict=True):
        solution = module.simulate((0, 1), q=[0, 1], u=[speed, 0], rtol=10**-digits)
        assert [mode for _, mode in solution.contacts["hill"].switches] == [SLIDING, OPEN]
        height = solution.events["hill_opens"].x[0, 1]
        assert height == pytest.approx(2 / 3 + speed**2 / (3 * G), abs=1e3 * 10**-digits)


def test_contact_whose_opening_was_missed_stops_the_run(monkeypatch: pytest.MonkeyPatch, lifted: Module) -> None:
    nothing = np.zeros(len(lifted.metadata.events), dtype=bool)
    monkeypatch.setattr(contacts._Phases, "_looked_for", lambda run: nothing)
    with pytest.warns(SimulationWarning, match=r"contact floor pulls by 4\.17 N, since the instant at which it opened was "
                                               "missed; give event_spacing, or a finer rtol"):
        solution = lifted.simulate((0, 0.6), max_steps=1000)
    assert not solution.success


def test_block_lifts_off_a_shaken_table_in_every_period() -> None:
    """It leaves where a w^2 sin(w t) = g, with the acceleration zero, so that rounding passes the zero of the gap; and is back,
    without restitution, where its parabola meets the table."""
    a, w = 0.05, 20.0
    system = sd.System("table", gravity=[0, -G])
    table, block = system.add_body("table"), system.add_body("block", mass=1.5)
    system.add_joint(sd.Prismatic("lift", system.ground, table, axis=[0, 1], coordinate=a * sp.sin(w * sd.t)))
    system.add_joint(sd.Prismatic("height", system.ground, block, axis=[0, 1], coordinate=sd.coordinates("y")))
    system.add_contact(sd.Contact("sole", block, table))
    module = system.compile()
    leaves = np.arcsin(G / (a * w**2)) / w
    y, v = a * np.sin(w * leaves), a * w * np.cos(w * leaves)
    lands = brentq(lambda t: y + v * (t - leaves) - G * (t - leaves) ** 2 / 2 - a * np.sin(w * t), leaves + 0.05, leaves + 0.3,
                   xtol=1e-15)
    for end in (0.7, 1.0, 1.3, 3.0):
        for max_steps in (None, 100_000):  # in C, in Python
            solution = module.simulate((0, end), u=[a * w], rtol=1e-10, max_steps=max_steps)
            assert solution.success
            periods = 2 * np.pi / w * np.arange(10)
            sole = solution.contacts["sole"]
            opened = [t for t, mode in sole.switches if mode == OPEN]
            assert opened == pytest.approx([t for t in leaves + periods if t < end], abs=1e-10)
            assert sole.impacts.t == pytest.approx([t for t in lands + periods if t < end], abs=1e-10)


def test_block_on_a_belt_sticks_and_slips_for_many_periods() -> None:
    """It slips from mu_s m g/k on, x = x_k + R cos(w t - phi), until its speed is the belt's again."""
    static, kinetic, speed, k = 0.5, 0.3, 0.2, 100.0
    x, y = sd.coordinates("x y")
    system = sd.System("belt", gravity=[0, -G])
    band, slide, block = (system.add_body(name, mass=m) for name, m in (("band", 1.0), ("slide", 0.0), ("block", 1.0)))
    system.add_joint(sd.Prismatic("drive", system.ground, band, axis=[1, 0], coordinate=sd.t * speed))
    system.add_joint(sd.Prismatic("along", system.ground, slide, axis=[1, 0], coordinate=x))
    system.add_joint(sd.Prismatic("across", slide, block, axis=[0, 1], coordinate=y))
    system.add_spring_damper(system.ground, block, point_a=[-1, 0], stiffness=k, length=1)
    system.add_contact(sd.Contact("sole", block, band, friction=(static, kinetic)))
    w, begins, centre = np.sqrt(k), static * G / k, kinetic * G / k
    slips = (np.pi + 2 * np.arctan2(speed / w, begins - centre)) / w
    period = slips + 2 * (begins - centre) / speed
    solution = system.compile().simulate((0, begins / speed + 30 * period + 1e-3), u=[speed, 0.0], rtol=1e-13, work=True)
    switches = solution.contacts["sole"].switches
    sliding, sticking = (np.array([t for t, mode in switches if mode == kind]) for kind in (SLIDING, STICKING))
    expected = begins / speed + period * np.arange(31)
    assert len(sliding) == 31
    assert np.abs(sliding - expected).max() < 1e-10
    assert np.abs(sticking[1:] - (expected[:30] + slips)).max() < 1e-10
    balance = solution.energy_balance
    assert np.abs(balance["error"]).max() < 1e-9
    slipped = 2 * (begins - centre) + speed * slips  # of the belt under the block in one period
    sticks = np.searchsorted(solution.t, expected[30]) - 1  # the last time before it slips again
    assert balance["friction of sole"][sticks] == pytest.approx(-30 * kinetic * G * slipped, rel=1e-9)


def test_rocking_block_keeps_housners_times() -> None:
    """Quarter periods by the energy integral; at an impact the angular momentum about the new corner stays (Housner 1963)."""
    half, height, mass = 0.25, 1.0, 3.0
    inertia = mass * (half**2 + height**2) / 3
    reach, critical = np.hypot(half, height), np.arctan2(half, height)
    feet = [sd.Contact(name, "body", "ground", shape=sd.contacts.Point([x, -height]), friction=5.0)
            for name, x in (("left", -half), ("right", half))]
    module = planar("block", feet, mass, inertia).compile()
    start = 0.8 * critical
    c, s = np.cos(start), np.sin(start)
    solution = module.simulate((0, 6), q=[-half + c * half - s * height, s * half + c * height, start], rtol=1e-13)
    about = inertia + mass * reach**2
    kept = (inertia + mass * (height**2 - half**2)) / about

    def quarter(angle: float) -> float:
        def slope(r: float) -> float:  # angle - r^2
            gained = 2 * np.sin(critical - angle + r * r / 2) * np.sin(r * r / 2)
            return 2 * r / np.sqrt(2 * mass * G * reach / about * gained) if r else 2 / np.sqrt(
                2 * mass * G * reach / about * np.sin(critical - angle) / 2) / np.sqrt(2)

        return float(quad(slope, 0, np.sqrt(angle), epsabs=1e-13, epsrel=1e-12)[0])

    angle, t, expected = start, quarter(start), []
    for _ in range(7):
        expected.append(t)
        angle = critical - np.arccos(np.cos(critical) + kept**2 * (np.cos(critical - angle) - np.cos(critical)))
        t += 2 * quarter(angle)
    times = np.unique(np.concatenate([solution.contacts[name].impacts.t for name in ("left", "right")]))
    assert np.abs(times[:7] - expected).max() < 1e-9
    assert {str(mode) for mode in solution.contacts["left"].mode} == {OPEN, STICKING}


def rod(restitution: float = 0.0, impact: str = "newton") -> Any:
    mu = sd.parameters("mu")
    tip = sd.Contact("tip", "body", "ground", shape=sd.contacts.Point([-1, 0]), friction=mu, restitution=restitution,
                     impact=impact)
    system = planar("rod", [tip], 1.0, 1 / 3)
    system.defaults[mu] = 1.5
    return system.compile()


def rod_runs(module: Any, angle: float, mu: float, speed: float = -5.0) -> Any:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SimulationWarning)
        return module.simulate((0, 1e-3), q=[np.cos(angle), np.sin(angle), angle], u=[speed, 0.0, 0.0], params={"mu": mu})


def test_sliding_rod_stops_in_painleves_region() -> None:
    """1 + 3 cos^2 - 3 mu sin cos < 0, tan^2 - 3 mu tan + 4 < 0: from mu = 4/3 on, between two angles (Painleve 1895)."""
    module = rod()
    assert all(rod_runs(module, angle, 1.3333).success for angle in np.radians(range(10, 90, 5)))
    for edge, outside in zip(np.arctan(np.sort(np.roots([1, -4.5, 4]))), (-1, 1), strict=True):
        assert rod_runs(module, edge + outside * 1e-9, 1.5).success
        inside = rod_runs(module, edge - outside * 1e-9, 1.5)
        assert not inside.success
        assert "contacts tip: no accelerations fulfil the laws of contact and friction (Painleve's paradox" in inside.message
    assert rod_runs(module, 1.1, 1.5, 5.0).success


def test_accelerations_in_a_mode_that_jams_are_none() -> None:
    module = rod()
    mode = {"mu": 1.5, "tip_closed": 1, "tip_sliding": -1}
    state = [np.cos(0.8), np.sin(0.8), 0.8, -5, 0, 0]
    assert np.isfinite(module.rhs(0.0, state, mode)).all()
    with pytest.raises(EvaluationError, match="contact tip: its friction jams"):
        module.rhs(0.0, [np.cos(1.1), np.sin(1.1), 1.1, -5, 0, 0], mode)


def test_several_solutions_are_reported() -> None:
    """A contact that would leave, and whose friction presses it down harder than the force lifts it: open, or closed."""
    D = np.array([[1.0, -1.5], [-1.5, 3.0]])
    found = solutions(D, np.array([1.0, 0.0]), [Site((0, 1), 1.0, 1.0, slip=np.array([-1.0]))])
    assert len(found) == 2
    assert {one.modes[0].kind for one in found} == {OPEN, SLIDING}
    assert not solutions(D, np.array([-1.0, 0.0]), [Site((0, 1), 1.0, 1.0, slip=np.array([-1.0]))])


def test_block_on_a_slope_as_steep_as_its_friction_holds_is_reported() -> None:
    foot = sd.Contact("foot", "body", "ground", friction=0.75)
    system = sd.System("block", gravity=[6.0, -8.0])
    body = system.add_body("body", mass=1.0, inertia=1.0)
    system.add_joint(sd.Planar("free", system.ground, body, sd.coordinates("x y theta")))
    system.add_contact(foot)
    with pytest.warns(SimulationWarning, match="t = 0 s contacts foot are on the border of two modes .* foot sticking was taken"):
        system.compile().simulate((0, 0.1))


def test_rod_that_may_leave_or_jam_leaves_with_a_warning() -> None:
    """Spinning quickly in Painleve's region its tip would leave, but friction might hold it as well: two motions."""
    angle, spin = 1.1, 5.0
    start = {"q": [np.cos(angle), np.sin(angle), angle], "params": {"mu": 1.5},
             "u": [-5 - spin * np.sin(angle), spin * np.cos(angle), spin]}
    with pytest.warns(SimulationWarning, match="laws of contact and friction allow 2 motions .* tip open was taken"):
        solution = rod().simulate((0, 0.01), **start)
    assert solution.contacts["tip"].mode[-1] == OPEN


def test_impact_that_gains_energy_by_newtons_law_is_reported_and_loses_it_by_poissons() -> None:
    angle, slip = 0.9132638230032679, 0.64840807
    start = {"q": [np.cos(angle), np.sin(angle) + 1e-6, angle], "u": [slip, -1.0, 0.0], "params": {"mu": 1.549500227313413}}
    with pytest.warns(SimulationWarning, match=r"the impact of tip at t = .* adds 0.124 J, as Newton's law may .*'poisson'"):
        gained = rod(1.0).simulate((0, 0.01), **start)
    assert gained.energy[-1] > gained.energy[0]
    with pytest.warns(SimulationWarning, match="impacts add 0.124 J in 1 of 100 steps, .*with impact='poisson'"):
        rod(1.0).simulate((0, 0.01), method="moreau", step=1e-4, **start)
    lost = rod(1.0, "poisson").simulate((0, 0.01), **start)
    assert lost.energy[-1] < lost.energy[0]


def test_impacts_lose_energy_by_poissons_law_and_have_one_solution() -> None:
    stream = np.random.default_rng(0)
    for _ in range(300):
        c, s = np.cos(angle := stream.uniform(0.1, 1.5)), np.sin(angle)
        D = np.array([[1 + 3 * c * c, -3 * s * c], [-3 * s * c, 1 + 3 * s * s]])
        v, mu = np.array([-1.0, stream.uniform(-3, 3)]), stream.uniform(0, 2)
        for law in ("newton", "poisson"):
            found = impact(D, v, [stream.uniform(0, 1)], [Site((0, 1), mu, mu)], law)
            assert len(found) == 1
            assert abs(found[0].lam[1]) <= mu * found[0].lam[0] * (1 + 1e-9)
            assert law == "newton" or (v + found[0].w) @ found[0].lam <= 1e-12


@pytest.fixture
def in_python(monkeypatch: pytest.MonkeyPatch) -> None:
    """Every switch is made in Python."""
    monkeypatch.setattr(hybrid, "of", lambda *given: None)


@pytest.mark.usefixtures("in_python")
def test_what_happens_at_many_instants_is_one_warning(monkeypatch: pytest.MonkeyPatch) -> None:
    module = ball(restitution=0.9).compile()
    monkeypatch.setattr(contacts, "impact", lambda *given: 2 * impact(*given))
    with pytest.warns(SimulationWarning) as found:
        solution = module.simulate((0, 3), q=[0.5])
    [message] = [str(w.message) for w in found]
    n = len(solution.contacts["floor"].impacts.t)
    assert n > 2
    assert re.search(rf"t = 0\.319275428 s has 2 solutions; .* was taken\. The like happened at {n - 1} more instants, the "
                     r"latest t = 2\.\d+ s, at contacts floor$", message), message


@pytest.mark.usefixtures("in_python")
def test_energy_of_the_size_of_rounding_is_not_reported(monkeypatch: pytest.MonkeyPatch,
                                                        recwarn: pytest.WarningsRecorder) -> None:
    """An impact on paper, with which the ball leaves at 10 m/s, of an impulse that is next to nothing, and of one that counts."""
    module = ball(restitution=0.9).compile()
    for impulse, reported in ((1e-18, 0), (1e-3, 1)):
        one = Solved((Mode(SLIDING, np.zeros(0), True),), np.array([impulse]), np.array([10.0]), False)
        monkeypatch.setattr(contacts, "impact", lambda *given, one=one: [one])
        recwarn.clear()
        module.simulate((0, 0.3193), q=[0.5])
        assert len([w for w in recwarn if "adds" in str(w.message)]) == reported


@pytest.mark.usefixtures("in_python")
def test_modes_that_do_not_settle_and_impacts_without_solution_stop_the_run(monkeypatch: pytest.MonkeyPatch) -> None:
    module = ball(restitution=0.9).compile()
    with monkeypatch.context() as patched:
        patched.setattr(contacts, "SAME_TIME", 10.0)
        with pytest.warns(SimulationWarning, match="modes of contacts do not settle: 50 switches within .* of floor.*'moreau'"):
            module.simulate((0, 6), q=[0.5])
    with monkeypatch.context() as patched:
        patched.setattr(contacts, "SHORTEST_FLIGHT", 1e-2)
        patched.setattr(contacts, "MOST_SHORT", 10)
        patched.setattr(contacts._Phases, "_zeno", lambda *given: [])
        with pytest.warns(SimulationWarning, match="change 10 times within .* s, .*: floor 10 times; .*; method='moreau'"):
            module.simulate((0, 6), q=[0.5])
    several = [Solved((Mode(SLIDING, np.zeros(0), True),), np.array([k]), np.array([0.0]), False) for k in (5.0, 4.0)]
    for found, message in (([], "impact of floor has no solution under Coulomb's law and impact='newton'"),
                           (several, "impact of floor at t = 0.319275428 s has 2 solutions")):
        with monkeypatch.context() as patched:
            patched.setattr(contacts, "impact", lambda *given, found=found: found)
            with pytest.warns(SimulationWarning, match=message):
                module.simulate((0, 0.4), q=[0.5])
    assert "1 steps were done, as asked" in short(module).message


def test_a_ball_that_starts_on_its_floor_downward_bounces() -> None:
    solution = ball(restitution=0.5).compile().simulate((0, 0.16), u=[-1.0])
    np.testing.assert_allclose(solution.contacts["floor"].impacts.t, [0, 1 / G, 1.5 / G], rtol=0, atol=1e-13)


def short(module: Any) -> Any:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SimulationWarning)
        return module.simulate((0, 2), q=[0.5], max_steps=1)


@pytest.fixture(scope="module")
def billiard() -> Any:
    r, mass = 0.028575, 0.17
    system = sd.System("billiard", gravity=[0, 0, -G])
    body = system.add_body("ball", mass=mass, inertia=[2 / 5 * mass * r * r] * 3)
    system.add_joint(sd.Free("free", system.ground, body, orientation=sd.EulerParameters()))
    system.add_contact(sd.Contact("cloth", body, system.ground, shape=sd.contacts.Sphere(r), friction=0.2))
    return system.compile()


@pytest.mark.parametrize(("v", "omega"), [([2.0, 0.0], [0.0, 0.0, 0.0]), ([2.0, 0.3], [30.0, -20.0, 5.0])])
def test_billiard_ball_slides_then_rolls(billiard: Any, v: list[float], omega: list[float]) -> None:
    """Sliding ends after 2 s/(7 mu g), s the slip at the start, whose direction stays: a parabola, then a straight line.

    Source: Coriolis, Theorie mathematique des effets du jeu de billard, 1835.
    """
    r, mu = 0.028575, 0.2
    t = np.linspace(0, 1.5, 151)
    solution = billiard.simulate(t, q=[0, 0, r, 1, 0, 0, 0], u=[*v, 0, *omega], rtol=1e-13)
    slip = np.array(v) + np.array([-r * omega[1], r * omega[0]])
    ends, along = 2 * np.linalg.norm(slip) / (7 * mu * G), slip / np.linalg.norm(slip)
    cloth = solution.contacts["cloth"]
    assert [mode for _, mode in cloth.switches] == [SLIDING, STICKING]
    assert abs(cloth.switches[1][0] - ends) < 1e-11
    before = np.minimum(t, ends)[:, None]
    path = before * v - mu * G / 2 * before**2 * along + (t[:, None] - before) * (v - mu * G * ends * along)
    assert np.abs(solution.q[:, :2] - path).max() < 1e-11
    assert np.abs(solution.u[-1, :2] - (v - mu * G * ends * along)).max() < 1e-11
    if not any(omega):
        assert solution.u[-1, 0] == pytest.approx(5 / 7 * v[0], rel=1e-12)


def test_tippe_top_turns_over_and_keeps_jelletts_integral() -> None:
    """L r is constant, L the angular momentum about the centre of mass and r the way from there to the contact (Jellett 1872)."""
    radius, offset, inertia = 0.02, 0.003, np.array([2.6e-6, 2.6e-6, 2.4e-6])
    system = sd.System("tippe_top", gravity=[0, 0, -G])
    body = system.add_body("top", mass=0.015, inertia=inertia.tolist())
    system.add_joint(sd.Free("free", system.ground, body, orientation=sd.EulerParameters()))
    system.add_contact(sd.Contact("foot", body, system.ground, shape=sd.contacts.Sphere(radius, [0, 0, offset]), friction=0.2))
    tilt, spin = 0.3, 150.0
    start = [0, 0, radius - offset * np.cos(tilt), np.cos(tilt / 2), np.sin(tilt / 2), 0, 0]
    solution = system.compile().simulate(np.linspace(0, 1.3, 131), q=start, rtol=1e-11,
                                         u=[0, 0, 0, 0, spin * np.sin(tilt), spin * np.cos(tilt)])
    turned = Rotation.from_quat(solution.q[:, [4, 5, 6, 3]])
    axis = turned.apply([0, 0, 1])
    integral = (turned.apply(solution.u[:, 3:] * inertia) * (offset * axis - [0, 0, radius])).sum(axis=1)
    assert np.ptp(integral) < 1e-10 * abs(integral[0])
    assert (solution.contacts["foot"].mode == SLIDING).all()
    assert axis[-1, 2] < -0.7 < 0.9 < axis[0, 2]


@pytest.mark.every_value
@pytest.mark.parametrize("law", ["newton", "poisson"])
@pytest.mark.parametrize("speed", [0.5, 4.0])
def test_sphere_that_hits_obliquely_rolls_off_or_slides_on(law: str, speed: float) -> None:
    """The tangential impulse stops the slip, 2/7 m v, or is mu (1 + e) m v_n, whichever is less."""
    mass, radius, mu, e, normal = 0.3, 0.05, 0.2, 0.6, 2.0
    system = sd.System("sphere")
    body = system.add_body("sphere", mass=mass, inertia=[2 / 5 * mass * radius**2] * 3)
    system.add_joint(sd.Free("free", system.ground, body, orientation=sd.EulerParameters()))
    system.add_contact(sd.Contact("wall", body, system.ground, shape=sd.contacts.Sphere(radius), friction=mu, restitution=e,
                                  impact=law))
    solution = system.compile().simulate((0, 0.2), q=[0, 0, radius + 0.1, 1, 0, 0, 0], rtol=1e-12,
                                         u=[0.6 * speed, -0.8 * speed, -normal, 0, 0, 0])
    wall = solution.contacts["wall"]
    along = min(2 / 7 * mass * speed, mu * (1 + e) * mass * normal)
    assert wall.impacts.impulse == pytest.approx(np.array([[(1 + e) * mass * normal, -0.6 * along, 0.8 * along]]), rel=1e-9)
    assert solution.u[-1, :3] == pytest.approx(np.array([0.6, -0.8, 0]) * (speed - along / mass) + [0, 0, e * normal], abs=1e-9)
    assert solution.u[-1, 3:6] == pytest.approx(np.array([0.8, 0.6, 0]) * along * radius / (2 / 5 * mass * radius**2), rel=1e-9)


def test_box_rests_on_a_slope_on_two_corners_and_slides_on_a_smooth_one() -> None:
    """Two sticking corners depend on each other: the motion is unique, their friction is shared."""
    tilt = np.radians(20)
    resting = box(0.5, tilt).compile().simulate((0, 2), q=[0, 0.3, 0], rtol=1e-11)
    feet = [resting.contacts[name] for name in ("corner_1", "corner_3")]
    assert all(foot.mode[-1] == STICKING for foot in feet)
    assert np.abs(resting.u[-1]).max() < 1e-12
    assert sum(foot.force[-1, 0] for foot in feet) == pytest.approx(2 * G * np.cos(tilt), rel=1e-9)
    assert sum(foot.force[-1, 1] for foot in feet) == pytest.approx(-2 * G * np.sin(tilt), rel=1e-9)
    sliding = box(0.2, tilt).compile().simulate((0, 2), q=[0, 0.1, 0], rtol=1e-11)
    assert sliding.q[-1, 0] == pytest.approx(2 * G * (np.sin(tilt) - 0.2 * np.cos(tilt)), rel=1e-11)


@pytest.mark.parametrize("law", ["newton", *swept(["poisson"])])
def test_tumbling_box_comes_to_rest_and_its_energy_balances(law: str) -> None:
    solution = box(0.3, 0.0, 0.5, law).compile().simulate((0, 3), q=[0, 0.6, 0.3], u=[0.5, 0, 1.0], rtol=1e-11, work=True)
    assert solution.success
    assert np.abs(solution.u[-1]).max() < 1e-9
    assert solution.energy[-1] == pytest.approx(2 * G * 0.1, rel=1e-9)
    balance = solution.energy_balance
    assert {"impact of corner_1", "impact of corner_3"} <= set(balance)
    assert np.abs(balance["error"]).max() < 1e-8
    assert {"friction of corner_1", "friction of corner_3"} <= set(balance) and np.abs(balance["work"]).max() < 1e-8
    assert all((np.diff(rows) <= 1e-10).all() for name, rows in balance.items() if name.startswith(("impact", "friction")))
    assert min(contact.gap.min() for contact in solution.contacts.values()) > -1e-9


def pendulum_at_a_wall() -> sd.System:
    system, (a, b) = sd.System("pendulum", gravity=[0, -G]), sd.coordinates("a b")
    upper, lower = (system.add_body(name, mass=1.0, inertia=0.1, com=[0, -0.5]) for name in ("upper", "lower"))
    system.add_joint(sd.Revolute("first", system.ground, upper, a))
    system.add_joint(sd.Revolute("second", upper, lower, b, parent_point=[0, -1]))
    wall = sd.contacts.Plane([1, 0], [-0.4, 0])
    system.add_contact(sd.Contact("tip", lower, system.ground, shape=(sd.contacts.Point([0, -1]), wall), friction=0.3,
                                  restitution=0.4))
    system.initial.update({a: 0.5, b: 0.2})
    return system


@pytest.fixture(scope="module")
def at_a_wall() -> Solution:
    return pendulum_at_a_wall().embedding().compile().simulate((0, 1.2), rtol=1e-11)


@pytest.mark.parametrize("formulation", ["recursive", "augmented", "absolute"])
def test_all_formulations_make_the_same_motion(formulation: str, at_a_wall: Solution) -> None:
    system = pendulum_at_a_wall()
    equations = system.augmented(coordinates="absolute") if formulation == "absolute" else getattr(system, formulation)()
    solution = equations.compile().simulate((0, 1.2), rtol=1e-11)
    tip, expected = solution.contacts["tip"], at_a_wall.contacts["tip"]
    assert [mode for _, mode in tip.switches] == [mode for _, mode in expected.switches]
    assert len(expected.impacts.t) == 1
    assert np.abs(tip.impacts.t - expected.impacts.t).max() < 1e-8
    assert np.abs(tip.gap - expected.gap).max() < 1e-7


def test_friction_across_a_joint_that_does_not_move_is_none() -> None:
    """A ball on a vertical rail does not slip: its tangential row moves nothing."""
    solution = ball(restitution=0.5, friction=0.3).compile().simulate((0, 3), q=[0.5], rtol=1e-12)
    floor = solution.contacts["floor"]
    assert solution.success and floor.mode[-1] == STICKING
    assert floor.force[-1] == pytest.approx([G, 0.0])
    assert floor.rests[0] == pytest.approx(3 * np.sqrt(1 / G), abs=1e-12)


def test_numpy_gives_the_same_motion_as_c() -> None:
    system = ball(restitution=0.5)
    runs = [system.compile(backend=backend).simulate((0, 0.9), q=[0.5], rtol=1e-12) for backend in ("c", "numpy")]
    assert np.abs(runs[0].x - runs[1].x).max() < 1e-9
    assert len(runs[0].contacts["floor"].impacts.t) == len(runs[1].contacts["floor"].impacts.t) == 4


def test_states_at_other_times_steps_events_and_copies() -> None:
    system = ball(restitution=0.5)
    system.add_event("top", sd.velocity(system.bodies[0])[1], -1)
    module = pickle.loads(pickle.dumps(system.compile()))
    solution = module.simulate((0, 0.9), q=[0.5], rtol=1e-12)
    steps = module.simulate((0, 0.9), q=[0.5], rtol=1e-12, steps=True)
    assert np.abs(steps(solution.t) - solution.x).max() < 1e-12
    assert len(steps.contacts["floor"].mode) == len(steps.t)
    speed = np.sqrt(G)  # flights begin with half the speed
    assert solution.events["top"].t[1] == pytest.approx(np.sqrt(1 / G) + 0.5 * speed / G, abs=1e-12)
    batch = module.simulate_batch(q=[[0.5], [0.2]], t=(0, 3))
    assert np.abs(batch.x).max() < 1e-9


def test_faults_of_contacts_are_reported_together() -> None:
    system = ball(friction=-1, restitution=1.5)
    shape = sd.contacts
    for contact in (sd.Contact("self", "ball", "ball"), sd.Contact("ground", system.ground, "ball"),
                    sd.Contact("lost", "ball", "bal"), sd.Contact("bad name", "ball", "ground"),
                    sd.Contact("odd", "ball", "ground", shape=3, friction=(1, 2, 3), law="soft", impact="x"),  # type: ignore[arg-type]
                    sd.Contact("disc", "ball", "ground", shape=shape.Disc(1)),
                    sd.Contact("static", "ball", "ground", friction=(0.1, 0.2)),
                    sd.Contact("small", "ball", "ground", shape=(shape.Sphere(-0.1), shape.Plane([0, 0]))),
                    sd.Contact("flat", "ball", "ground", shape=(shape.Point(), shape.Plane([0, 0]))),
                    sd.Contact("rolled", "ball", "ground", shape=(shape.Sphere(1), shape.Curve(1, 2))),  # type: ignore[arg-type]
                    sd.Contact("corners", "ball", "ground", shape=shape.Box([1, 2, 3])),
                    sd.Contact("surface", "ball", "ground", shape=(shape.Point(), shape.Surface(0, sd.t, sd.t)))):
        system.add_contact(contact)
    system.add_contact("ball")  # type: ignore[type-var]
    with pytest.raises(ModelError) as caught:
        system.check()
    message = str(caught.value)
    for part in ("'floor': static friction is -1", "'floor': restitution is 1.5, which would gain energy",
                 "ball is in contact with itself", "body a is the ground", "'lost' is between 'bal'",
                 "a contact is named 'bad name'", "shape is 3", "friction is (1, 2, 3)", "law is 'soft'", "impact is 'x'",
                 "a Disc touches in space", "kinetic friction 0.2 is above",
                 "radius of the shape on a is -0.1", "normal of the plane is zero", "the abscissa of a Curve is 2",
                 "size is [1, 2, 3]; pass two lengths", "a Surface belongs to a spatial system", "add_contact was given 'ball'"):
        assert part in message
    crossed = sd.System("space")
    body = crossed.add_body("body", mass=1.0, inertia=[1, 1, 1])
    crossed.add_joint(sd.Free("free", crossed.ground, body))
    pair = (shape.Disc(1, axis=[0, 0, 0]), shape.Sphere(1))
    crossed.add_contact(sd.Contact("edge", body, crossed.ground, shape=pair))
    crossed.add_contact(sd.Contact("axis", body, crossed.ground, shape=shape.Disc(1, axis=[0, 0, 0])))
    with pytest.raises(ModelError, match="the axis is zero"):
        crossed.check()


@pytest.mark.parametrize(("values", "text"), [
    ((-0.1, -0.1, 0.5), "static friction of contact floor is -0.1; pass a number that is not negative; kinetic friction"),
    ((0.3, 0.2, 1.5), "restitution of contact floor is 1.5, which would gain energy in every impact"),
    ((0.3, 0.2, -0.5), "restitution of contact floor is -0.5; pass a number that is not negative"),
    ((0.2, 0.3, 0.5), "kinetic friction of contact floor is 0.3, above static friction 0.2; pass static friction")])
def test_coefficients_that_parameters_make_impossible(values: tuple[float, float, float], text: str) -> None:
    static, kinetic, e = sd.parameters("mu_s mu_k e")
    system = ball(friction=(static, kinetic), restitution=e)
    system.defaults.update({static: 0.3, kinetic: 0.2, e: 0.5})
    with pytest.raises(ArgumentError, match=text):
        system.compile(backend="numpy").simulate((0, 1), q=[1.0], params=dict(zip((static, kinetic, e), values, strict=True)))


def test_lengths_that_parameters_make_impossible_and_normals_without_direction_are_reported() -> None:
    r = sd.parameters("r")
    system = planar("wheel", [sd.Contact("rim", "body", "ground", shape=sd.contacts.Sphere(r), friction=0.1)], 1.0, 0.1)
    system.defaults[r] = 0.1
    with pytest.raises(ArgumentError, match=r"radius of the shape on a of contact rim is -0\.2; pass a number from 0 on"):
        system.compile().simulate((0, 1), q=[0, 1, 0], params={r: -0.2})
    pin = planar("pin", [sd.Contact("bearing", "body", "ground", shape=(sd.contacts.Sphere(2 * r), sd.contacts.Bore(r + 0.3)))],
                 1.0, 0.1)
    pin.defaults[r] = 0.1
    module = pin.compile()
    assert module.simulate((0, 0.01)).success
    with pytest.raises(ArgumentError, match=r"room in the bore of contact bearing is -0\.1; pass a number above 0"):
        module.simulate((0, 0.01), params={r: 0.4})
    with pytest.raises(ArgumentError, match=r"radius of the shape on a of contact bearing is -0\.02; pass"):
        module.simulate((0, 0.01), params={r: -0.01})
    brick = planar("brick", [sd.Contact("corner", "body", "ground", shape=sd.contacts.Box([r - 0.1, r]))], 1.0, 0.1)
    brick.defaults[r] = 0.5
    batch = brick.compile().simulate_batch(q={"y": 1.0}, params={"r": [0.4, 0.1]}, t=np.linspace(0, 0.01, 3))
    assert batch.success.tolist() == [True, False]
    assert batch.messages[1] == "brick: edge 1 of the box of contact corner is 0; pass a number above 0"
    with pytest.raises(ModelError, match=r"edge 2 of the box is -0\.2"):
        planar("box", [sd.Contact("corner", "body", "ground", shape=sd.contacts.Box([0.4, -0.2]))], 1.0, 0.1).compile()
    shape = (sd.contacts.Sphere(0.1), sd.contacts.Sphere(0.1))
    one_in_the_other = planar("balls", [sd.Contact("touch", "body", "ground", shape=shape)], 1.0, 0.1).compile()
    with pytest.raises(EvaluationError, match="contact touch: its normal has no direction: points at one place"):
        one_in_the_other.simulate((0, 1))


def test_static_friction_without_a_number_is_not_compared() -> None:
    system = ball(friction=(sd.parameters("mu_s"), 0.3))
    system.check()
    system.defaults[sd.parameters("mu_s")] = 0.2
    with pytest.raises(ModelError, match=r"kinetic friction 0.3 is above static friction 0.2"):
        system.check()


def test_loads_that_depend_on_reactions_do_not_go_with_rigid_contacts() -> None:
    system = ball()
    system.add_force("ball", [0, sd.acceleration(system.bodies[0])[1] / 10])
    with pytest.raises(ModelError, match="rigid contacts do not go with"):
        system.check()


def test_what_contacts_do_not_go_with_is_rejected() -> None:
    module = ball(restitution=0.5).compile()
    with pytest.raises(ArgumentError, match=r"floor by 0.2 m; start from q = \{y: 0\}, where they touch"):
        module.simulate((0, 1), q=[-0.2])
    with pytest.raises(ArgumentError, match="do not run backward in time"):
        module.simulate((1, 0), q=[0.2])
    for call in (module.equilibrium, module.equilibria):
        with pytest.raises(ArgumentError, match="not known with the rigid contacts floor"):
            call()
    bound = ball().compile(specialize={"floor_closed": 0.0})
    with pytest.raises(ArgumentError, match="floor_closed say in which mode contacts are"):
        bound.simulate((0, 1), q=[0.2])
    driven = ball()
    driven.add_force("ball", [0, sd.inputs("F")])
    with pytest.raises(ArgumentError, match="controllers whose values are held"):
        driven.compile().simulate((0, 1), q=[0.2], inputs={"F": sd.Sampled(lambda t, x: [0.0], 0.1)})
    absolute = ball().augmented(coordinates="absolute").compile()
    with pytest.raises((ArgumentError, sd.MissingExtra), match="ggl"):
        absolute.simulate((0, 1), method="ggl")


def test_contact_that_closes_unseen_stops_the_run() -> None:
    """Without a look at its events a contact would be passed."""
    module = ball().compile()
    seen = contacts._Phases._looked_for
    try:
        contacts._Phases._looked_for = lambda self: np.zeros_like(seen(self))  # type: ignore[method-assign]
        with pytest.warns(SimulationWarning, match=r"stopped at t = 1: contact floor overlaps by 4.41 m, since the "
                          "instant at which it closed was missed"):
            module.simulate((0, 1), q=[0.5])
    finally:
        contacts._Phases._looked_for = seen  # type: ignore[method-assign]


@pytest.mark.parametrize(("shape", "planar", "wrong"), [
    ((sd.contacts.Sphere(0.1), sd.contacts.Cam(-1, X)), True, "radius of the Cam is -1 m at the angle 0.04363; pass one"),
    ((sd.contacts.Point(), sd.contacts.Cam(sp.cos(X), X)), True, r"the radius of the Cam is -0\.0436194 m at the angle 1\.614"),
    (sd.contacts.Box([0.4, 0]), True, "edge 2 of the box is 0; pass a length above 0"),
    (sd.contacts.Disc(0), False, "radius of the shape on a is 0; pass a length above 0"),
    ((sd.contacts.Point(), sd.contacts.Bore(0)), True, "radius of the shape on b is 0; pass a length above 0"),
    ((sd.contacts.Sphere(0.5), sd.contacts.Bore(0.3)), True, r"the Sphere on a does not fit into the Bore on b, which is 0.2 m"),
    ((sd.contacts.Torus(0.3, 0.1), sd.contacts.Bore(0.35)), False, r"the Torus on a does not fit .* is 0\.05 m too small"),
    ((sd.contacts.Cylinder(0.3, 0.8), sd.contacts.Bore(0.4)), False, r"the Cylinder on a does not fit .* is 0\.1 m too small"),
    ((sd.contacts.Box([0.6, 0.8]), sd.contacts.Bore(0.4)), True, r"the Box on a does not fit .* is 0\.1 m too small")])
def test_shapes_that_cannot_be_or_do_not_fit_are_faults(shape: Any, planar: bool, wrong: str) -> None:
    system = sd.System("shaped")
    body = system.add_body("body", mass=1.0, inertia=0.1 if planar else [0.1] * 3)
    system.add_joint(sd.Planar("free", system.ground, body) if planar
                     else sd.Free("free", system.ground, body, orientation=sd.EulerAngles("ZYX")))
    system.add_contact(sd.Contact("touch", body, "ground", shape=shape))
    with pytest.raises(ModelError, match=wrong):
        system.check()


def test_body_of_another_system_with_the_same_name_is_a_fault() -> None:
    system = ball()
    other = sd.System("other").add_body("ball", mass=1.0)
    system.add_contact(sd.Contact("strange", other, "ground"))
    with pytest.raises(ModelError, match=r"contact 'strange': 'ball' is a body of another system, and this one has another body"):
        system.check()
