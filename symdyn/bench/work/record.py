"""Record of measurements: rows of figures, and what was left out with the reason."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, fields
from typing import Any

NAN = math.nan
# Key that distinguishes rows: formulation, method, tolerance, step.
Key = tuple[str, str, float | None, float | None]
# A median this many times the least time shows other work on the machine.
DISTURBED = 1.25
# Types of figures -> what they may be in a file.
_PLAIN: dict[str, tuple[type, ...]] = {"str": (str,), "int": (int,), "bool": (bool,), "float": (int, float),
                                       "float | None": (int, float, type(None))}


@dataclass(frozen=True)
class Row:
    """One run: a formulation with a method at one tolerance, or with one step.

    formulation, method   names as they are requested; peer: the method is another program's
    tolerance, step       relative and absolute tolerance of a step, or its length, s; the other is None
    seconds               inside the integrator, median of `repeats` runs; least: the shortest of them
    evaluations, steps    of the right-hand side; accepted ones. 0 where a peer does not report it
    operations            evaluations times the operations of the right-hand side's tape; 0 of peers, and of taylor, whose
                          evaluations are orders of series
    error                 at the end, norm-wise relative: the larger of error_q and error_u (see `system_under_test.Comparison`)
    error_q, error_u      of coordinates and of speeds, or of poses and velocities of all bodies
    errors                of the state at each time of the reference; worst: the largest of them
    until                 time inside the integrator, s, and evaluations of runs that end at each time of the reference; not
                          numbers and zeros where that is of no interest
    energy_error          see Solution.energy_error; not a number where the energy is not known
    constraint_error      largest residual relative to the mechanism's length, and of the norms of Euler parameters
    message               empty, or why the run stopped early
    chosen, why           of "auto": the method that it took, and a sentence on why; empty of others
    earlier               when it was timed, if that was in an earlier run that this one went on with, else empty
    took                  all that it took to measure the row for the first time, s, with compilation
    """

    formulation: str
    method: str
    tolerance: float | None = None
    step: float | None = None
    seconds: float = NAN
    least: float = NAN
    repeats: int = 0
    evaluations: int = 0
    steps: int = 0
    operations: int = 0
    error: float = NAN
    error_q: float = NAN
    error_u: float = NAN
    errors: tuple[float, ...] = ()
    until: tuple[tuple[float, int], ...] = ()
    energy_error: float = NAN
    constraint_error: float = NAN
    peer: bool = False
    message: str = ""
    chosen: str = ""
    why: str = ""
    earlier: str = ""
    took: float = NAN

    @property
    def key(self) -> Key:
        """Key that distinguishes rows."""
        return self.formulation, self.method, self.tolerance, self.step

    @property
    def disturbed(self) -> bool:
        """Whether the machine had other work: the median is far above the least time."""
        return self.repeats > 1 and self.seconds > DISTURBED * self.least

    @property
    def time(self) -> float:
        """Compared time, s: the least one, since the runs are the same, bit by bit, and other work only lengthens them."""
        return self.least

    @property
    def worst(self) -> float:
        """The largest error at the times of the reference."""
        known = [e for e in self.errors if not math.isnan(e)]
        return max(known, default=NAN)

    @property
    def line(self) -> str:
        """Name of the line in pictures that the row is a point of."""
        return self.method if self.peer else f"{self.formulation}, {self.method}"

    @property
    def label(self) -> str:
        """The method, and of "auto" what it chose."""
        return f"{self.method} ({self.chosen})" if self.chosen else self.method

    @property
    def setting(self) -> str:
        """Tolerance or step as text."""
        return f"{self.tolerance:.0e}" if self.tolerance is not None else f"h={self.step:.3g}"

    def error_at(self, index: int | None) -> float:
        """The error at one of the reference's times; None: at the end."""
        return self.error if index is None else self.errors[index] if index < len(self.errors) else NAN

    def time_at(self, index: int | None) -> float:
        """Compared time of runs until one of the reference's times, s; None: the end."""
        return self._until(index)[0]

    def evaluations_at(self, index: int | None) -> int:
        """Evaluations of runs until one of the reference's times; None: the end."""
        return self._until(index)[1]

    def _until(self, index: int | None) -> tuple[float, int]:
        if index is None:
            return self.time, self.evaluations
        return self.until[index] if index < len(self.until) else (NAN, 0)

    def record(self) -> dict[str, Any]:
        """As plain data; figures that are not known are None."""
        return {k: _plain(v) for k, v in asdict(self).items()}

    @classmethod
    def of(cls, data: Mapping[str, Any]) -> Row:
        """From plain data. Raises TypeError, ValueError or AttributeError for what is none of a row."""
        known = {f.name: f for f in fields(cls)}
        may_be_none = ("tolerance", "step")
        values: dict[str, Any] = {k: NAN if v is None and k not in may_be_none else v for k, v in data.items() if k in known}
        values["errors"] = tuple(NAN if e is None else float(e) for e in data.get("errors", ()))
        values["until"] = tuple((NAN if s is None else float(s), int(n)) for s, n in data.get("until", ()))
        for name, value in values.items():
            wanted = _PLAIN.get(str(known[name].type))
            if wanted is not None and not isinstance(value, wanted):
                raise TypeError(f"{name} of a row is {value!r}")
        return cls(**values)


@dataclass(frozen=True)
class Skipped:
    """Line that was not measured, and why; an empty method stands for all of them."""

    formulation: str
    method: str
    why: str

    def __str__(self) -> str:
        return f"{', '.join(part for part in (self.formulation, self.method) if part)}: {self.why}"


@dataclass(frozen=True)
class Reference:
    """Reference of errors: states in the coordinates of the first formulation.

    kind      "closed form", "extended" or "agreement"
    times     s, increasing, the last is the end; x (n_t, n_x)
    digits    to which it is converged, norm-wise relative
    how       how that was shown, one sentence
    names     of the entries of x
    made      whether it was made in this run, as opposed to found
    """

    kind: str
    times: tuple[float, ...]
    x: Sequence[Sequence[float]]
    digits: float
    how: str
    names: tuple[str, ...] = ()
    made: bool = field(default=False, compare=False)

    def __str__(self) -> str:
        return f"{self.kind}, {self.digits:.3g} digits: {self.how}"


def _plain(value: Any) -> Any:
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    return [_plain(v) for v in value] if isinstance(value, (list, tuple)) else value
