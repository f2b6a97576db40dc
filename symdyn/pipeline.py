"""The pipeline, once.

    stage         takes in                          gives out
    describe      bodies, joints, loads             System          (symdyn.model)
    check         System                            Model           frozen, every fault reported at once
    formulate     Model                             Equations       (symdyn.formulation) quantities on a tape
    choose        Equations, function names         Content         (symdyn.functions) tapes, names and records
    emit          Content                           Source          (symdyn.backend) text of files
    load          Source                            Module          (symdyn.runtime) evaluate, simulate
"""

from __future__ import annotations

import os
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from symdyn.emission import emit, rolling, write_source
from symdyn.errors import SymdynError
from symdyn.formulation.equations import Equations
from symdyn.functions.content import module_metadata
from symdyn.libraries import Libraries
from symdyn.runtime.building.compiler import find_compiler, no_compiler_reason, require_compiler
from symdyn.runtime.module import Module
from symdyn.runtime.paths import as_path
from symdyn.shown import shown

if TYPE_CHECKING:
    from symdyn.given import Rolling

__all__ = ["compile_equations", "emit", "write_source"]


def compile_equations(equations: Equations, backend: str | None = None, templates: str | os.PathLike | None = None,
                      specialize: Mapping[Any, float] | None = None, rolled: Rolling = "auto") -> Module:
    """A numeric module from equations.

    backend      "c", "numpy", or None: C if a compiler is found, else NumPy, and `module.fallback` says why
    templates    folder whose templates take precedence
    specialize   parameters, by symbol or name, that become numbers in the code and are folded
    rolled       C only: whether statements that like bodies repeat become loops: "auto" where they are many, True, False

    Only what is called is generated: rhs with the integrator first, every other function when it is first used.
    Raises CompilerNotFound if C is requested and there is no compiler, CompileError if it rejects the code.
    """
    fallback = ""
    if templates is not None:
        as_path(templates, "of the templates", "my_templates")
    compiler = require_compiler() if isinstance(backend, str) and backend == "c" else find_compiler() if backend is None else None
    if backend is None:
        backend = "c" if compiler is not None else "numpy"
        fallback = "" if compiler is not None else no_compiler_reason()
    if not isinstance(backend, str) or backend not in ("c", "numpy"):
        raise SymdynError(f"backend {shown(backend)} asked for; modules can be loaded from 'c' and 'numpy'; "
                          "emit() writes source for others")

    libraries = Libraries(equations.again, backend, templates, specialize, fallback, equations, rolled=rolling(rolled))
    return Module(module_metadata(equations, libraries.rhs.metadata), libraries, backend, fallback, libraries.write,
                  libraries.report)
