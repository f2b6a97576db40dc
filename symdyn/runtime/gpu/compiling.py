"""Compiles kernels with NVIDIA's compiler NVRTC, which needs neither a toolkit nor a GPU."""

from __future__ import annotations

import hashlib
import re
from typing import Any

from symdyn.errors import CompileError, MissingExtra
from symdyn.runtime.building.cache import LONGEST, cache_dir, writing
from symdyn.runtime.building.stored import read_sealed, write_sealed
from symdyn.shown import shown

INSTALL = "pip install 'symdyn[gpu]'"
# The text is C; designators are C++ since 2020. Functions that are not marked are those of the device.
OPTIONS = ("-default-device", "-std=c++20")
OUTPUT_LINES = 40


def nvrtc() -> Any:
    """The compiler's functions. Raises MissingExtra."""
    try:
        from cuda.bindings import nvrtc as functions

        functions.nvrtcVersion()
    except (ImportError, RuntimeError):  # the package is there, but not the compiler's library
        raise MissingExtra(f"device='gpu' needs the packages cuda-bindings and nvidia-cuda-nvrtc: {INSTALL}") from None
    return functions


def ptx(text: str, name: str, architecture: str) -> tuple[bytes, str]:
    """A kernel's text in CUDA C as PTX for an architecture such as "compute_90", and the compiler's warnings.

    Raises CompileError, MissingExtra.
    """
    return _compiled(text, name, architecture, "PTX")


def report(text: str, name: str, architecture: str) -> str:
    """Report of the compiler on registers and memory of a kernel on an architecture such as "sm_90". Raises as `ptx` does."""
    return _compiled(text, name, architecture, "CUBIN", "--ptxas-options=-v")[1]


def cubin(text: str, name: str, architecture: str) -> bytes:
    """A kernel's text in CUDA C as machine code of an architecture such as "sm_90"; remembered in the cache folder.

    Raises CompileError with the compiler's output, CacheError where the cache folder does not take the code, MissingExtra.
    """
    version = nvrtc().nvrtcVersion()[1:]
    about = repr((text, architecture, OPTIONS, version)).encode()
    path = cache_dir() / f"{name[:LONGEST]}-{hashlib.sha256(about).hexdigest()[:16]}.cubin"
    try:
        known = read_sealed(path)
    except (OSError, ValueError):
        known = None
    if known:
        return known
    code, _ = _compiled(text, name, architecture, "CUBIN")
    with writing(path):
        write_sealed(path, code)
    return code


def _compiled(text: str, name: str, architecture: str, form: str, *more: str) -> tuple[bytes, str]:
    """The code in that form, and what the compiler prints."""
    compiler = nvrtc()
    _, program = compiler.nvrtcCreateProgram(text.encode(), f"{name}.cu".encode(), 0, [], [])
    options = [option.encode() for option in (f"--gpu-architecture={architecture}", *OPTIONS, *more)]
    try:
        (status,) = compiler.nvrtcCompileProgram(program, len(options), options)
        printed = _taken(compiler.nvrtcGetProgramLogSize, compiler.nvrtcGetProgramLog, program).decode(errors="replace")
        printed = printed.rstrip("\0")
        if int(status):
            lines = [line for line in re.split(r"[\r\n]+", printed) if line.strip()]
            raise CompileError(f"the CUDA kernel of {shown(name)} does not compile for {architecture} ({status.name}):\n"
                               + "\n".join(lines[:OUTPUT_LINES]))
        return _taken(getattr(compiler, f"nvrtcGet{form}Size"), getattr(compiler, f"nvrtcGet{form}"), program), printed
    finally:
        compiler.nvrtcDestroyProgram(program)


def _taken(size: Any, get: Any, program: Any) -> bytes:
    """Bytes that two functions of the compiler give: the first their number, the second the bytes."""
    _, length = size(program)
    result = b" " * length  # the compiler writes into it
    get(program, result)
    return result
