"""FMUs: a mechanism for programs that import the Functional Mock-up Interface, with its sources and a binary for this platform.

Source: Modelica Association, Functional Mock-up Interface Specification 3.0, and version 2.0.4.
"""

from __future__ import annotations

import platform
import sys
import tempfile
import warnings
import zipfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

import symdyn
from symdyn.arguments import some
from symdyn.backend.metadata import ModuleMetadata
from symdyn.backend.right_side import RightSide
from symdyn.backend.source import CORRECTIONS, VIOLATION, Source, render, template_environment
from symdyn.collector import collector_paused
from symdyn.errors import ArgumentError, CompileError, CompilerWarning
from symdyn.folders import templates_folder
from symdyn.formulation.equations import Equations
from symdyn.formulation.names import derivative_of
from symdyn.functions import groups
from symdyn.functions.content import content_of
from symdyn.functions.tapes import all_columns_of, has_function
from symdyn.runtime.building.compiler import Compiler, find_compiler, flags, link_flags, no_compiler_reason
from symdyn.runtime.building.objects import run
from symdyn.runtime.module import Module
from symdyn.runtime.paths import as_path, writing
from symdyn.shown import shown
from symdyn.targets.fmu_context import Code, Description, Fmu, FmuContext, Start, Wrapped
from symdyn.targets.fmu_description import units_of, unknowns_of, variables_of
from symdyn.targets.start import equations_of, start_values
from symdyn.targets.text import differentiable
from symdyn.turning import turns

VERSIONS = (3, 2)
KINDS = ("model_exchange", "co_simulation")
# The tolerance of a step of co-simulation where the importer gives none.
TOLERANCE = 1e-9
# An FMU allocates memory and compares texts; the package of tcc brings neither the headers of libc nor the paths to them.
NO_HEADERS = ("the C compiler found is tcc, which does not find the headers of the C library; install gcc or clang, or set "
              "SYMDYN_CC to one of them")
_LIBRARY = ".dll" if sys.platform == "win32" else ".dylib" if sys.platform == "darwin" else ".so"
_MACHINES = {"amd64": "x86_64", "x64": "x86_64", "arm64": "aarch64", "i386": "x86", "i686": "x86"}
_SYSTEMS = {"win32": "windows", "darwin": "darwin"}
# Names of platforms in FMI 2.0; it has none for others, which take those of FMI 3.0.
_OF_VERSION_2 = {"x86_64-linux": "linux64", "x86-linux": "linux32", "x86_64-windows": "win64", "x86-windows": "win32",
                 "x86_64-darwin": "darwin64"}
# The same bytes for the same mechanism: files of an archive have a time.
_DATE = (1980, 1, 1, 0, 0, 0)


def write_fmu(module: Module, path: Any, version: int, kind: str, *, q: Any = None, u: Any = None, z: Any = None,
              params: Any = None, inputs: Any = None) -> Path:
    """See Module.to_fmu."""
    target = as_path(path, "of the FMU", "arm.fmu")
    if version not in VERSIONS or isinstance(version, bool):
        raise ArgumentError(f"{module.name}: an FMU of version {shown(version)} asked for; take one of 3 and 2")
    if not isinstance(kind, str) or kind not in KINDS:
        raise ArgumentError(f"{module.name}: an FMU of the kind {shown(kind)} asked for; take 'model_exchange' or "
                            "'co_simulation'")
    start = start_values(module, "an FMU", q, u, z, params, inputs)
    equations, specialize = equations_of(module, "an FMU")
    source, derivatives = source_of(equations, specialize)
    files = _files(module, source, version, kind, start, derivatives)
    compiler = find_compiler()
    missing = no_compiler_reason() if compiler is None else NO_HEADERS if compiler.kind == "tcc" else ""
    if compiler is None or missing:
        warnings.warn(f"{module.name}: {target} has sources and no binary: {missing}. Importers that compile sources take it "
                      "as it is", CompilerWarning, stacklevel=3)
    else:
        files |= _binary(module.name, source.metadata.name, files, version, compiler)
    with writing(target):
        target.parent.mkdir(parents=True, exist_ok=True)
        with zipfile.ZipFile(target, "w", zipfile.ZIP_DEFLATED) as archive:
            for name, content in files.items():
                entry = zipfile.ZipInfo(name, _DATE)
                entry.compress_type = zipfile.ZIP_DEFLATED
                entry.external_attr = 0o644 << 16
                archive.writestr(entry, content)
    return target


