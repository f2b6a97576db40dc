"""System, Solution and Linearization pickle and copy; tasks of joblib, multiprocessing and Dask return solutions."""

from __future__ import annotations

import copy
import multiprocessing
import pickle
from collections.abc import Callable

import numpy as np
import pytest

import symdyn as sd
from symdyn.pipeline import emit
from symdyn.runtime.solutions.solution import Solution
from tests.helpers import swept


def bouncing() -> sd.System:
    """A ball above a floor, with an event and an input."""
    y = sd.coordinates("y")
    m, F = sd.parameters("m"), sd.inputs("F")
    system = sd.System("ball", gravity=[0, -9.81])
    ball = system.add_body("ball", mass=m)
    system.add_joint(sd.Prismatic("height", system.ground, ball, y, axis=[0, 1]))
    system.add_force(ball, [0, F])
    system.add_event("top", y.dot, direction=-1)
    system.add_contact(sd.Contact("floor", ball, system.ground, restitution=0.8))
    system.defaults, system.initial = {m: 1.0}, {y: 0.5}
    return system


WAYS: list[Callable[[object], object]] = [lambda thing: pickle.loads(pickle.dumps(thing)), copy.deepcopy]


@pytest.mark.every_value
@pytest.mark.parametrize("way", WAYS)
@pytest.mark.parametrize("name", ["ball", "four_bar", *swept(["land_wind_turbine"]), "rolling_disc"])
def test_a_system_is_copied_with_all_that_is_in_it(way: Callable[[sd.System], sd.System], name: str) -> None:
    system = bouncing() if name == "ball" else sd.systems.get(name)
    form = "augmented" if system.loops or system.constraints else "embedding"
    twin = way(system)
    first, second = (emit(getattr(s, form)(), "c", ["rhs"], standalone=False, integrator=False).files for s in (system, twin))
    assert first == second and twin.defaults == system.defaults and twin.initial == system.initial


@pytest.mark.parametrize("way", WAYS)
def test_changes_of_a_copy_do_not_leak(way: Callable[[sd.System], sd.System]) -> None:
    system = bouncing()
    twin = way(system)
    twin.add_force("ball", [0, 5])
    twin.add_contact(sd.Stop("stop", "height", upper=1))
    twin.defaults.clear()
    twin.add_event("other", sd.t - 1)
    assert (len(system.loads), len(system.contacts), len(system.events), len(system.defaults)) == (1, 1, 1, 1)
    assert twin.ground is not system.ground
    sol = system.compile(backend="numpy").simulate((0, 0.5), inputs={"F": 0.0})
    assert sol.contacts["floor"].gap.min() > -1e-9


@pytest.mark.parametrize("way", WAYS)
def test_a_solution_is_copied_with_events_and_contacts(way: Callable[[Solution], Solution]) -> None:
    sol = bouncing().compile(backend="numpy").simulate((0, 1), inputs={"F": 0.1})
    twin = way(sol)
    assert (twin.t == sol.t).all() and (twin.y == sol.y).all() and (twin.energy == sol.energy).all()
    assert (twin.contacts["floor"].gap == sol.contacts["floor"].gap).all()
    assert list(twin.events) == list(sol.events) and (twin.events["top"].t == sol.events["top"].t).all()
    twin.y[:] = 0.0
    assert np.abs(sol.y).max() > 0


@pytest.mark.parametrize("way", WAYS)
def test_a_linearization_is_copied(way: Callable[[object], object]) -> None:
    linear = sd.systems.cart_pole().compile(backend="numpy").linearize()
    twin = way(linear)
    assert (twin.A == linear.A).all() and (twin.B == linear.B).all()  # type: ignore[attr-defined]


def run(module: sd.System, angle: float) -> Solution:
    """A task returns a whole solution."""
    return module.simulate((0, 0.2), q={"q1": angle})  # type: ignore[attr-defined, no-any-return]


ANGLES = [0.1, 0.5, 1.0]


def expected() -> tuple[object, list[np.ndarray]]:
    module = sd.systems.double_pendulum().compile(backend="numpy")
    return module, [run(module, angle).q for angle in ANGLES]  # type: ignore[arg-type]


def test_tasks_of_multiprocessing_return_solutions() -> None:
    module, wanted = expected()
    with multiprocessing.get_context("spawn").Pool(1) as pool:
        found = pool.starmap(run, [(module, angle) for angle in ANGLES])
    assert all((sol.q == q).all() for sol, q in zip(found, wanted, strict=True))


@pytest.mark.sweep
def test_tasks_of_joblib_return_solutions() -> None:
    joblib = pytest.importorskip("joblib")
    module, wanted = expected()
    found = joblib.Parallel(n_jobs=2)(joblib.delayed(run)(module, angle) for angle in ANGLES)
    assert all((sol.q == q).all() for sol, q in zip(found, wanted, strict=True))


def test_tasks_of_dask_return_solutions() -> None:
    distributed = pytest.importorskip("distributed")
    module, wanted = expected()
    with distributed.LocalCluster(n_workers=1, threads_per_worker=2, processes=False, dashboard_address=None) as cluster, \
            distributed.Client(cluster) as client:
        found = client.gather([client.submit(run, module, angle) for angle in ANGLES])
    assert all((sol.q == q).all() for sol, q in zip(found, wanted, strict=True))
