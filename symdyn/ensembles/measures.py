"""Values kept of a motion: a few numbers of a coordinate, speed, input, output or the energy, or what a function returns."""

from __future__ import annotations

import difflib
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from scipy.integrate import trapezoid

from symdyn.errors import ArgumentError
from symdyn.real_numbers import length_of, real_of
from symdyn.runtime.integrating.simulate import N_POINTS
from symdyn.runtime.memory import demand
from symdyn.runtime.solutions.sensitivity import OUTPUTS
from symdyn.shown import shown

if TYPE_CHECKING:
    from symdyn.runtime.module import Module
    from symdyn.runtime.solutions.solution import Solution

# (t (n_t,), values (n_t, ...)) -> result (...)
REDUCTIONS: dict[str, Callable[[np.ndarray, np.ndarray], np.ndarray]] = {
    "start": lambda t, y: y[0],
    "end": lambda t, y: y[-1],
    "min": lambda t, y: y.min(axis=0),
    "max": lambda t, y: y.max(axis=0),
    "mean": lambda t, y: trapezoid(y, t, axis=0) / (t[-1] - t[0]),
    "rms": lambda t, y: np.sqrt(trapezoid(y * y, t, axis=0) / (t[-1] - t[0])),
    "trace": lambda t, y: y,
}
# They need no more than the times they are about.
OF_ONE_TIME = ("start", "end", "at")
RESERVED = ("samples", "failed", "(failures)", "t", "about")
# Derivatives of these by numbers that a motion depends on: (t (n_t,), values (n_t, ...), derivatives (n_t, ..., n)) -> (..., n);
# of least and greatest values at the output time at which they are.
GRADIENTS: dict[str, Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray]] = {
    "start": lambda t, y, dy: dy[0],
    "end": lambda t, y, dy: dy[-1],
    "min": lambda t, y, dy: _at(dy, y.argmin(axis=0)),
    "max": lambda t, y, dy: _at(dy, y.argmax(axis=0)),
    "mean": lambda t, y, dy: trapezoid(dy, t, axis=0) / (t[-1] - t[0]),
    "rms": lambda t, y, dy: trapezoid(y[..., None] * dy, t, axis=0) / (
        (t[-1] - t[0]) * REDUCTIONS["rms"](t, y)[..., None]),
    "trace": lambda t, y, dy: dy,
}
_ASKED = re.compile(rf"(?P<grad>grad\s+)?(?P<kind>{'|'.join(REDUCTIONS)})\s+(?P<name>\S.*)")
_AT = re.compile(r"(?P<grad>grad\s+)?(?P<name>\S.*?)\s+at\s+(?P<time>[-+.\deE]+)")


