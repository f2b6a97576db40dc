"""Random trees of random joints with random loads: what must hold for the embedded equations of any of them.

Body-level matrices are put together here, from masses, inertias and rotations, without symdyn's recursions.
"""

from __future__ import annotations

import random
from functools import lru_cache
from typing import Any

import mpmath
import numpy as np
import pytest
import sympy as sp

import symdyn as sd
from symdyn.formulation.trees.embedding import EmbeddedEquations
from symdyn.model.orientation import SEQUENCES
from symdyn.tape import Tape
from symdyn.tape.differentiate import forward
from tests import helpers
from tests.helpers import HIGH, STEP, swept

ROTATIONS = [None, sp.Matrix([[0, 1, 0], [-1, 0, 0], [0, 0, 1]]), sp.Matrix([[2, -1, 2], [2, 2, -1], [-1, 2, 2]]) / 3]
AXES = [[1, 0, 0], [0, 1, 0], [0, 0, 1], [0.6, 0, 0.8], [sp.Rational(2, 3), sp.Rational(-2, 3), sp.Rational(1, 3)]]


class Draw:
    """A random tree: parts are drawn in one fixed order from one seed."""

    def __init__(self, seed: int, loads: bool = True, driven: bool = True) -> None:
        self.rng = random.Random(seed)
        self.used = 0
        self.parameters = sd.parameters("m g k d")
        self.s = sd.System(f"tree_{seed}", gravity=[self.some(), self.some(), -self.parameters[1]])
        self.free: list[sp.Symbol] = []
        for k in range(self.rng.randint(3, 5)):
            self.add(k, driven)
        if loads:
            self.load()
        if driven and seed % 2:
            self.s.move_ground([sp.sin(sd.t), self.some() * sd.t**2, 0], [self.some() * sd.t, 0, sp.cos(sd.t)])

    def some(self) -> sp.Rational:
        return sp.Rational(self.rng.randint(-9, 9), 10)

    def point(self) -> list:
        return [self.some() for _ in range(3)]

    def coordinates(self, n: int) -> list:
        self.used += n
        made = list(sd.coordinates(f"q{self.used - n + 1}:{self.used + 1}"))
        self.free += made
        return made

    def add(self, k: int, driven: bool) -> None:
        rng, s = self.rng, self.s
        A = sp.Matrix(3, 3, lambda i, j: sp.Rational(rng.randint(-5, 5), 10))
        body = s.add_body(f"b{k}", mass=self.parameters[0] + k, com=self.point(), inertia=A * A.T + sp.diag(3, 3.25, 3.5))
        parent = rng.choice([s.ground, *s.bodies[:-1], *s.bodies[:-1]])
        place = {"parent_point": self.point(), "child_point": self.point(), "parent_rotation": rng.choice(ROTATIONS),
                 "child_rotation": rng.choice(ROTATIONS)}
        name, axis = f"j{k}", rng.choice(AXES)
        kind = rng.choice(["revolute", "prismatic", "cylindrical", "universal", "planar", "spherical", "parameters", "free",
                           "fixed", "gear", "given"] if k else ["revolute", "free", "universal"])
        if kind == "fixed":
            s.add_joint(sd.Fixed(name, parent, body, **place))
        elif kind == "gear" and driven:
            s.add_joint(sd.Revolute(name, parent, body, 2 * self.free[0] + sp.sin(self.free[-1]) * sd.t, axis=axis, **place))
        elif kind == "given" and driven:
            s.add_joint(sd.Cylindrical(name, parent, body, [sp.sin(2 * sd.t), *self.coordinates(1)], axis=axis, **place))
        elif kind == "cylindrical":
            s.add_joint(sd.Cylindrical(name, parent, body, self.coordinates(2), axis=axis, **place))
        elif kind == "universal":
            s.add_joint(sd.Universal(name, parent, body, self.coordinates(2), **place))
        elif kind == "planar":
            s.add_joint(sd.Planar(name, parent, body, self.coordinates(3), **place))
        elif kind == "spherical":
            s.add_joint(sd.Spherical(name, parent, body, self.coordinates(3), sd.EulerAngles(rng.choice(SEQUENCES)), **place))
        elif kind == "parameters":
            four = sd.coordinates(f"e0{k} e1{k} e2{k} e3{k}")
            s.add_joint(sd.Spherical(name, parent, body, four, sd.EulerParameters(), **place))
        elif kind == "free":
            s.add_joint(sd.Free(name, parent, body, self.coordinates(6), **place))
        else:
            joint = sd.Prismatic if kind == "prismatic" else sd.Revolute
            s.add_joint(joint(name, parent, body, *self.coordinates(1), axis=axis, **place))

    def load(self) -> None:
        s, (_, _, k, d), rng = self.s, self.parameters, self.rng
        q = self.free
        F, z = sd.inputs("F"), sd.coordinates("z")
        one, other = rng.sample([s.ground, *s.bodies], 2)
        s.add_spring_damper(one, other, self.point(), self.point(), stiffness=k, damping=d, length=sp.Rational(1, 3))
        s.add_force(s.bodies[-1], [F, sp.sin(sd.t), q[0]], point=self.point(), frame=s.bodies[0], reaction=s.bodies[1])
        s.add_torque(s.bodies[1], [q[0].dot, z, 2 * F], reaction=rng.choice([None, s.bodies[0]]))
        s.add_joint_force(s.joints[0], [-d * q[0].dot, *[F] * (s.joints[0].n_speeds - 1)])
        s.add_state(z, -z + q[0].dot * F)


