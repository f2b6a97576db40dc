"""Problem of optimization, checked: bounds, ends, constraints and costs, in the order of the module's names."""

from __future__ import annotations

import difflib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
import sympy as sp
from sympy.logic.boolalg import BooleanFalse, BooleanTrue

from symdyn.arguments import take
from symdyn.errors import ArgumentError, UnsupportedExpression
from symdyn.optimal.expressions import Expressions
from symdyn.optimal.field import Arguments
from symdyn.optimal.functions import WithFunctions
from symdyn.optimal.jumping import jumping
from symdyn.optimal.outputs import WithOutputs
from symdyn.real_numbers import NotReal, number
from symdyn.runtime.losses import Loss, output_names
from symdyn.runtime.masses import real_parameters
from symdyn.shown import by_name, name_of, shown

if TYPE_CHECKING:
    from symdyn.runtime.module import Module

FREE = (-np.inf, np.inf)
# Characters of a condition that messages and multipliers name it by.
LONGEST = 120
# Names of functions with kinks or jumps.
KINKED = (sp.Abs, sp.Max, sp.Min, sp.sign, sp.Heaviside, sp.Piecewise, sp.floor, sp.ceiling)


@dataclass(frozen=True)
class Conditions:
    """Expressions between bounds: least <= values <= most, (m,); texts: as the user wrote them."""

    expressions: Expressions | WithOutputs
    least: np.ndarray
    most: np.ndarray
    texts: tuple[str, ...]


@dataclass(frozen=True)
class Problem:
    """See `optimize` for what these are. Pairs of bounds are (2, n): least and most.

    p          (n_p,) values of all parameters, guesses of the free ones; duration (2,), equal if it is prescribed
    start, end, states, inputs, rates, params   bounds, (2, n); params: of the free ones
    integrand  by [x; inputs; free parameters; t]; path: at all times, by the same
    end_cost, boundary   by [x at the start; x; inputs; free parameters; t], at the end
    timed      which of the rates "rhs", "outputs" and constraints "C" depend on t where the duration is free
    kinks      parts of the cost that have kinks or jumps, as texts
    jumps      what to say of costs and conditions that jump
    """

    module: Module
    of: Arguments
    p: np.ndarray
    t0: float
    duration: np.ndarray
    start: np.ndarray
    end: np.ndarray
    states: np.ndarray
    inputs: np.ndarray
    rates: np.ndarray
    params: np.ndarray
    integrand: Expressions | WithOutputs | WithFunctions
    end_cost: Expressions | WithOutputs | WithFunctions
    path: Conditions
    boundary: Conditions
    timed: frozenset[str]
    kinks: tuple[str, ...]
    jumps: tuple[str, ...]

    @property
    def free(self) -> tuple[str, ...]:
        """Names of the free parameters."""
        return tuple(self.module.metadata.parameters[k] for k in self.of.free)


class Faults:
    """Collects what does not fit, to be raised at once."""

    def __init__(self, owner: str) -> None:
        self.owner, self.found = owner, list[str]()

    def add(self, fault: str) -> None:
        self.found.append(fault)

    def demand_none(self) -> None:
        """Raises ArgumentError with all of them."""
        if self.found:
            raise ArgumentError(f"{self.owner}: {'; '.join(self.found)}")

    def name(self, key: Any, there: Sequence[str], what: str) -> str | None:
        """The name of a key that is there; None, and a fault, where it is not."""
        name = str(name_of(key))
        if name in there:
            return name
        near = difflib.get_close_matches(name, there, 3)
        self.add(f"{what} has {shown(name)}, which is not there; " + (f"did you mean {' or '.join(near)}?" if near else
                                                                    f"there are {', '.join(there) or 'none'}"))
        return None


