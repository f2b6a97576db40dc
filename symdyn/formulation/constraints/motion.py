"""Motion under constraints: M u_dot + C_r^T lam = F - k, C_r u_dot = F_d, and the corrections that keep it on its manifold.

Source: lecture, chapters 3.4 and 6.3; projections: Garcia de Jalon and Bayo, Kinematic and Dynamic Simulation of Multibody
Systems, section 6.5 (mass-orthogonal).
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from fractions import Fraction
from functools import cached_property, partial
from typing import Any

import numpy as np

from symdyn.formulation.accelerations import Implicit, Motion
from symdyn.formulation.constraints.null_space import NullSpaceSolver
from symdyn.formulation.constraints.rows import Row
from symdyn.formulation.constraints.saddle import IntrinsicSolver, RangeSolver, SaddleSolver, SubsetSolver, least_multipliers
from symdyn.formulation.names import along_group, stabilized
from symdyn.spatial.vectors import inner, vector, zeros
from symdyn.tape import node as kinds
from symdyn.tape.differentiate import forward
from symdyn.tape.intrinsics import DAMPED, SMOOTHED
from symdyn.tape.node import is_zero
from symdyn.tape.passes import substitute

BAUMGARTE = "(baumgarte)"
# Units of rows by the power of lengths in them.
POWERS = {"rad": 0, "m": 1, "m^2": 2, "m^3": 3}
# Rows with derivatives smaller than this, lengths by lengths, are left to the numeric algorithm.
VANISHING = Fraction(1, 1000)


class Constrained(Motion):
    """Mixed in before a Motion: what constraints add to it.

    rows          of the constraints; length: the mechanism's, m; lever: what angular speeds are multiplied by to compare them
                  with others, m; angular: for each speed whether it turns (symdyn.turning)
    intrinsic        False: Schur complement of the factorized mass matrix, as statements; True: the numeric algorithm that takes
                  singular mass matrices and dependent constraints, too
    independent   indices of rows that imply the others; None: all rows
    pivots        (row, column) of C_r in the order in which dependent speeds are eliminated; None: by the Schur complement
    massless_pivots   first speed of a motion without kinetic energy at some positions -> the other speeds of this motion
    unheld        what it means if the numeric algorithm fails
    """

    rows: list[Row]
    intrinsic = False
    independent: tuple[int, ...] | None = None
    pivots: tuple[tuple[int, int], ...] | None = None
    massless_pivots: Mapping[int, Collection[int]] = {}
    unheld = "a speed is held neither by mass nor by a constraint"

    @cached_property
    def length(self) -> Any:
        raise NotImplementedError

    @cached_property
    def lever(self) -> Any:
        raise NotImplementedError

    @property
    def angular(self) -> list[bool]:
        raise NotImplementedError

    def quantities(self) -> dict[str, Callable[[], Any]]:
        """name -> function that records it."""
        own: dict[str, Callable[[], Any]] = {
            "C": lambda: vector(*[r.value for r in self.rows]), "C_r": self.C_r, "C_t": self.C_t, "C_dot": self.C_dot,
            "F_d": self.F_d, "lam": self.lam, "matrix": self.matrix, "right_side": self.right_side,
            "C_scale": self.C_scale, "length": lambda: self.length,
            "position_correction": self.position_correction, "velocity_correction": self.velocity_correction,
            stabilized("rhs"): self.rhs_baumgarte, stabilized("jacobian_x"): self.jacobian_x_baumgarte,
            stabilized("unknowns"): lambda: np.concatenate(self.recall("stabilized")),
            **{along_group(stabilized("unknowns"), group): partial(self.along, group, True) for group in self.groups()},
            "residual": self.residual}
        return {**super().quantities(), **own}

    # -- rows

    def C_r(self) -> np.ndarray:
        return np.array([r.jacobian for r in self.rows], dtype=object).reshape(len(self.rows), len(self.speeds))

    def C_dot(self) -> np.ndarray:
        return vector(*[r.rate for r in self.rows])

    def C_t(self) -> np.ndarray:
        """C_dot at u = 0."""
        still = {self.algebra.leaves[u]: 0 for u in self.speeds}
        return vector(*substitute(tuple(r.rate for r in self.rows), still, self.algebra.recorder))

    def F_d(self) -> np.ndarray:
        with self.algebra.section("F_d"):
            return self.algebra.name("F_d", vector(*[-e for e in self.remaining()]))

    def remaining(self) -> list[Any]:
        """C_ddot with u_dot = 0, row by row."""
        return [r.remaining for r in self.rows]

    def C_scale(self) -> np.ndarray:
        """Factors that make every row a length, m; rows of unknown unit are divided by their gradient."""
        with self.algebra.section("scale of the constraints"):
            return vector(*[self.length / self.length ** POWERS[r.unit] if r.unit in POWERS else self._by_gradient(r)
                            for r in self.rows])

    def _by_gradient(self, row: Row) -> Any:
        apply = self.algebra.recorder.apply
        entries = [e / self.length if turning else e for e, turning in zip(row.jacobian, self.angular, strict=True)]
        square = inner(entries, entries)
        if not isinstance(square, kinds.Node):
            return 1 / self.algebra.sqrt(square)
        size = self.algebra.sqrt(apply("select", apply("gt", square, 0), square, 1))
        return 1 / size

    # -- accelerations and multipliers

    def saddle(self) -> SaddleSolver:
        """Solver of M x + C_r^T lam = f, C_r x = d."""
        return self._solver(SMOOTHED)

    def corrector(self) -> SaddleSolver:
        """The same for corrections."""
        return self._solver(DAMPED) if self.intrinsic else self.recall("saddle")  # type: ignore[no-any-return]

    def _solver(self, smoothed: float) -> SaddleSolver:
        if self.intrinsic:
            return IntrinsicSolver(self.algebra, self.recall("M_tilde"), self.C_r(), self.C_scale(), self._columns(), self.unheld,
                                   smoothed)
        kept = list(range(len(self.rows)) if self.independent is None else self.independent)
        C_r, names = self.C_r()[kept], [self.rows[k].name for k in kept]
        if self.pivots is not None:
            pivots = [(kept.index(row), column) for row, column in self.pivots]
            mixed = len(set(self.angular)) > 1
            columns = self._columns() if mixed else [1] * len(self.speeds)
            solver: SaddleSolver = NullSpaceSolver(self.algebra, self.recall("M_tilde"), C_r, pivots, names, self.speeds,
                                                   [self._least(k, mixed) for k in kept], columns, self.massless_pivots)
        else:
            solver = RangeSolver(self.algebra, self.recall("solver"), C_r, names, [self._least(k) for k in kept])
        return solver if self.independent is None else SubsetSolver(solver, kept, len(self.rows))

    def _right(self) -> np.ndarray:
        """F_d from the recursion that the equations need anyway; `F_d` itself is to be read."""
        return vector(*[-r.remaining for r in self.rows])

    def _least(self, k: int, scaled: bool = False) -> Any:
        """Square of a size of row k so small that it is no constraint any more: positions where it vanishes as a whole.

        scaled   columns of angular speeds are divided by the lever
        """
        row = self.rows[k]
        if row.unit not in POWERS:
            return 0
        turning = not scaled and all(is_zero(e) or turns for e, turns in zip(row.jacobian, self.angular, strict=True))
        natural = self.lever ** POWERS[row.unit] / (1 if turning else self.lever)
        return VANISHING**2 * (natural * natural)

    def _columns(self) -> list[Any]:
        return [1 / self.lever if turning else 1 for turning in self.angular]

    def solution(self) -> tuple[np.ndarray, np.ndarray]:
        """u_dot and lam."""
        right, saddle = -self.recall("bias"), self.recall("saddle")
        with self.algebra.section("accelerations and multipliers"):
            ud, lam = saddle.solve(right, self._right())
            return self.algebra.name("ud", ud), self.algebra.name("lam", lam)

    def accelerations(self) -> np.ndarray:
        return self.recall("solution")[0]  # type: ignore[no-any-return]

    def lam(self) -> np.ndarray:
        """Multipliers, (n_c,); where rows depend on the others those of least norm after scaling."""
        if self.independent is not None:
            left = -self.recall("bias") - self.recall("M_tilde") @ self.accelerations()
            return least_multipliers(self.algebra.recorder, self.C_r(), self.C_scale(), self._columns(), left, self.unheld)
        return self.recall("solution")[1]  # type: ignore[no-any-return]

    def matrix(self) -> np.ndarray:
        n_c = len(self.rows)
        C_r = self.C_r()
        return np.block([[self.recall("M_tilde"), C_r.T], [C_r, zeros(n_c, n_c)]])

    def right_side(self) -> np.ndarray:
        """[F_tilde - k_tilde; F_d], to be read."""
        forces = self.quantities()  # of the formulation that this is mixed into
        return np.concatenate([forces["F_tilde"]() - forces["k_tilde"](), self.F_d()])

    def implicit(self, baumgarte: bool = False) -> Implicit:
        """As for Motion, r = [M u_dot + k - F + C_r^T lam; C_r u_dot - F_d] with the multipliers held, too.

        baumgarte   of the accelerations with Baumgarte's stabilization
        """
        return *self.residual_of_unknowns(baumgarte), lambda right: self.solve_unknowns(right)[:len(self.speeds)]

    def residual_of_unknowns(self, baumgarte: bool = False) -> tuple[list[Any], dict[Any, Any]]:
        (ud, lam), C_r = self.recall("stabilized" if baumgarte else "solution"), self.C_r()
        held = [self.algebra.recorder.leaf(f"lam{k + 1}", kinds.SEED) for k in range(len(lam))]
        forces = self.inverse_dynamics() + (C_r.T @ vector(*held) if held else 0)
        residual = [*forces, *(C_r @ self.speed_rates - (self._pulled() if baumgarte else self._right()))]
        return residual, dict(zip([*self.speed_rates, *held], [*ud, *lam], strict=True))

    def unknowns(self) -> np.ndarray:
        """Accelerations and multipliers; where rows depend on each other, those of a solution."""
        return np.concatenate(self.recall("solution"))

    def along(self, group: str, baumgarte: bool = False) -> np.ndarray:
        """As for Motion, with multipliers."""
        return self.solved_along(group, *self.residual_of_unknowns(baumgarte))

    def solve_unknowns(self, right: np.ndarray) -> np.ndarray:
        n_u = len(self.speeds)
        return np.concatenate(self.recall("saddle").solve(right[:n_u], right[n_u:]))

    # -- staying on the manifold

    def position_correction(self) -> np.ndarray:
        """[C as lengths; dq]: one Newton step to C = 0, the smallest change in the mass metric, dq = N dv, C_r dv = -C."""
        saddle, scale = self.recall("corrector"), self.C_scale()
        with self.algebra.section("correction of the coordinates"):
            values = vector(*[r.value for r in self.rows])
            dv = saddle.solve(zeros(len(self.speeds)), -values)[0]
            along = dict(zip(self._leaves(self.speeds), dv, strict=True))
            dq = forward(self.algebra.recorder, self.rates, along)
            return vector(*(values * scale), *dq)

    def velocity_correction(self) -> np.ndarray:
        """[C_dot as lengths by time; du]: the smallest change in the mass metric that makes C_dot = 0."""
        saddle, scale = self.recall("corrector"), self.C_scale()
        with self.algebra.section("correction of the speeds"):
            rates = self.C_dot()
            du = saddle.solve(zeros(len(self.speeds)), -rates)[0]
            return vector(*(rates * scale), *du)

    def _pulled(self) -> np.ndarray:
        """F_d - 2 a C_dot - a^2 C; a is one more parameter, 1/s."""
        a = self.algebra.recorder.leaf(BAUMGARTE, kinds.PARAMETER)
        return vector(*[-r.remaining - 2 * a * r.rate - a * a * r.value for r in self.rows])

    def stabilized(self) -> tuple[np.ndarray, np.ndarray]:
        """u_dot and lam with Baumgarte's right side in place of F_d."""
        right, saddle = -self.recall("bias"), self.recall("saddle")
        with self.algebra.section("Baumgarte's stabilization"):
            return saddle.solve(right, self._pulled())

    def rhs_baumgarte(self) -> np.ndarray:
        """x_dot with F_d - 2 a C_dot - a^2 C in place of F_d."""
        return vector(*self.rates, *self.recall("stabilized")[0], *self.state_rates())

    def jacobian_x_baumgarte(self) -> np.ndarray:
        """Derivative of rhs_baumgarte by x."""
        return self.jacobian(self.x(), self.implicit(baumgarte=True))

    def residual(self) -> np.ndarray:
        """Residual of the stabilized index-2 form of Gear, Gupta and Leimkuhler (1985), for q_dot, u_dot, z_dot, lam, mu.

        q_dot = N (u + C_r^T mu) + n_t, M u_dot + k - F + C_r^T lam = 0, z_dot = rate, C = 0, C_dot = 0. Rows of velocity
        constraints have mu = 0 in place of C = 0. With Lam, Mu as states and lam, mu as their derivatives the index is 1.
        """
        recorder, leaves = self.algebra.recorder, self.algebra.leaves
        made = [recorder.leaf(name, kinds.ACCELERATION) for name in
                residual_names(self.coordinates, self.speeds, [z for z, _ in self.states], len(self.rows))]
        n_q, n_u, n_z, n_c = len(self.coordinates), len(self.speeds), len(self.states), len(self.rows)
        qd, ud, zd = made[:n_q], made[n_q:n_q + n_u], made[n_q + n_u:n_q + n_u + n_z]
        lam, mu = made[n_q + n_u + n_z:][:n_c], made[n_q + n_u + n_z + n_c:]
        C_r = self.C_r()
        tied = vector(*[m if r.holonomic else 0 for m, r in zip(mu, self.rows, strict=True)])
        moved = C_r.T @ tied if n_c else zeros(n_u)
        shift = forward(recorder, self.rates, dict(zip([leaves[u] for u in self.speeds], moved, strict=True)))
        at = dict(zip(self.speed_rates, ud, strict=True))
        tau = substitute(tuple(self.inverse_dynamics()), at, recorder)
        first = [a - b - c for a, b, c in zip(qd, self.rates, shift, strict=True)]
        second = [a + b for a, b in zip(tau, C_r.T @ vector(*lam) if n_c else zeros(n_u), strict=True)]
        third = [a - b for a, b in zip(zd, self.state_rates(), strict=True)]
        held = [r.value if r.holonomic else m for r, m in zip(self.rows, mu, strict=True)]
        return vector(*first, *second, *third, *held, *self.C_dot())


def residual_names(coordinates: Any, speeds: Any, states: Any, n_c: int) -> list[str]:
    """Names of what the residual takes in the group ud: q_dot, u_dot, z_dot, lam, mu."""
    return [*[f"d_{q.name}" for q in coordinates], *[f"d_{u.name}" for u in speeds], *[f"d_{z.name}" for z in states],
            *[f"lambda_{k + 1}" for k in range(n_c)], *[f"mu_{k + 1}" for k in range(n_c)]]
