"""Sensitivities that a run is asked for: what they are by, where they start, what they need, and what tolerances they have."""

from __future__ import annotations

import difflib
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np

from symdyn.errors import ArgumentError, EvaluationError
from symdyn.real_numbers import real_of
from symdyn.runtime.constraints import holding
from symdyn.runtime.integrating.at_kinks import staying
from symdyn.runtime.integrating.grazing import grazing, jumping, without_rate
from symdyn.runtime.integrating.methods import COMPILED
from symdyn.runtime.integrating.outcome import Outcome, Request, accumulations
from symdyn.runtime.integrating.without_effect import ROUNDING, unaffected
from symdyn.shown import name_of, shown

if TYPE_CHECKING:
    from symdyn.runtime.inputs.inputs import Inputs
    from symdyn.runtime.module import Module

_INITIAL = re.compile(r"(?P<name>.+)\(0\)")
# The part of a row up to which the sides of a surface are approached.
CLOSE = 1e-12
# An absolute tolerance that no error comes near.
_ANY = 1e300


@dataclass(frozen=True)
class Asked:
    """Sensitivities of one run, a column each.

    names     as they are called: parameters, inputs, "q1(0)" for initial values
    columns   as the right-hand side has them, see symdyn.backend.right_side.RightSide
    starts    derivatives of the initial state, (n_columns, n_x)
    sizes     of what the columns are by, (n_columns,): a derivative counts as its change over one of these
    """

    names: tuple[str, ...]
    columns: tuple[str, ...]
    starts: np.ndarray
    sizes: np.ndarray

    @classmethod
    def of(cls, module: Module, given: Any, p: np.ndarray, inputs: Inputs) -> Asked:
        """Sensitivities requested by parameters, inputs and initial values. Raises ArgumentError for what does not fit."""
        metadata = module.metadata
        n_x = metadata.sizes.x
        if given is None:
            return cls((), (), np.zeros((0, n_x)), np.zeros(0))
        faults: list[str] = []
        by = names_of(module, given, faults)
        faults += [f"a sensitivity by the input {name} was asked for, which varies over time here; only constant inputs "
                   "have one. Make what it follows a parameter of the system"
                   for name in by if name in metadata.inputs and name in inputs.varying(metadata.inputs)]
        faults += [f"a sensitivity by {name} was asked for, but {name} says in which mode the contact {record.name} is, which "
                   "follows from the motion; leave it out"
                   for record in metadata.contacts for name in by if name in record.parameters]
        if faults:
            raise ArgumentError(f"{module.name}: {'; '.join(faults)}")
        columns, starts = [], []
        along = _given_starts(module, given)
        for name, state in by.items():
            start = np.zeros(n_x)
            if name in along:
                start = along[name]
            elif state:
                start[metadata.x.index(state)] = 1.0
            columns.append("" if state else name)
            starts.append(start)
        names = list(by)
        sizes = sizes_of(module, columns, np.concatenate([inputs.constant, p]))
        return cls(tuple(names), tuple(columns), np.array(starts).reshape(len(names), n_x), sizes)

    def added_to(self, request: Request, controlled: bool, inputs: Sequence[str]) -> Request:
        """The request with the columns behind the state; inputs: names.

        Tolerances are such that the error of the state, and of every column if they are controlled, is within what was requested
        in its own root mean square: they count in that of all entries.
        """
        rtol, atol = tolerances(request.rtol, request.atol, self.sizes, controlled)
        names = [name for k, name in enumerate(inputs) if k in request.inputs.indices] if request.inputs.are_held else []
        followed = [inputs[index] for indices, *_ in request.inputs.gradients for index in indices]
        return replace(request, held=tuple(names), followed=tuple(followed), rtol=rtol,
                       x0=np.concatenate([request.x0, self.starts.ravel()]), atol=atol, columns=self.columns)

    def check(self, module: Module, request: Request, method: Any, work: bool) -> None:
        """Raises ArgumentError where a run cannot have sensitivities."""
        if method == "moreau":
            raise ArgumentError(f"{module.name}: sensitivities were asked for with method='moreau', and time stepping has none; "
                                "leave out the method: impacts are located then, and sensitivities carried across them")
        if not isinstance(method, str) or method not in COMPILED or module.backend != "c":
            raise ArgumentError(f"{module.name}: sensitivities were asked for with method {shown(method)} on the backend "
                                f"{module.backend}; only compiled methods integrate them: compile(backend='c') and "
                                f"method='dop853', or another of {', '.join(COMPILED)}")
        if request.stabilization.way == "baumgarte":
            raise ArgumentError(f"{module.name}: sensitivities were asked for with Baumgarte's stabilization; they are those of "
                                "the projected motion: leave stabilization out")
        if work:
            raise ArgumentError(f"{module.name}: sensitivities were asked for together with work=True; make two runs")
        if any(one.sampled.gradient is None for one in request.inputs.samplers):
            raise ArgumentError(f"{module.name}: sensitivities were asked for, but the derivatives of a sampled controller by "
                                "the state are not known; pass sd.Sampled(function, period, gradient=...), a function of (t, x)")
        unknown = _depend_on_state(request) - {index for indices, *_ in request.inputs.gradients for index in indices}
        if unknown:
            names = ", ".join(module.metadata.inputs[k] for k in sorted(unknown))
            raise ArgumentError(f"{module.name}: sensitivities were asked for, but inputs follow the state through a function of "
                                f"the user, whose derivatives are not known: {names}; pass sd.Smooth(function, gradient=...), a "
                                "function of (t, x), write the law into the system's loads as expressions of coordinates and "
                                "speeds, or make the inputs functions of the time alone")
        request.inputs.demand_true_slopes(request.span[0], request.x0[:request.n_state])

        changed = [name for name in self.columns if name in module.metadata.parameters]
        held = ", ".join(holding(module, request.span[0], request.x0[:request.n_state], request.p, changed))
        if held:
            raise ArgumentError(f"{module.name}: sensitivities by {held} were asked for, but the constraints depend on each "
                                f"other at the start, and to first order no position fulfils them when {held} changes alone: let "
                                "other parameters follow from one, as expressions of it, or leave out what is redundant")

    def doubts(self, module: Module, request: Request, outcome: Outcome, steps: Callable[[], Outcome]) -> list[str]:
        """Warnings: columns in which everything is zero all along, jumps that no event looks for, events that graze, kinks
        that the motion stays at. steps: the same motion with a row for every step, made only where the right-hand side may jump,
        or not depend on a parameter."""
        if not self.names or len(outcome.x) < 2:
            return []
        n_x, known = module.metadata.sizes.x, cache(steps)
        jumps = unseen_jumps(module, request, known()) if module.metadata.switches else []
        but = f"{module.name}: nothing in this motion depends on"
        columns = outcome.x[:, n_x:].reshape(len(outcome.x), len(self.names), n_x)
        nothing = [name for k, name in enumerate(self.names) if not columns[:, k].any()]
        moved = _moving_jumps(module, request, known(), nothing) if module.metadata.switches else {}
        result = [f"{module.name}: {name} moves a jump of the right-hand side, where {surface} passes zero, and nothing else "
                  "here: without an event there its sensitivity is zero, which is that between jumps; add an event, "
                  f"system.add_event(name, {surface})" for name, surface in moved.items()]
        nothing = [name for name in nothing if name not in moved]
        if nothing:
            result.append(zeros(module, nothing))
        cancel = self._cancelling(module, request, outcome, columns[0], known, [*nothing, *moved])
        if cancel:
            result.append(f"{but} {', '.join(cancel)}, which cancel{'s' if len(cancel) == 1 else ''} in its equations: the "
                          "sensitivities are zero, and the numbers what is left of rounding")
        return [*result, *gathered(module, outcome), *jumps, *_grazing(module, request, outcome),
                *staying(module, request, outcome.t, outcome.x[:, :n_x])]

    def _cancelling(self, module: Module, request: Request, outcome: Outcome, start: np.ndarray, steps: Callable[[], Outcome],
                    nothing: Sequence[str]) -> list[str]:
        """Names without effect that have sensitivities, which are rounding; start: rows of the sensitivities at the start, where
        those by what constraints contain are not zero."""
        n_x = module.metadata.sizes.x
        size = ROUNDING * np.abs(outcome.x[:, :n_x]).max(initial=0.0)
        asked = [name for k, name in enumerate(self.names)
                 if self.columns[k] and name not in nothing and (self.sizes[k] * np.abs(start[k]) <= size).all()]
        if module.metadata.contacts:  # whose modes say which equations hold
            return []
        asked = unaffected(module, request, asked, outcome.t[[0, -1]], outcome.x[[0, -1], :n_x]) if asked else []
        if not asked:
            return []
        run = steps()
        return unaffected(module, request, asked, run.t, run.x[:, :n_x])


