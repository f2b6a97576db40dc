"""Pinocchio's articulated-body algorithm on CasADi's symbols: a library that makes CasADi's functions of descriptions."""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from symdyn.bench.toolchain import build_cpp, include_flags, package_folder
from symdyn.errors import SymdynError

# Sources in C++; model.hpp documents the format of a description.
SOURCES = Path(__file__).parent / "cpp"
ERROR_SIZE = 1000


def sources(*names: str) -> str:
    """The text of files of the folder, one after the other."""
    return "".join((SOURCES / name).read_text(encoding="utf-8") for name in names)


def options() -> list[str]:
    """Options by which the library is compiled, and the place of CasADi's. Raises SymdynError for what is missing."""
    folder = package_folder("casadi")
    roots = (folder, *[p / "lib" for p in folder.parents[:4]])
    library = next((root for root in roots if (root / "libcasadi.so").exists()), None)
    if library is None:
        raise SymdynError(f"the library libcasadi.so was not found next to the package {folder}; install symdyn[peers]")
    return ["-O0", "-DBOOST_VARIANT_USE_RELAXED_GET_BY_DEFAULT", *include_flags("pinocchio", "boost", "eigen", "casadi"),
            "-Wl,--no-as-needed", f"-L{library}", "-lcasadi", f"-Wl,-rpath,{library}"]


class Generator:
    """The library. Raises MissingExtra, CompilerNotFound or CompileError, whose messages name what to install."""

    def __init__(self) -> None:
        text = "#include <pinocchio/autodiff/casadi.hpp>\n" + sources("model.hpp", "casadi_aba.cpp")
        self.library = build_cpp("casadi_aba", text, options(), ("pin", "casadi"))
        self.library.casadi_aba.restype = ctypes.c_char_p

    def function(self, text: str, values: Sequence[float] | np.ndarray = (), runtime: bool = False, driven: bool = False) -> Any:
        """CasADi's function (q, u, tau, p) -> u_dot of a description.

        values    of its parameters; runtime: they stay arguments p, else there are none; driven: with forces tau along the speeds
        Raises SymdynError for a text that cannot be read.
        """
        import casadi

        numbers = np.ascontiguousarray(values, dtype=float)
        message = ctypes.create_string_buffer(ERROR_SIZE)
        made = self.library.casadi_aba(text.encode(), numbers.ctypes.data_as(ctypes.c_void_p), ctypes.c_long(len(numbers)),
                                       int(runtime), int(driven), message, ctypes.c_long(ERROR_SIZE))
        if made is None:
            raise SymdynError(f"Pinocchio could not build the model on CasADi's symbols: {message.value.decode()}")
        return casadi.Function.deserialize(made.decode())
