"""Sensitivities of a motion against closed forms, differences of motions with more digits, and what they have to fulfil."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from functools import cache, partial
from typing import Any

import mpmath as mp
import numpy as np
import pytest
import sympy as sp

import symdyn as sd
from symdyn.errors import ArgumentError, SimulationWarning
from symdyn.precision.extrapolation import integrate
from symdyn.precision.motion import Precise
from symdyn.runtime.building.compiler import find_compiler
from symdyn.runtime.integrating.stabilization import Projector

pytestmark = pytest.mark.skipif(find_compiler() is None, reason="no C compiler here")

EXPLICIT = ("dop853", "bs54", "taylor", "gauss")
IMPLICIT = ("radau", "radau5")


@cache
def pendulum() -> Any:
    return sd.systems.pendulum().embedding().compile()


@cache
def four_bar() -> Any:
    return sd.systems.four_bar().augmented().compile()


@cache
def cart() -> Any:
    return sd.systems.cart_pole().embedding().compile()


@cache
def top() -> Any:
    """Lagrange's top: precession, nutation and spin about a fixed point."""
    phi, theta, psi = sd.coordinates("phi theta psi")
    m, g, s, A, C = sd.parameters("m g s A C", positive=True)
    system = sd.System("lagrange_top", gravity=[0, 0, -g])
    first, second = system.add_body("first"), system.add_body("second")
    body = system.add_body("top", mass=m, com=[0, 0, s], inertia=[A - m * s**2, A - m * s**2, C])
    system.add_joint(sd.Revolute("precession", system.ground, first, axis=[0, 0, 1], coordinate=phi))
    system.add_joint(sd.Revolute("nutation", first, second, axis=[1, 0, 0], coordinate=theta))
    system.add_joint(sd.Revolute("spin", second, body, axis=[0, 0, 1], coordinate=psi))
    system.defaults = {m: 1, g: 9.81, s: 0.1, A: 0.02, C: 0.005}
    return system.embedding().compile()


def nutation(t: Any, s: Any, A: Any, C: Any, theta: Any, spin: Any) -> Any:
    """The inclination of the top that is let go at rest but for its spin: elliptic functions (Goldstein, section 5.7)."""
    u0, weight = mp.cos(theta), mp.mpf(9.81) * s
    p = C * spin
    # u_dot^2 = (1 - u^2) 2 weight (u0 - u)/A - p^2 (u0 - u)^2/A^2, which vanishes at the start, a cusp
    b = p * p / (4 * weight * A)
    root = mp.sqrt(b * b - 2 * b * u0 + 1)
    low, high = b - root, b + root
    k2 = (u0 - low) / (high - low)
    rate = mp.sqrt(weight * (high - low) / (2 * A))
    return mp.acos(low + (u0 - low) * mp.ellipfun("sn", mp.ellipk(k2) + rate * t, m=k2) ** 2)


def swing(t: Any, g: Any, length: Any, start: Any) -> Any:
    """The angle of a mathematical pendulum that is let go at `start`: elliptic functions."""
    k, omega = mp.sin(start / 2), mp.sqrt(g / length)
    return 2 * mp.asin(k * mp.ellipfun("sn", mp.ellipk(k * k) - omega * t, m=k * k))


def derivatives(function: Callable[..., Any], times: np.ndarray, at: dict[str, float]) -> np.ndarray:
    """Derivatives of a closed form of t and some numbers by each of them, (n_t, n), by differences at 40 digits."""
    with mp.workdps(40):
        values = [mp.mpf(v) for v in at.values()]
        step = mp.mpf(10) ** -13

        def slope(t: Any, j: int) -> float:
            moved = [[v + way * step * (k == j) for k, v in enumerate(values)] for way in (-1, 1)]
            return float((function(t, *moved[1]) - function(t, *moved[0])) / (2 * step))

        return np.array([[slope(mp.mpf(float(t)), j) for j in range(len(values))] for t in times])


TIMES = np.linspace(0, 5, 6)
SWING = {"g": 9.81, "l": 1.0, "q1(0)": 2.0}


@cache
def swung() -> np.ndarray:
    return derivatives(swing, TIMES[1:], SWING)


