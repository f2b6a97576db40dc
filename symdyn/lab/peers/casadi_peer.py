"""CasADi's C code for Pinocchio's articulated-body algorithm."""

from __future__ import annotations

import ctypes
from typing import Any

from symdyn.bench.toolchain import build_cpp, c_compiler, include_flags, package_folder
from symdyn.errors import SymdynError
from symdyn.lab.peers.casadi_loop import Form, casadi_program, hoisted, operations
from symdyn.lab.peers.description import Description
from symdyn.lab.peers.program import Program, State, address
from symdyn.lab.peers.sources import SOURCES

_ERROR_SIZE = 1000


class CasadiPeer:
    """The generator. Raises MissingExtra, CompilerNotFound or CompileError, whose messages tell what to install."""

    def __init__(self) -> None:
        folder = package_folder("casadi")
        self.compiler = c_compiler()
        libraries = [root for root in (folder, *[p / "lib" for p in folder.parents[:4]]) if (root / "libcasadi.so").exists()]
        if not libraries:
            raise SymdynError(f"the library libcasadi.so was not found next to the package {folder}; install symdyn[peers]")
        import casadi

        self.casadi = casadi
        text = "".join(["#include <pinocchio/autodiff/casadi.hpp>\n", *[
            (SOURCES / name).read_text(encoding="utf-8") for name in ("model.hpp", "casadi_aba.cpp")]])
        options = ["-O0", "-DBOOST_VARIANT_USE_RELAXED_GET_BY_DEFAULT", *include_flags("pinocchio", "boost", "eigen", "casadi"),
                   "-Wl,--no-as-needed", f"-L{libraries[0]}", "-lcasadi", f"-Wl,-rpath,{libraries[0]}"]
        self.library = build_cpp("casadi_aba", text, options, ("pin", "casadi"))
        self.library.casadi_aba.restype = ctypes.c_char_p

    def forms(self, description: Description) -> list[Form]:
        """baked: parameters are numbers; runtime: arguments; hoisted: what depends on them alone is computed before."""
        ca = self.casadi
        baked, runtime = self._function(description, 0), self._function(description, 1)
        return [Form("casadi baked", baked, None, operations(ca, baked)),
                Form("casadi runtime", runtime, None, operations(ca, runtime)), hoisted(ca, "casadi hoisted", runtime)]

    def _function(self, description: Description, runtime: int) -> Any:
        message = ctypes.create_string_buffer(_ERROR_SIZE)
        values = description.values
        text = self.library.casadi_aba(description.text.encode(), address(values), ctypes.c_long(len(values)), runtime, message,
                                       ctypes.c_long(_ERROR_SIZE))
        if text is None:
            raise SymdynError(f"CasADi could not build the model: {message.value.decode()}")
        function = self.casadi.Function.deserialize(text.decode())
        # What CasADi offers to make code shorter is used.
        return self.casadi.Function("accelerations", function.sx_in(), [function(*function.sx_in())], {"cse": True})

    def program(self, form: Form, description: Description, state: State) -> Program:
        """The C code of a form, compiled, at a state."""
        return casadi_program(self.casadi, self.compiler, form, state, description.values, description.q_order,
                                 description.u_order)
