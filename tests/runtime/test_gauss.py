"""Gauss collocation: coefficients, order, energy over very long motion, reversal, rotations, and what it does not take."""

from __future__ import annotations

import functools
import re
import warnings
from collections.abc import Callable
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
import sympy as sp

import symdyn as sd
from symdyn.backend.methods.gauss import COEFFICIENTS
from symdyn.errors import ArgumentError, SimulationWarning
from symdyn.lab import kinks
from tests.helpers import GRAVITY, swing
from tests.runtime.constrained import module as constrained
from tests.user_functions import BOUNDED

GAUSS = {"method": "gauss"}


@pytest.fixture(scope="module")
def double(compiled: Callable[..., Any]) -> Any:
    return compiled("double_pendulum", "c")


# -- coefficients


def test_collocation_conditions() -> None:
    """B(16) and C(8) of Butcher, as far as floats go, and the conditions of symplecticity to the last bit."""
    c, b, m = (np.array(v) for v in (COEFFICIENTS.nodes, COEFFICIENTS.weights, COEFFICIENTS.ratios))
    s = len(c)
    for k in range(1, 2 * s + 1):
        assert abs(b @ c ** (k - 1) - 1 / k) < 4e-16
    for k in range(1, s + 1):
        assert np.abs((m * b) @ c ** (k - 1) - c**k / k).max() < 4e-16
    assert all(Fraction(m[i, j]) + Fraction(m[j, i]) == 1 for i in range(s) for j in range(s))
    assert sum(map(Fraction, COEFFICIENTS.weights)) == 1


def test_legendre_values() -> None:
    """Orthonormal polynomials at the nodes: the rule integrates their products exactly."""
    P, b = np.array(COEFFICIENTS.legendre), np.array(COEFFICIENTS.weights)
    assert np.abs((P * b) @ P.T - np.eye(2)).max() < 1e-14
    assert P[0] == pytest.approx(P[0][::-1], abs=1e-14) and P[1] == pytest.approx(-P[1][::-1], abs=1e-14)


# -- errors


def test_measured_order(pendulum: Any) -> None:
    found = [pendulum.simulate([0.0, 12.0], [1e-3], **GAUSS, first_step=12 / n).q[-1, 0] for n in (12, 16, 20)]
    errors = np.abs(np.array(found) - swing(12, 1e-3))
    assert 15.4 < np.log(errors[0] / errors[-1]) / np.log(20 / 12) < 17


def test_a_pendulum_over_2000_seconds(fast: Any) -> None:
    times = np.linspace(0, 2000, 9)
    exact = [swing(t, 2.0) for t in times]
    for given, most in (({"first_step": 0.05}, 5e-12), ({"rtol": 1e-14}, 5e-11)):
        found = fast.simulate(times, **GAUSS, **given)
        assert np.abs(found.q[:, 0] - exact).max() < most
    assert found.n_steps < 15_000


def test_energy_after_10000_periods(fast: Any) -> None:
    """The period is 2.66587 s; errors by the largest kinetic energy, that of the lowest point."""
    found = fast.simulate(np.linspace(0, 26_665.2, 2001), **GAUSS, rtol=1e-13)
    change = (found.energy - found.energy[0]) / (GRAVITY * (1 - np.cos(2.0)))
    assert found.success and np.abs(change).max() < 1e-13


def test_energy_of_chaotic_motion_over_many_steps(double: Any) -> None:
    """The range of the potential energy is that of both rods, hanging and standing."""
    found = double.simulate(np.linspace(0, 75, 301), **GAUSS, first_step=0.0125)
    assert found.n_steps == 6_000
    assert np.abs(found.energy - found.energy[0]).max() / (4 * GRAVITY) < 5e-14


def test_the_chosen_step_follows_the_tolerance(double: Any) -> None:
    """From rest into fast motion: steps that the start would allow are too long farther on."""
    scale = 4 * GRAVITY
    for rtol, most in ((1e-6, 1e-5), (1e-9, 1e-8), (1e-13, 1e-12)):
        found = double.simulate(np.linspace(0, 50, 101), **GAUSS, rtol=rtol)
        assert np.abs(found.energy - found.energy[0]).max() / scale < most
        assert 0 < found.n_rejected < 0.3 * found.n_steps


