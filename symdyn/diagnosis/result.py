"""The diagnosis of a mechanism, as fields and as text."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field


@dataclass(frozen=True)
class Dependency:
    """A constraint that others imply.

    row      its name; implied_by: names of the rows that it is a combination of; none: it holds by structure, or holds nothing
    joints   the loops and constraints that these rows belong to
    always   at every state tried; False: at the given one only
    """

    row: str
    implied_by: tuple[str, ...]
    joints: tuple[str, ...]
    always: bool = True

    def __str__(self) -> str:
        if not self.implied_by:
            return f"{self.row}: {'holds by itself' if self.always else 'its gradient vanishes'}"
        return f"{self.row}: implied by {', '.join(self.implied_by)} ({', '.join(self.joints)})"


@dataclass(frozen=True)
class SingularState:
    """A state where constraints come to depend on each other, which they do not elsewhere.

    q          coordinate -> value; size: the smallest singular value there, relative to the largest one elsewhere
    distance   from the given state, along the motion: of the fastest speed, rad or parts of the mechanism's length
    rows       that the others imply there; lost: whether the rank is lost, or nearly lost only
    """

    q: Mapping[str, float]
    size: float
    distance: float
    rows: tuple[str, ...]
    lost: bool

    def __str__(self) -> str:
        how = "rank is lost" if self.lost else "rank is nearly lost"
        there = f"; dependent there: {', '.join(self.rows)}" if self.rows else ""
        return f"{how} (smallest singular value {self.size:.1e}) at {_state(self.q)}, {self.distance:.3g} from the state{there}"


@dataclass(frozen=True)
class Diagnosis:
    """Diagnosis of the constraints of a mechanism; prints as text.

    speeds, rows   numbers of speeds, and of constraint rows with those that hold by structure
    gruebler       how the count of freedoms comes about, a line for each kind; by_count: its result, speeds less rows
    by_rank        freedoms: speeds less independent rows, at `states` consistent states near the given one; None if there are
                   none; at_state: those at the state given
    state, consistent, moved   the state looked at, whether there is one, and how far it is from the one given
    residuals      rows that no state near fulfils -> what is left of them, relative to the mechanism's length
    dependencies   redundant constraints; faults: contradictions, and constraints that hold nothing, in sentences
    smallest       the smallest singular value at the state, relative to the largest one (zero by rank left out)
    singular       states where rank is lost along the motions that are possible, up to `reach` from the state
    parts          groups of bodies that move independently of each other; still: bodies that no speed moves
    idle           bodies that can turn on their own while nothing else moves, and no load acts along
    massless       speeds with motions that move no mass
    advice         what could be done; remarks: what to know about the diagnosis itself
    """

    name: str
    speeds: int
    rows: int
    gruebler: tuple[str, ...]
    by_count: int
    by_rank: int | None = None
    at_state: int | None = None
    states: int = 0
    state: Mapping[str, float] = field(default_factory=dict)
    consistent: bool = True
    moved: float = 0.0
    residuals: Mapping[str, float] = field(default_factory=dict)
    dependencies: tuple[Dependency, ...] = ()
    faults: tuple[str, ...] = ()
    smallest: float | None = None
    singular: tuple[SingularState, ...] = ()
    reach: float = 0.0
    parts: tuple[tuple[str, ...], ...] = ()
    still: tuple[str, ...] = ()
    idle: tuple[str, ...] = ()
    massless: tuple[str, ...] = ()
    advice: tuple[str, ...] = ()
    remarks: tuple[str, ...] = ()

    @property
    def redundant(self) -> tuple[Dependency, ...]:
        """Constraints that are redundant at every state tried."""
        return tuple(d for d in self.dependencies if d.always)

    @property
    def healthy(self) -> bool:
        """Whether there is nothing to report: a consistent state, full rank there and around, no motion without mass."""
        return self.consistent and not (self.faults or self.dependencies or self.singular or self.massless)

    def __str__(self) -> str:
        lines = [f"{self.name}: diagnosis of the constraints"]
        lines += self._freedoms()
        if not self.consistent:
            lines.append("  No state near fulfils all constraints; what is left at the nearest, by the mechanism's length:")
            lines += [f"    {row}: {value:.3g}" for row, value in self.residuals.items()]
        elif self.rows and self.by_rank is not None:
            moved = f", {self.moved:.3g} from the one given" if self.moved > 1e-9 else ""
            lines.append(f"  State: {_state(self.state)}{moved}")
        lines += _block("Contradictions and empty constraints:", self.faults)
        lines += _block("Redundant at every state tried:", map(str, self.redundant))
        lines += _block("Redundant at this state only:", (str(d) for d in self.dependencies if not d.always))
        if self.by_rank is not None and self.rows and not self.dependencies:
            lines.append("  No constraint is redundant.")
        lines += self._singularities()
        lines += self._motions()
        lines += _block("Advice:", self.advice)
        lines += _block("Remarks:", self.remarks)
        return "\n".join(lines)

    def _freedoms(self) -> list[str]:
        if not self.rows:
            lines = [f"  no loops or constraints: {self.speeds} degrees of freedom, one for each speed" if self.speeds != 1 else
                     "  no loops or constraints: 1 degree of freedom"]
        else:
            lines = [f"  degrees of freedom by count: {self.by_count}", *(f"    {line}" for line in self.gruebler)]
        if self.by_rank is not None and self.rows:
            here = "" if self.at_state == self.by_rank else f", {self.at_state} at this state"
            lines.append(f"  degrees of freedom by rank: {self.by_rank} at {self.states} consistent "
                         f"state{'s' if self.states != 1 else ''} near{here}")
        return lines

    def _singularities(self) -> list[str]:
        if self.smallest is None:
            return []
        around = f"up to {self.reach:.3g} from the state, both ways along its motions"
        lines = [f"  Smallest singular value of the scaled Jacobian here: {self.smallest:.2g} of the largest."]
        if self.singular:
            return lines + _block(f"Singular configurations, {around}:", map(str, self.singular))
        return [*lines, f"  No singular configuration {around}."] if self.by_rank else lines

    def _motions(self) -> list[str]:
        lines = []
        if len(self.parts) > 1:
            lines += _block("Parts that move independently of each other:", (", ".join(part) for part in self.parts))
        if self.still:
            lines.append(f"  Bodies that no speed moves: {', '.join(self.still)}.")
        if self.idle:
            lines.append(f"  Idle rotation, in which nothing else moves and along which no load acts: {', '.join(self.idle)}.")
        if self.massless:
            lines.append(f"  Motions that move no mass, in the speeds {', '.join(self.massless)}.")
        return lines

    def __repr__(self) -> str:
        return str(self)


def _block(title: str, lines: Iterable[str]) -> list[str]:
    listed = [f"    {line}" for line in lines]
    return [f"  {title}", *listed] if listed else []


def _state(q: Mapping[str, float]) -> str:
    return ", ".join(f"{name} = {value if abs(value) > 1e-12 else 0.0:.6g}" for name, value in q.items())
