"""Time stepping with contacts, method="moreau": closed forms, runs that locate every switch, the cone in space, redundant
contacts, constraints in the same step, errors."""

from __future__ import annotations

import functools
import warnings
from typing import Any

import numpy as np
import pytest

import symdyn as sd
from symdyn.errors import ArgumentError, SimulationWarning
from symdyn.runtime.building.compiler import find_compiler
from symdyn.runtime.module import Module

pytestmark = pytest.mark.skipif(find_compiler() is None, reason="no C compiler")
G = 9.81


def ball(restitution: float = 0.8) -> sd.Module:
    """A ball above a floor."""
    y = sd.coordinates("y")
    system = sd.System("ball", gravity=[0, -G])
    body = system.add_body("ball", mass=1.0)
    system.add_joint(sd.Prismatic("height", system.ground, body, axis=[0, 1], coordinate=y))
    system.add_contact(sd.Contact("floor", body, system.ground, restitution=restitution))
    return system.compile()


def block(friction: float, angle: float) -> sd.Module:
    """A block on a slope, with its four corners."""
    system = sd.System("block", gravity=[G * np.sin(angle), -G * np.cos(angle)])
    box = system.add_body("box", mass=2.0, inertia=0.03)
    system.add_joint(sd.Planar("free", system.ground, box, sd.coordinates("x y theta")))
    system.add_contact(sd.Contact("corner", box, system.ground, shape=sd.contacts.Box([0.4, 0.2]), friction=friction))
    return system.compile()


def bounced(t: np.ndarray, restitution: float) -> np.ndarray:
    """Heights of the ball from 1 m, in closed form."""
    heights, begin, speed = np.zeros_like(t), -np.sqrt(2 / G), np.sqrt(2 * G)
    while begin < t[-1] and speed > 1e-9:
        flight = 2 * speed / G
        here = (t >= begin) & (t <= begin + flight)
        heights[here] = (t[here] - begin) * (speed - G * (t[here] - begin) / 2)
        begin, speed = begin + flight, restitution * speed
    return heights


def test_a_bouncing_ball_converges_with_the_first_order_of_the_step() -> None:
    module, t = ball(), np.linspace(0, 3, 301)
    errors = []
    for step in (1e-2, 1e-3, 1e-4):
        solution = module.simulate(t, q=[1.0], method="moreau", step=step)
        assert solution.stepped is not None and solution.stepped.residual == 0.0
        errors.append(np.abs(solution.q[:, 0] - bounced(t, 0.8)).max())
    orders = np.log10(np.array(errors[:-1]) / errors[1:])
    assert orders.mean() > 0.8, errors
    assert errors[-1] < 2e-3


def slider(name: str) -> tuple[sd.System, Any, Any]:
    """A system, its body of 1 kg that slides along x and across y, and x."""
    x, y = sd.coordinates("x y")
    system = sd.System(name, gravity=[0, -G])
    cart, body = system.add_body("cart"), system.add_body("body", mass=1.0)
    system.add_joint(sd.Prismatic("along", system.ground, cart, axis=[1, 0], coordinate=x))
    system.add_joint(sd.Prismatic("across", cart, body, axis=[0, 1], coordinate=y))
    return system, body, x


def test_smooth_phases_are_of_second_order() -> None:
    """A block slides down and meets a spring: a harmonic motion with friction, in contact all the time."""
    system, body, x = slider("slider")
    system.add_force(body, [-40 * x, 0])
    system.add_contact(sd.Contact("sole", body, system.ground, friction=0.1))
    module = system.compile()
    t = np.linspace(0, 0.4, 41)
    shift = 0.1 * G / 40
    exact = shift + (1 - shift) * np.cos(np.sqrt(40) * t)
    errors = [np.abs(module.simulate(t, q=[1.0, 0.0], u=[-1e-12, 0], method="moreau", step=h).q[:, 0] - exact).max()
              for h in (1e-2, 5e-3, 2.5e-3)]
    orders = np.log2(np.array(errors[:-1]) / errors[1:])
    np.testing.assert_allclose(orders, 2, atol=0.05)


