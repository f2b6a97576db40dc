"""States of rest on rigid contacts: the position, forces within the cones of friction, and the range over which it stays.

At rest the forces lam of the contacts fulfil D lam = -b, b the accelerations at the contacts without them. Where rows of D depend
on each other (four legs) the forces are not unique: what counts is whether any of them fulfil N >= 0 and |T| <= mu N, a convex
problem that is solved with planes that touch the cones, added until none is left out.

Source: Stewart, Rigid-body dynamics with friction and impact, SIAM Review 42 (2000); Kelley, The cutting-plane method for solving
convex programs, 1960.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from symdyn.arguments import take
from symdyn.errors import ArgumentError, EvaluationError, NoEquilibrium
from symdyn.real_numbers import number_of
from symdyn.runtime.consistent import normalised
from symdyn.runtime.contact_laws import OPEN, SLIDING, STICKING
from symdyn.runtime.integrating.contacts import Numbers, numbers, rows_of
from symdyn.runtime.masses import real_parameters
from symdyn.runtime.shared_forces import least_solution
from symdyn.shown import name_of, shown
from symdyn.statics.contact_modes import asked_modes, held_places, with_modes
from symdyn.statics.equilibrium import given_inputs
from symdyn.thresholds import DEPENDENT

if TYPE_CHECKING:
    from symdyn.runtime.module import Module
    from symdyn.statics.linearize import Linearization

# Gaps of contacts that touch at the start, by the size of the coordinates.
NEAR = 1e-6
# Iterations, and accelerations that count as none, by their sizes.
ITERATIONS, BALANCED = 50, 1e-11
# Steps of coordinates that are not halved any more.
SHORTEST = 1e-3
# Forces beyond their cone by less than this part of the largest are rounding; rounds of planes.
WITHIN, ROUNDS = 1e-10, 20
# The same where the end of a range is looked for.
EDGE = 1e-13
# Part of a cone in space that planes may leave, by the largest force.
CONE = 1e-9
# Sides of a cone at first, and constraints that hold with equality to this part.
SIDES, ACTIVE = 8, 1e-6
# Number of times that a range is doubled, and halved at its end.
DOUBLED, HALVED = 60, 200


class Carried(NamedTuple):
    """The load that a contact carries at rest.

    mode     "open", "sticking" or "sliding"
    force    along its normal and tangents, N, (1 + n_tangents,): where forces are not unique those of least norm that are
             within the cones
    least, most   of the normal force, N, over all forces that keep the state

    >>> y = sd.coordinates("y")
    >>> system = sd.System("ball", gravity=[0, -9.81])
    >>> ball = system.add_body("ball", mass=1.0)
    >>> joint = system.add_joint(sd.Prismatic("height", system.ground, ball, y, axis=[0, 1]))
    >>> contact = system.add_contact(sd.Contact("floor", ball, system.ground, friction=0.5))
    >>> carried = system.compile(backend="numpy").rest().contacts["floor"]
    >>> carried.mode, carried.force
    ('sticking', array([9.81, 0.  ]))
    """

    mode: str
    force: np.ndarray
    least: float
    most: float


@dataclass(frozen=True, eq=False)
class Rest:
    """A state of rest on rigid contacts.

    t, x, params, inputs   params with the modes of the contacts
    contacts    what each carries, by name; unique: whether the forces are
    slack       how far the forces are within the cones, by the largest force: 0 at the edge

    >>> y = sd.coordinates("y")
    >>> system = sd.System("ball", gravity=[0, -9.81])
    >>> ball = system.add_body("ball", mass=1.0)
    >>> joint = system.add_joint(sd.Prismatic("height", system.ground, ball, y, axis=[0, 1]))
    >>> contact = system.add_contact(sd.Contact("floor", ball, system.ground))
    >>> rest = system.compile(backend="numpy").rest()
    >>> rest.carrying, rest.verdict, rest["y"]
    (('floor',), '', 0.0)
    """

    module: Module
    t: float
    x: np.ndarray
    params: np.ndarray
    inputs: np.ndarray
    contacts: Mapping[str, Carried]
    unique: bool
    slack: float

    def __getitem__(self, name: Any) -> float:
        """A coordinate, parameter or input by name or symbol. Raises ArgumentError for an unknown name."""
        metadata, asked = self.module.metadata, name_of(name)
        for names, values in ((metadata.x, self.x), (metadata.parameters, self.params), (metadata.inputs, self.inputs)):
            if asked in names:
                return float(values[names.index(asked)])
        raise ArgumentError(f"{self.module.name}: the state of rest has no {shown(asked)}; it has {', '.join(metadata.x)}, "
                            "parameters and inputs")

    @property
    def carrying(self) -> tuple[str, ...]:
        """Contacts that carry something, whichever the forces are.

        >>> y = sd.coordinates("y")
        >>> system = sd.System("ball", gravity=[0, -9.81])
        >>> ball = system.add_body("ball", mass=1.0)
        >>> joint = system.add_joint(sd.Prismatic("height", system.ground, ball, y, axis=[0, 1]))
        >>> contact = system.add_contact(sd.Contact("floor", ball, system.ground))
        >>> system.compile(backend="numpy").rest().carrying
        ('floor',)
        """
        largest = max((one.most for one in self.contacts.values()), default=0.0)
        return tuple(name for name, one in self.contacts.items() if one.least > WITHIN * largest)

    @cached_property
    def linear(self) -> Linearization:
        """The linear equations about it with the contacts in their modes.

        >>> x, y = sd.coordinates("x y")
        >>> system = sd.System("ball", gravity=[0, -9.81])
        >>> cart, ball = system.add_body("cart", mass=0), system.add_body("ball", mass=1.0)
        >>> slide = system.add_joint(sd.Prismatic("slide", system.ground, cart, x, axis=[1, 0]))
        >>> joint = system.add_joint(sd.Prismatic("height", cart, ball, y, axis=[0, 1]))
        >>> system.add_joint_force(slide, -4 * x)
        >>> contact = system.add_contact(sd.Contact("floor", ball, system.ground))
        >>> linear = system.compile(backend="numpy").rest().linear
        >>> linear.coordinates, np.round(linear.K, 9)
        (('x',), array([[4.]]))
        """
        return self.module.linearize(self)

    @property
    def verdict(self) -> str:
        """Verdict on the linear equations: "stable", "neutral", "drifts", "unstable" or "not decided", "" where nothing is free
        to move; "not decided" as well where contacts that touch carry nothing or are at the edge of their cones, since small
        disturbances change their modes.

        >>> x, y = sd.coordinates("x y")
        >>> system = sd.System("ball", gravity=[0, -9.81])
        >>> cart, ball = system.add_body("cart", mass=0), system.add_body("ball", mass=1.0)
        >>> slide = system.add_joint(sd.Prismatic("slide", system.ground, cart, x, axis=[1, 0]))
        >>> joint = system.add_joint(sd.Prismatic("height", cart, ball, y, axis=[0, 1]))
        >>> system.add_joint_force(slide, -4 * x - x.dot)
        >>> contact = system.add_contact(sd.Contact("floor", ball, system.ground))
        >>> system.compile(backend="numpy").rest().verdict
        'stable'
        """
        return "not decided" if self.slack <= WITHIN else self.linear.verdict

    def range(self, by: Any) -> tuple[float, float]:
        """Least and most value of a parameter or an input, by name or symbol, with which this position stays at rest; -inf and
        inf where nothing bounds it. Raises ArgumentError for another name.

        >>> y, F = sd.coordinates("y"), sd.inputs("F")
        >>> system = sd.System("ball", gravity=[0, -9.81])
        >>> ball = system.add_body("ball", mass=1.0)
        >>> joint = system.add_joint(sd.Prismatic("height", system.ground, ball, y, axis=[0, 1]))
        >>> system.add_force(ball, [0, F])
        >>> contact = system.add_contact(sd.Contact("floor", ball, system.ground))
        >>> least, most = system.compile(backend="numpy").rest().range(F)
        >>> least, round(most, 6)
        (-inf, 9.81)
        """
        metadata, name = self.module.metadata, name_of(by)
        own = [n for record in metadata.contacts for n in record.parameters]
        if name not in (*metadata.parameters, *metadata.inputs) or name in own:
            known = [n for n in (*metadata.parameters, *metadata.inputs) if n not in own and not n.startswith("contacts_")]
            raise ArgumentError(f"{self.module.name}: a range of {shown(name)} was requested; there are {', '.join(known)}")
        least, most = (self._end(name, side) for side in (-1.0, 1.0))
        return least, most

    def _holds(self, name: str, value: float) -> bool:
        metadata, p, inputs = self.module.metadata, self.params.copy(), self.inputs.copy()
        if name in metadata.parameters:
            p[metadata.parameters.index(name)] = value
        else:
            inputs[metadata.inputs.index(name)] = value
        try:
            at = numbers(self.module, self.t, self.x, p, inputs)
            left = self.module.evaluate("rhs", self.t, self.x, p, inputs)
        except EvaluationError:
            return False
        size = float(np.abs(at.free).max(initial=0.0)) or 1.0
        if not np.isfinite(left).all() or np.abs(left).max(initial=0.0) > 1e-9 * size:
            return False
        return _Forces(self.module, at, held_places(self.module, p)).slack() >= -EDGE

    def _end(self, name: str, side: float) -> float:
        value = self[name]
        good, step = value, side * max(abs(value), 1.0) * 1e-3
        for _ in range(DOUBLED):
            bad = value + step
            if not self._holds(name, bad):
                break
            good, step = bad, 2 * step
        else:
            return side * float("inf")
        for _ in range(HALVED):
            middle = (good + bad) / 2
            if middle in (good, bad):
                break
            good, bad = (middle, bad) if self._holds(name, middle) else (good, middle)
        return good

    def describe(self) -> str:
        """The state and its contacts as a table.

        >>> y = sd.coordinates("y")
        >>> system = sd.System("ball", gravity=[0, -9.81])
        >>> ball = system.add_body("ball", mass=1.0)
        >>> joint = system.add_joint(sd.Prismatic("height", system.ground, ball, y, axis=[0, 1]))
        >>> contact = system.add_contact(sd.Contact("floor", ball, system.ground, friction=0.5))
        >>> print(system.compile(backend="numpy").rest().describe())
        ball: at rest on floor, forces not unique
          y = 0 m
          floor: sticking, 9.81, 0 N
        """
        metadata = self.module.metadata
        kind = "forces unique" if self.unique else "forces not unique"
        lines = [f"{self.module.name}: at rest on {', '.join(self.carrying) or 'no contact'}, {kind}"]
        lines += [f"  {name} = {value:.8g} {metadata.units.get(name, '')}".rstrip()
                  for name, value in zip(metadata.q, self.x, strict=False)]
        for name, one in self.contacts.items():
            spread = "" if one.most - one.least <= 1e-9 * abs(one.most) else f", normal force {one.least:.6g} to {one.most:.6g} N"
            lines.append(f"  {name}: {one.mode}, {', '.join(f'{f:.6g}' for f in one.force)} N{spread}")
        return "\n".join(lines)

    def __repr__(self) -> str:
        return self.describe()


def rest(module: Module, start: Any, params: Any, inputs: Any, t: float, contacts: Any) -> Rest:
    """See Module.rest."""
    metadata, owner = module.metadata, module.name
    if not metadata.contacts:
        raise ArgumentError(f"{owner}: a state of rest on contacts was requested, but the mechanism has no rigid contacts; take "
                            "module.equilibrium(...)")
    time = number_of(t, owner, "t must be a finite time")
    if start is not None and not isinstance(start, Mapping) and len(start) == metadata.sizes.q:
        start = dict(zip(metadata.q, start, strict=True))
    x = take(start, metadata.x, "start", metadata.initial_values("x"), owner)
    n_q, n_u = metadata.sizes.q, metadata.sizes.u
    x[n_q:n_q + n_u] = 0.0
    x, p, free = normalised(module, x), real_parameters(module, params), given_inputs(module, inputs)
    at = numbers(module, time, x, p, free)
    size = max(1e-3, float(np.abs(x).max(initial=0.0)))
    if contacts is None:
        contacts = {record.name: STICKING for record, gap in zip(metadata.contacts, at.gap, strict=True) if gap <= NEAR * size}
    x = _onto(module, time, x, p, free, contacts)
    p = with_modes(module, contacts, time, x, p, free)
    x = _balanced(module, time, x, p, free, contacts)
    at = numbers(module, time, x, p, free)
    deep = [record.name for record, gap in zip(metadata.contacts, at.gap, strict=True) if gap < -NEAR * size]
    if deep:
        raise NoEquilibrium(f"{owner}: at rest contacts {', '.join(deep)} would overlap; name them in contacts, or begin "
                            "elsewhere")
    return _with_forces(module, time, x, p, free, at)


def _onto(module: Module, t: float, x: np.ndarray, p: np.ndarray, inputs: np.ndarray, contacts: Any) -> np.ndarray:
    """Gaps of contacts that are named as closed to zero, by Newton's method."""
    modes, n_q = asked_modes(module, contacts), module.metadata.sizes.q
    closed = [k for k, record in enumerate(module.metadata.contacts) if modes[record.name] != OPEN]
    normal = [rows_of(module.metadata.contacts)[k][0] for k in closed]
    x = x.copy()
    for _ in range(ITERATIONS):
        at = numbers(module, t, x, p, inputs)
        if not closed or np.abs(at.gap[closed]).max() <= 1e-14 * max(1.0, float(np.abs(x).max())):
            break
        push = least_solution(at.D[np.ix_(normal, normal)], -at.gap[closed])
        x[:n_q] += at.coordinates[:, normal] @ push
    return normalised(module, x)