def zeros(module: Module, names: Sequence[str]) -> str:
    """Warning where a motion does not depend on these."""
    return f"{module.name}: nothing in this motion depends on {', '.join(names)}: the sensitivities are zero"


def sizes_of(module: Module, columns: Sequence[str], values: np.ndarray) -> np.ndarray:
    """Sizes of what columns are by, (..., n_columns), from the values of inputs and parameters, (..., n_in + n_p)."""
    known = [*module.metadata.inputs, *module.metadata.parameters]
    result = np.ones((*values.shape[:-1], len(columns)))
    for k, name in enumerate(columns):
        if name:
            result[..., k] = np.abs(values[..., known.index(name)])
    result[result == 0] = 1.0
    return result


def tolerances(rtol: float, atol: np.ndarray, sizes: np.ndarray, controlled: bool) -> tuple[float, np.ndarray]:
    """Relative and absolute tolerances, (..., n_x (1 + n_columns)), of a state with its columns; sizes: (..., n_columns)."""
    part = 1.0 / np.sqrt(1.0 + sizes.shape[-1])
    of_columns = part * atol / sizes[..., None] if controlled else np.full((*sizes.shape, len(atol)), _ANY)
    of_state = np.broadcast_to(part * atol, (*sizes.shape[:-1], len(atol)))
    return part * rtol, np.concatenate([of_state, of_columns.reshape(*sizes.shape[:-1], -1)], axis=-1)


