"""Equilibria: states of rest, or of steady motion with prescribed speeds, found from a start and judged by their eigenvalues."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, NoReturn

import numpy as np

from symdyn.arguments import take
from symdyn.counting import counted
from symdyn.errors import ArgumentError, EvaluationError, NoEquilibrium, SimulationWarning, SymdynError
from symdyn.real_numbers import real_of
from symdyn.runtime.consistent import normalised, number
from symdyn.runtime.masses import real_parameters
from symdyn.runtime.solutions.validity import VALIDITY_CHECKS, warn
from symdyn.shown import name_of, shown
from symdyn.statics.analysis import Analysis
from symdyn.statics.gimbal import REMEDY, lock
from symdyn.statics.kinks import kink, no_linear_equations
from symdyn.statics.manifold import Manifold, in_motion
from symdyn.statics.search import Search, Trial
from symdyn.statics.selection import Selection, select
from symdyn.statics.singular import singular_configuration
from symdyn.statics.steady import accelerating, further_on, steadiness
from symdyn.statics.terms import OperatingPoint, coordinate_names, rest
from symdyn.statics.uniqueness import demand_stiffness
from symdyn.turning import force_unit

if TYPE_CHECKING:
    from symdyn.given import Key
    from symdyn.runtime.module import Module

# Steady motion must fulfil the constraints up to this part of its speed.
STEADY = 1e-9
# Residuals that a message names, at most.
LISTED = 4
# Forces are compared with those so many seconds later, for whether they depend on time.
LATER = (0.37, 1.7, 7.3)
AT_GIMBAL_LOCK = f"there forces along its angles do not decide whether it is at rest; {REMEDY}"
# Coordinates below this, rad or m, are printed as zero: they are the rounding of a search.
ROUNDED = 1e-15


@dataclass(frozen=True, eq=False)
class Judged:
    """A verdict with its reason, and the eigenvalues (m,) or exponents that it rests on, None without."""

    verdict: str
    reason: str
    eigenvalues: np.ndarray | None


def judge(manifold: Manifold) -> Judged:
    """Verdict on small disturbances of a steady state; raises nothing."""
    try:
        singular = singular_configuration(manifold.point, manifold.selection)
        if singular:
            return Judged("not decided", singular, None)
        broken = kink(manifold.point, manifold.selection)
        if broken:
            return Judged("not decided", no_linear_equations(broken), None)
        steady = steadiness(manifold)
        if steady.kind:
            analysis = Analysis(manifold)
            return Judged(analysis.verdict, analysis.reason(), analysis.eigenvalues)
        from symdyn.statics.stability import of_manifold

        result = of_manifold(manifold)
        return Judged(result.verdict, result.reason, result.exponents)
    except SymdynError as error:
        return Judged("not decided", str(error), None)


@dataclass(frozen=True, eq=False)
class Equilibrium:
    """A state of rest, or of steady motion with prescribed speeds.

    point, selection   the state with all that belongs to it, and what was kept
    residual           of forces that are left, by the speed they work along, N or N m
    iterations         steps tried
    name               distinguishes it from others (see Module.equilibria)

    >>> rest = sd.systems.pendulum().compile(backend="numpy").equilibrium(start={"q1": 0.1})
    >>> np.round(rest.x, 9) + 0.0, rest.residual_norm < 1e-9
    (array([0., 0.]), True)
    >>> rest.verdict, rest.stable
    ('neutral', True)
    """

    point: OperatingPoint
    selection: Selection
    residual: Mapping[str, float]
    iterations: int
    name: str = ""

    @property
    def module(self) -> Module:
        """The module whose state it is.

        >>> module = sd.systems.pendulum().compile(backend="numpy")
        >>> module.equilibrium().module is module
        True
        """
        return self.point.module

    @property
    def t(self) -> float:
        """The time, s.

        >>> sd.systems.pendulum().compile(backend="numpy").equilibrium(t=2.0).t
        2.0
        """
        return self.point.t

    @property
    def x(self) -> np.ndarray:
        """[q; u; z], (n_x,).

        >>> rest = sd.systems.pendulum().compile(backend="numpy").equilibrium(start={"q1": 3.0})
        >>> np.round(rest.x, 6) + 0.0
        array([3.141593, 0.      ])
        """
        return self.point.x

    @property
    def q(self) -> np.ndarray:
        """Coordinates, (n_q,).

        >>> rest = sd.systems.pendulum().compile(backend="numpy").equilibrium(start={"q1": 3.0})
        >>> np.round(rest.q, 6)
        array([3.141593])
        """
        return self.point.q

    @property
    def u(self) -> np.ndarray:
        """Speeds, (n_u,).

        >>> sd.systems.pendulum().compile(backend="numpy").equilibrium(start={"q1": 3.0}).u
        array([0.])
        """
        return self.point.u

    @property
    def z(self) -> np.ndarray:
        """Extra states, (n_z,).

        >>> sd.systems.pendulum().compile(backend="numpy").equilibrium(start={"q1": 3.0}).z.shape
        (0,)
        """
        return self.point.z

    @property
    def lam(self) -> np.ndarray:
        """Multipliers, (n_c,); where constraints depend on each other those of least norm after scaling.

        >>> module = sd.systems.pendulum_absolute().compile(backend="numpy")
        >>> rest = module.equilibrium()
        >>> np.round(rest.lam, 6)
        array([-4.905])
        """
        return self.point.lam

    @property
    def params(self) -> np.ndarray:
        """Parameters in order, with those that were solved for, (n_p,).

        >>> module = sd.systems.pendulum().compile(backend="numpy")
        >>> rest = module.equilibrium(start={"q1": 0.1}, params={"m": 1.0, "l": 2.0})
        >>> dict(zip(rest.module.metadata.parameters, rest.params.tolist()))
        {'g': 9.81, 'm': 1.0, 'l': 2.0}
        """
        return self.point.p

    @property
    def inputs(self) -> np.ndarray:
        """Inputs in order, with those that were solved for, (n_in,).

        >>> module = sd.systems.cart_pole().compile(backend="numpy")
        >>> rest = module.equilibrium(free=["q1", "F"], fixed={"q1": 0.0}, start={"q2": 0.0}, inputs={"F": 1.0})
        >>> np.round(rest.inputs, 9) + 0.0
        array([0.])
        """
        return self.point.inputs

    @property
    def residual_norm(self) -> float:
        """Largest force or moment that is left, N or N m.

        >>> rest = sd.systems.pendulum().compile(backend="numpy").equilibrium(start={"q1": 0.1})
        >>> rest.residual_norm < 1e-9
        True
        """
        return max(map(abs, self.residual.values()), default=0.0)

    @property
    def solved(self) -> dict[str, float]:
        """Parameters and inputs that were solved for, by name.

        >>> module = sd.systems.cart_pole().compile(backend="numpy")
        >>> rest = module.equilibrium(free=["q1", "F"], fixed={"q1": 0.0}, start={"q2": 0.0}, inputs={"F": 1.0})
        >>> {name: round(value, 9) + 0.0 for name, value in rest.solved.items()}
        {'F': 0.0}
        """
        return {name: self[name] for name in self.selection.unknown}

    @property
    def held(self) -> tuple[str, ...]:
        """Names of what is held when the state is disturbed: what was kept, but for conditions of what was solved for.

        >>> module = sd.systems.double_pendulum().compile(backend="numpy")
        >>> module.equilibrium(start={"q2": 0.1}, fixed={"q1": 0.0}).held
        ('q1',)
        """
        return self.selection.held

    @cached_property
    def _manifold(self) -> Manifold:
        return Manifold(in_motion(self.point, self.selection), self.selection)

    @cached_property
    def _judged(self) -> Judged:
        return judge(self._manifold)

    @property
    def eigenvalues(self) -> np.ndarray:
        """Those of the linearization without what is held, by size, (m,) complex, 1/s; of a periodic motion its exponents.

        Raises ArgumentError with the reason where there are none (a singular configuration).

        >>> rest = sd.systems.pendulum().compile(backend="numpy").equilibrium(start={"q1": 0.1}, params={"l": 9.81})
        >>> sorted(np.round(rest.eigenvalues.imag, 6).tolist())
        [-1.0, 1.0]
        """
        if self._judged.eigenvalues is None:
            raise ArgumentError(f"{self.module.name}: there are no eigenvalues here: {self._judged.reason}")
        return self._judged.eigenvalues

    @property
    def verdict(self) -> str:
        """"stable" (all exponents proved negative), "neutral" (none positive, those that are zero without Jordan blocks),
        "drifts"
        (with a Jordan block), "unstable" (one proved positive), "not decided"; "" if nothing is free to move.

        >>> module = sd.systems.pendulum().compile(backend="numpy")
        >>> module.equilibrium(start={"q1": 0.1}).verdict, module.equilibrium(start={"q1": 3.0}).verdict
        ('neutral', 'unstable')
        """
        return self._judged.verdict

    @property
    def reason(self) -> str:
        """The reason of the verdict, in a sentence with numbers.

        >>> sd.systems.pendulum().compile(backend="numpy").equilibrium(start={"q1": 3.0}, params={"l": 9.81}).reason
        'an exponent is proved positive: 1 1/s'
        """
        return self._judged.reason

    @cached_property
    def stable(self) -> bool | None:
        """Stability, whether small disturbances stay small: True where the verdict is "stable", and at a neutral state of rest at
        a strict minimum of the energy (Lagrange and Dirichlet), where undamped oscillations stay small; False where it is
        "unstable" or "drifts"; else None.

        >>> module = sd.systems.pendulum().compile(backend="numpy")
        >>> module.equilibrium(start={"q1": 3.0}).stable
        False
        """
        if self.verdict in ("unstable", "drifts"):
            return False
        if self.verdict == "stable":
            return True
        return True if self.verdict == "neutral" and self._least_energy() else None

    def _least_energy(self) -> bool:
        """Whether this is rest at a strict minimum of the energy, as far as the linear equations show: no damping, no extra
        states, and a stiffness that is symmetric and positive definite beyond rounding."""
        manifold = self._manifold
        if self.u.any() or not manifold.second_order:
            return False
        analysis = Analysis(manifold)
        noise, K = analysis.noise, manifold.K
        if (np.abs(manifold.C) > noise.C).any() or (np.abs(K - K.T) > noise.K + noise.K.T).any():
            return False
        scale = 1 / np.sqrt(np.diag(manifold.M))
        values, vectors = np.linalg.eigh((K + K.T) / 2 * np.outer(scale, scale))
        error = np.einsum("ik,ij,jk->k", np.abs(vectors), noise.K * np.outer(scale, scale), np.abs(vectors))
        return bool((values > error + 1e-15 * np.abs(values).max(initial=0.0)).all())

    @property
    def message(self) -> str:
        """The result in a sentence.

        >>> sd.systems.pendulum().compile(backend="numpy").equilibrium(start={"q1": 3.0}).message.partition(" after")[0]
        'unstable equilibrium'
        """
        kind = f"{self.verdict} equilibrium" if self.verdict else "equilibrium, nothing free to move,"
        if self.verdict == "not decided":
            kind = "equilibrium whose stability is not decided"
        return f"{kind} after {counted(self.iterations, 'iteration')}, forces to {self.residual_norm:.3g} N or N m"

    def __getitem__(self, name: Key) -> float:
        """A coordinate, speed, extra state, parameter or input by name or symbol. Raises ArgumentError for an unknown name."""
        name = name_of(name)
        metadata = self.module.metadata
        for names, values in ((metadata.x, self.x), (metadata.parameters, self.params), (metadata.inputs, self.inputs)):
            if name in names:
                return float(values[names.index(name)])
        raise ArgumentError(f"{self.module.name}: the equilibrium has no {shown(name)}; it has {', '.join(metadata.x)}, "
                            "parameters "
                            "and inputs")

    def describe(self) -> str:
        """The state as a table, with what was solved for, and whether it is stable.

        >>> rest = sd.systems.pendulum().compile(backend="numpy").equilibrium(start={"q1": 3.0})
        >>> for line in rest.describe().splitlines()[1:]:
        ...     print(line)
        ...
          q1   =      3.1415927 rad
          an exponent is proved positive: 3.13209 1/s
        """
        metadata = self.module.metadata
        shown = [*metadata.q, *[u for u in metadata.u if self[u]], *metadata.z, *self.selection.unknown]
        width = max([4, *map(len, shown)])
        lines = [f"{self.module.name}: {f'{self.name}, ' if self.name else ''}{self.message}"]
        for name in shown:
            unit = metadata.units.get(name, "")
            note = "  solved for" if name in self.selection.unknown else "  held" if name in self.held else \
                "  kept" if name in self.selection.kept else ""
            value = self[name]
            shown_value = 0.0 if name in metadata.q and abs(value) < ROUNDED else value
            lines.append(f"  {name:<{width}} = {shown_value:>14.8g} {unit}{note}".rstrip())
        lines += [f"  held: {', '.join(self.held)}"] if self.held else []
        return "\n".join([*lines, f"  {self.reason}"])

    def __repr__(self) -> str:
        return self.describe()


def equilibrium(module: Module, free: Any = None, fixed: Any = None, start: Any = None, params: Any = None, t: float = 0.0,
                inputs: Any = None, unknown_params: Any = None, max_iterations: int = 100) -> Equilibrium:
    """See Module.equilibrium."""
    selection = select(module, free, fixed, unknown_params)
    point = begin(module, selection, start, params, t, inputs)
    return find(point, settled(point, selection), steps(max_iterations, module.name))


def steps(limit: Any, owner: str) -> int:
    """A number of iterations. Raises ArgumentError for anything else."""
    if isinstance(limit, bool) or not isinstance(limit, (int, np.integer)) or limit < 1:
        raise ArgumentError(f"{owner}: max_iterations must be a whole number of at least 1, found {shown(limit)}")
    return int(limit)


def settled(point: OperatingPoint, selection: Selection) -> Selection:
    """With the conditions among more candidates than are needed: those on whose forces what is solved for has an effect."""
    if not selection.candidates:
        return selection
    metadata, labels = point.module.metadata, coordinate_names(point.module.metadata)
    columns = np.sqrt(1 / np.maximum(np.abs(np.diag(point.M)), 1e-300))
    by = np.abs(point.by(selection.unknown)[:len(labels)]) * columns[:, None]
    effective = by > 1e-9 * by.max(axis=0, initial=0.0)
    result = [n for n in selection.candidates if n in labels and effective[labels.index(n)].any()]
    if len(result) != len(selection.unknown):
        free = [*[n for n in metadata.q if n not in selection.kept], *selection.candidates[:len(selection.unknown)]]
        raise ArgumentError(
            f"{point.module.name}: {len(selection.unknown)} values are to be found ({', '.join(selection.unknown)}), which takes "
            f"as many conditions, but fixed gives {len(selection.values)} ({', '.join(selection.values)}); name in free the "
            "conditions among them, and the coordinates that are found, too, such as "
            f"free=[{', '.join(repr(n) for n in [*free, *selection.unknown])}]")
    return replace(selection, conditions=tuple(result), candidates=())


def begin(module: Module, selection: Selection, start: Any, params: Any, t: float, inputs: Any) -> OperatingPoint:
    """Where the search begins. A start may name inputs and parameters that are solved for, too: guesses of them."""
    metadata = module.metadata
    start, params, inputs = _guesses(module, selection, start, params, inputs)
    time = number(t, "a finite number of seconds as t", module.name)
    if isinstance(start, Equilibrium):
        x = start.x.copy()
    else:
        if start is not None and not isinstance(start, Mapping):
            start = real_of(start, module.name, "start must be numbers")
            if start.shape == (len(metadata.q),):
                start = dict(zip(metadata.q, start.tolist(), strict=True))
        x = take(start, metadata.x, "start", metadata.initial_values("x"), module.name)
    # Speeds are those prescribed in fixed, the others zero.
    x[len(metadata.q):len(metadata.q) + len(metadata.u)] = 0.0
    x = normalised(module, selection.apply(x))
    if isinstance(params, Mapping) and selection.parameters:  # a guess need not be given
        passed = {name_of(k) for k in params}
        known = dict(zip(metadata.parameters, metadata.defaults, strict=True))
        params = {**dict.fromkeys([n for n in selection.parameters if n not in passed and known[n] is None], 0.0), **params}
    point = rest(module, time, x, real_parameters(module, params), given_inputs(module, inputs))
    if point.motion_rates:
        rates = ", ".join(f"{name} = {value:g}" for name, value in point.motion_rates.items())
        raise ArgumentError(f"{module.name}: an equilibrium was requested with {rates} among the inputs; at rest a motion has no "
                            "rate and no acceleration: give its value alone")
    return point


def _guesses(module: Module, selection: Selection, start: Any, params: Any, inputs: Any) -> tuple[Any, Any, Any]:
    """Start, params and inputs, with guesses of what is solved for moved from the start into these."""
    if not isinstance(start, Mapping):
        return start, params, inputs
    guesses = {n: v for n, v in ((name_of(k), v) for k, v in start.items())
               if n in module.metadata.inputs or n in selection.parameters}
    kept = [n for n in guesses if n not in selection.unknown]
    if kept:
        raise ArgumentError(f"{module.name}: start names {', '.join(kept)}, not among what is solved for "
                            f"({', '.join(selection.unknown) or 'nothing'}); give values in inputs, or name them in free")
    start = {k: v for k, v in start.items() if name_of(k) not in guesses}
    merged = []
    for what, passed, names in (("params", params, selection.parameters), ("inputs", inputs, selection.inputs)):
        mine = {n: guesses[n] for n in names if n in guesses}
        if mine and passed is not None and not isinstance(passed, Mapping):
            passed = dict(zip(module.metadata.names("parameters" if what == "params" else "inputs"), passed, strict=False))
        twice = [n for n in mine if passed is not None and n in {name_of(k) for k in passed}]
        if twice:
            raise ArgumentError(f"{module.name}: {', '.join(twice)} in start and in {what}; leave it out of one of them")
        merged.append({**(passed or {}), **mine} if mine else passed)
    return start, merged[0], merged[1]


def given_inputs(module: Module, inputs: Any) -> np.ndarray:
    """Inputs in order; what is left out takes its initial value, as in a simulation, else 0, (n_in,)."""
    names = module.metadata.inputs
    return take(inputs if inputs is not None else {}, names, "inputs",
                {n: module.metadata.initial.get(n, 0.0) for n in names}, module.name)


def find(point: OperatingPoint, selection: Selection, limit: int) -> Equilibrium:
    """The equilibrium from a start. Raises NoEquilibrium, EquilibriumNotUnique, ArgumentError."""
    owner = point.module.name
    try:
        search = Search(point, selection)
    except EvaluationError as error:
        raise NoEquilibrium(f"{owner}: the search cannot begin: {str(error).removeprefix(f'{owner}: ')}; begin elsewhere, with "
                            "start={...}") from error
    if len(search.weights) < len(search.widths(search.best)):
        raise ArgumentError(f"{owner}: {len(search.widths(search.best))} values are unknown, but there are {len(search.weights)} "
                            "equations; fix a coordinate for each parameter that is solved for")
    good, reason = search.run(limit)
    trial = search.best
    if not good:
        _raise_without_balance(search, reason)
    locked = lock(trial.point)
    if locked:
        raise NoEquilibrium(f"{owner}: no equilibrium found: the state reached is at gimbal lock: {locked}; {AT_GIMBAL_LOCK}")
    _demand_effect(search)
    demand_stiffness(search)
    _demand_steady(trial)
    _demand_lasting(trial)
    _warn_of_validity(search)
    return Equilibrium(trial.point, selection, _left(trial), search.steps)


def _left(trial: Trial) -> dict[str, float]:
    """Forces that are left, by the coordinate they work along; what is kept bears anything."""
    labels = coordinate_names(trial.point.module.metadata)
    return {name: float(v) for name, v in zip(labels, _along(trial, trial.point.forces), strict=True)}


def _raise_without_balance(search: Search, reason: str) -> NoReturn:
    """Raises NoEquilibrium with what is left, and where."""
    trial, module = search.best, search.module
    metadata = module.metadata
    _demand_effect(search)
    labels = coordinate_names(metadata)
    forces = _left(trial)
    weighed = np.abs(np.array(list(forces.values()))) * search.columns
    order = [k for k in np.argsort(-weighed, kind="stable") if weighed[k] > 1e-9 * max(weighed.max(initial=0.0), 1e-300)][:LISTED]
    left = ", ".join(f"{forces[labels[k]]:.6g} {force_unit(metadata.units.get(metadata.u[k], ''))}".strip()
                     + f" along {labels[k]}" for k in order)
    where = ", ".join(f"{n} = {v:.6g}" for n, v in zip([*metadata.q, *metadata.z, *trial.selection.unknown],
                                                       [*trial.point.q, *trial.point.z, *trial.selection.amounts(trial.point)],
                                                       strict=True))
    rates = ", ".join(f"{metadata.z[k]} by {trial.point.rates_z[k]:.3g} a second" for k in trial.selection.states
                      if abs(trial.point.rates_z[k]) > 1e-9)
    gaps = trial.point.C * trial.point.scale
    names = metadata.constraints
    open_ = ", ".join(f"{n} by {g:.3g} m" for n, g in zip(names, gaps, strict=True) if abs(g) > 1e-9)
    loose = [f"nothing holds {name}: it has no stiffness there, so it sinks, rises or turns away"
             for k, name in enumerate(labels) if k in order[:1] and _slack(trial, k, search.columns)]
    parts = [f"no equilibrium found: {reason}, after {search.steps} iterations"]
    parts += [f"forces left are {left}"] if left else []
    parts += [f"constraints are open: {open_}"] if open_ else []
    parts += [f"extra states change: {rates}"] if rates else []
    locked = lock(trial.point)
    parts += [f"the last state is at gimbal lock: {locked}; {AT_GIMBAL_LOCK}"] if locked else []
    advice = "check the weight and the loads: another start hardly helps" if loose else \
        "begin elsewhere with start={...}, or check the loads"
    parts += [*loose, f"the last state is {where}; {advice}"]
    raise NoEquilibrium(f"{module.name}: " + "; ".join(parts))


def _slack(trial: Trial, k: int, columns: np.ndarray) -> bool:
    """Whether a force along speed k meets (almost) no stiffness."""
    K = trial.point.by_v[:trial.point.sizes[1]] * np.outer(columns, columns)
    return bool(np.abs(K[k]).max(initial=0.0) <= 1e-6 * np.abs(K).max(initial=0.0) or not K.any())


def _demand_effect(search: Search) -> None:
    """Raises ArgumentError for a parameter or an input that is solved for but changes nothing."""
    trial, unknown = search.best, search.selection.unknown
    if not unknown:
        return
    labels = coordinate_names(search.module.metadata)
    allowed, n_u = search.allowed(trial), trial.point.sizes[1]
    idle = []
    for name, value, column in zip(unknown, search.selection.amounts(trial.point), trial.by_unknown(), strict=True):
        along = np.abs(_along(trial, column[:n_u])) * max(abs(value), 1.0)
        if not column[n_u:].any() and (along <= 1e-6 * allowed).all():
            idle.append(name)
    if idle:
        conditions = [n for n in search.selection.conditions if n in labels]
        raise ArgumentError(f"{search.module.name}: {', '.join(idle)} has no effect on {', '.join(conditions) or 'any force'} "
                            "there: no value of it balances the forces; solve for another parameter, or fix another coordinate")


def _demand_steady(trial: Trial) -> None:
    """Raises NoEquilibrium if constraints do not let the prescribed speeds stay."""
    point = trial.point
    if not point.sizes[3]:
        return
    names = point.module.metadata.constraints
    speed = max(float(np.abs(point.u).max(initial=0.0)), 1e-300)
    rates, demanded = point.evaluate("C_dot") * point.scale, point.evaluate("F_d") * point.scale
    for what, values, size in (("move with", rates, speed), ("demand accelerations of", demanded, speed * max(speed, 1.0))):
        k = int(np.argmax(np.abs(values)))
        if abs(values[k]) > STEADY * max(size, 1e-3):
            raise NoEquilibrium(f"{point.module.name}: at t = {point.t:g} s the constraints {what} {values[k]:.6g} m/s"
                                f"{'^2' if values is demanded else ''} ({names[k]}) at the prescribed speeds: there is no "
                                "rest there; give speeds that fit them, or simulate the motion")


def _demand_lasting(trial: Trial) -> None:
    """Raises NoEquilibrium where forces change along the steady motion, such as weight in the plane of a rotor."""
    point = trial.point
    if not point.u.any():
        return
    try:
        manifold = Manifold(in_motion(point, trial.selection), trial.selection)
        for later in further_on(manifold.point, manifold):
            changed = accelerating(later, manifold)
            if changed:
                raise NoEquilibrium(
                    f"{point.module.name}: no steady motion: the forces balance at this position, but not further on: after "
                    f"{later.t - point.t:.4g} s {changed}. The motion with the prescribed speeds is periodic at best: "
                    "module.stability(fixed={...}) finds it and judges it")
    except (EvaluationError, ArgumentError):  # a position further on that the mechanism cannot reach is reported by the verdict
        return


def _warn_of_validity(search: Search) -> None:
    """Warn where validity checks of elements fail, and of forces that depend on time."""
    trial = search.best
    point, name = trial.point, trial.point.module.name
    if point.module.metadata.validity_checks:
        warn(point.module, point.evaluate(VALIDITY_CHECKS), "in equilibrium", 5)
    if "t" not in point.module.library("balance").metadata.arguments.get("balance", ()):
        return
    labels, allowed = coordinate_names(point.module.metadata), search.allowed(trial)
    try:
        changes = np.array([_along(trial, trial.point.at(t=point.t + later).forces - point.forces) for later in LATER])
    except EvaluationError:
        return
    k = int(np.argmax((np.abs(changes) / np.maximum(allowed, 1e-300)).max(axis=0)))
    if (np.abs(changes[:, k]) > allowed[k]).any():
        unit = force_unit(point.module.metadata.units.get(point.module.metadata.u[k], ""))
        warnings.warn(f"{name}: in equilibrium: forces depend on time, which stands still at t = {point.t:g} s: that along "
                      f"{labels[k]} changes by {np.abs(changes[:, k]).max():.3g} {unit}".rstrip() + f" within {LATER[-1]:g} s; "
                      "this is no state that lasts", SimulationWarning, stacklevel=5)


def _along(trial: Trial, forces: np.ndarray) -> np.ndarray:
    """The part of forces that must balance, by speeds, (n_u,)."""
    result: np.ndarray = trial.tested @ np.linalg.pinv(trial.tested) @ forces
    return result
