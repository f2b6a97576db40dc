"""Algorithms of the runtime that stand in C and in Python: both over the same inputs, singular ones among them."""

from __future__ import annotations

import ctypes
import math
import re
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from symdyn import systems
from symdyn.backend.right_side import RightSide
from symdyn.backend.thresholds import EVENTS, PIVOTS, Macros
from symdyn.runtime.building.compiler import find_compiler, require_compiler
from symdyn.runtime.building.library import CLibrary
from symdyn.runtime.inputs.inputs import take_inputs
from symdyn.runtime.integrating.compiled import Run
from symdyn.runtime.integrating.events import zero_between
from symdyn.runtime.integrating.outcome import Request
from symdyn.runtime.integrating.run_record import STATUS
from symdyn.runtime.integrating.simulate import start_of
from symdyn.runtime.integrating.stabilization import (
    TOO_FAR,
    ProjectionFailed,
    Projector,
    Stabilization,
    reset_rejected,
    solve_open,
)
from symdyn.runtime.module import Module
from symdyn.thresholds import AT_ONCE
from tests.backend.c_warnings import RUNTIME
from tests.c_rows import needs_c, rows_in_c
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
# Every second sample of these begins where the gradient of a constraint vanishes.
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


def defined(macros: Macros) -> str:
    """Their definitions in C."""
    return "".join(f"#define {name} {value!r}\n" for name, value in macros)


# -- resets

KEEP_RESETS = """
SYMDYN_EXPORT void symdyn_keep_all(symdyn_run *run, long n, const double *old, double *x, const int *asked, int *status,
    int *entry, double *gap) {
    for (long k = 0; k < n; k++) {
        status[k] = symdyn_keep_resets(run, 0.0, old + k * SYMDYN_NX, x + k * SYMDYN_NX, asked + k * SYMDYN_HELD);
        entry[k] = (int)run->bad_index;
        gap[k] = run->events.reset_gap;
    }
}
"""
RESETS = 1700
OPEN_ROWS = """
#include "pivots.h"
static int solve(const double *in, double *out) {
    double G[M * M], gap[M], sizes[M];
    int open[M], order[M];
    for (int i = 0; i < M * M; i++) G[i] = in[i];
    for (int i = 0; i < M; i++) {
        sizes[i] = G[(M + 1) * i];
        gap[i] = in[M * M + i];
        open[i] = in[M * M + M + i] > 0.0 && sizes[i] > 0.0;
        out[i] = 0.0;
        out[M + i] = -1.0;
    }
    const int n = symdyn_solve_open(M, G, sizes, gap, open, order);
    for (int k = 0; k < n; k++) {
        out[order[k]] = gap[order[k]];
        out[M + k] = order[k];
    }
    return 0;
}
"""


