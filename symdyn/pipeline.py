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
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import IO, Any

from symdyn import kinds
from symdyn.arguments import some
from symdyn.backend.methods import method_of
from symdyn.backend.right_side import METHOD, RightSide
from symdyn.backend.source import Source, render
from symdyn.collector import collector_paused
from symdyn.errors import SymdynError
from symdyn.formulation.equations import Equations
from symdyn.functions import groups
from symdyn.functions.content import content_of, module_metadata
from symdyn.runtime.building.compiler import find_compiler, no_compiler_reason, plain, require_compiler
from symdyn.runtime.building.library import CUnit, PythonUnit, Unit
from symdyn.runtime.building.stored import write_whole
from symdyn.runtime.module import Module
from symdyn.runtime.paths import as_path
from symdyn.shown import shown


def emit(equations: Equations, backend: str, functions: Sequence[str] | None = None,
         templates: str | os.PathLike | None = None, standalone: bool = True, integrator: bool = True,
         specialize: Mapping[Any, float] | None = None, work: bool = False, baumgarte: bool = False,
         batch: bool = False, method: str = METHOD, states: int = 2) -> Source:
    """The source of the named functions (default: the standard ones, those the formulation has) in a backend.

    specialize   parameters, by symbol or name, that become numbers in the code and are folded
    work         rhs gets one more state at the end: the work of all loads but gravity and springs
    baumgarte    rhs is stabilized by Baumgarte's method, with one more parameter at the end: its gain, 1/s
    batch        C only: also rhs and integrator of many states at once, a state in each SIMD lane
    method       C only: the integrator's, one of symdyn.backend.methods.METHODS; what it needs besides rhs is emitted with it
    states       how many random states the reference vectors of a standalone source begin with

    Raises SymdynError for an unknown function, parameter, backend, method or a broken template.
    """
    if standalone and equations.again is not None:
        equations = equations.again()
    bound = some(specialize, [p.name for p in equations.symbols.parameters], "specialize", equations.name)
    kinds.text(backend, f"{equations.name}: the backend", "c")
    method_of(method)
    if templates is not None:
        as_path(templates, "of the templates", "my_templates")
    names = groups.written(equations, functions, method if integrator and backend == "c" else None)
    with collector_paused():
        content = content_of(equations, names, standalone, bound, RightSide(work, baumgarte, method))
        return render(content, backend, templates, standalone, integrator, batch, method, states)


def compile_equations(equations: Equations, backend: str | None = None, templates: str | os.PathLike | None = None,
                      specialize: Mapping[Any, float] | None = None) -> Module:
    """A numeric module from equations.

    backend      "c", "numpy", or None: C if a compiler is found, else NumPy, and `module.fallback` says why
    templates    folder whose templates take precedence
    specialize   parameters, by symbol or name, that become numbers in the code and are folded

    Only what is called is generated: rhs with the integrator first, every other function when it is first used.
    Raises CompilerNotFound if C is asked for and there is no compiler, CompileError if it rejects the code.
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

    def source_of(what: str | RightSide) -> Source:
        if isinstance(what, RightSide):
            return emit(equations, backend, groups.of_right_side(equations, what), templates, standalone=False,
                        specialize=specialize, work=what.work, baumgarte=what.baumgarte, method=what.method)
        return emit(equations, backend, groups.with_function(equations, what), templates, standalone=False,
                    specialize=specialize, batch=what == groups.BATCH)

    rhs = source_of(RightSide())

    def provide(what: str | RightSide) -> Unit:
        source = rhs if what == RightSide() else source_of(what)
        text = next(iter(source.files.values()))
        if backend == "c":
            assert compiler is not None
            seldom = isinstance(what, str) and groups.seldom_called(what)
            return CUnit(text, source.metadata, plain(compiler) if seldom else compiler)
        return PythonUnit.from_source(text, source.metadata.name)

    def write(folder: Path) -> list[Path]:
        return write_source(emit(equations, backend, templates=templates, specialize=specialize), folder)

    def report() -> Any:
        from symdyn.report.text import report as make

        return make(equations, backend, fallback)

    return Module(module_metadata(equations, rhs.metadata), provide, backend, fallback, write, report)


def write_source(source: Source, folder: Path) -> list[Path]:
    """Write the files of a source into a folder (made if absent), each in one step, so that programs and threads that read or
    write them at the same time have whole ones; returns their paths."""
    folder.mkdir(parents=True, exist_ok=True)
    paths = []
    for name, text in source.files.items():
        path = folder / name
        write_whole(path, partial(_put, text.encode()), sync=False)
        paths.append(path)
    return paths


def _put(content: bytes, file: IO[bytes]) -> None:
    file.write(content)