# -- structure


@pytest.mark.parametrize("given", [{"first_step": 0.02}, {"rtol": 1e-12}])
def test_forward_and_back(double: Any, given: dict[str, float]) -> None:
    """Equal steps leave nothing but rounding, chosen ones the tolerance."""
    q = np.array([-1.2, 0.3])
    there = double.simulate([0.0, 100.0], q, **GAUSS, **given)
    back = double.simulate([100.0, 0.0], there.q[-1], there.u[-1], **GAUSS, **given)
    assert np.abs(back.x[-1] - [*q, 0, 0]).max() < (1e-13 if "first_step" in given else 1e-10)
    assert "rtol" in given or back.n_steps == there.n_steps == 5000


def test_states_between_are_as_exact_as_ends(pendulum: Any) -> None:
    """Steps of 0.2 s, 40 outputs in each; backward, too."""
    times = np.linspace(0, 4, 801)
    exact = np.array([swing(t, 2.0) for t in times[::10]])
    forth = pendulum.simulate(times, **GAUSS, first_step=0.2)
    assert forth.n_steps == 20 and np.abs(forth.q[::10, 0] - exact).max() < 1e-14 * 40
    last = forth.x[-1]
    back = pendulum.simulate(times[::-1], last[:1], last[1:], **GAUSS, first_step=0.2)
    assert np.abs(back.q[::-10, 0] - exact).max() < 1e-14 * 80


def top() -> sd.System:
    """A symmetric top on its tip, by Euler parameters."""
    m, a, A, C, g = sd.parameters("m a A C g")
    system = sd.System("top", gravity=[0, 0, -g])
    rotor = system.add_body("rotor", mass=m, inertia=[A, A, C], com=[0, 0, a])
    system.add_joint(sd.Spherical("tip", system.ground, rotor, orientation=sd.EulerParameters()))
    system.defaults = {m: 1, a: 0.1, A: 0.004, C: 0.006, g: GRAVITY}
    return system


def test_the_norm_of_euler_parameters_is_kept_without_corrections() -> None:
    """A quadratic invariant, as the energy of the spinning top is nearly."""
    start = {"q": [np.cos(0.25), np.sin(0.25), 0, 0], "u": [0, 0, 100.0]}
    found = top().embedding().compile("c").simulate(np.linspace(0, 20, 101), **start, **GAUSS, rtol=1e-13, stabilization="none")
    assert np.abs(np.linalg.norm(found.q, axis=1) - 1).max() < 1e-14
    assert np.abs(found.energy / found.energy[0] - 1).max() < 1e-14


def test_the_work_of_loads_is_integrated_along(compiled: Callable[..., Any]) -> None:
    oscillator = compiled("driven_oscillator", "c")
    ours, other = (oscillator.simulate([0.0, 3.0], rtol=1e-13, work=True, method=m) for m in ("gauss", "dop853"))
    assert ours.x[-1] == pytest.approx(other.x[-1], rel=1e-10) and ours.work[-1] == pytest.approx(other.work[-1], rel=1e-9)


# -- what it does not take


DIVIDED = (r"method 'gauss' divided (\d+) of its steps of one length, the latest of them at t = (\S+) s: .* give a shorter "
           "first_step")


def test_a_step_whose_sweeps_find_no_end_is_taken_in_parts(pendulum: Any) -> None:
    with pytest.warns(SimulationWarning, match=DIVIDED):
        found = pendulum.simulate([0.0, 20.0], [1.5], **GAUSS, first_step=5.0)
    assert found.success and found.n_rejected > 0 and found.n_steps > 4


