"""References that were made before: those of the package, made by a command, and those of this user, in the cache folder.

`symdyn bench references NAME ...` makes references for the package again.
"""

from __future__ import annotations

import hashlib
import json
import re
import time as clock
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from symdyn.bench import kept
from symdyn.bench.work.record import Reference
from symdyn.bench.work.system_under_test import Formulation
from symdyn.errors import ArgumentError, EvaluationError, SymdynError
from symdyn.runtime.building.cache import cache_dir

STORE = Path(__file__).with_name("references.json")
# Rates of the stored states may differ by this from the module's, relative to the largest, before they are another motion's.
SAME = 1e-8


def find(name: str, formulation: Formulation, times: Sequence[float], until: float = np.inf) -> Reference | None:
    """A reference that holds all of these times for this very motion; None if there is none.

    name   of the mechanism in the package's store
    """
    packaged = stored().get(name)
    for data in (packaged, kept.read(_cached(formulation, times))):
        if data is not None:
            reference = _fitting(data, formulation, times)
            if reference is not None:
                return reference
    return None


def keep(formulation: Formulation, reference: Reference, text: Sequence[Sequence[str]]) -> None:
    """Put a reference into the cache folder."""
    kept.write(_cached(formulation, reference.times), record(formulation, reference, text))


def record(formulation: Formulation, reference: Reference, text: Sequence[Sequence[str]]) -> dict[str, Any]:
    """Record to store: the numbers it depends on, times, states, digits, how they were shown."""
    return {"how": reference.how, "digits": round(reference.digits, 1), "names": list(formulation.coordinates),
            "given": _given(formulation), "times": list(reference.times), "x": [list(row) for row in text],
            "rates": [[float(f"{v:.12g}") for v in row] for row in _rates(formulation, reference)]}


def stored() -> dict[str, dict[str, Any]]:
    """The package's references, by name."""
    return kept.read(STORE) or {}


def _given(formulation: Formulation) -> dict[str, float]:
    module = formulation.module
    metadata = module.metadata
    return {**dict(zip(metadata.parameters, module.default_parameters.tolist(), strict=True)),
            **dict(zip(metadata.x, formulation.x0.tolist(), strict=True)),
            **{n: float(metadata.initial.get(n, 0.0)) for n in metadata.inputs}}


def _rates(formulation: Formulation, reference: Reference) -> np.ndarray:
    module = formulation.module
    given = [float(module.metadata.initial.get(n, 0.0)) for n in module.metadata.inputs]
    return np.array([module.rhs(t, np.array(x, dtype=float), None, given)
                     for t, x in zip(reference.times, reference.x, strict=True)])


def _fitting(data: dict[str, Any], formulation: Formulation, times: Sequence[float]) -> Reference | None:
    """The stored motion at these times, if it is the motion of the formulation: same numbers, same rates at its states."""
    if data["names"] != list(formulation.coordinates) or data["given"] != _given(formulation):
        return None
    places = [_index(data["times"], t) for t in times]
    if None in places:
        return None
    reference = Reference("extended", tuple(data["times"]), [[float(v) for v in row] for row in data["x"]], data["digits"],
                          data["how"], tuple(data["names"]))
    try:
        rates, known = _rates(formulation, reference), np.array(data["rates"])
    except EvaluationError:
        return None
    if not np.abs(rates - known).max() <= SAME * np.abs(known).max():
        return None
    x = [reference.x[k] for k in places if k is not None]
    return Reference("extended", tuple(float(t) for t in times), x, data["digits"], data["how"], tuple(data["names"]))


def _index(times: Sequence[float], t: float) -> int | None:
    return next((k for k, s in enumerate(times) if abs(s - t) <= 1e-12 * max(1.0, abs(t))), None)


def _cached(formulation: Formulation, times: Sequence[float]) -> Path:
    key = json.dumps([formulation.equations.name, list(formulation.coordinates), _given(formulation), [float(t) for t in times]])
    stem = re.sub(r"[^A-Za-z0-9_-]", "_", formulation.equations.name)
    return cache_dir() / "references" / f"{stem}-{hashlib.sha256(key.encode()).hexdigest()[:16]}.json"


def run(names: Sequence[str] = (), digits: int | None = None, file: Path | None = None) -> int:
    """Make references again and store them; returns how many could not be made.

    names   of the list of `symdyn bench --all` (default: all); digits: of the local errors (default: as many as usual)
    file    to store them in next to what it holds (default: the package's)
    """
    from symdyn.bench.work.cases import CASES, named_case
    from symdyn.bench.work.converged import DIGITS, converged
    from symdyn.bench.work.reference import default_times

    if digits is not None and digits < 1:
        raise ArgumentError(f"{digits} digits were asked for; pass 1 or more")
    failed, systems, file = 0, [named_case(name) for name in names or CASES], kept.writable(file, STORE)
    for about in systems:
        begun = clock.perf_counter()
        first = about.first()
        try:
            reference, text = converged(first, default_times(about), DIGITS if digits is None else digits)
        except SymdynError as error:
            failed += 1
            print(f"{about.name}: {error}", flush=True)
            continue
        made = record(first, reference, text)
        kept.put(file, about.name, made)
        print(f"{about.name}: {reference}; {clock.perf_counter() - begun:.0f} s", flush=True)
    return failed
