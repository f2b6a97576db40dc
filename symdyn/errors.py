"""Errors that symdyn raises; each message says what was asked, what was found, what to do."""

from __future__ import annotations

from collections.abc import Sequence


def no_value(names: Sequence[str]) -> str:
    """Message about parameters, or other quantities by name, that have neither a value nor a default."""
    return f"no value for {', '.join(names)}, which {'have' if len(names) > 1 else 'has'} no default"


class SymdynError(Exception):
    """Base of all errors of symdyn."""


class ModelError(SymdynError):
    """The description of a mechanism has faults; `faults` lists all of them."""

    def __init__(self, faults: Sequence[str], name: str = "") -> None:
        self.faults = tuple(faults)
        head = f"the model {name!r} has {len(self.faults)} faults:\n" if len(self.faults) > 1 else ""
        mark = "  - " if head else ""
        super().__init__(head + "\n".join(mark + fault for fault in self.faults))


class UnsupportedExpression(SymdynError):
    """An expression has a part that cannot be evaluated in generated code."""


class CompileError(SymdynError):
    """A C compiler rejected generated code, or the library it built cannot be loaded."""


class CacheError(CompileError):
    """Generated code cannot be kept in the cache folder: the disk is full, or something else has its name."""


class CacheWarning(UserWarning):
    """The cache folder is open to others, so that nothing is loaded from it; the message names the folder that is used."""


class CompilerNotFound(SymdynError):
    """There is no usable C compiler, or not the one that was requested."""


class CompilerWarning(UserWarning):
    """Warns that written files have no binary, because there is no C compiler for it; the message says how they can be used."""


class ModelWarning(UserWarning):
    """A description that can be computed with but that no real mechanism has."""


class ArgumentError(SymdynError, ValueError):
    """A call was given values that do not fit: wrong length, unknown or missing names, not finite."""


class EvaluationError(SymdynError, ArithmeticError):
    """The equations cannot be evaluated at a state; the message says which value and where."""


class EvaluationWarning(UserWarning):
    """Some of many states cannot be evaluated; their results are NaN, and the message says which, and why."""


class SimulationWarning(UserWarning):
    """A simulation stopped early; the solution up to there is kept, and its message says when, where and why."""


class SimulationInterrupted(KeyboardInterrupt):
    """A simulation was interrupted; `solution` holds what was computed up to there.

    >>> issubclass(sd.SimulationInterrupted, KeyboardInterrupt)
    True
    """

    def __init__(self, solution: object, message: str) -> None:
        super().__init__(message)
        self.solution = solution


class RotationError(SymdynError, ValueError):
    """A rotation cannot be described as asked; the base of the four below."""


class GimbalLock(RotationError):
    """At these Euler angles the rates of the angles do not exist."""


class NotARotation(RotationError):
    """A matrix is not orthogonal with determinant 1; the message says how far it is from that."""


class ZeroAxis(RotationError):
    """An axis of length zero has no direction."""


class NotNormalized(RotationError):
    """Euler parameters are not a unit vector."""


class CaseError(SymdynError, ValueError):
    """A case of printed and derived formulas has faults; `faults` lists all of them, `name` is the case's."""

    def __init__(self, faults: Sequence[str], name: str = "") -> None:
        self.faults = tuple(faults)
        self.name = name
        several = len(self.faults) > 1
        head = f"the case {name!r} has {len(self.faults)} faults:\n" if several else f"the case {name!r}: " if name else ""
        mark = "  - " if several else ""
        super().__init__(head + "\n".join(mark + fault for fault in self.faults))

    def __reduce__(self) -> tuple[type[CaseError], tuple[tuple[str, ...], str]]:
        return CaseError, (self.faults, self.name)  # so that it comes whole from another process


class UnknownCase(SymdynError, KeyError):
    """There is no case of that name; the message offers the nearest names."""

    def __str__(self) -> str:
        return str(self.args[0])


class MissingExtra(SymdynError, ImportError):
    """Something optional is not installed; the message says how to get it."""


class NoEquilibrium(SymdynError, ArithmeticError):
    """No state of rest, or no periodic motion, was found; the message says what is left, in numbers. `found` holds the motions
    that were found before, where several were to be followed."""

    def __init__(self, message: str = "", result: Sequence[object] = ()) -> None:
        super().__init__(message)
        self.found = list(result)


class EquilibriumNotUnique(NoEquilibrium):
    """Something can move without any stiffness; the message names the direction."""


class NoOptimum(SymdynError, ArithmeticError):
    """No optimal motion was found; the message reports which condition is violated and by how much, `optimum` holds what was
    computed."""

    def __init__(self, message: str, optimum: object) -> None:
        super().__init__(message)
        self.optimum = optimum


class OptimumWarning(UserWarning):
    """An optimal motion is less exact than requested; the message reports by how much."""


class EnsembleStopped(SymdynError):
    """An ensemble stopped early: its executor died or the disk is full. `n_done` of `count` samples are kept."""

    def __init__(self, message: str, n_done: int, count: int) -> None:
        super().__init__(message)
        self.n_done, self.count = n_done, count