def test_steps_that_were_divided_are_counted(double: Any) -> None:
    """Some of 100 equal steps become two or more; every step stored shows which."""
    for h, t in ((0.1, (0.0, 10.0)), (0.25, (0.0, 10.0)), (0.25, np.array([0.0, 10.0]))):
        with pytest.warns(SimulationWarning) as caught:
            found = double.simulate(t, **GAUSS, first_step=h, steps=True)
        number, latest = re.search(DIVIDED, str(caught[0].message)).groups()  # type: ignore[union-attr]
        assert len(caught) == 1 and found.n_steps > 10 / h
        assert (found.n_rejected > int(number)) == (h == 0.25)  # of the long ones some parts had to be divided once more
        if isinstance(t, tuple):
            parts = np.flatnonzero(np.abs(np.diff(found.t) - h) > 1e-9)
            whole = np.unique(np.floor(found.t[parts] / h + 1e-6))
            assert len(whole) == int(number) and whole[-1] == round(float(latest) / h)
    for given in ({"first_step": 0.0125}, {"rtol": 1e-6}):  # short enough; chosen by the tolerance
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            double.simulate((0.0, 10.0), **GAUSS, **given)


def test_constraints_are_rejected() -> None:
    with pytest.raises(ArgumentError, match=r"four_bar: method 'gauss' does not fit: .*corrections back onto constraints \(.*"
                                            r"use method='dop853'"):
        constrained("four_bar").simulate((0, 1), **GAUSS)


@functools.cache
def pushed() -> Any:
    """An oscillator of 1 kg and 1 N/m that is pushed."""
    q = sd.coordinates("q")
    F = sd.inputs("F")
    system = sd.System("pushed")
    slider = system.add_joint(sd.Prismatic("slider", system.ground, system.add_body("block", mass=1), q, axis=[1, 0]))
    system.add_joint_force(slider, F - q)
    return system.embedding().compile("c")


def test_inputs_by_a_table_are_rejected_by_a_smooth_function_taken() -> None:
    """F = sin(2 t): x = (2 sin t - sin 2t)/3."""
    module = pushed()
    times = np.linspace(0, 5, 51)
    rows = np.sin(2 * times)
    for table in ({"F": (times, rows)}, (times, rows[:, None])):
        with pytest.raises(ArgumentError, match=r"pushed: method 'gauss' does not fit: inputs by a table have a kink at each of "
                                                r"its times, .*use method='dop853', a smooth function of t and x, sd.Smooth"):
            module.simulate([0.0, 5.0], inputs=table, **GAUSS)
    for smooth in ({"F": sd.Smooth(lambda t, x: np.sin(2 * t))}, sd.Smooth(lambda t, x: [np.sin(2 * t)])):
        found = module.simulate(times[::10], inputs=smooth, rtol=1e-11, **GAUSS)
        np.testing.assert_allclose(found.q[:, 0], ((2 * np.sin(times) - rows) / 3)[::10], rtol=0, atol=1e-9)


def test_functions_are_taken_where_they_are_declared_smooth_alone() -> None:
    """Most jumps and many kinks leave no sign in the steps of one length; the other methods get shorter there."""
    module = pushed()
    jump = lambda t, x: [float(t > 3.21)]
    for given in (jump, {"F": lambda t, x: float(t > 3.21)}):
        with pytest.raises(ArgumentError, match=r"pushed: method 'gauss' does not fit: an input by a function may jump or have "
                                                r"kinks, .*use method='dop853', 'bs54', 'radau' or 'radau5', .*sd\.Smooth\(fun"):
            module.simulate((0, 20), inputs=given, **GAUSS)
    for method in ("dop853", "bs54", "radau", "radau5"):
        end = module.simulate(np.array([0.0, 20.0]), inputs=jump, rtol=1e-8, method=method).q[-1, 0]
        assert abs(end - (1 - np.cos(20 - 3.21))) < 1e-6
    with pytest.raises(ArgumentError, match=r"sd.Smooth declares that a function of \(t, x\) is smooth, found 3"):
        sd.Smooth(3)


