"""Memory that a request would take, checked before any is taken; arrays that libraries share."""

from __future__ import annotations

import contextlib
import math
import os
from pathlib import Path

import numpy as np

from symdyn.errors import ArgumentError

DOUBLE = 8
# Alignment of addresses, bytes: arrays of JAX begin at multiples of it.
ALIGNMENT = 64
# Where a container's limit stands (versions 2 and 1 of Linux control groups), and what it has used.
_GROUPS = (("/sys/fs/cgroup/memory.max", "/sys/fs/cgroup/memory.current"),
           ("/sys/fs/cgroup/memory/memory.limit_in_bytes", "/sys/fs/cgroup/memory/memory.usage_in_bytes"))


def available() -> int:
    """Bytes that can be taken without swapping: of the machine, and of the container that this process runs in.

    Where the system does not report it (Windows, macOS), a bound of 1 TiB, or the physical memory.
    """
    result = [2**40]
    with contextlib.suppress(OSError, ValueError, IndexError, StopIteration):
        lines = Path("/proc/meminfo").read_text(encoding="ascii").splitlines()
        result.append(1024 * int(next(line for line in lines if line.startswith("MemAvailable:")).split()[1]))
    with contextlib.suppress(OSError, ValueError, AttributeError):
        result.append(os.sysconf("SC_PHYS_PAGES") * os.sysconf("SC_PAGE_SIZE"))
    for limit, used in _GROUPS:
        with contextlib.suppress(OSError, ValueError):  # "max" is no number: there is no limit
            result.append(int(Path(limit).read_text(encoding="ascii")) - int(Path(used).read_text(encoding="ascii")))
    return max(0, min(result))


def demand(numbers: int, owner: str, what: str, remedy: str) -> None:
    """Raise ArgumentError if so many doubles are more than the memory that is available.

    what     that is requested, with its size; remedy: what to do
    """
    if numbers < 2**20:  # 8 MB need no look at the system
        return
    free = available()
    if numbers * DOUBLE > free:
        raise ArgumentError(f"{owner}: {what} would take {in_bytes(numbers * DOUBLE)}, but {in_bytes(free)} of memory are "
                            f"available; {remedy}")


def in_bytes(size: int) -> str:
    """A number of bytes in words, such as "12.0 GB (12000000000 bytes)"."""
    if size >= 10**30:
        return f"more than 10^{size.bit_length() * 3 // 10 - 1} bytes"
    value, units = float(size), ("bytes", "kB", "MB", "GB", "TB", "PB", "EB")
    k = 0
    while value >= 1000 and k < len(units) - 1:
        value, k = value / 1000, k + 1
    return f"{value:.3g} {units[k]}" + (f" ({size} bytes)" if k else "")


def aligned(shape: tuple[int, ...], value: float) -> np.ndarray:
    """An array of doubles with one value, at an address that every library takes by DLPack without a copy, JAX's included."""
    whole = np.empty(math.prod(shape) + ALIGNMENT // DOUBLE)
    first = -whole.ctypes.data % ALIGNMENT // DOUBLE
    result = whole[first:first + math.prod(shape)].reshape(shape)
    result.fill(value)
    return result
