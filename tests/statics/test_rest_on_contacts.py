"""States of rest on rigid contacts, and linear equations within a mode, against closed forms."""

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest
import sympy as sp

import symdyn as sd
from symdyn.backend.metadata import ContactRecord
from symdyn.contact_kinds import BODIES
from symdyn.errors import ArgumentError, NoEquilibrium
from symdyn.runtime.integrating.contacts import Numbers
from symdyn.statics.contact_rest import _Forces
from tests.helpers import swept

G = 9.81
TILT, MU, FORCE, STIFFNESS = sd.parameters("tilt mu force stiffness")


@pytest.fixture(scope="module")
def box() -> Any:
    """A box of 0.4 m by 0.2 m and 2 kg on a slope."""
    system = sd.System("box", gravity=[G * sp.sin(TILT), -G * sp.cos(TILT)])
    system.defaults.update({TILT: 0.2, MU: 0.5, FORCE: 0.0})
    body = system.add_body("box", mass=2.0, inertia=0.03)
    system.add_joint(sd.Planar("free", system.ground, body, sd.coordinates("x y theta")))
    system.add_force(body, [FORCE, 0], point=[0, 0.05])
    system.add_contact(sd.Contact("corner", body, system.ground, shape=sd.contacts.Box([0.4, 0.2]), friction=MU))
    return system.compile()


def test_box_sticks_on_a_slope_up_to_the_angle_of_friction(box: Any) -> None:
    found = box.rest({"y": 0.1})
    assert found.carrying == ("corner_1", "corner_3") and not found.unique
    least, most = found.range(TILT)
    assert [least, most] == pytest.approx([-np.arctan(0.5), np.arctan(0.5)], rel=1e-12)
    assert found.range("mu") == (pytest.approx(np.tan(0.2), rel=1e-12), np.inf)
    # Friction of both corners tilts the box: the normal forces are unique, how friction is shared is not.
    weight, lever = 2 * G, 0.1 * np.tan(0.2) / 0.4
    normal = [found.contacts[name].force[0] for name in ("corner_1", "corner_3")]
    assert sorted(normal) == pytest.approx(weight * np.cos(0.2) * np.array([0.5 - lever, 0.5 + lever]), rel=1e-12)
    assert all(one.least == pytest.approx(one.most, rel=1e-9) for one in found.contacts.values())
    friction = sum(found.contacts[name].force[1] for name in ("corner_1", "corner_3"))
    assert friction == pytest.approx(-weight * np.sin(0.2), rel=1e-12)
    assert all(abs(one.force[1]) <= 0.5 * one.force[0] * (1 + 1e-12) for one in found.contacts.values())
    assert found["x"] == 0 and found["mu"] == 0.5
    assert "at rest on corner_1, corner_3, forces not unique" in repr(found)


@pytest.mark.parametrize("mu", [0.6, 1.5])
def test_pushed_box_slides_or_tips_over(box: Any, mu: float) -> None:
    """The force 0.15 m above the ground slides it from mu m g on, or tips it over its edge from m g 0.2/0.15 on."""
    found = box.rest({"y": 0.1}, {"tilt": 0.0, "mu": mu})
    limit = min(mu * 2 * G, 2 * G * 0.2 / 0.15)
    assert found.range("force") == (pytest.approx(-limit, rel=1e-12), pytest.approx(limit, rel=1e-12))


@pytest.mark.parametrize("graph", [*swept([sd.contacts.Bore(1.0, [0, 1])]),
                                   sd.contacts.Curve(1 - sp.sqrt(1 - sp.Symbol("x")**2), sp.Symbol("x"))])
def test_ball_in_a_bowl_that_is_tilted_rolls_to_where_it_rests(graph: Any) -> None:
    """At (R - r) sin(tilt) from the middle of the bowl, turned by the way over its radius, wherever the search begins."""
    system = sd.System("bowl", gravity=[G * sp.sin(TILT), -G * sp.cos(TILT)])
    system.defaults[TILT] = 0.3
    ball = system.add_body("ball", mass=0.5, inertia=0.0025)
    system.add_joint(sd.Planar("free", system.ground, ball, sd.coordinates("x y theta")))
    system.add_contact(sd.Contact("bowl", ball, system.ground, shape=(sd.contacts.Sphere(0.1), graph), friction=0.5))
    module = system.compile()
    at = 0.9 * np.sin(0.3)
    for begin in (0.05, at - 1e-3, at - 1e-6, at):
        found = module.rest({"x": begin, "y": 1 - np.sqrt(0.9**2 - begin**2)})
        assert found.x[:2] == pytest.approx([at, 1 - 0.9 * np.cos(0.3)], abs=1e-12) and found.verdict == "neutral"


