"""Rigid contacts in one mode, for linear equations and states of rest: what closed contacts hold, and their parameters."""

from __future__ import annotations

import difflib
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from symdyn.errors import ArgumentError
from symdyn.runtime.contact_laws import OPEN, SLIDING, STICKING
from symdyn.runtime.integrating.contacts import CONTACTS, SHARED, SOFTNESS, numbers, rows_of
from symdyn.shown import shown
from symdyn.thresholds import DEPENDENT

if TYPE_CHECKING:
    from symdyn.backend.metadata import ContactRecord
    from symdyn.runtime.module import Module
    from symdyn.statics.terms import OperatingPoint

MODES = (OPEN, STICKING, SLIDING)
# Gaps, m, up to which contacts touch.
TOUCHING = 1e-9
# Slips below this part of the largest rate have no direction.
NO_SPEED = 1e-11


def asked_modes(module: Module, given: Any) -> dict[str, Any]:
    """The mode of every contact by its name, with a direction where one is given. Raises ArgumentError for what does not fit.

    given   mapping from names of contacts, or of places where their shapes touch, to "open", "sticking", "sliding" or
            ("sliding", direction), the direction of slip a sign or two numbers; what is left out is open
    """
    records, owner = module.metadata.contacts, module.name
    if not isinstance(given, Mapping):
        raise ArgumentError(f"{owner}: contacts is {shown(given)}; pass a mapping such as {{'heel': 'sticking'}}")
    result: dict[str, Any] = {record.name: OPEN for record in records}
    known = list(dict.fromkeys([*result, *[record.contact for record in records]]))
    for name, mode in given.items():
        own = [record for record in records if name in (record.name, record.contact)]
        if not own:
            near = difflib.get_close_matches(str(name), known, 3)
            hint = f"did you mean {' or '.join(near)}?" if near else f"there are {', '.join(known) or 'none'}"
            raise ArgumentError(f"{owner}: there is no rigid contact {shown(name)}; {hint}")
        kind = mode[0] if isinstance(mode, (tuple, list)) and len(mode) == 2 else mode
        if kind not in MODES:
            raise ArgumentError(f"{owner}: the mode of contact {name} is {shown(mode)}; there are 'open', 'sticking', 'sliding', "
                                "and ('sliding', direction)")
        result.update({record.name: mode for record in own})
    return result


def with_modes(module: Module, given: Any, t: float, x: np.ndarray, p: np.ndarray, inputs: np.ndarray) -> np.ndarray:
    """The parameters with the modes of contacts set. Raises ArgumentError for slips without direction, and gaps that are open."""
    modes = asked_modes(module, given)
    index = {name: k for k, name in enumerate(module.metadata.parameters)}
    at = numbers(module, t, x, p, inputs)
    p = p.copy()
    for k, (record, rows) in enumerate(zip(module.metadata.contacts, rows_of(module.metadata.contacts), strict=True)):
        mode = modes[record.name]
        kind = mode if isinstance(mode, str) else mode[0]
        if kind != OPEN and abs(at.gap[k]) > 1e3 * TOUCHING * max(1.0, float(np.abs(x).max(initial=0.0))):
            raise ArgumentError(f"{module.name}: contact {record.name} is to be {kind}, but its gap is {at.gap[k]:.6g} m; pass a "
                                "state in which it touches, or 'open'")
        if kind == STICKING and not record.sticking:
            kind = SLIDING  # without friction
        p[index[record.closed]] = kind != OPEN
        if not record.sticking:
            continue
        p[index[record.sticking]] = kind == STICKING
        slip = at.slip[list(rows[1:])]
        direction = _direction(module, record, mode, slip) if kind == SLIDING else np.zeros(len(slip))
        for name, value in zip(record.sliding, direction, strict=True):
            p[index[name]] = value
    held = held_places(module, p)
    D = at.D[np.ix_(held, held)]
    p[index[SHARED]] = SOFTNESS if len(held) and np.linalg.matrix_rank(D, DEPENDENT * np.abs(D).max()) < len(held) else 0.0
    return p