@pytest.mark.parametrize("friction", [0.5, 0.2])
def test_a_block_on_a_slope_stays_or_slides_as_in_closed_form(friction: float) -> None:
    angle = np.radians(20)
    solution = block(friction, angle).simulate((0, 2), q={"y": 0.1}, method="moreau", step=0.01)
    corner = solution.contacts["corner_1"]
    slides = max(G * (np.sin(angle) - friction * np.cos(angle)), 0.0)
    assert corner.mode[-1] == ("sliding" if slides else "sticking")
    np.testing.assert_allclose(solution["x"], slides * solution.t**2 / 2, atol=1e-12)
    weight = sum(solution.contacts[f"corner_{k}"].force[-1, 0] for k in range(1, 5))
    assert weight == pytest.approx(2 * G * np.cos(angle), rel=1e-10)
    assert solution.stepped is not None and solution.stepped.residual < 1e-11 and solution.stepped.depth < 1e-11
    assert (solution.n_steps, solution.n_rejected) == (200, 0)


def test_a_tumbling_block_approaches_the_run_that_locates_its_impacts() -> None:
    module, t, start = block(0.3, 0.0), np.linspace(0, 1, 51), {"y": 0.5, "theta": 0.3}
    exact = module.simulate(t, q=start, rtol=1e-10)
    errors = [np.abs(module.simulate(t, q=start, method="moreau", step=h).q - exact.q).max() for h in (1e-2, 1e-3, 1e-4)]
    assert errors[1] < errors[0] / 5 and errors[2] < 1e-4, errors


def test_a_billiard_ball_rolls_with_five_sevenths_of_its_speed() -> None:
    system = sd.System("billiard", gravity=[0, 0, -G])
    body = system.add_body("ball", mass=0.2, inertia=[0.4 * 0.2 * 0.03**2] * 3)
    system.add_joint(sd.Free("free", system.ground, body, orientation=sd.EulerParameters()))
    system.add_contact(sd.Contact("cloth", body, system.ground, shape=sd.contacts.Sphere(0.03), friction=0.2))
    module = system.compile()
    direction = np.array([np.cos(0.7), np.sin(0.7)])
    solution = module.simulate((0, 0.4), q=[0, 0, 0.03, 1, 0, 0, 0], u=[*direction, 0, 0, 0, 0], method="moreau", step=1e-3)
    cloth = solution.contacts["cloth"]
    np.testing.assert_allclose(solution.u[-1, :2], 5 / 7 * direction, atol=1e-12)
    begins = [t for t, mode in cloth.switches if mode == "sticking"]
    assert begins[0] == pytest.approx(2 / 7 / (0.2 * G), abs=1e-3)
    sliding = cloth.mode == "sliding"
    np.testing.assert_allclose(cloth.force[sliding][:, 1:] @ direction, -0.2 * 0.2 * G, rtol=1e-10)  # against the slip
    np.testing.assert_allclose(cloth.force[sliding][:, 1:] @ [-direction[1], direction[0]], 0, atol=1e-11)
    assert np.linalg.norm(cloth.force[-1, 1:]) < 1e-10