def test_box_on_one_corner_is_an_unstable_equilibrium(box: Any) -> None:
    """The rocking frequency about a corner: m g R/(I + m R^2), with the centre above it."""
    reach = np.hypot(0.2, 0.1)
    start = {"y": reach, "theta": np.arctan2(0.2, 0.1) - 1e-3}
    found = box.rest(start, {"tilt": 0.0, "mu": 0.5}, contacts={"corner_3": "sticking"})
    assert found.unique and found.carrying == ("corner_3",)
    assert abs(found["theta"]) == pytest.approx(np.arctan2(0.2, 0.1), abs=1e-10)
    assert found.verdict == "unstable"
    rate = np.sqrt(2 * G * reach / (0.03 + 2 * reach**2))
    assert np.sort(found.linear.eigenvalues.real) == pytest.approx([-rate, rate], rel=1e-10)


def test_states_that_do_not_stay_at_rest_are_reported(box: Any) -> None:
    with pytest.raises(NoEquilibrium, match=r"its contacts would need more friction than they have \(corner_1: .* N of .* N\)"):
        box.rest({"y": 0.1}, {"tilt": 0.6})
    with pytest.raises(NoEquilibrium, match=r"its contacts would pull \(corner_1 by .* N\)"):
        box.rest({"y": 0.1}, {"tilt": 0.0, "mu": 1.5, "force": 30.0})
    with pytest.raises(NoEquilibrium, match=r"no state of rest with these contacts: what accelerates is y_dot by -9.81"):
        box.rest({"y": 1.0}, {"tilt": 0.0})
    with pytest.raises(ArgumentError, match=r"a range of 'nu' was requested; there are tilt, force, mu"):
        box.rest({"y": 0.1}).range("nu")
    with pytest.raises(ArgumentError, match=r"has no 'nu'; it has x, y, theta"):
        box.rest({"y": 0.1})["nu"]
    with pytest.raises(ArgumentError, match=r"has no rigid contacts; take module.equilibrium\(...\)"):
        sd.systems.pendulum().compile(backend="numpy").rest()
    system = sd.System("pulled", gravity=[0, 0])
    body = system.add_body("body", mass=1.0)
    system.add_joint(sd.Prismatic("height", system.ground, body, axis=[0, 1], coordinate=sd.coordinates("y")))
    system.add_spring_damper(system.ground, body, point_a=[0, -2], stiffness=5.0, length=1)
    system.add_contact(sd.Contact("floor", body, system.ground))
    pulled = system.compile(backend="numpy")
    with pytest.raises(NoEquilibrium, match="at rest contacts floor would overlap; name them in contacts"):
        pulled.rest({"y": 1.0})
    assert pulled.rest({"y": 1e-9}).contacts["floor"].force == pytest.approx([5.0])


def feet(legs: int, push: float, mu: float = 0.4) -> _Forces:
    """Forces of legs on a circle of 0.5 m under a weight of 30 N at (0.1, 0), pushed along x near the ground."""
    angles = 2 * np.pi * np.arange(legs) / legs
    J = np.zeros((3 * legs, 6))
    for k, (x, y) in enumerate(0.5 * np.column_stack([np.cos(angles), np.sin(angles)])):
        J[3 * k:3 * k + 3] = [[0, 0, 1, y, -x, 0], [1, 0, 0, 0, 0, -y], [0, 1, 0, 0, 0, x]]
    load = np.array([push, 0, -30, 0, 30 * 0.1, 0])
    n = 3 * legs
    none, rough, still = np.zeros(legs), np.full(legs, mu), np.zeros(n)
    at = Numbers(none, rough, rough, none, still, J @ load, still, J @ J.T, J.T, J.T)
    records = [ContactRecord(f"leg_{k}", f"leg_{k}", 3, "", "", (), (), "newton", BODIES, True) for k in range(legs)]
    return _Forces(cast(Any, SimpleNamespace(metadata=SimpleNamespace(contacts=records))), at, range(n))


def test_three_legs_carry_by_levers_and_four_in_ranges() -> None:
    """Three: N of the leg at 0 is m g (1/3 + 2 x/(3 r)). Four: N0 - N2 = 6 N, N1 = N3, the sum is 30 N. The forces reach 12 N."""
    three = feet(3, 0.0)
    assert three.slack() > 0
    assert three.extreme(0, 1.0) == pytest.approx(30 * (1 / 3 + 2 * 0.1 / (3 * 0.5)), rel=1e-9)
    assert three.extreme(0, -1.0) == pytest.approx(three.extreme(0, 1.0), rel=1e-9)
    four = feet(4, 0.0)
    assert four.slack() > 0
    ranges = [[four.extreme(3 * k, side) for side in (1.0, -1.0)] for k in range(4)]
    assert np.abs(np.array(ranges) - [[6, 18], [0, 12], [0, 12], [0, 12]]).max() < 1e-8
    assert feet(4, 12 - 1e-5).slack() > 0 > feet(4, 12 + 1e-5).slack()
    assert feet(3, 12 - 1e-5).slack() > 0 > feet(3, 12 + 1e-5).slack()


