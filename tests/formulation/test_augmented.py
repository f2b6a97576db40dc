"""Augmented equations of bodies: absolute against relative coordinates, reactions against free bodies, closed forms, and loops
against Kane's method and Pinocchio."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import mpmath
import numpy as np
import pytest
import sympy as sp
from sympy.physics import mechanics as me

import symdyn as sd
from symdyn.errors import ModelError, SymdynError
from symdyn.formulation.equations import Equations
from symdyn.tape.floats import evaluate_rows
from tests.formulation.general import chain
from tests.helpers import swept
from tests.mechanisms import kitchen_sink, planar_or_spatial
from tests.oracles.kane import Scene
from tests.oracles.random_trees import random_state, random_tree

TOLERANCE = 1e-10


def started(system: sd.System, seed: int = 0) -> sd.System:
    """The system with a random state as its initial one."""
    model = system.check()
    q, u, _ = random_state(system, seed, 1)
    system.initial = dict(zip((*model.coordinates, *model.speeds), np.concatenate([q[0], u[0]]).tolist(), strict=True))
    inputs = np.random.default_rng(seed).uniform(-3, 3, len(model.inputs)).tolist()
    system.initial |= dict(zip(model.inputs, inputs, strict=True))
    return system


def at(equations: Equations, *names: str, **given: Any) -> dict[str, np.ndarray]:
    """Quantities in numbers, at the initial state but for what is given; where a pivot vanishes, those of the other way."""
    s = equations.symbols
    numbers: dict[str, Any] = {"t": 0.0, **{p.name: float(s.defaults[p]) for p in s.parameters}}
    numbers |= {a.name: float(s.initial.get(a, 0.0)) for a in (*s.coordinates, *s.speeds, *s.states, *s.inputs)}
    found = {name: rows[0] for name, rows in evaluate_rows(equations.tape(*names), {**numbers, **given}, 1).items()}
    if equations.singular_fallback is not None and not all(np.isfinite(value).all() for value in found.values()):
        return at(equations.singular_fallback, *names, **given)
    return found


def accelerations(equations: Equations, **given: Any) -> np.ndarray:
    """[a_G; alpha] of every body."""
    found = at(equations, "J", "Jd_qd", "accelerations", **given)
    return found["J"] @ found["accelerations"] + found["Jd_qd"]


def reactions(equations: Equations, **given: Any) -> dict[str, np.ndarray]:
    names = [name for name, *_ in equations.joints]
    return dict(zip(names, at(equations, "reactions", **given)["reactions"], strict=True))


def close(found: Any, wanted: Any, scale: float = 1.0, tolerance: float = TOLERANCE) -> bool:
    return bool(np.abs(np.asarray(found) - wanted).max(initial=0) <= tolerance * max(scale, np.abs(wanted).max(initial=0)))


# -- mechanisms


def shaken() -> sd.System:
    """On a ground that moves and turns: a hinge, a universal joint with a given angle, loads of all kinds."""
    q1, q2 = sd.coordinates("q1 q2")
    s = sd.System("shaken", gravity=[0, 0, -9.81])
    s.move_ground([sp.sin(sd.t), 0, sd.t**2], [sd.t, 0.3, sp.cos(sd.t)])
    one = s.add_body("one", mass=2, inertia=[1, 2, 2.5], com=[0.1, 0.2, 0.3])
    two = s.add_body("two", mass=1, inertia=[1, 1, 1.5], com=[0.3, 0, 0])
    s.add_joint(sd.Revolute("hinge", s.ground, one, q1, axis=[0.6, 0, 0.8], parent_point=[0.1, 0.2, 0.3]))
    s.add_joint(sd.Universal("cross", one, two, [q2, sp.sin(3 * sd.t)], parent_point=[0.5, 0, 0], child_point=[0, 0, 0.1]))
    s.add_force(two, [1, 2, 3], point=[0.1, 0.1, 0.1])
    s.add_torque(two, [1, 0, 2], frame=one, reaction=one)
    s.add_spring_damper(s.ground, two, point_a=[1, 1, 1], stiffness=10, damping=2, length=0.5)
    return s


def bead_and_screw() -> sd.System:
    """A bead on a wire, with a screw on it."""
    x, c = sd.coordinates("x c")
    s = sd.System("bead_and_screw", gravity=[0, -9.81, 0])
    bead = s.add_body("bead", mass=2, inertia=[1, 2, 2.5], com=[0.1, 0.2, 0.3])
    screw = s.add_body("screw", mass=1, inertia=[1, 1, 1.5], com=[0.3, 0, 0])
    s.add_joint(sd.Custom("wire", s.ground, bead, [x], sp.rot_ccw_axis3(sp.atan(2 * x)), [x, x**2, 0]))
    s.add_joint(sd.Helical("thread", bead, screw, c, pitch=0.2, axis=[0.6, 0, 0.8], child_point=[0, 0.1, 0]))
    s.add_joint_force("thread", 3 - c.dot)
    return s


def geared() -> sd.System:
    """Two wheels and a rack, one of them turned by another through its coordinate."""
    q1, q2 = sd.coordinates("q1 q2")
    s = sd.System("geared", planar=True)
    one, two, rack = s.add_body("one", mass=1, inertia=1), s.add_body("two", mass=1, inertia=2), s.add_body("rack", mass=3)
    s.add_joint(sd.Revolute("a", s.ground, one, q1))
    s.add_joint(sd.Revolute("b", s.ground, two, -2 * q1, parent_point=[1, 0]))
    s.add_joint(sd.Prismatic("c", s.ground, rack, q2, axis=[0.6, 0.8]))
    s.add_joint_force("a", 5)
    s.add_joint_force("b", 2)
    return s


def four_bar_in_space() -> sd.System:
    """The catalogue's four-bar linkage with gravity and bodies in space: three of the five rows of its loop depend on others."""
    plane = sd.systems.four_bar()
    s = sd.System("four_bar_in_space", gravity=[0, plane.gravity[1], 0])
    parent = s.ground
    for body, joint in zip(plane.bodies, plane.joints, strict=True):
        bar = s.add_body(body.name, mass=body.mass, inertia=[0, body.inertia[2, 2], body.inertia[2, 2]], com=list(body.com))
        s.add_joint(sd.Revolute(joint.name, parent, bar, joint.coordinates[0], parent_point=list(joint.parent_point)))
        parent = bar
    last = plane.loops[0]
    at_ends = {"parent_point": list(last.parent_point), "child_point": list(last.child_point)}
    s.close_loop(sd.Revolute("hinge4", s.ground, parent, **at_ends))
    s.defaults, s.initial = plane.defaults, plane.initial
    return s


