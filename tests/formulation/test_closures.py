"""Joints that close loops: rows that vanish on the joint's own motion, and derivatives that are those of the rows."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
import sympy as sp

import symdyn as sd
from symdyn.formulation.constraints.rows import Gathered
from symdyn.formulation.trees.equations import tree_of
from symdyn.model.joints import Prismatic
from symdyn.model.joints.axis import AxisJoint
from symdyn.model.symbols import symbols_of
from symdyn.tape import Tape
from symdyn.tape.differentiate import forward
from symdyn.tape.floats import evaluate_rows

STATES = 5
SKEW = sp.Matrix([[2, -1, 2], [2, 2, -1], [-1, 2, 2]]) / 3
QUARTER = sp.Matrix([[0, 0, 1], [1, 0, 0], [0, 1, 0]])
PLACE: dict[str, Any] = {"parent_point": [0.5, -0.2, 0.3], "child_point": [0.1, 0.4, -0.6], "parent_rotation": SKEW,
                         "child_rotation": QUARTER}
FLAT: dict[str, Any] = {"parent_point": [0.5, -0.2], "child_point": [0.1, 0.4],
                        "parent_rotation": sp.rot_ccw_axis3(sp.Rational(1, 3)), "child_rotation": sp.rot_ccw_axis3(-1)}
w, h = sd.coordinates("w h")
alpha, pitch, n_x, n_y = sd.parameters("alpha pitch n_x n_y")
NUMBERS = {alpha: 0.7, pitch: 0.13, n_x: 0.48, n_y: -0.6}
TILTED = [sp.sin(alpha), 0, sp.cos(alpha)]
THIRDS = [sp.Rational(1, 3), sp.Rational(2, 3), sp.Rational(2, 3)]
LEFTOVER = [n_x, n_y, -sp.sqrt(1 - n_x**2 - n_y**2)]

Make = Callable[..., Any]
# name -> (joint from (name, parent, child, coordinates by keyword, place), number of its rows)
SPATIAL: dict[str, tuple[Make, int]] = {
    "fixed": (lambda *n, **p: sd.Fixed(*n, **p), 6),
    "revolute": (lambda *n, **p: sd.Revolute(*n, **p), 5),
    "revolute x": (lambda *n, **p: sd.Revolute(*n, axis=[1, 0, 0], **p), 5),
    "revolute -y": (lambda *n, **p: sd.Revolute(*n, axis=[0, -1, 0], **p), 5),
    "revolute 3-4": (lambda *n, **p: sd.Revolute(*n, axis=[0.6, 0.8, 0], **p), 5),
    "revolute thirds": (lambda *n, **p: sd.Revolute(*n, axis=THIRDS, **p), 5),
    "revolute tilted": (lambda *n, **p: sd.Revolute(*n, axis=TILTED, **p), 5),
    "revolute symbols": (lambda *n, **p: sd.Revolute(*n, axis=LEFTOVER, **p), 5),
    "prismatic": (lambda *n, **p: sd.Prismatic(*n, **p), 5),
    "prismatic thirds": (lambda *n, **p: sd.Prismatic(*n, axis=THIRDS, **p), 5),
    "prismatic tilted": (lambda *n, **p: sd.Prismatic(*n, axis=TILTED, **p), 5),
    "cylindrical": (lambda *n, **p: sd.Cylindrical(*n, **p), 4),
    "cylindrical symbols": (lambda *n, **p: sd.Cylindrical(*n, axis=LEFTOVER, **p), 4),
    "universal": (lambda *n, **p: sd.Universal(*n, **p), 4),
    "universal skew": (lambda *n, **p: sd.Universal(*n, axes=[TILTED, THIRDS], **p), 4),
    "planar": (lambda *n, **p: sd.Planar(*n, **p), 3),
    "spherical": (lambda *n, **p: sd.Spherical(*n, **p), 3),
    "spherical parameters": (lambda *n, **p: sd.Spherical(*n, orientation=sd.EulerParameters(), **p), 3),
    "helical": (lambda *n, **p: sd.Helical(*n, axis=THIRDS, pitch=pitch, **p), 6),
    "custom": (lambda *n, **p: sd.Custom(*n, [w, h], sp.rot_ccw_axis2(w), [h, pitch * h**2, sp.sin(w)], **p), 6),
}
# Those that loops close by coordinates of their own, since their rows do not come from the poses of two bodies.
BY_COORDINATES = ("helical", "custom")
PLANAR: dict[str, tuple[Make, int]] = {
    "fixed": (lambda *n, **p: sd.Fixed(*n, **p), 3),
    "revolute": (lambda *n, **p: sd.Revolute(*n, **p), 2),
    "revolute -z": (lambda *n, **p: sd.Revolute(*n, axis=[0, 0, -1], **p), 2),
    "prismatic": (lambda *n, **p: sd.Prismatic(*n, axis=[1, 0], **p), 2),
    "prismatic 3-4": (lambda *n, **p: sd.Prismatic(*n, axis=[0.6, -0.8], **p), 2),
    "prismatic tilted": (lambda *n, **p: sd.Prismatic(*n, axis=[sp.cos(alpha), sp.sin(alpha)], **p), 2),
    "planar": (lambda *n, **p: sd.Planar(*n, **p), 0),
    "custom": (lambda *n, **p: sd.Custom(*n, [h], None, [h, pitch * h**2, 0], **p), 3),
}
ALL = [*[(False, name) for name in SPATIAL], *[(True, name) for name in PLANAR]]
each = pytest.mark.parametrize(("planar", "name"), ALL, ids=[f"{'planar' if p else 'spatial'} {n}" for p, n in ALL])


@dataclass
class Rows:
    """The rows of a system's closures at STATES random states, and what differentiating the tape gives for their rates."""

    names: list[str]
    gathered: Gathered
    C: np.ndarray
    C_r: np.ndarray
    C_dot: np.ndarray
    remaining: np.ndarray
    C_by_time: np.ndarray
    C_dot_by_time: np.ndarray
    C_dot_by_speeds: np.ndarray


