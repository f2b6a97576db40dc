"""Metadata of generated code: names, sizes, units, shapes; of a module also constraints, events, joints, switches.

One record, made once from the equations and read by the runtime. It is plain data, goes to JSON and back, and knows no SymPy, so
that modules travel to other processes and machines.
"""

from __future__ import annotations

import functools
import types
import typing
from collections.abc import Mapping
from dataclasses import dataclass, field, fields, is_dataclass
from typing import Any, NamedTuple

from symdyn.errors import SymdynError

_AGAIN = "write the module again with this version of symdyn"
# Groups of names, as arguments of generated functions are called.
GROUPS = ("q", "u", "z", "ud", "inputs", "parameters", "x")


@dataclass(frozen=True)
class Sizes:
    """Numbers of coordinates, speeds, further states, accelerations (and what else stands in `ud`), inputs, parameters; of x."""

    q: int
    u: int
    z: int
    ud: int
    inputs: int
    p: int

    @property
    def x(self) -> int:
        """The length of the state x = [q; u; z]."""
        return self.q + self.u + self.z


@dataclass(frozen=True)
class Metadata:
    """Metadata of one piece of generated code.

    q, u, z, ud, inputs, parameters   names, in the order of the arguments; units: by name, "" where there is none
    defaults     of the parameters, None where there is none; initial: values of q, u, z and inputs, by name
    shapes       of the result of each function; operations: their number; arguments: groups that it takes
    outputs      names and shapes of the outputs, one after the other in the function `outputs`
    reasons      why a function cannot be evaluated, by return code from 1 on
    n_c          number of constants that the prologue computes from the parameters
    """

    name: str
    formulation: str
    version: str
    q: tuple[str, ...]
    u: tuple[str, ...]
    z: tuple[str, ...]
    ud: tuple[str, ...]
    inputs: tuple[str, ...]
    parameters: tuple[str, ...]
    defaults: tuple[float | None, ...]
    initial: Mapping[str, float]
    units: Mapping[str, str]
    shapes: Mapping[str, tuple[int, ...]]
    outputs: tuple[tuple[str, tuple[int, ...]], ...]
    reasons: tuple[str, ...]
    n_c: int
    operations: Mapping[str, int]
    arguments: Mapping[str, tuple[str, ...]]

    @functools.cached_property
    def x(self) -> tuple[str, ...]:
        """Names of the state x = [q; u; z]."""
        return (*self.q, *self.u, *self.z)

    @functools.cached_property
    def sizes(self) -> Sizes:
        return Sizes(len(self.q), len(self.u), len(self.z), len(self.ud), len(self.inputs), len(self.parameters))

    def names(self, group: str) -> tuple[str, ...]:
        """The names of one of GROUPS."""
        if group not in GROUPS:
            raise ValueError(f"there is no group {group!r} of names; there are {', '.join(GROUPS)}")
        result: tuple[str, ...] = getattr(self, group)
        return result

    def initial_values(self, group: str) -> dict[str, float]:
        """The initial values of a group by name, 0 where the system has none."""
        return {name: self.initial.get(name, 0.0) for name in self.names(group)}

    def as_plain(self) -> dict[str, Any]:
        """Dictionaries, lists, texts and numbers only, as JSON takes them."""
        return {f.name: _plain(getattr(self, f.name)) for f in fields(self)}

    @classmethod
    def of_plain(cls, record: Mapping[str, Any]) -> typing.Self:
        """The record that `as_plain` gave, entries that it does not have left out.

        Raises SymdynError where an entry is missing or of another kind.
        """
        return typing.cast("typing.Self", _restored(cls, record, cls.__name__))


class EventRecord(NamedTuple):
    """An event; reset: indices in x; enclosed: whether its value has bounds; the inputs and functions that it depends on;
    unproved: why a pulse of its value may be missed, "" where its bounds rule that out."""

    name: str
    direction: int
    stop: bool
    reset: tuple[int, ...]
    enclosed: bool
    inputs: tuple[str, ...]
    functions: tuple[str, ...]
    unproved: str = ""


class ContactRecord(NamedTuple):
    """A rigid contact in one place: the contact that it is of, its number of rows, the parameters that its mode is set by ("" and
    none without friction), what its events are called after its name, its law of impacts, its kind, whether its first row is a
    normal one; ranges: as of a CompliantRecord."""

    name: str
    contact: str
    rows: int
    closed: str
    sticking: str
    sliding: tuple[str, ...]
    events: tuple[str, ...]
    impact: str
    kind: str
    normal: bool
    ranges: tuple[tuple[str, str, float, bool, float], ...] = ()

    @property
    def tangents(self) -> int:
        """Its number of tangential rows."""
        return self.rows - self.normal

    @property
    def parameters(self) -> tuple[str, ...]:
        """The parameters that a run sets."""
        return (*filter(None, (self.closed, self.sticking)), *self.sliding)


class GroupRecord(NamedTuple):
    """A group of contacts whose pairs are found along a motion: its bodies, indices of their speeds in u by bodies, number of
    its planes."""

    name: str
    bodies: tuple[str, ...]
    speeds: tuple[int, ...]
    planes: int


class CompliantRecord(NamedTuple):
    """A compliant contact in one place, its number of rows, and which numbers parameters may give it: what each is of the
    contact, the parameter's name, "" of an expression, whose value the function contact_coefficients gives; the least number,
    whether that itself is one, and the number that it stays below."""

    name: str
    rows: int
    ranges: tuple[tuple[str, str, float, bool, float], ...] = ()


class Chart(NamedTuple):
    """Euler angles of a joint: their sequence, the kind of its speeds, the coordinate of the second angle."""

    joint: str
    sequence: str
    speeds: str
    angle: str


