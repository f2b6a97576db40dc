"""Content of generated code: from equations and names of functions to the tapes, names, units and records that a backend
takes."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import fields, replace
from typing import Any

from symdyn.backend.columns import Columns
from symdyn.backend.metadata import (
    Chart,
    CompliantRecord,
    ContactRecord,
    EventRecord,
    GroupRecord,
    JumpRecord,
    Metadata,
    ModuleMetadata,
    ValidityRange,
)
from symdyn.backend.packed import NAME as PACKED
from symdyn.backend.right_side import RightSide
from symdyn.backend.source import Content
from symdyn.formulation.constraints.motion import BAUMGARTE
from symdyn.formulation.equations import Equations
from symdyn.formulation.event_bounds import enclosed, event_leaves, unknowns, unproved
from symdyn.formulation.names import BOUNDS, outputs_in, second_named
from symdyn.formulation.printed.skipped import skipped
from symdyn.functions.packed import band
from symdyn.functions.sensitivities import column_names, held_names
from symdyn.functions.table import FUNCTIONS, title_of
from symdyn.functions.tapes import given_rates, has_function, switches, tape_as_derived, tapes_of
from symdyn.model.contacts.compliance import Range
from symdyn.model.symbols import GivenMotion
from symdyn.shown import name_of
from symdyn.tape.balance import balance
from symdyn.tape.jumps import description
from symdyn.tape.node import Node
from symdyn.tape.passes import specialize
from symdyn.tape.tape import Tape
from symdyn.tape.taylor import not_smooth

# The extra state of a simulation that integrates the work of the loads.
WORK = "(work)"


def content_of(equations: Equations, names: Sequence[str], standalone: bool, bound: Mapping[str, float],
               right_side: RightSide,
               columns: Callable[[Equations, str, RightSide], Columns | None] | None = None) -> Content:
    """Content that a backend takes to emit the named functions.

    standalone   with what is documented in a file that is written
    bound        parameters that become numbers in the code, by name
    columns      decides which of these are directional derivatives, several columns at once; None: none of them
    """
    symbols = equations.symbols
    result = {name: columns(equations, name, right_side) for name in names} if columns is not None else {}
    several = {name: made for name, made in result.items() if made is not None}
    one_by_one = tapes_of(equations, [n for n in names if n not in several], right_side)
    regular = {n: several[n].tape if n in several else one_by_one[n] for n in names}
    parts = list(regular.items())
    if equations.singular_fallback is not None:
        there = tapes_of(equations.singular_fallback, names, right_side)
        parts += [(n, t) for n, t in there.items() if n in several or _entries(t) != _entries(regular[n])]
    folded = {**bound, **(dict.fromkeys(closed_names(equations), 0.0) if right_side.open_contacts else {})}
    if folded:
        parts = _together(parts, lambda whole: specialize(whole, folded))
    parts = _together(parts, balance)
    tapes, singular_fallback = dict(parts[:len(regular)]), dict(parts[len(regular):])
    groups = {"q": [s.name for s in symbols.coordinates], "u": [s.name for s in symbols.speeds],
              "z": [*[s.name for s in symbols.states], *[WORK] * right_side.work,
                    *column_names(symbols, right_side.sensitivities)],
              "ud": given_rates(equations, names, right_side.sensitivities),
              "inputs": [*[s.name for s in symbols.inputs], *held_names(right_side.sensitivities, right_side.followed)],
              "p": [*[s.name for s in symbols.parameters if s.name not in bound], *[BAUMGARTE] * right_side.baumgarte,
                    *held_names(right_side.sensitivities, right_side.held)]}
    outputs = output_shapes(equations) if "outputs" in names else ()
    titles = {n: title_of(n, bool(equations.constraints)) for n in names}
    return Content(equations.name, equations.formulation, tapes, titles, groups,
                   {s.name: unit for s, unit in symbols.units.items()}, _by_name(symbols.defaults),
                   _by_name(symbols.initial), outputs, skipped(equations) if standalone else (),
                   [[q.name for q in group] for group in equations.unit_groups], singular_fallback,
                   event_records(equations) if "events" in names else (),
                   _leaf_indices(equations, len(groups["q"]) + len(groups["u"]) + len(groups["z"])) if BOUNDS in names else (),
                   len(right_side.sensitivities), None if right_side.adjoint is None else len(right_side.adjoint),
                   {name: replace(made, tape=tapes[name]) for name, made in several.items()},
                   tuple(name for name in names if second_named(name) and name not in several),
                   band(equations, right_side.method, right_side.baumgarte, right_side.work) if PACKED in names else None)


def module_metadata(equations: Equations, of_code: Metadata) -> ModuleMetadata:
    """Metadata of a module: of its mechanism, and of the code of its right-hand side."""
    rates = tuple(given_rates(equations, ("rhs",)))
    parts = {f.name: getattr(of_code, f.name) for f in fields(Metadata)} | {"ud": rates, "outputs": output_shapes(equations)}
    return ModuleMetadata(
        **parts, functions=tuple(n for n in FUNCTIONS if has_function(equations, n)),
        conservative="power" in equations.quantities and not isinstance(equations.quantity("power").item(), Node),
        duration=equations.symbols.duration, constraints=tuple(equations.constraints), holonomic=tuple(equations.holonomic),
        unit_groups=tuple(tuple(q.name for q in group) for group in equations.unit_groups),
        bodies=tuple(equations.bodies), planar=equations.planar,
        masses={p.name: body for p, body in equations.symbols.masses.items()},
        reactions=tuple(name for name, *_ in equations.joints),
        reaction_bodies=tuple((parent, child) for _, parent, child, _ in equations.joints),
        reaction_kinds=tuple(kind for *_, kind in equations.joints),
        implicit_loads=tuple(equations.implicit_loads), of_reactions=tuple(equations.of_reactions),
        motions=tuple(s.name for s in equations.symbols.inputs if isinstance(s, GivenMotion)),
        events=event_records(equations), event_leaves=tuple(event_leaves(equations)),
        charts=tuple(Chart(*chart) for chart in equations.charts),
        validity_checks=tuple(ValidityRange(w.label, w.least, w.most, w.message, w.summed) for w in equations.validity_checks()),
        switches=tuple(JumpRecord(**description(jump, equations.printed_leaves())) for jump in switches(equations)),
        not_smooth=not_smooth(equations.quantity("rhs").tolist()),
        connections=tuple(equations.connections), acting=tuple(equations.acting), down=equations.down,
        drawn=tuple(equations.drawn), surroundings=tuple(equations.surroundings), flexible=tuple(equations.flexible),
        output_units=dict(equations.symbols.point_units),
        contacts=tuple(ContactRecord(c.name, c.contact, len(c.rows), c.switches[0].name if c.normal else "",
                                     c.switches[-1].name if len(c.rows) > c.normal else "", tuple(s.name for s in c.sliding),
                                     c.events, c.impact, c.kind, c.normal, _ranges(c.ranges)) for c in equations.contacts),
        compliant=tuple(CompliantRecord(c.name, len(c.rows), _ranges(c.ranges)) for c in equations.compliant),
        contact_groups=_group_records(equations))


def _ranges(ranges: Iterable[Range]) -> tuple[tuple[str, str, float, bool, float], ...]:
    """Ranges of the numbers of a contact, as plain data."""
    return tuple((one.what, one.value.name if one.value.is_Symbol else "", one.least, one.reached, one.below) for one in ranges)


def output_shapes(equations: Equations) -> tuple[tuple[str, tuple[int, ...]], ...]:
    """Names and shapes of the user's outputs."""
    return tuple((name, tuple(equations.quantity(q).shape)) for q, name in outputs_in(equations.quantities).items())


