"""A tree of revolute and prismatic joints in numbers, for programs that take bodies and joints in place of equations."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import sympy as sp
from scipy.interpolate import BPoly

from symdyn.bench.work.against.peer import LONGEST, Failed, Unfit
from symdyn.bench.work.against.walk import constant_inputs
from symdyn.model.joints import Fixed, Prismatic, Revolute
from symdyn.model.loads import JointForce
from symdyn.model.record import joint_speeds

# States at which accelerations are compared with ours, and how near they must be.
_STATES, _NEAR = 5, 1e-9
# Steps of one length with which their number is looked for, at most.
_MOST_TRIED = 2**15


@dataclass
class Link:
    """One moving body. Its frame sits at its joint; z is the joint's axis.

    parent       number of the link before, -1 the ground; turning: revolute, else prismatic
    R, p         (3, 3), (3,) the frame in that of the link before where the coordinate is zero, m
    mass, com, inertia   kg; (3,) m; (3, 3) about the centre of mass, kg m^2, with all that is fixed to it
    force, stiffness, damping   along the joint: force - stiffness q - damping u
    """

    name: str
    parent: int
    turning: bool
    R: np.ndarray
    p: np.ndarray
    mass: float = 0.0
    com: np.ndarray = field(default_factory=lambda: np.zeros(3))
    inertia: np.ndarray = field(default_factory=lambda: np.zeros((3, 3)))
    force: float = 0.0
    stiffness: float = 0.0
    damping: float = 0.0

    def add(self, mass: float, com: np.ndarray, inertia: np.ndarray) -> None:
        """Fix one more body to it."""
        total = self.mass + mass
        middle = (self.mass * self.com + mass * com) / total if total else com
        for m, c, own in ((self.mass, self.com, self.inertia), (mass, com, inertia)):
            d = c - middle
            own += m * (d @ d * np.eye(3) - np.outer(d, d))
        self.mass, self.com, self.inertia = total, middle, self.inertia + inertia


@dataclass(frozen=True)
class Tree:
    """A mechanism.

    links    before those that they carry; gravity (3,) m/s^2
    order    (n,) for each link, which coordinate, and which speed, of symdyn's is its own
    planar   all motion is in the x-y plane
    """

    links: tuple[Link, ...]
    gravity: np.ndarray
    order: np.ndarray
    planar: bool

    def split(self, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Coordinates and speeds, link by link, from our state."""
        n = len(self.links)
        return x[:n][self.order].copy(), x[n:][self.order].copy()

    def join(self, q: Any, u: Any) -> np.ndarray:
        """Our state, or its derivative."""
        n = len(self.links)
        x = np.empty(2 * n)
        x[self.order], x[n + self.order] = np.ravel(q), np.ravel(u)
        return x


def tree_of(system: Any, equations: Any, params: np.ndarray) -> Tree:
    """The numbers of a system whose equations have these parameters. Raises Unfit for what a Tree has no words for."""
    if system is None:
        raise Unfit("it is known by its equations alone; the program takes bodies and joints")
    model = system.check()
    _reject(model, equations.symbols)
    reader = numbers_of(model, equations, params)
    owners: dict[int, tuple[int, np.ndarray, np.ndarray]] = {-1: (-1, np.eye(3), np.zeros(3))}
    links: list[Link] = []
    moved: dict[Any, Link] = {}
    order: list[int] = []
    for joint, parent, child in zip(model.joints, model.parents, model.children, strict=True):
        owner, R_o, p_o = owners[parent]
        R, p = R_o @ reader.array(joint.parent_rotation), R_o @ reader.array(joint.parent_point).ravel() + p_o
        back = reader.array(joint.child_rotation).T
        shift = -back @ reader.array(joint.child_point).ravel()  # the body's frame in the joint's
        if not isinstance(joint, Fixed):
            basis = _basis(reader.array(joint.axis).ravel())
            links.append(Link(joint.name, owner, isinstance(joint, Revolute), R @ basis, p))
            order.append(model.coordinates.index(joint.coordinates[0]))
            moved[joint] = links[-1]
            owner, R, p, back, shift = len(links) - 1, np.eye(3), np.zeros(3), basis.T @ back, basis.T @ shift
        owners[child] = owner, R @ back, R @ shift + p
        if owner >= 0:
            body, (_, R_b, p_b) = model.bodies[child], owners[child]
            links[owner].add(float(reader.number(body.mass)), R_b @ reader.array(body.com).ravel() + p_b,
                             R_b @ reader.array(body.inertia) @ R_b.T)
    for load in model.loads:
        _load(load, model, moved, reader)
    return Tree(tuple(links), reader.array(model.gravity).ravel(), np.array(order), model.planar)


def _reject(model: Any, symbols: Any) -> None:
    """Raise Unfit for what is no tree of joints with one degree of freedom."""
    for what, given in (("closed loops", model.loops), ("constraints", model.constraints), ("extra states", model.states),
                        ("a moving ground", model.ground_motion)):
        if given:
            raise Unfit(f"it has {what}; what is built is a tree of joints")
    for joint in model.joints:
        own = isinstance(joint, (Revolute, Prismatic)) and joint.coordinates[0] in model.coordinates and (
            joint_speeds(joint) == (joint.coordinates[0].dot,))
        if not own and not isinstance(joint, Fixed):
            raise Unfit(f"joint {joint.name!r} is {joint.kind}; what is built is revolute or prismatic joints with a coordinate "
                        "of their own")
    if [s.name for s in symbols.coordinates] != [s.name for s in model.coordinates]:
        raise Unfit("these equations are not in the coordinates of the joints")