def problem_of(module: Module, cost: Any, duration: Any, start: Any, end: Any, bounds: Any, rates: Any, path: Any, boundary: Any,
               parameters: Any, params: Any, inputs: Any, t: Any) -> Problem:
    """The problem, checked. Raises ArgumentError with all faults."""
    metadata, faults = module.metadata, Faults(module.name)
    if metadata.motions:
        raise ArgumentError(f"{module.name}: optimize was called for a mechanism with motions as inputs "
                            f"({', '.join(metadata.motions)}), whose rates and accelerations are not free; make the joint a "
                            "coordinate and drive it by a force")
    resets = [event.name for event in metadata.events if event.reset]
    if resets:
        raise ArgumentError(f"{module.name}: optimize was called, and the events {', '.join(resets)} reset the "
                            "state; a motion is optimized between two of them: leave the events out, and write what they do as "
                            "boundary conditions")
    free_bounds = _free_parameters(metadata, parameters, faults)
    names = list(free_bounds)
    p = _values_of_parameters(module, params, free_bounds)
    of = Arguments(len(metadata.x), len(metadata.inputs), tuple(metadata.parameters.index(n) for n in names))
    for name, (low, high) in free_bounds.items():
        value = p[metadata.parameters.index(name)]
        if not low <= value <= high:
            faults.add(f"the value {value:g} of parameter {name}, from which the search begins, is not between its bounds "
                       f"({low:g}, {high:g}); pass another one in params")
    t0 = _number(t, faults, "t, the time at the start,")
    T = _duration(duration, faults)
    limits = _pairs(bounds, (*metadata.x, *metadata.inputs), "bounds", faults)
    states = np.array([limits.get(n, FREE) for n in metadata.x]).reshape(-1, 2).T
    of_inputs = np.array([limits.get(n, FREE) for n in metadata.inputs]).reshape(-1, 2).T
    for name, value in _pairs(inputs, metadata.inputs, "inputs", faults, single=True).items():
        of_inputs[:, metadata.inputs.index(name)] = value
        if name in limits:
            faults.add(f"{name} has bounds and a prescribed value; leave one of them out")
    found_rates = _pairs(rates, metadata.inputs, "rates", faults)
    of_rates = np.array([found_rates.get(n, FREE) for n in metadata.inputs]).reshape(-1, 2).T
    begin, stop = _ends(metadata, start, end, states, faults)
    point = (*metadata.x, *metadata.inputs, *names, "t")
    both = (*[f"{n}(0)" for n in metadata.x], *point)
    constants = {n: float(v) for n, v in zip(metadata.parameters, p, strict=True) if n not in names}
    timed = _timed(module, p) if T[0] < T[1] else frozenset[str]()
    along_it = _Read(module, of, p, point, 0, constants, "outputs" in timed, faults, ("t",) if T[0] == T[1] else (), [])
    at_both = replace(along_it, names=both, first=of.n_x, jumps=[])
    losses = list(cost) if isinstance(cost, (list, tuple)) else [cost]
    if not losses or not all(isinstance(one, Loss) for one in losses):
        faults.add(f"the cost is {shown(cost)}; pass sd.Loss(integral=..., end=...), or several, which are added up")
        losses = []
    integrand = along_it.cost([one.integral for one in losses], "the integral of the cost")
    end_cost = at_both.cost([one.end for one in losses], "the end of the cost")
    along, at_ends = _conditions(path, "path", along_it), _conditions(boundary, "boundary", at_both)
    faults.demand_none()
    if T[0] < T[1]:
        times, x = (t0, t0 + T[0], t0 + T[1]), begin.clip(-1e3, 1e3).mean(axis=0)
        for made in (integrand, end_cost):
            if isinstance(made, WithFunctions) and made.depend_on_time(times, x):
                faults.add(f"the duration is free, and a function for {made.what} depends on t, by which it gives no derivative; "
                           "give the duration as a number, or write the cost as an expression")
        faults.demand_none()
    assert integrand is not None and end_cost is not None and along is not None and at_ends is not None
    params_bounds = np.array(list(free_bounds.values())).reshape(-1, 2).T
    return Problem(module, of, p, t0, T, begin, stop, states, of_inputs, of_rates, params_bounds, integrand, end_cost, along,
                   at_ends, timed, _kinks([e for one in losses for e in (one.integral, one.end)]),
                   (*along_it.jumps, *at_both.jumps))


def _kinks(expressions: Sequence[Any]) -> tuple[str, ...]:
    result = {str(part) for e in expressions if isinstance(e, sp.Basic) for part in e.atoms(*KINKED)}
    return tuple(sorted(result))


def _free_parameters(metadata: Any, given: Any, faults: Faults) -> dict[str, tuple[float, float]]:
    if given is None:
        return {}
    if not isinstance(given, Mapping):
        faults.add(f"parameters is {shown(given)}; pass a mapping from names to bounds (least, most)")
        return {}
    result = _pairs(given, metadata.parameters, "parameters", faults)
    return {n: result[n] for n in metadata.parameters if n in result}


