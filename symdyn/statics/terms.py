"""The equations at one state, split into forces, constraints and extra states, with their exact derivatives in numbers.

    M u_dot + k - F + C_r^T lam = 0,  C = 0,  z_dot = 0      the statics
    C_dot = 0,  C_ddot = 0,  q_dot,  q_ddot                  what a motion fulfils besides
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from symdyn.arguments import fixed
from symdyn.backend.metadata import ModuleMetadata
from symdyn.runtime.constraints import names as constraint_names
from symdyn.runtime.inputs.following import RATES
from symdyn.tape.intrinsics import RANK

if TYPE_CHECKING:
    from symdyn.runtime.module import Module



@dataclass(frozen=True, eq=False)
class OperatingPoint:
    """A module at a state x = [q; u; z] with accelerations and multipliers; p and inputs in the module's order."""

    module: Module
    t: float
    x: np.ndarray
    p: np.ndarray
    inputs: np.ndarray
    ud: np.ndarray
    lam: np.ndarray

    def __post_init__(self) -> None:
        for name in ("x", "p", "inputs", "ud", "lam"):  # results are evaluated from them when they are requested
            object.__setattr__(self, name, fixed(getattr(self, name)))

    def at(self, **changes: Any) -> OperatingPoint:
        """The same with some of these replaced."""
        return replace(self, **changes)

    @property
    def bound(self) -> Module:
        """The module with the motions of this point wherever inputs are left out."""
        return self.module.following(self.inputs)

    @property
    def motion_rates(self) -> dict[str, float]:
        """Rates and accelerations of motions that inputs follow, by name, as far as they are not zero."""
        names = self.module.metadata.inputs
        rates = [f"{motion}{end}" for motion in self.module.metadata.motions for end in RATES]
        values = {name: float(self.inputs[names.index(name)]) for name in rates}
        return {name: value for name, value in values.items() if value != 0}

    @property
    def sizes(self) -> tuple[int, int, int, int]:
        """n_q, n_u, n_z, n_c."""
        sizes = self.module.metadata.sizes
        return sizes.q, sizes.u, sizes.z, len(constraint_names(self.module))

    @property
    def q(self) -> np.ndarray:
        return self.x[:self.sizes[0]]

    @property
    def u(self) -> np.ndarray:
        n_q, n_u, *_ = self.sizes
        return self.x[n_q:n_q + n_u]

    @property
    def z(self) -> np.ndarray:
        n_q, n_u, *_ = self.sizes
        return self.x[n_q + n_u:]

    def evaluate(self, name: str) -> np.ndarray:
        """A function of the module here."""
        ud = np.concatenate([self.ud, self.lam]) if name.startswith("balance") else ()
        return self.module.evaluate(name, self.t, self.x, self.p, self.inputs, ud)

    def along(self, name: str, **groups: Mapping[str, float]) -> np.ndarray:
        """`second_variation` here; arguments by name, what is left out is zero.

        vary, along   mappings from the names of what varies, and of the direction, to numbers, as in the generated header
        """
        given = {f"({kind} {key})": value for kind, entries in groups.items() for key, value in entries.items()}
        given |= self._given_rates()
        ud = [given.get(n, 0.0) for n in self.module.library(name).metadata.ud]
        return self.module.evaluate(name, self.t, self.x, self.p, self.inputs, ud)

    def by(self, names: Sequence[str]) -> np.ndarray:
        """Derivatives of the statics by coordinates, speeds, states, inputs or parameters, (n_u + n_c + n_z, len(names))."""
        return self.variations(names)[:self._statics]

    def variations(self, names: Sequence[str], function: str = "variation") -> np.ndarray:
        """Derivatives of the balance (or the outputs, by `outputs_variation`) by what is named, (rows, len(names)).

        Names are those of coordinates, speeds, states, inputs, parameters, accelerations ("u_dot") and multipliers.
        """
        about = self.module.library(function).metadata.ud
        given = self._given_rates()
        rows = np.tile([given.get(n, 0.0) for n in about], (len(names), 1))
        for row, name in zip(rows, names, strict=True):
            row[about.index(f"(along {name})")] = 1.0
        if not len(names):
            return np.zeros((int(np.prod(self.module.shape(function))), 0))
        result: np.ndarray = self.module.evaluate(function, self.t, self.x, self.p, self.inputs, rows)
        return result.reshape(len(names), -1).T

    @property
    def _statics(self) -> int:
        """Number of rows of the statics, the first of the balance."""
        _, n_u, n_z, n_c = self.sizes
        return n_u + n_c + n_z

    @cached_property
    def parts(self) -> dict[str, slice]:
        """Where the parts of the balance stand in it."""
        n_q, n_u, n_z, n_c = self.sizes
        ends = np.cumsum([0, n_u, n_c, n_z, n_c, n_c, n_q, n_q]).tolist()
        names = ("forces", "C", "z_dot", "C_dot", "C_ddot", "q_dot", "q_ddot")
        return {name: slice(a, b) for name, a, b in zip(names, ends, ends[1:], strict=False)}

    def _given_rates(self) -> dict[str, float]:
        """Accelerations and multipliers by the names that generated code has for them."""
        return {**dict(zip([f"{u}_dot" for u in self.module.metadata.u], self.ud, strict=True)),
                **{multiplier(k): value for k, value in enumerate(self.lam)}}

    # -- the balance and its parts

    @cached_property
    def balance(self) -> np.ndarray:
        return self.evaluate("balance")

    @property
    def forces(self) -> np.ndarray:
        """M u_dot + k - F + C_r^T lam, (n_u,)."""
        return self.balance[self.parts["forces"]]

    @property
    def C(self) -> np.ndarray:
        return self.balance[self.parts["C"]]

    @property
    def rates_z(self) -> np.ndarray:
        return self.balance[self.parts["z_dot"]]

    @cached_property
    def whole_x(self) -> np.ndarray:
        """Derivatives of the balance by x, (rows, n_x)."""
        return self.variations(self.module.metadata.x)

    @cached_property
    def whole_inputs(self) -> np.ndarray:
        """Derivatives of the balance by the inputs, (rows, n_in)."""
        return self.variations(self.module.metadata.inputs)

    @property
    def balance_x(self) -> np.ndarray:
        """Derivative of the statics by x, (n_u + n_c + n_z, n_x)."""
        return self.whole_x[:self._statics]

    @cached_property
    def M(self) -> np.ndarray:
        """Mass matrix, (n_u, n_u)."""
        return self.evaluate("mass_matrix")

    @cached_property
    def N(self) -> np.ndarray:
        """(n_q, n_u): q' = N v."""
        return self.evaluate("N")

    @cached_property
    def by_v(self) -> np.ndarray:
        """Derivative of the balance along v (q' = N v), (n_u + n_c + n_z, n_u)."""
        by_q: np.ndarray = self.balance_x[:, :self.sizes[0]] @ self.N
        return by_q

    @cached_property
    def by_u(self) -> np.ndarray:
        n_q, n_u, *_ = self.sizes
        return self.balance_x[:, n_q:n_q + n_u]

    @cached_property
    def by_z(self) -> np.ndarray:
        return self.balance_x[:, self.sizes[0] + self.sizes[1]:]

    @cached_property
    def C_r(self) -> np.ndarray:
        """Jacobian of the constraints, rows scaled to lengths, (n_c, n_u)."""
        n_c = self.sizes[3]
        return self.evaluate("C_r") * self.scale[:, None] if n_c else np.zeros((0, self.sizes[1]))

    @cached_property
    def scale(self) -> np.ndarray:
        """Factors that make constraints lengths, (n_c,)."""
        return self.evaluate("C_scale") if self.sizes[3] else np.zeros(0)

    @cached_property
    def turning_of_speeds(self) -> np.ndarray:
        """G of v_dot = u' - G v, (n_u, n_u), for the change u' of the speeds: zero where speeds are rates of coordinates."""
        by_q, rate = self.whole_x[self.parts["q_dot"], :self.sizes[0]], self.evaluate("N_dot")
        if not by_q.any() and not rate.any():
            return np.zeros((self.sizes[1], self.sizes[1]))
        result: np.ndarray = np.linalg.lstsq(self.N, rate - by_q @ self.N, rcond=None)[0]
        return result

    def moved(self, v: np.ndarray) -> np.ndarray:
        """The coordinates after the velocities v (n_u,) for a unit of time, unit vectors of length 1."""
        q = self.q + self.N @ v
        for group in self.module.metadata.unit_groups:
            indices = [self.module.metadata.q.index(name) for name in group]
            q[indices] /= np.linalg.norm(q[indices])
        return q


