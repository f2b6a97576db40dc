"""Compliant contacts against closed forms, differences and each other."""

import warnings
from typing import Any

import numpy as np
import pytest
import sympy as sp
from scipy.integrate import quad
from sympy.functions.elementary import miscellaneous

import symdyn as sd
from symdyn.errors import ArgumentError, ModelError, SimulationWarning
from symdyn.runtime.contact_laws import OPEN, SLIDING, STICKING

G, TILT, MU, STIFFNESS = 9.81, np.radians(20), 0.5, 1e6
C = sd.contacts


def slope(bristles: Any = None, tilt: float = TILT, friction: float = MU, **more: Any) -> sd.System:
    """A block of 2 kg that moves along and across a slope."""
    x, y = sd.coordinates("x y")
    system = sd.System("slope", gravity=[G * np.sin(tilt), -G * np.cos(tilt)])
    slide, block = system.add_body("slide", mass=0), system.add_body("block", mass=2.0)
    system.add_joint(sd.Prismatic("along", system.ground, slide, axis=[1, 0], coordinate=x))
    system.add_joint(sd.Prismatic("across", slide, block, axis=[0, 1], coordinate=y))
    law = {"stiffness": STIFFNESS, "exponent": 1, "dissipation": 10.0, "bristles": bristles, **more}
    system.add_contact(sd.Contact("sole", block, system.ground, friction=(0.6, MU) if "stribeck" in more else friction,
                                  law="compliant", compliance=C.Compliance(**law)))
    return system


def resting(system: sd.System, end: float = 100.0, **more: Any) -> Any:
    return system.compile().simulate((0, end), q=[0, -2 * G * np.cos(TILT) / STIFFNESS], method="radau", **more)