def rows_of(system: sd.System, seed: int = 1, given: Callable[[dict[str, Any]], dict[str, Any]] = lambda values: {}) -> Rows:
    """given: values of some symbols for those of the others."""
    system.set_defaults({s: v for s, v in NUMBERS.items() if any(s in symbols_of(e) for e in _expressions(system))})
    model = system.check()
    tree = tree_of(model, "body")
    gathered = Gathered(tree)
    rows, algebra = gathered.rows, tree.algebra
    by_time = algebra.by_time(model.coordinates, tree.rates)
    values, rates = [r.value for r in rows], [r.rate for r in rows]
    by_speeds = [forward(algebra.recorder, rates, {algebra.leaves[u]: 1}) for u in model.speeds]
    tape = Tape.of(algebra.recorder, C=values, C_dot=rates, remaining=[r.remaining for r in rows],
                   C_r=np.array([r.jacobian for r in rows], dtype=object).reshape(len(rows), len(model.speeds)),
                   C_by_time=forward(algebra.recorder, values, by_time), C_dot_by_time=forward(algebra.recorder, rates, by_time),
                   C_dot_by_speeds=np.array(by_speeds, dtype=object).reshape(len(model.speeds), len(rows)).T)
    rng = np.random.default_rng(seed)
    numbers: dict[str, Any] = {s.name: rng.uniform(-1.5, 1.5, STATES) for s in (*model.coordinates, *model.speeds)}
    for joint in model.joints:
        if isinstance(getattr(joint, "orientation", None), sd.EulerParameters):
            group = [q.name for q in joint.coordinates[-4:]]
            norm = np.sqrt(sum(numbers[n] ** 2 for n in group))
            numbers.update({n: numbers[n] / norm for n in group})
    numbers |= {p.name: v for p, v in model.defaults.items()} | {"t": rng.uniform(0, 1, STATES)}
    found = evaluate_rows(tape, {**numbers, **given(numbers)}, STATES)
    return Rows([r.name for r in rows], gathered, **found)


def _expressions(system: sd.System) -> list[Any]:
    return [e for j in [*system.joints, *system.loops] for e in getattr(j, "constants", ())]


def check_derivatives(rows: Rows, n: int, of_time: bool = False) -> None:
    assert len(rows.names) == n
    np.testing.assert_allclose(rows.C_dot, rows.C_by_time, atol=1e-12)
    np.testing.assert_allclose(-rows.remaining, -rows.C_dot_by_time, atol=1e-11)
    np.testing.assert_allclose(rows.C_r, rows.C_dot_by_speeds, atol=1e-13)


def make_of(planar: bool, name: str) -> tuple[Make, int]:
    return (PLANAR if planar else SPATIAL)[name]


def flying(s: sd.System, name: str, parameters: bool = False) -> Any:
    """A body that moves freely."""
    body = s.add_body(name, mass=1, inertia=1 if s.planar else [1, 2, 2.5])
    if s.planar:
        s.add_joint(sd.Planar(f"{name}_free", s.ground, body))
    else:
        orientation = sd.EulerParameters() if parameters else sd.EulerAngles("XZX")
        s.add_joint(sd.Free(f"{name}_free", s.ground, body, orientation=orientation))
    return body


