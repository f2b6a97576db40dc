"""Tables of inputs: steps end at their times, straight or smooth between them, beyond them an error unless ends are held.

A mass that a force pushes moves by the second integral of the force, which is known exactly of a piecewise polynomial.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import pytest
from scipy.interpolate import BSpline, CubicSpline, PPoly, UnivariateSpline, make_interp_spline

import symdyn as sd
from symdyn.errors import ArgumentError

TIMES = np.array([0.0, 0.4, 0.5, 1.3, 2.0, 2.05, 3.0])
FORCES = np.array([0.0, 3.0, -2.0, 1.0, 1.0, 4.0, -1.0])
T = np.linspace(0.0, 3.0, 31)


@cache
def pushed(backend: str = "c") -> Any:
    """x_ddot = F + G, of a mass of 1 kg; event: x passes 1 m upwards."""
    x = sd.coordinates("x")
    F, G = sd.inputs("F G")
    system = sd.System("pushed")
    mass = system.add_body("mass", mass=1, inertia=[1, 1, 1])
    system.add_joint(sd.Prismatic("slide", parent=system.ground, child=mass, axis=[1, 0, 0], coordinate=x))
    system.add_force(mass, [F + G, 0, 0])
    system.add_event("arrived", x - 1, direction=1)
    return system.compile(backend=backend)


def spline(interpolation: str, times: np.ndarray = TIMES, values: np.ndarray = FORCES) -> PPoly:
    if interpolation == "cubic":
        return CubicSpline(times, values)
    return PPoly(np.stack([np.diff(values) / np.diff(times), values[:-1]]), times)


def moved(force: PPoly, t: np.ndarray = T) -> np.ndarray:
    """From rest at 0 at the first time of the table."""
    return np.asarray(force.antiderivative(2)(t))


@pytest.mark.parametrize("backend", ["c", "numpy"])
@pytest.mark.parametrize(("given", "most"), [
    (CubicSpline(TIMES, FORCES), 1e-12), (make_interp_spline(TIMES, FORCES, k=3), 1e-12), (spline("linear"), 1e-12),
    (PPoly([[1.0, -2.0]], [0.0, 1.7, 3.0]), 1e-8)], ids=["cubic", "in B-form", "straight", "jumps"])
def test_splines_of_scipy_are_taken_as_they_are(given: Any, most: float, backend: str) -> None:
    """B-splines too, and to the tolerance those that jump; called with a state, a spline would take it for an order."""
    found = pushed(backend).simulate(T, inputs={"F": given}, rtol=1e-9)
    whole = PPoly.from_spline(given) if isinstance(given, BSpline) else given
    assert found.success
    np.testing.assert_allclose(found.q[:, 0], moved(whole), rtol=0, atol=most)


@pytest.mark.parametrize(("given", "message"), [
    (CubicSpline([0, 1, 2, 3], [0, 1, 1, 0], bc_type="periodic"), "a periodic spline; pass one of order three at most that "
     r"covers the run, or pass the function lambda t, x: float\(spline\(t\)\)"),
    (make_interp_spline(TIMES, FORCES, k=5), "a spline of order 5; pass one of order three at most"),
    (CubicSpline(TIMES[:4], FORCES[:4]), "holds from t = 0 s to 1.3 s, and the run goes from 0 s to 3 s; pass one of the whole"),
    (CubicSpline(TIMES, np.column_stack([FORCES, FORCES])), r"is a spline with coefficients of shape \(4, 6, 2\); pass one of a "
     "single real, finite value"),
    (UnivariateSpline(TIMES, FORCES), "which is no piecewise polynomial; pass the function lambda t, x: float"),
], ids=["periodic", "order 5", "short", "two values", "another kind"])
def test_splines_that_do_not_fit(given: Any, message: str) -> None:
    with pytest.raises(ArgumentError, match=f"^pushed: inputs: F .*{message}"):
        pushed().simulate(T, inputs={"F": given})


def test_a_spline_alone_is_that_of_the_only_input() -> None:
    cart = sd.systems.cart_pole().compile(backend="numpy")
    force = CubicSpline(TIMES, FORCES)
    alone, named = cart.simulate(T, inputs=force), cart.simulate(T, inputs={"F": force})
    assert (alone.x == named.x).all() and np.ptp(alone["F"]) > 1


@pytest.mark.every_value
@pytest.mark.parametrize("interpolation", ["linear", "cubic"])
@pytest.mark.parametrize(("backend", "method", "most"), [
    ("c", "dop853", 1e-13), ("c", "bs54", 1e-13), ("c", "radau", 1e-8), ("numpy", "DOP853", 1e-13), ("numpy", "RK45", 1e-13),
    ("numpy", "Radau", 1e-6), ("numpy", "BDF", 1e-5), ("numpy", "LSODA", 1e-4)])
def test_the_second_integral_of_a_table(backend: str, method: str, most: float, interpolation: str) -> None:
    """At a loose tolerance: explicit steps that end at the times of the table are exact for its polynomials. (Forces of order
    three make motions of order five, more than what pairs of order five and the polynomial of SciPy's Radau know within a step:
    there it is the tolerance that holds, 1e-6 of 10 m.)"""
    found = pushed(backend).simulate(T, inputs={"F": (TIMES, FORCES)}, interpolation=interpolation, method=method, rtol=1e-6)
    assert found.success and (found.t == T).all()
    between = {"bs54": 1e-4, "RK45": 1e-4, "Radau": 1e-5, "BDF": 1e-3}.get(method, most) if interpolation == "cubic" else most
    np.testing.assert_allclose(found.q[:, 0], moved(spline(interpolation)), rtol=0, atol=between)
    np.testing.assert_allclose(found["F"], spline(interpolation)(T), rtol=1e-14, atol=1e-13)


@pytest.mark.parametrize("backend", ["c", "numpy"])
def test_a_motion_backward_ends_its_steps_at_the_same_times(backend: str) -> None:
    force = spline("linear")
    end, speed = moved(force)[-1], float(force.antiderivative()(3.0))
    both = np.column_stack([FORCES, 0 * FORCES])
    found = pushed(backend).simulate(T[::-1], q=[end], u=[speed], inputs=(TIMES, both), rtol=1e-6)
    np.testing.assert_allclose(found.q[::-1, 0], moved(force), rtol=0, atol=1e-13)


@pytest.mark.parametrize("span", [(0.0, 1000.0), (1000.0, 0.0), (-1000.0, 0.0)])
def test_no_step_ends_within_rounding_of_an_end(span: tuple[float, float]) -> None:
    """A table has a kink a unit in the last place before an end, as where times are sums."""
    kink = np.nextafter(1000.0, 0.0) * np.sign(sum(span))
    times = np.sort([-2000.0, kink, 2000.0])
    found = pushed("numpy").simulate(span, inputs={"F": (times, [0.0, 1.0, 0.0])}, steps=True)
    assert found.success and np.abs(np.diff(found.t)).min() > 1e-9


@pytest.mark.parametrize("backend", ["c", "numpy"])
def test_a_road_of_many_points_takes_little_more_than_a_step_for_each(backend: str) -> None:
    """A step of order 8 has 12 evaluations; across kinks it took ten times as many steps."""
    x = sd.coordinates("x")
    road = sd.inputs("road")
    system = sd.System("quarter_car")
    body = system.add_body("body", mass=300, inertia=[1, 1, 1])
    system.add_joint(sd.Prismatic("strut", parent=system.ground, child=body, axis=[0, 0, 1], coordinate=x))
    system.add_force(body, [0, 0, 2e4 * (road - x) - 1500 * x.dot])
    module = system.compile(backend=backend)
    end, n = (15.0, 300) if backend == "c" else (2.0, 40)
    times = np.linspace(0, end, n + 1)
    heights = 0.01 * np.sin(np.outer(times, np.linspace(0.3, 12, 30)) + np.arange(30) ** 2).sum(axis=1)
    for interpolation in ("linear", "cubic"):
        found = module.simulate((0, end), inputs=(times, heights), interpolation=interpolation)
        assert found.nfev < 1.4 * 12 * n + 100
        fine = module.simulate((0, end), inputs=(times, heights), interpolation=interpolation, rtol=1e-12)
        assert np.abs(found.x - fine.x).max() < 1e-8


@pytest.mark.parametrize("backend", ["c", "numpy"])
def test_each_input_has_a_table_of_its_own(backend: str) -> None:
    other, values = np.array([-1.0, 0.45, 1.7, 3.5]), np.array([0.2, -0.5, 0.1, 1.0])
    base = moved(spline("linear"))
    extra = spline("cubic", other, values)
    both = base + extra.antiderivative(2)(T) - extra.antiderivative(2)(0.0) - T * extra.antiderivative()(0.0)
    smooth = sd.Table(other, values, interpolation="cubic")
    given: list[tuple[Any, np.ndarray]] = [
        ({"F": (TIMES, FORCES), "G": smooth}, both),
        ({"F": sd.Table(TIMES, FORCES), "G": lambda t, x: extra(t)}, both),
        ({"G": (TIMES, FORCES), "F": 2.0}, base + T**2),
        (sd.Table(TIMES, np.column_stack([FORCES, 2 + 0 * FORCES])), base + T**2)]
    for inputs, wanted in given:
        found = pushed(backend).simulate(T, inputs=inputs, rtol=1e-9)
        np.testing.assert_allclose(found.q[:, 0], wanted, rtol=0, atol=1e-9)


@pytest.mark.parametrize("backend", ["c", "numpy"])
def test_events_and_the_work_of_loads_along_a_table(backend: str) -> None:
    force = spline("linear")
    found = pushed(backend).simulate((0, 3), inputs={"F": (TIMES, FORCES)}, work=True, rtol=1e-10)
    roots = (force.antiderivative(2)).solve(1.0, extrapolate=False)
    assert len(found.events["arrived"].t) == len(roots) == 1
    np.testing.assert_allclose(found.events["arrived"].t, roots, rtol=1e-10)
    assert found.energy_error() < 1e-10


def test_steps_are_stored_and_stop_as_asked() -> None:
    found = pushed().simulate((0, 3), inputs={"F": (TIMES, FORCES)}, steps=True, rtol=1e-6)
    assert set(TIMES) <= set(found.t)
    with pytest.warns(sd.SimulationWarning, match="4 steps were done"):
        assert pushed().simulate((0, 3), inputs={"F": (TIMES, FORCES)}, steps=True, max_steps=4).n_steps == 4


@pytest.mark.parametrize("backend", ["c", "numpy"])
@pytest.mark.parametrize("span", [(0.0, 3.1), (-0.1, 3.0), (3.1, 0.0)])
def test_beyond_a_table_is_an_error_unless_its_ends_are_held(backend: str, span: tuple[float, float]) -> None:
    module = pushed(backend)
    message = (r"pushed: the table of the input F holds from t = 0 s to 3 s, and the run goes from -?[0-9.]+ s to [0-9.]+ s; "
               r"pass a table of the whole run, or extend='hold'")
    for run in (module.simulate, lambda t, **given: module.simulate_batch(q=np.zeros((2, 1)), t=t, **given)):
        for table in ((TIMES, FORCES), sd.Table(TIMES, FORCES, "cubic")):
            with pytest.raises(ArgumentError, match=message):
                run(t=span, inputs={"F": table})
    for kind in ("linear", "cubic"):
        held = module.simulate((-1.0, 4.0), inputs={"F": (TIMES, FORCES + 1)}, extend="hold", interpolation=kind, rtol=1e-6)
        force = spline(kind, TIMES, FORCES + 1)
        first, last = force.antiderivative()(3.0), moved(force)[-1]
        # Before the table 1 N from t = -1 s on, after it 0 N.
        assert held.q[-1, 0] == pytest.approx(0.5 + 1.0 * 3 + last + (1.0 + first) * 1.0, abs=1e-12)
        batch = module.simulate_batch(q=np.zeros((1, 1)), t=(-1.0, 4.0), inputs={"F": (TIMES, FORCES + 1)}, extend="hold",
                                      interpolation=kind, rtol=1e-6)
        assert batch.x[0, -1, 0] == pytest.approx(held.q[-1, 0], abs=1e-12)
    single = module.simulate((0.0, 1.0), inputs={"F": ([0.5], [2.0])}, extend="hold")
    assert single.q[-1, 0] == pytest.approx(1.0, abs=1e-12)


def test_what_is_no_table_is_reported() -> None:
    module = pushed()
    for given, message in (
            ({"interpolation": "quintic"}, "interpolation of a table of inputs must be 'linear' or 'cubic', found 'quintic'"),
            ({"extend": True}, "pushed: extend of a table of inputs must be 'error' or 'hold', found True"),
            ({"inputs": {"F": (TIMES, FORCES[1:])}}, "a table of inputs has times of shape .7,. and values of shape .6,."),
            ({"inputs": {"F": (TIMES[::-1], FORCES)}}, "the times of a table of inputs must increase, and all of it be finite"),
            ({"inputs": {"F": (TIMES, FORCES * np.nan)}}, "the times of a table of inputs must increase, and all of it"),
            ({"inputs": {"F": (TIMES, "high")}}, "a table of inputs: values must be numbers"),
            ({"inputs": sd.Table(TIMES, FORCES)}, "values of shape .7,.; give one row of 2 values for each time")):
        with pytest.raises(ArgumentError, match=message):
            module.simulate((0, 1), **{"inputs": {"F": (TIMES, FORCES)}, **given})
    values = FORCES.copy()
    table = sd.Table(TIMES, values)
    values[:] = 7.0
    np.testing.assert_array_equal(table.values, FORCES)


def test_a_table_in_another_form_gets_advice():
    module = sd.systems.get("cart_pole").compile(backend="numpy")
    with pytest.raises(ArgumentError, match=r"an array of the shape \(11, 2\).*pass a table over time as a pair \(times, va"):
        module.simulate((0, 1), inputs={"F": np.zeros((11, 2))})
    with pytest.raises(ArgumentError, match=r"F is <function .*, over time; functions, splines and tables are for sim.* "
                                            r"Here pass its number at this time, inputs=\{F: 0.1\}"):
        module.rhs(0.0, np.zeros(4), inputs={"F": lambda t, x: 0.0})
    with pytest.raises(ArgumentError, match="found the time 1 after 2 in row 2"):
        sd.Table([0, 2, 1], [0, 1, 2])
    with pytest.raises(ArgumentError, match="found the value nan in row 1"):
        sd.Table([0, 1, 2], [0, np.nan, 2])
