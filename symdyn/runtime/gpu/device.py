"""A CUDA device through its driver: memory, copies, kernels."""

from __future__ import annotations

import ctypes
from typing import Any, Protocol

import numpy as np

from symdyn.errors import ArgumentError, EvaluationError, MissingExtra, SymdynError
from symdyn.runtime.gpu.compiling import INSTALL, cubin
from symdyn.runtime.gpu.dlpack import CUDA
from symdyn.shown import shown

# Threads of a block: four warps.
BLOCK = 128


class OfDevice(SymdynError):
    """Missing ability of a device, whatever the motions are; the base of the two below."""


class NoDevice(OfDevice, ArgumentError):
    """There is no such device, or it has too little memory."""


class DeviceFailed(OfDevice, EvaluationError):
    """A call of the driver failed."""


class Device(Protocol):
    """Device that runs kernels. Addresses are numbers; copies and kernels of one stream follow each other, those of two do not
    wait."""

    name: str
    # As DLPack has them: its type and number.
    where: tuple[int, int]

    def free(self) -> int:
        """Bytes of memory that can be taken."""

    def kernel(self, text: str, name: str, function: str) -> Any:
        """A kernel, by its text in CUDA C, the name of the mechanism and the kernel's own."""

    def at_once(self, kernel: Any) -> int:
        """Number of threads of a kernel that the device holds at once."""

    def stacks(self, kernel: Any) -> int:
        """Bytes of memory that the stacks of a kernel's threads take, while it runs."""

    def allocate(self, size: int) -> int:
        """The address of so many bytes of the device."""

    def release(self, address: int) -> None:
        """Give memory back."""

    def stream(self) -> Any:
        """A stream of its own."""

    def handle(self, stream: Any) -> int | None:
        """A stream as DLPack has it."""

    def number_of(self, address: int) -> int:
        """The number of the device, of this type, that an address is of."""

    def upload(self, stream: Any, address: int, values: np.ndarray) -> None:
        """Copy an array to the device."""

    def download(self, stream: Any, values: np.ndarray, address: int) -> None:
        """Copy from the device into an array."""

    def wait(self, stream: Any) -> None:
        """Wait until all is done that a stream was given."""

    def launch(self, stream: Any, kernel: Any, threads: int, argument: ctypes.Structure) -> None:
        """Begin a kernel with so many threads or a few more; its argument is a record."""

    def close(self) -> None:
        """Give kernels and streams back."""


