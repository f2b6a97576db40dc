"""Exudyn: trees as its kinematic tree with explicit methods, planar mechanisms with loops as free bodies by generalized-alpha."""

from __future__ import annotations

import importlib
import importlib.util
import time as clock
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from symdyn.bench.toolchain import version
from symdyn.bench.work.against.mechanism import Tree, between, calibrated, tree_of
from symdyn.bench.work.against.peer import Failed, Ran, Runner, Unfit, fitting
from symdyn.bench.work.against.planar import Planar, planar_of

# Before anything is timed, accelerations at the start, or a motion so short, relative, are compared with ours; how near they
# must be.
_SHORT, _NEAR = 1e-3, 1e-8
# Methods with a fixed step: their orders.
_ORDERS = {"RK67": 6, "GeneralizedAlpha": 2}


@dataclass(frozen=True)
class Exudyn:
    """One method; GeneralizedAlpha, for loops, and RK67 have fixed steps, and a tolerance stands for a number of them."""

    method: str
    bodies = True

    @property
    def name(self) -> str:
        return f"exudyn {self.method}"

    @property
    def title(self) -> str:
        how = "fixed steps" if self.method in _ORDERS else "adaptive steps"
        return f"Exudyn {version('exudyn')} {self.method}, {how}; bodies and joints"

    def available(self) -> bool | str:
        there = importlib.util.find_spec("exudyn") is not None
        return there or "exudyn is not installed; run: pip install 'symdyn[peers]'"

    def prepare(self, equations: Any, params: np.ndarray, x0: np.ndarray, end: float, system: Any = None) -> Runner:
        loops = self.method == "GeneralizedAlpha"
        if bool(equations.constraints) != loops:
            raise Unfit("it has no loops; Exudyn's explicit methods are faster" if loops else
                        "it has loops; Exudyn's explicit methods take trees")
        built: Tree | Planar = planar_of(system, equations, params, x0) if loops else tree_of(system, equations, params)
        exu: Any = importlib.import_module("exudyn")

        with fitting("Exudyn"):
            mbs, read = _planar(exu, built) if isinstance(built, Planar) else _tree(exu, built, np.asarray(x0, dtype=float))

        def motion(until: float, n: int, tolerance: float | None = None, times: np.ndarray | None = None) -> Ran:
            every = [(0.0, np.asarray(x0, dtype=float))]

            def record(mbs: Any, t: float) -> bool:
                if t > every[-1][0]:
                    every.append((t, read(mbs)))
                return True

            mbs.SetPostStepUserFunction(0 if times is None else record)
            solver = exu.MainSolverImplicitSecondOrder() if loops else exu.MainSolverExplicit()
            settings = _settings(exu, self.method, until, n, tolerance)
            if not solver.InitializeSolver(mbs, settings):
                raise Failed(f"Exudyn could not begin: {solver.GetErrorString()}")
            begun = clock.perf_counter()
            done = solver.SolveSteps(mbs, settings)
            seconds = clock.perf_counter() - begun
            solver.FinalizeSolver(mbs, settings)
            if not done:
                raise Failed(f"Exudyn stopped at t = {solver.it.currentTime:.6g} s with {n} steps")
            steps = solver.it.currentStepIndex + solver.it.rejectedAutomaticStepSizeSteps
            # of the implicit method its Newton steps, each with one residual
            count = solver.it.newtonStepsCount if loops else steps * solver.GetNumberOfStages()
            x = read(mbs)
            if times is not None:
                x = between([t for t, _ in every], [row for _, row in every], equations, params, times)
            return seconds, int(count), x

        module = equations.compile()
        if isinstance(built, Planar):
            solver, settings = exu.MainSolverImplicitSecondOrder(), _settings(exu, self.method, end, 1000, None)
            solver.InitializeSolver(mbs, settings)
            turns = np.reshape(mbs.systemData.GetODE2Coordinates_tt(), (-1, 3))[:, 2]
            n = len(built.start)
            _compare(built.state(turns, turns)[n:], module.rhs(0.0, x0, params, built.inputs)[n:], "accelerations at the start")
        else:
            result = motion(_SHORT * end, 2000, None if self.method in _ORDERS else 1e-12)[2]
            n = len(built.links)
            done = module.simulate(t=np.array([0.0, _SHORT * end]), q=x0[:n], u=x0[n:], params=params, rtol=1e-12)
            _compare(result - x0, np.concatenate([done.q[-1], done.u[-1]]) - x0, f"changes in a motion of {_SHORT * end:g} s")
        if self.method not in _ORDERS:
            return lambda tolerance, times=None: motion(end, 1, tolerance, times)
        steps = calibrated(lambda n: motion(end, n)[::2], _ORDERS[self.method])
        return lambda tolerance, times=None: motion(end, steps(tolerance), None, times)


def _compare(result: np.ndarray, wanted: np.ndarray, what: str) -> None:
    """Raise Unfit unless Exudyn's numbers are ours."""
    size = float(np.linalg.norm(wanted))
    error = float(np.linalg.norm(result - wanted) / (size if size > _NEAR else 1.0))  # none at all at a start in balance
    if not error <= _NEAR:
        raise Unfit(f"{what} differ from ours by {error:.1e}, relative; it is not compared")