def closed_chain() -> sd.System:
    """Seven hinges and the last body fixed to the ground, closed at q = 0; one motion is left."""
    s = chain("Rz Ry Rx Rw Rz Rx Ry")
    at_end = sum((j.parent_point for j in s.joints), sp.zeros(3, 1))
    s.close_loop(sd.Fixed("weld", s.ground, s.bodies[-1], parent_point=list(at_end)))
    rng = np.random.default_rng(5)
    s.defaults = {p: float(rng.uniform(0.2, 1.0)) for p in s.check().parameters}
    s.defaults |= {p: v * (3 if p.name[-2:] in ("xx", "yy", "zz") else 0.1) for p, v in s.defaults.items() if p.name[0] == "I"}
    return s


# -- absolute and relative coordinates

TREES: dict[str, tuple[Callable[[], sd.System], Any]] = {
    **{name: (getattr(sd.systems, name), None) for name in ("double_pendulum", "cart_pole", "vehicle_on_rotating_track",
                                                            "prismatic_chain", "two_link_arm")},
    "three_link_arm": (sd.systems.three_link_arm, sd.EulerAngles("XYZ")),
    "kitchen_sink": (kitchen_sink, sd.EulerParameters()),
    "planar": (lambda: planar_or_spatial(True), None),
    "geared": (geared, None),
    "shaken": (shaken, None),
    "shaken, angles": (shaken, sd.EulerAngles("ZXZ", "body")),
    "bead_and_screw": (bead_and_screw, sd.EulerAngles("YXZ")),
    "tree 2": (lambda: random_tree(2), None),
    "tree 4": (lambda: random_tree(4), sd.EulerAngles("ZYX")),
    "tree 7": (lambda: random_tree(7), sd.EulerAngles("XZX", "body")),
}


@pytest.mark.parametrize("name", swept(TREES, "kitchen_sink", "planar", "geared", "shaken, angles",
                                        "bead_and_screw"))
def test_absolute_coordinates_give_the_same_motion_and_reactions(name: str) -> None:
    """Bodies accelerate alike; multipliers make the forces and moments that the recursion of the tree gives."""
    make, orientation = TREES[name]
    system = started(make(), seed=3)
    relative, absolute = system.embedding(), system.augmented("absolute", orientation)
    found = at(absolute, "C", "C_dot", "J", "Jd_qd", "accelerations")
    assert max(np.abs(found[n]).max() for n in ("C", "C_dot")) < 1e-13
    wanted = accelerations(relative)
    assert close((found["J"] @ found["accelerations"] + found["Jd_qd"])[:len(wanted)], wanted)
    ours, theirs = reactions(absolute), reactions(relative)
    free = {j.name for j in system.joints if isinstance(j, sd.Free)}
    assert set(theirs) - free <= set(ours) <= set(theirs)
    scale = max(np.abs(r).max() for r in theirs.values())
    for joint, reaction in ours.items():
        assert close(reaction, theirs[joint], max(1, scale)), joint