def multiplier(k: int) -> str:
    """The name that generated code has for the multiplier of constraint k."""
    return f"(lambda {k + 1})"


def rest(module: Module, t: float, x: np.ndarray, p: np.ndarray, inputs: np.ndarray) -> OperatingPoint:
    """An operating point without accelerations and multipliers."""
    return OperatingPoint(module, t, x, p, inputs, np.zeros(module.metadata.sizes.u), np.zeros(len(constraint_names(module))))


def null_space(A: np.ndarray, tolerance: float = RANK) -> np.ndarray:
    """Orthonormal columns Z with A Z = 0, (n, n - rank); columns of the identity where every row has a single entry.

    Entries are numbers of the size of 1, of rows that hold anything: much smaller ones are rounding.
    """
    n = A.shape[1]
    if not (np.abs(A) > tolerance).any():
        return np.eye(n)
    if (np.count_nonzero(A, axis=1) <= 1).all():
        return np.eye(n)[:, ~A.any(axis=0)]
    _, values, Vt = np.linalg.svd(A)
    rank = int((values > tolerance * max(values[0], 1.0)).sum())
    basis: np.ndarray = Vt[rank:].T
    return basis


def coordinate_names(metadata: ModuleMetadata) -> tuple[str, ...]:
    """Names of what moves along each speed: its coordinate, or the speed if it is not the rate of one."""
    return tuple(u.removesuffix("_dot") if u.removesuffix("_dot") in metadata.q else u for u in metadata.u)