def test_a_table_shares_its_weight_among_four_legs() -> None:
    system = sd.System("table", gravity=[1.0, 0.3, -G])
    plate = system.add_body("plate", mass=10.0, inertia=[1.0, 1.2, 1.5])
    system.add_joint(sd.Free("free", system.ground, plate, orientation=sd.EulerParameters()))
    legs = [(x, y) for x in (0.5, -0.5) for y in (0.4, -0.4)]
    for k, (x, y) in enumerate(legs):
        system.add_contact(sd.Contact(f"leg_{k}", plate, system.ground, shape=sd.contacts.Point([x, y, -0.7]), friction=0.5))
    module = system.compile()
    at = [0, 0, 0.7, 1, 0, 0, 0]
    still = module.simulate((0, 0.5), q=at, method="moreau", step=1e-2)
    assert still.stepped is not None and still.stepped.residual < 1e-11
    np.testing.assert_allclose(still.q[-1], at, atol=1e-12)
    forces = sum(still.contacts[f"leg_{k}"].force[-1] for k in range(4))
    np.testing.assert_allclose(forces, [10 * G, -10, -3], atol=1e-12)
    arms = np.array([[x, y, -0.7] for x, y in legs])
    each = np.array([still.contacts[f"leg_{k}"].force[-1] for k in range(4)])[:, [1, 2, 0]]  # along the axes
    np.testing.assert_allclose(np.cross(arms, each).sum(axis=0), 0, atol=1e-11)
    shoved = module.simulate((0, 0.5), q=at, u=[1, 0.5, 0, 0, 0, 0.3], method="moreau", step=1e-2)
    pushed = sum(shoved.contacts[f"leg_{k}"].impulse[-1] for k in range(4))
    gained = 10 * (shoved.u[-1, :3] - shoved.u[0, :3]) - 10 * 0.5 * np.array([1.0, 0.3, -G])
    np.testing.assert_allclose(pushed[[1, 2, 0]], gained, atol=1e-12)  # momentum
    assert shoved.stepped is not None and shoved.stepped.residual < 1e-11 and shoved.stepped.depth < 1e-11


def test_an_impact_takes_the_energy_that_restitution_says() -> None:
    solution = ball(0.5).simulate((0, 0.6), q=[1.0], method="moreau", step=1e-3, work=True)
    hit = solution.contacts["floor"].impacts
    np.testing.assert_allclose(hit.after[:, 0], -0.5 * hit.before[:, 0], rtol=1e-12)
    balance = solution.energy_balance
    lost = -balance["contact floor"][-1]
    assert lost == pytest.approx(0.5 * (1 - 0.25) * float((hit.before[:, 0] ** 2).sum()), rel=2e-3)
    assert abs(balance["error"][-1]) < 0.05  # what moving apart costs, of first order in the step


def test_static_friction_holds_more_than_kinetic_friction() -> None:
    """A block on a belt, held by a spring: the belt takes it along until the static friction is used up."""
    system, body, x = slider("stick_slip")
    belt = system.add_body("belt")
    system.add_joint(sd.Prismatic("drive", system.ground, belt, axis=[1, 0], coordinate=0.1 * sd.t))
    system.add_force(body, [-25 * x, 0])
    system.add_contact(sd.Contact("sole", body, belt, friction=(0.4, 0.2)))
    module = system.compile()
    t = np.linspace(0, 4, 401)
    located = module.simulate(t, q=[0.0, 0.0], u=[0.1, 0.0], rtol=1e-10)
    solution = module.simulate(t, q=[0.0, 0.0], u=[0.1, 0.0], method="moreau", step=1e-4)
    np.testing.assert_allclose(solution.q[:, 0], located.q[:, 0], atol=2e-4)
    assert solution["x"].max() == pytest.approx(0.4 * G / 25, rel=5e-2)
    assert {mode for _, mode in solution.contacts["sole"].switches} == {"sticking", "sliding"}
    system, body, x = slider("from_rest")
    system.add_force(body, [0.3 * G, 0])
    system.add_contact(sd.Contact("sole", body, system.ground, friction=(0.4, 0.2)))
    still = system.compile().simulate((0, 0.5), method="moreau", step=1e-2)
    np.testing.assert_allclose(still.q, 0, atol=1e-13)  # held from the first step on