@pytest.fixture(scope="module")
def swing() -> Any:
    """A rod on its foot, held up by a spring."""
    system = sd.System("rod", gravity=[0, -G])
    system.defaults[STIFFNESS] = 60.0
    body = system.add_body("rod", mass=2.0, inertia=0.1)
    system.add_joint(sd.Planar("free", system.ground, body, sd.coordinates("x y theta")))
    system.add_spring_damper(system.ground, body, point_a=[-1, 0.5], stiffness=STIFFNESS, length=1, damping=0.4)
    system.add_contact(sd.Contact("foot", body, system.ground, shape=sd.contacts.Point([0, -0.5]), friction=0.4))
    system.add_contact(sd.Contact("plate", body, system.ground, shape=(sd.contacts.Point(), sd.contacts.Plane([0, -1], [0, 3]))))
    return system.compile()


def test_linear_equations_of_a_sticking_foot_are_those_of_a_hinge(swing: Any) -> None:
    hinged = sd.System("hinged", gravity=[0, -G])
    body = hinged.add_body("rod", mass=2.0, inertia=0.1, com=[0, 0.5])
    hinged.add_joint(sd.Revolute("hinge", hinged.ground, body, sd.coordinates("theta")))
    hinged.add_spring_damper(hinged.ground, body, point_a=[-1, 0.5], point_b=[0, 0.5], stiffness=60.0, length=1, damping=0.4)
    expected = hinged.compile().linearize([0.0, 0.0])
    found = swing.linearize({"y": 0.5}, contacts={"foot": "sticking"})
    assert found.eigenvalues == pytest.approx(expected.eigenvalues, rel=1e-10)
    named = swing.linearize({"y": 0.5}, contacts={"foot": "sticking"}, coordinates=["theta"])
    assert pytest.approx(expected.A, rel=1e-10) == named.A
    sliding = swing.linearize({"y": 0.5}, contacts={"foot": ("sliding", 1)})
    assert sliding.coordinates == ("x", "theta")
    at = swing.rest({"y": 0.5})
    assert at.linear.eigenvalues == pytest.approx(expected.eigenvalues, rel=1e-10) and at.verdict == "stable"


def test_linear_equations_in_sliding_follow_the_flow_in_that_mode(swing: Any) -> None:
    """In motion: differences of the accelerations with the foot on the ground, by x, theta and their rates."""
    def state(y: np.ndarray) -> np.ndarray:
        x, theta, x_dot, theta_dot = y
        return np.array([x, 0.5 * np.cos(theta), theta, x_dot, -0.5 * np.sin(theta) * theta_dot, theta_dot])

    start = np.array([0.1, 0.2, 0.7, 0.3])
    linear = swing.linearize(state(start), contacts={"foot": "sliding"}, coordinates=["x", "theta"])
    assert linear.states == ("x", "theta", "x_dot", "theta_dot")
    step, expected = 1e-3, np.zeros((4, 4))
    for k in range(4):
        rates = [swing.rhs(0.0, state(start + j * step * np.eye(4)[k]), linear.params)[[0, 2, 3, 5]]
                 for j in (1, 2, 3, -1, -2, -3)]
        expected[:, k] = (45 * (rates[0] - rates[3]) - 9 * (rates[1] - rates[4]) + rates[2] - rates[5]) / (60 * step)
    assert pytest.approx(expected, rel=1e-9, abs=1e-9) == linear.A


def test_modes_that_do_not_fit_are_rejected(swing: Any) -> None:
    at = {"y": 0.5}
    for contacts, message in (
            ({"foots": "sticking"}, "there is no rigid contact 'foots'; did you mean foot"),
            ({"x": "sticking"}, "there is no rigid contact 'x'; there are foot, plate"),
            ({"foot": "stuck"}, "the mode of contact foot is 'stuck'; there are 'open', 'sticking', 'sliding'"),
            ({"foot": "sliding"}, "contact foot is to slide, but it does not slip"),
            ({"plate": "sliding"}, "contact plate is to be sliding, but its gap is 2.5 m"),
            ("sticking", "contacts is 'sticking'; pass a mapping such as")):
        with pytest.raises(ArgumentError, match=message):
            swing.linearize(at, contacts=contacts)
    with pytest.raises(ArgumentError, match="contacts touch here: foot; pass in which modes they are"):
        swing.linearize(at)
    assert len(swing.linearize(at, contacts={}).states) == 6
    with pytest.raises(ArgumentError, match="a state of rest on contacts has its own parameters"):
        swing.linearize(swing.rest(at), params={"stiffness": 1.0})