def _values_of_parameters(module: Module, params: Any, free: Mapping[str, tuple[float, float]]) -> np.ndarray:
    """Values of all parameters; a free one without a value begins in the middle of its bounds."""
    metadata = module.metadata
    defaults = dict(zip(metadata.parameters, metadata.defaults, strict=True))
    given = {str(name_of(key)) for key in params} if isinstance(params, Mapping) else set()
    if params is None or isinstance(params, Mapping):
        middle = {name: (low + high) / 2 for name, (low, high) in free.items()
                  if name not in given and defaults[name] is None and np.isfinite(low + high)}
        params = {**by_name(params or {}), **middle}
    return np.array(real_parameters(module, params))


def _number(value: Any, faults: Faults, what: str) -> float:
    try:
        result = number(value)
    except NotReal:
        result = np.nan
    if not np.isfinite(result):
        faults.add(f"{what} is {shown(value)}; pass a finite number")
        return 0.0
    return result


def _duration(given: Any, faults: Faults) -> np.ndarray:
    pair = given if isinstance(given, (list, tuple)) else (given, given)
    try:
        result = np.array([number(v) for v in pair])
    except NotReal:
        result = np.zeros(0)
    if result.shape != (2,) or not np.isfinite(result).all() or not 0 < result[0] <= result[1]:
        faults.add(f"duration is {shown(given)}; pass a positive number of seconds, or (least, most) for one that is free")
        return np.ones(2)
    return result


def _pairs(given: Any, there: Sequence[str], what: str, faults: Faults, single: bool = False) -> dict[str, tuple[float, float]]:
    """Name -> (least, most); a number stands for both, None for no bounds."""
    if given is None:
        return {}
    if not isinstance(given, Mapping):
        faults.add(f"{what} is {shown(given)}; pass a mapping from names or symbols")
        return {}
    result = {}
    for key, value in given.items():
        name = faults.name(key, there, what)
        pair = FREE if value is None and not single else value if isinstance(value, (list, tuple)) else (value, value)
        try:
            numbers = tuple(number(v) for v in pair)
        except NotReal:
            numbers = ()
        if name is None:
            continue
        if len(numbers) != 2 or np.isnan(numbers).any() or (single and numbers[0] != numbers[1]):
            faults.add(f"{what} of {name} is {shown(value)}; pass " + ("a number" if single else "a number or (least, most)"))
        elif numbers[0] > numbers[1] or np.inf == numbers[0] or -np.inf == numbers[1]:
            faults.add(f"{what} of {name} contradict each other: at least {numbers[0]:g} and at most {numbers[1]:g}")
        else:
            result[name] = (numbers[0], numbers[1])
    return result


def _ends(metadata: Any, start: Any, end: Any, states: np.ndarray, faults: Faults) -> tuple[np.ndarray, np.ndarray]:
    """Bounds of the state at the start and at the end, (2, n_x) each."""
    result = []
    for what, given in (("start", start), ("end", end)):
        left_out = {n: (metadata.initial.get(n, 0.0),) * 2 if what == "start" else FREE for n in metadata.x}
        if isinstance(given, str) and given == "free":
            given = dict.fromkeys(metadata.x)
        elif given is not None and not isinstance(given, Mapping):
            try:
                given = dict(zip(metadata.x, take(given, metadata.x, what, {}, "").tolist(), strict=True))
            except ArgumentError as error:
                faults.add(str(error).removeprefix(": "))
                given = {}
        pairs = {**left_out, **_pairs(given, metadata.x, what, faults)}
        both = np.array([pairs[n] for n in metadata.x]).T
        for name, (low, high), (least, most) in zip(metadata.x, both.T, states.T, strict=True):
            if low > most or high < least:
                faults.add(f"the {what} of {name}, {low:g}" + (f" to {high:g}" if high > low else "") + f", is outside of its "
                           f"bounds ({least:g}, {most:g})")
        result.append(np.array([np.maximum(both[0], states[0]), np.minimum(both[1], states[1])]))
    return result[0], result[1]