def _balanced(module: Module, t: float, x: np.ndarray, p: np.ndarray, inputs: np.ndarray, contacts: Any) -> np.ndarray:
    """The position near one where nothing accelerates, with closed contacts closed and sticking ones where they are or
    roll to: Newton's method. Raises NoEquilibrium where there is none."""
    metadata = module.metadata
    n_q, n_u = metadata.sizes.q, metadata.sizes.u
    held, x = held_places(module, p), x.copy()
    for _ in range(ITERATIONS):
        at = numbers(module, t, x, p, inputs)
        left = module.evaluate("rhs", t, x, p, inputs)[n_q:n_q + n_u]
        parted = module.evaluate("rhs", t, x, _open(module, p), inputs)
        size = max(float(np.abs(at.free).max(initial=0.0)), float(np.abs(parted).max(initial=0.0)), 1e-300)
        if np.abs(left).max(initial=0.0) <= BALANCED * size:
            return x
        J = np.asarray(module.jacobian(t, x, p, inputs, ["x"]).x)
        N = J[:n_q, n_q:n_q + n_u]
        M = np.asarray(module.mass_matrix(x[:n_q], p, t)).reshape(n_u, n_u)
        rows = np.vstack([J[n_q:n_q + n_u, :n_q] @ N, (M @ at.speeds[:, held]).T])
        step = np.linalg.lstsq(rows, -np.concatenate([left, np.zeros(len(held))]), rcond=1e-12)[0]
        scale = min(1.0, 0.5 / max(float(np.abs(step).max(initial=0.0)), 1e-300))
        x = _moved(module, t, x, N @ step * scale, p, inputs, contacts)
    names = ", ".join(f"{name} by {value:.4g}" for name, value in zip(metadata.u, left, strict=True) if abs(value) > 1e-6 * size)
    raise NoEquilibrium(f"{module.name}: no state of rest with these contacts: what accelerates is {names} a second; name in "
                        "contacts those that carry, or begin elsewhere")


