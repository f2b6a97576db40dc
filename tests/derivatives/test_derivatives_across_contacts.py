"""Sensitivities and gradients across impacts, and across switches between sticking and sliding, against closed forms."""

import re
import warnings
from typing import Any

import numpy as np
import pytest
import sympy as sp

import symdyn as sd
from symdyn.errors import ArgumentError, EvaluationError, SimulationWarning
from symdyn.runtime.integrating.contact_columns import Switch

G = 9.81
E, GRAVITY, MU, KINETIC, K, DOWN = sd.parameters("e g mu kinetic k down")


@pytest.fixture(scope="module")
def ball() -> Any:
    y = sd.coordinates("y")
    system = sd.System("ball", gravity=[0, -GRAVITY])
    system.defaults.update({E: 0.8, GRAVITY: G})
    body = system.add_body("ball", mass=1.0)
    system.add_joint(sd.Prismatic("height", system.ground, body, axis=[0, 1], coordinate=y))
    system.add_contact(sd.Contact("floor", body, system.ground, restitution=E))
    system.add_event("top", y.dot, -1)
    system.add_event("set", sd.t - 2.9, reset={y: y})
    return system.compile()


def height(n: int, end: float) -> tuple[dict[str, sp.Symbol], sp.Expr, sp.Expr]:
    """The height and speed of a ball at a time after n impacts, by height, speed, restitution and gravity at the start."""
    h, v, e, g = symbols = sp.symbols("h v e g", positive=True)
    speed = sp.sqrt(v**2 + 2 * g * h)
    left = end - (v + speed) / g - sum(2 * speed * e**k / g for k in range(1, n))
    return (dict(zip(("y(0)", "y_dot(0)", "e", "g"), symbols, strict=True)),
            speed * e**n * left - g * left**2 / 2, speed * e**n - g * left)


def test_ball_after_six_impacts(ball: Any) -> None:
    symbols, y, v = height(6, 3.0)
    solution = ball.simulate((0, 3), q=[1.0], rtol=1e-12, sensitivities=list(symbols))
    assert len(solution.contacts["floor"].impacts.t) == 6
    found = ball.gradient(sd.Loss(end=sp.Symbol("y")), list(symbols), (0, 3), q=[1.0], rtol=1e-12, events=False)
    at = dict(zip(symbols.values(), (1.0, 0.0, 0.8, G), strict=True))
    for name, symbol in symbols.items():
        expected = [float(sp.diff(row, symbol).subs(at)) for row in (y, v)]
        assert np.abs(solution.sensitivity[name][-1] - expected).max() < 1e-10 * max(1.0, *np.abs(expected))
        assert abs(found[name] - expected[0]) < 1e-11