@pytest.mark.parametrize("method", [*EXPLICIT, *IMPLICIT])
def test_pendulum_against_elliptic_integrals(method: str) -> None:
    """The error follows the tolerance."""
    errors = []
    for rtol in (1e-6, 1e-8, 1e-10):
        found = pendulum().simulate(TIMES, [2.0], rtol=rtol, method=method, sensitivities=list(SWING)).sensitivity
        errors.append(np.abs(found.of("q1")[1:] - swung()).max())
        assert errors[-1] < 500 * rtol
    assert errors[2] < 1e-2 * errors[0] or errors[0] < 1e-9  # the steps of gauss follow the time in which the state changes


@pytest.mark.parametrize("method", ["dop853", "taylor", "radau"])
def test_lagrange_top_against_elliptic_functions(method: str) -> None:
    times, at = np.linspace(0, 1, 5), {"s": 0.1, "A": 0.02, "C": 0.005, "theta(0)": 1.0, "psi_dot(0)": 60.0}
    exact = derivatives(nutation, times[1:], at)
    errors = []
    for rtol in (1e-7, 1e-10):
        run = top().simulate(times, {"theta": 1.0}, {"psi_dot": 60.0}, rtol=rtol, method=method, sensitivities=list(at))
        errors.append((np.abs(run.sensitivity.of("theta")[1:] - exact) / np.abs(exact).max(axis=0)).max())
        assert errors[-1] < 2e3 * rtol
    assert errors[1] < 1e-2 * errors[0]


@cache
def precise() -> Precise:
    return Precise(sd.systems.n_link_pendulum(2).embedding(), 30)


def precise_end(name: str, change: Any) -> list[Any]:
    """The state of a double pendulum after 1 s with one number changed, with more digits."""
    of = precise()
    context, fixed, start = of.context, dict(of.fixed), list(of.start)
    start[:2] = [context.mpf(1), context.mpf("0.5")]
    if name.endswith("(0)"):
        start[of.leaves.index(name[:-3]) - 1] += change
    else:
        fixed[name] += change
    before, of.fixed = of.fixed, fixed
    of._programs.clear()
    try:
        run = integrate(partial(of, "rhs"), (context.mpf(0), context.mpf(1)), start, context.mpf(10) ** -22,
                        [slice(0, 2), slice(2, 4)], context)
    finally:
        of.fixed = before
    return list(run.x)


@pytest.mark.sweep
def test_double_pendulum_against_more_digits() -> None:
    """The error follows the tolerance, here against differences of motions of 22 digits."""
    names = ["m1", "l1", "q2(0)"]
    module = sd.systems.n_link_pendulum(2).embedding().compile()
    step = precise().context.mpf(10) ** -7
    exact = np.array([[float((b - a) / (2 * step)) for a, b in zip(precise_end(n, -step), precise_end(n, step), strict=True)]
                      for n in names])
    errors = []
    for rtol in (1e-6, 1e-9, 1e-12):
        run = module.simulate((0, 1), [1.0, 0.5], rtol=rtol, sensitivities=names)
        errors.append(np.abs(np.array([run.sensitivity[n][-1] for n in names]) - exact).max() / np.abs(exact).max())
        assert errors[-1] < 100 * rtol
    assert errors[2] < 1e-4 * errors[0]


def differences(module: Any, name: str, run: Any, step: float) -> np.ndarray:
    """Derivative of a motion, by differences of fourth order of motions from the consistent states nearest to the start."""
    metadata = module.metadata
    n_q, n_u = metadata.sizes.q, metadata.sizes.u

    def moved(change: float) -> np.ndarray:
        p, x = run.params.copy(), run.x[0].copy()
        if name.endswith("(0)"):
            x[metadata.x.index(name[:-3])] += change
        else:
            p[metadata.parameters.index(name)] += change
        x = Projector(module, p)(float(run.t[0]), x)
        return module.simulate(run.t, x[:n_q], x[n_q:n_q + n_u], p, z=x[n_q + n_u:], rtol=1e-13).x

    return (8 * (moved(step) - moved(-step)) - (moved(2 * step) - moved(-2 * step))) / (12 * step)


@pytest.mark.parametrize("method", ["dop853", "bs54", "taylor", *IMPLICIT])
def test_four_bar_against_consistent_motions(method: str) -> None:
    module = four_bar()
    run = module.simulate(np.linspace(0, 1, 21), rtol=1e-9, method=method, sensitivities=["l1", "lc1", "q1(0)", "q1_dot(0)"])
    for name in run.sensitivity:
        expected = differences(module, name, run, 2e-5)
        assert np.abs(run.sensitivity[name] - expected).max() < 2e-8 * np.abs(expected).max()


