"""heyoka: Taylor series of adaptive order, compiled for the machine, on our right-hand side with parameters as numbers.

Source: Biscani and Izzo, Revisiting high-order Taylor methods for astrodynamics and celestial mechanics, Mon. Not. R. Astron.
Soc. 504 (2021).
"""

from __future__ import annotations

import importlib.util
import time as clock
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from symdyn.bench.toolchain import version
from symdyn.bench.work.against.peer import Failed, Ran, Runner
from symdyn.bench.work.against.walk import ARITHMETIC, ELEMENTARY, right_hand_side

# Operations of a right-hand side times the order: up to here a step is compiled as one piece of straight-line code, which is two
# to ten times as fast as its compact mode and takes up to half a minute to compile.
_STRAIGHT = 15_000
_FINEST = 1e-15
_FIRST = 4  # steps


@dataclass(frozen=True)
class Heyoka:
    """The integrator."""

    name: str = "heyoka"
    bodies = False

    @property
    def title(self) -> str:
        return f"heyoka {version('heyoka')} Taylor series; our right-hand side, parameters as numbers"

    def available(self) -> bool | str:
        there = importlib.util.find_spec("heyoka") is not None
        return there or "heyoka is not installed; run: pip install 'symdyn[peers]'"

    def prepare(self, equations: Any, params: np.ndarray, x0: np.ndarray, end: float, system: Any = None) -> Runner:
        import heyoka as hy

        symbols = equations.symbols
        names = [s.name for s in (*symbols.coordinates, *symbols.speeds, *symbols.states)]
        variables = hy.make_vars(*names) if len(names) > 1 else [hy.make_vars(*names)]
        rates = right_hand_side(equations, params, {"t": hy.time, **dict(zip(names, variables, strict=True))}, _functions(hy),
                                "heyoka")
        field = [(x, hy.expression(rate)) for x, rate in zip(variables, rates, strict=True)]
        operations = equations.tape("rhs").operations
        made: dict[float, Any] = {}

        def integrator(tolerance: float) -> Any:
            if tolerance not in made:
                order = np.ceil(1 - np.log(tolerance) / 2)
                made[tolerance] = hy.taylor_adaptive(field, np.array(x0, dtype=float), tol=tolerance, fast_math=True,
                                                     compact_mode=bool(operations * order > _STRAIGHT))
            return made[tolerance]

        limits: list[tuple[float, float]] = []

        def run(tolerance: float, times: np.ndarray | None = None) -> Ran:
            if not limits:
                limits.append(_limits(integrator(_FINEST), x0, end))
            first, longest = limits[0]
            chosen = integrator(max(tolerance, _FINEST))
            chosen.time, chosen.state[:] = 0.0, x0
            parts = []
            begun = clock.perf_counter()
            for until, step in ((_FIRST * first, first), (end, longest)):
                outcome, *_, part, _ = chosen.propagate_until(until, max_delta_t=step, c_output=times is not None)
                parts.append((until, part))
                if outcome != hy.taylor_outcome.time_limit:
                    break
            seconds = clock.perf_counter() - begun
            if outcome != hy.taylor_outcome.time_limit:
                raise Failed(f"heyoka at {tolerance:g}: {str(outcome).rpartition('.')[2]} at t = {chosen.time:.6g} s")
            if times is None:
                return seconds, 0, chosen.state.copy()
            split = parts[0][0]
            return seconds, 0, np.vstack([part(times[(times <= split) == early]) for early, (_, part) in zip(
                (True, False), parts, strict=True) if np.any((times <= split) == early)])

        return run


def _limits(chosen: Any, x0: np.ndarray, end: float) -> tuple[float, float]:
    """The longest that the first steps, and the others, should be, s, from those at the finest tolerance.

    The length of a step follows from two derivatives alone, and is much the same at all tolerances. Both may vanish at a start
    at rest, and the whole motion would be one step.
    """
    chosen.time, chosen.state[:] = 0.0, x0
    first = min(*[float(chosen.step()[1]) for _ in range(_FIRST)], end / (2 * _FIRST))
    chosen.time, chosen.state[:] = 0.0, x0
    chosen.propagate_until(_FIRST * first, max_delta_t=first)
    return first, 2 * float(chosen.propagate_until(end)[2])


def _functions(hy: Any) -> Mapping[str, Callable[..., Any]]:
    """Operation of the tape -> heyoka's expression."""
    own = {name: getattr(hy, name) for name in (*ELEMENTARY, "lt", "gt", "eq", "select")}
    return {**own, **ARITHMETIC, "le": hy.lte, "ge": hy.gte, "ne": hy.neq, "and": lambda a, b: hy.logical_and([a, b]),
            "or": lambda a, b: hy.logical_or([a, b]), "not": lambda a: hy.eq(a, hy.expression(0.0)),
            "abs": lambda a: hy.select(hy.lt(a, hy.expression(0.0)), -a, a),
            "min": lambda a, b: hy.select(hy.lt(hy.expression(a), hy.expression(b)), hy.expression(a), hy.expression(b)),
            "max": lambda a, b: hy.select(hy.gt(hy.expression(a), hy.expression(b)), hy.expression(a), hy.expression(b))}


PEERS = (Heyoka(),)