def _settings(exu: Any, method: str, end: float, n: int, tolerance: float | None) -> Any:
    """Nothing is written; one thread."""
    settings = exu.SimulationSettings()
    settings.solution.file.write = settings.solution.sensors.active = False
    run = settings.timeIntegration
    run.endTime, run.numberOfSteps, run.verboseMode = float(end), n, 0
    run.automaticStepSize = run.adaptiveStep = tolerance is not None
    if tolerance is not None:
        run.relativeTolerance = run.absoluteTolerance = tolerance
        run.minimumStepSize = 1e-12 * end
        run.initialStepSize = 1e-4 * end
    if method == "GeneralizedAlpha":
        run.newton.useModifiedNewton = True
        run.newton.relativeTolerance, run.newton.absoluteTolerance = 1e-10, 1e-12
        run.generalizedAlpha.computeInitialAccelerations = True
    else:
        run.explicit.computeEndOfStepAccelerations = False
    run.solverType = getattr(exu.DynamicSolverType, method)
    return settings


def _tree(exu: Any, tree: Tree, x0: np.ndarray) -> tuple[Any, Callable[[Any], np.ndarray]]:
    """The system, and what reads its state."""
    items: Any = importlib.import_module("exudyn.itemInterface")
    mbs = exu.SystemContainer().AddSystem()
    q0, u0 = tree.split(x0)
    n, links = len(tree.links), tree.links
    node = mbs.AddNode(items.NodeGenericODE2(referenceCoordinates=[0.0] * n, initialCoordinates=list(q0),
                                             initialCoordinates_t=list(u0), numberOfODE2Coordinates=n))
    kind = lambda link: exu.JointType.RevoluteZ if link.turning else exu.JointType.PrismaticZ
    mbs.AddObject(items.ObjectKinematicTree(
        nodeNumber=node, gravity=list(tree.gravity), jointTypes=[kind(link) for link in links],
        linkParents=[link.parent for link in links], jointTransformations=exu.Matrix3DList([link.R for link in links]),
        jointOffsets=exu.Vector3DList([link.p for link in links]), linkMasses=[link.mass for link in links],
        linkInertiasCOM=exu.Matrix3DList([link.inertia for link in links]),
        linkCOMs=exu.Vector3DList([link.com for link in links]), jointForceVector=[link.force for link in links],
        jointPositionOffsetVector=[0.0] * n, jointPControlVector=[link.stiffness for link in links],
        jointVelocityOffsetVector=[0.0] * n, jointDControlVector=[link.damping for link in links]))
    mbs.Assemble()
    return mbs, lambda system: tree.join(system.systemData.GetODE2Coordinates(), system.systemData.GetODE2Coordinates_t())


def _planar(exu: Any, plane: Planar) -> tuple[Any, Callable[[Any], np.ndarray]]:
    """The system of bodies that joints hold together, and what reads its state."""
    items: Any = importlib.import_module("exudyn.itemInterface")
    mbs = exu.SystemContainer().AddSystem()
    ground = mbs.AddObject(items.ObjectGround())
    bodies = []
    for body in plane.bodies:
        node = mbs.AddNode(items.NodeRigidBody2D(referenceCoordinates=list(body.place), initialVelocities=list(body.speed)))
        bodies.append(mbs.AddObject(items.ObjectRigidBody2D(mass=body.mass, inertia=body.inertia, nodeNumber=node)))
        if plane.gravity.any():
            whole = mbs.AddMarker(items.MarkerBodyMass(bodyNumber=bodies[-1]))
            mbs.AddLoad(items.LoadMassProportional(markerNumber=whole, loadVector=[*plane.gravity, 0.0]))

    def marker(place: tuple[int, np.ndarray]) -> Any:
        body, point = place
        make = items.MarkerBodyPosition if body < 0 else items.MarkerBodyRigid
        return mbs.AddMarker(make(bodyNumber=ground if body < 0 else bodies[body], localPosition=[*point, 0.0]))

    for hinge in plane.hinges:
        mbs.AddObject(items.ObjectJointRevolute2D(markerNumbers=[marker(end) for end in hinge]))
    for ends, stiffness, damping, length in plane.springs:
        mbs.AddObject(items.ObjectConnectorSpringDamper(markerNumbers=[marker(end) for end in ends], referenceLength=length,
                                                        stiffness=stiffness, damping=damping))
    for number, torque in plane.torques:
        if number >= 0:
            mbs.AddLoad(items.LoadTorqueVector(markerNumber=marker((number, np.zeros(2))), loadVector=[0.0, 0.0, torque]))
    mbs.Assemble()

    def read(system: Any) -> np.ndarray:
        data = system.systemData
        return plane.state(np.reshape(data.GetODE2Coordinates(), (-1, 3))[:, 2],
                           np.reshape(data.GetODE2Coordinates_t(), (-1, 3))[:, 2])

    return mbs, read


PEERS = (Exudyn("DOPRI5"), Exudyn("RK67"), Exudyn("GeneralizedAlpha"))