@pytest.mark.native
@needs_c
@pytest.mark.parametrize("m", range(1, 6))
def test_rows_that_are_open_are_solved_alike(m: int, tmp_path: Path) -> None:
    """Rows of full rank, one that depends on others, almost so, none that moves, of sizes far apart; gaps that can be closed and
    others; rows that are not asked for: the same bits, and the same rows are taken in the same order."""
    stream, rows = np.random.default_rng(m), []
    for k in range(2000):
        L = stream.normal(size=(m, m + 1))
        if k % 5 in (1, 2):
            L[-1] = stream.choice([-1.0, 0.5, 2.0], m - 1) @ L[:-1] + (k % 5 == 2) * 10.0 ** stream.uniform(-9, -2) * L[-1]
        elif k % 5 == 3:
            L[stream.integers(m)] = 0.0
        elif k % 5 == 4:
            L *= 10.0 ** stream.uniform(-6, 6, (m, 1))
        G = L @ L.T
        gap = G @ stream.normal(size=m) if stream.uniform() < 0.6 else stream.normal(size=m)
        rows.append(np.concatenate([G.ravel(), gap, stream.uniform(size=m) < 0.8]))
    text = f"{defined(PIVOTS)}enum {{ M = {m} }};\n{OPEN_ROWS}"
    found, _ = rows_in_c(tmp_path, text, "solve(", m * m + 2 * m, 2 * m)(np.array(rows))
    left_out = 0
    for row, result in zip(rows, found, strict=True):
        G, gap = row[:m * m].reshape(m, m), row[m * m:m * m + m]
        places = np.flatnonzero((row[m * m + m:] > 0) & (np.diag(G) > 0))
        f, taken = solve_open(G[np.ix_(places, places)], gap[places])
        whole = np.zeros(m)
        whole[places] = f
        assert np.array_equal(result[:m], whole)
        assert result[m:m + len(taken)].tolist() == places[taken].tolist() and (result[m + len(taken):] == -1).all()
        left_out += len(taken) < len(places)
    assert left_out > 100 or m == 1


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize("name", ["four_bar", "bricard", "spatial_slider_crank"])
def test_states_after_resets_are_put_onto_constraints_alike(name: str, seed: int) -> None:
    """Resets of any entries to what constraints allow, almost allow, and do not: the same are rejected, for the same entry, and
    the others get the same state. Constraints of the bricard depend on each other everywhere."""
    stream, system = np.random.default_rng(seed), systems.get(name)
    symbols = [q for joint in system.joints for q in joint.coordinates]
    system.add_event("all", symbols[0] - 1, reset={e: e for q in symbols for e in (q, q.dot)})
    of, run, projector = opened(system.augmented(), KEEP_RESETS)
    n, middle = of.metadata.sizes.x, projector.n_q + projector.n_u
    held = sorted({k for event in of.metadata.events for k in event.reset})
    old, x, asked = np.zeros((RESETS, n)), np.zeros((RESETS, n)), np.zeros((RESETS, len(held)), dtype=np.intc)
    for k in range(RESETS):
        old[k] = run.request.x0
        old[k, :middle] += 0.2 * stream.normal(size=middle)
        with suppress(ProjectionFailed):
            old[k] = projector(0.0, old[k])
        target = old[k].copy()
        target[:middle] += 10.0 ** stream.uniform(-9, -0.5) * stream.normal(size=middle)
        if k % 3 < 2:
            with suppress(ProjectionFailed):
                target = projector(0.0, target)
        if k % 3 == 1:
            target[:middle] += 10.0 ** stream.uniform(-14, -7) * stream.normal(size=middle)
        asked[k] = stream.uniform(size=len(held)) < stream.choice([0.15, 0.4, 1.0])
        x[k] = np.where(np.isin(np.arange(n), np.array(held)[asked[k] > 0]), target, old[k])
    given, status, entry, gap = x.copy(), np.zeros(RESETS, dtype=np.intc), np.zeros(RESETS, dtype=np.intc), np.zeros(RESETS)
    keep = run.library.handle.symdyn_keep_all
    keep(run.address, ctypes.c_long(RESETS), *pointers(old, x, asked, status, entry, gap))
    counts = dict.fromkeys(set(status.tolist()), 0)
    for k in range(RESETS):
        counts[int(status[k])] += 1
        try:
            result = projector.keeping(0.0, given[k], [held[j] for j in np.flatnonzero(asked[k])])
        except ProjectionFailed as error:
            assert status[k] in (STATUS.PROJECTION_FAILED, STATUS.RESET_REJECTED)
            if status[k] == STATUS.RESET_REJECTED:
                assert str(error) == reset_rejected(of.metadata.x[entry[k]], float(gap[k]))
            continue
        assert status[k] == 0
        assert np.abs(result - x[k]).max() <= 1e-10 * (1 + np.abs(x[k]).max())
    assert counts[0] > RESETS // 4 and counts[STATUS.RESET_REJECTED] > RESETS // 10


# -- zeros of events

