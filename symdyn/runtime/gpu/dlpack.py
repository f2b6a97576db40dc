"""Arrays of other libraries on a device, by the protocol DLPack, in and out: JAX's, CuPy's, PyTorch's, without a copy.

Records and rules: https://dmlc.github.io/dlpack/latest (version 0.8, which all consumers take).
"""

from __future__ import annotations

import ctypes
import itertools
from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from symdyn.errors import ArgumentError
from symdyn.shown import shown

if TYPE_CHECKING:
    from symdyn.runtime.gpu.device import Device

# The types of devices: the processor, CUDA.
CPU, CUDA = 1, 2
_FLOAT = 2
_NAME = b"dltensor"
# Attribute of CUDA arrays without DLPack, and its number for the default stream.
_INTERFACE, LEGACY = "__cuda_array_interface__", 1


class _Tensor(ctypes.Structure):
    _fields_ = [("data", ctypes.c_void_p), ("device_type", ctypes.c_int32), ("device_id", ctypes.c_int32),
                ("ndim", ctypes.c_int32), ("code", ctypes.c_uint8), ("bits", ctypes.c_uint8), ("lanes", ctypes.c_uint16),
                ("shape", ctypes.POINTER(ctypes.c_int64)), ("strides", ctypes.POINTER(ctypes.c_int64)),
                ("byte_offset", ctypes.c_uint64)]


_Deleter = ctypes.CFUNCTYPE(None, ctypes.c_void_p)


class _Managed(ctypes.Structure):
    _fields_ = [("tensor", _Tensor), ("context", ctypes.c_void_p), ("deleter", _Deleter)]


_Destructor = ctypes.PYFUNCTYPE(None, ctypes.c_void_p)
_new = ctypes.PYFUNCTYPE(ctypes.py_object, ctypes.c_void_p, ctypes.c_char_p, _Destructor)(("PyCapsule_New", ctypes.pythonapi))
_pointer = ctypes.PYFUNCTYPE(ctypes.c_void_p, ctypes.py_object, ctypes.c_char_p)(("PyCapsule_GetPointer", ctypes.pythonapi))
_is_valid = ctypes.PYFUNCTYPE(ctypes.c_int, ctypes.c_void_p, ctypes.c_char_p)(("PyCapsule_IsValid", ctypes.pythonapi))
_pointer_of = ctypes.PYFUNCTYPE(ctypes.c_void_p, ctypes.c_void_p, ctypes.c_char_p)(("PyCapsule_GetPointer", ctypes.pythonapi))


class OnDevice(Protocol):
    """An array that other libraries may read where it lies."""

    def __dlpack__(self, *, stream: int | None = None) -> object:
        """The capsule of the protocol."""

    def __dlpack_device__(self) -> tuple[int, int]:
        """Type and number of the device."""


@dataclass(frozen=True)
class View:
    """Numbers of an array on a device: address of the first one, shape and strides in numbers; `kept` keeps them there.

    constant   whether they must not be written
    """

    address: int
    shape: tuple[int, ...]
    strides: tuple[int, ...]
    kept: Any
    constant: bool = False


def has_place(values: object) -> bool:
    """Whether values are an array of another library, on whatever device."""
    if isinstance(values, (np.ndarray, np.generic, type)):
        return False
    return _by_dlpack(values) or hasattr(values, _INTERFACE)


def place_of(values: Any, device: Device) -> tuple[int, int] | None:
    """Type and number of the device that an array of another library lies on; None for what is none.

    device   that addresses are asked of, where an array has nothing but those
    """
    if not has_place(values):
        return None
    if _by_dlpack(values):
        where = values.__dlpack_device__()
        return int(where[0]), int(where[1])
    address = int(getattr(values, _INTERFACE)["data"][0])
    return device.where[0], device.number_of(address) if address else device.where[1]  # an empty array has no address


