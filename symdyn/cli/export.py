"""`symdyn export`: a mechanism for other libraries."""

from __future__ import annotations

import argparse
from pathlib import Path

from symdyn.cli.find import find_equations
from symdyn.cli.messages import WRONG, Stop

# Option -> the library, and what is written.
LIBRARIES = {"casadi": "casadi.Function objects: NAME_casadi.py", "jax": "functions for jit, vmap, grad: NAME_jax.py",
             "torch": "functions for PyTorch: NAME_torch.py"}


def export(arguments: argparse.Namespace) -> int:
    """Write a file for every library that was asked for."""
    wanted = [target for target in LIBRARIES if getattr(arguments, target)]
    if not wanted:
        raise Stop(f"nothing to export: pass one of {', '.join(f'--{target}' for target in LIBRARIES)}", WRONG)
    from symdyn.pipeline import write_source
    from symdyn.targets.text import source_for

    equations = find_equations(arguments)
    for target in wanted:
        source = source_for(equations, target, arguments.functions)
        for path in write_source(source, arguments.output or Path("generated") / source.metadata.name):
            print(f"wrote {path}")
    return 0


def add_export(parser: argparse.ArgumentParser) -> None:
    """The options of the command."""
    for target, text in LIBRARIES.items():
        parser.add_argument(f"--{target}", action="store_true", help=f"{text}; it needs symdyn no more")
    parser.add_argument("--functions", metavar="NAME", nargs="+", help="what to write (default: rhs, mass_matrix, ...)")
