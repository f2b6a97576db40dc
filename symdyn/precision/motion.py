"""Motions at more digits than floats have, from the same tape as the generated code."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import mpmath

from symdyn.formulation.equations import Equations
from symdyn.precision import quad
from symdyn.precision.extrapolation import Rule, Sides, integrate, midpoint
from symdyn.precision.program import Lost, decimal, program

# Decimal digits of a stored motion's local errors, and how many more the second run has, which shows convergence.
DIGITS = 26
MORE = 4
# Computed with this many more digits than the local errors have.
SPARE = 12
_ROUNDS = 8
HOW = ("Gragg-Bulirsch-Stoer extrapolation of the accelerations on the tape {}, projected onto the constraints after "
       "every step; parameters and start are the catalogue's decimal numbers, the start projected; made by "
       "symdyn bench extended")
KINKS = "; steps end at the kinks of the right-hand side, {} of them, located to the digits of the tolerance"
WITH = ("with mpmath", f"in C with numbers of {quad.BITS} binary digits")


@dataclass(frozen=True)
class Motion:
    """The end of a motion: numbers of an mpmath context, in SI units.

    q, u, u_dot   coordinates, speeds, accelerations; lam: multipliers, (n_c,)
    n_steps, n_evaluations   what it took; digits: of the tolerance
    kinks   times at which kinks were crossed
    """

    t: Any
    q: list[Any]
    u: list[Any]
    u_dot: list[Any]
    lam: list[Any]
    digits: int
    n_steps: int
    n_evaluations: int
    kinks: tuple[Any, ...] = ()


class Precise:
    """The equations of a mechanism with numbers of `digits` decimal digits: parameters and start as decimals.

    compiled   in C with those of symdyn.precision.quad instead, as far as there is C of them
    """

    def __init__(self, equations: Equations, digits: int, compiled: bool = False) -> None:
        self.equations, self.digits, self.compiled = equations, quad.DIGITS if compiled else digits, compiled
        self.context = mpmath.mp.clone()
        self.context.dps = digits
        if compiled:
            self.context.prec = quad.BITS
        symbols = equations.symbols
        names = lambda group: [s.name for s in group]
        initial = {str(key): value for key, value in symbols.initial.items()}
        defaults = {str(key): value for key, value in symbols.defaults.items()}
        self.leaves = ["t", *names(symbols.coordinates), *names(symbols.speeds), *names(symbols.states)]
        self.n_q, self.n_u = len(symbols.coordinates), len(symbols.speeds)
        self.fixed = {name: decimal(self.context, (defaults | initial).get(name, 0.0))
                      for name in (*names(symbols.parameters), *names(symbols.inputs))}
        self.start = [decimal(self.context, initial.get(name, 0.0)) for name in self.leaves[1:]]
        self.n_c = len(equations.constraints)
        self._programs: dict[str, Callable[[Sequence[Any]], list[Any]]] = {}
        self._usual: dict[str, Callable[[Sequence[Any]], list[Any]]] = {}

    def __call__(self, name: str, t: Any, x: Sequence[Any]) -> list[Any]:
        """A quantity at a state, its entries one after the other; where its divisors vanish the equations for that case."""
        return self._program(name)([t, *x])

    def sides(self) -> Sides | None:
        """Side of its kinks that the right-hand side is on: of events whose reset changes nothing, which end steps. None where
        there are none."""
        places = [k for k, event in enumerate(self.equations.events) if event.reset and all(a == b for a, b in event.reset)]
        if not places:
            return None

        def sides(t: Any, x: Sequence[Any]) -> list[bool]:
            values = self("events", t, x)
            return [bool(values[k] > 0) for k in places]

        return sides

    def _program(self, name: str) -> Callable[[Sequence[Any]], list[Any]]:
        if name not in self._programs:
            usual = self._made(self.equations, name)
            self._programs[name] = self._usual[name] = usual
            if self.equations.singular_fallback is not None:
                known: list[Callable[[Sequence[Any]], list[Any]]] = []

                def either(x: Sequence[Any]) -> list[Any]:
                    try:
                        return usual(x)
                    except Lost:
                        if not known:
                            known.append(self._made(self.equations.singular_fallback, name))
                        return known[0](x)

                self._programs[name] = either
        return self._programs[name]

    def rule(self) -> Rule | None:
        """The midpoint rule for the states, compiled; None if it is not."""
        self._program("rhs")
        made = self._usual["rhs"]
        if not isinstance(made, quad.Compiled):
            return None

        def either(t: Any, x: Sequence[Any], begin: Sequence[Any], h: Any, n: int) -> list[Any]:
            try:
                return made.midpoint(t, x, begin, h, n)
            except Lost:
                return midpoint(partial(self, "rhs"), t, x, begin, h, n)

        return either

    def _made(self, equations: Any, name: str) -> Callable[[Sequence[Any]], list[Any]]:
        if self.compiled:
            try:
                return quad.program(equations.tape(name), self.context, self.fixed, self.leaves)
            except quad.NotInQuad:
                pass
        return program(equations.tape(name), self.context, self.fixed, self.leaves)

    def projected(self, t: Any, x: list[Any]) -> list[Any]:
        """The state on the constraints to all digits but a few, by the smallest change in the metric of the mass matrix.

        Raises TooRough if there is no way back.
        """
        if not self.n_c:
            return x
        x = list(x)
        for name, part in (("position_correction", slice(0, self.n_q)),
                           ("velocity_correction", slice(self.n_q, self.n_q + self.n_u))):
            before = self.context.inf
            for _ in range(_ROUNDS):
                row = self(name, t, x)
                left = max(abs(e) for e in row[:self.n_c])
                enough = self.context.mpf(10) ** (4 - self.digits) * max([1, *[abs(e) for e in x[part]]])
                if left <= enough or left >= before:
                    break
                before = left
                x[part] = [a + b for a, b in zip(x[part], row[self.n_c:], strict=True)]
            if left > 1e6 * enough:
                raise quad.TooRough(f"{self.equations.name}: constraints stay violated by {self.context.nstr(left, 3)} at t = "
                                  f"{self.context.nstr(t, 10)}")
        return x


def motion(equations: Equations, end: Any, digits: int = DIGITS, compiled: bool = False) -> Motion:
    """The motion from the catalogue's start at t = 0 until `end` (s), local errors of 10^-digits; compiled: see Precise."""
    precise = Precise(equations, digits + SPARE, compiled)
    context = precise.context
    zero, last = context.mpf(0), decimal(context, end)
    n_q, n_u = precise.n_q, precise.n_u
    run = integrate(lambda t, x: precise("rhs", t, x), (zero, last), precise.projected(zero, precise.start),
                    context.mpf(10) ** -digits, [slice(0, n_q), slice(n_q, n_q + n_u), slice(n_q + n_u, None)], context,
                    precise.projected, precise.rule(), precise.sides())
    lam = precise("lam", last, run.x) if precise.n_c else []
    return Motion(last, run.x[:n_q], run.x[n_q:n_q + n_u], precise("rhs", last, run.x)[n_q:n_q + n_u], lam, digits, run.n_steps,
                  run.n_evaluations, run.kinks)


