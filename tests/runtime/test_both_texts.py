"""Algorithms of the runtime that stand in C and in Python: both over the same inputs, singular ones among them."""

from __future__ import annotations

import ctypes
from typing import Any

import numpy as np
import pytest

from symdyn.backend.right_side import RightSide
from symdyn.runtime.building.compiler import find_compiler, require_compiler
from symdyn.runtime.building.library import CLibrary
from symdyn.runtime.inputs.inputs import take_inputs
from symdyn.runtime.integrating.compiled import Run
from symdyn.runtime.integrating.outcome import Request
from symdyn.runtime.integrating.run_record import STATUS
from symdyn.runtime.integrating.simulate import start_of
from symdyn.runtime.integrating.stabilization import TOO_FAR, ProjectionFailed, Projector, Stabilization
from symdyn.runtime.module import Module
from tests.runtime.constrained import equations

RTOL = 1e-8

pytestmark = pytest.mark.skipif(find_compiler() is None, reason="no C compiler here")


def opened(equations: Any, further: str) -> tuple[Module, Run, Projector]:
    """A module whose library has more functions, so that both texts evaluate the same, a run of it that has just begun, and its
    projector."""
    of: Module = equations.compile(backend="c")
    source, metadata = of._provider.rhs, of.metadata
    text = f"{next(iter(source.files.values()))}\n{further}"
    library = of._libraries[RightSide()] = CLibrary(text, source.metadata, require_compiler())
    x0, projector = start_of(of, None, None, None), Projector(of, of.default_parameters)
    request = Request((0.0, 1.0), None, x0, of.default_parameters, take_inputs(None, metadata.inputs, metadata.initial, of.name),
                      RTOL, np.full(len(x0), RTOL), 0.0, 0.0, None, len(x0), Stabilization("projection", length=projector.length))
    return of, Run(library, request), projector


def pointers(*arrays: np.ndarray) -> list[ctypes.c_void_p]:
    return [ctypes.c_void_p(a.ctypes.data) for a in arrays]


# -- projections

MOVE_ENDS = """
SYMDYN_EXPORT void symdyn_move_ends(symdyn_run *run, long n, const double *t, const double *from, double *x, int *status,
    int *moved) {
    for (long k = 0; k < n; k++) {
        for (int i = 0; i < SYMDYN_NX; i++) run->x[i] = from[k * SYMDYN_NX + i];
        status[k] = symdyn_move_end(run, t[k], x + k * SYMDYN_NX, moved + k);
    }
}
"""
ENDS = 1700
# Of these every second sample begins where the gradient of a constraint vanishes.
FOLDED = {"slider_crank": [np.pi / 2, -np.pi]}


@pytest.mark.parametrize("name", ["four_bar", "slider_crank", "andrews_squeezer", "double_wishbone", "bricard", "top"])
def test_ends_of_steps_are_put_onto_constraints_alike(name: str) -> None:
    """Ends of steps at any distance from the constraints, also where the gradient of one vanishes, where constraints depend on
    each other everywhere, and of unit vectors: the same are rejected, and the others get the same state."""
    stream = np.random.default_rng(7)
    _, run, projector = opened(equations(name), MOVE_ENDS)
    n_x, middle = run.n_x, projector.n_q + projector.n_u

    def in_c(t: np.ndarray, start: np.ndarray, ends: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        x, status, moved = ends.copy(), np.zeros(len(ends), dtype=np.intc), np.zeros(len(ends), dtype=np.intc)
        run.library.handle.symdyn_move_ends(run.address, ctypes.c_long(len(ends)), *pointers(t, start, x, status, moved))
        return x, status, moved

    near = run.request.x0 + np.where(np.arange(n_x) < middle, 0.5, 0.0) * stream.normal(size=(ENDS, n_x))
    positions, found, _ = in_c(np.zeros(ENDS), near + 1e3, near)
    on = positions[found == 0]
    assert len(on) > ENDS // 4
    t, ends = stream.uniform(0, 1, ENDS), on[stream.integers(len(on), size=ENDS)]
    if name in FOLDED:
        ends[::2, :projector.n_q] = FOLDED[name]
    ends[:, :middle] += 10.0 ** stream.uniform(-16, 0.5, (ENDS, 1)) * stream.normal(size=(ENDS, middle))
    start = ends + 10.0 ** stream.uniform(-9, 1, (ENDS, 1)) * stream.normal(size=(ENDS, n_x))
    start[::10] = ends[::10]
    x, status, moved = in_c(t, start, ends)
    assert set(status.tolist()) <= {0, STATUS.PROJECTION_FAILED}
    counts = dict.fromkeys(("moved", "kept", "far", "failed"), 0)
    for k in range(ENDS):
        projector.n_steps = 0
        try:
            result, changed = projector.step(float(t[k]), ends[k], start[k], np.full(n_x, RTOL), RTOL)
        except ProjectionFailed as error:
            assert status[k] == STATUS.PROJECTION_FAILED
            counts["far" if str(error).endswith(TOO_FAR) else "failed"] += 1
            continue
        assert status[k] == 0 and changed == bool(moved[k]) and projector.n_steps == changed
        assert np.abs(result - x[k]).max() <= 1e-13 * (1 + np.abs(x[k]).max())
        counts["moved" if changed else "kept"] += 1
    assert counts["moved"] > ENDS // 10 and counts["kept"] > ENDS // 10 and counts["far"] > ENDS // 20
    assert counts["failed"] > 0 or not projector.n_c