class Numbers:
    """Numbers of a model's expressions; inputs: their constant values, in order."""

    def __init__(self, values: Mapping[Any, float], inputs: list[float]) -> None:
        self.values = {symbol: sp.Float(value) for symbol, value in values.items()}
        self.inputs = inputs

    def number(self, e: Any) -> Any:
        """An expression with numbers for parameters and inputs."""
        return sp.sympify(e).xreplace(self.values)

    def array(self, matrix: Any) -> np.ndarray:
        """A matrix, or a column of a vector."""
        rows = sp.Matrix(matrix).tolist()
        return np.array([[float(self.number(e)) for e in row] for row in rows])


def numbers_of(model: Any, equations: Any, params: np.ndarray) -> Numbers:
    """Numbers of a model by the parameters of its equations, else by its defaults. Raises Unfit where there are none."""
    inputs = constant_inputs(equations)
    known = {s.name: float(v) for s, v in zip(equations.symbols.parameters, params, strict=True)} | inputs
    values = {p: known.get(p.name, model.defaults.get(p)) for p in (*model.parameters, *model.inputs)}
    missing = [p.name for p, value in values.items() if value is None]
    if missing:
        raise Unfit(f"it has no number for {', '.join(missing)}")
    return Numbers(values, list(inputs.values()))  # type: ignore[arg-type]


def of_joint(load: Any, joints: Iterable[Any]) -> Any:
    """The joint that a load acts along; None if there is none."""
    return next((j for j in joints if getattr(load, "joint", None) in (j, j.name)), None)


def _load(load: Any, model: Any, moved: Mapping[Any, Link], reader: Numbers) -> None:
    """Give a joint's force to its link."""
    joint = of_joint(load, moved)
    if not isinstance(load, JointForce) or joint is None:
        raise Unfit(f"{getattr(load, 'label', load)} is a load; what is built is forces along joints alone")
    link, (q,), (u,) = moved[joint], joint.coordinates, joint_speeds(joint)
    value = sp.expand(reader.number(load.values[0]))
    stiffness, damping = -value.diff(q), -value.diff(u)
    rest = sp.expand(value + stiffness * q + damping * u)
    if not all(e.is_number for e in (stiffness, damping, rest)):
        raise Unfit(f"{load.label} is {load.values[0]}; what is built is forces linear in coordinate and speed of their joint")
    link.force, link.stiffness = link.force + float(rest), link.stiffness + float(stiffness)
    link.damping += float(damping)


def _basis(axis: np.ndarray) -> np.ndarray:
    """Rotation (3, 3) whose third column is a unit vector; exact where that is a coordinate axis."""
    k = int(np.argmax(np.abs(axis)))
    first = np.zeros(3)
    first[(k + 1) % 3] = 1.0
    first = first - axis * (first @ axis)
    first /= np.linalg.norm(first)
    return np.column_stack([first, np.cross(axis, first), axis]) + 0.0


def check_accelerations(tree: Tree, accelerations: Callable[[np.ndarray, np.ndarray], np.ndarray], equations: Any,
                        params: np.ndarray, program: str) -> None:
    """Raise Unfit unless a program's accelerations (q, u) -> u_dot, link by link, are ours at random states."""
    n, inputs = len(tree.links), list(constant_inputs(equations).values())
    random, module = np.random.default_rng(5), equations.compile()
    for _ in range(_STATES):
        x = random.uniform(-1, 1, 2 * n)
        wanted = module.rhs(0.0, x, params, inputs)[n:]
        result = tree.join(np.zeros(n), accelerations(*tree.split(x)))[n:]
        error = float(np.linalg.norm(result - wanted) / np.linalg.norm(wanted))
        if not error <= _NEAR:
            raise Unfit(f"accelerations of {program} differ from ours by {error:.1e}, relative; it is not compared")


def between(t: Sequence[float] | np.ndarray, x: Sequence[np.ndarray], equations: Any, params: np.ndarray,
            times: np.ndarray) -> np.ndarray:
    """States (n_t, n_x) at times from those [q; u] with q_dot = u at the ends of steps: polynomials of degree five with our
    accelerations, for programs that give nothing between their steps."""
    at, states = np.array(t), np.array(x)
    n = states.shape[1] // 2
    rates = equations.compile().evaluate("rhs", at, states, params, list(constant_inputs(equations).values()))
    path = BPoly.from_derivatives(at, np.stack([states[:, :n], states[:, n:], rates[:, n:]], axis=1))
    return np.hstack([path(times), path.derivative()(times)])


def calibrated(motion: Callable[[int], tuple[float, np.ndarray]], order: int) -> Callable[[float], int]:
    """Number of fixed steps that a program needs for a tolerance, found by halving steps until the end is known to 1e-3.

    motion   number of steps -> seconds, the state at the end
    The function given raises Failed for so many steps that they take longer than LONGEST.
    """
    n, coarse, error = 128, None, np.nan
    while True:
        try:
            seconds, fine = motion(n)
        except Failed:  # such long steps are too much for it
            if n >= _MOST_TRIED:
                raise
            n, coarse = 2 * n, None
            continue
        if coarse is not None:
            with np.errstate(all="ignore"):  # steps that are too long may end anywhere
                error = float(np.linalg.norm(fine - coarse) / np.linalg.norm(fine))
        if error < 1e-3 or n >= _MOST_TRIED:
            break
        n, coarse = 2 * n, fine
    error = max(error, 1e-12) if np.isfinite(error) else 1.0

    def steps(tolerance: float) -> int:
        wanted = max(1, int(np.ceil(n / 2 * (error / tolerance) ** (1 / order))))
        if wanted * seconds / n > LONGEST:
            raise Failed(f"{wanted} steps for {tolerance:g} would take about {wanted * seconds / n:.0f} s")
        return wanted

    return steps