def test_a_box_that_is_pushed_on_two_corners_begins_to_slide_when_both_are_at_their_bound() -> None:
    """The shares of the corners in friction are open: one may be at its bound of static friction while the other still holds the
    box."""
    m, static, kinetic, g, rate, end = 2.0, 0.5, 0.4, 9.81, 3.0, 6.0
    system = sd.System("pushed", gravity=[0, -g])
    body = system.add_body("box", mass=m, inertia=0.1)
    system.add_joint(sd.Planar("free", system.ground, body, sd.coordinates("x y theta")))
    system.add_force(body, [rate * sd.t, 0])
    system.add_contact(sd.Contact("corner", body, system.ground, shape=sd.contacts.Box([0.4, 0.2]), friction=(static, kinetic)))
    start = static * m * g / rate
    pushed = rate * (end**3 - start**3) / 6 - rate * start**2 * (end - start) / 2
    reached = (pushed - kinetic * m * g * (end - start) ** 2 / 2) / m
    run = system.compile().simulate((0, end), q={"y": 0.1}, method="moreau", step=1e-2)
    assert abs(run["x"][-1] - reached) < 1e-4
    assert [run.contacts[f"corner_{k}"].mode[-1] for k in (1, 3)] == ["sliding"] * 2
    with pytest.raises(ArgumentError, match="pushed: there is no contact 'corner'; did you mean corner_"):
        run.contacts["corner"]
    held = run.t < start - 0.02
    for k in (1, 3):
        assert set(np.array(run.contacts[f"corner_{k}"].mode)[held][1:]) == {"sticking"}


def test_constraints_go_along_in_the_step() -> None:
    """A pendulum of a constraint that strikes a wall."""
    x, y = sd.coordinates("x y")
    system = sd.System("striker", gravity=[0, -G])
    cart, bob = system.add_body("cart"), system.add_body("bob", mass=1.0)
    system.add_joint(sd.Prismatic("along", system.ground, cart, axis=[1, 0], coordinate=x))
    system.add_joint(sd.Prismatic("across", cart, bob, axis=[0, 1], coordinate=y))
    system.add_constraint(x**2 + y**2 - 1)
    system.add_contact(sd.Contact("wall", bob, system.ground, restitution=0.5,
                                  shape=(sd.contacts.Point(), sd.contacts.Plane([1, 0], [0, 0]))))
    module = system.compile()
    with pytest.raises(ArgumentError, match="projects onto the constraints; leave out stabilization"):
        module.simulate((0, 1), q=[1.0, 0.0], method="moreau", step=1e-3, stabilization=("baumgarte", 5.0))
    t = np.linspace(0, 1.2, 121)
    located = module.simulate(t, q=[1.0, 0.0], rtol=1e-10)
    solution = module.simulate(t, q=[1.0, 0.0], method="moreau", step=1e-4)
    np.testing.assert_allclose(np.hypot(*solution.q.T), 1, atol=1e-11)
    np.testing.assert_allclose((solution.q * solution.u).sum(axis=1), 0, atol=1e-9)
    assert solution["x"].min() > -1e-11
    np.testing.assert_allclose(solution.q, located.q, atol=2e-3)


def test_steps_are_halved_until_the_coordinates_agree() -> None:
    t = np.linspace(0, 1.5, 31)
    solution = ball().simulate(t, q=[1.0], method="moreau", rtol=2e-3)
    assert solution.stepped is not None
    assert np.abs(solution.q[:, 0] - bounced(t, 0.8)).max() < 10 * solution.stepped.estimate
    assert 0 < solution.stepped.estimate <= 4e-3
    with pytest.warns(SimulationWarning, match="the coordinates differ by .* from those with twice the step, above rtol"):
        coarse = ball().simulate(t, q=[1.0], method="moreau", rtol=1e-6, max_steps=200)
    assert coarse.stepped is not None and coarse.stepped.estimate > 1e-6