def test_constraints_hold_for_sensitivities() -> None:
    """C and its rate stay zero along every sensitivity, at the output times as at the steps."""
    module, names = four_bar(), ["l1", "lc1", "q1(0)", "q1_dot(0)"]
    run = module.simulate((0, 2), rtol=1e-6, sensitivities=names)
    for k, name in enumerate(names):
        for function in ("C", "C_dot"):
            rows = []
            for way in (-1e-5, 1e-5):
                p = run.params.copy()
                if name in module.metadata.parameters:
                    p[module.metadata.parameters.index(name)] += way
                rows.append(module.evaluate(function, run.t, run.x + way * run.sensitivity.matrix[:, :, k], p))
            size = np.abs(run.sensitivity[name]).max()
            assert np.abs(rows[1] - rows[0]).max() / 2e-5 < 1e-8 * max(size, 1.0) ** 2


def free_body() -> Any:
    """A body that turns by Euler parameters."""
    m, a, b, c = sd.parameters("m a b c", positive=True)
    system = sd.System("body")
    body = system.add_body("body", mass=m, inertia=[a, b, c])
    system.add_joint(sd.Free("free", system.ground, body, coordinates=sd.coordinates("x y z p0 p1 p2 p3"),
                             orientation=sd.EulerParameters()))
    system.defaults = {m: 1, a: 1, b: 2, c: 3}
    return system.embedding().compile()


def test_euler_parameters_stay_of_unit_length() -> None:
    module = free_body()
    u = dict(zip(module.metadata.u, [0, 0, 0, 1.0, 2.0, 0.5], strict=True))
    run = module.simulate((0, 3), u=u, rtol=1e-9, sensitivities=["a", "p1(0)", f"{module.metadata.u[3]}(0)"])
    places = [module.metadata.x.index(f"p{k}") for k in range(4)]
    assert np.abs(np.einsum("ti,tij->tj", run.x[:, places], run.sensitivity.matrix[:, places])).max() < 1e-14
    expected = differences(module, "a", run, 1e-4)
    assert np.abs(run.sensitivity["a"] - expected).max() < 1e-8 * np.abs(expected).max()


def test_stiff_state_against_its_closed_form() -> None:
    """z_dot = -k (z - cos w t): a transient, then slow motion; explicit steps would be limited by k."""
    q, z = sd.coordinates("q z")
    k, w, m = sd.parameters("k w m", positive=True)
    system = sd.System("lag")
    body = system.add_body("body", mass=m)
    system.add_joint(sd.Prismatic("slide", system.ground, body, axis=[1, 0], coordinate=q))
    system.add_state(z, -k * (z - sp.cos(w * sd.t)))
    system.defaults = {k: 1e4, w: 3, m: 1}
    module = system.embedding().compile()

    def exact(t: Any, k: Any, w: Any, start: Any) -> Any:
        forced = lambda t: k * (k * mp.cos(w * t) + w * mp.sin(w * t)) / (k * k + w * w)
        return forced(t) + (start - forced(0)) * mp.exp(-k * t)

    times = np.array([0.0, 1e-5, 1e-4, 1e-3, 0.1, 1.0, 2.0])
    expected = derivatives(exact, times, {"k": 1e4, "w": 3.0, "z(0)": 2.0})
    for method in IMPLICIT:
        run = module.simulate(times, z={"z": 2.0}, rtol=1e-8, method=method, sensitivities=["k", "w", "z(0)"])
        assert run.n_steps < 600
        assert (np.abs(run.sensitivity.of("z") - expected) * [1e4, 3, 1]).max() < 1e-6


def test_constant_input() -> None:
    module = cart()
    names = ["F", "m_c", "l"]
    run = module.simulate((0, 1), [0, 0.5], inputs=[0.7], rtol=1e-11, sensitivities=names)
    changed = [module.simulate((0, 1), [0, 0.5], inputs=[0.7 + h], rtol=1e-13).x for h in (-1e-4, 1e-4)]
    expected = (changed[1] - changed[0]) / 2e-4
    assert np.abs(run.sensitivity["F"] - expected).max() < 1e-8 * np.abs(expected).max()


