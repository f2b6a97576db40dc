"""Ensembles and batches of mechanisms with contacts: the numbers of single motions, whatever computes them."""

from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from multiprocessing import get_context
from typing import Any

import numpy as np
import pytest

import symdyn as sd

G = 9.81


def dropped(**law: Any) -> Any:
    system = sd.System("ball", gravity=[0, -G])
    body = system.add_body("ball", mass=1.0)
    system.add_joint(sd.Prismatic("height", system.ground, body, axis=[0, 1], coordinate=sd.coordinates("y")))
    system.add_contact(sd.Contact("floor", body, system.ground, **law))
    return system.compile()


def hits(solution: Any) -> float:
    return float(len(solution.contacts["floor"].impacts.t))


@pytest.fixture(scope="module")
def module() -> Any:
    return dropped(restitution=0.5)


def test_processes_get_the_code_of_modes_that_no_tried_sample_came_to(module: Any) -> None:
    """Two of forty fall low enough to bounce and to rest; members that are tried in advance do not touch."""
    heights = np.full(40, 3.0)
    heights[[7, 15]] = 0.3, 0.05
    single = [module.simulate((0, 0.6), q=[h], rtol=1e-10, sensitivities=["y(0)"]) for h in (0.3, 0.05)]
    outcomes = {"end": "end y", "grad": "grad end y", "hits": hits}
    with ProcessPoolExecutor(1, mp_context=get_context("spawn")) as pool:
        found = sd.ensemble(module, {"y": heights}, (0, 0.6), outcomes, executor=pool, rtol=1e-10)
    assert found.n_failed == 0
    assert found["end"][[7, 15]].tolist() == [one.x[-1, 0] for one in single]
    assert found["grad"][[7, 15]].ravel().tolist() == [one.sensitivity["y(0)"][-1, 0] for one in single]
    assert found["hits"][[0, 7, 15]].tolist() == [0.0, *map(hits, single)]


def test_threads_give_the_numbers_of_single_motions_and_members_that_overlap_fail(module: Any) -> None:
    heights = np.append(np.linspace(0.1, 2, 12), -0.5)
    with ThreadPoolExecutor(2) as pool:
        found = sd.ensemble(module, {"y": heights}, (0, 1), ["end y", "max y_dot"], executor=pool)
    single = [module.simulate((0, 1), q=[h]).x[-1, 0] for h in heights[:-1]]
    assert found["end y"][:-1].tolist() == single
    assert found.n_failed == 1
    assert "contacts overlap at the start: floor by 0.5 m" in str(found.failures())


def test_batches_run_one_by_one_with_rigid_contacts_and_in_lanes_with_compliant_ones(module: Any) -> None:
    rigid = module.simulate_batch(q=[[1.0], [0.5]], t=(0, 1), rtol=1e-10, sensitivities=["y(0)"])
    assert rigid.note == "one by one: the mechanism has rigid contacts"
    single = module.simulate((0, 1), q=[0.5], rtol=1e-10, sensitivities=["y(0)"])
    assert rigid.x[1, -1].tolist() == single.x[-1].tolist()
    assert rigid.sensitivity["y(0)"][1, -1].tolist() == single.sensitivity["y(0)"][-1].tolist()
    soft = dropped(law="compliant", compliance=sd.contacts.Compliance(1e4, dissipation=0.5))
    both = soft.simulate_batch(q=[[1.0], [0.5]], t=(0, 1), rtol=1e-10)
    assert both.x[1, -1] == pytest.approx(soft.simulate((0, 1), q=[0.5], rtol=1e-10).x[-1], abs=1e-12)
