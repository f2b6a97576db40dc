"""SUNDIALS' integrators in the libraries of scikit-sundae's wheel, called without Python in their loops.

scikit-sundae calls Python for every evaluation, which takes longer than the evaluation; the same libraries take our compiled
functions as they are. Source: Hindmarsh et al., SUNDIALS, ACM Trans. Math. Softw. 31 (2005).
"""

from __future__ import annotations

import ctypes
import importlib.util
import time as clock
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from symdyn.bench import toolchain
from symdyn.bench.work.against.peer import LONGEST, Failed, Unfit
from symdyn.bench.work.against.walk import constant_inputs
from symdyn.errors import CompilerNotFound
from symdyn.pipeline import emit
from symdyn.runtime.building.compiler import require_compiler
from symdyn.runtime.building.library import CLibrary, Frame

INSTALL = "scikit-sundae is not installed; run: pip install 'symdyn[peers]'"
_PARTS = ("core", "nvecserial", "sunmatrixdense", "sunlinsoldense", "cvode", "ida")
MANY_STEPS = 10**6

# Functions that SUNDIALS calls: its vectors and matrices are opaque, and the functions that open them are given along. A positive
# result asks for a smaller step.
_HEAD = """
typedef struct {{
    {name}_frame *frame;
    double *(*entries)(void *vector);
    double **(*columns)(void *matrix);
}} {name}_given;
"""
_RHS = """
SYMDYN_EXPORT int {name}_sundials_rhs(double t, void *y, void *yd, void *user);
SYMDYN_EXPORT int {name}_sundials_rhs(double t, void *y, void *yd, void *user)
{{
    const {name}_given *given = user;
    const {name}_frame *frame = given->frame;
    const double *x = given->entries(y);
    return {name}_rhs({rhs}, given->entries(yd)) != 0;
}}
"""
_JACOBIAN = """
SYMDYN_EXPORT int {name}_sundials_jacobian(double t, void *y, void *yd, void *matrix, void *user, void *a, void *b, void *c);
SYMDYN_EXPORT int {name}_sundials_jacobian(double t, void *y, void *yd, void *matrix, void *user, void *a, void *b, void *c)
{{
    const {name}_given *given = user;
    const {name}_frame *frame = given->frame;
    const double *x = given->entries(y);
    double **columns = given->columns(matrix), *out = frame->out;
    (void)yd;
    (void)a;
    (void)b;
    (void)c;
    if ({name}_jacobian_x({jacobian_x}, out)) return 1;
    for (long i = 0; i < {n}; i++)
        for (long j = 0; j < {n}; j++) columns[j][i] = out[i * {n} + j];
    return 0;
}}
"""
_RESIDUAL = """
SYMDYN_EXPORT int {name}_sundials_residual(double t, void *y, void *yd, void *r, void *user);
SYMDYN_EXPORT int {name}_sundials_residual(double t, void *y, void *yd, void *r, void *user)
{{
    const {name}_given *given = user;
    const {name}_frame *frame = given->frame;
    const double *x = given->entries(y), *rates = given->entries(yd);
    return {name}_residual({residual}, given->entries(r)) != 0;
}}

SYMDYN_EXPORT int {name}_sundials_slopes(double t, double shift, void *y, void *yd, void *r, void *matrix, void *user, void *a,
                                         void *b, void *c);
SYMDYN_EXPORT int {name}_sundials_slopes(double t, double shift, void *y, void *yd, void *r, void *matrix, void *user, void *a,
                                         void *b, void *c)
{{
    const {name}_given *given = user;
    const {name}_frame *frame = given->frame;
    const double *x = given->entries(y), *rates = given->entries(yd);
    double **columns = given->columns(matrix), *by_rates = frame->out, *by_x = frame->out + {n} * {n};
    (void)r;
    (void)a;
    (void)b;
    (void)c;
    if ({name}_residual_rates({residual_rates}, by_rates)) return 1;
    if ({name}_residual_x({residual_x}, by_x)) return 1;
    for (long i = 0; i < {n}; i++)
        for (long j = 0; j < {n}; j++)
            columns[j][i] = shift * by_rates[i * {n} + j] + (j < {n_x} ? by_x[i * {n_x} + j] : 0);
    return 0;
}}
"""
_TEXTS = {"rhs": _RHS, "jacobian_x": _JACOBIAN, "residual": _RESIDUAL, "residual_x": "", "residual_rates": ""}


def installed() -> bool | str:
    """True, or what to install."""
    if importlib.util.find_spec("sksundae") is None:
        return INSTALL
    try:
        _libraries()
        require_compiler()
    except (Unfit, CompilerNotFound) as error:
        return str(error)
    return True


def version() -> str:
    """Version of the wheel."""
    return toolchain.version("scikit-sundae")


def _libraries() -> dict[str, Path]:
    """part -> library, in the order in which they are loaded."""
    spec = importlib.util.find_spec("sksundae")
    assert spec is not None and spec.origin is not None
    folder = Path(spec.origin).parent
    places = [folder.parent / "scikit_sundae.libs", folder / ".dylibs", *folder.parents[2].glob("lib")]
    result = {part: path for part in _PARTS for index in places for path in sorted(index.glob(f"libsundials_{part}[-.]*"))[:1]}
    missing = [part for part in _PARTS if part not in result]
    if missing:
        raise Unfit(f"the libraries libsundials_{missing[0]} and so on were not found next to scikit-sundae; take its wheel: "
                    "pip install scikit-sundae")
    return result


class _Given(ctypes.Structure):
    """Arguments of a callback; see _HEAD."""

    _fields_ = [("frame", ctypes.c_void_p), ("entries", ctypes.c_void_p), ("columns", ctypes.c_void_p)]


