"""A state to check identities at, and the values of quantities there at high precision."""

from __future__ import annotations

import random
from collections.abc import Callable, Mapping, Sequence
from fractions import Fraction
from functools import cache, cached_property
from typing import Any

import mpmath
import numpy as np

from symdyn.formulation.equations import Equations
from symdyn.model.symbols import GivenMotion, GivenRate
from symdyn.tape.evaluate import evaluate
from symdyn.tape.tape import Tape

# Half a unit of the last place of doubles, relative; fractions of a denominator up to SHORT were given exactly.
ROUNDING = Fraction(1, 2**53)
SHORT = 10**6
# By how much rounding is enlarged to measure what it does: far above the residual that it has left, far below nonlinear effects.
ENLARGED = 1024


class Sample:
    """A random state with the values of quantities there, at high precision.

    numbers       whether all parameters have numbers that were given
    independent   places of constraint rows that imply the others
    constants     what stands in place of the constants of the tape (see symdyn.tape.evaluate); default: themselves
    """

    def __init__(self, equations: Equations, values: Mapping[str, Any], digits: int, numbers: bool,
                 independent: Sequence[int] = (), constants: Callable[[Fraction], Fraction] | None = None) -> None:
        self.equations = equations
        self.values = dict(values)
        self.digits = digits
        self.numbers = numbers
        self.independent = list(independent)
        self.constants = constants
        self.n_u = len(equations.symbols.speeds)

    def of(self, equations: Equations) -> Sample:
        """The same state of other equations."""
        return Sample(equations, self.values, self.digits, self.numbers, (), self.constants)

    def sharper(self, more: int) -> Sample:
        """The same state with so many digits more."""
        return Sample(self.equations, self.values, self.digits + more, self.numbers, self.independent, self.constants)

    def rounded(self, seed: int) -> Sample:
        """The same state with constants of the tape that are no short fractions changed as by rounding to doubles, but more.

        Every constant changes for itself, by a random part of up to 2^-53 of it, times ENLARGED; the same for the same seed.
        """
        @cache
        def changed(value: Fraction) -> Fraction:
            if value.denominator <= SHORT:
                return value
            return value * (1 + Fraction(random.Random(f"{seed} {value}").uniform(-1, 1)) * ROUNDING * ENLARGED)

        return Sample(self.equations, self.values, self.digits, self.numbers, self.independent, changed)

    def evaluate(self, tape: Tape, values: Mapping[str, Any] | None = None) -> dict[str, np.ndarray]:
        """Outputs of a tape at the state, or at other values."""
        return evaluate(tape, self.values if values is None else values, self.digits, self.constants)

    def has(self, *names: str) -> bool:
        return all(n in self.equations.quantities for n in names)

    def __getitem__(self, name: str) -> np.ndarray:
        return self.here[name]

    @cached_property
    def here(self) -> Values:
        return self.at({})

    def at(self, changes: Mapping[str, Any]) -> Values:
        """Quantities at the state with some values changed."""
        return Values(self, {**self.values, **changes})

    @cached_property
    def u(self) -> np.ndarray:
        return np.array([mpmath.mpf(self.values[s.name]) for s in self.equations.symbols.speeds], dtype=object)

    @cached_property
    def with_accelerations(self) -> Values:
        names = [f"{s.name}_dot" for s in self.equations.symbols.speeds]
        return self.at(dict(zip(names, self["accelerations"], strict=True)))

    def constraint_force(self) -> np.ndarray:
        """-C_r^T lam, (n_u,); zero without constraints."""
        if not self.equations.constraints:
            return np.zeros(self.n_u, dtype=object)
        return -(self["C_r"].T @ self["lam"])  # type: ignore[no-any-return]


class Values:
    """Quantities by name, evaluated when requested."""

    def __init__(self, sample: Sample, values: Mapping[str, Any]) -> None:
        self.sample = sample
        self.values = values
        self._known: dict[str, np.ndarray] = {}

    def __getitem__(self, name: str) -> np.ndarray:
        if name not in self._known:
            self._known[name] = self.sample.evaluate(self.sample.equations.tape(name), self.values)[name]
        return self._known[name]


def moved(s: Sample, values: Mapping[str, Any], step: Any, accelerating: bool = False) -> dict[str, Any]:
    """The state a moment later along the motion, some of its values changed before; speeds stay, or change as they do."""
    symbols = s.equations.symbols
    here = s.at(values)
    rates = dict(zip([q.name for q in symbols.coordinates], here["rates"], strict=True))
    if accelerating:
        rates.update(zip([u.name for u in symbols.speeds], here["accelerations"], strict=True))
    rates.update({z.name: here.values[z.dot.name] for z in symbols.inputs if isinstance(z, (GivenMotion, GivenRate))})
    later = {name: mpmath.mpf(here.values[name]) + step * rate for name, rate in rates.items()}
    return {**values, **later, "t": mpmath.mpf(here.values["t"]) + step}


def difference(s: Sample, quantity: str, values: Mapping[str, Any], accelerating: bool = False) -> np.ndarray:
    """Central difference of a quantity by time along the motion with some values changed."""
    step = mpmath.mpf(10) ** (-s.digits // 3)
    ends = [s.at(moved(s, values, sign * step, accelerating))[quantity] for sign in (1, -1)]
    return (ends[0] - ends[1]) / (2 * step)  # type: ignore[no-any-return]


def relative(difference: np.ndarray, terms: np.ndarray) -> float:
    """Largest entry of the difference over the largest of its terms."""
    size = max((abs(float(v)) for v in np.ravel(terms)), default=0.0)
    error = max((abs(float(v)) for v in np.ravel(difference)), default=0.0)
    return error / size if size > 0 else error
