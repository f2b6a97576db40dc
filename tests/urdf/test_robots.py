"""Robots of the package example-robot-data: what symdyn computes of them is what Pinocchio computes."""

from __future__ import annotations

import gc
import re
import warnings
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

import symdyn as sd
from symdyn.errors import MissingExtra, ModelError, ModelWarning
from symdyn.lab.robots import collection
from symdyn.lab.robots.agreement import differences
from symdyn.lab.robots.collection import ROBOTS, Listed
from tests.helpers import swept
from tests.urdf.texts import ALL, BOX, joint, link, saved
from tests.urdf.texts import robot as text_of

pytest.importorskip("pinocchio", reason="Pinocchio is not installed; run: pip install pin")
from symdyn.lab.robots.pinocchio_robot import PinocchioRobot

# Robots of all sorts, without those that take longest: `symdyn bench robots` has them all, at 100 states each.
LARGE = ("pr2", "tiago_pro", "baxter", "anymal_c_simple", "centauro", "g1_29dof_with_hand_rev_1_0", "g1_29dof_rev_1_0", "icub",
         "icub_reduced", "alex_sake_hands", "alex_nub_hands", "romeo_small", "simple_humanoid_classical", "talos_reduced",
         "b1-z1", "anymal-kinova", "go1", "human", "ur3_gripper", "ur5_gripper", "double_pendulum_continuous")
TESTED = [r for r in ROBOTS if r.name not in LARGE]
STATES = 3


@pytest.fixture(scope="module")
def folder() -> Path:
    try:
        return collection.folder()
    except MissingExtra as error:
        pytest.skip(str(error))


@pytest.fixture(autouse=True)
def no_search_for_garbage() -> Iterator[None]:
    """Nodes of a derivation all stay: to look through them again and again takes as long as the derivation."""
    gc.disable()
    yield
    gc.enable()


def read(path: Path, robot: Listed) -> sd.System:
    with warnings.catch_warnings():
        # Some have inertias that no body has; they are computed with, and Pinocchio does so, too.
        warnings.simplefilter("ignore", ModelWarning)
        return sd.read_urdf(path, root="floating" if robot.floating else "fixed")


def test_there_are_thirty() -> None:
    assert len(TESTED) >= 30 and len({r.name for r in ROBOTS}) == len(ROBOTS) >= 50


@pytest.mark.filterwarnings("ignore::symdyn.errors.ModelWarning")
@pytest.mark.parametrize("robot", swept(TESTED, *TESTED[::3]), ids=[r.name for r in TESTED])
def test_a_robot_is_pinocchios(folder: Path, robot: Listed) -> None:
    """tau, M, accelerations, J, centre of mass and energy, to 1e-12 of their norm."""
    system = read(folder / robot.file, robot)
    model = system.check()
    peer = PinocchioRobot(folder / robot.file, model, robot.floating)
    found = differences(system.recursive("parallel"), model, peer, STATES)
    assert max(found.values()) < 1e-12, found


@pytest.mark.parametrize("floating", [False, True])
def test_every_type_of_joint_is_pinocchios(tmp_path: Path, floating: bool) -> None:
    """In both formulations, which share no recursion; with two joints that mimic, and frames turned by 3.14159265."""
    path = saved(tmp_path, ALL)
    system = read(path, Listed(str(path), floating))
    model = system.check()
    peer = PinocchioRobot(path, model, floating)
    assert peer.mimics
    found = differences(system.recursive(), model, peer, 10)
    assert max(found.values()) < 1e-13, found
    # The mass matrix by itself, in the other formulation.
    q, u = np.linspace(0.1, 0.5, len(model.coordinates)), np.zeros(len(model.speeds))
    for free in (j for j in model.joints if j.kind == "free"):
        places = [model.coordinates.index(s) for s in free.coordinates[3:]]
        q[places] /= np.linalg.norm(q[places])
    M = system.embedding().compile(backend="numpy").mass_matrix(q)
    np.testing.assert_allclose(M, peer.quantities(q, u, u)["M"], atol=1e-13 * np.abs(M).max())


def test_a_tilt_that_its_cosine_does_not_show(tmp_path: Path) -> None:
    """3.14159265 is 3.6e-9 short of a half turn, with a cosine of -1 in floats: frames are not parallel there."""
    text = text_of(link("base", ""), link("a", BOX), link("b", BOX), joint("j", "continuous", "base", "a", '<axis xyz="0 0 1"/>'),
                   joint("k", "continuous", "a", "b", '<origin xyz="1 0 0" rpy="3.14159265 0 0"/><axis xyz="0 0 1"/>'))
    path = saved(tmp_path, text)
    system = sd.read_urdf(path)
    model = system.check()
    for frames in ("body", "parallel"):
        found = differences(system.recursive(frames), model, PinocchioRobot(path, model), STATES)
        assert max(found.values()) < 1e-12, found


def test_a_robot_with_inertias_of_no_body(folder: Path) -> None:
    with pytest.raises(ModelError) as raised:
        sd.read_urdf(folder / "romeo_description/urdf/romeo_laas_small.urdf")
    found = [re.sub(r"^.*small\.urdf:(\d+: link '\w+': its inertia).*$", r"\1", f) for f in raised.value.faults]
    assert found[:3] == [f"328: {link_of('body')}", f"359: {link_of('LHipPitch_link')}", f"431: {link_of('RHipPitch_link')}"]
    assert len(found) == 5


def link_of(name: str) -> str:
    return f"link {name!r}: its inertia"


def test_a_robot_with_joints_that_move_nothing(folder: Path) -> None:
    path = folder / "romeo_description/urdf/romeo.urdf"
    with pytest.raises(ModelError, match=r"joint 'LHand' moves link 'LFinger11Link' \(line \d+\)"):
        sd.read_urdf(path)
    assert len(sd.read_urdf(path, fixed=["LHand", "RHand"]).joints) == 82