@dataclass(frozen=True)
class _Read:
    """Takes expressions over: names of their arguments, in which [x; inputs; free parameters; t] begin at `first`; fixed: those
    that are given; jumps: collects what to say of expressions that jump."""

    module: Module
    of: Arguments
    p: np.ndarray
    names: tuple[str, ...]
    first: int
    constants: Mapping[str, float]
    timed: bool
    faults: Faults
    fixed: tuple[str, ...]
    jumps: list[str]

    def one(self, given: Any, what: str) -> sp.Expr:
        """An expression; 0, and a fault, for what is none."""
        if given is None:
            return sp.S.Zero
        try:
            result = sp.sympify(given, strict=True)
            if not isinstance(result, sp.Expr):
                raise TypeError
        except (sp.SympifyError, TypeError):
            self.faults.add(f"{what} is {shown(given)}; pass an expression of coordinates, speeds, inputs, parameters, outputs "
                            "and sd.t")
            return sp.S.Zero
        there = (*self.names, *self.constants, *output_names(self.module))
        unknown = sorted({str(s) for s in result.free_symbols} - set(there))
        if unknown:
            self.faults.add(f"{what} has {', '.join(unknown)}, which is not there; there are {', '.join(there)}")
            return sp.S.Zero
        return result

    def cost(self, given: Sequence[Any], what: str) -> Expressions | WithOutputs | WithFunctions | None:
        """Costs, added up; None, and a fault, for what has no derivatives."""
        functions = [one for one in given if callable(one) and not hasattr(one, "free_symbols")]
        total = sum((self.one(one, what) for one in given if one not in functions), sp.S.Zero)
        made = self.rows([total], what, [what])
        if made is None or not functions:
            return made
        return WithFunctions(made, functions, what, self.module, self.of, self.p, self.first)

    def rows(self, given: Sequence[sp.Expr], what: str, each: Sequence[str]) -> Expressions | WithOutputs | None:
        """Expressions as a function; None, and a fault, for what has no derivatives. what, each: as messages call them."""
        outputs = output_names(self.module)
        used = not set(outputs).isdisjoint(str(s) for e in given for s in e.free_symbols)
        names = (*self.names, *outputs) if used else self.names
        try:
            made = Expressions(given, names, self.constants)
        except UnsupportedExpression as error:
            self.faults.add(f"{what}: {error}")
            return None
        for expression, text in zip(given, each, strict=True):
            result = jumping(expression, names, self.constants, self.fixed)
            self.jumps.extend(f"{text} jumps by {jump['what']} where {jump['surface']} passes zero (write {jump['remedy']})"
                              for jump in result)
        return WithOutputs(made, self.module, self.of, self.p, self.first, self.timed) if used else made


def _conditions(given: Any, what: str, read: _Read) -> Conditions | None:
    listed = list(given) if isinstance(given, (list, tuple)) else [given]
    expressions, least, most, texts = [], [], [], list[str]()
    for relation in listed:
        if isinstance(relation, (bool, BooleanTrue, BooleanFalse)):
            read.faults.add(f"a condition of {what} is {relation} whatever the motion is; it must depend on it")
            continue
        if not isinstance(relation, (sp.Eq, sp.Le, sp.Ge, sp.Lt, sp.Gt)):
            read.faults.add(f"a condition of {what} is {shown(relation)}; write sp.Eq(a, b), a <= b or a >= b")
            continue
        text = str(relation) if not isinstance(relation, sp.Eq) else f"{relation.lhs} = {relation.rhs}"
        expressions.append(read.one(relation.lhs - relation.rhs, f"the condition {text} of {what}"))
        least.append(-np.inf if isinstance(relation, (sp.Le, sp.Lt)) else 0.0)
        most.append(np.inf if isinstance(relation, (sp.Ge, sp.Gt)) else 0.0)
        texts.append(text if len(text) <= LONGEST else f"{text[:LONGEST]} ... ({len(texts) + 1})")
    made = read.rows(expressions, what, [f"the condition {text} of {what}" for text in texts])
    return None if made is None else Conditions(made, np.array(least), np.array(most), tuple(texts))


def _timed(module: Module, p: np.ndarray) -> frozenset[str]:
    """Those of rates, outputs and constraints that depend on t."""
    groups = {"rhs": ("rhs",), "outputs": ("outputs",) if module.metadata.outputs else (),
              "C": ("C", "C_dot") if module.metadata.constraints else ()}
    return frozenset(what for what, names in groups.items() if any(_depends_on_time(module, name, p) for name in names))


def _depends_on_time(module: Module, name: str, p: np.ndarray) -> bool:
    """Whether a function depends on the time, by structure, or where this is not known by its values at two times."""
    result = module.structure(f"{name}_by_t")
    if result is not None:
        return bool(result.any())
    x = np.array([module.metadata.initial.get(n, 0.0) for n in module.metadata.x]) + 0.1
    first, second = (module.evaluate(name, t, x, p) for t in (0.1, 0.7351))
    return not np.array_equal(first, second)
