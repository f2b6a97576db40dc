"""The linear equations about a state on the manifold of the constraints, in independent displacements and speeds.

Small changes v along which coordinates move (q' = N v), u' of the speeds, z' of the extra states and in' of the inputs fulfil
    P v + P_in in' = 0                                          rows that hold positions: holonomic constraints, held coordinates
    S u' + S_v v + S_z z' + S_in in' = 0                        rows that hold speeds: all constraints, all that is held
    M u'_dot + F_v v + F_u u' + F_z z' + F_in in' + S^T mu' = 0
    S u'_dot + A_v v + A_u u' + A_z z' + A_in in' = 0           the derivative of C_ddot = 0
    v_dot = u' - G v
A velocity constraint has a row in S and none in P: it binds speeds, but not displacements. Motions (sd.motions) move what
constraints hold: the value of a motion in P, value and rate in S, all three in the accelerations. With independent
displacements eta, v = Z_v eta + V_in in', and independent speeds zeta, u' = Z_u zeta + W eta + W_z z' + U_in in', where the
rows of the independent ones in Z_v and Z_u are those of the identity and in W, W_z, V_in and U_in zero, the multipliers drop
out by Z_u^T, and [eta; zeta; z'] are coordinates of the manifold that the inputs move: their equations x'_dot = A x' + B in'
are the derivative of the flow on it along any motion, at rest or not, for changes of a motion's value, rate and acceleration
that belong together.
Source: Wehage and Haug, Generalized coordinate partitioning, J. Mech. Des. 104 (1982); Neimark and Fufaev, Dynamics of
Nonholonomic Systems, chapter V (velocity constraints near steady motion).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields
from functools import cached_property

import numpy as np
import scipy.linalg

from symdyn.errors import ArgumentError
from symdyn.runtime.constraints import turning
from symdyn.statics.contact_modes import contact_rows
from symdyn.statics.gimbal import REMEDY
from symdyn.statics.selection import Selection
from symdyn.statics.terms import OperatingPoint, coordinate_names, null_space

# Entries of a row of N other than this number: what moves along the speed is no coordinate of its own.
UNIT_ROW = 1e-13
# Parts of a velocity below this part of the largest, in natural units, are rounding of the basis.
DUST = 16 * float(np.finfo(float).eps)
# Dependent changes may be this many times the independent ones where a choice is to serve along a motion.
SERVES = 30.0
# Masses below this part of the largest do not count as inertia in sizes of accelerations and directions.
NEGLIGIBLE_MASS = 1e-6
# Changes of inputs that leave more than this part of what they change of the constraints are not followed.
FOLLOWED = 1e-8
# Independent velocities that determine the others worse than by this condition are rejected.
CONDITION = 1e8


@dataclass(frozen=True, eq=False)
class Held:
    """Rows of what is held besides the constraints, by a selection and by closed contacts.

    positions   (k, n_u) in v; speeds (l, n_u) in u'; the derivatives of the latter's rates and accelerations by x and inputs:
    rates (l, n_x), accelerations (l, n_x), rates_in (l, n_in), accelerations_in (l, n_in)
    """

    positions: np.ndarray
    speeds: np.ndarray
    rates: np.ndarray
    accelerations: np.ndarray
    rates_in: np.ndarray
    accelerations_in: np.ndarray


def held_rows(point: OperatingPoint, selection: Selection) -> Held:
    """The rows of what a selection and closed contacts hold."""
    metadata = point.module.metadata
    n_u = point.sizes[1]
    coordinates, speeds = held_indices(point, selection)
    parts, n_x, n_in = point.parts, len(metadata.x), len(metadata.inputs)
    first, second = (np.arange(s.start, s.stop)[coordinates] for s in (parts["q_dot"], parts["q_ddot"]))
    positions = point.N[coordinates]
    by_x, by_in = (np.zeros((len(speeds), n)) for n in (n_x, n_in))
    held = Held(positions, np.vstack([positions, np.eye(n_u)[speeds]]),
                *(np.vstack([whole[rows], still]) for whole, still in ((point.whole_x, by_x), (point.whole_inputs, by_in))
                  for rows in (first, second)))
    rows = contact_rows(point)
    if rows is None:
        return held
    more = (rows.by_u, rows.by_u, rows.rates, rows.accelerations, rows.rates_in, rows.accelerations_in)
    return Held(*(np.vstack([getattr(held, f.name), part]) for f, part in zip(fields(Held), more, strict=True)))


def held_indices(point: OperatingPoint, selection: Selection) -> tuple[list[int], list[int]]:
    """Indices of the held coordinates, and of the held speeds that are no rates of coordinates.

    A coordinate is held at its value, and so is the coordinate of a held speed that is its rate: its motion is prescribed. A
    speed that is no rate of a coordinate is held itself, and the displacement along it is free.
    """
    metadata = point.module.metadata
    labels = coordinate_names(metadata)
    coordinates: list[int] = []
    speeds: list[int] = []
    for name in selection.held:
        if name in metadata.q:
            coordinates.append(metadata.q.index(name))
        elif name in metadata.u:
            k = metadata.u.index(name)
            if labels[k] in metadata.q:
                coordinates.append(metadata.q.index(labels[k]))
            else:
                speeds.append(k)
    return list(dict.fromkeys(coordinates)), speeds


class Manifold:
    """The linear equations in independent displacements eta, speeds zeta and free extra states z'.

    Z_v, Z_u      (n_u, n_d) and (n_u, n_s), of v and u'; W (n_u, n_d), W_z (n_u, n_z): u' = Z_u zeta + W eta + W_z z' + U_in in'
    V_in, U_in    (n_u, n_in), the parts of v and u' that follow the inputs
    displacements, speeds   indices of eta and zeta among the speeds; states: of the free extra states
    demanded      parts of u'_dot (n_u, k) that the rows of accelerations demand of eta, zeta and z'
    demanded_in   what they demand of the inputs (n_u, n_in)
    M, C, K, K_z, F_in      M zeta_dot + C zeta + K eta + K_z z' = F_in in'
    G             eta_dot = Z_u[displacements] zeta + (W - G Z_v)[displacements] eta + ...
    """

    def __init__(self, point: OperatingPoint, selection: Selection,
                 independent: Sequence[int] | tuple[Sequence[int], Sequence[int]] | None = None,
                 partition: tuple[Sequence[int], Sequence[int]] | None = None) -> None:
        self.point, self.selection = point, selection
        following = [*point.module.metadata.implicit_loads, *point.module.metadata.of_reactions]
        if following and selection.held:
            raise ArgumentError(f"{point.module.name}: {', '.join(selection.held)} held, where {', '.join(following)} "
                                f"{'depends' if len(following) == 1 else 'depend'} on reactions, which what is held would "
                                "change; hold nothing, or give the mechanism a constraint or a prescribed motion that holds it")
        self.held = held_rows(point, selection)
        self.states = selection.free_states
        n_c = point.sizes[3]
        self._holonomic = np.array(point.module.metadata.holonomic or [True] * n_c, dtype=bool)[:n_c]
        self.P = np.vstack([point.C_r[self._holonomic], self.held.positions])
        self.S = np.vstack([point.C_r, self.held.speeds])
        if isinstance(independent, tuple):
            partition = independent
        named = partition[0] if partition is not None else None if isinstance(independent, tuple) else independent
        self.Z_v, self.displacements = _basis(point, self.P, named)
        wanted = list(partition[1]) if partition is not None else None
        if wanted is None and named is not None and _determines(point, self.S, named):
            wanted = list(named)
        self.Z_u, self.speeds = (self.Z_v, self.displacements) if len(self.S) == len(self.P) else \
            _basis(point, self.S, wanted, among=self.displacements)
        self._form()

    # -- sizes and names

    @property
    def n_d(self) -> int:
        """Number of independent displacements."""
        return self.Z_v.shape[1]

    @property
    def n_s(self) -> int:
        """Number of independent speeds."""
        return self.Z_u.shape[1]

    @property
    def partition(self) -> tuple[list[int], list[int]]:
        """Indices of the independent displacements and speeds."""
        return self.displacements, self.speeds

    @property
    def Z(self) -> np.ndarray:
        """v = Z eta, (n_u, n_d)."""
        return self.Z_v

    @property
    def inertia(self) -> np.ndarray:
        """Mass matrix of all speeds, (n_u, n_u)."""
        return self.point.M

    @property
    def labels(self) -> tuple[str, ...]:
        """Names of what the independent displacements move."""
        names = coordinate_names(self.point.module.metadata)
        return tuple(names[k] for k in self.displacements)

    @property
    def speed_labels(self) -> tuple[str, ...]:
        """Names of the independent speeds."""
        return tuple(self.point.module.metadata.u[k] for k in self.speeds)

    @property
    def state_labels(self) -> tuple[str, ...]:
        """Names of the extra states that are free."""
        return tuple(self.point.module.metadata.z[k] for k in self.states)

    @property
    def second_order(self) -> bool:
        """Whether M, C and K are all: M eta_ddot + C eta_dot + K eta = 0."""
        return not self.states and self.Z_u is self.Z_v and not self.W.any() and not self.G.any()

    # -- the matrices

    def _form(self) -> None:
        point, held = self.point, self.held
        n_q, n_u, n_z, _ = point.sizes
        parts = point.parts
        scale = point.scale[:, None]
        x_v = np.vstack([point.N, np.zeros((n_u + n_z, n_u))])  # [q'; u'; z'] of v, of u' and of z'
        x_u = np.vstack([np.zeros((n_q, n_u)), np.eye(n_u), np.zeros((n_z, n_u))])
        x_z = np.vstack([np.zeros((n_q + n_u, n_z)), np.eye(n_z)])[:, self.states]
        rates = np.vstack([point.whole_x[parts["C_dot"]] * scale, held.rates])
        positions_in = point.whole_inputs[parts["C"]] * scale
        rates_in = np.vstack([point.whole_inputs[parts["C_dot"]] * scale, held.rates_in])
        self.W = self._particular(rates @ x_v @ self.Z_v)
        self.W_z = self._particular(rates @ x_z)
        asked = np.vstack([positions_in[self._holonomic], np.zeros((len(held.positions), positions_in.shape[1]))])
        self.V_in = self._particular(asked, self.P, self.displacements)
        self.U_in = self._particular(rates_in + rates @ x_v @ self.V_in)
        self._unfollowed = _left(self.P, self.V_in, asked) | _left(self.S, self.U_in, rates_in, (rates @ x_v, self.V_in))
        # Columns: the changes of x that eta, zeta, z' and in' stand for.
        self.along = (x_v @ self.Z_v + x_u @ self.W, x_u @ self.Z_u, x_z + x_u @ self.W_z)
        along_in = self.along_in = x_v @ self.V_in + x_u @ self.U_in
        forces = point.whole_x[parts["forces"]]
        bent = self._bent_reactions()
        second = np.vstack([point.whole_x[parts["C_ddot"]] * scale, held.accelerations])
        second_in = np.vstack([point.whole_inputs[parts["C_ddot"]] * scale, held.accelerations_in])
        self.demanded = [self._particular(second @ each) for each in self.along]
        self.demanded_in = self._particular(second_in + second @ along_in)
        self._unfollowed |= _left(self.S, self.demanded_in, second_in, (second, along_in))
        inner = self.Z_u.T
        pulls = [forces @ each for each in self.along]
        pulls[0] = pulls[0] + bent @ self.Z_v
        self.M = inner @ point.M @ self.Z_u
        self.K, self.C, self.K_z = (inner @ (pull + point.M @ demanded)
                                    for pull, demanded in zip(pulls, self.demanded, strict=True))
        self.F_in = -inner @ (point.whole_inputs[parts["forces"]] + forces @ along_in + bent @ self.V_in
                              + point.M @ self.demanded_in)
        self.turned = point.turning_of_speeds
        self.G = (self.turned @ self.Z_v)[self.displacements]
        rates_z = point.whole_x[parts["z_dot"]][self.states]
        self._of_states = [rates_z @ each for each in self.along]
        self._states_in = point.whole_inputs[parts["z_dot"]][self.states] + rates_z @ along_in

    def _particular(self, right: np.ndarray, rows: np.ndarray | None = None,
                    independent: Sequence[int] | None = None) -> np.ndarray:
        """The u' (n_u, k) with rows u' = -right whose independent ones are zero; left out: S and the speeds."""
        rows = self.S if rows is None else rows
        n_u = self.point.sizes[1]
        result = np.zeros((n_u, right.shape[1]))
        dependent = [k for k in range(n_u) if k not in set(self.speeds if independent is None else independent)]
        if right.any() and dependent:
            columns = natural_scales(self.point)[dependent]
            result[dependent] = -columns[:, None] * np.linalg.lstsq(rows[:, dependent] * columns, right, rcond=1e-12)[0]
        return result

    def _bent_reactions(self) -> np.ndarray:
        """Change of the forces that hold coordinates because their direction turns, by v, (n_u, n_u).

        Along a coordinate q_k the force acts along row k of N; N changes with q where speeds are no rates of coordinates.
        """
        point = self.point
        n_u = point.sizes[1]
        result = np.zeros((n_u, n_u))
        metadata = point.module.metadata
        turned = [n for n in self.selection.held if n in metadata.q
                  and np.abs(np.sort(np.abs(point.N[metadata.q.index(n)]))[:-1]).max(initial=0.0) > UNIT_ROW]
        if not turned:
            return result
        reaction = np.linalg.lstsq(self.held.speeds.T, -point.forces, rcond=1e-12)[0]
        base = point.whole_x[point.parts["q_ddot"], :point.sizes[0]]
        for j in range(n_u):  # q_ddot is linear in u_dot: its derivative by q changes by that of column j of N
            pushed = point.at(ud=point.ud + np.eye(n_u)[j]).whole_x[point.parts["q_ddot"], :point.sizes[0]]
            change = (pushed - base) @ point.N
            for name in turned:
                k = metadata.q.index(name)
                row = list(dict.fromkeys(n for n in self.selection.held if n in metadata.q)).index(name)
                result[j] += reaction[row] * change[k]
        return result

    def tangent(self) -> np.ndarray:
        """x' = T [eta; zeta; z'], (n_x, n_d + n_s + n_z')."""
        return np.hstack(self.along)

    def state_matrices(self) -> tuple[np.ndarray, np.ndarray]:
        """A (m, m) and B (m, n_in) of [eta; zeta; z'], see `demand_followed`."""
        inverse = _factorized(self.M, self.point.module.name)
        top = [self.W[self.displacements] - self.G, self.Z_u[self.displacements], self.W_z[self.displacements]]
        A = np.block([top, [-inverse(self.K), -inverse(self.C), -inverse(self.K_z)], self._of_states])
        moved = (self.U_in - self.turned @ self.V_in)[self.displacements]
        return A, np.vstack([moved, inverse(self.F_in), self._states_in])

    def demand_followed(self) -> None:
        """Raises ArgumentError where a motion moves what the constraints hold fast, so that there are no B and D."""
        if self._unfollowed.any():
            metadata = self.point.module.metadata
            inputs = ", ".join(n for n, lost in zip(metadata.inputs, self._unfollowed, strict=True) if lost)
            raise ArgumentError(f"{self.point.module.name}: B and D are requested where the constraints do not let the mechanism "
                                f"follow changes of {inputs}, to first order: the position is singular, or the constraints and "
                                "what is held leave nothing to follow by; move away from there, or hold less")

    def output_matrices(self) -> tuple[np.ndarray, np.ndarray]:
        """C_out (n_y, m) and D (n_y, n_in); accelerations in outputs are those of the constrained motion, what is held held."""
        point = self.point
        metadata = point.module.metadata
        if not metadata.outputs:
            return np.zeros((0, self.n_d + self.n_s + len(self.states))), np.zeros((0, self.F_in.shape[1]))
        by_x = point.variations(metadata.x, "outputs_variation")
        by_in = point.variations(metadata.inputs, "outputs_variation")
        by_ud = point.variations([f"{u}_dot" for u in metadata.u], "outputs_variation")
        inverse = _factorized(self.M, point.module.name)
        accelerations = [self.Z_u @ -inverse(pull) + demanded
                         for pull, demanded in zip((self.K, self.C, self.K_z), self.demanded, strict=True)]
        C_out = np.hstack([by_x @ each + by_ud @ ud for each, ud in zip(self.along, accelerations, strict=True)])
        return C_out, by_in + by_x @ self.along_in + by_ud @ (self.Z_u @ inverse(self.F_in) + self.demanded_in)

    @cached_property
    def bundle(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Changes w = [v; u'; z'] of all speeds' displacements, all speeds and free extra states: w = T x' (k, m), x' = L w (m,
        k), and the matrix (k, k) of w_dot for changes on the manifold, which no choice of independent ones enters."""
        n_u, n_z = self.point.sizes[1], len(self.states)
        zeros = np.zeros
        T = np.block([[self.Z_v, zeros((n_u, self.n_s)), zeros((n_u, n_z))], [self.W, self.Z_u, self.W_z],
                      [zeros((n_z, self.n_d)), zeros((n_z, self.n_s)), np.eye(n_z)]])
        inverse = _factorized(self.M, self.point.module.name)
        accelerations = [self.Z_u @ -inverse(pull) + demanded
                         for pull, demanded in zip((self.K, self.C, self.K_z), self.demanded, strict=True)]
        rates = np.block([[self.W - self.turned @ self.Z_v, self.Z_u, self.W_z], accelerations, self._of_states])
        picked = [*self.displacements, *[n_u + k for k in self.speeds], *[2 * n_u + k for k in range(n_z)]]
        return T, np.eye(len(T))[picked], rates @ np.linalg.pinv(T)

    @cached_property
    def matrices(self) -> tuple[np.ndarray, np.ndarray]:
        """A and B, once."""
        return self.state_matrices()


def _left(rows: np.ndarray, result: np.ndarray, asked: np.ndarray, *products: tuple[np.ndarray, np.ndarray]) -> np.ndarray:
    """Mask of the columns of rows @ found + asked + the products that are not zero, by the sizes of their terms, (n_in,) of
    bool."""
    left, size = rows @ result + asked, np.abs(asked)
    for factor, other in products:
        left, size = left + factor @ other, size + np.abs(factor) @ np.abs(other)
    worst: np.ndarray = np.abs(left).max(axis=0, initial=0.0) > FOLLOWED * size.max(axis=0, initial=0.0)
    return worst


def common_partition(start: Manifold, points: Sequence[OperatingPoint]) -> tuple[list[int], list[int]] | None:
    """Independent displacements and speeds that serve at all points: those whose Z_v and Z_u stay smallest.

    None where none does: each of them comes to a position where it stands still while others move (a dead point).
    """
    if not len(start.S):
        return start.partition
    candidates = [start.partition]
    manifolds = [start, *[Manifold(point, start.selection) for point in points]]
    for each in manifolds:
        if each.partition not in candidates:
            candidates.append(each.partition)
    if len(candidates) == 1:
        return start.partition
    worst = []
    for candidate in candidates:
        try:
            sizes = [np.abs(Z).max(initial=0.0) for each in manifolds
                     for Z in _with_partition(each, candidate)]
        except ArgumentError:
            sizes = [np.inf]
        worst.append(max(sizes))
    best = int(np.argmin(worst))
    return candidates[best] if worst[best] <= SERVES else None


def _with_partition(manifold: Manifold, partition: tuple[list[int], list[int]]) -> tuple[np.ndarray, np.ndarray]:
    """Z_v and Z_u with other independent ones, lengths by the natural length."""
    scales = natural_scales(manifold.point)
    result = []
    for Z, independent in zip((manifold.Z_v, manifold.Z_u), partition, strict=True):
        block = Z[independent]
        if block.shape[0] != block.shape[1] or (len(block) and np.linalg.cond(block / scales[independent][:, None]) > CONDITION):
            raise ArgumentError("")
        other = Z @ np.linalg.inv(block) if len(block) else Z
        result.append(other / scales[:, None] * scales[independent])
    return result[0], result[1]


def _factorized(M: np.ndarray, name: str) -> Callable[[np.ndarray], np.ndarray]:
    try:
        factors = scipy.linalg.cho_factor(M)
    except np.linalg.LinAlgError:
        raise ArgumentError(f"{name}: the mass matrix of the independent velocities is not positive definite: its smallest "
                            f"eigenvalue is {np.linalg.eigvalsh(M)[0]:.3g}; give masses to what moves; at gimbal lock of three "
                            f"angles {REMEDY}") from None

    def solve(right: np.ndarray) -> np.ndarray:
        return np.asarray(scipy.linalg.cho_solve(factors, right))

    return solve


def _determines(point: OperatingPoint, rows: np.ndarray, independent: Sequence[int]) -> bool:
    """Whether as many speeds as are named determine the others."""
    scales = natural_scales(point)
    Z = null_space(rows * scales)
    block = Z[list(independent)]
    return block.shape[0] == block.shape[1] and (not len(block) or bool(np.linalg.cond(block) <= CONDITION))


def _basis(point: OperatingPoint, rows: np.ndarray, independent: Sequence[int] | None,
           among: Sequence[int] | None = None) -> tuple[np.ndarray, list[int]]:
    """Z with rows Z = 0 whose rows of the independent speeds are those of the identity, and these speeds' points.

    Unless given they are taken so that Z stays as small as can be, in the metric of the mass matrix (QR with pivoting).
    """
    scales = natural_scales(point)  # so that ranks do not depend on units
    Z = scales[:, None] * null_space(rows * scales)
    if independent is None and (np.count_nonzero(Z, axis=0) == 1).all() and (np.count_nonzero(Z, axis=1) <= 1).all():
        independent = [int(np.flatnonzero(column)[0]) for column in Z.T]
    if independent is None:
        masses = np.abs(np.diag(point.M))
        weights = np.sqrt(np.where(masses > 0, masses, masses.max(initial=0.0) or 1.0))
        pool = list(range(len(Z))) if among is None else list(among)
        order = scipy.linalg.qr((Z[pool] * weights[pool, None]).T, mode="r", pivoting=True)[1][:Z.shape[1]].tolist()
        independent = sorted(pool[k] for k in order)
    names = [point.module.metadata.u[k] for k in independent]
    if len(independent) != Z.shape[1]:
        raise ArgumentError(f"{point.module.name}: there are {Z.shape[1]} independent velocities here, but {len(names)} are "
                            f"named: {', '.join(names) or 'none'}")
    block = Z[list(independent)]
    if Z.shape[1] and np.linalg.cond(block / scales[list(independent)][:, None]) > CONDITION:
        raise ArgumentError(f"{point.module.name}: the other velocities do not follow from {', '.join(names)} here; name others, "
                            "or leave the choice open")
    if not Z.shape[1]:
        return Z, []
    result = Z @ np.linalg.inv(block)
    # The rounding of a zero would couple quantities that are independent by structure, and count as uncertain in every matrix.
    sizes = np.abs(result / scales[:, None] * scales[list(independent)])
    result[sizes <= DUST * sizes.max()] = 0.0
    result[list(independent)] = np.eye(len(block))
    return result, list(independent)


def natural_scales(point: OperatingPoint) -> np.ndarray:
    """Displacements along all speeds that compare: 1 m, and as many rad as it is natural lengths, (n_u,)."""
    scales: np.ndarray = 1 / np.where(turning(point.module), natural_length(point), 1.0)
    return scales


def natural_length(point: OperatingPoint) -> float:
    """Length that makes velocities of angular ones: the largest radius of inertia, m; 1 without lengths."""
    turns = turning(point.module)
    masses = np.diag(point.M)
    if turns.all() or not turns.any() or masses[~turns].max(initial=0.0) <= 0:
        return 1.0
    return float(np.sqrt(masses[turns].max(initial=0.0) / masses[~turns].max())) or 1.0


def acceleration_size(point: OperatingPoint, forces: np.ndarray) -> float:
    """The largest acceleration that forces make of what has mass, in natural units of displacements, 1/s^2."""
    masses = np.abs(np.diag(point.M))
    heavy = masses > NEGLIGIBLE_MASS * masses.max(initial=0.0)
    return float((forces[heavy] / masses[heavy] / natural_scales(point)[heavy]).max(initial=0.0))


def in_motion(point: OperatingPoint, selection: Selection) -> OperatingPoint:
    """The operating point with the accelerations of its motion, what is held being held, and multipliers of least norm."""
    point = point.at(ud=np.zeros(point.sizes[1]), lam=np.zeros(point.sizes[3]))
    _, n_u, _, n_c = point.sizes
    metadata = point.module.metadata
    labels = coordinate_names(metadata)
    rows, right = [point.C_r], [point.evaluate("F_d") * point.scale if n_c else np.zeros(0)]
    drift = point.balance[point.parts["q_ddot"]]
    for name in selection.held:
        label = labels[metadata.u.index(name)] if name in metadata.u and name not in metadata.q else name
        if label in metadata.q:
            k = metadata.q.index(label)
            rows.append(point.N[k:k + 1])
            right.append(-drift[k:k + 1])
        elif name in metadata.u:
            rows.append(np.eye(n_u)[[metadata.u.index(name)]])
            right.append(np.zeros(1))
    masses = np.abs(np.diag(point.M))
    scale = 1 / np.sqrt(np.maximum(masses, NEGLIGIBLE_MASS * masses.max(initial=1e-300)))
    A = np.vstack(rows) * scale
    KKT = np.block([[point.M * np.outer(scale, scale), A.T], [A, np.zeros((len(A), len(A)))]])
    result = np.linalg.lstsq(KKT, np.concatenate([-point.forces * scale, *right]), rcond=1e-12)[0]
    ud = scale * result[:n_u]
    # Rest is rest: rounding is no motion.
    sizes = natural_scales(point)
    level = max(acceleration_size(point, np.abs(point.forces)), float(np.abs(np.concatenate(right)).max(initial=0.0)))
    ud = np.where(np.abs(ud / sizes) <= 1e-13 * level, 0.0, ud)
    return point.at(ud=ud, lam=result[n_u:n_u + n_c] * point.scale)
