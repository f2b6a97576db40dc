"""Trees with added mass and elastic bodies in every way of writing them; rest with extra states; stiffness at half a turn."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
import pytest
import sympy as sp

import symdyn as sd
from symdyn.errors import ArgumentError, EquilibriumNotUnique, NoEquilibrium, SimulationWarning
from symdyn.formulation.algebra import TapeAlgebra, leaves_of
from symdyn.formulation.trees.quantities import TreeQuantities
from symdyn.formulation.trees.recursive import RecursiveTree
from symdyn.formulation.trees.tree import build
from symdyn.model.symbols import time
from symdyn.tape.differentiate import forward
from symdyn.tape.evaluate import evaluate
from symdyn.tape.recorder import Recorder
from symdyn.tape.tape import Tape

MAST = sd.Beam([0, 1, 2.5, 4], [3, 2.5, 2, 1.5], ([300, 250, 200, 100], [400, 300, 250, 200]), 2, axis="z", damping_ratio=0.02)
BLADE = sd.Beam([0, 1, 2], [1, 0.8, 0.5], ([50, 40, 30], [70, 60, 50]), 2, axis="z")


def water(body: Any, seed: int) -> sd.AddedMass:
    half = np.random.default_rng(seed).normal(size=(6, 6))
    return sd.AddedMass(body, (half @ half.T).tolist(), point=[0.1, -0.2, 0.3])


def machine(angle: Any = None) -> sd.System:
    """Revolute joints between a hull and arms in water that turn about parallel axes, and between the flexible tip of a mast, a
    head in water, and a hub that carries a flexible blade; angle: of the hub, if it is given."""
    g = sd.parameters("g")
    system = sd.System("machine", gravity=[0, 0, -g])
    hull = system.add_body("hull", mass=5, inertia=[1, 2, 3], com=[0.1, 0.2, -0.3])
    system.add_joint(sd.Free("sea", system.ground, hull))
    upper = system.add_body("upper", mass=2, com=[0.3, 0.1, 0.2],
                            inertia=[[0.3, 0.01, 0.02], [0.01, 0.4, 0.03], [0.02, 0.03, 0.5]])
    system.add_joint(sd.Revolute("elbow", hull, upper, axis=[0, 1, 0], parent_point=[0.2, 0.1, 0.3],
                                 child_point=[-0.1, 0.2, 0.1]))
    lower = system.add_body("lower", mass=1.5, inertia=[0.1, 0.2, 0.3], com=[0.1, 0.2, 0.4])
    system.add_joint(sd.Revolute("wrist", upper, lower, axis=[0, 1, 0], parent_point=[0.5, 0.1, 0.3]))
    mast = system.add_flexible_body("mast", MAST)
    system.add_joint(sd.Fixed("step", hull, mast.root, parent_point=[0.3, 0.1, 0.2],
                              parent_rotation=sp.rot_ccw_axis1(sp.Rational(3, 10))))
    head = system.add_body("head", mass=2, com=[0.1, 0.2, 0.3],
                           inertia=[[0.3, 0.02, 0.05], [0.02, 0.25, 0.01], [0.05, 0.01, 0.2]])
    system.add_joint(sd.Revolute("yaw", mast.tip, head, axis=[0, 0, 1], parent_point=[0.1, 0.05, 0.2]))
    hub = system.add_body("hub", mass=0.7, inertia=[0.1, 0.2, 0.3], com=[0.05, 0.02, 0.01])
    system.add_joint(sd.Revolute("shaft", head, hub, angle, axis=[1, 0, 0], parent_point=[-0.5, 0, 0.3]))
    blade = system.add_flexible_body("blade", BLADE)
    system.add_joint(sd.Fixed("clamp", hub, blade.root, parent_point=[0, 0, 0.2]))
    for seed, body in enumerate((upper, lower, head)):
        system.add_load(water(body, seed))
    return system.set_defaults({g: 9.81})


def moving_ground() -> sd.System:
    """A mast clamped to a ground that moves, and a body in water on a ball joint there."""
    g = sd.parameters("g")
    system = sd.System("moving", gravity=[0, 0, -g])
    system.move_ground([0.3 * sp.sin(time), time**2 / 5, sp.cos(2 * time) / 4], [time / 3, sp.sin(time) / 2, sp.cos(time) / 3])
    mast = system.add_flexible_body("mast", MAST)
    system.add_joint(sd.Fixed("clamp", system.ground, mast.root, parent_point=[0.3, 0.1, 0.2]))
    head = system.add_body("head", mass=2, inertia=[0.3, 0.2, 0.1], com=[0.1, 0.2, 0.3])
    system.add_joint(sd.Revolute("yaw", mast.tip, head))
    float_ = system.add_body("float", mass=1, inertia=[0.1, 0.2, 0.3], com=[0.2, 0.1, -0.5])
    system.add_joint(sd.Spherical("ball", system.ground, float_, orientation=sd.EulerAngles("ZYX")))
    for load in (water(head, 5), water(float_, 6), sd.LinearStiffness(float_, [10, 20, 30, 4, 5, 6], [1, 2, 3, 0.1, 0.2, 0.3]),
                 sd.LinearDamping(float_, [1, 2, 3, 4, 5, 6], [0.1, 0, -0.3]), sd.Drag(float_, 1, 0.5, 1.2, wind=[1, 2, 0]),
                 sd.Buoyancy(float_, [sd.Box((0.5, 0.6, 0.7), (0, 0, -0.2))], 1.1)):
        system.add_load(load)
    return system.set_defaults({g: 9.81})


def quantities(system: sd.System, aligned: bool, grouped: bool, kind: type[TreeQuantities]) -> TreeQuantities:
    model, recorder = system.check(), Recorder()
    return kind(build(model, TapeAlgebra(recorder, leaves_of(model, recorder)), aligned, grouped))


def evaluated(system: sd.System, found: TreeQuantities, **entries: Any) -> dict[str, np.ndarray]:
    rng, model = np.random.default_rng(0), found.model
    values = {a.name: rng.uniform(-0.8, 0.8) for a in (*model.coordinates, *model.speeds)}
    numbers = {str(p): float(v) for p, v in system.defaults.items()}
    return evaluate(Tape.of(found.algebra.recorder, **entries), {**values, **numbers, "t": 0.37})


def apart(a: np.ndarray, b: np.ndarray) -> float:
    return float(np.abs(a - b).max() / np.abs(b).max())


def test_regrouping_and_parallel_frames_change_nothing() -> None:
    system, seen = machine(), []
    for aligned, grouped, kind in ((False, False, TreeQuantities), (False, True, TreeQuantities), (True, True, TreeQuantities),
                                   (True, True, RecursiveTree)):
        found = quantities(system, aligned, grouped, kind)
        assert found.tree.parallel == (2 if aligned else 0)
        reactions = np.concatenate(list(found.all_reactions().values()))
        seen.append(evaluated(system, found, M=found.M_tilde(), k=found.k_tilde(), F=found.F_tilde(), E=found.energy(),
                              u_dot=found.accelerations(), reactions=reactions))
    for other in seen[1:]:
        assert max(apart(other[name], seen[0][name]) for name in other) < 1e-25


@pytest.mark.every_value
@pytest.mark.parametrize("system", [machine(3 * time / 2 + sp.sin(time) / 5), moving_ground()], ids=["rotor", "ground"])
@pytest.mark.parametrize("kind", [TreeQuantities, RecursiveTree])
def test_power_balance_of_given_motions(system: sd.System, kind: type[TreeQuantities]) -> None:
    found = quantities(system, True, True, kind)
    leaves = found.algebra.leaves
    rates = dict(zip([leaves[u] for u in found.model.speeds], found.recall("accelerations"), strict=True))
    rate = forward(found.algebra.recorder, [sum(found.energy())], {**found.by_time(), **rates})
    values = evaluated(system, found, rate=rate, power=[found.power()])
    assert abs(values["power"][0]) > 10
    assert apart(values["rate"], values["power"]) < 1e-25


# -- extra states at rest


def slider(force: Any, rate: Any, **more: Any) -> Any:
    """A mass on a slide with an extra state z; force and rate are functions of x, z and k."""
    k, (x, z) = sd.parameters("k"), sd.coordinates("x z")
    system = sd.System("slider", gravity=[0, 0, 0])
    body = system.add_body("body", mass=2)
    system.add_joint(sd.Prismatic("slide", system.ground, body, x, axis=[1, 0, 0]))
    system.add_joint_force("slide", force(x, z, k) - x.dot / 2)
    system.add_state(z, rate(x, z, k))
    return system.set_defaults({k: 5}).embedding().compile(backend="numpy")


def test_an_integrator_holds_what_has_no_stiffness() -> None:
    """z' = x - 1/2 brings x to 1/2 though no force follows from x alone."""
    found = slider(lambda x, z, k: 1 - k * z, lambda x, z, k: x - sp.Rational(1, 2)).equilibrium()
    assert (found["x"], found["z"]) == pytest.approx((0.5, 0.2))


