"""Frozen records by subject, whose fields, properties and methods templates read.

They are listed for authors of templates in templates/README.md, which tests/backend/test_templates.py compares with them.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from symdyn import panels
from symdyn.backend.batch import Batch
from symdyn.backend.function import Function, Part
from symdyn.backend.gathered import Gathered
from symdyn.backend.integrated import Integrated, Shape, level_of_control
from symdyn.backend.metadata import EventRecord, Metadata, Sizes
from symdyn.backend.methods import Method
from symdyn.backend.parts import Parts
from symdyn.backend.program import Program
from symdyn.backend.reference import Reference
from symdyn.backend.user_functions import UserText
from symdyn.named_records import NamedRecords
from symdyn.tape.intrinsics import CLEANINGS, LOOSE, MASSLESS, ROUNDS, SMOOTHED

_C_TYPE = {"t": "double t", **{g: f"const double *{g}" for g in ("q", "u", "z", "ud", "inputs", "p", "c", "v")},
           "change": "const symdyn_vector *change"}
_LANES_TYPE = {g: "symdyn_vector t" if g == "t" else f"const symdyn_vector *{g}" for g in _C_TYPE}


@dataclass(frozen=True)
class Row:
    """A name with its unit and its value, as text."""

    name: str
    unit: str
    value: str


@dataclass(frozen=True)
class Model:
    """The mechanism.

    metadata   the record of the module
    hash       16 digits that change whenever the equations do
    header     lines that document every argument with order, unit and default
    tables     rows of `coordinates`, `speeds`, `states`, `inputs` and `parameters`
    """

    metadata: Metadata
    hash: str
    header: tuple[str, ...]
    tables: Mapping[str, tuple[Row, ...]]

    @property
    def name(self) -> str:
        """Its name, an identifier."""
        return self.metadata.name

    @property
    def formulation(self) -> str:
        """The name of the derivation of the equations."""
        return self.metadata.formulation

    @property
    def version(self) -> str:
        """The version of symdyn."""
        return self.metadata.version

    @property
    def parameters(self) -> tuple[str, ...]:
        """Names of the parameters, in order."""
        return self.metadata.parameters

    @property
    def n_q(self) -> int:
        """Number of coordinates."""
        return self.metadata.sizes.q

    @property
    def n_u(self) -> int:
        """Number of speeds."""
        return self.metadata.sizes.u

    @property
    def n_z(self) -> int:
        """Number of extra states."""
        return self.metadata.sizes.z

    @property
    def n_x(self) -> int:
        """Number of states, x = [q; u; z]."""
        return self.metadata.sizes.x

    @property
    def n_in(self) -> int:
        """Number of inputs."""
        return self.metadata.sizes.inputs

    @property
    def n_ud(self) -> int:
        """Number of accelerations, or what is given in their place."""
        return self.metadata.sizes.ud

    @property
    def n_p(self) -> int:
        """Number of parameters."""
        return self.metadata.sizes.p

    @property
    def room_ud(self) -> int:
        """Length of an array for accelerations: C has none of length 0."""
        return max(self.n_ud, 1)

    @property
    def counts(self) -> tuple[tuple[str, int, str], ...]:
        """A letter, a number and what is counted, of all arguments."""
        return (("q", self.n_q, "coordinates"), ("u", self.n_u, "speeds"), ("z", self.n_z, "extra states"),
                ("x", self.n_x, "x = [q; u; z]"), ("inputs", self.n_in, "inputs"), ("p", self.n_p, "parameters"),
                ("c", self.metadata.n_c, "constants computed by the prologue"))

    @property
    def start(self) -> tuple[Row, ...]:
        """Rows of the state x."""
        return tuple(row for group in ("coordinates", "speeds", "states") for row in self.tables[group])

    @property
    def lines(self) -> tuple[tuple[str, str], ...]:
        """Keys and values of the metadata as Python text, with the state and the sizes that follow from the names."""
        sizes = self.metadata.sizes
        lines: dict[str, Any] = {}
        for key, value in self.metadata.as_plain().items():
            lines[key] = value
            if key == "z":
                lines["x"] = list(self.metadata.x)
            if key == "units":
                lines["sizes"] = {"x": sizes.x, **asdict(sizes)}
        return tuple((repr(key), repr(value)) for key, value in lines.items())


@dataclass(frozen=True)
class Options:
    """The kind of files that are wanted.

    standalone   true for files that are kept, false for a module that is only loaded
    threads      whether there is a kernel of many motions, or states, by a thread each (C)
    divided      whether the file becomes several translation units (C)
    """

    standalone: bool
    threads: bool
    divided: bool

    @property
    def linked(self) -> str:
        """The declaration of functions that only this library calls (C)."""
        return "SYMDYN_HIDDEN" if self.divided else "SYMDYN_APART static" if self.threads else "static"


@dataclass(frozen=True)
class Calls:
    """Declarations and calls in C.

    sizes       of the groups of arguments
    arguments   the groups that each function reads, by its name
    """

    sizes: Sizes
    arguments: Mapping[str, tuple[str, ...]]

    def signature(self, f: Function) -> str:
        """Arguments of a function."""
        return ", ".join([_C_TYPE[g] for g in f.arguments] + ["double *out"])

    def call(self, f: Function) -> str:
        """Arguments of its call."""
        return call_of(f)

    def part_signature(self, part: Function | Part) -> str:
        """Arguments of a part, or of a function of directions, each followed by a comma."""
        return "".join(f"{_C_TYPE[g]}, " for g in part.arguments)

    def part_call(self, part: Function | Part) -> str:
        """Arguments of its call, each followed by a comma."""
        return "".join(f"{g}, " for g in part.arguments)

    def lanes_signature(self, part: Function | Part) -> str:
        """Arguments of a function of vectors or a part of it, each followed by a comma."""
        return "".join(f"{_LANES_TYPE[g]}, " for g in part.arguments)

    def lanes_call(self, part: Function | Part) -> str:
        """Arguments of its call."""
        return ", ".join(f"lanes->{g}" if g in ("p", "c", "inputs") else self._state(g, "x") for g in part.arguments)

    def rows_call(self, f: Function) -> str:
        """Arguments of a call for row i of many states."""
        sizes = self.sizes
        strided = {"t": "frame->t[i * frame->t_stride]", "p": "frame->p", "c": "frame->c",
                   "ud": f"frame->ud + i * frame->ud_stride * {sizes.ud}",
                   "inputs": f"frame->inputs + i * frame->inputs_stride * {sizes.inputs}"}
        x = f"frame->x + i * frame->x_stride * {sizes.x}"
        return ", ".join([strided.get(g) or self._state(g, x) for g in f.arguments] + [f"frame->out + i * {f.size}"])

    def at(self, function: str, result: str) -> str:
        """Arguments of a call, by its name, at t and x in the integrator."""
        groups = self.arguments.get(function, ())
        return ", ".join([f"problem->{g}" if g in ("p", "c") else self._state(g, "x") for g in groups] + [result])

    @property
    def one(self) -> str:
        """Arguments of a call of rhs for the state `one` at `time`, and its `result`."""
        return ", ".join([*("time" if g == "t" else self._state(g, "one") for g in self.arguments.get("rhs", ())), "result"])

    def _state(self, argument: str, base: str) -> str:
        offset = {"q": 0, "u": self.sizes.q, "z": self.sizes.q + self.sizes.u}.get(argument)
        return argument if offset is None else base if offset == 0 else f"{base} + {offset}"


def call_of(f: Function) -> str:
    """Arguments of a call in C."""
    return ", ".join([*f.arguments, "out"])


@dataclass(frozen=True)
class Needs:
    """Needs of statements besides the math library (C).

    sign             the sign function
    sincos           sines and cosines that are taken all at once
    columns          Jacobians as derivatives along directions, several columns at once
    motion_columns   the same code for every column of sensitivities
    """

    sign: bool
    sincos: bool
    columns: bool
    motion_columns: bool


@dataclass(frozen=True)
class Algorithms:
    """Numeric algorithms that are called.

    names    of these, in order
    texts    in Python, those of files in folders `algorithms`
    macros   pairs of a macro and its value: sizes and constants of those that are called (C)
    """

    names: tuple[str, ...]
    texts: tuple[str, ...]
    macros: tuple[tuple[str, str], ...]
    smoothed: float = SMOOTHED
    massless: float = MASSLESS
    loose: float = LOOSE
    rounds: int = ROUNDS
    cleanings: int = CLEANINGS

    @property
    def factorize(self) -> bool:
        """Whether one of them factorizes a matrix."""
        return not {"symdyn_saddle", "symdyn_multipliers"}.isdisjoint(self.names)


@dataclass(frozen=True)
class Corrections:
    """The corrections that keep states on constraints.

    n_rows    rows of the constraints
    longest   length of the longest correction: residuals, then changes of coordinates or speeds
    turning   which speeds are angular; angles: which coordinates are angles
    """

    n_rows: int
    longest: int
    turning: tuple[bool, ...]
    angles: tuple[bool, ...]


@dataclass(frozen=True)
class Manifold:
    """Conditions that states fulfil.

    unit_groups   indices in x of vectors of length 1, such as Euler parameters
    corrections   none, or for constraints `n_rows`, `longest`, `turning`, `angles`
    """

    unit_groups: tuple[tuple[int, ...], ...]
    corrections: Corrections | None

    @property
    def projects(self) -> bool:
        """Whether the integrator projects states onto it after every step."""
        return self.corrections is not None or bool(self.unit_groups)


@dataclass(frozen=True)
class Panel:
    """Numbers of the test that finds events between samples, see symdyn.panels.

    roundings   irregular changes of the entries of a state
    """

    roundings: tuple[float, ...]
    nodes: tuple[float, ...] = tuple(panels.NODES.tolist())
    gaps: tuple[float, ...] = tuple(panels.GAPS.tolist())
    at_check: tuple[float, ...] = tuple(panels.AT_CHECK.tolist())
    chebyshev: tuple[tuple[float, ...], ...] = tuple(map(tuple, panels.COEFFICIENTS.tolist()))
    slopes: tuple[tuple[float, ...], ...] = tuple(map(tuple, panels.SLOPES.tolist()))
    bends: tuple[tuple[float, ...], ...] = tuple(map(tuple, panels.BENDS.tolist()))
    macros: tuple[tuple[str, float], ...] = (
        ("SYMDYN_PANEL", panels.N), ("SYMDYN_PANEL_TAIL", panels.TAIL), ("SYMDYN_PANEL_CHECK", panels.CHECK),
        ("SYMDYN_PANEL_SLOPE", panels.SLOPE_ERROR), ("SYMDYN_PANEL_NOISE", panels.NOISE),
        ("SYMDYN_PANEL_EVALUATED", panels.EVALUATED), ("SYMDYN_FEW_DIVISIONS", panels.FEW_DIVISIONS),
        ("SYMDYN_MOST_DIVISIONS", panels.MOST_DIVISIONS), ("SYMDYN_PANEL_WIDEST", panels.WIDEST),
        ("SYMDYN_PANEL_DENSE", panels.DENSE), ("SYMDYN_PANEL_BEND", panels.BEND_ERROR),
        ("SYMDYN_MOST_PROOFS", panels.MOST_PROOFS))


@dataclass(frozen=True)
class Integrator:
    """The integrator of the right-hand side (C).

    method      its record, see `symdyn/backend/methods`
    shape       what else decides its text
    gathered    what the template of the method gets of its own: coefficients, or functions of a series
    functions   what it calls at t and x, each with `called`, `name`, `call`, `inputs`, `signature`; `bounded`: for bounds in
                place of t and x; `weighted`: with weights besides
    macros      pairs of a macro and its value: sizes, thresholds
    """

    method: Method
    shape: Shape
    gathered: Gathered
    functions: tuple[Integrated, ...]
    macros: tuple[tuple[str, float], ...]

    @property
    def level_of_control(self) -> str:
        """Option of optimization for the unit that controls steps, or the whole of a method without stages; "": the usual one."""
        return level_of_control(self.method, self.shape)

    @property
    def events(self) -> Sequence[EventRecord]:
        """Events that it looks for, each with its name, direction, stop, reset, enclosed, unproved."""
        return self.shape.events

    @property
    def most_events(self) -> int:
        """Number of events that may wait until they are taken."""
        return self.shape.most_events

    @property
    def enclosed(self) -> list[bool]:
        """Whether each event has bounds."""
        return [event.enclosed for event in self.shape.events]

    @property
    def leaves(self) -> Sequence[int]:
        """Indices of the quantities whose bounds the functions `event_bounds` and `event_ranges` take: 0 for t, then x, then the
        inputs."""
        return self.shape.leaves

    @property
    def resets(self) -> list[int]:
        """Entries of x that events reset."""
        return self.shape.resets

    @property
    def held(self) -> list[int]:
        """Those that stay when constraints are met."""
        return self.shape.held

    @property
    def sensitive(self) -> bool:
        """Whether the state has columns of sensitivities."""
        return self.shape.columns > 0

    @property
    def panel(self) -> Panel:
        """Numbers of the test that finds events between samples."""
        return Panel(tuple(panels.roundings(self.shape.n_x).tolist()))


@dataclass(frozen=True)
class Context(NamedRecords):
    """The names that every template gets.

    model        the mechanism
    program      functions and their common prologue
    options      what kind of files are wanted
    calls        declarations and calls (C)
    needs        what statements need besides the math library (C)
    algorithms   numeric algorithms that are called
    user_texts   texts of the user with the functions that are called
    manifold     what holds for states (C)
    integrator   none, or the integrator (C)
    runtime      parts of the runtime (C)
    lanes        none, or rhs on vectors, a state in each SIMD lane: `functions` by name, and the `operations` they use (C)
    many         none, or the same of functions that take rows of states so (C)
    reference    states and results for a check; none for a module that is only loaded
    """

    model: Model
    program: Program
    options: Options
    calls: Calls
    needs: Needs
    algorithms: Algorithms
    user_texts: tuple[UserText, ...]
    manifold: Manifold
    integrator: Integrator | None
    runtime: Parts
    lanes: Batch | None
    many: Batch | None
    reference: Reference | None