def _direction(module: Module, record: ContactRecord, mode: Any, slip: np.ndarray) -> np.ndarray:
    """The direction of a slip, of length 1."""
    given = slip if isinstance(mode, str) else mode[1]
    try:
        direction = np.atleast_1d(np.asarray(given, dtype=float))
    except (TypeError, ValueError):
        direction = np.zeros(0)
    size = float(np.linalg.norm(direction))
    if direction.shape != slip.shape or not np.isfinite(size) or size <= NO_SPEED:
        wanted = "1 or -1" if len(slip) == 1 else "two numbers"
        raise ArgumentError(f"{module.name}: contact {record.name} is to slide, but it does not slip, so that friction has no "
                            f"direction; pass ('sliding', direction) with {wanted}, or 'sticking'")
    return direction / size


def held_places(module: Module, p: np.ndarray) -> list[int]:
    """Rows of contacts that hold in the mode that parameters say."""
    index = {name: k for k, name in enumerate(module.metadata.parameters)}
    result = []
    for record, rows in zip(module.metadata.contacts, rows_of(module.metadata.contacts), strict=True):
        if record.closed in index and p[index[record.closed]]:
            result += [rows[0], *(rows[1:] if record.sticking and p[index[record.sticking]] else ())]
    return result


def demand_modes(module: Module, t: float, x: np.ndarray, p: np.ndarray, inputs: np.ndarray) -> None:
    """Raise ArgumentError where contacts touch and no mode is given."""
    if not module.metadata.contacts or held_places(module, p):
        return
    at = numbers(module, t, x, p, inputs)
    touching = [record.name for record, gap in zip(module.metadata.contacts, at.gap, strict=True) if gap <= TOUCHING]
    if touching:
        raise ArgumentError(f"{module.name}: contacts touch here: {', '.join(touching)}; pass in which modes they are, such as "
                            f"contacts={{'{touching[0]}': 'sticking'}}, or contacts={{}} for open ones")


class Rows(NamedTuple):
    """Relative velocities that closed contacts hold at zero, (k,): by the speeds (k, n_u); they and their rates at given
    accelerations by x (k, n_x) and by inputs (k, n_in)."""

    by_u: np.ndarray
    rates: np.ndarray
    accelerations: np.ndarray
    rates_in: np.ndarray
    accelerations_in: np.ndarray


def contact_rows(point: OperatingPoint) -> Rows | None:
    """Rows that the closed contacts of a point hold; None: nothing. J of the rows, D = J B with B = M^-1 J^T, and the
    accelerations J u_dot + b with b = free - J u_dot_open give their derivatives at given u_dot."""
    module, p = point.module, point.p
    if not module.metadata.contacts:
        return None
    held = held_places(module, p)
    if not held:
        return None
    n_q, n_u, *_ = point.sizes
    at = numbers(module, point.t, point.x, p, point.inputs)
    n, k = len(at.slip), len(at.gap)
    parted = p.copy()
    names = {name: j for j, name in enumerate(module.metadata.parameters)}
    for record in module.metadata.contacts:
        for name in record.parameters:
            parted[names[name]] = 0.0
    by = module.jacobian(point.t, point.x, p, point.inputs, ["x", "inputs"], CONTACTS)
    of_open = module.jacobian(point.t, point.x, parted, point.inputs, ["x", "inputs"])
    slips = [np.asarray(part)[4 * k:4 * k + n][held] for part in (by.x, by.inputs)]
    J = slips[0][:, n_q:n_q + n_u]
    result = []
    for part, parted_rates in ((np.asarray(by.x), np.asarray(of_open.x)), (np.asarray(by.inputs), np.asarray(of_open.inputs))):
        first = 4 * k + 3 * n
        free = part[4 * k + n:4 * k + 2 * n]
        D = part[first:first + n * n].reshape(n, n, -1)
        B = part[first + n * n:first + n * n + n_u * n].reshape(n_u, n, -1)
        turned = np.einsum("ijx,j->ix", D, at.force)[held] - J @ np.einsum("ujx,j->ux", B, at.force)
        result.append(free[held] + turned - J @ parted_rates[n_q:n_q + n_u])
    return Rows(J, slips[0], result[0], slips[1], result[1])