def source_of(equations: Equations, specialize: Mapping[Any, float] | None) -> tuple[Source, tuple[str, ...]]:
    """The C of a mechanism with what an FMU calls, and the names of its functions of derivatives: none where a function of the
    user has no derivative."""
    whole = equations.again() if equations.again is not None else equations
    bound = some(specialize, [p.name for p in whole.symbols.parameters], "specialize", whole.name)
    with collector_paused():
        names = [n for n in groups.of_right_side(whole, RightSide()) if n not in ("validity_checks", "switches")]
        names += [n for n in ("outputs", "energy") if has_function(whole, n)]
        by = {"x": True, "inputs": bool(whole.symbols.inputs), "params": len(whole.symbols.parameters) > 0 and not bound}
        matrices = [derivative_of(of, to) for of in ("rhs", "outputs", "energy") if of in names
                    for to, there in by.items() if there]
        wanted = [(of, to) for of in ("rhs", "outputs", "energy") if of in names for to, there in by.items() if there]
        if not all(differentiable(whole, of, to) for of, to in wanted):
            matrices = []
        content = content_of(whole, [*names, *matrices], True, bound, RightSide(), all_columns_of)
        return render(content, "c", only=("model.c.jinja", "model.h.jinja")), tuple(matrices)


def _files(module: Module, source: Source, version: int, kind: str, start: Mapping[str, np.ndarray],
           derivatives: Sequence[str]) -> dict[str, bytes]:
    """All files of the archive but the binary, by their paths."""
    context = _context(module, source, version, kind, start, derivatives)
    folder = templates_folder()
    environment = template_environment(folder / "fmu")

    def made(template: str) -> bytes:
        return environment.get_template(template).render(context.names()).encode()

    files = {"modelDescription.xml": made(f"fmi{version}.xml.jinja")}
    files |= {f"sources/{name}": content.encode() for name, content in source.files.items()}
    files["sources/fmu_model.h"] = made("model.h.jinja")
    files |= {f"sources/{name}": (folder / "fmu" / name).read_bytes() for name in ("instance.h", _entry(version))}
    if version == 3:
        files["sources/buildDescription.xml"] = made("build.xml.jinja")
    return files


def _context(module: Module, source: Source, version: int, kind: str, start: Mapping[str, np.ndarray],
             derivatives: Sequence[str]) -> FmuContext:
    metadata, of_code = module.metadata, source.metadata
    variables, at = variables_of(metadata, start)
    units, variables = units_of(variables)
    outputs, rates = unknowns_of(metadata, at, module.structure, of_code.arguments, of_code.shapes)
    constrained = all(n in of_code.shapes for n in CORRECTIONS)
    n_rows = of_code.shapes[VIOLATION][0] // 2 if constrained else 0
    text = next(iter(source.files.values()))
    fmu = Fmu(
        name=of_code.name, title=module.name,
        about=f"{metadata.formulation} equations of motion of {module.name}, {len(metadata.bodies)} bodies",
        version=symdyn.__version__, fmi=version, hash=text.split("Model hash ", 1)[1][:16], kind=kind,
        duration=repr(metadata.duration or 1.0), tolerance=repr(TOLERANCE), sources=(f"{of_code.name}.c", _entry(version)),
        math_library=sys.platform != "win32")
    description = Description(
        units=tuple(units), variables=tuple(variables), outputs=tuple(outputs), rates=tuple(rates),
        unknown=tuple(v.reference for v in variables if v.initial == "calculated" and not v.name.startswith("event.")),
        indicators=tuple(range(at.events, at.events + len(metadata.events))))
    code = Code(
        sizes=(("N_Q", len(metadata.q)), ("N_U", len(metadata.u)), ("N_X", at.n_x), ("N_INPUTS", at.n_inputs), ("N_P", at.n_p),
               ("N_C", of_code.n_c), ("N_OUTPUTS", at.n_outputs), ("N_EVENTS", len(metadata.events)), ("N_ROWS", n_rows)),
        start=Start(**{key: tuple(repr(float(v)) for v in values) for key, values in start.items()}),
        projects=constrained or bool(metadata.unit_groups), differentiable=bool(derivatives),
        by_parameters="jacobian_params" in derivatives, n_rows=n_rows,
        turning=tuple(turns(metadata.units.get(n)) for n in metadata.u),
        motions=tuple(tuple(metadata.inputs.index(f"{m}{suffix}") for suffix in ("", "_dot", "_ddot")) for m in metadata.motions),
        unit_groups=_padded(metadata), events=metadata.events,
        functions=tuple(_wrapped(of_code, metadata, at.n_outputs, derivatives)))
    return FmuContext(fmu, description, code)