def _moving_jumps(module: Module, request: Request, outcome: Outcome, names: Sequence[str]) -> dict[str, str]:
    """Those of some parameters and inputs that what passes zero at a jump depends on -> the first such surface that passes it."""
    metadata = module.metadata
    asked = [name for name in names if name in metadata.parameters or name in metadata.inputs]
    if not asked:
        return {}
    t, x = outcome.t, outcome.x[:, :metadata.sizes.x]
    inputs = np.broadcast_to(request.inputs.rows(t, x), (len(t), len(metadata.inputs)))
    signs = np.sign(module.evaluate("switches", t, x, request.p, inputs))
    result: dict[str, str] = {}
    for k, jump in enumerate(metadata.switches):
        rows = np.flatnonzero(signs[1:, k] * signs[:-1, k] <= 0)
        if len(rows):
            J = module.jacobian(t[rows], x[rows], request.p, inputs[rows], ["params", "inputs"], "switches")
            slopes = np.concatenate([np.asarray(J.params)[:, k], np.asarray(J.inputs)[:, k]], axis=1)
            by = (slopes != 0).any(axis=0)
            known = dict(zip((*metadata.parameters, *metadata.inputs), by.tolist(), strict=True))
            result |= {name: jump.surface for name in asked if known[name] and name not in result}
    return result


def _depend_on_state(request: Request) -> set[int]:
    """Places of inputs that a function gives other values where every entry of the state is another one."""
    if request.inputs.function is None:
        return set()
    t, x = request.span[0], request.x0[:request.n_state]
    here = request.inputs.at(t, x)
    sides = [request.inputs.at(t, x + way * (0.01 + 0.01 * np.abs(x))) for way in (-1.0, 1.0)]
    moved = [(here != side) & ~(np.isnan(here) & np.isnan(side)) for side in sides]
    return set(np.flatnonzero(moved[0] | moved[1]).tolist())


def gathered(module: Module, outcome: Outcome) -> list[str]:
    """Warnings where impacts accumulate."""
    return [f"{module.name}: the impacts of {name} accumulate at t = {end:.6g} s, and what is left of them from t = {begin:.6g} "
            "s on, within the tolerances of the motion, is left out: derivatives after it lose digits, those by a restitution "
            "most of all; end the motion before it, or compare with differences"
            for name, begin, end in accumulations(outcome, [one.name for one in module.metadata.contacts])]


def _grazing(module: Module, request: Request, outcome: Outcome) -> list[str]:
    """Warning of the first event with an effect that grazes."""
    n_x, records = module.metadata.sizes.x, module.metadata.events
    happened = [one for one in outcome.happened if not records[one.event].stop]
    if not happened:
        return []
    t, k = np.array([one.t for one in happened]), np.array([one.event for one in happened])
    before, after = (np.array(rows)[:, :n_x] for rows in zip(*[(one.before, one.after) for one in happened], strict=True))
    size = np.maximum(np.abs(outcome.x[:, :n_x]).max(axis=0), np.abs(before).max(axis=0))
    matter = (before != after).any(axis=1) | jumping(module, request, t, before, after, size)
    t, k, before = t[matter], k[matter], before[matter]
    graze = grazing(module, request, t, before, k, size) if len(t) else np.zeros(0, dtype=bool)
    return [without_rate(module, int(k[graze][0]), float(t[graze][0]))] if graze.any() else []