def test_outputs_against_differences() -> None:
    q1, q2 = sd.coordinates("q1 q2")
    m, length, g, d = sd.parameters("m l g d", positive=True)
    system = sd.System("double", gravity=[0, -g])
    upper, lower = system.add_body("upper", mass=m, com=[length, 0]), system.add_body("lower", mass=m, com=[length, 0])
    system.add_joint(sd.Revolute("a", system.ground, upper, coordinate=q1))
    system.add_joint(sd.Revolute("b", upper, lower, parent_point=[length, 0], coordinate=q2))
    system.add_output("tip", sd.position(lower, [length, 0]))
    system.add_output("stretch", d * q1.dot * length)
    system.defaults = {m: 1, length: 1, g: 9.81, d: 2}
    module = system.embedding().compile()
    start = {"t": (0, 1), "q": [0.3, 0.5], "rtol": 1e-13}
    with pytest.warns(SimulationWarning, match="nothing in this motion depends on d"):
        run = module.simulate(**start, sensitivities=["l", "d", "q1(0)"])
    for k, (name, value) in enumerate((("l", 1.0), ("d", 2.0))):
        ends = [module.simulate(**start, params={name: value + h}).outputs for h in (-6e-4, -3e-4, 3e-4, 6e-4)]
        for output in ("tip", "stretch"):
            expected = (ends[0][output] - 8 * ends[1][output] + 8 * ends[2][output] - ends[3][output]) / 36e-4
            assert np.abs(run.sensitivity.of(output)[..., k] - expected).max() < 1e-8
    assert run.sensitivity.of("tip").shape == (1001, 2, 3) and run.sensitivity.of("stretch").shape == (1001, 3)
    np.testing.assert_array_equal(run.sensitivity.of(q1), run.sensitivity.matrix[:, 0])


def test_errors_of_the_state_alone_leave_its_steps_as_they_are() -> None:
    plain = pendulum().simulate((0, 5), [2.0], rtol=1e-7, steps=True)
    alone = pendulum().simulate((0, 5), [2.0], rtol=1e-7, steps=True, sensitivities=["g", "l"], sensitivity_control=False)
    both = pendulum().simulate((0, 5), [2.0], rtol=1e-7, steps=True, sensitivities=["g", "l"])
    assert alone.n_steps == plain.n_steps < both.n_steps
    np.testing.assert_allclose(alone.t, plain.t, rtol=0, atol=1e-9)  # rounding of the error estimate moves them


def test_between_the_times_of_a_run_and_backward() -> None:
    run = pendulum().simulate((0, 5), [2.0], rtol=1e-9, sensitivities=["g", "q1(0)"])
    np.testing.assert_array_equal(run.sensitivity.at(run.t[::-50]), run.sensitivity.matrix[::-50])
    np.testing.assert_array_equal(run(run.t[77]), run.x[77])
    assert run.sensitivity.at(1.2345).shape == (2, 2)
    back = pendulum().simulate((5, 0), run.x[-1, :1], run.x[-1, 1:], rtol=1e-11, sensitivities=["q1(0)", "q1_dot(0)"])
    forth = pendulum().simulate((0, 5), [2.0], rtol=1e-11, sensitivities=["q1(0)", "q1_dot(0)"])
    np.testing.assert_allclose(back.sensitivity.matrix[-1] @ forth.sensitivity.matrix[-1], np.eye(2), rtol=0, atol=1e-7)


def test_names() -> None:
    run = pendulum().simulate((0, 1), [1.0], sensitivities=[sd.parameters("g"), "l", "q1(0)"])
    assert list(run.sensitivity) == ["g", "l", "q1(0)"] and len(run.sensitivity) == 3 and sd.parameters("l") in run.sensitivity
    np.testing.assert_array_equal(run.sensitivity[sd.parameters("l")], run.sensitivity["l"])
    assert repr(run.sensitivity) == "<Sensitivity of 2 states at 1001 times by g, l, q1(0)>"
    with pytest.raises(ArgumentError, match=r"no sensitivity by 'm'; it has those by g, l, q1\(0\)"):
        run.sensitivity["m"]
    with pytest.raises(ArgumentError, match=r"neither a state nor an output; did you mean q1"):
        run.sensitivity.of("q12")
    with pytest.raises(ArgumentError, match=r"this motion has no sensitivities; pass simulate\(..., sensitivities=\[...\]\)"):
        _ = pendulum().simulate((0, 1), [1.0]).sensitivity


@pytest.mark.parametrize(("asked", "message"), [
    ("g", r"pass a list of parameters, inputs and initial values, such as \['g', 'q1\(0\)'\]"),
    (7, "sensitivities is 7; pass a list"),
    (["gg"], r"neither a parameter, an input nor the initial value of a state; did you mean g\?"),
    (["q7(0)"], r"did you mean q1\(0\)"),
    ([None], "neither a parameter"),
    (["q1"], r"which is a state; for that by its initial value pass 'q1\(0\)'"),
    (["g", "l", "g"], "name g twice; leave one out")])
