"""Right-hand sides of many states on a device: of arrays of this process, in parts, or of arrays that are on the device."""

from __future__ import annotations

import ctypes
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from symdyn.backend.c_records import fields_of
from symdyn.errors import ArgumentError
from symdyn.runtime.batches.states import Table
from symdyn.runtime.gpu.arrays import array_of
from symdyn.runtime.gpu.device import Device
from symdyn.runtime.gpu.dlpack import DeviceArray, View
from symdyn.runtime.gpu.motions import ALIGNED, SHARE, SLOTS
from symdyn.runtime.gpu.turns import in_turns, parts_of
from symdyn.runtime.memory import in_bytes

GROUPS = ("t", "x", "inputs", "params")
# So many states in a part, unless the memory holds fewer: enough for every thread, and small enough for two to take turns.
PART = 2**20


class StateRows(ctypes.Structure):
    """Arguments of a kernel that computes right-hand sides, and addresses of its results; see c/runtime/states_type.h."""

    _fields_ = fields_of("runtime/states_type.h")


@dataclass(frozen=True)
class Kernels:
    """The kernels of a mechanism on a device, with the type of their numbers; of how many numbers x and the constants are."""

    constants: Any
    states: Any
    dtype: np.dtype
    n_x: int
    n_c: int


@dataclass
class _Slot:
    """Memory of the device for one part, with its stream."""

    stream: Any
    given: dict[str, int]
    out: int
    codes: int
    tables: int
    rows: range | None = None
    kept: list[np.ndarray] = field(default_factory=list)
    results: tuple[np.ndarray, np.ndarray] | None = None


class _Memory:
    """Blocks of a device that are given back together."""

    def __init__(self, device: Device) -> None:
        self.device = device
        self.taken: list[int] = []

    def take(self, size: int) -> int:
        self.taken.append(self.device.allocate(max(size, ALIGNED)))
        return self.taken[-1]

    def release(self) -> None:
        while self.taken:
            self.device.release(self.taken.pop())


def _stacks(device: Device, kernels: Kernels) -> int:
    """Bytes of the stacks of threads, of the kernel that has the larger ones."""
    return max(device.stacks(kernel) for kernel in (kernels.constants, kernels.states))