def test_inputs_vary_over_time() -> None:
    y, force = sd.coordinates("y"), sd.inputs("F")
    system = sd.System("pressed", gravity=[0, -G])
    body = system.add_body("body", mass=1.0)
    system.add_joint(sd.Prismatic("height", system.ground, body, axis=[0, 1], coordinate=y))
    system.add_force(body, [0, force])
    system.add_contact(sd.Contact("floor", body, system.ground))
    module = system.compile()
    solution = module.simulate((0, 1), inputs=lambda t, x: [30 * t], method="moreau", step=1e-3)
    lifts = G / 30
    np.testing.assert_allclose(solution["y"], np.where(solution.t > lifts, 5 * (solution.t - lifts)**3, 0), atol=1e-5)
    floor = solution.contacts["floor"]
    assert floor.mode[0] == "sliding" and floor.mode[-1] == "open"

    def broken(t: float, x: np.ndarray) -> list[float]:
        raise RuntimeError("no signal")

    with pytest.warns(SimulationWarning, match="no signal"):
        assert not module.simulate((0, 1), inputs=broken, method="moreau", step=1e-3).success


def test_quantities_along_the_motion_know_the_contacts() -> None:
    solution = block(0.5, np.radians(20)).simulate((0, 0.1), q={"y": 0.1}, method="moreau", step=0.01)
    np.testing.assert_allclose(solution.rows("rhs")[:, 3:], 0, atol=1e-6)  # at rest, not falling


def test_what_does_not_fit_is_rejected() -> None:
    module = ball()
    for options, message in (
            ({}, r"pass step=1e-3 \(in s\), or a tolerance such as rtol=1e-3"),
            ({"step": -1.0}, "step must be a positive number of seconds"),
            ({"step": 1e-3, "max_step": 1e-3}, "pass it as step, not as max_step or first_step"),
            ({"step": 1e-3, "t": (1, 0)}, "do not run backward in time")):
        with pytest.raises(ArgumentError, match=message):
            module.simulate(**{"t": (0, 1), "q": [1.0], "method": "moreau", **options})
    with pytest.raises(ArgumentError, match="step is the length of the steps of method='moreau'"):
        module.simulate((0, 1), q=[1.0], step=1e-3)
    with pytest.raises(ArgumentError, match="overlap"):
        module.simulate((0, 1), q=[-1.0], method="moreau", step=1e-3)
    with pytest.raises(ArgumentError, match="for rigid contacts, of which there are none"):
        sd.systems.pendulum().compile().simulate((0, 1), method="moreau", step=1e-3)
    with pytest.warns(SimulationWarning, match="20 steps were done, as asked"):
        assert len(module.simulate((0, 1), q=[1.0], method="moreau", step=1e-2, max_steps=20).t) == 21
    system, body, x = slider("counted")
    system.add_contact(sd.Contact("sole", body, system.ground))
    system.add_event("early", x + 1)
    system.add_event("late", x - 1)
    counted = system.compile()
    with pytest.raises(ArgumentError, match="method='moreau' does not locate events, such as late; pass events=False"):
        counted.simulate((0, 1), u=[1.0, 0.0], method="moreau", step=1e-2, events="late")
    assert counted.simulate((0, 1), u=[1.0, 0.0], method="moreau", step=1e-2, events=False).success
    numpy = sd.systems.pendulum().compile(backend="numpy")
    with pytest.raises(ArgumentError, match="method='moreau' steps in compiled C; this module runs on numpy"):
        numpy.simulate((0, 1), method="moreau", step=1e-3)
    solution = module.simulate((0, 1), q=[1.0], method="moreau", step=1e-2)
    with pytest.raises(ArgumentError, match="has states at the ends of its steps"):
        solution(0.123)


def test_other_laws_of_impacts_are_rejected() -> None:
    """Impulses by Newton's law alone would be wrong without a word."""
    module = by_poisson()
    with pytest.raises(ArgumentError, match="has Newton's law of impacts; floor has impact='poisson': pass impact='newton'"):
        module.simulate((0, 1), q=[1.0], method="moreau", step=1e-3)


