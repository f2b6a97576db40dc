"""Frozen records by subject that the templates of a Modelica model read.

They are listed for authors of templates in templates/README.md, which tests/backend/test_templates.py compares with them.
"""

from __future__ import annotations

from dataclasses import dataclass

from symdyn.backend.context import Algorithms
from symdyn.backend.function import Section
from symdyn.backend.user_functions import UserText
from symdyn.named_records import NamedRecords


@dataclass(frozen=True)
class ModelicaModel:
    """The model as a whole.

    name       an identifier; title: the kind of its equations and the mechanism
    version    of symdyn; hash: of the equations
    duration   of a motion, s
    """

    name: str
    title: str
    version: str
    hash: str
    duration: str


@dataclass(frozen=True)
class Variable:
    """A variable as it is declared: its name with its size, attributes in brackets, the value it is bound to, a description."""

    name: str
    attributes: str
    value: str
    about: str


@dataclass(frozen=True)
class Violation:
    """The largest of some residuals of constraints, with its unit."""

    name: str
    unit: str
    about: str
    residuals: tuple[str, ...]


@dataclass(frozen=True)
class Declared:
    """Variables.

    parameters, inputs, states, outputs   of the mechanism
    constants    lines that declare what depends on parameters only
    steps        lines with the names of all steps, with commas between
    """

    parameters: tuple[Variable, ...]
    inputs: tuple[Variable, ...]
    states: tuple[Variable, ...]
    outputs: tuple[Variable, ...]
    constants: tuple[str, ...]
    steps: tuple[str, ...]


@dataclass(frozen=True)
class Clause:
    """Actions when a condition becomes true: values that states are set to, and the words that a simulation ends with."""

    condition: str
    resets: tuple[tuple[str, str], ...]
    stops: str


@dataclass(frozen=True)
class ModelicaEquations:
    """Equations, and what is claimed at all times.

    sections          statements under headings; asserts: what must be positive in them
    rates             pairs of a state and its derivative; values: of an entry of the outputs and its value
    violations        of constraints, which are reported above `violated` times `length`
    validity_checks   pairs of a condition and a message
    events            pairs of a variable and the value whose zeros are events
    clauses           in one group those that set the same states, of which only one may do so at a time
    """

    sections: tuple[Section, ...]
    asserts: tuple[str, ...]
    rates: tuple[tuple[str, str], ...]
    values: tuple[tuple[str, str], ...]
    violations: tuple[Violation, ...]
    violated: str
    length: str
    validity_checks: tuple[tuple[str, str], ...]
    events: tuple[tuple[str, str], ...]
    clauses: tuple[tuple[Clause, ...], ...]


@dataclass(frozen=True)
class Sample:
    """An instance of the model in the test.

    modifications   of its states and inputs
    rates           the name of the rates of its states; states: their names
    claims          pairs of a claim and what it means if it does not hold
    """

    name: str
    modifications: str
    rates: str
    states: tuple[str, ...]
    claims: tuple[tuple[str, str], ...]


@dataclass(frozen=True)
class ModelicaContext(NamedRecords):
    """The names that the templates of a Modelica model get.

    model        the model as a whole
    declared     variables
    equations    equations, and what is claimed at all times
    algorithms   numeric algorithms that are called
    functions    that Modelica does not have and equations call
    user_texts   texts of the user with the functions that are called
    samples      instances of the model in the test
    """

    model: ModelicaModel
    declared: Declared
    equations: ModelicaEquations
    algorithms: Algorithms
    functions: tuple[str, ...]
    user_texts: tuple[UserText, ...]
    samples: tuple[Sample, ...]
