"""States of a motion at given times with more digits than floats have, from the compiled tape, and proof of the digits."""

from __future__ import annotations

import time as clock
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from symdyn.bench.work.record import Reference
from symdyn.bench.work.system_under_test import Formulation
from symdyn.errors import SymdynError
from symdyn.precision import quad
from symdyn.precision.extrapolation import integrate
from symdyn.precision.motion import MORE, SPARE, WITH, Precise

# Decimal digits of the local errors; the second run, which shows that they suffice, has more of them.
DIGITS = 20
# Evaluations that such a run takes for each that Dormand and Prince's method takes at the tightest tolerance of floats, on the
# catalogue 1.3 to 3.1; both runs together.
_EVALUATIONS = 6.0
_TIGHTEST = 1e-13
_SAMPLES = 5


class TooLong(SymdynError):
    """A reference takes more time than there is."""


class Exact(Precise):
    """The equations with the very floats of the compiled module as parameters and start."""

    def __init__(self, formulation: Formulation, digits: int, compiled: bool = False) -> None:
        super().__init__(formulation.equations, digits, compiled)
        number, module = self.context.mpf, formulation.module
        given = {**dict(zip(module.metadata.parameters, module.default_parameters, strict=True)),
                 **{n: module.metadata.initial.get(n, 0.0) for n in module.metadata.inputs}}
        self.fixed = {name: number(float(value)) for name, value in given.items()}
        self.start = [number(float(v)) for v in formulation.x0]
        for group in module.metadata.unit_groups:
            places = [module.metadata.x.index(name) for name in group]
            norm = self.context.sqrt(sum(self.start[k]**2 for k in places))
            for k in places:
                self.start[k] /= norm


def states(formulation: Formulation, times: Sequence[float], digits: int, until: float = np.inf,
           log: Callable[[float], None] = lambda t: None, compiled: bool = False) -> list[list[Any]]:
    """The states at these times, numbers of an mpmath context; local errors of 10^-digits.

    until   of time.perf_counter; log: called with the time reached; compiled: see Precise
    Raises TooLong past it; SymdynError where the equations cannot be evaluated or the steps vanish.
    """
    precise = Exact(formulation, digits + SPARE, compiled)
    context, n_q, n_u = precise.context, precise.n_q, precise.n_u
    groups = [slice(0, n_q), slice(n_q, n_q + n_u), slice(n_q + n_u, None)]

    def field(t: Any, x: Sequence[Any]) -> list[Any]:
        if clock.perf_counter() > until:
            raise TooLong(f"the motion at {digits} digits got to t = {context.nstr(t, 4)} s in the time there was")
        return precise("rhs", t, x)

    def corrected(t: Any, x: list[Any]) -> list[Any]:
        log(float(t))
        return precise.projected(t, x)

    now, result = context.mpf(0), []
    x = precise.projected(now, precise.start)
    for t in times:
        goal = context.mpf(float(t))
        try:
            x = integrate(field, (now, goal), x, context.mpf(10) ** -digits, groups, context, corrected,
                          precise.rule()).x
        except ArithmeticError as error:  # of the integrator and of numbers
            raise quad.TooRough(f"the motion at {digits} digits stops: {error}") from None
        now = goal
        result.append(x)
    return result


def expected_seconds(formulation: Formulation, end: float, digits: int = DIGITS) -> float:
    """About how long both runs of `converged` take, s."""
    precise = Exact(formulation, digits + SPARE, quad.suits(digits + MORE))
    zero = precise.context.mpf(0)
    precise("rhs", zero, precise.start)
    begun = clock.perf_counter()
    for _ in range(_SAMPLES):
        precise("rhs", zero, precise.start)
    one = (clock.perf_counter() - begun) / _SAMPLES
    run = formulation.module.simulate(np.array([0.0, end]), rtol=_TIGHTEST)
    return one * run.nfev * _EVALUATIONS


def converged(formulation: Formulation, times: Sequence[float], digits: int = DIGITS, until: float = np.inf,
              log: Callable[[float], None] = lambda t: None) -> tuple[Reference, list[list[str]]]:
    """The motion at two tolerances: the reference, and its states as text of as many digits as both runs agree in.

    Raises TooLong past `until` (of time.perf_counter), SymdynError where a run stops.
    """
    coarse, fine, compiled = quad.twice(lambda n, compiled: states(formulation, times, n, until, log, compiled), digits, MORE)
    differ = distance(coarse, fine, len(formulation.equations.symbols.coordinates), len(formulation.equations.symbols.speeds))
    kept = float(min(digits, -np.log10(max(differ, 1e-40))))
    if kept < 1:
        raise SymdynError(f"runs of tolerance 1e-{digits} and 1e-{digits + MORE} differ by {differ:.1e}, norm-wise relative")
    text = [[_text(v, max(17, round(kept) + 1)) for v in x] for x in fine]
    how = (f"Gragg-Bulirsch-Stoer extrapolation of the compiled tape {WITH[compiled]}; runs of tolerance 1e-{digits} and "
           f"1e-{digits + MORE} differ by {differ:.1e}")
    return Reference("extended", tuple(float(t) for t in times), [[float(v) for v in x] for x in fine], kept, how,
                     formulation.coordinates, True), text


def distance(a: Sequence[Sequence[Any]], b: Sequence[Sequence[Any]], n_q: int, n_u: int) -> float:
    """The largest difference of coordinates and of speeds over all times, relative to their largest norm; NaN differs by inf."""
    worst = 0.0
    for part in (slice(0, n_q), slice(n_q, n_q + n_u), slice(n_q + n_u, None)):
        size = max((sum(v * v for v in x[part]) for x in b), default=0) ** 0.5
        apart = max((sum((v - w) ** 2 for v, w in zip(x[part], y[part], strict=True)) for x, y in zip(a, b, strict=True)),
                    default=0) ** 0.5
        far = float(apart / size) if size else 0.0
        worst = max(worst, far if far == far else np.inf)
    return worst


def _text(value: Any, digits: int) -> str:
    import mpmath

    return str(mpmath.nstr(value, digits, min_fixed=-5, max_fixed=30))