def _moved(module: Module, t: float, x: np.ndarray, step: np.ndarray, p: np.ndarray, inputs: np.ndarray,
           contacts: Any) -> np.ndarray:
    """The position after a step, or a part of it from which closed contacts are closed again."""
    there = x.copy()
    there[:len(step)] += step
    try:
        return _onto(module, t, normalised(module, there), p, inputs, contacts)
    except EvaluationError:  # so deep in a surface that a shape touches it in several places
        if np.abs(step).max() < SHORTEST:
            raise
        return _moved(module, t, x, step / 2, p, inputs, contacts)


def _open(module: Module, p: np.ndarray) -> np.ndarray:
    """Parameters with all contacts open."""
    p = p.copy()
    for record in module.metadata.contacts:
        for name in record.parameters:
            p[module.metadata.parameters.index(name)] = 0.0
    return p


def _with_forces(module: Module, t: float, x: np.ndarray, p: np.ndarray, inputs: np.ndarray, at: Numbers) -> Rest:
    """The state with the forces that keep it. Raises NoEquilibrium where none do."""
    forces = _Forces(module, at, held_places(module, p))
    slack = forces.slack()
    if slack < -WITHIN:
        raise NoEquilibrium(f"{module.name}: its contacts would {forces.fault()}; this position does not stay at rest")
    result = {}
    for record, rows in zip(module.metadata.contacts, rows_of(module.metadata.contacts), strict=True):
        mode = OPEN if rows[0] not in forces.held else STICKING if set(rows[1:]) & set(forces.held) else SLIDING
        least, most = (forces.extreme(rows[0], side) for side in (1.0, -1.0))
        result[record.name] = Carried(mode, forces.best[list(rows)], least, most)
    return Rest(module, t, x, p, inputs, result, forces.free.shape[1] == 0, slack)


