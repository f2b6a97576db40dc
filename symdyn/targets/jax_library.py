"""The compiled C library of a mechanism as functions that XLA calls on a CPU.

XLA calls a function of a fixed signature with the addresses of its arguments (XLA FFI); jax_rows.c of the templates is one for
all mechanisms: it gets the address of the function of the library that it is to call, and the axes of states, as attributes.
"""

from __future__ import annotations

import ctypes
import functools
from collections.abc import Callable, Mapping
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from symdyn.folders import templates_folder
from symdyn.formulation.equations import Equations
from symdyn.pipeline import compile_equations
from symdyn.runtime.building import cache
from symdyn.runtime.building.compiler import require_compiler
from symdyn.runtime.building.library import CLibrary
from symdyn.targets.functions import library

_TARGET = "symdyn_rows"


def through_library(equations: Equations, name: str, module: ModuleType,
                    specialize: Mapping[Any, float] | None) -> Callable[[str], Callable[..., Any]]:
    """name -> what computes a function or its derivatives by the C library, of JAX's arrays t, x, params, inputs, ud.

    module   the generated module for JAX, with the sizes
    Raises CompilerNotFound, CompileError.
    """
    _registered()
    jax = library("jax", "to_jax")
    compiled = compile_equations(equations, "c", specialize=specialize)

    @functools.cache
    def core(wanted: str) -> Callable[..., Any]:
        library = compiled.library(wanted)
        assert isinstance(library, CLibrary)
        shape = tuple(module.METADATA["shapes"][wanted])
        attributes = {"rows": _address(library.function(f"{wanted}_rows")), "prologue": _address(library.function("prologue")),
                      "n_c": np.int64(library.metadata.n_c), "inner": np.int64(len(shape))}
        n_ud = library.metadata.sizes.ud

        def called(t: Any, x: Any, params: Any, inputs: Any, ud: Any) -> Any:
            call = jax.ffi.ffi_call(_TARGET, jax.ShapeDtypeStruct(shape, x.dtype), vmap_method="expand_dims")
            return call(t, x, ud[:n_ud], inputs, params, **attributes)

        return called

    return core


def _address(function: Any) -> np.int64:
    return np.int64(ctypes.cast(function, ctypes.c_void_p).value or 0)


@functools.cache
def _registered() -> ctypes.CDLL:
    """The library of the one function that XLA calls; XLA knows it after that."""
    jax = library("jax", "to_jax")
    header = Path(jax.ffi.include_dir()) / "xla" / "ffi" / "api" / "c_api.h"
    source = header.read_text(encoding="utf-8") + (templates_folder() / "python" / "jax_rows.c").read_text(encoding="utf-8")
    loaded = cache.load(source, "symdyn_xla", require_compiler())
    jax.ffi.register_ffi_target(_TARGET, jax.ffi.pycapsule(loaded.symdyn_xla_rows), platform="cpu")
    return loaded
