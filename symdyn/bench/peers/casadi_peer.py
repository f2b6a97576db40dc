"""CasADi's C code for Pinocchio's articulated-body algorithm."""

from __future__ import annotations

import ctypes
from dataclasses import dataclass
from typing import Any

import numpy as np

from symdyn.bench.peers.contestant import Contestant, State, address, unsorted
from symdyn.bench.peers.description import Description
from symdyn.bench.peers.toolchain import SOURCES, build_cpp, c_compiler, include_flags, package_folder
from symdyn.errors import SymdynError
from symdyn.runtime import cache

_ERROR_SIZE = 1000
_LOOP = """
CASADI_SYMBOL_EXPORT void prepare(const double *p, double *c)
{{
    const double *arg[{sz_arg}] = {{p}};
    double *res[{sz_res}] = {{c}}, w[{sz_w}];
    casadi_int iw[{sz_iw}];
    {prologue}
}}

CASADI_SYMBOL_EXPORT void loop(long n, long fed, double *q, const double *u, const double *p, const double *c, double *out)
{{
    const double *arg[{sz_arg}] = {{q, u, p, c}};
    double *res[{sz_res}] = {{out}}, w[{sz_w}];
    casadi_int iw[{sz_iw}];
    const double start = q[fed];
    for (long i = 0; i < n; i++) {{
        accelerations(arg, res, iw, w, 0);
        q[fed] = start + 1e-9 * out[{last}];
    }}
    q[fed] = start;
}}
"""


@dataclass(frozen=True)
class Form:
    """One of the ways in which CasADi can have the parameters.

    accelerations   CasADi function (q, u, p, c) -> u_dot; prologue (p) -> c, or None
    operations      that depend on q or u
    """

    name: str
    accelerations: Any
    prologue: Any
    operations: int


class CasadiPeer:
    """The generator. Raises MissingExtra, CompilerNotFound or CompileError, whose messages tell what to install."""

    def __init__(self) -> None:
        folder = package_folder("casadi")
        self.compiler = c_compiler()
        libraries = [root for root in (folder, *[p / "lib" for p in folder.parents[:4]]) if (root / "libcasadi.so").exists()]
        if not libraries:
            raise SymdynError(f"the library libcasadi.so was not found beside the package {folder}; install symdyn[peers]")
        import casadi

        self.casadi = casadi
        text = "".join(["#include <pinocchio/autodiff/casadi.hpp>\n", *[
            (SOURCES / name).read_text(encoding="utf-8") for name in ("model.hpp", "casadi_aba.cpp")]])
        options = ["-O0", *include_flags("pinocchio", "boost", "eigen", "casadi"), "-Wl,--no-as-needed", f"-L{libraries[0]}",
                   "-lcasadi", f"-Wl,-rpath,{libraries[0]}"]
        self.library = build_cpp("casadi_aba", text, options, ("pin", "casadi"))
        self.library.casadi_aba.restype = ctypes.c_char_p

    def forms(self, description: Description) -> list[Form]:
        """baked: parameters are numbers; runtime: arguments; hoisted: what depends on them alone is computed before."""
        ca = self.casadi
        baked, runtime = self._function(description, 0), self._function(description, 1)
        q, u, p = runtime.sx_in()
        rest, symbols, values = ca.extract_parametric(runtime(q, u, p), p)
        c = ca.vertcat(*symbols)
        hoisted = ca.Function("accelerations", [q, u, p, c], [rest])
        prologue = ca.Function("prologue", [p], [ca.vertcat(*values)])
        return [Form("casadi baked", baked, None, self.operations(baked)),
                Form("casadi runtime", runtime, None, self.operations(runtime)),
                Form("casadi hoisted", hoisted, prologue, self.operations(hoisted))]

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

    def operations(self, function: Any) -> int:
        """Operations that depend on q or u: one each for + - * / sqrt sin cos, changes of sign and copies free."""
        ca = self.casadi
        free = (ca.OP_NEG, ca.OP_ASSIGN)
        depends: dict[int, bool] = {}  # by place of the result; places are used again
        count = 0
        for k in range(function.n_instructions()):
            op, taken, given = function.instruction_id(k), function.instruction_input(k), function.instruction_output(k)
            if op == ca.OP_OUTPUT:
                continue
            if op == ca.OP_INPUT:
                depends[given[0]] = taken[0] < 2
            elif op == ca.OP_CONST:
                depends[given[0]] = False
            else:
                depends[given[0]] = any(depends[i] for i in taken)
                count += depends[given[0]] and op not in free
        return count

    def contestant(self, form: Form, description: Description, state: State) -> Contestant:
        """The C code of a form, compiled, at a state."""
        functions = [form.accelerations] + ([form.prologue] if form.prologue else [])
        generator = self.casadi.CodeGenerator("peer")
        for function in functions:
            generator.add(function)
        sizes = {f"sz_{what}": max(4, *[getattr(f, f"sz_{what}")() for f in functions]) for what in ("arg", "res", "iw", "w")}
        text = generator.dump() + _LOOP.format(**sizes, last=len(state.u) - 1,
                                               prologue="prologue(arg, res, iw, w, 0);" if form.prologue else "")
        library = cache.load(text, "casadi_peer", self.compiler)
        p = description.values
        c = np.zeros(max(1, form.prologue.numel_out(0) if form.prologue else 1))
        library.prepare(address(p), address(c))
        q, u = state.q[list(description.q_order)], state.u[list(description.u_order)]
        out, fed = np.zeros(len(u)), description.q_order.index(state.fed)

        def run(n: int) -> None:
            library.loop(ctypes.c_long(n), ctypes.c_long(fed), address(q), address(u), address(p), address(c), address(out))

        return Contestant(form.name, run, lambda: unsorted(out, description.u_order))
