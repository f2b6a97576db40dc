"""Which formulation to take when none is named: every candidate is derived, and the one with the least predicted time wins.

The prediction rests on two exact properties of the tape, the operations of one evaluation and the longest chain of
operations that wait for each other; the first tells what the processor has to do, the second how much of it cannot overlap.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from symdyn.errors import SymdynError
from symdyn.formulation.embedding import embed
from symdyn.formulation.motion_equations import MotionEquations
from symdyn.formulation.recursion import recursive
from symdyn.model.record import Model
from symdyn.pipeline import function_tape
from symdyn.tape.tape import Tape

if TYPE_CHECKING:
    from symdyn.model.system import System

# Nanoseconds by kind of operation, and for each step of the longest chain, of compiled right-hand sides: fitted to the
# candidates of n_link_pendulum(2 ... 20), spatial_chain(2 ... 20), PUMA 560 and trees (`python -m symdyn.bench.model`).
TIME_OF = {"add": 0.07, "mul": 0.07, "div": 1.0, "sqrt": 1.5, "trig": 3.0, "function": 10.0, "compare": 0.1}
TIME_OF_STEP = 0.7


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
        """What is compared: the measured time where there is one."""
        return self.predicted if self.measured is None else self.measured

    def __str__(self) -> str:
        measured = "" if self.measured is None else f"{self.measured:>10.0f}"
        return (f"{self.formulation:12}{self.frames:10}{self.operations:>10}{self.prologue:>10}{self.chain:>15}"
                f"{self.predicted:>13.0f}{measured}{'  chosen' if self.chosen else ''}")


HEADING = f"{'formulation':12}{'frames':10}{'operations':>10}{'prologue':>10}{'longest chain':>15}{'predicted ns':>13}"


def predicted_time(tape: Tape) -> float:
    """Nanoseconds of one evaluation of a tape, from its counts."""
    return sum(TIME_OF[kind] * n for kind, n in tape.count().items()) + TIME_OF_STEP * tape.longest_chain()


def choose(model: Model, tune: bool = False) -> MotionEquations:
    """The equations of a checked model in the formulation that takes the least time for accelerations.

    tune   compile the candidates and time them, instead of predicting
    The result's `candidates` is the table. Raises ModelError as the formulations do; CompilerNotFound if there is no
    compiler to tune with.
    """
    derived = list(_candidates(model))
    times: list[float | None] = [None] * len(derived)
    if tune:
        from symdyn.bench.kernel import evaluation_times

        times = list(evaluation_times(derived))
    table = [_candidate(e, t) for e, t in zip(derived, times, strict=True)]
    best = min(range(len(table)), key=lambda k: table[k].time)
    return replace(derived[best], candidates=tuple(replace(c, chosen=k == best) for k, c in enumerate(table)))


FORMULATIONS = ("auto", "embedding", "recursive")


def formulated(system: System, formulation: str = "auto", tune: bool = False) -> MotionEquations:
    """The equations of a system in the formulation of that name; "auto" takes the fastest.

    Raises SymdynError for an unknown name.
    """
    if formulation not in FORMULATIONS:
        raise SymdynError(f"formulation {formulation!r} asked for; there are {', '.join(FORMULATIONS)}")
    if formulation == "auto":
        return system.equations(tune)
    return system.embedding() if formulation == "embedding" else system.recursive()


def _candidates(model: Model) -> Iterator[MotionEquations]:
    """The formulations of a tree; parallel frames only where axes are parallel, the mass matrix only where it can win."""
    forms: list[Callable[[Model, str], MotionEquations]] = [recursive]
    yield recursive(model)
    if factorization_operations(model) < recursive(model).tape("rhs").operations:
        forms.append(embed)
        yield embed(model)
    for form in forms:
        equations = form(model, "parallel")
        if equations.frames == "parallel":
            yield equations


def _candidate(equations: MotionEquations, measured: float | None) -> Candidate:
    tape = function_tape(equations, "rhs")
    return Candidate(equations.formulation, equations.frames, tape.operations, sum(tape.count_prologue().values()),
                     tape.longest_chain(), predicted_time(tape), None if measured is None else measured * 1e9)


def factorization_operations(model: Model) -> int:
    """Operations of factorizing and solving with the mass matrix, L^T D L without fill-in: they alone grow like n^3."""
    before: dict[int, int] = {-1: 0}
    total = 0
    for joint, parent, child in zip(model.joints, model.parents, model.children, strict=True):
        above = before[parent]
        for _ in range(joint.n_speeds):
            total += 2 + above + above * (above + 1) + 4 * above
            above += 1
        before[child] = above
    return total