ZEROS = """
#include "prelude.h"
typedef double symdyn_time;
typedef struct {
    struct {
        double side[1];
    } events;
    const double *of;
} symdyn_run;
enum { SYMDYN_N_EVENTS = 1, SYMDYN_NX = 1 };
static const double symdyn_eps = 2.220446049250313e-16;
static int symdyn_state_at(symdyn_run *run, symdyn_time s, double *x) {
    (void)run;
    x[0] = s;
    return 0;
}
static int symdyn_event_values(symdyn_run *run, double t, const double *x, double *values) {
    const double *const c = run->of;
    values[0] = c[0] == 0.0 ? ((c[1] * t + c[2]) * t + c[3]) * t + c[4]
        : c[0] == 1.0       ? sin(c[1] * t + c[2]) - c[3]
        : c[0] == 2.0       ? exp(c[1] * t) - c[2] - c[3] * t
                            : (t - c[1]) * (t - c[1]) * (t - c[2]) * c[3];
    return x[0] != t;
}
FUNCTION
static int zero(const double *in, double *out) {
    symdyn_run run = {{{in[9]}}, in};
    return symdyn_event_root(&run, 0, in[5], in[6], in[7], in[8], in[10], out);
}
"""
CUT = re.compile(r"^static int symdyn_event_root\(.*?^}$", re.MULTILINE | re.DOTALL)


def quantity(c: np.ndarray, t: float) -> float:
    """Quantities of ZEROS: a cubic, a sine, an exponential, a cubic with a double zero."""
    kind, c1, c2, c3, c4 = c[:5].tolist()
    if kind == 0:
        return ((c1 * t + c2) * t + c3) * t + c4
    if kind == 1:
        return math.sin(c1 * t + c2) - c3
    if kind == 2:
        return math.exp(c1 * t) - c2 - c3 * t
    return (t - c1) * (t - c1) * (t - c2) * c3


def of_zeros(n: int) -> np.ndarray:
    """Quantities with their intervals, forwards and backwards, values at the ends times the side, the side, and what counts as
    one time, (n, 11): simple zeros, double ones, at the ends and next to them, and where the interval begins at one."""
    stream, rows = np.random.default_rng(3), []
    while len(rows) < n:
        kind, h = float(stream.integers(4)), 10.0 ** stream.uniform(-6, 0.5) * float(stream.choice([-1.0, 1.0]))
        a = float(stream.choice([0.0, 1.0, 100.0])) * float(stream.normal())
        b = a + h
        part = float(stream.choice([0.0, 1.0, stream.uniform(), 10.0 ** stream.uniform(-16, -1)]))
        zero = a + part * h
        c1, c2, c3 = stream.normal(size=3).tolist()
        if kind == 3:
            c = [c1 if stream.uniform() < 0.3 else zero, zero if stream.uniform() < 0.5 else a + stream.uniform() * h, c3, 0.0]
        elif kind == 2:
            c = [c1, math.exp(c1 * zero) - c3 * zero, c3, 0.0]
        elif kind == 1:
            c1 *= 3 / abs(h)
            c = [c1, c2, math.sin(c1 * zero + c2), 0.0]
        else:
            c = [c1, c2, c3, -((c1 * zero + c2) * zero + c3) * zero]
        row = np.array([kind, *c, a, b, 0.0, 0.0, 0.0, AT_ONCE * 10.0 ** stream.uniform(-1, 2)])
        at_a, at_b = quantity(row, a), quantity(row, b)
        side = float(np.sign(at_a) or -np.sign(at_b))
        row[7:10] = side * at_a, side * at_b, side
        if side and row[8] <= 0:
            rows.append(row)
    return np.array(rows)


@pytest.mark.native
@needs_c
def test_zeros_of_events_are_the_same(tmp_path: Path) -> None:
    """The same bits over ten thousand quantities; before a zero a quantity has its side, at it no more."""
    rows, text = of_zeros(10_000), (RUNTIME / "events.h").read_text(encoding="utf-8")
    (function,) = CUT.findall(text)
    found, failed = rows_in_c(tmp_path, defined(EVENTS) + ZEROS.replace("FUNCTION", function), "zero(", 11, 1)(rows)
    assert not failed.any() and (rows[:, 7] == 0).sum() > 500 and (rows[:, 8] == 0).sum() > 500
    for row, (root,) in zip(rows, found.tolist(), strict=True):
        a, b, at_a, at_b, side, least = row[5:].tolist()
        assert zero_between(lambda t, c=row, s=side: quantity(c, t) * s, a, b, at_a, at_b, least) == root
        assert min(a, b) <= root <= max(a, b) and (root == a or side * quantity(row, root) <= 0)