@pytest.mark.parametrize("name", ["four_bar", *swept(["slider_crank", "andrews_squeezer"]), "rolling_disc", *swept(["skate"])])
def test_loops_and_constraints_in_absolute_coordinates(name: str) -> None:
    system = sd.systems.get(name)
    relative, absolute = system.augmented(), system.augmented("absolute")
    assert len(absolute.symbols.speeds) - len(absolute.constraints) == len(relative.symbols.speeds) - len(relative.constraints)
    assert max(np.abs(at(absolute, n)[n]).max() for n in ("C", "C_dot")) < 1e-13
    wanted = accelerations(relative)
    assert close(accelerations(absolute)[:len(wanted)], wanted)
    ours, theirs = reactions(absolute), reactions(relative)
    for joint in set(ours) & set(theirs):
        assert close(ours[joint], theirs[joint], max(np.abs(r).max() for r in theirs.values())), joint


@pytest.mark.every_value
@pytest.mark.parametrize("frames", ["body", "parallel"])
@pytest.mark.parametrize("make", [sd.systems.three_link_arm, geared, shaken, kitchen_sink], ids=lambda make: make.__name__)
def test_relative_coordinates_of_a_tree_are_the_embedding(make: Callable[[], sd.System], frames: str) -> None:
    system = started(make())
    embedding, augmented, recursive = system.embedding(), system.augmented(frames=frames), system.recursive()
    assert augmented.constraints == () and augmented.formulation == "augmented"
    for equations in (augmented, recursive):
        assert close(at(equations, "rhs")["rhs"], at(embedding, "rhs")["rhs"])
        for joint, reaction in reactions(equations).items():
            assert close(reaction, reactions(embedding)[joint])


def test_start_values_of_absolute_coordinates_are_left_to_the_user_without_numbers() -> None:
    system = sd.systems.double_pendulum()
    system.defaults = {}
    assert not system.augmented("absolute").symbols.initial


def test_symbols_of_absolute_coordinates_do_not_collide() -> None:
    q = sd.coordinates("x_bob")
    m = sd.parameters("theta_bob")
    s = sd.System("named", planar=True, gravity=[0, -1])
    bob = s.add_body("bob", mass=m, com=[0, -1])
    s.add_joint(sd.Revolute("hinge", s.ground, bob, q))
    s.add_joint_force("hinge", -q)
    names = [symbol.name for symbol in s.augmented("absolute").symbols.coordinates]
    assert names == ["x_bob_", "y_bob", "theta_bob_", "x_bob"]


@pytest.mark.parametrize("name", ["hinge_own", "bob_own", "last_closure"])
def test_joints_keep_their_names(name: str) -> None:
    """Also those that look like the names of what the derivation adds."""
    s = sd.System("named", planar=True, gravity=[0, -1])
    bob, tail = s.add_body("bob", mass=1, com=[0, -1]), s.add_body("bob_own", mass=1, com=[0, -1])
    s.add_joint(sd.Revolute(name, s.ground, bob, sd.coordinates("q")))
    s.add_joint(sd.Revolute("last", bob, tail, sd.coordinates("p"), parent_point=[0, -1]))
    s.add_joint_force("last", -sd.coordinates("p"))
    started(s)
    found = reactions(s.augmented("absolute"))
    assert set(found) == {name, "last"}
    for joint, reaction in reactions(s.embedding()).items():
        assert close(found[joint], reaction)
    closed = sd.systems.four_bar()
    closed.loops[0].name = name
    assert list(reactions(closed.augmented())) == ["hinge1", "hinge2", "hinge3", name]


# -- reactions and free bodies