def is_on(values: Any, device: Device) -> bool:
    """Whether values are an array of another library on this device."""
    return place_of(values, device) == device.where


def _by_dlpack(values: object) -> bool:
    return hasattr(values, "__dlpack__") and hasattr(values, "__dlpack_device__")


def view(values: Any, device: Device, stream: Any, dtype: np.dtype, owner: str, what: str) -> View:
    """An array of another library, which waits for what its own stream still does.

    stream   of the device, that it is read in
    what     it is, in messages
    Raises ArgumentError where its numbers are not of the type.
    """
    if not _by_dlpack(values):
        return _view_of_interface(values, device, dtype, owner, what)
    stream = device.handle(stream)
    capsule = values.__dlpack__() if stream is None else values.__dlpack__(stream=stream)
    tensor = _Managed.from_address(_pointer(capsule, _NAME)).tensor
    shape = tuple(tensor.shape[k] for k in range(tensor.ndim))
    if (tensor.code, tensor.bits, tensor.lanes) != (_FLOAT, 8 * dtype.itemsize, 1):
        kind = {0: "int", 1: "unsigned", _FLOAT: "float", 6: "bool"}.get(tensor.code, "other")
        raise _other_type(f"{kind}{tensor.bits}", dtype, owner, what)
    strides = tuple(tensor.strides[k] for k in range(tensor.ndim)) if tensor.strides else _steps(shape)
    return View(int(tensor.data or 0) + tensor.byte_offset, shape, strides, capsule)


