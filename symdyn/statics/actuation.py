"""Inverse dynamics by the inputs of a mechanism: which inputs, and which multipliers of constraints, make a given motion.

M u_dot + k - F(inputs) + C_r^T lam = 0. With the columns of Z the velocities that the constraints allow, the multipliers drop
out: Z^T F(inputs) = Z^T (M u_dot + k). Inputs of least norm fulfil it where there are more of them than freedoms; then
C_r^T lam = F - M u_dot - k has a solution. Forces along angular speeds are divided by the mechanism's natural length, so that
ranks do not depend on units.
Source: Nakamura and Ghodoussi, Dynamics computation of closed-link robot mechanisms with nonredundant and redundant actuators,
IEEE Trans. Robotics and Automation 5 (1989); inputs that enter nonlinearly: Newton's method, Nocedal and Wright, Numerical
Optimization, chapter 11.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, NoReturn

import numpy as np

from symdyn.arguments import some, take
from symdyn.errors import ArgumentError, EvaluationError
from symdyn.runtime.consistent import NotConsistent, check_start, closest, normalised, number, smallest_acceleration
from symdyn.runtime.constraints import CONSISTENT, counted, listed, names, unique
from symdyn.runtime.inputs.following import motion_inputs
from symdyn.runtime.labelled import Labelled
from symdyn.runtime.masses import real_parameters
from symdyn.shown import name_of
from symdyn.statics.manifold import natural_length, natural_scales
from symdyn.statics.selection import listed as named
from symdyn.statics.terms import OperatingPoint, coordinate_names
from symdyn.turning import force_unit

if TYPE_CHECKING:
    from symdyn.given import Key
    from symdyn.runtime.module import Module

# Forces that no input makes may be this part of the single terms of the equations: rounding of motions that inputs do make.
MADE = 1e-9
# Singular values of the scaled input matrix below this part of the largest are zero.
DRIVES = 1e-9
# Newton's method: steps tried, smallest share of a step.
ROUNDS, SMALLEST_STEP = 60, 1e-4
# Where the inputs' initial values have no effect, as those of a square have at zero, the search begins at these.
STARTS = (1.0, 30.0, 1000.0)
# Coordinates that a message names: those with this share of the square of a direction.
SHARE = 0.05


@dataclass(frozen=True, eq=False)
class Actuation:
    """The inputs that make a motion, and the multipliers of its constraints.

    t, q (n_q,), u (n_u,), ud (n_u,)   the motion, as given, or as projected onto the constraints
    inputs        (n_in,), by name or in order, in their units; kept: names of those that were given
    multipliers   (n_c,), by the name of the constraint or in order; those of least norm where they are not unique
    determined    names of the multipliers that are unique
    residuals     (n_u,) of M u_dot + k - F + C_r^T lam by speed, N or N m; residual: the largest of them
    freedoms      independent speeds that the constraints leave; rank: how many of them the inputs that were sought drive
    condition     of the input matrix with columns of length 1, along what it drives; 1 without inputs

    >>> x, tau = sd.coordinates("x"), sd.inputs("tau")
    >>> system = sd.System("cart")
    >>> cart = system.add_body("cart", mass=1)
    >>> system.add_joint_force(system.add_joint(sd.Prismatic("rail", system.ground, cart, x, axis=[1, 0])), tau)
    >>> force = system.compile(backend="numpy").actuation(0.0, q=[0.0], u=[0.0], ud=[3.0])
    >>> force["tau"], force.unique
    (3.0, True)
    """

    module: Module
    t: float
    q: np.ndarray
    u: np.ndarray
    ud: np.ndarray
    inputs: Labelled
    kept: tuple[str, ...]
    multipliers: Labelled
    determined: tuple[str, ...]
    residuals: Labelled
    freedoms: int
    rank: int
    condition: float

    @property
    def residual(self) -> float:
        """Largest force or moment that is left, N or N m.

        >>> x, tau = sd.coordinates("x"), sd.inputs("tau")
        >>> system = sd.System("cart")
        >>> cart = system.add_body("cart", mass=1)
        >>> system.add_joint_force(system.add_joint(sd.Prismatic("rail", system.ground, cart, x, axis=[1, 0])), tau)
        >>> force = system.compile(backend="numpy").actuation(0.0, q=[0.0], u=[0.0], ud=[3.0])
        >>> force.residual
        0.0
        """
        return float(np.abs(np.asarray(self.residuals)).max(initial=0.0))

    @property
    def lam(self) -> np.ndarray:
        """Multipliers in order, (n_c,); the force of the constraints is -C_r^T lam.

        >>> x, tau = sd.coordinates("x"), sd.inputs("tau")
        >>> system = sd.System("cart")
        >>> cart = system.add_body("cart", mass=1)
        >>> system.add_joint_force(system.add_joint(sd.Prismatic("rail", system.ground, cart, x, axis=[1, 0])), tau)
        >>> force = system.compile(backend="numpy").actuation(0.0, q=[0.0], u=[0.0], ud=[3.0])
        >>> force.lam.shape
        (0,)
        """
        return np.asarray(self.multipliers)

    @property
    def found(self) -> tuple[str, ...]:
        """Names of the inputs that were sought.

        >>> x, tau = sd.coordinates("x"), sd.inputs("tau")
        >>> system = sd.System("cart")
        >>> cart = system.add_body("cart", mass=1)
        >>> system.add_joint_force(system.add_joint(sd.Prismatic("rail", system.ground, cart, x, axis=[1, 0])), tau)
        >>> force = system.compile(backend="numpy").actuation(0.0, q=[0.0], u=[0.0], ud=[3.0])
        >>> force.found
        ('tau',)
        """
        return tuple(n for n in self.inputs.names[0] if n not in self.kept)

    @property
    def unique(self) -> bool:
        """Uniqueness: no other values of the inputs that were sought make the motion (near these, where they enter nonlinearly).

        >>> x, tau = sd.coordinates("x"), sd.inputs("tau")
        >>> system = sd.System("cart")
        >>> cart = system.add_body("cart", mass=1)
        >>> system.add_joint_force(system.add_joint(sd.Prismatic("rail", system.ground, cart, x, axis=[1, 0])), tau)
        >>> force = system.compile(backend="numpy").actuation(0.0, q=[0.0], u=[0.0], ud=[3.0])
        >>> force.unique
        True
        """
        return self.rank == len(self.found)

    def __getitem__(self, name: Key) -> float:
        """An input or a multiplier by name or symbol. Raises ArgumentError for an unknown name."""
        known = name_of(name)
        for values in (self.inputs, self.multipliers):
            if known in values.names[0]:
                return float(values[known])
        raise ArgumentError(f"{self.module.name}: there is no input or constraint {known!r}; there are "
                            f"{', '.join([*self.inputs.names[0], *self.multipliers.names[0]]) or 'none'}")

    def describe(self) -> str:
        """Inputs with units, multipliers, what is left, rank and condition, as a table.

        >>> x, tau = sd.coordinates("x"), sd.inputs("tau")
        >>> system = sd.System("cart")
        >>> cart = system.add_body("cart", mass=1)
        >>> system.add_joint_force(system.add_joint(sd.Prismatic("rail", system.ground, cart, x, axis=[1, 0])), tau)
        >>> force = system.compile(backend="numpy").actuation(0.0, q=[0.0], u=[0.0], ud=[3.0])
        >>> print(force.describe())
        cart: inputs that make the motion at t = 0 s, unique
          tau  =               3 N
        residual 0 N or N m, rank 1 of 1 freedoms, condition 1
        """
        units = self.module.metadata.units
        known = [*self.inputs.names[0], *self.multipliers.names[0]]
        width = max([4, *map(len, known)])
        many = "unique" if self.unique else f"those of least norm of {len(self.found)} for {self.rank} freedoms"
        lines = [f"{self.module.name}: inputs that make the motion at t = {self.t:.9g} s, {many}"]
        for name, value in zip(self.inputs.names[0], self.inputs, strict=True):
            note = "  kept" if name in self.kept else ""
            lines.append(f"  {name:<{width}} = {value + 0.0:>15.8g} {units.get(name, '')}{note}".rstrip())
        lines += ["multipliers of the constraints, whose force is -C_r^T lambda"] if self.multipliers.names[0] else []
        for name, value in zip(self.multipliers.names[0], self.multipliers, strict=True):
            note = "" if name in self.determined else " least norm: dependent constraints share it"
            lines.append(f"  {name:<{width}} = {value + 0.0:>15.8g}{note}".rstrip())
        lines.append(f"residual {self.residual:.3g} N or N m, rank {self.rank} of {self.freedoms} freedoms, condition "
                     f"{self.condition:.3g}")
        return "\n".join(lines)

    def __repr__(self) -> str:
        return self.describe()


def actuation(module: Module, t: float, q: Any, u: Any, ud: Any, params: Any, inputs: Any, z: Any, start: Any,
              project: bool, keep: Sequence[Any]) -> Actuation:
    """See Module.actuation."""
    metadata = module.metadata
    time = number(t, "a finite number of seconds as t", module.name)
    p = real_parameters(module, params)
    groups = [take(values, metadata.names(group), group, metadata.initial_values(group), module.name)
              for group, values in (("q", q), ("u", u), ("z", z))]
    rates = take(ud, metadata.u, "ud", dict.fromkeys(metadata.u, 0.0), module.name)
    given, guess = _inputs(module, inputs, "inputs"), _inputs(module, start, "start")
    values = np.array([given.get(n, guess.get(n, metadata.initial.get(n, 0.0))) for n in metadata.inputs], dtype=float)
    x = normalised(module, np.concatenate(groups))
    module = module.following(values)
    kept = list(named(keep, [*metadata.q, *metadata.u], "keep", module.name)) if project or len(keep) else []
    if kept and not project:
        raise ArgumentError(f"{module.name}: keep names what stays in a projection; pass project=True, too, or leave it out")
    if project:
        x = closest(module, time, x, p, kept) if names(module) else x
    else:
        _demand_consistent(module, time, x, p)
    point = OperatingPoint(module, time, x, p, values, rates, np.zeros(len(names(module))))
    gaps = point.balance[point.parts["C_ddot"]] * point.scale
    if project and len(gaps):
        point = point.at(ud=smallest_acceleration(module, time, x, p, rates, -gaps, kept))
    else:
        _demand_accelerations(point, gaps)
    motions = motion_inputs(metadata)
    free = [k for k, n in enumerate(metadata.inputs) if n not in {*given, *motions}]
    return _Balance(point, free).solved((*given, *motions))


def input_matrix(module: Module, t: Any, x: Any, params: Any, inputs: Any) -> Labelled:
    """See Module.input_matrix."""
    metadata, units = module.metadata, module.metadata.units
    state = take(x, metadata.x, "x", metadata.initial_values("x"), module.name)
    given = module.evaluate("input_matrix", t, state, params, inputs) if metadata.inputs else np.zeros((len(metadata.u), 0))
    forces = {u: force_unit(units.get(u, "")) for u in metadata.u}
    return Labelled(given, metadata.u, metadata.inputs,
                    units={**forces, **{n: units.get(n, "") for n in metadata.inputs}})


def _inputs(module: Module, values: Any, what: str) -> dict[str, float]:
    """Inputs by name; all of them, if they are given in order."""
    known = module.metadata.inputs
    if values is None or isinstance(values, Mapping):
        return some(values, known, what, module.name)
    if np.size(values) == 0:
        return {}
    return dict(zip(known, take(values, known, what, {}, module.name).tolist(), strict=True))


def _demand_consistent(module: Module, t: float, x: np.ndarray, p: np.ndarray) -> None:
    """Raises ArgumentError for positions and speeds that violate the constraints."""
    try:
        check_start(module, t, x, p)
    except NotConsistent as error:
        result = error.found.replace("the initial positions", "the positions q").replace("the initial speeds", "the speeds u")
        raise ArgumentError(f"{result}; no forces make such a motion: take q, u = module.consistent(q, u, params), or pass "
                            "project=True, which moves q, u and ud by as little as possible onto the constraints") from None


def _demand_accelerations(point: OperatingPoint, gaps: np.ndarray) -> None:
    """Raises ArgumentError for accelerations that violate the constraints; gaps: C_ddot as lengths, m/s^2."""
    if not len(gaps):
        return
    sizes = np.abs(point.C_r) @ np.abs(point.ud) + np.abs(point.evaluate("F_d") * point.scale)
    size = float(sizes.max(initial=0.0))
    if size > 0 and (np.abs(gaps) > CONSISTENT * size).any():
        raise ArgumentError(f"{point.module.name}: the accelerations ud violate {listed(point.module, gaps, CONSISTENT * size)} "
                            "(m/s^2); no forces make such a motion: differentiate one that fulfils the constraints, or pass "
                            "project=True, which moves q, u and ud by as little as possible onto the constraints")


class _Balance:
    """M u_dot + k - F + C_r^T lam along natural directions, for inputs that are sought at the indices `free`."""

    def __init__(self, point: OperatingPoint, free: Sequence[int]) -> None:
        self.point, self.free = point, list(free)
        self.scales = natural_scales(point)
        self.most = 0  # freedoms that the sought inputs drive at some of the values tried
        U, values, Vt = np.linalg.svd(point.C_r * self.scales)
        r = int(counted(values).sum()) if values.size else 0
        self.U, self.values, self.V = U[:, :r], values[:r], Vt[:r].T
        self.Z = Vt[r:].T  # (n_u, freedoms), of naturally scaled speeds
        inertia = np.abs(point.M) @ np.abs(point.ud)
        acting = inertia + np.abs(point.at(ud=np.zeros_like(point.ud)).forces) + np.abs(self.forces(point))
        self.least = float((acting * self.scales).max(initial=0.0))

    def forces(self, point: OperatingPoint) -> np.ndarray:
        """Forces of the sought inputs, as they are, if linear; (n_u,)."""
        result: np.ndarray = self.matrix(point) @ point.inputs[self.free]
        return result

    def matrix(self, point: OperatingPoint) -> np.ndarray:
        """Derivative of the generalized forces by the sought inputs, (n_u, n)."""
        result: np.ndarray = point.evaluate("input_matrix")[:, self.free] if self.free else np.zeros((len(point.u), 0))
        return result

    def left(self, point: OperatingPoint) -> np.ndarray:
        """Forces along the freedoms, (freedoms,), N."""
        result: np.ndarray = self.Z.T @ (self.scales * point.forces)
        return result

    def solved(self, kept: tuple[str, ...]) -> Actuation:
        """The inputs that make the motion, and what belongs to them. Raises ArgumentError where there are none."""
        point = self._searched()
        drive = _Drive(self.Z.T @ (self.scales[:, None] * self.matrix(point)))
        _demand_linear(self, drive)
        tau = point.forces
        lam = point.scale * (self.U @ ((self.V.T @ (-self.scales * tau)) / self.values))
        point = point.at(lam=lam)
        module = point.module
        metadata, rows = module.metadata, names(module)
        sure = unique(module, point.t, point.x, point.p) if rows else ()
        return Actuation(module, point.t, point.q, point.u, point.ud,
                         Labelled(point.inputs, metadata.inputs, units=metadata.units), kept, Labelled(lam, rows),
                         tuple(n for n, known in zip(rows, sure, strict=True) if known),
                         Labelled(point.forces, metadata.u, units={u: force_unit(metadata.units.get(u, ""))
                                                                      for u in metadata.u}),
                         self.Z.shape[1], drive.rank, drive.condition)

    def _searched(self) -> OperatingPoint:
        """The inputs at which nothing is left along the freedoms."""
        best, least = self.point, np.inf
        for value in (None, *STARTS) if self.nonlinear else (None,):
            point = self.point
            if value is not None:
                point = point.at(inputs=np.where(np.isin(np.arange(len(point.inputs)), self.free), value, point.inputs))
            try:
                result = self._newton(point)
                size, level = float(np.abs(self.left(result)).max(initial=0.0)), self.level(result)
            except EvaluationError:
                if value is None:
                    raise
                continue  # one of the further starts is out of what the loads are defined for
            if size <= MADE * level:
                return result
            if size < least:
                best, least = result, size
        return self._raise(best)

    def level(self, point: OperatingPoint) -> float:
        """Size of the single terms of the balance, N."""
        return max(self.least, float((np.abs(self.forces(point)) * self.scales).max(initial=0.0)))

    @property
    def nonlinear(self) -> bool:
        """Whether the derivative by the inputs depends on inputs."""
        module = self.point.module
        return bool(self.free) and "inputs" in module.library("input_matrix").metadata.arguments["input_matrix"]

    def _newton(self, point: OperatingPoint) -> OperatingPoint:
        """Newton's method with steps of least norm; linear equations take one step, and one for its rounding."""
        left = self.left(point)
        for _ in range(ROUNDS if self.free else 0):
            size = float(np.linalg.norm(left))
            if size == 0.0:
                break
            drive = _Drive(self.Z.T @ (self.scales[:, None] * self.matrix(point)))
            self.most = max(self.most, drive.rank)
            step = drive.least(left)
            share, improved = 1.0, None
            while share >= SMALLEST_STEP:
                values = point.inputs.copy()
                values[self.free] += share * step
                trial = point.at(inputs=values)
                try:
                    now = self.left(trial)
                except EvaluationError:  # out of what the loads are defined for
                    share /= 2
                    continue
                if np.linalg.norm(now) < (1 - 1e-4 * share) * size:
                    improved = trial
                    break
                share /= 2
            if improved is None:
                break
            point, left = improved, now
        return point

    def _raise(self, point: OperatingPoint) -> NoReturn:
        """Raises ArgumentError with the direction in which no input works."""
        metadata, owner = point.module.metadata, point.module.name
        sought = [metadata.inputs[k] for k in self.free]
        left = self.left(point)
        drive = _Drive(self.Z.T @ (self.scales[:, None] * self.matrix(point)))
        missing = drive.outside(left)
        if np.linalg.norm(missing) <= MADE * self.level(point) or drive.rank < self.most:
            raise ArgumentError(f"{owner}: no values of {', '.join(sought)} were found that make this motion: Newton's method "
                                f"leaves {np.linalg.norm(left):.6g} N at {_values(point, sought)}; pass a guess in "
                                "start={...}, or check whether the loads can reach the forces that it needs")
        direction = self.Z @ (missing / np.linalg.norm(missing))
        labels = coordinate_names(metadata)
        shares = direction**2
        # Equal shares in the order of the coordinates, whatever rounding says.
        along = [k for k in np.argsort(-shares.round(6), kind="stable") if shares[k] >= SHARE]
        directions = ", ".join(f"{labels[k]} ({shares[k]:.2f})" for k in along)
        if len(along) == 1 and shares[along[0]] > 1 - 1e-9:
            unit = force_unit(metadata.units.get(metadata.u[along[0]], ""))
            amount = f"{np.linalg.norm(missing) / self.scales[along[0]]:.6g} {unit}".rstrip()
        else:
            amount = f"{np.linalg.norm(missing):.6g} N (moments divided by {natural_length(point):.3g} m)"
        which = (f"no input works along {directions}" if not sought else
                 f"{', '.join(sought)} cannot work along {directions}") if metadata.inputs else \
            f"the system has no inputs, so nothing works along {directions}"
        raise ArgumentError(
            f"{owner}: no inputs make this motion: {which}, where {amount} {'is' if len(along) == 1 else 'are'} missing; rank "
            f"{drive.rank} of {self.Z.shape[1]} freedoms. Add an input there, such as add_joint_force(joint, sd.inputs('tau')), "
            "or pass accelerations that the mechanism has without it")


