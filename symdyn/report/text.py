"""The report of a module: what was generated, what was skipped and why, and how many operations it takes."""

from __future__ import annotations

from dataclasses import dataclass

from symdyn.backend.program import STATEMENT_SECONDS
from symdyn.backend.source import Source
from symdyn.choice import HEADING, Candidate
from symdyn.counting import counted
from symdyn.formulation.equations import Equations
from symdyn.formulation.printed.skipped import skipped
from symdyn.tape.tape import Tape

# Functions that the report counts besides the standard ones where there are constraints.
OF_CONSTRAINTS = ("C", "C_r", "F_d", "lam", "reactions", "position_correction", "velocity_correction")
# These grow with the square of the number of speeds, or faster: they are counted for so many speeds at most.
DENSE, MOST_SPEEDS = ("mass_matrix", "J", "C_r"), 150
# The right-hand side by the numeric algorithm, which takes over where a pivot vanishes.
SINGULAR_FALLBACK = "rhs, algorithm"


@dataclass(frozen=True)
class Row:
    """Operations of one function: running by kind, in the prologue, longest chain of operations that wait."""

    function: str
    operations: dict[str, int]
    prologue: int
    chain: int

    @property
    def total(self) -> int:
        return sum(self.operations.values())


@dataclass(frozen=True)
class RolledRow:
    """Loops in the code of one function: how many, their trips together, and statements: those that are written, those that run;
    size: bytes of the whole code."""

    function: str
    loops: int
    trips: int
    written: int
    statements: int
    size: int

    @property
    def seconds_saved(self) -> float:
        """Predicted seconds of compilation without the statements that loops replace, by which loops are chosen."""
        return (self.statements - self.written) * STATEMENT_SECONDS

    def __str__(self) -> str:
        return (f"{self.function}: {counted(self.loops, 'loop')} of {self.trips} trips in all; {self.written} statements are "
                f"written in place of {self.statements}, which saves {self.seconds_saved:.2g} s of compilation by prediction; "
                f"{self.size} bytes of code with all other functions")


@dataclass(frozen=True)
class Report:
    """Report of what was generated, what was skipped and why; prints as text.

    many    how many states and motions are computed at once
    rolled  functions of the right-hand side's code whose repeated statements are loops
    """

    title: str
    backend: str
    fallback: str
    sizes: dict[str, int]
    rows: tuple[Row, ...]
    skipped: tuple[str, ...]
    candidates: tuple[Candidate, ...] = ()
    many: str = ""
    rolled: tuple[RolledRow, ...] = ()

    def __str__(self) -> str:
        lines = [self.title, f"  backend {self.backend}" + (f": {self.fallback}" if self.fallback else "")]
        lines.append("  " + ", ".join(f"{n} {what}" for what, n in self.sizes.items()))
        lines.append(f"  {'function':20}{'operations':>11}{'add':>7}{'mul':>7}{'div':>5}{'trig':>6}{'other':>7}{'prologue':>10}"
                     f"{'longest chain':>15}")
        for r in self.rows:
            kinds = [r.operations.get(k, 0) for k in ("add", "mul", "div", "trig")]
            other = r.total - sum(kinds)
            lines.append(f"  {r.function:20}{r.total:>11}{kinds[0]:>7}{kinds[1]:>7}{kinds[2]:>5}{kinds[3]:>6}{other:>7}"
                         f"{r.prologue:>10}{r.chain:>15}")
        lines.append("  Every function is generated when it is first used, with nothing in it that it does not need.")
        if self.rolled:
            lines.append("  Rolled, as like parts repeat the same statements:")
            lines += [f"    {row}" for row in self.rolled]
        if self.many:
            lines.append(f"  Many at once: {self.many}")
        if self.candidates:
            lines.append("  Chosen for the least time of its right-hand side:")
            lines += [f"    {HEADING}", *(f"    {candidate}" for candidate in self.candidates)]
        lines.append("  Skipped:")
        lines += [f"    {note}" for note in self.skipped]
        return "\n".join(lines)

    def __repr__(self) -> str:
        return str(self)


def _row(name: str, tape: Tape) -> Row:
    return Row(name, tape.count(), sum(tape.count_prologue().values()), tape.longest_chain())


def rolled_rows(source: Source) -> tuple[RolledRow, ...]:
    """The functions of a source with loops."""
    size = sum(len(text) for text in source.files.values())
    program = source.program
    ways = [way for f in (program.prologue, *program.functions) for way in (f, f.regular, f.singular_fallback) if way is not None]
    return tuple(RolledRow(f.name, len(f.loops), sum(f.loops), f.written, f.steps, size) for f in ways if f.loops)


def report(equations: Equations, backend: str, fallback: str = "", source: Source | None = None) -> Report:
    """The report of equations on a backend; counts after hoisting, one each for + - * / sqrt sin cos.

    source   of the right-hand side
    """
    from symdyn.functions.table import STANDARD
    from symdyn.functions.tapes import function_tape, has_function

    s = equations.symbols
    rows, left_out = [], []
    for name in (*STANDARD, *OF_CONSTRAINTS * bool(equations.constraints)):
        if has_function(equations, name) and name in DENSE and len(s.speeds) > MOST_SPEEDS:
            left_out.append(name)
        elif has_function(equations, name):
            rows.append(_row(name, function_tape(equations, name)))
            if name == "rhs" and equations.singular_fallback is not None:
                rows.append(_row(SINGULAR_FALLBACK, function_tape(equations.singular_fallback, name)))
    sizes = {"coordinates": len(s.coordinates), "speeds": len(s.speeds), "extra states": len(s.states),
             "inputs": len(s.inputs), "parameters": len(s.parameters)}
    if equations.constraints:
        sizes["constraints"] = len(equations.constraints)
    notes = skipped(equations)
    if left_out:
        notes.append(f"{', '.join(left_out)}: not counted, as their entries grow with the square of the {len(s.speeds)} speeds; "
                     "they are derived when they are asked for")
    return Report(f"{equations.name}: {equations.formulation} equations of motion", backend, fallback, sizes, tuple(rows),
                  tuple(notes), tuple(equations.candidates), rolled=rolled_rows(source) if source is not None else ())
