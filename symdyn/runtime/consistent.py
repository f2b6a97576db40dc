"""States that fulfil the constraints: checks of an initial state, and the nearest consistent one.

Positions by a damped Gauss-Newton method whose steps are the smallest in the metric of the mass matrix, by singular values
so that dependent constraints do no harm; speeds by one such projection, since the constraints are linear in them.
Source: Nocedal and Wright, Numerical Optimization, section 10.3; Garcia de Jalon and Bayo, Kinematic and Dynamic Simulation
of Multibody Systems, chapter 3.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from symdyn.arguments import take
from symdyn.errors import ArgumentError, EvaluationError
from symdyn.real_numbers import NotReal
from symdyn.real_numbers import number as double
from symdyn.runtime.constraints import (
    CONSISTENT,
    as_velocities,
    length,
    listed,
    names,
    position_residual,
    velocity_residual,
)
from symdyn.runtime.inputs.inputs import inputs_at
from symdyn.shown import name_of, shown
from symdyn.tape.intrinsics import MASSLESS, RANK

if TYPE_CHECKING:
    from symdyn.runtime.module import Module

_ITERATIONS = 100
_SOLVED = 1e-13
_GOOD = 1e-10
# Singular values below this part of the largest are left out of a step.
_CUT = 1e-9
_RESTARTS = 8


class NotConsistent(ArgumentError):
    """A start violates the constraints; `found` says which and by how much, the message also what to do."""

    def __init__(self, result: str, advice: str = "") -> None:
        super().__init__(result, advice)
        self.found = result

    def __str__(self) -> str:
        return "; ".join(filter(None, self.args))


def normalised(module: Module, x: np.ndarray) -> np.ndarray:
    """The state with unit vectors of length 1; raises ArgumentError if they are off by more than rounding of input."""
    for group in module.metadata.unit_groups:
        indices = [module.metadata.x.index(name) for name in group]
        norm = float(np.linalg.norm(x[indices]))
        if abs(norm - 1) > 1e-6:
            raise ArgumentError(f"{module.name}: initial q: {', '.join(group)} have the norm {norm:.6g}, not 1; Euler parameters "
                                "are a unit vector: divide them by their norm")
        x[indices] /= norm
    return x


def check_start(module: Module, t: float, x: np.ndarray, params: np.ndarray) -> None:
    """Raise NotConsistent, which names the violated constraints, if a state is not consistent."""
    if not names(module):
        return
    faults = []
    for what, residual, unit in (
            ("positions", position_residual(module, t, x, params), "of the mechanism's length"),
            ("speeds", velocity_residual(module, t, x, params, 1e-9 * length(module, params)), "of its speed")):
        if (np.abs(residual) > CONSISTENT).any():
            faults.append(f"the initial {what} violate {listed(module, residual, CONSISTENT)} ({unit})")
    if faults:
        raise NotConsistent(f"{module.name}: {'; '.join(faults)}", advice(module, t))


def advice(module: Module, t: float) -> str:
    """Advice about a start that is not consistent."""
    return (f"begin with the nearest consistent state: q, u = module.consistent(q, u, params{f', t={t:g}' if t else ''}"
            f"{', inputs=inputs' if module.metadata.motions else ''})")


def consistent(module: Module, q: Any = None, u: Any = None, params: Any = None, t: float = 0.0,
               keep: Collection[Any] | None = (), inputs: Any = None) -> tuple[np.ndarray, np.ndarray]:
    """The consistent state near a guess: q (n_q,) and u (n_u,); see Module.consistent."""
    metadata = module.metadata
    p = module.parameters(params)
    initial = metadata.initial
    q0, u0 = (take(values, metadata.names(what), what, metadata.initial_values(what), module.name)
              for what, values in (("q", q), ("u", u)))
    x = np.concatenate([q0, u0, list(metadata.initial_values("z").values())])
    t = number(t, "a finite number of seconds as t", module.name)
    if keep is None:
        keep = ()
    elif isinstance(keep, str) or hasattr(keep, "name"):
        keep = (keep,)
    elif not isinstance(keep, Iterable):
        raise ArgumentError(f"{module.name}: pass coordinates and speeds as keep, by name or symbol, or None for none of them, "
                            f"found {shown(keep)}")
    if getattr(keep, "ndim", 1) == 0:
        raise ArgumentError(f"{module.name}: keep is {shown(keep)}; pass a list of names or symbols")
    kept = [name_of(k) for k in keep]
    unknown = [k for k in kept if k not in metadata.q and k not in metadata.u]
    if unknown:
        known = ", ".join([*metadata.q, *metadata.u])
        raise ArgumentError(f"{module.name}: keep names {', '.join(unknown)}; there are {known}")
    x = normalised(module, x)
    if not names(module):
        return x[:len(q0)], x[len(q0):len(q0) + len(u0)]
    if inputs is not None:
        module = module.following(inputs_at(inputs, t, metadata.inputs, initial, module.name, metadata.motions))
    search = _Search(module, t, p, kept)
    x = search.speeds(search.positions(x))
    return x[:len(q0)], x[len(q0):len(q0) + len(u0)]


def on_constraints(module: Module, t: float, x: np.ndarray, params: np.ndarray) -> np.ndarray:
    """The state with its coordinates moved onto the constraints, speeds as they are. Raises ArgumentError as `consistent`."""
    return _Search(module, t, params, []).positions(x)


def closest(module: Module, t: float, x: np.ndarray, params: np.ndarray, keep: Sequence[str] = ()) -> np.ndarray:
    """The consistent state near x; keep: names of coordinates and speeds that stay. Raises ArgumentError as `consistent`."""
    search = _Search(module, t, params, list(keep))
    return search.speeds(search.positions(x))


def smallest_acceleration(module: Module, t: float, x: np.ndarray, params: np.ndarray, ud: np.ndarray,
                          gaps: np.ndarray, keep: Sequence[str] = ()) -> np.ndarray:
    """The accelerations near ud (n_u,) with C_scale C_r u_dot = C_scale C_r ud + gaps, by the smallest change in the metric of
    the mass matrix; keep: names of speeds whose rates stay. Raises ArgumentError where there are none.
    """
    search = _Search(module, t, params, list(keep))
    J = module.evaluate("C_r", t, x, params) * module.evaluate("C_scale", t, x, params)[:, None]
    free = np.eye(search.n_u)[:, [k for k in range(search.n_u) if k not in search.kept_u]]
    change = search.smallest(x, J, gaps, free)
    result = ud if change is None else ud + change
    left = gaps - J @ (result - ud)
    # Gaps may be rounding themselves: what counts is the size of the terms, which they are a part of.
    terms = np.abs(J) @ np.abs(ud) + np.abs(module.evaluate("F_d", t, x, params) * module.evaluate("C_scale", t, x, params))
    size = float(np.maximum(terms, np.abs(gaps)).max(initial=0.0))
    if (np.abs(left) > _GOOD * size).any():
        kept = f" with those of {', '.join(keep)} kept" if keep else ""
        raise ArgumentError(f"{module.name}: no accelerations fulfil the constraints here{kept}: the nearest violate "
                            f"{listed(module, left, _GOOD * size)} (m/s^2); the position is singular, constraints contradict "
                            "each other, or too much is kept")
    return result


def number(value: Any, what: str, owner: str) -> float:
    """A finite number; raises ArgumentError, with `what` as what to pass, for anything else."""
    try:
        result = double(value)
    except NotReal as error:
        raise ArgumentError(f"{owner}: pass {what}, found {shown(value)}: {error}") from None
    if not np.isfinite(result):
        raise ArgumentError(f"{owner}: pass {what}, found {shown(value)}")
    return result


class _Search:
    """Searches of one call: time, parameters and what must stay are fixed."""

    def __init__(self, module: Module, t: float, p: np.ndarray, keep: list[str]) -> None:
        self.module, self.t, self.p, self.keep = module, t, p, keep
        self.n_q, self.n_u = module.metadata.sizes.q, module.metadata.sizes.u
        self.kept_q = [k for k, name in enumerate(module.metadata.q) if name in keep]
        self.kept_u = [k for k, name in enumerate(module.metadata.u) if name in keep]
        self.holonomic = np.array(module.metadata.holonomic or [True] * len(names(module)), dtype=bool)
        self.length = length(module, p)
        self.velocities = as_velocities(module, p)

    def positions(self, x: np.ndarray) -> np.ndarray:
        """The state with q moved onto the constraints."""
        best, least = x, np.inf
        random = np.random.default_rng(1)
        for attempt in range(_RESTARTS + 1):
            # Where steps do not reduce the residual, such as in a stretched position, a nearby start leads on.
            shift = 0.05 * attempt * self.length / self.velocities * random.standard_normal(self.n_u)
            start = x if attempt == 0 else self._moved(x, shift)
            result = self._gauss_newton(start)
            left = self._left(result)
            if left <= _GOOD:
                return result
            if left < least:
                best, least = result, left
        self._reject("positions", position_residual(self.module, self.t, best, self.p))
        raise AssertionError

    def _gauss_newton(self, x: np.ndarray) -> np.ndarray:
        merit = self._merit(x)
        for _ in range(_ITERATIONS):
            if self._left(x) <= _SOLVED:
                break
            dv = self._step(x)
            if dv is None:
                break
            largest = float(np.abs(dv * self.velocities).max(initial=0.0)) / self.length
            h = min(1.0, 1.0 / largest) if largest > 0 else 1.0  # at most about a radian at once
            while h > 1e-6:
                trial = self._moved(x, h * dv)
                value = self._merit(trial)
                if value < (1 - 1e-4 * h) * merit:
                    break
                h /= 2
            else:
                break
            x, merit = trial, value
        return x

    def _left(self, x: np.ndarray) -> float:
        """Largest residual, relative to the length."""
        return float(np.abs(self._residual(x)).max(initial=0.0))

    def _merit(self, x: np.ndarray) -> float:
        return float(np.linalg.norm(self._residual(x)))

    def _residual(self, x: np.ndarray) -> np.ndarray:
        try:
            return position_residual(self.module, self.t, x, self.p)
        except EvaluationError:
            return np.array([np.inf])

    def _moved(self, x: np.ndarray, dv: np.ndarray) -> np.ndarray:
        """The state after the velocities dv (n_u,) for a unit of time; what must stay stays to the last bit."""
        free = self._free(x)
        dv = free @ (free.T @ dv)
        moved = x.copy()
        moved[:self.n_q] += self._evaluate("N", x) @ dv
        moved[self.kept_q] = x[self.kept_q]
        for group in self.module.metadata.unit_groups:
            indices = [self.module.metadata.x.index(name) for name in group]
            if not set(indices) & set(self.kept_q):
                moved[indices] /= np.linalg.norm(moved[indices])
        return moved

    def _step(self, x: np.ndarray) -> np.ndarray | None:
        """The velocities (n_u,) of a Gauss-Newton step."""
        J, scale = self._evaluate("C_r", x), self._evaluate("C_scale", x)
        C = self._evaluate("C", x)
        rows = self.holonomic
        return self.smallest(x, (J * scale[:, None])[rows], -(C * scale)[rows], self._free(x))

    def speeds(self, x: np.ndarray) -> np.ndarray:
        """The state with u projected onto the constraints."""
        scale = self._evaluate("C_scale", x)
        J = self._evaluate("C_r", x) * scale[:, None]
        free = np.eye(self.n_u)[:, [k for k in range(self.n_u) if k not in self.kept_u]]
        guess = float(np.abs(x[self.n_q:self.n_q + self.n_u] * self.velocities).max(initial=0.0))
        for _ in range(3):
            du = self.smallest(x, J, -self._evaluate("C_dot", x) * scale, free)
            if du is None:
                break
            x = x.copy()
            x[self.n_q:self.n_q + self.n_u] += du
        residual = velocity_residual(self.module, self.t, x, self.p, guess)  # the result may well be rest
        if (np.abs(residual) > _GOOD).any():
            self._reject("speeds", residual)
        u = x[self.n_q:self.n_q + self.n_u]
        u[np.abs(u * self.velocities) <= 1e-15 * guess] = 0.0
        return x

    def smallest(self, x: np.ndarray, J: np.ndarray, right: np.ndarray, free: np.ndarray) -> np.ndarray | None:
        """The dv (n_u,) in the columns of `free` with J dv = right, as well as it can be, smallest in the metric of the mass.

        dv = B y with |y| the size of dv as a velocity, m/s: of all y that solve the constraints, y_p the shortest and Z the
        directions that they leave, y = y_p - Z (Z^T M Z)^+ Z^T M y_p has the least kinetic energy; along directions that move no
        mass it is the shortest. Nothing is added to the mass matrix: speeds before an impact become those after it.
        """
        if free.shape[1] == 0 or len(J) == 0:
            return None
        B = free @ np.linalg.inv(np.linalg.cholesky(free.T @ np.diag(self.velocities**2) @ free)).T
        U, values, Vt = np.linalg.svd(J @ B)
        if not values.size or values[0] == 0:
            return None
        rank = int((values > _CUT * values[0]).sum())
        y = Vt[:rank].T @ ((U[:, :rank].T @ right) / values[:rank])
        Z = Vt[rank:].T
        M = B.T @ self._evaluate("mass_matrix", x) @ B
        masses, along = np.linalg.eigh(Z.T @ M @ Z)
        largest = float(np.abs(np.linalg.eigvalsh(M)).max(initial=0.0))
        if masses.size and masses[0] >= -MASSLESS * largest:  # a mass matrix that is not even positive has no least energy
            heavy = masses > MASSLESS * largest
            y = y - Z @ (along[:, heavy] @ ((along[:, heavy].T @ (Z.T @ (M @ y))) / masses[heavy]))
        return free @ (free.T @ (B @ y))

    def _free(self, x: np.ndarray) -> np.ndarray:
        """Columns: velocities that leave the kept coordinates as they are, orthonormal, (n_u, n)."""
        if not self.kept_q:
            return np.eye(self.n_u)
        _, values, Vt = np.linalg.svd(self._evaluate("N", x)[self.kept_q])
        rank = int((values > RANK * max(values.max(initial=0.0), 1e-300)).sum())
        basis: np.ndarray = Vt[rank:].T
        return basis

    def _evaluate(self, name: str, x: np.ndarray) -> np.ndarray:
        return self.module.evaluate(name, self.t, x, self.p)

    def _reject(self, what: str, residual: np.ndarray) -> None:
        kept = f" with {', '.join(self.keep)} kept" if self.keep else ""
        advice = ("let go of one of them in keep, or begin" if self.keep else "begin") + " with another guess, or check lengths"
        raise ArgumentError(f"{self.module.name}: no consistent {what} found near the guess{kept}: the nearest violate "
                            f"{listed(self.module, residual, _GOOD)} (relative to the mechanism's "
                            f"{'length' if what == 'positions' else 'speed'}); {advice}")
