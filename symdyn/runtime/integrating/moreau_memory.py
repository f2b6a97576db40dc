"""The records that time stepping in C works on, with their memory."""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from symdyn.backend.c_records import codes_of, fields_of
from symdyn.runtime.building.library import Frame

if TYPE_CHECKING:
    from symdyn.runtime.building.library import CLibrary

# Sweeps whose changes are combined.
DEPTH = codes_of("runtime/cones_type.h")["CONES_DEPTH"]
# Rows of a contact problem up to which a dense matrix is factorized.
MOST_DENSE = 360


class Cones(ctypes.Structure):
    """Contacts of one problem; see c/runtime/cones_type.h."""

    _fields_ = fields_of("runtime/cones_type.h")
    n: int
    residual: float
    n_sweeps: int
    n_newton: int


class Moreau(ctypes.Structure):
    """A mechanism in time stepping; see c/runtime/moreau_type.h."""

    _fields_ = fields_of("runtime/moreau_type.h")
    rough_sweeps: int
    worst_depth: float
    passed: int
    passed_a: int
    passed_b: int
    passed_at: float
    n_steps: int
    n_rounds: int
    n_evaluations: int
    reason: int


class Memory:
    """Arrays that records point to, kept as long as these."""

    def __init__(self) -> None:
        self.kept: list[Any] = []

    def put(self, record: Any, kind: Any, **sizes: int) -> None:
        """Fresh arrays of zeros as members of a record."""
        for name, size in sizes.items():
            self.take(record, name, np.zeros(max(1, size), dtype=kind))

    def take(self, record: Any, name: str, values: np.ndarray) -> np.ndarray:
        """An array as a member of a record."""
        self.kept.append(values)
        setattr(record, name, values.ctypes.data)
        return values

    def function(self, record: Any, name: str, library: CLibrary, function: str, result: str,
                 arguments: Sequence[np.ndarray], p: np.ndarray) -> np.ndarray:
        """A generated function as a member of a record, with its frame and its results, for given parameters."""
        constants, taken = np.zeros(max(1, library.metadata.n_c)), np.zeros(max(1, len(p)))
        taken[:len(p)] = p
        library.prologue(taken, constants)
        return self.frame(record, name, library, function, result, (*arguments, taken, constants))

    def frame(self, record: Any, name: str, library: CLibrary, function: str, result: str,
              arguments: Sequence[np.ndarray]) -> np.ndarray:
        """The same for arrays of t, x, inputs, parameters and constants that may change."""
        t, x, inputs, p, constants = arguments
        out, ud = np.zeros(int(np.prod(library.metadata.shapes[function]))), np.zeros(max(1, library.metadata.sizes.ud))
        frame = Frame(1, *[a.ctypes.data for a in (t, x, ud, inputs, p, constants, out)], 1, 1, 1, 1, 0)
        self.kept += [out, ud, p, constants, frame, library]
        setattr(record, name, ctypes.cast(library.function(f"{function}_rows"), dict(record._fields_)[name]))
        setattr(record, f"{name}_frame", ctypes.addressof(frame))
        setattr(record, result, out.ctypes.data)
        return out


def cones(memory: Memory, n_u: int, most: int, most_entries: int, dense: int) -> Cones:
    """A record for up to `most` contacts of three rows, with `most_entries` columns in all; dense: rows of a matrix that is
    factorized."""
    record = Cones(n_u=n_u, most=most, most_entries=most_entries, most_dense=dense)
    memory.put(record, np.dtype("long"), first=most + 1, entry=most + 1)
    rows = dict.fromkeys(("free", "P", "w", "kept", "step", "before", "change", "lead"), 3 * most)
    rows |= dict.fromkeys(("along", "answer"), 3 * (most_entries + 1)) | {"history": 2 * DEPTH * 3 * most}
    memory.put(record, float, friction=most, d_n=most, d_t=most, block=9 * most, du=n_u,
               dense=dense * dense, **rows)
    memory.put(record, np.intc, speed=most_entries + 1, state=most, bounded=most)
    return record