def test_a_step_that_is_too_long_is_reported() -> None:
    y = sd.coordinates("y")
    system = sd.System("stiff", gravity=[0, -G])
    body = system.add_body("body", mass=1.0)
    system.add_joint(sd.Prismatic("height", system.ground, body, axis=[0, 1], coordinate=y))
    system.add_force(body, [0, -1e8 * (y - 1)])
    system.add_contact(sd.Contact("floor", body, system.ground))
    with pytest.warns(SimulationWarning, match="not solved by iteration: it is too long for the stiffness|not finite"):
        stopped = system.compile().simulate((0, 1), q=[1.1], method="moreau", step=1e-2)
    assert not stopped.success and len(stopped.t) >= 1
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert ball().simulate((0, 1), q=[1.0], method="moreau", step=0.5).success


def test_auto_takes_time_stepping_where_switches_come_faster_than_one_in_a_step() -> None:
    y = sd.coordinates("y")
    system = sd.System("rattle", gravity=[0, -10])
    body = system.add_body("ball", mass=1.0)
    system.add_joint(sd.Prismatic("height", system.ground, body, axis=[0, 1], coordinate=y))
    system.add_contact(sd.Contact("floor", body, system.ground, restitution=1))
    module = system.compile()
    slow = module.simulate((0, 2), q=[5e-4], method="auto", step=2e-3)  # flights of 0.02 s
    assert slow.stepped is None and len(slow.contacts["floor"].impacts.t) == 100
    quick = module.simulate((0, 5), q=[5e-6], method="auto", step=1e-2)  # of 0.002 s
    assert quick.stepped is not None and quick.method == "moreau" and quick.success
    assert "200 switches of contacts until t = 0.399 s came within 0.398 s, faster than one in a step of 0.01 s" in quick.why
    with pytest.raises(ArgumentError, match="moreau"):
        by_poisson().simulate((0, 1), q=[1.0], method="auto", step=1e-3)
    with pytest.raises(ArgumentError, match="which method='auto' takes where switches of contacts come faster"):
        module.simulate((0, 1), q=[1.0], method="dop853", step=1e-3)


def by_poisson() -> Module:
    """A ball whose impacts follow Poisson's law."""
    system = sd.System("ball", gravity=[0, -G])
    body = system.add_body("body", mass=1.0)
    system.add_joint(sd.Prismatic("height", system.ground, body, axis=[0, 1], coordinate=sd.coordinates("y")))
    system.add_contact(sd.Contact("floor", body, system.ground, restitution=0.5, impact="poisson"))
    return system.compile()


@functools.cache
def two_spheres() -> Module:
    system = sd.System("two", gravity=[0, 0])
    one, two = (system.add_body(name, mass=1, inertia=0.01) for name in ("one", "two"))
    for body in (one, two):
        system.add_joint(sd.Planar(f"of_{body.name}", system.ground, body))
    sphere = sd.contacts.Sphere(0.05)
    system.add_contact(sd.Contact("hit", one, two, shape=(sphere, sphere), restitution=0.5))
    return system.compile()


@pytest.mark.parametrize(("speed", "aside", "step", "leaps"), [
    (60.0, 0.0, 1e-2, True), (60.0, 0.02, 1e-2, True),  # 0.6 m in a step, over a sphere of 0.1 m
    (60.0, 0.12, 1e-2, False),                          # past it
    (60.0, 0.0, 1e-4, False), (6.0, 0.0, 1e-2, False)])
def test_a_step_that_leaps_over_a_contact_is_warned_of(speed: float, aside: float, step: float, leaps: bool) -> None:
    with warnings.catch_warnings(record=True) as given:
        warnings.simplefilter("always")
        solution = two_spheres().simulate((0, 3 / speed), q=[-0.31, aside, 0, 0, 0, 0], u=[speed, 0, 0, 0, 0, 0],
                                          method="moreau", step=step)
    messages = [str(one.message) for one in given]
    assert any("the bodies of contact hit passed through each other" in text for text in messages) == leaps, messages
    hit = not leaps and not aside
    np.testing.assert_allclose(solution.u[-1, [0, 3]], [speed / 4, 3 * speed / 4] if hit else [speed, 0], rtol=1e-9, atol=1e-12)