def agreement(a: Motion, b: Motion) -> float:
    """The largest difference of q, u, u_dot, lam, relative, entry by entry; entries below 1e-6 of the largest count as that."""
    worst = 0.0
    for name in ("q", "u", "u_dot", "lam"):
        ours, others = getattr(a, name), getattr(b, name)
        least = max((abs(e) for e in others), default=0) / 10**6 or 1
        worst = max(worst, *[float(abs(e - f) / max(abs(f), least)) for e, f in zip(ours, others, strict=True)], 0.0)
    return worst


def record(equations: Equations, end: Any, digits: int = DIGITS) -> dict[str, Any]:
    """Record of a motion to store: the digits in which runs at two tolerances agree, and what they took."""
    coarse, fine, compiled = quad.twice(lambda n, compiled: motion(equations, end, n, compiled), digits, MORE)
    differ = agreement(coarse, fine)
    held = min(digits, int(-mpmath.log10(max(differ, 1e-50))))
    text = {"q": fine.q, "q_dot": fine.u, "q_ddot": fine.u_dot, "lambda": fine.lam}
    source = HOW.format(WITH[compiled]) + (KINKS.format(len(fine.kinks)) if fine.kinks else "")
    return {"source": source, "t": float(end), "digits": held,
            "tolerances": [f"1e-{n}" for n in (digits, digits + MORE)], "runs_differ_by": float(f"{differ:.2g}"),
            "steps": [coarse.n_steps, fine.n_steps], "evaluations": [coarse.n_evaluations, fine.n_evaluations],
            **{name: [mpmath.nstr(e, held, min_fixed=-5, max_fixed=30, strip_zeros=False) for e in values]
               for name, values in text.items()}}
