"""Condition of the accelerations along a motion: condition numbers, and the places where they are worst."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from symdyn.runtime.integrating.charts import INSTEAD, distances
from symdyn.runtime.solutions.solution import Solution
from symdyn.stress.reference import DEPENDENT, conditions
from symdyn.stress.system_under_test import SystemUnderTest

STATES, BETWEEN = 1001, 101
RTOL = 1e-9
# A condition from which on accelerations lose the digits that usual tolerances need; rad from gimbal lock that count as near;
# so many peaks are reported.
NEAR, NEAR_LOCK, PEAKS = 1e6, 0.1, 5
# Parts of the weakest direction that are named, relative to its largest.
_NAMED = 0.3


@dataclass(frozen=True)
class Passage:
    """A time of the motion, s, what is there, and whether it is near a singularity."""

    t: float
    text: str
    near: bool


@dataclass(frozen=True)
class Along:
    """Conditions along a motion.

    solution   at STATES times; t (n_t,): these and those of closer looks at the worst places
    curves     label -> (n_t,); the last is of what accelerations come from
    passages   the worst of it, further peaks, passes of gimbal lock
    warnings   warnings of the run, and why it stopped early
    """

    solution: Solution
    t: np.ndarray
    curves: dict[str, np.ndarray]
    passages: tuple[Passage, ...]
    warnings: tuple[str, ...]

    @property
    def near(self) -> bool:
        """Whether some place is near a singularity."""
        return any(passage.near for passage in self.passages)


def along(tested: SystemUnderTest) -> Along:
    """The usual motion of a mechanism for its duration, with the conditions at STATES times and closer at the worst places."""
    sol = tested.run(np.linspace(0.0, tested.duration, STATES), rtol=RTOL)
    warnings = (*sol.warned, *([] if sol.success else [sol.message]))  # type: ignore[attr-defined]
    if not len(sol.t):
        return Along(sol, sol.t, {}, (), warnings)
    t, x = _closer(tested, sol.t, sol.x)
    curves = _curves(tested, t, x)
    passages = [*(_peaks(tested, t, x, list(curves.values())[-1]) if curves else ()), *_locks(tested, t, x)]
    return Along(sol, t, curves, tuple(sorted(passages, key=lambda p: p.t)), warnings)


def _curves(tested: SystemUnderTest, t: np.ndarray, x: np.ndarray) -> dict[str, np.ndarray]:
    if not tested.has("mass_matrix"):
        return {}
    n = len(tested.symbols.speeds)
    M = tested.evaluate("mass_matrix", t, x).reshape(-1, n, n)
    curves = {"mass matrix, in its units": np.array([_condition(m) for m in M]),
              "mass matrix, scaled": np.array([_condition(_scaled(m)) for m in M])}
    if tested.constrained:
        curves["mass matrix with constraints, scaled"] = conditions(tested, t, x)
    return curves


def _closer(tested: SystemUnderTest, t: np.ndarray, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """States with more of them on both sides of the worst, which may be narrow."""
    curves = _curves(tested, t, x)
    worst = [_highest(list(curves.values())[-1], 1.0)] if curves else []
    worst += [_highest(-d, -NEAR_LOCK) for d in distances(tested.module, x).T]
    times, states = [t], [x]
    for k in sorted({k for result in worst for k in result}):
        low, high = max(k - 1, 0), min(k + 1, len(t) - 1)
        if high <= low:
            continue
        sol = tested.run(np.linspace(t[low], t[high], BETWEEN), x[low], rtol=RTOL)
        if sol.success:
            times.append(sol.t[1:-1])
            states.append(sol.x[1:-1])
    every, passages = np.unique(np.concatenate(times), return_index=True)
    return every, np.concatenate(states)[passages]


def _highest(values: np.ndarray, least: float) -> list[int]:
    """The places of the highest peaks that reach `least`, the highest first; of the highest of all in any case."""
    high = np.where(np.isnan(values), np.inf, values)
    padded = np.concatenate([[-np.inf], high, [-np.inf]])
    peaks = [k for k in range(len(high)) if high[k] >= least and padded[k] < high[k] >= padded[k + 2]]
    return list(dict.fromkeys([int(high.argmax()), *sorted(peaks, key=lambda k: -high[k])]))[:PEAKS]


def _peaks(tested: SystemUnderTest, t: np.ndarray, x: np.ndarray, values: np.ndarray) -> list[Passage]:
    """The worst place, and the highest of the other peaks that are near a singularity."""
    high = np.where(np.isnan(values), np.inf, values)
    return [Passage(float(t[k]), _sentence(tested, t[k], x[k], float(high[k]), first=i == 0), bool(high[k] >= NEAR))
            for i, k in enumerate(_highest(values, NEAR))]


def _sentence(tested: SystemUnderTest, t: float, x: np.ndarray, value: float, first: bool) -> str:
    head = f"{'largest condition' if first else 'condition'} {value:.3g}"
    if not math.isfinite(value):
        return f"{head}: the accelerations are not determined"
    digits = math.ceil(math.log10(max(value, 1.0)))
    lost = f"costs up to {digits} of 16 digits" if value > 10 else "costs less than a digit"
    weakest = _weakest(tested, t, x)
    return f"{head}, {lost}" + (f"; least determined: {', '.join(weakest)}" if weakest else "")


def _weakest(tested: SystemUnderTest, t: float, x: np.ndarray) -> list[str]:
    """Accelerations and multipliers that the smallest singular value belongs to."""
    n = len(tested.symbols.speeds)
    matrix = _scaled(tested.evaluate("mass_matrix", t, x[None, :]).reshape(n, n))
    names = [u.dot.name for u in tested.symbols.speeds]
    if tested.constrained:
        rows = tested.evaluate("C_r", t, x[None, :]).reshape(-1, n)
        size = np.linalg.norm(rows, axis=1, keepdims=True)
        rows = rows / np.where(size > 0, size, 1.0)
        matrix = np.block([[matrix, rows.T], [rows, np.zeros((len(rows), len(rows)))]])
        names += [f"multiplier of {name}" for name in tested.equations.constraints]
    if n < 2 or not np.isfinite(matrix).all():
        return []
    _, values, vectors = np.linalg.svd(matrix)
    direction = np.abs(vectors[int(np.flatnonzero(values > DEPENDENT * 1e-4 * values[0])[-1])])
    return [names[k] for k in np.argsort(-direction) if direction[k] > _NAMED * direction.max()][:4]


def _locks(tested: SystemUnderTest, t: np.ndarray, x: np.ndarray) -> list[Passage]:
    """For the Euler angles of every joint where they come nearest to gimbal lock, and where else they come near."""
    result = []
    for (joint, sequence, *_), d in zip(tested.module.metadata.charts, distances(tested.module, x).T, strict=True):
        for k in _highest(-d, -NEAR_LOCK):
            near = bool(d[k] < NEAR_LOCK)
            advice = f": {INSTEAD}" if near else ""
            result.append(Passage(float(t[k]), f"the {sequence} angles of joint {joint} come within "
                                  f"{math.asin(min(1.0, d[k])):.2g} rad of gimbal lock{advice}", near))
    return result


def _condition(matrix: np.ndarray) -> float:
    """Ratio of the largest to the smallest singular value; not a number where an entry is none."""
    if not np.isfinite(matrix).all():
        return math.nan
    values = np.linalg.svd(matrix, compute_uv=False)
    return float(values[0] / values[-1]) if values[-1] > 0 else math.inf


def _scaled(matrix: np.ndarray) -> np.ndarray:
    """With ones on the diagonal, so that units do not count."""
    size = np.sqrt(np.abs(np.diagonal(matrix)))
    size = np.where(size > 0, size, 1.0)
    return np.asarray(matrix / size[:, None] / size[None, :])


def picture(result: Along) -> str:
    """The curves with the places, as the address of an <img>. Raises MissingExtra without matplotlib."""
    from symdyn.overview.pictures import figure, source

    drawing = figure((11.0, 3.6))
    axes: Any = drawing.add_subplot(111)
    styles = (1.0, "#9a9a9a"), (1.8, "#0072B2"), (1.8, "#D55E00")
    for (label, values), style in zip(result.curves.items(), styles, strict=False):
        axes.semilogy(result.t, np.where(np.isfinite(values), values, np.nan), label=label, linewidth=style[0], color=style[1])
    for t, label, near in _labels(result):
        axes.axvline(t, color="#b00020" if near else "#777777", linewidth=0.9, linestyle=":")
        axes.annotate(label, (t, 1.0), xycoords=("data", "axes fraction"), xytext=(0, 2), textcoords="offset points",
                      ha="center", va="bottom", fontsize=8, color="#b00020" if near else "#555555")
    low, high = axes.get_ylim()
    if high < 30 * low:  # a decade at least, so that a constant does not look like a storm
        axes.set_ylim(max(low / 3, 0.5), high * 3)
    axes.set_xlabel("t [s]")
    axes.set_ylabel("condition number")
    axes.grid(True, which="major", alpha=0.35)
    axes.margins(x=0.01)
    axes.legend(frameon=False, fontsize=9, loc="upper left", bbox_to_anchor=(1.0, 1.0))
    return source(drawing)


def _labels(result: Along) -> list[tuple[float, str, bool]]:
    """Times with the numbers of the places there, those that lie close together as one."""
    labels: list[tuple[float, str, bool]] = []
    for k, passage in enumerate(result.passages, 1):
        if labels and passage.t - labels[-1][0] <= 0.02 * (result.t[-1] - result.t[0]):
            t, label, near = labels[-1]
            labels[-1] = t, f"{label}, {k}", near or passage.near
        else:
            labels.append((passage.t, str(k), passage.near))
    return labels