def test_right_hand_sides_that_switch_are_rejected() -> None:
    q = sd.coordinates("q")
    system = sd.System("rubbed")
    slider = system.add_joint(sd.Prismatic("slider", system.ground, system.add_body("block", mass=1), q, axis=[1, 0]))
    system.add_joint_force(slider, -sp.Abs(q.dot) * q.dot)
    with pytest.raises(ArgumentError, match=r"rubbed: method 'gauss' does not fit: the right-hand side switches \(abs\), .*"
                                            r"use method='dop853'"):
        system.embedding().compile("c").simulate((0, 1), **GAUSS)


def test_functions_of_the_user_are_rejected_with_their_own_reason() -> None:
    q = sd.coordinates("q")
    system = sd.System("held")
    slider = system.add_joint(sd.Prismatic("slider", system.ground, system.add_body("block", mass=1), q, axis=[1, 0]))
    system.add_joint_force(slider, BOUNDED(q.dot))
    with pytest.raises(ArgumentError, match=r"held: method 'gauss' does not fit: the right-hand side calls .* function of "
                                            r"the user, where it may have kinks, which constant steps go across; use method="):
        system.embedding().compile("c").simulate((0, 1), **GAUSS)


POINTS = [0, 1, 1.7, 2.9, 5.05, 7.33, 20], [0, 1, 0.3, 0.5, -1, 0, 0.4]


@pytest.mark.every_value
@pytest.mark.parametrize("force", [lambda t, x: [np.interp(t, *POINTS)], lambda t, x: [max(0, t - 3.21)],
                                   lambda t, x: [-10 * max(0, x[0] - 0.5)], lambda t, x: [float(t > 3.21)]])
@pytest.mark.parametrize("given", [{"rtol": 1e-8}, {"first_step": 0.1}])
def test_kinks_that_the_equations_do_not_show_are_warned_of(force: Any, given: dict[str, float]) -> None:
    """By functions of the user: linear between points, a ramp that sets in, a stop, a jump; with steps chosen and given."""
    with pytest.warns(SimulationWarning, match=r"pushed: method 'gauss' went across kinks or jumps .*latest of them just "
                                               r"before t = [\d.]* s: .*[1-9]\d* differ .*; use method='dop853'"):
        found = pushed().simulate(np.array([0.0, 20.0]), [0.6], inputs=sd.Smooth(force), **GAUSS, **given)
    assert found.success and found.n_steps < 260


@pytest.mark.parametrize("force", [lambda t: np.sin(3 * t), lambda t: np.tanh(20 * (t - 3)), lambda t: 1e-5 * np.sin(20 * t)])
def test_smooth_inputs_are_not_warned_of(force: Any) -> None:
    module = pushed()
    for given in ({"rtol": 1e-8}, {"rtol": 1e-13}, {"first_step": 0.1}):
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            module.simulate(np.array([0.0, 20.0]), [0.6], inputs=sd.Smooth(lambda t, x: [force(t)]), **GAUSS, **given)


def test_chaotic_motion_is_not_warned_of(double: Any) -> None:
    """Rough steps are done again by halves, few of them, and those agree."""
    for given in ({"rtol": 1e-6}, {"rtol": 1e-10}, {"first_step": 0.1}):
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            warnings.filterwarnings("ignore", f".*{DIVIDED}")
            assert double.simulate(np.array([0.0, 20.0]), **GAUSS, **given).success


def test_command_counts_what_comes_without_a_word(capsys: pytest.CaptureFixture[str]) -> None:
    """Random jumps and kinks: "gauss" takes none of them, the falsely declared ones stay wrong, others find them."""
    assert kinks.main(["--methods", "gauss", "dop853", "gauss as smooth", "radau", "--count", "3"]) == 0
    lines = capsys.readouterr().out.splitlines()
    rows = {tuple(line.replace("gauss as smooth", "declared").split()[:2]): line.split()[-4:] for line in lines[1:]}
    assert rows["gauss", "jump"][:3] == ["0", "3", "0"] and rows["gauss", "kink"][:3] == ["0", "3", "0"]
    assert rows["dop853", "jump"][2] == rows["radau", "kink"][2] == "0" and int(rows["declared", "jump"][0]) > 1