def unseen_jumps(module: Module, request: Request, outcome: Outcome) -> list[str]:
    """Where the right-hand side may have jumped between two rows of the motion without an event at that time."""
    known = module.metadata.switches
    if not known or len(outcome.t) < 2:
        return []
    x = outcome.x[:, :module.metadata.sizes.x]
    signs = np.sign(module.evaluate("switches", outcome.t, x, request.p, request.inputs.rows(outcome.t, x)))
    for k, jump in enumerate(known):
        for row in np.flatnonzero(signs[1:, k] * signs[:-1, k] < 0):
            begin, end = sorted(outcome.t[row:row + 2])
            if not any(begin <= one.t <= end for one in outcome.happened) and _jumps(module, request, outcome.t, x, int(row), k):
                return [f"{module.name}: the right-hand side may jump where {jump.surface} passes zero ({jump.what}), as near "
                        f"t = {end:.6g} s, without an event there: the sensitivities lack their jump; add an event, "
                        f"system.add_event(name, {jump.surface})"]
    return []


def _jumps(module: Module, request: Request, t: np.ndarray, x: np.ndarray, row: int, k: int) -> bool:
    """Whether the right-hand side jumps where a surface passes zero between two rows of a motion, on the chord from one to the
    other; that of a law in pieces may be continuous there."""
    begin, end = 0.0, 1.0
    at = lambda part: (t[row] + part * (t[row + 1] - t[row]), x[row] + part * (x[row + 1] - x[row]))

    def value(what: str, part: float) -> np.ndarray:
        time, state = at(part)
        return module.evaluate(what, time, state, request.p, request.inputs.rows(np.array([time]), state[None, :])[0])

    try:
        sign = np.sign(value("switches", begin)[k])
        while end - begin > CLOSE:
            middle = 0.5 * (begin + end)
            begin, end = (middle, end) if np.sign(value("switches", middle)[k]) == sign else (begin, middle)
        before, after = value("rhs", begin), value("rhs", end)
    except EvaluationError:
        return True
    return bool((np.abs(after - before) > np.sqrt(CLOSE) * max(np.abs(before).max(), np.abs(after).max())).any())


def names_of(module: Module, given: Any, faults: list[str]) -> dict[str, str]:
    """Names that sensitivities are by: parameters, inputs, initial values with the state they are of; faults are added."""
    metadata = module.metadata
    if isinstance(given, (str, bytes)) or not hasattr(given, "__iter__"):
        parameter = f"{metadata.parameters[0]!r}, " if metadata.parameters else ""
        faults.append(f"sensitivities is {shown(given)}; pass a list of parameters, inputs and initial values, such as "
                      f"[{parameter}'{metadata.x[0]}(0)']")
        return {}
    result: dict[str, str] = {}
    constant = {*metadata.parameters, *metadata.inputs}
    for one in given:
        name = name_of(one) if not isinstance(one, str) else one
        initial = _INITIAL.fullmatch(name) if isinstance(name, str) and name.endswith(")") else None
        if name in result:
            faults.append(f"sensitivities name {name} twice; leave one out")
        elif initial and initial["name"].strip() in metadata.x:
            result[name] = initial["name"].strip()
        elif isinstance(name, str) and name in constant:
            result[name] = ""
        else:
            faults.append(_unknown(module, name))
    return result


def _given_starts(module: Module, given: Any) -> dict[str, np.ndarray]:
    """Derivatives of the start by name, (n_x,) each, of a mapping; of a list none."""
    if not isinstance(given, Mapping):
        return {}
    n_x, result = module.metadata.sizes.x, {}
    for key, value in given.items():
        what = f"the derivative of the start by {name_of(key)}"
        row = real_of(value, module.name, f"{what} must be numbers")
        if row.shape != (n_x,) or not np.isfinite(row).all():
            raise ArgumentError(f"{module.name}: sensitivities give {shown(value)} as {what}; pass {n_x} finite "
                                f"numbers, those of {', '.join(module.metadata.x)}")
        result[str(name_of(key))] = np.array(row, dtype=float)
    return result


def _unknown(module: Module, name: Any) -> str:
    metadata = module.metadata
    if name in metadata.x:
        return f"a sensitivity by {name} was asked for, which is a state; for that by its initial value pass '{name}(0)'"
    known = [*metadata.parameters, *metadata.inputs, *[f"{x}(0)" for x in metadata.x]]
    near = difflib.get_close_matches(str(name), known, 3)
    return (f"a sensitivity by {shown(name)} was asked for, which is neither a parameter, an input nor the "
            "initial value of a state; "
            + (f"did you mean {' or '.join(near)}?" if near else f"there are {', '.join(known[:20])}"))
