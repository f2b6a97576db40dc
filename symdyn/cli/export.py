"""`symdyn export`: a mechanism for other libraries and languages."""

from __future__ import annotations

import argparse
from pathlib import Path

from symdyn.cli.find import find_equations
from symdyn.cli.messages import WRONG, Stop

# Option -> the library, and what is written.
LIBRARIES = {"casadi": "casadi.Function objects: NAME_casadi.py", "jax": "functions for jit, vmap, grad: NAME_jax.py",
             "torch": "functions for PyTorch: NAME_torch.py"}
LANGUAGES = {"fortran": "a module of Fortran 2008: NAME.f90", "julia": "a module of Julia: NAME.jl",
             "matlab": "a function of MATLAB and Octave: NAME.m", "rust": "a module of Rust: NAME.rs"}
TARGETS = {**LIBRARIES, **LANGUAGES}
# Options that write more than functions.
OTHERS = ("modelica", "fmu", "cmake")


def export(arguments: argparse.Namespace) -> int:
    """Write files for every library and language that was requested, a Modelica model, an FMU, a CMake package."""
    wanted = [target for target in TARGETS if getattr(arguments, target)]
    if not wanted and not any(getattr(arguments, other) for other in OTHERS):
        raise Stop(f"nothing to export: pass one of {', '.join(f'--{target}' for target in (*TARGETS, *OTHERS))}", WRONG)
    from symdyn.pipeline import emit, write_source
    from symdyn.targets.text import source_for

    equations = find_equations(arguments)
    if arguments.modelica:
        module = equations.compile(backend="numpy")
        for path in module.to_modelica(arguments.output or Path("generated") / module.name):
            print(f"wrote {path}")
    if arguments.fmu:
        module = equations.compile(backend="numpy")
        path = (arguments.output or Path("generated") / module.name) / f"{module.name}.fmu"
        print(f"wrote {module.to_fmu(path, arguments.fmi, arguments.kind)}")
    if arguments.cmake:
        for path in equations.to_cmake(arguments.output or Path("generated") / equations.name, arguments.jacobians):
            print(f"wrote {path}")
    for target in wanted:
        source = (emit(equations, target, arguments.functions) if target in LANGUAGES else
                  source_for(equations, target, arguments.functions))
        for path in write_source(source, arguments.output or Path("generated") / source.metadata.name):
            print(f"wrote {path}")
    return 0


def add_export(parser: argparse.ArgumentParser) -> None:
    """The options of the command."""
    for target, text in TARGETS.items():
        parser.add_argument(f"--{target}", action="store_true", help=f"{text}; it needs symdyn no more")
    parser.add_argument("--modelica", action="store_true",
                        help="a Modelica model with parameters, inputs, outputs and events as flat equations: NAME.mo")
    parser.add_argument("--fmu", action="store_true", help="an FMU for programs that import FMI, with its sources: NAME.fmu")
    parser.add_argument("--fmi", type=int, choices=(3, 2), default=3, help="version of FMI (default: 3)")
    parser.add_argument("--kind", choices=("co_simulation", "model_exchange"), default="co_simulation",
                        help="of the FMU: with the integrator inside, or for the importer's (default: co_simulation)")
    parser.add_argument("--cmake", action="store_true", help="a CMake package for firmware and C++17, float or double")
    parser.add_argument("--jacobians", action="store_true", help="exact derivatives in the CMake package, too")
    parser.add_argument("--functions", metavar="NAME", nargs="+",
                        help="what to write for libraries and languages (default: rhs, mass_matrix, ...)")
