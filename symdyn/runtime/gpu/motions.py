"""Integrates many motions on a device: a thread each, in chunks that fit into its memory, copied while others are computed."""

from __future__ import annotations

import ctypes
import functools
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from symdyn.backend.c_records import fields_of
from symdyn.runtime.batches.states import Table
from symdyn.runtime.gpu.device import Device, NoDevice
from symdyn.runtime.gpu.dlpack import DeviceArray
from symdyn.runtime.gpu.turns import in_turns, parts_of
from symdyn.runtime.inputs.tables import Pieces
from symdyn.runtime.memory import in_bytes

# Share of the free memory that two chunks take at a time.
SHARE, SLOTS = 0.8, 2
# A chunk has so many motions for every thread that the device holds, unless all of them are fewer, so that threads that are
# through find a further motion.
ROUNDS = 4
# Attempted steps of a motion, at most: a kernel cannot be interrupted. Motions that take more go on on the processor.
MOST_STEPS = 1_000_000
ALIGNED = 256
# Threads that attempt their steps together. Where there are more, and all motions have been taken, those under way are put down
# after so many attempts and gathered in as few warps; every time they take a quarter more attempts, and the last time any number.
# Stored values take no more than this share of the free memory.
WARP = 32
TURN, TURNS, SHARE_PUT = 32, 64, 0.1


class Motions(ctypes.Structure):
    """Arguments of a kernel that computes motions, and addresses of its results; see c/runtime/motions_type.h."""

    _fields_ = fields_of("runtime/motions_type.h")


@dataclass
class Work:
    """Motions to integrate, and where their results go.

    starts, inputs, params, lengths   rows of motions, one row for all where nothing varies
    span       t0, t_end, rtol, first step, largest step
    project    whether states are kept on what holds for them
    pieces, stops   inputs over time, and instants that steps end at
    look, event_spacing, taken_after   events to look for, (n_e,) of integers, empty: none; samples of them; steps between takes
    x, states, reports, doubts   results of n motions
    there      where numbers of motions lie on the device already, by their index among all that are given: address and stride
    Numbers of the device are of the type of x, but for times. Where x is an array there, it stays there.
    """

    starts: np.ndarray
    inputs: np.ndarray
    params: np.ndarray
    lengths: np.ndarray
    span: np.ndarray
    atol: np.ndarray
    times: np.ndarray
    project: bool
    pieces: Pieces | None
    stops: np.ndarray
    look: np.ndarray
    event_spacing: float
    taken_after: int
    x: np.ndarray | DeviceArray
    states: np.ndarray
    reports: np.ndarray
    doubts: np.ndarray
    there: Mapping[int, tuple[int, int]] = field(default_factory=dict)

    @property
    def dtype(self) -> np.dtype:
        """The type of numbers on the device."""
        return self.x.dtype

    @functools.cached_property
    def given(self) -> tuple[tuple[list[int], np.ndarray], ...]:
        """Values copied to the device: indices of numbers in the order of the kernel, and rows of them, or one for all."""
        result: list[tuple[list[int], np.ndarray]] = []
        first = 0
        for rows in (self.starts, self.inputs, self.params, self.lengths):
            here = [k for k in range(rows.shape[1]) if first + k not in self.there]
            kept = rows if len(here) == rows.shape[1] else rows[:, here]
            if kept is not rows and not (kept != kept[:1]).any():
                kept = kept[:1]
            result.append(([first + k for k in here], kept))
            first += rows.shape[1]
        return tuple(result)

    @property
    def results(self) -> tuple[np.ndarray, ...]:
        """Arrays copied back."""
        return *((self.x,) if isinstance(self.x, np.ndarray) else ()), self.states, self.reports, self.doubts

    def bytes_each(self) -> int:
        """Device memory of one motion, bytes."""
        varying = sum(a.shape[1] * self.dtype.itemsize for _, a in self.given if len(a) > 1)
        return varying + sum(a[:1].nbytes for a in self.results)


