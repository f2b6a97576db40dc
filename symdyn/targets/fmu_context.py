"""Frozen records by subject that the templates of an FMU read.

They are listed for authors of templates in templates/README.md, which tests/backend/test_templates.py compares with them.
"""

from __future__ import annotations

from dataclasses import dataclass

from symdyn.backend.metadata import EventRecord
from symdyn.named_records import NamedRecords
from symdyn.targets.fmu_description import FmuUnit, Unknown, Variable

# The elements of the description in version 2, by kind.
_ELEMENTS = {"model_exchange": "ModelExchange", "co_simulation": "CoSimulation"}


@dataclass(frozen=True)
class Fmu:
    """The FMU as a whole.

    name           of the mechanism, an identifier; title: as the user wrote it; about: one line
    version        of symdyn; fmi: of the interface, 2 or 3
    hash           of the equations
    kind           "model_exchange" or "co_simulation"
    duration       of a motion, s; tolerance: of a step of co-simulation where the importer gives none
    sources        names of the files in C that are compiled
    math_library   whether the functions of math.h are in a library of their own
    """

    name: str
    title: str
    about: str
    version: str
    fmi: int
    hash: str
    kind: str
    duration: str
    tolerance: str
    sources: tuple[str, ...]
    math_library: bool

    @property
    def token(self) -> str:
        """The text that the description and the binary have in common."""
        return f"{self.name}-{self.hash}-fmi{self.fmi}-{self.kind}"

    @property
    def element(self) -> str:
        """The kind as an element of the description in version 2."""
        return _ELEMENTS[self.kind]


@dataclass(frozen=True)
class Description:
    """The variables.

    units        as powers of base units
    variables    in the order of their references
    outputs      with the references that they depend on; rates: the derivatives of the states likewise
    unknown      references of all that is computed at the start
    indicators   references of the values whose zeros are events
    """

    units: tuple[FmuUnit, ...]
    variables: tuple[Variable, ...]
    outputs: tuple[Unknown, ...]
    rates: tuple[Unknown, ...]
    unknown: tuple[int, ...]
    indicators: tuple[int, ...]


@dataclass(frozen=True)
class Start:
    """Numbers at the start, as text: states x, inputs, parameters p."""

    x: tuple[str, ...]
    inputs: tuple[str, ...]
    p: tuple[str, ...]


@dataclass(frozen=True)
class Wrapped:
    """A function of the mechanism with the same arguments for all: a title, and the calls that it consists of."""

    name: str
    title: str
    calls: tuple[str, ...]


@dataclass(frozen=True)
class Code:
    """The mechanism as the parts in C need it.

    sizes          pairs of a macro and its value
    start          numbers at the start
    projects       whether states are kept on constraints or unit vectors
    differentiable whether there are exact derivatives; by_parameters: by parameters, too
    n_rows         rows of the constraints
    turning        which speeds are angular
    motions        of each motion that is an input: its index, those of its rate and its acceleration
    unit_groups    of each unit vector the indices of its entries in x, filled up with -1 to the same length
    events         see EventRecord
    functions      with the same arguments for all
    """

    sizes: tuple[tuple[str, int], ...]
    start: Start
    projects: bool
    differentiable: bool
    by_parameters: bool
    n_rows: int
    turning: tuple[bool, ...]
    motions: tuple[tuple[int, ...], ...]
    unit_groups: tuple[tuple[int, ...], ...]
    events: tuple[EventRecord, ...]
    functions: tuple[Wrapped, ...]


@dataclass(frozen=True)
class FmuContext(NamedRecords):
    """The names that the templates of an FMU get.

    fmu           the FMU as a whole
    description   the variables
    code          what the parts in C need of the mechanism
    """

    fmu: Fmu
    description: Description
    code: Code