def twists(system: sd.System, equations: Equations) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Positions of the centres of mass (n, 3), rotations (n, 3, 3), Jacobians (n, 6, n_u), and those of a body at rest last."""
    found = at(equations, "positions", "frames", "J")
    n = len(found["positions"])
    J = np.zeros((n + 1, 6, found["J"].shape[1]))
    J[:n, [0, 1, 5] if equations.planar else slice(None)] = found["J"].reshape(n, -1, J.shape[2])
    still = np.eye(3)[None]
    return (np.vstack([found["positions"], np.zeros(3)]), np.concatenate([found["frames"][:, 3:].reshape(n, 3, 3), still]), J)


def numeric(matrix: Any, numbers: Mapping[sp.Symbol, float]) -> np.ndarray:
    return np.array(sp.Matrix(matrix).xreplace({k: sp.Float(v, 17) for k, v in numbers.items()}).tolist(), dtype=float)


def ends(system: sd.System, equations: Equations) -> list[tuple[sd.Joint, int, int, np.ndarray]]:
    """Every joint and closing joint with its parent, its child and its point on the child, n-frame."""
    model = system.check()
    index = {"ground": -1, id(model.bodies[0]): 0} | {id(b): k for k, b in enumerate(model.bodies)}
    index |= {b.name: k for k, b in enumerate(model.bodies)} | {id(system.ground): -1}
    frames = at(equations, "frames")["frames"]
    result = []
    for joint in [*model.joints, *(j for j in model.loops if not isinstance(j, sd.Gear))]:
        parent, child = (index[end if isinstance(end, str) else id(end)] for end in (joint.parent, joint.child))
        point = numeric(joint.child_point, model.defaults).ravel()
        origin, R = (frames[child, :3], frames[child, 3:].reshape(3, 3)) if child >= 0 else (np.zeros(3), np.eye(3))
        result.append((joint, parent, child, origin + R @ point))
    return result


@pytest.mark.every_value
@pytest.mark.parametrize("formulation", ["embedding", "recursive"])
@pytest.mark.parametrize("seed", [0, 1, *swept([3, 8])])
def test_reactions_move_every_free_body_and_do_no_work(seed: int, formulation: str) -> None:
    system = started(random_tree(seed), seed)
    check_free_bodies(system, getattr(system, formulation)())


@pytest.mark.parametrize("make", [sd.systems.four_bar, sd.systems.spatial_slider_crank, *swept([sd.systems.bricard]),
                                  four_bar_in_space], ids=lambda make: make.__name__)
def test_reactions_of_loops_move_every_free_body_and_do_no_work(make: Callable[[], sd.System]) -> None:
    system = make()
    equations = system.augmented()
    model = system.check()
    C_r = at(equations, "C_r")["C_r"]
    sizes, Vt = np.linalg.svd(C_r)[1:]
    free = Vt[(sizes > 1e-9 * sizes[0]).sum():]
    u = np.random.default_rng(1).uniform(1, 2, len(free)) @ free
    system.initial = {**model.initial, **dict(zip(model.speeds, u.tolist(), strict=True))}
    check_free_bodies(system, system.augmented())


def check_free_bodies(system: sd.System, equations: Equations) -> None:
    """Free bodies of systems under gravity alone. On each body: m a = sum of forces, I alpha + omega x I omega = sum of moments;
    the reaction of each joint is at right angles to what each speed moves in it."""
    model = system.check()
    positions, rotations, J = twists(system, equations)
    n = len(model.bodies)
    speeds = np.array([float(equations.symbols.initial.get(u, 0)) for u in equations.symbols.speeds])
    planar = [0, 1, 5] if model.planar else slice(None)
    bodies = np.zeros((n, 6))
    bodies[:, planar] = accelerations(equations).reshape(n, -1)
    gravity = numeric(model.gravity, model.defaults).ravel()
    needed = np.zeros((n + 1, 6))
    for k, body in enumerate(model.bodies):
        m = float(numeric([body.mass], model.defaults)[0, 0])
        I = rotations[k] @ numeric(body.inertia, model.defaults) @ rotations[k].T
        omega = J[k, 3:] @ speeds
        needed[k, :3] = m * (bodies[k, :3] - gravity)
        needed[k, 3:] = I @ bodies[k, 3:] + np.cross(omega, I @ omega)
    scale = max(1.0, np.abs(needed).max())
    found = reactions(equations)
    for joint, parent, child, point in ends(system, equations):
        f, moment = np.split(found[joint.name], 2)
        relative = np.zeros((6, len(speeds)))
        for sign, body in ((1, child), (-1, parent)):
            arm = point - positions[body]
            needed[body] -= sign * np.concatenate([f, moment + np.cross(arm, f)])
            relative[:3] += sign * (J[body, :3] - np.cross(arm, J[body, 3:], axisb=0, axisc=0))
            relative[3:] += sign * J[body, 3:]
        if joint in model.joints:
            assert close(found[joint.name] @ relative, 0 * speeds, scale * max(1, np.abs(relative).max()))
    assert close(needed[:n][:, planar], 0 * needed[:n][:, planar], scale)


def arm(angle: Any, **more: Any) -> sd.System:
    """A point mass m at the end of a rod l, turned about z; the rod's bracket is fixed to the ground."""
    m, l = sd.parameters("m l")
    s = sd.System("arm", **more)
    bracket = s.add_body("bracket", mass=5)
    rod = s.add_body("rod", mass=m, com=[l, 0, 0])
    s.add_joint(sd.Fixed("bolts", s.ground, bracket))
    s.add_joint(sd.Revolute("hinge", bracket, rod, angle, parent_point=[0, 0, 1]))
    s.defaults = {m: 2.0, l: 0.5}
    s.add_state(sd.coordinates("clock"), 1)
    return s


def test_reaction_of_a_prescribed_motion() -> None:
    """q = t^2: the hinge gives the moment m l^2 q_ddot, and -m l q_dot^2 along the rod."""
    found = reactions(arm(sd.t**2).embedding(), t=0.5)
    c, s = np.cos(0.25), np.sin(0.25)
    along, across = -2 * 0.5 * 1.0, 2 * 0.5 * 2.0
    force = [along * c - across * s, along * s + across * c, 0]
    assert close(found["hinge"], [*force, 0, 0, 2 * 0.25 * 2])
    assert close(found["bolts"], [*force, -force[1], force[0], 2 * 0.25 * 2])