def _at(rows: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Rows (n_t, ..., n) at a place along the first axis for each entry of the axes between, (..., n)."""
    return np.take_along_axis(rows, places[None, ..., None], axis=0)[0]


@dataclass(frozen=True)
class Measure:
    """One number, or an array, of every motion.

    label      its name in the results
    kind       one of REDUCTIONS, "at", or "function"
    grad       its derivatives by what sensitivities are by, in place of it
    """

    label: str
    kind: str
    name: str = ""
    time: float = 0.0
    function: Callable[[Solution], Any] | None = None
    grad: bool = False

    def of(self, solution: Solution) -> np.ndarray:
        """Its value. Errors of a function of the user pass through."""
        if self.function is not None:
            return real_of(self.function(solution), solution.module.name,
                           f"values of the outcome {shown(self.label)} must be numbers")
        values = values_of(solution, self.name)
        if not self.grad:
            return self.reduce(solution.t, values)
        return self.of_rows(solution.t, values, solution.sensitivity.of(self.name))

    def of_rows(self, t: np.ndarray, values: np.ndarray, derivatives: np.ndarray) -> np.ndarray:
        """Its derivatives from values over time, (n_t, ...), and their derivatives, (n_t, ..., n)."""
        if self.kind == "at":
            return self.reduce(t, derivatives)
        return np.asarray(GRADIENTS[self.kind](t, values, derivatives))

    def reduce(self, t: np.ndarray, values: np.ndarray) -> np.ndarray:
        """Its value from those over time, (n_t, ...)."""
        if self.kind == "at":
            return np.asarray(values[int(np.argmin(np.abs(t - self.time)))])
        return np.asarray(REDUCTIONS[self.kind](t, values))

    def record(self) -> str:
        """Record that distinguishes it from others."""
        function = self.function
        return f"{'grad ' * self.grad}{self.kind} {self.name}" if function is None else (
            f"{function.__module__}.{getattr(function, '__qualname__', repr(function))}")


def values_of(solution: Solution, name: str) -> np.ndarray:
    """A quantity over time, (n_t, ...)."""
    if name == "energy" and name not in solution.outputs:
        return solution.energy
    return solution[name]


def functions_of(module: Module, measures: Sequence[Measure]) -> list[str]:
    """Functions of the module that simulations and measures call."""
    there, constraints = module.functions, module.metadata.constraints
    names = {m.name for m in measures}
    wanted = ["rhs", *(("C", "lam") if constraints else ("mass_matrix",))]
    wanted += ["outputs"] * any(n in names for n, _ in module.metadata.outputs) + ["energy"] * ("energy" in names)
    wanted += [OUTPUTS] * any(n in {m.name for m in measures if m.grad} for n, _ in module.metadata.outputs)
    return [n for n in wanted if n in there or n == OUTPUTS]


def take_measures(asked: Any, module: Module) -> list[Measure]:
    """Measures as the user gave them, see `read_measures`. Raises ArgumentError with all that is wrong."""
    faults: list[str] = []
    result = read_measures(asked, module, faults)
    if faults:
        raise ArgumentError("\n".join(f"{module.name}: {fault}" for fault in faults))
    return result


def read_measures(asked: Any, module: Module, faults: list[str]) -> list[Measure]:
    """Measures as the user gave them; what is wrong is added to the faults.

    asked   None: the end of every coordinate, speed and extra state; texts "end q1", "max q1", "q1 at 2.5", or a mapping from
            labels to texts and to functions of a Solution
    """
    if asked is None:
        asked = [f"end {name}" for name in module.metadata.x]
    if isinstance(asked, str) or not isinstance(asked, (Sequence, Mapping)) or not asked:
        faults.append(f"outcomes must be a list of texts such as 'max q1', or a mapping, found {shown(asked, 80)}")
        return []
    result: list[Measure] = []
    for label, value in asked.items() if isinstance(asked, Mapping) else [(text, text) for text in asked]:
        measure = _measure(label, value, module, faults)
        if measure is None:
            continue
        if measure.label in RESERVED or "/" in measure.label or measure.label in [m.label for m in result]:
            faults.append(f"outcome {shown(measure.label)}: the name is taken; names must differ from each other and from "
                          f"{', '.join(RESERVED)}, and have no /")
        result.append(measure)
    return result


def _measure(label: Any, value: Any, module: Module, faults: list[str]) -> Measure | None:
    if callable(value) and isinstance(label, str):
        return Measure(label, "function", function=value)
    if callable(value):
        name = getattr(value, "__name__", "outcome")
        faults.append(f"outcome {shown(value, 80)}: a function needs a label in the results; pass a mapping such as "
                      f"{{'{name if name.isidentifier() else 'outcome'}': function}}")
        return None
    if not isinstance(value, str) or not isinstance(label, str):
        faults.append(f"outcome {shown(label)}: {shown(value, 80)} is neither a text such as 'max q1' nor a function")
        return None
    by_kind, at = _ASKED.fullmatch(value.strip()), _AT.fullmatch(value.strip())
    match = by_kind or at
    if match is None:
        faults.append(f"outcome {shown(value)}: write one of {', '.join(REDUCTIONS)} and a name, or a name, 'at' and a time; "
                      "with 'grad' before it for its derivatives")
        return None
    name, metadata = match["name"], module.metadata
    known = [*metadata.x, *metadata.inputs, *(n for n, _ in metadata.outputs),
             *(["energy"] if "energy" in metadata.functions else ()), *metadata.constraints]
    if name not in known:
        near = difflib.get_close_matches(name, known, 3)
        faults.append(f"outcome {shown(value)}: there is no {shown(name)}; "
                      + (f"did you mean {' or '.join(near)}?" if near else f"there are {', '.join(known)}"))
        return None
    grad, smooth = bool(match["grad"]), [*metadata.x, *(n for n, _ in metadata.outputs)]
    if grad and name not in smooth:
        faults.append(f"outcome {shown(value)}: there are no derivatives of {name}; there are those of {', '.join(smooth)}")
        return None
    if by_kind is not None:
        return Measure(label, by_kind["kind"], name, grad=grad)
    try:
        return Measure(label, "at", name, float(match["time"]), grad=grad)
    except ValueError:
        faults.append(f"outcome {shown(value)}: {shown(match['time'])} is not a time")
        return None


def output_times(t: Any, measures: Sequence[Measure], module: Module) -> np.ndarray:
    """The times that motions are computed at: no more than the measures need.

    t   as for `simulate`; the times of "at" are added to a pair (start, end)
    Raises ArgumentError for times that do not fit.
    """
    t = (0.0, module.metadata.duration) if t is None else t
    n = length_of(t)
    if n is not None:
        demand(4 * n, module.name, f"{n} output times", "pass fewer, or (start, end)")
    times = real_of(t, module.name, "t must be (start, end) or an array of times")
    way = np.sign(times[-1] - times[0]) if times.ndim == 1 and len(times) > 1 else 0.0
    if not (way and np.isfinite(times).all() and (np.diff(times) * way > 0).all()):
        raise ArgumentError(f"{module.name}: t must be (start, end) or an array of increasing or decreasing times, "
                            f"found {shown(t, 80)}")
    special = [m.time for m in measures if m.kind == "at"]
    outside = [f"{s:.6g}" for s in special if not min(times) <= s <= max(times)]
    if outside:
        raise ArgumentError(f"{module.name}: outcomes are asked for at {', '.join(outside)} s, outside of {times[0]:.6g} to "
                            f"{times[-1]:.6g} s")
    if isinstance(t, (tuple, list)) and len(t) == 2:
        if not all(m.kind in OF_ONE_TIME for m in measures):
            times = np.linspace(times[0], times[1], N_POINTS)
        return np.unique(np.concatenate([times, special]))[::int(way)]
    missing = [f"{s:.6g}" for s in special if np.abs(times - s).min() > 1e-9 * max(1.0, abs(s))]
    if missing:
        raise ArgumentError(f"{module.name}: outcomes are asked for at {', '.join(missing)} s, which t does not have")
    return times
