"""Names that occur although the motion does not depend on them: parameters that cancel, such as a factor of all masses.

Rounding leaves something of terms that cancel, and unstable motions magnify it without bound, so that the size of a sensitivity
does not show. The equations do: with other values of the parameter they give the same at all states of the motion.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from symdyn.errors import EvaluationError
from symdyn.runtime.integrating.events import EVENTS, RESETS

if TYPE_CHECKING:
    from symdyn.runtime.integrating.outcome import Request
    from symdyn.runtime.module import Module

# Changes up to this part of the size of what changes are rounding: 1e4 of its units, 2.2e-12.
ROUNDING = 1e4 * float(np.finfo(float).eps)
# Entries that are no larger than this part of the largest of their kind are rounding themselves.
NOTHING = 1e3 * float(np.finfo(float).eps)


def unaffected(module: Module, request: Request, names: Sequence[str], t: np.ndarray, x: np.ndarray) -> list[str]:
    """The parameters and constant inputs among names with which neither the right-hand side nor events and their resets change by
    more than rounding, at rows x (n_t, n_x) of a motion at times t.

    Each takes 1.5 times its value, and 1 more. A motion that cannot be evaluated then counts as dependent on it.
    """
    metadata = module.metadata
    inputs = np.broadcast_to(request.inputs.rows(t, x), (len(t), metadata.sizes.inputs))
    functions: list[tuple[str, tuple[int, ...]]] = [("rhs", groups_of(module))]
    if request.look is not None and request.look.any():
        functions += [(name, ()) for name in (EVENTS, RESETS) if name in metadata.functions]

    def stays(name: str) -> bool:
        for function, groups in functions:
            here = module.evaluate(function, t, x, request.p, inputs)
            size = ROUNDING * sizes(here, groups)
            for other in (lambda value: 1.5 * value, lambda value: value + 1.0):
                p, given = request.p.copy(), inputs.copy()
                if name in metadata.parameters:
                    index = metadata.parameters.index(name)
                    p[index] = other(p[index])
                else:
                    index = metadata.inputs.index(name)
                    given[:, index] = other(given[:, index])
                if not (np.abs(module.evaluate(function, t, x, p, given) - here) <= size).all():
                    return False
        return True

    result = []
    for name in names:
        try:
            result += [name] if stays(name) else []
        except EvaluationError:
            continue
    return result


def groups_of(module: Module) -> tuple[int, int, int]:
    """Numbers of coordinates, speeds and extra states."""
    sizes = module.metadata.sizes
    return sizes.q, sizes.u, sizes.z


def sizes(values: np.ndarray, groups: Sequence[int]) -> np.ndarray:
    """The largest values of every column, of what is nothing but rounding those of its group; groups: numbers of columns.

    values   (..., n_rows, n_columns)
    """
    own = np.abs(values).max(axis=-2)
    parts = np.split(own, np.cumsum(groups)[:-1] if groups else own.shape[-1], axis=-1)
    largest = np.concatenate([np.broadcast_to(part.max(axis=-1, keepdims=True, initial=0.0), part.shape) for part in parts],
                             axis=-1)
    return np.where(own > NOTHING * largest, own, largest)