@lru_cache
def tree(seed: int, **options: bool) -> EmbeddedEquations:
    return Draw(seed, **options).s.embedding()


FEW = (0, 1, 5, 7)  # have every kind of joint
SEEDS = swept(range(10), *FEW)


@pytest.fixture(params=SEEDS)
def equations(request: pytest.FixtureRequest) -> EmbeddedEquations:
    return tree(request.param)


def accelerated(equations: EmbeddedEquations, values: dict[str, Any]) -> dict[str, Any]:
    (ud,) = helpers.quantities(equations, values, "accelerations", digits=60)
    return {**values, **{f"{u.name}_dot": a for u, a in zip(equations.symbols.speeds, ud, strict=True)}}


def test_equations_of_motion_hold(equations: EmbeddedEquations) -> None:
    values = helpers.state(equations, 1)
    M, k, F, bias, ud = helpers.quantities(equations, values, "M_tilde", "k_tilde", "F_tilde", "bias", "accelerations")
    assert helpers.close(M @ ud + k, F) and helpers.close(k - F, bias)
    (tau,) = helpers.quantities(equations, accelerated(equations, values), "inverse_dynamics")
    assert helpers.close(tau / max(1, helpers.largest(k, F)), 0 * tau)
    rng = random.Random(2)
    some = [mpmath.mpf(rng.uniform(-1, 1)) for _ in ud]
    named = {f"{u.name}_dot": a for u, a in zip(equations.symbols.speeds, some, strict=True)}
    (tau,) = helpers.quantities(equations, {**values, **named}, "inverse_dynamics")
    assert helpers.close(tau, M @ np.array(some, dtype=object) + k - F)


def test_rhs_is_rates_accelerations_and_rates_of_states(equations: EmbeddedEquations) -> None:
    values = helpers.state(equations, 2)
    rhs, rates, ud = helpers.quantities(equations, values, "rhs", "rates", "accelerations")
    q1_dot = rates[[q.name for q in equations.symbols.coordinates].index("q1")]
    with mpmath.workdps(40):
        z_dot = -helpers.number(values["z"]) + q1_dot * helpers.number(values["F"])
    assert helpers.close(rhs, np.array([*rates, *ud, z_dot], dtype=object))


def test_mass_matrix_is_symmetric_and_positive_definite(equations: EmbeddedEquations) -> None:
    for seed in range(3):
        (M,) = helpers.quantities(equations, helpers.state(equations, seed), "M_tilde")
        assert (M == M.T).all()
        with mpmath.workdps(40):
            mpmath.cholesky(mpmath.matrix(M.tolist()))


def test_power_balance(equations: EmbeddedEquations) -> None:
    leaves = equations.leaves
    seeds = dict(zip([leaves[q] for q in equations.symbols.coordinates], equations.quantity("rates"), strict=True))
    seeds |= dict(zip([leaves[u] for u in equations.symbols.speeds], equations.quantity("accelerations"), strict=True))
    seeds[leaves[sd.t]] = 1
    change = sum(forward(equations.recorder, list(equations.quantity("energy")), seeds))
    values = helpers.state(equations, 3)
    tape = Tape.of(equations.recorder, change=change).merge(equations.tape("power", "energy"))
    found = helpers.at(tape, values)
    assert helpers.close(found["change"], found["power"]) and found["energy"][0] > 0


def test_body_level_matrices(equations: EmbeddedEquations) -> None:
    """M_tilde = J^T M J, k_tilde = J^T (M Jd_qd + Q), T = sum of (m v^2 + omega I omega) / 2."""
    values = helpers.state(equations, 4)
    J, Jd_qd, M_tilde, k_tilde, frames, energy = helpers.quantities(
        equations, values, "J", "Jd_qd", "M_tilde", "k_tilde", "frames", "energy", digits=HIGH)
    V = helpers.twists(equations, values)
    with mpmath.workdps(HIGH):
        M, Q, kinetic = _body_level(bodies_of(equations), frames, V, helpers.number(values["m"]))
        assert helpers.close(J.T @ M @ J, M_tilde)
        assert helpers.close(J.T @ (M @ Jd_qd + Q), k_tilde)
        assert helpers.close(kinetic, energy[0])


def bodies_of(equations: EmbeddedEquations) -> tuple:
    return Draw(int(equations.name.removeprefix("tree_"))).s.check().bodies


