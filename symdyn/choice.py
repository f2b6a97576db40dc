"""Choice of the formulation when none is named: every candidate is derived, and the one with the least predicted time wins.

The prediction rests on exact properties of the tape alone, so that the choice is the same on every machine: how many cycles
a processor takes for its steps in their order (symdyn.tape.cycles), how many there are, and the sines and cosines.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import TYPE_CHECKING, Any

from symdyn.collector import collector_paused
from symdyn.errors import SymdynError
from symdyn.formulation.constraints.augmented import augment
from symdyn.formulation.printed.independent_speeds import MotionEquations
from symdyn.formulation.trees.embedding import embed
from symdyn.formulation.trees.recursive import recursive
from symdyn.functions.content import with_open_contacts
from symdyn.kinds import flag
from symdyn.model.record import Model, joint_speeds
from symdyn.shown import shown
from symdyn.tape.cycles import LATENCY, WIDTH, Schedule, schedule
from symdyn.tape.node import PARAMETER
from symdyn.tape.ops import OPERATIONS
from symdyn.tape.tape import Tape

if TYPE_CHECKING:
    from symdyn.model.system import System

# Nanoseconds for each of the `terms` of a tape. `symdyn bench costs` measures the compiled right-hand sides of all candidates
# of 40 systems and fits these by non-negative least squares of the relative errors; here with gcc 12 on an AMD EPYC of
# 3.4 GHz (Zen 3). This one lost the least time, of the models that it compares, where it had not been fitted.
COSTS = {"cycles": 0.302, "beyond": 0.167, "sines": 24.2, "angles": 4.22}
# Instructions that the processor keeps decoded; all further ones are decoded in every evaluation.
KEPT_DECODED = 900
# Right-hand sides longer than this, operations, are not derived in ways that are unlikely to win: body frames where axes are
# parallel (parallel ones took fewer cycles in every long one), and the mass matrix unless it promises to win by far.
LONG = 10_000
PROMISING = 0.7

FORMULATIONS = ("auto", "embedding", "recursive", "augmented")
HEADING = (f"{'formulation':12}{'frames':10}{'operations':>10}{'prologue':>10}{'longest chain':>15}{'predicted ns':>14}"
           f"{'measured ns':>13}")


@dataclass(frozen=True)
class Candidate:
    """One way to compute the accelerations.

    operations, prologue, chain   exact counts of the right-hand side; predicted, measured   ns (measured: None if untimed)
    """

    formulation: str
    frames: str
    operations: int
    prologue: int
    chain: int
    predicted: float
    measured: float | None = None
    chosen: bool = False

    @property
    def time(self) -> float:
        """Time that is compared: the measured one where there is one."""
        return self.predicted if self.measured is None else self.measured

    def __str__(self) -> str:
        """A line under HEADING."""
        measured = "-" if self.measured is None else f"{self.measured:.0f}"
        return (f"{self.formulation:12}{self.frames:10}{self.operations:>10}{self.prologue:>10}{self.chain:>15}"
                f"{self.predicted:>14.0f}{measured:>13}{'  chosen' if self.chosen else ''}")


def terms(tape: Tape, run: Schedule) -> dict[str, float]:
    """Quantities that the prediction weighs, under the names of COSTS; run is the schedule of the tape.

    cycles   of one evaluation from when sines and cosines are known
    beyond   instructions beyond KEPT_DECODED
    sines    1 if there are any sines or cosines: they are taken all at once, and everything waits for the first
    angles   of which sines or cosines are taken
    """
    angles = {node.args[0] for node in tape.running if OPERATIONS[node.op].kind == "trig"}
    return {"cycles": run.cycles, "beyond": max(0, run.instructions - KEPT_DECODED), "sines": min(1, len(angles)),
            "angles": len(angles)}


def time_of(weighed: Mapping[str, float]) -> float:
    """Nanoseconds for the terms of a tape."""
    return sum(COSTS[name] * value for name, value in weighed.items())


def predicted_time(tape: Tape) -> float:
    """Nanoseconds of one evaluation of a tape."""
    return time_of(terms(tape, schedule(tape)))


def choose(model: Model, tune: bool = False, formulation: str = "auto", coordinates: str = "relative") -> MotionEquations:
    """The equations of a checked model in the formulation that takes the least time for accelerations.

    tune          compile the candidates and time them, instead of predicting
    formulation   "auto", or the one whose frames are to be chosen; coordinates: of the augmented formulation
    The result's `candidates` is the table. Raises ModelError as the formulations do; CompilerNotFound if there is no
    compiler to tune with.
    """
    if flag(tune, "tune"):
        from symdyn.runtime.building.compiler import require_compiler

        require_compiler()
    with collector_paused():
        derived = _worth_comparing(model, formulation, coordinates)
    times: Sequence[float | None] = [None] * len(derived)
    if tune:
        from symdyn.timing.side_by_side import times_side_by_side

        times = times_side_by_side([d.equations for d in derived])
    if len(derived) == 1 and not tune:
        return replace(derived[0].equations, candidates=_Only(derived[0].equations))
    table = [d.candidate(t) for d, t in zip(derived, times, strict=True)]
    best = min(range(len(table)), key=lambda k: table[k].time)
    return replace(derived[best].equations, candidates=tuple(replace(c, chosen=k == best) for k, c in enumerate(table)))


def constrained(model: Model) -> bool:
    """Whether a model has closed loops or constraints."""
    return bool(model.loops or model.constraints)


def formulated(system: System, formulation: str = "auto", tune: bool = False,
               coordinates: str = "relative") -> MotionEquations:
    """The equations of a system in the formulation of that name; "auto" takes the fastest.

    tune          compile the candidates and time them, instead of predicting; of a formulation that is named, its frames
    coordinates   of the augmented formulation, see System.augmented; absolute ones imply it
    Raises SymdynError for an unknown name, and for absolute coordinates of another formulation.
    """
    if not isinstance(formulation, str) or formulation not in FORMULATIONS:
        raise SymdynError(f"formulation {shown(formulation)} asked for; there are {', '.join(FORMULATIONS)}")
    if not isinstance(coordinates, str) or coordinates != "relative":
        if formulation not in ("auto", "augmented"):
            raise SymdynError(f"coordinates {shown(coordinates)} asked for with the formulation {shown(formulation)}; they are "
                              "for "
                              "'augmented' alone")
        formulation = "augmented"
    if tune or formulation == "auto":
        return choose(system.check(), tune, formulation, coordinates)
    ways: dict[str, Callable[[], MotionEquations]] = {
        "embedding": system.embedding, "recursive": system.recursive, "augmented": partial(system.augmented, coordinates)}
    return ways[formulation]()


@dataclass(frozen=True)
class Derived:
    """Equations with the tape of their right-hand side as it is emitted."""

    equations: MotionEquations
    tape: Tape

    @classmethod
    def of(cls, equations: MotionEquations) -> Derived:
        """Rigid contacts are open: a motion pays nothing for those that stay so."""
        return cls(equations, with_open_contacts(equations, "rhs"))

    @cached_property
    def run(self) -> Schedule:
        """Schedule of an evaluation."""
        return schedule(self.tape)

    @cached_property
    def predicted(self) -> float:
        """Nanoseconds of one evaluation; terms as in `terms`."""
        return time_of(terms(self.tape, self.run))

    def candidate(self, seconds: float | None = None) -> Candidate:
        """Its line of the table."""
        tape = self.tape
        return Candidate(self.equations.formulation, self.equations.frames, tape.operations,
                         sum(tape.count_prologue().values()), tape.longest_chain(), self.predicted,
                         None if seconds is None else seconds * 1e9)

    def computes_like(self, other: Derived) -> bool:
        """Whether all counts agree: where joints share a speed, the recursion comes to the mass matrix, too."""
        return self._counts() == other._counts()

    def _counts(self) -> tuple[object, ...]:
        return self.tape.count(), self.tape.count_prologue(), self.tape.longest_chain(), self.run


class _Only(Sequence[Candidate]):
    """The table of the only candidate, whose time is predicted when the table is looked at: there was nothing to choose."""

    def __init__(self, equations: MotionEquations) -> None:
        self._equations = equations

    @cached_property
    def _table(self) -> tuple[Candidate, ...]:
        return (replace(Derived.of(self._equations).candidate(), chosen=True),)

    def __len__(self) -> int:
        return 1

    def __getitem__(self, k: Any) -> Any:
        return self._table[k]


def derived_in_frames(derive: Callable[[Model, str], MotionEquations], model: Model) -> list[Derived]:
    """A formulation in body frames, and in parallel frames where axes stay parallel; of long ones only the last."""
    parallel = Derived.of(derive(model, "parallel"))
    if parallel.equations.frames == "body" or parallel.tape.operations > LONG:
        return [parallel]
    return [Derived.of(derive(model, "body")), parallel]


def _worth_comparing(model: Model, formulation: str, coordinates: str) -> list[Derived]:
    """The candidates; the mass matrix only where it can win, and nothing twice."""
    if formulation == "augmented" or (formulation == "auto" and constrained(model)):
        return derived_in_frames(lambda m, frames: augment(m, coordinates, frames=frames), model)
    if formulation == "embedding":
        return derived_in_frames(embed, model)
    recursions = derived_in_frames(recursive, model)
    if formulation == "recursive" or not _mass_matrix_can_win(model, recursions):
        return recursions
    embeddings = derived_in_frames(embed, model)
    return embeddings + [d for d in recursions if not any(d.computes_like(e) for e in embeddings)]


def _mass_matrix_can_win(model: Model, recursions: Sequence[Derived]) -> bool:
    if len(recursions) == 1 and hopeless(model, recursions[0]):
        return False
    best = min(recursions, key=lambda d: d.predicted)
    ahead = PROMISING if best.tape.operations > LONG else 1
    return least_time_with_mass_matrix(model, best) < ahead * best.predicted


def hopeless(model: Model, recursion: Derived) -> bool:
    """Whether factors of the mass matrix alone take longer than the recursion at the most, as in long chains."""
    return time_of({"cycles": _factors_alone(model, recursion) / WIDTH}) > most_time(recursion.tape)


def most_time(tape: Tape) -> float:
    """Nanoseconds that a tape is predicted to take at the most: as if all its steps waited for each other."""
    counts = tape.count()
    operations = sum(counts.values())
    return time_of({"cycles": operations * max(LATENCY.values()), "beyond": operations, "sines": 1,
                    "angles": counts.get("trig", 0)})


def least_time_with_mass_matrix(model: Model, recursion: Derived) -> float:
    """Nanoseconds that the embedding takes at the least, without deriving it.

    Factorizing and solving are counted, and nothing waits. Forces and forming the mass matrix take no fewer than half of the
    instructions of the recursion (0.52 to 1.73 of them in the systems of `symdyn bench costs` with more than two speeds); if all
    pivots are constant, solving alone is left.
    """
    least = float(_factors_alone(model, recursion))
    if _pivots_change(recursion):
        least += recursion.run.instructions / 2
    return time_of(terms(recursion.tape, Schedule(round(least), round(least / WIDTH))))


def _factors_alone(model: Model, recursion: Derived) -> int:
    """Instructions of factorizing the mass matrix, where its pivots are no constants, and of solving with it."""
    return solving_instructions(model) + (factorizing_instructions(model) if _pivots_change(recursion) else 0)


def _pivots_change(recursion: Derived) -> bool:
    return any(pivot.mask & ~PARAMETER for pivot in recursion.equations.recorder.checks)


def factorizing_instructions(model: Model) -> int:
    """Instructions of L^T D L without fill-in, which alone grow like n^3: for each speed a division, its row of L, and what
    that takes from the rows above."""
    return sum(1 + above + above * (above + 1) // 2 for above in _coupled(model))


def solving_instructions(model: Model) -> int:
    """Instructions of solving with the factors: for each speed a product, and both ways along its row of L."""
    return sum(1 + 2 * above for above in _coupled(model))


def _coupled(model: Model) -> list[int]:
    """For each speed of a joint the number of speeds before it, on the way to the ground, that it is coupled with."""
    speeds = set(model.speeds)
    before: dict[int, int] = {-1: 0}
    counts: list[int] = []
    for joint, parent, child in zip(model.joints, model.parents, model.children, strict=True):
        above = before[parent]
        own = sum(u in speeds for u in joint_speeds(joint))
        counts += range(above, above + own)
        before[child] = above + own
    return counts