def test_an_integrator_that_nothing_comes_of_holds_nothing() -> None:
    with pytest.raises(EquilibriumNotUnique, match=r"no stiffness along x \(1.00\)"):
        slider(lambda x, z, k: 0 * x, lambda x, z, k: 0 * z + k - 5).equilibrium()


def test_a_zero_eigenvalue_is_not_called_double() -> None:
    module = slider(lambda x, z, k: 1 - k * x, lambda x, z, k: x - 1 / k)
    linear = module.linearize(at=module.equilibrium())
    with pytest.raises(ArgumentError, match=r"mode z has the eigenvalue zero, to rounding, whose size has no derivative"):
        linear.derivative("z", "k")


def test_what_extra_states_lack_is_reported() -> None:
    with pytest.raises(NoEquilibrium, match=r"extra states change: z by 1 a second; the last state is x = 0.2, z = 0"):
        slider(lambda x, z, k: 1 - k * x, lambda x, z, k: 1 + 0 * z).equilibrium()


def test_what_is_loose_under_constraints_is_reported_when_parameters_are_solved_for() -> None:
    """Along x = -y the force of the springs, k (-x, y), is one that the constraint bears."""
    (x, y, z), (k, f) = sd.coordinates("x y z"), sd.parameters("k f")
    system = sd.System("saddle", gravity=[0, 0, 0])
    before: Any = system.ground
    for name, q, axis, force in (("X", x, [1, 0, 0], -k * x), ("Y", y, [0, 1, 0], k * y), ("Z", z, [0, 0, 1], f - k * z)):
        body = system.add_body(f"body {name}", mass=1)
        system.add_joint(sd.Prismatic(name, before, body, q, axis=axis))
        system.add_joint_force(name, force)
        before = body
    system.add_constraint(x + y)
    module = system.set_defaults({k: 5, f: 1}).augmented().compile(backend="numpy")
    with pytest.raises(EquilibriumNotUnique, match=r"no stiffness along x \(0.60\), y \(0.40\)"):
        module.equilibrium(free=["x", "y", "z", "f"], fixed={"z": 1})


# -- half a turn


def turned(orientation: Any, rate: str) -> None:
    """A body on springs that turns about the vertical with 2 rad/s, for 1.5 s, to 172 degrees or less."""
    system = sd.System("buoy", gravity=[0, 0, 0])
    buoy = system.add_body("buoy", mass=5, inertia=[1, 1, 1])
    system.add_joint(sd.Free("sea", system.ground, buoy, orientation=orientation))
    system.add_load(sd.LinearStiffness(buoy, [1, 1, 1, 1, 1, 0.01], name="mooring"))
    system.embedding().compile(backend="numpy").simulate((0, 1.5), u={rate: 2.0})


def test_half_a_turn_of_a_rotation_vector_is_reported() -> None:
    with pytest.warns(SimulationWarning, match=r"mooring: the body has turned by 17\d.* degrees; at half a turn its angles jump"):
        turned(sd.EulerParameters(), "omega_z_sea")


def test_half_a_turn_of_coordinates_is_nothing() -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        turned(sd.EulerAngles("ZYX"), "q_sea_4_dot")