def _demand_linear(balance: _Balance, drive: _Drive) -> None:
    """Raises ArgumentError where more inputs than freedoms enter nonlinearly: Newton's method does not find the least ones."""
    if not balance.nonlinear or drive.rank == len(balance.free):
        return
    point = balance.point
    known = point.module.metadata.inputs
    base = balance.matrix(point)
    bent = []
    for k in balance.free:
        values = point.inputs.copy()
        values[k] += 1.0 + abs(values[k])
        if not np.array_equal(balance.matrix(point.at(inputs=values)), base):
            bent.append(known[k])
    raise ArgumentError(f"{point.module.name}: {len(balance.free)} inputs are sought for {drive.rank} freedoms, but "
                        f"{', '.join(bent)} {'enter' if len(bent) > 1 else 'enters'} the forces nonlinearly, so that the least "
                        "ones are not known; pass values of some of them in inputs={...}")


class _Drive:
    """Effect of inputs along the freedoms: R (freedoms, n)."""

    def __init__(self, R: np.ndarray) -> None:
        self.R = R
        lengths = np.linalg.norm(R, axis=0)
        largest = lengths.max(initial=0.0)
        units = np.where(lengths > 0, lengths, 1.0)
        U, values, _ = np.linalg.svd(R / units, full_matrices=False) if R.size and largest > 0 else \
            (np.zeros((len(R), 0)), np.zeros(0), None)
        self.rank = int((values > DRIVES * values.max(initial=0.0)).sum())
        self.condition = float(values[0] / values[self.rank - 1]) if self.rank else 1.0
        self.reached = U[:, :self.rank]

    def outside(self, forces: np.ndarray) -> np.ndarray:
        """The part of forces that no input makes."""
        result: np.ndarray = forces - self.reached @ (self.reached.T @ forces)
        return result

    def least(self, forces: np.ndarray) -> np.ndarray:
        """The inputs of least norm, in their own units, whose forces are these, but for what none makes."""
        if not self.rank:
            return np.zeros(self.R.shape[1])
        Q, upper = np.linalg.qr((self.reached.T @ self.R).T)
        result: np.ndarray = Q @ np.linalg.solve(upper.T, self.reached.T @ forces)
        return result


def _values(point: OperatingPoint, sought: Sequence[str]) -> str:
    known = point.module.metadata.inputs
    return ", ".join(f"{n} = {point.inputs[known.index(n)]:.6g}" for n in sought)
