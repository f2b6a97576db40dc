"""The start of a mechanism's motion, looked at before any check: whether there is one, and how far it is from what was given.

A fault of compilation or evaluation there would be every check's failure, and is the description's.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from symdyn.errors import ArgumentError, CompileError, CompilerNotFound, SymdynError
from symdyn.runtime.consistent import check_start, normalised
from symdyn.stress.record import FAIL, PASS, Row
from symdyn.stress.system_under_test import SystemUnderTest

START = "start"


def start(tested: SystemUnderTest) -> Iterator[Row]:
    """A row that fails where nothing can be run, with all that was said; one that says where the start was moved."""
    try:
        x = tested.start
        tested.module.evaluate("rhs", 0.0, x, tested.params, tested.inputs)
    except Exception as error:  # functions of the user raise what they like
        compiled = not isinstance(error, (CompileError, CompilerNotFound))
        kind = "" if isinstance(error, SymdynError) else f"{type(error).__name__}: "
        yield Row(START, tested.name, "accelerations cannot be evaluated at the start" if compiled else "its code cannot be "
                  "compiled", None, None, "", FAIL, f"nothing else was run: {kind}{error}")
        return
    try:
        check_start(tested.module, 0.0, normalised(tested.module, tested.given), tested.params)
    except ArgumentError:
        yield _moved(tested, x - tested.given)


def _moved(tested: SystemUnderTest, moved: np.ndarray) -> Row:
    names, units = tested.module.metadata.x, tested.module.metadata.units
    most = np.argsort(-np.abs(moved))[:5]
    parts = [f"{names[k]} by {moved[k]:.3g} {units.get(names[k], '')}".rstrip() for k in most if moved[k]]
    return Row(START, tested.name, f"system.initial violates constraints; the start was moved onto them: {', '.join(parts)}"
               f"{', ...' if np.count_nonzero(moved) > len(parts) else ''}", float(np.abs(moved).max()), None, "", PASS,
               "every motion here begins at the nearest state on the constraints, as with module.consistent or "
               "`symdyn simulate --consistent`")