def rates(device: Device, kernels: Kernels, n: int, arrays: Mapping[str, np.ndarray], xd: np.ndarray, owner: str) -> np.ndarray:
    """Fill xd (n, n_x) from arrays by group, (n, ...) or (1, ...) where nothing varies; returns codes (n,).

    Raises ArgumentError where not even two states fit into the memory of the device.
    """
    item, codes = kernels.dtype.itemsize, np.zeros(n, dtype=np.intc)
    varying = [g for g in GROUPS if len(arrays[g]) > 1]
    each = sum(arrays[g].shape[1] for g in varying) * item + kernels.n_x * item + codes.itemsize
    around = (sum(arrays[g].shape[1] for g in GROUPS) + kernels.n_c) * item * SLOTS + 16 * SLOTS * ALIGNED
    around += _stacks(device, kernels)
    free = device.free()
    most = (int(SHARE * free) - around) // SLOTS // each
    if most < 1:
        raise ArgumentError(f"{owner}: {device.name} has {in_bytes(free)} of free memory, of which two states take "
                            f"{in_bytes(SLOTS * each + around)}; free some")
    size, memory = min(n, most, PART), _Memory(device)

    def room(group: str) -> int:
        return memory.take((size if group in varying else 1) * arrays[group].shape[1] * item)

    try:
        slots = [_Slot(device.stream(), {g: room(g) for g in GROUPS}, memory.take(size * kernels.n_x * item),
                       memory.take(size * codes.itemsize), memory.take(len(GROUPS) * ctypes.sizeof(Table)))
                 for _ in range(min(SLOTS, -(-n // size)))]
        constants, code = 0, 0
        if "params" not in varying:
            constants, code = _constants(device, kernels, memory, slots[0], arrays["params"])

        def begin(slot: _Slot, rows: range) -> None:
            m = len(rows)
            tables, slot.kept = (Table * len(GROUPS))(), []
            for k, group in enumerate(GROUPS):
                part = arrays[group][rows.start:rows.stop] if group in varying else arrays[group]
                tables[k] = _bring(device, slot, group, part, kernels.dtype)
            _bring_tables(device, slot, tables)
            device.launch(slot.stream, kernels.states, m, StateRows(
                n=m, given=slot.tables, constants=constants or None, failed=code, out=slot.out, out_row=1, out_entry=m,
                codes=slot.codes))
            slot.rows = rows

        def collect(slot: _Slot) -> None:
            if slot.rows is None:
                return
            part, slot.rows = slice(slot.rows.start, slot.rows.stop), None
            result = np.empty((kernels.n_x, part.stop - part.start), dtype=kernels.dtype)
            device.download(slot.stream, result, slot.out)
            device.download(slot.stream, codes[part], slot.codes)
            device.wait(slot.stream)
            xd[part] = result.T

        in_turns(parts_of(n, size), slots, begin, collect)
    finally:
        memory.release()
    return codes


def rates_there(device: Device, kernels: Kernels, n: int, arrays: Mapping[str, np.ndarray | View], out: View | None,
                owner: str) -> tuple[DeviceArray | None, np.ndarray]:
    """The same of arrays of which some are on the device; out: where the result goes there; None: a new array, which is returned.

    Raises ArgumentError where the memory of the device does not hold the result.
    """
    item, memory = kernels.dtype.itemsize, _Memory(device)
    codes, size = np.zeros(n, dtype=np.intc), n * kernels.n_x * item
    here = {g: a for g, a in arrays.items() if isinstance(a, np.ndarray)}
    needed = (0 if out is not None else size) + codes.nbytes + sum(a.size * item for a in here.values()) + 16 * ALIGNED
    needed += _stacks(device, kernels)
    free = device.free()
    if needed > free:
        raise ArgumentError(f"{owner}: {device.name} has {in_bytes(free)} of free memory, and {n} states take "
                            f"{in_bytes(needed)} there; pass fewer rows at a time, or out=, an array there")
    result = device.allocate(max(size, ALIGNED)) if out is None else None
    try:
        slot = _Slot(device.stream(), {g: memory.take(a.size * item) for g, a in here.items()}, 0,
                     memory.take(max(codes.nbytes, codes.itemsize)), memory.take(len(GROUPS) * ctypes.sizeof(Table)))
        constants, code = 0, 0
        if "params" in here and len(here["params"]) == 1:
            constants, code = _constants(device, kernels, memory, slot, here["params"])
        tables = (Table * len(GROUPS))()
        for k, group in enumerate(GROUPS):
            values = arrays[group]
            if isinstance(values, View):
                tables[k] = Table(values.address, values.strides[0] if values.shape[0] > 1 else 0, values.strides[1])
            else:
                tables[k] = _bring(device, slot, group, values, kernels.dtype)
        _bring_tables(device, slot, tables)
        to, row, entry = (result, 1, n) if out is None else (out.address, *out.strides)
        device.launch(slot.stream, kernels.states, n, StateRows(
            n=n, given=slot.tables, constants=constants or None, failed=code, out=to, out_row=row, out_entry=entry,
            codes=slot.codes))
        device.download(slot.stream, codes, slot.codes)
        device.wait(slot.stream)
    except BaseException:
        if result is not None:
            device.release(result)
        raise
    finally:
        memory.release()
    return None if result is None else array_of(device, result, (n, kernels.n_x), kernels.dtype, True), codes


def _bring(device: Device, slot: _Slot, group: str, values: np.ndarray, dtype: np.dtype) -> Table:
    """Copy rows to the device, entry by entry: neighbouring threads read neighbouring numbers."""
    mine = np.ascontiguousarray(values.T, dtype=dtype)
    device.upload(slot.stream, slot.given[group], mine)
    slot.kept.append(mine)
    return Table(slot.given[group], int(len(values) > 1), len(values))


def _bring_tables(device: Device, slot: _Slot, tables: Any) -> None:
    headers = np.frombuffer(bytes(tables), dtype=np.uint8)
    device.upload(slot.stream, slot.tables, headers)
    slot.kept.append(headers)


def _constants(device: Device, kernels: Kernels, memory: _Memory, slot: _Slot, params: np.ndarray) -> tuple[int, int]:
    """Address of the constants of parameters that are the same for all, and the code of the prologue."""
    code = np.zeros(1, dtype=np.intc)
    place = memory.take(max(1, kernels.n_c) * kernels.dtype.itemsize)
    tables = (Table * len(GROUPS))()
    tables[-1] = _bring(device, slot, "params", params, kernels.dtype)
    _bring_tables(device, slot, tables)
    device.launch(slot.stream, kernels.constants, 1,
                  StateRows(n=1, given=slot.tables, out=place, out_row=0, out_entry=1, codes=slot.codes))
    device.download(slot.stream, code, slot.codes)
    device.wait(slot.stream)
    slot.kept = []
    return place, int(code[0])
