"""Right-hand sides of many states on a GPU: arrays of this process, or of JAX, CuPy and PyTorch where they lie."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from symdyn.backend.right_side import RightSide
from symdyn.errors import ArgumentError, CompileError
from symdyn.runtime.batches.precision import PRECISIONS
from symdyn.runtime.gpu import device as devices
from symdyn.runtime.gpu.device import Device
from symdyn.runtime.gpu.dlpack import DeviceArray, View, demand_rows, is_on, overlap, view
from symdyn.runtime.gpu.states import GROUPS, Kernels, rates, rates_there

if TYPE_CHECKING:
    from symdyn.runtime.module import Module

# Libraries whose arrays never change.
CONSTANT = ("jax", "jaxlib")
Taken = Callable[[Mapping[str, Any]], tuple[int, dict[str, np.ndarray]]]


def states_on_device(module: Module, number: int, values: Mapping[str, Any], out: Any, precision: str, take: Taken,
                     result: Callable[[np.ndarray, int], np.ndarray]) -> tuple[Any, dict[int, str], int, np.ndarray]:
    """x_dot of n states on the GPU with this number, (n, n_x) where the states are; why rows fail; n; the states, if they are
    here.

    values   by group, as they are given
    take     rows of what is here, with their number
    result   (states, n) -> the array that the result goes to
    Raises ArgumentError for what does not fit and where there is no such device, CompileError, MissingExtra.
    """
    if module.backend != "c":
        raise ArgumentError(f"{module.name}: device='gpu' does not take these states: the backend of the module is "
                            f"{module.backend}; kernels are made of its C, compile(backend='c')")
    device = devices.open_device(number, module.name)
    try:
        there = {g: values[g] for g in GROUPS if is_on(values[g], device)}
        given_out = is_on(out, device)
        kernels, library = _kernels(module, device, precision)
        if "x" not in there:
            if there or given_out:
                raise ArgumentError(f"{module.name}: {', '.join([*there, *['out'] * given_out])} lie on the device and x does "
                                    "not; give all as arrays of NumPy, or x there, too")
            n, arrays = take(values)
            xd = result(arrays["x"], n)
            return xd, _reasons(library, rates(device, kernels, n, arrays, xd, module.name)), n, arrays["x"]
        return _there(module, device, kernels, library, values, there, out, take)
    finally:
        device.close()


def _there(module: Module, device: Device, kernels: Kernels, library: Any, values: Mapping[str, Any], there: Mapping[str, Any],
           out: Any, take: Taken) -> tuple[Any, dict[int, str], int, np.ndarray]:
    name, sizes = module.name, module.metadata.sizes
    stream = device.stream()
    widths = {"t": 1, "x": sizes.x, "inputs": sizes.inputs, "params": sizes.p}
    views = {g: view(a, device, stream, kernels.dtype, name, g) for g, a in there.items()}
    if "t" in views and len(views["t"].shape) == 1:
        t = views["t"]
        views["t"] = View(t.address, (*t.shape, 1), (*t.strides, 1), t.kept)
    for group, result in views.items():
        demand_rows(result, widths[group], name, group)
    # Values on the host are taken together with a state that stands for those on the device.
    rows, arrays = take({g: np.zeros((1, widths[g])) if g in ("x", "inputs", "params") and g in there else
                         0.0 if g in there else values[g] for g in GROUPS})
    n = max(rows, *(v.shape[0] for v in views.values()))
    lengths = {g: v.shape[0] for g, v in views.items()} | {g: len(a) for g, a in arrays.items() if g not in views}
    if any(length not in (1, n) for length in lengths.values()) or views["x"].shape[0] != n:
        raise ArgumentError(f"{name}: {', '.join(f'{g} has {k} rows' for g, k in lengths.items() if k > 1)}; give what varies "
                            "the same number of rows, one for each state")
    to = None
    if out is not None:
        if not is_on(out, device):
            raise ArgumentError(f"{name}: x lies on the device and out does not; give an array there, or leave out away")
        if type(out).__module__.partition(".")[0] in CONSTANT:
            raise ArgumentError(f"{name}: out is an array of JAX, which counts on its arrays never to change; leave out away, "
                                "and take the result by jax.dlpack.from_dlpack")
        to = view(out, device, stream, kernels.dtype, name, "out")
        if to.constant:
            raise ArgumentError(f"{name}: out lies on the device and must not be written; pass another array, or leave out away")
        if to.shape != (n, sizes.x):
            raise ArgumentError(f"{name}: out has the shape {to.shape} on the device, needed is ({n}, {sizes.x})")
        # A thread reads all of its state before it writes: out may be x itself.
        shared = [g for g, v in views.items() if overlap(v, to, kernels.dtype.itemsize)
                  and (g != "x" or (v.address, v.strides) != (to.address, to.strides))]
        if shared:
            raise ArgumentError(f"{name}: out and {', '.join(shared)} share memory on the device, where it would be read after "
                                "it was written; give another array, or x itself")
    made, codes = rates_there(device, kernels, n, {g: views.get(g, arrays[g]) for g in GROUPS}, to, name)
    return out if made is None else made, _reasons(library, codes), n, np.zeros((0, sizes.x))


def _kernels(module: Module, device: Device, precision: str) -> tuple[Kernels, Any]:
    library: Any = module.library(RightSide(threads=True, looks=False, integrated=False, single=precision == "single"))
    own, metadata = library.metadata.name, library.metadata
    constants, states = (device_kernel(module, device, library.source, f"{own}_{what}") for what in ("constants", "states"))
    return Kernels(constants, states, np.dtype(PRECISIONS[precision]), metadata.sizes.x, metadata.n_c), library


def device_kernel(module: Module, device: Device, text: str, function: str) -> Any:
    """A kernel of a mechanism. Raises CompileError, where functions of the user may be why with their names."""
    try:
        return device.kernel(text, module.name, function)
    except CompileError as error:
        if "// Functions of the user:" not in text:
            raise
        own = text.partition("Functions of the user, with the number of their results:")[2].splitlines()[1:]
        names = [line.strip("/ ").partition(" ->")[0] for line in own[:own.index(next(s for s in own if " -> " not in s))]]
        raise CompileError(f"{error}\nthe mechanism calls functions of the user in C, {', '.join(names)}, whose text has to be "
                           "CUDA C as well: without #include, and with nothing but the math library") from None


def _reasons(library: Any, codes: np.ndarray) -> dict[int, str]:
    return {int(k): library.reason(int(codes[k])) for k in np.flatnonzero(codes)}


__all__ = ["DeviceArray", "device_kernel", "states_on_device"]
