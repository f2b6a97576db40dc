"""Parameters of compliant contacts: which numbers they cannot be, as `params` may give them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from symdyn.errors import ArgumentError

if TYPE_CHECKING:
    from symdyn.runtime.module import Module


def impossible(module: Module, params: np.ndarray) -> dict[int, str]:
    """What is wrong with numbers of compliant contacts, by row of params (n, n_p); rows where nothing is are left out."""
    place = {name: k for k, name in enumerate(module.metadata.parameters)}
    found: dict[int, dict[str, None]] = {}
    for contact in module.metadata.compliant:
        for what, name, least, reached in contact.least:
            if name not in place:  # it has become a number, which was checked
                continue
            values = params[:, place[name]]
            for row in np.flatnonzero(~(values >= least if reached else values > least)).tolist():
                found.setdefault(row, {})[f"{what} of contact {contact.name} is {values[row]:g}; pass a number "
                                          f"{'from' if reached else 'above'} {least:g}{' on' if reached else ''}"] = None
    return {row: f"{module.name}: {'; '.join(faults)}" for row, faults in found.items()}


def check_compliance(module: Module, p: np.ndarray) -> None:
    """Raise ArgumentError for numbers of compliant contacts that cannot be; p: (n_p,)."""
    if module.metadata.compliant and (found := impossible(module, p[None, :])):
        raise ArgumentError(found[0])