@dataclass
class _Slot:
    """Memory of the device for one chunk, with its stream.

    counters   two of every turn: how many motions threads have taken, and put down
    put        where they are put down, turn by turn; empty: threads keep their motions
    turn       the one that was begun last
    """

    stream: Any
    given: list[int]
    results: list[int]
    tables: int
    counters: int
    put: list[int]
    turn: int = 0
    argument: Motions | None = None
    rows: range | None = None
    kept: list[np.ndarray] = field(default_factory=list)


@dataclass(frozen=True)
class MotionKernels:
    """The functions `motions` and `motion_size` of a mechanism on a device."""

    motions: Any
    motion_size: Any


def integrate(device: Device, kernels: MotionKernels, work: Work, owner: str) -> str:
    """Fill the results of some motions; returns what it took of the device, in words.

    Raises NoDevice where not even a few motions fit into the memory. After a KeyboardInterrupt what is under way is waited
    for; chunks that were not begun keep their results as they were.
    """
    n, kernel = len(work.reports), kernels.motions
    if not n:
        return f"on {device.name}, without a motion"
    threads = device.at_once(kernel)
    times = [np.ascontiguousarray(a, dtype=float) for a in (work.span, work.times)]
    pieces = (np.zeros(0), np.zeros(0)) if work.pieces is None else (work.pieces.breaks, work.pieces.coefficients)
    fixed = [*times, *(np.ascontiguousarray(a, dtype=work.dtype) for a in (work.atol, work.stops, *pieces))]
    fixed.append(np.ascontiguousarray(work.look, dtype=np.intc))
    # One row for all is copied once a slot.
    around = sum(a.nbytes + ALIGNED for a in (*fixed, *(a[:1] for _, a in work.given))) * SLOTS + SLOTS * 16 * ALIGNED
    free, stacks = device.free(), device.stacks(kernel)
    lanes = min(n, threads)
    put = lanes * _motion_size(device, kernels.motion_size) if lanes > WARP else 0
    if 2 * SLOTS * put > SHARE_PUT * free:
        put = 0
    around += stacks + 2 * SLOTS * put
    most = (int(SHARE * free) - around) // SLOTS // work.bytes_each()
    if most < 1:
        raise NoDevice(f"{owner}: {device.name} has {in_bytes(free)} of free memory, of which two motions with "
                            f"{len(work.times)} output times take {in_bytes(SLOTS * work.bytes_each() + around)}"
                            f"{f', {in_bytes(stacks)} of these for stacks of threads' * bool(stacks)}; ask for fewer output times"
                            f"{', or free some' * bool(stacks)}")
    size = max(1, min(n, most, max(ROUNDS * threads, -(-n // (4 * SLOTS)))))
    numbers = len(work.there) + sum(len(indices) for indices, _ in work.given)
    taken: list[int] = []

    def allocated(nbytes: int) -> int:
        taken.append(device.allocate(max(nbytes, ALIGNED)))
        return taken[-1]

    try:
        places = [allocated(a.nbytes) for a in fixed]
        slots = [_Slot(device.stream(), [allocated(min(len(a), size) * a.shape[1] * work.dtype.itemsize) for _, a in work.given],
                       [allocated(size * a[:1].nbytes) for a in work.results],
                       allocated(numbers * ctypes.sizeof(Table)), allocated(TURNS * 2 * ctypes.sizeof(ctypes.c_int)),
                       [allocated(put), allocated(put)] if put else [])
                 for _ in range(min(SLOTS, -(-n // size)))]
        for index, values in zip(places, fixed, strict=True):
            device.upload(slots[0].stream, index, values)
        device.wait(slots[0].stream)  # the other stream would not
        in_turns(parts_of(n, size), slots, lambda slot, rows: _begin(device, kernel, work, slot, places, rows, threads),
                 lambda slot: _collect(device, kernel, work, slot))
    finally:
        for address in taken:
            device.release(address)
    return (f"on {device.name}, {min(threads, size)} at once, {in_bytes(SLOTS * size * work.bytes_each() + around)} of its memory"
            + (f", {in_bytes(stacks)} of these for stacks of threads" if stacks else ""))


def _begin(device: Device, kernel: Any, work: Work, slot: _Slot, places: list[int], rows: range, threads: int) -> None:
    part, n = slice(rows.start, rows.stop), len(rows)
    item, slot.kept = work.dtype.itemsize, []
    tables = (Table * (len(work.there) + sum(len(numbers) for numbers, _ in work.given)))()
    for (numbers, values), address in zip(work.given, slot.given, strict=True):
        varies = len(values) > 1
        mine = np.ascontiguousarray(values[part] if varies else values, dtype=work.dtype)
        for k, number in enumerate(numbers):
            tables[number] = Table(address + k * item, len(numbers) if varies else 0, 1)
        device.upload(slot.stream, address, mine)
        slot.kept.append(mine)
    for number, (address, row) in work.there.items():
        tables[number] = Table(address + rows.start * row * item, row, 1)
    headers = np.frombuffer(bytes(tables), dtype=np.uint8)
    for values, address in ((headers, slot.tables), (np.zeros((TURNS, 2), dtype=np.intc), slot.counters)):
        device.upload(slot.stream, address, values)
        slot.kept.append(values)
    span, times, atol, stops, breaks, coefficients, look = places
    *own, states, reports, doubts = slot.results
    x = own[0] if isinstance(work.x, np.ndarray) else work.x.address + rows.start * int(np.prod(work.x.shape[1:])) * item
    slot.turn, slot.argument = 0, Motions(
        n=n, n_out=len(work.times), max_steps=MOST_STEPS, given=slot.tables, span=span, atol=atol, t_out=times,
        n_pieces=0 if work.pieces is None else len(work.pieces.coefficients), breaks=breaks, pieces=coefficients,
        n_stops=len(work.stops), stops=stops, project=int(work.project), look=look if len(work.look) else None,
        event_spacing=work.event_spacing, events_taken_after=work.taken_after, x_out=x, states=states, reports=reports,
        doubts=doubts)
    _launch(device, kernel, slot, 0, min(threads, n))
    slot.rows = rows


def _launch(device: Device, kernel: Any, slot: _Slot, turn: int, threads: int) -> None:
    """Begin a turn of a chunk; an interrupt before it is known to have begun may lead to a second call, which changes nothing."""
    assert slot.argument is not None
    argument = Motions.from_buffer_copy(slot.argument)
    number = ctypes.sizeof(ctypes.c_int)
    argument.next = slot.counters + 2 * turn * number
    argument.n_put = argument.next + number
    if turn:
        argument.n, argument.resumed = threads, slot.put[(turn - 1) % 2]
    if slot.put and turn < TURNS - 1:
        argument.turn, argument.put = int(TURN * 1.25**turn), slot.put[turn % 2]
    device.launch(slot.stream, kernel, threads, argument)
    slot.turn = turn


def _motion_size(device: Device, kernel: Any) -> int:
    """Bytes of a motion that a thread puts down."""
    size, stream, address = np.zeros(1, dtype=np.intc), device.stream(), device.allocate(ALIGNED)
    try:
        device.launch(stream, kernel, 1, Motions(n_put=address))
        device.download(stream, size, address)
        device.wait(stream)
    finally:
        device.release(address)
    return int(size[0])


def _regroup(device: Device, kernel: Any, slot: _Slot) -> None:
    """Go on with the motions of a chunk that were put down, until there are none."""
    counts = np.zeros((TURNS, 2), dtype=np.intc)
    while True:
        device.download(slot.stream, counts, slot.counters)
        device.wait(slot.stream)
        left = int(counts[slot.turn, 1])
        if not left:
            return
        _launch(device, kernel, slot, slot.turn + 1, left)


def _collect(device: Device, kernel: Any, work: Work, slot: _Slot) -> None:
    """Copy the results of a chunk back, when they are there."""
    if slot.rows is None:
        return
    stopped = None
    if slot.put:
        try:
            _regroup(device, kernel, slot)
        except KeyboardInterrupt as interrupt:
            stopped = interrupt
            _regroup(device, kernel, slot)
    part, slot.rows = slice(slot.rows.start, slot.rows.stop), None
    for values, address in zip(work.results, slot.results, strict=True):
        device.download(slot.stream, values[part], address)
    device.wait(slot.stream)
    if stopped is not None:
        raise stopped
