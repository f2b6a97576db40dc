"""`symdyn generate`: writes source files."""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from symdyn.cli.find import find_equations

if TYPE_CHECKING:
    from symdyn.formulation.printed.independent_speeds import MotionEquations


def generate(arguments: argparse.Namespace) -> int:
    """Write the files of every backend that was requested."""
    equations = find_equations(arguments)
    write_files(equations, arguments.backend or ["c", "numpy"], arguments.output, arguments.functions,
                arguments.templates)
    return 0


def write_files(equations: MotionEquations, backends: Sequence[str], output: Path | None,
                functions: Sequence[str] | None = None, templates: str | None = None) -> Path:
    """Write and report; returns the folder."""
    from symdyn.pipeline import emit, write_source

    operations: Mapping[str, int] = {}
    sources = [emit(equations, backend, functions, templates) for backend in backends]
    folder = output or Path("generated") / sources[0].metadata.name
    for source in sources:
        for path in write_source(source, folder):
            print(f"wrote {path}")
        operations = source.metadata.operations
    print("operations: " + ", ".join(f"{name} {count}" for name, count in operations.items()))
    print("No compiler was needed; the first lines of main.c explain how to build." if "c" in backends else
          "No compiler was needed.")
    return folder
