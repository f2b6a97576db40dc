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
from collections.abc import Callable, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import IO, Any

from symdyn import kinds
from symdyn.backend.methods import method_of
from symdyn.backend.right_side import METHOD, RightSide
from symdyn.backend.source import Source, render
from symdyn.collector import collector_paused
from symdyn.errors import SymdynError
from symdyn.formulation.equations import Equations
from symdyn.formulation.event_bounds import BOUNDS, RANGES, bound_names, enclosed, event_bounds, event_leaves, unknowns, unproved
from symdyn.formulation.linearization import multiplier_names, variation_names
from symdyn.formulation.skipped import skipped
from symdyn.model.symbols import GivenMotion
from symdyn.runtime.arguments import some
from symdyn.runtime.compiler import find_compiler, no_compiler_reason, plain, require_compiler
from symdyn.runtime.module import Module
from symdyn.runtime.paths import as_path
from symdyn.runtime.stored import write_whole
from symdyn.runtime.unit import CUnit, PythonUnit, Unit
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


def output_shapes(equations: Equations) -> list[list[Any]]:
    """Names and shapes of the user's outputs."""
    return [[q.removeprefix("output_"), list(equations.quantity(q).shape)]
            for q in equations.quantities if q.startswith("output_")]


def event_records(equations: Equations) -> list[dict[str, Any]]:
    """Events as plain data: name, direction, whether it ends the motion, entries of x = [q; u; z] that it resets; whether it can
    be enclosed, and else why pulses may be missed; which inputs and functions of the user its value depends on."""
    symbols = equations.symbols
    places = {s: k for k, s in enumerate((*symbols.coordinates, *symbols.speeds, *symbols.states))}
    about = zip(equations.events, enclosed(equations), unproved(equations), unknowns(equations), strict=True)
    return [{"name": e.name, "direction": e.direction, "stop": e.stop, "reset": [places[s] for s, _ in e.reset],
             "enclosed": can, "unproved": why, "inputs": inputs, "functions": functions}
            for e, can, why, (inputs, functions) in about]


def _content(equations: Equations, names: Sequence[str], standalone: bool, bound: Mapping[str, float],
             work: bool, baumgarte: bool) -> Content:
    symbols = equations.symbols
    tapes = _tapes(equations, names, work, baumgarte)
    if equations.otherwise is not None:
        there = _tapes(equations.otherwise, names, work, baumgarte)
        differ = {n: t for n, t in there.items() if _entries(t) != _entries(tapes[n])}
        tapes |= {f"{n} otherwise": t for n, t in differ.items()}
    if bound:
        tapes = _together(tapes, lambda whole: specialize_tape(whole, bound))
    tapes = _together(tapes, balance)
    otherwise = {n: tapes.pop(f"{n} otherwise") for n in names if f"{n} otherwise" in tapes}
    groups = {"q": [s.name for s in symbols.coordinates], "u": [s.name for s in symbols.speeds],
              "z": [*[s.name for s in symbols.states], *[WORK] * work], "ud": _given_rates(equations, names),
              "inputs": [s.name for s in symbols.inputs],
              "p": [*[s.name for s in symbols.parameters if s.name not in bound], *[BAUMGARTE] * baumgarte]}
    outputs = [(n, tuple(shape)) for n, shape in output_shapes(equations)] if "outputs" in names else []
    told = {**{n: title for n, (_, title) in FUNCTIONS.items()}, **STATICS, **VARIATIONS, **DERIVATIVES}
    cut = OF_THE_CUT_TREE if equations.constraints else {}
    titles = {n: told.get(n, n) + cut.get(n, "") for n in names}
    return Content(equations.name, equations.formulation, tapes, titles, groups,
                   {s.name: unit for s, unit in symbols.units.items()}, _by_name(symbols.defaults),
                   _by_name(symbols.initial), outputs, skipped(equations) if standalone else (),
                   [[q.name for q in group] for group in equations.unit_groups], otherwise,
                   event_records(equations) if "events" in names else (), event_leaves(equations) if BOUNDS in names else ())


def _tapes(equations: Equations, names: Sequence[str], work: bool, baumgarte: bool) -> dict[str, Tape]:
    """The tapes of functions; of rhs and its derivative by x with the variations asked for."""
    tapes = {name: tape_as_derived(equations, name) for name in names}
    if work or baumgarte:
        field = equations.quantity("rhs_baumgarte" if baumgarte else "rhs")
        if work:
            field = np.concatenate([field, equations.quantity("power").reshape(1)])
        tapes["rhs"] = Tape.of(equations.recorder, rhs=field)
    if (work or baumgarte) and "jacobian_x" in names:
        by_x = equations.quantity("jacobian_x_baumgarte" if baumgarte else "jacobian_x")
        if work:  # nothing depends on the work
            by_x = np.vstack([by_x, equations.quantity("power_x").reshape(1, -1)])
            by_x = np.column_stack([by_x, np.zeros(len(by_x), dtype=object)])
        tapes["jacobian_x"] = Tape.of(equations.recorder, jacobian_x=by_x)
    return tapes


def _entries(tape: Tape) -> tuple[Any, ...]:
    return next(iter(tape.outputs.values())).entries


def _given_rates(equations: Equations, names: Sequence[str]) -> list[str]:
    """What stands in the group ud: accelerations; for the balance also multipliers, for its variations what they are along;
    for the residual the rates of the coordinates, too, and multipliers."""
    symbols, n_c = equations.symbols, len(equations.constraints)
    if BOUNDS in names:
        return bound_names(event_leaves(equations))
    if "residual" in names:
        return residual_names(symbols.coordinates, symbols.speeds, symbols.states, n_c)
    given = [f"{s.name}_dot" for s in symbols.speeds]
    if any(n in STATICS or n in VARIATIONS or n in DERIVATIVES for n in names):
        given += multiplier_names(n_c)
    if any(n in VARIATIONS for n in names):
        given += variation_names(symbols, n_c, "second_variation" in names)
    return given


def switches(equations: Equations) -> list[Jump]:
    """Where the right-hand side may jump along a motion."""
    return jumps(equations.recorder, equations.quantity("rhs").tolist())


def function_tape(equations: Equations, name: str) -> Tape:
    """The tape behind a function of a module, as it is emitted."""
    return balance(tape_as_derived(equations, name))


def tape_as_derived(equations: Equations, name: str) -> Tape:
    """The quantities that a function of a module returns."""
    if name == "switches":
        surfaces = np.array([jump.surface for jump in switches(equations)], dtype=object)
        return Tape(equations.recorder, {name: Output.of(name, surfaces)})
    if name in (BOUNDS, RANGES):
        return event_bounds(equations, name)
    if name != "outputs":
        return equations.tape(_quantity(name))
    values = [equations.quantity(q).ravel() for q in equations.quantities if q.startswith("output_")]
    whole = np.concatenate(values) if values else np.zeros(0, dtype=object)
    return Tape(equations.recorder, {"outputs": Output.of("outputs", whole)})


def _together(tapes: Mapping[str, Tape], change: Callable[[Tape], Tape]) -> dict[str, Tape]:
    """A pass over all functions' tapes as one, so that they still share their steps."""
    recorder = next(iter(tapes.values())).recorder
    whole = change(Tape(recorder, {n: next(iter(t.outputs.values())) for n, t in tapes.items()}))
    return {n: whole.prune((n,)) for n in tapes}


def _by_name(values: Any) -> dict[str, float]:
    return {name_of(key): float(value) for key, value in values.items()}