def _entry(version: int) -> str:
    """The file with the functions of a version of the interface."""
    return f"fmi{version}.c"


def _padded(metadata: ModuleMetadata) -> tuple[tuple[int, ...], ...]:
    """Entries of x that form unit vectors, filled up with -1 to the same length."""
    longest = max((len(group) for group in metadata.unit_groups), default=0)
    return tuple((*(metadata.x.index(n) for n in group), *[-1] * (longest - len(group))) for group in metadata.unit_groups)


def _wrapped(of_code: Any, metadata: ModuleMetadata, n_outputs: int, derivatives: Sequence[str]) -> list[Wrapped]:
    n_q, n_u, n_x = len(metadata.q), len(metadata.u), len(metadata.x)
    state = {"q": "x", "u": f"x + {n_q}", "z": f"x + {n_q + n_u}"}

    def call(function: str, first: int = 0) -> str:
        arguments = [state.get(g, g) for g in of_code.arguments[function]]
        return f"{of_code.name}_{function}({', '.join([*arguments, f'out + {first}' if first else 'out'])})"

    computed = [n for n in ("outputs", "energy") if n in of_code.shapes]
    sizes = {n: int(np.prod(of_code.shapes[n])) for n in computed}
    result = [Wrapped("rhs", "x_dot", (call("rhs"),)),
              Wrapped("outputs", "Outputs, then energies.",
                      tuple(call(n, sum(sizes[m] for m in computed[:k])) for k, n in enumerate(computed)))]
    for by, n in (("x", n_x), ("inputs", len(metadata.inputs)), ("params", len(metadata.parameters))):
        calls, first = [], 0
        for of, size in (("rhs", n_x), *sizes.items()):
            name = derivative_of(of, by)
            if name in derivatives:
                calls.append(call(name, first))
            first += size * n
        result.append(Wrapped(f"by_{'p' if by == 'params' else by}",
                              f"Derivatives of x_dot, of outputs and energies by {by}, row by row.", tuple(calls)))
    result += [Wrapped(n, "", (call(n),)) for n in ("length", VIOLATION, "events") if n in of_code.shapes]
    return result


def _binary(owner: str, name: str, files: Mapping[str, bytes], version: int, compiler: Compiler) -> dict[str, bytes]:
    """The sources compiled for this platform, by the path in the archive. Raises CompileError."""
    machine = platform.machine().lower()
    tuple_ = f"{_MACHINES.get(machine, machine)}-{_SYSTEMS.get(sys.platform, 'linux')}"
    # For any processor of this kind, with the standard headers.
    chosen = ["-O2" if f == "-O3" else f for f in flags(compiler) if not f.startswith(("-march", "-mcpu", "-nostd"))]
    with tempfile.TemporaryDirectory(prefix="fmu-") as folder:
        for path, content in files.items():
            if path.endswith((".c", ".h")):
                (Path(folder) / Path(path).name).write_bytes(content)
        library = Path(folder) / f"{name}{_LIBRARY}"
        texts = [str(Path(folder) / Path(path).name) for path in files if path.endswith(".c")]
        command = [*compiler.command, "-o", str(library), *texts, *chosen, *link_flags(compiler)]
        fault, output = run(command, Path(folder))
        if fault or not library.is_file():
            raise CompileError(f"{owner}: {compiler.kind} ({compiler.version}) could not build the binary of the FMU: "
                               f"{fault or 'it wrote no library'}.\nCommand: {' '.join(command)}\nOutput:\n{output[:4000]}")
        there = _OF_VERSION_2.get(tuple_, tuple_) if version == 2 else tuple_
        return {f"binaries/{there}/{library.name}": library.read_bytes()}


