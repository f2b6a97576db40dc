"""Stops, backlash, one-way clutches and dry friction of joints, and ropes, against closed forms."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import sympy as sp

import symdyn as sd
from symdyn.errors import ModelError
from symdyn.model.contacts.lowering import with_contacts

G = 9.81


def rotors(*inertias: float) -> sd.System:
    """Bodies that turn about z, on joints a, b, ..."""
    system = sd.System("rotors")
    for name, inertia in zip("ab", inertias, strict=False):
        body = system.add_body(f"body_{name}", mass=1.0, inertia=[1, 1, inertia])
        system.add_joint(sd.Revolute(name, system.ground, body, coordinate=sd.coordinates(f"q_{name}")))
    return system


@pytest.mark.every_value
@pytest.mark.parametrize("side", ["lower", "upper"])
@pytest.mark.parametrize("formulation", ["embedding", "recursive", "absolute"])
def test_rotor_bounces_on_its_stop_and_comes_to_rest(side: str, formulation: str) -> None:
    """Under a constant torque the times are those of a ball, 2 v/a with v = e^n sqrt(2 a s); their limit is at rest."""
    sign, torque, inertia, e = (1 if side == "lower" else -1), 2.0, 0.5, 0.6
    system = rotors(inertia)
    system.add_joint_force("a", -sign * torque)
    system.add_contact(sd.Stop("knee", "a", **{side: sign * 0.2}, restitution=e))
    system.initial[system.joints[0].coordinates[0]] = sign * 1.2
    absolute = formulation == "absolute"
    equations = system.augmented(coordinates="absolute") if absolute else getattr(system, formulation)()
    solution = equations.compile().simulate((0, 5), rtol=1e-12)
    stop, a = solution.contacts[f"knee_{side}"], torque / inertia
    speed = np.sqrt(2 * a)
    times = speed / a + np.cumsum([0, *[2 * speed * e**n / a for n in range(1, 12)]])
    assert np.abs(stop.impacts.t[:12] - times).max() < 1e-11
    assert stop.impacts.impulse[0, 0] == pytest.approx(inertia * speed * (1 + e), rel=1e-10)
    assert stop.rests[0] == pytest.approx(speed / a + 2 * speed * e / a / (1 - e), abs=1e-10)
    assert stop.mode[-1] == "closed" and stop.mode[0] == "open"
    assert stop.force[-1] == pytest.approx([torque])
    assert stop.gap[0] == pytest.approx(1.0) and abs(stop.gap[-1]) < 1e-12


def test_one_way_clutch_turns_on_and_locks() -> None:
    """Under A cos t a rotor turns with A/I sin t until it stands, is held, and begins again with A/I (1 + sin t)."""
    A, inertia = 3.0, 0.5
    system = rotors(inertia)
    system.add_joint_force("a", A * sp.cos(sd.t))
    system.add_contact(sd.OneWayClutch("freewheel", "a"))
    t = np.linspace(0, 10, 401)
    solution = system.compile().simulate(t, rtol=1e-12)
    clutch = solution.contacts["freewheel"]
    assert [mode for _, mode in clutch.switches] == ["open", "closed", "open"]
    assert np.abs(np.array([at for at, _ in clutch.switches]) - [0, np.pi, 1.5 * np.pi]).max() < 1e-10
    speed = A / inertia * np.where(t < np.pi, np.sin(t), np.where(t < 1.5 * np.pi, 0.0, 1 + np.sin(t)))
    assert np.abs(solution.u[:, 0] - speed).max() < 1e-9
    held = (t > np.pi + 1e-3) & (t < 1.5 * np.pi - 1e-3)
    assert clutch.force[held, 0] == pytest.approx(-A * np.cos(t[held]), abs=1e-9)


def test_one_way_clutch_between_two_rotors_takes_them_along_and_locks_at_the_start() -> None:
    """The driven rotor is never slower: at the start both get the speed of the common angular momentum, then share the torque."""
    system = rotors(0.5, 1.5)
    system.add_joint_force("b", 4.0)
    system.add_contact(sd.OneWayClutch("freewheel", "a", "b"))
    solution = system.compile().simulate((0, 1), u=[1.0, 3.0], rtol=1e-12)
    common = (0.5 * 1.0 + 1.5 * 3.0) / 2
    assert solution.contacts["freewheel"].impacts.impulse[0, 0] == pytest.approx(0.5 * (common - 1.0), rel=1e-12)
    assert solution.u[-1] == pytest.approx([common + 2.0] * 2, rel=1e-11)
    assert solution.contacts["freewheel"].force[-1, 0] == pytest.approx(4.0 * 0.5 / 2)
    free = system.compile().simulate((0, 0.5), u=[9.0, 3.0], rtol=1e-12)
    assert free.u[-1] == pytest.approx([9.0, 3.0 + 4.0 * 0.5 / 1.5], rel=1e-12)


def test_other_impacts_lock_a_clutch() -> None:
    """A rotor that hits an elastic stop would turn back; its clutch holds it there, with the impulse of expansion."""
    system = rotors(0.5)
    system.add_contact(sd.Stop("end", "a", upper=1.0, restitution=1.0, impact="poisson"))
    system.add_contact(sd.OneWayClutch("freewheel", "a"))
    solution = system.compile().simulate((0, 2), u=[2.0], rtol=1e-12)
    assert solution.q[-1, 0] == pytest.approx(1.0, abs=1e-12)
    assert solution.u[-1, 0] == pytest.approx(0.0, abs=1e-12)
    assert solution.contacts["end_upper"].impulse[-1, 0] == pytest.approx(2 * 0.5 * 2.0)
    assert solution.contacts["freewheel"].impulse[-1, 0] == pytest.approx(0.5 * 2.0)


def test_backlash_passes_impacts_and_keeps_angular_momentum() -> None:
    """Between elastic sides the relative speed stays, so that a side is met every width/speed; ratio 2 of the transmission."""
    I_1, I_2, ratio, width, w = 0.5, 1.5, 2.0, 0.1, 3.0
    system = rotors(I_1, I_2)
    system.add_contact(sd.Backlash("gear", "a", "b", width=width, ratio=ratio, restitution=1.0))
    solution = system.compile().simulate((0, 0.5), u=[w, 0.0], rtol=1e-12)
    lower, upper = (solution.contacts[f"gear_{side}"] for side in ("lower", "upper"))
    period = width / w
    assert upper.impacts.t == pytest.approx(period / 2 + 2 * period * np.arange(len(upper.impacts.t)), abs=1e-11)
    assert lower.impacts.t == pytest.approx(period / 2 + period + 2 * period * np.arange(len(lower.impacts.t)), abs=1e-11)
    assert len(upper.impacts.t) == 8
    momentum = I_1 * ratio * solution.u[:, 0] + I_2 * solution.u[:, 1]
    assert np.abs(momentum - I_1 * ratio * w).max() < 1e-12
    assert solution.energy == pytest.approx(np.full(len(solution.t), I_1 * w**2 / 2), rel=1e-12)
    assert min(lower.gap.min(), upper.gap.min()) > -1e-12


@pytest.mark.parametrize("method", [None, "moreau"])
def test_rope_whose_ends_start_at_one_point_becomes_taut(method: str | None) -> None:
    """Two bodies fly apart until the rope jerks: the impulse (1 + e) v m_1 m_2/(m_1 + m_2) along it, v across it stays."""
    masses, length, e = (1.0, 3.0), 2.0, 0.5
    system = sd.System("pair", gravity=[0, 0])
    for name, mass in zip("ab", masses, strict=True):
        body = system.add_body(name, mass=mass, inertia=0.1)
        system.add_joint(sd.Planar(f"free_{name}", system.ground, body, sd.coordinates(f"x_{name} y_{name} angle_{name}")))
    system.add_contact(sd.Rope("rope", "a", "b", length=length, restitution=e))
    start = np.array([1.0, 0.5, 0, -1.0, 0.2, 0])
    apart = start[:2] - start[3:5]
    speed = np.linalg.norm(apart)
    more = {} if method is None else {"method": method, "step": 1e-3}
    solution = system.compile().simulate((0, 1.5), u=start, **more)
    rope, impulse = solution.contacts["rope"], (1 + e) * speed * masses[0] * masses[1] / sum(masses)
    assert rope.impacts.t == pytest.approx([length / speed], abs=1e-12 if method is None else 1.1e-3)
    assert rope.impacts.impulse[0, 0] == pytest.approx(impulse, rel=1e-12 if method is None else 1e-9)
    after = start.copy()
    after[:2] -= impulse / masses[0] * apart / speed
    after[3:5] += impulse / masses[1] * apart / speed
    assert solution.u[-1] == pytest.approx(after, abs=1e-11 if method is None else 1e-9)


def test_rope_becomes_taut_and_leads_around() -> None:
    """A point flies straight on until the rope is taut; what is left of its speed is across, and the tension m v^2/L."""
    length, height, speed, mass = 2.0, 1.2, 3.0, 0.7
    system = sd.System("tether", gravity=[0, 0])
    body = system.add_body("ball", mass=mass, inertia=0.0)
    slide = system.add_body("slide")
    system.add_joint(sd.Prismatic("along", system.ground, slide, axis=[1, 0], coordinate=sd.coordinates("x")))
    system.add_joint(sd.Prismatic("across", slide, body, axis=[0, 1], coordinate=sd.coordinates("y")))
    system.add_contact(sd.Rope("rope", body, system.ground, length=length))
    solution = system.compile().simulate((0, 3), q=[0, height], u=[speed, 0], rtol=1e-12)
    rope = solution.contacts["rope"]
    taut = np.sqrt(length**2 - height**2) / speed
    assert rope.impacts.t == pytest.approx([taut], abs=1e-11)
    across = speed * height / length
    assert rope.force[-1, 0] == pytest.approx(mass * across**2 / length, rel=1e-9)
    assert rope.mode[0] == "open" and rope.mode[-1] == "closed"
    angle = np.arctan2(height, speed * taut) - across / length * (3 - taut)
    assert solution.q[-1] == pytest.approx(length * np.array([np.cos(angle), np.sin(angle)]), abs=1e-9)
    assert np.abs(np.hypot(*solution.q.T)[solution.t > taut] - length).max() < 1e-11


def test_oscillator_with_dry_friction_loses_the_same_amplitude_in_every_half_period_and_sticks() -> None:
    """Amplitudes fall by 2 F/k in every half period pi/w, until the spring no longer breaks it away (Coulomb)."""
    mass, k, F, breakaway, start = 2.0, 50.0, 1.5, 3.0, 0.5
    x = sd.coordinates("x")
    system = sd.System("oscillator")
    body = system.add_body("body", mass=mass)
    system.add_joint(sd.Prismatic("rail", system.ground, body, coordinate=x))
    system.add_joint_force("rail", -k * x)
    system.add_contact(sd.JointFriction("friction", "rail", breakaway=breakaway, sliding=F))
    solution = system.compile().simulate((0, 20), q=[start], rtol=1e-12)
    friction, half = solution.contacts["friction"], np.pi * np.sqrt(mass / k)
    amplitudes = [start]
    while k * abs(amplitudes[-1]) > breakaway:
        amplitudes.append(-np.sign(amplitudes[-1]) * (abs(amplitudes[-1]) - 2 * F / k))
    stops = half * np.arange(1, len(amplitudes))
    assert solution.q[-1, 0] == pytest.approx(amplitudes[-1], abs=1e-11)
    assert friction.switches[-1][0] == pytest.approx(stops[-1], abs=1e-9)
    assert friction.switches[-1][1] == "sticking" and len(stops) == 8
    assert friction.force[-1, 0] == pytest.approx(k * amplitudes[-1])
    assert np.abs(solution.u[solution.t > stops[-1], 0]).max() == 0.0


def test_locked_joint_breaks_away_at_its_torque() -> None:
    """Under 3 t - 1 it brakes from -1 until 1.5 t^2 = 1, sticks, and breaks away where 3 t - 1 = 2."""
    system = rotors(1.0)
    system.add_joint_force("a", 3 * sd.t - 1)
    system.add_contact(sd.JointFriction("brake", "a", breakaway=2.0, sliding=1.0))
    solution = system.compile().simulate((0, 2), u=[-1.0], rtol=1e-12)
    brake = solution.contacts["brake"]
    assert [mode for _, mode in brake.switches] == ["sliding", "sticking", "sliding"]
    assert np.abs(np.array([t for t, _ in brake.switches]) - [0, np.sqrt(2 / 3), 1.0]).max() < 1e-10
    assert solution.u[-1, 0] == pytest.approx(1.5 * 3 - 2.0, rel=1e-11)
    assert brake.force[[0, -1], 0] == pytest.approx([1.0, -1.0])


def test_friction_of_a_clutch_between_two_rotors_brings_them_to_one_speed() -> None:
    """The relative speed falls with F (1/I_1 + 1/I_2); then both keep the speed of the common angular momentum."""
    I_1, I_2, F, w = 0.5, 1.5, 2.0, 6.0
    system = rotors(I_1, I_2)
    system.add_contact(sd.JointFriction("disc", "a", breakaway=F, other="b"))
    solution = system.compile().simulate((0, 2), u=[w, 0.0], rtol=1e-12)
    disc = solution.contacts["disc"]
    assert disc.switches[1][0] == pytest.approx(w / (F * (1 / I_1 + 1 / I_2)), abs=1e-11)
    assert disc.switches[1][1] == "sticking"
    assert solution.u[-1] == pytest.approx([I_1 * w / (I_1 + I_2)] * 2, rel=1e-12)


def test_friction_of_a_joint_holds_along_with_contacts_and_impacts() -> None:
    """A slider that brakes on its rail until it hits an end: v^2 = v_0^2 - 2 a s, back with e v, and at rest by friction."""
    mass, F, e, start, way = 2.0, 1.0, 0.5, 3.0, 1.0
    system = sd.System("slider")
    body = system.add_body("body", mass=mass)
    system.add_joint(sd.Prismatic("rail", system.ground, body, coordinate=sd.coordinates("x")))
    system.add_contact(sd.JointFriction("friction", "rail", breakaway=F))
    system.add_contact(sd.Stop("end", "rail", upper=way, restitution=e))
    solution = system.compile().simulate((0, 10), u=[start], rtol=1e-12)
    v = np.sqrt(start**2 - 2 * F / mass * way)
    assert solution.contacts["end_upper"].impacts.t == pytest.approx([(start - v) / (F / mass)], abs=1e-11)
    assert solution.q[-1, 0] == pytest.approx(way - (e * v) ** 2 / (2 * F / mass), abs=1e-10)
    assert solution.contacts["friction"].mode[-1] == "sticking"


@pytest.mark.parametrize("max_steps", [None, 100_000], ids=["C", "Python"])
def test_impact_tears_a_clutch_that_holds_which_slips_until_it_holds_again(max_steps: int | None) -> None:
    """Rotors held by a clutch of finite torque F: a stop turns one of them back, its impulse is that of this one alone."""
    I_1, I_2, F, w, e, end = 0.8, 1.2, 4.0, 10.0, 0.5, 10.0
    system = rotors(I_1, I_2)
    system.add_contact(sd.JointFriction("disc", "a", breakaway=1.25 * F, sliding=F, other="b"))
    system.add_contact(sd.Stop("end", "b", upper=end, restitution=e))
    solution = system.compile().simulate((0, 5), u=[w, 0.0], rtol=1e-12, max_steps=max_steps)
    rate = F / I_1 + F / I_2
    common = I_1 * w / (I_1 + I_2)
    first = w / rate
    hit = first + (end - F / I_2 * first**2 / 2) / common
    again = hit + (1 + e) * common / rate
    disc, stop = solution.contacts["disc"], solution.contacts["end_upper"]
    assert [mode for _, mode in disc.switches] == ["sliding", "sticking", "sliding", "sticking"]
    assert np.array([t for t, _ in disc.switches]) == pytest.approx([0, first, hit, again], abs=1e-10)
    assert stop.impacts.t == pytest.approx([hit], abs=1e-10)
    assert stop.impacts.impulse[0, 0] == pytest.approx(I_2 * (1 + e) * common, rel=1e-11)
    assert solution.u[-1] == pytest.approx([(I_1 - e * I_2) * common / (I_1 + I_2)] * 2, rel=1e-10)


def test_faults_of_elements_are_reported_together() -> None:
    system = rotors(1.0, 1.0)
    ball = system.add_body("ball", mass=1.0, inertia=[1, 1, 1])
    system.add_joint(sd.Free("free", system.ground, ball))
    for element in (sd.Stop("none", "a"), sd.Stop("crossed", "a", lower=1.0, upper=0.5), sd.Stop("free_stop", "free", lower=0),
                    sd.Stop("lost", "knee", lower=0), sd.Stop("bad name", "a", lower=0),
                    sd.Stop("lively", "a", lower=0, restitution=1.2), sd.Backlash("narrow", "a", "b", width=-0.1),
                    sd.OneWayClutch("way", "a", direction=2), sd.JointFriction("weak", "a", breakaway=1.0, sliding=2.0),
                    sd.Stop("odd", "a", lower=0, impact="x"),
                    sd.JointFriction("negative", "a", breakaway=-1.0), sd.Rope("short", "ball", "ground", length=-1.0),
                    sd.Rope("no_rope", "ball", "ground", length=0),
                    sd.Rope("same", "ball", "ball", length=1.0), sd.Rope("nobody", "ball", "bal", length=1.0)):
        system.add_contact(element)
    with pytest.raises(ModelError) as caught:
        system.check()
    message = str(caught.value)
    for part in ("stop 'none' has neither lower nor upper", "lower is 1 and upper 0.5", "the joint 'free' has the coordinates",
                 "is at the joint 'knee', which the system does not have; joints: a, b, free", "a stop is named 'bad name'",
                 "restitution is 1.2; pass a number from 0 to 1", "width is -0.1; pass a number from 0 on",
                 "direction is 2; pass 1", "impact is 'x'",
                 "sliding is 2 and breakaway 1", "breakaway is -1", "length is -1",
                 "length is 0; pass a length above 0, or a joint", "is between ball and ball",
                 "is between ball and bal;"):
        assert part in message, part


@pytest.mark.parametrize(("element", "wrong"), [
    (lambda: sd.Contact("heel", ["body_a"], "ground"), r"contact 'heel' is between"),
    (lambda: sd.Rope("tether", ["body_a"], "ground", 1.0), r"rope 'tether' is between \['body_a'\] and ground"),
    (lambda: sd.ContactGroup("grains", [["body_a"]], sd.contacts.Sphere(1.0)), "is not free"),
    (lambda: sd.OneWayClutch("freewheel", "a", direction=np.array([1, 1])), r"direction is array\(\[1, 1\]\); pass 1 or -1")])
def test_lists_where_one_thing_is_wanted_are_faults(element: Callable[[], Any], wrong: str) -> None:
    system = rotors(1.0)
    system.add_contact(element())
    with pytest.raises(ModelError, match=wrong):
        system.check()


def test_overlapping_stops_and_ropes_are_rejected_at_the_start() -> None:
    system = rotors(1.0)
    system.add_contact(sd.Stop("knee", "a", lower=0.5))
    with pytest.raises(sd.ArgumentError, match=r"knee_lower by 0.5 m or rad; start from q = \{q_a: 0.5\}"):
        system.compile().simulate((0, 1))


def test_friction_of_a_joint_in_the_energy_balance_and_its_unit() -> None:
    """It takes the sliding torque times the angle that was turned; the force along its row is a torque."""
    q = sd.coordinates("q")
    system = sd.System("brake")
    rotor = system.add_body("rotor", mass=1.0, inertia=[0.5] * 3)
    system.add_joint(sd.Revolute("hinge", system.ground, rotor, coordinate=q))
    system.add_contact(sd.JointFriction("brake", "hinge", breakaway=2.0, sliding=1.5))
    solution = system.compile().simulate((0, 3), u=[6.0], rtol=1e-12, work=True)
    balance = solution.energy_balance
    assert balance["friction of brake"][-1] == pytest.approx(-0.5 * 0.5 * 36, rel=1e-10)
    assert np.abs(balance["friction of brake"] + 1.5 * solution["q"]).max() < 1e-9 and np.abs(balance["work"]).max() < 1e-9
    (contact,) = with_contacts(system).rigid_contacts
    assert contact.forces[0].unit == "N m"
    assert with_contacts(roped()).rigid_contacts[0].forces[0].unit == "N"


def roped() -> sd.System:
    system = sd.System("roped")
    ball = system.add_body("ball", mass=1.0)
    system.add_joint(sd.Prismatic("along", system.ground, ball, axis=[1, 0, 0], coordinate=sd.coordinates("x")))
    system.add_contact(sd.Rope("rope", ball, "ground", length=1.0))
    return system


@pytest.mark.parametrize("element", [sd.Backlash("x", "a", "a", width=0.1), sd.OneWayClutch("x", "a", "a"),
                                     sd.JointFriction("x", "a", 1.0, other="a")])
def test_elements_between_a_joint_and_itself_are_faults(element: Any) -> None:
    system = rotors(1.0)
    system.add_contact(element)
    with pytest.raises(ModelError, match="'x' is between the joint 'a' and itself; pass two different joints"):
        system.check()
