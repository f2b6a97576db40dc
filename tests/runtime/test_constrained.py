"""Constrained motion stays on its manifold: by projection, by Baumgarte's method; what it costs, and what is said if it fails."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import symdyn as sd
from symdyn import systems
from symdyn.errors import ArgumentError, SimulationWarning
from symdyn.runtime.building.compiler import find_compiler
from symdyn.runtime.integrating import stabilization
from symdyn.runtime.integrating.stabilization import ProjectionFailed, Projector
from symdyn.runtime.integrating.stops import lost_rank
from tests.helpers import swept
from tests.runtime.constrained import module

STRICT = ["-std=c99", "-O1", "-Wall", "-Wextra", "-Werror", "-pedantic", "-Wconversion", "-Wshadow", "-fsyntax-only"]
MULTISTEP = ["BDF", "LSODA"]
ONE_STEP = ["dop853", "RK23", "RK45", "DOP853", "Radau"]


def worst(solution: Any) -> tuple[float, float]:
    return float(np.abs(solution.constraint_violation).max()), float(np.abs(solution.velocity_violation).max())


@pytest.fixture(scope="module")
def wanted() -> Any:
    """The pendulum's x, y and speeds from its angle, as a function of times."""
    backend = "c" if find_compiler() else "numpy"
    angle = systems.get("pendulum").embedding().compile(backend=backend)
    def states(t: np.ndarray) -> np.ndarray:
        found = angle.simulate(t, q=[-np.pi / 2], rtol=1e-13)
        q, u = found.q[:, 0], found.u[:, 0]
        return np.column_stack([np.sin(q), -np.cos(q), np.cos(q) * u, np.sin(q) * u])

    return states


# -- projection in the compiled integrator


@pytest.mark.parametrize("name", ["pendulum_absolute", "four_bar", "spatial_slider_crank", "n_four_bar"])
def test_hundred_seconds_on_the_manifold(name: str) -> None:
    for steps in (False, True):
        solution = module(name).simulate((0, 100), rtol=1e-8, steps=steps)
        assert solution.success and max(worst(solution)) < 1e-11
    assert solution.corrections.position < 1e-3 and 0 < solution.corrections.n_steps <= solution.n_steps


def test_redundant_constraints() -> None:
    solution = module("bricard").simulate(rtol=1e-8)
    assert solution.success and max(worst(solution)) < 1e-11 and solution.energy_error() < 1e-5


@pytest.mark.parametrize("name", ["skate", "rolling_disc"])
def test_velocity_constraints(name: str) -> None:
    solution = module(name).simulate(rtol=1e-8)
    assert solution.success and max(worst(solution)) < 1e-11


def test_the_same_unit_without() -> None:
    pendulum = module("pendulum_absolute")
    source = pendulum.library("rhs").source
    free, kept = (pendulum.simulate((0, 100), rtol=1e-6, stabilization=s) for s in ("none", "projection"))
    assert pendulum.library("rhs").source is source
    assert worst(free)[0] > 1e-5 > 1e-12 > worst(kept)[0]
    assert free.corrections.position == 0.0 and free.corrections.n_evaluations == 0
    assert kept.energy_error() < free.energy_error()


@pytest.mark.parametrize("backend", ["c", "numpy"])
def test_accuracy_between_the_steps(backend: str, wanted: Any) -> None:
    times = np.linspace(0, 5, 401)
    for rtol, error in ((1e-6, 1e-3), (1e-10, 1e-7)):
        solution = module("pendulum_absolute", backend).simulate(times, rtol=rtol)
        np.testing.assert_allclose(solution.x, wanted(times), rtol=0, atol=error)
        assert max(worst(solution)) < 1e-12


@pytest.mark.parametrize(("method", "order", "steps"), [("dop853", 8, (0.4, 0.2, 0.1)), ("DOP853", 8, (0.4, 0.2, 0.1)),
                                                        ("RK45", 5, (0.1, 0.05, 0.025)), ("RK23", 3, (0.05, 0.025, 0.0125)),
                                                        ("Radau", 5, (0.1, 0.05, 0.025))])
def test_order_is_that_of_the_method(method: str, order: int, steps: tuple[float, ...], wanted: Any) -> None:
    """Equal steps: tolerances that every step meets."""
    end = np.array([0, 2.0])
    exact = wanted(end)[-1]
    errors = [np.abs(module("pendulum_absolute").simulate(end, rtol=0.1, atol=1e3, first_step=h, max_step=h, method=method).x[-1]
                     - exact).max() for h in steps]
    assert np.log2(errors[0] / errors[-1]) / (len(steps) - 1) > order - 0.5