class JumpRecord(NamedTuple):
    """A term that may jump in the right-hand side, the surface where it does, its part of the equations, and what to write in
    its place."""

    what: str
    surface: str
    where: str
    remedy: str


class ValidityRange(NamedTuple):
    """The range that a load is meant for; message: what it means outside, with {value}; summed: whether it is the range of the
    value's integral over time."""

    label: str
    least: float
    most: float
    message: str
    summed: bool = False


@dataclass(frozen=True)
class ModuleMetadata(Metadata):
    """Metadata of a module: those of its code, and of its mechanism.

    functions     that can be made; conservative: whether no load but gravity and springs does work; duration: of a motion, s
    constraints   labels of the rows; holonomic: whether each is one of positions
    unit_groups   coordinates that have unit length together
    bodies        names; planar: three velocities per body in place of six; masses: parameter of each body's mass
    reactions     names of the joints, reaction_bodies: parent and child, reaction_kinds: their kinds
    implicit_loads, of_reactions   what loads depend on accelerations and multipliers, on reactions
    motions       inputs whose rates and accelerations are inputs, too
    events, event_leaves   see EventRecord; entries of [t; x; inputs] whose ranges bound events
    charts, validity_checks   see Chart, ValidityRange; switches: see JumpRecord; not_smooth: why there is no Taylor series
    drawn, flexible        what bodies look like and how they bend, as the pictures take it
    surroundings           what contacts touch and how mooring lines hang, likewise
    connections            loads along a line between two points: name, bodies, kind ("spring", "damper", "both", "force", "line",
                           "rope")
    acting                 forces and torques of loads, row by row of applied_loads: name, body, kind ("force", "torque")
    down                   direction of gravity, zero where there is none
    output_units           of outputs that are points
    contacts               rigid ones, see ContactRecord; compliant: see CompliantRecord; contact_groups: see GroupRecord
    """

    functions: tuple[str, ...] = ()
    conservative: bool = False
    duration: float = 0.0
    constraints: tuple[str, ...] = ()
    holonomic: tuple[bool, ...] = ()
    unit_groups: tuple[tuple[str, ...], ...] = ()
    bodies: tuple[str, ...] = ()
    planar: bool = False
    masses: Mapping[str, str] = field(default_factory=dict)
    reactions: tuple[str, ...] = ()
    reaction_bodies: tuple[tuple[str, str], ...] = ()
    reaction_kinds: tuple[str, ...] = ()
    implicit_loads: tuple[str, ...] = ()
    of_reactions: tuple[str, ...] = ()
    motions: tuple[str, ...] = ()
    events: tuple[EventRecord, ...] = ()
    event_leaves: tuple[int, ...] = ()
    charts: tuple[Chart, ...] = ()
    validity_checks: tuple[ValidityRange, ...] = ()
    switches: tuple[JumpRecord, ...] = ()
    not_smooth: str = ""
    drawn: tuple[Mapping[str, Any], ...] = ()
    surroundings: tuple[Mapping[str, Any], ...] = ()
    flexible: tuple[Mapping[str, Any], ...] = ()
    connections: tuple[tuple[str, str, str, str], ...] = ()
    acting: tuple[tuple[str, str, str], ...] = ()
    down: tuple[float, float, float] = (0.0, 0.0, 0.0)
    output_units: Mapping[str, str] = field(default_factory=dict)
    contacts: tuple[ContactRecord, ...] = ()
    compliant: tuple[CompliantRecord, ...] = ()
    contact_groups: tuple[GroupRecord, ...] = ()


def _plain(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {key: _plain(v) for key, v in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(v) for v in value]
    return value


def _restored(kind: Any, value: Any, where: str) -> Any:
    """A value of an annotated kind from plain data."""
    origin, arguments = typing.get_origin(kind), typing.get_args(kind)
    if kind is Any:
        return value
    if origin in (typing.Union, types.UnionType):
        return None if value is None else _restored(next(a for a in arguments if a is not type(None)), value, where)
    if is_dataclass(kind) or hasattr(kind, "_fields"):
        return _restored_record(kind, value, where)
    if origin is tuple and isinstance(value, (list, tuple)):
        kinds = [arguments[0]] * len(value) if arguments[-1] is Ellipsis else arguments
        if len(kinds) == len(value):
            return tuple(_restored(k, v, f"{where}[{i}]") for i, (k, v) in enumerate(zip(kinds, value, strict=True)))
    elif origin is not None and issubclass(origin, Mapping) and isinstance(value, Mapping):
        return {key: _restored(arguments[1], v, f"{where}[{key!r}]") for key, v in value.items()}
    elif type(value) in ((int, float) if kind is float else (kind,)):
        return value
    raise SymdynError(f"{where} of a module's metadata is {value!r:.60}, where {kind} is wanted; {_AGAIN}")


def _restored_record(kind: Any, value: Any, where: str) -> Any:
    hints = typing.get_type_hints(kind)
    if not hasattr(kind, "_fields"):
        if not isinstance(value, Mapping):
            raise SymdynError(f"{where} of a module's metadata is {value!r:.60}, where names with values are wanted; {_AGAIN}")
        given = {f.name: _restored(hints[f.name], value[f.name], f"{where}.{f.name}") for f in fields(kind) if f.name in value}
        try:
            return kind(**given)
        except TypeError as error:
            raise SymdynError(f"{where} of a module's metadata: {error}; {_AGAIN}") from None
    names = kind._fields
    if not isinstance(value, (list, tuple)) or len(value) != len(names):
        raise SymdynError(f"{where} of a module's metadata is {value!r:.60}, where {', '.join(names)} are wanted; {_AGAIN}")
    return kind(*[_restored(hints[n], v, f"{where}.{n}") for n, v in zip(names, value, strict=True)])