def test_hertz_takes_numbers_and_expressions_and_never_evaluates_text(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(sd.ModelError) as caught:
        C.hertz("print('evaluated')", 2.1e11, "0.3")
    assert "hertz: radius" in str(caught.value) and "hertz: poisson" in str(caught.value)
    assert capsys.readouterr().out == ""


@pytest.mark.parametrize(("given", "wrong"), [
    ((0, 2.1e11), "radius is 0; pass a number above 0"), ((0.01, -1.0), "modulus is -1.00000000000000; pass a number above 0"),
    ((0.01, 2.1e11, 1), "poisson is 1; pass Poisson's ratio"), ((0.01, 2.1e11, 0.3, 0.02, 2.1e11, 0.6), "poisson_b is 0.6"),
    ((0.5, 2.1e11, 0.3, -0.25), "radius_b -0.25")])
def test_hertz_rejects_what_no_material_or_pair_of_shapes_has(given: tuple[float, ...], wrong: str) -> None:
    with pytest.raises(sd.ModelError, match=wrong):
        C.hertz(*given)


def test_hertz_of_a_sphere_in_a_hollow_one() -> None:
    """1/R = 1/0.1 - 1/0.2."""
    assert float(C.hertz(0.1, 1e9, 0.3, -0.2)) == pytest.approx(4 / 3 * 1e9 / 0.91 * np.sqrt(0.2), rel=1e-14)


def test_parameters_that_no_compliance_has_are_rejected_in_runs_and_fail_alone_in_batches() -> None:
    stiffness, mu, slip_speed = sd.parameters("stiffness mu slip_speed")
    system = sd.System("ball", gravity=[0, -G])
    system.defaults = {stiffness: 1e4, mu: 0.3, slip_speed: 1e-2}
    ball = system.add_body("ball", mass=1.0, inertia=0.1)
    system.add_joint(sd.Planar("free", system.ground, ball, sd.coordinates("x y theta")))
    system.add_contact(sd.Contact("floor", ball, system.ground, friction=mu, law="compliant",
                                  compliance=C.Compliance(stiffness, exponent=1, slip_speed=slip_speed)))
    module = system.compile()
    with pytest.raises(ArgumentError, match=r"static friction of contact floor is -0\.1; pass a number from 0 on; "
                                            r"kinetic friction.*stiffness of contact floor is 0; pass a number above 0"):
        module.simulate((0, 0.1), params={stiffness: 0.0, mu: -0.1, slip_speed: -1.0})
    batch = module.simulate_batch(q={"y": 0.01}, params={"mu": [0.3, -0.1, 0.2]}, t=np.linspace(0, 0.1, 3))
    assert batch.success.tolist() == [True, False, True]
    assert "static friction of contact floor is -0.1" in batch.messages[1]


def test_expressions_of_parameters_that_no_compliance_has_are_rejected_all_at_once() -> None:
    base, wear, modulus, part, radius = sd.parameters("base wear modulus part radius")
    system = sd.System("ball", gravity=[0, -G])
    system.defaults = {base: 0.5, wear: 0.1, modulus: 2e4, part: 0.5, radius: 0.1}
    ball = system.add_body("ball", mass=1.0, inertia=0.1)
    system.add_joint(sd.Planar("free", system.ground, ball, sd.coordinates("x y theta")))
    brush = C.Bristles(1e5 * base, 300.0, part + 0.2)
    system.add_contact(sd.Contact("floor", ball, system.ground, friction=(base, base - wear), law="compliant",
                                  shape=C.Sphere(radius), compliance=C.Compliance(
                                      modulus / 2, dissipation=1 - wear, stribeck=wear / 10, bristles=brush)))
    module = system.compile()
    assert module.simulate((0, 0.01), q={"y": 0.2}).success
    wrong = {base: 0.5, wear: 2.0, modulus: -1.0, part: 0.8, radius: -0.1}
    with pytest.raises(ArgumentError) as caught:
        module.simulate((0, 0.01), q={"y": 0.2}, params=wrong)
    for message in ("kinetic friction of contact floor is -1.5; pass a number above 0",
                    "stiffness of contact floor is -0.5; pass a number above 0",
                    "dissipation of contact floor is -1; pass a number from 0 on",
                    "elastic part of bristles of contact floor is 1; pass a number from 0 to below 1",
                    "radius of the shape on a of contact floor is -0.1; pass a number from 0 on"):
        assert message in str(caught.value)
    with pytest.raises(ArgumentError, match=r"static friction less kinetic friction of contact floor is -0\.1"):
        module.simulate((0, 0.01), q={"y": 0.2}, params={wear: -0.1})
    batch = module.simulate_batch(q={"y": [0.2, 0.3, 0.4]}, params={"modulus": [1e4, -1.0, 2e4]}, t=np.linspace(0, 0.01, 3))
    assert batch.success.tolist() == [True, False, True] and "stiffness of contact floor is -0.5" in batch.messages[1]
    with pytest.raises(ArgumentError, match=r"stiffness of contact floor is -0\.5"):
        module.gradient(sd.Loss(end=sp.Symbol("y")), [modulus], (0, 0.01), q={"y": 0.2}, params={modulus: -1.0})


def test_static_friction_without_a_curve_is_rejected_where_it_would_not_count() -> None:
    mu = sd.parameters("mu")
    for friction, stribeck, good in (((0.6, 0.5), None, False), ((mu, 0.5), None, False), ((0.6, 0.5), 0.1, True),
                                     ((0.5, sp.Rational(1, 2)), None, True), ((mu, mu), None, True)):
        system = sd.System("ball", gravity=[0, -G])
        ball = system.add_body("ball", mass=1.0, inertia=0.1)
        system.add_joint(sd.Planar("free", system.ground, ball, sd.coordinates("x y theta")))
        system.add_contact(sd.Contact("floor", ball, "ground", friction=friction, law="compliant",
                                      compliance=C.Compliance(1e4, stribeck=stribeck)))
        if good:
            system.check()
            continue
        with pytest.raises(ModelError, match=r"'floor': static friction is .* and kinetic friction 0\.5.*, and compliant "
                                             r"contacts take static friction by Stribeck's curve; pass stribeck="):
            system.check()


@pytest.mark.parametrize(("law", "wrong"), [
    ({"stiffness": None}, "stiffness is None of type NoneType"), ({"stiffness": float("nan")}, "stiffness is nan; pass a finite"),
    ({"stiffness": 1e4, "slip_speed": "slow"}, "slip_speed is the text 'slow'"),
    ({"stiffness": 1e4, "depth": sp.Symbol("deep")}, "depth is deep; pass a number, in m"),
    ({"stiffness": 1e4, "creep": sp.Symbol("far")}, "creep is far; pass a number, in m"),
    ({"stiffness": 1e4, "creep": 1e-3}, "creep is limited, and there is no friction that holds; pass friction"),
    ({"stiffness": 1e4, "creep": -1.0}, "creep is -1; pass a number above 0")])
def test_what_is_no_number_of_a_compliance_is_named(law: dict[str, Any], wrong: str) -> None:
    system = sd.System("ball")
    ball = system.add_body("ball", mass=1.0)
    system.add_joint(sd.Prismatic("height", system.ground, ball))
    system.add_contact(sd.Contact("floor", ball, "ground", law="compliant", compliance=C.Compliance(**law)))
    with pytest.raises(sd.ModelError, match=wrong):
        system.check()


def test_spheres_part_after_hertzs_time() -> None:
    """Depth (15 m v^2/(16 E* sqrt R))^(2/5), time 2 d/v int_0^1 ds/sqrt(1 - s^(5/2)) = 2.94 d/v (Johnson 1985, section 11.4)."""
    stiffness = float(C.hertz(0.01, 2.1e11, 0.3, 0.02, 2.1e11, 0.3))
    curved, modulus = 1 / (1 / 0.01 + 1 / 0.02), 1 / (2 * (1 - 0.3**2) / 2.1e11)
    assert stiffness == pytest.approx(4 / 3 * modulus * np.sqrt(curved), rel=1e-14)
    system = sd.System("spheres")
    for name, mass in (("a", 0.03), ("b", 0.2)):
        body = system.add_body(name, mass=mass)
        system.add_joint(sd.Prismatic(f"along_{name}", system.ground, body, axis=[1, 0, 0]))
    system.add_contact(sd.Contact("touch", "a", "b", shape=(C.Sphere(0.01), C.Sphere(0.02)), law="compliant",
                                  compliance=C.Compliance(stiffness)))
    system.add_event("parts", sd.distance("a", "b") - 0.03, 1)
    mass, speed = 0.03 * 0.2 / 0.23, 1.0
    depth = (15 * mass * speed**2 / (16 * modulus * np.sqrt(curved))) ** 0.4
    lasts = 2 * depth / speed * quad(lambda s: 1 / np.sqrt(1 - s**2.5), 0, 1, epsabs=0, epsrel=1e-11)[0]
    assert lasts == pytest.approx(2.94 * depth / speed, rel=2e-3)
    solution = system.compile().simulate(np.linspace(0, 1.5 * lasts, 3001), q=[-0.03, 0], u=[speed, 0], rtol=1e-12)
    assert solution.events["parts"].t[-1] == pytest.approx(lasts, rel=1e-9)
    touch = solution.contacts["touch"]
    assert -touch.gap.min() == pytest.approx(depth, rel=1e-9 + 1e-6)
    assert touch.force[:, 0].max() == pytest.approx(stiffness * depth**1.5, rel=2e-6)
    assert [mode for _, mode in touch.switches] == [SLIDING, OPEN]
    assert np.abs(solution.u[-1] - np.array([(0.03 - 0.2) / 0.23, 0.06 / 0.23])).max() < 1e-10


@pytest.mark.parametrize("elastic", [0.7, None])
def test_block_on_bristles_stays_on_the_slope(elastic: float | None) -> None:
    """s0 z = tan(tilt), and no creep at a load that stays."""
    solution = resting(slope(C.Bristles(1e5, 300.0, elastic)), rtol=1e-10, atol=1e-16)
    z = solution["sole_bristle"]
    assert z[-1] == pytest.approx(np.tan(TILT) / 1e5, rel=1e-6)
    assert abs(solution["x"][-1] - solution["x"][500]) < 1e-12
    assert solution.contacts["sole"].mode[-1] == STICKING
    assert solution.contacts["sole"].force[-1] == pytest.approx([2 * G * np.cos(TILT), -2 * G * np.sin(TILT)], rel=1e-6)


def test_block_on_regularized_friction_creeps_with_the_speed_that_is_stated() -> None:
    """mu v/sqrt(v^2 + s^2) = tan(tilt)."""
    solution = resting(slope(slip_speed=1e-4), 1.0, rtol=1e-10)
    creep = 1e-4 * np.tan(TILT) / np.sqrt(MU**2 - np.tan(TILT) ** 2)
    assert solution["x_dot"][-1] == pytest.approx(creep, rel=1e-8)
    assert solution.contacts["sole"].slip[-1, 0] == pytest.approx(creep, rel=1e-8)


def test_friction_falls_with_the_slip_by_stribeck_and_grows_by_viscous_friction() -> None:
    module = slope(stribeck=0.1, viscous=0.02, slip_speed=1e-6).compile(backend="numpy")
    y, slip = -1e-4, np.array([0.05, 0.1, 1.0])
    forces = [module.evaluate("compliant_contacts", 0.0, [0, y, v, 0])[3] for v in slip]
    assert np.allclose(forces, -STIFFNESS * 1e-4 * (MU + 0.1 * np.exp(-((slip / 0.1) ** 2)) + 0.02 * slip), rtol=1e-9)


def test_each_of_several_contacts_has_its_own_numbers() -> None:
    """Points of a plate that slides to the right, at depths of their own, with and without friction."""
    system = sd.System("plate", gravity=[0, -G])
    body = system.add_body("plate", mass=1.0, inertia=0.1)
    system.add_joint(sd.Planar("free", system.ground, body, sd.coordinates("x y angle")))
    points = {"rough": (-0.5, 1e5, 0.4), "smooth": (0.1, 2e5, 0.0), "dull": (0.5, 3e5, 0.2)}
    for name, (place, stiffness, friction) in points.items():
        system.add_contact(sd.Contact(name, body, system.ground, shape=C.Point([place, 0]), friction=friction, law="compliant",
                                      compliance=C.Compliance(stiffness, exponent=1, slip_speed=1e-6)))
    solution = system.compile(backend="numpy").simulate([0.0, 1e-4], q=[0, -1e-3, 1e-4], u=[0.5, 0, 0])
    for name, (place, stiffness, friction) in points.items():
        contact, gap = solution.contacts[name], -1e-3 + place * np.sin(1e-4)
        assert contact.gap[0] == pytest.approx(gap, rel=1e-9)
        assert contact.force[0] == pytest.approx([-stiffness * gap, stiffness * gap * friction], rel=1e-9)
        assert contact.slip[0] == pytest.approx([0.5]) and contact.mode[0] == "sliding"


@pytest.mark.parametrize("bristles", [None, C.Bristles(1e5, 300.0), C.Bristles(1e5, 300.0, None)])
@pytest.mark.parametrize("space", [False, True])
def test_jacobians_are_exact(bristles: Any, space: bool) -> None:
    """Against central differences, sliding at a depth."""
    if space:
        system = sd.System("ball", gravity=[0, 0, -G])
        body = system.add_body("ball", mass=1.0, inertia=[0.01] * 3)
        system.add_joint(sd.Free("free", system.ground, body, orientation=sd.EulerAngles("ZYX")))
        system.add_contact(sd.Contact("sole", body, system.ground, shape=C.Sphere(0.1), friction=(0.6, MU), law="compliant",
                                      compliance=C.Compliance(1e5, dissipation=0.5, stribeck=0.1, bristles=bristles)))
        x = [0.1, 0.2, 0.0995, 0.1, 0.2, 0.3, 0.3, -0.2, -0.1, 1.0, 2.0, 3.0]
    else:
        system, x = slope(bristles, stribeck=0.1), [0.1, -1e-4, 0.3, -0.01]
    module = system.compile(backend="numpy")
    state = np.array([*x, *([4e-6] if not space else [4e-6, -2e-6]) * (bristles is not None)])
    exact = module.jacobian(0.0, state).x
    steps = np.array([1e-10 if "bristle" in name else 1e-8 for name in module.metadata.x])
    differences = np.array([(module.rhs(0.0, state + h * e) - module.rhs(0.0, state - h * e)) / (2 * h)
                            for h, e in zip(steps, np.eye(len(state)), strict=True)]).T
    assert np.abs(exact - differences).max() <= 1e-5 * np.abs(exact).max()


def test_the_sign_of_a_depth_is_not_sought_in_common_factors_of_the_gap(monkeypatch: pytest.MonkeyPatch) -> None:
    """SymPy takes a second for them with a torus in a bore."""
    looks = []
    monkeypatch.setattr(miscellaneous, "factor_terms", lambda found: looks.append(found) or found)
    system = sd.System("ring", gravity=[0, 0, -G])
    body = system.add_body("ring", mass=1.0, inertia=[0.016, 0.016, 0.02])
    system.add_joint(sd.Free("free", system.ground, body, orientation=sd.EulerParameters()))
    system.add_contact(sd.Contact("touch", body, system.ground, shape=(C.Torus(0.15, 0.05), C.Bore(2, [0, 0, 2])), friction=0.3,
                                  law="compliant", compliance=C.Compliance(2000.0, dissipation=0.2)))
    system.check()
    assert not looks


def rod() -> sd.System:
    """A rod that falls onto its two ends."""
    system = sd.System("rod", gravity=[0, -G])
    body = system.add_body("rod", mass=1.0, inertia=0.1)
    system.add_joint(sd.Planar("free", system.ground, body, sd.coordinates("x y angle")))
    for name, end in (("left", -0.5), ("right", 0.5)):
        system.add_contact(sd.Contact(name, body, system.ground, shape=C.Point([end, 0]), friction=0.4, law="compliant",
                                      compliance=C.Compliance(1e5, dissipation=0.3, slip_speed=1e-2, located=True)))
    return system


START, T = [0.0, 0.3, 0.4], np.linspace(0, 0.5, 101)


@pytest.fixture(scope="module")
def reference() -> Any:
    return rod().embedding().compile().simulate(T, q=START, rtol=1e-11, work=True)


@pytest.mark.parametrize("formulation", ["recursive", "augmented", "absolute"])
def test_all_formulations_make_the_same_motion(formulation: str, reference: Any) -> None:
    system = rod()
    equations = system.augmented(coordinates="absolute") if formulation == "absolute" else getattr(system, formulation)()
    solution = equations.compile().simulate(T, q=START, rtol=1e-11)
    rates = [module.rhs(0.0, x) for module in (solution.module, reference.module) for x in reference.x]
    assert np.allclose(rates[:101], rates[101:], rtol=1e-11, atol=1e-11)
    assert len(solution.events["left_touches"].t) > 0 and set(reference.energy_balance) == {"change", "work", "error"}
    assert np.abs(solution.x - reference.x).max() < 3e-8


def test_an_implicit_method_and_a_batch_make_the_same_motion(reference: Any) -> None:
    radau = reference.module.simulate(T, q=START, rtol=1e-11, method="radau")
    assert np.abs(radau.x - reference.x).max() < 1e-6
    batch = reference.module.simulate_batch(q=[START, START], t=T, rtol=1e-11)
    assert np.abs(batch.x[1] - reference.x).max() < 3e-8
    assert (reference.contacts["left"].force[:, 0] > 0).any()
    assert np.abs(reference.energy_balance["error"]).max() < 1e-8
    assert reference.work[-1] < 0


def test_each_of_several_contacts_has_its_own_gap_and_force() -> None:
    """A plank at rest on two ends, one of them smooth, that carry it by the lever rule, below a stop that does not touch."""
    system = sd.System("plank", gravity=[0, -G])
    body = system.add_body("plank", mass=2.0, inertia=0.1, com=[0.1, 0])
    system.add_joint(sd.Planar("free", system.ground, body, sd.coordinates("x y angle")))
    for name, end, friction in (("left", [-0.5, 0], 0), ("stop", [0.2, 0.3], 0.4), ("right", [0.5, 0], 0.4)):
        system.add_contact(sd.Contact(name, body, system.ground, shape=C.Point(end), friction=friction, law="compliant",
                                      compliance=C.Compliance(STIFFNESS, exponent=1)))
    left, right = (2 * G * share for share in (0.4, 0.6))
    y, angle = -(left + right) / 2 / STIFFNESS, np.arcsin((left - right) / STIFFNESS)
    contacts = system.compile().simulate((0, 1e-3), q=[0, y, angle]).contacts
    for name, force, gap in (("left", left, -left / STIFFNESS), ("stop", 0.0, y + 0.2 * np.sin(angle) + 0.3 * np.cos(angle)),
                             ("right", right, -right / STIFFNESS)):
        motion = contacts[name]
        np.testing.assert_allclose(motion.force[:, 0], force, rtol=1e-6)
        np.testing.assert_allclose(motion.gap, gap, rtol=1e-6)
        assert motion.force.shape[1] == motion.slip.shape[1] + 1 == (1 if name == "left" else 2)
        assert np.abs(motion.force[:, 1:]).max(initial=0.0) < 1e-3
        assert {motion.mode[0], motion.mode[-1]} == {OPEN if name == "stop" else SLIDING if name == "left" else STICKING}


def test_steps_end_where_the_gap_closes() -> None:
    """A ball on a linear spring, in closed form: the error is smaller with fewer steps."""
    stiffness, height = 1e6, 1.0
    w, speed = np.sqrt(stiffness), np.sqrt(2 * G * height)
    flight, touch = 2 * speed / G, 2 / w * (np.pi - np.arctan2(speed / w, G / w**2))

    def expected(t: float) -> float:
        s = (t + flight / 2) % (flight + touch)
        if s < flight:
            return float(speed * s - G * s**2 / 2)
        return float(G / w**2 * (np.cos(w * (s - flight)) - 1) - speed / w * np.sin(w * (s - flight)))

    t, errors, steps = np.linspace(0, 3, 301), [], []
    for located in (False, True):
        system = sd.System("ball", gravity=[0, -G])
        ball = system.add_body("ball", mass=1.0)
        system.add_joint(sd.Prismatic("height", system.ground, ball, axis=[0, 1], coordinate=sd.coordinates("y")))
        system.add_contact(sd.Contact("floor", ball, system.ground, law="compliant",
                                      compliance=C.Compliance(stiffness, exponent=1, located=located)))
        solution = system.compile().simulate(t, q=[height], rtol=1e-10)
        errors.append(np.abs(solution["y"] - [expected(s) for s in t]).max())
        steps.append(solution.n_steps)
        assert list(solution.events) == (["floor_touches"] if located else [])
    assert errors[1] < 5e-9 and errors[1] < errors[0] and steps[1] < steps[0]


def test_depth_beyond_what_is_meant_is_reported() -> None:
    with pytest.warns(SimulationWarning, match=r"contact sole: it goes .* m deep, its compliance is meant for 1e-05 m"):
        resting(slope(depth=1e-5), 0.01)


def test_creep_beyond_what_is_meant_is_reported() -> None:
    """A block on a slope creeps at the speed where friction balances its weight, and batches report it too."""
    slow, ratio = 1e-3, np.tan(TILT) / MU
    speed = slow * ratio / np.sqrt(1 - ratio**2)
    module = slope(creep=1e-4, slip_speed=slow).compile()
    start = {"q": [0, -2 * G * np.cos(TILT) / STIFFNESS], "u": [speed, 0]}
    with pytest.warns(SimulationWarning, match="contact sole: it creeps .* m while friction holds, its compliance is meant for "
                                               "0.0001 m") as found:
        solution = module.simulate((0, 1), **start, method="radau5")
    assert float(str(found[0].message).split("creeps ")[1].split(" m")[0]) == pytest.approx(speed, rel=1e-3)
    assert solution["x"][-1] == pytest.approx(speed, rel=1e-3)
    with pytest.warns(SimulationWarning, match="in 1 of 1 motions.*contact sole: it creeps"):
        module.simulate_batch(t=np.linspace(0, 1, 21), q=start["q"], u=[start["u"]], method="radau5")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        module.simulate((0, 0.05), **start, method="radau5")


def test_sliding_is_no_creep() -> None:
    """A block pushed down the slope slides far, at speeds where friction does not hold."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        slope(creep=1e-4, slip_speed=1e-4, friction=0.1).compile().simulate((0, 1), q=[0, -2e-5], u=[1.0, 0], method="radau5")


def test_faults_of_compliances_are_reported_together() -> None:
    system = slope()
    for name, law in (("none", {}), ("number", {"compliance": 3}),
                      ("numbers", {"friction": 0.3, "compliance": C.Compliance(
                          0, exponent=0.5, dissipation=-1, slip_speed=0, stribeck=-1, viscous=-2, depth=0.0,
                          bristles=C.Bristles(0, -1, 1.0))}),
                      ("smooth", {"compliance": C.Compliance(1, bristles=C.Bristles(1e5), located=1)}),
                      ("brush", {"compliance": C.Compliance(1, bristles=3)}),  # type: ignore[arg-type]
                      ("bouncing", {"restitution": 0.5, "compliance": C.Compliance(1)})):
        system.add_contact(sd.Contact(name, "block", "ground", law="compliant", **law))  # type: ignore[arg-type]
    system.add_contact(sd.Contact("hard", "block", "ground", compliance=C.Compliance(1)))
    with pytest.raises(ModelError) as caught:
        system.check()
    for part in ("'none': law='compliant' takes compliance", "'number': law='compliant' takes compliance", "stiffness is 0",
                 "exponent is 0.5; pass a number from 1 on", "dissipation is -1", "slip_speed is 0", "stribeck is -1",
                 "viscous is -2", "depth is 0", "stiffness of bristles is 0", "damping of bristles is -1",
                 "elastic part of bristles is 1", "'smooth': bristles need friction", "bristles is 3",
                 "located is 1; pass True or False",
                 "restitution belongs to rigid contacts", "'hard': compliance belongs to law='compliant'"):
        assert part in str(caught.value)
