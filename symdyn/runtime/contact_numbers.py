"""Numbers of contacts that cannot be, as `params` may give them."""

from __future__ import annotations

import contextlib
from typing import TYPE_CHECKING

import numpy as np

from symdyn.backend.metadata import CompliantRecord, ContactRecord
from symdyn.errors import ArgumentError, EvaluationError
from symdyn.real_numbers import in_range, range_text

if TYPE_CHECKING:
    from symdyn.runtime.module import Module

NUMBERS = "contact_coefficients"


def impossible(module: Module, t: float, starts: np.ndarray, params: np.ndarray, inputs: np.ndarray) -> dict[int, str]:
    """Faults of numbers of contacts, by row; rows where nothing is are left out.

    t        of the starts, s
    starts   (n, n_x) or (1, n_x), params: (n, n_p) or (1, n_p), inputs: (n, n_in) or (1, n_in)
    """
    index = {name: k for k, name in enumerate(module.metadata.parameters)}
    result: dict[int, dict[str, None]] = {}
    values = _values(module, t, starts, params, inputs) if NUMBERS in module.metadata.functions else np.zeros((1, 0))
    seen = 0
    for contact in _contacts(module):
        for what, name, least, reached, below in contact.ranges:
            if not name:
                column, seen = values[:, seen], seen + 1
            elif name in index:
                column = params[:, index[name]]
            else:  # it has become a number, which was checked
                continue
            good = in_range(column, least, reached, below)
            for row in np.flatnonzero(~good & np.isfinite(params).all(axis=1)).tolist():  # the others have a reason of their own
                result.setdefault(row, {})[f"{what} of contact {_name(contact)} is {column[row]:g}; "
                                           f"{range_text(least, reached, below)}"] = None
    return {row: f"{module.name}: {'; '.join(faults)}" for row, faults in result.items()}


def _contacts(module: Module) -> tuple[ContactRecord | CompliantRecord, ...]:
    return (*module.metadata.contacts, *module.metadata.compliant)


def _name(contact: ContactRecord | CompliantRecord) -> str:
    """Name that the user gave, one for all corners of a box."""
    return contact.contact if isinstance(contact, ContactRecord) else contact.name


def _values(module: Module, t: float, starts: np.ndarray, params: np.ndarray, inputs: np.ndarray) -> np.ndarray:
    """Values of expressions of parameters, (n, n_values); not a number where they cannot be evaluated."""
    together = len(params) == 1
    width = sum(not name for contact in _contacts(module) for _, name, *_ in contact.ranges)
    result = np.full((max(len(starts), len(inputs)) if together else len(params), width), np.nan)
    for k, p in enumerate(params):
        rows = slice(None) if together else slice(k, k + 1)
        x, given = (of if together or len(of) == 1 else of[rows] for of in (starts, inputs))
        with contextlib.suppress(EvaluationError):
            result[rows] = module.evaluate(NUMBERS, t, x, p, given).reshape(-1, width)
    return result


def check_contact_numbers(module: Module, t: float, x: np.ndarray, p: np.ndarray, inputs: np.ndarray) -> None:
    """Raise ArgumentError for numbers of contacts that cannot be; x: (n_x,), p: (n_p,), inputs: (n_in,)."""
    if result := impossible(module, t, x[None, :], p[None, :], np.atleast_2d(inputs)):
        raise ArgumentError(result[0])
