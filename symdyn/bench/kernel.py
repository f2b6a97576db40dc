"""Times one compiled evaluation of a right-hand side, in a C loop in which each evaluation waits for the one before."""

from __future__ import annotations

import ctypes
import time as clock

import numpy as np

from symdyn.formulation.equations import Equations
from symdyn.pipeline import emit
from symdyn.runtime import cache
from symdyn.runtime.compiler import require_compiler
from symdyn.runtime.unit import CUnit

_LOOP = """
SYMDYN_EXPORT void {name}_loop(long n, {name}_frame *frame, double *x);
SYMDYN_EXPORT void {name}_loop(long n, {name}_frame *frame, double *x)
{{
    const double start = x[0];
    for (long i = 0; i < n; i++) {{
        {name}_rhs({call});
        x[0] = start + 1e-9 * frame->out[{last}];
    }}
}}
"""


def evaluation_time(equations: Equations, loops: int = 20_000, repeats: int = 30) -> float:
    """Seconds of one evaluation, the best of several loops; q[0] of each depends on the result before, so latency counts."""
    source = emit(equations, "c", ("rhs",), standalone=False, integrator=False)
    metadata = source.metadata
    function = source.program.functions[0]
    sizes = metadata["sizes"]
    places = {"t": "frame->t[0]", "q": "x", "u": f"x + {sizes['q']}", "z": f"x + {sizes['q'] + sizes['u']}",
              "inputs": "frame->inputs", "p": "frame->p", "c": "frame->c"}
    call = ", ".join([*[places[g] for g in function.arguments], "frame->out"])
    text = next(iter(source.files.values())) + _LOOP.format(name=metadata["name"], call=call, last=sizes["x"] - 1)
    unit = CUnit(text, metadata, require_compiler())
    evaluator = unit.evaluator("rhs")
    evaluator.set_params(np.array([0.5 + 0.01 * k if v is None else v for k, v in enumerate(metadata["defaults"])]))
    evaluator.x[:] = 0.1 + 0.01 * np.arange(sizes["x"])
    loop = unit.function("loop")
    best = np.inf
    for _ in range(repeats):
        begun = clock.perf_counter()
        loop(ctypes.c_long(loops), ctypes.byref(evaluator.frame), ctypes.c_void_p(evaluator.x.ctypes.data))
        best = min(best, clock.perf_counter() - begun)
    return float(best / loops)


def compile_time(equations: Equations) -> float:
    """Seconds that the compiler takes for a right-hand side with its integrator, nothing cached; the best of three."""
    source = emit(equations, "c", ("rhs",), standalone=False)
    best = np.inf
    for _ in range(3):
        text = next(iter(source.files.values())) + f"// measured at {clock.time_ns()}\n"
        begun = clock.perf_counter()
        cache.build(text, f"{source.metadata['name']}-bench", require_compiler()).unlink()
        best = min(best, clock.perf_counter() - begun)
    return float(best)