def test_what_is_asked_for(asked: Any, message: str) -> None:
    with pytest.raises(ArgumentError, match=message):
        pendulum().simulate((0, 1), [1.0], sensitivities=asked)


def test_what_does_not_fit() -> None:
    ask = {"t": (0, 0.1), "sensitivities": ["l"]}
    with pytest.raises(ArgumentError, match=r"only compiled methods integrate them: compile\(backend='c'\)"):
        pendulum().simulate(**ask, method="RK45")
    with pytest.raises(ArgumentError, match="only compiled methods"):
        sd.systems.pendulum().embedding().compile(backend="numpy").simulate(**ask)
    with pytest.raises(ArgumentError, match="sensitivities were asked for with method 'ggl' on the backend c; only compiled"):
        sd.systems.four_bar().augmented().compile().simulate((0, 0.1), method="ggl", sensitivities=["g"])
    with pytest.raises(ArgumentError, match="together with work=True; make two runs"):
        pendulum().simulate(**ask, work=True)
    with pytest.raises(ArgumentError, match="with Baumgarte's stabilization; they are those of the projected motion"):
        four_bar().simulate((0, 0.1), sensitivities=["l1"], stabilization="baumgarte")
    follows = {"F": lambda t, x: -x[0]}
    with pytest.raises(ArgumentError, match="inputs follow the state through a function of the user"):
        cart().simulate(**ask, inputs=follows)
    with pytest.raises(ArgumentError, match=r"by the input F was asked for, which varies over time here"):
        cart().simulate((0, 0.1), sensitivities=["F"], inputs={"F": lambda t, x: np.sin(t)})
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        cart().simulate(**ask, inputs={"F": lambda t, x: np.sin(t)})  # of the time alone


def test_what_has_no_effect() -> None:
    with pytest.warns(SimulationWarning, match=r"nothing in this motion depends on m: the sensitivities are zero"):
        run = pendulum().simulate((0, 1), [1.0], sensitivities=["m", "l"])
    assert not run.sensitivity["m"].any() and run.sensitivity["l"].any()


@cache
def common() -> Any:
    """A double pendulum with a common factor of all masses, which cancels, and a force that acts for a while in between."""
    a, b = sd.coordinates("a b")
    factor, push = sd.parameters("factor push")
    system = sd.System("common", gravity=[0, -9.81])
    upper = system.add_body("upper", mass=factor, inertia=0.01 * factor, com=[0, -0.5])
    lower = system.add_body("lower", mass=1.7 * factor, inertia=0.03 * factor, com=[0, -0.4])
    system.add_joint(sd.Revolute("a", system.ground, upper, a))
    system.add_joint(sd.Revolute("b", upper, lower, b, parent_point=[0, -1]))
    system.add_joint_force("b", factor * push * sp.Max(0, (sd.t - 1) * (1.5 - sd.t)) ** 3)
    system.defaults = {factor: 1.3, push: 0.1}
    return system.compile()


def test_what_cancels_has_no_effect() -> None:
    """Rounding that unstable motions magnify to 1e-7 is distinguished from sensitivities."""
    with pytest.warns(SimulationWarning, match="depends on m, which cancels in its equations: the sensitivities are zero"):
        run = pendulum().simulate((0, 3), [1.0], params={"l": 1.1}, sensitivities=["m"])
    assert 0 < np.abs(run.sensitivity["m"]).max() < 1e-12
    module, t = common(), np.array([0, 5.0])
    with pytest.warns(SimulationWarning, match="nothing in this motion depends on factor, which cancels") as found:
        run = module.simulate(t, [2.9, 0.4], rtol=1e-10, sensitivities=["factor", "push", "a(0)"])
    assert len(found) == 1 and np.abs(run.sensitivity["factor"]).max() > 1e-11
    # A load that acts where there are no rows has an effect.
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        run = module.simulate(np.array([0, 3.0]), [0.1, 0.1], rtol=1e-10, sensitivities=["push"])
    ends = [module.simulate(np.array([0, 3.0]), [0.1, 0.1], params={"push": value}, rtol=1e-13).x[-1] for value in (0.099, 0.101)]
    np.testing.assert_allclose(run.sensitivity["push"][-1], (ends[1] - ends[0]) / 2e-3, rtol=1e-6)