def test_as_many_steps_and_evaluations_as_without() -> None:
    for name in ("four_bar", "spatial_slider_crank"):
        ends = np.array([0, module(name).metadata.duration])
        free, kept = (module(name).simulate(ends, rtol=1e-8, stabilization=s) for s in ("none", "projection"))
        assert abs(kept.n_steps - free.n_steps) <= 0.02 * free.n_steps and abs(kept.nfev - free.nfev) <= 0.02 * free.nfev
        assert kept.corrections.n_evaluations <= 2.1 * kept.n_steps + 10


@pytest.mark.parametrize("method", ["dop853", "DOP853", "RK45"])
def test_corrections_are_what_they_change(method: str) -> None:
    """Corrections of one step, compared with the same step without them."""
    pendulum = module("pendulum_absolute")
    n_q = pendulum.metadata.sizes.q
    free, kept = (pendulum.simulate(np.array([0, 0.5]), rtol=0.1, atol=0.1, first_step=0.5, method=method, stabilization=s)
                  for s in ("none", "projection"))
    assert kept.n_steps == kept.corrections.n_steps == 1
    off = kept.x[-1] - free.x[-1]
    found = kept.corrections
    assert min(found.position, found.speed) > 1e-6
    assert [found.position, found.speed] == pytest.approx([np.linalg.norm(off[:n_q]), np.linalg.norm(off[n_q:])], rel=1e-6)


def test_output_times_do_not_change_the_steps() -> None:
    ends, many = (module("four_bar").simulate(t, rtol=1e-8) for t in (np.array([0.0, 3.0]), np.linspace(0, 3, 777)))
    assert ends.n_steps == many.n_steps
    np.testing.assert_array_equal(ends.x[-1], many.x[-1])


def test_backward_and_no_time_at_all() -> None:
    crank = module("spatial_slider_crank")
    there = crank.simulate((0, 1.0), rtol=1e-11)
    back = crank.simulate((1.0, 0), q=there.q[-1], u=there.u[-1], rtol=1e-11)
    np.testing.assert_allclose(back.x[-1], there.x[0], rtol=0, atol=1e-7)
    assert max(worst(back)) < 1e-11
    assert module("four_bar").simulate((1.0, 1.0)).success


def test_work_goes_along() -> None:
    wishbone = module("double_wishbone")
    solution = wishbone.simulate(rtol=1e-9, work=True)
    assert max(worst(solution)) < 1e-11 and solution.energy_error() < 1e-6
    assert wishbone.simulate((0, 0.2), rtol=1e-9, work=True, stabilization=("baumgarte", 10.0)).work.shape == (1001,)


@pytest.mark.parametrize("backend", ["c", "numpy"])
def test_euler_parameters_keep_their_norm(backend: str) -> None:
    top = module("top", backend)
    spin = dict(zip(top.metadata.u[3:], (0.3, 2.0, 0.1), strict=True))
    span = (0, 100) if backend == "c" else (0, 5)
    kept, free = (top.simulate(span, u=spin, rtol=1e-6, stabilization=s) for s in (None, "none"))
    norms = [np.abs(np.linalg.norm(s.q[:, 3:], axis=1) - 1).max() for s in (kept, free)]
    assert norms[0] < 1e-15 and norms[1] > 1e-7
    assert kept.lam.shape == kept.constraint_violation.shape == (1001, 0)