def _view_of_interface(values: Any, device: Device, dtype: np.dtype, owner: str, what: str) -> View:
    """An array by the CUDA array interface, https://numba.readthedocs.io/en/stable/cuda/cuda_array_interface.html (version 3)."""
    about = getattr(values, _INTERFACE)
    found, shape = np.dtype(about["typestr"]), tuple(about["shape"])
    if found != dtype:
        raise _other_type(found.name, dtype, owner, what)
    if about.get("mask") is not None:
        raise ArgumentError(f"{owner}: {what} is a masked array, whose hidden entries would count; pass one without a mask")
    steps = about.get("strides")
    if steps is not None and any(step % dtype.itemsize for step in steps):
        raise ArgumentError(f"{owner}: {what} has strides of {shown(tuple(steps))} bytes, which are no multiples of "
                            f"{dtype.itemsize}; pass a copy")
    # Before version 3 what an array still waited for was not known: it is that of the default stream.
    stream = about.get("stream", LEGACY if about.get("version", 0) < 3 else None)
    if stream is not None:
        device.wait(stream)
    strides = _steps(shape) if steps is None else tuple(step // dtype.itemsize for step in steps)
    return View(int(about["data"][0]), shape, strides, values, bool(about["data"][1]))


def _other_type(found: str, dtype: np.dtype, owner: str, what: str) -> ArgumentError:
    precision = "double" if dtype.itemsize == 8 else "single"
    return ArgumentError(f"{owner}: {what} is an array of {found} on the device, and precision={precision!r} takes {dtype.name} "
                         "there; convert it, or pass another precision")


def _steps(shape: tuple[int, ...]) -> tuple[int, ...]:
    """Strides, in numbers, of an array whose last axis is that of neighbours."""
    return tuple(int(np.prod(shape[k + 1:], dtype=int)) for k in range(len(shape)))


def reach(one: View) -> tuple[int, int]:
    """The first and the last number of an array's memory, counted from the number at its address."""
    steps = [(n - 1) * stride for n, stride in zip(one.shape, one.strides, strict=True)]
    return sum(min(0, s) for s in steps), sum(max(0, s) for s in steps)


def overlap(a: View, b: View, size: int) -> bool:
    """Whether the memory that two arrays reach over has a part in common; size: of a number."""
    ranges = [(one.address + size * low, one.address + size * (high + 1)) for one in (a, b) for low, high in [reach(one)]]
    return ranges[0][0] < ranges[1][1] and ranges[1][0] < ranges[0][1] and 0 not in (*a.shape, *b.shape)


_exported: dict[int, tuple[Any, ...]] = {}
_numbers = itertools.count(1)


def _forget(address: int) -> None:
    _exported.pop(_Managed.from_address(address).context, None)


def _unused(capsule: int) -> None:
    if _is_valid(capsule, _NAME):  # nobody has taken it
        _forget(_pointer_of(capsule, _NAME))


_deleter, _destructor = _Deleter(_forget), _Destructor(_unused)


class DeviceArray:
    """Numbers on a device, which JAX, CuPy and PyTorch take by `from_dlpack`, without a copy; the memory is given back when
    nobody has them any more.

    shape, dtype   as of NumPy's arrays, row by row or, as `by_entry`, entry by entry
    address        of the first number

    >>> from symdyn.runtime.gpu.dlpack import CPU, DeviceArray
    >>> here = np.arange(6.0)
    >>> rows = DeviceArray(here.ctypes.data, (2, 3), np.dtype(float), (CPU, 0), lambda: None, lambda: here.reshape(2, 3))
    >>> np.from_dlpack(rows)[1]
    array([3., 4., 5.])
    """

    def __init__(self, address: int, shape: tuple[int, ...], dtype: np.dtype, where: tuple[int, int],
                 release: Callable[[], None], fetch: Callable[[], np.ndarray], by_entry: bool = False) -> None:
        self.shape, self.dtype, self.by_entry = shape, dtype, by_entry
        self.address, self._where, self._release, self._fetch = address, where, release, fetch

    def __len__(self) -> int:
        return self.shape[0]

    def __repr__(self) -> str:
        return f"<DeviceArray {' x '.join(map(str, self.shape))} of {self.dtype.name}>"

    def __dlpack_device__(self) -> tuple[int, int]:
        return self._where

    def __dlpack__(self, *, stream: Any = None, max_version: Any = None, dl_device: Any = None, copy: Any = None) -> Any:
        """The capsule of the protocol; what has been computed is there, whatever the stream. Raises BufferError for a copy."""
        if copy or (dl_device is not None and tuple(dl_device) != self._where):
            raise BufferError(f"{self!r} is given as it is, where it is; leave copy and dl_device out")
        managed, key = _Managed(), next(_numbers)
        axes = len(self.shape)
        steps = _steps(self.shape[::-1])[::-1] if self.by_entry else _steps(self.shape)
        shape, strides = (ctypes.c_int64 * axes)(*self.shape), (ctypes.c_int64 * axes)(*steps)
        managed.tensor = _Tensor(self.address, *self._where, axes, _FLOAT, 8 * self.dtype.itemsize, 1,
                                 ctypes.cast(shape, ctypes.POINTER(ctypes.c_int64)),
                                 ctypes.cast(strides, ctypes.POINTER(ctypes.c_int64)), 0)
        managed.context, managed.deleter = key, _deleter
        _exported[key] = managed, shape, strides, self
        return _new(ctypes.addressof(managed), _NAME, _destructor)

    def to_numpy(self) -> np.ndarray:
        """A copy in the memory of this process.

        >>> from symdyn.runtime.gpu.dlpack import CPU, DeviceArray
        >>> here = np.arange(6.0)
        >>> rows = DeviceArray(here.ctypes.data, (2, 3), np.dtype(float), (CPU, 0), lambda: None, lambda: here.reshape(2, 3))
        >>> rows.to_numpy().shape
        (2, 3)
        """
        return self._fetch()

    def __del__(self) -> None:
        self._release()


def demand_rows(result: View, width: int, owner: str, what: str) -> None:
    """Raises ArgumentError where an array on the device has not as many columns."""
    if len(result.shape) != 2 or result.shape[1] != width:
        raise ArgumentError(f"{owner}: {what} has the shape {shown(result.shape)} on the device, needed is (n, {width})")