@pytest.mark.parametrize(("planar", "name"), [(p, n) for p, n in ALL if n not in BY_COORDINATES])
def test_rows_vanish_on_the_joints_own_motion(planar: bool, name: str) -> None:
    """The joint in the tree and the same again as a closure, on a base that flies: C, C_r, C_dot and C_ddot are zero."""
    make, n = make_of(planar, name)
    s = sd.System("twice", planar=planar)
    base = flying(s, "base", parameters=True)
    tip = s.add_body("tip", mass=1, inertia=1 if planar else [1, 1, 1])
    place = FLAT if planar else PLACE
    s.add_joint(make("tree", base, tip, **place))
    s.close_loop(make("loop", base, tip, **place))
    rows = rows_of(s)
    assert len(rows.names) + len(rows.gathered.trivial) == n
    for values in (rows.C, rows.C_r, rows.C_dot, rows.remaining):
        assert np.abs(values).max(initial=0) < 1e-13


@each
def test_rows_between_flying_bodies(planar: bool, name: str) -> None:
    """Also far from where the joint would hold."""
    make, n = make_of(planar, name)
    s = sd.System("apart", planar=planar, gravity=[1, 2] if planar else [1, 2, 3])
    one, other = flying(s, "one", parameters=True), flying(s, "other")
    s.close_loop(make("loop", one, other, **(FLAT if planar else PLACE)))
    rows = rows_of(s)
    check_derivatives(rows, n)
    for C_r in rows.C_r:
        assert np.linalg.matrix_rank(C_r) == n if n else C_r.size == 0


@each
def test_rows_between_a_chain_and_a_ground_that_moves(planar: bool, name: str) -> None:
    """With a coordinate that follows another and time; what ties to the ground sees nothing of the ground's motion."""
    turned = ALL.index((planar, name)) % 2  # every type has several cases
    make, n = make_of(planar, name)
    q1, q2, q3 = sd.coordinates("q1:4")
    s = sd.System("chain", planar=planar, gravity=[1, 2] if planar else [1, 2, 3])
    bodies = [s.add_body(f"b{k}", mass=1, inertia=1 if planar else [1, 2, 2.5]) for k in range(3)]
    first = [0.6, 0.8] if planar else [0.6, 0, 0.8]
    s.add_joint(sd.Prismatic("slide", s.ground, bodies[0], q1, axis=first))
    s.add_joint(sd.Revolute("turn", bodies[0], bodies[1], q2, axis=[0, 0, 1], parent_point=[0.3, 0, 0]))
    s.add_joint(sd.Revolute("follow", bodies[1], bodies[2], 2 * q2 - q3 + sp.sin(sd.t), axis=[0, 0, 1] if planar else THIRDS))
    s.add_coordinate(q3)
    ends = (s.ground, bodies[2]) if turned else (bodies[2], s.ground)
    s.close_loop(make("loop", *ends, **(FLAT if planar else PLACE)))
    still = rows_of(s)
    check_derivatives(still, n)
    s.move_ground([sp.sin(sd.t), sd.t**2] if planar else [sp.sin(sd.t), sd.t**2, sd.t], [sd.t, 0, 0])
    moving = rows_of(s)
    for name in ("C", "C_r", "C_dot", "remaining"):
        np.testing.assert_allclose(getattr(still, name), getattr(moving, name), atol=1e-12)


@pytest.mark.parametrize("planar", [False, True])
def test_rod(planar: bool) -> None:
    """(d^2 - L^2)/(2 L), which is d - L to first order."""
    length = sd.parameters("L")
    s = sd.System("rods", planar=planar, gravity=[1, 2] if planar else [1, 2, 3])
    one, other = flying(s, "one"), flying(s, "other")
    place = {k: v for k, v in (FLAT if planar else PLACE).items() if "point" in k}
    s.close_loop(sd.Rod("rod", one, other, length, **place))
    s.defaults = {length: 1.3}
    rows = rows_of(s)
    check_derivatives(rows, 1)
    at = {q.name: 0.0 for j in s.joints for q in j.coordinates} | {f"{s.joints[1].coordinates[0].name}": 2.0}
    D = np.array([2.0 + 0.1 - 0.5, 0.4 + 0.2, 0 if planar else -0.9])
    still = rows_of(s, given=lambda values: at)
    np.testing.assert_allclose(still.C[:, 0], (D @ D - 1.3**2) / (2 * 1.3), rtol=1e-14)
    np.testing.assert_allclose(still.C_r[0, 0, 6 if not planar else 3], D[0] / 1.3, rtol=1e-14)


