"""Takes over the numbers at which a tree is wanted, by symbol, by name or in order."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from symdyn.errors import ArgumentError, no_value
from symdyn.shown import name_of, shown


def taken(given: Any, names: Sequence[str], what: str, known: Mapping[str, Any], owner: str) -> dict[str, Any]:
    """Numbers by name; of any kind, so that digits beyond those of floats are kept.

    given   None, a mapping from symbols or names, or a sequence in the order of names
    known   what a name that is left out takes
    Raises ArgumentError naming what is missing, unknown, no number or not finite, and for a wrong length.
    """
    if given is None or isinstance(given, Mapping):
        values = {name_of(key): value for key, value in (given or {}).items()}
        faults = [f"there is no {shown(n)}; there are {', '.join(names) or 'none'}" for n in values if n not in names]
        missing = [n for n in names if n not in values and n not in known]
        if missing:
            faults.append(no_value(missing))
        values = {n: values.get(n, known.get(n)) for n in names if n in values or n in known}
    else:
        listed = list(np.atleast_1d(np.asarray(given, dtype=object)))
        if len(listed) != len(names):
            raise ArgumentError(f"{owner}: {what} has {len(listed)} values, needed are {len(names)}: {', '.join(names)}")
        faults, values = [], dict(zip(names, listed, strict=True))
    bad = [f"{n} = {shown(v)}" for n, v in values.items() if not _finite(v)]
    if bad:
        faults.append(f"values must be finite numbers, found {', '.join(bad)}")
    if faults:
        raise ArgumentError(f"{owner}: {what}: {'; '.join(faults)}")
    return values


def _finite(value: Any) -> bool:
    try:
        return math.isfinite(float(value))
    except (TypeError, ValueError, OverflowError):
        return False
