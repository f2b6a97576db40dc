"""A mechanism that is measured: its formulations, compiled, and how far their motions are from a reference."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any

import numpy as np

from symdyn.bench.work.record import NAN, Reference, Skipped
from symdyn.errors import EvaluationError, SymdynError
from symdyn.formulation.equations import Equations
from symdyn.functions.tapes import function_tape
from symdyn.model.orientation import EulerAngles

if TYPE_CHECKING:
    from symdyn.model.system import System
    from symdyn.runtime.module import Module

# Right-hand sides with more operations are measured only if they are named.
LONG = 12_000
BASIC = ("embedding", "recursive", "augmented", "absolute", "absolute:angles")
GIVEN = "given"
TOUCHES = ("its motion switches at rigid contacts, and references are of smooth equations; symdyn bench contacts compares "
           "methods on motions that touch")


@dataclass(frozen=True, eq=False)
class Formulation:
    """Equations of the mechanism in one formulation, with their module."""

    name: str
    equations: Equations
    system: System | None = None

    @cached_property
    def module(self) -> Module:
        return self.equations.compile()  # type: ignore[no-any-return]

    @cached_property
    def operations(self) -> int:
        """Operations of one evaluation of the right-hand side."""
        return int(function_tape(self.equations, "rhs").operations)

    @cached_property
    def x0(self) -> np.ndarray:
        """The start, (n_x,)."""
        from symdyn.runtime.consistent import normalised

        initial = self.module.metadata.initial
        return normalised(self.module, np.array([float(initial.get(n, 0.0)) for n in self.module.metadata.x]))

    @property
    def coordinates(self) -> tuple[str, ...]:
        return tuple(self.module.metadata.x)


@dataclass(frozen=True, eq=False)
class SystemUnderTest:
    """A mechanism.

    name         of files and titles; end: s
    variants     how orientations are described -> system; "" where there is one only
    given        equations in the place of systems, such as those of sd.embedding
    closed       closed form: times -> states in the coordinates of the first formulation, with its source
    """

    name: str
    variants: Mapping[str, System]
    end: float
    given: Equations | None = None
    closed: Callable[[Sequence[float]], Any] | None = None
    source: str = ""
    at: tuple[float, ...] = ()

    @property
    def names(self) -> list[str]:
        """Every formulation that can be requested."""
        if self.given is not None:
            return [GIVEN]
        others = list(self.variants)[1:]
        return [*BASIC, *[f"{name}:{variant}" for variant in others for name in BASIC[:3]]]

    @property
    def lacking(self) -> list[str]:
        """Parameters without a number; none of a description with faults, which are reported when it is derived."""
        try:
            given: list[Any] = [self.given.symbols] if self.given is not None else [s.check() for s in self.variants.values()]
        except SymdynError:
            return []
        return list(dict.fromkeys(str(p.name) for one in given for p in one.parameters if p not in one.defaults))

    def formulated(self, asked: Sequence[str] | None) -> tuple[list[Formulation], list[Skipped]]:
        """The formulations of these names, default: all; those that the mechanism does not have are skipped with the reason."""
        if self.given is not None:
            touches = bool(self.given.contacts)
            return [Formulation(GIVEN, self.given)] * (not touches), [Skipped(GIVEN, "", TOUCHES)] * touches
        result: list[Formulation] = []
        skipped: list[Skipped] = []
        for name in asked or self.names:
            made = self._formulated(name, bool(asked))
            (skipped if isinstance(made, Skipped) else result).append(made)  # type: ignore[arg-type]
        return result, skipped

    def first(self) -> Formulation:
        """The first formulation that the mechanism has: its coordinates are the reference's.

        Raises SymdynError if there is none.
        """
        for name in self.names:
            result, skipped = self.formulated([name])
            if result:
                return result[0]
        raise SymdynError(f"{self.name} has no formulation: {skipped[-1]}")

    def _formulated(self, name: str, asked: bool) -> Formulation | Skipped:
        kind, _, variant = name.partition(":")
        angles = name == "absolute:angles"
        system = self.variants[next(iter(self.variants)) if angles or not variant else variant]
        derive: Callable[[], Any] = getattr(system, kind, system.augmented)
        model = system.check()
        if model.contacts:
            return Skipped(name, "", TOUCHES)
        tied = bool(model.loops or model.constraints)
        if kind == "augmented" and not tied:
            return Skipped(name, "", "a tree in the coordinates of its joints has no constraints: it would be the embedding")
        if angles and model.planar:
            return Skipped(name, "", "in a plane one angle is all there is")
        if kind == "absolute":
            derive = partial(system.augmented, "absolute", EulerAngles("ZYX") if angles else None)
        try:
            made = Formulation(name, derive(), system)
            if made.operations > LONG and not asked:
                return Skipped(name, "", f"{made.operations} operations are more than {LONG}; name it to have it measured")
        except SymdynError as error:
            return Skipped(name, "", str(error))
        return made


class Comparison:
    """Errors of motions against a reference, also of those in other coordinates than the reference has.

    In the reference's coordinates the errors are |q - q_ref| / s_q and |u - u_ref| / s_u in the Euclidean norm, s the largest
    norm of q_ref and of u_ref over the reference's times. In others, and with `bodies` in all, they are those of origins and
    rotation matrices of all bodies, and of the velocities of all centres of mass and bodies, measured alike: an error of an
    angle counts the same then, whether the coordinate is the angle, which grows with every turn, or an Euler parameter.
    """

    def __init__(self, reference: Reference, first: Formulation, bodies: bool = False) -> None:
        self.reference, self.first, self.bodies = reference, first, bodies
        self.times = np.array(reference.times)
        self.x = np.array(reference.x, dtype=float)

    def errors(self, formulation: Formulation, x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Errors of coordinates and of speeds at every time that x, (n, n_x), reaches: two arrays (n_t,)."""
        n, total = len(x), len(self.times)
        if len(x) == 0:
            return np.full(total, NAN), np.full(total, NAN)
        ours, known = self._parts(formulation, x), self._parts(self.first, self.x, formulation)
        result = []
        for mine, theirs in zip(ours, known, strict=True):
            size = np.linalg.norm(theirs, axis=1).max(initial=0.0) or 1.0
            row = np.full(total, NAN)
            row[:n] = np.linalg.norm(mine - theirs[:n], axis=1) / size
            result.append(row)
        return result[0], result[1]

    def _parts(self, formulation: Formulation, x: np.ndarray,
               reference: Formulation | None = None) -> tuple[np.ndarray, np.ndarray]:
        """Positions and speeds, (n, ...): of bodies where the coordinates are not the reference's."""
        sizes = formulation.module.metadata.sizes
        n_q, n_u = sizes.q, sizes.u
        if not self.bodies and (reference or formulation).coordinates == self.first.coordinates:
            return np.hstack((x[:, :n_q], x[:, n_q + n_u:])), x[:, n_q:n_q + n_u]
        module, there = formulation.module, np.isfinite(x).all(axis=1)
        unknown = np.full((len(x), 1), NAN)
        if not there.any():
            return unknown, unknown
        t, x = self.times[:len(x)][there], x[there]
        given = np.array([float(module.metadata.initial.get(n, 0.0)) for n in module.metadata.inputs])
        p = module.default_parameters
        places = self._shared(formulation, reference or formulation)
        try:
            frames = module.evaluate("frames", t, x, p, given).reshape(len(x), -1, 12)[:, places]
            J = module.evaluate("J", t, x, p, given).reshape(len(x), len(module.metadata.bodies), -1, n_u)[:, places]
        except EvaluationError:
            return unknown, unknown
        velocities = np.einsum("kbij,kj->kbi", J, x[:, n_q:n_q + n_u])
        return _spread(frames.reshape(len(x), -1), there), _spread(velocities.reshape(len(x), -1), there)

    def _shared(self, formulation: Formulation, other: Formulation) -> list[int]:
        """Where a formulation has the bodies that the reference's and the other one have: absolute coordinates may have more
        bodies, which carry joints."""
        names = formulation.module.metadata.bodies
        both = set(other.module.metadata.bodies)
        return [names.index(name) for name in self.first.module.metadata.bodies if name in both]


def _spread(rows: np.ndarray, places: np.ndarray) -> np.ndarray:
    """Rows (m, ...) at the m places (n,) that are true; others are not numbers."""
    result = np.full((len(places), rows.shape[1]), NAN)
    result[places] = rows
    return result