def test_ball_at_rest_after_infinitely_many_impacts_depends_on_nothing(ball: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.warns(SimulationWarning, match=r"ball: the impacts of floor accumulate at t = 4.06.* end the motion before it"):
        solution = ball.simulate((0, 6), q=[1.0], rtol=1e-12, sensitivities=["y(0)", "e", "g"])
    assert len(solution.contacts["floor"].rests) == 1
    # In closed form t1 (1 + e)/(1 - e) with the first fall t1.
    assert np.sqrt(2 / G) * 1.8 / 0.2 == pytest.approx(4.0637, abs=1e-4)
    asked: dict[str, Any] = {"by": ["e"], "t": (0, 6), "q": [1.0], "rtol": 1e-12, "events": False}
    with pytest.warns(SimulationWarning, match=r"ball: the impacts of floor accumulate at t = 4.06"):
        assert abs(ball.gradient(sd.Loss(end=sp.Symbol("y")), **asked)["e"]) < 1e-9

    def fails(*given: object) -> None:
        raise EvaluationError("floor_closes has no derivative there")

    with monkeypatch.context() as patched:
        patched.setattr(Switch, "along", fails)
        with pytest.warns(SimulationWarning), pytest.raises(EvaluationError, match=(
                r"ball: floor_closes has no derivative there; impacts accumulate near t = 4.06")):
            ball.gradient(sd.Loss(end=sp.Symbol("y")), **asked)
    assert max(np.abs(solution.sensitivity[name][-1]).max() for name in ("y(0)", "e", "g")) < 1e-9


def test_gradient_across_infinitely_many_impacts_of_what_moves_along_names_sensitivities() -> None:
    """A mass on a rope, which becomes taut ever again; sensitivities against differences."""
    length, e = sd.parameters("length e")
    system = sd.System("rope", gravity=[0, -G])
    system.defaults = {length: 1.0, e: 0.5}
    body = system.add_body("body", mass=1.0, inertia=1.0)
    system.add_joint(sd.Planar("free", system.ground, body, sd.coordinates("x y theta")))
    system.add_contact(sd.Rope("rope", system.ground, body, length, restitution=e))
    module = system.compile()
    start: dict[str, Any] = {"q": [0.3, -0.4, 0], "u": [0.5, 0, 0], "rtol": 1e-10}
    with pytest.warns(SimulationWarning, match="the impacts of rope accumulate at t = 0.848"):
        solution = module.simulate((0, 2), sensitivities=[length, e], **start)
    for parameter, value in system.defaults.items():
        sides = [module.simulate((0, 2), params={parameter: value + step}, **start).x[-1] for step in (1e-5, -1e-5)]
        assert np.abs(solution.sensitivity[parameter][-1] - (sides[0] - sides[1]) / 2e-5).max() < 1e-5
    with pytest.warns(SimulationWarning), pytest.raises(EvaluationError, match=(
            r"impacts accumulate near t = 0.848\d* s: end the motion before them, or take simulate\(..., sensitivities=")):
        module.gradient(sd.Loss(end=sp.Symbol("x")), [length, e], (0, 2), **start)


def test_integral_of_a_loss_over_impacts(ball: Any) -> None:
    """Integral of y^2 + y_dot^2 over a fall and the first flight, in closed form piece by piece."""
    (h, _, e, g), end = sp.symbols("h v e g", positive=True), 1.0
    t, fall, speed = sp.Symbol("t"), sp.sqrt(2 * h / g), sp.sqrt(2 * g * h)
    first = sp.integrate(sp.expand((h - g * t**2 / 2) ** 2 + g**2 * t**2), (t, 0, fall))
    second = sp.integrate(sp.expand((e * speed * t - g * t**2 / 2) ** 2 + (e * speed - g * t) ** 2), (t, 0, end - fall))
    y = sd.coordinates("y")
    found = ball.gradient(sd.Loss(integral=y**2 + y.dot**2), ["y(0)", "e", "g"], (0, end), q=[1.0], rtol=1e-12, events=False)
    at = {h: 1.0, e: 0.8, g: G}
    assert found.value == pytest.approx(float((first + second).subs(at)), rel=1e-11)
    for name, symbol in (("y(0)", h), ("e", e), ("g", g)):
        assert found[name] == pytest.approx(float(sp.diff(first + second, symbol).subs(at)), rel=1e-10)


def mass_on_ground(space: bool = False, law: str = "newton") -> Any:
    """A point mass over the ground; in space gravity has a part down along x."""
    system = sd.System("mass", gravity=[DOWN, 0, -G] if space else [0, -G])
    system.defaults.update({MU: 0.3, E: 0.0, **({DOWN: 0.0} if space else {})})
    axes = np.eye(3).tolist() if space else np.eye(2).tolist()
    before: Any = system.ground
    for axis, name in zip(axes, "xyz", strict=False):
        last = name == ("z" if space else "y")
        body = system.add_body("mass" if last else f"along_{name}", mass=1.0 if last else 0.0)
        system.add_joint(sd.Prismatic(f"slide_{name}", before, body, axis=axis, coordinate=sd.coordinates(name)))
        before = body
    system.add_contact(sd.Contact("sole", before, system.ground, friction=MU, restitution=E, impact=law))
    return system.compile()


@pytest.fixture(scope="module")
def mass() -> Any:
    return mass_on_ground()


def test_mass_that_slides_until_it_sticks(mass: Any) -> None:
    """It comes to v^2/(2 mu g)."""
    names = ["mu", "x_dot(0)", "x(0)", "y(0)"]
    solution = mass.simulate((0, 2), u={"x_dot": 2.0}, rtol=1e-12, sensitivities=names)
    assert [mode for _, mode in solution.contacts["sole"].switches] == ["sliding", "sticking"]
    found = mass.gradient(sd.Loss(end=sp.Symbol("x")), names, (0, 2), u={"x_dot": 2.0}, rtol=1e-12)
    for name, expected in zip(names, (-2 / (0.3**2 * G), 2 / (0.3 * G), 1.0, 0.0), strict=True):
        assert np.abs(solution.sensitivity[name][-1] - [expected, 0, 0, 0]).max() < 1e-11
        assert abs(found[name] - expected) < 1e-11


@pytest.mark.every_value
@pytest.mark.parametrize(("speed", "slides"), [(2.0, True), (0.3, False)])
@pytest.mark.parametrize("law", ["newton", "poisson"])
def test_oblique_impact_with_friction(law: str, speed: float, slides: bool) -> None:
    """It takes mu (1 + e) of the normal speed from the tangential one, or all of that."""
    module, high, end = mass_on_ground(law=law), 0.5, 0.5
    solution = module.simulate((0, end), q={"y": high}, u={"x_dot": speed}, params={"e": 0.6}, rtol=1e-12,
                               sensitivities=["mu", "e", "y(0)", "x_dot(0)"])
    fall, normal = np.sqrt(2 * high / G), np.sqrt(2 * G * high)
    rest, later = end - fall, 1 / np.sqrt(2 * G * high)
    if slides:
        expected = {"mu": -1.6 * normal * rest, "e": -0.3 * normal * rest, "x_dot(0)": end,
                    "y(0)": 0.3 * 1.6 * (normal * later - G * later * rest)}
    else:
        expected = {"mu": 0.0, "e": 0.0, "x_dot(0)": fall, "y(0)": speed * later}
    for name, value in expected.items():
        assert abs(solution.sensitivity[name][-1, 0] - value) < 1e-11


def test_mass_that_sticks_until_the_friction_cone_is_left() -> None:
    """A spring that a belt stretches lets go at mu g/k, and swings about kinetic g/k until the speed is that of the belt."""
    speed, static, kinetic, k = 0.2, 0.5, 0.3, 100.0
    x, y = sd.coordinates("x y")
    system = sd.System("belt", gravity=[0, -G])
    system.defaults.update({MU: static, KINETIC: kinetic, K: k})
    band, slide, block = (system.add_body(name, mass=m) for name, m in (("band", 1.0), ("slide", 0.0), ("block", 1.0)))
    system.add_joint(sd.Prismatic("drive", system.ground, band, axis=[1, 0], coordinate=sd.t * speed))
    system.add_joint(sd.Prismatic("along", system.ground, slide, axis=[1, 0], coordinate=x))
    system.add_joint(sd.Prismatic("across", slide, block, axis=[0, 1], coordinate=y))
    system.add_spring_damper(system.ground, block, point_a=[-1, 0], stiffness=K, length=1)
    system.add_contact(sd.Contact("sole", block, band, friction=(MU, KINETIC)))
    end, names = 1.45, ["mu", "kinetic", "k"]
    solution = system.compile().simulate((0, end), u=[speed, 0.0], rtol=1e-12, sensitivities=names)
    modes = [mode for _, mode in solution.contacts["sole"].switches]
    assert modes == ["sticking", "sliding", "sticking", "sliding", "sticking"]
    s, d, c = symbols = sp.symbols("s d c", positive=True)
    w, begins, centre = sp.sqrt(c), s * G / c, d * G / c
    slips = (sp.pi + 2 * sp.atan2(speed / w, begins - centre)) / w
    second = begins / speed + slips + 2 * (begins - centre) / speed  # it slips again from begins on
    position = 2 * centre - begins + speed * (end - second - slips)
    at = dict(zip(symbols, (static, kinetic, k), strict=True))
    assert solution["x"][-1] == pytest.approx(float(position.subs(at)), abs=1e-11)
    for name, symbol in zip(names, symbols, strict=True):
        assert np.abs(solution.sensitivity[name][-1] - [float(sp.diff(position, symbol).subs(at)), 0, 0, 0]).max() < 1e-9


@pytest.fixture(scope="module")
def in_space() -> Any:
    return mass_on_ground(True)


def test_mass_in_space_slides_along_its_velocity_until_it_sticks(in_space: Any) -> None:
    """It comes to v |v|/(2 mu g) along both axes."""
    v = np.array([1.2, 0.9])
    solution = in_space.simulate((0, 2), u={"x_dot": v[0], "y_dot": v[1]}, rtol=1e-11, sensitivities=["mu", "x_dot(0)"])
    assert [mode for _, mode in solution.contacts["sole"].switches] == ["sliding", "sticking"]
    size, by_x = np.linalg.norm(v), np.array([1.0, 0.0])
    assert np.abs(solution.sensitivity["mu"][-1, :2] + v * size / (2 * 0.3**2 * G)).max() < 1e-9
    expected = (by_x * size + v * v[0] / size) / (2 * 0.3 * G)
    assert np.abs(solution.sensitivity["x_dot(0)"][-1, :2] - expected).max() < 1e-9
    assert np.abs(solution.sensitivity["x_dot(0)"][-1, 3:]).max() < 1e-9
    found = in_space.gradient(sd.Loss(end=sp.Symbol("x")), ["mu"], (0, 2), u={"x_dot": v[0], "y_dot": v[1]}, rtol=1e-11)
    assert found["mu"] == pytest.approx(-v[0] * size / (2 * 0.3**2 * G), rel=1e-9)


def rest_on_slope() -> dict[str, Any]:
    """When and where a mass that slides on a slope sticks, and derivatives of the place, in closed form: with w the tangent of
    half of the angle of its velocity from down the slope on, and m the friction by what pulls it down, the speed is
    C w^(m - 1) (1 + w^2)/2."""
    vx, vy, mu, down = symbols = sp.symbols("vx vy mu down", positive=True)
    m, w = mu * G / down, (sp.sqrt(vx**2 + vy**2) - vx) / vy
    C = 2 * sp.sqrt(vx**2 + vy**2) / (w ** (m - 1) * (1 + w**2))
    end = C / (2 * down) * (w ** (m - 1) / (m - 1) + w ** (m + 1) / (m + 1))
    place = [C**2 / (4 * down) * (w ** (2 * m - 2) / (2 * m - 2) - w ** (2 * m + 2) / (2 * m + 2)),
             C**2 / (2 * down) * (w ** (2 * m - 1) / (2 * m - 1) + w ** (2 * m + 1) / (2 * m + 1))]
    by = {"mu": mu, "x_dot(0)": vx, "y_dot(0)": vy, "down": down}
    return {"end": sp.lambdify(symbols, end), "place": sp.lambdify(symbols, place),
            **{name: sp.lambdify(symbols, [sp.diff(e, symbol) for e in place]) for name, symbol in by.items()}}


SLOPES = [(1.0, -1.0, 1.5), (2.0, -2.0, 1.0), (2.0, 1.0, 1.0), (0.2, -1.0, 1.0)]  # what pulls it down, velocity


@pytest.mark.every_value
@pytest.mark.parametrize("rtol", [1e-8, 1e-11])
@pytest.mark.parametrize(("down", "vx", "vy"), SLOPES)
def test_mass_that_turns_down_a_slope_until_it_sticks(in_space: Any, down: float, vx: float, vy: float, rtol: float) -> None:
    """The less pulls it down, the faster its direction turns at the end."""
    expected, values = rest_on_slope(), (vx, vy, 0.3, down)
    end = expected["end"](*values)
    for name in ("x_dot(0)", "y_dot(0)"):
        names = ["mu", name]
        run = in_space.simulate((0, 1.2 * end), u=[vx, vy, 0], params={"down": down}, rtol=rtol, sensitivities=names)
        assert run.contacts["sole"].switches[-1][0] == pytest.approx(end, rel=20 * rtol)
        np.testing.assert_allclose(run.q[-1, :2], expected["place"](*values), atol=10 * rtol)
        for one in names:
            found = expected[one](*values)
            np.testing.assert_allclose(run.sensitivity[one][-1, :2], found, rtol=0, atol=50 * rtol * np.abs(found).max())
            assert np.abs(run.sensitivity[one][-1, 2:]).max() < 1e-12


@pytest.mark.every_value
@pytest.mark.parametrize("method", ["dop853", "bs54"])
@pytest.mark.parametrize(("down", "vx", "vy"), SLOPES)
def test_gradient_of_where_a_mass_sticks_on_a_slope(in_space: Any, down: float, vx: float, vy: float, method: str) -> None:
    """Gradient by the speed it slides away with, by friction, and by the force that pulls it down."""
    expected, values = rest_on_slope(), (vx, vy, 0.3, down)
    end, names = expected["end"](*values), ["x_dot(0)", "y_dot(0)", "mu", "down"]
    x, y = sp.symbols("x y")
    for rtol in (1e-8, 1e-10):
        found = in_space.gradient(sd.Loss(end=x - 2 * y), names, (0, 1.2 * end), u=[vx, vy, 0], params={"down": down}, rtol=rtol,
                                  method=method)
        place, by = expected["place"](*values), np.array([expected[name](*values) for name in names])
        assert found.value == pytest.approx(place[0] - 2 * place[1], abs=200 * rtol)
        np.testing.assert_allclose(found.array, by @ [1, -2], rtol=0, atol=100 * rtol * np.abs(by).max())


def test_integral_over_a_slip_in_space_and_the_rest_after_it(in_space: Any) -> None:
    """Integral of x^2, for a mass that slides straight along x from 1 m/s on and rests from T = 1/(mu g) on."""
    t, v, mu = sp.symbols("t v mu", positive=True)
    stops, x = v / (mu * G), v * t - mu * G * t**2 / 2
    whole = sp.integrate(sp.expand(x**2), (t, 0, stops)) + x.subs(t, stops) ** 2 * (1 - stops)
    names = ["x_dot(0)", "y_dot(0)", "mu"]
    found = in_space.gradient(sd.Loss(integral=sp.Symbol("x") ** 2), names, (0, 1), u=[1, 0, 0], rtol=1e-11)
    at = {v: 1.0, mu: 0.3}
    assert found.value == pytest.approx(float(whole.subs(at)), rel=1e-10)
    expected = [float(sp.diff(whole, v).subs(at)), 0.0, float(sp.diff(whole, mu).subs(at))]
    np.testing.assert_allclose(found.array, expected, rtol=0, atol=1e-9)


def test_motions_without_derivative_stop_with_the_reason(mass: Any) -> None:
    bar = sd.System("bar", gravity=[0, -G])
    body = bar.add_body("bar", mass=1.0, inertia=0.1)
    bar.add_joint(sd.Planar("free", bar.ground, body, sd.coordinates("x y theta")))
    for name, x in (("left", -1), ("right", 1)):
        bar.add_contact(sd.Contact(name, body, bar.ground, shape=sd.contacts.Point([x, 0])))
    module = bar.compile()
    with pytest.warns(SimulationWarning, match=r"left_closes, right_closes happen at once at t = .* move their times apart"):
        module.simulate((0, 1), q={"y": 1.0}, sensitivities=["theta(0)"])
    flat = module.simulate((0, 1), q={"y": 1.0}, sensitivities=["y(0)"])  # they stay together
    assert flat.success
    with pytest.raises(EvaluationError, match="happen at once"):
        module.gradient(sd.Loss(end=sp.Symbol("y")), ["y(0)"], (0, 1), q={"y": 1.0})
    # A fall whose impact is between sticking and sliding.
    normal = np.sqrt(2 * G * 0.5)
    with pytest.warns(SimulationWarning, match=r"sole_closes at t = .*: the state after it has no derivative there"):
        mass.simulate((0, 0.5), q={"y": 0.5}, u={"x_dot": 0.3 * normal}, rtol=1e-12, sensitivities=["x_dot(0)"])


@pytest.mark.parametrize(("more", "grazed"), [(1e-13, True), (4e-13, True), (7e-13, False)])
def test_contact_that_is_grazed_has_no_derivative(more: float, grazed: bool) -> None:
    """A ball that has sqrt(2 more) of its speed left at the ceiling, compared with what gravity takes in a millionth of the time
    of the flight, 1e-6 of its speed."""
    system = sd.System("thrown", gravity=[0, -G])
    body = system.add_body("ball", mass=1.0)
    system.add_joint(sd.Prismatic("height", system.ground, body, axis=[0, 1], coordinate=sd.coordinates("y")))
    ceiling = (sd.contacts.Point(), sd.contacts.Plane([0, -1], [0, 1]))
    system.add_contact(sd.Contact("ceiling", body, system.ground, shape=ceiling))
    module = system.compile()
    with warnings.catch_warnings(record=True) as found:
        warnings.simplefilter("always")
        module.simulate((0, 1), u=[np.sqrt(2 * G) * (1 + more)], rtol=1e-12, sensitivities=["y(0)"])
    message = "ceiling_closes at t = 0.4515.* grazes: its quantity has no rate"
    assert any(re.search(message, str(one.message)) for one in found) == grazed


def test_what_does_not_go_with_contacts_is_rejected(ball: Any) -> None:
    with pytest.raises(EvaluationError, match="not both; set happened as well: leave them out"):
        ball.gradient(sd.Loss(end=sp.Symbol("y")), ["e"], (0, 2.95), q=[1.0])
    with pytest.raises(ArgumentError, match=r"floor by 0.2 m; start from q"):
        ball.gradient(sd.Loss(end=sp.Symbol("y")), ["e"], (0, 1), q=[-0.2])
    with pytest.raises(ArgumentError, match="floor_closed says in which mode the contact floor is"):
        ball.simulate((0, 1), q=[1.0], sensitivities=["floor_closed"])