def event_records(equations: Equations) -> tuple[EventRecord, ...]:
    """Events as plain data."""
    symbols = equations.symbols
    indices = {s: k for k, s in enumerate((*symbols.coordinates, *symbols.speeds, *symbols.states))}
    about = zip(equations.events, enclosed(equations), unproved(equations), unknowns(equations), strict=True)
    return tuple(EventRecord(e.name, e.direction, e.stop, tuple(indices[s] for s, _ in e.reset), can, tuple(inputs),
                             tuple(functions), why) for e, can, why, (inputs, functions) in about)


def _group_records(equations: Equations) -> tuple[GroupRecord, ...]:
    indices = {u: k for k, u in enumerate(equations.symbols.speeds)}
    return tuple(GroupRecord(g.name, tuple(s.body for s in g.spheres), tuple(indices[u] for s in g.spheres for u in s.speeds),
                             len(g.planes)) for g in equations.contact_groups)


def with_open_contacts(equations: Equations, name: str) -> Tape:
    """The tape behind a function of a module, as it is emitted where all rigid contacts are open."""
    tape = tape_as_derived(equations, name)
    return balance(specialize(tape, dict.fromkeys(closed_names(equations), 0.0)) if equations.contacts else tape)


def closed_names(equations: Equations) -> list[str]:
    """Parameters that say in which mode rigid contacts are."""
    return list(dict.fromkeys(s.name for c in equations.contacts for s in (*c.switches, *c.sliding)))


def _leaf_indices(equations: Equations, n_x: int) -> list[int]:
    """Indices of the leaves that bound events, see `event_leaves`, where x has n_x entries, of which the last ones may be those
    of the run."""
    symbols = equations.symbols
    own = len(symbols.coordinates) + len(symbols.speeds) + len(symbols.states)
    return [k if k <= own else k + n_x - own for k in event_leaves(equations)]


def _entries(tape: Tape) -> tuple[Any, ...]:
    return next(iter(tape.outputs.values())).entries


def _together(parts: Sequence[tuple[str, Tape]], change: Callable[[Tape], Tape]) -> list[tuple[str, Tape]]:
    """A pass over all tapes as one, so that they still share their steps; a function has a second one where states are
    singular. Under their own names, under which a choice may have balanced the first ones."""
    first = {n: k for k, (n, _) in reversed(list(enumerate(parts)))}
    keys = [n if first[n] == k else f"{n} {k}" for k, (n, _) in enumerate(parts)]
    outputs = {key: next(iter(t.outputs.values())) for key, (_, t) in zip(keys, parts, strict=True)}
    whole = change(Tape(parts[0][1].recorder, outputs))
    return [(n, whole.prune((n,)) if key == n else Tape(whole.recorder, {n: whole.outputs[key]}))
            for key, (n, _) in zip(keys, parts, strict=True)]


def _by_name(values: Any) -> dict[str, float]:
    return {name_of(key): float(value) for key, value in values.items()}
