"""C code of the runtime that is the same for every mechanism, compiled once."""

from __future__ import annotations

import ctypes
import functools

from symdyn.backend.parts import Parts
from symdyn.folders import templates_folder
from symdyn.runtime.building import cache
from symdyn.runtime.building.compiler import Compiler

# Doubles, on processors.
SWITCHES = {"SYMDYN_SINGLE": False, "SYMDYN_THREADS": False}


@functools.cache
def text(name: str) -> str:
    """A file of the runtime with all that it includes, as its library is compiled from it."""
    folder = templates_folder() / "c" / "runtime"
    return Parts(lambda file: (folder / file).read_text(encoding="utf-8"), SWITCHES).text(f"{name}.c")


def shared(name: str, compiler: Compiler) -> ctypes.CDLL:
    """The library of a file of the runtime, such as "moreau".

    Raises CompileError where the compiler rejects the text, CacheError where the cache folder does not take it.
    """
    return cache.load(text(name), f"symdyn_{name}", compiler)
