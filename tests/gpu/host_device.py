"""A device that computes on the processor: the text of a kernel, compiled as C, with memory and streams as a GPU has them."""

from __future__ import annotations

import ctypes
import functools
from typing import Any

import numpy as np

import symdyn as sd
from symdyn.runtime.building import cache
from symdyn.runtime.building.compiler import require_compiler


@functools.cache
def compiled(name: str) -> Any:
    """A mechanism of the catalogue in C."""
    return sd.systems.get(name).compile(backend="c")


class There:
    """An array that is on the device, as other libraries have them."""

    def __init__(self, values: np.ndarray, where: tuple[int, int] = (1, 0)) -> None:
        self.values, self.where = values, where

    def __dlpack__(self, stream: Any = None) -> Any:
        assert stream is None  # of the processor
        return self.values.__dlpack__()

    def __dlpack_device__(self) -> tuple[int, int]:
        return self.where


class Interface:
    """An array that is on the device, by the CUDA array interface alone."""

    def __init__(self, values: np.ndarray, **other: Any) -> None:
        self.values = values
        self.__cuda_array_interface__ = {"shape": values.shape, "typestr": values.dtype.str, "strides": values.strides,
                                         "data": (values.ctypes.data, False), "stream": None, "version": 3, **other}


class HostDevice:
    """Memory are buffers of this process. Work given to a stream is done when it is waited for, as late as a GPU may do it.

    memory    bytes that there are; threads: that are held at once; stack: bytes that each of them is said to take
    lent      arrays of others, which may be copied from
    log       what was done: ("begin", n), ("end", n) of kernels, ("up", bytes), ("down", bytes)
    """

    name = "a processor"
    where = (1, 0)

    def __init__(self, memory: int = 2**30, threads: int = 256) -> None:
        self.memory, self.threads, self.stack = memory, threads, 0
        self.blocks: dict[int, Any] = {}
        self.log: list[tuple[str, int]] = []
        self.most = 0
        self.closed = False
        self.lent: list[np.ndarray] = []

    def free(self) -> int:
        return self.memory - sum(ctypes.sizeof(b) for b in self.blocks.values())

    def kernel(self, text: str, name: str, function: str) -> Any:
        return getattr(cache.load(text, name, require_compiler()), function)

    def at_once(self, kernel: Any) -> int:
        return self.threads

    def stacks(self, kernel: Any) -> int:
        return self.stack * self.threads

    def allocate(self, size: int) -> int:
        assert size <= self.free(), "more than the device has"
        block = ctypes.create_string_buffer(size)
        self.blocks[ctypes.addressof(block)] = block
        self.most = max(self.most, sum(ctypes.sizeof(b) for b in self.blocks.values()))
        return ctypes.addressof(block)

    def release(self, address: int) -> None:
        del self.blocks[address]

    def stream(self) -> list[Any]:
        return []

    def handle(self, stream: list[Any]) -> None:
        return None

    def number_of(self, address: int) -> int:
        """0 for lent memory, 1 for all else."""
        return int(not any(low <= address < high for low, high in map(np.lib.array_utils.byte_bounds, self.lent)))

    def upload(self, stream: list[Any], address: int, values: np.ndarray) -> None:
        self._inside(address, values.nbytes)
        stream.append(lambda: self._copy("up", address, values.ctypes.data, values.nbytes))

    def download(self, stream: list[Any], values: np.ndarray, address: int) -> None:
        lent = [np.lib.array_utils.byte_bounds(a) for a in self.lent]
        if not any(start <= address and address + values.nbytes <= end for start, end in lent):
            self._inside(address, values.nbytes)
        assert values.flags.c_contiguous
        stream.append(lambda: self._copy("down", values.ctypes.data, address, values.nbytes))

    def launch(self, stream: list[Any], kernel: Any, threads: int, argument: Any) -> None:
        copied = type(argument).from_buffer_copy(argument)  # as a driver copies it
        self.log.append(("begin", argument.n))
        stream.append(lambda: self._run(kernel, copied))

    def wait(self, stream: Any) -> None:
        if isinstance(stream, int):  # of another library
            self.log.append(("wait", stream))
            return
        while stream:
            stream.pop(0)()

    def close(self) -> None:
        self.closed = True

    def _copy(self, way: str, to: int, source: int, size: int) -> None:
        ctypes.memmove(to, source, size)
        self.log.append((way, size))

    def _run(self, kernel: Any, argument: Any) -> None:
        kernel(argument)
        self.log.append(("end", argument.n))

    def _inside(self, address: int, size: int) -> None:
        """Copied memory lies within one block."""
        assert any(start <= address and address + size <= start + ctypes.sizeof(block) for start, block in self.blocks.items())


# The threads of a launch side by side: warps take turns, and so do the threads of a warp. rounds: of every warp until its last
# thread has ended, of every thread, each summed up.
LOCKSTEP = """
SYMDYN_EXPORT void lockstep(symdyn_motions motions, long threads, long warp, void *memory, long *turns, long *rounds) {
    symdyn_motion *const own = (symdyn_motion *)memory;
    for (long k = 0; k < threads; k++) own[k].i = -1;
    for (int going = 1; going;) {
        going = 0;
        for (long first = 0; first < threads; first += warp) {
            int waits = 0;
            for (long k = first; k < threads && k < first + warp; k++) {
                if (turns[k] == LONG_MIN) continue;
                going = waits = 1;
                rounds[1]++;
                if (!symdyn_advance(&motions, own + k, turns + k)) turns[k] = LONG_MIN;
            }
            if (waits) rounds[0]++;
        }
    }
}
"""


class Lockstep(HostDevice):
    """A device whose warps of 32 threads attempt their steps together.

    launches   kernels of motions that were begun, by their number of motions
    rounds     of warps, and of threads, until these had ended
    """

    WARP = 32

    def __init__(self, threads: int) -> None:
        super().__init__(threads=threads)
        self.launches: list[int] = []
        self.rounds = np.zeros(2, dtype=int)

    def kernel(self, text: str, name: str, function: str) -> Any:
        self.library: Any = cache.load("#include <limits.h>\n" + text + LOCKSTEP, name, require_compiler())
        kernel = getattr(self.library, function)
        if function.endswith("_motion_size"):
            self.motion_size = kernel
        return kernel

    def launch(self, stream: list[Any], kernel: Any, threads: int, argument: Any) -> None:
        if not argument.n:  # asks for the size of a motion
            super().launch(stream, kernel, threads, argument)
            return
        copied = type(argument).from_buffer_copy(argument)
        self.launches.append(argument.n)
        size = np.zeros(1, dtype=np.intc)
        self.motion_size(type(argument)(n_put=size.ctypes.data))
        memory, turns = np.zeros((threads, size[0]), dtype=np.uint8), np.full(threads, argument.turn)
        address = ctypes.c_void_p
        stream.append(lambda: self.library.lockstep(
            copied, ctypes.c_long(threads), ctypes.c_long(self.WARP), address(memory.ctypes.data), address(turns.ctypes.data),
            address(self.rounds.ctypes.data)))