class Cuda:
    """A device of NVIDIA's, by its number."""

    def __init__(self, number: int, owner: str) -> None:
        """owner: of messages. Raises MissingExtra, NoDevice."""
        try:
            from cuda.bindings import driver
        except ImportError:
            raise MissingExtra(f"device='gpu' needs the package cuda-bindings: {INSTALL}") from None
        self.driver, self.owner = driver, owner
        asked = f"gpu:{number}" if number else "gpu"
        try:
            self._call("cuInit", 0)
            count = self._call("cuDeviceGetCount")
        except (RuntimeError, DeviceFailed) as error:
            raise NoDevice(f"{owner}: device={asked!r} was asked for, but this machine has no CUDA device that answers "
                                f"({str(error).splitlines()[0]}); leave device out to compute on the processor") from None
        if number >= count:
            raise NoDevice(f"{owner}: device={asked!r} was asked for; there are {count}, numbered from 0")
        self._device = self._call("cuDeviceGet", number)
        # A context stays alive with the process, shared with what else uses the device there.
        self._context = self._call("cuDevicePrimaryCtxRetain", self._device)
        self._call("cuCtxSetCurrent", self._context)
        self.name = self._call("cuDeviceGetName", 256, self._device).split(b"\0")[0].decode()
        self.major, self.minor = self._attribute("COMPUTE_CAPABILITY_MAJOR"), self._attribute("COMPUTE_CAPABILITY_MINOR")
        self.multiprocessors = self._attribute("MULTIPROCESSOR_COUNT")
        self.where = CUDA, number
        self._modules: list[Any] = []
        self._streams: list[Any] = []

    def free(self) -> int:
        return int(self._call("cuMemGetInfo")[0])

    def kernel(self, text: str, name: str, function: str) -> Any:
        code = cubin(text, name, f"sm_{self.major}{self.minor}")
        module = self._call("cuModuleLoadData", code)
        self._modules.append(module)
        return self._call("cuModuleGetFunction", module, function.encode())

    def at_once(self, kernel: Any) -> int:
        blocks = self._call("cuOccupancyMaxActiveBlocksPerMultiprocessor", kernel, BLOCK, 0)
        return int(blocks) * BLOCK * self.multiprocessors

    def stacks(self, kernel: Any) -> int:
        # The driver sets them aside for all threads that the multiprocessors could hold of any kernel.
        threads = self._attribute("MAX_THREADS_PER_MULTIPROCESSOR") * self.multiprocessors
        which = self.driver.CUfunction_attribute.CU_FUNC_ATTRIBUTE_LOCAL_SIZE_BYTES
        return int(self._call("cuFuncGetAttribute", which, kernel)) * threads

    def allocate(self, size: int) -> int:
        return int(self._call("cuMemAlloc", size))

    def release(self, address: int) -> None:
        self._call("cuCtxSetCurrent", self._context)  # of this thread, which may be another one than that which took it
        self._call("cuMemFree", address)

    def stream(self) -> Any:
        self._streams.append(self._call("cuStreamCreate", self.driver.CUstream_flags.CU_STREAM_NON_BLOCKING))
        return self._streams[-1]

    def handle(self, stream: Any) -> int | None:
        return int(stream)

    def number_of(self, address: int) -> int:
        which = self.driver.CUpointer_attribute.CU_POINTER_ATTRIBUTE_DEVICE_ORDINAL
        return int(self._call("cuPointerGetAttribute", which, address))

    def upload(self, stream: Any, address: int, values: np.ndarray) -> None:
        if values.nbytes:
            self._call("cuMemcpyHtoDAsync", address, values.ctypes.data, values.nbytes, stream)

    def download(self, stream: Any, values: np.ndarray, address: int) -> None:
        if values.nbytes:
            self._call("cuMemcpyDtoHAsync", values.ctypes.data, address, values.nbytes, stream)

    def wait(self, stream: Any) -> None:
        self._call("cuStreamSynchronize", stream)

    def launch(self, stream: Any, kernel: Any, threads: int, argument: ctypes.Structure) -> None:
        blocks = -(-threads // BLOCK)
        addresses = (ctypes.c_void_p * 1)(ctypes.addressof(argument))  # read before the call returns
        self._call("cuLaunchKernel", kernel, blocks, 1, 1, BLOCK, 1, 1, 0, stream, ctypes.addressof(addresses), 0)

    def close(self) -> None:
        while self._streams:
            self._call("cuStreamDestroy", self._streams.pop())
        while self._modules:
            self._call("cuModuleUnload", self._modules.pop())

    def _attribute(self, name: str) -> int:
        return int(self._call("cuDeviceGetAttribute", getattr(self.driver.CUdevice_attribute, f"CU_DEVICE_ATTRIBUTE_{name}"),
                              self._device))

    def _call(self, name: str, *arguments: Any) -> Any:
        status, *results = getattr(self.driver, name)(*arguments)
        if int(status):
            raise DeviceFailed(f"{self.owner}: the CUDA driver's {name} failed: {status.name}")
        return results[0] if len(results) == 1 else results


def device_number(device: Any, owner: str) -> int | None:
    """None for the processor, else the number of a GPU: of "cpu", "gpu" and "gpu:1". Raises ArgumentError for something else."""
    if device in (None, "cpu"):
        return None
    kind, _, number = device.partition(":") if isinstance(device, str) else ("", "", "")
    if kind != "gpu" or not (number.isdecimal() or device == "gpu"):
        raise ArgumentError(f"{owner}: device must be 'cpu', 'gpu', or 'gpu:1' for the second one, found {shown(device)}")
    return int(number or 0)


def open_device(number: int, owner: str) -> Device:
    """A GPU by its number. Raises what Cuda does."""
    return Cuda(number, owner)