def test_what_may_have_an_effect_elsewhere_is_not_judged() -> None:
    """A parameter that the equations cannot be evaluated without, and one that only an event contains."""
    y = sd.coordinates("y")
    level, root, e = sd.parameters("level root e")
    system = sd.System("judged", gravity=[0, -9.81])
    body = system.add_body("ball", mass=1)
    joint = system.add_joint(sd.Prismatic("fall", system.ground, body, y, axis=[0, 1]))
    system.add_joint_force(joint, 0.1 * sp.sqrt(1 - root) * y)
    system.add_event("bounce", y - level, reset={y.dot: -e * y.dot})
    system.defaults, system.initial = {level: 0.2, root: 0.9, e: 0.8}, {y: 1}
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        run = system.compile().simulate(np.array([0, 0.6]), rtol=1e-10, sensitivities=["level", "root", "e"])
    assert (np.abs(run.sensitivity.matrix[-1, 0]) > 1e-3).all()


def test_steps_next_to_a_singular_configuration_are_warned_of() -> None:
    """A slider-crank of equal bars at its dead point: where steps land next to it the sensitivities lose digits."""
    module = sd.systems.get("slider_crank").augmented().compile()
    starts = [(a, w) for a in np.linspace(0.8, 1.2, 8) for w in (2.1, 3.0, 3.9)]
    off = {True: [], False: []}
    for a, w in starts:
        asked = {"q": [a, -2 * a], "u": [w, -2 * w], "sensitivities": {"phi_dot(0)": [0, 0, -0.5, 1]}}
        reference = module.simulate([0, 0.5], method="bs54", rtol=1e-11, **asked).sensitivity["phi_dot(0)"][-1]
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            found = module.simulate([0, 0.5], method="radau", rtol=1e-10, **asked).sensitivity["phi_dot(0)"][-1]
        off[bool(caught)].append(float(np.abs(found - reference).max() / np.abs(reference).max()))
        assert all("next to a singular configuration, at t = " in str(one.message) for one in caught)
    assert max(off[False]) < 1e-9  # ten tolerances
    assert len(off[True]) > 1 and max(off[True]) > 1e-8


@cache
def three_cranks() -> Any:
    """A parallelogram with three cranks, which moves as long as they are equally long."""
    a, b, c, e = sd.coordinates("a b c e")
    l1, l2, l3, d = sd.parameters("l1 l2 l3 d")
    system = sd.System("parallelogram", gravity=[0, -9.81])
    bars = {name: system.add_body(name, mass=1, inertia=0.1, com=[length / 2, 0])
            for name, length in (("left", l1), ("beam", 2 * d), ("middle", l2), ("right", l3))}
    system.add_joint(sd.Revolute("j1", system.ground, bars["left"], a))
    system.add_joint(sd.Revolute("j2", bars["left"], bars["beam"], b, parent_point=[l1, 0]))
    system.add_joint(sd.Revolute("j3", system.ground, bars["middle"], c, parent_point=[d, 0]))
    system.add_joint(sd.Revolute("j4", system.ground, bars["right"], e, parent_point=[2 * d, 0]))
    system.close_loop(sd.Revolute("j5", bars["beam"], bars["middle"], parent_point=[d, 0], child_point=[l2, 0]))
    system.close_loop(sd.Revolute("j6", bars["beam"], bars["right"], parent_point=[2 * d, 0], child_point=[l3, 0]))
    system.defaults, system.initial = {l1: 1, l2: 1, l3: 1, d: 1}, {a: 1, b: -1, c: 1, e: 1}
    return system.compile()


def test_parameters_that_dependent_constraints_hold() -> None:
    """Nothing can be differentiated by the length of one of three cranks."""
    module = three_cranks()
    with pytest.raises(ArgumentError, match=r"sensitivities by l2 were asked for, but the constraints depend on each other at "
                                            r"the start, and to first order no position fulfils them when l2 changes alone"):
        module.simulate((0, 0.3), sensitivities=["d", "l2"])
    with pytest.raises(ArgumentError, match=r"no position fulfils them when l3 changes alone"):
        module.gradient(sd.Loss(end=sd.coordinates("a")), ["l3"], (0, 0.3))
    found = module.simulate((0, 0.3), rtol=1e-10, sensitivities=["d"]).sensitivity["d"]
    np.testing.assert_allclose(found, 0, atol=1e-12)  # the beam does not turn: where it is held does not matter