def _body_level(bodies: Any, frames: np.ndarray, V: np.ndarray, m: Any) -> tuple[np.ndarray, np.ndarray, Any]:
    """M (6 n_b, 6 n_b), the gyroscopic forces Q (6 n_b,) and the kinetic energy, n-frame."""
    n = len(bodies)
    M, Q = np.zeros((6 * n, 6 * n), dtype=object), np.zeros(6 * n, dtype=object)
    for k, body in enumerate(bodies):
        R = frames[k, 3:].reshape(3, 3)
        I = np.array([helpers.number(e.p) / e.q for e in map(sp.Rational, body.inertia)]).reshape(3, 3)
        I_n = R @ I @ R.T
        mass = m + k
        omega = V[k, 3:]
        M[6 * k:6 * k + 3, 6 * k:6 * k + 3] = mass * np.eye(3, dtype=int)
        M[6 * k + 3:6 * k + 6, 6 * k + 3:6 * k + 6] = I_n
        Q[6 * k + 3:6 * k + 6] = np.cross(omega, I_n @ omega)
    v = V.ravel()
    return M, Q, v @ M @ v / 2


@pytest.mark.parametrize("seed", SEEDS)
def test_weight_alone(seed: int) -> None:
    """Without loads F_tilde = J^T [m g; 0], and it is - dV/dq."""
    equations = tree(seed, loads=False, driven=False)
    model = Draw(seed, loads=False, driven=False).s.check()
    values = helpers.state(equations, 5)
    J, F_tilde, power = helpers.quantities(equations, values, "J", "F_tilde", "power")
    with mpmath.workdps(40):
        m, g = helpers.number(values["m"]), helpers.number(values["g"])
        down = [helpers.number(e.p) / e.q for e in model.gravity[:2]] + [-g]
        F = np.array([[(m + k) * d for d in down] + [0, 0, 0] for k in range(len(model.bodies))], dtype=object).ravel()
        assert helpers.close(J.T @ F, F_tilde) and power == 0
    potential = equations.quantity("energy")[1]
    seeds = dict(zip([equations.leaves[q] for q in equations.symbols.coordinates], equations.quantity("rates"), strict=True))
    change = Tape.of(equations.recorder, change=forward(equations.recorder, [potential], seeds)[0])
    with mpmath.workdps(40):
        u = np.array([helpers.number(values[u.name]) for u in equations.symbols.speeds], dtype=object)
        assert helpers.close(helpers.at(change, values)["change"][()], -(F_tilde @ u))


@pytest.mark.parametrize("seed", [*swept([0, 3]), 5, *swept([8])])
@pytest.mark.parametrize(("quantity", "group"), [("jacobian_x", "x"), ("jacobian_inputs", "inputs"),
                                                 ("jacobian_params", "parameters")])
def test_jacobians_along_a_direction(seed: int, quantity: str, group: str) -> None:
    equations = tree(seed)
    s = equations.symbols
    names = [a.name for a in ((*s.coordinates, *s.speeds, *s.states) if group == "x" else getattr(s, group))]
    values = helpers.state(equations, 6)
    direction = tangent(values, helpers.numbers(names, 7, -1, 1))
    (matrix,) = helpers.quantities(equations, values, quantity, digits=HIGH)
    with mpmath.workdps(HIGH):
        later, earlier = (helpers.quantities(equations, {**values, **{
            n: helpers.number(values[n]) + h * helpers.number(direction[n]) for n in names}}, "rhs", digits=HIGH)[0]
            for h in (STEP, -STEP))
        along = matrix @ np.array([helpers.number(direction[n]) for n in names], dtype=object)
        assert helpers.close(along, (later - earlier) / (2 * STEP))


def tangent(values: dict[str, Any], direction: dict[str, Any]) -> dict[str, Any]:
    """The direction without what would change the norm of Euler parameters: off it, the equations have no meaning."""
    with mpmath.workdps(HIGH):
        for k in range(5):
            group = [n for n in direction if n[:1] == "e" and n[2:] == str(k)]
            along = sum(values[n] * helpers.number(direction[n]) for n in group)
            square = sum(values[n] ** 2 for n in group)
            direction = {**direction, **{n: helpers.number(direction[n]) - along / square * values[n] for n in group}}
    return direction


def test_seeds_cover_every_kind_of_joint() -> None:
    kinds = {joint.kind for seed in FEW for joint in Draw(seed).s.joints}
    assert kinds == {"revolute", "prismatic", "cylindrical", "universal", "planar", "spherical", "free", "fixed"}
    assert any(not tree_of(seed).plain for seed in FEW)


def tree_of(seed: int) -> Any:
    from symdyn.formulation.algebra import TapeAlgebra, leaves_of
    from symdyn.formulation.trees.tree import build
    from symdyn.tape import Recorder

    model = Draw(seed).s.check()
    recorder = Recorder()
    return build(model, TapeAlgebra(recorder, leaves_of(model, recorder)))