class _Forces:
    """The forces lam = best + free y of the rows that hold, and the cones that they have to be in.

    held   rows that hold; best (n,): forces within the cones as far as there are any
    """

    def __init__(self, module: Module, at: Numbers, held: Sequence[int]) -> None:
        self.module, self.held, n = module, list(held), len(at.free)
        self.static = at.static
        self.rows = rows_of(module.metadata.contacts)
        self.best, self.free = np.zeros(n), np.zeros((n, 0))
        self.size = 1.0
        if not self.held:
            return
        D = at.D[np.ix_(self.held, self.held)]
        self.best[self.held] = least_solution(D, -at.free[self.held])
        self.size = float(np.abs(self.best).max()) or 1.0
        _, values, Vt = np.linalg.svd(D)
        self.free = np.zeros((n, int((values <= DEPENDENT * values[0]).sum())))
        self.free[self.held] = Vt[len(Vt) - self.free.shape[1]:].T
        self.planes: list[np.ndarray] = []  # of lam, not negative: a normal force, or mu N less friction along a direction
        for k, own in enumerate(self.rows):
            if own[0] in self.held:
                self.planes.append(np.eye(n)[own[0]])
                self.planes += [self._plane(k, np.array(d)) for d in self._directions(len(own) - 1)]

    @staticmethod
    def _directions(n: int) -> list[list[float]]:
        if n == 0:
            return []
        if n == 1:
            return [[1.0], [-1.0]]
        angles = 2 * np.pi * np.arange(SIDES) / SIDES
        return np.column_stack([np.cos(angles), np.sin(angles)]).tolist()  # type: ignore[no-any-return]

    def _plane(self, k: int, direction: np.ndarray) -> np.ndarray:
        plane = np.zeros(len(self.best))
        plane[self.rows[k][0]] = self.static[k]
        plane[list(self.rows[k][1:])] = -direction
        return plane

    def slack(self) -> float:
        """The largest least distance to the edges, by the size of the forces; negative where no forces are within."""
        if not self.held:
            return np.inf
        return self._solved(np.zeros(self.free.shape[1]), -1.0)[1]

    def extreme(self, row: int, side: float) -> float:
        """The least (side 1) or largest (-1) force along a row, N; infinite where nothing bounds it."""
        if row not in self.held:
            return 0.0
        y, _ = self._solved(side * self.free[row], 0.0)
        return float(self.best[row] + self.free[row] @ y) if y is not None else -side * float("inf")

    def fault(self) -> str:
        """Contacts beyond their cones."""
        result = []
        for k, own in enumerate(self.rows):
            if own[0] in self.held:
                normal, friction = self.best[own[0]], float(np.linalg.norm(self.best[list(own[1:])]))
                name = self.module.metadata.contacts[k].name
                if normal < -WITHIN * self.size:
                    result.append(f"pull ({name} by {-normal:.6g} N)")
                elif friction > self.static[k] * normal + WITHIN * self.size:
                    result.append(f"need more friction than they have ({name}: {friction:.6g} N of "
                                  f"{self.static[k] * normal:.6g} N)")
        return " and ".join(result) or "pull, or need more friction than they have"

    def _solved(self, cost: np.ndarray, of_slack: float) -> tuple[Any, float]:
        """y of least cost with all planes (and the largest slack where of_slack is -1), and the slack; takes best as far as the
        slack is requested."""
        from scipy.optimize import linprog

        m = self.free.shape[1]
        for _ in range(ROUNDS):
            A = np.array(self.planes)
            if m == 0:
                y, slack = np.zeros(0), float((A @ self.best).min()) / self.size
            else:
                sized = bool(of_slack)
                rows = np.column_stack([-A @ self.free, np.ones(len(A)) * self.size]) if sized else -A @ self.free
                bounds = [(None, None)] * m + [(None, 1.0)] * sized
                done = linprog(np.append(cost, -1.0) if sized else cost, A_ub=rows, b_ub=A @ self.best, bounds=bounds)
                if done.status != 0:
                    return None, 0.0
                y, slack = done.x[:m], float(done.x[m]) if sized else 0.0
                y, slack = self._polished(A, y, slack, sized)
            lam = self.best + self.free @ y
            more = []
            for k, own in enumerate(self.rows):
                tangents = lam[list(own[1:])]
                friction = float(np.linalg.norm(tangents))
                if own[0] in self.held and len(own) == 3 and friction > 0:
                    beyond = friction - self.static[k] * lam[own[0]] + slack * self.size * bool(of_slack)
                    if beyond > CONE * self.size:
                        more.append(self._plane(k, tangents / friction))
            if not more:
                break
            self.planes += more
        if of_slack:
            self.best = lam
        return y, slack

    def _polished(self, A: np.ndarray, y: np.ndarray, slack: float, sized: bool) -> tuple[np.ndarray, float]:
        """The vertex that a program has found, to rounding."""
        left = A @ (self.best + self.free @ y) - slack * self.size
        active = np.abs(left) <= ACTIVE * self.size
        rows = np.column_stack([A @ self.free, -np.ones(len(A)) * self.size])[active]
        if not sized:
            rows = rows[:, :-1]
        change = np.linalg.lstsq(rows, -left[active], rcond=1e-9)[0] if active.any() else np.zeros(rows.shape[1])
        return y + change[:len(y)], slack + float(change[-1]) if sized else slack