class Sundials:
    """The libraries, a context, and the compiled functions of equations; all objects live as long as this does.

    functions   of the module, whose callbacks are wanted; params (n_p,)
    """

    def __init__(self, equations: Any, functions: Sequence[str], params: np.ndarray) -> None:
        self.parts = {part: ctypes.CDLL(str(path)) for part, path in _libraries().items()}
        context = ctypes.c_void_p()
        self("core", "SUNContext_Create", ctypes.c_int(0), ctypes.byref(context))
        self.context = context
        self("core", "SUNContext_ClearErrHandlers", context)
        self._compile(equations, functions, params)

    def _compile(self, equations: Any, functions: Sequence[str], params: np.ndarray) -> None:
        source = emit(equations, "c", functions, standalone=False, integrator=False)
        sizes = source.metadata.sizes
        places = {"t": "t", "q": "x", "u": f"x + {sizes.q}", "z": f"x + {sizes.q + sizes.u}", "ud": "rates",
                  "inputs": "frame->inputs", "p": "frame->p", "c": "frame->c"}
        calls = {f.name: ", ".join(places[g] for g in f.arguments) for f in source.program.functions}
        n = source.metadata.shapes[functions[0]][0]
        text = next(iter(source.files.values())) + "".join(_TEXTS[f] if k else _HEAD + _TEXTS[f] for k, f in enumerate(
            functions)).format(name=source.metadata.name, n=n, n_x=sizes.x, **calls)
        self.library = CLibrary(text, source.metadata, require_compiler())
        self.p, self.c = np.zeros(max(1, sizes.p)), np.zeros(max(1, source.metadata.n_c))
        self.p[:len(params)] = params
        self.library.prologue(self.p, self.c)
        self.inputs = np.array([*constant_inputs(equations).values(), 0.0])
        self.out = np.zeros(2 * n * n)
        self.frame = Frame()
        self.frame.p, self.frame.c, self.frame.inputs, self.frame.out = (
            a.ctypes.data for a in (self.p, self.c, self.inputs, self.out))
        address = lambda part, name: ctypes.cast(getattr(self.parts[part], name), ctypes.c_void_p)
        self.given = _Given(ctypes.addressof(self.frame), address("core", "N_VGetArrayPointer"),
                            address("sunmatrixdense", "SUNDenseMatrix_Cols"))

    def __call__(self, part: str, name: str, *args: Any, made: bool = False) -> Any:
        """Call a function of a library; `made`: it gives an object. Raises Failed if it does not succeed."""
        function = getattr(self.parts[part], name)
        function.restype = ctypes.c_void_p if made else ctypes.c_int
        result = function(*[ctypes.c_double(a) if isinstance(a, float) else ctypes.c_long(a) if isinstance(a, int) else a
                            for a in args])
        if made and result is None:
            raise Failed(f"{name} of SUNDIALS gave nothing")
        if not made and result < 0:
            raise Failed(f"{name} of SUNDIALS failed with {result}")
        return ctypes.c_void_p(result) if made else result

    def callback(self, name: str) -> Any:
        """The address of a compiled callback."""
        return ctypes.cast(self.library.function(f"sundials_{name}"), ctypes.c_void_p)

    def vector(self, values: np.ndarray) -> Any:
        """A vector on the memory of values (n,), which must stay."""
        return self("nvecserial", "N_VMake_Serial", len(values), ctypes.c_void_p(values.ctypes.data), self.context, made=True)

    def solve_linear(self, part: str, name: str, memory: Any, y: Any, n: int) -> list[tuple[str, str, Any]]:
        """Give an integrator the dense linear solver; returns what is to be freed."""
        matrix = self("sunmatrixdense", "SUNDenseMatrix", n, n, self.context, made=True)
        solver = self("sunlinsoldense", "SUNLinSol_Dense", y, matrix, self.context, made=True)
        self(part, name, memory, solver, matrix)
        return [("core", "SUNLinSolFree", solver), ("core", "SUNMatDestroy", matrix)]

    def between(self, part: str, name: str, memory: Any, at: tuple[np.ndarray, Any], step: Callable[[], Any],
                times: np.ndarray) -> np.ndarray:
        """States (n_t, n) at times, from what an integrator gives between its steps.

        at   state and time, changed by step, which makes one step
        """
        (x, t), result = at, np.zeros((len(times), len(at[0])))
        row, k = np.zeros(len(x)), 0
        y, last = self.vector(row), clock.perf_counter() + LONGEST
        try:
            while k < len(times):
                if clock.perf_counter() > last:
                    raise Failed(f"it is at t = {t.value:.6g} s after {LONGEST:g} s")
                step()
                while k < len(times) and times[k] <= t.value:
                    self(part, name, memory, float(times[k]), 0, y)
                    result[k], k = row, k + 1
        finally:
            self("core", "N_VDestroy", y)
        return result

    def count(self, part: str, name: str, memory: Any) -> int:
        """One of an integrator's counters."""
        value = ctypes.c_long()
        self(part, name, memory, ctypes.byref(value))
        return value.value

    def free(self, part: str, name: str, memory: Any, objects: Sequence[tuple[str, str, Any]]) -> None:
        """Free an integrator and what it used."""
        function = getattr(self.parts[part], name)
        function.restype = None
        function(ctypes.byref(memory))
        for where, how, what in objects:
            function = getattr(self.parts[where], how)
            function.restype = None
            function(what)

    def __del__(self) -> None:
        if getattr(self, "context", None):
            self("core", "SUNContext_Free", ctypes.byref(self.context))
