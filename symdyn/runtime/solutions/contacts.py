"""Contacts in a motion."""

from __future__ import annotations

import difflib
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, NamedTuple, TypeVar

import numpy as np

from symdyn.backend.metadata import ContactRecord
from symdyn.contact_kinds import CLUTCH, STOP
from symdyn.errors import ArgumentError
from symdyn.runtime.contact_laws import OPEN, SLIDING, STICKING
from symdyn.runtime.integrating.contacts import CONTACTS, rows_of
from symdyn.runtime.integrating.mode_codes import MODES
from symdyn.runtime.integrating.moreau import GAPS, modes_of
from symdyn.runtime.integrating.outcome import Impact, Phase, Stepped
from symdyn.shown import shown

if TYPE_CHECKING:
    from symdyn.runtime.solutions.solution import Solution

Of = TypeVar("Of")
COMPLIANT = "compliant_contacts"
CLOSED = "closed"


class Impacts(NamedTuple):
    """Impacts of a contact: when, t (n,), the impulses along its normal and tangents, N s (n, 1 + n_tangents), the velocities
    there before and after, m/s (n, 1 + n_tangents)."""

    t: np.ndarray
    impulse: np.ndarray
    before: np.ndarray
    after: np.ndarray


class ContactMotion(NamedTuple):
    """A contact along a motion.

    mode      "open", "sticking" or "sliding" at every time, (n_t,); a compliant one sticks where its slip is at most slip_speed;
              stops, ropes and clutches are "open" or "closed", friction of joints is never open
    gap       m, (n_t,), of a stop what is left to it, rad or m, of a clutch its speed
    force     on body a along the normal, then along the tangents, N, (n_t, 1 + n_tangents); zero where it is open; of a joint the
              torque, N m, or force, N, of friction without a normal one
    slip      velocity of body a against body b along the tangents, m/s, (n_t, n_tangents)
    impulse   sum of the impulses since the start, N s, (n_t, 1 + n_tangents): those of impacts; by time stepping, which
              does not separate impacts from forces, of both; of a compliant contact, whose forces are finite, zero
    impacts   one by one, see Impacts
    rests     times at which infinitely many impacts have come to their end, s, (n,)
    switches  times from which on the contact is in another mode, with that mode; of a compliant one as far as times were stored
    """

    mode: np.ndarray
    gap: np.ndarray
    force: np.ndarray
    slip: np.ndarray
    impulse: np.ndarray
    impacts: Impacts
    rests: np.ndarray
    switches: tuple[tuple[float, str], ...]


class ByName(dict[str, Of]):
    """Contacts of a motion, or groups of them, by name. Another name raises ArgumentError with those that there are."""

    def __init__(self, owner: str, kind: str, motions: Mapping[str, Of]) -> None:
        super().__init__(motions)
        self.owner, self.kind = owner, kind

    def __missing__(self, name: object) -> Of:
        near = difflib.get_close_matches(str(name), self, 3)
        hint = f"did you mean {' or '.join(near)}?" if near else f"there are {', '.join(self) or 'none'}"
        raise ArgumentError(f"{self.owner}: there is no {self.kind} {shown(name)}; {hint}")


def contact_motions(solution: Solution, phases: Sequence[Phase], row_phases: np.ndarray,
                    impacts: Sequence[Impact], stepped: Stepped | None = None) -> Mapping[str, ContactMotion]:
    """Every contact of a motion by name, one for each place where a shape touches."""
    if stepped is not None:
        rigid: Mapping[str, ContactMotion] = stepped_contacts(solution, stepped)
    else:
        rigid = _rigid(solution, phases, row_phases, impacts)
    return ByName(solution.module.name, "contact", {**rigid, **_compliant(solution)})


def _compliant(solution: Solution) -> dict[str, ContactMotion]:
    """Compliant contacts: what they do follows from the state alone."""
    records, result, first = solution.module.metadata.compliant, {}, 0
    values = solution.rows(COMPLIANT).reshape(len(solution.t), -1) if records else np.zeros((len(solution.t), 0))
    for record in records:
        gap, slow = values[:, first], values[:, first + 1]
        force, slip = np.split(values[:, first + 2:first + 1 + 2 * record.rows], [record.rows], axis=1)
        first += 1 + 2 * record.rows
        still = (np.linalg.norm(slip, axis=1) <= slow) & (record.rows > 1)
        mode = np.where(gap > 0, OPEN, np.where(still, STICKING, SLIDING)).astype(object)
        changes = [0, *(1 + np.flatnonzero(mode[1:] != mode[:-1]))] if len(mode) else []
        none = np.zeros((0, record.rows))
        result[record.name] = ContactMotion(mode, gap, force, slip, np.zeros_like(force), Impacts(np.zeros(0), none, none, none),
                                            np.zeros(0), tuple((float(solution.t[k]), str(mode[k])) for k in changes))
    return result