def test_a_drive_is_taken_off_the_reaction() -> None:
    q = sd.coordinates("q")
    driven, loose = arm(q, gravity=[0, -9.81, 0]), arm(q, gravity=[0, -9.81, 0])
    driven.add_joint_force("hinge", 7)
    with_drive, without = reactions(driven.embedding()), reactions(loose.embedding())
    assert close(with_drive["hinge"][5], 0) and close(without["hinge"][5], 0)
    assert close(with_drive["bolts"][5], 7)  # what the drive leans on
    assert close(with_drive["hinge"][:3] - without["hinge"][:3], [0, 7 / 0.5, 0])


def test_reaction_of_the_moving_ground() -> None:
    """Lifted with a = 2 m/s^2 the bolts carry the masses' (g + a)."""
    s = arm(sp.S.Zero, gravity=[0, 0, -9.81])
    s.move_ground([0, 0, sd.t**2])
    assert close(reactions(s.embedding())["bolts"][:3], [0, 0, 7 * 11.81])


# -- closed forms of multipliers


def test_multipliers_are_the_forces_of_the_loop() -> None:
    system = sd.systems.four_bar()
    equations = system.augmented()
    found = at(equations, "lam")["lam"]
    assert close(reactions(equations)["hinge4"], [-found[0], -found[1], 0, 0, 0, 0])


def test_gear_between_two_wheels() -> None:
    """(I_1 + r^2 I_2) q1_ddot = tau, lam = -I_2 r q1_ddot; a gear by coordinate moves the same."""
    q1, q2 = sd.coordinates("q1 q2")
    r, tau = sd.parameters("r tau")

    def wheels(second: Any) -> sd.System:
        s = sd.System("wheels", planar=True)
        one, two = s.add_body("one", mass=1, inertia=3), s.add_body("two", mass=1, inertia=2)
        s.add_joint(sd.Revolute("a", s.ground, one, q1))
        s.add_joint(sd.Revolute("b", s.ground, two, second, parent_point=[1, 0]))
        s.add_joint_force("a", tau)
        s.defaults = {r: -2.5, tau: 4.0}
        return s

    geared = wheels(q2)
    geared.close_loop(sd.Gear("gear", "a", "b", r))
    equations = geared.augmented()
    found = at(equations, "accelerations", "lam")
    first = 4.0 / (3 + 2.5**2 * 2)
    assert close(found["accelerations"], [first, -2.5 * first]) and close(found["lam"], [2 * 2.5 * first])
    assert close(found["accelerations"][0], at(wheels(r * q1).embedding(), "accelerations")["accelerations"][0])


def test_rod_carries_what_hangs_on_it() -> None:
    """A body that could move freely, on a rod: hanging at rest, and swinging through the lowest point with v."""
    x, y, theta = sd.coordinates("x y theta")
    s = sd.System("hung", gravity=[0, -10])
    body = s.add_body("body", mass=3, inertia=1)
    s.add_joint(sd.Planar("free", s.ground, body, [x, y, theta]))
    s.close_loop(sd.Rod("rod", s.ground, body, 2))
    s.initial = {y: -2}
    equations = s.augmented()
    assert close(at(equations, "lam")["lam"], [30.0])
    assert close(reactions(equations)["rod"], [0, 30, 0, 0, 0, 0])
    assert close(reactions(equations, x_dot=4.0)["rod"], [0, 30 + 3 * 16 / 2, 0, 0, 0, 0])


@pytest.mark.parametrize("make", [sd.systems.four_bar, sd.systems.spatial_slider_crank, sd.systems.rolling_disc,
                                  sd.systems.n_four_bar], ids=lambda make: make.__name__)
def test_solution_and_corrections(make: Callable[[], sd.System]) -> None:
    """At states that are not consistent: M u_dot + C_r^T lam = F - k and C_r u_dot = F_d; corrections are Newton steps, least in
    the mass metric: M dv is in the range of C_r^T."""
    equations = make().augmented()
    s = equations.symbols
    rng = np.random.default_rng(2)
    given = {q.name: float(s.initial.get(q, 0.0)) + rng.uniform(-0.05, 0.05) for q in s.coordinates}
    given |= {u.name: rng.uniform(-1, 1) for u in s.speeds}
    names = ("M_tilde", "k_tilde", "F_tilde", "C_r", "C", "C_dot", "F_d", "accelerations", "lam", "matrix", "right_side", "N",
             "position_correction", "velocity_correction", "C_scale", "rates")
    f = at(equations, *names, **given)
    M, C_r = f["M_tilde"], f["C_r"]
    n_c = len(C_r)
    force = f["F_tilde"] - f["k_tilde"]
    scale = max(np.abs(force).max(), np.abs(C_r.T @ f["lam"]).max())
    assert close(M @ f["accelerations"] + C_r.T @ f["lam"], force, scale)
    assert close(C_r @ f["accelerations"], f["F_d"], tolerance=1e-9)
    assert close(f["matrix"] @ np.concatenate([f["accelerations"], f["lam"]]), f["right_side"], scale, 1e-9)
    dq, du = f["position_correction"][n_c:], f["velocity_correction"][n_c:]
    assert close(f["position_correction"][:n_c], f["C"] * f["C_scale"])
    assert close(f["velocity_correction"][:n_c], f["C_dot"] * f["C_scale"])
    dv = np.linalg.lstsq(f["N"], dq, rcond=None)[0]
    for change, gap in ((dv, f["C"]), (du, f["C_dot"])):
        assert close(f["N"] @ dv, dq)
        assert close(C_r @ change, -gap, tolerance=1e-8)
        left = M @ change
        assert np.abs(left - C_r.T @ np.linalg.lstsq(C_r.T, left, rcond=None)[0]).max() <= 1e-8 * max(1, np.abs(left).max())


