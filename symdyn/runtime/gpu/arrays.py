"""Arrays on a device: results that stay there, and copies of what lies there."""

from __future__ import annotations

from typing import Any

import numpy as np

from symdyn.runtime.gpu.device import Device, NoDevice
from symdyn.runtime.gpu.dlpack import DeviceArray, View, reach
from symdyn.runtime.memory import in_bytes

# Bytes of rows that are copied at a time.
PIECE = 2**26


def array_of(device: Device, address: int, shape: tuple[int, ...], dtype: np.dtype, by_entry: bool = False) -> DeviceArray:
    """An array at an address of a device, whose memory is given back with it; by_entry: its first axis is that of neighbours."""
    def fetch() -> np.ndarray:
        result, stream = np.empty(shape[::-1] if by_entry else shape, dtype=dtype), device.stream()
        device.download(stream, result, address)
        device.wait(stream)
        device.close()
        return result.T if by_entry else result

    return DeviceArray(address, shape, dtype, device.where, lambda: device.release(address), fetch, by_entry)


def copied(device: Device, stream: Any, there: View, dtype: np.dtype) -> np.ndarray:
    """A copy, in the memory of this process, of an array that lies on a device."""
    if 0 in there.shape:
        return np.zeros(there.shape, dtype=dtype)
    low, high = reach(there)
    memory = np.empty(high - low + 1, dtype=dtype)
    device.download(stream, memory, there.address + low * dtype.itemsize)
    device.wait(stream)
    return np.lib.stride_tricks.as_strided(memory[-low:], there.shape, [s * dtype.itemsize for s in there.strides])


class RowsThere:
    """A new array on a device, whose rows can be replaced as those of an array of NumPy."""

    def __init__(self, device: Device, shape: tuple[int, ...], dtype: np.dtype, owner: str) -> None:
        """Raises NoDevice where the memory does not hold it."""
        size, free = int(np.prod(shape)) * dtype.itemsize, device.free()
        if size > free:
            raise NoDevice(f"{owner}: {device.name} has {in_bytes(free)} of free memory, and the states of {shape[0]} motions at "
                           f"{shape[1]} output times take {in_bytes(size)} there; ask for fewer output times, simulate fewer "
                           "at a time, or give arrays of NumPy, with which states are copied back in parts")
        self._device = device
        self.array = array_of(device, device.allocate(max(size, 1)), shape, dtype)
        self.shape = shape

    def __setitem__(self, rows: np.ndarray, values: Any) -> None:
        """Rows by their numbers, in order; values: that many, or one number."""
        each = int(np.prod(self.shape[1:])) * self.array.dtype.itemsize
        values, stream = np.broadcast_to(values, (len(rows), *self.shape[1:])), self._device.stream()
        first = 0
        for last in range(1, len(rows) + 1):  # neighbours together
            if last == len(rows) or rows[last] != rows[last - 1] + 1 or (last - first) * each > PIECE:
                part = np.ascontiguousarray(values[first:last], dtype=self.array.dtype)
                self._device.upload(stream, self.array.address + int(rows[first]) * each, part)
                self._device.wait(stream)
                first = last
