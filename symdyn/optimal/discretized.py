"""A problem on a mesh: its nonlinear program, where the parts of the motion are in its variables, the motion of a solution."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
import scipy.sparse as sp
from scipy.interpolate import PPoly

from symdyn.errors import ArgumentError
from symdyn.optimal.field import Dynamics, Field, Rows
from symdyn.optimal.loops import Loops, UnitLengths, independent_rows, normals, unit_groups
from symdyn.optimal.problem import Problem
from symdyn.optimal.program import Block, Label, Program, Scaled, unit
from symdyn.optimal.quadrature import integrals
from symdyn.optimal.sizes import Sizes, found_sizes, given_sizes
from symdyn.optimal.steps import Steps
from symdyn.optimal.transcription import Transcription, gauss_points

if TYPE_CHECKING:
    from symdyn.runtime.solutions.solution import Solution

MOTION = "the equation of motion of "
# Largest violation of a condition whose variables are all given, relative to its size.
GIVEN = 1e-7
# Distance from the guess, in sizes of variables, at which sizes of the cost and conditions are taken, too: both may be flat at
# the guess.
NEARBY = 0.1
# Relative errors of integrals of the cost along polynomials, and along motions simulated back, whose states have errors.
EXACT, SIMULATED = 1e-11, 1e-8


@dataclass(frozen=True, eq=False)
class Motion:
    """States X (N, n_x) at the nodes of a mesh, inputs U (M, n_in) at its samples, parameters p (n_p,), duration T, s."""

    X: np.ndarray
    U: np.ndarray
    p: np.ndarray
    T: float


@dataclass(frozen=True)
class Layout:
    """Indices in z: of X (N, n_x), U (M, n_in), corrections (K, n_corrections), free parameters, duration (-1: prescribed); n of
    all."""

    X: np.ndarray
    U: np.ndarray
    corrections: np.ndarray
    params: np.ndarray
    duration: int
    n: int


@dataclass(eq=False)
class Discretized:
    """See above.

    steps   in each interval of shooting
    elastic   whether what is demanded of the motion may be missed, the sum of what is missed being the cost
    sizes   of states, inputs, parameters and duration; None: by what is given
    scaled  the program in units of sizes, as solvers take it
    """

    problem: Problem
    mesh: Transcription
    steps: int
    guess: Motion
    elastic: bool = False
    sizes: Sizes | None = None

    def __post_init__(self) -> None:
        problem, mesh = self.problem, self.mesh
        self.dynamics = Dynamics(problem.module, problem.of, self.guess.p, "rhs" in problem.timed)
        self.held = mesh.kind == "shooting" and mesh.at_inputs.shape[1] == 1
        X, t = self.guess.X[mesh.ends], problem.t0 + mesh.breaks * self.guess.T
        self.rows_of_loops = independent_rows(problem.module, float(t[0]), X[0], self.guess.p)
        self.normals = normals(problem.module, t[1:], X[1:], self.guess.p, self.rows_of_loops)
        self.layout = self._laid_out()
        self.z = self.variables(self.guess)
        if self.sizes is None:
            self.sizes = given_sizes(problem, self.dynamics, *self._points(self.guess))
        self.z_sizes = self._sizes_of_variables(self.sizes)
        self.program = self._program()
        self.scaled = Scaled(self.program, self.z_sizes, self.g_sizes, self._size_of_cost())

    # -- variables

    def _laid_out(self) -> Layout:
        of, mesh = self.problem.of, self.mesh
        n_corrections = self.normals.shape[0] * self.normals.shape[2]
        sizes = [len(mesh.nodes) * of.n_x, len(mesh.samples) * of.n_in, n_corrections, len(of.free)]
        first = np.concatenate([[0], np.cumsum(sizes)])
        free = self.problem.duration[0] < self.problem.duration[1]
        part = lambda k, *shape: np.arange(int(first[k]), int(first[k + 1])).reshape(shape)
        return Layout(part(0, -1, of.n_x), part(1, -1, of.n_in) if of.n_in else np.zeros((len(mesh.samples), 0), dtype=int),
                      part(2, mesh.n_intervals, self.normals.shape[2]), part(3, -1), int(first[4]) if free else -1,
                      int(first[4]) + free)

    def variables(self, motion: Motion) -> np.ndarray:
        """z of a motion, without corrections, within its bounds."""
        at, z = self.layout, np.zeros(self.layout.n)
        z[at.X], z[at.U], z[at.params] = motion.X, motion.U, motion.p[list(self.problem.of.free)]
        if at.duration >= 0:
            z[at.duration] = motion.T
        return z

    def motion(self, z: np.ndarray) -> Motion:
        """The motion of variables."""
        at, p = self.layout, self.guess.p.copy()
        p[list(self.problem.of.free)] = z[at.params]
        return Motion(z[at.X], z[at.U], p, float(z[at.duration]) if at.duration >= 0 else float(self.problem.duration[0]))

    def _bounds(self) -> tuple[np.ndarray, np.ndarray]:
        at, problem, result = self.layout, self.problem, []
        for k, worst in ((0, -np.inf), (1, np.inf)):
            z = np.full(at.n, worst)
            z[at.X], z[at.U], z[at.params] = problem.states[k], problem.inputs[k], problem.params[k]
            z[at.X[0]] = problem.start[k]
            if not self.elastic:
                z[at.X[self.mesh.ends[-1]]] = problem.end[k]
            if at.duration >= 0:
                z[at.duration] = problem.duration[k]
            result.append(z)
        return result[0], result[1]

    # -- sizes

    def _sizes_of_variables(self, sizes: Sizes) -> np.ndarray:
        at, result = self.layout, np.ones(self.layout.n)
        result[at.X], result[at.U], result[at.params] = sizes.x, sizes.inputs, sizes.params
        if at.corrections.size:
            result[at.corrections] = 1 / np.linalg.norm(self.normals / sizes.x[:, None], axis=1)
        if at.duration >= 0:
            result[at.duration] = sizes.duration
        return unit(result)

    def _nearby(self, z_least: np.ndarray, z_most: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The guess, and variables nearby."""
        n = self.layout.n
        return self.z[:n], np.clip(self.z[:n] + NEARBY * self.z_sizes[:n], z_least[:n], z_most[:n])

    def _sizes_of_rows(self, program: Program) -> np.ndarray:
        """Change of each row by variables of their sizes, (m,): by its linear part; without one by its derivatives, the largest
        at all times; else its value."""
        linear = abs(program.L) @ sp.diags(self.z_sizes[:program.n])
        result = np.asarray(linear.max(axis=1).todense()).ravel() if program.L.nnz else np.zeros(program.m)
        curved = np.zeros(program.m)
        for z in self._nearby(program.z_least, program.z_most):
            J = np.nan_to_num(np.abs(program.jacobian(z)), nan=0.0, posinf=0.0) * self.z_sizes[program.jacobian_columns]
            np.maximum.at(curved, program.jacobian_rows, J)
        there = np.nan_to_num(np.abs(program.g(self.z)), nan=0.0, posinf=0.0)
        for label in program.labels:
            rows = slice(label.first, label.first + label.n)
            for of in (curved, there):
                of[rows] = np.tile(of[rows].reshape(-1, len(label.entries)).max(axis=0, initial=0.0), len(label.shares))
        for other in (curved, there, np.ones(program.m)):
            result = np.where(result > 0, result, other)
        return unit(result)

    def _size_of_cost(self) -> float:
        """Change of the cost by variables of their sizes, at the guess or nearby."""
        if self.elastic:
            return 1.0
        program = self.program
        moving = program.z_least < program.z_most
        slopes = [np.abs(program.gradient(z) * self.z_sizes)[moving].sum()
                  for z in self._nearby(program.z_least, program.z_most)]
        size = max((slope for slope in slopes if np.isfinite(slope)), default=0.0)
        return float(unit(np.array(size))) if size > 0 else 1.0

    def found_sizes(self, z: np.ndarray) -> Sizes:
        """Those of a solution."""
        assert self.sizes is not None
        return found_sizes(self.problem.of, self._points(self.motion(z))[1], self.sizes)

    def _points(self, motion: Motion) -> tuple[np.ndarray, np.ndarray]:
        """Times (P,) and arguments of the rates (P, n) at the points of the field."""
        mesh, P = self.mesh, len(self.mesh.shares)
        free = motion.p[list(self.problem.of.free)]
        at = np.hstack([motion.X[mesh.at_state], motion.U[mesh.at_inputs[:, 0]], np.broadcast_to(free, (P, len(free))),
                        np.full((P, 1), motion.T)])
        return self.problem.t0 + mesh.shares * motion.T, at

    # -- the program

    def _program(self) -> Program:
        least, most = self._bounds()
        self.z = np.clip(self.z, least, most)
        parts = [self._defects(), *self._path(), *self._boundary(), *self._rates(), *self._loops(), *self._units()]
        if self.elastic:
            parts.append(self._end())
        program = self._assembled(parts, least, most)
        moving = least < most
        depends = np.zeros(program.m, dtype=bool)
        depends[program.jacobian_rows[moving[program.jacobian_columns]]] = True
        self.g_sizes = self._sizes_of_rows(program)
        if not depends.all():
            program = self._without(program, depends)
        return self._with_slacks(program) if self.elastic else program

    def _assembled(self, parts: list[_Part], least: np.ndarray, most: np.ndarray) -> Program:
        m = sum(part.m for part in parts)
        L, blocks, labels, first = [], [], [], 0
        for part in parts:
            L.append(part.L if part.L is not None else sp.csr_matrix((part.m, self.layout.n)))
            labels += [replace(label, first=label.first + first) for label in part.labels]
            if part.block is not None:
                A = sp.vstack([sp.csr_matrix((first, part.block.A.shape[1])), part.block.A,
                               sp.csr_matrix((m - first - part.m, part.block.A.shape[1]))]).tocsr()
                b = np.zeros_like(part.block.b) if self.elastic else part.block.b
                blocks.append(replace(part.block, A=A, b=b))
            first += part.m
        return Program(blocks, sp.vstack(L).tocsr(), least, most, np.concatenate([part.least for part in parts]),
                       np.concatenate([part.most for part in parts]), labels)

    def _without(self, program: Program, depends: np.ndarray) -> Program:
        """Without rows that depend on nothing that is free. Raises ArgumentError where one of them does not hold."""
        missing = program.violations(self.z)
        wrong = np.flatnonzero(~depends & ~(missing <= GIVEN * self.g_sizes))
        if len(wrong) and not self.elastic:
            texts = [f"{self.text(program, row)} by {missing[row]:.3g}" for row in wrong[:4]]
            if len(wrong) > len(texts):
                texts.append(f"and {len(wrong) - len(texts)} more")
            how = " (module.consistent finds states that fulfil constraints)" if len(self.rows_of_loops) else ""
            raise ArgumentError(f"{self.problem.module.name}: what is prescribed violates {'; '.join(texts)}; change the start, "
                                f"the end or the condition{how}")
        kept = np.flatnonzero(depends)
        self.g_sizes = self.g_sizes[kept]
        labels, first = [], 0
        for label in program.labels:
            for k, share in enumerate(label.shares):
                for e, entry in enumerate(label.entries):
                    if depends[label.first + k * len(label.entries) + e]:
                        labels.append(Label(f"{label.text}{entry}", first, np.array([share]), soft=label.soft))
                        first += 1
        blocks = [replace(block, A=block.A[kept]) for block in program.blocks]
        return Program(blocks, program.L[kept], program.z_least, program.z_most, program.g_least[kept], program.g_most[kept],
                       labels)

    def _with_slacks(self, program: Program) -> Program:
        """With two more variables for each condition, by which it is missed, and their sum, in units of sizes, as the cost."""
        rows = np.array([k for label in program.labels if label.soft for k in range(label.first, label.first + label.n)],
                        dtype=int)
        n, s = program.n, len(rows)
        more = sp.csr_matrix((np.repeat([1.0, -1.0], s), (np.tile(rows, 2), np.arange(2 * s))), (program.m, 2 * s))
        of_slacks = Block(_Sum(), np.arange(n, n + 2 * s)[:, None], np.zeros((2 * s, 1)), np.ones((2 * s, 1)),
                          sp.csr_matrix((program.m, 2 * s)), 1 / np.tile(self.g_sizes[rows], 2))
        missing = np.nan_to_num(program.violations(self.z)[rows])
        self.z = np.concatenate([self.z, missing, missing])
        self.slacks, self.z_sizes = rows, np.concatenate([self.z_sizes, np.tile(self.g_sizes[rows], 2)])
        least, most = np.append(program.z_least, np.zeros(2 * s)), np.append(program.z_most, np.full(2 * s, np.inf))
        return Program([*program.blocks, of_slacks], sp.hstack([program.L, more]).tocsr(), least, most, program.g_least,
                       program.g_most, program.labels)

    def text(self, program: Program, row: int) -> str:
        """Meaning of a row of the constraints, and its time, by the duration of the guess."""
        text, share = program.what(row)
        return text if np.isnan(share) else f"{text} at t = {self.problem.t0 + share * self.guess.T:.4g} s"

    def violations(self, z: np.ndarray) -> np.ndarray:
        """By how much each row of the constraints is beyond its bounds, in units of its size."""
        return self.scaled.violations(z / self.z_sizes)

    def field(self, shares: np.ndarray) -> Field:
        """The rates at points."""
        return Field(self.dynamics, self.problem.integrand, self.problem.t0, shares)

    def flow(self, steps: int | None = None) -> Rows:
        """Rows that the defects are made of: rates at points, or changes across the intervals of shooting."""
        field = self.field(self.mesh.shares)
        return Steps(field, np.diff(self.mesh.breaks), steps or self.steps, self.held) if self.mesh.kind == "shooting" else field

    def columns(self, states: np.ndarray, inputs: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Columns and constants of [states; inputs; free parameters; duration] at points."""
        at, N = self.layout, len(states)
        columns = np.hstack([at.X[states], *[at.U[inputs[:, k]] for k in range(inputs.shape[1])],
                             np.broadcast_to(at.params, (N, len(at.params))), np.full((N, 1), at.duration)])
        constants = np.zeros(columns.shape)
        if at.duration < 0:
            constants[:, -1] = self.problem.duration[0]
        return columns, constants

    def _defects(self) -> _Part:
        mesh, n_x, flow = self.mesh, self.problem.of.n_x, self.flow()
        columns, constants = self.columns(mesh.at_state, mesh.at_inputs)
        R = mesh.E.shape[0]
        block = Block(flow, columns, constants, np.ones(columns.shape), (-sp.kron(mesh.W, sp.eye(n_x, n_x + 1))).tocsr(),
                      np.kron(mesh.b, np.eye(n_x + 1)[n_x]))
        L = sp.lil_matrix((R * n_x, self.layout.n))
        L[:, :self.layout.X.size] = sp.kron(mesh.E, sp.identity(n_x))
        for row in np.flatnonzero(mesh.corrected >= 0) if self.normals.shape[2] else ():
            k = mesh.corrected[row]
            L[row * n_x:(row + 1) * n_x, self.layout.corrections[k]] = -self.normals[k]
        names = self.problem.module.metadata.x
        return _Part(R * n_x, L.tocsr(), block, np.zeros(R * n_x), np.zeros(R * n_x),
                     [Label(MOTION, 0, mesh.share, names)])

    def _pointwise(self, expressions: Rows, columns: np.ndarray, shares: np.ndarray, A: sp.csr_matrix,
                   b: np.ndarray) -> Block:
        """Expressions whose last argument is the time, at points."""
        T, N = self.layout.duration, len(shares)
        columns = np.column_stack([columns, np.full(N, T)])
        constants, scale = np.zeros(columns.shape), np.ones(columns.shape)
        constants[:, -1] = self.problem.t0 + (0.0 if T >= 0 else shares * self.problem.duration[0])
        scale[:, -1] = shares
        return Block(expressions, columns, constants, scale, A, b)

    def _path(self) -> list[_Part]:
        of, mesh = self.problem.path, self.mesh
        m = of.expressions.m
        if not m:
            return []
        if mesh.kind == "shooting":
            states, shares = mesh.ends, mesh.breaks
            inputs = np.minimum(np.arange(len(shares)), len(mesh.samples) - 1)
        else:
            states, shares, inputs = mesh.at_state, mesh.shares, mesh.at_inputs[:, 0]
        N, at = len(states), self.layout
        columns = np.hstack([at.X[states], at.U[inputs], np.broadcast_to(at.params, (N, len(at.params)))])
        block = self._pointwise(of.expressions, columns, shares, sp.identity(N * m, format="csr"), np.zeros(N * m))
        result = [_Part(N * m, None, block, np.tile(of.least, N), np.tile(of.most, N), [Label("", 0, shares, of.texts, True)])]
        n_x, n_in = self.problem.of.n_x, self.problem.of.n_in
        without = np.flatnonzero(~of.expressions.slopes[:, n_x:n_x + n_in].any(axis=1))
        if shares[0] > 0 and len(without):  # at the start there are no inputs
            columns = np.concatenate([at.X[0], np.full(n_in, -1), at.params])[None, :]
            A = sp.csr_matrix((np.ones(len(without)), (np.arange(len(without)), without)), (len(without), m))
            block = self._pointwise(of.expressions, columns, np.zeros(1), A, np.zeros(m))
            texts = tuple(of.texts[k] for k in without)
            result.insert(0, _Part(len(without), None, block, of.least[without], of.most[without],
                                   [Label("", 0, np.zeros(1), texts, True)]))
        return result

    def _boundary(self) -> list[_Part]:
        at, problem = self.layout, self.problem
        columns = np.concatenate([at.X[0], at.X[self.mesh.ends[-1]], at.U[-1], at.params])[None, :]
        of, end = problem.boundary, problem.end_cost
        result = []
        if of.expressions.m:
            m = of.expressions.m
            block = self._pointwise(of.expressions, columns, np.ones(1), sp.identity(m, format="csr"), np.zeros(m))
            result.append(_Part(m, None, block, of.least, of.most, [Label("", 0, np.array([np.nan]), of.texts, True)]))
        block = self._pointwise(end, columns, np.ones(1), sp.csr_matrix((0, 1)), np.ones(1))
        result.append(_Part(0, None, block, np.zeros(0), np.zeros(0), []))
        return result

    def _end(self) -> _Part:
        """The end as conditions, that may be missed."""
        n_x, names = self.problem.of.n_x, self.problem.module.metadata.x
        L = sp.csr_matrix((np.ones(n_x), (np.arange(n_x), self.layout.X[self.mesh.ends[-1]])), (n_x, self.layout.n))
        least, most = self.problem.end
        texts = tuple(f"{name} = {low:g}" if low == high else f"{name} between {low:g} and {high:g}"
                      for name, low, high in zip(names, least, most, strict=True))
        return _Part(n_x, L, None, least, most, [Label("", 0, np.ones(1), texts, True)])

    def _rates(self) -> list[_Part]:
        mesh, at, (low, high) = self.mesh, self.layout, self.problem.rates
        result = []
        for k, name in enumerate(self.problem.module.metadata.inputs):
            if not (np.isfinite(low[k]) or np.isfinite(high[k])):
                continue
            D = self._of_input(mesh.rates, k)
            m, shares = D.shape[0], np.repeat(mesh.breaks[:-1], mesh.rates.shape[0] // mesh.n_intervals)
            for bound, least, most, what in ((low[k], 0.0, np.inf, "least"), (high[k], -np.inf, 0.0, "largest")):
                if np.isfinite(bound) and m:
                    rate, text = D.copy(), f"the {what} rate {bound:g} of {name}"
                    shift = 0.0
                    if at.duration >= 0:
                        rate = rate - sp.csr_matrix((np.full(m, bound), (np.arange(m), np.full(m, at.duration))), rate.shape)
                    else:
                        shift = bound * self.problem.duration[0]
                    result.append(_Part(m, rate, None, np.full(m, least + shift), np.full(m, most + shift),
                                        [Label(text, 0, shares)]))
            joints = self._of_input(mesh.joints, k)
            result.append(_Part(joints.shape[0], joints, None, np.zeros(joints.shape[0]), np.zeros(joints.shape[0]),
                                [Label(f"the continuity of {name}", 0, mesh.breaks[1:1 + joints.shape[0]])]))
        return result

    def _of_input(self, matrix: sp.csr_matrix, k: int) -> sp.csr_matrix:
        """A matrix on the samples of one input as one on z."""
        result = matrix.tocoo()
        return sp.csr_matrix((result.data, (result.row, self.layout.U[result.col, k])), (result.shape[0], self.layout.n))

    def _loops(self) -> list[_Part]:
        rows, mesh, at, problem = self.rows_of_loops, self.mesh, self.layout, self.problem
        if not len(rows):
            return []
        N, names = len(mesh.ends), problem.module.metadata.constraints
        loops = Loops(problem.module, problem.of, self.guess.p, rows, "C" in problem.timed)
        columns = np.hstack([at.X[mesh.ends], np.broadcast_to(at.params, (N, len(at.params)))])
        m = N * len(rows)
        block = self._pointwise(loops, columns, mesh.breaks, sp.identity(m, format="csr"), np.zeros(m))
        texts = tuple(names[k] if k < len(names) else f"the rate of {names[k - len(names)]}" for k in rows)
        return [_Part(m, None, block, np.zeros(m), np.zeros(m), [Label("the constraint ", 0, mesh.breaks, texts)])]

    def _units(self) -> list[_Part]:
        groups, mesh, at = unit_groups(self.problem.module), self.mesh, self.layout
        if not groups:
            return []
        columns, m = at.X[mesh.ends], len(mesh.ends) * len(groups)
        block = Block(UnitLengths(self.problem.of.n_x, groups), columns, np.zeros(columns.shape), np.ones(columns.shape),
                      sp.identity(m, format="csr"), np.zeros(m))
        texts = tuple(", ".join(names) for names in self.problem.module.metadata.unit_groups)
        return [_Part(m, None, block, np.zeros(m), np.zeros(m), [Label("the unit length of ", 0, mesh.breaks, texts)])]

    # -- the motion

    def polynomials(self, motion: Motion) -> tuple[PPoly, PPoly]:
        """State and inputs over shares of the duration."""
        mesh = self.mesh
        inputs = mesh.of_inputs(motion.U)
        at = self._arguments(motion)
        flow = self.flow()
        if isinstance(flow, Steps):
            return _hermite(*flow.states(at)), inputs
        return mesh.of_states(motion.X, flow.values(at)[:, :-1]), inputs

    def _arguments(self, motion: Motion) -> np.ndarray:
        mesh, N = self.mesh, len(self.mesh.at_state)
        free = motion.p[list(self.problem.of.free)]
        return np.hstack([motion.X[mesh.at_state], *[motion.U[mesh.at_inputs[:, k]] for k in range(mesh.at_inputs.shape[1])],
                          np.broadcast_to(free, (N, len(free))), np.full((N, 1), motion.T)])

    def errors(self, z: np.ndarray) -> np.ndarray:
        """The error of each interval (K,): what the rates of the polynomials lack of those of the equations, integrated over it;
        of shooting, how far steps of half the length lead elsewhere; with the corrections that keep the constraints. Relative to
        the sizes of the states along the motion.

        Source: Betts, section 4.7.
        """
        mesh, n_x, motion, size = self.mesh, self.problem.of.n_x, self.motion(z), self.found_sizes(z).x
        corrections = np.abs(np.einsum("kxi,ki->kx", self.normals, z[self.layout.corrections]))
        if mesh.kind == "radau":
            corrections *= (mesh.b / mesh.W.diagonal())[-1]
        if mesh.kind == "shooting":
            at = self._arguments(motion)
            once, twice = self.flow().values(at), self.flow(2 * self.steps).values(at)
            return np.asarray(((np.abs(twice - once)[:, :n_x] * 16 / 15 + corrections) / size).max(axis=1))
        shares, weights = gauss_points(mesh.breaks)
        x, u = self.polynomials(motion)
        flat, free = shares.ravel(), motion.p[list(self.problem.of.free)]
        at = np.hstack([x(flat), u(flat), np.broadcast_to(free, (len(flat), len(free))), np.full((len(flat), 1), motion.T)])
        F = self.field(flat).values(at)[:, :n_x]
        lacking = np.abs(x.derivative()(flat) - F).reshape(*shares.shape, n_x)
        return np.asarray(((np.einsum("kg,kgi->ki", weights, lacking) + corrections) / size).max(axis=1))

    def cost_along(self, z: np.ndarray, accuracy: float) -> tuple[float, np.ndarray]:
        """The cost integrated along the polynomials, and by how much the quadrature of each interval differs from that, (K,),
        relative to the cost: the integral of its absolute value, and the end. Changes below the accuracy, of the size by which
        the cost changes, do not count."""
        mesh, motion = self.mesh, self.motion(z)
        x, u = self.polynomials(motion)
        rate = lambda shares: motion.T * self._integrand(motion, shares, x(shares), u(shares))
        by_interval, sizes = integrals(rate, mesh.breaks, EXACT)
        end = self._end_cost(motion)
        size = float(sizes.sum()) + abs(end)
        quadrature = mesh.B @ self.flow().values(self._arguments(motion))[:, -1]
        with np.errstate(invalid="ignore"):  # of costs that are infinite
            missing = np.maximum(np.abs(quadrature - by_interval) - accuracy * self.scaled.cost_size, 0.0)
        return float(by_interval.sum()) + end, np.divide(missing, size, out=missing, where=missing > 0)

    def cost_of(self, z: np.ndarray, simulated: Solution) -> float:
        """The cost along a motion that was simulated with the inputs and parameters of z."""
        motion, t0, u = self.motion(z), self.problem.t0, self.polynomials(self.motion(z))[1]
        last = float(simulated.t[-1])

        def rate(shares: np.ndarray) -> np.ndarray:
            x = simulated(np.clip(t0 + shares * motion.T, t0, last))
            return motion.T * self._integrand(motion, shares, x, u(shares))

        ends = self.mesh.ends[[0, -1]]
        X = motion.X.copy()
        X[ends] = simulated.x[[0, -1]]
        return float(integrals(rate, self.mesh.breaks, SIMULATED)[0].sum()) + self._end_cost(replace(motion, X=X))

    def _integrand(self, motion: Motion, shares: np.ndarray, x: np.ndarray, inputs: np.ndarray) -> np.ndarray:
        free = motion.p[list(self.problem.of.free)]
        t = self.problem.t0 + shares * motion.T
        return self.problem.integrand.values(np.column_stack([x, inputs, np.broadcast_to(free, (len(t), len(free))), t]))[:, 0]

    def _end_cost(self, motion: Motion) -> float:
        X, free = motion.X[self.mesh.ends[[0, -1]]], motion.p[list(self.problem.of.free)]
        at = np.concatenate([X[0], X[1], motion.U[-1], free, [self.problem.t0 + motion.T]])
        return float(self.problem.end_cost.values(at[None, :])[0, 0])

    def transversal(self, motion: Motion) -> float:
        """Smallest singular value of the products of the normals of the constraints at this motion with those of the guess, 1 for
        none."""
        t = self.problem.t0 + self.mesh.breaks[1:] * motion.T
        now = normals(self.problem.module, t, motion.X[self.mesh.ends[1:]], motion.p, self.rows_of_loops)
        return float(np.linalg.svd(np.einsum("kxi,kxj->kij", self.normals, now), compute_uv=False).min())

    def undetermined(self, z: np.ndarray) -> dict[str, np.ndarray]:
        """Free parameters and inputs that cost and conditions do not depend on, neither at the guess nor at a solution, with
        where they are in z."""
        at, program, problem = self.layout, self.program, self.problem
        moving = program.z_least < program.z_most
        groups = dict(zip(problem.free, at.params[:, None], strict=True)) | dict(
            zip(problem.module.metadata.inputs, at.U.T, strict=True))
        used = np.zeros(program.n, dtype=bool)
        for point in (self.z, z):
            used |= program.gradient(point) != 0
            used[program.jacobian_columns[program.jacobian(point) != 0]] = True
        result = {name: where for name, where in groups.items() if moving[where].any() and not used[where].any()}
        if result:
            curved = program.hessian(z, 1.0, np.ones(program.m)) != 0
            used[program.hessian_rows[curved]] = used[program.hessian_columns[curved]] = True
        return {name: where for name, where in result.items() if not used[where].any()}

    def multipliers(self, lam: np.ndarray) -> dict[str, np.ndarray]:
        """Those of conditions of the user, by their texts."""
        result: dict[str, list[float]] = {}
        for label in self.program.labels:
            if label.soft:
                for k in range(label.n):
                    result.setdefault(label.text + label.entries[k % len(label.entries)], []).append(float(lam[label.first + k]))
        return {text: np.array(values) for text, values in result.items()}

    def costates(self, lam: np.ndarray, T: float) -> tuple[np.ndarray, np.ndarray]:
        """Times (n,), s, and the costates there, (n, n_x): a defect d of the state across an interval changes the cost by
        -lam d."""
        mesh, n_x = self.mesh, self.problem.of.n_x
        if mesh.kind == "hermite-simpson":
            rows, shares, weights = np.arange(1, 2 * mesh.n_intervals, 2), (mesh.breaks[1:] + mesh.breaks[:-1]) / 2, 1.0
        elif mesh.kind == "radau":
            rows, shares, weights = np.arange(mesh.E.shape[0]), mesh.share, mesh.b / mesh.W.diagonal()
        else:
            rows, shares, weights = np.arange(mesh.n_intervals), mesh.share, 1.0
        first = next(label.first for label in self.program.labels if label.text.startswith(MOTION))
        values = -lam[first + rows[:, None] * n_x + np.arange(n_x)]
        return self.problem.t0 + shares * T, values / np.broadcast_to(weights, len(rows))[:, None]


@dataclass
class _Part:
    """Rows of g: L z + A F between bounds."""

    m: int
    L: sp.csr_matrix | None
    block: Block | None
    least: np.ndarray
    most: np.ndarray
    labels: list[Label]


class _Sum:
    """A variable itself, as Rows."""

    slopes, curvature = np.ones((1, 1), dtype=bool), np.zeros((1, 1), dtype=bool)

    def values(self, at: np.ndarray) -> np.ndarray:
        return at

    def jacobian(self, at: np.ndarray) -> np.ndarray:
        return np.ones((len(at), 1, 1))

    def hessian(self, at: np.ndarray, weights: np.ndarray) -> np.ndarray:
        return np.zeros((len(at), 1, 1))


def _hermite(shares: np.ndarray, states: np.ndarray, slopes: np.ndarray) -> PPoly:
    """Cubic polynomials through states and slopes (K, n + 1, n_x) at shares (K, n + 1)."""
    n_x = states.shape[2]
    h = np.diff(shares, axis=1)[:, :, None]
    change = np.diff(states, axis=1) / h
    first, last = slopes[:, :-1], slopes[:, 1:]
    c = [(first + last - 2 * change) / h**2, (3 * change - 2 * first - last) / h, first, states[:, :-1]]
    breaks = np.append(shares[:, :-1].ravel(), shares[-1, -1])
    return PPoly(np.array([part.reshape(-1, n_x) for part in c]), breaks)