@pytest.mark.skipif(shutil.which("gcc") is None, reason="no gcc here")
@pytest.mark.parametrize("name", ["spatial_slider_crank", "top", "bricard", "driven"])
def test_written_without_a_warning(name: str, tmp_path: Path) -> None:
    source = module(name).library("rhs").source
    (tmp_path / "unit.c").write_text(source)
    done = subprocess.run(["gcc", *STRICT, "unit.c"], cwd=tmp_path, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    assert "symdyn_correct(" in source and "#include" not in source and "malloc" not in source


# -- other methods


@pytest.mark.parametrize("backend", ["c", "numpy"])
@pytest.mark.parametrize("method", ONE_STEP[1:])
def test_one_step_methods_are_projected(method: str, backend: str, wanted: Any) -> None:
    times = np.linspace(0, 2, 51)
    solution = module("pendulum_absolute", backend).simulate(times, rtol=1e-6, method=method)
    assert max(worst(solution)) < 1e-12 and solution.corrections.n_evaluations > solution.n_steps
    np.testing.assert_allclose(solution.x, wanted(times), rtol=0, atol=1e-3)
    steps = module("pendulum_absolute", backend).simulate((0, 1), rtol=1e-6, method=method, steps=True)
    assert max(worst(steps)) < 1e-12


@pytest.mark.parametrize("method", MULTISTEP)
def test_multistep_methods_fall_back_on_baumgarte(method: str, wanted: Any) -> None:
    pendulum, times = module("pendulum_absolute"), np.linspace(0, 10, 51)
    kept, free = (pendulum.simulate(times, rtol=1e-6, method=method, stabilization=s) for s in (None, "none"))
    assert worst(kept)[0] < 2e-5 < worst(free)[0]
    assert np.abs(kept.x - wanted(times)).max() < np.abs(free.x - wanted(times)).max()
    assert kept.n_steps < 1.3 * free.n_steps
    with pytest.raises(ArgumentError, match=f"{method} builds on earlier steps.*stabilization='baumgarte', or method='Radau'"):
        pendulum.simulate(method=method, stabilization="projection")


@pytest.mark.parametrize("method", ["dop853", "RK45", "Radau"])
def test_baumgarte_is_taken_by_every_method(method: str) -> None:
    pendulum = module("pendulum_absolute")
    chosen, given, free = (pendulum.simulate((0, 10), rtol=1e-6, method=method, stabilization=s)
                           for s in ("baumgarte", ("baumgarte", 5.0), "none"))
    assert max(worst(chosen)[0], worst(given)[0]) < 0.5 * worst(free)[0] and chosen.n_steps < 1.2 * free.n_steps


@pytest.mark.parametrize("asked", ["Baumgarte", ("baumgarte", -1.0), ("baumgarte", "a"), ("projection", 2.0), 3])
def test_what_there_is_not(asked: Any) -> None:
    with pytest.raises(ArgumentError, match=r"gain must be|stabilization .* asked for; there are"):
        module("pendulum_absolute").simulate(stabilization=asked)


def test_nothing_to_stabilize() -> None:
    free = module("pendulum")
    for asked in (None, "none", "projection"):
        assert free.simulate((0, 1), stabilization=asked).success
    with pytest.raises(ArgumentError, match="there are no constraints"):
        free.simulate(stabilization="baumgarte")


@pytest.mark.parametrize("method", ["dop853", "DOP853"])
def test_far_from_the_origin(method: str) -> None:
    """x, y grow to 4e30 m, where they carry the constraint to their own rounding only. Along the slope,
    s_ddot = theta_dot^2 s - g sin theta."""
    from scipy.integrate import solve_ivp

    if method == "dop853" and find_compiler() is None:
        pytest.skip("no C compiler here")
    slope = systems.get("particle_on_moving_slope", rocking=True).augmented().compile(
        backend="c" if method == "dop853" else "numpy")
    solution = slope.simulate(np.array([0.0, 25.0, 50.0, 100.0]), rtol=1e-10, method=method)
    assert solution.success
    distance = np.hypot(*solution.q.T)
    assert (np.abs(solution.rows("C")[:, 0]) <= 1e-15 * distance).all() and distance[-1] > 1e30
    along = solve_ivp(lambda t, s: [s[1], np.cos(2 * t)**2 * s[0] - 9.81 * np.sin(0.5 * np.sin(2 * t))], (0, 25), [1.0, -0.5],
                      method="DOP853", rtol=1e-11, atol=1e-11).y[0, -1]
    np.testing.assert_allclose(distance[1], abs(along), rtol=1e-6)


@pytest.mark.parametrize(("method", "end", "step"), [("RK23", 1.0, 0.5), ("RK45", 1.0, 0.5), ("DOP853", 1.0, 0.5),
                                                     ("Radau", 2.0, 1.0)])
def test_a_step_that_a_projection_would_take_to_another_place_is_tried_again_shorter(method: str, end: float, step: float,
                                                                                     monkeypatch: pytest.MonkeyPatch) -> None:
    """Tolerances that every step meets, and steps that end far off: projected from there, the four-bar linkage of the RK23 once
    jumped by 4.5 rad at a step, without a message."""
    taken, rejected, project = [], 0, Projector.step

    def noted(self: Projector, t: float, x: np.ndarray, start: np.ndarray, *tolerances: Any) -> Any:
        nonlocal rejected
        try:
            result = project(self, t, x, start, *tolerances)
        except ProjectionFailed:
            rejected += 1
            raise
        taken.append((np.linalg.norm(x[:3] - start[:3]), np.linalg.norm(result[0][:3] - x[:3])))
        return result

    monkeypatch.setattr(Projector, "step", noted)
    run = module("four_bar").simulate(np.array([0.0, end]), rtol=0.1, atol=1e3, first_step=step, max_step=step, method=method)
    way, correction = np.array(taken).T
    assert run.success and run.n_steps == len(taken) and run.n_rejected == rejected > 0
    assert (correction <= 0.5 * way + 1e-5 * np.abs(run.q).max()).all() and run.corrections.position == correction.max()
    assert worst(run)[0] < 1e-12


# -- what cannot go on


@pytest.mark.parametrize("method", ["dop853", "DOP853"])
def test_no_way_back(method: str) -> None:
    with pytest.warns(SimulationWarning, match="no way back onto the constraints: .* stays violated by .* nearly lose "
                                               "rank there .1 instead of 2.: circle, lift nearly depend on each other"):
        solution = module("driven").simulate((0, 2), method=method)
    assert not solution.success and 0.99 < solution.t[-1] <= 1.01 and len(solution.t) > 495
    assert worst(solution)[0] < 1e-9 and np.isfinite(solution.lam[:495]).all()
    np.testing.assert_allclose(solution["y"][:495], solution.t[:495], rtol=0, atol=1e-12)


@pytest.mark.parametrize("method", swept(["DOP853", "Radau"], "DOP853"))
def test_no_way_back_on_numpy(method: str) -> None:
    with pytest.warns(SimulationWarning, match="nearly lose rank there .1 instead of 2.: circle, lift nearly depend"):
        module("driven", "numpy").simulate((0, 2), method=method)


@pytest.mark.parametrize("method", swept(["RK23", "DOP853", "Radau"], "RK23", "Radau"))
def test_corrections_that_are_too_far_however_short_the_step(method: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where no end of a step counts as near, no step is short enough."""
    monkeypatch.setattr(stabilization, "PART_OF_WAY", -1.0)
    monkeypatch.setattr(stabilization, "PART_OF_SIZE", 0.0)
    with pytest.warns(SimulationWarning, match="stopped at t = .*: no way back onto the constraints: the correction would go "
                                               "further than half the step"):
        run = module("pendulum_absolute", "numpy").simulate((0, 1), method=method)
    assert not run.success and run.n_steps == 0 and run.n_rejected > 20


def test_what_is_lost_where_a_gradient_vanishes() -> None:
    x, y = sd.coordinates("x y")
    system = sd.System("cross", gravity=[0, 0])
    rail, particle = system.add_body("rail", mass=1), system.add_body("particle", mass=1)
    system.add_joint(sd.Prismatic("along", system.ground, rail, axis=[1, 0], coordinate=x))
    system.add_joint(sd.Prismatic("up", rail, particle, axis=[0, 1], coordinate=y))
    system.add_constraint(x**2 - y**2, "cross")
    system.initial = {x: 1, y: 1}
    cross = system.augmented().compile(backend="numpy")
    start, p = np.array([1.0, 1.0, 0.0, 0.0]), cross.parameters()
    near = np.array([1e-6, 1e-6, 0.0, 0.0])
    assert lost_rank(cross, 0.0, near, p, start, 0.0) == (
        "; the constraints nearly lose rank there (0 instead of 1): the gradient of cross nearly vanishes")
    assert lost_rank(cross, 0.0, start, p, start, 0.0) == ""


@pytest.mark.parametrize("method", ["LSODA", "RK45"])
def test_baumgarte_reports_when_it_loses_them(method: str) -> None:
    with pytest.warns(SimulationWarning, match="lift is violated by 0.01.* of the mechanism's length, which Baumgarte's method"):
        solution = module("driven").simulate((0, 2), method=method, rtol=1e-6, stabilization="baumgarte")
    assert not solution.success and 1.0 < solution.t[-1] < 1.1


def test_steps_as_asked_and_on() -> None:
    """States kept of a run that was stopped are on the manifold, too."""
    with pytest.warns(SimulationWarning, match="20 steps were done"):
        solution = module("four_bar").simulate((0, 10), max_steps=20, rtol=1e-8)
    assert max(worst(solution)) < 1e-11 and solution.n_steps == 20