def test_dependent_rows_change_nothing_and_have_the_least_multipliers() -> None:
    flat, space = sd.systems.four_bar().augmented(), four_bar_in_space().augmented()
    given = {"q1_dot": 1.0, "q2_dot": -0.3, "q3_dot": 0.4}
    assert len(space.constraints) + sum(note.count("hold by structure") for note in space.notes) >= 2
    assert close(at(space, "accelerations", **given)["accelerations"], at(flat, "accelerations", **given)["accelerations"])
    found = at(space, "lam", "C_r", "M_tilde", "bias", "accelerations", **given)
    left = -found["bias"] - found["M_tilde"] @ found["accelerations"]
    assert close(found["lam"], np.linalg.pinv(found["C_r"].T) @ left, tolerance=1e-7)


def test_bricard_has_one_row_too_many() -> None:
    equations = sd.systems.bricard().augmented()
    assert any("rank 4 of 5" in note for note in equations.notes)
    found = at(equations, "M_tilde", "bias", "C_r", "lam", "accelerations", "F_d")
    assert close(found["M_tilde"] @ found["accelerations"] + found["C_r"].T @ found["lam"], -found["bias"])
    assert close(found["C_r"] @ found["accelerations"], found["F_d"], tolerance=1e-9)


def test_a_massless_link_that_a_loop_carries() -> None:
    """The massless slider of a screw: M is singular, the constraints make it regular."""
    q, z = sd.coordinates("q z")
    s = sd.System("thread", gravity=[0, 0, -9.81])
    nut = s.add_body("nut", mass=1, inertia=[1, 1, 1])
    s.add_joint(sd.Cylindrical("guide", s.ground, nut, [q, z]))
    s.close_loop(sd.Helical("screw", s.ground, nut, pitch=0.1))
    equations = s.augmented()
    down = -9.81 * 0.01 / 1.01
    assert close(at(equations, "accelerations")["accelerations"], [down / 0.1, down, down / 0.1])
    found = reactions(equations)
    assert close(found["guide"], np.zeros(6)) and close(found["screw"], [0, 0, 9.81 + down, 0, 0, down / 0.1])


# -- messages


def test_unknown_coordinates() -> None:
    with pytest.raises(SymdynError, match="coordinates 'joint' asked for; there are 'relative' and 'absolute'"):
        sd.systems.pendulum().augmented("joint")


def test_unknown_frames() -> None:
    with pytest.raises(SymdynError, match="frames 'world' asked for"):
        sd.systems.four_bar().augmented(frames="world")


@pytest.mark.parametrize("formulation", ["embedding", "recursive"])
def test_other_forms_take_trees_only(formulation: str) -> None:
    with pytest.raises(ModelError, match=r"has a constraint or closed loop; .* trees only: use system.augmented\(\)"):
        getattr(sd.systems.four_bar(), formulation)()


# -- other programs


def test_loops_are_pinocchios() -> None:
    pin = pytest.importorskip("pinocchio", reason="Pinocchio is not installed; run: pip install pin")
    from tests.oracles.pinocchio import PinocchioOracle

    for make, kind in ((sd.systems.four_bar, pin.ContactType.CONTACT_3D), (closed_chain, pin.ContactType.CONTACT_6D),
                       (sd.systems.spatial_slider_crank, pin.ContactType.CONTACT_3D)):
        system = make()
        model, equations = system.check(), system.augmented()
        oracle = PinocchioOracle(replace(model, loops=()), model.defaults)
        q = np.array([float(model.initial.get(s, 0)) for s in model.coordinates])
        u = 3 * np.linalg.svd(at(equations, "C_r")["C_r"])[2][-1]
        given = dict(zip([s.name for s in model.speeds], u.tolist(), strict=True))
        closing = model.loops[0]
        index = {id(b): k for k, b in enumerate(model.bodies)}
        frames = []
        for body, point in ((closing.parent, closing.parent_point), (closing.child, closing.child_point)):
            place = oracle.places[index.get(id(body), -1)]
            frames.append((place.joint, place.pose * pin.SE3(np.eye(3), oracle.array(point).ravel())))
        rigid = pin.RigidConstraintModel(kind, oracle.pin, *frames[0], *frames[1], pin.ReferenceFrame.LOCAL)
        models, data = pin.StdVec_RigidConstraintModel(), pin.StdVec_RigidConstraintData()
        models.append(rigid)
        data.append(rigid.createData())
        pin.initConstraintDynamics(oracle.pin, oracle.data, models, data)
        found = pin.constraintDynamics(oracle.pin, oracle.data, oracle.q(q), oracle.v(u), np.zeros(len(u)), models, data,
                                       pin.ProximalSettings(1e-13, 1e-13, 1e-6, 100))
        assert close(at(equations, "accelerations", **given)["accelerations"], np.array(found)[oracle.order], tolerance=1e-9)
        R = (oracle.data.oMi[frames[0][0]] * frames[0][1]).rotation
        force = np.concatenate([R @ data[0].contact_force.linear, R @ data[0].contact_force.angular])
        assert close(-reactions(equations, **given)[closing.name], force, tolerance=1e-9), system.name


