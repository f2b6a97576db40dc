"""Inertial parameters from measured forces and motion, by linear least squares.

The forces along the speeds, less those of known loads, are linear in the base parameters, tau = Y_b pi_b, and in the ten inertial
parameters of every body, tau = Y pi, of which they determine fewer. Rows are weighted by the noise of the forces, estimated speed
by speed if it is not known, and by what the noise of the motion makes of it. Where loops are closed, or speeds constrained, the
forces of the constraints do no work along the motions that these allow: with columns Z that span these, Z^T tau = Z^T Y pi. Z
turns as little as can be from row to row, so that a filter may follow. Source: M. Gautier, Dynamic identification of robots
with power model, ICRA 1997; Khalil and Dombre, Modeling, Identification and Control of Robots, chapter 12.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from symdyn.errors import ArgumentError
from symdyn.estimation.allowed import allowed
from symdyn.estimation.estimate import combination, echelon
from symdyn.estimation.identification import Identification
from symdyn.estimation.measured_motion import MeasuredMotion, Rows, rows_of
from symdyn.estimation.pseudo_inertia import Chart, is_consistent, nearest
from symdyn.formulation.identification.regressor import PARAMETERS
from symdyn.kinds import flag
from symdyn.real_numbers import real_of
from symdyn.runtime.module import demand_module
from symdyn.shown import by_name, shown

if TYPE_CHECKING:
    from symdyn.given import Named, Row
    from symdyn.runtime.module import Module

# Singular values of the regressor with columns of length 1 below this part of the largest: the combination is not determined.
UNDETERMINED = 1e-9
# Shares of a parameter in such a combination from which on it is not determined itself.
TOUCHED = 1e-6
# Times that the noise is estimated from what is left.
ROUNDS = 4
# The widest spread: with wider ones Newton's method takes many steps, and the data say all there is to say long before.
WIDEST = 100.0
FRICTION = ("viscous", "coulomb")


def identify(module: Module, data: MeasuredMotion | Sequence[MeasuredMotion], *, noise: float | Named[float] | None = None,
             motion_noise: tuple[float | Row, float | Row, float | Row] | None = None, friction: Sequence[str] = (),
             consistent: bool = False, nominal: Mapping[str, Row] | None = None, spread: float = 30.0) -> Identification:
    """Inertial parameters from measured forces and motions of rigid bodies.

    data          an sd.MeasuredMotion, or several
    noise         standard deviation of the measured forces, N or N m, for all or by speed; None: estimated for each speed from
                  what is left
    motion_noise  standard deviations of measured q, u and ud, a number each or one for each entry, with which rows are weighted,
                  at the parameters of the module; it takes `noise`. Errors of the order of its square remain as a bias
    friction      of "viscous" and "coulomb": identified as well, for every speed: tau = ... + d u + c sign(u)
    consistent    False: the base parameters, by themselves. True: ten inertial parameters of every body that a distribution of
                  mass can have; of combinations that the data leave open those nearest to nominal ones
    nominal       of bodies, ten parameters about the origin of the body in its axes: m, h_x, h_y, h_z, I_xx, I_xy, I_xz, I_yy,
                  I_yz, I_zz with h = m r_G; default: those of the module's parameters
    spread        how far the inertias of bodies may be from nominal ones: the standard deviation of a relative change of the
                  pseudo-inertia (the weight of Bregman's divergence is 1/spread^2), at most 100. The default leaves what the
                  data say as good as unchanged

    Lengths, gravity and all other loads are taken from the parameters of the module and of each motion. Forces are those of the
    tree, zero along speeds that nothing drives: with constraints their noise has to be given, since these hide a part of it.
    Raises ArgumentError with all faults for what does not fit. See symdyn.estimation.identify and
    symdyn.estimation.pseudo_inertia for the sources.

    >>> module = sd.systems.pendulum().compile(backend="numpy")
    >>> q = np.linspace(0, 1, 20)[:, None]
    >>> tau = module.evaluate("inverse_dynamics", 0.0, np.hstack([q, q]), {"m": 2.0}, ud=q)
    >>> round(sd.identify(module, sd.MeasuredMotion(q[:, 0], q, tau, u=q, ud=q)).values["I_zz_bob"], 9)
    2.0
    """
    demand_module(module, "sd.identify")
    consistent = flag(consistent, "identify: consistent")
    _check_mechanism(module)
    faults: list[str] = []
    deviations = _noise(module, noise, faults)
    moving = _motion_noise(module, motion_noise, noise, faults)
    loss = _friction(friction, faults)
    if module.metadata.constraints:
        faults += [f"{what}, and the mechanism has constraints, whose forces hide {hidden}" for what, hidden, there in (
            ("noise is not given", "a part of it: give it", noise is None),
            ("motion_noise was given", "how it acts: leave it out", motion_noise is not None)) if there]
    charts = _charts(module, nominal, faults) if consistent else []
    if isinstance(spread, bool) or not isinstance(spread, (int, float, np.number)) or not 0 < spread <= WIDEST:
        faults.append(f"spread is {shown(spread)}; pass a positive number up to {WIDEST:g}")
    if nominal is not None and not consistent:
        faults.append("nominal inertias were given without consistent=True; base parameters have none")
    if faults:
        raise ArgumentError(f"{module.name}: {'; '.join(faults)}")
    motions = rows_of(module, data)
    if moving is not None and any(one.sos is not None for one in motions):
        raise ArgumentError(f"{module.name}: motion_noise was given for a motion with a cutoff, behind whose filter it is "
                            "another one; leave one of them out")
    names = [f"{entry}_{body}" for body in module.metadata.bodies for entry in PARAMETERS] if consistent else _base_names(module)
    labels = [*names, *[f"{kind} {speed}" for kind in loss for speed in module.metadata.u]]
    system = _System.of(module, motions, "regressor" if consistent else "base_regressor", loss, moving)
    if system.n < len(names):
        raise ArgumentError(f"{module.name}: {len(labels)} unknowns are identified from {system.n} values; measure more")
    result = _Solution.of(system, deviations, charts, float(spread))
    return Identification(module, dict(zip(labels, result.values.tolist(), strict=True)), result.covariance,
                          dict(zip(module.metadata.u, result.noise.tolist(), strict=True)), result.condition,
                          tuple(combination(v, labels) for v in echelon(result.open_ones)),
                          tuple(system.residuals(result.values)), consistent, result.degrees, noise is not None)


@dataclass(frozen=True)
class _System:
    """The rows of all motions: A (n_rows, n_u, n), y (n_rows, n_u), the gain of the filter (n_rows,), what the noise of the
    motion gives the forces, (n_rows, n_u, n_u) or None; where one motion ends and the next begins. With constraints A and y are
    along the r motions that these allow, whose speeds are allowed (n_rows, n_u, r), else None."""

    A: np.ndarray
    y: np.ndarray
    gain: np.ndarray
    moving: np.ndarray | None
    allowed: np.ndarray | None
    ends: list[int]

    @classmethod
    def of(cls, module: Module, motions: Sequence[Rows], name: str, friction: Sequence[str],
           moving: np.ndarray | None) -> _System:
        """From motions, with the regressor of this name."""
        free = allowed(module, motions) if module.metadata.constraints else [None] * len(motions)
        parts = [_rows(module, one, name, friction, Z) for one, Z in zip(motions, free, strict=True)]
        gains = np.concatenate([np.full(len(y), one.gain) for one, (_, y) in zip(motions, parts, strict=True)])
        noise = None if moving is None else np.concatenate([_of_motion(module, one, moving) for one in motions])
        kept = [one.kept(Z) for one, Z in zip(motions, free, strict=True) if Z is not None]
        return cls(np.concatenate([A for A, _ in parts]), np.concatenate([y for _, y in parts]), gains, noise,
                   np.concatenate(kept) if kept else None, np.cumsum([len(y) for _, y in parts])[:-1].tolist())

    @property
    def n(self) -> int:
        """Number of values."""
        return int(self.y.size)

    def residuals(self, values: np.ndarray) -> list[np.ndarray]:
        """Measured less computed forces of every motion."""
        return np.split(self.y - self.A @ values, self.ends)

    def weighted(self, noise: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """A (n, n_unknowns) and y (n,) with errors of deviation 1; noise: of the forces, (n_u,)."""
        sizes = noise * self.gain[:, None]
        if self.moving is None and self.allowed is None:
            A, y = self.A / sizes[:, :, None], self.y / sizes
        else:
            covariance = np.eye(len(noise)) * (sizes**2)[:, :, None] + (0.0 if self.moving is None else self.moving)
            if self.allowed is not None:
                covariance = np.swapaxes(self.allowed, 1, 2) @ covariance @ self.allowed
            roots = np.linalg.cholesky(covariance)
            both = np.linalg.solve(roots, np.concatenate([self.A, self.y[:, :, None]], axis=2))
            A, y = both[:, :, :-1], both[:, :, -1]
        return A.reshape(-1, A.shape[2]), y.ravel()


@dataclass(frozen=True)
class _Solution:
    """Values with covariance, the noise of the forces (n_u,), the condition, directions that are open (k, n), degrees of "
      "freedom."""

    values: np.ndarray
    covariance: np.ndarray
    noise: np.ndarray
    condition: float
    open_ones: np.ndarray
    degrees: int

    @classmethod
    def of(cls, system: _System, noise: np.ndarray | None, charts: list[Chart], spread: float) -> _Solution:
        """The solution; where the noise of the forces is not known with that which the best parameters without a prior leave."""
        n_u = system.y.shape[1]
        known = np.ones(n_u) if noise is None else noise
        least = 1e-14 * (float(np.sqrt(np.mean(system.y**2))) or 1.0)
        for _ in range(ROUNDS if noise is None else 0):
            free = cls._free(system, known)
            left = np.concatenate(system.residuals(free.values)) / system.gain[:, None]
            share = max(1.0, free.degrees / n_u)
            known = np.maximum(np.sqrt(np.sum(left**2, axis=0) / share), least)
        return cls._consistent(system, known, charts, spread) if charts else cls._free(system, known)

    @classmethod
    def _free(cls, system: _System, noise: np.ndarray) -> _Solution:
        """Without a prior; of what is open the solution of least norm, where columns have length 1."""
        A, y = system.weighted(noise)
        scale = 1 / _lengths(A)
        U, sizes, V = np.linalg.svd(A * scale, full_matrices=False)
        is_open, condition = _open(sizes)
        kept, left = V[~is_open], V[is_open]
        values = scale * (kept.T @ ((U.T @ y)[~is_open] / sizes[~is_open]))
        half = scale[:, None] * (kept.T / sizes[~is_open])
        covariance = half @ half.T
        touched = np.sum(left**2, axis=0) > TOUCHED
        covariance[touched, :] = covariance[:, touched] = np.nan
        return cls(values, covariance, noise, condition, left, len(y) - len(kept))

    @classmethod
    def _consistent(cls, system: _System, noise: np.ndarray, charts: list[Chart], spread: float) -> _Solution:
        """With a positive definite pseudo-inertia of every body.

        The covariance is that of the least squares with the prior as it is near the nominal values, without the border: errors
        are no larger, since what is nearest in a convex set is no farther from any of its points.
        """
        A, y = system.weighted(noise)
        n, n_bodies = A.shape[1], 10 * len(charts)
        T, origin = np.eye(n), np.zeros(n)
        for k, chart in enumerate(charts):
            at = slice(10 * k, 10 * k + 10)
            T[at, at], origin[at] = chart.T, chart.nominal
        scale = np.ones(n)
        scale[n_bodies:] = 1 / _lengths(A[:, n_bodies:])
        T = T * scale
        B = A @ T
        x = nearest(B, y - A @ origin, charts, 1 / spread**2)
        _, sizes, V = np.linalg.svd(B, full_matrices=False)
        is_open, condition = _open(sizes)
        root: np.ndarray = np.linalg.qr(np.vstack([B, np.eye(n)[:n_bodies] / spread])).R
        half = np.linalg.solve(root.T, T.T).T
        directions = V[is_open] @ T.T / np.sqrt(np.sum(T**2, axis=1))
        return cls(origin + T @ x, half @ half.T, noise, condition, directions, len(y) - int(np.sum(~is_open)))


def _lengths(A: np.ndarray) -> np.ndarray:
    """Lengths of columns, 1 of those that are zero."""
    lengths = np.linalg.norm(A, axis=0)
    return np.where(lengths > 0, lengths, 1.0)


def _open(sizes: np.ndarray) -> tuple[np.ndarray, float]:
    """Mask of the singular values that leave a combination open, and the condition of the others."""
    is_open = sizes <= UNDETERMINED * sizes[0] if len(sizes) and sizes[0] > 0 else np.ones(len(sizes), dtype=bool)
    return is_open, float(sizes[0] / sizes[~is_open].min()) if (~is_open).any() else np.inf


def _rows(module: Module, motion: Rows, name: str, friction: Sequence[str],
          Z: np.ndarray | None) -> tuple[np.ndarray, np.ndarray]:
    """A (n_rows, n_u, n) and y (n_rows, n_u) of a motion, behind its filter: forces less what loads of the system give; along
    the columns of Z (n_t, n_u, r), if there are constraints."""
    n_u, x, ud = module.metadata.sizes.u, motion.x, motion.ud
    parameters = "inertial_parameters" if name == "regressor" else "base_parameters"
    Y = module.evaluate(name, motion.t, x, motion.params, motion.inputs, ud).reshape(len(motion.t), n_u, -1)
    there = module.evaluate(parameters, motion.t[0], x[0], motion.params, motion.inputs[0])
    y = motion.tau + Y @ there - module.evaluate("inverse_dynamics", motion.t, x, motion.params, motion.inputs, ud)
    u = x[:, module.metadata.sizes.q:][:, :n_u]
    losses = [(np.sign(u) if kind == "coulomb" else u)[:, :, None] * np.eye(n_u) for kind in friction]
    A = np.concatenate([Y, *losses], axis=2)
    if Z is not None:
        A, y = np.swapaxes(Z, 1, 2) @ A, np.einsum("tur,tu->tr", Z, y)
    return motion.thinned(A), motion.thinned(y)


def _of_motion(module: Module, motion: Rows, deviations: np.ndarray) -> np.ndarray:
    """Covariance of the forces by the noise of the motion, (n_rows, n_u, n_u); deviations: of q, u and ud."""
    sizes = module.metadata.sizes
    J: Any = module.jacobian(motion.t, motion.x, motion.params, motion.inputs, ["x", "ud"], "inverse_dynamics", motion.ud)
    both = np.concatenate([J.x[:, :, :sizes.q + sizes.u], J.ud], axis=2) * deviations
    return both @ np.swapaxes(both, 1, 2)


def _base_names(module: Module) -> tuple[str, ...]:
    names: Any = getattr(module._provider, "base_names", None)
    if names is None:
        raise ArgumentError(f"{module.name}: this module was put together without equations, so the names of its base parameters "
                            "are unknown; compile equations")
    return tuple(names())


def _check_mechanism(module: Module) -> None:
    metadata = module.metadata
    if "regressor" not in module.functions:
        raise ArgumentError(f"{module.name}: there is no regressor, which takes rigid bodies without added mass; describe the "
                            "mechanism by bodies and joints (sd.System)")
    if metadata.implicit_loads:
        raise ArgumentError(f"{module.name}: the loads {', '.join(metadata.implicit_loads)} depend on accelerations, multipliers "
                            "or reactions, so that they are not known from the motion; leave them out")


def _noise(module: Module, given: Any, faults: list[str]) -> np.ndarray | None:
    if given is None:
        return None
    speeds = module.metadata.u
    each = by_name(given if isinstance(given, Mapping) else dict.fromkeys(speeds, given))
    faults += [f"noise has {shown(name)}, which is no speed; there are {', '.join(speeds)}" for name in each
               if name not in speeds]
    faults += [f"noise of {name} is missing" for name in speeds if name not in each]
    for name in speeds:
        value = each.get(name, 1.0)
        if isinstance(value, bool) or not isinstance(value, (int, float, np.number)) or not 0 < value < np.inf:
            faults.append(f"noise of {name} is {shown(value)}; it must be a positive number")
            each[name] = 1.0
    return np.array([float(each.get(name, 1.0)) for name in speeds])


def _motion_noise(module: Module, given: Any, noise: Any, faults: list[str]) -> np.ndarray | None:
    """Deviations of [q; u; ud]."""
    if given is None:
        return None
    if noise is None:
        faults.append("motion_noise was given without noise; what both leave cannot be distinguished, give the noise of the "
                      "forces, too")
    sizes = module.metadata.sizes
    if not isinstance(given, (list, tuple)) or len(given) != 3:
        faults.append(f"motion_noise is {shown(given)}; pass deviations of q, of u and of ud")
        return None
    parts = []
    for what, value, n in zip(("q", "u", "ud"), given, (sizes.q, sizes.u, sizes.u), strict=True):
        numbers = real_of(value, module.name, f"motion_noise of {what} must be numbers")
        if numbers.shape not in ((), (n,)) or not np.isfinite(numbers).all() or (numbers < 0).any():
            faults.append(f"motion_noise of {what} is {shown(value)}; pass a number, or {n}, none negative")
            numbers = np.zeros(n)
        parts.append(np.broadcast_to(numbers, (n,)))
    return np.concatenate(parts)


def _friction(given: Any, faults: list[str]) -> tuple[str, ...]:
    if not isinstance(given, (str, list, tuple)):
        faults.append(f"friction is {shown(given)}; pass a list of {' and '.join(FRICTION)}")
        return ()
    listed = [given] if isinstance(given, str) else list(given)
    faults += [f"friction has {shown(one)}; there are {' and '.join(FRICTION)}" for one in listed if one not in FRICTION]
    return tuple(kind for kind in FRICTION if kind in listed)


def _charts(module: Module, given: Any, faults: list[str]) -> list[Chart]:
    """Coordinates about the nominal inertia of every body."""
    bodies, start = module.metadata.bodies, np.zeros(module.metadata.sizes.x)
    if given is not None and not isinstance(given, Mapping):
        faults.append(f"nominal is {shown(given)}; pass a dictionary from bodies to ten numbers each")
        return []
    own = by_name(given)
    faults += [f"nominal has {shown(name)}, which is no body; there are {', '.join(bodies)}" for name in own
               if name not in bodies]
    start[:] = list(module.metadata.initial_values("x").values())
    default = module.evaluate("inertial_parameters", 0.0, start).reshape(len(bodies), 10)
    charts = []
    for body, values in zip(bodies, default, strict=True):
        numbers = real_of(own.get(body, values), module.name, f"nominal values of {body} must be numbers")
        if numbers.shape != (10,) or not np.isfinite(numbers).all():
            faults.append(f"nominal values of {body} have the shape {numbers.shape}; pass ten finite numbers: "
                          f"{', '.join(PARAMETERS)}")
        elif not is_consistent(numbers):
            faults.append(f"no body can have the nominal inertia of {body}, {_text(numbers)}: its pseudo-inertia is not positive "
                          f"definite; pass nominal={{{body!r}: [m, h_x, h_y, h_z, I_xx, I_xy, I_xz, I_yy, I_yz, I_zz]}}")
        else:
            charts.append(Chart(numbers))
    return charts


def _text(numbers: np.ndarray) -> str:
    return ", ".join(f"{name} = {value:.4g}" for name, value in zip(PARAMETERS, numbers.tolist(), strict=True))