def _rigid(solution: Solution, phases: Sequence[Phase], row_phases: np.ndarray,
           impacts: Sequence[Impact]) -> dict[str, ContactMotion]:
    records = solution.module.metadata.contacts
    if not records:
        return {}
    n = sum(record.rows for record in records)
    values = solution.rows(CONTACTS).reshape(len(solution.t), -1)
    k = len(records)
    slips, forces = values[:, 4 * k:4 * k + n], values[:, 4 * k + 2 * n:4 * k + 3 * n]
    result = {}
    for index, (record, rows) in enumerate(zip(records, rows_of(records), strict=True)):
        own = list(rows)
        hits = [one for one in impacts if one.impulses[own].any()]
        t = np.array([one.t for one in hits])
        of_hits = Impacts(t, *[np.array([getattr(one, what)[own] for one in hits]).reshape(-1, len(own))
                               for what in ("impulses", "before", "after")])
        modes = [_called(phase.modes[index], record) for phase in phases]
        changes = [(phase.t, mode) for i, (phase, mode) in enumerate(zip(phases, modes, strict=True))
                   if i == 0 or modes[i - 1] != mode]
        summed = np.vstack([np.zeros(len(own)), np.cumsum(of_hits.impulse, axis=0)])
        result[record.name] = ContactMotion(
            np.array(modes, dtype=object)[row_phases] if modes else np.zeros(0, dtype=object), values[:, 4 * index],
            forces[:, own], slips[:, own[record.normal:]], summed[np.searchsorted(t, solution.t, side="left")], of_hits,
            np.array([one.rest[index] for one in impacts if index in one.rest]), tuple(changes))
    return result


def stepped_contacts(solution: Solution, stepped: Stepped) -> dict[str, ContactMotion]:
    """Contacts with a name in a motion by time stepping: modes and forces are those of the step before every time."""
    records = solution.module.metadata.contacts
    if not records:
        return {}
    n_steps, n = len(stepped.h), len(records)
    values = solution.rows(GAPS).reshape(len(solution.t), -1)
    modes, touched = modes_of(stepped, n), stepped.touched
    before = np.maximum(stepped.row - 1, 0)
    result = {}
    for index, (record, rows) in enumerate(zip(records, rows_of(records), strict=True)):
        own = np.flatnonzero((touched.b < 0) & (touched.a == index))
        impulses = np.zeros((n_steps, record.rows))
        impulses[touched.step[own]] = touched.values[own, 4:4 + record.rows]
        summed = np.vstack([np.zeros(record.rows), np.cumsum(impulses, axis=0)])
        mode, none = modes[:, index], np.zeros((len(solution.t), record.rows))
        fresh = own[(touched.values[own, 4] > 0) & (np.append(0, mode)[touched.step[own]] == 0) & record.normal]
        after, of_hits, before_hits = (touched.values[fresh, k:k + record.rows] for k in (1, 4, 7))
        hits = Impacts(stepped.t[touched.step[fresh]], of_hits, before_hits, after)
        changes = [k for k in range(n_steps) if k == 0 or mode[k] != mode[k - 1]]
        names = np.array([_called(name if record.normal or name != OPEN else STICKING, record) for name in MODES], dtype=object)
        result[record.name] = ContactMotion(
            names[mode][before] if n_steps else np.array([names[0]] * len(solution.t), dtype=object), values[:, 4 * index],
            (impulses / stepped.h[:, None])[before] if n_steps else none, values[:, [4 * n + r for r in rows[record.normal:]]],
            summed[stepped.row], hits, np.zeros(0), tuple((float(stepped.t[k]), str(names[mode[k]])) for k in changes))
    return result


class GroupMotion(NamedTuple):
    """Contacts of a group along a motion by time stepping, one row for each that was near in the step before a stored time.

    row       index of that time, (n,)
    a, b      indices of both bodies in the group; from the number of its bodies on b counts its planes
    mode      "open", "sticking" or "sliding"
    gap       m, at the end of the step
    normal    normal force, N; friction: size of the tangential force, N; both are the impulse by the length of the step
    slip      size of the tangential velocity at the end of the step, m/s
    """

    row: np.ndarray
    a: np.ndarray
    b: np.ndarray
    mode: np.ndarray
    gap: np.ndarray
    normal: np.ndarray
    friction: np.ndarray
    slip: np.ndarray


def group_motions(solution: Solution, stepped: Stepped) -> Mapping[str, GroupMotion]:
    """Every group of contacts by name."""
    touched, first, plane = stepped.touched, 0, 0
    result: dict[str, GroupMotion] = {}
    groups = solution.module.metadata.contact_groups
    n_bodies = sum(len(group.bodies) for group in groups)
    row_of = np.full(len(stepped.h), -1)
    row_of[stepped.row[stepped.row > 0] - 1] = np.flatnonzero(stepped.row > 0)
    rows = row_of[touched.step]
    for group in groups:
        end = first + len(group.bodies)
        own = np.flatnonzero((touched.b >= 0) & (touched.a >= first) & (touched.a < end) & (rows >= 0))
        b, values = touched.b[own], touched.values[own]
        other = np.where(b >= n_bodies, b - n_bodies - plane + len(group.bodies), b - first)
        forces = values[:, 4:7] / stepped.h[touched.step[own], None]
        modes = np.array(MODES, dtype=object)[touched.state[own]]
        result[group.name] = GroupMotion(rows[own], touched.a[own] - first, other, modes, values[:, 0], forces[:, 0],
                                         np.linalg.norm(forces[:, 1:], axis=1), np.linalg.norm(values[:, 2:4], axis=1))
        first, plane = end, plane + group.planes
    return ByName(solution.module.name, "contact group", result)


def _called(mode: str, record: ContactRecord) -> str:
    """The mode of a contact, or of an element of joints, which does not slide where it has no friction."""
    return CLOSED if record.kind in (STOP, CLUTCH) and mode != OPEN else mode