def solved(kane: Any, s: Scene, names: list[str], numbers: Mapping[str, float], q: np.ndarray, u: np.ndarray) -> np.ndarray:
    kane.kanes_equations(s.bodies, s.loads)
    evaluate = sp.lambdify([*s.q, *s.u, *sp.symbols(names)], [kane.mass_matrix, kane.forcing], modules="mpmath", cse=True)
    with mpmath.workdps(30):
        mass, forcing = evaluate(*[mpmath.mpf(float(v)) for v in (*q, *u, *(numbers[n] for n in names))])
        solution = mpmath.lu_solve(mass, forcing)
    order = [kane.u.tolist().index([v]) for v in s.u]
    return np.array([float(solution[k]) for k in order])


def test_four_bar_is_kanes() -> None:
    s = Scene(3)
    names = ["g", "d", *[f"{letter}{k}" for k in (1, 2, 3) for letter in ("m", "I", "lc", "l")]]
    value = dict(zip(names, sp.symbols(names), strict=True))
    frame, hinge = s.N, s.O
    for k in (1, 2, 3):
        m, inertia, lc, l = (value[f"{letter}{k}"] for letter in ("m", "I", "lc", "l"))
        frame = s.turned(frame, f"A{k}", k - 1, frame.z)
        G = s.fixed_on(hinge, frame, f"G{k}", lc * frame.x)
        s.weigh(me.RigidBody(f"bar{k}", G, frame, m, (me.inertia(frame, 0, 0, inertia), G)), G, -m * value["g"] * s.N.y)
        hinge = s.fixed_on(hinge, frame, f"O{k + 1}", l * frame.x)
    gap = hinge.pos_from(s.O) - value["d"] * s.N.x
    speed = hinge.vel(s.N)
    kane = me.KanesMethod(s.N, q_ind=s.q[:1], u_ind=s.u[:1], q_dependent=s.q[1:], u_dependent=s.u[1:],
                          kd_eqs=[v - x.diff() for x, v in zip(s.q, s.u, strict=True)],
                          configuration_constraints=[gap.dot(s.N.x), gap.dot(s.N.y)],
                          velocity_constraints=[speed.dot(s.N.x), speed.dot(s.N.y)])
    compare_with_kane(sd.systems.four_bar(), kane, s, names)


def test_rolling_disc_is_kanes() -> None:
    s = Scene(6)
    names = ["g", "m", "R", "I_t", "I_a"]
    g, m, R, I_t, I_a = sp.symbols(names)
    A = s.turned(s.N, "A", 3, s.N.z)
    B = s.turned(A, "B", 4, A.x)
    C = s.turned(B, "C", 5, B.z)
    G = s.O.locatenew("G", s.q[0] * s.N.x + s.q[1] * s.N.y + s.q[2] * s.N.z)
    G.set_vel(s.N, s.u[0] * s.N.x + s.u[1] * s.N.y + s.u[2] * s.N.z)
    s.weigh(me.RigidBody("disc", G, C, m, (me.inertia(B, I_t, I_t, I_a), G)), G, -m * g * s.N.z)
    slip = G.vel(s.N) + C.ang_vel_in(s.N).cross(-R * B.y)
    kane = me.KanesMethod(s.N, q_ind=[*s.q[:2], *s.q[3:]], q_dependent=[s.q[2]], u_ind=s.u[3:], u_dependent=s.u[:3],
                          kd_eqs=[v - x.diff() for x, v in zip(s.q, s.u, strict=True)],
                          configuration_constraints=[s.q[2] - R * sp.sin(s.q[4])],
                          velocity_constraints=[slip.dot(e) for e in (s.N.x, s.N.y, s.N.z)])
    compare_with_kane(sd.systems.rolling_disc(), kane, s, names)


def compare_with_kane(system: sd.System, kane: Any, scene: Scene, names: list[str]) -> None:
    """At a consistent state with speeds that the constraints allow."""
    model, equations = system.check(), system.augmented()
    q = np.array([float(model.initial.get(s, 0)) for s in model.coordinates])
    C_r = at(equations, "C_r")["C_r"]
    free = np.linalg.svd(C_r)[2][len(C_r):]
    u = np.array([2.0, -1.0, 1.5])[:len(free)] @ free
    wanted = solved(kane, scene, names, {p.name: v for p, v in model.defaults.items()}, q, u)
    given = dict(zip([s.name for s in model.speeds], u.tolist(), strict=True))
    assert close(at(equations, "accelerations", **given)["accelerations"], wanted)


