"""The linear equations about a state, in independent velocities, constraints eliminated by the null space.

For changes v along which coordinates move (q' = N v), u' of the speeds and z' of the extra states:
    v_dot = u' - G v,  M u'_dot + C u' + K v + K_z z' + C_r^T lam' = F_in in',  C_r v = 0
With v = Z eta, u' = Z zeta the multipliers drop out. K holds the change of N, and of the constraint forces with the multipliers
of the state. G is zero where speeds are rates of coordinates, or vanish.
Source: Garcia de Jalon and Bayo, Kinematic and Dynamic Simulation of Multibody Systems, chapter 5; Schiehlen and Eberhard,
Applied Dynamics, section 5.5.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import scipy.linalg

from symdyn.errors import ArgumentError
from symdyn.runtime.constraints import turning
from symdyn.runtime.statics.selection import Selection
from symdyn.runtime.statics.terms import Place, coordinate_names, null_space


class Reduced:
    """Matrices in independent velocities.

    Z            (n_u, n): v = Z eta
    independent  places of the speeds that eta is
    """

    def __init__(self, place: Place, selection: Selection, independent: Sequence[int] | None = None) -> None:
        self.place, self.selection = place, selection
        self.rows = np.vstack([place.C_r, selection.rows(place)])
        self.Z, self.independent = _basis(place, self.rows, independent)
        self.states = selection.states
        _, n_u, _, n_c = place.sizes
        Z, on_z = self.Z, slice(n_u + n_c, None)
        inner = Z.T
        self.M = inner @ place.M @ Z
        self.C = inner @ place.by_u[:n_u] @ Z
        self.K = inner @ place.by_v[:n_u] @ Z
        self.K_z = inner @ place.by_z[:n_u][:, self.states]
        self.F_in = -inner @ place.balance_inputs[:n_u]
        self.G = (place.turning_of_speeds @ Z)[self.independent]
        self.z_v, self.z_u = place.by_v[on_z][self.states] @ Z, place.by_u[on_z][self.states] @ Z
        self.z_z, self.z_in = place.by_z[on_z][self.states][:, self.states], place.balance_inputs[on_z][self.states]

    @property
    def n(self) -> int:
        """Number of independent velocities."""
        return self.Z.shape[1]

    @property
    def curved(self) -> bool:
        """Whether constraints bend the motion, so that their change counts, too."""
        return bool(self.place.sizes[3] and (self.place.u.any() or self.place.ud.any()))

    @property
    def inertia(self) -> np.ndarray:
        """Mass matrix of all speeds, (n_u, n_u)."""
        return self.place.M

    @property
    def labels(self) -> tuple[str, ...]:
        """Names of what the independent velocities move."""
        names = coordinate_names(self.place.module.metadata)
        return tuple(names[k] for k in self.independent)

    @property
    def state_labels(self) -> tuple[str, ...]:
        """Names of the extra states that are free."""
        return tuple(self.place.module.metadata["z"][k] for k in self.states)

    @property
    def second_order(self) -> bool:
        """Whether M, C and K say all."""
        return not self.states and not self.G.any() and not self.curved

    def tangent(self) -> np.ndarray:
        """x' = T [eta; zeta; z'], (n_x, 2 n + n_z')."""
        place = self.place
        n_q, n_u, n_z, n_c = place.sizes
        T = np.zeros((n_q + n_u + n_z, 2 * self.n + len(self.states)))
        T[:n_q, :self.n] = place.N @ self.Z
        T[n_q:n_q + n_u, self.n:2 * self.n] = self.Z
        if n_c and place.u.any():
            # Dependent speeds change with positions, too, so that C_dot stays zero.
            change = -np.linalg.pinv(place.C_r) @ (place.evaluate("rows_q") * place.scale[:, None]) @ place.N @ self.Z
            T[n_q:n_q + n_u, :self.n] = change - self.Z @ change[self.independent]
        for k, state in enumerate(self.states):
            T[n_q + n_u + state, 2 * self.n + k] = 1.0
        return T

    def state_matrices(self) -> tuple[np.ndarray, np.ndarray]:
        """A (m, m) and B (m, n_in) of [eta; zeta; z']."""
        place, n = self.place, self.n
        if self.curved:
            return self._along_a_motion()
        inverse = _factorized(self.M, place.module.name)
        A = np.block([[-self.G, np.eye(n), np.zeros((n, len(self.states)))],
                      [-inverse(self.K), -inverse(self.C), -inverse(self.K_z)],
                      [self.z_v, self.z_u, self.z_z]])
        return A, np.vstack([np.zeros((n, self.F_in.shape[1])), inverse(self.F_in), self.z_in])

    def _along_a_motion(self) -> tuple[np.ndarray, np.ndarray]:
        """From the derivative of x_dot: the independent changes are coordinates of the manifold of the constraints."""
        place, n = self.place, self.n
        n_q, n_u, n_z, _ = place.sizes
        if self.selection.kept:
            raise ArgumentError(f"{place.module.name}: {', '.join(self.selection.kept)} cannot be fixed in a linearization along "
                                "a motion under constraints; fix it by a constraint of the model")
        rows = [*[n_q + k for k in self.independent], *[n_q + n_u + k for k in range(n_z)]]
        top = np.hstack([-self.G, np.eye(n), np.zeros((n, n_z))])
        A = np.vstack([top, (place.evaluate("jacobian_x") @ self.tangent())[rows]])
        by_inputs = place.evaluate("jacobian_inputs")[rows]
        return A, np.vstack([np.zeros((n, by_inputs.shape[1])), by_inputs])


def _factorized(M: np.ndarray, name: str) -> Any:
    try:
        factors = scipy.linalg.cho_factor(M)
    except np.linalg.LinAlgError:
        raise ArgumentError(f"{name}: the mass matrix of the independent velocities is not positive definite: its smallest "
                            f"eigenvalue is {np.linalg.eigvalsh(M)[0]:.3g}; give masses to what moves") from None
    return lambda right: scipy.linalg.cho_solve(factors, right)


def _basis(place: Place, rows: np.ndarray, independent: Sequence[int] | None) -> tuple[np.ndarray, list[int]]:
    """Z with rows Z = 0 whose rows of the independent speeds are those of the identity, and these speeds' places.

    Unless given they are taken so that Z stays as small as can be, in the metric of the mass matrix (QR with pivoting).
    """
    scales = 1 / np.where(turning(place.module), natural_length(place), 1.0)  # so that ranks do not depend on units
    Z = scales[:, None] * null_space(rows * scales)
    if (np.count_nonzero(Z, axis=0) == 1).all() and (np.count_nonzero(Z, axis=1) <= 1).all():
        chosen = [int(np.flatnonzero(column)[0]) for column in Z.T]
        if independent is None:
            independent = chosen
    if independent is None:
        masses = np.abs(np.diag(place.M))
        weights = np.sqrt(np.where(masses > 0, masses, masses.max(initial=0.0) or 1.0))
        independent = sorted(scipy.linalg.qr((Z * weights[:, None]).T, mode="r", pivoting=True)[1][:Z.shape[1]].tolist())
    names = [place.module.metadata["u"][k] for k in independent]
    if len(independent) != Z.shape[1]:
        raise ArgumentError(f"{place.module.name}: there are {Z.shape[1]} independent velocities here, but {len(names)} are "
                            f"named: {', '.join(names) or 'none'}")
    block = Z[list(independent)]
    if Z.shape[1] and np.linalg.cond(block / scales[list(independent)][:, None]) > 1e8:
        raise ArgumentError(f"{place.module.name}: the other velocities do not follow from {', '.join(names)} here; name others, "
                            "or leave the choice open")
    return (Z @ np.linalg.inv(block) if Z.shape[1] else Z), list(independent)


def natural_length(place: Place) -> float:
    """What makes velocities of angular ones: the largest radius of inertia, m; 1 without lengths."""
    turns = turning(place.module)
    masses = np.diag(place.M)
    if turns.all() or not turns.any() or masses[~turns].max(initial=0.0) <= 0:
        return 1.0
    return float(np.sqrt(masses[turns].max(initial=0.0) / masses[~turns].max())) or 1.0
