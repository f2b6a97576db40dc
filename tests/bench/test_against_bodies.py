"""Other programs that take bodies and joints: the same accelerations and motions as ours, or the reason why not."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import sympy as sp

import symdyn as sd
from symdyn import systems
from symdyn.bench.work import against
from symdyn.bench.work.against import exudyn_solvers, pinocchio_aba
from symdyn.bench.work.against.mechanism import Tree, calibrated, check_accelerations, tree_of
from symdyn.bench.work.against.mujoco_rk4 import Mujoco
from symdyn.bench.work.against.peer import Failed, Peer, Unfit
from symdyn.bench.work.against.planar import planar_of
from symdyn.errors import ModelWarning


def parts_of(system: Any) -> tuple[Any, np.ndarray, np.ndarray]:
    """Equations, parameters and a start."""
    equations = system.equations()
    module = equations.compile()
    q, u = module.consistent(params=None) if equations.constraints else (None, None)
    initial = module.metadata.initial
    x0 = np.array([initial.get(name, 0.0) for name in module.metadata.x]) if q is None else np.concatenate([q, u])
    return equations, module.parameters(), x0


def branched() -> Any:
    """A tree of turned frames, slides and a body that is fixed to another, with forces along joints."""
    q = sd.coordinates("s a b c")
    system = sd.System("branched", gravity=[0.3, -1.0, -9.0])
    bodies = [system.add_body(f"body{k}", mass=1.0 + 0.3 * k, com=[0.1, 0.2 * k, -0.1], inertia=[0.3, 0.4, 0.45 + 0.02 * k])
              for k in range(5)]
    turned = sp.Matrix([[2, -1, 2], [2, 2, -1], [-1, 2, 2]]) / 3
    ground, first, second, third, fourth, fifth = system.ground, *bodies
    rail = system.add_joint(sd.Prismatic("rail", ground, first, q[0], axis=[0, 1, 0], parent_point=[0.2, 0, 0.1]))
    hinge = system.add_joint(sd.Revolute("left", first, second, q[1], axis=[1, 0, 0], parent_point=[0, 0.4, 0],
                                         child_point=[0.1, 0, 0.2], parent_rotation=turned))
    system.add_joint(sd.Revolute("right", first, third, q[2], axis=[0, 0, -1], parent_point=[0, -0.4, 0], child_rotation=turned))
    system.add_joint(sd.Fixed("weld", third, fifth, parent_point=[0.5, 0, 0.1], child_point=[0, 0.1, 0]))
    system.add_joint(sd.Revolute("outer", second, fourth, q[3], axis=[0, 0.6, 0.8], parent_point=[0.5, 0.1, 0]))
    system.add_joint_force(rail, 1.5 - 20 * q[0] - 2 * q[0].dot)
    system.add_joint_force(hinge, -0.3 * q[1].dot)
    system.initial = dict(zip(q, (0.1, 0.4, -0.3, 0.8), strict=True))
    return system


@pytest.fixture(scope="module")
def pendulum() -> tuple[Any, Any, np.ndarray, np.ndarray]:
    system = systems.double_pendulum()
    return system, *parts_of(system)


@pytest.fixture(scope="module")
def tree() -> tuple[Any, Any, np.ndarray, np.ndarray]:
    system = branched()
    return system, *parts_of(system)


def installed(name: str) -> tuple[Peer, ...]:
    for peer in against.peers(name):
        if (there := peer.available()) is not True:
            pytest.skip(str(there))
    return against.peers(name)


def run(peer: Peer, case: tuple[Any, Any, np.ndarray, np.ndarray], end: float, tolerance: float) -> float:
    """The relative error of the end, against our motion."""
    system, equations, params, x0 = case
    n = len(x0) // 2
    ours = equations.compile().simulate(t=np.array([0.0, end]), q=x0[:n], u=x0[n:], rtol=1e-12).x[-1]
    runner = peer.prepare(equations, params, x0, end, system)
    seconds, evaluations, x = runner(tolerance)
    assert seconds > 0 and evaluations > 4
    if tolerance > 1e-5:  # each run starts again
        again = runner(tolerance)
        assert again[1] == evaluations and np.array_equal(again[2], x)
    return float(np.linalg.norm(x - ours) / np.linalg.norm(ours))


@pytest.mark.parametrize("case", ["pendulum", "tree"])
@pytest.mark.parametrize("name", ["mujoco", "exudyn"])
def test_end_to_the_tolerance(name: str, case: str, request: pytest.FixtureRequest) -> None:
    for peer in installed(name):
        if peer.name != "exudyn GeneralizedAlpha":
            error = run(peer, request.getfixturevalue(case), 0.5, 2e-5)
            assert error < 3e-4, peer.name


def test_a_loop_by_generalized_alpha() -> None:
    """With a spring and a drive; accelerations at the start are compared before anything runs."""
    peer = installed("exudyn")[-1]
    system = systems.four_bar()
    crank, coupler = system.joints[0], system.bodies[1]
    system.add_joint_force(crank, 3.0)
    system.add_spring_damper(system.ground, coupler, point_a=[0.1, 0.5], point_b=[0.2, 0.1], stiffness=40, damping=2, length=0.3)
    parts = parts_of(system)
    assert planar_of(system, *parts).springs[0][1:] == (40.0, 2.0, 0.3)
    coarse, fine = (run(peer, (system, *parts), 0.1, tolerance) for tolerance in (1e-3, 1e-5))
    assert fine < 3e-5 and fine < coarse / 10


def pinocchio_accelerations(tree: Tree, q: np.ndarray, u: np.ndarray) -> np.ndarray:
    """Accelerations by the Python package of Pinocchio from the description that it is given as text."""
    pin = pytest.importorskip("pinocchio")
    model = pin.Model()
    for line in pinocchio_aba.description(tree).splitlines():
        what, *words = line.split()
        if what == "gravity":
            model.gravity.linear = np.array(words, dtype=float)
        elif what == "turned":
            parent, kind, *numbers = words
            row = np.array(numbers, dtype=float)
            place = pin.SE3(row[3:12].reshape(3, 3), row[12:])
            model.addJoint(int(parent), {"RZ": pin.JointModelRZ, "PZ": pin.JointModelPZ}[kind](), place, f"joint{model.njoints}")
        else:
            mass, x, y, z, xx, xy, xz, yy, yz, zz = np.array(words[1:], dtype=float)
            inertia = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
            model.inertias[int(words[0])] = pin.Inertia(mass, np.array([x, y, z]), inertia)
    forces = [link.force - link.stiffness * a - link.damping * b for link, a, b in zip(tree.links, q, u, strict=True)]
    return np.array(pin.aba(model, model.createData(), q, u, np.array(forces)))


@pytest.mark.parametrize("case", ["pendulum", "tree"])
def test_description_for_pinocchio(case: str, request: pytest.FixtureRequest) -> None:
    system, equations, params, _ = request.getfixturevalue(case)
    built = tree_of(system, equations, params)
    check_accelerations(built, lambda q, u: pinocchio_accelerations(built, q, u), equations, params, "Pinocchio")


def test_pinocchio_under_casadi(tree: tuple[Any, Any, np.ndarray, np.ndarray], monkeypatch: pytest.MonkeyPatch) -> None:
    """With a function in place of the compiled one: forces and orders are right, and wrong accelerations are rejected."""
    pytest.importorskip("casadi")
    adams = against.peers("pinocchio")[0]
    system, equations, params, x0 = tree
    monkeypatch.setattr(pinocchio_aba, "accelerations", lambda ca, built: lambda q, u, forces: 2 * forces)
    with pytest.raises(Unfit, match=r"accelerations of Pinocchio differ from ours by \d\.\de[+-]\d\d, relative; it is not"):
        adams.prepare(equations, params, x0, 0.1, system)
    slide = sd.System("slide")
    body = slide.add_body("body", mass=2)
    s = sd.coordinates("s")
    slide.add_joint_force(slide.add_joint(sd.Prismatic("rail", slide.ground, body, s)), -8 * s)
    slide.initial = {s: 1.0}
    equations, params, x0 = parts_of(slide)
    monkeypatch.setattr(pinocchio_aba, "accelerations", lambda ca, built: lambda q, u, forces: forces / 2)
    _, _, x = adams.prepare(equations, params, x0, 1.0, slide)(1e-9)
    assert np.abs(x - [np.cos(2), -2 * np.sin(2)]).max() < 1e-6


def test_wrong_programs_are_not_compared(pendulum: tuple[Any, Any, np.ndarray, np.ndarray]) -> None:
    system, equations, params, _ = pendulum
    built = tree_of(system, equations, params)
    with pytest.raises(Unfit, match="accelerations of a program differ from ours by"):
        check_accelerations(built, lambda q, u: q, equations, params, "a program")
    with pytest.raises(Unfit, match=r"accelerations at the start differ from ours by 1\.0e\+00, relative; it is not compared"):
        exudyn_solvers._compare(np.zeros(2), np.ones(2), "accelerations at the start")


def test_what_is_no_tree() -> None:
    for make, message in ((systems.four_bar, "it has closed loops; what is built is a tree of joints"),
                          (systems.floating_crane, "joint 'floating' is free; what is built is revolute or prismatic joints"),
                          (systems.flyball_governor, "link1 is a load; what is built is forces along joints alone")):
        system = make()
        equations = system.equations()
        params = np.array([float(equations.symbols.defaults[p]) for p in equations.symbols.parameters])
        with pytest.raises(Unfit, match=message):
            tree_of(system, equations, params)


def test_what_is_no_planar_loop() -> None:
    wheel = systems.vehicle_on_track()
    for system, message in ((systems.spatial_chain(n=1), "it has motion in space; what is built is planar mechanisms of hinged"),
                            (systems.car_axis(), "it has constraints by formula; what is built is planar mechanisms of hinged"),
                            (wheel, r"is prismatic; what is built is hinges with a coordinate of their own")):
        equations = system.embedding() if not system.constraints else system.augmented()
        with pytest.raises(Unfit, match=message):
            planar_of(system, equations, np.ones(len(equations.symbols.parameters)), np.zeros(2))


def test_equations_alone(pendulum: tuple[Any, Any, np.ndarray, np.ndarray]) -> None:
    _, equations, params, x0 = pendulum
    with pytest.raises(Unfit, match="it is known by its equations alone; the program takes bodies and joints"):
        tree_of(None, equations, params)
    with pytest.raises(Unfit, match="it is known by its equations alone; the program takes bodies and joints"):
        planar_of(None, equations, params, x0)


def test_loops_and_trees_have_their_methods(pendulum: tuple[Any, Any, np.ndarray, np.ndarray]) -> None:
    system, equations, params, x0 = pendulum
    dopri5, _, alpha = against.peers("exudyn")
    with pytest.raises(Unfit, match="it has no loops; Exudyn's explicit methods are faster"):
        alpha.prepare(equations, params, x0, 1.0, system)
    linkage = systems.four_bar()
    with pytest.raises(Unfit, match="it has loops; Exudyn's explicit methods take trees"):
        dopri5.prepare(linkage.equations(), params, x0, 1.0, linkage)


def test_inertia_that_no_body_has() -> None:
    pytest.importorskip("mujoco")
    system = sd.System("rod")
    body = system.add_body("body", mass=1, inertia=[1.0, 0.1, 0.1])
    system.add_joint(sd.Revolute("hinge", system.ground, body))
    with pytest.warns(ModelWarning, match="violate the triangle inequality"):
        equations, params, x0 = parts_of(system)
        with pytest.raises(Unfit, match=r"MuJoCo does not take it: Error: inertia must satisfy A \+ B >= C"):
            Mujoco().prepare(equations, params, x0, 1.0, system)


def test_steps_for_a_tolerance(monkeypatch: pytest.MonkeyPatch) -> None:
    """Steps of a method of order four, whose error is known."""
    steps = calibrated(lambda n: (1e-6 * n, np.array([1.0 + 1e6 / n**4])), 4)
    for tolerance in (1e-4, 1e-8):
        assert 0.3 * tolerance < 1e6 / steps(tolerance) ** 4 < 1.2 * tolerance
    monkeypatch.setattr("symdyn.bench.work.against.mechanism.LONGEST", 1e-3)
    with pytest.raises(Failed, match=r"\d+ steps for 1e-12 would take about \d+ s"):
        steps(1e-12)