def test_reactions_of_a_closing_screw_turn_into_the_axes_of_its_child() -> None:
    s = sd.System("screwed", gravity=[1, 2, -9.81])
    nut = s.add_body("nut", mass=1, inertia=[1, 1, 1], com=[0.5, 0, 0])
    s.add_joint(sd.Cylindrical("guide", s.ground, nut))
    s.close_loop(sd.Helical("screw", s.ground, nut, pitch=0.1))
    s.initial = {"q_guide_1": 0.3, "q_guide_2": 0.03, "q_screw": 0.3}
    found = {}
    for coordinates in ("relative", "absolute"):
        equations = s.augmented(coordinates)
        assert ("screw", "ground", "nut", "helical") in equations.joints
        assert len({*equations.bodies}) == len(equations.bodies)
        solution = equations.compile("numpy").simulate([0, 0.05])
        found[coordinates] = solution.reaction("screw", "child")
        assert np.array_equal(found[coordinates], solution.reaction("screw", "nut"))
    along = [2, 5]  # the rest the guide shares
    assert close(found["absolute"][0][along], found["relative"][0][along], 10.0)


ORIENTATIONS: dict[str, tuple[dict[str, Any], bool, str]] = {
    "relative": ({"orientation": sd.EulerParameters()}, False,
                 "orientation EulerParameters is given, but coordinates are 'relative'"),
    "planar": ({"orientation": sd.EulerAngles("XYZ"), "coordinates": "absolute"}, True, "but the system is planar.*leave it out"),
    "text": ({"orientation": "XYZ", "coordinates": "absolute"}, False,
             "orientation is 'XYZ'; it describes how bodies turn.*sd.EulerAngles"),
}


@pytest.mark.parametrize("name", ORIENTATIONS)
def test_orientations_that_nothing_takes(name: str) -> None:
    options, planar, message = ORIENTATIONS[name]
    s = sd.System("one", gravity=[0, -9.81] if planar else [0, 0, -9.81])
    s.add_joint(sd.Revolute("hinge", s.ground, s.add_body("body", mass=1, inertia=1 if planar else [1, 1, 1], com=[1, 0]
                                                           if planar else [1, 0, 0])))
    with pytest.raises(SymdynError, match=message):
        s.augmented(**options)


@pytest.mark.parametrize("coordinates", ["relative", "absolute"])
def test_dependent_constraints_without_numbers(coordinates: str) -> None:
    s = sd.systems.bricard()
    s.defaults = {}
    notes = s.augmented(coordinates).notes
    assert any("they depend on the others at every state tried" in note for note in notes)


def test_dependence_without_numbers_in_euler_parameters() -> None:
    """A parallelogram, whose bars begin on one line: 18 speeds less the one of its motion are held; on the line 16 are."""
    m = sd.parameters("m")
    s = sd.System("parallelogram")
    left, bar, right = (s.add_body(name, mass=m, inertia=[1, 2, 3]) for name in ("left", "bar", "right"))
    for name, parent, child, place in (("O", s.ground, left, 0), ("A", left, bar, 1), ("B", bar, right, 2)):
        s.add_joint(sd.Revolute(name, parent, child, axis=[0, 0, 1], parent_point=[place, 0, 0]))
    s.close_loop(sd.Revolute("C", s.ground, right, axis=[0, 0, 1], parent_point=[2, 0, 0], child_point=[-1, 0, 0]))
    notes = s.augmented("absolute", sd.EulerParameters()).notes
    assert any("they depend on the others at every state tried" in note and "(rank 17 of 20)" in note for note in notes), notes


def test_dependence_is_unknown_where_random_numbers_leave_no_state() -> None:
    s = sd.System("far", gravity=[0, -9.81])
    body = s.add_body("body", mass=1, inertia=1)
    s.add_joint(sd.Revolute("hinge", s.ground, body))
    far = sd.parameters("far")
    s.close_loop(sd.Rod("rod", s.ground, body, far, parent_point=[100, 0], child_point=[1, 0]))
    assert any("whether they depend on each other is unknown, because far has no number" in n for n in s.augmented().notes)


def test_euler_angles_at_gimbal_lock() -> None:
    s = sd.System("upright", gravity=[0, 0, -9.81])
    bar = s.add_body("bar", mass=1, inertia=[1, 1, 1], com=[1, 0, 0])
    hinge = s.add_joint(sd.Revolute("hinge", s.ground, bar, axis=[0, 1, 0]))
    s.initial = {hinge.coordinates[0]: np.pi / 2}
    with pytest.warns(sd.ModelWarning, match=r"upright: the Euler angles ZYX of bar are singular.*or sd.EulerParameters\(\)"):
        s.augmented("absolute", sd.EulerAngles("ZYX"))
    s.augmented("absolute")