def test_gear() -> None:
    """q_b - ratio q_a - offset, also between joints with other coordinates, and by name or as joints."""
    q1, q2, q3 = sd.coordinates("q1:4")
    ratio, offset = sd.parameters("ratio offset")
    s = sd.System("gears", planar=True)
    bodies = [s.add_body(f"b{k}", mass=1, inertia=1) for k in range(3)]
    a = s.add_joint(sd.Revolute("a", s.ground, bodies[0], q1))
    b = s.add_joint(sd.Prismatic("b", s.ground, bodies[1], q2, axis=[1, 0]))
    s.add_joint(sd.Revolute("c", s.ground, bodies[2], q3 + sp.sin(sd.t)))
    s.add_coordinate(q3)
    s.close_loop(sd.Gear("rack", "a", b, ratio, offset))
    s.close_loop(sd.Gear("cam", a, "c", -2))
    s.defaults = {ratio: 0.3, offset: 0.1}
    rows = rows_of(s)
    check_derivatives(rows, 2)
    at = {"q1": 20.0, "q2": 6.1, "q3": -40.0, "t": 0.4}
    found = rows_of(s, given=lambda values: at)
    np.testing.assert_allclose(found.C, np.tile([0, math.sin(0.4)], (STATES, 1)), atol=1e-14)
    np.testing.assert_allclose(found.C_r, [[[-0.3, 1, 0], [2, 0, 1]]] * STATES)


@pytest.mark.parametrize("turns", [0, 3, -7])
def test_a_screw_keeps_its_turns(turns: int) -> None:
    """A thread next to a cylindrical joint, after several turns: the angle alone does not show how far it went."""
    q, z = sd.coordinates("q z")
    s = sd.System("thread")
    nut = s.add_body("nut", mass=1, inertia=[1, 1, 1])
    s.add_joint(sd.Cylindrical("guide", s.ground, nut, [q, z], **PLACE))
    s.close_loop(sd.Helical("screw", s.ground, nut, pitch=pitch, **PLACE))
    angle = 0.4 + 2 * math.pi * turns
    rate = {"q_dot": 0.3, "z_dot": 0.3 * NUMBERS[pitch], "q_screw_dot": 0.3}
    on = rows_of(s, given=lambda values: {"q": angle, "z": NUMBERS[pitch] * angle, "q_screw": angle, **rate})
    assert max(np.abs(v).max() for v in (on.C, on.C_dot, on.remaining)) < 1e-14 * (1 + abs(angle)) * 3
    off = rows_of(s, given=lambda values: {"q": 0.4, "z": NUMBERS[pitch] * angle, "q_screw": 0.4, **rate})
    assert np.linalg.norm(off.C[0]) == pytest.approx(NUMBERS[pitch] * 2 * math.pi * abs(turns), abs=1e-13)


@pytest.mark.parametrize("axis", [[0, 0, 1], [0, 1, 0], [sp.Rational(3, 5), 0, sp.Rational(4, 5)], THIRDS, TILTED])
def test_a_second_hinge_on_the_same_axis_takes_nothing(axis: list) -> None:
    """A door with two hinges: all five rows hold at every angle."""
    s = sd.System("door", gravity=[0, 0, -9.81])
    door = s.add_body("door", mass=10, inertia=[1, 1, 1], com=[0.4, 0.1, 0.2])
    s.add_joint(sd.Revolute("low", s.ground, door, axis=axis))
    s.close_loop(sd.Revolute("high", s.ground, door, axis=axis, parent_point=axis, child_point=axis))
    rows = rows_of(s)
    assert len(rows.names) + len(rows.gathered.trivial) == 5
    for values in (rows.C, rows.C_r, rows.C_dot, rows.remaining):
        assert np.abs(values).max(initial=0) < 1e-13


class Slider(AxisJoint):
    """A joint that the rows of loops do not know."""

    kind = "slider"
    coordinate_units = ("m",)
    motion = Prismatic.motion
    axis: Any


@pytest.mark.parametrize("coordinates", ["relative", "absolute"])
@pytest.mark.parametrize("kind", [sd.Prismatic, Slider])
def test_a_kind_of_joint_without_rows_of_its_own_closes_loops_by_its_coordinates(kind: Any, coordinates: str) -> None:
    """A free body on an inclined rail falls with e (e^T g), and does not turn."""
    s = sd.System("rail", gravity=[0, 0, -10])
    body = s.add_body("body", mass=2, inertia=[1, 2, 3])
    s.add_joint(sd.Free("free", s.ground, body))
    s.close_loop(kind("loop", s.ground, body, axis=[0.6, 0, 0.8]))
    module = s.augmented(coordinates=coordinates).compile(backend="numpy")
    rates = module.rhs(0.0, np.zeros(module.metadata.sizes.x))[module.metadata.sizes.q:]
    assert rates[:6] == pytest.approx([-4.8, 0, -6.4, 0, 0, 0], abs=1e-12)
