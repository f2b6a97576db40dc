"""Arrays of JAX, CuPy and PyTorch on a GPU from which motions are computed: where they lie, and copies that are checked here."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from symdyn.errors import ArgumentError
from symdyn.runtime.batches.precision import PRECISIONS
from symdyn.runtime.gpu import device as devices
from symdyn.runtime.gpu.arrays import copied
from symdyn.runtime.gpu.dlpack import View, has_place, place_of, view
from symdyn.shown import name_of

if TYPE_CHECKING:
    from symdyn.backend.metadata import ModuleMetadata
    from symdyn.runtime.module import Module


@dataclass(frozen=True)
class ArraysThere:
    """Arrays on a device, by what they are of, such as "q", and by name, "" for an array of all."""

    views: Mapping[tuple[str, str], View]

    def numbers(self, metadata: ModuleMetadata, itemsize: int, unchanged: Mapping[str, bool]) -> dict[int, tuple[int, int]]:
        """Address, and stride from motion to motion, of numbers that a kernel reads: states, inputs, parameters, by their place.

        unchanged   of which groups, "x", "inputs", "params", the numbers are used as they were given
        """
        sizes = metadata.sizes
        names = {"q": metadata.q, "u": metadata.u, "z": metadata.z, "inputs": metadata.inputs, "params": metadata.parameters}
        first = {"q": 0, "u": sizes.q, "z": sizes.q + sizes.u, "inputs": sizes.x, "params": sizes.x + sizes.inputs}
        result = {}
        for (group, name), one in self.views.items():
            if not unchanged["x" if group in ("q", "u", "z") else group]:
                continue
            entries = [names[group].index(name)] if name else range(len(names[group]))
            varies = len(one.shape) > (0 if name else 1) and one.shape[0] > 1
            for k, entry in enumerate(entries):
                at = one.address + (k * itemsize * one.strides[-1] if k else 0)
                result[first[group] + entry] = at, one.strides[0] if varies else 0
        return result


def take_there(module: Module, number: int, precision: str,
               values: Mapping[str, Any]) -> tuple[dict[str, Any], ArraysThere | None]:
    """Values by group, with copies in the memory of this process in place of arrays that lie on the GPU with this number; these,
    None: there are none.

    Raises ArgumentError for arrays on another GPU, and for numbers that are not of the precision's type; NoDevice, MissingExtra.
    """
    groups = {group: dict(given) if isinstance(given, Mapping) else {"": given} for group, given in values.items()}
    if not any(has_place(value) for given in groups.values() for value in given.values()):
        return dict(values), None
    device, dtype = devices.open_device(number, module.name), np.dtype(PRECISIONS[precision])
    try:
        stream = device.stream()
        views: dict[tuple[str, str], View] = {}
        for group, given in groups.items():
            for key, value in given.items():
                place, name = place_of(value, device), name_of(key)
                what = f"{group}, {name}" if name else group
                if place is not None and place[0] == device.where[0] and place != device.where:
                    raise ArgumentError(f"{module.name}: {what} lies on the GPU with the number {place[1]}, and motions are "
                                        f"computed on that with the number {number}; pass device='gpu:{place[1]}', or copy it")
                if place == device.where:
                    views[group, name] = view(value, device, stream, dtype, module.name, what)
                    given[key] = copied(device, stream, views[group, name], dtype)
        device.wait(stream)
        taken = {group: given if isinstance(values[group], Mapping) else given[""] for group, given in groups.items()}
        return taken, ArraysThere(views) if views else None
    finally:
        device.close()
