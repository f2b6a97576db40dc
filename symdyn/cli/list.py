"""`symdyn list`: the catalogue."""

from __future__ import annotations

import argparse
from pathlib import Path


def list_systems(arguments: argparse.Namespace) -> int:
    """Print a line about each system, and one about its options."""
    rows = [(name, *_about(name)) for name in _names()]
    width = max(len(row[0]) for row in rows) + 2
    for name, text, options in rows:
        print(f"{name:{width}}{text}")
        if options:
            print(f"{'':{width}}--option {options}")
    return 0


def _names() -> list[str]:
    from symdyn import systems

    return systems.names()


def _about(name: str) -> tuple[str, str]:
    """First line of the docstring, and options, read from the source: importing it would import SymPy."""
    import ast

    import symdyn

    for path in sorted(Path(symdyn.__file__).parent.joinpath("systems").glob("*.py")):
        source = path.read_text(encoding="utf-8")
        if f"def {name}(" not in source:
            continue
        for node in ast.parse(source).body:
            if isinstance(node, ast.FunctionDef) and node.name == name:
                text = (ast.get_docstring(node) or "").partition("\n")[0]
                options = zip(reversed(node.args.args), reversed(node.args.defaults))
                return text, " ".join(reversed([f"{a.arg}={ast.unparse(d).strip(chr(39))}" for a, d in options]))
    return "", ""
